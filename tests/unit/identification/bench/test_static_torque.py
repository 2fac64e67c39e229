"""Static torque: planted values come back, intervals cover them, and what cannot be used is refused."""

from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from ppafo.errors import IdentificationError
from ppafo.identification.bench import StaticTorqueSettings, static_torque
from ppafo.identification.bench.static_torque import static_prospects
from ppafo.identification.source import Source


def without(source: Source, name: str) -> Source:
    channels = {key: item for key, item in source.recording.channels.items() if key != name}
    return Source(replace(source.recording, channels=channels), source.reference)


def changed(source: Source, name: str, values: np.ndarray) -> Source:
    return Source(source.recording.with_channel(name, values, source.recording.unit(name)))


def test_without_noise_every_planted_value_comes_back_exactly(planted: ModuleType) -> None:
    result = static_torque((planted.static(noise=0.0),))
    assert result["actuator.torque_constant"].value == pytest.approx(planted.TORQUE_CONSTANT, rel=1e-9)
    assert result["friction.static_torque"].value == pytest.approx(planted.STATIC_TORQUE, rel=1e-9)
    assert result["static_torque.zero_offset"].value == pytest.approx(planted.OFFSET, rel=1e-9)


def test_the_interval_covers_the_torque_constant_in_about_the_stated_share_of_repetitions(planted: ModuleType) -> None:
    estimates = [static_torque((planted.static(seed=seed),))["actuator.torque_constant"] for seed in range(60)]
    inside = sum(item.low <= planted.TORQUE_CONSTANT <= item.high for item in estimates)
    assert inside >= 54
    assert max(item.relative_half_width for item in estimates) < 0.03


def test_friction_that_grows_with_pressure_is_seen_and_measured(planted: ModuleType) -> None:
    growth = 8.0e-7
    found = static_torque((planted.static(growth=growth),))["static_torque.friction_per_pressure"]
    assert found.low <= growth <= found.high
    assert found.low > 0.0
    assert "grows" in static_torque((planted.static(growth=growth),))["friction.static_torque"].explanation


def test_constant_friction_is_not_said_to_grow(planted: ModuleType) -> None:
    result = static_torque((planted.static(),))
    assert "no growth" in result["friction.static_torque"].explanation
    assert result["static_torque.friction_per_pressure"].verdict == "not identifiable"


def test_friction_that_grows_fails_its_check_and_constant_friction_hardly_ever_does(planted: ModuleType) -> None:
    def grows(growth: float, seed: int) -> bool:
        result = static_torque((planted.static(growth=growth, seed=seed),))
        return "friction over pressure" in [check.name for check in result.failed]

    assert sum(grows(0.0, seed) for seed in range(200)) <= 6
    assert all(grows(4.0e-7, seed) for seed in range(50))


def test_friction_that_grows_says_which_pressure_it_is_for_and_what_is_left_without_one(planted: ModuleType) -> None:
    growth, inside = 8.0e-7, 0
    for seed in range(60):
        result = static_torque((planted.static(growth=growth, seed=seed),))
        friction, left = result["friction.static_torque"], result["static_torque.friction_at_no_pressure"]
        assert (friction.verdict, friction.condition) == ("holds for this model only", "at 327.5 kPa")
        inside += left.low <= planted.STATIC_TORQUE - growth * 47.5 * planted.PSI <= left.high
    assert inside >= 54
    assert static_torque((planted.static(),))["friction.static_torque"].verdict_in_words == "identified"


def test_a_scale_that_only_pulls_does_not_bias_the_slope(planted: ModuleType) -> None:
    result = static_torque((planted.static(noise=0.0, floor=0.0),))
    assert result["actuator.torque_constant"].value == pytest.approx(planted.TORQUE_CONSTANT, rel=1e-6)
    assert result["friction.static_torque"].value == pytest.approx(planted.STATIC_TORQUE, rel=1e-6)


def test_repetitions_that_differ_widen_the_interval(planted: ModuleType) -> None:
    source = planted.static()
    gains = 1.0 + 0.03 * (source.recording["repetition"] - 2.0)
    drifting = changed(source, "torque", source.recording["torque"] * gains)
    steady, moved = (static_torque((item,))["actuator.torque_constant"] for item in (source, drifting))
    assert moved.half_width > 3.0 * steady.half_width
    assert "repetitions" in moved.explanation


def test_calibration_enters_the_interval(planted: ModuleType) -> None:
    plain = static_torque((planted.static(),))["actuator.torque_constant"]
    told = static_torque((planted.static(),), StaticTorqueSettings(calibration=0.05))["actuator.torque_constant"]
    assert told.half_width == pytest.approx(np.hypot(plain.half_width, 0.05 * plain.value))


def test_a_bent_characteristic_fails_its_check(planted: ModuleType) -> None:
    source = planted.static()
    pressure = source.recording["pressure_difference"]
    bent = changed(source, "torque", source.recording["torque"] + 2.0 * (pressure / pressure.max()) ** 2)
    assert [check.name for check in static_torque((bent,)).failed] == ["straight line"]
    assert static_torque((source,)).failed == ()


