"""Friction curves: points equal single runs, intervals cover the mean, ways of running agree."""

import csv
import errno
import importlib.util
import json
import os
import re
import resource
import signal
import stat
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
import pytest
from browser import BROWSER, Browser
from conftest import PATIENCE
from slurm import HAS_SLURM, Slurm

import asperity
from asperity.__main__ import main
from asperity.curves import CurvePlan, plan_curve, run_curve
from asperity.curves.gathering import _left_out_note
from asperity.curves.running import SubmittedError
from asperity.curves.sources import _road_source, compound_of, road_of
from asperity.material import WLF, Prony
from asperity.results.curve_remarks import CurveRemark
from asperity.results.friction_curve import COLUMNS, _rounded, interval
from asperity.roads.outliers import find_outliers
from asperity.rubber.compound import Compound
from asperity.runs.means import Means
from asperity.views.style import distinct_colours

ROAD = "self_affine:hurst=0.8,wavelength_long=1e-3,wavelength_short=2.5e-4,rms_slope=0.15"
RUBBER = Prony(1e6, [3e6, 5e6, 8e6], [1e-4, 1e-3, 1e-2])
LAW = WLF(8.0, 120.0, 20.0)
COMPOUND = Compound(RUBBER, 20.0, LAW)
NAMELIST = """&material shear_modulus = 1e6, prony_g = 3e6, 5e6, 8e6, prony_tau = 1e-4, 1e-3, 1e-2,
   reference_temperature = 20.0, wlf_c1 = 8.0, wlf_c2 = 120.0 /
"""


def small_plan(cells=32, **options):
    """Return a plan with few points."""
    given = dict(speeds=[1e-3, 1e-2, 1e-1], pressures=[2e5], patches=2) | options
    return plan_curve(road_of([ROAD], cells=cells), COMPOUND, **given)


def curve_of(plan, folder, jobs=1, **options):
    return run_curve(plan, folder, Means(jobs), quiet=True, **options)


# ---- the plan ---------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [1.2, 30.0, 1000.0])
@pytest.mark.parametrize("law", [{}, dict(coefficient=0.5),
                                 dict(coefficient=0.5, slope_effect=True)])
def test_the_plan_knows_the_number_of_transforms(ratio, law, tmp_path):
    """The prediction is within a factor of 2.5 for a rubber and a road that it was not made for."""
    arms = 5
    series = Prony(1e6, [1e6 * (ratio - 1.0) / arms] * arms, np.geomspace(1e-6, 1e-2, arms))
    road = "self_affine:hurst=0.7,wavelength_long=5e-4,wavelength_short=1.2e-4,rms_slope=0.2"
    plan = plan_curve(road_of([road], cells=64), Compound(series, 20.0), patches=1,
                      speeds=np.geomspace(1e-4, 1e2, 13), pressures=[1e5], **law)
    patch = plan.road.patch(0)
    run = asperity.run(plan.case(patch, str(patch.save(tmp_path)), 0, 0))
    assert 0.4 < np.mean(run.history.ffts) / plan.transforms(20.0) < 2.5


@pytest.mark.parametrize(("options", "note"), [
    (dict(speeds=[1e-3, 1e5]), "at 100000 m/s the inertia of the rubber counts"),
    (dict(pressures=[2e9]), r"a pressure of 2e\+09 Pa is 2e\+03 times the relaxed modulus"),
    (dict(pressures=[0.2]), "a pressure of 0.2 Pa is only 2e-07 of the relaxed modulus"),
    (dict(coefficient=30.0, slope_effect=True), "the coefficient times the rms slope of the road"),
])
def test_the_plan_doubts_values_in_another_unit(options, note):
    assert sum(re.match(note, one) is not None for one in small_plan(**options).notes) == 1
    assert not any(re.match(note, one) for one in small_plan().notes)


def test_the_plan_doubts_a_steep_road():
    for slope, doubted in ((0.3, False), (9.0, True)):
        road = ROAD.replace("rms_slope=0.15", f"rms_slope={slope}")
        notes = plan_curve(road_of([road], cells=32), COMPOUND, speeds=[1e-2], pressures=[2e5],
                           patches=2).notes
        assert any("the rms slope of the road is" in note for note in notes) == doubted


def test_a_fitted_namelist_keeps_the_measured_range(tmp_path):
    """The notes on unmeasured frequencies and temperatures used to come with tables only."""
    omega = np.geomspace(1.0, 1e3, 16)
    rows = ["f (rad/s),G' (Pa),G'' (Pa),T (C)"]
    for celsius in (0.0, 10.0, 20.0, 30.0):
        modulus = RUBBER.shifted(celsius, LAW).complex_modulus(omega)
        rows += [f"{w!r},{g.real!r},{g.imag!r},{celsius}" for w, g in zip(
            omega.tolist(), modulus.tolist(), strict=True)]
    (tmp_path / "dma.csv").write_text("\n".join(rows) + "\n")
    fit = asperity.dma.fit_dma(asperity.dma.read_dma(tmp_path / "dma.csv"), reference=20.0)
    (tmp_path / "fit.nml").write_text(fit.to_namelist())
    notes = [plan_curve(road_of([ROAD], cells=32), compound_of(tmp_path / name), patches=1,
                        pressures=[2e5], speeds=[1e-6, 1e-2], temperatures=[20.0, 293.0]).notes
             for name in ("dma.csv", "fit.nml")]
    for found in notes:
        assert sum("the measured frequencies" in note for note in found) >= 2
        assert sum("293 °C: the rubber was measured from 0 to 30 °C only" in note
                   for note in found) == 1
    with pytest.raises(ValueError, match=r"temperatures: -300 C: must be >= -273\.15 C"):
        plan_curve(road_of([ROAD], cells=32), compound_of(tmp_path / "fit.nml"), speeds=[1.0],
                   pressures=[2e5], temperatures=[-300.0])


@pytest.mark.parametrize(("source", "option"), [
    (COMPOUND, {"wlf": (8.0, 120.0, 20.0)}), (COMPOUND, {"vertical": True}),
    (RUBBER, {"columns": {"loss": 2}}), (RUBBER, {"arms_per_decade": 2.0}),
    (RUBBER, {"kind": "tension"})])
def test_options_that_a_rubber_does_not_use_are_refused(source, option):
    """They used to be ignored unless the rubber was a namelist."""
    with pytest.raises(ValueError, match=rf"{next(iter(option))} \(--[a-z-]+\): is for DMA tables"):
        compound_of(source, **option)


def test_rubbers_with_a_negative_poisson_ratio(tmp_path):
    (tmp_path / "foam.nml").write_text("&material shear_modulus = 1e6, poisson = -0.2 /")
    assert compound_of(tmp_path / "foam.nml").poisson == -0.2


# ---- statistics ------------------------------------------------------------------------------


def test_the_interval_covers_the_mean():
    """95 % of the intervals of repeated draws do if the friction is normal; nearly so if skewed."""
    random = np.random.default_rng(1)
    for count in (3, 8):
        draws = random.normal(0.3, 0.04, size=(20000, count))
        _, low, high, _ = interval(draws)
        assert abs(np.mean((low <= 0.3) & (high >= 0.3)) - 0.95) < 0.006
    skewed = np.exp(random.normal(0.0, 0.25, size=(20000, 8)))
    _, low, high, _ = interval(skewed)
    assert np.mean((low <= np.exp(0.5 * 0.25**2)) & (high >= np.exp(0.5 * 0.25**2))) > 0.93


def test_intervals_leave_out_what_did_not_converge():
    values = np.array([[1.0, 2.0, np.nan, 3.0], [np.nan, np.nan, np.nan, 5.0]])
    mean, low, high, count = interval(values)
    assert count.tolist() == [3, 1]
    assert mean.tolist() == [2.0, 5.0]
    assert np.isnan([low[1], high[1]]).all() and low[0] < 2.0 < high[0]


def test_the_interval_covers_the_mean_of_64_patches(tmp_path):
    """64 patches represent the road, and draws of 8 of them what a user would compute."""
    plan = small_plan(cells=24, speeds=[1e-2], pressures=[1e4, 2e5], patches=64)
    curve = curve_of(plan, tmp_path, jobs=2)
    area = curve.values["contact_area"].mean(axis=-1).ravel()
    assert area[0] < 0.03 and area[1] > 0.1  # few cells touch, so the values are skewed
    random = np.random.default_rng(2)
    for friction in curve.values["friction"][:, 0, 0]:
        assert np.isfinite(friction).all() and np.std(friction) > 0.01 * friction.mean()
        draws = np.array([random.choice(friction, 8, replace=True) for _ in range(4000)])
        _, low, high, _ = interval(draws)
        covered = np.mean((low <= friction.mean()) & (high >= friction.mean()))
        assert 0.92 < covered < 0.985


# ---- points ----------------------------------------------------------------------------------


def test_points_are_single_runs(tmp_path):
    """Compared with friction in the interface, an oblique velocity and another temperature."""
    plan = small_plan(temperatures=[20.0, 40.0], coefficient=0.3, tolerance=1e-8)
    curve = curve_of(plan, tmp_path / "curve")
    assert curve.values["friction"].shape == (1, 2, 3, 2)
    patch = plan.road.patch(1)
    rubber = RUBBER.shifted(40.0, LAW)
    angle = np.radians(plan.angle)
    case = asperity.Case(
        grid=dict(nx=32, ny=32, lx=patch.lx, ly=patch.ly),
        surface=dict(shape="file", file=str(patch.save(tmp_path))),
        material=dict(shear_modulus=rubber.g_inf, prony_g=rubber.g, prony_tau=rubber.tau),
        friction=dict(law="coulomb", coefficient=0.3, slope_effect=False),
        phase=dict(steady=True, pressure=2e5, velocity_x=1e-2 * np.cos(angle),
                   velocity_y=1e-2 * np.sin(angle)),
        solver=dict(tolerance=1e-8))
    row = asperity.run(case, output=tmp_path / "one.h5", threads=1).history
    for name in ("friction", "friction_viscous", "contact_area", "mean_gap"):
        assert curve.values[name][0, 1, 1, 1] == pytest.approx(row[name][-1], rel=2e-6), name


