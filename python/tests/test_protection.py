"""A run does not touch inputs, other files, unfinished runs, or results that others write."""

from __future__ import annotations

import os
import re
import signal
import stat
import subprocess
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
import viscoelastic_case as vc
from conftest import PATIENCE

import asperity


@pytest.fixture
def case(tmp_path: Path) -> Path:
    """Return the input of a run with the given number of rows."""
    path = tmp_path / "y.nml"
    path.write_text(vc.text(size=24, steps=400))
    return path


def stopped(program: str, case: Path, rows: int = 3) -> Path:
    """Stop a run after some rows and return its result."""
    result = case.with_suffix(".h5")
    process = vc.start(program, case)
    vc.wait_for_rows(process, result, rows, signal.SIGTERM)
    process.communicate(timeout=PATIENCE)
    assert process.returncode == 143
    return result


def test_unfinished_run_is_kept(program: str, case: Path) -> None:
    """An unfinished run, or its checkpoint alone, is kept without --restart or --overwrite."""
    result = stopped(program, case)
    before = result.read_bytes()
    done = vc.run(program, case)
    assert done.returncode == 3
    assert "y.h5: holds an unfinished run: --restart continues it" in done.stderr
    assert result.read_bytes() == before
    with pytest.raises(OSError, match=r"run: restart=True continues it .* another output"):
        asperity.run(case)
    result.unlink()
    done = vc.run(program, case)
    assert done.returncode == 3
    assert "y.checkpoint.h5: there is a checkpoint of an unfinished run" in done.stderr
    assert case.with_suffix(".checkpoint.h5").exists()
    case.write_text(vc.text(size=24, steps=2))
    assert vc.run(program, case, "--overwrite").returncode == 0
    assert asperity.open(result).finished
    assert not case.with_suffix(".checkpoint.h5").exists()
    assert vc.run(program, case).returncode == 0  # a finished run is replaced
    done = vc.run(program, case, "--overwrite", "--restart")
    assert done.returncode == 2 and "give one of them" in done.stderr


def test_unfinished_run_without_a_checkpoint(program: str, case: Path) -> None:
    """A run that was killed before its first checkpoint can only be started again."""
    process = vc.start(program, case)
    vc.wait_for_rows(process, case.with_suffix(".h5"), 3, signal.SIGKILL)
    process.communicate(timeout=PATIENCE)
    assert not case.with_suffix(".checkpoint.h5").exists()
    done = vc.run(program, case)
    assert done.returncode == 3
    assert ("y.h5: holds an unfinished run, and there is no checkpoint: --overwrite starts again"
            in done.stderr)
    assert "--restart" not in done.stderr
    # The refused run leaves the lock of the dead process, which shows that this process has ended.
    assert f"asperity process {process.pid} on" in case.with_suffix(".lock").read_text()
    assert "its process has ended" in asperity.open(case.with_suffix(".h5")).state
    with pytest.raises(OSError, match=r"no checkpoint: overwrite=True starts again"):
        asperity.run(case)
    done = vc.run(program, case, "--restart")
    assert done.returncode == 3 and "has no checkpoint from which to continue" in done.stderr


@pytest.mark.parametrize("letters", [237, 238])
def test_a_name_leaves_room_for_that_of_the_checkpoint(program: str, case: Path, letters: int
                                                       ) -> None:
    """Without a checkpoint a stopped run could not be continued."""
    case.write_text(vc.text(size=24, steps=2, output="checkpoint_every = 1"))
    done = vc.run(program, case, "--output", str(case.with_name(letters * "n" + ".h5")))
    assert done.returncode == (0 if letters < 238 else 3)
    if done.returncode:
        assert "the name is too long: those of the files beside it have up to 256" in done.stderr


def test_a_file_that_takes_the_name_of_a_result_is_not_changed(program: str, case: Path) -> None:
    """The run ends with an error, and the file with its rows is the one that had the name."""
    result, other = case.with_suffix(".h5"), case.with_name("notes.txt")
    moved = case.with_name("moved.h5")
    case.write_text(vc.text(size=24, steps=4000))
    process = vc.start(program, case)
    vc.wait_for_rows(process, result, 3)
    os.link(result, moved)
    other.write_text("precious")
    other.replace(result)
    _, message = process.communicate(timeout=PATIENCE)
    assert process.returncode == 3
    assert "y.h5: cannot be written: the file has been removed, moved or replaced" in message
    assert result.read_text() == "precious"
    assert asperity.open(moved).history.rows >= 3


