"""Recordings."""

import copy
import pickle

import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.signals import Channel, Recording
from ppafo.storage.reading import read_recording


def recording(label: str = "bench", start: float = 0.0) -> Recording:
    time = start + np.arange(5.0)
    channels = {
        "angle": Channel(np.array([0.0, 1.0, 2.0, 3.0, 4.0]), "rad"),
        "command": Channel(np.array([1.0, -1.0, 1.0, -1.0, 1.0]), "-"),
    }
    return Recording(label, time, channels)


def test_a_channel_is_found_by_name_with_its_unit() -> None:
    assert recording()["angle"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert recording().unit("command") == "-"
    assert recording().names == ("angle", "command")


def test_an_unknown_channel_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(DataError, match="no channel 'angel', did you mean 'angle'"):
        recording()["angel"]


def test_what_is_made_of_a_recording_is_of_its_kind() -> None:
    given = Recording("bench", np.arange(3.0), {"angle": Channel(np.arange(3.0), "rad")}, "synthetic")
    made = (
        given.between(0.0, 1.0),
        given.resample([0.5, 1.5]),
        given.with_channel("command", [1.0, 0.0, 1.0], "-"),
        pickle.loads(pickle.dumps(given)),
        copy.deepcopy(given),
    )
    assert {item.kind for item in made} == {"synthetic"}
    assert given != Recording(given.label, given.time, given.channels, "simulated")


def test_a_recording_cannot_be_changed() -> None:
    given = recording()
    with pytest.raises(ValueError, match="read-only"):
        given["angle"][0] = 5.0
    with pytest.raises(ValueError, match="read-only"):
        given.time[0] = 5.0
    with pytest.raises(TypeError):
        given.channels["angle"] = given.channels["command"]  # type: ignore[index]


def test_a_recording_does_not_follow_the_arrays_it_was_made_of() -> None:
    values = np.array([0.0, 1.0])
    given = Recording("bench", np.array([0.0, 1.0]), {"angle": Channel(values, "rad")})
    values[0] = 9.0
    assert given["angle"][0] == 0.0


@pytest.mark.parametrize("times", [[], [0.0, 1.0, 1.0], [0.0, 2.0, 1.0]])
def test_time_that_is_empty_or_does_not_grow_is_refused(times: list[float]) -> None:
    with pytest.raises(DataError, match=r"has no samples|time must increase"):
        Recording("bench", np.array(times), {})


@pytest.mark.parametrize(
    ("name", "last", "unit"),
    [
        ("angle", [np.nan], "rad"),
        ("angle", [np.inf], "rad"),
        ("angle", [0.0], "deg"),
        ("torque", [], "N m"),
        ("time", [0.0], "s"),
        ("Angle (deg)", [0.0], "deg"),
        ("residual", [0.0], "N [m]"),
    ],
)
def test_a_channel_that_no_file_could_hold_is_refused(name: str, last: list[float], unit: str) -> None:
    with pytest.raises(DataError):
        recording().with_channel(name, [0.0, 1.0, 2.0, 3.0, *last], unit)


def test_a_channel_can_be_added_and_replaced_without_touching_the_original() -> None:
    given = recording()
    changed = given.with_channel("angle", np.ones(5), "rad").with_channel("torque", np.ones(5), "N m")
    assert changed["angle"].tolist() == [1.0] * 5
    assert changed.names == ("angle", "command", "torque")
    assert given == recording()


def test_a_part_keeps_the_samples_at_both_ends() -> None:
    part = recording().between(1.0, 3.0)
    assert part.time.tolist() == [1.0, 2.0, 3.0]
    assert part["angle"].tolist() == [1.0, 2.0, 3.0]


def test_between_samples_a_command_is_held_and_everything_else_runs_straight() -> None:
    moved = recording().resample([0.5, 1.75, 4.0])
    assert moved["angle"].tolist() == [0.5, 1.75, 4.0]
    assert moved["command"].tolist() == [1.0, -1.0, 1.0]


def test_nothing_is_made_up_outside_a_recording() -> None:
    with pytest.raises(DataError, match="cannot be resampled from 3 s to 4"):
        recording().resample([3.0, 4.5])


def test_recordings_that_differ_in_one_bit_are_not_equal() -> None:
    changed = recording()["angle"].copy()
    changed[3] = np.nextafter(changed[3], 9.0)
    assert recording().with_channel("angle", changed, "rad") != recording()
    assert recording("other") != recording()


def test_a_channel_that_declares_it_is_held_or_runs_straight_against_the_habit_of_its_name() -> None:
    usual = recording()
    declared = Recording(
        "bench",
        usual.time,
        {
            "angle": Channel(usual["angle"], "rad", "hold"),
            "command": Channel(usual["command"], "-", "linear"),
        },
    )
    moved = declared.between(0.0, 4.0).resample([0.5, 1.75])
    assert moved["angle"].tolist() == [0.0, 1.0]
    assert moved["command"].tolist() == [0.0, 0.5]
    assert moved.is_held("angle")
    assert not moved.with_channel("command", [1.0, 1.0], "-").is_held("command")


@pytest.mark.parametrize("units", [None, {"pressure_1": "psi_g"}])
def test_a_recording_is_a_table_that_is_read_again(units: dict[str, str] | None) -> None:
    channels = {"pressure_1": Channel(np.array([2.0e5, 3.0e5]), "Pa"), "command": Channel(np.array([0.0, 1.0]), "-")}
    recording = Recording("log", np.array([0.0, 0.1]), channels, "synthetic")
    table = recording.to_dataframe(units)
    again = read_recording(table)
    assert (again.label, again.kind, again.names) == ("log", "synthetic", recording.names)
    assert again["pressure_1"] == pytest.approx(recording["pressure_1"], rel=1e-10)
