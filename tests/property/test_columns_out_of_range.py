"""A run whose drawn number is out of range is a refused row with its reason, whichever number it is."""

import numpy as np
import pytest

from ppafo.loading import load_scenario
from ppafo.simulation.ensemble.planning import check_columns, screen_columns
from ppafo.simulation.numbers import declared_numbers
from ppafo.studies.varying import value_at
from ppafo.study.runs import RunCounter, scenario_runs

SERVO = ("device.valve=pressure_regulator",)


@pytest.mark.parametrize(
    ("name", "texts"), [("proportional", ("run.duration=6 s",)), ("cylinder-servo", SERVO), ("pressure-loop", ())]
)
def test_rows_far_out_of_range_are_refused_by_name_and_the_others_are_kept(name: str, texts: tuple[str, ...]) -> None:
    base = load_scenario(name, texts)
    draw = np.random.default_rng(108)
    declared = declared_numbers(base)
    numbers = {path: value_at(path, base) for path in declared}
    tried = {path: number for path, number in numbers.items() if number is not None}
    assert {"gas.temperature", "gas.molar_mass", "controller.period"} <= tried.keys()
    for path, number in tried.items():
        drawn = number + 1e3 * (abs(number) + 1.0) * draw.normal(size=2)
        screened = screen_columns(check_columns(base, {path: np.array([number, *drawn, -1e9, np.nan])}))
        assert sorted([*screened.members.tolist(), *screened.reasons]) == [0, 1, 2, 3, 4]
        assert 0 in screened.members, path
        assert screened.reasons[4] == f"{path} = nan {declared[path].unit}".rstrip() + ": must be a finite number"


def test_a_walk_whose_runs_are_all_refused_has_their_reasons() -> None:
    runs = scenario_runs(load_scenario("proportional"), ["gas_supplied"], RunCounter(2, None))
    rows = runs.run({"gas.temperature": np.array([-5.0, 1e9])})
    assert all(line.startswith("gas.temperature = ") for line in rows["reason"])
