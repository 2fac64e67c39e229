"""Profiles of a scenario (functions of time): reading from a file, engine parameters, values and bounds."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.control.catalog import PROFILES
from ppafo.control.profiles import disordered_knot
from ppafo.engine.in_python import over_samples
from ppafo.engine.rows import rebuilt
from ppafo.errors import KindError
from ppafo.model.catalog import VALVES
from ppafo.model.columns import Problem, at, first, larger, over_runs
from ppafo.model.controlled import ANGLE, TORQUE, ControlledQuantity, Ends
from ppafo.model.declaration import Quantity
from ppafo.parameters.declared import kind_at
from ppafo.parameters.device import Device
from ppafo.signals.recording import OF_SECOND_CHAMBER
from ppafo.simulation.document import DocumentReader
from ppafo.simulation.scenario import ProfileChoice, Scenario, vane_motion
from ppafo.units.shown import in_units, shown_text

MAXIMUM_CHECKED_TIMES = 20_000.0
TOLERANCE = 1.0e-9
"""Tolerance of an angle beyond a stop [rad]: rounding of a stop given in degrees."""


def profile_parameters(choice: ProfileChoice) -> Any:
    """NamedTuple of a profile's settings, which may be arrays; nested tuples are filled in quantity order."""
    kind = PROFILES[choice.kind]
    return rebuilt(kind.parameters, [choice.settings[quantity.name] for quantity in kind.quantities])


