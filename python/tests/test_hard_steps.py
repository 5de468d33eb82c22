"""Random cases of the campaign of hard steps which an earlier version could not solve."""

import sys

import pytest
from conftest import ROOT

sys.path.insert(0, str(ROOT / "tools"))

from coupled_campaign import try_case


# Free patches with adhesion, whose normal solves start from the pass before; a step in which the
# passes alternate between states of a few cells; and a jump of the load where slopes exceed
# 1/coefficient.
@pytest.mark.parametrize("seed", [774100024, 774100287, 774100437, 774100336])
def test_settles(program, seed):
    done = try_case((seed, program))
    assert done["end"] == "settled", done["message"]
    assert done["rows"] == 16, "one row of pressing, 12 of sliding, 3 of the load"


# Constant shear. Before the passes had shares for cells at the edge, the first two cases took 1.0e6
# and 5.9e5 transforms, and did not settle.
@pytest.mark.parametrize("seed", [55220100048, 55220100210, 774100291])
def test_constant_shear_settles_within_a_bound_of_work(program, seed):
    """Steps with partly sheared cells settle, and the number of transforms is bounded."""
    done = try_case((seed, program))
    assert done["end"] == "settled", done["message"]
    assert done["rows"] == 16
    assert done["ffts"] < 1e5
