"""Calls of drawing code by name, so that modules of data need not import it.

``run.plot("friction")`` draws, although the modules of results and materials do not import drawing
code: they call ``present("plot_history", run, ...)``. When the package is imported, it registers
which module contains each such function. The module itself is imported on first use.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

__all__ = ["present", "register"]

_known: dict[str, str] = {}


def register(presenters: Mapping[str, str]) -> None:
    """Register functions that draw, write or show data.

    Parameters
    ----------
    presenters : mapping
        Name of each function, and the module that contains it.
    """
    _known.update(presenters)


def present(name: str, *arguments: Any, **options: Any) -> Any:
    """Call the registered function of a name, and return its result.

    Parameters
    ----------
    name : str
        Name of a registered function.
    *arguments, **options
        Arguments of the function.

    Returns
    -------
    object
        The result of the function.

    Raises
    ------
    LookupError
        If no function of that name is registered.

    Examples
    --------
    >>> register({"sqrt": "math"})
    >>> present("sqrt", 4.0)
    2.0
    """
    if name not in _known:
        raise LookupError(f"nothing presents {name!r}: there are {', '.join(sorted(_known))}")
    return getattr(importlib.import_module(_known[name]), name)(*arguments, **options)
