"""Assumed values of the paper's experiments, and synthetic recordings of these experiments for the figures.

A synthetic recording contains no information on the paper's device, so no claim rests on it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

from ppafo.errors import DataError, SimulationError
from ppafo.identification.bench import BenchResult, free_decay, static_torque
from ppafo.identification.source import RecordingSource
from ppafo.parameters import load_device, load_parameter_set
from ppafo.parameters.overrides import read_overrides, with_overrides
from ppafo.parameters.parameter_set import SOURCE as OVERRIDE
from ppafo.parameters.parameter_set import entry_text, with_followers
from ppafo.rig import record
from ppafo.signals import Recording
from ppafo.simulation.declaration import quantities
from ppafo.simulation.overrides import override_document
from ppafo.simulation.scenario import PrescribedMotion, Scenario

_NOT_OF_THE_PAPER = ("assumed", "derived")
_ONLY_FOR_A_FREE_VANE = frozenset({"actuator.restitution", "foot_plate.gravity_torque"})


@dataclass(frozen=True, slots=True)
class AssumedValue:
    """Value of a simulation that is assumed or derived, because the paper does not print it in this form.

    ``path``, ``meaning``, ``value``: dotted path, description, and value with unit
    ``origin``: kind of origin
    ``reason``: reason for the value
    ``source``: source of the reason; empty if the reason needs none
    ``used_by``: experiments that use the value
    """

    path: str
    meaning: str
    value: str
    origin: str
    reason: str
    source: str
    used_by: tuple[str, ...]

    def sentence(self) -> str:
        """Format the assumed value and its reason as one line."""
        source = f" ({self.source})" if self.source else ""
        return f"{self.path} = {self.value}: {self.reason}{source}"


def assumed_values(scenarios: Mapping[str, Scenario]) -> tuple[AssumedValue, ...]:
    """Return the assumed values of the scenarios, with their displayed names and without duplicates."""
    merged: dict[tuple[str, str, str], AssumedValue] = {}
    for name, scenario in scenarios.items():
        origin = scenario.origin
        changed = override_document(origin.content, read_overrides(origin.overrides), scenario.name)
        written = read_overrides(origin.content["device"].get("overrides", ()))
        file_set = with_overrides(load_parameter_set(origin.parameter_set), written, origin.valve)
        in_force = with_followers(with_overrides(file_set, changed.device, origin.valve))
        summaries = {path: quantity.summary for path, quantity in quantities(changed.document).items()}
        summaries |= {path: quantity.summary for path, quantity in in_force.declarations().items()}
        values = [
            AssumedValue(stated.path, summaries.get(stated.path, ""), stated.value, "assumed", stated.note, "", (name,))
            for stated in scenario.assumptions
        ]
        settled = {assumption.path for assumption in values}
        # Reported results are what a run is compared with; of two valves one is in the device.
        settled |= {path for path in in_force.numbers if path.startswith("reported.")}
        valve = f"valves.{origin.valve}."
        settled |= {path for path in in_force.numbers if path.startswith("valves.") and not path.startswith(valve)}
        if isinstance(scenario.motion, PrescribedMotion):
            settled |= _ONLY_FOR_A_FREE_VANE
        for path, entry in in_force.numbers.items():
            is_set_here = entry.source == OVERRIDE
            is_of_file = is_set_here and file_set.numbers.get(path) == entry
            if path not in settled and entry.origin in _NOT_OF_THE_PAPER and not is_of_file:
                # What was set for this run says what it replaces.
                reason, source = (f"set for this run; {entry.note}", "") if is_set_here else (entry.note, entry.source)
                meaning, text = summaries[path], entry_text(entry)
                values.append(AssumedValue(path, meaning, text, entry.origin, reason, source, (name,)))
        for value in values:
            key = (value.path, value.value, value.reason)
            earlier = merged.get(key)
            merged[key] = value if earlier is None else replace(earlier, used_by=(*earlier.used_by, name))
    return tuple(merged.values())


PLANTED_SET = "ppafo2011"
RIG_SEED = 1
BENCH_PRESET = "paper-bench"
"""Preset of a bench similar to the paper's, for figures 3 and 7."""
TASK_PRESET = "ideal-laboratory"
"""Preset with the paper's physics and noisy sensors for the torque tasks."""


@dataclass(frozen=True, slots=True)
class SyntheticEvidence:
    """Synthetic recordings: both procedures of figure 3, the step response, and both torque tasks."""

    torque: BenchResult
    decay: BenchResult
    step: Recording
    solenoid: Recording
    proportional: Recording


def synthetic_evidence(tasks: Mapping[str, tuple[str, ...]], step_overrides: Sequence[str]) -> SyntheticEvidence | str:
    """Return the recordings of the rig, or an error message if a run fails or the rig does not support the overrides.

    ``tasks`` are the overrides of the torque task for the valves ``solenoid`` and ``proportional``. The procedures of
    figure 3 always use the paper's values, without overrides.
    """
    try:
        recorded = {
            valve: record("torque-task", TASK_PRESET, RIG_SEED, PLANTED_SET, overrides, valve).recording
            for valve, overrides in tasks.items()
        }
        torque, decay = bench_figure()
        return SyntheticEvidence(
            torque=torque,
            decay=decay,
            step=record("step-response", BENCH_PRESET, RIG_SEED, PLANTED_SET, step_overrides).recording,
            **recorded,
        )
    # No claim rests on a recording: without them the figures show less, and the report says why.
    except (SimulationError, DataError) as error:
        return str(error)


@cache
def bench_figure() -> tuple[BenchResult, BenchResult]:
    """Identify torque constant and damping as in figure 3, from synthetic recordings.

    Raises SimulationError if a run of the rig fails.
    """
    # Kept: it takes seconds, and no override reaches it.
    inertia = load_device(PLANTED_SET).foot_plate.inertia
    torque, decay = (
        RecordingSource(record(experiment, BENCH_PRESET, RIG_SEED, PLANTED_SET).recording)
        for experiment in ("static-torque", "free-decay")
    )
    return static_torque((torque,)), free_decay((decay,), inertia=inertia)
