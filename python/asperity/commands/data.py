"""The verbs ``import`` and ``fit`` of ``python -m asperity``: measured roads and rubbers."""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path
from typing import Any

from ..base.files import (
    INPUT,
    MATERIAL,
    check_folder,
    check_output,
    kind_of,
    sealed,
    write_text,
)

__all__ = ["add_fit", "add_import", "add_table", "table_options"]


def add_import(verbs: Any) -> None:
    """Add the verb ``import`` to the subparsers."""
    parser = verbs.add_parser(
        "import", help="turn a measured topography into the road of a case",
        description="Reads a measured topography in any format that SurfaceTopography knows, and"
                    " writes the HDF5 file for `&surface shape = 'file'`. The steps are always done"
                    " in this order: crop, level, fill, invert, scale, resample, window. The file"
                    " records them. Lengths are in the unit of the file.")
    parser.add_argument("topography", metavar="TOPOGRAPHY", type=Path,
                        help="file of an instrument")
    parser.add_argument("-o", "--output", metavar="FILE.h5", type=Path, default=Path("surface.h5"),
                        help="file to write (default: surface.h5)")
    parser.add_argument("--overwrite", action="store_true",
                        help="replace the map of another topography; without this option only a map"
                             " of the same topography is replaced")
    parser.add_argument("--list", action="store_true",
                        help="list the channels of the file and write nothing")
    parser.add_argument("--channel", metavar="NAME|N",
                        help="channel by its name, or its number from 0; default: the heights")
    parser.add_argument("--unit", metavar="UNIT",
                        help="unit of length (m, mm, um, nm, pm, A, km, inch) if the file has none")
    parser.add_argument("--size", nargs="+", type=float, metavar=("LX", "LY"),
                        help="lengths if the file has none; only LX for a line scan")
    parser.add_argument("--transpose", action="store_true",
                        help="the first index of the file's array runs along y, as in images")
    parser.add_argument("--crop", nargs="+", type=float, metavar=("X0", "X1"),
                        help="keep X0 to X1 and Y0 to Y1 (four numbers; two for a line scan)")
    parser.add_argument("--level", choices=("none", "mean", "tilt", "curvature"), default="mean",
                        help="subtract the mean, or the best plane or paraboloid (default: mean)")
    parser.add_argument("--max-missing", type=float, default=0.1, metavar="SHARE",
                        help="largest accepted share of missing points (default: 0.1)")
    parser.add_argument("--invert", action="store_true", help="turn the map upside down")
    parser.add_argument("--scale", type=float, default=1.0, metavar="FACTOR",
                        help="multiply the heights by this factor")
    parser.add_argument("--resample", nargs="+", type=int, metavar=("NX", "NY"),
                        help="divide the same lengths into other cells; only NX for a line scan")
    parser.add_argument("--periodic", nargs="?", const="tukey", choices=("tukey", "hann", "as-is"),
                        help="bring the edges to the mean height by a window (default: tukey);"
                             " as-is: opposite edges match, although the file does not say so")
    parser.add_argument("--taper", type=float, metavar="SHARE",
                        help="share of each length that the Tukey window tapers (default: 0.2)")
    parser.add_argument("--restore-rms", action="store_true",
                        help="scale the windowed heights to the rms height before the window")
    parser.set_defaults(call=_import)


def _import(chosen: argparse.Namespace) -> int:
    """Import a topography and print what was done."""
    from ..roads.measured import channels, import_topography

    if chosen.list:
        print("\n".join(channels(chosen.topography)))
        return 0
    surface = import_topography(
        chosen.topography, chosen.output, overwrite=chosen.overwrite, channel=chosen.channel,
        unit=chosen.unit, size=chosen.size, transpose=chosen.transpose, crop=chosen.crop,
        level=chosen.level, max_missing=chosen.max_missing, invert=chosen.invert,
        scale=chosen.scale, resample=chosen.resample, periodic=chosen.periodic,
        taper=chosen.taper, restore_rms=chosen.restore_rms)
    print(f"wrote {chosen.output}")
    print(surface.summary())
    print()
    print(surface.to_namelist(chosen.output))
    return 0


def add_fit(verbs: Any) -> None:
    """Add the verb ``fit`` to the subparsers."""
    parser = verbs.add_parser(
        "fit", help="fit a Prony series to DMA data",
        description="Fits a Prony series to a table of storage and loss moduli, and prints the"
                    " `&material` group. Columns and units are read from the header, such as"
                    " \"f (Hz), G' (MPa), G'' (MPa), T (C)\".")
    parser.add_argument("table", metavar="DMA.csv", type=Path, help="the table")
    parser.add_argument("-o", "--output", metavar="FILE.nml", type=Path,
                        help="write the group to this file instead of the standard output")
    parser.add_argument("--plot", metavar="PNG", type=Path,
                        help="draw the data, the fit and its error (.png, .pdf, .svg)")
    parser.add_argument("--arms-per-decade", type=float, default=1.0, metavar="N",
                        help="number of relaxation times per decade (default: 1)")
    parser.add_argument("--least-plateau", type=float, default=0.01, metavar="SHARE",
                        help="smallest plateau modulus as a share of the lowest storage modulus"
                             " (default: 0.01)")
    add_table(parser, "the table")
    parser.add_argument("--poisson", type=float, default=0.5, metavar="NU",
                        help="Poisson ratio (default: 0.5)")
    parser.add_argument("--wlf", nargs="+", type=float, metavar=("C1", "C2"),
                        help="constants C1, C2 (K) and, unless --reference gives it, their"
                             " reference temperature (C); default: shifts from the overlap")
    parser.add_argument("--reference", type=float, metavar="T", help="reference temperature, C")
    parser.add_argument("--temperature", type=float, metavar="T",
                        help="temperature of the simulation, C (default: the reference)")
    parser.add_argument("--temperature-tolerance", type=float, default=0.5, metavar="K",
                        help="points whose temperatures differ by less than this belong to one"
                             " sweep, within which the temperature may drift by four times as much"
                             " (default: 0.5)")
    parser.add_argument("--vertical", action="store_true",
                        help="if shifts are found from the overlap, also shift the moduli")
    parser.add_argument("--shifts", metavar="FILE.csv", type=Path,
                        help="write the shifts a_T and b_T of each temperature to this file")
    parser.set_defaults(call=_fit)


