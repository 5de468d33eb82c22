"""Views of data: pictures, pages, tables for notebooks, the live view, files for other programs."""
