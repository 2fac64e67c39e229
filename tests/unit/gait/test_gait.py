"""The built-in gait: what it is, its files, and how it is scaled."""

import dataclasses
import math
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.gait import Gait, at_speed, list_gaits, load_gait, speed_range, walk_recording
from ppafo.gait.document import gait_toml, json_schema, parse_gait
from ppafo.gait.finding import gait_finding
from ppafo.gait.gait import KNEE, GaitCurve
from ppafo.gait.plausible import gait_file_remarks
from ppafo.gait.recorded import ImportedGait, ImportSettings, import_gait
from ppafo.storage import write_csv

ROOT = Path(__file__).parents[3]
PHASES = np.linspace(0.0, 1.0, 201)


MEAN, COSINES, SINES, STRIDE_TIME = 0.3, (0.5, -0.2, 0.05), (-0.1, 0.4, 0.02), 1.1
CURVE = GaitCurve(MEAN, COSINES, SINES, 0.1)


@pytest.mark.parametrize("phase", [-0.3, 0.0, 0.17, 0.5, 0.99, 7.25])
def test_a_curve_is_the_sum_of_its_series_and_has_its_derivatives(phase: float) -> None:
    angles = [2.0 * math.pi * order * phase for order in (1, 2, 3)]
    wanted = MEAN + sum(a * math.cos(x) + b * math.sin(x) for a, b, x in zip(COSINES, SINES, angles, strict=True))
    assert CURVE.value(phase) == pytest.approx(wanted, abs=1e-12)
    step = 1e-4
    before, now, after = (phase + k * step / STRIDE_TIME for k in (-1, 0, 1))
    slope = (CURVE.value(after) - CURVE.value(before)) / (2.0 * step)
    rate = CURVE.derivative(STRIDE_TIME)
    assert rate.value(now) == pytest.approx(slope, abs=1e-4)
    bend = (rate.value(after) - rate.value(before)) / (2.0 * step)
    assert rate.derivative(STRIDE_TIME).value(now) == pytest.approx(bend, abs=1e-3)


def test_a_scaled_curve_differs_between_strides_as_much_more() -> None:
    twice = CURVE.scale(-2.0)
    assert twice.deviation == 0.2
    np.testing.assert_allclose(twice.values_at(PHASES), -2.0 * CURVE.values_at(PHASES))


def test_signs_are_those_of_the_package(normative: Gait) -> None:
    shank, ankle = normative.shank_angle, normative.ankle_angle
    assert shank.value(0.0) > 0.2, "at heel strike the ankle is in front of the knee"
    assert shank.value(normative.stance_share) < -0.7, "at toe-off it is behind"
    foot = np.degrees(ankle.values_at([0.2, 0.3]) - np.pi / 2.0 - shank.values_at([0.2, 0.3]))
    assert np.all(np.abs(foot) < 6.0), "with a flat foot the ankle angle is 90 deg plus the shank angle"
    assert ankle.values_at(PHASES).argmax() / 200.0 > normative.stance_share, "the toes point down after push-off"
    moment = normative.curve("ankle_moment").values_at(PHASES)
    assert moment.max() > 1.3
    assert moment.max() > -5.0 * moment.min()


def test_a_gait_file_read_back_is_the_same_gait(normative: Gait) -> None:
    again = parse_gait(gait_toml(normative).encode(), "again.toml")
    assert dataclasses.replace(again, shank_angle=normative.shank_angle, ankle_angle=normative.ankle_angle) == normative
    assert np.allclose(
        again.ankle_angle.values_at(PHASES), normative.ankle_angle.values_at(PHASES), rtol=0.0, atol=1e-12
    )


def test_the_shipped_gaits_fit_the_published_schema() -> None:
    validator = jsonschema.Draft202012Validator(json_schema())
    assert list_gaits()
    for name in list_gaits():
        text = (ROOT / "src" / "ppafo" / "gait" / "normative" / f"{name}.toml").read_text(encoding="utf-8")
        assert not list(validator.iter_errors(tomllib.loads(text)))


def test_a_gait_file_that_no_leg_walks_is_refused(normative: Gait) -> None:
    ankle = dataclasses.replace(normative.ankle_angle.scale(-1.0), mean=math.pi - normative.ankle_angle.mean)
    with pytest.raises(DataError, match=r"^bad.toml: .*the sign is reversed"):
        parse_gait(gait_toml(dataclasses.replace(normative, ankle_angle=ankle)).encode(), "bad.toml")


def test_a_gait_file_needs_no_knee_but_not_half_of_one(normative: Gait) -> None:
    half = dataclasses.replace(normative, knee_up=None)
    with pytest.raises(DataError, match=r"half.toml: knee_forward needs knee_up; give both or neither"):
        parse_gait(gait_toml(half).encode(), "half.toml")
    without = dataclasses.replace(normative, knee_forward=None, knee_up=None)
    again = parse_gait(gait_toml(without).encode(), "without.toml")
    assert again.knee_forward is again.knee_up is None
    assert at_speed(again, 1.2).knee_up is None


