"""Does an experiment on the rig: a synthetic recording, and the truth behind it, in memory or in a folder.

A folder has one CSV for each experiment, and ``rig.json`` with the truth behind all of them.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ppafo.documents.json_text import json_text
from ppafo.errors import DataError, ParameterError, nearest_name, one_line, reason
from ppafo.parameters.device import VANE, Device
from ppafo.parameters.loading import load_parameter_set
from ppafo.rig.experiments import EXPERIMENTS, Experiment
from ppafo.rig.preset import PREFIX, Outcome, Preset, Request, load_preset
from ppafo.signals.recording import Recording
from ppafo.simulation.scenario import UNITS, plain
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.storage.files import LEFT_ASIDE, add_files, check_files_can_be_added
from ppafo.storage.owned_folder import read_json
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
    # Raise ParameterError for a seed that is not a whole number from 0 to 4294967295.
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed <= LARGEST_SEED:
        raise ParameterError(f"seed = {seed} must be a whole number from 0 to {LARGEST_SEED}")
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


RIG_FILE = "rig.json"
FORMAT = "ppafo rig"


def csv_name(experiment: str) -> str:
    """Return the file name of an experiment's recording."""
    return f"{experiment}.csv"


def check_rig_folder(folder: Path, experiment: str) -> None:
    """Raise DataError, before anything runs, for a folder that cannot be written or belongs to something else."""
    _check_own(folder, csv_name(experiment))
    check_files_can_be_added(folder, [csv_name(experiment), RIG_FILE])


def write_rig_recording(folder: Path, made: RigRecording) -> tuple[str, ...]:
    """Write recording and truth into a folder beside those of other experiments; returns the file names.

    DataError for a folder that belongs to something else.
    """
    name = csv_name(made.truth["experiment"])
    _check_own(folder, name)
    recordings = {**_earlier(folder), name: dict(made.truth)}
    document = {
        "format": FORMAT,
        "schema_version": 1,
        "notice": NOTICE,
        "recordings": {key: recordings[key] for key in sorted(recordings)},
    }
    # By rig.json a folder is known to be the rig's: it is there first, whenever the process is killed.
    add_files(folder, {RIG_FILE: f"{json_text(document)}\n".encode(), name: marked_csv_bytes(made.recording)})
    return name, RIG_FILE


def _check_own(folder: Path, name: str) -> None:
    """Refuse a folder of others, and a file of others that a recording would replace."""
    earlier = _earlier(folder)
    try:
        there = {entry.name for entry in folder.iterdir()} if folder.is_dir() else set()
    except OSError as error:
        raise DataError(f"{folder}: cannot be read: {reason(error)}") from error
    present = {entry for entry in there if LEFT_ASIDE not in entry}
    if present and RIG_FILE not in present:
        raise DataError(f"{folder}: is not empty and has no recordings of the rig ({RIG_FILE}); choose another folder")
    if name in present and name not in earlier:
        raise DataError(f"{folder}: has a {name} that the rig did not write; move it or choose another folder")


def _earlier(folder: Path) -> dict[str, Any]:
    """Return what ``rig.json`` says of recordings that are already in a folder; refuse a file of another kind."""
    path = folder / RIG_FILE
    if not path.exists():
        return {}
    try:
        document = read_json(path)
    except DataError as error:
        raise DataError(f"{error}, so it is not overwritten") from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise DataError(f"{path}: was not written by the rig, so it is not overwritten")
    recordings = document.get("recordings")
    if not isinstance(recordings, dict):
        raise DataError(f"{path}: has no 'recordings', so it is not overwritten")
    return recordings
