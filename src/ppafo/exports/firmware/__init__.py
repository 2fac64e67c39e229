"""A scenario's controller as firmware for a small processor: translated C, a thin layer, make file and page."""

import re
from collections.abc import Iterator, Mapping
from importlib.resources import files
from typing import NamedTuple

from ppafo.control.catalog import CONTROLLERS
from ppafo.control.fixed.torque_laws import FIXED_LAWS, TARGETS, FixedLaw
from ppafo.control.fixed.whole_numbers import SETTINGS, Converter
from ppafo.engine.rows import rebuilt
from ppafo.errors import ScenarioError
from ppafo.exports.firmware.catalog import target_of
from ppafo.exports.firmware.controller import controller_source, defined_numbers
from ppafo.exports.firmware.target import Target
from ppafo.model.declaration import Quantity
from ppafo.parameters.plant import plant_parameters
from ppafo.simulation.fixed_point import fixed_controller
from ppafo.simulation.plan import plan_run, profile_bounds
from ppafo.simulation.reading import quantity_text
from ppafo.simulation.scenario import Scenario
from ppafo.version import __version__

TICK = 125.0e-6
"""What a sample period must be a multiple of [s]: one pulse of the timer."""
MOST_TICKS = 32767
_MARK = re.compile(r"@(\w+)@")
_TEMPLATES = ("Makefile", "README.md", "board.h", "board_simulated.c", "controller.h", "host.c", "main.c")


class ChipController(NamedTuple):
    """The integer controller of a scenario: law, whole numbers by name, converter, ticks of a sample."""

    law: FixedLaw
    numbers: Mapping[str, float]
    converter: Converter
    ticks: int


def chip_controller(scenario: Scenario) -> ChipController:
    """The integer controller of a scenario whose arithmetic is fixed.

    ScenarioError where it is not, or where the timer of a chip cannot make the sample period.
    """
    control = scenario.control
    if not control.is_fixed:
        if control.kind in FIXED_LAWS:
            raise ScenarioError(
                f"{scenario.name}: the controller computes with floats; set controller.arithmetic=fixed"
            )
        raise ScenarioError(
            f"{scenario.name}: the controller '{control.kind}' has no form on whole numbers; those that have one: "
            f"{', '.join(FIXED_LAWS)}"
        )
    plan_run(scenario)
    ticks = round(control.period / TICK)
    if not 1 <= ticks <= MOST_TICKS // 2 or abs(ticks * TICK - control.period) > 1.0e-9 * control.period:
        raise ScenarioError(
            f"{scenario.name}: controller.period = {control.period:.9g} s: on the chip a multiple of 0.125 ms, "
            f"up to {MOST_TICKS // 2 * TICK:.3g} s"
        )
    constant = plant_parameters(scenario.device, 0.0).torque_constant
    found = fixed_controller(scenario, constant, profile_bounds(scenario.reference))
    converter = rebuilt(Converter, [found.numbers[name] for name in Converter._fields])
    return ChipController(law=FIXED_LAWS[control.kind], numbers=found.numbers, converter=converter, ticks=ticks)


def firmware(scenario: Scenario, target: str = TARGETS[0]) -> dict[str, bytes]:
    """Files of the firmware of a scenario's controller, by name. ScenarioError where it has no integer form."""
    chosen = target_of(target)
    chip = chip_controller(scenario)
    words = _words(scenario, chip, chosen)
    words["wiring"] = _filled(chosen.wiring, words).rstrip()
    texts = {name: _filled(name, words) for name in (*_TEMPLATES, *chosen.templates)}
    texts["LICENSE"] = files("ppafo.exports.c_library").joinpath("templates", "LICENSE").read_text(encoding="utf-8")
    texts["controller.c"] = controller_source(chip.law)
    texts["parameters.h"] = _parameters(scenario, chip)
    return {name: text.encode() for name, text in sorted(texts.items())}


def _filled(name: str, words: Mapping[str, str]) -> str:
    text = files("ppafo.exports.firmware").joinpath("templates", name).read_text(encoding="utf-8")
    return _MARK.sub(lambda found: words[found[1]], text)


def _words(scenario: Scenario, chip: ChipController, target: Target) -> dict[str, str]:
    """What fills the templates."""
    converter = chip.converter
    return {
        "title": scenario.name,
        "description": scenario.description,
        "kind": chip.law.name,
        "target": target.name,
        "processor": target.processor,
        "board": target.board,
        "own_bits": str(target.converter_bits),
        "version": __version__,
        "period": quantity_text(scenario.control.period, "s"),
        "range": f"{scenario.control.settings[SETTINGS[1].name] / 1.0e3:.6g} kPa",
        "step": f"{converter.pressure_step:.4g} Pa",
        "torque_step": f"{converter.torque_step * 1.0e3:.4g} mN m",
        "lowest": f"{-converter.middle * converter.torque_step:.4g} N m",
        "highest": f"{(converter.top - converter.middle) * converter.torque_step:.4g} N m",
        "silence": f"{(2 * chip.ticks * TICK + 2.05e-3) * 1.0e3:.4g} ms",
        **target.words,
    }


def _parameters(scenario: Scenario, chip: ChipController) -> str:
    """The header with every number of the law, its unit, meaning and origin."""
    control = scenario.control
    lines = [
        f"/* Numbers of the controller '{chip.law.name}' of {scenario.name}, made by ppafo {__version__} from:",
        *(f" *   {line}" for line in _origins(scenario)),
        " * Every number must stay within its range: for that the arithmetic is proved not to overflow. */",
        "#ifndef PPAFO_PARAMETERS_H",
        "#define PPAFO_PARAMETERS_H",
        "",
        f"#define CONTROLLER_TICKS {chip.ticks}u /* of 125 us in a sample period of {control.period:.9g} s */",
        f"#define CONTROLLER_BITS {int(control.settings[SETTINGS[0].name])} /* of the converter */",
    ]
    return "\n".join([*lines, *defined_numbers(chip.law.number_quantities, chip.numbers), "", "#endif", ""])


def _origins(scenario: Scenario) -> Iterator[str]:
    """Settings that the numbers come from, each with unit and value in SI units."""
    control = scenario.control
    declared: dict[str, Quantity] = {item.name: item for item in (*CONTROLLERS[control.kind].quantities, *SETTINGS)}
    source = scenario.origin.file or "a scenario without a file"
    yield f"period {control.period:.9g} s (controller.rate or controller.period of {source.rpartition('/')[2]})"
    for name, value in control.settings.items():
        yield f"{name} {value:.9g} {declared[name].unit} (controller.{name})".replace("  ", " ")
    constant = plant_parameters(scenario.device, 0.0).torque_constant
    yield f"torque over pressure {constant:.9g} N m/Pa (actuator of the set {scenario.origin.parameter_set})"
