"""Construction of a device in SI units from a complete and consistent parameter set."""

import itertools
import math
import operator
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, replace
from functools import partial
from typing import Any

import numpy as np

from ppafo.errors import ParameterError
from ppafo.model.actuators.kind import Range
from ppafo.model.catalog import ACTUATORS, EFFECTS, VALVES
from ppafo.model.columns import Problem, at, first, larger, smaller
from ppafo.model.declaration import Quantity
from ppafo.model.effects.kind import SECTION
from ppafo.model.gas import SPECIES
from ppafo.parameters import declaration
from ppafo.parameters.device import (
    VANE,
    Actuator,
    Device,
    Flow,
    FootPlate,
    Friction,
    Gas,
    Orifice,
    SonicOrifice,
    Supply,
    Valve,
)
from ppafo.parameters.effects import number_under
from ppafo.parameters.graph import ATMOSPHERE_PATH, DISPLACEMENT_PATH, PRESSURE_PATH, SECOND_PRESSURE_PATH, Graph
from ppafo.parameters.natural_laws import broken_laws
from ppafo.parameters.overrides import FORMS, either, in_two_forms
from ppafo.parameters.parameter_set import (
    ParameterSet,
    allowed_number,
    atmospheric_pressure,
    chosen_valve,
    entry_text,
    links_of_set,
    with_followers,
)
from ppafo.parameters.plant import shape_and_growth
from ppafo.units.shown import counted_from, shown_in, shown_text
from ppafo.wording import check_known, one_line

SAME_STOP = 1.0e-9
"""Angle difference [rad] below which two angles count as the same."""
COVERED_PRESSURE = 1.01
"""Largest ratio of supply pressure to the highest pressure of a volume table [-]."""
_UNUSED_VOLUME = 1.0e-6
"""Constant volume [m^3] of chamber 2 for an actuator with one chamber; no gas flows into it."""
_NO_LEAK = Orifice(area=0.0, discharge_coefficient=1.0)
SUPPLIES = PRESSURE_PATH, SECOND_PRESSURE_PATH
RELATIONS = {"below": operator.lt, "above": operator.gt, "at most": operator.le, "at least": operator.ge}
"""Relation of a number to another one, elementwise over runs, by its words."""


def build_device(parameter_set: ParameterSet, valve: str | None = None, links: Graph | None = None) -> Device:
    """Return the device in SI units with one of the set's valves (default: the set's default valve).

    ``links`` replaces the links of the set, if given.
    """
    name = chosen_valve(parameter_set, valve)
    links = links_of_set(parameter_set, name) if links is None else links
    parameter_set = with_followers(parameter_set)
    device = read_device(parameter_set, name, links)
    for _, line in contradictions_of_set(parameter_set, device):
        raise ParameterError(f"{parameter_set.file}: {line}")
    if device.actuator.kind != VANE:
        # An actuator of another kind has what a vane of its mean size would have, for whatever is made for a vane.
        growth = shape_and_growth(device)[1]
        sizes = {"torque_constant": growth, "displacement_per_radian": growth}
        device = replace(device, actuator=replace(device.actuator, **sizes))
    for line in broken_laws(device):
        raise ParameterError(f"{parameter_set.file}: {line}")
    return device


