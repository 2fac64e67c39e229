"""Pressure regulators against equations of their own, solved by SciPy, and against the step of a data sheet."""

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import ppafo
from ppafo.counterfactuals import verdict_of
from ppafo.engine.scheme.pneumatics import GAMMA
from ppafo.errors import ParameterError, ScenarioError
from ppafo.metrics.settled import SettledPart
from ppafo.model.catalog import ACTUATORS
from ppafo.model.valves.kind import VENT
from ppafo.model.valves.pressure_regulator import MODEL, STAGE, RegulatorSettings
from ppafo.parameters.plant import plant_parameters
from ppafo.parameters.reach import static_torque, supply_for, torque_reach
from ppafo.simulation.loading import scenario_from_dict
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import simulate
from ppafo.simulation.tracking.case import Case
from ppafo.simulation.tracking.rule import available_torque

LOCKED = {"kind": "locked", "angle": "75 deg"}
CONSTANT = {"kind": "constant", "command": 0.6, "rate": "1 kHz"}
EXACT = ("valve.hysteresis=0", "valve.resolution=0")
SWINGING = {
    "kind": "prescribed",
    "profile": {"kind": "sine", "level": "75 deg", "amplitude": "20 deg", "frequency": "4 Hz"},
}
FREE = {"kind": "free", "angle": "60 deg"}


def regulated(
    motion: dict[str, Any], law: dict[str, Any], reference: dict[str, Any] | None = None, *changes: str, **run: str
) -> Scenario:
    """A task of the cylinder with regulators."""
    document = {
        "schema_version": 1,
        "name": "regulated",
        "device": {"set": "cylinder-lever", "valve": "pressure_regulator", "overrides": list(changes)},
        "run": {"duration": "0.5 s", "output_interval": "1 ms", **run},
        "motion": motion,
        "controller": {"rate": "1 kHz", **law},
    }
    return scenario_from_dict(document if reference is None else {**document, "reference": reference})


def flow(upstream: float, downstream: float, conductance: float, ratio: float) -> float:
    """Mass flow [kg/s] of ISO 6358, linear from a ratio of 0.999 on."""
    high = max(upstream, downstream)
    low = min(upstream, downstream)
    share = 1.0 if low / high <= ratio else math.sqrt(1.0 - ((min(low / high, 0.999) - ratio) / (1.0 - ratio)) ** 2)
    share *= min(1.0, (1.0 - low / high) / 0.001)
    return math.copysign(conductance * high * share, upstream - downstream)


def solved(scenario: Scenario, command: float, times: np.ndarray) -> np.ndarray:
    """Pressures [Pa] over time of both chambers, by an equation of this test: set pressure, opening, flow, gas law."""
    device = scenario.device
    plant = plant_parameters(scenario.device)
    valve = device.valve
    chambers = ACTUATORS[device.actuator.kind].model.chambers
    span = valve.highest_pressure - valve.lowest_pressure
    constant = valve.response_time / math.log(9.0)
    moves = "amplitude" in getattr(scenario.motion.profile, "settings", {})

    def volumes(time: float) -> tuple[float, float]:
        angle = math.radians(75.0 + (20.0 * math.sin(8.0 * math.pi * time) if moves else 0.0))
        return chambers(plant, angle, 1e5, 1e5)[:2]

    def rates(time: float, pressures: np.ndarray) -> list[float]:
        found = []
        late = max(time - valve.delay, 0.0)
        begun = 1.0 - math.exp(-late / constant) if constant > 0.0 else 1.0
        now = volumes(time)
        soon = volumes(time + 1e-6)
        for place, (share, supply) in enumerate(((max(command, 0.0), 5e5), (max(-command, 0.0), 5e5))):
            off = (valve.lowest_pressure + span * share * begun - pressures[place]) / (valve.band * span)
            source = supply + 101325.0
            room = 101325.0
            gained = min(max(off, 0.0), 1.0) * max(flow(source, pressures[place], plant.valve_conductance, 0.3), 0.0)
            gained += min(max(-off, 0.0), 1.0) * flow(room, pressures[place], plant.valve_conductance, 0.3)
            growth = (soon[place] - now[place]) / 1e-6
            found.append((plant.gas_product * gained - pressures[place] * growth) / now[place])
        return found

    pressures = np.full((2, 1), 101325.0)
    parts = []
    # The command arrives between two parts.
    for begin, end in pairwise(dict.fromkeys((0.0, valve.delay, times[-1]))):
        here = np.append(times[(times >= begin) & (times < end)], end)
        parts.append(
            solve_ivp(rates, (begin, end), pressures[:, -1], "LSODA", here, rtol=1e-9, atol=1e-2, max_step=1e-3)
        )
        pressures = parts[-1].y
    return np.hstack([*(part.y[:, :-1] for part in parts), pressures[:, -1:]])


