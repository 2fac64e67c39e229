"""Pressures in a wrong unit, accused only where the procedure, repeated with another unit, does better."""

import math
from collections.abc import Callable, Iterable
from dataclasses import replace

from ppafo.errors import IdentificationError
from ppafo.identification.bench.law import BenchResult
from ppafo.identification.estimate import WRONG_UNIT
from ppafo.identification.source import RecordingSource
from ppafo.parameters.parameter_set import ParameterSet, number_in_si
from ppafo.signals.recording import Recording
from ppafo.simulation.recorded.misread_units import misread_units
from ppafo.units import split_pressure_kind
from ppafo.wording import percentage

_NEAR = 1.5
"""Largest ratio [-] of a discharge coefficient in another unit to the value of the set, for the unit to be accused."""
_LARGEST_COEFFICIENT = 1.0
"""Discharge coefficient [-] of a jet as wide as its opening: above it, the area stated or a unit is wrong."""
_LARGE_SCATTER, _SMOOTHER = 0.01, 5.0
"""Scatter of readings from which another unit is tried, and its ratio to the scatter with that unit to report it [-].

The zero of a gauge pressure and the choked flow make a law of the absolute pressure fit one unit only.
"""
_ROUNDING = 1.0e-6
"""Difference of scatter [-] of readings that are computed, in two units, for flow that is choked throughout."""


def with_tried_units(
    result: BenchResult,
    sources: tuple[RecordingSource, ...],
    parameter_set: ParameterSet,
    atmosphere: float,
    run: Callable[[tuple[RecordingSource, ...]], BenchResult],
) -> BenchResult:
    """Return the result, with the verdict of a wrong unit where a repetition in another unit of pressure does better.

    A unit is accused if the readings give a discharge coefficient that no orifice has and, in the other unit, one near
    that of the set with no more scatter. Far less scatter in another unit is a remark, since another law may scatter
    less as well, and so is a value far from the set, which may be of another device. ``atmosphere`` [Pa absolute] is
    the zero of gauge pressures; ``run`` repeats the procedure with other recordings.
    """
    impossible = [
        estimate.path
        for estimate in result.estimates
        if estimate.path.endswith(".discharge_coefficient") and estimate.value > _LARGEST_COEFFICIENT
    ]
    if not (impossible or result.scatter > _LARGE_SCATTER):
        return result
    channels = {name: channel for source in sources for name, channel in source.recording.channels.items()}
    pressures = tuple(name for name, channel in channels.items() if channel.unit == "Pa")
    # All absolute pressures together, then each one.
    groups = dict.fromkeys((pressures, *((name,) for name in pressures)))
    stated = {group: [channels[name].stated for name in group] for group in groups}
    # Accusations first, then the least scatter.
    first, found = (True, math.inf), result
    for names, (mistake, factor) in ((group, each) for group in groups for each in misread_units("Pa", stated[group])):
        again = [replace(source, recording=_in_unit(source.recording, names, factor, atmosphere)) for source in sources]
        try:
            tried = run(tuple(again))
        except IdentificationError:
            continue
        expected = [(tried[path].value, number_in_si(parameter_set, path) or math.inf) for path in impossible]
        is_near = bool(impossible) and all(1.0 / _NEAR < value / number < _NEAR for value, number in expected)
        is_accused = is_near and tried.scatter <= result.scatter + _ROUNDING
        is_smoother = result.scatter > _LARGE_SCATTER and _SMOOTHER * tried.scatter < result.scatter
        rank = not is_accused, tried.scatter
        if not (is_accused or is_smoother) or rank >= first:
            continue
        first = rank
        text = (
            f"with {' and '.join(names)} as {mistake}, a factor of {max(factor, 1.0 / factor):.4g}, the scatter is "
            f"{percentage(tried.scatter, 2)} of the largest reading instead of {percentage(result.scatter, 2)}"
        )
        if is_accused:
            text = f"{text}; correct the unit in the header or the column map"
            doubted = (replace(estimate, verdict=WRONG_UNIT, explanation=text) for estimate in result.estimates)
            found = replace(result, estimates=tuple(doubted))
        else:
            found = replace(result, remarks=(*result.remarks, f"{text}; check the unit, and the law"))
    return found


def _in_unit(recording: Recording, names: Iterable[str], factor: float, atmosphere: float) -> Recording:
    """Return a recording with some absolute pressures divided by a factor, from the zero of their stated unit."""
    for name in names:
        channel = recording.channels[name]
        zero = atmosphere if split_pressure_kind(channel.stated)[1] == "g" else 0.0
        recording = recording.with_channel(name, zero + (channel.values - zero) / factor, channel.unit)
    return recording
