"""From a name or a file to a scenario that is a walk; every mistake is one clear line."""

import copy
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

from ppafo.control.fixed.torque_laws import FIXED, FLOAT
from ppafo.control.fixed.walking_numbers import FIXED_WALKS
from ppafo.control.kind import ControllerKind
from ppafo.control.walking.catalog import TIMINGS, load_walking_controller, walking_controllers, with_timing
from ppafo.documents.models import validate
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import ParameterError, ScenarioError, nearest_name, one_line
from ppafo.gait import NORMATIVE, Gait, load_gait
from ppafo.model.catalog import VALVES
from ppafo.model.declaration import FORCE_LAG, PRESSURE_LAG, VALVE_DELAY, VALVE_LAG, Quantity
from ppafo.model.regulator import SupplyLines
from ppafo.parameters import ParameterSet
from ppafo.parameters.device import Device, Valve
from ppafo.parameters.graph import Follows, Graph, Term
from ppafo.simulation.building import (
    Hardware,
    ScenarioRequest,
    assumed_lines,
    device_paths,
    is_of_device,
    read_device,
    read_hardware,
    read_supply_lines,
    read_thermal,
    split_override,
)
from ppafo.simulation.declaration import ISOTHERMAL, PERIOD, RATE, SUPPLY_LINE, kind_at, value_at
from ppafo.simulation.reading import Reading
from ppafo.simulation.scenario import Assumption, Control, MotionKind, Origin, Scenario, Sensors
from ppafo.walking.bottle import BOTTLE, BOTTLE_NAME, BOTTLE_OVERRIDES, BottleSupply, read_bottle
from ppafo.walking.contradictions import check_walk, rules
from ppafo.walking.course import WalkingCourse, load_course
from ppafo.walking.declaration import (
    ARITHMETIC,
    BANDWIDTHS,
    DURATION,
    FAULTY,
    FORCES,
    PERSON,
    SEED,
    STEP,
    THRESHOLDS,
    WALK_SENSORS,
    controller_settings,
    converter_settings,
    fault_numbers,
    quantities,
    timing_settings,
)
from ppafo.walking.motion import WalkMotion, walk_of
from ppafo.walking.planning import NO_REFERENCE, course_of_walk, noise, plan_walks, switches, walking_valve
from ppafo.walking.preparation import FaultSettings, SensorSettings
from ppafo.walking.result import lacks, measured
from ppafo.walking.schema import walk_file
from ppafo.walking.varying import (
    PLACES,
    clock_with,
    duration_problems,
    numbers_of_scenario,
    record_interval,
    with_duration,
)
from ppafo.walking.wearer import read_wearer, wearer_origin

FILE = TomlKind("walk", "walk", resources.files("ppafo.walking") / "configurations", ScenarioError)
_TEXTS = (
    "gait",
    "course",
    "device.set",
    "device.valve",
    "controller.kind",
    "timing.kind",
    "gas_model.kind",
    BOTTLE_NAME,
    *(f"faults.{sensor}.kind" for sensor in FAULTY),
)
DEFAULT_PERIOD = 1.0e-3
DEFAULT_DURATION, BOTTLE_DURATION = 60.0, 600.0
"""Length of a walk [s], and of one on a bottle, unless given or ended by the bottle before."""

_TURN = 2.0 * math.pi


def list_walks() -> tuple[str, ...]:
    """Return the names of the walk configurations that come with the package."""
    return FILE.names()


