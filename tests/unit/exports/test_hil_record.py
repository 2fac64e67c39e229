"""A recording from a bench that speaks the protocol, with all that a wire does to it."""

import random
import socket
import subprocess
import sys
import threading
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppafo.cli.main import main
from ppafo.errors import DataError
from ppafo.exports.hil.recording import CollectedRecording, Collector, kept_aside, record
from ppafo.exports.hil.wire import (
    COMPUTED,
    OVER,
    WRAP,
    Answer,
    Reader,
    WireSample,
    count_of,
    sample_bytes,
)
from ppafo.storage.reading import read_recording
from tests.virtual_wire import answer_bytes, free_port, sending_bench

START = WRAP - 50_000
"""A time stamp [us] that goes on from 0 soon."""


class Tape:
    """A port that plays packets, a millisecond each, and is silent then."""

    failure = ""
    strangers = 0

    def __init__(self, packets: list[bytes], is_stream: bool = False) -> None:
        self.packets = list(packets)
        self.is_stream = is_stream
        self.time = 0.0

    def clock(self) -> float:
        return self.time

    def send(self, data: bytes) -> None:
        raise AssertionError

    def receive(self, timeout: float) -> bytes:
        self.time += 0.001 if self.packets else timeout
        return self.packets.pop(0) if self.packets else b""

    def close(self) -> None:
        pass


def packet(number: int, **changed: int) -> bytes:
    counts = {"angle": 1000 * number, "pressure_1": 101_325 + number}
    made = WireSample(0, 7, (WRAP - 20 + number) % WRAP, (START + 1000 * number) % WRAP, counts)
    return sample_bytes(made._replace(**changed))


def played(packets: list[bytes], duration: float | None = None, is_stream: bool = False) -> CollectedRecording:
    tape = Tape(packets, is_stream)
    return record(tape, "bench", duration, 1.0, clock=tape.clock)


def test_samples_become_channels_over_the_time_of_the_bench() -> None:
    found = played([packet(number) for number in range(100)])
    recording = found.recording
    assert recording.time == pytest.approx(0.001 * np.arange(100))
    assert np.array_equal(recording["pressure_1"], 101_325.0 + np.arange(100))
    assert np.array_equal(recording["angle"], np.arange(100) * 1000 / 1e6)
    assert (recording.kind, found.lost, found.ended) == ("measured", 0, "silence of the bench")


@given(st.randoms(use_true_random=False), st.booleans())
def test_what_a_wire_does_is_mended_or_counted(draw: random.Random, is_stream: bool) -> None:
    sent, lost, garbled = [packet(0)], set(), 0
    for number in range(1, 80):
        if draw.random() < 0.1 and number != 79:
            lost.add(number)
            if draw.random() < 0.5:
                data = bytearray(packet(number))
                data[draw.randrange(5, len(data))] ^= draw.randint(1, 255)
                sent.append(bytes(data))
                garbled += 1
        else:
            sent += [packet(number)] * draw.choice((1, 1, 1, 2))
    for place in range(1, len(sent) - 2):
        if draw.random() < 0.2:
            sent[place], sent[place + 1] = sent[place + 1], sent[place]
    found = played(sent, is_stream=is_stream)
    kept = [number for number in range(80) if number not in lost]
    assert found.recording.time == pytest.approx(0.001 * np.array(kept))
    assert np.array_equal(found.recording["pressure_1"], 101_325.0 + np.array(kept))
    assert found.lost == len(lost)
    assert found.ignored["doubled"] == len(sent) - garbled - len(kept)
    assert found.refused["checksum"] >= garbled


def test_a_duration_is_that_of_the_bench() -> None:
    found = played([packet(number) for number in range(100)], duration=0.025)
    assert len(found.recording) == 26
    assert found.ended == "its duration"


def test_a_duration_is_counted_past_half_of_what_a_time_stamp_holds() -> None:
    # Ten minutes from sample to sample; a time stamp goes back to 0 after 71.
    packets = [packet(number, time=600_000_000 * number % WRAP) for number in range(20)]
    found = played(packets, duration=9000.0)
    assert found.recording.duration == pytest.approx(9000.0)
    assert found.ended == "its duration"


def test_a_bench_that_says_it_is_over_ends_the_recording() -> None:
    found = played([*(packet(number) for number in range(9)), packet(9, flags=OVER), packet(10)])
    assert len(found.recording) == 10
    assert found.ended == "the bench ended the recording"


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        (packet(5, run=8), "of another run"),
        (packet(30, time=START), "with a clock that ran backwards"),
        (sample_bytes(WireSample(0, 7, WRAP - 15, START + 5000, {"angle": 1})), "with other channels"),
        (answer_bytes(Answer(0, 7, 5, 5, 5)), "no sample"),
    ],
)
def test_what_is_no_sample_of_this_recording_is_counted(wrong: bytes, why: str) -> None:
    found = played([*(packet(number) for number in range(20)), wrong, *(packet(number) for number in range(31, 40))])
    assert found.ignored[why] == 1
    assert len(found.recording) == 29
    assert np.isfinite(found.recording["angle"]).all()


