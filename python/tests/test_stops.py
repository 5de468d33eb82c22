"""A run with stops leaves the snapshots and warnings of a run without them."""

from __future__ import annotations

import os
from pathlib import Path

import h5py
import numpy as np
import pytest
import viscoelastic_case as vc

import asperity
from asperity import runner


def go(case: Path, rows: int | None = None, *, restart: bool = False,
       killed: bool = False) -> list[str]:
    """Run rows, to the end or to a stop as by a signal or a kill; return the warnings."""
    handle, _, _, _, message = runner._open(os.fsencode(case), b"", b"", 1, int(restart), 0)
    lines = [message]
    finished, done = False, 0
    while not finished and done != rows:
        finished, *_, message = runner._step(handle, np.zeros(0, np.int32))
        lines.append(message)
        done += 1
    if not finished and not killed:
        runner._interrupt(handle)
    runner._close(handle)
    return [line for text in lines for line in text.decode().strip().splitlines()]


def snapshots(case: Path) -> list[str]:
    """Return the names of a result's snapshots, which the XDMF file must have as well."""
    with h5py.File(case.with_suffix(".h5")) as file:
        names = sorted(file["snapshots"])
    message = case.with_suffix(".xdmf").read_text()
    assert [name for name in names if f"/snapshots/{name}/" in message] == names
    assert message.count("<Time ") == len(names)
    return names


OUTPUTS = ["snapshot_every = 5", "snapshot_times = 0, 0.011, 0.06, 0.15", ""]


@pytest.mark.parametrize("output", OUTPUTS)
def test_snapshots_after_stops(tmp_path: Path, output: str) -> None:
    """A stop writes a snapshot, which is removed when the run continues."""
    whole, parts = tmp_path / "whole.nml", tmp_path / "parts.nml"
    for case in (whole, parts):
        case.write_text(vc.text(steps=8, size=24, output=output or "compression = 0"))
    go(whole)
    row = 0
    for rows in (3, 3, 0, 5, 0, 0, 1, 4):  # some at rows 5 and 10, some without a row
        go(parts, rows, restart=row > 0)
        row += rows
        names = snapshots(parts)
        assert names[-1] == f"{row - 1:06d}"
        due = [name for name in snapshots(whole) if int(name) < row]
        assert [name for name in names if name != names[-1] or name in due] == due
        with h5py.File(parts.with_suffix(".h5")) as file:
            for name, snapshot in file["snapshots"].items():
                assert ("at_stop" in snapshot.attrs) == (name not in due)
    go(parts, restart=True)
    assert snapshots(parts) == snapshots(whole)
    vc.assert_same(parts.with_suffix(".h5"), whole.with_suffix(".h5"))


PULLED = """
&grid nx = 48, ny = 48, lx = 1e-3 /
&surface shape = 'self_affine', hurst = 0.8, rms_slope = 0.2, wavelength_long = 0.25e-3 /
&material shear_modulus = 1e6, thickness = 1e-3, density = 1000 /
&friction law = 'coulomb', coefficient = 0.3 /
&phase pressure = 1e5 /
&phase duration = 1e-3, traction_x = 1e5, steps = 20 /
&output checkpoint_every = 2 /
"""

SWINGING = """
&grid nx = 48, ny = 1, lx = 1e-3, ly = 1e-3 /
&surface shape = 'sine', amplitude = 3e-5, wavelength = 0.5e-3 /
&material poisson = 0.5, shear_modulus = 1e6, thickness = 2e-2 /
&friction law = 'coulomb', coefficient = 0.5 /
&phase pressure = 0.15e6 /
&phase velocity_x = 1, duration = 9e-3, steps = 180 /
&solver passes = 1, coupling_tolerance = 100, interpolation = 'linear' /
"""

OVER_THE_EDGE = """
&grid nx = 24, ny = 24, lx = 0.3e-3, boundary = 'free' /
&surface shape = 'paraboloid', radius = 1e-3 /
&material shear_modulus = 1e6, prony_g = 1e6, prony_tau = 1e-3 /
&phase force = 1e-3, duration = 1e-3, steps = 4 /
&phase velocity_x = 0.02, duration = 6e-3, steps = 10 /
"""


def test_a_stop_just_after_a_restart_writes_no_wrong_slip(tmp_path: Path) -> None:
    """The slip is not part of the checkpoint, so that there is no snapshot before the next row."""
    case = tmp_path / "parts.nml"
    case.write_text(SWINGING)
    go(case, 6)
    names = snapshots(case)
    assert names[-1] == "000005"
    assert np.abs(asperity.open(case.with_suffix(".h5")).snapshots[-1].slip_x).max() > 0
    go(case, 0, restart=True)
    assert snapshots(case) == names[:-1]
    go(case, 1, restart=True)
    assert snapshots(case) == [*names[:-1], "000006"]


