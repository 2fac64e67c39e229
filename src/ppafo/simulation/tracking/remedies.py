"""Run that does not follow its reference, and changes of its numbers that might make it follow, as remedies."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.control import angle_loop, torque_loop
from ppafo.control.kind import ControllerKind
from ppafo.engine.in_python import over_samples
from ppafo.metrics.command import requested_samples
from ppafo.metrics.metric import Floats, controlled_in, followed
from ppafo.metrics.settled import LARGEST_SHARE, SettledPart
from ppafo.metrics.switching import OSCILLATION_THRESHOLD, SHUT, reversals
from ppafo.model.catalog import VALVES
from ppafo.model.controlled import ANGLE, CONTROLLED
from ppafo.model.declaration import Quantity
from ppafo.model.orifice import orifice_flow
from ppafo.parameters.device import Device, SonicOrifice
from ppafo.parameters.overrides import read_overrides
from ppafo.parameters.plant import plant_parameters
from ppafo.report.kind import metric_change, metric_level
from ppafo.signals import Recording
from ppafo.simulation.declaration import law_settings
from ppafo.simulation.default_gains import SLOPE_GAINS, default_links, is_gain
from ppafo.simulation.numbers import declared_numbers, number_at, of_its_chambers
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.tracking.rule import Failure, only_switches
from ppafo.wording import override_text, without_exponent

Change = Mapping[str, float]
"""Numbers of a scenario [SI] by path."""
FASTEST_FIRST = (
    torque_loop.proportional_gain,
    torque_loop.boundary_layer,
    torque_loop.convergence_rate,
    angle_loop.inner_gain,
    angle_loop.angle_stiffness,
)
"""Settings that determine the speed of a loop; in a cascade the inner loop first, on which the outer one relies."""
SLOWER_ABOVE = frozenset((torque_loop.boundary_layer,))
"""Settings whose increase makes the loop slower."""
_SAME_GAIN = 0.02
"""Relative difference up to which two gains count as the same [-]."""
_TORQUE_OVER_FRICTION = 1.5
"""Torque that a controller should be able to request, divided by the static friction of the joint [-]."""
_SHORT = 0.1
"""Time below which a text has milliseconds [s]."""
_KEPT_OF_ORIFICE = (".critical_ratio", ".discharge_coefficient")
"""Second number of an orifice, which a remedy leaves unchanged."""
_FULLY_OPEN = 0.98
"""Command above which a valve counts as fully open [-]."""
_FULL_FLOW, _HARDLY = 0.9, 0.05
"""Share of the flow through an open regulator from which it counts as fully open, and share of the largest such flow up
to which it gives hardly any [-]."""


@dataclass(frozen=True, slots=True)
class Remedy:
    """Remedy: numbers of a scenario [SI] by path that might make it follow, and the same numbers as overrides."""

    numbers: Change
    overrides: tuple[str, ...]

    @property
    def text(self) -> str:
        """Overrides as the caller gives them."""
        return override_text(self.overrides)


_RANKS = {"controller": 0, "reference": 2, "motion": 2, "run": 2, "initial": 2}
"""Order of remedies by the first word of a path: the loop, the device (any other word), the task."""


def rank(remedy: Remedy) -> int:
    """Order of a remedy: 0 for the loop, 1 for the device, 2 for the task."""
    return max(_RANKS.get(text.partition(".")[0], 1) for text in remedy.overrides)


CASCADE = Remedy({}, ("controller.kind=cascade",))
"""Remedy for a law that opens the valve by an angle alone: a torque loop inside."""


def remedy(scenario: Scenario, numbers: Change) -> Remedy:
    """Remedy with its overrides in the units of the device."""
    declared, numbers = declared_numbers(scenario), of_its_chambers(numbers, scenario.device)
    overrides = (
        f"{path}={level_text(declared[path].unit, number)}"
        for path, number in numbers.items()
        if not path.endswith(_KEPT_OF_ORIFICE)
    )
    return Remedy(dict(numbers), tuple(overrides))


def stated_number(scenario: Scenario, path: str) -> str:
    """Number of a scenario or its device as a cause states it: path and value in its display unit."""
    return f"`{path} = {level_text(declared_numbers(scenario)[path].unit, number_at(scenario, path))}`"


def level_text(unit: str, number: float) -> str:
    """Value with its display unit, from a number in an SI unit; pressures as gauge pressures, or as differences."""
    value, shown = metric_level(float(number), unit)
    if shown == "s" and abs(value) < _SHORT:
        value, shown = 1.0e3 * value, "ms"
    return f"{without_exponent(value, '.3g')} {shown}".rstrip()


def change_text(controlled: str, number: float, digits: int = 3) -> str:
    """Difference of two values of the controlled quantity, with its display unit, in ``digits`` significant digits."""
    value, unit = metric_change(number, CONTROLLED[controlled].difference)
    return f"{without_exponent(value, f'.{digits}g')} {unit}"


def own_settings(scenario: Scenario) -> tuple[Quantity, ...]:
    """Return the declared settings of the controller; none of a Python object."""
    law = scenario.law
    return () if law is None else law_settings(law, scenario.controlled)


def speed_settings(scenario: Scenario) -> dict[Any, Quantity]:
    """Settings that determine the speed of a controller's loops, by the rule that they follow, innermost loop first."""
    declared = declared_numbers(scenario)
    items = {item.follows: item for item in own_settings(scenario) if f"controller.{item.name}" in declared}
    return {term: items[term] for term in FASTEST_FIRST if term in items}


