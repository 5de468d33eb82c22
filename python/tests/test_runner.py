"""Runs within Python have the numbers of the program's runs."""

import signal
import subprocess
import sys

import numpy as np
import pytest

import asperity
from asperity import runner

SLIDING = """
&case title = 'Sliding wave' /
&grid nx = 32, ny = 24, lx = 1e-3, ly = 0.9e-3 /
&surface shape = 'sine', amplitude = 2e-6, wavelength = 1e-3 /
&material shear_modulus = 1e6, prony_g = 2e6, prony_tau = 1e-3, poisson = 0.5 /
&phase pressure = 1e4, relaxed = .true. /
&phase duration = 4e-3, steps = 8, velocity_x = 0.05 /
&output snapshot_every = 4 /
"""


@pytest.fixture
def case(tmp_path):
    path = tmp_path / "sliding.nml"
    path.write_text(SLIDING)
    return path


def columns(run):
    """Return the columns of the history, without the wall time."""
    return {name: run.history[name] for name in run.history if name != "seconds"}


def test_the_program_gives_the_same_numbers(case, program, tmp_path):
    here = asperity.run(case, threads=1)
    assert here.path == case.with_suffix(".h5")
    assert here.finished
    assert here.title == "Sliding wave"
    assert here.input == SLIDING
    assert here.history.rows == 9
    assert here.history["friction"][-1] > 0
    other = tmp_path / "other.h5"
    subprocess.run([program, "run", str(case), "--output", str(other), "--quiet", "--threads", "1"],
                   check=True)
    there = asperity.open(other)
    for name, column in columns(there).items():
        np.testing.assert_array_equal(here.history[name], column, err_msg=name)
    assert here.snapshots.steps == there.snapshots.steps
    np.testing.assert_array_equal(here.snapshots[-1].pressure, there.snapshots[-1].pressure)
    np.testing.assert_array_equal(here.height, there.height)


def test_ctrl_c_and_restart(case, tmp_path, monkeypatch):
    whole = asperity.run(case, output=tmp_path / "whole.h5", threads=1)
    step = runner._step
    done = []

    def step_with_signal(handle, signals):
        outputs = step(handle, signals)
        done.append(outputs[1])
        if len(done) == 4:
            signal.raise_signal(signal.SIGINT)
        return outputs

    monkeypatch.setattr(runner, "_step", step_with_signal)
    # A shell starts background jobs with Ctrl-C ignored; then Python would not raise.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            asperity.run(case, output=tmp_path / "parts.h5", threads=1)
    finally:
        signal.signal(signal.SIGINT, before)
    assert done == [0, 1, 2, 3]
    stopped = asperity.open(tmp_path / "parts.h5")
    assert not stopped.finished
    assert stopped.history.rows == 4
    assert stopped.snapshots.steps[-1] == 3
    monkeypatch.undo()
    parts = asperity.run(case, output=tmp_path / "parts.h5", threads=1, restart=True)
    assert parts.finished
    for name, column in columns(whole).items():
        np.testing.assert_array_equal(parts.history[name], column, err_msg=name)
    with pytest.raises(OSError, match="checkpoint"):
        asperity.run(case, output=tmp_path / "none.h5", restart=True)


@pytest.mark.parametrize("error", [RuntimeError("mine"), SystemExit(5),
                                   asperity.NotConverged("a contact of the callback")])
def test_an_exception_of_the_callback_leaves_a_checkpoint(case, tmp_path, error):
    whole = asperity.run(case, output=tmp_path / "whole.h5", threads=1)

    def fail(row, sim):
        if row.step == 5:
            raise error

    with pytest.raises(type(error)) as raised:
        asperity.run(case, threads=1, callback=fail)
    assert raised.value is error
    stopped = asperity.open(case.with_suffix(".h5"))
    assert not stopped.finished and stopped.outcome == "stopped after step 5"
    assert stopped.snapshots.steps[-1] == 5
    assert case.with_suffix(".xdmf").exists()
    parts = asperity.run(case, threads=1, restart=True)
    assert parts.finished
    for name, column in columns(whole).items():
        np.testing.assert_array_equal(parts.history[name], column, err_msg=name)


def test_an_exception_after_the_last_row_leaves_a_finished_run(case):
    def fail(row, sim):
        if row.step == 8:
            raise RuntimeError("mine")

    with pytest.raises(RuntimeError, match="mine"):
        asperity.run(case, callback=fail)
    assert asperity.open(case.with_suffix(".h5")).finished
    assert not case.with_suffix(".checkpoint.h5").exists()


def test_a_running_result_can_be_read(case, monkeypatch):
    rows = []
    step = runner._step

    def step_and_look(handle, signals):
        outputs = step(handle, signals)
        rows.append(asperity.open(case.with_suffix(".h5")).history.rows)
        return outputs

    monkeypatch.setattr(runner, "_step", step_and_look)
    asperity.run(case)
    assert rows == list(range(1, 10))


def test_all_faults_of_the_input_are_reported(case):
    case.write_text(SLIDING.replace("nx = 32", "nx = -4").replace("'sine'", "'sinus'"))
    with pytest.raises(ValueError, match=r"nx = -4") as caught:
        asperity.run(case)
    assert "sinus" in str(caught.value)
    assert not case.with_suffix(".h5").exists()


