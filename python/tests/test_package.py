"""The package after its installation."""

import json
import re
import subprocess
import sys
from importlib.metadata import distribution, version

import asperity


def test_versions_agree(program, root):
    written = (root / "VERSION").read_text().strip()
    assert asperity.__version__ == written
    assert version("asperity") == written
    printed = subprocess.run([program, "--version"], capture_output=True, text=True, check=True)
    assert printed.stdout.splitlines()[0] == f"asperity {written}"
    module = subprocess.run([sys.executable, "-m", "asperity", "--version"], capture_output=True,
                            text=True, check=True)
    assert module.stdout.split() == ["asperity", written]


def test_the_version_is_written_once(root):
    written = (root / "VERSION").read_text().strip()
    assert re.fullmatch(r"\d+\.\d+\.\d+", written)
    assert '\nversion = "VERSION"\n' in (root / "fpm.toml").read_text()
    assert "version: files('VERSION')" in (root / "meson.build").read_text()
    assert 'dynamic = ["version"]' in (root / "pyproject.toml").read_text()
    assert f"\nversion: {written}\n" in (root / "CITATION.cff").read_text()
    changes = (root / "CHANGELOG.md").read_text()
    assert "## Unreleased" in changes or f"## {written}" in changes


def test_the_licence_is_a_name_and_a_file():
    """`pip show` prints the name; the text lies beside it."""
    told = distribution("asperity").metadata
    assert told["License-Expression"] == "MIT"
    assert told["License-File"] == "LICENSE"


def test_what_an_installation_holds(root):
    files = {str(path) for path in distribution("asperity").files or []}
    if not any(name.endswith("asperity/results/run.py") for name in files):
        # For an editable installation, the plan of the build lists what a wheel would contain.
        plan = json.loads((root / ".venv" / "python" / "meson-info" / "intro-install_plan.json")
                          .read_text())
        files = {entry["destination"].replace("{bindir}", "bin")
                 for part in plan.values() for entry in part.values()}
    ends = ["bin/asperity", "asperity/__init__.py", "asperity/results/run.py", "asperity/py.typed",
            "asperity/theory/__init__.py", "asperity/views/page/report.html",
            "asperity/views/page/page.js"]
    for end in ends:
        assert any(name.endswith(end) for name in files), end
    assert any("asperity/_core." in name for name in files)


def test_headers_of_our_numpy_come_before_those_of_the_system(root, tmp_path):
    """Debian keeps the headers of its own NumPy in the folder of Python's headers.

    With those the extension was compiled for another NumPy than it ran with, and its import failed.
    """
    subprocess.run(["meson", "setup", str(tmp_path), "-Dpython=true", "-Dapp=false",
                    "-Dlibrary=false"], cwd=root, check=True, capture_output=True)
    commands = json.loads((tmp_path / "compile_commands.json").read_text())
    words = next(one["command"] for one in commands if one["file"].endswith("fortranobject.c"))
    folders = [word[2:] for word in words.split() if word.startswith("-I")]
    of_numpy = next(k for k, name in enumerate(folders) if name.endswith("numpy/_core/include"))
    of_python = next(k for k, name in enumerate(folders) if re.search(r"python3\.\d+$", name))
    assert of_numpy < of_python


def test_public_names_are_documented():
    for name in asperity.__all__:
        thing = getattr(asperity, name)
        assert name == "__version__" or (thing.__doc__ or "").strip(), name
    for module in (asperity.surface, asperity.theory, asperity.material):
        for name in module.__all__:
            assert (getattr(module, name).__doc__ or "").strip(), name


def test_import_does_not_open_windows_or_load_pandas():
    done = subprocess.run(
        [sys.executable, "-c", "import sys, asperity; print('pandas' in sys.modules,"
         " 'matplotlib.pyplot' in sys.modules)"], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]
