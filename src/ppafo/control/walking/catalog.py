"""Controllers of walking by name.

A torque law of ``control.catalog`` walks under its own name without an entry here; an entry gives the law another name
and a summary for walking. A law with its own gait phases is a module of this folder with a ``ControllerKind``, listed
here; it vents where ``phases.lacks_event``.
"""

import functools
from collections.abc import Callable
from dataclasses import replace
from typing import Annotated, Any, NamedTuple

from ppafo.control.catalog import CONTROLLERS
from ppafo.control.controllers import model_based, pid, switching
from ppafo.control.kind import BelievedBand, ControllerKind, reads_gait
from ppafo.control.torque_loop import beyond_dead_band, integral_gain, proportional_gain
from ppafo.control.walking import assistance, event_on_off, phases
from ppafo.control.walking.assistance import ASSISTING_QUANTITIES, Assistance, TorqueRequest
from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.errors import ScenarioError
from ppafo.kinds import Kinds
from ppafo.model.binding import made_of
from ppafo.model.controlled import TORQUE
from ppafo.model.declaration import Number, quantities_of, row_with
from ppafo.model.sensors import GaitMeasurement, Measurement
from ppafo.model.valves.kind import VENT

# Proportional and integral action on the torque error, in walking.


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
    heel = measurement.heel_force
    toe = measurement.toe_force
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


class _ProportionalParameters(NamedTuple):
    """Gains on the torque error [1/(N m)] and its integral [1/(N m s)], and assumed dead band of the valve [-]."""

    torque_gain: Annotated[
        float, Number("1/(N m)", "opening per torque error", None, 0.0, 1.0e3, follows=proportional_gain)
    ]
    torque_integral_gain: Annotated[
        float,
        Number("1/(N m s)", "opening per integral of the torque error", None, 0.0, 1.0e6, follows=integral_gain),
    ]
    dead_band: BelievedBand


class _ProportionalState(NamedTuple):
    """Integral part of the command [-]."""

    integral: float


def proportional_update(
    parameters: _ProportionalParameters,
    state: _ProportionalState,
    reference: float,
    measurement: Measurement,
    period: float,
) -> tuple[float, _ProportionalState]:
    """Command from -1 to 1 and next state for a torque error e [N m], once every ``period`` [s].

    The opening is u = torque_gain e + torque_integral_gain (integral of e), with dead-band compensation.
    """
    error = reference - measurement.torque
    proposed = parameters.torque_gain * error + state.integral
    # The integral waits while the valve is fully open: more of it could not be carried out.
    added = parameters.torque_integral_gain * error * period
    integral = state.integral + (added if abs(proposed) < 1.0 else 0.0)
    command = beyond_dead_band(max(-1.0, min(1.0, proposed)), parameters.dead_band)
    return command, _ProportionalState(integral)


PROPORTIONAL = ControllerKind(
    name="proportional",
    summary="Proportional and integral action on the torque error.",
    source="profile of four parameters as in J. Zhang et al., Science 356 (2017) 1280",
    quantities=quantities_of(_ProportionalParameters),
    parameters=_ProportionalParameters,
    initial=_ProportionalState(0.0),
    update=proportional_update,
)


_EVENT_BASED = {
    law: walking_law(law, f"event_{law.name}", f"Event-based torque profiles for each phase, tracked by {following}.")
    for law, following in (
        (switching.ON_OFF_DEAD_ZONE, "on/off switching with a dead zone"),
        (PROPORTIONAL, "proportional and integral action"),
        (pid.PID, "a PID with anti-windup"),
        (model_based.PID_FEEDFORWARD, "a PID and the inverse of a valve model"),
        (switching.SLIDING_MODE, "a sliding mode law with a boundary layer"),
        (model_based.FEEDBACK_LINEARISATION, "inverting the chamber dynamics"),
    )
}
"""Torque laws with a separate name and summary in walking."""

_COMPETING = (event_on_off.EVENT_ON_OFF, *_EVENT_BASED.values(), event_on_off.OFF)
WALKING_CONTROLLERS: Kinds[ControllerKind] = Kinds(
    "ppafo.walking_controllers", "controller of walking", ControllerKind, {kind.name: kind for kind in _COMPETING}
)
"""Alternative controllers of walking, in the order of tables."""


def walking_controllers() -> dict[str, ControllerKind]:
    """Return all controllers that a walk file can name: controllers of walking and every suitable torque law.

    A law with a separate name in walking has both names: ``pid`` is also ``event_pid``. Not suitable are a constant
    command, which tracks no torque, a law that controls an angle, a fixed-point law, and a law with a setting whose
    name is already used in walking.
    """
    laws = {
        name: law
        for name, law in CONTROLLERS.items()
        if law is not switching.CONSTANT
        and TORQUE in law.controls
        and law.plan is None
        and not shared_settings(law)
        and not reads_gait(law.update)
    }
    # Of the user's modules, either catalogue takes every law when it meets an unknown name.
    own = {name: law for name, law in WALKING_CONTROLLERS.items() if ":" not in name or reads_gait(law.update)}
    return own | {name: law_that_walks(law) for name, law in laws.items()}


def load_walking_controller(name: str) -> None:
    """Load a controller of another package by name for ``walking_controllers``. Raises KindError if it is broken."""
    if ":" not in name:
        if WALKING_CONTROLLERS.get(name) is None:
            CONTROLLERS.get(name)
        return
    # Either catalogue would take an object that is named by its module: what its law reads says whose it is.
    law = CONTROLLERS.get(name)
    if law is not None and reads_gait(law.update):
        WALKING_CONTROLLERS[name] = law


def law_that_walks(law: ControllerKind) -> ControllerKind:
    """Return a torque law as a controller of walking."""
    # Looked up by the law, for one of another package may have the name of one of ours.
    listed = _EVENT_BASED.get(law)
    return listed or walking_law(law, law.name, f"Torque profiles for each phase, tracked by the law {law.name}.")
