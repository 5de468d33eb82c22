"""Dynamic mechanical analysis: tables of storage and loss moduli, brought to a Prony series.

A table is a CSV file with a header that names its columns and their units; what the header leaves
open can be said in the call. Several temperatures become one master curve by time-temperature
superposition: with WLF constants that are given, or with shifts found from the overlap. Users
import this module as ``asperity.dma``.
"""

from __future__ import annotations

from .dma_fit import DmaFit, fit_dma
from .dma_table import DmaTable, read_dma

__all__ = ["DmaFit", "DmaTable", "fit_dma", "read_dma"]
