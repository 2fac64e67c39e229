"""Firmware of a controller for the paper's processor, an MSP430F2013: law in C, numbers, board layer, make file.

The law is translated after a proof that no value exceeds its integer width.
"""

import re
from typing import Any, get_type_hints

from ppafo.control.catalog import CONTROLLERS
from ppafo.engine.rows import is_row, leaves, rebuilt
from ppafo.engine.source_text import SourceCollector
from ppafo.errors import ProgramError
from ppafo.exports import filled, in_markdown, template
from ppafo.model.declaration import Quantity, quantities_of
from ppafo.parameters.plant import plant_parameters
from ppafo.processor.controller import TICK, FixedPointController, fixed_point_controller
from ppafo.processor.fixed_point import COMMAND_STEPS, LARGEST_READING, SETTINGS, ConverterCounts
from ppafo.processor.torque_laws.law import FixedLaw
from ppafo.simulation.scenario import Scenario
from ppafo.translation.c99 import c_source, documents_of
from ppafo.translation.value_types import INT, Row
from ppafo.translation.walk import walk_module
from ppafo.translation.widths import IntegerRange, Narrowed, Range, hull, narrowed
from ppafo.units.shown import written_text
from ppafo.version import __version__

_LONGEST_FEEDING = 2.05e-3
"""Time after which the watchdog resets a processor that does not feed it [s]."""
_TEMPLATES = (
    *("Makefile", "README.md", "board.h", "board_msp430f2013.c", "board_simulated.c", "controller.h", "host.c"),
    *("main.c", "msp430f2013.ld", "start_msp430.c"),
)
PRELUDE = "prelude_whole.h"
_NUMBER = r"(?:bool|int16_t|int32_t) \w+"
_OF_NUMBERS = re.compile(rf"^PPAFO_INLINE(?= {_NUMBER}\((?:{_NUMBER},\s+)*{_NUMBER}\)$)", re.MULTILINE)
"""Pattern of the qualifier of a C function whose parameters and result are numbers."""


def law_source(law: FixedLaw) -> str:
    """Return the C source of a law, with its state and the numbers of ``parameters.h``."""
    collector = SourceCollector("")
    entry = collector.add(law.sample)
    documents = documents_of(collector)
    title = f"The controller '{law.kind.name}' of ppafo {__version__} in fixed point. Not to be edited."
    text = c_source(proof(law).module, documents, title, prelude=PRELUDE)
    text = _OF_NUMBERS.sub("PPAFO_CALLED", text)
    numbers, state, readings = (
        collector.add(row_type) for row_type in (law.numbers, type(law.begins), ConverterCounts)
    )
    numbers_in_c = rebuilt(law.numbers, [macro(quantity) for quantity in law.number_quantities])
    parameters = ", ".join(f"int16_t {name}" for name in ConverterCounts._fields)
    return f"""#include "controller.h"

#include "parameters.h"

{text}
static {state} state;

void controller_begin(void)
{{
    static const {state} begin = {_written(law.begins)};
    state = begin;
}}

int16_t controller_sample({parameters})
{{
    static const {numbers} numbers = {_written(numbers_in_c)};
    const {readings} readings = {{{", ".join(ConverterCounts._fields)}}};
    const {entry}_result result = {entry}(numbers, state, readings);
    state = result.item_1;
    return result.item_0;
}}

bool controller_is_sound(void)
{{
    return state.sound == 1;
}}
"""


def _written(row: Any) -> str:
    """Return the C initialiser of a NamedTuple, nested NamedTuples included."""
    return "{" + ", ".join(_written(part) if isinstance(part, tuple) else str(part) for part in row) + "}"


def macro(quantity: Quantity) -> str:
    """Return the macro name of a number in ``parameters.h``."""
    return f"CONTROLLER_{quantity.name.upper()}"


def proof(law: FixedLaw) -> Narrowed:
    """Prove the integer widths of a law; return its typed functions, and ranges of command and next state.

    The proof covers every number of the law in its declared range, every state in the ranges of the law, and every
    reading. Raises ProgramError if a value may exceed 32 bits, or the next state its ranges.
    """
    collector = SourceCollector("")
    entry = collector.add(law.sample)
    state = type(law.begins)
    parameters = tuple(_typed_row(row, collector) for row in (law.numbers, state, ConverterCounts))
    module = walk_module(collector.text(), {entry: parameters})
    ranges: dict[str, Range] = {
        "numbers": declared(law.numbers),
        "state": declared(state),
        "readings": (IntegerRange(0, LARGEST_READING),) * len(ConverterCounts._fields),
    }
    proved = narrowed(module, ranges)
    allowed: Range = (IntegerRange(-COMMAND_STEPS, COMMAND_STEPS), ranges["state"])
    # Within it where the hull of both is no wider.
    if hull(proved.returned, allowed) != allowed:
        raise ProgramError(
            f"{law.kind.name}: in fixed-point arithmetic, the command or the state can leave its allowed range: "
            f"{proved.returned}"
        )
    return proved


