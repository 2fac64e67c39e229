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

from ppafo.identification.bench import law as bench
from ppafo.identification.bench import readings
from ppafo.identification.estimate import shown_text
from ppafo.identification.fit import Flags
from ppafo.identification.source import RecordingSource, Sources, pool, together
from ppafo.report.kind import Kind
from ppafo.report.residuals import curve_mark, with_residuals
from ppafo.signals.recording import Floats
from ppafo.wording import count_of, percentage

TORQUE = "torque"
FORCE = "force"
_PRESSURE = "pressure_difference"
# Least number of readings to separate slope, friction, its growth and zero, and of pressures to test linearity.
_MINIMUM_SAMPLES = 6
_MINIMUM_LEVELS = 3
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
_PATHS = "actuator.torque_constant", "friction.{}_torque", "effects.seal_friction.{}_per_pressure"
"""Paths of torque constant, friction and its growth in a set, where the load is a torque."""
# Paths of the growth of a friction force and of the zero error of the scale, which are no parameters of a set.
_FRICTION_PER_PRESSURE = "static_torque.friction_per_pressure"
_ZERO = "static_torque.zero_offset"
# Names of tolerances.
_ZERO_OF_PRESSURE = "zero of the pressure sensor"
_GAIN = "gain of the pressure sensor"
_SIGMAS = 4.0
"""Standard errors below zero from which a negative friction guess means a wrong sign instead of noise."""


