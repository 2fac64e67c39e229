"""Event-based control of a pair of solenoid valves: one valve configuration for each phase of the gait.

Landing: dorsiflexion, which lowers the foot. Swing: dorsiflexion keeps the lifted foot at an angle within a band.
Mid-stance: both chambers vented, free motion. Push-off: plantarflexion, vented again before the toes leave the ground,
so that its gas does not hold the foot down in the swing. The functional tasks of figure 1A of the paper.
"""

from typing import Annotated, NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.control.torque_loop import whole_reach
from ppafo.control.walking import phases
from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.model.declaration import EmptyRow, Number, quantities_of
from ppafo.model.helping import LANDING, PUSH_OFF
from ppafo.model.sensors import GaitMeasurement
from ppafo.model.valves.kind import VENT


class _EventOnOffParameters(NamedTuple):
    """Angle of the lifted foot and band about it [rad], end of push-off [turns], largest torque [N m], phase rules."""

    swing_angle: Annotated[float, Number("rad", "ankle angle to which the foot is lifted in swing", 1.68, 0.5, 2.5)]
    band: Annotated[
        float,
        Number(
            "rad",
            "half width of the angle band: lifting starts above swing_angle + band, ends below swing_angle - band",
            0.145,
            0.0,
            0.5,
        ),
    ]
    push_off_end: Annotated[float, Number("1", "end of push-off, as a fraction of the stride time", 0.565, 0.1, 1.0)]
    largest_torque: Annotated[
        float,
        Number(
            "N m",
            "torque magnitude at which the chamber is vented until half of the torque remains",
            None,
            0.0,
            1.0e3,
            follows=whole_reach,
        ),
    ]
    phases: PhaseRules


class _EventOnOffState(NamedTuple):
    """Phase; ``lifting`` is 1 for a lifted foot, ``resting`` is 1 while excess torque is vented."""

    phase: PhaseState = PhaseState()
    lifting: float = 0.0
    resting: float = 0.0


def update(
    parameters: _EventOnOffParameters,
    state: _EventOnOffState,
    reference: float,
    measurement: GaitMeasurement,
    period: float,
) -> tuple[float, _EventOnOffState]:
    """Command [-]: 1 plantarflexion, -1 dorsiflexion, ``VENT`` for free motion; the reference is not used."""
    heel = measurement.heel_force
    toe = measurement.toe_force
    phase = phases.next_phase_state(parameters.phases, state.phase, heel, toe, period)
    above = measurement.angle > parameters.swing_angle + parameters.band
    below = measurement.angle < parameters.swing_angle - parameters.band
    # Hysteresis: between both limits the valve stays as it is.
    lifting = 0.0 if below else (1.0 if above else state.lifting)
    held = phases.lifts(phase.phase)
    command = -1.0 if lifting > 0.5 or phase.phase == LANDING else VENT
    command = command if held else VENT
    # Vented before toe-off, so that the gas does not hold the foot down in the swing.
    in_time = phase.since_strike < parameters.push_off_end * phase.stride_time
    command = 1.0 if phase.phase == PUSH_OFF and in_time else command
    # A torque is let go from the largest one on, until half of it is left; of what the valve feeds alone: a torque
    # against it is the wearer's.
    largest = parameters.largest_torque
    rests = abs(measurement.torque) > (0.5 * largest if state.resting > 0.5 else largest)
    command = VENT if rests and command * measurement.torque > 0.0 else command
    command = VENT if phases.lacks_event(phase) else command
    following = _EventOnOffState(phase=phase, lifting=lifting if held else 0.0, resting=1.0 if rests else 0.0)
    return command, following


EVENT_ON_OFF = ControllerKind(
    name="event_on_off",
    summary="Event-based: dorsiflexion in swing and landing, free in mid-stance, plantarflexion in push-off.",
    source="the paper, figure 1A and section 'PPAFO Hardware': binary, event-based control",
    quantities=quantities_of(_EventOnOffParameters),
    parameters=_EventOnOffParameters,
    initial=_EventOnOffState(),
    update=update,
    only_switches=True,
)


def off_update(
    parameters: EmptyRow, state: EmptyRow, reference: float, measurement: GaitMeasurement, period: float
) -> tuple[float, EmptyRow]:
    """Command ``VENT`` of a device that is switched off, and the unchanged state."""
    return VENT, state


OFF = ControllerKind(
    name="off",
    summary="Both chambers vented.",
    source="comparison without assistance",
    quantities=(),
    parameters=EmptyRow,
    initial=EmptyRow(),
    update=off_update,
    only_switches=True,
)
