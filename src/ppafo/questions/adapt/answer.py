"""What a search of reflexes came to: before and after, each restart, their spread, and wearer files to walk with."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.style import BLUE, COLOURS, GREY, Margins, figure_of_free_panels, house_style, label_lines, mark_kind
from ppafo.model.wearer.reflexes import Gains
from ppafo.questions.adapt.problem import Search
from ppafo.questions.question import Solved
from ppafo.simulation.scenario import plain

if TYPE_CHECKING:
    import matplotlib.figure

Floats = NDArray[np.float64]

FALLS = 10.0
"""Cost of a fall at the very end; one at the very start costs twice as much. A walk costs about 0.1."""

SETTLED, FEWEST = 0.02, 12
"""Share by which the best cost may fall over the last quarter of a search that has settled; its fewest generations."""


@dataclass(frozen=True, slots=True)
class Walked:
    """How a wearer walked from some start speeds [m/s]: metrics by name [SI], each (starts,)."""

    starts: tuple[float, ...]
    metrics: Mapping[str, Floats]

    @property
    def share(self) -> float:
        """Share of the starts from which the wearer walked to the end."""
        return float(np.mean(self.metrics["stays_up"] > 0.5))

    def mean(self, name: str) -> float | None:
        """Mean of a metric over the walks without a fall, None where there is none."""
        values = self.metrics[name][(self.metrics["stays_up"] > 0.5) & np.isfinite(self.metrics[name])]
        return float(values.mean()) if values.size else None


@dataclass(frozen=True, slots=True)
class Restart:
    """One search: its number, the best gains (gains,), the best cost after each generation, and how they walk."""

    number: int
    gains: Floats
    course: tuple[float, ...]
    walked: Walked

    @property
    def is_settled(self) -> bool:
        """True where a walk was found and the last quarter of the generations brought next to nothing."""
        earlier = self.course[(3 * len(self.course)) // 4 - 1] if len(self.course) >= FEWEST else math.inf
        return self.course[-1] < FALLS and earlier - self.course[-1] <= SETTLED * self.course[-1]


@dataclass(frozen=True, slots=True, repr=False)
class Adaptation(Solved):
    """What a search of reflexes found: how the wearer walks with the gains of before, and the restarts in their order.

    ``folder`` is where the answer was written, empty where it was not.
    """

    search: Search
    unadapted: Walked
    restarts: tuple[Restart, ...]
    folder: str = ""

    @property
    def best(self) -> Restart:
        """The restart that walks on from most start speeds; of several the one with the lowest cost."""
        return min(self.restarts, key=lambda restart: (-restart.walked.share, restart.course[-1]))

    def spread(self, name: str) -> tuple[float, float] | None:
        """Mean and standard deviation of a metric over the restarts that walk on from every start, None below two."""
        values = [restart.walked.mean(name) for restart in self.restarts if restart.walked.share == 1.0]
        known = [value for value in values if value is not None]
        return (float(np.mean(known)), float(np.std(known, ddof=1))) if len(known) > 1 else None

    def gains_of(self, gains: Floats) -> tuple[Gains, Gains]:
        """Gains of the left and of the right leg."""
        found = {path: float(value) for value, paths in zip(gains, self.search.groups, strict=True) for path in paths}
        left, right = (
            Gains._make(
                found.get(f"wearer.{side}_{name}", float(self.search.wearer.settings[f"{side}_{name}"]))
                for name in Gains._fields
            )
            for side in ("left", "right")
        )
        return left, right


EFFORT = (
    ("muscle_power", "muscle power"),
    ("metabolic_power_umberger", "metabolic rate (Umberger 2010)"),
    ("metabolic_power_bhargava", "metabolic rate (Bhargava 2004)"),
)
"""Metrics that say how much an effort walking is, and their words."""

_SHOWN = (
    ("walking_speed", "velocity", "Speed"),
    ("muscle_power", "power", "Muscle power"),
    ("metabolic_power_umberger", "power", "Umberger"),
    ("metabolic_power_bhargava", "power", "Bhargava"),
    ("lowest_toes", "length", "Lowest toes"),
    ("gas", "gas mass", "Gas a stride"),
)


def answer_of(found: Adaptation) -> Answer:
    """Return the answer of a search; it has passed where a restart walks on from every start."""
    head = (
        Column("Gains"),
        Column("Walks on", "fraction", ".3g"),
        *(Column(title, quantity) for _, quantity, title in _SHOWN),
        Column("Settled"),
    )
    rows = [_row("before", found.unadapted, "")]
    rows += [
        _row(f"restart {restart.number}", restart.walked, "yes" if restart.is_settled else "no")
        for restart in found.restarts
    ]
    caption = (
        "Left: the best cost so far of each restart. Right: gains found over the gains before, one mark a restart."
    )
    return Answer(
        name="adapt",
        kicker="Adaptation",
        title=f"{found.search.scenario.name}: reflexes that adapt",
        lead=(verdict(found), *remarks(found)),
        sections=(
            Section(
                f"Means over the walks without a fall, from {len(found.unadapted.starts)} start speeds",
                table=Table(head, tuple(rows)),
            ),
            Section("The search", figure=Figure("adapt", caption, lambda: draw(found))),
        ),
        data=_data(found),
        passed=found.best.walked.share == 1.0,
        files={f"wearer-{restart.number}.toml": _file(found, restart) for restart in found.restarts},
    )


def _file(found: Adaptation, restart: Restart) -> Callable[[], bytes]:
    return lambda: wearer_text(found, restart).encode()


def _row(name: str, walked: Walked, settled: str) -> tuple[str | float | None, ...]:
    return (name, walked.share, *(walked.mean(metric) for metric, _, _ in _SHOWN), settled)


def verdict(found: Adaptation) -> str:
    """Return in a sentence how the wearer walks before and after."""
    whole = sum(restart.walked.share == 1.0 for restart in found.restarts)
    before = _walks(found.unadapted)
    if not whole:
        return f"with the gains before the wearer {before}; no restart found gains that walk on from every start speed"
    count = f"{whole} of {len(found.restarts)} restarts"
    after = f"with the best gains found the wearer {_walks(found.best.walked)}"
    return f"with the gains before the wearer {before}; {after} ({count} walk on from every start speed)"


def _walks(walked: Walked) -> str:
    speed = walked.mean("walking_speed")
    if speed is None:
        longest = float(np.nanmax(walked.metrics["walked_time"]))
        return f"falls from every start speed, after {longest:.3g} s at the latest"
    everywhere = "" if walked.share == 1.0 else f" from {100.0 * walked.share:.0f} % of the start speeds"
    return f"walks on{everywhere}, at {speed:.3g} m/s"


def remarks(found: Adaptation) -> list[str]:
    """Return how sure that is: the spread over restarts, and what did not converge."""
    said = []
    spreads = [(words, spread) for name, words in EFFORT if (spread := found.spread(name)) is not None]
    if spreads:
        listed = ", ".join(f"{words} {mean:.4g} +- {deviation:.2g} W" for words, (mean, deviation) in spreads)
        said.append(
            f"over the restarts that walk on: {listed} (standard deviation): a difference between two devices that is "
            "smaller is none"
        )
    unsettled = [str(restart.number) for restart in found.restarts if not restart.is_settled]
    if unsettled:
        said.append(f"restart {', '.join(unsettled)} had not settled: more --generations may find better gains")
    said.append(
        "the wearer is a model: gains were searched for little muscle work at a speed, which no person is known to do; "
        "see docs/how-to/adapt-reflexes.md"
    )
    return said


def wearer_text(found: Adaptation, restart: Restart) -> str:
    """Return the wearer file (TOML) of a restart."""
    left, right = found.gains_of(restart.gains)
    file = found.search.wearer.file
    lines = [
        "schema_version = 1",
        f'name = "{found.search.wearer.name}-{restart.number}"',
        f'title = "{found.search.wearer.name} with reflexes searched for {found.search.speed:.3g} m/s"',
        f'source = "body and reflexes of {found.search.wearer.name}; gains by search"',
        f'start_speed = "{found.search.speed:.6g} m/s"',
        "",
        "[found]",
        'by = "search"',
        f'start = "{found.search.wearer.name}"',
        f"seed = {found.search.seed}",
        f"restart = {restart.number}",
        f"generations = {found.search.generations}",
        f"population = {found.search.population}",
        f'target_speed = "{found.search.speed:.6g} m/s"',
        'objective = "no fall, the speed, little muscle work over weight and way"',
        "",
        "[gains]",
        *(f"{name} = {value!r}" for name, value in left._asdict().items()),
    ]
    other = [f"{name} = {value!r}" for name, value in right._asdict().items() if value != getattr(left, name)]
    lines += _leg_text("left", file.left_quickness, file.left_ankle_stiffness, file.left_strengths)
    lines += _leg_text("right", file.right_quickness, file.right_ankle_stiffness, file.right_strengths)
    return "\n".join([*lines, *(["", "[right.gains]", *other] if other else []), ""])


def _leg_text(side: str, quickness: float, stiffness: float, strengths: Mapping[str, float]) -> list[str]:
    """In what a leg differs from the published body: who is found is as weak as who was searched with."""
    own = [f"quickness = {quickness!r}"] if quickness != 1.0 else []
    own += [f'ankle_stiffness = "{stiffness!r} N m/rad"'] if stiffness else []
    weak = [f"{name} = {value!r}" for name, value in strengths.items()]
    return [*(["", f"[{side}]", *own] if own else []), *(["", f"[{side}.strength]", *weak] if weak else [])]


def draw(found: Adaptation) -> "matplotlib.figure.Figure":
    """Return the cost over the generations, and how the gains changed; a gain that was 0 has no ratio and no row."""
    from matplotlib.ticker import MaxNLocator

    names = [paths[0].removeprefix("wearer.") for paths in found.search.groups]
    names = [name.removeprefix("left_") if found.search.adapts != "apart" else name for name in names]
    had = found.search.before != 0.0
    names = [name.replace("_", " ").capitalize() for name, drawn in zip(names, had, strict=True) if drawn]
    rows = np.arange(len(names))[::-1]
    margins = Margins(left=0.75, right=0.3, top=0.55, bottom=0.55, row_gap=0.0, column_gap=2.2)
    height = margins.top + margins.bottom + max(3.0, 0.17 * len(names))
    with house_style():
        figure, ((course, changes),) = figure_of_free_panels((8.8, height), margins, 1, 2)
        for restart in found.restarts:
            colour = COLOURS[(restart.number - 1) % len(COLOURS)]
            course.plot(np.arange(1, len(restart.course) + 1), restart.course, color=colour, linewidth=1.3)
            changes.plot(
                restart.gains[had] / found.search.before[had],
                rows,
                "|",
                color=colour,
                markersize=8,
                markeredgewidth=1.6,
                label=f"restart {restart.number}",
            )
        course.axhline(FALLS, color=GREY, linestyle="--", linewidth=1.0)
        course.text(0.98, FALLS * 1.06, "above: falls", transform=course.get_yaxis_transform(), ha="right", color=GREY)
        course.set_yscale("log")
        course.xaxis.set_major_locator(MaxNLocator(integer=True))
        course.set_xlabel("Generation")
        course.set_ylabel("Best cost so far")
        changes.axvline(1.0, color=BLUE, linewidth=0.8, alpha=0.5)
        changes.set_yticks(rows, names, fontsize=7)
        changes.set_ylim(-0.7, len(names) - 0.3)
        changes.set_xlabel("Gain over the gain before")
        label_lines(changes)
        mark_kind(figure, "simulated")
        return figure


def _data(found: Adaptation) -> dict[str, Any]:
    def walked(item: Walked) -> dict[str, Any]:
        return {
            "start_speeds": list(item.starts),
            "share": item.share,
            "means": {name: item.mean(name) for name in item.metrics},
            "metrics": {name: plain(values.tolist()) for name, values in item.metrics.items()},
        }

    return {
        "walk": found.search.scenario.name,
        "wearer": found.search.wearer.name,
        "gains": found.search.adapts,
        "speed": found.search.speed,
        "generations": found.search.generations,
        "population": found.search.population,
        "seed": found.search.seed,
        "before": walked(found.unadapted),
        "restarts": [
            {
                "number": restart.number,
                "cost": restart.course[-1],
                "settled": restart.is_settled,
                "left_gains": found.gains_of(restart.gains)[0]._asdict(),
                "right_gains": found.gains_of(restart.gains)[1]._asdict(),
                **walked(restart.walked),
            }
            for restart in found.restarts
        ],
        "best": found.best.number,
        **({"folder": found.folder} if found.folder else {}),
    }
