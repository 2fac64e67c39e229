"""The built-in gait: what it is, its files, and how it is scaled."""

import dataclasses
import re
import subprocess
import sys
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.gait import Gait, at_speed, list_gaits, load_gait, speed_range, walk_recording
from ppafo.gait.document import gait_toml, json_schema
from ppafo.gait.loading import parse_gait

ROOT = Path(__file__).parents[3]
PHASES = np.linspace(0.0, 1.0, 201)


def test_the_sampled_curve_is_the_scalar_one(normative: Gait) -> None:
    scalar = [normative.ankle_angle.value(phase) for phase in PHASES.tolist()]
    assert np.allclose(normative.ankle_angle.sampled(PHASES), scalar, atol=1e-8)


def test_signs_are_those_of_the_package(normative: Gait) -> None:
    shank, ankle = normative.shank_angle, normative.ankle_angle
    assert shank.value(0.0) > 0.2, "at heel strike the ankle is in front of the knee"
    assert shank.value(normative.stance_share) < -0.7, "at toe-off it is behind"
    foot = np.degrees(ankle.sampled([0.2, 0.3]) - np.pi / 2.0 - shank.sampled([0.2, 0.3]))
    assert np.all(np.abs(foot) < 6.0), "with a flat foot the ankle angle is 90 deg plus the shank angle"
    assert ankle.sampled(PHASES).argmax() / 200.0 > normative.stance_share, "the toes point down after push-off"
    moment = normative.curve("ankle_moment").sampled(PHASES)
    assert moment.max() > 1.3
    assert moment.max() > -5.0 * moment.min()


def test_a_gait_file_read_back_is_the_same_gait(normative: Gait) -> None:
    again = parse_gait(gait_toml(normative).encode(), "again.toml")
    assert dataclasses.replace(again, shank_angle=normative.shank_angle, ankle_angle=normative.ankle_angle) == normative
    assert np.allclose(again.ankle_angle.sampled(PHASES), normative.ankle_angle.sampled(PHASES), rtol=0.0, atol=1e-12)


def test_the_shipped_gaits_fit_the_published_schema() -> None:
    import tomllib

    for name in list_gaits():
        text = (ROOT / "src" / "ppafo" / "gait" / "normative" / f"{name}.toml").read_text(encoding="utf-8")
        jsonschema.validate(tomllib.loads(text), json_schema())


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('time = "1.0384 s"', 'time = "1.0384"', r"stride.time = '1.0384': a number without a unit does not fit"),
        ('time = "1.0384 s"', 'time = "1038 s"', "stride.time = '1038 s' is not allowed; it lies between 0.3 and 5 s"),
        ('body_mass = "62.0 kg"', 'mass = "62.0 kg"', "unknown key 'subject.mass', did you mean 'body_mass'"),
        ("mean = -19.59538", "mean = nan", "shank_angle.mean = nan"),
        ("cosine = [20.60635, ", "cosine = [", "shank_angle has 5 numbers in cosine and 6 in sine"),
        ('unit = "N m/kg"', 'unit = "N m"', r"ankle_moment.unit = 'N m' is not allowed, did you mean 'N m/kg'"),
        ('origin = "measured"', 'origin = "guess"', "origin = 'guess' is not allowed"),
    ],
)
def test_a_wrong_gait_file_is_refused_with_key_and_value(normative: Gait, old: str, new: str, message: str) -> None:
    text = gait_toml(normative)
    assert old in text
    with pytest.raises(DataError, match=f"^bad.toml: .*{re.escape(message) if '(' in message else message}"):
        parse_gait(text.replace(old, new, 1).encode(), "bad.toml")


def test_an_unknown_gait_is_answered_with_the_nearest() -> None:
    with pytest.raises(DataError, match="there is no gait 'falisse2019', did you mean 'falisse2019-subject1'"):
        load_gait("falisse2019")
    with pytest.raises(DataError, match="has no curve 'ankle_angel', did you mean 'ankle_angle'"):
        load_gait().curve("ankle_angel")


def test_a_scaled_gait_keeps_the_walk_ratio_and_all_curves(normative: Gait) -> None:
    slow = at_speed(normative, 1.1)
    ratio = [gait.walking_speed * gait.stride_time**2 for gait in (normative, slow) if gait.walking_speed is not None]
    assert ratio[1] == pytest.approx(ratio[0], rel=1e-12)
    assert slow.stride_time > normative.stride_time
    assert slow.curves == normative.curves
    assert at_speed(slow, 1.33).stride_time == pytest.approx(normative.stride_time, rel=1e-12)
    assert speed_range(slow) == speed_range(normative)
    again = parse_gait(gait_toml(slow).encode(), "slow.toml")
    assert (again.walking_speed, again.recorded_speed, again.stride_time) == (1.1, 1.33, slow.stride_time)


