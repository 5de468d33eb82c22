"""Make the model compound of the examples: sbr.txt and its frequency sweep, picture.png.

    python examples/materials/make_sbr.py

The master curve is the empirical law of Havriliak and Negami, written for the modulus, and a slow
tail for the filler; a Prony series of one arm a decade is then fitted to it.
"""

from pathlib import Path

import numpy as np

from asperity.material import WLF, Prony

HERE = Path(__file__).resolve().parent
RUBBERY, GLASSY = 1.0e6, 400e6             # Pa, long-term and instantaneous shear modulus
BROAD, STEEP = 0.66, 0.42                  # exponents: G'' ~ w^BROAD, then w^-(BROAD STEEP)
TRANSITION = 2.5e-8                        # s, time of the glass transition at the reference
FILLER, FILLER_EXPONENT, FILLER_TIME = 1.0e6, 0.18, 1.0e-3   # Pa, -, s: the slow tail
WLF_SBR = WLF(4.57, 113.6, 25.0)           # Ferry (1980), table 11-II, cross-linked SBR, 298 K


def master_curve(omega):
    """Return G* at the reference temperature, Pa; omega in rad/s."""
    transition = 1.0 - (1.0 + (1j * omega * TRANSITION) ** BROAD) ** -STEEP
    tail = (1j * omega * FILLER_TIME) ** FILLER_EXPONENT
    return RUBBERY + (GLASSY - RUBBERY) * transition + FILLER * tail / (1.0 + tail)


def compound():
    """Return the Prony series, one arm a decade, with moduli of three digits."""
    omega = np.geomspace(1e-2, 1e12, 141)
    modulus = master_curve(omega)
    fit = Prony.fit(omega, modulus.real, modulus.imag, arms_per_decade=1.0, tau_range=(1e-13, 1e3))
    return Prony(float(f"{fit.g_inf:.3g}"), [float(f"{g:.3g}") for g in fit.g],
                 [float(f"{tau:.3g}") for tau in fit.tau])


def read(path):
    """Return the series of a file such as sbr.txt."""
    g, tau = np.loadtxt(path, unpack=True)
    return Prony(g[0], g[1:], tau[1:])


def table(rubber):
    """Return the text of sbr.txt."""
    omega = np.geomspace(1e0, 1e10, 2001)
    exact = master_curve(omega)
    peak = np.argmax(exact.imag / exact.real)
    lines = [
        "Model of a cross-linked, filled styrene-butadiene rubber: a synthetic compound, not a",
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


def draw(rubber, path):
    """Draw the sweep of the series at two temperatures beside the master curve."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    omega = np.geomspace(1e-2, 1e12, 400)
    figure, (left, right) = plt.subplots(1, 2, figsize=(11.0, 4.4), layout="constrained")
    rubber.plot(left, omega)
    exact = master_curve(omega)
    for number, temperature in enumerate((60.0, 25.0, 0.0, -20.0)):
        warm = rubber.shifted(temperature, WLF_SBR)
        right.semilogx(omega, warm.tan_delta(omega), color=f"C{number}",
                       label=f"{temperature:g} °C")
    right.semilogx(omega, exact.imag / exact.real, "k:", label="25 °C, master curve")
    right.set_xlabel(r"angular frequency $\omega$ (rad/s)")
    right.set_ylabel(r"loss factor $\tan\delta$ (-)")
    right.set_xlim(omega[0], omega[-1])
    right.set_ylim(bottom=0.0)
    right.grid(alpha=0.3)
    right.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=5, frameon=False,
                 columnspacing=1.0, handlelength=1.4, fontsize="small")
    figure.savefig(path, dpi=110)
    plt.close(figure)


if __name__ == "__main__":
    rubber = compound()
    (HERE / "sbr.txt").write_text(table(rubber))
    draw(read(HERE / "sbr.txt"), HERE / "picture.png")
    print((HERE / "sbr.txt").read_text())
    print(rubber.to_namelist(temperature=25.0, wlf=WLF_SBR))
