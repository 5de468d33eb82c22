"""The friction law of a run, recomputed from the fields that the run has written.

The tests use nothing of the program. They read the slope of the road under each point from the map
by the rule of the manual (a cubic spline, or bilinear between central differences). The bound
follows from the law in three dimensions, |F_t| <= mu F_n, where F is the force of the
road per area of the road.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import RectBivariateSpline

import asperity

MU = 0.45
STRENGTH = 1.5e5
INPUT = """&grid nx = 40, ny = 25, lx = 1.0e-3, ly = 0.7e-3 /
&surface shape = 'self_affine', hurst = 0.8, wavelength_long = 0.5e-3,
   wavelength_short = 0.12e-3, rms_slope = 0.15, seed = {seed} /
&material shear_modulus = 0.5e6, prony_g = 1e6, 0.5e6, prony_tau = 1e-3, 1e-2, thickness = 1e-3 /
&friction law = '{law}', coefficient = {mu}, shear_strength = {strength},
   slope_effect = {slope} /
&phase pressure = 4e4 /
&phase velocity_x = 4e-3, velocity_y = -2.6e-3, duration = 4e-3, steps = 16 /
&phase velocity_x = -2e-3, velocity_y = -3.6e-3, duration = 3e-3, steps = 12 /
&solver threads = 1, tolerance = 1e-8, passes = 30, slip_law = '{slip_law}', max_iterations = 3000,
   interpolation = '{interpolation}', time_scheme = 'exponential' /
&output file = '{file}', snapshot_every = 1 /
"""


def read_map(field: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Read a periodic map of shape (ny, nx) at places in cells, bilinearly."""
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    u, v = x - i, y - j
    ny, nx = field.shape

    def at(di: int, dj: int) -> np.ndarray:
        return field[(j + dj) % ny, (i + di) % nx]

    return ((1 - u) * (1 - v) * at(0, 0) + u * (1 - v) * at(1, 0)
            + (1 - u) * v * at(0, 1) + u * v * at(1, 1))


def read_spline(field: np.ndarray, x: np.ndarray, y: np.ndarray, nu: tuple[int, int] = (0, 0),
                ) -> np.ndarray:
    """Return the cubic spline through a periodic map, or a derivative of it, at places in cells.

    The map is repeated over 30 cells on each side, so that the influence of the ends of FITPACK's
    spline has decayed to 0.27 to the 30th power.
    """
    ny, nx = field.shape
    spline = RectBivariateSpline(np.arange(-30, ny + 30), np.arange(-30, nx + 30),
                                 np.pad(field, 30, mode="wrap"))
    return spline.ev(y % ny, x % nx, dx=nu[1], dy=nu[0])


def slopes_under(run: asperity.Run, snapshot, interpolation: str) -> tuple[np.ndarray, np.ndarray]:
    """Return both slopes of the road under each point of the rubber."""
    height = run.height
    ny, nx = height.shape
    dx, dy = 1.0e-3 / nx, 0.7e-3 / ny
    row = int(np.flatnonzero(run.history["step"] == snapshot.step)[0])
    i, j = np.meshgrid(np.arange(nx), np.arange(ny))
    x = i + (snapshot.displacement_x - run.history["road_x"][row]) / dx
    y = j + (snapshot.displacement_y - run.history["road_y"][row]) / dy
    if interpolation == "cubic":
        return read_spline(height, x, y, (1, 0)) / dx, read_spline(height, x, y, (0, 1)) / dy
    along_x = (np.roll(height, -1, 1) - np.roll(height, 1, 1)) / (2 * dx)
    along_y = (np.roll(height, -1, 0) - np.roll(height, 1, 0)) / (2 * dy)
    return read_map(along_x, x, y), read_map(along_y, x, y)


