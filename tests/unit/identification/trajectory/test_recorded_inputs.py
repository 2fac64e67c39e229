"""Runs that follow their recordings, and samples that are late."""

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from ppafo.errors import DataError, IdentificationError
from ppafo.identification.fit import FitNumber
from ppafo.identification.tolerances import DEFAULTS
from ppafo.identification.trajectory.experiment import (
    FittedExperiment,
    TrajectoryProblem,
    tolerance_parameters,
)
from ppafo.identification.trajectory.fitting import fit, prepare, signals_at, signals_of
from ppafo.running import simulate
from ppafo.signals.recording import Channel, Recording
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Scenario

NOISE = {"angle": 0.0017, "pressure_1": 500.0, "pressure_2": 500.0}
FLOW = FitNumber("valve.discharge_coefficient", start=0.10)
INERTIA = FitNumber("foot_plate.inertia", start=0.010)
OFFSET = FitNumber("recording.time_offset", recordings=("step",))
LATE = 3.4e-3


def with_input(experiment: FittedExperiment, name: str, values: np.ndarray, unit: str) -> FittedExperiment:
    recording = experiment.recording.with_channel(name, values, unit)
    return dataclasses.replace(experiment, recording=recording, inputs=(*experiment.inputs, name))


@pytest.fixture(scope="module")
def controlled() -> tuple[Scenario, Recording]:
    """A free vane under PID control with a slow valve: the command changes at every sample."""
    valve = ["valve.delay=4.4 ms", "valve.spool_frequency=20 Hz", "valve.slew_limit=30 1/s"]
    scenario = load_scenario(
        "torque-task-proportional", ["motion.kind=free", "motion.angle=60 deg", "run.duration=0.3 s", *valve]
    )
    return scenario, simulate(scenario).recording


@pytest.fixture(scope="module")
def late(experiment: FittedExperiment) -> FittedExperiment:
    """The step response, recorded 3.4 ms later than the run."""
    recording = dataclasses.replace(experiment.recording, time=experiment.recording.time + LATE)
    return dataclasses.replace(experiment, recording=recording)


@pytest.mark.parametrize("at", [0, 9, 100])
def test_a_recorded_command_gives_the_run_that_the_controller_made(
    controlled: tuple[Scenario, Recording], at: int
) -> None:
    scenario, recording = controlled
    assert np.count_nonzero(np.diff(recording["command"])) > 100
    # Later than the recording a run starts with the valve where the earlier commands have left it.
    motion = {name: float(recording[name][at]) for name in ("angle", "angular_velocity")}
    pressures = {name: float(recording[name][at]) for name in ("pressure_1", "pressure_2")}
    state = dataclasses.replace(scenario.motion, **motion), dataclasses.replace(scenario.initial, **pressures)
    begun = dataclasses.replace(scenario, motion=state[0], initial=state[1])
    start = float(recording.time[at])
    followed = FittedExperiment("task", begun, recording, start=start, noise=NOISE, inputs=("command",))
    numbers = TrajectoryProblem((FitNumber("valve.discharge_coefficient"),), (followed,)).numbers
    (signals,) = signals_of([prepare(followed, {})], numbers, np.array([[numbers[0].start]]))
    assert signals["angle"][:, 0] == pytest.approx(recording["angle"][at:], abs=1e-5)
    assert signals["pressure_1"][:, 0] == pytest.approx(recording["pressure_1"][at:], rel=1e-5)


def test_forty_runs_follow_the_same_command_as_one(controlled: tuple[Scenario, Recording]) -> None:
    scenario, recording = controlled
    followed = FittedExperiment("task", scenario, recording, noise=NOISE, inputs=("command",))
    numbers, prepared = TrajectoryProblem((FLOW,), (followed,)).numbers, [prepare(followed, {})]
    points = np.linspace(0.10, 0.12, 40)[None, :]
    (many,) = signals_of(prepared, numbers, points)
    (last,) = signals_of(prepared, numbers, points[:, -1:])
    assert np.array_equal(many["angle"][:, -1:], last["angle"])


def test_a_recorded_supply_takes_the_place_of_both_regulators(
    experiment: FittedExperiment, step: Scenario, recorded: Callable[..., Recording]
) -> None:
    low = load_scenario(
        "step-response",
        [
            "motion.kind=free",
            "run.duration=0.35 s",
            "supply.pressure=45 psi_g",
            "supply.dorsiflexion_pressure=45 psi_g",
        ],
    )
    recording = recorded(low)
    start = dataclasses.replace(step, initial=dataclasses.replace(step.initial, pressure_2=low.initial.pressure_2))
    other = dataclasses.replace(experiment, recording=recording, scenario=start)
    followed = with_input(other, "supply_pressure", np.full(len(recording), low.device.supply.pressure), "Pa")
    found = fit(TrajectoryProblem((FLOW,), (followed,)))
    assert found["valves.proportional.discharge_coefficient"].value == pytest.approx(0.113, rel=2e-3)
    blind = fit(TrajectoryProblem((FLOW,), (other,)))
    assert abs(blind["valves.proportional.discharge_coefficient"].value / 0.113 - 1.0) > 0.02


