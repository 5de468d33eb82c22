"""The program as a user meets it: commands, messages, exit statuses and faulty inputs."""

import re
import shutil
import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest
from conftest import PATIENCE
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import asperity

GOOD = """&grid nx = 16, ny = 8, lx = 1e-3 /
&surface shape = 'sphere', radius = 0.01 /
&material shear_modulus = 1e6 /
&phase pressure = 1e5 /
"""
VERBS = ["run", "check", "template", "info"]


def call(program, *arguments, cwd=None):
    """Run the program, which must not crash whatever the input is."""
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, cwd=cwd,
                          timeout=PATIENCE)
    done.out = done.stdout.decode(errors="replace")
    done.err = done.stderr.decode(errors="replace")
    assert done.returncode in (0, 2, 3, 4), (done.returncode, done.err)
    for word in ("Backtrace", "Fortran runtime", "STOP", "Note:", "HDF5-DIAG"):
        assert word not in done.err
    assert (done.returncode == 0) or done.err.strip()
    return done


def check(program, folder, text):
    """Check an input that is given as text or bytes."""
    path = folder / "case.nml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return call(program, "check", "case.nml", cwd=folder)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("case")


@pytest.mark.parametrize(("old", "new", "printed"), [
    ("/\n&p", "/\n&friction law = 'coulomb', coefficient = 0.5, shear_strength = 3e5 /\n&p",
     "&friction: shear_strength = 300000 has no effect"),
    ("/\n&p", "/\n&friction law = 'constant_shear', coefficient = 0.5, shear_strength = 1 /\n&p",
     "&friction: coefficient = 0.5 has no effect"),
    ("1e6 /", "1e6, temperature = 50 /", "&material: temperature = 50 has no effect"),
    ("1e6 /", "1e6, temperature = 50, wlf_c1 = 5, wlf_c2 = 100 /", ""),
    ("1e6 /", "1e6, temperature = 20 /", ""),
    ("1e5 /", "1e5, force = 1, control = 'force' /",
     "&phase 1: pressure = 100000 has no effect: control = 'force' does not use it"),
    ("1e5 /", "1e5, control = 'pressure' /", ""),
])
def test_values_without_effect_are_reported(program, folder, old, new, printed):
    done = check(program, folder, GOOD.replace(old, new, 1))
    assert done.returncode == 0
    assert done.out.count("has no effect") == (1 if printed else 0)
    assert f"! warning: {printed}" in done.out or not printed


@pytest.mark.skipif(shutil.which("readelf") is None, reason="needs readelf")
def test_the_program_needs_no_text_relocations(program):
    """Hardened systems refuse to load such programs."""
    done = subprocess.run(["readelf", "-d", program], capture_output=True, text=True, check=True)
    assert "TEXTREL" not in done.stdout


def test_a_copy_of_the_output_does_not_replace_the_result(program, folder):
    """The name of the result that follows from that of the input is only a comment."""
    done = check(program, folder, GOOD)
    assert "! file = " in done.out and "\n  file = " not in done.out
    (folder / "copy.nml").write_text(done.out)
    assert call(program, "run", "copy.nml", "--quiet", cwd=folder).returncode == 0
    assert (folder / "copy.h5").exists()
    done = check(program, folder, GOOD + "&output file = 'mine.h5' /\n")
    assert "\n  file = 'mine.h5'" in done.out


@pytest.mark.parametrize(("wrong", "hint"), [
    ("&material youngs_modulus = 3e6", "give shear_modulus = E/(2 (1 + poisson))"),
    ("&friction law = 'coulomb', mu = 0.5 /\n&material shear_modulus = 1e6",
     "did you mean coefficient?"),
    ("&material shear_modulus = 1e6, zzz = 1", "there are poisson, shear_modulus, "),
])
def test_hints_for_names_of_other_programs(program, folder, wrong, hint):
    done = check(program, folder, re.sub("&material shear_modulus = [^ ,/]*", wrong, GOOD))
    assert done.returncode == 2 and hint in done.err, done.err


