"""Causes of a task that does not follow its reference, each with its numbers and remedies, the surest cause first."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ppafo.control.kind import ControllerKind
from ppafo.metrics.metric import Floats, followed
from ppafo.metrics.switching import SHUT
from ppafo.model.controlled import ANGLE, TORQUE
from ppafo.model.plant import gravity_torque
from ppafo.parameters.reach import supply_for, supply_that_moves, torque_reach
from ppafo.report.display_units import metric_change
from ppafo.signals import Recording
from ppafo.simulation.numbers import number_at
from ppafo.simulation.place import quicker_at
from ppafo.simulation.scenario import FreeMotion, Scenario
from ppafo.simulation.tracking.pair_step import pair_step
from ppafo.simulation.tracking.remedies import (
    Remedy,
    change_text,
    dead_band,
    gain_of_device,
    larger_gains,
    level_text,
    remedy,
    sized_valves,
    slower_loops,
    smaller_pair,
    speed_settings,
    stiffer_laws,
    torque_asked,
)
from ppafo.simulation.tracking.rule import SettledPart

_ON_STOP = 1.0e-3
"""Distance from a stop up to which a joint lies on it [rad]."""
_MOSTLY = 0.5
"""Share of the settled part that is most of it [-]."""
_FULLY_OPEN = 0.98
"""Command above which a valve counts as fully open [-]."""
_QUICKER = 1.3
"""Rate at an angle over the rate the gains are made for, from which it causes oscillation [-]."""


class Case(NamedTuple):
    """Run that does not follow: scenario, law (None for a Python controller), recording and settled part."""

    scenario: Scenario
    law: ControllerKind | None
    recording: Recording
    settled: SettledPart
    oscillates: bool

    @property
    def only_switches(self) -> bool:
        """True for a law that opens the valve fully or not at all."""
        return self.law is not None and self.law.only_switches

    @property
    def fully_open(self) -> float:
        """Share of the settled part in which the valve is fully open [-]."""
        command = np.abs(self.recording["command"][self.settled.samples])
        return float(np.mean((command >= _FULLY_OPEN) & (command <= 1.0 + SHUT)))


class Cause(NamedTuple):
    """Cause in words with numbers, remedies to try, advice where none helps, and whether it is a lack of torque."""

    text: str
    remedies: tuple[Remedy, ...] = ()
    advice: str = ""
    is_beyond_reach: bool = False


def cause_of_task(case: Case) -> Cause:
    """First cause that applies to a task."""
    return next(cause for find in _OF_TASK if (cause := find(case)) is not None)


def torque_beyond_reach(case: Case) -> Cause | None:
    """A torque is wanted that the supplies of the device do not give at that angle."""
    scenario, samples = case.scenario, case.settled.samples
    if scenario.controlled != TORQUE:
        return None
    reference, angle = followed(case.recording)[0][samples], case.recording["angle"][samples]
    place = int(np.argmax(np.abs(reference)))
    wanted, there = float(reference[place]), float(angle[place])
    lowest, highest = torque_reach(scenario.device, there)
    if lowest <= wanted <= highest:
        return None
    reach, supply = highest if wanted > highest else lowest, supply_that_moves(scenario.device, wanted > highest)
    text = (
        f"at {level_text('rad', there, scenario)} and {level_text('Pa', number_at(scenario, supply), scenario)} the "
        f"actuator gives {level_text('N m', reach, scenario)} at most"
    )
    remedies = []
    needed = supply_for(scenario.device, there, 1.05 * wanted)
    if needed is not None:
        remedies.append(remedy(scenario, {supply: needed}))
    if "level" in scenario.reference.settings and not scenario.reference.kind.startswith("sine"):
        remedies.append(remedy(scenario, {"reference.level": 0.95 * reach}))
    return Cause(text, tuple(remedies), is_beyond_reach=True)


def _unless_oscillating(case: Case) -> Cause | None:
    return None if case.oscillates else torque_beyond_reach(case)


def _load_beyond_reach(case: Case) -> Cause | None:
    """What works on a free joint is more than the actuator gives where the joint is to be."""
    scenario, motion, device = case.scenario, case.scenario.motion, case.scenario.device
    if scenario.controlled != ANGLE or not isinstance(motion, FreeMotion) or motion.leg is not None:
        return None
    reference, angle = (series[case.settled.samples] for series in followed(case.recording))
    wanted, outside = float(np.mean(reference)), float(motion.outside_torque)
    lowest, highest = torque_reach(device, wanted)
    load = outside + float(gravity_torque(wanted, device.foot_plate.gravity_torque))
    if lowest <= load <= highest:
        return None
    reach, supply = highest if load > highest else lowest, supply_that_moves(device, load > highest)
    stop = _stop(scenario, angle)
    rests = f"the joint lies on its {stop} stop: " if stop else ""
    works, gives = (level_text("N m", abs(torque), scenario) for torque in (load, reach))
    there = level_text("rad", wanted, scenario)
    text = f"{rests}{works} work against it at {there}, where the actuator gives {gives} at most"
    needed = supply_for(device, wanted, 1.3 * load)
    changes: list[dict[str, float]] = [] if needed is None else [{supply: needed}]
    if outside:
        changes.append({"motion.external_torque": 0.7 * reach - (load - outside)})
    remedies = [remedy(scenario, numbers) for numbers in changes]
    # A law without an integral requests no torque where there is no error, and knows nothing of the load.
    if torque_asked(scenario, case.law, case.settled.error) is not None:
        for numbers in changes:
            against = abs(numbers.get("motion.external_torque", outside)) + float(device.friction.static_torque)
            remedies += stiffer_laws(scenario, against, case.settled, numbers)
    return Cause(text, tuple(remedies))


def _stop(scenario: Scenario, angle: Floats) -> str:
    """Stop on which a joint lies for most of some samples, "" where it lies on none."""
    ends = (("lower", scenario.device.actuator.angle_min), ("upper", scenario.device.actuator.angle_max))
    return next((word for word, stop in ends if np.mean(np.abs(angle - stop) <= _ON_STOP) > _MOSTLY), "")


def _shut_valve(case: Case) -> Cause | None:
    """The command is 0, or stays within the dead band of the valve."""
    scenario, settled = case.scenario, case.settled
    asked, band = float(np.max(np.abs(case.recording["command"][settled.samples]))), dead_band(scenario)
    if asked <= SHUT:
        return Cause("its law asks for nothing: its gains are 0, or its dead zone is wider than the error")
    if asked > band or settled.turns:
        return None
    remedies = larger_gains(scenario, case.law, (1.5 * band / asked, 3.0 * band / asked))
    if torque_asked(scenario, case.law, settled.error) is not None:
        remedies += stiffer_laws(scenario, float(scenario.device.friction.static_torque), settled)
    text = f"its command of {asked:.2g} at most stays within `valve.dead_band = {band:.2g}`"
    return Cause(text, tuple(remedies), "give a larger gain")


def oscillation(case: Case) -> Cause | None:
    """Valves, gains or small chambers that make a loop oscillate."""
    scenario, law = case.scenario, case.law
    if not (case.oscillates or case.only_switches):
        return None
    if law is None:
        return Cause("its controller is of yours", (), "give it smaller gains")
    angle = float(np.mean(case.recording["angle"][case.settled.samples]))
    # The gains of a locked joint are those of its angle.
    is_locked = scenario.motion.motion_kind.name == "locked"
    quicker = 1.0 if is_locked else quicker_at(scenario.device, angle, scenario.controlled)
    if law.only_switches:
        return _steps_of_pair(case, law, quicker)
    names = [quantity.name for quantity in speed_settings(scenario, law).values()]
    if not names:
        return Cause("its law is too fast for what is late", (), "give its law smaller gains, or a slower one")
    slower = Cause(
        f"`{names[0]}` is this device's: look for what delays it (sensors, lines)",
        slower_loops(scenario, law, (2.0, 4.0)),
    )
    if quicker > _QUICKER:
        text = (
            f"at {level_text('rad', angle, scenario)} the chambers are so small that it changes {quicker:.2g} times "
            f"quicker than where `{names[0]}` is taken"
        )
        slower = Cause(text, slower_loops(scenario, law, (quicker, 2.0 * quicker)))
    return gains_of_another_device(case) or slower


def _steps_of_pair(case: Case, law: ControllerKind, quicker: float) -> Cause:
    """What a pair of on/off valves changes during its dead time, over what is wanted."""
    scenario = case.scenario
    step, late = pair_step(scenario, law)
    step *= quicker
    controlled = scenario.controlled if TORQUE in law.controls else TORQUE
    share = step / case.settled.wanted
    text = (
        f"its valves change it by {change_text(controlled, step)} in the {1.0e3 * late:.3g} ms that they are late, "
        f"{share:.2g} times what is wanted"
    )
    return Cause(text, smaller_pair(scenario, share), "take faster or smaller valves")


def _static_friction(case: Case) -> Cause | None:
    """Static friction holds a joint that rests beside its reference."""
    scenario, settled = case.scenario, case.settled
    holding = float(scenario.device.friction.static_torque)
    asked = torque_asked(scenario, case.law, settled.error)
    if asked is None or asked > 2.0 * holding or (settled.rests and settled.swing > abs(settled.missing)):
        return None
    text = (
        f"static friction holds the joint with {level_text('N m', holding, scenario)}, and the law asks for "
        f"{metric_change(asked, 'N m')[0]:.3g} at this error, `angle_stiffness` times it"
    )
    return Cause(text, tuple(stiffer_laws(scenario, holding, settled)), "a larger `angle_stiffness` moves it")


def _fully_open_valve(case: Case) -> Cause | None:
    """The valve is fully open for most of the settled part."""
    if case.fully_open <= _MOSTLY:
        return None
    text = f"its valve is fully open for {100.0 * case.fully_open:.0f} % of the time: it is too small for this task"
    return Cause(text, sized_valves(case.scenario, (3.0, 10.0)), "take a larger valve or a slower reference")


def gains_of_another_device(case: Case) -> Cause | None:
    """A gain differs from the one the device asks for."""
    right = gain_of_device(case.scenario, case.law)
    return None if right is None else Cause("its gains are not this device's", (right,))


def _not_settled(case: Case) -> Cause:
    """The run ends before the loop has settled, the law has no integral, or nothing above applies."""
    reference, value = followed(case.recording)
    error = np.abs((value - reference)[case.settled.samples])
    half = error.size // 2
    settings = case.scenario.controller.settings
    stop = _stop(case.scenario, case.recording["angle"][case.settled.samples])
    if stop and case.scenario.controlled == ANGLE:
        return Cause(f"the joint lies on its {stop} stop", (), "look at what presses it")
    if half and np.mean(error[half:]) < 0.7 * np.mean(error[:half]):
        return Cause("it has not settled at the end", (), "give it a longer `run.duration`")
    integral = next((name for name in settings if "integral" in name and settings[name] == 0.0), "")
    if integral:
        return Cause("what stays is left to an integral, which is 0", (), f"give some `{integral}`")
    return Cause("reach, dead band, friction and opening do not tell why", (), "look at the figure")


_OF_TASK: tuple[Callable[[Case], Cause | None], ...] = (
    _unless_oscillating,
    _load_beyond_reach,
    _shut_valve,
    oscillation,
    _static_friction,
    _fully_open_valve,
    gains_of_another_device,
    _not_settled,
)
"""Causes of a task, the surest first; the last one always applies."""
