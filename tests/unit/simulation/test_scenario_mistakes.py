"""Every mistake in a scenario is one line: the file, the key, the value, what is allowed, the nearest name."""

import tomllib
from pathlib import Path
from typing import Any

import pytest

from ppafo.errors import PpafoError, ScenarioError
from ppafo.simulation.loading import load_scenario, scenario_from_dict
from tests.scenario_text import parse_scenario

TEXT = """
schema_version = 1
name = "task"

[device]
set = "ppafo2011"
valve = "proportional"

[run]
duration = "3 s"
step = "1 ms"
output_interval = "1 ms"

[motion]
kind = "locked"
angle = "75 deg"

[initial]
pressure_1 = "0 psi_g"
pressure_2 = "atmosphere"

[controller]
kind = "pid"
rate = "1 kHz"
proportional_gain = "0.095 1/(N m)"

[reference]
kind = "ramp_hold"
level = "6 N m"

[sensors]
delay = "0 s"
seed = 1
"""


def problem_with(content: bytes, kind: type[PpafoError] = ScenarioError) -> str:
    with pytest.raises(kind) as caught:
        parse_scenario(content, "task.toml")
    message = str(caught.value)
    assert message.startswith("task.toml: ")
    assert "\n" not in message
    return message


def problem_after(old: str, new: str, kind: type[PpafoError] = ScenarioError) -> str:
    assert old in TEXT
    return problem_with(TEXT.replace(old, new).encode(), kind)


@pytest.mark.parametrize(
    ("old", "new", "nearest"),
    [
        ('"pid"', '"pdi"', "controller.kind = 'pdi' is not known, did you mean 'pid'?"),
        ('"locked"', '"lokced"', "motion.kind = 'lokced' is not known, did you mean 'locked'?"),
        ('"ramp_hold"', '"ramp"', "reference.kind = 'ramp' is not known"),
    ],
)
def test_an_unknown_kind_is_answered_with_what_there_is(old: str, new: str, nearest: str) -> None:
    assert nearest in problem_after(old, new)


@pytest.mark.parametrize(
    ("line", "missing"),
    [
        ('duration = "3 s"', "'run.duration' is missing"),
        ('kind = "pid"', "'controller.kind' is missing"),
        ('rate = "1 kHz"', "'controller.rate' is missing"),
        ("schema_version = 1", "'schema_version' is missing"),
    ],
)
def test_what_is_missing_is_named(line: str, missing: str) -> None:
    assert missing in problem_after(line, "")


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        (
            '"75 deg"',
            "75",
            "motion.angle = 75: a number without a unit; must be a text with its unit, for example '75 deg'",
        ),
        ('"75 deg"', '"75"', "an angle is needed, for example '75 deg'"),
        ('"75 deg"', '"75 degg"', "'degg' is not a known unit, did you mean 'deg'?"),
        ('"75 deg"', '"warm"', "does not start with a number"),
        ('"75 deg"', "true", "motion.angle = true: must be a text with its unit"),
        ('"75 deg"', "1979-05-27", "must be a text with its unit"),
        ('"75 deg"', '"1e400 deg"', "not a finite number"),
        ('"0.095 1/(N m)"', "0.095", "for example '0.095 1/(N m)'"),
        (
            '"0.095 1/(N m)"',
            '"-1 1/(N m)"',
            "must be at least 0 1/(N m) and at most 1e+06 1/(N m) (k_p)",
        ),
        ('"0 psi_g"', '"50 psi"', "'psi' needs the kind of pressure"),
        ('"0 psi_g"', '"50 psi_d"', "a pressure level is needed"),
        ('"0 psi_g"', "50", "for example '50 psi_g'"),
        ('"0 psi_g"', '"0 Pa_a"', "at least 1000 Pa_a"),
        (
            '"atmosphere"',
            '"atmosphre"',
            "or one of supply, dorsiflexion_supply, atmosphere, did you mean 'atmosphere'?",
        ),
        ('"6 N m"', '"6 deg"', "a unit like 'N m' is needed"),
        ('"6 N m"', '"1e9 N m"', "must be at least -10000 N m and at most 10000 N m ("),
        ('"1 kHz"', '"0 Hz"', "samples per second"),
        ("seed = 1", "seed = 1.5", "sensors.seed = 1.5"),
        ("seed = 1", "seed = -1", "sensors.seed = -1"),
        ("schema_version = 1", "schema_version = 2", "schema_version = 2 is not allowed; allowed: 1"),
        ('"task"', '"My Task"', "name = 'My Task' must consist of lower-case letters, digits, '-' and '_'"),
        ('[sensors]\ndelay = "0 s"\nseed = 1', "", ""),
        ("[sensors]", "[[sensors]]", "must be a table"),
    ],
)
def test_a_value_that_does_not_fit_says_what_would(old: str, new: str, reason: str) -> None:
    if reason:
        assert reason in problem_after(old, new)
    else:
        assert parse_scenario(TEXT.replace(old, new).encode(), "task.toml").sensors.seed == 1


