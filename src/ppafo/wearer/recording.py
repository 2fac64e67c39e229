"""A walk of a neuromuscular gait model as a recording with its metrics: rows of the engine as channels with units.

A body of its own walks here, so that nothing is compared with a gait: toes are over the ground, and strides are those
that the wearer makes.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.lane_samples import FELL, WEARER_ROWS
from ppafo.engine.lanes import Floats
from ppafo.engine.run import Run
from ppafo.metrics import Metric
from ppafo.metrics.metric import Metrics, Readings
from ppafo.metrics.strides import PER_STRIDE, SETTLING
from ppafo.metrics.wearer import METER, WearerTotals
from ppafo.metrics.wearer import METRICS as OF_WEARER
from ppafo.signals import Channel, Recording
from ppafo.signals.meter import WearerSample
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Status
from ppafo.simulation.vane_recording import gas_channels
from ppafo.walking.bottle import SupplyCourse
from ppafo.walking.channels import Channels, actuator_channels, controller_channels, valve_and_ground_channels
from ppafo.walking.events import SAFE_ROW, safety_events
from ppafo.walking.result import WalkResult, supply_channels, with_cold_gas
from ppafo.walking.strides import (
    counts_of_strides,
    first_less_help,
    helped_strides,
    mean_curves,
    per_stride,
    settled,
    stride_starts,
)
from ppafo.wearer.model.muscle import Fibre
from ppafo.wearer.model.segments import Limb
from ppafo.wearer.model.walker import Fibres, Joints, Wearer, end_of_joint, joints, pull
from ppafo.wearer.model.way import footing
from ppafo.wearer.scheme import ReactingWalk


def recording_of_reacting(
    configuration: Scenario,
    run: Run,
    time: Floats,
    record: Mapping[str, Floats],
    of_bottle: Mapping[str, tuple[Floats, str]],
) -> Recording:
    """The recording of a neuromuscular gait model [SI] from rows (samples,) by path, with the channels of a bottle."""
    assert isinstance(run.walk, ReactingWalk), "the walk of a neuromuscular gait model"
    body = run.walk.body
    left, right = (angles_of(record, side) for side in ("left", "right"))
    channels: Channels = {
        "angle": (record["state.angle"], "rad"),
        "angular_velocity": (record["state.angular_velocity"], "rad/s"),
        "shank_angle": (record["walk.now.shank"], "rad"),
        "knee_angle": (left.knee, "rad"),
        "hip_angle": (left.hip, "rad"),
        "other_ankle_angle": (right.ankle, "rad"),
        "other_knee_angle": (right.knee, "rad"),
        "other_hip_angle": (right.hip, "rad"),
        "trunk_lean": (record["walker.pose.lean"], "rad"),
        "hip_height": (record["walker.pose.y"], "m"),
        "hip_position": (record["walker.pose.x"], "m"),
        "ground_force": (body.weight * record["walk.load"], "N"),
        "other_ground_force": (body.weight * record["walk.other_load"], "N"),
        **actuator_channels(run, record),
        "toe_height": (toe_heights(body, record), "m"),
        **valve_and_ground_channels(record),
        "wearer_ankle_moment": (ankle_moments(body, record, left), "N m"),
        "muscle_work": (record["walk.muscle_work"], "J"),
    }
    for name in Fibres._fields:
        channels[f"{name}_activation"] = (record[f"walker.left.fibres.{name}.activation"], "-")
    channels |= gas_channels(configuration.device.gas, run, record) | dict(of_bottle) | controller_channels(record)
    values = {name: Channel(np.asarray(series), unit) for name, (series, unit) in channels.items()}
    return Recording(f"walk, {configuration.name}", time, values, kind="simulated")


def angles_of(record: Mapping[str, Floats], side: str) -> Joints:
    """Joint angles [rad] of a leg, ``left`` or ``right``, sample by sample."""
    angles: Any = [record[f"walker.pose.{side}.{name}"] for name in Limb._fields]
    limb = Limb(*angles)
    lean: Any = record["walker.pose.lean"]
    return joints(limb, lean)


def toe_heights(wearer: Wearer, record: Mapping[str, Floats]) -> Floats:
    """Height [m] of the left toes over the ground below them, sample by sample."""
    body = wearer.body
    thigh, shank, foot = (record[f"walker.pose.left.{name}"] for name in Limb._fields)
    x = record["walker.pose.x"] + body.thigh.length * np.sin(thigh) + body.shank.length * np.sin(shank)
    y = record["walker.pose.y"] - body.thigh.length * np.cos(thigh) - body.shank.length * np.cos(shank)
    ground = [footing(wearer.way, at).height for at in (x + body.foot.length * np.cos(foot)).tolist()]
    found: Floats = y + body.foot.length * np.sin(foot) - np.array(ground)
    return found


def ankle_moments(wearer: Wearer, record: Mapping[str, Floats], angles: Joints) -> Floats:
    """Moments [N m] of muscles, tissue and the soft ends of the joint on the left ankle, sample by sample."""
    still = Joints(0.0, 0.0, 0.0)
    low, high, muscles = wearer.stop.ankle_low, wearer.stop.ankle_high, wearer.left
    fibres = np.array(
        [[record[f"walker.left.fibres.{name}.{field}"] for field in Fibre._fields] for name in Fibres._fields]
    )
    found = np.empty(fibres.shape[-1])
    # Sample by sample with the function that the engine runs, which takes floats alone: no second form of the muscles.
    for sample, (own, ankle, knee, hip, rate) in enumerate(
        zip(
            np.moveaxis(fibres, -1, 0).tolist(),
            *(np.asarray(values).tolist() for values in (*angles, record["state.angular_velocity"])),
            strict=True,
        )
    ):
        pulled = pull(muscles, Fibres._make(Fibre._make(fibre) for fibre in own), Joints(ankle, knee, hip), still, 0.0)
        end = end_of_joint(wearer.stop, low, high, ankle, rate)
        found[sample] = pulled.ankle + end.torque - muscles.ankle_stiffness * (ankle - muscles.ankle_rest)
    return found


def sample_at(time: Floats, record: Mapping[str, Floats], place: int) -> WearerSample:
    """What a meter is shown at a sample."""
    totals = {field: float(record[row][place]) for field, row in WEARER_ROWS.items()}
    return WearerSample(**totals, time=float(time[place]))


def reacting_metrics(
    recording: Recording,
    record: Mapping[str, Floats],
    starts: NDArray[np.intp],
    strides: Mapping[str, Floats],
    helped: NDArray[np.bool_],
    fall_time: float,
) -> dict[str, Metric]:
    """Metrics of a neuromuscular gait model by name, in SI, of the strides without the first ones until a fall.

    ``starts`` are the samples after each strike, ``strides`` numbers of each whole stride, ``helped`` those with help.
    """
    time, counted = recording.time, np.arange(helped.size) >= SETTLING
    # Read as a study reads them, from the samples that its meter keeps.
    now = sample_at(time, record, -1)._replace(fall_time=fall_time)
    first, last = (sample_at(time, record, starts[place]) for place in (SETTLING, -1)) if counted.any() else (now, now)
    readings = Readings(
        meters={METER.name: WearerTotals(first=first, last=last, now=now)},
        course=(),
        interval=np.zeros(()),
        samples=time.size,
        gains={},
        traces={},
    )
    found: dict[str, Metric] = {}
    for kind in OF_WEARER:
        value = float(kind.read(readings))
        # Without a whole stride a mean has no value, and the metric is left out.
        if math.isfinite(value):
            found[kind.name] = Metric(value, kind.unit, kind.summary)
    for name, item in PER_STRIDE.items():
        own = strides[name][counted & helped]
        if own.size and name != "toe_clearance":
            found[name] = Metric(float(own.mean()), item.unit, f"{item.summary}, mean")
    found["counted_strides"] = Metric(float((counted & helped).sum()), "-", "strides over which the means are taken")
    return found | counts_of_strides(recording, helped) | first_less_help(recording)


def reacting_result(
    scenario: Scenario,
    run: Run,
    time: Floats,
    record: Mapping[str, Floats],
    status: Status,
    supply: SupplyCourse | None,
) -> WalkResult:
    """The result of a neuromuscular gait model, until the end or a fall."""
    fall_time = float(record[FELL][-1])
    stands = record[FELL] < 0.0
    # A recording has a sample at least.
    stands[0] = True
    time, rows = time[stands], {path: values[stands] for path, values in record.items()}
    recording = recording_of_reacting(
        scenario,
        with_cold_gas(run, supply, time),
        time,
        rows,
        {} if supply is None else supply_channels(supply, time, rows),
    )
    starts = stride_starts(rows["walk.strides"])
    strides = per_stride(rows, starts)
    helped = helped_strides(rows.get(SAFE_ROW, np.zeros(time.size)), starts)
    metrics = reacting_metrics(recording, rows, starts, strides, helped, fall_time)
    if fall_time >= 0.0 and status.is_completed:
        status = Status("completed", None, f"completed: the wearer fell at t = {fall_time:.4g} s")
    return WalkResult(
        scenario=scenario,
        recording=recording,
        strides=strides,
        averages=mean_curves(recording, starts, settled(helped)),
        metrics=Metrics(metrics),
        status=status,
        starts=starts,
        helped=helped,
        vented_metrics={},
        events=safety_events(scenario, recording.time, rows),
        supply=supply,
    )
