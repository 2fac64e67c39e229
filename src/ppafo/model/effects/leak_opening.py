"""A leak that opens: below some pressure between the chambers the seal of the vane is tight."""

from typing import Any, NamedTuple

from ppafo.model.declaration import Quantity
from ppafo.model.effects.kind import Effect
from ppafo.model.places import way_across


class LeakOpening(NamedTuple):
    """Pressure between the chambers at which the leak begins [Pa], above 0."""

    opening_pressure: float


def prepare(settings: Any, _device: Any) -> LeakOpening:
    """The row of the setting."""
    return LeakOpening(settings["pressure"])


def lifted(conductance: float, pressure_1: float, pressure_2: float, leak_opening: LeakOpening) -> float:
    """Conductance [kg/(s Pa)] of the leak: ``C (1 - P_o / |P_1 - P_2|)``, and 0 below ``P_o``.

    The gas lifts the lip of a seal against its preload, in either direction. The flow begins without a jump, and far
    above the opening pressure the leak is that of its orifice.
    """
    opening = leak_opening.opening_pressure
    share = 1.0 - opening / max(abs(pressure_1 - pressure_2), opening)
    return way_across(conductance * share, pressure_1, pressure_2)


EFFECT = Effect(
    name="leak_opening",
    summary="A leak between the chambers that opens at a pressure.",
    quantities=(
        Quantity(
            "pressure", "Pa_d", "pressure between chambers at which the leak opens, 0 for always", 0.0, 0.0, 1.0e7
        ),
    ),
    parameters=LeakOpening,
    prepare=prepare,
    switch=("pressure",),
    laws={way_across: lifted},
    source="assumed: a lip that the gas lifts against a constant preload, to be fitted to an actuator",
    equation="C = C_l max(0, 1 - P_o / |P_1 - P_2|)",
    symbols=(("P_o", "opening_pressure", "Pa", "pressure between the chambers at which the leak opens"),),
)
