"""Meters and traces of an ensemble against the recordings of the same runs, one by one."""

import re
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from ppafo.errors import ScenarioError
from ppafo.metrics import METRICS
from ppafo.parameters.overrides import over
from ppafo.running import simulate
from ppafo.simulation.clock import TIMES
from ppafo.simulation.ensemble import COMPLETED, DIVERGED, REFUSED, EnsembleResult, run_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.numbers import declared_numbers, with_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Result
from tests.unit.simulation.ensemble import draws

Floats = NDArray[np.float64]

TASK = "torque-task-proportional"
COUNTS = ("switchings", "oscillations_ramp", "oscillations_hold")
RUNS = 2
SIZES = {"gas_imbalance": 1e-4, "energy_imbalance": 100.0}
"""What is added up in metrics that are 0 but for rounding [kg], [J]."""
METERS = tuple(name for name, kind in METRICS.items() if kind.compute)
BANDS = ("torque", "supplied_mass", "angle", "pressure_2")
"""The same meters and traces all over: each choice of them is another program to compile."""

WARM = (
    "gas_model.kind=thermal",
    "gas_model.heat_transfer_coefficient=50 W/(m^2 K)",
    "gas_model.wall_area_per_volume=300 1/m",
)
CASES: tuple[tuple[str, tuple[str, ...]], ...] = (
    (TASK, ("run.duration=0.6 s", "reference.ramp_start=0.05 s", "reference.ramp_time=0.3 s", "valve.area=3e-5 m^2")),
    (TASK, ("run.duration=0.6 s", "run.output_interval=3 ms", "run.step=1 ms", "reference.ramp_time=0.2 s")),
    ("torque-task-solenoid", ("run.duration=1.2 s", "reference.ramp_time=0.4 s")),
    ("torque-task-solenoid", ("run.duration=0.6 s", "valve.opening_delay=3 ms", "valve.switching_interval=4 ms")),
    ("torque-task-slow-valve", ("run.duration=1 s", "reference.ramp_time=0.3 s")),
    ("torque-task-moving-ankle", ("run.duration=1.9 s",)),
    ("torque-task-anti-windup", ("run.duration=4 s",)),
    (TASK, ("run.duration=0.5 s", "reference.kind=sine", "reference.amplitude=2 N m", "reference.frequency=9 Hz")),
    (TASK, ("run.duration=0.4 s", "reference.kind=constant", "reference.level=2 N m")),
    ("step-response", ()),
    ("swing-foot", ()),
    ("torque-task-moving-ankle", ("run.duration=1.9 s", *WARM)),
    ("pressure-loop", ("run.duration=1 s",)),
    ("pressure-loop", ("run.duration=1 s", "reference.of=pressure_2")),
    (
        "pressure-loop",
        (
            "run.duration=1 s",
            "reference.of=pressure_difference",
            "reference.start_level=0 psi_d",
            "reference.level=20 psi_d",
        ),
    ),
    (
        "cylinder-servo",
        (
            "run.duration=1 s",
            "reference.kind=ramp_hold",
            "reference.start_level=90 deg",
            "reference.level=100 deg",
            "reference.ramp_time=0.3 s",
        ),
    ),
    ("step-response", ("controller.kind=pid", "reference.kind=ramp_hold", "reference.level=2 N m", "run.duration=1 s")),
)
"""Scenarios of every kind of valve, motion, controller and reference, held or not."""


def quiet_columns(base: Scenario, generator: np.random.Generator) -> dict[str, Floats]:
    """Columns of numbers that keep program and clock: fewer programs to compile."""
    declared = declared_numbers(base)
    fixed = {*TIMES, "motion.angle", "motion.profile.level", "supply.atmospheric_pressure"}
    return {
        path: draws.column(base, path, quantity, generator, RUNS)
        for path, quantity in declared.items()
        if draws.has(base, path)
        and path not in fixed
        and path not in draws.CHOICES
        and path.rpartition(".")[0] not in ("sensors", "actuator")
    }


