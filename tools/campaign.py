"""Try the program on random problems, damaged inputs and files, and killed processes.

    python tools/campaign.py --minutes 60 [--seed 1] [--keep FOLDER] [KIND ...]
    python tools/campaign.py --seed 17 --trials 1 flips

Kinds: problems, runs, inputs, flips, kills, twins, memory; without a name all of them in turn.
Every trial has its own seed, which is printed if the trial fails; `--seed N --trials 1 KIND`
repeats it. The files of a failed trial are kept, and their folder is printed. At the end a table
shows the number of trials of each kind and their outcomes, and the exit status is 1 if any failed.
The trials are not part of the tests, but the tests contain the failures that they have found.

These conditions must hold:

problems  pressures of `solve_normal` satisfy the contact conditions, with displacements by NumPy
runs      random cases end with status 0 or 4; the energy balance closes; numbers are finite
inputs    damaged inputs end with status 0, 2, 3 or 4 and a message
flips     no damaged checkpoint is continued; damaged results and maps never crash the program
kills     a run that is killed or stopped again and again gives the numbers of one that was not
twins     of several runs on one result, one continues and the others name it
memory    whatever the limit of memory, a run completes or ends with status 3 and a message; a run
          that takes longer than a minute is sent SIGTERM and ends within half a minute
"""

import argparse
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections import Counter
from pathlib import Path

import h5py
import numpy as np

import asperity

TIMES = {"seconds"}
CRASHES = ("Backtrace", "Fortran runtime", "SIGSEGV", "HDF5-DIAG", "libgomp:", "terminate called")
PATIENCE = 300.0
ANSWER = 30.0  # longest time from SIGTERM to the end of a run, s


class Wrong(Exception):  # noqa: N818 - an outcome, not an error of the script
    """A trial that violated a condition."""


def program():
    """Return the program that belongs to the package."""
    from asperity.runs.program import program as find

    return find()


