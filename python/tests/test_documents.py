"""Every block of README.md and docs is run: commands, Python, inputs, Fortran programs.

The blocks of a page are run in their order, in an empty folder. A comment before a block says to
which file it is written, which file repeats its commands, or that it is the output of the block
before it (docs/developer.md lists these comments).
"""

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
from conftest import ROOT

import asperity

# Pages whose blocks have tests of their own, which also check the outcome.
ELSEWHERE = {"docs/long_runs.md": "test_long_runs_page.py",
             "docs/measured_data.md": "test_measured_page.py",
             "docs/results.md": "test_results_page.py",
             "docs/sweeps.md": "test_sweeps_page.py"}

COMMAND = re.compile(r"(?:\./\w|\.ci/run|\. tools|asperity (?!:)|python -|fpm |pip |conda |brew )")


@dataclass
class Block:
    """A fenced block of a page."""

    language: str
    text: str
    mark: str          # the comment before it
    line: int


def pages():
    """Return the pages, by their paths from the root."""
    found = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md"),
             *(ROOT / "docs" / "api").glob("*.md")]
    return sorted(path.relative_to(ROOT).as_posix() for path in found)


def blocks(page):
    """Return the fenced blocks of a page."""
    lines = (ROOT / page).read_text().splitlines()
    found, start = [], None
    for number, line in enumerate(lines):
        if not line.startswith("```"):
            continue
        if start is None:
            start = number
        else:
            mark = re.fullmatch(r"<!-- (.+) -->", lines[start - 1]) if start else None
            found.append(Block(lines[start][3:].strip(), "\n".join(lines[start + 1:number]) + "\n",
                               mark[1] if mark else "", start + 1))
            start = None
    assert start is None, f"{page}: a block is not closed"
    return found


def commands(text):
    """Return the commands of a block, without comments."""
    lines = re.sub(r"\\\n\s*", "", text).splitlines()
    return [found for found in (re.sub(r"(^|\s)#.*", "", line).strip() for line in lines) if found]


PAGES = [page for page in pages() if page not in ELSEWHERE and blocks(page)]


@pytest.mark.parametrize("page", PAGES)
def test_blocks_run(page, program, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", os.pathsep.join([
        str(Path(program).parent), str(Path(sys.executable).parent), os.environ["PATH"]]))
    names, printed = {}, []
    for block in blocks(page):
        where = f"{page}, line {block.line}"
        kind, _, rest = block.mark.partition(": ")
        printed.append(capsys.readouterr().out)
        if block.mark.startswith("not run: installs"):
            assert block.language == "sh" and "install" in block.text, where
        elif kind == "elsewhere":
            there = "\n".join((ROOT / name).read_text() for name in rest.split())
            for command in commands(block.text):
                assert " ".join(command.split()[:3]) in there, f"{where}: {command}"
        elif block.language == "sh":
            done = subprocess.run(["sh", "-eu", "-c", block.text], capture_output=True, text=True)
            assert done.returncode == 0, f"{where}: {done.stderr}"
            assert "warning" not in done.stderr, f"{where}: {done.stderr}"
        elif block.language == "python":
            exec(compile(block.text, where, "exec"), names)
        elif kind == "output":
            assert printed[-1] == block.text, where
        elif block.language == "fortran" and kind == "file":
            Path(rest).write_text(block.text)
            if rest.endswith(".f90"):
                run_fortran(Path(rest), Path(program).parent)
        else:
            assert block.language in ("text", "toml"), f"{where}: a block that no test runs"
    check = OUTCOMES.get(page)
    if check:
        check(tmp_path, "".join(printed) + capsys.readouterr().out)


def run_fortran(path, build):
    """Compile a program with the library in the build folder, and run it."""
    modules, library = build / "libasperity.a.p", build / "libasperity.a"
    compiler = os.environ.get("FC") or shutil.which("gfortran")
    if not library.is_file() or compiler is None:
        pytest.skip("needs the library of an installation in place, and a compiler")
    subprocess.run([compiler, "-Wall", "-Werror", "-fopenmp", f"-I{modules}", str(path),
                    str(library), "-lhdf5_serial", "-lz", "-lfftw3_omp", "-lfftw3", "-lfftw3f_omp",
                    "-lfftw3f", "-o", "program"], check=True)
    done = subprocess.run(["./program"], check=True, capture_output=True, text=True)
    print(done.stdout)


def check_readme(folder, out):
    run = asperity.open(folder / "road.h5")
    assert run.finished and run.history["friction"][-1] > 0.5    # friction, loss in the rubber
    friction, area, computed, theory = map(float, out.split())
    assert friction > 0.5 and 0.0 < area < 1.0
    assert 0.8 * theory < computed < 2.0 * theory
    for name in ("friction.png", "pressure.png", "road.png", "road.html", "road.xdmf"):
        assert (folder / name).stat().st_size > 1000


