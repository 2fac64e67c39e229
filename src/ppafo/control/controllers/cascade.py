"""Cascade control of an angle: an outer loop requests a joint torque, an inner loop opens the valve for this torque.

The load on the joint is observed, as the part of the torque that did not accelerate the joint. Static friction makes an
observer cycle: the breakaway torque is therefore a separate state, which increases while the joint rests away from its
reference and is reset once the joint moves. Within a tolerance the states do not adapt.
"""

import math
from typing import Annotated, NamedTuple

from ppafo.control.angle_loop import (
    REST_RATE,
    angle_damping,
    angle_stiffness,
    gravity,
    inertia,
    inner_gain,
    load_time,
    rate_filter,
    rest_distance,
    tolerance,
    torque_lag,
)
from ppafo.control.kind import BelievedBand, ControllerKind
from ppafo.control.torque_loop import beyond_dead_band
from ppafo.model.controlled import ANGLE, OF_TORQUE, ErrorFunctions
from ppafo.model.declaration import Number, quantities_of
from ppafo.model.plant import gravity_torque
from ppafo.model.sensors import Measurement

SMOOTHING = 8.0
"""Filter time constant of the reference acceleration divided by the one of the rate [-]; the reference may jump."""
SLOW = 0.05
"""Requested joint rate [rad/s] above which the friction is compensated in full."""
SHARE_OF_FRICTION = 0.7
"""Fraction of the assumed kinetic friction that is compensated; overcompensation makes the joint oscillate."""
CREEP_LAGS = 5.0
"""Time, in lags of the torque loop, in which the breakaway torque grows by the static friction at ``CREEP_ERROR``."""
FASTEST_CREEP = 10.0
"""Largest growth rate of the breakaway torque divided by the nominal rate, at larger errors [-]."""


class CascadeParameters(NamedTuple):
    """Gains of the angle loop and of the inner torque loop, and the assumed dynamics of joint and valve.

    ``angle_stiffness`` [N m/rad] and ``angle_damping`` [N m s/rad] act on the error and on its rate, ``torque_gain``
    [1/(N m)] opens the valve. ``rate_filter`` [s] smooths the measured rate, ``load_time`` and ``torque_lag`` [s] are
    time constants of the load observer and of the torque loop; a ``load_time`` of 0 s switches the observer off.
    """

    error_limit: Annotated[
        float,
        Number(
            "rad",
            "largest angle error that the law acts on; beyond it the joint moves at constant speed",
            0.1,
            1.0e-4,
            10.0,
        ),
    ]
    angle_stiffness: Annotated[
        float, Number("N m/rad", "torque per angle error", None, 0.0, 1.0e6, follows=angle_stiffness)
    ]
    angle_damping: Annotated[
        float, Number("N m s/rad", "torque per rate of the angle error", None, 0.0, 1.0e6, follows=angle_damping)
    ]
    load_time: Annotated[
        float, Number("s", "time constant of the observed load, 0 for none", None, 0.0, 1.0e3, follows=load_time)
    ]
    rate_filter: Annotated[
        float, Number("s", "time constant of the filter on the angle's rate", None, 0.0, 10.0, follows=rate_filter)
    ]
    torque_lag: Annotated[
        float, Number("s", "believed time constant of the torque loop", None, 1.0e-6, 10.0, follows=torque_lag)
    ]
    torque_gain: Annotated[float, Number("1/(N m)", "command per torque error", None, 0.0, 1.0e6, follows=inner_gain)]
    tolerance: Annotated[
        float,
        Number("rad", "angle error below which the observed load is not updated", None, 0.0, 1.0, follows=tolerance),
    ]
    rest_distance: Annotated[
        float,
        Number("rad", "angle change that counts as motion of the joint", None, 1.0e-9, 1.0, follows=rest_distance),
    ]
    gravity_torque: Annotated[
        float, Number("N m", "believed largest gravity torque, 0 for none", None, -1.0e4, 1.0e4, follows=gravity)
    ]
    static_torque: Annotated[
        float, Number("N m", "believed static friction, 0 for none", None, 0.0, 1.0e4, follows="static_torque")
    ]
    friction_torque: Annotated[
        float, Number("N m", "believed friction in motion, 0 for none", None, 0.0, 1.0e4, follows="friction_torque")
    ]
    inertia: Annotated[
        float, Number("kg m^2", "believed inertia about the joint, 0 for none", None, 0.0, 1.0e3, follows=inertia)
    ]
    dead_band: BelievedBand


class _CascadeState(NamedTuple):
    """Cascade state: reference and angle of the previous sample [rad], their rates, observed load, requested torque.

    ``rate`` is the filtered rate of the angle and ``asked`` the rate of the reference [rad/s]; ``quickening`` is the
    filtered acceleration of the reference [rad/s^2]; ``started`` is the number of samples, 2 at most. ``load`` is the
    observed load [N m] without gravity and friction. ``breakaway`` is the torque [N m] that grows while the joint
    rests. ``asked_torque`` is the requested torque and ``lagged_torque`` the requested torque after the lag of the
    torque loop [N m]. The joint has been near the angle ``place`` [rad] for the time ``still`` [s]. ``is_held`` is 1
    while the joint rests within the tolerance, ``is_full`` is 1 while the valve is fully open.
    """

    reference: float = 0.0
    angle: float = 0.0
    rate: float = 0.0
    asked: float = 0.0
    quickening: float = 0.0
    started: float = 0.0
    load: float = 0.0
    breakaway: float = 0.0
    asked_torque: float = 0.0
    lagged_torque: float = 0.0
    place: float = 0.0
    still: float = 0.0
    is_held: float = 0.0
    is_full: float = 0.0


