"""Many wearers with the other readings of the paper's chambers: their gas, work and minutes of a bottle."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ppafo.answers import Column, Section, Table
from ppafo.parameters.bottles.bottle import PAPER_BOTTLE, load_bottle
from ppafo.parameters.chamber_volumes import other_readings, own_reading
from ppafo.questions.endurance.draw import draw_of_numbers
from ppafo.questions.endurance.solve import WITHOUT_REST, follow_bottle
from ppafo.simulation.scenario import Scenario
from ppafo.walking.motion import walk_of
from ppafo.walking.population import Population, walk_population
from ppafo.walking.walk import Progress

LARGEST, LONGEST = 200, 1.0
"""Wearers and minutes that are walked at most with other chambers."""
_HEAD = (
    Column("chambers"),
    Column("wearers", form=".0f"),
    Column("gas per stride, 5 %", "gas mass", ".3f"),
    Column("median", "gas mass", ".3f"),
    Column("95 %", "gas mass", ".3f"),
    Column("work in push-off, median", "energy", ".2f"),
    Column("bottle, median gas", "duration", ".3g"),
)
_EXPLAINED = (
    "The paper's torque constant and volume per angle contradict each other by virtual work (`ppafo audit`), so some "
    f"wearers walk again with other chambers: {LARGEST} at most, for at most {LONGEST:g} min, with the same seed. "
    "The bottle is the paper's, followed with the median gas of a stride, drawn evenly."
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
        other = replace(configuration, device=chambers.of(configuration.device))
        found[chambers.name] = walk_population(other, shorter, min(wearers, LARGEST), seed)
    return population, found


def wearers_volumes_sections(read: Mapping[str, Population]) -> tuple[Section, ...]:
    """Return the table of the readings, and how to read it; nothing without them."""
    if not read:
        return ()
    rows = tuple((name, *_row(population)) for name, population in read.items())
    return (
        Section("What rests on the volume of the chambers", table=Table(_HEAD, rows)),
        Section("Why there are several chambers", (_EXPLAINED,), is_detail=True),
    )


def _row(population: Population) -> tuple[float | None, ...]:
    gas = np.quantile(population.outcomes["gas"], _QUANTILES).tolist() if population.count else [None] * 3
    work = float(np.median(population.outcomes["push_off_work"])) if population.count else None
    return population.count, *gas, work, _lasts(population)


def _lasts(population: Population) -> float | None:
    """Return how long the paper's bottle lasts [s] with the median gas of a stride."""
    if not population.count:
        return None
    gas, time = (float(np.median(values)) for values in (population.outcomes["gas"], population.traits["stride_time"]))
    draw = draw_of_numbers(gas, time, None)
    return follow_bottle(load_bottle(PAPER_BOTTLE), draw, WITHOUT_REST).discharge.walking_time


def wearers_volumes_data(read: Mapping[str, Population]) -> list[dict[str, Any]]:
    """Return the readings as plain data in SI units."""
    names = ("wearers", "gas_low", "gas_median", "gas_high", "push_off_work_median", "walking_time")
    return [{"chambers": name, **dict(zip(names, _row(population), strict=True))} for name, population in read.items()]
