"""The verbs of ``python -m asperity``."""
