"""Height maps may be arrays or topographies wherever the package takes a map."""

import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest

import asperity

pytestmark = pytest.mark.filterwarnings("ignore:&")

MATERIAL = dict(shear_modulus=1e6)


def wave(ny=20, nx=24):
    x, y = np.arange(nx) / nx, np.arange(ny) / ny
    return 1e-6 * (np.cos(2 * np.pi * x) + 0.5 * np.cos(4 * np.pi * y)[:, None])


def solved(height, lx, ly, **load):
    return asperity.solve_normal(height, lx, ly, 2 * 1e6 / 0.5, tolerance=1e-8, **load)


def test_a_case_takes_a_measured_surface(tmp_path):
    path = asperity.surface.save(tmp_path / "map.h5", wave(), 1.2e-3, 0.8e-3, boundary="periodic")
    measured = asperity.surface.load(path)
    case = asperity.Case(surface=measured, material=MATERIAL, phase=dict(pressure=3e3))
    array = asperity.Case(surface=wave() - wave().mean(), grid=dict(lx=1.2e-3, ly=0.8e-3),
                          material=MATERIAL, phase=dict(pressure=3e3))
    rows = [asperity.Simulation(one).advance() for one in (case, array)]
    assert rows[0].contact_area == rows[1].contact_area > 0.0


def test_a_list_of_surfaces_takes_arrays():
    case = asperity.Case(surface=wave(), grid=dict(lx=1.2e-3, ly=0.8e-3), material=MATERIAL,
                         phase=dict(pressure=3e3))
    case.surface.append(wave())
    case.surface.extend([wave().tolist()])
    case.surface += [wave()]
    assert [one["shape"] for one in case.surface] == ["file"] * 4
    asperity.Simulation(case).advance()


