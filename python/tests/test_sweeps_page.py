"""The snippets of the page on cases and sweeps run, and the page is right about them."""

import re

import numpy as np
from conftest import ROOT

PAGE = (ROOT / "docs" / "sweeps.md").read_text()


def test_snippets(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    case, sweep, measure = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    names = {}
    exec(compile(case, "sweeps.md", "exec"), names)
    printed = capsys.readouterr().out
    assert printed.startswith("&case") and "2 phases" in printed
    friction = float(printed.splitlines()[-1])
    assert 0 < friction < 1
    assert (tmp_path / "wave.h5").exists()
    exec(compile(sweep, "sweeps.md", "exec"), names)
    table = names["table"]
    assert names["friction"].shape == (4, 2)
    assert len(list((tmp_path / "wave_sweep").glob("*.h5"))) == 8
    row = int(np.flatnonzero((table["phase[2].velocity_x"] == 0.1)
                             & (table["material.shear_modulus"] == 1e6))[0])
    assert table.friction[row] == friction
    stamps = [path.stat().st_mtime_ns for path in table.paths]
    exec(compile(measure, "sweeps.md", "exec"), names)
    assert [path.stat().st_mtime_ns for path in names["table"].paths] == stamps
    assert names["table"].results == ("friction", "peak")
    assert (names["table"].peak > 10e3).all()
