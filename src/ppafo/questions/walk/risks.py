"""What can go wrong in a walk: a table in the form of ISO 14971, of simulated faults, to begin a risk file from.

Every fault of the plant, and faults of each sensor, begin at some instants of a stride. What is shown is the worst of
them: how long until the walk is safe, by which sign, the angular impulse against the wearer and the lowest toes until
then, and the torque that is left.
"""

import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ppafo.answers import Answer, Column, Section, Table
from ppafo.model import contact as ground
from ppafo.model.plant_faults import PLANT_FAULTS
from ppafo.questions.question import Solved
from ppafo.simulation.scenario import Scenario
from ppafo.walking.declaration import FAULTY, READINGS, fault_numbers
from ppafo.walking.motion import SHORTEST_STRIDES, check_led, walk_of, with_duration
from ppafo.walking.preparation import FaultSettings
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import walk, with_device_off

INSTANTS, FIRST, AFTER = 4, 4, 4
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


@dataclass(frozen=True, slots=True)
class Risk:
    """One cause, with the worst of its instants: times [s], impulse [N m s], heights [m], torque [N m]."""

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


@dataclass(frozen=True, slots=True, eq=False)
class Risks(Solved):
    """The risks of a walk, and its lowest toes [m] without the device."""

    scenario: Scenario
    risks: tuple[Risk, ...]
    bare_toes: float


def risks_of_walk(configuration: Scenario) -> Risks:
    """The table of a walk's faults: each begins at four instants of its fifth stride, and the worst is kept."""
    check_led(configuration, "the table of risks")
    stride = walk_of(configuration).gait.stride_time
    motion = replace(walk_of(configuration), course=None, bottle=None)
    length = max(FIRST + AFTER + 1, SHORTEST_STRIDES) * stride
    level = with_duration(replace(configuration, motion=motion), length)
    bare = _toes(walk(with_device_off(level)), FIRST * stride)
    begins = [(FIRST + place / INSTANTS) * stride for place in range(INSTANTS)]
    risks = [_risk(level, cause, begins, bare) for cause in _causes(level)]
    return Risks(level, tuple(risks), bare)


@dataclass(frozen=True, slots=True)
class _Cause:
    """A part or sensor that fails, how, with which numbers beside the time, and in words."""

    part: str
    kind: str
    numbers: dict[str, float]
    words: str


def _causes(configuration: Scenario) -> Iterator[_Cause]:
    has_lines = configuration.supply_lines is not None
    for part, kinds in PLANT_FAULTS.items():
        if has_lines and part.startswith(("regulator", "bottle")):
            continue
        for kind, fault in kinds.items():
            numbers = {item.name: item.default or 0.0 for item in fault.quantities if item.name != "time"}
            yield _Cause(part, kind, numbers, f"{part.replace('_', ' ')} {kind.replace('_', ' ')}")
    readings = {"angle": 0.5 * np.pi, "pressure_1": configuration.device.supply.atmospheric_pressure}
    readings["pressure_2"] = readings["pressure_1"]
    for sensor in FAULTY:
        name = sensor.replace("_", " ")
        own = {READINGS[sensor].name: float(readings.get(sensor, 0.0))}
        yield _Cause(sensor, "stuck", own, f"{name} sensor stuck at {LOWEST[sensor]}")
        yield _Cause(sensor, "frozen", {}, f"{name} sensor frozen")


def _failing(configuration: Scenario, cause: _Cause, time: float) -> Scenario:
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


def _risk(configuration: Scenario, cause: _Cause, begins: list[float], bare: float) -> Risk:
    found = [_one(walk(_failing(configuration, cause, time)), cause, time, bare) for time in begins]
    return max(found, key=lambda item: (item.left, item.impulse, bare - item.toes))


def _against(result: WalkResult) -> np.ndarray:
    """Torque against the foot's way [N m]: down on the heel, up on the toes, down in the swing; below 0 it helps."""
    torque, contact = result.recording["torque"], result.recording["contact"]
    return np.where(contact == ground.TOE, -torque, torque)


