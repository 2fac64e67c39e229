"""Evaluation of a simulated walk: status, recording, strides, averages and metrics from the rows of the engine."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ppafo.engine.channels import REQUEST
from ppafo.engine.lanes import BatchResult, Floats
from ppafo.engine.run import Run
from ppafo.metrics import METRICS, evaluate
from ppafo.metrics.command import command_reversals, peak_torque, requested_samples
from ppafo.metrics.metric import MetricKind, Metrics
from ppafo.metrics.strides import PER_STRIDE, SETTLING
from ppafo.model.contact import SWING
from ppafo.model.helping import PUSH_OFF
from ppafo.model.leg import LegParameters, passive_torque, torque_on_knee
from ppafo.signals import Recording
from ppafo.signals.meter import LED_SHANK, REQUESTED
from ppafo.simulation.contradictions import check_no_bottle
from ppafo.simulation.motion_kind import Measured
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Status, end_of, rows_by_path
from ppafo.simulation.vane_recording import device_channels, recording_of
from ppafo.units.shown import in_units
from ppafo.walking.bottle.coupling import UNITS, SupplyCourse
from ppafo.walking.gait_series import ankle_path
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import law_of, requests_torque
from ppafo.walking.result import WalkResult
from ppafo.walking.strides import (
    healthy_positive_work,
    lowest_toes,
    mean_curves,
    metrics_of_walk,
    per_stride,
    stride_starts,
)

_PHASE_ROW = "controller_state.phase.phase"
"""Paths of the rows for gait phase and requested torque of a controller that has them."""


def swing_knee_torque(leg: LegParameters, time: Floats, record: Mapping[str, Any]) -> Floats:
    """Return the knee torque T_1 [N m] of equation (11) for the prescribed swing of shank and foot; 0 in stance.

    In stance the torque depends on the horizontal ground reaction, which a gait file does not contain.
    """
    shank = record["walk.now.shank"]
    rate = record["state.angular_velocity"]
    foot = shank - record["state.angle"] + 0.5 * np.pi
    directions = np.sin(shank), np.cos(shank), np.sin(foot), np.cos(foot)
    torque = torque_on_knee(
        leg,
        *directions,
        record["walk.now.shank_rate"],
        record["walk.now.shank_acceleration"],
        rate,
        # A walk that fails at once has one sample, and no acceleration is known of it.
        np.gradient(rate, time) if len(time) > 1 else np.zeros_like(rate),
        record["walk.now.knee_forward"],
        record["walk.now.knee_up"],
    )
    return np.where(record["walk.contact"] == SWING, torque, 0.0)


def recording_of_walk(
    scenario: Scenario, run: Run, time: Floats, record: Mapping[str, Floats], supply: SupplyCourse | None = None
) -> Recording:
    """Return the recording of a walk [SI] from its rows (samples,) by path at times [s]; ``supply`` is its bottle."""
    walk = run.walk
    gait = walk_of(scenario).gait
    assert walk is not None, "a walk has a leg"
    plant = run.plant
    if supply is not None:
        # The gas of the bottle has one temperature between two exchanges with the device.
        exchanges = np.searchsorted(supply.times, time + 1.0e-9 * run.step, side="right") - 1
        latest = np.minimum(np.maximum(exchanges, 0), supply.times.size - 2)
        temperature = supply.values["gas_temperature"]
        gas_product: Any = plant.gas_product * (temperature / temperature[0])[latest]
        plant = plant._replace(gas_product=gas_product)
    path = ankle_path(gait, walk.timing, walk_of(scenario).wearer)
    angle, rate, external = (record[row] for row in ("state.angle", "state.angular_velocity", "walk.external_torque"))
    channels = device_channels(scenario.device.gas, replace(run, plant=plant), record)
    channels |= {
        "shank_angle": (record["walk.now.shank"], "rad"),
        "healthy_angle": (record["walk.now.ankle"], "rad"),
        "external_torque": (external, "N m"),
        "device_power": (external * rate, "W"),
        "swing_knee_torque": (swing_knee_torque(walk.leg, time, record), "N m"),
        "toe_height": (path.toe_height(record["walk.now.phase"], record["walk.now.shank"], angle), "m"),
        "contact": (record["walk.contact"], "-"),
        "heel_force": (record["walk.heel_force"], "N"),
        "toe_force": (record["walk.toe_force"], "N"),
    }
    if walk.leg.keeps_gait >= 0.5:
        # With this moment, at least 0, the wearer follows the measured ankle angle: the ankle moment of the gait (from
        # equation (11) in swing) minus the moment of passive tissue and T_ex. The literature reports the activity of
        # the tibialis anterior instead.
        is_swing = record["walk.contact"] == SWING
        needed = np.where(is_swing, record["walk.now.healthy_torque"], record["walk.now.moment"])
        of_tissue: Any = passive_torque  # plain arithmetic, of arrays too
        tissue = of_tissue(walk.leg, record["walk.now.ankle"])
        channels["dorsiflexor_moment"] = (np.maximum(tissue + external - needed, 0.0), "N m")
    if supply is not None:
        # Interpolated linearly between the exchanges of bottle and device.
        for name, values in supply.values.items():
            channels[name] = (np.interp(time, supply.times, values), UNITS[name])
        channels["bottle_mass"] = (supply.met[0].state.mass - record["line_state.regulated_mass"], "kg")
    if _PHASE_ROW in record:
        channels["controller_phase"] = (record[_PHASE_ROW], "-")
    if REQUEST in record:
        channels["reference"] = (record[REQUEST], "N m")
    return recording_of(f"walk, {scenario.name}", run, time, channels)


def result_of_walk(scenario: Scenario, run: Run, outcome: BatchResult, supply: SupplyCourse | None) -> WalkResult:
    """Return the result of a walk from the outcome of its run, up to a divergence; ``supply`` is its bottle."""
    status, time = end_of(run, outcome)
    if status.is_completed and supply is not None and supply.ending.time < run.step * (run.step_count - 0.5):
        ended = supply.ending
        whole = scenario.run.duration
        status = Status("ended early", ended.time, f"ended after {ended.time:.6g} of {whole:.6g} s: {ended.message}")
        time = time[: max(int(np.searchsorted(time, ended.time)), 1)]
    return _evaluated(scenario, run, time, rows_by_path(run, outcome.record[: time.size]), status, supply)


@in_units(lambda scenario, *_: scenario.device.shown)
def _evaluated(
    scenario: Scenario,
    run: Run,
    time: Floats,
    record: Mapping[str, Floats],
    status: Status,
    supply: SupplyCourse | None,
) -> WalkResult:
    """Return the result of a walk from its rows (samples,) by path at times [s], up to the time of a failure.

    Means leave out the first strides, in which the controller adapts.
    """
    recording = recording_of_walk(scenario, run, time, record, supply)
    starts = stride_starts(record["walk.strides"])
    strides = per_stride(record, starts)
    averages = mean_curves(recording, starts[SETTLING:])
    whole = strides["gas"].size
    averaged = max(whole - SETTLING, 0)
    values = {name: float(strides[name][SETTLING:].mean()) for name in PER_STRIDE} if averaged else {}
    values["counted_strides"] = float(averaged)
    healthy = healthy_positive_work(scenario)
    if healthy > 0.0:
        values["healthy_positive_work"] = healthy
    if healthy > 0.0 and averaged:
        values["push_off_share"] = values["positive_push_off_work"] / healthy
    if "dorsiflexor_moment" in averages:
        # Phase 1 is phase 0 of the next stride, and counts once.
        values["dorsiflexor_moment"] = float(averages["dorsiflexor_moment"].mean[:-1].mean())
    if "toe_height" in averages:
        values["lowest_toes"] = lowest_toes(scenario, averages["toe_height"].mean)
    if "angle" in averages:
        # Of the mean curves: what differs from stride to stride is in their deviation.
        away = averages["angle"].mean - averages["healthy_angle"].mean
        values["angle_difference"] = float(np.sqrt(np.mean(away**2)))
    values["strides"] = float(whole)
    values["total_gas"] = float(np.ptp(recording["supplied_mass"][[0, -1]]))
    if "reference" in recording:
        reference = recording["reference"]
        requested = requested_samples(recording)
        error = reference - recording["torque"]
        # A controller that requests a torque is judged by how well it gets it in push-off.
        settled = slice(*starts[[SETTLING, -1]]) if starts.size > SETTLING else slice(0)
        pushes = recording["controller_phase"][settled] == PUSH_OFF
        parts = {"push_off_error": error[settled][pushes], "torque_error": error[requested]}
        parts["requested_torque"] = reference[requested]
        values |= {name: float(np.sqrt(np.mean(part**2))) for name, part in parts.items() if part.size}
    values |= {"peak_torque": peak_torque(recording), "command_reversals": command_reversals(recording)}
    METRICS.load_all()
    others = [kind for name, kind in METRICS.items() if not METRICS.is_own(name) and not lacks(scenario, kind)]
    return WalkResult(
        scenario=scenario,
        recording=recording,
        strides=strides,
        averages=averages,
        metrics=Metrics(metrics_of_walk(values) | evaluate(recording, others)),
        status=status,
        starts=starts,
        supply=supply,
    )


def measured(scenario: Scenario, run: Run, time: Floats, record: Mapping[str, Floats]) -> Measured:
    """Return recording and metrics of a walk from its rows (samples,) by path, at these times [s]."""
    check_no_bottle(scenario)
    result = _evaluated(scenario, run, time, record, Status("completed", None, "completed"), None)
    # The catalogue lists metrics of plugins by module and object, a recording by the name of the metric.
    kinds = {kind.name: kind for kind in METRICS.values()}
    of_recording = evaluate(result.recording).items()
    available = {name: metric for name, metric in of_recording if not lacks(scenario, kinds[name])}
    return result.recording, {**available, **result.metrics}


def lacks(scenario: Scenario, kind: MetricKind) -> str:
    """Return the reason that a metric is not available for a walk; empty if it is available."""
    if kind.of_reference:
        return "a walk has no single torque reference; push_off_error is the error in push-off"
    if kind.traced:
        return "the metric needs the whole run over time, which a walk does not keep"
    if LED_SHANK in kind.needs:
        return "the metric needs a leg without ground contact, whose shank follows a gait"
    is_asked = not scenario.controller.is_outside or scenario.controller.settings
    if REQUESTED in kind.needs and not (is_asked and requests_torque(law_of(scenario))):
        return f"controller '{scenario.controller.kind}' requests no torque"
    return ""