def declared(row: type) -> Range:
    """Return the declared ranges of the numbers of a NamedTuple, nested as it is."""
    quantities = quantities_of(row)
    ranges: Range = rebuilt(
        row, (IntegerRange(int(quantity.minimum), int(quantity.maximum)) for quantity in quantities)
    )
    return ranges


def _typed_row(kind: Any, collector: SourceCollector) -> Row:
    """Return the row type of a NamedTuple of integers."""
    hints = get_type_hints(kind)
    fields = tuple((name, _typed_row(hints[name], collector) if is_row(hints[name]) else INT) for name in kind._fields)
    return Row(collector.add(kind), fields)


def firmware(scenario: Scenario) -> dict[str, bytes]:
    """Return the firmware files of a controller by name. Raises ScenarioError without an integer form."""
    fixed = fixed_point_controller(scenario)
    scenario = fixed.scenario
    steps = fixed.steps
    top, middle = fixed.numbers.limits
    words = {
        "title": scenario.name,
        "description": in_markdown(scenario.description),
        "kind": fixed.law.kind.name,
        "version": __version__,
        "period": written_text(scenario.controller.period, "s"),
        "range": f"{scenario.controller.settings[SETTINGS[1].name] / 1.0e3:.6g} kPa",
        "step": f"{steps.pressure_step:.4g} Pa",
        "torque_step": f"{steps.torque_step * 1.0e3:.4g} mN m",
        "lowest": f"{-middle * steps.torque_step:.4g} N m",
        "highest": f"{(top - middle) * steps.torque_step:.4g} N m",
        "silence": f"{(2 * fixed.ticks * TICK + _LONGEST_FEEDING) * 1.0e3:.4g} ms",
    }
    texts = {name: filled(template("ppafo.processor", name), words) for name in _TEMPLATES}
    texts["LICENSE"] = template("ppafo.exports.c_library", "LICENSE")
    texts["controller.c"] = law_source(fixed.law)
    texts["parameters.h"] = parameters_header(fixed)
    return {name: text.encode() for name, text in sorted(texts.items())}


def parameters_header(fixed: FixedPointController) -> str:
    """Return ``parameters.h``: the numbers of a law with unit, meaning, origin and range check."""
    scenario = fixed.scenario
    law = fixed.law
    control = scenario.controller
    declared = {quantity.name: quantity for quantity in CONTROLLERS[control.kind].quantities}
    source = scenario.origin.file or "a scenario without a file"
    settings = (
        f"{name} {value:.9g} {declared[name].unit} (controller.{name})".replace("  ", " ")
        for name, value in control.settings.items()
    )
    constant = plant_parameters(scenario.device, 0.0).torque_constant
    lines = [
        f"/* Numbers of the controller '{law.kind.name}' of {scenario.name}, made by ppafo {__version__} from:",
        f" *   period {control.period:.9g} s (controller.rate or controller.period of {source.rpartition('/')[2]})",
        *(f" *   {line}" for line in settings),
        f" *   torque over pressure {constant:.9g} N m/Pa (actuator of the set {scenario.origin.parameter_set})",
        " * Every number must stay within its range: for that the arithmetic is proved not to overflow. */",
        "#ifndef PPAFO_PARAMETERS_H",
        "#define PPAFO_PARAMETERS_H",
        "",
        f"#define CONTROLLER_TICKS {fixed.ticks}u /* of 125 us in a sample period of {control.period:.9g} s */",
        f"#define CONTROLLER_BITS {int(control.settings[SETTINGS[0].name])} /* of the converter */",
    ]
    for quantity, number in zip(law.number_quantities, leaves(fixed.numbers), strict=True):
        lines.append(
            f"#define {macro(quantity)} {number} /* {quantity.summary}; {quantity.minimum:g} to {quantity.maximum:g} */"
        )
        # A user may edit this file: the proof that nothing overflows holds within these ranges only.
        lines += [f"#if {macro(quantity)} < {quantity.minimum:.0f} || {macro(quantity)} > {quantity.maximum:.0f}"]
        lines += [f'#error "{macro(quantity)} is beyond its range"', "#endif"]
    return "\n".join([*lines, "", "#endif", ""])
