"""Quantities that are derived from results."""

import subprocess

import h5py
import numpy as np
import pytest
from conftest import frictional_result, write_result

import asperity
from asperity.results.derived import closure, energy_terms
from asperity.results.road_slopes import direction, friction_outside, moved_slopes
from asperity.results.settings import (
    has_adhesion,
    has_friction,
    has_rough_road,
    parse_settings,
    phase_names,
    setting,
    settings_of,
    solver_setting,
    steady_phases,
)
from asperity.runs import namelists
from asperity.views.report_sections import settings_groups


def with_text(path, name, text):
    """Write an attribute of the file and return the run."""
    with h5py.File(path, "a") as file:
        file.attrs[name] = text
    return asperity.open(path)


def test_settings_are_found(result):
    run = with_text(result, "settings", "&case\n  title = 'a &friction test'\n/\n&friction\n"
                    "  law = 'coulomb'\n  coefficient = 0.5\n/\n&solver\n  tolerance = 1d-5\n"
                    "  max_iterations = 100  ! at most\n/\n")
    assert setting(run, "friction", "law") == "coulomb"
    assert setting(run, "solver", "max_iterations") == "100"
    assert solver_setting(run, "tolerance") == pytest.approx(1e-5)
    assert setting(run, "solver", "law") is None
    assert solver_setting(run, "nothing") is None
    assert has_friction(run) and not has_adhesion(run)


def test_settings_of_an_input_without_resolved_ones(result):
    run = with_text(result, "input", "&adhesion potential = \"gauss\", energy = 0.05 /\n"
                    "&friction law='none' /\n&solver tolerance=2e-4/\n")
    assert has_adhesion(run) and not has_friction(run)
    assert solver_setting(run, "tolerance") == 2e-4


# Strings hold what else would be a comment, the end of a group, a setting or another group.
TRICKY = """&case
  title = 'up / down: steady = .true. ! &friction law = ''none'' /'
/
&grid
  nx = 32
  lx = 0.001  ! m
/
&surface
  shape = 'sine'  ! not shape = 'file'
/
&material
  prony_g = 2000000, 1000000  ! Pa
/
&friction
  law = 'coulomb'
/
&phase
  name = 'steady = .true. /'
  steps = 100  ! dt = 1e-5 s: steps given
  ! pressure as in the phase before: 400000 Pa
  steady = .false.
/
&phase
  name = 'the driver''s "run" & on ! 2'
  steady = .true.
/
"""


def test_strings_do_not_confuse_the_settings(result):
    run = with_text(result, "settings", TRICKY)
    assert [group.name for group in settings_of(run)] == [
        "case", "grid", "surface", "material", "friction", "phase", "phase"]
    assert setting(run, "case", "title") == (
        "up / down: steady = .true. ! &friction law = 'none' /")
    assert setting(run, "friction", "law") == "coulomb" and has_friction(run)
    assert steady_phases(run) == [2]
    assert phase_names(run) == ["steady = .true. /", "the driver's \"run\" & on ! 2"]
    assert not has_rough_road(run)
    groups = dict(settings_groups(run)[:-2])
    assert groups["grid"] == [("nx", "32"), ("lx", "0.001 m")]
    assert groups["material"] == [("prony_g", "2000000, 1000000 Pa")]
    first, second = (dict(values) for name, values in settings_groups(run) if name == "phase")
    assert first == {"name": "steady = .true. /", "steps": "100 (dt = 1e-5 s: steps given)",
                     "steady": ".false."}
    assert second["name"] == "the driver's \"run\" & on ! 2"


def test_the_settings_of_all_templates_are_read_like_the_input(program, tmp_path):
    """The program's own reader and that of the results find the same groups and values."""
    names = [line.split()[0] for line in subprocess.run(
        [program, "template"], check=True, capture_output=True, text=True).stdout.splitlines()]
    assert len(names) >= 7
    for name in names:
        text = subprocess.run([program, "template", name], check=True, capture_output=True,
                              text=True).stdout
        found = parse_settings(text)
        wanted = namelists.listed(text)
        assert [group.name for group in found] == [group for group, _ in wanted]
        for group, (_, values) in zip(found, wanted, strict=True):
            assert list(group.values) == list(values)
            for variable, value in values.items():
                values_of_list = value if isinstance(value, list) else [value]
                for text_of_value, one in zip(group.values[variable], values_of_list, strict=True):
                    if isinstance(one, bool):
                        assert text_of_value == (".true." if one else ".false.")
                    elif isinstance(one, str):
                        assert text_of_value == one
                    else:
                        assert float(text_of_value) == one


