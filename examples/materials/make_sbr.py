"""Make the model compounds of the examples: sbr.txt and tread.txt. study.py draws them.

    python examples/materials/make_sbr.py    # prints the &material group of sbr.txt, too

The master curve is the empirical law of Havriliak and Negami, written for the modulus, and a slow
tail for the filler; a Prony series of one arm a decade is then fitted to it.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from asperity.material import WLF, Prony

HERE = Path(__file__).resolve().parent


class Law(NamedTuple):
    """Constants of a master curve at the reference temperature."""

    about: str               # what the compound is, in a few words
    transition: float        # s, time of the glass transition
    broad: float             # exponents: G'' ~ w^broad, then w^-(broad steep)
    filler: float            # Pa, what the slow tail adds to the modulus in the end
    filler_exponent: float   # its exponent
    steep: float = 0.42
    filler_time: float = 1.0e-3   # s
    rubbery: float = 1.0e6        # Pa, long-term shear modulus
    glassy: float = 400e6         # Pa, instantaneous shear modulus, without the filler


SBR = Law("a cross-linked, filled styrene-butadiene rubber", 2.5e-8, 0.66, 1.0e6, 0.18)
#: Stiffened by much filler to the moduli at 1 and 32 kHz that the thesis's numbers imply.
TREAD = Law("a tyre tread with much filler, after numbers of the thesis", 7.2e-8, 0.71, 7.6e6, 0.25)
WLF_SBR = WLF(4.57, 113.6, 25.0)           # Ferry (1980), table 11-II, cross-linked SBR, 298 K


def master_curve(omega, law=SBR):
    """Return G* at the reference temperature, Pa; omega in rad/s."""
    transition = 1.0 - (1.0 + (1j * omega * law.transition) ** law.broad) ** -law.steep
    tail = (1j * omega * law.filler_time) ** law.filler_exponent
    return (law.rubbery + (law.glassy - law.rubbery) * transition
            + law.filler * tail / (1.0 + tail))


def compound(law=SBR):
    """Return the Prony series, one arm a decade, with moduli of three digits."""
    omega = np.geomspace(1e-2, 1e12, 141)
    modulus = master_curve(omega, law)
    fit = Prony.fit(omega, modulus.real, modulus.imag, arms_per_decade=1.0, tau_range=(1e-13, 1e3))
    return Prony(float(f"{fit.g_inf:.3g}"), [float(f"{g:.3g}") for g in fit.g],
                 [float(f"{tau:.3g}") for tau in fit.tau])


def read(path):
    """Return the series of a file such as sbr.txt."""
    g, tau = np.loadtxt(path, unpack=True)
    return Prony(g[0], g[1:], tau[1:])


def table(rubber, law=SBR):
    """Return the text of sbr.txt or tread.txt."""
    omega = np.geomspace(1e0, 1e10, 2001)
    exact = master_curve(omega, law)
    peak = np.argmax(exact.imag / exact.real)
    lines = [
        f"Model of {law.about}: a synthetic compound, not a",
        "measured one. Shear relaxation modulus G(t) = G_inf + sum g exp(-t/tau) at 25 C.",
        f"G(0) = {rubber.instantaneous_modulus / 1e6:.0f} MPa; the loss factor of the master curve"
        f" is largest, {exact[peak].imag / exact[peak].real:.2f},",
        f"at {omega[peak] / (2 * np.pi):.1g} Hz.",
        f"WLF: c1 = {WLF_SBR.c1}, c2 = {WLF_SBR.c2} K, reference {WLF_SBR.t_ref:g} C"
        " (J. D. Ferry, Viscoelastic Properties of Polymers,",
        "3rd ed., Wiley 1980, table 11-II). Made by make_sbr.py. The first line is G_inf.",
        "g (Pa)      tau (s)",
    ]
    rows = [f"{rubber.g_inf:<12.3g}inf"]
    rows += [f"{g:<12.3g}{tau:.3g}" for g, tau in zip(rubber.g, rubber.tau, strict=True)]
    return "".join(f"# {line}\n" for line in lines) + "\n".join(rows) + "\n"


if __name__ == "__main__":
    for law, name in ((SBR, "sbr.txt"), (TREAD, "tread.txt")):
        (HERE / name).write_text(table(compound(law), law))
        print((HERE / name).read_text())
    rubber = read(HERE / "sbr.txt")
    print(rubber.to_namelist(temperature=25.0, wlf=WLF_SBR))
