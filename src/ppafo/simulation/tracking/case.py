"""Run that does not follow its reference, and a cause of this failure."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.control.kind import ControllerKind
from ppafo.metrics.command import requested_samples
from ppafo.metrics.metric import controlled_in, followed
from ppafo.metrics.settled import SettledPart
from ppafo.metrics.switching import OSCILLATION_THRESHOLD, SHUT, reversals
from ppafo.model.catalog import VALVES
from ppafo.parameters.plant import valve_settings
from ppafo.signals import Recording
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.tracking.remedies import Remedy
from ppafo.simulation.tracking.rule import Failure, only_switches

_FULLY_OPEN = 0.98
"""Command above which a valve counts as fully open [-]."""
_FAR, _FAR_OF_RANGE = 2.0, 0.05
"""Deviation from the set pressure beyond which a regulator counts as fully open: in bands, and of its range [-]."""


class Case(NamedTuple):
    """Run that does not follow its reference.

    ``law`` is the controller kind, None for a Python controller; ``settled`` the judged part of ``recording``;
    ``failure`` the kind of failure. ``is_for_reach`` is true if the run gives all that the actuator can give.
    """

    scenario: Scenario
    law: ControllerKind | None
    recording: Recording
    settled: SettledPart
    failure: Failure | None
    is_for_reach: bool = False

    @property
    def samples(self) -> slice | NDArray[np.bool_]:
        """Judged samples of the recording; of a walk those with a requested torque, if any torque is requested."""
        if self.scenario.follows_reference:
            return slice(int(self.settled.first), int(self.settled.last) + 1)
        return slice(None) if controlled_in(self.recording) is None else requested_samples(self.recording)

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
        valve = self.scenario.device.valve
        regulation = VALVES[valve.kind].regulation
        if regulation is not None:
            span, band, _ = regulation(valve_settings(valve))
            return _is_far_from_set(self.recording, valve.lowest_pressure, span, band)
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
        return self.settled.rests > 0.0 and self.is_settling and turns == 0

    @property
    def _error(self) -> NDArray[np.float64]:
        """Error of the settled part [SI]."""
        reference, value = followed(self.recording)
        return np.asarray((value - reference)[self.samples])


def _is_far_from_set(recording: Recording, lowest: float, span: float, band: float) -> NDArray[np.bool_]:
    """Return for each sample whether a pressure is off the one that its regulator is set to, far beyond its band [Pa].

    ``lowest`` is the lowest set pressure and ``span`` the range above it [Pa].
    """
    command = recording["command"]
    far = np.zeros(command.shape, dtype=np.bool_)
    for chamber, sign in (("pressure_1", 1.0), ("pressure_2", -1.0)):
        # An actuator with one chamber has no second pressure.
        if chamber in recording:
            wanted = lowest + span * np.clip(sign * command, 0.0, 1.0)
            far |= np.abs(wanted - recording[chamber]) > max(_FAR * band, _FAR_OF_RANGE * span)
    return far


def only_opens_fully(recording: Recording) -> bool:
    """Return whether each recorded command opens a valve fully, shuts or vents, whatever the controller declares."""
    command = np.abs(recording["command"])
    return not np.any((command > SHUT) & (command < _FULLY_OPEN))


class TrackingCause(NamedTuple):
    """Cause of a tracking failure: sentence with numbers, remedies to try, and advice if none helps."""

    text: str
    remedies: tuple[Remedy, ...] = ()
    advice: str = ""
