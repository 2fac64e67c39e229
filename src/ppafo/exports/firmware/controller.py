"""The text of an integer controller for a small processor, and the proof that its numbers cannot overflow."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, get_type_hints

from ppafo.control.fixed.torque_laws import FixedLaw, WholeLaw
from ppafo.control.fixed.whole_numbers import COMMAND_STEPS, LARGEST_READING, Readings
from ppafo.engine.composed_names import is_row
from ppafo.engine.rows import is_number, leaf_paths, members
from ppafo.engine.source_text import SourceCollector
from ppafo.errors import ProgramError
from ppafo.model.declaration import Quantity
from ppafo.translation.c99 import c_source, documents_of
from ppafo.translation.typed import INT, Row
from ppafo.translation.walk import walk_module
from ppafo.translation.widths import Interval, Narrowed, Range, hull, narrowed
from ppafo.version import __version__

PRELUDE = "prelude_whole.h"


def proof(law: WholeLaw, numbers: Sequence[Quantity] | None = None) -> Narrowed:
    """The typed functions of a law in 16 and 32 bits, and the range of the command and of the next state.

    For every number within what ``numbers`` (those of the law) declare, every state within the ranges of the law and
    every reading. ProgramError where a value may leave 32 bits, or the next state its ranges.
    """
    collector = SourceCollector("")
    entry = collector.add(law.sample)
    parameters = _row(law.numbers, collector), _row(state_type(law), collector), _row(law.readings, collector)
    module = walk_module(collector.text(), {entry: parameters})
    declared = iter(numbers or law.number_quantities)
    given: dict[str, Range] = {
        "numbers": _nested(law.numbers, map(_range, declared)),
        "state": _nested(state_type(law), (Interval(*law.state_ranges[name]) for name in _leaf_names(state_type(law)))),
        "readings": (Interval(0, LARGEST_READING),) * len(members(law.readings)),
    }
    found = narrowed(module, given)
    allowed = Interval(-COMMAND_STEPS, COMMAND_STEPS)
    if not is_within(found.returned, (allowed, given["state"])):
        raise ProgramError(f"{law.name}: command and state may leave their ranges: {found.returned}")
    return found


def is_within(found: Range, allowed: Range) -> bool:
    """True where every number of a range lies within the same of another."""
    return hull(found, allowed) == allowed


def controller_source(law: FixedLaw) -> str:
    """The law in C, with a state of its own and the numbers of ``parameters.h``."""
    collector = SourceCollector("")
    entry = collector.add(law.sample)
    documents = documents_of(collector)
    title = f"The controller '{law.name}' of ppafo {__version__} on whole numbers. Not to be edited."
    text = c_source(proof(law).module, documents, title, prelude=PRELUDE)
    numbers, state, readings = (collector.add(item) for item in (law.numbers, state_type(law), Readings))
    names = [macro(item) for item in law.number_quantities]
    given = ", ".join(["{" + ", ".join(names[:2]) + "}", *names[2:]])
    begin = ", ".join(str(int(value)) for value in law.kind.initial)
    return f"""#include "controller.h"

#include "parameters.h"

{text}
static {state} state;

void controller_begin(void)
{{
    static const {state} begin = {{{begin}}};
    state = begin;
}}

int16_t controller_sample(int16_t reference, int16_t pressure_1, int16_t pressure_2)
{{
    static const {numbers} numbers = {{{given}}};
    const {readings} readings = {{reference, pressure_1, pressure_2}};
    const {entry}_result result = {entry}(numbers, state, readings);
    state = result.item_1;
    return result.item_0;
}}

bool controller_is_sound(void)
{{
    return state.sound == 1;
}}
"""


def macro(item: Quantity) -> str:
    """Name of a number in ``parameters.h``."""
    return f"CONTROLLER_{item.name.upper()}"


def defined_numbers(quantities: Iterable[Quantity], numbers: Mapping[str, float]) -> list[str]:
    """Lines of ``parameters.h`` that define the numbers of a law, and refuse one beyond its range."""
    lines = []
    for item in quantities:
        number = int(numbers[item.name])
        lines.append(f"#define {macro(item)} {number} /* {item.summary}; {item.minimum:g} to {item.maximum:g} */")
        lines += [f"#if {macro(item)} < {item.minimum:.0f} || {macro(item)} > {item.maximum:.0f}"]
        lines += [f'#error "{macro(item)} is beyond its range"', "#endif"]
    return lines


def state_type(law: WholeLaw) -> Any:
    """The NamedTuple class of the state of a law, which its function says."""
    return get_type_hints(law.sample)["state"]


def _nested(row: type, ranges: Iterator[Interval]) -> Range:
    """The ranges of a NamedTuple, nested ones in their place."""
    return tuple(next(ranges) if is_number(kind) else _nested(kind, ranges) for _, kind in members(row))


def _leaf_names(row: type) -> Iterator[str]:
    """Own names of all numbers of a NamedTuple, in order."""
    return (path.rpartition(".")[2] for path in leaf_paths(row, ""))


def _range(item: Quantity) -> Interval:
    return Interval(int(item.minimum), int(item.maximum))


def _row(kind: Any, collector: SourceCollector) -> Row:
    """A NamedTuple of whole numbers as the walk has it."""
    hints = get_type_hints(kind)
    fields = tuple((name, _row(hints[name], collector) if is_row(hints[name]) else INT) for name in kind._fields)
    return Row(collector.add(kind), fields)
