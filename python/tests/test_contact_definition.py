"""Which cells touch an adhesive surface, by dense algebra independent of the solver."""

import numpy as np
import pytest

import asperity


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

MODULUS = 1.0


def stiffness(nx, ny, lx, ly):
    """Return the dense matrix from displacement to traction of a half-space, a sum over waves."""
    qx = 2 * np.pi * np.fft.fftfreq(nx, lx / nx)
    qy = 2 * np.pi * np.fft.fftfreq(ny, ly / ny)
    half = 0.5 * MODULUS * np.hypot(qy[:, None], qx[None, :])
    row = np.real(np.fft.ifft2(half))
    index = np.arange(nx * ny)
    iy, ix = np.divmod(index, nx)
    return row[(iy[:, None] - iy[None, :]) % ny, (ix[:, None] - ix[None, :]) % nx]


def attraction(potential, energy, length, gap, cell):
    """Return the slope and curvature of the potential, by formulas that are written here again."""
    x = gap / length
    if potential == "exponential":
        return energy / length * np.exp(-x), -energy / length**2 * np.exp(-x)
    if potential == "gauss":
        return (2 * energy / length * x * np.exp(-x**2),
                2 * energy / length**2 * (1 - 2 * x**2) * np.exp(-x**2))
    edge = min(energy / length * cell / MODULUS, length)
    ramp = (length + edge - gap) / (2 * edge)
    return (energy / length * np.clip(ramp, 0, 1),
            np.where((ramp > 0) & (ramp < 1), -energy / length / (2 * edge), 0.0))


def certified(matrix, height, start, pressure, potential, energy, length, cell):
    """Return whether an exact solution touches exactly where ``start`` does (None: undecided).

    Newton's method solves the open cells alone, to round-off. There is a solution if then all
    their gaps are positive and the wall presses in all other cells.
    """
    height = height.ravel()
    gap = start.ravel().copy()
    open_ = gap != 0.0

    def wall():
        return (matrix @ (height + gap) + pressure
                + attraction(potential, energy, length, gap, cell)[0])

    scale = max(energy / length, pressure)
    for _ in range(30):
        excess = wall()
        if np.abs(excess[open_]).max(initial=0.0) < 1e-12 * scale:
            break
        curvature = attraction(potential, energy, length, gap, cell)[1]
        jacobian = matrix[np.ix_(open_, open_)] + np.diag(curvature[open_])
        gap[open_] -= np.linalg.solve(jacobian, excess[open_])
    else:
        return None
    margin = min(gap[open_].min(initial=np.inf) / length,
                 wall()[~open_].min(initial=np.inf) / scale)
    return None if abs(margin) < 1e-5 else margin > 0


def problem(rng, rough):
    nx, ny = (int(rng.integers(8, 20)), int(rng.integers(8, 20))) if rough else (
        int(rng.choice([16, 24, 32, 48, 64])), 1)
    y, x = np.divmod(np.arange(nx * ny), nx)
    height = 0.01 * np.exp(rng.uniform(-1, 1)) * np.cos(2 * np.pi * x / nx)
    if rough:
        for _ in range(6):
            kx, ky = rng.integers(-3, 4, 2)
            height = height + 0.004 * rng.standard_normal() * np.cos(
                2 * np.pi * (kx * x / nx + ky * y / ny) + rng.uniform(0, 7))
    potential = str(rng.choice(["maugis_dugdale", "maugis_dugdale", "exponential", "gauss"]))
    length = 0.01 * np.exp(rng.uniform(-2.5, 0.5))
    # E* range^2/energy over the side of a cell
    energy = length**2 * nx / np.exp(rng.uniform(-0.5, 4))
    pressure = 0.03 * np.exp(rng.uniform(-2, 1))
    return height.reshape(ny, nx), potential, energy, length, pressure


@pytest.mark.filterwarnings("ignore:cells of")
@pytest.mark.parametrize("rough", [False, True])
def test_contact_area_is_that_of_an_exact_solution(rough):
    rng = np.random.default_rng(11 + rough)
    decided = wrong = 0
    for _ in range(40 if rough else 150):
        height, potential, energy, length, pressure = problem(rng, rough)
        ny, nx = height.shape
        ly = ny / nx if rough else None
        try:
            contact = asperity.solve_adhesive(
                height, 1.0, ly, MODULUS, potential=potential, energy=energy, range=length,
                pressure=pressure, tolerance=1e-8)
        except asperity.NotConverged:
            continue
        assert contact.contact_area == np.mean(contact.gap == 0.0)
        verdict = certified(stiffness(nx, ny, 1.0, ly or 1.0), height, contact.gap, pressure,
                            potential, energy, length, 1.0 / nx)
        decided += verdict is not None
        wrong += verdict is False
    assert wrong == 0
    assert decided > (30 if rough else 110)


LINE = """
&grid nx = 16, ny = 1, lx = 1. /
&surface shape = 'sine', amplitude = .02, wavelength = 1. /
&material shear_modulus = .25, thickness = 0.5 /
&phase pressure = .030083655811801294 /
"""


def test_history_counts_cells_left_at_round_off():
    run = asperity.run(LINE + "&adhesion potential = 'maugis_dugdale',"
                       " energy = 7.01235673872164e-07, range = .0016075914138522238 /",
                       output="line.h5")
    assert run.history["contact_area"][-1] == 0.5625


@pytest.mark.parametrize("energy", [0.0, 1e-5])
def test_history_snapshot_and_friction_agree(energy):
    run = asperity.run(LINE + f"""
&friction law = 'coulomb', coefficient = 0.4 /
&adhesion potential = 'exponential', energy = {energy}, range = 1e-2 /
&phase velocity_x = 0.1, duration = 0.02, steps = 4 /
&output snapshot_every = 1 /
""", output="line.h5")
    area = run.history["contact_area"]
    for row, snapshot in enumerate(run.snapshots):
        touching = snapshot["contact"] > 0
        assert touching.mean() == area[row]
        np.testing.assert_array_equal(touching, snapshot["gap"] == 0.0)
    if energy == 0.0:
        bare = asperity.run(LINE, output="bare.h5")
        assert area[0] == bare.history["contact_area"][0]
