"""What the page on exports says of hardware in the loop is run, on a loopback in place of the cable."""

import contextlib
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from ppafo.cli.main import main
from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario
from ppafo.storage.reading import read_recording
from tests.virtual_wire import free_port, sending_bench

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "how-to" / "export.md").read_text(encoding="utf-8")
COMMANDS = [
    line for block in re.findall(r"^```sh\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE) for line in block.splitlines()
]
PROTOCOL = (DOCS / "wire-protocol.md").read_text(encoding="utf-8")
(PYTHON,) = re.findall(r"^```python\n(.*?)^```", PROTOCOL, re.DOTALL | re.MULTILINE)
needs_compiler = pytest.mark.skipif(shutil.which("cc") is None or shutil.which("make") is None, reason="no cc, no make")


def command(*words: str) -> list[str]:
    """The one command of the page with these words."""
    (found,) = [line for line in COMMANDS if all(word in line for word in words)]
    return shlex.split(found)


@contextlib.contextmanager
def running(*words: str) -> Iterator[None]:
    with subprocess.Popen(words) as process:
        try:
            yield
        finally:
            process.kill()


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@needs_compiler
def test_the_example_in_c_decides_as_the_page_says_and_validate_takes_the_run(
    desk: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(command("export controller")[1:]) == 0
    subprocess.run(command("make -C out/controller"), check=True, capture_output=True)
    port = free_port()
    words = [word.replace("5000", str(port)) for word in command("--lock-step")[1:]]
    with running("out/controller/controller", "udp", str(port), "0"):
        assert main(words) == 0
    said = capsys.readouterr().out
    assert "time       in lock step with the answers" in said
    (shown,) = re.findall(r"`ppafo simulate ([^`]*)`, pressures", PAGE)
    name, *overrides = [word for word in shlex.split(shown) if word != "--set"]
    mine, theirs = read_recording(desk / "out" / "right"), simulate(load_scenario(name, overrides)).recording
    for channel in theirs.names:
        assert np.array_equal(mine[channel], theirs[channel]), channel
    (desk / "out" / "right").rename(desk / "out" / "hil")
    assert main(command("validate ")[1:]) == 0
    rows = [line for line in capsys.readouterr().out.splitlines() if line.endswith("pass")]
    assert len(rows) == 4
    assert all(re.search(r"  0 (psi|N m) +0 +[\d.]+ (psi|N m) +0 % ", line) for line in rows), rows


def test_the_controller_in_python_controls_the_plant_until_it_is_over(desk: Path) -> None:
    port = free_port()
    (desk / "controller.py").write_text(PYTHON.replace("5001", str(port)), encoding="utf-8")
    with subprocess.Popen([sys.executable, "controller.py"]) as process:
        try:
            words = ["hil", "torque-task-proportional", "--port", f"udp:127.0.0.1:{port}", "--lock-step"]
            assert main([*words, "--set", "run.duration=0.5 s", "--out", "out"]) == 0
            assert process.wait(30.0) == 0
        finally:
            process.kill()
    recording = read_recording(desk / "out")
    torque, reference = recording["torque"], recording["reference"]
    assert recording["command"][1:].any()
    assert np.abs(reference - torque)[250:].max() < 0.25
    wanted = np.clip(np.round((reference - torque) * 1e6) // 2 / 1e6, -1.0, 1.0)
    assert np.abs(recording["command"][:500] - wanted[:500]).max() <= 1.1e-6


def test_the_recording_of_a_bench_is_taken_as_the_page_says(desk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    port = free_port()
    with sending_bench(port):
        words = [word.replace("5002", str(port)) for word in command("record", "static.csv")[1:]]
        assert main(words) == 0
    assert "ended    by the bench ended the recording" in capsys.readouterr().out
    assert read_recording(desk / "static.csv").kind == "measured"
