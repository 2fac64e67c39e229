"""Every run of an ensemble has the rows that it has alone, bit for bit."""

import numpy as np
import pytest
from numpy.typing import NDArray

from ppafo.engine.lanes import Batch
from ppafo.engine.run import batch_of
from ppafo.errors import PpafoError
from ppafo.simulation.ensemble.planning import EnsemblePlan, check_columns, plan_ensemble
from ppafo.simulation.loading import list_scenarios, load_scenario
from ppafo.simulation.numbers import declared_numbers
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from tests.unit.simulation.ensemble import draws

Floats = NDArray[np.float64]


def overrides(scenario: Scenario, columns: dict[str, Floats], run: int) -> list[str]:
    declared = declared_numbers(scenario)
    texts = []
    for path, values in columns.items():
        number = int(values[run]) if path == "sensors.seed" else float(values[run])
        texts.append(f"{path}={number!r} {declared[path].unit}".strip())
    return texts


def places(plan: EnsemblePlan) -> dict[int, tuple[Batch, int]]:
    return {int(run): (batch, place) for members, batch in plan.batches for place, run in enumerate(members)}


def single_batch(name: str, texts: list[str]) -> Batch:
    return batch_of(plan_run(load_scenario(name, texts)))


@pytest.mark.parametrize("name", list_scenarios())
def test_rows_of_an_ensemble_are_those_of_single_runs_bit_for_bit(name: str) -> None:
    base = load_scenario(name)
    columns = draws.drawn_columns(base, np.random.default_rng([0, *name.encode()]), 6)
    plan = plan_ensemble(check_columns(base, columns))
    found = places(plan)
    for run in range(6):
        texts = overrides(base, columns, run)
        if run in plan.reasons:
            with pytest.raises(PpafoError):
                single_batch(name, texts)
            continue
        batch, place = found[run]
        alone = single_batch(name, texts)
        assert (batch.program, batch.clock) == (alone.program, alone.clock)
        assert np.array_equal(batch.parameters[:, place], alone.parameters[:, 0]), texts
        assert np.array_equal(batch.states[:, place], alone.states[:, 0]), texts
