"""Files that are damaged, forged or changed meanwhile cause an error message, never a crash."""

from __future__ import annotations

import random
import subprocess
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest
import viscoelastic_case as vc

import asperity

ELASTIC = """
&grid nx = 12, ny = 16, lx = 1 /
&surface shape = 'file', file = 'map.h5' /
&material shear_modulus = 1e6 /
&phase pressure = 1e3 /
"""


@pytest.fixture
def case(tmp_path: Path) -> Path:
    """Return the input of a static contact whose map is in a file that does not exist yet."""
    path = tmp_path / "y.nml"
    path.write_text(ELASTIC)
    return path


def call(program: str, *words: str | Path) -> subprocess.CompletedProcess[str]:
    """Run the program."""
    return subprocess.run([program, *map(str, words)], capture_output=True, text=True,
                          errors="replace", timeout=120, check=False)


def test_declared_size_beyond_32_bits(program: str, case: Path, tmp_path: Path) -> None:
    """A map is refused although its declared size modulo 2^32 is that of the grid."""
    for shape in ((16, 2**32 + 12), (2**32 + 16, 12), (2**32 + 16, 2**32 + 12)):
        with h5py.File(tmp_path / "map.h5", "w") as file:
            file.create_dataset("surface/height", shape, dtype="f8", chunks=(16, 12))
        for verb in ("check", "run"):
            done = call(program, verb, case)
            assert done.returncode == 2, done.stderr
            assert f"{max(shape)} values along one side" in done.stderr


def test_virtual_map_without_its_source(program: str, case: Path, tmp_path: Path) -> None:
    """A virtual dataset without its source reads as zeros; it must not be taken for a flat road."""
    heights = np.random.default_rng(2).standard_normal((16, 12)) * 1e-4
    (tmp_path / "part").mkdir()

    def write_source(name: str, dataset: str = "heights") -> None:
        with h5py.File(tmp_path / "part" / name, "w") as file:
            file[dataset] = heights[:8]

    def write_map(rows: int) -> None:
        layout = h5py.VirtualLayout((16, 12), "f8")
        for k, name in enumerate(("a.h5", "b.h5")):
            layout[8 * k:8 * k + rows] = h5py.VirtualSource(
                f"part/{name}", "heights", (8, 12))[:rows]
        with h5py.File(tmp_path / "map.h5", "w") as file:
            file.create_virtual_dataset("surface/height", layout)

    write_map(8)
    for name in ("a.h5", "b.h5"):
        write_source(name)
    done = call(program, "run", case)
    assert done.returncode == 0, done.stderr
    np.testing.assert_array_equal(asperity.open(tmp_path / "y.h5").height[8:], heights[:8])
    write_source("b.h5", "other")
    done = call(program, "run", case)
    assert done.returncode == 3 and 'has no dataset "heights"' in done.stderr, done.stderr
    (tmp_path / "part" / "b.h5").unlink()
    done = call(program, "run", case)
    assert done.returncode == 3 and 'its source "part/b.h5" cannot be opened' in done.stderr
    write_source("b.h5")
    write_map(7)
    done = call(program, "run", case)
    assert done.returncode == 3 and "parts of it have no source" in done.stderr, done.stderr


def test_dangling_links_are_named(program: str, case: Path, tmp_path: Path) -> None:
    """The list of what a file contains has whole names, also where a link leads nowhere."""
    with h5py.File(tmp_path / "map.h5", "w") as file:
        file["group/gone"] = h5py.SoftLink("/nowhere")
        file["group/far"] = h5py.ExternalLink("missing.h5", "/x")
        file["group/there"] = np.zeros(3)
    done = call(program, "check", case)
    assert done.returncode == 3
    assert "there are: group/far, group/gone, group/there" in done.stderr
    assert done.stderr.isprintable() or done.stderr.replace("\n", "").isprintable()


def test_too_many_rows(program: str, tmp_path: Path) -> None:
    """Numbers of rows beyond 32 bits are an error and do not become negative."""
    case = tmp_path / "y.nml"
    phase = "&phase pressure = 1e3, duration = 1, steps = 900000000 /\n"
    case.write_text("&grid nx = 8, ny = 8, lx = 1 /\n&surface shape = 'flat' /\n"
                    "&material shear_modulus = 1e6 /\n" + 3 * phase)
    done = call(program, "check", case)
    assert done.returncode == 2, done.stdout
    assert "rows: at most 2e9 are allowed" in done.stderr
    case.write_text(case.read_text().replace(3 * phase, 2 * phase))
    done = call(program, "check", case)
    assert done.returncode == 0
    assert "1800000000 time steps" in done.stdout


