#!/usr/bin/env python3
"""Compare parallel HDF5 with fields that pass through one process, and kill both while they write.

    apt-get install python3-h5py-mpi python3-mpi4py
    /usr/bin/python3 tools/bench/parallel_hdf5.py [--cells 4096] [--processes 2] [--kills 20]

N processes hold the rows of a field of doubles, half of it smooth and half of it zero, like the
pressure of a contact. They write it to one file in four ways: with parallel HDF5, without and with
compression, and by sending slabs of 1 MB to the first process, which writes them with the serial
library of the same installation, without and with compression. The table holds the least seconds
of some repetitions, with the bytes on the disk (fsync) included, and the size of the file.

Then a file with many small fields, each followed by a flush as after a row of a run, is written
again and again, and one process is killed at a random moment. The last two columns are the number
of files that open afterwards and whose complete fields can be read, out of those killed.

Asperity streams slabs to its first process. The program is not used here: this measures the choice
between both ways, and its page of benchmarks holds the result.
"""

from __future__ import annotations

import argparse
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

WAYS = ("parallel", "parallel, compressed", "one process", "one process, compressed")
SLAB_BYTES = 2**20
KILLED_CELLS = 128
MPIRUN = ["mpirun", "--allow-run-as-root", "--oversubscribe", "-q"]


def dataset(file, name: str, cells: int, compressed: bool):
    """Create a square field, in chunks of about 1 MB where it is compressed."""
    options = {}
    if compressed:
        rows = max(1, min(SLAB_BYTES // (8 * cells), cells // 8))
        options = {"chunks": (rows, cells), "compression": "gzip", "compression_opts": 1}
    return file.create_dataset(name, (cells, cells), "f8", **options)


def write_together(file, name: str, own, first: int, cells: int, compressed: bool) -> None:
    """Write the rows of all processes by parallel HDF5. Collective, which compression demands."""
    field = dataset(file, name, cells, compressed)
    with field.collective:
        field[first : first + len(own)] = own


def write_streamed(file, name: str, own, cells: int, compressed: bool, world) -> None:
    """Send slabs of rows to the first process, which writes them one after the other."""
    import numpy as np

    rows = max(1, SLAB_BYTES // (8 * cells))
    if world.rank > 0:
        for at in range(0, len(own), rows):
            world.Send(np.ascontiguousarray(own[at : at + rows]), dest=0)
        return
    field = dataset(file, name, cells, compressed)
    bounds = [cells * rank // world.size for rank in range(world.size + 1)]
    for rank in range(world.size):
        for at in range(bounds[rank], bounds[rank + 1], rows):
            end = min(at + rows, bounds[rank + 1])
            if rank == 0:
                slab = own[at:end]
            else:
                slab = np.empty((end - at, cells))
                world.Recv(slab, source=rank)
            field[at:end] = slab


def open_file(way: str, path: str, world):
    """Open a new file: on all processes for parallel HDF5, else on the first one only."""
    import h5py

    if way.startswith("parallel"):
        return h5py.File(path, "w", driver="mpio", comm=world)
    return h5py.File(path, "w") if world.rank == 0 else None


def own_rows(cells: int, world):
    """Return the rows of this process: smooth values where the road is high, zero elsewhere."""
    import numpy as np

    first, last = (cells * rank // world.size for rank in (world.rank, world.rank + 1))
    x = np.arange(cells) * (16 * np.pi / cells)
    y = np.arange(first, last) * (16 * np.pi / cells)
    return first, np.maximum(np.cos(x)[None, :] + np.cos(y)[:, None], 0.0)


def write(file, way: str, name: str, own, first: int, cells: int, world) -> None:
    """Write one field."""
    compressed = way.endswith("compressed")
    if way.startswith("parallel"):
        write_together(file, name, own, first, cells, compressed)
    else:
        write_streamed(file, name, own, cells, compressed, world)


def worker(way: str, path: str, cells: int, fields: int) -> None:
    """Write fields, as one of several processes; print the seconds per field."""
    from mpi4py import MPI

    world = MPI.COMM_WORLD
    first, own = own_rows(cells, world)
    file = open_file(way, path, world)
    if world.rank == world.size - 1:
        Path(path + ".pid").write_text(str(os.getpid()))
    world.Barrier()
    start = time.perf_counter()
    for k in range(fields):
        write(file, way, f"field_{k:05d}", own, first, cells, world)
        if file is not None:
            file.flush()
    if file is not None:
        file.close()
    if world.rank == 0:
        handle = os.open(path, os.O_RDWR)
        os.fsync(handle)
        os.close(handle)
    world.Barrier()
    if world.rank == 0:
        print((time.perf_counter() - start) / fields)


def launch(way: str, path: Path, cells: int, fields: int, processes: int) -> subprocess.Popen:
    """Start the processes that write."""
    task = [sys.executable, __file__, "--worker", way, str(path), str(cells), str(fields)]
    return subprocess.Popen(
        [*MPIRUN, "-n", str(processes), *task], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )


def readable(path: Path) -> bool:
    """Say whether a file opens and all fields but the last one can be read, in a new process."""
    code = (
        "import sys, h5py\n"
        "with h5py.File(sys.argv[1], 'r') as file:\n"
        "    for name in sorted(file)[:-1]: file[name][...].sum()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(path)], stderr=subprocess.DEVNULL, timeout=60, check=False
    )
    return done.returncode == 0


def killed(way: str, folder: Path, processes: int, pick: random.Random) -> bool:
    """Kill the last process at a random moment of its writing; say whether the file is readable."""
    path = folder / "killed.h5"
    pid_file = Path(str(path) + ".pid")
    for old in (path, pid_file):
        old.unlink(missing_ok=True)
    running = launch(way, path, KILLED_CELLS, 100_000, processes)
    while not (pid_file.exists() and pid_file.read_text()):
        time.sleep(0.01)
    time.sleep(pick.uniform(0.2, 1.5))
    os.kill(int(pid_file.read_text()), 9)
    running.communicate(timeout=60)
    return readable(path)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cells", type=int, default=4096)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--worker", nargs=4, metavar=("WAY", "FILE", "CELLS", "FIELDS"))
    options = parser.parse_args()
    if options.worker:
        way, path, cells, fields = options.worker
        worker(way, path, int(cells), int(fields))
        return
    pick = random.Random(options.seed)
    print("| way | seconds per field | MB | killed | readable |")
    print("| --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "field.h5"
        for way in WAYS:
            seconds = []
            for _ in range(options.repeats):
                path.unlink(missing_ok=True)
                out = launch(way, path, options.cells, 2, options.processes).communicate()[0]
                seconds.append(float(out))
            size = path.stat().st_size / 2 / 1e6
            good = sum(
                killed(way, path.parent, options.processes, pick) for _ in range(options.kills)
            )
            row = f"| {way} | {min(seconds):.2f} | {size:.1f} | {options.kills} | {good} |"
            print(row, flush=True)


if __name__ == "__main__":
    main()
