"""Plain texts become printed ones."""

import pytest

from ppafo.report.writing import format_reported_quantity, quantity, sentence, typeset, with_paths_as_code

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


def test_a_path_or_a_symbol_at_the_beginning_stays_as_it_is() -> None:
    assert sentence("valve.area is large") == "valve.area is large."
    assert sentence("k_p") == "k_p."


@pytest.mark.parametrize(
    ("text", "title"),
    [
        ("knoechel does not agree with 2 recordings.", "knoechel against 2 recordings"),
        ("co2-40oz: a cylinder of 40 oz.", "Parts"),
        ("ppafo2011 agrees.", ""),
        ("solenoid: 20 wearers.", "20 wearers with solenoid"),
        ("pid-gains: objective 1 before.", "pid-gains"),
    ],
)
def test_a_name_at_the_beginning_stays_as_it_is(text: str, title: str) -> None:
    assert sentence(text, title) == text


def test_a_word_that_is_no_name_gets_its_capital_whatever_the_title_says() -> None:
    assert sentence("with it the run follows", "20 wearers with solenoid") == "With it the run follows."
    assert sentence("gas use: a recording", "Endurance") == "Gas use: a recording."


def test_a_quantity_keeps_its_digits_and_a_missing_one_is_a_dash() -> None:
    assert quantity(1.0, "N m", 3) == "1.00 N m"
    assert quantity(10.0, "-", 3) == "10"
    assert quantity(0.0, "J", 3) == "0 J"
    assert quantity(None, "g") == DASH


def test_a_printed_number_gets_no_digits_that_were_not_printed() -> None:
    assert format_reported_quantity(15.0, "%") == "15 %"
    assert format_reported_quantity(0.113, "-") == "0.113"


def test_paths_become_code_and_everything_else_is_escaped() -> None:
    assert with_paths_as_code("valve.area < 1") == "<code>valve.area</code> &lt; 1"
