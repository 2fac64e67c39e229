"""Functions of time of a scenario: read from its file, as the engine takes them, and their values and bounds."""

from typing import Any

import numpy as np

from ppafo.control.catalog import PROFILES
from ppafo.engine.over_samples import over_samples
from ppafo.engine.rows import rebuilt
from ppafo.model.catalog import VALVES
from ppafo.model.columns import over_runs
from ppafo.model.controlled import ANGLE
from ppafo.model.declaration import Quantity
from ppafo.simulation.declaration import Reading, kind_at, profile_settings, quantity_text
from ppafo.simulation.scenario import ProfileChoice, Scenario, vane_motion

MAXIMUM_CHECKED_TIMES = 20_000
TOLERANCE = 1.0e-9
"""How far beyond a stop an angle may be [rad]: rounding of a stop that is given in degrees."""


def profile_parameters(choice: ProfileChoice) -> Any:
    """The NamedTuple of a profile, nested ones filled in the order of its quantities; settings may be arrays."""
    kind = PROFILES[choice.kind]
    return rebuilt(kind.parameters, [choice.settings[item.name] for item in kind.quantities])


def profile_values(choice: ProfileChoice, times: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> np.ndarray:
    """Value, rate and second derivative of a profile at times [s], shape (3, times)."""
    found = np.empty((3, times.size))
    for row, series in enumerate(over_samples(PROFILES[choice.kind].value, profile_parameters(choice), times)):
        found[row] = series
    return found


def profile_bounds(choice: ProfileChoice) -> tuple[float, float]:
    """Lowest and highest value of a profile, N m or rad as its levels; arrays (runs,) where its settings are."""
    kind = PROFILES[choice.kind]
    numbers = [choice.settings[item.name] for item in kind.quantities]
    lowest, highest = over_runs(lambda *values: kind.bounds(rebuilt(kind.parameters, values)), *numbers)
    return lowest, highest


def read_profile(reading: Reading, section: str, prescribed: Quantity) -> ProfileChoice:
    """Return a function of time with all its settings in SI."""
    kind = kind_at(reading.document, section)
    return ProfileChoice(kind, reading.section(section, profile_settings(kind, prescribed)))


def profile_problem(
    device: str,
    stops: tuple[float, float],
    profile: ProfileChoice,
    duration: float,
    step: float,
    section: str = "motion.profile",
) -> str:
    """Return where the profile of a section leaves the stops [rad] of a device, named by ``device``; "" if nowhere."""
    kind, parameters = PROFILES[profile.kind], profile_parameters(profile)
    # The times that the engine asks for, as far as they can be gone through one by one.
    count = max(1, min(MAXIMUM_CHECKED_TIMES, round(duration / step)))
    for number in range(count + 1):
        time = duration * number / count
        angle, rate, acceleration = kind.value(parameters, time)
        places = [(time, angle)]
        # Where a parabola through this time turns: a crest between two times must not escape the check.
        away = -rate / acceleration if acceleration else 0.0
        if 0.0 < away < min(duration / count, duration - time):
            places.append((time + away, angle + 0.5 * rate * away))
        for moment, reached in places:
            if not stops[0] - TOLERANCE <= reached <= stops[1] + TOLERANCE:
                return (
                    f"[{section}] leaves the stops of {device}, {range_text(stops)}: it is at "
                    f"{quantity_text(reached, 'rad')} at {moment:.6g} s"
                )
    return ""


def range_text(stops: tuple[float, float]) -> str:
    """Return the range between two stops [rad] for a message."""
    return f"{quantity_text(stops[0], 'rad')} to {quantity_text(stops[1], 'rad')}"


def reference_problem(scenario: Scenario) -> str:
    """Return why no controller could follow the reference of a scenario of a vane; an empty text where one might."""
    if scenario.controlled != ANGLE:
        return ""
    if vane_motion(scenario).profile is not None:
        return (
            f"reference.of = 'angle': motion.kind = '{scenario.motion.motion_kind.name}' moves the angle by itself; "
            "take motion.kind = 'free' or 'leg'"
        )
    valve = scenario.device.valve.kind
    if VALVES[valve].vents_at_rest:
        return (
            f"reference.of = 'angle': a valve of kind '{valve}' vents both chambers at a command of 0 and holds no "
            "angle; take one that is closed there, such as device.valve = 'proportional'"
        )
    actuator, run = scenario.device.actuator, scenario.run
    stops = actuator.angle_min, actuator.angle_max
    return profile_problem(scenario.device.name, stops, scenario.reference, run.duration, run.step, "reference")
