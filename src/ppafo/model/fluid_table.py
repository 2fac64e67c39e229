"""Properties of a real fluid read from a table: its gas, and where it has one its liquid at the same pressure.

The table is over temperature and, for the gas, over the fraction of the densest gas that it holds at that temperature:
saturated vapour where there is a liquid, else a fixed density. Between the nodes all columns run straight, so nothing
overshoots. Whoever makes the table says where its numbers come from.
"""

from bisect import bisect_right
from typing import NamedTuple

Column = tuple[float, ...]
Nodes = tuple[int, float]
"""Number of the node below a place, and the fraction of the way to the next."""

_HALVINGS = 80


class FluidTable(NamedTuple):
    """Nodes of a fluid: ``temperatures`` [K], ``fractions`` of the densest gas [-] from 0 to 1, and values at them.

    By temperature: ``densest`` gas [kg/m^3], ``liquid_densities`` [kg/m^3] and ``liquid_energies`` [J/kg], both empty
    for a fluid without liquid here. By temperature and share: ``factors`` P/(rho R T) [-], ``energies`` [J/kg].
    """

    gas_constant: float
    temperatures: Column
    fractions: Column
    densest: Column
    liquid_densities: Column
    liquid_energies: Column
    factors: tuple[Column, ...]
    energies: tuple[Column, ...]


def has_liquid(table: FluidTable) -> bool:
    """Tell whether the densest gas of the table is vapour over liquid."""
    return bool(table.liquid_densities)


def densest_gas(table: FluidTable, temperature: float) -> float:
    """Density [kg/m^3] of the densest gas at a temperature [K]: saturated vapour where the fluid has a liquid."""
    return between(table.densest, nodes_around(table, temperature))


def liquid_density(table: FluidTable, temperature: float) -> float:
    """Density [kg/m^3] of the liquid under its own vapour at a temperature [K]."""
    return between(table.liquid_densities, nodes_around(table, temperature))


def fluid_pressure(table: FluidTable, temperature: float, density: float) -> float:
    """Absolute pressure [Pa] of gas at a density [kg/m^3]; above the densest gas there is, that gas's pressure."""
    nodes = nodes_around(table, temperature)
    held = min(density, between(table.densest, nodes))
    factor = across(table.factors, table, nodes, density)
    return factor * held * table.gas_constant * temperature


def gas_density(table: FluidTable, temperature: float, pressure: float) -> float:
    """Density [kg/m^3] of gas at a temperature [K] and an absolute pressure [Pa], by halving; at most the densest."""
    low, high = 0.0, densest_gas(table, temperature)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if fluid_pressure(table, temperature, middle) < pressure:
            low = middle
        else:
            high = middle
    return high


def gas_specific_energy(table: FluidTable, temperature: float, density: float) -> float:
    """Specific internal energy [J/kg] of gas at a density [kg/m^3], at most that of the densest gas there is."""
    return across(table.energies, table, nodes_around(table, temperature), density)


def nodes_around(table: FluidTable, temperature: float) -> Nodes:
    """Place of a temperature [K] among those of the table; the ends of the table hold outside it."""
    return _place(table.temperatures, temperature)


def across(rows: tuple[Column, ...], table: FluidTable, nodes: Nodes, density: float) -> float:
    """Value of some rows at a place among the temperatures and a density [kg/m^3], straight in both.

    What runs straight is the fraction of the densest gas.
    """
    index, weight = nodes
    fraction = min(density / between(table.densest, nodes), 1.0)
    place = _place(table.fractions, fraction)
    return (1.0 - weight) * between(rows[index], place) + weight * between(rows[index + 1], place)


def between(column: Column, nodes: Nodes) -> float:
    """Value of a column at a place among its nodes, in its own unit."""
    index, weight = nodes
    return (1.0 - weight) * column[index] + weight * column[index + 1]


def _place(nodes: Column, at: float) -> Nodes:
    index = min(max(bisect_right(nodes, at) - 1, 0), len(nodes) - 2)
    weight = (at - nodes[index]) / (nodes[index + 1] - nodes[index])
    return index, min(max(weight, 0.0), 1.0)
