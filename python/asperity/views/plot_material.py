"""Pictures of materials: moduli against the frequency, and fits with their data."""

from __future__ import annotations

from contextlib import nullcontext
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.check import array_of
from .style import COLOURS, SINGLE_COLUMN, print_style, shown_once

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..rubber.dma import DmaFit
    from ..rubber.material import Prony

__all__ = ["plot_dma_fit", "plot_prony"]

_LEGEND_ABOVE: dict[str, Any] = {
    "loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "ncols": 2, "frameon": False,
    "columnspacing": 1.2, "handlelength": 1.6,
}


def plot_prony(material: Prony, ax: Axes | None = None, omega: ArrayLike | None = None) -> Axes:
    """Draw G', G'' and tan delta against the frequency, and the arms at 1/tau.

    Parameters
    ----------
    material : Prony
        The material.
    ax : matplotlib Axes, optional
        Axes to draw into; a new figure by default.
    omega : array_like, optional
        Angular frequencies, rad/s; by default they extend two decades beyond the arms.

    Returns
    -------
    matplotlib Axes
        The axes of the moduli. The axis of tan delta is on the right.
    """
    if omega is None:
        ends = (1.0, 1.0) if not material.tau.size else (material.tau.max(), material.tau.min())
        frequency = np.geomspace(1e-2 / ends[0], 1e2 / ends[1], 400)
    else:
        frequency = array_of("omega", omega, low=0.0, low_open=True, ndim=1)
    with print_style() if ax is None else nullcontext():
        if ax is None:
            _, ax = plt.subplots(figsize=(SINGLE_COLUMN, 2.7), layout="constrained")
        _draw_prony(material, frequency, ax)
    return ax


def _draw_prony(material: Prony, frequency: NDArray[np.float64], ax: Axes) -> None:
    """Draw the moduli, the arms and tan delta into axes."""
    modulus = material.complex_modulus(frequency)
    lines = ax.loglog(frequency, modulus.real, color=COLOURS[0], label="storage modulus $G'$")
    if material.tau.size:
        lines += ax.loglog(frequency, modulus.imag, color=COLOURS[1], label="loss modulus $G''$")
        lines += ax.loglog(1.0 / material.tau, material.g, "x", color=COLOURS[6], markersize=4,
                           label=r"arms $(1/\tau_k, g_k)$")
        twin = ax.twinx()
        lines += twin.semilogx(frequency, modulus.imag / modulus.real, "--", color=COLOURS[2],
                               label=r"loss factor $\tan\delta$")
        twin.set_ylabel(r"loss factor $\tan\delta$")
        twin.set_ylim(bottom=0.0)
        low = 0.3 * min(material.g[material.g > 0].min(initial=np.inf), modulus.real.min())
        ax.set_ylim(low, 2.0 * max(modulus.real.max(), material.g.max()))
    ax.set_xlim(frequency[0], frequency[-1])
    ax.set_xlabel(r"angular frequency $\omega$ (rad/s)")
    ax.set_ylabel("shear modulus (Pa)")
    ax.grid(alpha=0.3)
    ax.legend(lines, [str(line.get_label()) for line in lines], **_LEGEND_ABOVE)


def plot_dma_fit(fit: DmaFit) -> Figure:
    """Draw the data and the fit, tan delta, and the errors of the fit.

    Parameters
    ----------
    fit : DmaFit
        The fit.

    Returns
    -------
    matplotlib Figure
    """
    figure, (top, middle, bottom) = plt.subplots(
        3, 1, figsize=(6.4, 7.6), sharex=True, layout="constrained",
        gridspec_kw={"height_ratios": [3, 2, 1.6]})
    low, high = fit.valid_range
    fine = np.geomspace(low / 10.0, high * 10.0, 600)
    modulus = fit.material.complex_modulus(fine)
    inside = (fine >= low) & (fine <= high)
    found = fit.material.complex_modulus(fit.omega)
    names = ("storage modulus $G'$", "loss modulus $G''$", r"loss factor $\tan\delta$")
    curves = (modulus.real, modulus.imag, modulus.imag / modulus.real)
    data = (fit.storage, fit.loss, fit.loss / fit.storage)
    fitted = (found.real, found.imag, found.imag / found.real)
    for k, (name, curve, points, values) in enumerate(
            zip(names, curves, data, fitted, strict=True)):
        axes, colour, marker = (top, top, middle)[k], COLOURS[k], "os^"[k]
        axes.loglog(fit.omega, points, marker, color=colour, markersize=4, alpha=0.6,
                    markeredgewidth=0, label=f"{name}: data")
        axes.loglog(fine, curve, "--", color=colour, linewidth=0.8)
        axes.loglog(fine[inside], curve[inside], "-", color=colour, label="fit")
        bottom.semilogx(fit.omega, np.log10(values / points), marker, color=colour, markersize=3.5,
                        alpha=0.8, markeredgewidth=0)
    material = fit.material
    top.loglog(1.0 / material.tau, material.g, "x", color=COLOURS[6], markersize=5,
               label=r"arms $(1/\tau_k, g_k)$")
    visible = material.g[(1.0 / material.tau >= fine[0]) & (1.0 / material.tau <= fine[-1])]
    least = min(float(fit.loss.min()), float(visible.min(initial=np.inf)))
    most = max(float(part.max(initial=0.0))
               for part in (modulus.real, visible, fit.storage, fit.loss))
    top.set_ylim(max(0.4 * least, 1e-3 * float(fit.loss.min())), 2.5 * most)
    top.set_xlim(fine[0], fine[-1])
    for axes in (top, middle):
        axes.axvspan(fine[0], low, color="0.93", zorder=0)
        axes.axvspan(high, fine[-1], color="0.93", zorder=0)
    bottom.axvspan(fine[0], low, color="0.93", zorder=0)
    bottom.axvspan(high, fine[-1], color="0.93", zorder=0)
    bottom.axhline(0.0, color="0.5", linewidth=0.8)
    reach = max(1.2 * fit.largest_error, 1e-3)
    spread = float(np.abs(np.log10(fitted[2] / data[2])).max())
    bottom.set_ylim(-max(reach, 1.2 * spread), max(reach, 1.2 * spread))
    top.set_ylabel("shear modulus (Pa)")
    middle.set_ylabel(r"loss factor $\tan\delta$")
    bottom.set_ylabel(r"$\log_{10}$(fit/data)")
    at = "" if fit.reference is None else f" at {fit.reference:g} °C"
    bottom.set_xlabel(rf"angular frequency $\omega${at} (rad/s)")
    bottom.set_title(
        f"rms: $G'$ {fit.error_storage:.3f}, $G''$ {fit.error_loss:.3f},"
        rf" $\tan\delta$ {fit.error_tan_delta:.3f} (grey: beyond the data)", fontsize=9)
    top.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, frameon=False, fontsize=8)
    middle.legend(frameon=False, fontsize=8)
    return shown_once(figure)
