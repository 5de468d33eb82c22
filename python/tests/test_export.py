"""Snapshots are exported to other programs, and results have readable representations."""

import sys
from html.parser import HTMLParser

import h5py
import numpy as np
import pytest
import vtk
from conftest import write_result
from vtk.util.numpy_support import vtk_to_numpy

import asperity


def test_to_xarray(frictional):
    run = asperity.open(frictional)
    snapshot = run.snapshots[-1]
    data = snapshot.to_xarray()
    assert set(data.data_vars) == set(snapshot.fields)
    assert dict(data.sizes) == {"y": 16, "x": 24}
    for name in snapshot.fields:
        np.testing.assert_array_equal(data[name].values, snapshot[name])
        assert data[name].attrs["units"] == snapshot.units(name)
    np.testing.assert_array_equal(data.x, run.grid.x)
    np.testing.assert_array_equal(data.y, run.grid.y)
    assert data.x.attrs["units"] == data.y.attrs["units"] == "m"
    assert (float(data.time), int(data.step)) == (snapshot.time, 5)
    assert (data.attrs["title"], data.attrs["lx"]) == ("Sample", 2.4e-3)
    # Typical uses must work: selecting by place, and joining in time.
    assert float(data.pressure.sel(x=2.31e-3, y=0.0, method="nearest")) == snapshot.pressure[0, 23]
    import xarray
    joined = xarray.concat([each.to_xarray() for each in run.snapshots], dim="time",
                           coords="different", compat="equals")
    assert joined.pressure.shape == (2, 16, 24)
    np.testing.assert_array_equal(joined.time, [0.0, snapshot.time])


