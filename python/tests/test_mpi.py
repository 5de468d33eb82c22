"""A run on several processes has the numbers, files and exit statuses of a run on one."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
import viscoelastic_case as vc
from conftest import PATIENCE, ROOT
from slurm import HAS_SLURM, Slurm

from asperity import surface, theory
from asperity.material import Prony

PROGRAM = Path(os.environ.get("ASPERITY_MPI_PROGRAM", ROOT / ".venv/bin/asperity-mpi"))

pytestmark = pytest.mark.skipif(
    not (PROGRAM.is_file() and shutil.which("mpirun")),
    reason="the program with MPI is not built: run tools/build_mpi.sh",
)

# 37 rows cannot be divided evenly, and a few rows of strips leave some processes without any.
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
    # The grid is large enough for the windows of the spots that are far from equilibrium.
    "adhesion in spots": "&grid nx = 256, ny = 210, lx = 384e-9, ly = 315e-9 /\n"
    "&surface shape = 'self_affine', hurst = 0.8, wavelength_long = 96e-9,\n"
    "   wavelength_short = 20e-9, rms_slope = 1., seed = 1 /\n"
    "&material shear_modulus = 6.25e6 /\n"
    "&adhesion potential = 'exponential', energy = 0.05, range = 2.071e-9 /\n"
    "&phase pressure = 1.25e6 /\n",
    "friction": ROUGH.format(boundary="periodic")
    + VISCOELASTIC.replace(" /", ", thickness = 2e-3, density = 1000. /")
    + "&friction law = 'coulomb', coefficient = 0.3 /\n"
    + SLIDING,
    "friction by a table": ROUGH.format(boundary="periodic")
    + VISCOELASTIC
    + "&friction law = 'table', slope_effect = .false.,\n"
    "   table_pressure = 0., 1e5, 4e5, table_strength = 0., 4e4, 7e4 /\n"
    + SLIDING,
    "steady": ROUGH.format(boundary="periodic")
    + VISCOELASTIC.replace(" /", ", thickness = 2e-3 /")
    + "&phase steady = .true., pressure = 3e4, velocity_x = 1e-2 /\n",
    "steady friction": ROUGH.format(boundary="periodic")
    + VISCOELASTIC.replace(" /", ", thickness = 2e-3 /")
    + "&friction law = 'coulomb', coefficient = 0.4 /\n"
    "&phase steady = .true., pressure = 3e4, velocity_x = 1e-2, velocity_y = 3e-3 /\n"
    "&phase steady = .true., velocity_x = 3e-2, velocity_y = 9e-3 /\n",
    # Cells at the edge are partly sheared, so that Newton's method solves for all cells at once.
    "steady constant shear": ROUGH.format(boundary="periodic")
    + VISCOELASTIC
    + "&friction law = 'constant_shear', shear_strength = 2e5 /\n"
    "&phase steady = .true., pressure = 1e5, velocity_x = 1e-2, velocity_y = 3e-3 /\n",
}


def write(folder: Path, text: str, name: str = "case.nml") -> Path:
    """Write an input and return its path."""
    path = folder / name
    path.write_text(text)
    return path


def words(processes: int, case: Path, *more: str) -> list[str]:
    """Return the command line of a run on a number of processes."""
    return ["mpirun", "--allow-run-as-root", "--oversubscribe", "--bind-to", "none", "-q",
            "-n", str(processes), str(PROGRAM), "run", str(case), "--quiet", *more]


def run(processes: int, case: Path, *more: str) -> subprocess.CompletedProcess:
    """Run a case on a number of processes, with one thread each unless `more` says otherwise."""
    threads = [] if "--threads" in more else ["--threads", "1"]
    return subprocess.run(words(processes, case, *threads, *more), capture_output=True, text=True,
                          timeout=PATIENCE, check=False)


def contents(path: Path) -> dict[str, bytes]:
    """Return all values of a result except the wall times."""
    values = {}
    with h5py.File(path) as file:
        file.visititems(lambda name, item: values.update({name: item[()].tobytes()})
                        if isinstance(item, h5py.Dataset) else None)
    for name in ("history/seconds", "history/checksum"):
        values.pop(name, None)
    return values


def assert_same(path: Path, reference: Path) -> None:
    """Check that all values agree in every bit."""
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


def test_large_grids_share_the_coarse_level(tmp_path: Path) -> None:
    """From 16 384 blocks on, each process holds a part of the preconditioner's coarse level."""
    case = write(tmp_path, CASES["elastic"].replace("nx = 40, ny = 37", "nx = 1100, ny = 957")
                 + "&solver tolerance = 1e-4 /\n&output snapshot_fields = 'pressure' /\n")
    sent = []
    for processes in (1, 3):
        result = tmp_path / f"{processes}.h5"
        done = run(processes, case, "--output", str(result))
        assert done.returncode == 0, done.stderr
        with h5py.File(result) as file:
            sent.append(file.attrs["exchanged_bytes"])
    assert_same(tmp_path / "3.h5", tmp_path / "1.h5")
    assert sent[0] == 0.0 < sent[1]


