"""Recording from a bench over the protocol: its samples, in order, as channels over time."""

import contextlib
import time
from array import array
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import numpy as np

from ppafo.errors import DataError
from ppafo.exports.hil import wire
from ppafo.exports.hil.ports import Port
from ppafo.signals import CHANNELS as KNOWN
from ppafo.signals import Channel, Recording, RecordingKind
from ppafo.storage.comma_separated import mark_of
from ppafo.wording import reason

MOST_SAMPLES = 5_000_000
ASIDE = ".recording"
"""Suffix to the stem of the temporary file during recording."""
# Longest wait for bytes, and time between two writings of what came [s].
_LISTENING = 0.1
_BETWEEN_KEEPING = 0.5
_HALF = wire.WRAP // 2


@dataclass(frozen=True, slots=True)
class CollectedRecording:
    """Recording of a bench, with counts of lost and discarded packets.

    ``lost`` is the number of samples that never arrived. ``ended`` is the cause of the end, and ``is_stopped`` is True
    if the user stopped the recording.
    """

    recording: Recording
    lost: int
    refused: Counter[str]
    ignored: Counter[str]
    strangers: int
    ended: str
    is_stopped: bool

    def text(self) -> str:
        """Return the numbers of recorded, lost and discarded samples as text."""
        recording, others = self.recording, [*self.ignored.items(), ("from another sender", self.strangers)]
        samples = f"{len(recording)} samples over {recording.duration:.6g} s"
        return "\n".join(
            [
                f"{samples}, {recording.kind}: {', '.join(recording.names)}",
                f"lost     {self.lost} samples between the first and the last",
                f"dropped  {wire.described_refusals(self.refused, others)}",
                f"ended    by {self.ended}",
            ]
        )

    def document(self) -> dict[str, Any]:
        """Return samples, channels, losses and the cause of the end as plain data, in SI units."""
        recording = self.recording
        return {
            "samples": len(recording),
            "duration": recording.duration,
            "kind": recording.kind,
            "channels": {name: recording.unit(name) for name in recording.names},
            "lost": self.lost,
            "refused": dict(self.refused),
            "ignored": dict(self.ignored),
            "strangers": self.strangers,
            "ended": self.ended,
        }


