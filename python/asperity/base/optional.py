"""Import of optional packages, which only some functions need."""

from __future__ import annotations

import importlib
from typing import Any

__all__ = ["needed"]


def needed(package: str, by: str) -> Any:
    """Return an optional package, imported.

    Parameters
    ----------
    package : str
        Name of the package.
    by : str
        What needs it, for the message.

    Raises
    ------
    ImportError
        If it is not installed. The message says what needs it and how to install it.
    """
    try:
        return importlib.import_module(package)
    except ImportError as error:
        raise ImportError(f"{by} needs {package}: python -m pip install {package}") from error
