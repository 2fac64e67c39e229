"""Whole numbers in 16 and 32 bits: what the proof refuses, and that no value is ever outside of it."""

import random
from typing import Any, NamedTuple

import pytest

from ppafo.engine.source_text import SourceCollector
from ppafo.errors import ProgramError
from ppafo.translation.c99 import c_source
from ppafo.translation.typed import Module
from ppafo.translation.value_types import INT, INT16, INT32
from ppafo.translation.walk import walk_module
from ppafo.translation.widths import IntegerRange, hull, narrowed


class Pair(NamedTuple):
    """Two whole numbers."""

    first: int
    second: int


def doubled_up(value: int, places: int) -> int:
    """``value`` times two, some times over."""
    total = value
    for _ in range(places):
        total = total + total
    return total


def chosen(value: int, places: int) -> int:
    """One of three ways, with a difference that is wider than what it is made of."""
    size = max(value, -value)
    found = (size - places) * 4 if size > places else -3
    return min(found, 1000) if value > 0 else (found >> 2) + (value & 7)


def paired(value: int, places: int) -> tuple[int, Pair]:
    """A tuple with a row in it."""
    both = Pair(value, places)
    low, pair = both.first >> 1, Pair(both.second, both.first)
    return low, pair


def product(value: int, places: int) -> int:
    """A product of two numbers."""
    return value * places


def module_of(function: Any) -> Module:
    """A function as typed terms."""
    collector = SourceCollector("")
    name = collector.add(function)
    return walk_module(collector.text(), {name: (INT, INT)})


def given(low: int, high: int, most: int) -> dict[str, Any]:
    """Ranges of the two parameters."""
    return {"value": IntegerRange(low, high), "places": IntegerRange(0, most)}


def test_what_may_leave_32_bits_is_refused_and_what_just_does_not_is_not() -> None:
    assert narrowed(module_of(doubled_up), given(0, 2**15 - 1, 16)).returned == IntegerRange(0, (2**15 - 1) * 2**16)
    with pytest.raises(
        ProgramError, match=r"doubled_up: .*a value may range from 0 to 2147483648, which does not fit in 32 bits"
    ):
        narrowed(module_of(doubled_up), given(0, 2**15, 16))


def test_a_name_is_as_wide_as_what_it_holds() -> None:
    def types(most: int) -> dict[str, Any]:
        function = narrowed(module_of(doubled_up), given(-5, 5, most)).module[0]
        assert function.returns is not None
        return dict(function.parameters) | {"": function.returns}

    assert types(3) == {"value": INT16, "places": INT16, "": INT16}
    assert types(20) == {"value": INT16, "places": INT16, "": INT32}


def test_a_product_that_is_no_power_of_two_is_refused() -> None:
    with pytest.raises(ProgramError, match="a product must have a power of two as one factor"):
        narrowed(module_of(product), given(0, 3, 3))


def test_a_loop_that_is_too_long_is_refused() -> None:
    with pytest.raises(ProgramError, match="at most 64 iterations"):
        narrowed(module_of(doubled_up), given(0, 0, 65))


@pytest.mark.parametrize("function", [doubled_up, chosen, paired])
def test_no_value_is_ever_outside_of_its_range(function: Any) -> None:
    found = narrowed(module_of(function), given(-300, 200, 9)).returned
    draw = random.Random(2)
    for _ in range(2000):
        result = function(draw.randint(-300, 200), draw.randint(0, 9))
        exact = _points(result)
        assert hull(found, exact) == found


def _points(value: Any) -> Any:
    return tuple(map(_points, value)) if isinstance(value, tuple) else IntegerRange(value, value)


def test_tuples_and_rows_have_the_widths_of_what_they_hold() -> None:
    text = c_source(narrowed(module_of(paired), given(0, 2**20, 5)).module, {}, "Pairs.", prelude="prelude_whole.h")
    assert "int32_t first" in text
    assert "int64_t" not in text
    assert "double" not in text