def run_or_stop(command, stop_after, **options):
    """Run a command; send SIGTERM after some seconds, and wait for the end."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options)
    try:
        outputs = process.communicate(timeout=stop_after)
    except subprocess.TimeoutExpired:
        process.terminate()
        try:
            outputs = process.communicate(timeout=ANSWER)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            raise
    return subprocess.CompletedProcess(command, process.returncode, *outputs)


def call(*words, cwd, statuses=(0, 2, 3, 4), stop_after=PATIENCE, **options):
    """Run the program to its end; a crash, a hang or another status is wrong.

    A run that takes longer than `stop_after` seconds is stopped: its status 143 must be allowed.
    """
    try:
        done = run_or_stop([program(), *map(str, words)], stop_after, cwd=cwd, **options)
    except subprocess.TimeoutExpired:
        raise Wrong(f"{' '.join(map(str, words))}: does not end") from None
    done.message = done.stderr.decode(errors="replace")
    if done.returncode not in statuses:
        raise Wrong(f"{' '.join(map(str, words))}: status {done.returncode}: {done.message[-300:]}")
    if any(word in done.message for word in CRASHES):
        raise Wrong(f"{' '.join(map(str, words))}: {done.message[-300:]}")
    if done.returncode and not done.message.strip():
        raise Wrong(f"{' '.join(map(str, words))}: status {done.returncode} without a message")
    return done


def contents(path):
    """Return the history and all fields of a result."""
    with h5py.File(path, "r") as file:
        found = {f"history/{name}": file["history"][name][:] for name in file["history"]
                 if name not in TIMES}
        for step, group in file["snapshots"].items():
            found |= {f"{step}/{name}": group[name][:] for name in group}
        found["finished"] = np.array(file.attrs["finished"])
    return found


def same(path, reference):
    """Raise Wrong if two results differ in any bit."""
    found, wanted = contents(path), contents(reference)
    if found.keys() != wanted.keys():
        raise Wrong(f"{path.name} holds other things than a run without a stop")
    for name, values in wanted.items():
        if not np.array_equal(found[name], values):
            raise Wrong(f"{path.name}: {name} differs from that of a run without a stop")


# --- cases -------------------------------------------------------------------------------------

def random_case(chance, *, rows=12, largest=40, threads=1):
    """Return a random case of any physics that runs within seconds."""
    adhesive = chance.random() < 0.2
    free = not adhesive and chance.random() < 0.25
    friction = chance.random() < 0.4
    moving = friction or chance.random() < 0.5
    arms = chance.choice([0, 0, 1, 3])
    nx = chance.randrange(6, largest)
    ny = chance.randrange(2 if free else 1, largest)
    lx = 10 ** chance.uniform(-5, -1)
    ly = lx * ny / nx * chance.uniform(0.6, 1.6)
    modulus = 10 ** chance.uniform(4, 8)
    amplitude = lx * 10 ** chance.uniform(-3.5, -1.2)
    pressure = modulus * amplitude / lx * 10 ** chance.uniform(-1.5, 0.3)
    lines = [f"&grid nx = {nx}, ny = {ny}, lx = {lx:.6e}, ly = {ly:.6e}"
             + (", boundary = 'free' /" if free else " /")]
    if free:
        lines.append(f"&surface shape = 'paraboloid', radius = {lx**2 / amplitude:.6e} /")
        load = f"force = {0.02 * pressure * lx * ly:.6e}"
    else:
        longest = 0.8 * min(lx, ly if ny > 1 else lx)
        shortest = 3 * max(lx / nx, ly / ny if ny > 1 else 0.0)
        shape = chance.choice(["sine", "self_affine", "self_affine"])
        if shortest > 0.4 * longest:
            shape = "sine"
        if shape == "sine":
            lines.append(f"&surface shape = 'sine', amplitude = {amplitude:.6e},"
                         f" wavelength = {lx:.6e} /")
        else:
            lines.append(f"&surface shape = 'self_affine', hurst = {chance.uniform(0.4, 1):.3f},"
                         f" wavelength_long = {longest:.6e},"
                         f" wavelength_short = {shortest:.6e}, rms_height = {amplitude:.6e},"
                         f" seed = {chance.randrange(1000)} /")
        load = f"pressure = {pressure:.6e}"
    material = f"&material shear_modulus = {modulus:.6e}"
    if arms:
        taus = sorted(10 ** chance.uniform(-4, 0) for _ in range(arms))
        moduli = [modulus * chance.uniform(0.1, 3) for _ in taus]
        material += (f", prony_g = {', '.join(f'{g:.5e}' for g in moduli)}"
                     f", prony_tau = {', '.join(f'{tau:.5e}' for tau in taus)}")
    if friction and not free:
        material += f", thickness = {lx * chance.uniform(1, 30):.5e}"
    lines.append(material + " /")
    if adhesive:
        potential = chance.choice(["exponential", "gauss", "maugis_dugdale"])
        lines.append(f"&adhesion potential = '{potential}',"
                     f" energy = {modulus * lx * 10 ** chance.uniform(-6, -4):.5e},"
                     f" range = {amplitude * chance.uniform(0.2, 2):.5e} /")
    if friction:
        law = chance.choice(["coulomb", "constant_shear", "coulomb_orowan"])
        strength = f", shear_strength = {pressure * chance.uniform(0.2, 2):.5e}"
        coefficient = f", coefficient = {chance.uniform(0.05, 0.9):.3f}"
        lines.append(f"&friction law = '{law}'" + (coefficient if law != "constant_shear" else "")
                     + (strength if law != "coulomb" else "") + " /")
    phases = chance.choice([1, 2, 3])
    for k in range(phases):
        words = [load] if k == 0 or chance.random() < 0.5 else []
        if k > 0 and words and chance.random() < 0.5:
            words.append("ramp = 'linear'")
        steps = max(1, rows // phases)
        cell = lx / nx
        dt = 10 ** chance.uniform(-4, -1)
        words += [f"duration = {dt * steps:.5e}", f"steps = {steps}"]
        if moving and (k > 0 or phases == 1):
            words.append(f"velocity_x = {chance.uniform(-1, 1) * cell / dt:.5e}")
            if ny > 1:
                words.append(f"velocity_y = {chance.uniform(-1, 1) * cell / dt:.5e}")
        lines.append("&phase " + ", ".join(words) + " /")
    solver = [f"threads = {threads}",
              f"time_scheme = '{chance.choice(['exponential2', 'exponential', 'backward_euler'])}'"]
    lines.append("&solver " + ", ".join(solver) + " /")
    lines.append(f"&output checkpoint_every = {chance.randrange(1, 5)}, checkpoint_minutes = 0,"
                 f" snapshot_every = {chance.randrange(2, 8)},"
                 f" compression = {chance.choice([0, 4])} /")
    return "\n".join(lines) + "\n"


# --- trials ------------------------------------------------------------------------------------

def try_problem(chance, folder):
    """Solve a random elastic contact and check its conditions with displacements by NumPy."""
    ny, nx = chance.choice([(1, 5), (1, 40), (7, 9), (16, 16), (33, 20), (64, 48)])
    numbers = np.random.default_rng(chance.randrange(2**32))
    height = numbers.standard_normal((ny, nx)) * 10 ** chance.uniform(-9, -2)
    if chance.random() < 0.3:
        height = np.round(height / np.abs(height).max(), 1) * np.abs(height).max()
    lx, ly = 10 ** chance.uniform(-6, 0), 10 ** chance.uniform(-6, 0)
    modulus = 10 ** chance.uniform(3, 11)
    spread = float(height.max() - height.min())
    pressure = modulus * spread / lx * 10 ** chance.uniform(-4, 1)
    np.savez(folder / "problem.npz", height=height, lx=lx, ly=ly, modulus=modulus,
             pressure=pressure)
    try:
        found = asperity.solve_normal(height, lx, ly, modulus, pressure=pressure)
    except asperity.NotConverged as error:
        return f"not converged ({str(error)[:40]})"
    kx = 2 * np.pi * np.fft.fftfreq(nx, lx / nx)
    ky = 2 * np.pi * np.fft.fftfreq(ny, ly / ny)[:, None]
    k = np.hypot(kx, ky)
    k[0, 0] = np.inf
    gap = np.fft.ifft2(np.fft.fft2(found.pressure) * 2 / (modulus * k)).real - height
    level = gap[found.pressure > 0].mean()
    gap = gap - level
    if found.pressure.min() < 0:
        raise Wrong("a negative pressure")
    if abs(found.pressure.mean() / pressure - 1) > 1e-5:
        raise Wrong(f"mean pressure {found.pressure.mean():g} for {pressure:g}")
    error = float((found.pressure * np.abs(gap)).sum() / found.pressure.sum()) / height.std()
    if error > 1e-4:
        raise Wrong(f"the gap under pressure is {error:.2g} of the rms height")
    if gap.min() < -2e-3 * spread:
        raise Wrong(f"overlap by {-gap.min() / spread:.2g} of the height")
    return "solved"


def try_run(chance, folder):
    """Run a random case: numbers must be finite, and the energy balance closed."""
    (folder / "case.nml").write_text(random_case(chance))
    done = call("run", "case.nml", "--quiet", cwd=folder, statuses=(0, 4))
    with h5py.File(folder / "case.h5") as file:
        history = {name: file["history"][name][:] for name in file["history"]}
        finished = int(file.attrs["finished"])
    if finished != (done.returncode == 0):
        raise Wrong(f"finished = {finished} with status {done.returncode}")
    if done.returncode:
        reason = re.search(r"did not converge: ([^;]*)", done.message)
        return f"not converged ({reason[1][:40] if reason else '?'})"
    for name, values in history.items():
        if not np.isfinite(values).all():
            raise Wrong(f"{name} holds values that are not finite, with status 0")
    work = history["work_normal"] + history["work_tangential"]
    kept = (history["energy_elastic"] + history["energy_adhesive"] + history["energy_kinetic"]
            + history["dissipated_viscous"] + history["dissipated_friction"])
    # With adhesion, the energy of the first state is a constant in the balance.
    miss = np.abs((work - kept) - (work - kept)[0]).max()
    scale = max(np.abs(work).max(), np.abs(history["energy_elastic"]).max(), 1e-300)
    if miss > 1e-3 * scale:
        raise Wrong(f"the energy balance misses {miss / scale:.2g} of the work")
    return "ran"


def try_input(chance, folder):
    """Try an input in which letters, words or lines are changed, lost or doubled."""
    text = bytearray(random_case(chance).encode())
    words = [b"NaN", b"-1", b"1e999", b"0", b"''", b"&", b"/", b"=", b"2147483648", b"1e-320",
             b"'", b"\n", b"\x00", b"\xff", b"*", b"9" * 400, b"&phase", b"!"]
    for _ in range(chance.randrange(1, 6)):
        place = chance.randrange(len(text))
        kind = chance.randrange(5)
        if kind == 0:
            text[place] = chance.randrange(256)
        elif kind == 1:
            del text[place:place + chance.randrange(1, 30)]
        elif kind == 2:
            text[place:place] = chance.choice(words)
        elif kind == 3:
            text[place:place] = text[place:place + chance.randrange(1, 60)]
        else:
            numbers = list(re.finditer(rb"[-+.0-9e]+", bytes(text)))
            if numbers:
                found = chance.choice(numbers)
                text[found.start():found.end()] = chance.choice(words)
        if not text:
            text = bytearray(b"&")
    (folder / "case.nml").write_bytes(text)
    done = call("check", "case.nml", cwd=folder)
    if done.returncode == 0:
        steps = re.search(rb"(\d+) time steps", done.stdout)
        memory = re.search(rb"memory: about [-0-9.e+]+ GB", done.stdout)
        if memory or (steps and int(steps[1]) > 200):
            return "accepted, too large to be run"
        call("run", "case.nml", "--quiet", cwd=folder)
        return "accepted and run"
    return f"refused ({done.returncode})"


def stop_early(folder, rows, chance):
    """Run the case in a folder and kill it after some rows, with a checkpoint."""
    process = subprocess.Popen([program(), "run", "case.nml", "--quiet", "--overwrite"], cwd=folder,
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    end = time.monotonic() + PATIENCE
    while process.poll() is None and time.monotonic() < end:
        try:
            with h5py.File(folder / "case.h5", "r") as file:
                if len(file["history/step"]) >= rows:
                    break
        except (OSError, KeyError):
            pass
        time.sleep(0.001)
    process.send_signal(chance.choice([signal.SIGTERM, signal.SIGKILL, signal.SIGHUP]))
    process.wait(PATIENCE)


def damage(chance, path):
    """Change a file: a bit, a block of zeros, of ones or of noise, or its length."""
    content = bytearray(path.read_bytes())
    place = chance.randrange(len(content))
    length = min(chance.choice([1, 8, 64, 512, 4096]), len(content) - place)
    kind = chance.choice(["bit", "bit", "zeros", "ones", "noise", "cut", "longer"])
    if kind == "bit":
        content[place] ^= 1 << chance.randrange(8)
    elif kind == "zeros":
        content[place:place + length] = bytes(length)
    elif kind == "ones":
        content[place:place + length] = b"\xff" * length
    elif kind == "noise":
        content[place:place + length] = chance.randbytes(length)
    elif kind == "cut":
        del content[place:]
    else:
        content += chance.randbytes(length)
    changed = bytes(content) != path.read_bytes()
    path.write_bytes(content)
    return kind, changed


def try_flip(chance, folder):
    """Damage a checkpoint, a result or a height map."""
    target = chance.choice(["checkpoint", "checkpoint", "result", "map"])
    if target == "map":
        with h5py.File(folder / "map.h5", "w") as file:
            file.create_dataset("surface/height", data=np.random.default_rng(1).random((12, 10)),
                                chunks=(4, 5), compression="gzip")
            file["surface/height"].attrs["units"] = "m"
        (folder / "case.nml").write_text(
            "&grid nx = 10, ny = 12, lx = 1 /\n&surface shape = 'file', file = 'map.h5' /\n"
            "&material shear_modulus = 1e6 /\n&phase pressure = 1e5 /\n&solver threads = 1 /\n")
        kind, _ = damage(chance, folder / "map.h5")
        done = call("run", "case.nml", "--quiet", cwd=folder)
        return f"map, {kind}: status {done.returncode}"
    (folder / "case.nml").write_text(random_case(chance, rows=40, largest=24))
    stop_early(folder, 6, chance)
    checkpoint, result = folder / "case.checkpoint.h5", folder / "case.h5"
    if not checkpoint.exists():
        return "no checkpoint"
    if target == "checkpoint":
        kind, changed = damage(chance, checkpoint)
        before = result.read_bytes()
        done = call("run", "case.nml", "--quiet", "--restart", cwd=folder,
                    statuses=(3,) if changed else (0, 4))
        if changed and result.read_bytes() != before:
            raise Wrong("the result was changed by a restart that was refused")
        return f"checkpoint, {kind}: {'refused' if changed else 'not changed'}"
    kind, _ = damage(chance, result)
    shown = call("info", "case.h5", cwd=folder, statuses=(0, 3))
    done = call("run", "case.nml", "--quiet", "--restart", cwd=folder)
    return f"result, {kind}: info {shown.returncode}, restart {done.returncode}"


def try_kill(chance, folder):
    """Kill and stop a run again and again, and compare it with an uninterrupted run."""
    text = random_case(chance, rows=30, largest=28)
    for name in ("case", "whole"):
        (folder / f"{name}.nml").write_text(text)
    whole = call("run", "whole.nml", "--quiet", cwd=folder, statuses=(0, 4))
    if whole.returncode:
        return "does not converge"
    checkpoint, result = folder / "case.checkpoint.h5", folder / "case.h5"
    stops = 0
    for _ in range(200):
        restart = "--restart" if checkpoint.exists() else "--overwrite"
        process = subprocess.Popen([program(), "run", "case.nml", "--quiet", restart], cwd=folder,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        number = None
        if stops < 8:
            time.sleep(chance.uniform(0.0, 0.25))
            number = chance.choice([signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGUSR1])
            process.send_signal(number)
            stops += 1
        message = process.communicate(timeout=PATIENCE)[1].decode(errors="replace")
        if process.returncode == 0:
            break
        # Before the handlers are installed, the system ends the run.
        if number is None or process.returncode not in (-number, 128 + number):
            raise Wrong(f"{restart}: status {process.returncode}: {message[-300:]}")
    same(result, folder / "whole.h5")
    left = {path.name for path in folder.iterdir()} - {
        f"{name}{ending}" for name in ("case", "whole") for ending in (".nml", ".h5", ".xdmf")}
    if left:
        raise Wrong(f"left behind: {', '.join(sorted(left))}")
    return "the same numbers"


def try_twins(chance, folder):
    """Start several runs on one result at nearly the same time."""
    (folder / "case.nml").write_text(random_case(chance, rows=20, largest=20))
    processes = []
    for _ in range(chance.randrange(2, 6)):
        word = chance.choice([["--overwrite"], [], ["--restart"]])
        processes.append(subprocess.Popen(
            [program(), "run", "case.nml", "--quiet", *word], cwd=folder,
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE))
        time.sleep(chance.choice([0.0, 0.0, 0.02, 0.1]))
    codes = []
    for process in processes:
        message = process.communicate(timeout=PATIENCE)[1].decode(errors="replace")
        codes.append(process.returncode)
        if process.returncode not in (0, 3, 4):
            raise Wrong(f"status {process.returncode}: {message[-300:]}")
    result = folder / "case.h5"
    if 0 in codes or 4 in codes:
        found = contents(result)
        lengths = {len(values) for name, values in found.items() if name.startswith("history/")}
        if len(lengths) != 1 or found["finished"] != (0 if 0 not in codes else found["finished"]):
            raise Wrong("the result is not that of one run")
        if not np.array_equal(found["history/step"], np.arange(lengths.pop())):
            raise Wrong("rows of two runs in one result")
    return f"{codes.count(3)} of {len(codes)} refused"


def try_memory(chance, folder):
    """Run with a random limit of the address space."""
    (folder / "case.nml").write_text(random_case(chance, rows=2, largest=500))
    limit = int(10 ** chance.uniform(7.8, 9.2))
    done = call("run", "case.nml", "--quiet", cwd=folder, statuses=(0, 3, 4, 127, 143),
                stop_after=60.0,  # a row with friction on a steep road may take many minutes
                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)))
    if done.returncode == 127:
        return "too little to load the program"
    if done.returncode == 3 and "not enough memory" not in done.message:
        raise Wrong(f"status 3: {done.message[-300:]}")
    return f"status {done.returncode}"


KINDS = {"problems": try_problem, "runs": try_run, "inputs": try_input, "flips": try_flip,
         "kills": try_kill, "twins": try_twins, "memory": try_memory}


def main():
    """Try until the time is over; return the exit status."""
    warnings.simplefilter("ignore", UserWarning)       # the problems are small on purpose
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=", ".join(KINDS))
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--trials", type=int, default=10**9, help="at most so many")
    parser.add_argument("--seed", type=int, default=1, help="of the first trial")
    parser.add_argument("--keep", type=Path, help="folder for the files of trials that fail")
    options = parser.parse_args()
    unknown = set(options.kinds) - set(KINDS)
    if unknown:
        parser.error(f"no such kind: {', '.join(sorted(unknown))}; there are {', '.join(KINDS)}")
    kinds = options.kinds or list(KINDS)
    keep = options.keep or Path(tempfile.mkdtemp(prefix="campaign-"))
    keep.mkdir(parents=True, exist_ok=True)
    outcomes = {kind: Counter() for kind in kinds}
    failed = 0
    end = time.monotonic() + 60.0 * options.minutes
    trial = 0
    print(f"campaign from seed {options.seed}: {', '.join(kinds)}", flush=True)
    while time.monotonic() < end and trial < options.trials:
        seed = options.seed + trial
        kind = kinds[trial % len(kinds)]
        trial += 1
        folder = Path(tempfile.mkdtemp(prefix=f"{kind}-"))
        try:
            outcome = KINDS[kind](random.Random(f"{kind} {seed}"), folder)
        except Wrong as error:
            failed += 1
            outcome = "WRONG"
            kept = keep / f"{kind}-{seed}"
            shutil.rmtree(kept, ignore_errors=True)
            shutil.move(folder, kept)
            print(f"WRONG {kind} --seed {seed}: {error}\n      files: {kept}", flush=True)
        finally:
            shutil.rmtree(folder, ignore_errors=True)
        outcomes[kind][outcome] += 1
    print(f"{trial} trials, {failed} wrong")
    for kind, counts in outcomes.items():
        for outcome, count in sorted(counts.items(), key=lambda item: -item[1]):
            print(f"  {kind:9} {count:6}  {outcome}")
    return 1 if failed else 0


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    sys.exit(main())
