"""What can go wrong in a walk: a table in the form of ISO 14971, of simulated faults, to begin a risk file from.

Every fault of the plant, and faults of each sensor, begin at some instants of a stride. Each number is the worst of
them: how long until the walk is safe, the angular impulse against the wearer, the lowest toes, the torque that is left.
"""

import csv
import io
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ppafo.answers import Answer, Column, Section, Table
from ppafo.control.walking.signs import FORCE_RANGE, LIFTS, PAUSED, SIGNS, STOPPED, level_of
from ppafo.model import contact as ground
from ppafo.model.plant_faults import PLANT_FAULTS
from ppafo.questions.question import Solved
from ppafo.simulation.declaration import short_quantity_text
from ppafo.simulation.scenario import Scenario
from ppafo.walking.declaration import FAULTY, READINGS, fault_numbers
from ppafo.walking.events import SILENT
from ppafo.walking.motion import SHORTEST_STRIDES, check_led, walk_of, with_duration
from ppafo.walking.preparation import FaultSettings
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import walk, with_device_off

INSTANTS, FIRST, AFTER = 4, 4, 6
"""Instants of a stride at which each fault begins, the stride in which it does, and strides that are walked on."""

HARM, SETTLED = 2.0, 0.5
"""Torque against the wearer [N m] that is harm, and time [s] after an alarm from which what is left counts."""

DRAGS = 0.01
"""Toes lower than without the device by more than this [m] drag."""

LOWEST = {"heel": "0 N", "toe": "0 N", "angle": "neutral", "pressure_1": "atmosphere", "pressure_2": "atmosphere"}
"""At what each sensor is stuck."""

SAYS = (
    "This table is made from a simulation, not from a device: causes are those of a model, how often they happen is "
    "not in it, and severity is for those to judge who know wearer and use. It has the form of a table of ISO 14971 "
    "and is no risk analysis."
)


LEFT = {
    STOPPED: "no help until it is switched on again",
    PAUSED: "no help until the wearer walks steadily",
    LIFTS: "the foot is lifted, without push-off",
}
"""What is left of the help at each level of ``control.walking.signs``."""

NEVER = "never"

TO_FILL_IN = ("severity", "probability", "risk_control", "residual_risk")
"""Columns of the CSV file that are left empty for the risk file that it begins."""

DEFINITIONS = (
    "chamber 1 turns the toes down (plantarflexion), chamber 2 lifts them",
    f"a fault begins at {INSTANTS} instants of a stride, and each number is the worst of them; signs are those of all",
    "torque against the wearer: plantarflexion in the air and on heel or flat foot, dorsiflexion on the toes",
    f"safe: at most {HARM:g} N m against the wearer from then on, and no sooner than the alarm; 'never' where that is "
    f"not so in the last of the {AFTER} strides that follow",
    f"harm: angular impulse of the torque above {HARM:g} N m against the wearer, from the fault on",
    "toe clearance: lowest toes in a swing; below 0 the foot scuffs, for hip and knee move as prescribed",
)


@dataclass(frozen=True, slots=True)
class Risk:
    """One cause, the worst of its instants in each number: times [s], impulse [N m s], heights [m], torque [N m].

    A time is None where one instant has no alarm or no safe state; ``sign`` names the signs of all.
    """

    hazard: str
    cause: str
    part: str
    kind: str
    sign: str
    time_to_alarm: float | None
    time_to_safe_state: float | None
    impulse: float
    peak: float
    toes: float
    left: float
    what_is_left: str


@dataclass(frozen=True, slots=True)
class _Instant:
    """What a fault that begins at one instant comes to; times [s] from then on, None where never."""

    sign: str
    level: float
    alarm: float | None
    safe: float | None
    impulse: float
    peak: float
    toes: float
    left: float


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Risks(Solved):
    """The risks of a walk; lowest toes [m] without the device, and with it where nothing fails, with its peak [N m]."""

    scenario: Scenario
    risks: tuple[Risk, ...]
    bare_toes: float
    sound_toes: float
    sound_peak: float