@final
class Collector:
    """Samples of one bench run by number; the first sample determines the run and its channels.

    A sample inconsistent with the others in number, time, run or channels waits until the next sample decides which of
    the two is the stray. The first packets may be left over from the line or an earlier run and must not decide.
    """

    def __init__(self) -> None:
        self.ignored: Counter[str] = Counter()
        self.is_over = False
        self._stray: wire.WireSample | None = None
        self._number = 0
        self._names: list[str] = []
        self._begin()

    def _begin(self) -> None:
        """Reset to no samples."""
        self._newest: wire.WireSample | None = None
        self._elapsed = 0
        self._kind: RecordingKind = "measured"
        # In the order in which they came, as plain numbers: an hour of a bench has millions of samples.
        self._numbers, self._stamps, self._counts = array("q"), array("Q"), array("i")
        self._seen: set[int] = set()
        self._kept = 0
        self._last_kept: tuple[int, int, int] | None = None

    def __len__(self) -> int:
        return len(self._numbers)

    def take(self, packet: wire.Packet) -> bool:
        """Process a valid packet; return True if it is a new sample."""
        if not isinstance(packet, wire.WireSample):
            self.ignored["no sample"] += 1
            return False
        if self._newest is None and not packet.counts:
            self.ignored["without a channel"] += 1
            return False
        newest, stray = self._newest, self._stray
        why = "" if newest is None else _why_not(newest, packet)
        if newest is None or not why:
            self._drop_stray()
            return self._keep(packet)
        if why == _DOUBLED:
            self.ignored[why] += 1
            return False
        is_alone = len(self) == 1
        # A sample that goes on from the stray alone is kept with that one; any other is the next stray.
        if stray is None or _why_not(stray, packet) or not (is_alone or _why_not(newest, stray) not in _OF_OTHERS):
            self._drop_stray()
            self._stray = packet
            return False
        if is_alone:
            # Two go on from each other and not from the first: that one was the stray.
            self.ignored["before all others"] += 1
            self._begin()
        self._stray = None
        self._keep(stray)
        return self._keep(packet)

    def _keep(self, packet: wire.WireSample) -> bool:
        """Add a sample of the run, unless its number is already present."""
        if self._newest is None:
            self._newest = packet
            self._number, self._names = packet.sequence, list(packet.counts)
        # Numbers of 32 bits wrap after 50 days at 1 kHz, time stamps after 71 minutes: both are taken as steps from the
        # newest.
        number = self._number + _difference(packet.sequence, self._newest.sequence)
        # UDP may double a packet, and a repeated sample would be a step of 0 s.
        if number in self._seen:
            self.ignored[_DOUBLED] += 1
            return False
        if number > self._number:
            # From sample to sample: half of what a time stamp holds is 36 minutes, and a recording may be longer.
            self._elapsed += _difference(packet.time, self._newest.time)
            self._number, self._newest = number, packet
        # The first sample ends nothing: it may be what is left of an earlier run.
        self.is_over = self.is_over or bool(self._numbers and packet.flags & wire.OVER)
        if packet.flags & wire.COMPUTED:
            self._kind = "simulated"
        self._seen.add(number)
        self._numbers.append(number)
        self._stamps.append(packet.time)
        self._counts.extend(packet.counts[name] for name in self._names)
        return True

    def _drop_stray(self) -> None:
        if self._stray is not None and self._newest is not None:
            self.ignored[_why_not(self._newest, self._stray) or _DOUBLED] += 1
        self._stray = None

    @property
    def duration(self) -> float:
        """Bench time [s] from the first to the newest sample."""
        return max(0, self._elapsed) / wire.MICROSECONDS

    def recording(self, label: str) -> tuple[Recording, int]:
        """Return the sorted samples as a recording, and the number of missing samples between the first and the last.

        A sample whose time does not exceed the time of the previous one is left out and counted.
        """
        self._drop_stray()
        kept: list[int] = []
        times: list[int] = []
        for index in np.argsort(np.array(self._numbers), kind="stable").tolist():
            moment = self._stamps[index] if not times else times[-1] + _difference(self._stamps[index], times[-1])
            if times and moment <= times[-1]:
                self.ignored["with a clock that ran backwards"] += 1
                continue
            times.append(moment)
            kept.append(index)
        counts = np.array(self._counts).reshape(len(self), -1)[kept]
        channels = {
            name: Channel(column / wire.counts_per_unit(name), KNOWN[name].unit)
            for name, column in zip(self._names, counts.T, strict=True)
        }
        time_axis = (np.array(times, dtype=np.float64) - times[0]) / wire.MICROSECONDS
        lost = max(self._numbers) - min(self._numbers) + 1 - len(self)
        return Recording(label, time_axis, channels, self._kind), lost

    def fresh_lines(self) -> str:
        """Return the samples received since the last call as CSV lines, at first with a header; for a temporary file.

        Samples that arrive after later ones have been written are omitted.
        """
        lines = []
        if self._newest is not None and self._last_kept is None:
            headings = ["time [s]", *(f"{name} [{KNOWN[name].unit}]" for name in self._names)]
            lines.append(f"{mark_of(self._kind)}{','.join(headings)}\n")
        fresh = sorted(range(self._kept, len(self)), key=self._numbers.__getitem__)
        self._kept = len(self)
        width = len(self._names)
        for index in fresh:
            number, stamp = self._numbers[index], self._stamps[index]
            before, stamp_before, elapsed = self._last_kept or (number, stamp, 0)
            step = _difference(stamp, stamp_before)
            if self._last_kept is not None and (number <= before or step <= 0):
                continue
            elapsed += step
            self._last_kept = (number, stamp, elapsed)
            counts = self._counts[index * width : (index + 1) * width]
            values = map(wire.value_of, self._names, counts)
            lines.append(",".join([repr(elapsed / wire.MICROSECONDS), *map(repr, values)]) + "\n")
        return "".join(lines)


_DOUBLED = "doubled"
_OF_OTHERS = ("of another run", "with other channels")
_FURTHEST = 10_000
"""Maximum number of successive lost samples (10 s at 1 kHz) before the next sample needs confirmation by another."""


