"""Inverse dynamics of a recorded walk: knee torque in swing, and moment of the wearer's dorsiflexors."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.model.contact import SWING
from ppafo.model.leg import LegParameters, passive_torque, torque_on_knee


def dorsiflexor_moment(leg: LegParameters, record: Mapping[str, Any]) -> Floats:
    """Return the dorsiflexor moment [N m], at least 0, with which the wearer follows the measured ankle angle.

    The moment is the ankle moment of the gait (measured in stance, from equation (11) in swing) minus the moment of
    passive tissue and T_ex. The literature reports the activity of the tibialis anterior instead.
    """
    in_swing = record["walk.contact"] == SWING
    needed = np.where(in_swing, record["walk.now.healthy_torque"], record["walk.now.moment"])
    tissue = passive_torque(leg, record["walk.now.ankle"])
    return np.asarray(np.maximum(tissue + record["walk.external_torque"] - needed, 0.0))


def swing_knee_torque(leg: LegParameters, time: Floats, record: Mapping[str, Any]) -> Floats:
    """Return the knee torque T_1 [N m] of equation (11) for the prescribed swing of shank and foot; 0 in stance.

    In stance the torque depends on the horizontal ground reaction, which a gait file does not contain.
    """
    shank, rate = record["walk.now.shank"], record["state.angular_velocity"]
    foot = shank - record["state.angle"] + 0.5 * np.pi
    directions = np.sin(shank), np.cos(shank), np.sin(foot), np.cos(foot)
    torque = torque_on_knee(
        leg,
        *directions,
        record["walk.now.shank_rate"],
        record["walk.now.shank_acceleration"],
        rate,
        # A walk that fails at once has one sample, and no acceleration is known of it.
        np.gradient(rate, time) if len(time) > 1 else np.zeros_like(rate),
        record["walk.now.knee_forward"],
        record["walk.now.knee_up"],
    )
    return np.where(record["walk.contact"] == SWING, torque, 0.0)
