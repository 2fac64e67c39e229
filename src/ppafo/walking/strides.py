"""A walk stride by stride: numbers of each stride, and curves averaged over strides at equal phases."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.control.walking.signs import HELPS
from ppafo.metrics.strides import PER_STRIDE
from ppafo.signals import CHANNELS, Recording

Floats = NDArray[np.float64]

PHASES = np.linspace(0.0, 1.0, 101)
"""Phases from heel strike to heel strike at which curves are averaged."""


@dataclass(frozen=True, slots=True)
class Curves:
    """Mean and standard deviation over strides of one channel at ``PHASES``."""

    mean: Floats
    deviation: Floats
    unit: str


def stride_starts(strides: Floats) -> NDArray[np.intp]:
    """Samples right after each heel strike, from the running number of strikes."""
    return np.flatnonzero(np.diff(strides) > 0.5) + 1


def per_stride(totals: Mapping[str, Floats], starts: NDArray[np.intp]) -> dict[str, Floats]:
    """Numbers of each whole stride [SI], shape (strides,), from running totals at the heel strikes."""
    # A landing on the toes is counted in the step of the strike, of which ``starts`` has the sample after it.
    firsts = {name: starts - 1 if name == "toe_landing" else starts for name in PER_STRIDE}
    return {name: np.diff(totals[item.total][firsts[name]]) for name, item in PER_STRIDE.items()}


def helped_strides(level: Floats, starts: NDArray[np.intp]) -> NDArray[np.bool_]:
    """True for each whole stride that had help from strike to strike, from the level of ``control.walking.signs``."""
    vented = np.concatenate([[0], np.cumsum(level > HELPS)])
    return np.asarray(vented[starts[1:]] == vented[starts[:-1]])


def samples_of(chosen: NDArray[np.bool_], starts: NDArray[np.intp], samples: int) -> NDArray[np.bool_]:
    """True for each sample in one of the chosen strides."""
    edges = np.zeros(samples + 1)
    np.add.at(edges, starts[:-1][chosen], 1.0)
    np.add.at(edges, starts[1:][chosen], -1.0)
    return np.asarray(np.cumsum(edges)[:-1] > 0.5)


def mean_curves(
    recording: Recording, starts: NDArray[np.intp], chosen: NDArray[np.bool_] | None = None
) -> dict[str, Curves]:
    """Mean and deviation of every channel over strides brought to the same phases, in its SI unit; {} without strides.

    ``chosen`` are the strides (strides,) to take, all unless given. Channels that hold their value between samples,
    such as the command, have no mean.
    """
    if starts.size < 2 or (chosen is not None and not chosen.any()):
        return {}
    times = times_of_phases(recording.time, starts)
    times = times if chosen is None else times[chosen]
    names = [name for name in recording.names if not (name in CHANNELS and CHANNELS[name].is_held)]
    return {name: _curves(np.interp(times, recording.time, recording[name]), recording.unit(name)) for name in names}


def times_of_phases(time: Floats, starts: NDArray[np.intp]) -> Floats:
    """Times [s] of ``PHASES`` in each stride, shape (strides, phases)."""
    first, last = time[starts[:-1]], time[starts[1:]]
    return np.asarray(first[:, None] + PHASES * (last - first)[:, None])


def _curves(strides: Floats, unit: str) -> Curves:
    return Curves(strides.mean(axis=0), strides.std(axis=0), unit)