def default_gains(scenario: Scenario) -> list[Change]:
    """Changes to the device's default of the first gain that differs from it, then of all overridden gains."""
    settings, defaults = scenario.controller.settings, dict[str, float]()
    for path, (link,) in default_links(scenario, filter(is_gain, own_settings(scenario))).items():
        if path not in scenario.links:
            # A default may follow one of this list before it.
            defaults[path] = float(link.number(lambda at: defaults[at] if at in defaults else number_at(scenario, at)))
    for quantity in speed_settings(scenario).values():
        path, present = f"controller.{quantity.name}", float(settings[quantity.name])
        if abs(present - defaults.get(path, present)) > _SAME_GAIN * defaults.get(path, present):
            slopes = {f"controller.{name}": 0.0 for name in SLOPE_GAINS if settings.get(name, 0.0) > 0.0}
            typed = {override.typed for override in read_overrides(scenario.origin.overrides)}
            given = {each: defaults[each] for each in defaults if each in typed}
            changes: list[Change] = [{path: defaults[path], **slopes}, {**slopes, **given}]
            return changes[: max(1, len(given))]
    return []


def default_integral(scenario: Scenario) -> list[Change]:
    """Changes of an integral gain of 0 to the device's default; none without such a gain."""
    settings = scenario.controller.settings
    integrals = (item for item in own_settings(scenario) if item.follows == torque_loop.integral_gain)
    links = default_links(scenario, (item for item in integrals if settings.get(item.name) == 0.0))
    defaults = {path: link.number(lambda at: number_at(scenario, at)) for path, (link,) in links.items()}
    return [{path: default} for path, default in defaults.items() if default > 0.0]


def rescaled_gains(scenario: Scenario, *factors: float) -> list[Change]:
    """Changes of the speed of the innermost loop by each of some factors; none if it cannot be set."""
    innermost, settings = list(speed_settings(scenario).items())[:1], scenario.controller.settings
    powers = [(f"controller.{item.name}", item.name, -1.0 if term in SLOWER_ABOVE else 1.0) for term, item in innermost]
    return [{path: settings[name] * factor**power} for path, name, power in powers for factor in factors]


def sized_valves(scenario: Scenario, *factors: float) -> list[Change]:
    """Changes of the valve's orifice by each of some factors, in the form in which it is given."""
    orifice = scenario.device.valve.orifice
    is_sonic = isinstance(orifice, SonicOrifice)
    size, other = ("sonic_conductance", "critical_ratio") if is_sonic else ("area", "discharge_coefficient")
    kept, number = {f"valve.{other}": float(getattr(orifice, other))}, float(getattr(orifice, size))
    return [{f"valve.{size}": number * factor, **kept} for factor in factors]


