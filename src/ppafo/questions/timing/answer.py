"""The answer about timing: errors of events by wearer, way and timing, and what the slap comes from."""

from typing import Any

import numpy as np

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import quantity_text
from ppafo.control.walking.catalog import TIMINGS
from ppafo.questions.timing.figure import timing_figure
from ppafo.questions.timing.solve import STEADY, WEARERS, TimedWay, Timing
from ppafo.version import __version__
from ppafo.walking.event_times import EVENTS

PUBLISHED = {"healthy": 0.49, "impaired": 0.40}
"""Fractions by which state estimation lowered the error of event times at most (Li et al. 2011, abstract)."""

_HEAD = (
    Column("wearer"),
    Column("way"),
    Column("timing"),
    *(Column(event, "time", ".4f") for event in EVENTS),
    Column("all", "time", ".4f"),
    Column("missed", "", ".0f"),
    Column("false", "", ".0f"),
)
_POOLED = (
    Column("wearer"),
    Column("timing"),
    Column("steady", "time", ".4f"),
    Column("less", "fraction", ".0f"),
    Column("courses", "time", ".4f"),
    Column("less", "fraction", ".0f"),
    Column("published", "fraction", ".0f"),
)
_SLAP = (
    Column("changed"),
    Column("slap", "angular velocity", "z.0f"),
    Column("less slap", "angular velocity", "z.0f"),
    Column("falls through", "angle", ".1f"),
    Column("toes", "length", "z.0f"),
    Column("work", "energy", "z.2f"),
    Column("gas", "gas mass", ".3f"),
)


def answer_of(timing: Timing) -> Answer:
    """Return the answer: how far events are off on average, on each way, and the slap."""
    return Answer(
        name="timing",
        kicker="On time",
        title=f"When the controller of {timing.file} knows of the events of a stride",
        lead=tuple(_sentence(timing, wearer) for wearer in WEARERS),
        sections=(
            Section(
                "Errors of event times (RMS)",
                table=Table(_POOLED, tuple(_pooled(timing)), left=2),
                figure=Figure("timing", _CAPTION, lambda: timing_figure(timing)),
            ),
            Section(
                "By way and event",
                paragraphs=(_METHOD,),
                table=Table(_HEAD, tuple(_row(item) for item in timing.ways), left=3),
            ),
            Section(
                "What the slap of the foot comes from",
                paragraphs=(_SLAP_METHOD,),
                table=Table(_SLAP, _slap_rows(timing)),
            ),
        ),
        data=_data(timing),
    )


_CAPTION = "Heel strike, toes on, heel off and toes off together, for a healthy and an impaired wearer on each way."
_METHOD = (
    "An error is the time at which the controller knows of an event less the time at which it happens, which the "
    "simulation knows: heel strike, foot flat (toes on), heel off, toes off. It counts from 6 s on. 'Missed' are those "
    "that it knew nothing of within a quarter of a stride, 'false' those that it took for one. 'steady' repeats one "
    "stride, 'uneven' draws stride times that vary by 2.5 %; the others are the courses that come with the package."
)
_SLAP_METHOD = (
    "'Slap' is the rate of the foot as it comes down on its sole, below 0 with the toes falling; 'less slap' is what "
    "the change takes off the slap of the device as it is; 'falls through' is how far the foot is tilted up at the "
    "heel strike. With each change the swing angle is the one at which it falls nearly as far as before, because "
    "a foot that is held higher comes down faster. Without the device the toes hang low."
)


def _sentence(timing: Timing, wearer: str) -> str:
    first, *others = TIMINGS
    ways = _courses(timing)
    said = [
        f"{name} {quantity_text(timing.pooled(wearer, name, ways), 'time', '.4f')} "
        f"({quantity_text(timing.reduction(wearer, name, ways), 'fraction', '.0f')} less)"
        for name in others
    ]
    return (
        f"{wearer}, on courses: {first} are off by {quantity_text(timing.pooled(wearer, first, ways), 'time', '.4f')}, "
        f"{', '.join(said)}; published for state estimation: up to "
        f"{quantity_text(PUBLISHED[wearer], 'fraction', '.0f')} less"
    )


def _courses(timing: Timing) -> list[str]:
    return [way for way in dict.fromkeys(item.way for item in timing.ways) if way != STEADY]


def _pooled(timing: Timing) -> list[tuple[str | float | None, ...]]:
    first, courses = next(iter(TIMINGS)), _courses(timing)
    return [
        (
            wearer,
            name,
            timing.pooled(wearer, name, [STEADY]),
            None if name == first else timing.reduction(wearer, name, [STEADY]),
            timing.pooled(wearer, name, courses),
            None if name == first else timing.reduction(wearer, name, courses),
            PUBLISHED[wearer] if name == "estimated" else None,
        )
        for wearer in WEARERS
        for name in TIMINGS
    ]


def _row(item: TimedWay) -> tuple[str | float | None, ...]:
    errors = [item.events[name].rms for name in EVENTS]
    return (
        item.wearer,
        item.way,
        item.timing,
        *(None if np.isnan(error) else error for error in (*errors, item.rms)),
        float(sum(found.missed for found in item.events.values())),
        float(sum(found.false for found in item.events.values())),
    )


def _slap_rows(timing: Timing) -> tuple[tuple[str | float, ...], ...]:
    as_it_is = timing.slap[1].slap_rate
    return tuple(
        (
            item.change,
            item.slap_rate,
            item.slap_rate - as_it_is,
            item.drop,
            item.lowest_toes,
            item.push_off_work,
            item.gas,
        )
        for item in timing.slap
    )


def _data(timing: Timing) -> dict[str, Any]:
    return {
        "format": "ppafo timing",
        "schema_version": 1,
        "walk": timing.file,
        "overrides": list(timing.overrides),
        "minutes": timing.minutes,
        "published": PUBLISHED,
        "reductions": {
            wearer: {
                name: {
                    "steady": timing.reduction(wearer, name, [STEADY]),
                    "courses": timing.reduction(wearer, name, _courses(timing)),
                }
                for name in TIMINGS
            }
            for wearer in WEARERS
        },
        "ways": [_way_data(item) for item in timing.ways],
        "slap": [
            {
                "change": item.change,
                "slap_rate": item.slap_rate,
                "drop": item.drop,
                "lowest_toes": item.lowest_toes,
                "push_off_work": item.push_off_work,
                "gas": item.gas,
            }
            for item in timing.slap
        ],
        "versions": {"ppafo": __version__},
    }


def _way_data(way: TimedWay) -> dict[str, Any]:
    return {
        "wearer": way.wearer,
        "way": way.way,
        "timing": way.timing,
        "rms": _number(way.rms),
        "events": {
            name: {
                "rms": _number(found.rms),
                "known": int(found.errors.size),
                "missed": found.missed,
                "false": found.false,
            }
            for name, found in way.events.items()
        },
    }


def _number(value: float) -> float | None:
    """Return a number as JSON has it: None where there is none."""
    return None if np.isnan(value) else value
