"""Gas in the chambers in an integration step, isothermal or with an energy balance."""

from ppafo.engine.program import Program
from ppafo.engine.scheme.pneumatics import (
    OF_OPENING,
    OF_STAGES,
    SHORTEST,
    STILL,
    Flows,
    GasStage,
    added_flows,
    change_by_stages,
    flow_rates,
    inverse_determinant,
    kept_gas,
    linearise,
    of_both_stages,
    pressure_error,
    response,
    second_right,
    solve_stage,
    with_gas,
)
from ppafo.engine.scheme.thermal_gas import (
    ALLOWED_OF_TEMPERATURE,
    ThermalFlows,
    ThermalStage,
    WarmGas,
    added_thermal_flows,
    solve_thermal_stage,
    thermal_flows,
    thermal_matrix,
    thermal_response,
    warm_chambers,
    with_thermal_gas,
    with_work,
)
from ppafo.engine.step.lane import Lane
from ppafo.model.gas import enthalpy_flow_ratio
from ppafo.model.plant import PlantState, pressures_per_mass


def begin(parts: Program, lane: Lane, next_angle: float, length: float) -> None:
    """Set the first stage of the step for fixed volumes, or for volumes that change up to ``next_angle`` [rad]."""
    if parts.is_thermal:
        begin_warm(parts, lane, next_angle, length)
    elif parts.keeps_volumes:
        begin_still(parts, lane, length)
    else:
        begin_moving(parts, lane, next_angle, length)


def begin_still(parts: Program, lane: Lane, length: float) -> None:
    """Set the first stage of isothermal gas with a joint at rest."""
    linear = linearise(lane.held.per_mass_1, lane.held.per_mass_2, lane.flowing, length)
    scale = inverse_determinant(linear.a, linear.b, linear.c, linear.d)
    first = solve_stage(linear, scale, flow_rates(lane.flowing.flows))
    # Pressures as in a step with moving volumes: a locked joint has the bits of an exported plant at rest.
    mass_1 = lane.state.mass_1 + length * first.mass_1
    mass_2 = lane.state.mass_2 + length * first.mass_2
    ended = lane.state._replace(mass_1=mass_1, mass_2=mass_2)
    end_1, end_2 = parts.functions.held_pressures(lane.plant, lane.held, ended)
    lane.gas_stage = GasStage(linear=linear, scale=scale, first=first, drift=STILL, end_1=end_1, end_2=end_2)


def begin_moving(parts: Program, lane: Lane, next_angle: float, length: float) -> None:
    """Set the first stage of isothermal gas with volumes that change linearly up to ``next_angle`` [rad].

    Mass responds to pressure in proportion to ``V + p dV/dp``: a compliant chamber takes up more gas.
    """
    plant = lane.plant
    state = lane.state
    pressure_1, pressure_2 = parts.actuator.pressures(plant, state.angle, state.mass_1, state.mass_2)
    # Volumes at both angles at one pressure: the drift is what the angle alone does.
    here = parts.actuator.chambers(plant, state.angle, pressure_1, pressure_2)
    ahead = parts.actuator.chambers(plant, next_angle, pressure_1, pressure_2)
    room_1 = here.volume_1 + pressure_1 * here.compliance_1
    room_2 = here.volume_2 + pressure_2 * here.compliance_2
    per_mass_1, per_mass_2 = pressures_per_mass(plant.gas_product, room_1, room_2)
    linear = linearise(per_mass_1, per_mass_2, lane.flowing, length)
    # A growing volume lowers the pressure as a loss of mass at this rate would; parts of a step may have no length.
    per_duration = 1.0 / (plant.gas_product * max(length, SHORTEST))
    drift = response(
        linear,
        pressure_1 * (here.volume_1 - ahead.volume_1) * per_duration,
        pressure_2 * (here.volume_2 - ahead.volume_2) * per_duration,
    )
    scale = inverse_determinant(linear.a, linear.b, linear.c, linear.d)
    first = solve_stage(linear, scale, added_flows(flow_rates(lane.flowing.flows), drift))
    mass_1 = state.mass_1 + length * first.mass_1
    mass_2 = state.mass_2 + length * first.mass_2
    end_1, end_2 = parts.actuator.pressures(plant, next_angle, mass_1, mass_2)
    lane.gas_stage = GasStage(linear=linear, scale=scale, first=first, drift=drift, end_1=end_1, end_2=end_2)


