"""Measured topographies reach the program as the instrument wrote them, in metres."""

import hashlib
import json
import os
import re
import struct
import subprocess
import sys

import h5py
import numpy as np
import pytest
from conftest import PATIENCE, write_result

import asperity
from asperity.__main__ import main
from asperity.measured import channels
from asperity.surface import import_topography, load

SurfaceTopography = pytest.importorskip("SurfaceTopography")

NX, NY = 23, 14
LX, LY = 46.0, 21.0  # um: cells of 2 um x 1.5 um


def sample(nx=NX, ny=NY):
    """Return an uneven map (ny, nx), in um, that differs from all its mirror and rotated images."""
    j, i = np.mgrid[0:ny, 0:nx]
    return 0.3 * np.sin(0.7 * i) + 0.05 * j**1.5 + 0.01 * i * j + 0.2 * (i == 3) * (j == 10)


def topography(height, sizes=(LX, LY), unit="um", missing=None, **options):
    """Return SurfaceTopography's object, whose arrays have x as the first index."""
    array = height.T
    if missing is not None:
        array = np.ma.masked_array(array, missing.T)
    return SurfaceTopography.Topography(array, sizes, unit=unit, **options)


def write_sdf(path, height):
    """Write an ISO 25178-71 text file: one profile along x after the other, in m."""
    text = ["aISO-1.0", "ManufacID = tests", "CreateDate = 010120261200",
            "ModDate = 010120261200", f"NumPoints = {NX}", f"NumProfiles = {NY}",
            f"Xscale = {LX / NX * 1e-6!r}", f"Yscale = {LY / NY * 1e-6!r}", "Zscale = 1e-9",
            "Zresolution = -1", "Compression = 0", "DataType = 7", "CheckType = 0", "*"]
    text += [" ".join("BAD" if np.isnan(z) else repr(float(1e3 * z)) for z in row)
             for row in height]
    path.write_text("\n".join([*text, "*"]) + "\n")


def write_bcr(path, height):
    """Write a BCR-STM file: a text header of 2048 bytes, then 16-bit numbers of 0.01 nm."""
    step = 0.5  # nm a bit
    head = (f"fileformat = bcrstm\nheadersize = 2048\nxpixels = {NX}\nypixels = {NY}\n"
            f"xlength = {LX * 1e3}\nylength = {LY * 1e3}\nxunit = nm\nyunit = nm\nzunit = nm\n"
            f"bit2nm = {step}\nintelmode = 1\n")
    counts = np.round(1e3 * height / step).astype("<i2")
    path.write_bytes(head.encode().ljust(2048, b"\n") + counts.tobytes())


def write_xyz(path, height):
    """Write coordinates and heights in columns, with the unit in a comment."""
    y, x = np.mgrid[0:NY, 0:NX]
    rows = np.column_stack([x.ravel() * LX / NX, y.ravel() * LY / NY, height.ravel()])
    np.savetxt(path, rows)


WRITERS = {
    "map.nc": lambda path, h: topography(h).to_netcdf(str(path)),
    "map.x3p": lambda path, h: topography(h).to_x3p(str(path)),
    "map.gwy": lambda path, h: topography(h).to_gwy(str(path)),
    "map.asc": lambda path, h: topography(h).to_matrix(str(path)),
    "map.npy": lambda path, h: np.save(path, h.T),
    "map.sdf": write_sdf,
    "map.bcr": write_bcr,
    "map.xyz": write_xyz,
}
EXTRA = {"map.npy": {"unit": "um", "size": (LX, LY)}, "map.xyz": {"unit": "um"}}
EXACT = {"map.bcr": 0.26e-9}  # m: half a bit


@pytest.mark.parametrize("name", WRITERS)
def test_formats_bring_heights_lengths_and_orientation(tmp_path, name):
    """Row j of the file's map is row j of the dataset, so a transpose or a mirror would be seen."""
    height = sample()
    WRITERS[name](tmp_path / name, height)
    surface = import_topography(tmp_path / name, tmp_path / "s.h5", level="none",
                                **EXTRA.get(name, {}))
    with h5py.File(tmp_path / "s.h5") as file:
        data = file["surface/height"]
        assert data.shape == (NY, NX)
        assert data.attrs["units"] == "m"
        np.testing.assert_allclose(data[:], 1e-6 * height, rtol=0, atol=EXACT.get(name, 1e-15))
        for group in (data, file["grid"]):
            assert group.attrs["lx"] == pytest.approx(LX * 1e-6, rel=1e-12)
            assert group.attrs["ly"] == pytest.approx(LY * 1e-6, rel=1e-12)
        assert (file["grid"].attrs["nx"], file["grid"].attrs["ny"]) == (NX, NY)
        raw = (tmp_path / name).read_bytes()
        assert file.attrs["source_name"] == name
        assert file.attrs["source_bytes"] == len(raw)
        assert file.attrs["source_sha256"] == hashlib.sha256(raw).hexdigest()
        assert file.attrs["source_format"] == name.split(".")[1]
        assert json.loads(file.attrs["steps"]) == surface.steps
        json.loads(file["source/metadata"][()])
    assert not (tmp_path / "s.h5.new").exists()


def matrix(height, separator=";", decimal=","):
    """Return heights as a spreadsheet writes them: one row of the file per row along x."""
    return "\n".join(separator.join("" if np.isnan(z) else f"{z:.9f}".replace(".", decimal)
                                    for z in row) for row in height) + "\n"


@pytest.mark.parametrize("separator, decimal, encoding, head", [
    (";", ",", "utf-8", ""), (",", ".", "utf-8", "Probe 7\nDatum, 12.3.2026\n"),
    (" ", ",", "utf-8", ""), (";", ".", "utf-16", "Instrument;A\nUnit;um\n")])
def test_matrices_of_spreadsheets(tmp_path, separator, decimal, encoding, head):
    """Separators, decimal commas, lines above the numbers and missing cells are understood."""
    height = sample()
    (tmp_path / "map.csv").write_text(head + matrix(height, separator, decimal), encoding=encoding)
    given = {"unit": "um", "size": (LX, LY), "level": "none"}
    surface = load(tmp_path / "map.csv", **given)
    np.testing.assert_allclose(surface.height, 1e-6 * height, atol=1e-15)
    assert (surface.lx, surface.ly, surface.source["format"]) == (LX * 1e-6, LY * 1e-6, "text")
    if separator == ";":
        height[4, 5] = np.nan
        text = head + matrix(height, separator, decimal).replace("\n", ";\n")
        (tmp_path / "map.csv").write_text(text, encoding=encoding)
        assert load(tmp_path / "map.csv", **given).steps[0]["missing"] == 1
    (tmp_path / "map.csv").write_text(matrix(height, ";") + "1;2\n")
    with pytest.raises(ValueError, match="line 15: has 2 columns, must have 23 as line 1"):
        load(tmp_path / "map.csv", **given)
    worse = matrix(height, ";") + matrix(height[:1], ";").replace("0", "o")
    (tmp_path / "map.csv").write_text(worse)
    with pytest.raises(ValueError, match=r"line 15: column \d+ = .*: must be a number"):
        load(tmp_path / "map.csv", **given)


def test_a_text_of_any_length_is_no_binary_map(tmp_path):
    """A text of 2 n^2 bytes (here 36 x 36) is not read as a binary format that has no signature."""
    text = matrix(sample()[:, :18])
    path = tmp_path / "map.csv"
    path.write_text(text + "#" * (2 * 72**2 - len(text)))
    assert path.stat().st_size == 2 * 72**2
    assert load(path, unit="um", size=(LX, LY)).height.shape == (NY, 18)
    path.write_bytes(bytes(range(256)) * 2)  # 16 x 16
    with pytest.raises(OSError, match=r"map\.csv: is of no known format"):
        load(path, unit="um", size=(LX, LY))
    path.write_bytes(b"")
    with pytest.raises(OSError, match=r"map\.csv: is empty"):
        load(path)


