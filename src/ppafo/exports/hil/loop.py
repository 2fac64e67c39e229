"""Plant side of a hardware-in-the-loop link: accepted answers, venting, and the sequence of a run.

The plant sends a sample, listens until the next one is due, and continues under the command that answered the sample,
applied from its sample on. A controller that answers in time thus acts as in a simulation.
"""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, final

from ppafo.errors import ScenarioError
from ppafo.exports.hil import wire
from ppafo.exports.hil.pacing import LoopPacing, listen_for
from ppafo.exports.hil.ports import Port
from ppafo.model.valves.kind import VENT
from ppafo.simulation.sampled import SampledRun

SILENCE = 0.020
"""Time [s] without an answer after which the plant is vented permanently."""
AFTER_STOP = 0.5
"""Time [s] for which a stopped run continues, vented and not in real time."""
LAST_PACKETS = 3
"""Number of packets that announce the end, since any of them may be lost."""
_CALL_INTERVAL = 0.01
"""Time [s] between two calls of the controller before the run begins."""
_ROUNDING = 1.0e-9
"""Rounding error of a number of periods that is whole."""

SILENT, NOT_SOUND, STOPPED, BROKEN = (
    "no answer for 20 ms",
    "the controller reported a fault",
    "stopped",
    "the port failed",
)
"""Reasons for venting the plant."""


class LogRow(NamedTuple):
    """Sample in the log: due time [s], delay of sending [s], response time of the answer [s], command [-].

    ``delay`` is None for a sample that was not sent, ``response_time`` None for one that was not answered.
    ``controller_time`` [us] is the time stamp of the newest answer, None before the first.
    """

    sequence: int
    due: float
    delay: float | None
    response_time: float | None
    command: float
    controller_time: int | None
    is_vented: bool


@final
class _AnswerFilter:
    """Filter of a controller's answers: accepts answers to waiting samples, and counts all other packets."""

    def __init__(self, run: int, period: float) -> None:
        self.run = run
        # Less the error of rounding, so that 20 ms at 1 kHz are 20 samples and not 21.
        self.patience = math.ceil(SILENCE / period - _ROUNDING)
        self.sent = -1
        self.answered = -1
        self.command = 0.0
        self.controller_time: int | None = None
        self.vent_reason = ""
        self.ignored: Counter[str] = Counter()

    def take(self, packet: wire.Packet) -> None:
        """Process a valid packet."""
        if not isinstance(packet, wire.Answer):
            self.ignored["not an answer"] += 1
        elif packet.run != self.run:
            self.ignored["of another run"] += 1
        elif packet.sequence > self.sent:
            self.ignored["with a sequence number not yet sent"] += 1
        elif packet.sequence <= self.answered:
            self.ignored["repeated or out of order"] += 1
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

    def vent(self, reason: str) -> None:
        """Vent permanently; only the first reason is stored."""
        self.vent_reason = self.vent_reason or reason

    def decide(self) -> float:
        """Return the command [-] that acts from the last sample on."""
        if self.sent - self.answered >= self.patience:
            self.vent(SILENT)
        return VENT if self.vent_reason else self.command


@dataclass(frozen=True, slots=True)
class LinkTraffic:
    """Traffic of a run: the log, counts of accepted and discarded packets, and the end of the run.

    ``refused`` counts invalid bytes and packets by cause, ``ignored`` valid packets that answered no waiting sample.
    ``pauses`` are the times [s] for which the computer was suspended. ``vent_reason`` is empty if the plant was not
    vented, and ``vented_at`` [s] is None then.
    """

    rows: tuple[LogRow, ...]
    accepted: int
    refused: Counter[str]
    ignored: Counter[str]
    strangers: int
    pauses: tuple[float, ...]
    vent_reason: str
    vented_at: float | None
    is_stopped: bool
    is_real_time: bool
    failure: str


