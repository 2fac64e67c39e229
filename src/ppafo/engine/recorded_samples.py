"""Running evaluation of recorded samples by pure functions, compiled for all recordings once; Python gives the same."""

from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from itertools import repeat
from typing import Any, NamedTuple

import numpy as np

from ppafo.engine.compilers import Effort
from ppafo.engine.entries import ARRAY, HEADER, INLINE, INT, entry_text
from ppafo.engine.lanes import Floats, current_source
from ppafo.engine.loading import compiled
from ppafo.engine.rows import leaf_paths, leaves, rebuilt, row_expression
from ppafo.engine.source_text import MadeFrom, SourceCollector


class RunningEvaluation(NamedTuple):
    """Evaluation of samples one after the other, from a state at the first one.

    ``state`` and ``sample`` are NamedTuple classes, ``channels`` the numbers of a sample that are recorded; all others
    are 0. ``update(state, sample, later)`` returns the next state, with the sample whose index ``ahead(state, sample)``
    returns, at most the last one.
    """

    state: Any
    sample: Any
    channels: tuple[str, ...]
    ahead: Callable[[Any, Any], float]
    update: Callable[[Any, Any, Any], Any]


def evaluate_samples(evaluation: RunningEvaluation, start: Callable[[Any], Any], columns: Mapping[str, Floats]) -> Any:
    """State after all of some recorded columns (samples,), from the state that ``start`` returns at the first one."""
    channels = [columns[name] for name in evaluation.channels]
    zeros = rebuilt(evaluation.sample, repeat(0.0))

    def sample_of(row: Iterable[float]) -> Any:
        return zeros._replace(**dict(zip(evaluation.channels, row, strict=True)))

    state = start(sample_of(float(channel[0]) for channel in channels))
    module = compiled(current_source("recorded", evaluation, _written), Effort.QUICK)
    if module is not None:
        numbers = np.array(leaves(state), dtype=np.float64)
        module.evaluate(numbers, np.array(channels, dtype=np.float64), len(channels[0]))
        return rebuilt(evaluation.state, numbers.tolist())
    samples = list(map(sample_of, zip(*(channel.tolist() for channel in channels), strict=True)))
    for sample in samples[1:]:
        later = min(int(evaluation.ahead(state, sample)), len(samples) - 1)
        state = evaluation.update(state, sample, samples[later])
    return state


@lru_cache(maxsize=8)
def _written(evaluation: RunningEvaluation) -> tuple[MadeFrom, str]:
    """Inputs and source text of an evaluation; its entry ``evaluate`` changes the numbers of the state."""
    collector = SourceCollector(INLINE)
    numbers = leaf_paths(evaluation.state, "state")
    ahead = collector.add(evaluation.ahead)
    update = collector.add(evaluation.update)
    stored = {path: f"numbers[{place}]" for place, path in enumerate(numbers)}

    def sample_at(index: str) -> str:
        cells = dict.fromkeys(leaf_paths(evaluation.sample, "sample"), "0.0")
        cells |= {f"sample.{name}": f"columns[{row}, {index}]" for row, name in enumerate(evaluation.channels)}
        return row_expression(evaluation.sample, "sample", cells, collector.add)

    lines = [
        f"state = {row_expression(evaluation.state, 'state', stored, collector.add)}",
        "for index in range(1, count):",
        f"    sample = {sample_at('index')}",
        f"    later = min(int({ahead}(state, sample)), count - 1)",
        f"    state = {update}(state, sample, {sample_at('later')})",
        *(f"{cell} = {path}" for path, cell in stored.items()),
    ]
    entry = entry_text("evaluate", {"numbers": ARRAY, "columns": "float64[:, ::1]", "count": INT}, lines)
    return collector.made_from, f"{HEADER}\n\n{collector.text()}\n\n\n{entry}"
