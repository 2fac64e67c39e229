"""What the meters of the lanes know of the reference: looked at once before the first sample, then followed."""

from ppafo.engine.lane_rows import LaneRows, indent, over_lanes
from ppafo.signals.meter import SAME_LEVEL, advance_course, is_away


def course_lines(rows: LaneRows) -> list[str]:
    """Lines that write the course of the reference into its rows, before the first sample.

    A monotone reference is largest at one of its ends, and where its hold starts shows on the way. Any other one is
    looked at sample by sample, over all lanes at once; its hold is looked for from the end.
    """
    if not rows.program.follows_reference:
        return []
    cell = {name: rows.cells[f"course.{name}"] for name in ("last", "largest", "tolerance", "hold_start")}
    given = [rows.load("timing"), rows.load("reference")]
    ends = [
        *given,
        f"{cell['last']} = {_value(rows, 'last_record')}",
        f"{cell['largest']} = max(abs({_value(rows, '0')}), abs({cell['last']}))",
        f"{cell['hold_start']} = 0.0",
    ]
    tolerance = over_lanes([f"{cell['tolerance']} = {SAME_LEVEL!r} * {cell['largest']}"])
    if rows.program.reference.is_monotone:
        return [*over_lanes(ends), *tolerance]
    away = f"{rows.add(is_away)}({_value(rows, 'index')}, {cell['last']}, {cell['tolerance']})"
    found = f"index + 1.0 if {cell['hold_start']} == 0.0 and {away} else {cell['hold_start']}"
    return [
        *over_lanes(ends),
        "for index in range(last_record):",
        *indent(over_lanes([*given, f"{cell['largest']} = max({cell['largest']}, abs({_value(rows, 'index')}))"])),
        *tolerance,
        "for index in range(last_record - 1, -1, -1):",
        *indent(over_lanes([*given, f"{cell['hold_start']} = {found}"])),
        "    earliest = 1.0",
        *indent(over_lanes([f"earliest = min(earliest, {cell['hold_start']})"])),
        "    if earliest > 0.0:",
        "        break",
    ]


def follow_lines(rows: LaneRows) -> list[str]:
    """Lines that load the course, and follow it where its hold is not known ahead."""
    if not rows.program.follows_reference:
        return ["course = ()"]
    if not rows.program.reference.is_monotone:
        return [rows.load("course")]
    return [
        rows.load("course"),
        f"course = {rows.add(advance_course)}(course, sample)",
        f"{rows.cells['course.hold_start']} = course.hold_start",
    ]


def _value(rows: LaneRows, number: str) -> str:
    return f"{rows.add(rows.program.reference.value)}(reference, {number} * interval * timing.step)[0]"