def alone(base: str, overrides: tuple[str, ...], columns: dict[str, Floats], run: int) -> Result:
    declared = declared_numbers(load_scenario(base, overrides))
    texts = [f"{path}={float(values[run])!r} {declared[path].unit}".strip() for path, values in columns.items()]
    return simulate(base, over(overrides, texts))


def assert_same_metrics(result: EnsembleResult, run: int, single: Result) -> None:
    for name, values in result.metrics.items():
        if name not in single.metrics:
            assert np.isnan(values[run]), name
        elif name in COUNTS:
            assert values[run] == single.metrics[name].value, name
        else:
            scale = SIZES.get(name, 0.0)
            assert values[run] == pytest.approx(single.metrics[name].value, rel=1e-11, abs=1e-12 * scale), name


@cache
def metered(name: str, overrides: tuple[str, ...]) -> tuple[dict[str, Floats], EnsembleResult]:
    """Columns of a case, and what an ensemble makes of them."""
    base = load_scenario(name, overrides)
    columns = quiet_columns(base, np.random.default_rng([*name.encode(), len(overrides)]))
    return columns, run_ensemble(base, columns, METERS)


@pytest.mark.parametrize(("name", "overrides"), CASES)
def test_meters_give_the_metrics_of_the_recording(name: str, overrides: tuple[str, ...]) -> None:
    columns, result = metered(name, overrides)
    assert set(result.metrics) == set(METERS)
    for run in range(RUNS):
        single = alone(name, overrides, columns, run)
        assert single.status.is_completed
        assert result.status[run] == COMPLETED
        assert_same_metrics(result, run, single)


GAS = tuple(name for name in METRICS if name.startswith("gas_") or name in ("energy_imbalance", "work_per_gas"))


@pytest.mark.parametrize(("further", "bands"), [((), ()), (WARM, ("torque",))], ids=["plain", "thermal, with a trace"])
def test_gas_is_counted_to_the_last_sample_where_the_steps_go_on_after_it(
    further: tuple[str, ...], bands: tuple[str, ...]
) -> None:
    times = ("controller.period=7 ms", "run.step=7 ms", "run.output_interval=20 ms", "run.duration=0.3 s")
    overrides = (*times, "reference.ramp_time=0.2 s", *further)
    columns = {"supply.pressure": np.array([4e5, 4.5e5])}
    result = run_ensemble(load_scenario(TASK, overrides), columns, GAS, bands, 0.1)
    for run in range(2):
        single = alone(TASK, overrides, columns, run)
        assert single.recording.duration == pytest.approx(0.3)
        assert_same_metrics(result, run, single)
        for name in ("gas_supplied", "gas_vented", "gas_leaked", "gas_imbalance"):
            assert result.metrics[name][run] == single.metrics[name].value, name
        for name in bands:
            assert np.allclose(
                result.traces[name][:, run], np.interp(result.times, single.recording.time, single.recording[name])
            )


def test_gas_is_the_same_whatever_else_is_asked_for_where_samples_lie_inside_steps() -> None:
    overrides = ("run.duration=0.048 s", "run.output_interval=0.8 ms", "run.step=0.7 ms")
    base = load_scenario("step-response", overrides)
    columns = {"supply.pressure": np.array([4e5, 4.5e5])}
    alone_asked, with_others = (run_ensemble(base, columns, names) for names in (GAS[:1], (*GAS[:1], *METERS[:1])))
    assert np.array_equal(alone_asked.metrics[GAS[0]], with_others.metrics[GAS[0]])
    assert alone_asked.metrics[GAS[0]][1] == alone("step-response", overrides, columns, 1).metrics[GAS[0]].value


SINE = ("reference.kind=sine", "reference.level=1 N m", "reference.frequency=1 Hz")


