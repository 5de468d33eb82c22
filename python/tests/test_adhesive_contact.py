"""Adhesive contact on numpy arrays, against theory and against the program."""

import re
import signal
import subprocess
import warnings

import numpy as np
import pytest
import viscoelastic_case as vc
from conftest import PATIENCE

import asperity
from asperity.theory import dmt, jkr, maugis

RADIUS, MODULUS, ENERGY = 1e-4, 4e6, 0.05
#: (R w^2/E*^2)^(1/3), the range at which the Tabor parameter is 1
LENGTH = (RADIUS * ENERGY**2 / MODULUS**2) ** (1 / 3)
SIDE = 40e-6


def sphere(n, lx=SIDE):
    return asperity.surface.shape("paraboloid", n, lx=lx, radius=RADIUS, boundary="free")


def press(n, lx=SIDE, **given):
    given = {"energy": ENERGY, "boundary": "free", "potential": "maugis_dugdale"} | given
    return asperity.solve_adhesive(sphere(n, lx), lx, None, MODULUS, **given)


def wavy(nx=48, ny=40):
    return asperity.surface.self_affine(nx, ny, 40e-6, 33e-6, wavelength_long=20e-6,
                                        wavelength_short=5e-6, rms_height=0.25e-6, seed=4)


def radius_of(contact, lx=SIDE):
    return np.sqrt(contact.contact_area * lx**2 / np.pi)


@pytest.mark.parametrize(("tabor", "side"), [(0.1, 64e-6), (0.3, 44e-6), (0.7, 40e-6)])
def test_maugis(tabor, side):
    contact = press(128, side, range=LENGTH / tabor, force=2e-5)
    exact = maugis(RADIUS, MODULUS, ENERGY, force=2e-5, range=LENGTH / tabor)
    # The radius has some 20 cells; counting cells gives it to a third of a cell.
    assert radius_of(contact, side) == pytest.approx(exact.contact_radius, rel=0.015)
    assert contact.force == pytest.approx(2e-5, rel=1e-5)
    assert contact.displacement == pytest.approx(exact.approach, abs=0.03 * LENGTH)


def test_long_range_is_dmt():
    side, length = 130e-6, LENGTH / 0.02
    contact = press(180, side, range=length, force=2e-5)
    exact = dmt(RADIUS, MODULUS, ENERGY, force=2e-5)
    # The Tabor parameter is 0.02, where Maugis's radius is 1.5 % above DMT's.
    assert radius_of(contact, side) == pytest.approx(exact.contact_radius, rel=0.03)


def test_short_range_is_jkr_and_converges():
    exact = jkr(RADIUS, MODULUS, ENERGY, force=2e-5)
    errors = []
    for tabor in (1.0, 3.0):
        contact = press(128, range=LENGTH / tabor, potential="exponential", force=2e-5)
        errors.append(abs(contact.displacement / exact.approach - 1))
    assert errors[1] < 0.5 * errors[0]
    assert errors[1] < 0.05
    assert radius_of(contact) == pytest.approx(exact.contact_radius, rel=0.03)


