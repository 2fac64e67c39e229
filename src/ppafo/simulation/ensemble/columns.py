"""Columns of numbers that replace numbers of a scenario, checked once for all runs."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.errors import ScenarioError
from ppafo.model.catalog import find_effects
from ppafo.model.declaration import Quantity
from ppafo.parameters.declaration import OF_SECOND_CHAMBER, WHY_ONE_CHAMBER
from ppafo.parameters.graph import ATMOSPHERE_PATH
from ppafo.parameters.overrides import either, in_two_forms
from ppafo.simulation.contradictions import check_no_bottle
from ppafo.simulation.declaration import WALL_AREA
from ppafo.simulation.numbers import chosen_path, declared_numbers, moving_together
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
        raise ScenarioError(
            f"{base.name}: an ensemble needs columns of equal length with one value per run, not {shapes or 'none'}"
        )
    pair = in_two_forms(values)
    if pair is not None:
        raise ScenarioError(f"{base.name}: '{pair[0]}' and '{pair[1]}' cannot both vary: {either(pair[0])}")
    # An adiabatic scenario need not say its area, and runs that take up heat would go on as if they had none.
    gas, heat_varies = base.gas_model, "gas_model.heat_transfer_coefficient" in values
    if heat_varies and WALL_AREA not in values and gas is not None and gas.wall_area_per_volume == 0.0:
        raise ScenarioError(f"{base.name}: the heat transfer varies, but '{WALL_AREA}' is 0; give the wall area")
    (shape,) = set(shapes.values())
    moved = moving_together(base, absolute(base, values, gauge))
    # A number that follows may be the same in all runs.
    varied = {path: number if np.ndim(number) else np.full(shape, number) for path, number in moved.items()}
    # A number of a second chamber that the actuator does not have may follow, and nothing declares it.
    in_force = {path: declared[path] for path in varied if path in declared}
    return ScenarioColumns(base, varied, in_force, frozenset(values))


def absolute(base: Scenario, columns: Mapping[str, Floats], gauge: Collection[str]) -> dict[str, Floats]:
    """Return the columns with gauge pressures converted to absolute ones by the atmosphere of each run."""
    atmosphere = columns.get(ATMOSPHERE_PATH, base.device.supply.atmospheric_pressure)
    return {path: column + atmosphere if path in gauge else column for path, column in columns.items()}