@pytest.mark.parametrize(
    "overrides",
    [
        (*SINE, "reference.amplitude=0 N m", "run.duration=0.3 s"),
        (*SINE, "reference.amplitude=2 N m", "reference.phase=-0.0005", "run.duration=0.251 s"),
    ],
    ids=["at rest all the time", "at rest for the last two samples, on both sides of the crest"],
)
def test_a_reference_that_turns_is_looked_at_ahead_for_its_hold(overrides: tuple[str, ...]) -> None:
    base = load_scenario(TASK, overrides)
    columns = {"valve.area": np.array([1e-5, 2e-5])}
    result = run_ensemble(base, columns, METERS)
    assert np.isfinite(result.metrics["rms_error_hold"]).all()
    for run in range(2):
        assert_same_metrics(result, run, alone(TASK, overrides, columns, run))


def test_every_metric_of_the_catalogue_was_seen_in_some_case() -> None:
    results = [metered(name, overrides)[1] for name, overrides in CASES]
    assert {name for one in results for name, values in one.metrics.items() if np.isfinite(values).all()} == set(METERS)


def test_traces_are_the_channels_of_the_recording_at_the_times_asked_for() -> None:
    base = load_scenario("step-response", ("run.duration=0.3 s",))
    areas = np.array([1e-5, 2e-5])
    result = run_ensemble(base, {"valve.area": areas}, METERS, BANDS, 0.02)
    assert result.times == pytest.approx(0.02 * np.arange(16))
    for run, area in enumerate(areas):
        recording = simulate("step-response", ("run.duration=0.3 s", f"valve.area={area} m^2")).recording
        for channel, trace in result.traces.items():
            assert trace[:, run] == pytest.approx(recording[channel][::20], rel=1e-12, abs=1e-15)


def test_shorter_runs_have_no_trace_after_their_end() -> None:
    base = load_scenario("step-response", ("run.duration=0.2 s",))
    result = run_ensemble(base, {"run.duration": np.array([0.1, 0.2])}, METERS, BANDS, 0.05)
    assert np.isnan(result.traces["torque"][:, 0]).tolist() == [False, False, False, True, True]
    assert np.isfinite(result.traces["torque"][:, 1]).all()


def test_a_run_is_the_same_in_any_order_on_any_number_of_threads_and_in_any_chunk() -> None:
    base = load_scenario(TASK, ("run.duration=0.2 s", "reference.ramp_start=0 s", "reference.ramp_time=0.1 s"))
    areas = np.linspace(1e-5, 3e-5, 100)
    whole = run_ensemble(base, {"valve.area": areas}, METERS, threads=1)
    parts = [run_ensemble(base, {"valve.area": part}, METERS, threads=2) for part in (areas[:37], areas[37:])]
    backwards = run_ensemble(base, {"valve.area": areas[::-1]}, METERS, threads=3)
    for name, values in whole.metrics.items():
        assert np.array_equal(values, np.concatenate([part.metrics[name] for part in parts]), equal_nan=True)
        assert np.array_equal(values, backwards.metrics[name][::-1], equal_nan=True)
    assert np.unique(whole.metrics["rms_error_hold"]).size == 100


def test_a_pressure_at_the_start_given_as_a_word_follows_the_pressure_that_it_names() -> None:
    base = load_scenario("step-response", ("run.duration=0.1 s",))
    columns = {"supply.dorsiflexion_pressure": np.array([3e5, 4e5])}
    result = run_ensemble(base, columns, METERS, BANDS, 0.1)
    assert result.traces["pressure_2"][0] == pytest.approx([3e5, 4e5], rel=1e-12)


