"""The numbers of one run, by group, and the step that all runs are at."""

from functools import reduce
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:  # rows of what few devices have
    from ppafo.engine.scheme.motion import FreePart, Pace, PartEnd, PartSlide, PrescribedStep
    from ppafo.engine.scheme.pneumatics import (
        Flows,
        GasChange,
        HeldChambers,
        MovingGas,
        SlopedFlows,
        StageFlows,
        StillGas,
    )
    from ppafo.engine.scheme.real_gas import RealChange, RealGas
    from ppafo.engine.scheme.supply_lines import FedGas, FedThermalGas
    from ppafo.engine.scheme.thermal_gas import ThermalFlows, ThermalGas
    from ppafo.engine.scheme.walking import CarriedFoot, DeviceShare, WalkEnd, WalkState, WalkStep
    from ppafo.model.gait import GaitMeasured, GaitNow, GaitPlace, GaitSeries, GaitTiming, Marks, TimedSequence
    from ppafo.model.leg import FootLoad, LegParameters
    from ppafo.model.plant import PlantState, ThermalParameters
    from ppafo.model.plant_faults import PlantFaults
    from ppafo.model.regulator import LineState, SupplyLines
    from ppafo.model.sensors import GaitSeen, GaitSensors, SensorParameters
    from ppafo.model.shut_off import ShutOff, Unpowered
    from ppafo.signals.meter import Course, Sample


SAME_MOMENT = 1.0e-9
"""Fractions of a step that are taken to be one instant."""
MAXIMUM_PARTS = 100_000
"""Most parts of one step, minutes without progress: a run that needs more has failed."""


class LaneTiming(NamedTuple):
    """Longest step and sample period [s]; shares of a step by which commands and signals are late beyond whole steps.

    ``tolerance`` is the error over the one that a run is allowed by default [-].
    """

    step: float
    period: float
    command_lag: float
    signal_lag: float
    tolerance: float


class LaneResult(NamedTuple):
    """Command in force [-], first time [s] at which a run left what is possible (huge where it did not).

    ``too_many_parts`` is 1 where it failed because a step was cut into more parts than are made of one.
    """

    command: float
    failure_time: float
    too_many_parts: float


class LaneStart(NamedTuple):
    """Step of the block at which the run of a lane began, a whole number [-]."""

    step: float


class NoParameters(NamedTuple):
    """Stands where a program has no such component."""


class Now(NamedTuple):
    """The step of all lanes: its number, the controller's sample, and the share of it that is to be done.

    The rest are places in rings of what comes late, which the loop works out once for all lanes: the commands that the
    valve has before and after one arrives, signals that sensors show and take, and readings of a walk with the length
    of their ring.
    """

    step: int
    sample: int
    goal: float
    early_command: int
    late_command: int
    late_signal: int
    next_signal: int
    reading: int
    readings: int


class Lane:
    """The numbers of one run by group: ``lane.state``, or ``lane["state"]`` where the name depends on the parts.

    Which groups there are is for ``Program`` to say. Groups of effects and meters have the names of these. Where a
    group is ``Any``, the component that it belongs to has its class.
    """

    # What a run is made of, and does not change.
    timing: LaneTiming
    plant: Any
    thermal: "ThermalParameters"
    valve: Any
    controller: Any
    reference: Any
    path: Any
    sensors: "SensorParameters"
    leg: "LegParameters"
    share: "DeviceShare"
    gait: "GaitSeries"
    gait_timing: "GaitTiming"
    gait_sensors: "GaitSensors"
    task_sequence: "TimedSequence"
    plant_faults: "PlantFaults"
    shut_off: "ShutOff"
    lines: "SupplyLines"
    load: "FootLoad"
    shank: Any

    # Where it stands.
    result: LaneResult
    pace: "Pace"
    state: "PlantState"
    masses: Any
    valve_state: Any
    controller_state: Any
    walk: "WalkState"
    gait_seen: "GaitSeen"
    unpowered: "Unpowered"
    line_state: "LineState"
    course: "Course"
    start: LaneStart
    signal_history: NDArray[np.float64]
    command_history: NDArray[np.float64]
    trace: NDArray[np.float64]

    # What a step hands to the next one, and its phases to later ones.
    held: "HeldChambers"
    carried: "CarriedFoot"
    place: "GaitPlace"
    measured: "GaitMeasured"
    next_gait: "GaitNow"
    marks: "Marks"
    begun: "FreePart"
    prescribed: "PrescribedStep"
    walk_begun: "WalkStep"
    shown: Any
    next_valve: Any
    flowing: "SlopedFlows"
    still_gas: "StillGas"
    moving_gas: "MovingGas"
    thermal_gas: "ThermalGas"
    real_gas: "RealGas"
    fed_gas: "FedGas"
    fed_thermal_gas: "FedThermalGas"
    passing: "StageFlows"
    change: "GasChange"
    thermal_change: "ThermalFlows"
    real_change: "RealChange"
    next_lines: "LineState"
    gas_error: float
    slid: "PartSlide"
    moved: "PartEnd"
    ahead: "HeldChambers"
    ended: "WalkEnd"
    # Length of a part of the step, what of the step was before it, and what is left from its begin on [s].
    length: float
    before: float
    remaining: float

    # What lives inside one phase.
    second: "Flows"
    thermal_second: "ThermalFlows"
    fed: "PlantState"
    warmed: Any
    after: "PlantState"
    walk_after: "WalkState"
    seen: Any
    sample: "Sample"

    def __getitem__(self, name: str) -> Any:
        """A group, or a number of one by its path such as ``state.angle``."""
        return reduce(getattr, name.split("."), self)

    def __setitem__(self, name: str, value: Any) -> None:
        """Set a group."""
        setattr(self, name, value)
