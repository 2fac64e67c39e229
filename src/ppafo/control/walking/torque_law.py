"""A torque law that walks: the phases of the gait say which torque is requested, safety watches, the law follows it.

The frame is one for all laws. What differs is data: the law, its gains for walking, and what it remembers where another
task of the gait begins.
"""

import collections
import functools
import types
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.control.walking import assistance, phases, safety
from ppafo.control.walking.assistance import ASSISTING_QUANTITIES, Assistance, TorqueRequest, assess, with_defaults
from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.control.walking.safety import SafetyState
from ppafo.control.walking.signs import SafetyRules
from ppafo.control.walking.timing import ThresholdClock, ThresholdRules
from ppafo.errors import ScenarioError
from ppafo.model.declaration import Quantity
from ppafo.model.gait_sensors import GaitMeasurement
from ppafo.model.sensors import Measurement


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


def restart(state: Any, requested: float, continues: float) -> Any:
    """The state of a law that starts again where another task begins (``continues`` 0, else 1)."""
    return state if continues > 0.5 else LAW_START


def keep(state: Any, requested: float, continues: float) -> Any:
    """The state of a law that has no memory, and so nothing to reset."""
    return state


def update(
    parameters: Any, state: LawState, reference: float, measurement: GaitMeasurement, period: float
) -> tuple[float, LawState]:
    """Command from -1 to 1, or ``VENT``; the reference is not used."""
    assessment = assess(parameters, state, measurement, period)
    requested = assessment.request.torque
    law = law_restart(state.law, requested, assessment.continues)
    sample = assistance.torque_measurement(measurement)
    command, law = law_update(parameters.law, law, requested, sample, period)
    command, watch = assistance.valve_command(assessment, command, period)
    return command, LawState(
        phase=assessment.phase, clock=assessment.clock, safety=watch, request=assessment.request, law=law
    )


def bind(frame: Callable[..., Any], name: str, pieces: Mapping[str, Any]) -> Callable[..., Any]:
    """Return the function of a frame with other pieces in the place of some names of this module.

    It is the same code: only what those names stand for differs, so that the engine compiles it as any other function.
    """
    assert isinstance(frame, types.FunctionType), "a frame is a plain function"
    made = types.FunctionType(frame.__code__, {**frame.__globals__, **pieces}, name)
    made.__qualname__ = name
    made.__module__ = frame.__module__
    made.__annotations__ = frame.__annotations__
    return made


def row_with(name: str, row: Any, **classes: type) -> Any:
    """Return a NamedTuple class as ``row`` is one, whose named fields are of the given classes."""
    namedtuple: Any = collections.namedtuple
    made = namedtuple(name, row._fields, module=__name__)
    made.__annotations__ = {**row.__annotations__, **classes}
    return made


def shared_settings(law: ControllerKind) -> set[str]:
    """Return the settings of a torque law that have the name of one that every controller of walking has."""
    return {item.name for item in law.quantities} & {item.name for item in ASSISTING_QUANTITIES}


@functools.cache
def walking_law(law: ControllerKind, name: str, summary: str, gains: tuple[tuple[str, float], ...]) -> ControllerKind:
    """Return a torque law as a controller of walking, with ``gains`` in place of its own defaults, in SI units.

    ScenarioError where a setting of the law has the name of one of walking.
    """
    taken = shared_settings(law)
    if taken:
        raise ScenarioError(
            f"controller '{law.name}' cannot walk: its setting '{min(taken)}' has the name of one that every "
            f"controller of walking has"
        )
    title = "".join(part.capitalize() for part in name.split("_"))
    parameters = row_with(f"{title}Parameters", LawParameters, law=law.parameters, timing=ThresholdRules)
    state = row_with(f"{title}State", LawState, law=type(law.initial), clock=ThresholdClock)
    anew = bind(restart, f"restart_{name}", {"LAW_START": law.initial}) if len(law.initial) else keep
    pieces = {"law_update": law.update, "law_restart": law.restart or anew, "LawState": state}
    return replace(
        law,
        name=name,
        summary=summary,
        source=f"the paper, figure 1A (phases); {law.source}",
        quantities=(*with_defaults(law.quantities, dict(gains)), *ASSISTING_QUANTITIES),
        parameters=parameters,
        initial=state(
            phase=phases.START,
            clock=ThresholdClock(),
            safety=safety.START,
            request=assistance.START,
            law=law.initial,
        ),
        update=bind(update, f"update_{name}", pieces),
        restart=None,
    )


class ProportionalParameters(NamedTuple):
    """Gains on the torque error [1/(N m)] and its integral [1/(N m s)]."""

    torque_gain: float
    torque_integral_gain: float


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
    quantities=(
        Quantity("torque_gain", "1/(N m)", "opening per torque error", 1.3, 0.0, 1.0e3),
        Quantity("torque_integral_gain", "1/(N m s)", "opening per integral of the torque error", 0.2, 0.0, 1.0e3),
    ),
    parameters=ProportionalParameters,
    initial=ProportionalState(0.0),
    update=proportional_update,
    restart=proportional_restart,
)
