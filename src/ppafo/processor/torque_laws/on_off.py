"""On/off control in integer arithmetic: equation (14), and its form with a dead zone and hysteresis.

Errors are in counts of the converter, commands in steps of 1/1000.
"""

from collections.abc import Mapping
from typing import Annotated, NamedTuple

from ppafo.control.controllers.switching import ON_OFF as FLOAT_ON_OFF
from ppafo.control.controllers.switching import ON_OFF_DEAD_ZONE as FLOAT_DEAD_ZONE
from ppafo.engine.composer import each
from ppafo.model.declaration import Number
from ppafo.model.sensors import Measurement
from ppafo.processor.fixed_point import (
    COMMAND_STEPS,
    LARGEST_READING,
    ConverterCounts,
    ConverterLimits,
    CountResolution,
    Flag,
    error_of,
    read,
    still_sound,
)
from ppafo.processor.torque_laws.law import fixed_law


class _OnOffNumbers(NamedTuple):
    """Numbers of the on/off law: limits of the readings."""

    limits: ConverterLimits


class _OnOffCounts(NamedTuple):
    """State of the on/off law: 1 while all readings were valid."""

    sound: Flag


class _OnOffRows(NamedTuple):
    """Parameter row of the on/off law: converter resolution, and numbers of ``on_off_sample``."""

    steps: CountResolution
    numbers: _OnOffNumbers


def on_off_sample(numbers: _OnOffNumbers, state: _OnOffCounts, readings: ConverterCounts) -> tuple[int, _OnOffCounts]:
    """Return the command [steps]: 1000 for an error of 0 or more, else -1000; 0 for good after a bad reading."""
    sound = still_sound(state.sound, readings, numbers.limits)
    command = COMMAND_STEPS if error_of(readings, numbers.limits) >= 0 else -COMMAND_STEPS
    return (command if sound == 1 else 0), _OnOffCounts(sound)


def on_off_update(
    parameters: _OnOffRows, state: _OnOffCounts, reference: float, measurement: Measurement, period: float
) -> tuple[float, _OnOffCounts]:
    """Return the command from -1 to 1 of ``on_off_sample`` for converter readings."""
    readings = read(parameters.steps, parameters.numbers.limits, reference, measurement)
    command, after = on_off_sample(each(int, parameters.numbers), each(int, state), readings)
    return float(command) / COMMAND_STEPS, each(float, after)


ON_OFF = fixed_law(FLOAT_ON_OFF, "on_off_fixed_point", _OnOffRows, _OnOffCounts(1), on_off_sample, on_off_update)
ON_OFF_FIXED_POINT = ON_OFF.kind


class _DeadZoneNumbers(NamedTuple):
    """Numbers of the dead-zone law: reading limits, opening and closing errors [counts], opening [steps]."""

    limits: ConverterLimits
    dead_zone: Annotated[
        int, Number("", "error at which the valve opens, in counts", None, 0.0, float(LARGEST_READING))
    ]
    release: Annotated[int, Number("", "error at which it closes again, in counts", None, 0.0, float(LARGEST_READING))]
    opening: Annotated[int, Number("", "command while it is open, in steps", None, 0.0, float(COMMAND_STEPS))]


class _DeadZoneCounts(NamedTuple):
    """State of the dead-zone law: opening direction 1, 0 (closed) or -1, and 1 while all readings were valid."""

    direction: Annotated[int, Number("", "direction of opening", None, -1.0, 1.0)]
    sound: Flag


class _DeadZoneRows(NamedTuple):
    """Parameter row of the dead-zone law: converter resolution, and numbers of ``dead_zone_sample``."""

    steps: CountResolution
    numbers: _DeadZoneNumbers


def dead_zone_sample(
    numbers: _DeadZoneNumbers, state: _DeadZoneCounts, readings: ConverterCounts
) -> tuple[int, _DeadZoneCounts]:
    """Return the command [steps]: opening towards an error beyond the dead zone; 0 for good after a bad reading."""
    sound = still_sound(state.sound, readings, numbers.limits)
    error = error_of(readings, numbers.limits)
    # Hysteresis: the valve closes at the release, nearer to the reference than where it opens.
    limit_up = numbers.release if state.direction > 0 else numbers.dead_zone
    limit_down = numbers.release if state.direction < 0 else numbers.dead_zone
    direction = 1 if error > limit_up else (-1 if error < -limit_down else 0)
    opening = numbers.opening if direction > 0 else (-numbers.opening if direction < 0 else 0)
    return (opening if sound == 1 else 0), _DeadZoneCounts(direction=direction, sound=sound)


def dead_zone_update(
    parameters: _DeadZoneRows, state: _DeadZoneCounts, reference: float, measurement: Measurement, period: float
) -> tuple[float, _DeadZoneCounts]:
    """Return the command from -1 to 1 of ``dead_zone_sample`` for converter readings."""
    readings = read(parameters.steps, parameters.numbers.limits, reference, measurement)
    command, after = dead_zone_sample(each(int, parameters.numbers), each(int, state), readings)
    return float(command) / COMMAND_STEPS, each(float, after)


def prepare_dead_zone(settings: Mapping[str, float], period: float, torque_step: float) -> tuple[float, ...]:
    """Return the numbers of ``_DeadZoneNumbers`` after the limits, from settings [SI] and torque per count [N m]."""
    # A release beyond the dead zone would close the valve before it opens.
    zone = settings["dead_zone"]
    release = min(settings["release"], settings["dead_zone"])
    counts = [float(min(LARGEST_READING, int(torque / torque_step + 0.5))) for torque in (zone, release)]
    return (*counts, float(int(settings["opening"] * COMMAND_STEPS + 0.5)))


def largest_dead_zone(settings: Mapping[str, float], period: float, torque_step: float) -> float:
    """Return the dead zone relative to the largest representable value [-]."""
    return settings["dead_zone"] / torque_step / LARGEST_READING


DEAD_ZONE = fixed_law(
    FLOAT_DEAD_ZONE,
    "on_off_dead_zone_fixed_point",
    _DeadZoneRows,
    _DeadZoneCounts(0, 1),
    dead_zone_sample,
    dead_zone_update,
    prepare_dead_zone,
    largest_dead_zone,
)
DEAD_ZONE_FIXED_POINT = DEAD_ZONE.kind
