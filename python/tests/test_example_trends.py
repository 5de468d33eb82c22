"""The model compound of the examples."""

import re
import runpy

import numpy as np
import pytest
from conftest import ROOT

EXAMPLES = ROOT / "examples"


@pytest.fixture(scope="module")
def compound():
    return runpy.run_path(str(EXAMPLES / "materials" / "make_sbr.py"))


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
