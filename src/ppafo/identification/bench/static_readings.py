"""Readings of a static torque test: which belong to a branch, to a repetition and to a pressure."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import IdentificationError
from ppafo.identification.bench.inputs import check_moves, pooled
from ppafo.identification.bench.regression import Labels, labels_of
from ppafo.identification.source import Source
from ppafo.signals.recording import Floats

PROCEDURE = "static_torque"
Flags = NDArray[np.bool_]
FEWEST_SAMPLES = 6
_FEWEST_LEVELS = 3
_LEVEL_GAP = 1.0 / 40.0
_WIDEST_LEVEL = 1.0 / 8.0
_BINS = 20
_FLAT = 0.002


@dataclass(frozen=True, slots=True)
class Readings:
    """All readings of a branch: pressure difference [Pa], torque [N m], branch (+1, -1), groups, place in a file."""

    pressure: Floats
    torque: Floats
    branch: Floats
    clusters: Labels
    levels: Labels
    places: tuple[str, ...]

    @property
    def middle(self) -> float:
        """Mean pressure difference [Pa]."""
        return float(np.mean(self.pressure))


def readings_of(sources: tuple[Source, ...]) -> Readings:
    """Return the readings of all recordings; those that cannot tell slope from friction are refused."""
    direction = pooled(sources, "direction")
    for source in sources:
        _check_direction(source)
    used = direction != 0.0
    used &= ~_not_broken_away(pooled(sources, "pressure_difference"), pooled(sources, "torque"), direction)
    pressure, torque = pooled(sources, "pressure_difference")[used], pooled(sources, "torque")[used]
    if pressure.size < FEWEST_SAMPLES:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE} needs at least {FEWEST_SAMPLES} readings, there are {pressure.size}"
        )
    for sign, name in ((1.0, "rising"), (-1.0, "falling")):
        if not (direction[used] == sign).any():
            raise IdentificationError(
                f"{', '.join(source.name for source in sources)}: {PROCEDURE}: the {name} branch is missing: no "
                f"reading has direction {sign:+.0f}; without both, friction cannot be told from the zero of the scale"
            )
    if pressure.max() == pressure.min():
        check_moves(sources[0], PROCEDURE, "pressure_difference")
    levels = _levels(pressure)
    if levels.max() + 1 < _FEWEST_LEVELS:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE} needs readings at {_FEWEST_LEVELS} different pressures or more, "
            f"there are {levels.max() + 1}"
        )
    places = tuple(
        f"sample {number} of {source.name}" for source in sources for number in range(1, len(source.recording) + 1)
    )
    kept = tuple(place for place, is_used in zip(places, used.tolist(), strict=True) if is_used)
    return Readings(pressure, torque, direction[used], _clusters(sources)[used], levels, kept)


def _not_broken_away(pressure: Floats, torque: Floats, direction: Floats) -> Flags:
    """Return which rising readings lie on a flat start: a scale that only pulls shows none until friction is overcome.

    A flat start is a lowest reading that belongs to two pressures or more, or is nothing at all.
    """
    lowest = torque.min()
    resting = (direction > 0.0) & (torque <= lowest + _FLAT * np.ptp(torque))
    is_flat = resting.any() and np.ptp(pressure[resting]) > _LEVEL_GAP * np.ptp(pressure)
    return np.asarray(resting if is_flat or lowest == 0.0 else np.zeros_like(resting))


def _check_direction(source: Source) -> None:
    values = source.recording["direction"]
    wrong = np.flatnonzero(~np.isin(values, (-1.0, 0.0, 1.0)))
    if wrong.size:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: channel 'direction' is {values[wrong[0]]:g} at sample {wrong[0] + 1}; "
            f"it is 1 while the pressure rises, -1 while it falls, 0 for neither"
        )


def _clusters(sources: tuple[Source, ...]) -> Labels:
    """Return one label for each repetition of each recording; without repetitions a recording is one cluster."""
    files = np.concatenate([np.full(len(source.recording), number) for number, source in enumerate(sources)])
    repetitions = [
        source.recording["repetition"] if "repetition" in source.recording else np.zeros(len(source.recording))
        for source in sources
    ]
    _, labels = np.unique(np.concatenate(repetitions), return_inverse=True)
    return labels_of([files.astype(np.int64), labels.astype(np.int64)])


def _levels(pressure: Floats) -> Labels:
    """Return which pressure level each reading belongs to: groups with gaps between them, else equal parts."""
    span = float(pressure.max() - pressure.min())
    if span == 0.0:
        return np.zeros(pressure.size, dtype=np.int64)
    order = np.argsort(pressure)
    steps = np.diff(pressure[order]) > _LEVEL_GAP * span
    levels = np.empty(pressure.size, dtype=np.int64)
    levels[order] = np.concatenate(([0], np.cumsum(steps)))
    widths = [float(np.ptp(pressure[levels == level])) for level in range(int(levels.max()) + 1)]
    if max(widths) <= _WIDEST_LEVEL * span:
        return levels
    bins = np.minimum((pressure - pressure.min()) / span * _BINS, _BINS - 1).astype(np.int64)
    return labels_of([bins])
