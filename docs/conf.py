"""The documentation as a site: settings of Sphinx, run by tools/make_docs.sh.

The root of the sources is that of the repository, so that the links of the pages are the same here
and wherever Markdown is shown. Pages are found by themselves: ORDER only says where those that it
names stand in the contents; others follow in "More".
"""

import re
from importlib.util import find_spec
from pathlib import Path

from docutils import nodes
from latex2mathml.converter import convert

from asperity._addresses import MODULES

ROOT = Path(__file__).resolve().parents[1]

project = "Asperity"
author = "The Asperity developers"
copyright = "the Asperity developers"
release = version = (ROOT / "VERSION").read_text().strip()

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
include_patterns = ["docs/*.md", "docs/api/*", "examples/*/README.md", "README.md",
                    "CONTRIBUTING.md", "CHANGELOG.md"]
root_doc = "docs/index"
highlight_language = "none"
smartquotes_action = "De"               # dashes; 'none' is a value of the input, quotes included
default_role = "py:obj"
nitpicky = False                        # the words for types in docstrings are for people

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
myst_dmath_allow_digits = False
myst_dmath_allow_space = False

autodoc_member_order = "bysource"
autodoc_typehints = "none"              # the docstrings say more: shapes and units
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False

html_theme = "furo"
html_title = f"Asperity {release}"
# The font of the equations, for browsers on machines without one of their own. Its licence, the SIL
# Open Font License, is in the file.
MATH_FONT = Path(find_spec("ziamath").origin).parent / "fonts" / "STIXTwoMath-Regular.ttf"
html_static_path = ["site.css", str(MATH_FONT)]
html_extra_path = ["../build/fortran"]  # by FORD
html_show_sourcelink = False
html_show_search_summary = False        # browsers fetch no pages where the site is opened as files
html_math_renderer = "mathml"

ORDER = {
    "Start": ["docs/install", "docs/first_run", "docs/model"],
    "Guide": ["docs/choosing", "docs/measured_data", "docs/friction_curves", "docs/sweeps",
              "docs/driving", "docs/long_runs", "docs/clusters", "docs/results",
              "docs/troubleshooting", "docs/coming_from"],
    "Reference": ["docs/input_reference", "docs/result_file", "docs/api/python",
                  "docs/api/python_contact", "docs/api/python_roads", "docs/api/python_rubber",
                  "docs/api/python_runs", "docs/api/python_friction", "docs/api/python_results",
                  "docs/api/python_theory", "docs/api/fortran", "docs/glossary"],
    "Background": ["docs/theory", "docs/validation", "docs/benchmarks"],
    "Examples": ["docs/gallery"],
    "Development": ["docs/developer", "CONTRIBUTING", "CHANGELOG", "README"],
}


def contents() -> dict[str, list[str]]:
    """Return the pages of each part of the contents, without those that are not there."""
    there = {path.relative_to(ROOT).with_suffix("").as_posix()
             for pattern in include_patterns for path in ROOT.glob(pattern)
             if path.suffix in (".md", ".rst")} - {root_doc}
    parts = {title: [name for name in names if name in there] for title, names in ORDER.items()}
    parts["Examples"] += sorted(name for name in there if name.startswith("examples/"))
    named = {name for names in parts.values() for name in names}
    parts["More"] = sorted(there - named)
    return {title: names for title, names in parts.items() if names}


def _add_contents(app, name, source):
    """Append the contents to the first page, where Markdown elsewhere need not show them."""
    if name == root_doc:
        for title, names in contents().items():
            source[0] += (f"\n\n```{{toctree}}\n:hidden:\n:caption: {title}\n\n"
                          + "\n".join(f"/{page}" for page in names) + "\n```\n")


# Modules whose public names are those of the package.
AT_THE_TOP = ("adhesive_contact", "case", "errors", "runner", "sweep_table", "sweeps")


def _add_modules(app, name, source):
    """Append the public modules that no page of the Python interface names."""
    if name != "docs/api/python_results":
        return
    named = "".join(path.read_text() for path in (ROOT / "docs" / "api").glob("*.rst"))
    for address in sorted(MODULES):
        module = f"asperity.{address}"
        if address in AT_THE_TOP or f"automodule:: {module}\n" in named:
            continue
        source[0] += f"\n{module}\n{'-' * len(module)}\n\n.. automodule:: {module}\n   :members:\n"


def _prepare_docstring(app, what, name, thing, options, lines):
    """Keep the bars of |x|, which are no substitutions, and list attributes one by one."""
    kept, example = [], False
    for line in lines:
        example = line.lstrip().startswith(">>>") or (example and line.strip() != "")
        kept.append(line if example or "``" in line else line.replace("|", "\\|"))
    text = "\n".join(kept)

    def split(found):
        return "".join(f"{one} : {found[2]}" for one in found[1].split(", "))

    head, title, rest = text.partition("Attributes\n----------\n")
    if title:
        rest = re.sub(r"(?m)^(\w+(?:, \w+)+) : (.*\n(?: +.*\n?)+)", split, rest)
    lines[:] = (head + title + rest).split("\n")


# A prime is high by itself: it stands beside its letter, not above it once more.
PRIME = "<mi>&#x02032;</mi>"
BESIDE = r'<mrow>\1<mo lspace="0" rspace="0">&#x02032;</mo></mrow>'
PRIMES = ((rf"<msup>(<mi>[^<]*</mi>){PRIME}</msup>", BESIDE),
          (rf"<msubsup>(<mi>[^<]*</mi>)(<mi>[^<]*</mi>|<mrow>(?:(?!</mrow>).)*</mrow>){PRIME}"
           "</msubsup>", rf"<msub>{BESIDE}\2</msub>"))


def _mathml(self, node):
    """Write an equation as MathML, which browsers show without scripts."""
    block = isinstance(node, nodes.math_block)
    math = convert(node.astext(), display="block" if block else "inline")
    math = math.replace("<mo>&#x0002A;</mo>", "<mo>&#x02217;</mo>")         # the star of E*
    for pattern, text in PRIMES:
        math = re.sub(pattern, text, math)
    if block:
        math = f'<div class="math" tabindex="0">{math}</div>'               # long ones scroll
    self.body.append(math)
    raise nodes.SkipNode


def setup(app):
    """Register what is above with Sphinx."""
    app.connect("source-read", _add_contents)
    app.connect("source-read", _add_modules)
    app.connect("autodoc-process-docstring", _prepare_docstring, priority=400)
    app.add_css_file("site.css")
    app.add_html_math_renderer("mathml", (_mathml, None), (_mathml, None))
