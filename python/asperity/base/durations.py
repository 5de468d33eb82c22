"""Durations in words, for messages."""

from __future__ import annotations

import math

__all__ = ["duration", "short_time"]


def duration(seconds: float) -> str:
    """Return a time in words.

    Examples
    --------
    >>> duration(8), duration(75), duration(7300), duration(200000), duration(float("nan"))
    ('8 s', '1 min 15 s', '2 h 1 min', '2 d 7 h', 'unknown')
    """
    if not math.isfinite(seconds):
        return "unknown"
    whole = round(seconds)
    for size, unit, part, name in ((86400, "d", 3600, "h"), (3600, "h", 60, "min"),
                                   (60, "min", 1, "s")):
        if whole >= size:
            return f"{whole // size} {unit} {whole % size // part} {name}"
    return f"{whole} s"


def short_time(seconds: float) -> str:
    """Return a time in words, with two digits if it is short.

    Examples
    --------
    >>> short_time(0.0213), short_time(75)
    ('0.021 s', '1 min 15 s')
    """
    return f"{seconds:.2g} s" if seconds < 10.0 else duration(seconds)
