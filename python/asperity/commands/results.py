"""The verbs ``plot``, ``report`` and ``watch`` of ``python -m asperity``: results looked at."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

__all__ = ["add_plot", "add_report", "add_watch"]


def add_plot(verbs: Any) -> None:
    """Add the verb `plot`."""
    plot = verbs.add_parser(
        "plot", help="draw a result",
        description="Draw a result: by default an overview, into RESULT.png. With friction it shows"
                    " friction, contact and stick area and sliding speed in time, with the last"
                    " pressure and what sticks and slips; without, the last pressure and gap with"
                    " the contact area.")
    plot.add_argument("result", metavar="RESULT.h5", help="result of `asperity run`")
    plot.add_argument("-o", "--output", metavar="PNG", type=Path,
                      help="picture to write (.png, .pdf, .svg; a film .gif, .mp4);"
                           " default: RESULT.png beside the result")
    plot.add_argument("--show", action="store_true", help="open a window instead of writing")
    what = plot.add_mutually_exclusive_group()
    what.add_argument("--field", metavar="NAME",
                      help="draw a field of a snapshot, as pressure; contact shows what sticks"
                           " and slips, with the tractions")
    what.add_argument("--film", metavar="NAME", nargs="?", const="",
                      help="make a film of a field over all snapshots (.gif, or .mp4 with ffmpeg);"
                           " without a name of what sticks and slips, or of the pressure")
    what.add_argument("--history", metavar="NAME",
                      help="draw a column of the history, as friction (with its causes), or energy")
    plot.add_argument("--step", type=int, help="the snapshot's step; default: the last one")
    plot.add_argument("--x", metavar="NAME", help="column to draw --history against")
    plot.set_defaults(call=_plot, error=plot.error)


def _plot(chosen: argparse.Namespace) -> int:
    """Draw what was chosen."""
    if chosen.step is not None and not chosen.field:
        chosen.error("--step goes with --field")
    if chosen.x is not None and not chosen.history:
        chosen.error("--x goes with --history")
    import matplotlib

    if not chosen.show:
        matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    from ..results import open_result
    from ..views.style import check_picture

    if chosen.output is not None and chosen.output.is_dir():
        raise IsADirectoryError(f"{chosen.output}: is a folder: name a picture in it")
    if chosen.film is None:
        check_picture(chosen.output)
    run = open_result(chosen.result)
    if chosen.film is not None:
        return _film(run, chosen)
    if chosen.field:
        if not len(run.snapshots):
            raise ValueError(f"{run.path}: holds no snapshots yet")
        snapshots = run.snapshots
        snapshot = snapshots[-1] if chosen.step is None else snapshots.at_step(chosen.step)
        figure = snapshot.plot(chosen.field).figure
    elif chosen.history:
        figure = run.plot(chosen.history, chosen.x).figure
    else:
        figure = run.overview()
    if chosen.show:
        plt.show()
        return 0
    output = chosen.output or run.path.with_suffix(".png")
    figure.savefig(output, dpi=300)
    plt.close(figure)
    print(f"wrote {output}")
    return 0


def _film(run: Any, chosen: argparse.Namespace) -> int:
    """Make a film."""
    from ..views.film import film

    if chosen.show:
        chosen.error("--show does not go with --film")
    output = film(run, chosen.output or run.path.with_suffix(".gif"), chosen.film or None)
    print(f"wrote {output} ({output.stat().st_size / 1e6:.1f} MB)")
    return 0


def add_report(verbs: Any) -> None:
    """Add the verb `report`."""
    report = verbs.add_parser(
        "report", help="write a page about a result",
        description="Write one HTML file about a result, for any browser, with nothing to fetch:"
                    " friction and contact area in time, maps with a slider, spectra, energies,"
                    " convergence, the case and how it was made. Of a run that is still going it"
                    " shows what there is.")
    report.add_argument("result", metavar="RESULT.h5", help="result of `asperity run`")
    report.add_argument("-o", "--output", metavar="HTML", type=Path,
                        help="page to write; default: RESULT.html beside the result")
    report.set_defaults(call=_report)


def _report(chosen: argparse.Namespace) -> int:
    """Write the page."""
    from ..results import open_result
    from ..views.report import write_report

    path = write_report(open_result(chosen.result), chosen.output)
    print(f"wrote {path} ({path.stat().st_size / 1e6:.1f} MB)")
    return 0


def add_watch(verbs: Any) -> None:
    """Add the verb `watch`."""
    watch = verbs.add_parser(
        "watch", help="follow a run in the terminal",
        description="Follow a run until it is finished: friction and contact area as lines of"
                    " text, the last row, the time left. Ctrl-C ends the view, not the run. Where"
                    " the output is no terminal, a plain line tells each change.")
    watch.add_argument("result", metavar="RESULT.h5", help="result of `asperity run`")
    watch.add_argument("--every", metavar="SECONDS", type=float, default=1.0,
                       help="look so often; default: 1")
    watch.add_argument("--once", action="store_true", help="show what there is and end")
    watch.set_defaults(call=_watch)


def _watch(chosen: argparse.Namespace) -> int:
    """Follow a run."""
    from ..views.watch import watch

    if not 0.05 <= chosen.every <= 3600.0:
        raise ValueError(f"--every {chosen.every:g}: must be 0.05 to 3600 seconds")
    return watch(chosen.result, every=chosen.every, once=chosen.once)
