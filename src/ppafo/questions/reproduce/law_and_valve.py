"""What of the torque task is the law's and what the valve's: what the paper says of its control, by other laws.

Each other law plays the same task on the same device, as it does in ``ppafo league``.
"""

from ppafo.errors import ParameterError, ScenarioError, SimulationError
from ppafo.parameters.publications.publication import paper_entries
from ppafo.questions.league.sampled_bound import best_decisions, sampled_problem
from ppafo.questions.league.standing import ENTRANTS
from ppafo.questions.reproduce.claim import Claim, Verdict, stated_claim
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.simulate import Result, simulate

TUNED, DEAD_ZONE = "pid-tuned", "on_off_dead_zone-solenoid"
FASTER = ("controller.rate=100 Hz", "valve.switching_interval=10 ms")
"""Both: the set has the printed 20 Hz of the component as the shortest time between two switchings."""
_BY_NAME = {entrant.name: entrant for entrant in ENTRANTS}
_PERCENT = 100.0


def control_claims(solenoid: Result, proportional: Result) -> list[Claim]:
    """Return what the paper says of gains, dead zone, switching rate and improved control, and of size and weight."""
    pair, spool = (run.metrics["rms_error"].value for run in (solenoid, proportional))
    found = [
        _compared("gains_minimise_error", spool, _with(proportional, _BY_NAME[TUNED].overrides), -1.0),
        _compared("dead_zone_amplifies_delay", pair, _with(solenoid, _BY_NAME[DEAD_ZONE].overrides), 1.0),
        _compared("limited_by_switching", pair, _with(solenoid, FASTER), -1.0),
    ]
    problem = sampled_problem(solenoid.scenario)
    best = problem or best_decisions(solenoid.scenario)[0]
    heavy = paper_entries()["large_and_heavy"]
    return [
        *found,
        _compared("beyond_improved_control", spool, best, 1.0),
        stated_claim(heavy.id, None, "not_testable", heavy.not_testable),
    ]


def _with(run: Result, overrides: tuple[str, ...]) -> float | str:
    """Return the RMS error [N m] of a run's task with another law, or why there is none."""
    origin = run.scenario.origin
    try:
        own = [override for override in origin.overrides if not override.startswith("controller.")]
        return simulate(load_scenario(run.scenario.name, [*own, *overrides])).metrics["rms_error"].value
    except (ParameterError, ScenarioError, SimulationError) as error:
        return str(error)


def _compared(identifier: str, error: float, other: float | str, sign: float) -> Claim:
    """Return the claim on by how much, in percent, another law's error is more (sign 1) or less (-1) than an error."""
    entry = paper_entries()[identifier]
    if isinstance(other, str):
        return stated_claim(identifier, None, "not_testable", f"{entry.note} {other}.")
    value = sign * _PERCENT * (other / error - 1.0)
    holds = (entry.at_least is None or value > entry.at_least) and (entry.at_most is None or value <= entry.at_most)
    verdict: Verdict = "reproduced_with_assumptions" if holds else "contradicted"
    note = f"{entry.note} Simulated: {other:.3f} against {error:.3f} N m."
    return stated_claim(identifier, value, verdict, note, ("the torque task as completed here",))
