#!/usr/bin/env python3
"""Run the studies of this folder, check their claims and draw their pictures.

    python examples/make.py --list
    python examples/make.py tabor            # one of them, in full
    python examples/make.py --quick          # all of them, coarse: nothing is rewritten
    python examples/make.py --gallery        # docs/gallery.md from the README files

A study is a folder with a README.md and either study.py, with `compute`, `check` and `picture`, or
only input.nml, which is run and drawn. The full form rewrites picture.png and numbers.json of the
study and, if all studies are run, docs/gallery.md. Results are in build/examples/NAME; an
interrupted study reuses them.
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
sys.path.insert(0, str(EXAMPLES))  # so that studies can import common

import common  # noqa: E402 - found by the line above

import asperity  # noqa: E402

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LONGEST = 40  # longest array that numbers.json keeps
#: Headings of the gallery, by chapter of the thesis.
CHAPTERS = {1: "Known solutions (chapter 1)", 2: "Pressing, creep and pull-off (chapter 2)",
            3: "Friction in the interface (chapter 3)", 4: "Rough roads (chapter 4)",
            9: "Beyond the thesis"}


class Study:
    """A study: a folder with a README.md, and study.py or input.nml."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.name = folder.name
        self.readme = (folder / "README.md").read_text()

    @functools.cached_property
    def module(self) -> ModuleType | None:
        """The module study.py; None if there is only an input."""
        path = self.folder / "study.py"
        if not path.exists():
            return None
        spec = importlib.util.spec_from_file_location(f"study_{self.name}", path)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[spec.name] = module  # where dataclasses and pickle look for it
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
        """Time that the full form takes on two cores, min; None if it is not known."""
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
        """Check the numbers against the claims of the study."""
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
    """Return all studies, or those that are named."""
    known = {folder.name: folder for folder in sorted(EXAMPLES.iterdir())
             if (folder / "README.md").is_file()
             and ((folder / "study.py").is_file() or (folder / "input.nml").is_file())}
    for name in names or ():
        if name not in known:
            raise SystemExit(f"make.py: there is no study {name}: there are {', '.join(known)}")
    return [Study(known[name]) for name in names or known]


def make(study: Study, folder: Path, quick: bool) -> tuple[dict[str, Any], Figure]:
    """Compute, check and draw a study; an unexpected warning is an error."""
    folder.mkdir(parents=True, exist_ok=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        # The coarse grids of the quick form have small contacts; its checks take this into account.
        with common.expected(*((common.SMALL_CONTACTS,) if quick else ())):
            data = study.compute(folder, quick)
        study.check(data, quick)
        warnings.simplefilter("error")
        figure = study.picture(data)
        figure.canvas.draw()
    return data, figure


def numbers(data: dict[str, Any]) -> dict[str, Any]:
    """Return the values that are short enough for numbers.json, with six digits."""
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
    """Return the text under a heading of a README, or '' if there is no such heading."""
    found = re.search(rf"^## {re.escape(heading)}\s*\n(.*?)(?=^## |\Z)", readme,
                      flags=re.DOTALL | re.MULTILINE)
    return found[1].strip() if found else ""


def gallery() -> str:
    """Return docs/gallery.md: picture, summary and comparison with the thesis of each study."""
    lines = ["# Gallery", "",
             "These studies repeat those of R. Bugnicourt's thesis (INSA Lyon, 2017), in its order;"
             " some go beyond it. Each entry says what is computed, what the thesis found, and"
             " where and why we differ. The page of each study has its numbers and the commands"
             " that reproduce it. `python examples/make.py --list` lists the studies, and"
             " `python examples/make.py --gallery` writes this page.", "",
             "![A film of a sliding contact: the parts that stick and slip, and the friction]"
             "(figures/sliding.gif)", "",
             "*The contact of the [case in ten lines](../README.md#a-case-in-ten-lines) while its"
             " road starts to move. Blue cells stick, orange cells slip. `asperity plot"
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
    """Return a text of a study with its links changed so that they work in docs/."""
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
    parser.add_argument("--fresh", action="store_true", help="remove results of earlier calls")
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
    """Make a study and print the outcome; return whether its checks hold."""
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
