"""Markdown extension for FORD, with which stars in comments, as in E* and T*, are not emphasis.

Markdown calls the method and the function by their names.
"""

from markdown.extensions import Extension


class PlainStars(Extension):
    """Markdown without emphasis by stars."""

    def extendMarkdown(self, md):  # noqa: N802
        """Remove the pattern of emphasis."""
        md.inlinePatterns.deregister("em_strong")


def makeExtension(**options):  # noqa: N802
    """Return the extension for Markdown."""
    return PlainStars(**options)
