"""A scenario as a library in C99, with an example and make files."""

from ppafo.engine.rows import leaves
from ppafo.engine.run import Run, batch_of
from ppafo.exports.c_library.files import Library, Setting, assigned, c_identifier, library_files
from ppafo.exports.c_library.program import COUNTS, exported
from ppafo.model.declaration import Quantity
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario


def c_library(scenario: Scenario) -> dict[str, bytes]:
    """Files of a library in C by name. ProgramError for what cannot be translated, with file and line."""
    return library_files(row_library(scenario.name, scenario.description, plan_run(scenario)))


def row_library(title: str, description: str, run: Run) -> Library:
    """A library whose settings are the numbers of a run as it was planned."""
    batch = batch_of(run)
    program = exported(batch.program)
    clock = batch.clock
    counts = (clock.record_every, clock.step_count, clock.steps_per_sample, clock.signal_delay, clock.command_delay)
    places = [
        *((f"PARAMETER_{name[3:]}", f"prepared->parameters[PARAMETER_{name[3:]}]") for name in program.parameter_places.values()),
        *((name, f"prepared->states[{name}]") for name in list(program.state_places.values())[: len(batch.states)]),
        *((name, f"prepared->counts[COUNT_{name.upper()}]") for name in COUNTS),
    ]
    values = [*batch.parameters[:, 0].tolist(), *batch.states[:, 0].tolist(), *map(float, counts)]
    names = [c_identifier(name.removeprefix("AT_").removeprefix("PARAMETER_")) for name, _ in places]
    settings = tuple(Setting(name, Quantity(name, "", ""), value) for name, value in zip(names, values, strict=True))
    lines = assigned([(place, f"settings->{name}") for (_, place), name in zip(places, names, strict=True)])
    return Library(title, description, program, settings, lines, {})
