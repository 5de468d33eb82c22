"""Methods that make a map periodic although its opposite edges do not match.

A contact with periodic boundaries needs a map that continues at the opposite edge. A good join
carries the load that belongs to its share of the area, not more and not less.

* ``'seam'`` takes a strip of measured road beyond two edges, and overlaps it with the strip at the
  opposite edges. Of each of the two strips one side of a line is kept. The line runs where their
  heights differ least, with a transition of some cells. All heights are those of the road, so that
  no new summit or valley arises.
* ``'blend'`` fades such a margin into the opposite edges. The squares of the weights add up to 1,
  so that the roughness keeps its rms height. If both parts are high at the same place, as on a road
  with flat tops, the sum rises above the road and carries too much load.
* ``'smooth'`` subtracts the smooth part of the map that contains the jumps between opposite edges
  (periodic-plus-smooth decomposition).
* ``'mirror'`` places mirror images beside the map, which makes it twice as long along each axis.
* ``'window'`` brings the edges to the mean height.

References
----------
L. Moisan, Periodic plus smooth image decomposition, J. Math. Imaging Vis. 39 (2011) 161.
A. A. Efros and W. T. Freeman, Image quilting for texture synthesis and transfer, SIGGRAPH 2001,
for the line of least difference.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..base.check import choice, number
from .windows import map_window

__all__ = ["JOINS", "join", "load_at_join", "margin_of", "smooth_part", "strip"]

FloatArray = NDArray[np.float64]

JOINS = ("seam", "blend", "smooth", "mirror", "window", "none")
MARGIN = 0.125          # share of the length that 'blend' fades into the opposite edge
OVERLAP = 0.25          # share of the length in which 'seam' looks for its line
CHANGE = 3.0            # standard deviation of the transition from one side to the other, cells
STARTS = 64             # number of starting columns that are tried for a closed line
TAPER = 0.2             # share of the length that 'window' tapers


def margin_of(cells: int, method: str) -> int:
    """Return how many cells of real road a join needs beyond a patch, along one axis.

    Parameters
    ----------
    cells : int
        Number of cells of the patch along the axis.
    method : str
        One of `JOINS`.

    Returns
    -------
    int
        Number of cells; 0 for methods without a margin.
    """
    share = {"seam": OVERLAP, "blend": MARGIN}.get(method, 0.0)
    return max(1, round(share * cells)) if share > 0.0 and cells > 1 else 0


def join(height: FloatArray, method: str, shape: tuple[int, int] | None = None) -> FloatArray:
    """Return a periodic map.

    Parameters
    ----------
    height : ndarray, shape (ny, nx)
        Heights, m. For 'seam' and 'blend' they include the margin: the shape is that of the
        periodic map plus `margin_of` along each axis.
    method : str
        One of `JOINS`; 'none' returns the map as it is.
    shape : (int, int), optional
        Cells (ny, nx) of the periodic map, for 'seam' and 'blend'.

    Returns
    -------
    ndarray
        Heights, m. The shape is (ny, nx); (2 ny, 2 nx) for 'mirror' (a profile keeps ny = 1);
        `shape` for 'seam' and 'blend'.

    Raises
    ------
    ValueError
        If the method is unknown, or a margin is missing.

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
        return mean + map_window(height.shape, TAPER) * (height - mean)
    if method in ("seam", "blend"):
        if shape is None:
            raise ValueError(f"shape: {method!r} needs the cells of the periodic map")
        return _overlaid(height, method, shape)
    return height