@pytest.mark.parametrize("text, word", [(SWINGING, "numerical stick-slip"),
                                        (OVER_THE_EDGE, "edge")])
def test_warnings_after_stops(tmp_path: Path, text: str, word: str) -> None:
    """The checkpoint contains the warnings so far: none is lost or repeated."""
    whole, parts = tmp_path / "whole.nml", tmp_path / "parts.nml"
    for case in (whole, parts):
        case.write_text(text)
    wanted = [line for line in go(whole) if word in line]
    assert len(wanted) in (1, 2), wanted
    found = go(parts, 4)
    while not asperity.open(parts.with_suffix(".h5")).finished:
        found += go(parts, 4, restart=True)
    assert [line for line in found if word in line] == wanted
    vc.assert_same(parts.with_suffix(".h5"), whole.with_suffix(".h5"))


def test_warnings_after_a_kill(tmp_path: Path) -> None:
    """A killed run writes no warnings into its result, so that the checkpoint contains them."""
    whole, parts = tmp_path / "whole.nml", tmp_path / "parts.nml"
    for case in (whole, parts):
        case.write_text(PULLED)
    go(whole)
    wanted = asperity.open(whole.with_suffix(".h5")).warnings
    assert "the pull moves the road by" in wanted[0]
    for rows, restart in ((4, False), (3, True)):  # the first checkpoint is that of row 2
        go(parts, rows, restart=restart, killed=True)
        with h5py.File(parts.with_suffix(".h5")) as file:
            assert "run_warnings" not in file.attrs
    go(parts, restart=True)
    assert asperity.open(parts.with_suffix(".h5")).warnings == wanted
    vc.assert_same(parts.with_suffix(".h5"), whole.with_suffix(".h5"))


def test_a_checkpoint_that_was_changed_is_refused(tmp_path: Path) -> None:
    """A program that writes into a checkpoint makes it differ from the one that the run wrote."""
    case = tmp_path / "case.nml"
    case.write_text(vc.text(steps=4, size=24))
    go(case, 3)
    with h5py.File(tmp_path / "case.checkpoint.h5", "a") as file:
        assert file["state/passes/first_mismatch"].attrs["long_name"]
        del file["state/passes/first_mismatch"]
    with pytest.raises(OSError, match=r"case\.checkpoint\.h5.*damaged"):
        asperity.run(case, restart=True)


def test_contact_before_the_road_moves(tmp_path: Path) -> None:
    """With friction all cells in contact stick until the road moves; without it all slip."""
    case = tmp_path / "case.nml"
    for law, state in (("&friction law = 'coulomb', coefficient = 0.5 /", 1), ("", 2)):
        case.write_text(SWINGING.replace("&friction law = 'coulomb', coefficient = 0.5 /", law)
                        .replace("steps = 180", "steps = 2") + "&output snapshot_every = 1 /\n")
        go(case)
        run = asperity.open(case.with_suffix(".h5"))
        first = run.snapshots[0]
        np.testing.assert_array_equal(first.contact, np.where(first.pressure > 0, state, 0))
        assert (run.history["stick_area"][0] == run.history["contact_area"][0]) == (state == 1)


def test_outcome_and_warnings_are_kept(tmp_path: Path) -> None:
    """The result says how the run ended and what it warned of, also after a stop on the way."""
    whole, parts = tmp_path / "whole.nml", tmp_path / "parts.nml"
    for case in (whole, parts):
        case.write_text(SWINGING)
    go(whole)
    run = asperity.open(whole.with_suffix(".h5"))
    assert run.outcome == "finished"
    swings = [line for line in run.warnings if "numerical stick-slip" in line]
    assert len(swings) == 1
    step = int(swings[0].removeprefix("step ").split(",")[0])
    go(parts, step + 3)
    stopped = asperity.open(parts.with_suffix(".h5"))
    assert stopped.outcome == f"stopped after step {step + 2}"
    assert stopped.warnings == run.warnings
    go(parts, 1, restart=True)
    go(parts, restart=True)
    assert asperity.open(parts.with_suffix(".h5")).warnings == run.warnings
    assert asperity.open(parts.with_suffix(".h5")).outcome == "finished"


def test_outcome_of_a_failure(tmp_path: Path) -> None:
    """The result of a run that does not converge says at which step, and why."""
    case = tmp_path / "case.nml"
    case.write_text(SWINGING.replace("passes = 1", "passes = 1, max_iterations = 6"))
    with pytest.raises(asperity.NotConverged, match="did not converge"):
        asperity.run(case, quiet=True)
    outcome = asperity.open(case.with_suffix(".h5")).outcome
    assert outcome.startswith("step ")
    assert "the solver did not converge" in outcome