def wave_along_y(folder: Path, rows: int, amplitude: float) -> str:
    """Write a height map whose wave crosses the rows, and return the namelists that use it."""
    height = amplitude * np.cos(2 * np.pi * np.arange(rows) / rows)
    length = 1e-3
    surface.save(folder / "wave.h5", np.repeat(height[:, None], 8, axis=1), 8 * length / rows,
                 length)
    return (f"&grid nx = 8, ny = {rows}, lx = {8 * length / rows}, ly = {length} /\n"
            "&surface shape = 'file', file = 'wave.h5' /\n")


def test_westergaard_on_three_processes(tmp_path: Path) -> None:
    rows, amplitude, area = 256, 1e-6, 0.4
    full = np.pi * 4e6 * amplitude / 1e-3
    exact = theory.westergaard(amplitude, 1e-3, 4e6, full * np.sin(np.pi * area / 2) ** 2)
    case = write(tmp_path, wave_along_y(tmp_path, rows, amplitude)
                 + "&material shear_modulus = 1e6 /\n"
                 + f"&phase pressure = {exact.mean_pressure} /\n&solver tolerance = 1e-8 /\n")
    done = run(3, case)
    assert done.returncode == 0, done.stderr
    with h5py.File(case.with_suffix(".h5")) as file:
        assert file["history/contact_area"][-1] == pytest.approx(area, abs=2 / rows)
        found = file["snapshots"][max(file["snapshots"])]["pressure"][:]
    y = np.arange(rows) * 1e-3 / rows
    assert np.all(np.ptp(found, axis=1) <= 1e-6 * found.max())
    assert np.max(np.abs(found[:, 0] - exact.pressure(y))) < 0.02 * found.max()
    inside = exact.pressure(y) > 0.3 * found.max()
    np.testing.assert_allclose(found[inside, 0], exact.pressure(y)[inside], rtol=5e-3)


def test_a_sliding_viscoelastic_wave_on_three_processes(tmp_path: Path) -> None:
    """A wave in full contact moves from rest, one cell per step, over the rows of all processes."""
    rows, steps, speed, amplitude = 128, 64, 0.05, 1e-6
    rubber = Prony(1e6, [2e6, 4e6], [1e-3, 1e-2])
    duration = steps * 1e-3 / rows / speed
    exact = theory.full_contact_waves(amplitude, (0.0, 2e3 * np.pi), (0.0, speed), rubber,
                                      times=duration)
    pressure = 1.2 * float(exact.full_pressure_bound.max())
    case = write(tmp_path, wave_along_y(tmp_path, rows, amplitude)
                 + "&material shear_modulus = 1e6, prony_g = 2e6, 4e6, prony_tau = 1e-3, 1e-2 /\n"
                 + f"&phase pressure = {pressure}, relaxed = .true. /\n"
                 + f"&phase velocity_y = {speed}, steps = {steps}, duration = {duration} /\n"
                 + "&solver tolerance = 1e-8 /\n")
    done = run(3, case)
    assert done.returncode == 0, done.stderr
    with h5py.File(case.with_suffix(".h5")) as file:
        found = file["snapshots"][max(file["snapshots"])]["pressure"][:, 0]
        friction = file["history/friction_viscous"][-1] * file["history/pressure"][-1]
        assert file["history/contact_area"][-1] == 1.0
    y = np.arange(rows) * 1e-3 / rows
    wave = exact.pressure(np.zeros(rows), y)
    assert np.max(np.abs(found - pressure - wave)) < 1e-3 * np.ptp(wave)
    assert friction == pytest.approx(float(exact.friction_stress[1]), rel=2e-3)


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
    assert re.search(r"! memory: about \S+ \wB on this machine, \S+ \wB for each of 3 processes",
                     done.stdout)
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


