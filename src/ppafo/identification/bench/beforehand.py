"""What recordings can give before anything is fitted: data, excitation, and which numbers they fix how well.

What is expected of an interval comes from the scatter of neighbouring samples and from the design: where the readings
lie, not what they say. Slow disturbances and a law that misses widen it later; nothing makes it narrower.
"""

import numpy as np

from ppafo.identification.bench.curve_fit import CLEARLY_WORSE
from ppafo.identification.bench.decay_motion import angle_of_decay
from ppafo.identification.bench.decay_samples import ANGLE, FEWEST_SAMPLES, Decay, decay_of, noise_of, smoothed_rates
from ppafo.identification.bench.free_decay import FreeDecaySettings
from ppafo.identification.bench.inputs import check_sources
from ppafo.identification.bench.leak_fits import Decay as LeakDecay
from ppafo.identification.bench.leak_laws import LAMINAR, LINEAR, decay_times
from ppafo.identification.bench.leak_samples import VaneLeakSettings, falling
from ppafo.identification.bench.leak_steady import CHANNELS as STEADY_CHANNELS
from ppafo.identification.bench.open_valve_flow import CHANNELS as FLOW_CHANNELS
from ppafo.identification.bench.open_valve_flow import OpenValveFlowSettings, open_readings, spans_enough
from ppafo.identification.bench.regression import labels_of, quantile
from ppafo.identification.bench.result import IDENTIFIED_WITHIN, WEAK_WITHIN
from ppafo.identification.bench.static_readings import Readings, readings_of
from ppafo.identification.bench.static_torque import CHANNELS, StaticTorqueSettings
from ppafo.identification.bench.valve_map import ValveMapSettings, is_two_way
from ppafo.identification.check import Prospect
from ppafo.identification.source import Source
from ppafo.signals.faults import is_at_limit, longest_gap, plateaus
from ppafo.signals.recording import Floats

_NO_SENSORS = ("command", "direction", "repetition")
_COARSE = 0.02
_SMALL_COMMAND = 0.2
_FEWEST_SMALL = 5


def data_prospects(sources: tuple[Source, ...]) -> tuple[Prospect, ...]:
    """Return what the sensors did not show: values beyond a limit, and what is finer than a converter's steps."""
    found = [
        prospect
        for source in sources
        for name in source.recording.names
        if name not in _NO_SENSORS
        for prospect in _of_sensor(source, name)
    ]
    if found:
        return tuple(found)
    count = sum(len(source.recording) for source in sources)
    pauses = [gap.duration for source in sources if (gap := longest_gap(source.recording.time)) is not None]
    pause = f"the longest pause is {max(pauses):.3g} s" if pauses else "no pause"
    return (Prospect("all samples", True, f"{count}; no sensor at its limit, no coarse converter, {pause}"),)


def _of_sensor(source: Source, name: str) -> list[Prospect]:
    values, found = source.recording[name], []
    for item in plateaus(values):
        if is_at_limit(values, item):
            text = f"{source.name}: it stays there for {item.count} samples, from sample {item.first + 1}: a limit"
            found.append(Prospect(f"'{name}' beyond {item.value:.6g}", False, text))
    step = _coarseness(values)
    if step > _COARSE and not found:
        text = f"{source.name}: its values are {step:.0%} of their range apart, a coarse converter"
        found.append(Prospect(f"'{name}' more finely", False, text))
    return found


def _coarseness(values: Floats) -> float:
    """Return the usual distance of neighbouring values over their range, where many samples share few values."""
    different = np.unique(values)
    if different.size < 2 or different.size > values.size / 10:
        return 0.0
    return float(np.median(np.diff(different)) / (different[-1] - different[0]))


def static_prospects(sources: tuple[Source, ...], settings: StaticTorqueSettings) -> tuple[Prospect, ...]:
    """Return how well torque constant, static friction and its growth can be had; intervals from scatter and design."""
    check_sources(sources, "static_torque", CHANNELS, 1)
    readings = readings_of(sources)
    design = np.stack(
        [
            readings.pressure,
            np.ones_like(readings.pressure),
            -readings.branch,
            -readings.branch * (readings.pressure - readings.middle),
        ],
        axis=1,
    )
    scale = np.sqrt((design**2).mean(axis=0))
    noise, means = _cells(readings)
    factor = quantile(settings.confidence, max(1, readings.pressure.size - 4)) * noise
    inverse = np.linalg.pinv((design / scale).T @ (design / scale))
    half = factor * np.sqrt(np.diag(inverse)) / scale
    span = float(np.ptp(readings.pressure))
    slope = float(np.polyfit(readings.pressure, readings.torque, 1)[0])
    levels = int(readings.levels.max()) + 1
    where = f"{levels} pressures over {span / 1e3:.3g} kPa"
    return (
        _expected("torque constant", half[0], slope, where),
        _expected("static friction", half[2], means, f"both branches at {where}"),
        Prospect(
            "growth of the friction",
            bool(levels > 2 and half[3] * span < abs(means)),
            f"{half[3] * span:.2g} N m from the lowest to the highest pressure would show",
        ),
    )


