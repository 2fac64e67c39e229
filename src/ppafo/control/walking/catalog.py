"""Every controller of walking by name, and the frame in which a torque law walks.

The phases of the gait say which torque is requested, safety watches, the law follows the request. The frame is one for
all laws. What differs is data: the law, and what it remembers where another task of the gait begins. A torque law of
``control.catalog`` walks by its own name, with no line here; a line says what it is in walking.
A law with ideas of its own of the phases is a module of this folder with a ``ControllerKind``, listed here: its
``update`` watches the sensors with ``safety.monitor`` and passes its command through ``safety.safe_command``.
"""

import functools
from dataclasses import replace
from typing import Annotated, Any, NamedTuple

from ppafo.control.binding import bind
from ppafo.control.catalog import CONTROLLERS
from ppafo.control.controllers import feedback, model_based, switching
from ppafo.control.kind import ControllerKind
from ppafo.control.torque_loop import INTEGRAL_GAIN, PROPORTIONAL_GAIN
from ppafo.control.walking import assistance, event_on_off, learning, phases, safety
from ppafo.control.walking.assistance import ASSISTING_QUANTITIES, Assistance, TorqueRequest, assess
from ppafo.control.walking.estimated_timing import ESTIMATED
from ppafo.control.walking.fault_checks import SafetyRules
from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.control.walking.safety import SafetyState
from ppafo.control.walking.timing import FRACTIONAL, THRESHOLDS, ThresholdClock, ThresholdRules, TimingKind
from ppafo.errors import ScenarioError
from ppafo.kinds import Kinds
from ppafo.model.controlled import TORQUE
from ppafo.model.declaration import Number, quantities_of, row_with
from ppafo.model.sensors import GaitMeasurement, Measurement


class LawParameters(NamedTuple):
    """The law, what is requested, rules of phases, safety and timing; ``row_with`` makes one for each law."""

    law: Any
    assistance: Assistance
    phases: PhaseRules
    safety: SafetyRules
    timing: Any


class LawState(NamedTuple):
    """Phase, clock, safety, the requested torque, and the state of the law; ``row_with`` makes one for each law."""

    phase: PhaseState
    clock: Any
    safety: SafetyState
    request: TorqueRequest
    law: Any


def law_update(parameters: Any, state: Any, reference: float, measurement: Any, period: float) -> tuple[float, Any]:
    """Stand for the law, which ``bind`` puts here: command [-] and next state of a torque law."""
    raise NotImplementedError


def law_restart(state: Any, requested: float, continues: float) -> Any:
    """Stand for what the law remembers, at a requested torque [N m], where another task may begin (``continues`` 0)."""
    raise NotImplementedError


LAW_START = None
"""Stands for the start of the law's state."""


def restart_anew(state: Any, requested: float, continues: float) -> Any:
    """The state of a law that starts again where another task begins (``continues`` 0, else 1)."""
    return state if continues > 0.5 else LAW_START


def keep_state(state: Any, requested: float, continues: float) -> Any:
    """The state of a law that has no memory, and so nothing to reset."""
    return state


def law_that_walks_update(
    parameters: Any, state: LawState, reference: float, measurement: GaitMeasurement, period: float
) -> tuple[float, LawState]:
    """Command from -1 to 1, or ``VENT``; the reference is not used."""
    assessment = assess(parameters, state, measurement, period)
    requested = assessment.request.torque
    # Before the update: what the law remembers of another task must not act on this one.
    law = law_restart(state.law, requested, assessment.continues)
    sample = assistance.torque_measurement(measurement)
    command, law = law_update(parameters.law, law, requested, sample, period)
    command, watch = assistance.valve_command(assessment, command, period)
    return command, LawState(
        phase=assessment.phase, clock=assessment.clock, safety=watch, request=assessment.request, law=law
    )


def shared_settings(law: ControllerKind) -> set[str]:
    """Return the settings of a torque law whose names every controller of walking has, too."""
    return {quantity.name for quantity in law.quantities} & {quantity.name for quantity in ASSISTING_QUANTITIES}


