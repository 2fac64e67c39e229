"""What the example board does with what reaches it, and when it vents."""

import json
import re
import shutil
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.exports.hil.wire import WireSample, sample_bytes
from ppafo.processor.link import example_controller
from ppafo.simulation.loading import load_scenario
from tests.example_board import COMPILER, SENT, WHOLE, built, plug, running
from tests.virtual_wire import free_port

TASK = "torque-task-proportional"
SECOND = WireSample(0, 7, 1, 1000, dict.fromkeys(SENT, 150_000))
"""Sample 1 of the run that is under way."""
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no compiler of C is here")


@pytest.fixture(scope="module")
def controllers(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """The example controller of a scenario, built once."""
    made: dict[tuple[str, ...], Path] = {}

    def of(*words: str) -> Path:
        if words not in made:
            made[words] = built(tmp_path_factory.mktemp("board"), *words)
        return made[words]

    return of


@needs_compiler
def test_the_example_takes_one_step_for_a_sample_however_it_comes(controllers: Callable[..., Path]) -> None:
    with plug(controllers(TASK), "0") as wire:
        calm = [wire.ask(0, flags=1), *map(wire.ask, range(1, 6))]
        again = [wire.ask(0, flags=1, run=8), *(wire.ask(number, run=8) for number in (1, 2, 2, 3, 1, 4, 5))]
    commands = [answer.command for answer in calm]
    # The error changes from sample to sample, so that a step too many would show in its slope.
    assert len(set(commands)) == len(commands)
    seen = [answer.command for answer in again]
    assert seen == [*commands[:3], commands[2], commands[3], commands[3], *commands[4:]]
    assert not any(answer.flags for answer in (*calm, *again))


@needs_compiler
@pytest.mark.parametrize("flags", [2, 4])
def test_the_example_vents_once_the_plant_is_vented_or_over_until_it_begins_anew(
    flags: int, controllers: Callable[..., Path]
) -> None:
    with plug(controllers(TASK), "0") as wire:
        assert wire.ask(3).flags == 1  # before any beginning
        assert wire.ask(0, flags=1).flags == 0
        assert wire.ask(1, run=8).flags == 1
        wire.ask(2, flags=flags)
        assert wire.ask(3).flags == 1
        assert wire.ask(0, flags=1, run=9).flags == 0
        bad = wire.ask(1, run=9, pressure=0)  # a broken wire of a sensor
        assert (bad.flags, bad.command) == (1, 0)
        assert wire.ask(2, run=9).flags == 1


@needs_compiler
def test_the_example_vents_when_the_samples_stop(controllers: Callable[..., Path]) -> None:
    with plug(controllers(TASK), "20") as wire:
        wire.ask(0, flags=1)
        time.sleep(0.3)
        assert wire.ask(1).flags == 1


@needs_compiler
@pytest.mark.parametrize("apart", [5000, 1667])
def test_the_example_vents_where_the_plant_is_slower_than_its_controller(
    apart: int, controllers: Callable[..., Path]
) -> None:
    with plug(controllers(TASK), "0") as wire:
        assert wire.ask(0, flags=1, apart=apart).flags == 0
        found = [wire.ask(number, apart=apart) for number in range(1, 6)]
        assert [answer.flags for answer in found][-2:] == [1, 1]
        assert found[-1].command == 0


@needs_compiler
@pytest.mark.parametrize("apart", [1000, 500, 333])
def test_lost_samples_are_no_slow_plant(apart: int, controllers: Callable[..., Path]) -> None:
    with plug(controllers(TASK), "0") as wire:
        arrived = [*range(1, 20), 39, 40, 41, 60, 61, 79, 81]
        assert wire.ask(0, flags=1, apart=apart).flags == 0
        assert not any(wire.ask(number, apart=apart, pressure=150_000).flags for number in arrived)


@needs_compiler
def test_time_stamps_that_jitter_or_run_a_little_fast_are_no_slow_plant(controllers: Callable[..., Path]) -> None:
    with plug(controllers(TASK), "0") as wire:
        assert wire.ask(0, flags=1).flags == 0
        for number in range(1, 3000):
            # Early by 2 us and late by 2 in turn, 0.1 % apart from the clock of the controller.
            stamp = 1001 * number + (-2 if number % 2 else 2)
            assert not wire.ask(number, pressure=150_000, stamp=stamp).flags, number


@needs_compiler
def test_a_plant_at_the_rate_of_a_slow_line_asks_for_a_controller_of_that_rate(
    controllers: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["hil", TASK, "--rate", "200", "--lock-step", "--set", WHOLE[1], "--set", "run.duration=0.3 s"]
    said = {}
    for rate, overrides in (("1 kHz", ()), ("200 Hz", ("--set", "controller.rate=200Hz"))):
        port = free_port()
        with running(str(controllers(TASK, f"controller.rate={rate}")), "udp", str(port), "0"):
            out = ["--out", str(tmp_path / rate), "--port", f"udp:127.0.0.1:{port}"]
            code = main([*words, *overrides, *out])
        vented = json.loads((tmp_path / rate / "link.json").read_text(encoding="utf-8"))["vented"]
        said[rate] = (code, vented, "controller.rate=200Hz" in capsys.readouterr().err)
    assert said["1 kHz"] == (1, "the controller reported a fault", True)
    assert said["200 Hz"] == (0, None, False)


@needs_compiler
@pytest.mark.parametrize(
    ("data", "is_answered"),
    [
        (b"hello", False),
        (sample_bytes(SECOND)[:-1] + b"\x00", False),
        (sample_bytes(SECOND), True),
        (sample_bytes(SECOND._replace(run=8, sequence=2)), True),
    ],
    ids=["garbage", "wrong checksum", "repeated", "of another run"],
)
def test_nothing_but_new_samples_of_the_run_keeps_the_example_from_venting(
    data: bytes, is_answered: bool, controllers: Callable[..., Path]
) -> None:
    with plug(controllers(TASK), "20") as wire:
        wire.ask(0, flags=1)
        wire.ask(1)
        for _ in range(150):
            wire.send(data)
            if is_answered:
                wire.own.recv(256)
            time.sleep(0.002)
        assert wire.ask(2).flags == 1


@needs_compiler
def test_new_samples_keep_the_example_from_venting(controllers: Callable[..., Path]) -> None:
    with plug(controllers(TASK), "2000") as wire:
        assert wire.ask(0, flags=1).flags == 0
        for number in range(1, 6):
            time.sleep(0.6)
            assert wire.ask(number).flags == 0


@needs_compiler
def test_a_beginning_that_comes_late_or_once_more_is_an_old_sample(controllers: Callable[..., Path]) -> None:
    with plug(controllers(TASK), "0") as wire:
        calm = [wire.ask(0, flags=1), *map(wire.ask, range(1, 5))]
        wire.ask(0, flags=1, run=8)
        again = [wire.ask(0, flags=1, run=8)]  # called once more, before anything else
        for number in range(1, 5):
            again.append(wire.ask(number, run=8))
            late = wire.ask(0, flags=1, run=8)
            assert (late.flags, late.command) == (0, again[-1].command)
    assert [answer.command for answer in again] == [answer.command for answer in calm]


@needs_compiler
@pytest.mark.parametrize("end", ["vented", "over", "not sound", "not sound at once", "silent"])
def test_a_late_beginning_does_not_bring_back_a_run_that_is_over(end: str, controllers: Callable[..., Path]) -> None:
    with plug(controllers(TASK), "20" if end == "silent" else "0") as wire:
        wire.ask(0, flags=1, pressure=0 if end == "not sound at once" else None)
        if end == "silent":
            time.sleep(0.3)
        elif end != "not sound at once":
            wire.ask(1, flags={"vented": 2, "over": 4, "not sound": 0}[end], pressure=0 if end == "not sound" else None)
        for _ in range(2):
            late = wire.ask(0, flags=1)
            assert (late.flags, late.command) == (1, 0)
        assert wire.ask(2).flags == 1
        assert wire.ask(0, flags=1, run=8).flags == 0


@pytest.mark.skipif(shutil.which("clang") is None, reason="clang is not here")
def test_a_board_whose_int_has_16_bits_multiplies_in_32(tmp_path: Path) -> None:
    contents = example_controller(load_scenario(TASK, WHOLE))
    host = contents["host.c"].decode()
    used = "void used(const link_sample *sample, uint8_t *bytes) { answer(sample, 0, bytes); }\n"
    board = host[host.index('#include "controller.h"') : host.index("static uint32_t microseconds")]
    for name, content in {**contents, "board.c": (board + used).encode()}.items():
        (tmp_path / name).write_bytes(content)
    words = ["clang", "--target=msp430", "-ffreestanding", "-S", "-emit-llvm", "-o", "-"]
    for name in ("board.c", "link.c"):
        found = subprocess.run([*words, name], cwd=tmp_path, check=True, capture_output=True, text=True).stdout
        assert "define" in found
        assert not re.findall(r"mul nsw i16.*", found), name