def read_device(parameter_set: ParameterSet, name: str, links: Graph) -> Device:
    """Return the device in SI units with a valve of the set, without a check for contradictions."""
    missing = missing_values(parameter_set, name)
    if missing:
        completed = parameter_set.completed_by
        remedy = f"use the completed set '{completed}'" if completed else "add them to the file or as overrides"
        raise ParameterError(f"{parameter_set.file}: the device lacks {', '.join(missing)}; {remedy}")
    species = str(parameter_set.texts[declaration.SPECIES_PATH].value)
    check_known(
        species, SPECIES, ParameterError, f"{parameter_set.file}: gas.species = '{one_line(species)}' is unknown"
    )
    named = {path.split(".")[1] for path in parameter_set.numbers if path.startswith(f"{SECTION}.")}
    of_effects = {EFFECTS[effect].section: EFFECTS[effect].quantities for effect in sorted(named)}
    atmosphere = atmospheric_pressure(parameter_set)
    declared = parameter_set.declarations()
    sections: dict[str, dict[str, float]] = {}
    for section, quantities in (needed_quantities(parameter_set, name) | of_effects).items():
        sections[section] = {}
        for quantity in quantities:
            path = f"{section}.{quantity.name}"
            entry = parameter_set.numbers.get(path)
            number = quantity.default or 0.0
            if entry is not None:
                written = f"{parameter_set.file}: {path} = {entry_text(entry)}"
                number = allowed_number(written, entry, declared[path], atmosphere)
            sections[section][quantity.name] = number
    relieving = parameter_set.texts.get(declaration.RELIEVING_PATH)
    has_one_chamber = parameter_set.has_one_chamber
    if has_one_chamber:
        # The port of the second chamber is at the atmosphere and passes nothing.
        sections["supply"]["dorsiflexion_pressure"] = sections["supply"]["atmospheric_pressure"]
    moves = ACTUATORS[parameter_set.actuator_kind]
    kind = parameter_set.valve_kinds[name]
    sizes = sections["actuator"]
    return Device(
        name=parameter_set.name,
        gas=Gas(species, **sections["gas"]),
        actuator=Actuator(
            torque_constant=sizes.get("torque_constant", 0.0),
            displacement_per_radian=sizes.get("displacement_per_radian", 0.0),
            angle_min=sizes["angle_min"],
            angle_max=sizes["angle_max"],
            dead_volume_1=sizes["dead_volume_1"],
            dead_volume_2=_UNUSED_VOLUME if has_one_chamber else sizes["dead_volume_2"],
            restitution=sizes["restitution"],
            leak=_NO_LEAK if has_one_chamber else _orifice(sections["actuator.leak"]),
            kind=parameter_set.actuator_kind,
            settings={} if moves.name == VANE else {setting.name: sizes[setting.name] for setting in moves.quantities},
            table=parameter_set.actuator_table,
        ),
        friction=Friction(**sections["friction"]),
        foot_plate=FootPlate(**sections["foot_plate"]),
        supply=Supply(**sections["supply"], relieving=relieving is not None and relieving.value is True),
        valve=Valve(
            kind=kind,
            settings={quantity.name: sections[f"valves.{name}"][quantity.name] for quantity in VALVES[kind].quantities},
            orifice=_orifice(sections[f"valves.{name}"]),
        ),
        flow=Flow(**sections["flow"]),
        valve_name=name,
        joint=parameter_set.joint,
        effects={effect: sections[EFFECTS[effect].section] for effect in sorted(named)},
        links=links,
        units=parameter_set.shown,
    )


def _orifice(numbers: Mapping[str, float]) -> Orifice | SonicOrifice:
    form = SonicOrifice if "sonic_conductance" in numbers else Orifice
    return form(**{item.name: numbers[item.name] for item in fields(form)})


