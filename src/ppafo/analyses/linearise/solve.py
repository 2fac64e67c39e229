"""Linear model of a scenario's plant, at an instant of its run or at its steady state."""

from dataclasses import replace
from numbers import Real

import numpy as np

from ppafo.analyses.linearise.loop import loop_margins
from ppafo.analyses.linearise.model import LinearModel, LinearSignal, OmittedDelays, SlopeKink
from ppafo.analyses.linearise.plant import (
    UNITS,
    VALVE,
    functions_in,
    one_sided_slopes,
    opens_in_proportion,
    plant_of,
    side_of,
    size_of,
    valve_at,
)
from ppafo.analyses.linearise.point import Point, equilibrium, point_at
from ppafo.engine.lanes import Floats
from ppafo.engine.run import Run
from ppafo.errors import ScenarioError, UnitError, refused_as
from ppafo.model.orifice import FlowCurve
from ppafo.parameters.joint import JointNames
from ppafo.signals.recording import OF_SECOND_CHAMBER
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from ppafo.units import parse_quantity
from ppafo.wording import argument_text

ON_THE_EDGE = 1.0e-6
"""Difference of the slopes on both sides, divided by the largest slope of the row, above which there is a kink.

Without a kink, the finite differences agree to about 1e-9.
"""
ZERO = 1.0e-9
"""Slope divided by the largest slope of its row, below which the slope counts as 0 (rounding)."""


def sides_of(run: Run, point: Point, joint: JointNames) -> dict[str, str]:
    """Return the side of each limit at the operating point, in words, by component; ``joint`` names the joint."""
    at, plant = point.values, run.plant
    openings = valve_at(run, functions_in(run), at).openings
    atmosphere, pressure_1, pressure_2 = plant.atmospheric_pressure, at["pressure_1"], at["pressure_2"]
    paths = {
        "source to chamber 1": (at["supply_pressure"], pressure_1, openings.source_1),
        "chamber 1 to atmosphere": (pressure_1, atmosphere, openings.vent_1),
        "source to chamber 2": (at["dorsiflexion_pressure"], pressure_2, openings.source_2),
        "chamber 2 to atmosphere": (pressure_2, atmosphere, openings.vent_2),
    }
    regimes = {name: _regime(plant.valve_curve, *values) for name, values in paths.items()}
    if run.program.has_one_chamber:
        regimes = {name: regime for name, regime in regimes.items() if "chamber 2" not in name}
    else:
        regimes["leak over the vane"] = _regime(plant.leak_curve, pressure_1, pressure_2, 1.0)
    motion = {
        None: "prescribed",
        0.0: "at rest",
        1.0: f"slides in {joint.positive}",
        -1.0: f"slides in {joint.negative}",
    }
    vane = motion[point.direction]
    if point.direction == 0.0:
        is_at_stop = not plant.angle_min < at["angle"] < plant.angle_max
        vane = "against a stop" if is_at_stop else "sticks by static friction"
    valve = "closed"
    if any(openings):
        chamber = 1 if openings.source_1 > 0.0 else 2
        is_vacuum = min(at["supply_pressure"], at["dorsiflexion_pressure"]) < atmosphere
        valve = f"{'evacuates' if is_vacuum else 'feeds'} chamber {chamber}, open by {max(openings):.4g}"
    return {"valve": valve, joint.name: vane, **regimes}


def _regime(curve: FlowCurve, pressure_a: float, pressure_b: float, opening: float) -> str:
    """Flow regime between two pressures [Pa] at an opening [-], in words."""
    if opening == 0.0:
        return "closed"
    ratio = min(pressure_a, pressure_b) / max(pressure_a, pressure_b)
    if ratio <= curve.critical_ratio:
        return f"choked, pressure ratio {ratio:.3f}"
    near = ", on the straight line near equal pressures" if ratio > curve.linear_ratio else ""
    return f"below choking, pressure ratio {ratio:.4f}{near}"


EQUILIBRIUM = "equilibrium"
DEAF = "a small change of the command has no effect (dead band, slew limit, saturation): the column of the command is 0"


