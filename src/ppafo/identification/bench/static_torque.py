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

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import IdentificationError
from ppafo.identification.bench.law import PooledReadings, Values, recordings_of, solve, sought, within
from ppafo.identification.bench.result import BenchResult, ReportedNumber, result_of
from ppafo.identification.source import (
    RecordingSource,
    check_moves,
    check_no_wrong_reading,
    check_not_alone,
    check_not_clipped,
    check_sources,
    pool,
)
from ppafo.identification.tolerances import DEFAULTS, Tolerances
from ppafo.identification.wording import in_shown_unit
from ppafo.report.kind import Kind
from ppafo.report.panels import Mark
from ppafo.report.residuals import curve_mark, readings_mark, with_residuals
from ppafo.signals.recording import Floats
from ppafo.wording import count_of

Labels = NDArray[np.int64]

PROCEDURE = "static-torque"
_TORQUE, _FORCE = "torque", "force"
_MOVING = ("position", "angle")
MINIMUM_SAMPLES = 6
"""Least number of readings that separates slope, friction, growth of the friction, and zero."""
_MINIMUM_LEVELS = 3
"""Least number of different pressures that shows whether the torque is linear in pressure."""
_MORE_THAN_FRICTION = 0.3
"""Fraction of its range [-] by which the torque may change at one pressure when friction reverses."""
_PARTS = 20
"""Number of bins over the pressure range; readings within one bin have the same pressure level."""
_FLAT = 0.002
"""Fraction of the torque range [-] within which readings belong to the flat start of a scale that only pulls."""
_MOVES_WITH_DIRECTION = 0.5
"""Least change of a channel per sweep, as a fraction of its range [-], for the direction to refer to the channel."""
_MOST_REPETITIONS = 12
"""Largest number of repetitions that are tested one by one; with more, whole recordings are tested."""
_SIGMAS = 4.0
"""Standard errors by which a first guess of the friction must be negative to be a wrong sign rather than noise."""


def static_torque(
    sources: tuple[RecordingSource, ...], confidence: float = 0.95, tolerances: Tolerances = DEFAULTS
) -> BenchResult:
    """Return torque constant [m^3], friction without pressure [N m], its growth [m^3] and zero of the scale [N m].

    The model is equation (2). The friction is static, or kinetic if the actuator slid. For a force the units are m^2
    and N. Readings with direction 0 belong to no branch and are left out. So is a flat start of the rising branch,
    where a scale that only pulls shows nothing until friction is overcome. Raises IdentificationError, with file,
    sample and remedy, for recordings that cannot separate the unknowns.
    """
    readings = readings_of(sources)
    names = readings.names
    files = [source.name for source in sources]
    slope, zero, friction, size = _straight_line(readings, ", ".join(files))
    frictions = [f"friction of {file}" for file in files] if len(files) > 1 else []
    is_anew = "zero" in tolerances.each_recording and len(files) > 1
    zeros = [f"zero of the pressure sensor of {file}" for file in files] if is_anew else ["zero of the pressure sensor"]
    span = float(np.abs(readings.pressure).max())
    numbers = (
        sought(names.slope_path, slope),
        sought(names.friction_path, friction, scale=size),
        sought(names.growth_path, 0.0, scale=size / span),
        sought(names.zero_path, zero, scale=size),
        *(number for name in zeros for number in within(name, tolerances.zero_of_pressure)),
        *within("gain of the pressure sensor", tolerances.gain_of("pressure")),
        *within(f"gain of the {names.load} sensor", tolerances.gain_of(names.load)),
        *(number for name in frictions for number in within(name, tolerances.friction, "friction")),
    )

    def law(at: Values) -> Floats:
        pressure = (readings.pressure - _of_files(at, zeros, readings.files)) / (
            1.0 + at["gain of the pressure sensor"]
        )
        held = readings.branch * (at[names.friction_path] + at[names.growth_path] * np.abs(pressure))
        held = held * (1.0 + _of_files(at, frictions, readings.files))
        shown = (1.0 + at[f"gain of the {names.load} sensor"]) * (at[names.slope_path] * pressure - held)
        return np.asarray(readings.weight * (shown + at[names.zero_path]))

    middle = 0.5 * float(readings.pressure.max() + readings.pressure.min())
    groups = (
        np.where(readings.branch > 0.0, "the rising branch", "the falling branch").tolist(),
        np.where(readings.pressure > middle, "readings at higher pressures", "readings at lower pressures").tolist(),
    )
    sensors = [names.load] * readings.pressure.size
    # Loads over their noise.
    pooled = PooledReadings(readings.weight * readings.torque, sensors, readings.recordings, groups)
    fitted, weighted = solve(law, pooled, numbers, confidence)
    values, residuals = fitted.by_name, readings.torque - weighted / readings.weight
    slope, slope_unit = in_shown_unit(values[names.slope_path], names.slope_unit)
    friction, unit = in_shown_unit(values[names.friction_path], names.unit)
    scatter, _ = in_shown_unit(float(np.std(residuals)), names.unit)
    load = Kind(names.load.capitalize(), names.unit, names.load)
    return result_of(
        PROCEDURE,
        sources,
        fitted,
        (
            ReportedNumber(
                names.slope_path, names.slope_unit, f"{names.slope.capitalize()}, the common slope of both branches"
            ),
            ReportedNumber(
                names.friction_path, names.unit, f"{names.friction.capitalize()} without a pressure difference"
            ),
            ReportedNumber(
                names.growth_path, f"{names.unit}/Pa", f"Growth of the {names.friction} with the pressure difference"
            ),
            # A zero of the scale may be an answer.
            ReportedNumber(
                names.zero_path, names.unit, f"Zero of the {names.load} sensor", float(np.ptp(readings.torque))
            ),
        ),
        f"{readings.pressure.size} readings, {count_of(readings.repetitions, 'repetition')}; {names.slope} "
        f"{slope:.4g} {slope_unit}, {names.friction} {friction:.3g} {unit}; "
        f"scatter {scatter:.3g} {unit}",
        with_residuals(
            f"Static {names.load}",
            Kind("Pressure difference", "Pa_d", "pressure change"),
            load,
            _marks(readings, values[names.slope_path], values[names.zero_path]),
            readings.pressure,
            residuals,
        ),
        f"one {names.slope} and a {names.friction} linear in pressure do not describe them",
    )


