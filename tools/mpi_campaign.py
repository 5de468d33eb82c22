"""Compare random cases on several processes with the same cases on one, to the last bit.

    tools/build_mpi.sh
    python tools/mpi_campaign.py --minutes 10 [--seed 1] [--physics elastic,friction]
    python tools/mpi_campaign.py --seed 17 --trials 1 --physics friction

Every trial draws a case of one physics from its own seed: the grid, the boundary, the road, which
may be a height map in a file, the law, the scheme and the phases. 'huge' has so many cells that the
processes divide the coarse level of the preconditioner. The program without MPI runs it with one
thread, the program with MPI with some numbers of processes from 1 to 8 and of threads. All columns
of the history but the wall time and all fields must agree in every bit, and so must the exit status
and the message. `--restarts` also continues each run from one of its checkpoints with another
number of processes.

Where something differs, the seed, the command and what differs are printed, and the files are kept.
The exit status is 1 if any trial failed. The programs are those in `.venv/bin`, which must be of
the same sources: `. tools/install_editable.sh` brings the one without MPI up to date. `--mpi` and
`--serial` name other ones.
"""

import argparse
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
TIMES = {"history/seconds", "history/checksum"}
MPIRUN = ["mpirun", "--allow-run-as-root", "--oversubscribe", "--bind-to", "none", "-q"]
PATIENCE = 40.0
HANGS = 99


def compare(expected, found):
    """Return what differs between two results: names of datasets, most important first."""
    wrong = []
    with h5py.File(expected) as one, h5py.File(found) as other:

        def look(name, item):
            if not isinstance(item, h5py.Dataset) or name in TIMES:
                return
            if name not in other:
                wrong.append(f"{name} is missing")
                return
            a, b = item[()], other[name][()]
            if np.asarray(a).tobytes() != np.asarray(b).tobytes():
                wrong.append(name + difference(np.asarray(a), np.asarray(b)))

        one.visititems(look)
        names = []
        other.visititems(lambda name, item: names.append(name))
        wrong += [f"{name} is new" for name in names if name not in one]
        for name in ("finished", "outcome", "run_warnings", "warnings", "settings"):
            a, b = without_file(one.attrs.get(name)), without_file(other.attrs.get(name))
            if a != b:
                wrong.append(f"attribute {name}: {b[:200]!r}, not {a[:200]!r}")
    return wrong


def without_file(text):
    """Return an attribute without the parts that differ in a run on several processes."""
    lines = str(text).splitlines()
    return "\n".join(
        line for line in lines if not re.search(r"\b(file|threads|checkpoint_every) *=", line)
    )


def difference(a, b):
    """Return by how much two arrays differ, as a text."""
    if a.shape != b.shape:
        return f": shapes {a.shape} and {b.shape}"
    with np.errstate(invalid="ignore"):
        apart = np.abs(a - b)
    scale = np.max(np.abs(a), initial=1e-300)
    first = np.argwhere(a != b)
    place = first[0].tolist() if len(first) else "?"
    return f": {np.nanmax(apart) / scale:.1e} of the largest, first at {place}"


