"""Foot on a shank with prescribed motion, without ground contact: planning and recording of such runs."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.control.catalog import PROFILES
from ppafo.control.kind import ProfileKind
from ppafo.control.profiles import CONSTANT
from ppafo.engine.in_python import over_samples
from ppafo.engine.lanes import Floats
from ppafo.engine.run import LedLeg, Run
from ppafo.model.columns import Problem
from ppafo.model.gait import ShankSeries, foot_in_gait, shank_in_gait
from ppafo.model.leg import FootLoad, ShankNow, torque_on_foot
from ppafo.model.plant import PlantParameters
from ppafo.simulation.motion_kind import Measured
from ppafo.simulation.plan import CarriedLeg, plan_vane
from ppafo.simulation.profiles import profile_parameters
from ppafo.simulation.scenario import Leg, Scenario, vane_motion
from ppafo.simulation.vane_recording import measured, net_torques

GAIT_SHANK = ProfileKind(
    name="gait",
    summary="The shank of a gait, whose ground is left out.",
    quantities=(),
    parameters=ShankSeries,
    value=shank_in_gait,
)
"""Shank with a moving knee, whose value is a ``ShankNow``; with any other profile of the shank, the knee is at rest."""


def shank_over_samples(kind: ProfileKind, shank: Any, times: Floats) -> Any:
    """Shank motion at times [s]: a ``ShankNow`` of columns (samples,), or of single numbers if constant."""
    if kind is GAIT_SHANK:
        return over_samples(shank_in_gait, shank, times)
    angle, rate, acceleration = over_samples(kind.value, shank, times)
    return ShankNow(angle, rate, acceleration, knee_forward=0.0, knee_up=0.0)


def on_gait(leg: Leg, name: str, folder: Path) -> Leg:
    """Return a leg whose shank and knee follow a gait, by name or by file in a folder; DataError if there is none."""
    from ppafo.gait import list_gaits, load_gait, series_of  # other shanks load none

    gait = load_gait(name if name in list_gaits() else folder / name)
    curves = ShankSeries(
        frequency=1.0 / gait.stride_time,
        start=leg.shank.start,
        toe_lever=leg.toe_lever,
        shank=series_of(gait, "shank_angle"),
        ankle=series_of(gait, "ankle_angle"),
        knee_forward=series_of(gait, "knee_forward"),
        knee_up=series_of(gait, "knee_up"),
    )
    return replace(leg, gait=gait.name, curves=curves)


def plan_leg(scenario: Scenario) -> tuple[Run, tuple[Problem, ...]]:
    """Return the run of a vane that moves the foot of a leg, and its possible problems."""
    leg = _leg_of(scenario)
    # Curves were made when the file was read; these two of their numbers may have been changed since, or vary.
    if leg.curves is None:
        kind = PROFILES[leg.shank.kind]
        shank = profile_parameters(leg.shank)
    else:
        kind = GAIT_SHANK
        shank = leg.curves._replace(start=leg.shank.start, toe_lever=leg.toe_lever)

    def put_on(plant: PlantParameters) -> tuple[PlantParameters, LedLeg]:
        foot = leg.foot_mass, leg.foot_mass_centre, leg.foot_inertia
        load = foot_load(plant.inertia, plant.gravity_torque, *foot, leg.shank_length)
        return with_load(plant, load), LedLeg(load, shank)

    return plan_vane(scenario, CarriedLeg(kind, put_on))


def measured_leg(scenario: Scenario, run: Run, times: Floats, rows: Mapping[str, Floats]) -> Measured:
    """Return recording and metrics of a vane that moves the foot of a leg, with channels of the leg if its shank moves.

    If the shank follows a gait, the recording also has the measured foot angle of that gait.
    """
    kind = run.program.shank
    leg = run.leg
    angle = rows["state.angle"]
    channels: dict[str, tuple[Floats, str]] = {}
    # A shank at rest has one angle, which the scenario says.
    if kind is not None and leg is not None and kind is not CONSTANT:
        shank = np.broadcast_to(shank_over_samples(kind, leg.shank, times).angle, times.shape)
        channels["shank_angle"] = (shank, "rad")
        if kind is GAIT_SHANK:
            foot, measured_foot, toe_difference = over_samples(foot_in_gait, leg.shank, times, angle)
            channels["foot_angle"] = (foot, "rad")
            channels["measured_foot_angle"] = (measured_foot, "rad")
            channels["toe_difference"] = (toe_difference, "m")
        else:
            channels["foot_angle"] = (shank - angle + 0.5 * np.pi, "rad")

    def external_torque(torque: Floats) -> Floats:
        # T_ex by the second row of equation (11): what the foot needs beside T_2. A blow at a stop is not in it.
        carried = _leg_of(scenario)
        plant = run.plant
        assert leg is not None, "a run on a leg has a leg"
        assert kind is not None, "a run on a leg has a shank motion"
        # The foot alone: inertia and weight of vane and foot plate are on the other side of T_ex.
        of_foot = carried.foot_mass, carried.foot_mass_centre, carried.foot_inertia
        foot = foot_load(0.0, 0.0, *of_foot, carried.shank_length)
        now = shank_over_samples(kind, leg.shank, times)
        added, needed = (over_samples(torque_on_foot, load, now, angle) for load in (leg.load, foot))
        net = net_torques(run, rows, torque + added)
        # A vane at rest is held by friction or a stop.
        acceleration = np.where(rows["state.angular_velocity"] != 0.0, net / plant.inertia, 0.0)
        return np.asarray(foot.inertia * acceleration - needed + plant.external_torque)

    return measured(scenario, run, times, rows, external_torque, channels)


def _leg_of(scenario: Scenario) -> Leg:
    leg: Leg | None = vane_motion(scenario).leg
    assert leg is not None, "the motion has a leg"
    return leg


def foot_load(
    inertia: float,
    gravity_torque: float,
    foot_mass: float,
    foot_mass_centre: float,
    foot_inertia: float,
    shank_length: float,
) -> FootLoad:
    """Load of foot and foot plate about the ankle: J and S of equation (11) with (1), docs/equations.md.

    Inertia [kg m^2] and largest gravity torque [N m] are those of foot plate and vane; the numbers of foot and shank
    are as in ``Leg``.
    """
    moment = foot_mass * foot_mass_centre
    return FootLoad(
        mass_moment=moment + gravity_torque / STANDARD_GRAVITY,
        inertia=inertia + foot_inertia + moment * foot_mass_centre,
        shank_length=shank_length,
        gravity=STANDARD_GRAVITY,
    )


def with_load(plant: PlantParameters, load: FootLoad) -> PlantParameters:
    """Plant with the total inertia of all moving parts; the leg accounts for the weight of the foot plate."""
    return plant._replace(inertia=load.inertia, gravity_torque=0.0)
