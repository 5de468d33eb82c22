"""Model compounds.

The study compares the Prony series of sbr.txt and tread.txt with the master curves to which
make_sbr.py fits them.
"""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import common
import numpy as np

MINUTES = 0.1

HERE = Path(__file__).parent
MAKER = runpy.run_path(str(HERE / "make_sbr.py"))
LAWS = {"sbr": MAKER["SBR"], "tread": MAKER["TREAD"]}
TEMPERATURES = (60.0, 25.0, 0.0, -20.0)
#: Values that follow from numbers in the thesis (section 4.5.1): frequency, Hz, and storage
#: modulus, Pa.
IMPLIED = {1e3: 6.0e6, 32e3: 10.9e6}


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Return moduli (Pa) and loss factors over the frequency (rad/s), and the series."""
    omega = np.geomspace(1e-2, 1e12, 561)
    data: dict[str, Any] = {"omega": omega}
    for name, law in LAWS.items():
        rubber, made = MAKER["read"](HERE / f"{name}.txt"), MAKER["compound"](law)
        exact, fitted = MAKER["master_curve"](omega, law), rubber.complex_modulus(omega)
        loss = exact.imag / exact.real
        data[name] = {
            "arms": len(rubber.g), "rubbery": rubber.g_inf,
            "glassy": rubber.instantaneous_modulus, "largest_loss_factor": loss.max(),
            "its_frequency_hz": omega[loss.argmax()] / (2 * np.pi),
            "implied": rubber.complex_modulus(2 * np.pi * np.array(list(IMPLIED))).real,
            "g": rubber.g, "tau": rubber.tau, "made_g": made.g, "made_tau": made.tau,
            "storage": fitted.real, "loss": fitted.imag,
            "storage_curve": exact.real, "loss_curve": exact.imag}
    sbr = MAKER["read"](HERE / "sbr.txt")
    data["tan_delta"] = {f"{t:g}": sbr.shifted(t, MAKER["WLF_SBR"]).tan_delta(omega)
                         for t in TEMPERATURES}
    return data


def check(data: dict[str, Any], quick: bool) -> None:
    """Check the series against the master curves, and the files against the script."""
    omega = data["omega"]
    middle = (omega >= 1.0) & (omega <= 1e10)
    # With one arm per decade the moduli oscillate around a smooth curve, more so in a steep
    # transition.
    for name, ripples in (("sbr", (0.09, 0.12)), ("tread", (0.11, 0.15))):
        one = data[name]
        # The numbers of the files have three digits, and the last digit of the fit may differ.
        np.testing.assert_allclose(one["made_g"], one["g"], rtol=0.02)
        np.testing.assert_allclose(one["made_tau"], one["tau"], rtol=1e-12)
        for part, ripple in zip(("storage", "loss"), ripples, strict=True):
            error = np.abs(one[part] / one[f"{part}_curve"] - 1)[middle].max()
            assert error < ripple, f"{name}, {part}: {error:.1%} off the master curve"
        assert 15 <= one["arms"] <= 20
        assert 0.8e6 < one["rubbery"] < 1.7e6 and 300e6 < one["glassy"] < 500e6
        assert 1e5 < one["its_frequency_hz"] < 5e5, "the loss factor must be largest near 3e5 Hz"
    np.testing.assert_allclose(data["tread"]["implied"], list(IMPLIED.values()), rtol=0.015)
    # Colder rubber relaxes more slowly: the peak moves to lower frequencies.
    peaks = [omega[np.argmax(data["tan_delta"][f"{t:g}"])] for t in TEMPERATURES]
    assert (np.diff(peaks) < 0).all()


def picture(data: dict[str, Any]) -> Any:
    """Draw moduli and loss factors over the frequency."""
    figure, (left, middle, right) = common.subplots(3, width=4.6, height=4.2)
    omega, sbr = data["omega"], data["sbr"]
    for name, label in (("storage", "storage modulus G'"), ("loss", "loss modulus G''")):
        left.loglog(omega, sbr[name] / 1e6, label=label)
        left.loglog(omega, sbr[f"{name}_curve"] / 1e6, "k:")
    left.plot([], [], "k:", label="master curve")
    left.set(title="sbr, 25 °C", ylabel="modulus, MPa")
    for temperature in TEMPERATURES:
        middle.semilogx(omega, data["tan_delta"][f"{temperature:g}"],
                        label=f"{temperature:g} °C")
    middle.semilogx(omega, sbr["loss_curve"] / sbr["storage_curve"], "k:", label="master curve")
    middle.set(title="sbr", ylabel="loss factor tan δ", ylim=(0, 1.75))
    for name, style in (("tread", "-"), ("sbr", "--")):
        right.loglog(omega, data[name]["storage"] / 1e6, style, label=f"{name}, G'")
        right.loglog(omega, data[name]["loss"] / 1e6, style, label=f"{name}, G''")
    right.plot(2 * np.pi * np.array(list(IMPLIED)), np.array(list(IMPLIED.values())) / 1e6, "ko",
               mfc="none", label="implied by the thesis")
    right.set(title="both, 25 °C", ylabel="modulus, MPa")
    for axes in (left, middle, right):
        axes.set(xlabel="angular frequency ω, rad/s", xlim=(omega[0], omega[-1]))
        axes.legend(ncols=2 if axes is middle else 1)
    return figure
