"""Compare random steady rows with dense matrices, and list those that are wrong.

Grids are small, even and odd, oblong, with one row or more; roads have waves down to two cells and
rms slopes up to 0.8; the rubber is elastic or has up to six arms, with moduli in a ratio of up to
1000, any Poisson ratio, and is a half-space or a block; the road slides in any direction; the law
is any of those of the program, flat or on the slope. Each case is a curve of up to three speeds or
loads, so that rows begin from those before them.

This tool shares nothing with the solver: it sums the waves of the solid one by one, has its own
cubic spline of the road, and its own formulas of the friction laws, in the closed form in which a
cell without gap and pressure may carry a share of a constant strength. For the pressure and the
traction of every row it computes

gap        how far the contact conditions are missed: sum(P gap) with the smallest gap as zero,
           over the load times the rms height (the measure of the solver's tolerance), and the load;
           in tolerances
bound      how far the tractions are from the bound or from the direction of slip, relative to all
           tractions; in tolerances
error      the difference from the exact solution nearby, which Newton's method finds with dense
           matrices: the sum over the cells of the differences of P and T, over the load
friction   the difference of the friction coefficient from the exact one
power      power_viscous and power_friction from the modes and the slip, and the balance with force
           times speed, relative to the greater of both powers

A row ends in one of four ways: right; reported (status 4: the row did not converge); wrong (the
program says that the row has converged, but a measure is above its limit); open (gap and bound are
right, but the reference found no solution nearby or, with friction, went to another one).

usage: python tools/steady_campaign.py [--count 200] [--seed 1] [--jobs 1] [--program asperity]
       [--laws none coulomb ...] [--tolerance 1e-8] [--verbose]
"""

import argparse
import concurrent.futures
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

import h5py
import numpy as np

LIMITS = dict(gap=10.0, bound=10.0, error=2e-4, friction=2e-4, power=1e-6, balance=1e-6)
LAWS = ("none", "coulomb", "coulomb_orowan", "constant_shear")


# ---- random cases ----------------------------------------------------------------------------


def road(rng: np.random.Generator, nx: int, ny: int, lx: float, ly: float) -> np.ndarray:
    """Return random periodic heights, m, with waves down to two, three or six cells."""
    fx, fy = np.fft.fftfreq(nx) * nx, np.fft.fftfreq(ny) * ny
    wave = np.hypot(fx[None, :] / lx, fy[:, None] / ly)
    shortest = rng.choice([2.0, 3.0, 6.0]) * max(lx / nx, ly / ny if ny > 1 else 0.0)
    allowed = (wave > 0) & (wave <= max(1 / shortest, np.sort(wave[wave > 0])[0]))
    amplitude = np.where(allowed, np.where(allowed, wave, 1.0) ** -rng.uniform(1.5, 2.5), 0.0)
    height = np.fft.ifft2(amplitude * np.exp(2j * np.pi * rng.random((ny, nx)))).real
    if rng.random() < 0.3:
        height = np.minimum(height, height.mean() + rng.uniform(0, 1) * height.std())
    spectrum = np.fft.fft2(height)
    square = sum(np.mean(np.fft.ifft2(2j * np.pi * w * spectrum).real ** 2)
                 for w in (fx[None, :] / lx, fy[:, None] / ly))
    return height * float(10 ** rng.uniform(-1.7, -0.1)) / np.sqrt(square)