def test_warnings_of_a_run_begin_with_the_word(program, folder):
    (folder / "few.nml").write_text(GOOD.replace("&phase", "&adhesion energy = 1e3, range = 1e-9,"
                                                 " potential = 'exponential' /\n&phase"))
    done = call(program, "run", "few.nml", "--quiet", cwd=folder)
    assert "warning: &adhesion: cells of" in done.err


def test_a_folder_that_does_not_exist_is_reported(program, folder):
    """The folder may still be made before the run, so that this is a warning."""
    done = check(program, folder, GOOD + "&output file = 'nowhere/a.h5' /\n")
    assert done.returncode == 0
    assert "nowhere/a.h5: cannot be written: there is no folder" in done.out


@pytest.mark.parametrize(("phase", "law", "printed"), [
    ("", "", ""),
    ("duration = 1, velocity_x = 1e-4", "", ""),
    ("steady = .true., velocity_x = 1e-4", "", "A steady row that converges slowly is solved in"
     " all cells at once, which takes up to"),
    ("duration = 1, velocity_x = 1e-4", "&friction law = 'coulomb', coefficient = 0.3 /",
     "A row whose pressure and friction settle slowly is solved in all cells at once, which takes"
     " up to"),
])
def test_memory_of_rows_that_are_solved_at_once(program, folder, phase, law, printed):
    """`check` says what is solved at once, how much memory this takes, and what is lost without."""
    done = check(program, folder, GOOD.replace("1e5 /", f"1e5, {phase} /") + law + "\n")
    assert done.returncode == 0, done.err
    lines = [line for line in done.out.splitlines() if "at once, which takes up to" in line]
    assert len(lines) == (1 if printed else 0)
    if printed:
        assert lines[0].startswith(f"! {printed}")
        assert lines[0].endswith("Without this memory the run continues, but such a row may not"
                                 " converge, which ends the run with status 4")


def test_version(program, root):
    done = call(program, "--version")
    assert done.returncode == 0
    lines = done.out.splitlines()
    assert lines[0] == f"asperity {(root / 'VERSION').read_text().strip()}"
    assert [line.split(": ")[0] for line in lines[1:]] == ["compiler", "FFTW", "HDF5", "MPI"]
    assert re.fullmatch(r"compiler: GCC .*\d+\.\d+\.\d+(, for processors with AVX2)?", lines[1])
    assert re.fullmatch(r"FFTW: 3\.\d+\.\d+", lines[2])
    assert re.fullmatch(r"HDF5: [12]\.\d+\.\d+", lines[3])
    assert lines[4] == "MPI: none"


