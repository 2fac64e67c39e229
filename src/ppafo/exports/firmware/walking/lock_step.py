"""The controller of a walk on the chip's simulator beside the same in Python: drawn readings, or a whole walk."""

from dataclasses import dataclass, replace

import numpy as np

from ppafo.control.fixed.walking_law import GaitConverter, GaitReadings, WalkCounts, read_gait
from ppafo.control.fixed.whole_numbers import COMMAND_STEPS
from ppafo.engine.lanes import run_batch
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import batch_of
from ppafo.exports.firmware.catalog import MSP430G2553
from ppafo.exports.firmware.lock_step import Comparison, Cost, compare_with, cost_of
from ppafo.exports.firmware.simulators import ChipSimulator, Decision, chip_simulator
from ppafo.exports.firmware.walking import WalkChip, walk_chip, walk_firmware
from ppafo.exports.firmware.walking.drawn import gait_readings
from ppafo.model.command import VENT
from ppafo.model.gait_sensors import GaitMeasurement
from ppafo.simulation.sampled import state_row_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.walking.planning import plan_walk
from ppafo.walking.recorded import SAFE_ROW
from ppafo.walking.sampled import run_sampled_walk
from ppafo.walking.varying import with_duration
from ppafo.walking.walk import lasting

_INSIDE = ("controller_state.", "gait_seen.")
"""What only the lanes keep: state of their controller, and the last readings."""

SIGN_BITS = 8
"""A chip tells its level above these bits of a word, and its sign in them."""


class PythonWalkChip:
    """The integer controller of a walk in Python, as the chip computes it."""

    def __init__(self, chip: WalkChip) -> None:
        self.law, self.numbers = chip.law, chip.of_law
        self.state: WalkCounts = chip.law.begins

    def begin(self) -> None:
        """Forget everything."""
        self.state = self.law.begins

    def sample(self, readings: GaitReadings) -> tuple[int, int]:
        """Command in steps, and level and sign in one word."""
        command, self.state = self.law.sample(self.numbers, self.state, readings)
        return command, (self.state.safety.level << SIGN_BITS) + self.state.safety.sign


class ChipOfWalk:
    """The simulated chip as a controller of a walk; it keeps the decision of every sample."""

    def __init__(self, simulator: ChipSimulator, converter: GaitConverter) -> None:
        self.simulator = simulator
        self.converter = converter
        self.decisions: list[Decision] = []

    def reset(self) -> None:
        """Reset the processor."""
        self.simulator.begin()
        self.decisions.clear()

    def update(self, measurement: GaitMeasurement) -> float:
        """Command from -1 to 1, or ``VENT``, from what the converter shows."""
        found = self.simulator.sample(read_gait(self.converter, measurement))
        self.decisions.append(found)
        return found.command / COMMAND_STEPS if found.command else VENT


@dataclass(frozen=True, slots=True)
class WalkOnChip:
    """A walk with the chip's simulator in charge, and the same with the integer controller in the lanes.

    ``differences`` are samples of the recording at which the commands differ; ``same_bits`` is true where all that is
    no state of a controller is the same. ``level`` is that of the chip at the end.
    """

    cost: Cost
    samples: int
    differences: int
    same_bits: bool
    level: int
    gas: float


def walk_on_chip(configuration: Scenario, minutes: float | None = None) -> WalkOnChip:
    """Walk with the controller on the chip's simulator, in virtual time, and once more in the lanes.

    ScenarioError where the controller has no integer form, SimulationError where a tool is missing.
    """
    chip = walk_chip(configuration)
    run = plan_walk(with_duration(configuration, lasting(configuration, minutes).duration))
    with chip_simulator(walk_firmware(configuration), MSP430G2553) as (simulator, image):
        law = ChipOfWalk(simulator, chip.converter)
        outside = run_sampled_walk(run, law)
        cost = cost_of(MSP430G2553, image, simulator.stack(), law.decisions)
    inside = run_batch(batch_of(run))
    rows = state_row_numbers(run)
    shared = [path for path in rows if not path.startswith(_INSIDE)]
    own = row_numbers(replace(run.program, controller=None).state_rows())
    both = ((outside, own), (inside, rows))
    mine, theirs = (one.record[:, [places[path] for path in shared], 0] for one, places in both)
    differ = int(np.count_nonzero(mine[:, shared.index("result.command")] != theirs[:, shared.index("result.command")]))
    level = law.decisions[-1].is_sound >> SIGN_BITS
    same = bool(np.array_equal(mine, theirs) and level == inside.record[-1, rows[SAFE_ROW], 0])
    gas = float(mine[-1, shared.index("state.supplied_mass")])
    return WalkOnChip(cost, len(law.decisions), differ, same, level, gas)


def compare_drawn_walk(configuration: Scenario, samples: int, seed: int = 1) -> Comparison:
    """Give drawn readings of a gait to the chip's simulator and to Python, with a reset before every episode."""
    chip = walk_chip(configuration)
    given = gait_readings(chip.converter, samples, seed)
    return compare_with(PythonWalkChip(chip), given, samples, walk_firmware(configuration), MSP430G2553)