def test_a_shift_of_temperature_is_one_of_speed(tmp_path):
    factor = float(LAW.shift_factor(40.0))
    speeds = np.array([1e-2, 1e-1])
    warm = curve_of(small_plan(speeds=speeds, temperatures=[40.0]), tmp_path)
    cold = curve_of(small_plan(speeds=speeds * factor, temperatures=[20.0]), tmp_path)
    for name in ("friction", "contact_area", "mean_gap"):
        np.testing.assert_allclose(warm.values[name], cold.values[name], rtol=1e-10, err_msg=name)
    for name, values in warm.theory.items():
        np.testing.assert_allclose(values, cold.theory[name], rtol=1e-9, err_msg=name)
    assert warm.a_t[0] == pytest.approx(factor)


def test_a_vertical_shift_is_one_of_pressure(tmp_path):
    """If all moduli double, twice the pressure makes the same contact."""
    stiff = Compound(RUBBER, 20.0, LAW, vertical_shifts={20.0: 0.0, 40.0: np.log10(2.0)})
    road = road_of([ROAD], cells=32)
    factor = float(LAW.shift_factor(40.0))
    warm = curve_of(plan_curve(road, stiff, speeds=[1e-1], pressures=[4e5], temperatures=[40.0],
                               patches=1), tmp_path)
    cold = curve_of(plan_curve(road, stiff, speeds=[1e-1 * factor], pressures=[2e5], patches=1,
                               temperatures=[20.0]), tmp_path)
    np.testing.assert_allclose(warm.values["friction"], cold.values["friction"], rtol=1e-9)
    assert warm.b_t[0] == pytest.approx(2.0)


@dataclass(frozen=True)
class HardPlan(CurvePlan):
    """A plan whose solver has too few iterations at one speed."""

    def case(self, patch, file, i, j, first=0):
        case = super().case(patch, file, i, j, first)
        case.solver.max_iterations = 1
        case.solver.tolerance = 1e-12
        return case


def test_a_warning_about_each_patch_is_one_remark(tmp_path):
    """The file of the patch in a warning used to make each of them a kind of its own."""
    road = ROAD.replace("rms_slope=0.15", "rms_slope=9")
    plan = plan_curve(road_of([road], cells=32), COMPOUND, speeds=[1e-2], pressures=[2e5],
                      patches=3)
    found = [line for line in curve_of(plan, tmp_path).warnings if "the slope of the map" in line]
    assert len(found) == 1 and "1 of 1 point (0.01 m/s)" in found[0]


def test_points_without_an_interval_add_no_patches(curve):
    """A speed at which no patch converges must not make the curve compute ever more patches."""
    values = {name: array.copy() for name, array in curve.values.items()}
    values["friction"][:, :, 1] = np.nan
    assert 0.0 < replace(curve, values=values).largest_error <= curve.largest_error
    values["friction"][:] = np.nan
    assert replace(curve, values=values).largest_error == np.inf


def test_points_that_do_not_converge_are_left_out(tmp_path):
    plan = small_plan(patches=1)
    hard = HardPlan(**{name: getattr(plan, name) for name in plan.__dataclass_fields__})
    curve = curve_of(hard, tmp_path)
    assert np.isnan(curve.values["friction"]).all()
    assert len(curve.warnings) == 1
    assert "[1] 3 of 3 points did not converge and are left out (0.001 to 0.1 m/s): the limit of" \
        in curve.warnings[0]
    assert [row[-3:] for row in curve.rows()] == [(0, 1, 0)] * 3
    assert curve.states_with(lost=True).all() and not curve.states_with(lost=False).any()
    assert curve.summary().count("  [1]\n") == 3
    if "xarray" in sys.modules or importlib.util.find_spec("xarray"):
        found = curve.to_xarray()
        assert not found["converged"].any() and "did not converge" in found.attrs["warnings"]
    crosses = [line for axes in curve.plot().axes for line in axes.lines
               if line.get_marker() == "x" and len(line.get_xdata()) == 3]
    assert len(crosses) == 2  # one in each panel, at the lower edge
    page = curve.to_html(tmp_path / "curve.html").read_text(encoding="utf-8")
    assert "did not converge and are left out" in page and '"0,0,2":"[1]"' in page
    before = {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("*.h5")}
    assert len(before) == 4  # one for a map, and a run for each speed
    curve_of(hard, tmp_path)
    assert before == {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("*.h5")}


def test_warnings_of_runs_reach_the_curve(tmp_path, capsys):
    """Only the light contact has too few cells, although the same runs contain wide ones."""
    (tmp_path / "rubber.nml").write_text(NAMELIST)
    words = ["friction", ROAD, "--material", str(tmp_path / "rubber.nml"), "--speeds",
             "1e-3,1e-1", "--pressures", "10,2e5", "--cells", "32", "--patches", "2", "--quiet"]
    for end in ("csv", "html", "png"):
        words += ["-o", str(tmp_path / f"curve.{end}")]
    assert main(words) == 0
    printed = capsys.readouterr().out
    kinds = [line for line in printed.splitlines() if line.startswith("warning [")]
    assert len(kinds) == 1
    assert "2 of 4 points (10 Pa: 0.001 to 0.1 m/s): patches of contact are only" in kinds[0]
    with (tmp_path / "curve.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["with_warnings"] for row in rows] == ["2", "2", "0", "0"]
    assert {row["not_converged"] for row in rows} == {"0"}
    page = (tmp_path / "curve.html").read_text(encoding="utf-8")
    assert '"marks":{"0,0,0":"[1]","0,0,1":"[1]"}' in page
    assert "<strong>Warnings</strong>" in page
    pytest.importorskip("xarray")
    with pytest.warns(UserWarning, match="2 of 4 points"):
        found = asperity.friction_curve(
            ROAD, RUBBER, speeds=[1e-3, 1e-1], pressures=[10.0, 2e5], cells=32, patches=2,
            quiet=True, folder=tmp_path / "runs", jobs=1)
    assert found["warned"].values[:, 0].tolist() == [[[1, 1], [1, 1]], [[0, 0], [0, 0]]]
    assert found["converged"].all() and "patches of contact" in found.attrs["warnings"]


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_extreme_points_are_at_rest_or_glassy(tmp_path):
    """At the ends of the allowed speeds nothing is lost, and the area is that of either modulus."""
    plan = small_plan(speeds=[1e-30, 1e-12, 1e12, 1e30], patches=1)
    curve = curve_of(plan, tmp_path)
    area, friction = (curve.values[name][0, 0, :, 0] for name in ("contact_area", "friction"))
    assert np.abs(friction).max() < 1e-6
    np.testing.assert_allclose(area[::2], area[1::2], rtol=1e-3)
    assert area[0] > 2.0 * area[3] > 0.0
    assert np.isfinite(list(curve.theory.values())).all()


# ---- ways of running -------------------------------------------------------------------------


def same(one, other):
    """Return whether two curves agree in every bit."""
    for name in one.values:
        np.testing.assert_array_equal(one.values[name], other.values[name], err_msg=name)
    assert one.rows() == other.rows()


def test_the_same_however_it_is_run(tmp_path):
    plan = small_plan(temperatures=[20.0, 40.0])
    alone = curve_of(plan, tmp_path / "alone")
    same(alone, curve_of(plan, tmp_path / "four", jobs=4))
    with ThreadPoolExecutor(2) as executor:
        same(alone, run_curve(plan, tmp_path / "threads", Means(None, executor=executor),
                              quiet=True))
    with ProcessPoolExecutor(2) as executor:
        same(alone, run_curve(plan, tmp_path / "processes", Means(None, executor=executor),
                              quiet=True))
    # patches that are added later leave the others as they are
    more = curve_of(replace(plan, patches=3), tmp_path / "alone")
    np.testing.assert_array_equal(more.values["friction"][..., :2], alone.values["friction"])


def test_no_patch_of_one_seed_is_one_of_another():
    """The patches of one seed and of the next differ, so that repeated draws are independent."""
    codes = [road_of([ROAD], cells=32, seed=seed).patch(number).code
             for seed in (1, 2, 3) for number in range(8)]
    assert len(set(codes)) == len(codes)


@pytest.mark.slow
def test_the_same_through_dask(tmp_path):
    distributed = pytest.importorskip("distributed")
    plan = small_plan()
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None,
                                  local_directory=str(tmp_path)) as cluster, \
            distributed.Client(cluster) as client:
        found = run_curve(plan, tmp_path / "dask", Means(None, executor=client.get_executor()),
                          quiet=True)
    same(found, curve_of(plan, tmp_path / "alone"))


def test_the_same_after_results_are_lost(tmp_path):
    plan = small_plan()
    whole = curve_of(plan, tmp_path)
    results = sorted(path for path in tmp_path.glob("*.h5") if "-p" in path.name)
    results[0].unlink()
    results[1].write_bytes(results[1].read_bytes()[:5000])
    same(whole, curve_of(plan, tmp_path))


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_the_same_after_a_stop(tmp_path, number):
    (tmp_path / "rubber.nml").write_text(NAMELIST)
    words = [sys.executable, "-m", "asperity", "friction", ROAD, "--material", "rubber.nml",
             "--speeds", "1e-3:1:6", "--pressures", "2e5", "--cells", "48", "--patches", "4",
             "--jobs", "1", "-o", "curve.csv", "--folder", "runs"]
    process = subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.DEVNULL,
                               stderr=subprocess.PIPE, text=True)
    for line in process.stderr:
        if "1 of 4 done" in line:
            process.send_signal(number)
            break
    process.stderr.close()
    assert process.wait(PATIENCE) in (143, -number)
    assert not (tmp_path / "curve.csv").exists()
    time.sleep(1.0)  # a killed command does not end the run that it started
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "results are there already" in done.stderr
    stopped = (tmp_path / "curve.csv").read_text()
    subprocess.run([*words[:-1], "anew", "--quiet", "--overwrite"], cwd=tmp_path,
                   capture_output=True, check=True)
    assert (tmp_path / "curve.csv").read_text() == stopped


def test_without_resume_all_runs_are_made_again(tmp_path):
    plan = small_plan()
    whole = curve_of(plan, tmp_path)
    results = sorted(path for path in tmp_path.glob("*.h5") if "-p" in path.name)
    before = [path.stat().st_mtime_ns for path in results]
    again = run_curve(plan, tmp_path, Means(1, resume=False), quiet=True)
    assert all(path.stat().st_mtime_ns > one for path, one in zip(results, before, strict=True))
    same(whole, again)


