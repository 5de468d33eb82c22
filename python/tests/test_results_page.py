"""The commands and snippets of the page on looking at results are run."""

import os
import re
import subprocess
import sys
from pathlib import Path

import matplotlib.pyplot as plt
from conftest import PATIENCE, ROOT

PAGE = (ROOT / "docs" / "results.md").read_text()


def blocks(language):
    """Return the fenced blocks of a language."""
    return re.findall(rf"```{language}\n(.*?)```", PAGE, flags=re.DOTALL)


def test_commands_of_the_page(program, road):
    commands = blocks("sh")
    assert len(commands) == 3
    path = os.pathsep.join([str(Path(program).parent), str(Path(sys.executable).parent),
                            os.environ["PATH"]])
    printed = ""
    for block in commands:
        done = subprocess.run(["sh", "-ec", block], cwd=road, capture_output=True, text=True,
                              check=False, timeout=PATIENCE, env={**os.environ, "PATH": path})
        assert done.returncode == 0, done.stderr
        printed += done.stdout
    for name in ("road.png", "friction.pdf", "contact.png", "report.html"):
        assert (road / name).stat().st_size > 5000
        assert f"wrote {name}" in printed
    assert "finished, 65 of 65 rows" in printed


def test_snippets_of_the_page(road, monkeypatch, capsys):
    monkeypatch.chdir(road)
    names = {}
    for snippet in blocks("python"):
        exec(compile(snippet, "results.md", "exec"), names)
    plt.close("all")
    friction, pressure = capsys.readouterr().out.splitlines()
    whole, part = map(float, re.findall(r"\d+\.\d+", friction))
    assert 0.45 < part < whole < 0.65  # the coefficient 0.5, and the loss
    assert pressure.endswith(" Pa") and float(pressure.split()[0]) > 1e6
    rows = (road / "road.csv").read_text().splitlines()
    assert len(rows) == 66 and "friction" in rows[0]
    for name in ("overview.pdf", "energy.png", "road.vti"):
        assert (road / name).stat().st_size > 5000


def test_every_verb_of_looking_is_on_the_page(capsys):
    for verb in ("plot", "report", "watch"):
        assert f"asperity {verb} " in PAGE
