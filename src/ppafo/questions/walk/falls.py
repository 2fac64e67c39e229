"""Who falls when something fails: the faults of a walk, on a wearer who reacts, by falls.

Every fault of the plant, and faults of each sensor, begin at some instants of a stride, at two start speeds. Each is
walked with the limits of the controller's checks as wide as they go, with those of the walk, and with a shut-off valve
as well. A safe state vents the device: who cannot walk without it falls in the safe state too. Of two devices the left
one fails, and what both share fails for both.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ppafo.answers import Answer, Column, Section, Table
from ppafo.control.walking.signs import SAFETY_QUANTITIES
from ppafo.errors import SimulationError
from ppafo.model.plant_faults import SHUT_OFF
from ppafo.progress import Progress, Report
from ppafo.questions.question import Solved
from ppafo.questions.walk.risks import SAYS, Cause, causes_of, failing
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.scenario import Scenario
from ppafo.walking.motion import walk_of, with_duration
from ppafo.walking.reacting_wearer import START_SPEED
from ppafo.walking.walk import with_device_off

FIRST, AFTER = 4.0, 8.0
"""Time [s] at which the first fault begins, and how long is walked on after the last one begins."""

INSTANTS = (0.0, 0.25, 0.5, 0.75)
"""Instants [s] after it: a stride takes about a second."""

SPEEDS = (0.95, 1.05)
"""Start speeds, over that of the walk."""

AREA = 1.0e-5
"""Area [m^2] of the shut-off valve, where the walk has none."""

WITHOUT, WITH, SHUT = "with wide limits", "as it is", "with a shut-off valve"

_WIDEST = {
    name: (item.minimum if name.startswith(("lowest", "shortest")) else item.maximum)
    for item in SAFETY_QUANTITIES
    if not (name := item.name).startswith(("nominal", "filled", "resume", "flat"))
}
"""Limits of the checks that no reading passes: the widest that each setting may have.

