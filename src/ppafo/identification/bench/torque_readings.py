"""Readings of static torque over pressure: samples of the scale, averaged at each pressure of a stroke."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import IdentificationError
from ppafo.identification.bench.checks import check_moves, check_not_clipped, check_sources
from ppafo.identification.bench.law import recordings_of
from ppafo.identification.bench.wrong_readings import check_no_wrong_reading, check_not_alone
from ppafo.identification.source import RecordingSource, pool
from ppafo.identification.wording import in_shown_unit
from ppafo.signals.recording import Floats
from ppafo.wording import percentage

PROCEDURE = "static-torque"
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
    check_sources(sources, PROCEDURE, (channel, "pressure_difference", "direction"), 1, moving=(channel,))
    for source in sources:
        check_not_alone(source, PROCEDURE, "pressure_difference")
        check_not_clipped(source, PROCEDURE, channel, "pressure_difference", source.recording["pressure_difference"])
        directions = source.recording["direction"]
        wrong = np.flatnonzero(~np.isin(directions, (-1.0, 0.0, 1.0)))
        if wrong.size:
            raise IdentificationError(
                f"{source.name}: {PROCEDURE}: channel 'direction' is {directions[wrong[0]]:g} at sample "
                f"{wrong[0] + 1}; must be 1 while the pressure rises, -1 while it falls, 0 otherwise"
            )
    pressure, load, direction = (pool(sources, name) for name in ("pressure_difference", channel, "direction"))
    is_used = direction != 0.0
    check_no_wrong_reading(sources, PROCEDURE, channel, (pressure, direction), is_used)
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
        check_not_clipped(source, PROCEDURE, "pressure_difference", channel, loads, _MORE_THAN_FRICTION)

    # A repetition of a recording is one cluster; so is a recording without repetitions.
    recordings = [source.recording for source in sources]
    files = np.repeat(np.arange(len(sources)), [len(recording) for recording in recordings])[is_used]
    strokes = [item["repetition"] if "repetition" in item else np.zeros(len(item)) for item in recordings]
    pairs = np.stack([files, np.concatenate(strokes)[is_used]])
    clusters = np.unique(pairs, axis=1, return_inverse=True)[1].reshape(-1)
    readings = _reading_indices(pressure, np.stack([direction, clusters]))
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
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE} needs at least {_MINIMUM_SAMPLES} readings, not {pressure.size}"
        )
    for sign, name in ((1.0, "rising"), (-1.0, "falling")):
        if not (direction == sign).any():
            raise IdentificationError(
                f"{', '.join(source.name for source in sources)}: {PROCEDURE}: the {name} branch is missing: no "
                f"reading has direction {sign:+.0f}; friction and the zero of the scale can only be separated "
                "with both branches"
            )
    if pressure.max() == pressure.min():
        check_moves(sources[0], PROCEDURE, "pressure_difference")
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
            f"{', '.join(source.name for source in sources)}: {PROCEDURE} needs readings at {_MINIMUM_LEVELS} "
            f"different pressures or more, not {levels}; pressures closer than {shown:.3g} {unit} ({why}) count as "
            "one: add recordings at other pressures"
        )


def _reading_indices(pressure: Floats, labels: Floats) -> NDArray[np.int64]:
    """Return the reading index of each sample; consecutive samples of a branch at the same pressure are one reading.

    ``labels`` (labels, samples) are branch and repetition. Friction varies with position within a stroke, so that these
    samples are not independent readings of the law.
    """
    widest = np.ptp(pressure) / _BINS / 2.0
    start, indices = 0, np.zeros(pressure.size, dtype=np.int64)
    for sample in range(1, pressure.size):
        is_new = abs(pressure[sample] - pressure[start]) > widest
        is_new = is_new or (labels[:, sample] != labels[:, sample - 1]).any()
        start = sample if is_new else start
        indices[sample] = indices[sample - 1] + is_new
    return indices


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
