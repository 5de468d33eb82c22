"""The exceptions of the package, and the conversion of a status of the Fortran library into one."""

from __future__ import annotations

import pickle
from typing import Any

__all__ = ["NotConverged", "raise_for_status"]


class NotConverged(RuntimeError):  # noqa: N818 - an outcome that callers look for by this name
    """A solver has not reached its tolerance.

    Attributes
    ----------
    result : object
        The best result so far. For `asperity.run` it is the opened result file.
    """

    def __init__(self, message: str, result: Any = None) -> None:
        super().__init__(message)
        self.result = result

    def __reduce__(self) -> tuple[type[NotConverged], tuple[str, Any]]:
        """Pickle without a result that another process cannot have, such as a simulation."""
        try:
            pickle.dumps(self.result)
        except (TypeError, AttributeError, pickle.PicklingError):
            return type(self), (str(self), None)
        return type(self), (str(self), self.result)


def raise_for_status(status: int, message: bytes | str) -> None:
    """Raise the exception that belongs to a status of the library.

    Parameters
    ----------
    status : int
        0 raises nothing; 2 a ValueError, 3 an OSError, 4 `NotConverged`, 5 a MemoryError.
    message : bytes or str
        The message of the library.

    Examples
    --------
    >>> raise_for_status(0, b"")
    >>> raise_for_status(2, b"tolerance = 0: must be positive  ")
    Traceback (most recent call last):
    ...
    ValueError: tolerance = 0: must be positive
    """
    if status == 0:
        return
    text = (message.decode(errors="replace") if isinstance(message, bytes) else message).strip()
    kinds: dict[int, type[Exception]] = {2: ValueError, 3: OSError, 4: NotConverged,
                                         5: MemoryError}
    raise kinds.get(status, RuntimeError)(text)
