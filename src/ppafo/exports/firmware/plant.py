"""The plant of a scenario as firmware, and a run of two boards in their simulators beside the same run in the lanes."""

import textwrap
from dataclasses import dataclass, replace

from ppafo.control.catalog import PROFILES
from ppafo.control.fixed.torque_laws import PLANT_TARGETS
from ppafo.control.fixed.whole_numbers import COMMAND_STEPS, SETTINGS, Converter, Readings, read
from ppafo.engine.lanes import SIGNAL_ROWS
from ppafo.engine.rows import leaf_paths, numbers, row_expression
from ppafo.engine.source_text import Collector
from ppafo.errors import ScenarioError, SimulationError
from ppafo.exports.c_library import commanded, scenario_library
from ppafo.exports.c_library.files import Library, library_files, steps_source
from ppafo.exports.firmware import chip_controller, firmware
from ppafo.exports.firmware.catalog import target_of
from ppafo.exports.firmware.simulators import (
    ChipSimulator,
    Doubles,
    PlantSample,
    QemuPlant,
    Sizes,
    Target,
    built_image,
    check_tools,
    chip_simulator,
)
from ppafo.exports.templates import filled, template
from ppafo.model.sensors import Measurement
from ppafo.simulation.plan import profile_parameters, step_counts
from ppafo.simulation.reading import quantity_text
from ppafo.simulation.scenario import Scenario, Sensors
from ppafo.simulation.simulate import simulate
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
    texts = {name: filled(template("firmware", source), words) for source, name in FILES.items()}
    texts |= {name: filled(template("firmware", name), words) for name in ("start_cortex.c", words["script"])}
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


FEWEST_SAMPLES = 2


@dataclass(frozen=True, slots=True)
class BoardsRun:
    """A run of controller and plant on two boards, compared with the lanes at every sample of the controller.

    ``differences`` are samples at which the command, or any value of the plant, has other bits. Of the plant: sizes and
    depth of the stack [bytes], instructions from one sample to the next, the most and the mean.
    """

    scenario: Scenario
    plant: Target
    samples: int
    differences: int
    first_difference: str
    compared: tuple[str, ...]
    sizes: Sizes
    stack: int
    worst: int
    mean: float


def run_on_two_boards(scenario: Scenario, target: str, plant: str) -> BoardsRun:
    """Run a scenario with its controller on one board and its plant on another, in virtual time, and in the lanes.

    ScenarioError where either has no firmware or the run has less than two samples, SimulationError where a tool is
    missing or the plant cannot go on.
    """
    chosen, samples = target_of(plant), _samples_of_run(scenario)
    check_tools(chosen)
    files, controller = plant_firmware(scenario, plant), firmware(scenario, target)
    names = plant_values(plant_library(scenario))
    with chip_simulator(controller, target_of(target)) as (chip, _), built_image(files, chosen) as image:
        board = QemuPlant(chosen, image, len(names))
        try:
            run = _coupled(samples, chip, board)
            stack = board.stack()
        finally:
            board.close()
    lanes = simulate(replace(scenario, output_interval=scenario.control.period)).recording
    compared = tuple(name for name in names if name in lanes.names)
    columns = {name: lanes[name] for name in (*compared, "command")}
    differ = [
        (number, name)
        for number, (sample, command) in enumerate(run)
        for name, value in {**dict(zip(names, sample.values, strict=True)), "command": command / COMMAND_STEPS}.items()
        if name in columns and value != columns[name][number]
    ]
    work = [sample.work for sample, _ in run[1:]]
    return BoardsRun(
        scenario=scenario,
        plant=chosen,
        samples=len(run),
        differences=len({number for number, _ in differ}),
        first_difference="sample {}, {}".format(*differ[0]) if differ else "",
        compared=compared,
        sizes=image.sizes,
        stack=stack,
        worst=max(work),
        mean=sum(work) / len(work),
    )


def _samples_of_run(scenario: Scenario) -> int:
    """Samples of the controller in a run; what a plant takes is counted from each to the next."""
    samples = int(scenario.duration / scenario.control.period + 1.0e-9)
    if samples < FEWEST_SAMPLES:
        raise ScenarioError(
            f"{scenario.name}: run.duration = {scenario.duration:g} s: must be at least "
            f"{FEWEST_SAMPLES * scenario.control.period:g} s on two boards, {FEWEST_SAMPLES} samples of the controller"
        )
    return samples


def _coupled(samples: int, chip: ChipSimulator, board: QemuPlant) -> list[tuple[PlantSample, int]]:
    """What the plant shows at every sample, and the command that the controller gives for it."""
    found: list[tuple[PlantSample, int]] = []
    for number in range(samples):
        if number:
            board.go_on(found[-1][1])
        shown = board.shown()
        if shown.is_well != 1:
            raise SimulationError(f"the plant on its board left what is possible after {number} samples")
        found.append((shown, chip.sample(shown.readings).command))
    return found
