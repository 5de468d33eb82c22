"""Tables and links of the pages agree with the program and the validation."""

import re
import runpy
import shutil
import subprocess

import h5py
import pytest
from conftest import ROOT

README = (ROOT / "README.md").read_text()
PAGE = (ROOT / "docs" / "result_file.md").read_text()


def rows(text):
    """Return the cells of all table rows."""
    return [[cell.strip() for cell in line.strip("|").split("|")]
            for line in text.splitlines() if line.startswith("|") and "---" not in line]


def number(cell):
    return float(cell.split()[0])


def test_values_of_the_readme_are_those_of_the_validation():
    chapters = {}
    for chapter in (ROOT / "docs" / "validation.md").read_text().split("\n## ")[1:]:
        title = re.split(r"\W", chapter)[0].lower()
        chapters[title] = {row[0]: row for row in rows(chapter)}
    table = README.split("## Is it right?")[1].split("\n## ")[0]
    names = {"hertz": "hertz", "westergaard": "westergaard", "lee": "lee", "hunter": "hunter",
             "three": "waves", "maugis": "maugis", "cattaneo": "cattaneo"}
    checked = 0
    for head, ours, reference in rows(table)[1:]:
        case, name = head.split(": ")
        row = chapters[names[re.split(r"\W", case)[0].lower()]][name]
        for shown, kept in ((ours, row[1]), (reference, row[2])):
            assert number(shown) == pytest.approx(number(kept), rel=4e-4)
            assert shown.split()[1:] == kept.split()[1:]
        checked += 1
    assert checked == 7


def test_links_lead_somewhere():
    pages = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")]
    pages += [*(ROOT / "docs").glob("*.md"), *(ROOT / "examples").glob("*/README.md")]
    for page in pages:
        for target in re.findall(r"\]\(([^)#]+?)\)", page.read_text()):
            if not target.startswith("http"):
                assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_links_within_a_page_leave_their_section():
    for page in (ROOT / "docs").glob("*.md"):
        names, inside = set(), []
        name = ""
        for line in page.read_text().splitlines():
            if line.startswith("#"):
                name = re.sub(r"[^\w -]", "", line.lstrip("# ").lower()).replace(" ", "-")
                names.add(name)
            inside += [(name, target) for target in re.findall(r"\]\(#([^)]+)\)", line)]
        for section, target in inside:
            assert target in names and target != section, f"{page.name}: #{target}"


def test_result_page_names_every_dataset(program, tmp_path):
    text = subprocess.run([program, "template", "friction"], check=True, capture_output=True,
                          text=True).stdout
    text = text.replace("nx = 64", "nx = 32").replace("ny = 37", "ny = 18")
    (tmp_path / "case.nml").write_text(text)
    subprocess.run([program, "run", "case.nml", "--quiet"], cwd=tmp_path, check=True)
    with h5py.File(tmp_path / "case.h5") as file:
        assert {row[0].strip("`") for row in rows(PAGE.split("## `/grid`")[0])[1:]
                for row in [row] if row[0] != "attribute"} >= {"title", "input"}
        for name in file.attrs:
            assert f"`{name}`" in PAGE.split("## `/grid`")[0], name
        last = "snapshots/" + sorted(file["snapshots"])[-1]
        for title, group in (("/grid", "grid"), ("/surface", "surface"), ("/material", "material"),
                             ("/history", "history"), ("/snapshots/NNNNNN", last)):
            chapter = PAGE.split(f"## `{title}`")[1].split("\n## ")[0]
            documented = {row[0].strip("`"): row[1:] for row in rows(chapter)[1:]}
            found = {name: [data.attrs["units"].replace("1", "-"), data.attrs["long_name"]]
                     for name, data in file[group].items()}
            assert documented == found, title


def test_input_page_is_the_program_s(program):
    page = subprocess.run([program, "template", "--reference"], check=True, capture_output=True,
                          text=True).stdout
    assert (ROOT / "docs" / "input_reference.md").read_text() == page


def test_help_of_every_verb(program):
    for verb in ("run", "check", "template", "info"):
        text = subprocess.run([program, verb, "--help"], check=True, capture_output=True,
                              text=True).stdout
        assert text.startswith(f"asperity {verb}")
        assert max(map(len, text.splitlines())) <= 100


@pytest.mark.skipif(shutil.which("sh") is None, reason="needs a shell")
def test_run_sh_runs_the_main_example():
    text = (ROOT / "run.sh").read_text()
    (main,) = re.findall(r"input=\$root/(\S+)", text)
    assert (ROOT / main).is_file()
    assert f"]({main.replace('input.nml', 'picture.png')})" in README


def test_the_advice_on_the_mesh_is_measured():
    text, _ = runpy.run_path(str(ROOT / "tools" / "choosing.py"))["mesh"]()
    page = (ROOT / "docs" / "choosing.md").read_text()
    kept = page.split("<!-- mesh: begin -->")[1].split("<!-- mesh: end -->")[0]
    measured, computed = rows(text)[1:], rows(kept)[1:]
    assert len(measured) == 5
    for row, line in zip(measured, computed, strict=True):
        assert [float(cell) for cell in line] == pytest.approx([float(cell) for cell in row],
                                                              abs=2e-4)


def test_the_advice_on_arms_is_measured():
    tables, _ = runpy.run_path(str(ROOT / "tools" / "choosing.py"))["arms"]()
    page = (ROOT / "docs" / "choosing.md").read_text()
    for mark, text in tables.items():
        kept = page.split(f"<!-- {mark}: begin -->")[1].split(f"<!-- {mark}: end -->")[0]
        for row, line in zip(rows(text)[1:], rows(kept)[1:], strict=True):
            assert [number(cell) for cell in line] == pytest.approx(
                [number(cell) for cell in row], rel=0.05, abs=0.15)
    kept = rows(page.split("<!-- cut: begin -->")[1].split("<!-- cut: end -->")[0])[1:]
    assert max(abs(number(cell)) for cell in kept[3][1:]) < 5 < abs(number(kept[1][1]))


def test_the_predicted_memory_is_what_runs_take():
    page = (ROOT / "docs" / "choosing.md").read_text()
    kept = rows(page.split("<!-- cost: begin -->")[1].split("<!-- cost: end -->")[0])[1:]
    assert len(kept) == 6
    for _, predicted, taken, *_ in kept:
        assert float(predicted) == pytest.approx(float(taken), rel=0.1)


def test_pull_off_of_the_guide_shows_the_limit_of_the_grid():
    page = (ROOT / "docs" / "choosing.md").read_text()
    kept = rows(page.split("<!-- adhesion: begin -->")[1].split("<!-- adhesion: end -->")[0])[1:]
    assert kept
    for _, cells, _, error in kept:
        assert (abs(float(error.split()[0])) < 1.5) == (float(cells) < 0.72)
