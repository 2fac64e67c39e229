"""Results of a walk: recording with units from the rows of the engine, numbers of each stride, and averages."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.lanes import BatchResult, Floats
from ppafo.engine.run import NEVER_FAILED, TOO_MANY_PARTS, Run, Walk, state_row_numbers
from ppafo.engine.scheme.actuators import pressures_of, torque_of
from ppafo.engine.step.lane import LaneResult
from ppafo.metrics import METRICS, Metric, evaluate
from ppafo.metrics.metric import MetricKind, Metrics
from ppafo.signals import Channel, Recording
from ppafo.signals.meter import LED_SHANK, REQUESTED, STEADY
from ppafo.signals.recording import OF_SECOND_CHAMBER
from ppafo.simulation import at_hand
from ppafo.simulation.motion_kind import Measured
from ppafo.simulation.numbers import changes_in
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Status
from ppafo.simulation.tracking import Tracking, following_text, tracking_in
from ppafo.simulation.vane_recording import gas_channels
from ppafo.storage.opensim import write_opensim
from ppafo.storage.opensim_names import opensim_recording
from ppafo.units.shown import in_units
from ppafo.walking.bottle.course import UNITS, SupplyCourse
from ppafo.walking.contradictions import check_no_bottle
from ppafo.walking.gait_series import AnklePath, ankle_path, truncate
from ppafo.walking.inverse_dynamics import dorsiflexor_moment, swing_knee_torque
from ppafo.walking.motion import walk_of
from ppafo.walking.person import as_drawn
from ppafo.walking.planning import requests_torque, task_sequence_of_walk
from ppafo.walking.safety_events import SAFE_ROW, SafetyEvent, safety_events
from ppafo.walking.stride_events import EVENT_ROW, FRACTION_ROW, PHASE_ROW, clock_row
from ppafo.walking.strides import (
    Curves,
    SegmentResult,
    helped_strides,
    mean_curves,
    per_stride,
    segment_results,
    settled,
    steady_strides,
    stride_metrics,
    stride_starts,
    task_sequence_metrics,
    walk_metrics,
)
from ppafo.walking.task_sequence_plan import PlannedSequence, pace_in_time
from ppafo.wording import changed_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_REQUEST_ROW = "controller_state.request.torque"
"""Path of the row for the requested torque of a torque-following controller."""

REMEDY = "the time step may be too long, or a value unrealistic: try a smaller run.step, and check the wearer"


def led_leg(run: Run) -> Walk:
    """Return leg and gait parameters of a planned walk; the run must be a walk."""
    assert run.walk is not None, "a walk has a leg"
    return run.walk


def recording_of_walk(
    configuration: Scenario, run: Run, time: Floats, record: Mapping[str, Floats], supply: SupplyCourse | None = None
) -> Recording:
    """Return the recording of a walk [SI] from its rows (samples,) by path at these times [s] and its supply."""
    led, plant, actuator = led_leg(run), run.plant, run.program.actuator
    if supply is not None:
        # The gas of each time, as it was in force between two meetings of bottle and device.
        met = np.maximum(np.searchsorted(supply.times, time + 1.0e-9 * run.step, side="right") - 1, 0)
        warmth = supply.values["gas_temperature"] / supply.values["gas_temperature"][0]
        product: Any = plant.gas_product * warmth[np.minimum(met, supply.times.size - 2)]
        plant = plant._replace(gas_product=product)
    angle, rate, external = (record[row] for row in ("state.angle", "state.angular_velocity", "walk.external_torque"))
    pressure_1, pressure_2 = pressures_of(actuator, plant, angle, record["state.mass_1"], record["state.mass_2"])
    path = ankle_path(walk_of(configuration).gait, led.timing, walk_of(configuration).wearer)
    channels: dict[str, tuple[Any, str]] = {
        "angle": (angle, "rad"),
        "angular_velocity": (rate, "rad/s"),
        "shank_angle": (record["walk.now.shank"], "rad"),
        "healthy_angle": (record["walk.now.ankle"], "rad"),
        "pressure_1": (pressure_1, "Pa"),
        "pressure_2": (pressure_2, "Pa"),
        "torque": (torque_of(actuator, plant, angle, pressure_1, pressure_2), "N m"),
        "external_torque": (external, "N m"),
        "device_power": (external * rate, "W"),
        "swing_knee_torque": (swing_knee_torque(led.leg, time, record), "N m"),
        "toe_height": (path.toe_height(record["walk.now.phase"], record["walk.now.shank"], angle), "m"),
        "command": (record["result.command"], "-"),
        "contact": (record["walk.contact"], "-"),
        "heel_force": (record["walk.heel_force"], "N"),
        "toe_force": (record["walk.toe_force"], "N"),
        "supplied_mass": (record["state.supplied_mass"], "kg"),
        "vented_mass": (record["state.vented_mass"], "kg"),
    }
    if led.leg.keeps_gait >= 0.5:
        channels["dorsiflexor_moment"] = (dorsiflexor_moment(led.leg, record), "N m")
    channels |= gas_channels(configuration.device.gas, replace(run, plant=plant), record)
    if supply is not None:
        # The bottle's, straight between the times at which it met the device.
        for name, course in supply.values.items():
            channels[name] = (np.interp(time, supply.times, course), UNITS[name])
        channels["bottle_mass"] = (supply.first.mass - record["line_state.regulated_mass"], "kg")
    if PHASE_ROW in record:
        channels["controller_phase"] = (record[PHASE_ROW], "-")
        channels["safe_state"] = (record[SAFE_ROW], "-")
    if _REQUEST_ROW in record:
        channels["reference"] = (record[_REQUEST_ROW], "N m")
    fraction, event = clock_row(record, FRACTION_ROW), clock_row(record, EVENT_ROW)
    if fraction is not None and event is not None:
        channels["gait_fraction"], channels["gait_event"] = (fraction, "-"), (event, "-")
    if led.task_sequence is not None:
        channels |= _task_sequence_channels(configuration, run, path, time, record)
    absent = OF_SECOND_CHAMBER if run.program.has_one_chamber else frozenset()
    values = {
        name: Channel(np.asarray(series), unit) for name, (series, unit) in channels.items() if name not in absent
    }
    return Recording(f"walk, {configuration.name}", time, values, kind="simulated")


def _task_sequence_channels(
    configuration: Scenario, run: Run, path: AnklePath, time: Floats, record: Mapping[str, Any]
) -> dict[str, tuple[Any, str]]:
    """Return the additional channels of a task sequence, and toe heights above ground that may be stairs or a slope.

    The healthy toe height is the gait's, scaled with the stride relative to the recorded one.
    """
    sequence = led_leg(run).task_sequence
    assert sequence is not None, "of a task sequence"
    gait, (_, frequency, stride) = walk_of(configuration).gait, pace_in_time(sequence, time)
    phase, shank = record["walk.now.phase"], record["walk.now.shank"]
    healthy = path.toe_height(
        phase, truncate(gait.shank_angle).values_at(phase), truncate(gait.ankle_angle).values_at(phase)
    )
    above = path.toes_over_ankle(shank, record["state.angle"]) - path.toes_over_ankle(shank, record["walk.now.ankle"])
    channels: dict[str, tuple[Any, str]] = {
        "toe_height": (stride * healthy + above, "m"),
        "stride_frequency": (frequency, "Hz"),
    }
    if gait.walking_speed is not None:
        channels["walking_speed"] = (gait.walking_speed * stride * frequency * gait.stride_time, "m/s")
    return channels


WALK_FORMAT = "ppafo walk"
"""Format name in saved walk results, by which analyses recognise them."""


_in_own_units = in_units(lambda walked, *_, **__: walked.scenario.device.shown)


@dataclass(frozen=True, slots=True, repr=False, eq=False)
class WalkResult:
    """Result of a walk. Averages and metrics use assisted strides after the first ones, in which the controller adapts.

    For a task sequence, averages and metrics use steady strides on level ground only.

    - ``scenario``: scenario of the walk
    - ``recording``: channels over time [SI]
    - ``strides``: numbers of each whole stride [SI], each (strides,), by name
    - ``averages``: mean curves over the stride, by channel
    - ``metrics``: numbers of the whole walk, by name
    - ``status``: completed, or diverged with the time [s]
    - ``starts``: samples directly after each heel strike
    - ``helped``: True for each stride with full assistance (strides,)
    - ``vented_metrics``: metrics of the strides with reduced assistance (lifted only, paused or stopped), {} without
      any
    - ``events``: pauses, the stop and returns of assistance
    - ``segments``: results of the segments of a task sequence, () without one
    - ``supply``: gas bottle over the walk, None without a bottle
    """

    scenario: Scenario
    recording: Recording
    strides: Mapping[str, Floats]
    averages: Mapping[str, Curves]
    metrics: Mapping[str, Metric]
    status: Status
    starts: NDArray[np.intp]
    helped: NDArray[np.bool_]
    vented_metrics: Mapping[str, Metric]
    events: tuple[SafetyEvent, ...]
    segments: tuple[SegmentResult, ...] = ()
    supply: SupplyCourse | None = None

    @property
    def is_helped(self) -> bool:
        """True if at least half of the whole strides were assisted."""
        return 2 * int(self.helped.sum()) >= self.helped.size

    @property
    def peak_torques(self) -> Floats:
        """Peak torque [N m] of each whole stride (strides,)."""
        if self.starts.size < 2:
            return np.zeros(0)
        return np.maximum.reduceat(self.recording["torque"], self.starts)[:-1]

    @property
    def tracking(self) -> Tracking | None:
        """Verdict on a torque that does not follow the controller's request; None if it follows."""
        strides = self.metrics.get("strides")
        return None if strides is None or strides.value == 0.0 else tracking_in(self)

    @_in_own_units
    def torque_sentence(self, verdict: Tracking | None) -> str:
        """Sentence on the torque: whether it follows its reference; "" if not judged.

        ``verdict`` is ``tracking``, with or without remedies that were tried.
        """
        if verdict is not None:
            return verdict.sentence
        return following_text(self) if self.is_helped and "strides" in self.metrics else ""

    @property
    def help_text(self) -> str:
        """Number of assisted strides as text, with a remark if fewer than half were assisted."""
        enough = "" if self.is_helped else ": fewer than half"
        return f"help in {int(self.helped.sum())} of {self.helped.size} strides{enough}"

    @_in_own_units
    def __repr__(self) -> str:
        """Return name, status, duration and a line for each metric, in display units."""
        from ppafo.report.display_units import name_lines

        head = f"Walk '{self.scenario.name}', {self.recording.time[-1] / 60.0:.3g} min: {self.status.message}"
        return "\n".join([head, *name_lines(self.metrics)])

    @_in_own_units
    def __str__(self) -> str:
        """Return status, verdict and metrics in display units, as printed by ``ppafo simulate``."""
        from ppafo.report.display_units import metrics_lines

        verdict = [self.scenario.origin.replaced, changed_text(changes_in(self.scenario))]
        if self.status.is_completed:
            verdict += [self.torque_sentence(self.tracking), "" if self.is_helped else self.help_text]
            toes = self.metrics.get("lowest_toes")
            if toes is not None and toes.value < 0.0:
                verdict.append("the toes would drag in mid-swing: the ankle is not lifted enough")
        verdict = [line for line in verdict if line]
        return "\n".join([f"{self.scenario.name}: {self.status.kind}", *verdict, "", *metrics_lines(self.metrics)])

    @_in_own_units
    def plot(self, width: float | str | None = None) -> "Figure":
        """Return a figure of the mean stride and of the healthy gait; ``.savefig(...)`` writes the figure to a file.

        ``width`` is the width in print, such as "84 mm", or a number [m]; by default 145 mm.
        """
        from ppafo.report.notebook import shown
        from ppafo.report.style import drawn_at
        from ppafo.walking.figures.mean_stride import walk_figure

        with drawn_at(width):
            return shown(walk_figure({self.scenario.name: self}))

    __getitem__ = at_hand.channel_values
    _ipython_key_completions_ = at_hand.channel_names
    _repr_html_ = at_hand.html
    dataset = at_hand.dataset
    to_dataframe = at_hand.dataframe

    def save_opensim(self, path: str | Path) -> Path:
        """Write the recording as a ``.sto`` file with OpenSim's names, zeros and signs (right leg); return the path."""
        named, _ = opensim_recording(self.recording, body_mass=walk_of(self.scenario).wearer.body_mass)
        return write_opensim(path, named)


