"""Regulators and lines at the start of a run: most scenarios have constant supply pressures and load none of this."""

from ppafo.engine.run import Lines
from ppafo.model.plant import PlantParameters, chamber_mass
from ppafo.model.regulator import LineState, SupplyLines


def lines_at_start(plant: PlantParameters, lines: SupplyLines) -> LineState:
    """Both lines at the pressures that their regulators are set to, and nothing let through yet."""
    return LineState(
        mass_1=chamber_mass(plant.supply_pressure, lines.volume_1, plant.gas_product),
        mass_2=chamber_mass(plant.dorsiflexion_pressure, lines.volume_2, plant.gas_product),
        regulated_mass=0.0,
    )


def initial_lines(plant: PlantParameters, lines: SupplyLines) -> Lines:
    """The lines of a run, both at the pressures that their regulators are set to."""
    return Lines(lines, lines_at_start(plant, lines))
