"""Remarks on a run beside its verdict: stops that the joint reaches, and overridden sensor values without effect."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ppafo.model.controlled import ANGLE, TORQUE
from ppafo.model.plant import gravity_torque
from ppafo.parameters.overrides import read_overrides
from ppafo.parameters.reach import torque_reach
from ppafo.simulation.scenario import FreeMotion, Scenario
from ppafo.simulation.tracking.load_causes import LOCKED, ON_STOP, stop_of
from ppafo.simulation.tracking.remedies import level_text
from ppafo.simulation.tracking.rule import SMALLEST_MOVE

if TYPE_CHECKING:
    from ppafo.simulation.simulate import RecordedResult


def remarks_on(result: "RecordedResult", follows: bool) -> Iterator[str]:
    """Yield remarks on rest, stops, sensor values without effect, and replaced values.

    ``follows``: True if the run follows its reference; a stop may then bear the torque that the reference asks for.
    """
    scenario, recording = result.scenario, result.recording
    motion, actuator, reached = scenario.motion, scenario.device.actuator, []
    yield standing_still(result, follows)
    if isinstance(motion, FreeMotion):
        for side, stop in (("lower", actuator.angle_min), ("upper", actuator.angle_max)):
            rests = np.abs(recording["angle"] - stop) <= ON_STOP
            # A start on a stop is the scenario's, unless the joint never leaves the stop.
            at = np.flatnonzero(rests & ~np.concatenate([[not rests.all()], rests[:-1]]))
            name, share = f"its {side} stop ({level_text('rad', stop)})", f"{100.0 * np.mean(rests):.0f} % of the run"
            lies = "" if share.startswith("0 ") else f" and lies on it for {share}"
            reached += [f"{name} at {recording.time[index]:.3g} s{lies}" for index in at[:1]]
        if reached and follows and scenario.controlled != ANGLE and motion.leg is None:
            reached[-1] += f": there the stop bears the torque; not tried: lock the joint ({LOCKED.text}) or add a load"
    yield from (f"the joint reaches {text}" for text in reached)
    yield _without_effect(scenario)
    yield scenario.origin.replaced


def standing_still(result: "RecordedResult", follows: bool) -> str:
    """Remark on a free joint that friction holds for the whole run while no angle is controlled; "" for other runs.

    ``follows``: as for ``remarks_on``; without it the verdict has the remedy, unless the loop is open.
    """
    scenario, angle, motion = result.scenario, result.recording["angle"], result.scenario.motion
    if not isinstance(motion, FreeMotion) or scenario.controlled == ANGLE or not result.status.is_completed:
        return ""
    if np.ptp(angle) > 0.0 or stop_of(scenario, angle):
        return ""
    load = motion.outside_torque + gravity_torque(float(angle[0]), scenario.device.foot_plate.gravity_torque)
    holding, most = (
        float(scenario.device.friction.static_torque),
        float(np.abs(result.recording["torque"] - load).max()),
    )
    exceeds = f"exceeds the largest torque of actuator and load, {level_text('N m', most)}"
    text = f"the joint does not move: static friction of {level_text('N m', holding)} {exceeds}"
    if follows or scenario.controller.is_open_loop:
        text += f"; not tried: reduce `friction.static_torque`, or lock the joint ({LOCKED.text})"
    # A joint on which no torque acts is at rest without friction.
    return text if most > SMALLEST_MOVE * holding else ""


def _without_effect(scenario: Scenario) -> str:
    """Overridden sensor values that the controller does not read in this scenario, as text; "" without any."""
    sensors, law, actuator = scenario.sensors, scenario.law, scenario.device.actuator
    unread, read = "sensors.angle_", "the measured pressure"
    if scenario.controller.is_open_loop:
        unread, read = "sensors.", "no sensor"
    elif law is None or not scenario.follows_reference or len(law.controls) < 2:
        # Only laws of several quantities are declared to read nothing but the controlled one.
        return ""
    elif scenario.controlled == ANGLE:
        unread, read = "sensors.pressure_", "the measured angle"
    elif scenario.controlled == TORQUE:
        angles = np.linspace(actuator.angle_min, actuator.angle_max, 4).tolist()
        depends = len({torque_reach(scenario.device, angle) for angle in angles}) > 1
        unread, read = "none" if depends else unread, "a torque computed from the measured pressures"
    names = [override.typed for override in read_overrides(scenario.origin.overrides)]
    is_quiet = not (sensors.angle_noise or sensors.pressure_noise)
    names = [name for name in names if name.startswith(unread) or (is_quiet and name == "sensors.seed")]
    return f"without effect here: {', '.join(names)}; the controller reads {read}" if names else ""
