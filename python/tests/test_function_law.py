"""A friction law given as a Python function equals the program's laws and dense matrices."""

import numpy as np
import pytest

import asperity

N, LENGTH, MODULUS, SPEED = 16, 1e-3, 1e6, 0.1
TAU, MU = 4e4, 0.6


def saturating(pressure):
    """Return the bound of a law that the program does not contain."""
    return -TAU * np.expm1(-MU * pressure / TAU)


def case(law, phases, seed=1, **groups):
    """Return a case on a rough road without the slope effect."""
    friction = {"slope_effect": False, **(law if isinstance(law, dict) else {"law": law})}
    values = dict(
        grid=dict(nx=N, ny=N, lx=LENGTH),
        surface=[dict(shape="self_affine", hurst=0.8, rms_slope=0.2, seed=seed,
                      wavelength_short=LENGTH / 5)],
        material=dict(shear_modulus=MODULUS), friction=friction, phase=phases,
        solver=dict(tolerance=1e-10, interpolation="cubic", threads=1))
    return asperity.Case(**{**values, **groups})


def sliding(pressure, steps=6, angle=0.4):
    """Return phases: a load, then steps in which the road moves by half a cell."""
    step = 0.5 * LENGTH / N / SPEED
    return [dict(pressure=pressure),
            dict(velocity_x=SPEED * np.cos(angle), velocity_y=SPEED * np.sin(angle),
                 duration=steps * step, steps=steps)]


def columns(run):
    """Return the history without the times that the solves took."""
    return {name: run.history[name] for name in run.history if name != "seconds"}


def same(one, other, tolerance):
    """Check that two runs agree in their histories and last snapshots."""
    old, new = columns(one), columns(other)
    for name in ("traction_x", "traction_y", "friction", "contact_area", "mean_gap"):
        assert np.allclose(new[name], old[name], rtol=tolerance,
                           atol=tolerance * np.abs(old[name]).max()), name
    for name in ("pressure", "traction_x", "traction_y", "slip_x"):
        a, b = (getattr(run.snapshots[-1], name) for run in (one, other))
        assert np.abs(a - b).max() <= tolerance * np.abs(a).max(), name


BUILT_IN = {
    "coulomb": (dict(law="coulomb", coefficient=MU), lambda pressure: MU * pressure),
    "constant_shear": (dict(law="constant_shear", shear_strength=TAU),
                       lambda pressure: TAU + 0 * pressure),
    "coulomb_orowan": (dict(law="coulomb_orowan", coefficient=MU, shear_strength=TAU),
                       dict(law="table", table_pressure=[0, TAU / MU, 2 * TAU / MU],
                            table_strength=[0, TAU, TAU])),
}


@pytest.mark.parametrize("groups", [{}, {"material": dict(
    shear_modulus=MODULUS, prony_g=[2e6], prony_tau=[1e-3], thickness=LENGTH)},
    {"solver": dict(method="thesis", tolerance=1e-8, threads=1)},
    {"adhesion": dict(potential="exponential", energy=0.1, range=5e-6)}])
@pytest.mark.parametrize("name", BUILT_IN)
def test_equals_the_law_of_the_program(tmp_path, name, groups):
    """A function with a law of the program gives its results to round-off, in all solvers."""
    law, function = BUILT_IN[name]
    old, new = (case(one, sliding(1.5e5), seed=3, **groups).run(output=tmp_path / f"{k}.h5")
                for k, one in enumerate((law, function)))
    assert np.ptp(old.history["friction"]) > 0.01
    same(old, new, 1e-6 if groups else 1e-8)


@pytest.mark.parametrize("name", ["coulomb", "coulomb_orowan"])
def test_steady_sliding(tmp_path, name):
    """A steady state with a table is that of the same law of the program."""
    phase = [dict(steady=True, pressure=1.5e5, velocity_x=SPEED)]
    rubber = dict(shear_modulus=MODULUS, prony_g=[2e6], prony_tau=[1e-3])
    old, new = (case(one, phase, seed=3, material=rubber, solver=dict(tolerance=1e-8)).run(
        output=tmp_path / f"{k}.h5") for k, one in enumerate(BUILT_IN[name]))
    same(old, new, 1e-6)


