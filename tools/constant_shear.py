"""Compare steps with constant shear with dense matrices, and find those without a plain solution.

The random cases are those of coupled_campaign.py; those with the law `constant_shear` are run by
the program, and this tool solves the same steps independently, row by row. It shares nothing with
the solver: the kernels, the spline of the road, the arms, the mass and the law are written again,
and Newton's method with dense matrices solves for all cells at once. The column "difference" has
the largest difference from the program in any row: the mean over all cells of the differences of
pressures and tractions, relative to the mean pressure. Each row starts from the state of the
program. "rows" counts the rows compared, and "divided" those in which cells are partly sheared.

With arms, `exponential2` takes the first step after a jump in three parts, of which the result has
no snapshots. If one of these parts has several solutions, the program and the tool may continue
from different ones. With --scheme exponential there are no such parts, and the state at the start
of every row is known.

The tool then examines the first step with partly sheared cells, or the last one if the program did
not settle it. It solves the step from the final state of the program. If Newton's method fails
there, it starts from the row before, or solves a series of smoother laws, whose bound grows within
an ever smaller pressure. With --thorough all of these starts are tried, which takes several times
as long: the column "partial" then has a number for each solution that differs from those before,
and the counts of the trees are added.

The plain law allows a cell two states: in contact (no gap, a pressure P >= 0, the whole strength)
or open (a gap >= 0, no traction). The law that is solved here allows a third one between them: no
gap, no pressure, and a part of the strength between 0 and 1. Every solution of the plain law also
solves this one, in which no cell is partly sheared. Where cells are partly sheared, the tool looks
for a plain solution: it forces such a cell open or into contact, solves the rest again under the
law with three states, and continues with the next cell that is partly sheared, until none is left
(columns "states": ends of this tree, and "broken": those in which a forced cell overlaps with the
road or is pulled). If the tree has too many branches, a branch also ends where a forced cell
already breaks its condition ("cut").

The last column is the test for one solution only: with the other cells as they are, linearised,
the law with three states has exactly one solution if the determinants of all matrices that have,
for each partly sheared cell, the column of one of its three states are positive (all for 7 cells or
fewer, else 3000 random ones). Then the solution with partly sheared cells is the only one there,
and the plain law has none there.

A step may have several solutions, of which the tool and the program may find different ones. With
--tight the program runs the cases to a tolerance of 1e-10, in the scheme `exponential`, and the
tool does not look for solutions of its own: it prints how far each state of the program is from a
solution of the dense equations (the largest number of all rows).

usage: python tools/constant_shear.py [--count 500] [--seed 7741] [--only SEED] [--cells 640]
       [--thorough] [--scheme exponential] [--tight] [--program asperity]
"""

import argparse
import copy
import itertools
import math
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from coupled_campaign import make_case
from dense_case import Case
from dense_step import DenseStep

ACCURATE = 1e-8          # of a residual
TIGHT = 1e-10            # tolerance of the program with --tight
LEAVES, SECONDS = 140, 40.0