def _cells(readings: Readings) -> tuple[float, float]:
    """Return the scatter within pressures and branches [N m], about lines of their own, and half their distance."""
    cells = labels_of([readings.levels, (readings.branch > 0).astype(np.int64)])
    left, count = 0.0, 0
    for cell in range(int(cells.max()) + 1):
        x, y = readings.pressure[cells == cell], readings.torque[cells == cell]
        if y.size > 2 and np.ptp(x) > 0.0:
            y = y - np.polyval(np.polyfit(x - x.mean(), y, 1), x - x.mean())
        left, count = left + float(((y - y.mean()) ** 2).sum()), count + y.size - 1
    rising = readings.branch > 0
    line = np.polyfit(readings.pressure, readings.torque, 1)
    rest = readings.torque - np.polyval(line, readings.pressure)
    return float(np.sqrt(left / max(count, 1))), 0.5 * float(np.mean(rest[~rising]) - np.mean(rest[rising]))


def decay_prospects(sources: tuple[Source, ...], settings: FreeDecaySettings) -> tuple[Prospect, ...]:
    """Return how well damping and Coulomb friction can be had, and whether as more than ratios to the inertia."""
    check_sources(sources, "free_decay", (ANGLE,), FEWEST_SAMPLES)
    decays = [decay_of(source, settings.start, settings.end) for source in sources]
    information = np.zeros((2, 2))
    rate, deceleration = _roughly(decays[0])
    for decay in decays:
        speed = float(np.abs(smoothed_rates(decay.time, decay.angle)[0][:5]).max())
        information += _information(decay, speed, rate, deceleration)
    covariance = np.linalg.pinv(information)
    half = quantile(settings.confidence, sum(decay.time.size for decay in decays)) * np.sqrt(np.diag(covariance))
    likeness = float(covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1]))
    where = f"{decays[0].time[-1]:.3g} s of decay; errors of both go together with {likeness:+.2f}"
    known = settings.inertia is not None
    text = f"with an inertia of {settings.inertia:.4g} kg m^2" if known else "no inertia is known: only ratios to it"
    return (
        _expected("damping", half[0], rate, where),
        _expected("dynamic friction", half[1], deceleration, where),
        Prospect("absolute values", known, text),
    )


def _roughly(decay: Decay) -> tuple[float, float]:
    """Return damping rate [1/s] and deceleration [rad/s^2] from the slope of acceleration over velocity."""
    velocity, acceleration = smoothed_rates(decay.time, decay.sign * decay.angle)
    moving = velocity > 0.1 * velocity.max()
    slope, level = np.polyfit(velocity[moving], acceleration[moving], 1)
    longest = 1.0 / float(decay.time[-1])
    return max(-float(slope), 0.1 * longest), max(-float(level), 0.01 * longest * float(velocity.max()))


def _information(decay: Decay, speed: float, rate: float, deceleration: float) -> Floats:
    """Return the information of one decay on rate and deceleration, with start angle and speed unknown."""
    values = np.array([rate, deceleration, speed, 0.0])
    steps = np.array([1e-4 * rate, 1e-4 * deceleration, 1e-4 * speed, 1.0])

    def course(at: Floats) -> Floats:
        return angle_of_decay(decay.time, at[3], at[2], at[0], at[1])

    columns = [(course(values + step) - course(values - step)) / (2.0 * step.sum()) for step in np.diag(steps)]
    jacobian = np.stack(columns, axis=1) / noise_of(decay.angle)
    own, common = jacobian[:, 2:], jacobian[:, :2]
    kept = common - own @ np.linalg.lstsq(own, common, rcond=None)[0]
    return np.asarray(kept.T @ kept)


