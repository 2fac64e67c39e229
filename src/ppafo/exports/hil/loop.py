"""Plant side of a hardware-in-the-loop link: timing, accepted answers, venting, and the sequence of a run.

The plant sends a sample, listens until the next one is due, and continues under the command that answered the sample,
applied from its sample on. A controller that answers in time thus acts as in a simulation. The time is real time, or
advances in lock step with the answers.
"""

import gc
import math
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import NamedTuple, final

from ppafo.errors import ScenarioError
from ppafo.exports.hil import wire
from ppafo.interrupts import SIGNALS
from ppafo.model.valves.kind import VENT
from ppafo.simulation.sampled import SampledRun

_AT_ONCE = 64
"""Maximum number of packets processed without checking the clock, so that a flood of packets cannot block the plant."""
Take = Callable[[bytes], bool]
"""Function that processes received bytes and returns True if the awaited packet has arrived."""


def _listen_for(seconds: float, clock: Callable[[], float], port: wire.Port, take: Take) -> None:
    """Pass received data to ``take`` for some seconds of a clock, or until ``take`` returns True.

    Data received while the computer was suspended past the end is passed too.
    """
    end = clock() + seconds
    while (left := end - clock()) > 0.0:
        data = port.receive(left)
        if data and take(data):
            return
    _drain(port, take)


def _drain(port: wire.Port, take: Take) -> None:
    """Pass data already received to ``take``, up to a limited number of packets."""
    for _ in range(_AT_ONCE):
        data = port.receive(0.0)
        if not data:
            return
        take(data)


@final
class RealTime:
    """Real time; plant time is paused while the computer is suspended for more than a period.

    ``clock`` returns the time [s].
    """

    is_real = True

    def __init__(self, period: float, clock: Callable[[], float] = time.perf_counter) -> None:
        self.stood_still: list[float] = []
        self.clock = clock
        self._period = period
        self._start = clock()

    def begin(self) -> None:
        """Set the time to zero now."""
        self._start = self.clock()

    def now(self) -> float:
        """Time [s] since the start, without pauses."""
        return self.clock() - self._start

    def late(self, due: float) -> float:
        """Return the delay [s] with respect to a due time [s]; a delay above one period pauses the time."""
        missed = max(0.0, self.now() - due)
        # Less than a period late is jitter, which the next sample makes up; more would be made up by a burst of
        # samples.
        if missed > self._period:
            self.stood_still.append(missed)
            self._start += missed
        return missed

    def listen(self, until: float, port: wire.Port, take: Take) -> None:
        """Pass received data to ``take`` until the time ``until`` [s], or until ``take`` returns True."""
        _listen_for(until - self.now(), self.clock, port, take)

    def rest(self, until: float, port: wire.Port, take: Take) -> None:
        """Pass received data to ``take`` until the time ``until`` [s]."""
        while (left := until - self.now()) > 0.0:
            data = port.receive(left)
            if data:
                take(data)


@final
class LockStep:
    """Simulated time that waits for each answer, at most for ``patience`` [s] of a clock."""

    is_real = False

    def __init__(self, patience: float = 1.0, clock: Callable[[], float] = time.perf_counter) -> None:
        self.stood_still: list[float] = []
        self.clock = clock
        self._patience = patience
        self._now = 0.0

    def begin(self) -> None:
        """Set the time to zero."""
        self._now = 0.0

    def now(self) -> float:
        """Time [s] of the current sample."""
        return self._now

    def late(self, due: float) -> float:
        """Advance to a due time [s]; the delay is always 0."""
        self._now = due
        return 0.0

    def listen(self, until: float, port: wire.Port, take: Take) -> None:
        """Pass received data to ``take`` until it returns True, at most for ``patience`` [s]."""
        del until
        _listen_for(self._patience, self.clock, port, take)

    def rest(self, until: float, port: wire.Port, take: Take) -> None:
        """Pass data already received to ``take``."""
        del until
        _drain(port, take)


LoopPacing = RealTime | LockStep
"""Time stepping of the plant: real time or lock step; ``is_real`` if times are meaningful."""


@contextmanager
def stop_by_interrupt() -> Iterator[Callable[[], bool]]:
    """Turn the first termination signal, such as Ctrl-C, into a stop request; a second one raises KeyboardInterrupt."""
    asked = threading.Event()

    def ask(_signal: int, _frame: object) -> None:
        if asked.is_set():
            raise KeyboardInterrupt
        # The first signal lets the run vent and end in order; only the second one breaks it off.
        asked.set()

    if threading.current_thread() is not threading.main_thread():
        yield asked.is_set
        return
    known = [getattr(signal, name) for name in SIGNALS if hasattr(signal, name)]
    # A shell has background jobs ignore Ctrl-C; they end all the same when they are sent the signal.
    heard = [number for number in known if number == signal.SIGINT or signal.getsignal(number) != signal.SIG_IGN]
    before = {number: signal.signal(number, ask) for number in heard}
    try:
        yield asked.is_set
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def without_collections() -> Iterator[None]:
    """Disable Python's garbage collection, which takes milliseconds, within a ``with`` block."""
    was_on = gc.isenabled()
    # Now, so that nothing is left to collect for long.
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


