"""The walk of a neuromuscular gait model as a kind of motion: reflexes move a body, with the device on its left leg."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.documents.json_text import plain
from ppafo.engine.run import Run
from ppafo.gait import Gait
from ppafo.metrics.metric import REACTS
from ppafo.model.columns import Problem, at
from ppafo.parameters.plant import plant_parameters
from ppafo.simulation.declaration import Reading
from ppafo.simulation.loading import ScenarioRequest
from ppafo.simulation.motion_kind import REACT
from ppafo.simulation.plan import compose_run, too_many_steps
from ppafo.simulation.scenario import Scenario
from ppafo.walking.kind import WalkKind
from ppafo.walking.led import WALK_KIND
from ppafo.walking.motion import WalkMotion, walk_of
from ppafo.walking.planning import components_of_walk, failing_of, fed_device, gait_sensors_of, walk_steps
from ppafo.walking.preparation import device_share, vented_state, without_leg
from ppafo.walking.task_sequence import TaskSequence
from ppafo.walking.walk import with_device_off
from ppafo.walking.wearer import paper_subject
from ppafo.wearer.recording import reacting_result
from ppafo.wearer.scheme import ReactingWalk
from ppafo.wearer.settings import (
    LONGEST_STEP,
    NAME,
    NAME_SUMMARY,
    REACTIONS,
    START_SPEED,
    STEP_OF_BODY,
    read_reacting,
    start_of_body,
    wearer_of_walk,
)
from ppafo.wearer.way import check_reacting_task_sequence

SHORTEST_WAY = 6.0
"""Shortest walk [s] in a task sequence, unless given."""


def plan_reacting(scenario: Scenario) -> tuple[Run, tuple[Problem, ...]]:
    """As ``plan_walks``: the body begins at its start speed, with vented chambers."""
    device, wearer = fed_device(scenario), wearer_of_walk(walk_of(scenario))
    bare, sensors, start = plant_parameters(device), gait_sensors_of(scenario), start_of_body(wearer)
    walk = ReactingWalk(
        share=device_share(bare, STANDARD_GRAVITY),
        body=wearer.row(),
        sensors=sensors,
        initial=start.walk,
        walker=start.walker,
        reflexes=start.reflexes,
        nerves=start.nerves,
        failing=failing_of(scenario),
    )
    run = compose_run(
        components_of_walk(scenario, device, sensors),
        without_leg(bare),
        lambda plant: walk_steps(scenario, plant),
        lambda plant: vented_state(plant, start.ankle, 0.0),
        walk,
    )
    step = scenario.run.step
    too_long: Problem = (
        np.asarray(step > LONGEST_STEP),
        lambda run: f"run.step = {at(step, run):g} s: a neuromuscular gait model needs {LONGEST_STEP:g} s or less",
    )
    return run, (too_many_steps(scenario, run.step, run.step_count), too_long)


def _label(motion: WalkMotion) -> str:
    wearer = wearer_of_walk(motion)
    return f"a walk of a neuromuscular gait model, {wearer.name}" + (
        "" if wearer.task_sequence is None else f", task sequence {wearer.task_sequence.name}"
    )


def _read(
    reading: Reading, request: ScenarioRequest, _gait: Gait, _is_named: bool, sequence: TaskSequence | None
) -> Mapping[str, Any]:
    return {"wearer": paper_subject(), "body": read_reacting(reading, request.folder, request.instead, sequence)}


def _interval(seconds: float) -> float:
    # Each sample has some hundred numbers more than a leg along a gait has.
    return 5.0e-3 if seconds <= 61.0 else (1.0e-2 if seconds <= 601.0 else 5.0e-2)


def _duration(motion: WalkMotion) -> float | None:
    wearer = wearer_of_walk(motion)
    if wearer.task_sequence is None:
        return None
    way = sum(segment.values.get("distance", 0.0) for segment in wearer.task_sequence.segments)
    # The reflexes set the pace: at the speed of the start, to the next whole second.
    return max(SHORTEST_WAY, float(math.ceil(way / wearer.settings[START_SPEED.name])))


def _remarks(motion: WalkMotion) -> list[str]:
    wearer = wearer_of_walk(motion)
    return [f"wearer: {wearer.name}, neuromuscular, {wearer.mass:.4g} kg; the device is on the left leg"]


def _document(motion: WalkMotion) -> dict[str, Any]:
    wearer = wearer_of_walk(motion)
    return {
        "wearer": {"name": wearer.name, "numbers": plain(dict(wearer.settings))},
        "task_sequence": plain(wearer.task_sequence),
    }


def _nothing(_of: Any) -> dict[str, Any]:
    """Return no links of the wearer's numbers, and no numbers of a healthy walk."""
    return {}


REACT_KIND = replace(
    WALK_KIND,
    name=REACT,
    plan=plan_reacting,
    places=dict(WALK_KIND.places)
    | {f"wearer.{item.name}": ("motion", "body", "settings", item.name) for item in REACTIONS},
    walk=WalkKind(
        name=REACT,
        summary="the device on the left leg of a neuromuscular gait model, whose reflexes answer it",
        label=_label,
        numbers=REACTIONS,
        texts={NAME: NAME_SUMMARY},
        step=STEP_OF_BODY,
        interval=_interval,
        check_task_sequence=check_reacting_task_sequence,
        read=_read,
        links=_nothing,
        duration=_duration,
        subject=REACTS,
        result=reacting_result,
        remarks=_remarks,
        document=_document,
        without=with_device_off,
        healthy=_nothing,
        finding="ppafo.wearer.answer:reacting_finding",
        exported="ppafo.wearer.export:REACTING_WALK",
    ),
)
"""The motion of a scenario in which a neuromuscular gait model walks."""