def test_too_little_memory_for_one_process_ends_all(tmp_path: Path) -> None:
    """One process has a limit on its address space, which it notices before the run begins."""
    limited = write(tmp_path, "#!/bin/sh\n[ \"$OMPI_COMM_WORLD_RANK\" = 1 ] && ulimit -v 400000\n"
                    f"exec {PROGRAM} \"$@\"\n", "limited.sh")
    limited.chmod(0o700)
    case = write(tmp_path, CASES["elastic"].replace("nx = 40, ny = 37", "nx = 1024, ny = 1024"))
    command = [str(limited) if word == str(PROGRAM) else word for word in words(3, case)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 3, done.stderr
    assert done.stderr.count("not enough memory: the run needs about") == 1
    assert "limit on the address space" in done.stderr


LONG = ROUGH.format(boundary="periodic") + VISCOELASTIC + (
    "&phase pressure = 3e4, steps = {steps}, duration = 1e-1 /\n"
    "&output checkpoint_every = 5, compression = 0 /\n"
)


def start(processes: int, case: Path, rows: int) -> tuple[subprocess.Popen, Path]:
    """Start a run and wait until it has written some rows."""
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
    pytest.fail("the run ended before it had written the rows")


def children(process: subprocess.Popen) -> list[int]:
    """Return the processes that mpirun has started; the run must not have ended."""
    assert process.poll() is None, "the run has ended"
    done = subprocess.run(["ps", "-o", "pid=,args=", "--ppid", str(process.pid)],
                          capture_output=True, text=True, check=False)
    pids = [int(line.split()[0]) for line in done.stdout.splitlines() if str(PROGRAM) in line]
    if not pids:
        process.kill()
        pytest.skip("the processes of mpirun cannot be found")
    return pids


def test_a_stopped_run_continues_with_another_number_of_processes(tmp_path: Path) -> None:
    case = write(tmp_path, LONG.format(steps=120))
    process, result = start(4, case, 3)
    process.send_signal(signal.SIGXCPU)  # a signal that mpirun passes on
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


# With constant shear the passes of a pulled road may not settle, so the run takes hours.
STUCK = """&grid nx = 48, ny = 41, lx = 1e-3, ly = 0.9e-3 /
&surface shape = 'self_affine', hurst = 0.8, wavelength_long = 0.5e-3,
   wavelength_short = 0.15e-3, rms_slope = 0.5, seed = 3 /
&material shear_modulus = 0.5e6, prony_g = 1e6, prony_tau = 1e-2, thickness = 1e-3 /
&friction law = 'constant_shear', shear_strength = 3e5 /
&phase pressure = 5e4, duration = 0.01, steps = 2 /
&phase traction_x = 3e4, duration = 0.01, steps = 20 /
&solver passes = 100000000, coupling_tolerance = 1e-8 /
&output checkpoint_minutes = 0 /
"""


@pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")
def test_a_row_is_given_up_together_though_clocks_differ(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The time limit of a row passes on one process long before it passes on the others."""
    library = tmp_path / "other_clock.so"
    subprocess.run(["gcc", "-O1", "-shared", "-fPIC", "-o", library,
                    Path(__file__).with_name("other_clock.c")], check=True)
    case = write(tmp_path, STUCK)
    monkeypatch.setenv("LD_PRELOAD", str(library))
    process, result = start(3, case, 2)
    vc.wait_for_work(process, number=children(process)[-1])
    process.send_signal(signal.SIGXCPU)
    _, message = process.communicate(timeout=PATIENCE)
    assert process.returncode == 128 + signal.SIGXCPU, message
    assert message.count("after step 2, within the next one, which is lost") == 1
    with h5py.File(result) as file:
        assert len(file["history/step"]) == 3


def test_sigterm_to_mpirun_leaves_a_checkpoint(tmp_path: Path) -> None:
    case = write(tmp_path, LONG.format(steps=20000))
    process, result = start(2, case, 3)
    process.terminate()
    _, message = process.communicate(timeout=PATIENCE)
    assert process.returncode != 0  # Open MPI's own status is 1
    assert "stopped by SIGTERM after step" in message
    assert result.with_suffix(".checkpoint.h5").exists()


def test_sigterm_within_a_solve_stops_all(tmp_path: Path) -> None:
    """All processes leave a solve that would not end by itself."""
    case = write(tmp_path, """
        &grid nx = 2048, ny = 2048, lx = 1e-3 /
        &surface shape = 'self_affine', rms_slope = 0.2, hurst = 0.8, wavelength_long = 5e-4,
           wavelength_short = 5e-6 /
        &material shear_modulus = 1e6 /
        &phase pressure = 1e4 /
        &solver method = 'thesis', tolerance = 1e-13, max_iterations = 1000000000 /""")
    process = subprocess.Popen(words(2, case, "--threads", "1"), stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + PATIENCE
    while not case.with_suffix(".h5").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(2.0)
    os.kill(children(process)[-1], signal.SIGTERM)
    _, message = process.communicate(timeout=PATIENCE)
    assert process.returncode == 143, message
    assert message.count("stopped by SIGTERM before the first row") == 1


def test_sigterm_to_one_process_stops_all(tmp_path: Path) -> None:
    case = write(tmp_path, LONG.format(steps=20000))
    process, result = start(3, case, 3)
    os.kill(children(process)[-1], signal.SIGTERM)
    _, message = process.communicate(timeout=PATIENCE)
    assert process.returncode == 143, message
    assert message.count("stopped by SIGTERM after step") == 1
    assert result.with_suffix(".checkpoint.h5").exists()


def test_a_process_that_dies_ends_the_others(tmp_path: Path) -> None:
    case = write(tmp_path, LONG.format(steps=20000))
    process, result = start(3, case, 8)
    os.kill(children(process)[-1], signal.SIGKILL)
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


@pytest.mark.slow
@pytest.mark.skipif(not HAS_SLURM, reason="no Slurm that this user may start")
@pytest.mark.parametrize("launcher", ["mpirun --allow-run-as-root", "srun --mpi=pmix"])
def test_two_processes_in_a_job_of_slurm(tmp_path: Path, launcher: str) -> None:
    """The Slurm of this machine starts both processes of a job."""
    case = write(tmp_path, CASES["sliding"] + OUTPUT)
    assert run(1, case, "--output", str(tmp_path / "one.h5")).returncode == 0
    script = write(tmp_path, "#!/bin/sh\n#SBATCH --ntasks=2 --time=5 --output=job.log\n"
                   f"{launcher} {PROGRAM} run case.nml --quiet\n", "job.sh")
    with Slurm() as slurm:
        slurm.call("sbatch", f"--chdir={tmp_path}", str(script))
        slurm.drain()
    result = case.with_suffix(".h5")
    assert result.exists(), (tmp_path / "job.log").read_text()
    assert_same(result, tmp_path / "one.h5")
    with h5py.File(result) as file:
        assert file.attrs["processes"] == 2
