"""Gas demand of a device per stride and per time, from given numbers or from a recording."""

import math
from dataclasses import dataclass

import numpy as np

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.errors import DataError, ParameterError
from ppafo.signals import Recording
from ppafo.signals.recording import Floats
from ppafo.units.shown import shown_text

PEAK_WINDOW = 0.1
"""Averaging window [s] for the largest flow of a recording; lines and regulator smooth shorter peaks."""
_MOST_RETURNED = 0.1
"""Largest fraction of the gas that may flow back; it stays in the line upstream of the valve for the next stride."""


@dataclass(frozen=True, slots=True)
class GasDemand:
    """Gas demand: mass per stride [kg], stride time [s], largest flow [kg/s], and origin of the numbers.

    A stride is one cycle of the leg with the device, from heel strike to heel strike of the same foot.
    """

    mass_per_stride: float
    stride_time: float
    peak_flow: float
    origin: str

    @property
    def mean_flow(self) -> float:
        """Mass flow [kg/s] while walking, averaged over a stride."""
        return self.mass_per_stride / self.stride_time


def demand_of_numbers(mass_per_stride: float, stride_time: float, peak_flow: float | None) -> GasDemand:
    """Return the gas demand for given numbers [kg], [s], [kg/s]; the default of the largest flow is the mean flow."""
    for name, value, unit in (("gas per stride", mass_per_stride, "kg"), ("stride time", stride_time, "s")):
        if not (math.isfinite(value) and value > 0.0):
            raise ParameterError(f"{name} = {value:g} {unit}: must be above 0")
    mean = mass_per_stride / stride_time
    if peak_flow is not None and not (math.isfinite(peak_flow) and peak_flow >= mean):
        raise ParameterError(
            f"the largest flow is {shown_text(peak_flow, 'kg/s', '.4g')}; it must be at least the mean flow, "
            f"{shown_text(mean, 'kg/s', '.4g')}"
        )
    return GasDemand(mass_per_stride, stride_time, mean if peak_flow is None else peak_flow, "numbers given")


def demand_of_recording(recording: Recording, stride_time: float | None) -> GasDemand:
    """Return the gas demand of an endlessly repeated recording with ``supplied_mass``; by default it is one stride."""
    if "supplied_mass" not in recording:
        raise DataError(
            f"{recording.label}: there is no channel 'supplied_mass'; available: {', '.join(recording.names)}"
        )
    supplied = _gas_use(recording)
    # Not the last value alone: a recording may begin in the middle of a walk.
    gain = float(supplied[-1] - supplied[0])
    if recording.duration <= 0.0 or gain <= 0.0:
        raise DataError(
            f"{recording.label}: the run takes no gas from the supply, so no bottle would become "
            "empty; give a recording that uses gas"
        )
    returned = -float(np.minimum(np.diff(supplied), 0.0).sum())
    if returned > _MOST_RETURNED * gain:
        raise DataError(
            f"{recording.label}: supplied_mass falls by {returned * GRAMS_PER_KILOGRAM:.3g} g in total and rises "
            f"by {gain * GRAMS_PER_KILOGRAM:.3g} g; it must be the cumulative gas from start to end"
        )
    stride = recording.duration if stride_time is None else stride_time
    if not 0.0 < stride <= recording.duration:
        raise DataError(
            f"{recording.label}: stride = {stride:g} s must not be longer than the recording, {recording.duration:g} s"
        )
    mean = gain / recording.duration
    peak = max(mean, largest_flow(recording))
    return GasDemand(mean * stride, stride, peak, f"recording '{recording.label}', {recording.kind}, repeated")


def _gas_use(recording: Recording) -> Floats:
    """Return the gas [kg] drawn from the bottle: at the regulator of a simulated supply line, else at the valve."""
    return recording["regulated_mass" if "regulated_mass" in recording else "supplied_mass"]


def largest_flow(recording: Recording) -> float:
    """Return the largest flow [kg/s], as moving average over the window, or over a shorter recording."""
    window = min(PEAK_WINDOW, recording.duration)
    starts = recording.time[recording.time <= recording.time[-1] - window]
    # The last window need not begin at a sample.
    starts = np.append(starts, recording.time[-1] - window)
    begins, ends = (np.interp(times, recording.time, _gas_use(recording)) for times in (starts, starts + window))
    return float(np.max(ends - begins) / window)
