"""Results of runs. Each is one HDF5 file, which can be read during the run or afterwards.

All quantities are in SI units. Fields have the shape (ny, nx): ``field[j, i]`` belongs to
``x[i]``, ``y[j]``.
"""

from .history import Grid, History
from .run import Run, open_result
from .snapshot import Snapshot, Snapshots

__all__ = ["Grid", "History", "Run", "Snapshot", "Snapshots", "open_result"]
