"""A repetition or a recording that disagrees is flagged by its name, and a grossly wrong reading is named."""

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ppafo.errors import IdentificationError
from ppafo.identification.bench.law import BenchResult
from ppafo.identification.source import RecordingSource
from ppafo.signals.recording import Floats
from tests.unit.identification import planted
from tests.unit.identification.planted import free_decay, open_valve_flow, static_torque, valve_map, vane_leak

Solve = Callable[[tuple[RecordingSource, ...]], BenchResult]
RESPONSES = {
    "decay": "angle",
    "flow": "mass_flow",
    "sweep": "mass_flow",
    "leak": "pressure_1",
    "steady": "mass_flow",
    "static": "torque",
}
OVER_TIME = ("decay", "leak")


@pytest.fixture
def solved() -> dict[str, Solve]:
    """The procedure for each kind of recording."""
    volumes, leaking = (60e-6, 60e-6 / 1.3), {"discharge_coefficient": 0.113}
    return {
        "decay": lambda sources: free_decay(sources, rise=0.0),
        "flow": lambda sources: open_valve_flow(sources, planted.CO2),
        "sweep": lambda sources: valve_map(sources, planted.CO2),
        "leak": lambda sources: vane_leak(sources, planted.CO2, *volumes, **leaking),
        "steady": lambda sources: vane_leak(sources, planted.CO2, *volumes, **leaking),
        "static": static_torque,
    }


def made(kind: str, seed: int) -> RecordingSource:
    """Return a right recording of a kind."""
    sized = {"leak": ("orifice", 3.39e-8), "steady": ("orifice", 3.39e-8)}
    return getattr(planted, kind)(*sized.get(kind, ()), seed=seed)  # type: ignore[no-any-return]


def changed(source: RecordingSource, name: str, values: Floats, file: str = "") -> RecordingSource:
    recording = source.recording.with_channel(name, values, source.recording.unit(name))
    return RecordingSource(replace(recording, label=file or recording.label))


@pytest.mark.parametrize("seed", [11, 12, 13])
@pytest.mark.parametrize("fault", ["gain", "zero"])
def test_a_repetition_of_another_gain_or_zero_is_named_and_not_weighed_out(
    solved: dict[str, Solve], fault: str, seed: int
) -> None:
    source = planted.static(seed=seed)
    torque = source.recording["torque"].copy()
    own = source.recording["repetition"] == 2.0
    torque[own] = 1.03 * torque[own] if fault == "gain" else torque[own] + 0.1
    result = solved["static"]((changed(source, "torque", torque),))
    assert result.conflict.startswith("repetition 2, fitted alone, would have other values")
    assert not any(item.is_identified for item in result.estimates)


@pytest.mark.parametrize("kind", ["decay", "flow", "sweep", "steady"])
def test_a_recording_of_another_gain_is_named_with_its_file(solved: dict[str, Solve], kind: str) -> None:
    name = RESPONSES[kind]
    right = tuple(made(kind, seed) for seed in (1, 2, 3))
    values = right[2].recording[name]
    wrong = changed(right[2], name, values[0] + 1.1 * (values - values[0]), "third.csv")
    assert solved[kind](right).conflict == ""
    assert solved[kind]((*right[:2], wrong)).conflict.startswith(
        "recording 3 (third.csv), fitted alone, would have other values"
    )


@pytest.mark.parametrize("kind", RESPONSES)
def test_a_reading_of_ten_times_its_value_is_named_before_a_fit(solved: dict[str, Solve], kind: str) -> None:
    name, source = RESPONSES[kind], made(kind, 5)
    values = source.recording[name].copy()
    # Neither about zero nor at the ends.
    at = int(np.flatnonzero(np.abs(values) > 0.5 * np.abs(values).max())[9])
    values[at] *= 10.0
    wrong = changed(source, name, values)
    if kind in OVER_TIME:
        assert_close(solved[kind]((wrong,)), solved[kind]((source,)), f"left out: 1 of .* samples where '{name}'")
        return
    with pytest.raises(IdentificationError, match=f"'{name}' is .* at sample {at + 1}, but .* around it"):
        solved[kind]((wrong,))


def assert_close(found: BenchResult, right: BenchResult, said: str) -> None:
    assert re.match(said, found.remarks[0])
    for one, other in zip(found.estimates, right.estimates, strict=True):
        assert one.value == pytest.approx(other.value, abs=other.high - other.value)


@pytest.mark.parametrize("kind", OVER_TIME)
def test_one_sample_in_a_hundred_that_is_wrong_is_left_out_and_one_in_twenty_refused(
    solved: dict[str, Solve], kind: str
) -> None:
    name, source = RESPONSES[kind], made(kind, 5)
    values = source.recording[name].copy()
    places = np.arange(40, values.size - 40, 100)
    values[places] += 2.0 * np.ptp(values) * (-1.0) ** places
    said = f"left out: {places.size} of .* samples where '{name}' .* the first is sample 41"
    assert_close(solved[kind]((changed(source, name, values),)), solved[kind]((source,)), said)
    values[10::20] *= 30.0
    with pytest.raises(IdentificationError, match=f"'{name}' is .*: a wrong reading, and so are samples"):
        solved[kind]((changed(source, name, values),))


@pytest.mark.parametrize("share", [0.005, 0.2])
def test_a_step_of_the_converter_near_rest_is_no_wrong_reading(solved: dict[str, Solve], share: float) -> None:
    source = made("leak", 5)
    room = np.full(len(source.recording), 101_325.0)
    room[:: int(1.0 / share)] += 250.0
    remarks = solved["leak"]((changed(source, "pressure_2", room),)).remarks
    assert any("is treated as a reservoir" in remark for remark in remarks)


@pytest.mark.parametrize(
    ("kind", "name"),
    [("static", "pressure_difference"), ("flow", "upstream_pressure"), ("sweep", "downstream_pressure")],
)
def test_a_pressure_of_ten_times_its_value_is_named_before_a_fit(
    solved: dict[str, Solve], kind: str, name: str
) -> None:
    source = made(kind, 5)
    values = source.recording[name].copy()
    at = int(np.argsort(values)[values.size // 2])
    values[at] *= 10.0
    with pytest.raises(IdentificationError, match=f"'{name}' is .* at sample {at + 1}, but .* around it"):
        solved[kind]((changed(source, name, values),))


def test_friction_that_grows_with_the_root_of_the_pressure_holds_for_this_model_only() -> None:
    flagged = 0
    for seed in range(10):
        source = planted.static(seed=seed)
        pressure, way = source.recording["pressure_difference"], source.recording["direction"]
        torque = source.recording["torque"] - 0.4 * way * np.sqrt(pressure / pressure.max())
        flagged += bool(static_torque((changed(source, "torque", torque),)).conflict)
    assert flagged >= 9