def load_walk(
    name_or_path: str | Path,
    overrides: Iterable[str] = (),
    gait: str | Path | None = None,
    course: str | Path | None = None,
    bottle: str | Path | None = None,
    parameter_set: ParameterSet | None = None,
) -> Scenario:
    """Return a scenario that is a walk by its name in the package or by the path of a TOML file, in SI units.

    ``overrides`` are texts such as ``controller.peak_torque=6 N m`` or ``valve.area=12.6mm^2``; ``gait``,
    ``course`` and ``bottle`` replace those of the file. A gait that is named, by the file or by ``gait``, brings its
    subject as the default wearer; ``parameter_set`` takes the place of the set that is named. ScenarioError,
    ParameterError or DataError for anything that cannot be used.
    """
    file = label(str(name_or_path))
    given = tuple(overrides)
    _check_given_once(given, {"gait": gait, "course": course, BOTTLE_NAME: bottle}, file)
    content = FILE.parse(FILE.read(name_or_path), file)
    document = _apply_overrides(content, given, file)
    if bottle is not None:
        document.setdefault(BOTTLE, {})["name"] = str(bottle)
    load_walking_controller(kind_at(document, "controller"))
    validate(walk_file(), document, file, ScenarioError)
    reading = Reading(file, document, frozenset(split_override(text)[0] for text in given))
    folder = Path(name_or_path).parent
    law = walking_controllers()[kind_at(document, "controller")]
    of_device = tuple(text for text in given if is_of_device(split_override(text)[0]))
    request = ScenarioRequest(file, str(name_or_path), folder, content, given, parameter_set)
    hardware = read_hardware(reading, request, of_device)
    device = _device(reading, hardware)
    walked = _gait(gait or document.get("gait", NORMATIVE), folder, gait is None)
    is_named = gait is not None or "gait" in document
    carried = read_bottle(reading, device, folder if bottle is None else Path())
    lines = _lines(reading, document, device, carried)
    settings = _sensor_settings(reading)
    links = _links(reading, law, device)
    _check_timing(law, reading)
    motion = WalkMotion(
        kind=WALK,
        gait=walked,
        wearer=read_wearer(reading, walked, is_named),
        timing=_timing_kind(document),
        forces={name: number for name, number in settings.numbers.items() if name in FORCES},
        faults=settings.faults,
        course=_course(course or document.get("course"), folder, course is None),
        bottle=carried,
        wearer_origin=wearer_origin(reading, walked, is_named),
        person=_person(reading),
    )
    said = {"gait": gait, "course": course, BOTTLE_NAME: bottle}
    more = tuple(f"{path}={_absolute(item)}" for path, item in said.items() if item is not None)
    supply, step = device.supply, reading.number("run.step", STEP)
    scenario = Scenario(
        name=document["name"],
        description=document.get("description", ""),
        device=device,
        duration=DEFAULT_DURATION,
        time_step=step,
        output_interval=record_interval(DEFAULT_DURATION),
        motion=motion,
        initial_pressure_1=supply.atmospheric_pressure,
        initial_pressure_2=supply.atmospheric_pressure,
        control=_control(reading, law, device, settings, links),
        reference=NO_REFERENCE,
        sensors=_sensors(reading, settings),
        assumptions=_assumed(reading, carried),
        origin=Origin(str(name_or_path), document["device"]["set"], hardware.valve, (*given, *more), content),
        thermal=read_thermal(reading),
        supply_lines=lines,
        links=links,
    )
    check_walk(scenario, reading)
    return with_duration(scenario, _duration(reading, scenario))


def _absolute(name: str | Path) -> str:
    """Return a name as it is and the path of a file in full, which means the same from any folder."""
    path = Path(name)
    return str(path.absolute()) if path.suffix == ".toml" else str(name)


def _person(reading: Reading) -> float:
    """Return the number of the person who walks."""
    person = reading.number("wearer.person", PERSON)
    if person != int(person):
        raise reading.refusal("wearer.person", "must be a whole number")
    return person


def _duration(reading: Reading, scenario: Scenario) -> float:
    """Return the length of a walk [s]: that of its file, else of its course, else a minute, or ten on a bottle."""
    # As long as the wearer with the gait as it is takes for it, whoever walks.
    course = course_of_walk(replace(scenario, motion=replace(walk_of(scenario), person=0.0)))
    if value_at(reading.document, "run.duration") is not None:
        duration = reading.number("run.duration", DURATION)
        for is_bad, line in duration_problems(scenario, duration):
            if is_bad:
                raise ScenarioError(f"{reading.file}: {line(0)}")
        return duration
    if course is not None:
        return float(course.duration)
    return DEFAULT_DURATION if walk_of(scenario).bottle is None else BOTTLE_DURATION


def _assumed(reading: Reading, carried: BottleSupply | None) -> tuple[Assumption, ...]:
    """Return what a walk assumes: its file says it, its lines and the bottle that it hangs on."""
    own = reading.document.get("assumed", {}) | ({} if carried is None else carried.assumed)
    values = ((path, value_at(reading.document, path), note) for path, note in own.items())
    found = {path: Assumption(path, "" if value is None else str(value), note) for path, value, note in values}
    lines = {item.path: replace(item, note=f"{item.value}, {item.note}") for item in assumed_lines(reading)}
    return tuple({**found, **lines}.values())


def _check_given_once(overrides: tuple[str, ...], others: Mapping[str, object], file: str) -> None:
    """Refuse an override beside another word for the same value; ``others`` by path, None where nothing was said."""
    for override in overrides:
        path, text = split_override(override)
        other = others.get(path)
        if other is not None:
            raise ScenarioError(
                f"{file}: override '{path}={text}': the {path.partition('.')[0]} is given as '{one_line(other)}' "
                "already; give it once"
            )


