"""Means over whole laps: exact for periodic histories, with a warning for parts of laps."""

import math
import subprocess
from types import SimpleNamespace

import numpy as np
import pytest

import asperity
from asperity.results.steady import steady_mean

LX, LY = 1e-3, 0.5e-3


def run_of(travel, friction, angle=0.0, settings=""):
    """Return the parts of a run that steady_mean needs: a row at rest, then sliding at 0.1 m/s."""
    along = np.concatenate([[0.0], np.asarray(travel)])
    columns = {"time": along / 0.1, "road_x": along * math.cos(angle),
               "road_y": along * math.sin(angle), "phase": np.full(along.size, 1),
               "friction": np.concatenate([[0.0], np.asarray(friction)])}

    class History(dict):
        rows = along.size

    return SimpleNamespace(history=History(columns), attributes={"settings": settings}, input="",
                           path="run.h5", grid=SimpleNamespace(lx=LX, ly=LY))


def waves(laps, per_lap=200, drift=0.0):
    """Return a slide that settles in the first lap; its friction varies about 0.3 once per lap."""
    travel = np.arange(1, round(laps * per_lap) + 1) * LX / per_lap
    phase = 2 * np.pi * travel / LX
    return travel, 0.3 + 0.2 * np.sin(phase) - 0.3 * np.exp(-8 * travel / LX) + drift * phase


