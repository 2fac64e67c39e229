"""Synthetic recordings with known values planted in them: the model's own runs plus white noise."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.identification.trajectory import Experiment, FreeParameter, Search, TrajectoryProblem
from ppafo.identification.trajectory.problem import number_at
from ppafo.identification.trajectory.residuals import FIT_TOLERANCE
from ppafo.signals.recording import Channel, Floats, Recording
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import results_of

NOISE: Mapping[str, float] = {"angle": math.radians(0.1), "pressure_1": 500.0, "pressure_2": 500.0}
"""Standard deviations [rad], [Pa] of a potentiometer and of pressure sensors of 0.1 % of 500 kPa."""

_STRAY = 30.0
_EXACT = 0.25 * FIT_TOLERANCE

EIGHT_PARAMETERS = (
    "valve.discharge_coefficient",
    "actuator.leak.area",
    "actuator.dead_volume_1",
    "actuator.dead_volume_2",
    "friction.static_torque",
    "friction.dynamic_torque",
    "friction.viscous_damping",
    "foot_plate.inertia",
)
"""What two step responses can say, given geometry, torque constant and supply: without the first of these all volumes
and conductances, without the second all torques and the inertia, could grow together and nothing would change."""

_BACK = (
    "name=step-back",
    "controller.command=-1",
    "motion.angle=130 deg",
    "supply.dorsiflexion_pressure=40 psi_g",
    "initial.pressure_1=40 psi_g",
    "initial.pressure_2=atmosphere",
)


@dataclass(frozen=True, slots=True)
class Planted:
    """Scenarios whose devices hold the true values, and the noise of each channel [rad], [Pa].

    ``stray`` is the share of samples whose noise is 30 times as large.
    """

    scenarios: tuple[Scenario, ...]
    noise: Mapping[str, float]
    stray: float = 0.0

    def truth(self, path: str) -> float:
        """Return the planted value at a path, in SI units."""
        return number_at(self.scenarios[0], path)


def two_step_responses(duration: float = 1.0) -> Planted:
    """Return the paper's step response and one back from the other stop at 40 psig, each ``duration`` [s] at 1 kHz."""
    length = f"run.duration={duration!r} s"
    # The vane turns without the leg that figure 7 carries.
    there, back = (
        load_scenario("step-response", ("motion.kind=free", length, *changed)) for changed in ((), tuple(_BACK))
    )
    return Planted((there, back), NOISE)


def exact_recording(scenario: Scenario) -> Recording:
    """Return the recording of a run that is more exact than those of the fit, whose error is then its own."""
    return results_of(scenario, [replace(plan_run(scenario), tolerance=_EXACT)])[0].recording


def noisy_recordings(planted: Planted, random: np.random.Generator) -> tuple[Recording, ...]:
    """Return what sensors with white noise would have recorded; the recordings say that they are synthetic."""
    return tuple(_noisy(exact_recording(scenario), planted, random) for scenario in planted.scenarios)


def planted_problem(
    planted: Planted,
    parameters: Sequence[FreeParameter],
    recordings: Sequence[Recording],
    search: Search = Search(),  # noqa: B008  # a frozen value
) -> TrajectoryProblem:
    """Return the problem of finding the parameters again; the fit estimates the noise from the recordings."""
    experiments = tuple(
        Experiment(scenario.name, scenario, recording)
        for scenario, recording in zip(planted.scenarios, recordings, strict=True)
    )
    return TrajectoryProblem(tuple(parameters), experiments, search)


def eight_parameters(planted: Planted, random: np.random.Generator, spread: float = 0.2) -> tuple[FreeParameter, ...]:
    """Return the eight parameters, each starting up to a share ``spread`` away from its planted value."""
    return tuple(
        FreeParameter(path, start=planted.truth(path) * math.exp(random.uniform(-spread, spread)))
        for path in EIGHT_PARAMETERS
    )


def _noisy(recording: Recording, planted: Planted, random: np.random.Generator) -> Recording:
    channels = {
        name: Channel(recording[name] + deviation * _errors(planted, len(recording), random), recording.unit(name))
        for name, deviation in planted.noise.items()
    }
    return Recording(f"synthetic {recording.label}", recording.time, channels, kind="synthetic")


def _errors(planted: Planted, count: int, random: np.random.Generator) -> Floats:
    """Return errors of samples over the standard deviation of the noise [-]."""
    errors = random.standard_normal(count)
    if planted.stray == 0.0:
        return errors
    return np.asarray(np.where(random.random(count) < planted.stray, _STRAY * errors, errors))
