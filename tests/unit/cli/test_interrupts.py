"""A signal to end ends a command with 130 and leaves nothing half done, wherever Python was when it came."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals work differently there")
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


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
@pytest.mark.parametrize("middle", [LOST, CAUGHT], ids=["lost in a finaliser", "caught by a library"])
def test_a_signal_whose_exception_got_lost_ends_the_run_all_the_same(middle: str, name: str, tmp_path: Path) -> None:
    code = START.replace("MIDDLE", middle.replace("NAME", name))
    words = [sys.executable, "-c", code, str(tmp_path / "run")]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 130
    assert done.stderr.splitlines()[-1] == "ppafo: interrupted; nothing is half written"
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_signal_that_whoever_started_it_ignores_stays_ignored(tmp_path: Path) -> None:
    code = START.replace("signal.default_int_handler", "signal.SIG_IGN").replace(
        "MIDDLE", LOST.replace("NAME", "SIGINT")
    )
    words = [sys.executable, "-c", code, str(tmp_path / "run")]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0
    assert (tmp_path / "run" / "run.json").is_file()


READY = """
from ppafo import interrupts
listen = interrupts.listen
def ready():
    listen()
    print("ready", flush=True)
interrupts.listen = ready
"""


@pytest.mark.long
@pytest.mark.parametrize("number", range(0, 20, 3))
def test_a_signal_at_any_moment_leaves_all_or_nothing(number: int, tmp_path: Path) -> None:
    code = START.replace("from ppafo.engine import lanes\n", "").replace("MIDDLE", READY)
    words = [sys.executable, "-c", code, str(tmp_path / "run")]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        time.sleep(0.07 * number)
        process.terminate()
        _, error = process.communicate(timeout=120)
    assert process.returncode in (0, 130)
    assert "Traceback" not in error
    assert [path.name for path in tmp_path.iterdir()] == (["run"] if process.returncode == 0 else [])
