"""What a student changes in the step is right in every backend, or is refused in one line that says where."""

from dataclasses import replace
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
import pytest

from ppafo.engine.groups import Groups, given, handed
from ppafo.engine.lanes import run_batch
from ppafo.engine.program import Program
from ppafo.engine.run import Run, batch_of
from ppafo.engine.step import isothermal, phases
from ppafo.engine.step.lane import Lane
from ppafo.errors import ProgramError
from ppafo.exports.c_library import c_library
from ppafo.model.declaration import PlainFunction
from ppafo.model.plant import PlantParameters
from ppafo.simulation import plan
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run

begun = phases.begin_step
BACKENDS = pytest.mark.parametrize("backend", ["", "python"])


class Mine(NamedTuple):
    """A parameter of a gas: its share of the usual change of mass [-]."""

    share: float


def all_of_it(plant: PlantParameters) -> Mine:
    """The parameter of a gas as usual."""
    return Mine(1.0)


def half_of_it(plant: PlantParameters) -> Mine:
    """The parameter of a gas of which half flows."""
    return Mine(0.5 * plant.supply_pressure / plant.supply_pressure)


def change(parts: Program, lane: Any, length: float) -> None:
    """The change by both stages, of which the parameter leaves a share."""
    isothermal.change(parts, lane, length)
    lane.halved = 0.5 * lane.mine.share
    share = lane.halved + lane.halved
    supplied_1, supplied_2 = share * lane.change.supplied_1, share * lane.change.supplied_2
    lane.change = lane.change._replace(mass_1=share * lane.change.mass_1, supplied_1=supplied_1, supplied_2=supplied_2)


def gas_of_mine(of_plant: PlainFunction | None) -> Any:
    """The module of a gas that is isothermal but for its change of mass."""

    def groups(parts: Program) -> Groups:
        """Groups of the gas, with the parameter and one that a phase hands on."""
        return {**isothermal.groups(parts), "mine": given(Mine, of_plant), "halved": handed(float)}

    made = ModuleType("gas_of_mine")
    vars(made).update({name: value for name, value in vars(isothermal).items() if not name.startswith("__")})
    made.groups, made.change = groups, change  # type: ignore[attr-defined]
    return made


def with_gas_of_mine(of_plant: PlainFunction | None = None) -> Run:
    run = plan_run(load_scenario("step-response", ("run.duration=20 ms",)))
    return replace(run, program=replace(run.program, gas=gas_of_mine(of_plant)))


def test_a_parameter_of_a_gas_that_nothing_gives_is_refused_with_the_line_that_declares_it() -> None:
    said = r"test_edits_of_the_step\.py:\d+: parameters: 'mine' must be a Mine\(share\); no value was given"
    with pytest.raises(ProgramError, match=said):
        batch_of(with_gas_of_mine())


def test_an_export_prepares_a_parameter_of_a_gas_that_follows_the_plant(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan, "isothermal", gas_of_mine(half_of_it))
    source = c_library(load_scenario("step-response", ("run.duration=20 ms",)))["step_response.c"].decode()
    assert "mine = half_of_it(plant)" in source


@BACKENDS
def test_a_gas_with_a_parameter_and_a_group_that_is_set_and_read_does_what_it_says(
    backend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PPAFO_BACKEND", backend)
    usual = run_batch(batch_of(plan_run(load_scenario("step-response", ("run.duration=20 ms",))))).record
    records = [run_batch(batch_of(with_gas_of_mine(of_plant))).record for of_plant in (all_of_it, half_of_it)]
    assert np.array_equal(records[0], usual)
    assert not np.array_equal(records[1], usual)


def unmade(parts: Program, lane: Lane) -> None:
    """Ask for a group that is misspelt."""
    begun(parts, lane)
    lane.before = lane.befor  # type: ignore[attr-defined]


@BACKENDS
def test_a_group_that_nothing_has_is_refused_with_the_nearest_name(
    backend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PPAFO_BACKEND", backend)
    monkeypatch.setattr(phases, "begin_step", unmade)
    said = r"test_edits_of_the_step\.py:\d+: 'lane.befor' is not set by an earlier phase .*did you mean 'before'"
    with pytest.raises(ProgramError, match=said):
        run_batch(batch_of(plan_run(load_scenario("step-response", ("run.duration=2 ms",)))))
