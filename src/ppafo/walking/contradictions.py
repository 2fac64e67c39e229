"""Contradictory settings of a walk, reported before the run in a single line that names both settings.

Any number may be an array (runs,), with a value for each run of an ensemble.
"""

import math
import operator
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ppafo.control.catalog import switching_remedy
from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.errors import ScenarioError
from ppafo.model.columns import Problem, at
from ppafo.parameters.declared import quantities_in, value_at
from ppafo.simulation.document import DocumentReader
from ppafo.simulation.scenario import Scenario
from ppafo.units import split_quantity
from ppafo.units.shown import shown_in, shown_text, units_beside
from ppafo.walking.declaration import OF_A_WALK
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import law_of
from ppafo.walking.wearer import Wearer

_IN_FILES = {"m": "m"}
"""Units of leg segments in walk files; other lengths are in millimetres."""


@dataclass(frozen=True, slots=True)
class _Pair:
    """Required relation between two numbers of a walk: number at ``path`` below, above, at most or at least ``other``.

    ``unit`` is the SI unit of both, ``words`` the explanation in the message, empty if the relation is explanation
    enough.
    """

    path: str
    relation: str
    other: str
    unit: str
    words: str = ""


PAIRS = (
    _Pair("wearer.shank_mass_centre", "at most", "wearer.shank_length", "m", "lies beyond the ankle"),
    _Pair("wearer.foot_mass_centre", "at most", "wearer.toe_lever", "m", "lies beyond the toes"),
    _Pair("controller.unload_threshold", "below", "controller.load_threshold", "N"),
    _Pair("controller.push_off_end", "above", "controller.push_off_start", ""),
    _Pair(
        "controller.rise_time", "at most", "controller.peak_time", "", "the torque would rise before the heel strike"
    ),
    _Pair(
        "controller.peak_time",
        "at least",
        "controller.push_off_start",
        "",
        "the peak would be over before the push-off",
    ),
)
_IS_BAD = {"below": operator.ge, "above": operator.le, "at most": operator.gt, "at least": operator.lt}


_OF_DEVICE = ("actuator.angle_max", "actuator.angle_min")
"""End stops of the device, which cannot be set by a key of a walk file."""
_PHASES = np.linspace(0.0, 1.0, 200, endpoint=False)
BEYOND_STOP = math.radians(5.0)
"""Angle [rad] by which a gait may exceed an end stop: the accuracy of the angle zero in most known recordings."""
SHORTEST_FIRST, LONGEST_FIRST = 0.5, 2.0
"""Limits of the expected time of the first stride, in strides of the gait."""


class _Contradiction(NamedTuple):
    """Check of one number of a walk: path, result (True if it contradicts another number), and message by run.

    The result is one value for all runs, or an array (runs,).
    """

    path: str
    is_bad: Any
    reason: Callable[[int], str]


def check_walk(scenario: Scenario, reading: DocumentReader) -> None:
    """Raise ScenarioError for the first contradiction; ``reading`` provides each value as the user wrote it."""
    for path, is_bad, reason in _contradictions(scenario):
        if not is_bad:
            continue
        if path in _OF_DEVICE:
            raise ScenarioError(f"{reading.file}: {path}: {reason(0)}")
        quantity, given = quantities_in(OF_A_WALK.declare(reading.document)).get(path), value_at(reading.document, path)
        units = dict(scenario.device.shown)
        # Limits in the unit of the value that is refused.
        if quantity is not None and isinstance(given, str):
            units |= units_beside(quantity.unit, split_quantity(given)[1])
        with shown_in(units):
            if quantity is None or given is not None:
                raise reading.refusal(path, reason(0))
            section, _, name = path.partition(".")
            number = getattr(walk_of(scenario).wearer if section == "wearer" else scenario.controller, name)
            # In six digits, as the number that it contradicts.
            default = shown_text(number, quantity.unit, unit=_IN_FILES.get(quantity.unit, ""))
            raise ScenarioError(f"{reading.file}: {path} is not given and has its default, {default}: {reason(0)}")


def contradictory_numbers(scenario: Scenario) -> tuple[Problem, ...]:
    """Return the contradictions in the runs of an ensemble.

    Raises ScenarioError for a walk on a bottle, which cannot be part of an ensemble.
    """
    check_no_bottle(scenario)
    return tuple(
        (np.atleast_1d(is_bad), lambda run, path=path, reason=reason: f"{path}: {reason(run)}")
        for path, is_bad, reason in _contradictions(scenario)
    )


def check_no_bottle(scenario: Scenario) -> None:
    """Raise ScenarioError if the walk is on a bottle, which is supported by ``ppafo walk`` alone."""
    if walk_of(scenario).bottle is not None:
        raise ScenarioError(f"{scenario.name}: a walk with a bottle can only be simulated by 'ppafo walk'")


