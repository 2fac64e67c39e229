"""Leak with an opening pressure: below this pressure difference the seal of the vane is tight."""

from typing import Annotated, NamedTuple

from ppafo.model.declaration import Number
from ppafo.model.effects.kind import Effect
from ppafo.model.orifice import FlowCurve
from ppafo.model.ports import leakage_path


class LeakOpening(NamedTuple):
    """Pressure difference between the chambers at which the leak opens [Pa], above 0, and relative rise width [-]."""

    opening_pressure: float
    opening_rise: float


class _LeakSettings(NamedTuple):
    """Settings of a leak past the vane with an opening pressure and a gradual rise."""

    pressure: Annotated[
        float, Number("Pa_d", "pressure between chambers at which the leak opens, 0 for always", 0.0, 0.0, 1.0e7)
    ]
    rise: Annotated[
        float,
        Number(
            "", "excess pressure at which half of the leak is open, relative to the opening pressure", 1.0, 0.01, 100.0
        ),
    ]


def lifted_leak(
    conductance: float, pressure_1: float, pressure_2: float, curve: FlowCurve, leak_opening: LeakOpening
) -> float:
    """Conductance [kg/(s Pa)] of the leak: ``C e / (e + w P_o)`` with ``e = |P_1 - P_2| - P_o``, and 0 below ``P_o``.

    The gas lifts the lip of a seal against its preload, in either direction. The flow starts without a jump, is half of
    the flow of the orifice at ``w P_o`` above the opening pressure ``P_o``, and approaches it far above.
    """
    opening, rise = leak_opening.opening_pressure, leak_opening.opening_rise
    # e / (e + w P_o) written as 1 - w P_o / (e + w P_o), whose divisor is never 0, and whose sign shuts the leak below
    # P_o.
    above = max(abs(pressure_1 - pressure_2), opening) + (rise - 1.0) * opening
    share = max(1.0 - rise * opening / above, 0.0)
    return leakage_path(conductance * share, pressure_1, pressure_2, curve)


EFFECT = Effect(
    name="leak_opening",
    summary="A leak between the chambers that opens at a pressure.",
    settings=_LeakSettings,
    parameters=LeakOpening,
    prepare=None,
    switch=("pressure",),
    laws={leakage_path: lifted_leak},
    source="assumed: a lip that the gas lifts against a constant preload, to be fitted to an actuator",
    equation="C = C_l e / (e + w P_o), e = max(0, |P_1 - P_2| - P_o)",
    symbols=(
        ("P_o", "opening_pressure", "Pa", "pressure between the chambers at which the leak opens"),
        (
            "w",
            "opening_rise",
            "-",
            "excess pressure at which half of the leak is open, relative to the pressure at which it opens",
        ),
    ),
)