@final
class Bench:
    """Plant on a link with samples every ``period`` [s]; ``run`` is the 16-bit number of the run."""

    def __init__(self, plant: SampledRun, period: float, port: Port, pace: LoopPacing, run: int) -> None:
        self.plant = plant
        self.port = port
        self.pace = pace
        self.period = period
        self.answers = _AnswerFilter(run, period)
        self.reader = wire.Reader(port.is_stream)
        self.accepted = 0
        self.rows: list[LogRow] = []
        self._answer_time = 0.0
        self._has_diverged = False
        self._sample = self._new_sample(wire.BEGIN)

    def run(self, patience: float, is_stopped: Callable[[], bool]) -> LinkTraffic:
        """Call the controller for at most ``patience`` [s], then run the plant to its end or until stopped.

        Raises ScenarioError if no controller answers.
        """
        self._call_controller(patience, is_stopped)
        self.pace.begin()
        self._answer_time = 0.0
        send_time, delay = 0.0, 0.0
        while self._continues and not is_stopped():
            sequence = self.plant.sample
            # The controller has the first sample already.
            if sequence:
                delay = self.pace.delay(sequence * self.period)
                send_time = self.pace.now()
                self.answers.sent = sequence
                self.port.send(wire.sample_bytes(self._sample))
            next_due = (sequence + 1) * self.period
            # In lock step no answer is waited for that will not come, or each sample would take a second.
            is_silent = self.answers.sent - self.answers.answered > 1
            is_hopeless = self.port.failure or (self.answers.vent_reason and is_silent)
            if not self.answers.is_answered and (self.pace.is_real or not is_hopeless):
                self.pace.listen(next_due, self.port, self._take)
            response_time = self._answer_time - send_time if self.answers.is_answered else None
            if self.port.failure:
                self.answers.vent(BROKEN)
            self._advance(self.answers.decide(), delay, response_time)
            self._sample = self._new_sample()
            if self._continues:
                self.pace.rest(next_due, self.port, self._take)
        is_cut_short = self._continues
        # A stopped run goes on vented for half a second, so that its end can be seen in the recording.
        if is_cut_short:
            self.answers.vent(STOPPED)
            self._announce_end()
            until = min(self.plant.samples, self.plant.sample + math.ceil(AFTER_STOP / self.period))
            while self.plant.sample < until:
                self._advance(VENT, None, None)
        self._announce_end()
        return LinkTraffic(
            rows=tuple(self.rows),
            accepted=self.accepted,
            refused=self.reader.refused,
            ignored=self.answers.ignored,
            strangers=self.port.strangers,
            pauses=tuple(self.pace.pauses),
            vent_reason=self.answers.vent_reason,
            vented_at=next((row.due for row in self.rows if row.is_vented), None),
            is_stopped=is_cut_short,
            is_real_time=self.pace.is_real,
            failure=self.port.failure,
        )

    def _call_controller(self, patience: float, is_stopped: Callable[[], bool]) -> None:
        """Repeat the first sample until it is answered, since a controller may be started later than the plant."""
        self.answers.sent = 0
        packet = wire.sample_bytes(self._sample)
        for _ in range(max(1, math.ceil(patience / _CALL_INTERVAL))):
            self.port.send(packet)
            listen_for(_CALL_INTERVAL, self.pace.clock, self.port, self._take)
            if self.answers.is_answered or is_stopped():
                break
        if self.answers.is_answered:
            return
        if is_stopped():
            raise KeyboardInterrupt("interrupted before a controller answered; no file was written")
        received = wire.described_refusals(self.reader.refused, self.answers.ignored.items())
        failure = f"; {self.port.failure}" if self.port.failure else ""
        raise ScenarioError(f"no controller answered within {patience:g} s; received: {received}{failure}")

    @property
    def _continues(self) -> bool:
        """False at the end of the run, and after the plant has diverged."""
        return self.plant.sample < self.plant.samples and not self._has_diverged

    def _take(self, data: bytes) -> bool:
        """Process received data; return True if the last sent sample has been answered."""
        for packet in self.reader.take(data):
            before = self.answers.answered
            self.answers.take(packet)
            if self.answers.answered != before:
                self.accepted += 1
                self._answer_time = self.pace.now()
        return self.answers.is_answered

    def _advance(self, command: float, delay: float | None, response_time: float | None) -> None:
        """Log the current sample, and advance the plant to the next one under a command [-]."""
        sequence = self.plant.sample
        self.rows.append(
            LogRow(
                sequence=sequence,
                due=sequence * self.period,
                delay=delay,
                response_time=response_time,
                command=command,
                controller_time=self.answers.controller_time,
                is_vented=bool(self.answers.vent_reason),
            )
        )
        self.plant.advance(command)

    def _new_sample(self, flags: int = 0) -> wire.WireSample:
        """Return the current state of the plant as the sample to send; the last one after the plant has diverged."""
        plant, measured = self.plant, self.plant.measurement()
        # No packet can carry NaN.
        self._has_diverged = not all(map(math.isfinite, measured))
        if self._has_diverged:
            return self._sample
        read = ("angle", "pressure_1", "pressure_2", "torque")
        values = {"reference": plant.reference, **{name: getattr(measured, name) for name in read}}
        return wire.WireSample(
            flags=flags | (wire.VENTED if self.answers.vent_reason else 0) | wire.COMPUTED,
            run=self.answers.run,
            sequence=plant.sample,
            time=round(plant.sample * self.period * wire.MICROSECONDS) % wire.WRAP,
            counts={name: wire.count_of(name, value) for name, value in values.items()},
        )

    def _announce_end(self) -> None:
        """Tell the controller that the run has ended."""
        packet = wire.sample_bytes(self._sample._replace(flags=self._sample.flags & ~wire.BEGIN | wire.OVER))
        for _ in range(LAST_PACKETS):
            self.port.send(packet)
