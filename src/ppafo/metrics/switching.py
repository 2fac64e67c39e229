"""Switching and oscillation of a task: state changes of the valves, and reversals of the controlled quantity.

The state of a valve is the one commanded at each sample: valve A of a pair is on above 0, valve B below, and both are
off at 0 and while the command vents. Each change of each valve counts as one, so a reversal of a pair counts as two. A
proportional valve has a path from the supply to each chamber, open or shut; these paths count like the valves of a
pair, by the number of times that the command leaves 0 or returns, not by the spool travel. A coil whose
``switching_interval`` is longer than the time between two commands changes less often than commanded; so does a spool
with a dead band.
"""

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from ppafo.metrics.metric import (
    Floats,
    MetricKind,
    Readings,
    extent,
    followed,
    for_each_reference,
    hold,
    metered,
    ramp,
    spans,
)
from ppafo.model.columns import choose, larger
from ppafo.model.valves.kind import VENTS_ABOVE
from ppafo.signals import Recording
from ppafo.signals.meter import MeterKind, ReferenceSummary, Sample

OSCILLATION_THRESHOLD = 0.05
"""Smallest reversal that counts as oscillation, as a fraction of the extent of the reference [-]."""

SHUT = 1.0e-6
"""Largest command of a valve that is off [-], above rounding error."""

_NEEDED = ("torque", "reference")
UNDECIDED = 0.0
_REVERSALS = "torque reversals of more than 5 % of the largest reference"


def switchings(recording: Recording) -> float:
    """Number of commanded state changes of both valves."""
    # As ``ordered_positions`` says it of one command.
    command = recording["command"]
    positions_a = (command > SHUT) & (command < VENTS_ABOVE)
    positions_b = command < -SHUT
    return float(np.count_nonzero(np.diff(positions_a)) + np.count_nonzero(np.diff(positions_b)))


def reversals(values: Floats, swing: float) -> int:
    """Return the number of reversals of a signal by more than ``swing`` [unit of the signal].

    A reversal is a turn by more than ``swing`` from the last extreme; smaller fluctuations never count. A monotone
    signal has no reversal.
    """
    # No way yet: the first swing, up or down, is no reversal.
    count = 0
    direction = 0
    lowest = highest = float(values[0])
    # The first and the last value, and each between them at which the signal turns back: the rest decide nothing.
    moving = values[np.flatnonzero(np.diff(values, prepend=np.nan))]
    if moving.size > 1:
        rises = np.diff(moving) > 0.0
        moving = moving[np.concatenate([[True], rises[1:] != rises[:-1], [True]])]
    for value in moving.tolist():
        if direction >= 0 and value < highest - swing:
            count += direction
            direction = -1
            lowest = value
        elif direction <= 0 and value > lowest + swing:
            count -= direction
            direction = 1
            highest = value
        lowest = min(lowest, value)
        highest = max(highest, value)
    return count


def oscillations(recording: Recording, part_of: Callable[[Recording], slice | None]) -> float | None:
    """Number of reversals above 5 % of the reference extent in a part of a task; None without that part."""
    part = part_of(recording)
    largest = extent(recording)
    # Without a reference there is nothing that the smallest swing could be a fraction of.
    if part is None or largest == 0.0:
        return None
    return float(reversals(followed(recording)[1][part], OSCILLATION_THRESHOLD * largest))


class Switchings(NamedTuple):
    """State of the switching meter: positions of valves A and B (1 for on), number of changes."""

    position_a: float
    position_b: float
    changes: float


def ordered_positions(command: float) -> tuple[float, float]:
    """Commanded positions of valves A and B [-]: 1 on, 0 off."""
    return (1.0 if command > SHUT and command < VENTS_ABOVE else 0.0), (1.0 if command < -SHUT else 0.0)


def start_switchings(course: ReferenceSummary, sample: Sample) -> Switchings:
    """Start the switching meter at the first sample."""
    position_a, position_b = ordered_positions(sample.command)
    return Switchings(position_a, position_b, 0.0)


def update_switchings(state: Switchings, course: ReferenceSummary, sample: Sample) -> Switchings:
    """Update the switching meter: count each valve whose commanded position changes."""
    position_a, position_b = ordered_positions(sample.command)
    changes = abs(position_a - state.position_a) + abs(position_b - state.position_b)
    return Switchings(position_a, position_b, state.changes + changes)


