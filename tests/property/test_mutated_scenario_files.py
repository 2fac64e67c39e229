"""Damaged scenario files end in one clear line or in a scenario that can be run."""

import math
import re
from importlib import resources

from hypothesis import example, given, settings
from hypothesis import strategies as st

from ppafo.control.catalog import PROFILES
from ppafo.errors import PpafoError
from ppafo.simulation.loading import list_scenarios
from ppafo.simulation.profiles import profile_parameters
from ppafo.simulation.scenario import FreeMotion, Scenario
from tests.scenario_text import parse_scenario

FILE = "damaged.toml"
ORIGINALS = [
    (resources.files("ppafo") / "scenarios" / f"{name}.toml").read_text(encoding="utf-8") for name in list_scenarios()
]
BARE = ["\n".join(line for line in text.splitlines() if line and not line.startswith("#")) for text in ORIGINALS]
NUMBERS = ["0", "-1", "-0.0", "0.5", "1e308", "-1e308", "1e-308", "1e400", "nan", "-inf", "inf", "10" * 200, "0x1F"]
UNITS = ["s", "ms", "us", "min", "Hz", "kHz", "deg", "rad", "rad/s", "N m", "psi", "psi_g", "psi_a", "psi_d", "Pa_a"]
UNITS += [
    "bar_g",
    "mm^2",
    "1/(N m)",
    "1/(N m s)",
    "s/(N m)",
    "%",
    "K",
    "degC",
    "furlong",
    "psi_x",
    "(((",
    "m" * 300,
    "\\n",
]
WORDS = [
    "",
    "supply",
    "atmosphere",
    "pid",
    "on_off",
    "free",
    "locked",
    "prescribed",
    "sine",
    "ramp_hold",
    "ppafo2011-printed",
]
WORDS += [
    "solenoid",
    "nowhere.toml",
    "../..",
    "/dev/null",
    "a/" * 2500,
    "b" * 300,
    "\\u0000",
    "\\ud7ff",
    "\\n\\r\\u2028",
]
QUANTITIES = [f"{number} {unit}" for number in NUMBERS for unit in UNITS]
JUNK = [*NUMBERS, "true", "[]", "{}", "[[[[", "{a=1}", "1979-05-27", "07:32:00", '["a"]', "'''", '"""']

places = st.integers(0, 200)
quoted = st.sampled_from([*QUANTITIES, *WORDS]).map('"{}"'.format)
mutations = st.one_of(
    st.tuples(st.just("value"), places, st.one_of(quoted, st.sampled_from(JUNK))),
    st.tuples(st.just("unit"), places, st.sampled_from(UNITS)),
    st.tuples(st.just("key"), places, st.text("abcdeklmnoprstuv_.[]=\"'", min_size=1, max_size=8)),
    st.tuples(st.just("misspell"), places, st.sampled_from("aeioust_")),
    st.tuples(st.just("delete"), places, st.just("")),
    st.tuples(st.just("repeat"), places, st.just("")),
    st.tuples(st.just("insert"), places, st.text(max_size=20)),
)
sections = st.sampled_from(["device", "run", "motion", "initial", "controller", "reference", "sensors", "assumed"])


def damaged(lines: list[str], changes: list[tuple[str, int, str]]) -> str:
    lines = list(lines)
    for action, place, text in changes:
        number = place % len(lines)
        line = lines[number]
        key, equals, value = line.partition("=")
        replacement = {
            "value": f"{key}= {text}" if equals else line,
            "unit": with_unit(line, text),
            "key": f"{text} ={value}" if equals else f"[{text}]",
            "misspell": f"{line[: place % (len(line) + 1)]}{text}{line[place % (len(line) + 1) + 1 :]}",
            "delete": "",
            "repeat": f"{line}\n{line}",
            "insert": f"{line[: len(line) // 2]}{text}{line[len(line) // 2 :]}",
        }
        lines[number] = replacement[action]
    return "\n".join(lines)


def with_unit(line: str, unit: str) -> str:
    """The line with another unit behind the number of its quantity."""
    return re.sub(r'"([-+0-9.e]+)[^"]*"', lambda match: f'"{match[1]} {unit}"', line)


