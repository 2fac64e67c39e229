"""What the rig is to do, and what it gives back."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ppafo.parameters.device import Device
from ppafo.rig.preset import Preset
from ppafo.signals.recording import Recording


@dataclass(frozen=True, slots=True)
class Request:
    """One experiment to be done: preset, seed, parameter set, its valve (None: the set's own), overrides of both."""

    preset: Preset
    seed: int
    parameter_set: str
    valve: str | None
    overrides: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Outcome:
    """The result of an experiment: recording, true device, offsets that the sensors had, and further true values."""

    recording: Recording
    device: Device
    offsets: Mapping[str, float]
    settings: Mapping[str, Any]
