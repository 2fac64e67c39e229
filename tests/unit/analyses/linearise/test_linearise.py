"""Linear models: slopes of the textbook, steady states that stay, the square law of steps, and what is refused."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

import ppafo
from ppafo.analyses.linearise.model import LinearModel, frequency_panels, steps_of
from ppafo.analyses.linearise.question import linearise
from ppafo.constants import STANDARD_GRAVITY
from ppafo.engine.continuous_time import flows_at
from ppafo.engine.lanes import Floats
from ppafo.engine.run import Run
from ppafo.engine.scheme.thermal_gas import WarmChambers, WarmGas, thermal_flows
from ppafo.errors import ScenarioError
from ppafo.model.plant import PlantParameters, ThermalParameters, openings_of
from ppafo.model.valves.proportional import spool_acceleration
from ppafo.report.finding import text_of
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import RegulatedLine, Scenario, SupplyLine

TASK = "torque-task-proportional"
HOLD = ("reference.level=3 N m",)
WARM = (
    "gas_model.kind=thermal",
    "gas_model.heat_transfer_coefficient=50 W/(m^2 K)",
    "gas_model.wall_area_per_volume=300 1/m",
)
POINTS: dict[str, tuple[str, str | float, tuple[str, ...]]] = {
    "steady": (TASK, "equilibrium", HOLD),
    "steady, dorsiflexion": (TASK, "equilibrium", ("reference.level=-2 N m",)),
    "on the way": (TASK, 0.5, ()),
    "an ankle that is led": ("torque-task-moving-ankle", 0.7, ()),
    "warm gas": (TASK, 0.5, (*HOLD, *WARM)),
    "a slow valve": ("torque-task-slow-valve", 0.5, ()),
    "a sliding vane": ("step-response", 0.1, ("motion.kind=free", "controller.command=0.9")),
    "a foot that turns": ("step-response", 0.1, ("controller.command=0.9",)),
}


def linear(scenario: str | Scenario, at: float | str = "equilibrium", overrides: Sequence[str] = ()) -> LinearModel:
    """A linear model, without what is said of it."""
    return linearise(scenario, at=at, overrides=overrides).found


@pytest.fixture(scope="module")
def steady() -> LinearModel:
    """The torque task where it holds 3 N m."""
    return linear(TASK, overrides=HOLD)


def of_the_textbook(run: Run, way: float | None, at: Mapping[str, float]) -> dict[str, float]:
    """Rates and outputs in plain Python: equations (1) to (3) written out here, flows by the model's own functions."""
    driven = ("supply_pressure", "dorsiflexion_pressure", "external_torque")
    plant: PlantParameters = run.plant._replace(**{name: at[name] for name in driven})  # type: ignore[arg-type]
    moves = {}
    if "valve_opening" in at and hasattr(run.valve, "frequency"):
        dead_band = run.valve.dead_band
        target = math.copysign(max(abs(at["command"]) - dead_band, 0.0) / (1.0 - dead_band), at["command"])
        bend = spool_acceleration(at["valve_opening"], at["valve_rate"], target, run.valve.frequency, 0.7)
        moves = {"valve_opening": at["valve_rate"], "valve_rate": bend}
    openings = openings_of(at["valve_opening"] if moves else at["command"])
    volumes = (
        plant.dead_volume_1 + plant.displacement_per_radian * (at["angle"] - plant.angle_min),
        plant.dead_volume_2 + plant.displacement_per_radian * (plant.angle_max - at["angle"]),
    )
    pressures = (at["pressure_1"], at["pressure_2"])
    flowing = flows_at(plant, openings, *pressures)
    in_1, in_2, leak = flowing
    growth = plant.displacement_per_radian * at["angular_velocity"]
    contents = [pressure * volume / plant.gas_product for pressure, volume in zip(pressures, volumes, strict=True)]
    if isinstance(run.thermal, ThermalParameters):
        warmth = [at[f"temperature_{side}"] / run.thermal.temperature for side in (1, 2)]
        masses = [content / warm for content, warm in zip(contents, warmth, strict=True)]
        at_work = WarmChambers(*volumes, growth, -growth, 0.0, 0.0)
        thermal = thermal_flows(run.thermal, WarmGas(*contents, *masses), at_work, flowing)
        gained, entered = (thermal.mass_1, thermal.mass_2), (thermal.gas.mass_1, thermal.gas.mass_2)
        supplied = thermal.gas.supplied_1 + thermal.gas.supplied_2
        vented = supplied - sum(entered)
        for side in (0, 1):
            change = gained[side] / masses[side] - contents[side] * entered[side] / masses[side] ** 2
            moves[f"temperature_{side + 1}"] = run.thermal.temperature * change
    else:
        gained, supplied = (in_1.total - leak, in_2.total + leak), in_1.from_source + in_2.from_source
        vented = supplied - in_1.total - in_2.total
    moves["pressure_1"] = (plant.gas_product * gained[0] - pressures[0] * growth) / volumes[0]
    moves["pressure_2"] = (plant.gas_product * gained[1] + pressures[1] * growth) / volumes[1]
    torque = plant.torque_constant * (pressures[0] - pressures[1])
    if way:
        slowed = way * plant.dynamic_torque + plant.viscous_damping * at["angular_velocity"]
        moves["angle"] = at["angular_velocity"]
        # On an upright shank at rest the foot's weight has the lever of the sine of the ankle angle.
        weight = 0.0 if run.leg is None else run.leg.load.mass_moment * STANDARD_GRAVITY * math.sin(at["angle"])
        moves["angular_velocity"] = (torque + weight - at["external_torque"] - slowed) / plant.inertia
    outputs = {"torque": torque, "supplied_flow": supplied, "vented_flow": vented}
    return {f"rate of {name}": rate for name, rate in moves.items()} | {**at, **outputs}