def test_more_patches_do_not_repeat_runs_without_resume(tmp_path, capsys):
    plan = small_plan(speeds=[1e-2])
    wanted = 0.8 * curve_of(replace(plan, patches=8), tmp_path).largest_error
    capsys.readouterr()
    run_curve(plan, tmp_path, Means(2, resume=False), error=wanted)
    first, *later = re.findall("(\\d+) of (\\d+) results are there already",
                               "0 of 8 results are there already\n" + capsys.readouterr().err)
    assert first == ("0", "8") and later[0][0] == "8"


def test_a_damaged_patch_is_written_anew(tmp_path):
    plan = small_plan(speeds=[1e-2])
    friction = curve_of(plan, tmp_path).mean("friction")
    for damaged in tmp_path.glob("patch-*.h5"):
        damaged.write_bytes(damaged.read_bytes()[:2000])
    for result in tmp_path.glob("*-p*.h5"):
        result.unlink()
    np.testing.assert_array_equal(curve_of(plan, tmp_path).mean("friction"), friction)


def test_ctrl_c_ends_without_a_traceback(tmp_path):
    (tmp_path / "rubber.nml").write_text(NAMELIST)
    # A shell starts programs in the background with SIGINT ignored.
    process = subprocess.Popen(
        [sys.executable, "-m", "asperity", "friction", ROAD, "--material", "rubber.nml",
         "--speeds", "1e-3:1:6", "--cells", "48", "--patches", "4", "--jobs", "1"],
        cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler))
    said = ""
    for line in process.stderr:
        said += line
        if "1 of 4 done" in line:
            process.send_signal(signal.SIGINT)
    assert process.wait(PATIENCE) == 130
    assert "asperity: stopped by Ctrl-C: the same command continues from the results in" in said
    assert "Traceback" not in said


def test_ctrl_c_while_modules_are_loaded(monkeypatch, capsys):
    class Interrupted:
        @staticmethod
        def find_spec(name, path=None, target=None):
            if name == "asperity.commands.friction":
                raise KeyboardInterrupt

    monkeypatch.delitem(sys.modules, "asperity.commands.friction", raising=False)
    monkeypatch.setattr(sys, "meta_path", [Interrupted, *sys.meta_path])
    assert main(["friction", "--help"]) == 130
    assert "asperity: stopped by Ctrl-C" in capsys.readouterr().err


@pytest.mark.parametrize("size", [20_000, 60_000])
def test_files_that_are_too_large_end_with_status_3(tmp_path, size):
    """The first limit stops the map of a patch, which takes 35 kB, the second one a result."""
    (tmp_path / "rubber.nml").write_text(NAMELIST)
    done = subprocess.run(
        [sys.executable, "-m", "asperity", "friction", ROAD, "--material", "rubber.nml",
         "--speeds", "1e-3:1:6", "--cells", "64", "--patches", "1", "--quiet", "-o", "c.csv"],
        cwd=tmp_path, capture_output=True, text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size)))
    assert done.returncode == 3, done.stderr
    assert re.search(r"\.h5: cannot be written: .*(too large|cannot grow)", done.stderr)
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.glob("**/*.new*"))


@pytest.mark.parametrize("executor", [False, True])
def test_an_input_that_cannot_be_written_is_named(tmp_path, executor):
    patch = small_plan(patches=1).road.patch(0)
    patch.save(tmp_path)  # which is larger than the limit below
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    means = Means(None, executor=ThreadPoolExecutor(1)) if executor else Means(1)
    resource.setrlimit(resource.RLIMIT_FSIZE, (40, before[1]))
    try:
        with pytest.raises(OSError, match=rf"{patch.code}-p200000-T20-\w+\.nml: cannot be written"):
            run_curve(small_plan(patches=1), tmp_path, means, quiet=True)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert not list(tmp_path.glob("*.nml"))


SBATCH = """#!/bin/sh
# A stand-in for Slurm: notes the call, and runs the tasks of an array one after the other.
echo "$@" >> "{folder}/calls"
for word in "$@"; do
  case "$word" in --array=0-*) last=${{word#--array=0-}};; esac
  script=$word
done
task=0
while [ "$task" -le "$last" ]; do
  SLURM_ARRAY_TASK_ID=$task sh "$script" || exit 1
  task=$((task + 1))
done
echo "4711;cluster"
"""


def test_a_job_array_fills_the_folder(tmp_path, monkeypatch):
    tools = tmp_path / "tools"
    tools.mkdir()
    for name, text in (("sbatch", SBATCH.format(folder=tmp_path)), ("squeue", "#!/bin/sh\n")):
        (tools / name).write_text(text)
        (tools / name).chmod(stat.S_IRWXU)
    monkeypatch.setenv("PATH", f"{tools}{os.pathsep}{os.environ['PATH']}")
    plan = small_plan()
    summary = plan.summary(None)        # Slurm decides how many runs there are at a time
    assert "at a time" not in summary
    assert re.search(r"^time +about \d+ s of one processor in all$", summary, re.MULTILINE)
    assert re.search(r"^memory +about \d+ MB for each run$", summary, re.MULTILINE)
    limited = plan.summary(2, here=False)
    assert ", 2 at a time" in limited
    assert re.search(r"^memory +about \d+ MB for each run$", limited, re.MULTILINE)
    slurm = Means(None, slurm="--time=1:00:00 --partition='short jobs'")
    with pytest.raises(SubmittedError, match="2 runs submitted to Slurm as job 4711"):
        run_curve(plan, tmp_path / "runs", slurm, quiet=True)
    call = (tmp_path / "calls").read_text()
    assert "--array=0-1" in call and "--time=1:00:00" in call and "--partition=short jobs" in call
    assert json.loads((tmp_path / "runs" / "slurm.json").read_text())["job"] == "4711"
    gathered = run_curve(plan, tmp_path / "runs", slurm, quiet=True)
    assert (tmp_path / "calls").read_text() == call  # nothing was submitted a second time
    same(gathered, curve_of(plan, tmp_path / "here"))


@pytest.mark.slow
@pytest.mark.skipif(not HAS_SLURM, reason="no Slurm that this user may start")
def test_the_same_through_slurm(tmp_path):
    """The Slurm of this machine takes the job; the command waits for it and gathers the results."""
    plan = small_plan()
    with Slurm() as slurm:
        means = Means(None, slurm="--time=10 --partition=short")
        with pytest.raises(SubmittedError, match="2 runs submitted to Slurm as job"):
            run_curve(plan, tmp_path / "runs", means, quiet=True)
        slurm.drain()
        found = run_curve(plan, tmp_path / "runs", means, quiet=True)
    same(found, curve_of(plan, tmp_path / "alone"))


def test_jobs_in_the_queue_are_not_submitted_again(tmp_path, monkeypatch):
    for name, text in (("sbatch", "#!/bin/sh\necho x >> calls\necho 12\n"),
                       ("squeue", "#!/bin/sh\necho 12 PENDING\n")):
        (tmp_path / name).write_text(text)
        (tmp_path / name).chmod(stat.S_IRWXU)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.chdir(tmp_path)
    slurm = Means(None, slurm="")
    for word in ("submitted to Slurm as job 12", "in the queue of Slurm as job 12"):
        with pytest.raises(SubmittedError, match=word):
            run_curve(small_plan(), tmp_path / "runs", slurm, quiet=True)
    assert (tmp_path / "calls").read_text() == "x\n"


