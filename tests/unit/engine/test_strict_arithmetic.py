"""What steps time does each operation as it is written, so that every processor gives the same bits."""

import re
from typing import Any

import pytest

from ppafo.engine import lane_source, loading
from ppafo.engine.lane_source import HEADER, INLINE
from tests.composed_programs import drawn_programs

SUM_OF_PRODUCTS = "def product(a, b, c):\n    return a * b + c * (a / b)\n"
INEXACT = re.compile(r"\b(fast|reassoc|contract|arcp|nsz|afn|nnan|ninf)\b")


def compiled(decorator: str) -> str:
    """What the compiler was told of some products."""
    scope: dict[str, Any] = {}
    exec(f"{HEADER}\n\n{decorator}\n{SUM_OF_PRODUCTS}", scope)
    product: Any = scope["product"]
    product(1.0, 2.0, 3.0)
    return "\n".join(product.inspect_llvm().values())


def test_compiler_may_neither_reorder_nor_contract_nor_take_reciprocals() -> None:
    told = compiled(INLINE.replace(", no_cpython_wrapper=True, no_cfunc_wrapper=True", ""))
    assert re.search(r"\bfmul double\b", told), "the products are there, and bare"
    assert not INEXACT.search(told)
    assert INEXACT.search(compiled("@njit(fastmath=True)")), "the check sees what is not allowed"


@pytest.mark.parametrize("module", [lane_source, loading])
def test_no_program_is_compiled_with_inexact_arithmetic(module: Any) -> None:
    texts = [value for value in vars(module).values() if isinstance(value, str) and "njit" in value]
    assert texts
    assert not any("fastmath" in text for text in texts)


def test_programs_call_no_library_function_but_the_square_root() -> None:
    texts = [lane_source.lane_source(program) for program in drawn_programs(6)]
    assert {name for text in texts for name in re.findall(r"\bmath\.(\w+)", text)} <= {"sqrt", "inf", "pi"}
    assert not any("**" in text or "pow(" in text for text in texts)
