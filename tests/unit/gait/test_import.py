"""Recorded files become the gait that is in them, whatever their form, unit and sign."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ppafo.errors import DataError
from ppafo.gait import Gait, walk_recording
from ppafo.gait.document import gait_toml, parse_gait
from ppafo.gait.finding import gait_finding
from ppafo.gait.gait import KNEE
from ppafo.gait.recorded import ImportSettings, import_gait
from ppafo.gait.recorded.mapping import (
    AngleMap,
    ForceMap,
    GaitMap,
    KneeMap,
    MomentMap,
    PressureMap,
    ShankMap,
    Side,
    package_map,
)
from ppafo.signals import Recording
from ppafo.signals.recording import Floats

PHASES = np.linspace(0.0, 1.0, 101)


def largest_difference(gait: Gait, truth: Gait, name: str) -> float:
    """Largest distance of a curve from the true one, both begun at the same heel strike."""
    shift = gait_start(truth)
    return float(np.max(np.abs(gait.curves[name].values_at(PHASES) - truth.curves[name].values_at(PHASES + shift))))


def gait_start(truth: Gait) -> float:
    """Phase at which the true vertical force passes the threshold of a heel strike, 5 % of body weight."""
    phases = np.linspace(0.0, 0.05, 5001)
    return float(phases[np.argmax(truth.curve("vertical_force").values_at(phases) > 0.05)])


LIMITS = {"shank_angle": 2e-3, "ankle_angle": 2e-3, "ankle_moment": 5e-3, "vertical_force": 5e-3}
KNEE_LIMIT = 0.05
"""Of an acceleration that reaches 12 m/s^2."""


def assert_same(gait: Gait, truth: Gait, names: tuple[str, ...] = tuple(LIMITS)) -> None:
    assert gait.stride_time == pytest.approx(truth.stride_time, rel=1e-4)
    assert gait.stance_share == pytest.approx(truth.stance_share, abs=0.01)
    assert {name for name in names if largest_difference(gait, truth, name) > LIMITS[name]} == set()


def test_a_csv_file_in_the_units_and_signs_of_the_package(
    csv_of: Callable[..., Path], columns: dict[str, Floats], normative: Gait
) -> None:
    found = import_gait([csv_of(columns)], ImportSettings(62.0, walking_speed=1.33))
    assert_same(found.gait, normative)
    assert found.events == "vertical_force"
    assert found.gait.strides == len(found.strides) == 5
    assert found.gait.walking_speed == 1.33
    assert found.gait.stride_time_deviation == pytest.approx(0.0, abs=1e-9)


def test_a_map_names_columns_signs_and_zero(
    csv_of: Callable[..., Path], columns: dict[str, Floats], normative: Gait
) -> None:
    changed = {
        "thigh [deg]": np.degrees(0.5 * columns["shank_angle [rad]"]),
        "lean [deg]": np.degrees(-0.5 * columns["shank_angle [rad]"]),
        "dorsiflexion [deg]": 95.0 - np.degrees(columns["ankle_angle [rad]"]),
        "moment [N m/kg]": -columns["ankle_moment [N m/kg]"],
        "plate [N]": -62.0 * 9.80665 * columns["vertical_force [-]"],
    }
    columns_map = GaitMap(
        shank_angle=ShankMap(terms=("lean", "-thigh"), positive="ankle_behind"),
        ankle_angle=AngleMap(terms=("dorsiflexion",), positive="dorsiflexion", neutral="5 deg"),
        ankle_moment=MomentMap(terms=("moment",), positive="dorsiflexion"),
        vertical_force=ForceMap(terms=("plate",), positive="down"),
    )
    assert_same(import_gait([csv_of(changed)], ImportSettings(62.0, columns=columns_map)).gait, normative)


DORSIFLEXION = AngleMap(terms=("ankle_angle",), positive="dorsiflexion")


def test_what_a_map_leaves_out_of_a_csv_file_is_read_by_its_names(
    csv_of: Callable[..., Path], columns: dict[str, Floats], normative: Gait
) -> None:
    turned = columns | {"ankle_angle [rad]": 0.5 * np.pi - columns["ankle_angle [rad]"]}
    found = import_gait([csv_of(turned)], ImportSettings(62.0, columns=GaitMap(ankle_angle=DORSIFLEXION)))
    assert_same(found.gait, normative)
    assert found.events == "vertical_force"
    assert "ankle_moment from 'ankle_moment'; vertical_force from 'vertical_force'" in "\n".join(found.remarks)
    # Columns of the package are of the right foot: a map of the left foot adds none of them.
    both = GaitMap(shank_angle=ShankMap(terms=("shank_angle",)), ankle_angle=DORSIFLEXION)
    left = import_gait([csv_of(turned)], ImportSettings(62.0, columns=both, side="left"))
    assert "ankle_moment" not in left.gait.curves
    assert "only the curves of the gait map are imported" in "\n".join(left.remarks)


def test_opensim_tables_of_one_walk(opensim_files: dict[str, Path], normative: Gait) -> None:
    found = import_gait(list(opensim_files.values()), ImportSettings(normative.body_mass))
    assert_same(found.gait, normative)
    # The tables of OpenSim do not state that a person was measured.
    assert found.gait.origin == "imported"
    assert 'origin = "imported"' in gait_toml(found.gait)
    assert str(gait_finding(found.gait, found)).splitlines()[0].endswith("(imported)")


@pytest.mark.parametrize("how", ["acceleration", "position", "backwards", "hip and thigh"])
def test_the_knee_is_read_as_acceleration_as_position_or_from_the_hip(
    csv_of: Callable[..., Path],
    columns: dict[str, Floats],
    walk: Recording,
    knee_way: Callable[[Floats], tuple[Floats, Floats]],
    normative: Gait,
    how: str,
) -> None:
    forward, up = knee_way(walk.time)
    rest = {name: values for name, values in columns.items() if not name.startswith("knee_")}
    lean = 0.3 * np.cos(6.0 * walk.time)
    hip = {"hip_x [m]": forward - 0.4 * np.sin(lean), "hip_y [m]": up + 0.4 * np.cos(lean), "thigh [rad]": lean}
    files, knee = {
        "acceleration": (columns, package_map().knee),
        "position": (rest | {"knee_forward [mm]": 1000.0 * forward, "knee_up [m]": up}, package_map().knee),
        "backwards": (rest | {"back [m]": -forward, "up [m]": up}, KneeMap(forward=("-back",), up=("up",))),
        "hip and thigh": (
            rest | hip,
            KneeMap(forward=("hip_x",), up=("hip_y",), thigh=("thigh",), thigh_length="40 cm"),
        ),
    }[how]
    columns_map = replace(package_map(), knee=knee, centre_of_pressure=None)
    found = import_gait([csv_of(files)], ImportSettings(62.0, columns=columns_map)).gait
    for name in KNEE:
        assert largest_difference(found, normative, name) < KNEE_LIMIT
        assert found.curve(name).deviation < KNEE_LIMIT, "all strides are alike"


@pytest.mark.parametrize("facing", [30.0, 90.0, 180.0, -120.0])
def test_a_walk_in_any_direction_is_that_along_x(
    opensim_files: dict[str, Path], normative: Gait, facing: float
) -> None:
    """The pelvis in the laboratory by SciPy's rotations: the walker turned about y, the angles about z, x and y."""
    path = opensim_files["ik"]
    head, _, body = path.read_text().partition("endheader\n")
    names, *lines = body.splitlines()
    table = dict(zip(names.split("\t"), np.array([line.split("\t") for line in lines], dtype=float).T, strict=True))
    forward, turned = table["pelvis_tx"], np.radians(facing)
    table["pelvis_tx"], table["pelvis_tz"] = np.cos(turned) * forward, -np.sin(turned) * forward
    placed = Rotation.from_euler("y", facing, degrees=True) * Rotation.from_euler("z", 4.0, degrees=True)
    for name, angle in zip(("tilt", "list", "rotation"), placed.as_euler("ZXY", degrees=True), strict=True):
        table[f"pelvis_{name}"] = np.full(forward.size, angle)
    rows = ["\t".join(f"{cell:.10f}" for cell in row) for row in np.column_stack(list(table.values()))]
    head = head.replace("nColumns=6", f"nColumns={len(table)}")
    path.write_text("\n".join([head + "endheader", "\t".join(table), *rows]) + "\n")
    found = import_gait(list(opensim_files.values()), ImportSettings(62.0, stature=0.4 / 0.245))
    assert max(largest_difference(found.gait, normative, name) for name in KNEE) < KNEE_LIMIT
    assert largest_difference(found.gait, normative, "shank_angle") < 0.01
    assert any("to the left of x (pelvis_rotation)" in remark for remark in found.remarks)


