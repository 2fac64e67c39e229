"""Regulators and lines at the start of a run: most scenarios have constant supply pressures and load none of this."""

from ppafo.model.plant import PlantParameters, chamber_mass
from ppafo.model.regulator import LineState, SupplyLines


def lines_at_start(plant: PlantParameters, lines: SupplyLines) -> LineState:
    """Both lines at the pressures that their regulators are set to, and nothing let through yet."""
    return LineState(
        mass_1=chamber_mass(plant.supply_pressure, lines.volume_1, plant.gas_product),
        mass_2=chamber_mass(plant.dorsiflexion_pressure, lines.volume_2, plant.gas_product),
        regulated_mass=0.0,
    )
