"""Ice at the exhaust of the valve: moisture freezes in the cold gas, which narrows the exhaust, and melts again."""

from typing import Annotated, Any, NamedTuple

from ppafo.model.declaration import Number
from ppafo.model.effects.kind import Effect, PlantSnapshot, State
from ppafo.model.ports import exhaust_path
from ppafo.model.sensors import decay_factors


class Ice(NamedTuple):
    """Blockage per exhausted gas [1/kg], and melting rate [1/s]."""

    blockage_per_gas: float
    melting: float


class IceState(NamedTuple):
    """Blockage [-], 0 at the start; the exhaust conductance is divided by 1 + blockage."""

    blockage: float = 0.0


class _IceSettings(NamedTuple):
    """Settings of ice in the exhaust: growth and melting."""

    blockage_per_gas: Annotated[float, Number("1/kg", "blockage per gas that leaves, 0 for none", 0.0, 0.0, 1.0e6)]
    melting_time: Annotated[float, Number("s", "time constant of melting", 30.0, 1.0e-3, 1.0e6)]


def prepare(settings: _IceSettings, _device: Any) -> Ice:
    """Growth and melting rates of ice."""
    return Ice(blockage_per_gas=settings.blockage_per_gas, melting=1.0 / settings.melting_time)


def iced_path(conductance: float, ice_state: IceState) -> float:
    """Conductance [kg/(s Pa)] of the exhaust path with ice; ``C / (1 + s)``."""
    # A stage of a step extrapolates the state, below 0 too.
    return exhaust_path(conductance / (1.0 + max(ice_state.blockage, 0.0)))


def advance(ice: Ice, ice_state: IceState, _before: PlantSnapshot, after: PlantSnapshot, step: float) -> IceState:
    """Blockage [-] after a step [s] with the mean flow of the step: ``ds/dt = g m' - s / tau``, solved exactly."""
    # Only gas that leaves grows ice; what flows in from the atmosphere does not melt it either.
    kept, mean = decay_factors(ice.melting, step)
    return IceState(kept * ice_state.blockage + step * mean * ice.blockage_per_gas * max(after.vented_flow, 0.0))


def slopes(ice: Ice, ice_state: IceState, now: PlantSnapshot) -> IceState:
    """Rate of the blockage [1/s]."""
    # The same balance as in ``advance``, for the solver in continuous time.
    return IceState(ice.blockage_per_gas * max(now.vented_flow, 0.0) - ice.melting * ice_state.blockage)


EFFECT = Effect(
    name="ice",
    summary="Ice at the exhaust of the valve, which grows with the gas that leaves and melts.",
    settings=_IceSettings,
    parameters=Ice,
    prepare=prepare,
    switch=("blockage_per_gas",),
    laws={exhaust_path: iced_path},
    source="assumed: the simplest balance of growth and melting, to be fitted to a valve",
    equation="C = C_v / (1 + s), ds/dt = g m'_out - s / tau",
    symbols=(
        ("g", "blockage_per_gas", "1/kg", "blockage of the exhaust by ice per gas that leaves"),
        ("1/tau", "melting", "1/s", "rate at which ice at the exhaust melts"),
        ("s", "blockage", "-", "blockage of the exhaust by ice"),
    ),
    state=State(row=IceState, start=None, advance=advance, slopes=slopes, tolerances=(1.0e-4,)),
)
