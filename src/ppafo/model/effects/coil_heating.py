"""Heating of solenoid coils that are on: a hot coil has more resistance, and opens its valve later."""

from typing import Annotated, Any, NamedTuple

from ppafo.model.declaration import Number
from ppafo.model.effects.kind import Effect, PlantSnapshot, State
from ppafo.model.elementary import logarithm
from ppafo.model.ports import opening_time
from ppafo.model.sensors import decay_factors
from ppafo.model.valves.solenoid import coil_commands

COPPER = 3.93e-3
"""Temperature coefficient of the resistance of copper at 20 degC [1/K]."""


class _CoilHeating(NamedTuple):
    """Steady temperature rise of a coil that is always on [K], its rate [1/s], coefficients of the opening time.

    The opening time relative to a cold coil is ``1 + slowing x + slowing_squared x^2`` for a rise of ``x`` [K].
    """

    steady_rise: float
    warming: float
    slowing: float
    slowing_squared: float


class CoilRises(NamedTuple):
    """Temperature rises of both coils over the room [K]; 0 at the start."""

    rise_a: float = 0.0
    rise_b: float = 0.0


def relative_opening_time(rise: float, pull_in_share: float) -> float:
    """Opening time of a coil relative to a cold one [-], at a temperature rise [K].

    The current in a coil rises as ``i = u/R (1 - exp(-R t/L))`` to the pull-in current, which is a fraction ``q`` of
    the cold coil's steady current: ``t/t_0 = ln(1 - q r) / (r ln(1 - q))`` with ``r = R/R_0 = 1 + alpha x``.
    """
    ratio = 1.0 + COPPER * rise
    return logarithm(1.0 - pull_in_share * ratio) / (ratio * logarithm(1.0 - pull_in_share))


class CoilSettings(NamedTuple):
    """Settings of a coil: temperature rise, time constant, and pull-in current of the valve."""

    steady_rise: Annotated[
        float, Number("K", "rise of temperature of a coil that is always on, 0 for none", 0.0, 0.0, 100.0)
    ]
    time_constant: Annotated[
        float, Number("s", "time constant with which a coil warms and cools", 300.0, 1.0e-3, 1.0e6)
    ]
    pull_in_share: Annotated[
        float, Number("", "current that lifts the valve, relative to the final current of a cold coil", 0.5, 0.01, 0.6)
    ]


def prepare(settings: CoilSettings, _device: Any) -> _CoilHeating:
    """Parameters from the settings; a parabola is fitted through a cold, a half warm and a hot coil.

    The parabola is within 0.6 % of the formula for every allowed rise and share, and avoids a logarithm in each step.
    """
    # A parabola through three points of the formula, exact at no rise, half and full rise.
    steady, share = settings.steady_rise, settings.pull_in_share
    half, full = relative_opening_time(0.5 * steady, share) - 1.0, relative_opening_time(steady, share) - 1.0
    # Without a rise both differences are 0, and so is the parabola.
    whole = max(steady, 1.0e-30)
    return _CoilHeating(
        steady_rise=steady,
        warming=1.0 / settings.time_constant,
        slowing=(4.0 * half - full) / whole,
        slowing_squared=2.0 * (full - 2.0 * half) / (whole * whole),
    )


def warm_opening_time(
    time: float, is_coil_a: float, coil_heating: _CoilHeating, coil_heating_state: CoilRises
) -> float:
    """Time [s] from energising to flow at the present coil temperature."""
    rise = coil_heating_state.rise_a if is_coil_a > 0.5 else coil_heating_state.rise_b
    return opening_time(time, is_coil_a) * (1.0 + rise * (coil_heating.slowing + rise * coil_heating.slowing_squared))


def advance(
    coil_heating: _CoilHeating, coil_heating_state: CoilRises, _before: PlantSnapshot, after: PlantSnapshot, step: float
) -> CoilRises:
    """Temperature rises [K] after a step [s] with one command: ``dx/dt = (x_s on - x) / tau``, solved exactly."""
    on_a, on_b = coil_commands(after.command)
    kept, mean = decay_factors(coil_heating.warming, step)
    gained = step * mean * coil_heating.warming * coil_heating.steady_rise
    return CoilRises(
        rise_a=kept * coil_heating_state.rise_a + gained * on_a, rise_b=kept * coil_heating_state.rise_b + gained * on_b
    )


def slopes(coil_heating: _CoilHeating, coil_heating_state: CoilRises, now: PlantSnapshot) -> CoilRises:
    """Rates [K/s] of the temperature rises of both coils."""
    on_a, on_b = coil_commands(now.command)
    return CoilRises(
        rise_a=coil_heating.warming * (coil_heating.steady_rise * on_a - coil_heating_state.rise_a),
        rise_b=coil_heating.warming * (coil_heating.steady_rise * on_b - coil_heating_state.rise_b),
    )


EFFECT = Effect(
    name="coil_heating",
    summary="Coils of solenoid valves that warm while they are on, and then lift their valves later.",
    settings=CoilSettings,
    parameters=_CoilHeating,
    prepare=prepare,
    switch=("steady_rise",),
    laws={opening_time: warm_opening_time},
    source="a coil at constant voltage, R L in series; resistance of copper, IEC 60034-1",
    equation="t/t_0 = ln(1 - q r) / (r ln(1 - q)), r = 1 + alpha x, dx/dt = (x_s on - x) / tau",
    symbols=(
        ("x_s", "steady_rise", "K", "rise of temperature of a coil that is always on"),
        ("1/tau", "warming", "1/s", "rate at which a coil warms and cools"),
        ("-", "slowing", "1/K", "linear coefficient of relative opening time over coil temperature rise"),
        ("-", "slowing_squared", "1/K^2", "quadratic coefficient of relative opening time over coil temperature rise"),
        ("x", "rise`, `rise_a`, `rise_b", "K", "temperature rise of a coil, and of both coils"),
        ("q", "pull_in_share", "-", "current that lifts a valve, relative to the final current of a cold coil"),
        ("-", "is_coil_a", "-", "1 for the coil of chamber 1, 0 for chamber 2's"),
    ),
    state=State(row=CoilRises, start=None, advance=advance, slopes=slopes),
)
