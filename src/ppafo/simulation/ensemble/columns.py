"""The columns of an ensemble: what may vary, checked as a whole, and the scenario that represents all runs."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.errors import ScenarioError, nearest_name
from ppafo.model.declaration import Quantity
from ppafo.model.effects.catalog import find_effects
from ppafo.parameters.graph import ATMOSPHERE_PATH
from ppafo.simulation import declaration
from ppafo.simulation.clock import Clock, read_clock
from ppafo.simulation.numbers import TIMES, chosen_path, declared_numbers, moving_together, other_form, with_numbers
from ppafo.simulation.overriding import apply_overrides
from ppafo.simulation.reading import Reading
from ppafo.simulation.scenario import PYTHON_CONTROLLER, Scenario

_TEXTS = (
    *declaration.TEXTS,
    "gas.species",
    "supply.relieving",
    "motion.kind",
    "controller.kind",
    declaration.ARITHMETIC,
    "reference.kind",
    "motion.profile.kind",
)
_UNIT_OF_TIMES = {"controller.rate": "Hz"}


@dataclass(frozen=True, slots=True)
class Columns:
    """A scenario and what varies in it, followers included: values (runs,) in SI by path, with their declarations.

    ``given`` are the paths that are no followers.
    """

    base: Scenario
    values: Mapping[str, Floats]
    declared: Mapping[str, Quantity]
    given: frozenset[str]

    @property
    def runs(self) -> int:
        """Number of runs."""
        return next(iter(self.values.values())).size

    def only(self, kept: Any) -> "Columns":
        """Return the columns of some runs, by a mask or by places."""
        return replace(self, values={path: column[kept] for path, column in self.values.items()})


def check_columns(base: Scenario, columns: Mapping[str, Any], gauge: Collection[str] = ()) -> Columns:
    """Return the columns with the chosen valve as ``valve``; ScenarioError for what no single run is to blame for.

    Those of the paths in ``gauge`` count from the atmosphere of their run.
    """
    if base.control.kind == PYTHON_CONTROLLER and base.control.custom is None:
        raise ScenarioError(f"{base.name}: nothing controls the valve; give a controller (controlled_by)")
    find_effects(columns)
    declared = declared_numbers(base)
    values: dict[str, Floats] = {}
    for given, column in columns.items():
        path = chosen_path(given, base)
        _check_path(base, given, path, declared)
        if path in values:
            raise ScenarioError(f"{base.name}: '{given}' and '{path}' are the same value; give one of them")
        values[path] = np.ascontiguousarray(column, dtype=np.float64)
    shapes = {path: column.shape for path, column in values.items()}
    if len(set(shapes.values())) != 1 or any(len(shape) != 1 or shape[0] == 0 for shape in shapes.values()):
        raise ScenarioError(
            f"{base.name}: an ensemble needs columns of one length, one value for each run, not {shapes or 'none'}"
        )
    _check_together(base, values)
    every = moving_together(base, absolute(base, values, gauge))
    return Columns(base, every, {path: declared[path] for path in every}, frozenset(values))


def absolute(base: Scenario, columns: Mapping[str, Floats], gauge: Collection[str]) -> dict[str, Floats]:
    """Return the columns with absolute pressures in place of those that count from the atmosphere of their run."""
    atmosphere = columns.get(ATMOSPHERE_PATH, base.device.supply.atmospheric_pressure)
    return {path: column + atmosphere if path in gauge else column for path, column in columns.items()}


def _check_path(base: Scenario, given: str, path: str, declared: Mapping[str, Quantity]) -> None:
    if path in declared:
        return
    if path in _TEXTS:
        raise ScenarioError(f"{base.name}: '{given}' is a text and cannot vary; run an ensemble for each value")
    if base.control.kind == PYTHON_CONTROLLER and path.startswith("controller."):
        raise ScenarioError(
            f"{base.name}: '{given}' cannot vary: a Python object has no declared settings; "
            "a module with a KIND has them (docs/how-to/add-a-controller.md)"
        )
    hint = nearest_name(path, declared) or f"; for example {', '.join(list(declared)[:6])}"
    raise ScenarioError(f"{base.name}: there is no number '{given}' that could vary{hint}")


def _check_together(base: Scenario, values: Mapping[str, Floats]) -> None:
    if {"controller.rate", "controller.period"} <= set(values):
        raise ScenarioError(f"{base.name}: vary either controller.rate or controller.period, not both")
    for section in ("valve", "actuator.leak"):
        form = other_form(base.device, section)
        given = [name for name in form if f"{section}.{name}" in values]
        own = [
            name
            for name in ("area", "discharge_coefficient", "sonic_conductance", "critical_ratio")
            if name not in form and f"{section}.{name}" in values
        ]
        if given and (len(given) < len(form) or own):
            raise ScenarioError(
                f"{base.name}: {section} is given in the other form; to vary {' or '.join(form)} give a column for "
                f"both, and none for {' or '.join(own) or 'the other form'}"
            )


def varied_scenario(columns: Columns, clock: Clock) -> Scenario:
    """Return the scenario that represents all runs; numbers of ``clock`` may be arrays too."""
    numbers = {path: column for path, column in columns.values.items() if path not in TIMES}
    scenario = with_numbers(columns.base, numbers)
    return replace(
        scenario,
        duration=clock.duration,
        time_step=clock.step,
        output_interval=clock.output_interval,
        control=replace(scenario.control, period=clock.period),
    )


TimeTexts = Mapping[str, Mapping[str, Any]]
"""The times of a scenario by section and name, as a file gives them."""


def clock_with(name: str, given: TimeTexts, times: Mapping[str, float]) -> Clock:
    """Return the clock [s] of a run with other times, which are read as overrides of the scenario ``name`` are.

    ScenarioError if they do not fit together.
    """
    document = {section: dict(texts) for section, texts in given.items()}
    for path, value in times.items():
        section, item = path.split(".")
        if section == "controller":
            document[section] = {}
        document[section][item] = f"{value!r} {_UNIT_OF_TIMES.get(path, 's')}"
    return read_clock(Reading(name, document, frozenset(times)))


def time_texts(base: Scenario) -> TimeTexts:
    """Return the times as the scenario's file gives them, or the numbers where the scenario was changed since."""
    document = _document(base)
    texts = {
        section: {name: value for name, value in document[section].items() if f"{section}.{name}" in TIMES}
        for section in ("run", "controller")
    }
    if read_clock(Reading(base.name, texts)) == clock_of(base):
        return texts
    run = {"duration": base.duration, "step": base.time_step, "output_interval": base.output_interval}
    return {
        "run": {name: f"{value!r} s" for name, value in run.items()},
        "controller": {"period": f"{base.control.period!r} s"},
    }


def clock_of(base: Scenario) -> Clock:
    """Return the clock that a scenario has."""
    return Clock(base.duration, base.time_step, base.output_interval, base.control.period)


def _document(base: Scenario) -> dict[str, Any]:
    return apply_overrides(base.origin.content, base.origin.overrides, base.name).document
