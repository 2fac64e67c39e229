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

    ``gas_per_stride`` is the mean of the assisted strides at the set pressure, 0 if the walk took no gas. ``scenario``
    is the scenario of the walk.
    """

    name: str
    recording: Recording
    gas_per_stride: float
    stride_time: float
    scenario: Scenario | None = None


def walk_gas(result: WalkResult) -> WalkGas:
    """Return the gas demand of a walk per stride, with the recording."""
    configuration, gas = result.scenario, result.metrics.get("gas")
    return WalkGas(
        configuration.name,
        result.recording,
        0.0 if gas is None else gas.value,
        walk_of(configuration).gait.stride_time,
        scenario=configuration,
    )


def demand_of_walk(walk: WalkGas) -> GasDemand:
    """Return the gas demand of a walk that continues, per stride of the leg with the device."""
    if walk.gas_per_stride <= 0.0:
        raise DataError(
            f"walk '{walk.name}': takes no gas from the supply, so no bottle would become empty; give "
            "a walk with assistance"
        )
    # An open valve may let gas back into the supply for moments, so the largest flow is a mean over 0.1 s.
    peak = max(largest_flow(walk.recording), walk.gas_per_stride / walk.stride_time)
    draw = demand_of_numbers(walk.gas_per_stride, walk.stride_time, peak)
    return replace(draw, origin=f"walk '{walk.name}', {walk.recording.kind}")


def read_walk_gas(folder: Path) -> WalkGas:
    """Return the gas demand of a walk from its result folder; raises DataError if the data are incomplete."""
    path = folder / WALK_FILE
    document = read_json(path)
    if not isinstance(document, dict) or document.get("format") != WALK_FORMAT:
        raise DataError(f"{path}: is not a result of 'ppafo walk' (its 'format' is not '{WALK_FORMAT}')")
    status = _table(path, document, "status").get("kind", "completed")
    if status == "diverged":
        raise DataError(
            f"{path}: the walk {status}, so its gas demand cannot be repeated; give a walk that ran to its end"
        )
    configuration = _table(path, document, "configuration")
    # A walk without help has no gas among its metrics.
    has_gas = "gas" in _table(path, document, "metrics")
    gas = _number(path, document, "metrics.gas.value", above=_LEAST_GAS) if has_gas else 0.0
    stride_time = _number(path, document, "configuration.gait.stride_time", above=0.0)
    recording = read_recording(folder)
    if "supplied_mass" not in recording:
        raise DataError(f"{recording.label}: there is no channel 'supplied_mass'; repeat the walk with 'ppafo walk'")
    return WalkGas(
        str(configuration.get("name", folder.name)),
        recording,
        gas,
        stride_time,
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
