"""Check that every link, picture and anchor of a built site leads somewhere, without a network.

    python tools/check_site.py build/site

The exit status is 1, with one line per fault, if something is missing or if a page loads a script,
a style or a picture from the network. Links to other sites are not followed. Only the files of
FORD's pages are checked, because FORD lacks some anchors for generic interfaces.
"""

import sys
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class _Page(HTMLParser):
    """The anchors and links of a page, and what it fetches from elsewhere."""

    def __init__(self):
        super().__init__()
        self.anchors, self.links, self.fetched = set(), [], []

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        for name in ("id", "name"):
            if name == "id" or tag == "a":
                self.anchors.add(values.get(name))
        for name in ("href", "src"):
            if values.get(name):
                self.links.append(values[name])
                if tag in ("script", "link", "img", "iframe") and urlsplit(values[name]).netloc:
                    self.fetched.append(values[name])


@cache
def _read(path):
    page = _Page()
    page.feed(path.read_text(encoding="utf-8"))
    return page


def broken_links(folder):
    """Return the broken links of all pages below a folder, a text each."""
    found = []
    for path in sorted(folder.rglob("*.html")):
        found += [f"{path.relative_to(folder)}: fetches {link}" for link in _read(path).fetched]
        for link in _read(path).links:
            target = urlsplit(link)
            if target.scheme or target.netloc:
                continue
            there = (path.parent / unquote(target.path)).resolve() if target.path else path
            if there.is_dir():
                there /= "index.html"
            if not there.is_file():
                found.append(f"{path.relative_to(folder)}: {link}: no such file")
            elif target.fragment and there.suffix == ".html" and "fortran" not in path.parts and (
                    unquote(target.fragment) not in _read(there).anchors):
                found.append(f"{path.relative_to(folder)}: {link}: no such anchor")
    return found


def main():
    """Check the folder named on the command line."""
    folder = Path(sys.argv[1]).resolve()
    pages = len(list(folder.rglob("*.html")))
    messages = sorted(set(broken_links(folder)))
    print("\n".join(messages[:100]))
    if messages or not pages:
        print(f"{folder}: {len(messages)} broken links in {pages} pages", file=sys.stderr)
    return 1 if messages or not pages else 0


if __name__ == "__main__":
    sys.exit(main())
