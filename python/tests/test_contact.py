"""Normal contact on numpy arrays."""

import subprocess
import threading
from dataclasses import fields

import numpy as np
import pytest

import asperity

MODULUS = 344.828e6


def sphere(n=128, lx=4e-3, boundary="free"):
    return asperity.surface.shape("paraboloid", n, lx=lx, radius=0.05, boundary=boundary)


def rough(nx=96, ny=64):
    return asperity.surface.self_affine(nx, ny, 1.5e-3, 1e-3, wavelength_long=0.5e-3,
                                        wavelength_short=0.1e-3, rms_slope=0.2, seed=3)


def test_hertz():
    height = sphere()
    contact = asperity.solve_normal(height, 4e-3, None, MODULUS, force=9.1954, boundary="free",
                                    tolerance=1e-9)
    radius = (3 * 9.1954 * 0.05 / (4 * MODULUS)) ** (1 / 3)
    assert contact.force == pytest.approx(9.1954, rel=1e-8)
    # With 32 cells per radius the displacement and the peak are correct to about 1e-4.
    assert contact.displacement == pytest.approx(radius**2 / 0.05, rel=1e-3)
    assert contact.pressure.max() == pytest.approx(2 * MODULUS * radius / (np.pi * 0.05), rel=2e-3)
    assert contact.contact_area * 16e-6 == pytest.approx(np.pi * radius**2, rel=2e-2)
    summit = np.unravel_index(contact.pressure.argmax(), contact.pressure.shape)
    assert summit == (64, 64)
    # Far away the displacement vanishes: there the gap is the approach less the height of the road.
    np.testing.assert_allclose(
        contact.gap, contact.displacement_z - height - contact.displacement, atol=1e-15)


@pytest.mark.parametrize("area", [0.25, 0.6])
def test_westergaard(area):
    n, length, amplitude, modulus = 1024, 1e-3, 1e-6, 1e7
    height = amplitude * np.cos(2 * np.pi * (np.arange(n) / n))
    load = np.pi * modulus * amplitude / length * np.sin(np.pi * area / 2) ** 2
    contact = asperity.solve_normal(height, length, None, modulus, pressure=load, tolerance=1e-9)
    assert contact.pressure.shape == (n,)
    # The width is exact to one cell at each edge.
    assert contact.contact_area == pytest.approx(area, abs=3 / n)
    psi = np.pi * np.arange(n) / n
    sine = np.sin(np.pi * area / 2)
    exact = 2 * load * np.abs(np.cos(psi + 0)) / sine**2 * np.sqrt(
        np.maximum(sine**2 - np.sin(psi) ** 2, 0))
    inside = np.abs(np.sin(psi)) < 0.9 * sine
    np.testing.assert_allclose(contact.pressure[inside], exact[inside], rtol=2e-3)


def test_rough_contact_is_complementary_and_balanced():
    height = rough()
    contact = asperity.solve_normal(height, 1.5e-3, 1e-3, 1e6, pressure=2e4, tolerance=1e-9)
    assert contact.converged
    assert contact.residual <= 1e-9
    assert contact.pressure.min() >= 0
    assert contact.mean_pressure == pytest.approx(2e4, rel=1e-9)
    assert contact.gap.min() > -1e-6 * np.ptp(height)
    duality = np.sum(contact.pressure * np.abs(contact.gap)) / np.sum(contact.pressure)
    assert duality < 1e-6 * height.std()
    # U must be the response to P: 2 P/(E* q) for each wave vector.
    qx = 2 * np.pi * np.fft.rfftfreq(96, 1.5e-3 / 96)
    qy = 2 * np.pi * np.fft.fftfreq(64, 1e-3 / 64)
    q = np.hypot(qx, qy[:, None])
    q[0, 0] = np.inf
    response = np.fft.irfft2(2 / (1e6 * q) * np.fft.rfft2(contact.pressure), s=(64, 96))
    np.testing.assert_allclose(contact.displacement_z, response, atol=1e-9 * np.ptp(height))