@pytest.mark.parametrize("potential", ["exponential", "gauss", "maugis_dugdale"])
@pytest.mark.parametrize("boundary", ["periodic", "free"])
def test_conditions_recomputed(potential, boundary):
    height, z0 = wavy(), 0.4e-6
    contact = asperity.solve_adhesive(
        height, 40e-6, 33e-6, MODULUS, potential=potential, energy=0.01, range=z0, pressure=2e4,
        boundary=boundary, tolerance=1e-8)
    x = contact.gap / z0
    edge = 0.01 / z0 * max(40e-6 / height.shape[1], 33e-6 / height.shape[0]) / MODULUS
    slope = {"exponential": np.exp(-x), "gauss": 2 * x * np.exp(-x**2),
             "maugis_dugdale": np.clip((z0 + edge - contact.gap) / (2 * edge), 0, 1)}[
                 potential] * 0.01 / z0
    np.testing.assert_allclose(contact.adhesive_pressure, -slope, atol=1e-9)
    wall = contact.pressure + slope
    assert contact.gap.min() == 0.0
    assert np.abs(np.minimum(x, wall * z0 / 0.01)).max() < 1e-7
    assert 0.0 < contact.contact_area < 1.0
    assert contact.contact_area == np.mean(contact.gap == 0.0)
    assert contact.mean_pressure == pytest.approx(2e4, rel=1e-6)
    # The displacement must be the response to the pressure.
    if boundary == "periodic":
        ny, nx = height.shape
        q = 2 * np.pi * np.hypot(np.fft.fftfreq(ny, 33e-6 / ny)[:, None],
                                 np.fft.rfftfreq(nx, 40e-6 / nx)[None, :])
        q[0, 0] = np.inf
        u = np.fft.irfft2(2 / (MODULUS * q) * np.fft.rfft2(contact.pressure), s=(ny, nx))
        np.testing.assert_allclose(contact.displacement_z, u, atol=1e-7 * z0)
        energy = 0.5 * (contact.pressure * u).sum() * 40e-6 * 33e-6 / (nx * ny)
        assert contact.energy_elastic == pytest.approx(energy, rel=1e-6)


LAWS = {"exponential": lambda x: np.exp(-x), "gauss": lambda x: 2 * x * np.exp(-x**2)}


@pytest.mark.parametrize("potential", LAWS)
@pytest.mark.parametrize(("boundary", "method"), [
    ("periodic", "fast"), ("periodic", "thesis"), ("free", "fast")])
def test_attraction_that_is_a_function(potential, boundary, method):
    energy, z0 = 0.01, 0.4e-6
    given = {"pressure": 2e4, "boundary": boundary, "tolerance": 1e-8, "method": method}
    known = asperity.solve_adhesive(wavy(), 40e-6, 33e-6, MODULUS, potential=potential,
                                    energy=energy, range=z0, **given)
    calls = []

    def attraction(gap):
        calls.append(gap)
        return energy / z0 * LAWS[potential](gap / z0)

    found = asperity.solve_adhesive(wavy(), 40e-6, 33e-6, MODULUS, potential=attraction,
                                    range=30 * z0, **given)
    assert len(calls) == 1 and calls[0][0] == 0.0 and calls[0][-1] == 30 * z0
    largest = known.pressure.max()
    np.testing.assert_allclose(found.pressure, known.pressure, atol=1e-5 * largest)
    np.testing.assert_allclose(found.adhesive_pressure, known.adhesive_pressure,
                               atol=1e-5 * energy / z0)
    assert found.contact_area == known.contact_area
    assert found.energy_adhesive == pytest.approx(known.energy_adhesive, rel=1e-5)
    assert found.converged and found.residual <= 1e-8


def test_jump_of_a_function_is_the_jump_of_maugis():
    given = {"range": LENGTH / 0.3, "force": 2e-5, "boundary": "free"}
    exact = maugis(RADIUS, MODULUS, ENERGY, force=2e-5, range=LENGTH / 0.3)
    # The attraction of this function ends with a jump at the range.
    with pytest.warns(UserWarning, match="steepest fall of the attraction"):
        found = asperity.solve_adhesive(sphere(96, 44e-6), 44e-6, None, MODULUS, **given,
                                        potential=lambda gap: 0 * gap + ENERGY / given["range"])
    assert radius_of(found, 44e-6) == pytest.approx(exact.contact_radius, rel=0.02)
    assert found.displacement == pytest.approx(exact.approach, abs=0.04 * LENGTH)


