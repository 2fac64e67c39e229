"""Events of the stride, true and as the controller detects or predicts them, and the errors of their times."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.lanes import Floats
from ppafo.model import contact as ground
from ppafo.model.helping import SWING

EVENTS = ("heel strike", "toes on", "heel off", "toes off")
"""Events of a stride, in order; 'toes on' is the foot that has come down flat."""

Samples = NDArray[np.intp]

TOO_FAR = 0.25
"""Largest distance [strides] between a true event and the known one that is taken for it."""

_AFTER = {ground.HEEL: 0, ground.FLAT: 1, ground.TOE: 2, ground.SWING: 3}
_STATE = "controller_state."
PHASE_ROW = f"{_STATE}phase.phase"
"""Row of a controller that detects phases, for the phase."""
EVENT_ROW, FRACTION_ROW = "clock.event", "clock.fraction"
"""Suffixes of the rows for the last event and the phase in the stride, of a predicting controller."""


@dataclass(frozen=True, slots=True, eq=False)
class EventErrors:
    """Errors [s] of one kind of event, above 0 where it is known late, one for each that is known at all.

    ``missed`` are true events that the controller did not know of, ``false`` those that it thought of for nothing.
    """

    errors: Floats
    missed: int
    false: int

    @property
    def rms(self) -> float:
        """Root mean square of the errors [s]; nan without any."""
        return float(np.sqrt(np.mean(self.errors**2))) if self.errors.size else float("nan")


def clock_row(record: Mapping[str, Floats], ending: str) -> Floats | None:
    """The row of a controller that predicts the gait phase, by the end of its path; None where it does not."""
    return next((row for name, row in record.items() if name.startswith(_STATE) and name.endswith(ending)), None)


def true_events(contact: Floats) -> dict[str, Samples]:
    """Samples at which each event happens, from the contact of the foot, as numbers of ``model.contact``."""
    return _starts(np.select([contact == state for state in _AFTER], list(_AFTER.values())))


def known_events(record: Mapping[str, Floats]) -> dict[str, Samples]:
    """Samples at which the controller knows of each event, from its rows (samples,) by path; {} where it has no phases.

    A controller that predicts knows when its clock passes the event; else it is detected by force.
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


def event_errors(true: Samples, known: Samples, interval: float, stride_time: float) -> EventErrors:
    """Errors of the known events against the true ones of one kind; ``interval`` [s] of samples, stride time [s].

    Each true event goes with the nearest known one within a quarter of a stride.
    """
    if not (true.size and known.size):
        return EventErrors(np.empty(0), int(true.size), int(known.size))
    # Every pair: a walk has some hundred events of a kind.
    apart = known[np.newaxis, :] - true[:, np.newaxis]
    nearest = np.argmin(np.abs(apart), axis=1)
    errors = interval * np.take_along_axis(apart, nearest[:, np.newaxis], axis=1)[:, 0]
    near = np.abs(errors) <= TOO_FAR * stride_time
    return EventErrors(errors[near], int((~near).sum()), int(known.size - np.unique(nearest[near]).size))


def within(events: Mapping[str, Samples], part: slice) -> dict[str, Samples]:
    """Return the events that lie in a part of the samples, by name."""
    return {name: times[(times >= part.start) & (times < part.stop)] for name, times in events.items()}
