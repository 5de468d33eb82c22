"""A dense solution of a whole step with friction, which uses no part of the program.

The unknowns are the pressures and both components of the tractions of all cells, and the level.
Newton's method, with a Jacobian by differences, solves all conditions at once: the pressure is
nowhere negative, no surfaces overlap, the load is carried, the traction keeps within Coulomb's
bound on the local slope of the road, and slip has the direction of friction on that slope. The arms
use the scheme of the program's exponential method. The boundary is periodic.
"""

from __future__ import annotations

import numpy as np


class Spline:
    """The periodic cubic B-spline surface through a map of shape (ny, nx)."""

    def __init__(self, height: np.ndarray, dx: float, dy: float) -> None:
        """Find the coefficients of the spline by Fourier transforms."""
        self.dx, self.dy = dx, dy
        self.ny, self.nx = height.shape
        symbols = [(4 + 2 * np.cos(2 * np.pi * np.fft.fftfreq(n))) / 6
                   for n in (self.ny, self.nx)]
        self.c = np.fft.ifft2(np.fft.fft2(height) / np.outer(*symbols)).real

    def read(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the height and both slopes at places x, y, in m from the first cell."""
        u, v = x / self.dx, y / self.dy
        i, j = np.floor(u).astype(int), np.floor(v).astype(int)
        (wu, du), (wv, dv) = weights(u - i), weights(v - j)
        parts = np.zeros((3, *u.shape))
        for a in range(4):
            for b in range(4):
                c = self.c[(j + b - 1) % self.ny, (i + a - 1) % self.nx]
                parts += c * np.array([wu[a] * wv[b], du[a] * wv[b] / self.dx,
                                       wu[a] * dv[b] / self.dy])
        return parts[0], parts[1], parts[2]


def weights(t: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the four cubic B-splines and their derivatives at the fraction t of a cell."""
    return ([(1 - t)**3 / 6, (3 * t**3 - 6 * t**2 + 4) / 6,
             (-3 * t**3 + 3 * t**2 + 3 * t + 1) / 6, t**3 / 6],
            [-(1 - t)**2 / 2, (3 * t**2 - 4 * t) / 2, (-3 * t**2 + 2 * t + 1) / 2, t**2 / 2])


def compliances(nx: int, ny: int, dx: float, poisson: float, thickness: float) -> list[np.ndarray]:
    """Return the dense matrices A_zz, A_xx, A_yy, A_xy for a shear modulus of 1."""
    qx = 2 * np.pi * np.fft.fftfreq(nx, dx)[None, :]
    qy = 2 * np.pi * np.fft.fftfreq(ny, dx)[:, None]
    q = np.hypot(qx, qy)
    q[0, 0] = 1.0
    symbols = [(1 - poisson) / q, (1 - poisson * qx**2 / q**2) / q,
               (1 - poisson * qy**2 / q**2) / q, -poisson * qx * qy / q**3]
    symbols[0][0, 0] = symbols[3][0, 0] = 0.0
    symbols[1][0, 0] = symbols[2][0, 0] = thickness
    if nx % 2 == 0:
        symbols[3][:, nx // 2] = 0.0
    if ny % 2 == 0:
        symbols[3][ny // 2, :] = 0.0
    matrices = []
    for symbol in symbols:
        kernel = np.fft.ifft2(symbol).real
        matrices.append(np.array([np.roll(kernel, (j, i), (0, 1)).ravel()
                                  for j in range(ny) for i in range(nx)]).T)
    return matrices


class Block:
    """A rubber block on its road, with its state after the last row that was solved."""

    def __init__(self, height: np.ndarray, dx: float, *, poisson: float, thickness: float,
                 long_term: float, arms: list[tuple[float, float]], coefficient: float) -> None:
        """Start at rest and unloaded; arms are pairs of modulus and relaxation time."""
        ny, nx = height.shape
        self.spline = Spline(height, dx, dx)
        self.azz, self.axx, self.ayy, self.axy = compliances(nx, ny, dx, poisson, thickness)
        self.x, self.y = (a.ravel() * dx for a in np.meshgrid(np.arange(nx), np.arange(ny)))
        self.cells, self.mu, self.long_term, self.arms = nx * ny, coefficient, long_term, arms
        self.u = np.zeros((3, self.cells))              # x, y, z
        self.before = np.zeros((3, self.cells))         # the change of the last step
        self.m = np.zeros((len(arms), 3, self.cells))
        self.dt_old, self.road = 0.0, np.zeros(2)
        self.pressure = np.zeros(self.cells)
        self.traction = np.zeros((2, self.cells))
        self.level, self.rubs = 0.0, False

    def coefficients(self, dt: float) -> list[tuple[float, float, float]]:
        """Return alpha, b1 and b2 of each arm for the exponential scheme; dt = 0 is a jump."""
        found = []
        for g, tau in self.arms:
            x = dt / tau
            if dt == 0:
                found.append((1.0, g, 0.0))
            else:
                found.append((np.exp(-x), g * (1 - np.exp(-x)) / x, 0.0))
        return found

    def step(self, pressure: float, motion: tuple[float, float], dt: float,
             start: tuple[np.ndarray, np.ndarray, float] | None = None) -> float:
        """Solve a row, where dt = 0 is a jump, and return the largest relative residual."""
        table = self.coefficients(dt)
        q = self.long_term + sum(b1 for _, b1, _ in table)
        past = sum((b1 * self.u - alpha * m - b2 * self.before
                    for (alpha, b1, b2), m in zip(table, self.m, strict=True)),
                   np.zeros_like(self.u))
        road = self.road + motion
        self.rubs = self.rubs or np.any(motion)
        scale_u = np.ptp(self.spline.c)
        stiffness = pressure / scale_u

        def displacement(t: np.ndarray) -> np.ndarray:
            return np.array([self.axx @ t[0] + self.axy @ t[1] + past[0],
                             self.axy @ t[0] + self.ayy @ t[1] + past[1]]) / q

        def residual(z: np.ndarray) -> np.ndarray:
            p, t = z[:self.cells] * pressure, z[self.cells:3 * self.cells].reshape(2, -1) * pressure
            level = z[-1] * scale_u
            u = displacement(t) if self.rubs else self.u[:2]
            h, hx, hy = self.spline.read(self.x + u[0] - road[0], self.y + u[1] - road[1])
            gap = (self.azz @ p + past[2]) / q - h - level
            normal = p - np.maximum(0.0, p - stiffness * gap)
            if self.rubs:
                slip = self.u[:2] + np.array(motion)[:, None] - u
                tangential = t - self.friction(np.maximum(p, 0.0), hx, hy, t, slip * stiffness)
            else:
                tangential = t
            return np.concatenate([normal, tangential.ravel(), [p.mean() - pressure]]) / pressure

        z = np.concatenate([self.pressure, self.traction.ravel(), [0.0]]) / pressure
        z[-1] = self.level / scale_u
        if start is not None:
            z = np.concatenate([start[0].ravel(), start[1].ravel(), [0.0]]) / pressure
            z[-1] = start[2] / scale_u
        elif not self.pressure.any():
            z[:self.cells] = 1.0
        z, worst = newton(residual, z)
        p, t = z[:self.cells] * pressure, z[self.cells:3 * self.cells].reshape(2, -1) * pressure
        u = np.vstack([displacement(t) if self.rubs else self.u[:2],
                       ((self.azz @ p + past[2]) / q)[None]])
        for k, (alpha, b1, b2) in enumerate(table):
            self.m[k] = alpha * self.m[k] + b1 * (u - self.u) + b2 * self.before
        self.before, self.u, self.dt_old, self.road = u - self.u, u, dt, road
        self.pressure, self.traction, self.level = p, t, z[-1] * scale_u
        return worst

    def friction(self, p: np.ndarray, hx: np.ndarray, hy: np.ndarray, t: np.ndarray,
                 slip: np.ndarray) -> np.ndarray:
        """Return the traction that the friction law allows after the trial T + slip."""
        grad = np.array([hx, hy])
        slip = slip + grad * (grad * slip).sum(0)
        nz = 1 / np.sqrt(1 + hx**2 + hy**2)
        # D - n (n.D) is parallel to the slip, so the step is made in it and then transformed back.
        d = t + p * grad
        n = -grad * nz
        along = d - n * (n * d).sum(0) + project(n, slip, nz)
        d = along + n * (n * along).sum(0) / nz**2
        size = np.sqrt(np.maximum((d**2).sum(0) - (n * d).sum(0)**2, 1e-300))
        reach = size - self.mu * (n * d).sum(0)
        s = np.where(reach > 0, self.mu * p / nz / np.where(reach > 0, reach, 1.0), 1.0)
        return np.minimum(s, 1.0) * d - p * grad


def project(n: np.ndarray, slip: np.ndarray, nz: np.ndarray) -> np.ndarray:
    """Return the change of D - n (n.D) for a slip in the plane of the grid."""
    return slip - n * (n * slip).sum(0)


def newton(residual, z: np.ndarray, most: int = 400) -> tuple[np.ndarray, float]:
    """Solve by Newton's method; a line search makes each step lower the residual."""
    f = residual(z)
    for _ in range(most):
        if np.abs(f).max() < 1e-11:
            break
        jacobian = np.empty((z.size, z.size))
        for k in range(z.size):
            ahead = z.copy()
            ahead[k] += 1e-7
            jacobian[:, k] = (residual(ahead) - f) / 1e-7
        step = np.linalg.lstsq(jacobian, -f, rcond=1e-13)[0]
        length, best = 1.0, None
        for _ in range(12):
            trial = residual(z + length * step)
            if best is None or np.linalg.norm(trial) < best[0]:
                best = (np.linalg.norm(trial), length, trial)
            if np.linalg.norm(trial) < (1 - 0.3 * length) * np.linalg.norm(f):
                break
            length *= 0.5
        z, f = z + best[1] * step, best[2]
    return z, float(np.abs(f).max())
