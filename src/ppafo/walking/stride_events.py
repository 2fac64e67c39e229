"""Stride events, true and as detected or predicted by the controller, and the errors of their times."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.lanes import Floats
from ppafo.model import contact as ground
from ppafo.model.helping import SWING

EVENTS = ("heel strike", "toes on", "heel off", "toes off")
"""Events of a stride, in order; at 'toes on' the foot has come down flat."""

Samples = NDArray[np.intp]

TOO_FAR = 0.25
"""Largest distance [strides] between a true event and the detection matched with it."""

_AFTER = {ground.HEEL: 0, ground.FLAT: 1, ground.TOE: 2, ground.SWING: 3}
_STATE = "controller_state."
PHASE_ROW = f"{_STATE}phase.phase"
"""Path of the row for the phase, of a controller that detects phases."""
EVENT_ROW, FRACTION_ROW = "clock.event", "clock.fraction"
"""Suffixes of the rows for the last event and the phase in the stride, of a predicting controller."""


@dataclass(frozen=True, slots=True, eq=False)
class _EventErrors:
    """Timing errors of a stride event [s], one for each matched detection; positive for a late detection.

    ``missed`` is the number of true events without a detection, ``false`` the number of detections without a true
    event.
    """

    errors: Floats
    missed: int
    false: int

    @property
    def rms(self) -> float:
        """Root mean square of the errors [s]; nan without errors."""
        return float(np.sqrt(np.mean(self.errors**2))) if self.errors.size else float("nan")


def clock_row(record: Mapping[str, Floats], ending: str) -> Floats | None:
    """Return the phase-clock row whose path ends with ``ending``; None for a controller without a phase clock."""
    return next((row for name, row in record.items() if name.startswith(_STATE) and name.endswith(ending)), None)


def true_events(contact: Floats) -> dict[str, Samples]:
    """Return the samples of each event, from the contact state of the foot (numbers of ``model.contact``)."""
    return _starts(np.select([contact == state for state in _AFTER], list(_AFTER.values())))


def known_events(record: Mapping[str, Floats]) -> dict[str, Samples]:
    """Return the samples at which the controller detects each event, from its rows (samples,) by path.

    A predicting controller registers an event when its clock passes the event, any other controller when a force
    crosses its threshold. Returns {} for a controller without phases.
    """
    predicted = clock_row(record, EVENT_ROW)
    if predicted is not None:
        return _starts(predicted)
    if PHASE_ROW not in record:
        return {}
    swing = record[PHASE_ROW] == SWING
    heel, toe = (record[f"{_STATE}phase.{name}.loaded"] > 0.5 for name in ("heel", "toe"))
    return dict(zip(EVENTS, (_rises(~swing), _rises(toe), _rises(~heel), _rises(swing)), strict=True))


def _starts(last: Floats) -> dict[str, Samples]:
    return {name: _rises(last == number) for number, name in enumerate(EVENTS)}


def _rises(is_so: NDArray[np.bool_]) -> Samples:
    # The sample at which it is so first; what is so from the start did not happen in the record.
    return np.flatnonzero(is_so[1:] & ~is_so[:-1]) + 1


def event_errors(true: Samples, known: Samples, interval: float, stride_time: float) -> _EventErrors:
    """Return the timing errors of a stride event; sample interval and stride time in [s].

    Each true event is matched with the nearest known event within a quarter of a stride.
    """
    if not (true.size and known.size):
        return _EventErrors(np.empty(0), int(true.size), int(known.size))
    # Every pair: a walk has some hundred events of a kind.
    apart = known[np.newaxis, :] - true[:, np.newaxis]
    nearest = np.argmin(np.abs(apart), axis=1)
    errors = interval * np.take_along_axis(apart, nearest[:, np.newaxis], axis=1)[:, 0]
    near = np.abs(errors) <= TOO_FAR * stride_time
    return _EventErrors(errors[near], int((~near).sum()), int(known.size - np.unique(nearest[near]).size))


def within(events: Mapping[str, Samples], part: slice) -> dict[str, Samples]:
    """Return the events within a slice of the samples, by name."""
    return {name: times[(times >= part.start) & (times < part.stop)] for name, times in events.items()}
