"""On/off control on whole numbers, equation (14), and the one with a dead zone and hysteresis."""

from collections.abc import Mapping
from typing import NamedTuple

from ppafo.control.controllers.on_off import KIND as FLOAT_KIND
from ppafo.control.controllers.on_off_dead_zone import KIND as FLOAT_DEAD_ZONE
from ppafo.control.fixed.converter import (
    COMMAND_STEPS,
    LARGEST_READING,
    OF_CONVERTER,
    Converter,
    Limits,
    Readings,
    error_of,
    limits_of,
    read,
    still_sound,
)
from ppafo.control.fixed.kind import FixedLaw
from ppafo.control.kind import ControllerKind
from ppafo.model.declaration import Quantity
from ppafo.model.sensors import Measurement


class OnOffNumbers(NamedTuple):
    """Limits of the readings."""

    limits: Limits


class OnOffCounts(NamedTuple):
    """1 while all readings have been sound."""

    sound: int


class OnOffRows(NamedTuple):
    """The converter."""

    converter: Converter


class OnOffStateRows(NamedTuple):
    """``OnOffCounts`` as the lanes keep it."""

    sound: float


class DeadZoneNumbers(NamedTuple):
    """Limits of the readings; errors at which the valve opens and closes again [counts]; opening [steps]."""

    limits: Limits
    dead_zone: int
    release: int
    opening: int


class DeadZoneCounts(NamedTuple):
    """Direction in which the valve is open, 1, 0 or -1; 1 while all readings have been sound."""

    direction: int
    sound: int


class DeadZoneRows(NamedTuple):
    """The converter, and ``DeadZoneNumbers`` without the limits, as the lanes keep them."""

    converter: Converter
    dead_zone: float
    release: float
    opening: float


class DeadZoneStateRows(NamedTuple):
    """``DeadZoneCounts`` as the lanes keep them."""

    direction: float
    sound: float


def sample(numbers: OnOffNumbers, state: OnOffCounts, readings: Readings) -> tuple[int, OnOffCounts]:
    """Command in steps: 1000 where the error is 0 or more, else -1000; 0, for good, after a reading at an end."""
    sound = still_sound(state.sound, readings, numbers.limits)
    command = COMMAND_STEPS if error_of(readings, numbers.limits) >= 0 else -COMMAND_STEPS
    return (command if sound == 1 else 0), OnOffCounts(sound)


def dead_zone_sample(numbers: DeadZoneNumbers, state: DeadZoneCounts, readings: Readings) -> tuple[int, DeadZoneCounts]:
    """Command in steps: the opening, towards the reference, beyond the dead zone; 0, for good, after a bad reading."""
    sound = still_sound(state.sound, readings, numbers.limits)
    error = error_of(readings, numbers.limits)
    limit_up = numbers.release if state.direction > 0 else numbers.dead_zone
    limit_down = numbers.release if state.direction < 0 else numbers.dead_zone
    direction = 1 if error > limit_up else (-1 if error < -limit_down else 0)
    opening = numbers.opening if direction > 0 else (-numbers.opening if direction < 0 else 0)
    return (opening if sound == 1 else 0), DeadZoneCounts(direction=direction, sound=sound)


def update(
    parameters: OnOffRows, state: OnOffStateRows, reference: float, measurement: Measurement, period: float
) -> tuple[float, OnOffStateRows]:
    """Command from -1 to 1 that ``sample`` gives for what the converter shows."""
    converter = parameters.converter
    numbers = OnOffNumbers(limits_of(converter))
    command, after = sample(numbers, OnOffCounts(int(state.sound)), read(converter, reference, measurement))
    return float(command) / COMMAND_STEPS, OnOffStateRows(float(after.sound))


def dead_zone_update(
    parameters: DeadZoneRows, state: DeadZoneStateRows, reference: float, measurement: Measurement, period: float
) -> tuple[float, DeadZoneStateRows]:
    """Command from -1 to 1 that ``dead_zone_sample`` gives for what the converter shows."""
    converter = parameters.converter
    numbers = DeadZoneNumbers(
        limits=limits_of(converter),
        dead_zone=int(parameters.dead_zone),
        release=int(parameters.release),
        opening=int(parameters.opening),
    )
    before = DeadZoneCounts(direction=int(state.direction), sound=int(state.sound))
    command, after = dead_zone_sample(numbers, before, read(converter, reference, measurement))
    return float(command) / COMMAND_STEPS, DeadZoneStateRows(float(after.direction), float(after.sound))


def prepare(settings: Mapping[str, float], period: float, torque_step: float) -> tuple[float, ...]:
    """The law has no numbers but those of the converter."""
    return ()


def prepare_dead_zone(settings: Mapping[str, float], period: float, torque_step: float) -> tuple[float, ...]:
    """Numbers of ``DeadZoneRows`` after the converter, for settings in SI units and a torque per count [N m]."""
    zone, release = settings["dead_zone"], min(settings["release"], settings["dead_zone"])
    counts = [float(min(LARGEST_READING, int(torque / torque_step + 0.5))) for torque in (zone, release)]
    return (*counts, float(int(settings["opening"] * COMMAND_STEPS + 0.5)))


def largest(settings: Mapping[str, float], period: float, torque_step: float) -> float:
    """Nothing that a number could not hold."""
    return 0.0


def largest_dead_zone(settings: Mapping[str, float], period: float, torque_step: float) -> float:
    """The dead zone over what its number can hold [-]."""
    return settings["dead_zone"] / torque_step / LARGEST_READING


_READING, _STEPS = float(LARGEST_READING), float(COMMAND_STEPS)
ON_OFF = FixedLaw(
    kind=ControllerKind(
        name=FLOAT_KIND.name,
        summary=FLOAT_KIND.summary,
        source=FLOAT_KIND.source,
        quantities=OF_CONVERTER,
        parameters=OnOffRows,
        initial=OnOffStateRows(1.0),
        update=update,
        only_switches=True,
    ),
    sample=sample,
    numbers=OnOffNumbers,
    state_ranges={"sound": (0, 1)},
    prepare=prepare,
    largest=largest,
)
DEAD_ZONE = FixedLaw(
    kind=ControllerKind(
        name=FLOAT_DEAD_ZONE.name,
        summary=FLOAT_DEAD_ZONE.summary,
        source=FLOAT_DEAD_ZONE.source,
        quantities=(
            *OF_CONVERTER,
            Quantity("dead_zone", "", "error at which the valve opens, in counts", None, 0.0, _READING),
            Quantity("release", "", "error at which it closes again, in counts", None, 0.0, _READING),
            Quantity("opening", "", "command while it is open, in steps", None, 0.0, _STEPS),
        ),
        parameters=DeadZoneRows,
        initial=DeadZoneStateRows(0.0, 1.0),
        update=dead_zone_update,
        only_switches=True,
    ),
    sample=dead_zone_sample,
    numbers=DeadZoneNumbers,
    state_ranges={"direction": (-1, 1), "sound": (0, 1)},
    prepare=prepare_dead_zone,
    largest=largest_dead_zone,
)
