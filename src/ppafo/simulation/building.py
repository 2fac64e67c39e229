"""Building of a scenario from its document and overrides: device, motion, control and assumptions in SI units.

Each mistake in the document raises an error of one line.
"""

import functools
import logging
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ppafo.control.catalog import CONTROLLERS
from ppafo.control.kind import ControllerKind
from ppafo.errors import Faults, ParameterError, ScenarioError, refused_as
from ppafo.model.catalog import VALVES
from ppafo.model.controlled import ANGLE, CONTROLLED, TORQUE
from ppafo.model.declaration import Quantity
from ppafo.parameters import build_device, list_sets, load_parameter_set
from ppafo.parameters.declaration import OF_SECOND_CHAMBER, RELIEVING_PATH, WHY_ONE_CHAMBER
from ppafo.parameters.declared import kind_at, value_at
from ppafo.parameters.device import Device
from ppafo.parameters.graph import Graph, Link, follows, gauge_link
from ppafo.parameters.overrides import CHOSEN_VALVE, Override, check_valve, read_overrides, with_overrides
from ppafo.parameters.parameter_set import (
    PATHS_THAT_SET_UNITS,
    atmospheric_pressure,
    chosen_units,
    chosen_valve,
    entry_text,
    links_of_set,
    units_of_texts,
)
from ppafo.simulation.clock import read_clock
from ppafo.simulation.contradictions import check_contradictions
from ppafo.simulation.declaration import (
    ACCURACY,
    AT_REST,
    INITIAL,
    OF_A_VANE,
    PURPOSE,
    SEED,
    SENSORS,
    SUPPLY_LINE,
    SUPPLY_LINES,
    THERMAL,
    THERMAL_GAS,
    WALL_AREA,
    law_settings,
    line_entries,
    line_quantities,
    quantities,
    reference_settings,
)
from ppafo.simulation.default_gains import default_links
from ppafo.simulation.document import REFERENCE_OF, DocumentReader, controlled_in
from ppafo.simulation.motion_kind import MOTIONS
from ppafo.simulation.numbers import number_at
from ppafo.simulation.overrides import device_paths
from ppafo.simulation.profiles import read_profile, reference_problem
from ppafo.simulation.scenario import (
    PRESSURE_WORDS,
    Assumption,
    Control,
    GasModel,
    Initial,
    Origin,
    ProfileChoice,
    RegulatedLine,
    RunSettings,
    Scenario,
    Sensors,
    SupplyLine,
)
from ppafo.units import format_quantity, split_quantity
from ppafo.units.shown import shown_in, written_text
from ppafo.wording import nearest_name, one_line

logger = logging.getLogger("ppafo")

_PARTS_WITH_UNITS = ("initial", "motion", "controller.peak_torque", "reference")
"""Parts of a file whose quantities define the display units of their author, in increasing priority."""
_NO_REFERENCE = ProfileChoice("constant", {"level": 0.0})
"""Reference of a controller that follows none."""
_ASSUMED = "assumed"
"""Section of a file with a note for each assumed path."""


def read_hardware(reading: DocumentReader) -> tuple[Origin, Graph]:
    """Return the origin, whose parameter set has the overrides of the file, then those of the caller, and its links.

    Values of the file that replace those of another set or valve are logged. Raises ParameterError for unusable values.
    """
    section = reading.document["device"]
    in_file = reading.content.get("device", {})
    overrides = reading.device
    valve = section.get("valve")
    with refused_as(ParameterError, f"{reading.file}: [device]", ParameterError):
        of_file = read_overrides(section.get("overrides", ()))
        check_valve(of_file, in_file.get("valve"), f"device.valve = '{in_file.get('valve')}'")
        set_name = section["set"]
        is_path = Path(set_name).suffix == ".toml" or "/" in set_name
        place = str(reading.folder / set_name) if is_path and set_name not in list_sets() else set_name
        plain_set = reading.parameter_set or load_parameter_set(place)
        valve_name = chosen_valve(plain_set, valve)
        owner = ""
        replacing = tuple[Override, ...]()
        if set_name != in_file.get("set"):
            # Another set than the file's own may have one chamber only.
            missing = OF_SECOND_CHAMBER if plain_set.has_one_chamber else ()
            of_file = tuple(item for item in of_file if item.typed not in missing)
            owner = set_name
            replacing = of_file
        elif valve != in_file.get("valve"):
            owner = f"valve '{valve_name}'"
            replacing = tuple(item for item in of_file if item.typed.startswith(CHOSEN_VALVE))
        overridden = {override.typed for override in overrides}
        in_force = [item for item in replacing if item.typed not in overridden]
        listed = ", ".join(map(str, in_force))
        replaced = f"values of the scenario replace values of {owner}: {listed}" if in_force else ""
        set_of_file = with_overrides(plain_set, of_file, valve)
        if replaced:
            _warn_once(f"ppafo: {reading.file}: {replaced}")
    before = atmospheric_pressure(set_of_file) if overrides else None
    changed = with_overrides(set_of_file, overrides, valve)
    kept = "; ".join(filter(None, (replaced, reading.kept)))
    texts = tuple(item.words for item in reading.overrides)
    origin = Origin(reading.path, set_name, valve_name, texts, reading.content, kept, changed)
    return origin, links_of_set(changed, valve_name, overridden, before)


