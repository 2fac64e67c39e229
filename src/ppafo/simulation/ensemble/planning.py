"""Planning of an ensemble: columns of numbers in a scenario, checked, and their batches with one program and one clock.

What concerns all runs is refused as a whole; contradictory runs are refused one by one.
"""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.lanes import Batch, Floats
from ppafo.engine.run import Members, Run, batches_of
from ppafo.errors import ScenarioError
from ppafo.model.catalog import find_effects
from ppafo.model.columns import Problem
from ppafo.model.declaration import Quantity
from ppafo.parameters.building import contradictions
from ppafo.parameters.declaration import OF_SECOND_CHAMBER, WHY_ONE_CHAMBER, is_within, range_rule
from ppafo.parameters.effects import switches_of
from ppafo.parameters.graph import ATMOSPHERE_PATH
from ppafo.parameters.overrides import either, in_two_forms
from ppafo.simulation.clock import TIMES
from ppafo.simulation.contradictions import check_no_bottle, problems_of
from ppafo.simulation.declaration import WALL_AREA
from ppafo.simulation.numbers import chosen_path, declared_numbers, moving_together, with_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.wording import nearest_name

_TEXTS = frozenset({"name", "description", "set", "valve", "species", "relieving", "kind", "gait"})
"""Keys of texts, and of true or false, in a scenario or its device."""


@dataclass(frozen=True, slots=True)
class ScenarioColumns:
    """Scenario with columns of varied numbers: ``values`` (runs,) in SI and their declarations, by path.

    ``values`` include the numbers that follow varied ones; ``given`` are the paths varied by the caller.
    """

    base: Scenario
    values: Mapping[str, Floats]
    declared: Mapping[str, Quantity]
    given: frozenset[str]

    @property
    def runs(self) -> int:
        """Number of runs."""
        return next(iter(self.values.values())).size


def check_columns(base: Scenario, columns: Mapping[str, Any], gauge: Collection[str] = ()) -> ScenarioColumns:
    """Return the validated columns; paths of the selected valve start with ``valve``.

    Raises ScenarioError for errors that concern all runs. Paths in ``gauge`` hold gauge pressures relative to the
    atmosphere of each run.
    """
    if base.controller.is_outside and base.controller.custom is None:
        raise ScenarioError(f"{base.name}: has no controller; give one with controlled_by")
    check_no_bottle(base)
    # Effects of other packages are known by their paths once they are loaded.
    find_effects(columns)
    declared = declared_numbers(base)
    values: dict[str, Floats] = {}
    for typed, column in columns.items():
        # valve.area and valves.NAME.area are one number of the chosen valve.
        path = chosen_path(typed, base)
        if path not in declared:
            why = "is not a number that can vary"
            why += nearest_name(path, declared) or f"; for example {', '.join(list(declared)[:6])}"
            if path.rpartition(".")[2] in _TEXTS:
                why = "is a text and cannot vary; run an ensemble for each value"
            elif base.controller.is_outside and path.startswith("controller."):
                why = "cannot vary: a Python controller object has no declared settings"
            elif path in OF_SECOND_CHAMBER and base.device.actuator.has_one_chamber:
                why = f"cannot vary: {WHY_ONE_CHAMBER}"
            raise ScenarioError(f"{base.name}: '{typed}' {why}")
        if path in values:
            raise ScenarioError(f"{base.name}: '{typed}' and '{path}' are the same value; give only one of them")
        values[path] = np.ascontiguousarray(column, dtype=np.float64)
    shapes = {path: column.shape for path, column in values.items()}
    if len(set(shapes.values())) != 1 or any(len(shape) != 1 or shape[0] == 0 for shape in shapes.values()):
        raise ScenarioError(f"{base.name}: needs columns of equal length, not {shapes or 'none'}")
    pair = in_two_forms(values)
    if pair is not None:
        raise ScenarioError(f"{base.name}: '{pair[0]}' and '{pair[1]}' cannot both vary: {either(pair[0])}")
    # An adiabatic scenario need not say its area, and runs that take up heat would go on as if they had none.
    gas = base.gas_model
    heat_varies = "gas_model.heat_transfer_coefficient" in values
    if heat_varies and WALL_AREA not in values and gas is not None and gas.wall_area_per_volume == 0.0:
        raise ScenarioError(f"{base.name}: the heat transfer varies, but '{WALL_AREA}' is 0; give the wall area")
    (shape,) = set(shapes.values())
    columns = absolute(base, values, gauge)
    moved = moving_together(base, columns_in_range(base, columns))
    # A number that follows may be the same in all runs.
    varied = {path: number if np.ndim(number) else np.full(shape, number) for path, number in moved.items()} | columns
    # A number of a second chamber that the actuator does not have may follow, and nothing declares it.
    in_force = {path: declared[path] for path in varied if path in declared}
    return ScenarioColumns(base, varied, in_force, frozenset(values))


