"""Unit mistakes that explain estimates far from the values of the parameter set, or readings far from the model."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.result import BenchResult
from ppafo.identification.estimate import WRONG_UNIT, Estimate
from ppafo.identification.source import RecordingSource
from ppafo.signals.recording import Recording
from ppafo.simulation.recorded.misread_units import misread_units
from ppafo.units import percentage, split_pressure_kind

FAR_FROM_SET = 5.0
"""Ratio to the value of the set above which a wrong unit is suspected: psi read as kPa makes 6.89."""
_NEAR = 1.5
"""Largest ratio [-] of an estimate, divided by the value of the set, to the factor of a unit mistake."""
_REACHED = 0.1
"""Relative difference [-] of pressures that are equal, such as a full chamber and its supply."""
_LARGE_SCATTER, _SMOOTHER = 0.01, 5.0
"""Scatter of readings from which another unit is tried, and its ratio to the scatter with that unit to report it [-].

The zero of a gauge pressure and the choked flow make a law of the absolute pressure fit one unit only.
"""


_CORRECTION = "correct the unit in the header or the column map"


def _mistake_text(names: Sequence[str], mistake: str, factor: float) -> str:
    """Return the unit mistake of channels in words, with its factor above 1."""
    verb = "seem" if len(names) > 1 else "seems"
    return f"{' and '.join(names)} {verb} to be {mistake}, a factor of {max(factor, 1.0 / factor):.4g}"


def with_wrong_units(
    estimates: tuple[Estimate, ...],
    known: Mapping[str, float | None],
    recordings: Sequence[Recording],
    supply: float = math.nan,
) -> tuple[Estimate, ...]:
    """Return the estimates, with the verdict of a wrong unit where a unit mistake in a recording explains the values.

    A mistake explains them if every value far from the one ``known`` of the set depends on the unit, and every value
    that depends on the unit is off by nearly its factor: a larger device, or one worn part, is no mistake. No angle of
    a joint turns round, and no chamber exceeds its ``supply`` [Pa gauge], NaN if unknown.
    """
    usable = [estimate for estimate in estimates if estimate.is_usable]
    ratios = {
        estimate.path: abs(math.log(estimate.value / reference))
        for estimate in usable
        if estimate.value > 0.0 and (reference := known.get(estimate.path) or 0.0) > 0.0
    }
    far = {path for path, ratio in ratios.items() if ratio > math.log(FAR_FROM_SET)}
    channels = {name: channel for recording in recordings for name, channel in recording.channels.items()}
    # Beside a measured torque or force a pressure scales no torque; in a motion it drives everything with mass.
    has_load = bool({"torque", "force"} & channels.keys())
    dependent: dict[str, set[str]] = {"Pa": set(), "N m": set(), "rad": set()}
    for path, unit in ((estimate.path, estimate.unit) for estimate in usable):
        has_mass = "N" in unit or "kg" in unit
        # A torque constant, in N m/Pa, is stated in m^3.
        if "Pa" in unit or unit == "m^3" or "mass_flow" in channels or (has_mass and not has_load):
            dependent["Pa"].add(path)
        if has_mass or "torque" in channels:
            dependent["N m"].add(path)
        if unit == "N m":
            dependent["rad"].add(path)
    nearest, explained = math.log(_NEAR), estimates
    for si_unit in dict.fromkeys(channel.unit.removesuffix("_d") for channel in channels.values()) if far else ():
        names = [name for name, channel in channels.items() if channel.unit.removesuffix("_d") == si_unit]
        acted_on = dependent.get(si_unit, set())
        mistakes = misread_units(si_unit, [channels[name].stated for name in names]) if far <= acted_on else []
        swings = [float(np.ptp(recording[name])) for recording in recordings for name in names if name in recording]
        for mistake, factor in mistakes:
            swing = max(swings)
            turns_round = si_unit == "rad" and swing / factor > math.tau
            # A chamber filled to its supply, as read, has its own unit.
            is_filled = si_unit == "Pa" and abs(swing / supply - 1.0) < _REACHED
            if turns_round or is_filled or (si_unit == "Pa" and swing / factor > (1.0 + _REACHED) * supply):
                continue
            size = abs(math.log(factor))
            distance = max(abs(ratios[path] - size) for path in acted_on & ratios.keys())
            if distance < nearest:
                text = (
                    f"{_mistake_text(names, mistake, factor)}; {_CORRECTION}, or give the value that you expect in "
                    "device.overrides"
                )
                nearest = distance
                explained = tuple(
                    replace(item, verdict=WRONG_UNIT, explanation=text) if item.path in acted_on else item
                    for item in estimates
                )
    return explained


def with_smoothing_unit(
    result: BenchResult,
    sources: tuple[RecordingSource, ...],
    atmosphere: float,
    run: Callable[[tuple[RecordingSource, ...]], BenchResult],
) -> BenchResult:
    """Return the result, with the verdict of a wrong unit where the readings fit the model far better in another unit.

    ``atmosphere`` [Pa absolute] is the zero of gauge pressures; ``run`` repeats the procedure with other recordings.
    """
    if not result.scatter > _LARGE_SCATTER:
        return result
    smoothest, found = result.scatter / _SMOOTHER, result
    channels = {name: channel for source in sources for name, channel in source.recording.channels.items()}
    pressures = tuple(name for name, channel in channels.items() if channel.unit == "Pa")
    # All absolute pressures together, then each one.
    groups = dict.fromkeys((pressures, *((name,) for name in pressures)))
    stated = {group: [channels[name].stated for name in group] for group in groups}
    for names, (mistake, factor) in ((group, each) for group in groups for each in misread_units("Pa", stated[group])):
        again = [replace(source, recording=_in_unit(source.recording, names, factor, atmosphere)) for source in sources]
        try:
            scatter = run(tuple(again)).scatter
        except IdentificationError:
            continue
        if scatter < smoothest:
            smoothest = scatter
            text = (
                f"{_mistake_text(names, mistake, factor)}; the scatter would be {percentage(scatter, 2)} of the "
                f"largest reading instead of {percentage(result.scatter, 2)}; {_CORRECTION}"
            )
            doubted = (replace(estimate, verdict=WRONG_UNIT, explanation=text) for estimate in result.estimates)
            found = replace(result, estimates=tuple(doubted))
    return found


def _in_unit(recording: Recording, names: Iterable[str], factor: float, atmosphere: float) -> Recording:
    """Return a recording with some absolute pressures divided by a factor, from the zero of their stated unit."""
    for name in names:
        channel = recording.channels[name]
        zero = atmosphere if split_pressure_kind(channel.stated)[1] == "g" else 0.0
        recording = recording.with_channel(name, zero + (channel.values - zero) / factor, channel.unit)
    return recording