def test_computed_samples_make_no_measurement() -> None:
    assert played([packet(0), packet(1, flags=COMPUTED), packet(2)]).recording.kind == "simulated"


def test_where_no_sample_comes_one_line_says_what_came() -> None:
    with pytest.raises(
        DataError, match=r"^no sample arrived within 1 s; received: 5 stray bytes; check the connection and the sender$"
    ):
        played([b"hello"])
    with pytest.raises(DataError, match=r"1 without a channel; check the connection and the sender$"):
        played([sample_bytes(WireSample(0, 7, 0, 0, {}))])


def static_test() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pressure difference [Pa], direction, and torque [N m] of a vane with K = 1.45e-5 m^3 and 0.3 N m of friction."""
    noise = np.random.default_rng(3)
    levels = np.repeat(np.linspace(5.0e4, 3.5e5, 12), 20)
    difference = np.concatenate([levels, levels[::-1]]) + noise.normal(0.0, 200.0, 480)
    direction = np.repeat([1.0, -1.0], 240)
    torque = 1.45e-5 * difference - 0.3 * direction + noise.normal(0.0, 0.01, 480)
    return difference, direction, torque


def play_static_test(port: int, stop: threading.Event) -> None:
    """Send the test as a bench does, again and again until somebody has heard it."""
    difference, direction, torque = static_test()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as bench:
        run = 0
        while not stop.is_set():
            run += 1
            for number, values in enumerate(zip(difference, direction, torque, strict=True)):
                named = dict(zip(("pressure_difference", "direction", "torque"), values, strict=True))
                counts = {name: count_of(name, float(value)) for name, value in named.items()}
                flags = OVER if number == len(torque) - 1 else 0
                for _ in range(3 if flags else 1):
                    data = sample_bytes(WireSample(flags, run, number, 10_000 * number, counts))
                    bench.sendto(data, ("127.0.0.1", port))
                time.sleep(2.0e-4)


PROBLEM = """schema_version = 1
name = "wired"
device.set = "ppafo2011"

