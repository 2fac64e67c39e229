"""Units of measured quantities that are mistaken for each other, with the factor of each mistake."""

from collections.abc import Iterable

from ppafo.units import split_pressure_kind, to_si

_MISTAKEN = {
    "Pa": {unit: to_si(1.0, f"{unit}_d", "Pa_d") for unit in ("psi", "kPa", "bar", "MPa")},
    "rad": {unit: to_si(1.0, unit, "rad") for unit in ("deg", "rad")},
    "N m": {unit: to_si(1.0, unit, "N m") for unit in ("N cm", "N m")},
}
"""Units that are mistaken for each other, each with its value in SI, by SI unit."""


def misread_units(si_unit: str, stated: Iterable[str]) -> list[tuple[str, float]]:
    """Return the unit mistakes of channels, given the units that their files state (empty if none).

    A mistake is its description and the reading divided by the true value [-]: ``psi read as kPa`` with 0.145.
    A channel without a stated unit, or in Pa, may have been converted before, from any unit.
    """
    units = {split_pressure_kind(unit)[0] for unit in stated} - {"", "Pa"}
    scales = _MISTAKEN.get(si_unit, {})
    return [
        (f"{true} read as {read}", scales[read] / scales[true])
        for true in scales
        for read in scales
        if true != read and units <= {read}
    ]