def add_table(parser: argparse.ArgumentParser, table: str) -> None:
    """Add the options that say what the columns of a DMA table are."""
    parser.add_argument("--column", action="append", default=[], metavar="ROLE=NAME|N",
                        help=f"name or number (from 1) of the column of {table} for a role:"
                             " frequency, storage, loss, temperature or tan_delta; may be repeated")
    parser.add_argument("--frequency-unit", metavar="UNIT",
                        help=f"of {table}: Hz, kHz, mHz, rad/s or krad/s")
    parser.add_argument("--modulus-unit", metavar="UNIT", help=f"of {table}: Pa, kPa, MPa or GPa")
    parser.add_argument("--temperature-unit", metavar="UNIT", help=f"of {table}: C or K")
    parser.add_argument("--kind", choices=("shear", "tension"),
                        help=f"kind of the moduli of {table}; default: by the header, otherwise"
                             " shear")


def table_options(chosen: argparse.Namespace) -> dict[str, Any]:
    """Return the options of `add_table` as arguments of `asperity.dma.read_dma`."""
    columns = {}
    for given in chosen.column:
        role, equals, name = given.partition("=")
        if not equals or not name.strip():
            raise ValueError(f"--column {given}: must be ROLE=NAME or ROLE=NUMBER")
        columns[role.strip()] = name.strip()
    return {"columns": columns, "frequency_unit": chosen.frequency_unit,
            "modulus_unit": chosen.modulus_unit, "temperature_unit": chosen.temperature_unit,
            "kind": chosen.kind}


def _check_outputs(chosen: argparse.Namespace) -> None:
    """Refuse outputs of a fit that are the table or each other, or would replace other files."""
    from ..rubber.dma_fit import check_shifts
    from ..views.style import check_picture

    names = ("output", "shifts", "plot")
    given = {f"--{name}": getattr(chosen, name) for name in names if getattr(chosen, name)}
    known = {chosen.table.resolve(): "the table itself"}
    for option, path in given.items():
        place = path.resolve()
        if place in known:
            raise ValueError(f"{option} {path}: is {known[place]}: name another file")
        known[place] = f"the file of {option}, too"
    if chosen.output is not None:
        check_output(chosen.output, MATERIAL, INPUT)
        _keep_input(chosen.output)
    if chosen.shifts is not None:
        check_shifts(chosen.shifts)
    if chosen.plot is not None:
        check_picture(chosen.plot)
        check_folder(chosen.plot)


def _keep_input(path: Path) -> None:
    """Refuse an input that is not a material as a fit has written it."""
    if not path.is_file() or not path.stat().st_size or kind_of(path) == MATERIAL:
        return
    text = path.read_text(encoding="utf-8", errors="replace")
    found = dict.fromkeys(re.findall(r"(?im)^\s*(&[a-z]\w*)", text))
    other = ", ".join(name for name in found if name.lower() != "&material")
    if other:
        raise ValueError(f"--output {path}: holds {other}, too, and would be replaced:"
                         " name another file, and add the group from there")
    raise ValueError(f"--output {path}: holds a &material that `asperity fit` has not written, or"
                     " that was changed since, and would be replaced: name another file")


def _fit(chosen: argparse.Namespace) -> int:
    """Fit a table, write the files, and print a summary."""
    from ..rubber.dma import fit_dma, read_dma
    from ..views.style import save_picture

    _check_outputs(chosen)
    output = chosen.output
    table = read_dma(chosen.table, poisson=chosen.poisson, **table_options(chosen))
    fit = fit_dma(
        table, arms_per_decade=chosen.arms_per_decade, reference=chosen.reference,
        wlf=chosen.wlf, temperature_tolerance=chosen.temperature_tolerance,
        least_plateau=chosen.least_plateau, vertical=chosen.vertical)
    if chosen.shifts is not None:
        fit.check_sweeps()
    group = sealed(fit.to_namelist(poisson=chosen.poisson, temperature=chosen.temperature) + "\n")
    messages = sys.stdout
    if output is None:
        print(group, end="")
        messages = sys.stderr  # the standard output then has nothing but the group
    else:
        write_text(output, group)
        print(fit.summary())
        print(f"wrote {output}")
    if chosen.shifts is not None:
        print(f"wrote {fit.write_shifts(chosen.shifts)}", file=messages)
    if chosen.plot is not None:
        import matplotlib

        matplotlib.use("Agg")
        import matplotlib.pyplot

        figure = fit.plot()
        save_picture(figure, chosen.plot, 150)
        matplotlib.pyplot.close(figure)
        print(f"wrote {chosen.plot}", file=messages)
    return 0
