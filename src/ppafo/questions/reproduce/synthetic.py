"""Synthetic measurements in place of the paper's: recorded on the virtual rig, and what follows from them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ppafo.errors import DataError, SimulationError
from ppafo.questions.reproduce.bench import IDEAL, PLANTED_SET, REALISTIC, SEED, BenchStudy, bench_study
from ppafo.rig import record
from ppafo.signals import Recording
from ppafo.simulation.scenario import Scenario
from ppafo.validation import RecordingAgreement, ReplaySettings, compare_recording
from ppafo.validation.measured import check_recording

STEP_PRESET = REALISTIC
"""The bench as it may have been: a validation against the model's own physics would show nothing."""
TASK_PRESET = IDEAL
"""The paper's physics behind noisy sensors: on ``paper-bench`` the proportional valve's task alone takes 6 s."""


@dataclass(frozen=True, slots=True)
class SyntheticEvidence:
    """Parameters identified on the rig, the step response compared with the model, and both torque tasks."""

    bench: BenchStudy
    step: RecordingAgreement
    solenoid: Recording
    proportional: Recording


@dataclass(frozen=True, slots=True)
class NoEvidence:
    """Why there is no synthetic measurement, in one sentence."""

    reason: str


def synthetic_evidence(
    step: Scenario, tasks: Mapping[str, tuple[str, ...]], step_overrides: Sequence[str]
) -> SyntheticEvidence | NoEvidence:
    """Return what the rig records, or why it cannot: the extra is missing, or it cannot follow the overrides.

    ``tasks`` has the overrides of the torque task by valve, ``solenoid`` and ``proportional``. The bench keeps the
    paper's values whatever is overridden.
    """
    try:
        recorded = {
            valve: record("torque-task", TASK_PRESET, SEED, PLANTED_SET, overrides, valve).recording
            for valve, overrides in tasks.items()
        }
        return SyntheticEvidence(
            bench=bench_study(),
            step=_step_agreement(step, step_overrides),
            solenoid=recorded["solenoid"],
            proportional=recorded["proportional"],
        )
    except (SimulationError, DataError) as error:
        return NoEvidence(str(error))


def _step_agreement(scenario: Scenario, overrides: Sequence[str]) -> RecordingAgreement:
    """Replay the recorded command and supply pressure on the model of the scenario, as ``ppafo validate`` does."""
    recording = record("step-response", STEP_PRESET, SEED, PLANTED_SET, overrides).recording
    measured = check_recording(recording, scenario.device, "step-response on the virtual rig (synthetic)")
    return compare_recording(measured, scenario.device, ReplaySettings())
