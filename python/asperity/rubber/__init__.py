"""Rubber: relaxation functions, and how measurements become one."""
