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

from ppafo.engine.lanes import run_batch
from ppafo.engine.source_text import SourceCollector
from ppafo.errors import ProgramError
from ppafo.translation.c99 import c_source, program_source
from ppafo.translation.native import build, run_native
from ppafo.translation.walk import walk_module
from scripts.bits import digest, drawn_batch, failures, plain_batch
from tests.composed_programs import drawn_programs

WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Werror", "-fsyntax-only", "-ffp-contract=off")
ENTRY = '@njit("void(float64[:, ::1], float64[:, ::1])")'
needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")


def module_of(function: Callable[..., Any], given: str, results: int) -> str:
    """A composed module whose ``advance`` calls a function for each column of ``x`` and writes its results to ``y``."""
    collector = SourceCollector("@njit")
    name = collector.add(function)
    lines = [f"        {', '.join(f'y[{row}, lane]' for row in range(results))} = {name}({given})"]
    if results > 1:
        lines = [f"        result = {name}({given})"]
        lines += [f"        y[{row}, lane] = result[{row}]" for row in range(results)]
    loop = [f"{ENTRY}\ndef advance(x, y):", "    for lane in range(x.shape[1]):", *lines]
    return "\n".join(["from collections import namedtuple", collector.text(), *loop])


def in_c(function: Callable[..., Any], given: str, results: int, columns: Any, folder: Path) -> Any:
    """Results (results, runs) of a function in C for the columns (numbers, runs)."""
    source = c_source(walk_module(module_of(function, given, results)), {}, "A test.")
    found = np.zeros((results, columns.shape[1]))
    build(source, folder, flags=("-std=c99", "-O2", "-fsanitize=undefined", "-fno-sanitize-recover=all")).advance(
        np.ascontiguousarray(columns), found
    )
    return found


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
        if number * number > last:
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


def exponential(value: float) -> float:
    """Needs a library."""
    return math.exp(value)


def remainder(value: float) -> float:
    """The remainder of numbers that are not whole is a library function in C."""
    return value % 0.3


def two_forms(value: float) -> float:
    """A name that holds a number, then a tuple."""
    held = value
    held = (value, value)
    return held[0]


@pytest.mark.parametrize(
    ("function", "said"),
    [
        (exponential, "'math.exp' is a function of a library"),
        (remainder, "needs a library function"),
        (two_forms, "'held' holds values of different forms"),
    ],
)
def test_what_is_outside_the_subset_is_refused_with_file_and_line(function: Callable[..., Any], said: str) -> None:
    last = function.__code__.co_firstlineno + (3 if function is two_forms else 2)
    with pytest.raises(ProgramError, match=rf"test_c99\.py:{last}: .*{said}"):
        walk_module(module_of(function, "x[0, lane]", 1))


@needs_gcc
@pytest.mark.parametrize("language", ["-std=c99", "-xc++"])
def test_programs_compile_without_a_warning(language: str, tmp_path: Path) -> None:
    for number, program in enumerate(drawn_programs(3)):
        written = tmp_path / f"{number}.c"
        written.write_text(program_source(program), encoding="utf-8")
        done = subprocess.run(["gcc", language, *WARNINGS, str(written)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


def test_functions_keep_names_and_docstrings() -> None:
    source = program_source(next(iter(drawn_programs(1))))
    assert "/* Mass flow from a to b [kg/s], positive from a to b" in source
    assert "PPAFO_INLINE double model_orifice_orifice_flow(double pressure_a, double pressure_b" in source
    for forbidden in ("malloc", "static double", "exp(", "pow("):
        assert forbidden not in source


@needs_gcc
@pytest.mark.parametrize("name", ["torque-task-proportional", "step-response"])
def test_c_has_the_bits_of_the_lanes_in_runs_that_fail_too(name: str, tmp_path: Path) -> None:
    alone = plain_batch(name)
    drawn = drawn_batch(alone, 40)
    native = build(program_source(alone.program), tmp_path, flags=("-std=c99", "-O1", "-ffp-contract=off", "-fwrapv"))
    assert digest(run_native(native, alone)) == digest(run_batch(alone))
    expected = run_batch(drawn)
    assert failures(expected) > 0
    assert digest(run_native(native, drawn)) == digest(expected)
