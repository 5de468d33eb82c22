"""The verbs ``plot``, ``report`` and ``watch`` of ``python -m asperity``, which show results."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..base.files import MAP, kind_of, size_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["add_plot", "add_report", "add_watch"]


def add_plot(verbs: Any) -> None:
    """Add the verb `plot`."""
    plot = verbs.add_parser(
        "plot", help="draw a picture or a film of a result",
        description="Draws a result, by default an overview, into RESULT.png. In a case with"
                    " friction it shows friction, contact area, stick area and sliding speed over"
                    " time, and the last maps of pressure and of stick and slip. Otherwise it shows"
                    " the contact area, and the last maps of pressure and gap. A curve of steady"
                    " states is drawn over the sliding speed. A height map is drawn as a map of"
                    " its heights and a profile.")
    plot.add_argument("result", metavar="RESULT.h5",
                      help="result of `asperity run`, or a height map of `asperity import`")
    plot.add_argument("-o", "--output", metavar="PNG", type=Path,
                      help="picture to write (.png, .pdf, .svg; a film .gif, .mp4);"
                           " default: RESULT.png beside the result")
    plot.add_argument("--show", action="store_true",
                      help="open a window instead of writing a file; needs a display")
    what = plot.add_mutually_exclusive_group()
    what.add_argument("--field", metavar="NAME",
                      help="draw a field of a snapshot, for example pressure; contact shows which"
                           " cells stick and slip, with the tractions")
    what.add_argument("--film", metavar="NAME", nargs="?", const="",
                      help="make a film of a field over all snapshots (.gif, or .mp4 with ffmpeg);"
                           " the default is stick and slip, or without friction the pressure")
    what.add_argument("--history", metavar="NAME",
                      help="draw a column of the history, for example friction (with its parts),"
                           " energy, or force (the normal force on the whole grid)")
    plot.add_argument("--step", type=int,
                      help="number of the snapshot's row; default: the last snapshot")
    plot.add_argument("--x", metavar="NAME",
                      help="column along the horizontal axis of --history, or force")
    plot.set_defaults(call=_plot, error=plot.error)


def _plot(chosen: argparse.Namespace) -> int:
    """Draw the picture or film that was chosen."""
    if chosen.step is not None and not chosen.field:
        chosen.error("--step needs --field")
    if chosen.x is not None and not chosen.history:
        chosen.error("--x needs --history")
    import matplotlib

    if not chosen.show:
        matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    from ..results import open_result
    from ..views.plot_road import plot_road
    from ..views.style import check_picture, save_picture

    if chosen.output is not None and chosen.output.is_dir():
        raise IsADirectoryError(f"{chosen.output}: is a folder: name a picture in it")
    if chosen.film is None:
        check_picture(chosen.output)
    path = Path(chosen.result)
    is_road = path.is_file() and kind_of(path) == MAP
    if is_road and (chosen.field or chosen.history or chosen.film is not None):
        chosen.error(f"{path} is a height map: it has no --field, --history or --film")
    run = None if is_road else open_result(chosen.result)
    if chosen.film is None and chosen.output is None and not chosen.show:
        check_picture(path.with_suffix(".png"))
    if run is not None and chosen.film is not None:
        return _film(run, chosen)
    figure = plot_road(path) if run is None else _picture(run, chosen)
    if chosen.show:
        if not _has_windows(figure):
            raise ValueError("--show: no window can be opened: there is no display, or the backend"
                             f" {matplotlib.get_backend()!r} of matplotlib has no windows; without"
                             " --show a picture is written")
        plt.show()
        return 0
    output = chosen.output or path.with_suffix(".png")
    save_picture(figure, output, 300)
    plt.close(figure)
    print(f"wrote {output}")
    return 0


def _picture(run: Any, chosen: argparse.Namespace) -> Figure:
    """Return the picture of a result that was chosen."""
    if chosen.field:
        snapshots = run.snapshots
        if not len(snapshots):
            raise ValueError(f"{run.path}: holds no snapshots yet")
        snapshot = snapshots[-1] if chosen.step is None else snapshots.at_step(chosen.step)
        return snapshot.plot(chosen.field).figure.canvas.figure
    if chosen.history:
        return run.plot(chosen.history, chosen.x).figure.canvas.figure
    return run.overview()


def _has_windows(figure: Figure) -> bool:
    """Return whether the backend of matplotlib shows figures. Some do nothing without a word."""
    from matplotlib.backend_bases import FigureManagerBase

    kinds = figure.canvas.manager_class.__mro__
    return any({"show", "pyplot_show"} & set(vars(kind))
               for kind in kinds[:kinds.index(FigureManagerBase)])


def _film(run: Any, chosen: argparse.Namespace) -> int:
    """Make a film."""
    from ..views.film import film

    if chosen.show:
        chosen.error("--show does not go with --film")
    output = film(run, chosen.output or run.path.with_suffix(".gif"), chosen.film or None)
    print(f"wrote {output} ({size_text(output)})")
    return 0


def add_report(verbs: Any) -> None:
    """Add the verb `report`."""
    report = verbs.add_parser(
        "report", help="write an HTML page about a result",
        description="Writes one HTML file about a result, which any browser shows without a"
                    " network: friction and contact area over time, maps with a slider, spectra,"
                    " energies, convergence, and the settings of the case. The run may be"
                    " unfinished.")
    report.add_argument("result", metavar="RESULT.h5", help="result of `asperity run`")
    report.add_argument("-o", "--output", metavar="HTML", type=Path,
                        help="page to write; default: RESULT.html beside the result")
    report.set_defaults(call=_report)


def _report(chosen: argparse.Namespace) -> int:
    """Write the page."""
    from ..results import open_result
    from ..views.report import write_report

    path = write_report(open_result(chosen.result), chosen.output)
    print(f"wrote {path} ({size_text(path)})")
    return 0


def add_watch(verbs: Any) -> None:
    """Add the verb `watch`."""
    watch = verbs.add_parser(
        "watch", help="follow a run in the terminal",
        description="Follows a run until it is finished, with bars of text for friction and contact"
                    " area, the last row and the time left. Ctrl-C ends the view, not the run. If"
                    " the output is not a terminal, a plain line is printed at each change.")
    watch.add_argument("result", metavar="RESULT.h5", help="result of `asperity run`")
    watch.add_argument("--every", metavar="SECONDS", type=float, default=1.0,
                       help="time between two updates (default: 1)")
    watch.add_argument("--once", action="store_true", help="show the present state and exit")
    watch.set_defaults(call=_watch)


def _watch(chosen: argparse.Namespace) -> int:
    """Follow a run."""
    from ..views.watch import watch

    if not 0.05 <= chosen.every <= 3600.0:
        raise ValueError(f"--every {chosen.every:g}: must be 0.05 to 3600 seconds")
    return watch(chosen.result, every=chosen.every, once=chosen.once)
