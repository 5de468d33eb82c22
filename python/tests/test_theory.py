"""Each known solution against an independent quadrature, model or published value."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp
from scipy.special import ellipk, erf

import asperity
from asperity import theory
from asperity.material import Prony

# near round-off the quadratures warn that they cannot be more exact
pytestmark = pytest.mark.filterwarnings("ignore::scipy.integrate.IntegrationWarning")


def boussinesq(stress, end, r, modulus, breaks=()):
    """Return u_z at r of an axisymmetric stress on [0, end]: 4/(pi E*) int s/(r+s) K p ds.

    The integral runs over the angle of s = end sin(angle), which tames edge singularities.
    """

    def integrand(angle):
        s = end * math.sin(angle)
        m = 4 * r * s / (r + s) ** 2
        return stress(s) * s / (r + s) * ellipk(min(m, 1 - 1e-16)) * end * math.cos(angle)

    points = sorted({0.0, math.pi / 2} | {math.asin(b / end) for b in (*breaks, r) if b < end})
    total = 0.0
    for low, high in pairwise(points):
        total += quad(integrand, low, high, epsabs=0, epsrel=1e-10, limit=200)[0]
    return 4 / (math.pi * modulus) * total


def axisymmetric_force(stress, end, breaks=()):
    def integrand(angle):
        s = end * math.sin(angle)
        return stress(s) * 2 * math.pi * s * end * math.cos(angle)

    points = sorted({0.0, math.pi / 2} | {math.asin(b / end) for b in breaks})
    return sum(
        quad(integrand, low, high, epsabs=0, epsrel=1e-11, limit=200)[0]
        for low, high in pairwise(points)
    )


# ---- Hertz ------------------------------------------------------------------------------------


def test_hertz_values():
    contact = theory.hertz(0.05, 344.828e6, contact_radius=1e-3)
    assert contact.force == pytest.approx(9.19540, rel=2e-6)
    assert contact.peak_pressure == pytest.approx(4.39048e6, rel=2e-6)
    assert contact.approach == pytest.approx(2e-5, rel=1e-12)
    for given_ in ({"force": contact.force}, {"approach": contact.approach}):
        assert theory.hertz(0.05, 344.828e6, **given_).contact_radius == pytest.approx(1e-3)


def test_hertz_pressure_makes_the_force_and_the_displacement():
    c = theory.hertz(0.02, 3e6, force=0.4)
    a = c.contact_radius
    assert axisymmetric_force(lambda s: float(c.pressure(s)), a) == pytest.approx(0.4, rel=1e-10)
    for t in (0.0, 0.3, 0.9, 1.0, 1.1, 2.5, 99.0, 101.0, 1e4):
        expected = boussinesq(lambda s: float(c.pressure(s)), a, t * a, 3e6)
        assert float(c.displacement(t * a)) == pytest.approx(expected, rel=1e-8)
    assert float(c.pressure(1.01 * a)) == 0.0


def test_hertz_without_load():
    c = theory.hertz(1.0, 1.0, force=0.0)
    assert c.contact_radius == 0.0
    assert c.displacement([0.0, 1.0]).tolist() == [0.0, 0.0]
    assert c.pressure([0.0, 1.0]).tolist() == [0.0, 0.0]


def test_line_contact_pressure_makes_load_and_displacement():
    c = theory.hertz_line(0.01, 1.3e6, load=37.0)
    a = c.half_width
    load = quad(lambda t: float(c.pressure(a * math.sin(t))) * a * math.cos(t), -1.570796, 1.570796)
    assert load[0] == pytest.approx(37.0, rel=1e-8)
    for x in (0.4 * a, 1.5 * a, 7.0 * a):

        def potential(s, x=x):
            return float(c.pressure(s)) * math.log(abs((x - s) / s))

        total = quad(potential, -a, a, points=[0.0, min(x, 0.999999 * a)], limit=400)[0]
        expected = -2 / (math.pi * 1.3e6) * total
        assert float(c.displacement(x)) == pytest.approx(expected, rel=1e-6)
    assert theory.hertz_line(0.01, 1.3e6, half_width=a).load == pytest.approx(37.0, rel=1e-12)


# ---- Westergaard ------------------------------------------------------------------------------


@pytest.mark.parametrize("fraction", [0.05, 0.4, 0.9])
def test_westergaard_against_fourier_series(fraction):
    d, wave, e = 2e-6, 1e-3, 5e6
    c = theory.westergaard(d, wave, e, fraction * math.pi * e * d / wave)
    n = 2**16
    x = np.arange(n) * wave / n
    p = c.pressure(x)
    assert p.mean() == pytest.approx(c.mean_pressure, rel=1e-6)
    q = 2 * np.pi * np.fft.rfftfreq(n, wave / n)
    spectrum = np.fft.rfft(p)
    spectrum[1:] *= 2 / (e * q[1:])
    spectrum[0] = 0
    gap = np.fft.irfft(spectrum, n) - d * np.cos(2 * np.pi * x / wave)
    gap -= gap[0]
    np.testing.assert_allclose(c.gap(x), gap, atol=1e-6 * d)
    assert np.mean(c.gap(x)) == pytest.approx(c.mean_gap, rel=1e-6)
    assert np.mean(p > 0) == pytest.approx(c.area_fraction, abs=2 / n)


def test_westergaard_full_and_no_contact():
    full = theory.westergaard(1e-6, 1e-3, 1e6, 2 * math.pi * 1e3)
    assert full.area_fraction == pytest.approx(1.0) and full.mean_gap == 0.0
    assert full.pressure([0.0, 5e-4]).tolist() == pytest.approx([3e3 * math.pi, 1e3 * math.pi])
    touch = theory.westergaard(1e-6, 1e-3, 1e6, 0.0)
    assert touch.mean_gap == pytest.approx(1e-6) and touch.half_width == 0.0
    assert float(touch.gap(5e-4)) == pytest.approx(2e-6)


# ---- adhesion ---------------------------------------------------------------------------------


def test_jkr_values():
    r, e, w = 2e-3, 3e6, 0.05
    unit_a = (math.pi * w * r * r / (4 * e / 3)) ** (1 / 3)
    unit_f = math.pi * w * r
    pull_off = theory.jkr(r, e, w, force=-1.5 * unit_f)
    assert pull_off.contact_radius / unit_a == pytest.approx(1.144714, abs=1e-6)
    assert theory.jkr(r, e, w, force=0.0).contact_radius / unit_a == pytest.approx(
        1.817121, abs=1e-6
    )
    c = theory.jkr(r, e, w, contact_radius=1.7 * unit_a)
    assert c.force / unit_f == pytest.approx(1.7**3 - math.sqrt(6) * 1.7**1.5, rel=1e-12)
    assert theory.dmt(r, e, w, contact_radius=1.7 * unit_a).force / unit_f == pytest.approx(
        1.7**3 - 2
    )


@pytest.mark.parametrize("force", [-0.1e-3, 0.0, 2e-3])
def test_jkr_fields(force):
    r, e, w = 2e-3, 3e6, 0.05
    c = theory.jkr(r, e, w, force=force)
    a = c.contact_radius

    def stress(s):
        return float(c.pressure(min(s, a * (1 - 1e-15))))

    assert axisymmetric_force(stress, a) == pytest.approx(force, abs=1e-9)
    for t in (0.0, 0.5, 1.5, 30.0):
        assert float(c.displacement(t * a)) == pytest.approx(
            boussinesq(stress, a, t * a, e), abs=1e-7 * a * a / r
        )
    # the released energy: the suction at the edge has K^2/(2 E*) = w, K = p1 sqrt(pi a)
    edge = float(c.pressure(a * (1 - 1e-9)))
    k = -edge * math.sqrt(2 * math.pi * a * 1e-9)
    assert k * k / (2 * e) == pytest.approx(w, rel=1e-3)


@pytest.mark.parametrize(("lam", "pull_off"), [(0.1, -1.95059), (1.0, -1.60073), (5.0, -1.50635)])
def test_maugis_pull_off(lam, pull_off):
    r, e, w = 2e-3, 3e6, 0.05
    c = theory.maugis(r, e, w, force=0.0, maugis_parameter=lam)
    assert c.pull_off_force / (math.pi * w * r) == pytest.approx(pull_off, abs=6e-6)


@pytest.mark.parametrize("lam", [0.05, 0.5, 3.0])
@pytest.mark.parametrize("force", [-1e-4, 0.0, 3e-3])
def test_maugis_state_satisfies_the_mixed_problem(lam, force):
    """The stresses carry the force, flatten the sphere, and open the gap to w/sigma at c."""
    r, e, w = 2e-3, 3e6, 0.05
    c = theory.maugis(r, e, w, force=force, maugis_parameter=lam)
    a, end = c.contact_radius, c.adhesion_radius

    def stress(s):
        return float(c.pressure(s))

    scale = math.pi * w * r
    assert axisymmetric_force(stress, end, [a]) == pytest.approx(force, abs=1e-8 * scale)
    for t in (0.0, 0.7):
        assert boussinesq(stress, end, t * a, e, [a]) == pytest.approx(
            c.approach - (t * a) ** 2 / (2 * r), abs=1e-7 * a * a / r
        )
    gap = boussinesq(stress, end, end, e, [a]) - c.approach + end**2 / (2 * r)
    assert gap * c.adhesive_stress == pytest.approx(w, rel=1e-5)
    same = theory.maugis(r, e, w, contact_radius=a, maugis_parameter=lam)
    assert same.force == pytest.approx(force, abs=1e-9 * scale)


def test_maugis_between_its_limits():
    # thesis, fig. 1.7
    r, e, w, f = 1.0, 4 * 0.37, 3.2e-5, 1e-5
    soft, hard = theory.jkr(r, e, w, force=f), theory.dmt(r, e, w, force=f)
    radii = [
        theory.maugis(r, e, w, force=f, tabor=t).contact_radius for t in np.logspace(-5, 5, 21)
    ]
    assert np.all(np.diff(radii) > 0)
    assert radii[0] == pytest.approx(hard.contact_radius, rel=1e-4)
    assert radii[-1] == pytest.approx(soft.contact_radius, rel=1e-4)
    stiff = theory.maugis(r, e, w, force=f, tabor=1e5)
    assert stiff.approach == pytest.approx(soft.approach, rel=1e-4)
    assert stiff.pull_off_force == pytest.approx(soft.pull_off_force, rel=1e-4)
    loose = theory.maugis(r, e, w, force=f, tabor=1e-5)
    assert loose.pull_off_force == pytest.approx(hard.pull_off_force, rel=1e-3)


@pytest.mark.parametrize("lam", 10.0 ** np.arange(-9, 10, 3))
def test_maugis_force_and_displacement_are_inverse(lam):
    unit = math.pi * 0.05 * 2e-3
    for force in (-1.4999, -1.2, 0.0, 1.0, 1e6):
        c = theory.maugis(2e-3, 3e6, 0.05, force=force * unit, maugis_parameter=lam)
        same = theory.maugis(
            2e-3, 3e6, 0.05, contact_radius=c.contact_radius, maugis_parameter=lam
        )
        assert same.force / unit == pytest.approx(force, rel=1e-10, abs=1e-10)
        assert -2.0 <= c.pull_off_force / unit <= -1.5 * (1 - 1e-12)


def test_ways_to_give_the_range_agree():
    r, e, w, h = 1e-3, 1e6, 0.05, 1e-6
    tabor = theory.tabor_parameter(r, e, w, h)
    by_range = theory.maugis(r, e, w, force=0.0, range=h)
    assert by_range.adhesive_stress == pytest.approx(w / h)
    # Lennard-Jones's peak stress with equilibrium distance z0 = h is 16/(9 sqrt 3) w/h
    by_tabor = theory.maugis(r, e, w, force=0.0, tabor=tabor)
    assert by_tabor.adhesive_stress == pytest.approx(16 / (9 * math.sqrt(3)) * w / h)
    assert by_tabor.maugis_parameter / tabor == pytest.approx(1.157, abs=5e-5)


# ---- Mindlin ----------------------------------------------------------------------------------

SPHERE = {
    "radius": 0.05, "shear_modulus": 200e6, "poisson": 0.42, "coefficient": 0.3, "force": 9.196,
}


def test_mindlin_values():
    for ratio in (0.2, 0.9):
        q = ratio * 0.3 * 9.196
        c = theory.mindlin(**SPHERE, tangential=q)
        a = c.normal.contact_radius
        assert float(c.stick_radius) == pytest.approx(a * (1 - ratio) ** (1 / 3))
        expected = 3 * 0.3 * 9.196 * 1.58 / (16 * a * 200e6) * (1 - (1 - ratio) ** (2 / 3))
        assert float(c.shift) == pytest.approx(expected)
        back = theory.mindlin(**SPHERE, shift=float(c.shift))
        assert float(back.tangential) == pytest.approx(q)
        assert float(back.stick_radius) == pytest.approx(float(c.stick_radius))


@pytest.mark.parametrize("path", [[0.6], [0.8, -0.3], [0.9, -0.7, 0.4, 0.1], [0.5, -0.5, 0.2, 0.9]])
def test_mindlin_traction_makes_force_and_shift(path):
    bound = 0.3 * 9.196
    c = theory.mindlin(**SPHERE, tangential=np.array(path) * bound)
    a = c.normal.contact_radius
    r = a * np.sin((np.arange(200000) + 0.5) / 200000 * np.pi / 2)
    dr = a * np.cos((np.arange(200000) + 0.5) / 200000 * np.pi / 2) * np.pi / 4e5
    q = c.traction(r)
    assert np.sum(2 * np.pi * r * q * dr) == pytest.approx(path[-1] * bound, abs=1e-7 * bound)
    # Cerruti, on the axis, which sticks: u_x = (2 - nu)/(2 G) int q dr
    assert np.sum(q * dr) * 1.58 / (2 * 200e6) == pytest.approx(float(c.shift[-1]), rel=1e-6)
    assert np.all(np.abs(q) <= 0.3 * c.normal.pressure(r) * (1 + 1e-12))
    # and the same end state when driven by the shift
    driven = theory.mindlin(**SPHERE, shift=c.shift)
    np.testing.assert_allclose(driven.tangential, c.tangential, atol=1e-12 * bound)
    np.testing.assert_allclose(driven.traction(r[::1000]), q[::1000], atol=1e-9 * q.max())


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(-2.5, 2.5), min_size=1, max_size=12))
def test_mindlin_history_against_sliding_elements(path):
    """Iwan's model has sliding springs whose strengths follow from the first loading curve."""
    bound = SPHERE["coefficient"] * SPHERE["force"]
    c = theory.mindlin(**SPHERE, shift=0.0)
    result = theory.mindlin(**SPHERE, shift=np.array(path) * c.slide_shift)
    z = (np.arange(4000) + 0.5) / 4000
    strength = 1 - z**2
    force = np.zeros_like(z)
    before = 0.0
    for value, found in zip(path, result.tangential, strict=True):
        force = np.clip(force + value - before, -strength, strength)
        before = value
        assert found / bound == pytest.approx(1.5 * force.mean(), abs=2e-6)