@functools.cache
def walking_law(law: ControllerKind, name: str, summary: str) -> ControllerKind:
    """Return a torque law as a controller of walking.

    ScenarioError where a setting of the law has the name of one of walking.
    """
    taken = shared_settings(law)
    # Settings of law and frame stand in one section of a file, where a name can mean only one thing.
    if taken:
        raise ScenarioError(
            f"controller '{law.name}' cannot walk: its setting '{min(taken)}' has the name of one that every "
            f"controller of walking has"
        )
    # One class for each law, named after it: exported C has structs of these names.
    title = "".join(part.capitalize() for part in name.split("_"))
    parameters = row_with(f"{title}Parameters", LawParameters, law=law.parameters, timing=ThresholdRules)
    state = row_with(f"{title}State", LawState, law=type(law.initial), clock=ThresholdClock)
    # A law without a state has nothing to begin anew, and its empty NamedTuple no literal in C.
    anew = bind(restart_anew, f"restart_{name}", {"LAW_START": law.initial}) if len(law.initial) else keep_state
    components = {"law_update": law.update, "law_restart": law.restart or anew, "LawState": state}
    return replace(
        law,
        name=name,
        summary=summary,
        source=f"the paper, figure 1A (phases); {law.source}",
        quantities=(*law.quantities, *ASSISTING_QUANTITIES),
        parameters=parameters,
        initial=state(
            phase=phases.START,
            clock=ThresholdClock(),
            safety=safety.START,
            request=assistance.START,
            law=law.initial,
        ),
        update=bind(law_that_walks_update, f"update_{name}", components),
        restart=None,
        controls=(TORQUE,),
    )


class ProportionalParameters(NamedTuple):
    """Gains on the torque error [1/(N m)] and its integral [1/(N m s)]."""

    torque_gain: Annotated[
        float, Number("1/(N m)", "opening per torque error", None, 0.0, 1.0e3, follows=(PROPORTIONAL_GAIN,))
    ]
    torque_integral_gain: Annotated[
        float,
        Number("1/(N m s)", "opening per integral of the torque error", None, 0.0, 1.0e6, follows=(INTEGRAL_GAIN,)),
    ]


class ProportionalState(NamedTuple):
    """Integral part of the command [-]."""

    integral: float


def proportional_update(
    parameters: ProportionalParameters,
    state: ProportionalState,
    reference: float,
    measurement: Measurement,
    period: float,
) -> tuple[float, ProportionalState]:
    """Command from -1 to 1 of the torque error [N m]."""
    error = reference - measurement.torque
    proposed = parameters.torque_gain * error + state.integral
    # The integral waits while the valve is fully open: more of it could not be carried out.
    added = parameters.torque_integral_gain * error * period
    integral = state.integral + (added if abs(proposed) < 1.0 else 0.0)
    return max(-1.0, min(1.0, proposed)), ProportionalState(integral)


def proportional_restart(state: ProportionalState, requested: float, continues: float) -> ProportionalState:
    """The state, reset where another task begins (``continues`` 0, else 1); ``requested`` [N m] is not used."""
    return ProportionalState(integral=state.integral * continues)


PROPORTIONAL = ControllerKind(
    name="proportional",
    summary="Proportional and integral action on the torque error.",
    source="profile of four parameters as in J. Zhang et al., Science 356 (2017) 1280",
    quantities=quantities_of(ProportionalParameters),
    parameters=ProportionalParameters,
    initial=ProportionalState(0.0),
    update=proportional_update,
    restart=proportional_restart,
)


LAWS: tuple[tuple[ControllerKind, str], ...] = (
    (switching.ON_OFF_DEAD_ZONE, "on/off switching with a dead zone"),
    (PROPORTIONAL, "proportional and integral action"),
    (feedback.PID, "a PID with anti-windup"),
    (model_based.PID_FEEDFORWARD, "a PID and the inverse of a valve model"),
    (feedback.SLIDING_MODE, "a sliding mode law with a boundary layer"),
    (model_based.FEEDBACK_LINEARISATION, "inverting the chamber dynamics"),
)
"""Torque laws with what follows the torque profiles, in words."""


_EVENT_BASED = {
    law.name: walking_law(
        law, f"event_{law.name}", f"Event-based torque profiles for each phase, tracked by {following}."
    )
    for law, following in LAWS
}
_ORDER = (
    event_on_off.EVENT_ON_OFF,
    *(_EVENT_BASED[name] for name in ("on_off_dead_zone", "proportional", "pid", "pid_feedforward", "sliding_mode")),
    learning.KIND,
    _EVENT_BASED["feedback_linearisation"],
    event_on_off.OFF,
)

