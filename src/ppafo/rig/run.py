"""A run on the rig as values: what the solver takes and what it returns."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.reference.derivative import ExactOrifice
from ppafo.engine.run import Run
from ppafo.parameters.device import Device
from ppafo.rig.rows import RigPhysics, RigState
from ppafo.rig.sensors import Sensor

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class RigRun:
    """A run on the rig.

    The device as it truly is, its plain run, the richer physics, sensors and when they are read, play of the valve [-].
    """

    device: Device
    run: Run
    physics: RigPhysics
    line_orifice: ExactOrifice
    initial: RigState
    sensors: dict[str, Sensor]
    sample_times: Floats
    control_period: float
    command_delay: float
    hysteresis: float


@dataclass(slots=True)
class RigSolution:
    """True state (samples, unknowns of ``RigState``), pressures [Pa] and command at each sample; impacts [s]."""

    states: Floats
    pressures: Floats
    commands: Floats
    impacts: list[float] = field(default_factory=list)
    breakaways: list[float] = field(default_factory=list)


def spool_position(position: float, command: float, width: float) -> float:
    """Position [-1, 1] of a spool with play of a whole ``width`` [-] behind a command; it reaches full opening."""
    half = 0.5 * width
    inner = position * (1.0 - half)
    inner = max(command - half, min(command + half, inner))
    return max(-1.0, min(1.0, inner / (1.0 - half)))


def sensor_signals(rig_run: RigRun, state: Floats, pressures: Floats) -> tuple[float, float, float]:
    """Angle [rad] and both pressures [Pa] behind the bandwidth of the sensors, before noise."""
    names = RigState._fields
    slow_angle, slow_pressure = rig_run.physics.angle_follow_rate > 0.0, rig_run.physics.pressure_follow_rate > 0.0
    angle = state[names.index("sensor_angle")] if slow_angle else state[0]
    first = state[names.index("sensor_pressure_1")] if slow_pressure else pressures[0]
    second = state[names.index("sensor_pressure_2")] if slow_pressure else pressures[1]
    return float(angle), float(first), float(second)