@pytest.mark.parametrize(("law", "slope", "slip_law", "seed", "interpolation"), [
    ("coulomb", True, "physical", 3, "cubic"), ("coulomb", True, "thesis", 4, "cubic"),
    ("coulomb", True, "physical", 3, "linear"),
    ("coulomb", False, "physical", 5, "cubic"), ("constant_shear", False, "physical", 6, "cubic"),
    ("coulomb_orowan", True, "physical", 7, "cubic")])
def test_law_in_three_dimensions(tmp_path, law, slope, slip_law, seed, interpolation):
    """The force of the road lies in the cone of its normal, and slip is along its tangential part.

    There are enough passes for slopes, pressure and traction to agree with each other. Constant
    shear is tested without the slope; tools/constant_shear.py and its tests compare it on slopes.
    """
    case = tmp_path / "case.nml"
    mu = MU if law != "constant_shear" else 0.0
    strength = STRENGTH if law != "coulomb" else 0.0
    text = INPUT.format(law=law, mu=mu, strength=strength, slope=f".{str(slope).lower()}.",
                        slip_law=slip_law, seed=seed, interpolation=interpolation,
                        file=tmp_path / "case.h5")
    if law == "constant_shear":
        # The gaps of partly sheared cells are as small as the mismatch that the passes leave.
        text = text.replace("coefficient = 0.0, ", "").replace("tolerance = 1e-8, passes = 30",
                                                               "tolerance = 1e-10")
    if law == "coulomb":
        text = text.replace(" shear_strength = 0.0,", "")
    case.write_text(text)
    run = asperity.run(case, quiet=True)
    seen = np.zeros(3, dtype=int)
    assert len(run.snapshots) == 29
    for snapshot in run.snapshots[1:]:
        state = np.asarray(snapshot.contact)
        assert (state[snapshot.pressure > 0] > 0).all() or law == "constant_shear"
        # With constant shear, a cell that touches without pressure carries a part of the strength.
        # Its pressure is zero only to within the tolerance.
        little = 1e-8 * snapshot.pressure.max() if law == "constant_shear" else 0.0
        touching = snapshot.pressure > little
        assert (state[touching] > 0).all()
        partly = (state > 0) & ~touching
        assert not partly.any() or law == "constant_shear"
        assert np.abs(snapshot.gap[partly]).max(initial=0) < 1e-8 * np.ptp(run.height)
        seen += np.bincount(state.ravel(), minlength=3)
        hx = hy = np.zeros_like(snapshot.pressure)
        if slope:
            hx, hy = slopes_under(run, snapshot, interpolation)
        nz = 1 / np.sqrt(1 + hx**2 + hy**2)
        normal = np.stack([-hx, -hy, np.ones_like(hx)]) * nz
        # The force on the rubber per area of the grid.
        force = np.stack([snapshot.traction_x, snapshot.traction_y, snapshot.pressure])
        push = (force * normal).sum(0)
        tangential = force - push * normal
        size = np.sqrt((tangential**2).sum(0))
        limits = []
        if law != "constant_shear":
            limits.append(MU * push)
        if law != "coulomb":
            limits.append(np.full_like(push, STRENGTH))
        limit = np.min(limits, axis=0)
        top = limit[touching].max()
        assert (snapshot.traction_x[state == 0] == 0).all()
        assert (snapshot.traction_y[state == 0] == 0).all()
        assert (size - limit)[state > 0].max() < 1e-5 * top, "outside the bound"
        stick, slips = state == 1, (state == 2) & touching
        slip = np.stack([snapshot.slip_x, snapshot.slip_y])
        far = np.hypot(*slip).max()
        # The tolerance, 1e-8, refers to displacements.
        reach = np.hypot(snapshot.displacement_x, snapshot.displacement_y).max()
        assert np.hypot(*slip)[stick].max(initial=0) < 2e-8 * reach, "a sticking point slips"
        if not slips.any():
            continue
        assert np.abs(size - limit)[slips].max() < 1e-5 * top, "slip inside the bound"
        # The slip in space is along the road: its vertical part is its plane part times the slope.
        space = np.stack([slip[0], slip[1], hx * slip[0] + hy * slip[1]])
        if slip_law == "thesis":
            space[2] = 0
            tangential = force + 0
            tangential[0] += snapshot.pressure * hx
            tangential[1] += snapshot.pressure * hy
            tangential[2] = 0
        along = (space * tangential).sum(0)
        across = np.sqrt((np.cross(space, tangential, axis=0)**2).sum(0))
        sized = np.sqrt((tangential**2).sum(0))
        assert (along[slips] > -1e-6 * far * sized[slips]).all(), "slip against friction"
        assert (across / np.maximum(sized, 1e-9 * top))[slips].max() < 1e-5 * far, "slip across"
    assert (seen > 50).all(), seen