def _marks(readings: "_Sweeps", slope: float, zero: float) -> list[Mark]:
    """Return the plot marks of both branches over pressure, and of the frictionless line with this slope and zero."""
    branches = {"rising": readings.branch > 0.0, "falling": readings.branch < 0.0}
    # Of an actuator that slides at constant pressure the branches are its two ways.
    ways = {"rising": "moving with the pressure", "falling": "moving against the pressure"}
    labels = ways if readings.names.is_in_motion else {role: f"pressure {role}" for role in branches}
    marks = [
        readings_mark(labels[role], readings.pressure[on], readings.torque[on], role) for role, on in branches.items()
    ]
    ends = np.array([readings.pressure.min(), readings.pressure.max()])
    return [*marks, curve_mark("nominal", ends, slope * ends + zero)]


def _of_files(at: Values, names: list[str], files: Labels) -> Floats:
    """Return the tolerance of each reading: the value of its file, or the common value; 0 if there is none."""
    values = np.array([at[name] for name in names] or [0.0])
    return np.asarray(values[files] if len(names) > 1 else values)


def _straight_line(readings: "_Sweeps", files: str) -> tuple[float, float, float, float]:
    """Return first guesses from a linear fit of both branches: slope, zero, friction, and scale of the friction.

    The slope is in units of load per Pa, the others in units of load; the scale is at least the scatter. Raises
    IdentificationError, with ``files`` first, if a sign is impossible.
    """
    columns = (readings.pressure, np.ones_like(readings.pressure), -readings.branch)
    design = np.stack(columns, axis=1)
    # Pressures are some 1e5 times as large as the other columns.
    scale = np.sqrt((design**2).mean(axis=0))
    solution = np.linalg.lstsq(design / scale, readings.torque, rcond=None)[0] / scale
    slope, zero, friction = solution.tolist()
    if slope <= 0.0:
        raise IdentificationError(
            f"{files}: {PROCEDURE}: the {readings.names.load} falls with the pressure difference; reverse the sign of "
            "one channel"
        )
    deviation = float(np.std(readings.torque - design @ solution))
    # Where friction is small its sign is the noise's, and no reason to refuse.
    if friction < -_SIGMAS * deviation / np.sqrt(readings.pressure.size):
        raise IdentificationError(
            f"{files}: {PROCEDURE}: the rising branch lies above the falling one, as if friction drove the motion; "
            "reverse the sign of channel 'direction'"
        )
    return slope, zero, friction, max(abs(friction), deviation)