# ---- viscoelastic sphere ----------------------------------------------------------------------

RUBBER = Prony(1e6, 4e6 * 0.5 ** np.arange(8), np.logspace(-5, 2, 8))


def test_lee_radok_thesis_case():
    solid = Prony.from_zener(0.0, [1e6], [1e5], [1e5])
    t = np.array([0.0, 0.3, 1.0, 1e4])
    c = theory.lee_radok(1e-3, 2e-5, solid, t)
    creep = 1e-6 + 1e-5 * (1 - np.exp(-t))
    np.testing.assert_allclose(c.contact_radius**3, 3 / 16 * 1e-3 * 2e-5 * creep, rtol=1e-12)
    in_mm = c.contact_radius[[0, 2, 3]] * 1e3
    assert in_mm == pytest.approx([0.015536, 0.030167, 0.034552], abs=6e-7)


def test_lee_radok_is_hertz_for_an_elastic_solid():
    c = theory.lee_radok(0.01, 0.2, Prony(1e6), [0.0, 1.0], poisson=0.3)
    elastic = theory.hertz(0.01, 2e6 / 0.7, force=0.2)
    assert c.contact_radius == pytest.approx([elastic.contact_radius] * 2)
    r = np.linspace(0, 1.1, 12) * elastic.contact_radius
    np.testing.assert_allclose(c.pressure(r, 0.5), elastic.pressure(r), rtol=1e-10)


