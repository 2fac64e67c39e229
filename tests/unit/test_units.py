"""Units at the edge."""

import math
import re
import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ppafo.errors import UnitError
from ppafo.units import (
    ParsedUnit,
    base_value,
    check_unit,
    format_quantity,
    from_si,
    known_units,
    number_text,
    parse_quantity,
    split_quantity,
    to_si,
    unit_by_pint,
)

PAIRS = [
    ("mm^2", "m^2"),
    ("cm^3/rad", "m^3/rad"),
    ("cm^3/deg", "m^3/rad"),
    ("g m^2", "kg m^2"),
    ("g m^2/s", "N m s"),
    ("deg", "rad"),
    ("psi_g", "Pa_a"),
    ("bar_a", "Pa_a"),
    ("kPa_d", "Pa_d"),
    ("degC", "K"),
    ("kHz", "Hz"),
    ("L/(s bar)", "m^3/(s Pa)"),
    ("lbf in", "N m"),
    ("percent", ""),
    ("", ""),
]


@pytest.mark.parametrize(
    ("text", "si_unit", "expected"),
    [
        ("12.6mm^2", "m^2", 12.6e-6),
        ("12.6 mm²", "m^2", 12.6e-6),
        ("20 deg", "rad", math.pi / 9.0),
        ("0.4 1/s", "1/s", 0.4),
        ("8.4 g m^2", "kg m^2", 0.0084),
        ("8.4 g*m**2", "kg m^2", 0.0084),
        ("25 degC", "K", 298.15),
        ("0.1 N m/psi", "m^3", 0.1 / 6894.757293168361),
        ("1 dm^3/(s bar)", "m^3/(s Pa)", 1e-8),
        ("-5e-1 m", "m", -0.5),
        ("3", "", 3.0),
        ("5 %", "", 0.05),
    ],
)
def test_a_text_becomes_its_value_in_si(text: str, si_unit: str, expected: float) -> None:
    assert parse_quantity(text, si_unit) == pytest.approx(expected, rel=1e-14)


def test_decimal_prefixes_are_exact() -> None:
    assert to_si(8.4, "g m^2", "kg m^2") == 0.0084
    assert to_si(31.6, "mm^2", "m^2") == 31.6e-6


def test_gauge_pressure_counts_from_the_atmosphere_that_is_given() -> None:
    assert parse_quantity("50 psi_g", "Pa_a") == pytest.approx(101325.0 + 50.0 * 6894.757293168361)
    assert parse_quantity("50 psi_g", "Pa_a", atmosphere=90e3) == pytest.approx(90e3 + 50.0 * 6894.757293168361)


def test_absolute_pressure_and_differences_ignore_the_atmosphere() -> None:
    assert parse_quantity("5 bar_a", "Pa_a", atmosphere=90e3) == 5e5
    assert parse_quantity("5 bar_d", "Pa_d", atmosphere=90e3) == 5e5


@pytest.mark.parametrize("unit", ["psi", "bar", "kPa", "Pa"])
@pytest.mark.parametrize("si_unit", ["Pa_a", "Pa_d"])
def test_a_bare_pressure_is_refused_with_the_three_ways_to_say_it(unit: str, si_unit: str) -> None:
    with pytest.raises(UnitError, match=f"'{unit}' does not say which pressure: write {unit}_g for gauge, {unit}_a"):
        parse_quantity(f"50 {unit}", si_unit)


def test_a_difference_is_refused_for_a_level() -> None:
    with pytest.raises(UnitError, match="'psi_d' is a pressure difference, a pressure level is needed"):
        parse_quantity("50 psi_d", "Pa_a")


@pytest.mark.parametrize("unit", ["psi_g", "psi_a"])
def test_a_level_is_refused_for_a_difference(unit: str) -> None:
    with pytest.raises(UnitError, match="a pressure difference is needed"):
        parse_quantity(f"50 {unit}", "Pa_d")


@pytest.mark.parametrize("text", ["4 kg_g", "1 N m/psi_g", "1 m_a"])
def test_the_kind_of_pressure_stands_only_on_a_pressure_alone(text: str) -> None:
    with pytest.raises(UnitError, match="belong to a unit of pressure that stands alone"):
        split_quantity(text)


