"""Changes of a scenario that fails: each suspected property made ideal, or one choice made better in steps.

An ideal number is tiny rather than 0, which would be another compiled program. The gait of a walk is a file and no
number, so that no change makes it slower; a change of a kind is a scenario of its own.
"""

import contextlib
import functools
import math
from collections.abc import Iterator, Mapping
from typing import Any, Literal, NamedTuple

import numpy as np

from ppafo.control.catalog import PROFILES
from ppafo.control.kind import PythonController
from ppafo.errors import PpafoError
from ppafo.loading import reloaded
from ppafo.model.controlled import ANGLE, TORQUE
from ppafo.model.declaration import Quantity
from ppafo.model.plant import gravity_torque
from ppafo.model.valves.kind import VENT
from ppafo.parameters.device import SonicOrifice
from ppafo.parameters.graph import ATMOSPHERE_PATH, PRESSURE_PATH, SECOND_PRESSURE_PATH
from ppafo.parameters.overrides import read_overrides
from ppafo.parameters.plant import plant_parameters
from ppafo.parameters.reach import HIGHEST_PRESSURE, supply_for
from ppafo.simulation.clock import RATE_PATH
from ppafo.simulation.declaration import law_settings
from ppafo.simulation.default_gains import SLOPE_GAINS, default_links
from ppafo.simulation.numbers import declared_numbers, number_at, present_numbers
from ppafo.simulation.scenario import FreeMotion, Scenario
from ppafo.simulation.tracking.case import level_text
from ppafo.simulation.tracking.evidence import (
    CARRYING_START,
    FASTER_CONTROLLER,
    HIGHER_SUPPLY,
    LARGER_VALVE,
    LOAD,
    QUICKER_ABOVE,
    SMALLER_REFERENCE,
    SMALLER_VALVE,
    ideal_words,
)
from ppafo.simulation.tracking.rule import available_torque, only_switches

Group = Literal["law", "start", "device", "sensors", "load", "task"]
"""Part of a scenario that a change concerns."""
AS_IT_IS = "as it is"
JOINT_GAINS = "with all gains chosen together"
_DEFAULT = "with the default"
IDEAL_WORDS = ("without", "with a quicker", "with a straight", "with initial", "with gas", "with the sign")
"""First words of changes that take away a property, rather than choose a better one."""
SLOWER_REFERENCE = "with a slower reference"
_DURATION = "run.duration"
_IDEAL = 1.0e-4
"""Ideal number divided by the present one, where less is better [-]."""
_QUICKEST = {"frequency": 2.0e3, "bandwidth": 1.0e4, "slew_limit": 1.0e4}
"""Ideal number [Hz, 1/s] where more is quicker, by the end of its path."""
_SHORTEST = 1.0e-4
"""Ideal time of a valve that switches or regulates [s]: shorter ones would need shorter steps."""
_FLAWS: Mapping[str, Group] = {
    "friction.static_torque": "device",
    "friction.viscous_damping": "device",
    "actuator.passive_stiffness": "device",
    "actuator.leak.area": "device",
    "actuator.leak.sonic_conductance": "device",
    "supply_line.plantarflexion.droop": "device",
    "supply_line.dorsiflexion.droop": "device",
    "foot_plate.gravity_torque": "load",
    "motion.foot_mass": "load",
    "motion.ankle_torque": "load",
    LOAD: "load",
}
"""Numbers that a device or a task would rather not have although they have no default of 0, and what they belong to."""
_TOGETHER = {
    "friction.static_torque": "friction.dynamic_torque",
    "valve.opening_delay": "valve.closing_delay",
    "friction.static_per_pressure": "friction.dynamic_per_pressure",
}
"""Number that is made ideal with another one."""
_ISOTHERMAL = 1.0e4
"""Heat transfer coefficient [W/(m^2 K)] with which gas keeps the temperature of its walls."""
# Sizes of a valve divided by the present one [-].
_VALVES = (1.5, 2.0, 4.0, 10.0, 30.0, 100.0, 300.0, 1.0e3, 3.0e3, 1.0e4)
_SMALL_VALVES = (0.3, 0.1, 0.03, 0.01)
_FILLED = 5.0e-3
"""Time in which a larger valve fills the chambers at least [s]: a larger one needs shorter steps and helps no more."""
# Gauge pressures of supplies divided by the present ones [-], and lowest pressure [Pa absolute].
_SUPPLIES = (1.15, 1.4, 1.8, 2.5, 4.0)
_LEAST_PRESSURE = 1.0e3
# Rates of a controller divided by the present one [-], and the highest one [Hz].
_RATES = (4.0, 10.0, 30.0, 100.0)
_TOP_RATE = 2.0e3
_VOLUMES = (0.25, 4.0)
"""Dead volumes divided by the present ones [-]."""
# Speed and size of the reference divided by the present ones [-]; anything follows a reference of almost nothing.
_SPEEDS = (0.5, 0.25, 0.1, 0.05)
_SIZES = (0.8, 0.5, 0.25, 0.1)
_WITHIN_REACH = 0.9
"""Torque that replaces a reference far beyond reach, divided by what the actuator gives [-]."""
_LONGER = 2.0
"""Duration of a longer run divided by the present one [-]."""
_GAINS = (
    "proportional_gain",
    "integral_gain",
    "boundary_layer",
    "surface_slope",
    "convergence_rate",
    "torque_gain",
    "torque_integral_gain",
    "angle_stiffness",
    "angle_damping",
    "load_time",
    "dead_zone",
    "release",
    "opening",
)
"""Gains that are chosen together; the others follow them or are numbers of the device."""
_SAME = 0.02
"""Relative difference up to which two settings count as the same [-]."""
_COMMANDS = (-1.0, 64.0, 8.0, 1.0 / 16.0)
"""Factors on the command of a Python object, whose gains are unknown; the first one detects a wrong sign [-]."""
# Number of flaws that are made ideal with a Python object, and its longest run divided by the present one [-].
_FLAWS_OF_OBJECT = 3
_LONGEST_OF_OBJECT = 4.0


