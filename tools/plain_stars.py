"""For FORD: stars in comments are stars, as in E* and T*, not emphasis (a Markdown extension).

The names of its method and function are those that Markdown calls.
"""

from markdown.extensions import Extension


class PlainStars(Extension):
    """Markdown without emphasis by stars."""

    def extendMarkdown(self, md):  # noqa: N802
        """Take the pattern out."""
        md.inlinePatterns.deregister("em_strong")


def makeExtension(**options):  # noqa: N802
    """Return the extension, as Markdown asks for it."""
    return PlainStars(**options)
