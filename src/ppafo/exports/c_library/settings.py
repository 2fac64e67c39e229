"""Settings of an exported scenario: every number by path, in SI units, and required relations between them."""

import itertools
import sys
from collections.abc import Collection, Iterable
from dataclasses import replace

from ppafo.exports.c_library.library import Condition, ExportParameter, Relation, c_identifier
from ppafo.model.catalog import VALVES, device_effects
from ppafo.model.declaration import Quantity
from ppafo.parameters.actuator_table import measured_pressures
from ppafo.parameters.building import COVERED_PRESSURE, SAME_STOP, SUPPLIES, consistency
from ppafo.parameters.declaration import OF_SECOND_CHAMBER
from ppafo.parameters.declared import value_at
from ppafo.parameters.device import Device
from ppafo.parameters.effects import effects_of
from ppafo.parameters.graph import ATMOSPHERE_PATH, PRESSURE_PATH, SECOND_PRESSURE_PATH
from ppafo.simulation.clock import links_of_times, time_texts
from ppafo.simulation.declaration import LOCKED_ANGLE, RUN
from ppafo.simulation.numbers import declared_numbers, number_at, other_form, path_of_locked_angle
from ppafo.simulation.profiles import TOLERANCE
from ppafo.simulation.scenario import Scenario
from ppafo.units import parse_quantity

_DESCRIPTIONS = {
    "run.step": "longest step of the engine",
    "run.output_interval": "time from one sample to the next",
    "controller.period": "time between two decisions of the controller",
}
"""Descriptions of settings that differ from those in a file."""
RULES_OF_TIMES: tuple[Condition, ...] = (
    ("is_whole(settings->run_duration / settings->run_output_interval)", "run_output_interval"),
    ("settings->run_duration / settings->run_step <= 1.0e8", "run_duration"),
    ("settings->run_duration / settings->run_output_interval <= 5.0e6", "run_duration"),
    ("settings->sensors_delay / settings->run_step <= 1.0e5", "sensors_delay"),
)
"""Rules of the times of a scenario (``simulation/clock.py``)."""


def limits_in_c(quantity: Quantity) -> tuple[float, float]:
    """Lowest and highest value of a setting, as representable by C literals."""
    # C can write no infinity as a literal; no setting is that large.
    return max(quantity.minimum, -sys.float_info.max), min(quantity.maximum, sys.float_info.max)


def choosing(device: Device) -> list[str]:
    """Settings of the valve for which zero or nonzero selects its functions."""
    kind = VALVES[device.valve.kind]
    names = [quantity.name for quantity in kind.quantities]
    chosen = {}
    # A valve may look only at which settings are 0, so both cases of each tell what chooses.
    for pattern in itertools.product((0.0, 0.01), repeat=len(names)):
        # The model and whether it has a dead time: both decide which program is composed.
        settings = kind.settings(*pattern)
        model = kind.choose(settings)
        chosen[pattern] = model, model.command_delay(settings) > 0.0
    return [
        name
        for index, name in enumerate(names)
        if any(chosen[pattern] != chosen[*pattern[:index], 0.0, *pattern[index + 1 :]] for pattern in chosen)
    ]


def settings_of(scenario: Scenario, recorded: float | None) -> tuple[ExportParameter, ...]:
    """Return every number of a scenario in SI units, by the path used in overrides.

    ``recorded`` is the output interval [s] of a walk, which follows from its duration; else the scenario has its own.
    """
    run = scenario.run
    device = scenario.device
    period = scenario.controller.period
    # Without unused coefficients of an orifice, effects that are off, and other spellings of a number.
    unused = {"controller.rate"}
    unused |= {f"{section}.{name}" for section in ("valve", "actuator.leak") for name in other_form(device, section)}
    is_off = (effect for effect in device_effects() if effect not in effects_of(device))
    unused |= {f"{effect.section}.{quantity.name}" for effect in is_off for quantity in effect.quantities}
    declared = {path: quantity for path, quantity in declared_numbers(scenario).items() if path not in unused}
    times = {"run.duration": run.duration, "run.step": run.step, "controller.period": period}
    times["run.output_interval"] = run.output_interval if recorded is None else recorded
    if recorded is None:
        # The step of the file, from which the engine makes one that divides a sample.
        texts = time_texts(scenario)
        links = links_of_times(texts)
        step = value_at(texts, "run.step")
        follows = links["run.step"][0].number(times.__getitem__) if step is None else parse_quantity(str(step), "s")
        times["run.step"] = follows
    else:
        # A library may walk longer than a file; its step is that of a walk. No file has the command of a plant alone.
        declared |= {f"run.{quantity.name}": quantity for quantity in RUN if quantity.name != "step"}
        law = scenario.motion.motion_kind.law(scenario)
        declared |= {f"controller.{quantity.name}": quantity for quantity in law.quantities}
    return tuple(
        ExportParameter(
            c_identifier(path),
            path,
            replace(quantity, summary=_DESCRIPTIONS.get(path, quantity.summary)),
            times[path] if path in times else number_at(scenario, path),
        )
        for path, quantity in declared.items()
    )


