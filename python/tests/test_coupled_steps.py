"""Steps and jumps with friction against solutions that do not use the program."""

from __future__ import annotations

import h5py
import numpy as np
import pytest
from coupled_reference import Block
from scipy.interpolate import CubicSpline

import asperity
from asperity import theory

NX, NY, LENGTH = 9, 6, 1e-3


def steep_map(seed: int, slope: float) -> np.ndarray:
    """Return a map of three waves with the given rms slope."""
    rng = np.random.default_rng(seed)
    dx = LENGTH / NX
    x, y = np.meshgrid(np.arange(NX) * dx, np.arange(NY) * dx)
    height = np.zeros_like(x)
    for wave in ((1, 0), (1, 1), (2, 0)):
        k = 2 * np.pi * np.array([wave[0] / LENGTH, wave[1] / (NY * dx)])
        height += np.cos(k[0] * x + k[1] * y + rng.uniform(0, 6)) / np.hypot(*k)
    transformed = np.fft.fft2(height)
    square = sum(np.mean(np.fft.ifft2(2j * np.pi * q * transformed).real ** 2) for q in (
        np.fft.fftfreq(NX, dx)[None, :], np.fft.fftfreq(NY, dx)[:, None]))
    return height * slope / np.sqrt(square)


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize(("seed", "slope", "mu", "thickness", "arms"), [
    (1, 0.45, 0.8, 0.5, [(2e6, 2e-4), (1e6, 3e-3)]),
    (2, 0.5, 0.6, 0.05, []),
    (3, 0.3, 0.4, 3.0, [(4e6, 1e-3)])])
def test_whole_step_against_dense_solution(tmp_path, seed, slope, mu, thickness, arms):
    """Roads are driven obliquely under thin and thick blocks, then half the load is taken off."""
    height, dx = steep_map(seed, slope), LENGTH / NX
    with h5py.File(tmp_path / "road.h5", "w") as file:
        file["surface"] = height
    pressure = 0.4 * (1e6 + sum(g for g, _ in arms)) * slope
    dt = 5e-4
    prony = "" if not arms else (f", prony_g = {', '.join(f'{g}' for g, _ in arms)}, "
                                 f"prony_tau = {', '.join(f'{tau}' for _, tau in arms)}")
    (tmp_path / "case.nml").write_text(
        f"&grid nx = {NX}, ny = {NY}, lx = {LENGTH}, ly = {NY * dx!r} /\n"
        "&surface shape = 'file', file = 'road.h5' /\n"
        f"&material poisson = 0.4, shear_modulus = 1e6, thickness = {thickness * LENGTH}{prony} /\n"
        f"&friction law = 'coulomb', coefficient = {mu} /\n&phase pressure = {pressure!r} /\n"
        f"&phase velocity_x = 0.1, velocity_y = 0.04, duration = {2 * dt}, steps = 2 /\n"
        f"&phase pressure = {pressure / 2!r} /\n"
        "&solver tolerance = 1e-9, threads = 1, time_scheme = 'exponential' /\n"
        f"&output file = '{tmp_path / 'case.h5'}', snapshot_every = 1 /\n")
    run = asperity.run(tmp_path / "case.nml", quiet=True)
    assert run.history["residual_coupling"].max() <= 1e-9
    assert run.history["passes"].max() > 4, "not a hard case"
    block = Block(height, dx, poisson=0.4, thickness=thickness * LENGTH, long_term=1e6, arms=arms,
                  coefficient=mu)
    rows = [(pressure, (0.0, 0.0), 0.0)] + 2 * [(pressure, (0.1 * dt, 0.04 * dt), dt)] + [
        (pressure / 2, (0.0, 0.0), 0.0)]
    for snapshot, row in zip(run.snapshots, rows, strict=True):
        assert block.step(*row) < 1e-9, "the reference itself"
        top = block.pressure.max()
        assert np.abs(snapshot.pressure.ravel() - block.pressure).max() < 2e-6 * top
        assert np.abs(snapshot.traction_x.ravel() - block.traction[0]).max() < 2e-6 * top
        assert np.abs(snapshot.traction_y.ravel() - block.traction[1]).max() < 2e-6 * top
    assert (run.snapshots[-1].contact == 2).any()


