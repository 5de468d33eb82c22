#!/usr/bin/env python3
"""Run all benchmarks, one after the other, and print what they print.

    . tools/setup.sh && . tools/install_editable.sh
    python tools/bench/all.py [--tamaas PYTHON] [--slippy PYTHON] [--contact-mechanics PYTHON]

`peers.py` says how to get the other codes; without them the comparisons are left out. The runs take
about an hour on two cores. Each script can be run alone, with options that it explains.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).parent
PEERS = ("tamaas", "slippy", "contact-mechanics")


def main() -> int:
    """Run the scripts; the exit status is the number of those that fail."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for peer in PEERS:
        parser.add_argument(f"--{peer}", metavar="PYTHON", help=f"a Python that has {peer}")
    given = {k.replace("_", "-"): v for k, v in vars(parser.parse_args()).items() if v}
    tamaas = ["--tamaas", given["tamaas"]] if "tamaas" in given else []
    commands = [
        ["counts.py"],
        ["normal.py"],
        ["peers.py", *(word for peer in given for word in (f"--{peer}", given[peer]))],
        ["adhesion.py", *tamaas],
        ["friction.py"],
        ["steps.py"],
        ["steady.py"],
        ["memory.py"],
        ["steady_memory.py"],
    ]
    failures = 0
    for script, *options in commands:
        print(f"\n== {script} ==", flush=True)
        done = subprocess.run([sys.executable, str(FOLDER / script), *options], check=False)
        failures += done.returncode != 0
    return failures


if __name__ == "__main__":
    sys.exit(main())
