"""Trajectory fit: any parameters of a device from any recordings of its motion, with intervals and verdicts.

``problem`` states the request, ``tolerances`` adds the uncertain quantities, ``runs`` computes residuals, ``fitting``
passes them to the common estimator, ``expected`` ranks further experiments, and ``section`` does all of this for a
problem file.
"""

from ppafo.identification.tolerances import Tolerances
from ppafo.identification.trajectory.experiment import FittedExperiment, FreeParameter, TrajectoryProblem
from ppafo.identification.trajectory.fitting import (
    CandidateExperiment,
    ChannelFit,
    ExpectedBenefit,
    TrajectoryFit,
    expected_information,
    fit,
)
from ppafo.identification.trajectory.tolerances import tolerance_parameters

__all__ = [
    "CandidateExperiment",
    "ChannelFit",
    "ExpectedBenefit",
    "FittedExperiment",
    "FreeParameter",
    "Tolerances",
    "TrajectoryFit",
    "TrajectoryProblem",
    "expected_information",
    "fit",
    "tolerance_parameters",
]