def make_case(seed: int, folder: Path, laws: tuple[str, ...], tolerance: float
              ) -> tuple[str, dict[str, Any]]:
    """Write the road of a random case; return its input, and its values."""
    rng = np.random.default_rng(seed)
    nx = int(rng.integers(4, 21))
    ny = int(rng.choice([1, nx, rng.integers(3, 17), rng.integers(3, 17)]))
    lx = 1e-2
    ly = lx * ny / nx * float(rng.choice([1.0, 1.0, 0.4, 2.5]))
    height = road(rng, nx, ny, lx, ly)
    with h5py.File(folder / "road.h5", "w") as file:
        file["surface"] = height
    slope = np.hypot(np.ptp(height) / lx, 1e-9) * 4
    arms = int(rng.choice([0, 1, 1, 2, 6]))
    total = 1e6 * (10 ** rng.uniform(0, 3) - 1)
    share = rng.random(arms) + 0.1
    case: dict[str, Any] = dict(
        seed=seed, nx=nx, ny=ny, lx=lx, ly=ly, height=height,
        nu=float(rng.choice([0.5, 0.5, 0.3, 0.0, 0.47])), modulus=1e6,
        g=total * share / share.sum() if arms else np.zeros(0),
        tau=10 ** rng.uniform(-4, 1, arms), thickness=lx * float(rng.choice([0, 0, 0.2, 3])),
        law=str(rng.choice(laws)), slope=bool(rng.random() < 0.5),
        mu=float(10 ** rng.uniform(-1, 0.2)), physical=bool(rng.random() < 0.8), rows=[])
    case["slope"] = case["slope"] and case["law"] != "none"
    angle = float(rng.choice([0, np.pi / 2, np.pi, rng.uniform(0, 6.3), rng.uniform(0, 6.3)]))
    if ny == 1:
        angle = float(rng.choice([0, np.pi]))
    pressure = (1e6 + total * rng.random() ** 2) * slope * 10 ** rng.uniform(-2, 0.3)
    speed = lx * 10 ** rng.uniform(-2, 4)
    case["strength"] = case["mu"] * pressure * float(rng.choice([0.5, 1.0, 3.0]))
    for _ in range(int(rng.integers(1, 4))):
        across = speed * np.sin(angle) if ny > 1 else 0.0
        case["rows"].append((float(pressure), float(speed * np.cos(angle)), float(across)))
        factor = 10 ** rng.uniform(-1, 1)
        if rng.random() < 0.5:
            speed *= factor
        else:
            pressure *= factor**0.5
    return write_case(case, rng, tolerance), case


def write_case(case: dict[str, Any], rng: np.random.Generator, tolerance: float) -> str:
    """Return the input of a case."""
    def listed(values: np.ndarray) -> str:
        return ", ".join(repr(float(value)) for value in values)

    lines = ["&grid nx = {nx}, ny = {ny}, lx = {lx!r}, ly = {ly!r} /".format(**case),
             "&surface shape = 'file', file = 'road.h5' /",
             "&material poisson = {nu}, shear_modulus = {modulus!r},"
             " thickness = {thickness!r}".format(**case)
             + (f", prony_g = {listed(case['g'])}, prony_tau = {listed(case['tau'])}"
                if case["g"].size else "") + " /"]
    if case["law"] != "none":
        words = [f"law = '{case['law']}'", f"slope_effect = .{str(case['slope']).lower()}."]
        if case["law"] != "constant_shear":
            words.append(f"coefficient = {case['mu']!r}")
        if case["law"] != "coulomb":
            words.append(f"shear_strength = {float(case['strength'])!r}")
        lines.append(f"&friction {', '.join(words)} /")
    by_force = rng.random() < 0.3
    area = case["lx"] * case["ly"]
    for pressure, vx, vy in case["rows"]:
        load = f"force = {pressure * area!r}" if by_force else f"pressure = {pressure!r}"
        lines.append(f"&phase steady = T, {load}, velocity_x = {vx!r}, velocity_y = {vy!r} /")
    lines.append(f"&solver tolerance = {tolerance!r}, threads = 1,"
                 f" slip_law = '{'physical' if case['physical'] else 'thesis'}' /")
    lines.append("&output file = 'out.h5', snapshot_every = 1 /")
    return "\n".join(lines) + "\n"


# ---- the reference ---------------------------------------------------------------------------