@pytest.mark.parametrize(
    "force",
    [0.05, np.array([0.01, 0.02, 0.021, 0.08]), lambda t: 0.02 + 0.03 * t / (1 + t)],
    ids=["step", "table", "function"],
)
@pytest.mark.parametrize("poisson", [0.5, 0.35])
def test_lee_radok_pressure_carries_the_force(force, poisson):
    t = np.array([0.0, 1e-3, 0.7, 30.0])
    c = theory.lee_radok(0.01, force, RUBBER, t, poisson=poisson)
    for i in (2,) if callable(force) else (0, 2, 3):
        a = c.contact_radius[i]
        nodes, weights = np.polynomial.legendre.leggauss(8 if callable(force) else 60)
        angle = (nodes + 1) * np.pi / 4
        r = a * np.sin(angle)
        p = c.pressure(r, t[i])
        total = np.sum(weights * np.pi / 4 * p * 2 * np.pi * r * a * np.cos(angle))
        assert total == pytest.approx(c.force[i], rel=2e-3 if callable(force) else 2e-5)


def test_lee_radok_force_in_three_ways():
    t = np.linspace(0, 5, 7)
    table = theory.lee_radok(0.01, 0.01 + 0.02 * t, RUBBER, t)
    function = theory.lee_radok(0.01, lambda s: 0.01 + 0.02 * s, RUBBER, t)
    np.testing.assert_allclose(table.contact_radius, function.contact_radius, rtol=1e-11)
    # a ramp, by quadrature of J
    expected = 3 / 16 * 0.01 * (
        0.01 * RUBBER.creep_compliance(5.0)
        + 0.02 * quad(lambda s: float(RUBBER.creep_compliance(s)), 0, 5, epsrel=1e-12)[0]
    )
    assert table.contact_radius[-1] ** 3 == pytest.approx(float(expected), rel=1e-9)


def test_lee_radok_refuses_a_shrinking_contact():
    with pytest.raises(ValueError, match="must not fall"):
        theory.lee_radok(0.01, [0.05, 0.01], RUBBER, [0.0, 1e-3])
    with pytest.raises(ValueError, match=r"^force: is -1 N at .* s: must be >= 0$"):
        theory.lee_radok(0.01, lambda t: -np.ones_like(t), RUBBER, [0.0, 1e-3])


# ---- viscoelastic cylinder --------------------------------------------------------------------

ZENER = Prony.from_zener(0.0, [2.75e6], [2.75e6 / 9], [2.75e6 / 9 * 0.01])


@pytest.mark.parametrize(
    ("velocity", "friction"), [(5e-3, 0.0043375), (0.02, 0.0154267), (0.1, 0.0367342)]
)
def test_hunter_values(velocity, friction):
    assert theory.hunter(0.01, 50.0, velocity, ZENER).friction == pytest.approx(friction, abs=6e-8)