def test_the_plan_has_the_patches_that_an_error_begins_with(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.nml").write_text(NAMELIST)
    words = ["friction", ROAD, "--material", "r.nml", "--cells", "32", "--speeds", "1,2", "--plan"]
    assert main([*words, "--error", "0.1", "--patches", "4"]) == 0
    printed = capsys.readouterr().out
    assert ": 8 patches of" in printed and "16 steady states in 8 runs" in printed
    assert "up to 64 patches, until half of the 95 % interval of the friction is below 0.1" in (
        printed)
    assert main([*words, "--patches", "4"]) == 0
    printed = capsys.readouterr().out
    assert ": 4 patches of" in printed and "up to 64" not in printed


def test_more_patches_until_the_error_is_small(tmp_path):
    plan = small_plan(speeds=[1e-2], patches=2)
    assert len(curve_of(plan, tmp_path, error=1.0).patches) == 8  # fewer may agree by chance
    first = curve_of(replace(plan, patches=8), tmp_path)
    wanted = 0.8 * first.largest_error
    curve = curve_of(plan, tmp_path, error=wanted)
    assert curve.largest_error <= wanted and len(curve.patches) > 8
    few = curve_of(plan, tmp_path, error=1e-9, most_patches=3)
    assert len(few.patches) == 3
    assert any("3 patches are the most" in note for note in few.notes)


# ---- what is written -------------------------------------------------------------------------


@pytest.fixture(scope="module")
def curve(tmp_path_factory):
    plan = small_plan(temperatures=[20.0, 40.0], pressures=[1e5, 3e5], coefficient=0.3, patches=3)
    return curve_of(plan, tmp_path_factory.mktemp("curve"), jobs=2, extend=5e-5)


def test_table(curve, tmp_path):
    with curve.to_csv(tmp_path / "curve.csv").open() as file:
        rows = list(csv.reader(file))
    assert tuple(rows[0]) == COLUMNS == (
        "pressure", "temperature", "speed", "friction", "friction_low", "friction_high",
        "friction_viscous", "contact_area", "mean_gap", "friction_persson", "patches",
        "not_converged", "with_warnings")
    assert len(rows) == 1 + 2 * 2 * 3
    values = np.array(rows[1:], dtype=float)
    assert values[0, :3].tolist() == [1e5, 20.0, 1e-3]
    np.testing.assert_array_equal(values[:, 3], curve.values["friction"].mean(axis=3).ravel())
    assert (values[:, 4] < values[:, 3]).all() and (values[:, 3] < values[:, 5]).all()
    assert (values[:, 10] == 3).all()


def test_data_set_and_netcdf(curve, tmp_path):
    xarray = pytest.importorskip("xarray")
    found = curve.to_xarray()
    assert found["friction"].dims == ("pressure", "temperature", "speed", "patch")
    for name, variable in found.variables.items():
        if name != "patch":
            assert variable.attrs["units"] and variable.attrs["long_name"], name
    with xarray.open_dataset(curve.to_netcdf(tmp_path / "curve.nc")) as again:
        xarray.testing.assert_equal(again.load(), found)
        assert again["friction"].attrs == found["friction"].attrs
        assert float(again.attrs["coefficient"]) == 0.3
    assert float(found["friction_mean"].sel(pressure=1e5, temperature=20.0, speed=1e-3)) == (
        pytest.approx(curve.values["friction"][0, 0, 0].mean()))


def test_losses_are_the_power(curve, tmp_path):
    """By octaves and by arms the sum is the same; without friction it is the whole loss."""
    octave = curve.losses["loss_octave"].sum(axis=-1)
    np.testing.assert_allclose(octave, curve.losses["loss_arm"].sum(axis=-1), rtol=1e-9)
    power = (curve.values["friction_loss"].mean(axis=3) * curve.pressure[:, None, None]
             * curve.speed)
    np.testing.assert_allclose(octave, power, rtol=1e-9)
    # With friction, friction_viscous contains no loss of tangential waves, but the work of the
    # pressure that the tangential displacement moves along the slopes.
    curve = curve_of(small_plan(coefficient=0.0), tmp_path)
    octave = curve.losses["loss_octave"].sum(axis=-1)
    power = (curve.values["friction_viscous"].mean(axis=3) * curve.pressure[:, None, None]
             * curve.speed)
    np.testing.assert_allclose(octave, power, rtol=1e-9)


def test_contribution_of_waves_that_are_left_out(curve):
    """With the spectrum continued to shorter waves friction grows and Persson's area decreases."""
    assert (curve.theory["friction_left_out"] > 0.0).all()
    assert curve.settings["extended_to"] == 5e-5
    ratio = curve.values["contact_area"].mean(axis=3) / curve.theory["area_persson"]
    assert (ratio > 0.95).all() and (ratio < 1.9).all()


def test_picture(curve, tmp_path):
    names = ["friction coefficient", "friction by loss in the rubber", "contact area fraction"]
    single = of_first_pressure(curve).plot()
    assert [panel.get_ylabel() for panel in single.axes] == names
    title, conditions = single.get_suptitle().split("\n")
    assert title == curve.settings["title"]
    assert re.fullmatch(r"\d+ kPa, coefficient 0\.\d+ in the interface", conditions)
    # Two pressures and two temperatures: a row of panels for each pressure.
    figure = curve.plot()
    assert [panel.get_title() for panel in figure.axes] == [*names, "", "", ""]
    rows = [panel.get_ylabel() for panel in figure.axes]
    assert rows[0].endswith("Pa") and rows[3].endswith("Pa") and rows[0] != rows[3]
    assert not any(rows[1:3] + rows[4:])
    assert not any(panel.texts for panel in figure.axes)  # which could hide a point
    # The legend must be beside the panels, where it hides no curve.
    assert not any(panel.get_legend() for panel in figure.axes)
    figure.savefig(tmp_path / "curve.png")
    legend = figure.legends[0].get_window_extent()
    assert not any(panel.get_window_extent().overlaps(legend) for panel in figure.axes)
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts.count("95 % interval") == 1
    assert (tmp_path / "curve.png").stat().st_size > 20000


def of_first_pressure(curve):
    """Return a curve with the first pressure only."""
    return replace(curve, pressure=curve.pressure[:1], remarks=[], losses={}, sources={},
                   values={name: array[:1] for name, array in curve.values.items()},
                   theory={name: array[:1] for name, array in curve.theory.items()})


def test_wide_intervals_leave_the_curves_readable(curve):
    """The interval of two patches may be many times as wide as the curve."""
    wild = of_first_pressure(curve)
    for name in ("friction", "friction_loss", "contact_area"):
        wild.values[name] = wild.values[name] * np.geomspace(0.01, 2.0, len(curve.patches))
    theories = {"friction": "", "friction_loss": "friction_persson", "contact_area": "area_persson"}
    for panel, (name, theory) in zip(wild.plot().axes, theories.items(), strict=True):
        mean, low, high = wild.mean(name)
        most = max(mean.max(), wild.theory[theory].max() if theory else 0.0)
        bottom, top = panel.get_ylim()
        assert (low < 0.0).any() and high.max() > 2.2 * mean.max()
        assert 0.0 <= bottom < mean.min() and mean.max() < top < 2.2 * most


def test_a_picture_of_many_curves_has_a_colour_for_each_and_room_for_the_panels(curve):
    """With 12 pressures the palette would repeat, and the legend would leave no room for panels."""
    times = 12 // curve.pressure.size
    many = replace(curve, pressure=np.geomspace(1e4, 1e6, 12), losses={}, remarks=[], sources={},
                   values={name: np.concatenate([array] * times)
                           for name, array in curve.values.items()},
                   theory={name: np.concatenate([array] * times)
                           for name, array in curve.theory.items()})
    figure = many.plot()
    figure.canvas.draw()
    names = {text.get_text() for text in figure.legends[0].get_texts()}
    lines = [line for line in figure.axes[0].lines if line.get_label() in names]
    curves = [line for line in lines if "Pa" in str(line.get_label())]
    assert len({line.get_color() for line in curves}) == len(curves) == 12
    assert len(figure.axes) == 2 * 3
    heights = [panel.get_window_extent().height / figure.dpi for panel in figure.axes]
    assert min(heights) > 1.5
    legend = figure.legends[0].get_window_extent()
    assert not any(panel.get_window_extent().overlaps(legend) for panel in figure.axes)
    assert legend.y0 >= 0.0


def scattered(curve):
    """Return a curve in which the patches differ so much that intervals of the area go below 0."""
    area = curve.values["contact_area"].copy()
    area[0, 0, :2] *= np.linspace(0.1, 1.9, area.shape[-1])
    found = replace(curve, values={**curve.values, "contact_area": area})
    assert (found.mean("contact_area")[1] <= 0.0).sum() == 2
    return found


@pytest.mark.parametrize("decades", [0.2, 1, 3, 6, 12, 25])
def test_the_axis_of_the_area_has_labels_over_any_number_of_decades(curve, decades):
    area = np.geomspace(10.0**-decades, 1.0, curve.values["contact_area"].size)
    theory = {name: np.ones(array.shape) for name, array in curve.theory.items()}
    figure = replace(curve, theory=theory, values={
        **curve.values, "contact_area": area.reshape(curve.values["contact_area"].shape)}).plot()
    figure.canvas.draw()
    panel = figure.axes[-1]
    low, high = panel.get_ylim()
    labels = [text for text in panel.get_yticklabels()
              if text.get_text() and low <= text.get_position()[1] <= high]
    assert 3 <= len(labels) <= 14
    boxes = [label.get_window_extent() for label in labels]
    assert not any(one.overlaps(other) for one, other in zip(boxes, boxes[1:], strict=False))


def test_a_single_point_shows_its_interval_and_the_theory(curve):
    """It has no ribbon and no line: its interval is a bar, and the theory has a marker."""
    few = {name: array[:1, :1, :1] for name, array in curve.values.items()}
    theory = {name: array[:1, :1, :1] for name, array in curve.theory.items()}
    one = replace(curve, pressure=curve.pressure[:1], temperature=curve.temperature[:1],
                  speed=curve.speed[:1], values=few, theory=theory, remarks=[], losses={},
                  sources={})
    figure = one.plot()
    panel = figure.axes[1]
    (bar,) = panel.collections
    ((low, high),) = [segment[:, 1] for segment in bar.get_segments()]
    assert [low, high] == [end.item() for end in one.mean("friction_loss")[1:]]
    (persson,) = (line for line in panel.lines if line.get_marker() == "_")
    assert persson.get_ydata() == theory["friction_persson"].ravel()
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "runs", "95 % interval", "Persson's theory"]


def test_intervals_below_zero_reach_the_edge_of_a_logarithmic_axis(curve):
    panel = scattered(curve).plot().axes[2]  # of the first pressure
    bottom = panel.get_ylim()[0]
    lowest = [one.get_paths()[0].vertices[:, 1].min() for one in panel.collections]
    assert min(lowest) == bottom > 0.0
    assert all(low >= bottom for low in lowest)
    drawn = np.concatenate([scattered(curve).mean("contact_area")[0].ravel(),
                            curve.theory["area_persson"].ravel()])
    assert bottom == 0.5 * drawn.min()


@pytest.mark.skipif(BROWSER is None, reason="no Chromium with chromedriver")
def test_ribbons_on_the_page_continue_below_zero(curve, tmp_path):
    """On the logarithmic axis of the area the ribbon ended where an interval went below 0."""
    page = scattered(curve).to_html(tmp_path / "curve.html")
    with Browser(tmp_path) as browser:
        browser.open(page)
        paths = browser.run(
            "const area = [...document.querySelectorAll('#curves figure')].find((figure) =>"
            " figure.textContent.includes('Contact area')); return [...area.querySelectorAll("
            "'.ribbon')].map((path) => path.getAttribute('d'))")
        assert browser.console() == []
    axes = curve.pressure.size * curve.temperature.size
    assert len(paths) == axes and all(path.count("L") == 2 * curve.speed.size - 1
                                      for path in paths)


def test_the_settings_on_the_page_have_units(curve, tmp_path):
    text = curve.to_html(tmp_path / "curve.html").read_text(encoding="utf-8")
    found = dict(re.findall(r"<tr><th>([\w ]+)</th><td>(.*?)</td></tr>", text))
    assert found["lx"] == f"{curve.settings['lx']} m"
    assert found["shortest wave"].endswith(" m") and found["angle"].endswith("°")
    assert found["extended to"].endswith(" m") == (curve.settings["extended_to"] != "no")


@pytest.mark.skipif(BROWSER is None, reason="no Chromium with chromedriver")
def test_marks_on_the_page(curve, tmp_path):
    """Rings are around points with warnings, crosses where no patch has a value."""
    shape = curve.values["friction"].shape
    warned, lost = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    warned[0, 0, 0, 1] = True
    lost[1, 1, 2] = True
    values = {name: np.where(lost, np.nan, array) for name, array in curve.values.items()}
    remarks = [CurveRemark("the road wedges", lost, True), CurveRemark("few cells", warned)]
    page = replace(curve, values=values, remarks=remarks).to_html(tmp_path / "curve.html")
    with Browser(tmp_path) as browser:
        browser.window(1200, 900)
        browser.open(page)
        counts = ("return ['circle', 'path'].map((kind) =>"
                  " document.querySelectorAll(`#curves ${kind}.flag`).length)")
        assert browser.run(counts) == [6, 6]  # one in each chart
        texts, _ = browser.saved()
        assert sum("warnings" in text.splitlines()[0] and "[2]" in text for text in texts) == 6
        told = "return document.getElementById('point-warnings').textContent"
        assert browser.run(told) == ""
        browser.run("const place = document.getElementById('choose-speed'); place.value = '0';"
                    " place.dispatchEvent(new Event('change'))")
        assert browser.run(told) == "Warnings [2] concern this point."
        browser.run("document.querySelector('#curves button').click()")
        assert browser.console() == []


