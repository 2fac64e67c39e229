"""Integer numbers of an integer law from its settings, as floats for the lanes, and their possible faults."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ppafo.control.kind import ControllerKind
from ppafo.model.columns import Problem, at, over_runs
from ppafo.model.controlled import TORQUE
from ppafo.model.declaration import Quantity
from ppafo.processor.fixed_point import SETTINGS, Converter, converter_of

Settings = Mapping[str, float]
_ROUNDING = 1.0e-9
"""Torque [N m] by which a reference may pass what the converter shows: rounding."""


@dataclass(frozen=True, slots=True)
class Numbers:
    """The plan of an integer law, of which ``ControllerKind`` says what it is given and what it makes.

    ``prepare(settings, period, torque_step)`` makes the numbers after the converter's, for one run, ``quantities``
    declare all of them in order. ``largest`` is the largest part of its range that any number takes, above 1 where the
    settings cannot be held. A law without numbers of its own has neither.
    """

    name: str
    quantities: tuple[Quantity, ...]
    prepare: Callable[[Settings, float, float], tuple[float, ...]] | None = None
    largest: Callable[[Settings, float, float], float] | None = None

    def __call__(
        self, settings: Mapping[str, Any], period: Any, torque_constant: Any, reference: tuple[Any, Any]
    ) -> tuple[dict[str, Any], tuple[Problem, ...]]:
        """Whole numbers by name, and what may be wrong."""
        bits, pressure_range = (settings[quantity.name] for quantity in SETTINGS)
        converter: Converter = over_runs(converter_of, bits, pressure_range, torque_constant)
        names = tuple(settings)

        def own_numbers(period: float, torque_step: float, *values: float) -> tuple[float, ...]:
            of_run = dict(zip(names, values, strict=True))
            size = 0.0 if self.largest is None else self.largest(of_run, period, torque_step)
            return size, *(() if self.prepare is None else self.prepare(of_run, period, torque_step))

        size, *own = over_runs(own_numbers, period, converter.torque_step, *settings.values())
        numbers = dict(zip((quantity.name for quantity in self.quantities), (*converter, *own), strict=True))
        broken = np.asarray(bits % 1.0 != 0.0)
        whole: Problem = (broken, lambda run: f"controller.converter_bits = {at(bits, run):g}: must be whole")
        return numbers, (whole, _too_large(size, self.name), _reference(reference, converter))


def fixed_point_kind(
    floats: ControllerKind,
    parameters: type,
    initial: Any,
    update: Callable[[Any, Any, float, Any, float], tuple[float, Any]],
    plan: Numbers,
) -> ControllerKind:
    """The integer form of a law as a controller of the catalogue: its settings, and the converter's."""
    return replace(
        floats,
        name=plan.name,
        summary=f"{floats.summary} In fixed point, as a small processor computes.",
        quantities=(*floats.quantities, *SETTINGS),
        parameters=parameters,
        initial=initial,
        update=update,
        restart=None,
        controls=(TORQUE,),
        plan=plan,
    )


def _too_large(size: Any, kind: str) -> Problem:
    """A setting beyond what 15 bits and the range of the converter can hold."""

    def line(run: int) -> str:
        return (
            f"controller: a gain of '{kind}' is {at(size, run):.3g} times the largest: take more "
            f"converter_bits, a smaller converter_range, or a smaller gain"
        )

    return np.asarray(size > 1.0), line


def _reference(bounds: tuple[Any, Any], converter: Converter) -> Problem:
    """A reference that the converter cannot show."""
    lowest, highest = bounds
    low, high = -converter.middle * converter.torque_step, (converter.top - converter.middle) * converter.torque_step

    def line(run: int) -> str:
        shown, wanted = (
            " to ".join(f"{at(end, run):.6g} N m" for end in ends) for ends in ((low, high), (lowest, highest))
        )
        return (
            f"reference: from {wanted}, and the converter shows {shown} only: take a larger controller.converter_range"
        )

    return np.logical_or(lowest < low - _ROUNDING, highest > high + _ROUNDING), line