CYCLE = """&phase velocity_x = 1e-3, velocity_y = -0.6e-3, duration = {time}, steps = 8 /
&phase velocity_x = -1e-3, velocity_y = 0.6e-3, duration = {time}, steps = 8 /
"""
ELASTIC = """&grid nx = 36, ny = 25, lx = 1.0e-3, ly = 0.7e-3 /
&surface shape = 'self_affine', hurst = 0.8, wavelength_long = 0.5e-3,
   wavelength_short = 0.2e-3, rms_slope = 0.1, seed = 8 /
&material shear_modulus = 1e6, poisson = 0.42, thickness = 1e-3 /
&friction law = 'coulomb', coefficient = {mu}, slope_effect = {slope} /
&phase pressure = 6e4 /
{cycles}&solver threads = 1, tolerance = 1e-8, passes = 20, max_iterations = 3000 /
&output file = '{file}', snapshot_every = 16 /
"""


def cyclic_run(tmp_path, *, mu: float, slope: str, time: float, cycles: int) -> asperity.Run:
    """Run a rough elastic contact that moves forwards and backwards."""
    case = tmp_path / "cycle.nml"
    case.write_text(ELASTIC.format(mu=mu, slope=slope, cycles=CYCLE.format(time=time) * cycles,
                                   file=tmp_path / "cycle.h5"))
    return asperity.run(case, quiet=True)


@pytest.mark.filterwarnings("ignore:&surface")
def test_stick_leaves_no_trace_after_a_return(tmp_path):
    """An elastic contact that sticks is as before when the road is back at its start."""
    run = cyclic_run(tmp_path, mu=30.0, slope=".false.", time=1e-3, cycles=1)
    out, back = run.snapshots[1].pressure, run.snapshots[-1]
    history = run.history
    assert history["road_x"][-1] == pytest.approx(0, abs=1e-20)
    top = np.abs(history["traction_x"]).max()
    assert top > 10
    assert abs(history["traction_x"][-1]) < 1e-5 * top
    assert history["dissipated_friction"][-1] < 1e-5 * history["work_tangential"].max()
    assert np.abs(back.pressure - run.snapshots[0].pressure).max() < 1e-5 * out.max()
    # halfway back the road passes the place of the first half
    np.testing.assert_allclose(history["traction_x"][1:9][::-1][1:], history["traction_x"][9:16],
                               atol=1e-4 * top)


@pytest.mark.filterwarnings("ignore:&surface")
def test_cycles_repeat(tmp_path):
    """A rough elastic contact that slips forwards and backwards repeats the same loop."""
    run = cyclic_run(tmp_path, mu=0.3, slope=".true.", time=8e-3, cycles=3)
    history = run.history
    second, third = slice(17, 33), slice(33, 49)
    for name in ("traction_x", "traction_y", "contact_area", "friction"):
        scale = np.abs(history[name]).max()
        np.testing.assert_allclose(history[name][third], history[name][second], atol=2e-3 * scale,
                                   err_msg=name)
    # a count of cells, some of which are nearly in contact
    assert np.abs(history["stick_area"][third] - history["stick_area"][second]).max() < 0.02
    lost = np.diff(history["dissipated_friction"][[16, 32, 48]])
    assert lost[0] > 0
    assert lost[1] == pytest.approx(lost[0], rel=1e-3)
    assert history["stick_area"].min() < 0.8 * history["contact_area"].min()


