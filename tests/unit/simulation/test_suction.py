"""A supply below the atmosphere: gas leaves into it, the room fills the chambers, and the torque turns round.

The runs are compared with the equations in continuous time, written here once more and solved by SciPy.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ppafo.errors import PpafoError
from ppafo.parameters.loading import load_device
from ppafo.parameters.reach import supply_for, torque_reach
from ppafo.running import simulate
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Scenario
from ppafo.walking.loading import load_walk

BLADDER = Path(__file__).parents[2] / "actuators" / "measured-bladder.toml"
ROOM, VACUUM = 101325.0, 41325.0
SUCTION = ("supply.pressure=-60 kPa_g", "supply.dorsiflexion_pressure=-60 kPa_g")
FRICTIONLESS = (
    "friction.static_torque=0 N m",
    "friction.dynamic_torque=0 N m",
    "friction.viscous_damping=0.3 N m s/rad",
)
TASK = "torque-task-proportional"
GAS = 8.314 / 28.965e-3 * 293.15
"""R T of the sets [J/kg]."""
CONDUCTANCE = 0.3929e-8 * 1.185 * math.sqrt(1.0e5 / 1.185 / GAS)
"""Sonic conductance of their valve [kg/(s Pa)], of a gas that is not quite the reference air."""

Rates = Callable[[float, np.ndarray[Any, Any]], tuple[float, ...]]


def flow(first: float, second: float) -> float:
    """Flow from the first pressure to the second [kg/s]: ISO 6358 with b = 0.3, linear above a ratio of 0.999."""
    above, ratio = max(first, second), min(first, second) / max(first, second)
    steep = math.sqrt(1.0 - ((0.999 - 0.3) / 0.7) ** 2)
    share = 1.0 if ratio <= 0.3 else math.sqrt(1.0 - ((min(ratio, 0.999) - 0.3) / 0.7) ** 2)
    share = steep * (1.0 - ratio) / 0.001 if ratio > 0.999 else share
    return math.copysign(CONDUCTANCE * above * share, first - second)


def solved(rates: Rates, start: tuple[float, ...], duration: float) -> np.ndarray[Any, Any]:
    """The state at the end of a time [s]."""
    found = solve_ivp(rates, (0.0, duration), start, method="LSODA", rtol=1e-9, atol=1e-13)
    assert found.success
    return np.asarray(found.y[:, -1])


def test_a_cylinder_on_a_vacuum_moves_as_the_equations_say() -> None:
    run = simulate(
        "cylinder-servo",
        (
            *("supply.pressure=-70 kPa_g", "supply.dorsiflexion_pressure=-70 kPa_g", *FRICTIONLESS),
            *("controller.kind=constant", "controller.command=-1", "run.duration=0.15 s", "sensors.delay=0 s"),
        ),
    ).recording
    piston, rod = 0.25 * math.pi * 0.0257**2, 0.25 * math.pi * (0.0257**2 - 0.010**2)

    def pins(angle: float) -> tuple[float, float]:
        between = angle + math.radians(15.0)
        length = math.sqrt(0.025**2 + 0.2**2 - 2.0 * 0.025 * 0.2 * math.cos(between))
        return length, 0.025 * 0.2 * math.sin(between) / length

    shortest, longest = pins(math.radians(20.0))[0], pins(math.radians(130.0))[0]

    def volumes(angle: float) -> tuple[float, float]:
        length, _ = pins(angle)
        return 2.0e-6 + piston * (length - shortest), 2.0e-6 + rod * (longest - length)

    def torque(angle: float, first: float, second: float) -> float:
        return pins(angle)[1] * (piston * (first - ROOM) - rod * (second - ROOM))

    def pressures(state: np.ndarray[Any, Any]) -> tuple[float, float]:
        volume_1, volume_2 = volumes(state[0])
        return state[2] * GAS / volume_1, state[3] * GAS / volume_2

    def rates(_: float, state: np.ndarray[Any, Any]) -> tuple[float, ...]:
        first, second = pressures(state)
        drawn, let_in = flow(second, ROOM - 70.0e3), flow(ROOM, first)
        acceleration = (torque(state[0], first, second) - 0.3 * state[1]) / 8.4e-3
        return state[1], acceleration, let_in, -drawn, drawn, let_in

    angle = math.radians(90.0)
    masses = [ROOM * volume / GAS for volume in volumes(angle)]
    end = solved(rates, (angle, 0.0, *masses, 0.0, 0.0), 0.15)
    first, second = pressures(end)
    # Chamber 2 is evacuated, which raises the torque: the joint goes up, and chamber 1 takes air from the room.
    assert math.degrees(end[0] - angle) > 5.0
    assert run["angle"][-1] == pytest.approx(end[0], abs=2e-4 * math.radians(110.0))
    assert run["pressure_1"][-1] == pytest.approx(first, abs=1e-3 * 70.0e3)
    assert run["pressure_2"][-1] == pytest.approx(second, abs=1e-3 * 70.0e3)
    assert run["torque"][-1] == pytest.approx(torque(end[0], first, second), abs=2e-3)
    assert -run["supplied_mass"][-1] == pytest.approx(end[4], rel=2e-3)
    assert -run["vented_mass"][-1] == pytest.approx(end[5], rel=2e-3)


@pytest.fixture
def suction_bladder(tmp_path: Path) -> Path:
    """A bellows with one chamber that was measured under suction: V = (60 + 40 s)(1 + p/160 kPa) mL, s the share."""
    lines = ["angle [deg],pressure [kPa_g],volume_1 [mL]"]
    for angle, share in ((20, 0.0), (65, 0.5), (110, 1.0)):
        lines += [f"{angle},{gauge},{(60.0 + 40.0 * share) * (1.0 + gauge / 160.0)!r}" for gauge in (-80, -40, 0)]
    (tmp_path / "measured-bladder.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    text = BLADDER.read_text(encoding="utf-8")
    (tmp_path / "bellows.toml").write_text(text.replace("value = 166.8\n", "value = 41.325\n"), encoding="utf-8")
    return tmp_path / "bellows.toml"


def of_bladder(path: Path, *overrides: str) -> Scenario:
    """A scenario in which the valve evacuates it, from the middle of its range."""
    scenario = (path.parent / "release.toml").absolute()
    text = (BLADDER.parent / "step-response-measured-bladder.toml").read_text(encoding="utf-8")
    text = text.replace("measured-bladder.toml", "bellows.toml").replace('"supply"', '"atmosphere"')
    scenario.write_text(text.replace('angle = "20 deg"', 'angle = "80 deg"'), encoding="utf-8")
    return load_scenario(scenario, overrides)


def test_a_bladder_under_suction_turns_as_the_equations_say(suction_bladder: Path) -> None:
    rest = ("actuator.rest_angle=80 deg", "run.duration=0.3 s")
    run = simulate(of_bladder(suction_bladder, *FRICTIONLESS, *rest)).recording
    travel = math.radians(90.0)

    def free(angle: float) -> float:
        return 1e-6 * (60.0 + 40.0 * (angle - math.radians(20.0)) / travel)

    def pressure(angle: float, mass: float) -> float:
        # p (dead + V (1 + g / 160 kPa)) = m R T with p = g + room.
        rigid, give = 10.0e-6 + free(angle), free(angle) / 160.0e3
        a, b, c = give, rigid + give * ROOM, ROOM * rigid - mass * GAS
        return ROOM + (-b + math.sqrt(b * b - 4.0 * a * c)) / (2.0 * a)

    def torque(angle: float, gauge: float) -> float:
        slope = 40.0e-6 / travel
        return slope * (gauge + gauge * gauge / 320.0e3) - 1.5 * (angle - math.radians(80.0))

    def rates(_: float, state: np.ndarray[Any, Any]) -> tuple[float, ...]:
        now = pressure(state[0], state[2])
        drawn = flow(now, VACUUM)
        return state[1], (torque(state[0], now - ROOM) - 0.3 * state[1]) / 8.4e-3, -drawn, drawn

    angle = math.radians(80.0)
    end = solved(rates, (angle, 0.0, ROOM * (10.0e-6 + free(angle)) / GAS, 0.0), 0.3)
    now = pressure(end[0], end[2])
    assert now - ROOM < -50.0e3
    assert run["angle"][-1] == pytest.approx(end[0], abs=2e-4 * travel)
    assert run["pressure_1"][-1] == pytest.approx(now, abs=60.0)
    assert run["torque"][-1] == pytest.approx(torque(end[0], now - ROOM), abs=2e-3)
    assert -run["supplied_mass"][-1] == pytest.approx(end[3], rel=1e-3)


def test_a_table_is_refused_a_vacuum_deeper_than_it_was_measured(suction_bladder: Path) -> None:
    with pytest.raises(PpafoError, match=r"covers pressures down to -80 kPa_g, but the supply has -90"):
        of_bladder(suction_bladder, "supply.pressure=-90 kPa_g")
    with pytest.raises(PpafoError, match=r"covers pressures down to 0 kPa_g, but the supply has -50"):
        load_device(BLADDER, overrides=["supply.pressure=-50 kPa_g"])


@pytest.mark.parametrize("level", [0.5, -0.5])
@pytest.mark.parametrize("law", ["pid", "on_off", "sliding_mode", "damped_proportional"])
def test_a_torque_is_followed_with_suction_in_both_directions(law: str, level: float) -> None:
    run = simulate(TASK, (*SUCTION, f"controller.kind={law}", f"reference.level={level} N m"))
    assert run.recording["torque"][-1] == pytest.approx(level, abs=0.17)
    assert run.metrics["gas_supplied"].value > 0.0
    assert run.metrics["gas_vented"].value < 0.0
    assert abs(run.metrics["gas_imbalance"].value) < 1e-12
    sucked = "pressure_2" if level > 0.0 else "pressure_1"
    assert run.recording[sucked].min() < ROOM - 20.0e3


@pytest.mark.parametrize(("of", "sign"), [("pressure_1", 1.0), ("pressure_2", -1.0), ("pressure_difference", 1.0)])
def test_a_pressure_below_the_atmosphere_is_followed(of: str, sign: float) -> None:
    unit = "kPa_d" if of == "pressure_difference" else "kPa_g"
    levels = (f"reference.of={of}", f"reference.start_level=0 {unit}", f"reference.level=-30 {unit}")
    run = simulate(TASK, (*SUCTION, "controller.kind=on_off", *levels)).recording
    value = run["pressure_1"] - run["pressure_2"] if of == "pressure_difference" else run[of] - ROOM
    assert value[-1] == pytest.approx(-30.0e3, abs=2.5e3)
    assert sign * run["command"][-500:].mean() > -0.5


def test_an_angle_is_held_by_a_cascade_on_suction() -> None:
    run = simulate("cylinder-servo", ("supply.pressure=-80 kPa_g", "reference.amplitude=5 deg"))
    assert math.degrees(run.metrics["rms_angle_error"].value) < 1.0


def test_energy_and_gas_are_balanced_where_gas_leaves_into_the_source() -> None:
    thermal = ("gas_model.kind=thermal", "gas_model.heat_transfer_coefficient=0 W/(m^2 K)")
    found = simulate(TASK, (*SUCTION, "reference.level=0.5 N m", *thermal)).metrics
    assert abs(found["energy_imbalance"].value) < 1e-9
    assert found["lowest_temperature"].value < 290.0


def test_the_reach_of_a_suction_device_is_the_one_of_a_pressure_device_turned_round() -> None:
    suction, pressed = (load_device("ppafo2011", overrides=[f"supply.pressure={level} kPa_g"]) for level in (-60, 60))
    low, high = torque_reach(suction, 1.5)
    assert (low, high) == pytest.approx(torque_reach(pressed, 1.5), rel=1e-12)
    assert low < 0.0 < high
    needed = supply_for(suction, 1.5, 0.5 * high)
    assert needed == pytest.approx(ROOM - 30.0e3)
    assert supply_for(suction, 1.5, 2.0 * high) is None
    # Stated pressures of an ensemble keep to their side of the atmosphere.
    some = run_ensemble(
        load_scenario(TASK, SUCTION), {"supply.pressure": np.array([51325.0, 151325.0])}, ("rms_error",)
    )
    assert np.isfinite(some.metrics["rms_error"]).tolist() == [True, False]


@pytest.mark.parametrize(
    ("overrides", "said"),
    [
        (
            ("supply.pressure=-60 kPa_g", "supply.dorsiflexion_pressure=60 kPa_g"),
            "both supplies must be on the same side of atmospheric pressure",
        ),
        ((*SUCTION, "supply.relieving=false"), "set supply.relieving to true or omit the key"),
        ((*SUCTION, "controller.kind=pid_feedforward"), "set controller.kind to one of on_off, on_off_dead_zone, pid,"),
        ((*SUCTION, "controller.kind=pid_fixed_point"), "set controller.kind to one of on_off, on_off_dead_zone, pid,"),
        ((*SUCTION, "supply_line.plantarflexion.volume=20 mL"), "with its regulators needs a supply above"),
    ],
)
def test_what_makes_no_sense_with_a_vacuum_is_refused_in_one_line(overrides: tuple[str, ...], said: str) -> None:
    with pytest.raises(PpafoError) as caught:
        load_scenario(TASK, overrides)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_walk_on_a_vacuum_is_refused_in_one_line() -> None:
    with pytest.raises(
        PpafoError, match=r"^solenoid: \[device\]: a walk, .* needs a supply above atmospheric pressure"
    ):
        load_walk("solenoid", SUCTION)
