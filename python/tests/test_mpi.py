"""One run on several processes: the same numbers, files and exit statuses as on one."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from conftest import PATIENCE, ROOT

PROGRAM = Path(os.environ.get("ASPERITY_MPI_PROGRAM", ROOT / ".venv/bin/asperity-mpi"))

pytestmark = pytest.mark.skipif(
    not (PROGRAM.is_file() and shutil.which("mpirun")),
    reason="the program with MPI is not built: run tools/build_mpi.sh",
)

# 37 rows do not divide, and few strips of rows leave some of five processes without any.
ROUGH = """&grid nx = 40, ny = 37, lx = 1e-3, boundary = '{boundary}' /
&surface shape = 'self_affine', hurst = 0.8, wavelength_long = 0.5e-3,
   wavelength_short = 0.1e-3, rms_slope = 0.2, seed = 3 /
"""
VISCOELASTIC = "&material shear_modulus = 1e6, prony_g = 2e6, 1e6, prony_tau = 1e-3, 1e-2 /\n"
OUTPUT = "&output snapshot_every = 2 /\n"
SLIDING = (
    "&phase pressure = 3e4, steps = 2, duration = 1e-2 /\n"
    "&phase velocity_x = 1e-2, velocity_y = 3e-3, steps = 3, duration = 1e-2 /\n"
)
CASES = {
    "elastic": ROUGH.format(boundary="periodic")
    + "&material shear_modulus = 1e6 /\n"
    + "&phase pressure = 2e4 /\n&phase pressure = 1e5 /\n",
    "free": "&grid nx = 33, ny = 45, lx = 1e-3, boundary = 'free' /\n"
    "&surface shape = 'sphere', radius = 10e-3 /\n&material shear_modulus = 1e6 /\n"
    "&phase force = 0.01 /\n&phase displacement = 5e-6 /\n",
    "few rows": "&grid nx = 64, ny = 3, lx = 1e-3, ly = 0.05e-3 /\n"
    "&surface shape = 'cylinder', radius = 10e-3 /\n"
    + VISCOELASTIC
    + "&phase pressure = 1e4, steps = 3, duration = 1e-2 /\n",
    "sliding": ROUGH.format(boundary="periodic") + VISCOELASTIC + SLIDING,
    "adhesion": "&grid nx = 40, ny = 37, lx = 0.1e-3, boundary = 'free' /\n"
    "&surface shape = 'paraboloid', radius = 1e-3 /\n&material shear_modulus = 1e6 /\n"
    "&adhesion potential = 'exponential', energy = 0.05, range = 0.5e-6 /\n"
    "&phase displacement = 0.5e-6 /\n&phase displacement = -0.2e-6 /\n",
    "friction": ROUGH.format(boundary="periodic")
    + VISCOELASTIC.replace(" /", ", thickness = 2e-3, density = 1000. /")
    + "&friction law = 'coulomb', coefficient = 0.3 /\n"
    + SLIDING,
    "steady": ROUGH.format(boundary="periodic")
    + VISCOELASTIC.replace(" /", ", thickness = 2e-3 /")
    + "&phase steady = .true., pressure = 3e4, velocity_x = 1e-2 /\n",
}


def write(folder: Path, text: str, name: str = "case.nml") -> Path:
    """Write an input and return its path."""
    path = folder / name
    path.write_text(text)
    return path


def words(processes: int, case: Path, *more: str) -> list[str]:
    """Return the command line of a run on some processes."""
    return ["mpirun", "--allow-run-as-root", "--oversubscribe", "--bind-to", "none", "-q",
            "-n", str(processes), str(PROGRAM), "run", str(case), "--quiet", *more]


def run(processes: int, case: Path, *more: str) -> subprocess.CompletedProcess:
    """Run a case on some processes, with one thread each unless `more` says otherwise."""
    threads = [] if "--threads" in more else ["--threads", "1"]
    return subprocess.run(words(processes, case, *threads, *more), capture_output=True, text=True,
                          timeout=PATIENCE, check=False)


def contents(path: Path) -> dict[str, bytes]:
    """Return all values of a result but the wall times."""
    values = {}
    with h5py.File(path) as file:
        file.visititems(lambda name, item: values.update({name: item[()].tobytes()})
                        if isinstance(item, h5py.Dataset) else None)
    for name in ("history/seconds", "history/checksum"):
        values.pop(name, None)
    return values


def assert_same(path: Path, reference: Path) -> None:
    """All values agree in every bit."""
    found, expected = contents(path), contents(reference)
    assert found.keys() == expected.keys()
    assert not [name for name in expected if found[name] != expected[name]]


@pytest.mark.parametrize("name", CASES)
def test_results_do_not_depend_on_the_number_of_processes(tmp_path: Path, name: str) -> None:
    case = write(tmp_path, CASES[name] + OUTPUT)
    one = tmp_path / "one.h5"
    done = run(1, case, "--output", str(one))
    assert done.returncode == 0, done.stderr
    for processes, threads in ((2, 2), (3, 1), (5, 1)):
        result = tmp_path / f"{processes}.h5"
        done = run(processes, case, "--output", str(result), "--threads", str(threads))
        assert done.returncode == 0, done.stderr
        assert_same(result, one)
    assert sorted(path.suffix for path in tmp_path.iterdir()) == sorted(
        [".nml", *4 * [".h5"], *4 * [".xdmf"]]
    )


def test_version() -> None:
    done = subprocess.run([PROGRAM, "--version"], capture_output=True, text=True, check=True)
    line = done.stdout.splitlines()[4]
    assert line.startswith("MPI: ")
    assert line != "MPI: none"


def test_other_commands_act_once(tmp_path: Path) -> None:
    case = write(tmp_path, CASES["elastic"])
    command = ["mpirun", "--allow-run-as-root", "--oversubscribe", "-q", "-n", "3", str(PROGRAM)]
    done = subprocess.run([*command, "check", str(case)], capture_output=True, text=True,
                          timeout=PATIENCE, check=False)
    assert done.returncode == 0
    assert done.stdout.count("&grid") == 1
    done = subprocess.run([*command, "info", "nothing.h5"], capture_output=True, text=True,
                          timeout=PATIENCE, check=False)
    assert done.returncode == 3
    assert done.stderr.count("nothing.h5") == 1


def test_errors_end_all_processes_with_one_message(tmp_path: Path) -> None:
    wrong = write(tmp_path, CASES["elastic"].replace("nx = 40", "nx = -40"), "wrong.nml")
    done = run(3, wrong)
    assert done.returncode == 2
    assert done.stderr.count("nx = -40") == 1
    done = run(3, tmp_path / "missing.nml")
    assert done.returncode == 3
    assert done.stderr.count("there is no such file") == 1
    case = write(tmp_path, CASES["elastic"])
    done = run(3, case, "--output", str(tmp_path / "nowhere" / "x.h5"))
    assert done.returncode == 3
    assert done.stderr.count("there is no folder") == 1
    hard = write(tmp_path, CASES["elastic"] + "&solver max_iterations = 2 /\n", "hard.nml")
    done = run(3, hard)
    assert done.returncode == 4
    assert done.stderr.count("did not converge") == 1
    with h5py.File(tmp_path / "hard.h5") as file:
        assert len(file["history/step"]) == 1
        assert "did not converge" in file.attrs["outcome"]


LONG = ROUGH.format(boundary="periodic") + VISCOELASTIC + (
    "&phase pressure = 3e4, steps = {steps}, duration = 1e-1 /\n"
    "&output checkpoint_every = 5, compression = 0 /\n"
)


def start(processes: int, case: Path, rows: int) -> tuple[subprocess.Popen, Path]:
    """Start a run and wait until it has some rows."""
    result = case.with_suffix(".h5")
    process = subprocess.Popen(words(processes, case, "--threads", "1"), stderr=subprocess.PIPE,
                               stdout=subprocess.DEVNULL, text=True)
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end and process.poll() is None:
        try:
            with h5py.File(result, locking=False) as file:
                if file["history/seconds"].shape[0] > rows:
                    return process, result
        except (OSError, KeyError):
            pass
        time.sleep(0.02)
    process.kill()
    pytest.fail("the run did not get as far as that")


def children(process: subprocess.Popen) -> list[int]:
    """Return the processes that mpirun has started."""
    done = subprocess.run(["ps", "-o", "pid=,args=", "--ppid", str(process.pid)],
                          capture_output=True, text=True, check=False)
    return [int(line.split()[0]) for line in done.stdout.splitlines() if str(PROGRAM) in line]


def test_a_stopped_run_goes_on_with_another_number_of_processes(tmp_path: Path) -> None:
    case = write(tmp_path, LONG.format(steps=120))
    process, result = start(4, case, 3)
    process.send_signal(signal.SIGXCPU)  # mpirun hands this one on
    _, message = process.communicate(timeout=PATIENCE)
    assert process.returncode == 128 + signal.SIGXCPU, message
    assert message.count("stopped by SIGXCPU after step") == 1
    done = run(3, case, "--restart")
    assert done.returncode == 0, done.stderr
    whole = write(tmp_path, case.read_text(), "whole.nml")
    assert run(2, whole).returncode == 0
    assert_same(result, whole.with_suffix(".h5"))


def test_the_time_limit_stops_all(tmp_path: Path) -> None:
    case = write(tmp_path, LONG.format(steps=20000))
    done = run(2, case, "--time-limit", "0:0:2")
    assert done.returncode == 124, done.stderr
    assert done.stderr.count("the time limit is near") == 1
    assert case.with_suffix(".checkpoint.h5").exists()


def test_sigterm_to_mpirun_leaves_a_checkpoint(tmp_path: Path) -> None:
    case = write(tmp_path, LONG.format(steps=20000))
    process, result = start(2, case, 3)
    process.terminate()
    _, message = process.communicate(timeout=PATIENCE)
    assert process.returncode != 0  # Open MPI's own status is 1
    assert "stopped by SIGTERM after step" in message
    assert result.with_suffix(".checkpoint.h5").exists()


def test_sigterm_to_one_process_stops_all(tmp_path: Path) -> None:
    case = write(tmp_path, LONG.format(steps=20000))
    process, result = start(3, case, 3)
    pids = children(process)
    if not pids:
        process.kill()
        pytest.skip("the processes of mpirun cannot be found")
    os.kill(pids[-1], signal.SIGTERM)
    _, message = process.communicate(timeout=PATIENCE)
    assert process.returncode == 143, message
    assert message.count("stopped by SIGTERM after step") == 1
    assert result.with_suffix(".checkpoint.h5").exists()


def test_a_process_that_dies_takes_the_others_with_it(tmp_path: Path) -> None:
    case = write(tmp_path, LONG.format(steps=20000))
    process, result = start(3, case, 8)
    pids = children(process)
    if not pids:
        process.kill()
        pytest.skip("the processes of mpirun cannot be found")
    os.kill(pids[-1], signal.SIGKILL)
    process.communicate(timeout=60)
    assert process.returncode == 137
    with h5py.File(result) as file:
        assert file.attrs["finished"] == 0
        assert np.all(np.isfinite(file["history/pressure"][:]))


def test_the_program_without_mpi_is_refused_under_mpirun(tmp_path: Path, program: str) -> None:
    case = write(tmp_path, CASES["elastic"])
    command = [program if word == str(PROGRAM) else word for word in words(2, case)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 2
    assert "was built without MPI" in done.stderr
    assert not list(tmp_path.glob("*.h5"))
