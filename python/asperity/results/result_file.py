"""A result file without its snapshots: title, grid, material, history, outcome."""

from __future__ import annotations

import os
import zlib
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from ..base.check import shown
from ..base.names import NamedValues, OpenValues, UnknownNameError
from ..base.notices import warn_user
from .history import Grid, History
from .reading import NotAResultError, attributes_of, read_file, scalar_of, text_of

__all__ = ["ResultFile"]

FloatArray = NDArray[np.float64]


class Losses(NamedTuple):
    """The losses of a row of steady sliding, by wavelength and by arm.

    Attributes
    ----------
    wavelength : ndarray, shape (n,)
        Longest wavelength of each octave, m.
    octave : ndarray, shape (n,)
        Rate of loss in the rubber by each octave of the wavelength, W.
    arm : ndarray, shape (m,)
        Rate of loss in the rubber by each arm of the Prony series, W.
    """

    wavelength: FloatArray
    octave: FloatArray
    arm: FloatArray


class _LossesOfRows(dict[int, Losses]):
    """The losses by the number of the row, with a message for rows that have none."""

    def __missing__(self, step: object) -> Losses:
        known = f"are {shown(list(self))}" if self else "is none"
        raise UnknownNameError(f"row {step}: has no losses: only rows of steady sliding have"
                               f" them, of which there {known}")


class Material(NamedValues):
    """The properties of the material, in SI units (temperature in °C)."""

    density: float
    poisson: float
    prony_g: FloatArray
    prony_tau: FloatArray
    shear_modulus: float
    temperature: float
    thickness: float


class ResultFile:
    """The result file of a run without its snapshots, which `asperity.Run` adds.

    Parameters
    ----------
    path : str or Path
        The file, RESULT.h5.

    Raises
    ------
    OSError
        If the file is missing, cannot be read, or is not a result.
    """

    path: Path
    grid: Grid
    history: History
    material: Material
    attributes: OpenValues
    losses: dict[int, Losses]
    has_damaged_rows: bool  # rows of the history do not agree with their checksums

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self._read()

    def _read(self) -> None:
        """Read everything except the fields in one go, so that all parts belong together."""
        def read(file: h5py.File) -> None:
            for group in ("grid", "history"):
                if group not in file:
                    raise NotAResultError(f"{self.path}: holds no /{group}: it is not a result"
                                           " of `asperity run`")
            self.attributes = OpenValues(attributes_of(file), "attribute of the file")
            self.grid = _grid(file["grid"])
            material = file.get("material")
            values = {}
            if material is not None:
                values = attributes_of(material) | {
                    name: item[()] if name.startswith("prony") else scalar_of(item[()])
                    for name, item in material.items() if isinstance(item, h5py.Dataset)}
            self.material = Material(values, "property of the material")
            columns = {name: item for name, item in file["history"].items()
                       if isinstance(item, h5py.Dataset)}
            sums = columns.pop("checksum", None)
            first = [name for name in ("step", "phase", "time") if name in columns]
            names = first + [name for name in columns if name not in first]
            self.history = History(
                {name: np.atleast_1d(columns[name][()]) for name in names},
                {name: text_of(columns[name].attrs.get("units", "1")) for name in names},
                {name: text_of(columns[name].attrs.get("long_name", name)) for name in names})
            self.has_damaged_rows = sums is not None and self._is_damaged(sums[()])
            self.losses = _LossesOfRows((int(key), Losses(*(
                np.asarray(group[name][()]) if name in group else np.zeros(0)
                for name in Losses._fields))) for key, group in self._of_rows(file, "losses"))
            self._snapshot_keys = [key for key, _ in self._of_rows(file, "snapshots")]

        read_file(self.path, read)

    def _of_rows(self, file: h5py.File, name: str) -> list[tuple[str, h5py.Group]]:
        """Return the members of a group that belong to rows of the history, in their order.

        Members of later rows, which the run may have added since the history was read, are left
        out.
        """
        steps = self.history["step"]
        last = int(steps.max()) if steps.size else -1
        keys = [key for key in file.get(name, {}) if key.isdigit() and int(key) <= last]
        return [(key, file[name][key]) for key in sorted(keys, key=int)]

    def _is_damaged(self, sums: NDArray[np.float64]) -> bool:
        """Return whether rows of the history do not agree with their checksums, with a warning."""
        names = sorted(name for name in self.history if name != "seconds")
        rows = min(self.history.rows, len(sums))
        table = np.ascontiguousarray(np.stack([self.history[name][:rows].astype("<f8")
                                               for name in names], axis=1))
        wrong = [row for row in range(rows) if zlib.crc32(table[row].data) != sums[row]]
        if wrong:
            listed = ", ".join(map(str, wrong[:5])) + (", ..." if len(wrong) > 5 else "")
            warn_user(f"{self.path}: the history does not agree with its checksums: the file is"
                      f" damaged in row{'s' * (len(wrong) > 1)} {listed}")
        return bool(wrong)

    @property
    def title(self) -> str:
        """Title of the case."""
        return str(self.attributes.get("title", ""))

    @property
    def program(self) -> str:
        """Name of the program that wrote the file."""
        return str(self.attributes.get("program", ""))

    @property
    def version(self) -> str:
        """Version of the program that wrote the file."""
        return str(self.attributes.get("version", ""))

    @property
    def created(self) -> str:
        """Time at which the file was created, ISO 8601, UTC."""
        return str(self.attributes.get("created", ""))

    @property
    def input(self) -> str:
        """The text of the input file."""
        return str(self.attributes.get("input", ""))

    @property
    def finished(self) -> bool:
        """Whether the run is complete."""
        return bool(int(self.attributes.get("finished", 0)))

    @property
    def outcome(self) -> str:
        """How the run ended: 'running' (or killed), 'finished', 'stopped after ...', or a fault."""
        return str(self.attributes.get("outcome", "finished" if self.finished else "running"))

    @property
    def warnings(self) -> list[str]:
        """The warnings about the input, then those of the run (once it has ended or stopped)."""
        return [line for name in ("warnings", "run_warnings")
                for line in str(self.attributes.get(name, "")).splitlines() if line.strip()]

    @property
    def height(self) -> FloatArray:
        """Height of the road before any sliding, m, shape (ny, nx)."""
        def read(file: h5py.File) -> FloatArray:
            if "surface/height" not in file:
                raise NotAResultError(f"{self.path}: holds no /surface/height")
            return file["surface/height"][()]

        return read_file(self.path, read)


def _grid(group: h5py.Group) -> Grid:
    """Read the grid."""
    found = attributes_of(group)
    return Grid(int(found["nx"]), int(found["ny"]), float(found["lx"]), float(found["ly"]),
                str(found["boundary"]), group["x"][()], group["y"][()])
