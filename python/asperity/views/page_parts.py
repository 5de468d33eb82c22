"""Parts that all pages share: the files of a page, its data as JSON, and its colours."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

__all__ = ["PAGE", "colour_scales", "fill_page", "page_file", "page_json"]

PAGE = Path(__file__).with_name("page")


def fill_page(parts: Mapping[str, str]) -> str:
    """Return the page with its parts filled in.

    One pass fills in all parts, so that text inside a part is never taken for a placeholder.
    """
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], page_file("report.html"))


def page_file(name: str) -> str:
    """Return a file of the page."""
    return (PAGE / name).read_text(encoding="utf-8").rstrip("\n")


def page_json(data: dict[str, Any]) -> str:
    """Return data as JSON without `<`, which could end the surrounding script element."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")


def colour_scales() -> dict[str, list[str]]:
    """Return the colour scales, 33 colours each."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    names = {"pressure": "viridis", "gap": "cividis", "both": "RdBu_r"}
    return {key: [to_hex(colormaps[name](part)) for part in np.linspace(0, 1, 33)]
            for key, name in names.items()}
