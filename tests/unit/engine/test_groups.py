"""Groups of numbers: each is declared once, a lane knows it, and a run that forgets one is refused in one line."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from ppafo.engine.groups import Role, check_rows, filled
from ppafo.engine.lanes import run_batch
from ppafo.engine.rows import is_row
from ppafo.engine.step.lane import Lane
from ppafo.errors import ProgramError
from ppafo.golden_bits import names, plain_batch
from ppafo.model.declaration import EmptyRow
from tests.composed_programs import drawn_programs


class Mine(NamedTuple):
    """A parameter of a gas of my own."""

    exponent: float


class Other(NamedTuple):
    """Another class of as many numbers."""

    factor: float


def test_a_group_is_declared_by_one_component_and_is_known_to_a_lane() -> None:
    programs = [plain_batch(name).program for name in names()] + [program for program in drawn_programs(20)]
    known = Lane.__annotations__
    for program in programs:
        own = {effect.name for effect in program.effects} | program.effect_states.keys() | program.meter_groups.keys()
        for name, group in program.groups.items():
            if name in own or group.row is EmptyRow:
                continue
            declared = known[name] if isinstance(known[name], str) else getattr(known[name], "__name__", "Any")
            is_any = declared in ("Any", "typing.Any")
            assert is_any or not is_row(group.row) or declared.strip('"') == group.row.__name__, name


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({}, r"parameters: 'mine' must be a Mine\(exponent\); no value was given; 'mine': given\(Mine, F"),
        ({"mine": Other(1.0)}, r"'mine' must be a Mine\(exponent\); got a Other\(factor\)$"),
        (
            {"mine": Mine(1.0), "yours": Other(1.0)},
            r"no component of the program has the group 'yours' \(a Other\(factor\)\)",
        ),
    ],
)
def test_a_number_that_is_forgotten_is_one_line(values: dict[str, object], message: str) -> None:
    with pytest.raises(ProgramError, match=message):
        filled({"mine": Mine}, values, 2, Role.PARAMETER)


def test_numbers_of_all_runs_and_of_each_stand_in_rows_by_name() -> None:
    rows = filled({"mine": Mine, "other": Other}, {"other": Other(2.0), "mine": Mine(np.arange(3.0))}, 3, Role.STATE)  # type: ignore[arg-type]
    assert rows.tolist() == [[0.0, 1.0, 2.0], [2.0, 2.0, 2.0]]


def test_a_block_with_a_row_too_few_is_refused_before_it_is_run() -> None:
    batch = plain_batch("torque-task-proportional")
    with pytest.raises(
        ProgramError,
        match=r"parameters: a block must have \d+ rows, not \d+; rows by group of the program: timing 5, plant ",
    ):
        run_batch(replace(batch, parameters=batch.parameters[:-1]))
    check_rows(1, {"mine": Mine}, Role.STATE)
