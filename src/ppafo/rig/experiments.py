"""Experiments of the simulated bench by name, each a function ``ExperimentRequest -> ExperimentResult``.

``record`` runs one experiment and returns the synthetic recording with the true parameters.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ppafo.documents.json_text import fields_of, plain
from ppafo.errors import ParameterError
from ppafo.parameters.device import VANE, Device
from ppafo.parameters.loading import load_parameter_set
from ppafo.progress import Report, report_nothing
from ppafo.rig.preset import PREFIX, Preset, list_presets, load_preset
from ppafo.rig.setup import ExperimentRequest, ExperimentResult
from ppafo.rig.steady import record_open_valve, record_static_torque, record_steady_leak, record_valve_map
from ppafo.rig.transient import record_free_decay, record_step_response, record_torque_task, record_vane_leak
from ppafo.signals.recording import Recording
from ppafo.simulation.scenario import LARGEST_SEED, UNITS
from ppafo.version import __version__
from ppafo.wording import known_names, one_line

_DEFAULT_DEVICE = "ppafo2011"
_DEFAULT_PRESET = "paper-bench"
NOTICE = "synthetic: made by the simulated test bench of ppafo in place of a measurement"
"""Notice in the metadata of every recording of the simulated bench."""

EXPERIMENTS: dict[str, tuple[str, Callable[[ExperimentRequest], ExperimentResult]]] = {
    "static-torque": ("torque on a scale over pressure, three times up and down", record_static_torque),
    "free-decay": ("angle after an impulse, chambers open to the room", record_free_decay),
    "open-valve-flow": ("flow of the open valve at many pressures", record_open_valve),
    "vane-leak": ("pressures of plugged chambers as gas leaks across the vane", record_vane_leak),
    "vane-leak-steady": ("flow that maintains the pressure in chamber 1", record_steady_leak),
    "valve-map": ("flow of the valve over its command, up and down", record_valve_map),
    "step-response": ("figure 7: valve opened fully, vane from stop to stop", record_step_response),
    "torque-task": ("figure 8: torque ramp and hold under control", record_torque_task),
}
"""Experiments by name: summary, and function that records."""


@dataclass(frozen=True, slots=True)
class RigRecording:
    """Synthetic recording with the true device and the true parameters behind it.

    ``device``: the true device, which the sensors do not know
    ``truth``: all settings and true values as plain data, for ``rig.json``
    ``motion``: motion of the vane for ``validate``, "" for an experiment without motion
    """

    recording: Recording
    device: Device
    truth: Mapping[str, Any]
    motion: str = ""


def record(
    experiment: str,
    preset: str | Path | Preset = _DEFAULT_PRESET,
    seed: int = 1,
    device: str = _DEFAULT_DEVICE,
    overrides: Iterable[str] = (),
    valve: str | None = None,
    progress: Report = report_nothing,
) -> RigRecording:
    """Run an experiment on the simulated bench; equal arguments give identical bytes.

    ``overrides`` are texts such as ``friction.static_torque=0.5 N m`` (device), ``run.duration=1 s`` (dynamic
    experiments) or ``rig.pressure_sensor.noise=0 Pa_d`` (preset). ``progress`` is called every second with the number
    of samples recorded. Raises SimulationError if the solver fails.
    """
    summary, run = find_experiment(experiment)
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed <= LARGEST_SEED:
        raise ParameterError(f"seed = {seed} must be a whole number from 0 to {LARGEST_SEED}")
    overrides = tuple(overrides)
    of_preset = tuple(override for override in overrides if override.strip().startswith(PREFIX))
    others = tuple(override for override in overrides if override not in of_preset)
    if not isinstance(preset, Preset):
        preset = load_preset(preset, of_preset)
    elif of_preset:
        raise ParameterError(f"override '{of_preset[0]}': not allowed with a preset object; use Preset.with_value")
    kind = load_parameter_set(device).actuator_kind
    if kind != VANE:
        raise ParameterError(
            f"the simulated test bench supports vane actuators only, but the actuator of '{one_line(device)}' is of "
            f"kind '{kind}'; choose a device with a vane actuator"
        )
    result = run(ExperimentRequest(preset, seed, device, valve, others, progress))
    truth = {
        "notice": NOTICE,
        "units": UNITS,
        "version": __version__,
        "experiment": experiment,
        "summary": summary,
        "seed": seed,
        "parameter_set": device,
        "overrides": list(overrides),
        "device": plain(result.device),
        "shown": dict(result.device.shown),
        "preset": {
            **fields_of(preset, "name", "title"),
            "values": plain(preset.values),
            "reasons": dict(preset.reasons),
        },
        "sensor_offsets": plain(result.offsets),
        "settings": plain(result.settings),
        "channels": {name: result.recording.unit(name) for name in result.recording.names},
        "samples": len(result.recording),
        **({"replaced": result.replaced} if result.replaced else {}),
    }
    return RigRecording(result.recording, result.device, truth, result.motion)


def find_experiment(name: str) -> tuple[str, Callable[[ExperimentRequest], ExperimentResult]]:
    """Return summary and function of an experiment. Raises ParameterError for an unknown name."""
    if name not in EXPERIMENTS:
        raise ParameterError(f"there is no experiment '{one_line(name)}'{known_names(name, EXPERIMENTS)}")
    return EXPERIMENTS[name]


def overview() -> tuple[str, dict[str, Any]]:
    """Return the list of experiments and presets with descriptions, as text and as plain data."""
    experiments = {name: summary for name, (summary, _) in EXPERIMENTS.items()}
    presets = {name: load_preset(name).title for name in list_presets()}
    width = max(map(len, [*experiments, *presets]))
    lines = ["experiments (recordings are synthetic):"]
    lines += [f"  {name:<{width}}  {summary}" for name, summary in experiments.items()]
    lines += ["presets:", *(f"  {name:<{width}}  {title}" for name, title in presets.items())]
    document = {
        "experiments": [{"name": name, "summary": summary} for name, summary in experiments.items()],
        "presets": [{"name": name, "title": title} for name, title in presets.items()],
    }
    return "\n".join(lines), document
