"""Two pressure regulators and their lines, with droop and a largest flow: the supply of a walking device.

The bottle's regulator fills the plantarflexion line. The second regulator is on the device, downstream of the first: it
takes its gas from that line and fills the dorsiflexion line. The flow through each regulator is

    mass flow = clip((set pressure - line pressure) / droop, 0, largest flow),

and the second regulator cannot regulate to more than its inlet pressure. A line is a volume of isothermal gas, equation
(3). Gas that returns from a chamber stays in its line, because no gas flows back through a regulator unless it is a
relieving one, whose largest flow is the same in both directions. The lines are stepped with a constant outflow during
the step: the regulator's linear part is solved in closed form, so that a small droop does not require a small step.
"""

from typing import NamedTuple

from ppafo.model.plant import PlantParameters, pressures_per_mass


class SupplyLines(NamedTuple):
    """Droop [Pa s/kg] and largest flow [kg/s] of both regulators, volumes [m^3] of both lines.

    1 is the plantarflexion line downstream of the bottle's regulator, 2 the dorsiflexion line downstream of the
    device's. ``relieving`` is 1 where gas flows back through both regulators, else 0.
    """

    droop_1: float
    largest_flow_1: float
    volume_1: float
    droop_2: float
    largest_flow_2: float
    volume_2: float
    relieving: float


class LineState(NamedTuple):
    """Gas in both lines [kg], and total gas through the bottle's regulator since the start [kg]."""

    mass_1: float
    mass_2: float
    regulated_mass: float


def lines_at_start(plant: PlantParameters, lines: SupplyLines) -> LineState:
    """Both lines at the set pressures of their regulators, with a total of 0."""
    per_mass_1, per_mass_2 = pressures_per_mass(plant.gas_product, lines.volume_1, lines.volume_2)
    return LineState(
        mass_1=plant.supply_pressure / per_mass_1,
        mass_2=plant.dorsiflexion_pressure / per_mass_2,
        regulated_mass=0.0,
    )


class LineStep(NamedTuple):
    """Lines after a step, and pressure rise of line 1 [Pa] in the step without the flow to the second regulator."""

    after: LineState
    inlet_rise: float


def line_pressures(lines: SupplyLines, gas_product: float, state: LineState) -> tuple[float, float]:
    """Absolute pressures of both lines [Pa]; ``gas_product`` is R T/M [J/kg]. Equation (3)."""
    per_mass_1, per_mass_2 = pressures_per_mass(gas_product, lines.volume_1, lines.volume_2)
    return state.mass_1 * per_mass_1, state.mass_2 * per_mass_2


def regulated_mass(
    lacking: float, loss: float, stiffness: float, droop: float, largest_flow: float, relieving: float, step: float
) -> float:
    """Mass [kg] through a regulator in a step [s]; negative for a backflow through a relieving one (1, else 0).

    ``lacking`` [Pa] is the set pressure minus the line pressure at the start. Without flow through the regulator it
    would grow by ``loss`` [Pa] during the step; the flow reduces it by ``stiffness`` [Pa/kg].
    """
    steps = step * stiffness / droop
    # 1 / (1 + x + x^2/2) stands for exp(-x): of second order, between 0 and 1, and without a call, so in vector code.
    scale = 1.0 / (1.0 + steps + 0.5 * steps * steps)
    # Integral of the regulator's flow over the step, linear in what lacks at its beginning and in what is lost in it.
    regained = lacking * steps * (1.0 + 0.5 * steps) + loss * 0.5 * steps * (1.0 + steps)
    largest = largest_flow * step
    return min(max(regained * scale / stiffness, -largest * relieving), largest)


def step_lines(
    lines: SupplyLines,
    set_1: float,
    set_2: float,
    gas_product: float,
    state: LineState,
    taken_1: float,
    taken_2: float,
    inlet_rise: float,
    step: float,
) -> LineStep:
    """Both lines after a step [s] in which the valves took two masses [kg]; set pressures are absolute [Pa].

    ``inlet_rise`` [Pa] is an estimate of line 1's own pressure rise, 0 for a first estimate: it matters where the
    second regulator is fully open because its inlet pressure is below its set pressure.
    """
    per_mass_1, per_mass_2 = pressures_per_mass(gas_product, lines.volume_1, lines.volume_2)
    pressure_1 = state.mass_1 * per_mass_1
    pressure_2 = state.mass_2 * per_mass_2
    stands_open = pressure_1 < set_2
    # Where the second regulator stands open its outlet follows its inlet, which sinks by what it draws.
    passed_2 = regulated_mass(
        min(set_2, pressure_1) - pressure_2,
        taken_2 * per_mass_2 + (inlet_rise if stands_open else 0.0),
        per_mass_2 + (per_mass_1 if stands_open else 0.0),
        lines.droop_2,
        lines.largest_flow_2,
        lines.relieving,
        step,
    )
    # The flow through the second regulator leaves the first line.
    left = taken_1 + passed_2
    passed_1 = regulated_mass(
        set_1 - pressure_1, left * per_mass_1, per_mass_1, lines.droop_1, lines.largest_flow_1, lines.relieving, step
    )
    after = LineState(
        state.mass_1 + passed_1 - left, state.mass_2 + passed_2 - taken_2, state.regulated_mass + passed_1
    )
    return LineStep(after, (passed_1 - taken_1) * per_mass_1)
