"""Units at the edge."""

import decimal
import math
import re
from collections.abc import Callable

import pint
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ppafo.errors import UnitError
from ppafo.parameters.audit.evidence import digits
from ppafo.units import (
    base_value,
    check_unit,
    conversion,
    format_quantity,
    from_si,
    parse_quantity,
    split_quantity,
    to_si,
)
from ppafo.units.spelling import UNITS, parse_unit

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


def test_gauge_pressure_counts_from_the_atmosphere_that_is_given() -> None:
    assert parse_quantity("50 psi_g", "Pa_a") == pytest.approx(101325.0 + 50.0 * 6894.757293168361)
    assert parse_quantity("50 psi_g", "Pa_a", atmosphere=90e3) == pytest.approx(90e3 + 50.0 * 6894.757293168361)


def test_absolute_pressure_and_differences_ignore_the_atmosphere() -> None:
    assert parse_quantity("5 bar_a", "Pa_a", atmosphere=90e3) == 5e5
    assert parse_quantity("5 bar_d", "Pa_d", atmosphere=90e3) == 5e5


@pytest.mark.parametrize("unit", ["psi", "bar", "kPa", "Pa", "MPa", "lbf/in^2", "kgf/cm2", "mmHg"])
def test_a_bare_pressure_is_refused_with_the_ways_to_say_it_that_fit(unit: str) -> None:
    said = f"'{unit}' needs the kind of pressure: write {unit}_"
    with pytest.raises(UnitError, match=re.escape(f"{said}g for gauge or {unit}_a for absolute") + "$"):
        parse_quantity(f"50 {unit}", "Pa_a")
    with pytest.raises(UnitError, match=re.escape(f"{said}d for a difference") + "$"):
        parse_quantity(f"50 {unit}", "Pa_d")


@pytest.mark.parametrize(("unit", "si_unit", "needed"), [("psi_d", "Pa_a", "level"), ("psi_g", "Pa_d", "difference")])
def test_levels_and_differences_of_pressure_are_kept_apart(unit: str, si_unit: str, needed: str) -> None:
    with pytest.raises(UnitError, match=f"'{unit}' is a .*, a pressure {needed} is needed"):
        parse_quantity(f"50 {unit}", si_unit)


@pytest.mark.parametrize(
    "unit",
    [
        "kg_g",
        "N m/psi_g",
        "m)",
        "2 m",
        "m^",
        "m//s",
        "m/s kg",
        "mm0",
        "m;s",
        "mm^0",
        "m/s^-0",
        "L/min (noon, air)",
        "L/min (5 m, 1 bar, air)",
        "L/min (0 degC, 1 bar_g, air)",
        "kg (ANR)",
        "mdegC",
        "kdegC s",
        "J/(kg udegC)",
        "millidegC",
        "kdegC_g",
    ],
)
def test_what_is_no_unit_is_refused(unit: str) -> None:
    with pytest.raises(UnitError):
        check_unit(unit)


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


@pytest.mark.parametrize("convert", [to_si, from_si])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_numbers_that_are_not_finite_are_refused_in_both_directions(
    convert: Callable[[float, str, str], float], value: float
) -> None:
    with pytest.raises(UnitError, match="not a finite number"):
        convert(value, "m", "m")


PSI = 6894.757293168361
ATMOSPHERE = 101325.0
LBF = 4.4482216152605


