"""Every procedure of the bench refuses or flags what its recording cannot carry, by file, channel and sample."""

from collections.abc import Callable

import numpy as np
import pytest

from ppafo.errors import IdentificationError
from ppafo.identification.bench.law import BenchResult
from ppafo.identification.source import RecordingSource
from ppafo.signals import Recording
from tests.unit.identification import planted
from tests.unit.identification.planted import free_decay, open_valve_flow, static_torque, valve_map, vane_leak

VOLUME = 60e-6
NEEDED = {
    "static-torque": ("torque", "pressure_difference", "direction"),
    "free-decay": ("angle",),
    "open-valve-flow": ("upstream_pressure", "downstream_pressure", "mass_flow"),
    "valve-map": ("command", "mass_flow", "upstream_pressure", "downstream_pressure"),
    "vane-leak": ("pressure_1", "pressure_2"),
}
Solve = Callable[[RecordingSource], BenchResult]


@pytest.fixture
def bench() -> dict[str, tuple[RecordingSource, Solve]]:
    """A good recording for each procedure, and the procedure."""
    co2 = planted.CO2
    leak = planted.leak("orifice", 3.39e-8)
    return {
        "static-torque": (planted.static(), lambda source: static_torque((source,))),
        "free-decay": (planted.decay(), lambda source: free_decay((source,))),
        "open-valve-flow": (planted.flow(), lambda source: open_valve_flow((source,), co2)),
        "valve-map": (planted.sweep(), lambda source: valve_map((source,), co2)),
        "vane-leak": (
            leak,
            lambda source: vane_leak((source,), co2, VOLUME, VOLUME / 1.3, discharge_coefficient=0.113),
        ),
    }


def changed(source: RecordingSource, name: str, values: np.ndarray) -> RecordingSource:
    return RecordingSource(source.recording.with_channel(name, values, source.recording.unit(name)), source.reference)


def retimed(source: RecordingSource, time: np.ndarray) -> RecordingSource:
    recording = source.recording
    return RecordingSource(Recording(recording.label, time, recording.channels, recording.kind), source.reference)


def refusal(solve: Solve, source: RecordingSource) -> str:
    with pytest.raises(IdentificationError) as caught:
        solve(source)
    text = str(caught.value)
    assert text.startswith(f"{source.name}: ")
    assert "\n" not in text
    return text


@pytest.mark.parametrize(("kind", "channel"), [(kind, name) for kind, names in NEEDED.items() for name in names])
def test_a_missing_channel_is_named(bench: dict[str, tuple[RecordingSource, Solve]], kind: str, channel: str) -> None:
    source, solve = bench[kind]
    kept = {name: item for name, item in source.recording.channels.items() if name != channel}
    bare = RecordingSource(Recording(source.recording.label, source.recording.time, kept))
    text = refusal(solve, bare)
    assert f"needs a channel '{channel} [" in text
    assert "; channels read: " in text


@pytest.mark.parametrize("kind", NEEDED)
def test_a_recording_that_is_too_short_is_refused(bench: dict[str, tuple[RecordingSource, Solve]], kind: str) -> None:
    source, solve = bench[kind]
    short = RecordingSource(source.recording.between(source.recording.time[0], source.recording.time[2]))
    assert "needs" in refusal(solve, short)


@pytest.mark.parametrize(
    ("kind", "channel", "words"),
    [
        ("static-torque", "torque", "'torque' is"),
        ("static-torque", "pressure_difference", "'pressure_difference' is"),
        ("static-torque", "direction", "falling branch is missing"),
        ("free-decay", "angle", "'angle' is"),
        ("open-valve-flow", "mass_flow", "'mass_flow' stays at"),
        ("valve-map", "command", "'command' is"),
        ("valve-map", "mass_flow", "'mass_flow' is"),
    ],
)
def test_a_constant_channel_is_refused(
    bench: dict[str, tuple[RecordingSource, Solve]], kind: str, channel: str, words: str
) -> None:
    source, solve = bench[kind]
    value = 1.0 if channel in ("direction", "angle") else float(source.recording[channel].mean())
    still = changed(source, channel, np.full(len(source.recording), value))
    assert words in refusal(solve, still)