def test_to_xarray_without_xarray(result, monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(ImportError, match="python -m pip install xarray"):
        asperity.open(result).snapshots[-1].to_xarray()


def read_vtk(path):
    """Return the image that VTK reads, and the errors that it reported."""
    reader = vtk.vtkXMLImageDataReader()
    errors = []
    reader.AddObserver("ErrorEvent", lambda *_: errors.append("error"))
    reader.SetFileName(str(path))
    assert reader.CanReadFile(str(path))
    reader.Update()
    return reader.GetOutput(), errors


@pytest.mark.parametrize("ny", [16, 1])
def test_to_vtk_is_what_vtk_reads(tmp_path, ny):
    path = write_result(tmp_path / "result.h5", ny=ny, moving=True)
    with h5py.File(path, "a") as file:
        group = file["snapshots/000005"]
        group["traction_y"] = 0.5 * group["pressure"][()]
    run = asperity.open(path)
    snapshot = run.snapshots[-1]
    target = snapshot.to_vtk(tmp_path / "step5")
    assert target == tmp_path / "step5.vti"
    image, errors = read_vtk(target)
    assert errors == []
    grid = run.grid
    assert image.GetDimensions() == (25, ny + 1, 1)
    np.testing.assert_allclose(image.GetSpacing()[:2], [grid.dx, grid.dy], rtol=1e-15)
    # The centre of the first cell lies at 0, that of the last at the end of the grid.
    for cell, place in ((0, (0.0, 0.0)), (24 * ny - 1, (grid.x[-1], grid.y[-1]))):
        box = image.GetCell(cell).GetBounds()
        centre = ((box[0] + box[1]) / 2, (box[2] + box[3]) / 2)
        np.testing.assert_allclose(centre, place, atol=1e-12)
    cells = image.GetCellData()
    for name in snapshot.fields:
        values = vtk_to_numpy(cells.GetArray(name)).reshape(ny, 24)
        np.testing.assert_array_equal(values, snapshot[name])
    assert cells.GetArray("contact").GetDataType() in (vtk.VTK_SIGNED_CHAR, vtk.VTK_CHAR)
    vectors = vtk_to_numpy(cells.GetArray("traction")).reshape(ny, 24, 3)
    np.testing.assert_array_equal(vectors[..., 0], snapshot.traction_x)
    np.testing.assert_array_equal(vectors[..., 1], snapshot.traction_y)
    assert not np.any(vectors[..., 2])
    assert cells.GetArray("slip") is None
    assert cells.GetScalars().GetName() == "pressure"
    assert image.GetFieldData().GetArray("TimeValue").GetValue(0) == snapshot.time
    assert image.GetFieldData().GetArray("step").GetValue(0) == 5


def test_to_vtk_errors(result, tmp_path):
    snapshot = asperity.open(result).snapshots[-1]
    with pytest.raises(ValueError, match=r"has the ending \.vti"):
        snapshot.to_vtk(tmp_path / "step.vtk")
    with pytest.raises(FileNotFoundError):
        snapshot.to_vtk(tmp_path / "nowhere" / "step.vti")


class Cells(HTMLParser):
    """Collects the cells of a table and checks that elements are closed in order."""

    def __init__(self, text):
        super().__init__()
        self.stack, self.cells, self.curves = [], [], 0
        self.feed(text)
        self.close()
        assert self.stack == []

    def handle_starttag(self, tag, attributes):
        assert tag not in ("script", "link", "style")
        if tag == "br":
            return
        self.stack.append(tag)
        self.curves += tag == "polyline"
        if tag == "td":
            self.cells.append("")

    def handle_startendtag(self, tag, attributes):
        self.curves += tag == "polyline"

    def handle_endtag(self, tag):
        assert self.stack.pop() == tag

    def handle_data(self, data):
        if "td" in self.stack:
            self.cells[-1] += data


def test_notebooks_show_tables(frictional):
    with h5py.File(frictional, "a") as file:
        file.attrs["title"] = "Rubber <on> road"
        file.attrs["warnings"] = "&grid: one\n&grid: two"
    run = asperity.open(frictional)
    shown = Cells(run._repr_html_())
    assert "Rubber &lt;on&gt; road" in run._repr_html_()
    assert "finished, 6 rows" in shown.cells
    assert "24 × 16 cells, 2.4 mm × 1.6 mm, periodic" in shown.cells
    assert "2 (steps 0, 5)" in shown.cells
    assert "50 kPa " in shown.cells and "0.3 " in shown.cells
    assert shown.curves == 4
    assert "&grid: one&grid: two" in "".join(shown.cells)

    shown = Cells(run.history._repr_html_())
    columns = len(shown.cells) // 6
    assert [shown.cells[6 * row] for row in range(columns)] == list(run.history)
    at = 6 * list(run.history).index("pressure")
    assert shown.cells[at:at + 6] == ["pressure", "50 kPa", "1 kPa", "50 kPa", "",
                                      "mean normal pressure"]

    shown = Cells(run.snapshots[-1]._repr_html_())
    assert shown.cells[::3] == list(run.snapshots[-1].fields)
    assert "step 5, t = 5 ms" in run.snapshots[-1]._repr_html_()


def test_an_empty_history_can_be_shown(tmp_path):
    path = write_result(tmp_path / "early.h5", finished=0)
    with h5py.File(path, "a") as file:
        file.attrs["expected_rows"] = np.int32(9)
        for column in file["history"].values():
            column.resize((0,))
        del file["snapshots"]
    run = asperity.open(path)
    assert "not finished, 0 of 9 rows" in Cells(run._repr_html_()).cells
    assert Cells(run.history._repr_html_()).cells[0] == "step"
    with pytest.raises(IndexError, match=r"it holds none.*snapshot_every"):
        run.snapshots[-1]


def test_messages_say_what_to_do(result):
    snapshot = asperity.open(result).snapshots[-1]
    with pytest.raises(KeyError, match="tangential fields are stored with `&friction`"):
        snapshot["slip_x"]
    with pytest.raises(AttributeError, match="`&output snapshot_fields` chooses"):
        _ = snapshot.displacement_z


def test_many_snapshots_are_shown_in_short(tmp_path):
    path = write_result(tmp_path / "many.h5", rows=40)
    with h5py.File(path, "a") as file:
        for step in (5, *range(10, 39)):
            file[f"snapshots/{step:06d}"] = file["snapshots/000000"]
    run = asperity.open(path)
    assert repr(run.snapshots) == "32 snapshots (steps 0, 5, 10, 11, 12, ..., 37, 38, 39)"
    assert "32 (steps 0, 5, 10, 11, 12, …, 37, 38, 39)" in Cells(run._repr_html_()).cells


def test_completion_of_names(frictional):
    run = asperity.open(frictional)
    assert {"friction", "stick_area", "rows", "units"} <= set(dir(run.history))
    assert {"history", "snapshots", "plot", "report"} <= set(dir(run))
    assert {"traction_x", "plot", "to_vtk", "to_xarray"} <= set(dir(run.snapshots[-1]))
    assert run.history.friction[-1] == run.history["friction"][-1]
    assert "pressure" in run.snapshots[-1]._ipython_key_completions_()
