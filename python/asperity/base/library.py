"""Calls of the Fortran library. Only one runs at a time, and a status becomes an exception."""

from __future__ import annotations

import contextlib
import functools
import os
import signal
import threading
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity import _core

from .check import choice, no_masked, number_of_threads, positive
from .errors import raise_for_status

__all__ = ["bare", "call", "check_depth", "close_soon", "contact_map", "flag_of_boundary",
           "height_map", "lengths", "set_threads", "version"]

_lock = threading.Lock()
_to_be_closed: deque[tuple[Any, int]] = deque()   # routines, and the handles that they close
_modules = (_core.flat_contact, _core.flat_library, _core.flat_roads, _core.flat_runs,
            _core.flat_simulations)


def _routine(name: str) -> Any:
    """Return a routine of the library from the module that contains it."""
    return next(getattr(module, name) for module in _modules if hasattr(module, name))


def _before_fork() -> None:
    """Wait for the current call to return, and end idle threads.

    A forked process has only the thread that called fork. Without this, its calls would wait for
    ever for the other threads of OpenMP, or for a lock that another thread held.
    """
    _lock.acquire()
    _core.flat_library.release_idle_threads()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=_before_fork, after_in_parent=_lock.release,
                        after_in_child=_lock.release)


def call(name: str, *, interruptible: bool = False) -> Callable[..., tuple[Any, ...]]:
    """Return a routine of the library that raises an exception instead of returning a status.

    Parameters
    ----------
    name : str
        Name of the routine. Its last two outputs are a status and a message.
    interruptible : bool
        Whether Ctrl-C ends the routine at its next iteration, with KeyboardInterrupt.

    Returns
    -------
    callable
        Takes the arguments of the routine, and returns its other outputs.
    """
    routine = _routine(name)

    @functools.wraps(routine)
    def checked(*arguments: Any) -> tuple[Any, ...]:
        with _lock:
            signals = _interrupts() if interruptible else None
            if signals is not None:
                _core.flat_library.await_interrupts(signals)
            try:
                *outputs, status, message = routine(*arguments)
            finally:
                if signals is not None:
                    _core.flat_library.end_interrupts(signals)
        _close_waiting()
        raise_for_status(int(status), message)
        return tuple(outputs)

    return checked


def _interrupts() -> NDArray[np.int32] | None:
    """Return the signal of Ctrl-C if it raises KeyboardInterrupt in this thread, otherwise None."""
    if (threading.current_thread() is threading.main_thread()
            and signal.getsignal(signal.SIGINT) is signal.default_int_handler):
        return np.array([signal.SIGINT], dtype=np.int32)
    return None


def bare(name: str) -> Callable[..., Any]:
    """Return a routine of the library that has no status, with the lock around its calls."""
    routine = _routine(name)

    @functools.wraps(routine)
    def locked(*arguments: Any) -> Any:
        with _lock:
            result = routine(*arguments)
        _close_waiting()
        return result

    return locked


def close_soon(name: str, handle: int) -> None:
    """Close a handle of the library, at once or after the call that is running.

    Finalisers call this. The garbage collector may run them in the thread whose call is running,
    and a call of the library would then wait for itself.

    Parameters
    ----------
    name : str
        Name of the routine that closes the handle.
    handle : int
        The handle.
    """
    _to_be_closed.append((_routine(name), handle))
    if not _lock.locked():
        _close_waiting()


def _close_waiting() -> None:
    """Close the handles whose objects no longer exist. The caller does not hold the lock."""
    while _to_be_closed:
        with _lock, contextlib.suppress(IndexError):  # another thread may take the last one
            routine, handle = _to_be_closed.popleft()
            routine(handle)


def version() -> str:
    """Return the version of the library."""
    return _core.flat_library.library_version().decode().strip()


def set_threads(number: int = 0) -> int:
    """Set the number of threads of all later calls of the library.

    Parameters
    ----------
    number : int
        Number of threads, up to 1024. 0 means the value of the environment variable
        OMP_NUM_THREADS or SLURM_CPUS_PER_TASK, or all processors if neither is set.

    Returns
    -------
    int
        The number in use.

    Raises
    ------
    ValueError
        If the number is negative or larger than 1024.

    Examples
    --------
    >>> import asperity
    >>> asperity.set_threads(1)
    1
    """
    number = number_of_threads("number", number, 0)
    with _lock:
        return int(_core.flat_library.set_thread_count(number))


def height_map(height: ArrayLike, name: str = "height") -> NDArray[np.float64]:
    """Return a map as a C-ordered array of doubles of shape (ny, nx); a profile has ny = 1.

    Raises
    ------
    ValueError
        If it is not a map of finite real numbers, or has masked points.
    """
    no_masked(name, height)
    try:
        if np.iscomplexobj(height):
            raise TypeError
        array = np.ascontiguousarray(height, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: must be an array of real numbers") from None
    if array.ndim == 1 and np.ndim(height) == 1:
        array = array[None, :]
    if array.ndim != 2 or np.ndim(height) == 0 or array.size == 0:
        raise ValueError(f"{name}: has shape {np.shape(height)}: must be (ny, nx), both at least 1")
    if not np.isfinite(array).all():
        j, i = np.argwhere(~np.isfinite(array))[0]
        raise ValueError(f"{name}[{j}, {i}] = {array[j, i]}: must be finite")
    return array


def lengths(shape: tuple[int, int], lx: float, ly: float | None) -> tuple[float, float]:
    """Return the lengths of a map of shape (ny, nx); `ly` defaults to square cells."""
    lx = positive("lx", lx)
    return lx, lx * shape[0] / shape[1] if ly is None else positive("ly", ly)


def flag_of_boundary(boundary: str) -> int:
    """Return 1 for 'free', 0 for 'periodic'."""
    return int(choice("boundary", boundary, ("periodic", "free")) == "free")


def contact_map(height: ArrayLike, lx: float, ly: float | None, boundary: str
                ) -> tuple[NDArray[np.float64], float, float, int]:
    """Return the map, its lengths (m) and the flag of its boundary, all checked.

    Raises
    ------
    ValueError
        If one of them is not allowed in a normal contact.
    """
    array = height_map(height)
    lx, ly = lengths(array.shape, lx, ly)
    free = flag_of_boundary(boundary)
    if free and array.shape[0] == 1:
        raise ValueError("boundary = 'free': a line contact has no finite displacement in free"
                         " space: must be 'periodic'")
    return array, lx, ly, free


def check_depth(displacement: float, array: NDArray[np.float64]) -> None:
    """Refuse a displacement that brings a periodic map into full contact."""
    deepest = float(array.max()) - float(array.mean()) if np.ptp(array) > 0.0 else 0.0
    if displacement >= deepest:
        raise ValueError(
            f"displacement = {displacement}: must be below {deepest:.10g} m, the mean gap at"
            " first touch: beyond it the pressure of a periodic contact is not determined")
