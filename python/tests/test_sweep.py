"""Sweeps: values against solutions in closed form, resuming, failures, stopping."""

import importlib.util
import json
import os
import re
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np
import pytest
from conftest import PATIENCE
from viscoelastic_case import wait_for_rows

import asperity
from asperity.runs import means, progress
from asperity.sweep_table import Failure

AMPLITUDE, LENGTH, MODULUS = 1e-6, 1e-3, 4e6
FULL = np.pi * MODULUS * AMPLITUDE / LENGTH  # Pa, the pressure of full contact of one wave


def wave(**changes):
    """Return Westergaard's problem: a line contact of an elastic solid with one wave."""
    case = asperity.Case(
        title="wave", grid=dict(nx=256, ny=1, lx=LENGTH),
        surface=dict(shape="sine", amplitude=AMPLITUDE, wavelength=LENGTH),
        material=dict(shear_modulus=1e6), phase=[dict(pressure=1e3)], solver=dict(threads=1))
    for name, values in changes.items():
        case[name].update(values)
    return case


def sliding():
    """Return a case with several phases, two of which move."""
    case = wave()
    case.grid.nx = 32
    case.material.update(prony_g=[1e6], prony_tau=[1e-3])
    case.phase.append(velocity_x=0.03, duration=4e-3, steps=4)
    case.phase.append(velocity_x=0.01, duration=4e-3, steps=4)
    return case


def sweep(*arguments, **options):
    """Run a sweep without showing its progress."""
    return asperity.sweep(*arguments, **{"quiet": True, **options})


def test_areas_are_those_of_westergaard(tmp_path):
    loads = np.array([0.1, 0.3, 0.6]) * FULL
    table = sweep(wave(), {"phase.pressure": loads, "material.shear_modulus": [1e6, 2e6]},
                  folder=tmp_path, jobs=2)
    assert table.shape == (3, 2) and table.rows == 6
    np.testing.assert_array_equal(table["phase.pressure"], np.repeat(loads, 2))
    np.testing.assert_array_equal(table["material.shear_modulus"], [1e6, 2e6] * 3)
    # 2/pi asin sqrt(p/p_full); each edge has a half cell that counts as a whole one or not at all
    exact = 2 / np.pi * np.arcsin(np.sqrt(loads[:, None] / (FULL * np.array([1, 2]))))
    np.testing.assert_allclose(table.contact_area.reshape(table.shape), exact, atol=2 / 256)
    np.testing.assert_allclose(table["pressure"], table["phase.pressure"], rtol=1e-6)
    assert not table.failed
    assert table.paths[1].name == (f"phase.pressure={loads[0].item()},"
                                   "material.shear_modulus=2000000.0.h5")
    assert [run.title for run in table.runs] == ["wave"] * 6
    assert table.runs[-1].history["pressure"][-1] == pytest.approx(loads[-1])
    assert len(table.runs[1:3]) == 2
    index = json.loads((tmp_path / "sweep.json").read_text())
    assert index[table.paths[1].name] == {"phase.pressure": loads[0],
                                          "material.shear_modulus": 2e6}
    assert "phase.pressure" in repr(table) and "sweep of 6 cases" in repr(table)
    assert table._repr_html_().count("<tr>") == 7 and "sweep of 6 cases" in table._repr_html_()
    assert table.row(1)["pressure"] == table.pressure[1]
    assert [table.units(name) for name in ("phase.pressure", "mean_gap", "friction")] == [
        "Pa", "m", "1"]
    heads = re.findall(r"<th [^>]*>(.*?)</th>", table._repr_html_())
    assert heads[:3] == ["phase.pressure<br>(Pa)", "material.shear_modulus<br>(Pa)",
                         "contact_area"]
    assert "mean_gap<br>(m)" in heads
    with pytest.raises(KeyError, match="no column of the sweep"):
        table.units("gap_mean_of")
    with pytest.raises(KeyError, match="did you mean 'friction'"):
        table["fricton"]
    with pytest.raises(AttributeError, match="did you mean 'friction'"):
        _ = table.fricton
    assert "friction" in dir(table)
    if importlib.util.find_spec("pandas"):
        assert list(table.to_pandas()["pressure"]) == list(table.pressure)
    else:
        with pytest.raises(ImportError, match="pip install pandas"):
            table.to_pandas()


