"""Patches of roads: parts of measured maps that are made periodic, or maps drawn from a spectrum.

A patch is the road of one run. The scatter of the friction between several patches gives its
confidence interval. The same settings and the same seed give the same bits.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..base.check import choice, positive, whole
from .joins import JOINS, join, margin_of
from .measured import MeasuredSurface, step_in_words
from .outliers import find_outliers
from .spectra import Spectrum, join_spectra, name_of_several, spectrum_of_map

__all__ = ["DrawnRoad", "MeasuredRoad", "Patch", "low_pass", "rested"]

FloatArray = NDArray[np.float64]

_CELLS_IN_DRAWN_WAVE = 8.0      # in the shortest wave of a drawn map
_CELLS_IN_MEASURED_WAVE = 6.0   # in the shortest wave of a measured map
_DIRECTED = 1.5                 # ratio of the rms slopes along x and y above which a note is given


@dataclass(frozen=True)
class Patch:
    """A periodic map that is the road of a run.

    Attributes
    ----------
    height : ndarray, shape (ny, nx)
        Heights, m; their mean is zero.
    lx, ly : float
        Lengths, m.
    label : str
        Origin of the patch, for people.
    """

    height: FloatArray = field(repr=False)
    lx: float
    ly: float
    label: str

    @property
    def code(self) -> str:
        """Checksum of the heights and the lengths, 12 hexadecimal digits."""
        found = hashlib.sha256(np.ascontiguousarray(self.height).tobytes())
        found.update(repr((self.height.shape, self.lx, self.ly)).encode())
        return found.hexdigest()[:12]

    def save(self, folder: Path) -> Path:
        """Write the map to a folder, unless it is already there. A damaged file is replaced.

        Parameters
        ----------
        folder : Path
            Folder of the file ``patch-CODE.h5``.

        Returns
        -------
        Path
            The file.
        """
        path = folder / f"patch-{self.code}.h5"
        if path.exists() and not self._is_in(path):
            path.unlink(missing_ok=True)  # another process may have done so
        if not path.exists():
            surface = MeasuredSurface(
                self.height, self.lx, self.ly, True, "m",
                source={"name": self.label, "format": "patch", "metadata": {}})
            surface.save(path)
        return path

    def _is_in(self, path: Path) -> bool:
        """Return whether a file holds the heights."""
        import h5py

        try:
            with h5py.File(path, "r", locking=False) as file:
                return np.array_equal(file["surface/height"], self.height)
        except (OSError, KeyError):
            return False


def have_equal_heights(one: MeasuredSurface, other: MeasuredSurface) -> bool:
    """Return whether two maps have the same heights, apart from the round-off of other units."""
    if one.height.shape != other.height.shape:
        return False
    return np.allclose(one.height, other.height, rtol=0.0, atol=1e-6 * float(np.std(one.height)))


def low_pass(height: FloatArray, lx: float, ly: float, short: float) -> FloatArray:
    """Return a periodic map without the waves below a length.

    Parameters
    ----------
    height : ndarray, shape (ny, nx)
        Heights, m.
    lx, ly : float
        Lengths, m.
    short : float
        Shortest wave that is kept, m.

    Returns
    -------
    ndarray, shape (ny, nx)
        Heights, m.
    """
    ny, nx = height.shape
    kx = np.fft.rfftfreq(nx, lx / nx)
    ky = np.fft.fftfreq(ny, ly / ny)
    modes = np.fft.rfft2(height)
    modes[np.hypot(kx, ky[:, None]) > (1.0 + 1e-9) / short] = 0.0
    return np.fft.irfft2(modes, s=height.shape)


def rested(height: FloatArray, weight: float = 0.98) -> FloatArray:
    """Return a map without the tilt of the plane that rests on its tops.

    The plane is a weighted least squares fit. Heights above it have the weight `weight`, those
    below it 1 - `weight`. A block that is pressed onto the road rests on the tops. The mean plane
    of a patch, in contrast, depends on valleys that nothing touches, and would tilt level tops.

    Parameters
    ----------
    height : ndarray, shape (ny, nx)
        Heights, m.
    weight : float
        0.5 gives the mean plane; 1 would be a plane above all heights.

    Returns
    -------
    ndarray, shape (ny, nx)
        Heights, m; their mean is zero.

    Examples
    --------
    >>> tops = np.where(np.arange(64) % 8 < 4, 0.0, -np.arange(64.0))[None, :]
    >>> bool(np.ptp(rested(tops)[0, ::8]) < 0.05 * 56)
    True
    """
    ny, nx = height.shape
    height = height - height.mean()
    planes = np.stack(np.broadcast_arrays(1.0, np.linspace(-1.0, 1.0, nx),
                                          np.linspace(-1.0, 1.0, ny)[:, None])).reshape(3, -1)
    planes = planes if ny > 1 else planes[:2]
    flat = height.ravel()
    above = np.ones(flat.size, dtype=bool)
    for _ in range(50):
        weights = np.where(above, weight, 1.0 - weight)
        plane = np.linalg.solve((planes * weights) @ planes.T, (planes * weights) @ flat)
        last, above = above, flat > plane @ planes
        if (last == above).all():
            break
    tilted = flat - plane[1:] @ planes[1:]
    return (tilted - tilted.mean()).reshape(ny, nx)


def cleaned(one: MeasuredSurface, outliers: str) -> tuple[MeasuredSurface, list[str]]:
    """Return a map, without its outliers if they shall be removed, and notes on what was found.

    Parameters
    ----------
    one : MeasuredSurface
        A map or a profile.
    outliers : str
        'report' or 'remove'.

    Returns
    -------
    (MeasuredSurface, list of str)

    Raises
    ------
    ValueError
        If `outliers` is neither.
    """
    choice("outliers", outliers, ("report", "remove"))
    name = one.source.get("name", "map")
    notes = [f"{name}: {step_in_words(step)}" for step in one.steps if step["step"] == "fill"]
    notes += [f"{name}: {note}" for note in _direction_note(one)]
    found = find_outliers(one.height)
    if not found.count:
        return one, notes
    if outliers == "report":
        return one, [*notes, f"{name}: {found.summary()}: if they are errors of the measurement,"
                             " they may change slopes and friction strongly; `outliers = 'remove'`"
                             " (--outliers remove) puts the median of the neighbours there"]
    notes.append(f"{name}: {found.summary()}: replaced by the median of the neighbours")
    return MeasuredSurface(found.mended, one.lx, one.ly, one.periodic, one.unit, one.steps,
                           one.source, one.notes), notes


def _direction_note(one: MeasuredSurface) -> list[str]:
    """Return a note on a map whose slopes differ along its two axes."""
    ny, nx = one.height.shape
    if ny == 1:
        return []
    slopes = [float(np.sqrt(np.mean(np.diff(one.height, axis=axis) ** 2))) / step
              for axis, step in ((1, one.lx / nx), (0, one.ly / ny))]
    if max(slopes) <= _DIRECTED * min(slopes):
        return []
    return [f"the rms slope is {slopes[0]:.2g} along x and {slopes[1]:.2g} along y: the friction"
            " depends on the direction of sliding (angle, --angle), but Persson's theory and drawn"
            " maps take the road for isotropic"]


def _check_short(short: float, cell: float, side: float) -> None:
    """Refuse a shortest wave that cells cannot represent, or that leaves a patch flat."""
    if short < (2.0 - 1e-9) * cell:
        raise ValueError(f"short = {short:.4g}: must be at least two cells, {2.0 * cell:.4g} m:"
                         " shorter waves need smaller cells")
    if not short < side:
        raise ValueError(f"short = {short:.4g}: must be below the side of a patch, {side:.4g} m:"
                         " longer waves leave it flat (the unit is m)")


class DrawnRoad:
    """A road whose patches are random maps drawn from a spectrum.

    Parameters
    ----------
    spectrum : Spectrum
        The whole spectrum. Waves of fewer than eight cells, and those longer than the side, are
        left out of the maps.
    cells : int
        Number of cells along each side.
    side : float, optional
        Length of a side, m; twice the longest wave by default.
    short : float, optional
        Shortest wave, m; eight cells by default.
    seed : int
        Seed of the patches. Roads with different seeds have no patch in common.

    Raises
    ------
    ValueError
        If an argument is not allowed, or the cells are too few for the longest wave.
    """

    is_measured = False
    join = "none"
    count: int | None = None    # number of patches; None: any number can be drawn
    maps: Sequence[tuple[str, int, int, float, float]] = ()     # it has no measured maps

    def __init__(self, spectrum: Spectrum, cells: int, side: float | None = None,
                 short: float | None = None, seed: int = 1) -> None:
        self.whole_spectrum = spectrum
        self.cells = whole("cells", cells)
        self.side = 2.0 * spectrum.band[0] if side is None else positive("side", side)
        least = _CELLS_IN_DRAWN_WAVE * self.side / self.cells
        longest = min(self.side, spectrum.band[0])
        if short is None and not least < longest:
            raise ValueError(f"cells = {self.cells}: must be more than"
                             f" {_CELLS_IN_DRAWN_WAVE * self.side / longest:.0f} for a side of"
                             f" {self.side:.4g} m and waves up to {longest:.4g} m: the shortest"
                             " wave of a drawn map has eight cells")
        self.short = max(least if short is None else positive("short", short), spectrum.band[1])
        _check_short(self.short, self.side / cells, math.inf if short is None else self.side)
        self.spectrum = spectrum.cut(self.side, self.short)
        self.seed = seed
        self.notes = list(spectrum.notes)
        if short is not None and short < 0.999 * least:
            self.notes.append(f"the shortest wave, {short:.3g} m, has fewer than eight of the cells"
                              f" of {self.side / cells:.3g} m")

    @property
    def name(self) -> str:
        """Name of the road."""
        return self.whole_spectrum.name

    def patch(self, number: int) -> Patch:
        """Return a patch.

        Parameters
        ----------
        number : int
            Number of the patch, from 0.

        Returns
        -------
        Patch
        """
        # Two roads with different seeds have no patch in common, also with seeds 1 and 2.
        height = self.spectrum.draw(self.cells, self.cells, self.side, self.side,
                                    (self.seed, number))
        label = f"{self.name}, seed {self.seed}, number {number}"
        return Patch(height, self.side, self.side, label)


def _good_length(most: int) -> int:
    """Return the largest even number up to a limit whose Fourier transforms are fast.

    Its only prime factors are 2, 3 and 5. Below 2 it is 0.

    Examples
    --------
    >>> _good_length(204), _good_length(127), _good_length(1)
    (200, 120, 0)
    """
    for length in range(most - most % 2, 0, -2):
        rest = length
        for prime in (2, 3, 5):
            while rest % prime == 0:
                rest //= prime
        if rest == 1:
            return length
    return 0


class MeasuredRoad:
    """A road whose patches are cut from measured maps.

    Each patch is levelled by the plane that rests on its tops (`rested`).

    Parameters
    ----------
    maps : sequence of MeasuredSurface
        At least one map; none may be a profile.
    cells : int
        Number of cells along a side of a patch, with the cell size of the map. Smaller maps have
        smaller patches.
    method : str, optional
        How a patch is made periodic, one of `asperity.roads.joins.JOINS`. The default is 'none' if
        the maps are periodic and not larger than a patch, and otherwise 'seam', whose join carries
        the load that belongs to its share of the area (``tools/joins.py`` measures it).
    short : float, optional
        Shortest wave that is kept, m; six cells by default.
    outliers : str
        'report' or 'remove'.
    seed : int
        Seed of the order of the patches.

    Raises
    ------
    ValueError
        If an argument is not allowed, a map is a profile, or the maps are too small.
    """

    is_measured = True

    def __init__(self, maps: Sequence[MeasuredSurface], cells: int, method: str | None = None,
                 short: float | None = None, outliers: str = "report", seed: int = 1) -> None:
        if not maps:
            raise ValueError("maps: must have at least one")
        cells = whole("cells", cells)
        self.notes: list[str] = []
        self._maps: list[MeasuredSurface] = []
        for one in maps:
            if one.height.shape[0] == 1:
                raise ValueError(f"{one.source.get('name', 'map')}: is a profile: no patches can be"
                                 " cut from it; it serves as the spectrum of an isotropic road")
            clean, notes = cleaned(one, outliers)
            if any(have_equal_heights(clean, other) for other in self._maps):
                raise ValueError(f"{one.source.get('name', 'map')}: has the heights of another map:"
                                 " its patches would count as independent ones")
            self._maps.append(clean)
            self.notes += notes
        fewest = min(min(one.height.shape) for one in maps)
        whole_maps = all(one.periodic and max(one.height.shape) <= cells for one in maps)
        self.seed = seed
        self.join = choice("join", method or ("none" if whole_maps else "seam"), JOINS)
        self._whole = self.join == "none" and whole_maps
        self.cells = cells if self._whole else self._cells(fewest, cells)
        if self.join == "none" and not self._whole:
            self.notes.append("patches are cut from the maps without a join: the step at their"
                              " edges is part of the road")
        self._places = self._cut(seed)
        self.count = len(self._places)
        steps = [max(one.lx / one.height.shape[1], one.ly / one.height.shape[0]) for one in maps]
        least = _CELLS_IN_MEASURED_WAVE * max(steps)
        self.short = least if short is None else positive("short", short)
        side = min(length * min(1.0, self.cells / count) for one in maps
                   for length, count in zip((one.ly, one.lx), one.height.shape, strict=True))
        _check_short(self.short, max(steps), side)
        self.whole_spectrum = join_spectra([
            spectrum_of_map(one.height, one.lx, one.ly, periodic=one.periodic,
                            name=one.source.get("name", "map")) for one in self._maps])
        self.whole_spectrum.cut(side, self.short)  # refuses waves that leave nothing

    @property
    def name(self) -> str:
        """Name of the road."""
        return name_of_several(str(one.source.get("name", "map")) for one in self._maps)

    @property
    def maps(self) -> Sequence[tuple[str, int, int, float, float]]:
        """Name, cells along x and y, and lengths along x and y in m of each map."""
        return [(str(one.source.get("name", "map")), one.height.shape[1], one.height.shape[0],
                 one.lx, one.ly) for one in self._maps]

    def patch(self, number: int) -> Patch:
        """Return a patch.

        Parameters
        ----------
        number : int
            Number of the patch, from 0 to `count` - 1.

        Returns
        -------
        Patch
        """
        which, row, column = self._places[number]
        one = self._maps[which]
        ny, nx = one.height.shape
        step_x, step_y = one.lx / nx, one.ly / ny
        if self._whole:
            height, rows, columns = one.height, ny, nx
        else:
            rows = columns = self.cells
            need = rows + margin_of(rows, self.join)
            part = one.height[row : row + need, column : column + need]
            height = join(rested(part), self.join, (rows, columns))
            rows, columns = height.shape
        lx, ly = columns * step_x, rows * step_y
        height = low_pass(height, lx, ly, self.short)
        label = f"{one.source.get('name', 'map')}, rows from {row}, columns from {column}"
        return Patch(height - height.mean(), lx, ly, label)

    def _cells(self, fewest: int, cells: int) -> int:
        """Return the number of cells along a side for which the maps have room; it is even.

        If it is less than wanted, its Fourier transforms are fast.
        """
        room = math.floor(fewest / (margin_of(1000, self.join) / 1000 + 1.0))
        found = cells - cells % 2 if cells <= room else _good_length(room)
        if found < 16:
            raise ValueError(f"cells = {cells}: the maps have {fewest} cells along the shorter"
                             f" side: patches of {max(found, 0)} cells: must be at least 16")
        if found < cells:
            self.notes.append(f"patches of {found} cells: the maps have no room for {cells}")
        return found

    def _cut(self, seed: int) -> list[tuple[int, int, int]]:
        """Return the map, first row and first column of each patch.

        Patches do not overlap, apart from their margins. The seed decides their order.
        """
        need = self.cells + margin_of(self.cells, self.join)
        places = []
        for which, one in enumerate(self._maps):
            ny, nx = one.height.shape
            if self._whole:
                places.append((which, 0, 0))
                continue
            along = [_starts(count, self.cells, need) for count in (ny, nx)]
            places += [(which, row, column) for row in along[0] for column in along[1]]
        order = np.random.default_rng(seed).permutation(len(places))
        return [places[i] for i in order]


def _starts(count: int, cells: int, need: int) -> list[int]:
    """Return the cells at which patches begin along an axis: spread out, without overlap."""
    fit = max(1, (count - (need - cells)) // cells)
    return [round(place) for place in np.linspace(0, count - need, fit)] if fit > 1 else [
        (count - need) // 2]
