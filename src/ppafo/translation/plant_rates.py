"""The plant in continuous time with the engine's flow curves, as CasADi expressions of its own text.

What the engine steps and what is differentiated here are the same functions: ports, flow curves, chambers, gas with an
energy balance, vane. Only the sums of equation (9) and the state of the vane, which stands or slides, are said here.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from ppafo.engine.continuous_time import free_motion, real_gas_rates
from ppafo.engine.scheme.thermal_gas import ThermalFlows, WarmChambers, thermal_flows
from ppafo.model.actuators.kind import ActuatorModel, Chambers
from ppafo.model.declaration import PlainFunction
from ppafo.model.elementary import TURN, sine_and_cosine_of_turns
from ppafo.model.orifice import orifice_flow
from ppafo.model.plant import (
    Openings,
    PlantParameters,
    PlantState,
    PortFlow,
    ThermalParameters,
    ThermalState,
    blended_port_flow,
    blended_ports,
    joint_torque,
)
from ppafo.model.ports import gas_density, leakage_path
from ppafo.translation.symbolic import Acting, Compare, Symbolic, Wrapper, both_sides, symbolic

Around = Mapping[PlainFunction, Wrapper]


class GasFlows(NamedTuple):
    """Flows into both chambers, from the source, to the atmosphere and from chamber 1 to 2 over the vane [kg/s]."""

    mass_1: float
    mass_2: float
    supplied: float
    vented: float
    leaked: float


class PlantRates(NamedTuple):
    """Rates of both pressures [Pa/s] and temperatures [K/s], flows from the source and to the atmosphere [kg/s]."""

    pressure_1: Any
    pressure_2: Any
    temperature_1: Any
    temperature_2: Any
    supplied: Any
    vented: Any


def port_flows(
    plant: PlantParameters, openings: Openings, pressure_1: float, pressure_2: float
) -> tuple[PortFlow, PortFlow, float]:
    """Flows [kg/s] through the ports of both chambers and from 1 to 2 at absolute pressures [Pa]. Eqs (6) to (9)."""
    port_1, port_2 = blended_ports(plant, openings)
    in_1 = blended_port_flow(pressure_1, port_1, plant.valve_curve)
    in_2 = blended_port_flow(pressure_2, port_2, plant.valve_curve)
    leak_conductance = leakage_path(plant.leak_conductance, pressure_1, pressure_2, plant.leak_curve)
    return in_1, in_2, orifice_flow(pressure_1, pressure_2, leak_conductance, plant.leak_curve)


def gas_flows(plant: PlantParameters, openings: Openings, pressure_1: float, pressure_2: float) -> GasFlows:
    """All flows [kg/s] of gas that keeps its temperature, at absolute pressures [Pa]. Equations (6) to (9)."""
    in_1, in_2, leak = port_flows(plant, openings, pressure_1, pressure_2)
    supplied = in_1.from_source + in_2.from_source
    return GasFlows(
        mass_1=in_1.total - leak,
        mass_2=in_2.total + leak,
        supplied=supplied,
        vented=supplied - in_1.total - in_2.total,
        leaked=leak,
    )


def thermal_gas_flows(
    plant: PlantParameters,
    thermal: ThermalParameters,
    openings: Openings,
    state: PlantState,
    masses: ThermalState,
    at: WarmChambers,
    pressure_1: float,
    pressure_2: float,
) -> ThermalFlows:
    """All rates of gas with an energy balance [kg/s], at absolute pressures [Pa]. Equations (3), (6) to (9)."""
    in_1, in_2, leak = port_flows(plant, openings, pressure_1, pressure_2)
    return thermal_flows(thermal, state, masses, at, in_1, in_2, leak)


@dataclass(frozen=True, slots=True)
class Turning:
    """An actuator in symbols: its plant, angle [rad], rate [rad/s] and absolute pressures [Pa].

    ``compare`` says what becomes of a comparison, and ``acting`` are effects, both as in ``symbolic``.
    """

    actuator: ActuatorModel
    plant: Any
    angle: Any
    rate: Any
    pressures: tuple[Any, Any]
    compare: Compare = both_sides
    acting: Acting | None = None

    def calls(self, function: PlainFunction, *given: type, around: Around | None = None) -> Symbolic:
        """A function of the model whose first parameter is the plant, and further ones are of types."""
        types = (self.actuator.plant, *given)
        return symbolic(function, *types, around=around, compare=self.compare, acting=self.acting)

    def chambers(self) -> Chambers:
        """Both chambers."""
        filled = symbolic(
            self.actuator.chambers, self.actuator.plant, float, float, float, around=SINES, compare=self.compare
        )
        found: Chambers = filled(self.plant, self.angle, *self.pressures)
        return found

    def growth(self, filled: Chambers) -> tuple[Any, Any]:
        """Rates at which the angle widens both [m^3/s]."""
        import casadi

        first, second = (
            casadi.jtimes(casadi.SX(volume), self.angle, self.rate) for volume in (filled.volume_1, filled.volume_2)
        )
        return first, second

    def torque(self) -> Any:
        """Torque [N m]."""
        return torque_in_symbols(self.actuator, self.compare)(self.plant, self.angle, *self.pressures)


def torque_in_symbols(actuator: ActuatorModel, compare: Compare) -> Symbolic:
    """The torque of an actuator [N m] for CasADi, of a plant, an angle [rad] and absolute pressures [Pa]."""
    return symbolic(actuator.torque, actuator.plant, float, float, float, around=SINES, compare=compare)


def _sine_and_cosine(_own: Any, turns: Any) -> tuple[Any, Any]:
    import casadi

    return casadi.sin(TURN * turns), casadi.cos(TURN * turns)


SINES: Around = {sine_and_cosine_of_turns: _sine_and_cosine}
"""CasADi has sines of its own, where compiled code has a series."""


def gas_rates(turning: Turning, openings: Any) -> PlantRates:
    """Rates of gas of one temperature.

    Equation (3) is differentiated, (6) to (9) are the engine's.
    """
    plant, angle, rate = turning.plant, turning.angle, turning.rate
    found = turning.calls(gas_flows, Openings, float, float)(plant, openings, *turning.pressures)
    filled = turning.chambers()
    # Flows are true masses; where the gas is not ideal its content grows by another amount.
    gained = found.mass_1, found.mass_2
    if any(gas_density in effect.laws for effect in turning.acting or ()):
        real = turning.calls(real_gas_rates, *(float,) * 6)
        gained = real(plant, angle, rate, *gained, *_contents(turning, filled))
    slopes = _pressure_rates(turning, filled, gained)
    return PlantRates(
        pressure_1=slopes[0],
        pressure_2=slopes[1],
        temperature_1=0.0,
        temperature_2=0.0,
        supplied=found.supplied,
        vented=found.vented,
    )


def thermal_gas_rates(
    turning: Turning, thermal: ThermalParameters, openings: Any, temperatures: tuple[Any, Any]
) -> PlantRates:
    """Rates of ``gas_rates`` for gas with an energy balance at temperatures [K]."""
    plant, filled = turning.plant, turning.chambers()
    content_1, content_2 = _contents(turning, filled)
    mass_1, mass_2 = (
        content * thermal.temperature / warm for content, warm in zip((content_1, content_2), temperatures, strict=True)
    )
    # Totals do not act on rates: zeros stand for them.
    state = PlantState(
        angle=turning.angle,
        angular_velocity=turning.rate,
        mass_1=content_1,
        mass_2=content_2,
        supplied_mass=0.0,
        vented_mass=0.0,
        leaked_mass=0.0,
    )
    masses = ThermalState(
        mass_1=mass_1, mass_2=mass_2, supplied_content=0.0, vented_content=0.0, heat_content=0.0, gas_work=0.0
    )
    growth, (pressure_1, pressure_2) = turning.growth(filled), turning.pressures
    at = WarmChambers(
        volume_1=filled.volume_1,
        volume_2=filled.volume_2,
        growth_1=growth[0],
        growth_2=growth[1],
        give_1=pressure_1 * filled.compliance_1 / filled.volume_1,
        give_2=pressure_2 * filled.compliance_2 / filled.volume_2,
    )
    types = (ThermalParameters, Openings, PlantState, ThermalState, WarmChambers, float, float)
    found = turning.calls(thermal_gas_flows, *types)(
        plant, thermal, openings, state, masses, at, pressure_1, pressure_2
    )
    # The contents hold the work of the moving wall already: only the volumes are left of equation (3).
    slopes = _pressure_rates(turning, filled, (found.content_1, found.content_2))
    # A temperature is the walls' times gas content over mass.
    return PlantRates(
        pressure_1=slopes[0],
        pressure_2=slopes[1],
        temperature_1=temperatures[0] * (found.content_1 / content_1 - found.mass_1 / mass_1),
        temperature_2=temperatures[1] * (found.content_2 / content_2 - found.mass_2 / mass_2),
        supplied=found.supplied,
        vented=found.supplied - found.mass_1 - found.mass_2,
    )


def _contents(turning: Turning, filled: Chambers) -> tuple[Any, Any]:
    """What ``PlantState`` counts of the gas [kg]. Equation (3)."""
    product, (pressure_1, pressure_2) = turning.plant.gas_product, turning.pressures
    return pressure_1 * filled.volume_1 / product, pressure_2 * filled.volume_2 / product


def _pressure_rates(turning: Turning, filled: Chambers, mass_rates: tuple[Any, Any]) -> tuple[Any, Any]:
    """Rates of both pressures [Pa/s] from the rates of the gas [kg/s] and of the angle: equation (3) in time."""
    product, growth = turning.plant.gas_product, turning.growth(filled)
    first, second = (
        # d(p V) = R T dm, and a chamber that gives grows with its pressure, too.
        (product * gained - pressure * grown) / (volume + pressure * compliance)
        for gained, pressure, grown, volume, compliance in zip(
            mass_rates,
            turning.pressures,
            growth,
            (filled.volume_1, filled.volume_2),
            (filled.compliance_1, filled.compliance_2),
            strict=True,
        )
    )
    return first, second


def acceleration_of(turning: Turning, way: float, added_torque: Any = 0.0) -> Any:
    """Angular acceleration [rad/s^2] of a joint that slides one ``way`` (1 or -1), 0 where it sticks (0)."""
    torque = torque_in_symbols(turning.actuator, turning.compare)
    around: Around = {joint_torque: lambda _own, *given: torque(*given)}
    motion = turning.calls(free_motion, *(float,) * 6, around=around)
    return motion(turning.plant, turning.angle, turning.rate, *turning.pressures, added_torque, way)[1]
