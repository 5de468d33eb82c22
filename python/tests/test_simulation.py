"""Simulations driven by Python: the program's numbers, steering, saved states, callbacks."""

import copy
import gc
import pickle

import h5py
import numpy as np
import pytest

import asperity
from asperity.runs import simulation

pytestmark = pytest.mark.filterwarnings("ignore:&")

BASE = """&grid nx = 32, ny = 24, lx = 1e-3, ly = 0.75e-3 /
&surface shape = 'self_affine', hurst = 0.8, rms_slope = 0.2, wavelength_long = 0.25e-3,
         wavelength_short = 125e-6, seed = 3 /
&material shear_modulus = 1e6, prony_g = 2e6, 1e6, prony_tau = 1e-5, 1e-3, thickness = 1e-3,
          wlf_c1 = 8., wlf_c2 = 120. /
&solver tolerance = 1e-6, threads = 1 /
"""
FRICTION = "&friction law = 'coulomb', coefficient = 0.5 /\n"
SLIDE = """&phase name = 'press', pressure = 0.2e6, relaxed = .true. /
&phase name = 'slide', duration = 0.1e-3, steps = 12, velocity_x = 1.0, velocity_y = 0.3 /
"""


def columns(rows):
    """Return the columns of rows, without the wall time."""
    return {name: np.array([row[name] for row in rows]) for name in rows[0] if name != "seconds"}


def ended(text, tmp_path, name="reference"):
    """Return the history of a run with a result file."""
    return asperity.run(text, output=tmp_path / f"{name}.h5").history


def test_the_first_touch_of_a_ramp_in_mixed_precision():
    """A step overflowed that was 1e20 times as large as the load before it, which was round-off."""
    rng = np.random.default_rng(0)
    for _ in range(100):
        x, y = rng.uniform(0.3, 0.7, 2)
        text = f"""&grid nx = 5, ny = 5, lx = 1.0 /
            &surface shape = 'paraboloid', radius = 100.0, centre_x = {x}, centre_y = {y} /
            &material shear_modulus = 1e6, prony_g = 40e6, prony_tau = 1e-3 /
            &phase duration = 1e-3, steps = 3, displacement = {10**rng.uniform(-5, -3.5)},
                   ramp = 'linear' /
            &solver precision = 'mixed', tolerance = 1e-4 /"""
        forces = []
        for case in (text, text.replace("mixed", "double")):
            rows = list(asperity.Simulation(asperity.Case.read(case)))
            forces.append([row.force for row in rows])
        np.testing.assert_allclose(*forces, rtol=3e-4, atol=1e-9 * max(forces[1]))


@pytest.mark.parametrize("laws", ["", FRICTION])
def test_the_numbers_are_those_of_a_run(tmp_path, laws):
    text = BASE + laws + SLIDE
    sim = asperity.Simulation(text)
    assert sim.row is None and not sim.finished
    rows = list(sim)
    reference = asperity.run(text, output=tmp_path / "run.h5")
    for name, values in columns(rows).items():
        assert np.array_equal(values, reference.history[name]), name
    assert sim.finished and sim.rows == len(rows) == reference.history.rows
    last = reference.snapshots[-1]
    for name in last.fields:
        assert np.array_equal(sim.fields[name], last[name]), name
        assert sim.fields[name].dtype == last[name].dtype
    assert sim.fields.height.shape == sim.shape == (24, 32)


def test_a_case_at_rest_is_that_of_a_run_though_its_road_could_be_moved(tmp_path):
    text = BASE + FRICTION + "&phase pressure = 0.2e6, duration = 1e-4, steps = 5 /\n"
    rows = list(asperity.Simulation(text))
    reference = ended(text, tmp_path)
    for name, values in columns(rows).items():
        assert np.array_equal(values, reference[name]), name


def test_no_files_are_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    list(asperity.Simulation(BASE + "&phase pressure = 1e5 /\n"))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("what", "value", "other"), [
    ("pressure", 0.3e6, "pressure = 0.3e6"), ("force", 0.18, "force = 0.18"),
    ("displacement", 6e-6, "displacement = 6e-6")])
