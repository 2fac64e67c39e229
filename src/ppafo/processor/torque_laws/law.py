"""Declaration of an integer controller: law, numbers, and entry in the catalogue of controllers."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, get_type_hints

import numpy as np

from ppafo.control.kind import ControllerKind
from ppafo.engine.composer import each
from ppafo.model.columns import Problem, at, over_runs
from ppafo.model.controlled import TORQUE
from ppafo.model.declaration import Quantity, quantities_of
from ppafo.processor.fixed_point import SETTINGS, ConverterCounts, converter_of

Sample = Callable[[Any, Any, ConverterCounts], tuple[int, Any]]
"""Law as a function of numbers, state and readings: command [steps], -1000 to 1000, and next state."""
Settings = Mapping[str, float]
_ROUNDING = 1.0e-9
"""Rounding tolerance of a reference at the end of the converter range [N m]."""


@dataclass(frozen=True, slots=True)
class FixedLaw:
    """Integer form of a controller of the catalogue.

    ``kind`` is the form for the engine: its update reads the converter, calls ``sample``, which is the law itself, and
    returns the command as a number from -1 to 1. ``numbers`` is the NamedTuple class of the parameters of ``sample``,
    ``begins`` the initial state; both declare the range of each number. The state variable ``sound`` is reported by the
    processor.
    """

    kind: ControllerKind
    sample: Sample
    numbers: type
    begins: Any

    @property
    def number_quantities(self) -> tuple[Quantity, ...]:
        """Quantities of the parameters, in order."""
        return quantities_of(self.numbers)


@dataclass(frozen=True, slots=True)
class Numbers:
    """Conversion of controller settings to the integers of a law, callable as ``ControllerKind.plan``.

    ``prepare(settings, period, torque_step)`` computes the numbers after the converter's, for one run; ``quantities``
    declare all numbers in order. ``largest`` returns the largest ratio of a number to the limit of its range, above 1
    if the settings cannot be represented. A law whose only numbers are the converter's has neither.
    """

    name: str
    quantities: tuple[Quantity, ...]
    prepare: Callable[[Settings, float, float], tuple[float, ...]] | None = None
    largest: Callable[[Settings, float, float], float] | None = None

    def __call__(
        self, settings: Mapping[str, Any], period: Any, torque_constant: Any, reference: tuple[Any, Any]
    ) -> tuple[dict[str, Any], tuple[Problem, ...]]:
        """Return the integers of a law by name, and problems of settings that cannot be represented."""
        bits, pressure_range = (settings[quantity.name] for quantity in SETTINGS)
        steps, limits = over_runs(converter_of, bits, pressure_range, torque_constant)
        names = tuple(settings)

        def own_numbers(period: float, torque_step: float, *values: float) -> tuple[float, ...]:
            of_run = dict(zip(names, values, strict=True))
            size = 0.0 if self.largest is None else self.largest(of_run, period, torque_step)
            return size, *(() if self.prepare is None else self.prepare(of_run, period, torque_step))

        size, *own = over_runs(own_numbers, period, steps.torque_step, *settings.values())
        numbers = dict(zip((quantity.name for quantity in self.quantities), (*steps, *limits, *own), strict=True))
        top, middle = limits
        low = -middle * steps.torque_step
        high = (top - middle) * steps.torque_step
        return numbers, (
            (
                np.asarray(bits % 1.0 != 0.0),
                lambda run: f"controller.converter_bits = {at(bits, run):g}: must be a whole number",
            ),
            (
                np.asarray(size > 1.0),
                lambda run: (
                    f"controller: a gain of '{self.name}' is {at(size, run):.3g} times the largest allowed: increase "
                    f"converter_bits, or reduce converter_range or the gain"
                ),
            ),
            (
                np.logical_or(reference[0] < low - _ROUNDING, reference[1] > high + _ROUNDING),
                lambda run: (
                    f"reference: {_span(reference, run)} exceeds the range of the converter, "
                    f"{_span((low, high), run)}: increase controller.converter_range"
                ),
            ),
        )


def _span(ends: tuple[Any, Any], run: int) -> str:
    return " to ".join(f"{at(end, run):.6g} N m" for end in ends)


def fixed_law(
    floats: ControllerKind,
    name: str,
    rows: type,
    begins: Any,
    sample: Sample,
    update: Callable[[Any, Any, float, Any, float], tuple[float, Any]],
    prepare: Callable[[Settings, float, float], tuple[float, ...]] | None = None,
    largest: Callable[[Settings, float, float], float] | None = None,
) -> FixedLaw:
    """Return the integer form of a law, with settings of law and converter, from its row class with ``numbers``."""
    kind = replace(
        floats,
        name=name,
        summary=f"{floats.summary} In fixed point, as a small processor computes.",
        quantities=(*floats.quantities, *SETTINGS),
        parameters=rows,
        initial=each(float, begins),
        update=update,
        restart=None,
        controls=(TORQUE,),
        plan=Numbers(name, quantities_of(rows), prepare, largest),
    )
    return FixedLaw(kind, sample, get_type_hints(rows)["numbers"], begins)
