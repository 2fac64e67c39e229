"""Plain texts become printed ones."""

import pytest

from ppafo.report.writing import quantity, sentence, typeset, with_paths_as_code

SPACE, TIMES, MINUS = "\N{NO-BREAK SPACE}", "\N{MULTIPLICATION SIGN}", "\N{MINUS SIGN}"
APOSTROPHE, DASH = "\N{RIGHT SINGLE QUOTATION MARK}", "\N{EN DASH}"


@pytest.mark.parametrize(
    ("plain", "printed"),
    [
        ("1.451e-05 m^3", f"1.451 {TIMES} 10⁻⁵{SPACE}m³"),
        ("at 50 psi_g", f"at 50{SPACE}psig"),
        ("101325 Pa_a", f"101325{SPACE}Pa (absolute)"),
        ("0.113 x 31.6 mm^2", f"0.113 {TIMES} 31.6{SPACE}mm²"),
        ("it is -35.6 cm^3", f"it is {MINUS}35.6{SPACE}cm³"),
        ("(k + 1)/(k - 1)", f"(k + 1)/(k {MINUS} 1)"),
        ("8.4 g m^2/s", f"8.4{SPACE}g{SPACE}m²/s"),
        ("5.0 N m and CO2", f"5.0{SPACE}N{SPACE}m and CO₂"),
        ("section 'Discussion' of the authors' text", "section “Discussion” of the authors' text"),
        ("the vane's C1", f"the vane{APOSTROPHE}s C₁"),
    ],
)
def test_a_text_gets_the_signs_of_print(plain: str, printed: str) -> None:
    assert typeset(plain) == printed


@pytest.mark.parametrize(
    "text", ["ISO 6358-1:2013", "ppafo2011-printed", "--set run.duration", "20 to 130", "a 4 mixed"]
)
def test_a_text_without_such_signs_stays_as_it_is(text: str) -> None:
    assert typeset(text) == text


def test_a_sentence_begins_with_a_capital_and_ends_with_a_stop() -> None:
    assert sentence("not printed") == "Not printed."
    assert sentence("Is it?") == "Is it?"
    assert sentence("  ") == ""


def test_a_quantity_keeps_its_digits_and_a_missing_one_is_a_dash() -> None:
    assert quantity(1.0, "N m", 3) == "1.00 N m"
    assert quantity(10.0, "-", 3) == "10"
    assert quantity(0.0, "J", 3) == "0 J"
    assert quantity(None, "g") == DASH


def test_paths_become_code_and_everything_else_is_escaped() -> None:
    assert with_paths_as_code("valve.area < 1") == "<code>valve.area</code> &lt; 1"
