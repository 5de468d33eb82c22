"""Cases built in Python have the same names, values and messages as those of the program."""

import copy
import math
import pickle
import re
import struct
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from conftest import ROOT
from hypothesis import example, given, settings
from hypothesis import strategies as st

import asperity
from asperity.case import Group, UnknownVariableError
from asperity.runs import namelists

INPUTS = sorted((ROOT / "examples").glob("*/input.nml"))


def elastic():
    """Return a small case that runs."""
    return asperity.Case(
        title="Wave", grid=dict(nx=32, ny=1, lx=1e-3),
        surface=dict(shape="sine", amplitude=1e-6, wavelength=1e-3),
        material=dict(shear_modulus=1e6), phase=[dict(pressure=1e4)], solver=dict(threads=1))


def bits(value):
    """Return a form of a value that is equal for two values only if all their bits agree."""
    if isinstance(value, float):
        return struct.pack("<d", value)
    return [bits(one) for one in value] if isinstance(value, list) else value


# ---- every case is read back with the same bits ------------------------------------------------


def interval(allowed):
    """Return the bounds that the table's words for the allowed values express."""
    if allowed == "positive":
        return 0.0, math.inf, True, False
    if allowed == "not negative":
        return 0.0, math.inf, False, False
    if allowed == "any":
        return -math.inf, math.inf, False, False
    low, high = allowed[1:-1].split(",")
    return float(low), float(high), allowed[0] == "(", allowed[-1] == ")"


def reals(allowed):
    low, high, low_open, high_open = interval(allowed)
    return st.floats(low if math.isfinite(low) else None, high if math.isfinite(high) else None,
                     exclude_min=low_open, exclude_max=high_open and math.isfinite(high),
                     allow_nan=False, allow_infinity=False)


def values_of(variable):
    """Return a strategy for the values that the table allows a variable."""
    if variable.kind in ("word", "words"):
        words = st.sampled_from([word.strip("' ") for word in variable.allowed.split("|")])
        return words if variable.kind == "word" else st.lists(words, min_size=1, max_size=4)
    if variable.kind == "text":
        # Characters that a namelist file may contain. Blanks at the end of a text do not count.
        return st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs")),
                       max_size=40).map(str.rstrip)
    if variable.kind == "integer":
        low, high, low_open, _ = interval(variable.allowed)
        return st.integers(int(low) + low_open if math.isfinite(low) else -2**31 + 1,
                           int(high) if math.isfinite(high) else 2**31 - 1)
    if variable.kind == "logical":
        return st.booleans()
    if variable.kind == "reals":
        return st.lists(reals(variable.allowed), min_size=1, max_size=30)
    return reals(variable.allowed)


def groups_of(name):
    """Return a strategy for the values of a group."""
    entry = namelists.table()[name]
    return st.fixed_dictionaries({}, optional={
        variable.name: values_of(variable) for variable in entry.variables.values()})


@st.composite
def cases(draw):
    groups = {}
    for name, entry in namelists.table().items():
        one = groups_of(name)
        groups[name] = draw(st.lists(one, max_size=3)) if entry.is_repeatable else draw(one)
    return groups


@settings(max_examples=40, deadline=None)  # of time: a busy machine is no fault
@given(cases())
@example({"material": {"reference_temperature": sys.float_info.max}})
def test_a_written_case_is_read_back_with_the_same_bits(groups):
    case = asperity.Case(**groups)
    again = asperity.Case.read(str(case) + "\n")
    assert str(again) == str(case)
    for name, given_values in groups.items():
        found, kept = again[name], case[name]
        if not namelists.table()[name].is_repeatable:
            found, kept, given_values = [found], [kept], [given_values]
        assert len(found) == len(kept) == len(given_values)
        for left, middle, right in zip(found, kept, given_values, strict=True):
            assert {key: bits(left[key]) for key in left} == {
                key: bits(middle[key]) for key in middle} == {
                key: bits(value) for key, value in right.items()}
    assert again == case
    for twin in (case.copy(), copy.deepcopy(case), pickle.loads(pickle.dumps(case))):
        assert twin == case and str(twin) == str(case)


# ---- the package and the program have the same table ------------------------------------------


def test_the_table_is_that_of_the_program(program):
    page = subprocess.run([program, "template", "--reference"], capture_output=True, text=True,
                          check=True).stdout
    chapters = page.split("\n## `&")[1:]
    assert [chapter.split("`")[0] for chapter in chapters] == list(namelists.table())
    for chapter in chapters:
        entry = namelists.table()[chapter.split("`")[0]]
        rows = [line.split(" | ") for line in chapter.splitlines() if line.startswith("| `")]
        assert [row[0].strip("| `") for row in rows] == list(entry.variables)
        for row, variable in zip(rows, entry.variables.values(), strict=True):
            assert row[-1].removesuffix(" |") == variable.meaning
            assert row[2] == variable.default and row[3] == variable.units
        assert ("May be repeated" in chapter) == entry.is_repeatable
        assert ("Required" in chapter.split("\n|")[0]) == entry.is_required