def six_temperatures(curve):
    """Return twelve curves over the speed: two pressures, six temperatures."""
    def more(array, axis):
        return np.repeat(array, 3, axis) * np.linspace(1.0, 1.5, 6).reshape(
            (-1, *(array.ndim - axis - 1) * (1,)))

    return replace(curve, temperature=np.linspace(20.0, 70.0, 6), a_t=more(curve.a_t, 0),
                   b_t=more(curve.b_t, 0), remarks=[], losses={}, sources={},
                   values={name: more(array, 1) for name, array in curve.values.items()},
                   theory={name: more(array, 1) for name, array in curve.theory.items()})


@pytest.mark.skipif(BROWSER is None, reason="no Chromium with chromedriver")
def test_many_curves_have_a_colour_each_on_the_page(curve, tmp_path):
    """The page repeated its seven colours from the eighth curve on."""
    many = six_temperatures(curve)
    wanted = distinct_colours(12)
    page = many.to_html(tmp_path / "curve.html")
    drawn = ("return [...document.querySelectorAll('#curves figure:first-child path.line')].map("
             "(path) => getComputedStyle(path).stroke.match(/\\d+/g).map((part) =>"
             " Number(part).toString(16).padStart(2, '0')).join(''))")
    against = ("const choice = document.getElementById('against'); choice.value = arguments[0];"
               " choice.dispatchEvent(new Event('change'))")
    with Browser(tmp_path) as browser:
        for dark in (False, True):
            browser.window(1200, 900, dark=dark)
            browser.open(page)
            colours = [f"#{colour}" for colour in browser.run(drawn)]
            assert len(set(colours)) == 12
            assert (colours == wanted) == (not dark)
            # Fewer curves have the colours of the palette.
            browser.run(against, "temperature")
            few = browser.run(drawn)
            assert len(few) == len(set(few)) == 2
        assert browser.console() == []


@pytest.mark.skipif(BROWSER is None, reason="no Chromium with chromedriver")
def test_page_in_a_browser(curve, tmp_path):
    page = curve.to_html(tmp_path / "curve.html")
    with Browser(tmp_path) as browser:
        browser.window(1200, 900)
        browser.open(page)
        assert browser.console() == []
        counted = browser.run("return [document.querySelectorAll('#curves figure').length,"
                              " document.querySelectorAll('#losses figure').length,"
                              " document.querySelectorAll('#map canvas').length]")
        assert counted == [6, len(curve.losses), 1]
        texts, pictures = browser.saved()
        assert len(texts) == len(pictures) == sum(counted)
        (field,) = (text for text in texts if text.startswith("x (m),y (m),Pressure"))
        x, y, pressure = np.loadtxt(field.splitlines(), delimiter=",", skiprows=1).T
        assert len(x) == len(set(zip(x, y, strict=True))) > 100
        assert pressure.min() >= 0.0 and pressure.max() > 2e5
        ribbons = browser.run("return document.querySelectorAll('.ribbon').length")
        assert ribbons >= 4
        before = browser.run("return document.querySelector('#map canvas').toDataURL()")
        assert "speed 10 mm/s" in browser.run(
            "return document.getElementById('point').textContent")
        browser.run("document.querySelector('#curves figure > svg').scrollIntoView("
                    "{block: 'center'})")
        left, top, width = browser.run(
            "const box = document.querySelector('#curves figure > svg').getBoundingClientRect();"
            " return [box.left, box.top, box.width]")
        place = (left + width - 16, top + 40)
        browser.drag(place, place)
        assert "speed 100 mm/s" in browser.run(
            "return document.getElementById('point').textContent")
        assert browser.run("return document.getElementById('choose-speed').value") == "2"
        assert browser.run("return document.querySelector('#map canvas').toDataURL()") != before
        for against in ("pressure", "temperature", "reduced", "speed"):
            browser.run("const choice = document.getElementById('against'); choice.value ="
                        " arguments[0]; choice.dispatchEvent(new Event('change'))", against)
            drawn = browser.run("return document.querySelectorAll('#curves figure:first-child"
                                " path.line').length")
            assert drawn == {"pressure": 2, "temperature": 2, "reduced": 4, "speed": 4}[against]
        browser.run("const choice = document.getElementById('choose-pressure'); choice.value = '1';"
                    " choice.dispatchEvent(new Event('change'))")
        assert browser.run("return document.querySelectorAll('#curves figure:first-child path.line'"
                           ").length") == 2
        assert browser.console() == []
        for size in ((390, 800), (1200, 900)):
            browser.window(*size, touch=size[0] < 500)
            wide = browser.run("return document.documentElement.scrollWidth")
            assert wide <= size[0] + 1
            # A number stays on one line: a narrow table scrolls sideways and breaks no words.
            lines = browser.run("return [...document.querySelectorAll('table.points tr')].map((row)"
                                " => row.getBoundingClientRect().height)")
            assert len(lines) == 13 and max(lines) < 40
            areas = browser.run("return [...document.querySelectorAll('#curves figure')].map("
                                "(figure) => [...figure.querySelectorAll('text[text-anchor=end]')]"
                                ".map((text) => text.textContent))")
            assert min(len(texts) for texts in areas) >= 2, areas


# ---- from files ------------------------------------------------------------------------------


