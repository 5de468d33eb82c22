"""The XDMF file beside a result, read by VTK as ParaView reads it."""

from __future__ import annotations

import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest
from test_kill import writer  # noqa: F401

xdmf = pytest.importorskip("vtkmodules.vtkIOXdmf2")


def test_snapshots(tmp_path: Path, writer: str) -> None:  # noqa: F811
    """Times, grid and fields are those of the result; x varies along the rows of the arrays."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline

    result = tmp_path / "a & b.h5"
    subprocess.run([writer, "writer", str(result), "8", "3"], check=True)
    reader = xdmf.vtkXdmfReader()
    reader.SetFileName(str(result.with_suffix(".xdmf")))
    reader.UpdateInformation()
    information = reader.GetExecutive().GetOutputInformation(0)
    times = information.Get(Pipeline.TIME_STEPS())
    with h5py.File(result, "r") as file:
        snapshots = list(file["snapshots"].values())
        assert times == tuple(snapshot.attrs["time"] for snapshot in snapshots)
        ny, nx = file["surface/height"].shape
        assert nx != ny
        for snapshot in snapshots:
            information.Set(Pipeline.UPDATE_TIME_STEP(), float(snapshot.attrs["time"]))
            reader.Update()
            image = reader.GetOutputDataObject(0)
            assert image.GetDimensions() == (nx, ny, 1)
            assert image.GetOrigin() == (0, 0, 0)
            x, y = file["grid/x"][:], file["grid/y"][:]
            assert image.GetSpacing()[:2] == (x[1], y[1])
            points = image.GetPointData()
            fields = {name: data for name, data in snapshot.items() if not data.is_scale}
            fields["height"] = file["surface/height"]
            assert points.GetNumberOfArrays() == len(fields)
            for name, data in fields.items():
                values = vtk_to_numpy(points.GetArray(name)).reshape(ny, nx)
                assert np.array_equal(values, data), name
            assert image.FindPoint(x[2], y[1], 0) == nx + 2