class Change(NamedTuple):
    """Change of a scenario for a further run.

    ``words`` say it in a sentence, ``group`` is the part of the scenario that it concerns. ``numbers`` [SI] by path are
    replaced in ``base``: the scenario itself, or one with ``overrides`` that no number can make, or one whose Python
    object has another command (``is_of_command``).
    """

    words: str
    group: Group
    numbers: Mapping[str, float]
    base: Scenario
    overrides: tuple[str, ...] = ()
    is_of_command: bool = False


def is_of_defaults(change: Change) -> bool:
    """Return whether a change gives settings of the controller their defaults."""
    return change.words.startswith(_DEFAULT)


def is_of_given(change: Change) -> bool:
    """Return whether a change takes back a setting of the controller, or all of which one was given as an override."""
    typed = {override.typed for override in read_overrides(change.base.origin.overrides)}
    return is_of_defaults(change) and (len(change.numbers) == 1 or not typed.isdisjoint(change.numbers))


class ScaledCommand:
    """Python object whose command is that of another one times a factor; one that vents goes on to vent."""

    def __init__(self, custom: PythonController, factor: float) -> None:
        self.custom = custom

        # With the annotations of the object, which say whether it reads the gait.
        @functools.wraps(custom.update)
        def update(time: float, reference: float, measurement: Any) -> float:
            command = custom.update(time, reference, measurement)
            return command if command == VENT else max(-1.0, min(1.0, factor * command))

        self.update = update

    def reset(self) -> None:
        """Start anew."""
        self.custom.reset()