@pytest.mark.parametrize("velocity", [1e-4, 5e-3, 0.1, 10.0, 1e4])
def test_hunter_pressure_has_the_load_and_the_moment(velocity):
    c = theory.hunter(0.01, 50.0, velocity, ZENER)
    nodes, weights = np.polynomial.legendre.leggauss(400)
    angle = (nodes + 1) * np.pi / 2
    x = c.centre + c.half_width * np.cos(angle)
    p = c.pressure(x)
    width = weights * np.pi / 2 * c.half_width * np.sin(angle)
    assert np.all(p >= -1e-9 * p.max())
    assert np.sum(width * p) == pytest.approx(50.0, rel=1e-6)
    assert np.sum(width * p * x) / 50.0 / 0.01 == pytest.approx(
        c.friction, rel=1e-5, abs=1e-6 * c.half_width / 0.01
    )
    edges = np.array([c.trailing_edge, c.leading_edge]) * (1 - 1e-12)
    assert np.all(np.abs(c.pressure(edges)) < 1e-4 * p.max())


@pytest.mark.parametrize(("velocity", "poisson"), [(5e-3, 0.5), (0.05, 0.3), (0.5, 0.5)])
def test_hunter_pressure_flattens_the_solid(velocity, poisson):
    """Creep by quadrature, then the elastic line-load integral: u' must be -x/R in contact."""
    radius, load = 0.01, 50.0
    c = theory.hunter(radius, load, velocity, ZENER, poisson=poisson)
    glassy = 1 / ZENER.instantaneous_modulus
    theta, j = float(ZENER.retardation_times[0]), float(ZENER.retardation_compliances[0])
    length = velocity * theta
    nodes, weights = np.polynomial.legendre.leggauss(80)

    def strain(x):
        """Return int J dp at the point that was at x + V t a time t ago."""
        low = max(x, c.trailing_edge)
        if low >= c.leading_edge:
            return 0.0
        start = math.acos((low - c.centre) / c.half_width)
        angle = 0.5 * start * (nodes + 1)
        s = c.centre + c.half_width * np.cos(angle)
        width = 0.5 * start * weights * c.half_width * np.sin(angle)
        past = np.sum(width * np.exp((x - s) / length) * c.pressure(s))
        return glassy * float(c.pressure(x)) + j / length * float(past)

    span = np.linspace(0, np.pi, 2001)
    grid = c.centre + c.half_width * np.cos(span)
    values = np.array([strain(x) for x in grid])
    tail = values[-1]
    for angle in (0.6, 1.5, 2.6):
        x0 = c.centre + c.half_width * math.cos(angle)
        here = float(np.interp(-x0, -grid, values))
        with np.errstate(divide="ignore", invalid="ignore"):
            smooth = (values - here) / (x0 - grid)
        k = int(np.argmin(np.abs(grid - x0)))
        smooth[k] = 0.5 * (smooth[k - 1] + smooth[k + 1])
        inner = np.trapezoid(smooth * c.half_width * np.sin(span), span)
        inner += here * math.log((x0 - c.trailing_edge) / (c.leading_edge - x0))
        outer = quad(
            lambda y, x0=x0: tail * math.exp(-y / length) / (x0 - c.trailing_edge + y),
            0, 60 * length, limit=400, points=[length, 5 * length],
        )[0]
        slope = -(1 - poisson) / math.pi * (inner + outer)
        assert slope == pytest.approx(-x0 / radius, abs=2e-4 * c.half_width / radius)


def test_hunter_limits():
    slow = theory.hunter(0.01, 50.0, 1e-6, ZENER)
    relaxed = theory.hertz_line(0.01, 4 * ZENER.equilibrium_modulus, load=50.0)
    assert slow.half_width == pytest.approx(relaxed.half_width, rel=1e-4)
    # mu R/a0 -> (1 - G_e/G_0) V tau_creep/a0
    assert slow.friction == pytest.approx(0.9 * 1e-6 * 0.01 / 0.01, rel=1e-4)
    fast = theory.hunter(0.01, 50.0, 1e5, ZENER)
    glassy = theory.hertz_line(0.01, 4 * ZENER.instantaneous_modulus, load=50.0)
    assert fast.half_width == pytest.approx(glassy.half_width, rel=1e-4)
    assert 0 < fast.friction < 1e-6


@pytest.mark.parametrize("velocity", 10.0 ** np.arange(-12, 13, 3))
@pytest.mark.parametrize("ratio", [1e-6, 1.0, 1e3])
def test_hunter_at_any_speed(velocity, ratio):
    c = theory.hunter(0.01, 50.0, velocity, Prony(1e6, [1e6 * ratio], [1e-2]))
    nodes, weights = np.polynomial.legendre.leggauss(300)
    angle = (nodes + 1) * np.pi / 2
    p = c.pressure(c.centre + c.half_width * np.cos(angle))
    width = weights * np.pi / 2 * c.half_width * np.sin(angle)
    assert np.sum(width * p) == pytest.approx(50.0, rel=1e-6)
    assert 0 < c.friction < c.leading_edge / 0.01  # the resultant lies within the contact


def test_thesis_cylinder():
    solid = Prony(0.333e6, [3e6], [1.11e-3])
    c = theory.hunter(0.01, 100.0, 0.11, solid)
    assert c.friction_force == pytest.approx(4.71, abs=0.005)
    assert c.total_friction_force(1.5, slope_effect=False) == pytest.approx(154.7, abs=0.05)
    assert c.total_friction_force(1.5) == pytest.approx(166.9, abs=0.05)
    assert c.total_friction_force(0.0) == pytest.approx(c.friction_force, rel=1e-6)


# ---- full contact -----------------------------------------------------------------------------


def test_full_contact_steady_friction():
    q, d, v, nu = np.array([3e4, -1e4]), 2e-7, np.array([0.2, 0.5]), 0.4
    found = theory.full_contact_waves(d, q, v, RUBBER, poisson=nu, phase=0.3)
    omega = float(q @ v)
    loss = 2 * float(RUBBER.loss_modulus(omega)) / (1 - nu)
    expected = q * np.hypot(*q) * d**2 * loss / 4
    np.testing.assert_allclose(found.friction_stress, expected, rtol=1e-12)
    assert found.friction_stress @ v > 0


