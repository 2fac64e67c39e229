"""Runs in chunks: which runs belong together, and the values of theirs.

Runs are numbered configuration by configuration, in each grid point by grid point (the last axis fastest), at each
draw by draw. A chunk never holds runs of two configurations.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.studies.sweep.sampling.correlation import correlated
from ppafo.studies.sweep.sampling.distributions import Floats
from ppafo.studies.sweep.sampling.uniforms import uniform_numbers
from ppafo.studies.sweep.study import Configuration, Study, with_followers

MOST_RUNS_OF_CHUNK = 65_536
_FEWEST_RUNS_OF_CHUNK = 512
_MOST_BYTES_OF_TRACES = 48_000_000


@dataclass(frozen=True, slots=True)
class Chunk:
    """Some runs of one configuration: number of the chunk, first run of its configuration, and how many."""

    number: int
    configuration: int
    first: int
    runs: int


def chunk_size(study: Study) -> int:
    """Return the runs of a full chunk: fewer where channels over time are kept, so that memory stays small."""
    if study.runs_of_chunk is not None:
        return study.runs_of_chunk
    bytes_of_run = 8 * len(study.outputs.traces) * most_samples(study)
    size = MOST_RUNS_OF_CHUNK
    while size > _FEWEST_RUNS_OF_CHUNK and size * bytes_of_run > _MOST_BYTES_OF_TRACES:
        size //= 2
    return size


def most_samples(study: Study) -> int:
    """Return how many samples a channel over time has, in the longest configuration."""
    longest = max(configuration.scenario.duration for configuration in study.configurations)
    return int(longest / study.outputs.every + 1.0e-9) + 1


def chunk_count(study: Study) -> int:
    """Return the number of all chunks."""
    return len(study.configurations) * -(-study.runs_of_configuration // chunk_size(study))


def chunk(study: Study, number: int) -> Chunk:
    """Return a chunk by its number."""
    size = chunk_size(study)
    configuration, place = divmod(number, -(-study.runs_of_configuration // size))
    first = place * size
    return Chunk(number, configuration, first, min(size, study.runs_of_configuration - first))


def drawn_values(study: Study, runs: NDArray[np.int64]) -> dict[str, Floats]:
    """Return the values [SI] of all varied paths for ascending runs of one configuration; the same in each of them."""
    point, draw = np.divmod(runs, study.sample.runs)
    columns: dict[str, Floats] = {}
    for axis in reversed(study.axes):
        point, place = np.divmod(point, len(axis.values))
        columns[axis.path] = np.asarray(axis.values)[place]
    if study.drawn:
        columns |= _distributed(study, draw)
    return {path: columns[path] for path in study.paths}


def varied_columns(study: Study, configuration: Configuration, values: dict[str, Floats]) -> dict[str, Floats]:
    """Return the values that the runs of a configuration get."""
    own = {path: column for path, column in values.items() if study.varies(path, configuration.name)}
    return with_followers(own, study.same_in(configuration.name))


def _distributed(study: Study, draws: NDArray[np.int64]) -> dict[str, Floats]:
    """Return the values of the distributions."""
    uniform = _uniform_numbers(study, draws)
    if study.scores is not None:
        uniform = correlated(uniform, study.scores)
    columns = np.ascontiguousarray(uniform.T)
    return {item.path: item.distribution.values(columns[row]) for row, item in enumerate(study.drawn)}


def _uniform_numbers(study: Study, draws: NDArray[np.int64]) -> Floats:
    """Return the uniform numbers of some draws: of a small sample all and from these, of a large one in stretches."""
    dimensions = len(study.drawn)
    if study.sample.runs <= MOST_RUNS_OF_CHUNK:
        return uniform_numbers(study.sample, dimensions, 0, study.sample.runs)[draws]
    starts = np.flatnonzero(np.diff(draws, prepend=draws[0] - 2) != 1)
    stretches = np.split(draws, starts[1:])
    return np.concatenate([uniform_numbers(study.sample, dimensions, int(part[0]), part.size) for part in stretches])
