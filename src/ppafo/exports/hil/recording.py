"""A recording from a bench that speaks the protocol: its samples, put in order, as channels over time."""

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import numpy as np

from ppafo.errors import DataError
from ppafo.exports.hil import wire
from ppafo.signals import CHANNELS as KNOWN
from ppafo.signals import Channel, Recording

MOST_SAMPLES = 5_000_000
_LISTENING = 0.1
_HALF = wire.WRAP // 2


@dataclass(frozen=True, slots=True)
class Recorded:
    """A recording of a bench, and what was counted beside it.

    ``lost`` are samples whose numbers never came. ``ended`` says what ended it, ``is_stopped`` whether a person did.
    """

    recording: Recording
    lost: int
    refused: Counter[str]
    ignored: Counter[str]
    strangers: int
    ended: str
    is_stopped: bool


@final
class Collector:
    """Samples of one run of a bench, by number; the first one says which run, and which channels."""

    def __init__(self) -> None:
        self.samples: dict[int, wire.Sample] = {}
        self.ignored: Counter[str] = Counter()
        self.is_over = False
        self._first: wire.Sample | None = None
        self._newest = 0
        self._elapsed = 0

    def take(self, packet: wire.Packet) -> bool:
        """Look at a good packet; true where it is a new sample."""
        if not isinstance(packet, wire.Sample):
            self.ignored["no sample"] += 1
            return False
        first = self._first
        if first is None:
            if not packet.counts:
                self.ignored["without a channel"] += 1
                return False
            self._first = first = packet
            self._newest = packet.sequence
        if packet.run != first.run:
            self.ignored["of another run"] += 1
            return False
        self.is_over = self.is_over or bool(packet.flags & wire.OVER)
        if packet.counts.keys() != first.counts.keys():
            self.ignored["with other channels"] += 1
            return False
        number = self._newest + _difference(packet.sequence, self._newest)
        if number in self.samples:
            self.ignored["doubled"] += 1
            return False
        if number > self._newest:
            # From sample to sample: half of what a time stamp holds is 36 minutes, and a recording may be longer.
            self._elapsed += _difference(packet.time, self.samples[self._newest].time)
            self._newest = number
        self.samples[number] = packet
        return True

    @property
    def duration(self) -> float:
        """Time of the bench from its first sample to the newest [s]."""
        return max(0, self._elapsed) / wire.MICROSECONDS

    def recording(self, label: str) -> tuple[Recording, int]:
        """The samples in order as a recording, and how many between the first and the last never came.

        A sample whose time does not go on from the one before is left out and counted.
        """
        kept: list[wire.Sample] = []
        times: list[int] = []
        for number in sorted(self.samples):
            sample = self.samples[number]
            moment = sample.time if not times else times[-1] + _difference(sample.time, times[-1])
            if times and moment <= times[-1]:
                self.ignored["of a clock that went back"] += 1
                continue
            times.append(moment)
            kept.append(sample)
        names = list(kept[0].counts)
        values = {name: np.array([wire.value_of(name, sample.counts[name]) for sample in kept]) for name in names}
        channels = {name: Channel(values[name], KNOWN[name].unit) for name in names}
        computed = any(sample.flags & wire.COMPUTED for sample in kept)
        time_axis = (np.array(times, dtype=np.float64) - times[0]) / wire.MICROSECONDS
        lost = max(self.samples) - min(self.samples) + 1 - len(self.samples)
        return Recording(label, time_axis, channels, "simulated" if computed else "measured"), lost


def _difference(later: int, earlier: int) -> int:
    """How far a number of 32 bits is behind another one, which may have gone on from 0 between them."""
    return (later - earlier + _HALF) % wire.WRAP - _HALF


def record(
    port: wire.Port,
    label: str,
    duration: float | None,
    patience: float,
    is_stopped: Callable[[], bool] = lambda: False,
    clock: Callable[[], float] = time.perf_counter,
) -> Recorded:
    """Record what a bench sends: for a time of the bench [s], until it says that it is over, or until it is silent.

    ``patience`` [s] is how long silence lasts. DataError where no sample came.
    """
    reader, collector = wire.Reader(port.is_stream), Collector()
    heard = clock()
    ended = ""
    while not ended:
        data = port.receive(_LISTENING)
        fresh = [collector.take(packet) for packet in reader.take(data)]
        heard = clock() if any(fresh) else heard
        ended = _why_ended(collector, port, duration, clock() - heard >= patience, is_stopped())
    if not collector.samples:
        if is_stopped():
            raise KeyboardInterrupt("interrupted before a sample came; nothing is written")
        others = [*collector.ignored.items(), ("of somebody else", port.strangers)]
        came = wire.described_refusals(reader.refused, others)
        raise DataError(f"no sample came within {patience:g} s; what came in: {came}")
    recording, lost = collector.recording(label)
    return Recorded(recording, lost, reader.refused, collector.ignored, port.strangers, ended, is_stopped())


def _why_ended(collector: Collector, port: wire.Port, duration: float | None, is_silent: bool, is_stopped: bool) -> str:
    """What ends a recording now; empty while it goes on."""
    if is_stopped:
        return "stopped"
    if duration is not None and collector.samples and collector.duration >= duration:
        return "its duration"
    if collector.is_over:
        return "the bench said that it is over"
    if port.failure:
        return port.failure
    if len(collector.samples) >= MOST_SAMPLES:
        return f"{MOST_SAMPLES} samples"
    return "silence of the bench" if is_silent else ""
