"""Export of the torque of a walk to OpenSim: a table with OpenSim's names, zeros and signs.

OpenSim is not required. Inverse dynamics of OpenSim 4.6 applied the torque by PrescribedController and PrescribedForce
alike, to 1e-4 N m. Static optimisation controls every actuator itself and set the device torque to 0 N m.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ppafo.errors import ScenarioError
from ppafo.gait.recorded.mapping import Side
from ppafo.signals import Channel, Recording
from ppafo.storage.opensim import opensim_bytes, opensim_recording
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WalkResult
from ppafo.walking.strides import PHASES
from ppafo.wording import argument_text

FEW_STRIDES = 0.2
"""Default duration [min] of a walk."""
# Accepted time [s] between two heel strikes of one foot.
SHORTEST_STRIDE = 0.4
LONGEST_STRIDE = 5.0


def opensim_files(result: WalkResult, side: Side, strikes: Sequence[float]) -> dict[str, bytes]:
    """Return the OpenSim files of a walk by name; ``strikes`` [s] are heel strikes at which to place its mean stride.

    Raises ScenarioError for a failed walk, a walk without an assisted stride, and invalid heel strikes.
    """
    torque = device_torque(result, side, strikes)
    named, _ = opensim_recording(result.recording, side, walk_of(result.scenario).wearer.body_mass)
    return {"device_torque.sto": opensim_bytes(torque), "walk.sto": opensim_bytes(named)}


def device_torque(result: WalkResult, side: Side, strikes: Sequence[float]) -> Recording:
    """Return the device torque on OpenSim's ankle [N m], positive in dorsiflexion; see ``opensim_files``."""
    if result.status.time is not None:
        raise ScenarioError(f"{result.scenario.name}: {result.status.message}")
    time = result.recording.time
    torque = result.recording["external_torque"]
    if strikes:
        check_strikes(strikes)
        if "external_torque" not in result.averages:
            raise ScenarioError(
                f"{result.scenario.name}: has no complete assisted stride between two heel "
                "strikes; simulate a longer walk"
            )
        mean = result.averages["external_torque"].mean
        parts = [first + PHASES[:-1] * (last - first) for first, last in pairwise(strikes)]
        time = np.append(np.concatenate(parts), strikes[-1])
        torque = np.append(np.tile(mean[:-1], len(parts)), mean[0])
    # Models of OpenSim call the ankle of a side so.
    name = f"ankle_angle_{side[0]}_device"
    # A difference: with a sign alone a zero would get a minus.
    return Recording(name, time, {name: Channel(0.0 - torque, "N m")}, "simulated")


def check_strikes(strikes: Sequence[float]) -> None:
    """Raise ScenarioError if times [s] are not successive heel strikes of one foot."""
    if len(strikes) < 2:
        raise ScenarioError(f"{argument_text('strikes')}: give two heel strikes or more, such as 0.63,1.86")
    for first, last in pairwise(strikes):
        if not SHORTEST_STRIDE <= last - first <= LONGEST_STRIDE:
            raise ScenarioError(
                f"{argument_text('strikes')}: {first:g} to {last:g} s is not a stride: heel strikes of one foot "
                f"must be {SHORTEST_STRIDE:g} to {LONGEST_STRIDE:g} s apart, in ascending order"
            )