def test_a_load_that_is_set_is_reached_at_the_end_of_the_next_step(tmp_path, what, value, other):
    sim = asperity.Simulation(
        BASE + "&phase pressure = 0.2e6, duration = 8e-5, steps = 8 /\n")
    rows = [sim.advance() for _ in range(5)]
    setattr(sim, what, value)
    rows += list(sim)
    reference = ended(BASE + "&phase pressure = 0.2e6, duration = 4e-5, steps = 4 /\n"
                      f"&phase {other}, ramp = 'linear', duration = 1e-5, steps = 1 /\n"
                      "&phase duration = 3e-5, steps = 3 /\n", tmp_path)
    assert getattr(rows[5], what) == pytest.approx(value, rel=1e-5)
    for name in ("time", "pressure", "displacement", "contact_area", "energy_elastic",
                 "dissipated_viscous"):
        found = columns(rows)[name]
        assert np.allclose(found, reference[name], rtol=2e-5, atol=1e-20), name


def test_a_load_set_before_the_first_row_begins_with_a_jump():
    sim = asperity.Simulation(BASE + "&phase pressure = 0.2e6, duration = 1e-4, steps = 2 /\n")
    sim.pressure = 0.1e6
    row = sim.advance()
    assert row.time == 0.0 and row.pressure == pytest.approx(0.1e6, rel=1e-5)


def test_a_velocity_that_is_set(tmp_path):
    sim = asperity.Simulation(BASE + FRICTION + "&phase pressure = 0.2e6 /\n"
                              "&phase duration = 1e-4, steps = 10, velocity_x = 1.0 /\n")
    rows = [sim.advance() for _ in range(5)]
    sim.velocity = (0.2, -0.5)
    rows += list(sim)
    assert sim.velocity == (0.2, -0.5)
    reference = ended(BASE + FRICTION + "&phase pressure = 0.2e6 /\n"
                      "&phase duration = 4e-5, steps = 4, velocity_x = 1.0 /\n"
                      "&phase duration = 6e-5, steps = 6, velocity_x = 0.2, velocity_y = -0.5 /\n",
                      tmp_path)
    found = columns(rows)
    assert found["road_x"][-1] == pytest.approx(4e-5 + 0.2 * 6e-5)
    assert found["road_y"][-1] == pytest.approx(-0.5 * 6e-5)
    for name in ("road_x", "road_y", "friction", "contact_area", "traction_x", "traction_y",
                 "displacement", "work_tangential", "dissipated_friction"):
        scale = np.abs(reference[name]).max()
        assert np.allclose(found[name], reference[name], rtol=0, atol=1e-5 * scale), name


def test_a_road_at_rest_is_set_in_motion(tmp_path):
    sim = asperity.Simulation(BASE + "&phase pressure = 0.2e6 /\n"
                              "&phase duration = 5e-5, steps = 5 /\n")
    sim.advance()
    sim.velocity = (1.0, 0.0)
    rows = list(sim)
    assert rows[-1].road_x == pytest.approx(5e-5) and rows[-1].friction_viscous > 0.01


def test_a_temperature_that_is_set_shifts_the_relaxation_times(tmp_path):
    phases = "&phase pressure = 0.2e6, duration = 1e-4, steps = 5 /\n"
    sim = asperity.Simulation(BASE + phases)
    sim.temperature = 5.0
    warm = list(asperity.Simulation(BASE + phases))
    cold = list(sim)
    reference = ended(BASE.replace("wlf_c1", "temperature = 5., wlf_c1") + phases, tmp_path)
    assert sim.temperature == 5.0
    for name in ("displacement", "contact_area", "dissipated_viscous"):
        assert np.allclose(columns(cold)[name], reference[name], rtol=1e-9), name
    assert cold[-1].displacement < 0.999 * warm[-1].displacement


STEADY = "&phase steady = .true., pressure = 0.2e6, velocity_x = 0.1 /\n"


@pytest.mark.parametrize("laws", ["", FRICTION])
def test_a_temperature_that_is_set_holds_for_steady_states(tmp_path, laws):
    sim = asperity.Simulation(BASE + laws + 3 * STEADY)
    rows = [sim.advance()]
    sim.temperature = 40.0
    rows += list(sim)
    reference = ended(BASE.replace("wlf_c1", "temperature = 40., wlf_c1") + laws + STEADY, tmp_path)
    for row in rows[1:]:
        assert row.friction_viscous == pytest.approx(reference["friction_viscous"][0], rel=1e-4)
        assert row.contact_area == reference["contact_area"][0]
    assert rows[0].contact_area < 0.99 * rows[1].contact_area


