"""The verb ``friction`` of ``python -m asperity``: friction curves of steady sliding."""

from __future__ import annotations

import argparse
import contextlib
import math
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.files import check_folder
from .data import add_table, table_options

if TYPE_CHECKING:
    from ..results.friction_curve import FrictionCurve

__all__ = ["add_friction"]

_KINDS = (".html", ".csv", ".nc", ".png", ".pdf", ".svg")


def numbers(text: str) -> list[float]:
    """Return the numbers of a list, or of ``FIRST:LAST:COUNT``, evenly spaced on a log scale.

    Examples
    --------
    >>> numbers("1e5,3e5"), numbers("0.01:1:3")
    ([100000.0, 300000.0], [0.01, 0.1, 1.0])
    """
    return _list_or_range(text, log=True)


def temperatures(text: str) -> list[float]:
    """Return the numbers of a list, or of ``FIRST:LAST:COUNT`` in even steps, of any sign.

    Examples
    --------
    >>> temperatures("40,-5"), temperatures("-20:80:5")
    ([40.0, -5.0], [-20.0, 5.0, 30.0, 55.0, 80.0])
    """
    return _list_or_range(text, log=False)


def _list_or_range(text: str, log: bool) -> list[float]:
    """Return the numbers of a list or a range, which has even steps on a log or a linear scale."""
    parts = text.split(":")
    try:
        if len(parts) == 1:
            return [float(part) for part in text.split(",")]
        first, last, count = float(parts[0]), float(parts[1]), int(parts[2])
        if (len(parts) != 3 or not (0.0 if log else -math.inf) < first < last < math.inf
                or count < 2):
            raise ValueError
    except (ValueError, IndexError):
        raise argparse.ArgumentTypeError(
            f"{text!r}: must be numbers with commas, or FIRST:LAST:COUNT with"
            f" {'0 < ' if log else ''}FIRST < LAST and COUNT of at least 2") from None
    if log:
        return [float(f"{value:.12g}") for value in np.geomspace(first, last, count)]
    # A temperature that is 0 up to round-off is 0, and never -0.
    return [round(float(value), 9) + 0.0 for value in np.linspace(first, last, count)]


def add_friction(verbs: Any) -> None:
    """Add the verb `friction`."""
    parser = verbs.add_parser(
        "friction", help="compute friction curves of a rubber on a road",
        description="Computes the friction of steady sliding against speed, pressure and"
                    " temperature, on patches of measured roads or on random ones, and compares it"
                    " with Persson's theory. The runs are in a folder next to the output. After an"
                    " interruption the same command resumes where it stopped.")
    parser.add_argument("roads", metavar="ROAD", nargs="+",
                        help="a height map in any format that `import` reads, as FILE or with"
                             " options for this file, FILE:unit=um,size=4000x3000,channel=NAME,"
                             "transpose=yes,periodic=as-is;"
                             " spectrum:FILE; or"
                             " self_affine:NAME=VALUE,... with hurst, wavelength_long,"
                             " wavelength_short, and rms_slope or rms_height")
    parser.add_argument("--material", required=True, metavar="RUBBER", type=Path,
                        help="a namelist with &material, or a DMA table")
    _add_points(parser)
    _add_road(parser)
    _add_rubber(parser)
    _add_runs(parser)
    parser.set_defaults(call=_friction)


def _add_points(parser: argparse.ArgumentParser) -> None:
    """Add the options for the points of the curve and for the interface."""
    parser.add_argument("--speeds", type=numbers, default=numbers("1e-4:10:25"), metavar="V",
                        help="speeds, m/s: a list, or FIRST:LAST:COUNT with equal ratios"
                             " (default: 1e-4:10:25)")
    parser.add_argument("--pressures", type=numbers, default=[2e5], metavar="P",
                        help="pressures, Pa: a list, or FIRST:LAST:COUNT with equal ratios"
                             " (default: 2e5)")
    parser.add_argument("--temperatures", type=temperatures, metavar="T",
                        help="temperatures, C: a list, or FIRST:LAST:COUNT in equal steps"
                             " (default: that of the rubber)")
    parser.add_argument("--coefficient", type=float, default=0.0, metavar="MU",
                        help="Coulomb's coefficient in the interface (default: 0, no friction)")
    parser.add_argument("--slope", action="store_true",
                        help="let Coulomb's law act on the true slope of the road; needs"
                             " --coefficient")
    parser.add_argument("--tolerance", type=float, default=1e-5, metavar="E",
                        help="tolerance of the solver (default: 1e-5)")


