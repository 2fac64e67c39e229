"""A sine about a mean level."""

from typing import NamedTuple

from ppafo.control.kind import ProfileKind
from ppafo.model.declaration import Quantity

TURN = 6.283185307179586


class Sine(NamedTuple):
    """Mean level, amplitude, frequency [Hz] and phase [turns]."""

    level: float
    amplitude: float
    frequency: float
    phase: float


def sine_and_cosine(turns: float) -> tuple[float, float]:
    """Sine and cosine of a number of turns, good to 1e-9: power series within a quarter turn of the nearest half turn.

    A library sine cannot run in many lanes at once.
    """
    half_turns = float(int(2.0 * turns + (0.5 if turns >= 0.0 else -0.5)))
    odd = half_turns - 2.0 * float(int(0.5 * half_turns))
    sign = 1.0 - 2.0 * odd * odd
    angle = TURN * (turns - 0.5 * half_turns)
    square = angle * angle
    sine = -1.0 / 1307674368000.0 * square + 1.0 / 6227020800.0
    sine = sine * square - 1.0 / 39916800.0
    sine = sine * square + 1.0 / 362880.0
    sine = sine * square - 1.0 / 5040.0
    sine = sine * square + 1.0 / 120.0
    sine = sine * square - 1.0 / 6.0
    sine = (sine * square + 1.0) * angle
    cosine = -1.0 / 87178291200.0 * square + 1.0 / 479001600.0
    cosine = cosine * square - 1.0 / 3628800.0
    cosine = cosine * square + 1.0 / 40320.0
    cosine = cosine * square - 1.0 / 720.0
    cosine = cosine * square + 1.0 / 24.0
    cosine = cosine * square - 0.5
    cosine = cosine * square + 1.0
    return sign * sine, sign * cosine


def value(profile: Sine, time: float) -> tuple[float, float, float]:
    """Value, rate and second derivative at a time [s]."""
    angular = TURN * profile.frequency
    sine, cosine = sine_and_cosine(profile.frequency * time + profile.phase)
    swing = profile.amplitude * sine
    return profile.level + swing, angular * profile.amplitude * cosine, -angular * angular * swing


def bounds(profile: Sine) -> tuple[float, float]:
    """Trough and crest."""
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