def linear_model(scenario: Scenario, at: float | str) -> LinearModel:
    """Return the linear model of a scenario at a time [s] of its run, a number or a text, or at ``EQUILIBRIUM``.

    Raises ScenarioError for regulated supplies, an on/off valve, and an operating point that does not exist.
    """
    run = plan_run(scenario)
    if scenario.supply_lines is not None:
        raise ScenarioError(f"{scenario.name}: the linear model assumes a constant supply pressure; omit [supply_line]")
    if not opens_in_proportion(run):
        raise ScenarioError(
            f"{scenario.name}: valve '{scenario.device.valve_name}' switches on and off, so its flow has no "
            "derivative with respect to the command; set device.valve to a proportional valve"
        )
    if at == EQUILIBRIUM:
        return model_at(scenario, run, equilibrium(scenario))
    problem = f"{scenario.name}: {argument_text('at', str(at))} must be a time, for example '1 s', or '{EQUILIBRIUM}'"
    with refused_as(ScenarioError, problem, UnitError):
        time = float(at) if isinstance(at, Real) else parse_quantity(str(at), "s")
    return model_at(scenario, run, point_at(scenario, time))


def model_at(scenario: Scenario, run: Run, point: Point) -> LinearModel:
    """Return the linear model at an operating point, with one-sided slopes on the sides given by ``side_of``."""
    values, plant = dict(point.values), plant_of(run, point.direction, point.values, point.time or 0.0)
    rates_here, outputs_here = plant.at(values)
    # Slopes of rates and outputs on the side of ``side_of`` and on the other side, and estimates of their errors.
    slopes: dict[str, tuple[Floats, Floats, Floats]] = {}
    for name in (*rates_here, *plant.inputs):

        def rates_and_outputs(value: float, name: str = name) -> Floats:
            rates, outputs = plant.at({**values, name: value})
            return np.array([*rates.values(), *outputs.values()])

        side, size = side_of(name, values, plant.direction), size_of(name)
        near_name, error = one_sided_slopes(rates_and_outputs, values[name], side, size)
        far_name, far_error = one_sided_slopes(rates_and_outputs, values[name], -side, size)
        slopes[name] = near_name, far_name, error + far_error
    # What the valve takes from its command at once is no state: nothing but the output that shows it asks for it.
    rows = [*(f"rate of {state}" for state in rates_here), *outputs_here]
    # A second chamber that the actuator lacks stays at the atmosphere, without any slope.
    idle = [name for name in rates_here if run.program.has_one_chamber and name in OF_SECOND_CHAMBER]
    for name in (name for name in rates_here if name.startswith(VALVE)):
        other_rows = [row != name for row in rows]
        if not any(np.any(side[other_rows]) for side in slopes[name][:2]):
            idle.append(name)
    states, outputs = ([name for name in names if name not in idle] for names in (rates_here, outputs_here))
    columns = [*states, *plant.inputs]
    is_row = [name not in idle for name in (*rates_here, *outputs_here)]
    near, far, errors = (np.array([slopes[name][index] for name in columns]).T[is_row] for index in (0, 1, 2))
    sizes = np.array([size_of(name) for name in columns])
    largest = np.max(np.maximum(np.abs(near), np.abs(far)) * sizes, axis=1, keepdims=True)
    is_kink = np.any(np.abs(near - far) * sizes > ON_THE_EDGE * largest + 10.0 * errors * sizes, axis=0)
    near = np.where(np.abs(near) * sizes > ZERO * largest, near, 0.0)
    count = len(states)
    a, b, c, d = near[:count, :count], near[:count, count:], near[count:, :count], near[count:, count:]
    sides = sides_of(run, point, scenario.device.joint)
    if point.direction is None and scenario.motion.locked_angle is not None:
        sides[scenario.device.joint.name] = "locked"
    if not np.any(b[:, 0]) and not np.any(d[:, 0]):
        sides["valve"] += f"; {DEAF}"
    kinks = [name for name, differs in zip(columns, is_kink.tolist(), strict=True) if differs]
    model = LinearModel(
        scenario=scenario,
        time=point.time,
        states=tuple(LinearSignal(name, UNITS[name], values[name]) for name in states),
        inputs=tuple(LinearSignal(name, UNITS[name], values[name]) for name in plant.inputs),
        outputs=tuple(LinearSignal(name, UNITS[name], outputs_here[name]) for name in outputs),
        a=a,
        b=b,
        c=c,
        d=d,
        rates=np.array([rates_here[name] for name in states]),
        sides=sides,
        edges=tuple(SlopeKink(name, side_of(name, values, point.direction) > 0.0) for name in kinks),
        delays=OmittedDelays(run.command_delay, run.signal_delay, run.period),
    )
    return replace(model, margins=loop_margins(model))
