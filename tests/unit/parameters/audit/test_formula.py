"""Formulas that papers print."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppafo.parameters.audit.values import evaluate


@pytest.mark.parametrize(
    ("formula", "expected"),
    [("k", 1.5), ("(k + 1)/(k - 1)", 5.0), ("((k + 1)/(k - 1))/k", 5.0 / 1.5), ("-2*k + 1.5", -1.5)],
)
def test_arithmetic_in_k_is_evaluated(formula: str, expected: float) -> None:
    assert evaluate(formula, 1.5) == pytest.approx(expected)


@pytest.mark.parametrize(
    "formula", ["", "k +", "exit()", "k.real", "x", "k**k", "'k'", "1/(k-1.5)", "1e300*k", "k" * 200]
)
def test_everything_else_is_not_a_formula(formula: str) -> None:
    assert evaluate(formula, 1.5) is None


@given(formula=st.text(alphabet="k+-*/(). 0123456789e_[]x", max_size=40))
def test_no_text_breaks_the_evaluation(formula: str) -> None:
    value = evaluate(formula, 1.3)
    assert value is None or abs(value) < 1e3