SILENCE = 0.020
"""Time [s] without an answer after which the plant is vented permanently."""
AFTER_STOP = 0.5
"""Time [s] for which a stopped run continues, vented and not in real time."""
LAST_PACKETS = 3
"""Number of packets that announce the end, since any of them may be lost."""
# Between two calls of the controller [s]; and a number of periods that is whole but for rounding.
_CALL_INTERVAL = 0.01
_WHOLE = 1.0e-9

SILENT, NOT_SOUND, STOPPED, BROKEN = (
    "no answer for 20 ms",
    "the controller reported a fault",
    "stopped",
    "the port broke",
)
"""Reasons for venting the plant."""


class LogRow(NamedTuple):
    """Sample in the log: due time [s], delay of sending [s], response time of the answer [s], command [-].

    ``sent_late`` is None for a sample that was not sent, ``answered_after`` None for one that was not answered.
    ``controller_time`` [us] is the time stamp of the newest answer, None before the first.
    """

    sequence: int
    due: float
    sent_late: float | None
    answered_after: float | None
    command: float
    controller_time: int | None
    is_vented: bool


@final
class AnswerFilter:
    """Filter of a controller's answers: accepts answers to waiting samples, and counts all other packets."""

    def __init__(self, run: int, period: float) -> None:
        self.run = run
        # 1e-9 below, so that 20 ms at 1 kHz are 20 samples and not 21 by rounding.
        self.patience = math.ceil(SILENCE / period - _WHOLE)
        self.sent = -1
        self.answered = -1
        self.command = 0.0
        self.controller_time: int | None = None
        self.vented = ""
        self.ignored: Counter[str] = Counter()

    def take(self, packet: wire.Packet) -> None:
        """Process a valid packet."""
        if not isinstance(packet, wire.Answer):
            self.ignored["no answer"] += 1
        elif packet.run != self.run:
            self.ignored["of another run"] += 1
        elif packet.sequence > self.sent:
            self.ignored["ahead of its sample"] += 1
        elif packet.sequence <= self.answered:
            self.ignored["doubled or overtaken"] += 1
        # An answer older than the watchdog allows would act on a state that is long gone.
        elif self.sent - packet.sequence >= self.patience:
            self.ignored["too late"] += 1
        else:
            self.answered = packet.sequence
            self.command = packet.command / wire.FULL_COMMAND
            self.controller_time = packet.time
            if packet.flags & wire.UNSOUND:
                self.vent(NOT_SOUND)

    @property
    def is_answered(self) -> bool:
        """True if the last sent sample has been answered."""
        return self.answered == self.sent

    def vent(self, why: str) -> None:
        """Vent permanently; only the first reason is stored."""
        self.vented = self.vented or why

    def decide(self) -> float:
        """Return the command [-] that acts from the last sample on."""
        if self.sent - self.answered >= self.patience:
            self.vent(SILENT)
        return VENT if self.vented else self.command


@dataclass(frozen=True, slots=True)
class LinkTraffic:
    """Traffic of a run: the log, counts of accepted and discarded packets, and the end of the run.

    ``refused`` counts invalid bytes and packets by cause, ``ignored`` valid packets that answered no waiting sample.
    ``stood_still`` are the times [s] for which the computer was suspended. ``vented`` is the reason for venting the
    plant, empty if it was not vented, and ``vented_at`` [s] its time, or None.
    """

    rows: tuple[LogRow, ...]
    taken: int
    refused: Counter[str]
    ignored: Counter[str]
    strangers: int
    stood_still: tuple[float, ...]
    vented: str
    vented_at: float | None
    is_stopped: bool
    is_real_time: bool
    failure: str


