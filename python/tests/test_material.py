"""Prony series against closed forms, the Volterra identity in Laplace space, and known data."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asperity.material import WLF, Prony, master_curve


def laplace_product(material, s):
    """Return s J~(s) times s G~(s), which is 1 for the exact compliance."""
    stiffness = material.g_inf + np.sum(material.g * s * material.tau / (1 + s * material.tau))
    theta, compliance = material.retardation_times, material.retardation_compliances
    creep = 1 / material.instantaneous_modulus + np.sum(compliance / (1 + s * theta))
    return stiffness * (creep + material.fluidity / s)


def test_zener_creep_in_closed_form():
    g0, g1, eta = 1e6, 1e5, 1e5
    t = np.linspace(0, 10, 50)
    expected = 1 / g0 + (1 - np.exp(-t * g1 / eta)) / g1
    material = Prony.from_zener(0.0, [g0], [g1], [eta])
    np.testing.assert_allclose(material.creep_compliance(t), expected, rtol=1e-13)
    assert material.retardation_times == pytest.approx([eta / g1], rel=1e-13)


def test_zener_branches_have_the_modulus_of_their_circuit():
    g_inf, g0, g1, eta = 2e5, np.array([1e6, 3e6]), np.array([1e5, 0.0]), np.array([1e3, 5e4])
    omega = np.logspace(-3, 5, 40)[:, None]
    branch = 1 / (1 / g0 + 1 / (g1 + 1j * omega * eta))
    expected = g_inf + branch.sum(axis=1)
    material = Prony.from_zener(g_inf, g0, g1, eta)
    np.testing.assert_allclose(material.complex_modulus(omega[:, 0]), expected, rtol=1e-13)


def test_twenty_arms_over_fifteen_decades():
    tau = np.logspace(-10, 5, 20)
    g = 1e9 * (tau / tau[0]) ** -0.25
    material = Prony(1e5, g, tau)
    theta = material.retardation_times[::-1]
    assert np.all(theta[1:] > theta[:-1]) and theta.size == 20
    assert np.all(theta > tau) and np.all(theta[:-1] < tau[1:])  # they interlace
    for s in np.logspace(-12, 13, 60):
        assert laplace_product(material, s) == pytest.approx(1.0, rel=2e-14)
    total = 1 / material.instantaneous_modulus + material.retardation_compliances.sum()
    assert total == pytest.approx(1 / material.g_inf, rel=1e-13)
    assert float(material.creep_compliance(0.0)) == 1 / material.instantaneous_modulus


@settings(max_examples=60, deadline=None)
@given(
    g_inf=st.one_of(st.just(0.0), st.floats(1e-6, 1e6)),
    arms=st.lists(
        st.tuples(st.floats(1e-6, 1e9), st.floats(-12, 12)), min_size=1, max_size=20
    ),
)
def test_any_series_has_its_compliance(g_inf, arms):
    material = Prony(g_inf, [a for a, _ in arms], [10.0**b for _, b in arms])
    assert np.all(material.retardation_compliances >= 0)
    for s in np.logspace(-13, 13, 27):
        assert laplace_product(material, s) == pytest.approx(1.0, rel=1e-12)


def test_fluid_flows():
    material = Prony(0.0, [2.0, 1.0], [1.0, 3.0])
    assert material.fluidity == 1 / 5
    assert float(material.creep_compliance(1e9)) == pytest.approx(2e8, rel=1e-8)
    assert material.retardation_times.size == 1


def test_equal_times_act_as_one_arm():
    double = Prony(1.0, [2.0, 3.0, 0.0], [0.7, 0.7, 5.0])
    single = Prony(1.0, [5.0], [0.7])
    t = np.logspace(-3, 3, 20)
    np.testing.assert_allclose(double.creep_compliance(t), single.creep_compliance(t), rtol=1e-14)


def test_relaxation_modulus_has_the_complex_modulus_for_transform():
    from scipy.integrate import quad

    material = Prony(0.5, [2.0, 3.0], [0.4, 2.0])
    w = 1.7

    def decaying(t):
        return float(material.relaxation_modulus(t)) - material.g_inf

    sine = quad(decaying, 0, 60, weight="sin", wvar=w)[0]
    cosine = quad(decaying, 0, 60, weight="cos", wvar=w)[0]
    assert float(material.storage_modulus(w)) == pytest.approx(0.5 + w * sine, rel=1e-9)
    assert float(material.loss_modulus(w)) == pytest.approx(w * cosine, rel=1e-9)
    assert float(material.tan_delta(w)) == pytest.approx(
        w * cosine / (0.5 + w * sine), rel=1e-9
    )


def test_wlf_shift_moves_the_curves_along_the_frequency_axis():
    material, wlf = Prony(1e6, [1e6, 2e6], [1e-3, 1.0]), WLF(17.44, 51.6, -60.0)
    a_t = float(wlf.shift_factor(-20.0))
    assert np.log10(a_t) == pytest.approx(-17.44 * 40 / 91.6)
    warm = material.shifted(-20.0, wlf)
    w = np.logspace(-3, 6, 30)
    np.testing.assert_allclose(
        warm.complex_modulus(w), material.complex_modulus(w * a_t), rtol=1e-13
    )
    assert material.shifted(-60.0, tuple(wlf)) == material


def fractional_solid(omega, low=1e6, high=1e9, exponent=0.4, time=1e-6):
    """Return the fractional Zener (Cole-Cole) modulus, a broad spectrum that no series equals."""
    z = (1j * omega * time) ** exponent
    return low + (high - low) * z / (1 + z)


def test_fit_of_a_broad_spectrum():
    omega = np.logspace(-2, 10, 121)
    data = fractional_solid(omega)
    coarse = Prony.fit(omega, data.real, data.imag)
    assert coarse.fit_errors.rms_storage < 0.02 and coarse.fit_errors.rms_loss < 0.04
    material = Prony.fit(omega, data.real, data.imag, arms_per_decade=2.0)
    assert material.fit_errors.rms_storage < 3e-4 and material.fit_errors.rms_loss < 7e-4
    # the fit is right between the points, too
    between = np.sqrt(omega[10:-11] * omega[11:-10])
    found, wanted = material.complex_modulus(between), fractional_solid(between)
    assert np.max(np.abs(found.real / wanted.real - 1)) < 2e-3
    assert np.max(np.abs(found.imag / wanted.imag - 1)) < 2e-3


def test_fit_of_noisy_data_is_smooth_and_positive():
    rng = np.random.default_rng(3)
    omega = np.logspace(-1, 7, 160)
    data = fractional_solid(omega, low=1e6, high=3e8, time=1e-4)
    noisy = data.real * (1 + 0.03 * rng.standard_normal(omega.size)) + 1j * data.imag * (
        1 + 0.03 * rng.standard_normal(omega.size)
    )
    rough = Prony.fit(omega, noisy.real, noisy.imag, arms_per_decade=2.0, slack=0.0)
    smooth = Prony.fit(omega, noisy.real, noisy.imag, arms_per_decade=2.0)
    assert np.all(smooth.g > 0) and smooth.tau.size == 21  # all arms have a positive modulus
    assert rough.tau.size < 21
    assert np.abs(np.diff(np.log(smooth.g), 2)).max() < 0.5
    assert np.abs(np.diff(np.log(rough.g), 2)).max() > 1.0
    assert smooth.fit_errors.rms_storage < 0.04 and smooth.fit_errors.rms_loss < 0.04
    # and it is nearer to the truth than a fit without smoothing
    for name, true in (("loss_modulus", data.imag), ("storage_modulus", data.real)):
        errors = [
            np.sqrt(np.mean((getattr(series, name)(omega) / true - 1) ** 2))
            for series in (smooth, rough)
        ]
        assert errors[0] < 0.9 * errors[1]


def test_fit_recovers_arms_on_its_own_grid():
    true = Prony(1e6, [4e6, 2e6, 1e6], [1e-2, 1e-1, 1.0])
    omega = np.logspace(0, 2, 41)
    found = Prony.fit(
        omega, true.storage_modulus(omega), true.loss_modulus(omega), tau_range=(1e-2, 1.0),
        slack=0.0,
    )
    np.testing.assert_allclose(found.g, true.g, rtol=1e-8)
    assert found.g_inf == pytest.approx(1e6, rel=1e-8)
    assert found.fit_errors.max_loss < 1e-10


def test_master_curve_of_a_known_shift():
    rubber, wlf = Prony(1e6, np.full(9, 2e6), np.logspace(-6, 2, 9)), WLF(8.86, 101.6, 20.0)
    temperatures = [40.0, -10.0, 0.0, 20.0, 60.0, 10.0]
    omega = np.logspace(-1, 2.5, 40)
    sweeps = [rubber.shifted(t, wlf) for t in temperatures]
    curve = master_curve(
        temperatures,
        [omega] * 6,
        [m.storage_modulus(omega) for m in sweeps],
        [m.loss_modulus(omega) for m in sweeps],
        20.0,
    )
    np.testing.assert_allclose(
        curve.log_shift, np.log10(wlf.shift_factor(curve.temperatures)), atol=0.01
    )
    assert curve.wlf.c1 == pytest.approx(wlf.c1, rel=0.02)
    assert curve.wlf.c2 == pytest.approx(wlf.c2, rel=0.02)
    assert curve.overlap_error < 2e-3
    assert np.all(np.diff(curve.omega) >= 0)
    found = rubber.storage_modulus(curve.omega)
    np.testing.assert_allclose(curve.storage, found, rtol=0.01)


def test_namelist_holds_the_numbers_exactly():
    material = Prony(1e6 / 3, np.linspace(0.1, 1.3, 7) * 1e6, np.logspace(-7, 2, 7))
    text = material.to_namelist(poisson=0.49, temperature=25.0, wlf=(8.86, 101.6, 20.0))
    body = text.removeprefix("&material\n").removesuffix("\n/")
    values = {}
    for piece in body.replace(",\n", ",").splitlines():
        name, numbers = piece.split("=")
        values[name.strip()] = [float(x) for x in numbers.split(",")]
    assert values["shear_modulus"] == [material.g_inf]
    assert values["prony_g"] == material.g.tolist()
    assert values["prony_tau"] == material.tau.tolist()
    assert values["wlf_c1"] == [8.86] and values["reference_temperature"] == [20.0]
    assert values["poisson"] == [0.49] and values["temperature"] == [25.0]
    assert "prony" not in Prony(1e6).to_namelist()
    weak = Prony(1e6, [0.0, 1e6], [1.0, 2.0]).to_namelist()
    assert "prony_g = 1000000.0\n" in weak and "prony_tau = 2.0\n" in weak
    assert max(len(line) for line in text.splitlines()) <= 100


def test_plot_shows_units_and_legend():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    axes = Prony(1e6, [1e6, 2e6], [1e-3, 1.0]).plot()
    assert "rad/s" in axes.get_xlabel() and "Pa" in axes.get_ylabel()
    assert axes.get_xscale() == "log" and len(axes.get_legend().get_texts()) == 4
    assert Prony(1e6).plot(ax=plt.figure().add_subplot()).get_legend() is not None
    plt.close("all")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Prony(-1.0), "g_inf = -1.0: must be a finite number >= 0"),
        (lambda: Prony(0.0), "must be > 0"),
        (lambda: Prony(1.0, [1.0], [0.0]), r"tau\[0\] = 0.0"),
        (lambda: Prony(1.0, [1.0, -2.0], [1.0, 1.0]), r"g\[1\] = -2.0"),
        (lambda: Prony(1.0, [1.0], [1.0, 2.0]), "tau: has 2 values"),
        (lambda: Prony("soft"), "g_inf = 'soft'"),
        (lambda: Prony(float("nan")), "g_inf = nan"),
        (lambda: Prony(1.0).relaxation_modulus(-1.0), "t = -1.0"),
        (lambda: Prony(1.0).creep_compliance([0.0, -1.0]), r"t\[1\] = -1.0"),
        (lambda: Prony(1.0).shifted(-90.0, (17.44, 51.6, -20.0)), "must be > t_ref - c2"),
        (lambda: Prony(1.0).shifted(0.0, (17.44, 51.6)), "must be"),
        (lambda: Prony.fit([1.0, 2.0], [1.0, 2.0], [1.0, 0.0]), r"loss\[1\] = 0.0"),
        (lambda: Prony.fit([1.0, 2.0], [1.0], [1.0, 1.0]), "storage: has 1 values"),
        (lambda: Prony.from_zener(0.0, [1.0], [1.0], []), "eta: has 0 values"),
        (lambda: Prony(1.0).to_namelist(temperature=3.0), "give both"),
        (lambda: Prony(1.0).to_namelist(poisson=0.6), "poisson = 0.6"),
        (lambda: Prony(1.0).to_namelist(temperature=20.0, wlf=3.0), r"wlf = 3.0: must be \(c1,"),
        (lambda: Prony.fit([1.0] * 3, [1.0] * 3, [1.0] * 3, tau_range=1.0),
         r"tau_range = 1.0: must be \(shortest, longest\)"),
        (lambda: master_curve([1.0], [[1.0]], [[1.0]], [[1.0]], 2.0), "reference = 2.0"),
        (lambda: master_curve([1.0, 2.0], 1.0, 1.0, 1.0, 1.0), "omega = 1.0: must be a list of 2"),
    ],
)
def test_wrong_values_are_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_moduli_at_extreme_frequencies_are_numbers():
    """The square of omega tau used to overflow."""
    rubber = Prony(1.0, [2.0], [1e180])
    np.testing.assert_allclose(rubber.complex_modulus([1e-190, 1e-180, 1e-3, 1e100]),
                               [1.0 + 2e-10j, 2.0 + 1.0j, 3.0, 3.0], rtol=1e-9)
