"""From the settings of a scenario to the numbers of a run: one composed function, which calls those of the planning."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.engine.program import Program
from ppafo.engine.replay import RECORDED_ANGLE, Segment
from ppafo.engine.run import sensors_at_start
from ppafo.engine.source_text import Collector
from ppafo.exports.c_library.files import Relation, Setting, c_identifier
from ppafo.exports.c_library.writing import Writing
from ppafo.model.declaration import Quantity
from ppafo.model.effects.catalog import ordered_effects
from ppafo.parameters.building import consistency
from ppafo.parameters.device import Device
from ppafo.parameters.effects import effects_of
from ppafo.parameters.graph import Graph
from ppafo.simulation.clock import links_of_times, step_unless_given, step_with_output
from ppafo.simulation.declaration import value_at
from ppafo.simulation.ensemble.columns import time_texts
from ppafo.simulation.motion import TOLERANCE
from ppafo.simulation.numbers import HELD_ANGLE, TIMES, declared_numbers, links_that_hold, number_at, other_form
from ppafo.simulation.preparation import is_slow_held, rates_of_sensors, state_at_start, state_with_volumes, step_counts
from ppafo.simulation.scenario import FreeMotion, PrescribedMotion, Scenario
from ppafo.units import parse_quantity

SAID = {
    "run.step": "longest step of the engine",
    "run.output_interval": "time from one sample to the next",
    "controller.period": "time between two decisions of the controller",
}
"""What some settings are where no file stands around them."""
_LEVEL_OF_HELD = "motion.profile.level"


def settings_of(scenario: Scenario) -> tuple[Setting, ...]:
    """Every number of a scenario in SI units, under the path that overrides know it by."""
    times = _times(scenario)
    return tuple(
        Setting(
            c_identifier(path),
            path,
            replace(item, summary=SAID.get(path, item.summary)),
            times[path] if path in TIMES else number_at(scenario, path),
        )
        for path, item in _declared(scenario).items()
    )


def links_of(scenario: Scenario) -> Graph:
    """What follows other settings as long as nobody changes it."""
    return {**links_that_hold(scenario), **links_of_times(time_texts(scenario))}


def _times(scenario: Scenario) -> dict[str, float]:
    """Times of a run by path [s]; the step is that of the file, of which the engine takes one that divides a sample."""
    texts = time_texts(scenario)
    duration, period = scenario.duration, scenario.control.period
    step, output = (value_at(texts, f"run.{name}") for name in ("step", "output_interval"))
    if step is not None:
        longest = parse_quantity(str(step), "s")
    elif output is None:
        longest = step_unless_given(duration, period)
    else:
        longest = step_with_output(duration, period, scenario.output_interval)
    return {
        "run.duration": duration,
        "run.step": longest,
        "run.output_interval": scenario.output_interval,
        "controller.period": period,
    }


def relations_of(scenario: Scenario) -> tuple[Relation, ...]:
    """Settings that contradict each other, as they would in a file."""
    rules: list[tuple[str, str, str, float]] = [
        *((path, relation, other, 0.0) for path, relation, other, _ in consistency(scenario.device)),
        ("run.step", "at most", "run.duration", 0.0),
        ("run.output_interval", "at most", "run.duration", 0.0),
        ("sensors.delay", "at most", "run.duration", 0.0),
    ]
    if HELD_ANGLE in _declared(scenario):
        rules.append((HELD_ANGLE, "at least", "actuator.angle_min", TOLERANCE))
        rules.append((HELD_ANGLE, "at most", "actuator.angle_max", TOLERANCE))
    if scenario.supply_lines is not None:
        rules.append(("supply.dorsiflexion_pressure", "at most", "supply.pressure", 0.0))
    of_steps = (
        Relation("run_step", "at most", longer, TOLERANCE, is_share=True)
        for longer in ("controller_period", "run_output_interval")
    )
    return (
        *(Relation(c_identifier(path), relation, c_identifier(other), slack) for path, relation, other, slack in rules),
        *of_steps,
    )


def _declared(scenario: Scenario) -> dict[str, Quantity]:
    """Declarations by path, without the form of an orifice that is not used, and without second names."""
    declared = used_numbers(scenario.device, declared_numbers(scenario))
    unused = {"controller.rate"}
    if HELD_ANGLE in declared and isinstance(scenario.motion, PrescribedMotion):
        unused.add(_LEVEL_OF_HELD)
    return {path: item for path, item in declared.items() if path not in unused}


def used_numbers(device: Device, declared: Mapping[str, Quantity]) -> dict[str, Quantity]:
    """Declarations by path, without the form of an orifice that is not used, and effects that are off."""
    sections = "valve", "actuator.leak"
    unused = {f"{section}.{name}" for section in sections for name in other_form(device, section)}
    is_on = effects_of(device)
    unused |= {
        f"{effect.section}.{item.name}"
        for effect in ordered_effects()
        if effect not in is_on
        for item in effect.quantities
    }
    return {path: item for path, item in declared.items() if path not in unused}


def preparation_of(scenario: Scenario, program: Program, collector: Collector) -> str:
    """The composed function ``prepare`` of a scenario, once everything it calls is gathered."""
    writing = Writing(scenario.device, scenario.supply_lines, program, collector)
    torque = "motion_external_torque" if isinstance(scenario.motion, FreeMotion) else "0.0"
    lines = [
        *writing.plant("plant", torque),
        *_steps(scenario, writing),
        *_pieces(scenario, writing),
        *_start(scenario, writing),
    ]
    return writing.text(settings_of(scenario), lines)


def _steps(scenario: Scenario, writing: Writing) -> Iterator[str]:
    """Lines that make the steps, delays in them, and whether the error decides about their parts."""
    given = "run_duration, run_step, run_output_interval, controller_period"
    yield f"counts_of_steps = {writing.add(step_counts)}({given})"
    yield from writing.timing("sensors_delay")
    if scenario.supply_lines is not None or not writing.program.is_held or writing.program.has_shape:
        yield "needs_parts = True"
        return
    stiffness = "1.0" if scenario.thermal is None else "gas_heat_capacity_ratio"
    yield f"needs_parts = not {writing.add(is_slow_held)}(plant, step, motion_angle, {stiffness})"


def _pieces(scenario: Scenario, writing: Writing) -> Iterator[str]:
    """Lines that make the parameters of controller, profiles, sensors, gas and lines."""
    program = writing.program
    if program.controller is not None:
        yield f"controller = {_kind(writing, 'controller', CONTROLLERS[scenario.control.kind])}"
    yield f"reference = {_reference(scenario, writing)}"
    if program.angle is RECORDED_ANGLE:
        yield f"path = {writing.add(Segment)}(0.0, motion_angle, 0.0)"
    elif isinstance(scenario.motion, PrescribedMotion):
        held = {"level": "motion_angle"} if program.is_held else {}
        yield f"path = {_kind(writing, 'motion.profile', PROFILES[scenario.motion.profile.kind], held)}"
    if program.slow_sensors:
        rates = "sensors_angle_bandwidth, sensors_pressure_bandwidth"
        yield f"sensor_rates = {writing.add(rates_of_sensors)}({rates})"
    yield from writing.gas()


def _kind(writing: Writing, section: str, kind: Any, given: Mapping[str, str] | None = None) -> str:
    """Parameters of a controller or profile from its settings."""
    names = writing.section(section, [item.name for item in kind.quantities]) | dict(given or {})
    return writing.kind(section, kind, names.values())


def _reference(scenario: Scenario, writing: Writing) -> str:
    """The reference; where none is followed, the one that stands in its place."""
    choice = scenario.reference
    kind = PROFILES[choice.kind]
    if writing.program.has_reference:
        return _kind(writing, "reference", kind)
    return _kind(writing, "reference", kind, {item.name: repr(choice.settings[item.name]) for item in kind.quantities})


def _start(scenario: Scenario, writing: Writing) -> Iterator[str]:
    """Lines that make the states at the start."""
    program, add = writing.program, writing.add
    moved = "motion_angle", "motion_angular_velocity"
    if isinstance(scenario.motion, PrescribedMotion):
        moved = "angle", "angular_velocity"
        assert program.angle is not None, "the angle is prescribed"
        yield f"angle, angular_velocity, _ = {add(program.angle.value)}(path, 0.0)"
    given = "initial_pressure_1, initial_pressure_2"
    if program.has_shape:
        yield f"filled = {add(program.actuator.chambers)}(plant, {moved[0]}, {given})"
        volumes = "filled.volume_1, filled.volume_2"
        yield f"state = {add(state_with_volumes)}(plant, {', '.join(moved)}, {volumes}, {given})"
    else:
        yield f"state = {add(state_at_start)}(plant, {', '.join(moved)}, {given})"
    yield from writing.start()
    if program.slow_sensors:
        yield f"sensor_state = {add(sensors_at_start)}(plant, state)"
