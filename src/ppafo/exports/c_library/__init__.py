"""A scenario as a library in C99, with an example and make files."""

from collections.abc import Sequence

from ppafo.engine.program import Program
from ppafo.engine.run import batch_of
from ppafo.exports.c_library.files import Library, library_files
from ppafo.exports.c_library.preparation import Preparation, settings_of
from ppafo.exports.c_library.program import exported
from ppafo.model.valves.catalog import VALVES
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario

_ARRAYS = {
    "given": "SETTINGS",
    "prepared->parameters": "PARAMETERS",
    "prepared->states": "STATES",
    "prepared->counts": "COUNTS",
}
"""What the function from settings to the numbers of a run is handed, and how many there are of each."""


def c_library(scenario: Scenario) -> dict[str, bytes]:
    """Files of a library in C by name. ProgramError for what cannot be translated, with file and line."""
    return library_files(scenario_library(scenario))


def scenario_library(scenario: Scenario) -> Library:
    """A library whose settings are all numbers of a scenario."""
    program = exported(batch_of(plan_run(scenario)).program)
    settings = settings_of(scenario)
    given = [f"given[SETTING_{item.name.upper()}] = settings->{item.name};" for item in settings]
    arrays = ", ".join(f"array_of({name}, {count}, 0, 0)" for name, count in _ARRAYS.items())
    return Library(
        title=scenario.name,
        description=" ".join(scenario.description.split()),
        program=program,
        settings=settings,
        preparation=("double given[SETTINGS];", *given, f"prepare({arrays});"),
        other_program=_other_program(scenario, program.program),
        words={},
        further=lambda collector: Preparation(scenario, program.program, collector).text(),
    )


def _other_program(scenario: Scenario, program: Program) -> tuple[str, ...]:
    """Conditions in C under which the settings ask for another program than this one."""
    given = scenario.device.valve.settings
    names = [item.name for item in VALVES[scenario.device.valve.kind].quantities]
    found = [_differs([f"valve_{name}"], given[name] > 0.0) for name in names]
    flaws = ["angle_noise", "pressure_noise", "angle_resolution", "pressure_resolution"]
    bandwidths = ["angle_bandwidth", "pressure_bandwidth"]
    found += [
        _differs(["sensors_delay"], program.late_signals),
        _differs([f"sensors_{name}" for name in (*flaws, *bandwidths)], not program.ideal_sensors),
        _differs([f"sensors_{name}" for name in bandwidths], program.slow_sensors),
    ]
    interval = "prepared->counts[COUNT_INTERVAL]"
    found.append(f"(prepared->counts[COUNT_NEEDS_PARTS] != 0.0) != {_truth(program.is_adaptive)}")
    found.append(f"({interval} != (double)(int64_t){interval}) != {_truth(program.samples_inside)}")
    return tuple(found)


def _differs(names: Sequence[str], is_above: bool) -> str:
    """True where not the same is above 0 as in the scenario."""
    return f"({' || '.join(f'settings->{name} > 0.0' for name in names)}) != {_truth(is_above)}"


def _truth(value: bool) -> str:
    return "true" if value else "false"