def test_no_name_of_the_input_is_hidden_by_a_method():
    for name, entry in namelists.table().items():
        assert not hasattr(asperity.Case, name) or name == "case"
        for variable in entry.variables:
            assert not hasattr(Group, variable), f"{name}.{variable}"


def without_time(text):
    """Return what `check` prints, without the predicted time of a run, which varies."""
    assert text.count("\n! time: ") == 1
    return re.sub(r"\n! time: .*", "", text)


@pytest.mark.parametrize("path", INPUTS, ids=lambda path: path.parent.name)
def test_check_prints_what_the_command_prints(path, program):
    case = asperity.Case.read(path)
    done = subprocess.run([program, "check", str(path)], capture_output=True, text=True, check=True)
    assert without_time(case.check()) == without_time(done.stdout)
    assert case.path == path
    with pytest.raises(ValueError, match=r"^source = '': must be the path of a file"):
        asperity.Case.read("")
    # The values must be the same, however they are written.
    again = asperity.Case.read(str(case))
    again.path = path
    assert without_time(again.check()) == without_time(done.stdout)


@pytest.mark.parametrize(("change", "message"), [
    (lambda case: case.phase[0].update(pressure=-1.0), "adhesion"),
    (lambda case: case.grid.update(ny=4, boundary="free", nx=1), "nx = 1: must be at least 2"),
    (lambda case: case.material.update(prony_g=[1e6]), "prony"),
    (lambda case: case.phase.clear(), "&phase: the group is missing"),
    (lambda case: case.surface.__setitem__(
        0, dict(shape="file", file="none.h5")), "none.h5")])
def test_the_same_messages(change, message, program, tmp_path):
    case = elastic()
    change(case)
    path = case.write(tmp_path / "road.nml")
    command = subprocess.run([program, "check", str(path)], capture_output=True, text=True,
                             check=False)
    assert command.returncode in (2, 3)
    with pytest.raises(ValueError if command.returncode == 2 else OSError) as caught:
        case.check()
    assert str(caught.value) == command.stderr.rstrip("\n")
    assert message in str(caught.value)
    if command.returncode == 2:
        with pytest.raises(ValueError, match=r"road\.nml"):
            case.run(output=tmp_path / "road.h5")
        with pytest.raises(ValueError, match=r"road\.nml"):
            case.check(files=False)
    else:
        assert "shape = 'file'" in case.check(files=False)


# ---- wrong names and values --------------------------------------------------------------------


@pytest.mark.parametrize(("build", "message"), [
    (lambda: asperity.Case(grdi={}), "'grdi': did you mean 'grid'"),
    (lambda: asperity.Case(grid=dict(nxx=4)), "&grid: no variable is named 'nxx'.*'nx'"),
    (lambda: asperity.Case(phase=[dict(presure=1.0)]), "did you mean 'pressure'"),
    (lambda: setattr(elastic().grid, "nxx", 4), "did you mean 'nx'"),
    (lambda: setattr(elastic(), "phases", []), "did you mean 'phase'"),
    (lambda: elastic().phase.append(velocityx=1.0), "did you mean 'velocity_x'"),
    (lambda: elastic().grid.nxx, "did you mean 'nx'"),
    (lambda: elastic()["grdi"], "did you mean 'grid'"),
    (lambda: asperity.Case(material=dict(elastic_modulus=1.0)), "give shear_modulus = E"),
    (lambda: elastic().grid["nxx"], "did you mean 'nx'"),
    (lambda: asperity.Case.help("phase.presure"), "did you mean 'pressure'")])
def test_misspelt_names_are_refused_immediately(build, message):
    with pytest.raises(UnknownVariableError, match=message):
        build()
    for kind in (ValueError, AttributeError, KeyError):
        with pytest.raises(kind):
            build()


@pytest.mark.parametrize(("name", "value", "message"), [
    ("grid.nx", -4, "&grid: nx = -4: must be a positive integer$"),
    ("grid.nx", 4.5, "nx = 4.5: must be a positive integer$"),
    ("grid.nx", True, "must be a positive integer$"),
    ("grid.nx", 2**31, "must be a positive integer of at most 2147483647$"),
    ("grid.nx", [4, 4], "takes one value only"),
    ("grid.lx", float("nan"), "lx = nan: must be a positive number$"),
    ("grid.lx", float("inf"), "must be a positive number$"),
    ("grid.lx", "1", "must be a positive number$"),
    ("grid.lx", 1j, "must be a number, a logical"),
    ("grid.boundary", "open", "must be one of 'periodic'"),
    ("grid.boundary", 3, "must be one of 'periodic'"),
    ("case.title", "two\nlines", "title = .*two.*lines': must be a text without line breaks$"),
    ("case.title", "x' / &grid nx = 3 /\n", "without line breaks$"),
    ("case.title", "\x1f", "not text"),
    ("case.title", "x" * 2000, "at most"),
    ("material.prony_g", [], "has no value"),
    ("material.prony_g", [1.0, -1.0], "every value must be a positive number"),
    ("material.prony_g", [[1.0]], "must be a number, a logical"),
    ("material.poisson", 0.6, "poisson = 0.6: must be a number above -1 and at most 0.5$"),
    ("friction.slope_effect", 1, "must be .true. or .false.")])