def profile_values(choice: ProfileChoice, times: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> np.ndarray:
    """Value, rate and second derivative of a profile at times [s], shape (3, times)."""
    rows = np.empty((3, times.size))
    for row, series in enumerate(over_samples(PROFILES[choice.kind].value, profile_parameters(choice), times)):
        rows[row] = series
    return rows


def of_profile(function: Callable[[Any], Any], choice: ProfileChoice) -> Any:
    """Result of a function of a profile's parameters; arrays (runs,) if its settings are arrays."""
    kind = PROFILES[choice.kind]
    numbers = [choice.settings[quantity.name] for quantity in kind.quantities]
    return over_runs(lambda *values: function(rebuilt(kind.parameters, values)), *numbers)


def profile_bounds(choice: ProfileChoice) -> tuple[float, float]:
    """Lowest and highest value of a profile [N m or rad, as its levels]; arrays (runs,) if its settings are arrays."""
    lowest, highest = of_profile(PROFILES[choice.kind].bounds, choice)
    if not np.all(lowest <= highest):
        found = f"{first(lowest):.6g} and {first(highest):.6g}"
        raise KindError(
            f"profile '{choice.kind}': bounds(parameters) must return lowest and highest value, not {found}"
        )
    return lowest, highest


def read_profile(
    reading: DocumentReader, section: str, quantities: tuple[Quantity, ...], atmosphere: float = STANDARD_ATMOSPHERE
) -> ProfileChoice:
    """Return a profile with all its settings in SI."""
    return ProfileChoice(kind_at(reading.document, section), reading.section(section, quantities, atmosphere))


def disordered_knots(choice: ProfileChoice, section: str) -> Problem:
    """Problem of a table with a knot in use that is not later than the one before; of no other profile."""
    if "time_02" not in choice.settings:
        return False, lambda _run: ""
    disordered = of_profile(disordered_knot, choice)

    def line(run: int) -> str:
        number = round(at(disordered, run))
        earlier, later = (f"time_{place:02}" for place in (number - 1, number))
        before, time = (shown_text(at(choice.settings.get(name, 0.0), run), "s", ".9g") for name in (earlier, later))
        named = f"{section}.{earlier}" if earlier in choice.settings else "the first knot"
        return f"{section}.{later} = {time}: must be later than {named}, {before}"

    return disordered > 0.0, line


def profiles_of(scenario: Scenario) -> dict[str, ProfileChoice]:
    """Return the profiles of a scenario by section."""
    motion = scenario.motion
    leg = getattr(motion, "leg", None)
    path = getattr(motion, "profile", None)
    shank = None if leg is None else leg.shank
    found = {"reference": scenario.reference, "motion.profile": path, "motion.shank": shank}
    return {section: choice for section, choice in found.items() if isinstance(choice, ProfileChoice)}


class Limits(NamedTuple):
    """Lowest and highest possible value of a quantity; arrays (runs,) if they vary.

    ``words`` names the limits in messages, ``unit`` is their unit, and ``room`` the atmospheric pressure [Pa] to which
    displayed gauge pressures refer.
    """

    words: str
    lowest: Any
    highest: Any
    unit: str
    room: Any

    @property
    def allowed(self) -> tuple[Any, Any]:
        """Lowest and highest accepted value: the limits with a margin for rounding in unit conversion."""
        return widened(self.lowest, self.highest)

    def text(self, value: float) -> str:
        """Value in its display unit."""
        return shown_text(value, self.unit, atmosphere=self.room)


def widened(lowest: Any, highest: Any) -> tuple[Any, Any]:
    """Return limits with a margin for rounding in unit conversion; elementwise for columns."""
    margin = TOLERANCE * larger(1.0, larger(abs(lowest), abs(highest)))
    return lowest - margin, highest + margin


def limits_of(device: Device, followed: ControlledQuantity) -> Limits:
    """Reach of a device in the controlled quantity of a reference; infinite for a torque."""
    actuator = device.actuator
    room = device.supply.atmospheric_pressure
    ends = Ends(actuator.angle_min, actuator.angle_max, *device.highest_pressures, room)
    lowest, highest = (-np.inf, np.inf) if followed.reach is None else followed.reach(ends)
    words = f"{followed.limits} of {device.name}"
    return Limits(words=words, lowest=lowest, highest=highest, unit=followed.level.unit, room=room)


class ProfileCourse(NamedTuple):
    """Function that returns value, rate and second derivative of a profile at a time [s]."""

    value: Callable[[Any, float], tuple[float, float, float]]


def excursion(
    profile: Any, lowest: float, highest: float, duration: float, step: float, *, parts: ProfileCourse
) -> tuple[float, float]:
    """Return the first time [s] at which a profile leaves a range, and its value there; time -1 if it stays inside.

    The times are those of the engine as far as they can be gone through one by one, and crests between two of them.
    """
    count = max(1.0, min(MAXIMUM_CHECKED_TIMES, float(int(duration / step + 0.5))))
    number = 0.0
    moment = -1.0
    found = 0.0
    while number <= count and moment < 0.0:
        time = duration * number / count
        value, rate, acceleration = parts.value(profile, time)
        # Where a parabola through this time turns.
        away = -rate / acceleration if acceleration != 0.0 else 0.0
        turned = value + 0.5 * rate * away
        is_crest = away > 0.0 and away < min(duration / count, duration - time)
        is_outside = not (value >= lowest and value <= highest)
        is_crest_outside = is_crest and not (turned >= lowest and turned <= highest)
        moment = time if is_outside else (time + away if is_crest_outside else -1.0)
        found = value if is_outside else turned
        number = number + 1.0
    return moment, found


@in_units(lambda scenario: scenario.device.shown)
def reference_problem(scenario: Scenario) -> str:
    """Return the reason why no controller could follow the reference of a scenario of a vane; "" if there is none."""
    if scenario.controlled == TORQUE:
        return ""
    if scenario.controlled == ANGLE and vane_motion(scenario).profile is not None:
        return f"reference.of = 'angle': motion.kind = '{scenario.motion.motion_kind.name}' prescribes the angle"
    valve = scenario.device.valve.kind
    if scenario.controlled == ANGLE and VALVES[valve].vents_at_rest:
        return f"reference.of = 'angle': a valve of kind '{valve}' vents both chambers at command 0 and holds no angle"
    if scenario.device.actuator.has_one_chamber and scenario.controlled in OF_SECOND_CHAMBER:
        return f"reference.of = '{scenario.controlled}': {scenario.device.name} has only one chamber"
    return ""
