"""The command ``python -m asperity VERB``, for results and measured data."""

from __future__ import annotations

import argparse
import difflib
import os
import re
import signal
import sys

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
        0 done; 2 wrong arguments; 3 a file cannot be read or written; 4 a computation failed, or
        needs more memory than there is; 130 stopped by Ctrl-C.
    """
    try:
        return _run(sys.argv[1:] if arguments is None else arguments)
    except (OSError, ImportError) as error:
        return _fail(error, 3)
    except (KeyError, IndexError, ValueError) as error:
        return _fail(error, 2)
    except RuntimeError as error:
        return _fail(error, 4)
    except MemoryError as error:
        return _fail(MemoryError(f"not enough memory: {error}" if str(error) else
                                 "not enough memory"), 4)
    except KeyboardInterrupt as stop:
        more = f": {stop}" if str(stop) else ""
        return _fail(KeyboardInterrupt(f"stopped by Ctrl-C{more}"), 128 + signal.SIGINT)


def _run(arguments: list[str]) -> int:
    """Run the command. Modules are imported here, because Ctrl-C may come while NumPy is loaded."""
    from .base.library import version
    from .base.pipes import patient_output
    from .commands.data import add_fit, add_import
    from .commands.friction import add_friction
    from .commands.results import add_plot, add_report, add_watch

    parser = argparse.ArgumentParser(
        prog=os.environ.get("ASPERITY_COMMAND", "python -m asperity"),
        description="Turns measured roads and rubbers into inputs, computes friction curves, and"
                    " turns results into pictures and pages. The command `asperity run` computes"
                    " a case.")
    parser.add_argument("--version", action="version", version=f"asperity {version()}")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    for add in (add_plot, add_import, add_fit, add_friction, add_report, add_watch):
        add(verbs)
    chosen, unknown = parser.parse_known_args(with_negative_lists(arguments))
    if unknown:
        _refuse(unknown, verbs.choices[chosen.verb])
    if chosen.verb == "watch":  # which ends when nobody reads it
        return chosen.call(chosen)
    with patient_output():
        return chosen.call(chosen)


def _refuse(unknown: list[str], verb: argparse.ArgumentParser) -> None:
    """End with the usage of a verb, and name its options that resemble the unknown words."""
    # The parser of all verbs would print its own usage.
    options = re.findall(r"--[a-z]+(?:-[a-z]+)*(?![-a-z])", verb.format_help())
    near = [found for word in unknown if word.startswith("--")
            for found in difflib.get_close_matches(word.partition("=")[0], options, n=1)]
    hint = f"; did you mean {' or '.join(dict.fromkeys(near))}?" if near else ""
    verb.error(f"unrecognized arguments: {' '.join(unknown)}{hint}")


def with_negative_lists(arguments: list[str]) -> list[str]:
    """Return the words of a command line, with lists that begin with a minus as values.

    argparse takes ``-10`` as a value, but ``-10,20`` and ``-1e-3`` as unknown options, and so a
    single option of ``sbatch`` behind ``--slurm``.

    Examples
    --------
    >>> with_negative_lists(["--temperatures", "-10,20", "--angle", "-5"])
    ['--temperatures=-10,20', '--angle', '-5']
    >>> with_negative_lists(["--slurm", "--time=1:00:00"])
    ['--slurm=--time=1:00:00']
    """
    words: list[str] = []
    for word in arguments:
        if (words and words[-1].startswith("--") and "=" not in words[-1]
                and (re.match(r"-\.?\d.*[,:eE]", word)
                     or (words[-1] == "--slurm" and re.match(r"--?[A-Za-z]", word)))):
            words[-1] += f"={word}"
        else:
            words.append(word)
    return words


def _fail(error: BaseException, status: int) -> int:
    """Print a message and return the exit status."""
    if isinstance(error, OSError) and error.strerror and error.filename:
        text = f"{error.filename}: {error.strerror}"
    else:
        text = str(error)
    print(f"asperity: {text}", file=sys.stderr)
    return status


if __name__ == "__main__":
    sys.exit(main())