def test_a_hip_that_does_not_move_is_refused(opensim_files: dict[str, Path]) -> None:
    path = opensim_files["ik"]
    head, rows = path.read_text().split("time\t")
    labels, *lines = rows.splitlines()
    fixed = ["\t".join([*line.split("\t")[:5], "0.0", "0.9"]) for line in lines]
    path.write_text("\n".join([f"{head}time\t{labels}", *fixed, ""]))
    with pytest.raises(DataError, match=r"the hip does not move \(pelvis_tx is constant\)"):
        import_gait(list(opensim_files.values()), ImportSettings(62.0, stature=1.7))


def test_a_knee_that_is_carried_backwards_is_refused(
    csv_of: Callable[..., Path],
    columns: dict[str, Floats],
    walk: Recording,
    knee_way: Callable[[Floats], tuple[Floats, Floats]],
) -> None:
    forward, up = knee_way(walk.time)
    rest = {name: values for name, values in columns.items() if not name.startswith("knee_")}
    path = csv_of(rest | {"knee_forward [m]": forward - 2.6 * walk.time, "knee_up [m]": up})
    with pytest.raises(
        DataError,
        match=r"moves backwards at 1.3 m/s, so knee.forward points against the "
        "walking direction",
    ):
        import_gait([path], ImportSettings(62.0))


