"""The source archive and the wheel, built and installed in an empty environment.

    python -m pytest -m slow python/tests/test_wheel.py

The build takes minutes: `.ci/run` runs these tests, `./test.sh` does not. They examine the wheel of
`tools/make_wheel.sh`, or that of `tools/make_portable_wheel.sh` if ASPERITY_PORTABLE_WHEEL is set.
"""

import os
import re
import subprocess
import sys
import tarfile
import venv
import zipfile

import pytest
from conftest import ROOT

pytestmark = pytest.mark.slow

VERSION = (ROOT / "VERSION").read_text().strip()
PORTABLE = bool(os.environ.get("ASPERITY_PORTABLE_WHEEL"))
FROM_OTHERS = re.compile("_?Py|inflate|deflate|compress|crc32|adler32|zlib")  # Python and zlib
NETWORK = re.compile(r"lib(curl|krb5|gssapi|ldap|crypto|ssl|sz|aec)")
OURS = re.compile(r"lib(fftw3f?|hdf5\w*|gfortran|gomp|quadmath|sz|aec)[-.]")


@pytest.fixture(scope="module")
def built():
    """Build the archive and the wheel; return their folder."""
    if not (ROOT / ".git").exists():
        pytest.skip("the archive is made from a git repository")
    script = "make_portable_wheel.sh" if PORTABLE else "make_wheel.sh"
    done = subprocess.run(["sh", f"tools/{script}"], cwd=ROOT, capture_output=True, text=True,
                          check=False)
    assert done.returncode == 0, (done.stdout + done.stderr)[-5000:]
    return ROOT / "build" / "dist"


@pytest.fixture(scope="module")
def empty(built, tmp_path_factory):
    """Return an environment with nothing but the wheel and what it requires."""
    folder = tmp_path_factory.mktemp("wheel") / "environment"
    venv.create(folder, with_pip=True)
    (wheel,) = built.glob("*.whl")
    subprocess.run([folder / "bin" / "python", "-m", "pip", "install", "-q",
                    "--disable-pip-version-check", str(wheel)], check=True)
    return folder


def run(empty, *words, cwd):
    """Run a command of the empty environment, which knows nothing of the test's environment."""
    command = [str(empty / "bin" / words[0]), *words[1:]]
    surroundings = {"PATH": f"{empty / 'bin'}:/usr/bin:/bin", "HOME": str(cwd),
                    "MPLBACKEND": "Agg"}
    done = subprocess.run(command, cwd=cwd, env=surroundings, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_archive_holds_the_sources_and_nothing_else(built):
    (archive,) = built.glob("*.tar.gz")
    assert archive.name == f"asperity-{VERSION}.tar.gz"
    with tarfile.open(archive) as tar:
        names = {member.name.split("/", 1)[1] for member in tar.getmembers() if member.isfile()}
    tracked = set(subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True,
                                 text=True).stdout.split("\n")) - {""}
    assert names - {"PKG-INFO"} == tracked
    assert {"LICENSE", "README.md", "CITATION.cff", "VERSION", "PKG-INFO"} <= names


def test_the_wheel_holds_the_package_the_program_and_the_licences(built):
    (wheel,) = built.glob("*.whl")
    assert "manylinux" in wheel.name
    with zipfile.ZipFile(wheel) as file:
        names = set(file.namelist())
        (note,) = (name for name in names if name.endswith("licenses/BUNDLED.txt"))
        bundled = file.read(note).decode()
        plain = " ".join(bundled.split())
        metadata = file.read(f"asperity-{VERSION}.dist-info/METADATA").decode()
    package = ROOT / "python" / "asperity"
    sources = {f"asperity/{path.relative_to(package)}" for path in package.rglob("*")
               if path.is_file() and path.suffix not in (".pyc", ".so")}
    inside = {name for name in names if name.startswith("asperity/") and not name.endswith(("/",
              ".so"))}
    assert inside == sources
    assert f"asperity-{VERSION}.data/scripts/asperity" in names
    assert any(re.match(r"asperity/_core\..*\.so$", name) for name in names)
    libraries = {name.split("/")[1] for name in names
                 if name.startswith("asperity.libs/") and not name.endswith("/")}
    for start in ("libfftw3-", "libfftw3f-", "libhdf5", "libgfortran-"):
        assert any(library.startswith(start) for library in libraries), start
    for library in libraries:
        assert library in bundled
    assert "General Public License" in plain
    for package in re.findall(r"^  (\S+) \S+$", bundled, flags=re.MULTILINE):
        assert any(name.endswith(f"licenses/{package}.txt") for name in names), package
    assert any(re.search(r"dist-info/(licenses/)?LICENSE$", name) for name in names)
    assert not any("test" in name for name in names)
    assert "Contact of a viscoelastic solid" in metadata and "# Asperity" in metadata


