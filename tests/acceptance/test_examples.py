"""Every example runs from beginning to end and writes what it says."""

import contextlib
import os
import runpy
import socket
import struct
import subprocess
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ppafo

FOLDER = Path(__file__).parents[2] / "src" / "ppafo" / "examples"
EXAMPLES = sorted(FOLDER.glob("first-steps/*.py"))
WRITTEN = {
    "first_steps": {
        "first-steps/torque-task.png",
        "first-steps/own-controller.png",
        "first-steps/own-controller/recording.nc",
        "first-steps/own-controller/recording.csv",
        "first-steps/own-controller/run.json",
    },
}


def run(example: Path, folder: Path) -> str:
    """What an example prints when it is run in a folder, where there is no screen."""
    environment = {**os.environ, "MPLBACKEND": "agg"}
    done = subprocess.run(
        [sys.executable, str(example)], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_example_is_tested() -> None:
    assert {example.stem for example in EXAMPLES} == set(WRITTEN)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.stem)
def test_an_example_runs_and_writes_its_files_under_out_and_nowhere_else(example: Path, tmp_path: Path) -> None:
    run(example, tmp_path)
    written = {str(path.relative_to(tmp_path / "out")) for path in tmp_path.rglob("*") if path.is_file()}
    assert written == WRITTEN[example.stem]


@pytest.fixture
def env() -> Any:
    """The environment of the example for Gymnasium."""
    gymnasium = pytest.importorskip("gymnasium")
    runpy.run_path(str(FOLDER / "gymnasium" / "torque_task.py"))
    return gymnasium.make("ppafo/TorqueTask-v0", duration="0.1 s").unwrapped


def test_gymnasium_finds_nothing_to_warn_of(env: Any) -> None:
    from gymnasium.utils.env_checker import check_env

    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        check_env(env)
    assert [str(item.message) for item in found] == []


def test_an_episode_of_gymnasium_is_the_run_that_its_result_names(env: Any) -> None:
    _, drawn = env.reset(seed=4)
    actions = np.random.default_rng(1).uniform(-1.0, 1.0, (100, 1)).astype(np.float32)
    steps = [env.step(action) for action in actions]
    assert [ended for *_, ended, _ in steps] == [False] * 99 + [True]
    result = env.run.result()
    again = ppafo.simulate(result.scenario)
    assert again.recording == result.recording
    assert again.scenario.reference.level == drawn["reference.level"]
    assert [info["supplied_mass"] for *_, info in steps] == again["supplied_mass"][1:].tolist()
    gas = again["supplied_mass"][-1] / 1e-3
    squared = sum(info["error"] ** 2 for *_, info in steps)
    assert sum(step[1] for step in steps) == pytest.approx(-(1e-3 * squared + gas), rel=1e-12)


def test_the_example_for_gymnasium_runs_as_its_page_says(tmp_path: Path) -> None:
    pytest.importorskip("gymnasium")
    assert "return -0." in run(FOLDER / "gymnasium" / "torque_task.py", tmp_path)


def of_board(file: str) -> Path:
    return FOLDER / "hardware-in-the-loop" / file


@pytest.fixture
def plant(tmp_path: Path) -> Iterator[tuple["subprocess.Popen[str]", int]]:
    """The plant of the example, which waits for its board at a port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port: int = free.getsockname()[1]
    words = [sys.executable, str(of_board("plant.py")), "--port", str(port), "--lock-step"]
    with subprocess.Popen(words, cwd=tmp_path, stdout=-1, stderr=-1, text=True) as process:
        yield process, port
        process.kill()


def test_a_board_at_a_socket_gives_the_recording_of_its_controller(
    plant: tuple["subprocess.Popen[str]", int], tmp_path: Path
) -> None:
    process, port = plant
    words = [sys.executable, str(of_board("board.py")), str(port)]
    subprocess.run(words, check=True, timeout=120)
    said, _ = process.communicate()
    assert (process.returncode, said) == (0, "3000 samples, 0 without an answer in time; written: out/hil\n")
    found = ppafo.read_recording(tmp_path / "out" / "hil" / "recording.nc")
    law = runpy.run_path(str(of_board("board.py")))["Proportional"]()
    alone = ppafo.simulate(ppafo.load_scenario("torque-task-proportional").controlled_by(law)).recording
    assert found.names == alone.names
    assert all(np.array_equal(found[name], alone[name]) for name in alone.names)


def test_only_an_answer_to_the_present_sample_acts_and_a_silent_board_ends_the_run(
    plant: tuple["subprocess.Popen[str]", int], tmp_path: Path
) -> None:
    process, port = plant
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as board:
        board.bind(("127.0.0.1", 0))
        board.settimeout(0.1)
        message = b""
        while not message:
            board.sendto(b"", ("127.0.0.1", port))
            with contextlib.suppress(TimeoutError):
                message = board.recv(64)
        board.settimeout(60.0)
        for number in range(5):
            assert len(message) == 52
            assert struct.unpack("<I6d", message)[:2] == (number, pytest.approx(number * 1e-3))
            for answer in (b"?", struct.pack("<Id", number + 1, 1.0), struct.pack("<Id", number, float("nan"))):
                board.sendto(answer, ("127.0.0.1", port))
            board.sendto(struct.pack("<Id", number, -0.25), ("127.0.0.1", port))
            message = board.recv(64)
        assert board.recv(64) == b""
    said, complained = process.communicate()
    assert (process.returncode, complained) == (1, "the board was silent from t = 0.006 s on\n")
    assert said.startswith("6 samples, 1 without an answer in time")
    commands = ppafo.read_recording(tmp_path / "out" / "hil" / "recording.nc")["command"]
    assert set(commands) == {-0.25}
