"""How far estimates may be from the truth: covariance, and what the residuals say of the model."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.identification.trajectory.channels import ChannelFit
from ppafo.identification.trajectory.information import (
    covariance,
    curvature_and_spread,
    dependence,
    directions_for,
    loss_weights,
    sandwich,
)
from ppafo.identification.trajectory.preparation import Floats
from ppafo.identification.trajectory.problem import Search
from ppafo.identification.trajectory.residuals import Neighbourhood
from ppafo.identification.trajectory.search import Optimum, is_at_bound

_MUCH = 1.5


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Covariance of the coordinates and the curvature of the cost from which it comes.

    ``inflation`` [-] is the factor between the covariance and the inverse of the curvature: because the model does not
    explain the samples to their noise, because residuals hang together; with a robust loss its median over all
    parameters. ``chi_square`` [-] is the weighted mean square of the residuals over the noise, ``neighbours`` [-] the
    mean correlation of neighbouring ones.
    """

    covariance: Floats
    curvature: Floats
    inflation: float
    chi_square: float
    neighbours: float

    @property
    def residual_check(self) -> str:
        """The residuals in half a sentence."""
        size = np.sqrt(self.chi_square)
        text = f"residuals are {size:.2f} times the noise, neighbours correlate {self.neighbours:+.2f}"
        if self.inflation < _MUCH:
            return text
        return f"{text}, so the interval is {np.sqrt(self.inflation):.2g} times as wide as noise alone asks"


def uncertainty_of(found: Optimum, channels: Sequence[ChannelFit], search: Search) -> Uncertainty:
    """Return the uncertainty at an optimum; with a robust loss the covariance is the sandwich."""
    left = found.residuals.of_data(found.point[None, :])[:, 0]
    weights = loss_weights(left, search.loss)
    chi_square = float(np.sum(weights * left * left) / max(1, left.size - len(found.point)))
    neighbours = float(np.mean([channel.autocorrelation for channel in channels]))
    together = dependence(neighbours, left.size)
    if search.loss == "linear":
        factor = max(1.0, chi_square) * together
        return Uncertainty(factor * covariance(found.information), found.information, factor, chi_square, neighbours)
    curvature, spread = curvature_and_spread(_near(found), search.loss)
    matrix = together * sandwich(curvature, spread)
    ratios = np.diag(matrix) / np.diag(covariance(curvature))
    return Uncertainty(matrix, curvature, float(np.median(ratios)), chi_square, neighbours)


def _near(found: Optimum) -> Neighbourhood:
    fixed = is_at_bound(found.point, found.residuals.ranges)
    return found.residuals.around(found.point, directions_for(found.information, fixed))
