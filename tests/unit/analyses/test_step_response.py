"""The sequence that the text tells of the step response, looked for in recordings drawn by hand."""

import numpy as np
import pytest

from ppafo.analyses.reproduce.paper import step_events, step_observations
from ppafo.constants import PASCALS_PER_PSI
from ppafo.parameters.device import Supply
from ppafo.signals import Channel, Recording

ATMOSPHERE = 101325.0
SUPPLY = Supply(*(ATMOSPHERE + 55.0 * PASCALS_PER_PSI,) * 2, ATMOSPHERE)
TIME = np.linspace(0.0, 0.4, 401)
BREAKAWAY, STOP = 0.05, 0.25


def drawn(points: dict[float, float]) -> np.ndarray:
    """Straight lines through the points, at every millisecond."""
    return np.interp(TIME, list(points), list(points.values()))


def pressure(points: dict[float, float]) -> Channel:
    return Channel(ATMOSPHERE + PASCALS_PER_PSI * drawn(points), "Pa")


def recording(**changed: Channel) -> Recording:
    """A step response as the text tells it, with channels exchanged."""
    channels = {
        "angle": Channel(np.radians(drawn({0.0: 20.0, BREAKAWAY: 20.0, STOP: 130.0, 0.4: 130.0})), "rad"),
        "pressure_1": pressure({0.0: 0.0, BREAKAWAY: 40.0, 0.15: 25.0, STOP: 30.0, 0.35: 55.0, 0.4: 55.0}),
        "pressure_2": pressure({0.0: 55.0, BREAKAWAY: 35.0, 0.2: 33.0, STOP: 20.0, 0.3: 0.0, 0.4: 0.0}),
    }
    return Recording("drawn", TIME, {**channels, **changed})


def held(changed: Recording) -> dict[str, bool]:
    return {item.entry.id: item.verdict != "undetermined" for item in step_observations(changed, SUPPLY)}


def test_breakaway_is_the_last_sample_at_rest_and_stop_the_first() -> None:
    events = step_events(recording())
    assert events is not None
    assert TIME[list(events)] == pytest.approx((BREAKAWAY, STOP), abs=1e-9)


def test_a_recording_that_goes_as_the_text_tells_shows_every_sentence() -> None:
    assert [name for name, holds in held(recording()).items() if not holds] == []
    found = {item.entry.id: item.found for item in step_observations(recording(), SUPPLY)}
    assert "40.0 psig" in found["pressure_1_rises_until_breakaway"]


@pytest.mark.parametrize(
    ("broken", "channel", "points"),
    [
        ("pressure_1_rises_until_breakaway", "pressure_1", {0.0: 40.0, BREAKAWAY: 30.0, 0.15: 20.0, 0.35: 55.0}),
        ("pressure_1_falls_in_motion", "pressure_1", {0.0: 0.0, BREAKAWAY: 40.0, 0.35: 55.0, 0.4: 55.0}),
        ("pressure_1_goes_to_supply", "pressure_1", {0.0: 0.0, BREAKAWAY: 40.0, 0.15: 25.0, 0.35: 50.0}),
        ("pressure_2_falls_from_supply", "pressure_2", {0.0: 50.0, BREAKAWAY: 35.0, 0.2: 33.0, 0.3: 0.0}),
        ("pressure_2_slows_in_motion", "pressure_2", {0.0: 55.0, 0.3: 0.0, 0.4: 0.0}),
        ("pressure_2_goes_to_atmosphere", "pressure_2", {0.0: 55.0, BREAKAWAY: 35.0, 0.2: 33.0, 0.4: 5.0}),
        ("difference_builds_up", "pressure_1", {0.0: 0.0, BREAKAWAY: 40.0, 0.15: 25.0, 0.35: 50.0}),
    ],
)
def test_a_recording_that_goes_otherwise_does_not_show_the_sentence(
    broken: str, channel: str, points: dict[float, float]
) -> None:
    assert held(recording(**{channel: pressure(points)}))[broken] is False


def test_gas_that_only_vents_ever_more_slowly_does_not_count_as_compressed() -> None:
    venting = Channel(ATMOSPHERE + 55.0 * PASCALS_PER_PSI * np.exp(-TIME / 0.03), "Pa")
    assert held(recording(pressure_2=venting))["pressure_2_slows_in_motion"] is False


def test_a_pressure_1_that_peaks_while_the_vane_sets_off_falls_in_motion() -> None:
    peaked = pressure(
        {0.0: 0.0, BREAKAWAY: 40.0, BREAKAWAY + 0.003: 42.0, 0.15: 38.5, STOP: 40.0, 0.35: 55.0, 0.4: 55.0}
    )
    assert held(recording(pressure_1=peaked))["pressure_1_falls_in_motion"] is True


def test_a_peak_of_pressure_1_late_in_the_motion_is_no_fall_from_the_start() -> None:
    late = pressure({0.0: 0.0, BREAKAWAY: 40.0, 0.2: 48.0, STOP: 40.0, 0.35: 55.0, 0.4: 55.0})
    assert held(recording(pressure_1=late))["pressure_1_falls_in_motion"] is False


@pytest.mark.parametrize(("rise", "holds"), [(0.9, True), (1.1, False), (44.0, False)])
def test_a_fall_of_pressure_2_that_slows_may_rise_by_one_psi_and_no_more(rise: float, holds: bool) -> None:
    compressed = pressure({0.0: 55.0, BREAKAWAY: 35.0, 0.2: 35.0 + rise, STOP: 20.0, 0.3: 0.0, 0.4: 0.0})
    assert held(recording(pressure_2=compressed))["pressure_2_slows_in_motion"] is holds


def test_a_vane_that_turns_elsewhere_is_not_the_one_of_figure_7() -> None:
    angle = Channel(np.radians(drawn({0.0: 20.0, BREAKAWAY: 20.0, STOP: 100.0, 0.4: 100.0})), "rad")
    assert held(recording(angle=angle))["vane_turns_through_its_range"] is False


@pytest.mark.parametrize(
    "points",
    [{0.0: 20.0, 0.4: 20.0}, {0.0: 20.0, BREAKAWAY: 20.0, 0.4: 130.0}, {0.0: 20.0, 0.1: 130.0, 0.4: 130.0}],
    ids=["never moves", "never stops", "never rests at first"],
)
def test_without_two_rests_there_are_no_events_and_no_sentence_holds(points: dict[float, float]) -> None:
    moved = recording(angle=Channel(np.radians(drawn(points)), "rad"))
    assert step_events(moved) is None
    assert not any(held(moved).values())


def test_a_measured_recording_with_noise_needs_a_coarser_resolution() -> None:
    noise = 1e-3 * np.sin(9e3 * TIME)
    noisy = recording().with_channel("angle", recording()["angle"] + noise, "rad")
    events = step_events(noisy, resolution=0.01)
    assert events is not None
    assert TIME[list(events)] == pytest.approx((BREAKAWAY, STOP), abs=0.004)