@pytest.mark.parametrize(
    ("motion", "command", "changes"),
    [
        (LOCKED, 0.6, ()),
        (LOCKED, -0.9, ("valve.response_time=5 ms", "valve.delay=7 ms")),
        (LOCKED, 0.6, ("valve.response_time=0 s", "valve.band=0.001")),
        (LOCKED, 1.0, ("valve.response_time=30 ms", "valve.band=0.2", "valve.sonic_conductance=0.01 l/(s bar)")),
        (SWINGING, 0.5, ("valve.response_time=20 ms",)),
    ],
)
def test_the_pressures_are_those_of_an_equation_of_its_own(
    motion: dict[str, Any], command: float, changes: tuple[str, ...]
) -> None:
    scenario = regulated(motion, {**CONSTANT, "command": command}, None, *EXACT, *changes)
    recording = simulate(scenario).recording
    expected = solved(scenario, command, recording.time)
    assert np.abs(recording["pressure_1"] - expected[0]).max() < 1e-4 * 5e5
    assert np.abs(recording["pressure_2"] - expected[1]).max() < 1e-4 * 5e5
    assert pytest.approx(1.0 / (1.0 / GAMMA - 1.0)) == STAGE


def test_a_step_takes_the_time_of_the_data_sheet() -> None:
    recording = simulate(regulated(LOCKED, CONSTANT, None, *EXACT, "valve.sonic_conductance=3 l/(s bar)")).recording
    share = (recording["pressure_1"] - 106325.0) / (0.6 * 4.95e5)
    first, last = (float(np.interp(level, share, recording.time)) for level in (0.1, 0.9))
    assert last - first == pytest.approx(0.1, rel=0.01)


def test_hysteresis_and_resolution_are_those_of_the_settings_and_a_vent_sets_the_lowest_pressure() -> None:
    valve = MODEL.prepare(RegulatorSettings(1.0e5, 6.0e5, 0.0, 0.0, 0.01, 0.02, 0.01))

    def course(commands: list[float]) -> list[float]:
        state = MODEL.state()
        found = []
        for command in commands:
            shown, state = MODEL.advance(valve, state, command, 0.0, 1e-3)
            found.append(shown.second_1)
        return found

    rising = np.linspace(0.0, 1.0, 501).tolist()
    falling = np.linspace(1.0, 0.0, 501).tolist()
    pressures = course([*rising, *falling])
    widths = np.array(pressures[1001:501:-1]) - np.array(pressures[:500])
    assert np.max(widths) == pytest.approx(0.02 * 5e5, abs=0.01 * 5e5)
    assert {round(abs(after - before)) for before, after in pairwise(pressures)} <= {0, 5000}
    assert course([0.5, VENT])[-1] == pytest.approx(1.0e5, abs=0.011 * 5e5)


@pytest.mark.parametrize("response", [0, 5, 100, 400])
def test_default_gains_follow_the_regulator(response: int) -> None:
    changes = (f"valve.response_time={response} ms", "valve.delay=4 ms")
    torque = {"kind": "ramp_hold", "level": "2 N m", "ramp_time": "0.3 s"}
    pressure = {"of": "pressure_2", "kind": "ramp_hold", "start_level": "0 bar_g", "level": "3 bar_g"}
    angle = {"of": "angle", "kind": "ramp_hold", "start_level": "60 deg", "level": "80 deg", "ramp_time": "0.5 s"}
    for motion, law, reference in (
        (LOCKED, "pid", torque),
        (LOCKED, "sliding_mode", torque),
        (LOCKED, "pid", {**pressure, "ramp_time": "0.3 s"}),
        (FREE, "cascade", angle),
    ):
        result = simulate(regulated(motion, {"kind": law}, reference, *changes, duration="2.5 s"))
        assert not result.tracking.fails, result.tracking.sentence


@pytest.mark.parametrize(
    ("changes", "share"),
    [
        (("valve.hysteresis=0.2",), 0.0),
        (("valve.resolution=0.5",), 0.0),
        (("valve.response_time=5 s",), 0.0),
        (("valve.highest_pressure=9 bar_g", "valve.hysteresis=0"), 0.0),
        (("valve.sonic_conductance=0.001 l/(s bar)",), 1.0),
    ],
)
def test_a_regulator_is_fully_open_where_it_passes_the_flow_of_an_open_one(
    changes: tuple[str, ...], share: float
) -> None:
    scenario = regulated(LOCKED, {**CONSTANT, "command": 0.7}, None, *changes, duration="2 s")
    recording = simulate(scenario).recording
    is_open = Case(scenario, recording, SettledPart(1.0), None).is_fully_open
    assert np.mean(is_open[recording.time > 0.5]) == pytest.approx(share, abs=0.01)


WAVE = {"of": "angle", "kind": "sine", "level": "90 deg", "amplitude": "10 deg", "frequency": "2 Hz"}


