"""The paper's results, from the shipped scenarios: numbers within their windows, and the sequences of the text."""

import pytest

from ppafo.questions.reproduce.answer import Reproduction
from ppafo.questions.reproduce.claim import Claim, Observation
from ppafo.questions.reproduce.step_response import Levels, step_events, step_observations
from ppafo.running import simulate

SHORT_LINES = ("actuator.dead_volume_1=2 cm^3", "actuator.dead_volume_2=2 cm^3")


@pytest.fixture(scope="module")
def claims(reproduction: Reproduction) -> dict[str, Claim]:
    return {claim.id: claim for claim in reproduction.claims}


@pytest.mark.parametrize(
    ("identifier", "paper", "low", "high", "unit"),
    [
        ("torque_rms_improvement", 15.0, 12.0, 18.0, "%"),
        ("co2_solenoid", 1.1, 1.0, 1.2, "g"),
        ("co2_proportional", 0.4, 0.36, 0.44, "g"),
        ("co2_saving", 63.0, 60.0, 66.0, "%"),
    ],
)
def test_the_torque_task_meets_the_printed_numbers(
    claims: dict[str, Claim], identifier: str, paper: float, low: float, high: float, unit: str
) -> None:
    claim = claims[identifier]
    assert claim.value is not None
    assert low <= claim.value <= high
    assert (claim.paper, claim.unit, claim.verdict) == (paper, unit, "reproduced_with_assumptions")


def test_improvement_and_saving_are_what_the_recordings_say(
    reproduction: Reproduction, claims: dict[str, Claim]
) -> None:
    solenoid, proportional = reproduction.solenoid.metrics, reproduction.proportional.metrics
    improvement = 100.0 * (1.0 - proportional["rms_error"].value / solenoid["rms_error"].value)
    saving = 100.0 * (1.0 - proportional["gas_supplied"].value / solenoid["gas_supplied"].value)
    assert claims["torque_rms_improvement"].value == pytest.approx(improvement)
    assert claims["co2_saving"].value == pytest.approx(saving)


def test_the_solenoid_pair_oscillates_on_the_ramp_and_is_quiet_on_the_hold(reproduction: Reproduction) -> None:
    assert reproduction.solenoid.metrics["oscillations_ramp"].value >= 4
    assert reproduction.solenoid.metrics["oscillations_hold"].value == 0


def test_the_proportional_valve_does_not_oscillate(reproduction: Reproduction) -> None:
    assert reproduction.proportional.metrics["oscillations_ramp"].value == 0
    assert reproduction.proportional.metrics["oscillations_hold"].value == 0


def test_everything_that_the_text_tells_of_the_torque_task_shows(reproduction: Reproduction) -> None:
    assert [item.id for item in reproduction.torque_observations if not item.holds] == []


@pytest.fixture(scope="module")
def told() -> dict[str, Observation]:
    """What the step response with the fitted volumes shows, by sentence."""
    found = simulate("step-response", ["device.set=ppafo2011-fitted"])
    supply = found.scenario.device.supply
    levels = Levels(supply.pressure, supply.atmospheric_pressure)
    observations = step_observations(found.recording, levels, step_events(found.recording))
    return {item.id: item for item in observations}


@pytest.mark.parametrize(
    "sentence",
    [
        "vane_turns_through_its_range",
        "pressure_1_rises_until_breakaway",
        "pressure_1_falls_in_motion",
        "pressure_1_goes_to_supply",
        "pressure_2_falls_from_supply",
        "pressure_2_slows_in_motion",
        "pressure_2_goes_to_atmosphere",
        "difference_builds_up",
    ],
)
def test_the_step_response_goes_as_the_text_tells(told: dict[str, Observation], sentence: str) -> None:
    assert told[sentence].holds, told[sentence].evidence


def test_with_the_reported_volume_pressure_2_rises_above_its_supply_instead_of_slowing() -> None:
    found = simulate("step-response", ["actuator.volume_per_angle=51 cm^3/rad", *SHORT_LINES])
    supply = found.scenario.device.supply
    levels = Levels(supply.pressure, supply.atmospheric_pressure)
    held = {item.id: item for item in step_observations(found.recording, levels, step_events(found.recording))}
    assert not held["pressure_2_slows_in_motion"].holds
    assert levels.gauge(found.recording["pressure_2"].max()) > 70.0


def test_a_vane_without_a_leg_breaks_away_at_the_printed_static_friction() -> None:
    recording = simulate("step-response", ["motion.kind=free"]).recording
    events = step_events(recording)
    assert events is not None
    torque = recording["torque"][events.breakaway - 1 : events.breakaway + 2]
    assert torque[0] <= 0.45 <= torque[-1]


def test_the_weight_of_the_foot_helps_the_vane_to_break_away(reproduction: Reproduction) -> None:
    events = reproduction.step_events
    assert events is not None
    assert reproduction.step.recording["torque"][events.breakaway] < 0.45


@pytest.mark.parametrize(
    ("identifier", "paper", "low", "high", "unit"),
    [
        ("k_actuator", 1.451e-5, 1.44e-5, 1.46e-5, "m^3"),
        ("static_friction", 0.45, 0.445, 0.455, "N m"),
        ("leak_area", 0.3, 0.298, 0.302, "mm^2"),
        ("step_rms_position", 2.1, 0.5, 4.0, "deg"),
        ("step_rms_pressure_1", 3.7, 3.0, 4.5, "psi"),
        ("step_rms_pressure_2", 1.4, 3.0, 5.5, "psi"),
        ("step_rms_pressure_difference", 4.8, 3.0, 7.0, "psi"),
    ],
)
def test_what_a_synthetic_measurement_gives_is_shown_on_synthetic_data_and_not_reproduced(
    claims: dict[str, Claim], identifier: str, paper: float, low: float, high: float, unit: str
) -> None:
    claim = claims[identifier]
    assert claim.value is not None
    assert low <= claim.value <= high
    assert (claim.paper, claim.unit, claim.verdict) == (paper, unit, "shown_on_synthetic")
    assert claim.is_synthetic


@pytest.mark.parametrize(
    ("identifier", "paper", "value", "digits", "unit", "verdict"),
    [
        ("c1", 0.00281, 0.002812, 1e-6, "s/m", "reproduced"),
        ("c2", 0.0124, 0.012406, 1e-6, "s/m", "reproduced"),
        ("critical_pressure_ratio", 1.832, 1.8324, 5e-5, "-", "reproduced"),
        ("rotary_damping", 32.0, 3.36, 5e-3, "g m^2/s", "contradicted"),
        ("dynamic_friction", 0.011, 0.0011, 5e-5, "N m", "contradicted"),
        ("discharge_coefficient_solenoid", 0.113, 0.0949, 5e-5, "-", "contradicted"),
        ("discharge_coefficient_proportional", 0.113, 0.0378, 5e-5, "-", "contradicted"),
    ],
)
def test_the_printed_numbers_are_judged_by_their_own_arithmetic(
    claims: dict[str, Claim], identifier: str, paper: float, value: float, digits: float, unit: str, verdict: str
) -> None:
    claim = claims[identifier]
    assert claim.value == pytest.approx(value, abs=digits)
    assert (claim.paper, claim.unit, claim.verdict) == (paper, unit, verdict)


def test_the_step_response_says_what_it_shows_beyond_the_text(told: dict[str, Observation]) -> None:
    beyond = {name: item.difference for name, item in told.items() if item.difference}
    assert beyond == {"pressure_2_slows_in_motion": "it does more than slow: it rises by 0.7 psi"}