@pytest.mark.parametrize("text", ["# a\n# b\n", "# Channel: Topo\n# Width: 10 um\n\n#\n"])
@pytest.mark.parametrize("ending", ["txt", "xyz", "csv"])
def test_a_map_of_comments_only(tmp_path, text, ending):
    """It was said to be empty, and a text of 2 n^2 bytes to be of no known format."""
    path = tmp_path / f"map.{ending}"
    path.write_text(text)
    with pytest.raises(ValueError, match=rf"^{re.escape(str(path))}: holds only comments$"):
        load(path, unit="um", size=(LX, LY))


@pytest.mark.parametrize("heads", ["Y (mm),X (mm),Z (um)", "z_um,x_mm,y_mm", "Y,X,Z\nmm,mm,um"])
def test_headings_name_the_columns_of_points(tmp_path, heads):
    """Five cells along x and four along y, in whatever order the columns stand."""
    height = np.random.default_rng(1).integers(-50, 50, (4, 5)).astype(float)
    y, x = np.mgrid[0:4, 0:5]
    values = {"x": 0.5 * x.ravel(), "y": 0.25 * y.ravel(), "z": height.ravel()}
    order = [head.strip()[0].lower() for head in heads.split("\n")[0].split(",")]
    np.savetxt(tmp_path / "p.csv", np.column_stack([values[name] for name in order]), fmt="%.9g",
               header=heads, comments="", delimiter=",")
    found = load(tmp_path / "p.csv", level="none")
    assert (found.lx, found.ly) == pytest.approx((2.5e-3, 1e-3))
    np.testing.assert_allclose(found.height, 1e-6 * height)


def test_commas_between_thousands(tmp_path):
    """Whole numbers below 1000 without a comma show that commas do not mean decimals."""
    height = np.array([[12975.0, 604.0, 1030.0, 87.0], [-487.0, 2295.0, -20231.0, 5.0]])

    def table(numbers, mark):
        return "\n".join(mark.join(f'"{number:,.0f}"' for number in row) for row in numbers) + "\n"

    (tmp_path / "a.csv").write_text(table(height, ","))
    found = load(tmp_path / "a.csv", unit="nm", size=(4e4, 2e4), level="none")
    np.testing.assert_allclose(found.height, 1e-9 * height)
    (tmp_path / "b.csv").write_text(table(height + 1e5, ","))
    with pytest.raises(ValueError, match=r"112,975 may be a decimal number or one with a comma"):
        load(tmp_path / "b.csv", unit="nm", size=(4e4, 2e4))
    (tmp_path / "c.csv").write_text(table(height + 1e5, ";"))
    found = load(tmp_path / "c.csv", unit="um", size=(40, 20), level="none")
    np.testing.assert_allclose(found.height, 1e-9 * (height + 1e5))


def test_points_on_a_grid_with_holes(tmp_path):
    """A list of points leaves out those that were not measured; their places are filled."""
    y, x = np.mgrid[0:NY, 0:NX]
    plane = 0.5 * x - 0.25 * y
    rows = np.column_stack([x.ravel() * LX / NX, y.ravel() * LY / NY, plane.ravel()])
    kept = np.delete(rows, [40, 41, 200], axis=0)
    np.random.default_rng(1).shuffle(kept)
    np.savetxt(tmp_path / "points.xyz", kept, fmt="%.4f")
    surface = load(tmp_path / "points.xyz", unit="um", level="none")
    np.testing.assert_allclose(surface.height, 1e-6 * plane, atol=1e-18)
    assert (surface.lx, surface.ly) == pytest.approx((LX * 1e-6, LY * 1e-6), rel=1e-5)
    assert surface.steps[0] == {"step": "fill", "missing": 3, "points": NX * NY,
                                "share": 3 / (NX * NY)}
    (tmp_path / "points.csv").write_text("x (mm);y (mm);z (µm)\n" + "\n".join(
        f"{a * 1e-3:.5f};{b * 1e-3:.5f};{c:.4f}".replace(".", ",") for a, b, c in kept))
    units = load(tmp_path / "points.csv", level="none")
    np.testing.assert_allclose(units.height, 1e-6 * plane, atol=1e-18)
    assert units.lx == pytest.approx(LX * 1e-6, rel=1e-4) and units.unit == "um"
    np.savetxt(tmp_path / "points.xyz", np.vstack([kept, kept[:2]]))
    with pytest.raises(ValueError, match="2 points of the grid are given more than once"):
        load(tmp_path / "points.xyz", unit="um")
    np.savetxt(tmp_path / "points.xyz", np.random.default_rng(1).random((300, 3)))
    with pytest.raises(ValueError, match="the points lie on no regular grid: interpolate"):
        load(tmp_path / "points.xyz", unit="um")


MARKS = ["***", "---", "--", "#N/A", "1.#QNAN", "-1.#IND", "NULL", "-nan(ind)", "#DIV/0!",
         "OVL"]


@pytest.mark.parametrize("separator", [" ", "\t", ";"])
@pytest.mark.parametrize("mark", MARKS)
def test_marks_of_missing_values_lose_no_line(tmp_path, mark, separator):
    """Lines with such marks used to be left out of matrices without a separator."""
    rows = [["1", "2", "3", "4", "5"], [mark, "3", "4", "5", "6"], ["3", "4", "5", mark, "7"],
            ["4", "5", "6", "7", "8"], ["5", "6", "7", mark, "9"], ["6", "7", "8", "9", "10"]]
    (tmp_path / "map.txt").write_text("\n".join(map(separator.join, rows)) + "\n")
    found = load(tmp_path / "map.txt", unit="um", size=(5, 6), level="none")
    plane = 1.0 + np.arange(5) + np.arange(6)[:, None]
    known = np.array([[cell != mark for cell in row] for row in rows])
    np.testing.assert_allclose(found.height[known], 1e-6 * plane[known], rtol=1e-12)
    assert found.steps[0]["missing"] == 3
    (tmp_path / "line.txt").write_text("\n".join(["1", "2", mark, "4", "3", "2"]) + "\n")
    line = load(tmp_path / "line.txt", unit="um", size=6, level="none", max_missing=0.2)
    np.testing.assert_allclose(line.height, [[1e-6, 2e-6, 3e-6, 4e-6, 3e-6, 2e-6]], rtol=1e-12)
    (tmp_path / "scan.txt").write_text("\n".join(
        f"{i / 2}{separator}{mark if i == 3 else i}" for i in range(8)) + "\n")
    scan = load(tmp_path / "scan.txt", unit="um", level="none", max_missing=0.2)
    np.testing.assert_allclose(scan.height, [1e-6 * np.arange(8.0)], rtol=1e-12)
    assert scan.lx == pytest.approx(4e-6)


def test_words_in_a_text_map_are_errors(tmp_path):
    """The message names the line and the word, and two maps in one file are not joined."""
    path = tmp_path / "map.txt"
    given = {"unit": "um", "size": (5, 4), "level": "none"}
    lines = ["1 2 3 4 5", "2 3 4 5 6", "3 4 5 6 9", "4 5 6 7 1"]
    for text, words in (("2 o 4 5 6", "line 2: column 2 = 'o': must be a number"),
                        ("end of data", "line 2: has 3 columns, must have 5 as line 1"),
                        ("Map 2:", "line 2: has 2 columns, must have 5 as line 1")):
        path.write_text("\n".join([lines[0], text, *lines[1:]]))
        with pytest.raises(ValueError, match=words):
            load(path, **given)
    path.write_text("\n".join(["Map 1", *lines, "Map 2", *lines]))
    with pytest.raises(ValueError, match="line 6: has 2 columns, must have 5 as line 2"):
        load(path, **given)
    path.write_text("\n".join(["x z", "0 1", "1 2", "2 3", "3 o", "4 5"]))
    with pytest.raises(ValueError, match="line 5: column 2 = 'o': must be a number"):
        load(path, unit="um")
    path.write_text("\n".join([*lines[:1], "2 3 1,234 5 6", *lines[1:]]))
    np.testing.assert_allclose(load(path, **given).height[1, 2], 1.234e-6)
    path.write_text("\n".join([*lines[:1], "2 3 1,234 5.5 6", *lines[1:]]))
    np.testing.assert_allclose(load(path, **given).height[1, 2], 1234e-6)


