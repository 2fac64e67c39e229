"""Two boards in their simulators, one with the controller and one with the plant, beside the same run in the lanes."""

from dataclasses import dataclass, replace

from ppafo.control.fixed.whole_numbers import COMMAND_STEPS
from ppafo.errors import ScenarioError, SimulationError
from ppafo.exports.firmware import firmware
from ppafo.exports.firmware.catalog import target_of
from ppafo.exports.firmware.plant import plant_firmware, plant_library, plant_values
from ppafo.exports.firmware.qemu import PlantSample, QemuPlant
from ppafo.exports.firmware.simulator import built_image, check_tools, chip_simulator
from ppafo.exports.firmware.target import ChipSimulator, Sizes, Target
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import simulate

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
    chosen, samples = target_of(plant), _samples(scenario)
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


def _samples(scenario: Scenario) -> int:
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