def test_runs_that_cannot_be_say_so_in_a_line_and_the_others_go_on() -> None:
    base = load_scenario(TASK, ("run.duration=0.1 s",))
    columns = {
        "supply.pressure": np.array([4e5, -1.0, 1e5, np.nan, 4e5, 4e5, 4e5]),
        "motion.angle": np.array([1.3, 1.3, 1.3, 1.3, 9.0, 1.3, 1.3]),
        "run.duration": np.array([0.1, 0.1, 0.1, 0.1, 0.1, 0.1003, 0.1]),
        "actuator.dead_volume_1": np.array([1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-12]),
        "actuator.dead_volume_2": np.array([1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-12]),
    }
    columns["motion.angle"][6] = base.device.actuator.angle_min
    result = run_ensemble(base, columns, METERS)
    assert result.status.tolist() == [COMPLETED, *[REFUSED] * 5, DIVERGED]
    assert np.isfinite(result.metrics["rms_error"]).tolist() == [True, *[False] * 6]
    parts = ("regulated pressure", "at least supply.atmospheric", "a finite number", "stops", "run.", "volumes")
    for run, part in enumerate(parts, 1):
        assert part in result.reasons[run]
        assert "\n" not in result.reasons[run]


@pytest.mark.parametrize(
    ("path", "value", "part"),
    [
        ("valve.area", -1.0, "must be at least"),
        ("run.duration", 1e300, "length of the run"),
        ("motion.angle", 0.0, "between the stops"),
        ("friction.static_torque", 0.0, "at most friction.static_torque"),
        ("sensors.delay", 9.0, "longer than run.duration"),
        ("sensors.seed", np.inf, "a finite number|a whole number"),
        ("sensors.seed", 0.5, "a whole number"),
        ("run.duration", 1e6, "too many|at most|steps"),
    ],
)
def test_an_ensemble_of_which_no_run_can_be_is_a_result_all_the_same(path: str, value: float, part: str) -> None:
    result = run_ensemble(load_scenario(TASK), {path: np.full(3, value)}, METERS, BANDS)
    assert result.status.tolist() == [REFUSED] * 3
    assert result.times.size == 0
    assert all(re.search(part, result.reasons[run]) for run in range(3))


def test_a_run_that_diverges_says_when_and_has_neither_metrics_nor_traces() -> None:
    impossible = load_scenario("step-response", ["actuator.dead_volume_1=1e-12 m^3"])
    result = run_ensemble(impossible, {"valve.area": np.array([1e-5, 2e-5])}, METERS, BANDS, 0.01)
    assert result.status.tolist() == [DIVERGED, DIVERGED]
    assert np.isnan(np.array(list(result.metrics.values()))).all()
    assert np.isnan(result.traces["torque"]).all()
    for run, area in enumerate((1e-5, 2e-5)):
        single = simulate(with_numbers(impossible, {"valve.area": area}))
        assert result.failure_time[run] == single.status.time
        assert "diverged at t =" in result.reasons[run]
        assert "volumes" in result.reasons[run]


@pytest.mark.parametrize(
    ("columns", "meters", "bands", "message"),
    [
        ({"valve.arae": [1e-5]}, [], (), r"'valve\.arae' is not a number.*did you mean 'valve\.area'"),
        ({"controller.kind": [1.0]}, [], (), "is a text and cannot vary"),
        ({}, [], (), "columns of equal length"),
        ({"valve.area": []}, [], (), "columns of equal length"),
        ({"valve.area": [1e-5], "supply.pressure": [4e5, 5e5]}, [], (), "columns of equal length"),
        ({"valve.area": [1e-5], "valves.proportional.area": [1e-5]}, [], (), "are the same value"),
        ({"valve.sonic_conductance": [1e-8]}, [], (), "also give valve.critical_ratio"),
        ({"controller.rate": [1e3], "controller.period": [1e-3]}, [], (), "not both"),
        ({"valve.area": [1e-5]}, [], ("external_torque",), "cannot be traced"),
    ],
)
def test_what_no_single_run_is_to_blame_for_is_one_clear_error(
    columns: dict[str, list[float]], meters: list[str], bands: tuple[str, ...], message: str
) -> None:
    arrays = {path: np.array(values) for path, values in columns.items()}
    with pytest.raises(ScenarioError, match=message) as caught:
        run_ensemble(load_scenario(TASK), arrays, meters, bands)
    assert "\n" not in str(caught.value)