@pytest.mark.parametrize("speed", [1.0, 1.7, float("nan")])
def test_a_speed_outside_the_range_is_refused_with_the_range(normative: Gait, speed: float) -> None:
    with pytest.raises(DataError, match=r"can be scaled from 1.06 to 1.6 m/s, not to"):
        at_speed(normative, speed)


@pytest.mark.parametrize("change", [{"body_mass": 0.0}, {"stride_time": float("nan")}, {"stance_share": 1.0}])
def test_numbers_that_no_gait_has_are_refused(normative: Gait, change: dict[str, float]) -> None:
    with pytest.raises(DataError, match="gait 'falisse2019-subject1': body mass"):
        dataclasses.replace(normative, **change)  # type: ignore[arg-type]


def test_a_gait_without_a_speed_cannot_be_scaled(normative: Gait) -> None:
    with pytest.raises(DataError, match="has no walking speed"):
        at_speed(dataclasses.replace(normative, walking_speed=None), 1.2)


def test_a_gait_that_is_recorded_below_the_limit_of_the_walk_ratio_is_not_slowed_down(normative: Gait) -> None:
    slow = dataclasses.replace(normative, walking_speed=0.9)
    assert speed_range(slow)[0] == 0.9
    assert speed_range(dataclasses.replace(normative, walking_speed=1.1))[0] == 1.03


def test_a_walk_repeats_the_stride_and_is_marked_synthetic(normative: Gait) -> None:
    walk = walk_recording(normative, 3)
    assert walk.kind == "synthetic"
    assert walk.duration == pytest.approx(3.0 * normative.stride_time)
    assert walk["shank_angle"][-1] == pytest.approx(walk["shank_angle"][0], abs=1e-9)
    with pytest.raises(DataError, match="0 strides"):
        walk_recording(normative, 0)


def test_the_built_in_gait_is_what_the_script_makes_of_the_data(shared_data: Path) -> None:
    folder = shared_data / "gait" / "falisse2019_derived"
    done = subprocess.run(
        [sys.executable, ROOT / "scripts" / "fit_built_in_gait.py", folder], capture_output=True, text=True, check=True
    )
    shipped = ROOT / "src" / "ppafo" / "gait" / "normative" / "falisse2019-subject1.toml"
    assert done.stdout == shipped.read_text(encoding="utf-8")


LARGEST_FIT_ERRORS = {
    "shank_angle": ("phi_deg", 0.26),
    "ankle_angle": ("ankle_deg", 0.16),
    "ankle_moment": ("ankle_moment_Nm_kg", 0.0035),
    "vertical_force": ("vGRF_BW", 0.028),
}


@pytest.mark.parametrize("name", LARGEST_FIT_ERRORS)
def test_the_series_stay_as_near_to_the_data_as_the_notes_say(normative: Gait, shared_data: Path, name: str) -> None:
    table = np.genfromtxt(
        shared_data / "gait" / "falisse2019_derived" / "falisse2019_s1_1p33_stride.csv", delimiter=",", names=True
    )
    column, largest = LARGEST_FIT_ERRORS[name]
    series = normative.curves[name].sampled(table["pct"] / 100.0)
    if name == "ankle_angle":
        series = 0.5 * np.pi - series
    if name.endswith("_angle"):
        series = np.degrees(series)
    left = np.abs(series - table[column])
    assert left.max() < largest
    assert left.mean() < 0.2 * table[f"{column}_sd"].mean(), "far below what strides differ by"


def test_the_rate_of_the_shank_is_the_recorded_one(normative: Gait, shared_data: Path) -> None:
    table = np.genfromtxt(
        shared_data / "gait" / "falisse2019_derived" / "falisse2019_s1_1p33_stride.csv", delimiter=",", names=True
    )
    rates = [np.degrees(normative.shank_angle.rate(p / 100.0, normative.stride_time)) for p in table["pct"]]
    left = np.array(rates) - table["phidot_deg_s"]
    assert np.max(np.abs(left)) < 0.015 * np.ptp(table["phidot_deg_s"])
    assert np.sqrt(np.mean(left**2)) < 0.25 * np.sqrt(np.mean(table["phidot_deg_s_sd"] ** 2))


def test_stride_times_of_the_subject_follow_the_law_of_the_scaling(normative: Gait, shared_data: Path) -> None:
    trials = np.genfromtxt(
        shared_data / "gait" / "falisse2019_derived" / "falisse2019_s1_trials.csv", delimiter=",", names=True
    )
    scaled = [at_speed(normative, speed).stride_time for speed in trials["speed_m_s_est"]]
    error = np.array(scaled) / trials["stride_time_s_est"] - 1.0
    unscaled = normative.stride_time / trials["stride_time_s_est"] - 1.0
    assert np.abs(error).max() < 0.03
    assert np.sqrt(np.mean(error**2)) < 0.7 * np.sqrt(np.mean(unscaled**2))
