"""A case of coupled_campaign.py, written again from the equations: road, rubber, mass and past.

Nothing here comes from the program. dense_step.py solves the steps.
"""

import re

import numpy as np

ALPHA = -1 / 3                                  # of the rule for the mass
BETA, GAMMA = (1 - ALPHA) ** 2 / 4, 0.5 - ALPHA


def weights(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the four cubic B-splines and their first and second derivatives."""
    return (np.array([(1 - t)**3 / 6, (3 * t**3 - 6 * t**2 + 4) / 6,
                      (-3 * t**3 + 3 * t**2 + 3 * t + 1) / 6, t**3 / 6]),
            np.array([-(1 - t)**2, 3 * t**2 - 4 * t, -3 * t**2 + 2 * t + 1, t**2]) / 2,
            np.array([1 - t, 3 * t - 2, 1 - 3 * t, t]))


class Road:
    """The cubic B-spline surface through a map of shape (ny, nx) with square cells."""

    def __init__(self, height: np.ndarray, dx: float, free: bool) -> None:
        """Find the coefficients."""
        self.dx, self.free, self.lowest = dx, free, height.min()
        self.ny, self.nx = height.shape
        if free:
            self.c = bounded(bounded(height).T).T
        else:
            symbols = [(4 + 2 * np.cos(2 * np.pi * np.fft.fftfreq(n))) / 6 for n in height.shape]
            self.c = np.fft.ifft2(np.fft.fft2(height) / np.outer(*symbols)).real

    def read(self, place: np.ndarray) -> np.ndarray:
        """Return H, H_x, H_y, H_xx, H_xy and H_yy at places of shape (2, n), m."""
        u, v = place / self.dx
        i, j = np.floor(u).astype(int), np.floor(v).astype(int)
        inside = np.ones(u.shape)
        if self.free:                            # beyond the rim the road falls within one cell
            for w, n in ((u, self.nx), (v, self.ny)):
                inside = inside * np.clip(1 - np.maximum(-w, w - (n - 1)), 0, 1)
            u, v = np.clip(u, 0, self.nx - 1), np.clip(v, 0, self.ny - 1)
            i, j = np.clip(i, 0, self.nx - 2), np.clip(j, 0, self.ny - 2)
        a, b = weights(u - i), weights(v - j)
        found = np.zeros((6, *u.shape))
        for k, m in np.ndindex(4, 4):
            c = (self.c[j + m, i + k] if self.free
                 else self.c[(j + m - 1) % self.ny, (i + k - 1) % self.nx])
            found += c * np.array([
                a[0][k] * b[0][m], a[1][k] * b[0][m] / self.dx, a[0][k] * b[1][m] / self.dx,
                a[2][k] * b[0][m] / self.dx**2, a[1][k] * b[1][m] / self.dx**2,
                a[0][k] * b[2][m] / self.dx**2])
        found *= inside
        found[0] += (1 - inside) * self.lowest
        return found


def bounded(f: np.ndarray) -> np.ndarray:
    """Return the coefficients -1 to n of the spline through n rows that end freely."""
    n = f.shape[0]
    matrix, right = np.zeros((n + 2, n + 2)), np.zeros((n + 2, f.shape[1]))
    for k in range(n):
        matrix[k + 1, k:k + 3] = np.array([1, 4, 1]) / 6
    right[1:-1] = f
    matrix[0, :3] = matrix[-1, -3:] = [1, -2, 1]
    right[0] = 2 * f[0] - 5 * f[1] + 4 * f[2] - f[3]
    right[-1] = 2 * f[-1] - 5 * f[-2] + 4 * f[-3] - f[-4]
    return np.linalg.solve(matrix, right)


class Kernel:
    """Displacements under a traction on one cell, unit shear modulus: zz, xx, yy, xy."""

    def __init__(self, nx: int, ny: int, dx: float, poisson: float, thickness: float,
                 free: bool) -> None:
        """Fill the tables of coefficients; those of a free patch are on a doubled grid."""
        self.nx, self.ny, self.free = nx, ny, free
        cells = np.arange(nx * ny)
        self.i, self.j = cells % nx, cells // nx
        if not free:
            qx = 2 * np.pi * np.fft.fftfreq(nx, dx)[None, :]
            qy = 2 * np.pi * np.fft.fftfreq(ny, dx)[:, None]
            q = np.hypot(qx, qy)
            q[0, 0] = 1.0
            self.symbol = np.array([(1 - poisson) / q, (1 - poisson * qx**2 / q**2) / q,
                                    (1 - poisson * qy**2 / q**2) / q, -poisson * qx * qy / q**3])
            if nx % 2 == 0:
                self.symbol[3, :, nx // 2] = 0.0
            if ny % 2 == 0:
                self.symbol[3, ny // 2, :] = 0.0
            self.symbol[0, 0, 0] = self.symbol[3, 0, 0] = 0.0
            self.set_mean(thickness)
            return
        x, y = np.meshgrid(*(np.fft.fftfreq(2 * n) * 2 * n * dx for n in (nx, ny)))
        along_y, along_x, both = np.zeros((3, *x.shape))
        for k, m in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
            a, b = x + k * dx / 2, y + m * dx / 2
            along_y += k * m * a * np.arcsinh(b / np.abs(a))
            along_x += k * m * b * np.arcsinh(a / np.abs(b))
            both -= k * m * np.hypot(a, b)
        rest = 1 - poisson
        self.table = np.array([rest * (along_x + along_y), rest * along_y + along_x,
                               along_y + rest * along_x, poisson * both]) / (2 * np.pi)
        self.symbol = np.fft.fft2(self.table)

    def set_mean(self, compliance: float) -> None:
        """Set the compliance of the mean shear, periodic only."""
        if self.free:
            return
        self.symbol[1, 0, 0] = self.symbol[2, 0, 0] = compliance
        self.table = np.fft.ifft2(self.symbol).real

    def times(self, c: int, f: np.ndarray) -> np.ndarray:
        """Return the product of a coefficient's matrix with a field."""
        shape = self.table.shape[1:]
        modes = self.symbol[c] * np.fft.fft2(f.reshape(self.ny, self.nx), shape)
        return np.fft.ifft2(modes).real[:self.ny, :self.nx].ravel()

    def shear(self, t: np.ndarray) -> np.ndarray:
        """Return the tangential displacements under tractions."""
        return np.array([self.times(1, t[0]) + self.times(3, t[1]),
                         self.times(3, t[0]) + self.times(2, t[1])])

    def matrix(self, c: int, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Return a part of the matrix of a coefficient."""
        ny, nx = self.table.shape[1:]
        return self.table[c][(self.j[rows][:, None] - self.j[columns]) % ny,
                             (self.i[rows][:, None] - self.i[columns]) % nx]


class Memory:
    """The arms of the rubber under a field of tractions: exponential schemes and jumps."""

    def __init__(self, modulus: float, g: list[float], tau: list[float], shape: tuple,
                 order: int) -> None:
        """Start without load; order 1 or 2: `exponential` or `exponential2`."""
        self.order = order
        self.modulus, self.g, self.tau = modulus, np.array(g), np.array(tau)
        self.s, self.old, self.p = np.zeros(shape), np.zeros(shape), np.zeros((len(g), *shape))
        self.dt = self.dt_old = 0.0

    def begin(self, dt: float) -> None:
        """Set the coefficients of a step; dt = 0 is a jump."""
        self.dt = dt
        if dt == 0.0:
            self.keep, self.b1, self.b2 = np.ones_like(self.g), self.g, 0 * self.g
        else:
            ratio = dt / self.dt_old if self.dt_old > 0 and self.order == 2 else 0.0
            w = 2 * ratio / (1 + ratio) * min(1.0, (2 / max(ratio, 1e-9))**2)
            x = dt / self.tau
            at, part = np.polynomial.legendre.leggauss(24)
            curve = 0.25 * np.exp(-x[:, None] * (1 - at) / 2) * at @ part * w
            self.keep = np.exp(-x)
            self.b1, self.b2 = self.g * (-np.expm1(-x) / x + curve), -self.g * curve * ratio
        self.q = self.modulus + self.b1.sum()
        self.past = sum((b1 * self.s - keep * p - b2 * (self.s - self.old) for keep, b1, b2, p in
                         zip(self.keep, self.b1, self.b2, self.p, strict=True)),
                        np.zeros_like(self.s))

    def end(self, s: np.ndarray) -> None:
        """End the step; s is the traction that would hold the displacement elastically."""
        for k in range(len(self.g)):
            self.p[k] = (self.keep[k] * self.p[k] + self.b1[k] * (s - self.s)
                         + self.b2[k] * (self.s - self.old))
        self.old, self.s, self.dt_old = self.s, s, self.dt


class Case:
    """A case of the campaign, with its state after the steps so far."""

    def __init__(self, text: str, height: np.ndarray) -> None:
        """Read the namelist."""
        def number(name: str, default: float = 0.0) -> float:
            found = re.search(rf"\b{name} = ([-+\d.eE]+)", text)
            return float(found[1]) if found else default

        self.ny, self.nx = height.shape
        self.cells, dx = height.size, number("lx") / self.nx
        free = "boundary = 'free'" in text
        self.road = Road(height, dx, free)
        self.thickness = number("thickness")
        self.kernel = Kernel(self.nx, self.ny, dx, number("poisson"), self.thickness, free)
        self.driven = Kernel(self.nx, self.ny, dx, number("poisson"), self.thickness, free)
        self.mass = number("density") * self.thickness / 2
        arms = re.search(r"prony_g = (\d)\*([\d.e+-]+), prony_tau = ([^/]*)/", text)
        g = [float(arms[2])] * int(arms[1]) if arms else []
        tau = [float(one) for one in arms[3].split(",")] if arms else []
        self.order = 1 if "time_scheme = 'exponential'," in text else 2
        self.normal = Memory(number("shear_modulus"), g, tau, (self.cells,), self.order)
        self.tangential = Memory(number("shear_modulus"), g, tau, (2, self.cells), self.order)
        self.strength = number("shear_strength")
        self.slope = "slope_effect = .false." not in text
        self.range = number("range", 1.0)
        self.attraction = number("energy") / self.range
        phase = re.search(r"duration = (\S+), steps = (\d+)", text)
        self.first_step_length = float(phase[1]) / int(phase[2])
        self.place = np.array([a.ravel() * dx for a in np.meshgrid(np.arange(self.nx),
                                                                   np.arange(self.ny))])
        self.u, self.way = np.zeros((2, self.cells)), np.zeros(2)
        self.speed, self.acceleration, self.fresh = np.zeros(2), np.zeros(2), True

    def rest(self, pressure: np.ndarray, load: float) -> None:
        """Begin with the pressure of the first row, before the road moves."""
        self.begin(0.0, np.zeros(2), load)
        self.normal.end((pressure + self.normal.past) / self.q)

    def starts(self, dt: float) -> bool:
        """Return whether a step is taken in three parts."""
        return (self.order == 2 and len(self.normal.g) > 0 and self.normal.dt_old == 0.0
                and dt > 0.0)

    def begin(self, dt: float, motion: np.ndarray, load: float) -> None:
        """Begin a step: compute the displacements that the past and the mass add."""
        self.normal.begin(dt)
        self.tangential.begin(dt)
        self.dt, self.motion, self.load, self.q = dt, np.array(motion), load, self.normal.q
        self.end_way = self.way + self.motion
        mean, shift = self.u.mean(axis=1), np.zeros(2)
        self.driven.set_mean(self.thickness)
        if self.mass > 0 and dt > 0:
            lead = 2.0 if self.fresh else (1 - ALPHA) / BETA
            stiffer = self.q / self.thickness + self.mass * lead / dt**2
            known = self.mass * lead * ((mean + self.motion) / dt**2 + self.speed / dt)
            if not self.fresh:
                known += self.mass * (lead * (0.5 - BETA) - ALPHA) * self.acceleration
            self.driven.set_mean(self.q / stiffer)
            shift = self.q / stiffer * known
        elif self.mass > 0:
            self.driven.set_mean(0.0)
            shift = self.q * mean
        self.u_z = self.kernel.times(0, self.normal.past) / self.q
        self.u_t = (self.driven.shear(self.tangential.past) + shift[:, None]) / self.q

    def commit(self, pressure: np.ndarray, traction: np.ndarray) -> None:
        """End a step."""
        u = self.driven.shear(traction) / self.q + self.u_t
        s = (traction + self.tangential.past) / self.q
        if self.mass > 0:
            s += (u.mean(axis=1) / self.thickness - s.mean(axis=1))[:, None]
            if self.dt > 0:
                advance = ((u - self.u).mean(axis=1) - self.motion) / self.dt - self.speed
                before = 2 * advance / self.dt if self.fresh else self.acceleration
                after = (advance / self.dt - (0.5 - BETA) * before) / BETA
                self.speed = self.speed + self.dt * ((1 - GAMMA) * before + GAMMA * after)
                self.acceleration = after
        self.fresh = self.dt == 0
        self.normal.end((pressure + self.normal.past) / self.q)
        self.tangential.end(s)
        self.u, self.way = u, self.end_way
