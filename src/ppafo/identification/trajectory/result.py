"""What a trajectory fit gives back."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ppafo.errors import IdentificationError, nearest_name
from ppafo.identification.estimate import Estimate
from ppafo.identification.trajectory.channels import ChannelFit, reason_of_misfit
from ppafo.identification.trajectory.paths import full_path
from ppafo.identification.trajectory.preparation import Floats
from ppafo.identification.trajectory.problem import TrajectoryProblem
from ppafo.identification.trajectory.residuals import coordinate_bounds
from ppafo.identification.trajectory.search import Optimum
from ppafo.identification.trajectory.uncertainty import Uncertainty
from ppafo.signals import Recording
from ppafo.simulation.scenario import Scenario

if TYPE_CHECKING:
    from xarray import Dataset, DataTree


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
    def misfit(self) -> str:
        """Why the model does not explain the recordings, so that what they fix holds for it only; empty if it does."""
        return reason_of_misfit(self.uncertainty.misfit, self.channels)

    def posterior(self) -> "DataTree":
        """Return draws of the numbers and the recordings as a tree of datasets, laid out as ArviZ reads it; SI units.

        ``posterior`` has a variable for each number over ``chain`` and ``draw``, ``observed_data`` the samples and
        ``fitted_data`` the fitted runs, each channel over the time of its recording.
        """
        import numpy as np
        from xarray import Dataset, DataTree

        mixture, ranges = self.uncertainty.mixture, self.optimum.residuals.ranges
        chains = len(np.unique(mixture.chain))
        points = np.clip(self.optimum.point + mixture.draws, *coordinate_bounds(ranges))
        posterior = {
            item.name: (
                ("chain", "draw"),
                np.array([item.number(float(one)) for one in points[:, index]]).reshape(chains, -1),
                {"unit": item.unit},
            )
            for index, item in enumerate(ranges)
        }
        kind = {"kind": self.measurements[0].kind}
        groups = {
            "posterior": Dataset(posterior, attrs=kind),
            "observed_data": _dataset(self.measurements),
            "fitted_data": _dataset(self.models),
        }
        labels = {name: np.arange(size) for name, size in groups["posterior"].sizes.items()}
        groups["posterior"] = groups["posterior"].assign_coords(labels)
        return DataTree.from_dict(groups)

    @property
    def values(self) -> dict[str, float]:
        """The estimates in SI units by path."""
        return {estimate.path: estimate.value for estimate in self.estimates}


def _dataset(recordings: "tuple[Recording, ...]") -> "Dataset":
    """Return all channels of recordings, each over the time of its own."""
    from xarray import Dataset

    channels = {
        f"{recording.label.removeprefix('model of ')}.{name}": (
            f"time of {recording.label.removeprefix('model of ')}",
            recording[name],
            {"unit": recording.unit(name)},
        )
        for recording in recordings
        for name in recording.names
    }
    times = {f"time of {one.label.removeprefix('model of ')}": one.time for one in recordings}
    return Dataset(channels, coords=times)
