"""What a walking leg adds to a step of the lanes: the gait at its end, and what marks a stride of a course."""

from ppafo.engine.lane_rows import LaneRows, RarePhase
from ppafo.engine.scheme import walking
from ppafo.model.course import gait_on_course, shown_toe_force, stands_on_toes
from ppafo.model.gait import GaitMeasured, GaitNow, gait_of, measured_at, place_at


def lead_walk(rows: LaneRows) -> list[list[str]]:
    """Phases before the gas of a walking leg: the gait at the end of the step, and where the foot would be."""
    if not rows.program.walks:
        return []
    foot = f"{rows.add(walking.begin_walk)}(plant, leg, gait_timing, state, held, walk, carried, next_gait, length)"
    return [
        *next_gait(rows),
        [rows.load("next_gait"), rows.load("carried"), f"begun = {foot}", *rows.keep("begun")],
    ]


def reach_end(rows: LaneRows, fed: list[str]) -> list[list[str] | RarePhase]:
    """Phases that find where the step ends, from the lines that add its gas; few feet depart from where they slide."""
    add = rows.add
    loads = [rows.load(name) for name in ("begun", "change", "ahead")]
    given = "plant, leg, share, gait_timing, fed, walk, begun, next_gait, ahead, length"
    reached = f"ended, carried = {add(walking.reach_end)}({given})"
    departs = f"ended, ahead = {add(walking.depart_in_walk)}(plant, fed, begun, ended, ahead, length)"
    return [
        [*loads, rows.load("next_gait"), *fed, reached, *rows.keep("ended", "carried")],
        RarePhase(
            [*loads, rows.load("ended"), *fed, departs, *rows.keep("ended", "ahead")],
            rows.cells["ended.motion.departs"],
        ),
    ]


def next_gait(rows: LaneRows) -> list[list[str]]:
    """Phases that make the gait at the end of the step: stride after stride, or on a course, with its marks."""
    add = rows.add
    if rows.program.takes_course:
        given = "gait, walk_course, gait_timing, leg, time + length"
        made = f"next_gait, marks = {add(gait_on_course)}({given})"
        return [[rows.load("gait"), rows.load("walk_course"), made, *rows.keep("next_gait", "marks")]]
    cells = {name: rows.cells[f"next_gait.{name}"] for name in GaitNow._fields}
    measured = [cells[name] for name in GaitMeasured._fields]
    rest = [name for name in GaitNow._fields if name not in GaitMeasured._fields]
    return [
        [f"place = {add(place_at)}(gait_timing, time + length)", *rows.keep("place")],
        [
            rows.load("gait"),
            rows.load("place"),
            f"measured = {add(measured_at)}(gait, gait_timing, leg, place)",
            *[f"{cells[name]} = measured.{name}" for name in GaitMeasured._fields],
        ],
        [
            f"next_gait = {add(gait_of)}(leg, {add(GaitMeasured)}({', '.join(measured)}))",
            *[f"{cells[name]} = next_gait.{name}" for name in rest],
        ],
    ]


def mark_stride(rows: LaneRows) -> list[str]:
    """Lines that add what marks a stride of a course: a scuff on the toe sensor, a forefoot on the edge of a stair."""
    if not rows.program.takes_course:
        return []
    add, follow = rows.add, rows.cells["gait_sensors.follow_rate"]
    marked = {
        "toe_force": f"{add(shown_toe_force)}(walk_after.toe_force, marks, {follow}, length)",
        "toes_first": f"{add(stands_on_toes)}(walk_after.toes_first, marks)",
    }
    fields = ", ".join(marked.get(name, f"walk_after.{name}") for name in walking.WalkState._fields)
    return [rows.load("marks"), f"walk_after = {add(walking.WalkState)}({fields})"]