@dataclass(frozen=True, slots=True)
class _LoadNames:
    """Names, paths and units of the unknowns for a torque or force: slope, static or kinetic friction, growth, zero.

    Unknowns without an entry in a parameter set have a path that starts with ``static_torque``.
    """

    load: str
    unit: str
    slope: str
    slope_path: str
    slope_unit: str
    friction: str
    friction_path: str
    growth_path: str
    zero_path: str = "static_torque.zero_offset"
    is_in_motion: bool = False


def names_of(load: str, slides: bool) -> _LoadNames:
    """Return the names of the unknowns for a torque or force; ``slides`` selects kinetic instead of static friction."""
    word, key = ("friction in motion", "dynamic") if slides else ("static friction", "static")
    if load == _FORCE:
        unit, slope = "N", ("area", "static_torque.area", "m^2")
        frictions = f"static_torque.{key}_friction", "static_torque.friction_per_pressure"
    else:
        unit, slope = "N m", ("torque constant", "actuator.torque_constant", "m^3")
        frictions = f"friction.{key}_torque", f"effects.seal_friction.{key}_per_pressure"
    return _LoadNames(load, unit, *slope, word, *frictions, is_in_motion=slides)


@dataclass(frozen=True, slots=True)
class _Sweeps:
    """Readings of both branches: pressure difference [Pa], load [N m or N], branch (+1 rising, -1 falling).

    ``weight`` is the reciprocal relative noise of each reading [-]: above 1 for means of many samples. ``recordings``
    are labels of the repetition or, with many repetitions, of the recording; ``files`` are the indices of the sources.
    """

    pressure: Floats
    torque: Floats
    branch: Floats
    weight: Floats
    recordings: list[str]
    files: Labels
    repetitions: int
    names: _LoadNames


def slides(sources: tuple[RecordingSource, ...]) -> bool:
    """Return whether a position or an angle moves with the direction while the pressure does not."""
    pressure = float(np.ptp(pool(sources, "pressure_difference")))
    moving = [
        _swept(one, name) / max(float(np.ptp(one.recording[name])), 1.0e-300)
        for one in sources
        for name in _MOVING
        if name in one.recording
    ]
    branches = [_swept(one, "pressure_difference") / max(pressure, 1.0e-300) for one in sources]
    return bool(moving) and min(moving) > _MOVES_WITH_DIRECTION > max(branches)


def _swept(source: RecordingSource, name: str) -> float:
    """Return the mean magnitude of the change of a channel per sweep in one direction [unit of the channel]."""
    direction = source.recording["direction"]
    within = (direction[1:] == direction[:-1]) & (direction[1:] != 0.0)
    used = direction[direction != 0.0]
    sweeps = 1 + int(np.count_nonzero(np.diff(used)))
    return abs(float(np.sum((direction[1:] * np.diff(source.recording[name]))[within]))) / sweeps


