"""Try the passes of steps with friction on random hard cases, and list those that did not settle.

Roads are self-affine or made of a few waves, with rms slopes up to 0.6; blocks are half-spaces,
thin or thick, elastic or with up to five arms, with or without mass and adhesion; maps are periodic
or free, square or oblong, with square cells; the road moves along an axis or obliquely. The grids
are small, so that 500 cases take some minutes. A case ends in one of three ways:

settled    exit status 0, and `residual_coupling` of all rows is within the tolerance
reported   exit status 4: the run says that a solver or the passes did not converge
silent     anything else, which is a fault of the program

With --slopes 0.5 1.5 --ratios 0.2 5 the roads are steeper, and the cells oblong.

usage: python tools/coupled_campaign.py [--count 500] [--seed 1] [--jobs 1] [--program asperity]
"""

import argparse
import concurrent.futures
import re
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

import h5py
import numpy as np

LENGTH = 1e-3
MODULUS = 1e6
SPEED = 0.1
TOLERANCE = 1e-6
Pair = tuple[float, float]
SLOPES, SQUARE = (0.05, 0.6), (1.0, 1.0)


def road(rng: np.random.Generator, nx: int, ny: int, dx: float, dy: float, slope: float,
         kind: str) -> np.ndarray:
    """Return periodic heights, m, of shape (ny, nx), with an rms slope."""
    fx, fy = np.fft.fftfreq(nx) * nx, np.fft.fftfreq(ny) * ny
    wx, wy = fx[None, :] / (nx * dx), fy[:, None] / (ny * dy)
    wave = np.hypot(wx, wy)
    shortest = 1 / (rng.choice([5.0, 6.0, 8.0]) * max(dx, dy))
    allowed = (wave > 0) & (wave <= shortest)
    if kind == "self-affine":
        amplitude = np.where(allowed, np.where(allowed, wave, 1.0) ** -1.8, 0.0)
    else:
        chosen = rng.choice(np.flatnonzero(allowed), size=int(rng.integers(1, 4)))
        amplitude = np.zeros((ny, nx))
        amplitude.flat[chosen] = 1 / wave.flat[chosen]
    spectrum = amplitude * np.exp(2j * np.pi * rng.random((ny, nx)))
    height = np.fft.ifft2(spectrum).real
    transformed = np.fft.fft2(height)
    square = sum(np.mean(np.fft.ifft2(2j * np.pi * w * transformed).real ** 2) for w in (wx, wy))
    return height * slope / np.sqrt(square)