@pytest.mark.parametrize(
    ("law", "level", "changes", "number"),
    [
        ({"kind": "pid"}, "2 N m", ("response_time=0.2 s", "hysteresis=0.5", "resolution=0"), "hysteresis = 0.5"),
        (
            {"kind": "pid", "rate": "200 Hz"},
            "0.5 N m",
            ("response_time=0.2 s", "hysteresis=0.02", "resolution=0.2"),
            "resolution = 0.2",
        ),
        ({"kind": "cascade"}, "", ("response_time=4 s",), "response_time = 4 s"),
    ],
)
def test_a_verdict_names_the_number_of_the_regulator_that_is_at_fault(
    law: dict[str, Any], level: str, changes: tuple[str, ...], number: str
) -> None:
    torque = {"kind": "ramp_hold", "level": level, "ramp_time": "0.5 s"}
    motion, reference = (LOCKED, torque) if level else ({**FREE, "angle": "90 deg"}, WAVE)
    overrides = (f"valve.{each}" for each in ("sonic_conductance=1 l/(s bar)", *changes))
    scenario = regulated(motion, law, reference, *overrides, duration="3 s")
    verdict = verdict_of(simulate(scenario))
    assert f"without `valve.{number}`" in verdict.cause
    assert "it follows, as a further run shows" in verdict.tried


@pytest.mark.parametrize(
    ("law", "change", "said"),
    [
        ("pid_feedforward", "valve.delay=1 ms", "asks for a flow"),
        ("pid", "valve.highest_pressure=0.01 bar_g", "lowest_pressure = 0.05 bar_g must be below"),
        ("pid", "valve.lowest_pressure=-0.3 bar_g", "lowest_pressure = -0.3 bar_g must be at least supply.atmos"),
        ("pid", "supply.pressure=-0.3 bar_g", "needs a supply above atmospheric pressure"),
    ],
)
def test_what_regulators_cannot_do_is_refused(law: str, change: str, said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        regulated(LOCKED, {"kind": law}, {"kind": "constant", "level": "1 N m"}, change)


def test_questions_that_regulators_have_no_answer_to_are_refused() -> None:
    scenario = regulated(LOCKED, {"kind": "pid"}, {"kind": "constant", "level": "1 N m"})
    with pytest.raises(ScenarioError, match="regulates pressures, of which there is no linear model"):
        ppafo.linearise(scenario)
    with pytest.raises(ParameterError, match="fixed steps of a walk do not resolve"):
        ppafo.load_walk("proportional", ["device.set=cylinder-lever", "device.valve=pressure_regulator"])


@pytest.mark.long
def test_the_response_time_is_fitted_to_a_step(tmp_path: Path) -> None:
    recording = simulate(regulated(LOCKED, CONSTANT, None, "valve.response_time=70 ms")).recording
    noise = np.random.default_rng(1).normal(0.0, 500.0, recording.time.size)
    pressures = recording["pressure_1"] + noise, recording["pressure_2"]
    rows = np.column_stack([recording.time, recording["command"], *pressures])
    head = "time [s],command [-],pressure_1 [Pa_a],pressure_2 [Pa_a]"
    np.savetxt(tmp_path / "step.csv", rows, delimiter=",", header=head, comments="")
    problem = tmp_path / "problem.toml"
    problem.write_text(
        'schema_version = 1\nname = "fitted"\n[device]\nset = "cylinder-lever"\nvalve = "pressure_regulator"\n'
        '[trajectory]\n[[trajectory.parameters]]\npath = "valve.response_time"\n[[trajectory.experiments]]\n'
        'label = "step"\nrecording = "step.csv"\nlocked = "75 deg"\nchannels = ["pressure_1"]\n',
        encoding="utf-8",
    )
    estimate = ppafo.identify(problem).found.estimates[0]
    assert estimate.verdict == "identified"
    assert estimate.low <= 0.07 <= estimate.high
    assert estimate.value == pytest.approx(0.07, rel=0.02)


def test_the_torque_reaches_as_far_as_the_set_pressures() -> None:
    changes = ("supply.pressure=9 bar_g", "supply.dorsiflexion_pressure=9 bar_g", "valve.lowest_pressure=3 bar_g")
    scenario = regulated(LOCKED, CONSTANT, {"kind": "constant", "level": "1 N m"}, *changes)
    angle = math.radians(75.0)
    vented = 1.01325e5
    valve = scenario.device.valve
    torque = static_torque(scenario.device)
    highest = torque(angle, valve.highest_pressure, vented + 3.0e5)
    assert torque_reach(scenario.device, angle)[1] == pytest.approx(highest)
    assert available_torque(scenario)[1] == pytest.approx(highest)
    assert supply_for(scenario.device, angle, 1.01 * highest) is None


def test_a_pressure_below_the_lowest_set_one_is_the_cause_where_it_lasts() -> None:
    for start, level, follows in (("0 bar_g", "2 bar_g", True), ("2 bar_g", "0.02 bar_g", False)):
        reference = {"of": "pressure_1", "kind": "ramp_hold", "start_level": start, "level": level}
        lowest = "valve.lowest_pressure=0.4 bar_g"
        scenario = regulated(LOCKED, {"kind": "pid"}, {**reference, "ramp_time": "1 s"}, lowest, duration="3 s")
        verdict = verdict_of(simulate(scenario))
        assert verdict.follows is follows
    assert "without `valve.lowest_pressure = 0.4 bar_g`" in verdict.cause
    assert verdict.mended[0].startswith("valve.lowest_pressure=")
