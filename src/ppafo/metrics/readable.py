"""What metrics are read from in a program: totals of its gas, and the channels that its runs have."""

from typing import NamedTuple

from ppafo.engine.program import Program
from ppafo.metrics.gas import ENERGIES
from ppafo.metrics.metric import MetricKind
from ppafo.model.declaration import PlainFunction
from ppafo.model.gas import energy_per_content
from ppafo.model.plant import PlantParameters, PlantState, ThermalParameters, ThermalState, TrueMasses

WITH_ENERGY_BALANCE = frozenset({"temperature_1", "temperature_2", *ENERGIES})


class Totals(NamedTuple):
    """Gas in the chambers and totals of it [kg] since the start of a run."""

    supplied_mass: float
    vented_mass: float
    leaked_mass: float
    mass_1: float
    mass_2: float


class ThermalTotals(NamedTuple):
    """Totals of gas with an energy balance since the start of a run: true masses [kg], and its energies [J]."""

    supplied_mass: float
    vented_mass: float
    leaked_mass: float
    mass_1: float
    mass_2: float
    gas_energy: float
    supplied_enthalpy: float
    vented_enthalpy: float
    wall_heat: float
    gas_work: float


def totals(state: PlantState) -> Totals:
    """Gas [kg] of a state; its numbers may be arrays (runs,)."""
    return Totals(
        supplied_mass=state.supplied_mass,
        vented_mass=state.vented_mass,
        leaked_mass=state.leaked_mass,
        mass_1=state.mass_1,
        mass_2=state.mass_2,
    )


def real_totals(state: PlantState, masses: TrueMasses) -> Totals:
    """Gas [kg] of a state that is not ideal; its numbers may be arrays (runs,)."""
    return Totals(
        supplied_mass=state.supplied_mass,
        vented_mass=state.vented_mass,
        leaked_mass=state.leaked_mass,
        mass_1=masses.mass_1,
        mass_2=masses.mass_2,
    )


def thermal_totals(
    state: PlantState, masses: ThermalState, plant: PlantParameters, thermal: ThermalParameters
) -> ThermalTotals:
    """Gas [kg] and energies [J] of a state with an energy balance; numbers may be arrays (runs,)."""
    per_content = energy_per_content(plant.gas_product, thermal.heat_capacity_ratio)
    return ThermalTotals(
        supplied_mass=state.supplied_mass,
        vented_mass=state.vented_mass,
        leaked_mass=state.leaked_mass,
        mass_1=masses.mass_1,
        mass_2=masses.mass_2,
        gas_energy=per_content * (state.mass_1 + state.mass_2),
        supplied_enthalpy=per_content * masses.supplied_content,
        vented_enthalpy=per_content * masses.vented_content,
        wall_heat=per_content * masses.heat_content,
        gas_work=masses.gas_work,
    )


class TotalsKind(NamedTuple):
    """How the totals of a program's gas are made: the row, the function, and the groups that it takes after the state.

    ``states`` are groups of states that it is given, ``parameters`` groups of parameters after those; ``missing`` are
    channels that runs of such a gas have not.
    """

    row: type[Totals] | type[ThermalTotals]
    function: PlainFunction
    states: tuple[str, ...] = ()
    parameters: tuple[str, ...] = ()
    missing: frozenset[str] = WITH_ENERGY_BALANCE


_TOTALS: dict[type | None, TotalsKind] = {
    None: TotalsKind(Totals, totals),
    # Totals of a gas that is not ideal count true masses.
    TrueMasses: TotalsKind(Totals, real_totals, ("masses",)),
    ThermalState: TotalsKind(
        row=ThermalTotals,
        function=thermal_totals,
        states=("masses",),
        parameters=("plant", "thermal"),
        missing=frozenset(),
    ),
}
"""Totals by the row in which a gas keeps what is no number of the plant's state."""


def totals_kind(program: Program) -> TotalsKind:
    """How the totals of the gas of a program are made."""
    return _TOTALS[program.state_rows().get("masses")]


def has_channels(program: Program, kind: MetricKind) -> bool:
    """True where runs of a program have the channels of a metric, and what else it needs."""
    return (
        totals_kind(program).missing.isdisjoint(kind.channels)
        and kind.of_reference in ("", program.followed)
        and program.offers.issuperset(kind.needs)
    )
