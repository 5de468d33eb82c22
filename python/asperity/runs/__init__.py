"""Runs: cases built, run in this process, and swept side by side."""
