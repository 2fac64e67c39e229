"""A number whose posterior is as wide as its prior is decided by the prior, whatever the noise of the sensors is."""

import numpy as np
import pytest

from ppafo.identification.estimate import Estimate
from ppafo.identification.trajectory import Prior, Search
from ppafo.identification.trajectory.problem import Range
from ppafo.identification.trajectory.uncertainty import Evidence, estimate_of

DEVIATION = 0.05
"""Standard deviation of the prior [-], in the logarithm of the number."""


def estimate(fraction: float, inflation: float) -> Estimate:
    """The estimate of a number whose posterior is this fraction as wide as the prior."""
    prior = Prior(0.01, DEVIATION * 0.01)
    item = Range("foot_plate.inertia", "foot_plate.inertia", "kg m^2", "log", 0.01, 0.001, 0.1, 1.0, prior, ())
    error, point = fraction * DEVIATION, np.log([0.01])
    return estimate_of(
        Evidence(
            ranges=(item,),
            point=point,
            interval=(point - 2.0 * error, point + 2.0 * error),
            information=np.array([[1.0 / DEVIATION**2]]),
            covariance=np.array([[error**2]]),
            correlation=np.ones((1, 1)),
            low=np.log([0.001]),
            high=np.log([0.1]),
            prior_deviation=np.array([DEVIATION]),
            inflation=inflation,
            residual_check="noise: white",
            misfit="",
            alone=("",),
            sources=(("step.csv",),),
            search=Search(),
        ),
        0,
    )


@pytest.mark.parametrize("inflation", [0.7, 1.0, 2.0, 10.0])
def test_what_the_noise_widens_elsewhere_does_not_change_what_the_prior_decides(inflation: float) -> None:
    silent, told = estimate(1.0, inflation), estimate(0.75, inflation)
    assert silent.verdict == "not identifiable"
    assert silent.explanation.startswith("The recordings add little to the prior, which decides the value")
    assert told.verdict == "identified"
