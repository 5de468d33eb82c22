"""The runs of a friction curve: one per patch, pressure and temperature, with all speeds.

Each speed starts from the state of the one before. If the solver does not converge, the point is
left out, and another run continues with the next speed.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ..base.files import make_folder
from ..results import Run, open_result
from ..roads.patches import Patch
from ..runs.jobs import Job, take_end
from ..runs.means import Means, run_jobs
from ..runs.progress import SweepProgress
from .plan import CurvePlan

__all__ = ["CurveError", "CurveFileError", "Piece", "SubmittedError", "run_pieces"]


class CurveError(RuntimeError):
    """Some runs of a curve failed; the finished ones are kept for the next call."""


class CurveFileError(CurveError, OSError):
    """Runs failed because files cannot be written or read, as on a full disk."""


class SubmittedError(RuntimeError):
    """The runs were submitted to Slurm and are not complete; the same call later gathers them."""


@dataclass
class Piece:
    """A run of a curve, and the indices of its points.

    Attributes
    ----------
    patch, i, j, first : int
        Indices of the patch, the pressure, the temperature and the first speed.
    job : Job
        The run.
    """

    patch: int
    i: int
    j: int
    first: int
    job: Job

    def rows(self) -> tuple[Run, int, bool]:
        """Return the result, the number of its rows that are steady states, and if it is complete.

        The last row of a run that did not converge is the best state that was found. It does not
        count as a steady state.
        """
        run = open_result(self.job.path)
        return run, run.history.rows - (0 if run.finished else 1), run.finished


def run_pieces(plan: CurvePlan, folder: Path, means: Means, quiet: bool = False,
               renewed: set[str] | None = None) -> list[tuple[Piece, Patch]]:
    """Run the pieces that are not complete yet, and return all pieces with their patches.

    Parameters
    ----------
    plan : CurvePlan
        The plan.
    folder : Path
        Folder of maps, inputs and results.
    means : Means
        The way in which jobs are run.
    quiet : bool
        Show no progress.
    renewed : set of str, optional
        Without `means.resume`, the names of the runs whose results are reused nevertheless, because
        an earlier call has just made them. The names of the runs of this call are added.

    Returns
    -------
    list of (Piece, Patch)

    Raises
    ------
    CurveError
        If a run fails for another reason than a solver that does not converge.
    SubmittedError
        If the runs were submitted to Slurm.
    """
    make_folder(folder)
    renewed = set() if renewed is None else renewed
    patches = [plan.road.patch(number) for number in range(plan.patches)]
    files = [patch.save(folder).name for patch in patches]
    pieces = [_piece(plan, patches[n], files[n], folder, (n, i, j, 0))
              for n in range(plan.patches)
              for i in range(plan.pressure.size) for j in range(plan.temperature.size)]
    begun, fresh = list(pieces), pieces
    while fresh:
        waiting = [piece.job for piece in fresh
                   if not ((means.resume or piece.job.name in renewed) and take_end(piece.job))]
        renewed |= {piece.job.name for piece in fresh}
        progress = SweepProgress("friction", len(fresh), len(waiting), quiet)
        run_jobs(waiting, folder, progress, means)
        if waiting and means.slurm is not None:
            raise SubmittedError(f"{len(waiting)} runs {waiting[0].message}; the same command"
                                 " gathers them when they are done")
        _look_for_failures(fresh)
        fresh = [_piece(plan, patches[piece.patch], files[piece.patch], folder,
                        (piece.patch, piece.i, piece.j, first))
                 for piece, first in _broken_off(fresh, plan)]
        begun += fresh
    return [(piece, patches[piece.patch]) for piece in begun]


def _piece(plan: CurvePlan, patch: Patch, file: str, folder: Path,
           place: tuple[int, int, int, int]) -> Piece:
    """Return a run of a curve."""
    n, i, j, first = place
    case = plan.case(patch, file, i, j, first)
    if n == 0:
        case.output.snapshot_every = 1  # for the maps of the HTML page
    case.path = folder / "case.nml"
    # The name depends on the settings, so that several curves can share a folder.
    code = hashlib.sha256(str(case).encode()).hexdigest()[:8]
    name = f"{patch.code}-p{plan.pressure[i]:.6g}-T{plan.temperature[j]:.6g}-{code}"
    if first:
        name += f"-from{first}"
    values = {"patch": n, "pressure": plan.pressure[i], "temperature": plan.temperature[j]}
    return Piece(n, i, j, first, Job(values, case, name, folder / f"{name}.h5"))


def _look_for_failures(pieces: list[Piece]) -> None:
    """Raise CurveError or CurveFileError with the messages of runs that have failed."""
    failed = [piece.job for piece in pieces if piece.job.status not in (0, 4)]
    if failed:
        listed = "\n".join(f"  {job.name}: {job.message or 'was not run'}" for job in failed[:10])
        kind = CurveFileError if all(job.status == 3 for job in failed) else CurveError
        raise kind(f"{len(failed)} of {len(pieces)} runs failed:\n{listed}")


def _broken_off(pieces: list[Piece], plan: CurvePlan) -> Iterator[tuple[Piece, int]]:
    """Return the pieces that ended early, each with the index of the speed to continue with."""
    for piece in pieces:
        if piece.job.status == 4:
            _, rows, _ = piece.rows()
            following = piece.first + rows + 1
            if following < plan.speed.size:
                yield piece, following
