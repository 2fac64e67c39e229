"""A wire in virtual time: what a plant sends reaches a controller, and what that answers comes back, or does not."""

import math
import random
import socket
import struct
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from ppafo.exports.hil.wire import (
    ANSWER,
    BEGIN,
    OVER,
    VENTED,
    Answer,
    Reader,
    WireSample,
    packet_bytes,
    sample_bytes,
    value_of,
)

Fault = Callable[[random.Random, float, bytes], list[tuple[float, bytes]]]
"""What becomes of a packet that would arrive at a time [s]: packets with their times."""


def answer_bytes(answer: Answer) -> bytes:
    """The packet of a controller's answer."""
    return packet_bytes(ANSWER, answer[:4], struct.pack("<i", answer.command))


def undisturbed(_draw: random.Random, arrival: float, data: bytes) -> list[tuple[float, bytes]]:
    return [(arrival, data)]


@dataclass
class ProportionalPartner:
    """A controller in a few lines: half a full command for a newton metre of error; it keeps what it was shown."""

    unsound_from: int | None = None
    silent_from: int | None = None
    begun: int = 0
    commands: dict[int, int] = field(default_factory=dict)
    seen: list[WireSample] = field(default_factory=list)

    def answers(self, data: bytes) -> list[bytes]:
        (sample,) = Reader(is_stream=False).take(data)
        assert isinstance(sample, WireSample)
        self.seen.append(sample)
        if sample.flags & BEGIN:
            self.begun += 1
        elif sample.flags & (OVER | VENTED) or self.is_silent(sample.sequence):
            return []
        error = sample.counts["reference"] - sample.counts["torque"]
        command = max(-1_000_000, min(1_000_000, error // 2))
        self.commands[sample.sequence] = command
        is_bad = self.unsound_from is not None and sample.sequence >= self.unsound_from
        return [answer_bytes(Answer(int(is_bad), sample.run, sample.sequence, sample.time, command))]

    def is_silent(self, sequence: int) -> bool:
        return self.silent_from is not None and sequence >= self.silent_from


class ProportionalLaw:
    """The same as a Python controller of a scenario, on what the wire shows."""

    def reset(self) -> None:
        pass

    def update(self, time: float, reference: float, measurement: object) -> float:
        from ppafo.exports.hil.wire import count_of

        error = count_of("reference", reference) - count_of("torque", measurement.torque)  # type: ignore[attr-defined]
        return value_of("command", max(-1_000_000, min(1_000_000, error // 2)))


class VirtualWire:
    """A port whose clock goes on only while the plant waits; every packet of the controller takes ``latency`` [s]."""

    is_stream = False
    failure = ""
    strangers = 0

    def __init__(
        self,
        partner: Callable[[bytes], list[bytes]],
        latency: float = 3.0e-4,
        fault: Fault = undisturbed,
        seed: int = 0,
        is_stream: bool = False,
    ) -> None:
        self.time = 17.25
        self.sent: list[bytes] = []
        self.under_way: list[tuple[float, bytes]] = []
        self.sleeps: dict[int, float] = {}
        self.is_stream = is_stream
        self._partner, self._latency, self._fault = partner, latency, fault
        self._draw = random.Random(seed)

    def clock(self) -> float:
        return self.time

    def send(self, data: bytes) -> None:
        self.sent.append(data)
        for answer in self._partner(data):
            self.under_way += self._fault(self._draw, self.time + self._latency, answer)
        self.under_way.sort()
        self.time += self.sleeps.get(len(self.sent), 0.0)

    def receive(self, timeout: float) -> bytes:
        if self.under_way and self.under_way[0][0] <= self.time + timeout:
            arrival, data = self.under_way.pop(0)
            self.time = max(self.time, arrival)
            return data
        if timeout > 0.0:
            self.time = max(self.time + timeout, math.nextafter(self.time, math.inf))
        return b""

    def close(self) -> None:
        pass


def faults(lost: float, late: float, doubled: float, garbled: float) -> Fault:
    """Packets are lost, late by up to 40 ms (and so overtaken), doubled and garbled with these shares."""

    def apply(draw: random.Random, arrival: float, data: bytes) -> list[tuple[float, bytes]]:
        found = []
        for _ in range(2 if draw.random() < doubled else 1):
            if draw.random() < lost:
                continue
            delay = 0.04 * draw.random() if draw.random() < late else 0.0
            changed = bytearray(data)
            if draw.random() < garbled:
                changed[draw.randrange(len(changed))] ^= draw.randint(1, 255)
                changed = changed[: draw.randint(1, len(changed))] if draw.random() < 0.3 else changed
            found.append((arrival + delay, bytes(changed)))
        return found

    return apply


def free_port() -> int:
    """A port of UDP that nobody has."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


@contextmanager
def sending_bench(port: int, after: float = 0.0) -> Iterator[None]:
    """A bench that sends five samples and says that it is over, again and again, ``after`` some time [s]."""
    stop = threading.Event()

    def send() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as bench:
            stop.wait(after)
            while not stop.wait(0.01):
                for number in range(5):
                    sample = WireSample(OVER * (number == 4), 1, number, 1000 * number, {"angle": number, "command": 5})
                    bench.sendto(sample_bytes(sample), ("127.0.0.1", port))

    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def with_sequence(data: bytes, run: int, sequence: int) -> bytes:
    """An answer as it was, with another run and sequence number."""
    (packet,) = Reader(is_stream=False).take(data)
    assert isinstance(packet, Answer)
    return answer_bytes(packet._replace(run=run, sequence=struct.unpack("<I", struct.pack("<i", sequence))[0]))
