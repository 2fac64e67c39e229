"""Pair of solenoid valves and a third one between the chambers, so that plantarflexion gas powers dorsiflexion.

When valve A (chamber 1) is de-energised and its flow leaves the source, the third valve opens for the joining time and
both valves of the pair are shut: gas flows from chamber 1 to chamber 2 until their pressures are equal, and the vane
moves freely. After the third valve closes, chamber 1 vents. If valve B is energised, chamber 2 keeps its gas for the
holding time, or until valve B is de-energised; then valve B fills it up from the supply. The third valve has the area
of the others. Without a joining time the valve is the pair of ``solenoid``.
"""

from dataclasses import replace
from typing import Annotated, NamedTuple

from ppafo.model.declaration import Number
from ppafo.model.plant import Openings, PlantParameters, SinglePort
from ppafo.model.valves import solenoid
from ppafo.model.valves.kind import JoiningPath, ValveKind, ValveModel
from ppafo.model.valves.solenoid import NEVER, SAME_INSTANT, Coil, PairPositions, PairState, TimedSolenoid


class _RecyclingSolenoid(NamedTuple):
    """Parameters of the pair, joining time of the chambers, and subsequent holding time of chamber 2 [s]."""

    pair: TimedSolenoid
    joining_time: float
    holding_time: float


class RecyclingState(NamedTuple):
    """Both coils, 1 while the chambers are joined, 1 while chamber 2 keeps its gas, and end times of both states [s].

    At the start the coils are off for long and the chambers are not joined.
    """

    pair: PairState = PairState()
    joined: float = 0.0
    keeps_gas: float = 0.0
    parting_time: float = NEVER
    release_time: float = NEVER


class _RecyclingPositions(NamedTuple):
    """Positions of both valves, 1 to the source, 0 to the atmosphere; ``joined`` and ``keeps_gas`` as in the state."""

    position_a: float
    position_b: float
    joined: float
    keeps_gas: float


def settle(valve: _RecyclingSolenoid, state: RecyclingState, command: float, time: float) -> RecyclingState:
    """State after the changes and commands that are due at ``time`` [s]."""
    pair = solenoid.settle_timed(valve.pair, state.pair, command, time)
    feeds_1, feeds_2 = pair.coil_a.position > 0.5, pair.coil_b.position > 0.5
    # The moment at which the flow of valve A, not its order, leaves the source.
    shuts = state.pair.coil_a.position > 0.5 and not feeds_1
    # A valve B that is switched off ends the hold at once: chamber 2 is then to vent.
    lets_go = state.keeps_gas > 0.5 and not feeds_2
    parting = time + valve.joining_time if shuts else state.parting_time
    release = parting + valve.holding_time if shuts else (time if lets_go else state.release_time)
    joins = parting > time + SAME_INSTANT and not feeds_1
    keeps_gas = release > time + SAME_INSTANT and feeds_2 and not joins
    return RecyclingState(
        pair=pair,
        joined=1.0 if joins else 0.0,
        keeps_gas=1.0 if keeps_gas else 0.0,
        parting_time=parting,
        release_time=release,
    )


def next_event(valve: _RecyclingSolenoid, state: RecyclingState, command: float, time: float) -> float:
    """Time [s] of the next event: a coil accepts a command, a flow changes, joining or holding ends; huge for never."""
    event = solenoid.next_timed_event(valve.pair, state.pair, command, time)
    event = min(event, state.release_time) if state.keeps_gas > 0.5 else event
    return min(event, state.parting_time) if state.joined > 0.5 else event


def advance(
    valve: _RecyclingSolenoid, state: RecyclingState, command: float, time: float, step: float
) -> tuple[_RecyclingPositions, RecyclingState]:
    """Positions [-] during one part [s] of a step, after all changes that are due at its start, and the state."""
    settled = settle(valve, state, command, time)
    pair = settled.pair
    shown = _RecyclingPositions(
        position_a=pair.coil_a.position,
        position_b=pair.coil_b.position,
        joined=settled.joined,
        keeps_gas=settled.keeps_gas,
    )
    return shown, settled


