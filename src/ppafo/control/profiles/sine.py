"""A sine about a mean level."""

from typing import NamedTuple

from ppafo.control.kind import ProfileKind
from ppafo.model.declaration import Quantity
from ppafo.model.turns import TURN, sine_and_cosine


class Sine(NamedTuple):
    """Mean level, amplitude, frequency [Hz] and phase [turns]."""

    level: float
    amplitude: float
    frequency: float
    phase: float


def value(profile: Sine, time: float) -> tuple[float, float, float]:
    """Value, rate and second derivative at a time [s]."""
    angular = TURN * profile.frequency
    sine, cosine = sine_and_cosine(profile.frequency * time + profile.phase)
    swing = profile.amplitude * sine
    return profile.level + swing, angular * profile.amplitude * cosine, -angular * angular * swing


def bounds(profile: Sine) -> tuple[float, float]:
    """Lowest and highest value [N m or rad]."""
    swing = abs(profile.amplitude)
    return profile.level - swing, profile.level + swing


KIND = ProfileKind(
    name="sine",
    summary="A sine about a mean level.",
    quantities=(
        Quantity("level", "", "mean level", 0.0),
        Quantity("amplitude", "", "amplitude"),
        Quantity("frequency", "Hz", "frequency", 1.0, 0.0, 100.0),
        Quantity("phase", "1", "phase in turns; 0.25 starts at the crest", 0.0, -1.0, 1.0),
    ),
    parameters=Sine,
    value=value,
    bounds=bounds,
)
