"""Run that is judged: its judged samples and what its valve does in them; and numbers in the words of a verdict."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ppafo.control.kind import ControllerKind
from ppafo.engine.in_python import over_samples
from ppafo.metrics.command import requested_samples
from ppafo.metrics.metric import Floats, controlled_in, followed
from ppafo.metrics.settled import SettledPart
from ppafo.metrics.switching import OSCILLATION_THRESHOLD, SHUT, reversals
from ppafo.model.catalog import VALVES
from ppafo.model.controlled import CONTROLLED
from ppafo.model.orifice import orifice_flow
from ppafo.parameters.device import Device
from ppafo.parameters.plant import plant_parameters
from ppafo.report.kind import metric_change, metric_level
from ppafo.signals import Recording
from ppafo.simulation.numbers import declared_numbers, number_at, of_its_chambers
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.tracking.rule import Failure, only_switches
from ppafo.wording import without_exponent

_SHORT = 0.1
"""Time below which a text has milliseconds [s]."""
_FULLY_OPEN = 0.98
"""Command above which a valve counts as fully open [-]."""
# Share of the flow through an open regulator from which it counts as fully open, and share of the largest such flow
# up to which it gives hardly any [-].
_FULL_FLOW = 0.9
_HARDLY = 0.05


def stated_number(scenario: Scenario, path: str) -> str:
    """Number of a scenario or its device as a cause states it: path and value in its display unit."""
    return f"`{path} = {level_text(declared_numbers(scenario)[path].unit, number_at(scenario, path))}`"


def overrides_of(scenario: Scenario, numbers: Mapping[str, float]) -> tuple[str, ...]:
    """Numbers [SI] by path as overrides in the units of the device; without the second number of an orifice."""
    declared = declared_numbers(scenario)
    return tuple(
        f"{path}={level_text(declared[path].unit, number)}"
        for path, number in of_its_chambers(numbers, scenario.device).items()
        if not path.endswith((".critical_ratio", ".discharge_coefficient"))
    )


def level_text(unit: str, number: float) -> str:
    """Value with its display unit, from a number in an SI unit; pressures as gauge pressures, or as differences."""
    value, shown = metric_level(float(number), unit)
    if shown == "s" and abs(value) < _SHORT:
        value = 1.0e3 * value
        shown = "ms"
    return f"{without_exponent(value, '.3g')} {shown}".rstrip()


def change_text(controlled: str, number: float, digits: int = 3) -> str:
    """Difference of two values of the controlled quantity, with its display unit, in ``digits`` significant digits."""
    value, unit = metric_change(number, CONTROLLED[controlled].difference)
    return f"{without_exponent(value, f'.{digits}g')} {unit}"


@dataclass(frozen=True)
class Case:
    """Run that does not follow its reference.

    ``settled`` is the judged part of ``recording``, ``failure`` the kind of failure. ``is_for_reach`` is true if the
    run gives all that the actuator can give.
    """

    scenario: Scenario
    recording: Recording
    settled: SettledPart
    failure: Failure | None
    is_for_reach: bool = False

    @property
    def device(self) -> Device:
        """Device of the scenario."""
        return self.scenario.device

    @cached_property
    def law(self) -> ControllerKind | None:
        """Kind of the controller; None for a Python controller."""
        return self.scenario.law

    @cached_property
    def samples(self) -> slice | NDArray[np.bool_]:
        """Judged samples of the recording; of a walk those with a requested torque, if any torque is requested."""
        if self.scenario.follows_reference:
            return slice(int(self.settled.first), int(self.settled.last) + 1)
        return slice(None) if controlled_in(self.recording) is None else requested_samples(self.recording)

    def channel(self, name: str) -> Floats:
        """Return the judged samples of a channel [SI]."""
        return np.asarray(self.recording[name][self.samples])

    @cached_property
    def reference(self) -> Floats:
        """Judged samples of the reference [SI]."""
        return np.asarray(followed(self.recording)[0][self.samples])

    @cached_property
    def error(self) -> Floats:
        """Judged samples of the controlled quantity minus the reference [SI]."""
        return np.asarray(followed(self.recording)[1][self.samples] - self.reference)

    @property
    def oscillates(self) -> bool:
        """True if the loop oscillates or its command reverses too often."""
        return self.failure == "oscillates"

    @property
    def overshoots(self) -> bool:
        """True if the peak is too high, and nothing else."""
        return self.failure == "overshoots"

    @property
    def only_switches(self) -> bool:
        """True for a valve that is only ever fully open or shut, by its controller or as a pair."""
        return only_switches(self.scenario, self.law)

    @property
    def opens_fully_alone(self) -> bool:
        """True if each recorded command opens a valve fully, shuts or vents, whatever the controller declares."""
        command = np.abs(self.recording["command"])
        return not np.any((command > SHUT) & (command < _FULLY_OPEN))

    @cached_property
    def is_fully_open(self) -> NDArray[np.bool_]:
        """True for each sample of the recording with a fully open valve."""
        recording = self.recording
        if VALVES[self.device.valve.kind].regulation is None:
            command = np.abs(recording["command"])
            settings = self.scenario.controller.settings
            # An on/off law may open its valves by less on purpose.
            most = _FULLY_OPEN * min(settings.get("opening", 1.0), 1.0)
            return np.asarray((command >= most) & (command <= 1.0 + SHUT))
        # A regulator is where a chamber gains or loses as much gas as it passes when fully open.
        plant = plant_parameters(self.device)
        full = np.zeros(recording.time.shape, dtype=np.bool_)
        for number, source in ((1, plant.supply_pressure), (2, plant.dorsiflexion_pressure)):
            # An actuator with one chamber has no second one.
            if f"mass_{number}" not in recording:
                continue
            pressure = recording[f"pressure_{number}"]
            gain = np.gradient(recording[f"mass_{number}"], recording.time)
            for node, way in ((source, 1.0), (plant.atmospheric_pressure, -1.0)):
                flow = over_samples(orifice_flow, node, pressure, plant.valve_conductance, 1.0, plant.valve_curve)[0]
                most = np.maximum(way * flow, _HARDLY * np.max(way * flow))
                full |= way * gain > _FULL_FLOW * most
        return full

    @cached_property
    def open_share(self) -> float:
        """Share of the judged samples with a fully open valve [-]."""
        return float(np.mean(self.is_fully_open[self.samples]))

    @property
    def is_settling(self) -> bool:
        """True if the mean error falls by at least 30 % from the first to the second half of the settled part."""
        error = np.abs(self.error)
        half = error.size // 2
        return half > 0 and bool(np.mean(error[half:]) < 0.7 * np.mean(error[:half]))

    @property
    def is_approaching(self) -> bool:
        """True if the value only approaches a reference at rest: its error falls throughout, and does not reverse."""
        turns = reversals(self.error, OSCILLATION_THRESHOLD * self.settled.wanted_change)
        return self.settled.rests > 0.0 and self.is_settling and turns == 0
