"""Run random cases with too little memory: no run may crash, hang, or end without a clear message.

    python tools/memory_campaign.py [--count 100] [--seed 1] [--only SEED] [--midway]

Every trial runs a random case three times. The first run has no limit and shows how much address
space the program needs. The second one is the program with a random limit between what
`asperity check` takes and somewhat more than this need: below that, the runtime library of Fortran
has no memory for its own work. The third one is `asperity.run` in a Python process with a random
room beside what the process takes already. What must hold:

* The program ends with status 3 and one message "not enough memory", or as without a limit.
* Python raises MemoryError, or the run has the result of a run without a limit. After the error the
  same process, without the limit, runs the case to the same history, to the last bit.
* No message of the runtime library, of HDF5 or of the C++ library reaches the user.

With --midway the program also runs without a limit until a random moment, after which it can take
only a little more. This is harder than a limit from the start, because the program checks such a
limit before a run and keeps a reserve of 256 MB. FFTW and the threads end the program if they get
no memory, and so do some arrays of the size of the grid in steps with friction; these trials are
counted as "crash", with the messages printed, and are not failures.

A run that is not done within some seconds without a limit is left out. A trial that fails is
printed with its seed; `--only SEED` repeats it. The exit status is 1 if any failed. The trials are
not part of the tests.
"""

import argparse
import json
import os
import random
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from campaign import CRASHES, Wrong, call, program, random_case

SLOW = 20.0      # seconds; longer runs are left out
PATIENCE = 300.0
RESERVE = 256e6  # bytes, which the program keeps free
SPARE = 1 << 20  # bytes, as the last moment of a program is not seen

CHILD = """
import json, resource, sys, warnings
import asperity
warnings.simplefilter("ignore")
asperity.solve_normal([[0.0, 1e-3]], 1.0, 1.0, 1.0, pressure=0.1)  # loads the library
import h5py
room = int(sys.argv[1])
limits = resource.getrlimit(resource.RLIMIT_AS)

def history():
    try:
        run = asperity.run("case.nml", overwrite=True)
    except asperity.NotConverged:
        run = asperity.open("case.h5")
    return {name: run.history[name].tobytes().hex() for name in run.history if name != "seconds"}

before = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (before + room, limits[1]))
try:
    first = history()
    outcome = "done"
except Exception as error:
    first, outcome = None, type(error).__name__ + ": " + str(error)
resource.setrlimit(resource.RLIMIT_AS, limits)
again = history()
print(json.dumps([outcome, first is None or first == again, again]))
"""


def needed(words, folder):
    """Run a command: return its status, messages, most address space and time, s."""
    with subprocess.Popen(words, cwd=folder, stdout=subprocess.DEVNULL,
                          stderr=subprocess.PIPE) as process:
        status = Path(f"/proc/{process.pid}/status")
        most, end = 0, time.monotonic() + SLOW
        while process.poll() is None:
            found = re.search(r"VmPeak:\s+(\d+) kB", status.read_text())
            most = max(most, 1024 * int(found[1]) if found else 0)
            if time.monotonic() > end:
                process.kill()
            time.sleep(0.002)
        took = time.monotonic() - end + SLOW
        return process.returncode, process.stderr.read().decode(errors="replace"), most, took


def make_case(chance):
    """Return a random case of two rows, some in steady sliding or with a law by a table."""
    text = random_case(chance, rows=2, largest=400)
    if chance.random() < 0.3:
        text = re.sub(r"law = 'coulomb', coefficient = (\S+)",
                      r"law = 'table', slope_effect = F, table_pressure = 0, 1e3,"
                      r" table_strength = 0, \g<1>e3", text)
    if chance.random() < 0.2 and "free" not in text and "&adhesion" not in text:
        load = re.search(r"&phase (pressure = [^,]+),", text)
        phase = f"&phase steady = T, {load[1]}, velocity_x = 1 /"
        text = re.sub(r"&phase .*\n", "", text).rstrip() + f"\n{phase}\n"
    return text