def test_a_supply_that_changes_is_followed_millisecond_by_millisecond(experiment: FittedExperiment) -> None:
    count = len(experiment.recording)
    supply = np.linspace(4.0e5, 4.4e5, count)
    inputs = prepare(with_input(experiment, "supply_pressure", supply, "Pa"), {}).inputs
    assert inputs is not None
    assert inputs.command is None
    followed = inputs.parameters["plant.supply_pressure"]
    assert np.array_equal(followed, inputs.parameters["plant.dorsiflexion_pressure"])
    assert np.unique(followed).size == count - 1
    # In the middle of the first millisecond, half way from the first sample to the second.
    assert followed[0] == pytest.approx(0.5 * (supply[0] + supply[1]))


def test_along_a_recorded_angle_a_wrong_inertia_does_not_matter(
    step: Scenario, recorded: Callable[..., Recording]
) -> None:
    """The vane goes where it went, so that the pressures alone give the valve, whatever moves the vane."""
    heavy = dataclasses.replace(
        step,
        device=dataclasses.replace(step.device, foot_plate=dataclasses.replace(step.device.foot_plate, inertia=0.02)),
    )
    recording = recorded(step)
    free = FittedExperiment("step", heavy, recording, noise=NOISE)
    led = dataclasses.replace(free, channels=("pressure_1", "pressure_2"), inputs=("angle",))
    path = "valves.proportional.discharge_coefficient"
    assert fit(TrajectoryProblem((FLOW,), (led,)))[path].value == pytest.approx(0.113, rel=5e-3)
    assert abs(fit(TrajectoryProblem((FLOW,), (free,)))[path].value / 0.113 - 1.0) > 0.03
    with pytest.raises(IdentificationError, match="the recording prescribes the angle, which cannot be compared"):
        TrajectoryProblem((FLOW,), (dataclasses.replace(free, inputs=("angle",)),))


def test_the_same_recording_in_two_experiments_is_refused_and_two_parts_of_it_are_not(
    experiment: FittedExperiment,
) -> None:
    other = dataclasses.replace(experiment, label="again")
    with pytest.raises(IdentificationError, match=r"experiment 'step'.*experiment 'again'.* are the same recording"):
        TrajectoryProblem((FLOW,), (experiment, other))
    # A run is compared to the end of its recording, however long its scenario is.
    late = dataclasses.replace(other, start=0.32)
    with pytest.raises(IdentificationError, match="would count twice"):
        TrajectoryProblem((FLOW,), (experiment, late))
    early = dataclasses.replace(experiment, recording=experiment.recording.between(0.0, 0.3))
    assert len(TrajectoryProblem((FLOW,), (early, late)).experiments) == 2


def test_a_supply_that_is_followed_cannot_be_fitted_too(experiment: FittedExperiment) -> None:
    followed = with_input(experiment, "supply_pressure", np.full(len(experiment.recording), 4.0e5), "Pa")
    with pytest.raises(IdentificationError, match="uses the recorded 'supply_pressure'"):
        TrajectoryProblem((FitNumber("supply.pressure"),), (followed,))


@pytest.mark.parametrize(
    ("name", "values", "unit", "message"),
    [
        ("command", 1.5, "-", "'command' is 1.5 in sample 1; it must be from -1 to 1"),
        ("supply_pressure", 2.0e4, "Pa", "far below atmospheric pressure"),
    ],
)
def test_an_input_that_cannot_be_is_refused(
    experiment: FittedExperiment, name: str, values: float, unit: str, message: str
) -> None:
    followed = with_input(experiment, name, np.full(len(experiment.recording), values), unit)
    with pytest.raises(DataError, match=message):
        TrajectoryProblem((INERTIA,), (followed,))


def test_a_gap_in_an_input_is_refused(experiment: FittedExperiment) -> None:
    whole = with_input(experiment, "command", np.ones(len(experiment.recording)), "-")
    time = whole.recording.time.copy()
    time[100:] += 0.2
    broken = dataclasses.replace(whole, recording=dataclasses.replace(whole.recording, time=time))
    with pytest.raises(DataError, match=r"experiment 'step': there is a gap of 0\.201 s"):
        TrajectoryProblem((INERTIA,), (broken,))


