"""Gas of the plantarflexion chamber used again for dorsiflexion, by way of a reservoir.

One cycle: the chamber that has pushed off is joined with the reservoir until their pressures are equal, then vents
the rest; the other chamber, which holds gas at atmospheric pressure, is joined with the reservoir, takes what that
gives up to the pressure that it needs, and gets the rest from the source. Check valves keep gas from flowing back.
Isothermal ideal gas, openings wide enough for the pressures to become equal, no leak. All pressures are absolute.
"""

from typing import NamedTuple


class ReuseCycle(NamedTuple):
    """What a cycle works between: pressures [Pa] of push-off, of dorsiflexion and outside, and volumes [m^3].

    ``exhaust_volume`` is that of the plantarflexion chamber when it vents, ``fill_volume`` that of the other chamber
    when it is filled; ``gas_product`` is R T/M [J/kg].
    """

    exhaust_pressure: float
    fill_pressure: float
    atmospheric_pressure: float
    exhaust_volume: float
    fill_volume: float
    reservoir_volume: float
    gas_product: float


class ReuseBalance(NamedTuple):
    """Masses [kg] of one cycle, and the reservoir's pressure [Pa] before the exhaust comes and after."""

    exhausted_mass: float
    caught_mass: float
    returned_mass: float
    topped_up_mass: float
    pressure_before: float
    pressure_after: float


def equalised_pressure(pressure_a: float, volume_a: float, pressure_b: float, volume_b: float) -> float:
    """Pressure [Pa] of two volumes [m^3] after they were joined, isothermal; equation (3)."""
    return (pressure_a * volume_a + pressure_b * volume_b) / (volume_a + volume_b)


def reuse_cycle(cycle: ReuseCycle, reservoir_pressure: float) -> tuple[ReuseBalance, float]:
    """Masses of one cycle that begins with a pressure [Pa] in the reservoir, and the pressure at its end."""
    outside = cycle.atmospheric_pressure
    caught_at = reservoir_pressure
    if cycle.exhaust_pressure > reservoir_pressure:
        caught_at = equalised_pressure(
            cycle.exhaust_pressure, cycle.exhaust_volume, reservoir_pressure, cycle.reservoir_volume
        )
    filled_to = outside
    if caught_at > outside and cycle.reservoir_volume > 0.0:
        filled_to = equalised_pressure(caught_at, cycle.reservoir_volume, outside, cycle.fill_volume)
    filled_to = min(filled_to, max(cycle.fill_pressure, outside))
    returned = (filled_to - outside) * cycle.fill_volume
    left = caught_at - returned / cycle.reservoir_volume if cycle.reservoir_volume > 0.0 else outside
    balance = ReuseBalance(
        exhausted_mass=(cycle.exhaust_pressure - outside) * cycle.exhaust_volume / cycle.gas_product,
        caught_mass=(caught_at - reservoir_pressure) * cycle.reservoir_volume / cycle.gas_product,
        returned_mass=returned / cycle.gas_product,
        topped_up_mass=(max(cycle.fill_pressure, outside) - filled_to) * cycle.fill_volume / cycle.gas_product,
        pressure_before=reservoir_pressure,
        pressure_after=caught_at,
    )
    return balance, left


def steady_reservoir_pressure(cycle: ReuseCycle) -> float:
    """Pressure [Pa] to which a reservoir settles before each exhaust: where it gives back all that it catches.

    Either the reservoir and the filled chamber end at one pressure, or that would be above what the chamber needs and
    the chamber takes just this much.
    """
    outside, store = cycle.atmospheric_pressure, cycle.reservoir_volume
    exhaust, fill = cycle.exhaust_volume, cycle.fill_volume
    if cycle.exhaust_pressure <= outside or store <= 0.0:
        return outside
    shared = store * exhaust * cycle.exhaust_pressure + outside * fill * (exhaust + store)
    settled = shared / (store * exhaust + fill * exhaust + fill * store)
    if settled <= cycle.fill_pressure:
        return settled
    wanted = (cycle.fill_pressure - outside) * fill
    return cycle.exhaust_pressure - wanted * (1.0 / exhaust + 1.0 / store)


def reuse_balance(cycle: ReuseCycle) -> ReuseBalance:
    """Masses [kg] of one cycle after many: what is caught is given back, and ``returned_mass`` is saved."""
    return reuse_cycle(cycle, steady_reservoir_pressure(cycle))[0]
