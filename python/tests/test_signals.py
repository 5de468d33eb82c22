"""Signals to a run, and readers of its result while it runs."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
import viscoelastic_case as vc
from conftest import PATIENCE

import asperity
from asperity.views.watch import watch


@pytest.fixture
def case(tmp_path: Path) -> Path:
    """Return an input."""
    path = tmp_path / "case.nml"
    path.write_text(vc.text(steps=60))
    return path


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_stop(program: str, case: Path, number: signal.Signals) -> None:
    """The run finishes its step, writes a checkpoint, and its exit status names the signal."""
    result = case.with_suffix(".h5")
    process = vc.start(program, case)
    vc.wait_for_rows(process, result, 7, number)
    _, message = process.communicate(timeout=PATIENCE)
    assert process.returncode == 128 + number
    assert number.name in message
    history, fields, finished = vc.contents(result)
    rows = len(history["step"])
    assert finished == 0
    assert 7 <= rows < vc.rows(60)
    assert {len(column) for column in history.values()} == {rows}
    assert f"step {rows - 1}" in message
    run = asperity.open(result)
    assert run.snapshots[-1].step == rows - 1  # the state at the stop
    assert np.all(np.isfinite(fields["pressure"]))
    whole = case.with_name("whole.nml")
    whole.write_text(case.read_text())
    assert vc.run(program, case, "--restart").returncode == 0
    assert vc.run(program, whole).returncode == 0
    vc.assert_same(result, whole.with_suffix(".h5"))


# With constant shear the passes of a pulled road may not settle, so the run takes hours.
STUCK = """
&grid nx = 48, ny = 41, lx = 1e-3, ly = 0.9e-3 /
&surface shape = 'self_affine', hurst = 0.8, wavelength_long = 0.5e-3,
   wavelength_short = 0.15e-3, rms_slope = 0.5, seed = 3 /
&material shear_modulus = 0.5e6, prony_g = 1e6, prony_tau = 1e-2, thickness = 1e-3 /
&friction law = 'constant_shear', shear_strength = 3e5 /
&phase pressure = 5e4, duration = 0.01, steps = 2 /
&phase traction_x = 3e4, duration = 0.01, steps = 20 /
&solver threads = 1, passes = 100000000, coupling_tolerance = 1e-8 /
&output checkpoint_minutes = 0 /
"""


@pytest.fixture
def stuck(tmp_path: Path) -> Path:
    """Return the input of a run whose row 3 takes hours."""
    path = tmp_path / "stuck.nml"
    path.write_text(STUCK)
    return path


def test_stop_within_a_row(program: str, stuck: Path) -> None:
    """A stop gives up a long row; a restart continues from the row before it."""
    result = stuck.with_suffix(".h5")
    for restart in ([], ["--restart"]):
        process = vc.start(program, stuck, *restart)
        vc.wait_for_rows(process, result, 3)
        vc.wait_for_work(process)
        process.terminate()
        start = time.monotonic()
        _, message = process.communicate(timeout=PATIENCE)
        assert time.monotonic() - start < 30.0  # 2 s if nothing else runs
        assert process.returncode == 143, message
        assert "stopped by SIGTERM after step 2, within the next one, which is lost" in message
        run = asperity.open(result)
        assert run.history.rows == 3
        assert run.outcome == "stopped after step 2"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_stop_within_a_row_of_python(stuck: Path, number: signal.Signals) -> None:
    """A run in Python stops as well; then Python handles the signal as it would without a run."""
    # A shell starts background jobs with Ctrl-C ignored; then Python would not raise.
    script = ("import signal, asperity\n"
              "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
              "try:\n"
              f"    asperity.run({str(stuck)!r})\n"
              "except KeyboardInterrupt:\n"
              "    print('interrupted')\n")
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
    vc.wait_for_rows(process, stuck.with_suffix(".h5"), 3)
    vc.wait_for_work(process)
    process.send_signal(number)
    printed, message = process.communicate(timeout=PATIENCE)
    if number == signal.SIGINT:
        assert (process.returncode, printed) == (0, "interrupted\n"), message
    else:
        assert process.returncode == -signal.SIGTERM, message
    assert asperity.open(stuck.with_suffix(".h5")).outcome == "stopped after step 2"
    assert stuck.with_suffix(".checkpoint.h5").exists()


def test_lock_shows_whether_a_run_continues(program: str, stuck: Path,
                                                     monkeypatch: pytest.MonkeyPatch) -> None:
    """The lock shows at once that a run was killed, and that a slow run was not."""
    result = stuck.with_suffix(".h5")
    process = vc.start(program, stuck)
    vc.wait_for_rows(process, result, 3)
    with monkeypatch.context() as patch:
        patch.setattr("asperity.results.standing.silence", lambda run: 1e6)
        assert "no longer running" not in asperity.open(result).state

    def told() -> str:
        return subprocess.run([program, "info", str(result)], stdout=subprocess.PIPE, text=True,
                              check=True).stdout

    assert "outcome     the run continues\n" in told()
    process.kill()
    process.communicate(timeout=PATIENCE)
    assert "The process has ended: it was killed, or it could not write" in told()
    assert asperity.open(result).state.endswith("its process has ended")
    lines = io.StringIO()
    watch(result, once=True, stream=lines)
    text = " ".join(lines.getvalue().split())            # lines are cut to the window
    assert "ended (there is no checkpoint: --overwrite starts again)" in text
    result.with_suffix(".checkpoint.h5").touch()
    watch(result, once=True, stream=lines)
    text = " ".join(lines.getvalue().split())
    assert "its process has ended (--restart continues" in text


# A solve that takes some minutes.
ENDLESS = """
&grid nx = 2048, ny = 2048, lx = 1e-3 /
&surface shape = 'self_affine', hurst = 0.8, wavelength_long = 0.5e-3,
   wavelength_short = 5e-6, rms_slope = 0.2 /
