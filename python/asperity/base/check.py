"""Checks of arguments. Every message contains the name, the value found and what is allowed."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .names import counted

__all__ = ["array_of", "choice", "exactly_one", "instance", "listed", "no_masked", "number",
           "poisson_ratio", "positive", "positives", "shown", "stresses_of", "whole"]

T = TypeVar("T")

_short = reprlib.Repr()
_short.maxstring = _short.maxother = 120


def shown(value: object) -> str:
    """Return a short text of a value for a message; long values are abbreviated.

    Examples
    --------
    >>> shown(2.5), shown("free"), shown(list(range(1000)))
    ('2.5', "'free'", '[0, 1, 2, 3, 4, 5, ...]')
    >>> shown(np.zeros((512, 512)))
    'array of shape (512, 512)'
    """
    if isinstance(value, np.ndarray) and value.size > 6:
        return f"array of shape {value.shape}"
    return _short.repr(value)


def number(
    name: str,
    value: float,
    low: float = -math.inf,
    high: float = math.inf,
    *,
    low_open: bool = False,
    high_open: bool = False,
) -> float:
    """Return `value` as a finite float within an interval.

    Parameters
    ----------
    name : str
        Name shown in the message.
    value : float
        Value to check.
    low, high : float
        Bounds of the interval; closed unless `low_open` or `high_open`.

    Raises
    ------
    ValueError
        If the value is not a finite real number within the bounds.

    Examples
    --------
    >>> number("radius", 2, 0.0, low_open=True)
    2.0
    >>> number("radius", -1, 0.0, low_open=True)
    Traceback (most recent call last):
    ...
    ValueError: radius = -1: must be a finite number > 0
    """
    allowed = "a finite number"
    if math.isfinite(low):
        allowed += f" {'>' if low_open else '>='} {low:g}"
    if math.isfinite(high):
        allowed += f"{' and' if math.isfinite(low) else ''} {'<' if high_open else '<='} {high:g}"
    if isinstance(value, np.generic):
        value = value.item()
    try:
        if isinstance(value, str | bytes | bool):
            raise TypeError
        result = float(value)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} = {shown(value)}: must be {allowed}") from None
    bad = not math.isfinite(result) or result < low or result > high
    if bad or (low_open and result == low) or (high_open and result == high):
        raise ValueError(f"{name} = {shown(value)}: must be {allowed}")
    return result


def positive(name: str, value: float) -> float:
    """Return `value` as a finite float above zero.

    Raises
    ------
    ValueError
        If it is not a number, not finite, or not above zero.
    """
    return number(name, value, 0.0, low_open=True)


def positives(**values: float) -> tuple[float, ...]:
    """Return several values, each as a finite float above zero.

    Raises
    ------
    ValueError
        If one is not a number, not finite, or not above zero; the message names the first such one.

    Examples
    --------
    >>> positives(radius=1, modulus=2e6)
    (1.0, 2000000.0)
    """
    return tuple(positive(name, value) for name, value in values.items())


def whole(name: str, value: float, low: int = 1, high: int = 2**31 - 1) -> int:
    """Return `value` as an int from `low` to `high`, by default the largest of the library.

    Raises
    ------
    ValueError
        If it is not such a number.

    Examples
    --------
    >>> whole("nx", 4.0)
    4
    >>> whole("nx", 2.5)
    Traceback (most recent call last):
    ...
    ValueError: nx = 2.5: must be a positive integer
    """
    if isinstance(value, np.generic):
        value = value.item()
    good = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    if not good or not low <= value <= high or int(value) != value:
        large = good and value > high
        allowed = ("a positive integer" if low == 1 and high == 2**31 - 1 and not large
                   else f"an integer from {low} to {high}")
        raise ValueError(f"{name} = {shown(value)}: must be {allowed}")
    return int(value)


def number_of_threads(name: str, value: float, low: int = 1) -> int:
    """Return `value` as a number of threads, of which the library allows up to 1024.

    Raises
    ------
    ValueError
        If it is not such a number.
    """
    return whole(name, value, low, 1024)


def poisson_ratio(value: float) -> float:
    """Return `value` as a Poisson ratio.

    Raises
    ------
    ValueError
        Unless -1 < value <= 0.5.
    """
    return number("poisson", value, -1.0, 0.5, low_open=True)


def array_of(
    name: str,
    values: ArrayLike,
    *,
    low: float = -math.inf,
    low_open: bool = False,
    ndim: int | None = None,
    increasing: bool = False,
) -> NDArray[np.float64]:
    """Return `values` as a float array whose elements are finite and within a bound.

    Parameters
    ----------
    name : str
        Name shown in the message.
    values : array_like
        Values to check.
    low : float
        Lower bound, which is allowed unless `low_open`.
    ndim : int, optional
        Required number of dimensions.
    increasing : bool
        Whether each value must be larger than the one before.

    Raises
    ------
    ValueError
        With the first offending value and its index.

    Examples
    --------
    >>> array_of("tau", [1.0, 0.0], low=0.0, low_open=True)
    Traceback (most recent call last):
    ...
    ValueError: tau[1] = 0.0: must be finite and > 0
    """
    no_masked(name, values)
    try:
        if np.iscomplexobj(values) or np.asarray(values).dtype.kind in "USc":
            raise TypeError
        result = np.array(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} = {shown(values)}: must be real numbers") from None
    if ndim is not None and result.ndim != ndim:
        raise ValueError(f"{name}: has {counted(result.ndim, 'dimension')}, must have {ndim}")
    bad = ~np.isfinite(result) | (result < low)
    if low_open:
        bad |= result == low
    if np.any(bad):
        where = tuple(int(i) for i in np.argwhere(bad)[0])
        index = f"[{', '.join(map(str, where))}]" if where else ""
        bound = f" and {'>' if low_open else '>='} {low:g}" if math.isfinite(low) else ""
        raise ValueError(f"{name}{index} = {float(result[where])!r}: must be finite{bound}")
    if increasing and np.any(np.diff(result) <= 0):
        i = int(np.argmax(np.diff(result) <= 0)) + 1
        raise ValueError(
            f"{name}[{i}] = {float(result[i])!r}: must be larger than the value before,"
            f" {float(result[i - 1])!r}"
        )
    return result


def no_masked(name: str, values: ArrayLike) -> None:
    """Refuse an array with masked points, because the numbers below a mask are meaningless.

    Raises
    ------
    ValueError
        With the number of masked points.

    Examples
    --------
    >>> no_masked("height", np.ma.masked_array([1.0, 2.0], [True, False]))
    Traceback (most recent call last):
    ...
    ValueError: height: has 1 of 2 points masked: fill them first, or leave them out
    """
    if np.ma.is_masked(values):
        count, size = int(np.ma.getmaskarray(np.ma.asarray(values)).sum()), int(np.size(values))
        raise ValueError(f"{name}: has {count} of {size} points masked: fill them first, or leave"
                         " them out")


def choice(name: str, value: str, allowed: Sequence[str]) -> str:
    """Return `value` if it is one of `allowed`.

    Raises
    ------
    ValueError
        If it is not; the message lists the allowed values.
    """
    if value not in allowed:
        raise ValueError(f"{name} = {shown(value)}: must be one of {', '.join(map(repr, allowed))}")
    return value


def instance(name: str, value: object, kind: type[T]) -> T:
    """Return `value` if it is an object of a class.

    Raises
    ------
    ValueError
        If it is not; the message names the class.

    Examples
    --------
    >>> instance("material", 3.0, list)
    Traceback (most recent call last):
    ...
    ValueError: material = 3.0: must be a list
    """
    if not isinstance(value, kind):
        raise ValueError(f"{name} = {shown(value)}: must be a {kind.__name__}")
    return value


def listed(name: str, values: Sequence[T], *names: str) -> tuple[T, ...]:
    """Return `values` as a tuple if it is a sequence with one value for each of some names.

    Raises
    ------
    ValueError
        If it is not.

    Examples
    --------
    >>> listed("wlf", 3.0, "c1", "c2")
    Traceback (most recent call last):
    ...
    ValueError: wlf = 3.0: must be (c1, c2)
    """
    try:
        if isinstance(values, str | bytes):
            raise TypeError
        found = tuple(values)
    except TypeError:
        found = ()
    if len(found) != len(names):
        raise ValueError(f"{name} = {shown(values)}: must be ({', '.join(names)})")
    return found


def exactly_one(**values: T | None) -> tuple[str, T]:
    """Return the name and the value of the only argument that is not None.

    Raises
    ------
    ValueError
        If none or several are given.

    Examples
    --------
    >>> exactly_one(force=None, approach=2e-5)
    ('approach', 2e-05)
    """
    given = [(name, value) for name, value in values.items() if value is not None]
    if len(given) != 1:
        names = ", ".join(name for name, _ in given)
        raise ValueError(f"{names or 'none'} given: must be exactly one of {', '.join(values)}")
    return given[0]


def stresses_of(
    name: str,
    function: Callable[[NDArray[np.float64]], ArrayLike],
    points: NDArray[np.float64],
    argument: str,
    unit: str,
) -> NDArray[np.float64]:
    """Return the stresses that a function of the user gives at some points.

    Parameters
    ----------
    name : str
        What the function describes, for messages.
    function : callable
        Takes the array of points and returns an array of stresses, Pa.
    points : ndarray
        The points. The function gets a copy.
    argument, unit : str
        Name and unit of a point, for messages.

    Returns
    -------
    ndarray
        Stresses, Pa, shape of `points`.

    Raises
    ------
    ValueError
        If the function returns anything but finite numbers >= 0 in an array of this shape.

    Examples
    --------
    >>> stresses_of("the law", lambda p: p - 2.0, np.array([3.0, 1.0]), "pressure", "Pa")
    Traceback (most recent call last):
    ...
    ValueError: the law is -1 Pa at the pressure 1 Pa: must be finite and 0 or more
    """
    found = function(points.copy())
    if np.iscomplexobj(found):
        raise ValueError(f"{name} must return an array of real numbers: these are complex")
    try:
        values = np.array(found, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must return an array of real numbers: {error}") from error
    if values.shape != points.shape:
        raise ValueError(f"{name} returns shape {values.shape} for {argument}s of shape"
                         f" {points.shape}: must be the same")
    wrong = np.flatnonzero(~((values >= 0.0) & np.isfinite(values)))
    if wrong.size:
        first = wrong[0]
        raise ValueError(f"{name} is {values[first]:g} Pa at the {argument} {points[first]:g}"
                         f" {unit}: must be finite and 0 or more")
    return values
