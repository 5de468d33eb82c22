"""Packages that only some functions need."""

from __future__ import annotations

import importlib
from typing import Any

__all__ = ["needed"]


def needed(package: str, by: str) -> Any:
    """Return a package that must be installed for one function.

    Raises
    ------
    ImportError
        If it is not installed; the message says who needs it and how to get it.
    """
    try:
        return importlib.import_module(package)
    except ImportError as error:
        raise ImportError(f"{by} needs {package}: python -m pip install {package}") from error