def held_sphere(tmp_path, factor: float) -> tuple[asperity.Run, float, float]:
    """Shift a sphere into partial slip, change its load at once, move on; return load and shift."""
    radius, modulus, mu = 10e-3, 1e6, 0.01
    load = 8 * modulus * 1e-9 / (3 * radius)
    shift = 0.4 * mu * 1e-6 / radius
    (tmp_path / "case.nml").write_text(
        "&grid nx = 96, ny = 96, lx = 2.7e-3, boundary = 'free' /\n"
        f"&surface shape = 'paraboloid', radius = {radius} /\n"
        f"&material poisson = 0, shear_modulus = {modulus} /\n"
        f"&friction law = 'coulomb', coefficient = {mu}, slope_effect = .false. /\n"
        f"&phase force = {load!r} /\n&phase velocity_x = 1e-3, duration = {shift / 1e-3!r}, "
        "steps = 4 /\n"
        f"&phase force = {factor * load!r}, velocity_x = 1e-3, duration = {0.05 * shift / 1e-3!r}, "
        "steps = 1 /\n"
        f"&solver tolerance = 1e-8, threads = 1 /\n&output file = '{tmp_path / 'case.h5'}' /\n")
    return asperity.run(tmp_path / "case.nml", quiet=True), load, shift


def test_load_drop_in_partial_slip(tmp_path):
    """Points slip on while the load falls: Cattaneo and Mindlin for the new load (nu = 0)."""
    for factor in (0.5, 0.9):
        run, load, shift = held_sphere(tmp_path, factor)
        history, area = run.history, 2.7e-3**2
        for row, way in ((4, shift), (5, shift), (6, 1.05 * shift)):
            force = (1.0 if row == 4 else factor) * load
            known = theory.mindlin(10e-3, 1e6, 0.0, 0.01, force, shift=way)
            found = history["traction_x"][row] * area
            assert found == pytest.approx(float(known.tangential), rel=4e-3), (factor, row)
        # the stick radius follows from the depths: d(c) = d(a) - shift/mu
        depth = 1e-4 * factor ** (2 / 3)
        stick = np.pi * 10e-3 * max(depth - shift / 0.01, 0.0) / area
        assert history["stick_area"][5] == pytest.approx(stick, abs=3e-3)
        assert (np.diff(history["dissipated_friction"]) >= 0).all()
        assert history["sliding_speed"][5] == 0
        balance = (history["work_normal"] + history["work_tangential"] - history["energy_elastic"]
                   - history["dissipated_friction"])
        assert np.abs(balance).max() < 1e-7 * history["energy_elastic"].max()


def test_load_rise_sticks(tmp_path):
    """Under a growing load all points stick and the traction does not change (nu = 0)."""
    run, _, _ = held_sphere(tmp_path, 1.5)
    history = run.history
    assert history["stick_area"][5] == history["contact_area"][5]
    assert history["traction_x"][5] == pytest.approx(history["traction_x"][4], rel=1e-6)
    assert history["dissipated_friction"][5] == pytest.approx(
        history["dissipated_friction"][4], rel=1e-6)


def test_mass_moves_on_through_a_jump(tmp_path):
    """A jump takes no time, so a mass keeps its place and speed whatever the traction does."""
    (tmp_path / "case.nml").write_text(
        "&grid nx = 24, ny = 16, lx = 1e-3, ly = 0.7e-3 /\n"
        "&surface shape = 'paraboloid', radius = 5e-3 /\n"
        "&material poisson = 0.5, shear_modulus = 1e6, thickness = 1e-3, density = 1e4 /\n"
        "&friction law = 'coulomb', coefficient = 0.5 /\n&phase pressure = 1e5 /\n"
        "&phase velocity_x = 0.5, duration = 2e-4, steps = 10 /\n"
        "&phase pressure = 3e4, velocity_x = 0.5, duration = 2e-5, steps = 1 /\n"
        "&solver tolerance = 1e-8, threads = 1 /\n"
        f"&output file = '{tmp_path / 'case.h5'}', snapshot_every = 1 /\n")
    run = asperity.run(tmp_path / "case.nml", quiet=True)
    history = run.history
    assert history["time"][11] == history["time"][10]
    before, after = (run.snapshots[k].displacement_x.mean() for k in (10, 11))
    assert after == pytest.approx(before, rel=1e-9)
    assert history["energy_kinetic"][11] == history["energy_kinetic"][10] > 0
    # A step's speed is its mean; the jump's is that of the block itself: m v^2/2 per area.
    speed = np.sqrt(2 * history["energy_kinetic"][11] / (0.5 * 1e4 * 1e-3 * 0.7e-6))
    assert history["sliding_speed"][11] == pytest.approx(speed, rel=1e-6)
    assert (np.diff(history["dissipated_friction"]) >= 0).all()