@pytest.mark.filterwarnings("ignore:&surface")
def test_a_jump_reads_the_road_under_the_moved_rubber(tmp_path):
    """A jump to half the load lets points slip at once, so the jump must read the moved road.

    The height that the normal contact has used, U_z - gap - level, must be that of the map under
    the moved rubber, in the row of the jump as in the steps.
    """
    case = tmp_path / "jump.nml"
    cycles = ("&phase velocity_x = 1e-3, velocity_y = -0.6e-3, duration = 2e-3, steps = 4 /\n"
              "&phase pressure = 3e4, velocity_x = 1e-3, duration = 1e-3, steps = 2 /\n")
    case.write_text(ELASTIC.format(mu=0.6, slope=".true.", cycles=cycles,
                                   file=tmp_path / "jump.h5").replace("every = 16", "every = 1"))
    run = asperity.run(case, quiet=True)
    history, height = run.history, run.height
    ny, nx = height.shape
    i, j = np.meshgrid(np.arange(nx), np.arange(ny))
    jump = np.flatnonzero(np.diff(history["time"]) == 0)[-1] + 1
    assert history["pressure"][jump] == pytest.approx(3e4)
    moved = run.snapshots[jump].displacement_x - run.snapshots[jump - 1].displacement_x
    assert np.ptp(moved) > 1e-3 * np.ptp(height), "nothing lets go"
    for row in (jump - 1, jump, jump + 1):
        snapshot = run.snapshots[row]
        x = i + (snapshot.displacement_x - history["road_x"][row]) / (1.0e-3 / nx)
        y = j + (snapshot.displacement_y - history["road_y"][row]) / (0.7e-3 / ny)
        level = history["displacement"][row] - height.max()
        seen = snapshot.displacement_z - snapshot.gap - level
        assert np.abs(seen - read_spline(height, x, y)).max() < 1e-5 * np.ptp(height), row
        # The stored road is the one at this row; negative gaps are stored as zero.
        parted = snapshot.gap > 0.0
        error = np.abs(seen - snapshot.road_height)
        assert error[parted].max() < 1e-12 * np.ptp(height), row
        assert error.max() < 1e-5 * np.ptp(height), row


def test_a_returned_road_under_stick_converges(tmp_path):
    """When the road is back at its start the tangential solve still converges to a small tolerance.

    The rubber has been sheared for a while, so that the arms still carry tractions.
    """
    case = tmp_path / "back.nml"
    case.write_text(f"""&grid nx = 15, ny = 18, lx = 1e-3, ly = 1.4e-3, boundary = 'free' /
&surface shape = 'paraboloid', radius = 2.3e-3 /
&material poisson = 0.3, shear_modulus = 1.4e6, prony_g = 2.5e6, prony_tau = 2.3e-3 /
&friction law = 'constant_shear', slope_effect = .false., shear_strength = 1.1e4 /
&phase pressure = 1e4, relaxed = .true. /
&phase duration = 7e-4, steps = 4, velocity_x = 3.6e-5, velocity_y = 1.5e-4 /
&phase duration = 2e-4, steps = 4, velocity_x = -1.26e-4, velocity_y = -5.25e-4 /
&solver threads = 1, tolerance = 1e-9, passes = 8, max_iterations = 300 /
&output file = '{tmp_path / "back.h5"}', snapshot_every = 1 /
""")
    run = asperity.run(case, quiet=True)  # raises an exception if a step is not solved
    history = run.history
    assert abs(history["road_x"][-1]) < 1e-20
    assert history["iterations_tangential"].max() < 60
    assert (history["stick_area"] == history["contact_area"]).all()
    far = max(np.abs(one.displacement_x).max() for one in run.snapshots)
    touching = run.snapshots[-1].contact > 0
    assert np.abs(run.snapshots[-1].displacement_x[touching]).max() < 1e-8 * far
    assert np.abs(history["traction_x"][-1]) > 1e-3 * np.abs(history["traction_x"]).max()