@pytest.mark.parametrize(("potential", "more", "said"), [
    (lambda gap: -gap, {}, "attraction is .* at the gap .* must be finite and 0 or more"),
    (lambda gap: np.full_like(gap, np.nan), {}, "must be finite"),
    (lambda gap: 1.0, {}, r"returns shape \(\) for gaps of shape"),
    (lambda gap: "no", {}, "could not convert"),
    (lambda: 1.0, {}, "must take an array of gaps"),
    (lambda gap: 0 * gap, {"energy": 1.0}, "must be left out"),
    ("exponential", {}, "energy: is missing")])
def test_functions_that_are_refused(potential, more, said):
    with pytest.raises(ValueError, match=said):
        asperity.solve_adhesive(wavy(), 40e-6, 33e-6, MODULUS, potential=potential, range=1e-6,
                                pressure=1e4, **more)


@pytest.mark.parametrize("tolerance", [0.0, 1.0, 3])
def test_a_tolerance_is_between_0_and_1(tolerance):
    with pytest.raises(ValueError, match=f"tolerance = {tolerance}: must be .* > 0 and < 1"):
        asperity.solve_adhesive(wavy(), 40e-6, 33e-6, MODULUS, energy=0.05, range=1e-6,
                                pressure=1e4, tolerance=tolerance)


def test_function_without_attraction_is_no_adhesion():
    given = {"pressure": 3e4, "tolerance": 1e-9}
    bare = asperity.solve_normal(wavy(), 40e-6, 33e-6, MODULUS, **given)
    zero = asperity.solve_adhesive(wavy(), 40e-6, 33e-6, MODULUS, range=1e-7,
                                   potential=np.zeros_like, **given)
    np.testing.assert_allclose(zero.pressure, bare.pressure, atol=1e-4 * bare.pressure.max())
    assert zero.energy_adhesive == 0.0


def test_controls_agree_and_force_is_the_derivative_of_the_energy():
    pressed = press(48, range=LENGTH, potential="exponential", force=1e-5, tolerance=1e-9)
    driven = press(48, range=LENGTH, potential="exponential", tolerance=1e-9,
                   displacement=pressed.displacement)
    assert driven.force == pytest.approx(1e-5, rel=1e-6)
    step = 2e-10
    ends = [press(48, range=LENGTH, potential="exponential", tolerance=1e-9, start=driven,
                  displacement=pressed.displacement + sign * step) for sign in (-1, 1)]
    energies = [end.energy_elastic + end.energy_adhesive for end in ends]
    assert (energies[1] - energies[0]) / (2 * step) == pytest.approx(driven.force, rel=2e-3)


@pytest.mark.parametrize(("shape", "reach"), [((1, 16), 1e-8), ((1, 20), 1e-9), ((16, 16), 3e-8)])
def test_every_approach_of_a_few_touching_cells_converges(shape, reach):
    # The gap of a cell in contact may start as round-off, and must not count as open in the load.
    ny, nx = shape
    side = 1e-3
    cell = side / nx
    waves = {"wave": 1e-6 * np.cos(2 * np.pi * np.arange(nx) / nx) * np.ones((ny, 1)),
             "spike": np.zeros(shape)}
    waves["spike"][0, 0] = 1e-6
    energy = 0.035 * MODULUS * reach**2 / cell
    stiffness = 0.5 * MODULUS * 2 * np.pi * np.hypot(
        np.fft.fftfreq(nx, cell)[None, :], np.fft.fftfreq(ny, cell)[:, None])
    for name, height in waves.items():
        for approach in np.linspace(2.5e-9, 5e-7, 60):
            found = asperity.solve_adhesive(height, side, None, MODULUS, energy=energy, range=reach,
                                            displacement=approach)
            bent = np.fft.ifft2(stiffness * np.fft.fft2(height + found.gap)).real
            slope = bent + energy / reach * np.exp(-found.gap / reach)
            load = -slope[found.gap > 0].mean()
            unit = max(energy / reach, abs(slope).max())
            natural = np.minimum(found.gap / reach, (slope + load) / unit)
            assert np.abs(natural).max() < 3e-6, (name, approach)
            assert found.mean_pressure == pytest.approx(load, rel=1e-4, abs=1e-5 * unit)


