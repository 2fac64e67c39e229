"""Numbers of a fit as people read them."""

import pytest

from ppafo.identification.wording import digits_of, in_shown_unit, with_error


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (480.537, 6.89, "480.5 +- 6.9"),
        (298.0, 8.7, "298.0 +- 8.7"),
        (26.4, 1.91, "26.4 +- 1.9"),
        (1.451e-5, 1.7e-7, "(1.451 +- 0.017)e-05"),
        (-0.0004, 0.58, "0.00 +- 0.58"),
        (480537.0, 6890.0, "(4.805 +- 0.069)e+05"),
        (0.0, 1.2e-6, "(0.0 +- 1.2)e-06"),
    ],
)
def test_a_value_has_as_many_digits_as_its_error_allows(value: float, error: float, text: str) -> None:
    assert with_error(value, error) == text


@pytest.mark.parametrize(
    ("number", "error", "text"),
    [
        (9.7701, 0.22, "9.77"),
        (520.12, 5.1, "520.1"),
        (0.0047, 1.28, "0.0"),
        (2.594e-7, 2.5e-7, "2.6e-07"),
        (0.0, 1, "0"),
    ],
)
def test_the_ends_of_an_interval_have_two_digits_of_its_half_width(number: float, error: float, text: str) -> None:
    assert digits_of(number, error) == text


def test_a_number_is_shown_as_everywhere_else_and_in_the_unit_of_its_file_where_that_states_one() -> None:
    assert in_shown_unit(480537.0, "Pa") == (pytest.approx(69.6960), "psi")
    assert in_shown_unit(480537.0, "Pa", "kPa_g") == (pytest.approx(480.537), "kPa")
    assert in_shown_unit(0.5, "rad")[1] == "deg"
    assert in_shown_unit(0.01, "kg m^2") == (0.01, "kg m^2")
