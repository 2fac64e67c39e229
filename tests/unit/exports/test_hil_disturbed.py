"""Disturbed and ill-behaved controllers at real sockets and pseudo-terminals, in real time: none holds pressure.

No time is judged: what is asked is what acts, and that the run goes to its end.
"""

import contextlib
import heapq
import os
import random
import select
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from functools import cache
from typing import Protocol

import pytest

from ppafo.errors import ScenarioError
from ppafo.exports.hil.loop import BROKEN, SILENT
from ppafo.exports.hil.pacing import RealTime
from ppafo.exports.hil.plant import CompiledPlant, plant_of
from ppafo.exports.hil.ports import open_port
from ppafo.exports.hil.result import HardwareRun
from ppafo.exports.hil.run import run_plant
from ppafo.exports.hil.wire import Reader, WireSample, sample_bytes
from ppafo.model.valves.kind import VENT
from ppafo.simulation.loading import load_scenario
from tests.virtual_wire import Fault, ProportionalPartner, faults, undisturbed

SAMPLES = 150
PRESSED = ("initial.pressure_1=20 psi_g", "initial.pressure_2=20 psi_g")
with_terminals = pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals here")
WIRES = ("udp", pytest.param("serial", marks=with_terminals))


@cache
def plant(duration: str = "0.15 s") -> CompiledPlant:
    return plant_of(load_scenario("torque-task-proportional", (f"run.duration={duration}", *PRESSED)))


class End(Protocol):
    """The controller's end of a wire, and what the plant opens at the other one."""

    address: str
    is_stream: bool

    def receive(self) -> bytes: ...
    def send(self, data: bytes) -> None: ...
    def close(self) -> None: ...


class Datagrams:
    """A UDP socket."""

    is_stream = False

    def __init__(self) -> None:
        self.own = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.own.bind(("127.0.0.1", 0))
        self.address = f"udp:127.0.0.1:{self.own.getsockname()[1]}"
        self.other = ("127.0.0.1", 9)

    def receive(self) -> bytes:
        if not select.select([self.own], [], [], 1.0e-3)[0]:
            return b""
        data, self.other = self.own.recvfrom(4096)
        return data

    def send(self, data: bytes) -> None:
        self.own.sendto(data, self.other)

    def close(self) -> None:
        self.own.close()


class Terminal:
    """One end of a pseudo-terminal, whose other end is a serial device."""

    is_stream = True

    def __init__(self) -> None:
        import pty
        import tty

        pytest.importorskip("serial")
        self.own, self.device = pty.openpty()
        tty.setraw(self.device)
        self.address = f"serial:{os.ttyname(self.device)}"

    def receive(self) -> bytes:
        return os.read(self.own, 4096) if select.select([self.own], [], [], 1.0e-3)[0] else b""

    def send(self, data: bytes) -> None:
        os.write(self.own, data)

    def close(self) -> None:
        for end in (self.own, self.device):
            os.close(end)


Act = Callable[[End, list[bytes]], bool]
"""What a controller does with its answers to a sample; false where it leaves, and takes its end with it."""


@contextlib.contextmanager
def serving(kind: str, partner: ProportionalPartner, act: Act) -> Iterator[str]:
    """A controller in a thread at the other end of a wire; gives what the plant opens."""
    end: End = Datagrams() if kind == "udp" else Terminal()
    reader, stop = Reader(end.is_stream), threading.Event()

    def serve() -> None:
        # A terminal that its other side has closed gives no more bytes.
        with contextlib.closing(end), contextlib.suppress(OSError):
            while not stop.is_set():
                samples = [packet for packet in reader.take(end.receive()) if isinstance(packet, WireSample)]
                answers = [answer for sample in samples for answer in partner.answers(sample_bytes(sample))]
                if not act(end, answers):
                    return

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield end.address
    finally:
        stop.set()
        thread.join()


def disturbed(partner: ProportionalPartner, fault: Fault, seed: int) -> Act:
    """Answers that a fault makes of them, when it lets them arrive; nothing happens before the run has begun."""
    draw = random.Random(seed)
    waiting: list[tuple[float, bytes]] = []

    def act(end: End, answers: list[bytes]) -> bool:
        for answer in answers:
            changed = fault if partner.seen[-1].sequence > 0 else undisturbed
            for packet in changed(draw, time.monotonic(), answer):
                heapq.heappush(waiting, packet)
        while waiting and waiting[0][0] <= time.monotonic():
            end.send(heapq.heappop(waiting)[1])
        return True

    return act


def run_at(address: str, made: CompiledPlant, patience: float = 10.0) -> HardwareRun:
    port = open_port(address)
    try:
        return run_plant(made, port, RealTime, patience)
    finally:
        port.close()