@pytest.mark.parametrize(
    ("angle", "stops"),
    [
        ("19.9 deg", "20 deg to 130 deg"),
        ("-1 rad", "0.349066 rad to 2.26893 rad"),
    ],
)
def test_an_angle_outside_the_stops_is_refused_with_the_stops_in_its_unit(angle: str, stops: str) -> None:
    assert f"must be between the stops of ppafo2011, {stops}" in problem_after('"75 deg"', f'"{angle}"')


@pytest.mark.parametrize("angle", ["20 deg", "130 deg"])
def test_an_angle_on_a_stop_is_allowed(angle: str) -> None:
    assert parse_scenario(TEXT.replace("75 deg", angle).encode(), "task.toml")


PRESCRIBED = 'kind = "prescribed"\n[motion.profile]\n'


@pytest.mark.parametrize(
    "profile",
    [
        'kind = "sine"\nlevel = "75 deg"\namplitude = "55.1 deg"\nfrequency = "0.7 Hz"',
        'kind = "sine"\nlevel = "75 deg"\namplitude = "-56 deg"\nfrequency = "97.3 Hz"',
        'kind = "ramp_hold"\nstart_level = "75 deg"\nlevel = "131 deg"',
        'kind = "ramp_hold"\nstart_level = "0 deg"\nlevel = "75 deg"\nramp_time = "1 us"',
    ],
)
def test_a_prescribed_vane_that_leaves_the_stops_is_refused_with_the_time(profile: str) -> None:
    message = problem_after('kind = "locked"\nangle = "75 deg"', PRESCRIBED + profile)
    assert "[motion.profile] leaves the stops of ppafo2011, 20 deg to 130 deg: " in message
    assert message.endswith(" s")


def test_a_prescribed_vane_may_touch_the_stops() -> None:
    profile = 'kind = "sine"\nlevel = "75 deg"\namplitude = "55 deg"\nfrequency = "0.7 Hz"'
    assert parse_scenario(TEXT.replace('kind = "locked"\nangle = "75 deg"', PRESCRIBED + profile).encode(), "task.toml")


