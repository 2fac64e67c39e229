"""The controller of a walk as firmware for an MSP430G2553, and on the chip's simulator beside the same in Python."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ppafo.control.fixed.torque_laws import WALK_TARGETS
from ppafo.control.fixed.walking_law import GaitConverter, GaitReadings, read_gait
from ppafo.control.fixed.walking_numbers import FIXED_WALKS, SIGN_BITS
from ppafo.control.fixed.whole_numbers import COMMAND_STEPS
from ppafo.control.walking.signs import SIGNS
from ppafo.engine.lanes import run_batch
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import batch_of
from ppafo.errors import ScenarioError
from ppafo.exports.firmware import TICK, ChipController, law_source, parameters_header, ticks_of
from ppafo.exports.firmware.catalog import MSP430G2553
from ppafo.exports.firmware.lock_step import Comparison, Cost, PythonChip, compare_with, cost_of
from ppafo.exports.firmware.simulators import ChipSimulator, Decision, chip_simulator
from ppafo.exports.firmware.walking.drawn import gait_readings
from ppafo.exports.templates import filled, licence, template
from ppafo.model.sensors import GaitMeasurement
from ppafo.model.valves.kind import VENT
from ppafo.simulation.reading import quantity_text
from ppafo.simulation.sampled import run_sampled, state_row_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.version import __version__
from ppafo.walking.declaration import ARITHMETIC, quantities
from ppafo.walking.events import SAFE_ROW
from ppafo.walking.planning import converter_of_walk, numbers_of_walk, plan_walk
from ppafo.walking.walk import lasting

_TEMPLATES = (
    "Makefile",
    "README.md",
    "board.h",
    "board_simulated.c",
    "controller.h",
    "host.c",
    "main.c",
    *MSP430G2553.templates,
)


def walk_chip(configuration: Scenario) -> ChipController:
    """The integer controller of a walk whose arithmetic is fixed.

    ScenarioError where it is not, or where the chip's timer or converter cannot do what it asks for.
    """
    name, period, given = configuration.name, configuration.control.period, configuration.control.settings
    if not configuration.control.is_fixed:
        if configuration.control.kind in FIXED_WALKS:
            raise ScenarioError(f"{name}: the controller computes with floats; set {ARITHMETIC}=fixed")
        raise ScenarioError(
            f"{name}: the controller '{configuration.control.kind}' has no form on whole numbers; those that have "
            f"one: {', '.join(FIXED_WALKS)}"
        )
    if given["converter_bits"] > MSP430G2553.converter_bits:
        raise ScenarioError(
            f"{name}: controller.converter_bits = {given['converter_bits']:g}: the converter of the chip has "
            f"{MSP430G2553.converter_bits}"
        )
    ticks = ticks_of(name, period)
    law = FIXED_WALKS[configuration.control.kind]
    numbers = numbers_of_walk(configuration)
    return ChipController(law=law, numbers=numbers, converter=converter_of_walk(configuration), ticks=ticks)


def walk_firmware(configuration: Scenario, target: str = WALK_TARGETS[0]) -> dict[str, bytes]:
    """Files of the firmware of a walk's controller, by name. ScenarioError where it has no integer form."""
    if target not in WALK_TARGETS:
        raise ScenarioError(f"{configuration.name}: a walk's firmware is for {', '.join(WALK_TARGETS)}, not '{target}'")
    chip = walk_chip(configuration)
    words = _words(configuration, chip, target)
    texts = {name: filled(template("firmware.walking", name), words) for name in _TEMPLATES}
    texts |= {name: template("firmware", name) for name in ("msp430.h", "start_msp430.c")}
    texts["LICENSE"] = licence()
    texts["controller.c"] = law_source(
        chip.law,
        f"The walking controller '{chip.law.name}' of ppafo {__version__} on whole numbers.",
        ("controller_readings readings", "given", ", ".join(f"readings.{name}" for name in GaitReadings._fields)),
        {"int16_t controller_level": "state.safety.level", "int16_t controller_sign": "state.safety.sign"},
    )
    bits, period = int(configuration.control.settings["converter_bits"]), configuration.control.period
    texts["parameters.h"] = parameters_header(
        f"the controller '{chip.law.name}' of the walk {configuration.name}, ppafo {__version__},",
        _origins(configuration),
        f"#define CONTROLLER_TICKS {chip.ticks}u /* of 125 us in a sample period of {period:.9g} s */\n"
        f"#define CONTROLLER_BITS {bits} /* of the converter; counts are of 14 bits */",
        chip.law,
        chip.numbers,
    )
    return {name: text.encode() for name, text in sorted(texts.items())}


def _words(configuration: Scenario, chip: ChipController, target: str) -> dict[str, str]:
    """What fills the templates."""
    given, converter = configuration.control.settings, chip.converter
    return {
        "title": configuration.name,
        "description": configuration.description,
        "kind": chip.law.name,
        "target": target,
        "version": __version__,
        "period": quantity_text(configuration.control.period, "s"),
        "force_zero": f"{given['force_zero']:.6g} N",
        "force_range": f"{given['force_range']:.6g} N",
        "force_step": f"{converter.force_step:.3g} N",
        "angle_range": f"{math.degrees(given['angle_range']):.4g} deg",
        "angle_step": f"{math.degrees(converter.angle_step):.3g} deg",
        "pressure_range": f"{given['converter_range'] / 1.0e3:.6g} kPa",
        "pressure_step": f"{converter.pressure_step / 1.0e3:.3g} kPa",
        "silence": f"{(2 * chip.ticks * TICK + 2.05e-3) * 1.0e3:.4g} ms",
        "signs": "\n".join(f"      {number:2.0f}  {sign.summary}" for number, sign in SIGNS.items()),
    }


def _origins(configuration: Scenario) -> Iterator[str]:
    """Settings that the numbers come from, each with unit and value in SI units."""
    declared = quantities(configuration.control.kind)
    yield f"period {configuration.control.period:.9g} s (controller.rate or controller.period of {configuration.name})"
    for name, value in configuration.control.settings.items():
        yield f"{name} {value:.9g} {declared[f'controller.{name}'].unit} (controller.{name})".replace("  ", " ")


_INSIDE = ("controller_state.", "gait_seen.")
"""What only the lanes keep: state of their controller, and the last readings."""


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

    def update(self, time: float, reference: float, measurement: GaitMeasurement) -> float:  # noqa: ARG002
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
    walked = lasting(configuration, minutes)
    run = plan_walk(walked)
    with chip_simulator(walk_firmware(configuration), MSP430G2553) as (simulator, image):
        law = ChipOfWalk(simulator, chip.converter)
        outside = run_sampled(batch_of(plan_walk(walked.controlled_by(law))), law)
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
    return compare_with(PythonChip(chip), given, samples, walk_firmware(configuration), MSP430G2553)
