"""What a student changes in the step is right in every backend, or is refused in one line that says where."""

from dataclasses import replace
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
import pytest

from ppafo.engine import step
from ppafo.engine.groups import Groups, given, handed
from ppafo.engine.lanes import run_batch
from ppafo.engine.program import Program
from ppafo.engine.run import Run, batch_of
from ppafo.engine.step import lines
from ppafo.errors import ProgramError
from ppafo.exports.c_library import c_library
from ppafo.model.declaration import PlainFunction
from ppafo.model.plant import PlantParameters
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run

LINES = ("run.duration=20 ms", "supply_line.plantarflexion.droop=3e6 Pa s/kg")
BACKENDS = pytest.mark.parametrize("backend", ["", "python"])


class Mine(NamedTuple):
    """A parameter of lines: the share of their usual gas [-]."""

    share: float


def all_of_it(plant: PlantParameters) -> Mine:
    """The parameter of lines as usual."""
    return Mine(1.0)


def half_of_it(plant: PlantParameters) -> Mine:
    """The parameter of lines that lose half their gas in each part."""
    return Mine(0.5 * plant.supply_pressure / plant.supply_pressure)


def end(parts: Program, lane: Any, length: float) -> None:
    """The lines at the end of a part, of whose gas the parameter leaves a share."""
    lines.end(parts, lane, length)
    lane.halved = 0.5 * lane.mine.share
    lane.next_lines = lane.next_lines._replace(mass_1=(lane.halved + lane.halved) * lane.next_lines.mass_1)


def lines_of_mine(of_plant: PlainFunction | None) -> Any:
    """The module of lines that lose gas."""

    def groups(parts: Program) -> Groups:
        """Groups of the lines, with the parameter and one that a phase hands on."""
        return {**lines.groups(parts), "mine": given(Mine, of_plant), "halved": handed(float)}

    made = ModuleType("lines_of_mine")
    vars(made).update({name: value for name, value in vars(lines).items() if not name.startswith("__")})
    made.groups, made.end = groups, end  # type: ignore[attr-defined]
    return made


def with_lines_of_mine(of_plant: PlainFunction | None = None) -> Run:
    run = plan_run(load_scenario("step-response", LINES))
    return replace(run, program=replace(run.program, feed=lines_of_mine(of_plant)))


def test_a_parameter_of_lines_that_nothing_gives_is_refused_with_the_line_that_declares_it() -> None:
    said = r"test_edits_of_the_step\.py:\d+: parameters: 'mine' must be a Mine\(share\); no value was given"
    with pytest.raises(ProgramError, match=said):
        batch_of(with_lines_of_mine())


def test_an_export_prepares_a_parameter_of_lines_that_follows_the_plant(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(step, "lines", lines_of_mine(half_of_it))
    source = c_library(load_scenario("step-response", LINES))["step_response.c"].decode()
    assert "mine = half_of_it(plant)" in source


@BACKENDS
def test_lines_with_a_parameter_and_a_group_that_is_set_and_read_does_what_it_says(
    backend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PPAFO_BACKEND", backend)
    usual = run_batch(batch_of(plan_run(load_scenario("step-response", LINES)))).record
    records = [run_batch(batch_of(with_lines_of_mine(of_plant))).record for of_plant in (all_of_it, half_of_it)]
    assert np.array_equal(records[0], usual)
    assert not np.array_equal(records[1], usual)