@pytest.mark.parametrize(
    ("text", "si_unit"), [("20", "rad"), ("20 deg", ""), ("3 rad/s", "Hz"), ("3 1/s", "rad/s"), ("3 mm", "m^2")]
)
def test_a_foreign_dimension_is_refused_and_angles_are_a_dimension(text: str, si_unit: str) -> None:
    with pytest.raises(UnitError, match="does not fit"):
        parse_quantity(text, si_unit)


@pytest.mark.parametrize("text", ["nan m", "inf m", "-inf m", "1e999 m", "", "m", "--3 m", "0x10 m", "\u0661 m"])
def test_what_is_not_a_finite_number_is_refused(text: str) -> None:
    with pytest.raises(UnitError):
        split_quantity(text)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_numbers_that_are_not_finite_are_refused_in_both_directions(value: float) -> None:
    with pytest.raises(UnitError, match="not a finite number"):
        to_si(value, "m", "m")
    with pytest.raises(UnitError, match="not a finite number"):
        from_si(value, "m", "m")


@pytest.mark.parametrize(
    "unit", ["m)", "2 m", "m^", "m//s", "m/s kg", "mm2", "m;s", "(" * 50 + "m" + ")" * 50, "m" * 99]
)
def test_what_is_not_written_like_a_unit_is_refused(unit: str) -> None:
    with pytest.raises(UnitError, match="is not a unit"):
        check_unit(unit)


@pytest.mark.parametrize(
    ("unit", "meant"),
    [
        ("kPq/s", "'kPa'"),
        ("kPq", "'kPa_g', 'kPa_a' or 'kPa_d'"),
        ("psii_g", "'psi_g'"),
        ("psig", "'psi_g'"),
        ("Nm", "'N m'"),
        ("Nms/rad", "'N m s/rad'"),
        ("Nmm", "'N mm'"),
        ("kgm^2", "'kg m^2'"),
        ("J/kgK", "'J/(kg K)'"),
        ("J/(kgK)", "'J/(kg K)'"),
        ("degg", "'deg'"),
    ],
)
def test_an_unknown_unit_names_the_nearest_one_or_the_product_that_it_is(unit: str, meant: str) -> None:
    with pytest.raises(UnitError, match=re.escape(f"is not a known unit, did you mean {meant}?")):
        check_unit(unit)


def test_pressures_that_are_listed_as_available_are_read_alone() -> None:
    with pytest.raises(UnitError) as caught:
        check_unit("qqq")
    listed = str(caught.value).partition("pressures as ")[2].partition(" (")[0].split(", ")
    assert len(listed) == 9
    for unit in listed:
        to_si(1.0, unit, "Pa_d" if unit.endswith("_d") else "Pa_a")


@pytest.mark.parametrize("unit", ["nan", "inf", "NaN", "m nan", "nan_g", "m/nan"])
def test_what_a_parser_may_take_for_a_number_is_no_unit(unit: str) -> None:
    with pytest.raises(UnitError, match="is not a known unit"):
        check_unit(unit)


@pytest.mark.parametrize("unit", ["mdegC", "kdegC s", "J/(kg udegC)", "millidegC", "kdegC_g"])
def test_a_temperature_with_a_zero_of_its_own_takes_no_prefix(unit: str) -> None:
    with pytest.raises(UnitError, match=f"'{re.escape(unit)}': degC takes no prefix"):
        to_si(20.0, unit, "K")


def test_a_value_of_any_dimension_has_a_value_in_base_units() -> None:
    assert base_value(113.0, "ms/m") == pytest.approx(0.113)
    assert base_value(2.0, "kPa_a") == pytest.approx(2000.0)


@given(pair=st.sampled_from(PAIRS), value=st.floats(-1e9, 1e9))
def test_conversion_to_si_and_back_gives_the_same_value(pair: tuple[str, str], value: float) -> None:
    unit, si_unit = pair
    there = to_si(value, unit, si_unit)
    scale = to_si(1.0, unit, si_unit) - to_si(0.0, unit, si_unit)
    rounding = 4e-16 * abs(there) / abs(scale)
    assert from_si(there, unit, si_unit) == pytest.approx(value, rel=1e-14, abs=rounding + 1e-300)


