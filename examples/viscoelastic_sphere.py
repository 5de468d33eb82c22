"""The sphere of the thesis that slides on a viscoelastic solid, for the studies of it.

The studies are sliding_sphere and loading_time.
"""

from __future__ import annotations

import asperity
from asperity import theory

GLASSY, CREEP, RATIO = 2.75e6, 0.01, 9.0       # G0, Pa; eta/G1, s; G0/G1
RADIUS, FORCE = 10e-3, 0.15                    # m, N
#: Contact radius a* with the glassy modulus: the unit of length, as in the thesis, m.
WIDTH = theory.hertz(RADIUS, 4 * GLASSY, force=FORCE).contact_radius


def base(cells: float, travel: float, across: float = 8.0) -> asperity.Case:
    """Return a case: a jump of the load, and sliding immediately afterwards with steps of one cell.

    Parameters
    ----------
    cells : float
        Cells in a*.
    travel : float
        Sliding distance, a*.
    across : float
        Width of the map, a*; the relaxed contact is 4.3 wide.
    """
    cell = WIDTH / cells
    nx, ny = (2 * round(length * cells / 2) for length in (travel + across, across))
    return asperity.Case(
        grid=dict(nx=nx, ny=ny, lx=nx * cell, ly=ny * cell, boundary="free"),
        surface=dict(shape="paraboloid", radius=RADIUS, centre_x=ny // 2 * cell),
        material=dict(zener_g0=GLASSY, zener_g1=GLASSY / RATIO, zener_eta=GLASSY / RATIO * CREEP),
        phase=[dict(name="rest", force=FORCE),
               dict(name="slide", duration=1.0, steps=round(travel * cells), velocity_x=0.0)],
        solver=dict(tolerance=1e-7))