def test_a_missing_falling_branch_is_named(planted: ModuleType) -> None:
    source = planted.static()
    rising = changed(source, "direction", np.maximum(source.recording["direction"], 0.0))
    with pytest.raises(IdentificationError, match="static: static-torque: the falling branch is missing"):
        static_torque((rising,))


def test_a_missing_channel_is_named_with_what_the_file_has(planted: ModuleType) -> None:
    with pytest.raises(IdentificationError, match=r"needs a channel 'direction \[-\]'.*the file has torque"):
        static_torque((without(planted.static(), "direction"),))


def test_a_direction_that_is_turned_round_is_told_and_not_fitted(planted: ModuleType) -> None:
    with pytest.raises(IdentificationError, match="reverse the sign of channel 'direction'"):
        static_torque((planted.static(sign=-1.0),))


def test_a_direction_that_is_none_is_named_with_its_sample(planted: ModuleType) -> None:
    source = planted.static()
    values = source.recording["direction"].copy()
    values[4] = 0.5
    with pytest.raises(IdentificationError, match=r"'direction' is 0\.5 at sample 5"):
        static_torque((changed(source, "direction", values),))


def test_a_stuck_scale_is_refused(planted: ModuleType) -> None:
    source = planted.static()
    with pytest.raises(IdentificationError, match="'torque' is 1 N m throughout"):
        static_torque((changed(source, "torque", np.ones(len(source.recording))),))


def test_a_saturated_scale_is_refused(planted: ModuleType) -> None:
    source = planted.static()
    with pytest.raises(IdentificationError, match=r"stays at 7 N m for \d+ samples.*saturated"):
        static_torque((changed(source, "torque", np.minimum(source.recording["torque"], 7.0)),))


def test_one_pressure_is_too_few(planted: ModuleType) -> None:
    source = planted.static()
    two = np.where(source.recording["pressure_difference"] > 3e5, 6e5, 1e5)
    with pytest.raises(IdentificationError, match="3 different pressures or more, there are 2"):
        static_torque((changed(source, "pressure_difference", two),))


def test_synthetic_recordings_make_a_synthetic_result(planted: ModuleType) -> None:
    assert static_torque((planted.static(),)).kind == "synthetic"


def test_an_outlier_is_named_with_its_file_and_sample(planted: ModuleType) -> None:
    source = planted.static()
    torque = source.recording["torque"].copy()
    torque[[50, 90]] += [4.0, 3.0]
    wild = Source(changed(source, "torque", torque).recording, "bench.csv sha256:0")
    checks = static_torque((planted.static(seed=2), wild)).checks
    told = next(check.statement for check in checks if check.name == "outliers")
    assert "the worst is sample 51 of bench.csv" in told


def test_a_branch_at_a_single_pressure_does_not_show_whether_friction_grows(planted: ModuleType) -> None:
    whole = planted.static()
    time, pressure = whole.recording.time, whole.recording["pressure_difference"]
    kept = (whole.recording["direction"] > 0.0) | (pressure == pressure[10])
    few = Source(whole.recording.resample(time[kept]))
    result = static_torque((few,))
    assert "measure both branches at several pressures" in result.failed[-1].statement
    assert result["static_torque.friction_per_pressure"].verdict == "not identifiable"
    assert not any(one.can_be_had for one in static_prospects((few,), StaticTorqueSettings()))


@pytest.mark.parametrize(
    ("load", "moves", "slope", "friction"),
    [
        ("torque", "pressure", "actuator.torque_constant", "friction.static_torque"),
        ("torque", "position", "actuator.torque_constant", "friction.dynamic_torque"),
        ("force", "pressure", "static_torque.area", "static_torque.static_friction"),
        ("force", "position", "static_torque.area", "static_torque.dynamic_friction"),
    ],
)
def test_the_friction_is_that_of_what_moved_in_the_unit_of_what_was_measured(
    planted: ModuleType, load: str, moves: str, slope: str, friction: str
) -> None:
    held = planted.static().recording
    strokes = np.repeat(np.arange(6), 20)
    within = np.tile(np.linspace(0.0, 1.0, 20), 6)
    # Held, the position only shakes; sliding, it goes to and fro while the pressure rises slowly.
    shaking = 1e-4 * np.sin(np.arange(120.0))
    position = shaking if moves == "pressure" else np.where(strokes % 2 == 0, within, 1.0 - within)
    order = np.arange(120) if moves == "pressure" else np.argsort(held["pressure_difference"], kind="stable")
    pressure = held["pressure_difference"][order]
    direction = held["direction"] if moves == "pressure" else np.where(strokes % 2 == 0, 1.0, -1.0)
    readings = planted.TORQUE_CONSTANT * pressure - direction * planted.STATIC_TORQUE
    recording = planted.source(
        "load",
        held.time,
        **{load: (readings + 0.01 * shaking, "N m" if load == "torque" else "N")},
        pressure_difference=(pressure, "Pa_d"),
        direction=(direction, "-"),
        position=(position, "m"),
    )
    result = static_torque((recording,))
    assert result[slope].value == pytest.approx(planted.TORQUE_CONSTANT, rel=1e-3)
    assert result[friction].value == pytest.approx(planted.STATIC_TORQUE, rel=1e-3)
    assert (result[slope].unit, result[friction].unit) == (("m^3", "N m") if load == "torque" else ("m^2", "N"))