@pytest.mark.parametrize("text, shape", [
    ("1 2 3 4\n2 3 4 5\n3 4 5 6\n", (3, 4)), ("1\t2\t3\t4\n2\t3\t4\t5\n3\t4\t5\t6\n", (3, 4)),
    ("1\n2\n3\n4\n", (1, 4)), ("0 1\n1 2\n2 3\n", (1, 3))])
def test_a_byte_order_mark_loses_no_line(tmp_path, text, shape):
    (tmp_path / "map.txt").write_text(text, encoding="utf-8-sig")
    size = {(3, 4): (4, 3), (1, 4): 4, (1, 3): None}[shape]
    assert load(tmp_path / "map.txt", unit="um", size=size, level="none").height.shape == shape


def test_headers_of_text_maps_are_kept(tmp_path):
    """Lengths and units are read although a value is missing, and so is each of two channels."""
    path = tmp_path / "map.txt"
    rows = "1 2 3 4\n2 --- 4 5\n3 4 5 6\n4 5 6 7\n"
    head = "# Channel: {}\n# Width: 8 um\n# Height: 2 um\n# Value units: nm\n"
    path.write_text(head.format("First") + rows + head.format("Second") + rows.replace("1", "9"))
    for channel, corner in ((None, 1e-9), ("First", 1e-9), ("Second", 9e-9)):
        found = load(path, channel=channel, level="none")
        assert (found.unit, found.lx, found.ly) == ("nm", 8e-6, 2e-6)
        assert found.height.shape == (4, 4) and found.height[0, 0] == pytest.approx(corner)
    points = "# Lateral units: mm\n# Value units: um\n" + "".join(
        f"{i} {j} {'***' if i == j == 2 else i + j}\n" for j in range(5) for i in range(4))
    path.write_text(points)
    found = load(path, level="none")
    assert (found.unit, found.lx, found.ly) == ("um", 4e-3, 5e-3)
    np.testing.assert_allclose(
        found.height, 1e-6 * (np.arange(4) + np.arange(5)[:, None]), atol=1e-18)


def test_a_width_alone_makes_square_pixels(tmp_path):
    path = tmp_path / "map.txt"
    path.write_text("# Width: 8 um\n# Value units: nm\n1 2 3 4\n2 3 4 5\n3 4 5 7\n")
    found = load(path, level="none")
    assert (found.lx, found.ly) == pytest.approx((8e-6, 6e-6))
    found = load(path, level="none", size=(8e3, 5e3))
    assert (found.lx, found.ly) == pytest.approx((8e-6, 5e-6))
    found = load(path, level="none", size=(5e3, 8e3), transpose=True)
    assert (found.lx, found.ly) == pytest.approx((5e-6, 8e-6)) and found.height.shape == (4, 3)
    with pytest.raises(ValueError, match=r"size: .* has its own length along x, 8000 nm"):
        load(path, size=(8.0, 5.0))


@pytest.mark.parametrize(("place", "word", "layout"), [
    ((0, 3), "0.1x4", " "), ((0, 3), "O.25", " "), ((0, 0), "-0.3l", ";"), ((0, 2), "0,1S2", ";")])
def test_a_typing_error_in_the_first_line_is_an_error(tmp_path, place, word, layout):
    """The line used to be taken for a heading, so that the map lost a row."""
    words = [[f"{value:.4f}" for value in row] for row in sample()]
    words[place[0]][place[1]] = word
    path = tmp_path / "map.txt"
    path.write_text("\n".join(layout.join(row) for row in words) + "\n")
    found = re.escape(f"line 1: column {place[1] + 1} = '{word}': must be a number")
    with pytest.raises(ValueError, match=found):
        load(path, unit="um", size=(2, 1))


def test_a_typing_error_in_the_first_point_is_an_error(tmp_path):
    path = tmp_path / "line.txt"
    path.write_text("x z\n0.0 0.1S\n" + "".join(f"{0.5 * i} {0.1 * i % 1}\n" for i in range(1, 30)))
    with pytest.raises(ValueError, match=r"line 2: column 2 = '0.1S': must be a number"):
        load(path, unit="um")


@pytest.mark.parametrize("corner", ["", "1", "y\\x [mm]"])
@pytest.mark.parametrize("separator", ["\t", ";", ","])
@pytest.mark.parametrize("height", [1.0, 1e-2])
def test_coordinates_beside_a_matrix_are_no_heights(tmp_path, corner, separator, height):
    """Also if the map is much longer than high, as most are."""
    x, y = 0.05 * np.arange(30), 0.1 * np.arange(20)
    heights = height * np.random.default_rng(1).normal(size=(20, 30))
    rows = [[corner, *(f"{value:.2f}" for value in x)],
            *([f"{at:.2f}", *(f"{value:.4f}" for value in row)]
              for at, row in zip(y, heights, strict=True))]
    path = tmp_path / "map.csv"
    path.write_text("\n".join(separator.join(row) for row in rows) + "\n")
    with pytest.raises(ValueError, match=r"its first (column|row) rises evenly from .*no heights"):
        load(path, unit="mm", size=(1.5, 2.0))


def test_outliers_are_noted(tmp_path):
    """Only `friction` used to tell them."""
    heights = np.add.outer(np.sin(np.arange(40.0)), np.cos(0.3 * np.arange(50.0)))
    np.savetxt(tmp_path / "map.txt", heights)
    assert not any("far off" in note
                   for note in load(tmp_path / "map.txt", unit="um", size=(2, 1)).notes)
    heights[20, 30] = 60.0
    np.savetxt(tmp_path / "map.txt", heights)
    notes = load(tmp_path / "map.txt", unit="um", size=(2, 1)).notes
    assert any(note.startswith("1 of 2000 cells lie far off their neighbours") for note in notes)


def test_marks_of_missing_points_are_no_heights(tmp_path):
    heights = sample()
    heights[1, 2] = heights[3, 3] = -9999.0
    np.savetxt(tmp_path / "map.txt", heights)
    with pytest.raises(ValueError, match=r"-9999 occurs 2 times, far from all other heights"):
        load(tmp_path / "map.txt", unit="um", size=(2, 1))
    heights[heights == -9999.0] = np.nan
    np.savetxt(tmp_path / "map.txt", heights)
    assert load(tmp_path / "map.txt", unit="um", size=(2, 1), max_missing=0.5).rms_height < 1e-5


@pytest.mark.parametrize(("step", "decimals"), [(0.25, 1), (2.47, 0), (0.1234, 2), (0.333, 3)])
def test_line_scans_with_rounded_coordinates(tmp_path, step, decimals):
    """They used to be refused if rounding moved points by more than a tenth of their distance."""
    kept = np.arange(400) % 37 != 5
    table = np.column_stack([step * np.arange(400.0), np.sin(np.arange(400.0))])[kept]
    np.savetxt(tmp_path / "line.txt", table, fmt=[f"%.{decimals}f", "%.6f"])
    found = load(tmp_path / "line.txt", unit="um", level="none")
    assert found.height.shape == (1, 400)
    assert found.lx == pytest.approx(4e-4 * step, rel=10.0**-decimals / (400 * step))
    np.testing.assert_allclose(found.height[0, kept], 1e-6 * table[:, 1], atol=1e-12)


@pytest.mark.parametrize("decimals", [1, 2, 12])
def test_uneven_distances_are_not_taken_for_rounded_ones(tmp_path, decimals):
    x = np.cumsum(np.random.default_rng(3).uniform(0.5, 1.5, 200))
    np.savetxt(tmp_path / "line.txt", np.column_stack([x, np.sin(x)]), fmt=f"%.{decimals}f")
    with pytest.raises(ValueError, match="line scan with points at uneven distances"):
        load(tmp_path / "line.txt", unit="um")