@pytest.mark.parametrize("tolerance", [1e-8, 1e-10])
def test_the_reported_error_is_that_of_the_gap(tolerance):
    """A large load around a deep hole must not be taken for round-off of the gap."""
    height = np.zeros((60, 2048))
    height[30, 700:704] = -1e3
    contact = asperity.solve_normal(height, 2048, 60, 1.0, pressure=200, tolerance=tolerance)
    assert 0.99 < contact.contact_area < 1.0
    gap = contact.displacement_z - height
    level = (contact.pressure * gap).sum() / contact.pressure.sum()
    assert level - gap.min() <= 1.01 * tolerance * height.std()


@pytest.mark.parametrize("method", ["fast", "thesis"])
@pytest.mark.parametrize("approach", [1e-6, 1e-5])
def test_a_small_approach_on_high_plateaus(approach, method):
    """The error is relative to the displacement, which here is far below the rms height."""
    rng = np.random.default_rng(0)
    height = -1.0 * (rng.random((64, 64)) < 0.3) + 1e-5 * rng.normal(size=(64, 64))
    forces = [asperity.solve_normal(height, 1.0, 1.0, 1.0, displacement=approach, method=method,
                                    tolerance=tolerance).force for tolerance in (1e-4, 1e-9)]
    assert forces[0] == pytest.approx(forces[1], rel=1e-2)


@pytest.mark.parametrize("method", ["fast", "thesis"])
def test_a_limit_of_iterations_is_not_convergence(method):
    """An error far below the rms height can be large relative to the displacement."""
    height = np.zeros((32, 32))
    height[12:20, 12:20] = 1.0 - 1e-5 * np.hypot(*np.mgrid[-3.5:4, -3.5:4])
    given = {"displacement": 1e-6, "tolerance": 1e-4, "method": method}
    force = asperity.solve_normal(height, 1.0, 1.0, 1.0, **given).force
    stopped = 0
    for limit in range(1, 12):
        try:
            found = asperity.solve_normal(height, 1.0, 1.0, 1.0, max_iterations=limit, **given)
        except asperity.NotConverged as error:
            assert error.result.residual > 1e-4
            stopped += 1
        else:
            assert found.force == pytest.approx(force, rel=1e-2)
    assert stopped


@pytest.mark.parametrize("seed", [0, 1])
def test_long_grid_of_oblong_cells(seed):
    """A strip a hundred times as long as wide, whose cells are fifteen times as long as wide."""
    nx, ny, dy = 1187, 143, 0.068
    q = 2 * np.pi * np.hypot(np.fft.fftfreq(ny, dy)[:, None], np.fft.rfftfreq(nx)[None, :])
    inverse = np.divide(1.0, q, out=np.zeros_like(q), where=q > 0)
    noise = np.random.default_rng(seed).standard_normal((ny, nx))
    spectrum = np.fft.rfft2(noise) * np.where(q < 0.93 * np.pi, inverse**1.7, 0.0)
    slope = np.fft.irfft2(1j * q * spectrum, s=(ny, nx)).std()
    height = 0.1 / slope * np.fft.irfft2(spectrum, s=(ny, nx))
    contact = asperity.solve_normal(height, nx, ny * dy, 1.0, pressure=0.067)
    assert contact.iterations < 200

    pressure = contact.pressure
    gap = np.fft.irfft2(2.0 * inverse * np.fft.rfft2(pressure), s=(ny, nx)) - height
    gap -= (pressure * gap).sum() / pressure.sum()
    assert pressure.min() >= 0.0
    assert pressure.mean() == pytest.approx(0.067, rel=1e-6)
    assert gap.min() >= -2e-6 * height.std()


