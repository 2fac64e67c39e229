"""Remedies for a loop that does not follow its reference: changed numbers of the scenario, most promising first."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from ppafo.control import angle_loop, torque_loop
from ppafo.metrics.settled import LARGEST_SHARE, SettledPart
from ppafo.model.controlled import ANGLE, CONTROLLED
from ppafo.model.declaration import Quantity
from ppafo.parameters.device import SonicOrifice
from ppafo.parameters.overrides import read_overrides
from ppafo.report.kind import metric_change, metric_level
from ppafo.simulation.declaration import law_settings
from ppafo.simulation.default_gains import SLOPE_GAINS, default_links, is_gain
from ppafo.simulation.numbers import declared_numbers, number_at, of_its_chambers
from ppafo.simulation.scenario import Scenario
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
    # As it can be pasted: a difference of pressures is told from a level by its unit.
    return f"{without_exponent(value, '.3g')} {shown}{'_d' if unit == 'Pa_d' else ''}".rstrip()


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