@pytest.mark.parametrize("order", ["falling", "shuffled", "counted"])
def test_points_of_a_line_scan_are_sorted(tmp_path, order):
    """Falling x used to give negative lengths."""
    x = 0.5 * np.arange(12)
    table = np.column_stack([x, np.sin(x)])
    if order == "counted":
        table = np.column_stack([np.arange(1, 13), table])
    elif order == "falling":
        table = table[::-1]
    else:
        np.random.default_rng(1).shuffle(table)
    np.savetxt(tmp_path / "line.txt", table)
    found = load(tmp_path / "line.txt", unit="um", level="none")
    np.testing.assert_allclose(found.height, [1e-6 * np.sin(x)], atol=1e-18)
    assert found.lx == pytest.approx(6e-6) and found.ly == pytest.approx(0.5e-6)
    np.savetxt(tmp_path / "line.txt", np.column_stack([1e-6 * x**1.5, x]))
    with pytest.raises(ValueError, match="line scan with points at uneven distances"):
        load(tmp_path / "line.txt", unit="m")


@pytest.mark.parametrize("head", ["X;Y;valid\n[mm];[um];[1/0]\n", "Scan Parameters\nID,a\nScan Data"
                                  "\n\nLateral um,Raw Micrometer,\n"])
def test_profilers_files_lose_no_line(tmp_path, head):
    """SurfaceTopography reads their headers, and used to leave out what was above a wrong value."""
    end = ";1" if ";" in head else ","
    separator = end[0]
    rows = [f"{i / 2}{separator}{i % 3}{end}" for i in range(9)]
    (tmp_path / "line.csv").write_text(head + "\n".join(rows) + "\n")
    assert load(tmp_path / "line.csv", level="none").height.shape == (1, 9)
    rows[4] = f"2.0{separator}***{end}"
    (tmp_path / "line.csv").write_text(head + "\n".join(rows) + "\n")
    with pytest.raises(ValueError, match="has 9 lines of numbers, but only 4 could be read"):
        load(tmp_path / "line.csv", level="none")


def test_one_column_and_impossible_heights_are_refused(tmp_path):
    np.save(tmp_path / "map.npy", np.ones((1, 8)))  # x first
    with pytest.raises(ValueError, match=r"has one cell along x: a run needs at least 2; transp"):
        load(tmp_path / "map.npy", unit="um", size=(1, 8))
    turned = load(tmp_path / "map.npy", unit="um", size=(8, 1), transpose=True)
    assert turned.height.shape == (1, 8)
    height = sample()
    height[3, 5] = -np.finfo(float).max
    np.save(tmp_path / "map.npy", height.T)
    with pytest.raises(ValueError, match=r"height\[3, 5\] = -1\.79769e\+308 \(row 3, column 5"):
        load(tmp_path / "map.npy", unit="um", size=(LX, LY))


def test_own_files_are_imported_unchanged(tmp_path):
    """Files that `import` wrote and roads of results have rows along x, units and lengths."""
    topography(sample()).to_netcdf(str(tmp_path / "map.nc"))
    first = import_topography(tmp_path / "map.nc", tmp_path / "s.h5", level="tilt")
    again = load(tmp_path / "s.h5", level="none")
    np.testing.assert_array_equal(again.height, first.height)
    assert (again.lx, again.ly, again.unit, again.periodic) == (first.lx, first.ly, "m", False)
    assert again.source["metadata"]["source_name"] == "map.nc"
    assert "levelled (tilt)" in again.source["metadata"]["steps_text"]
    assert channels(tmp_path / "s.h5") == [
        "'surface/height': map of heights, 23 x 14 points, unit m"]
    result = load(write_result(tmp_path / "run.h5"), level="none")
    np.testing.assert_array_equal(result.height, asperity.open(tmp_path / "run.h5").height)
    assert result.periodic and (result.lx, result.ly) == (2.4e-3, 1.6e-3)
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["z"] = sample().T
    other = load(tmp_path / "other.h5", unit="um", size=(LX, LY), level="none")
    np.testing.assert_allclose(other.height, 1e-6 * sample(), rtol=1e-14)


def test_readers_that_try_a_file_print_nothing(tmp_path, capfd):
    """The messages of a reader that tries a file in vain are not shown to the user."""
    (tmp_path / "any.bin").write_bytes(bytes(range(256)) * 4 + b"1")
    topography(sample()).to_netcdf(str(tmp_path / "map.nc"))
    assert main(["import", str(tmp_path / "any.bin")]) == 3
    printed = capfd.readouterr()
    assert printed.out == ""
    assert printed.err == (f"asperity: {tmp_path / 'any.bin'}: is of no format that"
                           " SurfaceTopography knows\n")
    assert main(["import", str(tmp_path / "map.nc"), "--list"]) == 0
    assert capfd.readouterr().err == ""


def test_metadata_of_the_instrument_are_kept(tmp_path):
    topography(sample()).to_x3p(str(tmp_path / "map.x3p"), manufacturer="Zeta and Sons")
    import_topography(tmp_path / "map.x3p", tmp_path / "s.h5")
    with h5py.File(tmp_path / "s.h5") as file:
        assert "Zeta and Sons" in file["source/metadata"][()].decode()


@pytest.mark.parametrize("unit, metres", [("m", 1.0), ("mm", 1e-3), ("um", 1e-6), ("µm", 1e-6),
                                          ("nm", 1e-9), ("pm", 1e-12)])
def test_units(tmp_path, unit, metres):
    topography(sample(), unit=unit).to_netcdf(str(tmp_path / "map.nc"))
    surface = load(tmp_path / "map.nc", level="none")
    np.testing.assert_allclose(surface.height, metres * sample(), rtol=1e-15)
    assert surface.lx == pytest.approx(LX * metres, rel=1e-15)
    assert surface.ly == pytest.approx(LY * metres, rel=1e-15)
    assert surface.unit == unit.replace("µ", "u")


def test_lengths_of_own_files_are_exact(tmp_path):
    """Other files sum their lengths over cells, which leaves rounding errors."""
    asperity.surface.save(tmp_path / "map.h5", sample(), 1e-3 / 3, 2e-3 / 7)
    found = load(tmp_path / "map.h5", level="none")
    assert (found.lx, found.ly) == (1e-3 / 3, 2e-3 / 7)


def test_unit_and_size_that_a_file_lacks(tmp_path):
    path = tmp_path / "map.npy"
    np.save(path, sample().T)
    with pytest.raises(ValueError, match=r"map\.npy: names no unit and gives no lengths: give both"
                                         r".*--unit um --size LX LY"):
        load(path)
    with pytest.raises(ValueError, match=r"map\.npy: names no unit of length: give one.*--unit"):
        load(path, size=(1.0, 1.0))
    with pytest.raises(ValueError, match=r"map\.npy: gives no lengths: give them.*--size"):
        load(path, unit="nm")
    with pytest.raises(ValueError, match="size: has 1 length, must have 2"):
        load(path, unit="nm", size=3.0)
    with pytest.raises(ValueError, match="unit = 'furlong': must be one of"):
        load(path, unit="furlong", size=(1, 1))
    assert load(path, unit="nm", size=(LX, LY)).lx == LX * 1e-9
    topography(sample()).to_netcdf(str(tmp_path / "map.nc"))
    with pytest.raises(ValueError, match=r"unit = 'nm': .*map\.nc has its own unit, 'um'"):
        load(tmp_path / "map.nc", unit="nm")
    with pytest.raises(ValueError, match=r"size: .*map\.nc has its own, 46 x 21 um"):
        load(tmp_path / "map.nc", size=(1.0, 1.0))
    assert load(tmp_path / "map.nc", unit="µm").lx == pytest.approx(LX * 1e-6)


def test_transpose_takes_arrays_as_images_have_them(tmp_path):
    np.save(tmp_path / "map.npy", sample())  # (ny, nx)
    surface = load(tmp_path / "map.npy", unit="um", size=(LX, LY), transpose=True, level="none")
    np.testing.assert_allclose(surface.height, 1e-6 * sample(), rtol=1e-14)
    assert (surface.lx, surface.ly) == (LX * 1e-6, LY * 1e-6)
    topography(sample()).to_netcdf(str(tmp_path / "map.nc"))
    turned = load(tmp_path / "map.nc", transpose=True, level="none")
    np.testing.assert_allclose(turned.height, 1e-6 * sample().T, rtol=1e-14)
    assert (turned.lx, turned.ly) == pytest.approx((LY * 1e-6, LX * 1e-6))