def test_the_work_of_a_first_short_step_is_that_of_the_drive(tmp_path: Path) -> None:
    """The road moves by 20 nm, so that its drive does hardly any work.

    The contact was pressed without friction. The energy that its slopes set free as soon as
    friction acts is lost by friction or missing, and is not work that the drive gets back.
    """
    case = tmp_path / "first.nml"
    case.write_text(f"""&grid nx = 48, ny = 1, lx = 1e-3 /
&surface shape = 'self_affine', hurst = 0.8, rms_slope = 0.32, seed = 7,
   wavelength_short = 8.34e-05, wavelength_long = 1e-3 /
&material shear_modulus = 1e6, poisson = 0.5, thickness = 0.005 /
&friction law = 'coulomb', coefficient = 0.32 /
&phase pressure = 6e5 /
&phase duration = 2e-8, steps = 1, velocity_x = 1.0 /
&solver threads = 1, tolerance = 1e-8 /
&output file = '{tmp_path / "first.h5"}' /
""")
    history = asperity.run(case, quiet=True).history
    assert history["dissipated_friction"][-1] > 1e-9
    assert abs(history["work_drive"][-1]) < 1e-4 * history["dissipated_friction"][-1]


def test_cells_with_little_pressure_are_solved_too(tmp_path: Path) -> None:
    """The losses of all rows are those of a much finer solve.

    A cell that has just come into contact carries so little that means weighted by the pressure do
    not show whether its pressure is right. With such means alone, losses are wrong by 1.5e-3 to
    1.5e-2 of the largest, at twelve tolerances from 5e-7 to 1.8e-6; with the error of the
    overlaps, by at most 6e-4. The error does not fall with the loss of a row: the slip of a row at
    rest is that of the errors of the displacement.
    """
    text = """&grid nx = 16, ny = 16, lx = 0.001, ly = 0.001 /
&surface shape = 'self_affine', hurst = 0.8, rms_slope = 0.32762288411287727, seed = 158242,
   wavelength_short = 0.00025, wavelength_long = 0.001 /
&material shear_modulus = 1e6, poisson = 0.4512338907237527, thickness = 0.005 /
&friction law = 'coulomb_orowan', coefficient = 1.1022242209424329,
   shear_strength = 1180711.581939717 /
&phase pressure = 478912.96510808164, relaxed = .true. /
&phase duration = 0.0003679502851841825, steps = 9, velocity_x = 1.0 /
&phase duration = 0.0004668001049918613, steps = 10, velocity_x = 0.0 /
&solver threads = 1, tolerance = {tolerance}, time_scheme = 'backward_euler' /
&output file = '{file}' /
"""
    losses = []
    for tolerance in (1e-6, 1e-9):
        case = tmp_path / "light.nml"
        file = tmp_path / f"light_{tolerance}.h5"
        case.write_text(text.format(tolerance=tolerance, file=file))
        losses.append(np.diff(asperity.run(case, quiet=True).history["dissipated_friction"]))
    assert np.abs(losses[0] - losses[1]).max() < 1e-3 * losses[1].max()


def test_short_slip_of_a_thick_block(tmp_path: Path) -> None:
    """Full sliding counts as slip although the road moves less in a step than the allowed error.

    A block of 20 mm is sheared by 0.5 mm, and the tolerance is 1e-4 of this, twice the motion of
    the road in a step. The loss is mu times the force times the motion of the road.
    """
    case = tmp_path / "slow.nml"
    case.write_text("""&grid nx = 12, ny = 6, lx = 1e-3 /
&surface shape = 'sine', amplitude = 2e-5, wavelength = 1e-3 /
&material shear_modulus = 1e6, thickness = 2e-2 /
&friction law = 'coulomb', coefficient = 0.5, slope_effect = .false. /
&phase pressure = 5e4 /
&phase duration = 1e-2, steps = 10, velocity_x = 1 /
&phase duration = 1, steps = 40, velocity_x = 1e-6 /
&solver tolerance = 1e-4, threads = 1 /
""")
    history = asperity.run(case, quiet=True).history
    loss = history["dissipated_friction"]
    slow = np.flatnonzero(history["phase"] == 3)
    heat = 0.5 * history["force"][-1] * 1e-6
    assert loss[-1] - loss[slow[0] - 1] == pytest.approx(heat, rel=0.02)
    assert np.all(history["stick_area"][slow] == 0)