@pytest.mark.filterwarnings("ignore:patches of contact")
@pytest.mark.parametrize(("nx", "ny", "lx", "ly"), [
    (82, 2397, 37.8, 4666.0),           # oblong cells, blocks of 16 x 3 or 4 of them
    (4001, 53, 4001.0, 53.0), (7, 3001, 7.0, 3001.0), (2311, 6, 5332.0, 1.9),
    (5003, 1, 5003.0, None)])
def test_strips_of_any_length(nx, ny, lx, ly):
    rng = np.random.default_rng(nx)
    waves = np.hypot(np.fft.fftfreq(nx), np.fft.fftfreq(ny)[:, np.newaxis])
    spectrum = np.where((waves >= 0.01) & (waves <= 0.12), np.maximum(waves, 0.01) ** -1.6, 0.0)
    height = np.fft.ifft2(spectrum * np.exp(2j * np.pi * rng.random((ny, nx)))).real
    height *= 0.1 / np.std(np.diff(height, axis=int(nx > ny)))
    modulus = 2 * np.pi * np.hypot(np.fft.fftfreq(nx, lx / nx),
                                   np.fft.fftfreq(ny, (ly or 1.0) / ny)[:, np.newaxis]) / 2
    modulus[0, 0] = np.inf
    control = {"pressure": 0.003}
    for _ in range(2):
        contact = asperity.solve_normal(height, lx, ly, 1.0, **control)
        pressure = contact.pressure.reshape(height.shape)
        displacement = np.fft.ifft2(np.fft.fft2(pressure) / modulus).real
        gap = displacement - height
        level = np.average(gap, weights=pressure)
        assert pressure.min() >= 0
        assert level - gap.min() <= 1.1e-6 * height.std()
        assert np.average(np.abs(gap - level), weights=pressure) <= 1.1e-6 * height.std()
        assert pressure.mean() == pytest.approx(0.003, rel=1e-4)
        assert contact.iterations <= 25
        control = {"displacement": contact.displacement}


@pytest.mark.filterwarnings("ignore:patches of contact", "ignore:cells of")
@pytest.mark.parametrize(("kind", "nx", "ny", "ratio", "part"), [
    ("noise", 4, 800, 99.0, 0.95), ("noise", 8, 400, 20.0, 0.6), ("noise", 400, 8, 1 / 30, 0.5),
    ("noise", 2, 2000, 5.0, 0.6), ("walk", 2, 1500, 1.0, 0.6), ("walk", 3, 2339, 0.2, 0.3),
    ("waves", 8, 2671, 30.0, 0.5)])
def test_grids_of_any_shape_at_a_given_approach(kind, nx, ny, ratio, part):
    """Such contacts took hundreds of iterations, because the residual was extended too little."""
    height = np.random.default_rng(nx + ny).standard_normal((ny, nx))
    if kind == "walk":
        height = np.cumsum(height, axis=0)
        height -= np.linspace(0, 1, ny)[:, np.newaxis] * height[-1]
        height = np.minimum(height, np.quantile(height, 0.8))
    elif kind == "waves":
        height = (np.cos(4 * np.pi * np.arange(nx) / nx)
                  + np.cos(2 * np.pi * np.arange(ny) / ny)[:, np.newaxis])
    displacement = part * (height.max() - height.mean())
    contact = asperity.solve_normal(height, nx, ny * ratio, 1.0, displacement=displacement)

    modulus = np.pi * np.hypot(np.fft.fftfreq(nx), np.fft.fftfreq(ny, ratio)[:, np.newaxis])
    modulus[0, 0] = np.inf
    gap = np.fft.ifft2(np.fft.fft2(contact.pressure) / modulus).real - height
    gap += height.max() - displacement                # of the far solid from the highest cell
    assert contact.pressure.min() >= 0
    assert gap.min() >= -1e-6 * height.std()
    assert np.average(np.abs(gap), weights=contact.pressure) <= 1.1e-6 * height.std()
    assert contact.iterations <= 50
    # A start from this contact takes hardly more iterations than none.
    pressure = contact.pressure.mean()
    again = asperity.solve_normal(height, nx, ny * ratio, 1.0, pressure=pressure, start=contact)
    assert again.iterations <= 1
    cold = asperity.solve_normal(height, nx, ny * ratio, 1.0, pressure=pressure / 3)
    warm = asperity.solve_normal(height, nx, ny * ratio, 1.0, pressure=pressure / 3, start=contact)
    assert warm.iterations <= 1.5 * cold.iterations


