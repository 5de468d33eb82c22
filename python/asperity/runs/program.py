"""The program `asperity` that belongs to this package."""

from __future__ import annotations

import functools
import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

from asperity import _core

from ..base.library import version

__all__ = ["program"]


@functools.cache
def program() -> str:
    """Return the path of the program of this package's version.

    It is beside the compiled library of an editable installation, or among the scripts of the
    environment. The environment variable ``ASPERITY_PROGRAM`` selects another one.

    Returns
    -------
    str
        Absolute path.

    Raises
    ------
    OSError
        If it is not found.
    """
    named = os.environ.get("ASPERITY_PROGRAM")
    if named:
        return str(Path(named).absolute())
    own = version()
    folders = [Path(_core.__file__).parent, Path(sysconfig.get_path("scripts")),
               Path(sys.executable).parent]
    found = [str(folder / "asperity") for folder in folders] + [shutil.which("asperity")]
    tried = []
    for candidate in found:
        if candidate is None or not Path(candidate).is_file():
            continue
        done = subprocess.run([candidate, "--version"], capture_output=True, text=True, check=False)
        if done.stdout.split()[1:2] == [own]:
            return str(Path(candidate).absolute())
        tried.append(f"{candidate} is {''.join(done.stdout.splitlines()[:1]) or 'no such program'}")
    raise FileNotFoundError(
        f"the program asperity {own} is not found{': ' if tried else ''}{', '.join(tried)}:"
        " install the package with its program, `python -m pip install .`, or name it in the"
        " environment variable ASPERITY_PROGRAM")
