#!/usr/bin/env python3
"""Make the studies of this folder: run them, check what they claim, draw their pictures.

    python examples/make.py --list
    python examples/make.py tabor            # one of them, in full
    python examples/make.py --quick          # all of them, coarse: nothing is rewritten
    python examples/make.py --gallery        # docs/gallery.md from the README files

A study is a folder with a README.md and either study.py, with `compute`, `check` and `picture`, or
only input.nml, which is run and drawn. The full form rewrites the study's picture.png and
numbers.json, that of all studies docs/gallery.md, too. Results lie in build/examples/NAME; a study
that was stopped takes up what is there.
"""

from __future__ import annotations

import argparse
import functools
import importlib.util
import json
import os
import re
import shutil
import sys
import tempfile
import time
import traceback
import warnings
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np

EXAMPLES = Path(__file__).resolve().parent
ROOT = EXAMPLES.parent
sys.path.insert(0, str(EXAMPLES))  # for studies: import common

import common  # noqa: E402 - found by the line above

import asperity  # noqa: E402

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LONGEST = 40  # values of an array that numbers.json keeps
#: What the chapters of the thesis are about, for the gallery.
CHAPTERS = {1: "What is known (chapter 1)", 2: "Pressing, sinking in, pulling off (chapter 2)",
            3: "Friction in the interface (chapter 3)", 4: "Rough roads (chapter 4)",
            9: "Beside the thesis"}


class Study:
    """A folder that can be made."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.name = folder.name
        self.readme = (folder / "README.md").read_text()

    @functools.cached_property
    def module(self) -> ModuleType | None:
        """The loaded study.py; None where there is only an input."""
        path = self.folder / "study.py"
        if not path.exists():
            return None
        spec = importlib.util.spec_from_file_location(f"study_{self.name}", path)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[spec.name] = module  # dataclasses and pickle look there
        spec.loader.exec_module(module)
        return module

    @property
    def title(self) -> str:
        """The title: the first line of study.py, or of the README."""
        if self.module is not None:
            return (self.module.__doc__ or self.name).strip().splitlines()[0].rstrip(".")
        return self.readme.splitlines()[0].removeprefix("# ")

    @property
    def minutes(self) -> float | None:
        """How long the full form takes on two cores, if it is said."""
        return None if self.module is None else float(self.module.MINUTES)

    def compute(self, folder: Path, quick: bool) -> dict[str, Any]:
        """Run the study with its results in `folder`; return its numbers."""
        if self.module is not None:
            return self.module.compute(folder, quick)
        case = asperity.Case.read(self.folder / "input.nml")
        if quick:
            case = common.shortened(case)
        run = common.run(case, folder / "result.h5")
        return {"result": str(run.path), **{name: run.history[name] for name in
                ("time", "contact_area", "friction", "residual_normal")}}

    def check(self, data: dict[str, Any], quick: bool) -> None:
        """Hold the numbers against what is claimed."""
        if self.module is not None:
            self.module.check(data, quick)
            return
        assert (data["contact_area"] > 0).any(), "there is no contact"
        # ten times the loosest tolerance that the examples ask for
        assert (data["residual_normal"] < 1e-4).all(), "a solve has missed its tolerance"

    def picture(self, data: dict[str, Any]) -> Figure:
        """Draw the numbers."""
        if self.module is not None:
            return self.module.picture(data)
        return asperity.open(data["result"]).overview()

    def section(self) -> tuple[float, ...]:
        """Where the thesis treats it, for the order: the first figure or section it names."""
        text = part(self.readme, "The thesis") or self.readme
        found = re.search(r"(?:[Ff]igures?|[Ss]ections?|[Tt]ables?)\s+(\d)\.(\d+)", text)
        return (float(found[1]), float(found[2])) if found else (9.0, 0.0)


def studies(names: list[str] | None = None) -> list[Study]:
    """Return the studies, all or those that are named."""
    known = {folder.name: folder for folder in sorted(EXAMPLES.iterdir())
             if (folder / "README.md").is_file()
             and ((folder / "study.py").is_file() or (folder / "input.nml").is_file())}
    for name in names or ():
        if name not in known:
            raise SystemExit(f"make.py: there is no study {name}: there are {', '.join(known)}")
    return [Study(known[name]) for name in names or known]


def make(study: Study, folder: Path, quick: bool) -> tuple[dict[str, Any], Figure]:
    """Compute, check and draw a study; a warning that it does not expect is an error."""
    folder.mkdir(parents=True, exist_ok=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        # The coarse grids of the quick form have small contacts, which its checks allow for.
        with common.expected(*((common.SMALL_CONTACTS,) if quick else ())):
            data = study.compute(folder, quick)
        study.check(data, quick)
        warnings.simplefilter("error")
        figure = study.picture(data)
        figure.canvas.draw()
    return data, figure


def numbers(data: dict[str, Any]) -> dict[str, Any]:
    """Return what is short enough to be kept, with six digits."""
    kept = {}
    for name, value in data.items():
        plain = _plain(value)
        if plain is not None:
            kept[name] = plain
    return kept


def _plain(value: Any) -> Any:
    """Return a value for numbers.json; None if it is left out."""
    if isinstance(value, np.ndarray | np.generic):
        if np.size(value) > LONGEST:
            return None
        value = value.tolist()
    if isinstance(value, bool | int):
        return value
    if isinstance(value, float):
        return float(f"{value:.6g}") if np.isfinite(value) else None
    if isinstance(value, str):
        return None if Path(value).is_absolute() else value
    if isinstance(value, list | tuple):
        kept = [_plain(one) for one in value] if len(value) <= LONGEST else []
        return kept if any(one is not None for one in kept) else None
    if isinstance(value, dict):
        named = {str(name): _plain(one) for name, one in value.items()}
        return {name: one for name, one in named.items() if one is not None} or None
    return None


def part(readme: str, heading: str) -> str:
    """Return the text under a heading of a README, '' where there is none."""
    found = re.search(rf"^## {re.escape(heading)}\s*\n(.*?)(?=^## |\Z)", readme,
                      flags=re.DOTALL | re.MULTILINE)
    return found[1].strip() if found else ""


def gallery() -> str:
    """Return docs/gallery.md: each study's picture, what it is, and what the thesis says."""
    lines = ["# Gallery", "",
             "The studies of R. Bugnicourt's thesis (INSA Lyon, 2017), and some beside it, in its"
             " order: what is", "computed, what the thesis says of it, and where we differ and"
             " why. Each has a page with its numbers and the", "commands that make it;"
             " `python examples/make.py --list` lists them all. This page is made by",
             "`python examples/make.py --gallery`.", "",
             "![A film of a sliding contact: the parts that stick and slip, and the friction]"
             "(figures/sliding.gif)", "",
             "*The contact of the [case in ten lines](../README.md#a-case-in-ten-lines) while its"
             " road starts to move: what sticks", "(blue) and what slips (orange). `asperity plot"
             " road.h5 --film` makes such a film of any result with snapshots.*", ""]
    chapter = 0
    for study in sorted(studies(), key=lambda one: (one.section(), one.name)):
        if study.section()[0] != chapter:
            chapter = int(study.section()[0])
            lines += [f"## {CHAPTERS[chapter]}", ""]
        title, first, *_ = re.split(r"\n\s*\n", study.readme.strip())
        lines += [f"### {title.removeprefix('# ').strip()}", "",
                  f"![{study.title}](../examples/{study.name}/picture.png)", "",
                  _relinked(first, study.name), ""]
        thesis = part(study.readme, "The thesis")
        if thesis:
            lines += ["**The thesis.** " + _relinked(thesis, study.name), ""]
        lines += [f"[The study](../examples/{study.name}/README.md)", ""]
    return "\n".join(lines)


