"""What a task sequence or a bottle adds to a walk: tables, remarks, data, files, pictures."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, fields
from functools import partial
from typing import Any

import numpy as np

from ppafo.analyses.walk.document import Row, csv_of, number_texts, toes
from ppafo.errors import DataError
from ppafo.gait.gait import speed_range
from ppafo.report.display_units import QUANTITIES
from ppafo.report.finding import Column, Part, facts
from ppafo.report.kind import Kind
from ppafo.simulation.scenario import Scenario
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.walking.bottle import SupplyCourse, lasted, minutes_text, strides_text
from ppafo.walking.figures.bottle import bottle_figure
from ppafo.walking.figures.mean_stride import walk_figure
from ppafo.walking.figures.task_sequence import task_sequence_figure
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WalkResult
from ppafo.walking.strides import SegmentResult
from ppafo.walking.walk import Comparison

_BOTTLE_CAPTION = (
    "The supply over the walk. A regulator holds at most its set pressure, and less once the bottle has too little. "
    "Gas at the device is what comes out of the hose."
)
_BOTTLE_EXPLAINED = (
    "The vapour of liquid CO2 lacks heat: from 20 degC it wants 95 kJ/kg to be gas of 25 degC behind the regulator. It "
    "takes it from the regulator's body and from the hose, which take it from the room. Below the triple point dry ice "
    "stays in the seat and narrows it. The gas in lines and chambers keeps the temperature with which it leaves the "
    "hose; in truth their walls warm it, so its effect here is the largest that it can have.",
    "A walk ends where the line behind the regulator no longer comes within the given share of the set pressure in two "
    "strides, or where the fluid in the bottle freezes.",
)


def bottle_parts(worn: WalkResult) -> tuple[Part, ...]:
    """Return the facts of the bottle of a walk, its figure and how to read them; nothing without a bottle."""
    supply = worn.supply
    if supply is None:
        return ()
    draw, caption = partial(bottle_figure, worn), _BOTTLE_CAPTION
    return (
        Part("On the bottle", facts(_facts(worn, supply))),
        Part("The bottle over the walk", name="bottle", caption=caption, draw=draw, is_detail=True),
        Part("How to read the bottle", said=_BOTTLE_EXPLAINED, is_detail=True),
    )


def bottle_remark(worn: WalkResult) -> str:
    """Return what ended a walk on its bottle, and when."""
    supply = worn.supply
    assert supply is not None, "said of a walk on a bottle"
    time = lasted(supply)
    ended = "" if time is None else f"lasts {minutes_text(time)}: "
    return f"bottle {supply.supply.bottle.name}: {ended}{supply.ending.message}"


def _facts(worn: WalkResult, supply: SupplyCourse) -> list[tuple[str, str]]:
    values, peaks, motion = supply.values, worn.peak_torques, walk_of(worn.scenario)
    bottle, balance = supply.supply.bottle, supply.balance
    end = {name: float(series[-1]) for name, series in values.items()}
    liquid = f", {_GAS.text(end['liquid_mass'])} of it liquid" if "liquid_mass" in values else ""
    full = _GAS.text(supply.supply.mass)
    walked = f"after {worn.helped.size} whole strides"
    # Strides are counted by time, as ``ppafo bottle`` counts them.
    if motion.task_sequence is None:
        strides = strides_text(supply.ending.time / motion.gait.stride_time)
        walked = f"{strides} strides, {worn.helped.size} of them whole between strikes"
    rows = [
        ("bottle", f"{bottle.title}, with {full} at {_WARMTH.text(supply.supply.temperature)}"),
        ("what ended it", supply.ending.message),
        ("when", f"{_DURATION.text(supply.ending.time)}, {walked}"),
        ("gas used", f"{_GAS.text(balance.left_bottle)}, left {_GAS.text(end['bottle_mass'])}{liquid}"),
        ("bottle at the end", f"{_WARMTH.text(end['bottle_temperature'])}, {_PRESSURE.text(end['bottle_pressure'])}"),
        ("coldest gas behind the regulator", _WARMTH.text(float(values["outlet_temperature"].min()))),
        ("coldest gas at the device", _WARMTH.text(float(values["gas_temperature"].min()))),
        ("seat free of ice, at least", _SHARE.text(float(values["seat_open"].min()))),
    ]
    # The third stride is the first in which the controller knows the stride time.
    if peaks.size > 3:
        third, last = (_TORQUE.text(float(peak)) for peak in (peaks[2], peaks[-1]))
        rows.append(("peak torque of a stride", f"{third} in the third, {last} in the last"))
    return rows


def bottle_data(worn: WalkResult) -> dict[str, Any]:
    """Return the supply as data in SI units: what ended it, what closes, all at the end; nothing without a bottle."""
    supply = worn.supply
    if supply is None:
        return {}
    return {
        "supply": {
            **supply.supply.to_dict(),
            "ending": supply.ending._asdict(),
            "balance": supply.balance._asdict(),
            "at_end": {name: float(values[-1]) for name, values in supply.values.items()},
            "lowest": {name: float(np.min(values)) for name, values in supply.values.items()},
        }
    }


_DURATION, _TORQUE, _GAS = (Kind(quantity=name, form=".3g") for name in ("duration", "torque", "gas mass"))
_SHARE, _WARMTH, _PRESSURE = (Kind(quantity=name, form=".0f") for name in ("fraction", "temperature", "pressure"))
_NUMBERS: tuple[Row, ...] = (
    ("start", "from", "time", 1),
    ("end", "to", "time", 1),
    ("strides", "strides", "", 0),
    ("helped", "helped", "", 0),
    ("gas", "gas", "gas mass", 2),
    ("net_push_off_work", "work", "energy", 1),
    ("lowest_toes", "lowest toes", "body length", 1),
    ("without", "... without", "body length", 1),
    ("flat_push", "push, heel loaded", "torque", 1),
    ("safe_time", "less help at", "time", 2),
)
_TASK_SEQUENCE = (
    "The task sequence over time. Grey: every other segment. 'Without' is the same task sequence without a device."
)
_EXPLAINED = (
    "A stride counts for the segment in which its foot strikes; it is helped where the controller neither lifts only "
    "nor pauses nor has stopped before the next strike. Work is net work on the wearer while the foot rolls over the "
    "toes. Lowest toes are over the ground, in the middle part of a swing. A push with the heel loaded is torque in "
    "plantarflexion while the heel carries more than a tenth of the body weight.",
    "Angles go with the length of the stride, which goes with the square root of the speed, as the strides per second "
    "do: a constant walk ratio. Standing is a vertical shank over a flat foot. The forces of a stride and the fraction "
    "of the stance stay the same at every speed.",
)
_SAME_TIME = 0.05
"""Time [s] by which a recording may end before its task sequence: its samples."""
_MEAN = (
    "Mean over the strides at an even speed on level ground, of all speeds together, with the standard deviation as a "
    "band."
)


def task_sequence_parts(comparison: Comparison) -> tuple[Part, ...]:
    """Return the table of the segments, and how to read it; nothing for a walk without a task sequence."""
    worn, bare = comparison.with_device, comparison.without_device
    if walk_of(worn.scenario).task_sequence is None:
        return ()
    without = {segment.start: segment.lowest_toes for segment in bare.segments}
    rows = [asdict(segment) | {"without": without.get(segment.start)} for segment in worn.segments]
    numbers: dict[str, float] = {name: metric.value for name, metric in worn.metrics.items()}
    bare_toes = bare.metrics.get("task_sequence_lowest_toes")
    is_whole = numbers["task_sequence_time"] >= numbers["task_sequence_planned_time"] - _SAME_TIME
    rows.append(
        {
            "title": "whole task sequence" if is_whole else "as far as walked",
            "start": 0.0,
            "end": numbers["task_sequence_time"],
            "strides": numbers["task_sequence_strides"],
            "helped": sum(segment.helped for segment in worn.segments),
            "gas": numbers["task_sequence_gas"],
            "net_push_off_work": numbers["task_sequence_work"],
            "lowest_toes": numbers.get("task_sequence_lowest_toes"),
            "without": None if bare_toes is None else bare_toes.value,
            "flat_push": numbers["task_sequence_flat_push"],
            "safe_time": numbers.get("safe_state_time"),
        }
    )
    rows = [row | {name: toes(row[name]) for name in ("lowest_toes", "without")} for row in rows]
    table = [Column("Segment", [row["title"] for row in rows])]
    for number in _NUMBERS:
        head, *cells = number_texts(number, (row[number[0]] for row in rows))
        table.append(Column(str(head), cells))
    means = (
        f"The numbers below are means over the {numbers['steady_strides']:.0f} of "
        f"{numbers['task_sequence_strides']:.0f} strides that are at an even speed on level ground."
    )
    return (
        Part(columns=table, marked=(len(rows) - 1,)),
        Part("How to read the task sequence", said=_EXPLAINED, is_detail=True),
        Part(said=(means,)),
    )


def task_sequence_pictures(comparison: Comparison) -> tuple[Part, ...]:
    """Return the task sequence over time, and the mean of its even strides where there are any."""
    worn, bare = comparison.with_device, comparison.without_device
    mean = partial(walk_figure, {"with the device": worn, "without": bare})
    pictures = (
        Part(
            "The task sequence",
            name="task-sequence",
            caption=_TASK_SEQUENCE,
            draw=partial(task_sequence_figure, worn, bare),
            is_detail=True,
        ),
        Part("The mean stride", name="mean-stride", caption=_MEAN, draw=mean, is_detail=True),
    )
    return pictures if worn.averages and bare.averages else pictures[:1]


def task_sequence_files(comparison: Comparison) -> dict[str, Callable[[], bytes]]:
    """Return the files of a task sequence, its segments with and without the device, and of a bottle over the walk."""
    files: dict[str, Callable[[], bytes]] = {}
    if walk_of(comparison.with_device.scenario).task_sequence is not None:
        files["segments.csv"] = lambda: segments_csv(comparison.with_device.segments)
        files["segments-off.csv"] = lambda: segments_csv(comparison.without_device.segments)
    supply = comparison.with_device.supply
    if supply is not None:
        files["bottle.csv"] = lambda: marked_csv_bytes(supply.recording)
    return files


def segments_csv(segments: Sequence[SegmentResult]) -> bytes:
    """Return one line for each segment, in SI units; a cell is empty where there is nothing to say."""
    units = {name: QUANTITIES[quantity][0] if quantity else "-" for name, _, quantity, _ in _NUMBERS}
    names = [field.name for field in fields(SegmentResult) if field.name != "title"]
    heads = [f"{name} [{units[name]}]" if name in units else name for name in names]
    return csv_of(
        {head: [getattr(segment, name) for segment in segments] for head, name in zip(heads, names, strict=True)}
    )


def task_sequence_data(comparison: Comparison) -> dict[str, Any]:
    """Return the segments as data, in SI units; nothing for a walk without a task sequence."""
    worn, bare = comparison.with_device, comparison.without_device
    sequence = walk_of(worn.scenario).task_sequence
    if sequence is None:
        return {}
    return {
        "task_sequence": sequence.name,
        "segments": [asdict(segment) for segment in worn.segments],
        "segments_off": [asdict(segment) for segment in bare.segments],
    }


def trust_remark(configuration: Scenario) -> str:
    """Return which segments go beyond the speeds for which scaling the gait can be trusted; empty where none does."""
    sequence, gait = walk_of(configuration).task_sequence, walk_of(configuration).gait
    if sequence is None:
        return ""
    try:
        low, high = speed_range(gait)
    except DataError:
        return f"gait '{gait.name}' has no walking speed: how far its strides can be scaled is not known"
    given = [segment.values["speed"] for segment in sequence.segments if "speed" in segment.values]
    recorded = gait.walking_speed or 0.0
    # A cadence counts steps of both feet; the speed goes with its square, as the walk ratio is constant.
    ratios = [
        0.5 * segment.values["cadence"] * gait.stride_time
        for segment in sequence.segments
        if "cadence" in segment.values
    ]
    speeds = [*given, *(recorded * ratio * ratio for ratio in ratios)]
    # A speed at the edge, written in another unit, is not beyond it.
    far = sorted({f"{speed:.2g}" for speed in speeds if not low - 1.0e-9 <= speed <= high + 1.0e-9})
    if not far:
        return ""
    return (
        f"gait '{gait.name}' is scaled to {', '.join(far)} m/s: beyond {low:.3g} to {high:.3g} m/s, where its angles "
        "and forces are assumed and not measured"
    )
