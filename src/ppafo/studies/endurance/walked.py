"""What a walk says of its gas: how much a stride takes, and how full each chamber gets in it."""

import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import DataError
from ppafo.model.chambers import chamber_1_volume, chamber_2_volume
from ppafo.signals import Recording
from ppafo.signals.recording import Floats
from ppafo.storage.owned_folder import read_json
from ppafo.storage.recordings import read_recording
from ppafo.studies.endurance.draw import Draw, draw_of_numbers, largest_flow
from ppafo.walking import WalkResult
from ppafo.walking.strides import SETTLING

WALK_FILE = "walk.json"
FORMAT = "ppafo walk"
_VOLUMES = ("volume_per_angle", "dead_volume_1", "dead_volume_2")
_CHANNELS = ("angle", "pressure_1", "pressure_2", "supplied_mass")
_LEAST = 1.0e-12
"""Gas [kg] by which a walk that takes none may come out below 0: rounding of its totals."""


@dataclass(frozen=True, slots=True)
class Actuator:
    """What the volumes of the chambers follow from: stops [rad], volume per angle [m^3/rad], dead volumes [m^3]."""

    angle_min: float
    angle_max: float
    volume_per_angle: float
    dead_volume_1: float
    dead_volume_2: float


@dataclass(frozen=True, slots=True)
class Walked:
    """A walk as far as its gas goes: name, recording, gas [kg] and time [s] of a stride, and the actuator.

    ``gas_per_stride`` is 0 where the walk took none.
    """

    name: str
    recording: Recording
    gas_per_stride: float
    stride_time: float
    actuator: Actuator


@dataclass(frozen=True, slots=True)
class FullChambers:
    """Absolute pressure [Pa] and volume [m^3] of each chamber when it is fullest, mean over so many strides."""

    exhaust_pressure: float
    exhaust_volume: float
    fill_pressure: float
    fill_volume: float
    strides: int


def walked(result: WalkResult) -> Walked:
    """Return the gas of a walk."""
    configuration, gas = result.configuration, result.metrics.get("gas")
    actuator = configuration.device.actuator
    return Walked(
        configuration.name,
        result.recording,
        0.0 if gas is None else gas.value,
        configuration.gait.stride_time,
        Actuator(**{name: getattr(actuator, name) for name in Actuator.__slots__}),
    )


def is_walk_folder(path: Path) -> bool:
    """Return True for a folder that ``ppafo walk`` wrote for one wearer."""
    return path.is_dir() and (path / WALK_FILE).is_file()


def read_walked(folder: Path) -> Walked:
    """Return the gas of a walk from the folder that ``ppafo walk`` wrote; DataError where it says too little."""
    path = folder / WALK_FILE
    document = read_json(path)
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise DataError(f"{path}: is not of a ppafo walk (its 'format' is not '{FORMAT}')")
    status = _table(document, "status", path).get("kind", "completed")
    if status != "completed":
        raise DataError(f"{path}: the walk {status}, so it cannot be repeated")
    actuator = Actuator(
        *(_number(document, f"configuration.device.actuator.{name}", path) for name in ("angle_min", "angle_max")),
        *(_number(document, f"configuration.device.actuator.{name}", path, 0.0) for name in _VOLUMES),
    )
    has_gas = "gas" in _table(document, "metrics", path)
    gas = _number(document, "metrics.gas.value", path, -_LEAST) if has_gas else 0.0
    stride_time = _number(document, "configuration.gait.stride_time", path, 0.0)
    name = document["configuration"].get("name", folder.name)
    return Walked(str(name), _recording(folder), gas, stride_time, actuator)


def _recording(folder: Path) -> Recording:
    recording = read_recording(folder)
    for name in _CHANNELS:
        if name not in recording:
            raise DataError(f"{recording.label}: has no channel '{name}'; let the walk be written again")
    return recording


def _table(document: Mapping[str, Any], name: str, file: Path) -> Mapping[str, Any]:
    node = document.get(name, {})
    if not isinstance(node, Mapping):
        raise DataError(f"{file}: '{name}' is not a table of names and values; let the walk be written again")
    return node


def _number(document: Mapping[str, Any], path: str, file: Path, above: float = -math.inf) -> float:
    node: Any = document
    for part in path.split("."):
        node = node.get(part) if isinstance(node, Mapping) else None
    if isinstance(node, bool) or not isinstance(node, int | float) or not abs(node) <= sys.float_info.max:
        raise DataError(f"{file}: has no number at '{path}'; let the walk be written again")
    if node <= above:
        raise DataError(f"{file}: '{path}' is {node:g}, which no walk has; let the walk be written again")
    return float(node)


def draw_of_walk(walk: Walked) -> Draw:
    """Return the gas use of a walk that goes on: a step is a stride of the leg with the device."""
    if walk.gas_per_stride <= 0.0:
        raise DataError(f"walk '{walk.name}': no gas was taken from the supply, so a bottle would last for ever")
    # An open valve may let gas back into the supply for moments, so the largest flow is that of a tenth of a second.
    peak = max(largest_flow(walk.recording), walk.gas_per_stride / walk.stride_time)
    draw = draw_of_numbers(walk.gas_per_stride, walk.stride_time, peak)
    return Draw(
        draw.mass_per_step, draw.step_time, draw.peak_flow, f"walk '{walk.name}', {walk.recording.kind}, repeated"
    )


def full_chambers(walk: Walked) -> FullChambers:
    """Return how full the chambers get, mean over strides: what can be reused, and what for.

    The plantarflexion chamber is fullest when it begins to vent, at the end of push-off; the other one when it has been
    filled. The first strides, in which the controller learns, are left out. DataError where no whole stride is left.
    """
    recording, actuator = walk.recording, walk.actuator
    angle = recording["angle"]
    volume_1 = chamber_1_volume(angle, actuator.angle_min, actuator.volume_per_angle, actuator.dead_volume_1)  # type: ignore[arg-type]
    volume_2 = chamber_2_volume(angle, actuator.angle_max, actuator.volume_per_angle, actuator.dead_volume_2)  # type: ignore[arg-type]
    edges = np.arange(SETTLING, recording.time[-1] / walk.stride_time + 1.0e-9) * walk.stride_time
    if edges.size < 2:
        raise DataError(
            f"walk '{walk.name}': {recording.duration:.3g} s hold no whole stride after the first {SETTLING}"
        )
    bounds = np.searchsorted(recording.time, edges)
    exhaust = _fullest(recording["pressure_1"], np.asarray(volume_1), bounds)
    fill = _fullest(recording["pressure_2"], np.asarray(volume_2), bounds)
    return FullChambers(*exhaust, *fill, strides=edges.size - 1)


def _fullest(pressure: Floats, volume: Floats, bounds: NDArray[np.intp]) -> tuple[float, float]:
    """Return pressure and volume where a chamber holds the most gas, mean over the strides between some samples."""
    places = [
        first + int(np.argmax(pressure[first:last] * volume[first:last])) for first, last in pairwise(bounds.tolist())
    ]
    return float(pressure[places].mean()), float(volume[places].mean())
