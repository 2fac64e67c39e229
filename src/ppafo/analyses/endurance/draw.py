"""How much gas a device takes in a stride: from numbers, from a recording, from a walk; when it walks and rests."""

import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.errors import DataError, ParameterError, PpafoError, ScenarioError, nearest_name, refused_as
from ppafo.parameters.overrides import read_overrides
from ppafo.signals import Recording
from ppafo.signals.recording import Floats
from ppafo.simulation.loading import ScenarioRequest, scenario_of
from ppafo.simulation.scenario import Scenario
from ppafo.storage.result_folder import read_json, read_recording
from ppafo.walking import WalkResult
from ppafo.walking.loading import WALKING
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WALK_FORMAT

PEAK_WINDOW = 0.1
"""Seconds over which the largest flow of a recording is averaged; lines and regulator even out what is shorter."""
_MAXIMUM_FALLEN = 0.1
"""Fraction of the gas used that may flow back: it waits in the line before the valve, and the next stride takes it."""
WALK_FILE = "walk.json"
_LEAST = 1.0e-12
"""Gas [kg] by which a walk that takes none may come out below 0: rounding of its totals."""


@dataclass(frozen=True, slots=True)
class Draw:
    """Gas use: mass per stride [kg], time of a stride [s], largest flow [kg/s], and where the numbers come from.

    A stride is one cycle of the device's leg, heel strike to heel strike of the same foot.
    """

    mass_per_stride: float
    stride_time: float
    peak_flow: float
    origin: str

    @property
    def mean_flow(self) -> float:
        """Mass flow [kg/s] while walking, averaged over a stride."""
        return self.mass_per_stride / self.stride_time


def draw_of_numbers(mass_per_stride: float, stride_time: float, peak_flow: float | None) -> Draw:
    """Return the draw of given numbers [kg, s, kg/s]; without a largest flow the mean one is taken for it."""
    for name, value, unit in (("gas per stride", mass_per_stride, "kg"), ("stride time", stride_time, "s")):
        if not (math.isfinite(value) and value > 0.0):
            raise ParameterError(f"{name} must be above 0, it is {value:g} {unit}")
    mean = mass_per_stride / stride_time
    if peak_flow is not None and not (math.isfinite(peak_flow) and peak_flow >= mean):
        raise ParameterError(
            f"the largest flow, {peak_flow * GRAMS_PER_KILOGRAM:.4g} g/s, must be at least the mean flow, "
            f"{mean * GRAMS_PER_KILOGRAM:.4g} g/s"
        )
    return Draw(mass_per_stride, stride_time, mean if peak_flow is None else peak_flow, "numbers given")


def draw_of_recording(recording: Recording, stride_time: float | None) -> Draw:
    """Return the draw of a recording with ``supplied_mass``, repeated for ever; all of it is one stride by default."""
    if "supplied_mass" not in recording:
        raise DataError(f"{recording.label}: has no channel 'supplied_mass'; available: {', '.join(recording.names)}")
    supplied = _gas_use(recording)
    # Not the last value alone: a recording may begin in the middle of a walk.
    gain = float(supplied[-1] - supplied[0])
    if recording.duration <= 0.0 or gain <= 0.0:
        raise DataError(f"{recording.label}: no gas was taken from the supply, so a bottle would never be empty")
    fallen = -float(np.minimum(np.diff(supplied), 0.0).sum())
    if fallen > _MAXIMUM_FALLEN * gain:
        raise DataError(
            f"{recording.label}: supplied_mass falls by {fallen * GRAMS_PER_KILOGRAM:.3g} g in total while it "
            f"gains {gain * GRAMS_PER_KILOGRAM:.3g} g; it must be cumulative from the start of the recording to "
            "its end"
        )
    stride = recording.duration if stride_time is None else stride_time
    if not 0.0 < stride <= recording.duration:
        raise DataError(
            f"{recording.label}: a stride of {stride:g} s does not fit into a recording of {recording.duration:g} s"
        )
    mean = gain / recording.duration
    peak = max(mean, largest_flow(recording))
    return Draw(mean * stride, stride, peak, f"recording '{recording.label}', {recording.kind}, repeated")


def _gas_use(recording: Recording) -> Floats:
    """Return the gas [kg] that left the bottle: through its regulator, where there is a line between that and valve."""
    return recording["regulated_mass" if "regulated_mass" in recording else "supplied_mass"]


def largest_flow(recording: Recording) -> float:
    """Return the largest flow [kg/s], averaged over the window or over a recording that is shorter."""
    window = min(PEAK_WINDOW, recording.duration)
    starts = recording.time[recording.time <= recording.time[-1] - window]
    # The last window need not begin at a sample.
    starts = np.append(starts, recording.time[-1] - window)
    begins, ends = (np.interp(times, recording.time, _gas_use(recording)) for times in (starts, starts + window))
    return float(np.max(ends - begins) / window)


