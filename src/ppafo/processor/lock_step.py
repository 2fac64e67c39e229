"""Comparison of a controller on a simulated processor and in Python, for random samples or in a run."""

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ppafo.engine.rows import rebuilt
from ppafo.errors import SimulationError
from ppafo.processor.catalog import TARGETS, target_of
from ppafo.processor.firmware import FixedPointController, firmware, fixed_point_controller
from ppafo.processor.fixed_point import COMMAND_STEPS, ConverterCounts, read
from ppafo.processor.images import Decision, Image, ImageSizes, ProcessorSimulator, Target, processor_simulator
from ppafo.report.style import BLACK, REFERENCE, FigureMargins, figure_of_panels, house_style, look_of_valve, mark_kind
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Result, simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure


EPISODE = 200
"""Number of random samples between resets of the controller."""

TURN = 50
"""Number of random samples per batch of the simulated processor."""


class PythonProcessor:
    """Integer controller of a scenario in Python, with processor arithmetic."""

    def __init__(self, fixed: FixedPointController) -> None:
        self.law = fixed.law
        numbers = [int(fixed.numbers[quantity.name]) for quantity in fixed.law.number_quantities]
        self.numbers: Any = rebuilt(fixed.law.numbers, numbers)
        self.state: Any = fixed.law.begins

    def begin(self) -> None:
        """Reset the controller state."""
        self.state = self.law.begins

    def sample(self, readings: ConverterCounts) -> tuple[int, int]:
        """Return command [steps] and validity flag for readings."""
        command, self.state = self.law.sample(self.numbers, self.state, readings)
        return command, self.state.sound


class _SimulatedController:
    """Simulated processor as the controller of a scenario; stores the decision of every sample."""

    def __init__(self, simulator: ProcessorSimulator, fixed: FixedPointController) -> None:
        self.simulator = simulator
        self.fixed = fixed
        self.decisions: list[Decision] = []

    def reset(self) -> None:
        """Reset the processor."""
        self.simulator.begin()
        self.decisions.clear()

    def update(self, time: float, reference: float, measurement: Any) -> float:
        """Return the command from -1 to 1 for the converter readings; the time [s] is not used."""
        del time
        readings = read(self.fixed.steps, self.fixed.limits, reference, measurement)
        (decision,) = self.simulator.samples((readings,))
        self.decisions.append(decision)
        return decision.command / COMMAND_STEPS


class Cost(NamedTuple):
    """Resources that a controller needs on a target.

    Sizes of the program and depth of the stack [bytes]; maximum and mean of the cycles or instructions of a sample, in
    the unit of the target.
    """

    target: Target
    sizes: ImageSizes
    stack: int
    worst: int
    mean: float


@dataclass(frozen=True, slots=True)
class ProcessorRun:
    """Scenario run twice, on the simulated processor and with the integer controller in Python, with resources.

    ``differences`` is the number of samples with different commands; ``same_bits`` is True if all channels are equal.
    """

    scenario: Scenario
    processor: Result
    lanes: Result
    cost: Cost
    samples: int
    differences: int
    same_bits: bool


def run_on_processor(scenario: Scenario, target: str = TARGETS[0]) -> ProcessorRun:
    """Run a scenario with its controller on the simulated processor in virtual time, and again in the engine.

    Raises ScenarioError if the controller has no integer form, SimulationError if a tool is missing.
    """
    fixed, chosen = fixed_point_controller(scenario), target_of(target)
    with processor_simulator(firmware(scenario, target), chosen) as (simulator, image):
        law = _SimulatedController(simulator, fixed)
        on_processor = simulate(fixed.scenario.controlled_by(law))
        cost = cost_of(chosen, image, simulator.stack(), law.decisions)
    in_lanes = simulate(fixed.scenario)
    channels, expected = on_processor.recording.channels, in_lanes.recording.channels
    same_bits = all(np.array_equal(channels[name].values, expected[name].values) for name in expected)
    differences = int(np.count_nonzero(channels["command"].values != expected["command"].values))
    return ProcessorRun(fixed.scenario, on_processor, in_lanes, cost, len(law.decisions), differences, same_bits)


@dataclass(frozen=True, slots=True)
class DecisionComparison:
    """Comparison of decisions on the simulated processor and in Python: samples, differences, resources."""

    samples: int
    differences: int
    first_difference: str
    cost: Cost