def test_the_solution_depends_on_the_start():
    height = asperity.surface.shape("hexagonal_wave", 48, 27, lx=40e-6, ly=40e-6 / 3**0.5,
                                    amplitude=1e-6, wavelength=40e-6)
    given = {"energy": ENERGY, "range": 0.1e-6, "pressure": 0.0}
    apart = asperity.solve_adhesive(height, 40e-6, 40e-6 / 3**0.5, MODULUS, **given)
    whole = asperity.solve_adhesive(height, 40e-6, 40e-6 / 3**0.5, MODULUS, start="full_contact",
                                    **given)
    assert 0 < apart.contact_area < whole.contact_area == 1.0
    again = asperity.solve_adhesive(height, 40e-6, 40e-6 / 3**0.5, MODULUS, start=whole, **given)
    assert again.iterations == 0
    assert again.contact_area == 1.0


def test_pulled_and_detached():
    held = press(48, range=0.3e-6, potential="exponential", force=-1e-5)
    assert held.contact_area > 0
    with pytest.raises(asperity.NotConverged, match="detached") as caught:
        press(48, range=0.3e-6, potential="exponential", force=-4e-5, start=held)
    assert caught.value.result.reason == "detached"
    assert np.isfinite(caught.value.result.pressure).all()


def test_no_energy_is_no_adhesion():
    given = {"pressure": 3e4, "tolerance": 1e-9}
    bare = asperity.solve_normal(wavy(), 40e-6, 33e-6, MODULUS, **given)
    zero = asperity.solve_adhesive(wavy(), 40e-6, 33e-6, MODULUS, energy=0.0, range=1e-7, **given)
    np.testing.assert_allclose(zero.pressure, bare.pressure, atol=1e-4 * bare.pressure.max())
    assert zero.energy_adhesive == 0.0


def test_methods_memory_orders_and_lines():
    given = {"energy": 0.01, "range": 0.4e-6, "pressure": 2e4, "tolerance": 1e-8}
    fast = asperity.solve_adhesive(wavy(), 40e-6, 33e-6, MODULUS, **given)
    other = asperity.solve_adhesive(np.asfortranarray(wavy()), 40e-6, 33e-6, MODULUS,
                                    method="thesis", **given)
    np.testing.assert_allclose(fast.pressure, other.pressure, atol=1e-5 * fast.pressure.max())
    line = asperity.solve_adhesive(wavy()[0], 40e-6, None, MODULUS, **given)
    assert line.pressure.shape == line.adhesive_pressure.shape == (48,)


@pytest.mark.parametrize(("given", "message"), [
    ({"energy": -1.0}, "energy = -1.0"),
    ({"range": 0.0}, "range = 0.0"),
    ({"potential": "morse"}, "potential = 'morse'"),
    ({"start": "middle"}, "start = 'middle'"),
    ({"start": 3}, "start: is of type int"),
    ({"force": 1.0}, "pressure, force given"),
    ({"pressure": float("nan")}, "pressure = nan"),
    ({"method": "thesis", "boundary": "free"}, "method = 'thesis'"),
    ({"max_iterations": 0}, "max_iterations = 0"),
    ({"pressure": None, "displacement": 1.0}, "displacement = 1.0"),
])
def test_faults(given, message):
    given = {"energy": 0.01, "range": 1e-7, "pressure": 1e4} | given
    with pytest.raises(ValueError, match=message):
        asperity.solve_adhesive(wavy(), 40e-6, 33e-6, MODULUS, **given)


DETACHES = """
&grid nx = 48, ny = 44, lx = 40e-6, ly = 38e-6, boundary = 'free' /
&surface shape = 'paraboloid', radius = 1e-4 /
&material shear_modulus = 1e6 /
&adhesion potential = 'exponential', energy = 0.05, range = 0.3e-6 /
&phase force = 1e-5 /
&phase force = -1e-5 /
&phase force = -4e-5 /
&phase force = 1e-5 /
"""


