"""Settings of a walk that contradict each other: refused before the run, in one line that names both."""

from collections.abc import Iterator, Mapping

from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.errors import ScenarioError
from ppafo.simulation.reading import Reading, short_quantity_text
from ppafo.walking.configuration import Configuration
from ppafo.walking.fixed_point import check_fixed_walk
from ppafo.walking.planning import walking_valve

_NEWTON, _RADIAN, _SECOND, _METRE, _PASCAL = "N", "rad", "s", "m", "Pa_a"

COMPRESSION = 1.6
"""Highest pressure in a chamber over that of the supply, with room: up to 1.38 in the shipped walks."""


def check_walk(configuration: Configuration, reading: Reading) -> None:
    """Raise ScenarioError with the first contradiction; ``reading`` tells how a value was given."""
    for path, reason in _contradictions(configuration):
        raise reading.refusal(path, reason) if _is_given(reading, path) else _of_default(reading, path, reason)
    check_fixed_walk(configuration)


def _is_given(reading: Reading, path: str) -> bool:
    section, _, name = path.partition(".")
    table = reading.document.get(section)
    return isinstance(table, Mapping) and name in table


def _of_default(reading: Reading, path: str, reason: str) -> ScenarioError:
    return ScenarioError(f"{reading.file}: {path}, which is not given and takes its default: {reason}")


def _contradictions(configuration: Configuration) -> Iterator[tuple[str, str]]:
    yield from _segments(configuration)
    yield from _valve(configuration)
    if "load_threshold" in configuration.settings:
        yield from _thresholds(configuration)
        yield from _times(configuration)
        yield from _angles(configuration)
        yield from _gait(configuration)
        yield from _pressures(configuration)
    if "push_off_end" in configuration.settings:
        yield from _push_off(configuration.settings)
    if "peak_time" in configuration.settings:
        yield from _profile(configuration.settings)


def _segments(configuration: Configuration) -> Iterator[tuple[str, str]]:
    wearer = configuration.wearer
    if wearer.shank_mass_centre > wearer.shank_length:
        length = short_quantity_text(wearer.shank_length, _METRE)
        yield "wearer.shank_mass_centre", f"lies beyond the ankle: wearer.shank_length is {length}"
    if wearer.foot_mass_centre > wearer.toe_lever:
        lever = short_quantity_text(wearer.toe_lever, _METRE)
        yield "wearer.foot_mass_centre", f"lies beyond the toes: wearer.toe_lever is {lever}"


def _valve(configuration: Configuration) -> Iterator[tuple[str, str]]:
    valve = configuration.device.valve.kind
    if valve != "proportional" and not configuration.controller.only_switches:
        fitting = " or ".join(sorted(kind.name for kind in WALKING_CONTROLLERS.values() if kind.only_switches))
        remedy = f"take device.valve 'proportional', or controller.kind {fitting}"
        yield "controller.kind", f"opens its valve gradually, which a {valve} valve cannot: {remedy}"


def _thresholds(configuration: Configuration) -> Iterator[tuple[str, str]]:
    settings = configuration.settings
    load, unload = settings["load_threshold"], settings["unload_threshold"]
    if unload >= load:
        yield (
            "controller.unload_threshold",
            f"must be below controller.load_threshold, which is {short_quantity_text(load, _NEWTON)}",
        )
    if settings["largest_force"] <= load:
        yield (
            "controller.largest_force",
            f"must be above controller.load_threshold, which is {short_quantity_text(load, _NEWTON)}",
        )


def _times(configuration: Configuration) -> Iterator[tuple[str, str]]:
    settings, stride = configuration.settings, configuration.gait.stride_time
    if not 0.5 * stride < settings["first_stride_time"] < 2.0 * stride:
        stride_text = short_quantity_text(round(stride, 4), _SECOND)
        yield (
            "controller.first_stride_time",
            f"must be between half and twice the stride of the gait, which is {stride_text}",
        )
    if settings["flat_from"] >= settings["flat_to"]:
        yield "controller.flat_from", f"must be below controller.flat_to, which is {settings['flat_to']:g}"
    delay = walking_valve(configuration.device.valve).command_delay(configuration.device.valve.settings)
    for name in ("fill_time", "vent_time"):
        if settings[name] <= delay:
            dead = short_quantity_text(delay, _SECOND)
            yield f"controller.{name}", f"must be longer than the dead time of the valve, which is {dead}"
    if settings["frozen_time"] <= 2.0 * configuration.period:
        sample = short_quantity_text(configuration.period, _SECOND)
        yield "controller.frozen_time", f"must be longer than two sample periods of the controller, {sample} each"


def _angles(configuration: Configuration) -> Iterator[tuple[str, str]]:
    settings, actuator = configuration.settings, configuration.device.actuator
    low, high = settings["lowest_angle"], settings["highest_angle"]
    if low >= high:
        yield (
            "controller.lowest_angle",
            f"must be below controller.highest_angle, which is {short_quantity_text(high, _RADIAN)}",
        )
    low, high = max(low, actuator.angle_min), min(high, actuator.angle_max)
    if not low < settings["swing_angle"] < high:
        reach = f"{short_quantity_text(low, _RADIAN)} to {short_quantity_text(high, _RADIAN)}"
        yield "controller.swing_angle", f"lies outside the range of sensor and device, {reach}"


def _gait(configuration: Configuration) -> Iterator[tuple[str, str]]:
    gait = configuration.gait
    if gait.vertical_force is None:
        reason = (
            f"needs force sensors, and gait '{gait.name}' has no vertical_force; import it with the ground reaction, "
            "or take controller.kind=off"
        )
        yield "controller.kind", reason


def _pressures(configuration: Configuration) -> Iterator[tuple[str, str]]:
    settings, supply = configuration.settings, configuration.device.supply
    atmosphere = short_quantity_text(supply.atmospheric_pressure, _PASCAL)
    lowest = min(supply.pressure, supply.dorsiflexion_pressure)
    highest = max(supply.pressure, supply.dorsiflexion_pressure)
    if settings["lowest_pressure"] >= supply.atmospheric_pressure:
        yield "controller.lowest_pressure", f"must be below the atmosphere, which is {atmosphere}"
    if not supply.atmospheric_pressure < settings["filled_pressure"] < lowest:
        fed = short_quantity_text(lowest, _PASCAL)
        yield "controller.filled_pressure", f"must be between atmosphere and supply, which are {atmosphere} and {fed}"
    compressed = highest * COMPRESSION
    if settings["highest_pressure"] <= compressed:
        limit = short_quantity_text(compressed, _PASCAL)
        yield "controller.highest_pressure", f"must be above {limit}: a moving foot compresses the gas in a chamber"


def _push_off(settings: Mapping[str, float]) -> Iterator[tuple[str, str]]:
    start, end = settings["push_off_start"], settings["push_off_end"]
    if end <= start:
        yield "controller.push_off_end", f"must be above controller.push_off_start, which is {start:g}"


def _profile(settings: Mapping[str, float]) -> Iterator[tuple[str, str]]:
    peak, rise, fall = settings["peak_time"], settings["rise_time"], settings["fall_time"]
    if rise > peak:
        yield "controller.rise_time", f"the torque would rise before the heel strike: controller.peak_time is {peak:g}"
    if peak + fall > 1.0:
        yield "controller.peak_time", f"with controller.fall_time {fall:g} the torque would end after the stride"
    if peak < settings["push_off_start"]:
        start = settings["push_off_start"]
        yield (
            "controller.peak_time",
            f"the peak would be over before the push-off: controller.push_off_start is {start:g}",
        )
