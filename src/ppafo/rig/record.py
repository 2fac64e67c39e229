"""Does an experiment on the rig: a synthetic recording, and the truth behind it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ppafo.errors import ParameterError, nearest_name, one_line
from ppafo.parameters.device import VANE, Device
from ppafo.parameters.loading import load_parameter_set
from ppafo.rig.catalog import EXPERIMENTS, Experiment
from ppafo.rig.preset import PREFIX, Preset, load_preset
from ppafo.rig.request import Outcome, Request
from ppafo.signals.recording import Recording
from ppafo.simulation.document import UNITS, plain
from ppafo.version import __version__

LARGEST_SEED = 2**32 - 1
DEFAULT_DEVICE = "ppafo2011"
DEFAULT_PRESET = "paper-bench"

NOTICE = "synthetic: made by the virtual test rig of ppafo in place of a measurement"


@dataclass(frozen=True, slots=True)
class RigRecording:
    """A synthetic recording; the device as it truly was; everything behind it as plain data, for ``rig.json``."""

    recording: Recording
    device: Device
    truth: Mapping[str, Any]


def record(
    experiment: str,
    preset: str | Path | Preset = DEFAULT_PRESET,
    seed: int = 1,
    device: str = DEFAULT_DEVICE,
    overrides: Iterable[str] = (),
    valve: str | None = None,
) -> RigRecording:
    """Return what an experiment records on the rig; the same arguments give the same bytes.

    ``overrides`` are texts such as ``friction.static_torque=0.5 N m`` (device), ``run.duration=1 s`` (experiments in
    time) or ``rig.pressure_sensor.noise=0 Pa_d`` (preset). SimulationError where the extra ``reference`` is missing.
    """
    chosen = find_experiment(experiment)
    check_seed(seed)
    words = tuple(overrides)
    of_preset = tuple(item for item in words if item.strip().startswith(PREFIX))
    others = tuple(item for item in words if item not in of_preset)
    used = _refuse_overrides(preset, of_preset) if isinstance(preset, Preset) else load_preset(preset, of_preset)
    kind = load_parameter_set(device).actuator_kind
    if kind != VANE:
        raise ParameterError(f"the virtual rig is made for a vane, and '{one_line(device)}' has an actuator '{kind}'")
    outcome = chosen.record(Request(used, seed, device, valve, others))
    return RigRecording(outcome.recording, outcome.device, _truth(chosen, used, seed, device, words, outcome))


def find_experiment(name: str) -> Experiment:
    """Return the experiment of this name. ParameterError where there is none."""
    if name not in EXPERIMENTS:
        hint = nearest_name(name, EXPERIMENTS)
        raise ParameterError(f"there is no experiment '{one_line(name)}'{hint}; available: {', '.join(EXPERIMENTS)}")
    return EXPERIMENTS[name]


def check_seed(seed: int) -> None:
    """Raise ParameterError for a seed that is not a whole number from 0 to 4294967295."""
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed <= LARGEST_SEED:
        raise ParameterError(f"seed = {seed} must be a whole number from 0 to {LARGEST_SEED}")


def _refuse_overrides(preset: Preset, overrides: tuple[str, ...]) -> Preset:
    if overrides:
        raise ParameterError(f"override '{overrides[0]}': change a preset object itself, with Preset.with_value")
    return preset


def _truth(
    experiment: Experiment, preset: Preset, seed: int, parameter_set: str, overrides: tuple[str, ...], outcome: Outcome
) -> dict[str, Any]:
    return {
        "notice": NOTICE,
        "units": UNITS,
        "version": __version__,
        "experiment": experiment.name,
        "summary": experiment.summary,
        "seed": seed,
        "parameter_set": parameter_set,
        "overrides": list(overrides),
        "device": plain(outcome.device),
        "preset": {
            "name": preset.name,
            "title": preset.title,
            "values": plain(preset.values),
            "reasons": dict(preset.reasons),
        },
        "sensor_offsets": plain(outcome.offsets),
        "settings": plain(outcome.settings),
        "channels": {name: outcome.recording.unit(name) for name in outcome.recording.names},
        "samples": len(outcome.recording),
    }
