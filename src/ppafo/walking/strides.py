"""Stride-by-stride evaluation of a walk: numbers of each stride, mean curves, and the healthy gait beside them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.metrics import METRICS, Metric
from ppafo.metrics.strides import OF_MEAN_STRIDE, PER_STRIDE
from ppafo.signals import CHANNELS, Recording
from ppafo.signals.recording import Floats
from ppafo.simulation.scenario import Scenario
from ppafo.walking.gait_series import ankle_path, gait_timing
from ppafo.walking.motion import walk_of

PHASES = np.linspace(0.0, 1.0, 101)
"""Phases [strides] from heel strike to heel strike at which curves are averaged."""


@dataclass(frozen=True, slots=True)
class Curves:
    """Mean and standard deviation over strides of one channel at ``PHASES``, and its unit."""

    mean: Floats
    deviation: Floats
    unit: str


def stride_starts(strides: Floats) -> NDArray[np.intp]:
    """Return the samples directly after each heel strike, from the cumulative number of strikes."""
    return np.flatnonzero(np.diff(strides) > 0.5) + 1


def per_stride(totals: Mapping[str, Floats], starts: NDArray[np.intp]) -> dict[str, Floats]:
    """Return the numbers of each whole stride [SI], shape (strides,), from cumulative totals at the heel strikes."""
    # A landing on the toes is counted in the step of the strike, of which ``starts`` has the sample after it.
    firsts = {name: starts - 1 if name == "toe_landing" else starts for name in PER_STRIDE}
    return {name: np.diff(totals[quantity.total][firsts[name]]) for name, quantity in PER_STRIDE.items()}


def mean_curves(recording: Recording, starts: NDArray[np.intp]) -> dict[str, Curves]:
    """Return mean and deviation of every channel over the time-normalised strides between heel strikes, in SI units.

    ``starts`` are the samples after the strikes; the result is {} without a stride. Channels that are constant between
    samples, such as the command, have no mean.
    """
    if starts.size < 2:
        return {}
    strikes = recording.time[starts]
    times = strikes[:-1, None] + PHASES * np.diff(strikes)[:, None]
    curves = {}
    for name in recording.names:
        if name not in CHANNELS or not CHANNELS[name].is_held:
            strides = np.interp(times, recording.time, recording[name])
            curves[name] = Curves(strides.mean(axis=0), strides.std(axis=0), recording.unit(name))
    return curves


def metrics_of_walk(values: Mapping[str, float]) -> dict[str, Metric]:
    """Return metrics of a walk from their values [SI] by name, with the units and meanings of the catalogue."""
    metrics = {}
    for name, value in values.items():
        unit, summary = OF_MEAN_STRIDE.get(name) or (METRICS[name].unit, METRICS[name].summary)
        metrics[name] = Metric(value, unit, summary)
    return metrics


def lowest_toes(configuration: Scenario, height: Floats) -> float:
    """Return the lowest toe height [m] in mid-swing, where toes must clear the ground, from heights at ``PHASES``."""
    timing = gait_timing(walk_of(configuration).gait)
    first, last = np.searchsorted(PHASES, [timing.clearance_from, timing.clearance_to])
    return float(height[first:last].min())


def healthy_positive_work(configuration: Scenario) -> float:
    """Return the positive work [J] of the measured ankle moment in one stride; 0 without a measured moment."""
    gait = walk_of(configuration).gait
    if "ankle_moment" not in gait.curves:
        return 0.0
    phases = np.linspace(0.0, 1.0, 2001)
    moment = walk_of(configuration).wearer.body_mass * gait.curve("ankle_moment").values_at(phases)
    angle = gait.ankle_angle.values_at(phases)
    power = np.maximum(moment * np.gradient(angle, phases), 0.0)
    return float(np.trapezoid(power, phases))


def healthy_toe_height(configuration: Scenario) -> Floats:
    """Return the toe height of the healthy gait above the ground [m] at ``PHASES``."""
    gait = walk_of(configuration).gait
    path = ankle_path(gait, gait_timing(gait), walk_of(configuration).wearer)
    return path.toe_height(PHASES % 1.0, gait.shank_angle.values_at(PHASES), gait.ankle_angle.values_at(PHASES))
