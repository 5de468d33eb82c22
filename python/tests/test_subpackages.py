"""The subpackages of the package import in one direction, and public module names stay the same."""

import ast
import importlib
import subprocess
import sys
import time

import pytest
from conftest import ROOT

import asperity

PACKAGE = ROOT / "python" / "asperity"
# From the bottom up: a subpackage may use those before it in the list.
FLOORS = ("base", "roads", "rubber", "contact", "results", "theory", "views", "runs", "curves",
          "commands")
ADDRESSES = ("adhesive_contact", "case", "contact", "dma", "errors", "export", "material",
             "measured", "plot", "plot_fields", "report", "report_data", "result", "runner",
             "surface", "sweep_table", "sweeps", "theory", "watch")


def name_of(path):
    """Return the name of a module within the package; '' stands for the package itself."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {name_of(path): path for path in sorted(PACKAGE.rglob("*.py"))}


def imported(name, path):
    """Return the modules of the package that a file imports, also within functions."""
    folder = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    folder = [part for part in folder if part]
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found.update(item.name.removeprefix("asperity").lstrip(".") for item in node.names
                         if item.name.split(".")[0] == "asperity")
        elif isinstance(node, ast.ImportFrom) and node.level:
            above = folder[: len(folder) - node.level + 1]
            base = ".".join([*above, *(node.module or "").split(".")]).strip(".")
            for item in node.names:
                inner = f"{base}.{item.name}".strip(".")
                found.add(inner if inner in MODULES else base)
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "asperity":
            found.add(node.module.removeprefix("asperity").lstrip("."))
    return {one for one in found if one in MODULES and one != name}


GRAPH = {name: imported(name, path) for name, path in MODULES.items()}


def circle_in(graph):
    """Return modules that import each other in a circle, or [] if there are none."""
    done, way = set(), []

    def visit(name):
        if name in way:
            return [*way[way.index(name):], name]
        if name in done:
            return []
        way.append(name)
        for other in sorted(graph[name]):
            if found := visit(other):
                return found
        done.add(way.pop())
        return []

    for name in sorted(graph):
        if found := visit(name):
            return found
    return []


def test_the_search_finds_a_circle():
    assert circle_in({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": set()}) == ["a", "b", "c", "a"]
    assert circle_in({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []
    assert {"results.result_file", "base.presenters"} <= GRAPH["results.run"]


def test_no_circle_between_files():
    # The package itself imports its subpackages, but an import of the package makes no circle.
    assert circle_in({name: others - {""} for name, others in GRAPH.items()}) == []


@pytest.mark.parametrize("subpackage", FLOORS)
def test_subpackages_use_only_those_below_them(subpackage):
    allowed = {*FLOORS[: FLOORS.index(subpackage) + 1], ""}
    for name, others in GRAPH.items():
        if name.split(".")[0] == subpackage:
            above = {other for other in others if other.split(".")[0] not in allowed}
            assert not above, f"{name} imports {', '.join(sorted(above))}"


def test_every_module_is_in_a_subpackage():
    flat = {path.name for path in PACKAGE.glob("*.py")}
    assert flat == {"__init__.py", "__main__.py", "_addresses.py"}
    assert {name.split(".")[0] for name in MODULES} - {"", "__main__", "_addresses"} == set(FLOORS)


def test_modules_of_data_do_not_import_drawing():
    for name, path in MODULES.items():
        if name.split(".")[0] in ("base", "roads", "rubber", "contact", "results", "theory"):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.Import):
                    assert not any("matplotlib" in item.name for item in node.names), name


def test_functions_are_short():
    for name, path in MODULES.items():
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef):
                first = node.body[0]
                words = first.end_lineno - first.lineno + 1 if ast.get_docstring(node) else 0
                lines = node.end_lineno - node.lineno + 1 - words
                assert lines <= 60, f"{name}: {node.name} has {lines} lines"


@pytest.mark.parametrize("address", ADDRESSES)
def test_public_modules_have_their_names(address):
    module = importlib.import_module(f"asperity.{address}")
    assert getattr(asperity, address) is module
    assert sys.modules[module.__name__] is module
    assert module.__spec__.name == module.__name__
    assert module.__all__


def test_public_modules_are_imported_by_name():
    code = "\n".join(f"import asperity.{address} as m; print(m.__name__)" for address in ADDRESSES)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [importlib.import_module(f"asperity.{address}").__name__
                                   for address in ADDRESSES]


def test_public_names_are_there():
    for name in ("AdhesiveNormalContact", "Case", "NormalContact", "NotConverged", "Run", "Sweep",
                 "SweepError", "__version__", "dma", "friction_curve", "material", "open", "run",
                 "set_threads", "solve_adhesive", "solve_normal", "surface", "sweep", "theory"):
        assert name in asperity.__all__ and name in dir(asperity)
        assert getattr(asperity, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        asperity.nothing  # noqa: B018
    with pytest.raises(ModuleNotFoundError, match="nothing"):
        importlib.import_module("asperity.nothing")


def test_import_is_quick():
    def seconds(code):
        start = time.perf_counter()
        subprocess.run([sys.executable, "-c", code], check=True)
        return time.perf_counter() - start

    # the shortest of several tries, because other processes can only add to the time
    assert min(seconds("import asperity") - seconds("pass") for _ in range(5)) <= 0.3
    done = subprocess.run(
        [sys.executable, "-c", "import sys, asperity;"
         " print([name for name in ('numpy', 'h5py', 'scipy', 'matplotlib') if name in"
         " sys.modules])"], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