class Draw:
    """Draws the namelists of a case."""

    def __init__(self, seed, physics):
        """Start from a seed."""
        self.random = random.Random(f"{physics}{seed}")
        self.maps = random.Random(f"maps{physics}{seed}")
        self.physics = physics
        self.height = None  # of the map in the file map.h5, if the case has one

    def group(self, name, **values):
        """Return a namelist group."""
        words = []
        for key, value in values.items():
            if isinstance(value, bool):
                text = f".{str(value).lower()}."
            elif isinstance(value, str):
                text = f"'{value}'"
            elif isinstance(value, (list, tuple)):
                text = ", ".join(repr(float(v)) for v in value)
            else:
                text = repr(value)
            words.append(f"{key} = {text}")
        return f"&{name} {', '.join(words)} /\n"

    def case(self):
        """Return the text of a case."""
        r = self.random
        physics = self.physics
        free = physics != "steady" and r.random() < 0.5
        self.moving = physics in ("sliding", "friction", "steady")
        self.large = physics in ("large", "huge")
        if self.large:
            self.moving = r.random() < 0.3
        most = 40 if self.moving or physics == "adhesion" else 80
        nx = r.randint(6, most)
        line = not free and r.random() < 0.15
        ny = 1 if line else r.choice([r.randint(2, 12), r.randint(6, most), r.randint(6, most), nx])
        if not free and r.random() < 0.3:
            nx, ny = r.choice([16, 32, 48]), 1 if line else r.choice([16, 32, 48, 64])
        if self.large:
            # Several threads are at work, and the preconditioner extends the residual.
            nx, ny, line = r.randint(363, 620), r.randint(363, 620), False
            free = r.random() < 0.2
        if physics == "huge":
            nx, ny = r.choice([(1024, 1024), (1100, 990), (1031, 1033)])
            self.moving = False
        lx = 1e-3
        ly = lx * ny / nx * r.choice([1.0, 1.0, 0.7, 1.5]) if not line else lx
        text = self.group(
            "grid", nx=nx, ny=ny, lx=lx, ly=ly, boundary="free" if free else "periodic"
        )
        text += self.surface(nx, ny, lx, ly)
        viscoelastic = physics in ("viscoelastic", "steady") or r.random() < 0.4
        if physics == "elastic":
            viscoelastic = False
        text += self.material(viscoelastic, free)
        modulus = 1e6
        share = {"adhesion": 1.0, "sliding": 0.15, "friction": 0.2, "large": 0.2}.get(physics, 0.0)
        if r.random() < share:
            text += self.adhesion(lx / nx)
        if physics == "friction" or (physics == "steady" and r.random() < 0.5):
            text += self.friction()
        text += self.phases(free, modulus, lx / nx, line)
        text += self.solver()
        text += self.group(
            "output",
            snapshot_every=r.choice([0, 1, 2, 3]),
            compression=r.choice([0, 1]),
        )
        return text

    def surface(self, nx, ny, lx, ly):
        """Return one or two terms of a surface."""
        r = self.random
        if not self.large and self.maps.random() < 0.15:
            return self.height_map(nx, ny, lx)
        shape = r.choice(["self_affine", "self_affine", "paraboloid", "sine", "cylinder", "sphere"])
        slope = r.uniform(0.03, 0.25)
        if shape == "self_affine" and min(nx, ny if ny > 1 else nx) < 8:
            shape = "paraboloid"
        if shape == "self_affine":
            side = lx if ny == 1 else min(lx, ly)
            cell = lx / nx if ny == 1 else max(lx / nx, ly / ny)
            return self.group(
                "surface",
                shape=shape,
                hurst=r.uniform(0.4, 1.0),
                wavelength_short=min(4 * cell, side),
                wavelength_long=side,
                rms_slope=slope,
                seed=r.randint(1, 999),
                generator=r.choice(["random_phase", "filtered_noise"]),
            )
        if shape == "sine":
            return self.group(
                "surface", shape=shape, amplitude=slope * lx / 6.3, wavelength=lx
            ) + self.group("surface", shape="paraboloid", radius=lx / slope)
        return self.group("surface", shape=shape, radius=lx / slope)

    def height_map(self, nx, ny, lx):
        """Draw a rough map for a file and return the surface that reads it."""
        noise = np.random.default_rng(self.maps.randrange(10**6)).standard_normal((ny, nx))
        spectrum = np.fft.rfft2(noise)
        waves = np.hypot(np.fft.fftfreq(ny)[:, None] * ny, np.fft.rfftfreq(nx) * nx)
        spectrum[waves > max(nx, ny) / 8] = 0.0
        height = np.fft.irfft2(spectrum / np.maximum(waves, 1.0), (ny, nx))
        self.height = height / max(np.ptp(height), 1e-300) * self.maps.uniform(0.01, 0.06) * lx
        scale = self.maps.choice([1.0, 1.0, 0.5])
        return self.group("surface", shape="file", file="map.h5", scale=scale)

    def material(self, viscoelastic, free):
        """Return a material."""
        r = self.random
        values = {"shear_modulus": 1e6, "poisson": r.choice([0.5, 0.5, 0.3, 0.0])}
        if self.physics in ("friction", "steady") and not free:
            values["thickness"] = r.choice([0.0, 1e-3, 5e-3])
            if (
                values.get("thickness", 0.0) > 0.0
                and r.random() < 0.5
                and self.physics == "friction"
            ):
                values["density"] = 1000.0
        if viscoelastic:
            arms = r.choice([1, 2, 3])
            values["prony_g"] = [r.uniform(0.3e6, 5e6) for _ in range(arms)]
            values["prony_tau"] = [10.0 ** r.uniform(-4, 0) for _ in range(arms)]
        return self.group("material", **values)

    def adhesion(self, cell):
        """Return an adhesion that the grid resolves more or less."""
        r = self.random
        reach = cell * r.uniform(0.05, 0.3)
        return self.group(
            "adhesion",
            potential=r.choice(["exponential", "gauss", "maugis_dugdale"]),
            energy=reach * 1e6 * r.uniform(0.02, 0.2),
            range=reach,
        )

    def friction(self):
        """Return a friction law."""
        r = self.random
        law = r.choice(["coulomb", "coulomb", "constant_shear", "coulomb_orowan"])
        values = {"law": law, "slope_effect": r.random() < 0.7}
        if law != "constant_shear":
            values["coefficient"] = r.uniform(0.05, 0.8)
        if law != "coulomb":
            values["shear_strength"] = r.uniform(0.5e5, 5e5)
        return self.group("friction", **values)

    def phases(self, free, modulus, cell, line):
        """Return the phases."""
        r = self.random
        pressure = modulus * r.uniform(0.005, 0.05)
        if free:
            pressure *= 0.3
        if self.physics == "steady":
            text = ""
            for _ in range(r.randint(1, 3)):
                text += self.group(
                    "phase",
                    steady=True,
                    pressure=pressure * r.uniform(0.7, 1.3),
                    velocity_x=10.0 ** r.uniform(-4, 0),
                    **({} if line else {"velocity_y": r.choice([0.0, 1e-3])}),
                )
            if r.random() < 0.4:
                text += self.group("phase", velocity_x=0.01, duration=2 * cell / 0.01)
            return text
        text = ""
        pulled = self.physics == "friction" and r.random() < 0.2
        for i in range(r.randint(1, 2 if self.large else 3)):
            values = {"pressure": pressure * r.uniform(0.5, 2.0)}
            if r.random() < 0.25:
                values = {"displacement": cell * r.uniform(0.05, 0.5)}
            moving = self.moving and (i > 0 or r.random() < 0.5)
            if r.random() < 0.7 or moving:
                steps = r.randint(1, 2 if self.large else 4)
                values["steps"] = steps
                values["duration"] = 10.0 ** r.uniform(-4, -1)
                if r.random() < 0.4:
                    values["ramp"] = "linear"
                if moving and pulled:
                    values["traction_x"] = pressure * r.uniform(0.01, 0.6)
                elif moving:
                    way = cell * steps * r.uniform(0.2, 1.3)
                    values["velocity_x"] = way / values["duration"]
                    if not line and r.random() < 0.5:
                        values["velocity_y"] = values["velocity_x"] * r.uniform(-1, 1)
            if i == 0 and "ramp" not in values and r.random() < 0.3:
                values["relaxed"] = True
            text += self.group("phase", **values)
        return text

    def solver(self):
        """Return the settings of the solvers."""
        r = self.random
        values = {
            "tolerance": r.choice([1e-4, 1e-6]),
            "time_scheme": r.choice(["exponential2", "exponential", "backward_euler"]),
            "max_iterations": r.choice([1000, 1000, 300]),
        }
        if r.random() < 0.2 and self.physics not in ("steady",):
            values["method"] = "thesis"
            values["tolerance"] = 1e-4
        elif r.random() < 0.3 and self.physics != "adhesion":
            values["precision"] = "mixed"
        if self.moving and r.random() < 0.3:
            values["interpolation"] = "linear"
        if self.physics == "friction":
            values["passes"] = r.choice([0, 1, 3])
            values["coupling_tolerance"] = 1e-2
        return self.group("solver", **values)


