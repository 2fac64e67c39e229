"""Gas with an energy balance in chambers of any actuator.

The chamber volume depends on angle and pressure; the energy balance is the one in ``thermal_gas``.
"""

from ppafo.engine.scheme import thermal_gas
from ppafo.engine.scheme.actuators import functions_of_actuator
from ppafo.engine.scheme.pneumatics import SHORTEST
from ppafo.engine.scheme.thermal_gas import ThermalBegin, WarmChambers, WarmFunctions
from ppafo.model.actuators.kind import ActuatorModel, Chambers
from ppafo.model.actuators.vane import MODEL as VANE
from ppafo.model.binding import made_of
from ppafo.model.plant import ActuatorFunctions, PlantParameters, PlantState, ThermalParameters, ThermalState


def widening(
    now: Chambers, here: Chambers, ahead: Chambers, pressure_1: float, pressure_2: float, step: float
) -> WarmChambers:
    """Chamber volumes and compliances at ``now``, growing by ``ahead`` minus ``here`` in a step [s]; pressures [Pa]."""
    duration = max(step, SHORTEST)
    return WarmChambers(
        volume_1=now.volume_1,
        volume_2=now.volume_2,
        growth_1=(ahead.volume_1 - here.volume_1) / duration,
        growth_2=(ahead.volume_2 - here.volume_2) / duration,
        give_1=pressure_1 * now.compliance_1 / now.volume_1,
        give_2=pressure_2 * now.compliance_2 / now.volume_2,
    )


def chambers_at_begin(
    plant: PlantParameters, state: PlantState, next_angle: float, step: float, *, parts: ActuatorFunctions
) -> ThermalBegin:
    """Both chambers at the start of a step [s] that ends at ``next_angle`` [rad]."""
    pressure_1, pressure_2 = parts.pressures(plant, state.angle, state.mass_1, state.mass_2)
    # Volumes at both angles at one pressure: their difference is what the angle alone does.
    here = parts.chambers(plant, state.angle, pressure_1, pressure_2)
    ahead = parts.chambers(plant, next_angle, pressure_1, pressure_2)
    return ThermalBegin(
        chambers=widening(here, here, ahead, pressure_1, pressure_2, step),
        per_content_1=plant.gas_product / (here.volume_1 + pressure_1 * here.compliance_1),
        per_content_2=plant.gas_product / (here.volume_2 + pressure_2 * here.compliance_2),
    )


def chambers_at_end(
    plant: PlantParameters,
    _begun: WarmChambers,
    state: PlantState,
    end: PlantState,
    next_angle: float,
    step: float,
    *,
    parts: ActuatorFunctions,
) -> WarmChambers:
    """Both chambers at ``next_angle`` [rad] with the contents after the first stage of a step [s]."""
    pressure_1, pressure_2 = parts.pressures(plant, next_angle, end.mass_1, end.mass_2)
    here = parts.chambers(plant, state.angle, pressure_1, pressure_2)
    ahead = parts.chambers(plant, next_angle, pressure_1, pressure_2)
    return widening(ahead, here, ahead, pressure_1, pressure_2, step)


def after_motion(
    plant: PlantParameters,
    thermal: ThermalParameters,
    state: PlantState,
    assumed_angle: float,
    angle: float,
    *,
    parts: ActuatorFunctions,
) -> PlantState:
    """State after isentropic correction of the gas from the assumed angle [rad] to the angle reached [rad]."""
    ratio = thermal.heat_capacity_ratio
    pressure_1, pressure_2 = parts.pressures(plant, assumed_angle, state.mass_1, state.mass_2)
    assumed = parts.chambers(plant, assumed_angle, pressure_1, pressure_2)
    turned = parts.chambers(plant, angle, pressure_1, pressure_2)
    # The isentrope k P dV = -V dP, of which the wall's part goes with the pressure: the pressure there, then the work.
    reached_1 = pressure_1 - ratio * pressure_1 * (turned.volume_1 - assumed.volume_1) / (
        assumed.volume_1 + ratio * pressure_1 * assumed.compliance_1
    )
    reached_2 = pressure_2 - ratio * pressure_2 * (turned.volume_2 - assumed.volume_2) / (
        assumed.volume_2 + ratio * pressure_2 * assumed.compliance_2
    )
    reached = parts.chambers(plant, angle, reached_1, reached_2)
    half = 0.5 * (ratio - 1.0)
    mean_1, mean_2 = 0.5 * (reached.volume_1 + assumed.volume_1), 0.5 * (reached.volume_2 + assumed.volume_2)
    work_1, work_2 = half * (reached.volume_1 - assumed.volume_1), half * (reached.volume_2 - assumed.volume_2)
    return state._replace(
        mass_1=state.mass_1 * (mean_1 - work_1) / (mean_1 + work_1),
        mass_2=state.mass_2 * (mean_2 - work_2) / (mean_2 + work_2),
    )


def with_work(
    plant: PlantParameters, masses: ThermalState, before: PlantState, after: PlantState, *, parts: ActuatorFunctions
) -> ThermalState:
    """Gas masses and energy totals, updated by the gas work on shaft and expanding walls between two states."""
    before_1, before_2 = parts.pressures(plant, before.angle, before.mass_1, before.mass_2)
    after_1, after_2 = parts.pressures(plant, after.angle, after.mass_1, after.mass_2)
    first = parts.chambers(plant, before.angle, before_1, before_2)
    last = parts.chambers(plant, after.angle, after_1, after_2)
    # The trapezoidal rule over the volumes: exact along a wall that gives in proportion to the pressure.
    work_1 = 0.5 * (before_1 + after_1) * (last.volume_1 - first.volume_1)
    work_2 = 0.5 * (before_2 + after_2) * (last.volume_2 - first.volume_2)
    return masses._replace(gas_work=masses.gas_work + work_1 + work_2)


def warm_functions(actuator: ActuatorModel) -> WarmFunctions:
    """Return the functions of an actuator for chambers with an energy balance."""
    if actuator == VANE:
        return WarmFunctions(
            chambers_at_begin=thermal_gas.chambers_at_begin,
            chambers_at_end=thermal_gas.chambers_at_end,
            after_motion=thermal_gas.after_motion,
            with_work=thermal_gas.with_work,
        )
    own = functions_of_actuator(actuator)
    of_any = (chambers_at_begin, chambers_at_end, after_motion, with_work)
    return WarmFunctions(**{function.__name__: made_of(function, function.__name__, own) for function in of_any})
