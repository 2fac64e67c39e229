"""Runs a walk, and compares it with the device switched off and with a healthy ankle."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.control.walking import event_on_off
from ppafo.engine.lanes import STEPS_PER_CALL, Batch, BatchResult, begin_block
from ppafo.engine.run import batch_of
from ppafo.errors import ScenarioError, SimulationError
from ppafo.metrics import Metric
from ppafo.model.leg import passive_torque
from ppafo.simulation.sampled import run_sampled
from ppafo.simulation.scenario import Control, Scenario
from ppafo.walking.bottle import run_on_bottle
from ppafo.walking.contradictions import check_no_bottle
from ppafo.walking.declaration import THRESHOLDS
from ppafo.walking.gait_series import landing_phase
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import SHORTEST_STRIDES, duration_problems, walk_of, with_duration
from ppafo.walking.planning import fed_device, plan_walk
from ppafo.walking.result import WalkResult, result_of_walk
from ppafo.walking.strides import PHASES, healthy_positive_work, healthy_toe_height, lowest_toes

Progress = Callable[[float, float], None]

Say = Callable[[str], None]


def silent(done: float, total: float) -> None:  # both are there for those who listen
    """Ignore the progress."""


def walk(
    scenario: Scenario | str | Path,
    minutes: float | None = None,
    overrides: Iterable[str] = (),
    gait: str | Path | None = None,
    progress: Progress = silent,
    course: str | Path | None = None,
    bottle: str | Path | None = None,
) -> WalkResult:
    """Walk for ``minutes`` [min]: a scenario that is a walk, the name of a shipped one, or a file.

    Unless ``minutes`` are given it is as long as the file says, or the whole course, or one minute where there is none,
    and up to ten on a bottle, which may end it before. With a name or a file go overrides as for the command, and a
    ``gait``, ``course`` or ``bottle`` in place of its own. A walk that diverges is a result with that status, up to
    the time of failure. ScenarioError or ParameterError for bad input. ``progress`` gets the minutes done and those in
    all, part by part.
    """
    if isinstance(scenario, Scenario):
        if any(item is not None for item in (gait, course, bottle)) or tuple(overrides):
            raise ScenarioError(
                "overrides, a gait, a course and a bottle go with a name or a file; a Scenario takes them in load_walk"
            )
        chosen = scenario
    else:
        chosen = load_walk(scenario, overrides, gait, course, bottle)
    chosen = lasting(chosen, minutes)
    run, carried = plan_walk(chosen), walk_of(chosen).bottle
    custom = chosen.control.custom
    if custom is not None:
        check_no_bottle(chosen)
        return result_of_walk(chosen, run, run_sampled(batch_of(run), custom), None)
    if carried is None:
        return result_of_walk(chosen, run, _run_in_parts(batch_of(run), run.step, progress), None)
    outcome, supply = run_on_bottle(run, fed_device(chosen), carried, walk_of(chosen).gait.stride_time, progress)
    return result_of_walk(chosen, run, outcome, supply)


def lasting(scenario: Scenario, minutes: float | None) -> Scenario:
    """A walk of some minutes [min], of its own length unless given; ScenarioError if too short or too long."""
    if minutes is None:
        return scenario
    for is_bad, line in duration_problems(scenario, 60.0 * minutes):
        if is_bad:
            raise ScenarioError(line(0))
    return with_duration(scenario, 60.0 * minutes)


def _run_in_parts(batch: Batch, step: float, progress: Progress) -> BatchResult:
    """Run in parts short enough for an interrupt to be seen and for progress to be reported."""
    block = begin_block(batch)
    count = batch.clock.step_count
    for done in range(0, count, STEPS_PER_CALL):
        block.advance(min(STEPS_PER_CALL, count - done))
        progress(min(done + STEPS_PER_CALL, count) * step / 60.0, count * step / 60.0)
    return block.result()


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """A walk with the device, the same with both chambers vented, and numbers of the healthy gait by name."""

    with_device: WalkResult
    without_device: WalkResult
    healthy: Mapping[str, Metric]

    @property
    def is_completed(self) -> bool:
        """True where both walks reached their end."""
        return self.with_device.status.is_completed and self.without_device.status.is_completed


def compare_walks(configuration: Scenario, minutes: float | None = None, progress: Progress = silent) -> Comparison:
    """Walk ``minutes`` [min], or a whole course, with the device and with it off.

    ScenarioError for bad input, SimulationError where its bottle ends the walk before there is anything to compare.
    """
    worn = walk(configuration, minutes, progress=progress)
    # Refuse a walk that its bottle ended within the first strides.
    shortest = SHORTEST_STRIDES * walk_of(worn.scenario).gait.stride_time
    if worn.supply is not None and worn.supply.ending.time < shortest:
        ending = worn.supply.ending
        raise SimulationError(
            f"{worn.scenario.name} on its bottle: {ending.message}, after {ending.time:.3g} s: fewer than "
            f"{SHORTEST_STRIDES} strides; take a fuller, larger or warmer bottle"
        )
    # As long as the bottle lasted, where there is one.
    as_long = minutes if worn.supply is None else float(worn.recording.time[-1]) / 60.0
    bare = walk(with_device_off(configuration), as_long, progress=progress)
    return Comparison(worn, bare, healthy_metrics(configuration))


def with_device_off(configuration: Scenario) -> Scenario:
    """The same wearer and device with both chambers vented; no gas flows, so no bottle and no lines are needed."""
    name = f"{configuration.name}-off"
    control = Control(event_on_off.OFF.name, {}, configuration.control.period)
    motion = replace(walk_of(configuration), bottle=None, timing=THRESHOLDS)
    return replace(configuration, name=name, control=control, motion=motion, supply_lines=None)


def healthy_metrics(configuration: Scenario) -> dict[str, Metric]:
    """The metrics of a walk with a healthy ankle, SI units; without a moment curve there is no work."""
    gait = walk_of(configuration).gait
    found = {
        "slap_rate": Metric(_landing_rate(configuration), "rad/s", "rate of the measured foot as it comes down"),
        "toe_clearance": Metric(0.0, "m", "0 by definition: measured from the healthy gait"),
        "lowest_toes": lowest_toes(configuration, healthy_toe_height(configuration)),
        "toe_landing": Metric(0.0, "-", "the heel comes first"),
        "angle_difference": Metric(0.0, "rad", "0 by definition: measured from the healthy gait"),
    }
    if gait.ankle_moment is not None:
        work = healthy_positive_work(configuration)
        found["push_off_work"] = Metric(work, "J", "positive work of the ankle moment in one stride")
        if walk_of(configuration).wearer.keeps_gait >= 0.5:
            found["dorsiflexor_moment"] = _dorsiflexor_moment(configuration)
    return found


def _dorsiflexor_moment(configuration: Scenario) -> Metric:
    """Moment of the muscles that lift the foot without any device, from the measured moment less tissue."""
    gait, wearer = walk_of(configuration).gait, walk_of(configuration).wearer
    torque: Any = passive_torque  # plain arithmetic, of arrays too
    tissue = torque(wearer.leg(), gait.ankle_angle.values_at(PHASES))
    moment = np.maximum(tissue - wearer.body_mass * gait.curve("ankle_moment").values_at(PHASES), 0.0)
    return Metric(float(moment[:-1].mean()), "N m", "moment of the wearer's dorsiflexors, mean over the stride")


def _landing_rate(configuration: Scenario) -> float:
    """Rate of the measured foot as it comes down [rad/s], below 0; taken where a walk takes it, at the landing."""
    gait = walk_of(configuration).gait
    phase = landing_phase(gait)
    return gait.shank_angle.rate(phase, gait.stride_time) - gait.ankle_angle.rate(phase, gait.stride_time)
