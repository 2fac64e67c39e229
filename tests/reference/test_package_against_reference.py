"""The package held against the independent simulator on some hundred random devices.

Thousands are compared by scripts/compare_with_reference.py.

Every family must hold: what is determined is within 2e-4 of the angle range and 1e-3 of the pressure range away from
impacts. ``mixed`` needs a program for nearly every draw, so only the command runs it.
"""

import dataclasses

import pytest

from ppafo.simulation.loading import load_scenario, scenario_from_dict
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from tests.reference.comparison import away_from_impacts, columns, differences, verdict
from tests.reference.draws import FAMILIES, draw
from tests.reference.reference_solver import chamber_pressures_of, solve_reference
from tests.reference.simulator import independent_run

SEED = 1
DRAWS = range(3)
"""Numbers of the draws that are compared."""
COSTLY = {"dead volumes": range(2), "loops without friction": range(2)}
"""Those of families whose reference takes many seconds for each."""


@pytest.mark.parametrize("family", [name for name in FAMILIES if name != "mixed"])
def test_determined_draws_are_within_the_limits(family: str) -> None:
    draws = COSTLY.get(family, DRAWS)
    verdicts = {number: verdict(scenario_from_dict(draw(family, SEED, number))) for number in draws}
    assert 2 * sum(case.is_determined for case in verdicts.values()) >= len(draws), "the family must say something"
    assert {number: case for number, case in verdicts.items() if case.is_wrong} == {}


@pytest.mark.parametrize(
    "flaw", ["valve.area=31.63 mm^2", "foot_plate.inertia=8.43 g m^2", "actuator.displacement_per_radian=51.1 cm^3/rad"]
)
def test_the_reference_would_see_a_device_that_is_wrong_by_two_in_a_thousand(
    flaw: str, step_response: Scenario
) -> None:
    answer = independent_run(step_response)
    other = independent_run(load_scenario("step-response", (flaw,)))
    keep = away_from_impacts(answer.time, answer.impacts, other.impacts)
    assert max(differences(step_response, answer, columns(other), keep)) > 1.0
    assert max(differences(step_response, answer, columns(independent_run(step_response, 1e-11)), keep)) < 1e-3


def reference_gap(scenario: Scenario) -> float:
    """Largest difference between reference solver and independent run away from impacts, over the limits."""
    run = plan_run(scenario)
    answer = independent_run(scenario)
    reference = solve_reference(run)
    keep = away_from_impacts(answer.time, answer.impacts, reference.impacts)
    seen = (reference.states[:, 0], *chamber_pressures_of(run, reference.states))
    return max(differences(scenario, answer, seen, keep))


@pytest.mark.parametrize(
    "family",
    [
        "gases",
        "slow valves",
        "thermal rebounds",
        "late coarse sensors",
        "solenoid loops",
        "prescribed",
        "legs",
        "legs in a gait",
    ],
)
def test_independent_run_and_reference_solver_agree(family: str) -> None:
    assert {n: gap for n in range(2) if (gap := reference_gap(scenario_from_dict(draw(family, SEED, n)))) > 1e-2} == {}


@pytest.mark.parametrize(("angle", "speed"), [("20 deg", "-100 deg/s"), ("130 deg", "100 deg/s")])
@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_vane_thrown_at_the_stop_it_starts_on_rebounds_at_once(angle: str, speed: str, restitution: float) -> None:
    lines = (f"motion.angle={angle}", f"motion.angular_velocity={speed}", f"actuator.restitution={restitution}")
    scenario = load_scenario("step-response", (*lines, "initial.pressure_1=supply", "run.duration=0.1 s"))
    assert verdict(scenario).worst <= 1.0
    assert reference_gap(scenario) <= 1e-2


def test_a_supply_that_does_not_relieve_lets_gas_in_only(step_response: Scenario) -> None:
    high = dataclasses.replace(step_response, initial=dataclasses.replace(step_response.initial, pressure_1=900_000.0))
    assert independent_run(high, relieving=False).drawn[5] == 0.0
    assert independent_run(high, relieving=True).drawn[5] < 0.0