def relations_of(
    scenario: Scenario, settings: Iterable[ExportParameter], further: Iterable[Relation]
) -> tuple[Relation, ...]:
    """Return the required relations between settings, as checked in a file: of the device, and ``further`` ones."""
    known = {setting.path for setting in settings}
    relations = [
        Relation(path, relation, other, unless=all_opposite(relation, known) if other == ATMOSPHERE_PATH else "")
        for path, relation, other in consistency(scenario.device)
    ]
    if scenario.supply_lines is not None:
        relations.append(Relation(SECOND_PRESSURE_PATH, "at most", PRESSURE_PATH))
    return tuple(one for one in (*relations, *further) if one.path in known and one.other in known)


def relations_of_vane(scenario: Scenario) -> tuple[Relation, ...]:
    """Return the relations of the file of a vane alone: of its times, and of the angle where it stays or starts."""
    angle = path_of_locked_angle(scenario) or LOCKED_ANGLE
    return (
        *(Relation(path, "at most", "run.duration") for path in ("run.step", "run.output_interval", "sensors.delay")),
        Relation(angle, "at least", "actuator.angle_min", TOLERANCE),
        Relation(angle, "at most", "actuator.angle_max", TOLERANCE),
        *(
            Relation("run.step", "at most", longer, TOLERANCE, is_share=True)
            for longer in ("controller.period", "run.output_interval")
        ),
    )


def rules_of_table(scenario: Scenario, settings: Iterable[ExportParameter]) -> tuple[Condition, ...]:
    """Return the rules of a measured volume table, which must cover the stops and the supplies; empty without one."""
    table = scenario.device.actuator.table
    supply = scenario.device.supply
    if table is None:
        return ()
    lowest, highest = (COVERED_PRESSURE * pressure for pressure in measured_pressures(table))
    within = f">= {lowest!r}" if supply.is_vacuum else f"<= {highest!r}"
    low = "actuator_angle_min"
    high = "actuator_angle_max"
    known = {setting.path for setting in settings}
    return (
        (f"{table.first_angle!r} <= settings->{low} + {SAME_STOP!r}", low),
        (f"settings->{high} <= {table.last_angle + SAME_STOP!r}", high),
        *(
            (f"settings->{name} - settings->{c_identifier(ATMOSPHERE_PATH)} {within}", name)
            for name in map(c_identifier, (path for path in SUPPLIES if path in known))
        ),
    )


def all_opposite(relation: str, known: Collection[str]) -> str:
    """C condition that every supply is on the opposite side of the atmosphere.

    Then another program runs, with suction or without; between the two, supplies contradict each other.
    """
    sign = "<=" if relation == "at least" else ">="
    room = c_identifier(ATMOSPHERE_PATH)
    names = [c_identifier(path) for path in SUPPLIES if path in known]
    return " && ".join(f"settings->{name} {sign} settings->{room}" for name in names)


def numbers_of_second_chamber(scenario: Scenario) -> dict[str, float]:
    """Return substitutes [SI] for the numbers of a missing second chamber by path; empty if it exists.

    In C its pressures are atmospheric, so that no gas flows; all other numbers are constants.
    """
    if not scenario.device.actuator.has_one_chamber:
        return {}
    unused = {f"actuator.leak.{name}" for name in other_form(scenario.device, "actuator.leak")}
    return {path: number_at(scenario, path) for path in sorted(OF_SECOND_CHAMBER - unused)}