def check_first_run(folder, out):
    (approach, exact), (peak, exact_peak) = (
        map(float, line.split()) for line in out.splitlines()[-2:])
    assert approach == pytest.approx(exact, rel=1e-3)
    assert exact == pytest.approx(1e-4, rel=1e-3)
    assert peak == pytest.approx(exact_peak, rel=5e-3)
    assert (folder / "pressure.png").stat().st_size > 10000


def check_coming_from(folder, out):
    # The numbers that the page prints, including those that it quotes from other programs.
    page = (ROOT / "docs" / "coming_from.md").read_text()
    for number in out.split():
        assert f"{float(number):.6f}" in page


def check_fortran(folder, out):
    sphere, *rows = filter(None, out.splitlines())
    converged, peak, hertz = sphere.split()
    assert converged == "T"
    assert float(peak) == pytest.approx(float(hertz), rel=1e-3)
    friction = [float(row.split()[1]) for row in rows]
    assert len(rows) == 41 and friction[0] == 0.0
    assert friction[-1] == pytest.approx(0.5, abs=0.05)     # Coulomb's, on slopes of up to 0.063


def check_driving(folder, out):
    areas = re.findall(r"row +(\d+): contact area (\S+),", out)
    assert float(areas[-1][1]) == pytest.approx(0.25, abs=0.003)
    assert (folder / "constant_area.png").stat().st_size > 5000
    # The page must show all that is printed, and nothing else.
    outputs = [block.text for block in blocks("docs/driving.md") if block.mark == "output"]
    assert len(outputs) == 7 and "".join(outputs) == out


OUTCOMES = {"docs/driving.md": check_driving,
            "README.md": check_readme, "docs/first_run.md": check_first_run,
            "docs/coming_from.md": check_coming_from, "docs/api/fortran.md": check_fortran}


def test_no_page_is_left_out():
    for page, test in ELSEWHERE.items():
        assert Path(page).name in (Path(__file__).parent / test).read_text()
    assert {"README.md", "docs/install.md", "docs/first_run.md", "docs/developer.md"} <= set(PAGES)


@pytest.mark.parametrize("page", [page for page in pages() if page not in ELSEWHERE])
def test_commands_stand_in_blocks(page):
    """A command in an indented block would not be run by any test."""
    text = re.sub(r"(?s)^```.*?^```", "", (ROOT / page).read_text(), flags=re.MULTILINE)
    assert not re.search(r"^(<{7}|>{7}) ", text, flags=re.MULTILINE), "a merge was left half done"
    for line in text.splitlines():
        assert not re.match(r"    " + COMMAND.pattern, line), line


def test_no_page_recommends_the_package_on_pypi():
    """The name asperity on PyPI is not ours: whoever installs it gets somebody else's package."""
    pattern = re.compile(r"pip install (?:-\S+ )*[\"']?asperity\b")
    files = [ROOT / page for page in PAGES] + list((ROOT / "python" / "asperity").rglob("*.py")) + \
        list((ROOT / "app").glob("*.f90")) + list((ROOT / "tools").glob("*"))
    found = [str(file) for file in files if file.is_file() and pattern.search(file.read_text())]
    assert found == []


def test_namelist_of_the_readme_is_ten_lines():
    (case,) = (block for block in blocks("README.md") if block.language == "fortran")
    (script,) = (block for block in blocks("README.md") if block.language == "python")
    assert case.text.count("\n") <= 10 and script.text.count("\n") <= 11


def test_messages_of_the_troubleshooting_page_exist():
    sources = "\n".join(path.read_text() for folder in ("src", "app", "python/asperity")
                        for path in (ROOT / folder).rglob("*.[fp]*") if path.suffix != ".pyc")
    sources = re.sub(r"'\s*//\s*&?\s*'", "", sources)            # strings over several lines
    page = (ROOT / "docs" / "troubleshooting.md").read_text()
    quoted = [text for line in page.splitlines() if line.startswith(("**`", "| `", "| iteration"))
              for text in re.findall(r"`([^`]+)`", line.split("** ")[0].split(" | ")[0])]
    assert len(quoted) > 15
    for text in quoted:
        for part in text.split("..."):
            if part.strip() and not re.fullmatch(r"\w+", part.strip()):
                assert part.strip() in sources, part


def test_python_interface_is_documented_whole():
    """Each public name is listed under its task; docs/conf.py appends modules that are new."""
    folder = ROOT / "docs" / "api"
    pages = {path.stem: path.read_text() for path in folder.glob("python_*.rst")}
    text = "".join(pages.values())
    for name in asperity.__all__:
        if not name.startswith("__"):
            assert re.search(rf"\.\. auto\w+:: asperity\.{name}\n", text), name
    for name in ("surface", "theory", "material", "result", "operators", "dma"):
        assert f"automodule:: asperity.{name}\n" in text
    tasks = re.findall(r":doc:`(\w+)`", (folder / "python.rst").read_text())
    assert sorted(tasks) == sorted(pages)
