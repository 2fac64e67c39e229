"""What steps time does each operation as it is written, so that every processor gives the same bits."""

import re

from ppafo.engine.compilers import FLAGS
from ppafo.translation.native import FOR_GCC
from tests.composed_programs import drawn_programs, lane_source

INEXACT = ("-Ofast", "-ffast-math", "-funsafe-math-optimizations", "-fassociative-math", "-freciprocal-math")
INEXACT += ("-ffinite-math-only", "-fno-signed-zeros", "-ffp-contract=fast", "-ffp-contract=on")


def test_compilers_may_neither_reorder_nor_contract_nor_take_reciprocals() -> None:
    assert "-ffp-contract=off" in FLAGS
    assert not set(INEXACT) & {*FLAGS, *FOR_GCC}


def test_programs_call_no_library_function_but_the_square_root() -> None:
    texts = [lane_source(program) for program in drawn_programs(6)]
    assert {name for text in texts for name in re.findall(r"\bmath\.(\w+)", text)} <= {"sqrt", "inf", "pi"}
    assert not any("**" in text or "pow(" in text for text in texts)
