"""For readers of netCDF every axis of a result has its coordinates, and none is invented."""

from __future__ import annotations

import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

import asperity

CASE = """
&grid nx = 16, ny = 12, lx = 1.6e-3, ly = 1.2e-3 /
&surface shape = 'sine', amplitude = 1e-5, wavelength = 0.8e-3 /
&material shear_modulus = 1e6, prony_g = 2e6, 1e6, prony_tau = 1e-3, 1e-2 /
{friction}
&phase pressure = 2e4 /
&phase duration = 0.01, steps = 4, velocity_x = 0.03, velocity_y = -0.05 /
{steady}
&solver interpolation = 'linear' /
&output snapshot_every = 2 /
"""


@pytest.fixture(params=["free of friction", "with friction"])
def path(request: pytest.FixtureRequest, program: str, tmp_path: Path) -> Path:
    """Return the result of a run that slides in steps of time and then steadily."""
    rubs = request.param == "with friction"
    case = tmp_path / "y.nml"
    case.write_text(CASE.format(
        friction="&friction law = 'coulomb', coefficient = 0.1 /" if rubs else "",
        steady="&phase steady = .true., velocity_x = 0.1 /"))
    done = subprocess.run([program, "run", case, "--quiet"], capture_output=True, text=True,
                          check=False)
    assert done.returncode == 0, done.stderr
    return tmp_path / "y.h5"


def test_every_axis_has_a_scale(path: Path) -> None:
    """Both ends of each link agree, as HDF5's own library requires."""
    links = 0
    with h5py.File(path) as file:
        def look(name: str, item: h5py.Dataset | h5py.Group) -> None:
            nonlocal links
            if not isinstance(item, h5py.Dataset) or item.is_scale:
                return
            for axis in range(item.ndim):
                (scale,) = item.dims[axis].values()
                assert scale.is_scale and scale.parent == item.parent, name
                assert h5py.h5ds.is_attached(item.id, scale.id, axis), name
                assert scale.shape == item.shape[axis:axis + 1], name
                links += 1

        file.visititems(look)
        pressure = file["snapshots/000002/pressure"]
        assert [axis[0].name for axis in pressure.dims] == [
            "/snapshots/000002/y", "/snapshots/000002/x"]
        assert h5py.h5ds.get_scale_name(file["grid/x"].id) == b"x"
    assert links > 60


@pytest.mark.parametrize("engine", ["h5netcdf", "netcdf4"])
def test_xarray_opens_groups(path: Path, engine: str) -> None:
    """Fields have axes y and x in metres, and columns have the axis step."""
    run = asperity.open(path)
    snapshot = run.snapshots[-1]
    with xarray.open_dataset(path, group=f"snapshots/{snapshot.step:06d}", engine=engine) as data:
        assert set(data.data_vars) == set(snapshot.fields)
        for name in snapshot.fields:
            assert data[name].dims == ("y", "x")
            np.testing.assert_array_equal(data[name], snapshot[name])
        np.testing.assert_array_equal(data.x, run.grid.x)
        np.testing.assert_array_equal(data.y, run.grid.y)
        assert data.x.attrs["units"] == "m"
    with xarray.open_dataset(path, group="history", engine=engine) as data:
        assert set(data.coords) == {"step", "time", "phase"}
        assert data.friction.dims == ("step",)
        np.testing.assert_array_equal(data.time, run.history["time"])
    with xarray.open_datatree(path, engine=engine) as tree:
        sizes = {str(name) for node in tree.subtree for name in node.dataset.sizes}
    assert sizes == {"x", "y", "step", "prony_tau", "wavelength"}


def test_axes_are_not_fields(path: Path) -> None:
    """Snapshots list fields only."""
    snapshot = asperity.open(path).snapshots[0]
    assert "x" not in snapshot and "y" not in snapshot.fields
    assert {"contact", "road_height"} < set(snapshot.fields)


def test_road_under_the_rubber(path: Path) -> None:
    """The road of a snapshot has moved by the distance that the history gives."""
    run = asperity.open(path)
    wave = 2 * np.pi / 0.8e-3
    for snapshot in run.snapshots[1:-1]:
        row = snapshot.step
        x = run.grid.x - run.history["road_x"][row]
        if "displacement_x" in snapshot:
            x = x + snapshot.displacement_x
        # The reference is linear between eight cells of a wave.
        error = snapshot.road_height - 1e-5 * np.cos(wave * (x - 0.8e-3))
        assert np.abs(error).max() < 1e-5 * (np.pi / 8)**2 / 2
        level = run.history["displacement"][row] - run.height.max()
        np.testing.assert_allclose(snapshot.gap, np.maximum(
            snapshot.displacement_z - snapshot.road_height - level, 0.0), atol=1e-15)
    assert np.array_equal(run.snapshots[0].road_height, run.height)
    assert run.snapshots[1].plot("road_height").get_title().startswith("Height of the road")


def test_road_that_never_moves(program: str, tmp_path: Path) -> None:
    """If the road never moves, a snapshot has the road of the result, with its own axes."""
    case = tmp_path / "case.nml"
    case.write_text("&grid nx = 48, ny = 32, lx = 1e-3 /\n"
                    "&surface shape = 'self_affine', hurst = 0.8, rms_height = 1e-6,"
                    " wavelength_long = 5e-4, wavelength_short = 1e-4 /\n"
                    "&material shear_modulus = 1e6 /\n"
                    "&phase pressure = 1e4 /\n&phase pressure = 2e4 /\n")
    subprocess.run([program, "run", case, "--quiet"], check=True)
    run = asperity.open(tmp_path / "case.h5")
    for snapshot in run.snapshots:
        assert np.array_equal(snapshot.road_height, run.height) and np.ptp(run.height) > 0.0
        with h5py.File(tmp_path / "case.h5") as file:
            field = file[f"snapshots/{snapshot.step:06d}/road_height"]
            assert field.attrs["units"] == "m" and "present position" in field.attrs["long_name"]
            assert [scale[0].name for scale in field.dims] == [
                f"/snapshots/{snapshot.step:06d}/{axis}" for axis in "yx"]