def test_spectrum_of_a_tiny_map() -> None:
    """Lengths whose wave numbers overflow are an error."""
    with pytest.raises(ValueError, match="cannot be represented"):
        asperity.surface.psd(np.ones((8, 8)), 1e-308, 1.0)


@pytest.mark.parametrize(("length", "modulus", "pressure"), [(1e60, 1e200, 1e199),
                                                          (1e150, 1e200, 1e200)])
def test_overflow_is_status_4(program: str, tmp_path: Path, length: float, modulus: float,
                              pressure: float) -> None:
    """Energies or fields that overflow end a run with status 4, and the result gives the reason."""
    case = tmp_path / "y.nml"
    case.write_text(
        f"&grid nx = 16, ny = 16, lx = {length} /\n"
        f"&surface shape = 'sine', amplitude = {0.1 * length}, wavelength = {length} /\n"
        f"&material shear_modulus = {modulus}, prony_g = {modulus}, prony_tau = 1 /\n"
        f"&phase pressure = {pressure}, duration = 1, steps = 3 /\n")
    done = call(program, "run", case)
    assert done.returncode == 4, (done.returncode, done.stderr)
    assert "a value is not a finite number" in done.stderr
    run = asperity.open(tmp_path / "y.h5")
    assert not run.finished and "not a finite number" in run.outcome
    with pytest.raises(asperity.NotConverged, match="not a finite number"):
        asperity.run(case, quiet=True, overwrite=True)


def test_damaged_results(program: str, tmp_path: Path) -> None:
    """With flipped bits and zeroed blocks in a result, `info` and a restart end with a status."""
    case = tmp_path / "y.nml"
    case.write_text(vc.text(size=24, steps=4, output="checkpoint_every = 4, snapshot_every = 3"))
    done = subprocess.run([program, "run", case, "--quiet"], check=False, capture_output=True,
                          env={"SLURM_JOB_END_TIME": "1"})
    assert done.returncode == 124
    done = vc.run(program, case)
    result = case.with_suffix(".h5")
    whole = result.read_bytes()
    chance = random.Random(5)
    for trial in range(40):
        damaged = bytearray(whole)
        place = chance.randrange(len(whole))
        if trial % 4 == 0:
            damaged[place:place + 512] = bytes(min(512, len(whole) - place))
        else:
            damaged[place] ^= 1 << chance.randrange(8)
        result.write_bytes(damaged)
        done = call(program, "info", result)
        assert done.returncode in (0, 3), (trial, place, done.returncode, done.stderr)


def test_sweep_sees_a_changed_map(tmp_path: Path) -> None:
    """A sweep does not reuse a result that was computed with another map of the same name."""
    case = asperity.Case.read(ELASTIC)
    heights = np.random.default_rng(3).standard_normal((16, 12)) * 1e-4

    def areas() -> list[float]:
        folder = tmp_path / "sweep"
        table = asperity.sweep(case, {"phase.pressure": [1e3, 2e3]}, folder=folder, quiet=True)
        return table["contact_area"].tolist()

    case.surface[0].file = str(tmp_path / "map.h5")
    with h5py.File(tmp_path / "map.h5", "w") as file:
        file["surface/height"] = heights
    first = areas()
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "sweep").glob("*.h5")}
    assert areas() == first
    assert kept == {path: path.stat().st_mtime_ns for path in (tmp_path / "sweep").glob("*.h5")}
    with h5py.File(tmp_path / "map.h5", "w") as file:
        file["surface/height"] = 3 * heights
    second = areas()
    assert second != first
    assert all(b < a for a, b in zip(first, second, strict=True))


def flip(path: Path, place: int) -> None:
    """Change one bit of a file."""
    data = bytearray(path.read_bytes())
    data[place] ^= 4
    path.write_bytes(data)


