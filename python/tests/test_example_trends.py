"""The examples show what their texts say: trends of their short forms, and the model compound."""

import re
import runpy
import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT

sys.path.insert(0, str(ROOT / "examples"))

from common import shortened

import asperity
from asperity.theory import bush_gibson_thomas, persson_area

EXAMPLES = ROOT / "examples"


def short_history(name, program, folder):
    """Run the short form of an example and return its history."""
    case = folder / "input.nml"
    shortened(asperity.Case.read(EXAMPLES / name / "input.nml")).write(case)
    result = folder / "result.h5"
    subprocess.run([program, "run", str(case), "--output", str(result), "--quiet"], check=True)
    return asperity.open(result).history


@pytest.fixture(scope="module")
def compound():
    return runpy.run_path(str(EXAMPLES / "materials" / "make_sbr.py"))


def test_friction_jumps_and_decays_where_the_speed_jumps(program, tmp_path):
    history = short_history("speed_jump", program, tmp_path)
    area, friction = history["contact_area"], history["friction"]
    slow, fast = history["phase"] == 2, history["phase"] == 3
    before = friction[slow][-4:].mean()
    after = friction[fast][-8:].mean()
    peak = int(friction[fast].argmax())
    assert peak < 3
    assert friction[fast][peak] > 1.15 * after
    assert after > 3.0 * before > 0.0
    # Contact shrinks when sliding sets in, and again at the jump.
    assert area[0] > area[slow][-1] > 1.5 * area[fast][-1]
    assert history["mean_gap"][fast][-1] > history["mean_gap"][slow][-1]
    # The pressure is held, and what is lost is what friction takes.
    assert np.ptp(history["pressure"]) < 1e-4 * history["pressure"][0]
    assert (np.diff(history["dissipated_viscous"][1:]) > 0.0).all()


def test_contact_area_lies_between_the_theories(program, tmp_path):
    history = short_history("rough_contact", program, tmp_path)
    area, pressure = history["contact_area"], history["pressure"]
    assert (np.diff(area) > 0.0).all()
    assert (np.diff(area / pressure)[-3:] < 0.0).all()
    assert (area > persson_area(pressure, 4e6, 0.2)).all()
    assert (area < bush_gibson_thomas(pressure, 4e6, 0.2)).all()


def test_the_input_holds_the_compound(compound, program):
    rubber = compound["read"](EXAMPLES / "materials" / "sbr.txt")
    text = (EXAMPLES / "speed_jump" / "input.nml").read_text()

    def values(name):
        found = re.search(rf"\b{name} = ([-+\d.e,\s]+)", text)
        return np.array([float(word) for word in found[1].replace(",", " ").split()])

    assert values("shear_modulus") == rubber.g_inf
    assert np.array_equal(values("prony_g"), rubber.g)
    assert np.array_equal(values("prony_tau"), rubber.tau)
    wlf = compound["WLF_SBR"]
    assert (values("wlf_c1"), values("wlf_c2"), values("reference_temperature")) == tuple(wlf)


def test_the_compound_is_what_its_script_makes(compound):
    stored = compound["read"](EXAMPLES / "materials" / "sbr.txt")
    made = compound["compound"]()
    np.testing.assert_allclose(made.g, stored.g, rtol=0.02)  # the fit's last digit may differ
    np.testing.assert_allclose(made.tau, stored.tau, rtol=1e-12)
    omega = np.geomspace(1e0, 1e10, 41)
    exact = compound["master_curve"](omega)
    fitted = stored.complex_modulus(omega)
    np.testing.assert_allclose(fitted.real, exact.real, rtol=0.08)
    np.testing.assert_allclose(fitted.imag, exact.imag, rtol=0.12)