def fields(snapshot: h5py.Group) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return pressure, traction and gap of a snapshot, a value per cell; contact has no gap."""
    p, x, y, gap, contact = (snapshot[name][:].ravel() for name in (
        "pressure", "traction_x", "traction_y", "gap", "contact"))
    return p, np.array([x, y]), np.where(contact > 0, 0.0, np.maximum(gap, 1e-30))


def grid_cells(text: str) -> int:
    """Return the number of cells of a case."""
    return math.prod(int(n) for n in re.findall(r"\bn[xy] = (\d+)", text))


def run_case(seed: int, folder: Path, program: str, scheme: str = "exponential2",
             cells: int = 10**9, tolerance: float | None = None) -> tuple[str, int]:
    """Run a case of the campaign with a snapshot of each row; return its text and status.

    The status is -1, and nothing is run, if the law is another one or the grid has more cells.
    """
    text, about = make_case(seed, folder)
    if about["law"] != "constant_shear" or grid_cells(text) > cells:
        return text, -1
    text = text.replace("file = 'out.h5'", "file = 'out.h5', snapshot_every = 1")
    text = text.replace("threads = 1,", f"threads = 1, time_scheme = '{scheme}',")
    if tolerance is not None:
        text = re.sub(r"tolerance = [^,/\s]+", f"tolerance = {tolerance:g}", text)
    (folder / "case.nml").write_text(text)
    done = subprocess.run([program, "run", "case.nml", "--quiet"], cwd=folder,
                          capture_output=True, check=False)
    return text, done.returncode


def run_starts(text: str, folder: Path, program: str) -> None:
    """Run the first step in quarters: starts for its parts, if the rubber has arms."""
    phase = re.search(r"duration = (\S+), steps = (\d+)", text)
    text = text.replace(phase[0], f"duration = {float(phase[1]) / int(phase[2])!r}, steps = 4")
    text = re.sub(r"&phase [^/]*ramp[^/]*/\n", "", text).replace("out.h5", "start.h5")
    text = text.replace("'exponential2',", "'exponential', coupling_tolerance = 1e9,")
    (folder / "start.nml").write_text(text)
    subprocess.run([program, "run", "start.nml", "--quiet"], cwd=folder, capture_output=True,
                   check=False)


def distance(found: tuple, state: tuple) -> float:
    """Return the difference of pressure and traction between two states, as a part of the load."""
    return float(sum(np.abs(found[k] - state[k]).sum() for k in (0, 1)) / np.abs(state[0]).sum())


def read_run(folder: Path, text: str) -> tuple[Case, dict[str, np.ndarray], list[tuple]]:
    """Return the dense case of a run, some columns of its history, and the state after each row."""
    with h5py.File(folder / "road.h5") as file:
        case = Case(text, file["surface"][:])
    with h5py.File(folder / "out.h5") as file:
        history = {name: file["history"][name][:] for name in (
            "step", "time", "road_x", "road_y", "pressure")}
        states = [fields(file[f"snapshots/{step:06d}"]) for step in history["step"]]
    return case, history, states


def left_in_rows(folder: Path, text: str) -> list[float]:
    """Return how far the state of the program is from a dense solution, for each row.

    The distance is the smaller of two numbers: the residual of the equations, and the difference
    from the solution that Newton's method reaches from the state. The residual alone is too large
    if a cell between two states is assigned to the wrong one.
    Unlike `replay` this also judges rows with several solutions. It is meant for runs whose rows
    are not taken in parts (`time_scheme = 'exponential'`).
    """
    case, history, states = read_run(folder, text)
    road = np.array([history["road_x"], history["road_y"]])
    case.rest(states[0][0], history["pressure"][0])
    worst = []
    for k in range(1, len(states)):
        case.begin(history["time"][k] - history["time"][k - 1], road[:, k] - road[:, k - 1],
                   history["pressure"][k])
        step = DenseStep(case)
        begun = step.start(*states[k])
        off = max(float(np.abs(part).max()) for part in step.residual(begun))
        found, left = step.newton(begun)
        if left < ACCURATE:
            off = min(off, distance(step.fields(found), states[k]))
        worst.append(off)
        case.commit(*states[k][:2])
    return worst


def replay(folder: Path, text: str, settled: bool = False) -> dict[str, Any]:
    """Solve all steps of a run except the last, which is solved only if the program settled it.

    The step returned is the first one with partly sheared cells, or else the last one.
    """
    kept: dict[str, Any] = {}
    divided = 0
    case, history, states = read_run(folder, text)
    whole = case.first_step_length
    road = np.array([history["road_x"], history["road_y"]])
    case.rest(states[0][0], history["pressure"][0])
    now, worst = states[0], 0.0
    for k in range(1, len(states)):
        dt, way = history["time"][k] - history["time"][k - 1], road[:, k] - road[:, k - 1]
        parts = [(dt, way)]
        if case.starts(dt):
            done = dt / whole
            parts = [(whole * (b - a), way / done * (b - a))
                     for a, b in ((0.0, 0.25), (0.25, 0.5), (0.5, 1.0)) if b <= done + 1e-6]
        for i, (length, motion) in enumerate(parts):
            case.begin(length, motion, history["pressure"][k])
            step = DenseStep(case)
            guesses = [states[k], now]
            if k == 1 and case.starts(dt):
                with h5py.File(folder / "start.h5") as file:
                    guesses.insert(0, fields(file[f"snapshots/{(1, 2, 4)[i]:06d}"]))
            last = i == len(parts) - 1
            end = {"step": step, "guesses": guesses, "row": k, "part": i + 1}
            if last and k == len(states) - 1 and not settled:
                return {**(kept or end), "before": worst, "divided": divided, "rows": k - 1}
            found, left = step.solve(guesses)
            pressure, traction, gap = step.fields(found)
            error = distance((pressure, traction), states[k])
            if left > ACCURATE:
                raise ArithmeticError(f"row {k}, part {i + 1}: residual {left:.1e}")
            if last:                             # the past is that of the program
                worst = max(worst, error)
                pressure, traction, gap = states[k]
                if step.partial(found).size > 0:
                    divided += 1
                    kept = kept or {**end, "step": copy.deepcopy(step)}
                if k == len(states) - 1:
                    return {**(kept or end), "before": worst, "divided": divided, "rows": k}
            case.commit(pressure, traction)
            now = (pressure, traction, np.maximum(gap, 0.0))
    raise ValueError("a run of one row has no step")


def look_for_plain(step: DenseStep, found: tuple, cut: bool) -> dict[str, Any]:
    """Look for a solution without partly sheared cells by forcing them, one after the other."""
    start = time.monotonic()
    count = {"solved": 0, "states": 0, "broken": 0, "cut": 0, "failed": 0, "complete": True,
             "plain": False}
    stack = [({}, found)]
    while stack:
        if count["solved"] >= LEAVES or time.monotonic() - start > SECONDS:
            count["complete"] = False
            break
        forced, guess = stack.pop()
        step.force(forced)
        state, left = step.follow(guess)
        count["solved"] += 1
        broken, partial = step.broken(state), step.partial(state)
        step.force({})
        if left > ACCURATE:
            count["failed"] += 1
        elif partial.size == 0 or (cut and broken.size > 0):
            count["states"] += partial.size == 0
            count["broken"] += broken.size > 0 and partial.size == 0
            count["cut"] += partial.size > 0
            if broken.size == 0:
                count["plain"] = True
                return count
        else:
            share = step.shares(state)[partial]
            cell = int(partial[np.argmax(np.abs(share - 0.5))])
            likely = "contact" if step.shares(state)[cell] > 0.5 else "open"
            other = "open" if likely == "contact" else "contact"
            stack += [({**forced, cell: other}, state), ({**forced, cell: likely}, state)]
    return count


def unique(step: DenseStep, found: tuple) -> float:
    """Return the fraction of positive ones among the mixed determinants of partly sheared cells."""
    if step.partial(found).size == 0:
        return 1.0
    columns = step.reduced(found)
    cells = columns.shape[1]
    if cells <= 7:
        modes = np.array(list(itertools.product(range(3), repeat=cells)))
    else:
        modes = np.random.default_rng(0).integers(0, 3, (3000, cells))
    signs = [np.linalg.slogdet(columns[m, :, np.arange(cells)])[0] for m in modes]
    return float(np.mean(np.array(signs) > 0))


def examine(seed: int, program: str, thorough: bool = False, scheme: str = "exponential2",
            cells: int = 10**9) -> str:
    """Return the line of the table for a case, or nothing if the case is not to be examined."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        text, status = run_case(seed, folder, program, scheme, cells)
        if status == -1:
            return ""
        if "prony" in text and scheme == "exponential2":
            run_starts(text, folder, program)
        start = time.monotonic()
        try:
            end = replay(folder, text, settled=status == 0)
        except ArithmeticError as error:
            return f"| {seed} | {error} |"
    step = end["step"]
    solutions = step.solve_all(end["guesses"]) if thorough else [step.solve(end["guesses"])]
    solutions = [one for one in solutions if one[1] < ACCURATE]
    line = (f"| {seed} | {status} | {end['rows']} | {end['divided']} | {end['before']:.0e} "
            f"| {end['row']}.{end['part']} |")
    if status == 0 and end["divided"] == 0:
        return line
    if not solutions:
        return f"{line} not solved |"
    trees, complete, plain = [], True, False
    for found, _ in solutions:
        tree = look_for_plain(step, found, cut=False)
        if not (tree["complete"] or tree["plain"]):
            tree = look_for_plain(step, found, cut=True)
        complete, plain = complete and tree["complete"], plain or tree["plain"]
        trees.append(tree)
    found, left = solutions[0]
    partial, shares = step.partial(found), step.shares(found)
    counts = " | ".join(str(sum(tree[name] for tree in trees)) for name in (
        "states", "broken", "cut", "failed"))
    sizes = ", ".join(str(step.partial(one).size) for one, _ in solutions)
    span = f"{shares[partial].min():.3f} to {shares[partial].max():.3f}" if partial.size else ""
    signs = min(unique(step, one) for one, _ in solutions)
    verdict = "found" if plain else "none" if complete else "open"
    return (f"{line} {left:.0e} | {int((shares == 1).sum())} | {sizes} | {span} | {verdict} "
            f"| {counts} | {100 * signs:.0f} % | {time.monotonic() - start:.0f} s |")