@pytest.mark.parametrize("off", [1.8, 1.0 / 1.8])
def test_a_recording_that_begins_in_motion_gives_the_velocity_at_its_start(
    experiment: FittedExperiment, off: float
) -> None:
    recording = experiment.recording
    speed = np.gradient(recording["angle"], recording.time)
    start = float(recording.time[int(np.argmax(speed > 0.5 * speed.max())) + 5])
    cut = dataclasses.replace(experiment, recording=recording.between(start, 0.35), start=start, is_recorded_start=True)
    sought = (FitNumber("foot_plate.inertia", off * 0.0084, 0.001, 0.1),)
    found = fit(TrajectoryProblem((*sought, *tolerance_parameters(DEFAULTS, [cut], sought)), (cut,)))
    (inertia,) = found.estimates
    assert inertia.is_identified
    assert inertia.low <= 0.0084 <= inertia.high
    assert inertia.wider_half_width < 0.2 * inertia.value


def test_a_late_trigger_is_found_and_leaves_the_other_numbers_alone(late: FittedExperiment) -> None:
    found = fit(TrajectoryProblem((INERTIA, FLOW, OFFSET), (late,)))
    offset = found["recording.time_offset of step"]
    assert offset.wider_half_width < 2e-4
    assert abs(offset.value - LATE) < 3.0 / 1.96 * offset.wider_half_width
    inertia = found["foot_plate.inertia"]
    assert abs(inertia.value - 0.0084) < 3.0 / 1.96 * inertia.wider_half_width
    assert found.faults == ()
    ignored = fit(TrajectoryProblem((INERTIA, FLOW), (late,)))
    assert abs(ignored["foot_plate.inertia"].value / 0.0084 - 1.0) > 10.0 * inertia.wider_half_width / inertia.value


def test_a_long_recording_whose_samples_are_moved_does_not_fill_the_memory(step: Scenario) -> None:
    time = np.arange(0.0, 60.0, 1e-3)
    flat = {
        name: Channel(np.full(time.size, value), unit)
        for name, value, unit in (("angle", 0.5, "rad"), ("pressure_1", 2e5, "Pa"), ("pressure_2", 2e5, "Pa"))
    }
    slow = FittedExperiment("slow", step, Recording("slow", time, flat), noise=NOISE)
    run = prepare(slow, {}, reach=0.02).run
    assert run.step_count // run.record_every <= 200_000
    assert run.steps_per_sample % run.record_every == 0


def test_the_zero_of_the_sensor_of_a_followed_supply_moves_what_the_run_follows(experiment: FittedExperiment) -> None:
    supply = np.linspace(4.0e5, 4.4e5, len(experiment.recording))
    followed = prepare(with_input(experiment, "supply_pressure", supply, "Pa"), {})
    shifted = prepare(with_input(experiment, "supply_pressure", supply - 2.0e3, "Pa"), {})
    zeros = {"recording.zero_of_supply_pressure": np.array([0.0, 2.0e3, 0.0])}

    moved, plain = signals_at(followed, zeros, 3), signals_at(shifted, {}, 1)

    assert moved["pressure_1"][:, 1] == pytest.approx(plain["pressure_1"][:, 0], rel=1e-6)
    assert np.array_equal(moved["pressure_1"][:, 0], moved["pressure_1"][:, 2])
    assert np.abs(moved["pressure_1"][:, 0] - moved["pressure_1"][:, 1]).max() > 1.0e3


def test_the_error_of_coarse_steps_is_shared_by_all_samples(experiment: FittedExperiment, step: Scenario) -> None:
    clean = simulate(dataclasses.replace(step, run=dataclasses.replace(step.run, step=2e-5))).recording
    scores = []
    for seed in (1, 2, 3):
        random = np.random.default_rng(seed)
        channels = {
            name: Channel(
                clean[name] + 1.0e-6 * np.ptp(clean[name]) * random.standard_normal(len(clean)), clean.unit(name)
            )
            for name in NOISE
        }
        quiet = dataclasses.replace(experiment, recording=Recording("quiet", clean.time, channels), noise={})
        (estimate,) = fit(TrajectoryProblem((FLOW,), (quiet,))).estimates
        scores.append((estimate.value - 0.113) / (estimate.wider_half_width / 1.96))
    # As noise of each sample the error of the steps left 2.4, 2.0 and 4.5 standard errors.
    assert np.abs(scores).max() < 3.0
    assert np.abs(np.mean(scores)) < 1.96