def begin_warm(parts: Program, lane: Lane, next_angle: float, length: float) -> None:
    """Set the first stage with an energy balance; volumes change linearly up to ``next_angle`` [rad]."""
    plant = lane.plant
    state = lane.state
    rate = 1.0 / max(length, SHORTEST)
    angle = state.angle
    functions = parts.functions
    pressure_1, pressure_2 = parts.actuator.pressures(plant, angle, state.mass_1, state.mass_2)
    at = warm_chambers(plant, pressure_1, pressure_2, angle, angle, next_angle, rate, parts=functions)
    held = WarmGas(state.mass_1, state.mass_2, lane.masses.mass_1, lane.masses.mass_2)
    linear = thermal_matrix(plant, lane.thermal, held, at, lane.flowing, length)
    # A growing volume lowers the pressure as a loss of content at this rate would.
    lost_1 = -state.mass_1 * at.growth_1 / at.volume_1
    lost_2 = -state.mass_2 * at.growth_2 / at.volume_2
    flows = thermal_flows(lane.thermal, held, at, lane.flowing.flows)
    scale = inverse_determinant(linear.a, linear.b, linear.c, linear.d)
    first_rates = solve_thermal_stage(
        linear, scale, added_thermal_flows(flows, thermal_response(linear, lost_1, lost_2))
    )
    ended = WarmGas(
        content_1=state.mass_1 + length * first_rates.mass_1,
        content_2=state.mass_2 + length * first_rates.mass_2,
        mass_1=lane.masses.mass_1 + length * first_rates.gas.mass_1,
        mass_2=lane.masses.mass_2 + length * first_rates.gas.mass_2,
    )
    end_1, end_2 = parts.actuator.pressures(plant, next_angle, ended.content_1, ended.content_2)
    lane.gas_stage = ThermalStage(
        linear=linear,
        scale=scale,
        first=first_rates,
        lost_1=lost_1,
        lost_2=lost_2,
        gas=ended,
        at=warm_chambers(plant, end_1, end_2, next_angle, angle, next_angle, rate, parts=functions),
        end_1=end_1,
        end_2=end_2,
    )


def first(parts: Program, lane: Lane) -> Flows:
    """Return the rates of the first stage [kg/s], of true masses."""
    rates: Flows = lane.gas_stage.first.gas if parts.is_thermal else lane.gas_stage.first
    return rates


def changes(parts: Program, lane: Lane) -> Flows:
    """Return the changes in the step [kg], of true masses."""
    changed: Flows = lane.change.gas if parts.is_thermal else lane.change
    return changed


def change(parts: Program, lane: Lane, length: float) -> None:
    """Set the second stage, and the changes from both stages, with the gas that a supply did not take back."""
    if parts.is_thermal:
        change_warm(parts, lane, length)
    else:
        drift = STILL if parts.keeps_volumes else lane.gas_stage.drift
        begun = lane.gas_stage
        lane.second = solve_stage(begun.linear, begun.scale, second_right(flow_rates(lane.passing), begun.first, drift))
        kept_1, kept_2 = kept_gas(lane.plant, begun.first, lane.second, length)
        lane.change = change_by_stages(begun.first, lane.second, length, kept_1, kept_2)


def change_warm(parts: Program, lane: Lane, length: float) -> None:
    """Set the second stage and the changes of gas with an energy balance."""
    begun = lane.gas_stage
    rates = lane.gas_stage.first
    flows = thermal_flows(lane.thermal, begun.gas, begun.at, lane.passing)
    drift = thermal_response(begun.linear, begun.lost_1, begun.lost_2)
    right = ThermalFlows(
        mass_1=flows.mass_1 - 2.0 * rates.mass_1 - drift.mass_1,
        mass_2=flows.mass_2 - 2.0 * rates.mass_2 - drift.mass_2,
        gas=second_right(flows.gas, rates.gas, drift.gas),
        energy=second_right(flows.energy, rates.energy, drift.energy),
        heat=flows.heat - 2.0 * rates.heat,
    )
    second = solve_thermal_stage(begun.linear, begun.scale, right)
    kept_1, kept_2 = kept_gas(lane.plant, rates.gas, second.gas, length)
    carries = enthalpy_flow_ratio(1.0, lane.thermal.heat_capacity_ratio)
    warm_1 = kept_1 * carries
    warm_2 = kept_2 * carries
    lane.second = second
    lane.change = ThermalFlows(
        mass_1=of_both_stages(rates.mass_1, second.mass_1, length) + begun.linear.kept_1 * warm_1,
        mass_2=of_both_stages(rates.mass_2, second.mass_2, length) + begun.linear.kept_2 * warm_2,
        gas=change_by_stages(rates.gas, second.gas, length, kept_1, kept_2),
        energy=change_by_stages(rates.energy, second.energy, length, warm_1, warm_2),
        heat=of_both_stages(rates.heat, second.heat, length),
    )