@pytest.mark.parametrize("start", ["relaxed", "glassy"])
def test_full_contact_start_up_against_integration_in_time(start):
    """Two oblique waves on a grid; the reference integrates each arm's differential equation."""
    solid = Prony(1e6, [2e6, 5e6], [1e-3, 2e-2])
    q = np.array([[2e4, 1e4], [-1e4, 3e4]])
    d, phase, v, nu = np.array([1e-6, 4e-7]), np.array([0.0, 1.0]), np.array([0.02, 0.01]), 0.5
    times = np.array([0.0, 1e-3, 3e-3])
    found = theory.full_contact_waves(
        d, q, v, solid, poisson=nu, phase=phase, times=times, start=start
    )
    n = 32
    base = 2 * np.pi / 1e4
    x, y = np.meshgrid(np.arange(n) * base / n, np.arange(n) * base / n)

    def height(t):
        return sum(
            d[i] * np.cos(q[i, 0] * (x - v[0] * t) + q[i, 1] * (y - v[1] * t) + phase[i])
            for i in range(2)
        )

    def rate(t):
        return sum(
            d[i] * (q[i] @ v)
            * np.sin(q[i, 0] * (x - v[0] * t) + q[i, 1] * (y - v[1] * t) + phase[i])
            for i in range(2)
        )

    arms = []
    for g, tau in zip(solid.g, solid.tau, strict=True):
        first = g * height(0.0) if start == "glassy" else np.zeros((n, n))
        result = solve_ivp(
            lambda t, m, g=g, tau=tau: g * rate(t).ravel() - m / tau,
            (0, times[-1]), first.ravel(), t_eval=times, rtol=1e-10, atol=1e-10, method="DOP853",
        )
        arms.append(result.y.T.reshape(-1, n, n))
    kx = 2 * np.pi * np.fft.fftfreq(n, base / n)
    norm = np.hypot(kx[None, :], kx[:, None])
    for i, t in enumerate(times):
        stress = solid.g_inf * height(t) + sum(arm[i] for arm in arms)
        p = np.fft.ifft2(np.fft.fft2(stress) * norm / (1 - nu)).real
        np.testing.assert_allclose(found.pressure(x, y)[i], p, atol=1e-7 * np.abs(p).max())
        np.testing.assert_allclose(found.height(x, y)[i], height(t), atol=1e-18)
        spectrum = np.fft.fft2(height(t))
        for axis, k in enumerate((kx[None, :], kx[:, None])):
            slope = np.fft.ifft2(1j * k * spectrum).real
            assert found.friction_stress[i, axis] == pytest.approx(
                -np.mean(p * slope), abs=1e-7 * np.abs(p).max() * np.abs(slope).max()
            )
    assert np.all(found.full_pressure_bound >= np.abs(found.pressure(x, y)).max(axis=(1, 2)))
    late = theory.full_contact_waves(d, q, v, solid, times=1.0, start=start)
    steady = theory.full_contact_waves(d, q, v, solid)
    np.testing.assert_allclose(late.friction_stress, steady.friction_stress, rtol=1e-10)


# ---- Persson ----------------------------------------------------------------------------------

WIDE = Prony(1e6, 3e6 * 2.0 ** np.arange(7), np.logspace(-2, -8, 7))
PSD = theory.self_affine_psd(0.8, 1e-3, 4e-4, 1e-6, rms_slope=0.5)


def test_moments_of_the_spectrum():
    k, phi = PSD
    h = 0.8
    c = phi[0]
    height = c * (k[1] ** 2 - k[0] ** 2) / 2
    height += c * k[1] ** 2 * (1 - (k[2] / k[1]) ** (-2 * h)) / (2 * h)
    assert theory.psd_moments(k, phi)[0] ** 2 == pytest.approx(height / (2 * np.pi), rel=1e-12)
    assert theory.psd_moments(k, phi)[1] == pytest.approx(0.5, rel=1e-12)
    k, phi = theory.self_affine_psd(0.8, 4e-4, 4e-4, 1e-6, rms_height=1e-6)
    assert k.size == 2 and theory.psd_moments(k, phi)[0] == pytest.approx(1e-6, rel=1e-12)


def test_persson_area_slopes():
    p = 1e-4
    assert float(theory.persson_area(p, 2.0, 0.5)) / p == pytest.approx(math.sqrt(8 / math.pi))
    assert float(theory.bush_gibson_thomas(p, 2.0, 0.5)) / p == pytest.approx(
        math.sqrt(2 * math.pi)
    )
    assert float(theory.persson_area(10.0, 2.0, 0.5)) == pytest.approx(1.0)


@pytest.mark.parametrize(("velocity", "modulus"), [(0.0, "g_inf"), (1e13, "instantaneous_modulus")])
def test_persson_is_elastic_when_very_slow_or_very_fast(velocity, modulus):
    found = theory.persson(*PSD, WIDE, 2e5, velocity)
    expected = theory.persson_area(2e5, 4 * getattr(WIDE, modulus), 0.5)
    assert float(found.contact_area) == pytest.approx(float(expected), rel=1e-8)
    assert float(found.friction) == pytest.approx(0.0, abs=1e-6)
    assert np.all(np.diff(found.area) <= 1e-15) and found.area[0] <= 1.0
    fluid = theory.persson(*PSD, Prony(0.0, [1e6], [1.0]), 1.0, 0.0)
    assert float(fluid.contact_area) == 1.0 and float(fluid.friction) == 0.0


@pytest.mark.parametrize(("velocity", "gamma"), [(0.01, 1.0), (1.0, 0.45), (100.0, 0.0)])
def test_persson_against_direct_quadrature(velocity, gamma):
    k, phi = PSD
    p, nu = 3e5, 0.45
    found = theory.persson(k, phi, WIDE, p, velocity, poisson=nu, gamma=gamma)
    # the nodes are dense near the first wave number, where the area may decrease steeply
    x = np.log(k[0]) + np.log(k[-1] / k[0]) * np.linspace(0, 1, 6001) ** 4
    q = np.exp(x)
    step = np.diff(x)
    c = np.exp(np.interp(x, np.log(k), np.log(phi))) / (4 * np.pi**2)
    # phi passes from 0 to pi/2 four times; the nodes are dense where cos vanishes
    z, w = np.polynomial.legendre.leggauss(400)
    z, w = (z + 1) / 2, w / 2
    cosine, w = np.sin(np.pi / 2 * z**4), 4 * np.pi / 2 * 4 * z**3 * w
    modulus = np.array([WIDE.complex_modulus(a * velocity * cosine) for a in q]) * 2 / (1 - nu)
    f = q**3 * c * ((np.abs(modulus) ** 2) @ w) / 8 / p**2 * q
    g = np.concatenate([[0], np.cumsum((f[1:] + f[:-1]) / 2 * step)])
    with np.errstate(divide="ignore"):
        area = erf(0.5 / np.sqrt(g))
    s = gamma + (1 - gamma) * area**2
    f = 0.5 * q**3 * c * s * area * ((modulus.imag * cosine) @ w) / p * q
    friction = np.sum((f[1:] + f[:-1]) / 2 * step)
    assert float(found.contact_area) == pytest.approx(area[-1], rel=1e-5)
    assert float(found.friction) == pytest.approx(friction, rel=1e-5)
    np.testing.assert_allclose(found.area, np.interp(np.log(found.wavenumber), x, area), rtol=2e-4)
    assert float(found.friction_up_to[-1]) == float(found.friction)


