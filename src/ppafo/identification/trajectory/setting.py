"""What a section [trajectory] leans on, and how its texts with units are read."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import DataError, IdentificationError, UnitError, nearest_name
from ppafo.identification.estimate import Estimate
from ppafo.identification.source import Source
from ppafo.identification.trajectory.section import ExperimentSection
from ppafo.parameters.parameter_set import ParameterSet
from ppafo.units import parse_quantity

_NOISE_UNITS = {"angle": "rad", "pressure_1": "Pa_d", "pressure_2": "Pa_d"}


@dataclass(frozen=True, slots=True)
class Setting:
    """What a section leans on.

    ``read`` gives the recording of an experiment, ``folder`` is where paths of scenarios begin, ``file`` what messages
    call the section. ``parameter_set`` takes the place of the sets that scenarios name, ``valve`` that of their valves.
    ``bench`` are estimates that came before, by path.
    """

    read: Callable[[ExperimentSection], Source]
    folder: Path
    file: str
    parameter_set: ParameterSet | None = None
    valve: str | None = None
    bench: Mapping[str, Estimate] = field(default_factory=dict)


@contextmanager
def told_of(file: str) -> Iterator[None]:
    """Begin the line of every refusal with the file, where it does not yet."""
    try:
        yield
    except (IdentificationError, DataError) as error:
        if str(error).startswith(file):
            raise
        raise type(error)(f"{file}: {error}") from error


def quantity_of(said: str, text: str, unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
    """Return the number in a text in ``unit``, or refuse it; ``said`` is file and key."""
    try:
        return parse_quantity(text, unit, atmosphere)
    except UnitError as error:
        raise IdentificationError(f"{said} = '{text}': {error}") from error


def noise_of_channels(given: Mapping[str, str], said: str) -> dict[str, float]:
    """Return the standard deviations [rad], [Pa] that are given by channel."""
    for name in given:
        if name not in _NOISE_UNITS:
            hint = nearest_name(name, _NOISE_UNITS)
            raise IdentificationError(f"{said}: noise of '{name}'{hint}: only {', '.join(_NOISE_UNITS)} have one here")
    return {name: quantity_of(f"{said}: noise.{name}", text, _NOISE_UNITS[name]) for name, text in given.items()}
