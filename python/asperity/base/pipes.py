"""Output into a pipe whose reader has ended, as with ``| head -1`` or ``2>&1 | head -1``."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from typing import Any, TextIO, cast

__all__ = ["patient_output"]


class _Output:
    """A stream that drops what is written when the reader of its pipe has ended."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write a text."""
        try:
            return self._stream.write(text)
        except BrokenPipeError:
            self._drop()
            return len(text)

    def flush(self) -> None:
        """Write what is in the buffer."""
        try:
            self._stream.flush()
        except BrokenPipeError:
            self._drop()

    def _drop(self) -> None:
        """Send everything to os.devnull from now on, also what is still in the buffer."""
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self._stream.fileno())
        os.close(nowhere)
        self._stream.flush()


@contextmanager
def patient_output() -> Iterator[None]:
    """Let a command go on, and write its files, when nobody reads its messages any more."""
    output, messages = _Output(sys.stdout), _Output(sys.stderr)
    with (redirect_stdout(cast("TextIO", output)), redirect_stderr(cast("TextIO", messages))):
        try:
            yield
        finally:
            output.flush()
            messages.flush()
