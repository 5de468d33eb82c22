"""FFTW's plans are kept between runs: written if there are new ones, and never lost."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

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
