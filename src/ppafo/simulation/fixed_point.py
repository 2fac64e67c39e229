"""The integer form of a scenario's controller: its whole numbers, from settings in SI units that may be columns."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ppafo.control.fixed.torque_laws import FIXED_LAWS
from ppafo.control.fixed.whole_numbers import SETTINGS, Converter, converter_of
from ppafo.control.kind import ControllerKind
from ppafo.engine.rows import leaves
from ppafo.model.columns import Problem, at, over_runs
from ppafo.simulation.reading import short_quantity_text
from ppafo.simulation.scenario import Scenario

_ROUNDING = 1.0e-9


@dataclass(frozen=True, slots=True)
class FixedController:
    """An integer controller for the lanes: its kind, its numbers by name (whole ones in floats), what may be wrong."""

    kind: ControllerKind
    numbers: Mapping[str, Any]
    problems: tuple[Problem, ...]


def fixed_controller(scenario: Scenario, torque_constant: Any, reference: tuple[Any, Any]) -> FixedController:
    """The integer form of the controller; any number may be an array (runs,).

    It is told the device's torque constant [N m/Pa], and the lowest and highest ``reference`` [N m].
    """
    control = scenario.control
    law = FIXED_LAWS[control.kind]
    bits, pressure_range = (control.settings[item.name] for item in SETTINGS)
    converter: Converter = over_runs(converter_of, bits, pressure_range, torque_constant)
    names = tuple(control.settings)

    def settings_of(values: tuple[float, ...]) -> dict[str, float]:
        return dict(zip(names, values, strict=True))

    def prepared(period: float, torque_step: float, *values: float) -> tuple[float, ...]:
        found: tuple[float, ...] = law.prepare(settings_of(values), period, torque_step)
        return found

    def largest(period: float, torque_step: float, *values: float) -> float:
        return law.largest(settings_of(values), period, torque_step)

    given = (control.period, converter.torque_step, *control.settings.values())
    every = (*leaves(converter), *over_runs(prepared, *given))
    numbers = dict(zip((item.name for item in law.kind.quantities), every, strict=True))
    size = over_runs(largest, *given)
    return FixedController(
        law.kind, numbers, (_broken_bit(bits), _too_large(size, control.kind), _reference(reference, converter))
    )


def _broken_bit(bits: Any) -> Problem:
    """A number of bits that is not whole."""
    return np.asarray(bits % 1.0 != 0.0), lambda run: f"controller.converter_bits = {at(bits, run):g}: must be whole"


def _too_large(size: Any, kind: str) -> Problem:
    """A setting beyond what 15 bits and the range of the converter can hold."""

    def line(run: int) -> str:
        return (
            f"controller: a gain of '{kind}' on whole numbers is {at(size, run):.3g} times the largest: take more "
            f"converter_bits, a smaller converter_range, or a smaller gain"
        )

    return np.asarray(size > 1.0), line


def _reference(bounds: tuple[Any, Any], converter: Converter) -> Problem:
    """A reference that the converter cannot show."""
    lowest, highest = bounds
    low, high = -converter.middle * converter.torque_step, (converter.top - converter.middle) * converter.torque_step

    def line(run: int) -> str:
        shown, wanted = (
            (short_quantity_text(at(end, run), "N m") for end in ends) for ends in ((low, high), (lowest, highest))
        )
        return (
            f"reference: from {' to '.join(wanted)}, and the converter shows {' to '.join(shown)} only: "
            "take a larger controller.converter_range"
        )

    return np.logical_or(lowest < low - _ROUNDING, highest > high + _ROUNDING), line
