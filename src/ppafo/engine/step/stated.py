"""States of effects in an integration step: predictor for the second stage, update, and error estimate."""

from ppafo.engine.program import Program
from ppafo.engine.scheme.pneumatics import SHORTEST
from ppafo.engine.step import gas
from ppafo.engine.step.lane import Lane
from ppafo.model.effects.kind import PlantSnapshot
from ppafo.model.plant import PlantState

LARGEST = 1.0e300
"""Magnitude of a state beyond which, as for NaN, the run has failed."""


def moment(
    parts: Program, lane: Lane, state: PlantState, supplied: float, vented: float, command: float
) -> PlantSnapshot:
    """Return the input of effect laws: motion, absolute pressures [Pa], mean flows [kg/s] and command [-]."""
    pressure_1, pressure_2 = parts.actuator.pressures(lane.plant, state.angle, state.mass_1, state.mass_2)
    return PlantSnapshot(
        angle=state.angle,
        angular_velocity=state.angular_velocity,
        pressure_1=pressure_1,
        pressure_2=pressure_2,
        supplied_flow=supplied,
        vented_flow=vented,
        command=command,
    )


def begun_moment(parts: Program, lane: Lane, command: float) -> PlantSnapshot:
    """Return the input of effect laws at the start of a step, with the flows of the first stage [kg/s]."""
    first = gas.first(parts, lane)
    supplied = first.supplied_1 + first.supplied_2
    return moment(parts, lane, lane.state, supplied, supplied - first.mass_1 - first.mass_2, command)


def straight_on(value: float, rate: float, length: float) -> float:
    """Return the linear extrapolation of a value over ``length`` [s] at its rate."""
    return value + length * rate


def predict(parts: Program, lane: Lane, command: float, length: float) -> None:
    """Set the effect states predicted for the end of the first stage; without them, the method is of first order."""
    begun = begun_moment(parts, lane, command)
    for name, kind in parts.stated_at_ports.items():
        state = lane[f"{name}_state"]
        rates = kind.slopes(lane[name], state, begun)
        lane[f"{name}_state_kept"] = state
        lane[f"{name}_state"] = kind.row(
            *(straight_on(getattr(state, field), getattr(rates, field), length) for field in kind.fields)
        )


def restore(parts: Program, lane: Lane) -> None:
    """Restore the effect states at the start of the step."""
    for name in parts.stated_at_ports:
        lane[f"{name}_state"] = lane[f"{name}_state_kept"]


def advance(parts: Program, lane: Lane, command: float, length: float) -> None:
    """Set the effect states at the end of a step or part."""
    # Means over the step: a part without length must not divide by 0.
    span = max(length, SHORTEST)
    supplied = (lane.after.supplied_mass - lane.state.supplied_mass) / span
    vented = (lane.after.vented_mass - lane.state.vented_mass) / span
    before = moment(parts, lane, lane.state, supplied, vented, command)
    after = moment(parts, lane, lane.after, supplied, vented, command)
    for name, kind in parts.stated.items():
        lane[f"{name}_state_after"] = kind.advance(lane[name], lane[f"{name}_state"], before, after, length)


def error(parts: Program, lane: Lane, command: float, length: float) -> float:
    """Return the largest difference between exact step and linear extrapolation, divided by the allowed error [-]."""
    begun = begun_moment(parts, lane, command)
    worst = 0.0
    for name, kind in parts.stated_with_errors.items():
        state = lane[f"{name}_state"]
        after = lane[f"{name}_state_after"]
        rates = kind.slopes(lane[name], state, begun)
        for field, allowed in zip(kind.fields, kind.tolerances, strict=True):
            straight = straight_on(getattr(state, field), getattr(rates, field), length)
            worst = max(worst, abs(getattr(after, field) - straight) / allowed)
    return worst


def are_bounded(parts: Program, lane: Lane) -> bool:
    """Return whether all effect states at the end of a step are finite."""
    bounded = True
    for name, kind in parts.stated.items():
        for field in kind.fields:
            bounded = bounded and abs(getattr(lane[f"{name}_state_after"], field)) < LARGEST
    return bounded
