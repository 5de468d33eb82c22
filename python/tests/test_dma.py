"""DMA tables become materials: known series are recovered, units and mistakes are recognised."""

import re
import subprocess
import sys
from typing import NamedTuple

import h5py
import numpy as np
import pytest

import asperity
from asperity import NotConverged
from asperity.__main__ import main
from asperity.curves.sources import compound_of
from asperity.dma import DmaTable, fit_dma, read_dma
from asperity.material import WLF, Prony

# A model rubber with a broad spectrum: 0.6 MPa in the long term, about 13.5 MPa in a jump.
TAU = np.logspace(-7, 2, 37)
RUBBER = Prony(6e5, 0.8e6 * np.exp(-(((np.log10(TAU) + 4) / 2.2) ** 2)) + 2e4, TAU)
SHIFT = WLF(8.86, 101.6, 20.0)
TWO_PI = 2 * np.pi


def noise(seed, size, amount):
    """Return factors that scatter about 1."""
    return np.exp(amount * np.random.default_rng(seed).standard_normal(size))


def write(path, head, rows, separator=","):
    """Write a table."""
    lines = [head, *(separator.join(f"{value:.9g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def sweeps(temperatures, frequencies, amount=0.0):
    """Return rows f (Hz), G' (MPa), G'' (MPa), T (C)."""
    rows = []
    for k, t in enumerate(temperatures):
        modulus = RUBBER.shifted(t, SHIFT).complex_modulus(TWO_PI * frequencies)
        for f, m, a, b in zip(frequencies, modulus, noise(k, frequencies.size, amount),
                              noise(100 + k, frequencies.size, amount), strict=True):
            rows.append((f, 1e-6 * m.real * a, 1e-6 * m.imag * b, t))
    return rows


# ---- the fit -------------------------------------------------------------------------------


# Arms at distances of h = ln(10)/arms leave a ripple of at least 2/cosh(pi^2/h) in the loss of a
# flat spectrum: 5.5 %, 0.08 %, 1e-5. At the ends of the range the error is up to twice that.
@pytest.mark.parametrize("arms, bound, loss_bound",
                         [(1.0, 0.04, 0.13), (2.0, 2e-3, 6e-3), (3.0, 1e-3, 3e-3)])
def test_known_modulus_comes_back(arms, bound, loss_bound):
    omega = np.logspace(-1, 7, 90)
    modulus = RUBBER.complex_modulus(omega)
    fit = fit_dma(DmaTable(omega, modulus.real, modulus.imag), arms_per_decade=arms)
    between = np.logspace(-1, 7, 777)
    found, true = fit.material.complex_modulus(between), RUBBER.complex_modulus(between)
    assert np.abs(found / true - 1.0).max() < bound
    assert np.abs((found.imag / found.real) / (true.imag / true.real) - 1.0).max() < loss_bound
    assert fit.material.g.min() > 0.0
    assert fit.material.g_inf == pytest.approx(6e5, rel=0.1)
    decades = np.log10(fit.material.tau.max() / fit.material.tau.min())
    assert fit.material.tau.size == pytest.approx(arms * decades + 1, abs=0.5)
    assert fit.valid_range == pytest.approx((0.1, 1e7))
    found = fit.material.complex_modulus(omega)
    errors = [np.log10(found.real / modulus.real), np.log10(found.imag / modulus.imag)]
    for stated, error in ((fit.error_storage, errors[0]), (fit.error_loss, errors[1]),
                        (fit.error_tan_delta, errors[1] - errors[0])):
        assert stated == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-9)
    assert fit.largest_error == pytest.approx(np.abs(errors).max())


def test_noise_is_smoothed():
    """With 5 % of scatter in each point, the fit is nearer to the truth than the data are."""
    omega = np.logspace(-1, 7, 120)
    modulus = RUBBER.complex_modulus(omega)
    for seed in range(3):
        table = DmaTable(omega, modulus.real * noise(seed, 120, 0.05),
                         modulus.imag * noise(seed + 50, 120, 0.05))
        fit = fit_dma(table, arms_per_decade=2)
        found = fit.material.complex_modulus(omega)
        for got, true in ((found.real, modulus.real), (found.imag, modulus.imag)):
            assert np.sqrt(np.mean((got / true - 1.0) ** 2)) < 0.03
        assert fit.error_storage == pytest.approx(0.05 / np.log(10), rel=0.3)
        # neighbouring arms do not jump up and down: the spectrum is smooth
        inner = fit.material.g[2:-2]
        assert np.abs(np.diff(np.log10(inner))).max() < 0.6


def test_rows_in_any_order():
    omega = np.logspace(0, 5, 40)
    modulus = RUBBER.complex_modulus(omega)
    order = np.random.default_rng(3).permutation(40)
    first = fit_dma(DmaTable(omega, modulus.real, modulus.imag))
    other = fit_dma(DmaTable(omega[order], modulus.real[order], modulus.imag[order]))
    assert first.material == other.material


def test_exchanged_columns_are_warned_of():
    omega = np.logspace(-2, 8, 80)
    modulus = Prony(1e6, 2e6 * np.ones(9), np.logspace(-7, 1, 9)).complex_modulus(omega)
    right = fit_dma(DmaTable(omega, modulus.real, modulus.imag))
    wrong = fit_dma(DmaTable(omega, modulus.imag, modulus.real))
    assert not any("right columns" in note for note in right.notes)
    assert any("misses the data by a factor" in note and "right columns" in note
               for note in wrong.notes)


def test_the_plateau_is_positive_where_the_data_do_not_reach_it():
    """For a Maxwell fluid the plateau is kept above zero, and a note says so."""
    fluid = Prony(0.0, [1e6, 1e6], [1e-2, 1.0])
    omega = np.logspace(-2, 3, 40)
    modulus = fluid.complex_modulus(omega)
    fit = fit_dma(DmaTable(omega, modulus.real, modulus.imag))
    assert fit.material.g_inf == pytest.approx(0.01 * modulus.real.min())
    assert fit.plateau_bounded and any("plateau" in note for note in fit.notes)
    assert fit_dma(DmaTable(omega, modulus.real, modulus.imag),
                   least_plateau=0.0).material.g_inf < 0.01 * modulus.real.min()
    solid = RUBBER.complex_modulus(omega)
    assert not fit_dma(DmaTable(omega, solid.real, solid.imag)).plateau_bounded


# ---- temperatures --------------------------------------------------------------------------

TEMPERATURES = (-20.0, -10.0, 0.0, 10.0, 20.0, 40.0, 60.0)
FREQUENCIES = np.logspace(-1, 2, 16)


def table_of(tmp_path, **options):
    rows = sweeps(TEMPERATURES, FREQUENCIES, **options)
    order = np.random.default_rng(5).permutation(len(rows))
    return read_dma(write(tmp_path / "dma.csv", "f (Hz),G' (MPa),G'' (MPa),T (C)",
                          [rows[k] for k in order]))


def test_several_temperatures_with_known_constants(tmp_path):
    fit = fit_dma(table_of(tmp_path), wlf=SHIFT, arms_per_decade=2)
    low, high = fit.valid_range
    shifts = SHIFT.shift_factor([60.0, -20.0])
    assert low == pytest.approx(TWO_PI * 0.1 * shifts[0], rel=1e-9)
    assert high == pytest.approx(TWO_PI * 100 * shifts[1], rel=1e-9)
    omega = np.geomspace(low, high, 300)
    ratio = fit.material.complex_modulus(omega) / RUBBER.complex_modulus(omega)
    assert np.abs(ratio - 1.0).max() < 5e-3
    assert (fit.reference, fit.wlf) == (20.0, SHIFT)
    # the same constants, said at another temperature, are the same shifts
    moved = fit_dma(table_of(tmp_path), wlf=SHIFT, reference=0.0, arms_per_decade=2)
    assert moved.wlf.t_ref == 0.0
    np.testing.assert_allclose(
        moved.wlf.shift_factor([-20.0, 30.0]),
        SHIFT.shift_factor([-20.0, 30.0]) / SHIFT.shift_factor(0.0), rtol=1e-12)
    cold = RUBBER.shifted(0.0, SHIFT).complex_modulus(1e3)
    assert abs(moved.material.complex_modulus(1e3) / cold - 1.0) < 5e-3


@pytest.mark.parametrize("amount, error", [(0.0, 0.01), (0.02, 0.08)])
def test_several_temperatures_with_shifts_from_the_overlap(tmp_path, amount, error):
    fit = fit_dma(table_of(tmp_path, amount=amount), reference=20.0)
    for t, shift in fit.shifts:
        assert shift == pytest.approx(np.log10(SHIFT.shift_factor(t)), abs=error)
    assert fit.reference == 20.0
    # the law is known where it was measured
    np.testing.assert_allclose(
        np.log10(fit.wlf.shift_factor(TEMPERATURES)), np.log10(SHIFT.shift_factor(TEMPERATURES)),
        atol=max(error, 0.02))
    omega = np.geomspace(*fit.valid_range, 200)
    ratio = np.abs(fit.material.complex_modulus(omega) / RUBBER.complex_modulus(omega))
    assert np.abs(np.log10(ratio)).max() < 0.05


def test_sweeps_that_do_not_overlap_are_reported():
    rows = np.array(sweeps((-40.0, 20.0), np.logspace(0, 1, 6)))
    fit = fit_dma(DmaTable(TWO_PI * rows[:, 0], 1e6 * rows[:, 1], 1e6 * rows[:, 2], rows[:, 3]))
    assert any("-40 and 20 C hardly overlap" in note for note in fit.notes)


def test_temperatures_that_scatter_belong_together(tmp_path):
    rows = [(f, a, b, t + 0.1 * np.sin(7 * k)) for k, (f, a, b, t) in
            enumerate(sweeps((0.0, 20.0, 40.0), FREQUENCIES))]
    table = read_dma(write(tmp_path / "dma.csv", "f (Hz),G' (MPa),G'' (MPa),T (C)", rows))
    fit = fit_dma(table)
    assert [round(t) for t, _ in fit.shifts] == [0, 20, 40]
    ramp = [(1.0, 2.0, 1.0, 0.3 * k) for k in range(40)]
    table = read_dma(write(tmp_path / "ramp.csv", "f (Hz),G' (MPa),G'' (MPa),T (C)", ramp))
    with pytest.raises(ValueError, match="a ramp\\?"):
        fit_dma(table)


@pytest.mark.parametrize("place", [0, 1, 9, 18, 19])
@pytest.mark.parametrize("factor", [0.1, 3.0])
def test_a_modulus_that_does_not_fit_its_neighbours_is_noted(place, factor):
    """A typing error moves the master curve, however many points it has."""
    omega = np.tile(TWO_PI * np.logspace(-1, 2, 20), 3)
    temperature = np.repeat([0.0, 20.0, 40.0], 20)
    modulus = np.concatenate([RUBBER.shifted(t, SHIFT).complex_modulus(omega[:20])
                              for t in (0.0, 20.0, 40.0)])
    storage = modulus.real * noise(1, 60, 0.01)
    loss = modulus.imag * noise(2, 60, 0.01)
    assert not any("neighbours" in note
                   for note in fit_dma(DmaTable(omega, storage, loss, temperature)).notes)
    for name, values in (("storage", storage), ("loss", loss)):
        wild = values.copy()
        wild[20 + place] *= factor
        table = DmaTable(omega, *((wild, loss) if name == "storage" else (storage, wild)),
                         temperature)
        (note,) = (note for note in fit_dma(table).notes if "neighbours" in note)
        assert note.startswith(f"the {name} modulus {wild[20 + place]:.4g} Pa at 20 C and")
        found = float(re.search(r"is ([\d.]+) times", note).group(1))
        assert found == pytest.approx(factor, rel=0.15)
        assert ";" not in note


def test_the_picture_of_a_fit_shows_all_data():
    omega = np.logspace(-1, 4, 40)
    modulus = RUBBER.complex_modulus(omega)
    storage = modulus.real.copy()
    storage[20] *= 30.0
    axes = fit_dma(DmaTable(omega, storage, modulus.imag)).plot().axes[0]
    assert axes.get_ylim()[1] > storage.max()


def drifting(tmp_path, temperatures, drift):
    """Return a table whose temperature drifts in each sweep, over the part of it that is done."""
    done = np.linspace(0.0, 1.0, len(FREQUENCIES))
    rows = [(f, *sweeps((t + one,), np.array([f]))[0][1:]) for t in temperatures
            for f, one in zip(FREQUENCIES, drift(done), strict=True)]
    return read_dma(write(tmp_path / "dma.csv", "f (Hz),G' (MPa),G'' (MPa),T (C)", rows))


@pytest.mark.parametrize(("temperatures", "drift"), [
    ((0.0, 20.0, 40.0), lambda done: -0.2 + 0.5 * done),
    ((0.0, 20.0, 40.0), lambda done: np.where(done < 0.5, -0.3, 0.3)),   # a jump above 0.5 K
    ((0.0, 20.0, 40.0), lambda done: np.where(done > 0.9, 0.7, 0.0)),    # the last ones only
    ((16.0, 17.0, 18.0, 19.0, 20.0, 21.0, 22.0), lambda done: -0.2 + 0.5 * done),
    ((20.0,), lambda done: np.where(done < 0.5, -0.2, 0.35)),
])
def test_a_temperature_may_drift_within_a_sweep(tmp_path, temperatures, drift):
    table = drifting(tmp_path, temperatures, drift)
    mean = float(np.mean(drift(np.linspace(0.0, 1.0, len(FREQUENCIES)))))
    fit = fit_dma(table)
    assert [t for t, _ in fit.shifts] == pytest.approx([t + mean for t in temperatures], abs=1e-5)
    assert [note for note in fit.notes if "the temperature drifts within the sweep" in note
            and note.endswith("the mean of each sweep is used")]
    assert not any("doubtful" in note for note in fit.notes)
    for t, shift in fit.shifts:
        expected = SHIFT.shift_factor(t) / SHIFT.shift_factor(fit.reference)
        # A drift of 0.6 K changes log10 a_T by up to 0.09 within a sweep.
        assert shift == pytest.approx(np.log10(float(expected)), abs=0.09)


def test_a_large_drift_has_to_be_accepted(tmp_path):
    table = drifting(tmp_path, (0.0, 20.0, 40.0), lambda done: 3.0 * done)
    with pytest.raises(ValueError, match=r"drifts from 0 to 3 C .* = 0.75 \(--temp.* accepts"):
        fit_dma(table)
    assert len(fit_dma(table, temperature_tolerance=0.75).shifts) == 3


@pytest.mark.parametrize("rise", [0.4, 1.0])
def test_a_ramp_is_no_sweep(tmp_path, rise):
    """A few frequencies in turn while the temperature rises: WLF constants can shift each point."""
    rows = []
    for k in range(60):
        f = (1.0, 5.0, 25.0)[k % 3]
        rows.append((f, *sweeps((10.0 + rise * k,), np.array([f]))[0][1:]))
    table = read_dma(write(tmp_path / "ramp.csv", "f (Hz),G' (MPa),G'' (MPa),T (C)", rows))
    if rise < 0.5:
        with pytest.raises(ValueError, match=r"cannot be told from its drift \(a ramp\?\)"):
            fit_dma(table)
    else:
        with pytest.raises(ValueError, match="1 frequency at"):
            fit_dma(table)
    fit = fit_dma(table, wlf=SHIFT)
    assert fit.error_storage < 0.02
    omega = np.logspace(1, 2, 5)
    exact = RUBBER.complex_modulus(omega)
    np.testing.assert_allclose(fit.material.complex_modulus(omega).real, exact.real, rtol=0.03)


def test_temperatures_that_cannot_be_brought_together(tmp_path):
    table = table_of(tmp_path)
    with pytest.raises(ValueError, match="reference = 25: must be one of the temperatures -20"):
        fit_dma(table, reference=25.0)
    with pytest.raises(ValueError, match="wlf: has 2 numbers: give its reference"):
        fit_dma(table, wlf=(8.86, 101.6))
    with pytest.raises(ValueError, match="must be > t_ref - c2"):
        fit_dma(table, wlf=(8.86, 10.0, 20.0))
    one = DmaTable(table.omega, table.storage, table.loss)
    with pytest.raises(ValueError, match=r"temperature = 5: .*--wlf"):
        fit_dma(one).to_namelist(temperature=5.0)
    few = write(tmp_path / "few.csv", "f (Hz),G' (MPa),G'' (MPa),T (C)",
                sweeps((0.0, 20.0), np.array([1.0, 2.0])))
    with pytest.raises(ValueError, match="2 frequencies at 0 C: shifting needs at least 3"):
        fit_dma(read_dma(few))


# ---- the table -----------------------------------------------------------------------------

ROWS = [(0.1, 1.0, 0.2), (1.0, 2.0, 0.5), (10.0, 4.0, 1.5)]
HEADS = [
    ("f (Hz),G' (MPa),G'' (MPa)", TWO_PI, 1e6, 1e6),
    ("Frequency [Hz],Storage modulus [kPa],Loss modulus [Pa]", TWO_PI, 1e3, 1.0),
    ("omega (rad/s),storage (Pa),loss (Pa)", 1.0, 1.0, 1.0),
    ("freq_kHz,storage_MPa,loss_MPa", 1e3 * TWO_PI, 1e6, 1e6),
    ("Angular frequency / rad/s,G' / GPa,G'' / MPa", 1.0, 1e9, 1e6),
    ("Angular Frequency (rad s^-1),Storage Modulus (G') (MPa),Loss Modulus (G'') (MPa)",
     1.0, 1e6, 1e6),
    ('"f, Hz","G\', MPa","G\'\', MPa"', TWO_PI, 1e6, 1e6),
    ("ω (rad/s),G′ (MPa),G″ (MPa)", 1.0, 1e6, 1e6),
    ("omega_rad_s,G_storage_Pa,G_loss_kPa", 1.0, 1.0, 1e3),
    ("angular_frequency_rad_s,Gstor_MPa,Gloss_MPa", 1.0, 1e6, 1e6),
    ("frequency_rad_per_s,G_prime (MPa),G_double_prime (MPa)", 1.0, 1e6, 1e6),
    ("omega (1/s),Gp (Pa),Gpp (Pa)", 1.0, 1.0, 1.0),
    ("f (1/s),Gp (Pa),Gpp (Pa)", TWO_PI, 1.0, 1.0),
    ("freq_hz,storage_modulus_pa,loss_modulus_pa", TWO_PI, 1.0, 1.0),
    ("Ang. Frequency [s^-1],storage modulus G' / MPa,loss modulus G'' / MPa", 1.0, 1e6, 1e6),
    ("f (Hz),E_storage_MPa,E_loss_MPa", TWO_PI, 1e6 / 3, 1e6 / 3),
    ("frequency,storage,loss", TWO_PI, 1.0, 1.0),
    ("omega,G1,G2", 1.0, 1.0, 1.0),
    ("f (Hz),E' (MPa),E'' (MPa)", TWO_PI, 1e6 / 3, 1e6 / 3),
    ("Frequency\nHz,MPa,kPa".replace("Frequency", "Frequency,Storage Modulus,Loss Modulus"),
     TWO_PI, 1e6, 1e3),
]


@pytest.mark.parametrize("head, to_omega, to_storage, to_loss", HEADS)
def test_columns_and_units_are_recognised(tmp_path, head, to_omega, to_storage, to_loss):
    table = read_dma(write(tmp_path / "dma.csv", head, ROWS))
    f, a, b = np.array(ROWS).T
    np.testing.assert_allclose(table.omega, to_omega * f, rtol=1e-12)
    np.testing.assert_allclose(table.storage, to_storage * a, rtol=1e-12)
    np.testing.assert_allclose(table.loss, to_loss * b, rtol=1e-12)
    assert table.temperature is None
    assert any("unit: taken as" in note for note in table.notes) == (head.split(",")[0] in
                                                               ("frequency", "omega"))


def test_other_orders_separators_and_commas(tmp_path):
    f, a, b = np.array(ROWS).T
    path = tmp_path / "dma.csv"
    path.write_bytes("\ufeff# a remark\r\n\r\nT (K);tan delta;G' (MPa);f (Hz)\r\n"
                     "293,15;0,2;1;0,1\r\n293,15;0,25;2,0;1,0\r\n\r\n293,15;0,375;4e0;10\r\n"
                     .encode())
    table = read_dma(path)
    np.testing.assert_allclose(table.omega, TWO_PI * f, rtol=1e-12)
    np.testing.assert_allclose(table.storage, 1e6 * a, rtol=1e-12)
    np.testing.assert_allclose(table.loss, 1e6 * b, rtol=1e-12)
    np.testing.assert_allclose(table.temperature, 20.0, atol=1e-12)
    for separator in ("\t", "  "):
        head = separator.join(("f_Hz", "G'_MPa", "G''_MPa"))
        table = read_dma(write(path, head, ROWS, separator))
        np.testing.assert_allclose(table.loss, 1e6 * b, rtol=1e-12)


def test_arguments_of_the_call_override_the_header(tmp_path):
    f, a, b = np.array(ROWS).T
    path = write(tmp_path / "dma.csv", "run,x (Hz),A,B,E' (MPa),E'' (MPa)",
                 [(9, *row, 7 * row[1], 7 * row[2]) for row in ROWS])
    columns = {"frequency": "x (Hz)", "storage": "A", "loss": 4}
    table = read_dma(path, columns=columns, frequency_unit="rad/s", modulus_unit="kPa")
    np.testing.assert_allclose(table.omega, f)
    np.testing.assert_allclose(table.storage, 1e3 * a)
    np.testing.assert_allclose(table.loss, 1e3 * b)
    tensile = read_dma(path, columns={"frequency": 2}, poisson=0.4)
    np.testing.assert_allclose(tensile.storage, 7e6 * a / 2.8)
    shear = read_dma(path, columns={"frequency": 2}, kind="shear")
    np.testing.assert_allclose(shear.storage, 7e6 * a)
    bare = tmp_path / "bare.csv"
    np.savetxt(bare, np.array(ROWS)[:, [1, 0, 2]], delimiter=",")
    with pytest.raises(ValueError, match=r"bare\.csv: has no header: say the number of frequency"):
        read_dma(bare)
    table = read_dma(bare, columns={"frequency": 2, "storage": 1, "loss": "3"})
    np.testing.assert_allclose(table.omega, TWO_PI * f)


WRONG = [
    ("f (Hz),G' (Pa),G'' (Pa)\n1,2,3\n2,abc,4\n3,4\n4,5,-6\n5,6,inf\n",
     [r"line 3: storage = 'abc': must be a number > 0", "line 4: has 2 columns, must have 3",
      "line 5: loss = '-6': must be a number > 0", "line 6: loss = 'inf'"]),
    ("f (Hz),G' (Pa),G'' (Pa),T (C)\n1,2,3,20\n2,3,4,hot\n3,4,5,20\n",
     [r"line 3: temperature = 'hot': must be a finite number"]),
    ("# remark\n\nf (Hz),G' (Pa)\n1,2\n", ["line 3: the columns 'f \\(Hz\\)', \"G' \\(Pa\\)\" have"
                                         r" no loss \(or tan_delta\)"]),
    ("f (Hz),freq (Hz),G' (Pa),G'' (Pa)\n1,1,2,3\n", ["line 1: the columns 'f .Hz.' and 'freq"]),
    ("f (rpm),G' (Pa),G'' (Pa)\n1,2,3\n2,3,4\n3,4,5\n", ["line 1: column frequency: has the unit"
                                                     " 'rpm': must be one of Hz"]),
    ("f (Hz),G' (psi),G'' (Pa)\n1,2,3\n2,3,4\n3,4,5\n", ["column storage: has the unit 'psi'"]),
    ("T (F),f (Hz),G' (Pa),G'' (Pa)\n9,1,2,3\n9,2,3,4\n9,3,4,5\n",
     ["column temperature: has the unit 'F': must be one of C, K"]),
    ("f (Hz),G' (Pa),G'' (Pa)\n1,2,3\n2,3,4\n", ["has 2 rows of numbers: must have at least 3"]),
    ("f (Hz),G' (Pa),G'' (Pa)\n", ["has a header and no numbers"]),
    ("\n\n", ["is empty"]), ("\n# nothing\n", ["holds only comments"]),
]


@pytest.mark.parametrize("text, words", WRONG)
def test_wrong_tables(tmp_path, text, words):
    path = tmp_path / "dma.csv"
    path.write_text(text)
    for word in words:
        with pytest.raises(ValueError, match=r"dma\.csv: .*" + word if word in words[:1] else word):
            read_dma(path)


def test_many_faults_are_cut_short(tmp_path):
    path = write(tmp_path / "dma.csv", "f (Hz),G' (Pa),G'' (Pa)", [(1.0, -1.0, 1.0)] * 30)
    with pytest.raises(ValueError) as caught:
        read_dma(path)
    lines = str(caught.value).splitlines()
    assert len(lines) == 11 and lines[-1].endswith("and 20 more")
    with pytest.raises(OSError, match="there is no such file"):
        read_dma(tmp_path / "none.csv")
    for word in ("frequency_unit", "modulus_unit", "temperature_unit", "kind"):
        with pytest.raises(ValueError, match=f"{word} = 'furlong': must be one of"):
            read_dma(path, **{word: "furlong"})
    with pytest.raises(ValueError, match="columns = 'mass': must be one of"):
        read_dma(path, columns={"mass": 1})


def test_exports_as_instruments_write_them(tmp_path):
    """Lines above the header, units below it, German words and commas, a block a sweep."""
    path = tmp_path / "dma.csv"
    blocks = [f"Schritt {k}\nTemperatur;{t};C\n\nFrequenz;Speichermodul;Verlustmodul;Temperatur\n"
              f"Hz;MPa;MPa;°C\n" + "".join(f"{f},5;1,{f}25;0,{f};{t},0\n" for f in (1, 2, 3))
              for k, t in enumerate((10, 20))]
    path.write_text("Probe: Lauffläche A\nDatum; 12.3.2026\nDicke; 2,5\n" + "".join(blocks))
    table = read_dma(path)
    np.testing.assert_allclose(table.omega, 2 * np.pi * np.array([1.5, 2.5, 3.5] * 2))
    np.testing.assert_allclose(table.storage, 1e6 * np.array([1.125, 1.225, 1.325] * 2))
    np.testing.assert_allclose(table.loss, 1e6 * np.array([0.1, 0.2, 0.3] * 2))
    np.testing.assert_allclose(table.temperature, [10.0] * 3 + [20.0] * 3)
    assert len(table.notes) == 1 and "of shear or of tension: taken as shear" in table.notes[0]
    path.write_text(path.read_text().replace("2,5;1,225;0,2", "2,5;;0,2"))
    table = read_dma(path)
    assert table.storage.size == 4
    assert any("2 of 6 points have no value" in note for note in table.notes)


def test_wide_tables_are_those_of_long_ones(tmp_path):
    """Heads with temperatures, temperatures above the heads, a frequency for each temperature."""
    frequencies, celsius = np.array([0.1, 1.0, 10.0, 50.0]), (-20.0, 0.0, 25.5)
    storage = {t: 1e6 * (2.0 - 0.01 * t + 0.1 * np.arange(4)) for t in celsius}
    loss = {t: 1e5 * (3.0 - 0.02 * t + 0.1 * np.arange(4)) for t in celsius}

    def rows(*columns):
        return "".join(";".join(f"{value!r}" for value in row) + "\n" for row in
                       zip(*columns, strict=True))

    pairs = [values for t in celsius for values in ((storage[t] / 1e6).tolist(),
                                                    (loss[t] / 1e6).tolist())]
    heads = "f (Hz);" + ";".join(f"G' {t:g} °C (MPa);G'' {t:g} °C (MPa)" for t in celsius)
    above = (";" + ";".join(f"{t + 273.15:g} K;" for t in celsius) + "\nf;"
             + ";".join(["G';G''"] * 3) + "\nHz;" + ";".join(["MPa;MPa"] * 3))
    own = ";".join(f"freq (Hz) @ {t:g}C;storage modulus @ {t:g}C (MPa);tan delta @ {t:g}C"
                   for t in celsius)
    tangents = [values for t in celsius for values in (
        frequencies.tolist(), (storage[t] / 1e6).tolist(), (loss[t] / storage[t]).tolist())]
    for text in (heads + "\n" + rows(frequencies.tolist(), *pairs),
                 "Sample: tread\n" + above + "\n" + rows(frequencies.tolist(), *pairs),
                 own + "\n" + rows(*tangents)):
        path = tmp_path / "wide.csv"
        path.write_text(text)
        table = read_dma(path)
        np.testing.assert_allclose(table.temperature, np.repeat(celsius, 4), atol=1e-9)
        np.testing.assert_allclose(table.omega, 2 * np.pi * np.tile(frequencies, 3))
        np.testing.assert_allclose(table.storage, np.concatenate([storage[t] for t in celsius]))
        np.testing.assert_allclose(table.loss, np.concatenate([loss[t] for t in celsius]))


def test_overloads_are_left_out(tmp_path):
    path = tmp_path / "dma.csv"
    path.write_text("f (Hz),G' (Pa) at 0 C,G'' (Pa) at 0 C,G' (Pa) at 9 C,G'' (Pa) at 9 C\n"
                    "1,10,2,8,1\n2,OVL,OVL,9,1.5\n3,12,3,,\n4,13,3.5,11,2.5\n")
    table = read_dma(path)
    assert table.storage.tolist() == [10.0, 12.0, 13.0, 8.0, 9.0, 11.0]
    assert table.temperature.tolist() == [0.0] * 3 + [9.0] * 3
    assert "2 of 8 points have no value" in " ".join(table.notes)


def test_vertical_shifts_of_noisy_sweeps_do_not_shorten_the_overlap():
    """In a short overlap wrong shifts can fit better than the noise lets the right ones fit."""
    tau = np.logspace(-8, 3, 45)
    rubber = Prony(0.8e6, 0.9e6 * np.exp(-(((np.log10(tau) + 4.5) / 2) ** 2)), tau)
    temperatures = np.array([-30.0, -20, -10, 0, 10, 20, 40, 60])
    omega = TWO_PI * np.logspace(-1, 2, 13)
    exact = [rubber.shifted(t, SHIFT) for t in temperatures]
    for seed in range(12):
        factors = noise(seed, (2, 8, omega.size), 0.03)
        storage = [one.storage_modulus(omega) * factor
                   for one, factor in zip(exact, factors[0], strict=True)]
        loss = [one.loss_modulus(omega) * factor
                for one, factor in zip(exact, factors[1], strict=True)]
        curve = asperity.material.master_curve(temperatures, [omega] * 8, storage, loss, 20.0,
                                               vertical=True)
        np.testing.assert_allclose(curve.log_shift, np.log10(SHIFT.shift_factor(temperatures)),
                                   atol=0.6, err_msg=str(seed))
        np.testing.assert_allclose(curve.log_vertical, 0.0, atol=0.2)


def test_vertical_shifts_are_found_and_written(tmp_path):
    """A rubber whose moduli grow with the temperature: a_T and b_T come back."""
    rubber, wlf = Prony(1e6, [2e6, 4e6, 2e6], [1e-3, 1e-2, 1e-1]), WLF(8.0, 120.0, 20.0)
    omega = np.logspace(-1, 3, 30)
    celsius = np.array([0.0, 10.0, 20.0, 30.0])
    rise = (273.15 + celsius) / 293.15
    cold = [rubber.shifted(t, wlf) for t in celsius]
    table = DmaTable(np.tile(omega, 4),
                     np.concatenate([b * m.storage_modulus(omega)
                                     for b, m in zip(rise, cold, strict=True)]),
                     np.concatenate([b * m.loss_modulus(omega)
                                     for b, m in zip(rise, cold, strict=True)]),
                     np.repeat(celsius, 30))
    fit = fit_dma(table, reference=20.0, vertical=True)
    np.testing.assert_allclose([b for _, b in fit.vertical_shifts], np.log10(rise), atol=3e-3)
    np.testing.assert_allclose([a for _, a in fit.shifts], np.log10(wlf.shift_factor(celsius)),
                               atol=0.03)
    plain = fit_dma(table, reference=20.0)
    assert plain.vertical_shifts == [] and fit.overlap_error < 0.5 * plain.overlap_error
    lines = fit.write_shifts(tmp_path / "shifts.csv").read_text().splitlines()
    assert lines[0] == "temperature,log10_a_t,a_t,b_t"
    values = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    np.testing.assert_allclose(values[:, 2], 10.0 ** values[:, 1])
    np.testing.assert_allclose(values[:, 3], rise, rtol=8e-3)
    written = tmp_path / "cold.nml"
    written.write_text(fit.to_namelist(temperature=0.0))
    group = asperity.Case.read(written).material
    at_rest = float(rise[0]) * rubber.g_inf
    assert group.temperature == 0.0 and group.shear_modulus == pytest.approx(at_rest, rel=0.03)
    cold_rubber = compound_of(written)
    assert cold_rubber.at(0.0).g_inf == pytest.approx(group.shear_modulus, rel=2e-3)
    assert cold_rubber.at(20.0).g_inf == pytest.approx(fit.material.g_inf, rel=1e-12)
    with pytest.raises(ValueError, match=r"temperature = 40: .* gives b_T from 0 to 30 C only"):
        fit.to_namelist(temperature=40.0)


def test_commas_between_thousands(tmp_path):
    """A comma beside decimal points is none of its own."""
    path = tmp_path / "dma.csv"
    path.write_text("f (Hz);G' (Pa);G'' (Pa)\n0.10;943,120;81,000\n1.00;1,043,120;91,000\n"
                    "10.0;1,143,120.5;101,000\n")
    table = read_dma(path)
    np.testing.assert_allclose(table.storage, [943120.0, 1043120.0, 1143120.5])
    np.testing.assert_allclose(table.loss, [81e3, 91e3, 101e3])
    path.write_text("f (Hz);G' (Pa);G'' (Pa)\n0.10;1,5;0.1\n1.00;2,5;0.1\n10.0;3,5;0.1\n")
    with pytest.raises(ValueError, match="line 2: storage = '1,5': must be a number > 0"):
        read_dma(path)


def test_data_that_say_little_are_named(tmp_path):
    """One frequency is an error; a narrow band and fewer points than arms give notes."""
    head = "f (Hz),G' (Pa),G'' (Pa)"
    one = read_dma(write(tmp_path / "one.csv", head, [(10.0, 2e6, 1e5)] * 4))
    with pytest.raises(ValueError, match=r"all 4 points are at one frequency, 62.83 rad/s"):
        fit_dma(one)
    narrow = fit_dma(read_dma(write(tmp_path / "narrow.csv", head, [
        (9.0, 2e6, 1e5), (10.0, 2.01e6, 1e5), (11.0, 2.02e6, 1e5)])))
    assert any("cover 0.087 decades" in note for note in narrow.notes)
    few = fit_dma(read_dma(write(tmp_path / "few.csv", head, [
        (0.1, 1e6, 3e5), (3.0, 2.0e6, 7e5), (100.0, 4e6, 1.4e6)])))
    assert any(re.match(r"3 points for [4-6] arms", note) for note in few.notes)
    assert few.material.g_inf > 0


# ---- the command ----------------------------------------------------------------------------


class Done(NamedTuple):
    """How a command ended."""

    returncode: int
    stdout: str
    stderr: str


@pytest.fixture
def command(monkeypatch, capsys, tmp_path):
    """Return a call of ``python -m asperity fit`` in the test's folder."""
    monkeypatch.chdir(tmp_path)

    def call(*words):
        status = main(["fit", *map(str, words)])
        return Done(status, *capsys.readouterr())

    return call


REST = """
&grid nx = 16, ny = 12, lx = 1e-3 /
&surface shape = 'sine', amplitude = 1e-6, wavelength = 1e-3 /
&phase pressure = 1e4, duration = 1e-3, steps = 2 /
"""


def test_the_group_is_a_case_s(command, tmp_path, program):
    """`asperity check` takes what `fit` writes; the numbers are those of the fit."""
    write(tmp_path / "dma.csv", "f (Hz),G' (MPa),G'' (MPa),T (C)",
          sweeps(TEMPERATURES, FREQUENCIES))
    done = command("dma.csv", "-o", "rubber.nml", "--plot", "fit.png", "--reference", 20,
                   "--temperature", 30)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    for word in ("error (rms of log10 fit/data): storage 0.0", "valid range: ", "WLF: c1 = ",
                 "wrote rubber.nml", "wrote fit.png"):
        assert word in done.stdout, done.stdout
    assert (tmp_path / "fit.png").read_bytes()[:4] == b"\x89PNG"
    assert (tmp_path / "fit.png").stat().st_size > 30000
    group = (tmp_path / "rubber.nml").read_text()
    (tmp_path / "case.nml").write_text(group + REST)
    checked = subprocess.run([program, "check", "case.nml"], cwd=tmp_path, text=True,
                             capture_output=True, check=False)
    assert (checked.returncode, checked.stderr) == (0, ""), checked.stderr
    assert "temperature = 30" in group
    table = read_dma(tmp_path / "dma.csv")
    fit = fit_dma(table, reference=20.0)
    assert f"shear_modulus = {fit.material.g_inf!r}" in group
    assert group.strip().splitlines()[-1] == "/"
    # without -o the group alone is on the standard output
    piped = command("dma.csv", "--reference", 20, "--temperature", 30)
    assert piped.stdout == group
    assert "! valid range: " in piped.stdout
    assert piped.stderr == ""


def test_the_command_s_options(command, tmp_path):
    f = np.logspace(-1, 5, 40)
    modulus = RUBBER.complex_modulus(TWO_PI * f)
    write(tmp_path / "dma.csv", "a,b,c", np.column_stack([f, modulus.real, modulus.imag]))
    done = command("dma.csv")
    assert done.returncode == 2
    assert done.stderr.startswith("asperity: dma.csv: line 1: the columns 'a', 'b', 'c' have no"
                                  " frequency, storage, loss (or tan_delta)")
    columns = ("--column", "frequency=a", "--column", "storage=2", "--column", "loss=c")
    counts = []
    for arms in (1, 2):
        done = command("dma.csv", *columns, "--arms-per-decade", arms, "--wlf", 8.86, 101.6, -20)
        assert done.returncode == 0, done.stderr
        assert "reference_temperature = -20.0" in done.stdout
        counts.append(int(done.stdout.split("arms: ")[1].split(",")[0]))
    assert counts[1] >= 1.8 * counts[0]
    assert command("none.csv").returncode == 3
    assert command("dma.csv", "--column", "loss").returncode == 2
    done = command("dma.csv", *columns, "-o", "none/m.nml")
    assert done.returncode == 3 and "none" in done.stderr


# ---- what is easily misread --------------------------------------------

def test_one_unit_counts_for_both_moduli(tmp_path):
    for head in ("f (Hz),G',G'' (MPa)", "f (Hz),G' (MPa),G''"):
        rows = [(1, 2, 0.5), (10, 3, 0.6), (100, 4, 0.8)]
        table = read_dma(write(tmp_path / "a.csv", head, rows))
        np.testing.assert_allclose(table.storage, [2e6, 3e6, 4e6])
        np.testing.assert_allclose(table.loss, [5e5, 6e5, 8e5])


def test_a_column_named_in_the_call_is_used(tmp_path):
    path = write(tmp_path / "a.csv", "f (Hz),G' (Pa),G'' (Pa),x",
                 [(1, 2e6, 1.0, 0.3), (10, 3e6, 1.0, 0.2), (100, 4e6, 1.0, 0.1)])
    np.testing.assert_allclose(read_dma(path, columns={"tan_delta": "x"}).loss, [6e5, 6e5, 4e5])


def test_tan_delta_in_percent(tmp_path):
    path = write(tmp_path / "a.csv", "f (Hz),G' (Pa),tan delta (%)",
                 [(1, 2e6, 30), (10, 3e6, 20), (100, 4e6, 10)])
    np.testing.assert_allclose(read_dma(path).loss, [6e5, 6e5, 4e5])


def test_decimal_commas_between_blanks(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("f G' G''\n1,0 2,5 0,5\n10,0 3,5 0,6\n100,0 4,5 0,7\n")
    np.testing.assert_allclose(read_dma(path).storage, [2.5, 3.5, 4.5])


def test_a_case_is_not_written_over(tmp_path, capsys):
    """A file with other groups is a case, and a material may be of somebody's hand."""
    table = write(tmp_path / "a.csv", "f (Hz),G' (Pa),G'' (Pa),T (C)",
                  sweeps([20.0], np.logspace(-1, 2, 9)))
    case = tmp_path / "case.nml"
    case.write_text("&grid nx = 4 /\n &material shear_modulus = 1e6 /\n&phase /\n")
    assert main(["fit", str(table), "-o", str(case)]) == 2
    assert "case.nml: holds &grid, &phase, too, and would be replaced" in capsys.readouterr().err
    assert case.read_text().startswith("&grid")
    by_hand = "! of last week\n&material shear_modulus = 1e6, density = 1200. /\n"
    case.write_text(by_hand)
    assert main(["fit", str(table), "-o", str(case)]) == 2
    assert "case.nml: holds a &material that `asperity fit` has not" in capsys.readouterr().err
    assert case.read_text() == by_hand
    fitted = tmp_path / "fitted.nml"
    for _ in "twice":
        assert main(["fit", str(table), "-o", str(fitted)]) == 0
    assert asperity.Case.read(fitted).material.prony_g
    changed = fitted.read_text().replace("poisson = 0.5", "poisson = 0.4")
    for text in (changed, fitted.read_text() + "! mine\n"):
        fitted.write_text(text)
        assert main(["fit", str(table), "-o", str(fitted)]) == 2
        assert "or that was changed since" in capsys.readouterr().err
        assert fitted.read_text() == text
    notes = tmp_path / "notes.png"
    notes.write_text("my notes")
    assert main(["fit", str(table), "--plot", str(notes)]) == 2
    assert "notes.png: exists and is not a picture" in capsys.readouterr().err
    assert notes.read_text() == "my notes"
    assert main(["fit", str(table), "--plot", str(tmp_path / "none" / "a.png")]) == 3
    assert "a.png: cannot be written: there is no folder" in capsys.readouterr().err


def test_the_number_of_arms_has_a_bound(tmp_path):
    table = read_dma(write(tmp_path / "a.csv", "f (Hz),G' (Pa),G'' (Pa),T (C)",
                           sweeps([20.0], np.logspace(-1, 2, 9))))
    with pytest.raises(ValueError, match=r"arms_per_decade = 1000: gives 5001 relaxation times from"
                                         r" .*: must be at most 200"):
        fit_dma(table, arms_per_decade=1000)


def test_the_table_is_not_written_over(tmp_path, capsys):
    path = write(tmp_path / "a.csv", "f (Hz),G' (Pa),G'' (Pa),T (C)",
                 sweeps([20.0], np.logspace(-1, 2, 9)))
    before = path.read_text()
    assert main(["fit", str(path), "-o", str(path)]) == 2
    assert "is the table itself" in capsys.readouterr().err
    group = tmp_path / "a.nml"
    assert main(["fit", str(path), "-o", str(group), "--plot", "fit.xyz"]) == 2
    assert "fit.xyz: the ending must be .png" in capsys.readouterr().err
    assert path.read_text() == before and not group.exists()


def test_files_that_a_fit_does_not_write_are_kept(tmp_path, capsys):
    """The table, topographies, results and other tables; an earlier fit may be replaced."""
    table = write(tmp_path / "dma.csv", "f (Hz),G' (Pa),G'' (Pa),T (C)",
                  sweeps([0.0, 20.0, 40.0], np.logspace(-1, 2, 13)))
    group, shifts = tmp_path / "a.nml", tmp_path / "shifts.csv"
    result, plate, other = (tmp_path / name for name in ("r.h5", "plate.x3p", "other.csv"))
    with h5py.File(result, "w") as file:
        file.create_group("history")
    plate.write_bytes(b"PK\x03\x04\0" + bytes(range(256)) + b"\n&grid \n&material \n")
    other.write_text("temperature,pressure\n20,1e5\n")
    kept = {path: path.read_bytes() for path in (table, result, plate, other)}
    for options, message in (
            (["--shifts", table], "dma.csv: is the table itself"),
            (["--shifts", result], "r.h5: the name of a table of shifts must end in .csv"),
            (["--shifts", other], "other.csv: exists and is not a table of shifts"),
            (["--shifts", tmp_path / "none" / "s.csv"], "there is no folder"),
            (["-o", shifts, "--shifts", shifts], "shifts.csv: is the file of --output, too"),
            (["-o", tmp_path / "x.pdf", "--plot", tmp_path / "x.pdf"], "is the file of --output"),
            (["-o", plate], "plate.x3p: exists and is not a material that `asperity fit` writes"),
            (["-o", other], "other.csv: exists and is not a material"),
            (["-o", result], "r.h5: is the result of a run: name another file")):
        assert main(["fit", str(table), *map(str, options)]) in (2, 3)
        assert message in capsys.readouterr().err, options
    assert {path: path.read_bytes() for path in kept} == kept
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in kept}
    for _ in "twice":
        assert main(["fit", str(table), "-o", str(group), "--shifts", str(shifts)]) == 0
    fit = fit_dma(read_dma(table))
    with pytest.raises(ValueError, match=r"other\.csv: exists and is not a table of shifts"):
        fit.write_shifts(other)


def test_a_fit_goes_into_a_pipe_or_along_a_link(command, tmp_path):
    write(tmp_path / "dma.csv", "f (Hz),G' (Pa),G'' (Pa),T (C)",
          sweeps([20.0], np.logspace(-1, 2, 13)))
    (tmp_path / "link.nml").symlink_to("rubber.nml")
    for _ in "twice":
        assert command("dma.csv", "-o", "link.nml").returncode == 0
    assert (tmp_path / "link.nml").is_symlink()
    group = (tmp_path / "rubber.nml").read_text()
    assert group.startswith("! ") and "&material" in group
    done = subprocess.run([sys.executable, "-m", "asperity", "fit", "dma.csv", "-o", "/dev/stdout"],
                          cwd=tmp_path, capture_output=True, text=True, check=True)
    assert group in done.stdout
    names = {"dma.csv", "link.nml", "rubber.nml"}
    assert {path.name for path in tmp_path.iterdir()} == names


def test_a_fit_that_fails_is_status_4(tmp_path, monkeypatch, capsys):
    path = write(tmp_path / "dma.csv", "f (Hz),G' (Pa),G'' (Pa)",
                 [(10.0**k, 1e6 * 1.1**k, 1e5) for k in range(-3, 4)])

    def fail(*_, **__):
        raise RuntimeError("Maximum number of iterations reached.")

    monkeypatch.setattr("asperity.rubber.prony_fit.nnls", fail)
    assert main(["fit", str(path), "-o", str(tmp_path / "x.nml")]) == 4
    assert "the fit of" in (message := capsys.readouterr().err) and "found no solution" in message
    assert not (tmp_path / "x.nml").exists()
    with pytest.raises(NotConverged, match="Maximum number of iterations"):
        fit_dma(read_dma(path))


@pytest.mark.parametrize("heads, units", [
    ("f (Hz),Set temperature (°C),T actual (°C),G' (MPa),G'' (MPa)", None),
    ("f,T soll,T ist,G',G''", "Hz,°C,°C,MPa,MPa"),
    ("f (Hz),Temp. set,Temp. probe,G' (MPa),G'' (MPa)", None),
])
def test_of_two_temperatures_one_must_be_named(tmp_path, heads, units):
    frequencies = np.geomspace(0.1, 10.0, 5)
    rows = [(f, round(t), t, a, b) for f, a, b, t in sweeps((0.1, 20.1, 39.9), frequencies)]
    path = write(tmp_path / "two.csv", heads + (f"\n{units}" if units else ""), rows)
    first, second = [head.split(" (")[0] for head in heads.split(",")[1:3]]
    with pytest.raises(ValueError, match=rf"'{first}.*' and '{second}.*' may both be the"
                                         r" temperature: say which"):
        read_dma(path)
    table = read_dma(path, columns={"temperature": heads.split(",")[2]})
    np.testing.assert_allclose(np.unique(table.temperature), (0.1, 20.1, 39.9))
    # A single column that can only be the temperature is taken.
    one = write(tmp_path / "one.csv", ",".join(heads.split(",")[:1] + heads.split(",")[2:])
                + (f"\n{units.replace(',°C', '', 1)}" if units else ""),
                [(f, t, a, b) for f, _, t, a, b in rows])
    np.testing.assert_allclose(np.unique(read_dma(one).temperature), (0.1, 20.1, 39.9))


def test_moduli_that_differ_at_one_frequency_are_reported(tmp_path):
    rows = [(f, a, b, t) for f, a, b, t in sweeps((0.0, 40.0), np.geomspace(0.1, 10.0, 5))]
    path = write(tmp_path / "hidden.csv", "f (Hz),G' (MPa),G'' (MPa),oven", rows)
    (note,) = [note for note in read_dma(path).notes if "same frequency" in note]
    assert "no column is known as the temperature" in note
    assert not read_dma(path, columns={"temperature": "oven"}).notes[1:]
    # Repeated measurements scatter by less.
    path = write(tmp_path / "again.csv", "f (Hz),G' (MPa),G'' (MPa)",
                 [row[:3] for k in range(3) for row in sweeps((20.0,), np.geomspace(0.1, 10.0, 5),
                                                              0.03 * k)])
    assert read_dma(path).notes == []


def test_arguments_of_another_type_are_named(tmp_path):
    path = write(tmp_path / "a.csv", "f (Hz),G' (Pa),G'' (Pa),T (C)",
                 sweeps([20.0], np.logspace(-1, 2, 9)))
    for columns, message in (
            ({"storage": 1.5}, r"^columns: storage = 1\.5: must be the name of a column or its"),
            ("a", "^columns = 'a': must be a dict of names or numbers by role$")):
        with pytest.raises(ValueError, match=message):
            read_dma(path, columns=columns)
    with pytest.raises(ValueError, match=r"^table = 'a\.csv': must be a DmaTable$"):
        fit_dma("a.csv")
    with pytest.raises(ValueError, match=r"^wlf = 3\.0: must be \(c1, c2\) or \(c1, c2, t_ref\)$"):
        fit_dma(read_dma(path), wlf=3.0)


def test_decimal_commas_whose_zeros_are_left_out_are_no_thousands(tmp_path):
    path = tmp_path / "dma.csv"
    path.write_text("f (Hz);G' (MPa);G'' (MPa)\n1;2,345;1,234\n3,162;2,456;1,345\n10;2,567;1,456\n")
    table = read_dma(path)
    np.testing.assert_allclose(table.omega, TWO_PI * np.array([1.0, 3.162, 10.0]))
    np.testing.assert_allclose(table.storage, 1e6 * np.array([2.345, 2.456, 2.567]))


@pytest.mark.parametrize(("head", "noted"), [("T", True), ("T (K)", False), ("T (C)", False)])
def test_temperatures_that_may_be_in_kelvin_are_noted(tmp_path, head, noted):
    path = write(tmp_path / "dma.csv", f"{head},f (Hz),G' (MPa),G'' (MPa)",
                 [[t, f, 2.0, 0.5] for t in (273.0, 293.0) for f in (1.0, 10.0, 100.0)])
    notes = read_dma(path).notes
    assert any("temperatures from 273 to 293 C are unusual" in note for note in notes) == noted


def test_moduli_of_two_kinds_are_refused(tmp_path):
    path = tmp_path / "mixed.csv"
    path.write_text("f (Hz),E' (MPa),G'' (MPa)\n1,2.4,0.03\n10,2.5,0.05\n99,2.7,0.09\n")
    with pytest.raises(ValueError, match="\"E' \\(MPa\\)\" and \"G'' \\(MPa\\)\" are moduli of"):
        read_dma(path)
    np.testing.assert_allclose(read_dma(path, kind="tension").storage, [8e5, 8e5 * 2.5 / 2.4, 9e5])


@pytest.mark.parametrize(("tan_delta", "noted"), [
    (["0.250", "0.300", "0.500"], False), (["0.25", "OVL", "-"], False),
    (["0.25", "0.30", "5.00"], False), (["2.5", "3.0", "5.0"], True),
    (["0.25", "0.36", "0.60"], True)])
def test_a_tan_delta_that_contradicts_the_moduli_is_noted(tmp_path, tan_delta, noted):
    """One wrong cell is no contradiction: the moduli are used in any case."""
    path = tmp_path / "dma.csv"
    rows = zip(["1,2,0.5", "10,3,0.9", "99,4,2"], tan_delta, strict=True)
    path.write_text("\n".join(["f (Hz),G' (MPa),G'' (MPa),tan delta", *map(",".join, rows)]))
    table = read_dma(path)
    np.testing.assert_allclose(table.loss, [5e5, 9e5, 2e6])
    assert any("tan delta contradicts the moduli" in note for note in table.notes) == noted



@pytest.mark.parametrize(("heads", "kind", "noted"), [
    ("G',G''", None, False), ("E',E''", None, False), ("storage,loss", None, True),
    ("Storage modulus,Loss modulus", "shear", False), ("storage,loss", "tension", False),
    ("shear storage modulus,shear loss modulus", None, False)])
def test_a_table_that_does_not_say_its_kind_is_noted(tmp_path, heads, kind, noted):
    """Most tables are of tension, whose moduli are three times as large."""
    path = tmp_path / "dma.csv"
    path.write_text(f"f (Hz),{heads}\nHz,MPa,MPa\n1,2,0.5\n10,3,0.9\n99,4,2\n")
    notes = read_dma(path, kind=kind).notes
    assert any("of shear or of tension: taken as shear" in note for note in notes) == noted


def test_temperatures_below_absolute_zero_are_refused(tmp_path):
    path = tmp_path / "dma.csv"
    path.write_text("f (Hz),G' (MPa),G'' (MPa),T (K)\n1,2,0.5,20\n10,3,0.9,20\n99,4,2,-5\n")
    with pytest.raises(ValueError, match=r"line 4: temperature = -278\.15 C: must be >= -273"):
        read_dma(path)


def test_a_column_has_one_role(tmp_path):
    path = tmp_path / "dma.csv"
    path.write_text("f (Hz),G' (MPa),G'' (MPa)\n1,2,0.5\n10,3,0.9\n99,4,2\n")
    with pytest.raises(ValueError, match="storage and loss are the same column, \"G'\""):
        read_dma(path, columns={"storage": "G'", "loss": "G'"})


def test_shifts_of_a_single_sweep_write_nothing(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "dma.csv").write_text("f (Hz),G' (MPa),G'' (MPa)\n1,2,0.5\n10,3,0.9\n99,4,2\n")
    assert main(["fit", "dma.csv", "-o", "a.nml", "--plot", "a.png", "--shifts", "s.csv"]) == 2
    assert "there are no shifts to write" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["dma.csv"]
