"""Iterations and transforms of small cases against the table of tools/bench."""

import sys

import pytest
from conftest import ROOT

sys.path.insert(0, str(ROOT / "tools" / "bench"))

import counts


def test_the_table_has_all_cases():
    assert list(counts.stored()) == list(counts.CASES)


@pytest.mark.parametrize("case", counts.CASES)
def test_each_case_takes_the_counts_of_the_table(program, case):
    found, expected = counts.count(counts.CASES[case], program), counts.stored()[case]
    changed = {key: (found[key], expected[key]) for key in found
               if not counts.agrees(found[key], expected[key])}
    assert not changed, f"{changed}: if that is meant, run tools/bench/counts.py --update"


def test_the_band_is_narrow():
    assert counts.agrees(22, 20)
    assert counts.agrees(0, 2)
    assert not counts.agrees(25, 20)
    assert not counts.agrees(15, 20)
