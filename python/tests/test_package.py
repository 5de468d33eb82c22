"""The package as it is installed."""

import subprocess
from importlib.metadata import version

import asperity


def test_versions_agree(program, root):
    written = (root / "VERSION").read_text().strip()
    assert asperity.__version__ == written
    assert version("asperity") == written
    printed = subprocess.run([program, "--version"], capture_output=True, text=True, check=True)
    assert printed.stdout.split() == ["asperity", written]