def test_friction_is_known_by_its_columns(tmp_path):
    assert has_friction(asperity.open(frictional_result(tmp_path / "with.h5")))
    assert not has_friction(asperity.open(write_result(tmp_path / "without.h5", moving=True)))


def test_books(frictional):
    run = asperity.open(frictional)
    terms = energy_terms(run)
    np.testing.assert_allclose(
        terms["work"], run.history["work_normal"] + run.history["work_tangential"])
    missing = closure(run)
    assert missing[:-1].max() < 1e-15
    assert missing[-1] == pytest.approx(1e-3 / 1.001, rel=1e-6)
    with h5py.File(frictional, "a") as file:
        del file["history/dissipated_viscous"]
    assert closure(asperity.open(frictional)) is None


def test_direction_of_the_road(frictional):
    with h5py.File(frictional, "a") as file:
        file["history/road_x"][...] = [0, 0, 3e-6, 6e-6, 6e-6, 6e-6]
        file["history/road_y"][...] = [0, 0, 4e-6, 8e-6, 8e-6, 7e-6]
    run = asperity.open(frictional)
    assert direction(run, 1) is None
    assert direction(run, 2) == pytest.approx((0.6, 0.8))
    assert direction(run, 4) == pytest.approx((0.6, 0.8))  # at rest: the last one
    assert direction(run, 5) == pytest.approx((0.0, -1.0))


@pytest.mark.filterwarnings("ignore:.*edge of the free map")
@pytest.mark.parametrize(("boundary", "interpolation"), [
    ("periodic", "cubic"), ("periodic", "linear"), ("free", "cubic"), ("free", "linear")])
def test_friction_of_the_pressure_is_the_program_s(program, tmp_path, boundary, interpolation):
    """Without friction the pressure causes all of it, by the slopes of the road that has moved."""
    shape = "" if boundary == "periodic" else "&surface shape = 'sphere', radius = 4e-3 /"
    load = "pressure = 0.1e6" if boundary == "periodic" else "force = 0.02"
    (tmp_path / "case.nml").write_text(f"""
&grid nx = 48, ny = 33, lx = 1e-3, ly = 0.6e-3, boundary = '{boundary}' /
&surface shape = 'self_affine', hurst = 0.8, rms_slope = 0.2, wavelength_long = 0.4e-3,
         wavelength_short = 0.17e-3 /
{shape}
&material shear_modulus = 1e6, prony_g = 2e6, prony_tau = 1e-4 /
&adhesion potential = 'exponential', energy = 0.05, range = 5e-6 /
&phase {load}, relaxed = .true. /
&phase duration = 0.1e-3, steps = 8, velocity_x = 1.0, velocity_y = 0.37 /
&solver tolerance = 1e-5, interpolation = '{interpolation}' /
&output snapshot_every = 4 /
""")
    run = asperity.run(tmp_path / "case.nml")
    rows = [row for row in range(run.history.rows) if row in run.snapshots.steps and row > 0]
    assert len(rows) == 2
    at, outside = friction_outside(run)
    assert list(at) == rows
    for row, part in zip(rows, outside, strict=True):
        snapshot = run.snapshots.at_step(row)
        road = [run.history[name][row] for name in ("road_x", "road_y")]
        slope_x, slope_y = moved_slopes(snapshot, road)
        along = direction(run, row)
        pressure = snapshot.pressure
        force = pressure * (along[0] * slope_x + along[1] * slope_y)
        assert -force.mean() / pressure.mean() == pytest.approx(
            run.history["friction_viscous"][row], rel=1e-6)
        # The parts inside and outside the contact add up to the whole, and neither vanishes.
        inside = -np.mean(force * (snapshot.contact > 0)) / pressure.mean()
        assert inside + part == pytest.approx(run.history["friction_viscous"][row], rel=1e-6)
        assert abs(part) > 1e-6