def assert_only_fresh_commands_act(found: HardwareRun, partner: ProportionalPartner) -> None:
    """What acts is a command of the last 20 ms, and once the plant is vented nothing else ever."""
    sent = {number: command / 1.0e6 for number, command in partner.commands.items()}
    vented = False
    for number, row in enumerate(found.traffic.rows):
        assert row.is_vented >= vented
        vented = row.is_vented
        fresh = {sent[old] for old in range(max(0, number - 19), number + 1) if old in sent}
        assert row.command == VENT if vented else row.command in fresh


@pytest.mark.parametrize("kind", WIRES)
@pytest.mark.parametrize(
    "fault",
    [
        faults(lost=0.3, late=0.0, doubled=0.0, garbled=0.0),
        faults(lost=0.0, late=0.5, doubled=0.0, garbled=0.0),
        faults(lost=0.0, late=0.2, doubled=0.5, garbled=0.0),
        faults(lost=0.05, late=0.1, doubled=0.2, garbled=0.5),
    ],
    ids=["lost", "late", "doubled", "garbled"],
)
def test_lost_late_doubled_and_garbled_packets_neither_crash_nor_act(kind: str, fault: Fault) -> None:
    partner = ProportionalPartner()
    with serving(kind, partner, disturbed(partner, fault, 5)) as address:
        found = run_at(address, plant())
    assert len(found.traffic.rows) == SAMPLES
    assert found.traffic.vent_reason in ("", SILENT)
    assert found.traffic.failure == ""
    assert_only_fresh_commands_act(found, partner)
    dropped = found.traffic.refused.total() + found.traffic.ignored.total()
    assert found.document()["missed"] + dropped > 10


def leaving(partner: ProportionalPartner) -> Act:
    """A controller that takes its end away after sample 60."""

    def act(end: End, answers: list[bytes]) -> bool:
        for answer in answers:
            end.send(answer)
        return not partner.seen or partner.seen[-1].sequence < 60

    return act


@pytest.mark.parametrize("kind", WIRES)
def test_a_controller_that_goes_away_leaves_no_pressure(kind: str) -> None:
    partner = ProportionalPartner()
    with serving(kind, partner, leaving(partner)) as address:
        found = run_at(address, plant("0.8 s"))
    # A serial device is known to be gone; a datagram that nobody takes is lost.
    assert found.traffic.vent_reason == (SILENT if kind == "udp" else BROKEN)
    assert ("the serial port failed" in found.traffic.failure) == (kind == "serial")
    assert len(found.traffic.rows) == 800
    assert_only_fresh_commands_act(found, partner)
    recording = found.result.recording
    for chamber in ("pressure_1", "pressure_2"):
        assert recording[chamber][-1] == pytest.approx(101_325.0, rel=0.05)
    assert max(recording[chamber].max() for chamber in ("pressure_1", "pressure_2")) > 2.0e5


def as_version_2(end: End, answers: list[bytes]) -> bool:
    for answer in answers:
        end.send(answer[:2] + b"\x02" + answer[3:])
    return True


@pytest.mark.parametrize("kind", WIRES)
def test_a_controller_of_another_version_is_told_in_one_line(kind: str) -> None:
    # A serial reader looks for the next packet in the rest of one that it does not know.
    said = r"^no controller answered within 0.2 s; received: .*\d+ version"
    with (
        serving(kind, ProportionalPartner(), as_version_2) as address,
        pytest.raises(ScenarioError, match=said) as told,
    ):
        run_at(address, plant(), patience=0.2)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("kind", WIRES)
@pytest.mark.parametrize("flood", [b"\xa5\x5a\x01\x02\x18", bytes(range(256))], ids=["heads", "bytes"])
def test_a_flood_neither_holds_the_plant_nor_acts(kind: str, flood: bytes) -> None:
    partner = ProportionalPartner()

    def act(end: End, answers: list[bytes]) -> bool:
        for answer in answers:
            end.send(answer)
        for _ in range(20 if partner.seen and 20 <= partner.seen[-1].sequence < SAMPLES - 1 else 0):
            # What a terminal cannot take at once is not waited for.
            if kind == "udp" or select.select([], [end.own], [], 0.0)[1]:  # type: ignore[attr-defined]
                end.send(flood)
        return True

    with serving(kind, partner, act) as address:
        found = run_at(address, plant())
    assert len(found.traffic.rows) == SAMPLES
    assert found.traffic.refused.total() > 100
    assert_only_fresh_commands_act(found, partner)


@with_terminals
def test_answers_in_two_halves_are_answers_and_halves_alone_are_none() -> None:
    partner = ProportionalPartner()

    def act(end: End, answers: list[bytes]) -> bool:
        for answer in answers:
            end.send(answer[:11])
            if partner.seen[-1].sequence < 60:
                time.sleep(1.0e-4)
                end.send(answer[11:])
        return True

    with serving("serial", partner, act) as address:
        found = run_at(address, plant())
    assert found.traffic.vent_reason == SILENT
    assert found.traffic.vented_at is not None
    assert 0.02 < found.traffic.vented_at <= 0.085
    assert found.traffic.accepted > 0
    assert found.traffic.refused.total() > 0
    assert_only_fresh_commands_act(found, partner)
