"""Results of runs: one HDF5 file each, read while the run goes on or afterwards.

All quantities are in SI units. Fields have the shape (ny, nx): ``field[j, i]`` belongs to
``x[i]``, ``y[j]``.
"""

from .history import Grid, History
from .run import Run, open_result
from .snapshot import Snapshot, Snapshots

__all__ = ["Grid", "History", "Run", "Snapshot", "Snapshots", "open_result"]