def test_two_chambers_that_both_stand_still_are_refused(bench: dict[str, tuple[RecordingSource, Solve]]) -> None:
    source, solve = bench["vane-leak"]
    # One alone would be a room.
    for name, value in (("pressure_1", 3.0e5), ("pressure_2", 1.0e5)):
        source = changed(source, name, np.full(len(source.recording), value))
    assert "'pressure_1' is" in refusal(solve, source)


@pytest.mark.parametrize(
    ("kind", "channel", "share"),
    [
        ("static-torque", "torque", 0.8),
        ("static-torque", "pressure_difference", 0.5),
        ("free-decay", "angle", 0.6),
        ("open-valve-flow", "mass_flow", 0.7),
        ("vane-leak", "pressure_1", 0.6),
    ],
)
def test_a_saturated_sensor_is_refused_with_its_sample(
    bench: dict[str, tuple[RecordingSource, Solve]], kind: str, channel: str, share: float
) -> None:
    source, solve = bench[kind]
    values = source.recording[channel]
    limit = values.min() + share * np.ptp(values)
    text = refusal(solve, changed(source, channel, np.minimum(values, limit)))
    assert f"channel '{channel}' stays at" in text
    assert "sample" in text
    assert "saturated" in text


@pytest.mark.parametrize("kind", ["free-decay", "vane-leak"])
def test_a_gap_in_a_decay_is_refused_with_its_sample(
    bench: dict[str, tuple[RecordingSource, Solve]], kind: str
) -> None:
    source, solve = bench[kind]
    time = source.recording.time.copy()
    time[200:] += 3.0
    assert "gap of 3.0" in refusal(solve, retimed(source, time))
    assert "(sample 200)" in refusal(solve, retimed(source, time))


def test_a_saturated_flow_meter_is_told_and_a_valve_that_is_open_is_not(
    bench: dict[str, tuple[RecordingSource, Solve]],
) -> None:
    source, solve = bench["valve-map"]
    flow = source.recording["mass_flow"]
    clipped = solve(changed(source, "mass_flow", np.minimum(flow, 0.6 * flow.max())))
    assert any("'mass_flow' stays at" in remark and "from sample" in remark for remark in clipped.remarks)
    assert not any("'mass_flow'" in remark for remark in solve(source).remarks)


def test_noise_alone_is_no_decay(bench: dict[str, tuple[RecordingSource, Solve]]) -> None:
    source, solve = bench["free-decay"]
    noise = np.random.default_rng(3).normal(0.0, 2e-3, len(source.recording))
    assert "no motion" in refusal(solve, changed(source, "angle", noise))


def test_a_vane_that_runs_into_a_stop_is_not_taken_for_one_that_comes_to_rest(
    bench: dict[str, tuple[RecordingSource, Solve]],
) -> None:
    _, solve = bench["free-decay"]
    smooth = planted.decay(noise=0.0)
    angle = smooth.recording["angle"]
    stopped = changed(smooth, "angle", np.minimum(angle, angle.min() + 0.7 * np.ptp(angle)))
    assert "or at a stop" in refusal(solve, stopped)
    rests = planted.decay(noise=0.0, deceleration=0.8)
    assert solve(rests).estimates


def test_steps_of_a_coarse_converter_are_no_saturation(bench: dict[str, tuple[RecordingSource, Solve]]) -> None:
    source, solve = bench["vane-leak"]
    coarse = changed(source, "pressure_1", np.round(source.recording["pressure_1"], -4))
    assert solve(coarse).estimates


@pytest.mark.parametrize("kind", NEEDED)
def test_a_number_that_no_sensor_shows_is_refused_with_its_sample(
    bench: dict[str, tuple[RecordingSource, Solve]], kind: str
) -> None:
    source, solve = bench[kind]
    name = NEEDED[kind][0]
    values = source.recording[name].copy()
    values[6] = 1e300
    assert f"'{name}' is 1e+300 at sample 7" in refusal(solve, changed(source, name, values))
