"""The scripts of tools/bench write their parts of docs/benchmarks.md, and nothing else of it."""

import sys

import numpy as np
import pytest
from conftest import ROOT

sys.path.insert(0, str(ROOT / "tools" / "bench"))
sys.path.insert(0, str(ROOT / "tools" / "bench" / "peers"))

import benchmark_page
import search


def test_the_page_has_a_part_for_each_script():
    text = benchmark_page.PAGE.read_text()
    for script in (ROOT / "tools" / "bench").glob("*.py"):
        for name in ("normal", "adhesion", "peers"):
            if f'write_part("{name}"' in script.read_text():
                assert text.count(f"<!-- {name}: begin -->") == 1
                assert text.count(f"<!-- {name}: end -->") == 1


def test_a_part_is_replaced_and_the_rest_stays(tmp_path, monkeypatch):
    page = tmp_path / "page.md"
    page.write_text("first\n\n<!-- a: begin -->\n\nold\n\n<!-- a: end -->\n\nlast\n")
    monkeypatch.setattr(benchmark_page, "PAGE", page)
    for _ in range(2):
        benchmark_page.write_part("a", ["new", "rows"])
    assert page.read_text() == ("first\n\n<!-- a: begin -->\n\nnew\nrows\n\n<!-- a: end -->"
                                "\n\nlast\n")
    with pytest.raises(ValueError, match="b: begin"):
        benchmark_page.write_part("b", ["new"])


def test_codes_are_compared_at_the_duality_gap_of_their_answer():
    # Full contact on cos(2 pi x): the pressure is the load plus pi cos(2 pi x) for E* = 1 Pa.
    n, load, part = 32, 4.0, 0.9
    x = (np.arange(n) + 0.5) / n
    height = np.cos(2 * np.pi * x)[:, None] * np.ones(n)
    exact = load + np.pi * height
    assert search.duality_gap(height, exact) == pytest.approx(0.0, abs=1e-14)

    # With a part of the wave only, g - min g = (1 - part)(max h - h).
    wrong = load + part * np.pi * height
    gap = (1 - part) * (height.max() - height)
    expected = (wrong * gap).sum() / (wrong.sum() * height.std())
    assert search.duality_gap(height, wrong) == pytest.approx(expected, rel=1e-10)
