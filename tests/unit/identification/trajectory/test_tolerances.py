"""What a bench does not know exactly: read from a table, part of the fit and of its intervals."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from ppafo.constants import PASCALS_PER_PSI
from ppafo.documents.toml_text import TomlFile
from ppafo.errors import IdentificationError
from ppafo.identification.fit import FitNumber
from ppafo.identification.tolerances import DEFAULTS, Tolerances
from ppafo.identification.trajectory import fitting as trajectory_runs
from ppafo.identification.trajectory.experiment import (
    FittedExperiment,
    TrajectoryProblem,
    number_at,
    tolerance_parameters,
    with_numbers,
)
from ppafo.identification.trajectory.fitting import fit, prepare, signals_at
from ppafo.parameters.loading import load_parameter_set
from ppafo.parameters.records import checked_record, record_from
from ppafo.running import simulate
from ppafo.signals.recording import Channel, Recording
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Scenario

STATED = Tolerances(supply=PASCALS_PER_PSI, zero_of_pressure=0.15 * PASCALS_PER_PSI, gain=0.003)


def test_tolerances_are_read_with_their_units() -> None:
    stated = {"load": "2 %", "supply": "1 psi_d", "zero_of_angle": "0.3 deg", "gain": "0.3 %"}
    found = record_from(Tolerances, stated)
    assert found.load == 0.02
    assert found.supply == pytest.approx(PASCALS_PER_PSI)
    assert found.zero_of_angle == pytest.approx(math.radians(0.3))
    assert found.zero_of_pressure == pytest.approx(0.3 * PASCALS_PER_PSI)
    assert record_from(Tolerances, {}) == DEFAULTS


@pytest.mark.parametrize(
    ("key", "text", "words"),
    [
        ("supply", "1 psi", "psi_d for a difference"),
        ("supply", "-1 psi_d", "must be at least 0 psi_d"),
        ("load", "70 %", "at most 50 %"),
    ],
)
def test_a_tolerance_that_is_none_is_refused_in_one_line(key: str, text: str, words: str) -> None:
    with pytest.raises(IdentificationError, match=f"^file: {key} = '{text}': .*{words}"):
        checked_record(Tolerances, TomlFile("file", {key: text}, IdentificationError))


def test_supplies_are_those_of_a_recording_and_zeros_and_gains_those_of_a_sensor(experiment: FittedExperiment) -> None:
    loaded = replace(experiment, label="loaded", scenario=with_numbers(experiment.scenario, {LOAD: 2.0}))
    found = tolerance_parameters(STATED, (experiment, loaded), ())
    names = [item.name for item in found]
    assert names[:10] == [
        "supply.pressure of step",
        "supply.dorsiflexion_pressure of step",
        f"{LOAD} of loaded",
        "supply.pressure of loaded",
        "supply.dorsiflexion_pressure of loaded",
        "recording.zero_of_angle",
        "recording.zero_of_pressure_1",
        "recording.zero_of_pressure_2",
        "recording.gain_of_angle",
        "recording.gain_of_pressure_1",
    ]
    load = found[2]
    assert (load.start, load.deviation) == pytest.approx((2.0, 0.04 / math.sqrt(3.0)))


def test_a_number_of_the_set_is_held_with_what_the_set_states_or_else_a_default(experiment: FittedExperiment) -> None:
    whole = load_parameter_set("ppafo2011")
    entry = replace(whole.numbers["actuator.torque_constant"], value=14.51e-6, unit="m^3", uncertainty=1.0e-6)
    known = replace(whole, numbers={"actuator.torque_constant": entry})
    found = tolerance_parameters(Tolerances(), (experiment,), (), known)
    deviations = {item.path: item.deviation for item in found}
    assert deviations["actuator.torque_constant"] == pytest.approx(1.0e-6 / 1.96, rel=1e-3)
    assert deviations["foot_plate.inertia"] == pytest.approx(0.05 * 0.0084 / math.sqrt(3.0))
    assert deviations["gas.temperature"] == pytest.approx(15.0 / math.sqrt(3.0))
    assert "valves.proportional.area" not in deviations
    exact = tolerance_parameters(Tolerances(held=0.0, gas_temperature=0.0, gas_law=0.0), (experiment,), ())
    assert not any(item.path.startswith(("gas.", "friction.", "actuator.")) for item in exact)


def test_friction_at_rest_may_last_in_a_motion_up_to_a_velocity_where_the_set_says_nothing_of_it(
    experiment: FittedExperiment,
) -> None:
    found, share = (one for one in tolerance_parameters(Tolerances(), (experiment,), ()) if "stribeck" in one.path)
    assert found.is_logarithm
    assert math.log(0.5 / found.start) == pytest.approx(1.645 * found.deviation)
    # A share that is held would make its error one of the static friction: it is a tolerance as every other number.
    assert (share.path, share.start) == ("effects.stribeck.share", 0.9)
    assert share.deviation == pytest.approx(0.3 * 0.9 / math.sqrt(3.0))
    sought = FitNumber("effects.stribeck.velocity", start=0.2)
    beside = [one.path for one in tolerance_parameters(Tolerances(), (experiment,), (sought,)) if "stri" in one.path]
    assert beside == ["effects.stribeck.share"]
    own = replace(experiment, scenario=with_numbers(experiment.scenario, {"effects.stribeck.velocity": 0.2}))
    (stated,) = (
        one for one in tolerance_parameters(Tolerances(), (own,), ()) if one.path.endswith("stribeck.velocity")
    )
    assert not stated.is_logarithm
    exact = tolerance_parameters(Tolerances(stribeck_velocity=0.0), (experiment,), ())
    assert not any("stribeck" in one.path for one in exact)


def test_a_start_read_from_noisy_samples_is_known_to_their_noise(experiment: FittedExperiment) -> None:
    inside = replace(experiment, start=0.05, is_recorded_start=True)
    deviations = {item.path: item.deviation for item in tolerance_parameters(Tolerances(), (inside,), ())}
    assert deviations["motion.angle"] == pytest.approx(math.radians(math.hypot(0.05, 0.1)), rel=0.1)
    assert deviations["initial.pressure_1"] == pytest.approx(500.0, rel=0.2)


def test_a_followed_supply_has_the_zero_of_its_sensor(experiment: FittedExperiment) -> None:
    count = len(experiment.recording)
    recording = experiment.recording.with_channel("supply_pressure", np.full(count, 4.8e5), "Pa")
    followed = replace(experiment, recording=recording, inputs=("supply_pressure",))
    paths = [item.path for item in tolerance_parameters(Tolerances(), (followed,), ())]
    assert "recording.zero_of_supply_pressure" in paths
    assert "supply.pressure" not in paths


def test_a_sensor_that_is_mounted_anew_has_a_zero_in_each_recording(experiment: FittedExperiment) -> None:
    other = replace(experiment, label="other")
    found = tolerance_parameters(Tolerances(gain=0.003, each_recording=("gain",)), (experiment, other), ())
    gains = [item for item in found if item.path.startswith("recording.gain")]
    assert [item.recordings for item in gains] == [("step",), ("other",)] * 3


def test_what_is_fitted_anyway_gets_no_tolerance(experiment: FittedExperiment) -> None:
    fitted = (FitNumber("supply.pressure"), FitNumber("valve.discharge_coefficient"))
    paths = [item.path for item in tolerance_parameters(STATED, (experiment,), fitted)]
    assert not {"supply.pressure", "valves.proportional.discharge_coefficient"} & set(paths)


def test_zeros_and_gains_change_what_the_sensor_says_and_need_no_run_of_their_own(
    experiment: FittedExperiment, monkeypatch: pytest.MonkeyPatch
) -> None:
    prepared = prepare(experiment, {"foot_plate.inertia": 0.008})
    inertia = np.array([0.008, 0.009, 0.008, 0.009])
    zeros, gains = np.array([0.0, 100.0, 200.0, 0.0]), np.array([0.0, 0.01, 0.0, 0.02])
    ideal = signals_at(prepared, {"foot_plate.inertia": inertia}, 4)
    counts = []
    run = trajectory_runs.run_batch
    monkeypatch.setattr(
        trajectory_runs, "run_batch", lambda batch, threads: counts.append(1) or run(batch, threads=threads)
    )
    columns = {
        "foot_plate.inertia": inertia,
        "recording.zero_of_pressure_1": zeros,
        "recording.gain_of_pressure_1": gains,
    }
    found = signals_at(prepared, columns, 4)
    atmosphere = experiment.scenario.device.supply.atmospheric_pressure
    wanted = atmosphere + (1.0 + gains) * (ideal["pressure_1"] - atmosphere) + zeros
    np.testing.assert_allclose(found["pressure_1"], wanted, rtol=1e-12)
    np.testing.assert_array_equal(found["angle"], ideal["angle"])
    assert len(counts) == 1


LOAD = "motion.external_torque"


def test_errors_of_the_bench_hide_no_number_where_they_are_tolerances(recorded: Callable[..., Recording]) -> None:
    length = "run.duration=0.35 s"
    planned = {
        label: load_scenario("step-response", ["motion.kind=free", length, f"name={label}", *changed])
        for label, changed in {
            "there": (),
            "low": ("supply.pressure=30 psi_g", "supply.dorsiflexion_pressure=30 psi_g"),
        }.items()
    }

    def on_bench(scenario: Scenario, off: float, seed: int) -> FittedExperiment:
        wrong = {path: number_at(scenario, path) + off for path in SUPPLIES}
        made = recorded(with_numbers(scenario, wrong), seed)
        channels = {name: Channel(made[name] + ZEROS[name], made.unit(name)) for name in made.names}
        return FittedExperiment(scenario.name, scenario, replace(made, channels=channels))

    experiments = (on_bench(planned["there"], 5000.0, 1), on_bench(planned["low"], -5500.0, 2))
    free = (FitNumber("foot_plate.inertia", start=0.009), FitNumber("friction.viscous_damping"))
    inertia = number_at(planned["there"], "foot_plate.inertia")

    plain = fit(TrajectoryProblem(free, experiments))
    stated = fit(TrajectoryProblem((*free, *tolerance_parameters(Tolerances(), experiments, free)), experiments))

    without, with_them = plain["foot_plate.inertia"], stated["foot_plate.inertia"]
    assert not without.low <= inertia <= without.high
    assert without.verdict == "holds for this model only"
    assert with_them.low <= inertia <= with_them.high
    assert with_them.verdict == "identified"
    supply = next(item for item in stated.known if item.name == "supply.pressure of there")
    truth = number_at(planned["there"], "supply.pressure") + 5000.0
    assert abs(supply.after - truth) < 3.0 * supply.after_error < 3.0 * supply.before_error


SUPPLIES = ("supply.pressure", "supply.dorsiflexion_pressure")
ZEROS = {"angle": 0.0, "pressure_1": 800.0, "pressure_2": -600.0}


@pytest.mark.parametrize("path", ["valves.proportional.delay", "valves.proportional.discharge_coefficient"])
@pytest.mark.parametrize(("lag", "noise"), [(0.002, 1500.0), (0.005, 100.0), (0.02, 100.0)])
def test_the_lag_of_a_filtered_sensor_is_no_dead_time_of_the_valve(path: str, lag: float, noise: float) -> None:
    common = ("motion.kind=locked", "run.duration=0.3 s")
    truth = load_scenario("step-response", [*common, "valve.delay=18 ms"])
    run, time = simulate(truth).recording, np.arange(301) * 1.0e-3
    fine, left, channels = np.arange(0.0, 0.30001, 1.0e-5), math.exp(-1.0e-5 / lag), {}
    for seed, name in enumerate(("pressure_1", "pressure_2")):
        values = np.interp(fine, run.time, run[name])
        filtered = values[0] + lfilter([1.0 - left], [1.0, -left], values - values[0])
        sensed = np.interp(time, fine, filtered) + np.random.default_rng(seed).normal(0.0, noise, time.size)
        channels[name] = Channel(sensed, "Pa")
    start = truth if "delay" not in path else load_scenario("step-response", [*common, "valve.delay=10 ms"])
    experiment = FittedExperiment("one", start, Recording("filtered", time, channels), channels=tuple(channels))
    sought = (FitNumber(path),)
    problem = TrajectoryProblem((*sought, *tolerance_parameters(Tolerances(), [experiment], sought)), (experiment,))
    found = fit(problem)
    assert found.estimates[0].low <= number_at(truth, path) <= found.estimates[0].high
    assert found.estimates[0].is_identified
    if "delay" in path:
        after = {item.name: item.after for item in found.known}
        assert after["recording.lag_of_pressure_1"] == pytest.approx(lag, rel=0.1, abs=0.5e-3)