def flow_prospects(sources: tuple[Source, ...], settings: OpenValveFlowSettings) -> tuple[Prospect, ...]:
    """Return whether Cd A, Cd, and C with b can be had from the pressure ratios that were recorded."""
    check_sources(sources, "open_valve_flow", FLOW_CHANNELS, 1)
    readings = open_readings(sources)
    ratio = readings.ratio
    spread = f"{ratio.size} readings with the valve open, pressure ratios {ratio.min():.3g} to {ratio.max():.3g}"
    has_area = bool(settings.area)
    area = "over the area of the set" if has_area else "the set has no area of the valve: only the product Cd A"
    both = spans_enough(readings, settings.gas)
    needed = spread if both else f"{spread}: choked and subsonic flow are needed"
    return (
        Prospect("effective area", True, spread),
        Prospect("discharge coefficient", has_area, area),
        Prospect("C and b of ISO 6358", both, needed),
    )


def map_prospects(sources: tuple[Source, ...], _settings: ValveMapSettings) -> tuple[Prospect, ...]:
    """Return whether dead band, both directions and hysteresis can be had from the commands that were given."""
    command = np.concatenate([source.recording["command"] for source in sources])
    small = int((np.abs(command) < _SMALL_COMMAND).sum())
    low, high = float(command.min()), float(command.max())
    ways = is_two_way(sources)
    both = low < -0.1 and high > 0.1
    return (
        Prospect("dead band", small >= _FEWEST_SMALL, f"{small} commands below {_SMALL_COMMAND:g}"),
        Prospect("both directions", both, f"commands from {low:.3g} to {high:.3g}"),
        Prospect("hysteresis", ways, "commands rise and fall" if ways else "the command goes one way only"),
    )


def leak_prospects(sources: tuple[Source, ...], settings: VaneLeakSettings) -> tuple[Prospect, ...]:
    """Return whether an area can be had, and whether the laws of a leak can be told apart over these pressures."""
    if all("mass_flow" in source.recording for source in sources):
        check_sources(sources, "vane_leak", STEADY_CHANNELS, 1)
        pressures = np.concatenate([source.recording["pressure_1"] for source in sources])
        span = float(np.ptp(pressures) / pressures.max())
        return (Prospect("law of the leak", span > IDENTIFIED_WITHIN, f"steady flow over {span:.0%} of the pressure"),)
    decays, noise = falling(sources, settings)
    known = (settings.volume_1 if not decays or decays[0].emptying == 1 else settings.volume_2) is not None
    volume = "the volume is known" if known else "the volume is not known: only its ratio to the volume"
    listed = [Prospect("area of the leak", known, volume)]
    if not decays:
        return (
            *listed,
            Prospect("leak", False, "no pressure difference falls by more than the noise: an upper bound only"),
        )
    gain = min(_told_apart(decay, level, settings) for decay, level in zip(decays, noise, strict=True))
    fell = max(1.0 - float(decay.difference[-1] / decay.difference[0]) for decay in decays)
    text = f"the difference falls by {fell:.1%}; AIC between the laws is expected at {gain:.3g}, "
    text += f"{CLEARLY_WORSE:g} is clear"
    several = len(decays) > 1
    more = "several decays" if several else "one decay: a sensor that is off makes a linear leak the same curve"
    return (
        *listed,
        Prospect("law of the leak", gain >= CLEARLY_WORSE, text),
        Prospect("plateau or leak", several, more),
    )


def _told_apart(decay: LeakDecay, noise: float, settings: VaneLeakSettings) -> float:
    """Return the least AIC expected between the opening's law and others, with start and rate free."""
    start, end = float(decay.difference[0]), float(np.mean(decay.difference[-20:]))
    curves = []
    for law in (settings.opening.law(), LAMINAR, LINEAR):
        lasting, difference = decay_times(law, decay.chambers, start, 0.9 * end)
        whole = float(np.interp(-end, -difference, lasting))
        curves.append(np.interp(decay.time / decay.time[-1] * whole, lasting, difference))
    free = np.stack([np.ones_like(decay.time), decay.time], axis=1)
    gains = []
    for other in curves[1:]:
        apart = other - curves[0]
        left = apart - free @ np.linalg.lstsq(free, apart, rcond=None)[0]
        gains.append(left.size * float(np.log1p(np.mean(left**2) / max(noise, 1e-9) ** 2)))
    return float(min(gains))


def _expected(name: str, half_width: float, size: float, where: str) -> Prospect:
    share = float(half_width) / abs(size) if size else np.inf
    told = f"expected to {share:.2g} of its size at best" if share >= 0.1 else f"expected to {share:.2%} at best"
    return Prospect(name, share < WEAK_WITHIN, f"{told}; {where}")