def test_a_case_takes_an_array(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    height = wave()
    case = asperity.Case(surface=height, grid=dict(lx=1.2e-3, ly=0.8e-3), material=MATERIAL,
                         phase=dict(pressure=3e3), solver=dict(tolerance=1e-8))
    assert (case.grid.nx, case.grid.ny) == (24, 20)
    assert "nx = 24" in case.check()
    run = case.run()
    exact = solved(height, 1.2e-3, 0.8e-3, pressure=3e3)
    assert np.allclose(run.snapshots[-1].pressure, exact.pressure, atol=1e-6 * exact.pressure.max())
    assert np.array_equal(run.height, height)
    maps = [path for path in tmp_path.iterdir() if path.name.startswith("surface-")]
    assert len(maps) == 1 and str(maps[0]) in run.input


def test_a_simulation_takes_an_array_and_writes_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    case = asperity.Case(surface=wave(), grid=dict(lx=1.2e-3), material=MATERIAL,
                         phase=dict(pressure=3e3))
    sim = asperity.Simulation(case)
    sim.advance()
    assert np.array_equal(sim.fields.height, wave())
    assert not list(tmp_path.iterdir())


def test_a_written_case_is_complete_without_this_process(tmp_path, program):
    case = asperity.Case(surface=[wave(), dict(shape="sine", amplitude=1e-7, wavelength=1e-3)],
                         grid=dict(lx=1e-3), material=MATERIAL, phase=dict(pressure=3e3))
    case.write(tmp_path / "case.nml")
    case.write(tmp_path / "again.nml")
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names[:2] == ["again.nml", "case.nml"] and len(names) == 3
    for surface in case.surface[:1]:
        assert not Path(surface.file).is_absolute()
    moved = tmp_path.with_name(tmp_path.name + "_moved")
    tmp_path.rename(moved)
    subprocess.run([program, "run", "case.nml", "--quiet"], cwd=moved, check=True)
    assert asperity.open(moved / "case.h5").finished


def test_nested_lists_are_maps():
    lists = wave().tolist()
    for surface in (lists, [lists], [lists, dict(shape="sine", amplitude=1e-7, wavelength=1e-3)]):
        case = asperity.Case(surface=surface)
        assert (case.grid.ny, case.grid.nx) == wave().shape
        assert case.surface[0].file == asperity.Case(surface=wave()).surface[0].file
    for wrong in ([1.0, 2.0], "road.h5", 5):
        with pytest.raises(ValueError, match=r"must be a dict of variables, or a height map: an"):
            asperity.Case(surface=wrong)
    with pytest.raises(ValueError, match=r"&phase: 5: must be a dict of variables$"):
        asperity.Case(phase=5)


@pytest.mark.parametrize("value", [
    [[1.0, 2.0], [3.0]], np.array([1.0, np.nan]), np.zeros((2, 2, 2)), np.array([["a"]])])
def test_wrong_kinds_of_maps_are_refused(value):
    with pytest.raises(ValueError, match="surface"):
        asperity.Case(surface=value)


def test_a_map_of_another_size_than_the_grid_is_refused():
    case = asperity.Case(surface=wave(), grid=dict(nx=12, ny=20, lx=1e-3), material=MATERIAL,
                         phase=dict(pressure=3e3))
    with pytest.raises(ValueError, match="12"):
        case.check()


def test_a_topography_brings_its_grid(tmp_path):
    topography = pytest.importorskip("SurfaceTopography")
    height = wave()
    given = topography.Topography(1e6 * height.T, (1200.0, 800.0), unit="um", periodic=True)
    case = asperity.Case(surface=given, material=MATERIAL, phase=dict(pressure=3e3))
    assert case.grid.lx == pytest.approx(1.2e-3) and case.grid.ly == pytest.approx(0.8e-3)
    assert case.grid.boundary == "periodic" and (case.grid.nx, case.grid.ny) == (24, 20)
    sim = asperity.Simulation(case)
    assert np.allclose(sim.fields.height, 0.0) or np.allclose(sim.fields.height, height)
    free = topography.Topography(1e6 * height.T, (1200.0, 800.0), unit="um")
    assert asperity.Case(surface=free).grid.boundary == "free"
    with pytest.raises(ValueError, match="has no unit"):
        asperity.Case(surface=topography.Topography(height.T, (1.0, 1.0)))
    path = asperity.surface.save(tmp_path / "map.h5", given)
    assert np.allclose(asperity.surface.load(path).height, height)
    with pytest.raises(ValueError, match="its own lengths"):
        asperity.surface.save(path, given, 1.0)


def test_saved_arrays(tmp_path, program):
    path = asperity.surface.save(tmp_path / "road.h5", wave(), 1e-3, 0.9e-3, title="waves")
    loaded = asperity.surface.load(path)
    assert np.allclose(loaded.height, wave(), rtol=0, atol=1e-18) and loaded.periodic
    assert (loaded.lx, loaded.ly) == (1e-3, 0.9e-3)
    (tmp_path / "case.nml").write_text(
        "&grid nx=24, ny=20, lx=1e-3, ly=0.9e-3 / &surface shape='file', file='road.h5' /"
        "&material shear_modulus=1e6 / &phase pressure=1e3 /")
    done = subprocess.run([program, "check", "case.nml"], cwd=tmp_path, capture_output=True,
                          text=True, check=True)
    assert done.stderr == "" and "warning" not in done.stdout.replace("! warning: &surface", "")
    with pytest.raises(ValueError, match="lx: must be given"):
        asperity.surface.save(path, wave())
    with pytest.raises(OSError, match="there is no folder"):
        asperity.surface.save(tmp_path / "no" / "road.h5", wave(), 1.0)
    run = asperity.run(tmp_path / "case.nml")
    with pytest.raises(ValueError, match="is the result of a run"):
        asperity.surface.save(run.path, wave(), 1.0)


def added_dataset(file):
    file["measured"] = 1.0


def added_to_the_map(file):
    file["surface/colour"] = np.zeros((3, 3))


def added_attribute(file):
    file["surface/height"].attrs["owner"] = "me"


def added_link(file):
    del file["grid/x"]
    file["grid/x"] = h5py.SoftLink("/grid/y")


def other_program(file):
    file.attrs["program"] = "Gwyddion"


@pytest.mark.parametrize("change", [added_dataset, added_to_the_map, added_attribute, added_link,
                                    other_program])
def test_only_own_maps_are_replaced(tmp_path, change):
    """A map that holds more than the package writes, or comes from elsewhere, is kept."""
    path = asperity.surface.save(tmp_path / "road.h5", wave(), 1e-3)
    assert asperity.surface.save(path, wave(), 1e-3) == path
    with h5py.File(path, "a") as file:
        change(file)
    before = path.read_bytes()
    with pytest.raises(ValueError, match=r"road\.h5: exists and is not a height map of Asperity"):
        asperity.surface.save(path, wave(), 1e-3)
    assert path.read_bytes() == before


@pytest.mark.parametrize("name", ["surface", "surface/height"])
def test_maps_of_other_programs_are_kept(tmp_path, name):
    with h5py.File(tmp_path / "map.h5", "w") as file:
        file[name] = np.zeros((3, 3))
    with pytest.raises(ValueError, match=r"map\.h5: exists and is not a height map of Asperity"):
        asperity.surface.save(tmp_path / "map.h5", wave(), 1.0)
    own = asperity.surface.load(tmp_path / "map.h5", unit="m" if name == "surface" else None,
                                size=(1, 1), level="none").save(tmp_path / "own.h5")
    assert asperity.surface.load(own).save(own) == own


def test_line_scans_with_uneven_distances_are_refused(tmp_path):
    """They used to be made even, which moved every point."""
    topography = pytest.importorskip("SurfaceTopography")
    x = np.arange(12.0) ** 1.5
    scan = topography.NonuniformLineScan(x, np.sin(x), unit="um")
    for use in (lambda: asperity.surface.save(tmp_path / "line.h5", scan),
                lambda: asperity.Case(surface=scan)):
        with pytest.raises(ValueError, match="line scan with points at uneven distances"):
            use()
    assert not list(tmp_path.iterdir())


def test_maps_of_one_column_are_refused(tmp_path):
    for use in (lambda: asperity.surface.save(tmp_path / "map.h5", np.ones((3, 1)), 1e-3),
                lambda: asperity.Case(surface=np.ones((3, 1)))):
        with pytest.raises(ValueError, match=r"has shape \(3, 1\), \(ny, nx\): nx must be at lea"):
            use()


def test_a_surface_made_of_an_array_can_be_saved_and_shown(tmp_path):
    """Its origin is unknown, which used to end with a KeyError."""
    made = asperity.surface.MeasuredSurface(wave(), 1e-3, 1e-3, True, "um")
    assert "an array" in made.summary()
    assert asperity.surface.load(made.save(tmp_path / "map.h5"), level="none").lx == 1e-3