def section_of(text: str, name: str) -> str:
    """The lines of a section, from its header to the next one."""
    found = re.search(rf"^\[{name}(?:\.\w+)?\].*?(?=^\[|\Z)", text, re.DOTALL | re.MULTILINE)
    return found[0] if found else ""


def outcome_of(content: bytes) -> Scenario | None:
    """What the loader makes of a file; only one clear line that names the file may be the answer instead."""
    try:
        return parse_scenario(content, FILE)
    except PpafoError as error:
        message = str(error)
    assert message.startswith(f"{FILE}: ")
    assert len(message.splitlines()) == 1
    assert len(message) < 6000
    return None


def assert_can_be_run(scenario: Scenario) -> None:
    """What got through keeps the promises that the engine relies on."""
    numbers = [scenario.run.duration, scenario.run.step, scenario.run.output_interval, scenario.controller.period]
    numbers += [scenario.initial.pressure_1, scenario.initial.pressure_2]
    assert all(math.isfinite(number) and number > 0.0 for number in numbers)
    for whole in (scenario.run.duration, scenario.run.output_interval, scenario.controller.period):
        count = whole / scenario.run.step
        assert round(count) >= 1
        assert abs(count - round(count)) < 1e-5
    assert scenario.run.duration / scenario.run.step <= 1.0001e8
    assert 0.0 <= scenario.sensors.delay <= min(scenario.run.duration, 1.0001e5 * scenario.run.step)
    assert (
        scenario.device.actuator.angle_min - 1e-6 <= start_angle(scenario) <= scenario.device.actuator.angle_max + 1e-6
    )


def start_angle(scenario: Scenario) -> float:
    if isinstance(scenario.motion, FreeMotion):
        return scenario.motion.angle
    profile = scenario.motion.profile
    angle: float = PROFILES[profile.kind].value(profile_parameters(profile), 0.0)[0]
    return angle


@settings(max_examples=1500)
@given(text=st.sampled_from(BARE), changes=st.lists(mutations, min_size=1, max_size=4))
def test_damaged_lines_give_a_clear_error_or_a_scenario_that_can_be_run(
    text: str, changes: list[tuple[str, int, str]]
) -> None:
    scenario = outcome_of(damaged(text.splitlines(), changes).encode("utf-8", "surrogatepass"))
    if scenario is not None:
        assert_can_be_run(scenario)


@settings(max_examples=700)
@given(
    text=st.sampled_from(ORIGINALS),
    flips=st.lists(st.tuples(st.integers(0, 10_000), st.integers(0, 255)), min_size=1, max_size=6),
)
def test_flipped_bytes_give_a_clear_error_or_a_scenario_that_can_be_run(
    text: str, flips: list[tuple[int, int]]
) -> None:
    content = bytearray(text.encode())
    for place, value in flips:
        content[place % len(content)] = value
    scenario = outcome_of(bytes(content))
    if scenario is not None:
        assert_can_be_run(scenario)


@settings(max_examples=300)
@given(text=st.sampled_from(BARE), removed=st.lists(sections, max_size=2), other=st.sampled_from(BARE), name=sections)
def test_sections_removed_doubled_or_from_elsewhere_give_a_clear_error_or_a_scenario_that_can_be_run(
    text: str, removed: list[str], other: str, name: str
) -> None:
    for section in removed:
        text = text.replace(section_of(text, section), "")
    scenario = outcome_of(f"{text}\n{section_of(other, name)}\n".encode())
    if scenario is not None:
        assert_can_be_run(scenario)


@settings(max_examples=300)
@given(text=st.sampled_from(ORIGINALS), end=st.integers(0, 5000))
def test_a_file_that_was_cut_off_gives_a_clear_error_or_a_scenario_that_can_be_run(text: str, end: int) -> None:
    scenario = outcome_of(text.encode()[:end])
    if scenario is not None:
        assert_can_be_run(scenario)


@settings(max_examples=300)
@given(content=st.binary(max_size=200))
@example(b"")
@example(b"\xef\xbb\xbf")
def test_any_bytes_are_a_clear_error(content: bytes) -> None:
    assert outcome_of(content) is None
