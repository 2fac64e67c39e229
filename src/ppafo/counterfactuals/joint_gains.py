"""All gains of a law chosen together: rounds of runs about the present ones, on a device and on two that differ."""

from collections.abc import Collection
from itertools import product
from typing import NamedTuple

import numpy as np

from ppafo.counterfactuals.changes import JOINT_GAINS, Change, gains_together
from ppafo.counterfactuals.table import excesses
from ppafo.simulation.numbers import number_at
from ppafo.simulation.scenario import Scenario

FACTORS = (1.0, 0.6, 1.7)
"""Gains of a set divided by those of the round before [-]; first the gains as they are."""
ROUNDS = 8
"""Largest number of rounds, each about the best set of the one before."""
ENOUGH = 0.5
"""Tracking number over its limit [-] below which no further round is made."""
DEVICES = {
    "foot_plate.inertia": (1.0, 0.7, 1.5),
    "supply.pressure": (1.0, 1.0, 0.93),
    "friction.dynamic_torque": (1.0, 1.0, 1.4),
    "friction.static_torque": (1.0, 1.0, 1.4),
}
"""Numbers of the nominal, a light, and a heavy and weak device, divided by the nominal ones [-]."""


class JointGains(NamedTuple):
    """Gains chosen together, and their evidence.

    ``numbers``: gains [SI] by path, of three significant digits, as they are printed
    ``excess``: largest tracking number over its limit of the nominal device [-]; up to 1 the run follows
    ``worst``: the same of the worst of the three devices
    """

    numbers: dict[str, float]
    excess: float
    worst: float


def joint_gains(scenario: Scenario, paths: Collection[str] = ()) -> JointGains | None:
    """Return the gains of a scenario chosen together, of which the worst of three devices follows best; of a walk one.

    The law knows the nominal device. Where no gains suffice on all three, those that suit the nominal one are chosen.

    Arguments:
        scenario: scenario with a law of the package
        paths: gains that may change, such as 'controller.torque_gain'; default: all gains of the law

    Returns:
        the gains and their evidence; None without such gains, or where no run has a tracking number
    """
    centre = {path: gain for path, gain in gains_together(scenario).items() if not paths or path in paths}
    if not centre:
        return None
    # A walk takes longer: it is judged on its own device.
    count = len(FACTORS) if scenario.follows_reference else 1
    known = {path: number_at(scenario, path) for path in scenario.links if path.startswith("controller.")}
    devices = [
        {**known, **{path: sizes[device] * number_at(scenario, path) for path, sizes in DEVICES.items()}}
        for device in range(count)
    ]
    best = JointGains(centre, np.inf, np.inf)
    for _ in range(ROUNDS):
        sets = [
            {
                path: float(f"{gain * factor:.3g}")
                for (path, gain), factor in zip(best.numbers.items(), row, strict=True)
            }
            for row in product(FACTORS, repeat=len(centre))
        ]
        runs = [Change(JOINT_GAINS, "law", {**device, **gains}, scenario) for gains in sets for device in devices]
        left = np.reshape(excesses(runs), (-1, len(devices)))
        worst = left.max(axis=1)
        # Sets that suffice on each device come first.
        chosen = int(np.argmin(np.where(worst <= 1.0, worst, 1.0 + left[:, 0])))
        best = JointGains(sets[chosen], float(left[chosen, 0]), float(worst[chosen]))
        if chosen == 0 or best.worst <= ENOUGH:
            break
    return best if np.isfinite(best.excess) else None
