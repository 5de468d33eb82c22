"""Roads: joins, outliers, spectra and patches, against closed forms and known roads."""

from math import gamma

import h5py
import numpy as np
import pytest

import asperity
from asperity import theory
from asperity.roads.joins import (
    JOINS,
    _cheapest_line,
    join,
    load_at_join,
    margin_of,
    smooth_part,
    strip,
)
from asperity.roads.measured import MeasuredSurface
from asperity.roads.outliers import find_outliers
from asperity.roads.patches import DrawnRoad, MeasuredRoad, low_pass, rested
from asperity.roads.spectra import (
    Spectrum,
    isotropic_of_profile,
    join_spectra,
    name_of_several,
    spectrum_of_map,
)


def road(cells=256, long=0.25, short=8 / 256, seed=1):
    """Return a periodic road of side 1 with an rms slope of 0.1, and its spectrum."""
    spectrum = Spectrum(*theory.self_affine_psd(0.8, long, long, short, rms_slope=0.1))
    return spectrum.draw(cells, cells, 1.0, 1.0, seed), spectrum


def jump(height):
    """Return the largest step across opposite edges over the largest step inside."""
    inside = max(np.abs(np.diff(height, axis=axis)).max() for axis in (0, 1))
    across = max(np.abs(height[0] - height[-1]).max(), np.abs(height[:, 0] - height[:, -1]).max())
    return across / inside


@pytest.mark.parametrize("method", JOINS[:5])
def test_joined_patches_are_periodic(method):
    height, _ = road()
    margin = margin_of(96, method)
    part = height[20 : 116 + margin, 30 : 126 + margin]
    assert jump(part[:96, :96]) > 2.0
    joined = join(part, method, (96, 96))
    assert joined.shape == ((192, 192) if method == "mirror" else (96, 96))
    assert jump(joined) < 1.3
    # inside, only the smooth part that carries the jumps has been taken off
    inner = slice(24, 72)
    change = joined[inner, inner] - part[inner, inner]
    if method in ("seam", "blend", "mirror"):
        np.testing.assert_allclose(change, 0.0, atol=1e-15)
    assert np.std(change) < 0.5 * np.std(part)


def test_the_smooth_part_has_the_laplacian_of_the_jumps():
    """Inside, the periodic part has the Laplacian of the map, and the smooth part has 0."""
    height, _ = road(64, short=0.125)
    part = height[:48, :40]
    smooth = smooth_part(part)
    laplacian = (smooth[:-2, 1:-1] + smooth[2:, 1:-1] + smooth[1:-1, :-2] + smooth[1:-1, 2:]
                 - 4 * smooth[1:-1, 1:-1])
    np.testing.assert_allclose(laplacian, 0.0, atol=1e-14)
    assert abs(smooth.mean()) < 1e-15
    level = np.full((8, 8), 3.0)
    np.testing.assert_allclose(smooth_part(level), 0.0, atol=1e-14)
    profile = np.linspace(0.0, 1.0, 50)[None, :]
    flat = join(profile, "smooth")
    assert np.abs(np.diff(flat)).max() < 1.0 / 20 and np.ptp(flat) < 1e-12 + 0.05


def test_blending_keeps_the_roughness():
    """The squares of the weights sum to 1, which keeps the variance of independent parts."""
    heights = []
    for seed in range(6):
        height, spectrum = road(seed=seed, long=0.1)
        part = height[: 96 + margin_of(96, "blend"), : 96 + margin_of(96, "blend")]
        joined = join(part - part.mean(), "blend", (96, 96))
        heights.append(np.var(joined[: margin_of(96, "blend")]))
    expected = theory.psd_moments(spectrum.wavenumber, spectrum.psd)[0] ** 2
    assert np.mean(heights) == pytest.approx(expected, rel=0.2)


def test_load_at_the_join():
    """A uniform pressure has equal shares; a frame that carries the whole load is recognised."""
    even = np.ones((64, 64))
    for method in JOINS[:5]:
        load, area = load_at_join(even, method)
        assert load == pytest.approx(area) and 0.1 < area < 0.45
    frame = strip((64, 64), 0.125).astype(float)
    assert load_at_join(frame, "smooth") == (1.0, pytest.approx(frame.mean()))


