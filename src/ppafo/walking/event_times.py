"""When the events of a stride happen, when the controller knows of them, and how far apart both are."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.control.walking import phases
from ppafo.engine.lanes import Floats
from ppafo.model import contact as ground

EVENTS = ("heel strike", "toes on", "heel off", "toes off")
"""In the order of a stride; 'toes on' is the foot that has come down flat."""

Samples = NDArray[np.intp]

TOO_FAR = 0.25
"""Fraction of a stride: what the controller takes for an event further from it than this is not that event."""

_AFTER = {ground.HEEL: 0, ground.FLAT: 1, ground.TOE: 2, ground.SWING: 3}
_STATE = "controller_state."
EVENT_ROW, FRACTION_ROW = "clock.event", "clock.fraction"
"""How the rows end in which a controller that predicts keeps the last event and the fraction of the stride."""


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
    """The row of a controller that predicts the time in the stride, by the end of its path; None where it does not."""
    return next((row for name, row in record.items() if name.startswith(_STATE) and name.endswith(ending)), None)


def true_events(contact: Floats) -> dict[str, Samples]:
    """Samples at which each event happens, from where the foot stands, as in ``model.contact``."""
    last = np.select([contact == state for state in _AFTER], list(_AFTER.values()))
    return _begun(last)


def known_events(record: Mapping[str, Floats]) -> dict[str, Samples]:
    """Samples at which the controller knows of each event, from its rows (samples,) by path; {} where it has no phases.

    A controller that predicts knows when its clock passes the event; else it is detected by force.
    """
    predicted = clock_row(record, EVENT_ROW)
    if predicted is not None:
        return _begun(predicted)
    if f"{_STATE}phase.phase" not in record:
        return {}
    swing = record[f"{_STATE}phase.phase"] == phases.SWING
    heel, toe = (record[f"{_STATE}phase.{name}.loaded"] > 0.5 for name in ("heel", "toe"))
    return dict(zip(EVENTS, (_rises(~swing), _rises(toe), _rises(~heel), _rises(swing)), strict=True))


def _begun(last: Floats) -> dict[str, Samples]:
    return {name: _rises(last == number) for number, name in enumerate(EVENTS)}


def _rises(is_so: NDArray[np.bool_]) -> Samples:
    return np.flatnonzero(is_so[1:] & ~is_so[:-1]) + 1


def event_errors(true: Samples, known: Samples, interval: float, stride_time: float) -> EventErrors:
    """Errors of the known events against the true ones of one kind; ``interval`` [s] of samples, stride time [s].

    Each true event goes with the nearest known one within a quarter of a stride.
    """
    if not (true.size and known.size):
        return EventErrors(np.empty(0), int(true.size), int(known.size))
    apart = known[np.newaxis, :] - true[:, np.newaxis]
    nearest = np.argmin(np.abs(apart), axis=1)
    errors = interval * np.take_along_axis(apart, nearest[:, np.newaxis], axis=1)[:, 0]
    near = np.abs(errors) <= TOO_FAR * stride_time
    return EventErrors(errors[near], int((~near).sum()), int(known.size - np.unique(nearest[near]).size))


def within(events: Mapping[str, Samples], part: slice) -> dict[str, Samples]:
    """The events of a part of the samples."""
    return {name: found[(found >= part.start) & (found < part.stop)] for name, found in events.items()}
