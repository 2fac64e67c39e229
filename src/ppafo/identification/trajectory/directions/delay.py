"""A clock of the recording that is late."""

from dataclasses import replace

import numpy as np

from ppafo.identification.trajectory.directions.changes import stacked
from ppafo.identification.trajectory.directions.kind import Column
from ppafo.identification.trajectory.problem import TIME_OFFSET
from ppafo.identification.trajectory.residuals import (
    Floats,
    PreparedExperiment,
    Residuals,
    numbers_in,
    prepare_samples,
    trajectories,
)

LATEST = 3.0e-4
"""Delay of a clock [s] that can be believed."""


def delay_columns(residuals: Residuals, point: Floats) -> list[Column]:
    """Return the column of a late clock at fitted coordinates, none where the delay itself is fitted."""
    if any(item.path == TIME_OFFSET for item in residuals.ranges):
        return []
    return [
        Column(
            "delay",
            "the clock of the recording seems to be off by {size}",
            "the clock of the recording is not off by more than {size}",
            lambda size: f"{1e3 * size:.2g} ms",
            -LATEST,
            LATEST,
            np.concatenate([_late(one, residuals, point) for one in residuals.experiments]),
        )
    ]


def _late(prepared: PreparedExperiment, residuals: Residuals, point: Floats) -> Floats:
    """Return the change of the channels over their noise per second of delay of the record."""
    numbers = numbers_in(prepared.label, residuals.ranges, point)
    samples = replace(prepared.samples, reach=max(prepared.samples.reach, LATEST))
    finer = prepare_samples(prepared.label, prepared.scenario, samples, numbers, prepared.recorded)
    step = 0.1 * float(np.median(np.diff(prepared.time)))
    ends = [
        stacked(prepared, values)[:, 0]
        for offset in (step, -step)
        for (values,) in (trajectories([replace(finer, time_offset=offset)], residuals.ranges, point[None, :]),)
    ]
    return np.asarray((ends[0] - ends[1]) / (2.0 * step))