def _apply_overrides(document: dict[str, Any], overrides: tuple[str, ...], file: str) -> dict[str, Any]:
    """Return a copy of the document with the overrides of the walk in it; those of the device are left out."""
    changed = copy.deepcopy(document)
    for override in overrides:
        path, text = split_override(override)
        load_walking_controller(text if path == "controller.kind" else kind_at(changed, "controller"))
        known = (*quantities(kind_at(changed, "controller"), _timing_kind(changed, path, text)), *_TEXTS)
        is_arithmetic = path == ARITHMETIC and kind_at(changed, "controller") in FIXED_WALKS
        if path in known or is_arithmetic:
            _set(changed, path, text)
        elif path in BOTTLE_OVERRIDES:
            own = changed.setdefault(BOTTLE, {}).setdefault("overrides", [])
            own.append(f"{BOTTLE_OVERRIDES[path]}={text}")
        elif not is_of_device(path):
            hint = nearest_name(path, [*known, *BOTTLE_OVERRIDES, *device_paths()])
            raise ScenarioError(f"override '{one_line(override)}': {file} has no value '{path}'{hint}")
    return changed


def _timing_kind(document: dict[str, Any], path: str = "", text: str = "") -> str:
    """Return how the time in the stride is known, also by an override that is about to say it."""
    return text if path == "timing.kind" else kind_at(document, "timing") or THRESHOLDS


def _check_timing(law: ControllerKind, reading: Reading) -> None:
    """Raise ScenarioError for a timing of a controller that goes by no time in the stride."""
    try:
        with_timing(law, TIMINGS[_timing_kind(dict(reading.document))])
    except ScenarioError as error:
        raise ScenarioError(f"{reading.file}: {error}") from error


def _links(reading: Reading, law: ControllerKind, device: Device) -> Graph:
    """Return which settings of controller and timing follow others because the file does not give them."""
    timing = timing_settings(_timing_kind(dict(reading.document)))
    found = links_of_defaults({"controller": law.quantities, "timing": timing}, device)
    return {path: links for path, links in found.items() if value_at(reading.document, path) is None}


def _settings(
    reading: Reading, law: ControllerKind, device: Device, sensors: SensorSettings, links: Graph
) -> dict[str, float]:
    """Return the settings of controller and timing [SI]; what is not given may follow valve and sensors."""
    present = {f"valve.{name}": number for name, number in device.valve.settings.items()}
    present |= {f"sensors.{name}": number for name, number in sensors.numbers.items()}
    sections = {"controller": law.quantities, "timing": timing_settings(_timing_kind(dict(reading.document)))}
    found: dict[str, float] = {}
    for section, items in sections.items():
        paths = {f"{section}.{item.name}": item for item in items}
        known = (with_default(item, path, links, present.__getitem__) for path, item in paths.items())
        found |= reading.section(section, tuple(known))
    return found


def _control(reading: Reading, law: ControllerKind, device: Device, sensors: SensorSettings, links: Graph) -> Control:
    """Return the controller with its settings and those of its timing and its converter."""
    settings = _settings(reading, law, device, sensors, links) | _converter(reading, law)
    arithmetic = value_at(reading.document, ARITHMETIC) or FLOAT
    return Control(law.name, settings, _period(reading), arithmetic=arithmetic)


def _converter(reading: Reading, law: ControllerKind) -> dict[str, float]:
    """Return the settings of the converter [SI] of a controller on whole numbers, none where it has floats."""
    items = converter_settings(law.name)
    if value_at(reading.document, ARITHMETIC) == FIXED:
        if _timing_kind(dict(reading.document)) != THRESHOLDS:
            raise reading.refusal(ARITHMETIC, f"whole numbers know the time in the stride by {THRESHOLDS} only")
        return reading.section("controller", items)
    for item in items:
        if value_at(reading.document, f"controller.{item.name}") is not None:
            raise reading.refusal(f"controller.{item.name}", f'needs {ARITHMETIC} = "{FIXED}"')
    return {}


def _set(document: dict[str, Any], path: str, text: str) -> None:
    section, _, name = path.rpartition(".")
    table = document
    for part in section.split(".") if section else ():
        table = table.setdefault(part, {})
    if path == "gas_model.kind" and text == ISOTHERMAL:
        table.clear()
    if path == "controller.kind" and table.get("kind") != text:
        kept = {item.name for item in (RATE, PERIOD, *controller_settings(text))}
        for key in set(table) - kept:
            del table[key]
    if path == "timing.kind":
        kept = {item.name for item in timing_settings(text)}
        for key in set(table) - kept:
            del table[key]
    table.pop({"controller.rate": "period", "controller.period": "rate"}.get(path, ""), None)
    table[name] = int(text) if path == "sensors.seed" and text.isdecimal() and len(text) < 20 else text


