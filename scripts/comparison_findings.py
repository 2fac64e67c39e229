"""Writes docs/what-the-comparison-shows.md with every number in it, and its figure.

    python scripts/comparison_findings.py [--check] [--only SECTION]

The text is scripts/what-the-comparison-shows.md.jinja; its numbers are computed here. ``--check`` writes nothing and
prints the lines of the page that would change; ``--only`` confines it to sections whose title begins so. Needs
the extra ``optimal`` for the bound of the proportional valve; a whole run takes some ten minutes.
"""

import argparse
import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, StrictUndefined, meta

from ppafo.answers.style import (
    ACTUAL,
    BLACK,
    GREY,
    Margins,
    figure_of_free_panels,
    house_style,
    mark_kind,
)
from ppafo.answers.style import (
    PROPORTIONAL as PROPORTIONAL_LOOK,
)
from ppafo.answers.style import (
    SOLENOID as SOLENOID_LOOK,
)
from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.parameters import load_device
from ppafo.parameters.publications.publication import paper_entries
from ppafo.questions.endurance.solve import endurance_of_walk
from ppafo.questions.league.bound import lower_bound
from ppafo.questions.league.sampled_bound import sampled_bound
from ppafo.questions.league.standing import ENTRANTS
from ppafo.questions.reproduce.open_range import SEARCHED, improved_by_weight
from ppafo.questions.reproduce.solve import COMPLETIONS
from ppafo.questions.reproduce.torque_task import FASTER
from ppafo.questions.unreported.answer import (
    Family,
    conclusion_rows,
    conclusions,
    implications_of,
    posterior_text,
    weighted_quantiles,
    within_reach,
)
from ppafo.questions.unreported.settings import (
    ATTITUDE,
    DEAD_VOLUME,
    DISCHARGE,
    EVIDENCE,
    FALL,
    IMPROVEMENT,
    METRICS,
    OBSERVABLES,
    ON_OFF_RATE,
    PLATEAU,
    PROPORTIONAL,
    QUIET,
    RISE,
    SOLENOID,
    STEP,
    TEXT_OF_STEP,
    VOLTS,
    VOLUME,
    Floats,
    agreement_with,
    demand_over_ceiling,
    effective,
    improvement,
)
from ppafo.questions.unreported.solve import infer_settings, step_metrics
from ppafo.running import simulate
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.walking import load_walk
from ppafo.walking.walk import compare_walks

ROOT = Path(__file__).parents[1]
TEMPLATE = Path(__file__).parent / "what-the-comparison-shows.md.jinja"
PAGE, FIGURE = ROOT / "docs" / "what-the-comparison-shows.md", ROOT / "docs" / "images" / "comparison.png"
MARGINS = Margins(left=0.65, right=0.15, top=0.62, bottom=0.55, row_gap=0.0, column_gap=0.75)
"""The top has a line for what kind of figure it is, above the titles."""
SHOWN_ATTITUDES = np.array([-90.0, 0.0, 90.0])
"""Of the shank in figure 7 [deg]: lying either way, and upright."""
SETS = ("ppafo2011", "ppafo2011-consistent", "ppafo2011-fitted")
WALKED = {
    **{f"`{name}`": (f"device.set={name}",) for name in SETS},
    "`ppafo2011-consistent`, short lines": (
        "device.set=ppafo2011-consistent",
        "actuator.dead_volume_1=2 cm^3",
        "actuator.dead_volume_2=2 cm^3",
    ),
}
"""Chambers that are walked with, and the overrides of each."""
BY_NAME = {entrant.name: entrant for entrant in ENTRANTS}
LAWS = {
    "on_off": "the paper's rule, equation (14)",
    "on_off_dead_zone-solenoid": "the rule with a dead zone",
    "pid-paper": "PID, printed gains",
    "pid-tuned": "PID, tuned gains",
    "feedback_linearisation": "feedback linearisation",
}
CHOICES = {"A or B": (1.0, -1.0), "A, B or neither": (1.0, 0.0, -1.0)}
"""Commands that the solenoid pair may choose from: those of equation (14), and all that its two coils allow."""
TITLES = {
    "torque_rms_improvement": "RMS error less by",
    "co2_solenoid": "CO2, solenoid pair",
    "co2_proportional": "CO2, proportional valve",
    "co2_saving": "CO2 saved",
}
FAST = "on/off at 100 Hz"
CHANGES: dict[str, tuple[str, ...]] = {
    "as completed": (),
    **{f"level {level:g} N m": (f"reference.level={level} N m",) for level in (4, 5, 5.5, 5.85, 6.15, 6.5, 7)},
    **{
        f"supply {pressure} psi_g": (
            f"supply.pressure={pressure} psi_g",
            f"supply.dorsiflexion_pressure={pressure} psi_g",
        )
        for pressure in (45, 49, 51, 55)
    },
    **{f"hold {time:g} s": (f"run.duration={1.0 + time} s",) for time in (0.5, 4.0)},
    "dead volume 10 cm^3": ("actuator.dead_volume_1=10 cm^3", "actuator.dead_volume_2=10 cm^3"),
    "ramp 0.5 s": ("reference.ramp_time=0.5 s",),
}
"""One thing changed at a time."""