def connect(plant: PlantParameters, shown: _RecyclingPositions) -> tuple[SinglePort, SinglePort]:
    """Ports of both chambers: shut while joined, and chamber 2's also while it keeps its gas. Equation (8)."""
    port_1, port_2 = solenoid.connect_positions(plant, PairPositions(shown.position_a, shown.position_b))
    share_1 = 1.0 - shown.joined
    share_2 = share_1 * (1.0 - shown.keeps_gas)
    return (
        SinglePort(
            conductance=share_1 * port_1.conductance,
            node_pressure=port_1.node_pressure,
            source_fraction=port_1.source_fraction,
            is_relieving=port_1.is_relieving,
        ),
        SinglePort(
            conductance=share_2 * port_2.conductance,
            node_pressure=port_2.node_pressure,
            source_fraction=port_2.source_fraction,
            is_relieving=port_2.is_relieving,
        ),
    )


def joined_opening(shown: _RecyclingPositions) -> float:
    """Opening [-] between the chambers during a step."""
    return shown.joined


def instant(valve: _RecyclingSolenoid, state: RecyclingState, command: float) -> Openings:
    """Openings [-] of the pair at an instant."""
    pair = solenoid.instant_timed(valve.pair, state.pair, command)
    share_1 = 1.0 - state.joined
    share_2 = share_1 * (1.0 - state.keeps_gas)
    return Openings(
        source_1=share_1 * pair.source_1,
        vent_1=share_1 * pair.vent_1,
        source_2=share_2 * pair.source_2,
        vent_2=share_2 * pair.vent_2,
    )


def joined_at_instant(valve: _RecyclingSolenoid, state: RecyclingState, command: float) -> float:
    """Opening [-] between the chambers at an instant."""
    return state.joined


def rates(valve: _RecyclingSolenoid, state: RecyclingState, command: float) -> RecyclingState:
    """Rates [1/s] of the state, which are 0 between two events."""
    still = Coil(position=0.0, target=0.0, accepted_time=0.0, change_time=0.0)
    return RecyclingState(PairState(still, still), joined=0.0, keeps_gas=0.0, parting_time=0.0, release_time=0.0)


class RecyclingSettings(NamedTuple):
    """Settings: delays of the pair, joining time of the chambers, and holding time of chamber 2."""

    opening_delay: solenoid.OpeningDelay
    closing_delay: solenoid.ClosingDelay
    switching_interval: solenoid.SwitchingInterval
    joining_time: Annotated[
        float, Number("s", "time for which the chambers stay joined after plantarflexion", 0.06, 0.0, 1.0)
    ]
    holding_time: Annotated[
        float, Number("s", "time for which chamber 2 then stays closed, without feeding from the source", 0.0, 0.0, 1.0)
    ]


def prepare(settings: RecyclingSettings) -> _RecyclingSolenoid:
    """Parameters [s] from ``settings`` [SI]."""
    return _RecyclingSolenoid(solenoid.prepare_timed(settings), settings.joining_time, settings.holding_time)


MODEL = replace(
    solenoid.TIMED,
    parameters=_RecyclingSolenoid,
    state=RecyclingState,
    prepare=prepare,
    initial=RecyclingState,
    shown=_RecyclingPositions,
    advance=advance,
    connect=connect,
    instant=instant,
    rates=rates,
    next_event=next_event,
    settle=settle,
    joint=JoiningPath(joined_opening, joined_at_instant),
)


def choose(_settings: RecyclingSettings) -> ValveModel:
    """Return the only model of this valve."""
    return MODEL


KIND = ValveKind(
    name="solenoid_recycling",
    summary="Two on/off valves and a third one that joins the chambers for a time after chamber 1 was fed.",
    settings=RecyclingSettings,
    choose=choose,
    lag=solenoid.lag,
    vents_at_rest=True,
)
