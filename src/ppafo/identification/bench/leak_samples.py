"""The part of a recording in which two closed chambers keep or lose their pressures, and what of it cannot be used."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.flow_laws import Chambers, GasAt, Opening
from ppafo.identification.bench.inputs import check_absolute, check_moves, check_no_gap, check_sources, window
from ppafo.identification.bench.leak_fits import EDGE, Decay
from ppafo.identification.source import Source
from ppafo.signals import Recording
from ppafo.signals.faults import plateaus, stands_out
from ppafo.signals.recording import Floats

PROCEDURE = "vane-leak"
CHANNELS = ("pressure_1", "pressure_2")
MINIMUM_SAMPLES = 20
STANDS_STILL = 0.02
"""Change of a pressure over that of the other, up to which a chamber counts as a room."""

_NEARLY_EQUAL = 0.01


@dataclass(frozen=True, slots=True)
class VaneLeakSettings:
    """The gas, chamber volumes [m^3] where known, the leak's discharge coefficient [-], and the times to use [s].

    Without ``volume_1`` there is no area, only a rate. A ``critical_ratio`` [-] asks for a sonic conductance.
    ``calibration`` is the relative uncertainty of the flow meter's gain [-], for steady readings.
    """

    gas: GasAt
    volume_1: float | None = None
    volume_2: float | None = None
    discharge_coefficient: float | None = None
    start: float | None = None
    end: float | None = None
    confidence: float = 0.95
    calibration: float = 0.0
    critical_ratio: float | None = None

    @property
    def opening(self) -> Opening:
        """The leak in the form in which the set has it."""
        return Opening(self.gas, self.discharge_coefficient, self.critical_ratio)


def falling_decays(
    sources: tuple[Source, ...], settings: VaneLeakSettings
) -> tuple[tuple[Decay, ...], tuple[float, ...]]:
    """Return the decays in which a leak shows, none where the chambers are tight, with the noise [Pa] of each."""
    check_sources(sources, PROCEDURE, CHANNELS, MINIMUM_SAMPLES)
    shown = [item for item in (closed_chambers(source, settings) for source in sources) if item.falls]
    return tuple(decay_in(item, settings) for item in shown), tuple(item.noise for item in shown)


class ClosedChambers(NamedTuple):
    """Two closed chambers: time [s], pressures [Pa] of the fuller and the other, which is the fuller, noise [Pa]."""

    time: Floats
    first: Floats
    second: Floats
    fuller: int
    noise: float

    @property
    def difference(self) -> Floats:
        """Pressure of the fuller chamber less that of the other [Pa]."""
        return self.first - self.second

    @property
    def drop(self) -> float:
        """How far the difference falls from start to end [Pa]."""
        return float(np.mean(self.difference[:EDGE]) - np.mean(self.difference[-EDGE:]))

    @property
    def falls(self) -> bool:
        """Whether the difference falls by more than the noise of the samples at both ends."""
        return self.drop > 3.0 * self.noise / math.sqrt(EDGE)


def closed_chambers(source: Source, settings: VaneLeakSettings) -> ClosedChambers:
    """Return the chambers of a recording between its start and equal pressures.

    IdentificationError where too few samples are left.
    """
    check_moves(source, PROCEDURE, "pressure_1")
    part = window(source.recording, settings.start, settings.end)
    _check_samples(source, part)
    check_absolute(source, PROCEDURE, CHANNELS)
    pair = part["pressure_1"], part["pressure_2"]
    fuller = 1 if np.mean((pair[0] - pair[1])[:EDGE]) > 0.0 else 2
    first, second = pair if fuller == 1 else pair[::-1]
    difference = first - second
    start = float(np.mean(difference[:EDGE]))
    low = np.flatnonzero(difference < _NEARLY_EQUAL * start)
    last = int(low[0]) if low.size else difference.size
    if last < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: only {last} samples lie between start and equal pressures, "
            f"{MINIMUM_SAMPLES} are needed; record faster, or give start"
        )
    noise = float(np.std(np.diff(difference[:last]))) / np.sqrt(2.0)
    return ClosedChambers(
        time=part.time[:last] - part.time[0], first=first[:last], second=second[:last], fuller=fuller, noise=noise
    )


def decay_in(closed: ClosedChambers, settings: VaneLeakSettings) -> Decay:
    """Return the decay of the pressure difference."""
    difference = closed.difference
    ratio = _volume_ratio(closed, settings)
    total = ratio * closed.first + closed.second
    lost = abs(float(np.mean(total[-EDGE:]) - np.mean(total[:EDGE]))) / (1.0 + ratio)
    chambers = Chambers(ratio, float(np.mean(total)))
    return Decay(closed.time, difference, chambers, lost / closed.drop, float(difference.min()), closed.fuller)


def _check_samples(source: Source, part: Recording) -> None:
    """Refuse a gap, and a sensor that was at its limit when the decay began."""
    skipped = check_no_gap(source, PROCEDURE, part)
    for name in CHANNELS:
        for plateau in plateaus(part[name]):
            if plateau.first < EDGE and stands_out(part[name], plateau):
                raise IdentificationError(
                    f"{source.name}: {PROCEDURE}: channel '{name}' stays at exactly {plateau.value:g} Pa for "
                    f"{plateau.count} samples, up to sample {skipped + plateau.last + 1}, and changes only then: the "
                    f"sensor is saturated, or the chamber was not yet closed; give start"
                )


def _volume_ratio(closed: ClosedChambers, settings: VaneLeakSettings) -> float:
    """Return the volume of the emptying chamber over that of the other, 0 where the other is a room."""
    change = float(np.mean(closed.first[:EDGE]) - np.mean(closed.first[-EDGE:]))
    rise = float(np.mean(closed.second[-EDGE:]) - np.mean(closed.second[:EDGE]))
    if abs(rise) <= STANDS_STILL * abs(change):
        return 0.0
    return volume_ratio(closed, settings) or max(rise / change, 0.0)


def volume_ratio(closed: ClosedChambers, settings: VaneLeakSettings) -> float:
    """Return the volume of the fuller chamber over that of the other [-]; 0 where one of them is not known."""
    if settings.volume_1 is None or settings.volume_2 is None:
        return 0.0
    ratio = settings.volume_1 / settings.volume_2
    return ratio if closed.fuller == 1 else 1.0 / ratio
