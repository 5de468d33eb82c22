"""Maps whose opposite edges do not fit, made periodic without a frame that brings its own contact.

A contact with periodic boundaries needs a map that goes on at the opposite edge. Several methods
make one of a measured part; none may carry more load at the join than elsewhere.

* ``'blend'`` takes a margin of real road beyond two edges and fades it into the opposite edges,
  with weights whose squares sum to 1, so that the roughness keeps its size.
* ``'smooth'`` takes off the smooth part that carries the jumps between opposite edges
  (periodic-plus-smooth decomposition).
* ``'mirror'`` puts the map beside its mirror images: twice as long along each axis.
* ``'window'`` brings the edges to the mean height.

References
----------
L. Moisan, Periodic plus smooth image decomposition, J. Math. Imaging Vis. 39 (2011) 161.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..base.check import choice, number

__all__ = ["JOINS", "join", "load_at_join", "margin_of", "smooth_part", "strip"]

FloatArray = NDArray[np.float64]

JOINS = ("blend", "smooth", "mirror", "window", "none")
MARGIN = 0.125          # of the length, that 'blend' fades into the opposite edge
TAPER = 0.2             # of the length, that 'window' tapers


def margin_of(cells: int) -> int:
    """Return how many cells of real road 'blend' needs beyond a patch of so many cells."""
    return max(1, round(MARGIN * cells)) if cells > 1 else 0


def join(height: FloatArray, method: str, shape: tuple[int, int] | None = None) -> FloatArray:
    """Return a periodic map.

    Parameters
    ----------
    height : ndarray, shape (ny, nx)
        Heights, m. For 'blend' with its margin: the shape is that of the periodic map plus
        `margin_of` along each axis.
    method : str
        One of `JOINS`; 'none' returns the map as it is.
    shape : (int, int), optional
        Cells (ny, nx) of the periodic map, for 'blend'.

    Returns
    -------
    ndarray
        Heights, m: shape (ny, nx), for 'mirror' (2 ny, 2 nx) (a profile stays one), for 'blend'
        `shape`.

    Raises
    ------
    ValueError
        If the method is unknown, or 'blend' lacks its margin.

    Examples
    --------
    >>> ramp = np.linspace(0.0, 1.0, 8)[None, :]
    >>> join(ramp, "mirror").shape
    (1, 16)
    >>> float(np.ptp(join(ramp, "smooth"))) < 0.2
    True
    """
    choice("method", method, JOINS)
    if method == "smooth":
        return height - smooth_part(height)
    if method == "mirror":
        wide = np.concatenate([height, height[:, ::-1]], axis=1)
        return wide if height.shape[0] == 1 else np.concatenate([wide, wide[::-1]], axis=0)
    if method == "window":
        mean = float(height.mean())
        ny, nx = height.shape
        rows = np.ones(1) if ny == 1 else _taper(ny)
        return mean + rows[:, None] * _taper(nx) * (height - mean)
    if method == "blend":
        if shape is None:
            raise ValueError("shape: 'blend' needs the cells of the periodic map")
        return _blend(height, shape)
    return height


def smooth_part(height: FloatArray) -> FloatArray:
    """Return the smooth part of a map, which carries the jumps between its opposite edges.

    It solves Poisson's equation whose source are the jumps; its mean is zero. What is left when it
    is taken off has the Laplacian of the map inside and no jumps.

    Parameters
    ----------
    height : ndarray, shape (ny, nx)
        Heights, m.

    Returns
    -------
    ndarray, shape (ny, nx)
        m.
    """
    ny, nx = height.shape
    jumps = np.zeros_like(height)
    if ny > 1:
        jumps[0] += height[-1] - height[0]
        jumps[-1] += height[0] - height[-1]
    jumps[:, 0] += height[:, -1] - height[:, 0]
    jumps[:, -1] += height[:, 0] - height[:, -1]
    along_x = 2.0 * np.cos(2.0 * math.pi * np.fft.rfftfreq(nx)) - 2.0
    along_y = 2.0 * np.cos(2.0 * math.pi * np.fft.fftfreq(ny)) - 2.0
    laplacian = along_y[:, None] + along_x
    laplacian[0, 0] = 1.0
    spectrum = np.fft.rfft2(jumps) / laplacian
    spectrum[0, 0] = 0.0
    return np.fft.irfft2(spectrum, s=height.shape)


def strip(shape: tuple[int, int], share: float) -> NDArray[np.bool_]:
    """Return which cells lie near an edge: within half of a share of the length, at each edge.

    Parameters
    ----------
    shape : (int, int)
        Cells (ny, nx).
    share : float
        Of each length, 0 to 1.
    """
    number("share", share, 0.0, 1.0)
    near = []
    for count in shape:
        place = (np.arange(count) + 0.5) / count
        near.append(np.minimum(place, 1.0 - place) < 0.5 * share if count > 1
                    else np.zeros(1, dtype=bool))
    return near[0][:, None] | near[1]


def load_at_join(pressure: FloatArray, method: str) -> tuple[float, float]:
    """Return which share of the load lies at the join, and which share of the area that is.

    Parameters
    ----------
    pressure : ndarray, shape (ny, nx)
        Pressure on the periodic map, Pa.
    method : str
        How the map was made periodic. For 'mirror' the middle lines count, too.

    Returns
    -------
    (float, float)
        Shares of the load and of the area, 0 to 1. A join that brings no contact of its own has
        nearly equal shares.
    """
    ny, nx = pressure.shape
    if method == "mirror":
        half = (max(ny // 2, 1), nx // 2)
        near = np.tile(strip(half, MARGIN), (2 if ny > 1 else 1, 2))
    elif method == "blend":
        near = np.zeros(pressure.shape, dtype=bool)
        near[:, : margin_of(nx)] = True
        if ny > 1:
            near[: margin_of(ny)] = True
    else:
        near = strip(pressure.shape, TAPER if method == "window" else MARGIN)
    return float(pressure[near].sum() / pressure.sum()), float(near.mean())


def _taper(count: int) -> FloatArray:
    """Return a window with cosine flanks at the centres of cells."""
    place = (np.arange(count) + 0.5) / count
    ramp = np.clip(2.0 * np.minimum(place, 1.0 - place) / TAPER, 0.0, 1.0)
    return 0.5 * (1.0 - np.cos(math.pi * ramp))


def _blend(height: FloatArray, shape: tuple[int, int]) -> FloatArray:
    """Fade what lies beyond the far edges into the near ones."""
    wanted = tuple(count + margin_of(count) for count in shape)
    if height.shape != wanted:
        raise ValueError(f"height: has the shape {height.shape}: 'blend' needs {wanted} for a map"
                         f" of {shape}")
    mean = float(height.mean())
    part = height - mean
    for axis, count in enumerate(shape):
        margin = margin_of(count)
        if not margin:
            continue
        angle = 0.5 * math.pi * (np.arange(margin) + 0.5) / margin
        turn = np.sin(angle) if axis else np.sin(angle)[:, None]
        fade = np.cos(angle) if axis else np.cos(angle)[:, None]
        near, beyond = ((part[:, :margin], part[:, count:]) if axis else
                        (part[:margin], part[count:]))
        joined = turn * near + fade * beyond
        part = (np.concatenate([joined, part[:, margin:count]], axis=1) if axis else
                np.concatenate([joined, part[margin:count]], axis=0))
    return mean + part