WALKING_CONTROLLERS: Kinds[ControllerKind] = Kinds(
    "ppafo.walking_controllers", "controller of walking", ControllerKind, {kind.name: kind for kind in _ORDER}
)
"""Controllers that compete with each other in walking."""


def walking_controllers() -> dict[str, ControllerKind]:
    """Return all controllers that a walk file can name: those of walking, and every torque law by its own name.

    A law that is one of walking is so under its own name too: ``pid`` is ``event_pid``. A constant command follows no
    torque and does not walk, nor does a law that holds an angle, a fixed-point law, or one whose settings have names
    that walking has taken.
    """
    laws = {
        name: law
        for name, law in CONTROLLERS.items()
        if law is not switching.CONSTANT
        and TORQUE in law.controls
        and law.plan is None
        and not shared_settings(law)
        and not reads_gait(law)
    }
    return dict(WALKING_CONTROLLERS) | {name: law_that_walks(law) for name, law in laws.items()}


def load_walking_controller(name: str) -> None:
    """Load a controller of another package by its name, so that ``walking_controllers`` has it; KindError if broken."""
    if ":" not in name:
        if WALKING_CONTROLLERS.get(name) is None:
            CONTROLLERS.get(name)
        return
    # Either catalogue would take an object that is named by its module: what its law reads says whose it is.
    law = CONTROLLERS.get(name)
    if law is not None and reads_gait(law):
        WALKING_CONTROLLERS[name] = law


def reads_gait(kind: ControllerKind) -> bool:
    """Return whether the law of a controller takes a ``GaitMeasurement``, and has gait phases of its own."""
    return kind.update.__annotations__.get("measurement") in (GaitMeasurement, GaitMeasurement.__name__)


def law_that_walks(law: ControllerKind) -> ControllerKind:
    """Return any torque law as a controller of walking."""
    # A law of another package may have the name of one of ours.
    if law.name in _EVENT_BASED and CONTROLLERS.get(law.name) is law:
        return _EVENT_BASED[law.name]
    summary = f"Torque profiles for each phase, tracked by the law {law.name}."
    return walking_law(law, law.name, summary)


TIMINGS: Kinds[TimingKind] = Kinds(
    "ppafo.walking_timings",
    "timing of walking",
    TimingKind,
    {kind.name: kind for kind in (THRESHOLDS, FRACTIONAL, ESTIMATED)},
)
"""The ways to know the gait phase. Every controller has the first one unless another is chosen."""


def keeps_time(kind: ControllerKind) -> bool:
    """Return whether a walking controller uses a gait phase, which has several timings."""
    return "clock" in getattr(kind.initial, "_fields", ())


@functools.cache
def with_timing(kind: ControllerKind, timing: TimingKind) -> ControllerKind:
    """Return a controller of walking that knows the gait phase in another way; ScenarioError if it has none."""
    if timing is THRESHOLDS:
        return kind
    if not keeps_time(kind):
        raise ScenarioError(f"controller '{kind.name}' uses no gait phase: timing.kind cannot be given")
    name, before = f"{kind.name}_{timing.name}", type(kind.initial)
    title = timing.name.capitalize()
    state = row_with(f"{before.__name__}{title}", before, clock=type(timing.initial))
    parameters = row_with(f"{kind.parameters.__name__}{title}", kind.parameters, timing=timing.parameters)
    own = {"follow_thresholds": timing.follow, "threshold_time": timing.gait_time}
    timed = {"timed_phase": bind(assistance.timed_phase, f"timed_phase_{timing.name}", own)}
    components = timed | {"assess": bind(assistance.assess, f"assess_{timing.name}", timed)}
    # Where the frame makes its state, it must make the class with the other clock.
    made = {word: state for word, value in kind.update.__globals__.items() if value is before}
    return replace(
        kind,
        quantities=(*kind.quantities, *timing.quantities),
        parameters=parameters,
        initial=state(**kind.initial._asdict() | {"clock": timing.initial}),
        update=bind(kind.update, f"update_{name}", components | made),
    )
