"""The numbers of one run by group, as the functions of the step see them, and the step that all runs are at."""

from functools import reduce
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:  # a lane is of these, and makes none of them
    from ppafo.engine.scheme.motion import FreePart, PartEnd, PartSlide, PrescribedStep, StepControl
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
    from ppafo.signals.meter import ReferenceSummary, Sample


SAME_MOMENT = 1.0e-9
"""Fractions of a step that are taken to be one instant."""
MAXIMUM_PARTS = 100_000
"""Most parts of one step, minutes without progress: a run that needs more has failed."""


class LaneTiming(NamedTuple):
    """The grid of a run in time."""

    step: float
    """Longest step [s]."""
    period: float
    """Time [s] between two samples of the controller."""
    command_lag: float
    """Share of a step [-] by which commands are late beyond whole steps."""
    signal_lag: float
    """Share of a step [-] by which signals are late beyond whole steps."""
    tolerance: float
    """Error that a step may have, over the one that a run is allowed by default [-]."""


class LaneResult(NamedTuple):
    """The command in force, and whether and why the run has failed."""

    command: float
    """Command in force [-]."""
    failure_time: float
    """First time [s] at which the run left what is possible; huge where it did not."""
    too_many_parts: float
    """1 where it failed because a step was cut into more than ``MAXIMUM_PARTS`` parts, else 0."""


class LaneStart(NamedTuple):
    """Step of the block at which the run of a lane began, a whole number [-]."""

    step: float


class NoParameters(NamedTuple):
    """Stands where a program has no such component."""


class Now(NamedTuple):
    """The step of all lanes: its number, the controller's sample, and the share of it that is to be done.

    The rest are places in rings of what comes late, which the loop works out once for all lanes; 0 where nothing does.
    """

    step: int
    """Number of the step, from 0 at the start of the run."""
    sample: int
    """Number of the controller's last sample."""
    goal: float
    """Share of the step [-] up to which it is to be done: less than 1 where a sample lies inside it."""
    early_command: int
    """Place of the command that the valve has before one arrives in this step."""
    late_command: int
    """Place of the command that the valve has after it."""
    late_signal: int
    """Place of the signals that sensors show now."""
    next_signal: int
    """Place of the signals that sensors take at the end of the step."""
    reading: int
    """Place of the readings of a walk that are taken at this sample."""
    readings: int
    """Length of their ring."""


class Lane:
    """The numbers of one run by group: ``lane.state``, or ``lane["state"]`` where the name depends on the parts.

    Which groups there are is for ``Program`` to say. Groups of effects and meters have the names of these. Where a
    group is ``Any``, the component that it belongs to has its class. Units stand with the classes.
    """

    # What a run is made of, and does not change: parameters.
    timing: LaneTiming
    plant: Any  # of the actuator: at least the fields of ``PlantParameters``
    thermal: "ThermalParameters"
    valve: Any
    controller: Any
    reference: Any  # of the profile that the controller follows
    path: Any  # of the profile that prescribes the angle
    sensors: "SensorParameters"
    leg: "LegParameters"
    share: "DeviceShare"  # what foot plate and vane add to the leg
    gait: "GaitSeries"
    gait_timing: "GaitTiming"
    gait_sensors: "GaitSensors"
    task_sequence: "TimedSequence"
    plant_faults: "PlantFaults"
    shut_off: "ShutOff"
    lines: "SupplyLines"
    load: "FootLoad"  # of a foot on a prescribed shank
    shank: Any  # of the profile of that shank

    # Where it stands: states.
    result: LaneResult
    pace: "StepControl"  # the length that the error of the last part allows the next one
    state: "PlantState"
    masses: Any  # true masses, of gas that is not isothermal and ideal
    valve_state: Any
    controller_state: Any
    walk: "WalkState"
    gait_seen: "GaitSeen"  # last readings of a walk
    unpowered: "Unpowered"
    line_state: "LineState"
    course: "ReferenceSummary"  # of the reference over the whole run, for meters
    start: LaneStart
    signal_history: NDArray[np.float64]  # rings of what comes late, and the traced samples
    command_history: NDArray[np.float64]
    trace: NDArray[np.float64]

    # What a step hands to the next one, and its phases to later ones.
    held: "HeldChambers"  # chambers as the step begins
    carried: "CarriedFoot"  # torques of leg and device on the foot as the step begins
    place: "GaitPlace"  # where the gait is at the end of the step,
    measured: "GaitMeasured"  # what was measured there,
    next_gait: "GaitNow"  # the gait there,
    marks: "Marks"  # and what marks a stride of a task sequence there
    begun: "FreePart"  # first stage of an unconstrained vane
    prescribed: "PrescribedStep"  # motion at the end of a prescribed step
    walk_begun: "WalkStep"  # first stage of a walking leg
    shown: Any  # what the valve shows beside its openings
    next_valve: Any  # state of the valve at the end of a part
    flowing: "SlopedFlows"  # flows as the step begins, with their derivatives
    still_gas: "StillGas"  # first stage of the gas, by its kind: fixed volumes,
    moving_gas: "MovingGas"  # moving volumes,
    thermal_gas: "ThermalGas"  # energy balance,
    real_gas: "RealGas"  # real gas,
    fed_gas: "FedGas"  # behind supply lines,
    fed_thermal_gas: "FedThermalGas"  # behind them with an energy balance
    passing: "StageFlows"  # flows at the pressures to which the first stage leads
    change: "GasChange"  # what the step adds to the gas, by its kind
    thermal_change: "ThermalFlows"
    real_change: "RealChange"
    next_lines: "LineState"  # lines at the end of a part
    gas_error: float  # of the pressures over what is allowed
    slid: "PartSlide"  # an unconstrained vane at the end of a part without an event,
    moved: "PartEnd"  # and where it truly ends
    ahead: "HeldChambers"  # chambers at the angle to which a walk is assumed to lead
    ended: "WalkEnd"  # second stage of a walking leg
    length: float  # of a part of the step [s]
    before: float  # what of the step was before the part [s]
    remaining: float  # what is left of the step from the part's begin on [s]

    # What lives inside one phase.
    second: "Flows"  # second stage of the gas
    thermal_second: "ThermalFlows"
    fed: "PlantState"  # the state with the gas of the step, but the vane as it was
    warmed: Any  # true masses with the gas of the step
    after: "PlantState"  # state and walk after the step
    walk_after: "WalkState"
    seen: Any  # what the controller is shown
    sample: "Sample"  # what meters and traces are shown

    def __getitem__(self, name: str) -> Any:
        """A group, or a number of one by its path such as ``state.angle``."""
        return reduce(getattr, name.split("."), self)

    def __setitem__(self, name: str, value: Any) -> None:
        """Set a group."""
        setattr(self, name, value)
