"""Write the files that follow from the tables of the program: the input, the history, the fields.

    python tools/make_types.py            writes the files
    python tools/make_types.py --check    ends with status 1 if they are not what they should be

| table | files |
| --- | --- |
| the columns of the history, in `src/io/history_row.f90` | `src/io/history_list.f90`, the list of \
the columns; `python/asperity/results/column_types.py`; the table in `docs/result_file.md` |
| the fields of a snapshot, in `src/io/snapshot_fields.f90` | \
`python/asperity/results/field_types.py`; the table in `docs/result_file.md` |
| the input, in `src/input/input_reference.f90` | `python/asperity/runs/group_types.py` |

The Fortran list is written first: importing the package then builds the library with it.
"""


from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from asperity.runs import namelists
    from asperity.runs.row import Column, Field

ROOT = Path(__file__).resolve().parent.parent
GROUPS = ROOT / "python/asperity/runs/group_types.py"
COLUMNS = ROOT / "python/asperity/results/column_types.py"
FIELDS = ROOT / "python/asperity/results/field_types.py"
ROW = ROOT / "src/io/history_row.f90"
LIST = ROOT / "src/io/history_list.f90"
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


FIELDS_HEAD = '''"""The names of the fields that a snapshot may contain.

Written by `tools/make_types.py` from the program's table of the fields.
"""
'''


def write_fields(found: Sequence[Field]) -> str:
    """Return the module of the fields: those of every case, and those of friction."""
    text = FIELDS_HEAD
    for name, frictional in [("NORMAL_FIELDS", False), ("TANGENTIAL_FIELDS", True)]:
        lines = "".join(f'    "{field.name}",\n' for field in found
                        if field.is_frictional == frictional)
        text += f"\n{name} = (\n{lines})\n"
    return text


def write_page(found: Sequence[Column], fields: Sequence[Field]) -> str:
    """Return the page on the result file with the tables of the columns and of the fields."""
    page = PAGE.read_text()
    for head, entries, first_kept in [("## `/history`", found, "checksum"),
                                      ("## `/snapshots/NNNNNN`", fields, "x")]:
        lines = "".join(f"| `{entry.name}` | {'-' if entry.units == '1' else entry.units} | "
                        f"{entry.long_name} |\n" for entry in entries)
        before, behind = page.split(f"{head}\n", 1)
        table = re.compile(rf"(?<=\n\| --- \| --- \| --- \|\n)(\| .*\n)*?(?=\| `{first_kept}` )")
        page = f"{before}{head}\n{table.sub(lambda _: lines, behind, count=1)}"  # noqa: B023
    return page


class Component(NamedTuple):
    """A component of `history_row_type`: its name, its units ('' for an integer), its meaning."""

    name: str
    units: str
    meaning: str


def read_components(source: str) -> list[tuple[str, list[Component]]]:
    """Return the sections of `history_row_type`: the comment before each, and its components."""
    body = source.split("type :: history_row_type\n", 1)[1].split("end type", 1)[0]
    sections: list[tuple[str, list[Component]]] = []
    for line in filter(None, map(str.strip, body.splitlines())):
        if line.startswith("! "):
            sections.append((line[2:], []))
            continue
        found = re.fullmatch(
            r"(?:integer|(real\(dp\))) :: (\w+) = \S+ +!! (?:\[(\S+)\] )?(.+)", line)
        if not found or bool(found[1]) != bool(found[3]):
            sys.exit(f"{ROW}: must be 'real(dp) :: name = 0.0_dp !! [units] meaning' or "
                     f"'integer :: name = 0 !! meaning': {line}")
        if len(found[4]) > 80:
            sys.exit(f"{ROW}: the meaning has more than 80 characters: {line}")
        sections[-1][1].append(Component(found[2], found[3] or "", found[4]))
    return sections


def write_list(source: str) -> str:
    """Return the module that lists the columns, from the module of the row."""
    sections = read_components(source)
    text = [LIST_HEAD]
    names = [f"list_section_{number}" for number in range(1, len(sections) + 1)]
    text += [f"      call {name}(row, table, prefix)" for name in names]
    text += ["   end subroutine list_columns", ""]
    for name, (title, components) in zip(names, sections, strict=True):
        text += [f"   !> {title}", f"   subroutine {name}(row, table, prefix)", LIST_ARGUMENTS]
        for column in components:
            units = f"'{column.units}', " if column.units else ""
            meaning = column.meaning.replace("'", "''")
            line = f"      call table%add(prefix//'{column.name}', row%{column.name}, {units}"
            if len(line) + len(meaning) + 3 > 100:
                text += [f"{line}&", f"         '{meaning}')"]
            else:
                text += [f"{line}'{meaning}')"]
        text += [f"   end subroutine {name}", ""]
    return "\n".join([*text, "end module history_list", ""])


LIST_ARGUMENTS = """      type(history_row_type), intent(in), target :: row
      type(state_table_type), intent(inout) :: table
      character(*), intent(in) :: prefix
"""

LIST_HEAD = """!> The list of the columns of the history: name, units, meaning and variable of each.
!>
!> `python tools/make_types.py` writes this module from the declarations in module `history_row`.
module history_list
   use history_row, only : history_row_type
   use state_table, only : state_table_type
   implicit none
   private

   public :: list_columns

contains

   !> List all columns.
   subroutine list_columns(row, table, prefix)
      type(history_row_type), intent(in), target :: row
      type(state_table_type), intent(inout) :: table
      character(*), intent(in) :: prefix           !! of all names
"""


def settle(texts: dict[Path, str], check: bool) -> bool:
    """Write files, unless they are only to be checked; return whether all have their texts."""
    for path, text in texts.items():
        if not check and (not path.exists() or path.read_text() != text):
            path.write_text(text)
    return all(path.exists() and path.read_text() == text for path, text in texts.items())


def main() -> int:
    """Write the files, or compare them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true")
    wanted = parser.parse_args()
    good = settle({LIST: write_list(ROW.read_text())}, wanted.check)

    from asperity.runs import namelists
    from asperity.runs.row import columns, fields

    texts = {GROUPS: write_groups(list(namelists.table().values())),
             COLUMNS: write_columns(columns()), FIELDS: write_fields(fields()),
             PAGE: write_page(columns(), fields())}
    return int(not settle(texts, wanted.check) or not good)


if __name__ == "__main__":
    sys.exit(main())