def test_the_window_unloads_its_frame_and_the_default_does_not():
    """This repeats, for one map of short waves, what tools/joins.py measures on larger maps."""
    shares = {}
    for method in ("seam", "blend", "window"):
        found = []
        for seed in range(12):
            height, _ = road(seed=seed, long=0.1)
            need = 96 + margin_of(96, method)
            part = height[:need, :need]
            map_ = low_pass(join(part, method, (96, 96)), 0.375, 0.375, 6 / 256)
            solved = asperity.solve_normal(map_, 0.375, 0.375, 1.0, pressure=2e-3, tolerance=1e-4)
            load, area = load_at_join(solved.pressure, method)
            found.append(load / area)
        shares[method] = np.mean(found)
    assert 0.85 < shares["seam"] < 1.15
    assert 0.75 < shares["blend"] < 1.25
    assert shares["window"] < 0.7


def stones(cells=288, seed=1):
    """Return a road of stones with flat tops: the upper envelope of paraboloids, cut off."""
    random = np.random.default_rng(seed)
    place = np.arange(cells) / 96
    height = np.full((cells, cells), -np.inf)
    for x, y, top in zip(*(3.0 * random.random((2, 144))), 0.02 * random.standard_normal(144),
                         strict=True):
        square = (place - x) ** 2 + (place[:, None] - y) ** 2
        np.maximum(height, top - 1.8 * square, out=height)
    return np.minimum(height, np.quantile(height, 0.7)) + 0.05 * road(cells, seed=seed)[0]


def test_the_seam_makes_no_summits_that_the_road_lacks():
    """Tops on both sides of a seam stay in their plane, while blending raises them above it."""
    height = stones()
    for method, low, high in (("seam", 0.0, 0.05), ("blend", 0.2, 1.0)):
        need = 96 + margin_of(96, method)
        part = height[:need, 40 : 40 + need]
        part = part - part.mean()
        joined = join(part, method, (96, 96))
        excess = (joined.max() - part.max()) / part.std()
        assert low <= max(excess, 0.0) <= high, method
        if method == "seam":
            assert jump(joined) < 1.3 and joined.min() > part.min() - 1e-12


def test_the_line_of_a_seam_is_the_cheapest_and_closed():
    """If both sides agree along a winding valley, the seam follows it."""
    rows = np.arange(96)
    valley = np.round(12 + 4 * np.sin(2 * np.pi * rows / 96)).astype(int)
    cost = np.ones((96, 24))
    cost[rows, valley] = 0.0
    np.testing.assert_array_equal(_cheapest_line(cost, closed=True), valley)
    np.testing.assert_array_equal(_cheapest_line(cost[:70], closed=False), valley[:70])
    slanted = np.ones((20, 24))
    slanted[np.arange(20), np.arange(20)] = 0.0
    line = _cheapest_line(slanted, closed=True)
    assert line[0] == line[-1] and np.abs(np.diff(line)).max() <= 1
    assert slanted[np.arange(20), line].sum() == min(
        slanted[np.arange(20), path].sum() for path in _closed_paths(slanted))


def _closed_paths(cost):
    """Yield the best path for each start, found by another method: relaxation until it settles."""
    rows, columns = cost.shape
    for start in range(columns):
        best = {(0, start): (cost[0, start], [start])}
        for row in range(1, rows):
            for column in range(columns):
                found = [best[row - 1, at] for at in (column - 1, column, column + 1)
                         if (row - 1, at) in best]
                if found:
                    value, path = min(found, key=lambda one: one[0])
                    best[row, column] = (value + cost[row, column], [*path, column])
        if (rows - 1, start) in best:
            yield np.array(best[rows - 1, start][1])


def test_patches_rest_on_their_tops():
    """Valleys on one side only do not tilt a road whose summits lie in a plane."""
    x = np.linspace(0.0, 1.0, 96)
    road_ = np.where(np.arange(96) % 12 < 6, 0.0, -0.2 * x) + np.zeros((96, 1))
    def tilt(map_):
        return np.ptp(map_[0, ::12])
    assert tilt(rested(road_, 0.5)) > 0.08 and tilt(rested(road_)) < 0.01
    tilted = road_ + 0.3 * x + 0.1 * x[:, None]
    np.testing.assert_allclose(rested(tilted), rested(road_), atol=1e-12)
    profile = (0.3 * x)[None, :]
    np.testing.assert_allclose(rested(profile), 0.0, atol=1e-12)


