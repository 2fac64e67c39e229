"""The plant's side of the wire: what it takes of a controller, when it vents, and how a run goes.

The plant sends a sample, listens until the next one is due, and goes on from that sample under the command that
answered it. So a controller that answers in time decides as in a simulation.
"""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, final

from ppafo.errors import ScenarioError
from ppafo.exports.hil.pace import Pace
from ppafo.exports.hil.packets import (
    BEGIN,
    COMPUTED,
    FULL_COMMAND,
    MICROSECONDS,
    OVER,
    UNSOUND,
    VENTED,
    WRAP,
    Answer,
    Packet,
    Reader,
    Sample,
    count_of,
    described_refusals,
    sample_bytes,
)
from ppafo.exports.hil.ports import Port
from ppafo.model.command import VENT
from ppafo.simulation.sampled import SampledRun

SILENCE = 0.020
"""Seconds without an answer after which the plant is vented, for good."""
AFTER_STOP = 0.5
"""Seconds that a run goes on, vented, after it was stopped; not in real time."""
LAST_PACKETS = 3
"""How often the end is said: any of them may be lost."""
_CALL_INTERVAL = 0.01
_WHOLE = 1.0e-9

SILENT, NOT_SOUND, STOPPED, BROKEN = (
    "no answer for 20 ms",
    "the controller says that it is not sound",
    "stopped",
    "the port broke",
)
"""Why a plant is vented."""


class Row(NamedTuple):
    """A sample in the log: when it was due [s], how late it was sent [s], after how long it was answered [s].

    None stands for a sample that was not sent, or not answered; ``controller_time`` [us] is the time stamp of the
    newest answer, None before the first.
    """

    sequence: int
    due: float
    sent_late: float | None
    answered_after: float | None
    command: float
    controller_time: int | None
    is_vented: bool


@final
class Judge:
    """What a plant takes of a controller. Everything that is not the answer to a sample that waits is counted."""

    def __init__(self, run: int, period: float) -> None:
        self.run = run
        self.patience = math.ceil(SILENCE / period - _WHOLE)
        self.sent = -1
        self.answered = -1
        self.command = 0.0
        self.controller_time: int | None = None
        self.vented = ""
        self.ignored: Counter[str] = Counter()

    def take(self, packet: Packet) -> None:
        """Look at a good packet that came in."""
        if not isinstance(packet, Answer):
            self.ignored["no answer"] += 1
        elif packet.run != self.run:
            self.ignored["of another run"] += 1
        elif packet.sequence > self.sent:
            self.ignored["ahead of its sample"] += 1
        elif packet.sequence <= self.answered:
            self.ignored["doubled or overtaken"] += 1
        elif self.sent - packet.sequence >= self.patience:
            self.ignored["too late"] += 1
        else:
            self.answered = packet.sequence
            self.command = packet.command / FULL_COMMAND
            self.controller_time = packet.time
            if packet.flags & UNSOUND:
                self.vent(NOT_SOUND)

    @property
    def is_answered(self) -> bool:
        """True once the last sample that was sent has its answer."""
        return self.answered == self.sent

    def vent(self, why: str) -> None:
        """Vent, for good; the first reason is kept."""
        self.vented = self.vented or why

    def decide(self) -> float:
        """The command that acts from the last sample on [-]."""
        if self.sent - self.answered >= self.patience:
            self.vent(SILENT)
        return VENT if self.vented else self.command


