"""A small run whose state has all the parts that a restart must restore."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path

import h5py
import numpy as np
from conftest import PATIENCE

# Columns that say how long a run took, not what it computed.
TIMES = {"seconds"}


def text(*, steps: int = 24, size: int = 48, scheme: str = "exponential2", extra: str = "",
         output: str = "checkpoint_minutes = 0") -> str:
    """Return the input: a rough road, three arms, a jump of load, a jump of speed, a ramp."""
    return f"""&case title = 'stopped and continued' /
&grid nx = {size}, ny = {size - 7}, lx = 1.2e-3, ly = 0.9e-3 /
&surface shape = 'self_affine', hurst = 0.8, wavelength_long = 0.6e-3,
   wavelength_short = 0.15e-3, rms_height = 4e-6, seed = 3 /
&material shear_modulus = 0.5e6, prony_g = 1e6, 0.5e6, 1e6, prony_tau = 1e-3, 1e-2, 0.1 /
&phase pressure = 2e4, duration = 0.05, steps = {steps} /
&phase velocity_x = 20e-3, velocity_y = -7e-3, duration = 0.05, steps = {steps} /
&phase pressure = 5e4, ramp = 'linear', velocity_x = 5e-3, duration = 0.05, steps = {steps} /
&solver threads = 1, time_scheme = '{scheme}' {extra} /
&output {output} /
"""


def rows(steps: int = 24) -> int:
    """Return the number of rows of the run: a jump, then the steps."""
    return 1 + 3 * steps


def start(program: str, case: Path, *arguments: str, **keywords) -> subprocess.Popen:
    """Start a run."""
    return subprocess.Popen([program, "run", str(case), "--quiet", *arguments],
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **keywords)


def run(program: str, case: Path, *arguments: str, **keywords) -> subprocess.CompletedProcess:
    """Run the case to its end."""
    return subprocess.run([program, "run", str(case), "--quiet", *arguments], text=True,
                          capture_output=True, timeout=PATIENCE, check=False, **keywords)


def count(path: Path) -> int:
    """Return the number of complete rows in a result, or -1 if it cannot be opened yet."""
    try:
        with h5py.File(path, "r") as file:
            return min(len(file["history"][name]) for name in file["history"])
    except (OSError, KeyError, ValueError):
        return -1


def wait_for_rows(process: subprocess.Popen, path: Path, wanted: int,
                  number: signal.Signals | None = None) -> None:
    """Wait until a run has written so many rows; then send it the signal that `number` gives.

    The run is suspended while its file is read, so that the signal comes in time on a slow machine.
    """
    end = time.monotonic() + PATIENCE
    there = False
    while not there:
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < end, "the run writes no rows"
        process.send_signal(signal.SIGSTOP)
        try:
            there = count(path) >= wanted
            if there and number is not None:
                process.send_signal(number)
        finally:
            process.send_signal(signal.SIGCONT)
        time.sleep(0.002)


def wait_for_work(process: subprocess.Popen, seconds: float = 1.0,
                  number: int | None = None) -> None:
    """Wait until a process has used so much more processor time.

    On a loaded machine its work must then have begun, which no waiting time ensures. `number` is
    that of the process, by default of `process`; with mpirun it is one that mpirun has started.
    """
    clock = os.sysconf("SC_CLK_TCK")
    first = None
    while process.poll() is None:
        file = Path(f"/proc/{number or process.pid}/stat")
        words = file.read_text().rpartition(")")[2].split()
        used = (int(words[11]) + int(words[12])) / clock
        first = used if first is None else first
        if used - first > seconds:
            return
        time.sleep(0.05)


def contents(path: Path) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray], int]:
    """Return the history, the last snapshot, and whether the run is finished."""
    with h5py.File(path, "r") as file:
        history = {name: file["history"][name][:] for name in file["history"]}
        last = sorted(file["snapshots"])[-1]
        fields = {name: file["snapshots"][last][name][:] for name in file["snapshots"][last]}
        return history, fields, int(file.attrs["finished"])


def assert_same(path: Path, reference: Path, tolerance: float = 0.0) -> None:
    """Check that both results have the same numbers: with no tolerance, in every bit."""
    history, fields, finished = contents(path)
    wanted_history, wanted_fields, _ = contents(reference)
    assert finished == 1
    assert history.keys() == wanted_history.keys()
    assert fields.keys() == wanted_fields.keys()
    for name in history.keys() - TIMES:
        scale = np.max(np.abs(wanted_history[name]))
        np.testing.assert_allclose(history[name], wanted_history[name], rtol=0,
                                   atol=tolerance * scale, err_msg=name)
    for name in fields:
        scale = np.max(np.abs(wanted_fields[name]))
        np.testing.assert_allclose(fields[name], wanted_fields[name], rtol=0,
                                   atol=tolerance * scale, err_msg=name)
