"""OpenSim tables and markers as programs write them: names by path and side, plates, gaps, one cycle, mending."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.gait import Gait, load_gait, walk_recording
from ppafo.gait.gait import REQUIRED
from ppafo.gait.plausible import check_force_scale
from ppafo.gait.recorded import ImportSettings, import_gait
from ppafo.gait.recorded.footfalls import wrap_cycle
from ppafo.gait.recorded.mapping import FrameClock, GaitMap, Side
from ppafo.gait.recorded.signal import Signal
from ppafo.gait.recorded.source import read_table
from ppafo.signals import Channel, Recording
from ppafo.signals.recording import Floats
from ppafo.storage.opensim import opensim_recording, write_opensim
from tests.unit.gait.laboratory import GAIT, MASS, STRIDE, UNLOADED, angles, curve, force, markers, opensim, trc

PHASES = np.linspace(0.0, 1.0, 101)
TIME, FAST = np.arange(0.0, 5.2, 0.01), np.arange(0.0, 5.2, 0.002)
PERSON = ImportSettings(MASS)


def error(gait: Gait, name: str) -> float:
    """Largest difference from the true curve, at the start that fits best."""
    values = gait.curve(name).values_at(PHASES)
    shifts = np.linspace(-0.03, 0.03, 61)
    return min(float(np.max(np.abs(values - truth(name, PHASES + shift)))) for shift in shifts)


def truth(name: str, phases: Floats) -> Floats:
    """A curve of the walk; the plates of the laboratory show nothing of the swing."""
    values = GAIT.curve(name).values_at(phases)
    return np.maximum(values - UNLOADED, 0.0) if name == "vertical_force" else values


def assert_true(gait: Gait, names: tuple[str, ...] = ("shank_angle", "ankle_angle", "vertical_force")) -> None:
    assert gait.stride_time == pytest.approx(STRIDE, abs=0.006)
    assert {name for name in names if error(gait, name) > 0.03} == set()


@pytest.mark.parametrize("side", ["right", "left"])
def test_states_by_their_path_and_forces_by_their_side(tmp_path: Path, side: Side) -> None:
    states: dict[str, Floats] = {}
    for name, values in angles(TIME, side, 1.0).items():
        joint = "ground_pelvis" if name == "pelvis_tilt" else f"{name.split('_')[0]}_{side[0]}"
        states |= {f"/jointset/{joint}/{name}/value": values, f"/jointset/{joint}/{name}/speed": 0.0 * values}
    ik = opensim(tmp_path / "states.sto", TIME, states, "inDegrees=no")
    both = {f"ground_force_{foot[0]}_vy": force(FAST, foot) for foot in ("right", "left")}
    found = import_gait([ik, opensim(tmp_path / "grf.mot", FAST, both)], ImportSettings(MASS, side))
    assert_true(found.gait)
    assert found.events == "vertical_force"


@pytest.mark.parametrize(
    ("right", "left"),
    [
        ("ground_force_vy", "l_ground_force_vy"),
        ("1_ground_force_r_vy", "1_ground_force_l_vy"),
        ("R_ground_force_vy", "ground_force_vy"),
        ("ground_force_calcn_r_vy", "ground_force_calcn_l_vy"),
        ("ground_force_1_vy", "ground_force_2_vy"),
    ],
)
def test_forces_are_of_the_foot_that_their_names_or_their_time_say(tmp_path: Path, right: str, left: str) -> None:
    for side in ("right", "left"):
        ik = opensim(tmp_path / f"{side}.mot", TIME, angles(TIME, side), "inDegrees=yes")
        both = opensim(tmp_path / "grf.mot", FAST, {left: force(FAST, "left"), right: force(FAST, "right")})
        assert_true(import_gait([ik, both], ImportSettings(MASS, side)).gait)  # type: ignore[arg-type]


def test_one_contact_in_a_long_record_of_a_plate_is_a_force() -> None:
    time = np.arange(0.0, 60.0, 0.01)
    weights = force(time, "right", [1]) / (MASS * 9.80665)
    assert np.count_nonzero(weights) < 0.02 * time.size
    check_force_scale("plate", weights)
    with pytest.raises(DataError, match="its sign is reversed"):
        check_force_scale("plate", -weights)
    with pytest.raises(DataError, match=r"reaches 9.94 body weights"):
        check_force_scale("plate", 10.0 * weights)


def test_a_wrong_count_of_columns_and_repeated_last_times_are_mended_and_said(tmp_path: Path) -> None:
    path = opensim(tmp_path / "ik.mot", TIME, angles(TIME), "inDegrees=yes", width=9)
    text = path.read_text().replace(f"nRows={TIME.size}", f"nRows={TIME.size + 2}")
    path.write_text(text + 2 * (text.splitlines()[-1] + "\n"))
    found = import_gait([path], PERSON)
    assert_true(found.gait, ("shank_angle", "ankle_angle"))
    assert "ik.mot: the header states 9 columns, but labels and rows have 5, which were read" in found.remarks
    assert "ik.mot: 2 of the last rows repeat the time 5.19 s and were dropped" in found.remarks


def test_one_cycle_that_wraps_around_is_a_stride(tmp_path: Path) -> None:
    for start in (0.15, 0.4, 0.9):
        time = start + np.arange(0.0, 1.35 / 1.15 * STRIDE, 0.01)
        table = opensim(
            tmp_path / "cycle.sto", time, angles(time) | {"ground_force_r_vy": force(time)}, "inDegrees=yes"
        )
        found = import_gait([table], PERSON)
        assert_true(found.gait)
        assert found.gait.strides == 1
        assert found.gait.stance_share == pytest.approx(0.627, abs=0.01)
        assert any(
            line.startswith("the recording is one cycle: 1.21 s of data were closed to") for line in found.remarks
        )


def test_a_cycle_whose_ends_are_not_the_same_motion_is_not_wrapped() -> None:
    time = np.arange(0.4, 0.4 + 1.2 * STRIDE, 0.01)
    walk = {name: Signal("file", time, curve(name, time)) for name in ("shank_angle", "ankle_angle")}
    wrapped = wrap_cycle(walk)
    assert wrapped is not None
    _, period, _ = wrapped
    assert period == pytest.approx(STRIDE, abs=0.006)
    drifting = {name: Signal("file", time, item.values + 0.4 * (time - 0.4)) for name, item in walk.items()}
    assert wrap_cycle(drifting) is None
    short = np.arange(0.4, 0.4 + 0.9 * STRIDE, 0.01)
    assert wrap_cycle({name: Signal("file", short, curve(name, short)) for name in walk}) is None


def walked(tmp_path: Path, gap: tuple[int, int] = (0, 0), up: int = 1) -> Path:
    points = markers(TIME[:400], up=up)
    points["RKNE"][:, gap[0] : gap[1]] = np.nan
    return trc(tmp_path / "walk.trc", TIME[:400], points)


@pytest.mark.parametrize("up", [1, 2])
def test_markers_give_shank_knee_and_an_ankle_whose_zero_is_the_flat_foot(tmp_path: Path, up: int) -> None:
    plates = opensim(tmp_path / "grf.mot", FAST, {"1_ground_force_vy": force(FAST, "right", [1])})
    found = import_gait([walked(tmp_path, up=up), plates], PERSON)
    assert_true(found.gait, ("shank_angle", "vertical_force"))
    assert error(found.gait, "knee_forward") < 0.5
    turned = [
        float(np.ptp(found.gait.ankle_angle.values_at(PHASES) - GAIT.ankle_angle.values_at(PHASES + shift)))
        for shift in np.linspace(-0.03, 0.03, 61)
    ]
    assert min(turned) < 0.02, "but for the zero it is the same curve"
    assert "ankle angle from the markers RHEE and RTOE; zero from the flat foot" in found.remarks
    assert not any("zero of ankle_angle" in line for line in found.remarks)


def test_gaps_are_filled_up_to_the_length_that_is_stated_and_named(tmp_path: Path) -> None:
    path = walked(tmp_path, (120, 126))
    with pytest.raises(DataError, match="has 1 whole stride covered"):
        import_gait([path], ImportSettings(MASS, longest_gap=0.05))
    assert len(import_gait([path], ImportSettings(MASS, least_strides=1)).strides) == 1
    found = import_gait([path], ImportSettings(MASS, longest_gap=0.07))
    assert_true(found.gait, ("shank_angle",))
    assert "walk.trc: column 'RKNE.x': 6 samples from 1.2 to 1.25 s filled" in found.remarks
    with pytest.raises(DataError, match=r"longest gap 0.4 s is not plausible; allowed is 0 to 0.25 s"):
        import_gait([path], ImportSettings(MASS, longest_gap=0.4))


def test_rows_that_are_missing_are_bridged_up_to_the_same_length(tmp_path: Path) -> None:
    kept = np.delete(TIME, slice(200, 206))
    path = opensim(tmp_path / "ik.mot", kept, angles(kept), "inDegrees=yes")
    left = import_gait([path], ImportSettings(MASS, least_strides=1))
    assert all(stride.end < 1.99 or stride.start > 2.06 for stride in left.strides)
    found = import_gait([path], ImportSettings(MASS, longest_gap=0.08))
    assert_true(found.gait, ("shank_angle", "ankle_angle"))
    assert "ik.mot: rows from 1.99 to 2.06 s are missing and were bridged" in found.remarks


def test_start_and_end_leave_out_the_rest(tmp_path: Path) -> None:
    path = opensim(tmp_path / "ik.mot", TIME, angles(TIME), "inDegrees=yes")
    assert len(import_gait([path], PERSON).strides) == 3
    strides = import_gait([path], ImportSettings(MASS, start=1.2, end=4.5)).strides
    assert len(strides) == 2
    assert all(item.start >= 1.2 and item.end <= 4.5 for item in strides)
    for start, end in ((7.0, None), (3.0, 2.0)):
        with pytest.raises(DataError, match=r"leaves none of its samples|must be before the end"):
            import_gait([path], ImportSettings(MASS, start=start, end=end))


def test_the_reading_of_a_neutral_ankle_may_be_given(tmp_path: Path) -> None:
    columns = angles(TIME)
    columns["ankle_angle_r"] = columns["ankle_angle_r"] - 8.0
    path = opensim(tmp_path / "ik.mot", TIME, columns, "inDegrees=yes")
    (said,) = [line for line in import_gait([path], PERSON).remarks if "zero of ankle_angle" in line]
    assert "tilted by 12." in said
    found = import_gait([path], ImportSettings(MASS, ankle_neutral=np.radians(-8.0)))
    assert_true(found.gait, ("ankle_angle",))
    assert not any("zero of ankle_angle" in line for line in found.remarks)


@pytest.mark.parametrize("side", ["right", "left"])
def test_what_is_written_for_opensim_is_imported_again(tmp_path: Path, side: Side) -> None:
    recording, missing = opensim_recording(walk_recording(load_gait(), 6), side, MASS)
    assert missing == ()
    path = write_opensim(tmp_path / "walk.sto", recording)
    found = import_gait([path], ImportSettings(MASS, side)).gait
    assert found.origin == "synthetic"
    assert_true(found, ("shank_angle", "ankle_angle", "ankle_moment", "vertical_force"))
    assert max(error(found, name) for name in ("knee_forward", "knee_up")) < 0.1


def test_the_export_has_opensims_zero_and_signs() -> None:
    walk = walk_recording(load_gait(), 2)
    named, _ = opensim_recording(walk, "right", 70.0)
    np.testing.assert_array_equal(named["ankle_angle_r"], 0.5 * np.pi - walk["ankle_angle"])
    np.testing.assert_array_equal(named["ankle_angle_r_moment"], -70.0 * walk["ankle_moment"])
    np.testing.assert_array_equal(named["ground_force_r_vy"], 70.0 * 9.80665 * walk["vertical_force"])
    units = {name: named.unit(name) for name in ("ankle_angle_r_moment", "ground_force_r_vy")}
    assert units == {"ankle_angle_r_moment": "N m", "ground_force_r_vy": "N"}
    bare, missing = opensim_recording(walk)
    assert missing == ("ankle_moment", "vertical_force")
    assert "ankle_angle_r_moment" not in bare.names
    newton = Recording("plate", walk.time, {"vertical_force": Channel(600.0 * walk["vertical_force"], "N")})
    assert opensim_recording(newton)[0].names == ("ground_force_r_vy",)


@pytest.fixture
def real_trial(shared_data: Path, tmp_path: Path) -> list[Path]:
    """The tables of one overground trial, written as OpenSim had them before they were kept as .mat."""
    from scipy.io import loadmat

    written = []
    for file, key in (("IK_gait_1", "Qsall"), ("ID_gait_1", "IDall"), ("GRF_gait_1", "GRFall")):
        kept = loadmat(shared_data / "gait" / "falisse2019_subject1" / f"{file}.mat", simplify_cells=True)[key]
        head = [str(row[0]) for row in kept["textdata"] if isinstance(row[0], str) and row[0] != "time"]
        rows = ["\t".join(f"{cell:.8f}" for cell in row) for row in kept["data"]]
        path = tmp_path / f"{file}.mot"
        path.write_text("\n".join([*head, "\t".join(map(str, kept["colheaders"])), *rows]) + "\n")
        written.append(path)
    return written


@pytest.mark.parametrize(("side", "plate"), [("right", "'1_ground_force_vy' (1)"), ("left", "'ground_force_vy' (1)")])
def test_a_real_trial_of_one_stride_and_two_plates_is_imported(real_trial: list[Path], side: Side, plate: str) -> None:
    found = import_gait(real_trial, ImportSettings(62.0, side))
    gait = found.gait
    assert plate in "\n".join(found.remarks)
    assert gait.strides == 1
    assert gait.stride_time == pytest.approx(1.05, abs=0.03)
    assert gait.stance_share == pytest.approx(0.64, abs=0.015)
    assert 1.4 < float(gait.curve("ankle_moment").values_at(PHASES).max()) < 1.55
    assert gait.curve("vertical_force").mean == pytest.approx(0.46, abs=0.05)
    assert np.degrees(error(gait, "shank_angle")) < 7.0


@pytest.mark.parametrize(
    ("delimiter", "time", "unit", "comma"),
    [
        (",", "time", " (deg)", False),
        (";", "time", " [deg]", True),
        ("\t", "time", " (deg)", False),
        (";", "time [s]", " [deg]", False),
        ("\t", "time [s]", " [deg]", True),
        (",", "Frame", " [deg]", False),
    ],
)
def test_a_plain_table_with_opensims_names_is_read(
    tmp_path: Path, delimiter: str, time: str, unit: str, comma: bool
) -> None:
    columns = {f"{name}{unit}": values for name, values in angles(TIME).items()} | {"ground_force_r_vy": force(TIME)}
    clock = 7.0 + np.arange(TIME.size) if time == "Frame" else TIME
    rows = [delimiter.join(f"{cell:.6f}" for cell in row) for row in np.column_stack([clock, *columns.values()])]
    text = "\n".join([delimiter.join([time, *columns]), *rows]) + "\n"
    path = tmp_path / "walk.csv"
    path.write_text("# synthetic: a walk\n" + (text.replace(".", ",") if comma else text))
    assert read_table(path).kind == "synthetic"
    counted = GaitMap(time=FrameClock(rate=f"{1.0 / (TIME[1] - TIME[0]):.9g} Hz")) if time == "Frame" else None
    assert_true(import_gait([path], replace(PERSON, columns=counted)).gait)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("PacketCounter,shank\n1,two\n", "or frames with time.rate of a gait map"),
        (
            "time,shank_angle [deg/s],ankle_angle [deg]\n" + "".join(f"{k},1,{75 + 5 * k}\n" for k in range(9)),
            "integrate it over each stride, less its mean over the stride, and set the zero while standing",
        ),
        ("time,a,\n0,1,2\n", "a column has no name"),
        ("time,a\n0,1,2\n", "line 2 has 3 values for 2 columns"),
        ("time,a\n0,one\n", "line 2"),
        ("time (h2),a\n0,1\n", "h2"),
    ],
)
def test_a_damaged_plain_table_is_refused_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "walk.csv"
    path.write_text(text)
    with pytest.raises(DataError) as refused:
        import_gait([path], PERSON)
    assert message in str(refused.value)
    assert str(refused.value).startswith(str(path))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("names", [(*REQUIRED, "vertical_force"), REQUIRED], ids=["force", "shank"])
def test_a_mean_stride_over_percent_is_one_stride_of_the_given_duration(tmp_path: Path, names: tuple[str, ...]) -> None:
    gait, path, phases = load_gait(), tmp_path / "percent.csv", np.linspace(0.0, 1.0, 101)
    units = {"vertical_force": "-"}
    columns = [gait.curve(name).values_at(phases) for name in names]
    shown = [values if name in units else np.degrees(values) for name, values in zip(names, columns, strict=True)]
    head = ",".join(f"{name} [{units.get(name, 'deg')}]" for name in names)
    rows = np.column_stack([100.0 * phases, *shown]).tolist()
    path.write_text(f"cycle [%],{head}\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows))
    mean = import_gait([path], replace(PERSON, stride_time=1.2))
    assert (mean.gait.strides, mean.gait.stride_time_deviation, mean.gait.title) == (1, 0.0, "Mean stride, right foot")
    assert mean.gait.stride_time == pytest.approx(1.2)
    assert any("the variation between strides is unknown" in remark for remark in mean.remarks)
    # The same stride six times over time is the same gait.
    repeated = [[1.2 * (turn + 0.01 * row[0]), *row[1:]] for turn in range(6) for row in rows[:-1]]
    path.write_text(f"time [s],{head}\n" + "".join(",".join(map(repr, row)) + "\n" for row in repeated))
    over_time = import_gait([path], PERSON)
    assert mean.gait.stance_share == pytest.approx(over_time.gait.stance_share, abs=1e-4)
    for name in names:
        assert mean.curves[name].mean == pytest.approx(over_time.curves[name].mean, abs=2e-3)
    # A column that is no percent, and a duration beside a time.
    path.write_text(
        f"frame,{head}\n" + "".join(",".join(map(repr, [7.0 + k, *row[1:]])) + "\n" for k, row in enumerate(rows))
    )
    with pytest.raises(DataError, match="the first column must be 'time', not 'frame'"):
        import_gait([path], replace(PERSON, stride_time=1.2))
    path.write_text(f"time [s],{head}\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows))
    with pytest.raises(DataError, match="stride_time is for a file over percent of the stride"):
        import_gait([path], replace(PERSON, stride_time=1.2))
