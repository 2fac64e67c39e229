"""The walk along a prescribed gait as a kind of motion: shank and loaded foot are led, whatever the device does."""

from collections.abc import Mapping
from typing import Any

from ppafo.documents.json_text import plain
from ppafo.gait import Gait
from ppafo.gait.plausible import gait_file_remarks
from ppafo.metrics.metric import LED
from ppafo.simulation.declaration import Reading
from ppafo.simulation.loading import ScenarioRequest
from ppafo.simulation.motion_kind import WALK, MotionKind
from ppafo.walking.contradictions import rules
from ppafo.walking.declaration import PERSON, STEP
from ppafo.walking.kind import WalkKind
from ppafo.walking.motion import PLACES, WalkMotion, clock_with, numbers_of_scenario, record_interval
from ppafo.walking.planning import noise, plan_walks, planned_task_sequence, switches
from ppafo.walking.result import lacks, led_result, measured
from ppafo.walking.task_sequence import TaskSequence, check_led_task_sequence
from ppafo.walking.walk import healthy_metrics, without_device
from ppafo.walking.wearer import WEARER, links_of_stature, read_wearer, wearer_origin, who_walks


def _label(motion: WalkMotion) -> str:
    return f"a walk, gait {motion.gait.name}" + (
        "" if motion.task_sequence is None else f", task sequence {motion.task_sequence.name}"
    )


def _read(
    reading: Reading, _request: ScenarioRequest, gait: Gait, is_named: bool, sequence: TaskSequence | None
) -> Mapping[str, Any]:
    person = reading.number(f"wearer.{PERSON.name}", PERSON)
    if person != int(person):
        raise reading.refusal(f"wearer.{PERSON.name}", "must be a whole number")
    return {
        "wearer": read_wearer(reading, gait, is_named),
        "wearer_origin": wearer_origin(reading, gait, is_named),
        "person": person,
        "task_sequence": sequence,
    }


def _remarks(motion: WalkMotion) -> list[str]:
    """Return who walks, and what is odd about the zero of the gait's ankle."""
    remarks = [f"remark: {text}" for text in gait_file_remarks(motion.gait)]
    return [who_walks(motion.wearer, motion.gait, motion.wearer_origin), *remarks]


def _duration(motion: WalkMotion) -> float | None:
    sequence = motion.task_sequence
    # As long as the wearer with the gait as it is takes for it, whoever walks.
    return None if sequence is None else float(planned_task_sequence(sequence, motion.gait).duration)


def _document(motion: WalkMotion) -> dict[str, Any]:
    return {
        "gait": plain(motion.gait),
        "wearer": plain(motion.wearer),
        "wearer_origin": motion.wearer_origin,
        "task_sequence": plain(motion.task_sequence),
    }


WALK_KIND = MotionKind(
    name=WALK,
    plan=plan_walks,
    rules=rules,
    quantities=numbers_of_scenario,
    places=PLACES,
    clock=clock_with,
    switches=switches,
    noise=noise,
    lacks=lacks,
    measured=measured,
    walk=WalkKind(
        name=WALK,
        summary="the device on a leg that walks along a prescribed gait",
        label=_label,
        numbers=(*WEARER, PERSON),
        texts={},
        step=STEP,
        interval=record_interval,
        check_task_sequence=check_led_task_sequence,
        read=_read,
        links=links_of_stature,
        duration=_duration,
        subject=LED,
        result=led_result,
        remarks=_remarks,
        document=_document,
        without=without_device,
        healthy=healthy_metrics,
        finding="ppafo.analyses.walk.answer:finding_of",
        exported="ppafo.exports.c_library.walk_preparation:LED_WALK",
    ),
)
"""The motion of a scenario that walks along a gait."""
