"""Pictures and pages of curves of steady states, which have no time, and of single rows."""

import json
import re
import subprocess

import matplotlib.pyplot as plt
import numpy as np
import pytest

import asperity
from asperity.report import report_page
from asperity.results.derived import road_speed
from asperity.results.steady import steady_rows, steady_speeds
from asperity.views.film import _animation
from asperity.views.watch import last_row

SPEEDS = (0.01, 1.0, 100.0)


@pytest.fixture(autouse=True)
def close_figures():
    yield
    plt.close("all")


def computed(path, phases, **groups):
    """Run a small rough road."""
    case = asperity.Case(
        case=dict(title="Steady"), grid=dict(nx=32, ny=32, lx=1e-3),
        surface=dict(shape="self_affine", hurst=0.8, rms_slope=0.2, wavelength_long=0.5e-3,
                     wavelength_short=250e-6),
        material=dict(shear_modulus=1e6, prony_g=[2e6, 1e6], prony_tau=[1e-5, 1e-3]),
        phase=phases, solver=dict(tolerance=1e-5), **groups)
    return asperity.run(case, output=path, quiet=True)


def steady(*speeds, **more):
    """Return steady phases."""
    return [dict(steady=True, velocity_x=speed, **({} if k else {"pressure": 2e5}), **more)
            for k, speed in enumerate(speeds)]


@pytest.fixture(scope="module")
def curve(tmp_path_factory):
    """Return a curve of three steady states with friction, after a row at rest."""
    return computed(tmp_path_factory.mktemp("steady") / "curve.h5",
                    [dict(pressure=1e5, relaxed=True), *steady(*SPEEDS)],
                    friction=dict(law="coulomb", coefficient=0.3))


def test_speeds_of_steady_rows(curve, tmp_path):
    np.testing.assert_array_equal(steady_rows(curve), [False, True, True, True])
    np.testing.assert_allclose(steady_speeds(curve), [np.nan, *SPEEDS])
    np.testing.assert_allclose(road_speed(curve), [0.0, *SPEEDS])
    # A steady phase with a duration continues in time, and is no curve.
    run = computed(tmp_path / "time.h5", steady(1.0, duration=1e-4, steps=3))
    np.testing.assert_array_equal(steady_rows(run), [True, False, False, False])
    assert steady_speeds(run) is None


def test_a_curve_is_drawn_over_the_speed(curve):
    axes = curve.plot("friction")
    assert (axes.get_xlabel(), axes.get_xscale()) == ("sliding speed (m/s)", "log")
    np.testing.assert_allclose(axes.lines[0].get_xdata(), [np.nan, *SPEEDS])
    assert curve.plot("friction", "step").get_xscale() == "linear"
    assert curve.plot("sliding_speed").get_xlabel() == "pressure (kPa)"


def test_overview_of_a_curve_shows_friction_over_the_speed(curve):
    figure = curve.overview()
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels[:3] == ["friction coefficient", "contact area fraction", "mean gap (µm)"]
    assert {axes.get_xscale() for axes in figure.axes[:3]} == {"log"}
    assert figure.axes[2].get_xlabel() == "sliding speed (m/s)"
    assert figure.get_suptitle() == (
        f"Steady: step 3, steady at 100 m/s, friction {curve.history['friction'][-1]:.3g}")


def test_without_friction_a_curve_shows_the_same_over_the_speed(tmp_path):
    run = computed(tmp_path / "loss.h5", steady(*SPEEDS))
    panels = [axes for axes in run.overview().axes if axes.get_xscale() == "log"]
    assert [axes.get_ylabel().split(" (")[0] for axes in panels] == [
        "friction coefficient", "contact area fraction", "mean gap"]
    assert panels[-1].get_xlabel() == "sliding speed (m/s)"


def test_the_speed_is_named_by_info_check_and_watch(curve, program):
    info = subprocess.run([program, "info", str(curve.path)], capture_output=True, text=True,
                          check=True).stdout
    assert "phase 1: pressure 100000 Pa, relaxed\n" in info
    assert "phase 3: pressure 200000 Pa, steady sliding at 1 m/s\n" in info
    assert "! 4 phases, 3 steady states, 1 static solve, 0 time steps in 0 s" in (
        asperity.Case.read(curve.input).check())
    assert last_row(curve).startswith("step 3, sliding speed 100 m/s, contact area")


def test_a_film_of_a_curve_goes_along_the_speeds(tmp_path):
    run = computed(tmp_path / "film.h5", steady(*SPEEDS), output=dict(snapshot_every=1),
                   friction=dict(law="coulomb", coefficient=0.3))
    animation, figure = _animation(run, "contact")
    panel, curve = figure.axes
    for number, speed in enumerate(("10 mm/s", "1 m/s", "100 m/s")):
        animation._func(number)
        assert panel.get_title().startswith(f"step {number}, steady at {speed}, friction 0.")
        assert curve.lines[1].get_xdata() == [SPEEDS[number]]
    assert (curve.get_xlabel(), curve.get_xscale()) == ("sliding speed (m/s)", "log")
    animation._draw_was_started = True


def test_a_single_row_of_a_viscoelastic_road_shows_a_section(tmp_path):
    run = computed(tmp_path / "rest.h5", [dict(pressure=2e5, relaxed=True)])
    section, gap = run.overview().axes[2], run.overview().axes[-1]
    assert section.get_title().startswith("Section at y = ")
    assert section.get_ylim()[0] == 0.0 == gap.get_ylim()[0]


def test_the_page_of_a_curve_is_over_the_speed(curve):
    text = report_page(curve)
    data = json.loads(re.search(r'id="data"[^>]*>(.*?)</script>', text, re.DOTALL)[1])
    assert data["axes"][0] == {"name": "speed", "label": "Sliding speed", "unit": "m/s",
                               "log": True}
    assert "travel" not in [axis["name"] for axis in data["axes"]]
    assert data["columns"]["speed"] == [None, *SPEEDS]
    assert data["snapshots"][-1]["speed"] == SPEEDS[-1]
    # No time passes, and the speed is the horizontal axis.
    assert "<dt>Time</dt>" not in text
    assert "sliding_speed" not in [chart["id"] for chart in data["charts"]]


def test_a_part_of_a_lap_is_noted_off_the_data(frictional):
    axes = asperity.open(frictional).plot("friction")
    assert not axes.texts
    assert any(entry.get_text().endswith("of a lap: no mean")
               for entry in axes.get_legend().get_texts())