def ring_of_waves(k0, count=720):
    angle = (np.arange(count) + 0.5) * np.pi / count
    return k0 * np.column_stack([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize("times", [None, [0.0, 1e-5, 1e-4, 1e-2]])
def test_persson_at_high_pressure_is_full_contact(times):
    """The road is a narrow band of waves in all directions; steady or started from rest."""
    k0, width, v, p = 1e5, 1e-7, 0.3, 1e12
    k = np.array([k0, k0 * (1 + width)])
    psd = np.full(2, 1e-18 / width)
    waves = ring_of_waves(k0)
    mean_square = psd[0] * k0**2 * width / (2 * np.pi)
    amplitude = math.sqrt(2 * mean_square / len(waves))
    full = theory.full_contact_waves(amplitude, waves, (v, 0.0), WIDE, times=times)
    if times is None:
        found = theory.persson(k, psd, WIDE, p, v, gamma=0.3)
    else:
        found = theory.persson_speed_step(k, psd, WIDE, p, 0.0, v, times, gamma=0.3)
    scale = np.abs(full.friction_stress[..., 0]).max()
    np.testing.assert_allclose(found.friction * p, full.friction_stress[..., 0], atol=1e-5 * scale)
    np.testing.assert_allclose(found.contact_area, 1.0, rtol=1e-6)
    # the stress variance, where the contact is far from full
    p = 1e3
    if times is None:
        found = theory.persson(k, psd, WIDE, p, v)
    else:
        found = theory.persson_speed_step(k, psd, WIDE, p, 0.0, v, times)
    variance = 0.5 * np.sum(np.abs(full.pressures) ** 2, axis=-1)
    np.testing.assert_allclose(found.contact_area, erf(p / np.sqrt(2 * variance)), rtol=1e-5)


def test_speed_step_joins_the_steady_states():
    times = [0.0, 1e-6, 1e-4, 1e-2, 10.0]
    found = theory.persson_speed_step(*PSD, WIDE, 1e5, 0.01, 3.0, times, gamma=0.45)
    before, after = (theory.persson(*PSD, WIDE, 1e5, v, gamma=0.45) for v in (0.01, 3.0))
    assert found.friction[0] == pytest.approx(float(before.friction), rel=1e-4)
    assert found.contact_area[0] == pytest.approx(float(before.contact_area), rel=1e-4)
    assert found.friction[-1] == pytest.approx(float(after.friction), rel=1e-12)
    assert found.contact_area[-1] == pytest.approx(float(after.contact_area), rel=1e-12)
    assert found.friction.max() > 1.2 * max(found.friction[0], found.friction[-1])  # the peak
    finer = theory.persson_speed_step(*PSD, WIDE, 1e5, 0.01, 3.0, [1e-4], gamma=0.45, angles=6000)
    assert found.friction[2] == pytest.approx(float(finer.friction[0]), rel=1e-6)


def test_displacement_far_from_a_line_contact():
    """The displacement is the difference of a gap and a parabola that grow much faster."""
    line = theory.hertz_line(1.0, 1e6, half_width=1e-4)
    for t in (1.0, 3.0, 1e4, 1e8, 1e12):
        # The derivative is that of -(a/R) (t - sqrt(t^2 - 1)): integrate in log t from 1.
        part = quad(lambda s: math.exp(s) / (math.exp(s) + math.sqrt(math.expm1(2.0 * s))),
                    0.0, math.log(t), limit=200)[0]
        expected = -(1e-4**2) * (0.5 + part)
        assert float(line.displacement(1e-4 * t)) == pytest.approx(expected, rel=1e-9)
    assert float(line.displacement(5e-5)) == pytest.approx(-0.5 * 5e-5**2, rel=1e-14)


def summed_speed_step(k, psd, rubber, p, before, after, t, gamma):
    """Return area and friction after a change of speed, by sums over wave numbers and angles.

    The wave numbers resolve the phase k V t and are dense where the area falls from 1, the angles
    are dense where the wave is slow.
    """
    exponent = math.log(psd[1] / psd[0]) / math.log(k[1] / k[0])
    turns = int(k[1] * after * t)
    edges = k[0] + (k[1] - k[0]) * np.linspace(0.0, 1.0, 20 * max(300, turns) + 1) ** 3
    q, step = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
    place = (np.arange(2000) + 0.5) / 2000
    cosine, share = np.sin(0.5 * np.pi * place**2), 2.0 * place / 2000
    squared, loss = np.empty(q.size), np.empty(q.size)
    for part in np.array_split(np.arange(q.size), max(1, q.size // 500)):
        w = 1j * q[part, None] * cosine
        stress = np.full(w.shape, rubber.g_inf, dtype=complex)
        for g, tau in zip(rubber.g, rubber.tau, strict=True):
            new, old = (-w * v * tau / (1.0 - w * v * tau) for v in (after, before))
            stress += g * (new + (old - new) * np.exp(w * after * t - t / tau))
        squared[part] = 16.0 * np.abs(stress) ** 2 @ share
        loss[part] = -4.0 * (cosine * stress.imag) @ share
    density = psd[0] * (q / k[0]) ** exponent / (4.0 * np.pi**2)
    rate = step * np.pi / 4.0 * q**3 * density * squared / p**2
    area = erf(0.5 / np.sqrt(np.cumsum(rate) - 0.5 * rate))
    friction = np.sum(step * np.pi * q**3 * density * loss / p * area
                      * (gamma + (1.0 - gamma) * area**2))
    return erf(0.5 / math.sqrt(rate.sum())), friction


@pytest.mark.parametrize("before, t", [(0.0, 5e-4), (0.0, 2e-3), (0.02, 1e-3)])
def test_waves_that_have_turned_often_after_a_speed_step(before, t):
    """The stress of the shortest wave has turned by up to 628 rad: the integrals oscillate."""
    k, psd = theory.self_affine_psd(0.8, 1e-3, 1e-3, 2e-5, rms_slope=0.2)
    rubber = Prony(1e6, [1e7], [1e-2])
    found = theory.persson_speed_step(k, psd, rubber, 2e5, before, 1.0, [t], gamma=0.45)
    area, friction = summed_speed_step(k, psd, rubber, 2e5, before, 1.0, t, 0.45)
    assert found.contact_area[0] == pytest.approx(area, rel=1e-4)
    assert found.friction[0] == pytest.approx(friction, rel=1e-3)
    # More knots on the same power law are the same spectrum, and more angles the same integrals.
    q = np.geomspace(*k, 300)
    dense = theory.persson_speed_step(q, np.exp(np.interp(np.log(q), np.log(k), np.log(psd))),
                                      rubber, 2e5, before, 1.0, [t], gamma=0.45, angles=4000)
    assert dense.friction[0] == pytest.approx(found.friction[0], rel=1e-6)
    assert dense.contact_area[0] == pytest.approx(found.contact_area[0], rel=1e-8)
    known = found.wavenumber[::40]
    np.testing.assert_allclose(
        np.interp(known, found.wavenumber, found.friction_up_to[0]),
        np.interp(known, dense.wavenumber, dense.friction_up_to[0]), rtol=1e-3, atol=1e-8)


def test_waves_beyond_those_that_are_resolved_after_a_speed_step(monkeypatch):
    """The contributions of waves that have turned by thousands of radians cancel."""
    k, psd = theory.self_affine_psd(0.8, 1e-3, 1e-3, 1e-6, rms_slope=0.5)
    call = (k, psd, WIDE, 1e6, 0.0, 1.0, [1e-3, 1e-2])
    few = theory.persson_speed_step(*call)
    monkeypatch.setattr("asperity.theory.log_panels._MOST_PARTS", 20_000)
    all_resolved = theory.persson_speed_step(*call)
    np.testing.assert_allclose(few.contact_area, all_resolved.contact_area, rtol=1e-5)
    np.testing.assert_allclose(few.friction, all_resolved.friction, rtol=1e-4)


def test_steady_friction_where_the_area_falls_within_a_steep_part_of_the_spectrum():
    """The spectrum rises as k^44, and the area falls from 1 within a small part of this rise."""
    k = np.array([1.77414667e2, 2.18563596e2, 1.43807450e5, 5.74508882e5])
    psd = np.array([6.00763462e-12, 5.57742948e-8, 1.22240405e-23, 3.16967597e-24])
    rubber = Prony(9.44e6, [6.65e7, 2.18e8, 3.69e6], [1.01e-2, 1.19e-5, 0.275])
    q = np.unique(np.concatenate([np.geomspace(a, b, 200) for a, b in pairwise(k)]))
    dense = np.exp(np.interp(np.log(q), np.log(k), np.log(psd)))
    one, other = (theory.persson(*spectrum, rubber, 8.34e6, 2.92e-5, poisson=0.183, gamma=0.379)
                  for spectrum in ((k, psd), (q, dense)))
    assert float(one.friction) == pytest.approx(float(other.friction), rel=1e-7)
    assert float(one.contact_area) == pytest.approx(float(other.contact_area), rel=1e-9)


def test_zero_knots_end_the_spectrum_half_way():
    k, phi = np.array([0.5, 1.0, 2.0, 4.0, 8.0, 16.0]), np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0])
    height, slope = theory.psd_moments(k, phi)
    assert height**2 == pytest.approx((32 - 2) / 2 / (2 * np.pi), rel=1e-12)
    assert slope**2 == pytest.approx((32**2 - 2**2) / 4 / (2 * np.pi), rel=1e-12)


def test_persson_of_many_pressures_and_speeds():
    pressure, velocity = np.array([[1e5], [4e5]]), np.array([0.0, 0.01, 1.0])
    found = theory.persson(*PSD, WIDE, pressure, velocity, gamma=0.45)
    assert found.friction.shape == found.contact_area.shape == (2, 3)
    for i, p in enumerate(pressure[:, 0]):
        for j, v in enumerate(velocity):
            one = theory.persson(*PSD, WIDE, float(p), float(v), gamma=0.45)
            assert found.friction[i, j] == pytest.approx(float(one.friction), rel=1e-13)
            assert found.contact_area[i, j] == pytest.approx(float(one.contact_area), rel=1e-13)
            np.testing.assert_allclose(found.area[i, j], one.area, rtol=1e-13)


@pytest.mark.parametrize("generator", ["random_phase", "filtered_noise"])
def test_spectrum_of_a_given_surface(generator):
    lx, ly = 1e-3, 0.7e-3
    height = asperity.surface.self_affine(
        135, 108, lx, ly, hurst=0.7, wavelength_long=2.5e-4, wavelength_short=4e-5,
        rms_slope=0.3, seed=5, generator=generator)
    known = asperity.surface.statistics(height, lx, ly)
    k, phi = theory.surface_psd(height, lx, ly)
    moments = theory.psd_moments(k, phi)
    assert moments[0] == pytest.approx(known.rms_height, rel=1e-6)
    assert moments[1] == pytest.approx(known.rms_slope, rel=1e-6)
    at_rest = theory.persson(k, phi, WIDE, 2e5, 0.0)
    expected = theory.persson_area(2e5, 4 * WIDE.g_inf, known.rms_slope)
    assert float(at_rest.contact_area) == pytest.approx(float(expected), rel=1e-6)
    # bands of another width, the rings as they are, and the spectrum that it was made of
    narrow = theory.psd_moments(*theory.surface_psd(height, lx, ly, bands_per_decade=200))
    np.testing.assert_allclose(narrow, (known.rms_height, known.rms_slope), rtol=1e-6)
    fine = theory.surface_psd(height, lx, ly, bands_per_decade=40)
    rings = asperity.surface.psd(height, lx, ly)
    target = theory.self_affine_psd(0.7, 2.5e-4, 2.5e-4, 4e-5, rms_slope=0.3)
    speed = [0.01, 1.0, 100.0]
    found = theory.persson(k, phi, WIDE, 2e5, speed)
    for spectrum, error in ((fine, 0.01), ((rings.wavenumber, rings.psd), 0.04), (target, 0.04)):
        other = theory.persson(*spectrum, WIDE, 2e5, speed)
        np.testing.assert_allclose(other.contact_area, found.contact_area, rtol=error)
        np.testing.assert_allclose(other.friction, found.friction, rtol=error)


def test_full_contact_friction_of_a_given_surface():
    """The bands must agree with the sum over the modes of the map, each in full contact."""
    n, lx, speed, pressure = 48, 1e-3, 0.3, 1e12
    height = asperity.surface.self_affine(n, lx=lx, hurst=0.8, wavelength_long=3e-4,
                                          wavelength_short=6e-5, rms_slope=0.2, seed=3)
    share = asperity.surface.psd_map(height, lx) / lx**2
    wave = 2 * np.pi * np.fft.fftfreq(n, lx / n)
    k = np.hypot(wave, wave[:, None])
    angle = (np.arange(400) + 0.5) * np.pi / 800       # mean over directions
    loss = np.array([np.mean(np.cos(angle) * WIDE.loss_modulus(q * speed * np.cos(angle)))
                     for q in k.ravel()]).reshape(k.shape)
    # stress amplitude of a wave of height h: 2 G q h; its slope: q h
    expected = np.sum(share * k**2 * 2 * loss)
    found = theory.persson(*theory.surface_psd(height, lx), WIDE, pressure, speed)
    assert float(found.friction) * pressure == pytest.approx(expected, rel=2e-3)
    assert float(found.contact_area) == pytest.approx(1.0, rel=1e-9)


# ---- wrong values -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: theory.hertz(-1.0, 1.0, force=1.0), "radius = -1.0: must be a finite number > 0"),
        (lambda: theory.hertz(1.0, 1.0), "none given: must be exactly one of force"),
        (lambda: theory.hertz(1.0, 1.0, force=1.0, approach=1.0), "force, approach given"),
        (lambda: theory.hertz(1.0, 1.0, force=float("nan")), "force = nan"),
        (lambda: theory.hertz(1.0, 1.0, force=1.0).pressure(-1.0), "r = -1.0"),
        (lambda: theory.hertz_line(1.0, 1.0, load=0.0), "load = 0.0"),
        (lambda: theory.westergaard(1.0, 1.0, 1.0, -1.0), "pressure = -1.0"),
        (lambda: theory.jkr(1.0, 1.0, 1.0, force=-5.0), "force = -5.0: must be .* >= -4.71"),
        (lambda: theory.dmt(1.0, 1.0, 1.0, force=-7.0), "force = -7.0"),
        (
            lambda: theory.maugis(1.0, 1.0, 1.0, force=-7.0, maugis_parameter=1.0),
            "force = -7.0",
        ),
        (lambda: theory.maugis(1.0, 1.0, 1.0, force=0.0), "must be exactly one of range"),
        (
            lambda: theory.maugis(1.0, 1.0, 1.0, force=0.0, tabor=1.0).displacement(0.0),
            "JKR and DMT only",
        ),
        (lambda: theory.mindlin(1.0, 1.0, 0.7, 0.5, 1.0, shift=0.0), "poisson = 0.7"),
        (lambda: theory.mindlin(1.0, 1.0, 0.5, 0.5, 1.0, tangential=0.6), "tangential = 0.6"),
        (lambda: theory.lee_radok(1.0, -1.0, RUBBER, [0.0]), "force = -1.0"),
        (lambda: theory.lee_radok(1.0, 1.0, RUBBER, [1.0, 0.5]), r"times\[1\] = 0.5"),
        (lambda: theory.hunter(1.0, 1.0, 0.0, ZENER), "velocity = 0.0"),
        (lambda: theory.hunter(1.0, 1.0, 1.0, RUBBER), "material: has 8 arms"),
        (lambda: theory.hunter(1.0, 1.0, 1.0, Prony(0.0, [1.0], [1.0])), "g_inf = 0.0"),
        (
            lambda: theory.full_contact_waves(1.0, [[1, 0], [-1, 0]], (1, 0), RUBBER),
            "two are equal or opposite",
        ),
        (lambda: theory.full_contact_waves(1.0, [0, 0], (1, 0), RUBBER), r"wavevector\[0\] = 0"),
        (
            lambda: theory.full_contact_waves(1.0, [1, 0], (1, 0), RUBBER, start="warm"),
            "start = 'warm': must be one of 'relaxed', 'glassy'",
        ),
        (lambda: theory.persson(*PSD, RUBBER, 0.0, 1.0), "pressure = 0.0"),
        (lambda: theory.persson(*PSD, RUBBER, 1.0, 1.0, gamma=1.5), "gamma = 1.5"),
        (lambda: theory.persson([2.0, 1.0], [1.0, 1.0], RUBBER, 1.0, 1.0), r"wavenumber\[1\]"),
        (lambda: theory.persson([1.0, 2.0], [0.0, 0.0], RUBBER, 1.0, 1.0), "all values are 0.0"),
        (lambda: theory.persson(*PSD, RUBBER, 1.0, [1.0, -2.0]), r"velocity\[1\] = -2.0"),
        (lambda: theory.surface_psd(np.zeros((4, 4)), 1.0), "the map is flat"),
        (lambda: theory.surface_psd(np.zeros((1, 4)), 1.0), "at least 2 x 2"),
        (lambda: theory.surface_psd(np.eye(4), 1.0, bands_per_decade=0), "bands_per_decade = 0"),
        (lambda: theory.self_affine_psd(1.2, 3, 2, 1, rms_slope=1.0), "hurst = 1.2"),
        (lambda: theory.self_affine_psd(0.8, 3, 1, 2, rms_slope=1.0), "wavelength_rolloff = 1"),
        (lambda: theory.persson_area(-1.0, 1.0, 1.0), "pressure = -1.0"),
    ],
)
def test_wrong_values_are_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_a_material_of_another_type_is_named():
    """These calls used to end with an AttributeError of the number."""
    k, psd = theory.self_affine_psd(0.9, 2.5e-4, 2.5e-4, 7.8e-6, rms_slope=0.02)
    rubber = Prony(1e6, [1e7], [1e-4])
    for call in (lambda: theory.hunter(1.0, 1.0, 1.0, 3.0),
                 lambda: theory.lee_radok(1.0, 1.0, 3.0, [0.0]),
                 lambda: theory.persson(k, psd, 3.0, 1e4, 1.0),
                 lambda: theory.persson_speed_step(k, psd, 3.0, 1e4, 1.0, 2.0, [0.0]),
                 lambda: theory.full_contact_waves(1e-6, (1e4, 0.0), (0.1, 0.0), 3.0)):
        with pytest.raises(ValueError, match=r"^material = 3\.0: must be a Prony$"):
            call()
    with pytest.raises(ValueError, match=r"^times: has no value, must have at least one$"):
        theory.persson_speed_step(k, psd, rubber, 1e4, 0.0, 1.0, [])
    for name, values in (("pressure", ([], 1.0)), ("velocity", (1e4, []))):
        with pytest.raises(ValueError, match=f"^{name}: has no value, must have at least one$"):
            theory.persson(k, psd, rubber, *values)