def test_whole_laps_give_the_mean_and_parts_do_not():
    for laps in (2.0, 3.3, 5.75):
        found = steady_mean(run_of(*waves(laps)))
        assert found.laps == math.floor(laps) - 1
        assert found.mean == pytest.approx(0.3, abs=2e-4)
    _, friction = waves(3.75)
    assert abs(friction[len(friction) // 2:].mean() - 0.3) > 0.01  # unlike the half


def test_part_of_a_lap_is_reported():
    found = steady_mean(run_of(*waves(0.8)))
    assert found.laps == pytest.approx(0.4) and math.isnan(found.error)
    assert "even have the wrong sign" in found.note
    one = steady_mean(run_of(*waves(1.5)))
    assert one.laps == 1.0 and "less than two laps" in one.note


def test_the_error_is_that_of_the_laps():
    """It is that of the mean of independent laps; laps that drift have a larger one."""
    random = np.random.default_rng(3)
    covered = []
    for _ in range(300):
        laps = 0.3 + 0.02 * random.standard_normal(41)
        travel = np.arange(1, 41 * 20 + 1) * LX / 20
        found = steady_mean(run_of(travel, np.repeat(laps, 20)))
        assert found.laps == 40
        covered.append(abs(found.mean - 0.3) < 2.0 * found.error)
    assert 0.88 < np.mean(covered) < 0.99
    drift = steady_mean(run_of(*waves(12.0, drift=0.002)))
    scatter = 0.002 * 2 * np.pi * np.std(np.arange(11), ddof=1)
    assert drift.error > 1.5 * scatter / math.sqrt(11)


def with_slip(run, part):
    """Give the run friction, in which the interface slips by a part of the travel of the road."""
    run.history["sliding_speed"] = np.concatenate([[0.0], 0.1 * np.broadcast_to(
        part, run.history.rows - 1)])
    run.attributes["settings"] = "&friction law = 'coulomb' /"
    return run


def test_a_contact_that_sticks_makes_no_laps():
    """The road moves on for three laps, but carries the surface of the rubber along."""
    found = steady_mean(with_slip(run_of(*waves(3.0)), 1e-4))
    assert found.laps == 0.0 and math.isnan(found.error)
    assert "the contact sticks" in found.note and "0.0003 laps" in found.note
    assert found.mean == run_of(*waves(3.0)).history["friction"][-1]


def test_laps_are_counted_by_the_slip():
    """Half of the speed makes half of the laps; the shear of the block before it slips does not."""
    travel, _ = waves(8.0)
    friction = 0.3 + 0.2 * np.sin(2 * np.pi * travel / (2 * LX))
    found = steady_mean(with_slip(run_of(travel, friction), 0.5))
    assert found.laps == 3.0 and found.mean == pytest.approx(0.3, abs=1e-3)
    travel, friction = waves(3.0)
    sheared = np.where(travel < 0.03 * LX, 0.0, 1.0)
    found = steady_mean(with_slip(run_of(travel, friction), sheared))
    assert found.laps == 2.0 and found.note == ""
    assert found.mean == pytest.approx(0.3, abs=1e-3)


def test_the_page_says_that_a_contact_sticks(program, tmp_path):
    """A thick block whose road moves by a lap is only sheared: there is no mean friction."""
    text = subprocess.run([program, "template", "friction"], check=True, capture_output=True,
                          text=True).stdout
    for old, new in (("nx = 64", "nx = 24"), ("ny = 37", "ny = 14"), ("steps = 100", "steps = 4"),
                     ("coefficient = 0.3", "coefficient = 1.0"),
                     ("duration = 1.5e-3", "duration = 0.5e-3")):
        assert old in text
        text = text.replace(old, new)
    run = asperity.run(text, output=tmp_path / "stick.h5", threads=1)
    assert run.history["stick_area"][-1] > 0.9
    page = run.report(tmp_path / "stick.html").read_text()
    assert "The contact sticks at the end of the run: it has slid by " in page
    assert "Mean friction" not in page
    assert not any("mean" in str(line.get_label()) for line in run.plot("friction").lines)


def test_laps_of_oblique_slides():
    """A lap ends where the road repeats along one of the axes."""
    angle = math.radians(20.0)
    lap = min(LX / math.cos(angle), LY / math.sin(angle))
    travel = np.arange(1, 1001) * lap * 4.5 / 1000
    found = steady_mean(run_of(travel, 0.3 + 0.1 * np.sin(2 * np.pi * travel / lap), angle))
    assert found.laps == 3.0 and found.mean == pytest.approx(0.3, abs=1e-4)


def test_real_runs(tmp_path):
    """For a sine wave along the sliding direction the history is constant once it is steady."""
    case = asperity.Case(
        grid=dict(nx=32, ny=1, lx=1e-3),
        surface=dict(shape="sine", amplitude=2e-6, wavelength=1e-3),
        material=dict(shear_modulus=1e6, prony_g=2e6, prony_tau=1e-3),
        phase=[dict(pressure=1e4), dict(velocity_x=0.05, duration=0.08, steps=128)])
    run = asperity.run(case, output=tmp_path / "slide.h5", threads=1)
    found = run.steady()
    assert found.laps == 3.0 and found.error < 1e-3 * found.mean
    steady = case.copy()
    steady.phase = [dict(steady=True, pressure=1e4, velocity_x=0.05)]
    state = asperity.run(steady, output=tmp_path / "steady.h5", threads=1)
    with_steps = state.steady("friction")
    assert math.isinf(with_steps.laps) and with_steps.error == 0.0
    assert with_steps.mean == pytest.approx(found.mean, rel=0.05)
    page = run.report(tmp_path / "slide.html").read_text()
    assert "Mean friction over the last 3 laps of the road" in page
    short = case.copy()
    short.phase[1].duration, short.phase[1].steps = 0.01, 16
    part = asperity.run(short, output=tmp_path / "short.h5", threads=1)
    with pytest.warns(UserWarning, match=r"friction: the slide is 0\.5 laps long"):
        part.steady()
    labels = [line.get_label() for line in run.plot("friction").lines]
    assert "mean of the last 3 laps" in labels
    table = asperity.sweep(case, {"phase[2].velocity_x": [0.05]}, measure="steady", quiet=True,
                           folder=tmp_path / "sweep")
    assert table["friction"][0] == found.mean and table["laps"][0] == 3.0
    with pytest.raises(KeyError, match="did you mean 'friction'"):
        run.steady("fricton")
