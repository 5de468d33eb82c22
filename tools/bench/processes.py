#!/usr/bin/env python3
"""Compare processes with threads on one machine, and count what processes send to each other.

    tools/build_mpi.sh
    python tools/bench/processes.py [--cells 2048 4096 8192] [--processes 2] [--repeats 3]

An elastic contact of a rough road is solved by N processes of one thread each and by one process of
N threads, in turn. The table holds the least seconds of the solver, their ratio (above 1: the
processes are faster), and the bytes that the processes sent to each other for each transform and
cell. The next column is what the exchange of columns alone sends: a transform of real values has
half as many modes as cells, of 16 bytes each, of which 1/N stays where it is. The last columns are
the peak memory of the threads, the largest of a process, and the ratio of the latter to 1/N of the
former. `--iterations` ends every solve after a number of iterations, to measure the memory only.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py

ROOT = Path(__file__).resolve().parent.parent.parent
CASE = """
&grid nx = {n}, ny = {n}, lx = 1e-3 /
&surface shape = 'self_affine', hurst = 0.8, rms_slope = 0.2, wavelength_long = 2.5e-4,
   wavelength_short = {short} /
&material shear_modulus = 1e6 /
&phase pressure = 4e3 /
&solver max_iterations = {most} /
&output snapshot_fields = 'contact', compression = 0 /
"""
# Runs a program, and writes its peak memory in kB to a file of the folder of the case.
PEAK = """
import os, resource, subprocess, sys
status = subprocess.run(sys.argv[2:]).returncode
peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
open(f"{sys.argv[1]}/{os.getpid()}.peak", "w").write(str(peak))
sys.exit(status)
"""
MPIRUN = ["mpirun", "--allow-run-as-root", "--oversubscribe", "-q"]


def solve(folder: Path, launcher: list[str], program: str, threads: int) -> dict[str, float]:
    """Run the case once and return the numbers of its result."""
    result = folder / "case.h5"
    command = [*launcher, sys.executable, "-c", PEAK, str(folder)]
    command += [str(ROOT / ".venv/bin" / program), "run", str(folder / "case.nml")]
    command += ["--output", str(result), "--threads", str(threads), "--quiet", "--overwrite"]
    done = subprocess.run(command, stderr=subprocess.DEVNULL, check=False)
    if done.returncode not in (0, 4):
        raise SystemExit(f"status {done.returncode}: {' '.join(command)}")
    peaks = list(folder.glob("*.peak"))
    memory = max(int(path.read_text()) for path in peaks) / 1e3
    for path in peaks:
        path.unlink()
    with h5py.File(result) as file:
        return {
            "seconds": float(file["history/seconds"][0]),
            "ffts": float(file["history/ffts"][0]),
            "bytes": float(file.attrs["exchanged_bytes"]),
            "memory": memory,
        }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cells", type=int, nargs="+", default=[2048, 4096, 8192])
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--iterations", type=int, default=1000, help="of the solver, at most")
    options = parser.parse_args()
    n_processes = options.processes
    launcher = [*MPIRUN, "-n", str(n_processes)]
    columns = ("cells", "threads, s", "processes, s", "ratio", "bytes", "columns alone")
    columns += ("threads, MB", "a process, MB", "over its share")
    print("| " + " | ".join(columns) + " |")
    print("|" + " ---: |" * len(columns))
    for cells in options.cells:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            text = CASE.format(n=cells, short=16e-3 / cells, most=options.iterations)
            (folder / "case.nml").write_text(text)
            threaded, shared = [], []
            for _ in range(options.repeats):
                threaded.append(solve(folder, [], "asperity", n_processes))
                shared.append(solve(folder, launcher, "asperity-mpi", 1))
        one = min(run["seconds"] for run in threaded)
        other = min(run["seconds"] for run in shared)
        volume = shared[0]["bytes"] / shared[0]["ffts"] / cells**2
        alone = 8.0 * (1.0 - 1.0 / n_processes)
        figures = f"{one:.2f} | {other:.2f} | {one / other:.2f} | {volume:.1f} | {alone:.1f}"
        whole, largest = threaded[0]["memory"], max(run["memory"] for run in shared)
        figures += f" | {whole:.0f} | {largest:.0f} | {largest * n_processes / whole:.2f}"
        print(f"| {cells}² | {figures} |", flush=True)


if __name__ == "__main__":
    main()