def central_difference(function: Callable[[float], Floats], at: float, size: float) -> Floats:
    """Derivative by central differences at three distances, with the first two powers of the distance removed."""
    first, second, third = (
        (function(at + part * size) - function(at - part * size)) / (2.0 * part * size) for part in (4.0, 2.0, 1.0)
    )
    one, other = (4.0 * second - first) / 3.0, (4.0 * third - second) / 3.0
    return (16.0 * other - one) / 15.0


@pytest.mark.parametrize("name", POINTS)
def test_the_jacobians_are_those_of_central_differences(name: str) -> None:
    scenario, time, overrides = POINTS[name]
    model = linear(scenario, time, overrides)
    run = plan_run(model.scenario)
    at = {"external_torque": 0.0, "angular_velocity": 0.0, **model.values}
    if "angle" not in at:
        at["angle"] = run.initial.angle
    way = 1.0 if "angular_velocity" in model.states else None
    rows = [*(f"rate of {name}" for name in model.states), *model.outputs]
    found = np.block([[model.A, model.B], [model.C, model.D]])
    point = of_the_textbook(run, way, at)
    assert model.rates == pytest.approx([point[row] for row in rows[: len(model.states)]], rel=1e-9, abs=1e-4)
    changed = (*model.states, *model.inputs)
    sizes = [_size(item, at) for item in changed]
    # Entries that are nothing beside the others of their row cannot be told from none.
    allowed = 1.0e-8 * np.max(np.abs(found) * sizes, axis=1)
    for column, (item, size) in enumerate(zip(changed, sizes, strict=True)):

        def moved(value: float, name: str = item) -> Floats:
            beside = of_the_textbook(run, way, {**at, name: value})
            return np.array([beside[row] for row in rows])

        expected = central_difference(moved, at[item], 2.0e-4 * size)
        assert (np.abs(found[:, column] - expected) <= allowed / size).all(), item


def _size(name: str, at: Mapping[str, float]) -> float:
    """How much a state or an input may change."""
    sizes = {"pressure": 1.0e5, "temperature": 300.0, "supply": 1.0e5, "dorsiflexion": 1.0e5}
    return abs(at["command"]) if name == "command" else sizes.get(name.partition("_")[0], 0.3)


