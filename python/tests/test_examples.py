"""Each study passes its checks in its quick form, has an explanation and is in the gallery."""

import json
import re
import subprocess
import sys

import pytest
from conftest import ROOT
from matplotlib import pyplot

sys.path.insert(0, str(ROOT / "examples"))

import make as gallery

CASES = sorted((ROOT / "examples").glob("*/input.nml"))
STUDIES = gallery.studies()
HEADINGS = ["What is seen", "The thesis", "Make it"]


def named(study):
    return study.name


@pytest.mark.parametrize("study", STUDIES, ids=named)
def test_quick_form(study, tmp_path, program):
    gallery.common.jobs = 1
    _, figure = gallery.make(study, tmp_path, quick=True)
    path = tmp_path / "picture.png"
    figure.savefig(path, dpi=60)
    assert path.stat().st_size > 5000
    pyplot.close(figure)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.parent.name)
def test_input_is_right_and_gives_no_warning(case, program):
    done = subprocess.run([program, "check", str(case)], check=True, capture_output=True, text=True)
    assert done.stderr == ""
    assert "warning" not in done.stdout.lower()


@pytest.mark.parametrize("study", STUDIES, ids=named)
def test_study_is_explained(study):
    pictures = re.findall(r"!\[.+?\]\((.+?)\)", study.readme)
    assert "picture.png" in pictures
    for picture in pictures:
        assert (study.folder / picture).is_file()
    if study.module is None:
        return
    assert 0 < study.minutes < 60
    assert re.findall(r"^## (.+)$", study.readme, flags=re.MULTILINE)[:3] == HEADINGS
    assert f"examples/make.py {study.name}" in gallery.part(study.readme, "Make it")
    assert gallery.part(study.readme, "The thesis")
    if study.minutes >= 10:
        assert "min" in gallery.part(study.readme, "Make it")


def test_the_gallery_is_that_of_the_studies():
    page = (ROOT / "docs" / "gallery.md").read_text()
    assert page == gallery.gallery(), "python examples/make.py --gallery writes it anew"


