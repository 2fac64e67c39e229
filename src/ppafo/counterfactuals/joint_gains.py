"""All gains of a law chosen together: rounds of runs about the present ones, on a device and on two that differ."""

from collections.abc import Collection
from itertools import product

import numpy as np

from ppafo.counterfactuals.changes import JOINT_GAINS, Change, gains_together
from ppafo.counterfactuals.table import Rated, excesses
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


def joint_gains(scenario: Scenario, paths: Collection[str] = ()) -> Rated | None:
    """Return the gains of a scenario chosen together, as one change, and what it leaves on the nominal device [-].

    Chosen is the set of which the worst of three devices follows best; the law knows the nominal one. Where no set
    suffices on all three, the one that suits the nominal device is chosen. A walk is judged on its own device alone.

    Arguments:
        scenario: scenario with a law of the package
        paths: gains that may change, such as 'controller.torque_gain'; default: all gains of the law

    Returns:
        the change, whose numbers have three significant digits as they are printed, and the largest tracking number
        over its limit; None without such gains, or where no run has a tracking number
    """
    gains = {path: gain for path, gain in gains_together(scenario).items() if not paths or path in paths}
    if not gains:
        return None
    # What the law believes of its device stays when the device differs.
    believed = {path: number_at(scenario, path) for path in scenario.links if path.startswith("controller.")}
    devices = [
        {**believed, **{path: sizes[device] * number_at(scenario, path) for path, sizes in DEVICES.items()}}
        for device in range(3 if scenario.follows_reference else 1)
    ]
    for _ in range(ROUNDS):
        sets = [
            {path: float(f"{gain * factor:.3g}") for (path, gain), factor in zip(gains.items(), row, strict=True)}
            for row in product(FACTORS, repeat=len(gains))
        ]
        runs = [Change(JOINT_GAINS, "law", {**device, **chosen}, scenario) for chosen in sets for device in devices]
        left = np.reshape(excesses(runs), (-1, len(devices)))
        worst = left.max(axis=1)
        # Sets that suffice on each device come first.
        best = int(np.argmin(np.where(worst <= 1.0, worst, 1.0 + left[:, 0])))
        gains = sets[best]
        if best == 0 or worst[best] <= ENOUGH:
            break
    change = Change(JOINT_GAINS, "law", gains, scenario)
    return (change, float(left[best, 0])) if np.isfinite(left[best, 0]) else None
