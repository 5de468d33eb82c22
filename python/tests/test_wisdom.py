"""FFTW's plans are kept between runs: written if there are new ones, and never lost."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import PATIENCE

CASE = """&grid nx = {n}, ny = {n}, lx = 1.0 /
&surface shape = 'sine', amplitude = 1e-3, wavelength = 1.0 /
&material shear_modulus = 1e6 /
&phase pressure = 1e3 /
&solver precision = '{precision}' /
"""


def state(path: Path) -> tuple[int, int]:
    """Return numbers that change whenever the file is written."""
    status = path.stat()
    return status.st_ino, status.st_mtime_ns


def test_wisdom_is_kept(program: Path, tmp_path: Path) -> None:
    environment = dict(os.environ, XDG_CACHE_HOME=str(tmp_path / "cache"), OMP_NUM_THREADS="1")
    double, single = (tmp_path / "cache" / "asperity" / name for name in ("fftw", "fftwf"))

    def solve(n: int, precision: str = "double") -> None:
        (tmp_path / "case.nml").write_text(CASE.format(n=n, precision=precision))
        subprocess.run([str(program), "run", str(tmp_path / "case.nml"), "--quiet"], check=True,
                       env=environment)

    (tmp_path / "cache").mkdir()
    solve(20, "mixed")
    kept = state(double), state(single)
    solve(20, "mixed")
    assert (state(double), state(single)) == kept, "the files were written without anything new"

    # Another process learnt something after this one read the files; that must be kept, too.
    script = (
        "import sys, numpy as np, asperity\n"
        "def solve(n):\n"
        "    h = np.cos(2*np.pi*np.arange(n)/n)*np.ones((n, 1))\n"
        "    asperity.solve_normal(h, 1.0, 1.0, 1e6, pressure=1e3)\n"
        "solve(20)\n"
        "print('ready', flush=True)\n"
        "sys.stdin.readline()\n"
        "solve(28)\n")
    with subprocess.Popen([sys.executable, "-c", script], env=environment, text=True,
                          stdin=subprocess.PIPE, stdout=subprocess.PIPE) as early:
        assert early.stdout is not None and early.stdout.readline() == "ready\n"
        solve(24)
        early.communicate("\n", timeout=60)
    assert early.returncode == 0
    kept = state(double), state(single)
    for n in (20, 24, 28):
        solve(n)
    assert (state(double), state(single)) == kept, "the plans of another process were lost"
    assert sorted(path.name for path in double.parent.iterdir()) == ["fftw", "fftwf"]


@pytest.mark.parametrize("kind", ["device", "pipe", "folder", "huge"])
def test_a_file_of_wisdom_that_cannot_be_one_is_not_read(
        program: Path, tmp_path: Path, kind: str) -> None:
    """A link to /dev/zero was read for ever, and the run waited for a writer of a pipe."""
    folder = tmp_path / "asperity"
    folder.mkdir()
    path = folder / "fftw"
    if kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    else:
        with path.open("wb") as file:
            file.truncate(2**40)  # zeros that take no space on the disk
    before = path.lstat()
    (tmp_path / "case.nml").write_text(CASE.format(n=20, precision="mixed"))
    environment = dict(os.environ, XDG_CACHE_HOME=str(tmp_path), OMP_NUM_THREADS="1")
    run = subprocess.run([str(program), "run", str(tmp_path / "case.nml")], timeout=PATIENCE,
                         text=True, capture_output=True, env=environment)
    assert run.returncode == 0, run.stderr
    fault = "is larger than 64 MB" if kind == "huge" else "is no regular file"
    assert f"{path}: {fault}, and is ignored." in run.stderr
    # What the user has put there is not touched.
    after = path.lstat()
    assert (after.st_ino, after.st_mtime_ns) == (before.st_ino, before.st_mtime_ns)
    assert [one.name for one in folder.iterdir()] == ["fftw"]