def _add_road(parser: argparse.ArgumentParser) -> None:
    """Add the options for the patches of the road."""
    parser.add_argument("--cells", type=int, default=512, metavar="N",
                        help="cells along a side of a patch (default: 512)")
    parser.add_argument("--patches", type=int, default=8, metavar="N",
                        help="number of patches (default: 8)")
    parser.add_argument("--error", type=float, metavar="MU",
                        help="use at least 8 patches, and add more until half of the 95 %%"
                             " interval is below this")
    parser.add_argument("--side", type=float, metavar="M",
                        help="length of a side of drawn patches, m")
    parser.add_argument("--short", type=float, metavar="M", help="shortest wave that is kept, m")
    parser.add_argument("--extend", type=float, metavar="M",
                        help="shortest wavelength, m, to which the spectrum is extrapolated to"
                             " estimate the friction of the omitted waves")
    parser.add_argument("--angle", type=float, metavar="DEGREES",
                        help="angle between the velocity and x (default: 0 on maps, 31.7 on drawn"
                             " roads)")
    parser.add_argument("--join", choices=("seam", "blend", "smooth", "mirror", "window"),
                        help="how patches are made periodic (default: seam)")
    parser.add_argument("--outliers", choices=("report", "remove"), default="report",
                        help="what to do about single cells, or points of a profile, that differ"
                             " strongly from their neighbours (default: report)")
    parser.add_argument("--draw", action="store_true",
                        help="draw random maps from the combined spectrum instead of cutting"
                             " patches")
    parser.add_argument("--seed", type=int, default=1,
                        help="seed that selects the patches (default: 1)")
    parser.add_argument("--unit",
                        help="unit of length of maps that name none; counts for all roads")
    parser.add_argument("--size", nargs="+", type=float, metavar=("LX", "LY"),
                        help="lengths of maps that give none, in their unit; counts for all roads")


def _add_rubber(parser: argparse.ArgumentParser) -> None:
    """Add the options for the fit of a DMA table."""
    add_table(parser, "a DMA table")
    parser.add_argument("--wlf", nargs="+", type=float, metavar=("C1", "C2"),
                        help="constants of the shift of a DMA table, see `fit`")
    parser.add_argument("--reference", type=float, metavar="T",
                        help="reference temperature of a DMA table, C")
    parser.add_argument("--vertical", action="store_true",
                        help="also shift the moduli of a DMA table")
    parser.add_argument("--temperature-tolerance", type=float, metavar="K",
                        help="tolerance of the temperatures of a DMA table, see `fit`")


def _add_runs(parser: argparse.ArgumentParser) -> None:
    """Add the options for the runs and for the output."""
    parser.add_argument("--jobs", type=int, metavar="N",
                        help="runs at a time (default: one per processor, and with --slurm as"
                             " many as Slurm starts)")
    parser.add_argument("--slurm", metavar="OPTIONS",
                        help="submit the runs as a job array with these options of sbatch; the same"
                             " command gathers them later")
    parser.add_argument("--plan", action="store_true", help="print the plan and run nothing")
    parser.add_argument("--folder", type=Path, metavar="FOLDER",
                        help="folder of the runs (default: OUTPUT_runs beside the first output)")
    parser.add_argument("--no-resume", action="store_true",
                        help="run all cases again instead of reusing complete results")
    parser.add_argument("--quiet", action="store_true", help="show no progress")
    parser.add_argument("-o", "--output", metavar="FILE", type=Path, action="append",
                        help=".html, .csv, .nc (netCDF), or a picture .png, .pdf or .svg; may be"
                             " repeated (default: friction.html and friction.csv)")
    parser.add_argument("--overwrite", action="store_true",
                        help="replace outputs that exist, unless they are a road or the rubber;"
                             " without this option only the outputs of the same plan are replaced")


