"""The commands, the snippet and the cluster jobs of the page on long runs do what it says."""

import os
import re
import signal
import subprocess
import time
from pathlib import Path

import pytest
from conftest import ROOT

import asperity

PAGE = (ROOT / "docs" / "long_runs.md").read_text()
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", PAGE, flags=re.DOTALL)


@pytest.fixture
def shell(program, tmp_path, monkeypatch):
    """Return the environment of a node with the program, in a separate folder."""
    monkeypatch.chdir(tmp_path)
    scontrol = tmp_path / "scontrol"
    scontrol.write_text('#!/bin/sh\necho "$@" >requeued\n')
    scontrol.chmod(0o755)
    monkeypatch.setenv("PATH", os.pathsep.join(
        [str(Path(program).parent), str(tmp_path), os.environ["PATH"]]))
    for name, value in (("CPUS_PER_TASK", "1"), ("JOB_ID", "17"), ("ARRAY_TASK_ID", "2")):
        monkeypatch.setenv(f"SLURM_{name}", value)


def stop_after(process, result, rows):
    """Send SIGTERM after a run has written some rows, and return the exit status."""
    for _ in range(2000):
        if result.exists():
            try:
                if len(asperity.open(result).history["step"]) >= rows:
                    break
            except OSError:
                pass
        assert process.poll() is None
        time.sleep(0.005)
    process.send_signal(signal.SIGTERM)
    return process.wait(60)


def test_page(shell):
    before, twice, job, snippet, array = (text for _, text in BLOCKS)
    done = subprocess.run(["sh", "-euc", before], capture_output=True, text=True)
    assert done.returncode == 0 and "time steps" in done.stdout and "memory" in done.stdout

    small = Path("friction.nml").read_text()
    for old, new in (("nx = 64", "nx = 32"), ("ny = 37", "ny = 19")):      # a quarter of the time
        assert old in small
        small = small.replace(old, new)
    Path("friction.nml").write_text(small)
    first, again = (line.split("#")[0].split() for line in twice.strip().splitlines())
    status = stop_after(subprocess.Popen([*first, "--quiet"], stderr=subprocess.DEVNULL),
                        Path("friction.h5"), 10)
    assert status == 143 and Path("friction.checkpoint.h5").exists()
    done = subprocess.run([*again, "--quiet"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    whole = asperity.open("friction.h5")
    assert whole.finished and not Path("friction.checkpoint.h5").exists()
    done = subprocess.run(again, capture_output=True, text=True)
    assert done.returncode == 3 and "the run is complete" in done.stderr

    Path("road.nml").write_text(small)
    Path("job.sh").write_text(job)
    status = stop_after(subprocess.Popen(["bash", "job.sh"], stderr=subprocess.DEVNULL),
                        Path("road.h5"), 10)
    assert status == 143 and Path("requeued").read_text() == "requeue 17\n"
    Path("requeued").unlink()
    done = subprocess.run(["bash", "job.sh"], capture_output=True, text=True)
    assert done.returncode == 0 and not Path("requeued").exists(), done.stderr
    assert (asperity.open("road.h5").history["friction"] == whole.history["friction"]).all()

    exec(compile(snippet, "long_runs.md", "exec"), {})
    assert len(list(Path().glob("case_*.nml"))) == 4
    Path("array.sh").write_text(array)
    subprocess.run(["bash", "array.sh"], check=True)
    assert asperity.open("case_2.h5").finished
