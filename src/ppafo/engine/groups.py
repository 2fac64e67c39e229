"""Groups of numbers of a program: each has a unique name, a class and a role, defined by the component that owns it.

The rows of parameters, states and intermediate values of a step are the groups in their order.
"""

from collections.abc import Callable, Mapping
from enum import Enum
from typing import Any, NamedTuple

import numpy as np

from ppafo.engine.rows import leaf_paths, leaves
from ppafo.errors import ProgramError
from ppafo.model.declaration import PlainFunction


class Role(Enum):
    """Role of a group in a run: constant input, state between steps, or intermediate value of one step."""

    PARAMETER = "parameters"
    STATE = "states"
    STEP = "numbers of a step"


class Group(NamedTuple):
    """Group of numbers: class of its row (NamedTuple or float), and its role.

    ``of_plant(plant)`` computes the row if it depends only on the plant; None if the run provides the row.
    """

    row: Any
    role: Role
    of_plant: PlainFunction | None = None


Groups = Mapping[str, Group]
"""Groups by their names, in the order of their rows."""


def given(row: Any, of_plant: PlainFunction | None = None) -> Group:
    """Declare a group that is constant during a run, set by the run or, also in exports, by ``of_plant(plant)``."""
    return Group(row, Role.PARAMETER, of_plant)


def kept(row: Any) -> Group:
    """Declare a group of states that a run keeps from step to step."""
    return Group(row, Role.STATE)


def handed(row: Any) -> Group:
    """Declare a group that one phase of a step passes to later phases."""
    return Group(row, Role.STEP)


def merged(*parts: Groups) -> dict[str, Group]:
    """Return the groups of several components in order. ProgramError if two groups have the same name."""
    found: dict[str, Group] = {}
    for groups in parts:
        for name, group in groups.items():
            if name in found:
                raise ProgramError(f"two components of a program define the group '{name}'; rename one of the groups")
            found[name] = group
    return found


def rows_of(groups: Groups, role: Role) -> dict[str, Any]:
    """Return the classes of the groups of one role, in order."""
    return {name: group.row for name, group in groups.items() if group.role is role}


def filled(
    rows: Mapping[str, Any],
    values: Mapping[str, Any],
    runs: int,
    role: Role,
    declared_at: Callable[[str], str] = str,
) -> "np.ndarray[tuple[int, int], np.dtype[np.float64]]":
    """Return the rows (numbers, runs) of groups by name, whose numbers are floats or arrays (runs,).

    Raises ProgramError for a group without value, with the place where it is declared (``declared_at``), for a value
    without group, and for a value of the wrong class.
    """
    for name, value in values.items():
        if name not in rows and leaves(value):
            raise ProgramError(
                f"{role.value}: no component of the program has the group '{name}' ({_described(value)}); omit it"
            )
    found: list[Any] = []
    for name, row in rows.items():
        numbers = leaves(values[name]) if name in values else []
        paths = leaf_paths(row, name)
        if len(numbers) != len(paths) or (numbers and getattr(values[name], "_fields", ()) != row._fields):
            fields = ", ".join(path.partition(".")[2] or path for path in paths)
            given = f"got {_described(values[name])}" if numbers else "no value was given"
            is_open = role is Role.PARAMETER and not numbers
            remedy = f"; '{name}': given({row.__name__}, FUNCTION) computes it by FUNCTION(plant)" if is_open else ""
            raise ProgramError(
                f"{declared_at(name)}: {role.value}: '{name}' must be a {row.__name__}({fields}); {given}{remedy}"
            )
        found += numbers
    table = np.empty((len(found), runs))
    for line, number in zip(table, found, strict=True):
        # Broadcast: a float fills the row of all runs.
        line[:] = number
    return table


def check_rows(count: int, rows: Mapping[str, Any], role: Role) -> None:
    """Raise ProgramError, naming the last group, for a table with a wrong number of rows.

    Compiled code would otherwise read beyond the table.
    """
    sizes = {name: len(leaf_paths(row, name)) for name, row in rows.items()}
    if count != sum(sizes.values()):
        raise ProgramError(
            f"{role.value}: a block must have {sum(sizes.values())} rows, not {count}; rows by group of the program: "
            + ", ".join(f"{name} {size}" for name, size in sizes.items() if size)
        )


def _described(value: Any) -> str:
    names = ", ".join(getattr(value, "_fields", ())) or f"{len(leaves(value))} numbers"
    return f"a {type(value).__name__}({names})"