def _toes(result: WalkResult, since: float) -> float:
    data = result.recording
    swings = (data["contact"] == ground.SWING) & (data.time >= since)
    return float(data["toe_height"][swings].min()) if swings.any() else 0.0


def _one(result: WalkResult, cause: _Cause, begins: float, bare: float) -> Risk:
    time = result.recording.time
    against = np.maximum(_against(result), 0.0)
    event = next((item for item in result.events if item.sign is not None and item.time >= begins), None)
    alarm = None if event is None else event.time - begins
    after = time >= begins
    harmful = np.flatnonzero(after & (against > HARM))
    safe_from = begins if not harmful.size else float(time[harmful[-1]])
    is_safe = not harmful.size or harmful[-1] < time.size - 2
    to_safe = max(safe_from - begins, alarm or 0.0) if is_safe else None
    impulse = float(np.trapezoid(np.where(after & (against > HARM), against, 0.0), time))
    toes = _toes(result, begins)
    settled = time >= (begins if event is None else event.time + SETTLED)
    left = float(against[settled].max()) if settled.any() else 0.0
    drags = toes < bare - DRAGS
    hazard = "torque against the wearer" if harmful.size else ("toes drag" if drags else "loss of help")
    stays = (
        f"up to {left:.1f} N m against the wearer" if left > HARM else "no help" if event is not None else "none seen"
    )
    sign = "-" if event is None or event.sign is None else event.sign.name
    peak = float(against[after].max())
    return Risk(hazard, cause.words, cause.part, cause.kind, sign, alarm, to_safe, impulse, peak, toes, left, stays)


_HEAD = (
    Column("Hazard"),
    Column("Cause"),
    Column("Sign"),
    Column("Alarm after (s)"),
    Column("Safe after (s)"),
    Column("Harm (N m s)"),
    Column("Peak (N m)"),
    Column("Lowest toes (cm)"),
    Column("What is left"),
)


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)


def answer_of(solved: Risks) -> Answer:
    """The table as an answer: page, JSON and CSV."""
    rows = tuple(
        (
            item.hazard,
            item.cause,
            item.sign,
            _number(item.time_to_alarm, ".2f"),
            _number(item.time_to_safe_state, ".2f"),
            f"{item.impulse:.2f}",
            f"{item.peak:.1f}",
            f"{round(100.0 * item.toes, 1) + 0.0:.1f}",
            item.what_is_left,
        )
        for item in solved.risks
    )
    name, fitted = solved.scenario.name, bool(walk_of(solved.scenario).shut_off)
    valve = "A shut-off valve is fitted." if fitted else "No shut-off valve is fitted: [shut_off] of the walk fits one."
    return Answer(
        name="risks",
        kicker="What can go wrong",
        title=f"Risks of {name}",
        lead=(f"{name}: {len(rows)} causes, each at {INSTANTS} instants of a stride; the worst is shown", SAYS),
        sections=(
            Section(
                table=Table(_HEAD, rows, left=3),
                remarks=(valve, f"without the device the toes reach {100.0 * solved.bare_toes:.1f} cm"),
            ),
        ),
        data={
            "format": "ppafo risks",
            "schema_version": 1,
            "says": SAYS,
            "simulated": True,
            "walk": name,
            "shut_off": fitted,
            "toes_without_device": solved.bare_toes,
            "risks": [{field: getattr(item, field) for field in Risk.__dataclass_fields__} for item in solved.risks],
        },
        files={"risks.csv": lambda: risks_csv(solved)},
        command="walk --risks",
    )


def risks_csv(solved: Risks) -> bytes:
    """One line a cause, in SI units."""
    text = io.StringIO()
    text.write(f"# simulated: {SAYS}\n")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(Risk.__dataclass_fields__)
    writer.writerows([getattr(item, field) for field in Risk.__dataclass_fields__] for item in solved.risks)
    return text.getvalue().encode()
