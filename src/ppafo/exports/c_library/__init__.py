"""A scenario as a library in C99, with an example and make files."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ppafo.control.catalog import CONTROLLERS
from ppafo.engine.run import batch_of
from ppafo.errors import ProgramError
from ppafo.exports.c_library.files import (
    Library,
    Setting,
    Switch,
    c_identifier,
    choosing,
    library_files,
    words_of,
    words_of_walk,
)
from ppafo.exports.c_library.preparation import following_text, links_of, preparation_of, relations_of, settings_of
from ppafo.exports.c_library.program import Further, exported
from ppafo.model.catalog import ordered_effects
from ppafo.parameters.device import Device
from ppafo.parameters.graph import Graph
from ppafo.parameters.plant import effects_of
from ppafo.simulation.plan import plan_run, step_counts
from ppafo.simulation.scenario import Control, Scenario, Sensors

if TYPE_CHECKING:
    from ppafo.simulation.scenario import Scenario

_FLAWS = (
    *("sensors_angle_noise", "sensors_pressure_noise", "sensors_angle_resolution", "sensors_pressure_resolution"),
    *("sensors_angle_bandwidth", "sensors_pressure_bandwidth"),
)
_FLAWS_OF_WALK = (
    *("sensors_force_noise", "sensors_force_resolution", "sensors_lost_share"),
    *("sensors_angle_lost_share", "sensors_pressure_lost_share"),
)


def c_library(item: Scenario) -> dict[str, bytes]:
    """Files of a library in C by name. ProgramError for what cannot be translated, with file and line."""
    return library_files(library_of(item))


def library_of(item: Scenario) -> Library:
    """The library of a scenario or a walk."""
    return scenario_library(item) if not item.walks else walk_library(item)


def scenario_library(scenario: Scenario) -> Library:
    """A library whose settings are all numbers of a scenario. ProgramError for a fixed-point controller."""
    if CONTROLLERS[scenario.controller.kind].plan is not None:
        raise ProgramError(
            f"{scenario.name}: a fixed-point controller has no library yet; 'ppafo export firmware' writes it"
        )
    program = exported(batch_of(plan_run(scenario)).program)
    settings, links = settings_of(scenario), links_of(scenario)
    of_sensors = [
        (("sensors_delay",), program.program.late_signals),
        (_FLAWS, not program.program.ideal_sensors),
        *(
            ([c_identifier(f"{effect.section}.{name}") for name in effect.switch], effect in program.program.effects)
            for effect in ordered_effects()
            if effect.section == "sensors"
        ),
    ]
    # Another program where samples lie between steps and did not, or the other way round.
    interval = "prepared->counts.interval"
    return Library(
        title=scenario.name,
        description=" ".join(scenario.description.split()),
        program=program,
        settings=settings,
        relations=relations_of(scenario),
        switches=_switches(scenario.device, of_sensors),
        other_program=(
            (
                f"({interval} != (double)(int64_t){interval}) != {_truth(program.program.samples_inside)}",
                "run_output_interval",
            ),
        ),
        words=words_of(scenario, links),
        further=lambda collector, boundary: preparation_of(scenario, program.program, collector, boundary),
        following=_following(settings, links),
        links=links,
    )


def commanded(scenario: Scenario) -> Scenario:
    """The plant of a scenario alone, under a command that is handed in at every step of its engine."""
    # The engine's own step: commands come once in each, and nothing lies between.
    step = step_counts(
        scenario.run.duration, scenario.run.step, scenario.run.output_interval, scenario.controller.period
    ).step
    return replace(
        scenario,
        name=f"{scenario.name}-plant",
        description=f"The plant alone of this scenario: {scenario.description}",
        run=replace(scenario.run, step=step, output_interval=step),
        controller=Control("constant", {"command": 0.0}, step),
        sensors=Sensors(),
    )


def walk_library(configuration: "Scenario") -> Library:
    """A library whose settings are all numbers of a walk; ScenarioError for one that cannot be exported."""
    from ppafo.exports.c_library.walk_preparation import (
        check_can_leave,
        links_of_walk,
        preparation_of_walk,
        relations_of_walk,
        sensors_that_fail,
        settings_of_walk,
    )
    from ppafo.walking.planning import plan_walk

    # Before anything is planned: what cannot be exported should be said at once.
    check_can_leave(configuration)
    program = exported(batch_of(plan_walk(configuration)).program)
    settings, links = settings_of_walk(configuration), links_of_walk(configuration)
    failing = sensors_that_fail(configuration)
    # A sensor that fails is never ideal, whatever the settings are.
    of_readings = [] if failing else [((*_FLAWS, *_FLAWS_OF_WALK), not program.program.ideal_sensors)]
    return Library(
        title=configuration.name,
        description=" ".join(configuration.description.split()),
        program=program,
        settings=settings,
        relations=relations_of_walk(configuration),
        switches=_switches(configuration.device, of_readings),
        other_program=(
            (f"(prepared->counts.signal_delay > 0.0) != {_truth(program.program.late_readings)}", "controller_period"),
        ),
        words=words_of_walk(configuration, links, failing),
        further=lambda collector, boundary: preparation_of_walk(configuration, program.program, collector, boundary),
        following=_following(settings, links),
        links=links,
        defaults=frozenset(c_identifier(path) for path in links if not path.startswith("supply.")),
    )


def _following(settings: Sequence[Setting], links: Graph) -> Further | None:
    """The writer of the function that lets settings follow others, None where none does."""
    return (lambda collector, boundary: following_text(settings, links, collector, boundary)) if links else None


def _switches(device: Device, others: Iterable[tuple[Sequence[str], bool]]) -> tuple[Switch, ...]:
    """Settings that choose the program by being 0 or not: of the valve, and others."""
    given = device.valve.settings
    of_valve = [((f"valve_{name}",), given[name] > 0.0) for name in choosing(device)]
    of_effects = [
        ([c_identifier(f"{effect.section}.{name}") for name in effect.switch], True)
        for effect in effects_of(device)
        if effect.switch
    ]
    return tuple(Switch(tuple(names), is_above) for names, is_above in (*of_valve, *of_effects, *others))


def _truth(value: bool) -> str:
    return "true" if value else "false"