When in the stride a foot must stand flat has no widest: that heel and toes are loaded then is still checked.
"""


@dataclass(frozen=True, slots=True)
class Fall:
    """How many of the walks fall, by what the walk has against it, and the shortest time [s] from fault to fall."""

    cause: str
    part: str
    kind: str
    falls: Mapping[str, int]
    soonest: Mapping[str, float | None]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Falls(Solved):
    """The faults of a walk by falls; ``walks`` of each, and how many fall without a fault, and with the device off."""

    scenario: Scenario
    walks: int
    sound: int
    vented: int
    falls: tuple[Fall, ...]


def falls_of_walk(configuration: Scenario, report: Report) -> Falls:
    """Who falls with each fault of a walk whose wearer reacts; ``report`` is told how many faults are done."""
    motion = walk_of(configuration)
    level = with_duration(replace(configuration, motion=replace(motion, bottle=None)), FIRST + INSTANTS[-1] + AFTER)
    walks = {WITHOUT: _without_checks(level), WITH: level}
    if not motion.shut_off:
        fitted = {item.name: item.default or 0.0 for item in SHUT_OFF} | {"area": AREA}
        walks[SHUT] = replace(level, motion=replace(walk_of(level), shut_off=fitted))
    causes = tuple(causes_of(level))
    found = []
    for number, cause in enumerate(causes):
        report(Progress("walking", number, len(causes), noun="faults"))
        times = {words: _fall_times(failing(walk, cause, FIRST), cause) for words, walk in walks.items()}
        begins = np.tile(FIRST + np.array(INSTANTS), len(SPEEDS))
        after = {words: (own - begins)[np.isfinite(own)] for words, own in times.items()}
        found.append(
            Fall(
                cause.words,
                cause.part,
                cause.kind,
                {words: own.size for words, own in after.items()},
                {words: float(own.min()) if own.size else None for words, own in after.items()},
            )
        )
    report(Progress("walking", len(causes), len(causes), noun="faults"))
    sound, vented = (int(np.isfinite(_fall_times(walk, None)).sum()) for walk in (level, with_device_off(level)))
    return Falls(level, len(INSTANTS) * len(SPEEDS), sound, vented, tuple(found))


def _without_checks(configuration: Scenario) -> Scenario:
    """The walk whose controller finds nothing wrong."""
    control = configuration.control
    wide = {name: value for name, value in _WIDEST.items() if name in control.settings}
    return replace(configuration, control=replace(control, settings={**control.settings, **wide}))


def _fall_times(configuration: Scenario, cause: Cause | None) -> Any:
    """Times of the falls [s], nan where a walk ends on its feet, (speeds x instants,)."""
    wearer = walk_of(configuration).reacts
    assert wearer is not None, "of a wearer who reacts"
    speeds = float(wearer.settings[START_SPEED.name]) * np.repeat(SPEEDS, len(INSTANTS))
    columns = {f"wearer.{START_SPEED.name}": speeds}
    if cause is not None:
        columns[f"faults.{cause.part}.time"] = np.tile(FIRST + np.array(INSTANTS), len(SPEEDS))
    outcome = run_ensemble(configuration, columns, ["stays_up", "fall_time"])
    found = outcome.metrics
    if outcome.reasons:
        raise SimulationError(f"{configuration.name}: {next(iter(outcome.reasons.values()))}")
    return np.where(found["stays_up"] > 0.5, np.nan, found["fall_time"])


def answer_of(solved: Falls) -> Answer:
    """The table as an answer."""
    columns = tuple(solved.falls[0].falls)
    rows = tuple(
        (
            item.cause,
            *(f"{item.falls[words]}" for words in columns),
            *("-" if item.soonest[words] is None else f"{item.soonest[words]:.1f}" for words in columns),
        )
        for item in solved.falls
    )
    head = (
        Column("Cause"),
        *(Column(f"Falls {words}") for words in columns),
        *(Column(f"Soonest {words} (s)") for words in columns),
    )
    name, wearer = solved.scenario.name, walk_of(solved.scenario).reacts
    assert wearer is not None, "of a wearer who reacts"
    totals = {words: sum(item.falls[words] for item in solved.falls) for words in columns}
    worse = [item.cause for item in solved.falls if item.falls[WITH] > item.falls[WITHOUT]]
    better = [item.cause for item in solved.falls if item.falls[WITH] < item.falls[WITHOUT]]
    all_walks = solved.walks * len(rows)
    remarks = (
        f"without a fault {solved.sound} of {solved.walks} fall, with the device off (vented) {solved.vented}",
        *(f"{words}: {totals[words]} of {all_walks} walks fall" for words in columns),
        "with wide limits the controller still vents where a pressure does not follow its valve, or a flat foot shows "
        "no load: those checks have no limit that could be wider",
        f"against wide limits the walk as it is has fewer falls for {len(better)} causes, more for {len(worse)}"
        + (f": {', '.join(worse)}" if worse else ""),
    )
    return Answer(
        name="risks",
        kicker="Who falls when something fails",
        title=f"Falls of {name}, {wearer.name}",
        lead=(
            f"{name}: {len(rows)} causes, each at {len(INSTANTS)} instants of a stride and {len(SPEEDS)} start speeds",
            SAYS,
        ),
        sections=(Section(table=Table(head, rows, left=1), remarks=remarks),),
        data={
            "format": "ppafo falls",
            "schema_version": 1,
            "says": SAYS,
            "simulated": True,
            "walk": name,
            "wearer": wearer.name,
            "walks_of_each": solved.walks,
            "falls_without_fault": solved.sound,
            "falls_vented": solved.vented,
            "causes": [
                {
                    "cause": item.cause,
                    "part": item.part,
                    "kind": item.kind,
                    "falls": dict(item.falls),
                    "soonest": dict(item.soonest),
                }
                for item in solved.falls
            ],
        },
        command="walk --risks",
    )