def torque_asked(scenario: Scenario, error: float) -> float | None:
    """Torque [N m] requested at an angle error [rad] by a controller with a stiffness; None for another controller."""
    is_stiff = any(item.follows == angle_loop.angle_stiffness for item in own_settings(scenario))
    if scenario.controlled != ANGLE or not is_stiff:
        return None
    settings = scenario.controller.settings
    return float(settings["angle_stiffness"]) * min(float(settings["error_limit"]), error)


def stiffer_laws(
    scenario: Scenario, holding: float, settled: SettledPart, others: Change = MappingProxyType({})
) -> list[Change]:
    """Changes to a larger angle stiffness against a load ``holding`` [N m], without and with adapted damping.

    ``others`` are numbers that change as well. For a valve with a dead band, the two stiffest remedies are also tried
    with a torque gain that opens the valve beyond the band.
    """
    settings = scenario.controller.settings
    present, limit = float(settings["angle_stiffness"]), float(settings["error_limit"])
    damping, band = float(settings.get("angle_damping", 0.0)), dead_band(scenario)
    allowed = LARGEST_SHARE * settled.wanted_change
    sufficient = (_TORQUE_OVER_FRICTION * holding / limit, 3.0 * holding / limit, holding / (0.8 * allowed))
    changes: list[Change] = []
    for stiffness in sorted(value for value in sufficient if value > present > 0.0):
        stiffer = {**others, "controller.angle_stiffness": stiffness}
        changes += [stiffer, {**stiffer, "controller.angle_damping": damping * math.sqrt(stiffness / present)}]
    gain = float(settings.get("torque_gain", 0.0))
    for numbers in changes[-2:] if band > 0.0 and gain > 0.0 else ():
        needed = band / max(numbers["controller.angle_stiffness"] * allowed, 1.0e-9)
        larger = (times * needed for times in (1.0, 2.0) if times * needed > gain)
        changes += [{**numbers, "controller.torque_gain": number} for number in larger]
    return changes


def stiffened(scenario: Scenario, *factors: float) -> list[Change]:
    """Changes of the angle stiffness by each of some factors, and matching damping; none without stiffness."""
    settings, powers = scenario.controller.settings, {"angle_stiffness": 1.0, "angle_damping": 0.5}
    known = {name: power for name, power in powers.items() if name in settings}
    return [
        {f"controller.{name}": settings[name] * factor**power for name, power in known.items()}
        for factor in (factors if known else ())
    ]


def dead_band(scenario: Scenario) -> float:
    """Dead band of the valve [-]; 0 for a valve without one."""
    return float(scenario.device.valve.settings.get("dead_band", 0.0))


class TrackingCause(NamedTuple):
    """Cause of a tracking failure: sentence with numbers, remedies to try, and advice if none helps."""

    text: str
    remedies: tuple[Remedy, ...] = ()
    advice: str = ""


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

    def cause(self, text: str, changes: Iterable[Mapping[str, float] | Remedy] = (), advice: str = "") -> TrackingCause:
        """Return a cause with remedies, of which those that change numbers are given as numbers [SI] by path."""
        remedies = (each if isinstance(each, Remedy) else remedy(self.scenario, each) for each in changes)
        return TrackingCause(text, tuple(remedies), advice)

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
            command, settings = np.abs(recording["command"]), self.scenario.controller.settings
            # An on/off law may open its valves by less on purpose.
            most = _FULLY_OPEN * min(settings.get("opening", 1.0), 1.0)
            return np.asarray((command >= most) & (command <= 1.0 + SHUT))
        # A regulator is where a chamber gains or loses as much gas as it passes when fully open.
        plant, full = plant_parameters(self.device), np.zeros(recording.time.shape, dtype=np.bool_)
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