def readings_of(sources: tuple[RecordingSource, ...]) -> _Sweeps:
    """Return the readings of all recordings. Raises IdentificationError if they cannot separate slope from friction."""
    is_force = bool(sources) and all(_FORCE in one.recording and _TORQUE not in one.recording for one in sources)
    load = _FORCE if is_force else _TORQUE
    check_sources(sources, PROCEDURE, (load, "pressure_difference", "direction"), 1, moving=(load,))
    for source in sources:
        check_not_alone(source, PROCEDURE, "pressure_difference")
        check_not_clipped(source, PROCEDURE, load, "pressure_difference", source.recording["pressure_difference"])
        values = source.recording["direction"]
        wrong = np.flatnonzero(~np.isin(values, (-1.0, 0.0, 1.0)))
        if wrong.size:
            raise IdentificationError(
                f"{source.name}: {PROCEDURE}: channel 'direction' is {values[wrong[0]]:g} at sample {wrong[0] + 1}; "
                f"it is 1 while the pressure rises, -1 while it falls, 0 for neither"
            )
    pressure, torque, direction = (pool(sources, name) for name in ("pressure_difference", load, "direction"))
    used = direction != 0.0
    check_no_wrong_reading(sources, PROCEDURE, load, (pressure, direction), used)
    # A scale that only pulls shows nothing until friction is overcome: the rising branch then has a flat start, a
    # lowest reading that belongs to two pressures or more, or is nothing at all.
    lowest = torque.min()
    resting = (direction > 0.0) & (torque <= lowest + _FLAT * np.ptp(torque))
    is_flat = resting.any() and np.ptp(pressure[resting]) > np.ptp(pressure) / _PARTS / 2.0
    if is_flat or lowest == 0.0:
        used &= ~resting
    pressure, torque, direction = pressure[used], torque[used], direction[used]
    if pressure.size < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE} needs at least {MINIMUM_SAMPLES} readings, there are {pressure.size}"
        )
    for sign, name in ((1.0, "rising"), (-1.0, "falling")):
        if not (direction == sign).any():
            raise IdentificationError(
                f"{', '.join(source.name for source in sources)}: {PROCEDURE}: the {name} branch is missing: no "
                f"reading has direction {sign:+.0f}; without both, friction cannot be separated from "
                "the zero of the scale"
            )
    if pressure.max() == pressure.min():
        check_moves(sources[0], PROCEDURE, "pressure_difference")
    # Two levels fix a line, but do not show whether it is one.
    places = np.floor(_PARTS * (pressure - pressure.min()) / np.ptp(pressure))
    levels = np.unique(np.minimum(places, _PARTS - 1)).size
    if levels < _MINIMUM_LEVELS:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE} needs readings at {_MINIMUM_LEVELS} different pressures or more, "
            f"there are {levels}"
        )
    for source in sources:
        driving = source.recording[load]
        check_not_clipped(source, PROCEDURE, "pressure_difference", load, driving, _MORE_THAN_FRICTION)
    return _one_a_stroke(sources, used, pressure, torque, direction, names_of(load, slides(sources)))


def _one_a_stroke(
    sources: tuple[RecordingSource, ...],
    used: NDArray[np.bool_],
    pressure: Floats,
    torque: Floats,
    direction: Floats,
    names: _LoadNames,
) -> _Sweeps:
    """Return readings averaged over samples at one pressure of a stroke.

    ``used`` marks the samples of all recordings to which ``pressure``, ``torque`` and ``direction`` belong.
    """
    # A repetition of a recording is one cluster; so is a recording without repetitions.
    parts = [(number, one.recording) for number, one in enumerate(sources)]
    files = np.concatenate([np.full(len(one), number) for number, one in parts])[used]
    strokes = [one["repetition"] if "repetition" in one else np.zeros(len(one)) for _, one in parts]
    pairs = np.stack([files, np.concatenate(strokes)[used]])
    clusters = np.unique(pairs, axis=1, return_inverse=True)[1].reshape(-1)
    runs = _runs(pressure, np.stack([direction, clusters]))
    counts = np.bincount(runs)
    first = np.concatenate(([0], np.cumsum(counts)[:-1]))
    pressure, torque = (np.bincount(runs, weights=values) / counts for values in (pressure, torque))
    # The mean of n samples has the noise of one over sqrt(n).
    weight, repetitions = np.sqrt(counts / counts.mean()), int(clusters.max()) + 1
    labels = [f"repetition {number + 1}" for number in clusters.tolist()]
    # Each group is one more test: of very many none would be significant.
    if repetitions > _MOST_REPETITIONS:
        labels = [label for label, is_used in zip(recordings_of(sources), used.tolist(), strict=True) if is_used]
    recordings = [labels[one] for one in first.tolist()]
    return _Sweeps(pressure, torque, direction[first], weight, recordings, files[first], repetitions, names)


def _runs(pressure: Floats, labels: NDArray[np.float64]) -> Labels:
    """Return the reading index of each sample; consecutive samples of one branch at one pressure are one reading.

    Friction varies with position within a stroke, so that these samples are not independent readings of the law.
    """
    widest = np.ptp(pressure) / _PARTS / 2.0
    begun, places = 0, np.zeros(pressure.size, dtype=np.int64)
    for place in range(1, pressure.size):
        is_new = abs(pressure[place] - pressure[begun]) > widest or (labels[:, place] != labels[:, place - 1]).any()
        begun = place if is_new else begun
        places[place] = places[place - 1] + is_new
    return places
