"""A shipped neuromuscular gait model in the package and against the reference: the first step, and ten strides."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.simulation.scenario import Scenario
from ppafo.walking import load_walk, walk
from ppafo.walking.planning import plan_walk
from ppafo.wearer.published import WEIGHT
from ppafo.wearer.scheme import ReactingWalk
from tests.reference.wearer import COLUMNS, SAMPLE, Device, walk_of_reference

Floats = NDArray[np.float64]

LIGHT = ("controller.kind=off", "actuator.torque_constant=1e-12 m^3")
"""A device that is vented and whose gas cannot turn the ankle; its inertia, damping and friction remain."""

SECONDS = 16.0
STEPS = (0.1, 0.05, 0.025)
"""Steps of the package [ms]: the default, its half and its quarter."""

IN_THE_AIR = 200
"""Samples without load after which a foot strikes the ground; less is a scuff."""

STRIDES = 10
SETTLED = 2
"""Strides left out of the mean."""

JOINTS = ("hip_angle", "knee_angle", "angle", "other_hip_angle", "other_knee_angle", "other_ankle_angle")
ACTIVATIONS = tuple(name for name in COLUMNS if name.endswith("_activation") and not name.startswith("other"))
Columns = dict[str, Floats]


class Strides(NamedTuple):
    """Ten strides of the left leg: strikes (11,) [s], lengths (10,) [m]; and of all but two the means.

    Length [m], time [s], speed [m/s] and share of stance [-].
    """

    strikes: Floats
    lengths: Floats
    length: float
    time: float
    speed: float
    stance: float


class Gap(NamedTuple):
    """Largest differences up to some time: hip [mm], joints [deg], load [body weights], activation [-]."""

    hip: float
    joints: float
    load: float
    activation: float


def light_walk(name: str, step: float, seconds: float = SECONDS, changes: Sequence[str] = ()) -> Scenario:
    """The walk of a wearer with the lightest device, at a step [ms], recorded with each sample of the reflexes."""
    given = [f"wearer.name={name}", *LIGHT, f"run.duration={seconds} s", f"run.step={step} ms", *changes]
    loaded = load_walk("reacting", given)
    return replace(loaded, run=replace(loaded.run, output_interval=SAMPLE))


def by_package(name: str, step: float, seconds: float = SECONDS, changes: Sequence[str] = ()) -> Columns:
    """The walk of the package at a step [ms], from the first sample on; ``changes`` make another wearer of this one."""
    recording = walk(light_walk(name, step, seconds, changes)).recording
    columns: Columns = {column: np.asarray(recording[column]) for column in COLUMNS if column in recording.channels}
    return columns


def device_of(name: str) -> Device:
    """What the device of these walks is for the reference."""
    run = plan_walk(light_walk(name, STEPS[0]))
    assert isinstance(run.walk, ReactingWalk)
    share = run.walk.share
    return Device(inertia=share.inertia, damping=share.viscous_damping, friction=run.plant.dynamic_torque)


def by_reference(name: str, steps: int = 100, seconds: float = SECONDS) -> Columns:
    """The walk of the reference with ``steps`` steps a millisecond."""
    return walk_of_reference(name, seconds, steps, device_of(name)).columns


def strides_of(columns: Columns) -> Strides:
    """The first ten strides, from strike to strike of the left foot."""
    loaded, way = columns["ground_force"] > 0.0, columns["hip_position"]
    landed = np.flatnonzero(loaded[1:] & ~loaded[:-1]) + 1
    at = np.array([place for place in landed if not loaded[max(place - IN_THE_AIR, 0) : place].any()])[: STRIDES + 1]
    first, last = at[SETTLED], at[-1]
    length, time = (way[last] - way[first]) / (at.size - 1 - SETTLED), (last - first) / (at.size - 1 - SETTLED) * SAMPLE
    stance = float(loaded[first:last].mean())
    return Strides(at * SAMPLE, np.diff(way[at]), float(length), float(time), float(length / time), stance)


def gap(seen: Columns, judged: Columns, until: float) -> Gap:
    """Largest differences from the first sample until a time [s]; the package has no force at the start."""
    samples = slice(1, round(until / SAMPLE) + 1)

    def largest(*names: str) -> float:
        return max(float(np.abs(seen[name][samples] - judged[name][samples]).max()) for name in names)

    return Gap(
        hip=1e3 * largest("hip_position", "hip_height"),
        joints=float(np.degrees(largest(*JOINTS))),
        load=largest("ground_force", "other_ground_force") / WEIGHT,
        activation=largest(*ACTIVATIONS),
    )


def parted(seen: Columns, judged: Columns, limit: float) -> float:
    """Time [s] at which a joint is first ``limit`` [deg] apart; infinite where none ever is."""
    count = min(seen["angle"].size, judged["angle"].size)
    apart: Any = np.max([np.abs(seen[name][:count] - judged[name][:count]) for name in JOINTS], axis=0)
    beyond = np.flatnonzero(np.degrees(apart) > limit)
    return float(beyond[0] * SAMPLE) if beyond.size else np.inf
