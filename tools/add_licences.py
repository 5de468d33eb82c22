"""Add the licences of the shared libraries that a repaired wheel carries.

    python tools/add_licences.py NAME.whl

The texts are those of the Debian packages that the libraries come from. A library without a text is
an error.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

NOTE = """\
Licences of the binary wheel
============================

The sources of Asperity are under the MIT licence. This wheel carries the shared libraries named
below, each under its own licence; the texts are beside this file. FFTW 3 is under the GNU General
Public License, version 2 or later: whoever passes the wheel on must keep to that licence for the
whole. The sources of all libraries are those of the Debian packages named.

"""


def package_of(library):
    """Return the Debian package and version of a library, named as auditwheel renames it."""
    original = re.sub(r"-[0-9a-f]{8}(?=\.)", "", library)
    owners = subprocess.run(["dpkg", "-S", f"*/{original}"], capture_output=True, text=True)
    if owners.returncode:
        sys.exit(f"{library}: no Debian package holds {original}")
    name = owners.stdout.split(":")[0]
    version = subprocess.run(["dpkg-query", "-W", "-f", "${Version}\n", name], check=True,
                             capture_output=True, text=True).stdout.split()[0]
    return name, version


def main():
    """Rewrite the wheel named on the command line with the texts in it."""
    path = Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, "-m", "wheel", "unpack", "-d", folder, str(path)],
                       check=True, stdout=subprocess.DEVNULL)
        (wheel,) = Path(folder).iterdir()
        (info,) = wheel.glob("*.dist-info")
        libraries = sorted(library.name for library in wheel.glob("*.libs/*"))
        found = dict(package_of(library) for library in libraries)
        licences = info / "licenses"
        licences.mkdir(exist_ok=True)
        for name in found:
            text = Path("/usr/share/doc") / name / "copyright"
            if not text.is_file():
                sys.exit(f"{path.name}: no licence of {name} in {text.parent}")
            (licences / f"{name}.txt").write_bytes(text.read_bytes())
        (licences / "BUNDLED.txt").write_text(
            NOTE + "Libraries: " + ", ".join(libraries) + "\n\nPackages:\n"
            + "".join(f"  {name} {version}\n" for name, version in sorted(found.items())))
        subprocess.run([sys.executable, "-m", "wheel", "pack", "-d", str(path.parent), str(wheel)],
                       check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    main()