def test_without_a_force_the_strides_come_from_the_shank(opensim_files: dict[str, Path], normative: Gait) -> None:
    found = import_gait([opensim_files["ik"]], ImportSettings(normative.body_mass))
    assert found.events == "shank_angle"
    assert found.gait.stride_time == pytest.approx(normative.stride_time, rel=0.01)
    assert found.gait.stance_share == pytest.approx(normative.stance_share, abs=0.05)
    assert set(found.gait.curves) == {"shank_angle", "ankle_angle"}
    assert any("heel strikes and toe-offs are from shank_angle" in remark for remark in found.remarks)


def test_a_centre_of_pressure_is_bridged_over_swing(
    csv_of: Callable[..., Path], columns: dict[str, Floats], walk: Recording, normative: Gait
) -> None:
    phase = (walk.time / normative.stride_time) % 1.0
    pressure = np.where(phase < normative.stance_share, -0.05 + 0.25 * phase / normative.stance_share, -9.0)
    found = import_gait([csv_of({**columns, "centre_of_pressure [m]": pressure})], ImportSettings(62.0))
    curve = found.gait.curve("centre_of_pressure").values_at(PHASES)
    assert -0.1 < curve.min() < curve.max() < 0.25, "what the file shows in swing is not in it"
    middle = 0.5 * normative.stance_share
    assert found.gait.curve("centre_of_pressure").value(middle) == pytest.approx(0.075, abs=0.01)


def test_the_low_pass_takes_noise_away_and_leaves_the_curve(
    csv_of: Callable[..., Path], columns: dict[str, Floats], normative: Gait
) -> None:
    noise = np.random.default_rng(3).normal(0.0, 0.03, columns["ankle_angle [rad]"].size)
    path = csv_of({**columns, "ankle_angle [rad]": columns["ankle_angle [rad]"] + noise})
    rough, smooth = (import_gait([path], ImportSettings(62.0, low_pass=cut)).curves for cut in (None, 10.0))
    assert smooth["ankle_angle"].spread < 0.5 * rough["ankle_angle"].spread
    truth = normative.ankle_angle.values_at(PHASES + gait_start(normative))
    assert np.sqrt(np.mean((smooth["ankle_angle"].mean - truth) ** 2)) < 0.012


def test_the_low_pass_is_at_its_half_power_where_it_says() -> None:
    from ppafo.gait.recorded.signal import Signal, low_pass

    time = np.arange(0.0, 20.0, 0.005)
    passed = low_pass(Signal("sine", time, np.sin(2.0 * np.pi * 6.0 * time)), 6.0)
    assert np.max(passed.values[1000:3000]) == pytest.approx(2.0**-0.5, rel=0.01)


