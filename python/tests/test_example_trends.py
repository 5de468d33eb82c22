"""The inputs of the examples contain the model compounds."""

import re
import runpy

import numpy as np
import pytest
from conftest import ROOT

import asperity

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


def test_the_two_scale_road_holds_the_tread(compound):
    rubber = compound["read"](EXAMPLES / "materials" / "tread.txt")
    material = asperity.Case.read(EXAMPLES / "two_scale_road" / "input.nml").material
    slow = rubber.tau > 0.2
    kept = ~slow & (rubber.tau > 0.5e-10)
    assert kept.sum() == 10
    assert material.shear_modulus == pytest.approx(rubber.g_inf + rubber.g[slow].sum(), rel=1e-12)
    assert np.array_equal(material.prony_g, rubber.g[kept])
    assert np.array_equal(material.prony_tau, rubber.tau[kept])
    # The relaxation times that the ten arms leave out do not matter at the frequencies of the case,
    # which lie between that of its length and that at which the drive crosses a cell.
    ten = asperity.material.Prony(material.shear_modulus, material.prony_g, material.prony_tau)
    omega = 2 * np.pi * np.geomspace(1 / 2e-3, 1e6, 31)
    np.testing.assert_allclose(ten.complex_modulus(omega), rubber.complex_modulus(omega), rtol=2e-3)
    modulus = rubber.complex_modulus(2 * np.pi * np.array([1e3, 32e3])).real
    np.testing.assert_allclose(modulus, [6.0e6, 10.9e6], rtol=0.015)
