"""A viscoelastic adhesive sphere that is pushed and pulled.

The case is input.nml, with and without its &adhesion.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import common
import numpy as np

import asperity

MINUTES = 0.3

HERE = Path(__file__).parent
COLUMNS = ("displacement", "force", "work_load", "energy_elastic", "energy_adhesive",
           "dissipated_viscous", "contact_area", "time")
NAMES = {"adhesive": "with adhesion", "bare": "without"}


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Return the histories with and without adhesion, and the lost energy."""
    case = asperity.Case.read(HERE / "input.nml")
    if quick:
        case.grid.update(nx=48, ny=48)
        case.phase[1].steps, case.phase[2].steps = 12, 30
    bare = case.copy()
    bare.adhesion = None
    # Theory of Lee and Radok: while the contact grows, the force is that of Hertz, 4/3 E* sqrt(R)
    # d^(3/2), with E* relaxed since each part of the push.
    solid, push, radius = case.material, case.phase[1], case.surface[0].radius
    after = (np.arange(2000) + 0.5) / 2000 * push.duration
    # time since the part was pushed
    depth = push.displacement * (1.0 - after / push.duration)
    modulus = 4.0 * (solid.shear_modulus
                     + solid.prony_g * np.exp(-after / solid.prony_tau))
    known = 2.0 * np.sqrt(radius) * push.displacement / 2000 * (modulus * np.sqrt(depth)).sum()
    loops = {}
    for name, one in (("adhesive", case), ("bare", bare)):
        history = common.run(one, folder / f"{name}.h5").history
        loops[name] = {column: np.array(history[column]) for column in COLUMNS}
    return {"loops": loops, "pushed": loops["bare"]["force"].max(), "pushed_known": known,
            "elastic_pull": 1.5 * np.pi * case.adhesion.energy * case.surface[0].radius,
            "largest_pull": -loops["adhesive"]["force"].min(),
            "lost_adhesive": loops["adhesive"]["dissipated_viscous"][-1],
            "lost_bare": loops["bare"]["dissipated_viscous"][-1]}


def check(data: dict[str, Any], quick: bool) -> None:
    """Check the loops against the energy balance and the effects of adhesion."""
    for name, loop in data["loops"].items():
        # The work of the load is stored or lost. It is a sum over the steps, with an error of
        # second order.
        left = loop["energy_elastic"][-1] + loop["energy_adhesive"][-1]
        lost = loop["dissipated_viscous"][-1]
        error = abs(loop["work_load"][-1] - left - lost) / lost
        assert error < (0.05 if quick else 0.02), \
            f"{name}: {error:.1%} of the work is neither stored nor lost"
        assert loop["contact_area"][-1] == 0, f"{name}: the sphere has not come off"
    assert data["loops"]["bare"]["force"].min() > -1e-9, "a sphere without adhesion pulls"
    # The radius of the contact has 28 cells (10 in the quick form), and a step is a twentieth (a
    # sixth) of the relaxation time.
    ratio = data["pushed"] / data["pushed_known"]
    assert abs(ratio - 1.0) < (0.02 if quick else 0.005), f"push: {ratio} of Lee and Radok"
    # Adhesion is conservative, but more energy is lost with it, because the edge is peeled faster
    # than the solid relaxes.
    assert data["lost_adhesive"] > 1.3 * data["lost_bare"] > 0
    # The pull-off force is larger than that of the relaxed solid, by less than the ratio of the
    # moduli, 10.
    assert 2 < data["largest_pull"] / data["elastic_pull"] < 10


def picture(data: dict[str, Any]) -> Any:
    """Draw force over displacement, and what is lost over time."""
    figure, (left, right) = common.subplots(2, width=5.0, height=4.0)
    for (name, loop), style in zip(data["loops"].items(), ("-", "--"), strict=True):
        left.plot(loop["displacement"] * 1e6, loop["force"] * 1e6, style, label=NAMES[name])
        right.plot(loop["time"], loop["dissipated_viscous"] * 1e12, style, label=NAMES[name])
    left.axhline(0, color="grey", linewidth=0.5)
    left.set(xlabel="displacement, µm", ylabel="force, µN")
    right.set(xlabel="time, s", ylabel="energy lost in the solid, pJ")
    left.legend()
    right.legend()
    return figure