class Spline:
    """The periodic cubic spline through a map, by dense matrices of a line of cells."""

    def __init__(self, height: np.ndarray, dx: float, dy: float) -> None:
        self.step = dx, dy
        self.coefficients = np.linalg.solve(self._line(height.shape[0]), height)
        self.coefficients = np.linalg.solve(self._line(height.shape[1]), self.coefficients.T).T

    @staticmethod
    def _line(n: int) -> np.ndarray:
        one = np.eye(n)
        return (4 * one + np.roll(one, 1, 0) + np.roll(one, -1, 0)) / 6

    def at(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return height and both slopes at some places, arrays of one shape."""
        ny, nx = self.coefficients.shape
        a, b = x / self.step[0], y / self.step[1]
        i, j = np.floor(a).astype(int), np.floor(b).astype(int)
        found = [np.zeros_like(a) for _ in range(3)]
        for k in range(-1, 3):
            for m in range(-1, 3):
                c = self.coefficients[(j + m) % ny, (i + k) % nx]
                wx, dwx = basis(a - i - k)
                wy, dwy = basis(b - j - m)
                found[0] += c * wx * wy
                found[1] += c * dwx * wy / self.step[0]
                found[2] += c * wx * dwy / self.step[1]
        return found[0], found[1], found[2]


def basis(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the cubic B-spline and its derivative."""
    s, sign = np.abs(t), np.sign(t)
    inner, outer = s < 1, (s >= 1) & (s < 2)
    value = np.where(inner, 2 / 3 - s**2 + s**3 / 2, np.where(outer, (2 - s) ** 3 / 6, 0.0))
    slope = np.where(inner, -2 * s + 1.5 * s**2, np.where(outer, -((2 - s) ** 2) / 2, 0.0))
    return value, slope * sign


class Reference:
    """The equations of a steady row with dense matrices. Fields are vectors over the cells."""

    def __init__(self, case: dict[str, Any], row: tuple[float, float, float]) -> None:
        self.case, self.pressure = case, row[0]
        self.velocity = np.array(row[1:])
        self.speed = float(np.hypot(*self.velocity))
        self.e = self.velocity / self.speed
        nx, ny = case["nx"], case["ny"]
        self.x, self.y = (f.ravel() for f in np.meshgrid(
            np.arange(nx) * case["lx"] / nx, np.arange(ny) * case["ly"] / ny))
        self.spline = Spline(case["height"], case["lx"] / nx, case["ly"] / ny)
        self.rms = float(np.std(case["height"]))
        self._waves()
        self._matrices()

    def _waves(self) -> None:
        """List the waves with both signs of a Nyquist wave, each with half the weight."""
        case = self.case
        qs, weights = [], []
        for m in range(-(case["ny"] // 2), case["ny"] // 2 + 1):
            for k in range(-(case["nx"] // 2), case["nx"] // 2 + 1):
                if k or m:
                    qs.append((2 * np.pi * k / case["lx"], 2 * np.pi * m / case["ly"]))
                    weights.append((0.5 if 2 * abs(k) == case["nx"] else 1.0)
                                   * (0.5 if 2 * abs(m) == case["ny"] else 1.0))
        self.q, self.weight = np.array(qs), np.array(weights)
        self.length = np.hypot(*self.q.T)
        omega = -self.q @ self.velocity
        self.modulus = case["modulus"] + np.zeros(len(omega), complex)
        for g, tau in zip(case["g"], case["tau"], strict=True):
            self.modulus += g * 1j * omega * tau / (1 + 1j * omega * tau)
        self.omega = omega

    def _matrices(self) -> None:
        n = self.x.size
        phase = np.exp(1j * np.outer(self.x, self.q[:, 0]) + 1j * np.outer(self.y, self.q[:, 1]))
        nu, unit = self.case["nu"], self.q / self.length[:, None]
        base = self.weight / (self.length * self.modulus) / n
        along = 1j * self.q @ self.e

        def matrix(symbol: np.ndarray) -> np.ndarray:
            return ((phase * symbol) @ phase.conj().T).real

        mixed = np.where(self.weight < 1, 0.0, -nu * unit[:, 0] * unit[:, 1])
        parts = {(0, 0): 1 - nu * unit[:, 0] ** 2, (1, 1): 1 - nu * unit[:, 1] ** 2, (0, 1): mixed}
        self.k = matrix((1 - nu) * base)
        self.a, self.d = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 2 * n))
        for (i, j), part in parts.items():
            for place in {(i, j), (j, i)}:
                rows = slice(place[0] * n, place[0] * n + n)
                columns = slice(place[1] * n, place[1] * n + n)
                self.a[rows, columns] = matrix(part * base)
                self.d[rows, columns] = matrix(part * base * along)
        self.phase = phase

    def state(self, p: np.ndarray, t: np.ndarray, place: np.ndarray) -> dict[str, np.ndarray]:
        """Return displacements, slip and the road under a pressure [n] and a traction [2 n].

        The road is read at x + u - place - (mean of u in the contact), as in the program's rows, so
        that the mean displacement of the contact does not count.
        """
        n = p.shape[0]
        u, slip = self.a @ t, self.d @ t
        height, hx, hy = self.spline.at(self.x.reshape(-1, *[1] * (p.ndim - 1)) + u[:n] - place[0],
                                        self.y.reshape(-1, *[1] * (p.ndim - 1)) + u[n:] - place[1])
        return dict(p=p, t=t, gap=self.k @ p - height, hx=hx, hy=hy,
                    rx=self.e[0] + slip[:n], ry=self.e[1] + slip[n:], ux=u[:n], uy=u[n:])

    def bound(self, s: dict[str, np.ndarray]) -> tuple[np.ndarray, ...]:
        """Return d = T - T*, how far it is on its bound (1 is on it), and the stretched slip."""
        n = s["p"].shape[0]
        hx, hy = (s["hx"], s["hy"]) if self.case["slope"] else (0 * s["hx"], 0 * s["hy"])
        dx, dy = s["t"][:n] + s["p"] * hx, s["t"][n:] + s["p"] * hy
        steep = np.sqrt(1 + hx**2 + hy**2)
        across = (-hx * dx - hy * dy) / steep
        m = np.sqrt(np.maximum(dx**2 + dy**2 - across**2, 0.0))
        law, mu, strength = self.case["law"], self.case["mu"], self.case["strength"]
        used = []
        if law != "constant_shear":
            force = mu * s["p"] * steep
            used.append((m - mu * across) / np.maximum(force, 1e-300))
        if law != "coulomb":
            used.append(m / strength)
        stretch = hx * s["rx"] + hy * s["ry"] if self.case["physical"] else 0.0
        return dx, dy, np.max(used, axis=0), s["rx"] + hx * stretch, s["ry"] + hy * stretch

    def law_error(self, s: dict[str, np.ndarray]) -> float:
        """Return how far the tractions miss the law, relative to all tractions."""
        dx, dy, used, rx, ry = self.bound(s)
        size = np.hypot(dx, dy)
        inside = s["p"] > 0
        sheared = self.sheared(s["p"], s["t"])
        slip = np.hypot(rx, ry)
        beyond = np.abs(used - 1)
        turned = np.hypot(dx / np.maximum(size, 1e-300) - rx / np.maximum(slip, 1e-300),
                          dy / np.maximum(size, 1e-300) - ry / np.maximum(slip, 1e-300))
        miss = np.where(used < 1 - 1e-6, np.minimum(slip, np.hypot(beyond, turned)),
                        np.where(slip < 1e-6, np.maximum(used - 1, 0), np.hypot(beyond, turned)))
        miss = np.where(sheared, np.hypot(np.maximum(used - 1, 0), turned), miss)
        total = np.hypot(*s["t"].reshape(2, -1))
        outside = float(np.sum(total[~inside & ~sheared]))
        return float((np.sqrt(np.sum((miss * size)[inside | sheared] ** 2)) + outside)
                     / max(np.sqrt(np.sum(total**2)), 1e-300))

    def sheared(self, p: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Return whether a cell touches without pressure, with a share of constant strength."""
        return (p <= 0) & (np.hypot(*t.reshape(2, -1)) > 0) & (self.case["law"] == "constant_shear")

    def gap_error(self, s: dict[str, np.ndarray]) -> float:
        """Return the duality gap over load and rms height, with the error of the load."""
        load = np.sum(s["p"])
        level = s["gap"].min()
        e1 = np.sum(s["p"] * (s["gap"] - level)) / (load * self.rms)
        wide = (s["gap"] - level)[self.sheared(s["p"], s["t"])]
        return max(float(e1), float(np.sum(wide) / self.rms),
                   abs(float(load / (self.pressure * s["p"].size)) - 1),
                   float(max(0.0, -s["p"].min()) / s["p"].max()))

    def powers(self, s: dict[str, np.ndarray]) -> tuple[float, float, float]:
        """Return the losses in the rubber and by friction, and the part that the flat law omits."""
        n, nu = s["p"].size, self.case["nu"]
        area = self.case["lx"] * self.case["ly"]
        modes = self.phase.conj().T @ np.column_stack([s["p"], s["t"][:n], s["t"][n:]]) / n
        unit = self.q / self.length[:, None]
        mixed = np.where(self.weight < 1, 0.0, nu * unit[:, 0] * unit[:, 1])
        form = ((1 - nu) * np.abs(modes[:, 0]) ** 2
                + (1 - nu * unit[:, 0] ** 2) * np.abs(modes[:, 1]) ** 2
                + (1 - nu * unit[:, 1] ** 2) * np.abs(modes[:, 2]) ** 2
                - 2 * mixed * (modes[:, 1].conj() * modes[:, 2]).real)
        rate = (1j * self.omega / self.modulus).real
        loss = area * np.sum(self.weight * form * rate / self.length)
        dx, dy = s["t"][:n].copy(), s["t"][n:].copy()
        if self.case["slope"]:
            dx, dy = dx + s["p"] * s["hx"], dy + s["p"] * s["hy"]
        heat = self.speed * area * np.mean(dx * s["rx"] + dy * s["ry"])
        missing = 0.0
        if not self.case["slope"]:
            missing = self.speed * area * np.mean(s["p"] * (
                s["hx"] * (s["rx"] - self.e[0]) + s["hy"] * (s["ry"] - self.e[1])))
        return float(loss), float(heat), float(missing)

    # -- Newton's method from a state: contact cells fixed by it, corrected as it goes

    def solve(self, p: np.ndarray, t: np.ndarray, place: np.ndarray, rounds: int = 30
              ) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the exact pressure and traction nearest to a state, or None."""
        n = p.size
        frictional = self.case["law"] != "none"
        gap = self.state(p, t, place)["gap"]
        level = float(np.sum(p * gap) / np.sum(p))
        stiff = 1.0 / np.abs(np.diag(self.k)).max()
        contact = p > stiff * np.maximum(gap - level, 0)
        sheared = self.sheared(p, t)
        contact &= ~sheared
        z = np.concatenate([p, t, [level]])
        for _ in range(rounds):
            cells, rubbing = np.flatnonzero(contact), np.flatnonzero(contact | sheared)
            free = np.concatenate([cells, n + rubbing, 2 * n + rubbing] if frictional else [cells])
            free = np.concatenate([free, [3 * n]])
            keep = np.zeros(3 * n + 1, bool)
            keep[free] = True
            z[~keep] = 0.0

            def residual(columns: np.ndarray, cells=cells, rubbing=rubbing) -> np.ndarray:
                return self._equations(columns, cells, rubbing, frictional, place)

            for _ in range(25):
                r = residual(z[:, None])[:, 0]
                step = 1e-7 * np.concatenate([np.full(3 * n, self.pressure), [self.rms]])[free]
                columns = np.repeat(z[:, None], free.size, axis=1)
                columns[free, np.arange(free.size)] += step
                jacobian = (residual(columns) - r[:, None]) / step
                try:
                    move = np.linalg.solve(jacobian, -r)
                except np.linalg.LinAlgError:
                    return None
                z[free] += move
                if not np.all(np.isfinite(z)):
                    return None
                if np.abs(move[:-1]).max() < 1e-11 * np.abs(z[:n]).max():
                    break
            s = self.state(z[:n], z[n:3 * n], place)
            wanted = np.where(contact, z[:n] > 0, (s["gap"] - z[-1] < 0) & ~sheared)
            if sheared.any() and np.max(self.bound(s)[2][sheared]) > 1:
                return None
            if np.array_equal(wanted, contact):
                return z[:n].copy(), z[n:3 * n].copy()
            contact = wanted
            z[:n] = np.maximum(z[:n], 0)
            fresh = contact & (z[:n] <= 0)
            z[:n][fresh] = 1e-3 * self.pressure
            for part in range(2):
                z[n * (1 + part):n * (2 + part)][fresh] = (
                    self.case["mu"] * 1e-3 * self.pressure * self.e[part] if frictional else 0.0)
        return None

    def _equations(self, z: np.ndarray, cells: np.ndarray, rubbing: np.ndarray, frictional: bool,
                   place: np.ndarray) -> np.ndarray:
        """Return the residuals of columns of unknowns, one for each free unknown."""
        n = self.x.size
        s = self.state(z[:n], z[n:3 * n], place)
        found = [(s["gap"] - z[3 * n])[rubbing] / self.rms]
        if frictional:
            found.append(self.bound(s)[2][cells] - 1)
            dx, dy, _, rx, ry = (f[rubbing] for f in self.bound(s))
            found.append((dx * ry - dy * rx) / self.pressure / np.hypot(rx, ry))
        found.append((np.sum(z[:n], axis=0) / (n * self.pressure) - 1)[None])
        return np.concatenate(found)


# ---- judging ---------------------------------------------------------------------------------


def judge(case: dict[str, Any], file: h5py.File, number: int, tolerance: float) -> dict[str, Any]:
    """Return the measures of a row, and how it ends."""
    history = {name: file["history"][name][number] for name in (
        "step", "friction", "friction_viscous", "force", "power_viscous", "power_friction",
        "road_x", "road_y", "contact_area")}
    reference = Reference(case, case["rows"][number])
    kept = file[f"snapshots/{int(history['step']):06d}"]
    p = kept["pressure"][:].ravel()
    t = np.zeros(2 * p.size)
    if case["law"] != "none":
        t = np.concatenate([kept["traction_x"][:].ravel(), kept["traction_y"][:].ravel()])
    place = np.array([history["road_x"], history["road_y"]])
    mean = t.reshape(2, -1).mean(axis=1) * case["thickness"] / case["modulus"]
    place = place - mean
    state = reference.state(p, t, place)
    found = dict(area=float(history["contact_area"]), gap=reference.gap_error(state) / tolerance,
                 bound=0.0 if case["law"] == "none" else reference.law_error(state) / tolerance)
    loss, heat, missing = reference.powers(state)
    scale = max(abs(loss), abs(heat), 1e-10 * history["force"] * reference.speed)
    found["power"] = max(abs(loss - history["power_viscous"]),
                         abs(heat - history["power_friction"])) / scale
    work = history["friction"] * history["force"] * reference.speed
    scale = max(abs(work), scale)
    found["balance"] = abs(work - loss - heat - missing) / scale
    exact = reference.solve(p, t, place)
    if exact is None:
        found.update(error=np.nan, friction=np.nan)
    else:
        load = reference.pressure * p.size
        found["error"] = float((np.abs(p - exact[0]).sum() + np.abs(t - exact[1]).sum()) / load)
        work = sum(reference.powers(reference.state(*exact, place)))
        force = reference.pressure * case["lx"] * case["ly"]
        found["friction"] = float(abs(work / (reference.speed * force) - history["friction"]))
    found["end"] = "right"
    if np.isnan(found["error"]):
        found["end"] = "open"
    measures = [name for name in LIMITS if found[name] > LIMITS[name]]
    if measures:
        # All conditions are met: Newton's method has found another solution.
        another = {*measures} <= {"error", "friction"} and max(found["gap"], found["bound"]) < 1e-2
        found["end"] = "open" if another and case["law"] != "none" else "wrong"
    return found


def try_case(job: tuple[int, tuple[str, ...], float, str]) -> list[dict[str, Any]]:
    """Run a case and return how its rows ended."""
    seed, laws, tolerance, program = job
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        text, case = make_case(seed, folder, laws, tolerance)
        (folder / "case.nml").write_text(text)
        about = dict(seed=seed, n=f"{case['nx']}x{case['ny']}", law=case["law"],
                     slope=case["slope"], mu=round(case["mu"], 2), nu=case["nu"],
                     arms=case["g"].size,
                     steep=round(float(np.ptp(case["height"]) / case["lx"]), 3))
        try:
            done = subprocess.run([program, "run", "case.nml", "--quiet"], cwd=folder,
                                  capture_output=True, text=True, check=False, timeout=120)
            status, message = done.returncode, done.stderr.strip()
        except subprocess.TimeoutExpired:
            status, message = -1, "longer than 120 s"
        rows = []
        if status not in (0, 4):
            return [about | dict(row=-1, end="failed", message=message)]
        with h5py.File(folder / "out.h5") as file:
            count = len(file["history"]["step"])
            ffts = file["history"]["ffts"][:]
            for number in range(count):
                row = about | dict(row=number, ffts=int(ffts[number]), message="")
                if status == 4 and number == count - 1:
                    rows.append(row | dict(end="reported", message=message[-120:]))
                else:
                    rows.append(row | judge(case, file, number, tolerance))
        if status == 0 and count != len(case["rows"]):
            rows.append(about | dict(row=count, end="failed", message="rows are missing"))
        return rows


def main() -> int:
    """Try cases and print what was found."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--program", default="asperity")
    parser.add_argument("--tolerance", type=float, default=1e-8)
    parser.add_argument("--laws", nargs="+", default=LAWS, choices=LAWS)
    parser.add_argument("--verbose", action="store_true", help="print every row")
    chosen = parser.parse_args()
    jobs = [(1000 * chosen.seed + k, tuple(chosen.laws), chosen.tolerance, chosen.program)
            for k in range(chosen.count)]
    ends: Counter = Counter()
    worst: dict[str, float] = {}
    with concurrent.futures.ProcessPoolExecutor(chosen.jobs) as pool:
        for rows in pool.map(try_case, jobs):
            for row in rows:
                ends[row["law"], "slope" if row["slope"] else "flat", row["end"]] += 1
                if row["end"] != "right" or chosen.verbose:
                    print("  ".join(f"{k} {v:.3g}" if isinstance(v, float) else f"{k} {v}"
                                    for k, v in row.items()), flush=True)
                for name in LIMITS:
                    if row["end"] == "right":
                        worst[name] = max(worst.get(name, 0.0), row[name])
    for key, number in sorted(ends.items()):
        print(*key, number)
    print("largest of the right rows:", {k: float(f"{v:.2g}") for k, v in worst.items()})
    return 1 if any(key[2] in ("wrong", "failed") for key in ends) else 0


if __name__ == "__main__":
    sys.exit(main())
