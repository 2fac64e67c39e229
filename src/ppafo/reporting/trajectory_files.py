"""What a trajectory fit adds to the folder of an identification: its part of estimates.json, and its figures."""

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from ppafo.identification.identify import Identification
from ppafo.identification.trajectory.outcome import TrajectoryOutcome
from ppafo.identification.trajectory.profiles import Profile
from ppafo.identification.trajectory.result import TrajectoryFit
from ppafo.reporting.profile_figure import profile_figure
from ppafo.reporting.trajectory_fit_figure import correlation_figure, trajectory_fit_figure
from ppafo.signals import RecordingKind
from ppafo.simulation.document import plain

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POSTERIOR = "posterior.nc"

_KINDS: tuple[RecordingKind, ...] = ("synthetic", "simulated", "measured")


def kind_of_fit(fit: TrajectoryFit) -> RecordingKind:
    """Return the kind of all recordings together: one synthetic recording makes the fit synthetic."""
    kinds = {recording.kind for recording in fit.measurements}
    return next(kind for kind in _KINDS if kind in kinds)


def trajectory_document(outcome: TrajectoryOutcome | None) -> dict[str, Any]:
    """Return the part ``trajectory`` of estimates.json, empty without a fit; matrices are in the order of estimates."""
    if outcome is None:
        return {}
    fit = outcome.fit
    return {
        "trajectory": {
            "recordings_are": kind_of_fit(fit),
            "recordings": [_recording(fit, index) for index in range(len(fit.measurements))],
            "parameters": [plain(item) for item in fit.optimum.residuals.ranges],
            "search": plain(fit.problem.search),
            "evaluations": fit.evaluations,
            "cost": fit.cost,
            "variance_inflation": fit.uncertainty.inflation,
            "estimates": [plain(item) for item in fit.estimates],
            "covariance": fit.covariance.tolist(),
            "correlation": fit.correlation.tolist(),
            "channels": [plain(item) for item in fit.channels],
            "noise": [{"channel": one.channel, "is_like": one.in_words} for one in fit.uncertainty.sensors],
            "misfit": {
                "reason": fit.misfit,
                "comparisons": [plain(item) for item in fit.uncertainty.misfit.comparisons],
            },
            "beforehand": [plain(item) for item in outcome.beforehand],
            "remarks": list(outcome.remarks),
            "checks": [plain(item) for item in outcome.checks],
            "profiles": [_profile(item) for item in outcome.profiles],
            "next_experiments": [plain(item) for item in outcome.expected],
        }
    }


def trajectory_figures(identification: Identification) -> "Iterator[tuple[str, Figure]]":
    """Yield name and figure: one for each recording, the correlations, and the profiles that were asked for."""
    outcome = identification.trajectory
    if outcome is None:
        return
    fit = outcome.fit
    for measurement, model, scenario in zip(fit.measurements, fit.models, fit.scenarios, strict=True):
        atmosphere = scenario.device.supply.atmospheric_pressure
        yield f"trajectory-fit-{measurement.label}", trajectory_fit_figure(measurement, model, atmosphere)
    kind = kind_of_fit(fit)
    if len(fit.estimates) > 1:
        paths = [item.path for item in fit.estimates]
        yield "trajectory-correlation", correlation_figure(paths, fit.correlation, kind)
    if outcome.profiles:
        yield "trajectory-profiles", profile_figure(outcome, identification.before, kind)


def posterior_file(identification: Identification) -> dict[str, bytes]:
    """Return the draws of a trajectory fit as a NetCDF file that ArviZ and xarray read; nothing without a fit."""
    if identification.trajectory is None:
        return {}
    with TemporaryDirectory() as folder:
        path = Path(folder) / POSTERIOR
        identification.trajectory.fit.posterior().to_netcdf(path, engine="h5netcdf")
        return {POSTERIOR: path.read_bytes()}


def _recording(fit: TrajectoryFit, index: int) -> dict[str, Any]:
    experiment = fit.problem.experiments[index]
    return {
        "label": experiment.label,
        "source": experiment.source,
        "kind": experiment.recording.kind,
        "scenario": experiment.scenario.name,
        "inputs": list(experiment.inputs),
        "samples": len(fit.measurements[index]),
    }


def _profile(one: Profile) -> dict[str, Any]:
    return {**plain(one), "numbers": one.numbers.tolist(), "rises": one.rises.tolist()}