@pytest.mark.filterwarnings("ignore:patches of contact")
@pytest.mark.parametrize("control", [{"force": 1e-3}, {"displacement": 0.01}])
def test_the_residual_of_a_small_contact(control):
    """It is relative to ten times the displacement, if that is less than the rms height."""
    x = np.arange(64) - 32.0
    height = -(x**2 + x[:, np.newaxis] ** 2) / 2e3
    contact = asperity.solve_normal(height, 64.0, 64.0, 1.0, boundary="free", **control)
    load = contact.pressure / contact.pressure.sum()
    gap = contact.gap + height                        # the displacement, but for a constant
    scale = 10 * (load * (gap + contact.displacement - height.max())).sum()
    assert scale < 0.5 * height.std()
    error = (load * contact.gap).sum() - contact.gap.min()
    assert 0.5 * error / scale <= contact.residual <= 1.01 * error / scale


@pytest.mark.parametrize("height", [0.0, 0.1, 1000 / 3])
def test_a_flat_map_at_its_first_touch(height):
    """With adhesion the cells stick at the first touch, and the pressure is not determined."""
    flat = np.full((10, 10), height)
    for displacement in (0.0, -1e-20):
        contact = asperity.solve_normal(flat, 1.0, 1.0, 1.0, displacement=displacement)
        assert contact.converged and not contact.pressure.any()
    with pytest.raises(ValueError, match="below 0 m"):
        asperity.solve_normal(flat, 1.0, 1.0, 1.0, displacement=1e-3)
    with pytest.raises(ValueError, match="below 0 m"):
        asperity.solve_adhesive(flat, 1.0, 1.0, 1.0, displacement=0.0, potential="exponential",
                                energy=1e-3, range=1e-2)


@pytest.mark.parametrize("boundary", ["periodic", "free"])
@pytest.mark.parametrize("method", ["fast", "thesis"])
@pytest.mark.parametrize("displacement", [0.0, -1e-5])
def test_without_touch_the_pressure_is_zero(program, tmp_path, boundary, method, displacement):
    """The command accepted such a displacement, and `solve_normal` refused it."""
    height = rough()
    given = {"displacement": displacement, "boundary": boundary, "method": method}
    warm = asperity.solve_normal(height, 1.5e-3, 1e-3, 1e6, pressure=1e4, boundary=boundary)
    for start in (None, warm):
        contact = asperity.solve_normal(height, 1.5e-3, 1e-3, 1e6, start=start, **given)
        assert contact.converged and not contact.pressure.any()
        assert contact.force == contact.contact_area == 0.0
        assert contact.displacement == pytest.approx(displacement, abs=1e-18)
        np.testing.assert_allclose(contact.gap, height.max() - displacement - height, atol=1e-18)
    asperity.surface.save(tmp_path / "road.h5", height, 1.5e-3, 1e-3)
    (tmp_path / "case.nml").write_text(f"""
        &grid nx = 96, ny = 64, lx = 1.5e-3, ly = 1e-3, boundary = '{boundary}' /
        &surface shape = 'file', file = 'road.h5' /
        &material shear_modulus = 1e6 /
        &solver method = '{method}' /
        &phase displacement = {displacement} /""")
    subprocess.run([program, "run", "case.nml", "--quiet"], cwd=tmp_path, check=True)
    run = asperity.open(tmp_path / "case.h5")
    assert run.history["pressure"][-1] == run.history["contact_area"][-1] == 0.0
    np.testing.assert_allclose(run.snapshots[-1].gap, contact.gap, atol=1e-18)


