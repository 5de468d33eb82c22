"""The snippets and commands of the page on measured data are run in their order."""

import os
import re
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from conftest import PATIENCE, ROOT

import asperity

pytest.importorskip("SurfaceTopography")

PAGE = (ROOT / "docs" / "measured_data.md").read_text()


def blocks(language):
    """Return the fenced blocks of a language."""
    return re.findall(rf"```{language}\n(.*?)```", PAGE, flags=re.DOTALL)


def test_from_measurements_to_friction(program, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for folder in (Path(sys.executable).parent, Path(program).parent):
        monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
    make, again = blocks("python")
    lines, case = blocks("fortran")
    to_road, to_rubber, to_run = blocks("sh")
    exec(compile(make, "measured_data.md", "exec"), {})
    printed = ""
    for commands in (to_road, to_rubber, to_run):
        if commands is to_run:
            Path("slide.nml").write_text(case)
        done = subprocess.run(["sh", "-ec", commands], capture_output=True, text=True, check=False,
                              timeout=PATIENCE)
        assert done.returncode == 0, done.stderr
        printed += done.stdout
    assert lines in printed  # the page must show what the command prints
    assert case.endswith(lines)
    assert "'Default': map of heights, 200 x 150 points, unit m" in printed
    assert "filled 286 of 30000 points" in printed
    run = asperity.open("slide.h5")
    assert run.finished
    friction = run.history["friction"][-1]
    assert 0.02 < friction < 0.3  # the loss in the rubber is the only cause
    # Both are the same force over the same load, but only one is divided by the area: round-off.
    assert run.history["friction_viscous"][-1] == pytest.approx(friction, rel=1e-14)
    for picture in ("rubber.png", "slide.png"):
        assert Path(picture).stat().st_size > 20000
    exec(compile(again, "measured_data.md", "exec"), {})
    out = capsys.readouterr().out
    assert float(out.split()[-1]) == pytest.approx(friction, rel=1e-6)
    with h5py.File("slide.h5") as one, h5py.File("again.h5") as other:
        np.testing.assert_array_equal(one["surface/height"][:], other["surface/height"][:])
        np.testing.assert_array_equal(one["material/prony_g"][:], other["material/prony_g"][:])


def test_the_page_names_every_option():
    """The page describes the options of both verbs, and all options that it names exist."""
    from asperity.__main__ import main

    shown = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", PAGE))
    known = set()
    for verb in ("import", "fit"):
        with pytest.raises(SystemExit):
            main([verb, "--nonsense"])
        text = subprocess.run([sys.executable, "-m", "asperity", verb, "--help"], check=True,
                              capture_output=True, text=True).stdout
        known |= set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", text))
    assert shown <= known, shown - known
    assert known - {"--help"} <= shown | {"--output", "--temperature-tolerance", "--poisson"}
