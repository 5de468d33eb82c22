"""Type checkers know the groups of an input and the columns of a history and of a row."""

from __future__ import annotations

import difflib
import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT

from asperity.runs import namelists
from asperity.runs.row import Column, Field, columns, fields
from asperity.runs.simulation import FIELDS

# A comment `E: text` is an error that mypy must report in its line, and `N: text` a type that it
# there must be no others.
SAMPLE = '''
import numpy as np
import asperity

case = asperity.Case(
    "Wave", surface=np.zeros((4, 4)), grid=dict(lx=1e-3),
    material=dict(shear_modulus=1e6), phase=[dict(pressure=1e4)])
reveal_type(case.grid.nx)  # N: "int"
reveal_type(case.grid.ly)  # N: "float | None"
reveal_type(case.grid.boundary)  # N: "Literal['periodic'] | Literal['free']"
reveal_type(case.material.prony_g)  # N: "list[float] | None"
reveal_type(case.phase[0].velocity_x)  # N: "float"
reveal_type(case.phase[0].pressure)  # N: "float | None"
reveal_type(case.title)  # N: "str"
case.grid.nxx = 3  # E: has no attribute "nxx"
print(case.grid.nxx)  # E: has no attribute "nxx"
print(case.gird)  # E: has no attribute "gird"
case.grid.nx = 12
case.grid.nx = "12"  # E: Incompatible types in assignment
case.grid.boundary = "open"  # E: Incompatible types in assignment
case.grid.boundary = "free"
case.grid.ly = None
case.material.prony_g = np.array([1e6, 2e6])
case.material.prony_tau = [1, 2]
case.surface = np.ones((8, 8))
case.solver = dict(tolerance=1e-8)
case.output.file = "x.h5"
case.phase.append(duration=1e-3, velocity_x=1.0)
case.phase.append(velocity=1.0)  # E: Unexpected keyword argument "velocity"
for phase in case.phase:
    phase.steps = 10
    phase.step = 10  # E: has no attribute "step"
asperity.Case(girid=dict(nx=3))  # E: Unexpected keyword argument "girid"

run = asperity.open("road.h5")
reveal_type(run.history.friction)  # N: numpy.ndarray[
print(run.history.fricton)  # E: has no attribute "fricton"
print(run.history["friction"], run.material.shear_modulus, run.attributes.whatever)
reveal_type(run.material.poisson)  # N: "float"
print(run.material.poison)  # E: has no attribute "poison"
sim = asperity.Simulation(case)
row = sim.advance()
reveal_type(row.friction)  # N: "float"
reveal_type(row.step)  # N: "int"
print(row.fricton)  # E: has no attribute "fricton"
sim.pressure = 2e5
'''


def test_mypy_knows_names_and_types(tmp_path: Path) -> None:
    """Misspelt groups, variables and columns are errors, and every type is what the program has."""
    sample = tmp_path / "sample.py"
    sample.write_text(SAMPLE)
    settings = tmp_path / "mypy.ini"
    # Other packages are left out: checking them takes long and does not matter here.
    left_out = ("h5py", "matplotlib", "pandas", "scipy", "xarray", "SurfaceTopography")
    settings.write_text(
        f"[mypy]\nfollow_imports = silent\nmypy_path = {ROOT / 'python'}\n"
        + "".join(f"[mypy-{name}.*]\nfollow_imports = skip\n" for name in left_out))
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--config-file", settings, "--no-error-summary",
         "--cache-dir", ROOT / "build" / "mypy", sample],
        capture_output=True, text=True, check=False)
    found = [re.fullmatch(r".*sample\.py:(\d+): (error|note): (.*)", line)
             for line in done.stdout.splitlines()]
    reports: dict[int, list[str]] = {}
    for line in found:
        assert line is not None, done.stdout + done.stderr
        reports.setdefault(int(line[1]), []).append(line[3])
    for number, line in enumerate(SAMPLE.splitlines(), 1):
        wanted = re.search(r"# [EN]: (.*)", line)
        messages = "\n".join(reports.get(number, []))
        if wanted:
            assert wanted[1] in messages, f"{line}\n{messages}"
        else:
            assert not messages, f"{line}\n{messages}"


