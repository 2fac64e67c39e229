"""Export of a scenario as a C99 library, with an example and make files."""

from collections.abc import Sequence
from functools import partial

from ppafo.control.catalog import CONTROLLERS
from ppafo.engine.run import batch_of
from ppafo.errors import ProgramError
from ppafo.exports.c_library.entries import check_entry, follow_entry, prepare_entry
from ppafo.exports.c_library.files import expected_csv, library_files, words_of
from ppafo.exports.c_library.library import Library, Switch, c_identifier, exported
from ppafo.exports.c_library.preparation import PROFILE_RULES, VANE_PREPARATION, WALK_RULES, Preparation, has_rules
from ppafo.exports.c_library.settings import (
    RULES_OF_TIMES,
    choosing,
    relations_of,
    relations_of_vane,
    rules_of_table,
    settings_of,
)
from ppafo.model.catalog import ordered_effects
from ppafo.model.declaration import PlainFunction
from ppafo.model.effects.kind import Effect
from ppafo.parameters.effects import effects_of
from ppafo.parameters.graph import Asked, holding
from ppafo.simulation.clock import links_of_times, time_texts
from ppafo.simulation.motion_kind import WALK
from ppafo.simulation.numbers import numbers_at
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from ppafo.wording import argument_text

_TIMES = ("run_output_interval", "run_step", "controller_period", "run_duration")
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


def library_of(scenario: Scenario) -> Library:
    """Return a library whose settings are all numbers of a scenario or a walk.

    Raises ProgramError for a controller that is a Python object or in fixed point, and ScenarioError for a walk that
    cannot be exported.
    """
    check_law(scenario)
    is_walk = scenario.motion.motion_kind.layout == WALK
    if is_walk:
        # The code of walks is loaded for a walk alone; what cannot be exported is said before anything is planned.
        from ppafo.exports.c_library import walk_preparation as of_walk
        from ppafo.walking.motion import record_interval

        of_walk.check_can_be_exported(scenario)
    exporting = exported(batch_of(plan_run(scenario)).program)
    program = exporting.program
    device = scenario.device
    settings = settings_of(scenario, record_interval(scenario.run.duration) if is_walk else None)
    places = {setting.path: float(place) for place, setting in enumerate(settings, 1)}
    # Numbers that were changed since the scenario was loaded follow nothing any more.
    links = dict(holding(scenario.graph, Asked(partial(numbers_at, scenario))))
    links |= of_walk.LINKS_OF_WALK if is_walk else links_of_times(time_texts(scenario))
    links = {path: follows for path, follows in links.items() if path in places}
    preparation = Preparation(scenario, program, places)
    plant = "prepared->parameters.plant"
    # Gas is drawn where the program feeds it, or the reverse.
    pressures = f"{plant}.supply_pressure", f"{plant}.dorsiflexion_pressure"
    below = " || ".join(f"{pressure} < {plant}.atmospheric_pressure" for pressure in pressures)
    other_program = [(f"!({below})" if device.supply.is_vacuum else below, "supply_pressure")]
    preparing: Sequence[PlainFunction] = VANE_PREPARATION
    checks: Sequence[PlainFunction] = PROFILE_RULES
    of_sensors: list[Switch]
    if is_walk:
        preparing = of_walk.WALK_PREPARATION
        checks = WALK_RULES
        relations = of_walk.RELATIONS_OF_WALK
        rules = of_walk.rules_of_walk(scenario, settings)
        of_sensors = [((*_FLAWS, *_FLAWS_OF_WALK), not program.ideal_sensors)]
        defaults = [path for path in links if not path.startswith("supply.")]
    else:
        relations = relations_of_vane(scenario)
        rules = RULES_OF_TIMES
        of_sensors = [
            (("sensors_delay",), program.late_signals),
            (_FLAWS, not program.ideal_sensors),
            *(
                (names_of_switch(effect), effect in program.effects)
                for effect in ordered_effects()
                if effect.section == "sensors"
            ),
        ]
        defaults = [setting.path for setting in settings if setting.path in links and setting.quantity.follows]
        # Samples begin or cease to lie between steps; a changed time is the one to report.
        interval = "prepared->counts.interval"
        values = {setting.name: setting.value for setting in settings}
        moved = f"({interval} != (double)(int64_t){interval}) != {'true' if program.samples_inside else 'false'}"
        changed = [(f"{moved} && settings->{name} != {values[name]!r}", name) for name in _TIMES]
        other_program = [*changed, (moved, _TIMES[0]), *other_program]
    of_valve = [((f"valve_{name}",), device.valve.settings[name] > 0.0) for name in choosing(device)]
    of_effects = [(names_of_switch(effect), True) for effect in effects_of(device) if effect.switch]
    return Library(
        title=scenario.name,
        description=" ".join(scenario.description.split()),
        program=exporting,
        settings=settings,
        relations=relations_of(scenario, settings, relations),
        # Settings of which zero or nonzero selects the program.
        switches=(*of_valve, *of_effects, *of_sensors),
        other_program=tuple(other_program),
        words=words_of(scenario, links),
        further=partial(prepare_entry, preparation, preparing, settings),
        following=partial(follow_entry, preparation, settings, links) if links else None,
        checking=partial(check_entry, preparation, checks, settings) if has_rules(preparation) else None,
        defaults=frozenset(map(c_identifier, defaults)),
        links=links,
        rules=(
            *rules_of_table(scenario, settings),
            # In range, a whole number is exact as an integer.
            *(
                (f"settings->{setting.name} == (double)(int64_t)settings->{setting.name}", setting.name)
                for setting in settings
                if setting.quantity.whole
            ),
            *rules,
        ),
        joint=device.joint,
        actuator=device.actuator.kind,
    )


def check_law(scenario: Scenario) -> None:
    """Raise ProgramError for a controller that is a Python object or in fixed point."""
    kind = scenario.controller.kind
    if scenario.controller.is_outside:
        raise ProgramError(
            f"{scenario.name}: a controller that is a Python object cannot be exported; export the plant only "
            f"({argument_text('interface', 'plant')}), or declare the control law as a controller kind of a plugin"
        )
    if scenario.motion.motion_kind.layout != WALK and CONTROLLERS[kind].plan is not None:
        raise ProgramError(
            f"{scenario.name}: a fixed-point controller cannot be exported as a C library; use 'ppafo export firmware'"
        )


def names_of_switch(effect: Effect) -> tuple[str, ...]:
    """Return the settings in C of which any above 0 switches an effect on."""
    return tuple(c_identifier(f"{effect.section}.{name}") for name in effect.switch)