def _why_not(before: wire.WireSample, packet: wire.WireSample) -> str:
    """Return the reason why a sample does not belong to the same sequence as an earlier one; empty if it does."""
    if packet.run != before.run:
        return _OF_OTHERS[0]
    # Columns of a file are fixed by its first sample.
    if packet.counts.keys() != before.counts.keys():
        return _OF_OTHERS[1]
    steps, elapsed = _difference(packet.sequence, before.sequence), _difference(packet.time, before.time)
    if not steps:
        return _DOUBLED
    if abs(steps) > _FURTHEST:
        return "of another sequence"
    return "" if elapsed * steps > 0 else "with a clock that ran backwards"


def _difference(later: int, earlier: int) -> int:
    """Difference of two 32-bit counters, with the later one possibly wrapped around."""
    return (later - earlier + _HALF) % wire.WRAP - _HALF


def record(
    port: Port,
    label: str,
    duration: float | None,
    patience: float,
    is_stopped: Callable[[], bool] = lambda: False,
    clock: Callable[[], float] = time.perf_counter,
    keep: Callable[[str], None] = lambda _lines: None,
) -> CollectedRecording:
    """Record samples of a bench for ``duration`` [s] of its time, or until it ends the recording or falls silent.

    ``patience`` [s] is the silence after which recording ends. ``keep`` receives new samples as CSV lines about once a
    second, so that little is lost if this process is killed. Raises DataError if no sample arrived.
    """
    reader, collector = wire.Reader(port.is_stream), Collector()
    heard = kept = clock()
    ended = ""
    while not ended:
        data = port.receive(_LISTENING)
        fresh = [collector.take(packet) for packet in reader.take(data)]
        heard = clock() if any(fresh) else heard
        if clock() - kept >= _BETWEEN_KEEPING:
            keep(collector.fresh_lines())
            kept = clock()
        if is_stopped():
            ended = "stopped"
        elif duration is not None and collector and collector.duration >= duration:
            ended = "its duration"
        elif collector.is_over:
            ended = "the bench ended the recording"
        elif port.failure:
            ended = port.failure
        elif len(collector) >= MOST_SAMPLES:
            ended = f"{MOST_SAMPLES} samples"
        elif clock() - heard >= patience:
            ended = "silence of the bench"
    if not collector:
        if is_stopped():
            raise KeyboardInterrupt("interrupted before the first sample; no file was written")
        others = [*collector.ignored.items(), ("from another sender", port.strangers)]
        came = wire.described_refusals(reader.refused, others)
        raise DataError(
            f"no sample arrived within {patience:g} s; received: {came}; check the connection and the sender"
        )
    recording, lost = collector.recording(label)
    return CollectedRecording(recording, lost, reader.refused, collector.ignored, port.strangers, ended, is_stopped())


@contextlib.contextmanager
def kept_aside(target: Path) -> Iterator[Callable[[str], None]]:
    """Create a temporary file beside the target that receives lines during recording, and is removed after success.

    If writing fails or is interrupted, the file remains and the error names it. A file left by a killed process raises
    DataError with advice.
    """
    aside = target.with_name(f"{target.stem}{ASIDE}{target.suffix}")
    try:
        # Exclusive: two recordings with one target must not write into one file.
        file = aside.open("xb", buffering=0)
    except FileExistsError:
        raise DataError(
            f"{aside}: contains samples of an interrupted or running recording; rename it to keep them, or remove it"
        ) from None
    except OSError as error:
        raise DataError(f"{aside}: cannot be written: {reason(error)}") from error
    is_full = False

    def keep(lines: str) -> None:
        # A disk that is full ends no recording: what came is in memory too.
        nonlocal is_full
        if lines and not is_full:
            try:
                file.write(lines.encode())
            except OSError:
                is_full = True

    left = ""
    try:
        yield keep
    except (DataError, KeyboardInterrupt) as error:
        # An empty file says nothing and goes away.
        if file.tell():
            left = f"; received samples are in {aside}"
            raise type(error)(f"{str(error) or 'interrupted'}{left}") from error
        raise
    finally:
        file.close()
        if not left:
            aside.unlink(missing_ok=True)
