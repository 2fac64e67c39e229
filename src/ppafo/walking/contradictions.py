"""Contradictory settings of a walk, each reported in a line that names both settings; any may be an array (runs,)."""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ppafo.control.catalog import switching_remedy
from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.model.columns import at
from ppafo.parameters.building import RELATIONS
from ppafo.simulation.contradictions import IN_FILES, Contradiction
from ppafo.simulation.scenario import Scenario
from ppafo.units.shown import shown_text
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import law_of
from ppafo.walking.wearer import Wearer

# Limits of the expected time of the first stride, in strides of the gait.
SHORTEST_FIRST = 0.5
LONGEST_FIRST = 2.0


class _Pair(NamedTuple):
    """Required relation between two numbers of a walk, with the SI unit of both."""

    path: str
    relation: str
    other: str
    unit: str = ""


PAIRS = (
    _Pair("wearer.shank_mass_centre", "at most", "wearer.shank_length", "m"),
    _Pair("wearer.foot_mass_centre", "at most", "wearer.toe_lever", "m"),
    _Pair("controller.unload_threshold", "below", "controller.load_threshold", "N"),
    _Pair("controller.push_off_end", "above", "controller.push_off_start"),
    # A torque that rises before the heel strike has no gait phase, and one whose peak is over never acts.
    _Pair("controller.rise_time", "at most", "controller.peak_time"),
    _Pair("controller.peak_time", "at least", "controller.push_off_start"),
)


_PHASES = np.linspace(0.0, 1.0, 200, endpoint=False)
BEYOND_STOP = math.radians(5.0)
"""Angle [rad] by which a gait may exceed an end stop: the accuracy of the angle zero in most known recordings."""


def contradictions(scenario: Scenario) -> Iterator[Contradiction]:
    """Yield the check of every pair of numbers that could contradict each other, with its result."""
    motion = walk_of(scenario)
    actuator = scenario.device.actuator
    gait = motion.gait
    lowest = actuator.angle_min
    highest = actuator.angle_max
    low, high = angles_of_gait(scenario)
    needed = f"the gait needs {math.degrees(low):.0f} to {math.degrees(high):.0f} deg"
    yield Contradiction(
        "actuator.angle_max",
        highest < high - BEYOND_STOP,
        lambda run: f"{needed}, but the upper stop is at {_text(highest, run, 'rad')}",
    )
    yield Contradiction(
        "actuator.angle_min",
        lowest > low + BEYOND_STOP,
        lambda run: f"{needed}, but the lower stop is at {_text(lowest, run, 'rad')}",
    )
    settings = scenario.controller.settings
    valve = scenario.device.valve.kind
    kind = scenario.controller.kind
    numbers = {f"controller.{name}": number for name, number in settings.items()}
    numbers |= {f"wearer.{name}": getattr(motion.wearer, name) for name in Wearer.__dataclass_fields__}
    for pair in PAIRS:
        if pair.path in numbers and pair.other in numbers:
            number = numbers[pair.path]
            other = numbers[pair.other]

            def reason(run: int, pair: _Pair = pair, other: Any = other) -> str:
                return f"must be {pair.relation} {pair.other} = {_text(other, run, pair.unit)}"

            yield Contradiction(pair.path, np.logical_not(RELATIONS[pair.relation](number, other)), reason)
    # An object in charge has no settings that could contradict.
    if scenario.controller.is_outside:
        return
    gradual = "" if WALKING_CONTROLLERS.is_own(kind) else switching_remedy(kind)
    yield Contradiction(
        "controller.kind",
        valve != "proportional" and not law_of(scenario).only_switches,
        lambda _run: (
            f"opens its valve gradually{gradual}, which in a walk needs device.valve = 'proportional', not '{valve}'"
        ),
    )
    # A controller with a threshold of force finds the events of the gait by itself.
    if "load_threshold" in settings:
        stride = gait.stride_time
        first = settings["first_stride_time"]
        swing = settings["swing_angle"]
        yield Contradiction(
            "controller.first_stride_time",
            np.logical_or(first <= SHORTEST_FIRST * stride, first >= LONGEST_FIRST * stride),
            lambda run: (
                f"must be between half and twice the stride time of the gait, {_text(round(stride, 4), run, 's')}"
            ),
        )
        yield Contradiction(
            "controller.swing_angle",
            np.logical_or(swing <= lowest, swing >= highest),
            lambda run: (
                f"must be in the range of the device, {_text(lowest, run, 'rad')} to {_text(highest, run, 'rad')}"
            ),
        )
        yield Contradiction(
            "controller.kind",
            gait.vertical_force is None,
            lambda _run: f"needs force sensors, and gait '{gait.name}' has no vertical_force",
        )
    if "peak_time" in settings:
        peak = settings["peak_time"]
        fall = settings["fall_time"]
        yield Contradiction(
            "controller.peak_time",
            peak + fall > 1.0,
            lambda run: f"with controller.fall_time {at(fall, run):g} the torque would end after the stride",
        )


def angles_of_gait(scenario: Scenario) -> tuple[float, float]:
    """Return the lowest and highest ankle angle [rad] of the gait of a walk."""
    angles = walk_of(scenario).gait.ankle_angle.values_at(_PHASES)
    return float(np.min(angles)), float(np.max(angles))


def _text(number: Any, run: int, unit: str) -> str:
    """Return a number with its SI unit as text for a message; ``number`` is a scalar or an array (runs,)."""
    return shown_text(at(number, run), unit, unit=IN_FILES.get(unit, "")) if unit else f"{at(number, run):g}"
