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
from tests.property.damage import CHANGES, Change, damaged
from tests.scenario_text import parse_scenario

FILE = "damaged.toml"
ORIGINALS = [
    (resources.files("ppafo") / "scenarios" / f"{name}.toml").read_text(encoding="utf-8") for name in list_scenarios()
]
SECTIONS = st.sampled_from(["device", "run", "motion", "initial", "controller", "reference", "sensors", "assumed"])


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
    # Several faults of one file stand in one line, each with the name of the file.
    assert re.match(rf"(\d+ things are wrong: \(1\) )?{re.escape(FILE)}: ", message)
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
    assert scenario.run.duration / scenario.run.step <= 1.0001e9
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


@settings(max_examples=150)
@given(text=st.sampled_from(ORIGINALS), changes=CHANGES)
def test_damaged_lines_give_a_clear_error_or_a_scenario_that_can_be_run(text: str, changes: list[Change]) -> None:
    scenario = outcome_of(damaged(text, changes))
    if scenario is not None:
        assert_can_be_run(scenario)


@settings(max_examples=80)
@given(
    text=st.sampled_from(ORIGINALS),
    flips=st.lists(st.tuples(st.integers(0, 10_000), st.integers(0, 255)), min_size=1, max_size=6),
    end=st.integers(0, 10_000),
)
def test_flipped_bytes_and_a_cut_give_a_clear_error_or_a_scenario_that_can_be_run(
    text: str, flips: list[tuple[int, int]], end: int
) -> None:
    content = bytearray(text.encode())
    for place, value in flips:
        content[place % len(content)] = value
    for damage in (bytes(content), text.encode()[: end % len(text)]):
        scenario = outcome_of(damage)
        if scenario is not None:
            assert_can_be_run(scenario)


@settings(max_examples=60)
@given(
    text=st.sampled_from(ORIGINALS),
    removed=st.lists(SECTIONS, max_size=2),
    other=st.sampled_from(ORIGINALS),
    name=SECTIONS,
)
def test_sections_removed_doubled_or_from_elsewhere_give_a_clear_error_or_a_scenario_that_can_be_run(
    text: str, removed: list[str], other: str, name: str
) -> None:
    for section in removed:
        text = text.replace(section_of(text, section), "")
    scenario = outcome_of(f"{text}\n{section_of(other, name)}\n".encode())
    if scenario is not None:
        assert_can_be_run(scenario)


@settings(max_examples=60)
@given(content=st.binary(max_size=200))
@example(b"")
@example(b"\xef\xbb\xbf")
def test_any_bytes_are_a_clear_error(content: bytes) -> None:
    assert outcome_of(content) is None
