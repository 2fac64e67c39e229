"""Units of measured quantities that are mistaken for each other, with the factor of each mistake."""

from collections.abc import Iterable
from typing import NamedTuple

from ppafo.units import split_pressure_kind, to_si

_MISTAKEN = {
    "Pa": {unit: to_si(1.0, f"{unit}_d", "Pa_d") for unit in ("psi", "kPa", "bar", "MPa")},
    "rad": {unit: to_si(1.0, unit, "rad") for unit in ("deg", "rad")},
    "N m": {unit: to_si(1.0, unit, "N m") for unit in ("N cm", "N m")},
}
"""Units that are mistaken for each other, each with its value in SI, by SI unit."""


class MisreadUnit(NamedTuple):
    """Values of one unit read as another (``in_words``); ``factor`` is the reading divided by the true value [-]."""

    in_words: str
    factor: float

    @property
    def larger_factor(self) -> str:
        """Factor of the mistake in the direction in which it is above 1 [-], as text."""
        return f"{max(self.factor, 1.0 / self.factor):.4g}"


def misread_units(si_unit: str, stated: Iterable[str]) -> list[MisreadUnit]:
    """Return the unit mistakes of channels, given the units that their files state (empty if none).

    A channel without a stated unit, or in Pa, may have been converted before, from any unit.
    """
    units = {split_pressure_kind(unit)[0] for unit in stated} - {"", "Pa"}
    scales = _MISTAKEN.get(si_unit.removesuffix("_d"), {})
    return [
        MisreadUnit(f"{true} read as {read}", scales[read] / scales[true])
        for true in scales
        for read in scales
        if true != read and units <= {read}
    ]
