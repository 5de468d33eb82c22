"""Solve random contact problems: find those that do not converge, and errors of small contacts.

python tools/campaign_contact.py normal 200000      grids of up to 256 cells, all controls
python tools/campaign_contact.py extreme 2000       tiny loads, displacements beyond full contact
python tools/campaign_contact.py sizes              errors of rough contacts of few cells
python tools/campaign_contact.py hertz              errors of single contacts of few cells
python tools/campaign_contact.py oblong             iterations with cells longer than wide
python tools/campaign_contact.py long               iterations on grids longer than wide
python tools/campaign_contact.py strips 150         errors and iterations on strips of any length
python tools/campaign_contact.py shapes 300         the same of noise, walks, waves; any cells
python tools/campaign_contact.py edge               iterations of contacts at the edge of free maps
python tools/campaign_contact.py pull               errors of the pull-off force of spheres
"""

import argparse
import itertools
import math
import warnings
from collections import Counter

import numpy as np

import asperity


def small_height(rng, nx, ny):
    """Draw a map of some kind: noise, steps, one summit, a bowl, rounded noise, a wave."""
    y, x = np.mgrid[:ny, :nx]
    kind = rng.integers(6)
    if kind == 0:
        height = rng.standard_normal((ny, nx))
    elif kind == 1:
        height = (rng.random((ny, nx)) < 0.5) * 1.0
    elif kind == 2:
        height = np.zeros((ny, nx))
        height[rng.integers(ny), rng.integers(nx)] = 1.0
    elif kind == 3:
        height = -1.0 * ((x - nx / 2) ** 2 + (y - ny / 2) ** 2)
    elif kind == 4:
        height = np.round(2 * rng.standard_normal((ny, nx))) / 2
    else:
        height = np.cos(2 * np.pi * (x / nx * rng.integers(3) + y / ny * rng.integers(3))
                        + rng.uniform(0, 6))
    return height * 10.0 ** rng.uniform(-5, -1)


def normal_problem(rng):
    """Draw a small convex problem, and return the arguments of `asperity.solve_normal`."""
    most = int(rng.choice([8, 16, 64, 256]))
    cells = 0
    while not 2 <= cells <= most:
        nx = int(rng.integers(1, 17 if rng.random() < 0.8 else 65))
        ny = 1 if rng.random() < 0.3 else int(rng.integers(1, 17))
        cells = nx * ny
    free = ny > 1 and nx > 1 and rng.random() < 0.4
    ly = None
    if ny > 1:
        ly = ny / nx * (math.exp(rng.uniform(-2, 2)) if rng.random() < 0.4 else 1.0)
    height = small_height(rng, nx, ny)
    span = np.ptp(height) or 1e-3
    given = {"height": height, "lx": 1.0, "ly": ly, "modulus": 10.0 ** rng.uniform(-2, 2),
             "boundary": "free" if free else "periodic", "tolerance": 10.0 ** rng.integers(-10, -4)}
    control = rng.integers(3)
    depth = height.max() - height.mean()
    if control == 2 and free:
        return given | {"displacement": span * rng.uniform(0.01, 1.5)}
    if control == 2 and depth > 1e-9 * span and np.ptp(height) > 1e-12 * np.abs(height).max():
        return given | {"displacement": depth * rng.uniform(0.001, 0.99)}
    pressure = given["modulus"] * span / max(1.0, ly or 1.0) * 10.0 ** rng.uniform(-4, 1.5)
    if control == 1:
        return given | {"force": pressure * (ly or 1.0 / nx)}
    return given | {"pressure": pressure}