def test_a_steady_state_is_one_on_the_lanes(steady: LinearModel) -> None:
    still = steady.values
    scenario = ppafo.load_scenario(TASK, ["controller.kind=constant", f"controller.command={still['command']!r}"])
    run = replace(
        scenario,
        initial=replace(scenario.initial, pressure_1=still["pressure_1"], pressure_2=still["pressure_2"]),
        run=replace(scenario.run, duration=1.0),
    )
    recording = ppafo.simulate(run).recording
    assert recording["torque"] == pytest.approx(3.0, rel=1e-9)
    assert recording["pressure_2"] == pytest.approx(still["pressure_2"], rel=1e-9)


def test_the_error_of_a_step_falls_with_the_square_of_its_amplitude_over_three_decades(steady: LinearModel) -> None:
    amplitudes, runs, model = steps_of(steady, (3e-4, 3e-3, 3e-2, 3e-1))
    errors, sizes = (np.max(np.abs(changes), axis=1) for changes in (runs - model, runs))
    assert sizes[-1] / sizes[0] > 900.0
    slopes = np.diff(np.log10(errors)) / np.diff(np.log10(amplitudes))
    assert slopes[:2] == pytest.approx(2.0, abs=0.003)
    assert slopes[2] == pytest.approx(2.0, abs=0.03)


def test_a_valve_at_its_slew_limit_does_not_answer_and_one_that_has_arrived_does() -> None:
    slow = ("valve.slew_limit=0.05 1/s", *HOLD)
    moving, steady = linear(TASK, 0.3, slow), linear(TASK, overrides=slow)
    assert "slew limit" in moving.sides["valve"]
    assert moving.states[-1] == "valve_opening"
    assert moving.rates[-1] == 0.05
    assert steady.states == ("pressure_1", "pressure_2")
    np.testing.assert_allclose(steady.B, linear(TASK, overrides=HOLD).B, rtol=1e-9, atol=1e-3)


@pytest.mark.parametrize(
    ("time", "overrides"), [(0.0, ()), (0.0, ("initial.pressure_1=20 psi_g",)), (0.0, ("initial.pressure_2=20 psi_g",))]
)
def test_at_a_closed_valve_the_model_is_that_of_an_opening_to_chamber_1(
    time: float, overrides: tuple[str, ...]
) -> None:
    model = linear(TASK, time, overrides)
    run = plan_run(model.scenario)
    assert model.edges == {"command": "above"}
    at = {**model.values, "external_torque": 0.0}
    closed, opened = (of_the_textbook(run, None, {**at, "command": command}) for command in (0.0, 1e-3))
    slopes = [1e3 * (opened[row] - closed[row]) for row in ("rate of pressure_1", "rate of pressure_2")]
    assert model.B[:, 0] == pytest.approx(slopes, rel=1e-9, abs=1e-6)


def test_a_time_is_taken_to_the_nearest_step_before_the_first_one_too() -> None:
    times = (1e-9, 4e-4, 6e-4, 3.0, "0.5 s", "600 ms")
    assert [linear(TASK, at).time for at in times] == [0.0, 0.0, 1e-3, 3.0, 0.5, 0.6]


def test_without_a_leak_a_closed_valve_is_steady_and_its_sides_are_told_apart() -> None:
    model = linear(TASK, overrides=(*HOLD, "actuator.leak.area=0 mm^2"))
    assert model.sides["valve"] == "closed"
    assert model.values["command"] == 0.0
    assert model.values["torque"] == pytest.approx(3.0, rel=1e-9)
    assert not model.A.any()
    assert list(model.edges) == ["command"]
    with pytest.raises(ScenarioError, match="has a pole at 0 Hz"):
        model.response(np.array([0.0]))
    assert np.isfinite(model.response(np.array([1.0e-3]))).all()


