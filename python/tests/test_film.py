"""Films of a run."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from conftest import write_result
from matplotlib.colors import to_rgb
from PIL import Image

import asperity
from asperity.__main__ import main
from asperity.views.film import _animation, film
from asperity.views.style import COLOURS


@pytest.fixture(autouse=True)
def close_figures():
    yield
    plt.close("all")


def test_a_film_has_a_frame_for_each_snapshot(road, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["plot", str(road / "road.h5"), "--film", "-o", "road.gif"]) == 0
    assert "wrote road.gif" in capsys.readouterr().out
    run = asperity.open(road / "road.h5")
    with Image.open("road.gif") as picture:
        assert picture.n_frames == len(run.snapshots) >= 3
        first = np.asarray(picture.convert("L"), dtype=float)
        picture.seek(picture.n_frames - 1)
        assert np.abs(np.asarray(picture.convert("L"), dtype=float) - first).max() > 50
    assert main(["plot", str(road / "road.h5"), "--film", "pressure", "-o", "x.png"]) == 2
    assert "must be .gif or .mp4" in capsys.readouterr().err
    (tmp_path / "notes.gif").write_text("my notes")
    assert main(["plot", str(road / "road.h5"), "--film", "-o", "notes.gif"]) == 2
    assert "notes.gif: exists and is not a picture or a film" in capsys.readouterr().err


def test_a_film_of_few_frames_is_slow_enough_to_be_seen(road, tmp_path):
    run = asperity.open(road / "road.h5")
    with Image.open(film(run, tmp_path / "slow.gif")) as picture:
        assert picture.info["duration"] == 500
    with Image.open(film(run, tmp_path / "fast.gif", frames_per_second=20.0)) as picture:
        assert picture.info["duration"] == 50


def test_frames_have_one_unit_of_time_and_one_scale(road):
    run = asperity.open(road / "road.h5")
    animation, figure = _animation(run, "gap")
    panel, _, bar = figure.axes
    titles, limits = [], set()
    for number in range(len(run.snapshots)):
        animation._func(number)
        titles.append(panel.get_title())
        limits.add(panel.images[0].get_clim())
    assert titles == ["step 0, t = 0 µs", "step 32, t = 250 µs", "step 64, t = 500 µs"]
    (ends,) = limits
    gaps = np.stack([snapshot.gap for snapshot in run.snapshots]) * 1e6
    np.testing.assert_allclose(ends, (gaps.min(), gaps.max()))
    assert figure.get_suptitle() == run.title
    assert bar.get_ylabel() == "gap (µm)"
    animation._draw_was_started = True  # the frames were drawn by hand


def test_steps_are_whole_numbers(tmp_path):
    """A run without time is drawn over its steps, whose axis has no halves."""
    run = asperity.open(write_result(tmp_path / "load.h5", rows=3))
    animation, figure = _animation(run, "pressure")
    curve = figure.axes[1]
    assert curve.get_xlabel() == "step"
    for axes in (curve, run.plot("contact_area", "step")):
        axes.figure.canvas.draw()
        ticks = axes.get_xticks()
        assert len(ticks) >= 3 and np.all(ticks == np.round(ticks))
    animation._func(1)
    (mark,) = (line for line in curve.lines if line.get_marker() == "o")
    assert mark.get_xydata().tolist() == [[2.0, run.history["contact_area"][2]]]
    animation._draw_was_started = True  # the frames were drawn by hand


def test_the_colour_bar_is_as_tall_as_a_flat_map(tmp_path):
    write_result(tmp_path / "flat.h5", nx=60, ny=12, lx=6e-3, ly=1.2e-3)
    animation, figure = _animation(asperity.open(tmp_path / "flat.h5"), "gap")
    panel, _, bar = (axes.get_window_extent().height for axes in figure.axes)
    assert bar < 1.3 * panel
    animation._draw_was_started = True


def test_a_gif_keeps_rare_colours(road, tmp_path):
    with Image.open(film(asperity.open(road / "road.h5"), tmp_path / "gap.gif", "gap")) as picture:
        picture.seek(1)
        pixels = np.asarray(picture.convert("RGB"), dtype=float)
    # The mark on the curve, and the upper end of the colour scale.
    for colour in (to_rgb(COLOURS[1]), plt.get_cmap("cividis")(1.0)[:3]):
        assert np.abs(pixels - 255.0 * np.array(colour)).max(axis=-1).min() < 10.0
