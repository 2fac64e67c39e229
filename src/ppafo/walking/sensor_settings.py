"""What a walk states of its sensors and their faults, in SI units, and what these come to."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from ppafo.model.gait_sensors import Fault, GaitSensors
from ppafo.walking.preparation import distorting_fault, fixed_fault, gait_sensors

NEVER = 1.0e9
"""Time [s] of a fault that does not happen."""
DISTORTED, FROZEN = "distorted", "frozen"


@dataclass(frozen=True, slots=True)
class FaultSettings:
    """A kind of ``declaration.FAULT_KINDS`` and its numbers [SI]; no kind is a sensor without a fault."""

    kind: str = ""
    numbers: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SensorSettings:
    """Numbers [SI] of ``declaration.WALK_SENSORS``, and faults by the name of the sensor."""

    numbers: Mapping[str, float]
    faults: Mapping[str, FaultSettings]


def sensors_of(settings: SensorSettings, period: float) -> GaitSensors:
    """The sensors at a sample period [s] of the controller."""
    faults = {f"{sensor}_fault": fault_of(fault, period) for sensor, fault in settings.faults.items()}
    return gait_sensors(settings.numbers, period, **faults)


def fault_of(fault: FaultSettings, period: float) -> Fault:
    """A fault at a sample period [s] of the controller."""
    given = fault.numbers
    if not fault.kind:
        return fixed_fault(NEVER, 0.0, 0.0, 0.0)
    if fault.kind != DISTORTED:
        holds = 1.0 if fault.kind == FROZEN else 0.0
        return fixed_fault(given["time"], holds, given.get("reading", 0.0), given["period"])
    return distorting_fault(
        given["time"],
        given["period"],
        given["gain"],
        given["offset"],
        given["drift"],
        given.get("crosstalk", 0.0),
        given["lag"],
        given["lost_share"],
        given["delay"],
        period,
    )
