"""What configurations are compared by, and which end of it is better."""

from ppafo.metrics import METRICS
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import OPEN_LOOP

COMPARED: dict[str, int] = {
    "rms_error": -1,
    "rms_error_ramp": -1,
    "rms_error_hold": -1,
    "peak_error": -1,
    "gas_supplied": -1,
    "mechanical_work": 0,
    "gas_per_work": -1,
    "switchings": -1,
}
"""Metrics of the table: -1 where less is better, 1 where more is, 0 where neither is better as such."""


def compared_metrics(scenarios: list[Scenario]) -> tuple[str, ...]:
    """Return those metrics of the table that all scenarios can have: without a reference there is no error."""
    has_reference = all(scenario.control.kind != OPEN_LOOP for scenario in scenarios)
    return tuple(name for name in COMPARED if has_reference or "reference" not in METRICS[name].channels)
