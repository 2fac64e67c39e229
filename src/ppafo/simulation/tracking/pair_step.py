"""Step of a pair of on/off valves: the change during its dead time, which is known before a run."""

from ppafo.control.kind import ControllerKind
from ppafo.model.controlled import ANGLE, CONTROLLED, TORQUE
from ppafo.simulation.gains import terms_of
from ppafo.simulation.numbers import number_at
from ppafo.simulation.profiles import profile_bounds
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.torque_loop import DEAD_TIME, RATE
from ppafo.simulation.tracking.remedies import change_text, smaller_pair
from ppafo.simulation.tracking.rule import smallest_change
from ppafo.units.shown import in_units

_LARGEST_STEP = 0.25
"""Step of a pair over the wanted change above which it is told before a run [-]."""


def pair_step(scenario: Scenario, law: ControllerKind) -> tuple[float, float]:
    """Step R theta of a pair [SI of what its loop controls], and its dead time theta [s]."""
    terms = terms_of(scenario, law)
    rate, late = (float(terms[name].number(lambda path: number_at(scenario, path))) for name in (RATE, DEAD_TIME))
    return rate * late, late


@in_units(lambda scenario: scenario.device.shown)
def coarse_pair(scenario: Scenario) -> str:
    """Warning of a pair whose step exceeds a quarter of the wanted change of a torque or a pressure; "" without one.

    A walk has no reference before its run, and of an angle the step is the joint's as much as the pair's: neither is
    looked at.
    """
    law, kind = scenario.law, CONTROLLED[scenario.controlled]
    is_pair = "switching_interval" in scenario.device.valve.settings
    if law is None or not is_pair or not scenario.follows_reference or kind.name == ANGLE:
        return ""
    start = 0.0
    if kind.name != TORQUE:
        start = float(kind.value(0.0, scenario.initial.pressure_1, scenario.initial.pressure_2, 0.0))
    extent = max(abs(float(bound) - start) for bound in profile_bounds(scenario.reference))
    step, late = pair_step(scenario, law)
    wanted = max(extent, smallest_change(scenario))
    share = step / wanted
    if share <= _LARGEST_STEP:
        return ""
    changed, whole = change_text(kind.name, step), change_text(kind.name, wanted)
    smaller = smaller_pair(scenario, share)[0].text
    return (
        f"{scenario.name}: the pair of valves changes the {kind.words} by {changed} in the {1.0e3 * late:.3g} ms that "
        f"it is late, {share:.2g} times the {whole} wanted: {smaller}, faster valves or larger chambers make that step "
        "smaller"
    )