HELD, NEAR = ("level 4 N m", "level 5 N m"), ("level 5.85 N m", "level 6.15 N m", "supply 49 psi_g", "supply 51 psi_g")
"""Changes within what the supply holds, and those about the printed improvement."""
Row = Sequence[object]


def table(head: Row, rows: Iterable[Row]) -> str:
    """Return a table in Markdown, the first column aligned left and the others right."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)


def changes() -> dict[str, Any]:
    """Return by how much RMS error and gas are less [%] with one thing changed."""
    better, saved = {}, {}
    for name, overrides in (*CHANGES.items(), (FAST, ())):
        faster = FASTER if name == FAST else ()
        pair = simulate(load_scenario("torque-task-solenoid", [*overrides, *faster])).metrics
        spool = simulate(load_scenario("torque-task-proportional", list(overrides))).metrics
        better[name], saved[name] = (
            100.0 * (1.0 - spool[key].value / pair[key].value) for key in ("rms_error", "gas_supplied")
        )
    device = load_scenario("torque-task-solenoid").device
    return {
        "table": table(
            ("Changed", "RMS error less by (%)", "CO2 less by (%)"),
            [(name, f"{better[name]:.1f}", f"{saved[name]:.1f}") for name in better],
        ),
        "better": better,
        "held": [better[name] for name in HELD],
        "near": [better[name] for name in NEAR],
        "ceiling": device.actuator.torque_constant * (device.supply.pressure - device.supply.atmospheric_pressure),
    }


def law_and_valve(level: float) -> dict[str, Any]:
    """Return RMS errors [N m] of laws, and of bounds of both valves, at a level [N m]."""
    words = [f"reference.level={level} N m"]

    def played(name: str) -> tuple[float, float]:
        metrics = simulate(load_scenario("torque-task-proportional", [*BY_NAME[name].overrides, *words])).metrics
        return metrics["rms_error"].value, GRAMS_PER_KILOGRAM * metrics["gas_supplied"].value

    found = {name: played(name) for name in LAWS}
    pair = load_scenario("torque-task-solenoid", words)
    best = {name: sampled_bound(pair, commands) for name, commands in CHOICES.items()}
    error, gas = found["pid-paper"]
    spool = lower_bound(load_scenario("torque-task-proportional", words), [error])
    # An error that counts as none is no bound.
    least = 0.0 if spool.is_attainable else spool.least_error.rms_error
    rows: list[tuple[str, ...]] = [
        (f"{BY_NAME[name].valve}: {LAWS[name]}", f"{error:.4f}", f"{gas:.3f}", "")
        for name, (error, gas) in found.items()
    ]
    rows += [
        (f"solenoid: best decisions at 20 Hz, {name}", f"{bound.found:.4f}", "", f"{bound.certified:.4f}")
        for name, bound in best.items()
    ]
    rows.append(("proportional: any control, task known", "", "", f"{least:.4f}" if least else "0"))
    rows.sort(key=lambda row: not row[0].startswith("solenoid"))
    return {
        "table": table(("Valve and control", "RMS error (N m)", "CO2 (g)", "None below (N m)"), rows),
        "error": {name: of for name, (of, _) in found.items()},
        "best": {name: bound.found for name, bound in best.items()},
        "certified": {name: bound.certified for name, bound in best.items()},
        "least": least,
        "times": error / (least or spool.unmeasurable),
        "more_gas": 100.0 * (gas / (GRAMS_PER_KILOGRAM * spool.gas_at(error)) - 1.0),
    }


def volumes(per_angle: Floats, dead: Floats) -> dict[str, Floats]:
    """Columns of an ensemble with volumes per angle [m^3/rad] and dead volumes [m^3]."""
    return {
        "actuator.volume_per_angle": per_angle,
        "actuator.dead_volume_1": dead,
        "actuator.dead_volume_2": dead,
    }


def text_of_figure_7() -> dict[str, Any]:
    """Return what each shipped set gives of the text of figure 7, with the shank lying either way and upright."""
    rows, rises, falls = [], {}, {}
    for name in SETS:
        actuator = load_device(name).actuator
        chambers = volumes(*(np.full(3, getattr(actuator, item)) for item in ("volume_per_angle", "dead_volume_1")))
        found = step_metrics(chambers | {"motion.shank.level": np.radians(SHOWN_ATTITUDES)})
        size = f"{1e6 * actuator.volume_per_angle:.3g}", f"{1e6 * actuator.dead_volume_1:.3g}"
        for place, degrees in enumerate(SHOWN_ATTITUDES):
            waits, fall, rise = (found[key][place] for key in (PLATEAU, FALL, RISE))
            rows.append((f"`{name}`", *size, f"{degrees:.0f}", f"{waits:.0f}", f"{fall:.1f}", f"{rise:.1f}"))
        rises[name], falls[name] = found[RISE], found[FALL]
    head = (
        "Set",
        "Swept (cm^3/rad)",
        "Dead (cm^3)",
        "Shank (deg)",
        "P1 at the supply before breakaway (ms)",
        "P1 falls by (psi)",
        "P2 rises by (psi)",
    )
    return {"table": table(head, rows), "rises": rises["ppafo2011"], "falls": falls["ppafo2011-consistent"]}


def best_volumes() -> dict[str, Any]:
    """Return the volumes that agree best with torque task and text, the attitude of the leg averaged over its prior.

    Each as best, lowest and highest within the 95 % likelihood interval; and the best single attitude with its volumes.
    """
    per_angle, dead = (
        part.ravel() for part in np.meshgrid(np.arange(14.5, 51.1, 0.5), np.arange(0.5, 40.1, 0.5), indexing="ij")
    )
    chambers = volumes(1.0e-6 * per_angle, 1.0e-6 * dead)
    metrics = {
        valve: run_ensemble(load_scenario(f"torque-task-{valve}"), chambers, METRICS).metrics
        for valve in (SOLENOID, PROPORTIONAL)
    }
    of_task = agreement_with([entry.id for entry in EVIDENCE if entry.id not in TEXT_OF_STEP], metrics)
    kept = np.flatnonzero(of_task > np.exp(-8.0) * of_task.max())
    attitudes, centres = (part.ravel() for part in np.meshgrid(np.arange(-90.0, 90.1, 15.0), np.linspace(4.5, 13.5, 5)))
    varied = {path: np.repeat(values[kept], attitudes.size) for path, values in chambers.items()}
    varied["motion.shank.level"] = np.tile(np.radians(attitudes), kept.size)
    varied["motion.foot_mass_centre"] = np.tile(0.01 * centres, kept.size)
    of_text = agreement_with(TEXT_OF_STEP, {STEP: step_metrics(varied)}).reshape(kept.size, attitudes.size)
    both = of_task[kept] * of_text.mean(axis=1)
    best, near = int(np.argmax(both)), both > np.exp(-1.92) * both.max()
    row, column = np.unravel_index(int(np.argmax(of_task[kept][:, None] * of_text)), of_text.shape)
    found = {"per_angle": per_angle[kept], "dead": dead[kept]}
    return {
        **{name: (values[best], values[near].min(), values[near].max()) for name, values in found.items()},
        "of_one": (attitudes[column], per_angle[kept][row], dead[kept][row]),
    }


def what_is_open(family: Family) -> dict[str, Any]:
    """Return what the evidence leaves of volumes, readings, conclusions and of the four printed numbers."""
    settings = []
    for name, unit in ((VOLUME, "cm^3/rad"), (DEAD_VOLUME, "cm^3"), (ATTITUDE, "deg")):
        low, median, high = weighted_quantiles(family.draws[name], family.weights, (0.05, 0.5, 0.95))
        settings.append((f"{name} ({unit})", f"{median:.3g}", f"{low:.3g} to {high:.3g}"))
    rest = []
    for entry in EVIDENCE:
        if entry.published is not None:
            weights = family.weights_without((entry.id, *entry.same_data))
            low, high = weighted_quantiles(OBSERVABLES[entry.observable](family.metrics), weights, (0.05, 0.95))
            left = f"{low:.3g} to {high:.3g}", f"{effective(weights):.0f}"
            rest.append((f"{TITLES[entry.id]} ({entry.unit})", f"{entry.published:g}", *left))
    rows = [
        (f"{reading}: {says.rstrip('.')}", of_all, left.partition(" (")[0])
        for reading, says, of_all, left in conclusion_rows(conclusions(family))
    ]
    return {
        "drawn": family.drawn,
        "effective": family.effective,
        "settings": table(("Setting", "Median", "5 to 95 %"), settings),
        "readings": posterior_text(next(item for item in implications_of(family) if item.setting.name == VOLTS)),
        "conclusions": table(("Reading and statement", "Of all completions", "By the other evidence"), rows),
        "rest": table(("Number", "Published", "5 to 95 % by the rest", "Effective sample size"), rest),
        "reach": within_reach(family),
    }


def improved_control(family: Family) -> dict[str, Any]:
    """Return how the best decisions at 20 Hz compare with the proportional valve, in completions drawn by weight."""
    rows, below, different = [], {}, 0
    for name, commands in CHOICES.items():
        values, times = improved_by_weight(family, commands)
        low, median, high = weighted_quantiles(values, times, (0.05, 0.5, 0.95))
        below[name], different = 100.0 * times[values < 0.0].sum() / times.sum(), values.size
        rows.append((name, f"{median:.1f}", f"{low:.1f} to {high:.1f}", f"{below[name]:.0f}"))
    head = "The pair chooses", "Median (%)", "5 to 95 % (%)", "Below the proportional valve in (%)"
    return {
        "table": table(head, rows),
        "drawn": SEARCHED,
        "different": different,
        "below": list(below.values()),
    }


def for_a_builder() -> dict[str, Any]:
    """Return what the device does on a walking leg, for each reading of its chambers."""
    rows, numbers = [], []
    for name, overrides in WALKED.items():
        compared = compare_walks(load_walk("solenoid", overrides), 0.3)
        worn = compared.with_device
        peak, share = float(worn.averages["torque"].mean.max()), 100.0 * worn.metrics["push_off_share"].value
        life = endurance_of_walk(worn)
        assert life is not None, "the walk takes gas"
        minutes = life.discharge.walking_time / 60.0
        falls, bare = (np.degrees(of.metrics["slap_rate"].value) for of in (worn, compared.without_device))
        gas = GRAMS_PER_KILOGRAM * worn.metrics["gas"].value
        shown = (f"{value:.1f}" for value in (peak, share, minutes))
        rows.append((name, *shown, f"{gas:.3f}", f"{falls:.0f}", f"{bare:.0f}"))
        numbers.append((peak, share, minutes))
    head = (
        "Chambers",
        "Peak torque (N m)",
        "Push-off, of a healthy ankle's work (%)",
        "Bottle of 255 g (min)",
        "CO2 a stride (g)",
        "Foot comes down (deg/s)",
        "... without the device (deg/s)",
    )
    ranges = [f"{min(part):.1f} to {max(part):.1f}" for part in zip(*numbers, strict=True)]
    return {"table": table(head, rows), "peak": ranges[0], "share": ranges[1], "minutes": ranges[2]}


@cache
def family() -> Family:
    """Return what the evidence leaves, found once and only for a section that needs it."""
    return infer_settings(COMPLETIONS)


FINDINGS: dict[str, Callable[[], dict[str, Any]]] = {
    "changes": changes,
    "high": lambda: law_and_valve(6.0),
    "low": lambda: law_and_valve(4.0),
    "control": lambda: improved_control(family()),
    "text": text_of_figure_7,
    "volumes": best_volumes,
    "open": lambda: what_is_open(family()),
    "walks": for_a_builder,
}
"""What computes the numbers that the text names, by the first part of their name there."""


def sections(text: str) -> dict[str, str]:
    """Return the sections of a page or of its template by title; what is above the first has the title of the page."""
    parts = re.split(r"^(?=##? )", text, flags=re.MULTILINE)
    return {part.partition("\n")[0].lstrip("# "): part for part in parts if part}


def written(part: str, findings: Mapping[str, Callable[[], dict[str, Any]]]) -> str:
    """Return a section with its numbers; only what it names is computed."""
    environment = Environment(undefined=StrictUndefined, keep_trailing_newline=True, autoescape=False)
    names = sorted(meta.find_undeclared_variables(environment.parse(part)))
    return environment.from_string(part).render({name: findings[name]() for name in names})


def draw(found: Family, levels: Mapping[float, dict[str, Any]], file: Path) -> None:
    """Draw where the improvement comes from, what law and valve cost, and which volumes the evidence leaves."""
    draws = {name: values[: found.even] for name, values in found.draws.items()}
    quiet = agreement_with(QUIET, found.metrics)[: found.even] > 0.0
    chosen = quiet & (draws[VOLTS] == 1.0) & (draws[DISCHARGE] == 0.0) & (draws[ON_OFF_RATE] == 20.0)
    demand, gain = demand_over_ceiling(draws)[chosen], improvement(found.metrics)[: found.even][chosen]
    entry = paper_entries()[IMPROVEMENT]
    printed, deviation = entry.published or 0.0, entry.deviation or 0.0
    with house_style():
        figure, [[left, middle, right]] = figure_of_free_panels((13.0, 4.1), MARGINS, 1, 3)
        left.axhspan(printed - deviation, printed + deviation, color=BLACK, alpha=0.2, linewidth=0.0)
        left.axvline(1.0, color=GREY, linewidth=0.9, linestyle=(0, (1, 2)))
        left.plot(demand, gain, ".", color=ACTUAL.colour, markersize=3.0)
        left.set(ylim=(-60.0, 100.0), xlabel="Demand over what the supply holds", ylabel="RMS error less (%)")
        left.set_title("A   Where the printed 15 % (band) comes from")
        places = {level: place for place, level in enumerate(levels)}
        for level, of in levels.items():
            for name, error in of["error"].items():
                look, side = (SOLENOID_LOOK, -0.12) if BY_NAME[name].valve == "solenoid" else (PROPORTIONAL_LOOK, 0.12)
                is_paper = name in ("on_off", "pid-paper")
                middle.plot(
                    places[level] + side,
                    error,
                    look.marker,
                    color=look.colour,
                    markersize=6.0,
                    markerfacecolor=look.colour if is_paper else "white",
                )
            bounds = [(-0.12, SOLENOID_LOOK, error) for error in of["certified"].values()]
            for side, look, error in (*bounds, (0.12, PROPORTIONAL_LOOK, of["least"])):
                middle.plot([places[level] + side - 0.1, places[level] + side + 0.1], [error] * 2, color=look.colour)
        middle.set_xticks(list(places.values()), [f"{level:g} N m" for level in places])
        middle.set(xlim=(-0.5, len(places) - 0.5), ylim=(-0.05, 1.3), ylabel="RMS error (N m)")
        middle.grid(False, axis="x")
        middle.set_title("B   Laws (markers) and lower bounds (bars)")
        handles = [
            *middle.plot([], [], SOLENOID_LOOK.marker, color=SOLENOID_LOOK.colour, label="solenoid pair"),
            *middle.plot([], [], PROPORTIONAL_LOOK.marker, color=PROPORTIONAL_LOOK.colour, label="proportional valve"),
        ]
        middle.legend(handles=handles, loc="upper center")
        weights = found.weights / found.weights.max()
        kept = weights > 1.0e-3
        right.scatter(
            found.draws[VOLUME][kept],
            found.draws[DEAD_VOLUME][kept],
            s=25.0 * weights[kept],
            color=ACTUAL.colour,
            alpha=0.5,
        )
        for name, marker in zip(SETS, "sDo", strict=True):
            actuator = load_device(name).actuator
            at = 1.0e6 * actuator.volume_per_angle, 1.0e6 * actuator.dead_volume_1
            right.plot(*at, marker, color=BLACK, markersize=7.0, linestyle="none", label=name)
        right.set(xlabel="Volume per angle (cm$^3$/rad)", ylabel="Dead volume (cm$^3$)")
        right.set_title("C   Chamber volumes that the evidence leaves")
        right.legend(loc="center right")
        mark_kind(figure, "simulated")
        figure.savefig(file, dpi=90)


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the page and its figure, or say which lines of the page are others; 1 where any is."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 where the page would change")
    parser.add_argument("--only", default="", help="beginning of the title of the only section to compute")
    chosen = parser.parse_args(arguments)
    template = sections(TEMPLATE.read_text(encoding="utf-8"))
    page = sections(PAGE.read_text(encoding="utf-8"))
    wanted = [title for title in template if title.startswith(chosen.only)]
    if not wanted:
        parser.error(f"--only {chosen.only}: no section begins so; there are {', '.join(template)}")
    findings = {name: cache(find) for name, find in FINDINGS.items()}
    differ = False
    for title in wanted:
        new, old = written(template[title], findings), page.get(title, "")
        differ |= new != old
        for line in new.splitlines():
            if line not in old.splitlines():
                print(f"{title}: {line}", flush=True)
        page[title] = new
    if not chosen.check:
        PAGE.write_text("".join(page.get(title, "") for title in template), encoding="utf-8")
        if not chosen.only:
            draw(family(), {4.0: findings["low"](), 6.0: findings["high"]()}, FIGURE)
    return int(chosen.check and differ)


if __name__ == "__main__":
    sys.exit(main())
