"""The wire itself: a UDP loopback and a pair of pseudo-terminals for the cable, the example in C for the board."""

import contextlib
import ctypes
import json
import os
import select
import shlex
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppafo.cli.main import main
from ppafo.errors import ScenarioError
from ppafo.exports.hil.ports import open_port
from ppafo.exports.hil.wire import Answer, Reader, WireSample, sample_bytes
from ppafo.processor.link import example_controller
from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario
from ppafo.storage.reading import read_recording
from tests.example_board import COMPILER, SENT, WHOLE, built, running
from tests.virtual_wire import ProportionalPartner, answer_bytes, free_port

TASK = "torque-task-proportional"
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no compiler of C is here")
needs_terminals = pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals here")
SHORT = "run.duration=0.3 s"


@pytest.fixture(scope="module")
def controllers(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The example controller of a scenario, built once."""
    made: dict[str, Path] = {}
    return lambda name: made.get(name) or made.setdefault(name, built(tmp_path_factory.mktemp(name), name))


@contextlib.contextmanager
def cable() -> Iterator[tuple[str, str]]:
    """Two serial devices with a cable between them: what is written to one can be read from the other."""
    import pty
    import tty

    (left, left_end), (right, right_end) = pty.openpty(), pty.openpty()
    for end in (left_end, right_end):
        tty.setraw(end)
    stop = threading.Event()

    def carry() -> None:
        while not stop.is_set():
            ready, _, _ = select.select([left, right], [], [], 0.05)
            for one, other in ((left, right), (right, left)):
                if one in ready:
                    with contextlib.suppress(OSError):
                        os.write(other, os.read(one, 4096))

    thread = threading.Thread(target=carry)
    thread.start()
    try:
        yield os.ttyname(left_end), os.ttyname(right_end)
    finally:
        stop.set()
        thread.join()
        for end in (left, left_end, right, right_end):
            os.close(end)


@contextlib.contextmanager
def partner_thread(answers: Callable[[bytes], list[bytes]]) -> Iterator[int]:
    """A controller in this process behind UDP; gives its port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own:
        own.bind(("127.0.0.1", 0))
        own.settimeout(0.05)
        stop = threading.Event()

        def serve() -> None:
            while not stop.is_set():
                with contextlib.suppress(TimeoutError):
                    data, sender = own.recvfrom(4096)
                    for answer in answers(data):
                        own.sendto(answer, sender)

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield int(own.getsockname()[1])
        finally:
            stop.set()
            thread.join()


def assert_bits_of_lanes(folder: Path, name: str, *overrides: str) -> None:
    mine, theirs = read_recording(folder), simulate(load_scenario(name, (*WHOLE, *overrides))).recording
    for channel in theirs.names:
        assert np.array_equal(mine[channel], theirs[channel]), channel


@needs_compiler
@pytest.mark.parametrize("name", [TASK, "torque-task-solenoid"])
def test_the_integer_controller_over_udp_has_the_bits_of_the_lanes(
    name: str, controllers: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    port, out = free_port(), tmp_path / "out"
    with running(str(controllers(name)), "udp", str(port), "0"):
        words = ["hil", name, "--port", f"udp:127.0.0.1:{port}", "--lock-step", "--set", WHOLE[1], "--set", SHORT]
        assert main([*words, "--out", str(out), "--json"]) == 0
    assert_bits_of_lanes(out, name, SHORT)
    document = json.loads(capsys.readouterr().out)
    assert (document["link"]["samples"], document["link"]["missed"]) == (300, 0)
    assert document["link"]["vented"] is None


@needs_compiler
@needs_terminals
def test_the_integer_controller_at_a_serial_device_has_the_bits_of_the_lanes(
    controllers: Callable[[str], Path], tmp_path: Path
) -> None:
    pytest.importorskip("serial")
    with cable() as (mine, theirs), running(str(controllers(TASK)), "serial", theirs, "0"):
        words = ["hil", TASK, "--port", f"serial:{mine}", "--lock-step", "--set", WHOLE[1], "--set", SHORT]
        assert main([*words, "--out", str(tmp_path / "out")]) == 0
    assert_bits_of_lanes(tmp_path / "out", TASK, SHORT)


@needs_compiler
def test_a_short_run_in_real_time_is_right_however_late_the_computer_is(
    controllers: Callable[[str], Path], tmp_path: Path
) -> None:
    port, out = free_port(), tmp_path / "out"
    with running(str(controllers(TASK)), "udp", str(port), "500"):
        words = ["hil", TASK, "--port", f"udp:127.0.0.1:{port}", "--set", SHORT, "--out", str(out)]
        code = main(words)
    link = json.loads((out / "link.json").read_text(encoding="utf-8"))
    assert code == (1 if link["vented"] else 0)
    assert link["samples"] == 300
    assert link["answered"] + link["missed"] == 300
    assert {"link.png", "link.svg", "figure.png", "log.csv", "recording.nc"} <= {path.name for path in out.iterdir()}
    recording = read_recording(out)
    log = np.genfromtxt(out / "log.csv", delimiter=",", skip_header=1)
    assert np.array_equal(recording["command"][:300], log[:, 4])
    if not link["vented"]:
        assert np.nanmax(np.diff(log[:, 5])) < 0.5


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The protocol of a board, in C, as a library."""
    folder = tmp_path_factory.mktemp("link")
    for file, content in example_controller(load_scenario(TASK, WHOLE)).items():
        (folder / file).write_bytes(content)
    words = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-shared", "-fPIC"]
    subprocess.run([str(COMPILER), *words, "link.c", "-o", "link.so"], cwd=folder, check=True, capture_output=True)
    return ctypes.CDLL(str(folder / "link.so"))


def test_the_next_command_of_a_controller_names_its_file_with_what_was_set(tmp_path: Path) -> None:
    file = tmp_path / "my task.toml"
    file.write_text(files("ppafo.scenarios").joinpath(f"{TASK}.toml").read_text(encoding="utf-8"), encoding="utf-8")
    page = example_controller(load_scenario(file, WHOLE[:1]))["README.md"].decode()
    (line,) = [line.strip() for line in page.splitlines() if line.strip().startswith("ppafo hil")]
    words = shlex.split(line)
    assert words == ["ppafo", "hil", str(file), "--set", WHOLE[0], "--port", "udp:127.0.0.1:5000", "--out", "out/hil"]


class CSample(ctypes.Structure):
    _fields_ = (
        ("flags", ctypes.c_uint8),
        ("run", ctypes.c_uint16),
        ("sequence", ctypes.c_uint32),
        ("time", ctypes.c_uint32),
        *((name, ctypes.c_int32) for name in ("reference", "angle", "pressure_1", "pressure_2", "torque")),
    )


WORDS = st.integers(0, 2**32 - 1)
COUNTS = st.tuples(*[st.integers(-(2**31), 2**31 - 1)] * 5)
SAMPLES = st.builds(
    lambda flags, run, sequence, time, counts: WireSample(
        flags, run, sequence, time, dict(zip(SENT, counts, strict=True))
    ),
    *(st.integers(0, 255), st.integers(0, 2**16 - 1), WORDS, WORDS, COUNTS),
)
PIECES = st.one_of(
    SAMPLES.map(sample_bytes),
    SAMPLES.map(sample_bytes),
    st.binary(max_size=60),
    st.just(b"\xa5\x5a\x01\x01\x2c"),
    st.just(b"\xa5"),
)


@needs_compiler
@given(pieces=st.lists(PIECES, max_size=6), last=SAMPLES)
def test_a_board_finds_the_samples_that_python_finds(library: Any, pieces: list[bytes], last: WireSample) -> None:
    stream = b"".join([*pieces, bytes(100), sample_bytes(last)])
    reader, sample = ctypes.create_string_buffer(45), CSample()
    found = []
    for byte in stream:
        if library.link_take(reader, ctypes.c_uint8(byte), ctypes.byref(sample)) & 1:
            counts = {name: getattr(sample, name) for name in SENT}
            found.append(WireSample(sample.flags, sample.run, sample.sequence, sample.time, counts))
    wanted = [item for item in Reader(is_stream=True).take(stream) if isinstance(item, WireSample)]
    assert found == [item for item in wanted if set(item.counts) == set(SENT)]
    assert found[-1] == last


@needs_compiler
@given(sample=SAMPLES, command=st.integers(-1_000_000, 1_000_000), flags=st.integers(0, 1), time=WORDS)
def test_a_board_answers_as_python_does(library: Any, sample: WireSample, command: int, flags: int, time: int) -> None:
    given_sample = CSample(*sample[:4], *(sample.counts[name] for name in SENT))
    answer = ctypes.create_string_buffer(24)
    library.link_answer(
        ctypes.byref(given_sample), ctypes.c_int32(command), ctypes.c_uint8(flags), ctypes.c_uint32(time), answer
    )
    assert answer.raw == answer_bytes(Answer(flags, sample.run, sample.sequence, time, command))


def test_ctrl_c_vents_writes_the_log_whole_and_ends_with_130(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    partner, out = ProportionalPartner(), tmp_path / "out"

    def pressed(data: bytes) -> list[bytes]:
        answers = partner.answers(data)
        if partner.seen[-1].sequence == 50:
            os.kill(os.getpid(), signal.SIGINT)
        return answers

    before = signal.getsignal(signal.SIGINT)
    with partner_thread(pressed) as port:
        words = ["hil", TASK, "--port", f"udp:127.0.0.1:{port}", "--lock-step", "--set", "run.duration=2 s"]
        assert main([*words, "--set", "initial.pressure_1=30 psi_g", "--out", str(out)]) == 130
    assert signal.getsignal(signal.SIGINT) is before
    said = capsys.readouterr()
    assert "stopped at 0.05" in said.err
    recording = read_recording(out)
    assert recording.duration == pytest.approx(0.55, abs=0.002)
    assert recording["command"][-1] == 2.0
    assert recording["pressure_1"][-1] < 0.75 * recording["pressure_1"][0]
    assert (out / "log.csv").read_text(encoding="utf-8").endswith("\n")
    assert partner.seen[-1].flags & 4


def test_where_nobody_answers_nothing_is_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["hil", TASK, "--port", f"udp:127.0.0.1:{free_port()}", "--patience", "0.05 s", "--set", SHORT]
    assert main([*words, "--out", str(tmp_path / "out")]) == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert last == "ppafo: no controller answered within 0.05 s; received: nothing"
    assert not list(tmp_path.iterdir())


def test_packets_of_somebody_else_are_counted_and_do_nothing() -> None:
    port = free_port()
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as friend,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger,
    ):
        friend.bind(("127.0.0.1", port))
        friend.settimeout(5.0)
        mine = open_port(f"udp:127.0.0.1:{port}")
        mine.send(b"sample")
        _, address = friend.recvfrom(64)
        stranger.sendto(b"of a stranger", address)
        friend.sendto(b"of the friend", address)
        assert mine.receive(5.0) == b"of the friend"
        assert mine.strangers == 1
        assert mine.receive(0.0) == b""
        mine.close()


@needs_terminals
def test_a_datagram_without_a_byte_hides_no_packet_behind_it() -> None:
    port = free_port()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as friend:
        friend.bind(("127.0.0.1", port))
        friend.settimeout(5.0)
        mine = open_port(f"udp:127.0.0.1:{port}")
        mine.send(b"sample")
        _, address = friend.recvfrom(64)
        for data in (b"", b"", b"an answer"):
            friend.sendto(data, address)
        assert mine.receive(5.0) == b"an answer"
        mine.close()


def test_a_serial_device_that_is_pulled_out_breaks_and_does_not_raise() -> None:
    pytest.importorskip("serial")
    import pty

    master, slave = pty.openpty()
    port = open_port(f"serial:{os.ttyname(slave)}")
    os.close(slave)
    port.send(b"ab")
    assert os.read(master, 2) == b"ab"
    os.write(master, b"cd")
    assert port.receive(5.0)[:1] == b"c"
    os.close(master)
    for _ in range(20):
        port.send(b"xy")
        port.receive(0.001)
    assert "the serial port failed" in port.failure
    assert port.receive(0.001) == b""
    port.close()


@needs_terminals
def test_a_serial_line_that_nobody_reads_does_not_stop_the_plant() -> None:
    pytest.importorskip("serial")
    import pty

    master, slave = pty.openpty()
    port = open_port(f"serial:{os.ttyname(slave)}")
    for _ in range(300):
        port.send(bytes(44))
    assert port.failure == ""
    port.close()
    os.close(master)
    os.close(slave)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("udp:no-such-host.invalid:5000", "cannot be used"),
        ("serial:/dev/ttyNONE", "cannot be opened"),
    ],
)
def test_a_port_that_is_none_is_one_line(
    text: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if text.startswith("serial:/"):
        pytest.importorskip("serial")
    monkeypatch.chdir(tmp_path)
    for words in (["hil", TASK], ["rig", "record", "--out", "bench.csv"]):
        assert main([*words, "--port", text]) == 2
        line = capsys.readouterr().err
        assert f"--port {text}: {said}" in line
        assert len(line.splitlines()) == 1
        assert "Errno" not in line
        assert line.lower().count("no such file") == text.startswith("serial:/")
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(sys.platform == "win32", reason="no such devices")
@pytest.mark.parametrize("place", ["/dev/null", "/dev/zero", "folder", "file", "pipe"])
def test_what_is_no_serial_port_is_said_in_words(place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("serial")
    monkeypatch.chdir(tmp_path)
    Path("folder").mkdir()
    Path("file").touch()
    os.mkfifo("pipe")
    with pytest.raises(ScenarioError, match=rf"^port serial:{place}: cannot be opened: not a serial port$"):
        open_port(f"serial:{place}")


def test_without_pyserial_one_line_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(ScenarioError, match=r"needs pyserial: pip install 'ppafo\[hil\]'$"):
        open_port("serial:/dev/ttyACM0")
