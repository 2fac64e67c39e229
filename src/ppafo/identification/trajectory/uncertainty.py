"""How far estimates may be from the truth: their distribution, the noise it rests on, and the test of the model."""

from dataclasses import dataclass

import numpy as np

from ppafo.identification.trajectory.information import covariance, data_information, prior_information
from ppafo.identification.trajectory.misfit import Misfit, misfit_of
from ppafo.identification.trajectory.mixture import Mixture
from ppafo.identification.trajectory.posterior import drawn_posterior
from ppafo.identification.trajectory.preparation import Floats
from ppafo.identification.trajectory.problem import Search
from ppafo.identification.trajectory.weighing import Sensor, Weighed

_TOLD = 1.5


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Distribution of the coordinates about the point of the optimum, and what it is made of.

    ``curvature`` is the information of the recordings with the noise as estimated; ``inflation`` [-] the median over
    all coordinates of the variance over the inverse of that, because the noise is itself uncertain; ``widening`` [-]
    how many times as wide the intervals are as white noise of the size from sample to sample would have them.
    ``low`` and ``high`` are the ends of the intervals in coordinates, ``centre`` the means.
    """

    mixture: Mixture
    covariance: Floats
    curvature: Floats
    inflation: float
    widening: float
    centre: Floats
    low: Floats
    high: Floats
    sensors: tuple[Sensor, ...]
    misfit: Misfit

    @property
    def residual_check(self) -> str:
        """What the intervals rest on, in half a sentence."""
        names = dict.fromkeys(f"{one.channel} {one.in_words}" for one in self.sensors)
        told = f"noise: {'; '.join(names)}"
        if self.widening < _TOLD:
            return told
        return f"{told}; so the interval is {self.widening:.2g} times as wide as white noise alone asks"


def uncertainty_of(found: Weighed, search: Search, low: Floats, high: Floats) -> Uncertainty:
    """Return the uncertainty at an optimum whose noise is known; ``low`` and ``high`` bound the coordinates."""
    point = found.optimum.point
    kept = len(point)
    mixture, shown = drawn_posterior(found.model, found.noises, kept, search.seed)
    matrix, curvature = mixture.covariance, found.optimum.information
    tail = 0.5 - 0.5 * search.confidence
    ends = [
        [
            point[index] + mixture.quantile(index, share, low[index] - point[index], high[index] - point[index])
            for index in range(kept)
        ]
        for share in (tail, 1.0 - tail)
    ]
    residuals = found.optimum.residuals
    slopes = found.model.slopes[:, :kept]
    white = data_information(slopes, np.ones(len(slopes))) + prior_information(residuals)
    centre = np.clip(point + mixture.mean, low, high)
    return Uncertainty(
        mixture=mixture,
        covariance=matrix,
        curvature=curvature,
        inflation=float(np.median(np.diag(matrix) / np.diag(covariance(curvature)))),
        widening=float(np.sqrt(np.median(np.diag(matrix) / np.diag(covariance(white))))),
        centre=np.clip(centre, ends[0], ends[1]),
        low=np.array(ends[0]),
        high=np.array(ends[1]),
        sensors=found.sensors,
        misfit=misfit_of(found, shown, search.seed),
    )