def extreme_problem(rng, adhesive):
    """Draw a rough map far from zero under a tiny load, or far beyond full contact."""
    nx, ny = (int(n) for n in rng.integers(4, 33, 2))
    length = 10.0 ** rng.uniform(-4, 0)
    height = length * 10.0 ** rng.uniform(-5, -1) * rng.standard_normal((ny, nx))
    if rng.random() < 0.3:
        height += rng.uniform(-1, 1) * length
    modulus = 10.0 ** rng.uniform(0, 9)
    given = {"height": height, "lx": length, "ly": length * ny / nx, "modulus": modulus,
             "tolerance": 10.0 ** rng.integers(-9, -4)}
    if rng.random() < 0.5:
        given |= {"boundary": "free", "displacement": np.ptp(height) * 10.0 ** rng.uniform(0, 5)}
    else:
        given |= {"boundary": str(rng.choice(["free", "periodic"])),
                  "pressure": modulus * 10.0 ** rng.uniform(-22, -11)}
    if adhesive:
        reach = np.ptp(height) * 10.0 ** rng.uniform(-2, 0.5)
        energy = modulus * reach**2 / (length / nx) * 10.0 ** rng.uniform(-6, 0)
        given |= {"range": reach, "energy": energy,
                  "potential": str(rng.choice(["exponential", "gauss", "maugis_dugdale"]))}
    return given


def campaign(problems, solve):
    """Solve all problems, and print those that did not converge."""
    failures, iterations = Counter(), []
    for problem in problems:
        try:
            iterations.append(solve(**problem).iterations)
        except asperity.NotConverged as error:
            failures[error.result.reason] += 1
            if failures.total() <= 5:
                print(problem)
    print(f"{solve.__name__}: {failures.total()} of {failures.total() + len(iterations)} not"
          f" converged; iterations: mean {np.mean(iterations):.1f}, most {max(iterations)}")
    for reason, times in failures.items():
        print(f"   {times} x {reason}")


