"""What a trajectory fit gives back."""

from dataclasses import dataclass

from ppafo.errors import IdentificationError, nearest_name
from ppafo.identification.estimate import Estimate
from ppafo.identification.trajectory.channels import ChannelFit
from ppafo.identification.trajectory.paths import full_path
from ppafo.identification.trajectory.preparation import Floats
from ppafo.identification.trajectory.problem import TrajectoryProblem
from ppafo.identification.trajectory.search import Optimum
from ppafo.identification.trajectory.uncertainty import Uncertainty
from ppafo.signals import Recording
from ppafo.simulation.scenario import Scenario


@dataclass(frozen=True, slots=True)
class TrajectoryFit:
    """Estimates with verdicts, their covariance in SI units and correlation, and what is left unexplained.

    Matrices are in the order of ``estimates``; those of the coordinates are in ``uncertainty``. ``models`` are the
    fitted runs at the times of the samples, ``measurements`` the samples, both by experiment over the time of the run.
    ``remarks`` are sentences about the fit as a whole.
    """

    problem: TrajectoryProblem
    estimates: tuple[Estimate, ...]
    covariance: Floats
    correlation: Floats
    uncertainty: Uncertainty
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
