"""Contradictory numbers of a scenario or a walk: refused in a file by the value as written, in an ensemble by the run.

Any number may be an array (runs,), with a value for each run of an ensemble.
"""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ppafo.errors import ScenarioError
from ppafo.model.columns import Problem, at
from ppafo.parameters.declared import value_at
from ppafo.simulation.document import DocumentReader
from ppafo.simulation.numbers import number_at, numbers_at
from ppafo.simulation.scenario import Scenario
from ppafo.units import split_quantity
from ppafo.units.shown import shown_in, shown_text, units_beside

IN_FILES = {"m": "m"}
"""Units of leg segments in walk files; other lengths are in millimetres."""


class Contradiction(NamedTuple):
    """Check of one number: path, result (True if it contradicts another number), and message by run.

    The result is one value for all runs, or an array (runs,). Without a path the message says what it is about.
    """

    path: str
    is_bad: Any
    reason: Callable[[int], str]


def contradictions_in(scenario: Scenario) -> Iterator[Contradiction]:
    """Yield the checks of all numbers that could contradict each other; later ones rely on earlier ones."""
    yield from scenario.motion.motion_kind.contradictions(scenario)
    supply = scenario.device.supply
    if scenario.supply_line is None:
        return

    def regulators(run: int) -> str:
        supplied, dorsiflexion = (
            shown_text(at(pressure, run), "Pa_a", atmosphere=at(supply.atmospheric_pressure, run))
            for pressure in (supply.pressure, supply.dorsiflexion_pressure)
        )
        return (
            "[supply_line]: the first regulator feeds the second, so "
            f"supply.dorsiflexion_pressure = {dorsiflexion} must not exceed supply.pressure = {supplied}"
        )

    yield Contradiction("", supply.dorsiflexion_pressure > supply.pressure, regulators)


def check_contradictions(scenario: Scenario, reading: DocumentReader) -> None:
    """Raise ScenarioError for the first contradiction; ``reading`` provides each value as the user wrote it."""
    declared = scenario.motion.motion_kind.quantities(scenario)
    for path, is_bad, reason in contradictions_in(scenario):
        if not np.any(is_bad):
            continue
        quantity = declared.get(path)
        given = value_at(reading.document, path) if path else None
        units = dict(scenario.device.shown)
        # Limits in the unit of the value that is refused.
        if quantity is not None and isinstance(given, str):
            units |= units_beside(quantity.unit, split_quantity(given)[1])
        with shown_in(units):
            if given is not None:
                raise reading.refusal(path, reason(0))
            if quantity is None:
                raise ScenarioError(f"{reading.file}: {path}{': ' if path else ''}{reason(0)}")
            # In six digits, as the number that it contradicts.
            default = shown_text(number_at(scenario, path), quantity.unit, unit=IN_FILES.get(quantity.unit, ""))
            raise ScenarioError(f"{reading.file}: {path} is not given and has its default, {default}: {reason(0)}")


def problems_of(scenario: Scenario) -> Iterator[Problem]:
    """Yield the contradictions in the runs of an ensemble, each line with the number of its run."""
    for path, is_bad, reason in contradictions_in(scenario):
        yield np.atleast_1d(is_bad), partial(_line, scenario, path, reason)


def _line(scenario: Scenario, path: str, reason: Callable[[int], str], run: int) -> str:
    quantity = scenario.motion.motion_kind.quantities(scenario).get(path)
    if quantity is None:
        return f"{path}{': ' if path else ''}{reason(run)}"
    unit = IN_FILES.get(quantity.unit, "")
    value = shown_text(at(numbers_at(scenario, path), run), quantity.unit, ".9g", unit=unit)
    return f"{path} = {value}: {reason(run)}"


def check_no_bottle(scenario: Scenario) -> None:
    """Raise ScenarioError if the motion is on a bottle, which is supported by ``ppafo walk`` alone."""
    if getattr(scenario.motion, "bottle", None) is not None:
        raise ScenarioError(f"{scenario.name}: a walk with a bottle can only be simulated by 'ppafo walk'")
