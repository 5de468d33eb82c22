"""Add the licences of the shared libraries that a repaired wheel carries.

    python tools/add_licences.py NAME.whl

The texts are those that tools/build_libraries.sh left for the libraries it built (in the folder
that the variable ASPERITY_LIBRARIES names), or else of the packages of Debian or of a system with
RPM that the libraries come from. A library without a text is an error.
"""

import os
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
whole. The sources of all libraries are those of the packages named, or what their projects
publish under the version named.

"""


GCC = ("gcc-runtime", "gcc-runtime")
BUILT = {"libhdf5": ("hdf5", "hdf5"), "libfftw3": ("fftw3", "fftw3"), "libgfortran": GCC,
         "libgomp": GCC, "libquadmath": GCC}  # licence, pkg-config


def output_of(*words):
    """Return the output of a command, or None if it fails or does not exist."""
    try:
        done = subprocess.run(words, capture_output=True, text=True)
    except FileNotFoundError:
        return None
    return done.stdout if done.returncode == 0 else None


def package_of(library):
    """Return name, version and licence texts of a library that auditwheel has renamed."""
    original = re.sub(r"-[0-9a-f]{8}(?=\.)", "", library)
    prefix = Path(os.environ.get("ASPERITY_LIBRARIES") or "/nowhere")
    if (prefix / "lib" / original).exists():
        name, module = next(value for start, value in BUILT.items() if original.startswith(start))
        text = (prefix / "lib" / "pkgconfig" / f"{module}.pc").read_text()
        version = re.search(r"(?m)^Version: *(\S+)", text)[1]
        return name, version, sorted((prefix / "share" / "licenses" / name).iterdir())
    owners = output_of("dpkg", "-S", f"*/{original}")
    if owners:
        name = owners.split(":")[0]
        version = output_of("dpkg-query", "-W", "-f", "${Version}\n", name).split()[0]
        return name, version, [Path("/usr/share/doc") / name / "copyright"]
    for folder in ("/usr/lib64", "/lib64"):
        owner = output_of("rpm", "-qf", "--qf", "%{NAME} %{VERSION}-%{RELEASE}\n",
                          f"{folder}/{original}")
        if owner:
            name, version = owner.split()[:2]
            # The libraries of GCC are under the licence that its package libgcc has.
            texts = [text for place in (name, "libgcc") for text in sorted(
                (Path("/usr/share/licenses") / place).glob("COPYING*"))]
            return name, version, texts
    return sys.exit(f"{library}: no package holds {original}")


def main():
    """Rewrite the wheel named on the command line with the texts in it."""
    path = Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, "-m", "wheel", "unpack", "-d", folder, str(path)],
                       check=True, stdout=subprocess.DEVNULL)
        (wheel,) = Path(folder).iterdir()
        (info,) = wheel.glob("*.dist-info")
        libraries = sorted(library.name for library in wheel.glob("*.libs/*"))
        found = {}
        licences = info / "licenses"
        licences.mkdir(exist_ok=True)
        for library in libraries:
            name, found_version, texts = package_of(library)
            texts = [text for text in texts if text.is_file()]
            if not texts:
                sys.exit(f"{path.name}: no licence of {name}, which holds {library}")
            found[name] = found_version
            (licences / f"{name}.txt").write_bytes(b"\n".join(map(Path.read_bytes, texts)))
        (licences / "BUNDLED.txt").write_text(
            NOTE + "Libraries: " + ", ".join(libraries) + "\n\nPackages:\n"
            + "".join(f"  {name} {version}\n" for name, version in sorted(found.items())))
        subprocess.run([sys.executable, "-m", "wheel", "pack", "-d", str(path.parent), str(wheel)],
                       check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    main()
