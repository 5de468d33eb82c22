"""Where the public names of the package live, and the addresses by which users import them.

Modules are grouped in subpackages, such as ``asperity.roads.surface``, but users write the shorter
address ``asperity.surface``. Both names give the same module. Nothing is imported before it is
used.
"""

from __future__ import annotations

import importlib
import importlib.abc
import importlib.machinery
import sys
from collections.abc import Sequence
from types import ModuleType
from typing import Any

__all__ = ["MODULES", "NAMES", "PRESENTERS", "install"]

#: Modules by the address that users know; the value is the place in the package.
MODULES = {
    "adhesive_contact": "contact.adhesive",
    "case": "runs.case",
    "dma": "rubber.dma",
    "errors": "base.errors",
    "export": "views.export",
    "material": "rubber.material",
    "measured": "roads.measured",
    "operators": "contact.operators",
    "plot": "views.plot",
    "plot_fields": "views.plot_fields",
    "report": "views.report",
    "report_data": "views.report_data",
    "result": "results",
    "runner": "runs.runner",
    "surface": "roads.surface",
    "sweep_table": "runs.sweep_table",
    "sweeps": "runs.sweeps",
    "watch": "views.watch",
}

#: Public names of the package: the module that has each, and its name there.
NAMES = {
    "AdhesiveNormalContact": ("contact.adhesive", "AdhesiveNormalContact"),
    "Case": ("runs.case", "Case"),
    "NormalContact": ("contact.normal", "NormalContact"),
    "NotConverged": ("base.errors", "NotConverged"),
    "Run": ("results", "Run"),
    "Simulation": ("runs.simulation", "Simulation"),
    "Sweep": ("runs.sweep_table", "Sweep"),
    "SweepError": ("runs.sweep_table", "SweepError"),
    "friction_curve": ("curves", "friction_curve"),
    "open": ("results", "open_result"),
    "run": ("runs.runner", "run"),
    "set_threads": ("base.library", "set_threads"),
    "solve_adhesive": ("contact.adhesive", "solve_adhesive"),
    "solve_normal": ("contact.normal", "solve_normal"),
    "sweep": ("runs.sweeps", "sweep"),
}

#: Functions that draw, write or show data, by name; see `asperity.base.presenters`.
PRESENTERS = {
    "case_html": "views.html",
    "contact_html": "views.html",
    "fit_html": "views.html",
    "history_html": "views.html",
    "road_html": "views.html",
    "plot_dma_fit": "views.plot_material",
    "plot_field": "views.plot_fields",
    "plot_friction_curve": "views.plot_curve",
    "plot_history": "views.plot_history",
    "plot_overview": "views.plot_overview",
    "plot_prony": "views.plot_material",
    "run_html": "views.html",
    "run_to_xarray": "views.export",
    "snapshot_html": "views.html",
    "table_html": "views.html",
    "to_vtk": "views.export",
    "to_xarray": "views.export",
    "write_curve_page": "views.curve_page",
    "write_report": "views.report",
}


class _Loader(importlib.abc.Loader):
    """Loads a module of a subpackage under its public name, `asperity.<module>`."""

    def __init__(self, place: str) -> None:
        self._place = place

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> ModuleType:
        """Return the module of the subpackage; `exec_module` restores its own specification."""
        module = importlib.import_module(self._place)
        self._own = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Undo what the import system wrote into the module, which has already been executed."""
        module.__spec__ = self._own
        module.__loader__ = self._own.loader if self._own else None


class _Finder(importlib.abc.MetaPathFinder):
    """Finds the addresses of `MODULES`."""

    def __init__(self, package: str) -> None:
        self._package = package

    def find_spec(self, fullname: str, path: Sequence[str] | None = None,
                  target: ModuleType | None = None) -> importlib.machinery.ModuleSpec | None:
        """Return how to import an address, or None for any other name."""
        package, _, name = fullname.rpartition(".")
        if package != self._package or name not in MODULES:
            return None
        place = f"{package}.{MODULES[name]}"
        return importlib.machinery.ModuleSpec(fullname, _Loader(place))


def install(package: str) -> None:
    """Let the import system find the addresses in the package.

    Parameters
    ----------
    package : str
        Name of the package, 'asperity'.
    """
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Finder(package))


def find(package: str, name: str) -> Any:
    """Return a public name of the package: a function, a class or a module.

    Parameters
    ----------
    package : str
        Name of the package.
    name : str
        The public name.

    Raises
    ------
    AttributeError
        If the package has no such name.
    """
    if name in NAMES:
        module, own = NAMES[name]
        return getattr(importlib.import_module(f".{module}", package), own)
    if name in MODULES:
        return importlib.import_module(f".{name}", package)
    try:
        return importlib.import_module(f".{name}", package)  # a subpackage, or `theory`
    except ModuleNotFoundError as error:
        if error.name != f"{package}.{name}":
            raise
    raise AttributeError(f"module {package!r} has no attribute {name!r}")
