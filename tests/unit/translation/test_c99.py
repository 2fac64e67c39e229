"""C99 from the composed module: the bits of Python and of the lanes, without a warning, and nothing guessed."""

import math
import random
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from ppafo.engine.entries import INLINE
from ppafo.engine.lanes import run_batch
from ppafo.engine.source_text import SourceCollector
from ppafo.errors import ProgramError
from ppafo.simulation.plan import plan_run
from ppafo.translation.c99 import c_source
from ppafo.translation.native_entries import parameters_of
from ppafo.translation.walk import walk_module
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import with_duration
from scripts.bits import digest, drawn_batch, failures, plain_batch
from scripts.built_programs import build, program_source, run_native
from tests.composed_programs import drawn_programs

WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Werror", "-fsyntax-only", "-ffp-contract=off")
ENTRY = '@entry("void(float64[:, ::1], float64[:, ::1])")'
needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")


def module_of(function: Callable[..., Any], given: str, results: int) -> str:
    """A composed module whose ``advance`` calls a function for each column of ``x`` and writes its results to ``y``."""
    collector = SourceCollector(INLINE)
    name = collector.add(function)
    lines = [f"        {', '.join(f'y[{row}, lane]' for row in range(results))} = {name}({given})"]
    if results > 1:
        lines = [f"        result = {name}({given})"]
        lines += [f"        y[{row}, lane] = result[{row}]" for row in range(results)]
    loop = [f"{ENTRY}\ndef advance(x, y):", "    for lane in range(x.shape[1]):", *lines]
    return "\n".join(["from collections import namedtuple", collector.text(), *loop])


def in_c(function: Callable[..., Any], given: str, results: int, columns: Any, folder: Path) -> Any:
    """Results (results, runs) of a function in C for the columns (numbers, runs)."""
    found = np.zeros((results, columns.shape[1]))
    built(module_of(function, given, results), folder).advance(np.ascontiguousarray(columns), found)
    return found


def built(composed: str, folder: Path) -> Any:
    """A composed module by gcc, which stops where the C does what is not defined."""
    source = c_source(walk_module(composed), {}, "A test.")
    strict = ("-std=c99", "-O2", "-fsanitize=undefined", "-fno-sanitize-recover=all", "-Wall", "-Wextra", "-Werror")
    return build(source, folder, flags=strict, parameters=parameters_of(composed))