def test_a_displacement_cannot_be_set_for_a_steady_state():
    sim = asperity.Simulation(BASE + 2 * STEADY)
    first = sim.advance()
    sim.displacement = 1e-6
    with pytest.raises(ValueError, match="the next row is the steady state of phase 2"):
        sim.advance()
    assert columns([sim.row]) == columns([first])
    sim.pressure = 0.2e6
    assert sim.advance().pressure == pytest.approx(0.2e6)


def test_a_load_that_is_set_to_its_present_value_changes_nothing():
    text = BASE + "&phase pressure = 0.2e6, velocity_x = 1.0, duration = 8e-5, steps = 8 /\n"
    sim = asperity.Simulation(text)
    rows = []
    while not sim.finished:
        sim.pressure = 0.2e6
        rows.append(sim.advance())
    for name, values in columns(list(asperity.Simulation(text))).items():
        assert np.array_equal(values, columns(rows)[name]), name


def test_a_saved_state_continues_with_the_same_numbers(tmp_path):
    def new():
        sim = asperity.Simulation(BASE + FRICTION + SLIDE)
        rows = [sim.advance() for _ in range(5)]
        sim.pressure, sim.velocity, sim.temperature = 0.25e6, (0.5, 0.5), 30.0
        return sim, [*rows, sim.advance()]

    straight, _ = new()
    rest = list(straight)
    saved, before = new()
    assert saved.save(tmp_path / "state.h5") == tmp_path / "state.h5"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["state.h5"]
    del saved
    again = asperity.Simulation.resume(tmp_path / "state.h5")
    assert columns([again.row]) == columns(before[-1:])
    assert again.velocity == (0.5, 0.5) and again.temperature == 30.0
    found = list(again)
    assert len(found) == len(rest) > 4
    for name, values in columns(found).items():
        assert np.array_equal(values, columns(rest)[name]), name
    for name in again.fields:
        assert np.array_equal(again.fields[name], straight.fields[name]), name


def test_a_saved_state_has_the_road_under_the_surface_that_friction_has_moved(tmp_path):
    sim = asperity.Simulation(BASE + FRICTION + SLIDE)
    for _ in range(6):
        sim.advance()
    sim.save(tmp_path / "state.h5")
    again = asperity.Simulation.resume(tmp_path / "state.h5")
    assert np.abs(again.fields.height - sim.fields.height).max() < 1e-9 * np.ptp(sim.fields.height)
    # The slip of the last row is not part of a state.
    assert np.abs(sim.fields["slip_x"]).max() > 0
    assert np.isnan(again.fields["slip_x"]).all()
    again.advance()
    assert np.isfinite(again.fields["slip_x"]).all()


def test_a_row_that_was_complete_when_ctrl_c_came_is_not_lost(monkeypatch):
    step = simulation._step

    def late(handle):
        step(handle)
        raise KeyboardInterrupt

    phases = "&phase pressure = 0.2e6, duration = 2e-5, steps = 2 /\n"
    reference = list(asperity.Simulation(BASE + phases))
    sim = asperity.Simulation(BASE + phases)
    monkeypatch.setattr(simulation, "_step", late)
    for row in reference:
        with pytest.raises(KeyboardInterrupt):
            sim.advance()
        assert columns([sim.row]) == columns([row])
    assert sim.finished


def test_a_damaged_state_is_refused(tmp_path):
    sim = asperity.Simulation(BASE + SLIDE)
    with pytest.raises(ValueError, match="before the first row"):
        sim.save(tmp_path / "state.h5")
    sim.advance()
    sim.save(tmp_path / "state.h5")
    with h5py.File(tmp_path / "state.h5", "r+") as file:
        file["state"][5000] ^= 1
    with pytest.raises(OSError, match=r"state\.h5: the checkpoint is damaged"):
        asperity.Simulation.resume(tmp_path / "state.h5")
    with pytest.raises(OSError, match="there is no such file"):
        asperity.Simulation.resume(tmp_path / "nothing.h5")
    (tmp_path / "text.h5").write_text("no state")
    with pytest.raises(OSError, match="is no saved state"):
        asperity.Simulation.resume(tmp_path / "text.h5")
    with pytest.raises(OSError, match="there is no folder"):
        sim.save(tmp_path / "nowhere" / "state.h5")


