"""One coupled step of a case of coupled_campaign.py, solved with dense matrices.

Nothing here comes from the program. Newton's method solves for the pressures, gaps, tractions and
the level of all cells at once. With constant shear a cell may be partly sheared: it then has no gap
and no pressure, and a share of the strength. A number s per cell, in m, determines its state:

    s < 0            open: the gap is -s, no pressure but that of adhesion, no traction
    0 <= s <= width  partly sheared: no gap, the share s/width of the strength
    s > width        in contact: no gap, a pressure in proportion to s - width, the whole strength

With `rise` > 0 the pressure also grows a little in the second range, as with `coulomb_orowan`. Such
steps have no jump and are easier to solve; `solve` lets `rise` go to 0.
"""

import numpy as np
from dense_case import Case

ACCURATE = 1e-9
Found = tuple[np.ndarray, np.ndarray, float]    # s, T, level


class DenseStep:
    """The step that a case has begun."""

    def __init__(self, case: Case) -> None:
        """Choose the scales."""
        self.case = case
        self.soft = case.kernel.table[0, 0, 0] / case.q
        self.stiff = case.q / case.driven.table[1, 0, 0]
        slopes = case.road.read(case.place)[1:3]
        self.width = case.strength / self.stiff * max(np.sqrt((slopes**2).sum(axis=0).mean()), 0.05)
        self.rise = 0.0
        self.forced = np.zeros(case.cells, int)

    def force(self, states: dict[int, str]) -> None:
        """Hold cells open or in contact, even if they then violate a condition."""
        self.forced[:] = 0
        for cell, state in states.items():
            self.forced[cell] = -1 if state == "open" else 1

    def modes(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return which cells are open, and which are in contact."""
        is_open = ((s < 0) | (self.forced == -1)) & (self.forced != 1)
        return is_open, ((s > self.width) | (self.forced == 1)) & ~is_open

    def partial(self, found: Found) -> np.ndarray:
        """Return the cells that are partly sheared."""
        is_open, touches = self.modes(found[0])
        return np.flatnonzero(~is_open & ~touches)

    def shares(self, found: Found) -> np.ndarray:
        """Return the share of the strength of each cell."""
        return self.states(found[0])[2]

    def broken(self, found: Found) -> np.ndarray:
        """Return the forced cells that overlap with the road or are pulled."""
        s, little = found[0], 1e-9 * self.width
        return np.flatnonzero(((self.forced == -1) & (s > little))
                              | ((self.forced == 1) & (s < self.width - little)))

    def states(self, s: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return P, dP/ds, the share of the strength and its derivative, and s of open cells."""
        case = self.case
        is_open, touches = self.modes(s)
        partly = ~is_open & ~touches
        p, dp, share, dshare = np.zeros((4, case.cells))
        if case.attraction > 0:
            p[is_open] = -case.attraction * np.exp(np.minimum(s[is_open], 0) / case.range)
            dp[is_open] = p[is_open] / case.range
        part = np.where(touches, self.width, np.clip(s, 0, self.width))
        p[~is_open] = self.rise * part[~is_open] / self.soft - case.attraction
        p[touches] += (s[touches] - self.width) / self.soft
        dp[partly], dp[touches] = self.rise / self.soft, 1 / self.soft
        share[touches], share[partly] = 1.0, s[partly] / self.width
        dshare[partly] = 1 / self.width
        return p, dp, share, dshare, np.where(is_open, s, 0.0)

    def law(self, t: np.ndarray, slip: np.ndarray, p: np.ndarray, hx: np.ndarray, hy: np.ndarray,
            share: np.ndarray) -> np.ndarray:
        """Return the admissible traction that follows from a traction and its slip."""
        slope = np.array([hx, hy]) * (1.0 if self.case.slope else 0.0)
        normal = -share * p * slope
        d = t - normal + self.stiff * (slip + slope * (slope * slip).sum(axis=0))
        ratio = share * self.case.strength / self.size(d, slope)
        return np.where(ratio.real < 1, ratio, 1.0) * d + normal

    @staticmethod
    def size(t: np.ndarray, slope: np.ndarray) -> np.ndarray:
        """Return the size of horizontal tractions as the law measures it, along the slope."""
        return np.sqrt((t**2).sum(axis=0) - (slope * t).sum(axis=0)**2
                       / (1 + (slope**2).sum(axis=0)) + 1e-300)

    def surface(self, found: Found, p: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the road under the surface, the gap and the slip."""
        case, (_, t, level) = self.case, found
        u = case.driven.shear(t) / case.q + case.u_t
        road = case.road.read(case.place + u - case.end_way[:, None])
        gap = case.kernel.times(0, p) / case.q + case.u_z - road[0] - level
        return road, gap, case.u + case.motion[:, None] - u

    def fields(self, found: Found) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return pressure, traction and gap."""
        p = self.states(found[0])[0]
        return p, found[1], self.surface(found, p)[1]

    def residual(self, found: Found) -> tuple[np.ndarray, np.ndarray, float]:
        """Return the relative residuals of the conditions: gap, traction and load."""
        case = self.case
        p, _, share, _, opened = self.states(found[0])
        road, gap, slip = self.surface(found, p)
        closed = ~self.modes(found[0])[0]
        left = np.where(closed, found[1] - self.law(found[1], slip, p, road[1], road[2], share), 0)
        return ((gap + opened) / (self.soft * case.load), left / max(case.strength, case.load),
                p.mean() / case.load - 1)

    def jacobian(self, found: Found, touching: np.ndarray | None = None) -> tuple:
        """Return the unknown cells of s and T, and the matrix; cells `touching` are in contact."""
        case, (s, t, _) = self.case, found
        p, dp, share, dshare, _ = self.states(s)
        road, _, slip = self.surface(found, p)
        if touching is not None:
            dp[touching], dshare[touching] = 1 / self.soft, 0.0
        is_open = self.modes(s)[0]
        b = np.flatnonzero(~is_open)
        a = np.arange(case.cells) if case.attraction > 0 else b
        n, m, where = a.size, b.size, np.searchsorted(a, b)
        xx, yy, xy = (case.driven.matrix(c, a, b) / case.q for c in (1, 2, 3))
        ux, uy = np.hstack([xx, xy]), np.hstack([xy, yy])
        matrix = np.zeros((n + 2 * m + 1, n + 2 * m + 1))
        matrix[:n, :n] = case.kernel.matrix(0, a, a) / case.q * dp[a]
        matrix[:n, n:-1] = -road[1][a][:, None] * ux - road[2][a][:, None] * uy
        matrix[:n, -1] = -1
        matrix[np.arange(n), np.arange(n)] += is_open[a]
        matrix[:n] /= self.soft * case.load
        arguments = [one.astype(complex) for one in (
            t[0, b], t[1, b], slip[0, b], slip[1, b], p[b], road[1][b], road[2][b], share[b])]
        scales = [case.load] * 2 + [self.soft * case.load] * 2 + [case.load, 1.0, 1.0, 1.0]
        change = []                                  # of the law, by complex steps
        for k, scale in enumerate(scales):
            moved = [one + 1e-30j * scale * (j == k) for j, one in enumerate(arguments)]
            change.append(self.law(np.array(moved[:2]), np.array(moved[2:4]), *moved[4:]).imag
                          / (1e-30 * scale))
        rows = np.arange(m)
        for c in range(2):
            part = slice(n + c * m, n + (c + 1) * m)
            by_x, by_y = (change[5][c] * road[3 + k][b] + change[6][c] * road[4 + k][b]
                          - change[2 + k][c] for k in (0, 1))
            matrix[part, n:-1] -= by_x[:, None] * ux[where] + by_y[:, None] * uy[where]
            matrix[n + c * m + rows, where] -= change[4][c] * dp[b] + change[7][c] * dshare[b]
            for e in range(2):
                matrix[n + c * m + rows, n + e * m + rows] += (c == e) - change[e][c]
            matrix[part] /= max(case.strength, case.load)
        matrix[-1, :n] = dp[a] / case.cells / case.load
        return a, b, matrix

    def newton(self, found: Found, most: int = 20) -> tuple[Found, float]:
        """Solve from a start; the steps are shortened as long as that lowers the residual."""
        case = self.case
        random = np.random.default_rng(0)

        def measure(state: Found) -> tuple[float, tuple, float]:
            gap, law, load = left = self.residual(state)
            return (float(np.sqrt((gap**2).sum() + (law**2).sum() + case.cells * load**2)), left,
                    max(np.abs(gap).max(), np.abs(law).max(), abs(load)))

        now = kept = measure(found)
        least = found
        for k in range(most):
            if now[2] < 1e-10 or not np.isfinite(now[0]):
                break
            a, b, matrix = self.jacobian(found)
            gap, law, load = now[1]
            right = -np.concatenate([gap[a], law[0, b], law[1, b], [load]])
            try:
                step = np.linalg.solve(matrix, right)
            except np.linalg.LinAlgError:
                step = np.linalg.solve(matrix + 1e-10 * np.eye(len(matrix)), right)
            ds, dt = np.zeros(case.cells), np.zeros((2, case.cells))
            ds[a], dt[:, b] = step[:a.size], step[a.size:-1].reshape(2, -1)
            if case.attraction == 0:                 # open cells follow
                p, dp, *_ = self.states(found[0])
                road, gap, _ = self.surface(found, p)
                du = case.driven.shear(dt) / case.q
                moved = (gap + case.kernel.times(0, dp * ds) / case.q - road[1] * du[0]
                         - road[2] * du[1] - step[-1])
                is_open = self.modes(found[0])[0]
                ds[is_open] = (-moved - found[0])[is_open]
            tried = []
            for length in (1, 0.7, 0.5, 0.3, 0.15, 0.07, 0.03, 0.01, 0.003, 0.001):
                state = self.tidy((found[0] + length * ds, found[1] + length * dt,
                                   found[2] + length * step[-1]))
                tried.append((measure(state), state))
                if tried[-1][0][0] < (1 - 0.2 * length) * now[0]:
                    break
            best = min(tried, key=lambda one: one[0][0])
            if best[0][0] >= (1 - 1e-4) * now[0] and k > 1:
                best = tried[int(random.integers(min(4, len(tried))))]
            now, found = best
            if now[2] < kept[2]:
                kept, least = now, found
        return least, kept[2]

    def tidy(self, found: Found) -> Found:
        """Set the traction of open cells to zero."""
        return found[0], np.where(self.modes(found[0])[0], 0.0, found[1]), found[2]

    def start(self, pressure: np.ndarray, traction: np.ndarray, gap: np.ndarray) -> Found:
        """Return the unknowns that correspond to a state that was found elsewhere."""
        case = self.case
        touches = gap <= 0.0
        road, level, _ = self.surface((gap, traction, 0.0), pressure)
        wall = np.maximum(pressure + case.attraction, 0)
        slope = road[1:3] * (1.0 if case.slope else 0.0)
        share = self.size(traction + pressure * slope, slope) / case.strength
        partly = touches & (wall < 1e-6 * case.load) & (share < 1 - 1e-6)
        s = np.where(touches, self.width + wall * self.soft, -gap)
        s = np.where(partly, np.clip(share, 0, 1) * self.width, s)
        return self.tidy((s, traction, float(level[touches].mean()) if touches.any() else 0.0))

    def solve(self, guesses: list[tuple]) -> tuple[Found, float]:
        """Solve the step with partly sheared cells, from the best start that works."""
        best = None
        for guess in guesses:
            found, left = self.newton(self.start(*guess))
            if best is None or left < best[1]:
                best = found, left
            if left < ACCURATE:
                return best
        for guess in guesses:
            found, left = self.descend(self.start(*guess))
            if left < best[1]:
                best = found, left
            if left < ACCURATE:
                break
        return best

    def solve_all(self, guesses: list[tuple]) -> list[tuple[Found, float]]:
        """Solve the step from each start in both ways, and return the solutions that differ."""
        found: list[tuple[Found, float]] = []
        for guess in guesses:
            for way in (self.newton, self.descend):
                state, left = way(self.start(*guess))
                if left < ACCURATE and not any(
                        np.abs(state[0] - one[0]).max() < 1e-6 * np.ptp(one[0])
                        for one, _ in found):
                    found.append((state, left))
        return found

    def descend(self, found: Found) -> tuple[Found, float]:
        """Solve with a pressure in partly sheared cells that is reduced to zero."""
        rise, factor, last = 1.0, 0.1, 0.0
        for _ in range(25):
            self.rise = rise
            state, left = self.newton(self.tidy(found))
            if left < ACCURATE:
                found, last = state, rise
                if rise == 0.0:
                    return found, left
                rise = rise * factor if rise > 1e-5 else 0.0
            elif last == 0.0:
                rise *= 10
            else:
                factor **= 0.5
                rise = last * factor
            if rise > 1e4 or factor > 0.95:
                break
        self.rise = 0.0
        return self.newton(self.tidy(found))

    def follow(self, found: Found) -> tuple[Found, float]:
        """Solve again, when cells have been forced."""
        state, left = self.newton(self.tidy(found))
        if left > ACCURATE:
            state, left = self.descend(found)
        return state, left

    def reduced(self, found: Found) -> np.ndarray:
        """Return the derivatives of the gaps of partly sheared cells by their s, for each state."""
        cells = self.partial(found)
        a, _, partly = self.jacobian(found)
        touching = self.jacobian(found, cells)[2]
        inside = np.searchsorted(a, cells)
        rest = np.setdiff1d(np.arange(len(partly)), inside)
        columns = [np.eye(cells.size)]
        for matrix in (partly, touching):
            block = matrix[np.ix_(inside, inside)] - matrix[np.ix_(inside, rest)] @ np.linalg.solve(
                matrix[np.ix_(rest, rest)], matrix[np.ix_(rest, inside)])
            columns.append(block / np.abs(np.diag(block)).max())
        return np.array(columns)
