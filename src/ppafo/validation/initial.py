"""Initial values of a replay that were not recorded: allowed channels, and parsing of their texts."""

from collections.abc import Sequence

from ppafo.arguments.door import argument_text
from ppafo.errors import DataError, UnitError, refused_as
from ppafo.units import parse_quantity
from ppafo.validation.compared import ANGLE, PRESSURE_1, PRESSURE_2
from ppafo.wording import nearest_name, one_line

_UNITS = {ANGLE: "rad", PRESSURE_1: "Pa_a", PRESSURE_2: "Pa_a"}
_EXAMPLES = {ANGLE: "angle=75 deg", PRESSURE_1: "pressure_1=0 psi_g", PRESSURE_2: "pressure_2=50 psi_g"}


def initial_remedies() -> dict[str, str]:
    """Return, by channel, the remedy to show if the initial value of a replay was not recorded."""
    return {name: f"give its initial value, {argument_text('initial', example)}" for name, example in _EXAMPLES.items()}


def parse_initial(texts: Sequence[str], atmosphere: float) -> dict[str, float]:
    """Return initial values [SI] by channel from texts such as ``pressure_1=0 psi_g``.

    Gauge pressures are relative to ``atmosphere`` [Pa absolute]. Raises DataError for an unknown channel, unit or form.
    """
    values = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals:
            raise DataError(
                f"initial value '{one_line(text)}' is not of the form CHANNEL=VALUE, for example '{_EXAMPLES[ANGLE]}'"
            )
        if name not in _UNITS:
            hint = nearest_name(name, _UNITS)
            raise DataError(
                f"initial value '{one_line(text)}': there is no channel '{one_line(name)}'{hint}; "
                f"available: {', '.join(_UNITS)}"
            )
        with refused_as(DataError, f"initial value '{one_line(text)}'", UnitError):
            values[name] = parse_quantity(value, _UNITS[name], atmosphere)
    return values
