"""Tracking rule for runs of which only metrics are kept: the rule of a recording, as far as its meters tell it."""

from collections.abc import Mapping
from typing import Any, cast

import numpy as np

from ppafo.metrics.metric import Floats
from ppafo.metrics.tracking import SUSTAINED
from ppafo.model.controlled import ANGLE, TORQUE
from ppafo.simulation.profiles import profile_bounds
from ppafo.simulation.scenario import FreeMotion, Scenario
from ppafo.simulation.tracking.rule import (
    LARGEST_PEAK_WALK,
    LARGEST_SHARE,
    LARGEST_SHARE_MOVING,
    LARGEST_SHARE_SWITCHED,
    LARGEST_SHARE_WALK,
    REVERSALS,
    torque_limit,
)

_OF_WALK = ("torque_error", "requested_torque", "peak_torque")
"""Metrics by which a walk is judged, beside the reversals of its command."""


def needed_metrics(scenario: Scenario) -> tuple[str, ...]:
    """Names of the metrics by which metered runs of a scenario are judged; none without a reference."""
    if scenario.controller.is_open_loop:
        return ()
    return (*(_names(scenario.controlled) if scenario.follows_reference else _OF_WALK), REVERSALS)


def _names(controlled: str) -> tuple[str, str, str, str]:
    """Metrics of a task: RMS error of the run and of the hold, error at the end, reversals of the value on the hold."""
    of = "" if controlled == TORQUE else f"{controlled}_"
    return f"rms_{of}error", f"rms_{of}error_hold", f"final_{of}error", f"{of}oscillations_hold"


def following(scenario: Scenario, metrics: Mapping[str, Floats], most_reversals: float, least: float) -> Floats:
    """Verdict on metered runs (runs,): 1 where they follow, 0 where they do not, nan where that is not known.

    Numbers of the scenario may be arrays (runs,); ``metrics`` are its ``needed_metrics`` as far as it offers them, and
    ``most_reversals`` those of the command above which its loop oscillates; ``least`` is the ``smallest_change``.
    """
    runs = next(iter(metrics.values())).size
    none = np.full(runs, np.nan)
    restless = np.nan_to_num(metrics.get(REVERSALS, none)) > most_reversals
    if not scenario.follows_reference:
        error, requested, peak = (metrics.get(name, none) for name in _OF_WALK)
        limit = torque_limit(scenario.controller.settings) or np.inf
        fails = restless | (error > LARGEST_SHARE_WALK * requested) | (peak > LARGEST_PEAK_WALK * limit)
        return np.where(np.isfinite(error) & (requested > 0.0), np.where(fails, 0.0, 1.0), np.nan)
    of_run, on_hold, final, turns = (metrics.get(name, none) for name in _names(scenario.controlled))
    law = scenario.law
    only_switches = law is not None and law.only_switches
    wanted = np.maximum(_wanted(scenario), least)
    is_moved = scenario.controlled != ANGLE and scenario.motion.locked_angle is None
    swings = np.nan_to_num(turns) >= SUSTAINED
    # A hold begins with what is left of the ramp, and its end is one instant: a loop that rests is off in both.
    resting = np.fmin(final, on_hold)
    if only_switches:
        share, most = np.where(swings, on_hold, resting), np.where(swings, LARGEST_SHARE_SWITCHED, LARGEST_SHARE)
        moving = LARGEST_SHARE_SWITCHED
    else:
        share, most = resting, np.full(runs, LARGEST_SHARE_MOVING if is_moved else LARGEST_SHARE)
        moving = LARGEST_SHARE_MOVING
        # The settled part is half of the hold, in which a swing that lasts turns half as often.
        restless = restless | ((np.nan_to_num(turns) >= 2 * SUSTAINED) & (not is_moved))
    has_hold = np.isfinite(on_hold)
    fails = restless | np.where(has_hold, share > most * wanted, of_run > moving * wanted)
    return np.where(np.isfinite(of_run), np.where(fails, 0.0, 1.0), np.nan)


def _wanted(scenario: Scenario) -> Any:
    """Largest change of the reference from where what is controlled starts, an array (runs,) where that varies."""
    lowest, highest = profile_bounds(scenario.reference)
    initial = scenario.initial
    if scenario.controlled == TORQUE:
        start: Any = 0.0
    elif scenario.controlled == ANGLE:
        start = cast(FreeMotion, scenario.motion).angle
    elif scenario.controlled == "pressure_difference":
        start = initial.pressure_1 - initial.pressure_2
    else:
        start = getattr(initial, scenario.controlled)
    return np.maximum(np.abs(highest - start), np.abs(lowest - start))
