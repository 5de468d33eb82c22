"""Linear viscoelastic materials: Prony series, Zener branches, WLF shift, fit to DMA data.

A material is the shear relaxation modulus ::

    G(t) = g_inf + sum_k g_k exp(-t/tau_k)

with `tau_k` the *relaxation* times. SI units throughout: Pa, s, rad/s. Users import this module as
``asperity.material``.
"""

from __future__ import annotations

from .master_curve import MasterCurve, master_curve
from .prony import FitErrors, Prony
from .wlf import WLF

__all__ = ["WLF", "FitErrors", "MasterCurve", "Prony", "master_curve"]