def contradictions_of_set(parameter_set: ParameterSet, device: Device) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield contradictions between the values of a set that prevent a run: their paths, and a message."""
    for paths, (is_bad, line) in contradictions(device, parameter_set):
        if is_bad:
            yield paths, line(0)
    if device.supply.is_vacuum and declaration.RELIEVING_PATH in parameter_set.texts and not device.supply.relieving:
        yield (
            (declaration.RELIEVING_PATH, *SUPPLIES),
            f"{declaration.RELIEVING_PATH} = false: a supply below atmospheric pressure takes gas from the chambers; "
            f"set {declaration.RELIEVING_PATH} to true or omit the key",
        )
    valves = [name for name, kind in parameter_set.valve_kinds.items() if kind == "proportional"]
    if "opening" in device.effects and len(valves) > 1:
        # The table acts on the valve that is chosen: of two it would be of both.
        yield (
            (f"{SECTION}.opening",),
            f"{SECTION}.opening: a set with a table has one proportional valve, not {' and '.join(valves)}",
        )


def contradictions(device: Device, stated: ParameterSet | None = None) -> Iterator[tuple[tuple[str, ...], Problem]]:
    """Yield what numbers of a device may contradict, elementwise over runs: their paths, and the problem.

    Numbers are shown as the set that ``stated`` them has them. Later problems rely on earlier ones.
    """
    actuator = device.actuator
    stops = ("actuator.angle_min", "actuator.angle_max")
    for path, relation, other in consistency(device):
        own = tuple(re.sub("^valve[.]", f"valves.{device.valve_name}.", name) for name in (path, other))
        pair = [number_under(device, name.split(".")) for name in (path, other)]
        paths = (path, other) if stated is None else own
        said = partial(
            _rule_line, device, stated, own[0], pair, f"{paths[0]} = {{}} must be {relation} {paths[1]} = {{}}"
        )
        yield own, (np.logical_not(RELATIONS[relation](*pair)), said)
    is_misshapen: Any = True
    if np.all(actuator.angle_min < actuator.angle_max):
        is_misshapen, line = _shape_problem(actuator)
        settings = (f"actuator.{quantity.name}" for quantity in ACTUATORS[actuator.kind].quantities)
        yield ("actuator", *settings, *stops), (is_misshapen, line)
    yield SUPPLIES, _beyond_pressures(device)
    if not np.any(is_misshapen):
        # The growth of a vane is a number of its set, which is above 0.
        growth = actuator.displacement_per_radian if actuator.kind == VANE else shape_and_growth(device)[1]
        text = "actuator: chamber 1 must grow with the angle, but changes by {:.4g} m^3/rad at supply pressure"
        yield ("actuator", *stops), (np.logical_not(growth > 0.0), lambda run: text.format(at(growth, run)))


def _rule_line(device: Device, stated: ParameterSet | None, path: str, pair: Sequence[Any], rule: str, run: int) -> str:
    """Return the ``rule`` that two numbers break, with both; in the unit of the first, at ``path``, if a set states it.

    A gauge pressure beside an absolute one would have to be converted.
    """
    unit = declaration.quantities({device.valve_name: device.valve.kind}, device.actuator.kind)[path].unit
    room = at(device.supply.atmospheric_pressure, run)
    number, limit = (at(each, run) for each in pair)
    if stated is None:
        return rule.format(*(shown_text(each, unit, ".9g", room) for each in (number, limit)))
    entry = stated.numbers[path]
    given = entry.unit if declaration.fits(entry.unit, unit) else ""
    why = "; both supplies must be on the same side of atmospheric pressure" if path in SUPPLIES else ""
    return rule.format(entry_text(entry), shown_text(limit, unit, atmosphere=room, unit=given)) + why


def _shape_problem(actuator: Actuator) -> Problem:
    """Return the problem of actuator numbers that contradict each other although each is in range."""
    kind = ACTUATORS[actuator.kind]
    table = actuator.table
    if kind.problem is None and table is None:
        return False, str
    numbers = {**{name: getattr(actuator, name) for name in Range._fields}, **actuator.settings}
    varied = [value for value in numbers.values() if isinstance(value, np.ndarray)]

    def problem_of(run: int) -> str:
        single = {name: at(value, run) for name, value in numbers.items()}
        stops = Range(**{name: single.pop(name) for name in Range._fields})
        problem = (
            "" if kind.problem is None else kind.problem(replace(actuator, **stops._asdict(), settings=single), stops)
        )
        low = stops.angle_min + SAME_STOP
        high = stops.angle_max - SAME_STOP
        if not problem and table is not None and not (table.first_angle <= low and high <= table.last_angle):
            measured, wanted = (
                f"{math.degrees(first):.4g} to {math.degrees(last):.4g} deg"
                for first, last in ((table.first_angle, table.last_angle), (stops.angle_min, stops.angle_max))
            )
            problem = f"the volume table covers {measured}, but the stops are at {wanted}"
        return f"actuator: {problem}" if problem else ""

    # A kind checks single numbers, so the runs are gone through one by one.
    problems = [problem_of(run) for run in range(varied[0].size if varied else 1)]
    return (np.array([bool(line) for line in problems]) if varied else bool(problems[0])), problems.__getitem__


def _beyond_pressures(device: Device) -> Problem:
    """Return the problem of a supply outside the measured pressures of a volume table; elementwise over runs."""
    table = device.actuator.table
    supply = device.supply
    if table is None:
        lowest = -math.inf
        highest = math.inf
    else:
        from ppafo.parameters.actuator_table import measured_pressures

        lowest, highest = measured_pressures(table)
    if supply.is_vacuum:
        gauge = smaller(supply.pressure, supply.dorsiflexion_pressure) - supply.atmospheric_pressure
        is_beyond = gauge < COVERED_PRESSURE * lowest
        way = "down"
        end = lowest
    else:
        gauge = larger(supply.pressure, supply.dorsiflexion_pressure) - supply.atmospheric_pressure
        is_beyond = gauge > COVERED_PRESSURE * highest
        way = "up"
        end = highest

    def line(run: int) -> str:
        atmosphere = at(supply.atmospheric_pressure, run)
        with shown_in(counted_from(device.units, atmosphere)):
            covered, has = (shown_text(atmosphere + each, "Pa_a", ".4g") for each in (end, at(gauge, run)))
        return f"actuator: the volume table covers pressures {way} to {covered}, but the supply has {has}"

    return is_beyond, line


def both_forms(parameter_set: ParameterSet, section: str) -> tuple[str, ...]:
    """Return the names of orifice numbers that mix both forms; empty if they use one form or none."""
    paths = [f"{section}.{name}" for form in FORMS["valve"] for name in sorted(form)]
    stated = [path for path in paths if path in parameter_set.numbers]
    return tuple(path.rpartition(".")[2] for path in stated) if in_two_forms(stated) else ()


def orifice_form(parameter_set: ParameterSet, section: str) -> tuple[Quantity, ...]:
    """Return the quantities of the form of an orifice. Raises ParameterError for an orifice in both forms."""
    both = both_forms(parameter_set, section)
    if both:
        wanted = either(f"{section}.{both[0]}")
        raise ParameterError(f"{parameter_set.file}: {section} has {', '.join(both)}; {wanted}")
    is_sonic = any(f"{section}.{quantity.name}" in parameter_set.numbers for quantity in declaration.SONIC_FORM)
    return declaration.SONIC_FORM if is_sonic else declaration.AREA_FORM


def needed_quantities(parameter_set: ParameterSet, valve: str) -> dict[str, tuple[Quantity, ...]]:
    """Return the quantities of a device with this valve by section, without those of a chamber 2 that it lacks."""
    sections = {name: declaration.members(name, parameter_set.actuator_kind) for name in declaration.FLAT_SECTIONS}
    if parameter_set.has_one_chamber:
        absent = declaration.OF_SECOND_CHAMBER
        sections = {
            name: tuple(member for member in members if f"{name}.{member.name}" not in absent)
            for name, members in sections.items()
        }
    else:
        sections["actuator.leak"] = orifice_form(parameter_set, "actuator.leak")
    form = orifice_form(parameter_set, f"valves.{valve}")
    kind = parameter_set.valve_kinds[valve]
    return sections | {f"valves.{valve}": form + VALVES[kind].quantities}


def missing_values(parameter_set: ParameterSet, valve: str) -> list[str]:
    """Return the paths of values that a device with this valve needs and the set lacks."""
    # Without numbers of their own, chamber 2 has the pressure of chamber 1, and a vane displaces its torque constant.
    known = (*parameter_set.numbers, *parameter_set.texts, SECOND_PRESSURE_PATH, DISPLACEMENT_PATH)
    needed = [
        f"{section}.{member.name}"
        for section, members in needed_quantities(parameter_set, valve).items()
        for member in members
        if member.default is None
    ]
    return [path for path in (*needed, declaration.SPECIES_PATH) if path not in known]


def consistency(device: Device) -> Iterator[tuple[str, str, str]]:
    """Yield the rules between two numbers of a device: path, one of ``RELATIONS``, and path of the other number."""
    yield "actuator.angle_min", "below", "actuator.angle_max"
    yield "friction.dynamic_torque", "at most", "friction.static_torque"
    # Of two supplies on either side of the atmosphere both would turn the joint one way.
    supply = device.supply
    room = first(device.supply.atmospheric_pressure)
    is_suction = supply.is_vacuum and max(first(supply.pressure), first(supply.dorsiflexion_pressure)) <= room
    for path in SUPPLIES:
        yield path, "at most" if is_suction else "at least", ATMOSPHERE_PATH
    if "highest_pressure" in device.valve.settings:
        yield "valve.lowest_pressure", "below", "valve.highest_pressure"
        yield "valve.lowest_pressure", "at least", ATMOSPHERE_PATH
    # Of a table of openings commands rise, and openings do not fall.
    table = device.effects.get("opening", {})
    path = f"{SECTION}.opening"
    used = [name[-2:] for name, command in table.items() if name.startswith("command") and first(command) > 0.0]
    for before, after in itertools.pairwise(used):
        yield f"{path}.command_{before}", "below", f"{path}.command_{after}"
        yield f"{path}.opening_{before}", "at most", f"{path}.opening_{after}"
