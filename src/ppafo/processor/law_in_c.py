"""Law of an integer controller in C: its translation, after a proof that no value exceeds its integer width."""

import re
from collections.abc import Iterator
from typing import Any, get_type_hints

from ppafo.engine.rows import is_number, is_row, leaf_paths, members, rebuilt
from ppafo.engine.source_text import SourceCollector
from ppafo.errors import ProgramError
from ppafo.model.declaration import Quantity
from ppafo.processor.fixed_point import COMMAND_STEPS, LARGEST_READING, ConverterCounts
from ppafo.processor.torque_laws.law import FixedLaw
from ppafo.translation.c99 import c_source, documents_of
from ppafo.translation.value_types import INT, Row
from ppafo.translation.walk import walk_module
from ppafo.translation.widths import IntegerRange, Narrowed, Range, hull, narrowed
from ppafo.version import __version__

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
    declared = (IntegerRange(int(quantity.minimum), int(quantity.maximum)) for quantity in law.number_quantities)
    own_names = (path.rpartition(".")[2] for path in leaf_paths(state, ""))
    ranges: dict[str, Range] = {
        "numbers": _nested(law.numbers, declared),
        "state": _nested(state, (IntegerRange(*law.state_ranges[name]) for name in own_names)),
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


def _nested(row: type, ranges: Iterator[IntegerRange]) -> Range:
    """Arrange ranges of numbers in the nested form of a NamedTuple."""
    return tuple(next(ranges) if is_number(kind) else _nested(kind, ranges) for _, kind in members(row))


def _typed_row(kind: Any, collector: SourceCollector) -> Row:
    """Return the row type of a NamedTuple of integers."""
    hints = get_type_hints(kind)
    fields = tuple((name, _typed_row(hints[name], collector) if is_row(hints[name]) else INT) for name in kind._fields)
    return Row(collector.add(kind), fields)
