"""Numbers of a fit as people read them."""

import pytest

from ppafo.identification.estimate import digits_of, in_shown_unit, interval_texts


@pytest.mark.parametrize(
    ("number", "error", "text"),
    [
        (9.7701, 0.22, "9.77"),
        (520.12, 5.1, "520.1"),
        (0.0047, 1.28, "0.0047"),
        (2.594e-7, 2.5e-7, "2.6e-07"),
        (0.0, 1, "0"),
        (1.0e-17, 1.28, "0"),
        (16.13, 1977.0, "16"),
    ],
)
def test_a_number_has_two_digits_of_its_error_and_is_never_rounded_to_zero(
    number: float, error: float, text: str
) -> None:
    assert digits_of(number, error) == text


@pytest.mark.parametrize(
    ("value", "low", "high", "texts"),
    [
        (23.2958, 16.1346, 2000.0, ("23.3", "16.1", "2000")),
        (1.1142, 0.8966, 5.0, ("1.11", "0.90", "5.0")),
        (10.012, 9.771, 10.223, ("10.01", "9.77", "10.22")),
        (0.39001, 0.39, 0.49, ("0.390", "0.390", "0.490")),
        (0.0, -0.31, 0.33, ("0", "-0.31", "0.33")),
        (5.0, 3.2, 5.0, ("5.00", "3.2", "5.00")),
    ],
)
def test_each_end_of_an_interval_has_digits_of_its_own_distance(
    value: float, low: float, high: float, texts: tuple[str, str, str]
) -> None:
    assert interval_texts(value, low, high) == texts


def test_a_number_is_shown_as_everywhere_else_and_in_the_unit_of_its_file_where_that_states_one() -> None:
    assert in_shown_unit(480537.0, "Pa") == (pytest.approx(69.6960), "psi")
    assert in_shown_unit(480537.0, "Pa", "kPa_g") == (pytest.approx(480.537), "kPa")
    assert in_shown_unit(0.5, "rad")[1] == "deg"
    assert in_shown_unit(0.01, "kg m^2") == (0.01, "kg m^2")