def test_the_same_as_a_run_in_process(tmp_path):
    table = sweep(sliding(), {"phase[2].velocity_x": [0.03, -0.02]}, folder=tmp_path / "sweep")
    case = sliding()
    case.phase[1].velocity_x = -0.02
    run = case.run(output=tmp_path / "alone.h5", threads=1)
    for name in table.results:
        if name != "seconds":
            assert table[name][1] == run.history[name][-1], name


def test_which_groups_are_set(tmp_path):
    # Without an index, every phase that has the variable is set.
    table = sweep(sliding(), {"phase.velocity_x": [0.025]}, folder=tmp_path)
    inputs = asperity.Case.read(table.runs[0].input)
    assert [phase.velocity_x for phase in inputs.phase] == [0.0, 0.025, 0.025]
    case = sliding()
    case.surface.append(shape="flat")
    for name, words in [
            ("phase.velocity_y", r"3 &phase and none names velocity_y.*phase\[3\]"),
            ("phase[4].pressure", "there are 3 &phase, counted from 1"),
            ("phase[0].pressure", "counted from 1"),
            ("surface.seed", r"2 &surface: which one\? Say surface\[1\].seed"),
            ("grid[1].nx", "only one &grid"),
            ("grid.nxx", "did you mean 'nx'"),
            ("grd.nx", "did you mean 'grid'"),
            ("nx", "must be a name such as")]:
        with pytest.raises(ValueError, match=words):
            sweep(case, {name: [1]}, folder=tmp_path)


def test_parallel_and_linked_lists(tmp_path):
    table = sweep(wave(), {("grid.nx", "phase.pressure"): [(64, 1e3), (128, 2e3)],
                           "solver.tolerance": [1e-5, 1e-7]}, zip=True, folder=tmp_path)
    assert table.shape == (2,)
    assert table["grid.nx"].tolist() == [64, 128]
    assert table["phase.pressure"].tolist() == [1e3, 2e3]
    assert table["solver.tolerance"].tolist() == [1e-5, 1e-7]
    assert [run.grid.nx for run in table.runs] == [64, 128]
    with pytest.raises(ValueError, match=r"one length, but grid.nx: 2, grid.lx: 1"):
        sweep(wave(), {"grid.nx": [8, 16], "grid.lx": [1.0]}, zip=True, folder=tmp_path)
    for parameters, words in [
            ({"grid.nx": []}, "has no values"), ({"grid.nx": 8}, "list of values"),
            ({"grid.nx": [8, 8]}, "is given twice"), ({}, "must be a dict"),
            ({("grid.nx", "grid.ny"): [(1, 2, 3)]}, "must be 2 values"),
            ({"grid.nx": [8], ("grid.nx", "grid.ny"): [(1, 2)]}, "given twice")]:
        with pytest.raises(ValueError, match=words):
            sweep(wave(), parameters, folder=tmp_path)
    assert not list(tmp_path.glob("*grid.lx*"))


def test_lists_and_strings_as_values(tmp_path):
    case = wave()
    table = sweep(case, {("material.prony_g", "material.prony_tau"):
                         [([1e6], [1.0]), (np.array([1e6, 2e6]), [1.0, 2.0])],
                         "grid.boundary": ["periodic"]}, folder=tmp_path)
    # Pressed in a jump, the area is that of G(0) = G + sum g.
    stiff = np.array([2.0, 4.0]) * MODULUS
    exact = 2 / np.pi * np.arcsin(np.sqrt(1e3 / (np.pi * stiff * AMPLITUDE / LENGTH)))
    np.testing.assert_allclose(table.contact_area, exact, atol=2 / 256)
    assert table["material.prony_g"][1] == [1e6, 2e6]
    assert table["grid.boundary"].tolist() == ["periodic"] * 2
    assert len({path.name for path in table.paths}) == 2
    assert all(path.is_file() for path in table.paths)