def _device(reading: Reading, hardware: Hardware) -> Device:
    device = read_device(reading, hardware)
    try:
        device.check_vane("a walk")
    except ParameterError as error:
        raise ParameterError(f"{reading.file}: [device]: {one_line(error)}") from error
    return device


def _lines(
    reading: Reading, document: dict[str, Any], device: Device, carried: BottleSupply | None
) -> SupplyLines | None:
    """Return the lines of a walk; a bottle always feeds some, with the defaults of what the file does not say."""
    if carried is not None:
        document.setdefault(SUPPLY_LINE, {})
    lines = read_supply_lines(reading, device)
    return lines if lines is None or carried is None else carried.lines(lines)


def _course(name: str | Path | None, folder: Path, relative: bool) -> WalkingCourse | None:
    if name is None:
        return None
    path = Path(name)
    is_path = path.suffix == ".toml"
    return load_course(folder / path if is_path and relative and not path.is_absolute() else name)


def _gait(name: str | Path, folder: Path, relative: bool) -> Gait:
    path = Path(name)
    is_path = path.suffix == ".toml"
    return load_gait(folder / path if is_path and relative and not path.is_absolute() else name)


def _sensors(reading: Reading, settings: SensorSettings) -> Sensors:
    values = settings.numbers
    return Sensors(
        angle_noise=values["angle_noise"],
        pressure_noise=values["pressure_noise"],
        angle_quantum=values["angle_resolution"],
        pressure_quantum=values["pressure_resolution"],
        seed=int(reading.number("sensors.seed", SEED)),
        angle_bandwidth=values["angle_bandwidth"],
        pressure_bandwidth=values["pressure_bandwidth"],
    )


def _sensor_settings(reading: Reading) -> SensorSettings:
    numbers = reading.section("sensors", WALK_SENSORS)
    for bandwidth in BANDWIDTHS:
        path = f"sensors.{bandwidth.name}"
        if value_at(reading.document, path) is not None:
            numbers[bandwidth.name] = reading.number(path, bandwidth)
    return SensorSettings(numbers, {sensor: _fault(reading, sensor) for sensor in FAULTY})


def _fault(reading: Reading, sensor: str) -> FaultSettings:
    section = f"faults.{sensor}"
    kind = kind_at(reading.document, section)
    items = fault_numbers(sensor, kind)
    return FaultSettings(kind, {item.name: reading.number(f"{section}.{item.name}", item) for item in items})


def _period(reading: Reading) -> float:
    """Return the sample period [s] from a rate or a period, 1 ms where neither is given."""
    rate, period = (value_at(reading.document, f"controller.{name}") for name in ("rate", "period"))
    if rate is not None and period is not None:
        raise reading.refusal("controller.rate", "give either controller.rate or controller.period, not both")
    if rate is not None:
        return 1.0 / reading.number("controller.rate", RATE)
    return DEFAULT_PERIOD if period is None else reading.number("controller.period", PERIOD)


WALK = MotionKind(
    name="walk",
    plan=plan_walks,
    rules=rules,
    quantities=numbers_of_scenario,
    places=PLACES,
    clock=clock_with,
    switches=switches,
    noise=noise,
    lacks=lacks,
    measured=measured,
)
"""The motion of a scenario that walks."""


def lag_of_bandwidth(bandwidth: float) -> float:
    """Time constant [s] of a sensor of a bandwidth [Hz]; 0 for one that follows at once, whose bandwidth is 0."""
    return 1.0 / (_TURN * bandwidth) if bandwidth > 0.0 else 0.0


def links_of_defaults(sections: Mapping[str, Iterable[Quantity]], device: Device) -> Graph:
    """Return the links of the quantities of some sections whose defaults follow others, by path."""
    terms = _terms(device.valve)
    return {
        f"{section}.{item.name}": (Follows(tuple(terms[name] for name in item.follows), item.default or 0.0),)
        for section, items in sections.items()
        for item in items
        if item.follows
    }


def with_default(item: Quantity, path: str, links: Graph, present: Callable[[str], Any]) -> Quantity:
    """Return a quantity with the default that follows from what others are at ``present``."""
    return replace(item, default=float(links[path][0].number(present))) if path in links else item


def _terms(valve: Valve) -> dict[str, Term]:
    kind = VALVES[valve.kind]
    names = tuple(item.name for item in kind.quantities)
    paths, delay = tuple(f"valve.{name}" for name in names), walking_valve(valve).command_delay
    return {
        VALVE_LAG: Term(paths, kind.lag or delay, names),
        VALVE_DELAY: Term(paths, delay, names),
        PRESSURE_LAG: Term(("sensors.pressure_bandwidth",), lag_of_bandwidth),
        FORCE_LAG: Term(("sensors.force_bandwidth",), lag_of_bandwidth),
    }
