"""Run that does not follow its reference, and a cause of this failure."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.control.kind import ControllerKind
from ppafo.engine.in_python import over_samples
from ppafo.metrics.command import requested_samples
from ppafo.metrics.metric import controlled_in, followed
from ppafo.metrics.settled import SettledPart
from ppafo.metrics.switching import OSCILLATION_THRESHOLD, SHUT, reversals
from ppafo.model.catalog import VALVES
from ppafo.model.orifice import orifice_flow
from ppafo.model.plant import PlantParameters
from ppafo.parameters.plant import plant_parameters
from ppafo.signals import Recording
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.tracking.remedies import Remedy
from ppafo.simulation.tracking.rule import Failure, only_switches

_FULLY_OPEN = 0.98
"""Command above which a valve counts as fully open [-]."""
_FULL_FLOW, _HARDLY = 0.9, 0.05
"""Share of the flow through an open regulator from which it counts as fully open, and share of the largest such flow up
to which it gives hardly any [-]."""


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
        if VALVES[self.scenario.device.valve.kind].regulation is not None:
            return _flows_fully(self.recording, plant_parameters(self.scenario.device))
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


def _flows_fully(recording: Recording, plant: PlantParameters) -> NDArray[np.bool_]:
    """Return for each sample whether a chamber gains or loses as much gas as its regulator passes when fully open."""
    full = np.zeros(recording.time.shape, dtype=np.bool_)
    for number, source in ((1, plant.supply_pressure), (2, plant.dorsiflexion_pressure)):
        # An actuator with one chamber has no second one.
        if f"mass_{number}" not in recording:
            continue
        pressure, gain = recording[f"pressure_{number}"], np.gradient(recording[f"mass_{number}"], recording.time)
        for node, way in ((source, 1.0), (plant.atmospheric_pressure, -1.0)):
            flow = over_samples(orifice_flow, node, pressure, plant.valve_conductance, 1.0, plant.valve_curve)[0]
            most = np.maximum(way * flow, _HARDLY * np.max(way * flow))
            full |= way * gain > _FULL_FLOW * most
    return full


def only_opens_fully(recording: Recording) -> bool:
    """Return whether each recorded command opens a valve fully, shuts or vents, whatever the controller declares."""
    command = np.abs(recording["command"])
    return not np.any((command > SHUT) & (command < _FULLY_OPEN))


class TrackingCause(NamedTuple):
    """Cause of a tracking failure: sentence with numbers, remedies to try, and advice if none helps."""

    text: str
    remedies: tuple[Remedy, ...] = ()
    advice: str = ""
