"""The parts of docs/benchmarks.md that scripts write; the rest of the page is written by hand."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "benchmarks.md"


def write_part(name: str, lines: list[str]) -> None:
    """Replace the lines between `<!-- NAME: begin -->` and `<!-- NAME: end -->` on the page.

    Raises
    ------
    ValueError
        The page does not have these marks.
    """
    start, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    before, found, rest = PAGE.read_text().partition(start)
    _, closed, after = rest.partition(end)
    if not (found and closed):
        raise ValueError(f"{PAGE} has no part between {start} and {end}")
    PAGE.write_text("\n".join([before + start, "", *lines, "", end]) + after)
