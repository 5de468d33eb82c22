"""Check that meson.build names every source that fpm finds, and every file of the package.

Neither build notices a change of a file that a source includes. The line of the include therefore
contains a checksum of that file, and changes with it.

A module has the name of its file, and no description begins in a way that FORD misreads.

With --update, the lists of meson.build and the checksums are corrected.
"""

import hashlib
import re
import sys
from pathlib import Path

root = Path(__file__).resolve().parent.parent
build = root / "meson.build"


def present(*patterns: str) -> list[str]:
    """Return the files that match, as paths from the root, sorted."""
    files = {path for pattern in patterns for path in root.glob(pattern)}
    return sorted(path.relative_to(root).as_posix() for path in files)


lists = {
    "sources = files": present("src/**/*.f90", "src/**/*.F90"),
    "program = files": present("app/*.f90"),
    "flat = files": present("python/src/*.f90"),
}
# The Python package: one list for each of its folders, that of the place where they are installed.
kinds = ("py", "pyi", "typed", "js", "css", "html")
folders = {path.parent for kind in kinds for path in root.glob(f"python/asperity/**/*.{kind}")}
for folder in sorted(folders):
    name = folder.relative_to(root / "python").as_posix()
    lists[f"'{name}': files"] = present(*(f"python/{name}/*.{kind}" for kind in kinds))
text = build.read_text()
faults = []
for head, names in lists.items():
    found = re.search(rf"( *){head}\((.*?)\)", text, flags=re.DOTALL)
    if not found:
        sys.exit(f"meson.build has no list {head}(...): write an empty one, then --update fills it")
    named = re.findall(r"'([^']+)'", found[2])
    faults += [f"meson.build lacks {name}" for name in names if name not in named]
    faults += [f"meson.build names {name}, which does not exist" for name in named
               if name not in names]
    lines = "".join(f"{found[1]}  '{name}',\n" for name in names)
    text = text.replace(found[0], f"{found[1]}{head}(\n{lines}{found[1]})")
if "--update" in sys.argv[1:]:
    build.write_text(text)
    faults = []

# Each file has one module of the same name, so that readers find it.
for name in lists["sources = files"]:
    modules = re.findall(r"(?mi)^ *module +(?!procedure\b)(\w+) *$", (root / name).read_text())
    if modules != [Path(name).stem]:
        faults.append(f"{name} must hold one module of its own name, not {modules}")

for name in lists["sources = files"]:
    path = root / name
    source = path.read_text()
    for line, included in re.findall(r"(?m)^( *include '(\S+)'.*)$", source):
        state = hashlib.sha256((path.parent / included).read_bytes()).hexdigest()[:8]
        if f"! state {state}," in line:
            continue
        if "--update" in sys.argv[1:]:
            path.write_text(source.replace(line, re.sub(r"(?<=! state )\w+", state, line)))
        else:
            faults.append(f"{name} holds an old state of {included}, now {state}")
if faults:
    sys.exit("\n".join([*faults, "python tools/check_sources.py --update corrects it"]))

# FORD takes a first word with a colon for the name of an entry of its own, and leaves out the rest.
opening = re.compile(r"(?m)^(?! *!>).*\n *!> *(\w+:(?: .*)?)$")
faults = [f"{name}: a description must not begin with a word and a colon: {line}"
          for name in lists["sources = files"]
          for line in opening.findall((root / name).read_text())]
if faults:
    sys.exit("\n".join(faults))
