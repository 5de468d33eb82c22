"""A run that stops and continues has the same numbers as one without a stop."""

from __future__ import annotations

import os
import random
import re
import resource
import shutil
import signal
import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest
import viscoelastic_case as vc
from conftest import PATIENCE

import asperity
from asperity.results.standing import how_to_continue


@pytest.fixture(scope="module")
def reference(program: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the result of a run without a stop."""
    case = tmp_path_factory.mktemp("whole") / "case.nml"
    case.write_text(vc.text())
    done = vc.run(program, case)
    assert done.returncode == 0, done.stderr
    return case.with_suffix(".h5")


@pytest.fixture
def case(tmp_path: Path) -> Path:
    """Return the input of the run of `reference`."""
    path = tmp_path / "case.nml"
    path.write_text(vc.text())
    return path


def stop(program: str, case: Path, rows: int, number: signal.Signals = signal.SIGTERM) -> None:
    """Start a run and stop it once it has written some rows."""
    process = vc.start(program, case)
    vc.wait_for_rows(process, case.with_suffix(".h5"), rows, number)
    _, message = process.communicate(timeout=PATIENCE)
    assert process.returncode == 128 + number, (process.returncode, message)
    assert "--restart" in message


@pytest.mark.parametrize("scheme", ["exponential2", "exponential", "backward_euler"])
def test_schemes(program: str, tmp_path: Path, scheme: str) -> None:
    whole, parts = tmp_path / "whole.nml", tmp_path / "parts.nml"
    for path in (whole, parts):
        path.write_text(vc.text(scheme=scheme))
    assert vc.run(program, whole).returncode == 0
    for rows in (1, 20, 45):
        done = vc.start(program, parts, *(["--restart"] if rows > 1 else []))
        vc.wait_for_rows(done, parts.with_suffix(".h5"), rows, signal.SIGTERM)
        done.communicate(timeout=PATIENCE)
        assert done.returncode == 128 + signal.SIGTERM
    assert vc.run(program, parts, "--restart").returncode == 0
    vc.assert_same(parts.with_suffix(".h5"), whole.with_suffix(".h5"))


def test_a_finished_run_leaves_no_checkpoint(program: str, reference: Path) -> None:
    assert sorted(path.name for path in reference.parent.iterdir()) == [
        "case.h5", "case.nml", "case.xdmf"]
    done = vc.run(program, reference.with_suffix(".nml"), "--restart")
    assert done.returncode == 3 and "case.h5: the run is complete" in done.stderr


def test_killed_before_the_root_group_was_written(program: str, tmp_path: Path) -> None:
    """HDF5 writes the superblock first: the file that a kill then leaves is replaced."""
    case = tmp_path / "case.nml"
    case.write_text(vc.text())
    # Version 2, base 0, no extension, end of file at 0x13ec, root group at 0x1000, checksum.
    superblock = ("894844460d0a1a0a 02080801 0000000000000000 ffffffffffffffff ec13000000000000"
                  "0010000000000000 b398dd51")
    beginning = tmp_path / "case.h5.new"
    beginning.write_bytes(bytes.fromhex(superblock).ljust(8475, b"\0"))
    process = vc.start(program, case)
    _, message = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, message
    assert not beginning.exists()


GROUPS = ["snapshots", "checkpoint", "grid", "history", "losses", "material", "surface"]


@pytest.mark.parametrize(("groups", "replaced"), [
    (GROUPS, True),
    (["snapshots"], True),
    (["snapshots", "grid", "measurement"], False),
    (["surface"], False),
])
def test_killed_before_the_attributes_were_written(
        program: str, tmp_path: Path, reference: Path, groups: list[str], replaced: bool) -> None:
    """A kill may leave all groups of a result without any attribute; other files are kept."""
    with h5py.File(reference) as file:
        assert set(file) <= set(GROUPS)  # a new group has to be added to the test and the program
    case = tmp_path / "case.nml"
    case.write_text(vc.text())
    beginning = tmp_path / "case.h5.new"
    with h5py.File(beginning, "w") as file:
        for group in groups:
            file.create_group(group)
    process = vc.start(program, case)
    _, message = process.communicate(timeout=PATIENCE)
    assert process.returncode == (0 if replaced else 3), message
    assert beginning.exists() == (not replaced)
    assert replaced or "was not written by Asperity" in message


def test_killed_at_any_moment(program: str, tmp_path: Path, reference: Path) -> None:
    """After each kill -9 the result can be opened, and the continued run has the same numbers."""
    case = tmp_path / "case.nml"
    case.write_text(vc.text(output="checkpoint_every = 3, checkpoint_minutes = 0"))
    result = case.with_suffix(".h5")
    chance = random.Random(4)
    kills = 0
    for _ in range(60):
        restart = case.with_suffix(".checkpoint.h5").exists()
        before = vc.count(result) if restart else 0
        process = vc.start(program, case, "--restart" if restart else "--overwrite")
        if kills < 12:
            if restart:
                vc.wait_for_rows(process, result, max(before - 3, 1))
            try:
                process.wait(chance.uniform(0.0, 0.06))
            except vc.subprocess.TimeoutExpired:
                process.kill()
                kills += 1
        _, message = process.communicate(timeout=PATIENCE)
        if process.returncode == 0:
            break
        assert process.returncode == -signal.SIGKILL, message
        if case.with_suffix(".checkpoint.h5").exists():
            rows = vc.count(result)
            assert rows >= 0, "the result does not open"
            assert not asperity.open(result).finished
    assert process.returncode == 0
    assert kills > 3
    vc.assert_same(result, reference)


def test_other_case(program: str, case: Path) -> None:
    """A checkpoint of another case is refused, and the message says what differs."""
    stop(program, case, 5)
    rows = vc.count(case.with_suffix(".h5"))
    for old, new, names in (
        ("shear_modulus = 0.5e6", "shear_modulus = 0.6e6", ["&material: shear_modulus is 500000"]),
        ("prony_tau = 1e-3", "prony_tau = 2e-3", ["prony_tau"]),
        ("seed = 3", "seed = 4", ["seed", "3", "4"]),
        ("velocity_y = -7e-3", "velocity_y = 7e-3", ["&phase 2: velocity_y is "]),
        ("nx = 48", "nx = 50", ["nx", "48", "50"]),
        ("time_scheme = 'exponential2'", "time_scheme = 'exponential'", ["time_scheme"]),
    ):
        other = vc.text().replace(old, new)
        assert other != vc.text()
        case.write_text(other)
        done = vc.run(program, case, "--restart")
        assert done.returncode == 2, done.stderr
        for name in names:
            assert name in done.stderr, done.stderr
        assert vc.count(case.with_suffix(".h5")) == rows
    # settings that do not affect the numbers may change
    case.write_text(vc.text(output="checkpoint_every = 7").replace("threads = 1", "threads = 2"))
    assert vc.run(program, case, "--restart").returncode == 0


def write_map(folder: Path, heights: np.ndarray) -> None:
    """Write the height map of the cases below."""
    with h5py.File(folder / "map.h5", "w") as file:
        file["surface/height"] = heights


def stopped_case(program: str, folder: Path, name: str, extra: str = "") -> Path:
    """Start a case whose road is a map in a file, stop it after some rows, and return its input."""
    case = folder / f"{name}.nml"
    case.write_text(vc.text(size=24, extra=extra).replace(
        "shape = 'self_affine', hurst = 0.8, wavelength_long = 0.6e-3,\n"
        "   wavelength_short = 0.15e-3, rms_height = 4e-6, seed = 3",
        "shape = 'file', file = 'map.h5'"))
    assert "map.h5" in case.read_text()
    process = vc.start(program, case)
    vc.wait_for_rows(process, case.with_suffix(".h5"), 3, signal.SIGTERM)
    process.communicate(timeout=PATIENCE)
    assert process.returncode == 143
    return case


def test_other_height_map(program: str, tmp_path: Path) -> None:
    """A map with the same values in other places, so the same rms height and summit, is refused."""
    heights = 4e-6 * np.random.default_rng(1).standard_normal((17, 24))
    write_map(tmp_path, heights)
    case = stopped_case(program, tmp_path, "case")
    write_map(tmp_path, heights[::-1])
    done = vc.run(program, case, "--restart")
    assert done.returncode == 2, done.stderr
    assert "&surface 1: checksum of the height map is" in done.stderr
    write_map(tmp_path, heights)
    assert vc.run(program, case, "--restart").returncode == 0


def test_restart_from_another_folder(program: str, tmp_path: Path) -> None:
    """The path of a height map as the program sees it depends on the folder of its start."""
    write_map(tmp_path, 4e-6 * np.random.default_rng(1).standard_normal((17, 24)))
    case = stopped_case(program, tmp_path, "case")
    done = subprocess.run([program, "run", case.name, "--restart", "--quiet"], cwd=tmp_path,
                          capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0, done.stderr


def test_result_of_another_run(program: str, tmp_path: Path) -> None:
    """A checkpoint continues only the result that it was written for."""
    heights = 4e-6 * np.random.default_rng(1).standard_normal((17, 24))
    write_map(tmp_path, heights)
    case = stopped_case(program, tmp_path, "case")
    other = stopped_case(program, tmp_path, "other")
    shutil.copy(case.with_suffix(".h5"), tmp_path / "kept.h5")
    shutil.copy(other.with_suffix(".h5"), case.with_suffix(".h5"))
    done = vc.run(program, case, "--restart")
    assert done.returncode == 2, done.stderr
    assert "case.h5: is not the result that" in done.stderr
    assert (case.with_suffix(".h5").read_bytes() == other.with_suffix(".h5").read_bytes())
    case.with_suffix(".h5").write_bytes(b"")
    done = vc.run(program, case, "--restart")
    assert done.returncode == 3, done.stderr
    assert "case.h5: is empty: --overwrite starts" in done.stderr
    assert case.with_suffix(".h5").read_bytes() == b""
    shutil.copy(tmp_path / "kept.h5", case.with_suffix(".h5"))
    assert vc.run(program, case, "--restart").returncode == 0


def test_no_checkpoint(program: str, case: Path) -> None:
    done = vc.run(program, case, "--restart")
    assert done.returncode == 3
    assert "case.checkpoint.h5" in done.stderr
    assert not case.with_suffix(".h5").exists()


def test_damaged_checkpoint(program: str, case: Path) -> None:
    stop(program, case, 5)
    checkpoint = case.with_suffix(".checkpoint.h5")
    whole = checkpoint.read_bytes()
    checkpoint.write_bytes(whole[: len(whole) // 2])
    rows = vc.count(case.with_suffix(".h5"))
    done = vc.run(program, case, "--restart")
    assert done.returncode == 3, done.stderr
    assert "case.checkpoint.h5" in done.stderr
    assert vc.count(case.with_suffix(".h5")) == rows


def test_checkpoint_without_its_result(program: str, case: Path) -> None:
    stop(program, case, 5)
    case.with_suffix(".h5").unlink()
    done = vc.run(program, case, "--restart")
    assert done.returncode == 3, done.stderr
    assert "case.h5" in done.stderr


def test_output_elsewhere(program: str, case: Path, tmp_path: Path, reference: Path) -> None:
    """--restart continues the result given by --output."""
    elsewhere = tmp_path / "folder"
    elsewhere.mkdir()
    process = vc.start(program, case, "--output", str(elsewhere / "road.h5"))
    vc.wait_for_rows(process, elsewhere / "road.h5", 10, signal.SIGTERM)
    process.communicate(timeout=PATIENCE)
    assert process.returncode == 143
    done = vc.run(program, case, "--restart", "--output", str(elsewhere / "road.h5"))
    assert done.returncode == 0, done.stderr
    vc.assert_same(elsewhere / "road.h5", reference)


def test_file_too_large(program: str, case: Path, reference: Path) -> None:
    """On a full disk a run ends with status 3 and keeps its rows; with space it continues."""
    case.write_text(vc.text(output="checkpoint_every = 5, snapshot_every = 2"))
    size = reference.stat().st_size
    done = vc.run(program, case, preexec_fn=lambda: resource.setrlimit(
        resource.RLIMIT_FSIZE, (3 * size, resource.RLIM_INFINITY)))
    assert done.returncode == 3, (done.returncode, done.stderr)
    assert "case.h5" in done.stderr
    rows = vc.count(case.with_suffix(".h5"))
    assert 5 < rows < vc.rows()
    assert not asperity.open(case.with_suffix(".h5")).finished
    done = vc.run(program, case, "--restart")
    assert done.returncode == 0, done.stderr
    vc.assert_same(case.with_suffix(".h5"), reference)


def test_nowhere_to_write(program: str, case: Path, tmp_path: Path) -> None:
    missing = tmp_path / "missing" / "result.h5"
    done = vc.run(program, case, "--output", str(missing))
    assert done.returncode == 3
    assert done.stderr.splitlines()[-1] == (
        f'{missing}: cannot be written: there is no folder "{missing.parent}"')
    done = vc.run(program, case, "--output", "/proc/version")
    assert done.returncode == 3
    assert "/proc/version" in done.stderr
    if os.geteuid() != 0:  # root may write everywhere
        folder = tmp_path / "locked"
        folder.mkdir(mode=0o500)
        assert vc.run(program, case, "--output", str(folder / "result.h5")).returncode == 3


def test_no_convergence(program: str, tmp_path: Path) -> None:
    """The run ends with status 4, keeps its rows, and its file says that it is not finished."""
    case = tmp_path / "case.nml"
    case.write_text(vc.text(extra=", max_iterations = 1, tolerance = 1e-9"))
    done = vc.run(program, case)
    assert done.returncode == 4
    assert re.search(r"case\.h5: step \d+ of phase 1.*did not converge", done.stderr), done.stderr
    history, fields, finished = vc.contents(case.with_suffix(".h5"))
    assert finished == 0
    assert len(history["step"]) >= 1
    assert history["residual_normal"][-1] > 1e-9
    assert "pressure" in fields


def test_checkpoint_is_not_touched_by_a_failing_write(program: str, case: Path,
                                                      tmp_path: Path) -> None:
    """If a checkpoint cannot be written, the previous one is kept."""
    stop(program, case, 5)
    checkpoint = case.with_suffix(".checkpoint.h5")
    kept = tmp_path / "kept.h5"
    shutil.copy(checkpoint, kept)
    done = vc.run(program, case, "--restart", preexec_fn=lambda: resource.setrlimit(
        resource.RLIMIT_FSIZE, (checkpoint.stat().st_size // 4, resource.RLIM_INFINITY)))
    assert done.returncode == 3, (done.returncode, done.stderr)
    assert checkpoint.read_bytes() == kept.read_bytes()
    assert vc.run(program, case, "--restart").returncode == 0


EVERYTHING = """
&grid nx = 48, ny = 28, lx = 500e-6 /
&surface shape = 'sine', amplitude = 2e-6, wavelength = 500e-6 /
&material shear_modulus = 1e6, prony_g = 4e6, 1e6, prony_tau = 4e-5, 1e-3,
  thickness = 2e-3, density = 20 /
&adhesion potential = 'exponential', energy = 0.05, range = 2e-6 /
&friction law = 'coulomb', coefficient = 0.6 /
&phase pressure = 0.3e6, duration = 1e-4, steps = 4 /
&phase velocity_x = 1, velocity_y = 0.3, duration = 2e-4 /
&output checkpoint_every = 3, snapshot_every = 10 /
"""


def test_friction_adhesion_and_inertia(program: str, tmp_path: Path) -> None:
    """Every part of the state survives a kill, in all bits."""
    whole, parts = tmp_path / "whole.nml", tmp_path / "parts.nml"
    for path in (whole, parts):
        path.write_text(EVERYTHING)
    assert vc.run(program, whole).returncode == 0
    process = vc.start(program, parts)
    vc.wait_for_rows(process, parts.with_suffix(".h5"), 12, signal.SIGKILL)
    process.communicate(timeout=PATIENCE)
    assert process.returncode == -signal.SIGKILL
    assert vc.run(program, parts, "--restart").returncode == 0
    vc.assert_same(parts.with_suffix(".h5"), whole.with_suffix(".h5"))
    h = asperity.open(whole.with_suffix(".h5")).history
    kept = h["energy_elastic"] + h["energy_adhesive"] + h["energy_kinetic"]
    lost = h["dissipated_viscous"] + h["dissipated_friction"]
    balance = h["work_normal"] + h["work_tangential"] - kept - lost
    # To round-off, or to the tangential solver's tolerance if its last return map has an effect.
    assert abs(balance).max() < 1e-6 * abs(kept).max()


SHORT = """
    &grid nx = 16, ny = 16, lx = 1e-3 /
    &surface shape = 'sine', wavelength = 1e-3, amplitude = 1e-5 /
    &material shear_modulus = 1e6, prony_g = 1e6, prony_tau = 0.1 /
    &phase pressure = 1e4, duration = 0.3, steps = 3 /
    """


def test_a_snapshot_is_not_written_again(tmp_path: Path) -> None:
    """The time of the first row is 0.1 s within round-off, but smaller."""
    case = tmp_path / "case.nml"
    case.write_text(SHORT + "&output snapshot_times = 0.1 /")
    assert [each.step for each in asperity.run(case).snapshots] == [1, 3]
    parts = asperity.run(case, callback=lambda row, sim: row.step < 1, overwrite=True)
    assert not parts.finished and [each.step for each in parts.snapshots] == [1]
    assert [each.step for each in asperity.run(case, restart=True).snapshots] == [1, 3]


@pytest.mark.parametrize("name", ["run.v2", "run", "run.h5"])
def test_the_checkpoint_of_any_name_is_found(tmp_path: Path, name: str) -> None:
    """Python used to look for run.checkpoint.h5 only, and said that there is no checkpoint."""
    case = tmp_path / "case.nml"
    case.write_text(SHORT + f"&output file = '{name}' /")
    run = asperity.run(case, callback=lambda row, sim: row.step < 1)
    assert how_to_continue(run) == "--restart continues from the last checkpoint"
