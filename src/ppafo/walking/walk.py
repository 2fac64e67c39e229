"""Simulation of a walk of one wearer, and comparison with no device and with a healthy ankle."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.arguments import Minutes, Overrides, checked
from ppafo.control.walking import event_on_off
from ppafo.engine.lanes import STEPS_PER_CALL, begin_block, effort_for
from ppafo.engine.run import batch_of
from ppafo.errors import ScenarioError, SimulationError
from ppafo.metrics import Metric
from ppafo.model.leg import passive_torque
from ppafo.parameters.device import Actuator, FootPlate, Friction
from ppafo.parameters.graph import outside
from ppafo.plugins import Plugins
from ppafo.simulation.contradictions import check_no_bottle
from ppafo.simulation.numbers import check_parts
from ppafo.simulation.plan import plan_run
from ppafo.simulation.python_controller import run_sampled
from ppafo.simulation.scenario import Control, Scenario
from ppafo.walking.bottle.coupling import WALKED, walk_on_bottle
from ppafo.walking.evaluation import result_of_walk
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import SHORTEST_STRIDES, duration_problems, walk_of, with_duration
from ppafo.walking.planning import fed_device
from ppafo.walking.result import WalkResult
from ppafo.walking.strides import PHASES, healthy_positive_work, healthy_toe_height, lowest_toes, metrics_of_walk

Progress = Callable[[float, float], None]
"""Progress callback, called with completed and total work."""

ANKLE_RANGE = math.radians(45.0), math.radians(140.0)
"""Ankle range [rad] without a device: 45 deg in dorsiflexion, assumed beyond any gait here, to 50 deg in
plantarflexion, a usual norm of passive motion."""
_LEG_CHAMBER = 1.0e-3
"""Chamber volume [m^3] of a leg without a device: gas at rest, in a volume large enough not to require short steps."""


def silent(done: float, total: float) -> None:  # the arguments of ``Progress``
    """Ignore the progress of a walk; default callback."""


@checked
def walk(
    scenario: Scenario | str | Path,
    *,
    overrides: Overrides = (),
    gait: str | Path | None = None,
    bottle: str | Path | None = None,
    minutes: Minutes | None = None,
    plugins: Plugins = (),
    progress: Progress = silent,
) -> WalkResult:
    """Simulate a walk for ``minutes`` [min]: a scenario that is a walk, the name of a shipped one, or a file.

    The default duration is stated in the file, or otherwise one minute, and ten minutes on a bottle, which may end the
    walk earlier.

    Arguments:
        scenario: a Scenario that is a walk, the name of a shipped one, or a .toml file; the arguments up to ``bottle``
            need a name or a file
        overrides: values to change, as texts or as a dictionary, as in ``simulate``
        gait: name or file of a gait in place of the scenario's
        bottle: name or file of a bottle in place of the scenario's
        minutes: length of the walk [min]
        plugins: modules of your own, files or names, whose objects files may name
        progress: called repeatedly with the minutes done and the total number of minutes

    Returns:
        a WalkResult: recording, strides and metrics in SI units. A diverged walk has the status "diverged" and the
        recording up to the time of failure

    Raises:
        ScenarioError: a scenario that cannot be used, or is no walk
        ParameterError: a parameter set, or a value of it, that cannot be used

    >>> import ppafo
    >>> result = ppafo.walk("solenoid", minutes=0.1)
    >>> print(f"{result.metrics['toe_clearance'].value:.3f} m")
    -0.034 m
    """
    if not isinstance(scenario, Scenario):
        scenario = load_walk(scenario, overrides, gait=gait, bottle=bottle)
    elif tuple(overrides) or any(choice is not None for choice in (gait, bottle)):
        raise ScenarioError("a loaded Scenario accepts no overrides, gait or bottle; give these to load_walk")
    else:
        check_parts(scenario)
    if minutes is not None:
        for is_bad, line in duration_problems(scenario, 60.0 * minutes):
            if is_bad:
                raise ScenarioError(line(0))
        scenario = with_duration(scenario, 60.0 * minutes)
    run = plan_run(scenario)
    motion = walk_of(scenario)
    custom = scenario.controller.custom
    if custom is not None:
        check_no_bottle(scenario)
        return result_of_walk(scenario, run, run_sampled(batch_of(run), custom), None)
    if motion.bottle is None:
        # In parts short enough for interrupts and progress reports.
        batch = batch_of(run)
        steps = run.step_count
        block = begin_block(batch, effort_for(batch))
        for done in range(0, steps, STEPS_PER_CALL):
            block.advance(min(STEPS_PER_CALL, steps - done))
            progress(min(done + STEPS_PER_CALL, steps) * run.step / 60.0, steps * run.step / 60.0)
        return result_of_walk(scenario, run, block.result(), None)
    rows, supply = walk_on_bottle(run, fed_device(scenario), motion.bottle, motion.gait.stride_time, progress)
    return result_of_walk(scenario, run, rows, supply)


@dataclass(frozen=True, slots=True, eq=False)
class WalkComparison:
    """Walk with the device, the same walk without it, and metrics of the healthy gait by name."""

    with_device: WalkResult
    without_device: WalkResult
    healthy: Mapping[str, Metric]

    @property
    def is_completed(self) -> bool:
        """True if both walks were completed."""
        return self.with_device.status.is_completed and self.without_device.status.is_completed


@checked
def compare_walks(
    scenario: Scenario | str | Path, *, minutes: Minutes | None = None, progress: Progress = silent
) -> WalkComparison:
    """Walk with the device and without it.

    Arguments:
        scenario: a walk, its name or its file
        minutes: duration [min]; default: the length that the walk states
        progress: called with the time walked and the whole time [min]

    Returns:
        WalkComparison of both walks and of the healthy gait

    Raises:
        ScenarioError: a walk that cannot be used
        SimulationError: a bottle that ends the walk before there is anything to compare

    >>> import ppafo
    >>> compared = ppafo.compare_walks("solenoid", minutes=0.1)
    >>> walks = compared.with_device, compared.without_device
    >>> [f"{result.metrics['toe_clearance'].value:.3f} m" for result in walks]
    ['-0.034 m', '-0.121 m']
    """
    configuration = scenario if isinstance(scenario, Scenario) else load_walk(scenario)
    worn = walk(configuration, minutes=minutes, progress=progress)
    if worn.supply is not None and worn.supply.ending.kind != WALKED:
        ending = worn.supply.ending
        if ending.time < SHORTEST_STRIDES * walk_of(worn.scenario).gait.stride_time:
            raise SimulationError(
                f"{worn.scenario.name}: with its bottle, the walk ends after {ending.time:.3g} s, within the first "
                f"{SHORTEST_STRIDES} strides ({ending.message}); use a fuller, larger or warmer bottle"
            )
        # The bottle has shortened the walk: the walk without the device is as long.
        minutes = float(worn.recording.time[-1]) / 60.0
    bare = walk(without_device(configuration), minutes=minutes, progress=progress)
    # A leg is simulated with two chambers; channels of a chamber that the device does not have are left out.
    channels = {name: channel for name, channel in bare.recording.channels.items() if name in worn.recording}
    averages = {name: curves for name, curves in bare.averages.items() if name in channels}
    bare = replace(bare, recording=replace(bare.recording, channels=channels), averages=averages)
    return WalkComparison(worn, bare, healthy_metrics(configuration))


def without_device(configuration: Scenario) -> Scenario:
    """Return the walk of this wearer without a device: no foot plate, actuator torque or friction, and no gas flow.

    The ankle has its own range of motion. The result does not depend on device or valve; bottle and supply lines
    are removed.
    """
    device = configuration.device
    control = Control(event_on_off.OFF.name, {}, configuration.controller.period)
    # No torque and no displacement; the stops of the actuator become the range of the ankle.
    stops = Actuator(0.0, 0.0, *ANKLE_RANGE, _LEG_CHAMBER, _LEG_CHAMBER, 0.0, device.actuator.leak)
    free = Friction(0.0, 0.0, 0.0)
    massless = FootPlate(0.0, 0.0)
    return replace(
        configuration,
        name=f"{configuration.name}-without",
        device=replace(device, actuator=stops, friction=free, foot_plate=massless, effects={}, links={}),
        controller=control,
        motion=replace(walk_of(configuration), bottle=None),
        supply_line=None,
        # Links to numbers that are left out go too.
        links=outside(configuration.links, "controller", "supply_line"),
    )


def healthy_metrics(configuration: Scenario) -> dict[str, Metric]:
    """Return the metrics of a walk with a healthy ankle, in SI units; work and muscle moment need a moment curve."""
    gait = walk_of(configuration).gait
    wearer = walk_of(configuration).wearer
    values = {
        # Measured from the healthy gait, whose heel comes first.
        **dict.fromkeys(("toe_clearance", "angle_difference", "toe_landing"), 0.0),
        "lowest_toes": lowest_toes(configuration, healthy_toe_height(configuration)),
    }
    if gait.ankle_moment is None:
        return metrics_of_walk(values)
    values["positive_push_off_work"] = healthy_positive_work(configuration)
    if wearer.keeps_gait >= 0.5:
        # Without a device, muscles lift the foot: the measured moment beyond the moment of passive tissue.
        torque: Any = passive_torque  # plain arithmetic, of arrays too
        tissue = torque(wearer.leg(), gait.ankle_angle.values_at(PHASES))
        moment = np.maximum(tissue - wearer.body_mass * gait.ankle_moment.values_at(PHASES), 0.0)
        values["dorsiflexor_moment"] = float(moment[:-1].mean())
    return metrics_of_walk(values)