@dataclass(frozen=True, kw_only=True)
class StaticTorqueProblem(bench.BenchLaw):
    """Table of procedure static-torque: torque constant and static friction from rising and falling pressure.

    The friction is kinetic if the actuator slid. Readings with direction 0 belong to no branch and are left out. So is
    a flat start of the rising branch, where a scale that only pulls shows nothing until friction is overcome.
    """

    needed = (TORQUE, _PRESSURE, "direction")
    steady = ("static-torque",)
    own_errors = ("zero",)
    kind: Literal["static-torque"]

    def run(self, sources: Sources, context: bench.BenchContext) -> bench.BenchResult:
        """Identify torque constant [m^3], friction without pressure [N m], its growth [m^3], and scale zero [N m].

        For a force the units are m^2 and N. Raises IdentificationError for recordings that cannot separate them.
        """
        tolerances = context.tolerances
        has_several = len(sources) > 1
        is_force = all(FORCE in item.recording and TORQUE not in item.recording for item in sources)
        channel = FORCE if is_force else TORQUE
        is_used = _used_readings(sources, channel, tolerances.zero_of_pressure)
        pressure, load, branch = (pool(sources, name)[is_used] for name in (_PRESSURE, channel, "direction"))
        recordings = [source.recording for source in sources]
        files = np.repeat(np.arange(len(sources)), [len(recording) for recording in recordings])[is_used]
        # A repetition of a recording is one cluster; so is a recording without repetitions.
        strokes = [item["repetition"] if "repetition" in item else np.zeros(len(item)) for item in recordings]
        pairs = np.stack([files, np.concatenate(strokes)[is_used]])
        clusters = np.unique(pairs, axis=1, return_inverse=True)[1].reshape(-1)
        repetitions = clusters.max() + 1
        # Each group is one more test: of very many none would be significant.
        labels = (
            np.array([f"repetition {number + 1}" for number in clusters.tolist()])
            if repetitions <= _MOST_REPETITIONS
            else bench.recordings_of(sources)[is_used]
        )
        # Friction varies with position within a stroke, so that consecutive samples of a branch and a repetition at one
        # pressure are no independent readings of the law.
        widest = np.ptp(pressure) / _BINS / 2.0
        first = [0]
        is_new = (np.diff(np.stack([branch, clusters])) != 0.0).any(axis=0)
        for sample in range(1, pressure.size):
            if is_new[sample - 1] or abs(pressure[sample] - pressure[first[-1]]) > widest:
                first.append(sample)
        counts = np.diff([*first, pressure.size])
        places = np.repeat(np.arange(counts.size), counts)
        pressure, load = (np.bincount(places, weights=values) / counts for values in (pressure, load))
        branch = branch[first]
        files = files[first]
        labels = labels[first]
        # The mean of n samples has the noise of one over sqrt(n).
        weight = np.sqrt(counts / counts.mean())

        slope, zero, friction, scale = _straight_line(together(sources), channel, pressure, load, branch)
        # An actuator that slides has kinetic friction. A set has no entry for a force or an area.
        slides = _slides(sources)
        key, grip = ("dynamic", "friction in motion") if slides else ("static", "static friction")
        unit, noun, slope_unit, slope_path, friction_path, growth_path = (
            ("N", "Area", "m^2", "static_torque.area", f"static_torque.{key}_friction", _FRICTION_PER_PRESSURE)
            if is_force
            else ("N m", "Torque constant", "m^3", *(path.format(key) for path in _PATHS))
        )
        load_gain = f"gain of the {channel} sensor"
        frictions = [f"friction of {source.name}" for source in sources]
        is_own_zero = has_several and "zero" in tolerances.each_recording
        zeros = [f"{_ZERO_OF_PRESSURE} of {source.name}" if is_own_zero else _ZERO_OF_PRESSURE for source in sources]
        of_friction = f"{grip.capitalize()} without a pressure difference"
        of_growth = f"Growth of the {grip} with the pressure difference"
        per_pressure = scale / np.abs(pressure).max()
        size = float(np.ptp(load))
        numbers = (
            bench.sought(slope_path, slope, unit=slope_unit, text=f"{noun}, the common slope of both branches"),
            bench.sought(friction_path, friction, scale=scale, unit=unit, text=of_friction),
            bench.sought(growth_path, 0.0, scale=per_pressure, unit=f"{unit}/Pa", text=of_growth),
            # A zero of the scale may be an answer.
            bench.sought(_ZERO, zero, scale=scale, unit=unit, text=f"Zero of the {channel} sensor", size=size),
            *bench.within(tolerances.zero_of_pressure, *dict.fromkeys(zeros)),
            *bench.within(tolerances.gain_of("pressure"), _GAIN),
            *bench.within(tolerances.gain_of(channel), load_gain),
            *bench.within(has_several * tolerances.friction, *frictions, family="friction"),
        )

        def shown(at: bench.Values) -> Floats:
            zero_of_pressure, unlike = (np.array([at[name] for name in names])[files] for names in (zeros, frictions))
            true = (pressure - zero_of_pressure) / (1.0 + at[_GAIN])
            resisting = branch * (at[friction_path] + at[growth_path] * np.abs(true)) * (1.0 + unlike)
            # Loads over their noise.
            return np.asarray(weight * ((1.0 + at[load_gain]) * (at[slope_path] * true - resisting) + at[_ZERO]))

        is_high = pressure > 0.5 * (pressure.max() + pressure.min())
        groups = (
            labels,
            channel,
            np.where(branch > 0.0, "the rising branch", "the falling branch"),
            np.where(is_high, "readings at higher pressures", "readings at lower pressures"),
        )
        fitted, model = bench.solve(shown, weight * load, groups, numbers, self.confidence)
        model = model / weight
        series = []
        for role, sign, motion in (("rising", 1.0, "with"), ("falling", -1.0, "against")):
            # An actuator that slides at constant pressure has two directions of motion as branches.
            label = f"moving {motion} the pressure" if slides else f"pressure {role}"
            on = branch == sign
            series.append((label, role, pressure[on], load[on], model[on]))
        ends = np.array([pressure.min(), pressure.max()])
        straight = fitted.by_name[slope_path] * ends + fitted.by_name[_ZERO]
        axes = Kind("Pressure difference", "Pa_d", "pressure change"), Kind(channel.capitalize(), unit, channel)
        result = bench.result_of(
            sources,
            fitted,
            f"{pressure.size} readings, {count_of(repetitions, 'repetition')}; scatter "
            f"{shown_text(np.std(load - model), unit, digits=3)}",
            with_residuals(f"Static {channel}", *axes, series, [curve_mark("without friction", ends, straight)]),
        )
        # Friction that is certainly negative, or falls with the pressure, is none.
        for path, fault in (
            (friction_path, "without pressure is negative, as if it drove the motion"),
            (growth_path, "falls as the pressure rises, as if pressure loosened the seal"),
        ):
            if not result.conflict and result[path].high < 0.0:
                return result.for_this_model_only(f"the {grip} {fault}")
        return result


