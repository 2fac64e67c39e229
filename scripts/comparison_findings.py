"""Every number of docs/what-the-comparison-shows.md, and its figure.

    python scripts/comparison_findings.py [--draws 40960] [--only SECTION] [--figure docs/images/comparison.png]

Needs the extra ``optimal`` for the bound of the proportional valve, and takes some minutes.
"""

import argparse
from collections.abc import Callable, Iterator, Sequence
from functools import cache

import numpy as np

from ppafo.answers.style import BLUE, GREY, VERMILION, Margins, figure_of_free_panels, house_style, mark_kind
from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.parameters import load_device
from ppafo.parameters.publications.publication import paper_entries
from ppafo.questions.league.bound import lower_bound
from ppafo.questions.league.sampled_bound import best_decisions, sampled_bound
from ppafo.questions.league.standing import ENTRANTS
from ppafo.questions.reproduce.torque_task import FASTER
from ppafo.questions.unreported.answer import (
    Family,
    conclusion_rows,
    conclusions,
    implications_of,
    posterior_text,
    reach_sentence,
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
    columns,
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

MARGINS = Margins(left=0.65, right=0.15, top=0.62, bottom=0.55, row_gap=0.0, column_gap=0.75)
"""The top has a line for what kind of figure it is, above the titles."""
SHOWN_ATTITUDES = np.array([-90.0, 0.0, 90.0])
"""Of the shank in figure 7 [deg]: lying either way, and upright."""
SETS = ("ppafo2011", "ppafo2011-consistent", "ppafo2011-fitted")
BY_NAME = {entrant.name: entrant for entrant in ENTRANTS}
CHOICES = {"A or B": (1.0, -1.0), "A, B or neither": (1.0, 0.0, -1.0)}
"""Commands that the solenoid pair may choose from: those of equation (14), and all that its two coils allow."""
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


def where_it_comes_from() -> Iterator[str]:
    """Yield the improvement of the RMS error and the gas saved, with one thing changed."""
    for name, overrides in (*CHANGES.items(), ("on/off at 100 Hz", ())):
        faster = FASTER if name.startswith("on/off") else ()
        pair = simulate(load_scenario("torque-task-solenoid", [*overrides, *faster])).metrics
        spool = simulate(load_scenario("torque-task-proportional", list(overrides))).metrics
        better, saved = (100.0 * (1.0 - spool[key].value / pair[key].value) for key in ("rms_error", "gas_supplied"))
        yield f"{name:22} error {better:6.1f} % less, gas {saved:5.1f} % less"


def law_and_valve(level: float) -> Iterator[str]:
    """Yield the RMS error of laws and of bounds of both valves at a level [N m]."""
    words = [f"reference.level={level} N m"]

    def played(name: str) -> tuple[float, float]:
        entrant = BY_NAME[name]
        metrics = simulate(load_scenario("torque-task-proportional", [*entrant.overrides, *words])).metrics
        return metrics["rms_error"].value, GRAMS_PER_KILOGRAM * metrics["gas_supplied"].value

    for name in ("on_off", "on_off_dead_zone-solenoid", "pid-paper", "pid-tuned", "feedback_linearisation"):
        error, gas = played(name)
        yield f"{level:g} N m  {BY_NAME[name].valve:12} {name:26} {error:.4f} N m  {gas:.3f} g"
    pair = load_scenario("torque-task-solenoid", words)
    for name, commands in CHOICES.items():
        bound = sampled_bound(pair, commands)
        found = f"{bound.found:.4f} N m, none below {bound.certified:.4f}"
        yield f"{level:g} N m  solenoid     best decisions, {name:16} {found}"
    error, gas = played("pid-paper")
    spool = lower_bound(load_scenario("torque-task-proportional", words), [error])
    least, least_gas = spool.least_error.rms_error, GRAMS_PER_KILOGRAM * spool.gas_at(error)
    yield f"{level:g} N m  proportional any control foreseen           {least:.4f} N m"
    more = 100.0 * (gas / least_gas - 1.0)
    yield f"{level:g} N m  pid-paper: {error / least:.3g} times that error, {more:.1f} % more gas than its error needs"


def volumes(per_angle: Floats, dead: Floats) -> dict[str, Floats]:
    """Columns of an ensemble with volumes per angle [m^3/rad] and dead volumes [m^3]."""
    return {
        "actuator.volume_per_angle": per_angle,
        "actuator.dead_volume_1": dead,
        "actuator.dead_volume_2": dead,
    }


def figure_7() -> Iterator[str]:
    """Yield what each shipped set gives of the text of figure 7, with the shank lying either way and upright."""
    for name in SETS:
        actuator = load_device(name).actuator
        chambers = volumes(*(np.full(3, getattr(actuator, item)) for item in ("volume_per_angle", "dead_volume_1")))
        found = step_metrics(chambers | {"motion.shank.level": np.radians(SHOWN_ATTITUDES)})
        for place, degrees in enumerate(SHOWN_ATTITUDES):
            waits, falls, rises = (found[key][place] for key in (PLATEAU, FALL, RISE))
            first = f"P1 at the supply {waits:.0f} ms before breakaway, falls by {falls:.1f} psi"
            yield f"{name:21} {degrees:3.0f} deg  {first}; P2 rises by {rises:.1f} psi"


def best_volumes() -> Iterator[str]:
    """Yield the volumes that agree best with torque task and text, the attitude of the leg averaged over its prior."""
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
    for name, values, unit in (("volume per angle", per_angle[kept], "cm^3/rad"), ("dead volume", dead[kept], "cm^3")):
        yield f"{name:16} {values[best]:g} ({values[near].min():g} to {values[near].max():g}) {unit}"
    row, column = np.unravel_index(int(np.argmax(of_task[kept][:, None] * of_text)), of_text.shape)
    most = f"{per_angle[kept][row]:g} cm^3/rad and {dead[kept][row]:g} cm^3"
    yield f"of single attitudes {attitudes[column]:g} deg agrees best, with {most}"


def what_is_open(family: Family) -> Iterator[str]:
    """Yield what the evidence leaves of volumes, readings, conclusions and of the four printed numbers."""
    yield f"{family.density.size} completions, effective sample size {family.effective:.0f}"
    for name, unit in ((VOLUME, "cm^3/rad"), (DEAD_VOLUME, "cm^3"), (ATTITUDE, "deg")):
        low, median, high = weighted_quantiles(family.draws[name], family.weights, (0.05, 0.5, 0.95))
        yield f"{name}: {median:.3g} ({low:.3g} to {high:.3g}) {unit}"
    yield next(posterior_text(item) for item in implications_of(family) if item.setting.name == VOLTS)
    for reading, statement, of_all, of_weight in conclusion_rows(conclusions(family)):
        yield f"{reading:20} {statement:39} {of_all} of all; by the rest {of_weight}"
    yield reach_sentence(within_reach(family))
    for entry in EVIDENCE:
        if entry.published is not None:
            weights = family.weights_without((entry.id, *entry.same_data))
            low, high = weighted_quantiles(OBSERVABLES[entry.observable](family.metrics), weights, (0.05, 0.95))
            rest = f"by the rest {low:.3g} to {high:.3g} {entry.unit} (effective sample size {effective(weights):.0f})"
            yield f"{entry.id:23} {entry.published:g} {entry.unit}; {rest}"


SEARCHED = 16
"""Completions for which the best decisions are searched."""
_UNITS = {
    "motion.angle": "rad",
    "reference.level": "N m",
    "reference.start_level": "N m",
    "reference.ramp_time": "s",
    "run.duration": "s",
    "controller.rate": "Hz",
    "actuator.volume_per_angle": "m^3/rad",
    **{f"supply.{name}": "Pa_a" for name in ("pressure", "dorsiflexion_pressure")},
    **{f"valve.{name}": "s" for name in ("opening_delay", "closing_delay")},
    **{f"actuator.dead_volume_{number}": "m^3" for number in (1, 2)},
}


def improved_control(family: Family) -> Iterator[str]:
    """Yield how the best decisions at 20 Hz compare with the proportional valve, in completions drawn by weight."""
    weights = np.where(family.draws[ON_OFF_RATE] == 20.0, family.weights, 0.0)
    chosen = np.random.default_rng(1).choice(weights.size, SEARCHED, p=weights / weights.sum())
    spool = family.metrics[PROPORTIONAL]["rms_error"][chosen]
    pairs = []
    for number in chosen:
        one = columns({name: values[[number]] for name, values in family.draws.items()}, SOLENOID)
        words = [f"{path}={float(value[0])!r} {_UNITS.get(path, '')}".strip() for path, value in one.items()]
        pairs.append(load_scenario("torque-task-solenoid", words))
    yield f"error of the best decisions at 20 Hz over that of the proportional valve, in {SEARCHED} completions"
    for name, commands in CHOICES.items():
        ratios = np.array([best_decisions(pair, commands)[0] for pair in pairs]) / spool
        low, median, high = np.quantile(ratios, (0.05, 0.5, 0.95))
        below = f"below 1 in {int(np.count_nonzero(ratios < 1.0))} of {SEARCHED}"
        yield f"{name:15} median {median:.2f}, 5 to 95 % {low:.2f} to {high:.2f}, {below}"


def for_a_builder() -> Iterator[str]:
    """Yield what the device does on a walking leg, for each set."""
    for name in SETS:
        compared = compare_walks(load_walk("solenoid", (f"device.set={name}",)), 0.3)
        found, without = compared.with_device.metrics, compared.without_device.metrics
        peak = compared.with_device.averages["torque"].mean.max()
        falls, bare = (np.degrees(metrics["slap_rate"].value) for metrics in (found, without))
        share, gas = 100.0 * found["push_off_share"].value, GRAMS_PER_KILOGRAM * found["gas"].value
        yield f"{name:21} peak {peak:.2f} N m, push-off {share:.1f} % of a healthy ankle's work, {gas:.3f} g a stride"
        yield f"{'':21} the foot comes down at {falls:.0f} deg/s, at {bare:.0f} without the device"


def draw(family: Family, file: str) -> None:
    """Draw where the improvement comes from, and which volumes the evidence leaves."""
    draws = {name: values[: family.even] for name, values in family.draws.items()}
    quiet = agreement_with(QUIET, family.metrics)[: family.even] > 0.0
    chosen = quiet & (draws[VOLTS] == 1.0) & (draws[DISCHARGE] == 0.0) & (draws[ON_OFF_RATE] == 20.0)
    demand, gain = demand_over_ceiling(draws)[chosen], improvement(family.metrics)[: family.even][chosen]
    entry = paper_entries()[IMPROVEMENT]
    printed, deviation = entry.published or 0.0, entry.deviation or 0.0
    with house_style():
        figure, [[left, right]] = figure_of_free_panels((9.0, 4.1), MARGINS, 1, 2)
        left.axhspan(printed - deviation, printed + deviation, color=VERMILION, alpha=0.25, linewidth=0.0)
        left.axvline(1.0, color=GREY, linewidth=0.9, linestyle=(0, (1, 2)))
        left.plot(demand, gain, ".", color=BLUE, markersize=3.0)
        left.set(ylim=(-60.0, 100.0), xlabel="Demand over what the supply holds", ylabel="RMS error less (%)")
        left.set_title("Where the printed 15 % (band) comes from")
        weights = family.weights / family.weights.max()
        kept = weights > 1.0e-3
        right.scatter(
            family.draws[VOLUME][kept], family.draws[DEAD_VOLUME][kept], s=25.0 * weights[kept], color=BLUE, alpha=0.5
        )
        for name, marker in zip(SETS, "sDo", strict=True):
            actuator = load_device(name).actuator
            at = 1.0e6 * actuator.volume_per_angle, 1.0e6 * actuator.dead_volume_1
            right.plot(*at, marker, color=VERMILION, markersize=7.0, linestyle="none", label=name)
        right.set(xlabel="Volume per angle (cm$^3$/rad)", ylabel="Dead volume (cm$^3$)")
        right.set_title("What the evidence leaves of the volumes")
        right.legend(loc="center right")
        mark_kind(figure, "simulated")
        figure.savefig(file, dpi=90)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print every number, section by section, and draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--draws", type=int, default=40_960, help="completions; default 40960")
    parser.add_argument("--only", default="", help="beginning of the title of the one section that is wanted")
    parser.add_argument(
        "--figure", default="docs/images/comparison.png", help="where the figure of a whole run is written"
    )
    chosen = parser.parse_args(arguments)

    @cache
    def family() -> Family:
        """Find what the evidence leaves, once and only for a section that needs it."""
        return infer_settings(chosen.draws)

    sections: dict[str, Callable[[], Iterator[str]]] = {
        "Where 15 % comes from": where_it_comes_from,
        "Law and valve": lambda: (line for level in (6.0, 4.0) for line in law_and_valve(level)),
        "Figure 7": figure_7,
        "The volumes that fit": best_volumes,
        "What is open": lambda: what_is_open(family()),
        "Improved control": lambda: improved_control(family()),
        "For a builder": for_a_builder,
    }
    wanted = [title for title in sections if title.startswith(chosen.only)]
    if not wanted:
        parser.error(f"--only {chosen.only}: no section begins so; there are {', '.join(sections)}")
    for title in wanted:
        print(f"{title}\n", flush=True)
        for line in sections[title]():
            print(f"    {line}", flush=True)
        print()
    if not chosen.only:
        draw(family(), chosen.figure)


if __name__ == "__main__":
    main()
