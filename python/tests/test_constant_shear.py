"""Runs with constant shear against the dense steps of the tools; a step without plain solution."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from conftest import ROOT

sys.path.insert(0, str(ROOT / "tools"))

from constant_shear import (
    examine,
    left_in_rows,
    look_for_plain,
    replay,
    run_case,
    run_starts,
)


# A half-space with two arms, whose first step is taken in parts, a free patch with an arm, and a
# block with mass and an arm. The load jumps in all of them.
@pytest.mark.parametrize(("seed", "allowed"), [
    (774100078, 1e-4), (774100254, 1e-4), (774100248, 1e-4)])
def test_settled_rows(program, tmp_path, seed, allowed):
    """Every row of a run whose passes settle is the dense solution, with no cell partly sheared."""
    text, status = run_case(seed, tmp_path, program)
    assert status == 0
    if "prony" in text:
        run_starts(text, tmp_path, program)
    end = replay(tmp_path, text)
    assert end["row"] == 15, "the last row of three phases"
    assert end["before"] < allowed
    step, known = end["step"], end["guesses"][0]
    found, left = step.solve(end["guesses"])
    assert left < 1e-8
    for values, exact in zip(known[:2], step.fields(found)[:2], strict=True):
        assert np.abs(values - exact).sum() < allowed * known[0].sum()
    assert step.partial(found).size == 0
    assert look_for_plain(step, found, cut=False)["plain"]


# Before the passes looked at single cells, cells at the edge overlapped with the road in the first
# case, which made differences of 4e-5. The second case, a free patch with adhesion whose rim is
# attracted, was right even then.
@pytest.mark.parametrize("seed", [774100367, 774100124])
def test_cells_at_the_edge(program, tmp_path, seed):
    """Every row agrees with the dense step where the states of cells at the edge are decisive."""
    text, status = run_case(seed, tmp_path, program, scheme="exponential")
    assert status == 0
    end = replay(tmp_path, text, settled=True)
    assert end["rows"] == 15
    assert end["before"] < 3e-5


def test_rows_with_several_solutions(program, tmp_path):
    """Every row solves the dense equations where a dense solver may find another solution.

    Row 9 has two solutions that differ by 9e-3 of the load, and row 10 two that differ by 6e-4.
    Before the passes looked at single cells, cells with a gap carried the whole strength.
    """
    text, status = run_case(774100294, tmp_path, program, scheme="exponential", tolerance=1e-10)
    assert status == 0
    left = left_in_rows(tmp_path, text)
    assert len(left) == 15
    assert max(left) < 1e-6


def test_step_without_plain_solution(program, tmp_path):
    """Two cells are partly sheared, because with any plain state some cell violates the law."""
    text, status = run_case(774100058, tmp_path, program)
    assert status == 0
    end = replay(tmp_path, text, settled=True)
    assert end["rows"] == 15
    assert end["divided"] >= 10
    assert end["before"] < 1e-5
    step = end["step"]
    found, left = step.solve(end["guesses"])
    assert left < 1e-8
    partial = step.partial(found)
    np.testing.assert_allclose(step.shares(found)[partial], [0.680, 0.944], atol=1e-3)
    pressure, traction, gap = step.fields(found)
    assert np.abs(pressure[partial]).max() < 1e-9 * pressure.max()
    assert np.abs(gap[partial]).max() < 1e-9 * np.ptp(gap)
    # The reference is the limit in which the law of the other cells is approached from smooth laws.
    size = np.linalg.norm(traction, axis=0) / step.case.strength
    assert (size[pressure > 0] > 0.9).any()
    assert (size[pressure == 0] < 1).all()
    tree = look_for_plain(step, found, cut=False)
    assert tree["complete"]
    assert not tree["plain"]
    assert tree["states"] == tree["broken"] >= 4
    assert "| none |" in examine(774100058, program)
