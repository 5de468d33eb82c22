"""The command ``python -m asperity VERB``, for results and measured data."""

from __future__ import annotations

import argparse
import os
import sys

from .base.library import version
from .commands.data import add_fit, add_import
from .commands.friction import add_friction
from .commands.results import add_plot, add_report, add_watch

__all__ = ["main"]


def main(arguments: list[str] | None = None) -> int:
    """Run the command and return its exit status.

    Parameters
    ----------
    arguments : list of str, optional
        The words after ``python -m asperity``; by default those of the process.

    Returns
    -------
    int
        0 done; 2 wrong arguments; 3 a file cannot be read or written; 4 a computation failed.
    """
    parser = argparse.ArgumentParser(
        prog=os.environ.get("ASPERITY_COMMAND", "python -m asperity"),
        description="Turns measured roads and rubbers into inputs, computes friction curves, and"
                    " turns results into pictures and pages. The command `asperity run` computes"
                    " a case.")
    parser.add_argument("--version", action="version", version=f"asperity {version()}")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    for add in (add_plot, add_import, add_fit, add_friction, add_report, add_watch):
        add(verbs)
    chosen = parser.parse_args(arguments)
    try:
        return chosen.call(chosen)
    except (OSError, ImportError) as error:
        return _fail(error, 3)
    except (KeyError, IndexError, ValueError) as error:
        return _fail(error, 2)
    except RuntimeError as error:
        return _fail(error, 4)


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