def result_of_walk(scenario: Scenario, run: Run, outcome: BatchResult, supply: SupplyCourse | None) -> WalkResult:
    """Return the result of a walk from the outcome of its run, up to a divergence; ``supply`` is the bottle."""
    rows = state_row_numbers(run)
    record = {name: outcome.record[:, row, 0] for name, row in rows.items()}
    failed, too_many_parts = (float(outcome.states[rows[f"result.{name}"], 0]) for name in LaneResult._fields[1:])
    status = _status(failed, bool(too_many_parts), outcome.states)
    time = np.arange(outcome.record.shape[0], dtype=np.float64) * (run.step * run.record_every)
    if status.time is not None:
        kept = time < status.time
        # A recording has a sample, so a walk that fails at once keeps its start.
        kept[0] = True
        time, record = time[kept], {name: values[kept] for name, values in record.items()}
    return _result(scenario, run, time, record, status, supply)


@in_units(lambda scenario, *_: scenario.device.shown)
def _result(
    scenario: Scenario,
    run: Run,
    time: Floats,
    record: Mapping[str, Floats],
    status: Status,
    supply: SupplyCourse | None,
) -> WalkResult:
    """Return the result of a walk from its rows (samples,) by path, up to the time at which the run failed."""
    walked, motion = scenario, walk_of(scenario)
    # Whom it is healthy for is the person who walked; what was planned stays in the result.
    gait, wearer = as_drawn(motion.gait, motion.wearer, motion.person)
    scenario = replace(scenario, motion=replace(motion, gait=gait, wearer=wearer))
    recording = recording_of_walk(scenario, run, time, record, supply)
    starts = stride_starts(record["walk.strides"])
    strides = per_stride(record, starts)
    # A controller without a safe state helps in every stride.
    helped = helped_strides(record.get(SAFE_ROW, np.zeros(recording.time.size)), starts)
    planned = task_sequence_of_walk(scenario)
    steady = _counted(planned, recording, starts)
    averages, vented = (mean_curves(recording, starts, chosen & steady) for chosen in (helped, ~helped))
    metrics = walk_metrics(scenario, recording, strides, averages, starts, helped, steady)
    without = ~helped & steady
    apart = stride_metrics(scenario, strides, vented, without) if without.any() else {}
    events = safety_events(scenario, recording.time, record)
    segments: tuple[SegmentResult, ...] = ()
    if planned is not None:
        segments = segment_results(scenario, planned, recording, strides["net_push_off_work"], starts)
        metrics |= task_sequence_metrics(planned, segments, recording, int((helped & steady).sum()))
    return WalkResult(
        scenario=walked,
        recording=recording,
        strides=strides,
        averages=averages,
        metrics=Metrics(metrics),
        status=status,
        starts=starts,
        helped=helped,
        vented_metrics=apart,
        events=events,
        segments=segments,
        supply=supply,
    )


