"""Sensors with a bandwidth: each signal of the controller has a first-order lag."""

import math
from typing import Annotated, Any, NamedTuple

from ppafo.model.declaration import Number
from ppafo.model.effects.kind import Effect, PlantSnapshot, State
from ppafo.model.ports import shown_signals
from ppafo.model.sensors import follow, follow_rate


class _SensorRates(NamedTuple):
    """Rates [1/s] of angle sensor and pressure sensors, 2 pi times the bandwidth; 0 for a sensor without lag."""

    angle: float
    pressure: float


class _SensorState(NamedTuple):
    """Readings of the sensors: angle [rad] and absolute pressures [Pa]."""

    angle: float
    pressure_1: float
    pressure_2: float


class _Bandwidths(NamedTuple):
    """Settings of sensors with a lag: a bandwidth [Hz] for each signal."""

    angle_bandwidth: Annotated[
        float, Number("Hz", "bandwidth of the angle sensor, 0 for an instant one", 0.0, 0.0, 1.0e6)
    ]
    pressure_bandwidth: Annotated[
        float, Number("Hz", "bandwidth of the pressure sensors, 0 for instant ones", 0.0, 0.0, 1.0e6)
    ]


def prepare(settings: _Bandwidths, _device: Any) -> _SensorRates:
    """Parameters of sensors with given bandwidths [Hz]: their rates [1/s]."""
    # A first order with a bandwidth f (-3 dB) follows at the rate 2 pi f.
    turn = 2.0 * math.pi
    return _SensorRates(angle=turn * settings.angle_bandwidth, pressure=turn * settings.pressure_bandwidth)


def sensor_readings(
    angle: float, pressure_1: float, pressure_2: float, bandwidth: _SensorRates, bandwidth_state: _SensorState
) -> tuple[float, float, float]:
    """Sensor readings of angle [rad] and absolute pressures [Pa]; a sensor without a bandwidth reads the true value."""
    follows_angle = bandwidth.angle > 0.0
    follows_pressure = bandwidth.pressure > 0.0
    true_angle, true_1, true_2 = shown_signals(angle, pressure_1, pressure_2)
    return (
        bandwidth_state.angle if follows_angle else true_angle,
        bandwidth_state.pressure_1 if follows_pressure else true_1,
        bandwidth_state.pressure_2 if follows_pressure else true_2,
    )


def start(_bandwidth: _SensorRates, now: PlantSnapshot) -> _SensorState:
    """State of the sensors at the start of a run, equal to the true values."""
    return _SensorState(angle=now.angle, pressure_1=now.pressure_1, pressure_2=now.pressure_2)


def advance(
    bandwidth: _SensorRates, bandwidth_state: _SensorState, before: PlantSnapshot, after: PlantSnapshot, step: float
) -> _SensorState:
    """Sensor readings after a step [s] over which the true values are linear in time; exact."""
    pressure = bandwidth.pressure
    return _SensorState(
        angle=follow(bandwidth.angle, step, bandwidth_state.angle, before.angle, after.angle),
        pressure_1=follow(pressure, step, bandwidth_state.pressure_1, before.pressure_1, after.pressure_1),
        pressure_2=follow(pressure, step, bandwidth_state.pressure_2, before.pressure_2, after.pressure_2),
    )


def slopes(bandwidth: _SensorRates, bandwidth_state: _SensorState, now: PlantSnapshot) -> _SensorState:
    """Rates of the sensor readings [rad/s, Pa/s]."""
    return _SensorState(
        angle=follow_rate(bandwidth.angle, bandwidth_state.angle, now.angle),
        pressure_1=follow_rate(bandwidth.pressure, bandwidth_state.pressure_1, now.pressure_1),
        pressure_2=follow_rate(bandwidth.pressure, bandwidth_state.pressure_2, now.pressure_2),
    )


EFFECT = Effect(
    name="bandwidth",
    summary="Sensors with a first-order lag.",
    settings=_Bandwidths,
    parameters=_SensorRates,
    prepare=prepare,
    switch=("angle_bandwidth", "pressure_bandwidth"),
    laws={shown_signals: sensor_readings},
    source="a first-order lag, exact between two instants",
    equation="dy/dt = 2 pi f (x - y)",
    state=State(row=_SensorState, start=start, advance=advance, slopes=slopes),
    section_of_files="sensors",
)
