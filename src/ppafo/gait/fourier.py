"""Least-squares fit of a Fourier series to curves over the stride."""

from dataclasses import dataclass

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.gait import Curve
from ppafo.signals.recording import Floats

HARMONICS: dict[str, int] = {
    "shank_angle": 6,
    "ankle_angle": 10,
    "ankle_moment": 10,
    "vertical_force": 12,
    "centre_of_pressure": 10,
    "knee_forward": 6,
    "knee_up": 6,
}
"""As many as bring the fit well below the spread between strides, and not more: each one roughens the acceleration."""


@dataclass(frozen=True, slots=True)
class FitError:
    """Error of the series: root mean square and largest, in the unit of the curve."""

    root_mean_square: float
    largest: float


def fit_curve(values: Floats, harmonics: int, deviation: float = 0.0) -> tuple[Curve, FitError]:
    """Return the series through values at even phases from 0 to 1, both ends counted, and its errors.

    All in the unit of ``values`` [SI]. DataError where there are too few values.
    """
    if values.size < 2 * harmonics + 2:
        raise DataError(f"{values.size} samples are too few for {harmonics} harmonics")
    turns = 2.0 * np.pi * np.linspace(0.0, 1.0, values.size)
    orders = np.arange(1, harmonics + 1)
    terms = [np.ones((values.size, 1)), np.cos(np.outer(turns, orders)), np.sin(np.outer(turns, orders))]
    design = np.hstack(terms)
    solution = np.linalg.lstsq(design, values, rcond=None)[0]
    left = design @ solution - values
    cosines, sines = solution[1 : harmonics + 1].tolist(), solution[harmonics + 1 :].tolist()
    error = FitError(float(np.sqrt(np.mean(left**2))), float(np.max(np.abs(left))))
    return Curve(float(solution[0]), tuple(cosines), tuple(sines), deviation), error