@pytest.mark.parametrize("variable", ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MV2_COMM_WORLD_SIZE"])
def test_copies_without_mpi_are_refused(program, tmp_path, variable, monkeypatch):
    (tmp_path / "case.nml").write_text(GOOD)
    monkeypatch.setenv(variable, "4")
    done = call(program, "run", "case.nml", cwd=tmp_path)
    assert done.returncode == 2
    assert f"{variable} = 4: this program was started several times" in done.err
    assert not list(tmp_path.glob("*.h5"))

    monkeypatch.setenv(variable, "1")
    assert call(program, "run", "case.nml", "--quiet", cwd=tmp_path).returncode == 0


@pytest.mark.parametrize("verb", ["", *VERBS])
def test_help(program, verb):
    done = call(program, *([verb] if verb else []), "--help")
    assert done.returncode == 0
    assert done.out.count("asperity") >= 1
    assert verb in done.out
    assert done.err == ""


@pytest.mark.parametrize(
    ("arguments", "fragment"),
    [
        ([], "no command is given"),
        (["chek", "a.nml"], "did you mean check?"),
        (["run"], "run needs an input"),
        (["check", "--outptu", "x", "a.nml"], "did you mean --output?"),
        (["run", "a.nml", "b.nml"], "'b.nml' is one argument too many"),
        (["--version", "more"], "'more' is one argument too many"),
        (["run", "a.nml", "--output"], "--output needs a value"),
        (["run", "a.nml", "--threads", "0"], "must be an integer from 1 to 1024"),
        (["run", "a.nml", "--threads", "two"], "--threads two"),
        (["run", "a.nml", "--threads=99999999999"], "--threads 99999999999"),
        (["run", "a.nml", "--quiet=yes"], "--quiet takes no value"),
        (["run", "a.nml", "--threads", "1", "--threads=2"], "--threads is given twice"),
        (["run", "a.nml", "--time-limit", "9", "--time-limit", "8"], "--time-limit is given twice"),
        (["template", "hertz", "--reference"], "give a name or --reference"),
        (["info", "a.h5", "--restart"], "--restart is not an option of info"),
        (["check", "a.nml", "--output", "x.h5"], "--output is not an option of check"),
        (["template", "herz"], "did you mean hertz?"),
        (["info"], "info needs a result"),
    ],
)
def test_wrong_command_line(program, folder, arguments, fragment):
    done = call(program, *arguments, cwd=folder)
    assert done.returncode == 2
    assert fragment in done.err
    assert all(line.startswith("asperity: ") for line in done.err.strip("\n").split("\n"))
    assert done.out == ""


def test_all_faults_of_a_command_line(program):
    done = call(program, "run", "--quite", "--threads", "-1", "a", "b")
    assert len(done.err.splitlines()) == 3


def test_missing_files(program, folder):
    for verb in ("run", "check", "info"):
        done = call(program, verb, "not_there", cwd=folder)
        assert done.returncode == 3
        assert "not_there" in done.err
    done = call(program, "check", folder)
    assert done.returncode == 3


@pytest.mark.parametrize("verb", ["run", "check", "info", "template"])
def test_an_empty_name_of_a_file(program, folder, verb):
    done = call(program, verb, "", cwd=folder)
    assert done.returncode == 2
    assert done.err == f"asperity: {verb}: the name that follows it is empty\n"


def test_full_device(program, folder):
    if not Path("/dev/full").exists():
        pytest.skip("there is no /dev/full")
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([program, "--help"], stdout=full, stderr=subprocess.PIPE)
    assert done.returncode == 3
    assert b"standard output cannot be written" in done.stderr


def test_check_prints_an_input(program, folder):
    done = check(program, folder, GOOD)
    assert done.returncode == 0
    assert re.search(r"ly = 5e-4", done.out)
    assert re.search(r"tolerance = 1e-6", done.out)
    assert "memory: about" in done.out
    again = check(program, folder, done.out)
    assert again.returncode == 0
    assert without_comments(again.out) == without_comments(done.out)


def test_templates_are_good_inputs(program, folder):
    listed = call(program, "template").out.splitlines()
    names = [line.split()[0] for line in listed]
    assert {"hertz", "westergaard", "rough"} <= set(names)
    for name in names:
        text = call(program, "template", name).out
        assert text.count("! ") > 10
        assert check(program, folder, text).returncode == 0


def test_templates_run(program, tmp_path):
    for name in [line.split()[0] for line in call(program, "template").out.splitlines()]:
        path = tmp_path / f"{name}.nml"
        path.write_text(call(program, "template", name).out)
        done = call(program, "run", path, "--threads", "1")
        assert done.returncode == 0, done.err
        printed = call(program, "info", tmp_path / f"{name}.h5").out
        assert re.search(r"finished +yes", printed)
        with h5py.File(tmp_path / f"{name}.h5") as file:
            assert file.attrs["finished"] == 1
            assert file["history/contact_area"][0] > 0


def test_reference_page_is_current(program, root):
    page = (root / "docs" / "input_reference.md").read_text()
    assert page == call(program, "template", "--reference").out


def test_reference(program):
    text = call(program, "template", "--reference").out
    for group in [
        "case",
        "grid",
        "surface",
        "material",
        "adhesion",
        "friction",
        "phase",
        "solver",
        "output",
    ]:
        assert f"## `&{group}`" in text
    assert "| `nx` | integer |" in text


def test_message_has_the_stated_form(program, tmp_path):
    done = check(program, tmp_path, GOOD.replace("nx = 16", "nx = -4"))
    assert done.returncode == 2
    assert done.err == "case.nml: &grid: nx = -4: must be a positive integer\n"
    done = call(program, "run", "case.nml", cwd=tmp_path)
    assert done.returncode == 2
    assert not list(tmp_path.glob("*.h5"))


def test_a_result_never_replaces_what_it_comes_from(program, tmp_path):
    path = tmp_path / "case.nml"
    path.write_text(GOOD)
    (tmp_path / "link.nml").symlink_to(path)
    for other in ("case.nml", "./case.nml", f"../{tmp_path.name}/case.nml", "link.nml"):
        done = call(program, "run", "case.nml", "--output", other, cwd=tmp_path)
        assert done.returncode == 2
        assert "would overwrite the input" in done.err
    path.write_text(GOOD + "&output file = './link.nml' /\n")
    assert "overwrite the input" in call(program, "run", path).err
    assert path.read_text().startswith(GOOD)
    done = call(program, "run", path, "--output", "other.h5", cwd=tmp_path)
    assert done.returncode == 0, "another name is sufficient"


def test_a_height_map_that_is_named_like_the_input(program, tmp_path):
    asperity.surface.save(tmp_path / "road.h5", 1e-6 * np.cos(np.arange(16)) * np.ones((16, 1)),
                          1e-3, 1e-3)
    before = (tmp_path / "road.h5").read_bytes()
    (tmp_path / "road.nml").write_text(
        "&grid nx = 16, ny = 16, lx = 1e-3 /\n&surface shape = 'file', file = 'road.h5' /\n"
        "&material shear_modulus = 1e6 /\n&phase pressure = 1e3 /\n")
    for verb in ("check", "run"):
        done = call(program, verb, "road.nml", cwd=tmp_path)
        assert done.returncode == 2
        assert "road.h5, which is named after the input, would overwrite the height map" in done.err
    done = call(program, "run", "road.nml", "--output", "result.h5", cwd=tmp_path)
    assert done.returncode == 0, done.err
    assert (tmp_path / "result.h5").exists()
    assert not asperity.Simulation(tmp_path / "road.nml").finished, "it writes no result"
    assert (tmp_path / "road.h5").read_bytes() == before


def test_check_reads_height_maps(program, tmp_path):
    text = GOOD.replace("shape = 'sphere', radius = 0.01", "shape = 'file', file = 'map.h5'")
    path = tmp_path / "map.h5"
    assert check(program, tmp_path, text).returncode == 3
    for values, status in (
        (np.zeros((8, 16)), 0),
        (np.zeros((16, 8)), 2),
        (np.full((8, 16), np.nan), 2),
    ):
        with h5py.File(path, "w") as file:
            file["surface/height"] = values
        done = check(program, tmp_path, text)
        assert done.returncode == status, done.err
        assert status == 0 or "map.h5" in done.err
    assert call(program, "check", tmp_path / "case.nml").returncode == 2  # from another folder


@pytest.mark.parametrize("dataset", ["surface", "surface/height"])
def test_a_height_map_in_another_unit_causes_warnings(program, tmp_path, dataset):
    """The unit that the file states, and the slope, are warned of by `check` and by `run`."""
    text = GOOD.replace("shape = 'sphere', radius = 0.01", "shape = 'file', file = 'map.h5'")
    with h5py.File(tmp_path / "map.h5", "w") as file:
        file[dataset] = 5.0 * np.cos(2 * np.pi * np.arange(16) / 16) * np.ones((8, 1))
        file[dataset].attrs["units"] = "um"
    unit = ("&surface: file = 'map.h5': according to the file the unit of the map is um (attribute"
            " units of its dataset), but its heights are read as metres, m: set scale")
    slope = "&surface: file = 'map.h5': the slope of the map is about"
    done = check(program, tmp_path, text)
    assert f"! warning: {unit}" in done.out and f"! warning: {slope}" in done.out
    done = call(program, "run", "case.nml", "--quiet", cwd=tmp_path)
    assert done.err.startswith(f"warning: {unit}") and slope in done.err
    with h5py.File(tmp_path / "case.h5") as file:
        assert unit in file.attrs["warnings"] and slope in file.attrs["warnings"]
    done = check(program, tmp_path, text.replace("'map.h5'", "'map.h5', scale = 1e-6"))
    assert "warning" not in done.out


def test_values_of_a_map_that_are_not_finite_are_reported_with_their_place(program, tmp_path):
    text = GOOD.replace("shape = 'sphere', radius = 0.01", "shape = 'file', file = 'map.h5'")
    height = np.zeros((8, 16))
    for count, words in (
            (1, "a value that is not finite (NaN or infinite) at [5, 3]"),
            (2, "2 values that are not finite (NaN or infinite), the first at [4, 9]")):
        height[[5, 4][:count], [3, 9][:count]] = np.nan
        with h5py.File(tmp_path / "map.h5", "w") as file:
            file["surface/height"] = height
        assert f"{words} (row, column; from 0): all must be" in check(program, tmp_path, text).err
    with h5py.File(tmp_path / "map.h5", "w") as file:
        file.create_group("surface/height")
    assert ('"surface/height" is a group, not a dataset; there are: surface/height/'
            in check(program, tmp_path, text).err)


def test_a_missing_height_map_is_reported_with_its_place(program, tmp_path):
    """The message names input, group, variable and line, and reports several maps at once."""
    text = GOOD.replace("shape = 'sphere', radius = 0.01 /",
                        "shape = 'file', file = 'nowhere.h5' /\n"
                        "&surface shape = 'file', file = 'case.nml' /")
    (tmp_path / "case.nml").write_text(text)
    done = call(program, "check", "case.nml", cwd=tmp_path)
    assert done.returncode == 3
    first, second = done.err.splitlines()
    assert first == ("case.nml: &surface: file = 'nowhere.h5': there is no such file (line 2)")
    assert second == ("case.nml: &surface: file = 'case.nml': is not an HDF5 file;"
                      " `asperity import` makes one of a map in another format (line 3)")
    done = call(program, "run", "case.nml", cwd=tmp_path)
    assert done.returncode == 3
    assert done.err.splitlines()[-1] == first
    assert not (tmp_path / "case.h5").exists()


def test_info_of_a_killed_run_says_how_long_a_row_takes(program, tmp_path):
    (tmp_path / "case.nml").write_text(GOOD)
    assert call(program, "run", "case.nml", "--quiet", cwd=tmp_path).returncode == 0
    with h5py.File(tmp_path / "case.h5", "a") as file:
        file.attrs["finished"] = np.int32(0)
        file.attrs["expected_rows"] = np.int32(7)
        del file.attrs["outcome"]
        file.attrs["outcome"] = np.bytes_("running")
        file["history/seconds"][-1] = 2.25
    done = call(program, "info", "case.h5", cwd=tmp_path)
    assert re.search(r"(?m)^rows +1 of 7$", done.out)
    assert ("not recorded. The run continues, or its process has ended: it was killed, or it could"
            " not write its result (for example, because the disk was full); the last row took 2.25"
            " s; check whether rows are being added") in done.out


def test_info(program, tmp_path):
    path = tmp_path / "result.h5"
    with h5py.File(path, "w") as file:
        file.attrs.update(
            title="A title",
            program="asperity",
            version="0.1.0",
            finished=1,
            created="2020-01-01T00:00:00Z",
            input=GOOD,
        )
        file.create_group("grid").attrs.update(nx=16, ny=8, lx=1e-3, ly=5e-4, boundary="periodic")
        columns = {
            "step": [0],
            "phase": [1],
            "time": [0.0],
            "pressure": [1e5],
            "displacement": [1e-6],
            "contact_area": [0.125],
            "residual_normal": [3e-7],
        }
        for name, values in columns.items():
            file[f"history/{name}"] = np.array(values)
    done = call(program, "info", path)
    assert done.returncode == 0, done.err
    for piece in (
        "A title",
        "16 x 8 cells",
        "periodic",
        "phase 1: pressure 100000 Pa",
        "contact_area        0.125",
        "3e-7",
        "finished    yes",
    ):
        assert piece in done.out
    assert "friction" not in done.out
    with h5py.File(path, "a") as file:
        for name, value in (("friction", 0.25), ("stick_area", 0.0), ("residual_tangential", 2e-9)):
            file[f"history/{name}"] = np.array([value])
    printed = call(program, "info", path).out
    assert "  friction            0.25\n" in printed and "stick_area" not in printed
    assert "largest residual_tangential of all rows: 2e-9" in printed
    with h5py.File(path, "a") as file:
        file["grid"].attrs["boundary"] = "free"
    printed = call(program, "info", path).out
    assert "  force               0.05 N\n" in printed, "the pressure times 0.5 mm2"
    assert "  pressure  " not in printed
    with h5py.File(path, "a") as file:
        del file.attrs["title"]
    assert call(program, "info", path).returncode == 3
    path.write_bytes(b"not HDF5 at all")
    assert call(program, "info", path).returncode == 3


def test_info_of_other_files(program, tmp_path):
    """A map of another program is one too, its line for the input is right, others are named."""
    road = tmp_path / "Persson's road.h5"
    with h5py.File(road, "w") as file:
        file["surface"] = np.arange(32.0).reshape(4, 8)
    done = call(program, "info", road)
    assert done.returncode == 0 and "8 x 4 cells" in done.out, done.err
    line = done.out.split("to use it ")[1].strip()
    assert line == f"&surface shape = 'file', file = '{tmp_path}/Persson''s road.h5' /"
    case = (f"&grid nx = 8, ny = 4, lx = 1e-3 /\n{line}\n&material shear_modulus = 1e6 /\n"
            "&phase pressure = 1e4 /\n")
    assert "Persson''s road.h5" in check(program, tmp_path, case).out
    other = tmp_path / "other.h5"
    with h5py.File(other, "w") as file:
        file["numbers"] = np.zeros(3)
    done = call(program, "info", other)
    assert done.returncode == 3
    assert "is neither a result nor a height map" in done.err
    with h5py.File(other, "a") as file:
        file.attrs["result_id"] = "x"
    done = call(program, "info", other)
    assert done.returncode == 3
    assert "is a checkpoint: `asperity run` with --restart continues" in done.err


# Hypothesis makes these inputs. The program may accept one that is right; it must never crash.

lines = settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
pieces = st.sampled_from(
    [
        "&grid",
        "&",
        "$phase",
        "/",
        "=",
        ",",
        "(",
        ")",
        "(3)",
        "(2:1)",
        "'",
        '"',
        "!",
        "\n",
        "\r\n",
        "\t",
        "nx",
        "prony_g",
        "shape",
        "'sphere'",
        "2*",
        "*",
        "3*0.1",
        "1e999",
        "-1e-999",
        "NaN",
        "-Infinity",
        "99999999999999999999",
        ".true.",
        ".t",
        "%",
        "&end",
        "x" * 300,
        "'" + "y" * 3000 + "'",
        "1.5",
        "\x0c",
        "\u00e9",
        "0x10",
        "1d",
        "e5",
        "+",
        "-",
        ".",
        ";",
        "@",
        "shear_modulus",
        "(1,2)",
        "''",
        "**",
        "&&",
    ]
)


def without_comments(text):
    """Drop the comments, which say where a value comes from and change when the value is given."""
    return re.sub(r" *!.*", "", text)


def judge(done):
    """Check that the exit status and the message are proper ones, whatever the input was."""
    assert done.returncode in (0, 2)
    if done.returncode == 2:
        messages = done.err.strip("\n").split("\n")
        assert all(line.startswith("case.nml: ") for line in messages), done.err
        assert done.err.count("\n") <= 101
        assert done.out == ""


@lines
@given(data=st.binary(max_size=400))
def test_any_bytes(program, folder, data):
    done = check(program, folder, data)
    assert done.returncode == 2
    judge(done)


@lines
@given(data=st.lists(pieces, max_size=30))
def test_any_pieces(program, folder, data):
    judge(check(program, folder, " ".join(data)))


@lines
@given(data=st.lists(pieces, min_size=1, max_size=5), at=st.integers(0, len(GOOD)))
def test_pieces_in_a_good_input(program, folder, data, at):
    judge(check(program, folder, GOOD[:at] + " ".join(data) + GOOD[at:]))


@lines
@given(first=st.integers(0, len(GOOD)), last=st.integers(0, len(GOOD)))
def test_good_inputs_with_parts_removed(program, folder, first, last):
    judge(check(program, folder, GOOD[: min(first, last)] + GOOD[max(first, last) :]))


GROUPS = {
    "grid": {"nx": 16, "ny": 8, "lx": 1e-3, "ly": 1e-3, "boundary": "'periodic'"},
    "surface": {"shape": "'sphere'", "radius": 0.01, "centre_x": 0.0},
    "material": {
        "shear_modulus": 1e6,
        "poisson": 0.4,
        "thickness": 0.0,
        "prony_g": "",
        "wlf_c1": "",
    },
    "phase": {"pressure": 1e5, "duration": "", "dt": "", "steps": "", "relaxed": "", "name": ""},
    "solver": {"tolerance": "", "threads": "", "method": "", "max_iterations": ""},
    "output": {"file": "", "snapshot_times": "", "snapshot_fields": "", "compression": ""},
    "case": {"title": ""},
}
VARIABLES = [(group, name) for group, names in GROUPS.items() for name in names]


@settings(lines, max_examples=80)
@given(
    variable=st.sampled_from(VARIABLES),
    value=st.one_of(st.integers(), st.floats(), st.text(max_size=20), st.booleans(), pieces),
)
def test_any_value(program, folder, variable, value):
    text = ""
    for group, names in GROUPS.items():
        text += f"&{group}\n"
        for name, usual in names.items():
            if (group, name) == variable:
                text += f"  {name} = {value}\n"
            elif usual != "":
                text += f"  {name} = {usual}\n"
        text += "/\n"
    done = check(program, folder, text)
    judge(done)
    if done.returncode == 0:
        again = check(program, folder, done.out)
        assert again.returncode == 0
        assert without_comments(again.out) == without_comments(done.out)


@lines
@given(
    arguments=st.lists(
        st.one_of(
            st.sampled_from(
                [
                    *VERBS,
                    "--help",
                    "--output",
                    "--threads",
                    "--quiet",
                    "--restart",
                    "--",
                    "-",
                    "=",
                    "--version",
                    "-h",
                    "--threads=3",
                    "--output=",
                    "a.nml",
                ]
            ),
            st.text(
                st.characters(blacklist_characters="\0", blacklist_categories=["Cs"]), max_size=12
            ),
        ),
        max_size=6,
    )
)
def test_any_command_line(program, folder, arguments):
    call(program, *arguments, cwd=folder)


@pytest.mark.parametrize(("nx", "ny", "steps", "every", "friction"), [
    (32, 1, 700, 1, False), (64, 64, 100, 7, True), (363, 400, 4, 1, True), (8, 8, 10, 0, False)])
def test_the_size_of_a_result_is_foreseen(program, tmp_path, nx, ny, steps, every, friction):
    """A field of 363 x 400 cells fills two chunks in part, which are stored whole."""
    case = asperity.Case(
        grid=dict(nx=nx, ny=ny, lx=1e-3), material=dict(shear_modulus=1e6, thickness=1e-3),
        surface=dict(shape="sine", amplitude=2e-6, wavelength=1e-3),
        phase=[dict(pressure=1e4), dict(duration=0.01, steps=steps, velocity_x=1e-3)],
        output=dict(compression=0, snapshot_every=every))
    if friction:
        case.friction.update(law="coulomb", coefficient=0.3)
    case.write(tmp_path / "y.nml")
    said = re.search(r"! result: about ([\d.]+) MB with (\d+) snapshots?, before compression",
                     call(program, "check", tmp_path / "y.nml").out)
    assert call(program, "run", tmp_path / "y.nml", "--quiet").returncode == 0
    result = tmp_path / "y.h5"
    assert len(asperity.open(result).snapshots) == int(said[2])
    size = 1e-6 * result.stat().st_size
    assert abs(float(said[1]) - size) < 0.1 + 0.06 * size
