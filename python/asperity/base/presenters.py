"""How data show themselves without knowing what draws them.

``run.plot("friction")`` draws, yet the modules of results and materials import nothing that draws:
they call ``present("plot_history", run, ...)``. The package tells, when it is imported, which
function of which module that is; the module is imported when it is used first.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

__all__ = ["present", "register"]

_known: dict[str, str] = {}


def register(presenters: Mapping[str, str]) -> None:
    """Tell which functions present data.

    Parameters
    ----------
    presenters : mapping
        Name of each function, and the module that holds it.
    """
    _known.update(presenters)


def present(name: str, *arguments: Any, **options: Any) -> Any:
    """Call the presenter of a name; return what it returns.

    Parameters
    ----------
    name : str
        Name of a registered function.
    *arguments, **options
        Passed on to the function.

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
