"""Profiles that are a formula: a level that never changes, ramp and hold (the paper's torque task), a sine."""

from typing import NamedTuple

from ppafo.control.kind import ProfileKind
from ppafo.model.declaration import Quantity
from ppafo.model.turns import TURN, sine_and_cosine


class ConstantProfile(NamedTuple):
    """The level."""

    level: float


def constant_value(profile: ConstantProfile, time: float) -> tuple[float, float, float]:
    """Level [N m or rad], rate 0 and second derivative 0."""
    return profile.level, 0.0, 0.0


def constant_bounds(profile: ConstantProfile) -> tuple[float, float]:
    """The level [N m or rad], twice."""
    return profile.level, profile.level


CONSTANT = ProfileKind(
    name="constant",
    summary="One level from beginning to end.",
    quantities=(Quantity("level", "", "the level"),),
    parameters=ConstantProfile,
    value=constant_value,
    bounds=constant_bounds,
    is_monotone=True,
)


class RampHold(NamedTuple):
    """Level before the ramp and after it, start of the ramp and its length [s]."""

    start_level: float
    level: float
    ramp_start: float
    ramp_time: float


def ramp_hold_value(profile: RampHold, time: float) -> tuple[float, float, float]:
    """Value, rate and second derivative (0 also at the corners) at a time [s]."""
    gain = profile.level - profile.start_level
    progress = (time - profile.ramp_start) / profile.ramp_time
    inside = progress >= 0.0 and progress < 1.0
    fraction = max(0.0, min(1.0, progress))
    return profile.start_level + gain * fraction, (gain / profile.ramp_time if inside else 0.0), 0.0


def ramp_hold_bounds(profile: RampHold) -> tuple[float, float]:
    """The lower and the higher level [N m or rad]."""
    return min(profile.start_level, profile.level), max(profile.start_level, profile.level)


RAMP_HOLD = ProfileKind(
    name="ramp_hold",
    summary="A level, a straight ramp to another level, and a hold.",
    quantities=(
        Quantity("start_level", "", "level before the ramp", 0.0),
        Quantity("level", "", "level of the hold"),
        Quantity("ramp_start", "s", "time at which the ramp starts", 0.0, 0.0, 1.0e6),
        Quantity("ramp_time", "s", "length of the ramp", 1.0, 1.0e-6, 1.0e6),
    ),
    parameters=RampHold,
    value=ramp_hold_value,
    bounds=ramp_hold_bounds,
    is_monotone=True,
)


class Sine(NamedTuple):
    """Mean level, amplitude, frequency [Hz] and phase [turns]."""

    level: float
    amplitude: float
    frequency: float
    phase: float


def sine_value(profile: Sine, time: float) -> tuple[float, float, float]:
    """Value, rate and second derivative at a time [s]."""
    angular = TURN * profile.frequency
    sine, cosine = sine_and_cosine(profile.frequency * time + profile.phase)
    swing = profile.amplitude * sine
    return profile.level + swing, angular * profile.amplitude * cosine, -angular * angular * swing


def sine_bounds(profile: Sine) -> tuple[float, float]:
    """Lowest and highest sine_value [N m or rad]."""
    swing = abs(profile.amplitude)
    return profile.level - swing, profile.level + swing


SINE = ProfileKind(
    name="sine",
    summary="A sine about a mean level.",
    quantities=(
        Quantity("level", "", "mean level", 0.0),
        Quantity("amplitude", "", "amplitude"),
        Quantity("frequency", "Hz", "frequency", 1.0, 0.0, 100.0),
        Quantity("phase", "1", "phase in turns; 0.25 starts at the crest", 0.0, -1.0, 1.0),
    ),
    parameters=Sine,
    value=sine_value,
    bounds=sine_bounds,
)