def test_outliers_are_single_cells_and_not_steep_edges():
    height, _ = road()
    assert find_outliers(height).count == 0
    y, x = np.mgrid[0:256, 0:256] / 256
    stones = np.cos(8 * np.pi * x + 1) * np.cos(6 * np.pi * y) > 0.2
    steps = height + 0.5 * stones  # pillars with vertical sides
    assert find_outliers(steps).count == 0
    dusty = height.copy()
    dusty[100, 31] += 1.0
    dusty[5, 6] -= 0.5
    dusty[5, 7] -= 0.5
    found = find_outliers(dusty)
    assert np.argwhere(found.cells).tolist() == [[5, 6], [5, 7], [100, 31]]
    assert np.abs(found.mended - height)[found.cells].max() < 5 * np.std(height) / 10
    np.testing.assert_array_equal(found.mended[~found.cells], dusty[~found.cells])
    assert "3 of 65536 cells lie far off" in found.summary()
    assert find_outliers(np.zeros((8, 8))).count == 0


def test_drawn_maps_have_the_spectrum():
    height, spectrum = road()
    found = spectrum_of_map(height, 1.0, 1.0, periodic=True)
    # Near the ends of the spectrum a part of the cells of the modes is beyond them.
    inside = found.wavenumber > spectrum.wavenumber[0] + 1.5 * 2 * np.pi
    inside &= found.wavenumber < 0.95 * spectrum.wavenumber[-1]
    assert inside.sum() >= 15
    np.testing.assert_allclose(found.psd[inside], spectrum.at(found.wavenumber[inside]), rtol=0.05)
    np.testing.assert_array_equal(height, road()[0])
    assert np.any(height != road(seed=2)[0])


@pytest.mark.parametrize("side", [1.0, 1.5, 2.0, 3.0, 5.0])
@pytest.mark.parametrize("hurst", [0.4, 0.8])
def test_drawn_maps_have_the_height_and_the_slope_of_the_spectrum(hurst, side):
    """Modes on the edge of the spectrum counted in full: the height was 31 % too large at 1."""
    wave = 1e-3
    spectrum = Spectrum(*theory.self_affine_psd(hurst, wave, wave, wave / 16, rms_height=1e-5))
    slope = theory.psd_moments(spectrum.wavenumber, spectrum.psd)[1]
    cells = 2 * round(64 * side)
    found = asperity.surface.statistics(
        spectrum.draw(cells, cells, side * wave, side * wave, 1), side * wave)
    assert found.rms_height == pytest.approx(1e-5, rel=0.005)
    assert found.rms_slope == pytest.approx(slope, rel=0.01)
    # oblong cells and maps have other steps of wave numbers along x and y
    found = asperity.surface.statistics(
        spectrum.draw(cells, 160, side * wave, 2 * wave, 1), side * wave, 2 * wave)
    assert found.rms_height == pytest.approx(1e-5, rel=0.005)


@pytest.mark.parametrize("side, within", [(1, 0.04), (2, 0.01), (4, 0.005)])
def test_drawn_maps_of_a_narrow_band(side, within):
    """A side of one longest wave has few modes between this wave and one of half its length."""
    for hurst in (0.3, 0.6, 1.0):
        for band in (2.0, 2.7, 4.0):
            knots = theory.self_affine_psd(hurst, 1.0, 1.0, 1.0 / band, rms_slope=0.2)
            cells = 32 * side
            found = asperity.surface.statistics(
                Spectrum(*knots).draw(cells, cells, side, side, 1), side, side)
            height, slope = theory.psd_moments(*knots)
            assert found.rms_height == pytest.approx(height, rel=0.01)
            assert found.rms_slope == pytest.approx(slope, rel=within)


def test_a_profile_has_the_spectrum_of_its_isotropic_road():
    """By Abel's transform Phi = (1 + k^2)^-2 has the profile (1 + k^2)^-1.5 / 4."""
    k = np.geomspace(1e-2, 1e3, 400)
    found = isotropic_of_profile(k, 0.25 * (1 + k**2) ** -1.5)
    inner = (found.wavenumber > 0.05) & (found.wavenumber < 300.0)
    np.testing.assert_allclose(found.psd[inner], (1 + found.wavenumber[inner] ** 2) ** -2.0,
                               rtol=5e-3)


