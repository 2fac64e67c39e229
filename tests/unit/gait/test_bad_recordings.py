"""Recordings that cannot be right are refused: file, column and number are named, and what to do."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.gait.mean_stride import MeanStride
from ppafo.gait.plausible import check_moment_time, moment_remarks
from ppafo.gait.recorded import ImportSettings, import_gait
from ppafo.gait.recorded.mapping import (
    AngleMap,
    ForceMap,
    GaitMap,
    MomentMap,
    ShankMap,
    load_map,
)
from ppafo.signals import Recording
from ppafo.signals.recording import Floats

Change = Callable[[dict[str, Floats]], dict[str, Floats]]
SHANK, ANKLE, MOMENT, FORCE = "shank_angle [rad]", "ankle_angle [rad]", "ankle_moment [N m/kg]", "vertical_force [-]"
FORWARD, UP = "knee_forward [m/s^2]", "knee_up [m/s^2]"


def changed(name: str, change: Callable[[Floats], Floats], new: str = "") -> Change:
    """One column changed, or given another header."""
    return lambda columns: {
        (new or key if key == name else key): (change(values) if key == name else values)
        for key, values in columns.items()
    }


def exchanged(columns: dict[str, Floats]) -> dict[str, Floats]:
    """Both accelerations of the knee in each other's place."""
    return {**columns, FORWARD: columns[UP], UP: columns[FORWARD]}


def scaled(names: tuple[str, ...], factor: float) -> Change:
    """Columns times a factor."""
    return lambda columns: columns | {name: factor * columns[name] for name in names}


def held(names: tuple[str, ...], start: int, samples: int) -> Change:
    """Columns that keep the value of a sample for many more, as a filled drop-out does; 200 samples a second."""

    def filled(values: Floats) -> Floats:
        kept = np.array(values)
        kept[start : start + samples] = kept[start]
        return kept

    return lambda columns: columns | {name: filled(columns[name]) for name in names or columns}


