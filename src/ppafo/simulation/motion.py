"""What the vane does, read from a scenario and checked against the stops of the device."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ppafo.control.catalog import PROFILES
from ppafo.engine.rows import rebuilt
from ppafo.errors import DataError, ScenarioError, one_line
from ppafo.model.declaration import Quantity
from ppafo.model.gait import ShankSeries
from ppafo.parameters.device import Device
from ppafo.simulation.declaration import (
    ANGLE,
    ANGLE_LEVEL,
    FREE,
    GAIT_SHANK,
    LEG,
    Reading,
    kind_at,
    profile_settings,
    quantity_text,
    shank_settings,
    value_at,
)
from ppafo.simulation.scenario import FreeMotion, Leg, PrescribedMotion, ProfileChoice

MAXIMUM_CHECKED_TIMES = 20_000
TOLERANCE = 1.0e-9
_ANGLE_PATH = "motion.angle"


def read_motion(
    reading: Reading, device: Device, duration: float, step: float, folder: Path
) -> FreeMotion | PrescribedMotion:
    """Return the motion of the vane; every angle [rad] that it prescribes lies between the stops of the device.

    ScenarioError where one does not. ``duration`` and ``step`` are in seconds; in ``folder`` relative paths begin.
    """
    kind = kind_at(reading.document, "motion")
    if kind == "prescribed":
        profile = read_profile(reading, "motion.profile", ANGLE_LEVEL)
        problem = profile_problem(device.name, _stops(device), profile, duration, step)
        if problem:
            raise ScenarioError(f"{reading.file}: {problem}")
        return PrescribedMotion(profile)
    angle = reading.number(_ANGLE_PATH, ANGLE)
    if not (device.actuator.angle_min - TOLERANCE <= angle <= device.actuator.angle_max + TOLERANCE):
        raise reading.refusal(_ANGLE_PATH, f"must be between the stops of {device.name}, {_range_text(_stops(device))}")
    if kind == "locked":
        return PrescribedMotion(ProfileChoice("constant", {"level": angle}), kind)
    if kind == "leg":
        numbers = reading.section("motion", LEG)
        start, rate = numbers.pop("angle"), numbers.pop("angular_velocity")
        return FreeMotion(start, rate, leg=_read_leg(reading, numbers, folder))
    numbers = reading.section("motion", FREE)
    return FreeMotion(numbers["angle"], numbers["angular_velocity"], numbers["external_torque"])


def _read_leg(reading: Reading, numbers: dict[str, Any], folder: Path) -> Leg:
    """Return a leg with these numbers of its foot, whose shank goes along a profile without corners or as in a gait."""
    section = "motion.shank"
    kind = kind_at(reading.document, section)
    shank = ProfileChoice(kind, reading.section(section, shank_settings(kind)))
    if kind != GAIT_SHANK:
        if not PROFILES[kind].is_smooth:
            smooth = ", ".join([name for name, item in PROFILES.items() if item.is_smooth] + [GAIT_SHANK])
            raise reading.refusal(
                f"{section}.kind", f"this profile has corners, at which the foot would be struck; use one of {smooth}"
            )
        return Leg(**numbers, shank=shank)
    # A vane alone, or on a shank at rest, loads no gaits.
    from ppafo.gait import list_gaits, load_gait, series_of

    name = str(value_at(reading.document, f"{section}.gait"))
    try:
        gait = load_gait(name if name in list_gaits() else folder / name)
    except DataError as error:
        raise reading.refusal(f"{section}.gait", one_line(error)) from error
    series = ShankSeries(
        frequency=1.0 / gait.stride_time,
        start=shank.start,
        toe_lever=numbers["toe_lever"],
        shank=series_of(gait, "shank_angle"),
        ankle=series_of(gait, "ankle_angle"),
        knee_forward=series_of(gait, "knee_forward"),
        knee_up=series_of(gait, "knee_up"),
    )
    return Leg(**numbers, shank=shank, gait=gait.name, curves=series)


def read_profile(reading: Reading, section: str, prescribed: Quantity) -> ProfileChoice:
    """Return a function of time with all its settings in SI."""
    kind = kind_at(reading.document, section)
    return ProfileChoice(kind, reading.section(section, profile_settings(kind, prescribed)))


def profile_problem(
    device: str, stops: tuple[float, float], profile: ProfileChoice, duration: float, step: float
) -> str:
    """Return where a profile leaves the stops [rad] of a device, named by ``device``; an empty text if nowhere."""
    for time, angle in _angles(profile, duration, step):
        if not stops[0] - TOLERANCE <= angle <= stops[1] + TOLERANCE:
            return (
                f"[motion.profile] leaves the stops of {device}, {_range_text(stops)}: it is at "
                f"{quantity_text(angle, 'rad')} at {time:.6g} s"
            )
    return ""


def _angles(profile: ProfileChoice, duration: float, step: float) -> Iterator[tuple[float, float]]:
    """Yield times and angles [rad]: those that the engine asks for, and the crests between them."""
    kind = PROFILES[profile.kind]
    parameters = rebuilt(kind.parameters, [profile.settings[item.name] for item in kind.quantities])
    count = max(1, min(MAXIMUM_CHECKED_TIMES, round(duration / step)))
    for number in range(count + 1):
        time = duration * number / count
        angle, rate, acceleration = kind.value(parameters, time)
        yield time, angle
        away = -rate / acceleration if acceleration else 0.0
        if 0.0 < away < min(duration / count, duration - time):
            yield time + away, angle + 0.5 * rate * away


def _stops(device: Device) -> tuple[float, float]:
    return device.actuator.angle_min, device.actuator.angle_max


def _range_text(stops: tuple[float, float]) -> str:
    return f"{quantity_text(stops[0], 'rad')} to {quantity_text(stops[1], 'rad')}"
