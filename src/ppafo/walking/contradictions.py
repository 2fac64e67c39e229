"""Settings of a walk that contradict each other: refused before the run, in one line that names both.

Any number may be an array (runs,), one for each run of an ensemble.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from ppafo.control.kind import ControllerKind
from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.errors import ScenarioError
from ppafo.model.columns import Problem, at, larger, smaller
from ppafo.parameters.plant import valve_settings
from ppafo.simulation.declaration import Reading, short_quantity_text
from ppafo.simulation.scenario import PYTHON_CONTROLLER, Scenario
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import law_of, walking_valve

_NEWTON, _RADIAN, _SECOND, _METRE, _PASCAL = "N", "rad", "s", "m", "Pa_a"

COMPRESSION = 1.6
"""Highest pressure in a chamber over the supply pressure, with room: up to 1.38 in the shipped walks."""


class Contradiction(NamedTuple):
    """A path, the runs that it contradicts another number in, and what to say of one of them."""

    path: str
    is_bad: Any
    reason: Callable[[int], str]


def check_walk(scenario: Scenario, reading: Reading) -> None:
    """Raise ScenarioError with the first contradiction; ``reading`` says how a value was given."""
    for path, is_bad, reason in _contradictions(scenario):
        if is_bad:
            said = reason(0)
            raise reading.refusal(path, said) if _is_given(reading, path) else _of_default(reading, path, said)


def rules(scenario: Scenario) -> tuple[Problem, ...]:
    """What contradicts what in the runs of an ensemble. ScenarioError for a walk on a bottle, which cannot vary."""
    check_no_bottle(scenario)
    return tuple(_problem(item) for item in _contradictions(scenario))


def check_no_bottle(scenario: Scenario) -> None:
    """Raise ScenarioError for a walk on a bottle, which only ``walk`` takes."""
    if walk_of(scenario).bottle is not None:
        raise ScenarioError(
            f"{scenario.name}: a walk on a bottle goes by 'ppafo walk' alone, as bottle and device are advanced in "
            "alternation; leave the bottle out, or give the device lines with [supply_line]"
        )


def _problem(item: Contradiction) -> Problem:
    return np.atleast_1d(item.is_bad), lambda run: f"{item.path}: {item.reason(run)}"


def _is_given(reading: Reading, path: str) -> bool:
    section, _, name = path.partition(".")
    table = reading.document.get(section)
    return isinstance(table, Mapping) and name in table


def _of_default(reading: Reading, path: str, reason: str) -> ScenarioError:
    return ScenarioError(f"{reading.file}: {path}, which is not given and takes its default: {reason}")


def _text(number: Any, run: int, unit: str) -> str:
    return short_quantity_text(at(number, run), unit)


def _contradictions(scenario: Scenario) -> Iterator[Contradiction]:
    settings = scenario.controller.settings
    yield from _segments(scenario)
    if scenario.controller.kind == PYTHON_CONTROLLER:
        return
    yield from _valve(scenario, law_of(scenario))
    if "load_threshold" in settings:
        yield from _thresholds(settings)
        yield from _times(scenario)
        yield from _angles(scenario)
        yield from _gait(scenario)
        yield from _pressures(scenario)
    if "push_off_end" in settings:
        yield from _push_off(settings)
    if "peak_time" in settings:
        yield from _profile(settings)


def _segments(scenario: Scenario) -> Iterator[Contradiction]:
    wearer = walk_of(scenario).wearer
    yield Contradiction(
        "wearer.shank_mass_centre",
        wearer.shank_mass_centre > wearer.shank_length,
        lambda run: f"lies beyond the ankle: wearer.shank_length is {_text(wearer.shank_length, run, _METRE)}",
    )
    yield Contradiction(
        "wearer.foot_mass_centre",
        wearer.foot_mass_centre > wearer.toe_lever,
        lambda run: f"lies beyond the toes: wearer.toe_lever is {_text(wearer.toe_lever, run, _METRE)}",
    )


def _valve(scenario: Scenario, law: ControllerKind) -> Iterator[Contradiction]:
    valve = scenario.device.valve.kind
    fitting = " or ".join(sorted(kind.name for kind in WALKING_CONTROLLERS.values() if kind.only_switches))
    remedy = f"take device.valve 'proportional', or controller.kind {fitting}"
    yield Contradiction(
        "controller.kind",
        valve != "proportional" and not law.only_switches,
        lambda _run: (
            f"opens its valve gradually, which in a walk only a proportional valve does, not a {valve} one: {remedy}"
        ),
    )


def _thresholds(settings: Mapping[str, Any]) -> Iterator[Contradiction]:
    load = settings["load_threshold"]
    for name, relation, is_bad in (
        ("unload_threshold", "below", settings["unload_threshold"] >= load),
        ("largest_force", "above", settings["largest_force"] <= load),
    ):
        yield Contradiction(
            f"controller.{name}",
            is_bad,
            lambda run, relation=relation: (  # type: ignore[misc]
                f"must be {relation} controller.load_threshold, which is {_text(load, run, _NEWTON)}"
            ),
        )


def _times(scenario: Scenario) -> Iterator[Contradiction]:
    settings, stride, period = (
        scenario.controller.settings,
        walk_of(scenario).gait.stride_time,
        scenario.controller.period,
    )
    first = settings["first_stride_time"]
    yield Contradiction(
        "controller.first_stride_time",
        np.logical_or(first <= 0.5 * stride, first >= 2.0 * stride),
        lambda run: (
            f"must be between half and twice the stride of the gait, which is {_text(round(stride, 4), run, _SECOND)}"
        ),
    )
    yield Contradiction(
        "controller.flat_from",
        settings["flat_from"] >= settings["flat_to"],
        lambda run: f"must be below controller.flat_to, which is {at(settings['flat_to'], run):g}",
    )
    delay = walking_valve(scenario.device.valve).command_delay(valve_settings(scenario.device.valve))
    for name in ("fill_time", "vent_time"):
        yield Contradiction(
            f"controller.{name}",
            settings[name] <= delay,
            lambda run: f"must be longer than the dead time of the valve, which is {_text(delay, run, _SECOND)}",
        )
    yield Contradiction(
        "controller.frozen_time",
        settings["frozen_time"] <= 2.0 * period,
        lambda run: f"must be longer than two sample periods of the controller, {_text(period, run, _SECOND)} each",
    )


def _angles(scenario: Scenario) -> Iterator[Contradiction]:
    settings, actuator = scenario.controller.settings, scenario.device.actuator
    low, high = settings["lowest_angle"], settings["highest_angle"]
    yield Contradiction(
        "controller.lowest_angle",
        low >= high,
        lambda run: f"must be below controller.highest_angle, which is {_text(high, run, _RADIAN)}",
    )
    least, most = larger(low, actuator.angle_min), smaller(high, actuator.angle_max)
    swing = settings["swing_angle"]
    yield Contradiction(
        "controller.swing_angle",
        np.logical_or(swing <= least, swing >= most),
        lambda run: (
            f"lies outside the range of sensor and device, {_text(least, run, _RADIAN)} to {_text(most, run, _RADIAN)}"
        ),
    )


def _gait(scenario: Scenario) -> Iterator[Contradiction]:
    gait = walk_of(scenario).gait
    yield Contradiction(
        "controller.kind",
        gait.vertical_force is None,
        lambda _run: (
            f"needs force sensors, and gait '{gait.name}' has no vertical_force; import it with the ground reaction, "
            "or take controller.kind=off"
        ),
    )


def _pressures(scenario: Scenario) -> Iterator[Contradiction]:
    settings, supply = scenario.controller.settings, scenario.device.supply
    room = supply.atmospheric_pressure
    lowest = smaller(supply.pressure, supply.dorsiflexion_pressure)
    compressed = larger(supply.pressure, supply.dorsiflexion_pressure) * COMPRESSION
    yield Contradiction(
        "controller.lowest_pressure",
        settings["lowest_pressure"] >= room,
        lambda run: f"must be below the atmosphere, which is {_text(room, run, _PASCAL)}",
    )
    filled = settings["filled_pressure"]
    yield Contradiction(
        "controller.filled_pressure",
        np.logical_or(filled <= room, filled >= lowest),
        lambda run: (
            "must be between atmosphere and supply, which are "
            f"{_text(room, run, _PASCAL)} and {_text(lowest, run, _PASCAL)}"
        ),
    )
    yield Contradiction(
        "controller.highest_pressure",
        settings["highest_pressure"] <= compressed,
        lambda run: f"must be above {_text(compressed, run, _PASCAL)}: a moving foot compresses the gas in a chamber",
    )


def _push_off(settings: Mapping[str, Any]) -> Iterator[Contradiction]:
    start, end = settings["push_off_start"], settings["push_off_end"]
    yield Contradiction(
        "controller.push_off_end",
        end <= start,
        lambda run: f"must be above controller.push_off_start, which is {at(start, run):g}",
    )


def _profile(settings: Mapping[str, Any]) -> Iterator[Contradiction]:
    peak, rise, fall = settings["peak_time"], settings["rise_time"], settings["fall_time"]
    start = settings["push_off_start"]
    yield Contradiction(
        "controller.rise_time",
        rise > peak,
        lambda run: f"the torque would rise before the heel strike: controller.peak_time is {at(peak, run):g}",
    )
    yield Contradiction(
        "controller.peak_time",
        peak + fall > 1.0,
        lambda run: f"with controller.fall_time {at(fall, run):g} the torque would end after the stride",
    )
    yield Contradiction(
        "controller.peak_time",
        peak < start,
        lambda run: f"the peak would be over before the push-off: controller.push_off_start is {at(start, run):g}",
    )