def test_what_has_no_linear_model_is_refused_in_one_line() -> None:
    for scenario, at, overrides, line in (
        (TASK, 9.0, (), "at='9 s' is outside the run, which lasts 3 s"),
        (TASK, "equilibrium", (), "no equilibrium at 6 N m.*with the valve fully open the actuator reaches 5 N m"),
        (TASK, "Equilibrium", (), "at: 'Equilibrium': must be a time such as .*, or 'equilibrium'"),
        ("torque-task-solenoid", 1.0, (), "valve 'solenoid' switches on and off"),
    ):
        with pytest.raises(ppafo.PpafoError, match=line) as refused:
            linear(scenario, at, overrides)
        assert "\n" not in str(refused.value)
    line = RegulatedLine(1e9, 1e-2, 1e-5)
    fed = replace(ppafo.load_scenario(TASK), supply_line=SupplyLine(line, line))
    with pytest.raises(ScenarioError, match="constant supply pressure; omit"):
        linear(fed, 1.0)


def test_an_energy_balance_slows_what_isothermal_gas_does_at_once() -> None:
    """With walls that take all heat at once the warm model has the poles of the isothermal one, and two fast ones."""
    cold = linear(TASK, overrides=HOLD)
    walls = ("gas_model.kind=thermal", "gas_model.heat_transfer_coefficient=1e6 W/(m^2 K)", WARM[2])
    warm = linear(TASK, overrides=(*HOLD, *walls))
    assert warm.poles[:2] == pytest.approx(cold.poles, rel=1e-3)
    assert abs(warm.poles[2]) > 1e3 * abs(cold.poles[1])


def test_the_system_for_python_control_has_the_same_response(steady: LinearModel) -> None:
    pytest.importorskip("control", reason="needs the extra 'control'")
    system = steady.to_control()
    assert system.state_labels == ["pressure_1", "pressure_2"]
    frequencies = np.array([0.01, 1.0, 50.0])
    theirs = [system["torque", "command"](2.0j * math.pi * frequency) for frequency in frequencies]
    assert steady.response(frequencies) == pytest.approx(np.array(theirs), rel=1e-12)


LEAKING = ("reference.level=3 N m", "reference.kind=constant", "actuator.leak.area=3 mm^2", "run.duration=1.5 s")
LOOPS: dict[str, tuple[str, ...]] = {
    "late readings": ("sensors.delay=2.3 ms",),
    "nothing but sampling": (),
    "slow sensors": ("sensors.delay=2 ms", "sensors.pressure_bandwidth=40 Hz"),
    "a slow spool": (
        *("valve.spool_frequency=20 Hz", "valve.spool_damping_ratio=0.7", "valve.delay=2 ms", "controller.rate=200 Hz"),
    ),
}


@pytest.mark.parametrize("name", LOOPS)
def test_gains_above_the_gain_margin_oscillate_in_the_simulation_and_gains_below_do_not(name: str) -> None:
    def overrides(factor: float) -> list[str]:
        gains = (
            ("proportional_gain=%g 1/(N m)", 0.5),
            ("integral_gain=%g 1/(N m s)", 0.7),
            ("derivative_gain=%g s/(N m)", 0),
        )
        return [*LEAKING, *LOOPS[name], *(f"controller.{text}" % (factor * gain) for text, gain in gains)]

    model = linear(TASK, overrides=overrides(1.0))
    margins = model.margins
    assert margins is not None
    assert margins.gain_margin is not None
    assert margins.is_stable
    point = model.values
    swings = []
    for share in (0.96, 1.04):
        overridden = overrides(share * margins.gain_margin)
        assert linear(TASK, overrides=overridden).margins.is_stable == (share < 1.0)  # type: ignore[union-attr]
        scenario = ppafo.load_scenario(TASK, overridden)
        still = replace(scenario.initial, pressure_1=point["pressure_1"], pressure_2=point["pressure_2"])
        recording = ppafo.simulate(replace(scenario, initial=still)).recording
        swings.append(float(np.ptp(recording["torque"][recording.time > 1.2])))
    assert swings[1] > 5.0 * swings[0]