def test_measure(tmp_path):
    def measure(run):
        return {"peak": run.snapshots[-1].pressure.max(), "rows": run.history.rows}

    table = sweep(wave(), {"phase.pressure": [0.2 * FULL, 2 * FULL]}, folder=tmp_path,
                  measure=measure)
    assert table.results == ("peak", "rows")
    # Full contact: p + p_full cos(kx); in partial contact 2 p/sin(a) in the middle.
    exact = [2 * 0.2 * FULL / np.sqrt(0.2), 2 * FULL + FULL]
    np.testing.assert_allclose(table.peak, exact, rtol=2e-3)
    assert table.rows == 2 and table["rows"].tolist() == [1, 1]

    def broken(run):
        raise RuntimeError("in the callable")

    with pytest.raises(RuntimeError, match="in the callable") as caught:
        sweep(wave(), {"phase.pressure": [0.1 * FULL, 0.2 * FULL]}, folder=tmp_path, measure=broken)
    if sys.version_info >= (3, 11):
        assert caught.value.__notes__[0].startswith("measure: was called for ")
    assert len(list(tmp_path.glob("*.h5"))) == 3
    with pytest.raises(ValueError, match=r"measure: returned 1 for phase.*: must return a dict"):
        sweep(wave(), {"phase.pressure": [0.2 * FULL]}, folder=tmp_path,
              measure=lambda run: run.history.rows)


def test_finished_results_are_kept(tmp_path, capsys):
    case = wave()
    first = asperity.sweep(case, {"phase.pressure": [1e3, 2e3]}, folder=tmp_path)
    printed = capsys.readouterr()
    assert printed.out == "" and len(printed.err.splitlines()) == 2
    assert "2 of 2 done: phase.pressure=2000.0: done in" in printed.err.splitlines()[1]
    stamps = [path.stat().st_mtime_ns for path in first.paths]
    more = asperity.sweep(case, {"phase.pressure": [1e3, 2e3, 3e3]}, folder=tmp_path)
    assert capsys.readouterr().err.startswith("sweep: 2 of 3 results are there already\n")
    assert [path.stat().st_mtime_ns for path in more.paths[:2]] == stamps
    np.testing.assert_array_equal(more.contact_area[:2], first.contact_area)
    # Another input with the same name is run again, and so is everything if asked for.
    case.grid.nx = 128
    other = sweep(case, {"phase.pressure": [1e3]}, folder=tmp_path)
    assert other.runs[0].grid.nx == 128
    stamp = other.paths[0].stat().st_mtime_ns
    sweep(case, {"phase.pressure": [1e3]}, folder=tmp_path, resume=False)
    assert other.paths[0].stat().st_mtime_ns != stamp
    assert sorted(json.loads((tmp_path / "sweep.json").read_text())) == [
        f"phase.pressure={load}.h5" for load in (1000.0, 2000.0, 3000.0)]


def test_a_failing_case_does_not_lose_the_others(tmp_path):
    case = wave(grid=dict(nx=272), solver=dict(max_iterations=3, tolerance=1e-9))
    parameters = {"phase.pressure": [0.1 * FULL, 5 * FULL]}
    with pytest.raises(asperity.SweepError, match=r"1 of 2 cases failed.*\n.*did not converge"
                       ) as caught:
        sweep(case, parameters, folder=tmp_path, jobs=2)
    table = caught.value.result
    assert np.isnan(table.contact_area[0]) and table.contact_area[1] == 1.0
    (failure,) = table.failed
    assert isinstance(failure, Failure)
    assert (failure.index, failure.status) == (0, 4)
    assert failure.parameters == {"phase.pressure": 0.1 * FULL}
    reason, warned = failure.message.splitlines()
    assert "did not converge" in reason
    assert warned.startswith("warning: &grid: nx = 272 has the prime factor")
    assert "1 failed" in repr(table)
    kept = sweep(case, parameters, folder=tmp_path, errors="keep")
    assert len(kept.failed) == 1 and kept.contact_area[1] == 1.0


def test_wrong_inputs_are_reported_before_anything_runs(tmp_path):
    parameters = {"phase.pressure": [1e3, -1e3], "grid.nx": [64]}
    with pytest.raises(ValueError, match=r"phase.pressure = -1000.0, grid.nx = 64: .*adhesion"):
        sweep(wave(), parameters, folder=tmp_path / "new")
    assert not (tmp_path / "new").exists()
    table = sweep(wave(), parameters, folder=tmp_path, errors="keep")
    assert table.contact_area[0] > 0 and np.isnan(table.contact_area[1])
    assert table.failed[0].status == 2
    for options, words in [(dict(jobs=0), "jobs = 0"), (dict(threads=0), "threads = 0"),
                          (dict(threads=4096), "at most the"), (dict(errors="x"), "errors")]:
        with pytest.raises(ValueError, match=words):
            sweep(wave(), {"grid.nx": [8]}, folder=tmp_path, **options)
    (tmp_path / "file").touch()
    for folder in ("file", "file/sweep"):
        with pytest.raises(OSError, match="file: is a file: the runs need a folder"):
            sweep(wave(), {"grid.nx": [8]}, folder=tmp_path / folder)


