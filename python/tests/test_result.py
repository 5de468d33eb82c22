"""Reading results."""

import os
import re
import time

import h5py
import numpy as np
import pytest
from conftest import frictional_result, write_result

import asperity
from asperity.views.film import film


def test_reads_what_was_written(result):
    run = asperity.open(result)
    assert (run.title, run.program, run.version) == ("Sample", "asperity", "0.1.0")
    assert run.finished
    assert "&surface" in run.input
    assert (run.grid.nx, run.grid.ny, run.grid.boundary) == (24, 16, "periodic")
    assert run.grid.dx == pytest.approx(1e-4, rel=1e-12)
    assert run.grid.x.shape == (24,)
    assert run.height.shape == (16, 24)
    assert run.material.shear_modulus == run.material["shear_modulus"] == 1e6
    assert run.material["prony_g"].shape == (0,)
    assert list(run.history)[:3] == ["step", "phase", "time"]
    np.testing.assert_array_equal(run.history["pressure"], np.linspace(1e3, 5e4, 6))
    assert run.history.units("pressure") == "Pa"
    assert run.history.long_name("pressure") == "mean normal pressure"


def test_snapshots(result):
    run = asperity.open(result)
    assert len(run.snapshots) == 2
    assert run.snapshots.steps == (0, 5)
    last = run.snapshots[-1]
    assert (last.step, last.time, last.phase) == (5, 0.0, 1)
    assert last.pressure.shape == (16, 24)
    with h5py.File(result) as file:
        np.testing.assert_array_equal(last.pressure, file["snapshots/000005/pressure"])
    assert last["contact"].dtype == np.int8
    assert set(last.fields) == {"pressure", "gap", "traction_x", "contact"}
    assert [snapshot.step for snapshot in run.snapshots] == [0, 5]
    assert [snapshot.step for snapshot in run.snapshots[1:]] == [5]
    assert run.snapshots.at_step(0).step == 0
    with pytest.raises(IndexError, match="there are 2"):
        run.snapshots[2]
    with pytest.raises(KeyError, match="0, 5"):
        run.snapshots.at_step(3)


def test_names_are_completed_and_suggested(result):
    run = asperity.open(result)
    assert "friction" in run.history._ipython_key_completions_()
    assert "friction" in dir(run.history)
    assert "pressure" in dir(run.snapshots[0])
    with pytest.raises(KeyError, match="did you mean 'friction'"):
        run.history["fricton"]
    with pytest.raises(AttributeError, match="did you mean 'friction'"):
        _ = run.history.fricton
    with pytest.raises(KeyError, match="did you mean 'pressure'"):
        run.snapshots[0]["presure"]
    with pytest.raises(AttributeError, match="did you mean 'pressure'"):
        _ = run.snapshots[0].presure


def test_a_run_that_is_still_going(tmp_path):
    path = write_result(tmp_path / "going.h5", finished=0)
    run = asperity.open(path)
    assert not run.finished
    assert {len(column) for column in run.history.values()} == {5}
    with h5py.File(path, "a", locking=False) as writer:
        assert len(asperity.open(path).snapshots) == 1
        for column in writer["history"].values():
            column.resize((7,))
        writer["history/step"][-1] = 6
        writer["history/pressure"][-1] = 6e4
        writer.flush()
        assert run.refresh().history.rows == 7
        assert run.history["pressure"][-1] == 6e4
        assert run.snapshots.steps == (0, 5)


def test_snapshots_and_losses_of_rows_that_were_not_read(tmp_path):
    """A run may write a row with its snapshot between the reading of rows and of snapshots."""
    path = frictional_result(tmp_path / "going.h5")
    with h5py.File(path, "a") as file:
        for step in (6, 7):
            file.copy("snapshots/000005", file["snapshots"], name=f"{step:06d}")
        for step in (5, 6):
            file[f"losses/{step:06d}/octave"] = np.ones(3)
    run = asperity.open(path)
    assert run.snapshots.steps == (0, 5)
    assert list(run.losses) == [5] and 0 not in run.losses and run.losses.get(0) is None
    with pytest.raises(KeyError, match=r"row 0: has no losses: only rows of steady .* are \[5\]"):
        run.losses[0]
    none = asperity.open(frictional_result(tmp_path / "none.h5"))
    with pytest.raises(KeyError, match=r"row 3: has no losses: .* of which there is none"):
        none.losses[3]
    assert film(run, tmp_path / "film.gif", "pressure").stat().st_size > 0


