"""Check that meson.build names every source that fpm finds, and every file of the package."""

import re
import sys
from pathlib import Path

root = Path(__file__).resolve().parent.parent
named = set(re.findall(r"'((?:src|app|python)/[^']+\.(?:f90|F90|py|typed))'",
                       (root / "meson.build").read_text()))
present = {
    path.relative_to(root).as_posix()
    for pattern in ("src/**/*.f90", "src/**/*.F90", "app/*.f90", "python/src/*.f90",
                    "python/asperity/**/*.py", "python/asperity/py.typed")
    for path in root.glob(pattern)
}
faults = [f"meson.build lacks {name}" for name in sorted(present - named)]
faults += [f"meson.build names {name}, which does not exist" for name in sorted(named - present)]
# One module a file, of the same name: that is how readers find it.
for name in sorted(present):
    if name.startswith("src/"):
        modules = re.findall(r"(?mi)^ *module +(?!procedure\b)(\w+) *$", (root / name).read_text())
        if modules != [Path(name).stem]:
            faults.append(f"{name} must hold one module of its own name, not {modules}")
if faults:
    sys.exit("\n".join(faults))
