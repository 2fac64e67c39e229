"""Settings of an exported scenario: every number by path, in SI units, and required relations between them."""

from collections.abc import Mapping
from dataclasses import replace

from ppafo.exports.c_library.library import ExportParameter, Relation, c_identifier
from ppafo.model.catalog import device_effects
from ppafo.model.declaration import Quantity
from ppafo.parameters.building import SUPPLIES, consistency
from ppafo.parameters.declaration import OF_SECOND_CHAMBER
from ppafo.parameters.declared import value_at
from ppafo.parameters.effects import effects_of
from ppafo.parameters.graph import ATMOSPHERE_PATH
from ppafo.simulation.clock import step_unless_given, step_with_output, time_texts
from ppafo.simulation.declaration import LOCKED_ANGLE
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


def settings_of(scenario: Scenario) -> tuple[ExportParameter, ...]:
    """Return every number of a scenario in SI units, by the path used in overrides."""
    # The file's step, from which the engine makes one that divides a sample.
    texts = time_texts(scenario)
    duration, period = scenario.run.duration, scenario.controller.period
    step, output = (value_at(texts, f"run.{name}") for name in ("step", "output_interval"))
    if step is not None:
        longest = parse_quantity(str(step), "s")
    elif output is None:
        longest = step_unless_given(duration, period)
    else:
        longest = step_with_output(duration, period, scenario.run.output_interval)
    times = {
        "run.duration": duration,
        "run.step": longest,
        "run.output_interval": scenario.run.output_interval,
        "controller.period": period,
    }
    return export_parameters(scenario, declared_settings(scenario), times)


def export_parameters(
    scenario: Scenario, declared: Mapping[str, Quantity], times: Mapping[str, float]
) -> tuple[ExportParameter, ...]:
    """Return declared numbers by path with their SI values: from ``times`` [s], else from the scenario."""
    return tuple(
        ExportParameter(
            c_identifier(path),
            path,
            replace(quantity, summary=_DESCRIPTIONS.get(path, quantity.summary)),
            times[path] if path in times else number_at(scenario, path),
        )
        for path, quantity in declared.items()
    )


def relations_of(scenario: Scenario) -> tuple[Relation, ...]:
    """Return the required relations between settings, as checked in a file."""
    rules: list[tuple[str, str, str, float]] = [
        *((path, relation, other, 0.0) for path, relation, other, _ in consistency(scenario.device)),
        ("run.step", "at most", "run.duration", 0.0),
        ("run.output_interval", "at most", "run.duration", 0.0),
        ("sensors.delay", "at most", "run.duration", 0.0),
    ]
    # A vane that stays at an angle, or starts there.
    start_angle = path_of_locked_angle(scenario) or LOCKED_ANGLE
    if start_angle in declared_settings(scenario):
        rules.append((start_angle, "at least", "actuator.angle_min", TOLERANCE))
        rules.append((start_angle, "at most", "actuator.angle_max", TOLERANCE))
    if scenario.supply_lines is not None:
        rules.append(("supply.dorsiflexion_pressure", "at most", "supply.pressure", 0.0))
    rules = [rule for rule in rules if c_identifier(rule[0]) not in second_chamber(scenario)]
    of_steps = (
        Relation("run_step", "at most", longer, TOLERANCE, is_share=True)
        for longer in ("controller_period", "run_output_interval")
    )
    return (
        *(
            Relation(
                c_identifier(path), relation, c_identifier(other), slack, unless=all_opposite(scenario, relation, other)
            )
            for path, relation, other, slack in rules
        ),
        *of_steps,
    )


def all_opposite(scenario: Scenario, relation: str, other: str) -> str:
    """C condition that every supply is on the opposite side of the atmosphere; empty for a relation to another number.

    Then another program runs, with suction or without; between the two, supplies contradict each other.
    """
    if other != ATMOSPHERE_PATH:
        return ""
    names = [name for name in map(c_identifier, SUPPLIES) if name not in second_chamber(scenario)]
    sign = "<=" if relation == "at least" else ">="
    return " && ".join(f"settings->{name} {sign} settings->{c_identifier(ATMOSPHERE_PATH)}" for name in names)


def second_chamber(scenario: Scenario) -> dict[str, str]:
    """Return substitutes for the numbers of a missing second chamber, as C text by name; empty if it exists.

    Pressures are atmospheric, so that no gas flows; all other numbers are constants.
    """
    return {
        c_identifier(path): c_identifier(ATMOSPHERE_PATH) if "pressure" in path else repr(number)
        for path, number in numbers_of_second_chamber(scenario).items()
    }


def numbers_of_second_chamber(scenario: Scenario) -> dict[str, float]:
    """Return substitutes [SI] for the numbers of a missing second chamber by path; empty if it exists."""
    if not scenario.device.actuator.has_one_chamber:
        return {}
    unused = {f"actuator.leak.{name}" for name in other_form(scenario.device, "actuator.leak")}
    return {path: number_at(scenario, path) for path in sorted(OF_SECOND_CHAMBER - unused)}


def declared_settings(scenario: Scenario) -> dict[str, Quantity]:
    """Return declarations by path, without unused orifice coefficients, inactive effects and alternative paths."""
    device = scenario.device
    unused = {"controller.rate"}
    unused |= {f"{section}.{name}" for section in ("valve", "actuator.leak") for name in other_form(device, section)}
    is_on = effects_of(device)
    unused |= {
        f"{effect.section}.{quantity.name}"
        for effect in device_effects()
        if effect not in is_on
        for quantity in effect.quantities
    }
    return {path: quantity for path, quantity in declared_numbers(scenario).items() if path not in unused}
