"""Make FORD's pages independent of the network by adding the files that they load from it.

    python tools/localize_ford.py build/fortran/fortran

Bootstrap, with which the pages are laid out, is that of the Python package mkdocs (MIT licence).
MathJax is left out, because the comments of the sources contain no TeX. Wide tables scroll on small
screens. tools/check_site.py finds pages that still load something from the network.
"""

import re
import shutil
import sys
from importlib.util import find_spec
from pathlib import Path

BOOTSTRAP = ("css/bootstrap.min.css", "js/bootstrap.bundle.min.js")
MATHJAX = re.compile(r'<!-- MathJax -->.*?</script>\s*<script[^>]*MathJax\.js.*?</script>', re.S)
STYLE = ("<style>@media (max-width: 50em) { table { display: block; overflow-x: auto } }"
         "</style>\n")


def localize(page, root):
    """Return the text of a page whose addresses are below the folder root."""
    text = MATHJAX.sub("", page.read_text(encoding="utf-8"))
    here = "../" * (len(page.relative_to(root).parts) - 1) or "./"
    for name in BOOTSTRAP:
        file = re.escape(name.rsplit("/", 1)[1])
        text = re.sub(rf'"https://[^"]*/{file}"', f'"{here}{name}"', text)
    text = re.sub(r'\s+(?:integrity|crossorigin)="[^"]*"', "", text)
    return text.replace("</head>", f"{STYLE}</head>", 1)


def main(folder):
    """Change all pages of a folder."""
    root = Path(folder)
    theme = Path(find_spec("mkdocs").origin).parent / "themes" / "mkdocs"
    for name in BOOTSTRAP:
        (root / name).parent.mkdir(exist_ok=True)
        shutil.copy(theme / name, root / name)
    for page in sorted(root.rglob("*.html")):
        page.write_text(localize(page, root), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