def changes_of(scenario: Scenario) -> list[Change]:
    """Return the changes that are tried first, smaller steps before larger ones of the same words."""
    present = present_numbers(scenario)
    of_device = [*_ideals(scenario, present), *_better_device(scenario, present), *_starts(scenario, present)]
    of_task = list(_easier_tasks(scenario, present))
    if (custom := scenario.controller.custom) is None:
        return [*_settings(scenario), *_other_kinds(scenario), *of_device, *of_task]
    commands = []
    for factor in _COMMANDS:
        words = f"with {factor:g} times the command" if factor > 0.0 else "with the sign of the command reversed"
        base = scenario.controlled_by(ScaledCommand(custom, factor))
        commands.append(Change(words, "law", {}, base, is_of_command=True))
    # Its runs are slow: of each property the largest step that does not take many times as long.
    longest = _LONGEST_OF_OBJECT * present[_DURATION]
    largest = {}
    for change in (*of_device, *of_task):
        if change.numbers.get(_DURATION, 0.0) <= longest:
            largest[change.words] = change
    # The largest valve of all would let any loop swing.
    valves = [change for change in of_device if change.words == LARGER_VALVE]
    sizes = [
        *valves[len(valves) // 2 :][:1],
        *(largest[each] for each in (HIGHER_SUPPLY, SLOWER_REFERENCE) if each in largest),
    ]
    flaws = [each for words, each in largest.items() if "`" in words and each.group in ("sensors", "device")]
    flaws.sort(key=lambda each: each.group != "sensors")
    return [*commands, *flaws[:_FLAWS_OF_OBJECT], *sizes]


def _ideals(scenario: Scenario, present: Mapping[str, float]) -> Iterator[Change]:
    """Yield a change for each number that a device, a sensor or a load would rather not have."""
    declared = declared_numbers(scenario)
    second = set(_TOGETHER.values())
    of_sensors = dict[str, list[Change]]()
    is_locked = scenario.motion.locked_angle is not None
    for path, number in present.items():
        section = path.partition(".")[0]
        item = declared[path]
        is_flaw = section in ("valve", "sensors", "effects", "friction") and item.default == 0.0
        is_other = path in second or item.whole or ".opening." in path or (is_locked and section == "friction")
        if number == 0.0 or is_other or not (is_flaw or path in _FLAWS):
            continue
        numbers = {
            each: _ideal(each, present[each], item) for each in (path, _TOGETHER.get(path, "")) if present.get(each)
        }
        group = _FLAWS.get(path, "sensors" if section == "sensors" else "load" if "joint_load" in path else "device")
        change = Change(ideal_words(scenario, path), group, numbers, scenario)
        yield change
        if section == "sensors":
            of_sensors.setdefault(path.rpartition("_")[2], []).append(change)
    for several in of_sensors.values():
        # Noise of two sensors, or their resolutions, may each be too much.
        if len(several) > 1:
            words = " and ".join((several[0].words, *(change.words.removeprefix("without ") for change in several[1:])))
            yield Change(
                words, "sensors", {path: n for change in several for path, n in change.numbers.items()}, scenario
            )
    nodes = [path for path in present if path.startswith("effects.opening.command_") and present[path] > 0.0]
    if nodes:
        straight = {path.replace("command", "opening"): present[path] for path in nodes}
        yield Change("with a straight opening of the valve", "device", straight, scenario)
    if present.get("gas_model.wall_area_per_volume", 0.0) > 0.0:
        isothermal = {"gas_model.heat_transfer_coefficient": _ISOTHERMAL}
        yield Change("with gas of constant temperature", "device", isothermal, scenario)


def _ideal(path: str, number: float, item: Quantity) -> float:
    """Ideal number [SI] in place of one: quicker, or so much less that it does nothing."""
    if path.endswith(QUICKER_ABOVE):
        return max(10.0 * number, next((most for end, most in _QUICKEST.items() if path.endswith(end)), 0.0))
    if path == "effects.line_resistance.area":
        return item.maximum
    is_short = path.startswith("valve.") and item.unit == "s" and path != "valve.delay"
    return min(_SHORTEST, number) if is_short else _IDEAL * number


def _better_device(scenario: Scenario, present: Mapping[str, float]) -> Iterator[Change]:
    """Yield changes of the size of a device: rate, valve, supplies, dead volumes."""
    for by in _RATES:
        if (rate := by * present[RATE_PATH]) <= _TOP_RATE:
            yield Change(FASTER_CONTROLLER, "device", {RATE_PATH: rate}, scenario)
    orifice = scenario.device.valve.orifice
    is_sonic = isinstance(orifice, SonicOrifice)
    size, kept = ("sonic_conductance", "critical_ratio") if is_sonic else ("area", "discharge_coefficient")
    form = {f"valve.{name}": present[f"valve.{name}"] for name in (size, kept)}
    plant = plant_parameters(scenario.device)
    swept = plant.displacement_per_radian * (plant.angle_max - plant.angle_min)
    volume = plant.dead_volume_1 + plant.dead_volume_2 + swept
    flow = plant.valve_conductance * plant.gas_product
    larger = [by for by in _VALVES if volume > by * flow * _FILLED]
    # On/off valves may be too large, whose step is the swing.
    smaller = _SMALL_VALVES if only_switches(scenario, scenario.law) else ()
    for words, factors in ((SMALLER_VALVE, smaller), (LARGER_VALVE, larger)):
        for by in factors:
            yield Change(words, "device", {**form, f"valve.{size}": by * form[f"valve.{size}"]}, scenario)
    supplies = [path for path in (PRESSURE_PATH, SECOND_PRESSURE_PATH) if path in present]
    room = present[ATMOSPHERE_PATH]
    for paths in (supplies[:1], supplies[1:], supplies):
        for by in _SUPPLIES if paths else ():
            pressures = {path: room + by * (present[path] - room) for path in paths}
            if min(pressures.values()) > _LEAST_PRESSURE and max(pressures.values()) < room + HIGHEST_PRESSURE:
                yield Change(HIGHER_SUPPLY, "device", pressures, scenario)
    lowest = "valve.lowest_pressure"
    if present.get(lowest, room) > room:
        yield Change(ideal_words(scenario, lowest), "device", {lowest: room}, scenario)
    volumes = [path for path in ("actuator.dead_volume_1", "actuator.dead_volume_2") if present.get(path)]
    for by in _VOLUMES if volumes else ():
        words = f"with {'smaller' if by < 1.0 else 'larger'} dead volumes"
        yield Change(words, "device", {path: by * present[path] for path in volumes}, scenario)


_STARTS = ("initial.pressure_1", "initial.pressure_2")


def _starts(scenario: Scenario, present: Mapping[str, float]) -> Iterator[Change]:
    """Yield changes of the initial pressures: those that carry the load of a free joint, and those of the room."""
    room = present[ATMOSPHERE_PATH]
    motion = scenario.motion
    device = scenario.device
    if _STARTS[0] not in present:
        return
    starts = [(room, room)]
    if isinstance(motion, FreeMotion) and motion.leg is None:
        load = motion.outside_torque + gravity_torque(motion.angle, device.foot_plate.gravity_torque)
        needed = supply_for(device, float(motion.angle), float(load))
        starts += [] if needed is None else [(needed, room), (room, needed)]
    for pressures in starts:
        numbers = {path: value for path, value in zip(_STARTS, pressures, strict=True) if path in present}
        words = CARRYING_START if pressures != (room, room) else "with initial pressures of the atmosphere"
        if any(abs(present[path] - value) > _SAME * room for path, value in numbers.items()):
            yield Change(words, "start", numbers, scenario)


def _easier_tasks(scenario: Scenario, present: Mapping[str, float]) -> Iterator[Change]:
    """Yield changes of the task: a slower and a smaller reference, a longer run; of a walk, less requested torque."""
    duration = present[_DURATION]
    if not scenario.follows_reference:
        peaks = [
            path
            for path in present
            if path.startswith("controller.") and path.endswith(("peak_torque", "largest_torque"))
        ]
        for by in _SIZES:
            yield Change(SMALLER_REFERENCE, "task", {path: by * present[path] for path in peaks}, scenario)
        # A Python object in the place of the law has none of its numbers.
        lifts = [path for path in _DORSIFLEXION if present.get(path, 0.0) > 0.0]
        if lifts:
            words = "without a requested torque in dorsiflexion"
            yield Change(words, "task", {path: _IDEAL * present[path] for path in lifts}, scenario)
        return
    profile = PROFILES[scenario.reference.kind]
    of = {item.name: (f"reference.{item.name}", item.unit) for item in profile.quantities}
    # Knots that a table does not use lie far away; a ramp that begins later is no slower one.
    times = [
        path
        for path, unit in of.values()
        if unit == "s" and 0.0 < present.get(path, 0.0) < _UNUSED and not path.endswith("ramp_start")
    ]
    rates = [path for path, unit in of.values() if unit == "Hz" and present.get(path)]
    length = math.fsum(present[path] for path in times if ".ramp_" in path)
    length = max(length, *(present[path] for path in times), *(2.0 / present[path] for path in rates), 0.0)
    for by in _SPEEDS if length else ():
        numbers = {path: present[path] / by for path in times} | {path: present[path] * by for path in rates}
        # As long as the slower reference needs, in whole durations, whose output intervals fit.
        longer = min(math.ceil(1.0 / by), max(1, math.ceil(2.0 * length / (by * duration))))
        yield Change(SLOWER_REFERENCE, "task", {**numbers, _DURATION: longer * duration}, scenario)
    knots = [path for path in present if path.startswith("reference.value_")]
    used = [path for path in knots if present.get(path.replace("value", "time"), 0.0) < _UNUSED]
    start = next((present[path] for path in ("reference.start_level", "reference.value_01") if path in present), 0.0)
    paths = used or ("reference.level",)
    sizes = list(_SIZES)
    if scenario.controlled == TORQUE:
        farthest = max(abs(present[path]) for path in paths)
        reach = _WITHIN_REACH * float(np.max(np.abs(available_torque(scenario))))
        sizes += [reach / farthest] if farthest * _SIZES[-1] > reach else []
    amplitude = "reference.amplitude"
    for by in sizes:
        levels = {path: start + by * (present[path] - start) for path in paths}
        smaller = {amplitude: by * present[amplitude]} if present.get(amplitude) else levels
        yield Change(SMALLER_REFERENCE, "task", smaller, scenario)
    yield Change("with a longer run", "task", {_DURATION: _LONGER * duration}, scenario)


_UNUSED = 1.0e6
"""Time from which a knot of a table is none [s]."""
_DORSIFLEXION = (
    "controller.landing_peak_torque",
    "controller.swing_peak_torque",
    "controller.hold_stiffness",
    "controller.hold_damping",
)
"""Settings of a walking controller that request a torque in dorsiflexion."""


def _settings(scenario: Scenario) -> Iterator[Change]:
    """Yield changes of settings of the controller to their defaults: each that differs, and all of them."""
    law = scenario.law
    if law is None:
        return
    settings = scenario.controller.settings
    computed = dict[str, float]()
    for path, (link,) in default_links(scenario, law_settings(law, scenario.controlled)).items():
        # A default may follow one of these before it.
        computed[path] = float(link.number(lambda at: computed[at] if at in computed else number_at(scenario, at)))
    computed |= {f"controller.{name}": 0.0 for name in SLOPE_GAINS if settings.get(name, 0.0) > 0.0}
    present = {path: number_at(scenario, path) for path in computed}
    differs = {path: each for path, each in computed.items() if not math.isclose(present[path], each, rel_tol=_SAME)}
    declared = declared_numbers(scenario)
    for path, default in differs.items():
        stated = f"`{path} = {level_text(declared[path].unit, present[path])}`"
        yield Change(f"{_DEFAULT} in place of {stated}", "law", {path: default}, scenario)
    if len(differs) > 1:
        yield Change(f"{_DEFAULT} settings of the controller", "law", differs, scenario)


def _other_kinds(scenario: Scenario) -> Iterator[Change]:
    """Yield changes of a kind: an angle law with a torque loop inside, a locked joint where nothing resists."""
    is_free = isinstance(scenario.motion, FreeMotion) and scenario.motion.leg is None
    has_loop = "angle_stiffness" in scenario.controller.settings
    kinds = []
    if scenario.controlled == ANGLE and not has_loop:
        kinds += [("with a torque loop inside the law", "law", "controller.kind=cascade")]
    if scenario.controlled != ANGLE and is_free and scenario.follows_reference:
        kinds += [("with a locked joint", "task", "motion.kind=locked")]
    for words, group, override in kinds:
        with contextlib.suppress(PpafoError):
            yield Change(words, group, {}, reloaded(scenario, [override]), (override,))  # type: ignore[arg-type]


def gains_together(scenario: Scenario) -> dict[str, float]:
    """Return the gains [SI] of a law that decide how it moves, by path; none of a Python object."""
    settings = {} if scenario.law is None else scenario.controller.settings
    return {f"controller.{name}": float(settings[name]) for name in _GAINS if settings.get(name)}
