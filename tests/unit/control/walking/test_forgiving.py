"""People stop, stand, turn, scuff and climb: what phases and safety make of the forces and the angle of such walks.

The sequences are made here, sample by sample, so that nothing of a simulated leg is in them.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from ppafo.control.walking import fault_flags
from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.engine.rows import rebuilt
from ppafo.model.helping import HELPS, LIFTS, PAUSED, PUSH_OFF
from ppafo.model.sensors import GaitMeasurement
from ppafo.model.valves.kind import VENT
from tests.settings_of_laws import settings_of_law

pytestmark = pytest.mark.thorough

PERIOD = 1.0e-3
STRIDE = 1.1
LAWS = ("event_on_off", "event_pid")
Forces = list[tuple[float, float]]


def stride(seconds: float = STRIDE, heel_first: bool = True) -> Forces:
    """Forces [N] under heel and toes of one stride: heel, flat until 0.42 of it, toes until 0.64, swing."""
    loads = []
    for sample in range(round(seconds / PERIOD)):
        share = sample * PERIOD / seconds
        heel = 500.0 * (1.0 - share / 0.42) if share < 0.42 and heel_first else 0.0
        total = 700.0 + 200.0 * share if share < 0.5 else 800.0 * (1.0 - ((share - 0.5) / 0.15) ** 2)
        toe = 0.0 if heel_first and share < 0.07 else total - heel
        loads.append((heel, toe) if share < 0.64 else (0.0, 0.0))
    return loads


def standing(seconds: float, heel: float = 300.0, toe: float = 200.0) -> Forces:
    return [(heel, toe)] * round(seconds / PERIOD)


def lifted(seconds: float) -> Forces:
    return standing(seconds, 0.0, 0.0)


@dataclass
class Watched:
    """What a controller did at each sample: its state and its command."""

    states: list[Any] = field(default_factory=list)
    commands: list[float] = field(default_factory=list)

    @property
    def levels(self) -> np.ndarray[Any, Any]:
        return np.array([state.safety.level for state in self.states])


def rules_of(name: str, resume_strides: float) -> Any:
    """Parameters of a controller at their defaults, but patient with pressures, which are not simulated here."""
    kind = WALKING_CONTROLLERS[name]
    parameters = rebuilt(kind.parameters, map(float, list(settings_of_law(kind).values())))
    rules = parameters.safety._replace(fill_time=1.0e3, vent_time=1.0e3, resume_strides=resume_strides)
    return parameters._replace(safety=rules)


def walked(
    name: str, forces: Iterable[tuple[float, float]], step: float = 0.0, sway: float = 1.0e-3, resume: float = 2.0
) -> Watched:
    """Feed a controller; the angle moves in a walk, and forces and angle sway as those of people do.

    ``step`` [N] rounds the forces, and the angle to 2 deg where there is one.
    """
    seen, parameters = Watched(), rules_of(name, resume)
    kind = WALKING_CONTROLLERS[name]
    state = kind.initial
    for sample, (heel, toe) in enumerate(forces):
        wave = sway * np.sin(2.0 * np.pi * sample * PERIOD / 0.7)
        angle = (1.5 if heel + toe else 1.9) + 0.25 * (toe - heel) / 700.0 + wave
        force = np.array([heel * (1.0 + wave), toe * (1.0 - wave)])
        if step:
            force, angle = step * np.round(force / step), np.radians(2.0) * round(angle / np.radians(2.0))
        measurement = GaitMeasurement(float(angle), 1.02e5, 1.02e5, 0.0, *map(float, force))
        command, state = kind.update(parameters, state, 0.0, measurement, PERIOD)
        seen.commands.append(command)
        seen.states.append(state)
    return seen


def some(count: int, **changes: Any) -> Forces:
    return [sample for _ in range(count) for sample in stride(**changes)]


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("seconds", [0.3, 0.6, 5.0])
@pytest.mark.parametrize("share", [0.1, 0.25, 0.35, 0.41])
def test_who_stops_in_mid_stance_is_not_pushed(name: str, seconds: float, share: float) -> None:
    before = some(4)
    stop = stride()[: round(share * STRIDE / PERIOD)]
    seen = walked(name, [*before, *stop, *standing(seconds)])
    assert 1.0 in [np.sign(command) for command in seen.commands[: len(before)] if command != VENT], "it pushed before"
    after = seen.commands[len(before) + len(stop) + 10 :]  # the debounce
    assert max((command for command in after if command != VENT), default=0.0) <= 0.0


@pytest.mark.parametrize("name", LAWS)
def test_standing_from_the_start_and_swaying_gets_no_push(name: str) -> None:
    seen = walked(name, standing(6.0), sway=0.02)
    assert {state.phase.phase for state in seen.states[100:]} == {2.0}
    assert set(seen.commands[100:]) == {VENT}


@pytest.mark.parametrize("name", LAWS)
def test_a_heel_that_comes_down_again_ends_the_push(name: str) -> None:
    rises = stride()[: round(0.5 * STRIDE / PERIOD)]
    seen = walked(name, [*some(3), *rises, *standing(1.0)])
    begun = 3 * len(stride()) + len(rises)
    assert seen.states[begun - 1].phase.phase == PUSH_OFF
    assert set(seen.commands[begun + 12 :]) == {VENT}


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("step", [0.0, 15.0])
@pytest.mark.parametrize("sway", [0.0, 1.0e-3, 0.02])
def test_standing_needs_no_pause_and_the_first_step_is_helped(name: str, step: float, sway: float) -> None:
    first, stop = some(4), [*stride()[: round(0.3 * STRIDE / PERIOD)], *standing(20.0)]
    away = [*stride()[round(0.3 * STRIDE / PERIOD) :]]
    seen = walked(name, [*first, *stop, *away, *some(2)], step, sway)
    assert set(seen.levels) == {HELPS}
    stands = seen.commands[len(first) + 400 : len(first) + len(stop)]
    assert set(stands) == {VENT}, "and nothing is done while the wearer stands"
    swing = seen.commands[len(first) + len(stop) + len(away) - round(0.3 / PERIOD) :][: round(0.3 / PERIOD)]
    assert min(swing) < 0.0, "the foot is held up in the first swing"
    leaves = seen.commands[len(first) + len(stop) : len(first) + len(stop) + round(0.3 * STRIDE / PERIOD)]
    assert max((command for command in leaves if command != VENT), default=0.0) <= 0.0, "and not pushed before it"


@pytest.mark.parametrize("name", LAWS)
def test_who_sits_has_a_free_foot_and_is_helped_again_after_standing_up(name: str) -> None:
    seen = walked(name, [*some(2), *lifted(3.0), *standing(2.0), *some(2)])
    sat, stood = 2 * len(stride()) + 3000, 2 * len(stride()) + 5000
    assert seen.levels[sat - 1] == PAUSED
    assert seen.commands[sat - 1] == VENT
    assert seen.levels[stood - 1] == HELPS


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("share", [0.68, 0.75, 0.8, 0.9, 0.96])
@pytest.mark.parametrize("load", [(0.0, 150.0), (150.0, 0.0), (200.0, 200.0)])
def test_a_scuff_of_forty_milliseconds_stops_nothing(name: str, share: float, load: tuple[float, float]) -> None:
    scuffed = stride()
    first = round(share * STRIDE / PERIOD)
    scuffed[first : first + 40] = [load] * 40
    seen = walked(name, [*some(4), *scuffed, *some(6)])
    assert seen.levels.max() <= PAUSED
    assert seen.levels[-1] == HELPS
    if load[0] == 0.0:
        assert seen.levels.max() == HELPS, "the toes alone: the foot is held up again at once"


@pytest.mark.parametrize("name", LAWS)
def test_stairs_on_the_forefoot_alone_are_lifted_and_not_pushed_and_level_ground_brings_the_push_back(
    name: str,
) -> None:
    seen = walked(name, [*some(4), *some(10, heel_first=False), *some(6)])
    first, last = 5 * len(stride()) + 20, 14 * len(stride())
    climbing = list(zip(seen.states, seen.commands, strict=True))[first:last]
    assert set(seen.levels[first:last]) == {LIFTS}
    assert min(command for _, command in climbing) < 0.0
    assert {command for state, command in climbing if state.phase.phase == PUSH_OFF} == {VENT}
    assert seen.levels[-1] == HELPS
    assert fault_flags.FAULT_FLAGS[seen.states[-1].safety.finding.fault_flag].name == "no_heel"
    assert seen.states[-1].safety.ventings == 1.0


def toes_then_heel() -> Forces:
    """A stride that lands on the toes, and whose heel comes down after them."""
    forces = stride()
    flat = round(0.12 * STRIDE / PERIOD)
    return [(0.0, heel + toe) if sample < flat else (heel, toe) for sample, (heel, toe) in enumerate(forces)]


@pytest.mark.parametrize("name", LAWS)
def test_a_foot_that_lands_on_its_toes_and_then_its_heel_is_helped(name: str) -> None:
    seen = walked(name, [*some(3), *[sample for _ in range(6) for sample in toes_then_heel()]])
    assert set(seen.levels) == {HELPS}
    last = [command for command in seen.commands[-len(stride()) :] if command != VENT]
    assert min(last) < 0.0 < max(last)


@pytest.mark.parametrize("name", LAWS)
def test_a_vented_foot_that_lands_on_its_toes_gets_help_back_step_by_step(name: str) -> None:
    trips = [*standing(0.12, 250.0, 0.0), *lifted(0.4)]
    walks = [sample for _ in range(5) for sample in toes_then_heel()]
    before = 3 * len(stride()) + len(trips)
    levels = walked(name, [*some(3), *trips, *walks]).levels
    assert levels[before - 1] == PAUSED
    steps = levels[before + 20 :: len(stride())]
    assert list(steps[:5]) == [PAUSED, LIFTS, HELPS, HELPS, HELPS]


@pytest.mark.parametrize("name", LAWS)
def test_slow_steps_of_a_turn_and_a_stumble_do_not_stop_it(name: str) -> None:
    turn = [*some(1, seconds=1.6), *some(2, seconds=1.9), *stride()]
    stumble = [*stride()[: round(0.7 * STRIDE / PERIOD)], *standing(0.15, 0.0, 250.0), *lifted(0.1)]
    seen = walked(name, [*some(4), *turn, *some(4), *stumble, *some(6)])
    assert seen.levels.max() <= PAUSED
    assert seen.levels[-1] == HELPS


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("needed", [1.0, 4.0])
def test_the_number_of_good_strides_is_a_setting(name: str, needed: float) -> None:
    trips = [*standing(0.12, 250.0, 0.0), *lifted(0.4)]
    forces = [*some(3), *trips, *some(6)]
    levels = walked(name, forces, resume=needed).levels
    walks = len(forces) - 6 * len(stride())
    back = (int(np.flatnonzero(levels > HELPS)[-1]) + 1 - walks) / len(stride())
    assert back == pytest.approx(needed, abs=0.05)
