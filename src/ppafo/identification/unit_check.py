"""Unit mistakes that explain estimates far from the values of the parameter set."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from ppafo.identification.estimate import WRONG_UNIT, Estimate
from ppafo.signals.recording import Recording
from ppafo.simulation.recorded.misread_units import misread_units

FAR_FROM_SET = 5.0
"""Ratio to the value of the set above which a wrong unit is suspected: psi read as kPa makes 6.89."""
_NEAR = 1.5
"""Largest ratio [-] of an estimate, divided by the value of the set, to the factor of a unit mistake."""


def with_wrong_units(
    estimates: tuple[Estimate, ...], known: Mapping[str, float | None], recordings: Sequence[Recording]
) -> tuple[Estimate, ...]:
    """Return the estimates, with the verdict of a wrong unit where a unit mistake in a recording explains the values.

    A mistake explains them if every value far from the one ``known`` of the set depends on the unit, and every value
    that depends on the unit is off by nearly its factor: a larger device, or one worn part, is no mistake.
    """
    ratios = {
        estimate.path: abs(math.log(estimate.value / reference))
        for estimate in estimates
        if estimate.is_usable and estimate.value > 0.0 and (reference := known.get(estimate.path) or 0.0) > 0.0
    }
    far = {path for path, ratio in ratios.items() if ratio > math.log(FAR_FROM_SET)}
    channels = {name: channel for recording in recordings for name, channel in recording.channels.items()}
    nearest, explained = math.log(_NEAR), estimates
    for si_unit in dict.fromkeys(channel.unit.removesuffix("_d") for channel in channels.values()) if far else ():
        names = [name for name, channel in channels.items() if channel.unit.removesuffix("_d") == si_unit]
        acted_on = {item.path for item in estimates if item.is_usable and _acts_on(si_unit, item.unit, channels)}
        for mistake in misread_units(si_unit, (channels[name].stated for name in names)) if far <= acted_on else ():
            size = abs(math.log(mistake.factor))
            distance = max(abs(ratios[path] - size) for path in acted_on & ratios.keys())
            if distance < nearest:
                text = (
                    f"{' and '.join(names)} {'seem' if len(names) > 1 else 'seems'} to be {mistake.in_words}, a "
                    f"factor of {mistake.larger_factor}; correct the unit in the header or the column map, or give the "
                    "value that you expect in device.overrides"
                )
                nearest, explained = (
                    distance,
                    tuple(
                        replace(item, verdict=WRONG_UNIT, explanation=text) if item.path in acted_on else item
                        for item in estimates
                    ),
                )
    return explained


def _acts_on(si_unit: str, unit: str, channels: Iterable[str]) -> bool:
    """Return whether an estimate in ``unit`` depends on the unit of the channels of a quantity.

    Beside a measured torque or force a pressure does not scale a torque; in a motion it drives everything with mass.
    """
    has_mass = "N" in unit or "kg" in unit
    if si_unit == "Pa":
        # A torque constant, in N m/Pa, is stated in m^3.
        is_per_pressure = "Pa" in unit or unit == "m^3" or "mass_flow" in channels
        return is_per_pressure or (has_mass and not {"torque", "force"} & {*channels})
    return (has_mass or "torque" in channels) if si_unit == "N m" else unit == "N m"
