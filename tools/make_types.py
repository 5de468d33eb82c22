"""Write the types of the input and of the history for type checkers, and a table for the docs.

    python tools/make_types.py            writes the files
    python tools/make_types.py --check    ends with status 1 if they are not what they should be

`python/asperity/runs/group_types.py` holds the groups of an input, from the table of the input in
the Fortran library; `python/asperity/results/column_types.py` and the table of the history in
`docs/result_file.md` hold the columns of the history, from the table in `src/io/history_row.f90`.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path

from asperity.runs import namelists
from asperity.runs.row import Column, columns

ROOT = Path(__file__).resolve().parent.parent
GROUPS = ROOT / "python/asperity/runs/group_types.py"
COLUMNS = ROOT / "python/asperity/results/column_types.py"
PAGE = ROOT / "docs/result_file.md"

HEAD = '''"""The groups of an input and their variables, for type checkers and editors.

Written by `tools/make_types.py` from the program's table of the input; nothing here is used when a
program runs. A variable is read as the first of its two types and set as the second; None takes it
out of the input again.
"""

# ruff: noqa: D102, E501

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any, Generic, Literal, TypedDict, TypeVar, overload

from numpy.typing import NDArray

from .groups import Group, Groups
from .sampled_law import Law

if TYPE_CHECKING:
    from typing_extensions import Unpack

Found = TypeVar("Found", covariant=True)
Given = TypeVar("Given", contravariant=True)
Path = str | PathLike[str]
Reals = Sequence[float] | NDArray[Any] | float


class Variable(Generic[Found, Given]):
    """A variable: how it is read and set."""

    def __get__(self, group: object, kind: type | None = None) -> Found:
        """Return the value, or the default."""
        raise NotImplementedError

    def __set__(self, group: object, value: Given) -> None:
        """Set the value."""
'''

KINDS = {"integer": "int", "real": "float", "logical": "bool", "text": "str",
         "reals": "list[float]"}
SETTABLE = {"reals": "Reals", "text": "str"}


def words(variable: namelists.Variable) -> str:
    """Return the words that a variable may have as a type."""
    found = re.findall(r"'([^']*)'", variable.allowed)
    return f"Literal[{', '.join(map(repr, found))}]" if found else "str"


def types(variable: namelists.Variable) -> tuple[str, str]:
    """Return how a variable is read and how it is set."""
    if variable.kind == "word":
        read = given = words(variable)
    elif variable.kind == "words":
        read, given = f"list[{words(variable)}]", f"Sequence[{words(variable)}] | {words(variable)}"
    else:
        read = KINDS[variable.kind]
        given = SETTABLE.get(variable.kind, read)
    if variable.name == "file":
        given = "Path"
    if variable.name == "law":
        given += " | Law"
    derived = variable.default.startswith("(") and not variable.is_required
    return f"{read} | None" if derived else read, given


def class_of(group: str) -> str:
    """Return the name of a group's class."""
    return "".join(part.title() for part in group.split("_"))


def write_group(entry: namelists.GroupEntry) -> str:
    """Return the classes of a group."""
    name = class_of(entry.name)
    values = [f"    {each.name}: {types(each)[1]} | None" for each in entry.variables.values()]
    variables = [f"    {each.name}: Variable[{types(each)[0]}, {types(each)[1]} | None]"
                 for each in entry.variables.values()]
    text = [f"class {name}Values(TypedDict, total=False):",
            f'    """Values of ``&{entry.name}``."""', "", *values, "", "",
            f"class {name}Group(Group):", f'    """A group ``&{entry.name}``."""', "",
            *variables]
    if not entry.is_repeatable:
        text = text[text.index(f"class {name}Group(Group):"):]
    if entry.is_repeatable:
        text += [
            "", "", f"class {name}Groups(Groups):", f'    """The groups ``&{entry.name}``."""', "",
            "    if TYPE_CHECKING:",
            "        @overload  # type: ignore[override]",
            f"        def __getitem__(self, index: int) -> {name}Group: ...",
            "        @overload",
            f"        def __getitem__(self, index: slice) -> list[{name}Group]: ...",
            "        def __getitem__(self, index: int | slice) -> Any: ...",
            f"        def __iter__(self) -> Iterator[{name}Group]: ...",
            "        def append(  # type: ignore[override]",
            "            self, values: Mapping[str, Any] | None = None,",
            f"            **more: Unpack[{name}Values]) -> None: ..."]
    return "\n".join(text)