class Trial:
    """One case, run on several numbers of processes."""

    def __init__(self, options, seed, physics, folder):
        """Draw the case."""
        self.options = options
        self.folder = folder
        self.patience = PATIENCE * (5.0 if physics == "huge" else 1.0)
        self.random = random.Random(f"numbers{seed}")
        self.case = folder / "case.nml"
        draw = Draw(seed, physics)
        self.case.write_text(draw.case())
        if draw.height is not None:
            with h5py.File(folder / "map.h5", "w") as file:
                file.create_dataset("surface/height", data=draw.height)
        self.faults = []

    def call(self, command, name, *more):
        """Run a program; return its status and its messages, without the file's name."""
        words = [*command, "run", "case.nml", "--output", name, "--quiet", *more]
        environment = dict(os.environ, OMP_WAIT_POLICY="passive")
        try:
            done = subprocess.run(
                words,
                cwd=self.folder,
                capture_output=True,
                text=True,
                timeout=self.patience,
                env=environment,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return HANGS, "it hangs", words
        said = [
            line
            for line in done.stderr.splitlines()
            if line and "mpirun" not in line and "[warn]" not in line
        ]
        return done.returncode, "\n".join(said).replace(name, "FILE"), words

    def mpi(self, processes):
        """Return the command of the program on several processes."""
        return [*MPIRUN, "-n", str(processes), str(self.options.mpi)]

    def check(self):
        """Run the case; faults are collected."""
        status, said, _ = self.call([str(self.options.serial)], "one.h5", "--threads", "1")
        if status not in (0, 4):
            print(f"seed not usable: {said.splitlines()[-1] if said else status}")
            return status
        numbers = sorted(self.random.sample(range(1, 9), min(8, self.options.numbers)))
        for processes in numbers:
            threads = str(self.random.choice([1, 1, 2]))
            name = f"mpi{processes}.h5"
            found = self.call(self.mpi(processes), name, "--threads", threads)
            self.judge(status, said, name, *found)
            if found[0] == HANGS:
                return status
        if self.options.restarts and status == 0 and not self.faults:
            self.restart(status)
        return status

    def judge(self, status, said, name, status_found, said_found, words):
        """Compare a run with that of one process."""
        wrong = []
        if status_found != status:
            wrong.append(f"status {status_found}, not {status}: {said_found[:400]}")
        elif said is not None and said_found != said:
            wrong.append(f"it says {said_found[:300]!r}, not {said[:300]!r}")
        if status_found in (0, 4) and (self.folder / name).exists():
            wrong += compare(self.folder / "one.h5", self.folder / name)
        if wrong:
            self.faults.append(" ".join(map(str, words)) + "\n    " + "\n    ".join(wrong[:12]))

    def restart(self, status):
        """Continue from a checkpoint of some processes on another number of them."""
        first, second = self.random.sample(range(1, 6), 2)
        text = self.case.read_text()
        self.case.write_text(text.replace("&output ", "&output checkpoint_every = 1, "))
        kept = self.keep_checkpoints(self.mpi(first), "again.h5")
        if not kept:
            return
        shutil.copy(self.random.choice(kept), self.folder / "again.checkpoint.h5")
        found = self.call(self.mpi(second), "again.h5", "--threads", "1", "--restart")
        self.judge(status, None, "again.h5", *found)

    def keep_checkpoints(self, command, name):
        """Run to the end, and return links to the checkpoints that were written meanwhile."""
        words = [*command, "run", "case.nml", "--output", name, "--quiet", "--threads", "1"]
        checkpoint = self.folder / name.replace(".h5", ".checkpoint.h5")
        kept = []
        run = subprocess.Popen(
            words, cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        end = time.monotonic() + self.patience
        while run.poll() is None and time.monotonic() < end:
            try:
                if kept and kept[-1].samefile(checkpoint):
                    time.sleep(0.001)
                    continue
                link = self.folder / f"kept{len(kept)}.h5"
                os.link(checkpoint, link)
                kept.append(link)
            except OSError:
                time.sleep(0.001)
        run.kill()
        run.wait()
        return kept


PHYSICS = ["elastic", "viscoelastic", "sliding", "adhesion", "friction", "steady", "large", "huge"]


def read_options():
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--trials", type=int, default=10**9, help="at most")
    parser.add_argument("--seed", type=int, default=1, help="of the first trial")
    parser.add_argument("--physics", default=",".join(PHYSICS))
    parser.add_argument("--numbers", type=int, default=3, help="numbers of processes per trial")
    parser.add_argument("--restarts", action="store_true")
    parser.add_argument("--mpi", type=Path, default=ROOT / ".venv/bin/asperity-mpi")
    parser.add_argument("--serial", type=Path, default=ROOT / ".venv/bin/asperity")
    parser.add_argument("--keep", type=Path, default=Path(tempfile.gettempdir()) / "mpi_campaign")
    options = parser.parse_args()
    options.physics = options.physics.split(",")
    for name in options.physics:
        if name not in PHYSICS:
            parser.error(f"{name}: physics are {', '.join(PHYSICS)}")
    return options


def main():
    """Run trials until the time is over."""
    options = read_options()
    print(f"with MPI: {options.mpi}\nwithout:  {options.serial}", flush=True)
    ends = Counter()
    end = time.monotonic() + 60.0 * options.minutes
    trial = 0
    failed = 0
    while time.monotonic() < end and trial < options.trials:
        physics = options.physics[trial % len(options.physics)]
        seed = options.seed + trial
        trial += 1
        folder = Path(tempfile.mkdtemp(prefix="mpi_campaign_"))
        one = Trial(options, seed, physics, folder)
        status = one.check()
        ends[physics, status, bool(one.faults)] += 1
        if one.faults:
            failed += 1
            kept = options.keep / f"{physics}{seed}"
            shutil.rmtree(kept, ignore_errors=True)
            shutil.copytree(folder, kept)
            print(f"WRONG: --physics {physics} --seed {seed} --trials 1; files in {kept}")
            for fault in one.faults:
                print("  " + fault, flush=True)
        shutil.rmtree(folder)
    print("physics, status, trials, of which wrong:")
    for physics, status in sorted({(p, s) for p, s, _ in ends}):
        right, wrong = ends[physics, status, False], ends[physics, status, True]
        print(f"  {physics:13} {status:3} {right + wrong:5} {wrong:5}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