def test_only_edges_that_do_not_fit_are_said_not_to(tmp_path):
    """A file without a mark of periodicity may hold a periodic map all the same."""
    x = np.arange(96) / 96
    whole = np.sin(4 * np.pi * x)[:, None] + np.cos(2 * np.pi * np.arange(40) / 40)[None, :]
    half = np.sin(np.pi * x)[:, None] + np.arange(40)[None, :] / 40
    notes = {}
    for name, heights in (("whole", whole), ("half", half), ("flat", np.ones((96, 40)))):
        np.save(tmp_path / f"{name}.npy", heights)
        notes[name] = load(tmp_path / f"{name}.npy", unit="um", size=(960.0, 400.0)).notes
    assert "although opposite edges fit" in notes["whole"][-1]
    assert "opposite edges do not fit" in notes["half"][-1]
    assert not any("do not fit" in note for note in notes["flat"])

    for name, length in (("line", 96), ("part", 88)):
        wave = np.sin(4 * np.pi * np.arange(length) / 96)
        np.savetxt(tmp_path / f"{name}.txt", np.c_[10.0 * np.arange(length), wave],
                   header="x (um) z (um)")
        notes[name] = load(tmp_path / f"{name}.txt").notes
    assert "but its ends fit" in notes["line"][-1]
    assert "the ends of the line do not fit" in notes["part"][-1]


def test_numbers_that_are_no_heights_are_named(tmp_path):
    np.save(tmp_path / "complex.npy", np.ones((8, 6), dtype=complex))
    with pytest.raises(OSError, match=r"complex128 and the shape \(8, 6\): heights must be real"):
        load(tmp_path / "complex.npy", unit="um", size=(8.0, 6.0))


def test_levelling(tmp_path):
    """An exact plane is removed to round-off, a paraboloid only by 'curvature'."""
    j, i = np.mgrid[0:NY, 0:NX]
    plane = 3.0 + 0.5 * i - 0.25 * j
    bowl = plane + 0.01 * i**2 - 0.02 * i * j + 0.03 * j**2
    topography(plane).to_netcdf(str(tmp_path / "plane.nc"))
    topography(bowl).to_netcdf(str(tmp_path / "bowl.nc"))
    assert np.abs(load(tmp_path / "plane.nc", level="tilt").height).max() < 1e-13 * 1e-6 * 20
    assert np.abs(load(tmp_path / "bowl.nc", level="curvature").height).max() < 1e-13 * 1e-6 * 50
    assert load(tmp_path / "bowl.nc", level="tilt").rms_height > 1e-7
    mean = load(tmp_path / "plane.nc")
    np.testing.assert_allclose(mean.height, 1e-6 * (plane - plane.mean()), atol=1e-19)
    np.testing.assert_allclose(load(tmp_path / "plane.nc", level="none").height, 1e-6 * plane,
                               rtol=1e-15)
    assert any("tilt" in note for note in mean.notes)
    assert not any("tilt" in note for note in load(tmp_path / "plane.nc", level="tilt").notes)


def test_a_map_can_be_declared_periodic(tmp_path):
    """A text file cannot say that its map is periodic."""
    x, y = np.arange(48) / 48, np.arange(32)[:, None] / 32
    wave = np.cos(2 * np.pi * (2 * x + y)) + np.sin(6 * np.pi * y)
    np.savetxt(tmp_path / "map.txt", wave)
    options = {"unit": "um", "size": (48.0, 32.0), "periodic": "as-is"}
    surface = load(tmp_path / "map.txt", **options)
    assert surface.periodic and not surface.notes
    assert "declared periodic as it is" in surface.summary()
    np.testing.assert_allclose(surface.height, 1e-6 * wave, atol=1e-18)
    assert not load(tmp_path / "map.txt", **options, crop=(0, 20, 0, 32)).periodic
    np.savetxt(tmp_path / "ramp.txt", wave + 3 * y)
    surface = load(tmp_path / "ramp.txt", **options)
    assert surface.periodic and "opposite edges do not fit" in surface.notes[-1]
    with pytest.raises(ValueError, match="restore_rms: needs periodic = 'tukey' or 'hann'"):
        load(tmp_path / "map.txt", **options, restore_rms=True)


def test_a_wrong_unit_makes_a_road_too_steep(tmp_path):
    np.savetxt(tmp_path / "map.txt", np.random.default_rng(1).normal(size=(20, 30)))
    notes = load(tmp_path / "map.txt", unit="m", size=(3e-3, 2e-3)).notes
    assert any("no road is so steep; often the heights" in note for note in notes)
    notes = load(tmp_path / "map.txt", unit="um", size=(3e3, 2e3)).notes
    assert not any("no road is so steep" in note for note in notes)


def test_esri_grids(tmp_path):
    """The first row of such a grid is the northern one, and the value of NODATA is no height."""
    height = np.random.default_rng(3).normal(size=(6, 9))
    rows = height[::-1].copy()
    rows[1, 4] = -9999.0
    body = "\n".join(" ".join(f"{value:.9g}" for value in row) for row in rows)
    for head in ("ncols 9\nnrows 6\nxllcorner 10\nyllcorner 20\ncellsize 5\n"
                 "NODATA_value -9999\n",
                 "NCOLS 9\r\nNROWS 6\r\nXLLCENTER 0\r\nYLLCENTER 0\r\nDX 5\r\nDY 5\r\n"):
        (tmp_path / "map.asc").write_text(head + body + "\n")
        found = load(tmp_path / "map.asc", unit="um", level="none")
        assert (found.lx, found.ly) == (45e-6, 30e-6)
        known = np.ones((6, 9), dtype=bool)
        known[4, 4] = False
        np.testing.assert_allclose(found.height[known], 1e-6 * height[known], rtol=1e-8)
        assert np.abs(found.height).max() < 1e-5
    (tmp_path / "map.asc").write_text(head + body[:body.rindex("\n")])
    with pytest.raises(ValueError, match="has 5 rows of 9 heights: must have nrows = 6 of"):
        load(tmp_path / "map.asc", unit="um")
    (tmp_path / "map.asc").write_text(head.replace("DX 5", "DX 0") + body)
    with pytest.raises(ValueError, match="must give ncols, nrows and cellsize, all positive"):
        load(tmp_path / "map.asc", unit="um")
    (tmp_path / "map.asc").write_text(head + body.replace("-9999", "gap"))
    with pytest.raises(ValueError, match=r"map.asc: line 8: column 5 = 'gap': must be a number"):
        load(tmp_path / "map.asc", unit="um")


def test_a_periodic_map_without_its_plane_is_not_periodic(tmp_path):
    """The plane differs at opposite edges: a note gives the jump, and the mean is harmless."""
    j, i = np.mgrid[0:NY, 0:NX]
    wave = np.sin(2 * np.pi * i / NX) + np.cos(2 * np.pi * j / NY)
    topography(wave, periodic=True).to_netcdf(str(tmp_path / "map.nc"))
    for level, kind in (("mean", "mean"), (None, "mean")):
        kept = load(tmp_path / "map.nc", level=level)
        assert kept.periodic and not kept.notes
        assert [step["kind"] for step in kept.steps if step["step"] == "level"] == [kind]
    for level in ("tilt", "curvature"):
        found = load(tmp_path / "map.nc", level=level)
        assert not found.periodic and "boundary = 'free'" in found.to_namelist("s.h5")
        taken = 1e-6 * wave - found.height
        jump = 1e6 * np.abs(taken[:, -1] - taken[:, 0]).max()
        assert f"differ by up to {jump:.3g} um: it is not periodic any more" in found.notes[0]
    windowed = load(tmp_path / "map.nc", level="tilt", periodic="tukey")
    assert windowed.periodic and "not periodic any more" not in windowed.notes[0]
    topography(wave + 0.5 * i).to_netcdf(str(tmp_path / "free.nc"))
    free = load(tmp_path / "free.nc", level=None)
    assert [step["kind"] for step in free.steps if step["step"] == "level"] == ["tilt"]


