"""Statements of the paper's text on the step response, tested on a simulated or measured recording.

The text (section 'PPAFO Model Validation', figure 7): pressure 1 rises until the vane breaks away, falls while the vane
moves, then approaches the supply pressure; pressure 2 falls, more slowly while chamber 2 is compressed, then approaches
the atmosphere.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ppafo.analyses.reproduce.claim import Observation, observation
from ppafo.constants import PASCALS_PER_PSI
from ppafo.parameters.device import Supply
from ppafo.signals import Recording
from ppafo.signals.recording import Floats

RESOLUTION = 1.0e-6
"""Smallest fraction of the travel that counts as motion in a simulated recording; measured recordings need more."""
_SMALLEST_TRAVEL = 1.0e-3
_FIRST_ANGLE, _LAST_ANGLE, _SAME_ANGLE = 20.0, 130.0, 0.5
"""First and last angle of figure 7, and the tolerance for the same angle [deg]."""
_CLEAR, _SAME = 0.05, 0.01
"""Fractions of the pressure range: smallest clear change, and tolerance for a level that is reached or kept."""
_NOTABLE_TIME = 2.0e-3
"""Shortest time [s] between a full chamber 1 and breakaway that is noted as a difference."""
_SLOWED = 0.5
"""Largest ratio of the slowest rate of fall to the steepest rates before and after that counts as slowed [-]."""
_LARGEST_RISE = 1.0 * PASCALS_PER_PSI
"""Largest rise [Pa] that still counts as a slowed fall; the text mentions no rise."""
_SETS_OFF = 0.02
"""Fraction of the travel within which pressure 1 peaks, since the chamber still fills while the vane starts."""


@dataclass(frozen=True, slots=True)
class StepEvents:
    """Breakaway and stop of the vane, as sample numbers and as times [s]."""

    breakaway: int
    stop: int
    breakaway_time: float
    stop_time: float


def step_events(recording: Recording, resolution: float = RESOLUTION) -> StepEvents | None:
    """Return breakaway and stop of a vane that moves from rest to rest; None for any other motion.

    Breakaway is the last sample at the initial angle, stop the first sample after which the angle stays at its final
    value, both within ``resolution`` times the travel.
    """
    angle = recording["angle"]
    travel = abs(float(angle[-1] - angle[0]))
    if travel < _SMALLEST_TRAVEL:
        return None
    # The last sample at rest, not the first in motion.
    breakaway = int(np.flatnonzero(np.abs(angle - angle[0]) > resolution * travel)[0]) - 1
    away = np.flatnonzero(np.abs(angle - angle[-1]) > resolution * travel)
    stop = int(away[-1]) + 1
    # Without a sample of rest at either end, and of motion between, nothing can be determined.
    if stop >= len(recording) - 1 or stop - breakaway < 2 or breakaway < 1:
        return None
    return StepEvents(breakaway, stop, float(recording.time[breakaway]), float(recording.time[stop]))


def step_observations(recording: Recording, supply: Supply, events: StepEvents | None) -> list[Observation]:
    """Return the verdict of the recording on each statement of the text.

    No statement holds if the vane does not move.
    """
    if events is None:
        return [observation(identifier, False, "the vane does not move from rest to rest") for identifier in _TESTS]
    step = _Step(recording, supply, events)
    return [observation(identifier, *judge(step)) for identifier, judge in _TESTS.items()]


@dataclass(frozen=True, slots=True)
class _Step:
    """Recording, supply levels and events of a step response, against which the statements of the text are tested."""

    recording: Recording
    supply: Supply
    events: StepEvents

    @property
    def range(self) -> float:
        return self.supply.pressure - self.supply.atmospheric_pressure

    def gauge(self, pressure: float) -> str:
        return f"{(pressure - self.supply.atmospheric_pressure) / PASCALS_PER_PSI:.1f}"

    def milliseconds(self, index: int) -> str:
        return f"{1e3 * self.recording.time[index]:.0f} ms"

    def is_same(self, pressure: float, other: float) -> bool:
        return bool(abs(pressure - other) < _SAME * self.range)

    def only_rises(self, pressure: Floats) -> bool:
        fallen_back = float(np.max(np.maximum.accumulate(pressure) - pressure))
        return bool(pressure[-1] > pressure[0] and fallen_back < _SAME * self.range)


def _turns(step: _Step) -> tuple[bool, str]:
    start, end = (float(np.degrees(step.recording["angle"][index])) for index in (0, -1))
    holds = abs(start - _FIRST_ANGLE) < _SAME_ANGLE and abs(end - _LAST_ANGLE) < _SAME_ANGLE
    duration = 1e3 * (step.events.stop_time - step.events.breakaway_time)
    return holds, f"from {start:.1f} to {end:.1f} deg in {duration:.0f} ms"


def _rises(step: _Step) -> tuple[bool, str, str]:
    breakaway, supply = step.events.breakaway, step.supply
    before = step.recording["pressure_1"][: breakaway + 1]
    holds = step.only_rises(before) and before[-1] - before[0] > _CLEAR * step.range
    fraction = (before[-1] - supply.atmospheric_pressure) / step.range
    has_torque = "torque" in step.recording
    torque = f", at a torque of {step.recording['torque'][breakaway]:.2f} N m" if has_torque else ""
    evidence = (
        f"from {step.gauge(before[0])} to {step.gauge(before[-1])} psig, {100.0 * fraction:.0f} % of the supply; "
        f"the vane breaks away after {step.milliseconds(breakaway)}{torque}"
    )
    # Chamber 1 stands at the supply before the vane leaves: then it is chamber 2 that decides when.
    is_full = before > supply.pressure - _SAME * step.range
    full = int(np.argmax(is_full))
    waits = step.recording.time[breakaway] - step.recording.time[full]
    difference = (
        f"it reaches the supply pressure already after {step.milliseconds(full)} because the volume at the stop is "
        "small, so the falling pressure in chamber 2 starts the vane"
    )
    return bool(holds), evidence, difference if is_full[full] and waits >= _NOTABLE_TIME else ""


def _falls_in_motion(step: _Step) -> tuple[bool, str, str]:
    """Test the fall of pressure 1 during motion, from the peak near breakaway to the minimum.

    In the paper's text the pressure falls until the stop.
    """
    pressure, angle = step.recording["pressure_1"], step.recording["angle"]
    # Chamber 1 still fills while the vane sets off, so that the peak lies behind breakaway.
    gone = np.abs(angle - angle[0]) > _SETS_OFF * np.abs(angle[-1] - angle[0])
    peak = int(np.argmax(pressure[: int(np.argmax(gone)) + 1]))
    lowest = peak + int(np.argmin(pressure[peak : step.events.stop + 1]))
    first, last = float(pressure[peak]), float(pressure[lowest])
    holds = first - last > _CLEAR * step.range
    evidence = f"from {step.gauge(first)} psig down to {step.gauge(last)} psig at {step.milliseconds(lowest)}"
    rise_after_breakaway = first - float(pressure[step.events.breakaway])
    rise_before_stop = float(pressure[step.events.stop]) - last
    differences = []
    if rise_after_breakaway >= _SAME * step.range:
        longer = 1e3 * (step.recording.time[peak] - step.events.breakaway_time)
        differences.append(
            f"after breakaway it still rises for {longer:.0f} ms, by {rise_after_breakaway / PASCALS_PER_PSI:.1f} psi"
        )
    if rise_before_stop >= _SAME * step.range:
        differences.append(f"it rises again by {rise_before_stop / PASCALS_PER_PSI:.1f} psi before the stop")
    return holds, evidence, ", and ".join(differences)


def _to_supply(step: _Step) -> tuple[bool, str]:
    after = step.recording["pressure_1"][step.events.stop :]
    holds = step.only_rises(after) and step.is_same(after[-1], step.supply.pressure)
    return holds, (
        f"from {step.gauge(after[0])} psig at the stop ({step.milliseconds(step.events.stop)}) to "
        f"{step.gauge(after[-1])} psig; the supply is {step.gauge(step.supply.pressure)} psig"
    )


def _falls(step: _Step) -> tuple[bool, str]:
    before = step.recording["pressure_2"][: step.events.breakaway + 1]
    holds = step.is_same(before[0], step.supply.pressure) and bool(np.all(np.diff(before) < 0.0))
    return holds, f"from {step.gauge(before[0])} to {step.gauge(before[-1])} psig until breakaway"


def _slows(step: _Step) -> tuple[bool, str, str]:
    """Test the slower fall of pressure 2 during motion, between two phases of faster fall.

    Gas that only vents would fall at an ever slower rate; gas that is strongly compressed would rise.
    """
    pressure, (start, end) = step.recording["pressure_2"], (step.events.breakaway, step.events.stop)
    rate = -np.diff(pressure) / np.diff(step.recording.time)
    slowest = start + int(np.argmin(rate[start:end]))
    before, after = float(np.max(rate[: slowest + 1])), float(np.max(rate[slowest:]))
    moving = pressure[start : end + 1]
    rise = float(np.max(moving - np.minimum.accumulate(moving)))
    # The rate is that of falling, so that a rise is negative and slower than any fall.
    holds = rate[slowest] <= _SLOWED * min(before, after) and rise <= _LARGEST_RISE
    first, least, last = (value / (1e3 * PASCALS_PER_PSI) for value in (before, rate[slowest], after))
    slowed = f"rises by {-least:.2f} psi/ms" if least < 0.0 else f"falls by {least:.2f} psi/ms"
    difference = f"instead of only falling more slowly it rises by {rise / PASCALS_PER_PSI:.1f} psi"
    evidence = (
        f"falls by {first:.2f} psi/ms at first, {slowed} at {step.milliseconds(slowest)}, falls by up to "
        f"{last:.1f} psi/ms later"
    )
    return bool(holds), evidence, difference if rise >= _SAME * step.range else ""


def _to_atmosphere(step: _Step) -> tuple[bool, str]:
    last = float(step.recording["pressure_2"][-1])
    atmosphere = step.supply.atmospheric_pressure
    return step.is_same(last, atmosphere), f"{(last - atmosphere) / PASCALS_PER_PSI:.2f} psig at the end"


def _builds_up(step: _Step) -> tuple[bool, str]:
    first, last = (
        float(step.recording["pressure_1"][index] - step.recording["pressure_2"][index]) for index in (0, -1)
    )
    # From full pressure one way to full pressure the other way: the range twice.
    holds = abs(last - first - 2.0 * step.range) < 2.0 * _SAME * step.range
    return holds, f"from {first / PASCALS_PER_PSI:.1f} to {last / PASCALS_PER_PSI:.1f} psi"


_TESTS: dict[str, Callable[[_Step], tuple[bool, str] | tuple[bool, str, str]]] = {
    "vane_turns_through_its_range": _turns,
    "pressure_1_rises_until_breakaway": _rises,
    "pressure_1_falls_in_motion": _falls_in_motion,
    "pressure_1_goes_to_supply": _to_supply,
    "pressure_2_falls_from_supply": _falls,
    "pressure_2_slows_in_motion": _slows,
    "pressure_2_goes_to_atmosphere": _to_atmosphere,
    "difference_builds_up": _builds_up,
}
"""Test of each statement of the text, by its entry: returns the verdict, the numbers, and further observations."""
