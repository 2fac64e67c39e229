"""Draws about the runs of ``ppafo.golden_bits``, and the golden hashes of both made anew.

The rows of a run are made by its plan. Those of a draw are theirs times factors from whole numbers alone, so that no
library has a part in them.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.lanes import Batch, BatchResult, Clock, run_batch
from ppafo.engine.rows import row_numbers
from ppafo.golden_bits import Hashes, digest, hash_of, names, plain_batch

Runner = Callable[[Batch], BatchResult]
DRAWS = 1000
LONGEST_DRAWN = 200
"""Steps of a draw at most."""
LONGEST_STEPS = 40
"""The same of steps as long as the gas of a vane that rests allows: one that fails takes 100,000 parts for each."""
LONGEST_WALKED = 1000
"""The same of a walk: some tenths of its first stride, and more."""
SEED = 15
SPREAD = (0.7, 1.4)
"""Smallest and largest factor on a number of a draw."""
_IMPOSSIBLE = (-1.0, 0.0, 1.0e6, float("nan"))
"""Factors on one number in one draw of ten."""
_TIMING_ROWS, _RESULT_ROWS = 5, 4
"""Rows of the clock and of the outcome: draws leave them as they are."""


def drawn_batch(batch: Batch, runs: int = DRAWS, seed: int = SEED) -> Batch:
    """Return runs like the one of a batch, each with all its numbers times factors of its own; none is recorded."""
    parameters = np.repeat(batch.parameters, runs, axis=1)
    states = np.repeat(batch.states, runs, axis=1)
    # Steps and delays stay: others would be another clock.
    parameters[_TIMING_ROWS:] *= _factors(parameters[_TIMING_ROWS:].shape, seed)
    for path, row in row_numbers(batch.program.parameter_rows()).items():
        # Numbers of a shape go together: a lever of another length has other lengths at its stops.
        if path.startswith("plant.shape."):
            parameters[row] = batch.parameters[row]
    states[_RESULT_ROWS:] *= _factors(states[_RESULT_ROWS:].shape, seed + 1)
    # In one run of ten a number is what no plan would give: it may fail, and must fail alike.
    for run in range(0, runs, 10):
        word = int(_words(np.array([run], np.uint64), seed + 2)[0])
        rows = len(parameters) - _TIMING_ROWS
        parameters[_TIMING_ROWS + word // 4 % rows, run] *= _IMPOSSIBLE[word % 4]
    longest = LONGEST_WALKED if batch.program.walks else LONGEST_STEPS if batch.program.is_adaptive else LONGEST_DRAWN
    clock: Clock = replace(batch.clock, record_every=0, step_count=min(batch.clock.step_count, longest))
    return Batch(batch.program, clock, parameters, states)


def _factors(shape: tuple[int, ...], seed: int) -> NDArray[np.float64]:
    """Factors in ``SPREAD`` from whole numbers below 2^32, by one product and one sum each."""
    count = int(np.prod(shape))
    low, high = SPREAD
    share = _words(np.arange(count, dtype=np.uint64), seed).astype(np.float64) * 2.0**-32
    return (low + (high - low) * share).reshape(shape)


def _words(numbers: NDArray[np.uint64], seed: int) -> NDArray[np.uint64]:
    """Words of 32 bits that look unrelated to their numbers; xor, shift and a product, thrice."""
    words = numbers * np.uint64(0x9E3779B9) + np.uint64(seed) * np.uint64(0x85EBCA6B) & np.uint64(0xFFFFFFFF)
    for factor in (0x7FEB352D, 0x6C50B47D, 0x45D9F3B):
        words = (words ^ words >> np.uint64(16)) * np.uint64(factor) & np.uint64(0xFFFFFFFF)
    mixed: NDArray[np.uint64] = words ^ words >> np.uint64(16)
    return mixed


def failures(result: BatchResult) -> int:
    """Return how many runs left what is possible."""
    return int((result.states[1] < 1.0e300).sum())


def hashes_of(name: str, run: Callable[[Batch], Runner], draws: int = DRAWS) -> dict[str, str | int]:
    """Return the hashes of the rows, of the run and of the draws of a name, and how many draws failed.

    ``run`` is given a batch and returns what runs those of its program.
    """
    batch = plain_batch(name)
    runner = run(batch)
    drawn = runner(drawn_batch(batch, draws))
    # The hash of the rows that a plan made.
    return {
        "rows": hash_of((batch.parameters, batch.states)),
        "run": digest(runner(batch)),
        "draws": digest(drawn),
        "failed": failures(drawn),
    }


def new_golden_hashes() -> Hashes:
    """Return the hashes of all runs as this computer finds them."""
    return {name: hashes_of(name, lambda _batch: run_batch) for name in names()}