@dataclass(frozen=True, slots=True)
class Exchange:
    """What went over the wire in a run: the log, what was taken, what was counted, what ended it.

    ``refused`` are bytes that were no good packet, ``ignored`` good packets that were no answer to a sample that
    waited. ``stood_still`` are the times [s] through which the computer slept. ``vented`` says why the plant was
    vented, at ``vented_at`` [s]; it is empty, and None, where it was not.
    """

    rows: tuple[Row, ...]
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
    """A plant at the wire, whose samples are ``period`` [s] apart; ``run`` is the number of the run, of 16 bits."""

    def __init__(self, plant: SampledRun, period: float, port: Port, pace: Pace, run: int) -> None:
        self.plant = plant
        self.port = port
        self.pace = pace
        self.period = period
        self.judge = Judge(run, period)
        self.reader = Reader(port.is_stream)
        self.taken = 0
        self.rows: list[Row] = []
        self._answered_at = 0.0
        self._has_diverged = False
        self._show(0)

    def run(self, patience: float, is_stopped: Callable[[], bool]) -> Exchange:
        """Call the controller, at most for ``patience`` [s], and run the plant to its end or until it is stopped.

        ScenarioError where nobody answers.
        """
        if not self._call(patience, is_stopped):
            if is_stopped():
                raise KeyboardInterrupt("interrupted before a controller answered; nothing is written")
            heard = described_refusals(self.reader.refused, self.judge.ignored.items())
            failed = f"; {self.port.failure}" if self.port.failure else ""
            raise ScenarioError(f"no controller answers within {patience:g} s; came in: {heard}{failed}")
        self.pace.begin()
        self._answered_at = 0.0
        sent, late = 0.0, 0.0
        while self._is_going_on and not is_stopped():
            if self.plant.taken:
                late = self.pace.late(self.plant.taken * self.period)
                sent = self.pace.now()
                self.judge.sent = self.plant.taken
                self.port.send(sample_bytes(self._shown))
            self._exchange(sent, late)
        stopped = self._is_going_on
        if stopped:
            self._vent_to_the_end()
        self._say_over()
        vented = next((row.due for row in self.rows if row.is_vented), None)
        return Exchange(
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

    def _call(self, patience: float, is_stopped: Callable[[], bool]) -> bool:
        """Send the first sample until it is answered; false where it was not."""
        self.judge.sent = 0
        self._show(BEGIN)
        first = sample_bytes(self._shown)
        for _ in range(max(1, math.ceil(patience / _CALL_INTERVAL))):
            self.port.send(first)
            self.pace.call(_CALL_INTERVAL, self.port, self._take)
            if self.judge.is_answered or is_stopped():
                break
        return self.judge.is_answered

    def _exchange(self, sent: float, late: float) -> None:
        """Wait for the answer to the sample that was sent [s], go on under it, and wait until the next one is due."""
        sequence = self.plant.taken
        next_due = (sequence + 1) * self.period
        if not self.judge.is_answered and (self.pace.is_real or not self._is_given_up):
            self.pace.listen(next_due, self.port, self._take)
        answered = self._answered_at - sent if self.judge.is_answered else None
        if self.port.failure:
            self.judge.vent(BROKEN)
        command = self.judge.decide()
        self.rows.append(
            Row(
                sequence=sequence,
                due=sequence * self.period,
                sent_late=late,
                answered_after=answered,
                command=command,
                controller_time=self.judge.controller_time,
                is_vented=bool(self.judge.vented),
            )
        )
        self.plant.go_on(command)
        self._show(0)
        if self._is_going_on:
            self.pace.rest(next_due, self.port, self._take)

    def _take(self, data: bytes) -> bool:
        """Take what came in; true where the sample that was sent is answered."""
        for packet in self.reader.take(data):
            before = self.judge.answered
            self.judge.take(packet)
            if self.judge.answered != before:
                self.taken += 1
                self._answered_at = self.pace.now()
        return self.judge.is_answered

    @property
    def _is_given_up(self) -> bool:
        """True where nothing is to come: the port broke, or the plant is vented and the last sample had no answer."""
        return bool(self.port.failure) or (bool(self.judge.vented) and self.judge.sent - self.judge.answered > 1)

    @property
    def _is_going_on(self) -> bool:
        """False at the end of the run, and where the plant has left what is possible."""
        return self.plant.taken < self.plant.samples and not self._has_diverged

    def _show(self, flags: int) -> None:
        """Make the plant's present state the sample that is shown."""
        plant, seen = self.plant, self.plant.measurement()
        self._has_diverged = not all(map(math.isfinite, seen))
        if self._has_diverged:
            return
        shown = {
            "reference": plant.requested,
            "angle": seen.angle,
            "pressure_1": seen.pressure_1,
            "pressure_2": seen.pressure_2,
            "torque": seen.torque,
        }
        self._shown = Sample(
            flags=flags | (VENTED if self.judge.vented else 0) | COMPUTED,
            run=self.judge.run,
            sequence=plant.taken,
            time=round(plant.taken * self.period * MICROSECONDS) % WRAP,
            counts={name: count_of(name, value) for name, value in shown.items()},
        )

    def _vent_to_the_end(self) -> None:
        """Go on for ``AFTER_STOP`` with both chambers vented, not in real time."""
        self.judge.vent(STOPPED)
        self._say_over()
        until = min(self.plant.samples, self.plant.taken + math.ceil(AFTER_STOP / self.period))
        while self.plant.taken < until:
            sequence = self.plant.taken
            self.rows.append(
                Row(
                    sequence=sequence,
                    due=sequence * self.period,
                    sent_late=None,
                    answered_after=None,
                    command=VENT,
                    controller_time=self.judge.controller_time,
                    is_vented=True,
                )
            )
            self.plant.go_on(VENT)

    def _say_over(self) -> None:
        """Tell the controller that the run is over."""
        packet = sample_bytes(self._shown._replace(flags=self._shown.flags & ~BEGIN | OVER))
        for _ in range(LAST_PACKETS):
            self.port.send(packet)
