"""The examples of adhesion show what their texts say, in their short forms."""

import re
import runpy
import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT

import asperity

EXAMPLES = ROOT / "examples"


@pytest.mark.parametrize(("folder", "script"), [("adhesive_sphere", "loop.py")])
def test_script_draws(folder, script, tmp_path):
    picture = tmp_path / "picture.png"
    subprocess.run([sys.executable, str(EXAMPLES / folder / script), "--quick", "-o", str(picture)],
                   check=True, capture_output=True)
    assert picture.stat().st_size > 10000


@pytest.mark.parametrize("folder", ["adhesive_sphere", "adhesive_rough"])
def test_text_names_its_picture(folder):
    text = (EXAMPLES / folder / "README.md").read_text()
    for picture in re.findall(r"!\[.+?\]\((.+?)\)", text):
        assert (EXAMPLES / folder / picture).is_file()


def test_energy_is_lost_twice():
    histories = runpy.run_path(str(EXAMPLES / "adhesive_sphere" / "loop.py"))["loops"](quick=True)
    adhesive, bare = histories["with adhesion"], histories["without"]
    assert adhesive["dissipated_viscous"][-1] > 1.3 * bare["dissipated_viscous"][-1] > 0
    assert adhesive["force"].min() < -2 * 1.5 * np.pi * 0.05 * 1e-4
    assert bare["force"].min() > -1e-9
    assert adhesive["contact_area"][-1] == bare["contact_area"][-1] == 0
    for history in (adhesive, bare):
        # what the load did is stored or lost
        left = history["energy_elastic"][-1] + history["energy_adhesive"][-1]
        assert history["work_load"][-1] - left == pytest.approx(
            history["dissipated_viscous"][-1], rel=0.05)


def test_rough_contact_has_hysteresis(program, tmp_path):
    case, result = tmp_path / "input.nml", tmp_path / "result.h5"
    # a sixteenth of the area, on the same cells
    text = (EXAMPLES / "adhesive_rough" / "input.nml").read_text()
    text = re.sub(r"n([xy]) = 512", r"n\1 = 128", text)
    text = text.replace("wavelength_long = 0.192e-6", "wavelength_long = 0.096e-6")
    text = text.replace("lx = 0.768e-6", "lx = 0.192e-6")
    case.write_text(text)
    subprocess.run([program, "run", str(case), "--output", str(result), "--quiet"], check=True)
    run = asperity.open(result)
    area, gap = run.history["contact_area"], run.history["mean_gap"]
    assert (np.diff(area[:6]) > 0).all()
    assert (np.diff(area[5:]) < 0).all()
    assert (area[6:] > area[4::-1]).all()
    assert (gap[6:] < gap[4::-1]).all()
    picture = tmp_path / "picture.png"
    subprocess.run([sys.executable, str(EXAMPLES / "adhesive_rough" / "picture.py"), str(result),
                    "-o", str(picture)], check=True, capture_output=True)
    assert picture.stat().st_size > 10000