def single_sphere(width, place):
    """Return cells across and the error of the approach of a sphere, free; `width` in cells."""
    n = max(16, int(2 * width))
    x, y = (np.arange(n) - n // 2 - part for part in place)
    height = -(x**2 + y[:, None] ** 2) / 2
    contact = asperity.solve_normal(height, float(n), None, 1.0, force=(width / 2) ** 3 * 4 / 3,
                                    boundary="free", tolerance=1e-9)
    # The displacement counts from the highest cell, the approach from the summit beside it.
    return patch_size(contact.pressure > 0)[0], (contact.displacement - height.max()) / (
        width / 2) ** 2 - 1


def single_summit(width, place, cells=32, finer=6):
    """Return the same of the summit of a periodic wave; the reference is a finer grid."""
    depths, pressure = [], (width / 2 / cells) ** 3 * 4 / 3 * (2 * np.pi) ** 2
    for n, shift in ((cells * finer, (0.0, 0.0)), (cells, place)):
        x, y = (np.cos(2 * np.pi * (np.arange(n) - part) / n) for part in shift)
        height = x + y[:, None]
        contact = asperity.solve_normal(height, 1.0, 1.0, 1.0, pressure=pressure, tolerance=1e-9)
        depths.append(contact.displacement - height.max())
    return patch_size(contact.pressure > 0)[0], (depths[1] + 2) / (depths[0] + 2) - 1


def single_line(width, place, cells=256):
    """Return the same of the summit of a periodic profile; Westergaard's solution."""
    pressure = np.pi / cells * np.sin(np.pi * width / 2 / cells) ** 2
    height = np.cos(2 * np.pi * (np.arange(cells) - place[0]) / cells)[None, :]
    contact = asperity.solve_normal(height, float(cells), None, 1.0, pressure=pressure,
                                    tolerance=1e-10)
    known = asperity.theory.westergaard(1.0, float(cells), 1.0, pressure)
    return patch_size(contact.pressure > 0)[0], (contact.displacement + 1 - height.max()) / (
        1 - known.mean_gap) - 1


def patch_size(touching):
    """Return cells across a patch and the number of patches, both as a run estimates them."""
    runs = [(touching & ~np.roll(touching, 1, axis)).sum() for axis in (1, 0)]
    if touching.shape[0] == 1:
        return touching.sum() / runs[0], runs[0]
    return (4 / np.pi * touching.sum() / max(runs), np.pi / 4 * np.prod(runs) / touching.sum())


def hertz(rng, count):
    """Print the worst error of the approach by cells across, over summits in all places."""
    limits = (1, 2, 3, 4, 4.5, 5, 5.5, 6, 7, 8, 9)
    for solve in (single_sphere, single_summit, single_line):
        found = []
        for _ in range(count):
            # Extremes occur where the summit is at the centre, the edge or the corner of a cell.
            place = rng.choice([0.0, 0.5], 2) if rng.random() < 0.3 else rng.uniform(-0.5, 0.5, 2)
            found.append(solve(rng.uniform(1, 9), place))
        across, error = np.array(found).T
        for low, high in itertools.pairwise(limits):
            inside = 100 * error[(across >= low) & (across < high)]
            if inside.size:
                print(f"{solve.__name__}, {low:g} to {high:g} cells across: approach"
                      f" {inside.mean():+.1f} % in the mean, at most {abs(inside).max():.1f} %"
                      f" wrong ({inside.size} places)")


def largest_pull(parameter, cells, place, potential):
    """Return the pull-off force of a sphere; `cells` are those of a = (3 pi w R^2/(4 E*))^(1/3).

    In Maugis's units: R = 1, w = 1/pi, E* = 3/4, so that a = 1 and the force is in pi w R.
    """
    reach, dx = 2 / (np.pi * parameter), 1 / cells
    n = math.ceil((3.6 + 2 * reach) / dx)
    x, y = ((np.arange(n) - n // 2 - part) * dx for part in place)
    height = -(x**2 + y[:, None] ** 2) / 2
    contact, least = "non_adhesive", 0.0
    for approach in np.linspace(0.2, -1.4 - reach / 2, 80):
        contact = asperity.solve_adhesive(
            height, n * dx, None, 0.75, potential=potential, energy=1 / np.pi, range=reach,
            displacement=approach, boundary="free", start=contact)
        least = min(least, contact.force)
    return -least


def pull():
    """Print the worst error of the pull-off force by the cells of a over summits in four places."""
    for potential in ("maugis_dugdale", "exponential"):
        for parameter in (0.5, 1.0, 2.0):
            if potential == "maugis_dugdale":
                exact = -min(asperity.theory.maugis(1.0, 0.75, 1 / np.pi, contact_radius=radius,
                                                    maugis_parameter=parameter).force
                             for radius in np.linspace(0.02, 1.5, 400))
            else:
                exact = largest_pull(parameter, 20.0, (0.1, 0.3), potential)
            for cells in (2.0, 3.0, 4.0, 6.0, 8.0, 12.0):
                errors = [largest_pull(parameter, cells, place, potential) / exact - 1
                          for place in ((0.0, 0.0), (0.5, 0.5), (0.0, 0.5), (0.3, 0.15))]
                # a/dx = pi lambda^2/3 over dx in E* range^2/w
                print(f"{potential}, lambda {parameter:g}, {cells:g} cells in a (dx ="
                      f" {np.pi * parameter**2 / 3 / cells:.2f} E* range^2/energy): pull-off"
                      f" {100 * max(errors, key=abs):+.1f} % at worst", flush=True)


def sizes():
    """Print the errors of the area of rough maps by cells across a patch."""
    for pressure in (0.002, 0.01, 0.05, 0.2):
        areas = {}
        for n in (512, 256, 128, 64):
            height = asperity.surface.self_affine(
                n, n, 1.0, 1.0, wavelength_long=0.25, wavelength_short=1 / 16, rms_slope=1.0,
                seed=3)
            touching = asperity.solve_normal(height, 1.0, 1.0, 1.0, pressure=pressure).pressure > 0
            areas[n] = touching.mean()
            print(f"rough, p = {pressure:g} E* h'rms, {n // 16} cells in the shortest wave:"
                  f" {patch_size(touching)[0]:.1f} cells across a patch, area"
                  f" {100 * (areas[n] / areas[512] - 1):+.1f} % of that of 512 x 512 cells")


def oblong():
    """Print the iterations of a rough contact whose cells become longer and longer."""
    height = asperity.surface.self_affine(128, lx=1.0, wavelength_short=1 / 16, rms_slope=1.0)
    for ratio in (1, 2, 4, 10, 16, 30, 100, 300, 1000, 10000):
        counts = []
        for pressure in (0.01, 0.1, 0.3):
            try:
                found = asperity.solve_normal(height, 1.0, float(ratio), 1.0, pressure=pressure)
                counts.append(f"{found.iterations}")
            except asperity.NotConverged:
                counts.append("not converged")
        print(f"cells {ratio} times as long as wide: iterations {', '.join(counts)}")


def long():
    """Print the iterations of rough contacts on grids of a million cells that become longer."""
    side = 1e-3
    for ratio in (1, 4, 16, 64, 256):
        nx, ny = round(1024 * ratio**0.5), round(1024 / ratio**0.5)
        counts = {"pressure": [], "displacement": []}
        for seed in (1, 2):
            height = asperity.surface.self_affine(
                nx, ny, lx=nx * side, ly=ny * side, hurst=0.5, wavelength_long=ny * side / 2,
                wavelength_short=6 * side, rms_slope=0.1, seed=seed)
            depth = height.max() - height.mean()
            for control, value in itertools.chain(
                    (("pressure", p) for p in (0.0005, 0.005, 0.05)),
                    (("displacement", part * depth) for part in (0.2, 0.5, 0.8))):
                try:
                    found = asperity.solve_normal(height, nx * side, ny * side, 1.0,
                                                  **{control: value})
                    counts[control].append(f"{found.iterations}")
                except asperity.NotConverged:
                    counts[control].append("not converged")
        for control, numbers in counts.items():
            print(f"{nx} x {ny} cells, {control}: iterations {', '.join(numbers)}")


def strip_contact(rng):
    """Draw a road of any length and width, with its sides in cells of any shape, and a load."""
    nx, ny = int(10 ** rng.uniform(1, 4)), int(10 ** rng.uniform(0, 2))
    qx, qy = np.fft.fftfreq(nx), np.fft.fftfreq(ny)[:, np.newaxis]
    wave_number = np.hypot(qx, qy)
    longest, shortest = 10 ** rng.uniform(0.8, math.log10(nx)), rng.uniform(2.5, 12)
    inside = (wave_number >= 1 / longest) & (wave_number <= 1 / shortest)
    amplitude = np.where(inside, np.maximum(wave_number, 1e-9) ** -rng.uniform(1.3, 2.0), 0.0)
    phase = np.exp(2j * np.pi * rng.random((ny, nx)))
    height = np.fft.ifft2(amplitude * phase).real
    slope = math.sqrt(np.mean(np.diff(height, axis=1) ** 2))
    if slope == 0.0:
        return strip_contact(rng)
    height *= 0.1 / slope
    load = {"pressure": 0.1 * 10 ** rng.uniform(-3, 0.2)}
    dx, dy = 10 ** rng.uniform(-0.5, 0.5, 2)
    if ny > 1 and rng.random() < 0.5:
        return np.ascontiguousarray(height.T), ny * dx, nx * dy, load
    return height, nx * dx, ny * dy if ny > 1 else None, load


def shaped_contact(rng):
    """Draw white noise, a random walk or some waves on cells of any shape, and an approach."""
    cells = 0
    while not 200 < cells < 60000:
        nx, ny = (int(n) for n in 10 ** rng.uniform((1.3, 0.3), (3.7, 2.6)))
        cells = nx * ny
    kind = rng.integers(3)
    if kind == 2:
        x, y = np.arange(nx) / nx, np.arange(ny)[:, np.newaxis] / ny
        height = sum(np.cos(2 * np.pi * (i * x + j * y) + phase) for i, j, phase in zip(
            rng.integers(1, 4, 3), rng.integers(0, 4, 3), rng.uniform(0, 6, 3), strict=True))
    else:
        height = rng.standard_normal((ny, nx))
    if kind == 1:
        height = np.cumsum(height, axis=1)
        height -= np.linspace(0, 1, nx) * height[:, -1:]
        height = np.minimum(height, np.quantile(height, 0.8))
    dy = 10 ** rng.uniform(-2, 2)
    load = {"displacement": (height.max() - height.mean()) * 10 ** rng.uniform(-2, -0.01)}
    if rng.random() < 0.5:
        return np.ascontiguousarray(height.T), float(ny), nx * dy, load
    return height, float(nx), ny * dy, load


def faults_of_contact(found, height, lx, ly):
    """Return the duality gap and the distance of the loaded cells from their mean level.

    Both are divided by the rms height. The gap is computed by the Fourier transform of numpy.
    """
    ny, nx = height.shape
    qx = 2 * np.pi * np.fft.fftfreq(nx, lx / nx)
    qy = 2 * np.pi * np.fft.fftfreq(ny, (ly or 1.0) / ny)[:, np.newaxis]
    wave_number = np.hypot(qx, qy)
    compliance = 2 / np.where(wave_number > 0, wave_number, np.inf)
    pressure = found.pressure.reshape(height.shape)
    gap = np.fft.ifft2(compliance * np.fft.fft2(pressure)).real - height
    level = np.sum(pressure * gap) / np.sum(pressure)
    distance = np.sum(pressure * np.abs(gap - level)) / np.sum(pressure)
    return (level - gap.min()) / height.std(), distance / height.std()


def periodic(rng, count, draw):
    """Solve contacts at a given load and approach, one after the other; print their errors."""
    iterations, gaps, distances, missing = [], [], [], 0
    for _ in range(count):
        height, lx, ly, control = draw(rng)
        for _ in range(2):
            try:
                found = asperity.solve_normal(height, lx, ly, 1.0, **control)
            except asperity.NotConverged:
                missing += 1
                break
            except ValueError:
                break                     # full contact, which no approach determines
            iterations.append(found.iterations)
            gap, distance = faults_of_contact(found, height, lx, ly)
            gaps.append(gap)
            distances.append(distance)
            control = ({"displacement": found.displacement} if "pressure" in control
                       else {"pressure": found.pressure.mean()})
    print(f"{len(iterations)} contacts, {missing} not converged; iterations: median "
          f"{np.median(iterations):g}, 95 % {np.quantile(iterations, 0.95):.0f}, most "
          f"{max(iterations)}; largest duality gap {max(gaps):.1e} and distance of loaded cells "
          f"{max(distances):.1e} of the rms height")


def edge():
    """Print iterations and transforms of rough contacts that reach the edge of a free map."""
    for n, boundary in itertools.product((128, 256, 512, 1024), ("free", "periodic")):
        height = asperity.surface.self_affine(n, n, lx=1.0, ly=1.0, hurst=0.8, wavelength_long=0.5,
                                              wavelength_short=8 / n, rms_slope=0.1, seed=1)
        counts = []
        for pressure in (0.0005, 0.005, 0.05, 0.1):
            found = asperity.solve_normal(height, 1.0, 1.0, 1.0, pressure=pressure,
                                          boundary=boundary)
            counts.append(f"{found.iterations} ({found.ffts}) at {100 * found.contact_area:.0f} %")
        print(f"{n} x {n} cells, {boundary}: iterations (transforms) at contact",
              ", ".join(counts))


def main():
    """Run the chosen campaign."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["normal", "extreme", "sizes", "hertz", "pull", "oblong",
                                         "long", "strips", "shapes", "edge"])
    parser.add_argument("count", nargs="?", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    rng = np.random.default_rng(given.seed)
    if given.what == "sizes":
        sizes()
    elif given.what == "pull":
        pull()
    elif given.what == "hertz":
        hertz(rng, given.count)
    elif given.what == "oblong":
        oblong()
    elif given.what == "long":
        long()
    elif given.what == "strips":
        periodic(rng, given.count, strip_contact)
    elif given.what == "shapes":
        periodic(rng, given.count, shaped_contact)
    elif given.what == "edge":
        edge()
    elif given.what == "normal":
        campaign((normal_problem(rng) for _ in range(given.count)), asperity.solve_normal)
    else:
        for solve in (asperity.solve_normal, asperity.solve_adhesive):
            campaign((extreme_problem(rng, solve is asperity.solve_adhesive)
                      for _ in range(given.count)), solve)


if __name__ == "__main__":
    main()