def test_maps_and_default_folders(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "base").mkdir()
    x = np.arange(64) / 64
    with h5py.File(tmp_path / "base" / "map.h5", "w") as file:
        file["surface"] = np.cos(2 * np.pi * x)[None, :]
    case = wave()
    case.grid.nx = 64
    case.surface[0] = dict(shape="file", file="base/map.h5", scale=AMPLITUDE)
    case.output.file = "elsewhere.h5"
    path = case.write("base/road.nml")
    assert case.surface[0].file == "map.h5"
    table = sweep("base/road.nml", {"phase.pressure": [5 * FULL]})
    assert table.paths[0].parent == path.with_name("road_sweep")
    assert table.contact_area[0] == 1.0
    assert not (tmp_path / "base" / "elsewhere.h5").exists()
    text = sweep(str(wave()), {"phase.pressure": [5 * FULL]})
    assert text.paths[0].parent.name == "sweep" and text.contact_area[0] == 1.0
    # The input that is written beside a result runs by itself.
    alone = asperity.run(table.paths[0].with_suffix(".nml"), output="alone.h5")
    assert alone.history["contact_area"][-1] == 1.0


def test_warnings_of_the_program_are_passed_on(tmp_path):
    case = wave(grid=dict(nx=32))
    case.surface[0].wavelength = 5e-5  # below the Nyquist wavelength
    with pytest.warns(UserWarning, match="Nyquist"):
        sweep(case, {"phase.pressure": [1e3, 2e3]}, folder=tmp_path)


SCRIPT = """
import sys, asperity
case = asperity.Case(grid=dict(nx=128, ny=128, lx=1e-3),
    surface=dict(shape="sine", amplitude=2e-6, wavelength=1e-3),
    material=dict(shear_modulus=1e6, prony_g=[1e6], prony_tau=[1e-3]),
    phase=[dict(pressure=1e3, relaxed=True), dict(duration=1.0, steps=2000, velocity_x=1e-3)])
asperity.sweep(case, {"phase[1].pressure": [1e3, 2e3, 3e3]}, jobs=2, folder=sys.argv[1], quiet=True)
"""


def hear_ctrl_c():
    """Do not ignore Ctrl-C, as background jobs of a shell do, or SIGHUP, as under nohup."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.mark.parametrize("moment", ["start", "poll"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_does_not_interrupt_the_start_of_a_process(tmp_path, monkeypatch, number, moment):
    """A signal while a process is being started or waited for stops this process, too."""
    started = []

    class Process(subprocess.Popen):
        def __init__(self, *arguments, **keywords):
            super().__init__(*arguments, **keywords)
            started.append(self)
            if moment == "start":
                signal.raise_signal(number)

        def poll(self):
            if moment == "poll" and self is started[-1]:
                monkeypatch.setattr(Process, "poll", subprocess.Popen.poll)
                signal.raise_signal(number)
            return super().poll()

    case = wave()
    case.phase.append(duration=1.0, steps=100000, velocity_x=1e-3)
    program = asperity.runs.program.program()
    monkeypatch.setattr(asperity.runs.means, "program", lambda: program)
    monkeypatch.setattr(asperity.runs.jobs.subprocess, "Popen", Process)
    before = {one: signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM)}
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    try:
        with pytest.raises(KeyboardInterrupt if number == signal.SIGINT else SystemExit) as ended:
            sweep(case, {"phase[1].pressure": [1e3, 2e3]}, jobs=2, folder=tmp_path,
                  quiet=True)
        assert number == signal.SIGINT or ended.value.code == 143
        assert signal.getsignal(signal.SIGINT) == signal.default_int_handler
        assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)
    assert started
    assert all(process.returncode is not None for process in started)


def processes_in(folder):
    """Return the numbers of the processes that work in a folder, if the system shows them."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/cwd"):
        with suppress(OSError):  # it has ended, or is another user's
            if entry.resolve() == folder.resolve():
                found.append(int(entry.parent.name))
    return found