def random_profile(random, count, hurst, long):
    """Return a part of a random line on the road Phi = (1 + (k/k0)^2)^-(1 + H), cells of 1 m."""
    k = 2 * np.pi * np.fft.rfftfreq(4 * count)
    factor = gamma(0.5) * gamma(hurst + 0.5) / gamma(hurst + 1.0) / long
    density = factor * (1.0 + (k * long / (2 * np.pi)) ** 2) ** (-hurst - 0.5)
    white = np.fft.rfft(random.standard_normal(4 * count))
    return np.fft.irfft(white * np.sqrt(density))[None, :count]


@pytest.mark.parametrize(("count", "within"), [(128, 0.12), (512, 0.07), (2048, 0.03)])
@pytest.mark.parametrize("hurst", [0.4, 0.8])
def test_short_profiles_have_the_slope_of_their_road_on_average(count, within, hurst):
    """Abel's transform of the noisy density of a profile made the roads too rough by 20 to 40 %."""
    random = np.random.default_rng(1)
    long = count / 6
    ratios = []
    for _ in range(60):
        found = spectrum_of_map(random_profile(random, count, hurst, long), count, 1.0)
        assert not found.notes
        k = np.geomspace(*found.wavenumber[[0, -1]], 200)
        true = (1.0 + (k * long / (2 * np.pi)) ** 2) ** (-hurst - 1.0)
        ratios.append([np.trapezoid(found.at(k) * k**power, k) / np.trapezoid(true * k**power, k)
                       for power in (3, 1)])
    slope, height = np.mean(np.sqrt(ratios), axis=0)
    assert slope == pytest.approx(1.0, abs=within)
    assert height == pytest.approx(1.0, abs=0.12)


def test_a_profile_without_short_waves_has_a_spectrum():
    """Powers that fall by many decades, as after a filter, end the spectrum without a warning."""
    line = np.cos(2 * np.pi * np.arange(512) / 512 * 9) + np.cos(2 * np.pi * np.arange(512) / 37)
    found = spectrum_of_map(line[None, :], 1.0, 1 / 512)
    assert np.isfinite(found.psd).all() and 1 / 17 < found.band[1] < 1 / 14
    # Between the waves of a periodic profile there is nothing. Single waves are improbable for a
    # random road, but height and slope stay near those of the profile.
    waves = (9, 14, 40)
    line = sum(np.cos(2 * np.pi * np.arange(512) / 512 * wave) for wave in waves)
    found = spectrum_of_map(line[None, :], 1.0, 1 / 512, periodic=True)
    height, slope = theory.psd_moments(found.wavenumber, found.psd)
    assert height == pytest.approx(np.std(line), rel=0.4)
    assert slope == pytest.approx(2 * np.pi * np.linalg.norm(waves), rel=0.2)
    once = np.cos(2 * np.pi * np.arange(512) / 512 * 9)[None, :]
    with pytest.raises(ValueError, match="roughness of a single wavelength, or of none, between"):
        spectrum_of_map(once, 1.0, 1 / 512, periodic=True)


@pytest.mark.parametrize("count", [512, 1024])
@pytest.mark.parametrize("noise", [0.0, 1e-3])
@pytest.mark.parametrize("cells", [8, 10, 20])
def test_waves_that_end_within_the_measured_band(cells, noise, count):
    """A spectrum without a jump overshot before a sharp end: the slope was up to 16 % too large."""
    random = np.random.default_rng(2)
    spectrum = Spectrum(*theory.self_affine_psd(0.7, 1 / 8, 1 / 8, cells / 1024, rms_height=1e-5))
    height = spectrum.draw(1024, 1024, 1.0, 1.0, 1)
    height = height + noise * 1e-5 * random.standard_normal(height.shape)
    true = theory.psd_moments(spectrum.wavenumber, spectrum.psd)[1]
    slopes = []
    for row in range(0, 1024, 128):
        found = spectrum_of_map(height[row : row + 1, :count], count / 1024, 1 / 1024)
        wave = 2 * np.pi / (cells / 1024)
        assert found.band[1] == pytest.approx(cells / 1024, rel=0.1)
        assert "has no waves shorter than" in found.notes[0]
        assert found.at(np.array([1.2 * wave])) == 0.0
        slopes.append(theory.psd_moments(found.wavenumber, found.psd)[1])
    assert np.sqrt(np.mean(np.square(slopes))) == pytest.approx(true, rel=0.08)


