"""Static torque: planted values come back, intervals hold them, and what cannot be used is refused."""

import numpy as np
import pytest

from ppafo.errors import IdentificationError
from ppafo.identification.source import RecordingSource
from ppafo.identification.tolerances import Tolerances
from tests.unit.identification import planted
from tests.unit.identification.planted import static_torque

GROWTH = "effects.seal_friction.static_per_pressure"


def changed(source: RecordingSource, name: str, values: np.ndarray) -> RecordingSource:
    return RecordingSource(source.recording.with_channel(name, values, source.recording.unit(name)))


def test_without_noise_every_planted_value_comes_back() -> None:
    result = static_torque((planted.static(noise=0.0, growth=8.0e-7),))
    assert result["actuator.torque_constant"].value == pytest.approx(planted.TORQUE_CONSTANT, rel=1e-6)
    assert result["friction.static_torque"].value == pytest.approx(planted.STATIC_TORQUE, rel=1e-6)
    assert result[GROWTH].value == pytest.approx(8.0e-7, rel=1e-6)
    assert result["static_torque.zero_offset"].value == pytest.approx(planted.OFFSET, rel=1e-6)


def test_intervals_hold_friction_and_its_growth_in_about_the_stated_share_of_recordings() -> None:
    results = [static_torque((planted.static(growth=4.0e-7, seed=seed),)) for seed in range(40)]
    for path, truth in (("friction.static_torque", planted.STATIC_TORQUE), (GROWTH, 4.0e-7)):
        assert sum(item[path].low <= truth <= item[path].high for item in results) >= 36
    assert sum(bool(item.conflict) for item in results) <= 2


def test_the_gains_of_the_sensors_widen_the_torque_constant_and_are_named() -> None:
    known = Tolerances(gain=0.0)
    usual, exact = (
        static_torque((planted.static(),), tolerances=item)["actuator.torque_constant"]
        for item in (Tolerances(), known)
    )
    assert usual.wider_half_width > 1.2 * exact.wider_half_width
    assert "gain of the pressure sensor" in usual.explanation
    assert "gain" not in exact.explanation


def test_a_pressure_sensor_that_is_off_by_its_tolerance_is_no_fault() -> None:
    source = planted.static()
    off = changed(source, "pressure_difference", source.recording["pressure_difference"] + 0.15 * planted.PSI)
    result = static_torque((off,))
    constant = result["actuator.torque_constant"]
    assert (result.conflict, constant.verdict) == ("", "identified")
    assert constant.low <= planted.TORQUE_CONSTANT <= constant.high


def test_constant_friction_has_no_growth_that_could_be_identified() -> None:
    assert static_torque((planted.static(),))[GROWTH].verdict == "not identifiable"


def test_a_scale_that_only_pulls_does_not_bias_the_slope() -> None:
    result = static_torque((planted.static(noise=0.0, floor=0.0),))
    assert result["actuator.torque_constant"].value == pytest.approx(planted.TORQUE_CONSTANT, rel=1e-5)
    assert result["friction.static_torque"].value == pytest.approx(planted.STATIC_TORQUE, rel=1e-5)


def test_a_bent_characteristic_holds_for_this_model_only() -> None:
    source = planted.static()
    pressure = source.recording["pressure_difference"]
    bent = static_torque((changed(source, "torque", source.recording["torque"] + 2.0 * (pressure / 6.5e5) ** 2),))
    assert bent["actuator.torque_constant"].verdict == "holds for this model only"
    assert "fitted alone, " in bent.conflict
    assert static_torque((source,)).conflict == ""


def test_samples_of_a_stroke_are_one_reading() -> None:
    once = planted.static().recording
    many = {name: (np.repeat(once[name], 50), once.unit(name)) for name in once.names}
    repeated = static_torque((planted.source("many", np.arange(50.0 * len(once)), **many),))
    single = static_torque((planted.static(),))
    path = "friction.static_torque"
    assert repeated[path].wider_half_width == pytest.approx(single[path].wider_half_width, rel=1e-3)


def test_a_direction_that_is_turned_round_is_told_and_not_fitted() -> None:
    with pytest.raises(IdentificationError, match="a wrong sign of 'direction'"):
        static_torque((planted.static(sign=-1.0),))


def test_a_direction_that_is_none_is_named_with_its_sample() -> None:
    source = planted.static()
    values = source.recording["direction"].copy()
    values[4] = 0.5
    with pytest.raises(IdentificationError, match=r"'direction' is 0\.5 at sample 5"):
        static_torque((changed(source, "direction", values),))


def test_the_jitter_of_one_commanded_pressure_is_no_range_of_pressures() -> None:
    source = planted.static()
    pressure = source.recording["pressure_difference"]
    jitter = 5.0e5 + 1.2e4 * (pressure / pressure.max())
    with pytest.raises(IdentificationError, match=r"not 1; pressures closer than 7\.4.* psi \(10 %.*count as one"):
        static_torque((changed(source, "pressure_difference", jitter),))


@pytest.mark.parametrize("amplitude", [0.3e3, 0.9e3])
def test_jitter_about_no_pressure_is_no_range_of_pressures(amplitude: float) -> None:
    source = planted.static()
    pressure = source.recording["pressure_difference"]
    jitter = amplitude * (2.0 * pressure / pressure.max() - 1.0)
    with pytest.raises(IdentificationError, match=r"not 1; pressures closer than 0\.3 psi \(\[bench\] zero_of_pre"):
        static_torque((changed(source, "pressure_difference", jitter),))


@pytest.mark.parametrize("higher", np.linspace(1.5e5, 6.0e5, 10).tolist())
def test_jitter_of_the_second_pressure_is_no_third_one(higher: float) -> None:
    source = planted.static()
    pressure = source.recording["pressure_difference"]
    jitter = 0.04 * higher * (pressure / pressure.max())
    two = np.where(np.arange(pressure.size) % 2 == 0, 1.0e5 + 0.1 * jitter, higher + jitter)
    with pytest.raises(IdentificationError, match="3 different pressures or more, not 2"):
        static_torque((changed(source, "pressure_difference", two),))


def test_a_friction_that_falls_with_pressure_is_not_called_identified() -> None:
    result = static_torque((planted.static(growth=-1.0e-6),))
    assert result[GROWTH].verdict == "holds for this model only"
    assert "as if pressure loosened the seal" in result.conflict


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
    load: str, moves: str, slope: str, friction: str
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
