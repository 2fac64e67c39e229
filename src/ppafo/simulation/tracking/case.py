"""Run that does not follow its reference, and a cause of this failure."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.control.kind import ControllerKind
from ppafo.metrics.metric import followed
from ppafo.metrics.switching import OSCILLATION_THRESHOLD, SHUT, reversals
from ppafo.signals import Recording
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.tracking.remedies import Remedy
from ppafo.simulation.tracking.rule import Failure, only_switches
from ppafo.simulation.tracking.settled import SettledPart

_FULLY_OPEN = 0.98
"""Command above which a valve counts as fully open [-]."""


class Case(NamedTuple):
    """Run that does not follow its reference.

    ``law`` is the controller kind, None for a Python controller; ``settled`` the settled part of ``recording``;
    ``failure`` the kind of failure. ``is_for_reach`` is true if the run gives all that the actuator can give.
    """

    scenario: Scenario
    law: ControllerKind | None
    recording: Recording
    settled: SettledPart
    failure: Failure | None
    is_for_reach: bool = False

    @property
    def oscillates(self) -> bool:
        """True if the loop oscillates or its command reverses too often."""
        return self.failure == "oscillates"

    @property
    def only_switches(self) -> bool:
        """True for a valve that is only ever fully open or shut, by its controller or as a pair."""
        return only_switches(self.scenario, self.law)

    @property
    def is_fully_open(self) -> NDArray[np.bool_]:
        """True for each sample of the recording with a fully open valve."""
        command, settings = np.abs(self.recording["command"]), self.scenario.controller.settings
        # An on/off law may open its valves by less on purpose.
        return np.asarray((command >= _FULLY_OPEN * min(settings.get("opening", 1.0), 1.0)) & (command <= 1.0 + SHUT))

    @property
    def is_settling(self) -> bool:
        """True if the mean error falls by at least 30 % from the first to the second half of the settled part."""
        error = np.abs(self._error)
        half = error.size // 2
        return half > 0 and bool(np.mean(error[half:]) < 0.7 * np.mean(error[:half]))

    @property
    def is_approaching(self) -> bool:
        """True if the value only approaches a reference at rest: its error falls throughout, and does not reverse."""
        turns = reversals(self._error, OSCILLATION_THRESHOLD * self.settled.wanted_change)
        return self.settled.rests and self.is_settling and turns == 0

    @property
    def _error(self) -> NDArray[np.float64]:
        """Error of the settled part [SI]."""
        reference, value = followed(self.recording)
        return np.asarray((value - reference)[self.settled.samples])


def only_opens_fully(recording: Recording) -> bool:
    """Return whether each recorded command opens a valve fully, shuts or vents, whatever the controller declares."""
    command = np.abs(recording["command"])
    return not np.any((command > SHUT) & (command < _FULLY_OPEN))


class TrackingCause(NamedTuple):
    """Cause of a tracking failure: sentence with numbers, remedies to try, and advice if none helps."""

    text: str
    remedies: tuple[Remedy, ...] = ()
    advice: str = ""
