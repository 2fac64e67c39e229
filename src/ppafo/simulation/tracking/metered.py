"""Tracking rule for runs without a recording, from metrics only."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.metrics.metric import Floats
from ppafo.metrics.settled import SETTLED_METRICS, WALK_PEAKS, SettledPart
from ppafo.model.columns import first
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.tracking.rule import (
    REVERSALS,
    excess_of_part,
    excess_of_walk,
    is_noisy,
    only_switches,
)
from ppafo.simulation.tracking.settled import settled_parts
from ppafo.simulation.tracking.shortfall import available_torque, misses_for_reach, shortfall

_OF_WALK = ("torque_error", "requested_torque", "peak_torque", *WALK_PEAKS)
"""Metrics by which a walk is judged, in addition to the reversals of its command."""


def needed_metrics(scenario: Scenario) -> tuple[str, ...]:
    """Names of the metrics by which runs of a scenario without recording are judged; none without a reference."""
    if scenario.controller.is_open_loop:
        return ()
    return (*(SETTLED_METRICS if scenario.follows_reference else _OF_WALK), REVERSALS)


def command_turning(scenario: Scenario, metrics: Mapping[str, Floats], most_reversals: float) -> Floats:
    """Command reversals of each run divided by their limit (runs,): above 1 the loop oscillates; 0 if unknown.

    Under sensor noise the reversals in the settled part count, if known. Arguments as in
    ``tracking_excess``.
    """
    none = np.zeros(next(iter(metrics.values())).size)
    if not is_noisy(scenario) or "settled_reversals" not in metrics:
        return np.nan_to_num(metrics.get(REVERSALS, none)) / most_reversals
    often = most_reversals / max(float(first(scenario.run.duration)), 1.0)
    return np.nan_to_num(metrics["settled_reversals"]) / often


class TrackingExcess(NamedTuple):
    """Numbers of each run divided by their limits (runs,); nan if unknown.

    With ``largest`` up to 1 the run follows its reference, with ``oscillation`` up to 1 its loop does not oscillate.
    ``beyond_reach`` [N m] is the requested torque that the actuator cannot reach (runs,), which the limits allow in
    part. A run that does not reach it on purpose is ``excused``.
    """

    largest: Floats
    oscillation: Floats
    beyond_reach: Floats
    excused: NDArray[np.bool_]

    @property
    def follows(self) -> Floats:
        """1 for each run (runs,) that follows its reference, 0 for the others, nan if unknown."""
        return np.where(np.isnan(self.largest), np.nan, self.largest <= 1.0)

    @property
    def passes(self) -> Floats:
        """1 for each run (runs,) that follows its reference or misses it on purpose, 0 for others, nan if unknown."""
        return np.where(self.excused, 1.0, self.follows)

    @property
    def oscillates(self) -> Floats:
        """1 for each run (runs,) whose loop oscillates, 0 for the others, nan if unknown."""
        return np.where(np.isnan(self.oscillation), np.nan, self.oscillation > 1.0)


def tracking_excess(
    scenario: Scenario, metrics: Mapping[str, Floats], most_reversals: float, least: float
) -> TrackingExcess:
    """Numbers of each run by which its tracking is judged, divided by their limits.

    Numbers of the scenario may be arrays (runs,). ``metrics`` are the available ``needed_metrics``; ``most_reversals``
    is the number of command reversals above which the loop oscillates; ``least`` is the ``smallest_change``.
    """
    none = np.full(next(iter(metrics.values())).size, np.nan)
    turning = command_turning(scenario, metrics, most_reversals)
    counted = np.isfinite(metrics.get(REVERSALS, none)) & np.isfinite(most_reversals)
    numbers = {name: metrics.get(name, none) for name in needed_metrics(scenario)}
    with np.errstate(divide="ignore", invalid="ignore"):
        if not scenario.follows_reference:
            error, requested, peak = (numbers[name] for name in _OF_WALK[:3])
            limit = np.asarray(scenario.controller.settings.get("largest_torque", 0.0))
            of_walk: dict[str, Any] = {
                "wanted_change": np.nan_to_num(requested, nan=np.inf),
                "rms_error": np.nan_to_num(error),
                "peak": peak,
                "requested_peak": np.nan_to_num(numbers["requested_peak"]),
                "given_peak": np.nan_to_num(numbers["given_peak"]),
            }
            asks = np.isfinite(error)
            if not np.any(asks):
                highest = np.minimum(limit, available_torque(scenario)[1])
                of_walk |= {"requested_peak": highest, "given_peak": np.nan_to_num(numbers["push_off_peak"])}
            settled = SettledPart(**of_walk)
            # A law that requests no torque is judged by the peak alone.
            excess = excess_of_walk(settled, turning, limit)
            known = (asks & (requested > 0.0)) | (~asks & np.isfinite(peak) & (limit > 0.0))
            known_turning = np.where(counted | known, turning, np.nan)
            zeros = np.zeros(none.size)
            return TrackingExcess(np.where(known, excess, np.nan), known_turning, zeros, zeros > 0.0)
        parts = settled_parts(scenario, numbers, least)
        beyond, is_switched = shortfall(scenario), only_switches(scenario, scenario.law)
        found = [excess_of_part(part, is_switched, beyond) for part in parts]
        explained = bool(scenario.beyond_reach) & misses_for_reach(scenario, parts, turning)
    known = np.isfinite(numbers["settled_error"])
    # Without an earlier part its numbers are nan.
    largest = np.fmax.reduce([turning, *(part.largest for part in found)])
    known_verdict = known & ~(parts[0].is_undecided & (largest <= 1.0))
    # A value that does not move is no oscillation, however far it is from the reference, and a cut wave is none either.
    swings = (np.where((each.standstill > 1.0) | (each.reach > 1.0), 0.0, each.oscillation) for each in found)
    beyond = np.where(parts[0].ends_on_ramp, 0.0, beyond) + np.zeros(none.size)
    return TrackingExcess(
        largest=np.where(known_verdict, largest, np.nan),
        oscillation=np.where(counted | known, np.fmax.reduce([turning, *swings]), np.nan),
        beyond_reach=beyond,
        excused=(beyond > 0.0) & (largest > 1.0) & explained,
    )