[[procedure]]
kind = "static-torque"
recordings = ["static.csv"]
"""


def test_a_recording_goes_straight_into_identify(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    stop, port = threading.Event(), free_port()
    bench = threading.Thread(target=play_static_test, args=(port, stop))
    bench.start()
    try:
        assert main(["rig", "record", "--port", f"udp:127.0.0.1:{port}", "--out", "static.csv"]) == 0
    finally:
        stop.set()
        bench.join()
    assert ", measured: torque, pressure_difference, direction\n" in capsys.readouterr().out
    wired = read_recording(tmp_path / "static.csv")
    difference, direction, torque = static_test()
    numbers = 479 - np.rint((wired.time[-1] - wired.time) / 0.01).astype(int)  # it ends with the last sample
    assert len(wired) > 100
    assert np.abs(wired["torque"] - torque[numbers]).max() <= 0.51e-6
    assert np.abs(wired["pressure_difference"] - difference[numbers]).max() <= 0.51
    assert np.array_equal(wired["direction"], direction[numbers])
    (tmp_path / "problem.toml").write_text(PROBLEM, encoding="utf-8")
    main(["identify", "problem.toml", "--out", "identified"])
    text = (tmp_path / "identified" / "identify.txt").read_text(encoding="utf-8")
    _, found, unit, *_ = next(line for line in text.splitlines() if line.startswith("actuator.torque_constant")).split()
    assert (float(found), unit) == (pytest.approx(14.5, rel=0.02), "cm^3")


def test_whoever_sends_first_is_not_the_bench_unless_it_sends_a_packet(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    port, stop = free_port(), threading.Event()

    def send_garbage() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            while not stop.wait(0.002):
                stranger.sendto(b"hello", ("127.0.0.1", port))

    stranger = threading.Thread(target=send_garbage)
    stranger.start()
    time.sleep(0.05)
    words = ["rig", "record", "--port", f"udp:127.0.0.1:{port}", "--patience", "20 s"]
    try:
        with sending_bench(port, 0.5):
            assert main([*words, "--out", str(tmp_path / "bench.csv")]) == 0
    finally:
        stop.set()
        stranger.join()
    assert "stray bytes" in capsys.readouterr().out
    assert read_recording(tmp_path / "bench.csv").names == ("angle", "command")


def test_where_the_bench_fell_silent_before_its_first_sample_strangers_are_named() -> None:
    tape = Tape([answer_bytes(Answer(0, 7, 5, 5, 5))])
    tape.strangers = 3
    with pytest.raises(DataError, match=r"1 no sample, 3 from another sender; check the connection and the sender$"):
        record(tape, "bench", None, 1.0, clock=tape.clock)


def test_a_place_that_cannot_be_written_is_refused_before_anything_is_recorded(
    capsys: pytest.CaptureFixture[str],
) -> None:
    port = free_port()
    with sending_bench(port):
        assert main(["rig", "record", "--port", f"udp:127.0.0.1:{port}", "--out", "/dev/null/x.csv"]) == 2
    said = capsys.readouterr().err
    assert "/dev/null" in said
    assert len(said.splitlines()) == 1  # it has not even listened


@pytest.mark.parametrize("order", ["as sent", "shuffled"])
def test_what_came_is_kept_aside_while_it_is_recorded(order: str, tmp_path: Path) -> None:
    packets = [packet(number) for number in range(3000)]
    if order == "shuffled":
        packets = [packet(number + (1 if number % 2 == 0 else -1)) for number in range(3000)]
    tape, aside = Tape(packets), tmp_path / "aside.csv"
    with aside.open("w", encoding="utf-8") as file:
        whole = record(tape, "aside", None, 1.0, clock=tape.clock, keep=file.write).recording
    kept, whole = (
        {(time, *values) for time, *values in zip(one.time, *(one[name] for name in one.names), strict=True)}
        for one in (read_recording(aside), whole)
    )
    assert kept <= whole
    assert len(kept) > 2490  # all but the last half second, and the few that were overtaken as it was written


def _fail(keep: Callable[[str], None]) -> None:
    keep("time [s],angle [rad]\n0.0,1.0\n")
    raise DataError("no room")


def test_a_recording_whose_file_cannot_be_written_stays_aside(tmp_path: Path) -> None:
    target = tmp_path / "bench.csv"
    with (
        pytest.raises(DataError, match=r"no room; received samples are in .*bench\.recording\.csv$"),
        kept_aside(target) as keep,
    ):
        _fail(keep)
    assert len(read_recording(tmp_path / "bench.recording.csv")) == 1
    with (
        pytest.raises(DataError, match=r"bench\.recording\.csv: contains samples .*; rename it to keep them"),
        kept_aside(target),
    ):
        pass
    with pytest.raises(KeyboardInterrupt), kept_aside(tmp_path / "other.csv"):
        raise KeyboardInterrupt
    assert {path.name for path in tmp_path.iterdir()} == {"bench.recording.csv"}


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL here")
def test_a_recording_that_is_killed_loses_a_second(tmp_path: Path) -> None:
    port = free_port()
    words = ["rig", "record", "--port", f"udp:127.0.0.1:{port}", "--out", "bench.csv"]
    with subprocess.Popen([sys.executable, "-m", "ppafo", *words], cwd=tmp_path, stderr=subprocess.PIPE) as process:
        assert process.stderr is not None
        assert b"listening" in process.stderr.readline()
        aside = tmp_path / "bench.recording.csv"
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as bench:
            for number in range(10_000):
                bench.sendto(packet(number), ("127.0.0.1", port))
                time.sleep(0.001)
                if number % 100 == 0 and aside.read_bytes().count(b"\n") > 1000:
                    break
        process.kill()
    assert len(read_recording(aside)) >= 1000
    assert not (tmp_path / "bench.csv").exists()


def test_an_hour_of_samples_needs_little_memory() -> None:
    collector, first = Collector(), packet(0)
    collector.take(*Reader(is_stream=False).take(first))
    tracemalloc.start()
    for number in range(1, 20_001):
        collector.take(*Reader(is_stream=False).take(packet(number)))
    grown = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert grown / 20_000 < 200.0


@pytest.mark.parametrize(
    "stray",
    [
        sample_bytes(WireSample(0, 7, WRAP - 1, 5_000_000, {"angle": 1})),
        sample_bytes(WireSample(OVER, 7, WRAP - 1, 5_000_000, {"angle": 1})),
        sample_bytes(WireSample(0, 7, WRAP // 2, 3_000_000_000, {"angle": 1})),
        sample_bytes(WireSample(0, 6, WRAP - 1, 0, {"angle": 1})),
        sample_bytes(WireSample(COMPUTED, 7, WRAP - 1, 5_000_000, {"torque": 1, "angle": 1})),
    ],
)
@pytest.mark.parametrize("place", [0, 1, 20, 50])
def test_a_stray_sample_costs_none_of_the_others(stray: bytes, place: int) -> None:
    good = [sample_bytes(WireSample(0, 7, number, 1000 * number, {"angle": number})) for number in range(50)]
    found = played([*good[:place], stray, *good[place:]])
    assert np.array_equal(np.rint(found.recording["angle"] * 1e6), np.arange(50))
    assert found.recording.time == pytest.approx(0.001 * np.arange(50))
    assert (found.recording.kind, found.lost, found.ended) == ("measured", 0, "silence of the bench")
    assert sum(found.ignored.values()) == 1