def rows_of(path):
    """Return how many rows a growing result contains."""
    try:
        return asperity.open(path).history.rows
    except OSError:
        return 0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
def test_a_stopped_sweep_leaves_checkpoints_and_continues(tmp_path, number):
    process = subprocess.Popen([sys.executable, "-c", SCRIPT, str(tmp_path)],
                               stderr=subprocess.PIPE, start_new_session=True,
                               preexec_fn=hear_ctrl_c)
    first = tmp_path / "phase1.pressure=1000.0.h5"
    second = tmp_path / "phase1.pressure=2000.0.h5"
    end = time.monotonic() + PATIENCE
    while rows_of(first) < 3 or rows_of(second) < 1:
        assert process.poll() is None, process.stderr.read()
        assert time.monotonic() < end, "no rows come up"
        time.sleep(0.02)
    process.send_signal(number)
    _, printed = process.communicate(timeout=PATIENCE)
    assert process.returncode in {
        signal.SIGINT: (-signal.SIGINT, 130), signal.SIGTERM: (128 + signal.SIGTERM,),
        signal.SIGHUP: (128 + signal.SIGHUP,), signal.SIGKILL: (-signal.SIGKILL,)}[number], printed
    # No child process continues, and each has left a checkpoint. After SIGKILL the children notice
    # at the next iteration or row that their parent has ended.
    while number == signal.SIGKILL and processes_in(tmp_path):
        assert time.monotonic() < end + PATIENCE, "a run goes on without its parent"
        time.sleep(0.02)
    assert processes_in(tmp_path) == []
    for load in ("1000.0", "2000.0"):
        assert (tmp_path / f"phase1.pressure={load}.checkpoint.h5").exists()
    stopped = asperity.open(first)
    assert not stopped.finished and 3 <= stopped.history.rows < 2001
    assert not (tmp_path / "phase1.pressure=3000.0.h5").exists()
    before = stopped.history["contact_area"]
    case = asperity.Case.read(stopped.input)
    case.phase[1].duration = None
    with pytest.raises(subprocess.CalledProcessError):  # the checkpoint is that of the whole case
        case.write(tmp_path / "other.nml")
        subprocess.run([asperity.runs.program.program(), "run", "other.nml", "--output", first.name,
                        "--restart", "--quiet"], cwd=tmp_path, check=True, capture_output=True)
    assert rows_of(first) == len(before)


class CountingExecutor(ThreadPoolExecutor):
    """An executor that counts the calls that wait or run at the same time."""

    now = most = 0

    def submit(self, *words):
        self.now += 1
        self.most = max(self.most, self.now)
        future = super().submit(*words)
        future.add_done_callback(self._ended)
        return future

    def _ended(self, _):
        self.now -= 1


@pytest.mark.parametrize(("jobs", "most"), [(None, 3), (2, 2)])
def test_an_executor_gets_as_many_jobs_at_a_time_as_allowed(tmp_path, jobs, most):
    with CountingExecutor(1) as executor:
        table = sweep(sliding(), {"phase[1].pressure": [1e3, 2e3, 3e3]}, folder=tmp_path,
                      executor=executor, jobs=jobs)
    assert np.isfinite(table["friction"]).all()
    assert executor.most == most


def test_the_script_of_a_job_array(tmp_path, monkeypatch):
    """A task that is started again keeps a complete result, and continues from a checkpoint."""
    sbatch = tmp_path / "sbatch"
    sbatch.write_text(f"#!/bin/sh\necho \"$@\" >{tmp_path}/words\necho 7\n")
    sbatch.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    folder = tmp_path / "array"
    threads = os.cpu_count() + 1        # the nodes may have more processors than this machine
    waiting = sweep(sliding(), {"phase[1].pressure": [1e3, 2e3]}, folder=folder, errors="keep",
                    slurm="--time=1", jobs=1, threads=threads)
    assert len(waiting.failed) == 2 and "submitted to Slurm" in waiting.failed[0].message
    assert f"--array=0-1%1 --cpus-per-task={threads} " in (tmp_path / "words").read_text()

    def task(number):
        return subprocess.run(["sh", folder / "job.sh"], capture_output=True, text=True,
                              env=dict(os.environ, SLURM_ARRAY_TASK_ID=str(number)))

    for number, result in enumerate(waiting.paths):
        assert task(number).returncode == 0
        whole = result.read_bytes()
        assert task(number).returncode == 0 and result.read_bytes() == whole
        # A damaged result without a checkpoint is computed again.
        result.write_bytes(whole[:3000])
        done = task(number)
        assert done.returncode == 0, done.stderr
    table = sweep(sliding(), {"phase[1].pressure": [1e3, 2e3]}, folder=folder)
    assert all(run.finished for run in table.runs)