def risks_of_walk(configuration: Scenario) -> Risks:
    """The table of a walk's faults: each begins at four instants of its fifth stride, and the worst is kept."""
    check_led(configuration, "the table of risks")
    stride = walk_of(configuration).gait.stride_time
    motion = replace(walk_of(configuration), course=None, bottle=None)
    length = max(FIRST + AFTER + 1, SHORTEST_STRIDES) * stride
    level = with_duration(replace(configuration, motion=motion), length)
    bare = _toes(walk(with_device_off(level)), FIRST * stride)
    sound = walk(level)
    begins = [(FIRST + place / INSTANTS) * stride for place in range(INSTANTS)]
    risks = [_risk(level, cause, begins, bare) for cause in causes_of(level)]
    after = sound.recording.time >= begins[0]
    peak = float(np.maximum(_against(sound), 0.0)[after].max())
    return Risks(level, tuple(risks), bare, _toes(sound, begins[0]), peak)


@dataclass(frozen=True, slots=True)
class Cause:
    """A part or sensor that fails, how, with which numbers beside the time, and in words."""

    part: str
    kind: str
    numbers: dict[str, float]
    words: str


def causes_of(configuration: Scenario) -> Iterator[Cause]:
    """The causes of a walk: every fault of its plant, and each sensor stuck and frozen."""
    has_lines = configuration.supply_lines is not None
    for part, kinds in PLANT_FAULTS.items():
        if has_lines and part.startswith(("regulator", "bottle")):
            continue
        for kind, fault in kinds.items():
            sized = [item for item in fault.quantities if item.name != "time"]
            numbers = {item.name: item.default or 0.0 for item in sized}
            sizes = ", ".join(
                f"{item.name} {short_quantity_text(numbers[item.name], item.unit)}".rstrip() for item in sized
            )
            words = f"{part.replace('_', ' ')} {kind.replace('_', ' ')}"
            yield Cause(part, kind, numbers, f"{words} ({sizes})" if sizes else words)
    readings = {"angle": 0.5 * np.pi, "pressure_1": configuration.device.supply.atmospheric_pressure}
    readings["pressure_2"] = readings["pressure_1"]
    for sensor in FAULTY:
        name = sensor.replace("_", " ")
        own = {READINGS[sensor].name: float(readings.get(sensor, 0.0))}
        yield Cause(sensor, "stuck", own, f"{name} sensor stuck at {LOWEST[sensor]}")
        yield Cause(sensor, "frozen", {}, f"{name} sensor frozen")


def failing(configuration: Scenario, cause: Cause, time: float) -> Scenario:
    """The walk in which a cause begins at a time [s]."""
    motion = walk_of(configuration)
    given: dict[str, Any] = {"time": time, **cause.numbers}
    if cause.part in FAULTY:
        numbers = {
            item.name: given.get(item.name, item.default or 0.0) for item in fault_numbers(cause.part, cause.kind)
        }
        changed = replace(motion, faults={**motion.faults, cause.part: FaultSettings(cause.kind, numbers)})
    else:
        changed = replace(motion, broken={**motion.broken, cause.part: FaultSettings(cause.kind, given)})
    return replace(configuration, motion=changed)


def _risk(configuration: Scenario, cause: Cause, begins: list[float], bare: float) -> Risk:
    found = [_one(walk(failing(configuration, cause, time)), time) for time in begins]
    alarms, safe = [item.alarm for item in found], [item.safe for item in found]
    left, toes = max(item.left for item in found), min(item.toes for item in found)
    impulse, level = max(item.impulse for item in found), max(item.level for item in found)
    drags = toes < bare - DRAGS
    hazard = "torque against the wearer" if impulse > 0.0 else ("toes drag" if drags else "loss of help")
    help_left = LEFT.get(level, "help goes on")
    return Risk(
        hazard,
        cause.words,
        cause.part,
        cause.kind,
        ", ".join(name for name, _ in Counter(item.sign for item in found).most_common()),
        None if None in alarms else max(time for time in alarms if time is not None),
        None if None in safe else max(time for time in safe if time is not None),
        impulse,
        max(item.peak for item in found),
        toes,
        left,
        f"up to {left:.1f} N m against the wearer; {help_left}" if left > HARM else help_left,
    )


def _against(result: WalkResult) -> np.ndarray:
    """Torque against the foot's way [N m]: down on the heel, up on the toes, down in the swing; below 0 it helps."""
    torque, contact = result.recording["torque"], result.recording["contact"]
    return np.where(contact == ground.TOE, -torque, torque)


def _toes(result: WalkResult, since: float) -> float:
    data = result.recording
    swings = (data["contact"] == ground.SWING) & (data.time >= since)
    return float(data["toe_height"][swings].min()) if swings.any() else 0.0


