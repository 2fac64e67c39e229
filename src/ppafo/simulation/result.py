"""The result of a run: the recording, its metrics, and how the run ended."""

import importlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from ppafo.metrics import Metric
from ppafo.signals import Recording
from ppafo.simulation.check import Check
from ppafo.simulation.document import plain, scenario_document
from ppafo.simulation.scenario import Scenario
from ppafo.storage import dataset_of, write_result

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


@dataclass(frozen=True, slots=True)
class Status:
    """How a run ended: ``time`` [s] is where a diverged run stopped; ``message`` says its state and the remedy."""

    kind: Literal["completed", "diverged"]
    time: float | None = None
    message: str = ""

    @property
    def is_completed(self) -> bool:
        """True where the run reached the end of the scenario."""
        return self.kind == "completed"


@dataclass(frozen=True, slots=True, repr=False)
class Result:
    """A finished run. ``versions`` are those of the packages, ``engine`` the figures of the time stepping."""

    scenario: Scenario
    recording: Recording
    metrics: Mapping[str, Metric]
    status: Status
    versions: Mapping[str, str]
    engine: Mapping[str, float | int | str]

    def __repr__(self) -> str:
        """Return name, status, duration and one line a metric, in SI units."""
        scenario, status = self.scenario, self.status
        width = max((len(name) for name in self.metrics), default=0)
        lines = [f"  {name:<{width}}  {item.value:.4g} {item.unit}" for name, item in self.metrics.items()]
        return "\n".join(
            [f"Result of '{scenario.name}', {scenario.duration:g} s: {status.message or status.kind}", *lines]
        )

    def plot(self) -> "Figure":
        """Return a figure of angle, pressures, torque, command and gas; ``.savefig(...)`` writes it."""
        from ppafo.answers.recording_figure import recording_figure

        remark = "" if self.status.is_completed else self.status.message
        atmosphere = self.scenario.device.supply.atmospheric_pressure
        return recording_figure(self.recording, self.scenario.name, remark, atmosphere)

    def check(self) -> Check:
        """Return what this run determines: it runs again with half the error, and with start and measurements moved.

        SimulationError for a run that diverged, and for a Python controller that gives a different run each time.
        """
        # A check runs the scenario again, which makes results: a name here, an import there.
        checking = importlib.import_module("ppafo.simulation.checking")
        check: Check = checking.check_result(self)
        return check

    def to_dict(self) -> dict[str, Any]:
        """Return what ``run.json`` says of a result, beside what storage adds to it, as plain data in SI units."""
        return {
            "status": plain(self.status),
            "metrics": {name: plain(metric) for name, metric in self.metrics.items()},
            "versions": dict(self.versions),
            "seed": self.scenario.sensors.seed,
            "engine": plain(self.engine),
            "scenario": scenario_document(self.scenario),
        }

    def dataset(self) -> "xarray.Dataset":
        """Return the recording as an xarray Dataset; attributes hold units, long names and the scenario as JSON."""
        return dataset_of(self.recording, scenario_document(self.scenario))

    def save(self, folder: str | Path, attachments: Mapping[str, bytes] | None = None) -> Path:
        """Write ``recording.nc``, ``recording.csv``, ``run.json`` and any attachments (contents by file name).

        The folder is complete or not there; an earlier result in it is replaced. Returns the folder.
        """
        return write_result(folder, self.recording, self.to_dict(), attachments or {})