def make_case(seed: int, folder: Path, slopes: Pair = SLOPES, ratios: Pair = SQUARE
              ) -> tuple[str, dict[str, Any]]:
    """Return the namelist of a random case, and a description of it in words.

    The rms slope is between the two `slopes`, and the ratio of the sides of a cell, dy/dx, between
    the two `ratios`.
    """
    rng = np.random.default_rng(seed)
    nx = int(rng.choice([24, 32, 40]))
    ny = int(rng.choice([nx, nx // 2, 20]))
    dx = LENGTH / nx
    dy = dx * float(np.exp(np.random.default_rng(seed).uniform(*np.log(ratios))))
    slope, mu = rng.uniform(*slopes), rng.uniform(0.1, 1.0)
    free = rng.random() < 0.25
    kind = str(rng.choice(["self-affine", "few waves"]))
    height = road(rng, nx, ny, dx, dy, slope, kind)
    if free:
        x, y = (np.arange(nx) + 0.5) * dx - nx * dx / 2, (np.arange(ny) + 0.5) * dy - ny * dy / 2
        height = 0.5 * height - (x[None, :] ** 2 / (0.9 * nx * dx)
                                 + y[:, None] ** 2 / (0.9 * ny * dy))
    arms = int(rng.choice([0, 1, 2, 5]))
    thickness = 0.0 if free else float(rng.choice([0, 0.1, 0.5, 2, 10])) * LENGTH
    density = 0.0
    cells = float(rng.choice([0.25, 0.5, 1.0]))
    dt = cells * dx / SPEED
    if thickness > 0 and rng.random() < 0.3:
        period = dt * rng.choice([10.0, 30.0])
        density = 2 * MODULUS * (period / (2 * np.pi * thickness)) ** 2
    law = str(rng.choice(["coulomb", "coulomb", "coulomb", "coulomb", "coulomb_orowan",
                          "constant_shear"]))
    modulus = 4 * MODULUS
    pressure = float(10 ** rng.uniform(-1.5, -0.2)) * modulus * slope
    if free:
        pressure *= 0.1
    angle = rng.choice([0.0, 0.5 * np.pi, rng.uniform(0, 2 * np.pi)])
    adhesive = rng.random() < 0.15
    with h5py.File(folder / "road.h5", "w") as file:
        file["surface"] = height
    tau = dx / SPEED * 10 ** rng.uniform(-0.5, 2.0, size=arms)
    material = f"poisson = 0.5, shear_modulus = {MODULUS:g}, thickness = {thickness:g}"
    if density > 0:
        material += f", density = {density:.6g}"
    if arms:
        material += f"\n prony_g = {arms}*{3 * MODULUS / arms:.6g}, prony_tau = " + ", ".join(
            f"{t:.6g}" for t in tau)
    friction = f"law = '{law}'"
    if law != "constant_shear":
        friction += f", coefficient = {mu:.4f}"
    if law != "coulomb":
        friction += f", shear_strength = {mu * pressure * 3:.6g}"
    if rng.random() < 0.1:
        friction += ", slope_effect = .false."
    text = (f"&grid nx = {nx}, ny = {ny}, lx = {LENGTH:g}, ly = {ny * dy:.9g}, "
            f"boundary = '{'free' if free else 'periodic'}' /\n"
            f"&surface shape = 'file', file = 'road.h5' /\n&material {material} /\n"
            f"&friction {friction} /\n")
    if adhesive:
        reach = 2 * dx * slope
        energy = 0.3 * modulus * reach**2 / dx
        text += (f"&adhesion potential = 'exponential', energy = {energy:.6g}, "
                 f"range = {reach:.6g} /\n")
    text += (f"&phase pressure = {pressure:.6g} /\n"
             f"&phase velocity_x = {SPEED * np.cos(angle):.6g}, "
             f"velocity_y = {SPEED * np.sin(angle):.6g}, duration = {12 * dt:.9g}, steps = 12 /\n"
             f"&phase pressure = {pressure * rng.choice([0.5, 0.8, 1.5]):.6g}, ramp = 'step', "
             f"duration = {2 * dt:.9g}, steps = 2 /\n"
             f"&solver tolerance = {TOLERANCE:g}, threads = 1, interpolation = 'cubic', "
             f"max_iterations = 3000 /\n&output file = 'out.h5' /\n")
    about = dict(seed=seed, n=f"{nx}x{ny}", road=kind, slope=round(slope, 2), mu=round(mu, 2),
                 law=law, h=thickness / LENGTH, arms=arms, mass=density > 0, adhesion=adhesive,
                 boundary="free" if free else "periodic", cells=cells, ratio=round(dy / dx, 2),
                 oblique=angle not in (0.0, 0.5 * np.pi))
    return text, about


def try_case(job: tuple[int, str], slopes: Pair = SLOPES, ratios: Pair = SQUARE) -> dict[str, Any]:
    """Run one case and return how it ended."""
    seed, program = job
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        text, about = make_case(seed, folder, slopes, ratios)
        (folder / "case.nml").write_text(text)
        done = subprocess.run([program, "run", "case.nml", "--quiet"], cwd=folder,
                              capture_output=True, text=True, check=False)
        about["status"], about["message"] = done.returncode, done.stderr.strip()
        about["rows"] = 0
        if (folder / "out.h5").exists():
            with h5py.File(folder / "out.h5") as file:
                history = file["history"]
                about["rows"] = len(history["step"])
                about["ffts"] = float(np.sum(history["ffts"]))
                if "residual_coupling" in history:
                    about["left"] = float(np.max(history["residual_coupling"]))
                if "passes" in history:
                    about["passes"] = history["passes"][2:].tolist()
    settled = done.returncode == 0 and about.get("left", 0.0) <= TOLERANCE
    about["end"] = "settled" if settled else "reported" if done.returncode == 4 else "silent"
    return about


def main() -> int:
    """Run the campaign and print its tables."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--program", default="asperity")
    parser.add_argument("--only", type=int, help="print and run the case of one seed")
    parser.add_argument("--slopes", type=float, nargs=2, default=SLOPES, metavar=("LEAST", "MOST"),
                        help="bounds of the rms slope")
    parser.add_argument("--ratios", type=float, nargs=2, default=SQUARE, metavar=("LEAST", "MOST"),
                        help="bounds of dy/dx")
    given = parser.parse_args()
    drawn = tuple(given.slopes), tuple(given.ratios)
    if given.only is not None:
        with tempfile.TemporaryDirectory() as name:
            print(make_case(given.only, Path(name), *drawn)[0])
        print(try_case((given.only, given.program), *drawn))
        return 0
    jobs = [(given.seed * 100000 + k, given.program) for k in range(given.count)]
    with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool:
        results = list(pool.map(lambda job: try_case(job, *drawn), jobs))
    print(Counter(case["end"] for case in results))
    print("transforms:", sum(case.get("ffts", 0) for case in results))
    for group in ("coulomb", "coulomb_orowan", "constant_shear"):
        part = [case for case in results if case["law"] == group]
        print(f"{group}: {len(part)} cases,", dict(Counter(case["end"] for case in part)))
    counts = [n for case in results for n in case.get("passes", [])]
    if counts:
        print("passes per row: median", np.median(counts), "99 %", np.percentile(counts, 99),
              "most", max(counts))
    for case in results:
        if case["end"] != "settled":
            message = re.sub(r"^.*did not converge", "", case.pop("message"), flags=re.DOTALL)
            case.pop("passes", None)
            print(*(f"{key}={value}" for key, value in case.items()), "|", message[:160])
    return int(any(case["end"] == "silent" for case in results))


if __name__ == "__main__":
    sys.exit(main())