def smooth_part(height: FloatArray) -> FloatArray:
    """Return the smooth part of a map, which contains the jumps between its opposite edges.

    It solves Poisson's equation with the jumps as the source, and its mean is zero. The map minus
    this part has no jumps, and the same Laplacian as the map inside (Moisan 2011).

    Parameters
    ----------
    height : ndarray, shape (ny, nx)
        Heights, m.

    Returns
    -------
    ndarray, shape (ny, nx)
        Heights, m.
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
    """Return a mask of the cells near an edge.

    Parameters
    ----------
    shape : (int, int)
        Number of cells (ny, nx).
    share : float
        Share of each length that the strips at both edges take together, 0 to 1.

    Returns
    -------
    ndarray of bool, shape (ny, nx)
        True near an edge.

    Raises
    ------
    ValueError
        If the share is not between 0 and 1.
    """
    number("share", share, 0.0, 1.0)
    near = []
    for count in shape:
        place = (np.arange(count) + 0.5) / count
        near.append(np.minimum(place, 1.0 - place) < 0.5 * share if count > 1
                    else np.zeros(1, dtype=bool))
    return near[0][:, None] | near[1]


def load_at_join(pressure: FloatArray, method: str) -> tuple[float, float]:
    """Return the share of the load that the join carries, and its share of the area.

    Parameters
    ----------
    pressure : ndarray, shape (ny, nx)
        Pressure on the periodic map, Pa.
    method : str
        How the map was made periodic. For 'mirror' the middle lines belong to the join, too.

    Returns
    -------
    (float, float)
        Shares of the load and of the area, 0 to 1. They are nearly equal for a good join.
    """
    ny, nx = pressure.shape
    if method == "mirror":
        half = (max(ny // 2, 1), nx // 2)
        near = np.tile(strip(half, MARGIN), (2 if ny > 1 else 1, 2))
    elif method in ("seam", "blend"):
        near = np.zeros(pressure.shape, dtype=bool)
        near[:, : margin_of(nx, method)] = True
        near[: margin_of(ny, method)] = True
    else:
        near = strip(pressure.shape, TAPER if method == "window" else MARGIN)
    return float(pressure[near].sum() / pressure.sum()), float(near.mean())


def _overlaid(height: FloatArray, method: str, shape: tuple[int, int]) -> FloatArray:
    """Lay the margin beyond the far edges over the cells at the near edges, axis by axis."""
    wanted = tuple(count + margin_of(count, method) for count in shape)
    if height.shape != wanted:
        raise ValueError(f"height: has the shape {height.shape}: {method!r} needs {wanted} for a"
                         f" map of {shape}")
    mean = float(height.mean())
    part = height - mean
    for axis, count in enumerate(shape):
        margin = margin_of(count, method)
        if not margin:
            continue
        along = np.moveaxis(part, axis, 1)
        near, beyond = along[:, :margin], along[:, count:]
        if method == "blend":
            angle = 0.5 * math.pi * (np.arange(margin) + 0.5) / margin
            joined = np.sin(angle) * near + np.cos(angle) * beyond
        else:
            # After the first axis has been joined, lines along it are periodic: close the seam.
            weight = _seam(near - beyond, closed=axis == 1)
            joined = beyond + weight * (near - beyond)
        part = np.moveaxis(np.concatenate([joined, along[:, margin:count]], axis=1), 1, axis)
    return mean + part


def _seam(difference: FloatArray, closed: bool) -> FloatArray:
    """Return the weight of the near part: 0 before and 1 beyond the line of least difference.

    Parameters
    ----------
    difference : ndarray, shape (n, margin)
        Difference of the heights of the two parts, m.
    closed : bool
        Whether the last row is next to the first one, so that the line must close.

    Returns
    -------
    ndarray, shape (n, margin)
        Weights, 0 to 1.
    """
    from scipy.ndimage import gaussian_filter

    margin = difference.shape[1]
    change = min(CHANGE, margin / 12.0)
    mode = ("wrap" if closed else "nearest", "nearest")
    cost = gaussian_filter(difference**2, 0.7 * change, mode=mode)
    # The transition from one part to the other has to end within the margin.
    end = min(math.ceil(3.0 * change), (margin - 1) // 2)
    cost[:, :end] = cost[:, margin - end :] = math.inf
    line = _cheapest_line(cost, closed)
    weight = (np.arange(-margin, 2 * margin) > line[:, None]).astype(float)
    return gaussian_filter(weight, change, mode=mode)[:, margin : 2 * margin]


def _cheapest_line(cost: FloatArray, closed: bool) -> NDArray[np.intp]:
    """Return the column in each row of the line of least cost, by dynamic programming.

    From one row to the next the line moves by at most one column.

    Parameters
    ----------
    cost : ndarray, shape (n, m)
        Cost of each cell; infinite where the line must not go.
    closed : bool
        Whether the line has to end in the column in which it began.

    Returns
    -------
    ndarray of int, shape (n,)
        Columns.
    """
    rows, columns = cost.shape
    allowed = np.flatnonzero(np.isfinite(cost[0]))
    starts = allowed
    if closed and allowed.size > STARTS:
        starts = allowed[np.linspace(0, allowed.size - 1, STARTS).round().astype(int)]
    # least[s, c] is the least cost of a line from start s to column c of the current row. An open
    # line may start in any column and needs a single s.
    least = np.full((starts.size if closed else 1, columns), math.inf)
    if closed:
        least[np.arange(starts.size), starts] = cost[0, starts]
    else:
        least[0] = cost[0]
    turns = np.zeros((rows, *least.shape), dtype=np.int8)
    for row in range(1, rows):
        wide = np.pad(least, ((0, 0), (1, 1)), constant_values=math.inf)
        before = np.stack([wide[:, :-2], wide[:, 1:-1], wide[:, 2:]])
        which = before.argmin(axis=0)
        turns[row] = which - 1
        least = np.take_along_axis(before, which[None], axis=0)[0] + cost[row]
    if closed:
        start = int(least[np.arange(starts.size), starts].argmin())
        column = int(starts[start])
    else:
        start, column = 0, int(least[0].argmin())
    line = np.empty(rows, dtype=np.intp)
    for row in range(rows - 1, -1, -1):
        line[row] = column
        column += turns[row, start, column]
    return line
