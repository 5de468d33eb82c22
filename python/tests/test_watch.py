"""The live view in the terminal."""

import io
import os
import pty
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from conftest import PATIENCE, frictional_result, write_result
from viscoelastic_case import wait_for_rows

import asperity
from asperity.__main__ import main
from asperity.base.durations import duration
from asperity.watch import Pace, picture, sparkline, watch


def test_sparklines():
    assert sparkline(np.linspace(-1, 1, 8)) == "▁▂▃▄▅▆▇█"
    assert sparkline([1.0, np.nan, 3.0]) == "▁ █"
    assert sparkline([]) == ""
    assert sparkline([np.nan, np.nan]) == "  "
    # With more values than characters, each shows a mean: a peak of half a range is half as high.
    assert sparkline([0, 0, 0, 2, 2, 2, 0, 0], 4) == "▁▅█▁"


def test_pace_and_time_left():
    pace = Pace(memory=60.0)
    pace.look(0.0, 10)
    assert pace.rate is None
    pace.look(10.0, 30)
    assert pace.rate == pytest.approx(2.0)
    for when in range(11, 41):
        pace.look(float(when), 30)
    assert pace.rate == pytest.approx(20 / 40)
    assert pace.still == pytest.approx(30.0)
    pace.look(41.0, 5)  # the run was started again
    assert pace.rate is None
    assert [duration(seconds) for seconds in (0.4, 59.6, 3599)] == [
        "0 s", "1 min 0 s", "59 min 59 s"]