def test_a_scaled_gait_keeps_the_walk_ratio_and_all_curves(normative: Gait) -> None:
    slow = at_speed(normative, 1.1)
    ratio = [gait.walking_speed * gait.stride_time**2 for gait in (normative, slow) if gait.walking_speed is not None]
    assert ratio[1] == pytest.approx(ratio[0], rel=1e-12)
    assert slow.stride_time > normative.stride_time
    kept = {name: curve for name, curve in normative.curves.items() if name not in KNEE}
    assert {name: slow.curves[name] for name in kept} == kept
    assert at_speed(slow, 1.33).stride_time == pytest.approx(normative.stride_time, rel=1e-12)
    assert speed_range(slow) == speed_range(normative)
    again = parse_gait(gait_toml(slow).encode(), "slow.toml")
    assert (again.walking_speed, again.recorded_speed, again.stride_time) == (1.1, 1.33, slow.stride_time)


def test_the_way_of_the_knee_stays_when_the_speed_changes(normative: Gait) -> None:
    slow = at_speed(at_speed(normative, 1.2), 1.1)
    for name in KNEE:
        ways = [gait.curve(name).scale(gait.stride_time**2).values_at(PHASES) for gait in (normative, slow)]
        np.testing.assert_allclose(ways[1], ways[0], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("speed", [1.0, 1.7, float("nan")])
def test_a_speed_outside_the_range_is_refused_with_the_range(normative: Gait, speed: float) -> None:
    with pytest.raises(DataError, match=r"can be scaled to speeds of 1.06 to 1.6 m/s, not to"):
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
    with pytest.raises(DataError, match=r"strides = 0: must be from 1"):
        walk_recording(normative, 0)


def test_the_built_in_gait_is_what_the_script_makes_of_the_data(shared_data: Path) -> None:
    command = [sys.executable, ROOT / "scripts" / "fit_built_in_gait.py", shared_data / "gait"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
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
    series = normative.curves[name].values_at(table["pct"] / 100.0)
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
    rate = normative.shank_angle.derivative(normative.stride_time)
    left = np.degrees(rate.values_at(table["pct"] / 100.0)) - table["phidot_deg_s"]
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


@pytest.mark.parametrize(("tilt", "remarked"), [(0.0, ""), (5.0, "tilted by 9.6 deg"), (-12.0, "tilted by 7.4 deg")])
def test_an_ankle_zero_that_is_off_is_remarked(tilt: float, remarked: str) -> None:
    gait = load_gait()
    moved = replace(gait, ankle_angle=replace(gait.ankle_angle, mean=gait.ankle_angle.mean + math.radians(tilt)))
    remarks = gait_file_remarks(parse_gait(gait_toml(moved).encode(), "moved.toml"))
    assert bool(remarks) == bool(remarked)
    assert all(remarked in line for line in remarks)


@pytest.mark.parametrize("tilt", [17.0, -26.0])
def test_an_ankle_zero_that_no_standing_foot_has_is_refused(tilt: float) -> None:
    gait = load_gait()
    moved = replace(gait, ankle_angle=replace(gait.ankle_angle, mean=gait.ankle_angle.mean + math.radians(tilt)))
    with pytest.raises(
        DataError, match=r"implies a foot tilted by -?2\d deg in mid-stance \(plausible: up to 20 deg\)"
    ):
        parse_gait(gait_toml(moved).encode(), "moved.toml")


def test_a_stature_is_written_and_read_and_its_limits_are_said() -> None:
    text = gait_toml(replace(load_gait(), stature=1.71))
    assert parse_gait(text.encode(), "tall.toml").stature == 1.71
    with pytest.raises(DataError, match=r"subject.stature = '171 m': must be at least 0.5 m and at most 2.5 m"):
        parse_gait(text.replace("1.71 m", "171 m").encode(), "tall.toml")


@pytest.fixture
def imported(tmp_path: Path) -> ImportedGait:
    path = write_csv(tmp_path / "walk.csv", walk_recording(load_gait(), 5))
    return import_gait([path], ImportSettings(62.0))


def test_the_ankle_angle_is_drawn_from_neutral_with_dorsiflexion_positive(imported: ImportedGait) -> None:
    gait = load_gait()
    flexion = 90.0 - np.degrees(gait.ankle_angle.values_at([0.45, 0.67]))
    assert flexion[0] > 10.0, "the shank leans forward over the foot before push-off"
    assert flexion[1] < -10.0, "the toes point down after push-off"
    np.testing.assert_allclose(gait_finding(gait).plot().axes[1].lines[-1].get_ydata()[[45, 67]], flexion)
    drawn = gait_finding(imported.gait, imported).plot().axes[1].lines
    np.testing.assert_allclose(drawn[2].get_ydata(), 90.0 - np.degrees(imported.curves["ankle_angle"].curves[0]))
