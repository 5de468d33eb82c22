"""Where a steady state loses its energy: by octave of the wavelength and by arm of the material."""

from __future__ import annotations

from typing import NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from .reading import read_file
from .result_file import ResultFile

__all__ = ["Losses", "losses_of"]

FloatArray = NDArray[np.float64]


class Losses(NamedTuple):
    """Rates of loss in the rubber over the cell, one row for each row of the history.

    Attributes
    ----------
    octave : ndarray, shape (octaves,)
        Longest wavelength of each octave, m.
    by_octave : ndarray, shape (rows, octaves)
        W.
    by_arm : ndarray, shape (rows, arms)
        W; the arms are those of the material's Prony series.
    """

    octave: FloatArray
    by_octave: FloatArray
    by_arm: FloatArray


def losses_of(run: ResultFile) -> Losses | None:
    """Return the losses of a run with steady phases, None of any other one.

    Parameters
    ----------
    run : ResultFile
        The result.
    """
    def read(file: h5py.File) -> Losses | None:
        group = file.get("losses")
        if group is None:
            return None
        return Losses(group["octave"][()], group["by_octave"][()], group["by_arm"][()])

    return read_file(run.path, read)
