"""Torque that a walk requests of a controller outside the program: an object of Python, or the caller of a stepped run.

The phases of the gait and the request are those of the frame of all torque laws in walking; the command is given from
outside at each sample.
"""

from typing import NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.control.walking import assistance, phases
from ppafo.control.walking.assistance import ASSISTING_QUANTITIES, Assistance, TorqueRequest
from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.model.sensors import GaitMeasurement


class OutsideParameters(NamedTuple):
    """Parameters of assistance and phases."""

    assistance: Assistance
    phases: PhaseRules


class OutsideState(NamedTuple):
    """Phase, torque request, and command [-] given from outside."""

    phase: PhaseState
    request: TorqueRequest
    command: float


def outside_update(
    parameters: OutsideParameters, state: OutsideState, reference: float, measurement: GaitMeasurement, period: float
) -> tuple[float, OutsideState]:
    """Command as given, and the next phase and request; the reference is not used."""
    heel = measurement.heel_force
    toe = measurement.toe_force
    phase = phases.next_phase_state(parameters.phases, state.phase, heel, toe, period)
    request = assistance.next_request(parameters.assistance, state.request, phase, measurement.angle, period)
    return state.command, OutsideState(phase, request, state.command)


OUTSIDE = ControllerKind(
    name="python",
    summary="Torque profiles for each phase, tracked by an object of Python.",
    source="the paper, figure 1A (phases)",
    quantities=ASSISTING_QUANTITIES,
    parameters=OutsideParameters,
    initial=OutsideState(phases.START, assistance.START, 0.0),
    update=outside_update,
)
