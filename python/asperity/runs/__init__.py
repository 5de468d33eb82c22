"""Runs: cases as objects, runs in this process, and sweeps of many runs side by side."""
