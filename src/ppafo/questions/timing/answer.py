"""Walks with every timing and what they come to: errors of events by wearer, way and timing, causes of the slap."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import quantity_text
from ppafo.answers.style import BLUE, GREY, VERMILION, house_style, mark_kind
from ppafo.control.walking.catalog import TIMINGS
from ppafo.engine.lanes import Floats, run_batch
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import NEVER_FAILED, batch_of
from ppafo.errors import ScenarioError, SimulationError
from ppafo.progress import Progress, Report, report_nothing
from ppafo.questions.question import Solved
from ppafo.questions.timing.slap import FACTORS, Falls, SlapStudy, slap_study
from ppafo.simulation.scenario import Scenario
from ppafo.version import __version__
from ppafo.walking.course import Segment, WalkingCourse, led_courses, load_course
from ppafo.walking.events import EVENTS, EventErrors, event_errors, known_events, true_events, within
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import check_led, walk_of
from ppafo.walking.planning import course_of_walk, plan_walk
from ppafo.walking.result import REMEDY
from ppafo.walking.walk import lasting

if TYPE_CHECKING:
    import matplotlib.figure

WEARERS = {"healthy": ("wearer.keeps_gait=1",), "impaired": ("wearer.keeps_gait=0",)}
"""A wearer whose muscles keep the measured gait, and the one of the walk file, whose foot drops."""
STEADY, UNEVEN = "steady", "uneven"


@dataclass(frozen=True, slots=True)
class TimedWay:
    """One wearer on one way with one timing: errors of each event."""

    wearer: str
    way: str
    timing: str
    events: Mapping[str, EventErrors]

    @property
    def rms(self) -> float:
        """Root mean square [s] of the errors of all events."""
        return rms_of([item.errors for item in self.events.values()])


def rms_of(parts: Sequence[Floats]) -> float:
    """Root mean square of several arrays together; nan without any number."""
    every = np.concatenate([np.asarray(part) for part in parts]) if parts else np.empty(0)
    return float(np.sqrt(np.mean(every**2))) if every.size else float("nan")


@dataclass(frozen=True, slots=True, repr=False)
class Timing(Solved):
    """What every timing knows of the events, and what the slap comes from; ``minutes`` of each way at most."""

    file: str
    overrides: tuple[str, ...]
    minutes: float
    ways: tuple[TimedWay, ...]
    slap: SlapStudy | None

    def pooled(self, wearer: str, timing: str, ways: Sequence[str] | None = None) -> float:
        """Root mean square [s] of all errors of a wearer with a timing, on some ways or on all."""
        chosen = [
            item
            for item in self.ways
            if (item.wearer, item.timing) == (wearer, timing) and (ways is None or item.way in ways)
        ]
        return rms_of([found.errors for item in chosen for found in item.events.values()])

    def reduction(self, wearer: str, timing: str, ways: Sequence[str] | None = None) -> float:
        """Fraction by which a timing lowers the error of thresholds."""
        return 1.0 - self.pooled(wearer, timing, ways) / self.pooled(wearer, next(iter(TIMINGS)), ways)


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
_FALL = (
    Column("foot"),
    Column("falls through", "angle", ".1f"),
    Column("slap", "angular velocity", "z.0f"),
)
_SHARES = (
    Column("changed"),
    Column("alone", "angular velocity", "+.0f"),
    Column("mean over all orders", "angular velocity", "+.0f"),
    Column("after the others", "angular velocity", "+.0f"),
)
_COMBINED = (
    *(Column(name) for name in ("valves", "volume", "pressure", "timing")),
    Column("slap", "angular velocity", "z.0f"),
    Column("as it walks", "angular velocity", "z.0f"),
    Column("falls then through", "angle", ".1f"),
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
            *_slap_sections(timing.slap),
        ),
        data={
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
            "slap": None if timing.slap is None else _slap_data(timing.slap),
            "versions": {"ppafo": __version__},
        },
    )


_CAPTION = "Heel strike, toes on, heel off and toes off together, for a healthy and an impaired wearer on each way."
_METHOD = (
    "An error is the time at which the controller knows of an event less the time at which it happens, which the "
    "simulation knows: heel strike, foot flat (toes on), heel off, toes off. It counts from 6 s on. 'Missed' are those "
    "that it knew nothing of within a quarter of a stride, 'false' those that it took for one. 'steady' repeats one "
    "stride, 'uneven' draws stride times that vary by 2.5 %; the others are the courses that come with the package."
)
_FALL_METHOD = (
    "'Slap' is the rate of the foot as it comes down on its sole, below 0 with the toes falling. A device that lifts "
    "the foot makes it fall further. The second row is the foot from the angle and the rate that it has with the "
    "device at its strike, with vented chambers: from the first row to it is what the fall makes, from there to the "
    "third what the device's torque takes off."
)
_SHARES_METHOD = (
    "What each change takes off the slap, above 0 for less: the foot falls from one state, that of the device as it is "
    "at its heel strikes, with the same pressures in the chambers; controller and valves stay their own. Every "
    "combination is tried. 'Alone' is with nothing else changed, 'mean over all orders' (Shapley) adds up to that of "
    "all together, 'after the others' is with all else changed."
)
_NO_SLAP = "Some strides do not begin on the heel: there is no fall to tell what it comes from."


def _slap_sections(slap: SlapStudy | None) -> tuple[Section, ...]:
    """Return what the slap comes from: fall and torque, the shares of four factors, all combinations."""
    title = "What the slap of the foot comes from"
    if slap is None:
        return (Section(title, paragraphs=(_NO_SLAP,)),)
    device = slap.as_it_is
    falls: tuple[tuple[str | float, ...], ...] = (
        ("without the device", slap.device_off.drop, slap.device_off.walked),
        ("as the device lifts it, vented", device.drop, slap.device_off.imposed),
        ("with the device", device.drop, device.imposed),
    )
    shares = tuple((one.factor, one.alone, one.share, one.last) for one in slap.shares)
    together = slap.walks[-1].falls.imposed - device.imposed
    combined = tuple(
        (
            *("yes" if factor.name in one.factors else "-" for factor in FACTORS),
            one.falls.imposed,
            one.falls.walked,
            one.falls.drop,
        )
        for one in slap.walks
    )
    return (
        Section(title, paragraphs=(_FALL_METHOD,), table=Table(_FALL, falls)),
        Section(
            "What valves, volume, pressure and timing contribute",
            paragraphs=(_SHARES_METHOD,),
            table=Table(_SHARES, (*shares, ("all together", None, together, None)), marked=(len(shares),)),
        ),
        Section("Every combination", table=Table(_COMBINED, combined, left=len(FACTORS)), is_detail=True),
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


def _slap_data(slap: SlapStudy) -> dict[str, Any]:
    """Return falls, shares and combinations in SI; rates are those of the foot, below 0 with the toes falling."""
    return {
        "device_off": _fall_data(slap.device_off),
        "walks": [{"factors": list(one.factors), **_fall_data(one.falls)} for one in slap.walks],
        "shares": [asdict(one) for one in slap.shares],
    }


def _fall_data(falls: Falls) -> dict[str, float | None]:
    names = ("imposed", "walked", "drop")
    return {name: _number(getattr(falls, name)) for name in names}


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


_COLOURS = (GREY, BLUE, VERMILION)
_WIDTH = 0.26
_MILLISECONDS = 1.0e3


def timing_figure(timing: Timing) -> "matplotlib.figure.Figure":
    """Return the figure: RMS errors of all events, one panel for each wearer, one group of bars for each way."""
    import matplotlib.figure

    with house_style():
        figure = matplotlib.figure.Figure(figsize=(8.4, 3.8))
        figure.subplots_adjust(left=0.08, right=0.98, top=0.84, bottom=0.14, wspace=0.08)
        panels = figure.subplots(1, len(WEARERS), sharey=True)
        for axes, wearer in zip(panels, WEARERS, strict=True):
            ways = list(dict.fromkeys(item.way for item in timing.ways))
            for number, name in enumerate(TIMINGS):
                heights = [_MILLISECONDS * timing.pooled(wearer, name, [way]) for way in ways]
                places = np.arange(len(ways)) + (number - 1.0) * _WIDTH
                axes.bar(places, heights, _WIDTH, color=_COLOURS[number % len(_COLOURS)], label=name)
            axes.set_xticks(range(len(ways)), ways)
            axes.set_title(wearer)
            axes.grid(visible=False, axis="x")
        panels[0].set_ylabel("RMS error of event times (ms)")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="upper right", ncols=len(TIMINGS))
        mark_kind(figure, "simulated")
        return figure


SETTLED = 6.0
"""Time [s] from which events count: strides are learnt by then."""
LONGEST = 2.0
UNEVEN_STRIDES = 24
VARIATION = 0.025
"""Standard deviation of stride times over their mean in steady walking, as published for healthy adults (Hausdorff
et al. 1995, J Appl Physiol 78:349, and later: 1 to 3 %)."""
SEED = 20110501


def event_timing(
    configuration: str | Path = "solenoid",
    gait: str | Path | None = None,
    minutes: float | None = None,
    overrides: Sequence[str] = (),
    progress: Report | None = None,
) -> Timing:
    """How far a controller is off in time at heel strike, toes on, heel off and toes off, with every timing.

    ``configuration`` is the name of a walk or a file, with another ``gait`` and ``overrides`` as for a walk. A healthy
    and an impaired wearer walk ``minutes`` [min] (default 1, at most 2) steadily, unevenly and on the courses that come
    with the package. The result has ``ways``, each with errors [s] by event, and ``slap``, what the foot's slap comes
    from. ScenarioError, ParameterError or DataError for bad input, SimulationError where a walk diverges.
    """
    tell, length = progress or report_nothing, 1.0 if minutes is None else minutes
    if not 0.2 <= length <= LONGEST:
        raise ScenarioError(f"{length:g} minutes: events are timed over 0.2 to {LONGEST:g} minutes")
    if any(text.partition("=")[0].strip() in ("timing.kind", "wearer.keeps_gait") for text in overrides):
        raise ScenarioError("timing.kind and wearer.keeps_gait: every timing and both wearers are tried")
    ways = ways_of(load_walk(configuration, overrides, gait))
    found: list[TimedWay] = []
    for timing in TIMINGS:
        for wearer, own in WEARERS.items():
            for way, course in ways.items():
                tell(Progress(f"{timing}, {wearer}, {way}", len(found), len(TIMINGS) * len(WEARERS) * len(ways)))
                walk = load_walk(configuration, (*overrides, *own, f"timing.kind={timing}"), gait)
                walk = replace(walk, motion=replace(walk_of(walk), course=course))
                found.append(TimedWay(wearer, way, timing, timed_events(walk, length)))
    slap = slap_study(str(configuration), (*overrides, *WEARERS["impaired"]), gait, tell)
    return Timing(str(configuration), tuple(overrides), length, tuple(found), slap)


def ways_of(configuration: Scenario) -> dict[str, WalkingCourse | None]:
    """The ways to walk: steadily, unevenly, and the courses that come with the package."""
    check_led(configuration, "event timing")
    if walk_of(configuration).course is not None:
        raise ScenarioError(f"{configuration.origin.file}: course: event timing uses its own courses; remove this one")
    if walk_of(configuration).bottle is not None:
        raise ScenarioError(f"{configuration.origin.file}: bottle: events are timed at one supply pressure; remove it")
    if configuration.control.is_fixed:
        raise ScenarioError(
            f"{configuration.origin.file}: controller.arithmetic = 'fixed': events are timed for controllers in "
            "floats; remove it"
        )
    cadence = 2.0 / walk_of(configuration).gait.stride_time
    return {STEADY: None, UNEVEN: uneven_course(cadence)} | {name: load_course(name) for name in led_courses()}


def uneven_course(cadence: float) -> WalkingCourse:
    """Strides whose times vary as those of people do, about a cadence [1/s] of steps."""
    generator = np.random.default_rng(SEED)
    paces = cadence / (1.0 + VARIATION * np.clip(generator.standard_normal(UNEVEN_STRIDES), -2.0, 2.0))
    strides = (Segment("walk", {"cadence": pace, "strides": 1.0}) for pace in paces.tolist())
    begin = (Segment("start", {"strides": 1.0}), Segment("walk", {"strides": 6.0}))
    return WalkingCourse("uneven", "Strides of uneven time.", (*begin, *strides), "uneven")


def timed_events(configuration: Scenario, minutes: float) -> dict[str, EventErrors]:
    """Errors of the events of one walk of at most so many minutes; SimulationError where it diverges."""
    course = course_of_walk(configuration)
    longest = lasting(configuration, minutes).duration if course is None else float(course.duration)
    run = plan_walk(replace(configuration, duration=min(longest, 60.0 * minutes), output_interval=1.0e-3))
    outcome = run_batch(batch_of(run))
    rows = row_numbers(run.program.state_rows())
    if outcome.states[rows["result.failure_time"], 0] < NEVER_FAILED or not np.isfinite(outcome.states).all():
        raise SimulationError(f"{configuration.name} diverged; {REMEDY}")
    record = {name: outcome.record[:, row, 0] for name, row in rows.items()}
    interval = run.step * run.record_every
    settled = slice(round(SETTLED / interval), outcome.record.shape[0])
    true = within(true_events(record["walk.contact"]), settled)
    known = within(known_events(record), settled)
    if not known:
        raise ScenarioError(
            f"{configuration.origin.file}: controller.kind '{configuration.control.kind}' knows no events"
        )
    stride_time = walk_of(configuration).gait.stride_time
    return {name: event_errors(true[name], known[name], interval, stride_time) for name in EVENTS}