_warn_once = functools.lru_cache(maxsize=64)(logger.warning)


def read_device(reading: DocumentReader, origin: Origin, links: Graph) -> Device:
    """Return the device of a parameter set with its overrides; ParameterError for missing or contradictory values."""
    with refused_as(ParameterError, f"{reading.file}: [device]", ParameterError):
        assert origin.parameters is not None, "of a file"
        device = build_device(origin.parameters, origin.valve, links)
    written = chosen_units(_leaves([value_at(reading.document, part) for part in _PARTS_WITH_UNITS]))
    levels = [path for path in sorted(reading.overridden) if path.startswith(PATHS_THAT_SET_UNITS)]
    overridden = units_of_texts(value_at(reading.document, path) for path in levels)
    return replace(device, units={**device.units, **written, **overridden})


def _leaves(value: Any) -> list[Any]:
    """Return the values of nested tables and lists in order."""
    inner = list(value.values()) if isinstance(value, Mapping) else value
    return [leaf for item in inner for leaf in _leaves(item)] if isinstance(inner, list) else [value]


def build_scenario(reading: DocumentReader) -> Scenario:
    """Return the scenario of a document whose keys have been checked.

    Raises ScenarioError or ParameterError for the first value that cannot be used.
    """
    document = reading.document
    kind = kind_at(reading.document, "controller")
    law = CONTROLLERS[kind]
    origin, links = read_hardware(reading)
    device = read_device(reading, origin, links)
    # Refusals are in the units of the set.
    with shown_in(device.shown):
        wrong = Faults()
        with wrong:
            duration, step, output_interval, period = read_clock(reading)
        with wrong:
            of_sensors = reading.section("sensors", SENSORS)
        with wrong:
            controlled = controlled_in(document)
            if law.needs_reference and controlled not in law.controls:
                able = ", ".join(name for name, other in CONTROLLERS.items() if controlled in other.controls)
                follows = " or ".join(CONTROLLED[name].words for name in law.controls)
                remedy = f'give [reference] of = "{law.controls[0]}", or set controller.kind to one of {able}'
                # A reference that says nothing is of a torque, which a law of another quantity cannot follow.
                path = REFERENCE_OF if value_at(document, REFERENCE_OF) is not None else "controller.kind"
                follows = f"follows a reference of {follows}, not {controlled}; {remedy}"
                raise reading.refusal(path, f"the controller '{kind}' {follows}")
            reference, reference_links = _reference(reading, controlled, device.supply.atmospheric_pressure)
        with wrong:
            initial, initial_links = _initial(reading, device)
        wrong.raise_all()
        tolerance = reading.number("run.tolerance", ACCURACY)
        section = MOTIONS[kind_at(document, "motion")].section
        assert section is not None, "walks are built from another layout"
        motion = section.read(reading, reading.folder)
        supply_line = read_supply_line(reading)
        assumptions = read_assumptions(reading, origin)
        scenario = Scenario(
            name=document["name"],
            description=document.get("description", ""),
            device=device,
            run=RunSettings(duration, step, output_interval, tolerance),
            motion=motion,
            initial=initial,
            controller=Control(kind, {}, period),
            reference=reference,
            sensors=Sensors(**of_sensors, seed=int(reading.number("sensors.seed", SEED))),
            assumptions=(*assumptions, *assumed_lines(reading)),
            origin=origin,
            gas_model=read_gas_model(reading),
            supply_line=supply_line,
            links={**initial_links, **reference_links},
            controlled=controlled,
            beyond_reach=_purpose(reading, controlled),
        )
        scenario = with_settings(reading, scenario, law_settings(law, controlled))
        problem = reference_problem(scenario)
        if problem:
            raise ScenarioError(f"{reading.file}: {problem}")
        check_contradictions(scenario, reading)
        with refused_as(ParameterError, f"{reading.file}: [device]", ParameterError):
            if supply_line is not None:
                device.check_pressurised(f"a [{SUPPLY_LINE}] with its regulators")
            if law.needs_reference and law.controls == (TORQUE,):
                # These open the valve by their own idea of the device, where a command above 0 raises the torque.
                able = ", ".join(name for name, other in CONTROLLERS.items() if len(other.controls) > 1)
                device.check_pressurised(f"the controller '{kind}'", f"; set controller.kind to one of {able}")
            check_regulated(device, law, controlled)
            if law.plan is not None:
                device.check_torque_constant("a fixed-point controller")
        return scenario


