"""Task sequence in the report of a walk: table of the segments, remarks, file of the segments and figures."""

from collections.abc import Sequence
from dataclasses import asdict, fields
from functools import partial

from ppafo.analyses.walk.document import ShownNumber, csv_of, number_texts, toes
from ppafo.errors import DataError
from ppafo.gait.gait import speed_range
from ppafo.report.display_units import si_unit
from ppafo.report.finding import Column, Section
from ppafo.simulation.scenario import Scenario
from ppafo.walking.figures.mean_stride import walk_figure
from ppafo.walking.figures.task_sequence import task_sequence_figure
from ppafo.walking.motion import walk_of
from ppafo.walking.strides import SegmentResult
from ppafo.walking.walk import WalkComparison

_NUMBERS = (
    ShownNumber(name="start", title="from", quantity="time", digits=1),
    ShownNumber(name="end", title="to", quantity="time", digits=1),
    ShownNumber(name="strides", title="strides", quantity="", digits=0),
    ShownNumber(name="gas", title="gas", quantity="gas mass", digits=2),
    ShownNumber(name="net_push_off_work", title="work", quantity="energy", digits=1),
    ShownNumber(name="lowest_toes", title="lowest toes", quantity="body length", digits=1),
    ShownNumber(name="without", title="... without", quantity="body length", digits=1),
    ShownNumber(name="flat_push", title="push, heel loaded", quantity="torque", digits=1),
)
"""Columns of the table of segments: numbers of a segment, and lowest toes without the device."""
_CAPTION = (
    "The task sequence over time. Grey: every other segment. 'Without' is the same task sequence without a device."
)
_EXPLAINED = (
    "A stride belongs to the segment of its heel strike. Work is net work on the wearer while the foot rolls over the "
    "toes. Lowest toes are heights above ground in mid-swing. A push with the heel loaded is torque in "
    "plantarflexion while the heel carries more than a tenth of the body weight.",
    "Angles are scaled with the stride length, which grows with the square root of the speed like the strides per "
    "second (constant walk ratio). Standing is a vertical shank over a flat foot. Ground forces and stance fraction "
    "are the same at every speed.",
)
_SAME_TIME = 0.05
"""Time [s] by which a recording may end before its task sequence, because of its sampling."""
_SAME_SPEED = 1.0e-9
"""Difference of speeds [m/s] that is due to rounding in unit conversion."""
_MEAN_CAPTION = (
    "Mean over all strides at constant speed on level ground, all speeds pooled, with the standard deviation as a band."
)


def task_sequence_parts(comparison: WalkComparison) -> tuple[Section, ...]:
    """Return the table of the segments and its explanation; () for a walk without a task sequence."""
    worn, bare = comparison.with_device, comparison.without_device
    if walk_of(worn.scenario).task_sequence is None:
        return ()
    bare_toes = {segment.start: segment.lowest_toes for segment in bare.segments}
    rows = [{**asdict(segment), "without": bare_toes.get(segment.start)} for segment in worn.segments]
    # The whole task sequence, or as far as walked, under the names of a segment's numbers.
    numbers = {name: metric.value for name, metric in worn.metrics.items()}
    lowest_bare_toes = bare.metrics.get("task_sequence_lowest_toes")
    is_whole = numbers["task_sequence_time"] >= numbers["task_sequence_planned_time"] - _SAME_TIME
    rows.append(
        {
            "title": "whole task sequence" if is_whole else "as far as walked",
            "start": 0.0,
            "end": numbers["task_sequence_time"],
            "strides": numbers["task_sequence_strides"],
            "gas": numbers["task_sequence_gas"],
            "net_push_off_work": numbers["task_sequence_work"],
            "lowest_toes": numbers.get("task_sequence_lowest_toes"),
            "without": None if lowest_bare_toes is None else lowest_bare_toes.value,
            "flat_push": numbers["task_sequence_flat_push"],
        }
    )
    for row in rows:
        row.update({name: toes(row[name]) for name in ("lowest_toes", "without")})
    table = [Column("Segment", [row["title"] for row in rows])]
    for number in _NUMBERS:
        head, *cells = number_texts(number, (row[number.name] for row in rows))
        table.append(Column(str(head), cells))
    means = (
        f"The numbers below are means over the {numbers['steady_strides']:.0f} of "
        f"{numbers['task_sequence_strides']:.0f} strides that are at an even speed on level ground."
    )
    return (
        Section(columns=table, marked=(len(rows) - 1,)),
        Section("How to read the task sequence", said=_EXPLAINED, is_detail=True),
        Section(said=(means,)),
    )


def task_sequence_pictures(comparison: WalkComparison) -> tuple[Section, ...]:
    """Return the figures of the task sequence over time and, if available, of the mean of its steady strides."""
    worn, bare = comparison.with_device, comparison.without_device
    mean = partial(walk_figure, {"with the device": worn, "without": bare})
    pictures = (
        Section(
            "The task sequence",
            name="task-sequence",
            caption=_CAPTION,
            draw=partial(task_sequence_figure, worn, bare),
            is_detail=True,
        ),
        Section("The mean stride", name="mean-stride", caption=_MEAN_CAPTION, draw=mean, is_detail=True),
    )
    return pictures if worn.averages and bare.averages else pictures[:1]


def segments_csv(segments: Sequence[SegmentResult]) -> bytes:
    """Return a CSV line for each segment, in SI units; a missing value is an empty cell."""
    units = {number.name: si_unit(number.quantity) or "-" for number in _NUMBERS}
    names = [field.name for field in fields(SegmentResult) if field.name != "title"]
    heads = {name: f"{name} [{units[name]}]" if name in units else name for name in names}
    return csv_of({head: [getattr(segment, name) for segment in segments] for name, head in heads.items()})


def trust_remark(configuration: Scenario) -> str:
    """Return a remark on segments outside the speed range to which the gait can be scaled; empty without any."""
    sequence, gait = walk_of(configuration).task_sequence, walk_of(configuration).gait
    if sequence is None:
        return ""
    try:
        low, high = speed_range(gait)
    except DataError:
        return f"gait '{gait.name}' has no walking speed: the range over which its strides can be scaled is unknown"
    speeds = [segment.values["speed"] for segment in sequence.segments if "speed" in segment.values]
    for segment in sequence.segments:
        if "cadence" in segment.values:
            # A cadence counts both feet; the speed goes with its square, as the walk ratio is constant.
            ratio = 0.5 * segment.values["cadence"] * gait.stride_time
            speeds.append((gait.walking_speed or 0.0) * ratio * ratio)
    # A speed at the edge, written in another unit, is not beyond it.
    outside = [speed for speed in speeds if not low - _SAME_SPEED <= speed <= high + _SAME_SPEED]
    if not outside:
        return ""
    listed = ", ".join(sorted({f"{speed:.2g}" for speed in outside}))
    return (
        f"gait '{gait.name}' is scaled to {listed} m/s, outside {low:.3g} to {high:.3g} m/s: its angles "
        "and forces there are assumed, not measured"
    )