@final
class Bench:
    """Plant on a link with samples every ``period`` [s]; ``run`` is the 16-bit number of the run."""

    def __init__(self, plant: SampledRun, period: float, port: wire.Port, pace: LoopPacing, run: int) -> None:
        self.plant = plant
        self.port = port
        self.pace = pace
        self.period = period
        self.judge = AnswerFilter(run, period)
        self.reader = wire.Reader(port.is_stream)
        self.taken = 0
        self.rows: list[LogRow] = []
        self._answered_at = 0.0
        self._has_diverged = False
        self._show(0)

    def run(self, patience: float, is_stopped: Callable[[], bool]) -> LinkTraffic:
        """Call the controller for at most ``patience`` [s], then run the plant to its end or until stopped.

        Raises ScenarioError if no controller answers.
        """
        self.judge.sent = 0
        self._show(wire.BEGIN)
        # The first sample is repeated until somebody answers: a controller may be started later than the plant.
        first = wire.sample_bytes(self._shown)
        for _ in range(max(1, math.ceil(patience / _CALL_INTERVAL))):
            self.port.send(first)
            _listen_for(_CALL_INTERVAL, self.pace.clock, self.port, self._take)
            if self.judge.is_answered or is_stopped():
                break
        if not self.judge.is_answered:
            if is_stopped():
                raise KeyboardInterrupt("interrupted before a controller answered; nothing is written")
            heard = wire.described_refusals(self.reader.refused, self.judge.ignored.items())
            failed = f"; {self.port.failure}" if self.port.failure else ""
            raise ScenarioError(f"no controller answered within {patience:g} s; received: {heard}{failed}")
        self.pace.begin()
        self._answered_at = 0.0
        sent, late = 0.0, 0.0
        while self._is_going_on and not is_stopped():
            if self.plant.sample:
                late = self.pace.late(self.plant.sample * self.period)
                sent = self.pace.now()
                self.judge.sent = self.plant.sample
                self.port.send(wire.sample_bytes(self._shown))
            next_due = (self.plant.sample + 1) * self.period
            # Nothing is to come where the port broke, or the plant is vented and the last sample had no answer.
            is_given_up = bool(self.port.failure or (self.judge.vented and self.judge.sent - self.judge.answered > 1))
            # In lock step nothing is waited for then, or each sample would take a second.
            if not self.judge.is_answered and (self.pace.is_real or not is_given_up):
                self.pace.listen(next_due, self.port, self._take)
            answered = self._answered_at - sent if self.judge.is_answered else None
            if self.port.failure:
                self.judge.vent(BROKEN)
            self._go_on(self.judge.decide(), late, answered)
            self._show(0)
            if self._is_going_on:
                self.pace.rest(next_due, self.port, self._take)
        stopped = self._is_going_on
        # A stopped run goes on vented for half a second, so that its end can be seen in the recording.
        if stopped:
            self.judge.vent(STOPPED)
            self._say_over()
            until = min(self.plant.samples, self.plant.sample + math.ceil(AFTER_STOP / self.period))
            while self.plant.sample < until:
                self._go_on(VENT, None, None)
        self._say_over()
        vented = next((row.due for row in self.rows if row.is_vented), None)
        return LinkTraffic(
            rows=tuple(self.rows),
            taken=self.taken,
            refused=self.reader.refused,
            ignored=self.judge.ignored,
            strangers=self.port.strangers,
            stood_still=tuple(self.pace.stood_still),
            vented=self.judge.vented,
            vented_at=vented,
            is_stopped=stopped,
            is_real_time=self.pace.is_real,
            failure=self.port.failure,
        )

    def _go_on(self, command: float, sent_late: float | None, answered_after: float | None) -> None:
        """Log the current sample, and advance the plant to the next one under a command [-]."""
        sequence = self.plant.sample
        self.rows.append(
            LogRow(
                sequence=sequence,
                due=sequence * self.period,
                sent_late=sent_late,
                answered_after=answered_after,
                command=command,
                controller_time=self.judge.controller_time,
                is_vented=bool(self.judge.vented),
            )
        )
        self.plant.advance(command)

    def _take(self, data: bytes) -> bool:
        """Process received data; return True if the last sent sample has been answered."""
        for packet in self.reader.take(data):
            before = self.judge.answered
            self.judge.take(packet)
            if self.judge.answered != before:
                self.taken += 1
                self._answered_at = self.pace.now()
        return self.judge.is_answered

    @property
    def _is_going_on(self) -> bool:
        """False at the end of the run, and after the plant has diverged."""
        return self.plant.sample < self.plant.samples and not self._has_diverged

    def _show(self, flags: int) -> None:
        """Store the current state of the plant as the sample to send."""
        plant, seen = self.plant, self.plant.measurement()
        # No packet can carry NaN: the last good sample stays shown.
        self._has_diverged = not all(map(math.isfinite, seen))
        if self._has_diverged:
            return
        shown = {
            "reference": plant.reference,
            "angle": seen.angle,
            "pressure_1": seen.pressure_1,
            "pressure_2": seen.pressure_2,
            "torque": seen.torque,
        }
        self._shown = wire.WireSample(
            flags=flags | (wire.VENTED if self.judge.vented else 0) | wire.COMPUTED,
            run=self.judge.run,
            sequence=plant.sample,
            time=round(plant.sample * self.period * wire.MICROSECONDS) % wire.WRAP,
            counts={name: wire.count_of(name, value) for name, value in shown.items()},
        )

    def _say_over(self) -> None:
        """Tell the controller that the run has ended."""
        packet = wire.sample_bytes(self._shown._replace(flags=self._shown.flags & ~wire.BEGIN | wire.OVER))
        for _ in range(LAST_PACKETS):
            self.port.send(packet)
