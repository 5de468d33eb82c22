"""Fixtures of the Python tests."""

import os
import shutil
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def root() -> Path:
    """Return the root of the source tree."""
    return ROOT


@pytest.fixture(scope="session")
def program() -> str:
    """Return the path of the built program.

    ``ASPERITY_PROGRAM`` names another one; otherwise it is the one that belongs to the package:
    built beside an editable installation or installed with the wheel.
    """
    candidates = [
        os.environ.get("ASPERITY_PROGRAM"),
        ROOT / ".venv" / "python" / "asperity",
        Path(sys.executable).parent / "asperity",
        shutil.which("asperity"),
    ]
    for candidate in candidates:
        if candidate and Path(candidate).is_file():
            return str(candidate)
    pytest.fail("the program is not built: run ./test.sh")