def test_a_program_behind_a_script_does_not_miss_its_parent(tmp_path, monkeypatch, program):
    """The parent of the run is the script, not the process of the sweep."""
    script = tmp_path / "script"
    script.write_text(f"#!/bin/sh\n'{program}' \"$@\"\n")
    script.chmod(0o755)
    monkeypatch.setenv("ASPERITY_PROGRAM", str(script))
    asperity.runs.program.program.cache_clear()
    try:
        table = sweep(sliding(), {"phase[1].pressure": [1e3]}, folder=tmp_path / "a")
    finally:
        asperity.runs.program.program.cache_clear()
    assert table.runs[0].finished


@pytest.mark.parametrize("by_executor", [False, True])
def test_a_case_that_another_process_runs_is_waited_for(tmp_path, program, capsys, by_executor):
    """Two sweeps of one folder at once: each case is run by one of them."""
    case = sliding()
    case.phase[2].steps = 2000
    parameters = {"phase[1].pressure": [1e3]}
    name = sweep(case, parameters, folder=tmp_path / "name").paths[0].name
    folder = tmp_path / "parts"
    folder.mkdir()
    case.write(folder / f"{Path(name).stem}.nml")
    process = subprocess.Popen([program, "run", f"{Path(name).stem}.nml", "--quiet"], cwd=folder,
                               stderr=subprocess.DEVNULL)
    wait_for_rows(process, folder / name, 2)
    capsys.readouterr()
    with ThreadPoolExecutor(1) as executor:
        table = sweep(case, parameters, folder=folder, quiet=False,
                      executor=executor if by_executor else None)
    assert "waits for another process that runs it" in capsys.readouterr().err
    assert process.wait(PATIENCE) == 0
    assert table.failed == [] and table.runs[0].finished


def test_a_result_that_cannot_be_read_is_made_anew(tmp_path):
    """Another process may be writing such a file: a run first tries to continue it."""
    parameters = {"phase[1].pressure": [1e3, 2e3]}
    first, second = sweep(sliding(), parameters, folder=tmp_path).paths
    first.write_bytes(b"")
    second.write_bytes(second.read_bytes()[:3000])
    table = sweep(sliding(), parameters, folder=tmp_path)
    assert table.failed == [] and all(run.finished for run in table.runs)


@pytest.mark.parametrize("by_executor", [False, True])
def test_cases_that_another_sweep_completes_are_not_run_again(tmp_path, monkeypatch, by_executor):
    """While the first of three cases is counted, another sweep completes all of them."""
    parameters = {"phase[1].pressure": [1e3, 2e3, 3e3]}
    done = progress.SweepProgress.done
    made = {}

    def count(self, *arguments):
        if not made:
            made["begun"] = 0
            for path in sweep(sliding(), parameters, folder=tmp_path).paths:
                made[path] = (path.stat().st_ino, path.stat().st_mtime_ns)
        done(self, *arguments)

    monkeypatch.setattr(progress.SweepProgress, "done", count)
    with ThreadPoolExecutor(1) as executor:
        table = sweep(sliding(), parameters, folder=tmp_path, jobs=1,
                      executor=executor if by_executor else None)
    assert table.failed == [] and all(run.finished for run in table.runs)
    for path in table.paths:
        assert (path.stat().st_ino, path.stat().st_mtime_ns) == made[path], path.name


def test_a_worker_keeps_a_result_that_was_completed_before_it_started(tmp_path):
    """The worker was told to continue, but another process has completed the case meanwhile."""
    path = sweep(sliding(), {"phase[1].pressure": [1e3]}, folder=tmp_path).paths[0]
    made = (path.stat().st_ino, path.stat().st_mtime_ns)
    case = path.with_suffix(".nml")
    assert means.run_file(str(case), 1, restart=True) == (0, "")
    assert (path.stat().st_ino, path.stat().st_mtime_ns) == made
    case.write_text(case.read_text().replace("1000.0", "2000.0"))
    assert means.run_file(str(case), 1, restart=True) == (0, "")
    assert asperity.open(path).history.pressure[-1] == pytest.approx(2e3)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs Linux")
