"""What a trajectory fit gives back."""

from dataclasses import dataclass

from ppafo.errors import IdentificationError, nearest_name
from ppafo.identification.estimate import Estimate
from ppafo.identification.trajectory.paths import full_path
from ppafo.identification.trajectory.preparation import Floats
from ppafo.identification.trajectory.problem import TrajectoryProblem
from ppafo.identification.trajectory.search import Optimum
from ppafo.signals import Recording
from ppafo.simulation.scenario import Scenario


@dataclass(frozen=True, slots=True)
class ChannelFit:
    """How one channel of one experiment is explained, in its SI unit.

    ``noise`` is the standard deviation that weighs it, ``is_given`` False where it was estimated from the recording;
    ``rms``, ``bias`` (model less sample) and ``largest`` describe what is left; ``chi_square`` is the mean square over
    the noise and ``autocorrelation`` that of neighbouring residuals, 1 and 0 for a model that explains all but noise.
    """

    experiment: str
    channel: str
    unit: str
    noise: float
    is_given: bool
    rms: float
    bias: float
    largest: float
    chi_square: float
    autocorrelation: float


@dataclass(frozen=True, slots=True)
class TrajectoryFit:
    """Estimates with verdicts, their covariance in SI units and correlation, and what is left unexplained.

    Matrices are in the order of ``estimates``. ``information`` is that of the coordinates, samples and priors together,
    ``inflation`` the factor on all variances for a model that does not explain the samples to their noise. ``models``
    are the fitted runs at the times of the samples, ``measurements`` the samples, both by experiment over the time of
    the run. ``remarks`` are sentences about the fit as a whole.
    """

    problem: TrajectoryProblem
    estimates: tuple[Estimate, ...]
    covariance: Floats
    correlation: Floats
    information: Floats
    inflation: float
    cost: float
    evaluations: int
    channels: tuple[ChannelFit, ...]
    models: tuple[Recording, ...]
    measurements: tuple[Recording, ...]
    scenarios: tuple[Scenario, ...]
    remarks: tuple[str, ...]
    optimum: Optimum

    def estimate(self, name: str) -> Estimate:
        """Return the estimate of a parameter by its path; ``valve.area`` means the valve of the first experiment."""
        full = full_path(name, self.scenarios[0])
        for estimate in self.estimates:
            if estimate.path == full:
                return estimate
        hint = nearest_name(full, [item.path for item in self.estimates])
        raise IdentificationError(f"'{name}' was not fitted{hint}")

    @property
    def values(self) -> dict[str, float]:
        """The estimates in SI units by path."""
        return {estimate.path: estimate.value for estimate in self.estimates}
