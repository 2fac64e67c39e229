"""What a walking leg adds to a step of the lanes: the gait at its end, and what marks a stride of a course."""

from ppafo.engine.lane_rows import LaneRows
from ppafo.engine.scheme import walking
from ppafo.model.course import gait_on_course, shown_toe_force, stands_on_toes
from ppafo.model.gait import gait_at


def lead_walk(rows: LaneRows) -> list[list[str]]:
    """Two phases before the gas of a walking leg: the gait at the end of the step, and where the foot would be."""
    if not rows.program.walks:
        return []
    gait = next_gait(rows)
    foot = f"{rows.add(walking.begin_walk)}(plant, leg, share, gait_timing, state, walk, next_gait, length)"
    return [
        [rows.load("gait"), *gait],
        [rows.load("next_gait"), f"begun = {foot}", *rows.keep("begun")],
    ]


def next_gait(rows: LaneRows) -> list[str]:
    """Lines that make the gait at the end of the step: stride after stride, or on a course, with its marks."""
    if not rows.program.takes_course:
        return [f"next_gait = {rows.add(gait_at)}(gait, gait_timing, leg, time + length)", *rows.keep("next_gait")]
    given = "gait, walk_course, gait_timing, leg, time + length"
    return [
        rows.load("walk_course"),
        f"next_gait, marks = {rows.add(gait_on_course)}({given})",
        *rows.keep("next_gait", "marks"),
    ]


def mark_stride(rows: LaneRows) -> list[str]:
    """Lines that add what marks a stride of a course: a scuff on the toe sensor, a forefoot on the edge of a stair."""
    if not rows.program.takes_course:
        return []
    add, cells = rows.add, rows.cells
    force = f"{add(shown_toe_force)}(walk.toe_force, marks, {cells['gait_sensors.follow_rate']}, length)"
    toes = f"{add(stands_on_toes)}(walk.toes_first, marks)"
    return [rows.load("marks"), f"{cells['walk.toe_force']} = {force}", f"{cells['walk.toes_first']} = {toes}"]