def test_a_spectrum_begins_with_the_longest_waves_of_the_road():
    """A scan measures longer waves than the road may have; drawn maps were then far too large."""
    random = np.random.default_rng(4)
    k = 2 * np.pi * np.fft.rfftfreq(2048, 10e-6)
    inside = (k > 2 * np.pi / 1e-3) & (k < 2 * np.pi / 1e-4)
    power = np.where(inside, np.where(inside, k, 1.0) ** -1.3, 0.0)
    line = np.fft.irfft(power * np.fft.rfft(random.standard_normal(2048)))[None, :]
    found = spectrum_of_map(line, 2048 * 10e-6, 10e-6)
    assert 0.8e-3 < found.band[0] < 1.4e-3
    drawn = DrawnRoad(found, 96, seed=1)
    assert drawn.side == 2 * found.band[0]
    assert np.std(drawn.patch(0).height) > 0.5 * np.std(line)


def test_a_road_with_a_direction_is_noted():
    """Persson's theory and drawn maps are isotropic."""
    x = np.arange(64) / 64
    along = 1e-6 * (np.sin(8 * np.pi * x) + np.sin(12 * np.pi * x))
    slope = 1e-6 * np.sqrt(np.mean(np.diff(along * 1e6) ** 2)) / (1e-3 / 64)
    for across, count in ((0.2, 1), (1.0, 0)):
        height = along[None, :] + across * along[:, None]
        one = MeasuredSurface(height, 1e-3, 1e-3, True, "m", source={"name": "plate"})
        notes = [note for note in MeasuredRoad([one], 64).notes if "direction" in note]
        assert len(notes) == count
        assert not notes or notes[0].startswith(
            f"plate: the rms slope is {slope:.2g} along x and {0.2 * slope:.2g} along y")


def test_profiles_of_a_map_have_its_spectrum():
    height, spectrum = road(512, short=8 / 512)
    power = np.mean(np.abs(np.fft.rfft(height, axis=1)) ** 2, axis=0)[1:] / 512**2
    k = 2 * np.pi * np.arange(1, 257)
    inside = (k >= spectrum.wavenumber[0]) & (k < 0.8 * spectrum.wavenumber[-1])
    found = isotropic_of_profile(k[inside], power[inside])
    middle = (found.wavenumber > 2 * spectrum.wavenumber[0]) & (
        found.wavenumber < 0.4 * spectrum.wavenumber[-1])
    ratio = np.log10(found.psd[middle] / spectrum.at(found.wavenumber[middle]))
    assert abs(ratio.mean()) < 0.03


def test_line_scans_have_the_spectrum_of_their_road():
    """The ends of a measured line do not fit. A wrong factor of 2 would be 0.3 decades."""
    height, spectrum = road(1024, short=1 / 100)
    k = np.geomspace(1.5 * spectrum.wavenumber[0], 0.7 * spectrum.wavenumber[-1], 50)
    ratios = []
    for row in range(0, 1024, 32):
        found = spectrum_of_map(height[row : row + 1, :1000], 1000 / 1024, 1 / 1024)
        inside = (k > found.wavenumber[0]) & (k < found.wavenumber[-1])
        ratios.append(np.mean(np.log10(found.at(k[inside]) / spectrum.at(k[inside]))))
    assert abs(np.mean(ratios)) < 0.15


def test_the_name_of_many_roads_fits_into_a_title():
    assert name_of_several(["a.csv", "b.csv", "a.csv"]) == "a.csv and b.csv"
    many = name_of_several(f"profile_{k:03d}.csv" for k in range(40))
    assert many == "profile_000.csv and 39 others"
    k = np.logspace(3, 5, 20)
    joined = join_spectra([Spectrum(k, k**-3.6, name=f"profile_{i:03d}.csv") for i in range(40)])
    assert joined.name == many
    assert len(name_of_several(["x" * 250])) < 200


