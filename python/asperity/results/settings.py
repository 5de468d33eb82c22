"""The settings of a run, which its result file stores as the text of an input.

The program writes the settings that it has resolved, with all defaults, into the attribute
`settings` of the file. A file of an old version holds only the input of the user. Both are read by
`settings_of`, and nothing else in the package looks into the text. The checking reader of the
Fortran library is not used: it refuses a variable that the present version no longer knows, and
the modules of this folder read results without that library.
"""

from __future__ import annotations

import functools
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .result_file import ResultFile

__all__ = ["SettingsGroup", "has_adhesion", "has_friction", "has_rough_road", "is_elastic",
           "load_of_phases", "parse_settings", "phase_names", "setting", "settings_of",
           "solver_setting", "steady_phases"]

# The tokens of `namelist_tokens` in the Fortran library. A string ends on its line, and two quotes
# in it stand for one.
_TOKEN = re.compile(r"""
      !(?P<comment>[^\n]*)
    | (?P<line>\n)
    | (?P<string>'(?:[^'\n]|'')*' | "(?:[^"\n]|"")*")
    | (?P<equals>=)
    | (?P<close>/ | [&$]end\b)
    | [&$](?P<open>\w+)
    | (?P<index>\([^)\n]*\))
    | (?P<word>[^\s,=/!'"()]+)
    """, re.IGNORECASE | re.VERBOSE)


@dataclass
class SettingsGroup:
    """A group of the settings.

    Attributes
    ----------
    name : str
        Its name in lower case.
    values : dict
        The values of each variable as texts, without quotes.
    notes : dict
        The comment in the line of each variable that has one, such as its unit.
    """

    name: str
    values: dict[str, list[str]] = field(default_factory=dict)
    notes: dict[str, str] = field(default_factory=dict)

    def first(self, name: str) -> str | None:
        """Return the first value of a variable, or None if the group does not set it."""
        values = self.values.get(name)
        return values[0] if values else None


@functools.lru_cache(maxsize=64)
def parse_settings(text: str) -> tuple[SettingsGroup, ...]:
    """Return the groups of an input in their order. Nothing is checked.

    Parameters
    ----------
    text : str
        The text of the input.

    Returns
    -------
    tuple of SettingsGroup
        The groups; text outside of them is skipped.

    Examples
    --------
    >>> grid, phase = parse_settings('''&grid nx = 16, lx = 1. /
    ... &phase
    ...   name = 'up & down / 1'
    ...   pressure = 2e5  ! Pa
    ... /''')
    >>> grid.values, phase.values["name"], phase.notes
    ({'nx': ['16'], 'lx': ['1.']}, ['up & down / 1'], {'pressure': 'Pa'})
    """
    groups: list[SettingsGroup] = []
    group: SettingsGroup | None = None
    variable = ""  # to which values belong, and the comment if it stands in the same line
    word = ""  # the last word, which is a value unless `=` follows
    noted = ""
    for token in _TOKEN.finditer(text):
        kind, found = str(token.lastgroup), token[0]
        if kind == "open":
            group, variable, word = SettingsGroup(found[1:].lower()), "", ""
            groups.append(group)
        elif group is None or kind == "index":
            continue
        elif kind == "equals":
            variable, word = word.lower(), ""
            group.values[variable] = []
            noted = variable
        elif kind == "comment":
            if noted:
                group.notes[noted] = found[1:].strip()
        elif kind == "line":
            noted = ""
        else:
            if word and variable:
                group.values[variable].append(word)
            word = found if kind == "word" else ""
            if kind == "string" and variable:
                quote = found[0]
                group.values[variable].append(found[1:-1].replace(2 * quote, quote))
            elif kind == "close":
                group = None
    return tuple(groups)


def settings_of(run: ResultFile) -> tuple[SettingsGroup, ...]:
    """Return the groups of the resolved settings or, of a file without them, of the input.

    Parameters
    ----------
    run : ResultFile
        The result.

    Returns
    -------
    tuple of SettingsGroup
        The groups in their order.
    """
    return parse_settings(str(run.attributes.get("settings", "") or run.input))


def setting(run: ResultFile, group: str, name: str) -> str | None:
    """Return a setting of the run as text, without quotes.

    Parameters
    ----------
    run : ResultFile
        The result.
    group, name : str
        Group and variable of the input.

    Returns
    -------
    str or None
        The value in the first group of this name that sets the variable; of a list, the first one.
        None if there is no value.
    """
    values = (each.first(name) for each in settings_of(run) if each.name == group)
    return next((value for value in values if value is not None), None)


def solver_setting(run: ResultFile, name: str) -> float | None:
    """Return a number of the group `&solver`, such as its tolerance, or None if it is missing."""
    text = setting(run, "solver", name)
    try:
        return None if text is None else float(text.lower().replace("d", "e"))
    except ValueError:
        return None


def phase_names(run: ResultFile) -> list[str]:
    """Return the names of the phases; a phase without a name has ''."""
    return [group.first("name") or "" for group in settings_of(run) if group.name == "phase"]


def load_of_phases(run: ResultFile) -> list[str]:
    """Return what each phase prescribes: 'pressure', 'force' or 'displacement'; '' if unknown."""
    return [(group.first("control") or "").lower()
            for group in settings_of(run) if group.name == "phase"]


def steady_phases(run: ResultFile) -> list[int]:
    """Return the numbers, from 1, of the phases that begin with a state of steady sliding."""
    phases = [group for group in settings_of(run) if group.name == "phase"]
    return [number for number, phase in enumerate(phases, 1)
            if (phase.first("steady") or "").lower().lstrip(".").startswith("t")]


def has_friction(run: ResultFile) -> bool:
    """Return whether the interface of the run has friction."""
    law = setting(run, "friction", "law")
    if law is not None:
        return law.lower() != "none"
    columns = [run.history[name] for name in ("stick_area", "dissipated_friction", "traction_x")
               if name in run.history]
    return any(bool(column.any()) for column in columns)


def has_adhesion(run: ResultFile) -> bool:
    """Return whether the run has adhesion."""
    potential = setting(run, "adhesion", "potential")
    if potential is not None:
        return potential.lower() != "none"
    return "energy_adhesive" in run.history and bool(run.history["energy_adhesive"].any())


def has_rough_road(run: ResultFile) -> bool:
    """Return whether the road is self-affine or a height map from a file."""
    return any((group.first("shape") or "").lower() in ("self_affine", "file")
               for group in settings_of(run) if group.name == "surface")


def is_elastic(run: ResultFile) -> bool:
    """Return whether the material is elastic, that is, has no arms."""
    arms = run.material.get("prony_g")
    return ("shear_modulus" in run.material and "poisson" in run.material
            and (arms is None or not arms.any()))
