"""Chambers that a valve joins with each other: the leak between them is as wide as that valve stands open."""

from ppafo.model.orifice import FlowCurve
from ppafo.model.plant import PlantParameters


def plant_with_joined_chambers(plant: PlantParameters, opening: float) -> PlantParameters:
    """The plant whose vane leak has a valve beside it that joins both chambers, open by ``opening`` [-], 0 to 1.

    Both openings follow the mean of their flow curves by conductance: exact where these have the same ratios.
    """
    joining = opening * plant.valve_conductance
    conductance = plant.leak_conductance + joining
    share = joining / max(conductance, 1.0e-30)
    curve = mean_curve(plant.leak_curve, plant.valve_curve, share)
    return plant._replace(leak_conductance=conductance, leak_curve=curve)


def mean_curve(first: FlowCurve, second: FlowCurve, share: float) -> FlowCurve:
    """The flow curve of two orifices side by side, of whose conductance the second has ``share`` [-]."""
    a, b = first.coefficients, second.coefficients
    return FlowCurve(
        critical_ratio=first.critical_ratio + share * (second.critical_ratio - first.critical_ratio),
        linear_ratio=first.linear_ratio + share * (second.linear_ratio - first.linear_ratio),
        linear_slope=first.linear_slope + share * (second.linear_slope - first.linear_slope),
        coefficients=(
            a[0] + share * (b[0] - a[0]),
            a[1] + share * (b[1] - a[1]),
            a[2] + share * (b[2] - a[2]),
            a[3] + share * (b[3] - a[3]),
            a[4] + share * (b[4] - a[4]),
            a[5] + share * (b[5] - a[5]),
            a[6] + share * (b[6] - a[6]),
        ),
    )
