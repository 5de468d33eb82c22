"""Random cases of the campaign of hard steps that once ended without a solution."""

import sys

import pytest
from conftest import ROOT

sys.path.insert(0, str(ROOT / "tools"))

from coupled_campaign import try_case


# Free patches with adhesion, whose normal solves start from the pass before; a step in which the
# passes swing between states of a few cells; and a jump of the load on slopes above 1/coefficient.
@pytest.mark.parametrize("seed", [774100024, 774100287, 774100437, 774100336])
def test_settles(program, seed):
    done = try_case((seed, program))
    assert done["end"] == "settled", done["message"]
    assert done["rows"] == 16, "one row of pressing, 12 of sliding, 3 of the load"


# Constant shear: without shares in the passes the first two took 1.0e6 and 5.9e5 transforms, and
# ended unsettled.
@pytest.mark.parametrize("seed", [55220100048, 55220100210, 774100291])
def test_constant_shear_settles_at_a_price(program, seed):
    """Steps with partly sheared cells settle, and none is searched for without bound."""
    done = try_case((seed, program))
    assert done["end"] == "settled", done["message"]
    assert done["rows"] == 16
    assert done["ffts"] < 1e5