def test_mypy_finds_no_fault_in_the_package() -> None:
    """The types of the package agree with each other, and with those of NumPy and matplotlib."""
    done = subprocess.run([sys.executable, "-m", "mypy"], cwd=ROOT, capture_output=True, text=True,
                          check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_types_are_those_of_the_program() -> None:
    """The modules for type checkers and the page's table follow from the program's tables."""
    done = subprocess.run([sys.executable, ROOT / "tools" / "make_types.py", "--check"],
                          check=False)
    assert done.returncode == 0, "python tools/make_types.py writes them again"


def changes(before: str, after: str) -> list[str]:
    """Return the lines that differ between two texts."""
    return [line[2:] for line in difflib.ndiff(before.splitlines(), after.splitlines())
            if line.startswith(("+", "-"))]


def test_a_new_column_is_one_declaration(monkeypatch: pytest.MonkeyPatch) -> None:
    """A declaration in the row becomes a line of the list that the result and checkpoint use."""
    monkeypatch.syspath_prepend(ROOT / "tools")
    make_types = importlib.import_module("make_types")
    row = (ROOT / "src/io/history_row.f90").read_text()
    listed = (ROOT / "src/io/history_list.f90").read_text()
    assert make_types.write_list(row) == listed
    new = ("      real(dp) :: slip_distance = 0.0_dp   !! [m] the surface's slip\n"
           "      integer :: jumps = 0   !! jumps of the contact\n")
    more = row.replace("   end type history_row_type", f"{new}   end type history_row_type")
    assert changes(listed, make_types.write_list(more)) == [
        "      call table%add(prefix//'slip_distance', row%slip_distance, 'm', "
        "'the surface''s slip')",
        "      call table%add(prefix//'jumps', row%jumps, 'jumps of the contact')"]
    with pytest.raises(SystemExit, match="units"):
        make_types.write_list(more.replace("[m] the", "the"))


def test_a_new_column_or_field_reaches_types_and_page(monkeypatch: pytest.MonkeyPatch) -> None:
    """A line of the program's tables becomes types in Python and a row of the page."""
    monkeypatch.syspath_prepend(ROOT / "tools")
    make_types = importlib.import_module("make_types")
    known, stored = columns(), fields()
    page = (ROOT / "docs/result_file.md").read_text()
    assert make_types.write_page(known, stored) == page
    more = (*known, Column("slip_distance", "m", False, "distance that the surface has slipped"),
            Column("jumps", "1", True, "jumps of the contact"))
    assert changes(make_types.write_columns(known), make_types.write_columns(more)) == [
        "    slip_distance: float  # distance that the surface has slipped, m",
        "    jumps: int  # jumps of the contact",
        "    slip_distance: NDArray[np.float64]  # distance that the surface has slipped, m",
        "    jumps: NDArray[np.int32]  # jumps of the contact"]
    assert changes(page, make_types.write_page(more, stored)) == [
        "| `slip_distance` | m | distance that the surface has slipped |",
        "| `jumps` | - | jumps of the contact |"]
    heat = Field("heat", "J/m2", True, "energy lost by friction")
    assert changes(page, make_types.write_page(known, (*stored, heat))) == [
        "| `heat` | J/m2 | energy lost by friction |"]
    assert changes(make_types.write_fields(stored), make_types.write_fields((*stored, heat))) == [
        '    "heat",']


def test_fields_are_those_of_the_input() -> None:
    """The input accepts exactly the fields of the table, and a simulation has the same."""
    words = namelists.table()["output"].variables["snapshot_fields"].allowed
    assert re.findall(r"'([^']*)'", words) == [field.name for field in fields()]
    assert (*(field.name for field in fields()), "height") == FIELDS
