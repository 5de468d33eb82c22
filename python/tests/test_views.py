"""How objects are shown in notebooks, as data sets, in messages and in a plain terminal."""

import io
import os
import re
import subprocess
import sys

import h5py
import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest

import asperity
from asperity.__main__ import main
from asperity.dma import DmaTable, fit_dma
from asperity.material import Prony
from asperity.runs.progress import SweepProgress
from asperity.runs.run_progress import RunProgress
from asperity.views.style import PRINT, print_style


def test_contacts_and_cases_show_themselves_in_notebooks():
    height = 1e-6 * np.cos(2 * np.pi * np.arange(16) / 16) * np.ones((8, 1))
    html = asperity.solve_normal(height, 1e-3, None, 1e6, pressure=1e2)._repr_html_()
    assert "16 × 8 cells, converged" in html and "contact_area" in html
    adhesive = asperity.solve_adhesive(height, 1e-3, None, 1e6, energy=1e-3, range=1e-7,
                                       pressure=1e2)
    assert "<table>" in adhesive._repr_html_()
    case = asperity.Case(grid=dict(nx=8, ny=8, lx=1e-3), phase=[dict(pressure=1), dict(force=2)])
    html = case._repr_html_()
    assert "&amp;phase 2" in html and "force = 2" in html


def test_numbers_and_their_units_stay_in_one_line(road):
    html = asperity.open(road / "road.h5").history._repr_html_()
    cells = re.findall(r'<td style="([^"]*)">([^<]*)</td>', html)
    assert any("µm" in text for _, text in cells)
    assert all("nowrap" in style for style, text in cells if re.match(r"-?\d", text))


def test_roads_and_fits_show_themselves_in_notebooks(tmp_path):
    path = asperity.surface.save(tmp_path / "map.h5", np.random.default_rng(1).random((6, 8)), 1.0)
    assert "rms height" in asperity.surface.load(path)._repr_html_()
    omega = np.logspace(0, 3, 12)
    modulus = asperity.material.Prony(1e6, [1e6], [1e-2]).complex_modulus(omega)
    rows = "\n".join(f"{w},{m.real},{m.imag}" for w, m in zip(omega, modulus, strict=True))
    (tmp_path / "dma.csv").write_text(f"omega (rad/s),G' (Pa),G'' (Pa)\n{rows}\n")
    fit = asperity.dma.fit_dma(asperity.dma.read_dma(tmp_path / "dma.csv"))
    assert "relaxation time" in fit._repr_html_()


def test_an_overview_is_shown_once_in_a_notebook(road, monkeypatch):
    run = asperity.open(road / "road.h5")
    plt.close("all")
    run.plot()
    assert plt.get_fignums()
    plt.close("all")
    monkeypatch.setattr(plt, "get_backend", lambda: "module://matplotlib_inline.backend_inline")
    figure = run.plot()
    assert not plt.get_fignums() and figure.axes


def test_a_fit_is_shown_once_in_a_notebook(monkeypatch):
    omega = np.geomspace(1.0, 1e4, 20)
    modulus = Prony(1e6, [1e6], [1e-2]).complex_modulus(omega)
    fit = fit_dma(DmaTable(omega, modulus.real, modulus.imag))
    plt.close("all")
    monkeypatch.setattr(plt, "get_backend", lambda: "module://matplotlib_inline.backend_inline")
    assert fit.plot().axes and not plt.get_fignums()


def test_the_display_of_figures_that_a_backend_switches_on_stays_on():
    # A notebook's backend is chosen with the first figure, which may be one of ours.
    with mpl.rc_context({"interactive": False}):
        with print_style():
            assert mpl.rcParams["font.size"] == PRINT["font.size"]
            mpl.interactive(True)
        assert mpl.is_interactive()


def test_a_run_as_a_data_set(road):
    pytest.importorskip("xarray")
    run = asperity.open(road / "road.h5")
    data = run.to_xarray()
    assert dict(data.sizes) == {"step": run.history.rows, "snapshot": len(run.snapshots),
                                "y": run.grid.ny, "x": run.grid.nx}
    assert np.array_equal(data.friction, run.history["friction"])
    assert np.array_equal(data.mean_pressure, run.history["pressure"])
    last = run.snapshots[-1]
    assert np.array_equal(data.pressure.sel(snapshot=last.step), last.pressure)
    assert data.pressure.attrs["units"] == "Pa" and float(data.snapshot_time[-1]) == last.time
    assert np.array_equal(data.height, run.height)


