"""A killed run leaves a result that can be opened and holds all that was flushed."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from pathlib import Path

import h5py
import numpy as np
import pytest
from viscoelastic_case import wait_for_rows

ROOT = Path(__file__).resolve().parents[2]
ENDINGS = (".h5", ".checkpoint.h5", ".xdmf")

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="uses LD_PRELOAD")


@pytest.fixture(scope="module")
def writer() -> str:
    """Return the driver of the Fortran tests, which can also write small results."""
    if named := os.environ.get("ASPERITY_CHECK"):
        return named
    found = sorted(ROOT.glob("build/gfortran_*/test/check"), key=lambda path: path.stat().st_mtime)
    if not found:
        pytest.fail("the Fortran tests are not built: run ./test.sh")
    return str(found[-1])


@pytest.fixture(scope="module")
def shim(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Compile a library that inspects the files, or kills the run, between two calls that write."""
    library = tmp_path_factory.mktemp("shim") / "kill_after.so"
    subprocess.run(["gcc", "-O1", "-shared", "-fPIC", "-o", library,
                    Path(__file__).with_name("kill_after.c"), "-ldl"], check=True)
    return str(library)


def inspect(path: Path, live: bool = False) -> tuple[int, int]:
    """Check everything that a result contains; return its numbers of rows and snapshots.

    While a run is writing, snapshots may appear after this process opened the file and read its
    length. These can only be read after the file is opened again.
    """
    with h5py.File(path, "r") as file:
        columns = {name: file["history"][name][:] for name in file["history"]}
        rows = min(map(len, columns.values()))
        for name, factor, start in (("step", 1, 0), ("time", 0.25, 0), ("friction", 1, 1)):
            values = columns[name]
            assert np.array_equal(values, start + factor * np.arange(len(values))), name
        assert file.attrs["title"] == "a small run"
        snapshots = 0
        for name in file["snapshots"]:
            try:
                step = inspect_snapshot(name, file["snapshots"][name])
            except (KeyError, OSError):
                if live:
                    break
                raise
            snapshots += 1
            assert live or step < rows
        if not live and "checkpoint" in list(file):
            state = file["checkpoint"]
            last = int(state["state/step"][()])
            assert last < rows
            assert state["state/pressure"][0, 0] == 1000 * last
        return rows, snapshots


def inspect_snapshot(name: str, group: h5py.Group) -> int:
    """Check everything that a snapshot contains, and return its step."""
    step = group.attrs["step"]
    assert int(name) == step
    pressure = 1000 * step + 10 * np.arange(4)[:, None] + np.arange(7)
    # The fields are read here, because np.array_equal takes a failed read for a difference.
    assert np.array_equal(group["pressure"][:], pressure)
    assert np.array_equal(group["gap"][:], -pressure)
    assert group["contact"].dtype == np.int8
    assert group["contact"][0, 1] == 1
    assert group["gap"].attrs["units"] == "m"
    return step


def inspect_live(path: Path) -> tuple[int, int]:
    """Inspect a result during the run, when it may grow between two readings of its length."""
    for _ in range(20):
        try:
            return inspect(path, live=True)
        except (KeyError, OSError):
            continue
    return inspect(path, live=True)


@pytest.mark.parametrize("compression", ["0", "4"])
def test_every_moment(tmp_path: Path, writer: str, shim: str, compression: str) -> None:
    """Inspect the files before every call that changes one, because a kill leaves this state."""
    result = tmp_path / "x.h5"
    shots = tmp_path / "shots"
    for restart in ([], ["restart"]):
        shots.mkdir()
        environment = os.environ | {
            "LD_PRELOAD": shim,
            "WATCH_FOLDER": str(shots),
            "WATCH_FILES": ":".join(str(result.with_suffix(ending)) for ending in ENDINGS),
        }
        subprocess.run([writer, "writer", str(result), "6", compression, *restart],
                       env=environment, check=True)
        last = (0, 0)
        seen = set()
        for moment in sorted({name.name.split("-")[0] for name in shots.iterdir()}):
            view = tmp_path / "view"
            view.mkdir()
            for number, ending in enumerate(ENDINGS):
                shot = shots / f"{moment}-{number}"
                if shot.exists():
                    shot.rename((view / "x.h5").with_suffix(ending))
            if (view / "x.h5").exists():
                now = inspect(view / "x.h5")
                if not restart:
                    assert now >= last, f"call {moment} loses something"
                last = now
                seen.add(now)
                if (view / "x.xdmf").exists():
                    ET.parse(view / "x.xdmf")
            shutil.rmtree(view)
        shutil.rmtree(shots)
        assert last == (6, 2)
        if restart:
            assert (4, 2) in seen
        else:
            assert {(rows, (rows + 1) // 3) for rows in range(1, 7)} <= seen
    assert inspect(result) == (6, 2)


def test_killed(tmp_path: Path, writer: str) -> None:
    """Kill a long run at random times, inspect the result, and continue from the checkpoint."""
    result = tmp_path / "x.h5"
    random = np.random.default_rng(1)
    rows = []
    for _ in range(8):
        run = subprocess.Popen([writer, "writer", str(result), "400", "0"])
        wait_for_rows(run, result, int(random.integers(0, 60)))
        time.sleep(random.uniform(0, 0.005))
        reading = inspect_live(result)
        run.send_signal(signal.SIGKILL)
        run.wait()
        found = inspect(result)
        assert found[0] >= reading[0]
        rows.append(found[0])
        state = result.with_suffix(".checkpoint.h5")
        if state.exists():
            with h5py.File(state, "r") as file:
                last = int(file["state/step"][()])
            subprocess.run([writer, "writer", str(result), str(min(last + 3, 400)), "0", "restart"],
                           check=True)
            assert inspect(result)[0] == min(last + 3, 400)
            state.unlink()
        result.unlink()
    assert max(rows) > 10


@pytest.mark.parametrize("compression", ["0", "4"])
def test_full_disk(tmp_path: Path, writer: str, compression: str) -> None:
    """If files may not grow, the run ends with an error that says why, and all rows are kept."""
    result = tmp_path / "x.h5"
    subprocess.run([writer, "writer", str(result), "60", compression], check=True)
    size = result.stat().st_size
    result.unlink()
    seen = []
    for part in (0.02, 0.2, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99):
        limit = int(part * size)
        run = subprocess.run(
            [writer, "writer", str(result), "60", compression], capture_output=True, text=True,
            check=False,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))  # noqa: B023
        assert run.returncode == 3
        assert any(word in run.stderr for word in ("File too large", "cannot grow"))
        if result.exists():
            seen.append(inspect(result)[0])
            result.unlink()
    assert seen == sorted(seen)
    assert seen[-1] > 5


def test_a_result_that_cannot_be_begun(tmp_path: Path, program: str) -> None:
    """If not even the first pages fit there is one message, status 3, and no file remains."""
    case = tmp_path / "case.nml"
    case.write_text("&grid nx = 64, ny = 64, lx = 1. /\n&surface shape = 'sphere', radius = 2. /\n"
                    "&material shear_modulus = 1. /\n&phase pressure = 1e-3 /\n")
    for limit in (0, 1000, 20000, 40000):
        run = subprocess.run(
            [program, "run", str(case), "--quiet"], capture_output=True, text=True, check=False,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))  # noqa: B023
        assert run.returncode == 3, run.stderr
        assert run.stderr.startswith(f"{case.with_suffix('.h5')}: ")
        assert sorted(path.name for path in tmp_path.iterdir()) == ["case.nml"]