def _purpose(reading: DocumentReader, controlled: str) -> str:
    """Return the reason for a reference beyond reach; "" without, or where an override changes the level it is for."""
    levels = CONTROLLED[controlled].level.unit, CONTROLLED[controlled].difference
    settings = reference_settings(kind_at(reading.document, "reference"), controlled)
    changed = {f"reference.{setting.name}" for setting in settings if setting.unit in levels} & reading.overridden
    is_kept = not changed or PURPOSE in reading.overridden
    return str(value_at(reading.document, PURPOSE) or "") if is_kept else ""


def check_regulated(device: Device, law: ControllerKind, controlled: str) -> None:
    """Raise ParameterError for a valve that regulates pressures under a law which has an idea of its flow of its own.

    An angle needs a law that asks for a torque: at a set pressure there is no gas spring that would hold a joint.
    """
    valve = device.valve.kind
    if VALVES[valve].regulation is None:
        return
    device.check_pressurised(f"a valve of kind '{valve}'")
    believes = law.plan is not None or any(item.name == "valve_conductance" for item in law.quantities)
    if law.needs_reference and (believes or (controlled == ANGLE and TORQUE in law.controls)):
        other = "cascade" if controlled == ANGLE else "pid"
        raise ParameterError(
            f"'{valve}' sets a pressure, '{law.name}' asks for a flow; set controller.kind to '{other}'"
        )


def _initial(reading: DocumentReader, device: Device) -> tuple[Initial, Graph]:
    """Return the initial chamber pressures [Pa absolute] and their links to the supply pressures that they follow.

    Each pressure is given as a number or as a word: a word stands for the supply pressure that it names, and a gauge
    pressure is relative to the atmosphere. For an actuator with one chamber, the second pressure is atmospheric.
    """
    supply = device.supply
    pressures: list[float] = []
    links: dict[str, tuple[Link, ...]] = {}
    for quantity in INITIAL:
        path = f"initial.{quantity.name}"
        value = value_at(reading.document, path)
        word = AT_REST if value is None else value
        if isinstance(word, str) and word.strip() in PRESSURE_WORDS:
            name = PRESSURE_WORDS[word.strip()]
            pressures.append(float(getattr(supply, name)))
            links[path] = (follows(f"supply.{name}"),)
            continue
        if isinstance(word, str) and not any(character.isdigit() for character in word):
            words = ", ".join(PRESSURE_WORDS)
            hint = nearest_name(word, PRESSURE_WORDS)
            raise reading.refusal(path, f"must be a pressure, for example '50 psi_g', or one of {words}{hint}")
        pressures.append(reading.number(path, quantity, supply.atmospheric_pressure))
        links[path] = gauge_link(path, *split_quantity(str(word)))
    if device.actuator.has_one_chamber and pressures[1] != supply.atmospheric_pressure:
        raise reading.refusal("initial.pressure_2", f"{WHY_ONE_CHAMBER}; omit this key, or write '{AT_REST}'")
    return Initial(*pressures), {path: links for path, links in links.items() if links}


def with_settings(reading: DocumentReader, scenario: Scenario, declared: tuple[Quantity, ...]) -> Scenario:
    """Return the scenario with the settings of its controller [SI], and links of those that follow other numbers."""
    links = default_links(
        scenario, (item for item in declared if value_at(reading.document, f"controller.{item.name}") is None)
    )
    settings = dict[str, float]()
    computed = dict[object, object]()

    def number(path: str) -> float:
        # A setting may follow one before it.
        return settings[path] if path in settings else number_at(scenario, path)

    for item in declared:
        path = f"controller.{item.name}"
        decided = replace(item, default=links[path][0].number(number, computed)) if path in links else item
        settings[path] = reading.number(path, decided)
    of_controller = {path.removeprefix("controller."): number for path, number in settings.items()}
    control = replace(scenario.controller, settings=of_controller)
    return replace(scenario, controller=control, links={**scenario.links, **links})