def test_a_run_names_the_displacement_of_full_contact(program, tmp_path):
    """A jump beyond it has no solution; a ramp ends where there is none."""
    def run(phases, boundary="periodic"):
        (tmp_path / "case.nml").write_text(f"""
            &grid nx = 20, ny = 24, lx = 1.0, boundary = '{boundary}' /
            &surface shape = 'sine', amplitude = 1e-3, wavelength = 1.0 /
            &material shear_modulus = 1e6 /
            {phases}""")
        done = subprocess.run([program, "run", "case.nml", "--quiet", "--overwrite"], cwd=tmp_path,
                              text=True, capture_output=True)
        return done.returncode, done.stderr

    limit = (" must be below 0.001 m, the mean gap at first touch: beyond it the pressure of a"
             " periodic contact is not determined")
    status, message = run("&phase displacement = 2e-3 /")
    assert status == 4 and f"the displacement leaves no gap. It is 0.002 m and{limit};" in message

    ramp = "&phase displacement = {}, ramp = 'linear', duration = 1.0, steps = 4 /"
    status, message = run(ramp.format(2.4e-3))
    assert status == 4 and "step 2 of phase 1, t = 0.5 s: the solver did not converge" in message
    assert f"full contact: the displacement leaves no gap. It is 0.0012 m and{limit};" in message
    history = asperity.open(tmp_path / "case.h5").history
    assert history.rows == 3 and history["pressure"][1] > 0.0
    assert run(ramp.format(0.99e-3))[0] == 0
    assert run("&phase displacement = 2e-3 /", "free")[0] == 0


def test_displacement_gives_back_the_load():
    height = rough()
    loaded = asperity.solve_normal(height, 1.5e-3, 1e-3, 1e6, pressure=2e4, tolerance=1e-10)
    pressed = asperity.solve_normal(height, 1.5e-3, 1e-3, 1e6, displacement=loaded.displacement,
                                    tolerance=1e-10)
    assert pressed.mean_pressure == pytest.approx(2e4, rel=1e-6)
    assert pressed.displacement == pytest.approx(loaded.displacement, rel=1e-12)


def test_methods_agree_and_a_start_helps():
    height = rough()
    fast = asperity.solve_normal(height, 1.5e-3, 1e-3, 1e6, pressure=2e4, tolerance=1e-9)
    thesis = asperity.solve_normal(height, 1.5e-3, 1e-3, 1e6, pressure=2e4, tolerance=1e-9,
                                   method="thesis", max_iterations=20000)
    np.testing.assert_allclose(fast.pressure, thesis.pressure, atol=1e-4 * fast.pressure.max())
    again = asperity.solve_normal(height, 1.5e-3, 1e-3, 1e6, pressure=2e4, tolerance=1e-8,
                                  start=fast)
    assert again.iterations < fast.iterations
    np.testing.assert_allclose(again.pressure, fast.pressure, atol=1e-4 * fast.pressure.max())


def test_any_memory_order_and_type():
    height = rough()
    single = height.astype(np.float32)
    expected = asperity.solve_normal(single.astype(float), 1.5e-3, 1e-3, 1e6, pressure=2e4)
    wide = np.zeros((128, 96), dtype=np.float32)
    wide[::2] = single
    for given in (np.asfortranarray(single), wide[::2], single.tolist()):
        contact = asperity.solve_normal(given, 1.5e-3, 1e-3, 1e6, pressure=2e4)
        np.testing.assert_allclose(contact.pressure, expected.pressure,
                                   atol=1e-9 * expected.pressure.max())
    # Mirrored and transposed maps count too: strides may be negative.
    mirrored = asperity.solve_normal(height[:, ::-1], 1.5e-3, 1e-3, 1e6, pressure=2e4,
                                     tolerance=1e-9)
    straight = asperity.solve_normal(height, 1.5e-3, 1e-3, 1e6, pressure=2e4, tolerance=1e-9)
    np.testing.assert_allclose(mirrored.pressure[:, ::-1], straight.pressure,
                               atol=1e-3 * straight.pressure.max())