def try_program(chance, folder, idle, free):
    """Run the program under a limit, and say how it ended."""
    status, _, need, _ = free
    limit = int(chance.uniform(idle, RESERVE + 2.0 * need))
    done = call("run", "case.nml", "--quiet", "--overwrite", cwd=folder,
                statuses=(3, status), stop_after=PATIENCE,
                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)))
    if done.returncode == 3 and done.message.count("not enough memory") != 1:
        raise Wrong(f"limit {limit}: status 3: {done.message[-300:]}")
    return "status 3" if done.returncode == 3 else "as without a limit"


def try_midway(chance, folder, idle, free):
    """Run the program, at a random moment forbid it to take much more, and say how it ended."""
    moment, room = chance.random() * free[3], int(10 ** chance.uniform(4, 7))
    with subprocess.Popen([program(), "run", "case.nml", "--quiet", "--overwrite"], cwd=folder,
                          stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
        time.sleep(moment)
        try:
            status = Path(f"/proc/{process.pid}/status").read_text()
            found = re.search(r"VmSize:\s+(\d+) kB", status)
            limit = 1024 * int(found[1]) + room if found else resource.RLIM_INFINITY
            resource.prlimit(process.pid, resource.RLIMIT_AS, (limit, limit))
        except ProcessLookupError:  # it is done
            pass
        message = process.communicate(timeout=PATIENCE)[1].decode(errors="replace")
    if process.returncode == 3 and "memory" in message:
        return "status 3"
    if process.returncode == free[0]:
        return "as without a limit"
    print(f"midway, status {process.returncode} after {moment:.3f} s: {message[-400:]}")
    return "crash"


def try_python(chance, folder, idle, free):
    """Run the case in a Python process under a limit, and say how it ended."""
    room = int(chance.uniform(0.0, RESERVE + 2.0 * max(free[2] - idle, 1e7)))
    done = subprocess.run([sys.executable, "-c", CHILD, str(room)], cwd=folder, text=True,
                          capture_output=True, timeout=PATIENCE, check=False)
    if done.returncode or any(word in done.stderr for word in CRASHES):
        raise Wrong(f"room {room}: Python ends with {done.returncode}: {done.stderr[-300:]}")
    outcome, equal, _ = json.loads(done.stdout.splitlines()[-1])
    if outcome != "done" and not outcome.startswith("MemoryError"):
        raise Wrong(f"room {room}: {outcome}")
    if not equal:
        raise Wrong(f"room {room}: the run without a limit has another history")
    return "MemoryError" if outcome != "done" else "as without a limit"


def main():
    """Try random cases; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1, help="of the first trial")
    parser.add_argument("--midway", action="store_true",
                        help="also limit the memory of a run at a random moment")
    parser.add_argument("--only", type=int, help="seed of the only trial")
    options = parser.parse_args()
    seeds = range(options.seed, options.seed + options.count)
    trials = {"program": try_program, "Python": try_python}
    if options.midway:
        trials["midway"] = try_midway
    counts, failed = Counter(), 0
    for seed in seeds if options.only is None else [options.only]:
        chance = random.Random(f"memory {seed}")
        with tempfile.TemporaryDirectory(prefix="memory-") as name:
            folder = Path(name)
            (folder / "case.nml").write_text(make_case(chance))
            idle = needed([program(), "check", "case.nml"], folder)[2] + SPARE
            free = needed([program(), "run", "case.nml", "--quiet"], folder)
            if free[0] not in (0, 4):
                counts["left out", "slow" if free[0] < 0 else f"status {free[0]}"] += 1
                continue
            for kind, trial in trials.items():
                try:
                    counts[kind, trial(chance, folder, idle, free)] += 1
                except (Wrong, subprocess.TimeoutExpired) as error:
                    failed += 1
                    counts[kind, "WRONG"] += 1
                    print(f"WRONG {kind} --only {seed}: {error}", flush=True)
    for (kind, outcome), count in sorted(counts.items()):
        print(f"{kind:9} {count:5}  {outcome}")
    return 1 if failed else 0


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    sys.exit(main())
