"""Division of a study into blocks of runs (chunks), and the varied values of each run.

Runs are numbered configuration by configuration, within a configuration grid point by grid point (the last axis
fastest), and within a grid point draw by draw. A chunk never contains runs of two configurations.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.simulation.scenario import Scenario
from ppafo.studies.distributions import Floats
from ppafo.studies.draws import Uncertainty, uniform_numbers
from ppafo.studies.study import Configuration, Study, with_followers

MAXIMUM_RUNS_OF_CHUNK = 65_536
"""Largest number of runs of a chunk, unless the study sets another number."""
_FEWEST_RUNS_OF_CHUNK = 512
"""Smallest number of runs of a chunk when its size is reduced to limit memory or time."""
# Number of chunks of each configuration of a small study, so that an interrupt loses little, and smallest number of
# time steps of a full chunk, which keeps the processors busy: some tenths of a second to some seconds.
_CHUNKS_OF_SMALL_STUDY = 16
_FEWEST_STEPS = 2**22
_MAXIMUM_STEPS = 2**25
"""Largest number of time steps, summed over runs, between two progress reports: some seconds of processor time."""
_FIRST_RUNS_OF_CHUNK = 64
"""Number of runs of the first chunk of a configuration, and of every chunk with a Python controller. Later chunks
double up to the full size, so that an interrupt loses at most about half of the computing time."""
_MAXIMUM_BYTES_OF_TRACES = 48_000_000
"""Largest size of the traces of a chunk during computation [bytes]."""


@dataclass(frozen=True, slots=True)
class Chunk:
    """Block of runs of one configuration.

    ``number`` is the chunk number, ``configuration`` the index of its configuration, ``first`` the index of its first
    run within the configuration, and ``runs`` the number of runs.
    """

    number: int
    configuration: int
    first: int
    runs: int


def chunks_of(study: Study) -> list[Chunk]:
    """Return the chunks of a study, as many for each configuration: the first ones short, each twice the one before."""
    size = _full_size(study)
    chunks = list[Chunk]()
    total = study.runs_of_configuration
    for configuration in range(len(study.configurations)):
        first = 0
        runs = size if study.runs_of_chunk is not None else min(size, _FIRST_RUNS_OF_CHUNK)
        while first < total:
            chunks.append(Chunk(len(chunks), configuration, first, min(runs, total - first)))
            first = first + runs
            runs = min(2 * runs, size)
    return chunks


def _full_size(study: Study) -> int:
    """Return the number of runs of a full chunk; it is smaller if traces are kept or the study has few long runs."""
    if study.runs_of_chunk is not None:
        return study.runs_of_chunk
    if any(configuration.scenario.controller.custom is not None for configuration in study.configurations):
        return _FIRST_RUNS_OF_CHUNK
    numbers = len(study.outputs.traces) * max(samples_of(study, each) for each in study.configurations)
    size = min(runs_at_once(configuration.scenario, MAXIMUM_RUNS_OF_CHUNK) for configuration in study.configurations)
    while size > _FEWEST_RUNS_OF_CHUNK and 8 * size * numbers > _MAXIMUM_BYTES_OF_TRACES:
        size //= 2
    steps = max(each.scenario.run.duration / each.scenario.run.step for each in study.configurations)
    share = math.ceil(study.runs_of_configuration / _CHUNKS_OF_SMALL_STUDY)
    return min(size, max(share, _FIRST_RUNS_OF_CHUNK, math.ceil(_FEWEST_STEPS / steps)))


def runs_at_once(scenario: Scenario, most: int) -> int:
    """Return the number of runs between two progress reports: ``most``, or fewer for long runs."""
    steps = scenario.run.duration / scenario.run.step
    while most > _FEWEST_RUNS_OF_CHUNK and most * steps > _MAXIMUM_STEPS:
        most //= 2
    return most


def samples_of(study: Study, configuration: Configuration) -> int:
    """Return the number of samples of a trace in a configuration."""
    return int(configuration.scenario.run.duration / study.outputs.every + 1.0e-9) + 1


def drawn_values(study: Study, runs: NDArray[np.int64]) -> dict[str, Floats]:
    """Return values [SI] by varied path for ascending run indices, the same in every configuration."""
    point, draw = np.divmod(runs, study.sample.runs)
    columns: dict[str, Floats] = {}
    for axis in reversed(study.axes):
        point, index = np.divmod(point, len(axis.values))
        columns[axis.path] = np.asarray(axis.values)[index]
    if study.drawn:
        dimensions = len(study.drawn)
        # Of a small sample all numbers are made and these taken, of a large one only the stretches that are needed.
        if study.sample.runs <= MAXIMUM_RUNS_OF_CHUNK:
            uniform = uniform_numbers(study.sample, dimensions, 0, study.sample.runs)[draw]
        else:
            parts = np.split(draw, np.flatnonzero(np.diff(draw) != 1) + 1)
            uniform = np.concatenate(
                [uniform_numbers(study.sample, dimensions, int(part[0]), part.size) for part in parts]
            )
        columns |= Uncertainty(study.drawn, study.scores).columns(uniform)
    return {path: columns[path] for path in study.paths}


def varied_columns(study: Study, configuration: Configuration, values: dict[str, Floats]) -> dict[str, Floats]:
    """Return the columns of varied values that apply in a configuration, and of paths that share these values."""
    own = {path: column for path, column in values.items() if study.varies(path, configuration.name)}
    count = len(next(iter(values.values()), ())) or 1
    return with_followers(own, study.same_in(configuration.name)) or unvaried(configuration.scenario, count)


def unvaried(scenario: Scenario, runs: int) -> dict[str, Floats]:
    """Return columns that leave a scenario unchanged, because an ensemble needs at least one column."""
    return {"supply.pressure": np.full(runs, scenario.device.supply.pressure)}