CASES: dict[str, tuple[Change, str]] = {
    "degrees called radians": (
        changed(SHANK, np.degrees),
        "shank_angle has a range of 4.15e+03 deg (plausible in a stride: 25 to 120 deg); the numbers look like degrees",
    ),
    "radians called degrees": (
        changed(ANKLE, lambda x: x, "ankle_angle [deg]"),
        "ankle_angle has a range of 0.572 deg (plausible in a stride: 5 to 80 deg); the numbers look like radians",
    ),
    "shank counted the other way": (
        changed(SHANK, np.negative),
        "in mid-stance, so the shank would rotate backwards over the foot",
    ),
    "shank from the horizontal": (changed(SHANK, lambda x: x + 1.57), "shank_angle is 106 deg at heel strike and"),
    "ankle counted the other way": (
        changed(ANKLE, lambda x: np.pi - x),
        "the sign is reversed; correct the sign in the file, or change ankle_angle.positive in a gait",
    ),
    "ankle with zero as neutral": (
        changed(ANKLE, lambda x: x - np.pi / 2.0),
        "implies a foot tilted by -85 deg in mid-stance (plausible: up to 20 deg)",
    ),
    "moment counted the other way": (changed(MOMENT, np.negative), "in dorsiflexion, so its sign is reversed"),
    "moment of the body per kg": (changed(MOMENT, lambda x: 62.0 * x), "ankle_moment reaches 90.2 N m/kg (plausible"),
    "moment of the other foot": (
        changed(MOMENT, lambda x: np.roll(x, 104)),
        "ankle_moment peaks at 98 % of the stride, but the foot is off the ground from 64 % on; the moment is of",
    ),
    "moment of the other foot, without a force": (
        lambda columns: {
            name: np.roll(values, 104) if name == MOMENT else values
            for name, values in columns.items()
            if name != FORCE
        },
        "on; toe-off is guessed without a vertical force: give one; or the moment is of the other foot",
    ),
    "moment on a later clock": (
        changed(MOMENT, lambda x: np.roll(x, 21)),
        "ankle_moment peaks at 58 % of the stride and is 0.57 N m/kg in swing, but the foot is off the ground from 64",
    ),
    "force of the other foot": (changed(FORCE, lambda x: np.roll(x, 104)), "choose the other side"),
    "force in newton without a unit": (
        changed(FORCE, lambda x: 608.0 * x),
        "vertical_force reaches 619 body weights (plausible: 0.5 to 2.5); check the body mass",
    ),
    "force of both feet": (changed(FORCE, lambda x: x + 0.5), "no heel strikes were found"),
    "force downwards": (changed(FORCE, np.negative), "below 0, so its sign is reversed; correct the sign in the file"),
    "knee counted backwards": (changed(FORWARD, np.negative), "knee_forward is -10.1 m/s^2 around toe-off and 7.69"),
    "knee counted down": (
        changed(UP, np.negative),
        "correct the sign in the file, or change the sign of knee.up in a gait map",
    ),
    "knee with gravity": (changed(UP, lambda x: x + 9.81), "subtract gravity from accelerometer data"),
    "knee in millimetres": (
        scaled((FORWARD, UP), 1000.0),
        "knee_forward and knee_up are 1000 times too large: they differ by",
    ),
    "knee forward alone times g": (scaled((FORWARD,), 9.80665), "differ (knee_forward is 9.80665 times too large)"),
    "knee times g": (scaled((FORWARD, UP), 9.80665), "divide both by 9.80665 in the file"),
    "knee in centimetres": (
        scaled((FORWARD, UP), 100.0),
        "knee_forward has a range of 2.02e+03 m/s^2 per stride (plausible: 0.5 to 80 m/s^2); check the unit",
    ),
    "knee exchanged": (
        exchanged,
        "knee_forward and knee_up are exchanged: they differ by",
    ),
    "knee in g": (
        scaled((FORWARD, UP), 1.0 / 9.80665),
        "knee_forward and knee_up are in units of g: they differ by 79 % (42 % if corrected) from a "
        "rotation of the knee about the resting ankle while the foot is flat; multiply both by 9.80665 in the file",
    ),
    "shank in noise": (
        changed(SHANK, lambda x: x + np.random.default_rng(4).normal(0.0, 0.7, x.size)),
        "RMS error of its Fourier series of",
    ),
    "unknown unit": (
        changed(SHANK, lambda x: x, "shank_angle [turns]"),
        "column 'shank_angle' [turns]: 'turns' is not a known",
    ),
    "unit of something else": (
        changed(SHANK, lambda x: x, "shank_angle [m]"),
        "column 'shank_angle' [m]: unit 'm' does not fit: an angle is needed",
    ),
    "misspelt column": (
        changed(SHANK, lambda x: x, "shank_angel [rad]"),
        "shank_angle: there is no column 'shank_angle', did you mean 'shank_angel'?",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_what_no_leg_does_is_refused_with_the_remedy(
    csv_of: Callable[..., Path], columns: dict[str, Floats], case: str
) -> None:
    change, message = CASES[case]
    path = csv_of(change(columns))
    with pytest.raises(DataError, match=re.escape(message)) as refused:
        import_gait([path], ImportSettings(62.0))
    assert str(path) in str(refused.value)
    assert "\n" not in str(refused.value)


def test_an_ankle_without_a_shank_is_told_why_and_all_else_that_is_wrong(
    csv_of: Callable[..., Path], columns: dict[str, Floats]
) -> None:
    """A clinic's ankle angle counts dorsiflexion from neutral; its sign shows beside a shank only."""
    ankle = {ANKLE: np.pi / 2.0 - columns[ANKLE], MOMENT: -columns[MOMENT]}
    for curves, fragments in (
        (ankle, ("the foot is placed by both angles", "(neutral: 90 deg)", "ankle_moment peaks at -")),
        ({SHANK: columns[SHANK], **ankle}, ("the sign is reversed", "(neutral: 90 deg)", "ankle_moment peaks at -")),
    ):
        with pytest.raises(DataError) as refused:
            import_gait([csv_of(curves)], ImportSettings(62.0))
        assert len(refused.value.parts) == len(fragments)
        assert all(fragment in part for fragment, part in zip(fragments, refused.value.parts, strict=True))


HELD: dict[str, tuple[Change, str]] = {
    "shank for a second": (
        held((SHANK,), 500, 200),
        "column 'shank_angle' of shank_angle is constant from 2.496 to",
    ),
    "everything for half a second": (held((), 660, 100), "column 'shank_angle' of shank_angle is constant from"),
    "everything over a heel strike": (held((), 500, 200), "left out: 2.08 s long, the others are about 1.04 s"),
    "moment in stance": (held((MOMENT,), 680, 30), "column 'ankle_moment' of ankle_moment is constant from"),
}


@pytest.mark.parametrize("case", HELD)
def test_strides_with_a_filled_drop_out_are_left_out_and_not_the_record(
    csv_of: Callable[..., Path], columns: dict[str, Floats], case: str
) -> None:
    change, remark = HELD[case]
    true = import_gait([csv_of(columns)], ImportSettings(62.0)).gait
    found = import_gait([csv_of(change(columns))], ImportSettings(62.0))
    assert 2 <= found.gait.strides < 5
    assert len(found.left_out) >= 1
    assert any(remark in line for line in found.remarks)
    at = np.linspace(0.0, 1.0, 101)
    for name in ("shank_angle", "ankle_angle", "ankle_moment"):
        assert np.abs(found.gait.curve(name).values_at(at) - true.curve(name).values_at(at)).max() < 0.02


def test_a_drop_out_in_all_strides_but_one_refuses_the_record(
    csv_of: Callable[..., Path], columns: dict[str, Floats]
) -> None:
    change = held((SHANK,), 150, 700)
    with pytest.raises(DataError, match=r"column 'shank_angle' of shank_angle is constant from .* cut the file there"):
        import_gait([csv_of(change(columns))], ImportSettings(62.0))


@pytest.mark.parametrize(("start", "strides"), [(640, 4), (560, 3)])
def test_a_stumble_is_left_out_and_named(
    csv_of: Callable[..., Path], columns: dict[str, Floats], start: int, strides: int
) -> None:
    stumbling = np.array(columns[ANKLE])
    stumbling[start : start + 140] += np.radians(35.0) * np.sin(np.linspace(0.0, 6.0, 140)) ** 2
    found = import_gait([csv_of({**columns, ANKLE: stumbling})], ImportSettings(62.0))
    assert found.gait.strides == strides
    remarks = [line for line in found.remarks if "left out" in line]
    assert len(remarks) == 5 - strides
    assert all(line.endswith("left out: ankle_angle differs from all other strides") for line in remarks)


@pytest.mark.parametrize(("column", "value", "start", "samples"), [(ANKLE, 1.57, 755, 18), (MOMENT, 0.0, 730, 50)])
def test_a_short_drop_out_in_one_stride_is_no_part_of_the_mean(
    csv_of: Callable[..., Path], columns: dict[str, Floats], column: str, value: float, start: int, samples: int
) -> None:
    """90 ms at toe-off, or a push-off that was lost: little of the stride, but far from all others there."""
    damaged = np.array(columns[column])
    damaged[start : start + samples] = value + 1e-4 * np.arange(samples)
    found = import_gait([csv_of({**columns, column: damaged})], ImportSettings(62.0))
    assert found.gait.strides == 4
    assert any("differs from all other strides" in line for line in found.remarks)


def test_a_reversed_ankle_over_a_stiff_shank_is_refused(
    csv_of: Callable[..., Path], columns: dict[str, Floats]
) -> None:
    """The shank moves by less than 8 deg in mid-stance, and the ankle with it: the other sign fits far better."""
    shank = columns[SHANK].mean() + 0.45 * (columns[SHANK] - columns[SHANK].mean())
    turned = np.pi - (columns[ANKLE] - 0.55 * (columns[SHANK] - columns[SHANK].mean()))
    with pytest.raises(DataError, match=r"the sign is reversed; .*ankle_angle.positive"):
        import_gait([csv_of({**columns, SHANK: shank, ANKLE: turned})], ImportSettings(62.0))


def test_what_is_wrong_at_several_stages_is_said_in_one_go(
    csv_of: Callable[..., Path], columns: dict[str, Floats]
) -> None:
    wrong = columns | {FORCE: -columns[FORCE], MOMENT: -columns[MOMENT], UP: columns[UP] + 9.81}
    wrong = {name.replace("rad", "deg"): values for name, values in wrong.items()}
    with pytest.raises(DataError) as refused:
        import_gait([csv_of(wrong)], ImportSettings())
    said = (
        "does not state the body mass",
        "vertical_force peaks at -0.999 body weights, below 0, so its sign is reversed",
        "shank_angle has a range of .* look like radians",
        "knee_up has a mean of 9.81 m/s\\^2",
        "ankle_angle has a range of .* look like radians",
        "ankle_moment peaks at -1 N m/kg, in dorsiflexion",
    )
    assert len(refused.value.parts) == len(said)
    assert all(re.search(text, part) for text, part in zip(said, refused.value.parts, strict=True))


def test_all_columns_without_a_unit_are_named_and_all_options_that_are_not_plausible(
    csv_of: Callable[..., Path], columns: dict[str, Floats], tmp_path: Path
) -> None:
    plain = tmp_path / "plain.csv"
    rows = csv_of(columns).read_text().splitlines()
    names = ["time", *(name.partition(" ")[0] for name in columns)]
    plain.write_text("\n".join([",".join(names), *(row for row in rows if row[:1].isdigit())]))
    with pytest.raises(DataError) as refused:
        import_gait([plain], ImportSettings(body_mass=62.0))
    stated = [part.partition("'")[2].partition("'")[0] for part in refused.value.parts]
    assert stated == names[1:-1]
    # Together with what is wrong in the file.
    with pytest.raises(DataError) as refused:
        import_gait([plain], ImportSettings(body_mass=900.0, stature=17.0))
    assert refused.value.parts[0].startswith("a body mass of 900 kg")
    assert refused.value.parts[1].startswith("a stature of 17 m")
    assert [part.partition("'")[2].partition("'")[0] for part in refused.value.parts[2:]] == names[1:-1]


@pytest.mark.parametrize("slope", [0.18, -0.01, -0.04])
def test_an_ankle_that_rests_in_mid_stance_is_no_reversed_one(
    csv_of: Callable[..., Path], columns: dict[str, Floats], slope: float
) -> None:
    """A plateau, as one recorded walk has it: only the other sign that fits clearly better would be a mistake."""
    shank = columns[SHANK]
    resting = columns[ANKLE] + (slope - 1.0) * (shank - shank.mean()) * (columns[FORCE] > 0.5)
    found = import_gait([csv_of({**columns, ANKLE: resting})], ImportSettings(62.0))
    assert any(line.startswith("the sign of ankle_angle is uncertain: in mid-stance") for line in found.remarks)


def test_a_reversed_shank_without_a_force_is_named_as_what_it_is(
    csv_of: Callable[..., Path], columns: dict[str, Floats]
) -> None:
    reversed_shank = changed(SHANK, np.negative)({name: x for name, x in columns.items() if name != FORCE})
    with pytest.raises(
        DataError, match=r"if the sign of shank_angle, which determines the stance, is reversed: correct"
    ) as refused:
        import_gait([csv_of(reversed_shank)], ImportSettings(62.0))
    assert "force" not in str(refused.value)


def test_a_force_in_swing_may_rest_and_so_may_a_coarse_sensor_where_it_turns(
    csv_of: Callable[..., Path], columns: dict[str, Floats]
) -> None:
    step = np.radians(1.5)
    coarse = {name: step * np.round(columns[name] / step) for name in (SHANK, ANKLE)}
    resting = np.flatnonzero(np.diff(coarse[ANKLE]) != 0.0)
    assert np.diff(resting).max() > 0.1 * 200.0, "the case is there: one value for more than 0.1 s"
    force = np.where(columns[FORCE] < 0.03, 0.0, columns[FORCE])
    found = import_gait([csv_of({**columns, **coarse, FORCE: force})], ImportSettings(62.0))
    assert found.gait.strides == 5
    less = import_gait([csv_of(held((SHANK,), 500, 60)({**columns, **coarse}))], ImportSettings(62.0))
    assert any("column 'shank_angle' of shank_angle is constant from" in line for line in less.remarks)


def test_noise_is_remarked_before_it_is_refused(csv_of: Callable[..., Path], columns: dict[str, Floats]) -> None:
    noise = np.random.default_rng(4).normal(0.0, 0.2, columns[SHANK].size)
    path = csv_of({**columns, SHANK: columns[SHANK] + noise})
    found = import_gait([path], ImportSettings(62.0))
    (remark,) = (line for line in found.remarks if line.startswith("shank_angle"))
    assert remark.startswith("shank_angle has, relative to its range, a standard deviation between strides of 1")
    assert "the data are noisy, or the walk is not steady; smooth the recording (low_pass=6)" in remark
    assert import_gait([path], ImportSettings(62.0, low_pass=6.0)).remarks == ()


@pytest.mark.parametrize(("factor", "shown"), [(0.6, "0.278"), (0.9, "0.417"), (1.3, "0.602")])
def test_a_force_that_is_not_half_the_weight_is_remarked(
    csv_of: Callable[..., Path], columns: dict[str, Floats], factor: float, shown: str
) -> None:
    (remark,) = import_gait([csv_of(scaled((FORCE,), factor)(columns))], ImportSettings(62.0)).remarks
    assert remark.startswith(f"vertical_force has a mean of {shown} body weights, but each leg of a steady walk")
    assert import_gait([csv_of(columns)], ImportSettings(62.0)).remarks == ()


def test_strides_across_a_jump_of_the_time_are_left_out(
    csv_of: Callable[..., Path], columns: dict[str, Floats], walk: Recording
) -> None:
    time = np.where(np.arange(walk.time.size) >= 300, walk.time + 0.5, walk.time)
    found = import_gait([csv_of(columns, time)], ImportSettings(62.0, least_strides=1))
    assert any("walk.csv: rows from 1.49" in remark and "are missing" in remark for remark in found.remarks)
    assert all(stride.end < 1.5 or stride.start > 1.98 for stride in found.strides)


def test_a_time_in_milliseconds_is_refused(
    csv_of: Callable[..., Path], columns: dict[str, Floats], walk: Recording
) -> None:
    with pytest.raises(
        DataError, match=r"the stride time is 1.04e\+03 s \(plausible: 0.5 to 3 s\); check the unit of time"
    ):
        import_gait([csv_of(columns, 1000.0 * walk.time)], ImportSettings(62.0))


def test_too_few_strides_are_refused_with_the_spans(
    csv_of: Callable[..., Path], columns: dict[str, Floats], walk: Recording
) -> None:
    short = {name: values[:400] for name, values in columns.items()}
    path = csv_of(short, walk.time[:400])
    with pytest.raises(
        DataError,
        match=r"has 1 whole stride covered by both angles and events .*, but at least 2 are needed; give a longer",
    ):
        import_gait([path], ImportSettings(62.0))
    assert import_gait([path], ImportSettings(62.0, least_strides=1)).gait.strides == 1


@pytest.mark.parametrize(
    ("first", "last", "said"),
    [
        (190, 390, "vertical_force has one heel strike only, at 1.04 s; a stride needs two"),
        (
            10,
            200,
            "the foot is on the ground at the start, and a heel strike follows a swing",
        ),
    ],
)
def test_a_record_of_one_heel_strike_has_the_right_column(
    csv_of: Callable[..., Path], columns: dict[str, Floats], walk: Recording, first: int, last: int, said: str
) -> None:
    part = {name: values[first:last] for name, values in columns.items()}
    with pytest.raises(DataError, match=said) as refused:
        import_gait([csv_of(part, walk.time[first:last])], ImportSettings(62.0))
    assert "least_strides" not in str(refused.value)


def test_a_record_of_two_cycles_is_not_called_one_that_wraps_around(
    csv_of: Callable[..., Path], columns: dict[str, Floats], walk: Recording
) -> None:
    part = {name: values[60:500] for name, values in columns.items() if name != FORCE}
    path = csv_of(part, walk.time[60:500])
    with pytest.raises(DataError, match=r"has 1 whole stride .* or accept fewer with least_strides"):
        import_gait([path], ImportSettings(62.0))
    found = import_gait([path], ImportSettings(62.0, least_strides=1))
    assert found.gait.stride_time == pytest.approx(6.2304 / 6.0, rel=0.02)
    assert not any("wraps around" in remark for remark in found.remarks)


def test_radians_called_degrees_are_a_unit_and_no_sign_without_a_force_too(
    csv_of: Callable[..., Path], columns: dict[str, Floats]
) -> None:
    called = changed(SHANK, lambda x: x, "shank_angle [deg]")({name: x for name, x in columns.items() if name != FORCE})
    with pytest.raises(DataError, match=r"the numbers look like radians: give the unit 'rad'"):
        import_gait([csv_of(called)], ImportSettings(62.0))


def test_a_file_of_three_rows_is_refused(
    csv_of: Callable[..., Path], columns: dict[str, Floats], walk: Recording
) -> None:
    short = {name: values[:3] for name, values in columns.items()}
    without_force = {name: values for name, values in short.items() if name != FORCE}
    with pytest.raises(DataError, match="3 rows are too few for a stride"):
        import_gait([csv_of(without_force, walk.time[:3])], ImportSettings(62.0))


def test_a_moment_file_without_a_whole_stride_is_named(opensim_files: dict[str, Path]) -> None:
    path = opensim_files["id"]
    lines = path.read_text().splitlines()
    kept = [line if not line.startswith("nRows") else "nRows=150" for line in lines[: 6 + 150]]
    path.write_text("\n".join(kept) + "\n")
    with pytest.raises(DataError, match=r"walk_id.sto: ankle_moment, 0 to .* covers no whole stride .* omit the file"):
        import_gait(list(opensim_files.values()), ImportSettings(62.0))


def test_angles_without_a_unit_ask_for_it(opensim_files: dict[str, Path]) -> None:
    path = opensim_files["ik"]
    path.write_text(path.read_text().replace("Angles are in degrees.", ""))
    with pytest.raises(DataError, match=r"'pelvis_tilt' has no unit in the file; give shank_angle.unit in a"):
        import_gait(list(opensim_files.values()), ImportSettings(62.0))


def test_a_column_in_two_files_is_refused(opensim_files: dict[str, Path], tmp_path: Path) -> None:
    twin = tmp_path / "twin.mot"
    twin.write_text(opensim_files["grf"].read_text())
    with pytest.raises(DataError, match=r"vertical_force: .* both have the column 'ground_force_vy'"):
        import_gait([*opensim_files.values(), twin], ImportSettings(62.0))


def test_files_of_different_forms_need_a_map(
    opensim_files: dict[str, Path], csv_of: Callable[..., Path], columns: dict[str, Floats]
) -> None:
    mixed = [csv_of(columns), opensim_files["grf"]]
    with pytest.raises(DataError, match=r"different formats \(csv, opensim\); name the columns of all of them in a"):
        import_gait(mixed, ImportSettings(62.0))


def test_a_column_that_the_users_map_names_must_be_there(
    csv_of: Callable[..., Path], columns: dict[str, Floats]
) -> None:
    columns_map = GaitMap(
        shank_angle=ShankMap(terms=("shank_angle",)),
        ankle_angle=AngleMap(terms=("ankle_angle",), positive="plantarflexion", neutral="90 deg"),
        ankle_moment=MomentMap(terms=("moment",), positive="plantarflexion"),
        vertical_force=ForceMap(terms=("vertical_force",)),
    )
    with pytest.raises(DataError, match="ankle_moment: there is no column 'moment'"):
        import_gait([csv_of(columns)], ImportSettings(62.0, columns=columns_map))


def test_an_unknown_kind_of_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(
        DataError, match=r"walk.xlsx: is not a .mot, .sto, .csv, .txt, .tsv, .emt, .c3d, .trc or .mat file"
    ):
        import_gait([tmp_path / "walk.xlsx"], ImportSettings(62.0))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (ImportSettings(62000.0), "a body mass of 62000 kg is not plausible"),
        (ImportSettings(float("nan")), "a body mass of nan kg is not plausible"),
        (ImportSettings(62.0, walking_speed=50.0), "a walking speed of 50 m/s is not plausible"),
        (ImportSettings(62.0, stature=175.0), "a stature of 175 m is not plausible; give it in m, such as '1.75 m'"),
        (ImportSettings(62.0, low_pass=0.1), "a low pass at 0.1 Hz would remove the gait itself"),
        (ImportSettings(62.0, low_pass=500.0), "has 200.3 samples per second; choose a cut-off frequency below"),
        (ImportSettings(62.0, least_strides=0), "the minimum number of strides must be 1 or more, not 0"),
        (ImportSettings(62.0, name="My gait"), "name 'My gait' must consist of lower-case letters"),
    ],
)
def test_settings_that_make_no_sense_are_refused(
    csv_of: Callable[..., Path], columns: dict[str, Floats], settings: ImportSettings, message: str
) -> None:
    with pytest.raises(DataError, match=re.escape(message)):
        import_gait([csv_of(columns)], settings)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "[shank_angle]\nterms = ['s']\n[ankle_angle]\nterms = ['a']\npositive = 'up'\n",
            "ankle_angle.positive = 'up' is not allowed; allowed: plantarflexion, dorsiflexion",
        ),
        (
            "[shank_angle]\nknee = 'K'\n[ankle_angle]\nterms = ['a']\npositive = 'dorsiflexion'\n",
            "give either terms, or",
        ),
        (
            "[shank_angle]\nterms = ['s']\n[ankle_angle]\nterms = ['a']\npositive = 'dorsiflexion'\n"
            "[knee]\nforward = ['x']\nup = ['y']\nthigh_length = '0.4 m'\n",
            "thigh_length and thigh_unit are given without thigh; omit them or give thigh",
        ),
        ("[shank_angle]\nterm = ['s']\n", "unknown key 'shank_angle.term', did you mean 'terms'"),
    ],
)
def test_a_wrong_map_is_refused_with_key_and_value(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "map.toml"
    path.write_text(text)
    with pytest.raises(DataError, match=re.escape(message)) as refused:
        load_map(path)
    assert str(refused.value).startswith(str(path))


def test_a_hip_below_the_ground_is_a_sign_and_no_unit(opensim_files: dict[str, Path]) -> None:
    top, _, body = opensim_files["ik"].read_text().partition("endheader\n")
    labels, *lines = body.splitlines()
    place = labels.split("\t").index("pelvis_ty")
    cells = [line.split("\t") for line in lines]
    for row in cells:
        row[place] = repr(-float(row[place]))
    table = "\n".join([labels, *("\t".join(row) for row in cells)])
    opensim_files["ik"].write_text(f"{top}endheader\n{table}\n")
    with pytest.raises(DataError) as caught:
        import_gait(list(opensim_files.values()), ImportSettings(62.0, stature=1.63))
    assert re.search(r"the hip is -0\.87 m high \(pelvis_ty\), .* its sign is reversed", str(caught.value))


def test_an_ankle_that_rests_and_is_written_with_one_decimal_is_no_drop_out(
    csv_of: Callable[..., Path], columns: dict[str, Floats]
) -> None:
    away = np.degrees(columns[ANKLE]) - 90.0
    resting = 90.0 + np.sign(away) * np.maximum(np.abs(away) - 2.5, 0.0)
    written = {**columns, ANKLE: np.radians(np.round(resting, 1))}
    stays = np.flatnonzero(np.diff(written[ANKLE]) != 0.0)
    assert np.diff(stays).max() > 0.1 * 200.0, "the case is there: one value for more than 0.1 s"
    found = import_gait([csv_of(written)], ImportSettings(62.0))
    assert found.gait.strides == 5


def test_few_samples_and_a_scattering_plate_are_remarked(
    csv_of: Callable[..., Path], columns: dict[str, Floats], walk: Recording
) -> None:
    few = {name: values[::5] for name, values in columns.items()}
    found = import_gait([csv_of(few, walk.time[::5])], ImportSettings(62.0))
    (said,) = (line for line in found.remarks if "sampled at" in line)
    assert said.endswith("sampled at 40 Hz; heel strikes and toe-offs are accurate to about 12 ms")
    noise = np.random.default_rng(4).normal(0.0, 0.025, columns[FORCE].size)
    found = import_gait([csv_of({**columns, FORCE: columns[FORCE] - 0.025 + noise})], ImportSettings(62.0))
    assert any("vertical_force has noise of 0.0" in line for line in found.remarks)


def test_a_moment_that_hardly_shows_its_sign_is_remarked() -> None:
    curve = np.sin(np.linspace(0.0, 2.0 * np.pi, 101))
    assert moment_remarks(np.maximum(curve, -0.1)) == []
    (said,) = moment_remarks(np.maximum(curve, -0.8))
    assert "1 N m/kg in plantarflexion and 0.8 N m/kg in dorsiflexion" in said


def test_a_walker_who_turns_within_the_record_is_remarked(opensim_files: dict[str, Path]) -> None:
    top, _, body = opensim_files["ik"].read_text().partition("endheader\n")
    labels, *lines = body.splitlines()
    for degrees, is_said in ((30.0, False), (80.0, True)):
        turned = np.linspace(-0.5 * degrees, 0.5 * degrees, len(lines))
        rows = [f"{line}\t{angle!r}\t0.0" for line, angle in zip(lines, turned.tolist(), strict=True)]
        table = "\n".join([f"{labels}\tpelvis_rotation\tpelvis_tz", *rows])
        opensim_files["ik"].write_text(f"{top}endheader\n{table}\n")
        found = import_gait(list(opensim_files.values()), ImportSettings(62.0))
        assert any("the walker turns by 80 deg (pelvis_rotation)" in line for line in found.remarks) is is_said


def test_a_toe_off_that_events_of_the_file_state_is_not_called_guessed() -> None:
    phase = np.linspace(0.0, 1.0, 101)
    in_swing = {"ankle_moment": np.exp(-(((phase - 0.9) / 0.05) ** 2))}
    for is_guessed in (False, True):
        with pytest.raises(DataError, match="ankle_moment peaks at 90 % of the stride, but the foot is off") as error:
            check_moment_time(
                MeanStride({"ankle_moment": "walk.c3d"}, in_swing, 0.62, 1.1, "columns", False, is_guessed)
            )
        assert ("toe-off is guessed" in str(error.value)) is is_guessed