def test_levelling_ignores_missing_points(tmp_path):
    """The plane is fitted to the valid points, wherever the others are."""
    j, i = np.mgrid[0:NY, 0:NX]
    plane = 1.0 + 0.5 * i - 0.25 * j
    missing = (i < 4) & (j < 5)
    topography(plane, missing=missing).to_x3p(str(tmp_path / "map.x3p"))
    surface = load(tmp_path / "map.x3p", level="tilt")
    assert np.abs(surface.height).max() < 1e-18


def test_missing_points_are_filled_and_counted(tmp_path):
    """Missing points in a plane are filled with the plane; the fraction of them has a bound."""
    j, i = np.mgrid[0:NY, 0:NX]
    plane = 0.5 * i - 0.25 * j
    hole = plane.copy()
    hole[5:8, 9:12] = np.nan
    hole[11, 3] = np.nan
    write_sdf(tmp_path / "map.sdf", hole)
    surface = load(tmp_path / "map.sdf", level="none")
    np.testing.assert_allclose(surface.height, 1e-6 * plane, atol=1e-19)
    (step,) = [step for step in surface.steps if step["step"] == "fill"]
    assert (step["missing"], step["points"]) == (10, NX * NY)
    assert f"filled 10 of {NX * NY} points" in surface.summary()
    hole[:5] = np.nan
    write_sdf(tmp_path / "map.sdf", hole)
    with pytest.raises(ValueError, match=r"125 of 322 points are missing \(38\.8 %\): more than"
                                         r" the 10 %.*--max-missing"):
        load(tmp_path / "map.sdf")
    assert np.isfinite(load(tmp_path / "map.sdf", max_missing=0.5).height).all()
    hole[:] = np.nan
    write_sdf(tmp_path / "map.sdf", hole)
    with pytest.raises(ValueError, match="no valid point"):
        load(tmp_path / "map.sdf", max_missing=1.0)


def test_crop_keeps_whole_cells(tmp_path):
    topography(sample()).to_netcdf(str(tmp_path / "map.nc"))
    surface = load(tmp_path / "map.nc", level="none", crop=(8.0, 30.0, 3.0, 12.0))
    np.testing.assert_allclose(surface.height, 1e-6 * sample()[2:8, 4:15], rtol=1e-14)
    assert (surface.lx, surface.ly) == pytest.approx((22e-6, 9e-6))
    for crop, words in (((30.0, 8.0, 3.0, 12.0), "along x: the second number must be larger"),
                        ((0.0, 8.0, 3.0, 22.0), "along y: must lie within 0 to 21, in the unit"),
                        ((0.0, 1.0, 3.0, 12.0), "too few"), ((0.0, 1.0), "must have 4")):
        with pytest.raises(ValueError, match=words):
            load(tmp_path / "map.nc", crop=crop)


def test_resampling(tmp_path):
    """Fewer cells are means over the old ones; with more cells a smooth wave keeps its shape."""
    nx, ny = 48, 36
    x, y = (np.arange(nx) + 0.5) / nx, (np.arange(ny) + 0.5) / ny

    def wave(x, y):
        return np.sin(2 * np.pi * x) + 0.5 * np.cos(4 * np.pi * y)[:, None]

    topography(wave(x, y), periodic=True).to_netcdf(str(tmp_path / "map.nc"))
    half = load(tmp_path / "map.nc", level="none", resample=(24, 12))
    np.testing.assert_allclose(
        half.height, 1e-6 * wave(x, y).reshape(12, 3, 24, 2).mean(axis=(1, 3)), atol=1e-20)
    odd = load(tmp_path / "map.nc", level="none", resample=(31, 17))
    assert odd.height.shape == (17, 31)
    assert odd.height.mean() == pytest.approx(1e-6 * wave(x, y).mean(), abs=1e-20)
    fine = load(tmp_path / "map.nc", level="none", resample=(100, 90))
    exact = wave((np.arange(100) + 0.5) / 100, (np.arange(90) + 0.5) / 90)
    # the error of cubic splines is (2 pi/18)^4/384 for a wave of 18 cells; twice that is allowed
    np.testing.assert_allclose(fine.height, 1e-6 * exact, atol=1e-10)
    assert (fine.lx, fine.ly) == (LX * 1e-6, LY * 1e-6)
    plane = np.arange(nx) + 2.0 * np.arange(ny)[:, None]
    topography(plane).to_netcdf(str(tmp_path / "plane.nc"))
    finer = load(tmp_path / "plane.nc", level="none", resample=(96, 72))
    np.testing.assert_allclose(np.diff(finer.height, axis=1), 0.5e-6, rtol=1e-9)
    with pytest.raises(ValueError, match=r"resample = \(24,\): must be \(nx, ny\)"):
        load(tmp_path / "map.nc", resample=(24,))


def test_window_brings_the_edges_to_the_mean(tmp_path):
    topography(sample()).to_netcdf(str(tmp_path / "map.nc"))
    plain = load(tmp_path / "map.nc")
    assert not plain.periodic
    tukey = load(tmp_path / "map.nc", periodic="tukey", taper=0.4)
    assert tukey.periodic
    inside = (slice(3, 11), slice(5, 18))  # farther than a fifth of each length from the edges
    np.testing.assert_allclose(tukey.height[inside], plain.height[inside], rtol=1e-12)
    hann = load(tmp_path / "map.nc", periodic="hann")
    for height in (tukey.height, hann.height):
        # the steps across the edges are like those inside
        across = max(np.abs(height[0] - height[-1]).max(),
                     np.abs(height[:, 0] - height[:, -1]).max())
        assert across < 0.15 * np.abs(plain.height).max()
    x, y = (np.arange(NX) + 0.5) / NX, (np.arange(NY) + 0.5) / NY
    window = np.sin(np.pi * x) ** 2 * np.sin(np.pi * y)[:, None] ** 2
    np.testing.assert_allclose(hann.height, window * plain.height, atol=1e-20)
    restored = load(tmp_path / "map.nc", periodic="hann", restore_rms=True)
    assert restored.rms_height == pytest.approx(plain.rms_height, rel=1e-12)
    assert hann.rms_height < 0.6 * plain.rms_height
    (step,) = [step for step in hann.steps if step["step"] == "window"]
    assert step["rms_height_before"] == pytest.approx(1e6 * plain.rms_height)
    assert step["rms_height_after"] == pytest.approx(1e6 * hann.rms_height)


def test_invert_and_scale(tmp_path):
    topography(sample()).to_netcdf(str(tmp_path / "map.nc"))
    plain = load(tmp_path / "map.nc")
    turned = load(tmp_path / "map.nc", invert=True, scale=2.0)
    np.testing.assert_allclose(turned.height, -2.0 * plain.height, rtol=1e-12, atol=1e-20)
    assert [step["step"] for step in turned.steps] == ["level", "invert", "scale", "unit"]
    for word, value in (("scale", 0.0), ("scale", np.nan), ("level", "flat"), ("taper", 0.0),
                        ("max_missing", 2.0), ("periodic", "box"), ("restore_rms", True)):
        with pytest.raises(ValueError, match=word):
            load(tmp_path / "map.nc", **{word: value})


def test_line_scans(tmp_path):
    """Scans with even distances become profiles; others are refused."""
    line = np.sin(np.arange(30.0))
    SurfaceTopography.UniformLineScan(line, 15.0, unit="nm").to_netcdf(str(tmp_path / "line.nc"))
    surface = load(tmp_path / "line.nc", level="none", periodic=None)
    np.testing.assert_allclose(surface.height, 1e-9 * line[None, :], rtol=1e-14)
    assert surface.lx == pytest.approx(15e-9) and surface.ly == pytest.approx(0.5e-9)
    part = load(tmp_path / "line.nc", crop=(5.0, 10.0), resample=[20], periodic="hann")
    assert part.height.shape == (1, 20)
    assert part.ly == pytest.approx(5e-9 / 20)
    uneven = SurfaceTopography.NonuniformLineScan(np.arange(30.0) ** 1.5, line, unit="nm")
    uneven.to_netcdf(str(tmp_path / "uneven.nc"))
    with pytest.raises(ValueError, match="line scan with points at uneven distances"):
        load(tmp_path / "uneven.nc")