def symbols(path, which):
    """Return the dynamic symbols of a shared object as triples of kind, name and version."""
    lines = subprocess.run(["nm", "-D", which, str(path)], check=True, capture_output=True,
                           text=True).stdout.splitlines()
    words = [line.split()[-2:] for line in lines]
    return [(kind, *re.split("@+", name + "@")[:2]) for kind, name in words]


@pytest.mark.skipif(not PORTABLE, reason="an ordinary wheel asks for the C library of its system")
def test_a_portable_wheel_asks_for_an_old_c_library_only(built, tmp_path):
    """The newest symbols are those of the tag, and nothing depends on libraries for the network."""
    (wheel,) = built.glob("*.whl")
    assert "manylinux_2_28_x86_64" in wheel.name
    with zipfile.ZipFile(wheel) as file:
        file.extractall(tmp_path)
    binaries = [path for path in tmp_path.rglob("*")
                if path.is_file() and path.read_bytes()[:4] == b"\x7fELF"]
    assert len(binaries) == 8  # the program, the extension and six libraries
    assert not [path.name for path in binaries if NETWORK.match(path.name)]
    offered = {name for path in binaries for _, name, _ in symbols(path, "--defined-only")}
    for path in binaries:
        needed = symbols(path, "--undefined-only")
        versions = {tuple(map(int, version[6:].split("."))) for _, _, version in needed
                    if re.match(r"GLIBC_\d", version)}
        assert versions and max(versions)[:2] <= (2, 28), (path.name, max(versions))
        # What the old C library lacks has no version. Python and zlib do not number their symbols.
        lacking = {name for kind, name, version in needed if kind == "U" and not version}
        assert not {name for name in lacking - offered if not FROM_OTHERS.match(name)}, path.name


def test_libraries_come_from_inside_the_wheel(empty):
    (core,) = empty.glob("lib/python*/site-packages/asperity/_core*.so")
    program = core.parents[1] / "asperity.scripts" / "asperity"
    surroundings = {name: value for name, value in os.environ.items() if name != "LD_LIBRARY_PATH"}
    for binary in (core, program):
        lines = subprocess.run(["ldd", str(binary)], check=True, capture_output=True, text=True,
                               env=surroundings).stdout.splitlines()
        assert not [line for line in lines if "not found" in line]
        found = [line.split() for line in lines if OURS.match(line.strip())]
        assert len(found) >= 5
        for words in found:
            assert str(core.parents[1] / "asperity.libs") in words[2].replace(
                "asperity/../", "").replace("asperity.scripts/../", ""), words


def test_versions_agree(empty, tmp_path):
    about = run(empty, "asperity", "--version", cwd=tmp_path)
    assert about.split()[:2] == ["asperity", VERSION]
    assert "AVX2" not in about      # the wheel is for all processors
    shown = run(empty, "python", "-c", "import asperity; print(asperity.__version__)", cwd=tmp_path)
    assert shown.strip() == VERSION


def test_a_case_and_its_picture(empty, tmp_path):
    text = run(empty, "asperity", "template", "hertz", cwd=tmp_path)
    (tmp_path / "hertz.nml").write_text(text)
    run(empty, "asperity", "run", "hertz.nml", "--quiet", cwd=tmp_path)
    run(empty, "python", "-m", "asperity", "plot", "hertz.h5", cwd=tmp_path)
    assert (tmp_path / "hertz.png").stat().st_size > 10000
    shown = run(empty, "python", "-c", "import asperity; run = asperity.run('hertz.nml');"
               " print(run.history['displacement'][-1], asperity.__file__)", cwd=tmp_path)
    approach, path = shown.split()
    assert float(approach) == pytest.approx(1e-4, rel=1e-3)
    assert str(empty) in path and sys.prefix not in path
