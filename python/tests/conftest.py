"""Fixtures of the Python tests."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import matplotlib
import numpy as np
import pytest
from hypothesis import settings

matplotlib.use("Agg")

# Hypothesis generates the same examples every time, so that a test that passed passes again.
settings.register_profile("repeatable", derandomize=True)
settings.load_profile("repeatable")

ROOT = Path(__file__).resolve().parents[2]
# Seconds after which a test stops waiting. It is long because a busy machine may be slow.
PATIENCE = 300


@pytest.fixture(scope="session")
def root() -> Path:
    """Return the root of the source tree."""
    return ROOT


@pytest.fixture(scope="session")
def program() -> str:
    """Return the path of the built program.

    ``ASPERITY_PROGRAM`` names another one; otherwise it is the one that belongs to the package:
    built beside an editable installation or installed with the wheel.
    """
    candidates = [
        os.environ.get("ASPERITY_PROGRAM"),
        ROOT / ".venv" / "python" / "asperity",
        Path(sys.executable).parent / "asperity",
        shutil.which("asperity"),
    ]
    for candidate in candidates:
        if candidate and Path(candidate).is_file():
            return str(candidate)
    pytest.fail("the program is not built: run ./test.sh")


@pytest.fixture(scope="session")
def road(program, tmp_path_factory):
    """Return a folder with the README's case, road.nml, and its result, road.h5."""
    folder = tmp_path_factory.mktemp("road")
    text = (ROOT / "README.md").read_text()
    (case,) = re.findall(r"```fortran\n(.*?)```", text, flags=re.DOTALL)
    (folder / "road.nml").write_text(case)
    checked = subprocess.run([program, "check", "road.nml"], cwd=folder, check=True,
                             capture_output=True, text=True)
    assert checked.stderr == ""
    subprocess.run([program, "run", "road.nml", "--quiet"], cwd=folder, check=True)
    return folder


def write_result(path, *, nx=24, ny=16, lx=2.4e-3, ly=1.6e-3, rows=6, moving=False,
                 finished=1, boundary="periodic"):
    """Write a file with the layout of a result, whose fields are given by formulas."""
    x = np.arange(nx) * lx / nx
    y = np.arange(ny) * ly / ny
    height = 2e-6 * np.cos(2 * np.pi * x / lx) * np.cos(2 * np.pi * y / ly)[:, None]
    with h5py.File(path, "w") as file:
        file.attrs.update(
            title="Sample", program="asperity", version="0.1.0", finished=np.int32(finished),
            created="2026-01-01T00:00:00Z", input="&surface shape = 'self_affine' /\n")
        grid = file.create_group("grid")
        grid.attrs.update(nx=np.int32(nx), ny=np.int32(ny), lx=lx, ly=ly, boundary=boundary)
        grid["x"], grid["y"] = x, y
        file["surface/height"] = height
        file["material/shear_modulus"] = 1e6
        file["material/poisson"] = 0.5
        file["material/prony_g"] = np.zeros(0)
        history = file.create_group("history")
        load = np.linspace(1e3, 5e4, rows)
        columns = {
            "contact_area": (np.sqrt(load / 1e5), "1", "fraction of the grid in contact"),
            "friction": (0.3 * moving * np.linspace(0, 1, rows), "1", "friction coefficient"),
            "phase": (np.ones(rows, np.int32), "1", "number of the phase"),
            "pressure": (load, "Pa", "mean normal pressure"),
            "step": (np.arange(rows, dtype=np.int32), "1", "number of the row"),
            "time": (1e-3 * moving * np.arange(rows), "s", "time"),
            "work_normal": (1e-9 * np.arange(rows), "J", "work of the normal traction"),
        }
        for name, (values, units, long_name) in columns.items():
            # The last column is one row short, as if the run were writing a row at this moment.
            kept = values[:-1] if name == "work_normal" and not finished else values
            item = history.create_dataset(name, data=kept, maxshape=(None,), chunks=(64,))
            item.attrs.update(units=units, long_name=long_name)
        for step in (0, rows - 1):
            group = file.create_group(f"snapshots/{step:06d}")
            group.attrs.update(step=np.int32(step), time=columns["time"][0][step],
                               phase=np.int32(1))
            pressure = np.maximum(height, 0.0) * 1e11 + np.zeros((ny, nx))
            contact = (pressure > 0).astype(np.int8) * (1 + (x > lx / 2))
            fields = {"pressure": (pressure, "Pa"), "gap": (np.maximum(-height, 0.0), "m"),
                      "traction_x": (0.3 * pressure * np.sign(x - lx / 2), "Pa"),
                      "contact": (contact.astype(np.int8), "1")}
            for name, (values, units) in fields.items():
                item = group.create_dataset(name, data=values)
                item.attrs.update(units=units, long_name=f"the {name}")
    return path


@pytest.fixture
def result(tmp_path):
    """Return the path of a result of an elastic contact under a growing load."""
    return write_result(tmp_path / "rough.h5")


def frictional_result(path, **options):
    """Write a result of sliding with friction: `write_result` and the columns of friction."""
    write_result(path, moving=True, **options)
    with h5py.File(path, "a") as file:
        history = file["history"]
        rows = len(history["step"])
        part = np.linspace(0, 1, rows)
        lost, rubbed, stored = 4e-9 * part**2, 9e-9 * part**2, 2e-9 * part
        work = stored + lost + rubbed
        work[-1] *= 1.001  # the energy balance has an error of a thousandth
        del history["work_normal"]
        columns = {
            "friction_viscous": (0.08 * part, "1"),
            "stick_area": (0.1 * (1 - part), "1"),
            "sliding_speed": (0.015 * part, "m/s"),
            "road_x": (2e-5 * np.arange(rows), "m"),
            "road_y": (np.zeros(rows), "m"),
            "work_normal": (0.25 * work, "J"),
            "work_tangential": (0.75 * work, "J"),
            "energy_elastic": (stored, "J"),
            "energy_adhesive": (np.zeros(rows), "J"),
            "energy_kinetic": (np.zeros(rows), "J"),
            "dissipated_viscous": (lost, "J"),
            "dissipated_friction": (rubbed, "J"),
            "iterations_normal": (np.arange(rows, dtype=np.int32) + 7, "1"),
            "iterations_tangential": (np.arange(rows, dtype=np.int32) + 9, "1"),
            "residual_normal": (np.full(rows, 3e-7), "1"),
            "residual_tangential": (np.full(rows, 2e-7), "1"),
            "seconds": (np.full(rows, 0.25), "s"),
        }
        for name, (values, units) in columns.items():
            item = history.create_dataset(name, data=values, maxshape=(None,), chunks=(64,))
            item.attrs.update(units=units, long_name=name.replace("_", " "))
        for group in file["snapshots"].values():
            item = group.create_dataset("traction_y", data=0.1 * group["pressure"][()])
            item.attrs.update(units="Pa", long_name="traction along y")
    return path


@pytest.fixture
def frictional(tmp_path):
    """Return the path of a result of sliding with friction."""
    return frictional_result(tmp_path / "friction.h5")
