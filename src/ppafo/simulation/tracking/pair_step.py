"""Step of a pair of on/off valves: the change during its dead time, known before a run."""

import logging
from collections.abc import Iterable

from ppafo.control.kind import ControllerKind
from ppafo.model.controlled import ANGLE, CONTROLLED, TORQUE
from ppafo.simulation.gains import terms_of
from ppafo.simulation.numbers import number_at
from ppafo.simulation.profiles import profile_bounds
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.torque_loop import DEAD_TIME, RATE
from ppafo.simulation.tracking.remedies import change_text, smaller_pair
from ppafo.simulation.tracking.rule import smallest_change, torque_limit
from ppafo.units.shown import in_units

logger = logging.getLogger("ppafo")

_LARGEST_STEP = 0.25
"""Step of a pair divided by the wanted change, above which a warning is logged [-]."""


def pair_step(scenario: Scenario, law: ControllerKind) -> tuple[float, float]:
    """Step R theta of a pair [SI unit of the controlled quantity], and its dead time theta [s]."""
    terms = terms_of(scenario, law)
    rate, late = (float(terms[name].number(lambda path: number_at(scenario, path))) for name in (RATE, DEAD_TIME))
    return rate * late, late


def tell_coarse_pairs(scenarios: Iterable[Scenario]) -> None:
    """Log a warning for each scenario with a too coarse pair of valves, before the runs; equal warnings once."""
    for text in dict.fromkeys(map(coarse_pair, scenarios)):
        if text:
            logger.warning("ppafo: %s", text)


def _wanted(scenario: Scenario) -> float:
    """Largest wanted change of a torque or a pressure, in SI."""
    kind, start = CONTROLLED[scenario.controlled], 0.0
    if kind.name != TORQUE:
        start = float(kind.value(0.0, scenario.initial.pressure_1, scenario.initial.pressure_2, 0.0))
    extent = max(abs(float(bound) - start) for bound in profile_bounds(scenario.reference))
    return max(extent, smallest_change(scenario))


@in_units(lambda scenario: scenario.device.shown)
def coarse_pair(scenario: Scenario) -> str:
    """Warning for a pair whose step exceeds a quarter of the wanted change of torque or pressure; "" without one.

    In a walk the wanted change is the largest torque of its controller. Angle loops are not checked, because their step
    depends on the joint as much as on the pair.
    """
    law, kind = scenario.law, CONTROLLED[scenario.controlled]
    limit = 0.0 if scenario.follows_reference else torque_limit(scenario.controller.settings)
    is_asked = scenario.follows_reference or limit > 0.0
    if law is None or not is_asked or kind.name == ANGLE or "switching_interval" not in scenario.device.valve.settings:
        return ""
    wanted = limit or _wanted(scenario)
    step, late = pair_step(scenario, law)
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
