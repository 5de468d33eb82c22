"""Contacts of too few cells cause one warning per run; other contacts cause none."""

import warnings

import numpy as np
import pytest

import asperity

WORDS = "cells across on average"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def sphere(across, phases="&phase force = {force} /", more=""):
    """Return a sphere of radius 1 m under the load of a Hertzian contact `across` cells wide."""
    radius = 0.5 * across / 32
    return f"""
&grid nx = 32, ny = 32, lx = 1., boundary = 'free' /
&surface shape = 'paraboloid', radius = 1. /
&material shear_modulus = 0.25, poisson = 0.5 /
{phases.format(force=4 / 3 * radius**3)}
{more}
"""


def warned(case):
    return sum(WORDS in line for line in asperity.run(case, output="case.h5").warnings)


@pytest.mark.parametrize(("across", "times"), [(0.6, 1), (2.0, 1), (3.0, 1), (8.0, 0)])
def test_single_contact(across, times):
    assert warned(sphere(across)) == times


@pytest.mark.parametrize("part", [(0.0, 0.0), (0.5, 0.5), (0.2, 0.35)])
def test_an_approach_without_a_warning_is_right(part):
    """Hertz's approach is right to about 1 % wherever the summit is, or a warning has a remedy."""
    silent = 0
    for across in np.arange(2.0, 8.0, 0.5):
        radius = 0.5 * across / 32
        place = [(16 + shift) / 32 for shift in part]
        case = sphere(across).replace("radius = 1.", "radius = 1., centre_x = {}, centre_y = {}"
                                      .format(*place))
        run = asperity.run(case, output=f"case{across}.h5")
        # The displacement is counted from the highest cell, which is lower than the summit.
        below = sum((shift / 32) ** 2 for shift in part) / 2
        error = (run.history["displacement"][-1] + below) / radius**2 - 1
        printed = [line for line in run.warnings if WORDS in line]
        assert abs(error) < 0.011 or printed, (across, error)
        assert all("times as many cells per length" in line for line in printed)
        silent += not printed
    assert silent >= 4


def hertzian(across):
    """Return a map of the same sphere, and its mean pressure for E* = 1 Pa."""
    x = (np.arange(32) - 16) / 32
    return -(x[None, :] ** 2 + x[:, None] ** 2) / 2, 4 / 3 * (0.5 * across / 32) ** 3


@pytest.mark.parametrize("across", [0.6, 3.0, 8.0])
def test_a_contact_on_arrays_warns_in_the_words_of_the_program(across):
    height, pressure = hertzian(across)
    lines = [line for line in asperity.run(sphere(across), output="case.h5").warnings
             if WORDS in line]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        asperity.solve_normal(height, 1.0, None, 1.0, pressure=pressure, boundary="free")
    printed = [str(each.message) for each in caught]
    assert len(printed) == (across < 5)
    assert len(lines) == len(printed)
    assert all(mine in line for line, mine in zip(lines, printed, strict=True))
    assert all(each.filename == __file__ for each in caught)


def test_an_adhesive_contact_on_arrays_warns_too():
    height, pressure = hertzian(3.0)
    with pytest.warns(UserWarning, match=WORDS):
        asperity.solve_adhesive(height, 1.0, None, 1.0, pressure=pressure, boundary="free",
                                energy=1e-9, range=1e-3)


def test_single_lines():
    """A single line of contact must be five cells wide."""
    printed = []
    for across in (2.5, 3.0, 5.0, 7.0):
        pressure = np.pi / 64 * np.sin(np.pi * across / 128) ** 2
        printed.append(warned(f"""
&grid nx = 64, ny = 1, lx = 64. /
&surface shape = 'sine', amplitude = 1., wavelength = 64. /
&material shear_modulus = 0.25, poisson = 0.5 /
&phase pressure = {pressure} /
"""))
    assert printed == [1, 1, 0, 0]


def test_a_contact_that_is_small_only_at_first_gives_no_warning():
    ramp = "&phase force = {force}, duration = 1., steps = 64, ramp = 'linear' /"
    assert warned(sphere(8.0, ramp)) == 0


def test_the_warning_comes_once_per_run():
    twice = "&phase force = {force} /\n&phase force = {force}, duration = 1., steps = 2 /"
    assert warned(sphere(1.0, twice)) == 1


def test_one_phase_with_large_patches_is_enough():
    assert warned(sphere(8.0, "&phase force = {force} /\n&phase force = 1e-9 /")) == 0


def test_each_state_of_steady_sliding_has_its_own_warning():
    """Wide patches under one load say nothing about those under another one."""
    light, heavy = (f"&phase steady = .true., velocity_x = 1., pressure = {pressure:g} /\n"
                    for pressure in (1e-5, 1e-2))
    case = """
&grid nx = 32, ny = 32, lx = 1. /
&surface shape = 'hexagonal_wave', amplitude = 0.01, wavelength = 1. /
&material shear_modulus = 0.25, prony_g = 0.25, prony_tau = 0.1, poisson = 0.5 /
"""
    for phases, steps in ((light + heavy, ["step 0"]), (heavy, []),
                          (heavy + light + light, ["step 1", "step 2"])):
        run = asperity.run(case + phases, output=f"case{len(phases)}.h5")
        assert [line.split(",")[0] for line in run.warnings if WORDS in line] == steps


@pytest.mark.parametrize(("cells_a_wave", "times"), [(2.5, 1), (16, 0)])
def test_rough_contact(cells_a_wave, times):
    case = f"""
&grid nx = 96, ny = 96, lx = 1. /
&surface shape = 'self_affine', wavelength_long = 0.5, wavelength_short = {cells_a_wave / 96},
  rms_slope = 0.1, hurst = 0.8, seed = 2 /
&material shear_modulus = 0.25, poisson = 0.5 /
&phase pressure = 0.0002 /
"""
    assert warned(case) == times


def test_line_and_full_contact():
    case = """
&grid nx = 64, ny = 1, lx = 1. /
&surface shape = 'sine', amplitude = 0.01, wavelength = 1. /
&material shear_modulus = 0.25, poisson = 0.5 /
&phase pressure = {} /
"""
    # A contact over a third of the wave, and one over all of it.
    assert warned(case.format(0.01)) == 0
    assert warned(case.format(1.0)) == 0
    assert warned(case.format(1e-6)) == 1


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("method", ["fast", "thesis"])
def test_overflow_is_not_converged(method):
    height = 1e200 * np.cos(np.linspace(0, 6, 20))[None, :]
    with pytest.raises(asperity.NotConverged):
        asperity.solve_normal(height, 1e-150, 1e-150, 1.0, pressure=1e160, method=method)
    with pytest.raises(asperity.NotConverged):
        asperity.solve_adhesive(height, 1e-150, 1e-150, 1.0, pressure=1e160, method=method,
                                energy=1e-100, range=1e-60)


def test_full_contact_is_named_where_a_displacement_leaves_no_gap():
    case = """
&grid nx = 32, ny = 32, lx = 1. /
&surface shape = 'hexagonal_wave', amplitude = 0.01, wavelength = 1. /
&material shear_modulus = 0.25, poisson = 0.5 /
&phase displacement = 1. /
{}
"""
    for adhesion in ("", "&adhesion potential = 'exponential', energy = 1e-5, range = 1e-3 /"):
        with pytest.raises(asperity.NotConverged, match="full contact"):
            asperity.run(case.format(adhesion), output=f"case{len(adhesion)}.h5")