def whole_numbers(left: float, right: float) -> tuple[float, float, float, float, float]:
    """Quotient, remainder, wrapped product, shift and bits of whole numbers."""
    one, other = int(left), int(right)
    product = (one * 0x7FEB352D & 0xFFFFFFFF) * 0x7FEB352D
    return float(one // other), float(one % other), float(product & 0xFFFFFFFF), float(one >> 3), float(one ^ other | 5)


def order(left: float, right: float) -> tuple[float, float, float]:
    """Smaller, larger and size, which tell zeros and missing numbers apart by order."""
    return min(left, right), max(left, right, 1.0), abs(left)


class Pair(NamedTuple):
    """Two numbers."""

    signed: float
    double: float


def swapped(pair: Pair, scale: float) -> Pair:
    """The pair the other way round, with names that C reserves."""
    signed, double = pair
    signed, double = double * scale, signed
    return Pair(double=double, signed=signed)


def loops(first: float, last: float) -> tuple[float, float, float]:
    """A loop that is left, one that is not, and a name that lives beyond its loop."""
    total, found = 0, 0.0
    for number in range(int(first), int(last)):
        if number % 7 == 3:
            total = number
            break
        total += number
    else:
        found = 1.0
    for part in (first, last, 0.5)[1:]:
        found += part
    size = int(last) - 80
    for place in range(size):
        size -= 2
        found += place
    number = 0
    while True:
        number += 1
        if float(number * number) > last:
            break
    pair = swapped(Pair(found, float(number)), 2.0)
    return float(total), pair.signed, pair.double


@needs_gcc
@pytest.mark.parametrize("function", [whole_numbers, order, loops])
def test_c_has_the_bits_of_python(function: Callable[..., Any], tmp_path: Path) -> None:
    draw = random.Random(3)
    special = [(-7.0, 2.0), (7.0, -2.0), (-8.0, 2.0), (-1.0, -3.0), (1.0e9, 3.0), (0.0, 1.0)]
    if function is order:
        special += [(0.0, -0.0), (-0.0, 0.0), (math.nan, 1.0), (1.0, math.nan), (math.inf, -math.inf)]
    drawn = [(float(draw.randint(-50, 50)), float(draw.randint(1, 90))) for _ in range(200)]
    columns = np.array([*special, *drawn]).T
    expected = [function(*column) for column in columns.T.tolist()]
    found = in_c(function, "x[0, lane], x[1, lane]", len(expected[0]), columns, tmp_path)
    assert found.T.tobytes() == np.array(expected).tobytes()


class Made(NamedTuple):
    """Fields with names that C, or what is written around them, has too."""

    made: float
    double: float
    double_: float


def twice(value: float) -> float:
    """Called with a whole number and with another, so that there are two of it."""
    return value + value


def twice_2(value: float) -> float:
    """Has the name that the second of those might get."""
    return 3.0 * value


BILLIONS = 2_000_000_000


def names_of_c(left: float, right: float) -> tuple[float, float, float, float]:
    """Names that C, C++ or a header has, beside those that they might get instead."""
    int64_t, NAN, static_assert, char16_t = left, right, 2.0, 3.0  # noqa: N806
    double, double_, dynamic_cast, thread_local, alignas = left, 10.0 * right, 5.0, 6.0, 7.0
    row = Made(left, right, 3.0)
    row = row if left > 0.0 else Made(right, left, row.double_)
    held = twice(int(left)) + twice(right) + twice_2(left)
    total = int64_t + NAN + static_assert * char16_t + dynamic_cast + thread_local + alignas
    return total, double + double_, row.made + 10.0 * row.double + 100.0 * row.double_, held


def whole_and_places(left: float, right: float) -> tuple[float, float, float, float]:
    """Whole numbers beyond 32 bits, and places that may be negative."""
    wide = 2147483647 + (left > 0.0)
    items = (left, right, 5.0)
    place = 0 if left > 0.0 else 1
    items = (*items[1:], left + 1.0)
    _ = left
    _, last = right, left
    return float(BILLIONS + BILLIONS + wide), items[place - 1], items[-place], _ + 10.0 * last


def loops_in_loops(left: float, right: float) -> tuple[float, float, float]:
    """Ends of nested loops that change under way, with one name."""
    outer, inner, total, other = int(left), int(right), 0.0, 0.0
    for i in range(outer):
        outer -= 1
        total += i
        for _ in range(2):
            for i in range(inner):  # noqa: B007, PLW2901
                inner -= 1
                total += 100.0
    for j in range(int(left)):
        for j in range(int(right)):  # noqa: B007, PLW2901
            other += 1.0
    return total, other, float(inner)


def all_of_them(left: float, right: float) -> tuple[float, ...]:
    """The results of the three, in one tuple."""
    return (*names_of_c(left, right), *whole_and_places(left, right), *loops_in_loops(left, right))


@needs_gcc
def test_c_has_the_bits_of_python_where_its_own_names_numbers_and_places_are_others(tmp_path: Path) -> None:
    columns = np.array([(3.0, 7.0), (0.0, 0.0), (-0.0, 1.0), (1.0, -2.0), (2.0, 5.0)]).T
    found = in_c(all_of_them, "x[0, lane], x[1, lane]", 11, columns, tmp_path)
    assert found.T.tobytes() == np.array([all_of_them(*column) for column in columns.T.tolist()]).tobytes()


ROWS_OF_BLOCKS = f"""
@inline
def note(x, y, first, lane):
    y[first, lane], y[first + 1, lane] = y[first + 1, lane], y[first, lane]
    y[first, lane], kept = swapped(x[first, lane], x[first + 1, lane])
    y[first + 1, lane] += kept

@inline
def swapped(left, right):
    return right, left

{ENTRY}
def advance(x, y):
    \"\"\"Two rows of each block.\"\"\"
    for block in range(x.shape[0] // 2):
        rows = y[2 * block : 2 * (block + 1)]
        for lane in range(rows.shape[1]):
            note(x, y, 2 * block, lane)
            rows[rows.shape[0] - 1, lane] *= 2.0
"""


@needs_gcc
def test_a_call_that_returns_nothing_is_done_and_parts_of_arrays_are_written_in_place(tmp_path: Path) -> None:
    scope: dict[str, Any] = {"inline": lambda function: function, "entry": lambda _types: lambda function: function}
    exec(ROWS_OF_BLOCKS, scope)
    columns, found, expected = np.arange(1.0, 13.0).reshape(4, 3), np.ones((4, 3)), np.ones((4, 3))
    scope["advance"](columns, expected)
    built(ROWS_OF_BLOCKS, tmp_path).advance(columns, found)
    assert found.tolist() == expected.tolist() != np.ones((4, 3)).tolist()


def exponential(value: float) -> float:
    """Needs a library."""
    return math.exp(value)


def thrown_away(value: float) -> float:
    """What another function returns is not taken."""
    twice(value)
    return value


def remainder(value: float) -> float:
    """The remainder of numbers that are not whole is a library function in C."""
    return value % 0.3


def two_forms(value: float) -> float:
    """A name that holds a number, then a tuple."""
    held = value
    held = (value, value)
    return held[0]


def value_of_or(value: float) -> float:
    """In Python one of the two, in C whether one is not zero."""
    return value or 3.0


def whole_and_float(value: float) -> float:
    """0 has no sign, 0.0 has one."""
    number = int(value)
    number = value if value > 3.0 else float(-number)
    return number  # noqa: RET504


def returns_of_types(value: float) -> float:
    """The same in what a function returns."""
    if value > 3.0:
        return value
    return 0


def shift_by_name(value: float) -> float:
    """C leaves shifts by 64 and more undefined."""
    return float(5 >> int(value))


def compared_types(value: float) -> float:
    """Python compares exactly, C rounds the whole number first."""
    return 1.0 if int(value) == value else 0.0


def beyond(value: float) -> float:
    """An item that is not there."""
    return (value, value)[2]  # noqa: PLE0643


def without_end(value: float) -> float:
    """Calls itself."""
    return without_end(value)


TYPES = "both an integer and a float"


@pytest.mark.parametrize(
    ("function", "line", "said"),
    [
        (
            exponential,
            2,
            r"the function 'math.exp' is not supported, .* decay_factors\(rate, step\) of ppafo.model.sensors",
        ),
        (thrown_away, 2, "discards its return value"),
        (remainder, 2, "has no equivalent in C"),
        (two_forms, 3, "'held' is assigned values of different types"),
        (value_of_or, 2, "the operands of 'value or 3.0' must be booleans"),
        (whole_and_float, 3, f"'number' is assigned {TYPES}"),
        (returns_of_types, 4, f"returns {TYPES}"),
        (shift_by_name, 2, "must shift by an integer literal"),
        (compared_types, 2, "compares an integer with a float"),
        (without_end, 0, "calls itself"),
    ],
)
def test_what_c_would_compute_otherwise_is_refused_with_file_and_line(
    function: Callable[..., Any], line: int, said: str
) -> None:
    line += function.__code__.co_firstlineno
    with pytest.raises(ProgramError, match=rf"test_c99\.py:{line}: .*{said}"):
        walk_module(module_of(function, "x[0, lane]", 1))


@needs_gcc
@pytest.mark.parametrize("language", ["-std=c99", "-xc++"])
def test_programs_compile_without_a_warning(language: str, tmp_path: Path) -> None:
    walk = plan_run(with_duration(load_walk("solenoid"), 4.0)).program
    for number, program in enumerate([*drawn_programs(3), walk]):
        written = tmp_path / f"{number}.c"
        written.write_text(program_source(program), encoding="utf-8")
        done = subprocess.run(["gcc", language, *WARNINGS, str(written)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


@needs_gcc
@pytest.mark.parametrize("name", ["torque-task-proportional", "step-response"])
def test_c_has_the_bits_of_the_lanes_in_runs_that_fail_too(name: str, tmp_path: Path) -> None:
    alone = plain_batch(name)
    drawn = drawn_batch(alone, 200)
    native = build(program_source(alone.program), tmp_path, flags=("-std=c99", "-O1", "-ffp-contract=off", "-fwrapv"))
    assert digest(run_native(native, alone)) == digest(run_batch(alone))
    expected = run_batch(drawn)
    assert failures(expected) > 0
    assert digest(run_native(native, drawn)) == digest(expected)
