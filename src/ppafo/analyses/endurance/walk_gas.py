"""Gas demand of a walk, from its result or from the folder in which the result was saved."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ppafo.analyses.endurance.gas_demand import GasDemand, demand_of_numbers, largest_flow
from ppafo.errors import DataError, PpafoError, ScenarioError, refused_as
from ppafo.parameters.overrides import read_overrides
from ppafo.signals import Recording
from ppafo.simulation.document import ScenarioRequest
from ppafo.simulation.loading import scenario_of
from ppafo.simulation.scenario import Scenario
from ppafo.storage.owned_folder import read_json
from ppafo.storage.reading import read_recording
from ppafo.walking import WalkResult
from ppafo.walking.loading import WALKING
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WALK_FORMAT

WALK_FILE = "walk.json"
"""Name of the file in a result folder that describes a walk."""
_LEAST_GAS = -1.0e-12
"""Lower limit of the gas use of a walk [kg], slightly negative because of rounding."""


@dataclass(frozen=True, slots=True)
class WalkGas:
    """Gas demand of a walk: name, recording, gas per stride [kg] and stride time [s].

    ``gas_per_stride`` is the mean of the assisted strides at the set pressure, 0 if the walk took no gas. For a walk on
    a ``task_sequence`` ("" without one), a repetition is the whole sequence, and gas and time are its totals.
    ``scenario`` is the scenario of the walk.
    """

    name: str
    recording: Recording
    gas_per_stride: float
    stride_time: float
    task_sequence: str = ""
    scenario: Scenario | None = None


def walk_gas(result: WalkResult) -> WalkGas:
    """Return the gas demand of a walk per stride, or per task sequence, with the recording."""
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


def demand_of_walk(walk: WalkGas) -> GasDemand:
    """Return the gas demand of a walk that continues, per stride of the leg with the device or per task sequence."""
    if walk.gas_per_stride <= 0.0:
        raise DataError(
            f"walk '{walk.name}': takes no gas from the supply, so no bottle would become empty; give "
            "a walk with assistance"
        )
    # An open valve may let gas back into the supply for moments, so the largest flow is a mean over 0.1 s.
    peak = max(largest_flow(walk.recording), walk.gas_per_stride / walk.stride_time)
    draw = demand_of_numbers(walk.gas_per_stride, walk.stride_time, peak)
    along = f" in task sequence '{walk.task_sequence}'" if walk.task_sequence else ""
    return replace(draw, origin=f"walk '{walk.name}'{along}, {walk.recording.kind}")


def read_walk_gas(folder: Path) -> WalkGas:
    """Return the gas demand of a walk from its result folder; raises DataError if the data are incomplete."""
    path = folder / WALK_FILE
    document = read_json(path)
    if not isinstance(document, dict) or document.get("format") != WALK_FORMAT:
        raise DataError(f"{path}: is not a result of 'ppafo walk' (its 'format' is not '{WALK_FORMAT}')")
    status = _table(path, document, "status").get("kind", "completed")
    if status != "completed":
        raise DataError(
            f"{path}: the walk {status}, so its gas demand cannot be repeated; give a walk that ran to its end"
        )
    configuration = _table(path, document, "configuration")
    has_sequence = configuration.get("task_sequence") is not None
    sequence = _table(path, document, "configuration.task_sequence") if has_sequence else None
    metric = "gas" if sequence is None else "task_sequence_gas"
    time = "configuration.gait.stride_time" if sequence is None else "metrics.task_sequence_time.value"
    # A walk without help has no gas among its metrics.
    has_gas = metric in _table(path, document, "metrics")
    gas = _number(path, document, f"metrics.{metric}.value", above=_LEAST_GAS) if has_gas else 0.0
    stride_time = _number(path, document, time, above=0.0)
    recording = read_recording(folder)
    if "supplied_mass" not in recording:
        raise DataError(f"{recording.label}: there is no channel 'supplied_mass'; repeat the walk with 'ppafo walk'")
    return WalkGas(
        str(configuration.get("name", folder.name)),
        recording,
        gas,
        stride_time,
        task_sequence="" if sequence is None else str(sequence.get("name", "task sequence")),
        scenario=_walked(configuration, path),
    )


def _table(file: Path, document: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """Return a table of a walk file by dotted path, {} if it is missing; DataError for any other type of value."""
    node = document
    for part in name.split("."):
        node = node.get(part, {})
        if not isinstance(node, Mapping):
            raise DataError(f"{file}: '{part}' must be a JSON object; repeat the walk with 'ppafo walk'")
    return node


def _number(file: Path, document: Mapping[str, Any], name: str, above: float) -> float:
    """Return a number [SI] of a walk file by dotted path; DataError if it is missing or not above ``above``."""
    node: Any = document
    for part in name.split("."):
        node = node.get(part) if isinstance(node, Mapping) else None
    if isinstance(node, bool) or not isinstance(node, int | float) or not abs(node) <= sys.float_info.max:
        raise DataError(f"{file}: '{name}' must be a number; repeat the walk with 'ppafo walk'")
    if node <= above:
        raise DataError(f"{file}: '{name}' = {node:g} is impossible for a walk; repeat the walk with 'ppafo walk'")
    return float(node)


def _walked(configuration: Mapping[str, Any], file: Path) -> Scenario | None:
    """Return the scenario of a saved walk from its file, or None for a folder of an earlier version."""
    content, overrides = configuration.get("content"), configuration.get("overrides", [])
    if content is None:
        return None
    source, name = configuration.get("file"), str(configuration.get("name", "walk"))
    with refused_as(DataError, f"{file}: the walk cannot be repeated", PpafoError):
        if not (isinstance(content, dict) and isinstance(overrides, list) and isinstance(source, str | None)):
            raise DataError("'configuration' does not describe a walk; repeat the walk with 'ppafo walk'")
        folder = Path() if source is None else Path(source).parent
        changes = read_overrides(map(str, overrides), ScenarioError)
        return scenario_of(ScenarioRequest(name, source, folder, content, changes), WALKING)