def _one(result: WalkResult, begins: float) -> _Instant:
    time = result.recording.time
    against = np.maximum(_against(result), 0.0)
    event = next((item for item in result.events if item.sign is not None and item.time >= begins), None)
    alarm = None if event is None else event.time - begins
    after = time >= begins
    harmful = np.flatnonzero(after & (against > HARM))
    last = begins if not harmful.size else float(time[harmful[-1]])
    is_safe = last < time[-1] - walk_of(result.scenario).gait.stride_time
    # Without an alarm all of it is left, but of what is over by then.
    since = (begins if not is_safe else last + time[1]) if event is None else event.time + SETTLED
    settled = time >= since
    return _Instant(
        sign="none" if event is None or event.sign is None else event.sign.name,
        level=max(float(result.recording["safe_state"][-1]), STOPPED if event and event.sign == SILENT else 0.0),
        alarm=alarm,
        safe=max(last - begins, alarm or 0.0) if is_safe else None,
        impulse=float(np.trapezoid(np.where(after & (against > HARM), against, 0.0), time)),
        peak=float(against[after].max()),
        toes=_toes(result, begins),
        left=float(against[settled].max()) if settled.any() else 0.0,
    )


_HEAD = (
    Column("Hazard"),
    Column("Cause"),
    Column("Signs"),
    Column("What is left"),
    Column("Alarm after (s)"),
    Column("Safe after (s)"),
    Column("Harm (N m s)"),
    Column("Peak (N m)"),
    Column("Toe clearance (cm)"),
)


def _number(value: float | None, form: str) -> str:
    return NEVER if value is None else format(value, form)


def _centimetres(height: float) -> str:
    return f"{round(100.0 * height, 1) + 0.0:.1f}"


def answer_of(solved: Risks) -> Answer:
    """The table as an answer: page, JSON and CSV."""
    rows = tuple(
        (
            item.hazard,
            item.cause,
            item.sign,
            item.what_is_left,
            _number(item.time_to_alarm, ".2f"),
            _number(item.time_to_safe_state, ".2f"),
            f"{item.impulse:.2f}",
            f"{item.peak:.1f}",
            _centimetres(item.toes),
        )
        for item in solved.risks
    )
    signs = {name for item in solved.risks for name in item.sign.split(", ")}
    meanings = tuple(
        (sign.name, sign.summary, LEFT[level_of(number)])
        for number, sign in (*SIGNS.items(), (FORCE_RANGE, SILENT))
        if sign.name in signs
    )
    name, fitted = solved.scenario.name, bool(walk_of(solved.scenario).shut_off)
    valve = "A shut-off valve is fitted." if fitted else "No shut-off valve is fitted: [shut_off] of the walk fits one."
    return Answer(
        name="risks",
        kicker="What can go wrong",
        title=f"Risks of {name}",
        lead=(f"{name}: {len(rows)} causes, each at {INSTANTS} instants of a stride", SAYS),
        sections=(
            Section(
                table=Table(_HEAD, rows, left=4),
                remarks=(
                    valve,
                    f"where nothing fails: at most {solved.sound_peak:.1f} N m against the wearer, toe clearance "
                    f"{_centimetres(solved.sound_toes)} cm; without the device {_centimetres(solved.bare_toes)} cm",
                    *DEFINITIONS,
                ),
            ),
            Section(
                heading="Signs",
                table=Table((Column("Sign"), Column("What is seen"), Column("What is left")), meanings, left=3),
            ),
        ),
        data={
            "format": "ppafo risks",
            "schema_version": 1,
            "says": SAYS,
            "simulated": True,
            "walk": name,
            "shut_off": fitted,
            "definitions": DEFINITIONS,
            "toes_without_device": solved.bare_toes,
            "toes_without_fault": solved.sound_toes,
            "peak_without_fault": solved.sound_peak,
            "risks": [{field: getattr(item, field) for field in Risk.__dataclass_fields__} for item in solved.risks],
        },
        files={"risks.csv": lambda: risks_csv(solved)},
        command="walk --risks",
    )


def risks_csv(solved: Risks) -> bytes:
    """One line a cause, in SI units, with empty columns for what a simulation cannot say."""
    text = io.StringIO()
    text.write(f"# simulated: {SAYS}\n")
    writer = csv.writer(text, lineterminator="\n")
    fields = tuple(Risk.__dataclass_fields__)
    writer.writerow((*fields, *TO_FILL_IN))
    writer.writerows([*(getattr(item, field) for field in fields), *("" for _ in TO_FILL_IN)] for item in solved.risks)
    return text.getvalue().encode()