@given(unit=st.sampled_from([unit for unit, _ in PAIRS]), value=st.floats(allow_nan=False, allow_infinity=False))
def test_a_formatted_quantity_reads_back_exactly(unit: str, value: float) -> None:
    assert split_quantity(format_quantity(value, unit)) == (value, unit)


@given(text=st.text(max_size=80))
def test_any_text_is_a_quantity_or_a_clear_error(text: str) -> None:
    try:
        value, unit = split_quantity(text)
    except UnitError as error:
        assert "\n" not in str(error)
    else:
        assert math.isfinite(value)
        check_unit(unit)


def test_importing_the_module_does_not_load_pint() -> None:
    code = "import sys, ppafo.units; sys.exit('pint' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_what_is_kept_of_a_unit_is_what_pint_says_of_it() -> None:
    def described(parsed: ParsedUnit) -> tuple[str, str, dict[str, int]]:
        return str(parsed.scale), str(parsed.offset), parsed.dimensions

    assert len(known_units()) > 50
    for unit, parsed in known_units().items():
        assert described(parsed) == described(unit_by_pint(unit)), f"{unit}: python scripts/known_units.py"


def test_a_unit_of_which_nothing_is_kept_is_read_by_pint() -> None:
    assert "lbf ft/deg" not in known_units()
    assert to_si(2.0, "lbf ft/deg", "N m/rad") == pytest.approx(2.0 * 4.4482216152605 * 0.3048 * 180.0 / math.pi)


@pytest.mark.parametrize("unit", ["mm^0", "degC^0", "percent^0", "m/s^0", "m^-0"])
@pytest.mark.parametrize("si_unit", ["", "m", "K"])
def test_unit_to_the_power_of_zero_is_no_unit(unit: str, si_unit: str) -> None:
    with pytest.raises(UnitError, match="is not a unit; write it like"):
        parse_quantity(f"1 {unit}", si_unit)


FACTORS = ["m", "mm", "s", "K", "degC", "mdegC", "deg", "psi", "psi_g", "%", "N", "1", "", "kkg", "lbf", "Pa_d"]
unit_texts = st.lists(
    st.tuples(
        st.sampled_from(FACTORS),
        st.sampled_from(["", "^0", "^1", "^-1", "^9", "**2", "²", "^-0", "^10", "^1.5", "^^2", "_g"]),
        st.sampled_from(["", " ", "/", "*", "·", "(", ")", "/(", "\u00a0"]),
    ),
    max_size=6,
).map(lambda parts: "".join("".join(part) for part in parts))


@settings(max_examples=1500)
@given(unit=unit_texts, number=st.sampled_from(["1", "-0", "1e308", "1e-320", "0.5", "9" * 300]))
def test_any_text_is_a_quantity_or_refused_as_none(unit: str, number: str) -> None:
    for si_unit in ("", "m", "K", "Pa_a", "Pa_d", "rad", "1/s"):
        try:
            assert math.isfinite(parse_quantity(f"{number} {unit}", si_unit))
        except UnitError as error:
            assert len(str(error).splitlines()) == 1


@pytest.mark.parametrize("text", ["1e-400 m^3", "-0.5e-330", "4.9e-999 Pa_a"])
def test_a_number_that_would_become_0_is_refused(text: str) -> None:
    with pytest.raises(UnitError, match=r"is too small for a number of 64 bits, and would be 0"):
        split_quantity(text)


def test_a_0_stays_one_however_it_is_written() -> None:
    assert split_quantity("0e-400 m")[0] == split_quantity("-0.000 m")[0] == 0.0


@pytest.mark.parametrize("text", ["\uff11", "\u0661", "1_000"])
def test_only_digits_of_ascii_make_a_number(text: str) -> None:
    assert float(text) in (1.0, 1000.0)  # Python takes them all
    with pytest.raises(ValueError, match="is not a number"):
        number_text(text)
    with pytest.raises(UnitError, match=r"does not start with a number|is not a unit"):
        split_quantity(f"{text} m")
