"""Meters, sample by sample in Python, against the metrics of the recording that they stand for."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from ppafo.metrics import METRICS, evaluate
from ppafo.metrics.gas import ENERGIES
from ppafo.metrics.metric import Readings
from ppafo.metrics.switching import UNDECIDED, Swing, count_of, next_swing, reversals
from ppafo.signals import Channel, Recording
from ppafo.signals.meter import (
    SAME_LEVEL,
    EnergySample,
    FootSample,
    GasSample,
    MeterKind,
    ReferenceSummary,
    Sample,
    StrideSample,
    advance_course,
)

Floats = NDArray[np.float64]

INTERVAL = 0.01


def samples_of(recording: Recording) -> list[Sample]:
    names = ("angle", "angular_velocity", "pressure_1", "pressure_2", "torque", "command", "torque", "reference")
    names += ("temperature_1", "temperature_2", "foot_angle", "measured_foot_angle", "toe_difference")
    names += (*GasSample._fields, *EnergySample._fields)
    columns = zip(*(recording[name].tolist() for name in names), strict=True)
    stride = StrideSample(*[0.0] * len(StrideSample._fields))
    return [
        Sample(
            float(number),
            *values[:10],
            gas=GasSample(*values[13:18]),
            energy=EnergySample(*values[18:]),
            foot=FootSample(*values[10:13]),
            stride=stride,
        )
        for number, values in enumerate(columns)
    ]


def metered(meter: MeterKind, samples: Sequence[Sample], course: ReferenceSummary) -> tuple[Any, ReferenceSummary]:
    course = advance_course(course, samples[0])
    state = meter.start(course, samples[0])
    for sample in samples[1:]:
        course = advance_course(course, sample)
        state = meter.update(state, course, sample)
    return state, course


def columns_of(row: Any) -> Any:
    return type(row)(*[columns_of(value) if isinstance(value, tuple) else np.array([value]) for value in row])


def read(recording: Recording) -> dict[str, float]:
    """Every metric from meters, on a recording whose reference is monotone."""
    samples = samples_of(recording)
    reference = recording["reference"]
    largest = float(np.abs(reference).max())
    course = ReferenceSummary(float(reference[-1]), largest, SAME_LEVEL * largest, 0.0, float(len(samples)))
    of_torque = {name: kind for name, kind in METRICS.items() if kind.of_reference in ("", "torque")}
    of_recordings = {name: kind for name, kind in of_torque.items() if kind.compute is not None}
    meters = {meter.name: metered(meter, samples, course) for kind in of_recordings.values() for meter in kind.meters}
    ended = next(iter(meters.values()))[1]
    readings = Readings(
        meters={name: columns_of(state) for name, (state, _) in meters.items()},
        course=columns_of(ended),
        interval=np.array([INTERVAL]),
        samples=len(samples),
        traces={"angle": recording["angle"][:, None]},
    )
    with np.errstate(all="ignore"):
        return {name: float(kind.read(readings)[0]) for name, kind in of_recordings.items()}


def recorded(torque: Floats, reference: Floats, command: Floats, angle: Floats) -> Recording:
    time = INTERVAL * np.arange(torque.size)
    values = {
        "torque": (torque, "N m"),
        "reference": (reference, "N m"),
        "command": (command, "-"),
        "angle": (angle, "rad"),
        "angular_velocity": (np.gradient(angle, INTERVAL), "rad/s"),
        "pressure_1": (2e5 + 1e4 * torque, "Pa"),
        "pressure_2": (2e5 - 1e4 * torque, "Pa"),
        "supplied_mass": (1e-4 * time, "kg"),
        "vented_mass": (3e-5 * time, "kg"),
        "leaked_mass": (1e-5 * time, "kg"),
        "mass_1": (2e-5 + 4e-5 * time, "kg"),
        "mass_2": (3e-5 + 2e-5 * time, "kg"),
        "temperature_1": (293.0 - torque, "K"),
        "temperature_2": (293.0 + 2.0 * torque, "K"),
        "foot_angle": (angle - 1.0, "rad"),
        "measured_foot_angle": (0.9 * angle - 1.1, "rad"),
        "toe_difference": (0.01 * torque, "m"),
        **{name: (number * time, "J") for number, name in enumerate(ENERGIES, 1)},
    }
    return Recording("metered", time, {name: Channel(channel, unit) for name, (channel, unit) in values.items()})


@pytest.mark.parametrize("ramp", [0, 1, 7, 30, 58, 59, 80], ids=str)
@pytest.mark.parametrize("seed", range(5))
def test_meters_agree_with_the_recording_wherever_the_hold_begins(ramp: int, seed: int) -> None:
    draw = np.random.default_rng(seed)
    reference = np.minimum(np.arange(60) / ramp, 1.0) * 3.0 if ramp else np.full(60, 3.0)
    recording = recorded(
        reference + draw.normal(0.0, 0.3, 60),
        reference,
        np.round(draw.uniform(-1.0, 1.0, 60)),
        np.cumsum(draw.uniform(-0.01, 0.05, 60)),
    )
    expected = evaluate(recording)
    for name, value in read(recording).items():
        if name in expected:
            assert value == pytest.approx(expected[name].value, rel=1e-12, abs=1e-18), name
        else:
            assert np.isnan(value), name


def test_a_vane_that_stands_still_has_no_times_of_arrival_and_no_gas_per_work() -> None:
    recording = recorded(np.ones(9), np.ones(9), np.ones(9), np.ones(9))
    found = read(recording)
    assert np.isnan([found[name] for name in ("departure_time", "arrival_time", "gas_per_work")]).all()
    assert found["work_per_gas"] == 0.0


def test_a_vane_that_comes_back_has_no_times_of_arrival() -> None:
    angle = np.array([1.0, 1.2, 1.5, 1.2, 1.01])
    found = read(recorded(np.ones(5), np.ones(5), np.ones(5), angle))
    assert np.isnan([found[name] for name in ("departure_time", "arrival_time")]).all()


ROUNDED = st.floats(-10.0, 10.0).map(lambda value: round(value, 3))


@given(st.lists(ROUNDED, min_size=1, max_size=60), st.floats(0.1, 3.0))
def test_the_swing_of_the_lanes_counts_what_reversals_counts(values: list[float], swing: float) -> None:
    swing = round(swing, 1) + 0.00005  # so that rounding decides no case
    state = Swing(values[0], UNDECIDED, values[0])
    for value in values[1:]:
        state = next_swing(state, value, swing)
    assert count_of(np.array([state.turns]))[0] == reversals(np.array(values), swing)