def judge(seed: int, program: str, cells: int) -> str:
    """Return the line of the table of a case that is run to a tight tolerance, or nothing."""
    with tempfile.TemporaryDirectory() as name:
        text, status = run_case(seed, Path(name), program, "exponential", cells, tolerance=TIGHT)
        if status == -1:
            return ""
        off = left_in_rows(Path(name), text)
    if status != 0:                              # the last row did not settle
        off = off[:-1]
    return f"| {seed} | {status} | {len(off)} | {max(off, default=0.0):.0e} |"


def main() -> int:
    """Examine the cases of the campaign and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--seed", type=int, default=7741)
    parser.add_argument("--program", default="asperity")
    parser.add_argument("--only", type=int, help="examine the case of one seed")
    parser.add_argument("--cells", type=int, default=10**9, help="largest number of cells")
    parser.add_argument("--scheme", choices=("exponential2", "exponential"),
                        default="exponential2", help="time scheme of both")
    parser.add_argument("--thorough", action="store_true", help="start in all ways")
    parser.add_argument("--tight", action="store_true", help="judge the states of the program only")
    given = parser.parse_args()
    seeds = [given.only] if given.only is not None else [
        given.seed * 100000 + k for k in range(given.count)]
    if given.tight:
        print("| case | status | rows | distance |\n" + 4 * "| --- " + "|")
        for line in (judge(seed, given.program, given.cells) for seed in seeds):
            if line:
                print(line, flush=True)
        return 0
    print("| case | status | rows | divided | difference | row.part | residual | contact "
          "| partial | shares | plain solution "
          "| states | broken | cut | failed | unique | time |\n" + 17 * "| --- " + "|")
    for seed in seeds:
        line = examine(seed, given.program, given.thorough, given.scheme, given.cells)
        if line:
            print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
