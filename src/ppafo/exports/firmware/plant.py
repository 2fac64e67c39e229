"""The plant of a scenario as firmware: the exported library, a thin layer, and what the converter shows."""

import textwrap
from collections.abc import Mapping
from dataclasses import replace
from importlib.resources import files

from ppafo.control.catalog import PROFILES
from ppafo.control.fixed.torque_laws import PLANT_TARGETS
from ppafo.control.fixed.whole_numbers import COMMAND_STEPS, SETTINGS, Converter, Readings, read
from ppafo.engine.lanes import SIGNAL_ROWS
from ppafo.engine.rows import leaf_paths, numbers, row_expression
from ppafo.engine.source_text import Collector
from ppafo.errors import ScenarioError
from ppafo.exports.c_library import commanded, scenario_library
from ppafo.exports.c_library.files import Library, filled, library_files, steps_source
from ppafo.exports.firmware import chip_controller
from ppafo.exports.firmware.catalog import target_of
from ppafo.exports.firmware.target import Doubles, Target
from ppafo.model.sensors import Measurement
from ppafo.simulation.plan import profile_parameters
from ppafo.simulation.preparation import step_counts
from ppafo.simulation.reading import quantity_text
from ppafo.simulation.scenario import Scenario, Sensors
from ppafo.version import __version__

FILES = {
    "plant_Makefile": "Makefile",
    "plant_README.md": "README.md",
    "plant_board.h": "board.h",
    "plant_main.c": "main.c",
    "plant_simulated.c": "board_simulated.c",
}
LATE_COMMANDS = 64
"""Steps of the engine that a command may be late by; more has no room in the memory of the run."""
_SHOWN = '@njit("void(float64[::1], float64[::1])")'


def plant_firmware(scenario: Scenario, target: str) -> dict[str, bytes]:
    """Files of the firmware of a scenario's plant, by name, for a controller on whole numbers.

    ScenarioError where the target has too little memory for doubles, or for sensors that have flaws.
    """
    chosen = target_of(target)
    if chosen.doubles is None:
        raise ScenarioError(f"no plant for '{target}': floats of 64 bits need more memory: {', '.join(PLANT_TARGETS)}")
    library = plant_library(scenario)
    words = _words(scenario, library, chosen, chosen.doubles)
    texts = {name: _filled(template, words) for template, name in FILES.items()}
    texts |= {name: _filled(name, words) for name in ("start_cortex.c", words["script"])}
    written = library_files(library)
    own = {name: written[name] for name in (f"{library.name}.c", f"{library.name}.h", "LICENSE")}
    return {name: text.encode() for name, text in sorted(texts.items())} | own


def plant_library(scenario: Scenario) -> Library:
    """The library of the plant alone, which also has what the controller's converter shows."""
    if scenario.sensors != Sensors():
        raise ScenarioError(f"{scenario.name}: the plant on a board has sensors without flaws: leave out [sensors]")
    converter = chip_controller(scenario).converter
    library = scenario_library(commanded(scenario))
    prepare = library.further
    assert prepare is not None, "a scenario has settings"
    return replace(
        library,
        further=lambda collector: f"{prepare(collector)}\n\n{_shown(scenario, converter, collector)}",
    )


def plant_values(library: Library) -> tuple[str, ...]:
    """Names of the values of a sample, in order."""
    return ("time", *library.program.outputs)


def _shown(scenario: Scenario, converter: Converter, collector: Collector) -> str:
    """The composed function that makes the readings of the controller from the values of a sample."""
    add = collector.add
    names = ("time", "pressure_1", "pressure_2")
    outputs = plant_values(scenario_library(commanded(scenario)))
    time, pressure_1, pressure_2 = (f"sampled[{outputs.index(name)}]" for name in names)
    profile = PROFILES[scenario.reference.kind]
    reference = _constant(profile_parameters(scenario.reference), "reference", collector)
    lines = [
        f"    wanted = {add(profile.value)}({reference}, {time})[0]",
        f"    seen = {add(Measurement)}(0.0, {pressure_1}, {pressure_2}, 0.0)",
        f"    readings = {add(read)}({_constant(converter, 'converter', collector)}, wanted, seen)",
        *(f"    converted[{place}] = float(readings.{name})" for place, name in enumerate(Readings._fields)),
    ]
    return "\n".join([_SHOWN, "def shown_by_converter(sampled, converted):", *lines])


def _constant(row: tuple[float, ...], path: str, collector: Collector) -> str:
    """A NamedTuple of numbers that are known."""
    cells = dict(zip(leaf_paths(type(row), path), map(repr, numbers(row)), strict=True))
    return row_expression(type(row), path, cells, collector.add)


def _filled(template: str, words: Mapping[str, str]) -> str:
    return filled(files("ppafo.exports.firmware").joinpath("templates", template).read_text(encoding="utf-8"), words)


def _words(scenario: Scenario, library: Library, target: Target, doubles: Doubles) -> dict[str, str]:
    """What fills the templates."""
    control = scenario.control
    counts = step_counts(scenario.duration, scenario.time_step, scenario.output_interval, control.period)
    program = library.program
    # The members of a run, as interface.c has them.
    own = len(program.parameter_places) + 2 * len(program.state_places) + 2 * len(program.outputs) + 16
    values = plant_values(library)
    return {
        "name": library.name,
        "NAME": library.name.upper(),
        "title": scenario.name,
        "description": scenario.description,
        "version": __version__,
        "target": target.name,
        "processor": target.processor,
        "script": target.words["script"],
        "processor_flags": doubles.flags,
        "arithmetic": doubles.said,
        "steps": steps_source(library),
        "steps_of_sample": f"{counts.steps_per_sample:.0f}",
        "memory": str(own + 2 * SIGNAL_ROWS + LATE_COMMANDS),
        "command_steps": str(COMMAND_STEPS),
        "value_count": str(len(values)),
        "value_names": "\n".join(f" * {line}" for line in textwrap.wrap(", ".join(values), 110)),
        "period": quantity_text(control.period, "s"),
        "range": f"{control.settings[SETTINGS[1].name] / 1.0e3:.6g} kPa",
    }
