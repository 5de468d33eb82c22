"""The man page and the shell completions agree with the commands of the program."""

import os
import pty
import re
import resource
import select
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from conftest import PATIENCE, ROOT

from asperity.results.column_types import RowColumns
from asperity.results.field_types import NORMAL_FIELDS, TANGENTIAL_FIELDS

SHARE = ROOT / "share"
PYTHON_VERBS = ["plot", "report", "watch", "import", "fit"]


def helped(program, *words):
    """Return the help text of the program or a command."""
    return subprocess.run([program, *words, "--help"], check=True, capture_output=True,
                          text=True).stdout


def verbs(program):
    """Return the commands in the order of the help text."""
    return list(dict.fromkeys(re.findall(r"^asperity ([a-z]+) ", helped(program), flags=re.M)))


def test_the_man_page_names_every_command_and_option(program):
    page = (SHARE / "asperity.1").read_text().replace("\\-", "-")
    names = verbs(program)
    assert len(names) == 10 and set(PYTHON_VERBS) < set(names)
    for verb in names:
        assert re.search(rf"^\.B[IR]? {verb}\b", page, flags=re.M), verb
    for verb in ("run", "check", "template", "info"):
        for option in re.findall(r"--[a-z]+", helped(program, verb)):
            assert option in page, option


def test_the_man_page_is_clean():
    if not shutil.which("groff"):
        pytest.skip("groff is not installed")
    done = subprocess.run(["groff", "-man", "-ww", "-Tutf8", str(SHARE / "asperity.1")],
                          capture_output=True, text=True)
    assert done.returncode == 0 and done.stderr == ""


@pytest.mark.parametrize("name", ["asperity.bash", "_asperity", "asperity.fish"])
def test_completions_know_every_command(program, name):
    text = (SHARE / name).read_text()
    for verb in verbs(program):
        assert re.search(rf"\b{verb}\b", text), verb


def completed(program, folder, *words):
    """Return what bash would offer behind these words."""
    script = (f"source {SHARE / 'asperity.bash'}; COMP_WORDS=({program} "
              + " ".join(f"'{word}'" for word in words)
              + f"); COMP_CWORD={len(words)}; _asperity; printf '%s\\n' \"${{COMPREPLY[@]}}\"")
    done = subprocess.run(["bash", "--norc", "-c", script], cwd=folder, capture_output=True,
                          text=True)
    assert done.returncode == 0 and done.stderr == "", done.stderr
    return set(done.stdout.split("\n")) - {""}


def test_completion_in_bash(program, tmp_path):
    if not shutil.which("bash"):
        pytest.skip("bash is not installed")
    for name in ("road.nml", "road.h5", "a road.nml", "notes.txt"):
        (tmp_path / name).touch()
    (tmp_path / "results").mkdir()
    assert completed(program, tmp_path, "re") == {"report"}
    assert completed(program, tmp_path, "run", "") == {"road.nml", "a road.nml", "results"}
    assert completed(program, tmp_path, "info", "r") == {"road.h5", "results"}
    assert completed(program, tmp_path, "run", "--r") == {"--restart"}
    assert "hertz" in completed(program, tmp_path, "template", "h")
    assert "--history" in completed(program, tmp_path, "plot", "--h")
    # Values of options: allowed words, names, files, and nothing for numbers.
    assert completed(program, tmp_path, "import", "--level", "") == {"none", "mean", "tilt",
                                                                     "curvature"}
    assert completed(program, tmp_path, "friction", "--join", "m") == {"mirror"}
    assert completed(program, tmp_path, "import", "--periodic", "") == {"as-is", "hann", "tukey"}
    assert completed(program, tmp_path, "plot", "road.h5", "--field", "g") == {"gap"}
    assert completed(program, tmp_path, "plot", "road.h5", "--history", "en") == {
        "energy", "energy_elastic", "energy_adhesive", "energy_kinetic", "energy_radiated"}
    assert completed(program, tmp_path, "run", "road.nml", "--output", "r") == {"road.h5",
                                                                                "results"}
    assert completed(program, tmp_path, "run", "road.nml", "--threads", "") == set()
    assert completed(program, tmp_path, "friction", "r.h5", "--speeds", "") == set()
    assert completed(program, tmp_path, "run", "--quiet", "ro") == {"road.nml"}