def test_overwrite_in_python(program: str, case: Path) -> None:
    """`asperity.run` has the same option."""
    result = stopped(program, case)
    case.write_text(vc.text(size=24, steps=2))
    assert asperity.run(case, overwrite=True).finished
    assert asperity.open(result).finished


def test_result_in_use(program: str, case: Path) -> None:
    """A second run on the same result ends at once and names the first one, which continues."""
    result = case.with_suffix(".h5")
    process = vc.start(program, case)
    vc.wait_for_rows(process, result, 2)
    link = case.with_name("link.h5")
    link.symlink_to(result)
    for arguments in ([], ["--restart"], ["--overwrite"], ["--overwrite", "--output", str(link)],
                      ["--output", str(case.parent / "y")]):
        done = vc.run(program, case, *arguments)
        assert done.returncode == 3, done.stderr
        assert re.search(rf"is in use by process {process.pid} on \S+ since 20", done.stderr)
    with pytest.raises(OSError, match=rf"in use by process {process.pid} "):
        asperity.run(case, overwrite=True)
    process.terminate()
    process.communicate(timeout=PATIENCE)
    assert process.returncode == 143
    assert not case.with_suffix(".lock").exists()
    assert asperity.open(result).history["step"].tolist() == list(range(vc.count(result)))


def test_lock_of_a_dead_process_is_ignored(program: str, case: Path) -> None:
    """The lock that a killed run leaves behind does not prevent the next run."""
    result = case.with_suffix(".h5")
    process = vc.start(program, case)
    vc.wait_for_rows(process, result, 2, signal.SIGKILL)
    process.communicate(timeout=PATIENCE)
    assert case.with_suffix(".lock").exists()
    case.write_text(vc.text(size=24, steps=2))
    done = vc.run(program, case, "--overwrite")
    assert done.returncode == 0, done.stderr
    assert not case.with_suffix(".lock").exists()


def test_many_at_once(program: str, case: Path) -> None:
    """Of several runs that start together, one writes the result and the others report it."""
    case.write_text(vc.text(size=24, steps=10))
    processes = [vc.start(program, case) for _ in range(6)]
    messages = [process.communicate(timeout=PATIENCE)[1] for process in processes]
    codes = [process.returncode for process in processes]
    assert set(codes) <= {0, 3} and 0 in codes, messages
    for code, message in zip(codes, messages, strict=True):
        assert code == 0 or "in use" in message or "unfinished" in message
    assert asperity.open(case.with_suffix(".h5")).finished


@pytest.mark.parametrize("name", ["y.checkpoint.h5", "y.xdmf", "y.h5.new", "y.checkpoint.h5.new",
                                  "y.xdmf.new", "y.lock"])
def test_files_of_others_are_kept(program: str, case: Path, name: str) -> None:
    """A file that a run would write beside its result is replaced only if Asperity wrote it."""
    other = case.with_name(name)
    other.write_text("a diary, four years long")
    done = vc.run(program, case, "--overwrite")
    assert done.returncode == 3, done.stderr
    assert name in done.stderr
    assert other.read_text() == "a diary, four years long"
    other.unlink()
    other.mkdir()
    done = vc.run(program, case, "--overwrite")
    assert done.returncode == 3 and name in done.stderr
    assert other.is_dir()


@pytest.mark.parametrize("name", ["y.checkpoint.h5", "y.xdmf", "y.h5.new", "y.lock", "y.h5"])
def test_height_map_is_kept(program: str, tmp_path: Path, name: str) -> None:
    """A height map with the name of a file of the run is an error of the input."""
    with h5py.File(tmp_path / name, "w") as file:
        file["surface/height"] = np.zeros((8, 8))
    before = (tmp_path / name).read_bytes()
    (tmp_path / "y.nml").write_text(
        f"&grid nx = 8, ny = 8, lx = 1 /\n&surface shape = 'file', file = '{name}' /\n"
        "&material shear_modulus = 1e6 /\n&phase pressure = 1 /\n")
    done = vc.run(program, tmp_path / "y.nml", "--overwrite")
    assert done.returncode == 2, done.stderr
    assert "the height map of a &surface" in done.stderr
    assert (tmp_path / name).read_bytes() == before


def test_other_hdf5_file_is_kept(program: str, case: Path) -> None:
    """A file that is not a result is never replaced, whether it is in HDF5's format or not."""
    result = case.with_suffix(".h5")
    with h5py.File(result, "w") as file:
        file["precious"] = 1.0
    for _ in range(2):
        before = result.read_bytes()
        done = vc.run(program, case)
        assert done.returncode == 3, done.stderr
        assert "y.h5: is not a result of Asperity" in done.stderr
        assert result.read_bytes() == before
        result.write_text("a letter")