def test_program_reports_detachment(program, tmp_path):
    case = tmp_path / "pulled.nml"
    case.write_text(DETACHES)
    done = subprocess.run([program, "run", str(case), "--quiet"], capture_output=True, text=True)
    assert done.returncode == 4
    assert "detached" in done.stderr
    result = asperity.open(case.with_suffix(".h5"))
    assert not result.finished
    assert list(result.history["force"][:2]) == pytest.approx([1e-5, -1e-5], rel=1e-5)
    assert (result.history["contact_area"][:2] > 0).all()
    assert len(result.history["force"]) <= 3
    # The library must find the same state.
    first = asperity.solve_adhesive(sphere_map(), 40e-6, 38e-6, MODULUS, energy=ENERGY,
                                    range=0.3e-6, force=1e-5, boundary="free")
    assert first.displacement == pytest.approx(result.history["displacement"][0], rel=1e-9)


def sphere_map():
    return asperity.surface.shape("paraboloid", 48, 44, lx=40e-6, ly=38e-6, radius=RADIUS,
                                  boundary="free")


@pytest.mark.parametrize(("potential", "share"), [("exponential", 0.7), ("maugis_dugdale", 1.0)])
def test_cells_too_coarse_for_the_range_are_reported(potential, share):
    """The warning has the words and the bounds of the program: 0.7 or 1 times E* range^2/energy."""
    bound = share * MODULUS * 0.1e-6**2 / ENERGY
    n = round(SIDE / bound)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        press(n + 1, range=0.1e-6, displacement=0.0, potential=potential)
    with pytest.warns(UserWarning, match=r"cells of .* m are larger than .* the edge of the contact"
                                         " sticks to the grid"):
        press(n - 1, range=0.1e-6, displacement=0.0, potential=potential)


@pytest.mark.parametrize(("parameter", "n", "shift", "exact"), [
    (2.0, 64, (0.0, 0.0), -1.53460), (2.0, 64, (0.3, 0.1), -1.53460),
    (5.0, 96, (0.5, 0.5), -1.50635)])
def test_pull_off_of_maugis_is_not_pinned_by_the_grid(parameter, n, shift, exact):
    """Cells have sides of 0.26 or 1.09 E* range^2/energy; the sphere is anywhere between the cells.

    The test uses Maugis's units, where lambda = 2/(pi range). The exact pull-off is the least load
    of his equations. An attraction with a jump at the end of the range made the pull-off too
    large, by 17 % on the smaller cells and by more than 40 % on the larger ones.
    """
    reach, side = 2 / (np.pi * parameter), 4.0
    x = (np.arange(n) + 0.5) / n * side - side / 2
    height = -((x - shift[0] * side / n)**2 + (x[:, None] - shift[1] * side / n)**2) / 2
    contact, least, loads, energies = "non_adhesive", 0.0, [], []
    approaches = np.linspace(0.0, -1.4, 22)
    for approach in approaches:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            contact = asperity.solve_adhesive(
                height, side, None, 0.75, potential="maugis_dugdale", energy=1 / np.pi, range=reach,
                displacement=approach, boundary="free", start=contact)
        least = min(least, contact.force)
        loads.append(contact.force)
        energies.append(contact.energy_elastic + contact.energy_adhesive)
        if contact.contact_area == 0.0:
            break
    assert least == pytest.approx(exact, rel=0.02)
    # The force must be the derivative of the energy all the way to the pull-off.
    held = int(np.argmin(loads))
    work = np.sum(0.5 * (np.array(loads[1:held]) + loads[:held - 1])) * (
        approaches[1] - approaches[0])
    assert energies[held - 1] - energies[0] == pytest.approx(work, rel=0.02)