@pytest.mark.parametrize(
    ("text", "si_unit", "value"),
    [
        *(
            (f"60 {unit}", "Pa_a", ATMOSPHERE + 60 * PSI)
            for unit in ("psig", "PSIG", "psi(g)", "psi gauge", "lbf/in^2_g")
        ),
        *((f"60 {unit}", "Pa_a", 60 * PSI) for unit in ("psia", "psi_a", "psi (abs)", "lbs/in2_a", "lb/in^2 abs")),
        ("2 psid", "Pa_d", 2 * PSI),
        *(
            (f"6 {unit}", "Pa_a", ATMOSPHERE + 6e5)
            for unit in ("barg", "bar(g)", "bar (g)", "BAR G", "bar ü", "bar rel.")
        ),
        *((f"6 {unit}", "Pa_a", 6e5) for unit in ("bara", "bar(a)", "bar abs", "bar absolute", "bar_a")),
        ("0.5 MPa(g)", "Pa_a", ATMOSPHERE + 5e5),
        ("414 kN/m^2_g", "Pa_a", ATMOSPHERE + 414e3),
        ("5 kgf/cm^2_a", "Pa_a", 5 * 98066.5),
        ("5 kg/cm2G", "Pa_a", ATMOSPHERE + 5 * 98066.5),
        ("5 kp/cm² (a)", "Pa_a", 5 * 98066.5),
        ("1013.25 hPa_a", "Pa_a", 101325.0),
        ("760 mmHg_a", "Pa_a", 760 * 133.322387415),
        ("10 inH2O_d", "Pa_d", 2490.8891),
        ("10 mmWS_d", "Pa_d", 98.0665),
        *((f"2 {unit}", "Pa_a", 2 * 98066.5) for unit in ("at_a", "ata", "at abs")),
        ("2 daN/cm² (g)", "Pa_a", ATMOSPHERE + 2e5),
        ("3 ksi_a", "Pa_a", 3000 * PSI),
        ("2 kilopascals_d", "Pa_d", 2000.0),
        ("3 1/rpm", "s/rad", 3 * 60 / (2 * math.pi)),
        ("77 degF", "K", 298.15),
        ("77 °F", "K", 298.15),
        ("25 deg C", "K", 298.15),
        *((f"3 {unit}", "N m", 3.0) for unit in ("Nm", "N-m", "N.m", "N·m", "N*m")),
        ("3 Nmm", "N m", 3e-3),
        ("3 mNm", "N m", 3e-3),
        *((f"30 {unit}", "N m", 30 * LBF * 0.0254) for unit in ("in-lb", "lb-in", "in lbf", "inlb", "lbf.in")),
        ("2 ft-lb", "N m", 2 * LBF * 0.3048),
        ("16 oz-in", "N m", LBF * 0.0254),
        ("3 Nms/rad", "N m s/rad", 3.0),
        ("2 kgcm^2", "kg m^2", 2e-4),
        ("5 mm2", "m^2", 5e-6),
        ("5 sq mm", "m^2", 5e-6),
        ("9 m/s2", "m/s^2", 9.0),
        ("10 min-1", "1/s", 1.0 / 6.0),
        *((f"20 {unit}", "m^3", 2e-5) for unit in ("cc", "ccm", "cm3", "ml", "mL")),
        ("1 cu in", "m^3", 0.0254**3),
        *((f"1 {unit}", "m^3/(s Pa)", 1e-8) for unit in ("dm3/(s·bar)", "l/s/bar", "dm^3/(s*bar)", "L/(bar s)")),
        ("60 l/min/bar", "m^3/(s Pa)", 1e-8),
        ("5 mbarl/s", "Pa m^3/s", 0.5),
        ("3 -", "", 3.0),
        ("60 rpm", "rad/s", 2 * math.pi),
        ("2 h", "s", 7200.0),
        ("3 sec", "s", 3.0),
        ("3 J/kgK", "J/(kg K)", 3.0),
    ],
)
def test_units_are_read_as_people_write_them(text: str, si_unit: str, value: float) -> None:
    assert parse_quantity(text, si_unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        # 1.185 kg/m^3 is the density of ISO 6358 for 20 degC, 1 bar, 65 %; the others are p M/(R T).
        ("60 L/min (ANR, air)", 1.185e-3),
        ("60 l/min (ISO 8778, air)", 1.185e-3),
        ("3.6 m3/h (anr, air)", 1.185e-3),
        ("60 Nl/min (DIN 1343, air)", 101325.0 * 0.028965 / (8.314462618 * 273.15) * 1e-3),
        ("60 slm (0 degC, 1.01325 bar_a, CO2)", 101325.0 * 0.044 / (8.314462618 * 273.15) * 1e-3),
        ("3.6 Nm3/h (DIN 1343, N2)", 101325.0 * 0.028013 / (8.314462618 * 273.15) * 1e-3),
        ("60 L/min (ANR, CO2)", 1e5 * 0.044 / (8.314462618 * 293.15) * 1e-3),
        ("60000 sccm (25 °C, 1 atm, 0.0399 kg/mol)", 101325.0 * 0.0399 / (8.314462618 * 298.15) * 1e-3),
        ("1 SCFM (70 degF, 14.696 psia, air)", 0.3048**3 / 60 * 101325.35 * 0.028965 / (8.314462618 * 294.2611)),
    ],
)
def test_a_volume_flow_with_condition_and_gas_is_a_mass_flow(text: str, value: float) -> None:
    assert parse_quantity(text, "kg/s") == pytest.approx(value, rel=1e-6)


