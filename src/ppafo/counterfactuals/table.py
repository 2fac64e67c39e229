"""Table of counterfactual runs: each change of a scenario with the worst of its tracking numbers over their limits."""

import contextlib
import math
import time
from collections.abc import Mapping, Sequence

import numpy as np

from ppafo.counterfactuals.changes import Change
from ppafo.engine.compilers import Effort
from ppafo.errors import PpafoError
from ppafo.metrics import metric_kind
from ppafo.model.columns import at
from ppafo.simulation.ensemble import COMPLETED, lacking, run_ensemble
from ppafo.simulation.numbers import declared_numbers, moving_together, present_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.tracking.rule import needed_metrics, tracking_excess

_TIME_OF_OBJECT = 0.8
"""Processor time [s] after which no further run of a table with a Python object begins: single changes, and pairs."""
_ANY_NUMBER = "gas.temperature"
"""Path of a number that every scenario has, as the column of runs that vary none."""
Rated = tuple[Change, float]
"""Change, and the largest tracking number over its limit that it leaves [-]: up to 1 the run follows."""


def excesses(changes: Sequence[Change]) -> list[float]:
    """Return the largest tracking number over its limit [-] of the run with each change; inf for one that cannot be.

    Changes of one scenario are one ensemble, so that most share a program. A Python object runs once after the other,
    until its time is over.
    """
    left = [math.inf] * len(changes)
    groups: dict[int, list[int]] = {}
    for place, change in enumerate(changes):
        is_slow = change.base.controller.custom is not None
        groups.setdefault(-place if is_slow else id(change.base), []).append(place)
    started = time.process_time()
    for places in groups.values():
        base = changes[places[0]].base
        if base.controller.custom is None or time.process_time() < started + _TIME_OF_OBJECT:
            for place, excess in zip(places, _judged(base, [changes[each].numbers for each in places]), strict=True):
                left[place] = excess
    return left


def _judged(base: Scenario, rows: Sequence[Mapping[str, float]]) -> list[float]:
    """Return the excess of each row of numbers [SI] by path; inf for a row that is refused or diverges."""
    present = present_numbers(base)
    declared = declared_numbers(base)
    alike: dict[tuple[str, ...], list[int]] = {}
    for place, numbers in enumerate(rows):
        alike.setdefault(tuple(numbers), []).append(place)
    moved: dict[int, dict[str, float]] = {}
    for paths, places in alike.items():
        varied = {path: np.array([rows[place][path] for place in places]) for path in paths}
        with contextlib.suppress(PpafoError):
            # With all that follows them, as for a person who gives them.
            together = moving_together(base, varied)
            for run, place in enumerate(places):
                moved[place] = {path: at(column, run) for path, column in together.items()}
    excess = np.full(len(rows), math.inf)
    if not moved:
        return excess.tolist()
    used = sorted({path for numbers in moved.values() for path in numbers if path in declared}) or [_ANY_NUMBER]
    columns = {path: np.array([numbers.get(path, present[path]) for numbers in moved.values()]) for path in used}
    metrics = [name for name in needed_metrics(base) if (kind := metric_kind(name)) and not lacking(base, kind)]
    result = run_ensemble(base, columns, metrics, effort=Effort.QUICK)
    judged = tracking_excess(base, columns, result.metrics)
    # One that misses its task on purpose is no failure.
    left = np.where(judged.on_purpose, np.minimum(judged.largest, 1.0), judged.largest)
    excess[list(moved)] = np.where((result.status == COMPLETED) & np.isfinite(left), left, math.inf)
    return excess.tolist()