def test_no_convergence_keeps_the_result(case):
    case.write_text(SLIDING + "&solver max_iterations = 1, tolerance = 1e-12 /\n")
    with pytest.raises(asperity.NotConverged, match="did not converge") as caught:
        asperity.run(case)
    assert isinstance(caught.value.result, asperity.Run)
    assert not caught.value.result.finished
    assert caught.value.result.history.rows == 1


def test_a_run_that_fails_closes_no_other_run(case, tmp_path, monkeypatch):
    """Each handle is closed once, and a handle that was closed is not given to a later run."""
    closed, opened = [], []
    close, begin = runner._close, runner._open

    def note_close(handle):
        closed.append(handle)
        return close(handle)

    def note_open(*arguments):
        outputs = begin(*arguments)
        opened.append(outputs[0])
        return outputs

    monkeypatch.setattr(runner, "_close", note_close)
    monkeypatch.setattr(runner, "_open", note_open)
    failing = SLIDING + "&solver max_iterations = 1, tolerance = 1e-12 /\n"
    with pytest.raises(asperity.NotConverged):
        asperity.run(failing, output=tmp_path / "failing.h5", threads=1)
    asperity.run(case, threads=1)
    assert len(opened) == 2 and opened[0] != opened[1]
    assert closed == opened
    # a closed handle names no run, even while another run is open
    handle = begin(b"case.nml", SLIDING.encode(), bytes(tmp_path / "a.h5"), 1, 0, 0)[0]
    close(opened[0])
    assert runner._step(handle, np.zeros(0, np.int32))[1] == 0
    close(handle)


def test_files_and_arguments(case, tmp_path):
    with pytest.raises(OSError, match="nowhere"):
        asperity.run(tmp_path / "nowhere.nml")
    with pytest.raises(OSError, match=r"lost.*x\.h5"):
        asperity.run(case, output=tmp_path / "lost" / "x.h5")
    with pytest.raises(ValueError, match="threads = 0"):
        asperity.run(case, threads=0)
    with pytest.raises(ValueError, match="threads = 1000000: must be an integer from 1 to 1024"):
        asperity.run(case, threads=1000000)
    with pytest.raises(ValueError, match="threads = 1000000: must be an integer from 1 to 1024"):
        asperity.Simulation(case, threads=1000000)
    with pytest.raises(ValueError, match="output: has 0 characters"):
        asperity.run(case, output="")


def test_many_runs_one_after_the_other(case):
    case.write_text(SLIDING.split("&phase duration")[0])
    for _ in range(66):
        assert asperity.run(case, threads=1).history.rows == 1


def test_progress_goes_to_stderr(case, capsys):
    asperity.run(case, quiet=False)
    message = capsys.readouterr()
    assert message.out == ""
    assert message.err.splitlines()[-1].startswith("step 8 of 8, t = 0.004 s, contact area ")


def test_a_run_does_not_disturb_numpy_threads():
    # The OpenMP and HDF5 of the library share a process with those of h5py.
    done = subprocess.run(
        [sys.executable, "-c", "import h5py, asperity, io; f = h5py.File(io.BytesIO(), 'w');"
         "f['x'] = 1; print(asperity.set_threads(1), f['x'][()])"],
        capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["1", "1"]


@pytest.mark.parametrize("wrong", [None, b"road.nml", 3, {"grid": {"nx": 4}}])
def test_what_is_no_case_is_named(wrong):
    for start in (asperity.run, asperity.Simulation):
        with pytest.raises(TypeError, match=r"case = .*: must be a path, the text of"):
            start(wrong)


def test_a_callback_is_checked_before_the_run():
    with pytest.raises(TypeError, match="callback = 3: must be a function"):
        asperity.run("nowhere.nml", callback=3)


def test_a_warning_points_to_the_call(case):
    case.write_text(SLIDING.replace("velocity_x = 0.05", "velocity_x = 0.5"))
    with pytest.warns(UserWarning, match="moves the road by") as found:
        asperity.run(case)
    assert {warning.filename for warning in found} == {__file__}


def test_restart_or_overwrite(case):
    with pytest.raises(ValueError, match="restart=True and overwrite=True are given together"):
        asperity.run(case, restart=True, overwrite=True)
    assert not case.with_suffix(".h5").exists()


def test_a_missing_folder_is_named_with_the_result(tmp_path):
    """The result is named, not the copy of the height map beside it."""
    held = asperity.Case(grid=dict(lx=1e-3), surface=np.zeros((4, 4)),
                         material=dict(shear_modulus=1e6), phase=dict(pressure=1e3))
    with pytest.raises(OSError, match=r"no/x\.h5: cannot be written: there is no folder '.*no'"):
        asperity.run(held, output=tmp_path / "no" / "x.h5")


def test_ragged_heights_are_named():
    with pytest.raises(ValueError, match="height: must be an array of real numbers"):
        asperity.solve_normal([[1.0, 2.0], [3.0]], 1e-3, 1e-3, 1e6, pressure=1e4)
