"""Types of arguments: what a text becomes, and what is refused."""

import argparse

import pytest

from ppafo.questions.question import quantity


@pytest.mark.parametrize(
    ("text", "unit", "value"), [("10 min", "s", 600.0), ("0.3 g", "kg", 3e-4), ("5 degC", "K", 278.15)]
)
def test_a_text_with_a_unit_becomes_a_number_in_si(text: str, unit: str, value: float) -> None:
    assert quantity(unit)(text) == pytest.approx(value)


@pytest.mark.parametrize("text", ["10", "10 kg", "ten min", ""])
def test_a_text_without_the_unit_is_refused_by_name(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError) as caught:
        quantity("s")(text)
    assert str(caught.value).startswith(f"{text}: ")