def _friction(chosen: argparse.Namespace) -> int:
    """Print the plan, run it, and write the output."""
    outputs = chosen.output or [Path("friction.html"), Path("friction.csv")]
    for output in outputs:
        if output.suffix.lower() not in _KINDS:
            raise ValueError(f"--output {output}: must end in {', '.join(_KINDS)}")
        check_folder(output)
    from ..curves import plan_curve, run_curve
    from ..curves.curve import MOST_PATCHES, first_plan
    from ..curves.outputs import check_outputs, plan_code, write_output
    from ..curves.running import SubmittedError
    from ..curves.sources import compound_of, file_of_road, road_of
    from ..runs.means import means_of

    _check_inputs(outputs, [*map(file_of_road, chosen.roads), chosen.material])
    options = {name: getattr(chosen, name) for name in ("unit", "size")
               if getattr(chosen, name) is not None}
    road = road_of(chosen.roads, cells=chosen.cells, side=chosen.side, join=chosen.join,
                   short=chosen.short, outliers=chosen.outliers, draw=chosen.draw,
                   seed=chosen.seed, **options)
    compound = compound_of(chosen.material, wlf=chosen.wlf, reference=chosen.reference,
                           vertical=chosen.vertical,
                           temperature_tolerance=chosen.temperature_tolerance,
                           **table_options(chosen))
    plan = plan_curve(road, compound, speeds=chosen.speeds, pressures=chosen.pressures,
                      temperatures=chosen.temperatures, patches=chosen.patches,
                      coefficient=chosen.coefficient, slope_effect=chosen.slope,
                      angle=chosen.angle, tolerance=chosen.tolerance)
    plan = first_plan(plan, chosen.error, chosen.extend)
    means = means_of(chosen.jobs, 1, not chosen.no_resume, None, chosen.slurm)
    print(plan.summary(means.side_by_side, here=means.slurm is None), flush=True)
    most = min(MOST_PATCHES, plan.road.count or MOST_PATCHES)
    if chosen.error is not None and plan.patches < most:
        print(f"more       up to {most} patches, until half of the 95 % interval of the friction is"
              f" below {chosen.error:g}", flush=True)
    if chosen.plan:
        return 0
    folder = chosen.folder or outputs[0].with_name(f"{outputs[0].stem}_runs")
    code = plan_code(plan, chosen.error, chosen.extend)
    check_outputs(outputs, folder, code, chosen.overwrite)
    try:
        curve = run_curve(plan, folder, means, error=chosen.error, extend=chosen.extend,
                          quiet=chosen.quiet)
    except SubmittedError as message:
        print(message)
        return 0
    except (KeyboardInterrupt, SystemExit) as stop:
        again = " without --no-resume" if chosen.no_resume else ""
        advice = f"the same command{again} continues from the results in {folder}"
        if isinstance(stop, KeyboardInterrupt):
            raise KeyboardInterrupt(advice) from None
        with contextlib.suppress(OSError):  # nobody may read it any more
            os.write(2, f"asperity: stopped by a signal: {advice}\n".encode())
        raise
    print(curve.summary(plan.all_notes))
    for output in outputs:
        write_output(output, folder, code, lambda name: _write(curve, name))
        print(f"wrote {output}")
    return 0 if np.isfinite(curve.values["friction"]).all() else 4


def _check_inputs(outputs: list[Path], inputs: list[Path | None]) -> None:
    """Refuse an output that is one of the inputs."""
    for output in outputs:
        if output.exists() and any(path is not None and path.exists() and output.samefile(path)
                                   for path in inputs):
            raise ValueError(f"--output {output}: is an input: name another file")


def _write(curve: FrictionCurve, output: Path) -> Path:
    """Write a file, whose ending determines its kind."""
    from ..views.style import save_picture

    kind = output.suffix.lower()
    if kind == ".csv":
        return curve.to_csv(output)
    if kind == ".nc":
        return curve.to_netcdf(output)
    if kind == ".html":
        return curve.to_html(output)
    if "matplotlib.pyplot" not in sys.modules:
        import matplotlib

        matplotlib.use("Agg")
    figure = curve.plot()
    save_picture(figure, output, 300)
    return output
