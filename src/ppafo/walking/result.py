"""Result of a walk: recording, strides, averages, metrics, and verdict."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ppafo.control.walking.assistance import PEAKS
from ppafo.engine.lanes import Floats
from ppafo.metrics import Metric
from ppafo.signals import Recording
from ppafo.simulation.at_hand import RecordedResult, in_own_units
from ppafo.simulation.numbers import changes_in
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Status
from ppafo.simulation.tracking import Tracking, tracking_in
from ppafo.simulation.tracking.case import level_text
from ppafo.simulation.tracking.verdict import TOO_SHORT
from ppafo.storage.opensim import opensim_recording, write_opensim
from ppafo.walking.bottle.coupling import SupplyCourse
from ppafo.walking.motion import walk_of
from ppafo.walking.strides import Curves
from ppafo.wording import changed_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WALK_FORMAT = "ppafo walk"
"""Format name in saved walk results, by which analyses recognise them."""


@dataclass(frozen=True, slots=True, repr=False, eq=False)
class WalkResult(RecordedResult):
    """Result of a walk. Averages and metrics use strides after the first ones, in which the controller adapts.

    - ``scenario``: scenario of the walk
    - ``recording``: channels over time [SI]
    - ``strides``: numbers of each whole stride [SI], each (strides,), by name
    - ``averages``: mean curves over the stride, by channel
    - ``metrics``: numbers of the whole walk, by name
    - ``status``: completed, or diverged or ended early by its bottle, with the time [s]
    - ``starts``: samples directly after each heel strike
    - ``supply``: gas bottle over the walk, None without a bottle
    """

    scenario: Scenario
    recording: Recording
    strides: Mapping[str, Floats]
    averages: Mapping[str, Curves]
    metrics: Mapping[str, Metric]
    status: Status
    starts: NDArray[np.intp]
    supply: SupplyCourse | None = None

    @property
    def peak_torques(self) -> Floats:
        """Peak torque [N m] of each whole stride (strides,)."""
        if self.starts.size < 2:
            return np.zeros(0)
        return np.maximum.reduceat(self.recording["torque"], self.starts)[:-1]

    @property
    def tracking(self) -> Tracking:
        """Verdict on the torque: it follows the controller's request, does not, or is not judged, for a reason."""
        strides = self.metrics.get("strides")
        if strides is None or strides.value == 0.0:
            return Tracking(None, self.scenario.controlled, TOO_SHORT)
        return tracking_in(self)

    @in_own_units
    def __repr__(self) -> str:
        """Return name, status, duration and a line for each metric, in display units."""
        from ppafo.report.kind import name_lines

        head = f"Walk '{self.scenario.name}', {self.recording.time[-1] / 60.0:.3g} min: {self.status.message}"
        return "\n".join([head, *name_lines(self.metrics)])

    @in_own_units
    def __str__(self) -> str:
        """Return status, verdict and metrics in display units, as printed by ``ppafo simulate``."""
        from ppafo.report.kind import metrics_lines

        head = [f"{self.scenario.name}: {self.status.message}", self.scenario.origin.replaced]
        head.append(changed_text(changes_in(self.scenario)))
        if self.status.kind != "diverged":
            head += [self.tracking.sentence, limited_request(self.scenario)]
            toes = self.metrics.get("lowest_toes")
            if toes is not None and toes.value < 0.0:
                head.append("the toes would drag in mid-swing: the ankle is not lifted enough")
        return "\n".join([*filter(None, head), "", *metrics_lines(self.metrics)])

    def _figure(self) -> "Figure":
        from ppafo.walking.figures.mean_stride import walk_figure

        return walk_figure({self.scenario.name: self})

    def save_opensim(self, path: str | Path) -> Path:
        """Write the recording as a ``.sto`` file with OpenSim's names, zeros and signs (right leg); return the path."""
        named, _ = opensim_recording(self.recording, body_mass=walk_of(self.scenario).wearer.body_mass)
        return write_opensim(path, named)


def limited_request(scenario: Scenario) -> str:
    """Remark on peaks of the desired torque that ``largest_torque`` of the controller cuts; "" without any."""
    settings = scenario.controller.settings
    limit = settings.get("largest_torque", math.inf)
    peaks = [(f"controller.{name}", settings[name]) for name in PEAKS if settings.get(name, 0.0) > limit]
    cut = ", ".join(f"{path} = {level_text('N m', peak)}" for path, peak in peaks)
    return f"{cut}: the request is limited by controller.largest_torque = {level_text('N m', limit)}" if cut else ""