def gwy_with_channels(path, first, second):
    """Write a Gwyddion file with a phase image and two maps of heights."""
    def name(text):
        return text.encode() + b"\0"

    def thing(kind, items):
        body = b"".join(items)
        return name(kind) + struct.pack("<I", len(body)) + body

    def unit(text):
        return thing("GwySIUnit", [name("unitstr") + b"s" + name(text)])

    def field(values, z_unit):
        return thing("GwyDataField", [
            name("xres") + b"i" + struct.pack("<i", NX),
            name("yres") + b"i" + struct.pack("<i", NY),
            name("xreal") + b"d" + struct.pack("<d", LX * 1e-6),
            name("yreal") + b"d" + struct.pack("<d", LY * 1e-6),
            name("si_unit_xy") + b"o" + unit("m"), name("si_unit_z") + b"o" + unit(z_unit),
            name("data") + b"D" + struct.pack("<I", values.size) + values.astype("<f8").tobytes()])

    body = thing("GwyContainer", [
        name("/0/data") + b"o" + field(first, "deg"), name("/0/data/title") + b"s" + name("Phase"),
        name("/1/data") + b"o" + field(first, "m"), name("/1/data/title") + b"s" + name("Trace"),
        name("/2/data") + b"o" + field(second, "m"), name("/2/data/title") + b"s" + name("Back")])
    path.write_bytes(b"GWYP" + body)


