"""Common frame of all torque laws in walking.

The gait phase determines the requested torque, and the law tracks the request. Walking torque laws differ only in the
law and in its state after a change of task.
"""

import functools
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.control.walking import assistance, phases
from ppafo.control.walking.assistance import ASSISTING_QUANTITIES, Assistance, TorqueRequest
from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.errors import ScenarioError
from ppafo.model.binding import made_of
from ppafo.model.controlled import TORQUE
from ppafo.model.declaration import row_with
from ppafo.model.sensors import GaitMeasurement, Measurement
from ppafo.model.valves.kind import VENT


class LawParameters(NamedTuple):
    """Parameters of law, assistance and phases; ``row_with`` makes a class for each law."""

    law: Any
    assistance: Assistance
    phases: PhaseRules


class LawState(NamedTuple):
    """Phase, torque request, and state of the law; ``row_with`` makes a class for each law."""

    phase: PhaseState
    request: TorqueRequest
    law: Any


class _WalkingParts(NamedTuple):
    """Functions of a torque law that walks, with the class of the state.

    ``update`` returns command [-] and next state. ``restart(state, requested, continues)`` returns the state at a
    requested torque [N m]; ``continues`` is 0 where another task starts.
    """

    state: Callable[..., Any]
    update: Callable[[Any, Any, float, Any, float], tuple[float, Any]]
    restart: Callable[[Any, float, float], Any]


class _InitialStateParts(NamedTuple):
    """Initial state of a law, to which ``restart_anew`` resets it."""

    start: Any


def restart_anew(state: Any, requested: float, continues: float, *, parts: _InitialStateParts) -> Any:
    """State of a law that is reset where another task starts (``continues`` 0, else 1)."""
    return state if continues > 0.5 else parts.start


def keep_state(state: Any, requested: float, continues: float) -> Any:
    """Unchanged state of a law without memory."""
    return state


def law_that_walks_update(
    parameters: Any,
    state: LawState,
    reference: float,
    measurement: GaitMeasurement,
    period: float,
    *,
    parts: _WalkingParts,
) -> tuple[float, LawState]:
    """Command from -1 to 1, or ``VENT``, and the next state; the reference is not used."""
    heel, toe = measurement.heel_force, measurement.toe_force
    phase = phases.next_phase_state(parameters.phases, state.phase, heel, toe, period)
    request = assistance.next_request(parameters.assistance, state.request, phase, measurement.angle, period)
    # Before the update: what the law remembers of another task must not act on this one.
    continues = 1.0 if assistance.same_task(state.phase.phase, phase.phase) else 0.0
    law = parts.restart(state.law, request.torque, continues)
    sample = Measurement(
        angle=measurement.angle,
        pressure_1=measurement.pressure_1,
        pressure_2=measurement.pressure_2,
        torque=measurement.torque,
    )
    command, law = parts.update(parameters.law, law, request.torque, sample, period)
    sent = command if assistance.acts(phase, measurement.torque) else VENT
    following: LawState = parts.state(phase=phase, request=request, law=law)
    return sent, following


def shared_settings(law: ControllerKind) -> set[str]:
    """Return the settings of a torque law whose names are also used by every controller of walking."""
    return {quantity.name for quantity in law.quantities} & {quantity.name for quantity in ASSISTING_QUANTITIES}


@functools.cache
def walking_law(law: ControllerKind, name: str, summary: str) -> ControllerKind:
    """Return a torque law in this frame as a controller of walking, with the given name and summary.

    Raises ScenarioError if a setting of the law has the name of a setting of walking.
    """
    shared = shared_settings(law)
    # Settings of law and frame stand in one section of a file, where a name can mean only one thing.
    if shared:
        raise ScenarioError(
            f"controller '{law.name}': setting '{min(shared)}' has the name of a setting that all walking "
            "controllers share; rename it"
        )
    # One class for each law, named after it: exported C has structs of these names.
    title = "".join(part.capitalize() for part in name.split("_"))
    parameters = row_with(f"{title}Parameters", LawParameters, law=law.parameters)
    state = row_with(f"{title}State", LawState, law=type(law.initial))
    # A law without a state has nothing to begin anew, and its empty NamedTuple no literal in C.
    anew = made_of(restart_anew, f"restart_{name}", _InitialStateParts(law.initial)) if len(law.initial) else keep_state
    parts = _WalkingParts(state=state, update=law.update, restart=law.restart or anew)
    return replace(
        law,
        name=name,
        summary=summary,
        source=f"the paper, figure 1A (phases); {law.source}",
        quantities=(*law.quantities, *ASSISTING_QUANTITIES),
        parameters=parameters,
        initial=state(phases.START, assistance.START, law.initial),
        update=made_of(law_that_walks_update, f"update_{name}", parts),
        restart=None,
        controls=(TORQUE,),
    )
