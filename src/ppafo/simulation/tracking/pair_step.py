"""Step of a pair of on/off valves: the change during its dead time, known before a run."""

import logging
from collections.abc import Iterable

from ppafo.control.kind import ControllerKind
from ppafo.model.controlled import ANGLE, CONTROLLED
from ppafo.simulation.default_gains import DEAD_TIME, RATE
from ppafo.simulation.gains import terms_of
from ppafo.simulation.numbers import number_at
from ppafo.simulation.profiles import profile_bounds
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.tracking.remedies import change_text, smaller_pair
from ppafo.simulation.tracking.rule import is_pair, smallest_change, torque_limit
from ppafo.units.shown import in_units

logger = logging.getLogger("ppafo")

_LARGEST_STEP = 0.25
"""Step of a pair divided by the wanted change, above which a warning is logged [-]."""


def pair_step(scenario: Scenario, law: ControllerKind) -> tuple[float, float]:
    """Step R theta of a pair [SI unit of the controlled quantity], and its dead time theta [s]."""
    terms = terms_of(scenario, law)
    rate, dead_time = (float(terms[name].number(lambda path: number_at(scenario, path))) for name in (RATE, DEAD_TIME))
    return rate * dead_time, dead_time


def warn_of_coarse_pairs(scenarios: Iterable[Scenario]) -> None:
    """Log a warning for each scenario with a too coarse pair of valves, before the runs; equal warnings once."""
    for text in dict.fromkeys(map(coarse_pair, scenarios)):
        if text:
            logger.warning("ppafo: %s", text)


@in_units(lambda scenario: scenario.device.shown)
def coarse_pair(scenario: Scenario) -> str:
    """Warning for a pair whose step exceeds a quarter of the wanted change of torque or pressure; "" without one.

    In a walk the wanted change is the largest torque of its controller. Angle loops are not checked, because their step
    depends on the joint as much as on the pair.
    """
    law, controlled = scenario.law, CONTROLLED[scenario.controlled]
    if law is None or not is_pair(scenario) or controlled.name == ANGLE:
        return ""
    if scenario.follows_reference:
        initial = scenario.initial
        start = float(controlled.value(0.0, initial.pressure_1, initial.pressure_2, 0.0))
        extent = max(abs(float(bound) - start) for bound in profile_bounds(scenario.reference))
        wanted = max(extent, smallest_change(scenario))
    else:
        wanted = torque_limit(scenario.controller.settings)
    if wanted == 0.0:
        return ""
    step, dead_time = pair_step(scenario, law)
    ratio = step / wanted
    if ratio <= _LARGEST_STEP:
        return ""
    step_text, wanted_text = change_text(controlled.name, step), change_text(controlled.name, wanted)
    smaller = smaller_pair(scenario, ratio)[0].text
    return (
        f"{scenario.name}: the pair of valves changes the {controlled.words} by {step_text} in its dead time of "
        f"{1.0e3 * dead_time:.3g} ms, {ratio:.2g} times the {wanted_text} wanted: {smaller}, faster valves or larger "
        "chambers make that step smaller"
    )
