"""Export of a scenario as a C99 library, with an example and make files."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial

from ppafo.control.catalog import CONTROLLERS
from ppafo.engine.run import batch_of
from ppafo.errors import ProgramError
from ppafo.exports.c_library.conditions import RULES_OF_TIMES, choosing, other_samples, other_supply
from ppafo.exports.c_library.entries import check_entry, follow_entry, prepare_entry
from ppafo.exports.c_library.expected import expected_csv
from ppafo.exports.c_library.exported import ExportedProgram, exported
from ppafo.exports.c_library.files import library_files
from ppafo.exports.c_library.library import ExportParameter, Library, Switch, c_identifier
from ppafo.exports.c_library.preparation import VANE_PREPARATION, Preparation
from ppafo.exports.c_library.profile_rules import PROFILE_RULES, WALK_RULES, has_rules
from ppafo.exports.c_library.readme import words_of, words_of_walk
from ppafo.exports.c_library.settings import links_of, relations_of, relations_of_vane, rules_of_table, settings_of
from ppafo.model.catalog import ordered_effects
from ppafo.model.declaration import PlainFunction
from ppafo.parameters.device import Device
from ppafo.parameters.effects import effects_of
from ppafo.parameters.graph import Graph
from ppafo.simulation.clock import links_of_times, time_texts
from ppafo.simulation.motion_kind import VANE, WALK
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from ppafo.wording import argument_text

_FLAWS = (
    *("sensors_angle_noise", "sensors_pressure_noise", "sensors_angle_resolution", "sensors_pressure_resolution"),
    *("sensors_angle_bandwidth", "sensors_pressure_bandwidth"),
)
_FLAWS_OF_WALK = (
    *("sensors_force_noise", "sensors_force_resolution", "sensors_lost_share"),
    *("sensors_angle_lost_share", "sensors_pressure_lost_share"),
)


def c_library(scenario: Scenario) -> dict[str, bytes]:
    """Return the files of a C library by name, with a Python run for comparison.

    Raises ProgramError, with file and line, for code that cannot be translated.
    """
    library = library_of(scenario)
    metrics = [kind.name for kind in library.program.metrics]
    return {**library_files(library), "expected.csv": expected_csv(scenario, library.program.outputs, metrics)}


def scenario_library(scenario: Scenario) -> Library:
    """Return a library whose settings are all numbers of a scenario; ProgramError for a fixed-point controller."""
    if CONTROLLERS[scenario.controller.kind].plan is not None:
        raise ProgramError(
            f"{scenario.name}: a fixed-point controller cannot be exported as a C library; use 'ppafo export firmware'"
        )
    program = exported(batch_of(plan_run(scenario)).program)
    settings = settings_of(scenario)
    links = links_of(scenario, settings, links_of_times(time_texts(scenario)))
    of_sensors = [
        (("sensors_delay",), program.program.late_signals),
        (_FLAWS, not program.program.ideal_sensors),
        *(
            ([c_identifier(f"{effect.section}.{name}") for name in effect.switch], effect in program.program.effects)
            for effect in ordered_effects()
            if effect.section == "sensors"
        ),
    ]
    library = _library(scenario, program, settings, links, (VANE_PREPARATION, PROFILE_RULES))
    return replace(
        library,
        relations=relations_of(scenario, settings, relations_of_vane(scenario)),
        switches=_switches(scenario.device, of_sensors),
        other_program=(*other_samples(settings, program.program.samples_inside), *library.other_program),
        words=words_of(scenario, links),
        defaults=frozenset(setting.name for setting in settings if setting.path in links and setting.quantity.follows),
        rules=(*library.rules, *RULES_OF_TIMES),
    )


def walk_library(configuration: Scenario) -> Library:
    """Return a library whose settings are all numbers of a walk; ScenarioError for a walk that cannot be exported."""
    from ppafo.exports.c_library.walk_preparation import (
        LINKS_OF_WALK,
        RELATIONS_OF_WALK,
        WALK_PREPARATION,
        check_can_be_exported,
        rules_of_walk,
    )
    from ppafo.walking.motion import record_interval

    # Before anything is planned: what cannot be exported should be said at once.
    check_can_be_exported(configuration)
    program = exported(batch_of(plan_run(configuration)).program)
    settings = settings_of(configuration, record_interval(configuration.run.duration))
    links = links_of(configuration, settings, LINKS_OF_WALK)
    of_readings = [((*_FLAWS, *_FLAWS_OF_WALK), not program.program.ideal_sensors)]
    library = _library(configuration, program, settings, links, (WALK_PREPARATION, WALK_RULES))
    return replace(
        library,
        relations=relations_of(configuration, settings, RELATIONS_OF_WALK),
        switches=_switches(configuration.device, of_readings),
        words=words_of_walk(configuration, links),
        defaults=frozenset(c_identifier(path) for path in links if not path.startswith("supply.")),
        rules=(*library.rules, *rules_of_walk(configuration, settings)),
    )


def _library(
    scenario: Scenario,
    program: ExportedProgram,
    settings: tuple[ExportParameter, ...],
    links: Graph,
    functions: tuple[Sequence[PlainFunction], Sequence[PlainFunction]],
) -> Library:
    """Return what libraries of scenarios and walks have in common; ``functions`` prepare a run and check settings."""
    places = {setting.path: float(place) for place, setting in enumerate(settings, 1)}
    preparation, (preparing, rules) = Preparation(scenario, program.program, places), functions
    return Library(
        title=scenario.name,
        description=" ".join(scenario.description.split()),
        program=program,
        settings=settings,
        other_program=(other_supply(scenario.device),),
        further=partial(prepare_entry, preparation, preparing, settings),
        following=partial(follow_entry, preparation, settings, links) if links else None,
        checking=partial(check_entry, preparation, rules, settings) if has_rules(preparation) else None,
        links=links,
        rules=rules_of_table(scenario, settings),
        joint=scenario.device.joint,
        actuator=scenario.device.actuator.kind,
    )


_LIBRARIES = {VANE: scenario_library, WALK: walk_library}


def library_of(scenario: Scenario) -> Library:
    """Return the library of a scenario or a walk; ProgramError for a controller that is a Python object."""
    if scenario.controller.is_outside:
        raise ProgramError(
            f"{scenario.name}: a controller that is a Python object cannot be exported; export the plant only "
            f"({argument_text('interface', 'plant')}), or declare the control law as a controller kind of a plugin"
        )
    return _LIBRARIES[scenario.motion.motion_kind.layout](scenario)


def _switches(device: Device, others: Iterable[tuple[Sequence[str], bool]]) -> tuple[Switch, ...]:
    """Settings of the valve and others for which zero or nonzero selects the program."""
    settings = device.valve.settings
    of_valve = [((f"valve_{name}",), settings[name] > 0.0) for name in choosing(device)]
    of_effects: list[Switch] = [
        ([c_identifier(f"{effect.section}.{name}") for name in effect.switch], True)
        for effect in effects_of(device)
        if effect.switch
    ]
    return (*of_valve, *of_effects, *others)
