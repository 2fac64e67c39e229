"""Inputs that change while a recording is made: supply pressure, external torque, the angle of a led vane."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from ppafo.engine.replay import AngleSegment, segment_value
from ppafo.parameters import load_device
from ppafo.parameters.device import Device, Orifice
from ppafo.signals import Channel, Recording

Agree = Callable[..., Any]
TIMES = np.arange(0.0, 1.5005, 1e-3)


def choked_or_not(upstream: float, downstream: float, ratio: float) -> float:
    """Mass flow over choked flow from the textbook formulas, with sign; written apart from the package."""
    if upstream < downstream:
        return -choked_or_not(downstream, upstream, ratio) * downstream / upstream
    r = max(downstream / upstream, (2 / (ratio + 1)) ** (ratio / (ratio - 1)))
    choked = (2 / (ratio + 1)) ** ((ratio + 1) / (2 * (ratio - 1)))
    return float(np.sqrt(max(0.0, 2 / (ratio - 1) * (r ** (2 / ratio) - r ** ((ratio + 1) / ratio)))) / choked)


def independent(device: Device, supply: Callable[[float], float], angle: Callable[[float], float]) -> np.ndarray:
    """Both pressures [Pa] at ``TIMES`` with the valve open at 0.1 to chamber 1, from a general solver."""
    from scipy.integrate import solve_ivp

    gas, actuator = device.gas, device.actuator
    heat_ratio, product = gas.heat_capacity_ratio, gas.specific_gas_constant * gas.temperature
    factor = np.sqrt(heat_ratio / product) * (2 / (heat_ratio + 1)) ** ((heat_ratio + 1) / (2 * (heat_ratio - 1)))
    orifice, leak = device.valve.orifice, actuator.leak
    assert isinstance(orifice, Orifice)
    assert isinstance(leak, Orifice)
    valve = 0.1 * orifice.area * orifice.discharge_coefficient * factor
    gap = leak.area * leak.discharge_coefficient * factor

    def pressures(time: float, masses: np.ndarray) -> tuple[float, float]:
        turned = angle(time)
        volume_1 = actuator.dead_volume_1 + actuator.displacement_per_radian * (turned - actuator.angle_min)
        volume_2 = actuator.dead_volume_2 + actuator.displacement_per_radian * (actuator.angle_max - turned)
        return masses[0] * product / volume_1, masses[1] * product / volume_2

    def slopes(time: float, masses: np.ndarray) -> list[float]:
        one, two = pressures(time, masses)
        source = supply(time)
        inflow = max(0.0, valve * source * choked_or_not(source, one, heat_ratio))
        outflow = valve * two * choked_or_not(two, device.supply.atmospheric_pressure, heat_ratio)
        across = gap * one * choked_or_not(one, two, heat_ratio)
        return [inflow - across, across - outflow]

    start = np.array([2e5, 1.5e5])
    per_mass = np.array(pressures(0.0, np.ones(2)))
    solution = solve_ivp(slopes, (0.0, TIMES[-1]), start / per_mass, "LSODA", TIMES, rtol=1e-9, atol=1e-13)
    return np.array([pressures(t, m) for t, m in zip(TIMES, solution.y.T, strict=True)]).T


def recording_of(pressures: np.ndarray, supply: np.ndarray, angle: np.ndarray) -> Recording:
    channels = {
        "angle": (angle, "rad"),
        "pressure_1": (pressures[0], "Pa"),
        "pressure_2": (pressures[1], "Pa"),
        "supply_pressure": (supply, "Pa"),
        "command": (np.full(TIMES.size, 0.1), "-"),
    }
    return Recording("bench", TIMES, {name: Channel(values, unit) for name, (values, unit) in channels.items()})


def test_a_varying_supply_and_a_led_vane_are_followed_as_an_independent_solver_has_them(agree: Agree) -> None:
    device = load_device("ppafo2011")

    def supply(time: float) -> float:
        return 4.0e5 + 8.0e4 * float(np.sin(4.0 * time))

    def angle(time: float) -> float:
        return 1.3 + 0.3 * float(np.sin(5.0 * time))

    pressures = independent(device, supply, angle)
    recording = recording_of(
        pressures, np.array([supply(time) for time in TIMES]), np.array([angle(time) for time in TIMES])
    )
    agreement = agree(recording, device, motion="measured")
    assert agreement.request.inputs == ("command", "supply_pressure", "angle")
    assert {channel.channel for channel in agreement.channels} == {"pressure_1", "pressure_2", "pressure_difference"}
    assert max(channel.fraction for channel in agreement.channels) < 3e-4
    constant = recording.with_channel("supply_pressure", np.full(TIMES.size, 4.5e5), "Pa")
    assert max(channel.fraction for channel in agree(constant, device, motion="measured").channels) > 2e-2


def test_a_held_vane_is_filled_as_an_independent_solver_has_it(agree: Agree) -> None:
    device = load_device("ppafo2011")
    pressures = independent(device, lambda _time: 4.4e5, lambda _time: 1.3)
    recording = recording_of(pressures, np.full(TIMES.size, 4.4e5), np.full(TIMES.size, 1.3))
    without = Recording("bench", TIMES, {n: recording.channels[n] for n in recording.names if n != "angle"})
    agreement = agree(without, device, motion="locked", initial={"angle": 1.3})
    assert {channel.channel for channel in agreement.channels} == {"pressure_1", "pressure_2", "pressure_difference"}
    assert max(channel.fraction for channel in agreement.channels) < 3e-4
    moved = agree(without, device, motion="locked", initial={"angle": 2.2})
    assert max(channel.fraction for channel in moved.channels) > 2e-2


@pytest.mark.parametrize("command", [0.1, -0.1])
def test_a_fixed_volume_without_a_vane_is_filled_and_vented_as_an_independent_solver_has_it(
    agree: Agree, command: float
) -> None:
    from scipy.integrate import solve_ivp

    device, volume = load_device("ppafo2011"), 60e-6
    gas, valve = device.gas, device.valve.orifice
    assert isinstance(valve, Orifice)
    ratio, product = gas.heat_capacity_ratio, gas.specific_gas_constant * gas.temperature
    factor = np.sqrt(ratio / product) * (2 / (ratio + 1)) ** ((ratio + 1) / (2 * (ratio - 1)))
    opening = abs(command) * valve.area * valve.discharge_coefficient * factor

    def slope(_time: float, state: np.ndarray) -> list[float]:
        inside = float(state[0])
        if command > 0.0:
            flow = opening * 4.4e5 * choked_or_not(4.4e5, inside, ratio)
        else:
            flow = -opening * inside * choked_or_not(inside, device.supply.atmospheric_pressure, ratio)
        return [flow * product / volume]

    start = 1.2e5 if command > 0.0 else 4.2e5
    pressure = solve_ivp(slope, (0.0, TIMES[-1]), [start], "LSODA", TIMES, rtol=1e-9, atol=1e-3).y[0]
    channels = {
        "pressure_1": Channel(pressure, "Pa"),
        "supply_pressure": Channel(np.full(TIMES.size, 4.4e5), "Pa"),
        "command": Channel(np.full(TIMES.size, command), "-"),
    }
    agreement = agree(Recording("tank", TIMES, channels), device, volume=volume)
    assert [channel.channel for channel in agreement.channels] == ["pressure_1"]
    assert agreement.channels[0].fraction < 3e-4
    wrong = agree(Recording("tank", TIMES, channels), device, volume=1.1 * volume)
    assert wrong.channels[0].fraction > 5e-3


def test_a_supply_unlike_that_of_the_set_is_followed_and_said(agree: Agree) -> None:
    device = load_device("ppafo2011")
    pressures = independent(device, lambda _time: 6.0e5, lambda _time: 1.3)
    agreement = agree(recording_of(pressures, np.full(TIMES.size, 6.0e5), np.full(TIMES.size, 1.3)), device)
    assert any("1.45 times the gauge pressure of supply.pressure" in remark for remark in agreement.remarks)
    gauge = 6.0e5 - device.supply.atmospheric_pressure
    assert next(item for item in agreement.channels if item.channel == "pressure_1").full_range == gauge


def test_a_recorded_external_torque_moves_the_vane(agree: Agree) -> None:
    device = load_device("ppafo2011", valve=None, overrides=["foot_plate.gravity_torque=0 N m"])
    still = recording_of(np.full((2, TIMES.size), 1.5e5), np.full(TIMES.size, 4e5), np.full(TIMES.size, 1.3))
    still = still.with_channel("command", np.zeros(TIMES.size), "-")
    still = still.with_channel("pressure_1", np.linspace(1.5e5, 1.6e5, TIMES.size), "Pa")
    assert np.ptp(agree(still, device, initial={"pressure_1": 1.5e5}).model["angle"]) == 0.0
    push = still.with_channel("external_torque", np.where(TIMES > 0.5, 3.0, 0.0), "N m")
    agreement = agree(push, device, initial={"pressure_1": 1.5e5})
    assert "external_torque" in agreement.request.inputs
    assert agreement.model["angle"][-1] < 1.2


def test_one_straight_piece_runs_through_its_samples() -> None:
    piece = AngleSegment(2.0, 1.0, 0.5)
    assert segment_value(piece, 2.0) == (1.0, 0.5, 0.0)
    assert segment_value(piece, 4.0)[0] == 2.0


def test_a_recorded_supply_of_chamber_2_is_followed_by_itself(step: tuple[Device, Recording], agree: Agree) -> None:
    device, recording = step
    own, higher = device.supply.dorsiflexion_pressure, device.supply.dorsiflexion_pressure + 1.0e5
    followed = {}
    for name, level in (("own", own), ("higher", higher)):
        given = recording.with_channel("dorsiflexion_pressure", np.full(len(recording), level), "Pa")
        # Towards dorsiflexion, chamber 2 is fed: it ends at its supply.
        turned = given.with_channel("command", -np.abs(recording["command"]), "-")
        followed[name] = agree(turned, device)
    assert all("dorsiflexion_pressure" in agreement.request.inputs for agreement in followed.values())
    ends = [followed[name].model["pressure_2"][-1] for name in ("own", "higher")]
    assert ends[1] - ends[0] == pytest.approx(1.0e5, rel=0.05)