def test_view_of_a_run_that_is_going(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # a long path would take several lines
    path = frictional_result(Path("going.h5"), finished=0)
    with h5py.File(path, "a") as file:
        file.attrs["expected_rows"] = np.int32(25)
        file.attrs["warnings"] = "&grid: something " + "to be said " * 12
    pace = Pace()
    pace.look(0.0, 3)
    pace.look(1.0, 5)
    lines = picture(asperity.open(path), pace, 80)
    assert max(map(len, lines)) <= 80
    rows = asperity.open(path).history.rows
    left = round((25 - rows) / 2)
    assert lines[1] == f"{rows} of 25 rows ({4 * rows} %), 2 rows/s, {left} s left"
    text = "\n".join(lines)
    assert " friction  ▁" in text and "contact area  ▁" in text and "stick area" in text
    assert text.count("to be said") == 12
    plain = picture(asperity.open(path), pace, 80, unicode=False)
    assert all(line.isascii() for line in plain if "%" in line or "area  " in line)



@pytest.mark.parametrize("width", [45, 60, 100])
def test_the_bars_of_all_columns_show_the_same_rows(tmp_path, monkeypatch, width):
    monkeypatch.chdir(tmp_path)
    path = frictional_result(Path("bars.h5"), finished=0)
    rows = 200
    with h5py.File(path, "a") as file:
        for column in file["history"].values():
            column.resize((rows,))
        file["history/friction"][:] = np.linspace(0.0, 1.0, rows)
        file["history/contact_area"][:] = np.linspace(0.1234, 0.5678, rows)
        file["history/stick_area"][:] = np.linspace(0.0, 0.01234, rows)
    pace = Pace()
    pace.look(0.0, rows)
    lines = picture(asperity.open(path), pace, width)
    assert max(map(len, lines)) <= width
    bars = [line for line in lines if set(line) & set("▁▂▃▄▅▆▇█")]
    # One line for each column, in which the bars begin and end at the same places.
    assert [line[:12].strip() for line in bars] == ["friction", "contact area", "stick area"]
    places = {tuple(i for i, character in enumerate(line) if character in "▁▂▃▄▅▆▇█")
              for line in bars}
    assert len(places) == 1
    assert len(places.pop()) >= 12
    assert [" to " in line for line in bars] == 3 * [width > 50]


def test_plain_lines_where_there_is_no_terminal(tmp_path, monkeypatch):
    path = frictional_result(tmp_path / "going.h5", finished=0)
    looks = []

    def grow(seconds):
        looks.append(seconds)
        with h5py.File(path, "a") as file:
            if len(looks) == 2:  # nothing is new at the first look
                for column in file["history"].values():
                    column.resize((7,))
                file["history/step"][-1] = 6
            if len(looks) == 3:
                file.attrs["finished"] = np.int32(1)

    monkeypatch.setattr(time, "sleep", grow)
    out = io.StringIO()
    rows = asperity.open(path).history.rows
    assert watch(path, every=0.2, stream=out) == 0
    lines = out.getvalue().splitlines()
    assert [line.split(" rows")[0] for line in lines] == [str(rows), "7", "finished, 7"]
    assert "step 6" in lines[1]
    assert "\x1b" not in out.getvalue()
    assert looks == [0.2] * 3


def test_a_run_that_was_killed_or_stopped(tmp_path, monkeypatch):
    """The view reports once that a silent run may have been killed, and ends if a run stopped."""
    path = frictional_result(tmp_path / "silent.h5", finished=0)
    looks = []

    def wait(seconds):
        looks.append(seconds)
        if len(looks) == 2:
            os.utime(path, (time.time() - 60.0,) * 2)
        if len(looks) == 4:
            with h5py.File(path, "a") as file:
                file.attrs["outcome"] = "stopped after step 5"

    monkeypatch.setattr(time, "sleep", wait)
    out = io.StringIO()
    assert watch(path, stream=out) == 0
    first, silent, stopped = out.getvalue().splitlines()
    assert "no new row" not in first
    assert ("no new row for 1 min 0 s where a row takes up to 0.25 s: perhaps no longer running"
            in silent)
    assert "stopped after step 5" in stopped and len(looks) == 4


LONG = """&grid nx = 32, ny = 32, lx = 1e-3 /
&surface shape = 'sine', amplitude = 1e-6, wavelength = 0.5e-3 /
&material shear_modulus = 1e6, prony_g = 1e6, prony_tau = 1e-3 /
&phase pressure = 1e3 /
&phase duration = 1e3, steps = 1000000, velocity_x = 0.01 /
"""


def test_the_view_of_a_killed_run_ends(program, tmp_path):
    """On the machine of the run, the lock that nobody holds shows that its process has ended."""
    (tmp_path / "case.nml").write_text(LONG)
    with subprocess.Popen([program, "run", "case.nml", "--quiet"], cwd=tmp_path) as run:
        wait_for_rows(run, tmp_path / "case.h5", 3)
        run.kill()
    out = io.StringIO()
    assert watch(tmp_path / "case.h5", every=0.05, stream=out) == 0
    assert "its process has ended" in out.getvalue()


def test_command(result, tmp_path, capsys):
    assert main(["watch", str(result)]) == 0
    assert capsys.readouterr().out.startswith("finished, 6 rows: step 5")
    assert main(["watch", str(result), "--once"]) == 0
    assert "contact area  ▁" in capsys.readouterr().out
    assert main(["watch", str(tmp_path / "none.h5")]) == 3
    assert "none.h5: no such file: `asperity run CASE.nml` makes it" in capsys.readouterr().err
    assert main(["watch", str(result), "--every", "0"]) == 2
    assert "must be 0.05 to 3600" in capsys.readouterr().err


def test_a_file_without_rows(tmp_path):
    path = write_result(tmp_path / "early.h5", finished=0)
    with h5py.File(path, "a") as file:
        for column in file["history"].values():
            column.resize((0,))
    out = io.StringIO()
    assert watch(path, once=True, stream=out) == 0
    assert "0 rows" in out.getvalue() and "no row yet" in out.getvalue()


def test_follows_a_run_on_a_terminal_until_interrupted(program, tmp_path):
    case = subprocess.run([program, "template", "sliding"], capture_output=True, text=True,
                          check=True).stdout
    (tmp_path / "case.nml").write_text(case)
    subprocess.run([program, "run", "case.nml", "--quiet", "--output", "live.h5"], cwd=tmp_path,
                   check=True)
    with h5py.File(tmp_path / "live.h5", "a") as file:
        file.attrs["finished"] = np.int32(0)
        file.attrs["outcome"] = "running"
    ours, theirs = pty.openpty()
    with subprocess.Popen(
            [sys.executable, "-m", "asperity", "watch", "live.h5", "--every", "0.05"],
            cwd=tmp_path, stdin=theirs, stdout=theirs, stderr=subprocess.PIPE,
            # A shell starts background jobs with Ctrl-C ignored.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
            env={**os.environ, "TERM": "xterm", "COLUMNS": "90", "LINES": "24",
                 "PYTHONIOENCODING": "utf-8"}) as view:
        os.close(theirs)
        seen = b""
        until = time.monotonic() + PATIENCE
        while seen.count(b"\x1b[J") < 3 and time.monotonic() < until:
            if select.select([ours], [], [], 0.2)[0]:
                seen += os.read(ours, 65536)
        view.send_signal(signal.SIGINT)
        errors = view.stderr.read()
        status = view.wait(PATIENCE)
    os.close(ours)
    assert status == 130
    assert b"Traceback" not in errors
    text = seen.decode()
    # Each update overwrites the lines of the previous one.
    lines = text.split("\x1b[J")[0].count("\n")
    assert f"\x1b[{lines}A" in text
    assert "Viscoelastic friction of a cylinder" in text
    assert "friction  ▁" in text