&material shear_modulus = 1e6 /
&phase pressure = 1e4 /
&solver method = 'thesis', tolerance = 1e-13, max_iterations = 1000000000 /
"""


@pytest.mark.parametrize("more, status, reason", [
    ((), 143, "stopped by SIGTERM before the first row"),
    (("--time-limit", "0:03"), 124, "the time limit is near: stopped before the first row")])
def test_stop_within_a_solve(program: str, tmp_path: Path, more: tuple[str, ...], status: int,
                             reason: str) -> None:
    """A row without friction is given up as well, after a signal or at the time limit."""
    case = tmp_path / "endless.nml"
    case.write_text(ENDLESS)
    process = vc.start(program, case, *more)
    if not more:
        vc.wait_for_work(process)
        process.terminate()
    start = time.monotonic()
    _, message = process.communicate(timeout=PATIENCE)
    assert time.monotonic() - start < 30.0  # 2 s, or 5 s, if nothing else runs
    assert process.returncode == status, message
    assert reason in message


@pytest.mark.parametrize("what", ["solve", "simulation"])
def test_interrupt_within_a_solve_of_python(tmp_path: Path, what: str) -> None:
    """Ctrl-C ends a call that would take hours, and the simulation is as it was before."""
    case = tmp_path / "endless.nml"
    case.write_text(ENDLESS)
    script = ("import signal, asperity\n"
              "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
              f"sim = asperity.Simulation({str(case)!r})\n"
              "height = sim.fields['height']\n"
              "try:\n"
              + ("    sim.advance()\n" if what == "simulation" else
                 "    asperity.solve_normal(height, 1e-3, None, 1e6, pressure=1e4,\n"
                 "        method='thesis', tolerance=1e-30, max_iterations=10**9)\n") +
              "except KeyboardInterrupt:\n"
              "    print('interrupted', sim.row, sim.fields['pressure'].max())\n"
              "contact = asperity.solve_normal(height, 1e-3, None, 1e6, pressure=1e4)\n"
              "print(contact.converged)\n")
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
    vc.wait_for_work(process, 4.0)
    process.send_signal(signal.SIGINT)
    printed, message = process.communicate(timeout=PATIENCE)
    assert (process.returncode, printed) == (0, "interrupted None 0.0\nTrue\n"), message


def test_stop_before_the_first_row(program: str, case: Path) -> None:
    """A signal during the start ends the run with the exit status of the signal."""
    for delay in (0.0, 0.005, 0.01, 0.02, 0.04):
        process = vc.start(program, case)
        time.sleep(delay)
        process.terminate()
        _, message = process.communicate(timeout=PATIENCE)
        # before the run handles signals, the system itself ends it
        assert process.returncode in (143, -signal.SIGTERM), (process.returncode, message)


@pytest.mark.parametrize(("row", "size", "steps"), [(5, 48, 60), (0, 300, 3)])
def test_checkpoint_on_demand(program: str, case: Path, row: int, size: int, steps: int) -> None:
    """SIGUSR1 makes the run write a checkpoint, and the run continues to its end.

    During the first row there is no state to save yet. The checkpoint is then written after it.
    """
    case.write_text(vc.text(steps=steps, size=size))
    result, checkpoint = case.with_suffix(".h5"), case.with_suffix(".checkpoint.h5")
    process = vc.start(program, case)
    assert not checkpoint.exists()
    vc.wait_for_rows(process, result, row, signal.SIGUSR1)
    end = time.monotonic() + PATIENCE
    while not checkpoint.exists() and process.poll() is None and time.monotonic() < end:
        time.sleep(0.001)
    assert checkpoint.exists()
    process.kill()
    process.communicate(timeout=PATIENCE)
    assert process.returncode == -signal.SIGKILL
    whole = case.with_name("whole.nml")
    whole.write_text(case.read_text())
    assert vc.run(program, case, "--restart").returncode == 0
    process = vc.start(program, whole)
    vc.wait_for_rows(process, whole.with_suffix(".h5"), row, signal.SIGUSR1)
    assert process.wait(PATIENCE) == 0  # the run continues
    process.communicate()
    vc.assert_same(result, whole.with_suffix(".h5"))


def test_a_running_result_can_be_read(program: str, case: Path) -> None:
    """h5py and asperity.open can read all complete rows, any number of times."""
    result = case.with_suffix(".h5")
    process = vc.start(program, case)
    vc.wait_for_rows(process, result, 3)
    seen = []
    while process.poll() is None and len(seen) < 200:
        with h5py.File(result, "r") as file:
            assert file.attrs["finished"] in (0, 1)
            steps = file["history/step"][:]
            np.testing.assert_array_equal(steps, np.arange(len(steps)))
            area = file["history/contact_area"][:]
            assert np.all((area > 0) & (area < 1))
        run = asperity.open(result)
        seen.append(len(run.history["step"]))
    _, message = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, message
    assert seen == sorted(seen)
    assert len(set(seen)) > 1, "no row came up while the run was read"
    assert len(asperity.open(result).history["step"]) == vc.rows(60)


def test_threads_and_checkpoints_leave_the_numbers(program: str, tmp_path: Path) -> None:
    """The numbers depend neither on checkpoints nor on the number of threads."""
    plain, other = tmp_path / "plain.nml", tmp_path / "other.nml"
    plain.write_text(vc.text(steps=10))
    other.write_text(vc.text(steps=10, output="checkpoint_every = 1"))
    assert vc.run(program, plain).returncode == 0
    threads = str(min(2, os.cpu_count() or 1))
    assert vc.run(program, other, "--threads", threads).returncode == 0
    vc.assert_same(other.with_suffix(".h5"), plain.with_suffix(".h5"))


def test_nobody_reads_the_messages(program: str, case: Path) -> None:
    """A run whose stderr is a pipe without a reader does its work, and its status says so."""
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run([program, "run", case], stderr=write, check=False, timeout=PATIENCE)
    os.close(write)
    assert done.returncode == 0
    assert asperity.open(case.with_suffix(".h5")).finished
    assert not case.with_suffix(".lock").exists()