def write_case(entries: list[namelists.GroupEntry]) -> str:
    """Return the part of `Case` that names its groups."""
    text = ["class CaseGroups:", '    """The groups of a case."""', "",
            "    title: Variable[str, str]"]
    keywords = []
    for entry in entries:
        name = class_of(entry.name)
        one = "Mapping[str, Any]"
        if entry.is_repeatable:
            given = f"Iterable[{one}] | {one} | None"
            found = f"{name}Groups"
        else:
            given, found = f"{one} | None", f"{name}Group"
        if entry.name == "surface":
            given = f"{given.removesuffix(' | None')} | NDArray[Any] | HasHeights | None"
        text.append(f"    {entry.name}: Variable[{found}, {given}]")
        keywords.append(f"                 {entry.name}: {given} = None")
    signature = ("        def __init__(self, title: str | None = None, *,\n"
                 + ",\n".join(keywords) + ") -> None: ...")
    return "\n".join([*text, "", "    if TYPE_CHECKING:", signature])


def write_groups(entries: list[namelists.GroupEntry]) -> str:
    """Return the module of the groups."""
    topography = ('class HasHeights(Protocol):\n'
                  '    """A topography of SurfaceTopography."""\n\n'
                  "    def heights(self) -> Any: ...")
    head = HEAD.replace("Literal, TypedDict", "Literal, Protocol, TypedDict")
    body = "\n\n\n".join([topography, *map(write_group, entries), write_case(entries)])
    return f"{head}\n\n{body}\n"


COLUMNS_HEAD = '''"""The columns of the history, for type checkers and editors.

Written by `tools/make_types.py` from the program's table of the columns.
"""

# ruff: noqa: E501

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
'''


def write_columns(found: Sequence[Column]) -> str:
    """Return the module of the columns: one value of each in a row, arrays in a history."""
    text = [COLUMNS_HEAD]
    for name, what, whole, real in [
            ("RowColumns", "One row of the history.", "int", "float"),
            ("HistoryColumns", "The history: one value per row.", "NDArray[np.int32]",
             "NDArray[np.float64]")]:
        text += ["", f"class {name}:", f'    """{what}"""', ""]
        text += [f"    {column.name}: {whole if column.is_whole else real}  # {column.long_name}"
                 + ("" if column.units == "1" or column.is_whole else f", {column.units}")
                 for column in found]
        text += [""]
    return "\n".join(text)


def write_page(found: Sequence[Column]) -> str:
    """Return the page on the result file with the table of the columns."""
    rows = [f"| `{column.name}` | {'-' if column.units == '1' else column.units} | "
            f"{column.long_name} |" for column in found]
    before, history = PAGE.read_text().split("## `/history`", 1)
    table = re.compile(r"(?<=\n\| --- \| --- \| --- \|\n)(\| .*\n)*?(?=\| `checksum` )")
    lines = "".join(f"{row}\n" for row in rows)
    return f"{before}## `/history`{table.sub(lambda _: lines, history, count=1)}"


def main() -> int:
    """Write the files, or compare them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true")
    wanted = parser.parse_args()
    texts = {GROUPS: write_groups(list(namelists.table().values())),
             COLUMNS: write_columns(columns()), PAGE: write_page(columns())}
    for path, text in texts.items():
        if not wanted.check:
            path.write_text(text)
    return int(any(path.read_text() != text for path, text in texts.items()))


if __name__ == "__main__":
    sys.exit(main())
