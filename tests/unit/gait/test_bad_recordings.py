"""Recordings that cannot be right are refused: file, column and number are named, and what to do."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.gait.recorded import ImportSettings, import_gait
from ppafo.gait.recorded.mapping import (
    AngleMap,
    ForceMap,
    GaitMap,
    MomentMap,
    ShankMap,
    load_map,
    package_map,
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


CASES: dict[str, tuple[Change, str]] = {
    "degrees called radians": (
        changed(SHANK, np.degrees),
        "shank_angle moves over 4.15e+03 deg in a stride, plausible is 25 to 120 deg; the numbers look like degrees",
    ),
    "radians called degrees": (
        changed(ANKLE, lambda x: x, "ankle_angle [deg]"),
        "ankle_angle moves over 0.572 deg in a stride, plausible is 5 to 80 deg; the numbers look like radians",
    ),
    "shank counted the other way": (changed(SHANK, np.negative), "shank_angle grows while the foot stands"),
    "shank from the horizontal": (changed(SHANK, lambda x: x + 1.57), "shank_angle is 106 deg at heel strike and"),
    "ankle counted the other way": (
        changed(ANKLE, lambda x: np.pi - x),
        "its sign is reversed; turn it around in the file, or change ankle_angle.positive in a gait",
    ),
    "ankle with zero as neutral": (
        changed(ANKLE, lambda x: x - np.pi / 2.0),
        "would tilt the standing foot by -85 deg, plausible is within 35 deg",
    ),
    "moment counted the other way": (changed(MOMENT, np.negative), "into dorsiflexion: its sign is reversed"),
    "moment of the body per kg": (changed(MOMENT, lambda x: 62.0 * x), "ankle_moment reaches 90.2 N m/kg, plausible"),
    "force of the other foot": (changed(FORCE, lambda x: np.roll(x, 104)), "choose the other side"),
    "force in newton without a unit": (
        changed(FORCE, lambda x: 608.0 * x),
        "vertical_force reaches 619 body weights, plausible is 0.5 to 2.5; is the body mass",
    ),
    "force of both feet": (changed(FORCE, lambda x: x + 0.5), "no heel strikes were found"),
    "force downwards": (changed(FORCE, np.negative), "downwards: its sign is reversed; turn it around in the file"),
    "knee counted backwards": (changed(FORWARD, np.negative), "knee_forward is -10.1 m/s^2 about toe-off and 7.69"),
    "knee counted down": (
        changed(UP, np.negative),
        "turn it around in the file, or change the sign of knee.up in a gait map",
    ),
    "knee with gravity": (changed(UP, lambda x: x + 9.81), "an accelerometer shows gravity too: take it away"),
    "knee in millimetres": (
        changed(FORWARD, lambda x: 1000.0 * x),
        "knee_forward moves over 2.02e+04 m/s^2 in a stride, plausible is 0.5 to 80 m/s^2; is the unit right",
    ),
    "unknown unit": (
        changed(SHANK, lambda x: x, "shank_angle [turns]"),
        "column 'shank_angle [turns]': 'turns' is not a known",
    ),
    "unit of something else": (
        changed(SHANK, lambda x: x, "shank_angle [m]"),
        "column 'shank_angle [m]': unit 'm' does not fit: an angle is needed",
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


SIGNS: dict[str, Change] = {
    "shank_angle.positive": changed(SHANK, np.negative),
    "ankle_angle.positive": changed(ANKLE, lambda x: np.pi - x),
    "ankle_moment.positive": changed(MOMENT, np.negative),
    "vertical_force.positive": changed(FORCE, np.negative),
    "knee.forward": changed(FORWARD, np.negative),
    "knee.up": changed(UP, np.negative),
}


@pytest.mark.parametrize("key", SIGNS)
def test_the_remedy_changes_the_gait_map_only_where_one_was_given(
    csv_of: Callable[..., Path], columns: dict[str, Floats], key: str
) -> None:
    path = csv_of(SIGNS[key](columns))
    columns_map = package_map("right").model_copy(update={"centre_of_pressure": None})
    with pytest.raises(DataError, match=f"change (the sign of )?{re.escape(key)} in the gait map"):
        import_gait([path], ImportSettings(62.0, columns=columns_map))
    with pytest.raises(DataError, match=f"turn it around in the file, or change .*{re.escape(key)} in a gait map"):
        import_gait([path], ImportSettings(62.0))


def test_a_reversed_shank_without_a_force_is_named_as_what_it_is(
    csv_of: Callable[..., Path], columns: dict[str, Floats]
) -> None:
    reversed_shank = changed(SHANK, np.negative)({name: x for name, x in columns.items() if name != FORCE})
    with pytest.raises(DataError, match=r"comes from shank_angle: where its sign is reversed, turn it") as refused:
        import_gait([csv_of(reversed_shank)], ImportSettings(62.0))
    assert "force" not in str(refused.value)


def test_a_wrong_body_mass_shows_in_the_force(csv_of: Callable[..., Path], columns: dict[str, Floats]) -> None:
    newtons = changed(FORCE, lambda x: 608.0 * x, "vertical_force [N]")(columns)
    with pytest.raises(DataError, match="is the body mass right"):
        import_gait([csv_of(newtons)], ImportSettings(20.0))


def test_a_jump_of_the_time_is_named_by_row(
    csv_of: Callable[..., Path], columns: dict[str, Floats], walk: Recording
) -> None:
    time = np.where(np.arange(walk.time.size) >= 300, walk.time + 0.5, walk.time)
    with pytest.raises(DataError, match=r"the time jumps in row 301 from 1.49\d+ s to 1.99\d+ s, the usual interval"):
        import_gait([csv_of(columns, time)], ImportSettings(62.0))


def test_a_time_in_milliseconds_is_refused(
    csv_of: Callable[..., Path], columns: dict[str, Floats], walk: Recording
) -> None:
    with pytest.raises(DataError, match=r"a stride takes 1.04e\+03 s, plausible is 0.5 to 3 s; is the time in seconds"):
        import_gait([csv_of(columns, 1000.0 * walk.time)], ImportSettings(62.0))


def test_too_few_strides_are_refused_with_the_spans(
    csv_of: Callable[..., Path], columns: dict[str, Floats], walk: Recording
) -> None:
    short = {name: values[:400] for name, values in columns.items()}
    path = csv_of(short, walk.time[:400])
    with pytest.raises(DataError, match=r"has 1 whole stride within angles and events .*, 2 are needed; give a longer"):
        import_gait([path], ImportSettings(62.0))
    assert import_gait([path], ImportSettings(62.0, least_strides=1)).gait.strides == 1


def test_a_file_of_three_rows_is_refused(
    csv_of: Callable[..., Path], columns: dict[str, Floats], walk: Recording
) -> None:
    short = {name: values[:3] for name, values in columns.items()}
    without_force = {name: values for name, values in short.items() if name != FORCE}
    with pytest.raises(DataError, match="3 rows are too short for a stride"):
        import_gait([csv_of(without_force, walk.time[:3])], ImportSettings(62.0))


def test_a_moment_file_without_a_whole_stride_is_named(opensim_files: dict[str, Path]) -> None:
    path = opensim_files["id"]
    lines = path.read_text().splitlines()
    kept = [line if not line.startswith("nRows") else "nRows=150" for line in lines[: 6 + 150]]
    path.write_text("\n".join(kept) + "\n")
    with pytest.raises(
        DataError, match=r"walk_id.sto: ankle_moment goes from 0 to .* covers no whole stride .* leave it"
    ):
        import_gait(list(opensim_files.values()), ImportSettings(62.0))


def test_angles_without_a_unit_ask_for_it(opensim_files: dict[str, Path]) -> None:
    path = opensim_files["ik"]
    path.write_text(path.read_text().replace("Angles are in degrees.", ""))
    with pytest.raises(DataError, match=r"'pelvis_tilt': the file does not say its unit; give shank_angle.unit in a"):
        import_gait(list(opensim_files.values()), ImportSettings(62.0))


def test_a_column_in_two_files_is_refused(opensim_files: dict[str, Path], tmp_path: Path) -> None:
    twin = tmp_path / "twin.mot"
    twin.write_text(opensim_files["grf"].read_text())
    with pytest.raises(DataError, match=r"vertical_force: both .* have the column 'ground_force_vy'"):
        import_gait([*opensim_files.values(), twin], ImportSettings(62.0))


def test_files_of_different_forms_need_a_map(
    opensim_files: dict[str, Path], csv_of: Callable[..., Path], columns: dict[str, Floats]
) -> None:
    mixed = [csv_of(columns), opensim_files["grf"]]
    with pytest.raises(DataError, match=r"of different forms \(csv, opensim\); name the columns of all of them in a"):
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
    with pytest.raises(DataError, match=r"walk.trc: is none of .mot, .sto, .csv, .c3d"):
        import_gait([tmp_path / "walk.trc"], ImportSettings(62.0))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (ImportSettings(62000.0), "a body mass of 62000 kg is not plausible"),
        (ImportSettings(float("nan")), "a body mass of nan kg is not plausible"),
        (ImportSettings(62.0, walking_speed=50.0), "a walking speed of 50 m/s is not plausible"),
        (ImportSettings(62.0, stature=175.0), "a stature of 175 m is not plausible; give it in m, such as '1.75 m'"),
        (ImportSettings(62.0, low_pass=0.1), "a low pass at 0.1 Hz takes the walking away"),
        (ImportSettings(62.0, low_pass=500.0), "cannot be low-passed at 500 Hz: it has 200.3 samples a second"),
        (ImportSettings(62.0, least_strides=0), "the least number of strides is 1, not 0"),
        (ImportSettings(62.0, name="My gait"), "name 'My gait' must consist of small letters"),
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
        ("[ankle_angle]\nterms = ['a']\npositive = 'up'\n", "'shank_angle' is missing"),
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
            "thigh_length and thigh_unit have no meaning without thigh",
        ),
        ("[shank_angle\n", "is not valid TOML"),
        ("[shank_angle]\nterm = ['s']\n", "unknown key 'shank_angle.term', did you mean 'terms'"),
    ],
)
def test_a_wrong_map_is_refused_with_key_and_value(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "map.toml"
    path.write_text(text)
    with pytest.raises(DataError, match=re.escape(message)) as refused:
        load_map(path)
    assert str(refused.value).startswith(str(path))


def test_a_missing_map_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"none.toml: cannot be read: no such file"):
        load_map(tmp_path / "none.toml")
