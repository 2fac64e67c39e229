"""The meter of strides counts what the recording of the same walk has stride by stride."""

import numpy as np
import pytest

from ppafo.metrics.strides import METER, PER_STRIDE, SETTLING, StrideMeter
from ppafo.signals.meter import EnergySample, FootSample, GasSample, ReferenceSummary, Sample, StrideSample
from ppafo.walking.strides import per_stride, stride_starts

NO_COURSE = ReferenceSummary(*[0.0] * len(ReferenceSummary._fields))
SAMPLES = 80
ON_TOES = {5: 1.0, 15: 0.0, 25: 0.0, 35: 1.0, 45: 0.0, 55: 1.0, 65: 1.0}
"""Samples of the heel strikes, 1 where the toes met the ground before the heel."""


def totals() -> dict[str, np.ndarray]:
    """Running totals of a walk of six whole strides, by the names that a sample has for them."""
    strides, landings = np.zeros(SAMPLES), np.zeros(SAMPLES)
    for strike, toes in ON_TOES.items():
        strides[strike:] += 1.0
        landings[strike:] += toes
    time = np.arange(SAMPLES) * 0.01
    return {
        "strides": strides,
        "toe_landings": landings,
        "supplied_mass": time**2,
        "positive_push_off_work": time**3,
        "net_push_off_work": time**3 - 0.1 * strides,
        "clearances": 0.01 * strides,
    }


def metered(columns: dict[str, np.ndarray], first: int = 0) -> StrideMeter:
    """The meter after all samples from one on."""
    blank = StrideSample(*[0.0] * len(StrideSample._fields))
    strides = [
        blank._replace(**{name: float(column[at]) for name, column in columns.items()}) for at in range(first, SAMPLES)
    ]
    nothing = GasSample(*[0.0] * 5), EnergySample(*[0.0] * 5), FootSample(0.0, 0.0, 0.0)
    rows = [Sample(*[0.0] * 11, *nothing, stride=stride) for stride in strides]
    state: StrideMeter = METER.start(NO_COURSE, rows[0])
    for row in rows[1:]:
        state = METER.update(state, NO_COURSE, row)
    return state


@pytest.mark.parametrize("first", [0, 10])
def test_sums_over_strides_are_those_of_the_recording(first: int) -> None:
    columns = totals()
    ended = metered(columns, first)
    paths = {item.total: item.total.rpartition(".")[2] for item in PER_STRIDE.values()}
    recorded = {path: columns[name][first:] for path, name in paths.items()}
    found = per_stride(recorded, stride_starts(columns["strides"][first:]))
    assert ended.averaged == found["gas"].size - SETTLING > 0
    for name, values in found.items():
        assert getattr(ended.sums, name) == pytest.approx(values[SETTLING:].sum()), name


def test_a_landing_on_the_toes_is_that_of_the_stride_that_it_begins() -> None:
    # Strides begin at 25, 35, 45 and 55 after the first two; the landing at 65 begins one that does not end.
    assert metered(totals()).sums.toe_landing == 2.0