# What is asked about, with what was wanted.
ASKED = [
    *(
        (f"60 {unit}", "Pa_a")
        for unit in ("psi", "lbf/in^2", "kN/m^2", "N/cm2", "kgf/cm^2", "MPa", "mmHg", "inH2O", "lb/in2")
    ),
    *((f"5 {unit}", "Pa_d") for unit in ("psi", "bar", "kgf/cm^2", "mbar")),
    *(
        (f"5 {unit}", "kg/s")
        for unit in ("L/min", "Nl/min", "slm", "SCFM", "scfh", "m3/h", "Nm^3/h", "sccm", "ln/min", "L/h")
    ),
    *((f"5 {unit}", "kg/s") for unit in ("L/min (ANR)", "l/min ANR", "Nl/min (DIN 1343)", "cfm (70 degF, 14.7 psia)")),
    ("4,1 bar_g", "Pa_a"),
    ("4,125 bar_g", "Pa_a"),
    ("1,000 mL", "m^3"),
    ("3 HPA_a", "Pa_a"),
    ("3 psii_g", "Pa_a"),
    ("3 psii", "Pa_a"),
    ("3 kPq", "Pa_d"),
    ("1 degg", "rad"),
]


@pytest.mark.parametrize(("text", "si_unit"), ASKED)
def test_every_proposed_remedy_works(text: str, si_unit: str) -> None:
    """Follow every answer that a refusal proposes; each must be taken, or lead to one that is."""
    left, number, followed = [text], text.split(maxsplit=1)[0], 0
    while left:
        asked = left.pop()
        try:
            parse_quantity(asked, si_unit)
        except UnitError as error:
            proposed = proposals(str(error), number)
            assert proposed, f"{asked}: {error}"
            assert followed < 20, f"{asked} goes round: {error}"
            left += proposed
            followed += len(proposed)
    assert followed


def proposals(message: str, number: str) -> list[str]:
    """Return the quantities that a message tells to write."""
    said = re.findall(r"(?:write|did you mean) (.*?)(?:, as in the data sheet|\?|;|$)", message)
    texts = [quoted for part in said for quoted in re.findall(r"'([^']+)'", part)]
    texts += [word for part in said for word in re.findall(r"(?:^|or )([^' ]+_[gad]) for", part)]
    return [text if text[0].isdigit() else f"{number} {text}" for text in texts]


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


def test_every_unit_is_defined_as_in_the_list_that_pint_brings() -> None:
    registry, water = pint.UnitRegistry(), "1000 kg/m^3 * standard_gravity *"
    of_pint = {"rev": "turn", "Torr": "torr", "mWC": f"{water} m", "inWC": f"{water} inch"}
    for unit in set(UNITS) - {"degC", "degF"}:
        theirs = registry.Quantity(of_pint.get(unit, unit)).to_base_units()
        assert float(parse_unit(unit).scale) == pytest.approx(theirs.magnitude, rel=1e-15), unit


FACTORS = ["m", "mm", "s", "K", "degC", "mdegC", "deg", "psi", "psi_g", "%", "N", "1", "", "kkg", "lbf", "Pa_d"]
unit_texts = st.lists(
    st.tuples(
        st.sampled_from(FACTORS),
        st.sampled_from(["", "^0", "^1", "^-1", "^9", "**2", "²", "^-0", "^10", "^1.5", "^^2", "_g"]),
        st.sampled_from(["", " ", "/", "*", "·", "(", ")", "/(", "\u00a0"]),
    ),
    max_size=6,
).map(lambda parts: "".join("".join(part) for part in parts))


@settings(max_examples=300)
@given(unit=unit_texts, number=st.sampled_from(["1", "-0", "1e308", "1e-320", "0.5", "9" * 300]))
def test_any_text_is_a_quantity_or_refused_as_none(unit: str, number: str) -> None:
    for si_unit in ("", "m", "K", "Pa_a", "Pa_d", "rad", "1/s"):
        try:
            assert math.isfinite(parse_quantity(f"{number} {unit}", si_unit))
        except UnitError as error:
            assert len(str(error).splitlines()) == 1


@pytest.mark.parametrize("text", ["1e-400 m^3", "-0.5e-330", "\uff11 m", "\u0661 m", "1_000 m"])
def test_a_number_that_would_become_0_or_has_other_digits_is_refused(text: str) -> None:
    with pytest.raises(UnitError):
        split_quantity(text)


def test_a_0_stays_one_however_it_is_written() -> None:
    assert split_quantity("0e-400 m")[0] == split_quantity("-0.000 m")[0] == 0.0


def test_decimals_of_a_host_program_change_no_conversion() -> None:
    def converted() -> list[object]:
        for kept in (conversion, parse_unit):
            kept.cache_clear()
        return [
            parse_quantity("8.4 g", "kg"),
            from_si(451325.0, "psi_g", "Pa_a"),
            base_value(77.0, "degF"),
            parse_quantity("23.4 L/min (70 degF, 14.696 psi_a, air)", "kg/s"),
            parse_unit("mm^3/min"),
            digits(0.01234),
        ]

    expected = converted()
    with decimal.localcontext(decimal.Context(prec=3, rounding=decimal.ROUND_UP, traps=[decimal.Inexact])):
        assert converted() == expected