def test_devices_and_pipes_are_kept(program: str, case: Path, tmp_path: Path) -> None:
    """A device, a pipe or a link to nothing is not replaced by a regular file."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    dangling = tmp_path / "dangling.h5"
    dangling.symlink_to(tmp_path / "nowhere.h5")
    for target, word in ((pipe, "not a regular file"), (dangling, "leads to no file")):
        done = vc.run(program, case, "--output", str(target), "--overwrite")
        assert done.returncode == 3, done.stderr
        assert word in done.stderr
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert dangling.is_symlink()
    done = vc.run(program, case, "--output", "/dev/null")
    assert done.returncode == 3, done.stderr
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)


def test_input_from_a_pipe_needs_an_output(program: str, case: Path, tmp_path: Path) -> None:
    """The result of such an input would be written into /dev."""
    def run(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([program, "run", "/dev/stdin", "--quiet", *words], cwd=tmp_path,
                              input=case.read_text(), capture_output=True, text=True,
                              check=False)

    refused = run()
    assert refused.returncode == 2
    assert refused.stderr == ("/dev/stdin: is not a regular file, so that the result needs a"
                              " name: give --output FILE.h5\n")
    assert not Path("/dev/stdin.h5").exists()
    assert run("--output", "piped.h5").returncode == 0
    assert asperity.open(tmp_path / "piped.h5").finished


@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGXCPU])
def test_other_signals_leave_a_checkpoint(program: str, case: Path, number: signal.Signals) -> None:
    """The signal of a closed terminal and that of a batch system stop a run as SIGTERM does."""
    # The shell that runs the tests may ignore the signal; a run would inherit this.
    process = vc.start(program, case,
                       preexec_fn=lambda: signal.signal(number, signal.SIG_DFL))
    vc.wait_for_rows(process, case.with_suffix(".h5"), 3, number)
    _, message = process.communicate(timeout=PATIENCE)
    assert process.returncode == 128 + number, message
    assert number.name in message
    assert case.with_suffix(".checkpoint.h5").exists()


def test_nohup(program: str, case: Path) -> None:
    """A hang-up signal that is ignored at the start remains ignored."""
    case.write_text(vc.text(size=24, steps=30))
    process = vc.start(program, case,
                       preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    vc.wait_for_rows(process, case.with_suffix(".h5"), 3, signal.SIGHUP)
    _, message = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, message


def test_time_limit(program: str, tmp_path: Path) -> None:
    """A run stops before its limit (an option, or Slurm's) and writes a checkpoint to continue."""
    case = tmp_path / "y.nml"
    case.write_text(vc.text(size=96, steps=20000))
    result = case.with_suffix(".h5")
    start = time.monotonic()
    done = vc.run(program, case, "--time-limit", "0:03")
    assert done.returncode == 124, done.stderr
    assert time.monotonic() - start < 30.0  # the whole run would take minutes
    assert "the time limit is near: stopped after step" in done.stderr
    rows = vc.count(result)
    environment = dict(os.environ, SLURM_JOB_END_TIME=str(int(time.time()) + 5))
    done = vc.run(program, case, "--restart", env=environment)
    assert done.returncode == 124, done.stderr
    assert vc.count(result) > rows


def test_a_time_limit_of_slurm_that_is_no_number_is_noted(program: str, case: Path) -> None:
    case.write_text(vc.text(size=24))
    done = vc.run(program, case, env=dict(os.environ, SLURM_JOB_END_TIME="abc"))
    assert done.returncode == 0
    assert "SLURM_JOB_END_TIME = abc: must be a number of seconds" in done.stderr


@pytest.mark.parametrize("text", ["", "x", "1:2:3:4", "0", "-1", "1-", "1.5", ":", "99999999999"])
def test_time_limit_is_checked(program: str, case: Path, text: str) -> None:
    """A text that is not a duration is an error in the command line."""
    done = vc.run(program, case, f"--time-limit={text}")
    assert done.returncode == 2, done.stderr
    assert "--time-limit" in done.stderr


def test_stop_before_the_first_row_promises_nothing(program: str, tmp_path: Path) -> None:
    """Without a row there is no checkpoint; the message says so, and the run can start again."""
    case = tmp_path / "y.nml"
    case.write_text(vc.text(size=24))
    done = vc.run(program, case, "--time-limit", "1",
                  env=dict(os.environ, SLURM_JOB_END_TIME="1"))
    assert done.returncode == 0  # the option has priority
    case.with_suffix(".h5").unlink()
    done = vc.run(program, case, env=dict(os.environ, SLURM_JOB_END_TIME="1"))
    assert done.returncode == 124
    assert "before the first row" in done.stderr and "--restart" not in done.stderr
    assert asperity.open(case.with_suffix(".h5")).outcome == "stopped before the first row"
    assert vc.run(program, case).returncode == 0


def test_python_stops_as_the_program_does(case: Path) -> None:
    """A script that runs a case and gets SIGTERM leaves a checkpoint and ends."""
    script = f"import asperity; asperity.run({str(case)!r}, threads=1)"
    process = subprocess.Popen([os.sys.executable, "-c", script], stderr=subprocess.PIPE, text=True)
    vc.wait_for_rows(process, case.with_suffix(".h5"), 3, signal.SIGTERM)
    _, message = process.communicate(timeout=PATIENCE)
    assert process.returncode == -signal.SIGTERM, message
    assert case.with_suffix(".checkpoint.h5").exists()
    assert "stopped after step" in asperity.open(case.with_suffix(".h5")).outcome


def test_threads_of_the_environment() -> None:
    """Without a given number OMP_NUM_THREADS counts, then Slurm's, then that of processors."""
    script = "import asperity; print(asperity.set_threads(0))"

    def used(**variables: str) -> int:
        environment = {name: value for name, value in os.environ.items()
                       if name not in ("OMP_NUM_THREADS", "SLURM_CPUS_PER_TASK")}
        printed = subprocess.run([os.sys.executable, "-c", script], env=environment | variables,
                              capture_output=True, text=True, check=True)
        return int(printed.stdout)

    processors = len(os.sched_getaffinity(0))
    assert used() == processors
    assert used(OMP_NUM_THREADS="3") == 3
    assert used(OMP_NUM_THREADS="5,2") == 5
    assert used(SLURM_CPUS_PER_TASK="7") == 7
    assert used(OMP_NUM_THREADS="3", SLURM_CPUS_PER_TASK="7") == 3
    assert used(OMP_NUM_THREADS="many") == processors


FORK = """
import asperity, multiprocessing, numpy as np
asperity.set_threads(2)
height = np.random.default_rng(1).standard_normal((96, 96))

def solve(scale):
    return asperity.solve_normal(height, 1.0, 1.0, scale, pressure=0.1).contact_area

wanted = [solve(scale) for scale in (1.0, 2.0, 3.0)]
with multiprocessing.get_context("fork").Pool(2) as pool:
    found = pool.map_async(solve, (1.0, 2.0, 3.0)).get(timeout=120)
assert found == wanted == [solve(scale) for scale in (1.0, 2.0, 3.0)], (found, wanted)
print("done")
"""


def test_fork_after_a_call() -> None:
    """Forked copies of a process that has used threads can use the library."""
    done = subprocess.run([os.sys.executable, "-c", FORK], capture_output=True, text=True,
                          timeout=PATIENCE, check=False)
    assert done.stdout == "done\n", done.stderr


MEMORY = """
import asperity, numpy as np, resource
height = np.zeros((2000, 2000)); height[::2] = 1e-3
def size():
    return int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
for room in (120e6, 350e6):
    resource.setrlimit(resource.RLIMIT_AS, (size() + int(room), resource.RLIM_INFINITY))
    for call in (lambda: asperity.solve_normal(height, 1.0, 1.0, 1.0, pressure=0.1),
                 lambda: asperity.solve_adhesive(height, 1.0, 1.0, 1.0, pressure=0.1, energy=1.0,
                                                 range=1.0),
                 lambda: asperity.run(CASE)):
        try:
            call()
        except MemoryError as error:
            print(error)
        else:
            print("no error")
    resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
print("done")
"""


def test_memory_error(tmp_path: Path) -> None:
    """If there is too little memory, MemoryError is raised and the interpreter continues."""
    case = tmp_path / "y.nml"
    case.write_text(LARGE.replace("20000", "2500"))
    done = subprocess.run([os.sys.executable, "-c", MEMORY.replace("CASE", repr(str(case)))],
                          capture_output=True, text=True, timeout=PATIENCE, check=False)
    lines = done.stdout.splitlines()
    assert lines[-1:] == ["done"], done.stderr
    assert len(lines) == 7
    assert all("not enough memory" in line or "llocate" in line for line in lines[:-1]), lines


LIMITS = """
import asperity, numpy as np, resource, sys, warnings
warnings.simplefilter("ignore")
asperity.solve_normal([[0.0, 1e-3]], 1.0, 1.0, 1.0, pressure=0.1)  # loads the library
asperity.operators, asperity.run
n = 1100
height = np.zeros((n, n)); height[::2] = 1e-3
pair = np.stack([height, height])
quick = dict(tolerance=0.5)
CALLS = {
    "normal": lambda: asperity.solve_normal(height, 1.0, 1.0, 1.0, pressure=0.1, **quick),
    "free": lambda: asperity.solve_normal(height, 1.0, 1.0, 1.0, force=1e-4, boundary="free",
                                          **quick),
    "adhesive": lambda: asperity.solve_adhesive(height, 1.0, 1.0, 1.0, pressure=0.1, energy=1e-6,
                                                range=1e-3, max_iterations=2, **quick),
    "adhesive, free": lambda: asperity.solve_adhesive(
        height, 1.0, 1.0, 1.0, displacement=1e-4, energy=1e-6, range=1e-3, boundary="free",
        max_iterations=2, **quick),
    "operator": lambda: asperity.operators.tangential(n, n, 1.0, modulus=1.0,
                                                      boundary="free").apply(pair),
    "run": lambda: asperity.run(CASE, overwrite=True),
}
call = CALLS[sys.argv[1]]
before = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (before + int(float(sys.argv[2])), resource.RLIM_INFINITY))
try:
    call()
    print("done")
except asperity.NotConverged:
    print("done")
except (MemoryError, OSError) as error:
    print(type(error).__name__)
"""


@pytest.mark.parametrize("what", ["normal", "free", "adhesive", "adhesive, free", "operator",
                                  "run"])
def test_no_limit_of_memory_ends_the_interpreter(tmp_path: Path, what: str) -> None:
    """For limits from nothing to enough there is an exception, then the result."""
    case = tmp_path / "y.nml"
    case.write_text("""
&grid nx = 500, ny = 480, lx = 1 /
&surface shape = 'sine', amplitude = 1e-3, wavelength = 1 /
&material shear_modulus = 1e6, prony_g = 1e6, prony_tau = 1, thickness = 1 /
&friction law = 'coulomb', coefficient = 0.3 /
&phase pressure = 1e3 /
&phase velocity_x = 1e-3, duration = 1, steps = 1 /
&solver tolerance = 1e-2 /
""")
    outcomes = []
    for room in (1e6, 30e6, 100e6, 250e6, 300e6, 350e6, 400e6, 500e6, 650e6, 800e6, 1000e6, 1300e6):
        done = subprocess.run(
            [os.sys.executable, "-c", LIMITS.replace("CASE", repr(str(case))), what, str(room)],
            capture_output=True, text=True, timeout=PATIENCE, check=False)
        assert done.returncode == 0, (what, room, done.returncode, done.stderr[-500:])
        outcomes.append(done.stdout.strip())
        if outcomes[-1] == "done":
            break
    assert outcomes[-1] == "done", outcomes
    assert "MemoryError" in outcomes


LARGE = """
&grid nx = 20000, ny = 20000, lx = 1 /
&surface shape = 'sine', amplitude = 1e-3, wavelength = 1 /
&material shear_modulus = 1e6 /
&phase pressure = 1 /
"""


def test_out_of_memory(program: str, tmp_path: Path) -> None:
    """Whatever the limit, a run that does not fit ends with one message and status 3."""
    case = tmp_path / "y.nml"
    case.write_text(LARGE)
    done = vc.run(program, case, preexec_fn=lambda: set_address_space(2_000_000_000))
    assert done.returncode == 3, done.stderr
    assert "not enough memory: the run needs about" in done.stderr
    case.write_text(LARGE.replace("20000", "600"))
    seen = set()
    for limit in range(100, 700, 60):
        done = vc.run(program, case, "--threads", "1", "--overwrite",
                      preexec_fn=lambda limit=limit: set_address_space(limit * 1_000_000))
        assert done.returncode in (0, 3), (limit, done.returncode, done.stderr)
        assert done.returncode == 0 or "not enough memory" in done.stderr, (limit, done.stderr)
        seen.add(done.returncode)
    assert seen == {0, 3}


def set_address_space(limit: int) -> None:
    """Limit the memory of this process, as ulimit -v does."""
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def test_check_knows_the_machine(program: str, tmp_path: Path) -> None:
    """`asperity check` warns of a case that needs more memory than the machine has."""
    case = tmp_path / "y.nml"
    case.write_text(LARGE.replace("20000", "40000"))
    done = subprocess.run([program, "check", str(case)], capture_output=True, text=True, check=True)
    assert re.search(r"! warning: the run needs more memory than .*: ", done.stdout)
    done = vc.run(program, case)
    assert done.returncode == 3 and "not enough memory" in done.stderr