def _contradictions(scenario: Scenario) -> Iterator[_Contradiction]:
    """Yield the check of every pair of numbers that could contradict each other, with its result."""
    yield from _of_stops(scenario)
    wearer = walk_of(scenario).wearer
    numbers = {f"controller.{name}": number for name, number in scenario.controller.settings.items()}
    numbers |= {f"wearer.{name}": getattr(wearer, name) for name in Wearer.__dataclass_fields__}
    for pair in PAIRS:
        if pair.path in numbers and pair.other in numbers:
            number, other = numbers[pair.path], numbers[pair.other]

            def reason(run: int, pair: _Pair = pair, other: Any = other) -> str:
                value = _text(other, run, pair.unit)
                if pair.words:
                    return f"{pair.words}: {pair.other} = {value}"
                return f"must be {pair.relation} {pair.other} = {value}"

            yield _Contradiction(pair.path, _IS_BAD[pair.relation](number, other), reason)
    # An object in charge has no settings that could contradict.
    if scenario.controller.is_outside:
        return
    settings, valve, kind = scenario.controller.settings, scenario.device.valve.kind, scenario.controller.kind
    switching = "" if WALKING_CONTROLLERS.is_own(kind) else switching_remedy(kind)
    fitting = " or ".join(sorted(kind.name for kind in WALKING_CONTROLLERS.values() if kind.only_switches))
    yield _Contradiction(
        "controller.kind",
        valve != "proportional" and not law_of(scenario).only_switches,
        lambda _run: (
            f"opens its valve gradually{switching}, which in a walk needs a proportional valve, not a {valve} valve: "
            f"set device.valve to 'proportional', or controller.kind to {fitting}"
        ),
    )
    # A controller with a threshold of force finds the events of the gait by itself.
    if "load_threshold" in settings:
        yield from _of_times(scenario)
        yield from _of_swing(scenario)
    if "peak_time" in settings:
        peak, fall = settings["peak_time"], settings["fall_time"]
        yield _Contradiction(
            "controller.peak_time",
            peak + fall > 1.0,
            lambda run: f"with controller.fall_time {at(fall, run):g} the torque would end after the stride",
        )


def angles_of_gait(scenario: Scenario) -> tuple[float, float]:
    """Return the lowest and highest ankle angle [rad] of the gait of a walk."""
    angles = walk_of(scenario).gait.ankle_angle.values_at(_PHASES)
    return float(np.min(angles)), float(np.max(angles))


def _of_stops(scenario: Scenario) -> Iterator[_Contradiction]:
    """Yield the checks of the gait's ankle angles against the end stops of the device."""
    actuator, (low, high) = scenario.device.actuator, angles_of_gait(scenario)
    needed = f"the gait needs {math.degrees(low):.0f} to {math.degrees(high):.0f} deg"
    highest, lowest = _OF_DEVICE
    yield _Contradiction(
        highest,
        actuator.angle_max < high - BEYOND_STOP,
        lambda run: f"{needed}, but the upper stop is at {_text(actuator.angle_max, run, 'rad')}",
    )
    yield _Contradiction(
        lowest,
        actuator.angle_min > low + BEYOND_STOP,
        lambda run: f"{needed}, but the lower stop is at {_text(actuator.angle_min, run, 'rad')}",
    )


def _of_times(scenario: Scenario) -> Iterator[_Contradiction]:
    """Yield the checks of a controller's times against the gait."""
    settings = scenario.controller.settings
    stride, first_stride = walk_of(scenario).gait.stride_time, settings["first_stride_time"]
    yield _Contradiction(
        "controller.first_stride_time",
        np.logical_or(first_stride <= SHORTEST_FIRST * stride, first_stride >= LONGEST_FIRST * stride),
        lambda run: f"must be between half and twice the stride time of the gait, {_text(round(stride, 4), run, 's')}",
    )


def _of_swing(scenario: Scenario) -> Iterator[_Contradiction]:
    """Yield the checks of the swing angle against the range of the device, and of the presence of a vertical force."""
    settings, actuator = scenario.controller.settings, scenario.device.actuator
    lowest, highest = actuator.angle_min, actuator.angle_max
    swing, gait = settings["swing_angle"], walk_of(scenario).gait
    yield _Contradiction(
        "controller.swing_angle",
        np.logical_or(swing <= lowest, swing >= highest),
        lambda run: f"must be in the range of the device, {_text(lowest, run, 'rad')} to {_text(highest, run, 'rad')}",
    )
    yield _Contradiction(
        "controller.kind",
        gait.vertical_force is None,
        lambda _run: (
            f"needs force sensors, and gait '{gait.name}' has no vertical_force; import the gait with ground "
            "reaction forces, or set controller.kind=off"
        ),
    )


def _text(number: Any, run: int, unit: str) -> str:
    """Return a number with its SI unit as text for a message; ``number`` is a scalar or an array (runs,)."""
    return shown_text(at(number, run), unit, unit=_IN_FILES.get(unit, "")) if unit else f"{at(number, run):g}"
