"""From a name or a file to a walk configuration; every mistake is one clear line."""

import copy
import math
from collections.abc import Iterable, Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from ppafo.control.fixed.torque_laws import FIXED
from ppafo.control.fixed.walking_numbers import FIXED_WALKS
from ppafo.control.kind import ControllerKind
from ppafo.control.walking.catalog import TIMINGS, load_walking_controller, walking_controllers, with_timing
from ppafo.documents.models import validate
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import ParameterError, ScenarioError, nearest_name, one_line
from ppafo.gait import NORMATIVE, Gait, load_gait
from ppafo.model.regulator import SupplyLines
from ppafo.model.sensors import SensorParameters
from ppafo.parameters import apply_overrides, build_device, load_parameter_set
from ppafo.parameters.device import Device
from ppafo.parameters.graph import Graph
from ppafo.parameters.parameter_set import atmospheric_pressure, links_of_set
from ppafo.simulation.declaration import ISOTHERMAL, PERIOD, RATE, kind_at, value_at
from ppafo.simulation.gas_sections import assumed_lines, read_supply_lines, read_thermal
from ppafo.simulation.overriding import device_paths, is_of_device, split_override
from ppafo.simulation.reading import Reading
from ppafo.simulation.supply_line import SECTION as LINES
from ppafo.walking import bottle_supply
from ppafo.walking.bottle_supply import BottleSupply, read_bottle
from ppafo.walking.configuration import Configuration
from ppafo.walking.contradictions import check_walk
from ppafo.walking.course import WalkingCourse, load_course
from ppafo.walking.declaration import (
    ARITHMETIC,
    BANDWIDTHS,
    FAULTY,
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
from ppafo.walking.following import links_of_defaults, with_default
from ppafo.walking.gait_subject import read_wearer, wearer_origin
from ppafo.walking.planning import course_of_walk
from ppafo.walking.schema import walk_file
from ppafo.walking.sensor_settings import FaultSettings, SensorSettings, sensors_of

FILE = TomlKind("walk", "walk", resources.files("ppafo.walking") / "configurations", ScenarioError)
_TURN = 2.0 * math.pi
_TEXTS = (
    "gait",
    "course",
    "device.set",
    "device.valve",
    "controller.kind",
    "timing.kind",
    "gas_model.kind",
    bottle_supply.NAME,
    *(f"faults.{sensor}.kind" for sensor in FAULTY),
)
DEFAULT_PERIOD = 1.0e-3


def list_walks() -> tuple[str, ...]:
    """Return the names of the walk configurations that come with the package."""
    return FILE.names()


def load_walk(
    name_or_path: str | Path,
    overrides: Iterable[str] = (),
    gait: str | Path | None = None,
    course: str | Path | None = None,
    bottle: str | Path | None = None,
) -> Configuration:
    """Return a walk configuration by its name in the package or by the path of a TOML file, in SI units.

    ``overrides`` are texts such as ``controller.peak_torque=6 N m`` or ``valve.area=12.6mm^2``; ``gait``,
    ``course`` and ``bottle`` replace those of the file. A gait that is named, by the file or by ``gait``, brings its
    subject as the default wearer. ScenarioError, ParameterError or DataError for anything that cannot be used.
    """
    file = label(str(name_or_path))
    given = tuple(overrides)
    _check_given_once(given, {"gait": gait, "course": course, bottle_supply.NAME: bottle}, file)
    document = _apply_overrides(FILE.parse(FILE.read(name_or_path), file), given, file)
    if bottle is not None:
        document.setdefault(bottle_supply.SECTION, {})["name"] = str(bottle)
    load_walking_controller(kind_at(document, "controller"))
    validate(walk_file(), document, file, ScenarioError)
    reading = Reading(file, document, frozenset(split_override(text)[0] for text in given))
    folder = Path(name_or_path).parent
    law = walking_controllers()[kind_at(document, "controller")]
    device = _device(document, [text for text in given if is_of_device(split_override(text)[0])], file)
    walked = _gait(gait or document.get("gait", NORMATIVE), folder, gait is None)
    is_named = gait is not None or "gait" in document
    carried = read_bottle(reading, device, folder if bottle is None else Path())
    lines = _lines(reading, document, device, carried)
    sensor_settings = _sensor_settings(reading)
    gait_sensors = sensors_of(sensor_settings, _period(reading))
    links = _links(reading, law, device)
    configuration = Configuration(
        name=document["name"],
        description=document.get("description", ""),
        device=device,
        gait=walked,
        wearer=read_wearer(reading, walked, is_named),
        controller=_timed(law, reading),
        settings=_settings(reading, law, device, sensor_settings, links),
        sensors=_sensors(reading),
        gait_sensors=gait_sensors,
        sensor_settings=sensor_settings,
        period=_period(reading),
        step=reading.number("run.step", STEP),
        assumed=_assumed(reading, carried),
        file=str(name_or_path),
        overrides=given,
        supply_lines=lines,
        thermal=read_thermal(reading),
        course=_course(course or document.get("course"), folder, course is None),
        wearer_origin=wearer_origin(reading, walked, is_named),
        bottle=carried,
        converter=_converter(reading, law),
        links=links,
    )
    check_walk(configuration, reading)
    course_of_walk(configuration)
    return configuration


def _assumed(reading: Reading, carried: BottleSupply | None) -> dict[str, str]:
    """Return what a walk assumes, by path: its file says it, its lines and the bottle that it hangs on."""
    lines = {item.path: f"{item.value}, {item.note}" for item in assumed_lines(reading)}
    return {**reading.document.get("assumed", {}), **lines, **({} if carried is None else carried.assumed)}


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
        elif path in bottle_supply.OVERRIDES:
            own = changed.setdefault(bottle_supply.SECTION, {}).setdefault("overrides", [])
            own.append(f"{bottle_supply.OVERRIDES[path]}={text}")
        elif not is_of_device(path):
            hint = nearest_name(path, [*known, *bottle_supply.OVERRIDES, *device_paths()])
            raise ScenarioError(f"override '{one_line(override)}': {file} has no value '{path}'{hint}")
    return changed


def _timing_kind(document: dict[str, Any], path: str = "", text: str = "") -> str:
    """Return how the time in the stride is known, also by an override that is about to say it."""
    return text if path == "timing.kind" else kind_at(document, "timing") or THRESHOLDS


def _timed(law: ControllerKind, reading: Reading) -> ControllerKind:
    """Return the controller with the timing of the file; ScenarioError where it goes by no time in the stride."""
    try:
        return with_timing(law, TIMINGS[_timing_kind(dict(reading.document))])
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


def _converter(reading: Reading, law: ControllerKind) -> dict[str, float] | None:
    """Return the settings of the converter [SI] of a controller on whole numbers, None where it has floats."""
    items = converter_settings(law.name)
    if value_at(reading.document, ARITHMETIC) == FIXED:
        if _timing_kind(dict(reading.document)) != THRESHOLDS:
            raise reading.refusal(ARITHMETIC, f"whole numbers know the time in the stride by {THRESHOLDS} only")
        return reading.section("controller", items)
    for item in items:
        if value_at(reading.document, f"controller.{item.name}") is not None:
            raise reading.refusal(f"controller.{item.name}", f'needs {ARITHMETIC} = "{FIXED}"')
    return None


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


def _device(document: dict[str, Any], overrides: list[str], file: str) -> Device:
    section = document["device"]
    valve = section.get("valve")
    try:
        parameters = apply_overrides(load_parameter_set(section["set"]), section.get("overrides", ()), valve)
        before = atmospheric_pressure(parameters) if overrides else None
        parameters = apply_overrides(parameters, overrides, valve)
        given = {split_override(text)[0] for text in overrides}
        device = build_device(parameters, valve, links_of_set(parameters, given, before))
        device.check_vane("a walk")
    except ParameterError as error:
        raise ParameterError(f"{file}: [device]: {one_line(error)}") from error
    return device


def _lines(
    reading: Reading, document: dict[str, Any], device: Device, carried: BottleSupply | None
) -> SupplyLines | None:
    """Return the lines of a walk; a bottle always feeds some, with the defaults of what the file does not say."""
    if carried is not None:
        document.setdefault(LINES, {})
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


def _sensors(reading: Reading) -> SensorParameters:
    values = reading.section("sensors", WALK_SENSORS)
    return SensorParameters(
        angle_noise=values["angle_noise"],
        pressure_noise=values["pressure_noise"],
        angle_quantum=values["angle_resolution"],
        pressure_quantum=values["pressure_resolution"],
        seed=reading.number("sensors.seed", SEED),
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
