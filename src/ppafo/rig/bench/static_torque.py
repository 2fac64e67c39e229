"""Static torque against pressure, rising and falling: the vane presses on a scale and friction holds it back.

The vane creeps and never slips, so friction is at its static limit against the way the pressure goes: the limit of
the rig's law at speed 0, a play operator without inertia, for which no solver is needed.
"""

import numpy as np

from ppafo.constants import PASCALS_PER_PSI
from ppafo.parameters import load_device
from ppafo.rig.bench.readings import read_off
from ppafo.rig.hardware import real_device
from ppafo.rig.request import Outcome, Request
from ppafo.rig.sensors import random_stream

STEP = 5.0 * PASCALS_PER_PSI
HIGHEST = 95.0 * PASCALS_PER_PSI
TURN = 20.0 * PASCALS_PER_PSI
"""Pressure [Pa] by which it goes beyond the highest reading before it falls, so that friction has turned by then."""
REPETITIONS = 3
READING_INTERVAL = 10.0


def record(request: Request) -> Outcome:
    """Return torque on the scale [N m] over pressure difference, three times up and down in steps of 5 psi."""
    device = real_device(load_device(request.parameter_set, request.valve, request.overrides), request.preset)
    rising = np.arange(1, round(HIGHEST / STEP) + 1) * STEP
    once = np.concatenate([rising, rising[::-1]])
    directions = np.repeat([1.0, -1.0], rising.size)
    values = request.preset.values
    scatter = values["friction.scatter"] * random_stream(request.seed, "friction").standard_normal(
        (REPETITIONS, once.size)
    )
    torque = []
    for repetition in scatter:
        pressed = 0.0
        for pressure, direction, deviation in zip(once, directions, repetition, strict=True):
            if direction < 0.0 and pressure == once[rising.size]:
                pressed = device.actuator.torque_constant * (HIGHEST + TURN)
            limit = device.friction.static_torque + values["friction.static_per_pressure"] * pressure
            pressed = on_scale(pressed, device.actuator.torque_constant * pressure, limit * max(0.0, 1.0 + deviation))
            torque.append(pressed)
    true = {
        "torque": np.array(torque),
        "pressure_difference": np.tile(once, REPETITIONS),
        "direction": np.tile(directions, REPETITIONS),
        "repetition": np.repeat(np.arange(1.0, REPETITIONS + 1.0), once.size),
    }
    return read_off("static-torque", request, device, READING_INTERVAL, true, {"turn_beyond": TURN})


def on_scale(before: float, actuator: float, limit: float) -> float:
    """Torque [N m] on a scale that carries what friction within its limit cannot; a scale does not pull."""
    return max(0.0, min(max(before, actuator - limit), actuator + limit))
