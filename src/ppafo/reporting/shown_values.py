"""Single numbers in the units in which a builder thinks: psig, cm^3, mm^2, grams."""

from collections.abc import Sequence

from ppafo.units import from_si

_SHOWN_IN = {
    "Pa_a": ("Pa_a", "psi_g"),
    "Pa_d": ("Pa_d", "psi_d"),
    "Pa": ("Pa_a", "psi_g"),
    "m^3": ("m^3", "cm^3"),
    "m^3/rad": ("m^3/rad", "cm^3/rad"),
    "m^2": ("m^2", "mm^2"),
    "m": ("m", "mm"),
    "m^3/s": ("m^3/s", "L/min"),
    "m^3/(s Pa)": ("m^3/(s Pa)", "L/(s bar)"),
    "kg": ("kg", "g"),
    "rad": ("rad", "deg"),
    "rad/s": ("rad/s", "deg/s"),
}
_DIGITS = 3


def shown_value(value: float, si_unit: str) -> str:
    """Return a value in SI as text with three digits and the unit in which it is shown; whole numbers as they are."""
    own, unit = _SHOWN_IN.get(si_unit, (si_unit, si_unit))
    number = value if own == unit else from_si(value, unit, own)
    plain = unit.replace("psi_d", "psi").removeprefix("-")
    return f"{shown_number(number)} {'' if plain == '1' else plain}".rstrip()


def shown_number(number: float) -> str:
    """Return a number with three digits, without an exponent where that reads well."""
    if number == 0.0:
        return "0"
    if abs(number) >= 10.0**_DIGITS:
        return f"{number:.0f}"
    return f"{number:.{_DIGITS}g}"


def aligned_rows(rows: Sequence[tuple[str, ...]], left: int = 1) -> list[str]:
    """Return rows of cells as lines of aligned columns: the first ``left`` to the left, the others to the right."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [
            f"{cell:<{width}}" if column < left else f"{cell:>{width}}"
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return lines