def test_from_an_instrument_and_a_messy_table_to_numbers(tmp_path, monkeypatch, capsys):
    pytest.importorskip("SurfaceTopography")
    monkeypatch.chdir(tmp_path)
    road = asperity.surface.self_affine(
        128, lx=4e-3, wavelength_long=1e-3, wavelength_short=2.5e-4, rms_slope=0.15, seed=3)
    height = road + 1e-5 * np.linspace(0, 1, 128)  # the instrument was tilted
    height[40, 50] += 1e-3                               # a speck of dust
    text = "\n".join(";".join(f"{value * 1e6:.4f}".replace(".", ",") for value in row)
                     for row in height)
    (tmp_path / "plate.csv").write_text(text + "\n", encoding="latin-1")
    frequencies, celsius = np.logspace(-1, 2, 13), (0.0, 20.0, 40.0)
    lines = ["Probe: Lauffläche", ";".join(["", *(f"{t:g} °C;" for t in celsius)]),
             ";".join(["Frequenz (Hz)", *(["Speichermodul (MPa);Verlustmodul (MPa)"] * 3)])]
    for number, f in enumerate(frequencies):
        cells = [f"{f:.6g}"]
        for t in celsius:
            modulus = RUBBER.shifted(t, LAW).complex_modulus(2 * np.pi * f) / 1e6
            over = number == 12 and t == 0.0
            cells += ["OVL", ""] if over else [f"{modulus.real:.8g}", f"{modulus.imag:.8g}"]
        lines.append(";".join(cells).replace(".", ","))
    (tmp_path / "dma.csv").write_text("\n".join(lines) + "\n", encoding="latin-1")
    words = ["friction", "plate.csv", "--unit", "um", "--size", "4000", "4000", "--outliers",
             "remove", "--material", "dma.csv", "--speeds", "1e-3,1e-2", "--pressures", "2e5",
             "--temperatures", "20,30", "--cells", "48", "--patches", "9", "--quiet", "-o",
             "curve.csv", "-o", "curve.html"]
    assert main([*words, "--plan"]) == 0
    printed = capsys.readouterr().out
    assert "solves     16 steady states in 8 runs" in printed
    assert "the maps have room for 4 patches without overlap, not for 9" in printed
    assert "1 of 16384 cells lie far off their neighbours" in printed
    assert "1 of 39 points have no value" in printed
    kept = re.search(r"waves +(\S+) to \S+ m are kept of (\S+) to", printed)
    assert float(kept[1]) <= float(kept[2])
    assert main([*words, "--plan", "--temperatures", "20", "--speeds", "1e-3"]) == 0
    assert "1 speed x 1 pressure x 1 temperature\n" in capsys.readouterr().out
    # Where the columns of the table have to be named, the same option as in `fit` names them.
    assert main([*words, "--plan", "--column", "temperature=oven"]) == 2
    assert "temperature = 'oven'" in capsys.readouterr().err
    assert not (tmp_path / "curve_runs").exists()
    assert main(words) == 0
    printed = capsys.readouterr().out
    assert "of the load lies at the join" in printed
    with (tmp_path / "curve.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 4 and {row["patches"] for row in rows} == {"4"}
    # the files contain the same road and the same rubber
    exact = asperity.theory.persson(
        *asperity.theory.surface_psd(road, 4e-3), RUBBER.shifted(30.0, LAW), 2e5, 1e-2,
        gamma=0.45)
    found = next(row for row in rows if row["temperature"] == "30.0" and row["speed"] == "0.01")
    assert float(found["friction_persson"]) == pytest.approx(float(exact.friction), rel=0.25)
    assert float(found["friction"]) == pytest.approx(float(found["friction_persson"]), rel=0.35)


def test_a_periodic_map_is_the_road_as_it_is(tmp_path):
    """Without its best plane a periodic map would jump at its edges; other maps lose the plane."""
    pytest.importorskip("SurfaceTopography")
    height = asperity.surface.self_affine(48, lx=1e-3, wavelength_long=4e-4, wavelength_short=2e-4,
                                          rms_slope=0.1, seed=5)
    height += 2e-5 * np.sin(2 * np.pi * np.arange(48) / 48)
    for boundary in ("periodic", "free"):
        asperity.surface.save(tmp_path / f"{boundary}.h5", height, 1e-3, boundary=boundary)
    made = road_of([tmp_path / "periodic.h5"], cells=48)
    assert made.join == "none"
    np.testing.assert_allclose(made.patch(0).height, height - height.mean(), atol=1e-12)
    assert road_of([tmp_path / "periodic.h5"], cells=48, level="tilt").join == "seam"
    kinds = {boundary: [step["kind"] for step in _road_source(tmp_path / f"{boundary}.h5", {}).steps
                        if step["step"] == "level"] for boundary in ("periodic", "free")}
    assert kinds == {"periodic": ["mean"], "free": ["tilt"]}


def test_the_measured_band_of_the_rubber():
    rubber = replace(COMPOUND, valid_range=(1.0, 1e4))
    low, high = rubber.speeds_within(20.0, 1e-4, 1e-3)
    assert low == pytest.approx(1e-3 / (2 * np.pi)) and high == pytest.approx(1.0 / (2 * np.pi))
    factor = float(LAW.shift_factor(40.0))
    assert rubber.speeds_within(40.0, 1e-4, 1e-3)[1] == pytest.approx(high / factor)
    plan = plan_curve(road_of([ROAD], cells=32), rubber, speeds=[1e-5, 1e-2, 10.0],
                      pressures=[1e5])
    assert sum("the measured frequencies" in note for note in plan.notes) == 2


def test_rubber_of_several_kinds(tmp_path):
    (tmp_path / "rubber.nml").write_text("! tread\n" + NAMELIST)
    found = compound_of(tmp_path / "rubber.nml")
    assert found.series == RUBBER and found.wlf == LAW and found.temperature == 20.0
    (tmp_path / "zener.nml").write_text(
        "&material shear_modulus = 1e6, zener_g0 = 2e6, zener_g1 = 3e6, zener_eta = 1e3,"
        " temperature = 40, wlf_c1 = 8, wlf_c2 = 120 /\n")
    found = compound_of(tmp_path / "zener.nml")
    assert found.series == Prony.from_zener(1e6, [2e6], [3e6], [1e3])
    assert found.temperature == 40.0 and found.reference == 20.0
    shifted = Compound(RUBBER, 20.0, shifts={0.0: 2.0, 20.0: 0.0, 40.0: -1.0})
    assert shifted.a_t(10.0) == pytest.approx(10.0)
    with pytest.raises(ValueError, match="gives a_T from 0 to 40 C only"):
        shifted.a_t(50.0)
    with pytest.raises(ValueError, match="gives no a_T"):
        Compound(RUBBER, 20.0).a_t(30.0)


@pytest.mark.parametrize("words, message", [
    (["self_affine:hurst=0.8", "--material", "r.nml"], "lacks wavelength_long"),
    (["self_afine:hurst=0.8", "--material", "r.nml"], "did you mean self_affine:?"),
    (["spectrum:", "--material", "r.nml"], "spectrum: names no file: must be spectrum:FILE"),
    (["self_affine:hurts=0.8", "--material", "r.nml"], "NAME one of hurst"),
    ([ROAD.replace("long=1e-3", "long=1e-4"), "--material", "r.nml"],
     "self_affine: wavelength_long = 0.0001: must be > wavelength_short = 0.00025"),
    ([ROAD.replace("long=1e-3", "long=-1e-3"), "--material", "r.nml"],
     "self_affine: wavelength_long = -0.001: must be > wavelength_short"),
    ([ROAD + ",wavelength_rolloff=2e-3", "--material", "r.nml"],
     "self_affine: wavelength_rolloff = 0.002: must be from wavelength_short = 0.00025 to"),
    ([ROAD.replace("hurst=0.8", "hurst=2"), "--material", "r.nml"], "self_affine: hurst = 2.0"),
    ([ROAD + ",hurst=0.7", "--material", "r.nml"], "self_affine: hurst is given twice"),
    ([ROAD, "--material", "r.nml", "--speeds", "1,1"], "speeds: 1 is given twice"),
    ([ROAD, "--material", "r.nml", "--pressures=-1"], "pressures"),
    ([ROAD, "--material", "r.nml", "--patches", "0"], "patches = 0"),
    ([ROAD, "--material", "r.nml", "--temperatures=-200"], "temperature = -200"),
    ([ROAD, "--material", "r.nml", "--join", "blend"], "join: is for patches"),
    ([ROAD, "--material", "r.nml", "-o", "curve.txt"], "must end in .html"),
    ([ROAD, "--material", "r.nml", "--jobs", "0"], "jobs = 0"),
    ([ROAD, "--material", "r.nml", "--pressures", "-1e5"], "pressures[0] = -100000.0"),
    ([ROAD, "--material", "r.nml", "--coefficient", "1e300"],
     "coefficient = 1e+300: must be a finite number >= 0 and <= 1000"),
    ([ROAD, "--material", "r.nml", "--speeds", "1,1e200"],
     "speeds: 1e+200 m/s: must be from 1e-30 to 1e+30 m/s"),
    ([ROAD, "--material", "r.nml", "--speeds", "1e-200"], "speeds: 1e-200 m/s: must be from"),
    ([ROAD, "--material", "r.nml", "--pressures", "1e200"], "pressures: 1e+200 Pa: must be from"),
    ([ROAD, "--material", "r.nml", "--speeds", "-1,2"], "speeds[0] = -1.0"),
    ([ROAD, "--material", "r.nml", "--temperatures", "-99"], "temperature = -99: a_T = inf by"),
    ([ROAD, "--material", "r.nml", "--seed", "-3"], "seed = -3: must be an integer from 0"),
    ([ROAD, "--material", "r.nml", "--wlf", "8", "120"], "wlf (--wlf): is for DMA tables only"),
    ([ROAD, "--material", "r.nml", "--temperature-tolerance", "1"], "is for DMA tables only"),
    ([ROAD, "--material", "r.nml", "--column", "storage=2"], "--column): is for DMA tables"),
    ([ROAD, "--material", "r.nml", "--unit", "um"], "unit: only for roads that are files"),
    ([ROAD, "--material", "r.nml", "--size", "1", "2"], "size: only for roads that are files"),
    ([ROAD, "--material", "r.nml", "--outliers", "remove"],
     "outliers: is for measured maps and profiles only"),
    ([ROAD, "--material", "r.nml", "--side", "1e-2", "--short", "1e-4"],
     "short = 0.00025: must be at least two"),
    ([ROAD, "--material", "r.nml", "--short", "20"],
     "short = 20: must be below the side of a patch, 0.002 m: longer waves leave it flat"),
    ([ROAD, ROAD, "--material", "r.nml"], "is given twice"),
    ([ROAD, "--material", "r.nml", "--extend", "1"],
     "extend = 1: must be shorter than the shortest wave of the spectrum of the road, 0.00025 m"),
    ([ROAD, "--material", "r.nml", "--extend", "-1"], "extend = -1"),
    ([ROAD, "--material", "r.nml", "--error", "0", "--plan"], "error = 0"),
    ([ROAD, "--material", "r.nml", "--slope"],
     "slope_effect (--slope): needs a coefficient (--coefficient) above 0"),
    ([ROAD, "--material", "r.nml", "--side", "1e-5"], "that are wanted, at most 1e-05 m"),
])
def test_wrong_arguments(tmp_path, monkeypatch, capsys, words, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.nml").write_text(NAMELIST)
    assert main(["friction", *words, "--cells", "32"]) == 2
    assert message in capsys.readouterr().err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["r.nml"]


@pytest.mark.parametrize(("height", "message"), [
    (np.zeros((48, 48)), "road.h5: is flat: must have roughness"),
    (np.random.default_rng(1).normal(0.0, 1e-6, (12, 14)), "road.h5: is too small for a spectrum"),
    (np.random.default_rng(1).normal(0.0, 1e-6, (20, 20)), "road.h5: is too small for a spectrum"),
])
def test_roads_that_are_refused(tmp_path, monkeypatch, capsys, height, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.nml").write_text(NAMELIST)
    asperity.surface.save("road.h5", height, 1e-3, 1e-3)
    assert main(["friction", "road.h5", "--material", "r.nml", "--cells", "16"]) == 2
    assert message in capsys.readouterr().err


def test_notes_are_printed_once(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.nml").write_text(NAMELIST)
    height = asperity.surface.self_affine(96, lx=1e-3, wavelength_long=2e-4, wavelength_short=8e-5,
                                          rms_slope=0.1, seed=3)
    asperity.surface.save("a.h5", height, 1e-3, boundary="free")
    assert main(["friction", "a.h5", "--material", "r.nml", "--cells", "32", "--speeds", "1",
                 "--quiet", "-o", "c.csv"]) == 0
    printed = capsys.readouterr().out
    for note in ("the maps have room for 4 patches", "its own footprint", "lies at the join"):
        assert printed.count(note) == 1, note


def test_only_outputs_of_the_same_plan_are_replaced(tmp_path, monkeypatch, capsys):
    """An output of another plan, or of somebody else, is refused before anything is run."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.nml").write_text(NAMELIST)
    words = ["friction", ROAD, "--material", "r.nml", "--cells", "32", "--patches", "1", "--quiet",
             "--speeds", "1", "-o", "c.csv", "-o", "c.html"]
    assert main(words) == 0
    first = (tmp_path / "c.csv").read_text()
    assert main(words) == 0  # the same plan replaces its own files
    runs = sorted((tmp_path / "c_runs").iterdir())
    capsys.readouterr()

    other = [*words, "--pressures", "1e5"]
    assert main(other) == 3
    assert "c.csv: is the curve of another plan: --overwrite" in capsys.readouterr().err
    assert main([*words, "--folder", "others"]) == 3
    assert "others has no record that `asperity friction` wrote it" in capsys.readouterr().err
    assert not (tmp_path / "others").exists() and sorted((tmp_path / "c_runs").iterdir()) == runs
    assert main([*other, "--plan"]) == 0  # writes nothing
    assert (tmp_path / "c.csv").read_text() == first

    (tmp_path / "c.csv").write_text(first + "my own note\n")
    assert main(words) == 3
    assert "wrote it as it is now" in capsys.readouterr().err
    assert (tmp_path / "c.csv").read_text() == first + "my own note\n"
    assert main([*other, "--overwrite"]) == 0
    assert (tmp_path / "c.csv").read_text().splitlines()[1].startswith("100000.0,")
    assert main(other) == 0
    assert not [path for path in tmp_path.iterdir() if ".new" in path.name]


def test_outputs_never_replace_an_input(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.csv").write_text(NAMELIST)
    assert main(["friction", ROAD, "--material", "r.csv", "-o", "r.csv", "--overwrite"]) == 2
    assert "--output r.csv: is an input: name another file" in capsys.readouterr().err
    (tmp_path / "c.html").mkdir()
    assert main(["friction", ROAD, "--material", "r.csv", "-o", "c.html", "--overwrite"]) == 3
    assert "c.html: is a folder: name a file in it" in capsys.readouterr().err


def test_a_full_disk_leaves_the_file_of_before(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.nml").write_text(NAMELIST)
    words = ["friction", ROAD, "--material", "r.nml", "--cells", "32", "--patches", "1", "--quiet",
             "--speeds", "1", "-o", "c.csv"]
    assert main(words) == 0
    before = (tmp_path / "c.csv").read_text()

    def full(self, path):
        path.write_text("half of")
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr("asperity.results.friction_curve.FrictionCurve.to_csv", full)
    capsys.readouterr()
    assert main(words) == 3
    assert "asperity: c.csv: cannot be written: No space left on" in capsys.readouterr().err
    assert (tmp_path / "c.csv").read_text() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["c.csv", "c_runs", "r.nml"]


def test_lists_may_begin_with_a_minus(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.nml").write_text(NAMELIST)
    words = [ROAD, "--material", "r.nml", "--cells", "32", "--plan"]
    assert main(["friction", *words, "--temperatures", "-10,20"]) == 0
    assert "2 temperatures" in capsys.readouterr().out
    assert main(["friction", *words, "--angle", "-1e1"]) == 0


@pytest.mark.parametrize(("option", "given", "expected"), [
    ("speeds", "1e-3:1:4", [1e-3, 1e-2, 1e-1, 1.0]),
    ("pressures", "1e5:4e5:3", [1e5, 2e5, 4e5]),
    ("temperatures", "20:80:4", [20.0, 40.0, 60.0, 80.0]),
    ("temperatures", "-20:80:5", [-20.0, 5.0, 30.0, 55.0, 80.0]),
    ("temperatures", "-0.1:0.2:4", [-0.1, 0.0, 0.1, 0.2]),
    ("temperatures", "-30:-10:2", [-30.0, -10.0]),
])
def test_ranges_have_equal_ratios_but_those_of_temperatures_equal_steps(
        tmp_path, monkeypatch, option, given, expected):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.nml").write_text(NAMELIST)
    found = []
    monkeypatch.setattr(CurvePlan, "summary", lambda plan, *_, **__: found.append(plan) or "")
    assert main(["friction", ROAD, "--material", "r.nml", "--cells", "32", "--plan",
                 f"--{option}", given]) == 0
    assert getattr(found[0], option.removesuffix("s")).tolist() == expected


@pytest.mark.parametrize(("option", "given", "ends"), [
    ("speeds", "0:1:3", "0 < FIRST < LAST"), ("speeds", "1:inf:3", "0 < FIRST < LAST"),
    ("temperatures", "80:20:3", "with FIRST < LAST"), ("temperatures", "0:20:1", "COUNT of at"),
    ("temperatures", "-inf:20:3", "with FIRST < LAST"),
])
def test_ranges_that_are_refused(capsys, option, given, ends):
    with pytest.raises(SystemExit) as error:
        main(["friction", ROAD, "--material", "r.nml", f"--{option}={given}"])
    assert error.value.code == 2
    assert ends in capsys.readouterr().err


def test_too_little_memory_is_no_traceback(tmp_path, monkeypatch, capsys):
    def without_memory(*_, **__):
        raise MemoryError("Unable to allocate 74.5 GiB")

    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.nml").write_text(NAMELIST)
    monkeypatch.setattr("asperity.roads.spectra.Spectrum.draw", without_memory)
    assert main(["friction", ROAD, "--material", "r.nml", "--plan"]) == 4
    assert capsys.readouterr().err == "asperity: not enough memory: Unable to allocate 74.5 GiB\n"


def test_a_file_cannot_be_the_folder(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.nml").write_text(NAMELIST)
    assert main(["friction", ROAD, "--material", "r.nml", "--cells", "32", "--speeds", "1",
                 "--folder", "r.nml"]) == 3
    assert "r.nml: is a file: the runs need a folder" in capsys.readouterr().err


@pytest.mark.parametrize("heads", ["x (mm),z (um)", "# x (mm) z (um)"])
def test_a_profile_makes_a_road(tmp_path, monkeypatch, capsys, heads):
    """A line scan in x, z columns, which is not periodic; its heading names the units."""
    pytest.importorskip("SurfaceTopography")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.nml").write_text(NAMELIST)
    height = 1e-5 * np.cos(2 * np.pi * np.arange(1000) / 100)
    height += 1e-7 * np.random.default_rng(1).standard_normal(1000)
    np.savetxt("profile.txt", np.column_stack([1e-2 * np.arange(1000), 1e6 * height]),
               header=heads, comments="", delimiter="," if "," in heads else " ")
    found = road_of(["profile.txt"], cells=32).whole_spectrum
    assert found.wavenumber[np.argmax(found.psd)] == pytest.approx(2 * np.pi / 1e-3, rel=0.1)
    assert main(["friction", "profile.txt", "--material", "r.nml", "--cells", "32", "--plan"]) == 0
    assert "profile.txt: 8 patches" in capsys.readouterr().out
    with pytest.raises(ValueError, match="has its own unit, 'um'"):
        road_of(["profile.txt"], unit="mm")


@pytest.mark.parametrize("heads", [
    "q (rad/um), Phi (um4)", "q [µm^-1]; Phi (µm⁴)", "# q (1/um), C(q) (um^4)", "q 1/um\tC um4"])
def test_headings_of_a_spectrum_name_units(tmp_path, heads):
    k = np.geomspace(1e3, 1e5, 9)
    psd = 1e-17 * (k / 1e4) ** -3.6
    shown = psd * 1e24 / (4 * np.pi**2 if "C" in heads else 1.0)
    mark = next(mark for mark in (";", "\t", ",") if mark in heads)
    (tmp_path / "s.csv").write_text("\n".join(
        [heads, *(f"{a!r}{mark}{b!r}" for a, b in zip((1e-6 * k).tolist(), shown.tolist(),
                                                      strict=True))]), encoding="utf-8")
    found = road_of([f"spectrum:{tmp_path / 's.csv'}"], cells=64).whole_spectrum
    np.testing.assert_allclose(found.wavenumber, k, rtol=1e-12)
    np.testing.assert_allclose(found.psd, psd, rtol=1e-12)
    symbol = "C" if "C" in heads else "Phi"
    assert found.notes[0] == (
        f"s.csv: the wave number is read in rad/um, the density as {symbol} in um4")


def test_persson_density_of_a_profile(tmp_path):
    """C1D = Phi1/(2 pi) in the convention in which C = Phi/(4 pi^2)."""
    k = np.geomspace(1e3, 1e5, 9)
    found = []
    for head, factor in (("Phi1 (m3)", 1.0), ("C1D (m3)", 2.0 * np.pi), ("C(q) m^3", 2.0 * np.pi),
                         ("C1 (m3)", 2.0 * np.pi)):
        table = np.column_stack([k, 1e-13 * (k / 1e4) ** -2.6 / factor])
        np.savetxt(tmp_path / "s.csv", table, header=f"q (rad/m), {head}", comments="",
                   delimiter=",")
        found.append(road_of([f"spectrum:{tmp_path / 's.csv'}"], cells=64).whole_spectrum.psd)
    np.testing.assert_allclose(found[1:], [found[0]] * 3, rtol=1e-9)


def test_the_plan_says_how_a_spectrum_is_read(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.nml").write_text(NAMELIST)
    (tmp_path / "s.csv").write_text("1e3,1e-15\n3e3,1e-16\n1e5,1e-21\n")
    assert main(["friction", "spectrum:s.csv", "--material", "r.nml", "--cells", "32",
                 "--plan"]) == 0
    assert ("note       s.csv: the wave number is read in rad/m, the density as Phi in m4\n"
            in capsys.readouterr().out)


@pytest.mark.parametrize(("head", "message"), [
    ("wavelength (m), Phi (m4)", "must be the wave number"),
    ("f (1/m), Phi (m4)", "column 1 is 'f (1/m)': must be the wave number, in rad/m"),
    ("q (cycles/m), Phi (m4)", "has the unit 'cycles/m'"),
    ("q (rad/m), PSD (dB)", "has the unit 'dB'")])
def test_spectra_that_are_refused(tmp_path, head, message):
    (tmp_path / "s.csv").write_text(f"{head}\n1e3,1e-16\n1e4,1e-18\n")
    with pytest.raises(ValueError, match=re.escape(message)):
        road_of([f"spectrum:{tmp_path / 's.csv'}"])


def test_options_count_for_all_roads_and_no_road_counts_twice(tmp_path):
    height = asperity.surface.self_affine(96, lx=1e-3, wavelength_long=2e-4, wavelength_short=8e-5,
                                          rms_slope=0.1, seed=3) + np.linspace(0.0, 1e-5, 96)
    for name, sign in (("a.h5", 1.0), ("b.h5", -1.0), ("c.h5", 1.0)):
        asperity.surface.save(tmp_path / name, sign * height, 1e-3, boundary="free")
    files = [tmp_path / "a.h5", tmp_path / "b.h5"]
    road = road_of(files, cells=32, level="none", join="mirror")
    first, second = (one.height for one in road._maps)
    np.testing.assert_array_equal(first, -second)
    with pytest.raises(ValueError, match=r"a\.h5 is given twice"):
        road_of([files[0], str(files[0])], cells=32)
    with pytest.raises(ValueError, match=r"^c\.h5: has the heights of another map"):
        road_of([*files, tmp_path / "c.h5"], cells=32)
    with pytest.raises(ValueError, match="roads: is of the type ndarray"):
        road_of([height], cells=32)


def test_outliers_are_removed_from_maps_whose_spectrum_is_drawn(tmp_path):
    height = asperity.surface.self_affine(96, lx=1e-3, wavelength_long=2e-4, wavelength_short=8e-5,
                                          rms_slope=0.1, seed=3)
    asperity.surface.save(tmp_path / "good.h5", height, 1e-3)
    height[20, 30] += 1e-3
    asperity.surface.save(tmp_path / "dust.h5", height, 1e-3)
    good = road_of([tmp_path / "good.h5"], draw=True, cells=32)
    mended = road_of([tmp_path / "dust.h5"], draw=True, cells=32, outliers="remove")
    k = np.geomspace(2 * np.pi / 1.8e-4, 2 * np.pi / 9e-5, 20)
    np.testing.assert_allclose(mended.whole_spectrum.at(k), good.whole_spectrum.at(k), rtol=0.05)
    assert any("replaced by the median" in note for note in mended.notes)
    reported = road_of([tmp_path / "dust.h5"], draw=True, cells=32)
    assert any("1 of 9216 cells lie far off" in note for note in reported.notes), reported.notes


def test_each_road_may_have_its_own_unit_and_size(tmp_path, monkeypatch, capsys):
    """Two instruments measured one plate: one writes micrometres, the other one millimetres."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.nml").write_text(NAMELIST)
    height = asperity.surface.self_affine(96, lx=1e-3, wavelength_long=2e-4, wavelength_short=8e-5,
                                          rms_slope=0.1, seed=3)
    np.savetxt("a.txt", 1e6 * height)
    np.savetxt("b.txt", 1e3 * height[:64])
    asperity.surface.save("c.h5", -height, 1e-3, boundary="free")
    own = ["a.txt:unit=um,size=1000x1000", "b.txt:unit=mm,size=1x0.6666666667", "c.h5"]
    first, second, third = road_of(own, cells=32)._maps
    np.testing.assert_allclose(first.height, -third.height, rtol=1e-9, atol=1e-18)
    np.savetxt("d.txt", 1e3 * height)
    with pytest.raises(ValueError, match=r"^d\.txt: has the heights of another map"):
        road_of([own[0], "d.txt:unit=mm,size=1x1"], cells=32)
    assert (first.lx, first.ly) == (1e-3, 1e-3)
    assert second.lx == 1e-3 and second.height.std() == pytest.approx(
        first.height[:64].std(), rel=0.2)
    one, *_ = road_of(["a.txt:size=1000x1000", "b.txt:size=1x0.67,unit=mm"], cells=32,
                      unit="um")._maps
    assert one.lx == 1e-3
    turned, whole = road_of(["b.txt:unit=mm,size=0.6666666667x1,transpose=yes",
                             "a.txt:unit=um,size=1000x1000,periodic=as-is"], cells=32)._maps
    np.testing.assert_allclose(turned.height, second.height.T, rtol=1e-9, atol=1e-18)
    assert whole.periodic and not first.periodic

    for words, message in (
            (["a.txt", "b.txt"], "names no unit and gives no lengths: .*; unit and size .* count"),
            (["a.txt:size=1000x1000", "c.h5", "--unit", "um"],
             "unit = 'um': c.h5 has its own unit, 'm'.* give a road its own, as ROAD:unit=um"),
            (["a.txt:units=um"], "'units=um': must be NAME=VALUE, NAME one of unit, size, channel"),
            (["a.txt:transpose=1"], "transpose = '1': must be yes or no"),
            (["a.txt:periodic=hann"], "periodic = 'hann': must be as-is, for a map whose opposite"),
            (["a.txt:unit=um,size=1000"], "size: has 1 length, must have 2"),
            (["a.txt:unit=um,size=axb"], "size = 'axb': must be two lengths, as 4000x3000"),
            ([own[0], "a.txt:unit=um,size=10x10"], "a.txt:unit=um,size=10x10 is given twice")):
        assert main(["friction", *words, "--material", "r.nml", "--cells", "32", "--plan"]) == 2
        assert re.search(message, capsys.readouterr().err), message
    assert main(["friction", *own, "--material", "r.nml", "--cells", "32", "-o", "a.txt"]) == 2
    assert main(["friction", *own, "--material", "r.nml", "--cells", "32", "--plan"]) == 0
    printed = capsys.readouterr().out
    assert "maps       a.txt: 96 x 96 cells, 0.001 x 0.001 m\n" in printed
    assert "           b.txt: 96 x 64 cells, 0.001 x 0.0006667 m\n" in printed
    assert "           c.h5: 96 x 96 cells, 0.001 x 0.001 m\n" in printed


def test_outliers_of_profiles(tmp_path, monkeypatch, capsys):
    """They raise the spectrum at all waves; the ends of a slope are none."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.nml").write_text(NAMELIST)
    height = asperity.surface.self_affine(512, 1, lx=1e-3, wavelength_long=2e-4, hurst=0.8,
                                          wavelength_short=1e-5, rms_slope=0.1, seed=3)
    height = height + np.linspace(0.0, 1e-4, 512)
    asperity.surface.save("good.h5", height, 1e-3, boundary="free")
    for place, error in ((0, 2e-4), (100, 1e-4), (300, -1e-4), (301, -8e-5), (510, 2e-4),
                         (511, 2e-4)):
        height[0, place] += error
    asperity.surface.save("dust.h5", height, 1e-3, boundary="free")
    good, dust = road_of(["good.h5"], cells=32), road_of(["dust.h5"], cells=32)
    mended = road_of(["dust.h5"], cells=32, outliers="remove")
    assert not any("far off" in note for note in good.notes)
    k = np.geomspace(2 * np.pi / 1e-4, 2 * np.pi / 3e-5, 20)
    assert (dust.whole_spectrum.at(k) > 4.0 * good.whole_spectrum.at(k)).any()
    np.testing.assert_allclose(mended.whole_spectrum.at(k), good.whole_spectrum.at(k), rtol=0.15)
    assert main(["friction", "dust.h5", "--material", "r.nml", "--cells", "32", "--plan"]) == 0
    assert "dust.h5: 6 of 512 points lie far off their neighbours" in capsys.readouterr().out
    assert main(["friction", "dust.h5", "--material", "r.nml", "--cells", "32", "--plan",
                 "--outliers", "remove"]) == 0
    assert "usual: replaced by the median of the neighbours" in capsys.readouterr().out


def test_waves_that_are_left_out_are_noted():
    """On few cells most of the friction may be in waves that the patches do not contain."""
    friction = np.array([0.1, 0.01, np.nan]).reshape(1, 1, 3)
    left_out = np.array([0.02, 0.03, 0.5]).reshape(1, 1, 3)
    (note,) = _left_out_note(friction, left_out)
    assert "would add up to 0.03 to the friction, where it is 0.01" in note
    assert not _left_out_note(friction, 0.1 * left_out)


def test_small_friction_keeps_its_digits():
    assert [_rounded(value) for value in (0.12346, -0.0, 3.25e-5, -0.00096)] == [
        "0.1235", "0.0000", "3.2e-05", "-9.6e-04"]


def test_smooth_profiles_have_no_outliers():
    """No end of a slope, no summit and no edge of a wide groove counts as one."""
    for cells in (2, 4, 8, 32):
        rows = asperity.surface.self_affine(512, lx=1.0, wavelength_long=0.25, rms_slope=0.3,
                                            wavelength_short=cells / 512, hurst=0.5, seed=1)
        assert not any(find_outliers(row[None]).count for row in rows[::8])
    random = np.random.default_rng(1)
    assert not find_outliers(random.laplace(size=(1, 5000))).count
    grooves = np.where(np.arange(2000) % 50 < 3, -1e-3, 0.0) + 1e-6 * random.standard_normal(2000)
    assert not find_outliers(grooves[None]).count


def test_missing_points_are_noted(tmp_path):
    """They are filled when a map is read, and the plan reports how many."""
    height = asperity.surface.self_affine(64, lx=1e-3, wavelength_long=5e-4, wavelength_short=1e-4,
                                          rms_slope=0.1, seed=3)
    np.savetxt(tmp_path / "road.txt", np.where(np.arange(64) == 9, np.nan, height))
    road = road_of([tmp_path / "road.txt"], cells=32, unit="m", size=(1e-3, 1e-3))
    assert any("filled 64 of 4096 points" in note for note in road.notes)


@pytest.mark.parametrize(("material", "words", "message"), [
    ("&material prony_g = 1e6, prony_tau = 1 /", [], "shear_modulus = 0"),
    ("&material shear_modulus = 1e6 /", ["--temperatures", "20,60"], "r.nml gives no a_T"),
    ("&grid nx = 4 /", [], "r.nml: has no moduli"),
    ("&material shear_modulus = 1e6, prony_g = 1e6, 2e6, prony_tau = 1e-3 /", [],
     "r.nml: &material: tau"),
])
def test_rubbers_that_are_refused(tmp_path, monkeypatch, capsys, material, words, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.nml").write_text(material)
    assert main(["friction", ROAD, "--material", "r.nml", "--cells", "32", *words]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(("roads", "material", "cells", "message"), [
    ([], RUBBER, 32, "roads: none given: must be at least one"),
    (ROAD, 3, 32, "material = 3: must be the name of a file, a Prony or a Compound"),
    (ROAD, None, 32, "material = None: must be the name of a file"),
    (3, RUBBER, 32, "roads: is of the type int: must be the name of a file"),
    (ROAD, RUBBER, 1, "cells = 1: must be more than 16 for a side of 0.002 m"),
    (ROAD, RUBBER, 0, "cells = 0: must be a positive integer")])
def test_wrong_arguments_in_python(tmp_path, roads, material, cells, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        asperity.friction_curve(roads, material, speeds=[1.0], pressures=[1e5], cells=cells,
                                folder=tmp_path / "runs")


def test_python_gives_a_data_set(tmp_path):
    pytest.importorskip("xarray")
    found = asperity.friction_curve(
        ROAD, RUBBER, speeds=[1e-2, 1e-1], pressures=[2e5], cells=32, patches=2, quiet=True,
        folder=tmp_path, jobs=1)
    assert dict(found.sizes)["speed"] == 2 and dict(found.sizes)["patch"] == 2
    assert float(found["friction"].min()) > 0.0
    assert bool(np.isnan(found["temperature"].values).all())


def test_a_fitted_namelist_keeps_the_vertical_shifts(tmp_path):
    fit = "! shifts (log10 a_T): 20 C +0.000, 40 C -1.000\n" \
          "! vertical shifts (log10 b_T): 20 C +0.000, 40 C +0.030\n"
    (tmp_path / "r.nml").write_text(fit + NAMELIST)
    rubber = compound_of(tmp_path / "r.nml")
    assert rubber.b_t(40.0) == pytest.approx(10**0.03)


def test_the_same_heights_do_not_count_twice_in_a_spectrum(tmp_path):
    height = asperity.surface.self_affine(96, lx=1e-3, wavelength_long=2e-4, wavelength_short=8e-5,
                                          rms_slope=0.1, seed=3)
    for name in ("a.h5", "b.h5"):
        asperity.surface.save(tmp_path / name, height, 1e-3)
    with pytest.raises(ValueError, match=r"b\.h5: has the heights of another road"):
        road_of([tmp_path / "a.h5", tmp_path / "b.h5"], draw=True)