def test_strides_differ_as_much_as_they_were_made_to(csv_of: Callable[..., Path], normative: Gait) -> None:
    rng = np.random.default_rng(5)
    lengths = rng.normal(1.0, 0.03, 40)
    offsets = rng.normal(0.0, 0.04, 40)
    one = walk_recording(normative, 1)
    time = np.concatenate(
        [length * one.time[:-1] + start for length, start in zip(lengths, _starts(one, lengths), strict=True)]
    )
    parts = {f"{name} [{one.unit(name)}]": np.tile(one[name][:-1], 40) for name in one.names}
    parts["ankle_angle [rad]"] = parts["ankle_angle [rad]"] + np.repeat(offsets, one.time.size - 1)
    found = import_gait([csv_of(parts, time)], ImportSettings(62.0))
    assert found.gait.stride_time_deviation == pytest.approx(
        np.std(lengths[1:-1], ddof=1) * normative.stride_time, rel=0.1
    )
    assert found.gait.ankle_angle.deviation == pytest.approx(np.std(offsets, ddof=1), rel=0.1)
    assert found.curves["ankle_angle"].curves.shape == (found.gait.strides, 101)


def _starts(one: Recording, lengths: Floats) -> Floats:
    return np.concatenate([[0.0], np.cumsum(lengths * one.duration)[:-1]])


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_real_knee_taken_for_numbers_in_g_or_exchanged_is_refused(shared_data: Path, side: Side) -> None:
    folder = shared_data / "gait" / "opensim_subject01"
    files = [folder / "subject01_walk1_ik.mot", folder / "subject01_walk1_grf_15s.mot"]
    gait = import_gait(files, ImportSettings(72.6, side, stature=1.8034)).gait
    assert gait.knee_forward is not None
    assert gait.knee_up is not None
    in_g = {name: gait.curve(name).scale(1.0 / 9.80665) for name in KNEE}
    with pytest.raises(DataError, match=r"multiply both by 9\.80665"):
        parse_gait(gait_toml(replace(gait, **in_g)).encode(), "g.toml")
    other = replace(gait, knee_forward=gait.knee_up, knee_up=gait.knee_forward)
    with pytest.raises(DataError, match="the foot is flat; exchange them"):
        parse_gait(gait_toml(other).encode(), "other.toml")


def test_real_treadmill_walking_from_opensim(shared_data: Path) -> None:
    folder = shared_data / "gait" / "opensim_subject01"
    files = [folder / "subject01_walk1_ik.mot", folder / "subject01_walk1_grf_15s.mot"]
    right, left = (import_gait(files, ImportSettings(72.6, side=side)) for side in ("right", "left"))
    assert [round(item.start, 2) for item in right.strides] == [0.62, 1.86]
    assert [round(item.toe_off, 2) for item in right.strides] == [1.41, 2.63]
    for found in (right, left):
        assert found.gait.strides == 2
        assert found.gait.stride_time == pytest.approx(1.22, abs=0.015)
        assert found.gait.stance_share == pytest.approx(0.632, abs=0.01)
        assert np.degrees(found.gait.shank_angle.value(0.0)) == pytest.approx(21.0, abs=3.0)
        assert found.gait.curve("vertical_force").mean == pytest.approx(0.5, abs=0.05)
    difference = np.degrees(right.gait.shank_angle.values_at(PHASES) - left.gait.shank_angle.values_at(PHASES))
    assert np.abs(difference).max() < 6.0, "both legs of a healthy walker move alike"


def test_strides_from_the_shank_are_near_those_from_the_force_plates(shared_data: Path) -> None:
    folder = shared_data / "gait" / "opensim_subject01"
    ik, grf = folder / "subject01_walk1_ik.mot", folder / "subject01_walk1_grf_15s.mot"
    for side in ("right", "left"):
        forced = import_gait([ik, grf], ImportSettings(72.6, side=side))
        moved = import_gait([ik], ImportSettings(72.6, side=side))
        assert moved.gait.stride_time == pytest.approx(forced.gait.stride_time, abs=0.01)
        assert moved.gait.stance_share == pytest.approx(forced.gait.stance_share, abs=0.03)
        early = [min((item.start - other.start for item in forced.strides), key=abs) for other in moved.strides]
        assert all(0.02 < seconds < 0.035 for seconds in early)


