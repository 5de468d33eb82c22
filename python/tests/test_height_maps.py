"""Generated height maps and statistics of maps, computed by the Fortran library."""

import warnings

import numpy as np
import pytest

import asperity


def gradient_mean_square(height, lx, ly):
    """Return mean(|grad h|^2) of the interpolating Fourier sum, computed with numpy."""
    ny, nx = height.shape
    kx = 2 * np.pi * np.fft.fftfreq(nx, lx / nx)
    ky = 2 * np.pi * np.fft.fftfreq(ny, ly / ny)
    power = np.abs(np.fft.fft2(height) / height.size) ** 2
    return np.sum((kx**2 + ky[:, None] ** 2) * power)


@pytest.mark.parametrize("generator", ["random_phase", "filtered_noise"])
def test_self_affine_has_the_given_slope(generator):
    height = asperity.surface.self_affine(
        90, 64, 1.5, 1.0, wavelength_long=0.5, wavelength_short=0.1, rms_slope=0.3, seed=5,
        generator=generator)
    assert height.shape == (64, 90)
    assert gradient_mean_square(height, 1.5, 1.0) == pytest.approx(0.09, rel=1e-10)


def test_seeds():
    first, same, other = (asperity.surface.self_affine(32, wavelength_short=0.2, rms_height=1e-6,
                                                       seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, same)
    assert np.abs(np.corrcoef(first.ravel(), other.ravel())[0, 1]) < 0.5
    assert first.std() == pytest.approx(1e-6, rel=1e-12)


def test_band_of_the_spectrum():
    height = asperity.surface.self_affine(64, wavelength_long=0.5, wavelength_rolloff=0.25,
                                          wavelength_short=0.125, hurst=0.5, rms_height=1.0)
    density = asperity.surface.psd_map(height, 1.0)
    n = np.fft.fftfreq(64, 1 / 64)
    mode = np.hypot(n, n[:, None])
    inside = (mode >= 2 - 1e-9) & (mode <= 8 + 1e-9)
    assert density[~inside].max() < 1e-20 * density.max()
    flat = density[(mode >= 2) & (mode <= 4)]
    np.testing.assert_allclose(flat, flat[0], rtol=1e-9)
    # (k/k_r)^(-2 (1 + H)) at twice the roll-off, H = 0.5
    assert density[0, 8] / density[0, 4] == pytest.approx(2.0**-3, rel=1e-9)
    np.testing.assert_allclose(density, np.abs(np.fft.fft2(height)) ** 2 / 64**4, atol=1e-18)


def test_psd_sums_to_the_variance():
    height = np.random.default_rng(0).normal(size=(24, 36))
    spectrum = asperity.surface.psd(height, 3.0, 2.0)
    assert np.all(np.diff(spectrum.wavenumber) > 0)
    assert np.sum(spectrum.psd * spectrum.modes) / 6.0 == pytest.approx(height.var(), rel=1e-12)
    assert spectrum.modes.sum() == 24 * 36 - 1


@pytest.mark.parametrize("order", ["C", "F"])
def test_statistics(order):
    height = np.array(np.random.default_rng(1).normal(size=(40, 30)) ** 3, order=order)
    found = asperity.surface.statistics(height, 3.0, 4.0)
    deviation = height - height.mean()
    assert found.mean == pytest.approx(height.mean(), rel=1e-12)
    assert (found.lowest, found.highest) == (height.min(), height.max())
    assert found.rms_height == pytest.approx(height.std(), rel=1e-12)
    assert found.skewness == pytest.approx((deviation**3).mean() / height.std() ** 3, rel=1e-10)
    assert found.kurtosis == pytest.approx((deviation**4).mean() / height.std() ** 4, rel=1e-10)
    assert found.rms_slope**2 == pytest.approx(gradient_mean_square(height, 3.0, 4.0), rel=1e-10)


def test_shapes():
    x = np.arange(32) / 32
    sine = asperity.surface.shape("sine", 32, 8, amplitude=2.0, wavelength=0.5, centre_x=0.1)
    np.testing.assert_allclose(sine, np.tile(2 * np.cos(4 * np.pi * (x - 0.1)), (8, 1)), atol=1e-12)
    cap = asperity.surface.shape("sphere", 32, radius=2.0, boundary="free")
    r2 = (x - 0.5) ** 2 + (x[:, None] - 0.5) ** 2
    np.testing.assert_allclose(cap, np.sqrt(4 - r2) - 2, atol=1e-12)


@pytest.mark.parametrize(("changes", "message"), [
    ({"hurst": 1.5}, r"hurst = 1.5: must be a finite number > 0 and <= 1$"),
    ({"rms_height": 1.0}, "must be exactly one of rms_height, rms_slope"),
    ({"rms_slope": -1.0}, "rms_slope = -1.0"),
    ({"nx": 0}, "nx = 0: must be a positive integer"),
    ({"wavelength_short": 2.0}, r"wavelength_short = 2: must be at most lx = 1.0, the longest"
                                r" wavelength unless wavelength_long is given$"),
    ({"wavelength_short": 0.0}, r"wavelength_short = 0.0: must be a finite number > 0$"),
    ({"wavelength_long": 0.1}, r"wavelength_long = 0.1: must be at least wavelength_short = 0.2$"),
    ({"wavelength_rolloff": 2.0}, r"wavelength_rolloff = 2.0: must be at least wavelength_short ="
                                  r" 0.2 and at most lx = 1.0, "),
    ({"wavelength_rolloff": 0.1, "wavelength_long": 0.9},
     r"wavelength_rolloff = 0.1: must be at least .* and at most wavelength_long = 0.9$"),
    ({"wavelength_long": float("inf")}, r"wavelength_long = inf: must be a finite number$"),
    ({"generator": "dice"}, r"generator = 'dice': must be one of 'random_phase', 'filtered_noise'"),
    ({"seed": "a"}, "seed = 'a': must be an integer from -2147483648 to 2147483647"),
    ({"seed": 1.5}, "seed = 1.5: must be an integer"),
    ({"seed": 2**31}, "seed = 2147483648: must be an integer"),
    ({"wavelength_short": 0.9, "wavelength_long": 0.95}, "no mode of the grid lies in the band"),
])
def test_wrong_values(changes, message):
    arguments = {"nx": 16, "lx": 1.0, "wavelength_short": 0.2, "rms_slope": 0.1}
    with pytest.raises(ValueError, match=message) as caught:
        asperity.surface.self_affine(**(arguments | changes))
    assert "&" not in str(caught.value)  # it names arguments, not groups


def test_doubtful_wavelengths_are_warned_of_as_by_the_program():
    """`check` warns of the same, in the same words."""
    given = dict(hurst=0.8, wavelength_long=3.0, wavelength_short=0.1)
    with pytest.warns(UserWarning) as caught:
        asperity.surface.self_affine(16, **given, rms_slope=0.1)
    lines = [str(one.message) for one in caught]
    assert "wavelength_long = 3 m is not below the side of 1 m" in lines[0]
    assert "the shortest wave is not above the Nyquist wavelength of 0.125 m" in lines[1]
    case = asperity.Case(grid=dict(nx=16, ny=16, lx=1.0), material=dict(shear_modulus=1e6),
                         surface=dict(shape="self_affine", **given, rms_slope=0.1),
                         phase=dict(pressure=1e3))
    text = str(case.check())
    assert all(f"! warning: &surface: {line}" in text for line in lines)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        asperity.surface.self_affine(32, wavelength_short=0.1, rms_slope=0.1)
        asperity.surface.self_affine(32, 16, wavelength_short=0.1, wavelength_long=1.0,
                                     rms_slope=0.1)


def test_wrong_shapes():
    with pytest.raises(ValueError, match=r"^radius = .*: must be a positive number$"):
        asperity.surface.shape("sphere", 16, radius=-1.0)
    with pytest.raises(ValueError, match=r"^amplitude = .*: must be finite\nwavelength = "):
        asperity.surface.shape("sine", 16, amplitude=float("nan"), wavelength=0.0)
    for name in ("sphere", "paraboloid", "cylinder"):
        with pytest.raises(ValueError, match=f"^radius: is missing: '{name}' needs it, in m$"):
            asperity.surface.shape(name, 16, wavelength=1.0, amplitude=1.0)
    for name in ("sine", "hexagonal_wave"):
        with pytest.raises(ValueError, match=f"^amplitude: is missing: '{name}' needs it, in m$"):
            asperity.surface.shape(name, 16, wavelength=1.0)
        with pytest.raises(ValueError, match=r"^amplitude: is missing: .*\nwavelength: is missing"):
            asperity.surface.shape(name, 16, radius=1.0)
    with pytest.raises(ValueError, match=r"^amplitude = 5\.0: does not belong to 'sphere'$"):
        asperity.surface.shape("sphere", 16, radius=1.0, amplitude=5.0)
    assert not asperity.surface.shape("sine", 16, amplitude=0.0, wavelength=1.0).any()


def test_threads():
    assert asperity.set_threads(2) == 2
    assert asperity.set_threads(1) == 1
    with pytest.raises(ValueError, match="number = -1"):
        asperity.set_threads(-1)
    with pytest.raises(ValueError, match="number = 'a': must be an integer from 0"):
        asperity.set_threads("a")
    with pytest.raises(ValueError, match="number = 200000: must be an integer from 0 to 1024"):
        asperity.set_threads(200000)  # more than a process can start


def test_curvature_of_a_profile_is_its_second_derivative():
    """The ridges of a map have half of it as their mean curvature."""
    wave = np.cos(2 * np.pi * np.arange(64) / 64)[None, :]
    profile = asperity.surface.statistics(wave, 2 * np.pi)
    ridges = asperity.surface.statistics(wave * np.ones((64, 1)), 2 * np.pi)
    assert profile.rms_curvature == pytest.approx(np.sqrt(0.5), rel=1e-12)
    assert ridges.rms_curvature == pytest.approx(0.5 * np.sqrt(0.5), rel=1e-12)
