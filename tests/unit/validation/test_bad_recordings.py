"""What cannot carry a comparison is refused in one line, or remarked on; never a silent wrong number."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ppafo.analyses.validate import validate
from ppafo.errors import DataError, PpafoError
from ppafo.parameters import load_device
from ppafo.parameters.device import Device
from ppafo.signals import Channel, Recording
from ppafo.validation.measured import check_recording, read_measured
from ppafo.validation.settings import ErrorLimit, parse_initial, parse_thresholds

Step = tuple[Device, Recording]
HEADER = "time [s],command [-],angle [deg],pressure_1 [psi_g],pressure_2 [psi_g]"
ROWS = [f"{0.001 * n:.3f},1,{20 + n},{min(n, 50)},{50 - min(n, 50)}" for n in range(60)]


def refused(recording: Recording, device: Device) -> str:
    with pytest.raises(DataError) as caught:
        check_recording(recording, device, "bench.csv")
    text = str(caught.value)
    assert text.startswith("bench.csv: ")
    assert "\n" not in text
    return text


def renamed(recording: Recording, old: str, new: str) -> Recording:
    channels = {new if name == old else name: channel for name, channel in recording.channels.items()}
    return Recording(recording.label, recording.time, channels, recording.kind)


def written(folder: Path, *lines: str) -> Path:
    path = folder / "bench.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ([HEADER.replace("pressure_1 [psi_g]", "pressure_1 [psi]"), *ROWS], ["pressure_1 [psi]", "psi_g"]),
        ([HEADER.replace("angle [deg]", "angel [deg]"), *ROWS], ["'angel' is unknown", "did you mean 'angle'"]),
        (
            [HEADER.replace("command [-]", "valve [-]"), *ROWS],
            ["no channel 'command'", "available: valve, angle"],
        ),
        ([HEADER, ROWS[0]], ["has 1 sample;"]),
        ([HEADER, *ROWS[:20], *(f"9{row}" for row in ROWS[20:])], ["gap of 90 s after 0.019 s (sample 20)"]),
        ([HEADER, *(row.replace(",1,", ",12,") for row in ROWS)], ["'command' is 12 in sample 1"]),
        (
            [HEADER, *(ROWS[0].replace("0.000", f"{0.001 * n:.3f}") for n in range(60))],
            ["which is too little to test a model"],
        ),
        ([HEADER.replace("psi_g", "psi_a"), *ROWS], ["'pressure_1' is 0 Pa absolute", "gauge"]),
        ([HEADER, ROWS[0], ROWS[1].replace("21", "1e9"), *ROWS[2:]], ["'angle' is", "(sample 2), more than 20 times"]),
    ],
    ids=[
        "psi without gauge",
        "misspelt channel",
        "no command",
        "one sample",
        "gap",
        "command in volts",
        "constant channels",
        "gauge as absolute",
        "spike",
    ],
)
def test_a_bad_file_is_refused_in_one_line_that_names_it(lines: list[str], words: list[str], tmp_path: Path) -> None:
    path = written(tmp_path, *lines)
    with pytest.raises(PpafoError) as caught:
        read_measured(path, load_device("ppafo2011"))
    text = str(caught.value)
    assert text.startswith(f"{path}: ")
    assert "\n" not in text
    assert all(word in text for word in words), text


def test_the_same_file_without_a_mistake_is_taken(tmp_path: Path) -> None:
    measured = read_measured(written(tmp_path, HEADER, *ROWS), load_device("ppafo2011"))
    assert measured.remarks == ()
    assert len(measured.sha256) == 64


def test_gauge_pressures_count_from_the_atmosphere_of_the_set(tmp_path: Path) -> None:
    path = written(tmp_path, HEADER, *ROWS)
    device = load_device("ppafo2011", valve=None, overrides=["supply.atmospheric_pressure=90 kPa_a"])
    assert read_measured(path, device).recording["pressure_1"][0] == 90000.0


def test_an_unknown_channel_that_is_like_none_is_left_out_and_said(step: Step) -> None:
    device, recording = step
    extra = recording.with_channel("room_temperature", np.full(len(recording), 295.0), "K")
    assert any("'room_temperature'" in remark for remark in check_recording(extra, device, "bench.csv").remarks)


def test_an_angle_far_beyond_the_stops_is_refused_and_noise_at_a_stop_is_not(
    step: Step, agree: Callable[..., Any]
) -> None:
    device, recording = step
    assert agree(recording.with_channel("angle", recording["angle"] - 0.01, "rad"), device).model["angle"][0] == (
        device.actuator.angle_min
    )
    for motion in ("free", "measured"):
        with pytest.raises(DataError, match=r"'angle' is -20 deg, beyond the stops of ppafo2011, 20 to 130 deg"):
            agree(recording.with_channel("angle", recording["angle"] - np.radians(40.0), "rad"), device, motion=motion)


def test_a_reversed_angle_is_named_as_that(step: Step, agree: Callable[..., Any]) -> None:
    device, recording = step
    with pytest.raises(DataError, match="with the opposite sign all angles would lie between the stops"):
        agree(recording.with_channel("angle", -recording["angle"], "rad"), device)


def test_a_prescribed_vane_needs_its_angle(step: Step, agree: Callable[..., Any]) -> None:
    device, recording = step
    blind = renamed(recording, "angle", "knee_flexion")
    with pytest.raises(DataError, match=r"needs a channel 'angle'"):
        agree(blind, device, motion="measured")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("angle=10 psi_d", "an angle is needed"),
        ("pressure_1=3 psi_g", "a pressure difference is needed"),
        ("pressure_1=3 psi", "needs the kind of pressure"),
        ("angle", "does not start with a number"),
        ("3 deg", "a plain number without a unit"),
        ("0.1", "must be in %"),
        ("angle=-5%", "must be above 0"),
    ],
)
def test_a_bad_threshold_is_refused(text: str, words: str) -> None:
    with pytest.raises(DataError) as caught:
        parse_thresholds([text])
    assert words in str(caught.value)


def test_thresholds_are_shares_or_errors_and_are_given_once() -> None:
    thresholds = parse_thresholds(["5%", "angle=2.2 deg", "pressure_1=7 percent"])
    assert thresholds[""] == ErrorLimit(0.05, is_fraction=True)
    assert thresholds["pressure_1"] == ErrorLimit(pytest.approx(0.07), is_fraction=True)
    assert thresholds["angle"] == ErrorLimit(pytest.approx(np.radians(2.2)), is_fraction=False)
    with pytest.raises(DataError, match=r"^threshold 'angle=1%' and 'angle = 2 deg' set the same value; remove"):
        parse_thresholds(["angle=1%", "angle = 2 deg"])
    with pytest.raises(DataError, match=r"^initial value 'angle=1 deg' and 'angle=2 deg' set the same value"):
        parse_initial(["angle=1 deg", "angle=2 deg"], 101325.0)


def test_channels_need_values_to_compare(step: Step) -> None:
    device, recording = step
    bare = Recording("bare", recording.time, {"command": Channel(recording["command"], "-")})
    assert "none of the channels to compare" in refused(bare, device)


@pytest.mark.parametrize("text", ["pressure_3=0 psi_g", "angle=3 psi_g", "pressure_1=3 psi", "pressure_1"])
def test_a_bad_initial_value_is_refused_and_a_gauge_one_counts_from_the_atmosphere(text: str) -> None:
    assert parse_initial(["pressure_1=0 psi_g"], 9e4) == {"pressure_1": 9e4}
    with pytest.raises(DataError, match="initial value"):
        parse_initial([text], 101325.0)


@pytest.mark.parametrize(
    "settings",
    [{"longest_delay": -1e-3}, {"longest_delay": 2.0}, {"motion": "mesured"}, {"volume": 0.0}, {"volume": math.nan}],
)
def test_settings_that_make_no_sense_are_refused_before_a_recording_is_read(settings: dict[str, Any]) -> None:
    with pytest.raises(PpafoError, match=r"delay|did you mean 'measured'|volume"):
        validate("ppafo2011", ["nowhere.csv"], **settings)