def test_the_eleven_real_strides_one_after_the_other_give_the_built_in_gait(
    shared_data: Path, csv_of: Callable[..., Path], normative: Gait
) -> None:
    folder = shared_data / "gait" / "falisse2019_derived"
    strides = np.genfromtxt(folder / "falisse2019_s1_all_strides.csv", delimiter=",", names=True)
    trials = np.genfromtxt(folder / "falisse2019_s1_trials.csv", delimiter=",", names=True)
    kept = strides["pct"] < 100.0
    times = trials["stride_time_s_est"][strides["trial"][kept].astype(int) - 1]
    starts = np.concatenate([[0.0], np.cumsum(trials["stride_time_s_est"])[:-1]])
    time = starts[strides["trial"][kept].astype(int) - 1] + times * strides["pct"][kept] / 100.0
    columns = {
        "shank_angle [deg]": strides["phi_deg"][kept],
        "ankle_angle [deg]": 90.0 - strides["ankle_deg"][kept],
        "ankle_moment [N m/kg]": strides["ankle_moment_Nm_kg"][kept],
        "vertical_force [-]": strides["vGRF_BW"][kept],
    }
    found = import_gait([csv_of(columns, time)], ImportSettings(62.0, walking_speed=1.33)).gait
    assert found.strides >= 9
    assert found.stride_time == pytest.approx(normative.stride_time, rel=0.01)
    assert found.stance_share == pytest.approx(normative.stance_share, abs=0.015)
    assert np.degrees(largest_difference(found, normative, "shank_angle")) < 1.0
    assert np.degrees(largest_difference(found, normative, "ankle_angle")) < 1.5
    assert largest_difference(found, normative, "ankle_moment") < 0.06
    assert found.stride_time_deviation == pytest.approx(normative.stride_time_deviation, rel=0.3)


def test_pressure_counts_forward(
    csv_of: Callable[..., Path], columns: dict[str, Floats], walk: Recording, normative: Gait
) -> None:
    stance = np.minimum((walk.time / normative.stride_time) % 1.0 / normative.stance_share, 1.0)
    backward = {**columns, "pressure_back [cm]": -3.0 - 4.0 * stance}
    columns_map = GaitMap(
        shank_angle=ShankMap(terms=("shank_angle",)),
        ankle_angle=AngleMap(terms=("ankle_angle",), positive="plantarflexion", neutral="90 deg"),
        vertical_force=ForceMap(terms=("vertical_force",)),
        centre_of_pressure=PressureMap(terms=("pressure_back",), positive="backward"),
    )
    found = import_gait([csv_of(backward)], ImportSettings(62.0, columns=columns_map))
    assert found.gait.curve("centre_of_pressure").mean == pytest.approx(0.05, abs=0.005)
    for metres in (5.0, 5.0e-5):
        wrong = csv_of({**columns, "centre_of_pressure [m]": metres * (1.0 + stance)})
        with pytest.raises(DataError, match=r"centre_of_pressure is .* m in front of the ankle \(plausible: within"):
            import_gait([wrong], ImportSettings(62.0))


@pytest.mark.parametrize("zero", [0.0, 0.035, -0.04])
def test_another_foot_on_the_plate_and_a_zero_of_it_change_no_event(
    csv_of: Callable[..., Path], normative: Gait, zero: float
) -> None:
    walk, stride = walk_recording(normative, 10), normative.stride_time
    force = walk["vertical_force"]
    other = np.interp(walk.time - 0.5 * stride, walk.time, force, left=0.0)
    beside = force + np.where((walk.time > 2.5 * stride) & (walk.time < 6.4 * stride), other, 0.0)
    columns = {f"{name} [{walk.unit(name)}]": np.array(walk[name]) for name in walk.names}
    columns[f"vertical_force [{walk.unit('vertical_force')}]"] = beside + zero * float(np.max(force)) / 1.1
    found = import_gait([csv_of(columns, walk.time)], ImportSettings(62.0))
    assert found.gait.stride_time == pytest.approx(stride, rel=2e-3)
    assert found.gait.stance_share == pytest.approx(normative.stance_share, abs=0.012)
    assert 3 <= len(found.strides) <= 6
    assert found.left_out
    assert any("other foot" in remark for remark in found.remarks)
    assert any("zero of the plate" in remark for remark in found.remarks) == (zero != 0.0)