RESTARTED = """
&grid nx = 48, ny = 44, lx = 40e-6, ly = 38e-6, boundary = '{boundary}' /
&surface shape = 'paraboloid', radius = 1e-4 /
&material shear_modulus = 0.5e6, prony_g = 1e6, prony_tau = 0.02 /
&adhesion potential = 'exponential', energy = 0.02, range = 0.4e-6 /
&phase displacement = 0.1e-6, duration = 0.1, steps = 60, ramp = 'linear'{velocity} /
&phase displacement = -0.4e-6, duration = 0.1, steps = 60, ramp = 'linear'{velocity} /
"""


@pytest.mark.parametrize(("boundary", "velocity"), [
    ("free", ""), ("periodic", ", velocity_x = 3e-5, velocity_y = 1e-5")])
def test_restart_gives_the_same_numbers(program, tmp_path, boundary, velocity):
    whole, parts = tmp_path / "whole.nml", tmp_path / "parts.nml"
    for case in (whole, parts):
        case.write_text(RESTARTED.format(boundary=boundary, velocity=velocity))
    assert vc.run(program, whole).returncode == 0
    process = vc.start(program, parts)
    vc.wait_for_rows(process, parts.with_suffix(".h5"), 20, signal.SIGTERM)
    process.communicate(timeout=PATIENCE)
    assert process.returncode == 128 + signal.SIGTERM
    stopped = len(asperity.open(parts.with_suffix(".h5")).history["step"])
    assert 20 <= stopped < 121
    assert vc.run(program, parts, "--restart").returncode == 0
    one, other = (asperity.open(case.with_suffix(".h5")) for case in (whole, parts))
    assert len(other.history["step"]) == 121
    for name in one.history:
        if name != "seconds":
            np.testing.assert_array_equal(one.history[name], other.history[name], err_msg=name)
    np.testing.assert_array_equal(one.snapshots[-1].pressure, other.snapshots[-1].pressure)


@pytest.mark.parametrize("seed", [3, 134, 241, 251])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-4])
def test_the_pressure_belongs_to_the_gap_at_any_tolerance(seed, tolerance):
    """Gaps within the tolerance count as 0, which changes the pressure of a stiff solid a lot."""
    n, reach = 32, 5.0
    energy = 1e-3 * reach**2
    wave = np.hypot(*np.meshgrid(np.fft.fftfreq(n) * n, np.fft.fftfreq(n) * n))
    random = np.random.default_rng(seed)
    band = np.where((wave > 0.0) & (wave < 8.0), np.maximum(wave, 1.0) ** -1.8, 0.0)
    height = np.fft.ifft2(np.fft.fft2(random.standard_normal((n, n))) * band).real
    height /= height.std()
    pressure = 0.3 * random.uniform(0.2, 2.0)
    found = asperity.solve_adhesive(height, float(n), None, 1.0, energy=energy, range=reach,
                                    pressure=pressure, tolerance=tolerance)
    expected = pressure + np.fft.ifft2(np.pi / n * wave * np.fft.fft2(found.gap + height)).real
    unit = energy / reach
    assert np.abs(found.pressure - expected).max() <= 0.11 * tolerance * unit
    gradient = expected + unit * np.exp(-found.gap / reach)
    assert np.abs(np.minimum(found.gap / reach, gradient / unit)).max() <= tolerance


def test_a_gauss_potential_lets_cells_open_at_a_given_displacement():
    """Where it is stiff, the preconditioner must not keep cells closed that are pulled apart."""
    n = 16
    wave = np.hypot(*np.meshgrid(np.fft.fftfreq(n) * n, np.fft.fftfreq(n) * n))
    for seed in range(12):
        random = np.random.default_rng(seed)
        band = np.where((wave > 0.0) & (wave < 4.0), np.maximum(wave, 1.0) ** -1.5, 0.0)
        height = np.fft.ifft2(np.fft.fft2(random.standard_normal((n, n))) * band).real
        height /= height.std()
        full = height.max() - height.mean()
        reach = 10 ** random.uniform(-1.0, 0.0)
        given = {"potential": "gauss", "range": reach, "energy": random.uniform(0.3, 3) * reach**2}
        near = asperity.solve_adhesive(height, float(n), None, 1.0, displacement=0.9 * full,
                                       start="full_contact", **given)
        found = asperity.solve_adhesive(height, float(n), None, 1.0, displacement=0.4 * full,
                                        start=near, **given)
        assert found.residual <= 1e-6


