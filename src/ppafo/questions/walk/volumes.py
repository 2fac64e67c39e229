"""The walk, of one wearer or of many, with other readings of the paper's chambers: what each comes to."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ppafo.answers import Column, Section, Table
from ppafo.parameters.chamber_volumes import ChamberVolumes, other_readings, own_reading
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.walking.bottle import WALKED, Schedule, SupplyCourse, lasted
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WalkResult, integral_of_a_stride
from ppafo.walking.walk import Population, Progress, bottle_life, walk, walk_population

LONGEST = 1.0
"""Minutes that are walked at most with other chambers: a walk repeats itself, but for a course and on a bottle."""
_DAY = 24.0 * 3600.0
_TO_THE_END = Schedule(_DAY, 0.0, _DAY)
_HEAD = (
    Column("chambers"),
    Column("swept", "volume per angle", ".3g"),
    Column("dead", "volume", ".3g"),
    Column("gas per stride", "gas mass", ".3f"),
    Column("work of the gas", "energy", ".2f"),
    Column("at the shaft", "energy", ".2f"),
    Column("in push-off", "energy", ".2f"),
    Column("peak torque", "torque", ".2f"),
)
_ON_BOTTLE = (Column("bottle", "duration", ".3g"), Column("ended"))
_EXPLAINED = (
    "The paper's torque constant and volume per angle contradict each other by virtual work, so the walk is repeated, "
    f"for at most {LONGEST:g} min, with other chambers, which the observer of the controller knows. With the volume by "
    "virtual work and dead volumes that are as large as the torque task's gas wants, the torque that was published of "
    "walking at 90 psig does not come in time; with short lines it does, and the torque task does not take its "
    "gas. Work of the gas is the integral of (P1 - P2) dV over a stride with help, work at the shaft that of the "
    "actuator torque. The peak torque is that of the mean stride."
)


@dataclass(frozen=True, slots=True, eq=False)
class VolumeReading:
    """A walk with some chambers; works of a stride [J], peak of the mean torque [N m].

    ``on_bottle`` is the course of its bottle to the end, None without one: of a walk that its bottle outlasts it goes
    on where the bottle of the walk itself ended.
    """

    chambers: ChamberVolumes
    result: WalkResult
    gas_work: float
    shaft_work: float
    peak_torque: float
    on_bottle: SupplyCourse | None


def walks_by_volume(result: WalkResult, minutes: float | None = None) -> tuple[VolumeReading, ...]:
    """Return a walk and the same with the other readings of its chambers; none where it has chambers of its own.

    The walk is left alone where no gas was taken or it has no whole strides, for then nothing rests on the volume. On a
    bottle the others walk for as many ``minutes`` [min] as it was to be, each on a bottle of its own, which is then
    walked to its end if that of the walk itself ended.
    """
    actuator = result.scenario.device.actuator
    others, own = other_readings(actuator), own_reading(actuator)
    takes_gas = float(result.recording["supplied_mass"][-1]) > 0.0
    if not takes_gas or own is None or not others or not result.averages:
        return ()
    if result.supply is None:
        walked = float(result.recording.time[-1]) / 60.0
        minutes = min(walked, LONGEST) if walk_of(result.scenario).course is None else walked
    found = [_read(own, result)]
    for chambers in others:
        configuration = result.scenario
        other = walk(with_numbers(configuration, chambers.numbers()), minutes)
        if other.status.is_completed and other.averages:
            on_bottle = other.supply
            if result.supply is not None and lasted(result.supply) is not None and _outlasts(on_bottle):
                on_bottle = bottle_life(other.scenario, _TO_THE_END).course
            found.append(replace(_read(chambers, other), on_bottle=on_bottle))
    return tuple(found)


def _outlasts(course: SupplyCourse | None) -> bool:
    return course is not None and course.ending.kind == WALKED


def _read(chambers: ChamberVolumes, result: WalkResult) -> VolumeReading:
    recording = result.recording
    turned = integral_of_a_stride(result, recording["pressure_1"] - recording["pressure_2"])
    torque_constant = result.scenario.device.actuator.torque_constant
    return VolumeReading(
        chambers=chambers,
        result=result,
        gas_work=chambers.volume_per_angle * turned,
        shaft_work=torque_constant * turned,
        peak_torque=float(result.averages["torque"].mean.max()),
        on_bottle=result.supply,
    )


def volumes_sections(read: tuple[VolumeReading, ...]) -> tuple[Section, ...]:
    """Return the table of the readings, and how to read it; nothing without them."""
    if not read:
        return ()
    on_bottle = any(one.result.supply is not None for one in read)
    head = (*_HEAD, *_ON_BOTTLE) if on_bottle else _HEAD
    table = Table(head, tuple((*_row(one), *((_lasts(one), _ending(one)) if on_bottle else ())) for one in read))
    return (
        Section("What rests on the volume of the chambers", table=table),
        Section("Why there are several chambers", (_EXPLAINED,), is_detail=True),
    )


def _row(one: VolumeReading) -> tuple[str | float | None, ...]:
    chambers, metrics = one.chambers, one.result.metrics
    return (
        chambers.name,
        chambers.volume_per_angle,
        chambers.dead_volume_1,
        metrics["gas"].value,
        one.gas_work,
        one.shaft_work,
        metrics["positive_push_off_work"].value,
        one.peak_torque,
    )


def _lasts(one: VolumeReading) -> float | None:
    """Return how long the bottle lasts [s], None where the walk ended before it did."""
    return None if one.on_bottle is None else lasted(one.on_bottle)


def _ending(one: VolumeReading) -> str | None:
    return None if one.on_bottle is None else one.on_bottle.ending.kind


def volumes_data(read: tuple[VolumeReading, ...]) -> list[Mapping[str, Any]]:
    """Return the readings as plain data in SI."""
    return [
        {
            "chambers": one.chambers.name,
            "volume_per_angle": one.chambers.volume_per_angle,
            "dead_volume_1": one.chambers.dead_volume_1,
            "dead_volume_2": one.chambers.dead_volume_2,
            "gas_per_stride": one.result.metrics["gas"].value,
            "stride_time": walk_of(one.result.scenario).gait.stride_time,
            "gas_work": one.gas_work,
            "shaft_work": one.shaft_work,
            "positive_push_off_work": one.result.metrics["positive_push_off_work"].value,
            "peak_torque": one.peak_torque,
            **(
                {} if one.on_bottle is None else {"walking_time": _lasts(one), "ending": one.on_bottle.ending._asdict()}
            ),
        }
        for one in read
    ]


LARGEST = 200
"""Wearers and minutes that are walked at most with other chambers."""
_WEARERS_HEAD = (
    Column("chambers"),
    Column("wearers", form=".0f"),
    Column("gas per stride, 5 %", "gas mass", ".3f"),
    Column("median", "gas mass", ".3f"),
    Column("95 %", "gas mass", ".3f"),
    Column("work in push-off, median", "energy", ".2f"),
)
_WEARERS_EXPLAINED = (
    "The paper's torque constant and volume per angle contradict each other by virtual work (`ppafo audit`), so some "
    f"wearers walk again with other chambers: {LARGEST} at most, for at most {LONGEST:g} min, with the same "
    "seed."
)
_QUANTILES = (0.05, 0.5, 0.95)


def wearers_by_volume(
    configuration: Scenario, minutes: float | None, wearers: int, seed: int, progress: Progress
) -> tuple[Population, Mapping[str, Population]]:
    """Return the wearers, and all readings of their chambers by name; {} for chambers of its own or without gas."""
    population = walk_population(configuration, minutes, wearers, seed, progress)
    actuator = configuration.device.actuator
    own = own_reading(actuator)
    if own is None or not population.count or not float(np.median(population.outcomes["gas"])) > 0.0:
        return population, {}
    shorter = minutes if walk_of(configuration).course is not None else min(population.minutes, LONGEST)
    found = {own.name: population}
    for chambers in other_readings(actuator):
        other = with_numbers(configuration, chambers.numbers())
        found[chambers.name] = walk_population(other, shorter, min(wearers, LARGEST), seed)
    return population, found


def wearers_volumes_sections(read: Mapping[str, Population]) -> tuple[Section, ...]:
    """Return the table of the readings, and how to read it; nothing without them."""
    if not read:
        return ()
    rows = tuple((name, *_wearers_row(population)) for name, population in read.items())
    return (
        Section("What rests on the volume of the chambers", table=Table(_WEARERS_HEAD, rows)),
        Section("Why there are several chambers", (_WEARERS_EXPLAINED,), is_detail=True),
    )


def _wearers_row(population: Population) -> tuple[float | None, ...]:
    gas = np.quantile(population.outcomes["gas"], _QUANTILES).tolist() if population.count else [None] * 3
    work = float(np.median(population.outcomes["positive_push_off_work"])) if population.count else None
    return population.count, *gas, work


def wearers_volumes_data(read: Mapping[str, Population]) -> list[dict[str, Any]]:
    """Return the readings as plain data in SI units."""
    names = ("wearers", "gas_low", "gas_median", "gas_high", "positive_push_off_work_median")
    return [
        {"chambers": name, **dict(zip(names, _wearers_row(population), strict=True))}
        for name, population in read.items()
    ]
