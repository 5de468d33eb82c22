"""``python -m asperity VERB``: results looked at, measurements made into inputs."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from ._data_verbs import add_fit, add_import
from ._library import version

__all__ = ["main"]


def main(arguments: list[str] | None = None) -> int:
    """Run the command; return its exit status: 0 done, 2 wrong arguments, 3 a file.

    Parameters
    ----------
    arguments : list of str, optional
        The words after ``python -m asperity``; those of the process if left out.
    """
    parser = argparse.ArgumentParser(
        prog="python -m asperity",
        description="Measured roads and rubbers into inputs, results into pictures and pages."
                    " Runs are made by the command `asperity`.")
    parser.add_argument("--version", action="version", version=f"asperity {version()}")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    plot = verbs.add_parser(
        "plot", help="draw a result",
        description="Draw a result: by default an overview, into RESULT.png. With friction it shows"
                    " friction, contact and stick area and sliding speed in time, with the last"
                    " pressure and what sticks and slips; without, the last pressure and gap with"
                    " the contact area.")
    plot.add_argument("result", metavar="RESULT.h5", help="result of `asperity run`")
    plot.add_argument("-o", "--output", metavar="PNG", type=Path,
                      help="picture to write (.png, .pdf, .svg); default: RESULT.png beside the"
                           " result")
    plot.add_argument("--show", action="store_true", help="open a window instead of writing")
    what = plot.add_mutually_exclusive_group()
    what.add_argument("--field", metavar="NAME",
                      help="draw a field of a snapshot, as pressure; contact shows what sticks"
                           " and slips, with the tractions")
    what.add_argument("--history", metavar="NAME",
                      help="draw a column of the history, as friction (with its causes), or energy")
    plot.add_argument("--step", type=int, help="the snapshot's step; default: the last one")
    plot.add_argument("--x", metavar="NAME", help="column to draw --history against")
    plot.set_defaults(call=_plot)
    add_import(verbs)
    add_fit(verbs)
    _add_report(verbs)
    _add_watch(verbs)
    chosen = parser.parse_args(arguments)
    if chosen.verb == "plot":
        if chosen.step is not None and not chosen.field:
            plot.error("--step goes with --field")
        if chosen.x is not None and not chosen.history:
            plot.error("--x goes with --history")
    try:
        return chosen.call(chosen)
    except (OSError, ImportError) as error:
        return _fail(error, 3)
    except (KeyError, IndexError, ValueError) as error:
        return _fail(error, 2)


def _add_report(verbs: Any) -> None:
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


def _add_watch(verbs: Any) -> None:
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


def _report(chosen: argparse.Namespace) -> int:
    """Write the page."""
    from .report import write_report
    from .result import open_result

    path = write_report(open_result(chosen.result), chosen.output)
    print(f"wrote {path} ({path.stat().st_size / 1e6:.1f} MB)")
    return 0


def _watch(chosen: argparse.Namespace) -> int:
    """Follow a run."""
    from .watch import watch

    if not 0.05 <= chosen.every <= 3600.0:
        raise ValueError(f"--every {chosen.every:g}: must be 0.05 to 3600 seconds")
    return watch(chosen.result, every=chosen.every, once=chosen.once)


def _plot(chosen: argparse.Namespace) -> int:
    """Draw what was chosen."""
    import matplotlib

    if not chosen.show:
        matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    from ._style import check_picture
    from .result import open_result

    check_picture(chosen.output)
    run = open_result(chosen.result)
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
    if output.is_dir():
        raise IsADirectoryError(f"{output}: is a folder: name a picture in it")
    if not output.suffix:
        output = output.with_name(output.name + ".png")
    figure.savefig(output, dpi=300)
    plt.close(figure)
    print(f"wrote {output}")
    return 0


def _fail(error: Exception, status: int) -> int:
    """Print a message and return the exit status."""
    if isinstance(error, OSError) and error.strerror and error.filename:
        text = f"{error.filename}: {error.strerror}"
    else:
        text = str(error)
    print(f"asperity: {text}", file=sys.stderr)
    return status


if __name__ == "__main__":
    sys.exit(main())