def test_bash_quotes_names_with_blanks(program, tmp_path):
    if not shutil.which("bash"):
        pytest.skip("bash is not installed")
    (tmp_path / "a road.nml").touch()
    (tmp_path / "start").write_text(
        f"PATH={Path(program).parent}:$PATH; PS1='> '; source {SHARE / 'asperity.bash'}\n")
    process, terminal = pty.fork()
    if process == 0:
        os.chdir(tmp_path)
        os.environ["TERM"] = "dumb"
        os.execvp("bash", ["bash", "--rcfile", "start", "-i"])
    try:
        os.write(terminal, b"asperity run a\\ r\t")
        shown, until = b"", time.monotonic() + PATIENCE
        while b"nml" not in shown.split(b"asperity run")[-1] and time.monotonic() < until:
            if select.select([terminal], [], [], 0.1)[0]:
                shown += os.read(terminal, 1024)
        assert b"asperity run a\\ road.nml" in shown
    finally:
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)
        os.close(terminal)


@pytest.mark.parametrize("name", ["asperity.bash", "_asperity", "asperity.fish"])
def test_completions_know_the_names_of_fields_and_columns(name):
    words = set(re.findall(r"\w+", (SHARE / name).read_text()))
    fields = {*NORMAL_FIELDS, *TANGENTIAL_FIELDS}
    columns = set(RowColumns.__annotations__)
    assert fields | columns <= words
    # No name is left from an earlier version: every other word with an underscore is of the shell.
    left = {word for word in words - fields - columns if re.fullmatch(r"[a-z]+(_[a-z]+)+", word)}
    assert not {word for word in left if word.split("_")[0] in {
        column.split("_")[0] for column in columns}}


def test_python_does_its_commands(program):
    for verb in PYTHON_VERBS:
        text = helped(program, verb)
        assert text.startswith(f"usage: asperity {verb} ")
        assert subprocess.run([program, "help", verb], capture_output=True,
                              text=True).stdout == text


def test_exit_statuses_of_python_are_returned(program, tmp_path):
    done = subprocess.run([program, "plot", "not_there.h5"], cwd=tmp_path, capture_output=True,
                          text=True)
    assert done.returncode == 3 and done.stderr.startswith("asperity: not_there.h5")
    done = subprocess.run([program, "watch", "x.h5", "--every", "0"], cwd=tmp_path,
                          capture_output=True, text=True)
    assert done.returncode == 2 and "must be 0.05 to 3600 seconds" in done.stderr


def test_without_the_package_it_says_how_to_get_it(program, tmp_path):
    alone = tmp_path / "asperity"
    shutil.copy2(program, alone)
    surroundings = {"PATH": "/usr/bin:/bin", "HOME": str(tmp_path)}
    done = subprocess.run([alone, "plot", "x.h5"], env=surroundings, capture_output=True,
                          text=True)
    assert done.returncode == 3
    assert "pip install ." in done.stderr and "ASPERITY_PYTHON" in done.stderr
    surroundings["ASPERITY_PYTHON"] = sys.executable
    done = subprocess.run([alone, "plot", "--help"], env=surroundings, capture_output=True,
                          text=True)
    assert done.returncode == 0 and "RESULT.h5" in done.stdout


def test_arguments_reach_python_unchanged(program, tmp_path):
    name = "a b'c\"d$HOME;*.h5"
    done = subprocess.run([program, "plot", name], cwd=tmp_path, capture_output=True, text=True,
                          env=os.environ)
    assert done.returncode == 3 and f"asperity: {name}: no such file" in done.stderr
    assert not list(Path(tmp_path).iterdir())


SLIDING = """&grid nx = 64, ny = 64, lx = 1e-3 /
&surface shape = 'self_affine', hurst = 0.8, rms_slope = 0.2, wavelength_long = 0.25e-3,
         wavelength_short = 62.5e-6 /
&material shear_modulus = 1e6, prony_g = 2e6, 1e6, prony_tau = 1e-5, 1e-3 /
&phase pressure = 0.2e6 /
&phase duration = 2e-3, steps = 600, velocity_x = 1.0 /
&solver threads = 1 /
"""


def estimated(program, folder, text):
    """Return the seconds that `check` expects."""
    (folder / "case.nml").write_text(text)
    message = subprocess.run([program, "check", "case.nml"], cwd=folder, check=True,
                          capture_output=True, text=True).stdout
    number, unit = re.search(r"^! time: about (\d+) (\w+?)s? on this machine", message,
                             flags=re.M).groups()
    return int(number) * {"second": 1, "minute": 60, "hour": 3600, "day": 86400}[unit]


def test_check_estimates_the_time_of_a_run(program, tmp_path):
    expected = estimated(program, tmp_path, SLIDING)
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run([program, "run", "case.nml", "--quiet"], cwd=tmp_path, check=True)
    taken = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    assert taken / 6 < expected < 6 * taken
    large = SLIDING.replace("64", "1024")
    # The rows have 256 times as many cells; on the small grid, writing a row takes a large share.
    assert 30 * expected < estimated(program, tmp_path, large) < 1000 * expected
