#!/usr/bin/env python3
"""Count the transforms of steady sliding over six decades of speed and print a table.

    . tools/setup.sh && . tools/install_editable.sh
    python tools/bench/steady.py [--cells 128] [--speeds 7] [--laws none flat slope] [--cold]
    python tools/bench/steady.py --cells 256 --speeds 25 --laws none flat --only 12,1000,1

A rough road of rms slope 0.3 with waves down to four cells slides under a rubber with one or
twelve arms that soften it by 10 or 1000. Each line is a curve: for each speed the transforms of its
row and the contact area; ! marks a row that did not converge, which ends the curve. By default each
row starts from those before it; with --cold each is a run of its own. At the end of the line: all
transforms, and the seconds of processor time.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import warnings
from pathlib import Path

import numpy as np

import asperity

LAWS = {
    "none": "",
    "flat": "&friction law = 'coulomb', coefficient = {mu}, slope_effect = .false. /",
    "slope": "&friction law = 'coulomb', coefficient = {mu} /",
    "shear": "&friction law = 'constant_shear', shear_strength = 1e5 /",
}


def case(cells: int, arms: int, ratio: float, pressure: float, law: str, speeds: np.ndarray) -> str:
    """Return the input of a curve; cells of 1 mm."""
    tau = 10.0 ** -np.linspace(0, 6, arms)
    steps = ratio ** (np.arange(arms + 1) / arms)
    moduli = 1e6 * np.diff(steps)
    phases = [
        f"&phase steady = .true., {f'pressure = {pressure},' if k == 0 else ''} velocity_x = {v} /"
        for k, v in enumerate(speeds)
    ]
    return "\n".join(
        [
            f"&grid nx = {cells}, ny = {cells}, lx = {cells * 1e-3} /",
            f"&surface shape = 'self_affine', hurst = 0.8, wavelength_long = {cells * 0.5e-3},"
            " wavelength_short = 4e-3, rms_slope = 0.3, seed = 1 /",
            f"&material shear_modulus = 1e6, prony_g = {', '.join(map(repr, moduli.tolist()))},"
            f" prony_tau = {', '.join(map(repr, tau.tolist()))} /",
            law,
            *phases,
        ]
    )


def seconds() -> float:
    """Return the processor time of this process so far."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def count(folder: Path, text: str) -> tuple[list[int], list[float], bool]:
    """Return transforms and contact area of the rows, and whether all converged."""
    path = folder / "case.nml"
    path.write_text(text)
    converged = True
    try:
        run = asperity.run(path, overwrite=True)     # an earlier run may have ended unfinished
    except asperity.NotConverged:
        run = asperity.open(path.with_suffix(".h5"))
        converged = False
    history = run.history
    return history["ffts"].astype(int).tolist(), history["contact_area"].tolist(), converged


def main() -> None:
    """Count and print."""
    warnings.simplefilter("ignore", UserWarning)       # some contacts have patches of few cells
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", type=int, default=128, help="cells along a side")
    parser.add_argument("--speeds", type=int, default=7, help="speeds of a curve")
    parser.add_argument("--laws", nargs="+", default=["none", "flat", "slope"], choices=LAWS)
    parser.add_argument("--coefficient", type=float, default=0.5)
    parser.add_argument("--cold", action="store_true", help="every row on its own")
    parser.add_argument("--only", metavar="ARMS,RATIO,P", help="one of the curves, as 12,1000,0.1")
    chosen = parser.parse_args()

    print("law, arms, ratio, p/G: transforms (area) ...; ! not converged")
    for law in chosen.laws:
        for arms, ratio, pressure, low, high in (
            (1, 10, 0.1, -7, -1),
            (1, 10, 1, -7, -1),
            (1, 1000, 0.1, -9, -5),
            (1, 1000, 1, -9, -5),
            (12, 10, 1, -5, 1),
            (12, 1000, 0.1, -5, 1),
            (12, 1000, 1, -5, 1),
        ):
            if chosen.only not in (None, f"{arms},{ratio},{pressure}"):
                continue
            begun = seconds()
            speeds = np.logspace(low, high, chosen.speeds)
            told, total = [], 0
            with tempfile.TemporaryDirectory() as folder:
                for part in [[v] for v in speeds] if chosen.cold else [speeds]:
                    ffts, area, good = count(
                        Path(folder),
                        case(
                            chosen.cells,
                            arms,
                            ratio,
                            pressure * 1e6,
                            LAWS[law].format(mu=chosen.coefficient),
                            np.asarray(part),
                        ),
                    )
                    total += sum(ffts)
                    told += [f"{n} ({a:.3f})" for n, a in zip(ffts, area, strict=True)]
                    told[-1] += "" if good else "!"
            print(
                f"{law}, {arms}, {ratio}, {pressure}: {' '.join(told)}; {total} in all,"
                f" {seconds() - begun:.1f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