@pytest.mark.parametrize("compression", [0, 4])
def test_damaged_values_are_named(program: str, tmp_path: Path, compression: int) -> None:
    """One wrong bit in any value of a field, an axis or the history is found and named."""
    case = tmp_path / "y.nml"
    case.write_text(vc.text(size=24, steps=2, output=f"snapshot_every = 2, compression ="
                                                     f" {compression}"))
    assert vc.run(program, case).returncode == 0
    result = case.with_suffix(".h5")
    whole = result.read_bytes()
    done = call(program, "info", result)
    assert done.returncode == 0 and "\ndamaged" not in done.stdout
    for name in ("snapshots/000002/pressure", "snapshots/000004/x", "surface/height",
                 "material/prony_g", "grid/y"):
        with h5py.File(result) as file:
            chunk = file[name].id.get_chunk_info(0)
        flip(result, chunk.byte_offset + chunk.size // 2)
        done = call(program, "info", result)
        assert done.returncode == 3
        assert f"{result}: the file is damaged: /{name} cannot be read" in done.stderr
        assert f"damaged     /{name}\n" in done.stdout and "finished    yes" in done.stdout
        with h5py.File(result) as file, pytest.raises(OSError, match=r"[Ff](ilter|letcher)"):
            file[name][()]
        result.write_bytes(whole)
    with h5py.File(result) as file:
        chunk = file["history/contact_area"].id.get_chunk_info(0)
    flip(result, chunk.byte_offset + 3 * 8)
    done = call(program, "info", result)
    assert done.returncode == 3
    assert "damaged: /history: row 3 does not agree with its checksum" in done.stderr
    with pytest.warns(UserWarning, match="damaged in row 3"):
        asperity.open(result)


def test_damaged_field_in_python(program: str, tmp_path: Path) -> None:
    """Reading a damaged field is an error; the other fields can still be read."""
    case = tmp_path / "y.nml"
    case.write_text(vc.text(size=24, steps=2))
    assert vc.run(program, case).returncode == 0
    result = case.with_suffix(".h5")
    with h5py.File(result) as file:
        last = sorted(file["snapshots"])[-1]
        chunk = file[f"snapshots/{last}/gap"].id.get_chunk_info(0)
    flip(result, chunk.byte_offset + 11)
    snapshot = asperity.open(result).snapshots[-1]
    assert snapshot.pressure.max() > 0.0
    with pytest.raises(OSError, match=r"y\.h5: cannot be read: "):
        _ = snapshot.gap


@pytest.mark.parametrize("compression", [0, 1, 9])
def test_chunks_are_as_the_filters_of_the_file_say(program: str, tmp_path: Path, compression: int
                                                   ) -> None:
    """Programs without our filters can read a chunk, and its bytes do not depend on threads."""
    chunks = {}
    for threads in (1, 3):
        case = tmp_path / f"case{threads}.nml"
        case.write_text("&grid nx = 600, ny = 500, lx = 1e-3 /\n"
                        "&surface shape = 'self_affine', rms_slope = 0.2, hurst = 0.8,"
                        " wavelength_long = 2e-4, wavelength_short = 1e-5 /\n"
                        "&material shear_modulus = 1e6 /\n&phase pressure = 1e5 /\n"
                        f"&output compression = {compression} /\n&solver threads = {threads} /\n")
        subprocess.run([program, "run", case, "--quiet"], check=True)
        with h5py.File(case.with_suffix(".h5")) as file:
            snapshot = file["snapshots/000000"]
            for name in ("pressure", "gap", "displacement_z", "road_height", "contact"):
                field = snapshot[name]
                assert field.chunks == (218, 600) and field.id.get_num_chunks() == 3
                assert field.fletcher32 and field.shuffle == (compression > 0)
                rows = []
                for first in range(0, 500, 218):
                    mask, stored = field.id.read_direct_chunk((first, 0))
                    assert mask == 0
                    chunks.setdefault((name, first), stored)
                    assert chunks[name, first] == stored
                    rows.append(undone(stored, field.dtype, compression))
                assert not rows[-1][500 % 218 * 600:].any()      # what is beyond the field
                assert np.array_equal(np.concatenate(rows)[:field.size].reshape(field.shape),
                                      field[...])
                if compression and name == "displacement_z":     # six of eight bytes are random
                    assert 0.7 < sum(map(len, (chunks[name, k] for k in (0, 218)))) / (
                        2 * 218 * 600 * 8) < 0.9


def undone(stored: bytes, dtype: np.dtype, compression: int) -> np.ndarray:
    """Return the values of a stored chunk, unpacked without HDF5."""
    body = stored[:-4]
    if not compression:
        return np.frombuffer(body, dtype)
    planes = np.frombuffer(zlib.decompress(body), np.uint8).reshape(dtype.itemsize, -1)
    return np.ascontiguousarray(planes.T).view(dtype).ravel()
