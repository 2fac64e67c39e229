"""A periodic curve as a Fourier series over one stride: value, rate and acceleration at a phase.

``cosines`` and ``sines`` are tuples of the same length, first harmonic first; the phase counts strides, so 0 and 1 are
two heel strikes. Floats and tuples of floats only, so that the functions can be compiled as they stand.
"""

from ppafo.model.turns import TURN, sine_and_cosine


def periodic_value(mean_level: float, cosines: tuple[float, ...], sines: tuple[float, ...], phase: float) -> float:
    """Value of the series at a phase [strides], in the unit of its coefficients."""
    sine, cosine = sine_and_cosine(phase)
    value, high_sine, high_cosine = mean_level, 0.0, 1.0
    for order in range(len(cosines)):
        high_sine, high_cosine = high_sine * cosine + high_cosine * sine, high_cosine * cosine - high_sine * sine
        value += cosines[order] * high_cosine + sines[order] * high_sine
    return value


def periodic_motion(
    mean_level: float, cosines: tuple[float, ...], sines: tuple[float, ...], phase: float, stride_time: float
) -> tuple[float, float, float]:
    """Value, rate and acceleration by time at a phase [strides], in the unit of the coefficients, per s and per s^2."""
    sine, cosine = sine_and_cosine(phase)
    value, rate, acceleration, high_sine, high_cosine = mean_level, 0.0, 0.0, 0.0, 1.0
    for order in range(len(cosines)):
        high_sine, high_cosine = high_sine * cosine + high_cosine * sine, high_cosine * cosine - high_sine * sine
        harmonic = cosines[order] * high_cosine + sines[order] * high_sine
        value += harmonic
        rate += (order + 1) * (sines[order] * high_cosine - cosines[order] * high_sine)
        acceleration -= (order + 1) * (order + 1) * harmonic
    angular = TURN / stride_time
    return value, angular * rate, angular * angular * acceleration