def test_make_lists_and_refuses(capsys):
    assert gallery.main(["--list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == [study.name for study in STUDIES]
    with pytest.raises(SystemExit, match="there is no study tabr"):
        gallery.main(["tabr"])


def test_a_study_whose_check_fails_is_reported(tmp_path, monkeypatch, capsys):
    folder = tmp_path / "wrong"
    folder.mkdir()
    (folder / "README.md").write_text("# Wrong\n\nNothing.\n")
    (folder / "study.py").write_text(
        '"""Wrong."""\nMINUTES = 1\ndef compute(folder, quick):\n    return {"x": 2.0}\n'
        'def check(data, quick):\n    assert data["x"] < 1, "x is too large"\n')
    monkeypatch.setattr(gallery, "EXAMPLES", tmp_path)
    assert gallery.main(["--quick", "--jobs", "1", "wrong"]) == 1
    assert "wrong: FAILED: x is too large" in capsys.readouterr().err


def test_a_warning_that_is_not_expected_fails(tmp_path, monkeypatch, capsys):
    folder = tmp_path / "warns"
    folder.mkdir()
    (folder / "README.md").write_text("# Warns\n\nNothing.\n")
    body = ('"""Warns."""\nimport warnings\nimport common\nfrom matplotlib.figure import Figure\n'
            'MINUTES = 1\ndef compute(folder, quick):\n'
            '    with common.expected("a step of (1 m)", "dull"):\n'
            '        warnings.warn("case: {}")\n    return {{}}\n'
            'def check(data, quick):\n    pass\ndef picture(data):\n    return Figure()\n')
    monkeypatch.setattr(gallery, "EXAMPLES", tmp_path)
    for said, status in (("a step of (1 m) is long", 0), ("two lines\\nof dull text", 0),
                         ("stick-slip", 1)):
        (folder / "study.py").write_text(body.format(said))
        assert gallery.main(["--quick", "--jobs", "1", "warns"]) == status
    assert "warns: FAILED: case: stick-slip" in capsys.readouterr().err


def test_numbers_that_are_kept():
    import numpy as np

    data = {"x": np.float64(1.23456789), "a": np.arange(3) / 3, "long": np.zeros(100),
            "path": "/tmp/x.h5", "name": "gauss", "n": 3, "nan": float("nan"),
            "said": "give it 20 kg/m3", "nested": {"b": [1.0, 2.0]}, "none": [np.zeros(99)] * 2}
    assert gallery.numbers(data) == {"x": 1.23457, "a": [0.0, 0.333333, 0.666667], "name": "gauss",
                                     "n": 3, "said": "give it 20 kg/m3",
                                     "nested": {"b": [1.0, 2.0]}}


def values(kept):
    """Return all numbers of a file numbers.json."""
    if isinstance(kept, dict | list):
        inner = kept.values() if isinstance(kept, dict) else kept
        return [number for one in inner for number in values(one)]
    return [] if isinstance(kept, bool | str | None) else [abs(float(kept))]


def is_known(text, known):
    """Return whether a printed number is a known one, apart from a power of ten."""
    half = 0.5001 * 10.0 ** -len(text.partition(".")[2])
    return any(abs(value * 10.0**power - float(text)) <= half
               for value in known for power in range(-12, 13))


@pytest.mark.parametrize("study", [one for one in STUDIES if one.module is not None],
                         ids=named)
def test_numbers_of_the_text_are_kept(study):
    """The numbers in the tables, and those of three digits in the text, come from the run."""
    known = values(json.loads((study.folder / "numbers.json").read_text()))
    seen = gallery.part(study.readme, "What is seen")
    rows = [line.strip().strip("|").split("|") for line in seen.splitlines()
            if line.strip().startswith("|")]
    for row in rows:
        if row[0].strip().startswith("thesis"):
            continue
        for cell in row:
            number = re.fullmatch(r"[-−]?(\d+(?:\.\d+)?)(?: %)?", cell.strip())
            assert number is None or is_known(number[1], known), f"{cell} is not in numbers.json"
    # A text may also quote inputs: numbers in the study's sources or in its first paragraph.
    sources = [*study.folder.glob("*.py"), *study.folder.glob("*.nml"),
               *(ROOT / "examples").glob("*.py")]
    inputs = " ".join([study.readme.partition("\n## ")[0], *(path.read_text() for path in sources)])
    known += [float(number) for number in re.findall(r"\d+(?:\.\d+)?", inputs)]
    text = re.sub(r"`[^`]*`|\]\([^)]*\)|(?:eq\.|[Ff]igures?|[Ss]ections?) [\d., and]+|^ *\|.*$"
                  r"|^    .*$", "", seen, flags=re.MULTILINE)
    for number in re.findall(r"(?<![\w.,^])\d+(?:\.\d+)?(?![\w]|\.\d)", text):
        if len(number.replace(".", "").lstrip("0")) >= 3:
            assert is_known(number, known), f"{number} is not in numbers.json"


def table_of(name):
    """Return the rows of the first table of a README, and the numbers that the study has kept."""
    folder = ROOT / "examples" / name
    rows = [[cell.strip() for cell in line.strip("|").split("|")]
            for line in (folder / "README.md").read_text().splitlines()
            if line.startswith("|") and "---" not in line]
    return rows[1:], json.loads((folder / "numbers.json").read_text())


def test_tables_hold_the_kept_numbers():
    rows, data = table_of("tabor")
    assert len(rows) == len(data["tabor"])
    for k, row in enumerate(rows):
        columns = ("tabor", "exponential", "maugis_dugdale", "theory")
        assert [float(cell) for cell in row] == [round(data[name][k], 5) for name in columns]
    rows, data = table_of("rough_contact")
    scaled = [load / data["modulus"] / data["rms_slope"] for load in data["load"]]
    for row in rows:
        k = min(range(len(scaled)), key=lambda one, row=row: abs(scaled[one] - float(row[0])))
        assert float(row[0]) == pytest.approx(scaled[k])
        assert [float(cell) for cell in row[1:]] == [
            round(data[name][k], 4) for name in ("area", "persson", "bush_gibson_thomas")]
    rows, data = table_of("speed_jump")
    for head, *cells in rows:
        one = data["slow" if "10 mm/s" in head else "fast"]
        what = "friction" if "friction" in head else "area"
        for cell, name in zip(cells, (what, f"{what}_persson_1", f"{what}_persson_0.45"),
                              strict=True):
            digits = len(cell.split(".")[1])
            assert float(cell) == round(one[name], digits), head
