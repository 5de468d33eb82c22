"""Remarks about points of a friction curve: warnings of its runs, and states without a solution."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..base.names import counted

__all__ = ["CurveRemark", "marks_of", "points_in_words"]

FloatArray = NDArray[np.float64]

_MOST_PLACES = 6  # combinations of pressure and temperature that a remark lists


@dataclass(frozen=True)
class CurveRemark:
    """What runs of a curve report about some of its states, each on one patch.

    Attributes
    ----------
    text : str
        The report about the first of these states. That about another one may have other numbers.
    where : ndarray of bool, shape (pressure, temperature, speed, patch)
        The states that it concerns.
    is_lost : bool
        The solver did not converge there, so that these states are left out of the curve.
    """

    text: str
    where: NDArray[np.bool_]
    is_lost: bool = False

    @property
    def points(self) -> NDArray[np.bool_]:
        """The points that it concerns on some patch, shape (pressure, temperature, speed)."""
        return np.asarray(self.where.any(axis=-1))

    def line(self, axes: tuple[FloatArray, FloatArray, FloatArray]) -> str:
        """Return the remark with the points that it concerns.

        Parameters
        ----------
        axes : tuple of ndarray
            Pressures, temperatures and speeds of the curve: Pa, C, m/s.

        Returns
        -------
        str
        """
        states, points = int(self.where.sum()), int(self.points.sum())
        patches = self.where.shape[-1]
        counts = f"{points} of {counted(self.points.size, 'point')}"
        if states < points * patches:
            counts += f", {states} of {points * patches} states there"
        first = tuple(int(index) for index in np.argwhere(self.where)[0])
        place = points_in_words(np.array(_only(self.points.shape, first[:3])), axes)
        example = f" (here at {place}, patch {first[3] + 1})" if states > 1 else ""
        words = f"did not converge and {'is' if points == 1 else 'are'} left out" * self.is_lost
        return (f"{counts}" + (f" {words}" if words else "")
                + f" ({points_in_words(self.points, axes)}): {self.text}{example}")


def _only(shape: tuple[int, ...], at: tuple[int, ...]) -> NDArray[np.bool_]:
    """Return an array that is true at one place."""
    found = np.zeros(shape, dtype=bool)
    found[at] = True
    return found


def marks_of(remarks: list[CurveRemark], at: tuple[int, int, int]) -> str:
    """Return the numbers, from 1, of the remarks about a point, as in "[1] [3]"."""
    return " ".join(f"[{number}]" for number, remark in enumerate(remarks, 1)
                    if remark.points[at])


def points_in_words(points: NDArray[np.bool_], axes: tuple[FloatArray, FloatArray, FloatArray]
                    ) -> str:
    """Return a list of points of a curve.

    Parameters
    ----------
    points : ndarray of bool, shape (pressure, temperature, speed)
        The points.
    axes : tuple of ndarray
        Pressures, temperatures and speeds: Pa, C, m/s.

    Returns
    -------
    str

    Examples
    --------
    >>> axes = np.array([1e5, 2e5]), np.array([20.0]), np.array([0.1, 1.0, 10.0])
    >>> points_in_words(np.array([[[1, 1, 0]], [[1, 0, 1]]], dtype=bool), axes)
    '1e+05 Pa: 0.1 to 1 m/s; 2e+05 Pa: 0.1 and 10 m/s'
    """
    pressure, temperature, speed = axes
    found = []
    for i, j in np.ndindex(points.shape[:2]):
        if not points[i, j].any():
            continue
        place = [f"{pressure[i]:.4g} Pa"] * (pressure.size > 1)
        place += [f"{temperature[j]:g} °C"] * (temperature.size > 1)
        speeds = " and ".join(_runs(points[i, j], speed)) + " m/s"
        found.append(", ".join(place) + ": " * bool(place) + speeds)
    if len(found) > _MOST_PLACES:
        found[_MOST_PLACES:] = [f"and at {len(found) - _MOST_PLACES} other pressures and"
                                " temperatures"]
    return "; ".join(found)


def _runs(chosen: NDArray[np.bool_], values: FloatArray) -> Iterator[str]:
    """Return the chosen values, as ranges where they follow each other."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(int)))
    for first, behind in zip(edges[::2], edges[1::2], strict=True):
        yield (f"{values[first]:.4g}" if behind - first == 1
               else f"{values[first]:.4g} to {values[behind - 1]:.4g}")
