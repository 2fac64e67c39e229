"""Static torque over rising and falling pressure: torque constant and friction; figure 3, top, of the paper.

While the pressure rises, friction reduces the torque at the scale; while it falls, friction adds to it:

    T = K dP + T_0 - s (T_s + g |dP|),   s = +1 rising, -1 falling                               equations (2), (10)

T is the reading of the scale [N m], dP the pressure difference [Pa], K the torque constant [m^3], T_0 the zero of the
scale [N m], T_s the friction without pressure [N m], g its growth with pressure [m^3] (effect ``seal_friction``). Zero
and gain of the pressure sensor and gain of the scale are tolerances. So is the friction of each of several recordings,
because seals grip differently from one to another. If a position or an angle moves with the direction while the
pressure does not, the actuator slid, and T_s is the kinetic friction. A ``force`` [N] in place of the torque gives an
area [m^2] and forces, for which a set has no entry.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import IdentificationError
from ppafo.identification.bench.law import (
    BenchContext,
    BenchLaw,
    BenchResult,
    PooledReadings,
    Values,
    recordings_of,
    reported,
    result_of,
    solve,
    sought,
    within,
)
from ppafo.identification.bench.readings import (
    check_moves,
    check_no_wrong_reading,
    check_not_alone,
    check_not_clipped,
    check_sources,
)
from ppafo.identification.estimate import in_shown_unit
from ppafo.identification.source import RecordingSource, pool
from ppafo.report.kind import Kind
from ppafo.report.residuals import curve_mark, readings_mark, with_residuals
from ppafo.signals.recording import Floats
from ppafo.wording import count_of, percentage

TORQUE, FORCE = "torque", "force"
_MOVING = ("position", "angle")
"""Channels by which sliding of the actuator is detected."""
_MINIMUM_SAMPLES = 6
"""Least number of readings to separate slope, friction, growth of the friction, and zero."""
_MINIMUM_LEVELS = 3
"""Least number of different pressures to test whether the torque is linear in pressure."""
_SAME_LEVEL = 0.1
"""Largest pressure difference within a level, relative to the highest pressure [-]; a regulator jitters."""
_MORE_THAN_FRICTION = 0.3
"""Largest jump of the torque at one pressure when friction reverses, as a fraction of its range [-]."""
_BINS = 20
"""Number of bins over the pressure range; readings within one bin have the same pressure level."""
_FLAT = 0.002
"""Fraction of the torque range [-] within which readings belong to the flat start of a scale that only pulls."""
_MOVES_WITH_DIRECTION = 0.5
"""Least change of a channel per sweep, as a fraction of its range [-], for motion with the direction."""
_MOST_REPETITIONS = 12
"""Largest number of repetitions tested separately; with more, whole recordings are tested."""
_TINY = 1.0e-300
"""Smallest range [unit of the channel] for a division, in place of 0."""
_ZERO = "static_torque.zero_offset"
"""Path of the zero error of the scale, which is no parameter of a set."""
_GAIN, _SENSOR_ZERO = "gain of the pressure sensor", "zero of the pressure sensor"
_SIGMAS = 4.0
"""Standard errors below zero from which a negative friction guess means a wrong sign instead of noise."""


@dataclass(frozen=True, slots=True)
class TorqueReadings:
    """Readings of both branches: pressure difference [Pa], load [N m or N], branch (+1 rising, -1 falling).

    ``weight`` is the reciprocal relative noise of each reading [-]: above 1 for means of many samples. ``recordings``
    are labels of the repetition or, with many repetitions, of the recording; ``files`` are the indices of the sources.
    ``channel`` is "torque" or "force". ``slides``: a position or an angle moves with the direction while the pressure
    does not.
    """

    pressure: Floats
    load: Floats
    branch: Floats
    weight: Floats
    recordings: list[str]
    files: NDArray[np.int64]
    repetitions: int
    channel: str
    slides: bool


def torque_readings(sources: tuple[RecordingSource, ...], zero_of_pressure: float) -> TorqueReadings:
    """Return the readings of all recordings; ``zero_of_pressure`` [Pa] is the zero error limit of the pressure sensor.

    Raises IdentificationError if they cannot separate slope from friction.
    """
    is_force = bool(sources) and all(FORCE in item.recording and TORQUE not in item.recording for item in sources)
    channel = FORCE if is_force else TORQUE
    check_sources(sources, (channel, "pressure_difference", "direction"), 1, moving=(channel,))
    for source in sources:
        check_not_alone(source, "pressure_difference")
        check_not_clipped(source, channel, "pressure_difference", source.recording["pressure_difference"])
        directions = source.recording["direction"]
        wrong = np.flatnonzero(~np.isin(directions, (-1.0, 0.0, 1.0)))
        if wrong.size:
            source.refuse(
                f"channel 'direction' is {directions[wrong[0]]:g} at sample "
                f"{wrong[0] + 1}; must be 1 while the pressure rises, -1 while it falls, 0 otherwise"
            )
    pressure, load, direction = (pool(sources, name) for name in ("pressure_difference", channel, "direction"))
    is_used = direction != 0.0
    check_no_wrong_reading(sources, channel, (pressure, direction), is_used)
    # A scale that only pulls shows nothing until friction is overcome: the rising branch then has a flat start, a
    # lowest reading that belongs to two pressures or more, or is nothing at all.
    lowest = load.min()
    resting = (direction > 0.0) & (load <= lowest + _FLAT * np.ptp(load))
    is_flat = resting.any() and np.ptp(pressure[resting]) > np.ptp(pressure) / _BINS / 2.0
    if is_flat or lowest == 0.0:
        is_used &= ~resting
    pressure, load, direction = pressure[is_used], load[is_used], direction[is_used]
    _check_separable(sources, pressure, direction, zero_of_pressure)
    for source in sources:
        loads = source.recording[channel]
        check_not_clipped(source, "pressure_difference", channel, loads, _MORE_THAN_FRICTION)

    # A repetition of a recording is one cluster; so is a recording without repetitions.
    recordings = [source.recording for source in sources]
    files = np.repeat(np.arange(len(sources)), [len(recording) for recording in recordings])[is_used]
    strokes = [item["repetition"] if "repetition" in item else np.zeros(len(item)) for item in recordings]
    pairs = np.stack([files, np.concatenate(strokes)[is_used]])
    clusters = np.unique(pairs, axis=1, return_inverse=True)[1].reshape(-1)
    # Friction varies with position within a stroke, so that consecutive samples of a branch and a repetition at one
    # pressure are no independent readings of the law.
    marks, widest, start = np.stack([direction, clusters]), np.ptp(pressure) / _BINS / 2.0, 0
    readings = np.zeros(pressure.size, dtype=np.int64)
    for sample in range(1, pressure.size):
        is_new = abs(pressure[sample] - pressure[start]) > widest or (marks[:, sample] != marks[:, sample - 1]).any()
        start = sample if is_new else start
        readings[sample] = readings[sample - 1] + is_new
    counts = np.bincount(readings)
    first = np.concatenate(([0], np.cumsum(counts)[:-1]))
    repetitions = int(clusters.max()) + 1
    labels = [f"repetition {number + 1}" for number in clusters.tolist()]
    # Each group is one more test: of very many none would be significant.
    if repetitions > _MOST_REPETITIONS:
        labels = np.array(recordings_of(sources))[is_used].tolist()
    return TorqueReadings(
        pressure=np.bincount(readings, weights=pressure) / counts,
        load=np.bincount(readings, weights=load) / counts,
        branch=direction[first],
        # The mean of n samples has the noise of one over sqrt(n).
        weight=np.sqrt(counts / counts.mean()),
        recordings=[labels[sample] for sample in first.tolist()],
        files=files[first],
        repetitions=repetitions,
        channel=channel,
        slides=_slides(sources),
    )


def _check_separable(
    sources: tuple[RecordingSource, ...], pressure: Floats, direction: Floats, zero_of_pressure: float
) -> None:
    """Raise IdentificationError for too few readings, a missing branch, or too few different pressures."""
    if pressure.size < _MINIMUM_SAMPLES:
        sources[0].refuse(f"needs at least {_MINIMUM_SAMPLES} readings, not {pressure.size}")
    for sign, name in ((1.0, "rising"), (-1.0, "falling")):
        if not (direction == sign).any():
            raise IdentificationError(
                f"{', '.join(source.name for source in sources)}: the {name} branch is missing: no "
                f"reading has direction {sign:+.0f}"
            )
    if pressure.max() == pressure.min():
        check_moves(sources[0], "pressure_difference")
    # Two levels fix a line, but do not show whether it is one. Slope, zero and growth of the friction are extrapolated
    # from the spread of the pressures to zero, which the jitter about one commanded pressure does not carry.
    highest = _SAME_LEVEL * float(np.abs(pressure).max())
    width = max(float(np.ptp(pressure)) / _BINS, highest, zero_of_pressure)
    ordered = np.sort(pressure)
    # From the lowest reading of each level, or one that lies across the end of an interval would count twice.
    levels = first = 0
    while first < ordered.size:
        levels, first = levels + 1, int(np.searchsorted(ordered, ordered[first] + width, "right"))
    if levels < _MINIMUM_LEVELS:
        shown, unit = in_shown_unit(width, "Pa_d")
        why = f"{percentage(_SAME_LEVEL, 2)} of the highest" if width > zero_of_pressure else "[bench] zero_of_pressure"
        raise IdentificationError(
            f"{', '.join(source.name for source in sources)}: needs readings at {_MINIMUM_LEVELS} "
            f"different pressures or more, not {levels}; pressures closer than {shown:.3g} {unit} ({why}) count as one"
        )


def _slides(sources: tuple[RecordingSource, ...]) -> bool:
    """Return whether a position or an angle moves with the direction at constant pressure."""
    range_of_pressure = float(np.ptp(pool(sources, "pressure_difference")))
    pressures = [_change_per_sweep(item, "pressure_difference") / max(range_of_pressure, _TINY) for item in sources]
    motions = [
        _change_per_sweep(source, name) / max(float(np.ptp(source.recording[name])), _TINY)
        for source in sources
        for name in _MOVING
        if name in source.recording
    ]
    return bool(motions) and min(motions) > _MOVES_WITH_DIRECTION > max(pressures)


def _change_per_sweep(source: RecordingSource, name: str) -> float:
    """Return the mean change of a channel per sweep in one direction, as magnitude [unit of the channel]."""
    direction = source.recording["direction"]
    is_inside = (direction[1:] == direction[:-1]) & (direction[1:] != 0.0)
    sweeps = 1 + int(np.count_nonzero(np.diff(direction[direction != 0.0])))
    return abs(float(np.sum((direction[1:] * np.diff(source.recording[name]))[is_inside]))) / sweeps


@dataclass(frozen=True, kw_only=True)
class StaticTorqueProblem(BenchLaw):
    """Table of procedure static-torque: torque constant and static friction from rising and falling pressure.

    The friction is kinetic if the actuator slid. Readings with direction 0 belong to no branch and are left out. So is
    a flat start of the rising branch, where a scale that only pulls shows nothing until friction is overcome.
    """

    needed = (TORQUE, "pressure_difference", "direction")
    steady = ("static-torque",)
    own_errors = ("zero",)
    kind: Literal["static-torque"]

    def run(self, sources: tuple[RecordingSource, ...], context: BenchContext) -> BenchResult:
        """Identify torque constant [m^3], friction without pressure [N m], its growth [m^3], and scale zero [N m].

        For a force the units are m^2 and N. Raises IdentificationError for recordings that cannot separate them.
        """
        tolerances = context.tolerances
        readings = torque_readings(sources, tolerances.zero_of_pressure)
        channel, is_force, files = readings.channel, readings.channel == FORCE, [source.name for source in sources]
        # An actuator that slides has kinetic friction. A set has no entry for a force or an area.
        key, friction = ("dynamic", "friction in motion") if readings.slides else ("static", "static friction")
        load_unit, slope, slope_unit = ("N", "area", "m^2") if is_force else ("N m", "torque constant", "m^3")
        slope_path = "static_torque.area" if is_force else "actuator.torque_constant"
        friction_path = f"static_torque.{key}_friction" if is_force else f"friction.{key}_torque"
        growth_path = f"effects.seal_friction.{key}_per_pressure"
        growth_path = "static_torque.friction_per_pressure" if is_force else growth_path
        start_slope, start_zero, start_friction, scale = _straight_line(readings, ", ".join(files))
        frictions = [f"friction of {file}" for file in files] if len(files) > 1 else []
        has_zeros = "zero" in tolerances.each_recording and len(files) > 1
        zeros = [f"{_SENSOR_ZERO} of {file}" for file in files] if has_zeros else [_SENSOR_ZERO]
        load_gain = f"gain of the {channel} sensor"
        numbers = (
            sought(
                reported(slope_path, slope_unit, f"{slope.capitalize()}, the common slope of both branches"),
                start_slope,
            ),
            sought(
                reported(friction_path, load_unit, f"{friction.capitalize()} without a pressure difference"),
                start_friction,
                scale=scale,
            ),
            sought(
                reported(growth_path, f"{load_unit}/Pa", f"Growth of the {friction} with the pressure difference"),
                0.0,
                scale=scale / float(np.abs(readings.pressure).max()),
            ),
            # A zero of the scale may be an answer.
            sought(
                reported(_ZERO, load_unit, f"Zero of the {channel} sensor", float(np.ptp(readings.load))),
                start_zero,
                scale=scale,
            ),
            *(number for name in zeros for number in within(name, tolerances.zero_of_pressure)),
            *within(_GAIN, tolerances.gain_of("pressure")),
            *within(load_gain, tolerances.gain_of(channel)),
            *(number for name in frictions for number in within(name, tolerances.friction, "friction")),
        )

        def of_files(at: Values, names: list[str]) -> Floats:
            values = np.array([at[name] for name in names] or [0.0])
            return np.asarray(values[readings.files] if len(names) > 1 else values)

        def law(at: Values) -> Floats:
            pressure = (readings.pressure - of_files(at, zeros)) / (1.0 + at[_GAIN])
            resisting = readings.branch * (at[friction_path] + at[growth_path] * np.abs(pressure))
            resisting = resisting * (1.0 + of_files(at, frictions))
            load = (1.0 + at[load_gain]) * (at[slope_path] * pressure - resisting)
            return np.asarray(readings.weight * (load + at[_ZERO]))

        middle = 0.5 * float(readings.pressure.max() + readings.pressure.min())
        groups = (
            np.where(readings.branch > 0.0, "the rising branch", "the falling branch").tolist(),
            np.where(
                readings.pressure > middle, "readings at higher pressures", "readings at lower pressures"
            ).tolist(),
        )
        # Loads over their noise.
        weighted = PooledReadings(
            readings.weight * readings.load, [channel] * readings.pressure.size, readings.recordings, groups
        )
        fitted, weighted_model = solve(law, weighted, numbers, self.confidence)
        values, residuals = fitted.by_name, readings.load - weighted_model / readings.weight
        marks = []
        for role, sign, motion in (("rising", 1.0, "with"), ("falling", -1.0, "against")):
            # An actuator that slides at constant pressure has two directions of motion as branches.
            label = f"moving {motion} the pressure" if readings.slides else f"pressure {role}"
            on = readings.branch == sign
            marks.append(readings_mark(label, readings.pressure[on], readings.load[on], role))
        ends = np.array([readings.pressure.min(), readings.pressure.max()])
        marks.append(curve_mark("without friction", ends, values[slope_path] * ends + values[_ZERO]))
        shown_slope, shown_slope_unit = in_shown_unit(values[slope_path], slope_unit)
        shown_friction, unit = in_shown_unit(values[friction_path], load_unit)
        scatter, _ = in_shown_unit(float(np.std(residuals)), load_unit)
        axes = Kind("Pressure difference", "Pa_d", "pressure change"), Kind(channel.capitalize(), load_unit, channel)
        result = result_of(
            sources,
            fitted,
            f"{readings.pressure.size} readings, {count_of(readings.repetitions, 'repetition')}; {slope} "
            f"{shown_slope:.4g} {shown_slope_unit}, {friction} {shown_friction:.3g} {unit}; "
            f"scatter {scatter:.3g} {unit}",
            with_residuals(f"Static {channel}", *axes, marks, readings.pressure, residuals),
        )
        # Friction that is certainly negative, or falls with the pressure, is none.
        for path, fault in (
            (friction_path, "without pressure is negative, as if it drove the motion"),
            (growth_path, "falls as the pressure rises, as if pressure loosened the seal"),
        ):
            if not result.conflict and result[path].high < 0.0:
                return result.for_this_model_only(f"the {friction} {fault}")
        return result


def _straight_line(readings: TorqueReadings, files: str) -> tuple[float, float, float, float]:
    """Return start values from a linear fit of both branches: slope, zero, friction, and scale of the friction.

    The slope is in units of load per Pa, the others in units of load; the scale is at least the scatter. Raises
    IdentificationError, with ``files`` first, if a sign is impossible.
    """
    design = np.stack((readings.pressure, np.ones_like(readings.pressure), -readings.branch), axis=1)
    # Pressures are some 1e5 times as large as the other columns.
    scale = np.sqrt((design**2).mean(axis=0))
    solution = np.linalg.lstsq(design / scale, readings.load, rcond=None)[0] / scale
    slope, zero, friction = solution.tolist()
    if slope <= 0.0:
        raise IdentificationError(
            f"{files}: the {readings.channel} decreases while the pressure difference increases: a wrong "
            "sign of one of them"
        )
    deviation = float(np.std(readings.load - design @ solution))
    # Where friction is small its sign is the noise's, and no reason to refuse.
    if friction < -_SIGMAS * deviation / np.sqrt(readings.pressure.size):
        raise IdentificationError(
            f"{files}: the rising branch lies above the falling one, as if friction drove the motion: a "
            "wrong sign of channel 'direction'"
        )
    return slope, zero, friction, max(abs(friction), deviation)