def test_a_state_replaces_no_other_file(tmp_path):
    sim = asperity.Simulation(BASE + SLIDE)
    sim.advance()
    road = asperity.surface.save(tmp_path / "road.h5", np.zeros((4, 4)), lx=1.0)
    (tmp_path / "case.nml").write_text(BASE + SLIDE)
    (tmp_path / "damaged.h5").write_bytes(road.read_bytes()[:600])
    result = asperity.run(tmp_path / "case.nml").path
    for path, words in ((result, "is the result of a run"), (road, "is a height map"),
                        (tmp_path / "case.nml", "is an input"),
                        (tmp_path / "damaged.h5", "exists and is not the state")):
        kept = path.read_bytes()
        with pytest.raises(ValueError, match=f"{path.name}: {words}.*: name another file"):
            sim.save(path)
        assert path.read_bytes() == kept
    for _ in "twice":
        assert sim.save(tmp_path / "state.h5").exists()
    with pytest.raises(ValueError, match=r"state\.h5: is the state of a simulation"):
        asperity.surface.save(tmp_path / "state.h5", np.zeros((4, 4)), lx=1.0)


@pytest.mark.parametrize(("what", "value", "message"), [
    ("pressure", -1.0, "must be positive without adhesion"),
    ("pressure", np.nan, "must be a finite number"),
    ("velocity", (1.0, np.inf), "must be two finite numbers"),
    ("velocity", 1.0, "must be two finite numbers"),
    ("temperature", -150.0, "must be above reference_temperature - wlf_c2 = -100")])
def test_what_cannot_be_set(what, value, message):
    sim = asperity.Simulation(BASE + SLIDE)
    with pytest.raises(ValueError, match=message):
        setattr(sim, what, value)


def test_set_what_the_case_does_not_have():
    elastic = BASE.replace("prony_g = 2e6, 1e6, prony_tau = 1e-5, 1e-3, ", "")
    sim = asperity.Simulation(elastic + "&phase pressure = 1e5 /\n")
    with pytest.raises(ValueError, match="the material is elastic"):
        sim.temperature = 30.0
    with pytest.raises(ValueError, match="no phase of the case has a duration or moves it"):
        sim.velocity = (1.0, 0.0)
    with pytest.raises(ValueError, match="needs wlf_c1"):
        asperity.Simulation(BASE.replace("wlf_c1 = 8., wlf_c2 = 120.", "") + SLIDE
                            ).temperature = 30.0


def test_advance_after_the_last_row():
    with asperity.Simulation(BASE + "&phase pressure = 1e5 /\n") as sim:
        sim.advance()
        assert sim.finished
        with pytest.raises(ValueError, match="no row is left"):
            sim.advance()
        with pytest.raises(KeyError, match="did you mean 'pressure'"):
            sim.fields["presure"]
        assert "after row 0" in repr(sim) and "finished" in repr(sim)
    with pytest.raises(ValueError, match="closed"):
        sim.fields["pressure"]
    with pytest.raises(ValueError, match="the simulation is closed"):
        sim.advance()
    assert repr(sim) == "simulation that is closed"


def test_fields_keep_their_simulation():
    def fields():
        sim = asperity.Simulation(BASE + SLIDE)
        sim.advance()
        return sim.fields

    found = fields()
    gc.collect()
    assert found["pressure"].mean() == pytest.approx(0.2e6, rel=1e-4)
    gc.disable()
    try:  # the memory is freed at once, without the collector
        sim = asperity.Simulation(BASE + SLIDE)
        fields, release = sim.fields, sim._release
        del sim
        assert release.alive
        del fields
        assert not release.alive
    finally:
        gc.enable()


def test_the_number_of_open_simulations_is_limited():
    small = (BASE + SLIDE).replace("nx = 32, ny = 24", "nx = 16, ny = 12")
    gc.collect()
    with pytest.raises(ValueError, match="more than 128 runs and simulations are open at a time"):
        _ = [asperity.Simulation(small) for _ in range(129)]
    gc.collect()
    asperity.Simulation(small).advance()


def test_many_simulations_one_after_another():
    for _ in range(200):
        asperity.Simulation(BASE + "&phase pressure = 1e5 /\n")
    gc.collect()


def test_faults_of_the_input_are_those_of_a_run(tmp_path):
    with pytest.raises(ValueError, match="nxx"):
        asperity.Simulation(BASE.replace("nx =", "nxx ="))
    with pytest.raises(OSError, match="there is no such file"):
        asperity.Simulation(tmp_path / "nowhere.nml")