def test_wrong_values_are_refused_immediately(name, value, message):
    case = elastic()
    before = str(case)
    group, variable = name.split(".")
    with pytest.raises(ValueError, match=message) as caught:
        case[group][variable] = value
    assert not str(caught.value).startswith(":") and "(line" not in str(caught.value)
    assert str(case) == before


@pytest.mark.parametrize("source", ["road.nml", Path("road.nml"), "&grid nx = 4 /"])
def test_an_input_is_not_a_title(source):
    with pytest.raises(ValueError, match=r"title = '.*Case\.read reads an input"):
        asperity.Case(source)


def test_quotes_in_values_stay_inside_the_text():
    case = elastic()
    case.title = "it's / &grid nx = 3 / 'x"
    assert asperity.Case.read(str(case)).title == case.title
    assert asperity.Case.read(str(case)).grid.nx == 32


# ---- values, access, files ---------------------------------------------------------------------


def test_values_of_numpy():
    case = elastic()
    case.grid.nx = np.int32(64)
    case.grid.lx = np.float32(0.1)
    case.material.prony_g = np.array([1, 2])
    case.material.prony_tau = (np.float64(0.1), 3)
    case.phase[0].relaxed = np.bool_(True)
    case.output.snapshot_fields = np.array(["pressure", "gap"])
    assert case.grid.nx == 64 and type(case.grid.nx) is int
    assert case.grid.lx == float(np.float32(0.1))
    assert case.material.prony_g == [1.0, 2.0]
    assert case.material.prony_tau == [0.1, 3.0]
    assert case.phase[0].relaxed is True
    assert case.output.snapshot_fields == ["pressure", "gap"]
    case.output.file = Path("x") / "y.h5"
    assert case.output.file == "x/y.h5"
    case.grid.boundary = "Free"  # as in a file, words may be in capitals
    assert case.grid.boundary == "free"


def test_defaults_and_what_is_given():
    case = elastic()
    assert case.grid.boundary == "periodic" and "boundary" not in case.grid
    assert case.solver.tolerance == 1e-6 and case.solver.max_iterations == 1000
    assert case.friction.slope_effect is True
    assert case.grid.ly is None
    case.grid.ly = 2e-3
    assert "ly" in case.grid and "ly = 0.002" in str(case)
    case.grid.ly = None
    assert "ly" not in case.grid
    del case.grid.lx
    with pytest.raises(UnknownVariableError, match="lx is not given"):
        del case.grid.lx
    with pytest.raises(ValueError, match="&grid: lx: is missing"):
        case.check()
    case.adhesion = dict(potential="gauss", energy=0.1, range=1e-6)
    assert "&adhesion" in str(case)
    case.adhesion = None
    assert "&adhesion" not in str(case)


def test_repeated_groups_are_a_list():
    case = elastic()
    case.phase.append({"pressure": 2e4}, duration=1.0)
    case.phase.insert(0, dict(pressure=1.0))
    case.phase[1] = dict(pressure=3.0, name="second")
    assert [phase.pressure for phase in case.phase] == [1.0, 3.0, 2e4]
    assert case.phase[-1].duration == 1.0 and len(case.phase[:2]) == 2
    del case.phase[1]
    assert [phase.pressure for phase in case.phase] == [1.0, 2e4]
    with pytest.raises(IndexError, match=r"phase\[2\]: there are 2, counted from 0"):
        case.phase[2]
    case.phase += [dict(pressure=5.0)]
    assert len(asperity.Case.read(str(case)).phase) == 3
    # A group that is appended twice makes two groups.
    first = case.phase[0]
    case.phase.append(first)
    case.phase[-1].pressure = 7.0
    assert first.pressure == 1.0
    with pytest.raises(ValueError, match="must be a dict"):
        case.phase = [3.0]