def test_a_long_step_does_not_separate_surfaces_that_still_hold():
    """There is an equilibrium near the row before, which 28 and more steps find as well."""
    height = 4.4746e-3 * np.array([
        0.5939, -0.0786, 0.0585, 0.1269, 0.9387, 0.7356, 0.0382, 0.0334, 0.1252, 0.455, 0.715,
        0.8875, 0.7115, 0.0348, 0.2045, 0.9724, -0.0846, -1.0, -0.7754, -0.9213, -0.4136, 0.2577,
        0.3505, 0.1705, 0.5033, 0.7691, 0.5519, 0.7592, 0.0245, 0.2422])
    gaps = []
    for steps in (14, 28):
        case = asperity.Case(
            grid={"nx": 30, "ny": 1, "lx": 1.67346, "ly": 0.0275037},
            surface=[height[None, :]], material={"poisson": -0.4, "shear_modulus": 3.21625e6},
            adhesion={"potential": "maugis_dugdale", "energy": 6.1601, "range": 2.88475e-4,
                      "start": "non_adhesive"},
            phase=[{"force": 5.07845, "relaxed": True},
                   {"duration": 1.0, "steps": steps, "force": -69.6304, "ramp": "linear"}],
            solver={"tolerance": 1e-6, "max_iterations": 5000})
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # the patches are one cell across
            rows = list(asperity.Simulation(case))
        assert rows[-1].force == pytest.approx(-69.6304, rel=1e-9)
        gaps.append(rows[-1].mean_gap)
    assert gaps[1] == pytest.approx(gaps[0], rel=1e-5)


@pytest.mark.parametrize("potential", ["exponential", "gauss", "maugis_dugdale"])
@pytest.mark.parametrize("pull", [5e6, 1e7])
def test_a_pull_without_an_equilibrium_separates_the_surfaces(potential, pull):
    """The search with short steps finds nothing and does not go on to the limit of iterations."""
    length = 128 * 1.5e-9
    height = asperity.surface.self_affine(128, lx=length, wavelength_long=length / 4,
                                          wavelength_short=2e-8, rms_slope=1.0, seed=1)
    with pytest.raises(asperity.NotConverged, match="detached") as caught:
        asperity.solve_adhesive(height, length, None, 25e6, pressure=-pull, potential=potential,
                                energy=0.05, range=2.071e-9, start="full_contact")
    assert int(re.search(r"after (\d+) iterations", str(caught.value))[1]) < 300


def test_separated_surfaces_have_no_friction(tmp_path):
    """The pressure that is left is round-off, and the ratio to it was of any size."""
    run = asperity.run(asperity.Case(
        grid=dict(nx=64, ny=1, lx=1e-4),
        surface=dict(shape="sine", amplitude=1e-6, wavelength=1e-4),
        material=dict(shear_modulus=1e6, prony_g=1e6, prony_tau=1e-3),
        adhesion=dict(potential="maugis_dugdale", energy=0.01, range=1e-7),
        phase=[dict(displacement=-1e-6), dict(duration=1e-3, steps=5, velocity_x=0.01)]),
        output=tmp_path / "apart.h5", quiet=True)
    assert not np.any(run.history["contact_area"])
    assert np.all(np.abs(run.history["pressure"]) < 1e-12)
    assert not np.any(run.history["friction"]) and not np.any(run.history["friction_viscous"])
