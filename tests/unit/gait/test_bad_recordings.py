"""Recordings that cannot be right are refused: file, column and number are named, and what to do."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.gait.plausible import stride_remarks
from ppafo.gait.recorded import ImportSettings, import_gait
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
        "the sign is reversed",
    ),
    "ankle with zero as neutral": (
        changed(ANKLE, lambda x: x - np.pi / 2.0),
        "implies a foot tilted by -85 deg in mid-stance (plausible: up to 20 deg)",
    ),
    "moment counted the other way": (changed(MOMENT, np.negative), "in dorsiflexion, so its sign is reversed"),
    "moment of the body per kg": (changed(MOMENT, lambda x: 62.0 * x), "ankle_moment reaches 90.2 N m/kg (plausible"),
    "moment of the other foot": (
        changed(MOMENT, lambda x: np.roll(x, 104)),
        "ankle_moment peaks at 98 % of the stride, but the foot is off the ground from 64 % on: the moment is of",
    ),
    "moment on a later clock": (
        changed(MOMENT, lambda x: np.roll(x, 21)),
        "ankle_moment peaks at 58 % of the stride and is 0.57 N m/kg in swing, but the foot is off the ground from 64",
    ),
    "force of the other foot": (changed(FORCE, lambda x: np.roll(x, 104)), "of the other foot"),
    "force in newton without a unit": (
        changed(FORCE, lambda x: 608.0 * x),
        "vertical_force reaches 619 body weights (plausible: 0.5 to 2.5)",
    ),
    "force of both feet": (changed(FORCE, lambda x: x + 0.5), "0 heel strikes in vertical_force"),
    "force downwards": (changed(FORCE, np.negative), "below 0, so its sign is reversed"),
    "knee counted backwards": (changed(FORWARD, np.negative), "knee_forward is -10.1 m/s^2 around toe-off and 7.69"),
    "knee counted down": (
        changed(UP, np.negative),
        "knee_up is -5.03 m/s^2 around toe-off and 4.6",
    ),
    "knee with gravity": (changed(UP, lambda x: x + 9.81), "knee_up has a mean of 9.81 m/s^2"),
    "knee in millimetres": (scaled((FORWARD, UP), 1000.0), "divide both by 1000"),
    "knee forward alone times g": (scaled((FORWARD,), 9.80665), "divide knee_forward by 9.80665"),
    "knee times g": (scaled((FORWARD, UP), 9.80665), "divide both by 9.80665"),
    "knee in centimetres": (
        scaled((FORWARD, UP), 100.0),
        "knee_forward has a range of 2020 m/s^2 per stride (plausible: 0.5 to 80)",
    ),
    "knee exchanged": (exchanged, "exchange them"),
    "knee in g": (
        scaled((FORWARD, UP), 1.0 / 9.80665),
        "knee_forward and knee_up differ by 79 % (42 % if corrected) from a rotation of the knee about the resting "
        "ankle while the foot is flat; multiply both by 9.80665",
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
def test_what_no_leg_does_is_refused(csv_of: Callable[..., Path], columns: dict[str, Floats], case: str) -> None:
    change, message = CASES[case]
    path = csv_of(change(columns))
    with pytest.raises(DataError, match=re.escape(message)) as refused:
        import_gait([path], ImportSettings(62.0))
    assert str(path) in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_drop_out_in_all_strides_but_one_refuses_the_record(
    csv_of: Callable[..., Path], columns: dict[str, Floats]
) -> None:
    change = held((SHANK,), 150, 700)
    with pytest.raises(
        DataError, match=r"column 'shank_angle' of shank_angle is constant from .* while the wearer walks"
    ):
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


def test_a_reversed_shank_without_a_force_is_named_as_what_it_is(
    csv_of: Callable[..., Path], columns: dict[str, Floats]
) -> None:
    reversed_shank = changed(SHANK, np.negative)({name: x for name, x in columns.items() if name != FORCE})
    with pytest.raises(DataError, match=r"on the ground for 17.8 % of the stride, by shank_angle \(plausible"):
        import_gait([csv_of(reversed_shank)], ImportSettings(62.0))


@pytest.mark.parametrize(("factor", "shown"), [(0.6, "0.278"), (0.9, "0.417"), (1.3, "0.602")])
def test_a_force_that_is_not_half_the_weight_is_remarked(
    csv_of: Callable[..., Path], columns: dict[str, Floats], factor: float, shown: str
) -> None:
    (remark,) = import_gait([csv_of(scaled((FORCE,), factor)(columns))], ImportSettings(62.0)).remarks
    assert remark.startswith(f"vertical_force has a mean of {shown} body weights, but each leg of a steady walk")
    # One file need not be a list of one.
    assert import_gait(str(csv_of(columns)), ImportSettings(62.0)).remarks == ()


def test_a_gap_in_a_table_with_the_names_of_the_package_is_filled(
    csv_of: Callable[..., Path], columns: dict[str, Floats]
) -> None:
    columns[ANKLE][500:508] = np.nan
    lost, filled = (import_gait([csv_of(columns)], ImportSettings(62.0, longest_gap=gap)) for gap in (0.0, 0.1))
    assert (lost.gait.strides, filled.gait.strides) == (4, 5)


def test_a_time_in_milliseconds_is_refused(
    csv_of: Callable[..., Path], columns: dict[str, Floats], walk: Recording
) -> None:
    with pytest.raises(DataError, match=r"the stride time is 1040 s \(plausible: 0.5 to 3\)"):
        import_gait([csv_of(columns, 1000.0 * walk.time)], ImportSettings(62.0))


def test_a_column_in_two_files_is_refused(opensim_files: dict[str, Path], tmp_path: Path) -> None:
    twin = tmp_path / "twin.mot"
    twin.write_text(opensim_files["grf"].read_text())
    with pytest.raises(DataError, match=r"vertical_force: .* both have the column 'ground_force_vy'"):
        import_gait([*opensim_files.values(), twin], ImportSettings(62.0))


@pytest.mark.parametrize(
    "settings",
    [
        ImportSettings(62000.0),
        ImportSettings(float("nan")),
        ImportSettings(62.0, walking_speed=50.0),
        ImportSettings(62.0, stature=175.0),
        ImportSettings(62.0, low_pass=0.1),
        ImportSettings(62.0, low_pass=500.0),
        ImportSettings(62.0, least_strides=0),
    ],
)
def test_settings_that_make_no_sense_are_refused(
    csv_of: Callable[..., Path], columns: dict[str, Floats], settings: ImportSettings
) -> None:
    with pytest.raises(DataError, match=r"is not plausible|samples per second|must be 1 or more"):
        import_gait([csv_of(columns)], settings)


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
    assert re.search(r"the hip is -0\.87 m high \(pelvis_ty\): the sign of knee\.up is reversed", str(caught.value))


def test_a_moment_that_hardly_shows_its_sign_is_remarked() -> None:
    curve = np.sin(np.linspace(0.0, 2.0 * np.pi, 101))
    still = {"shank_angle": np.zeros(101), "ankle_angle": np.full(101, 0.5 * np.pi)}
    assert stride_remarks({**still, "ankle_moment": np.maximum(curve, -0.1)}) == []
    (said,) = stride_remarks({**still, "ankle_moment": np.maximum(curve, -0.8)})
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


@pytest.mark.parametrize(("first", "last", "strikes"), [(190, 390, "1 heel strike"), (10, 200, "0 heel strikes")])
def test_a_record_of_one_heel_strike_has_no_stride(
    csv_of: Callable[..., Path], columns: dict[str, Floats], walk: Recording, first: int, last: int, strikes: str
) -> None:
    part = {name: values[first:last] for name, values in columns.items()}
    with pytest.raises(DataError, match=f"{strikes} in vertical_force; a stride needs two"):
        import_gait([csv_of(part, walk.time[first:last])], ImportSettings(62.0))


def test_a_moment_file_without_a_whole_stride_is_named(opensim_files: dict[str, Path]) -> None:
    path = opensim_files["id"]
    lines = path.read_text().splitlines()
    path.write_text("\n".join("nRows=150" if line.startswith("nRows") else line for line in lines[:156]) + "\n")
    with pytest.raises(DataError, match=r"walk_id.sto: ankle_moment, 0 to .* covers no whole stride"):
        import_gait(list(opensim_files.values()), ImportSettings(62.0))