def test_completion_and_repr():
    case = elastic()
    assert {"grid", "phase", "title", "run", "check"} <= set(dir(case))
    assert {"nx", "boundary"} <= set(dir(case.grid))
    assert "velocity_x" in dir(case.phase[0])
    assert case._ipython_key_completions_() == list(namelists.table())
    assert "prony_g" in case.material._ipython_key_completions_()
    assert repr(case) == "! a case without a file\n" + str(case)
    assert repr(case.grid) == "&grid\n  nx = 32\n  ny = 1\n  lx = 0.001\n/"
    assert repr(asperity.Case().phase) == "(no &phase)"
    assert "must" not in repr(asperity.Case.help()) and "&grid" in repr(asperity.Case.help())
    assert "velocity_x: real, default 0.0 m/s" in asperity.Case.help("phase")


def test_long_lists_are_broken_between_values():
    case = elastic()
    case.material.update(prony_g=np.geomspace(1e5, 1e7, 30), prony_tau=np.geomspace(1e-9, 1, 30))
    text = str(case)
    assert max(map(len, text.splitlines())) <= 100
    assert asperity.Case.read(text).material.prony_g == np.geomspace(1e5, 1e7, 30).tolist()


def test_only_inputs_are_written_over(tmp_path):
    result = elastic().run(output=tmp_path / "run.h5").path
    road = asperity.surface.save(tmp_path / "road.h5", np.zeros((4, 4)), lx=1.0)
    table = tmp_path / "dma.csv"
    table.write_text("f (Hz),G' (Pa),G'' (Pa)\n")
    for path, words in ((result, "is the result of a run"), (road, "is a height map of Asperity"),
                        (table, "exists and is not an input")):
        kept = path.read_bytes()
        with pytest.raises(ValueError, match=f"{path.name}: {words}: name another file"):
            elastic().write(path)
        assert path.read_bytes() == kept
    with pytest.raises(IsADirectoryError, match="is a folder"):
        elastic().write(tmp_path)
    for text in ("", "! a rubber\n&material shear_modulus = 1e6 /\n", "&GRID nx = 4 /\n"):
        (tmp_path / "case.nml").write_text(text)
        assert asperity.Case.read(elastic().write(tmp_path / "case.nml")) == elastic()


def test_read_and_write(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "maps").mkdir()
    with h5py.File("maps/wave.h5", "w") as file:
        file["surface"] = np.cos(2 * np.pi * np.arange(32) / 32)[None, :] * 1e-6
    case = elastic()
    case.surface = [dict(shape="file", file="maps/wave.h5")]
    case.check()
    (tmp_path / "cases").mkdir()
    path = case.write("cases/road.nml")
    assert path == case.path == Path("cases/road.nml")
    assert case.surface[0].file == "../maps/wave.h5"
    case.check()
    read = asperity.Case.read("cases/road.nml")
    assert read == case and read.path == path
    assert path.read_text() == str(case)
    run = read.run(threads=1)
    assert run.path == Path("cases/road.h5") and run.input == str(case)
    # In a folder without the file, the same name means another file.
    with pytest.raises(OSError, match="lost"):
        asperity.Case.read(tmp_path / "lost.nml")
    with pytest.raises(OSError, match="lost"):
        case.write(tmp_path / "lost" / "x.nml")
    assert case.path == path
    path.write_text("&grid nx = 8, nz = 3 /\n&phasse /\n")
    with pytest.raises(ValueError) as caught:
        asperity.Case.read(path)
    assert len(str(caught.value).splitlines()) == 2
    assert "cases/road.nml: &grid: nz: there is no such variable" in str(caught.value)


def test_text_in_all_forms_of_fortran():
    case = asperity.Case.read("""
        ! a comment
        $GRID NX=8 Ny=4, lx = 1.d-3 $END
        &material prony_g(2:4)=3*2., prony_g(1) = 1 , prony_tau = 4*1e0 / &friction slope_effect=F /
        &phase name="it's" / &phase /""")
    assert dict(case.grid) == {"nx": 8, "ny": 4, "lx": 1e-3}
    assert case.material.prony_g == [1.0, 2.0, 2.0, 2.0] and case.material.prony_tau == [1.0] * 4
    assert case.friction.slope_effect is False
    assert [phase.name for phase in case.phase] == ["it's", None]
    assert str(case).count("&phase") == 2


def test_runs_of_a_case_a_text_and_a_file_are_the_same(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    case = elastic()
    first = case.run()
    assert first.path == Path("case.h5") and first.title == "Wave"
    second = asperity.run(str(case), output="text.h5")
    case.write("road.nml")
    third = asperity.run("road.nml")
    for run in (second, third):
        assert run.input == first.input == str(case)
        np.testing.assert_array_equal(run.snapshots[-1].pressure, first.snapshots[-1].pressure)
    with pytest.raises(ValueError, match="would overwrite the input"):
        asperity.run(case, output="road.nml")
    assert Path("road.nml").read_text() == str(case)
    with pytest.raises(ValueError, match="&grid: nx: is missing"):
        asperity.Case().run()