def test_scans_are_joined_within_their_ranges():
    whole = Spectrum(np.geomspace(1e2, 1e6, 41), np.geomspace(1e2, 1e6, 41) ** -3.6)
    wide, fine = whole.cut(short=2 * np.pi / 1e4), whole.cut(long=2 * np.pi / 3e3).scaled(1.1)
    joined = join_spectra([wide, fine])
    assert joined.band == pytest.approx(whole.band)
    k = np.geomspace(1e2, 1e6, 33)
    ratio = joined.at(k) / whole.at(k)
    assert (ratio > 1.0 - 1e-9).all() and (ratio < 1.21 + 1e-9).all()
    assert ratio[0] == pytest.approx(1.0) and ratio[-1] == pytest.approx(1.21)
    assert np.abs(np.diff(np.log(ratio))).max() < 0.12  # the joined spectrum has no step
    apart = join_spectra([whole.cut(short=2 * np.pi / 1e3), whole.cut(long=2 * np.pi / 1e5)])
    assert any("no scan covers the waves" in note for note in apart.notes)
    np.testing.assert_allclose(apart.at(k), whole.at(k), rtol=1e-6)


def test_joined_scans_have_the_mean_of_their_densities():
    """The density of one mode is distributed exponentially; the mean of its logarithm is -0.58."""
    random = np.random.default_rng(1)
    k = np.geomspace(1e2, 1e4, 21)
    joined = join_spectra([Spectrum(k, random.exponential(k**-3.6)) for _ in range(64)])
    assert np.mean(joined.psd / k**-3.6) == pytest.approx(1.0, abs=0.06)


def measured(cells=256, periodic=False, seed=1):
    height, _ = road(cells, seed=seed)
    return MeasuredSurface(height, 1e-3, 1e-3, periodic, "m",
                           source={"name": f"scan {seed}", "format": "x", "metadata": {}})


def test_patches_do_not_overlap_and_are_reproducible(tmp_path):
    made = MeasuredRoad([measured()], 64)
    assert made.join == "seam" and made.count == 9
    codes = [made.patch(number).code for number in range(9)]
    assert len(set(codes)) == 9
    again = MeasuredRoad([measured()], 64)
    assert [again.patch(number).code for number in range(9)] == codes
    assert sorted(MeasuredRoad([measured()], 64, seed=2).patch(n).code for n in range(9)) == (
        sorted(codes))
    patch = made.patch(0)
    assert patch.height.shape == (64, 64) and patch.lx == pytest.approx(1e-3 / 4)
    assert abs(patch.height.mean()) < 1e-18
    # the spectrum ends at waves of six cells
    modes = np.abs(np.fft.rfft2(patch.height))
    k = np.hypot(np.fft.rfftfreq(64), np.fft.fftfreq(64)[:, None])
    assert modes[k > 1 / 5.9].max() < 1e-12 * modes.max()
    with h5py.File(patch.save(tmp_path)) as file:
        np.testing.assert_array_equal(file["surface/height"][:], patch.height)


def test_small_maps_and_periodic_maps_are_taken_as_they_are():
    few = MeasuredRoad([measured(64)], 512)
    assert few.cells == 50 and few.count == 1 and few.join == "seam"
    assert MeasuredRoad([measured(67)], 512).cells == 50  # there is room for 52, which are slower
    assert any("no room for 512" in note for note in few.notes)
    whole = MeasuredRoad([measured(64, periodic=True), measured(64, periodic=True, seed=2)], 64)
    assert whole.join == "none" and whole.count == 2
    with pytest.raises(ValueError, match="at least 16"):
        MeasuredRoad([measured(16)], 512)


def test_an_oblong_periodic_map_is_taken_whole():
    """A piece of it would not be periodic."""
    square = measured(64, periodic=True)
    oblong = MeasuredSurface(np.hstack([square.height, square.height]), 2 * square.lx, square.ly,
                             True, "m", source=square.source)
    odd = measured(63, periodic=True)
    road = MeasuredRoad([oblong, square, odd], 128)
    assert road.join == "none" and road.cells == 128 and road.notes == []
    assert sorted(road.patch(number).height.shape for number in range(road.count)) == [
        (63, 63), (64, 64), (64, 128)]
    assert any("without a join" in note for note in MeasuredRoad([measured()], 64, "none").notes)


def test_a_shortest_wave_that_leaves_nothing_is_refused_before_the_runs():
    with pytest.raises(ValueError, match="none of those that are wanted"):
        MeasuredRoad([measured(128)], 64, short=measured(128).lx * 0.45)