def test_channels(tmp_path):
    path = tmp_path / "scan.gwy"
    gwy_with_channels(path, 2e-6 * sample(), 1e-6 * sample())
    lines = channels(path)
    assert [line.split(":")[0] for line in lines] == ["'Trace'", "'Back'"]  # no phase
    assert "map of heights, 23 x 14 points, unit m" in lines[1]
    for channel, name, factor in ((None, "Trace", 2e-6), (0, "Trace", 2e-6), ("0", "Trace", 2e-6),
                                  ("Back", "Back", 1e-6), (1, "Back", 1e-6), ("1", "Back", 1e-6)):
        surface = load(path, channel=channel, level="none")
        np.testing.assert_allclose(surface.height, factor * sample(), rtol=1e-14)
        assert surface.source["channel"] == name
    with pytest.raises(ValueError, match=r"channel = 'Phase': .*'Trace'.*'Back'"):
        load(path, channel="Phase")
    for number in (2, -1):
        with pytest.raises(ValueError, match=rf"channel = {number}: .*has the channels 0 to 1"):
            load(path, channel=number)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(OSError, match=r"none\.x3p: there is no such file"):
        load(tmp_path / "none.x3p")
    with pytest.raises(OSError, match="is a folder"):
        load(tmp_path)
    (tmp_path / "text.x3p").write_text("To whom it may concern,\nno heights here.\n")
    with pytest.raises(OSError, match=r"text\.x3p: "):
        load(tmp_path / "text.x3p")
    topography(sample()).to_x3p(str(tmp_path / "whole.x3p"))
    data = (tmp_path / "whole.x3p").read_bytes()
    (tmp_path / "half.x3p").write_bytes(data[: len(data) // 2])
    with pytest.raises(OSError, match=r"half\.x3p: "):
        load(tmp_path / "half.x3p")
    missing = tmp_path / "missing" / "s.h5"
    with pytest.raises(OSError, match=r"s\.h5: cannot be written: there is no folder '.*missing'"):
        import_topography(tmp_path / "whole.x3p", missing)
    with pytest.raises(ValueError, match="is the topography itself"):
        import_topography(tmp_path / "whole.x3p", tmp_path / "whole.x3p")
    assert (tmp_path / "whole.x3p").read_bytes() == data
    result = write_result(tmp_path / "run.h5")
    with pytest.raises(ValueError, match=r"run\.h5: is the result of a run: name another file"):
        import_topography(tmp_path / "whole.x3p", result)
    assert asperity.open(result).history.rows == 6
    with pytest.raises(ValueError, match=r"half\.x3p: exists and is not a height map"):
        import_topography(tmp_path / "whole.x3p", tmp_path / "half.x3p")


def test_the_map_of_another_topography_is_not_replaced(tmp_path):
    topography(sample()).to_x3p(str(tmp_path / "one.x3p"))
    topography(2 * sample()).to_x3p(str(tmp_path / "two.x3p"))
    output = tmp_path / "s.h5"
    import_topography(tmp_path / "one.x3p", output)
    import_topography(tmp_path / "one.x3p", output, level="tilt")
    before = output.read_bytes()
    words = r"s\.h5: is the map of another topography, one\.x3p: --overwrite .* replaces it"
    with pytest.raises(FileExistsError, match=words):
        import_topography(tmp_path / "two.x3p", output)
    assert main(["import", str(tmp_path / "two.x3p"), "-o", str(output)]) == 3
    assert output.read_bytes() == before
    assert main(["import", str(tmp_path / "two.x3p"), "-o", str(output), "--overwrite"]) == 0
    assert import_topography(tmp_path / "two.x3p", output).source["name"] == "two.x3p"


def command(*words, folder=None):
    """Run ``python -m asperity``."""
    return subprocess.run([sys.executable, "-m", "asperity", *map(str, words)], cwd=folder,
                          capture_output=True, text=True, timeout=PATIENCE, check=False)


def test_from_the_instrument_s_file_to_a_run(tmp_path, program):
    """The lines that `import` prints make a case, whose road is the measured one."""
    topography(0.1 * sample()).to_x3p(str(tmp_path / "plate.x3p"))
    done = command("import", "plate.x3p", "-o", "surface.h5", "--level", "tilt", "--periodic",
                   "--resample", 20, 12, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    lines = [line for line in done.stdout.splitlines() if line.startswith("&")]
    assert re.match(r"&grid nx = 20, ny = 12, lx = 4\.6e-05, ly = 2\.1e-05,"
                    r" boundary = 'periodic' /$", lines[0])
    (tmp_path / "case.nml").write_text("\n".join(
        [*lines, "&material shear_modulus = 1e6 /", "&phase pressure = 1e4 /"]) + "\n")
    ran = subprocess.run([program, "run", "case.nml", "--quiet"], cwd=tmp_path, text=True,
                         capture_output=True, check=False)
    assert ran.returncode == 0, ran.stderr
    with h5py.File(tmp_path / "surface.h5") as file:
        road = file["surface/height"][:]
        slope = file["surface/height"].attrs["rms_slope"]
    run = asperity.open(tmp_path / "case.h5")
    with h5py.File(tmp_path / "case.h5") as file:
        np.testing.assert_array_equal(file["surface/height"][:], road)
    assert run.history["pressure"][-1] == pytest.approx(1e4, rel=1e-5)
    touching = run.snapshots[-1].pressure > 0
    assert 0 < touching.sum() < touching.size
    assert road[touching].mean() > road[~touching].mean()
    shown = {line[:12].strip(): line[12:] for line in done.stdout.splitlines()}
    assert shown["nx, ny"] == "20, 12"
    assert float(shown["rms slope"]) == pytest.approx(slope, rel=1e-5)
    assert float(shown["rms height"].split()[0]) == pytest.approx(road.std(), rel=1e-5)


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_pipe_that_nobody_reads_does_not_matter(tmp_path, unbuffered):
    """As with `| head -1`: the files are written, and there is no message."""
    np.save(tmp_path / "map.npy", sample())
    (tmp_path / "dma.csv").write_text("f (Hz),G' (Pa),G'' (Pa)\n" + "".join(
        f"{10.0**k},{2e6 * 1.5**k},{1e5 + 1e5 * k}\n" for k in range(6)))
    for words, name in (
            (("import", "map.npy", "--unit", "um", "--size", 46, 21, "-o", "s.h5"), "s.h5"),
            (("fit", "dma.csv", "-o", "fit.nml", "--plot", "fit.png"), "fit.png")):
        reading, writing = os.pipe()
        os.close(reading)
        done = subprocess.run([sys.executable, "-m", "asperity", *map(str, words)], cwd=tmp_path,
                              stdout=writing, stderr=subprocess.PIPE, text=True, check=False,
                              env=dict(os.environ, PYTHONUNBUFFERED=unbuffered))
        os.close(writing)
        assert (done.returncode, done.stderr) == (0, "")
        assert (tmp_path / name).stat().st_size


def test_messages_that_nobody_reads_do_not_matter(tmp_path):
    """As with `2>&1 | head -1`: the progress of a friction curve goes nowhere, and it goes on."""
    (tmp_path / "r.nml").write_text(
        "&material shear_modulus = 1e6, prony_g = 2e6, prony_tau = 1e-2 /\n")
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, "-m", "asperity", "friction", "self_affine:rms_slope=0.1,hurst=0.8,"
         "wavelength_long=1e-3,wavelength_short=2e-4", "--material", "r.nml", "--speeds", "0.01",
         "--pressures", "1e5", "--cells", "32", "--patches", "2", "-o", "q.csv"],
        cwd=tmp_path, stdout=writing, stderr=writing, check=False)
    os.close(writing)
    assert done.returncode == 0
    assert (tmp_path / "q.csv").read_text().startswith("pressure")


def test_every_option_of_the_command_takes_effect(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.save("map.npy", sample())
    assert main(["import", "map.npy", "-o", "a.h5", "--unit", "um", "--size", "46", "21",
                 "--transpose", "--crop", "8", "30", "3", "12", "--level", "curvature",
                 "--invert", "--scale", "3", "--resample", "8", "5", "--periodic", "tukey",
                 "--taper", "0.3", "--restore-rms", "--max-missing", "0"]) == 0
    wanted = load("map.npy", unit="um", size=(46, 21), transpose=True, crop=(8, 30, 3, 12),
                  level="curvature", invert=True, scale=3.0, resample=(8, 5), periodic="tukey",
                  taper=0.3, restore_rms=True, max_missing=0.0)
    with h5py.File("a.h5") as file:
        np.testing.assert_array_equal(file["surface/height"][:], wanted.height)
        assert [step["step"] for step in json.loads(file.attrs["steps"])] == [
            "transpose", "crop", "level", "invert", "scale", "resample", "window", "unit"]
        assert len(file.attrs["steps_text"].splitlines()) == 8
        assert file["grid"].attrs["boundary"] == "periodic"


def test_the_command_s_errors(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    np.save("map.npy", sample().T)
    assert main(["import", "map.npy"]) == 2
    assert capsys.readouterr().err.startswith("asperity: map.npy: names no unit and")
    assert not (tmp_path / "surface.h5").exists()
    assert main(["import", "none.nc"]) == 3
    with pytest.raises(SystemExit):
        main(["import", "--level", "flat", "map.npy"])
    assert main(["import", "map.npy", "--list"]) == 0
    assert "23 x 14 points, no unit" in capsys.readouterr().out


def test_a_bare_dataset_is_read_as_the_program_reads_it(tmp_path, capsys):
    """Its shape is (ny, nx), and its heights are in metres; only the lengths have to be given."""
    height = 1e-6 * sample()
    with h5py.File(tmp_path / "road.h5", "w") as file:
        file["surface/height"] = height
    found = load(tmp_path / "road.h5", level="none", size=(46e-6, 21e-6))
    np.testing.assert_array_equal(found.height, height)
    assert (found.lx, found.ly, found.unit) == (46e-6, 21e-6, "m")
    with pytest.raises(ValueError, match="has its own unit, 'm'"):
        load(tmp_path / "road.h5", unit="um", size=(46, 21))


def test_a_dataset_surface_is_read_as_the_program_reads_it(tmp_path):
    """Its shape is (ny, nx). It used to be read with x first, so that the road was transposed."""
    height = 1e-6 * sample()
    with h5py.File(tmp_path / "road.h5", "w") as file:
        file["another"] = height  # which comes first in the alphabet
        file["surface"] = height
    ny, nx = height.shape
    found = load(tmp_path / "road.h5", level="none", unit="m", size=(46e-6, 21e-6))
    run = asperity.run(
        f"&grid nx = {nx}, ny = {ny}, lx = 46e-6, ly = 21e-6 /\n"
        f"&surface shape = 'file', file = '{tmp_path / 'road.h5'}' /\n"
        "&material shear_modulus = 1e6 /\n&phase pressure = 1. /\n", output=tmp_path / "run.h5")
    np.testing.assert_array_equal(found.height, run.height)
    assert (found.lx, found.ly) == (46e-6, 21e-6)
    with pytest.raises(ValueError, match="names no unit of length"):
        load(tmp_path / "road.h5", size=(46e-6, 21e-6))
    with pytest.raises(ValueError, match=r"'surface' of .* has y first already"):
        load(tmp_path / "road.h5", unit="m", size=(46e-6, 21e-6), transpose=True)


@pytest.mark.parametrize("name", ["surface", "surface/height"])
@pytest.mark.parametrize("unit", ["um", "µm", b"um"])
def test_a_dataset_may_name_its_unit(tmp_path, name, unit):
    """The attribute `units` counts, which a run warns of."""
    with h5py.File(tmp_path / "road.h5", "w") as file:
        file[name] = sample()
        file[name].attrs["units"] = unit
    found = load(tmp_path / "road.h5", level="none", size=(46, 21))
    np.testing.assert_allclose(found.height, 1e-6 * sample(), rtol=1e-14)
    assert (found.lx, found.ly) == pytest.approx((46e-6, 21e-6))
    with pytest.raises(ValueError, match=r"unit = 'm': .* has its own unit, 'um'"):
        load(tmp_path / "road.h5", unit="m", size=(46, 21))


def test_one_of_several_datasets_has_to_be_named(tmp_path):
    """Datasets of other names have x first, as in SurfaceTopography."""
    with h5py.File(tmp_path / "map.h5", "w") as file:
        file["error"] = np.zeros((4, 3))
        file["height"] = sample().T
    with pytest.raises(ValueError, match=r"holds several datasets: say which .*'error'.*'height'"):
        load(tmp_path / "map.h5", unit="um", size=(LX, LY))
    found = load(tmp_path / "map.h5", unit="um", size=(LX, LY), channel="height", level="none")
    np.testing.assert_allclose(found.height, 1e-6 * sample(), rtol=1e-14)


def test_the_message_on_a_damaged_file_names_it(tmp_path):
    with h5py.File(tmp_path / "road.h5", "w") as file:
        file["surface/height"] = np.zeros((200, 200))
    (tmp_path / "road.h5").write_bytes((tmp_path / "road.h5").read_bytes()[:2000])
    with pytest.raises(OSError, match=r"road\.h5: cannot be read as HDF5"):
        load(tmp_path / "road.h5", unit="um")


@pytest.mark.parametrize(("unit", "factor"), [("um", 1e-6), ("m", 1.0), ("1", 1.0), ("cm", None)])
def test_the_unit_of_the_heights_counts_beside_lengths_in_metres(tmp_path, unit, factor):
    path = tmp_path / "map.h5"
    height = np.random.default_rng(1).standard_normal((8, 8))
    with h5py.File(path, "w") as file:
        file["surface/height"] = height
        file["surface/height"].attrs["units"] = unit
        file.create_group("grid").attrs.update(lx=1.0, ly=1.0)
    if factor is None:
        with pytest.raises(ValueError, match="surface/height has the unit 'cm': must be one of"):
            load(path)
    else:
        np.testing.assert_allclose(load(path, level="none").height, factor * height, rtol=1e-12)


def test_a_map_that_is_probably_turned_is_noted(tmp_path):
    """A NumPy array of this package has y first, but a file of another one x first."""
    height = np.random.default_rng(1).normal(size=(48, 64))
    np.save(tmp_path / "map.npy", height)
    turned, right = (asperity.surface.load(tmp_path / "map.npy", unit="nm", size=(4e5, 3e5),
                                           transpose=transpose) for transpose in (False, True))
    assert any("with the first index of the file along y" in note for note in turned.notes)
    assert not any("along y" in note for note in right.notes)
    with h5py.File(tmp_path / "own.h5", "w") as file:
        file["surface/height"] = height.T  # this dataset has y first and cannot be turned
    own = asperity.surface.load(tmp_path / "own.h5", size=(4e-4, 3e-4))
    assert not any("along y" in note for note in own.notes)