def _reference(reading: DocumentReader, controlled: str, atmosphere: float) -> tuple[ProfileChoice, Graph]:
    """Return the reference profile and the links of its levels to the atmospheric pressure [Pa absolute].

    Raises ScenarioError if the controller needs a reference and none is given.
    """
    if "reference" not in reading.document:
        law = kind_at(reading.document, "controller")
        if CONTROLLERS[law].needs_reference:
            raise ScenarioError(f"{reading.file}: 'reference' is missing: controller.kind = '{law}' follows one")
        return _NO_REFERENCE, {}
    kind = kind_at(reading.document, "reference")
    settings = reference_settings(kind, controlled)
    levels = [f"reference.{quantity.name}" for quantity in settings if quantity.unit == "Pa_a"]
    written = {path: value_at(reading.document, path) for path in levels}
    links = {path: gauge_link(path, *split_quantity(str(text))) for path, text in written.items() if text is not None}
    choice = read_profile(reading, "reference", settings, atmosphere)
    return choice, {path: follow for path, follow in links.items() if follow}


def read_gas_model(reading: DocumentReader) -> GasModel | None:
    """Return the heat exchange model of the gas in SI units; None for isothermal gas."""
    if kind_at(reading.document, "gas_model") != THERMAL:
        return None
    model = GasModel(**reading.section("gas_model", THERMAL_GAS))
    if model.heat_transfer_coefficient > 0.0 and value_at(reading.document, WALL_AREA) is None:
        raise ScenarioError(f"{reading.file}: '{WALL_AREA}' is missing: heat_transfer_coefficient is above 0")
    return model


def read_supply_line(reading: DocumentReader) -> SupplyLine | None:
    """Return the supply lines of a file in SI units; None without such a section, for constant supply pressures."""
    if value_at(reading.document, SUPPLY_LINE) is None:
        return None
    read = {line: reading.section(f"{SUPPLY_LINE}.{line}", line_quantities(line)) for line in SUPPLY_LINES}
    return SupplyLine(**{line: RegulatedLine(**numbers) for line, numbers in read.items()})


def read_assumptions(reading: DocumentReader, origin: Origin) -> tuple[Assumption, ...]:
    """Return all assumptions with a value; the note of an overridden assumption states the value in the file.

    Raises ScenarioError for a path without a value.
    """
    replaced = {override.typed for override in reading.overrides}
    as_written = replace(reading, document=reading.content)
    notes: Mapping[str, str] = reading.document.get(_ASSUMED, {})
    assumptions = []
    unknown = []
    for path, note in notes.items():
        value = _value_text(reading, origin, path)
        value_in_file = _value_text(as_written, origin, path)
        if value is None and value_in_file is None:
            unknown.append(path)
        if value is None:
            continue
        if path in replaced:
            file_value = value_in_file if value_at(as_written.document, path) is not None else "another value"
            assumptions.append(Assumption(path, value, f"set by an override; the scenario has {file_value}: {note}"))
        else:
            assumptions.append(Assumption(path, value, note))
    if unknown:
        known = [*OF_A_VANE.paths(reading.document), *device_paths()]
        hints = "".join(nearest_name(path, known) for path in unknown)
        names = ", ".join(f"'{one_line(path)}'" for path in unknown)
        has = "has" if len(unknown) == 1 else "have"
        raise ScenarioError(f"{reading.file}: [{_ASSUMED}] names {names}, which {has} no value in this scenario{hints}")
    return tuple(assumptions)


def _value_text(reading: DocumentReader, origin: Origin, path: str) -> str | None:
    """Return the value at a path as written in the file, else its default; None if there is neither."""
    written = value_at(reading.document, path)
    if written is not None and path in OF_A_VANE.paths(reading.document):
        return str(written)
    quantity = quantities(reading.document).get(path)
    if quantity is None:
        # A number that is not the scenario's is its device's, where the valve has a name.
        full = f"valves.{origin.valve}.{path.removeprefix('valve.')}" if path.startswith("valve.") else path
        assert origin.parameters is not None, "of a file"
        entry = origin.parameters.entries().get(full)
        if entry is not None:
            return entry_text(entry)
        if path == RELIEVING_PATH:
            return "false"
        quantity = origin.parameters.declarations().get(full)
    if quantity is not None and quantity.default is None and quantity.follows:
        return "the value computed from the device"
    return None if quantity is None or quantity.default is None else written_text(quantity.default, quantity.unit)


def assumed_lines(reading: DocumentReader) -> tuple[Assumption, ...]:
    """Return one assumption, with its reason, for each supply-line value that the file leaves at its default."""
    if value_at(reading.document, SUPPLY_LINE) is None:
        return ()
    return tuple(
        Assumption(f"{SUPPLY_LINE}.{path}", format_quantity(entry.value, entry.unit), f"{entry.origin}: {entry.source}")
        for path, entry in line_entries().items()
        if value_at(reading.document, f"{SUPPLY_LINE}.{path}") is None
    )