def test_many_snapshots_are_all_listed(tmp_path):
    """The list of snapshots is not rewritten for each of them, and the file is opened anew."""
    (tmp_path / "a.nml").write_text(
        "&grid nx = 4, ny = 1, lx = 1e-3 /\n&surface shape = 'sine', amplitude = 1e-6,"
        " wavelength = 1e-3 /\n&material shear_modulus = 1e6 /\n&output snapshot_every = 1 /\n"
        "&phase pressure = 1e3, duration = 1, steps = 299, velocity_x = 1e-4 /\n")
    listed = []

    def look(_row, _sim):
        listed.append((tmp_path / "a.xdmf").read_text().count("<Time"))

    run = asperity.run(tmp_path / "a.nml", callback=look)
    assert len(run.snapshots) == 300
    assert [snapshot.step for snapshot in run.snapshots] == list(range(300))
    assert (tmp_path / "a.xdmf").read_text().count("<Time") == 300
    assert listed[10] >= 10
    assert listed[-1] >= 280
    assert len(set(listed)) < 100


def test_reprs_say_what_is_there(result):
    run = asperity.open(result)
    assert "Sample" in repr(run)
    assert "24 x 16" in repr(run)
    assert "finished, 6 rows, 2 snapshots (steps 0, 5)\n" in repr(run)
    assert "pressure" in repr(run.history)
    assert "step 5" in repr(run.snapshots[-1])
    assert "poisson: 0.5" in repr(run.material)


def unfinished(path, *, ago, seconds=0.25, outcome="running"):
    """Return a run without an end that was last written `ago` seconds before."""
    frictional_result(path, finished=0)
    with h5py.File(path, "a") as file:
        file.attrs["outcome"] = outcome
        file.attrs["expected_rows"] = np.int32(40)
        file["history/seconds"][:] = seconds
    written = time.time() - ago
    os.utime(path, (written, written))
    return asperity.open(path)


def test_a_killed_run_is_distinguished_from_one_that_continues(tmp_path):
    """The test compares the time since the last write with the time of a row."""
    dead = unfinished(tmp_path / "dead.h5", ago=190)
    assert dead.state == ("not finished, last written 3 min 10 s ago, and a row takes up to 0.25 s:"
                          " perhaps no longer running")
    assert "perhaps no longer running" in repr(dead) and "6 of 40 rows" in repr(dead)
    assert "perhaps no longer running" in dead._repr_html_()
    alive = unfinished(tmp_path / "alive.h5", ago=2)
    assert re.fullmatch(r"not finished, last written 2(\.\d)? s ago", alive.state)
    slow = unfinished(tmp_path / "slow.h5", ago=190, seconds=60.0)
    assert slow.state == "not finished, last written 3 min 10 s ago"
    ended = unfinished(tmp_path / "ended.h5", ago=190, outcome="stopped after step 5")
    assert ended.state == "not finished, stopped after step 5"
    assert asperity.open(frictional_result(tmp_path / "whole.h5")).state == "finished"


def test_missing_file(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none\.h5: no such file: `asperity run"):
        asperity.open(tmp_path / "none.h5")


def test_folder(tmp_path):
    with pytest.raises(IsADirectoryError, match="is a folder"):
        asperity.open(tmp_path)


@pytest.mark.parametrize(("content", "message"), [
    (b"", "is empty"),
    (b"&grid nx = 4 /\n", "is not an HDF5 file"),
    (b"\x89HDF\r\n\x1a\n then nothing", "cannot be read"),
])
def test_bad_files(tmp_path, content, message):
    path = tmp_path / "bad.h5"
    path.write_bytes(content)
    with pytest.raises(OSError, match=message) as caught:
        asperity.open(path)
    assert "bad.h5" in str(caught.value)


def test_truncated_file(result):
    result.write_bytes(result.read_bytes()[: result.stat().st_size // 2])
    message = r"rough\.h5: cannot be read: its end is missing: it has \d+ of \d+ bytes; .*--restart"
    with pytest.raises(OSError, match=message):
        asperity.open(result)


def test_another_hdf5_file(tmp_path):
    path = tmp_path / "other.h5"
    with h5py.File(path, "w") as file:
        file["numbers"] = [1, 2, 3]
    with pytest.raises(OSError, match=r"other\.h5: holds no /grid: it is not a result"):
        asperity.open(path)


def test_to_pandas(result):
    pandas = pytest.importorskip("pandas")
    table = asperity.open(result).history.to_pandas()
    assert isinstance(table, pandas.DataFrame)
    assert table["pressure"].iloc[-1] == 5e4


def test_text_that_is_not_utf_8(result):
    with h5py.File(result, "a") as file:
        file.attrs["title"] = np.bytes_("Gummi für 5 µm".encode("latin-1"))
        file.attrs.create("input", "&case title = 'ü' /".encode("latin-1"),
                          dtype=h5py.string_dtype("ascii"))
    run = asperity.open(result)
    assert run.title == "Gummi für 5 µm"
    assert run.input == "&case title = 'ü' /"
    assert run.report().read_text(encoding="utf-8").count("Gummi für 5 µm") == 3
