"""What a bench does not know exactly: read from a table, part of the fit and of its intervals."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ppafo.constants import PASCALS_PER_PSI
from ppafo.errors import IdentificationError
from ppafo.identification.trajectory import Experiment, FreeParameter, Search, TrajectoryProblem, fit
from ppafo.identification.trajectory import residuals as trajectory_residuals
from ppafo.identification.trajectory.fitting import residuals_of
from ppafo.identification.trajectory.problem import number_at, with_numbers
from ppafo.identification.trajectory.residuals import signals_at
from ppafo.identification.trajectory.tolerances import (
    AbilitySection,
    BenchSection,
    Tolerances,
    ability_of,
    tolerance_parameters,
    tolerances_of,
)
from ppafo.signals.recording import Channel, Recording
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Scenario

STATED = Tolerances(supply=PASCALS_PER_PSI, zero_of_pressure=0.15 * PASCALS_PER_PSI, gain=0.003)


def test_tolerances_are_read_with_their_units() -> None:
    found = tolerances_of(BenchSection(load="2 %", supply="1 psi_d", zero_of_angle="0.3 deg", gain="0.3 %"), "file")
    assert found.load == 0.02
    assert found.supply == pytest.approx(PASCALS_PER_PSI)
    assert found.zero_of_angle == pytest.approx(math.radians(0.3))
    assert found.zero_of_pressure == 0.0


@pytest.mark.parametrize(
    ("key", "text", "words"),
    [
        ("supply", "1 psi", "psi_d for a difference"),
        ("supply", "0 psi_d", "must be above 0; leave it out"),
        ("load", "70 %", "at most 50%"),
    ],
)
def test_a_tolerance_that_is_none_is_refused_in_one_line(key: str, text: str, words: str) -> None:
    with pytest.raises(IdentificationError, match=f"^file: bench: {key} = '{text}'.*{words}"):
        tolerances_of(BenchSection(**{key: text}), "file")


def test_what_a_bench_can_do_has_its_lowest_first() -> None:
    section = AbilitySection(supply_pressure=("20 psi_g", "80 psi_g"), load=("3 N m", "-3 N m"))
    with pytest.raises(IdentificationError, match=r"^file: bench\.can: load: the first must not be above the second$"):
        ability_of(section, 101325.0, "file")
    assert ability_of(section.model_copy(update={"load": ("-3 N m", "3 N m")}), 101325.0, "file").load == (-3.0, 3.0)


def test_supplies_are_those_of_a_recording_and_zeros_and_gains_those_of_a_sensor(experiment: Experiment) -> None:
    loaded = replace(experiment, label="loaded", scenario=with_numbers(experiment.scenario, {LOAD: 2.0}))
    found = tolerance_parameters(replace(STATED, load=0.02), (experiment, loaded), ())
    names = [item.name for item in found]
    assert names == [
        "supply.pressure of step",
        "supply.dorsiflexion_pressure of step",
        f"{LOAD} of loaded",
        "supply.pressure of loaded",
        "supply.dorsiflexion_pressure of loaded",
        "recording.gain_of_angle",
        "recording.zero_of_pressure_1",
        "recording.gain_of_pressure_1",
        "recording.zero_of_pressure_2",
        "recording.gain_of_pressure_2",
    ]
    priors = {item.name: item.prior for item in found}
    load = priors[f"{LOAD} of loaded"]
    assert load is not None
    assert (load.mean, load.standard_deviation) == pytest.approx((2.0, 0.04 / math.sqrt(3.0)))


def test_a_sensor_that_is_mounted_anew_has_a_zero_in_each_recording(experiment: Experiment) -> None:
    other = replace(experiment, label="other")
    found = tolerance_parameters(Tolerances(gain=0.003, each_recording=("gain",)), (experiment, other), ())
    assert [item.recordings for item in found] == [("step",), ("other",)] * 3


def test_what_is_fitted_anyway_gets_no_tolerance(experiment: Experiment) -> None:
    found = tolerance_parameters(STATED, (experiment,), (FreeParameter("supply.pressure"),))
    assert "supply.pressure of step" not in [item.name for item in found]


def test_zeros_and_gains_change_what_the_sensor_says_and_need_no_run_of_their_own(
    experiment: Experiment, monkeypatch: pytest.MonkeyPatch
) -> None:
    (prepared,) = residuals_of(
        TrajectoryProblem((FreeParameter("foot_plate.inertia", 0.008),), (experiment,))
    ).experiments
    inertia = np.array([0.008, 0.009, 0.008, 0.009])
    zeros, gains = np.array([0.0, 100.0, 200.0, 0.0]), np.array([0.0, 0.01, 0.0, 0.02])
    ideal = signals_at(prepared, {"foot_plate.inertia": inertia}, 4)
    counts = []
    run = trajectory_residuals.run_batch
    monkeypatch.setattr(
        trajectory_residuals, "run_batch", lambda batch, threads: counts.append(1) or run(batch, threads=threads)
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
NOISE = {"angle": math.radians(0.1), "pressure_1": 500.0, "pressure_2": 500.0}


@pytest.mark.long
def test_errors_of_the_bench_are_taken_for_those_only_where_they_are_stated(
    recorded: Callable[..., Recording],
) -> None:
    length = "run.duration=0.35 s"
    planned = {
        label: load_scenario("step-response", ["motion.kind=free", length, f"name={label}", *changed])
        for label, changed in {
            "there": (),
            "low": ("supply.pressure=30 psi_g", "supply.dorsiflexion_pressure=30 psi_g"),
        }.items()
    }

    def on_bench(scenario: Scenario, off: float, seed: int) -> Experiment:
        wrong = {path: number_at(scenario, path) + off for path in SUPPLIES}
        made = recorded(with_numbers(scenario, wrong), seed)
        channels = {name: Channel(made[name] + ZEROS[name], made.unit(name)) for name in made.names}
        return Experiment(scenario.name, scenario, replace(made, channels=channels))

    experiments = (on_bench(planned["there"], 5000.0, 1), on_bench(planned["low"], -5500.0, 2))
    free = (FreeParameter("foot_plate.inertia", start=0.009), FreeParameter("friction.viscous_damping"))
    plain = fit(TrajectoryProblem(free, experiments))
    added = tolerance_parameters(STATED, experiments, free)
    stated = fit(TrajectoryProblem((*free, *added), experiments, Search(directions=True)))
    inertia = number_at(planned["there"], "foot_plate.inertia")
    without, with_them = plain.estimate("foot_plate.inertia"), stated.estimate("foot_plate.inertia")
    assert not without.low <= inertia <= without.high
    assert with_them.low <= inertia <= with_them.high
    assert plain.misfit
    assert not stated.misfit
    supply = next(item for item in stated.estimates if item.path == "supply.pressure of there")
    assert supply.verdict == "within its tolerance"
    assert supply.low <= number_at(planned["there"], "supply.pressure") + 5000.0 <= supply.high


SUPPLIES = ("supply.pressure", "supply.dorsiflexion_pressure")
ZEROS = {"angle": 0.0, "pressure_1": 800.0, "pressure_2": -600.0}