def compare_drawn(scenario: Scenario, samples: int, seed: int = 1, target: str = TARGETS[0]) -> DecisionComparison:
    """Compare decisions for random readings on the simulated processor and in Python, with regular resets."""
    fixed, chosen = fixed_point_controller(scenario), target_of(target)
    reference = PythonProcessor(fixed)
    expected: list[tuple[int, int]] = []
    pending: list[ConverterCounts] = []
    decisions: list[Decision] = []
    with processor_simulator(firmware(scenario, target), chosen) as (simulator, image):
        for number, readings in enumerate(drawn_readings(int(fixed.limits.top), samples, seed)):
            begins = number % EPISODE == 0
            if begins or len(pending) == TURN:
                decisions += simulator.samples(pending)
                pending = []
            if begins:
                reference.begin()
                simulator.begin()
            pending.append(readings)
            expected.append(reference.sample(readings))
        decisions += simulator.samples(pending)
        cost = cost_of(chosen, image, simulator.stack(), decisions)
    differing = [sample for sample, decision in enumerate(decisions) if decision[:2] != expected[sample]]
    first = ""
    if differing:
        sample = differing[0]
        first = f"sample {sample}: {decisions[sample][:2]} on the processor, {expected[sample]} in Python"
    return DecisionComparison(samples, len(differing), first, cost)


def drawn_readings(top: int, samples: int, seed: int) -> Iterator[ConverterCounts]:
    """Yield random converter readings: wandering, jumping, resting at a limit, or broken signals.

    Each episode has one kind of signal; in two of five a reading reaches an end of its range at some time.
    """
    draw = random.Random(seed)
    edges = (1, 2, top // 2, top // 2 + 1, top - 2, top - 1)
    for start in range(0, samples, EPISODE):
        step = draw.choice((1, 3, 30, 300, top))
        readings = [draw.choice((*edges, draw.randint(1, top - 1))) for _ in ConverterCounts._fields]
        breaks = draw.randrange(EPISODE) if draw.random() < 0.4 else EPISODE
        for sample in range(min(EPISODE, samples - start)):
            if draw.random() < 0.02:
                readings[draw.randrange(3)] = draw.choice(edges)
            if draw.random() < 0.7:
                readings = [min(top - 1, max(1, value + draw.randint(-step, step))) for value in readings]
            sensed = list(readings)
            if sample == breaks:
                sensed[draw.randrange(3)] = draw.choice((0, top))
            yield ConverterCounts(*sensed)


def cost_of(target: Target, image: Image, stack: int, decisions: list[Decision]) -> Cost:
    """Return the resources used by decisions on a processor. Raises SimulationError without decisions."""
    if not decisions:
        raise SimulationError("the simulated processor took no sample; simulate a longer run")
    work = [decision.work for decision in decisions]
    return Cost(target, image.shipped, stack, worst=max(work), mean=sum(work) / len(work))


_MARGINS = FigureMargins(left=0.68, right=0.15, top=0.42, bottom=0.52, row_gap=0.36)
"""Figure margins [inches]."""
_WIDTH, _TORQUE, _COMMAND = 7.6, 2.6, 0.9
_LANES = (0, (1, 3))


def processor_figure(runs: Sequence[ProcessorRun]) -> "Figure":
    """Draw runs on the processor, two panels for each: torque with its reference, and valve command.

    The run in the engine is drawn as dots on the lines of the processor. With ``torque-task-solenoid`` and
    ``torque-task-proportional`` it is figure 8 of the paper.
    """
    heights = [_TORQUE, _COMMAND] * len(runs)
    gaps = _MARGINS.row_gap * (len(heights) - 1)
    size = (_WIDTH, _MARGINS.top + _MARGINS.bottom + gaps + sum(heights))
    with house_style():
        figure, rows = figure_of_panels(size, _MARGINS, rows=len(heights), heights=heights)
        panels = [axes for (axes,) in rows]
        for torque, command, run in zip(panels[::2], panels[1::2], runs, strict=True):
            colour = look_of_valve(run.scenario.device.valve.kind).colour
            fixed, lanes = run.processor.recording, run.lanes.recording
            bits = "same bits as in the simulation" if run.same_bits else "NOT the bits of the simulation"
            torque.set_title(f"{run.scenario.name}: {run.differences} of {run.samples} decisions differ, {bits}")
            line: dict[str, Any] = {"color": REFERENCE.colour, "linewidth": 1.3, "label": "reference"}
            torque.plot(fixed.time, fixed["reference"], REFERENCE.line, **line)
            label = f"{run.cost.target.name} in its simulator"
            dots: dict[str, Any] = {"color": BLACK, "linewidth": 0.9, "linestyle": _LANES, "label": "simulation"}
            for axes, name, step in ((torque, "torque", "default"), (command, "command", "steps-post")):
                axes.plot(fixed.time, fixed[name], color=colour, drawstyle=step, label=label)
                axes.plot(lanes.time, lanes[name], drawstyle=step, **dots)
            torque.set_ylabel("Torque (N m)")
            torque.legend(loc="lower right")
            command.set_ylabel("Valve")
            command.set_ylim(-1.1, 1.1)
        panels[-1].set_xlabel("Time (s)")
        panels[-1].set_xlim(0.0, max(run.processor.recording.duration for run in runs))
        mark_kind(figure, runs[0].processor.recording.kind)
        return figure
