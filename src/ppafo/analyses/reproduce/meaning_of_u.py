"""Interpretations of U in equation (13), the command of the proportional valve, and their effect on the task."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from ppafo.analyses.reproduce.decision_phases import with_reference
from ppafo.metrics import Metric
from ppafo.simulation.simulate import Result, simulate

READINGS_OF_U = (("the opening, -1 to 1", 1.0), ("volts, 5 open the valve", 5.0), ("volts, 10 open the valve", 10.0))
"""Interpretations of U of equation (13), each with the U that opens the proportional valve fully."""
WITHIN_REACH = 4.0
"""Reference level [N m] within the reach of the supply."""
_GAINS = ("proportional_gain", "integral_gain", "derivative_gain")


@dataclass(frozen=True, slots=True)
class InterpretationOfU:
    """Interpretation of U, with the advantage of the proportional valve over the solenoid pair.

    ``error``, ``gas``: reduction of RMS error and of gas [%]
    ``error_within_reach``: reduction of RMS error [%] with a reference level within the reach of the supply
    """

    name: str
    error: float
    gas: float
    error_within_reach: float


def readings_of_u(solenoid: Result, proportional: Result) -> tuple[InterpretationOfU, ...]:
    """Return the comparison of the valves for each interpretation of U.

    The result is empty if another control law or reference is used.
    """
    pair, spool = solenoid.scenario, proportional.scenario
    if spool.controller.kind != "pid" or {pair.reference.kind, spool.reference.kind} != {"ramp_hold"}:
        return ()
    against, against_within_reach = (simulate(run).metrics for run in (pair, with_reference(pair, level=WITHIN_REACH)))
    readings = []
    for name, full in READINGS_OF_U:
        # Volts times a gain for volts give the same opening.
        gains = {gain: spool.controller.settings[gain] / full for gain in _GAINS}
        read = replace(spool, controller=replace(spool.controller, settings={**spool.controller.settings, **gains}))
        metrics, within_reach = (simulate(run).metrics for run in (read, with_reference(read, level=WITHIN_REACH)))
        readings.append(
            InterpretationOfU(
                name,
                error=_less(metrics, against, "rms_error"),
                gas=_less(metrics, against, "gas_supplied"),
                error_within_reach=_less(within_reach, against_within_reach, "rms_error"),
            )
        )
    return tuple(readings)


def _less(metrics: Mapping[str, Metric], against: Mapping[str, Metric], name: str) -> float:
    """Return the reduction of a metric relative to another run [%]."""
    return 100.0 * (1.0 - metrics[name].value / against[name].value)
