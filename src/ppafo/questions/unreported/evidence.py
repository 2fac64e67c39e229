"""What the paper reports of the torque task, with the tolerance within which a completion agrees with it."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.questions.unreported.settings import PROPORTIONAL, SOLENOID

Floats = NDArray[np.float64]
Metrics = Mapping[str, Mapping[str, Floats]]
"""Metrics by valve and name, each (draws,)."""

METRICS = ("rms_error", "gas_supplied", "oscillations_ramp", "oscillations_hold")
FEWEST_REVERSALS = 4.0
"""Fewer reversals on the ramp are an overshoot, not an oscillation, as in the reproduction report."""
MAXIMUM_REVERSALS = 1.0


@dataclass(frozen=True, slots=True)
class Reported:
    """A number of the paper: its value, standard deviation of the tolerance, and how a completion gives it."""

    name: str
    value: float
    tolerance: float
    unit: str
    why: str
    of: Callable[[Metrics], Floats]


@dataclass(frozen=True, slots=True)
class Stated:
    """Something that the text states: a completion that does not show it counts for nothing."""

    name: str
    of: Callable[[Metrics], NDArray[np.bool_]]


def improvement(metrics: Metrics) -> Floats:
    """By how much the proportional valve's RMS error is smaller [%]."""
    return np.asarray(100.0 * (1.0 - metrics[PROPORTIONAL]["rms_error"] / metrics[SOLENOID]["rms_error"]))


def saving(metrics: Metrics) -> Floats:
    """By how much the proportional valve's gas is less [%]; nan where the solenoids take none."""
    used = metrics[SOLENOID]["gas_supplied"]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(used > 0.0, 100.0 * (1.0 - metrics[PROPORTIONAL]["gas_supplied"] / used), np.nan)


def grams(valve: str) -> Callable[[Metrics], Floats]:
    """Gas of one valve [g]."""
    return lambda metrics: GRAMS_PER_KILOGRAM * metrics[valve]["gas_supplied"]


def _oscillates_on_ramp_only(metrics: Metrics) -> NDArray[np.bool_]:
    solenoid = metrics[SOLENOID]
    return (solenoid["oscillations_ramp"] >= FEWEST_REVERSALS) & (solenoid["oscillations_hold"] <= MAXIMUM_REVERSALS)


def _is_quiet(metrics: Metrics) -> NDArray[np.bool_]:
    return metrics[PROPORTIONAL]["oscillations_ramp"] < FEWEST_REVERSALS


IMPROVEMENT = "improvement"
GAS = ("gas, solenoid", "gas, proportional", "saving")

REPORTED: tuple[Reported, ...] = (
    Reported(IMPROVEMENT, 15.0, 2.0, "%", "printed to 1 %; the model's error is of this size", improvement),
    Reported(GAS[0], 1.1, 0.06, "g", "printed to 0.1 g, measured", grams(SOLENOID)),
    Reported(GAS[1], 0.4, 0.03, "g", "printed to 0.1 g, measured", grams(PROPORTIONAL)),
    Reported(GAS[2], 63.0, 2.0, "%", "printed to 1 %; sharper than the two rounded gases it is made of", saving),
)

STATED: tuple[Stated, ...] = (
    Stated("the solenoid pair oscillates on the ramp and not on the hold", _oscillates_on_ramp_only),
    Stated("the proportional valve does not oscillate on the ramp", _is_quiet),
)


def agreement(metrics: Metrics, left_out: Collection[str] = ()) -> Floats:
    """How well each completion (draws,) agrees with what is reported, 0 to 1; ``left_out`` names do not count."""
    logarithm = np.zeros(metrics[SOLENOID]["rms_error"].size)
    for item in REPORTED:
        if item.name in left_out:
            continue
        away = (item.of(metrics) - item.value) / item.tolerance
        logarithm -= 0.5 * away * away
    agrees = np.isfinite(logarithm)
    for stated in STATED:
        agrees &= stated.of(metrics)
    return np.where(agrees, np.exp(np.where(agrees, logarithm, 0.0)), 0.0)