def _status(failed: float, too_many_parts: bool, states: Floats) -> Status:
    """Return the status of a walk from its time of failure [s], if any, and its last states."""
    if failed >= NEVER_FAILED and bool(np.isfinite(states).all()):
        return Status("completed", None, "completed")
    # A number that is none at the end, which the run did not see itself, has no time: it counts from the start.
    time = failed if failed < NEVER_FAILED else 0.0
    remedy = TOO_MANY_PARTS if too_many_parts else REMEDY
    return Status("diverged", time, f"diverged at t = {time:.6g} s; {remedy}")


def measured(scenario: Scenario, run: Run, time: Floats, record: Mapping[str, Floats]) -> Measured:
    """Return recording, metrics and status message of a walk from its rows (samples,) by path, at these times [s]."""
    check_no_bottle(scenario)
    completed = Status("completed", None, "completed")
    result = _result(scenario, run, time, record, completed, None)
    of_recording = evaluate(result.recording)
    # A kind that a module brought stands in the catalogue by the place of the object, and here by its own name.
    kinds = {kind.name: kind for kind in METRICS.values()}
    offered = {name: metric for name, metric in of_recording.items() if not lacks(scenario, kinds[name])}
    return result.recording, {**offered, **result.metrics}, result.status.message


def lacks(scenario: Scenario, kind: MetricKind) -> str:
    """Return the reason that a metric is not available for a walk; empty if it is available."""
    motion, control, law = walk_of(scenario), scenario.controller.kind, scenario.law
    needs = kind.needs
    reasons = (
        (bool(kind.of_reference), "a walk has no single torque reference; push_off_error is the error in push-off"),
        (bool(kind.traced), "the metric needs the whole run over time, which a walk does not keep"),
        (LED_SHANK in needs, "the metric needs a leg without ground contact, whose shank follows a gait"),
        (
            STEADY in needs and motion.task_sequence is not None,
            "the metric is a mean over equal strides, but strides of a task sequence differ: omit the task sequence",
        ),
        (
            REQUESTED in needs and (law is None or not requests_torque(law)),
            f"controller '{control}' requests no torque",
        ),
    )
    return next((reason for is_so, reason in reasons if is_so), "")


def integral_of_a_stride(result: WalkResult, values: Floats) -> float:
    """Return the integral of a channel over the ankle angle in one stride [channel unit times rad], mean over strides.

    The mean uses the assisted strides that count for averages.
    """
    turned = np.diff(result.recording["angle"])
    done = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * turned)])
    planned = task_sequence_of_walk(result.scenario)
    counted = result.helped & _counted(planned, result.recording, result.starts)
    return float(np.diff(done[result.starts])[counted].mean())


def _counted(planned: PlannedSequence | None, recording: Recording, starts: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return True for each whole stride that counts for averages.

    The first strides of a walk do not count. In a task sequence, only steady strides on level ground count.
    """
    if planned is not None:
        return steady_strides(planned, recording.time[starts])
    return settled(np.ones(max(starts.size - 1, 0), dtype=np.bool_))