SWITCHINGS = MeterKind("switchings", Switchings, start_switchings, update_switchings)


class Swing(NamedTuple):
    """State of a reversal counter, updated sample by sample.

    ``play`` follows the signal with a backlash of one swing: it stays between the signal and one swing below, and moves
    only if the signal goes on or turns back by more. ``turns`` is positive while the signal rises and negative while it
    falls; its absolute value is 1 plus the number of reversals. It is UNDECIDED before the first rise or fall.
    ``highest`` is the highest value.
    """

    play: float
    turns: float
    highest: float


def next_swing(state: Swing, value: float, swing: float) -> Swing:
    """Update a reversal counter with a value; ``swing`` is the smallest reversal, in the unit of the value."""
    # The sign of ``turns`` is the way and its size counts: a turn changes the one and adds 1 to the other.
    play = min(max(state.play, value - swing), value)
    turns_back = (play - state.play) * state.turns < 0.0
    turned = -state.turns + (1.0 if state.turns < 0.0 else -1.0)
    first = (1.0 if play > state.play else 0.0) - (1.0 if value < state.highest - swing else 0.0)
    turns = first if state.turns == UNDECIDED else turned if turns_back else state.turns
    return Swing(play, turns, max(state.highest, value))


def begun_swing(swing: Swing, value: float, anew: bool) -> Swing:
    """Return a reversal state with a value, or that of a part that begins ``anew`` with the value."""
    return Swing(value if anew else swing.play, UNDECIDED if anew else swing.turns, value if anew else swing.highest)


def count_of(turns: Floats) -> Floats:
    """Number of reversals (runs,) from ``Swing.turns``."""
    found: Floats = larger(abs(turns) - 1.0, 0.0)
    return found


class _Oscillations(NamedTuple):
    """State of the oscillation meter: reversals of ramp, then hold; ``turns_on_ramp`` is final for the ramp."""

    swing: Swing
    turns_on_ramp: float


def start_oscillations(course: ReferenceSummary, sample: Sample) -> _Oscillations:
    """Start the oscillation meter at the first sample."""
    value = sample.value
    return _Oscillations(Swing(value, UNDECIDED, value), UNDECIDED)


def update_oscillations(state: _Oscillations, course: ReferenceSummary, sample: Sample) -> _Oscillations:
    """Update the oscillation meter; the first sample of the hold is also the last of the ramp."""
    value = sample.value
    swing = next_swing(state.swing, value, OSCILLATION_THRESHOLD * course.largest)
    anew = course.hold_start == sample.number
    return _Oscillations(begun_swing(swing, value, anew), swing.turns if anew else state.turns_on_ramp)


OSCILLATIONS = MeterKind("oscillations", _Oscillations, start_oscillations, update_oscillations, True)


def read_oscillations_ramp(readings: Readings) -> Floats:
    """Metric ``oscillations_ramp`` of runs without recording: number of reversals on the ramp."""
    return _where_swinging(readings, spans(readings)[0], count_of(readings.meters[OSCILLATIONS.name].turns_on_ramp))


def read_oscillations_hold(readings: Readings) -> Floats:
    """Metric ``oscillations_hold`` of runs without recording: number of reversals on the hold."""
    return _where_swinging(readings, spans(readings)[1], count_of(readings.meters[OSCILLATIONS.name].swing.turns))


def _where_swinging(readings: Readings, span: Floats, count: Floats) -> Floats:
    """Number of reversals; nan if that part of the task is absent, or the reference is always 0."""
    found: Floats = choose(span > 0.0, choose(readings.course.largest != 0.0, count, math.nan), math.nan)
    return found


_OSCILLATIONS = tuple(
    MetricKind(
        f"oscillations_{part_of.__name__}",
        "-",
        f"{_REVERSALS}, on the {part_of.__name__}",
        _NEEDED,
        partial(oscillations, part_of=part_of),
        read,
        (OSCILLATIONS,),
    )
    for part_of, read in ((ramp, read_oscillations_ramp), (hold, read_oscillations_hold))
)
_SWITCHED = "valves switched on or off by the command, each of a pair counted: a reversal is 2"
METRICS = (
    metered(switchings, "-", _SWITCHED, ("command",), (SWITCHINGS, "changes"), better=-1),
    *for_each_reference(_OSCILLATIONS, lambda name, controlled: f"{controlled}_{name}"),
)
