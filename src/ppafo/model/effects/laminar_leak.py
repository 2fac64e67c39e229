"""Laminar leak parallel to the orifice between the chambers: a long, narrow gap along the lip of a seal."""

from typing import Annotated, NamedTuple

from ppafo.model.declaration import Number
from ppafo.model.effects.kind import Effect
from ppafo.model.orifice import FlowCurve, fitted_flow_function
from ppafo.model.ports import leakage_path


class LaminarLeak(NamedTuple):
    """Coefficient [kg/(s Pa^2)] of the laminar flow through the gap."""

    coefficient: Annotated[
        float, Number("kg/(s Pa^2)", "laminar leak between the chambers: flow over P_1^2 - P_2^2", 0.0, 0.0, 1.0e-12)
    ]


def leak_with_gap(
    conductance: float, pressure_1: float, pressure_2: float, curve: FlowCurve, laminar_leak: LaminarLeak
) -> float:
    """Equivalent conductance [kg/(s Pa)] of the leak orifice with a parallel gap, whose flow is ``c (P_1^2 - P_2^2)``.

    The flow of an orifice is ``C P_up psi(r)``, so that the gap adds ``c (P_up + P_dn) (1 - r) / psi(r)`` to ``C``.
    Near equal pressures both 1 - r and psi are linear and go to zero; their quotient is the one at the end of the
    linear region.
    """
    upstream = max(pressure_1, pressure_2)
    downstream = min(pressure_1, pressure_2)
    ratio = min(downstream / upstream, curve.linear_ratio)
    function, _ = fitted_flow_function(ratio, curve)
    gap = laminar_leak.coefficient * (upstream + downstream) * (1.0 - ratio) / function
    return leakage_path(conductance, pressure_1, pressure_2, curve) + gap


EFFECT = Effect(
    name="laminar_leak",
    summary="A laminar gap beside the leak between the chambers.",
    settings=LaminarLeak,
    parameters=LaminarLeak,
    prepare=None,
    switch=("coefficient",),
    laws={leakage_path: leak_with_gap},
    source="isothermal laminar flow of an ideal gas through a gap (Hagen-Poiseuille); identified by vane-leak",
    equation="m_l = C_l P_up psi(r) + c_l (P_1^2 - P_2^2)",
    symbols=(("c_l", "coefficient", "kg/(s Pa^2)", "laminar leak between the chambers over P_1^2 - P_2^2"),),
)
