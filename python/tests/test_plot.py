"""Pictures: what they show, and that they are written."""

import subprocess
import sys

import h5py
import matplotlib.pyplot as plt
import numpy as np
import pytest
from conftest import write_result

import asperity
from asperity.__main__ import main
from asperity.plot import si_scale


@pytest.fixture(autouse=True)
def close_figures():
    yield
    plt.close("all")


def is_picture(path):
    """Return whether a file is a PNG that is not of one colour."""
    return path.read_bytes().startswith(b"\x89PNG") and np.ptp(plt.imread(path)[..., :3]) > 0.5


@pytest.mark.parametrize(("value", "units", "expected"), [
    (1.0, "m", (1.0, "m")),
    (999.0, "Pa", (1.0, "Pa")),
    (1000.0, "Pa", (1e-3, "kPa")),
    (2e-6, "m", (1e6, "µm")),
    (-4e-9, "J", (1e9, "nJ")),
    (0.0, "m", (1.0, "m")),
    (np.nan, "m", (1.0, "m")),
    (0.1, "1", (1.0, "")),
])
def test_si_prefixes(value, units, expected):
    factor, unit = si_scale(value, units)
    assert (pytest.approx(expected[0]), expected[1]) == (factor, unit)


def test_map(result):
    axes = asperity.open(result).snapshots[-1].plot("pressure")
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x (mm)", "y (mm)")
    bar = next(other for other in axes.figure.axes if other is not axes)
    assert bar.get_ylabel() == "Pressure (kPa)"
    image = axes.images[0]
    # Shown in kPa; cells without contact are masked, not coloured as zero.
    assert image.get_array().max() == pytest.approx(200.0)
    assert image.get_array().mask.any()
    np.testing.assert_allclose(image.get_extent(), [-0.05, 2.35, -0.05, 1.55], atol=1e-12)
    assert "step 5" in axes.get_title()


def test_signed_fields_have_a_symmetric_scale(result):
    image = asperity.open(result).snapshots[-1].plot("traction_x").images[0]
    assert image.norm.vmin == -image.norm.vmax


def test_contact_map_names_its_states(result):
    axes = asperity.open(result).snapshots[-1].plot("contact")
    bar = next(other for other in axes.figure.axes if other is not axes)
    assert [text.get_text() for text in bar.get_yticklabels()] == ["open", "stick", "slip"]


def test_line_contact_is_a_profile(tmp_path):
    run = asperity.open(write_result(tmp_path / "line.h5", ny=1))
    axes = run.snapshots[-1].plot("gap")
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x (mm)", "Gap (µm)")
    assert len(axes.lines[0].get_xdata()) == 24
    assert len(run.overview().axes) == 3


def test_history(result):
    run = asperity.open(result)
    axes = run.plot("contact_area")
    assert axes.get_xlabel() == "Pressure (kPa)"
    np.testing.assert_allclose(axes.lines[0].get_xdata(), run.history["pressure"] / 1e3)
    assert run.plot("pressure", x="step").get_ylabel() == "Pressure (kPa)"
    with pytest.raises(KeyError, match="did you mean 'contact_area'"):
        run.plot("contact_are")


def test_history_of_a_run_in_time(tmp_path):
    run = asperity.open(write_result(tmp_path / "time.h5", moving=True))
    assert run.plot("friction").get_xlabel() == "Time (ms)"
    assert "friction" in run.overview().axes[2].get_title()


def test_overview_shows_persson_for_elastic_rough_contact(result):
    figure = asperity.open(result).overview()
    area = next(axes for axes in figure.axes if axes.get_legend())
    lines = {line.get_label(): line for line in area.lines}
    assert set(lines) == {"Persson (2001)", "this run"}
    # A cosine product of amplitude a has the mean square slope a^2 (kx^2 + ky^2)/4.
    kx, ky = 2 * np.pi / 2.4e-3, 2 * np.pi / 1.6e-3
    slope = 2e-6 * np.sqrt((kx**2 + ky**2) / 4)
    line = lines["Persson (2001)"]
    initial = line.get_ydata()[1] / (line.get_xdata()[1] * 1e3)
    assert initial == pytest.approx(np.sqrt(8 / np.pi) / (4e6 * slope), rel=1e-3)


def test_command(result, capsys):
    assert main(["plot", str(result)]) == 0
    assert is_picture(result.with_suffix(".png"))
    picture = result.parent / "field.png"
    assert main(["plot", str(result), "--field", "gap", "--step", "0", "-o", str(picture)]) == 0
    assert is_picture(picture)
    assert str(picture) in capsys.readouterr().out
    assert main(["plot", str(result), "--history", "pressure", "--x", "step"]) == 0


@pytest.mark.parametrize(("words", "status", "message"), [
    (["--field", "presure"], 2, "did you mean 'pressure'"),
    (["--field", "gap", "--step", "3"], 2, "there are those of 0, 5"),
    (["-o", "/nowhere/at/all.png"], 3, "all.png"),
    (["-o", "picture.xyz"], 2, "xyz"),
])
def test_command_errors(result, capsys, words, status, message):
    assert main(["plot", str(result), *words]) == status
    assert message in capsys.readouterr().err


def test_command_from_the_shell(result, tmp_path):
    def call(*words):
        return subprocess.run([sys.executable, "-m", "asperity", *words], capture_output=True,
                              text=True, cwd=tmp_path, check=False)

    assert "plot" in call("--help").stdout
    assert call("plot", "--help").returncode == 0
    assert call().returncode == 2
    missing = call("plot", "none.h5")
    assert missing.returncode == 3
    assert "none.h5: no such file" in missing.stderr
    assert "Traceback" not in missing.stderr


def test_a_jump_of_speed_is_drawn_over_the_travel(tmp_path):
    path = write_result(tmp_path / "jump.h5", moving=True)
    with h5py.File(path, "a") as file:
        history = file["history"]
        rows = len(history["time"])
        del history["phase"], history["time"]
        for name, values, units in (
                ("phase", [1, 2, 2, 3, 3, 3], "1"), ("time", [0, 1, 2, 2.01, 2.02, 2.03], "s"),
                ("road_x", [0, 1e-4, 2e-4, 3e-4, 4e-4, 5e-4], "m"), ("road_y", np.zeros(6), "m")):
            history[name] = np.asarray(values)[:rows]
            history[name].attrs.update(units=units, long_name=name)
    panel = asperity.open(path).overview().axes[2]
    assert panel.get_xlabel() == "Travel of the road (µm)"
    assert panel.lines[0].get_xdata()[-1] == pytest.approx(500.0)
