"""The leak in the form in which a set has it: an area with its discharge coefficient, or C and b of ISO 6358."""

from dataclasses import dataclass

from ppafo.identification.bench.evidence import Number
from ppafo.identification.bench.gas_flow import GasAt, iso6358_shape, orifice_shape
from ppafo.identification.bench.leak_laws import Law

AREA_PATH, SONIC_PATH = "actuator.leak.area", "actuator.leak.sonic_conductance"


@dataclass(frozen=True, slots=True)
class Opening:
    """The gas, and what the set has: Cd [-] for an area, or b [-] for a sonic conductance; neither where it is bare."""

    gas: GasAt
    discharge_coefficient: float | None = None
    critical_ratio: float | None = None

    @property
    def path(self) -> str:
        """Where a set keeps the size of the leak."""
        return AREA_PATH if self.critical_ratio is None else SONIC_PATH

    @property
    def unit(self) -> str:
        """SI unit of that."""
        return "m^2" if self.critical_ratio is None else "m^3/(s Pa)"

    def law(self) -> Law:
        """Return the law of flow through the opening: (6), (7), or ISO 6358-1:2013 with the set's b."""
        ratio, capacities = self.critical_ratio, self.gas.heat_capacity_ratio
        if ratio is None:
            return Law("orifice", "Cd A C1 P psi(P2/P1)", "1/s", lambda a, b: orifice_shape(a, b, capacities))
        formula = f"C rho_0 P phi(P2/P1), b = {ratio:g}"
        return Law("orifice", formula, "1/s", lambda a, b: iso6358_shape(a, b, ratio))

    def numbers(self, conductance: float, half_width: float, text: str, widened: float) -> list[Number]:
        """Return the leak's size from choked flow over upstream pressure [kg/(s Pa)], with half the interval's width.

        An area without a discharge coefficient is the product Cd A only, which no set has.
        """
        if self.critical_ratio is not None:
            per = self.gas.flow_per_sonic_conductance
            told = f"C of ISO 6358 with the set's b = {self.critical_ratio:g}. {text}"
            return [Number(SONIC_PATH, self.unit, conductance / per, half_width / per, told, None, 0.0, widened)]
        area, half = conductance / self.gas.choked_flow_constant, half_width / self.gas.choked_flow_constant
        product = Number("vane_leak.effective_area", "m^2", area, half, f"Cd A. {text}", None, 0.0, widened)
        coefficient = self.discharge_coefficient
        if not coefficient:
            return [product]
        told = f"With Cd = {coefficient:g}, of which only the product with the area counts. {text}"
        return [Number(AREA_PATH, "m^2", area / coefficient, half / coefficient, told, None, 0.0, widened), product]