def test_slow_sliding_under_a_pull(tmp_path):
    """A wavy road on lossy rubber, pulled by its friction at some speed, slides at that speed."""
    speed = 2e-3
    start = ("&grid nx = 32, ny = 1, lx = 1e-3 /\n"
             "&surface shape = 'sine', amplitude = 8e-6, wavelength = 1e-3 /\n"
             "&material shear_modulus = 1e6, prony_g = 3e6, prony_tau = 1e-2, thickness = 1e-3, "
             "density = {density} /\n&friction law = 'coulomb', coefficient = 0.05 /\n"
             "&phase pressure = 3e4, duration = 0.1, steps = 10 /\n{phases}"
             "&solver threads = 1 /\n&output file = '{file}' /\n")
    (tmp_path / "driven.nml").write_text(start.format(
        density=0, file=tmp_path / "driven.h5",
        phases=f"&phase velocity_x = {speed}, duration = 1, steps = 128 /\n"))
    driven = asperity.run(tmp_path / "driven.nml", quiet=True).history
    late = driven["road_x"] > 1.001e-3
    pull = float(driven["traction_x"][late].mean())
    assert driven["friction_viscous"][late].mean() > 0.01, "the rubber holds a part of the pull"
    (tmp_path / "pulled.nml").write_text(start.format(
        density=1e5, file=tmp_path / "pulled.h5",
        phases=f"&phase traction_x = {pull!r}, ramp = 'linear', duration = 0.6, steps = 150 /\n"
        f"&phase traction_x = {pull!r}, duration = 0.9, steps = 225 /\n"))
    pulled = asperity.run(tmp_path / "pulled.nml", quiet=True).history
    late = pulled["time"] > 1.1
    found = np.polyfit(pulled["time"][late], pulled["road_x"][late], 1)[0]
    assert found == pytest.approx(speed, rel=2e-3)


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_an_approach_that_loses_contact_within_a_step(tmp_path):
    """Without strength, friction changes no pressure, also if a pass finds the surfaces apart."""
    text = (
        "&grid nx = 16, ny = 1, lx = 16e-5 /\n"
        "&surface shape = 'sine', amplitude = 1e-6, wavelength = 16e-5 /\n"
        "&material shear_modulus = 1e6, prony_g = 5e6, prony_tau = 1e-4 /\n"
        "&phase displacement = 3e-7, relaxed = .true. /\n"
        "&phase displacement = 1.5e-7, ramp = 'linear', duration = 1e-4, steps = 2, "
        "velocity_x = 0.1 /\n"
        "&solver time_scheme = 'backward_euler' /\n")
    runs = []
    flat = "&friction law = 'coulomb', coefficient = 0, slope_effect = .false. /\n"
    for k, friction in enumerate(("", flat)):
        (tmp_path / f"case{k}.nml").write_text(text + friction)
        runs.append(asperity.run(tmp_path / f"case{k}.nml", quiet=True).history)
    for name in ("pressure", "energy_elastic", "contact_area"):
        assert runs[1][name] == pytest.approx(runs[0][name], rel=1e-4), name
    assert (runs[0]["pressure"] > 0).all()


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_surfaces_that_are_drawn_apart_carry_nothing(tmp_path):
    """An elastic solid that was in friction contact stores no energy once it is lifted off."""
    (tmp_path / "case.nml").write_text(
        "&grid nx = 16, ny = 1, lx = 16e-5 /\n"
        "&surface shape = 'sine', amplitude = 1e-6, wavelength = 16e-5 /\n"
        "&material shear_modulus = 1e6 /\n&friction law = 'coulomb', coefficient = 0.3 /\n"
        "&phase displacement = 3e-7 /\n&phase duration = 1e-4, steps = 2, velocity_x = 0.1 /\n"
        "&phase displacement = -1e-7, duration = 1e-4, steps = 2, velocity_x = 0.1 /\n")
    history = asperity.run(tmp_path / "case.nml", quiet=True).history
    apart = history["displacement"] < 0
    assert apart.sum() == 3
    for name in ("pressure", "energy_elastic", "contact_area", "traction_x"):
        assert history[name][apart] == pytest.approx(0.0, abs=1e-12 * history[name].max()), name


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_open_cells_stand_over_the_road_under_the_moved_surface(tmp_path):
    """A cell that the moved surface presses on the road is in contact; gaps belong to that road."""
    height = 1e-6 * np.array([
        3.93, 16.54, 28.7, 40.43, 47.7, 45.76, 34.13, 17.67, 2.39, -9.55, -20.43, -32.49, -43.71,
        -48.5, -42.87, -28.47, -11.23])
    length, width, pressure, period = 1.204e-4, 1.248e-5, 1.887e5, 2.1255e-4
    with h5py.File(tmp_path / "road.h5", "w") as file:
        file["surface"] = height[None, :]
    (tmp_path / "case.nml").write_text(
        f"&grid nx = 17, ny = 1, lx = {length}, ly = {width} /\n"
        "&surface shape = 'file', file = 'road.h5' /\n"
        "&material poisson = 0.5, shear_modulus = 1e6, thickness = 4.86e-5 /\n"
        "&friction law = 'coulomb', coefficient = 2, slope_effect = .false. /\n"
        f"&phase pressure = {pressure} /\n"
        f"&phase duration = {period}, velocity_x = 0.1, steps = 3 /\n"
        f"&phase duration = {period / 2}, velocity_x = -0.1, steps = 1 /\n"
        "&solver tolerance = 1e-9 /\n&output snapshot_every = 1 /\n")
    run = asperity.run(tmp_path / "case.nml", quiet=True)
    assert run.history["residual_coupling"].max() <= 1e-9
    rms, dx = np.std(height), length / 17
    spline = CubicSpline(dx * np.arange(18), np.append(height, height[0]), bc_type="periodic")
    for snapshot, road in zip(run.snapshots, run.history["road_x"], strict=True):
        place = dx * np.arange(17) + snapshot["displacement_x"].ravel() - road
        level = (snapshot["displacement_z"] - snapshot["gap"]).ravel() - spline(place % length)
        assert level == pytest.approx(level[0], abs=1e-6 * rms), snapshot.step
        assert snapshot["gap"].min() > -1e-6 * rms, snapshot.step


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_pull_near_the_friction_limit_stays_finite(tmp_path):
    """A block that the friction may not hold across a ridge gives a clear outcome with numbers."""
    height = 1e-7 * np.array([8.10, 3.66, -5.84, -7.27, 1.35])
    with h5py.File(tmp_path / "road.h5", "w") as file:
        file["surface"] = np.tile(height, (3, 1))
    (tmp_path / "case.nml").write_text(
        "&grid nx = 5, ny = 3, lx = 5.148e-05, ly = 0.004391 /\n"
        "&surface shape = 'file', file = 'road.h5' /\n"
        "&material poisson = 0, shear_modulus = 1e6, prony_g = 8.476e6, prony_tau = 2.038e-5, "
        "thickness = 9.133e-6 /\n"
        "&friction law = 'coulomb_orowan', coefficient = 0.1493, shear_strength = 158.6 /\n"
        "&phase pressure = 2171, relaxed = .true. /\n"
        "&phase duration = 5.148e-5, traction_x = -0.05593, traction_y = 10.06, steps = 4, "
        "ramp = 'linear' /\n"
        "&solver tolerance = 1e-9, time_scheme = 'backward_euler' /\n"
        f"&output file = '{tmp_path / 'case.h5'}' /\n")
    with pytest.raises(asperity.NotConverged, match="the road is pulled by"):
        asperity.run(tmp_path / "case.nml", quiet=True)
    assert np.isfinite(asperity.open(tmp_path / "case.h5").history["road_y"]).all()