def test_the_height_is_left_as_it_is():
    height = rough()
    before = height.copy()
    asperity.solve_normal(height, 1.5e-3, 1e-3, 1e6, pressure=2e4)
    np.testing.assert_array_equal(height, before)


def test_two_threads_of_python():
    height = rough()
    alone = asperity.solve_normal(height, 1.5e-3, 1e-3, 1e6, pressure=2e4)
    found = [None, None]

    def solve(place):
        found[place] = asperity.solve_normal(height, 1.5e-3, 1e-3, 1e6, pressure=2e4)

    threads = [threading.Thread(target=solve, args=(place,)) for place in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for contact in found:
        np.testing.assert_allclose(contact.pressure, alone.pressure,
                                   atol=1e-9 * alone.pressure.max())


def test_no_convergence_carries_the_best_result():
    with pytest.raises(asperity.NotConverged, match="did not converge: residual") as caught:
        asperity.solve_normal(rough(), 1.5e-3, 1e-3, 1e6, pressure=2e4, tolerance=1e-12,
                              max_iterations=3)
    result = caught.value.result
    assert not result.converged
    assert result.iterations <= 3
    assert result.pressure.shape == (64, 96)
    assert {field.name for field in fields(result)} >= {"pressure", "gap", "residual"}


@pytest.mark.parametrize(("changes", "message"), [
    ({"height": np.zeros((2, 2, 2))}, r"height: has shape \(2, 2, 2\): must be \(ny, nx\)"),
    ({"height": np.array([[0.0, np.nan]])}, r"height\[0, 1\] = nan: must be finite"),
    ({"height": [["a"]]}, "height: must be an array of real numbers"),
    ({"height": [[1.0 + 1.0j]]}, "height: must be an array of real numbers"),
    ({"lx": 0.0}, "lx = 0.0: must be a finite number > 0"),
    ({"ly": -1.0}, "ly = -1.0"),
    ({"modulus": np.inf}, "modulus = inf"),
    ({"pressure": -1.0}, "pressure = -1.0"),
    ({"pressure": None}, "must be exactly one of pressure, force, displacement"),
    ({"force": 1.0}, "pressure, force given: must be exactly one of"),
    ({"pressure": None, "displacement": 1.0}, "displacement = 1.0: must be below"),
    ({"boundary": "open"}, "boundary = 'open': must be one of 'periodic', 'free'"),
    ({"method": "slow"}, "method = 'slow': must be one of 'fast', 'thesis'"),
    ({"tolerance": 0.0}, "tolerance = 0.0"),
    ({"tolerance": 1}, "tolerance = 1: must be a finite number > 0 and < 1"),
    ({"max_iterations": 0}, "max_iterations = 0: must be a positive integer"),
    ({"start": np.zeros((3, 3))}, r"start: has shape \(3, 3\): must be \(64, 96\)"),
    ({"height": np.zeros((1, 8)), "boundary": "free"}, "must be 'periodic'"),
])
def test_wrong_values(changes, message):
    arguments = {"height": rough(), "lx": 1e-3, "ly": None, "modulus": 1e6, "pressure": 1e4}
    with pytest.raises(ValueError, match=message):
        asperity.solve_normal(**(arguments | changes))


def test_masked_points_are_refused():
    """Values under a mask are not heights, so a masked map is refused."""
    height = np.ma.masked_array(np.ones((4, 6)), False)
    height[1, 2] = np.ma.masked
    for call in (lambda: asperity.solve_normal(height, 1.0, 1.0, 1e6, pressure=1.0),
                 lambda: asperity.surface.psd(height, 1.0),
                 lambda: asperity.surface.statistics(height, 1.0)):
        with pytest.raises(ValueError, match="height: has 1 of 24 points masked: fill them"):
            call()
    with pytest.raises(ValueError, match="pressure = '1e4': must be a finite number > 0"):
        asperity.solve_normal(np.eye(4), 1.0, 1.0, 1e6, pressure="1e4")


def test_steps_that_end_on_the_bound_at_once():
    # The preconditioned directions of this wave of 13 cells violate the constraints at once. Trials
    # that hardly descend must become shorter, as those that do not descend at all.
    heights = """
        0x1.b13bcfe194112p-8 0x1.86e62bc5f1e3cp-8 0x1.5c1b8a5e8baa1p-13 -0x1.7a8a356c0cee1p-8
        -0x1.b8f2dcc7ab5d8p-8 -0x1.e9bd5ccc7b64cp-10 0x1.2dd8c4ca88328p-8 0x1.d15f3652ecd66p-8
        0x1.c5c084e76d146p-9 -0x1.9f3908598b30dp-9 -0x1.cebfdb42e72cdp-8 -0x1.3e21c3d459d42p-8
        0x1.953ddc7cdf619p-10"""
    height = [float.fromhex(text) for text in heights.split()]
    load = {"lx": 1, "ly": 1, "modulus": float.fromhex("0x1.91ad3508703fcp-6"),
            "pressure": float.fromhex("0x1.956e32c7a86eep-14"), "tolerance": 1e-10}
    fast = asperity.solve_normal([height], **load)
    assert fast.iterations < 50
    thesis = asperity.solve_normal([height], **load, method="thesis")
    assert np.count_nonzero(thesis.pressure) == 3
    np.testing.assert_allclose(fast.pressure, thesis.pressure, atol=1e-8 * load["pressure"])


def test_contact_of_one_cell_grows():
    # The first state touches in one cell, where the residual and thus the direction are exactly 0.
    # An earlier version took that cell for one outside the contact, and the step changed the load.
    height = [[0.002, 0.0, 0.002, 0.002, 0.0]]
    contact = asperity.solve_normal(height, 1, 1, 1, pressure=1.543077062748773e-05)
    assert contact.mean_pressure == pytest.approx(1.543077062748773e-05, rel=1e-9)
    # By symmetry there are two pressures: p1, and p2 twice. Their displacements are equal.
    k = np.arange(1, 5)
    q = 2 * np.pi * np.minimum(k, 5 - k)
    kernel = np.array([(2 / q * np.cos(2 * np.pi * k * j / 5)).sum() / 5 for j in range(5)])
    rows = np.array([[kernel[0], kernel[2] + kernel[3]],
                     [kernel[2], kernel[0] + kernel[1]]])
    p1, p2 = np.linalg.solve(np.vstack([rows[0] - rows[1], [1, 2]]),
                             [0.0, 5 * 1.543077062748773e-05])
    np.testing.assert_allclose(contact.pressure[0], [p1, 0, p2, p2, 0], rtol=1e-4)


def test_small_grids_all_converge():
    rng = np.random.default_rng(5)
    for _ in range(400):
        nx, ny = (int(n) for n in rng.integers(2, 9, 2))
        height = 0.01 * np.round(rng.standard_normal((ny, nx)))
        given = {"pressure": 10.0 ** rng.uniform(-7, -2)}
        if rng.random() < 0.3:
            given = {"displacement": 0.02 * rng.random(), "boundary": "free"}
        contact = asperity.solve_normal(height, 1.0, float(ny / nx), 1.0, tolerance=1e-9, **given)
        assert contact.converged


def test_tiny_loads_are_met():
    rng = np.random.default_rng(6)
    for _ in range(150):
        height = 10.0 ** rng.uniform(-4, -1) * rng.standard_normal((7, 9)) + rng.uniform(-1, 1)
        pressure = 1e6 * 10.0 ** rng.uniform(-22, -11)
        contact = asperity.solve_normal(height, 1.0, 0.8, 1e6, pressure=pressure, tolerance=1e-8)
        assert contact.mean_pressure == pytest.approx(pressure, rel=1e-8)
        assert contact.pressure.ravel().argmax() == height.ravel().argmax()


def test_round_off_is_no_contact():
    """A cell from which a step took the whole pressure is open, whatever round-off left behind."""
    x = np.arange(5) / 5
    height = 1.5e-6 * np.cos(2 * np.pi * x)[None, :] * np.cos(2 * np.pi * x)[:, None]
    for pressure in np.geomspace(1e3, 1e6, 40):
        contact = asperity.solve_normal(height, 5e-5, None, 2e6, pressure=pressure)
        touching = contact.pressure > 0
        assert contact.gap[touching].max() < 1e-4 * 1.5e-6, pressure
        assert contact.contact_area == touching.mean()


@pytest.mark.filterwarnings("ignore:patches of contact")
@pytest.mark.parametrize("boundary", ["periodic", "free"])
@pytest.mark.parametrize("method", ["fast", "thesis"])
def test_an_approach_below_the_tolerance_has_a_force(boundary, method):
    # The bodies overlap by less than the tolerance times the rms height, but they touch.
    n, side, radius = 64, 1e-3, 1e-2
    x = (np.arange(n) + 0.5) * side / n - side / 2
    height = -(x[None, :] ** 2 + x[:, None] ** 2) / (2 * radius)
    given = {"boundary": boundary, "displacement": 0.9e-3 * height.std(), "method": method}
    exact = asperity.solve_normal(height, side, side, 4e6, tolerance=1e-10, **given)
    rough = asperity.solve_normal(height, side, side, 4e6, tolerance=1e-3, **given)
    assert exact.force > 0
    assert rough.force == pytest.approx(exact.force, rel=0.03)


def test_a_flat_punch_on_a_long_strip_is_accurate():
    # Love's displacement of five cells in a row, 183 times as long as wide: it must be uniform.
    length, width, modulus = 0.183, 1e-3, 4e6
    found = asperity.solve_normal(np.zeros((5, 1)), width, 5 * length, modulus, boundary="free",
                                  pressure=1e3, tolerance=1e-4)
    ends = np.array([-0.5, 0.5])
    moved = np.zeros(5)
    for i in range(5):
        for j in range(5):
            a = ends[None, :] * width
            b = (i - j + ends[:, None]) * length
            corner = a * np.arcsinh(b / abs(a)) + b * np.arcsinh(a / abs(b))
            part = corner[1, 1] - corner[1, 0] - corner[0, 1] + corner[0, 0]
            moved[i] += found.pressure[j, 0] * part / (np.pi * modulus)
    assert np.ptp(moved) < 1e-3 * moved.mean()


@pytest.mark.parametrize(("nx", "ny"), [(64, 64), (44, 31), (96, 1)])
@pytest.mark.parametrize("pressure", [1e-9, 1e-2, 10.0])
def test_uniform_start_of_given_approach(nx, ny, pressure):
    """On a periodic grid the first step takes the same pressure from all cells."""
    x, y = np.meshgrid(np.arange(nx) / nx, np.arange(ny) / ny)
    height = 1e-2 * (np.cos(2 * np.pi * x) + np.cos(2 * np.pi * y))
    reference = asperity.solve_normal(height, 1.0, 1.0, 1.0, displacement=5e-3)
    done = asperity.solve_normal(height, 1.0, 1.0, 1.0, displacement=5e-3,
                                 start=np.full((ny, nx), pressure))
    difference = np.abs(done.pressure - reference.pressure).max()
    assert difference < 1e-4 * reference.pressure.max()
