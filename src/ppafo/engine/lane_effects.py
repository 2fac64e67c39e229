"""What the lanes do for states of effects: predict them for the second stage, bring them over a step, judge them."""

import re

from ppafo.engine.lane_control import pressures_of
from ppafo.engine.lane_rows import LaneRows
from ppafo.engine.rows import leaf_paths
from ppafo.engine.scheme.pneumatics import SHORTEST
from ppafo.engine.source_text import woven
from ppafo.model.effects.kind import Moment, State

LARGEST = 1.0e300
"""A state beyond this, or one that is no number, is a failure."""


def states_ahead(rows: LaneRows, lines: list[str]) -> list[str]:
    """Lines that predict, for the end of the first stage, the states that laws called in some lines ask for.

    Without them the flows of the second stage would have the states of the begin, and the order would fall to one.
    """
    words = {word for line in woven(lines, rows.needs) for word in re.findall(r"\w+", line)}
    asked = [(name, kind) for name, kind in rows.program.stated.items() if f"{name}_state" in words]
    if not asked:
        return []
    predicted = []
    for name, kind in asked:
        row = kind.row
        fields = (f"{path} + length * {moved}" for path, moved in _with_slopes(name, kind))
        predicted += [_slopes(rows, name, kind), f"{name}_state = {rows.add(row)}({', '.join(fields)})"]
    return [*begun_moment(rows), *predicted]


def advance_states(rows: LaneRows) -> list[str]:
    """Lines that bring the states of effects to the end of a step or part: ``NAME_state_after``."""
    stated = rows.program.stated
    if not stated:
        return []
    mean = f"/ max(length, {SHORTEST!r})"
    lines = [
        f"supplied = (after.supplied_mass - state.supplied_mass) {mean}",
        f"vented = (after.vented_mass - state.vented_mass) {mean}",
        *moment(rows, "before_step", "state"),
        *moment(rows, "after_step", "after"),
        *(begun_moment(rows) if rows.program.is_adaptive and any(kind.tolerances for kind in stated.values()) else []),
    ]
    for name, kind in stated.items():
        lines.append(
            f"{name}_state_after = {rows.add(kind.advance)}({name}, {name}_state, before_step, after_step, length)"
        )
        lines += [_slopes(rows, name, kind)] if kind.tolerances and rows.program.is_adaptive else []
    return lines


def state_errors(rows: LaneRows) -> list[str]:
    """Expressions of the errors of the states of effects in a part over what is allowed [-]."""
    found = []
    for name, kind in rows.program.stated.items():
        for (path, moved), allowed in zip(
            _with_slopes(name, kind) if kind.tolerances else (), kind.tolerances, strict=True
        ):
            after = path.replace(f"{name}_state", f"{name}_state_after", 1)
            found.append(f"abs({after} - ({path} + length * {moved})) / {allowed!r}")
    return found


def states_are_possible(rows: LaneRows) -> str:
    """Further conditions of a run that did not fail."""
    paths = (path for name, row in rows.program.effect_states.items() for path in leaf_paths(row, f"{name}_after"))
    return "".join(f" and abs({path}) < {LARGEST!r}" for path in paths)


def begun_moment(rows: LaneRows) -> list[str]:
    """Lines that make the moment ``now`` at the begin of a step, with the flows of its first stage."""
    gas = chambers_of(rows)
    first = f"{gas}.first" if rows.program.is_thermal or rows.program.keeps_volumes else f"{gas}.still.first"
    return [
        rows.load("gas"),
        f"supplied = {first}.supplied",
        f"vented = {first}.supplied - {first}.mass_1 - {first}.mass_2",
        *moment(rows, "now", "state"),
    ]


def moment(rows: LaneRows, name: str, state: str) -> list[str]:
    """Lines that make a moment of the plant in some state, with the flows ``supplied`` and ``vented``."""
    given = f"{state}.angle, {state}.angular_velocity, pressure_1, pressure_2, supplied, vented, command"
    return [
        f"pressure_1, pressure_2 = {pressures_of(rows, state)}",
        f"{name} = {rows.add(Moment)}({given})",
    ]


def _slopes(rows: LaneRows, name: str, kind: State) -> str:
    return f"{name}_state_slopes = {rows.add(kind.slopes)}({name}, {name}_state, now)"


def _with_slopes(name: str, kind: State) -> list[tuple[str, str]]:
    """Each number of a state, and its rate."""
    paths = leaf_paths(kind.row, f"{name}_state")
    return [(path, path.replace(f"{name}_state", f"{name}_state_slopes", 1)) for path in paths]


def chambers_of(rows: LaneRows) -> str:
    """What the first stage of the chambers is called."""
    return "gas.chambers" if rows.program.has_lines else "gas"
