"""Pressure decay of two closed chambers between which gas leaks: samples of a recording, and law of the pressures."""

import math
from typing import NamedTuple

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.checks import check_no_gap
from ppafo.identification.bench.flow import Opening, OpeningSizes
from ppafo.identification.source import RecordingSource, window
from ppafo.signals.faults import plateaus, stands_out
from ppafo.signals.recording import Floats

PROCEDURE = "vane-leak"
CHANNELS = ("pressure_1", "pressure_2")
MINIMUM_SAMPLES = 20
"""Least number of samples of a decay."""
EDGE = 20
"""Largest number of samples averaged at an end of a record for a start value, at most a tenth of the record."""
STANDS_STILL = 0.02
"""Largest ratio of the pressure changes of both chambers [-] at which the steadier chamber counts as a room."""
_NEARLY_EQUAL = 0.01
"""Pressure difference relative to the initial difference [-] below which a decay ends."""


class ChamberDecay(NamedTuple):
    """Decay of the pressures in two closed chambers.

    ``time`` is in s; ``first`` and ``second`` are the pressures [Pa] of the fuller chamber and the other; ``fuller`` is
    the number of the fuller chamber, 1 or 2; ``number`` is the number of the decay.
    """

    time: Floats
    first: Floats
    second: Floats
    fuller: int
    number: int

    @property
    def edge(self) -> int:
        """Number of samples averaged at an end of the decay."""
        return max(1, min(EDGE, self.time.size // 10))

    @property
    def changes(self) -> tuple[float, float]:
        """Fall of the pressure in the fuller chamber, and rise in the other chamber [Pa]."""
        edge = self.edge
        fall, rise = (float(np.mean(each[-edge:]) - np.mean(each[:edge])) for each in (self.first, self.second))
        return -fall, rise

    @property
    def room(self) -> int | None:
        """Index of the constant pressure, 0 for the fuller chamber and 1 for the other; None if both change."""
        fall, rise = (abs(change) for change in self.changes)
        if rise <= STANDS_STILL * fall:
            return 1
        return 0 if fall <= STANDS_STILL * rise else None

    @property
    def changing(self) -> int:
        """Index of the changing pressure that determines the leak: 0 for the fuller chamber, 1 for the other."""
        return 1 if self.room == 0 else 0

    @property
    def sensors(self) -> tuple[tuple[str, Floats], tuple[str, Floats]]:
        """Channels of the fuller and the other chamber, with their pressures [Pa]."""
        return (f"pressure_{self.fuller}", self.first), (f"pressure_{3 - self.fuller}", self.second)

    @property
    def fitted(self) -> list[tuple[str, Floats]]:
        """Fitted channels with their pressures [Pa]; the constant pressure of a room is not fitted."""
        return [sensor for side, sensor in enumerate(self.sensors) if side != self.room]

    @property
    def ends(self) -> tuple[float, float]:
        """Pressure difference at the start and at the end [Pa], each from a straight line through the edge samples.

        A mean over the edge instead would underestimate the fall.
        """
        edge, difference = self.edge, self.first - self.second
        if edge < 2:
            return float(difference[0]), float(difference[-1])
        start = np.polyfit(self.time[:edge] - self.time[0], difference[:edge], 1)[1]
        end = np.polyfit(self.time[-edge:] - self.time[-1], difference[-edge:], 1)[1]
        return float(start), float(end)


def chamber_decay(source: RecordingSource, start: float | None, end: float | None, number: int) -> ChamberDecay:
    """Return the decay between two times [s] of a recording, until the pressures are nearly equal.

    ``number`` is the number of the decay. Raises IdentificationError for a saturated sensor or too few samples.
    """
    part = window(source.recording, start, end)
    skipped = check_no_gap(source, PROCEDURE, part)
    for name in CHANNELS:
        for plateau in plateaus(part[name]):
            # Later plateaus may be the resolution of the sensor, as the pressure hardly falls any more.
            if plateau.first < EDGE and stands_out(part[name], plateau):
                raise IdentificationError(
                    f"{source.name}: {PROCEDURE}: channel '{name}' stays at exactly {1e-3 * plateau.value:g} kPa for "
                    f"{plateau.count} samples, up to sample {skipped + plateau.last + 1}, and changes only afterwards: "
                    "the sensor is saturated, or the chamber was not yet closed; give a start after this sample"
                )
    decay = ChamberDecay(part.time, part["pressure_1"], part["pressure_2"], fuller=1, number=number)
    if not np.mean((decay.first - decay.second)[: decay.edge]) > 0.0:
        decay = decay._replace(first=decay.second, second=decay.first, fuller=2)
    difference = decay.first - decay.second
    # Between nearly equal pressures, the zero errors of the sensors outweigh the difference.
    low = np.flatnonzero(difference < _NEARLY_EQUAL * float(np.mean(difference[: decay.edge])))
    count = int(low[0]) if low.size else difference.size
    if count < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: only {count} samples lie between the start and equal pressures, but "
            f"{MINIMUM_SAMPLES} are needed; record at a higher sample rate, or give a start at which the pressures "
            "differ"
        )
    time = decay.time[:count] - decay.time[0]
    return decay._replace(time=time, first=decay.first[:count], second=decay.second[:count])


_POINTS = 400
"""Number of pressure differences at which the time of a fall is computed."""
_LOWEST = 1.0e-3
"""Final pressure difference of a computed fall, relative to the initial difference [-]."""
_LEAST_DIFFERENCE = 1.0
"""Least initial pressure difference of a computed fall [Pa]."""
_LEAST_RATE = 1.0e-300
"""Least rate of a computed fall [Pa/s], so that the pressures of tight chambers stay finite."""


def pressures_of_fall(
    opening: Opening, sizes: OpeningSizes, first: float, second: float, ratio: float, rate: float, times: Floats
) -> tuple[Floats, Floats]:
    """Return both pressures [Pa] at times [s] while gas leaks between closed chambers.

        D' = -(1 + r) k g(P_1, P_2),   P_2 = P_2(0) + (D(0) - D) r / (1 + r),   P_1 = P_2 + D

    follows from the mass balance of both chambers with equation (3) at constant temperature. The time at which D is
    reached is the integral of D / D' over ln D, by the trapezoidal rule.

    Arguments:
        opening, sizes: law g [kg/s] of the leak, equations (6), (7), and its sizes
        first, second: initial absolute pressures P_1(0), P_2(0) [Pa] of the fuller chamber and the other
        ratio: r = V_1 / V_2 [-], 0 if the second chamber is a room, infinite if the first one is
        rate: k = R T / V_1 [Pa/kg], or R T / V_2 if the first chamber is a room
        times: times since the start [s]
    """
    start = max(first - second, _LEAST_DIFFERENCE)
    share_of_rise, both_chambers = (1.0, 1.0) if math.isinf(ratio) else (ratio / (1.0 + ratio), 1.0 + ratio)
    # A laminar leak falls exponentially, so that equal steps of ln D are equal steps of time.
    logs = np.linspace(0.0, -math.log(_LOWEST), _POINTS)
    difference = start * np.exp(-logs)
    lower = second + share_of_rise * (start - difference)
    flow = opening.flow(sizes, lower + difference, lower)
    time_per_log = difference / np.maximum(both_chambers * rate * flow, _LEAST_RATE)
    steps = 0.5 * (time_per_log[1:] + time_per_log[:-1]) * np.diff(logs)
    fall_times = np.concatenate(([0.0], np.cumsum(steps)))
    remaining = np.exp(np.interp(times, fall_times, np.log(difference)))
    lower = second + share_of_rise * (start - remaining)
    return lower + remaining, lower