CREEP_ERROR = math.radians(1.0)
"""Angle error [rad] at which the breakaway torque grows at its nominal rate."""


def cascade_update(
    parameters: CascadeParameters,
    state: _CascadeState,
    reference: float,
    measurement: Measurement,
    period: float,
    *,
    parts: ErrorFunctions = OF_TORQUE,
) -> tuple[float, _CascadeState]:
    """Command u from -1 to 1 for an angle error e [rad] and the measured torque T [N m]:

        T_wanted = k_a e + d_a (rate of e) + load + breakaway + gravity + friction + inertia,    u = k_p (T_wanted - T)

    The load follows the joint torque less inertia times acceleration, with the time constant ``load_time``. The joint
    torque is the requested torque after the lag of the torque loop, or the measured torque while the valve is fully
    open. The part of the breakaway torque beyond the static friction is moved to the load.
    """
    error = reference - measurement.angle
    is_begun = min(state.started, 1.0)
    is_running = max(state.started - 1.0, 0.0)
    turned = (measurement.angle - state.angle) * is_begun
    rate = state.rate + (turned - period * state.rate) / (period + parameters.rate_filter)
    asked = (reference - state.reference) / period * is_begun
    # A rate of the reference has one before it from the third sample on.
    jerk = ((asked - state.asked) * is_running - period * state.quickening) / (
        period + SMOOTHING * parameters.rate_filter
    )
    quickening = state.quickening + jerk
    gravity = gravity_torque(measurement.angle, parameters.gravity_torque)

    # A rate from a coarse sensor comes in jumps: a joint rests that has not turned by the distance for long enough.
    has_turned = abs(measurement.angle - state.place) > parameters.rest_distance
    still = 0.0 if has_turned else state.still + period * is_begun
    moves = still * REST_RATE < parameters.rest_distance and state.started > 0.5
    # Once within the tolerance the joint may rest anywhere within twice that, but not drift.
    allowed = (1.0 + state.is_held) * parameters.tolerance
    rests_within = asked == 0.0 and abs(error) < allowed and not moves
    is_held = 1.0 if rests_within else 0.0

    acting = max(-parameters.error_limit, min(parameters.error_limit, error))
    # The rate at which the error would fade, by which a joint at rest is expected to move.
    fading = 2.0 * parameters.angle_stiffness / max(parameters.angle_damping, 1.0e-12) * acting
    friction = SHARE_OF_FRICTION * parameters.friction_torque * max(-1.0, min(1.0, (asked + fading) / SLOW))

    # At the first sample the joint is at rest, and its torque is the load.
    before = state.asked_torque if state.started > 0.5 else measurement.torque
    lagged = state.lagged_torque + (before - state.lagged_torque) * period / (period + parameters.torque_lag)
    lagged = measurement.torque if state.is_full > 0.5 or state.started < 0.5 else lagged
    is_observed = parameters.load_time > 0.0
    first_load = measurement.torque - gravity if is_observed else 0.0
    load_before = state.load if state.started > 0.5 else first_load
    slowness = max(parameters.load_time, period)
    learnt = (lagged - gravity - friction - state.breakaway - load_before) * period / slowness
    learnt = learnt - parameters.inertia * (rate - state.rate) / slowness
    speed = min(abs(error) / CREEP_ERROR, FASTEST_CREEP)
    creep = parameters.static_torque / (CREEP_LAGS * parameters.torque_lag) * speed * period
    creep = (creep if error > 0.0 else -creep) if abs(error) > parameters.tolerance and not moves else 0.0
    breakaway = 0.0 if moves else state.breakaway + creep
    is_beyond = abs(breakaway) > parameters.static_torque
    learnt = learnt + (creep if is_beyond and state.is_full < 0.5 else 0.0)
    breakaway = state.breakaway if is_beyond else breakaway
    load = load_before + (learnt if is_observed else 0.0)

    own = parameters.angle_stiffness * acting + parameters.angle_damping * (asked - rate)
    needed = load + breakaway + own + gravity + parameters.inertia * quickening + friction
    wanted = before if rests_within else needed
    unlimited = parameters.torque_gain * parts.steered(wanted - measurement.torque)
    command = beyond_dead_band(max(-1.0, min(1.0, unlimited)), parameters.dead_band)
    return command, _CascadeState(
        reference=reference,
        angle=measurement.angle,
        rate=rate,
        asked=asked,
        quickening=quickening,
        started=min(state.started + 1.0, 2.0),
        load=load_before if rests_within else load,
        breakaway=state.breakaway if rests_within else breakaway,
        asked_torque=wanted,
        lagged_torque=lagged,
        place=measurement.angle if has_turned else state.place,
        still=still,
        is_held=is_held,
        is_full=1.0 if abs(unlimited) >= 1.0 else 0.0,
    )


CASCADE = ControllerKind(
    name="cascade",
    summary="Holds an angle under load and friction: the torque that the joint needs, made by an inner torque loop.",
    source="disturbance observer: Ohnishi 1987; cascade: Bone and Ning 2007; gains by Skogestad 2003",
    quantities=quantities_of(CascadeParameters),
    parameters=CascadeParameters,
    initial=_CascadeState(),
    update=cascade_update,
    controls=(ANGLE,),
)
