"""How much gas a device takes: per step, from numbers or from a recording, and when it walks and rests."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.errors import DataError, ParameterError
from ppafo.signals import Recording
from ppafo.signals.recording import Floats

PEAK_WINDOW = 0.1
"""Seconds over which the largest flow of a recording is averaged; lines and regulator even out what is shorter."""

_MOST_FALLEN = 0.1
"""Share of the gas used that may flow back: it waits in the line before the valve, and the next step takes it."""


@dataclass(frozen=True, slots=True)
class Draw:
    """Gas use: mass per step [kg], time of a step [s], largest flow [kg/s], and where the numbers come from.

    A step is one cycle of the device's leg, heel strike to heel strike of the same foot.
    """

    mass_per_step: float
    step_time: float
    peak_flow: float
    origin: str

    @property
    def mean_flow(self) -> float:
        """Mass flow [kg/s] while walking, averaged over a step."""
        return self.mass_per_step / self.step_time

    def less(self, saved: float) -> "Draw":
        """Return the draw with a mass [kg] saved in every step; the largest flow stays, which is the safe side."""
        return replace(self, mass_per_step=self.mass_per_step - saved)


@dataclass(frozen=True, slots=True)
class Schedule:
    """Walking and resting in turn [s], for at most ``longest`` [s]; a rest of 0 s is walking without a break."""

    walk: float
    rest: float
    longest: float


def draw_of_numbers(mass_per_step: float, step_time: float, peak_flow: float | None) -> Draw:
    """Return the draw of given numbers [kg, s, kg/s]; without a largest flow the mean one is taken for it."""
    for name, value in (("gas per step", mass_per_step), ("step time", step_time)):
        if not (math.isfinite(value) and value > 0.0):
            raise ParameterError(f"{name} must be above 0, it is {value:g}")
    mean = mass_per_step / step_time
    if peak_flow is not None and not (math.isfinite(peak_flow) and peak_flow >= mean):
        raise ParameterError(
            f"the largest flow, {peak_flow * GRAMS_PER_KILOGRAM:.4g} g/s, must be at least the mean one, "
            f"{mean * GRAMS_PER_KILOGRAM:.4g} g/s"
        )
    return Draw(mass_per_step, step_time, mean if peak_flow is None else peak_flow, "numbers given")


def draw_of_recording(recording: Recording, step_time: float | None) -> Draw:
    """Return the draw of a recording with ``supplied_mass``, repeated for ever; all of it is one step by default."""
    if "supplied_mass" not in recording:
        raise DataError(f"{recording.label}: has no channel 'supplied_mass'; there are {', '.join(recording.names)}")
    supplied = _taken(recording)
    gain = float(supplied[-1] - supplied[0])
    if recording.duration <= 0.0 or gain <= 0.0:
        raise DataError(f"{recording.label}: no gas was taken from the supply, so a bottle would last for ever")
    fallen = -float(np.minimum(np.diff(supplied), 0.0).sum())
    if fallen > _MOST_FALLEN * gain:
        raise DataError(
            f"{recording.label}: supplied_mass falls by {fallen * GRAMS_PER_KILOGRAM:.3g} g in all while "
            f"{gain * GRAMS_PER_KILOGRAM:.3g} g are gained; it must count from the start of the recording to its end"
        )
    step = recording.duration if step_time is None else step_time
    if not 0.0 < step <= recording.duration:
        raise DataError(
            f"{recording.label}: a step of {step:g} s does not fit into a recording of {recording.duration:g} s"
        )
    mean = gain / recording.duration
    peak = max(mean, largest_flow(recording))
    return Draw(mean * step, step, peak, f"recording '{recording.label}', {recording.kind}, repeated")


def _taken(recording: Recording) -> Floats:
    """Return the gas [kg] that left the bottle: through its regulator, where there is a line between that and valve."""
    return recording["regulated_mass" if "regulated_mass" in recording else "supplied_mass"]


def largest_flow(recording: Recording) -> float:
    """Return the largest flow [kg/s], averaged over the window or over a recording that is shorter."""
    window = min(PEAK_WINDOW, recording.duration)
    starts = recording.time[recording.time <= recording.time[-1] - window]
    starts = np.append(starts, recording.time[-1] - window)
    ends = np.interp(starts + window, recording.time, _taken(recording))
    begins = np.interp(starts, recording.time, _taken(recording))
    return float(np.max(ends - begins) / window)
