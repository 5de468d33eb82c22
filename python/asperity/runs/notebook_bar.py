"""The progress bar of a notebook."""

from __future__ import annotations

import sys
from html import escape
from typing import Any

__all__ = ["NotebookBar", "notebook_bar"]


def notebook_bar() -> NotebookBar | None:
    """Return a bar in a notebook, None elsewhere."""
    display = _notebook_display()
    return None if display is None else NotebookBar(display)


def _notebook_display() -> Any:
    """Return IPython's `display` in a notebook, None elsewhere."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if shell is None or type(shell).__name__ != "ZMQInteractiveShell":
        return None
    from IPython.display import display

    return display


class NotebookBar:
    """A bar below the cell, which is displayed with the first call of `show` and then updated.

    Parameters
    ----------
    display : callable
        IPython's `display`.
    """

    def __init__(self, display: Any) -> None:
        self._display = display
        self._handle: Any = None

    def show(self, done: int, total: int, text: str) -> None:
        """Show how much is done, with a text beside the bar."""
        shown = _Bar(done, total, text)
        if self._handle is None:
            self._handle = self._display(shown, display_id=True)
        else:
            self._handle.update(shown)


class _Bar:
    """A bar with its text."""

    def __init__(self, done: int, total: int, text: str) -> None:
        self._done, self._total, self._text = done, total, text

    def _repr_html_(self) -> str:
        return (f'<progress value="{self._done}" max="{self._total}" style="width:20em">'
                f"</progress> {escape(self._text)}")

    def __repr__(self) -> str:
        return self._text
