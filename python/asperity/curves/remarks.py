"""Collection of the warnings of runs, and of the states without a solution, into remarks."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from ..results import Run
from ..results.curve_remarks import CurveRemark
from .plan import CurvePlan
from .running import Piece

__all__ = ["remarks_of"]

_STEP = re.compile(r"step (\d+), t = \S+ s: (.*)")
_PHASE = re.compile(r"&phase (\d+): (.*)")
_FILE = re.compile(r"file = '[^']*'")
_NUMBER = re.compile(r"[-+]?\d[\d.]*([eE][-+]?\d+)?")


def remarks_of(plan: CurvePlan, pieces: list[Piece]) -> list[CurveRemark]:
    """Return a remark for each kind of warning, and for each reason of states without a solution.

    Warnings that differ in their numbers alone, or in the file of the patch, are of one kind.

    Parameters
    ----------
    plan : CurvePlan
        What was run.
    pieces : list of Piece
        The runs.

    Returns
    -------
    list of CurveRemark
        Those of states without a solution come first.
    """
    shape = (plan.pressure.size, plan.temperature.size, plan.speed.size, plan.patches)
    found: dict[tuple[bool, str], list[tuple[tuple[int, int, int, int], str]]] = {}
    for piece in pieces:
        run, rows, finished = piece.rows()
        said = [(False, row, text) for row, text in _warnings(run, rows)]
        if not finished:
            said.append((True, rows, _reason(run.outcome)))
        for is_lost, row, text in said:
            kind = (is_lost, _NUMBER.sub("#", _FILE.sub("", text)))
            found.setdefault(kind, []).append(
                ((piece.i, piece.j, piece.first + row, piece.patch), text))
    remarks = []
    for (is_lost, _), places in found.items():
        where = np.zeros(shape, dtype=bool)
        for at, _ in places:
            where[at] = True
        remarks.append(CurveRemark(min(places)[1], where, is_lost))
    return sorted(remarks, key=lambda remark: not remark.is_lost)


def _warnings(run: Run, rows: int) -> Iterator[tuple[int, str]]:
    """Return the row and the text of each warning of a run about one of its first `rows` rows."""
    steps = run.history["step"][:rows].astype(int).tolist()
    for line in run.warnings:
        step, phase = _STEP.fullmatch(line), _PHASE.fullmatch(line)
        if step:
            about = [steps.index(int(step[1]))] if int(step[1]) in steps else []
        elif phase:
            about = [int(phase[1]) - 1] if int(phase[1]) <= rows else []
        else:
            about = list(range(rows))
        text = (step or phase or [line, "", line])[2]
        for row in about:
            yield row, text


def _reason(outcome: str) -> str:
    """Return why a run has ended, without the place.

    Examples
    --------
    >>> _reason("step 3 of phase 4, t = 0 s: the solver did not converge: the road wedges")
    'the road wedges'
    """
    return re.sub(r"^step .*?: (the solver did not converge: )?", "", outcome)