def error(parts: Program, lane: Lane, ahead: float, length: float) -> float:
    """Return the error divided by the allowed error [-]; the volumes end at the angle ``ahead`` [rad].

    The estimate is the contribution of the second stage, damped once by the matrix of the step, so that a settled
    chamber does not require short steps: damped twice, it would fall below the error that it stands for. Gas that a
    supply without relief would have taken back inside the step is added. In a warm chamber that is flushed within a
    step, the pressure is settled but the temperature is not.
    """
    begun = lane.gas_stage
    if parts.is_thermal:
        added = solve_thermal_stage(begun.linear, begun.scale, added_thermal_flows(begun.first, lane.second))
        missed_1 = added.mass_1
        missed_2 = added.mass_2
        # The temperature over the reference is content over mass: what a little of both changes it by.
        held = begun.gas
        warmer_1 = (added.mass_1 - held.content_1 / held.mass_1 * added.gas.mass_1) / held.mass_1
        warmer_2 = (added.mass_2 - held.content_2 / held.mass_2 * added.gas.mass_2) / held.mass_2
        least = 0.5 / ALLOWED_OF_TEMPERATURE * length * max(abs(warmer_1), abs(warmer_2))
    else:
        refused_1, refused_2 = kept_gas(lane.plant, begun.first, lane.second, 1.0)
        damped = solve_stage(begun.linear, begun.scale, added_flows(begun.first, lane.second))
        missed_1 = abs(damped.mass_1) + refused_1
        missed_2 = abs(damped.mass_2) + refused_2
        least = 0.0
    pressed = pressure_error(
        lane.plant, OF_STAGES, missed_1, missed_2, begun.end_1, begun.end_2, ahead, length, parts=parts.functions
    )
    return max(pressed, least) if parts.is_thermal else pressed


def shift_error(parts: Program, lane: Lane, shift: float, ahead: float, length: float) -> float:
    """Return the error due to a moving valve in a part of a step, divided by the allowed error [-].

    ``shift`` [-] is the relative change of the opening. Opening and flow change together; the matrix of the step gives
    the change of the flow.
    """
    begun = lane.gas_stage
    response_1 = (begun.linear.a - 1.0) * begun.first.mass_1
    response_2 = (begun.linear.d - 1.0) * begun.first.mass_2
    weight = OF_OPENING * shift
    functions = parts.functions
    return pressure_error(
        lane.plant, weight, response_1, response_2, begun.end_1, begun.end_2, ahead, length, parts=functions
    )


def add(parts: Program, lane: Lane) -> None:
    """Set the state, and the true masses and energy totals of thermal gas, after adding the gas of the step."""
    if parts.is_thermal:
        lane.fed, lane.warmed = with_thermal_gas(lane.state, lane.masses, lane.change)
    else:
        lane.fed = with_gas(lane.state, lane.change)


def move(parts: Program, lane: Lane, state: PlantState, assumed: float, reached: float) -> PlantState:
    """Return the state for the angle reached [rad] instead of the assumed one [rad], with thermal gas isentropic."""
    if not parts.is_thermal:
        return state
    plant = lane.plant
    ratio = lane.thermal.heat_capacity_ratio
    chambers = parts.functions.chambers
    pressure_1, pressure_2 = parts.functions.pressures(plant, assumed, state.mass_1, state.mass_2)
    before = chambers(plant, assumed, pressure_1, pressure_2)
    turned = chambers(plant, reached, pressure_1, pressure_2)
    # The isentrope k P dV = -V dP, of which the wall's part goes with the pressure: the pressure there, then the work.
    reached_1 = pressure_1 - ratio * pressure_1 * (turned.volume_1 - before.volume_1) / (
        before.volume_1 + ratio * pressure_1 * before.compliance_1
    )
    reached_2 = pressure_2 - ratio * pressure_2 * (turned.volume_2 - before.volume_2) / (
        before.volume_2 + ratio * pressure_2 * before.compliance_2
    )
    after = chambers(plant, reached, reached_1, reached_2)
    half = 0.5 * (ratio - 1.0)
    mean_1 = 0.5 * (after.volume_1 + before.volume_1)
    mean_2 = 0.5 * (after.volume_2 + before.volume_2)
    work_1 = half * (after.volume_1 - before.volume_1)
    work_2 = half * (after.volume_2 - before.volume_2)
    return state._replace(
        mass_1=state.mass_1 * (mean_1 - work_1) / (mean_1 + work_1),
        mass_2=state.mass_2 * (mean_2 - work_2) / (mean_2 + work_2),
    )


def work(parts: Program, lane: Lane) -> None:
    """Add the work of thermal gas on shaft and walls; a locked joint with rigid chambers does no work."""
    if parts.is_thermal and (not parts.is_locked or parts.actuator.gives):
        lane.warmed = with_work(lane.plant, lane.warmed, lane.state, lane.after, parts=parts.functions)