def _relinked(text: str, name: str) -> str:
    """Return a text whose links, made for the study's folder, are those of docs/."""
    def moved(found: re.Match[str]) -> str:
        target = found[1]
        if re.match(r"https?:|#", target):
            return found[0]
        path = os.path.normpath(Path("..") / "examples" / name / target)
        return f"]({path.removeprefix('../docs/')})"

    return re.sub(r"\]\(([^)]+)\)", moved, text)


def main(arguments: list[str] | None = None) -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help="studies; default: all")
    parser.add_argument("--quick", action="store_true",
                        help="coarse grids, few steps: computes and checks, rewrites nothing")
    parser.add_argument("--jobs", type=int, metavar="N", default=len(os.sched_getaffinity(0)),
                        help="processors to use; default: all")
    parser.add_argument("--fresh", action="store_true", help="keep no results of an earlier call")
    parser.add_argument("--list", action="store_true", help="list the studies")
    parser.add_argument("--gallery", action="store_true", help="write docs/gallery.md only")
    chosen = parser.parse_args(arguments)
    if chosen.jobs < 1:
        parser.error(f"--jobs {chosen.jobs}: must be a positive integer")
    wanted = studies(chosen.names)
    if chosen.list:
        for study in wanted:
            minutes = "" if study.minutes is None else f" ({study.minutes:g} min)"
            print(f"{study.name:<24} {study.title}{minutes}")
        return 0
    failed = []
    if not chosen.gallery:
        matplotlib.use("Agg")
        common.jobs = chosen.jobs
        asperity.set_threads(chosen.jobs)
        failed = [study.name for study in wanted if not _make_one(study, chosen)]
    if chosen.gallery or not (chosen.quick or chosen.names):
        (ROOT / "docs" / "gallery.md").write_text(gallery())
    if failed:
        print(f"make.py: failed: {', '.join(failed)}", file=sys.stderr)
    return bool(failed)


def _make_one(study: Study, chosen: argparse.Namespace) -> bool:
    """Make a study and tell of it; return whether it holds."""
    from matplotlib import pyplot

    start = time.monotonic()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) if chosen.quick else ROOT / "build" / "examples" / study.name
        if chosen.fresh and not chosen.quick:
            shutil.rmtree(folder, ignore_errors=True)
        try:
            data, figure = make(study, folder, chosen.quick)
        except (AssertionError, Warning) as error:
            print(f"{study.name}: FAILED: {error}", file=sys.stderr)
            return False
        except Exception:
            print(f"{study.name}: FAILED:\n{traceback.format_exc()}", file=sys.stderr)
            return False
        if not chosen.quick:
            figure.savefig(study.folder / "picture.png", dpi=110)
            (study.folder / "numbers.json").write_text(
                json.dumps(numbers(data), indent=1, ensure_ascii=False) + "\n")
        pyplot.close(figure)
    print(f"{study.name}: done in {time.monotonic() - start:.1f} s", flush=True)
    return True


if __name__ == "__main__":
    sys.exit(main())
