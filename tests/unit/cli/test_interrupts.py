"""A signal to end ends a command with 130 and leaves nothing half done, wherever Python was when it came."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from pyarrow import parquet

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals work differently there")
SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")


START = """
import os, signal, sys
# Whoever runs the tests in the background lets them ignore interrupts, and a child would inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)
from ppafo.engine import lanes
MIDDLE
sys.argv = ["ppafo", "simulate", "torque-task-solenoid", "--out", sys.argv[1]]
from ppafo.__main__ import start
sys.exit(start())
"""
LOST = """
class Finalised:
    def __del__(self):
        os.kill(os.getpid(), signal.NAME)
advance = lanes.LaneBlock.advance
def interrupted(self, step_count):
    Finalised()
    advance(self, step_count)
lanes.LaneBlock.advance = interrupted
"""
"""A signal while an object is finalised: Python drops the exception that it raises."""
CAUGHT = """
check = lanes.interrupts.check
def caught():
    try:
        os.kill(os.getpid(), signal.NAME)
    except BaseException:
        pass
    check()
lanes.interrupts.check = caught
"""
COMPILED = """
import numpy
from scipy.stats import qmc
read = numpy.lib.npyio.NpzFile.__getitem__
def interrupted(self, key):
    os.kill(os.getpid(), signal.NAME)
    return read(self, key)
numpy.lib.npyio.NpzFile.__getitem__ = interrupted
advance = lanes.LaneBlock.advance
def sampled(self, step_count):
    qmc.Sobol(2)
    advance(self, step_count)
lanes.LaneBlock.advance = sampled
"""
"""A signal while SciPy reads its direction numbers: Cython prints the exception that it raises, and drops it."""


@pytest.mark.parametrize(
    ("middle", "name"),
    [(LOST, "SIGINT"), (CAUGHT, "SIGTERM"), (COMPILED, "SIGHUP")],
    ids=["lost in a finaliser", "caught by a library", "dropped by compiled code"],
)
def test_a_signal_whose_exception_got_lost_ends_the_run_all_the_same(middle: str, name: str, tmp_path: Path) -> None:
    code = START.replace("MIDDLE", middle.replace("NAME", name))
    words = [sys.executable, "-c", code, str(tmp_path / "run")]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 130
    assert done.stderr.splitlines()[-1] == "ppafo: interrupted; no file is incomplete"
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


READY = """
from ppafo import interrupts
listen = interrupts.listen
def ready():
    listen()
    print("ready", flush=True)
interrupts.listen = ready
"""


COMMANDS = {
    "simulate": ("simulate torque-task-solenoid", 2.0),
    "sweep": ("sweep torque-task-uncertainty --draws 32", 2.4),
}
"""Words of a command, and the CPU seconds that it takes, about, where models are compiled."""


@pytest.mark.long
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads CPU time as Linux tells it")
@pytest.mark.parametrize("name", SIGNALS)
@pytest.mark.parametrize("command", COMMANDS)
def test_a_signal_at_any_moment_leaves_all_or_nothing(command: str, name: str, tmp_path: Path) -> None:
    """Moments are random within each third of the CPU time; it counts from where the handlers are installed.

    Before that Python itself starts, and a signal ends it as it ends any program. Each signal gets another third in
    each command.
    """
    words, seconds = COMMANDS[command]
    third = (list(COMMANDS).index(command) + SIGNALS.index(name)) % 3
    moment = seconds * (third + random.Random(f"{command} {name}").random()) / 3.0
    code = START.replace("from ppafo.engine import lanes\n", "").replace("MIDDLE", READY)
    code = code.replace('"simulate", "torque-task-solenoid"', ", ".join(map(repr, words.split())))
    start = [sys.executable, "-c", code, str(tmp_path / "run")]
    with subprocess.Popen(start, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        before = cpu_seconds(process.pid)
        while process.poll() is None and cpu_seconds(process.pid) - before < moment:
            time.sleep(0.02)
        process.send_signal(getattr(signal, name))
        _, error = process.communicate(timeout=120)
    assert process.returncode in (0, 130)
    assert "Traceback" not in error
    made = [path.name for path in tmp_path.iterdir()]
    if process.returncode == 0:
        assert made == ["run"]
    elif command == "sweep":  # A study that was interrupted goes on from its folder.
        assert made in ([], ["run"])
    else:
        assert made == []
    for path in tmp_path.rglob("*"):
        assert not path.name.startswith("."), "a file aside was left"
        if path.suffix == ".json":
            json.loads(path.read_text(encoding="utf-8"))
        if path.suffix == ".parquet":
            parquet.read_table(path)


def cpu_seconds(process: int) -> float:
    """CPU time of a process, 0 for one that ended."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    except (FileNotFoundError, ProcessLookupError):
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
