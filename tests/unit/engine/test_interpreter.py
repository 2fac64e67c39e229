"""Python runs the functions of the step as they are: the reference for the bits of every compiler."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ppafo.engine.in_python import WITHOUT_EXCEPTIONS, quotient, rewritten, whole_part
from ppafo.engine.lanes import Batch, run_batch
from ppafo.engine.loading import BACKEND_VARIABLE
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import batch_of
from ppafo.golden_bits import digest
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run


def short(batch: Batch, steps: int) -> Batch:
    return replace(batch, clock=replace(batch.clock, step_count=min(steps, batch.clock.step_count)))


def by_python(batch: Batch, monkeypatch: pytest.MonkeyPatch) -> Any:
    with monkeypatch.context() as patch:
        patch.setenv(BACKEND_VARIABLE, "python")
        return run_batch(batch)


def scenario_batch(name: str, overrides: Sequence[str] = ()) -> Batch:
    return short(batch_of(plan_run(load_scenario(name, list(overrides)))), 600)


def test_a_run_in_which_python_raises_ends_as_the_compiled_one(monkeypatch: pytest.MonkeyPatch) -> None:
    batch = scenario_batch("step-response")
    parameters = batch.parameters.copy()
    parameters[row_numbers(batch.program.parameter_rows())["plant.inertia"]] = 0.0
    lost = replace(batch, parameters=parameters)
    python, compiled = by_python(lost, monkeypatch), run_batch(lost)
    failed = compiled.states[1, 0]
    assert failed < 1.0, "the run diverges"
    assert python.states[1, 0] == failed
    assert digest(python) == digest(compiled)


def halved(value: float) -> float:
    """A quotient by zero."""
    return 1.0 / value


def test_operations_that_go_on_give_what_processors_give() -> None:
    code = rewritten(halved, WITHOUT_EXCEPTIONS.writer)
    assert code.co_firstlineno == halved.__code__.co_firstlineno
    assert (quotient(1.0, 0.0), quotient(-1.0, 0.0), quotient(1.0, -0.0)) == (np.inf, -np.inf, -np.inf)
    assert np.isnan(quotient(0.0, 0.0))
    assert quotient(1.0, 3.0) == 1.0 / 3.0
    assert (whole_part(2.9), whole_part(-2.9), whole_part(float("nan"))) == (2, -2, -(2**63))