@pytest.mark.parametrize("law", [
    {"law": "coulomb", "coefficient": 0.5},
    {"law": "coulomb_orowan", "coefficient": 0.5, "shear_strength": 3e4}])
@pytest.mark.parametrize("boundary", ["periodic", "free"])
def test_elastic_contact_sticks_when_the_road_has_stopped(law, boundary):
    """What the first step at rest corrects of the step before is within its tolerance: no slip."""
    case = asperity.Case(
        grid={"nx": 42, "ny": 55, "lx": 1e-3, "ly": 1.3888e-3, "boundary": boundary},
        surface={"shape": "sphere", "radius": 5e-3}, material={"shear_modulus": 1e6},
        friction=law, phase=[{"pressure": 2e4}, {"duration": 1e-3, "steps": 3, "velocity_y": 0.2},
                             {"duration": 1e-3, "steps": 3, "velocity_y": 0.0}])
    rows = list(asperity.Simulation(case))
    assert [row.stick_area for row in rows[1:4]] == [0, 0, 0]
    assert [row.stick_area for row in rows[4:]] == [row.contact_area for row in rows[4:]]


@pytest.mark.parametrize("law", [
    {"law": "coulomb", "coefficient": 0.5}, {"law": "constant_shear", "shear_strength": 2e4}])
def test_the_loss_does_not_depend_on_how_many_periods_are_computed(law):
    """Cells begin to slip within the step; each of four periods loses a quarter of the energy."""
    loss = []
    for copies in (1, 2):
        case = asperity.Case(
            grid={"nx": 32 * copies, "ny": 18 * copies, "lx": 1e-3 * copies,
                  "ly": 1e-3 * copies / np.sqrt(3)},
            surface={"shape": "hexagonal_wave", "wavelength": 1e-3, "amplitude": 1e-5},
            material={"shear_modulus": 1e6, "thickness": 2e-4}, friction=law,
            phase=[{"pressure": 5e4}, {"duration": 1.0, "steps": 1, "velocity_x": 2e-5}],
            solver={"tolerance": 1e-9})
        rows = list(asperity.Simulation(case))
        assert rows[-1].stick_area < rows[0].contact_area
        loss.append(rows[-1].dissipated_friction / copies**2)
    assert loss[0] > 0
    assert loss[1] == pytest.approx(loss[0], rel=1e-6)


def test_a_pull_grows_from_zero_if_the_road_has_not_moved():
    """On a coarse mesh the pressures on the slopes have a sum, but nothing holds the road yet."""
    case = asperity.Case(
        grid={"nx": 12, "ny": 14, "lx": 1e-3},
        surface={"shape": "self_affine", "hurst": 0.8, "rms_slope": 0.3, "seed": 3,
                 "wavelength_long": 0.5e-3, "wavelength_short": 0.2e-3},
        material={"shear_modulus": 1e6, "thickness": 1e-3},
        friction={"law": "coulomb", "coefficient": 0.5},
        phase=[{"pressure": 1e5}, {"traction_x": 2e3, "traction_y": -1e3, "ramp": "linear",
                                   "duration": 1e-2, "steps": 4}],
        solver={"tolerance": 1e-8})
    rows = list(asperity.Simulation(case))[1:]
    assert [row.traction_x for row in rows] == pytest.approx([500, 1000, 1500, 2000], rel=1e-6)
    assert [row.traction_y for row in rows] == pytest.approx([-250, -500, -750, -1000], rel=1e-6)
