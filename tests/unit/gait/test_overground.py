"""Overground C3D files with the outputs of Plug-in Gait, as they come: few plates, gaps at the ends, units by habit."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.gait.recorded import ImportedGait, ImportSettings, import_gait
from ppafo.gait.recorded.source import read_table
from ppafo.signals.recording import Floats
from tests.unit.gait.laboratory import GAIT, MASS, STRIDE, curve, force, markers, on_plate

PHASES = np.linspace(0.0, 1.0, 101)
RATE, FIRST, START = 100.0, 57, 0.23
Trial = Callable[..., Path]


@pytest.fixture
def trial(tmp_path: Path) -> Trial:
    """Writes a trial past plates: the right foot meets one in stride 1, the left one in stride 0."""
    ezc3d = pytest.importorskip("ezc3d", reason="the extra c3d is not installed")

    def write(
        seconds: float = 3.2,
        axis: tuple[int, float] = (0, 1.0),
        moment_unit: str = "Nmm",
        moment_scale: float = 1000.0,
        suffix: str = "",
        away: float = np.nan,
        has_events: bool = True,
        has_subject: bool = True,
        plates: dict[str, tuple[int, ...]] | None = None,
        has_outputs: bool = True,
        change: Callable[[dict[str, Floats]], None] | None = None,
    ) -> Path:
        time = START + np.arange(int(seconds * RATE)) / RATE
        nothing = np.zeros(time.size)
        points: dict[str, Floats] = {}
        for side in ("right", "left"):
            foot, strides = side[0].upper(), (plates or {"right": (1,), "left": (0,)})[side]
            seen = markers(time, side, *axis)
            for values in seen.values():
                values[:, :7] = values[:, -5:] = np.nan
            points |= seen
            ankle = 90.0 - np.degrees(curve("ankle_angle", time, side))
            ankle[:7] = np.nan
            points[f"{foot}AnkleAngles{suffix}"] = np.array([ankle, nothing, nothing])
            moment = np.where(on_plate(time, side, strides), moment_scale * curve("ankle_moment", time, side), away)
            reaction = force(time, side, strides, away) / MASS
            if has_outputs:
                points[f"{foot}AnkleMoment{suffix}"] = np.array([moment, nothing, nothing])
                points[f"{foot}GroundReactionForce{suffix}"] = np.array([nothing, nothing, reaction])
        if change is not None:
            change(points)
        file = ezc3d.c3d()
        _describe(file, list(points), moment_unit)
        if has_subject:
            file.add_parameter("PROCESSING", "Bodymass", [MASS])
            file.add_parameter("PROCESSING", "Height", [1710.0])
        if has_events:
            _add_events(file, seconds)
        file["header"]["points"]["first_frame"] = FIRST
        file["data"]["points"] = np.array([np.vstack([xyz, np.ones(time.size)]) for xyz in points.values()]).transpose(
            1, 0, 2
        )
        path = tmp_path / "trial.c3d"
        file.write(str(path))
        return path

    return write


def _describe(file: Any, labels: list[str], moment_unit: str) -> None:
    point = file["parameters"]["POINT"]
    point["RATE"]["value"], point["UNITS"]["value"], point["LABELS"]["value"] = [RATE], ["mm"], labels
    groups = {"ANGLE": ("Angles", "deg"), "MOMENT": ("Moment", moment_unit), "FORCE": ("Force", "N")}
    for group, (part, unit) in groups.items():
        of_group = [label for label in labels if part in label]
        if of_group:
            file.add_parameter("POINT", f"{group}S", of_group)
            file.add_parameter("POINT", f"{group}_UNITS", [unit])


def _add_events(file: Any, seconds: float) -> None:
    contexts, labels, times = [], [], []
    for side, delay in (("Right", 0.0), ("Left", 0.5 * STRIDE)):
        for stride in range(-1, 5):
            for label, phase in (("Foot Strike", 0.0), ("Foot Off", GAIT.stance_share)):
                time = (stride + phase) * STRIDE + delay - START
                if 0.08 < time < seconds - 0.06:
                    contexts.append(side)
                    labels.append(label)
                    times.append(time + FIRST / RATE)
    file.add_parameter("EVENT", "CONTEXTS", contexts)
    file.add_parameter("EVENT", "LABELS", labels)
    file.add_parameter("EVENT", "TIMES", np.array([np.zeros(len(times)), times]))


def error(found: ImportedGait, name: str) -> float:
    """Largest difference of a curve in stance from the true one, at the start that fits best."""
    stance = PHASES[PHASES < 0.6]
    values = found.gait.curve(name).values_at(stance)
    shifts = np.linspace(-0.03, 0.03, 61)
    return min(float(np.max(np.abs(values - GAIT.curve(name).values_at(stance + shift)))) for shift in shifts)


def assert_true(found: ImportedGait) -> None:
    assert found.gait.stride_time == pytest.approx(STRIDE, abs=0.006)
    assert error(found, "shank_angle") < 0.01
    assert error(found, "ankle_angle") < 0.01
    assert error(found, "ankle_moment") < 0.03
    assert error(found, "vertical_force") < 0.05


def test_events_subject_and_loads_of_a_trial_are_taken_from_the_file(trial: Trial) -> None:
    found = import_gait([trial()], ImportSettings())
    assert_true(found)
    assert (found.gait.body_mass, found.gait.stature, found.events) == (62.0, 1.71, "events of the file")
    assert found.gait.stance_share == pytest.approx(GAIT.stance_share, abs=1e-4)
    assert len(found.curves["vertical_force"].strides) == 1
    text = "\n".join(found.remarks)
    for line in (
        "body mass 62 kg, from trial.c3d",
        "stature 1.71 m, from trial.c3d",
        "column 'RAnkleMoment.x' was read in N mm/kg, from its magnitude: the file states 'N mm'",
        "column 'RGroundReactionForce.z' was read in N/kg, from its magnitude: the file states 'N'",
        "shank_angle, knee_forward, knee_up: missing outside 0.64 to 3.71 s (recording: 0.57 to 3.76 s)",
        "ankle_moment, vertical_force: missing in 68 % of the recording, where no plate measured this foot",
        "vertical_force covers 1 of 2 strides",
    ):
        assert line in text


def test_the_left_foot_has_its_own_events_and_plate(trial: Trial) -> None:
    found = import_gait([trial()], ImportSettings(side="left"))
    assert_true(found)
    assert len(found.curves["ankle_moment"].strides) == 1


@pytest.mark.parametrize(
    ("unit", "scale", "read"),
    [
        ("Nmm", 1000.0, "N mm/kg"),
        ("Nmm", 1000.0 * MASS, ""),
        ("N.mm/kg", 1000.0, ""),
        ("Nm/kg", 1.0, ""),
        ("Nm", 1.0, "N m/kg"),
        ("", MASS, "N m"),
    ],
)
def test_the_unit_of_a_moment_is_seen_from_its_size(trial: Trial, unit: str, scale: float, read: str) -> None:
    found = import_gait([trial(moment_unit=unit, moment_scale=scale)], ImportSettings())
    assert_true(found)
    said = [line for line in found.remarks if "AnkleMoment" in line]
    assert [f"was read in {read}, from its magnitude" in line for line in said] == [True] * bool(read)


def test_without_events_the_shank_gives_the_strides_and_the_plate_corrects_them(trial: Trial) -> None:
    path = trial(axis=(1, -1.0), suffix="V", has_events=False, has_subject=False)
    found = import_gait([path], ImportSettings(62.0))
    assert_true(found)
    assert found.gait.stance_share == pytest.approx(GAIT.stance_share, abs=0.02)
    text = "\n".join(found.remarks)
    assert "walking direction is -y, upwards is z" in text
    assert "few contacts on force plates: heel strikes and toe-offs from shank_angle, shifted by" in text
    with pytest.raises(DataError, match=r"trial.c3d: does not state the body mass, and body_mass is not given"):
        import_gait([path], ImportSettings())


def test_a_single_stride_past_a_plate_is_a_gait_unless_more_are_asked_for(trial: Trial) -> None:
    path = trial(seconds=2.35)
    found = import_gait([path], ImportSettings())
    assert found.gait.strides == 1
    assert_true(found)
    with pytest.raises(DataError, match=r"has 1 whole stride covered by .*, but least_strides is 2"):
        import_gait([path], ImportSettings(least_strides=2))


def test_another_body_mass_than_the_files_is_taken_and_said(trial: Trial) -> None:
    found = import_gait([trial()], ImportSettings(70.0))
    assert found.gait.body_mass == 70.0
    assert "body mass 70 kg as given; trial.c3d states 62 kg" in found.remarks
    assert not any("as given" in remark for remark in import_gait([trial()], ImportSettings(62.0)).remarks)


def test_a_walk_across_the_axes_is_refused(trial: Trial) -> None:
    def turned(points: dict[str, Floats]) -> None:
        for name in ("RKNE", "RANK"):
            points[name] = np.array([points[name][0], points[name][0], points[name][2]])

    with pytest.raises(DataError, match=r"walking direction is 45 deg off axis x"):
        import_gait([trial(change=turned)], ImportSettings())


def test_nonsense_in_subject_and_events_is_as_if_it_were_absent(trial: Trial) -> None:
    import ezc3d

    path = trial()
    file = ezc3d.c3d(str(path))
    file.add_parameter("PROCESSING", "Bodymass", [-1.0])
    file.add_parameter("EVENT", "TIMES", [1.0, 2.0, 3.0])
    file.write(str(path))
    found = read_table(path)
    assert (found.body_mass, found.events) == (None, {})
    (said,) = (line for line in found.remarks if "events" in line)
    assert "labels and 3 times, but needs the same number of each" in said


@pytest.mark.parametrize(
    ("flat", "said"),
    [(lambda times: times[1], "a flat list of seconds"), (lambda times: times.T.ravel(), "a flat list of minutes and")],
)
def test_a_flat_list_of_events_is_read_and_remarked(trial: Trial, flat: Any, said: str) -> None:
    import ezc3d

    path = trial()
    true = read_table(path).events
    file = ezc3d.c3d(str(path))
    times = np.asarray(file["parameters"]["EVENT"]["TIMES"]["value"])
    file.add_parameter("EVENT", "TIMES", flat(times).tolist())
    file.write(str(path))
    table = read_table(path)
    assert true is not None
    assert table.events is not None
    assert set(table.events) == set(true) != set()
    for key, expected in true.items():
        assert table.events[key] == pytest.approx(expected, abs=1e-6)
    assert any(said in line for line in table.remarks)


def test_plates_without_outputs_of_the_model_are_chosen_by_their_contacts(trial: Trial) -> None:
    import ezc3d

    path = trial(has_outputs=False, has_events=False)
    file = ezc3d.c3d(str(path))
    frames = file["data"]["points"].shape[2]
    time = START + np.arange(10 * frames) / (10.0 * RATE)
    channels = []
    for side, stride in (("left", 0), ("right", 1)):
        load = force(time, side, [stride])
        # A plate of type 2 measures what the foot does to it, in axes of its own with z downwards.
        channels += [0.0 * load, 0.0 * load, load, 0.0 * load, 0.0 * load, 0.0 * load]
    names = [f"{name}{plate}" for plate in (1, 2) for name in ("Fx", "Fy", "Fz", "Mx", "My", "Mz")]
    analog = file["parameters"]["ANALOG"]
    analog["RATE"]["value"], analog["LABELS"]["value"] = [10.0 * RATE], names
    analog["UNITS"]["value"] = ["N", "N", "N", "Nmm", "Nmm", "Nmm"] * 2
    corners = np.zeros((3, 4, 2))
    corners[:2, :, 0] = [[400.0, 400.0, 0.0, 0.0], [0.0, 600.0, 600.0, 0.0]]
    corners[:, :, 1] = corners[:, :, 0] + np.array([[700.0], [0.0], [0.0]])
    plates = {
        "USED": [2],
        "TYPE": [2, 2],
        "CORNERS": corners,
        "ORIGIN": np.array([[0.0, 0.0], [0.0, 0.0], [-40.0, -40.0]]),
        "CHANNEL": np.arange(1, 13).reshape(2, 6).T,
    }
    for name, value in plates.items():
        group = file["parameters"]["FORCE_PLATFORM"]
        group[name] = {**group[name], "value": np.array(value)}
    file["data"]["analogs"] = np.array(channels)[None, :, :]
    file.write(str(path))
    for side, plate in (("right", 2), ("left", 1)):
        found = import_gait([path], ImportSettings(side=side))  # type: ignore[arg-type]
        text = "\n".join(found.remarks)
        assert f"on 'force plate {plate}.z' (1)" in text
        assert error(found, "vertical_force") < 0.05
        assert len(found.curves["vertical_force"].strides) == 1
