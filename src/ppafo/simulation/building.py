"""Building of a scenario from its document and overrides: device, motion, control and assumptions in SI units.

Each mistake in the document raises an error of one line.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ppafo.control.catalog import CONTROLLERS
from ppafo.errors import ParameterError, ScenarioError
from ppafo.model.controlled import CONTROLLED, TORQUE
from ppafo.parameters import ParameterSet, build_device, list_sets, load_parameter_set
from ppafo.parameters.declaration import RELIEVING_PATH
from ppafo.parameters.device import Device, Supply
from ppafo.parameters.graph import Graph, LinkedDefault, follows, gauge_link
from ppafo.parameters.overrides import (
    Override,
    check_valve,
    read_overrides,
    with_overrides,
)
from ppafo.parameters.parameter_set import (
    atmospheric_pressure,
    chosen_units,
    chosen_valve,
    entry_text,
    links_of_set,
    units_of_texts,
)
from ppafo.simulation.clock import MAXIMUM_STEPS_OF_DELAY, read_clock
from ppafo.simulation.declaration import (
    ACCURACY,
    AT_REST,
    INITIAL,
    LOCKED_ANGLE,
    OF_A_VANE,
    PRESSURE_WORDS,
    PURPOSE,
    SEED,
    SENSORS,
    SUPPLY_LINE,
    SUPPLY_LINES,
    THERMAL,
    THERMAL_GAS,
    WALL_AREA,
    changes_reach,
    controller_settings,
    line_entries,
    line_quantities,
    quantities,
    reference_settings,
)
from ppafo.simulation.default_gains import loop_terms
from ppafo.simulation.document import REFERENCE_OF, DocumentReader, controlled_in, kind_at, value_at
from ppafo.simulation.following import numbers_of_lines, numbers_of_sensors, read_followers
from ppafo.simulation.law_signals import LEG_PATHS, MOVED, PERIOD_PATH, seen_in_scenario
from ppafo.simulation.motion_kind import MOTIONS, RunTimes
from ppafo.simulation.nominal import nominal_terms
from ppafo.simulation.overrides import OverriddenDocument, device_paths, is_of_device
from ppafo.simulation.profiles import reference_problem
from ppafo.simulation.scenario import (
    Assumption,
    Control,
    GasModel,
    Initial,
    Motion,
    Origin,
    ProfileChoice,
    RegulatedLine,
    RunSettings,
    Scenario,
    Sensors,
    SupplyLine,
)
from ppafo.units import format_quantity, split_quantity
from ppafo.units.shown import shown_in, shown_text, written_text
from ppafo.wording import nearest_name, one_line

_SECTION = "assumed"
_SPEAKING = ("initial", "motion", "controller", "reference")
"""Sections whose quantities define the display units of their author, in increasing priority."""
_NOTHING_TO_FOLLOW = ProfileChoice("constant", {"level": 0.0})


@dataclass(frozen=True, slots=True)
class ScenarioRequest:
    """Request to build a scenario.

    ``file`` is the name of the scenario in messages, ``path`` the file, if there is one, ``folder`` the folder from
    which relative paths start, and ``content`` the document as given. ``parameter_set`` replaces the parameter set that
    the document names. ``instead`` maps a path in the document to the name of another file; relative names in
    ``instead`` start from the working folder.
    """

    file: str
    path: str | None
    folder: Path
    content: dict[str, Any]
    overrides: tuple[Override, ...]
    parameter_set: ParameterSet | None = None
    instead: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Hardware:
    """Parameter set with all overrides applied, name of its selected valve, and links between its numbers."""

    parameter_set: ParameterSet
    valve: str
    links: Graph


def build_scenario(request: ScenarioRequest, changed: OverriddenDocument) -> Scenario:
    """Return the scenario of a document whose keys have been checked.

    Raises ScenarioError or ParameterError for the first value that cannot be used.
    """
    document = changed.document
    reading = DocumentReader(request.file, document, changed.paths)
    hardware = read_hardware(reading, request, changed.device)
    device = read_device(reading, hardware)
    # Refusals are in the units of the set.
    with shown_in(device.shown):
        clock = read_clock(reading)
        section = MOTIONS[kind_at(document, "motion")].section
        assert section is not None, "walks are built from another layout"
        before = DocumentReader(request.file, request.content)
        run = RunSettings(
            clock.duration, clock.step, clock.output_interval, tolerance=reading.number("run.tolerance", ACCURACY)
        )
        motion = section.read(reading, device, clock.duration, clock.step, request.folder)
        initial, links = _initial(reading, device.supply)
        sensors = _sensors(reading, clock)
        lines = read_supply_line(reading, device)
        controlled = _controlled(reading)
        reference, of_reference = _reference(reading, controlled, device.supply.atmospheric_pressure)
        control, of_control = _control(reading, device, clock.period, sensors, lines, motion, reference)
        purpose = (
            ""
            if changes_reach(override.typed for override in request.overrides)
            else value_at(reading.document, PURPOSE)
        )
        scenario = Scenario(
            name=document["name"],
            description=document.get("description", ""),
            device=device,
            run=run,
            motion=motion,
            initial=initial,
            controller=control,
            reference=reference,
            sensors=sensors,
            assumptions=(*read_assumptions(before, reading, hardware, request.overrides), *assumed_lines(reading)),
            origin=origin_of(request, document, hardware.valve),
            gas_model=read_gas_model(reading),
            supply_line=lines,
            links={**links, **of_reference, **of_control},
            controlled=controlled,
            beyond_reach=str(purpose or ""),
        )
        problem = reference_problem(scenario)
        if problem:
            raise ScenarioError(f"{request.file}: {problem}")
        # Refuse what only a vane has.
        try:
            if lines is not None:
                device.check_pressurised(f"a [{SUPPLY_LINE}] with its regulators")
            law = CONTROLLERS[scenario.controller.kind]
            if law.needs_reference and law.controls == (TORQUE,):
                # These open the valve by their own idea of the device, where a command above 0 raises the torque.
                able = ", ".join(name for name, other in CONTROLLERS.items() if len(other.controls) > 1)
                device.check_pressurised(f"the controller '{scenario.controller.kind}'", f"; take one of {able}")
            if law.plan is not None:
                scenario.device.check_torque_constant("a fixed-point controller")
        except ParameterError as error:
            raise _of_device(reading, error) from error
        return scenario


def origin_of(request: ScenarioRequest, document: Mapping[str, Any], valve: str, named: Iterable[str] = ()) -> Origin:
    """Return the origin of a scenario; ``named`` are the overrides that correspond to ``request.instead``."""
    overrides = (*(override.words for override in request.overrides), *named)
    return Origin(request.path, document["device"]["set"], valve, overrides, request.content)


def read_hardware(reading: DocumentReader, request: ScenarioRequest, overrides: tuple[Override, ...]) -> Hardware:
    """Return the parameter set with the overrides of the file, then those of the caller."""
    section, in_file = reading.document["device"], request.content.get("device", {})
    valve = section.get("valve")
    try:
        of_file = read_overrides(section.get("overrides", ()))
        check_valve(of_file, in_file.get("valve"), f"device.valve = '{in_file.get('valve')}'")
        parameter_set = request.parameter_set or load_parameter_set(set_name(section["set"], request.folder))
        kinds = parameter_set.valve_kinds
        if valve is not None and valve not in kinds and not nearest_name(valve, kinds):
            # The scenario names the valve of another device.
            raise ParameterError(
                f"{parameter_set.file}: there is no valve '{valve}'; it has {', '.join(kinds)}: "
                f"--set device.valve={parameter_set.default_valve}"
            )
        name = chosen_valve(parameter_set, valve)
        parameter_set = with_overrides(parameter_set, of_file, valve)
    except ParameterError as error:
        raise _of_device(reading, error) from error
    before = atmospheric_pressure(parameter_set) if overrides else None
    changed = with_overrides(parameter_set, overrides, valve)
    return Hardware(changed, name, links_of_set(changed, {override.typed for override in overrides}, before))


def parameter_set_of(origin: Origin) -> ParameterSet:
    """Return the parameter set of a scenario's device, with the overrides of its file and then those of the caller.

    Raises ParameterError if the set can no longer be read.
    """
    folder = Path() if origin.file is None else Path(origin.file).parent
    of_file = read_overrides(origin.content.get("device", {}).get("overrides", ()))
    of_caller = [override for override in read_overrides(origin.overrides) if is_of_device(override.typed)]
    parameter_set = load_parameter_set(set_name(origin.parameter_set, folder))
    return with_overrides(with_overrides(parameter_set, of_file, origin.valve), of_caller, origin.valve)


def set_name(name: str, folder: Path) -> str:
    """Return the name of a shipped parameter set, or the path of a set file; relative paths start from ``folder``."""
    is_path = Path(name).suffix == ".toml" or "/" in name
    return str(folder / name) if is_path and name not in list_sets() else name


def read_device(reading: DocumentReader, hardware: Hardware) -> Device:
    """Return the device of a parameter set with its overrides; ParameterError for missing or contradictory values."""
    try:
        device = build_device(hardware.parameter_set, hardware.valve, hardware.links)
    except ParameterError as error:
        raise _of_device(reading, error) from error
    written = chosen_units(_texts([reading.document.get(section) for section in _SPEAKING]))
    overridden = units_of_texts(value_at(reading.document, path) for path in sorted(reading.overridden))
    return replace(device, units={**device.units, **written, **overridden})


def _texts(values: Iterable[Any]) -> Iterator[Any]:
    """Yield the values of nested tables and lists in order."""
    for value in values:
        if isinstance(value, Mapping | list):
            yield from _texts(value.values() if isinstance(value, Mapping) else value)
        else:
            yield value


def _of_device(reading: DocumentReader, error: ParameterError) -> ParameterError:
    """Return a ParameterError that names the scenario in which ``error`` was raised, on one line."""
    return ParameterError(f"{reading.file}: [device]: {one_line(error)}")


def _initial(reading: DocumentReader, supply: Supply) -> tuple[Initial, Graph]:
    """Return the initial chamber pressures [Pa absolute] and their links to the supply pressures that they follow.

    Each pressure is given as a number or as a word: a word stands for the supply pressure that it names, and a gauge
    pressure is relative to the atmosphere.
    """
    pressures: list[float] = []
    links: dict[str, tuple[LinkedDefault, ...]] = {}
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
            raise reading.refusal(path, f"is neither a pressure such as '50 psi_g' nor one of {words}{hint}")
        pressures.append(reading.number(path, quantity, supply.atmospheric_pressure))
        links[path] = gauge_link(path, *split_quantity(str(word)))
    return Initial(*pressures), {path: links for path, links in links.items() if links}


def _control(
    reading: DocumentReader,
    device: Device,
    period: float,
    sensors: Sensors,
    lines: SupplyLine | None,
    motion: Motion,
    reference: ProfileChoice,
) -> tuple[Control, Graph]:
    """Return the controller with its sample period [s], and the links of its settings [SI] to other numbers."""
    kind = kind_at(reading.document, "controller")
    controlled, leg = controlled_in(reading.document), getattr(motion, "leg", None)
    items = controller_settings(kind, controlled)
    if not any(quantity.follows for quantity in items):
        return Control(kind, reading.section("controller", items), period), {}
    rows = None if lines is None else lines.row(device.supply)
    is_locked = getattr(motion, "locked_angle", None) is not None and motion.motion_kind.name == "locked"
    profile = getattr(motion, "profile", None)
    moved = profile if isinstance(profile, ProfileChoice) and not is_locked else None
    seen = seen_in_scenario(controlled, leg is not None, is_locked, reference.kind, "" if moved is None else moved.kind)
    terms = nominal_terms(device, rows) | loop_terms(device, CONTROLLERS[kind], seen, controlled)
    of_sensors = {quantity.name: getattr(sensors, quantity.name) for quantity in SENSORS}
    present = numbers_of_sensors(of_sensors) | numbers_of_lines(rows) | {PERIOD_PATH: period}
    if is_locked:
        present |= {LOCKED_ANGLE: motion.locked_angle}
    if moved is not None:
        present |= {f"{MOVED}.{name}": number for name, number in moved.settings.items()}
    present |= {f"reference.{name}": number for name, number in reference.settings.items()}
    if leg is not None:
        present |= {path: getattr(leg, path.removeprefix("motion.")) for path in LEG_PATHS}
    followed, links = read_followers(reading, {"controller": items}, terms, device, present)
    return Control(kind, {path.partition(".")[2]: number for path, number in followed.items()}, period), links


def _controlled(reading: DocumentReader) -> str:
    """Return the controlled quantity of the reference; ScenarioError if the controller cannot follow this quantity."""
    controlled, kind = controlled_in(reading.document), kind_at(reading.document, "controller")
    law = CONTROLLERS[kind]
    if not law.needs_reference or controlled in law.controls:
        return controlled
    able = ", ".join(name for name, other in CONTROLLERS.items() if controlled in other.controls)
    follows = " or ".join(CONTROLLED[name].words for name in law.controls)
    remedy = f'give [reference] of = "{law.controls[0]}", or take one of {able}'
    # A reference that says nothing is of a torque, which a law of another quantity cannot follow.
    path = REFERENCE_OF if value_at(reading.document, REFERENCE_OF) is not None else "controller.kind"
    raise reading.refusal(
        path, f"the controller '{kind}' follows a reference of {follows}, not of {controlled}; {remedy}"
    )


def _reference(reading: DocumentReader, controlled: str, atmosphere: float) -> tuple[ProfileChoice, Graph]:
    """Return the reference profile and the links of its levels to the atmospheric pressure [Pa absolute].

    Raises ScenarioError if the controller needs a reference and none is given.
    """
    if "reference" not in reading.document:
        law = kind_at(reading.document, "controller")
        if CONTROLLERS[law].needs_reference:
            raise ScenarioError(
                f"{reading.file}: 'reference' is missing: controller.kind = '{law}' follows a reference; give "
                "[reference] with its kind and settings"
            )
        return _NOTHING_TO_FOLLOW, {}
    kind = kind_at(reading.document, "reference")
    settings = reference_settings(kind, controlled)
    levels = [f"reference.{quantity.name}" for quantity in settings if quantity.unit == "Pa_a"]
    written = {path: value_at(reading.document, path) for path in levels}
    links = {path: gauge_link(path, *split_quantity(str(text))) for path, text in written.items() if text is not None}
    choice = ProfileChoice(kind, reading.section("reference", settings, atmosphere))
    return choice, {path: follow for path, follow in links.items() if follow}


def _sensors(reading: DocumentReader, clock: RunTimes) -> Sensors:
    values: dict[str, Any] = reading.section("sensors", SENSORS)
    if values["delay"] > clock.duration:
        raise reading.refusal("sensors.delay", "must not be longer than run.duration: nothing would ever be measured")
    if values["delay"] / clock.step > MAXIMUM_STEPS_OF_DELAY:
        longest = shown_text(MAXIMUM_STEPS_OF_DELAY * clock.step, "s")
        raise reading.refusal("sensors.delay", f"must be at most {longest}, {MAXIMUM_STEPS_OF_DELAY:.0e} steps")
    return Sensors(**values, seed=int(reading.number("sensors.seed", SEED)))


def read_assumptions(
    before: DocumentReader, reading: DocumentReader, hardware: Hardware, overrides: Iterable[Override]
) -> tuple[Assumption, ...]:
    """Return all assumptions with a value; the note of an overridden assumption states the value in ``before``.

    Raises ScenarioError for a path without a value.
    """
    replaced = {override.typed for override in overrides}
    notes: Mapping[str, str] = reading.document.get(_SECTION, {})
    assumptions = []
    for path, note in notes.items():
        value, earlier = _value(reading, hardware, path), _value(before, hardware, path)
        if value is None and earlier is None:
            hint = nearest_name(path, [*OF_A_VANE.paths(reading.document), *device_paths()])
            raise ScenarioError(
                f"{reading.file}: [{_SECTION}] names '{one_line(path)}', which has no value in this scenario{hint}"
            )
        if value is not None:
            was = earlier if value_at(before.document, path) is not None else "another value"
            said = f"set by an override; the scenario has {was}: {note}" if path in replaced else note
            assumptions.append(Assumption(path, value, said))
    return tuple(assumptions)


def _value(reading: DocumentReader, hardware: Hardware, path: str) -> str | None:
    """Return the value at a path as written in the file, else its default; None if there is neither."""
    written = value_at(reading.document, path)
    if written is not None and path in OF_A_VANE.paths(reading.document):
        return str(written)
    quantity = quantities(reading.document).get(path)
    if quantity is None:
        # What is not of the scenario is of its device, where the valve has a name.
        full = f"valves.{hardware.valve}.{path.removeprefix('valve.')}" if path.startswith("valve.") else path
        entry = hardware.parameter_set.entries().get(full)
        if entry is not None:
            return entry_text(entry)
        if path == RELIEVING_PATH:
            return "false"
        quantity = hardware.parameter_set.declarations().get(full)
    if quantity is not None and quantity.default is None and quantity.follows:
        return "what follows from the device"
    return None if quantity is None or quantity.default is None else written_text(quantity.default, quantity.unit)


def read_gas_model(reading: DocumentReader) -> GasModel | None:
    """Return the heat exchange model of the gas in SI units; None for isothermal gas."""
    if kind_at(reading.document, "gas_model") != THERMAL:
        return None
    model = GasModel(**reading.section("gas_model", THERMAL_GAS))
    if model.heat_transfer_coefficient > 0.0 and value_at(reading.document, WALL_AREA) is None:
        raise ScenarioError(
            f"{reading.file}: '{WALL_AREA}' is missing: gas takes up heat where heat_transfer_coefficient is above 0"
        )
    return model


def read_supply_line(reading: DocumentReader, device: Device) -> SupplyLine | None:
    """Return the supply lines of a file in SI units; None without such a section, for constant supply pressures.

    Raises ScenarioError if the dorsiflexion pressure exceeds the pressure of the line that feeds its regulator.
    """
    if value_at(reading.document, SUPPLY_LINE) is None:
        return None
    supply = device.supply
    if supply.dorsiflexion_pressure > supply.pressure:
        first, second = (
            shown_text(pressure, "Pa_a", atmosphere=supply.atmospheric_pressure)
            for pressure in (supply.pressure, supply.dorsiflexion_pressure)
        )
        raise ScenarioError(
            f"{reading.file}: [{SUPPLY_LINE}]: its second regulator is fed by the first, so "
            f"supply.dorsiflexion_pressure, {second}, cannot be above supply.pressure, {first}"
        )
    read = {line: reading.section(f"{SUPPLY_LINE}.{line}", line_quantities(line)) for line in SUPPLY_LINES}
    return SupplyLine(**{line: RegulatedLine(**numbers) for line, numbers in read.items()})


def assumed_lines(reading: DocumentReader) -> tuple[Assumption, ...]:
    """Return an assumption for each supply-line value that the file leaves at its default, with the reason."""
    if value_at(reading.document, SUPPLY_LINE) is None:
        return ()
    return tuple(
        Assumption(f"{SUPPLY_LINE}.{path}", format_quantity(entry.value, entry.unit), f"{entry.origin}: {entry.source}")
        for path, entry in line_entries().items()
        if value_at(reading.document, f"{SUPPLY_LINE}.{path}") is None
    )