def test_a_restart_that_cannot_write_keeps_the_checkpoint(tmp_path, program):
    """Only a checkpoint that cannot be used leads to a run from the beginning."""
    case = sliding()
    case.phase[2].steps = 600
    job = tmp_path / sweep(case, {"phase[1].pressure": [1e3]}, folder=tmp_path / "n").paths[0].name
    case.write(job.with_suffix(".nml"))
    process = subprocess.Popen([program, "run", job.with_suffix(".nml").name, "--quiet"],
                               cwd=tmp_path, stderr=subprocess.DEVNULL)
    wait_for_rows(process, job, 5, signal.SIGINT)
    process.wait(PATIENCE)
    checkpoint = tmp_path / f"{job.stem}.checkpoint.h5"
    kept = checkpoint.read_bytes()
    full = tmp_path / "full"
    full.write_text("#!/bin/sh\nulimit -f 1\nexec '" + program + "' \"$@\"\n")
    full.chmod(0o755)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ASPERITY_PROGRAM", str(full))
        asperity.runs.program.program.cache_clear()
        table = sweep(case, {"phase[1].pressure": [1e3]}, folder=tmp_path, errors="keep")
    asperity.runs.program.program.cache_clear()
    assert len(table.failed) == 1 and checkpoint.read_bytes() == kept
    assert sweep(case, {"phase[1].pressure": [1e3]}, folder=tmp_path).runs[0].finished


def test_a_stopped_case_continues_from_its_checkpoint(tmp_path, program):
    case = sliding()
    whole = sweep(case, {"phase[1].pressure": [1e3]}, folder=tmp_path / "whole")
    case.phase[2].steps = 600
    case.phase[2].duration = 0.6
    parameters = {"phase[1].pressure": [1e3]}
    job = tmp_path / "parts" / whole.paths[0].name
    job.parent.mkdir()
    written = case.copy()
    written.write(job.with_suffix(".nml"))
    process = subprocess.Popen([program, "run", job.with_suffix(".nml").name, "--quiet"],
                               cwd=job.parent, stderr=subprocess.DEVNULL)
    wait_for_rows(process, job, 5, signal.SIGINT)
    process.wait(PATIENCE)
    stopped = asperity.open(job)
    assert not stopped.finished
    done = stopped.history.rows
    seconds = stopped.history["seconds"]
    table = sweep(case, parameters, folder=job.parent)
    run = table.runs[0]
    assert run.finished and run.history.rows == 605 > done
    # The earlier rows are kept: their times agree to the last digit.
    np.testing.assert_array_equal(run.history["seconds"][:done], seconds)


def test_the_name_of_a_file_is_no_reason_to_begin_again():
    """The program names the file in its messages."""
    begins_again = asperity.runs.jobs.begins_again
    assert not begins_again(3, "map=damaged.h5: cannot be written: No space left on device")
    assert begins_again(3, "map=a.checkpoint.h5: the checkpoint is damaged: its checksum or its")
    assert begins_again(2, "map=a.checkpoint.h5: is of another case")


def test_lists_and_numbers_can_be_set_together(tmp_path):
    material = {("material.prony_g", "material.prony_tau", "material.shear_modulus"): [
        ([1e6, 2e6], [1e-3, 1e-2], 1e6), ([3e6], [1e-3], 2e6)]}
    table = sweep(wave(), material, folder=tmp_path)
    assert [run.material["prony_g"].tolist() for run in table.runs] == [[1e6, 2e6], [3e6]]


@pytest.mark.filterwarnings("ignore:.*does not agree with its checksums")
def test_a_damaged_history_is_run_again(tmp_path):
    path = sweep(wave(), {"phase.pressure": [1e3]}, folder=tmp_path).paths[0]
    area = asperity.open(path).history.contact_area.copy()
    with h5py.File(path, "r+") as file:
        file["history/contact_area"][-1] = 0.9
    again = sweep(wave(), {"phase.pressure": [1e3]}, folder=tmp_path)
    np.testing.assert_array_equal(again.runs[0].history.contact_area, area)


