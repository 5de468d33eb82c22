"""Each example runs, in a short form: on a coarse grid, with few steps."""

import re
import subprocess

import pytest
from conftest import ROOT

import asperity
from asperity.__main__ import main

CASES = sorted((ROOT / "examples").glob("*/input.nml"))


def shorten(text):
    """Return an input with at most 64 cells a side, cut-offs that they hold, and few steps."""
    grid = re.search(r"(?is)&grid(.*?)^ */|&grid(.*?)/", text)[0]
    nx = int(re.search(r"(?i)\bnx *= *(\d+)", grid)[1])
    factor = max(1, nx // 64)
    text = re.sub(r"(?i)\b(n[xy]) *= *(\d+)",
                  lambda found: f"{found[1]} = {max(1, int(found[2]) // factor)}", text)
    text = re.sub(r"(?i)\b(wavelength_short) *= *([\d.e+-]+)",
                  lambda found: f"{found[1]} = {float(found[2]) * factor:g}", text)
    return re.sub(r"(?i)\bsteps *= *(\d+)", lambda found: f"steps = {min(int(found[1]), 20)}", text)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.parent.name)
def test_example(case, program, tmp_path):
    # As it is, it must be a right input; it is run in the short form.
    subprocess.run([program, "check", str(case)], check=True, capture_output=True)
    short = tmp_path / "input.nml"
    short.write_text(shorten(case.read_text()))
    result = tmp_path / "result.h5"
    subprocess.run([program, "run", str(short), "--output", str(result), "--quiet"], check=True)
    run = asperity.open(result)
    assert run.finished
    assert (run.history["residual_normal"] < 1e-5).all()
    assert (run.history["contact_area"] > 0).any()
    assert main(["plot", str(result)]) == 0
    assert result.with_suffix(".png").stat().st_size > 10000


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.parent.name)
def test_example_is_explained(case):
    pictures = re.findall(r"!\[.+?\]\((.+?)\)", (case.parent / "README.md").read_text())
    assert pictures
    for picture in pictures:
        assert (case.parent / picture).is_file()