def dense_shear():
    """Return the matrix from tractions to displacements, [2 n, 2 n], for poisson = 0.5."""
    q = 2 * np.pi * np.fft.fftfreq(N, LENGTH / N)
    qx, qy = np.meshgrid(q, q)
    size = np.hypot(qx, qy)
    size[0, 0] = np.inf
    both = 0.5 * qx * qy / size**3
    both[N // 2] = both[:, N // 2] = 0.0
    rows = []
    for a, b in ((1 / size - 0.5 * qx**2 / size**3, -both),
                 (-both, 1 / size - 0.5 * qy**2 / size**3)):
        columns = []
        for symbol in (a, b):
            table = np.fft.ifft2(symbol / MODULUS).real
            j, i = np.divmod(np.arange(N * N), N)
            columns.append(table[(j[:, None] - j) % N, (i[:, None] - i) % N])
        rows.append(np.hstack(columns))
    return np.vstack(rows)


@pytest.mark.parametrize("seed", [11, 12, 13, 14])
def test_partial_slip_against_dense_matrices(tmp_path, seed):
    """The first step minimises T A T/2 - DX T within discs of the radius of the law."""
    rng = np.random.default_rng(seed)
    step = rng.uniform(0.005, 0.02) * LENGTH / N
    angle = rng.uniform(0, 2 * np.pi)
    motion = step * np.array([np.cos(angle), np.sin(angle)])
    phases = [dict(pressure=2e5), dict(velocity_x=motion[0], velocity_y=motion[1],
                                       duration=1.0, steps=1)]
    last = case(saturating, phases, seed).run(output=tmp_path / "out.h5").snapshots[-1]
    bound = saturating(last.pressure.ravel())
    matrix = dense_shear()
    drive = np.repeat(motion, N * N)

    # The reference is the accelerated projected gradient method, restarted where it goes uphill.
    length = 1 / np.linalg.eigvalsh(matrix)[-1]
    t = ahead = np.zeros(2 * N * N)
    weight = 1.0
    for _ in range(20000):
        trial = (ahead - length * (matrix @ ahead - drive)).reshape(2, -1)
        new = (trial * np.minimum(1, bound / np.maximum(np.hypot(*trial), 1e-300))).ravel()
        if (ahead - new) @ (new - t) > 0:
            weight = 1.0
        following = (1 + np.sqrt(1 + 4 * weight**2)) / 2
        ahead, change = new + (weight - 1) / following * (new - t), np.abs(new - t).max()
        t, weight = new, following
        if change < 1e-9 * bound.max():
            break
    found = np.concatenate([last.traction_x.ravel(), last.traction_y.ravel()])
    slips = np.hypot(*t.reshape(2, -1)) > 0.999 * bound
    touching = last.pressure.ravel() > 0
    assert 0.05 < slips[touching].mean() < 0.95
    assert np.abs(found - t).max() < 1e-4 * bound.max()


def test_full_slip(tmp_path):
    """Where everything slips, the traction is the bound of the pressure in every cell."""
    run = case(saturating, sliding(2e5, steps=12)).run(output=tmp_path / "out.h5")
    last = run.snapshots[-1]
    size = np.hypot(last.traction_x, last.traction_y)
    slips = last.contact == 2
    assert slips.sum() > 0.9 * (last.contact > 0).sum()
    assert np.allclose(size[slips], saturating(last.pressure[slips]), rtol=1e-4)


def test_a_case_keeps_the_law(tmp_path):
    """The text of a case, a simulation, a saved state and a restart all use the same law."""
    one = case(saturating, sliding(2e5))
    one.write(tmp_path / "case.nml")
    whole = asperity.run(tmp_path / "case.nml", output=tmp_path / "out.h5")
    sim = asperity.Simulation(one)
    for _ in range(4):
        sim.advance()
    sim.save(tmp_path / "state.h5")
    sim = asperity.Simulation.resume(tmp_path / "state.h5")
    while not sim.finished:
        sim.advance()
    assert sim.row.friction == whole.history["friction"][-1]


@pytest.mark.parametrize(("function", "message"), [
    (lambda pressure: pressure[1:], r"returns shape \(113,\) for pressures of shape \(114,\)"),
    (lambda pressure: -pressure, r"is -0\.001 Pa at the pressure 0\.001 Pa: must be finite and 0"),
    (lambda pressure: pressure * np.nan, "is nan Pa at the pressure 0 Pa"),
    (lambda pressure: "rubber", "must return an array of real numbers"),
    (lambda pressure: pressure * (1 + 0.5j), "real numbers: these are complex"),
    (lambda pressure: 1 + np.sin(pressure), "changes too often"),
])
def test_faults_of_a_function(function, message):
    """A wrong answer of the function is reported with the place, the value and what is allowed."""
    with pytest.raises(ValueError, match=message):
        case(function, sliding(1e5))


def test_an_exception_ends_the_call():
    """An exception of the function reaches the caller, and the operator is as before the call."""
    def fails(pressure):
        raise ZeroDivisionError("no data")

    one = case("none", sliding(1e5))
    with pytest.raises(ZeroDivisionError, match="no data"):
        one.friction.law = fails
    assert one.friction.law == "none"


@pytest.mark.parametrize(("variables", "message"), [
    ("table_pressure = 0, 1, table_strength = 0, 1", "slope_effect: must be .false. with law"),
    ("slope_effect = F, table_pressure = 0, 1", "table_strength: is missing: table needs it"),
    ("slope_effect = F, table_pressure = 1, 2, table_strength = 0, 1", "must begin with 0"),
    ("slope_effect = F, table_pressure = 0, 2, 2, table_strength = 0, 1, 1", "must rise"),
    ("slope_effect = F, table_pressure = 0, table_strength = 0", "two values or more"),
    ("slope_effect = F, table_pressure = 0, 2, table_strength = 0, 1, 1",
     "must have as many values as table_pressure: 3 here, 2 there"),
])
def test_faults_of_a_table(variables, message):
    """The program reports tables that are not valid."""
    text = (f"&grid nx = 8, ny = 8, lx = 1 /\n&surface shape = 'flat' /\n"
            f"&material shear_modulus = 1 /\n&friction law = 'table', {variables} /\n"
            "&phase pressure = 1 /\n")
    with pytest.raises(ValueError, match=message):
        asperity.Case.read(text).check()