def test_progress_is_throttled(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("asperity.runs.run_progress.clock.monotonic", lambda: now[0])
    stream = io.StringIO()
    progress = RunProgress(1000, stream)
    for step in range(1000):
        now[0] += 0.01
        progress.show(step, 1e-3 * step, 0.1, 0.5)
    lines = stream.getvalue().splitlines()
    assert 5 <= len(lines) <= 7 and "step 0 of 999" in lines[0] and "step 999 of 999" in lines[-1]
    assert "s left" in lines[1] and "left" not in lines[-1]


def test_progress_in_a_notebook_is_a_bar(monkeypatch, capsys):
    shown = []

    class Handle:
        def update(self, bar):
            shown.append(bar)

    def display(bar, display_id):
        shown.append(bar)
        return Handle()

    monkeypatch.setattr("asperity.runs.notebook_bar._notebook_display", lambda: display)
    progress = RunProgress(3)
    for step in range(3):
        progress.show(step, 0.0, 0.1, 0.5)
    assert 'value="3" max="3"' in shown[-1]._repr_html_() and len(shown) >= 2
    shown.clear()
    many = SweepProgress("sweep", 4, 3, quiet=False)
    for number, fault in enumerate((None, "no contact", None)):
        many.done(f"case{number}", fault, 1.0, 1)
    assert 'value="4" max="4"' in shown[-1]._repr_html_() and len(shown) == 3
    assert "4 of 4 done, 1 failed" in shown[-1]._repr_html_()
    # Only what does not fit into a bar is printed.
    assert capsys.readouterr().err.splitlines() == [
        "sweep: 1 of 4 results are there already",
        "sweep: 3 of 4 done, 1 failed, about 0 s left: case1: FAILED: no contact"]


@pytest.mark.parametrize("wrong", [
    lambda big: asperity.solve_normal(np.zeros((4, 4)), big, None, 1e6, pressure=1.0),
    lambda big: asperity.Case(grid=dict(nx=big)),
    lambda big: asperity.operators.normal(8, 8, 1.0, modulus=big)])
def test_messages_do_not_print_arrays(wrong):
    with pytest.raises(ValueError) as caught:
        wrong(np.zeros((300, 300)))
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize("name", ["LC_ALL", "LANG"])
def test_watch_in_the_posix_locale_writes_ascii(road, tmp_path, name):
    path = tmp_path / "road.h5"
    path.write_bytes((road / "road.h5").read_bytes())
    with h5py.File(path, "r+") as file:
        file.attrs["title"] = "Straße"
    surroundings = {key: value for key, value in os.environ.items()
                    if key not in ("LC_ALL", "LC_CTYPE", "LANG", "PYTHONIOENCODING", "PYTHONUTF8")}
    done = subprocess.run([sys.executable, "-m", "asperity", "watch", str(path), "--once"],
                          capture_output=True, env=surroundings | {name: "POSIX"})
    assert done.returncode == 0, done.stderr
    assert done.stdout.isascii() and b"Stra?e" in done.stdout and b"us," in done.stdout


def test_info_describes_a_height_map(program, tmp_path):
    asperity.surface.save(tmp_path / "map.h5", 1e-6 * np.eye(8, 6), 1e-3, 2e-3, title="diagonal",
                          boundary="free")
    done = subprocess.run([program, "info", "map.h5"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    with h5py.File(tmp_path / "map.h5", "a") as file:
        file.attrs["steps_text"] = "levelled (mean)\nlengths and heights from um to m"
    assert "processing  levelled (mean); lengths and heights from um to m\n" in subprocess.run(
        [program, "info", "map.h5"], cwd=tmp_path, capture_output=True, text=True).stdout
    for message in ("a height map", "diagonal", "6 x 8 cells", "m, free", "heights     0 m to",
                 "file = 'map.h5'"):
        assert message in done.stdout, done.stdout


def test_import_of_a_picture_says_what_was_found(tmp_path, capsys):
    image = pytest.importorskip("PIL.Image")
    image.fromarray(np.arange(48, dtype=np.uint8).reshape(6, 8)).save(tmp_path / "h.tif")
    assert main(["import", str(tmp_path / "h.tif"), "-o", str(tmp_path / "x.h5")]) == 3
    message = capsys.readouterr().err
    assert "h.tif" in message and "holds no heights" in message
    assert "index out of range" not in message