def _used_readings(sources: Sources, channel: str, zero_of_pressure: float) -> Flags:
    """Return flags of the readings that count, of all recordings.

    ``zero_of_pressure`` [Pa] is the zero error limit of the pressure sensor. Raises IdentificationError for recordings
    that cannot separate slope from friction.
    """
    readings.check_sources(sources, 1, moving=(channel,))
    for source in sources:
        readings.check_not_alone(source, _PRESSURE)
        readings.check_not_clipped(source, channel, _PRESSURE, source.recording[_PRESSURE])
        directions = source.recording["direction"]
        wrong = np.flatnonzero(~np.isin(directions, (-1.0, 0.0, 1.0)))
        if wrong.size:
            source.refuse(
                f"channel 'direction' is {directions[wrong[0]]:g} at sample {wrong[0] + 1}; must be 1 while the "
                "pressure rises, -1 while it falls, 0 otherwise"
            )
    pressure, load, direction = (pool(sources, name) for name in (_PRESSURE, channel, "direction"))
    pooled = together(sources)
    is_used = np.asarray(direction != 0.0)
    readings.check_no_wrong_reading(sources, channel, (pressure, direction), is_used)
    # A scale that only pulls shows nothing until friction is overcome: the rising branch then has a flat start, a
    # lowest reading that belongs to two pressures or more, or is nothing at all.
    lowest = load.min()
    resting = (direction > 0.0) & (load <= lowest + _FLAT * np.ptp(load))
    if lowest == 0.0 or (resting.any() and np.ptp(pressure[resting]) > np.ptp(pressure) / _BINS / 2.0):
        is_used &= ~resting
    pressure = pressure[is_used]
    direction = direction[is_used]
    readings.check_enough(pooled, pressure.size, _MINIMUM_SAMPLES, "readings")
    for sign, name in ((1.0, "rising"), (-1.0, "falling")):
        if not (direction == sign).any():
            pooled.refuse(f"the {name} branch is missing: no reading has direction {sign:+.0f}")
    if pressure.max() == pressure.min():
        readings.check_moves(pooled, _PRESSURE)
    # Two levels fix a line, but do not show whether it is one. Slope, zero and growth of the friction are extrapolated
    # from the spread of the pressures to zero, which the jitter about one commanded pressure does not carry.
    width = max(np.ptp(pressure) / _BINS, _SAME_LEVEL * np.abs(pressure).max(), zero_of_pressure)
    ordered = np.sort(pressure)
    # From the lowest reading of each level, or one that lies across the end of an interval would count twice.
    levels = first = 0
    while first < ordered.size:
        levels = levels + 1
        first = np.searchsorted(ordered, ordered[first] + width, "right")
    if levels < _MINIMUM_LEVELS:
        why = f"{percentage(_SAME_LEVEL, 2)} of the highest" if width > zero_of_pressure else "[bench] zero_of_pressure"
        pooled.refuse(
            f"needs readings at {_MINIMUM_LEVELS} different pressures or more, not {levels}; pressures closer than "
            f" {shown_text(width, 'Pa_d', digits=3)} ({why}) count as one"
        )
    for source in sources:
        readings.check_not_clipped(source, _PRESSURE, channel, source.recording[channel], _MORE_THAN_FRICTION)
    return is_used


def _slides(sources: Sources) -> bool:
    """Return whether a position or an angle moves with the direction at constant pressure."""
    motions = list[float]()
    pressures = list[float]()
    for recording in (source.recording for source in sources):
        direction = recording["direction"]
        is_inside = (direction[1:] == direction[:-1]) & (direction[1:] != 0.0)
        sweeps = 1 + np.count_nonzero(np.diff(direction[direction != 0.0]))
        for name in {"position", "angle", _PRESSURE} & {*recording.names}:
            # Mean change per sweep in one direction, relative to its range.
            moved = abs(np.sum((direction[1:] * np.diff(recording[name]))[is_inside])) / sweeps
            of_all, span = (pressures, pool(sources, name)) if name == _PRESSURE else (motions, recording[name])
            of_all.append(moved / max(np.ptp(span), 1.0e-300))
    return bool(motions) and min(motions) > _MOVES_WITH_DIRECTION > max(pressures)


def _straight_line(
    source: RecordingSource, channel: str, pressure: Floats, load: Floats, branch: Floats
) -> tuple[float, float, float, float]:
    """Return slope [load/Pa], zero, friction, and scale of the friction [load] from a linear fit of both branches.

    The scale is at least the scatter. Raises IdentificationError, naming the source, if a sign is impossible.
    """
    design = np.stack((pressure, np.ones_like(pressure), -branch), axis=1)
    # Pressures are some 1e5 times as large as the other columns.
    sizes = np.sqrt((design**2).mean(axis=0))
    solution = np.linalg.lstsq(design / sizes, load, rcond=None)[0] / sizes
    slope, zero, friction = solution.tolist()
    if slope <= 0.0:
        source.refuse(f"the {channel} decreases while the pressure difference increases: a wrong sign of one of them")
    deviation = np.std(load - design @ solution)
    # Where friction is small its sign is the noise's, and no reason to refuse.
    if friction < -_SIGMAS * deviation / np.sqrt(pressure.size):
        source.refuse(
            "the rising branch lies above the falling one, as if friction drove the motion: a wrong sign of 'direction'"
        )
    return slope, zero, friction, max(abs(friction), deviation)