def test_a_ramp_that_would_leave_the_stops_after_the_run_is_allowed() -> None:
    profile = 'kind = "ramp_hold"\nstart_level = "75 deg"\nlevel = "131 deg"\nramp_time = "4 s"'
    assert parse_scenario(TEXT.replace('kind = "locked"\nangle = "75 deg"', PRESCRIBED + profile).encode(), "task.toml")


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ('"3 s"', '"0 s"', "run.duration = '0 s': must be more than 0 s"),
        ('"3 s"', '"2 min^2"', "a unit like 's' is needed"),
        (
            'step = "1 ms"',
            'step = "2 ms"',
            "run.step = '2 ms': must not exceed the period of controller.rate = 1 kHz (1 ms)",
        ),
        ('output_interval = "1 ms"', 'output_interval = "0.5 ms"', "must not be below run.step = 0.001 s"),
        ('output_interval = "1 ms"', 'output_interval = "4 s"', "must not exceed run.duration = 3 s"),
        (
            'output_interval = "1 ms"',
            'output_interval = "0.7 s"',
            "must divide run.duration = 3 s evenly, not 4.28571 times",
        ),
        ('"3 s"', '"60000 s"', "samples, at most 5e+06: increase run.output_interval"),
        (
            '"3 s"\nstep = "1 ms"',
            '"30 s"\nstep = "1e-8 s"',
            "3e+09 steps, at most 1e+09: shorten it or increase run.step",
        ),
        (
            'rate = "1 kHz"',
            'rate = "1 kHz"\nperiod = "1 ms"',
            "give either controller.rate or controller.period, not both",
        ),
        ('delay = "0 s"', 'delay = "-1 ms"', "must be at least 0 ms"),
        ('delay = "0 s"', 'delay = "3.1 s"', "must not be longer than run.duration"),
    ],
)
def test_times_that_do_not_go_together_are_refused(old: str, new: str, reason: str) -> None:
    assert reason in problem_after(old, new)


@pytest.mark.parametrize(
    "change", [{1: 2}, {"run": None}, {"run": 3}, {"assumed": {"run.step": 3}}, {"assumed": {1: ""}}, {"name": "a\nb"}]
)
def test_plain_values_of_a_wrong_type_are_clean_errors(change: dict[Any, Any]) -> None:
    content: dict[Any, Any] = tomllib.loads(TEXT)
    with pytest.raises(ScenarioError) as caught:
        scenario_from_dict({**content, **change})
    assert str(caught.value).startswith("scenario ")
    assert "\n" not in str(caught.value)


def test_only_a_controller_that_follows_nothing_may_be_without_a_reference() -> None:
    without = TEXT.replace("[reference]", "").replace('kind = "ramp_hold"', "").replace('level = "6 N m"', "")
    assert problem_with(without.encode()).startswith("task.toml: 'reference' is missing: controller.kind = 'pid'")
    constant = (
        without.replace('"pid"', '"constant"').replace("proportional_gain", "command").replace("0.095 1/(N m)", "1")
    )
    assert parse_scenario(constant.encode(), "task.toml").reference.settings == {"level": 0.0}
    words = ["reference.kind=constant", "reference.level=5 N m"]
    assert parse_scenario(without.encode(), "task.toml", words).reference.settings == {"level": 5.0}


@pytest.mark.parametrize(
    ("changes", "overrides", "said"),
    [
        (
            {"duration =": "durration =", '"locked"': '"lockd"', '"pid"': '"pdi"'},
            (),
            ["line 10: unknown key 'run.durration', did you mean 'duration'?", "did you mean 'locked'?", "mean 'pid'?"],
        ),
        (
            {},
            ("reference.levle=1 N m", "motion.angel=3 deg", "supply.presure=3 psi_g"),
            ["did you mean 'reference.level'?", "did you mean 'motion.angle'?", "did you mean 'supply.pressure'?"],
        ),
        ({"schema_version = 1": 'schema_version = "1"'}, (), ["line 2: ", "without quotation marks; allowed: 1"]),
        ({"[run]": '[run]\nduration = "2 s"'}, (), ["line 11: duration is given twice"]),
        ({'"ramp_hold"': '"tabulated"', "level =": "time_2 ="}, (), ["did you mean 'time_02'?"]),
    ],
)
def test_all_mistakes_are_named_with_their_lines(
    tmp_path: Path, changes: dict[str, str], overrides: tuple[str, ...], said: list[str]
) -> None:
    text = TEXT
    for old, new in changes.items():
        assert text.count(old) == 1
        text = text.replace(old, new)
    path = tmp_path / "own.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(PpafoError) as refused:
        load_scenario(path, overrides)
    for words in said:
        assert words in str(refused.value)