def test_a_loop_whose_gain_is_low_is_stable_and_has_the_bandwidth_of_its_integral_action() -> None:
    # At the largest torque of the device the flow hardly depends on the command.
    model = linear(TASK, overrides=["reference.level=5 N m"])
    assert model.margins is not None
    assert model.margins.is_stable
    at_rest = float((model.C @ np.linalg.solve(-model.A, model.B))[model.outputs.index("torque"), 0])
    expected = model.scenario.controller.settings["integral_gain"] * at_rest / math.tau
    assert expected < 2e-4
    assert model.margins.gain_crossover == pytest.approx(expected, rel=0.01)
    assert model.margins.bandwidth == pytest.approx(expected, rel=0.01)
    # The crossover is far below the slowest pole, and the axis covers it.
    assert expected < 0.01 * float(np.min(np.abs(model.poles))) / math.tau
    (gain, *_) = frequency_panels(model)
    labels = [mark.label for mark in gain.marks if mark.label]
    assert labels == [f"phase margin at {model.margins.gain_crossover:.3g} Hz", "gain margin at 500 Hz"]
    axes = linearise(TASK, overrides=["reference.level=5 N m"]).plot("frequency-response").axes
    assert all(panel.get_xlim()[0] < 0.2 * expected for panel in axes)


def test_margins_and_crossover_are_those_of_loop_shaping() -> None:
    """The page on linear models finds 79 deg at 5.1 Hz for these gains with python-control, of a continuous loop."""
    gains = ("controller.proportional_gain=0.445", "controller.integral_gain=2.80", "controller.derivative_gain=0")
    finding = linearise(TASK, overrides=[*HOLD, *gains])
    margins = finding.found.margins
    assert margins is not None
    assert math.degrees(margins.phase_margin or 0.0) == pytest.approx(79.2, abs=0.1)
    assert margins.gain_crossover == pytest.approx(5.107, abs=1e-3)
    assert "phase margin       79.2 deg at 5.11 Hz" in text_of(finding)
    assert "no stability margins: controller 'constant' is not a PID" in text_of(linearise("step-response"))
    assert re.search(
        r"gain margin .* at 500 Hz, half the sample rate: the phase reaches -180 deg only there", text_of(finding)
    )
    gain, phase = frequency_panels(finding.found)[:2]
    # The dots stand where the margins are read.
    at = {mark.label: (mark.x[0], mark.y[0]) for mark in gain.marks[2:]}
    assert at["phase margin at 5.11 Hz"] == pytest.approx((margins.gain_crossover, 1.0), rel=1e-3)
    assert at["gain margin at 500 Hz"] == pytest.approx((500.0, 1.0 / margins.gain_margin), rel=1e-3)
    assert phase.marks[2].y[0] - phase.marks[1].y == pytest.approx(79.2, abs=0.1)
    # With dead time the phase goes on for more than a turn beyond the crossover.
    late = frequency_panels(linear("torque-task-slow-valve", "0.5 s"))[1].marks
    assert late[3].y[0] == pytest.approx(late[1].y, abs=0.5)
    assert len(frequency_panels(linear("step-response"))) == 2
    # Of the two integrators of two sealed chambers the loop has one.
    sealed = linear(TASK, overrides=[*HOLD, "actuator.leak.area=0 mm^2"])
    assert sealed.margins.is_stable  # type: ignore[union-attr]


def test_a_pressure_loop_has_an_equilibrium_at_its_reference() -> None:
    for controlled in ("pressure_1", "pressure_2"):
        model = linear("pressure-loop", overrides=[f"reference.of={controlled}"])
        assert model.values[controlled] == pytest.approx(
            3e5 + model.scenario.device.supply.atmospheric_pressure, rel=1e-9
        )
        assert model.margins.is_stable  # type: ignore[union-attr]