def test_a_solver_that_fails_leaves_its_state(tmp_path):
    sim = asperity.Simulation(BASE.replace("threads", "max_iterations = 2, threads")
                              + "&phase pressure = 1e5 /\n")
    with pytest.raises(asperity.NotConverged, match="step 0 of phase 1") as caught:
        sim.advance()
    assert caught.value.result is sim and sim.row.step == 0
    assert sim.finished
    with pytest.raises(ValueError, match="has not converged"):
        sim.save(tmp_path / "state.h5")
    assert not (tmp_path / "state.h5").exists()
    sent = pickle.loads(pickle.dumps(caught.value))
    assert isinstance(sent, asperity.NotConverged)
    assert str(sent) == str(caught.value) and sent.result is None


@pytest.mark.parametrize("repeat", [copy.copy, copy.deepcopy, pickle.dumps])
def test_a_simulation_is_not_copied(repeat):
    sim = asperity.Simulation(BASE + "&phase pressure = 1e5 /\n")
    with pytest.raises(TypeError, match=r"Simulation\.resume"):
        repeat(sim)


def test_a_callback_may_return_a_truth_value_of_numpy(tmp_path):
    run = asperity.run(BASE + FRICTION + SLIDE, output=tmp_path / "run.h5",
                       callback=lambda row, sim: sim.fields["pressure"].max() < 0)
    assert not run.finished and run.history.rows == 1


def test_a_callback_sees_each_row_and_may_end_the_run(tmp_path):
    text = BASE + FRICTION + SLIDE
    seen = []

    def watch(row, sim):
        assert row.step == sim.row.step == len(seen)
        seen.append((row.friction, sim.fields["pressure"].mean() / row.pressure))
        return row.step < 6

    run = asperity.run(text, output=tmp_path / "run.h5", callback=watch)
    assert not run.finished and run.history.rows == len(seen) == 7
    assert [friction for friction, _ in seen] == list(run.history["friction"])
    assert np.allclose([mean for _, mean in seen], 1.0, rtol=1e-4)
    run = asperity.run(text, output=tmp_path / "run.h5", restart=True,
                       callback=lambda row, sim: None)
    reference = asperity.run(text, output=tmp_path / "reference.h5")
    assert run.finished
    assert np.array_equal(run.history["friction"], reference.history["friction"])

    def steer(row, sim):
        sim.pressure = 1e5

    with pytest.raises(AttributeError, match=r"Use asperity\.Simulation"):
        asperity.run(text, output=tmp_path / "steered.h5", callback=steer)


def test_a_velocity_that_moves_the_road_too_far_in_a_step_is_noted_once():
    sim = asperity.Simulation(BASE + SLIDE)
    sim.advance()
    sim.velocity = (1.0, 0.0)                   # 0.27 cells per step
    sim.advance()
    sim.velocity = (0.0, -10.0)                 # 2.67 cells
    words = r"by 2\.67 cells in a step; .* per step: dt = 3\.1[23]e-06 s"
    with pytest.warns(UserWarning, match=words):
        sim.advance()
    sim.advance()


def test_what_is_set_must_exist_and_be_a_number():
    """Without the check, a misspelt variable of the load would be ignored silently."""
    sim = asperity.Simulation(BASE + SLIDE)
    for name, near in (("presure", "'pressure'"), ("velocity_x", "'velocity'")):
        with pytest.raises(AttributeError, match=f"named '{name}': did you mean {near}"):
            setattr(sim, name, 1e5)
    for name in ("pressure", "force", "displacement", "temperature", "velocity"):
        with pytest.raises(ValueError, match=rf"^{name} = 'much': must be"):
            setattr(sim, name, "much")
    with pytest.raises(ValueError, match=r"^velocity = .nan, 0.0.: must be"):
        sim.velocity = (np.nan, 0.0)

    for name in ("finished", "rows", "shape", "row", "fields"):
        with pytest.raises(AttributeError, match=f"named '{name}': there are pressure, force"):
            setattr(sim, name, 3)
    for pair in (("1", "2"), (1.0,), (1.0, True)):
        with pytest.raises(ValueError, match="must be two finite numbers"):
            sim.velocity = pair

    class Controlled(asperity.Simulation):
        target: float

    controlled = Controlled(BASE + SLIDE)
    controlled.target = 0.3
    assert controlled.target == 0.3
