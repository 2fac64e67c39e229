"""Numbers of one run by group, as seen by the functions of a step, and the present step of all runs."""

from functools import reduce
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:  # a lane is of these, and makes none of them
    from ppafo.engine.scheme.motion import FreePart, PartEnd, PartSlide, PrescribedStep, StepControl
    from ppafo.engine.scheme.pneumatics import GasFlows, HeldChambers, SlopedFlows
    from ppafo.engine.scheme.walking import CarriedFoot, DeviceShare, WalkEnd, WalkState, WalkStep
    from ppafo.model.gait import GaitMeasured, GaitNow, GaitPlace, GaitSeries, GaitTiming
    from ppafo.model.leg import FootLoad, LegParameters
    from ppafo.model.plant import PlantState, ThermalParameters
    from ppafo.model.regulator import LineState, LineStep, SupplyLines
    from ppafo.model.sensors import GaitSeen, GaitSensors, SensorParameters
    from ppafo.signals.meter import ReferenceSummary, Sample


SAME_MOMENT = 1.0e-9
"""Difference of two instants, as a fraction of a step [-], below which both count as simultaneous."""
MAXIMUM_PARTS = 100_000
"""Largest number of parts of one step (minutes without progress); a run that needs more has failed."""


class LaneTiming(NamedTuple):
    """Time grid of a run."""

    step: float
    """Longest step [s]."""
    period: float
    """Time [s] between two samples of the controller."""
    command_lag: float
    """Delay of commands beyond whole steps, as a fraction of a step [-]."""
    signal_lag: float
    """Delay of signals beyond whole steps, as a fraction of a step [-]."""
    tolerance: float
    """Allowed error of a step divided by the default allowed error [-]."""


class LaneResult(NamedTuple):
    """Present command, and time and cause of a failure of the run."""

    command: float
    """Present command [-]."""
    failure_time: float
    """First time [s] at which the state became physically impossible; a huge number if the run has not failed."""
    too_many_parts: float
    """1 if the run failed because a step needed more than ``MAXIMUM_PARTS`` parts, else 0."""


class Now(NamedTuple):
    """Present step of all runs: step number, controller sample, and end of the present part of the step.

    The other fields are indices into ring buffers of delayed values, computed once for all runs; 0 without delays.
    """

    step: int
    """Number of the step, from 0 at the start of the run."""
    sample: int
    """Number of the controller's last sample."""
    goal: float
    """End of the present interval as a fraction of the step [-]; less than 1 if a sample lies inside the step."""
    early_command: int
    """Ring-buffer index of the command that acts at the start of this step."""
    late_command: int
    """Ring-buffer index of the command that arrives in this step."""
    late_signal: int
    """Ring-buffer index of the delayed signals shown by the sensors now."""
    next_signal: int
    """Ring-buffer index for the signals at the end of the step."""


class Lane:
    """Numbers of one run by group: ``lane.state``, or ``lane["state"]`` if the name depends on the parts.

    ``Program`` determines the available groups. Groups of effects and meters have the names of the effects and meters.
    For a group of type ``Any``, the component that owns the group defines its class. Units are documented in the
    classes.
    """

    # Parameters, which a run does not change.
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
    lines: "SupplyLines"
    load: "FootLoad"  # of a foot on a prescribed shank
    shank: Any  # of the profile of that shank

    # Where it stands: states.
    result: LaneResult
    pace: "StepControl"  # the length that the error of the last part allows the next one
    state: "PlantState"
    masses: Any  # true masses, of gas that is not isothermal
    valve_state: Any
    controller_state: Any
    walk: "WalkState"
    gait_seen: "GaitSeen"  # last readings of a walk
    line_state: "LineState"
    course: "ReferenceSummary"  # of the reference over the whole run, for meters
    signal_history: NDArray[np.float64]  # rings of what comes late, and the traced samples
    command_history: NDArray[np.float64]
    trace: NDArray[np.float64]

    # Values that a step hands to the next one, and a phase to later ones.
    held: "HeldChambers"  # chambers as the step begins
    carried: "CarriedFoot"  # torques of leg and device on the foot as the step begins
    place: "GaitPlace"  # where the gait is at the end of the step,
    measured: "GaitMeasured"  # what was measured there,
    next_gait: "GaitNow"  # and the gait there
    begun: "FreePart"  # first stage of an unconstrained vane
    prescribed: "PrescribedStep"  # motion at the end of a prescribed step
    walk_begun: "WalkStep"  # first stage of a walking leg
    shown: Any  # what the valve shows beside its openings
    next_valve: Any  # state of the valve at the end of a part
    flowing: "SlopedFlows"  # flows as the step begins, with their derivatives
    gas_stage: Any  # first stage of the gas, by its kind
    line_stage: "LineStep"  # lines after the first stage
    passing: "GasFlows"  # flows at the pressures to which the first stage leads
    change: Any  # what the step adds to the gas, by its kind
    next_lines: "LineState"  # lines at the end of a part
    gas_error: float  # of the pressures over what is allowed
    slid: "PartSlide"  # an unconstrained vane at the end of a part without an event,
    moved: "PartEnd"  # and where it truly ends
    ahead: "HeldChambers"  # chambers at the angle to which a walk is assumed to lead
    ended: "WalkEnd"  # second stage of a walking leg
    length: float  # of a part of the step [s]
    before: float  # what of the step was before the part [s]
    remaining: float  # what is left of the step from the part's begin on [s]

    # Values inside one phase.
    second: Any  # second stage of the gas, by its kind
    fed: "PlantState"  # the state with the gas of the step, but the vane as it was
    warmed: Any  # true masses with the gas of the step
    after: "PlantState"  # state and walk after the step
    walk_after: "WalkState"
    seen: Any  # what the controller is shown
    sample: "Sample"  # what meters and traces are shown

    def __getitem__(self, name: str) -> Any:
        """Return a group, or a number of a group by its path such as ``state.angle``."""
        return reduce(getattr, name.split("."), self)

    def __setitem__(self, name: str, value: Any) -> None:
        """Set a group."""
        setattr(self, name, value)
