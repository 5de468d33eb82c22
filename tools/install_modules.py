#!/usr/bin/env python3
"""Copy the modules of the Fortran library to where `meson install` puts headers.

Meson calls it: install_modules.py FOLDER_OF_THE_MODULES FOLDER_BELOW_THE_PREFIX
"""

import os
import shutil
import sys
from pathlib import Path

source, below = map(Path, sys.argv[1:])
destination = Path(os.environ["MESON_INSTALL_DESTDIR_PREFIX"]) / below
destination.mkdir(parents=True, exist_ok=True)
modules = sorted(source.glob("*.mod"))
if not modules:
    sys.exit(f"install_modules.py: there are no modules in {source}")
for module in modules:
    shutil.copy2(module, destination)