@dataclass(frozen=True, slots=True)
class WalkGas:
    """A walk as far as its gas goes: name, recording, gas [kg] and time [s] of a stride.

    ``gas_per_stride`` is the mean of the strides with help at the set pressure, 0 where the walk took none. A walk on a
    ``task_sequence``, "" without one, is repeated as a whole: gas and time are then the whole's. ``scenario`` is what
    was walked.
    """

    name: str
    recording: Recording
    gas_per_stride: float
    stride_time: float
    task_sequence: str = ""
    scenario: Scenario | None = None


def walk_gas(result: WalkResult) -> WalkGas:
    """Return the gas of a walk."""
    configuration, sequence = result.scenario, walk_of(result.scenario).task_sequence
    gas = result.metrics.get("gas" if sequence is None else "task_sequence_gas")
    time = None if sequence is None else result.metrics.get("task_sequence_time")
    return WalkGas(
        configuration.name,
        result.recording,
        0.0 if gas is None else gas.value,
        walk_of(configuration).gait.stride_time if time is None else time.value,
        task_sequence="" if sequence is None else sequence.name,
        scenario=configuration,
    )


def read_walk_gas(folder: Path) -> WalkGas:
    """Return the gas of a walk from the folder that ``ppafo walk`` wrote; DataError where it says too little."""
    path = folder / WALK_FILE
    document = read_json(path)
    if not isinstance(document, dict) or document.get("format") != WALK_FORMAT:
        raise DataError(f"{path}: is not the result of a ppafo walk (its 'format' is not '{WALK_FORMAT}')")
    status = _table(document, "status", path).get("kind", "completed")
    if status != "completed":
        raise DataError(f"{path}: the walk {status}, so it cannot be repeated")
    configuration = _table(document, "configuration", path)
    if configuration.get("course") is not None:
        raise DataError(f"{path}: 'course'{nearest_name('course', ('task_sequence',))}; write the walk again")
    sequence = None if configuration.get("task_sequence") is None else _table(configuration, "task_sequence", path)
    key = "gas" if sequence is None else "task_sequence_gas"
    has_gas = key in _table(document, "metrics", path)
    gas = _number(document, f"metrics.{key}.value", path, -_LEAST) if has_gas else 0.0
    time = "configuration.gait.stride_time" if sequence is None else "metrics.task_sequence_time.value"
    stride_time = _number(document, time, path, 0.0)
    recording = read_recording(folder)
    if "supplied_mass" not in recording:
        raise DataError(f"{recording.label}: has no channel 'supplied_mass'; write the walk again")
    return WalkGas(
        str(configuration.get("name", folder.name)),
        recording,
        gas,
        stride_time,
        "" if sequence is None else str(sequence.get("name", "task sequence")),
        _walked(configuration, path),
    )


def _walked(configuration: Mapping[str, Any], file: Path) -> Scenario | None:
    """Return the walk that a folder is of, by what its file said; None for a folder of an earlier version."""
    content, overrides = configuration.get("content"), configuration.get("overrides", [])
    if content is None:
        return None
    given, name = configuration.get("file"), str(configuration.get("name", "walk"))
    with refused_as(DataError, f"{file}: its walk cannot be repeated", PpafoError):
        if not (isinstance(content, dict) and isinstance(overrides, list) and isinstance(given, str | None)):
            raise DataError("'configuration' says no walk")
        folder = Path() if given is None else Path(given).parent
        changes = read_overrides(map(str, overrides), ScenarioError)
        return scenario_of(ScenarioRequest(name, given, folder, content, changes), WALKING)


def _table(document: Mapping[str, Any], name: str, file: Path) -> Mapping[str, Any]:
    node = document.get(name, {})
    if not isinstance(node, Mapping):
        raise DataError(f"{file}: '{name}' is not a table of names and values; write the walk again")
    return node


def _number(document: Mapping[str, Any], path: str, file: Path, above: float = -math.inf) -> float:
    node: Any = document
    for part in path.split("."):
        node = node.get(part) if isinstance(node, Mapping) else None
    if isinstance(node, bool) or not isinstance(node, int | float) or not abs(node) <= sys.float_info.max:
        raise DataError(f"{file}: has no number at '{path}'; write the walk again")
    if node <= above:
        raise DataError(f"{file}: '{path}' is {node:g}, which is impossible for a walk; write the walk again")
    return float(node)


def draw_of_walk(walk: WalkGas) -> Draw:
    """Return the gas use of a walk that continues: a stride is one of the leg with the device."""
    if walk.gas_per_stride <= 0.0:
        raise DataError(f"walk '{walk.name}': no gas was taken from the supply, so a bottle would never be empty")
    # An open valve may let gas back into the supply for moments, so the largest flow is a mean over 0.1 s.
    peak = max(largest_flow(walk.recording), walk.gas_per_stride / walk.stride_time)
    draw = draw_of_numbers(walk.gas_per_stride, walk.stride_time, peak)
    along = f" in task sequence '{walk.task_sequence}'" if walk.task_sequence else ""
    return replace(draw, origin=f"walk '{walk.name}'{along}, {walk.recording.kind}, repeated")
