"""Delay between measurement and model: the time shift with the least squared error of all channels."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from ppafo.signals.recording import Floats
from ppafo.validation.compared import ErrorLimit

_SHIFTS = 81
"""Number of delays on the initial search grid between both limits."""
_MAXIMUM_SAMPLES = 4000
"""Largest number of samples of a channel used to estimate the delay."""
_MINIMUM_GAIN = 25.0
"""Least reduction of the squared error for a delay, in sample variances: five standard deviations of white noise."""
_SMALLEST_GAIN = 1.0e-12
"""Reduction of the squared error below which two curves are equal to engine accuracy."""
_RESOLUTION = 0.02
"""Smallest detectable delay, as a fraction of the sample interval [-]; smaller delays count as 0."""
_ACCURACY = 1.0e-7
"""Accuracy of the estimated delay as a fraction of the limit [-]."""
_AT_LIMIT = 0.99
"""Fraction of the limit [-] from which a delay counts as being at the limit."""


@dataclass(frozen=True, slots=True)
class ComparedCurve:
    """Measured and modelled values of a channel, each with its own times [s].

    ``unit`` is the SI unit of an error, ``full_range`` the full range of the channel, ``usual_zero`` the usual zero
    error of a sensor, both in this unit. ``limit`` is the error limit set by the user, if any.
    """

    channel: str
    unit: str
    times: Floats
    values: Floats
    model_times: Floats
    model_values: Floats
    full_range: float
    usual_zero: float
    limit: ErrorLimit | None = None

    def shift(self, delay: float, times: Floats) -> Floats:
        """Return the model delayed by ``delay`` [s] at ``times`` [s], constant outside the range of the model."""
        return np.interp(times - delay, self.model_times, self.model_values)


@dataclass(frozen=True, slots=True)
class Delay:
    """Delay of the measurement behind the model [s], below 0 if it leads, 0 if undetectable; flag of the limit."""

    value: float
    is_at_limit: bool

    @property
    def correction(self) -> float:
        """Delay to correct [s]; 0 at the search limit and below 0, where the best fit is no delay of a sensor."""
        return 0.0 if self.is_at_limit else max(self.value, 0.0)


def estimate_delay(curves: list[ComparedCurve], limit: float) -> Delay:
    """Return the delay within +-``limit`` [s] with the least mean squared error over all channels."""
    if limit <= 0.0 or not curves:
        return Delay(0.0, is_at_limit=False)
    # No more measured samples than the search needs.
    steps = [-(-curve.times.size // _MAXIMUM_SAMPLES) for curve in curves]
    thinned = [
        replace(curve, times=curve.times[::step], values=curve.values[::step])
        for curve, step in zip(curves, steps, strict=True)
    ]

    def cost(delay: float) -> float:
        """Return the mean squared error over all samples and channels, in units of full range squared [-]."""
        errors = [(curve.shift(delay, curve.times) - curve.values) / curve.full_range for curve in thinned]
        return sum(float(np.square(error).mean()) for error in errors) / len(errors)

    shifts = np.linspace(-limit, limit, _SHIFTS).tolist()
    best = int(np.argmin([cost(shift) for shift in shifts]))
    bounds = shifts[max(0, best - 1)], shifts[min(_SHIFTS - 1, best + 1)]
    value = float(minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": _ACCURACY * limit}).x)
    # A delay counts where it explains more than noise and the accuracy of the engine could.
    least = cost(value)
    gain, samples = cost(0.0) - least, sum(curve.times.size for curve in thinned)
    is_significant = gain > _SMALLEST_GAIN and gain * samples > _MINIMUM_GAIN * least
    if abs(value) < _RESOLUTION * float(np.median(np.diff(curves[0].times))) or not is_significant:
        return Delay(0.0, is_at_limit=False)
    return Delay(value, abs(value) > _AT_LIMIT * limit)
