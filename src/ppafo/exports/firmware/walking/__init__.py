"""The controller of a walk as firmware: translated C, a thin layer for an MSP430G2553, make file and page."""

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from ppafo.control.fixed.torque_laws import WALK_TARGETS
from ppafo.control.fixed.walking_law import GaitConverter
from ppafo.control.fixed.walking_numbers import FIXED_WALKS, FixedWalk
from ppafo.control.walking.signs import SIGNS
from ppafo.engine.rows import rebuilt
from ppafo.engine.source_text import SourceCollector
from ppafo.errors import ScenarioError
from ppafo.exports.firmware import MOST_TICKS, PRELUDE, TICK, defined_numbers, macro, proof, state_type
from ppafo.exports.firmware.catalog import MSP430G2553
from ppafo.exports.templates import filled, licence, template
from ppafo.simulation.reading import quantity_text
from ppafo.simulation.scenario import Scenario
from ppafo.translation.c99 import c_source, documents_of
from ppafo.version import __version__
from ppafo.walking.declaration import ARITHMETIC, quantities
from ppafo.walking.planning import converter_of_walk, numbers_of_walk

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


class WalkChip(NamedTuple):
    """The integer controller of a walk: law, whole numbers by name, converter, ticks of a sample."""

    law: FixedWalk
    numbers: Mapping[str, float]
    converter: GaitConverter
    ticks: int

    @property
    def of_law(self) -> Any:
        """The numbers as the law takes them."""
        return rebuilt(self.law.numbers, [int(value) for value in self.numbers.values()])


def walk_chip(configuration: Scenario) -> WalkChip:
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
    ticks = round(period / TICK)
    if not 1 <= ticks <= MOST_TICKS // 2 or abs(ticks * TICK - period) > 1.0e-9 * period:
        raise ScenarioError(
            f"{name}: controller.period = {period:.9g} s: on the chip a multiple of 0.125 ms, "
            f"up to {MOST_TICKS // 2 * TICK:.3g} s"
        )
    law = FIXED_WALKS[configuration.control.kind]
    numbers = numbers_of_walk(configuration)
    return WalkChip(law=law, numbers=numbers, converter=converter_of_walk(configuration), ticks=ticks)


def walk_firmware(configuration: Scenario, target: str = WALK_TARGETS[0]) -> dict[str, bytes]:
    """Files of the firmware of a walk's controller, by name. ScenarioError where it has no integer form."""
    if target not in WALK_TARGETS:
        raise ScenarioError(f"{configuration.name}: a walk's firmware is for {', '.join(WALK_TARGETS)}, not '{target}'")
    chip = walk_chip(configuration)
    words = _words(configuration, chip, target)
    texts = {name: filled(template("firmware.walking", name), words) for name in _TEMPLATES}
    texts |= {name: template("firmware", name) for name in ("msp430.h", "start_msp430.c")}
    texts["LICENSE"] = licence()
    texts["controller.c"] = walk_source(chip.law)
    texts["parameters.h"] = _parameters(configuration, chip)
    return {name: text.encode() for name, text in sorted(texts.items())}


def walk_source(law: FixedWalk) -> str:
    """The law in C, with a state of its own and the numbers of ``parameters.h``."""
    collector = SourceCollector("")
    entry = collector.add(law.sample)
    documents = documents_of(collector)
    title = f"The walking controller '{law.name}' of ppafo {__version__} on whole numbers. Not to be edited."
    text = c_source(proof(law).module, documents, title, prelude=PRELUDE)
    numbers, state, readings = (collector.add(item) for item in (law.numbers, state_type(law), law.readings))
    given = rebuilt(law.numbers, [macro(item) for item in law.number_quantities])
    fields = ", ".join(f"readings.{name}" for name in law.readings.__annotations__)
    return f"""#include "controller.h"

#include "parameters.h"

{text}
static {state} state;

void controller_begin(void)
{{
    static const {state} begin = {_written(law.begins)};
    state = begin;
}}

int16_t controller_sample(controller_readings readings)
{{
    static const {numbers} numbers = {_written(given)};
    const {readings} given = {{{fields}}};
    const {entry}_result result = {entry}(numbers, state, given);
    state = result.item_1;
    return result.item_0;
}}

int16_t controller_level(void)
{{
    return state.safety.level;
}}

int16_t controller_sign(void)
{{
    return state.safety.sign;
}}
"""


def _written(row: Any) -> str:
    """A NamedTuple as C initialises it, nested ones in their place."""
    return "{" + ", ".join(_written(item) if isinstance(item, tuple) else str(item) for item in row) + "}"


def _words(configuration: Scenario, chip: WalkChip, target: str) -> dict[str, str]:
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


def _parameters(configuration: Scenario, chip: WalkChip) -> str:
    """The header with every number of the law, its unit, meaning and origin."""
    bits, period = int(configuration.control.settings["converter_bits"]), configuration.control.period
    lines = [
        f"/* Numbers of the controller '{chip.law.name}' of the walk {configuration.name}, ppafo {__version__}, from:",
        *(f" *   {line}" for line in _origins(configuration)),
        " * Every number must stay within its range: for that the arithmetic is proved not to overflow. */",
        "#ifndef PPAFO_PARAMETERS_H",
        "#define PPAFO_PARAMETERS_H",
        "",
        f"#define CONTROLLER_TICKS {chip.ticks}u /* of 125 us in a sample period of {period:.9g} s */",
        f"#define CONTROLLER_BITS {bits} /* of the converter; counts are of 14 bits */",
    ]
    return "\n".join([*lines, *defined_numbers(chip.law.number_quantities, chip.numbers), "", "#endif", ""])


def _origins(configuration: Scenario) -> Iterator[str]:
    """Settings that the numbers come from, each with unit and value in SI units."""
    declared = quantities(configuration.control.kind)
    yield f"period {configuration.control.period:.9g} s (controller.rate or controller.period of {configuration.name})"
    for name, value in configuration.control.settings.items():
        yield f"{name} {value:.9g} {declared[f'controller.{name}'].unit} (controller.{name})".replace("  ", " ")