def absolute(base: Scenario, columns: Mapping[str, Floats], gauge: Collection[str]) -> dict[str, Floats]:
    """Return the columns with gauge pressures converted to absolute ones by the atmosphere of each run."""
    atmosphere = columns.get(ATMOSPHERE_PATH, base.device.supply.atmospheric_pressure)
    return {path: column + atmosphere if path in gauge else column for path, column in columns.items()}


def columns_in_range(base: Scenario, columns: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return the columns with the numbers of a run in range for each run out of range; empty if all are.

    A rule for a default, or for what a device reaches, need not have a value out of range.
    """
    declared = declared_numbers(base)
    are_good = [_is_in_range(column, declared[chosen_path(path, base)]) for path, column in columns.items()]
    is_good = np.logical_and.reduce(are_good)
    places = np.where(is_good, np.arange(is_good.size), np.argmax(is_good))
    return {path: column[places] for path, column in columns.items()} if is_good.any() else {}


@dataclass(slots=True)
class _ValidRuns:
    """Runs that passed the checks so far: indices in the ensemble (``members``) and their columns.

    ``reasons`` maps the index of each refused run to a line that says why.
    """

    columns: ScenarioColumns
    members: Members
    reasons: dict[int, str]
    _scenario: Scenario | None = None

    @property
    def scenario(self) -> Scenario:
        """Scenario with columns for the remaining runs, built once for all rules."""
        if self._scenario is None:
            self._scenario = with_numbers(self.columns.base, self.columns.values)
        return self._scenario

    def subset(self, indices: Members) -> "_ValidRuns":
        """Return the runs at ``indices`` among the remaining ones, with the same ``reasons``."""
        values = {path: column[indices] for path, column in self.columns.values.items()}
        return _ValidRuns(replace(self.columns, values=values), self.members[indices], self.reasons)

    def refuse(self, is_bad: Any, line: Callable[[int], str]) -> None:
        """Drop runs by a mask over the remaining ones, or all by one truth value; ``line(index)`` gives the reason."""
        bad = np.broadcast_to(np.asarray(is_bad, dtype=bool), self.members.shape)
        if not bad.any():
            return
        for index in np.flatnonzero(bad):
            self.reasons[int(self.members[index])] = line(int(index))
        valid = self.subset(np.flatnonzero(~bad))
        self.members = valid.members
        self.columns = valid.columns
        self._scenario = None


def screen_columns(columns: ScenarioColumns) -> _ValidRuns:
    """Runs whose values are in range and consistent."""
    valid = _ValidRuns(columns, np.arange(columns.runs), {})
    for path in columns.declared:
        # A default that follows others goes where they lead it, as it does in a single run.
        if path in columns.given or not columns.declared[path].follows:
            valid.refuse(*_out_of_range(valid.columns, path))
    numbers = dict(valid.columns.values)
    times = {path: numbers.pop(path) for path in TIMES if path in numbers}
    if times and valid.members.size:
        # The times that the clock computed replace those that were given.
        clock, problems = columns.base.motion.motion_kind.clock(columns.base, times)
        valid.columns = replace(valid.columns, values=numbers | clock)
        for is_bad, line in problems:
            valid.refuse(is_bad, line)
    # After each problem that some runs have, the others are checked again: their numbers may have fewer.
    while valid.members.size:
        of_device = (problem for _, problem in contradictions(valid.scenario.device))
        problem = _first_problem(chain(of_device, problems_of(valid.scenario)))
        if problem is None:
            break
        valid.refuse(*problem)
    return valid


def _out_of_range(columns: ScenarioColumns, path: str) -> Problem:
    values = columns.values[path]
    quantity = columns.declared[path]
    unit = quantity.unit

    def line(run: int) -> str:
        value = values[run]
        written = f"{path} = {value:.9g} {unit}".rstrip()
        if not np.isfinite(value):
            return f"{written}: must be a finite number"
        if quantity.whole and value != np.floor(value):
            return f"{written}: must be a whole number"
        return f"{written}: {range_rule(quantity, unit)}"

    return ~_is_in_range(values, quantity), line


def _is_in_range(values: Floats, quantity: Quantity) -> NDArray[np.bool_]:
    """Return whether each number of a column is finite and in range, and whole where it must be."""
    is_whole = values == np.floor(values) if quantity.whole else True
    return np.asarray(np.isfinite(values) & is_within(values, quantity) & is_whole)


@dataclass(frozen=True, slots=True)
class EnsemblePlan:
    """Batches with the indices of their runs in the ensemble, and a line for each refused run."""

    batches: tuple[tuple[Members, Batch], ...]
    reasons: dict[int, str]


# A valve without area takes for ever to fill a chamber, which is no fault of a plan.
@np.errstate(divide="ignore", invalid="ignore")
def plan_ensemble(columns: ScenarioColumns, change: Callable[[Run], Run] | None = None) -> EnsemblePlan:
    """Batches of all valid runs; rows are bit for bit as from ``plan_run`` for one run, with ``change`` applied."""
    valid = screen_columns(columns)
    batches: list[tuple[Members, Batch]] = []
    for indices in _groups_of_one_program(valid.scenario, valid.members.size) if valid.members.size else ():
        group = valid.subset(indices)
        while group.members.size:
            run, problems = group.scenario.motion.motion_kind.plan(group.scenario)
            problem = _first_problem(problems)
            if problem is None:
                run = run if change is None else change(run)
                batches += [(group.members[members], batch) for members, batch in batches_of(run, group.members.size)]
                break
            group.refuse(*problem)
    return EnsemblePlan(tuple(batches), valid.reasons)


def _groups_of_one_program(scenario: Scenario, runs: int) -> list[Members]:
    """Run indices, grouped by compiled program: equal effects, and zeros in the same settings."""
    of_motion = scenario.motion.motion_kind.flaws(scenario)
    settings: tuple[Any, ...] = (*scenario.device.valve.settings.values(), *of_motion)
    varied_settings = [setting > 0.0 for setting in settings if isinstance(setting, np.ndarray)]
    varied_settings += [is_on for is_on in switches_of(scenario.device).values() if isinstance(is_on, np.ndarray)]
    if not varied_settings:
        return [np.arange(runs)]
    # A bit for each setting: runs with the same bits have the same program.
    patterns: NDArray[np.int64] = np.zeros(runs, dtype=np.int64)
    for setting in varied_settings:
        patterns = 2 * patterns + setting
    return [np.flatnonzero(patterns == pattern) for pattern in np.unique(patterns)]


def _first_problem(problems: Iterable[Problem]) -> Problem | None:
    """First problem that any run has; None if no run has one."""
    return next((problem for problem in problems if np.any(problem[0])), None)
