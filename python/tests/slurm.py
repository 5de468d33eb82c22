"""A Slurm of one node on this machine, which a test starts and ends.

It needs Debian's packages slurm-wlm and munge, and runs as root without systemd.
"""

import os
import secrets
import shutil
import socket
import subprocess
import tempfile
import time
from pathlib import Path

from conftest import PATIENCE

_DAEMONS = ("munged", "slurmctld", "slurmd")


def _daemon(name):
    """Return the path of a daemon, which may be in a folder that a user's PATH lacks."""
    return shutil.which(name, path=f"{os.environ.get('PATH', '')}:/usr/sbin:/usr/local/sbin")


HAS_SLURM = (all(map(_daemon, _DAEMONS)) and shutil.which("sbatch") is not None
             and hasattr(os, "geteuid") and os.geteuid() == 0)

_SETTINGS = """\
ClusterName=here
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.sock
CredType=cred/munge
MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
ReturnToService=2
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
SlurmdSpoolDir={folder}/spool
StateSaveLocation={folder}/state
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
SwitchType=switch/none
SchedulerType=sched/builtin
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} State=UNKNOWN
PartitionName=short Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


class Slurm:
    """A running Slurm, for use in a `with` statement, which also sets SLURM_CONF."""

    def __enter__(self):
        # Not in pytest's folder: the path of a socket may have about a hundred characters only.
        self.folder = Path(tempfile.mkdtemp(prefix="slurm-"))
        self.processes = []
        try:
            self._begin()
        except BaseException:
            self.__exit__()
            raise
        return self

    def _begin(self):
        key = self.folder / "munge.key"
        key.write_bytes(secrets.token_bytes(1024))
        key.chmod(0o400)
        for name in ("spool", "state"):
            (self.folder / name).mkdir()
        settings = self.folder / "slurm.conf"
        settings.write_text(_SETTINGS.format(
            host=socket.gethostname().partition(".")[0], folder=self.folder, ports=_free_ports(2),
            cores=os.cpu_count()))
        self.before = os.environ.get("SLURM_CONF")
        os.environ["SLURM_CONF"] = str(settings)
        self._start("munged", "--foreground", "--force", f"--key-file={key}", "--num-threads=1",
                    *(f"--{name}={self.folder}/munge.{end}" for name, end in (
                        ("socket", "sock"), ("pid-file", "pid"), ("log-file", "log"),
                        ("seed-file", "seed"))))
        self._start("slurmctld", "-D", "-c")
        self._start("slurmd", "-D")
        self._wait(lambda: "idle" in self.call("sinfo", "--noheader", "--format=%T"))

    def _start(self, name, *words):
        self.processes.append(subprocess.Popen(
            [_daemon(name), *words], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL))

    def _wait(self, reached):
        end = time.monotonic() + PATIENCE
        while not reached():
            if time.monotonic() > end:
                said = "\n".join(path.read_text() for path in self.folder.glob("*.log"))
                raise TimeoutError(f"Slurm is not ready:\n{said}")
            time.sleep(0.2)

    def call(self, *words):
        """Return what a command of Slurm prints."""
        return subprocess.run(words, capture_output=True, text=True, check=False).stdout

    def drain(self):
        """Wait until the queue is empty."""
        self._wait(lambda: not self.call("squeue", "--noheader").strip())

    def __exit__(self, *_):
        for process in reversed(self.processes):
            process.terminate()
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        if getattr(self, "before", None) is None:
            os.environ.pop("SLURM_CONF", None)
        else:
            os.environ["SLURM_CONF"] = self.before
        shutil.rmtree(self.folder, ignore_errors=True)


def _free_ports(count):
    """Return ports that are not in use."""
    sockets = [socket.socket() for _ in range(count)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports
