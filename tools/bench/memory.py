"""Compare the memory that `asperity check` predicts with the peak of the run.

    python tools/bench/memory.py [-n 256 512] [--only adhesive friction] [--threads 1]

Every case is run by the program in a process of its own, whose largest resident set the system
reports. A ratio (predicted over taken) that differs from 1 by more than a tenth is marked, and the
exit status is then 1.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROUGH = ("shape = 'self_affine', hurst = 0.8, rms_slope = 0.2, wavelength_long = 2.5e-4,"
         " wavelength_short = {short}")
SPHERE = "shape = 'sphere', radius = 1e-2"
ELASTIC = "shear_modulus = 1e6"
ARMS = "shear_modulus = 1e6, prony_g = 2e6, 1e6, 5e5, prony_tau = 1e-5, 1e-4, 1e-3"
BLOCK = ARMS + ", thickness = 1e-3"
HEAVY = BLOCK + ", density = 1000"
SPRING = ELASTIC + ", thickness = 1e-3"
PRESS = ("pressure = 1e5",)
HOLD = ("pressure = 1e5", "duration = 1e-4, steps = 3")
REST = ("pressure = 1e5, relaxed = .true.", "duration = 1e-5, steps = 3, velocity_x = 1.0")
PUSH = ("pressure = 1e5", REST[1])
TOUCH = ("force = 1e-3", "duration = 1e-5, steps = 3, velocity_x = 0.1")
STEADY = ("steady = .true., pressure = 1e5, velocity_x = 1.0",)
ADHESION = "&adhesion potential = '{}', energy = 0.05, range = 2e-8 /"
EXPONENTIAL = ADHESION.format("exponential")
MAUGIS = ADHESION.format("maugis_dugdale")
FRICTION = "&friction law = 'coulomb', coefficient = 0.3 /"
SHEAR = "&friction law = 'constant_shear', shear_strength = 3e5 /"
BOTH = FRICTION + "\n" + EXPONENTIAL

# name: surface, material, laws, phases, boundary, solver
CASES = {
    "elastic": (ROUGH, ELASTIC, "", PRESS, "periodic", ""),
    "elastic, mixed": (ROUGH, ELASTIC, "", PRESS, "periodic", "precision = 'mixed'"),
    "elastic, several loads": (ROUGH, ELASTIC, "", ("pressure = 1e5", "pressure = 2e5"), "periodic",
                               ""),
    "elastic, free": (SPHERE, ELASTIC, "", ("force = 1e-3",), "free", ""),
    "elastic, free, mixed": (SPHERE, ELASTIC, "", ("force = 1e-3",), "free",
                             "precision = 'mixed'"),
    "elastic, thesis": (ROUGH, ELASTIC, "", PRESS, "periodic", "method = 'thesis'"),
    "elastic, sliding": (ROUGH, ELASTIC, "", PUSH, "periodic", ""),
    "three arms": (ROUGH, ARMS, "", HOLD, "periodic", ""),
    "three arms, sliding": (ROUGH, ARMS, "", REST, "periodic", ""),
    "three arms, sliding, linear": (ROUGH, ARMS, "", REST, "periodic", "interpolation = 'linear'"),
    "three arms, sliding, free": (SPHERE, ARMS, "", TOUCH, "free", ""),
    "adhesive": (ROUGH, ELASTIC, EXPONENTIAL, PRESS, "periodic", ""),
    "adhesive, Maugis-Dugdale": (ROUGH, ELASTIC, MAUGIS, PRESS, "periodic", ""),
    "adhesive, free": (SPHERE, ELASTIC, EXPONENTIAL, ("displacement = 1e-7",), "free", ""),
    "adhesive, three arms": (ROUGH, ARMS, EXPONENTIAL, REST, "periodic", ""),
    "adhesive, thesis": (ROUGH, ELASTIC, EXPONENTIAL, PRESS, "periodic", "method = 'thesis'"),
    "friction": (ROUGH, BLOCK, FRICTION, REST, "periodic", ""),
    "friction, mass": (ROUGH, HEAVY, FRICTION, REST, "periodic", ""),
    "friction, elastic": (ROUGH, SPRING, FRICTION, PUSH, "periodic", ""),
    "friction, mixed": (ROUGH, BLOCK, FRICTION, REST, "periodic", "precision = 'mixed'"),
    "friction, free": (SPHERE, ARMS, FRICTION, TOUCH, "free", ""),
    "friction, thesis": (ROUGH, BLOCK, FRICTION, REST, "periodic", "method = 'thesis'"),
    "friction, adhesive": (ROUGH, BLOCK, BOTH, REST, "periodic", ""),
    "friction, constant shear": (ROUGH, BLOCK, SHEAR, REST, "periodic", ""),
    "steady": (ROUGH, BLOCK, "", STEADY, "periodic", ""),
    "steady, friction": (ROUGH, BLOCK, FRICTION, STEADY, "periodic", ""),
    "steady, elastic, friction": (ROUGH, ELASTIC, FRICTION, STEADY, "periodic", ""),
}


def text_of(name, n):
    """Return the input of a case."""
    surface, material, laws, phases, boundary, solver = CASES[name]
    lines = [f"&grid nx = {n}, ny = {n}, lx = 1e-3, boundary = '{boundary}' /",
             f"&surface {surface.format(short=8e-3 / n)} /", f"&material {material} /", laws,
             *(f"&phase {phase} /" for phase in phases),
             f"&solver tolerance = 1e-4 {', ' * bool(solver)}{solver} /"]
    return "\n".join(lines) + "\n"


def predicted(program, path):
    """Return the memory that `asperity check` predicts, MB."""
    printed = subprocess.run([*program, "check", path], capture_output=True, text=True,
                          check=True).stdout
    number, unit = re.search(r"memory: about ([\d.]+) (MB|GB)", printed).groups()
    return float(number) * (1000 if unit == "GB" else 1)


def taken(program, path, threads):
    """Run a case; return its largest resident set in MB, and its exit status."""
    process = subprocess.Popen([*program, "run", path, "--quiet", "--threads", str(threads)],
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return usage.ru_maxrss * 1024 / 1e6, process.returncode


def main():
    """Run the cases and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-n", type=int, nargs="+", default=[256, 512])
    parser.add_argument("--only", nargs="+", default=list(CASES), help="names of cases")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--program", default="asperity")
    options = parser.parse_args()
    worst = 0.0
    print("| case | cells | predicted, MB | taken, MB | fields | ratio |")
    print("| --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for n in options.n:
            for name in options.only:
                Path("case.nml").write_text(text_of(name, n))
                forecast = predicted([options.program], "case.nml")
                peak, status = taken([options.program], "case.nml", options.threads)
                for left in Path().glob("case*"):
                    left.unlink()
                ratio = forecast / peak
                worst = max(worst, abs(ratio - 1.0))
                notes = " off" * (abs(ratio - 1.0) > 0.1) + f" status {status}" * (status != 0)
                fields = (peak - 26) * 1e6 / (8 * n * n)
                print(f"| {name} | {n} x {n} | {forecast:.0f} | {peak:.0f} | {fields:.1f} "
                      f"| {ratio:.2f}{notes} |", flush=True)
    return int(worst > 0.1)


if __name__ == "__main__":
    sys.exit(main())