def test_broken_results_are_run_again(tmp_path):
    parameters = {"phase.pressure": [1e3, 2e3, 3e3]}
    whole = sweep(wave(), parameters, folder=tmp_path)
    with h5py.File(whole.paths[0], "r+") as file:  # as after a kill before the first checkpoint
        file.attrs["finished"] = np.int32(0)
    whole.paths[1].write_bytes(b"no result")
    with h5py.File(whole.paths[2], "r+") as file:  # from an older version
        file.attrs["version"] = "0.0.1"
    again = sweep(wave(), parameters, folder=tmp_path)
    np.testing.assert_array_equal(again.contact_area, whole.contact_area)
    assert all(run.finished and run.version == asperity.__version__ for run in again.runs)


def test_a_program_that_is_missing_or_dies(tmp_path, monkeypatch):
    monkeypatch.setenv("ASPERITY_PROGRAM", str(tmp_path / "none"))
    asperity.runs.program.program.cache_clear()
    try:
        with pytest.raises(OSError, match="none"):
            sweep(wave(), {"phase.pressure": [1e3]}, folder=tmp_path / "a")
        dies = tmp_path / "dies"
        dies.write_text("#!/bin/sh\nkill -9 $$\n")
        dies.chmod(0o755)
        monkeypatch.setenv("ASPERITY_PROGRAM", str(dies))
        asperity.runs.program.program.cache_clear()
        table = sweep(wave(), {"phase.pressure": [1e3]}, folder=tmp_path / "b", errors="keep")
        assert table.failed[0].message == "killed by signal 9"
        assert table.rows == 1 and np.isnan(table["friction"]).all()
    finally:
        monkeypatch.undo()
        asperity.runs.program.program.cache_clear()


def test_a_long_table_is_cut():
    table = asperity.Sweep({"phase.pressure": np.arange(40.0), "friction": np.ones(40)},
                           ["phase.pressure"], (40,), [Path("x.h5")] * 40, [])
    lines = repr(table).splitlines()
    assert len(lines) == 33 and lines[-1] == "and 10 more rows"
    assert lines[2].split() == ["0", "1"]
    assert table._repr_html_().count("<td") == 60


def test_wrong_types_are_found_before_the_runs(tmp_path):
    case = asperity.Case(grid=dict(nx=8, ny=1, lx=1.0), material=dict(shear_modulus=1e6),
                         surface=dict(shape="sine", amplitude=1e-3, wavelength=1.0),
                         phase=dict(pressure=1e3))
    folder = tmp_path / "runs"
    for options, message in (
            (dict(measure=3), "measure = 3: must be a function of a run, or 'steady'"),
            (dict(measure="mean"), "measure = 'mean': must be a function of a run, or 'steady'"),
            (dict(executor=3), r"executor = 3: must be a concurrent\.futures\.Executor"),
            (dict(executor=ThreadPoolExecutor(1), slurm=""),
             "executor and slurm: give only one of them"),
            (dict(slurm="", jobs=0), "jobs = 0: must be a positive integer"),
            (dict(slurm="", resume=False),
             r"resume = False \(--no-resume\): not with slurm \(--slurm\): the same call must find"
             " the results of the jobs")):
        with pytest.raises(ValueError, match=f"^{message}$"):
            asperity.sweep(case, {"phase.pressure": [1e3]}, folder=folder, quiet=True, **options)
    with pytest.raises(ValueError, match=r"\]\]: must be 2 values, one for each name"):
        asperity.sweep(case, {("material.prony_g", "material.prony_tau"): [([1.0, 2.0],)]},
                       folder=folder, quiet=True)
    with pytest.raises(ValueError, match=r"^output\.file: the results of a sweep are named"):
        asperity.sweep(case, {"output.file": ["a.h5"]}, folder=folder, quiet=True)
    with pytest.raises(ValueError, match="named 'temperture': did you mean 'temperatures'"):
        asperity.friction_curve("road.h5", None, speeds=[1.0], pressures=[1e5], temperture=3)
    with pytest.raises(ValueError, match=r"^executor = 3: must be"):
        asperity.friction_curve("road.h5", None, speeds=[1.0], pressures=[1e5], executor=3,
                                folder=folder)
    assert not folder.exists()
