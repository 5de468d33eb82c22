"""Rubber: relaxation functions, and their fit to measurements."""
