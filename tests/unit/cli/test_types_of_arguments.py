"""Types of arguments: what a text becomes, and what is refused."""

import pytest

from ppafo.arguments.reading import fraction, quantity
from ppafo.errors import ArgumentError


@pytest.mark.parametrize(
    ("text", "unit", "value"), [("10 min", "s", 600.0), ("0.3 g", "kg", 3e-4), ("5 degC", "K", 278.15)]
)
def test_a_text_with_a_unit_becomes_a_number_in_si(text: str, unit: str, value: float) -> None:
    assert quantity(unit)(text) == pytest.approx(value)


@pytest.mark.parametrize("text", ["10", "10 kg", "ten min", ""])
def test_a_text_without_the_unit_is_refused_by_name(text: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        quantity("s")(text)
    assert str(caught.value).startswith(f"{text}: ")


@pytest.mark.parametrize("text", ["\uff10.5", "\u0661%", "0_1", "1.5"])
def test_a_fraction_is_written_in_the_digits_of_ascii(text: str) -> None:
    assert fraction("50%") == 0.5
    with pytest.raises(ArgumentError, match="must be a number from 0 to 1"):
        fraction(text)
