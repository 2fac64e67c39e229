"""The answer on what the paper left unsaid: what is left of each setting, and how firm the conclusions are."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.parameters.publications.publication import paper_entries
from ppafo.questions.question import Solved
from ppafo.questions.unreported.figure import draw_settings
from ppafo.questions.unreported.settings import (
    DISCHARGE,
    EVIDENCE,
    GAS,
    IMPROVEMENT,
    ON_OFF_RATE,
    QUIET,
    SETTINGS,
    VOLTS,
    Draws,
    Floats,
    Metrics,
    Setting,
    agreement,
    agreement_with,
    demand_over_ceiling,
    effective,
    improvement,
    saving,
)
from ppafo.simulation.scenario import plain
from ppafo.studies.distributions import jackknife_reach

if TYPE_CHECKING:
    import matplotlib.figure

REPLICATES = 4
ENOUGH = 100.0


@dataclass(frozen=True, slots=True, repr=False)
class Family(Solved):
    """All completions that could be run: settings by name, metrics by valve and name, and how densely they were drawn.

    Each (draws,). The first ``even`` are spread evenly over what is allowed, the others lie where the results agree.
    ``density`` is how densely they were drawn there, over the even spread, ``replicate`` which replicate each is of.
    ``drawn`` counts also those that no run can have or that failed.
    """

    draws: Draws
    metrics: Metrics
    density: Floats
    replicate: NDArray[np.intp]
    even: int
    drawn: int
    seed: int

    def without_each(self) -> "list[Family]":
        """Return, for each replicate, what the others found."""
        found = []
        for number in range(REPLICATES):
            kept = self.replicate != number
            found.append(
                Family(
                    {name: values[kept] for name, values in self.draws.items()},
                    {valve: {name: item[kept] for name, item in of.items()} for valve, of in self.metrics.items()},
                    self.density[kept],
                    self.replicate[kept],
                    int(np.count_nonzero(kept[: self.even])),
                    self.drawn,
                    self.seed,
                )
            )
        return found

    @property
    def weights(self) -> Floats:
        """Weight of each completion by all that is reported; they add up to 1, or are all 0."""
        return self.weights_without(())

    def weights_without(self, left_out: Collection[str]) -> Floats:
        """Weights where some of what is reported does not count."""
        raw = agreement(self.metrics, left_out) / self.density
        total = raw.sum()
        return np.asarray(raw / total if total > 0.0 else raw)

    @property
    def is_enough(self) -> bool:
        """True where enough completions agree for a verdict on a setting."""
        return self.effective >= ENOUGH

    @property
    def effective(self) -> float:
        """Number of completions [-] that equal weights would need to say as much."""
        return effective(self.weights)


FEWEST_REPLICATES = 3
TOO_FEW = "too few to say"
IMPLIED, NARROWED = 0.5, 0.8
"""A setting is implied (narrowed) where what is left of its range is below this fraction of what was allowed."""


@dataclass(frozen=True, slots=True)
class Implication:
    """What the results say about one setting: its median and 90 % interval, what is left of its range, in words.

    For a choice, ``fractions`` are the weights of the choices and the numbers are nan. ``error`` is the half width of
    the 95 % interval of each number, by its name, from the spread between the replicates.
    """

    setting: Setting
    median: float
    low: float
    high: float
    left: float
    fractions: tuple[float, ...]
    verdict: str
    error: Mapping[str, tuple[float, ...]]


@dataclass(frozen=True, slots=True)
class Conclusion:
    """A statement under a reading of U, and in which fraction of all completions, and of their weight, it holds [-].

    Weights are those by the evidence that does not say the statement already, the same for every statement, so that no
    two statements hold more often than one of them. ``effective`` completions of equal weight would say as much under
    this reading. ``error`` are the half widths of the 95 % intervals, from the spread between the replicates.
    """

    statement: str
    reading: str
    of_all: float
    of_weight: float
    effective: float
    error: tuple[float, float]


@dataclass(frozen=True, slots=True)
class WithinReach:
    """The comparison where U is the opening, Cd and 20 Hz are as printed, and every other setting is drawn evenly.

    Completions in which the proportional valve oscillates on the ramp are left out: the text says that it does not.
    ``better`` is the fraction of the ``count`` completions whose demand is below 0.95 of what the supply holds that
    tracks better with the proportional valve, ``improvement`` the quantiles 5, 50 and 95 % of by how much [%].
    ``demand`` has those of the demand over what the supply holds where the improvement is the printed one, to its
    deviation twice.
    """

    count: int
    better: float
    improvement: tuple[float, float, float]
    printed_count: int
    demand: tuple[float, float, float]


def implications_of(family: Family) -> list[Implication]:
    """What the results imply for each setting, in their order; no verdict where too few completions agree."""
    others = family.without_each()
    found = []
    for setting in SETTINGS:
        item = _implication(setting, family)
        left_out = [_implication(setting, other) for other in others]
        error = {
            name: _error([_numbers(each, name) for each in left_out]) for name in ("median", "low", "high", "left")
        }
        error["shares"] = _error([each.fractions for each in left_out])
        ends = [_verdict(item.left + sign * error["left"][0]) for sign in (-1.0, 1.0)]
        verdict = item.verdict if len(set(ends)) == 1 else " or ".join(ends)
        found.append(replace(item, verdict=verdict if family.is_enough else TOO_FEW, error=error))
    return found


def _numbers(item: Implication, name: str) -> tuple[float, ...]:
    number: float = getattr(item, name)
    return (number,)


def _error(left_out: Sequence[Sequence[float]]) -> tuple[float, ...]:
    """Return half widths of 95 % intervals from estimates without each replicate in turn; nan from too few."""
    if len(left_out) < FEWEST_REPLICATES:
        return (math.nan,) * len(left_out[0]) if left_out else ()
    return tuple(jackknife_reach(np.array(left_out, dtype=np.float64), 0.95).tolist())


def _implication(setting: Setting, family: Family) -> Implication:
    values, weight = family.draws[setting.name], family.weights
    if setting.choices:
        fractions = tuple(float(weight[values == choice].sum()) for choice in setting.choices)
        left = spread_of(fractions)
        return Implication(setting, np.nan, np.nan, np.nan, left, fractions, _verdict(left), {})
    low, median, high = weighted_quantiles(values, weight, (0.05, 0.5, 0.95))
    scale = np.log if setting.is_logarithmic else np.asarray
    left = float((scale(high) - scale(low)) / (0.9 * (scale(setting.high) - scale(setting.low))))
    return Implication(setting, median, low, high, left, (), _verdict(left), {})


def spread_of(fractions: Sequence[float]) -> float:
    """How far weights spread over choices, 0 for one alone to 1 for all alike, by their perplexity; nan for none."""
    if not sum(fractions) > 0.0:
        return float("nan")
    entropy = -sum(fraction * math.log(fraction) for fraction in fractions if fraction > 0.0)
    return (math.exp(entropy) - 1.0) / (len(fractions) - 1)


def _verdict(left: float) -> str:
    if math.isnan(left):
        return "nothing agrees"
    if left < IMPLIED:
        return "implied"
    return "narrowed" if left < NARROWED else "left open"


def weighted_quantiles(values: Floats, weight: Floats, levels: tuple[float, ...]) -> list[float]:
    """Quantiles of weighted values; nan where there is no weight."""
    order = np.argsort(values)
    total = np.cumsum(weight[order])
    if total.size == 0 or total[-1] <= 0.0:
        return [float("nan")] * len(levels)
    places = np.searchsorted(total, np.array(levels) * total[-1])
    return [float(values[order[min(place, order.size - 1)]]) for place in places]


BETTER, LESS, BOTH = (
    "The proportional valve tracks better.",
    "The proportional valve uses less gas.",
    "It does both.",
)
SAYS_IT = (IMPROVEMENT, *GAS)
"""Entries that already say what the statements say."""


def conclusions(family: Family) -> list[Conclusion]:
    """How firmly the paper's conclusions hold under each reading of U."""
    others = family.without_each()
    readings = next(setting for setting in SETTINGS if setting.name == VOLTS)
    found = []
    for volts, reading in zip(readings.choices, readings.words, strict=True):
        weight = np.where(family.draws[VOLTS] == volts, family.weights_without(SAYS_IT), 0.0)
        for statement in (BETTER, LESS, BOTH):
            fractions = _fractions(family, statement, volts)
            error = _error([_fractions(other, statement, volts) for other in others])
            found.append(Conclusion(statement, reading, *fractions, effective(weight), (error[0], error[1])))
    return found


def weight_of_readings(family: Family) -> dict[str, float]:
    """Return what the evidence leaves of each reading of U [-]."""
    readings = next(setting for setting in SETTINGS if setting.name == VOLTS)
    pairs = zip(readings.words, readings.choices, strict=True)
    return {words: float(family.weights[family.draws[VOLTS] == volts].sum()) for words, volts in pairs}


def _fractions(family: Family, statement: str, volts: float) -> tuple[float, float]:
    """In which fraction of all completions of a reading, and of their weight by the other evidence, it holds [-]."""
    better, less = improvement(family.metrics) > 0.0, saving(family.metrics) > 0.0
    holds = {BETTER: better, LESS: less}.get(statement, better & less)
    here = family.draws[VOLTS] == volts
    even, weight = here[: family.even], np.where(here, family.weights_without(SAYS_IT), 0.0)
    total = weight.sum()
    of_weight = float(weight[holds].sum() / total) if total > 0.0 else math.nan
    return float(holds[: family.even][even].mean()), of_weight


REACH = 0.95
"""Fraction of what the supply holds below which a demand is within its reach."""


def within_reach(family: Family) -> WithinReach:
    """Return the comparison within reach of the supply, and where the printed improvement comes from."""
    draws = {name: values[: family.even] for name, values in family.draws.items()}
    gain = improvement(family.metrics)[: family.even]
    quiet = agreement_with(QUIET, family.metrics)[: family.even] > 0.0
    chosen = quiet & (draws[VOLTS] == 1.0) & (draws[DISCHARGE] == 0.0) & (draws[ON_OFF_RATE] == 20.0)
    demand = demand_over_ceiling(draws)
    near, entry = chosen & (demand < REACH), paper_entries()[IMPROVEMENT]
    like_printed = chosen & (np.abs(gain - (entry.published or 0.0)) <= 2.0 * (entry.deviation or 0.0))
    return WithinReach(
        int(near.sum()),
        float((gain[near] > 0.0).mean()) if near.any() else math.nan,
        _quantiles(gain[near]),
        int(like_printed.sum()),
        _quantiles(demand[like_printed]),
    )


def _quantiles(values: Floats) -> tuple[float, float, float]:
    low, median, high = weighted_quantiles(values, np.ones(values.size), (0.05, 0.5, 0.95))
    return low, median, high


def strongest_links(family: Family, count: int = 4) -> list[tuple[str, str, float]]:
    """Pairs of settings that the results tie together most, with their weighted correlation of ranks [-]."""
    names = [setting.name for setting in SETTINGS if len(setting.choices) != 2]
    ranks = np.array([_ranks(family.draws[name]) for name in names])
    total = family.weights.sum()
    if total <= 0.0:
        return []
    away = ranks - (ranks * family.weights).sum(axis=1, keepdims=True) / total
    covariance = (away * family.weights) @ away.T / total
    spread = np.sqrt(np.diag(covariance))
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = np.nan_to_num(covariance / np.outer(spread, spread))
    pairs = [
        (names[one], names[two], float(correlation[one, two]))
        for one in range(len(names))
        for two in range(one + 1, len(names))
    ]
    return sorted(pairs, key=lambda pair: -abs(pair[2]))[:count]


def _ranks(values: Floats) -> Floats:
    """Ranks from 0 to 1; equal values share one."""
    _, places, counts = np.unique(values, return_inverse=True, return_counts=True)
    middle = np.cumsum(counts) - 0.5 * counts
    return np.asarray(middle[places] / values.size)


def unreported_figure(family: Family) -> "matplotlib.figure.Figure":
    """Return the panels of all settings, of the two main results and of the level over the supply pressure."""
    found = implications_of(family)
    fractions = {item.setting.name: item.fractions for item in found}
    return draw_settings(family, [item.verdict for item in found], fractions)


ERRORS = (
    f"each ±: 95 % by the spread between {REPLICATES} independent replicates; the effective sample size shows how "
    "unequal the weights are, not how precise a fraction is"
)
_CAPTION = (
    "Grey: prior; blue: posterior, smoothed; black: the scenarios of the package. Improvement over saving has the "
    "paper as a cross; level over supply shows where the improvement is the printed one."
)
_SETTINGS = ("setting", "allowed", "posterior: median and 90 % interval", "verdict")
_CONCLUSIONS = ("reading", "conclusion", "of all completions", "by the other evidence")


def answer_of(family: Family) -> Answer:
    """Return the answer; it has passed where any completion agrees with the paper."""
    settings, found = setting_rows(family), conclusion_rows(conclusions(family))
    return Answer(
        name="unreported",
        kicker="Inference",
        title="What the paper left unsaid",
        lead=(count_sentence(family), ERRORS),
        sections=(
            Section(
                "Settings",
                table=Table(tuple(map(Column, _SETTINGS)), tuple(settings), left=len(_SETTINGS)),
                remarks=(_links(family),),
                figure=Figure("unreported-settings", _CAPTION, lambda: unreported_figure(family)),
            ),
            Section(
                "Conclusions, each under one reading of U",
                table=Table(tuple(map(Column, _CONCLUSIONS)), tuple(found), left=len(_CONCLUSIONS)),
                remarks=(_readings(family), reach_sentence(within_reach(family))),
            ),
        ),
        data=_data(family),
        passed=family.effective > 0.0,
    )


def _readings(family: Family) -> str:
    """Return what all the evidence leaves of each reading of U."""
    left = ", ".join(f"{words} {100.0 * weight:.0f} %" for words, weight in weight_of_readings(family).items())
    return f"what all the evidence leaves of each reading: {left}"


def _links(family: Family) -> str:
    """Return which settings the results tie together, or that too few completions agree to say."""
    if not family.is_enough:
        return f"an effective sample size below {ENOUGH:g} is too small for a verdict: give more --draws"
    links = "; ".join(f"{one} with {other} {value:+.2f}" for one, other, value in strongest_links(family))
    return f"strongest rank correlations: {links}"


def setting_rows(family: Family) -> list[tuple[str, str, str, str]]:
    """Return name, what was allowed, what is left, and the verdict of each setting."""
    return [
        (item.setting.name, prior_text(item), posterior_text(item), item.verdict) for item in implications_of(family)
    ]


def prior_text(item: Implication) -> str:
    """Return what a setting could be before anything was compared."""
    setting = item.setting
    if setting.choices:
        return ", ".join(setting.words or [f"{choice:g}" for choice in setting.choices]) + f" {setting.unit}".rstrip()
    return f"{setting.low:g} to {setting.high:g} {setting.unit}"


def posterior_text(item: Implication) -> str:
    """Return what the results leave of a setting, with the error between the replicates."""
    setting = item.setting
    if setting.choices:
        names = setting.words or [f"{choice:g} {setting.unit}" for choice in setting.choices]
        rows = sorted(zip(item.fractions, item.error["shares"], names, strict=True), reverse=True)
        return ", ".join(f"{name} {_percent(fraction, error, 0)}" for fraction, error, name in rows if fraction > 0.005)
    if not math.isfinite(item.median):
        return "no completion agrees"
    median, low, high = (f"{getattr(item, name):.3g} ± {item.error[name][0]:.2g}" for name in ("median", "low", "high"))
    return f"{median} ({low} to {high}) {setting.unit}".rstrip()


def conclusion_rows(found: Sequence[Conclusion]) -> list[tuple[str, str, str, str]]:
    """Return reading and statement with the fractions in percent: of all, and by the evidence that does not say it."""
    return [
        (
            item.reading,
            item.statement,
            _percent(item.of_all, item.error[0], 1),
            f"{_percent(item.of_weight, item.error[1], 0)} (effective sample size {item.effective:.0f})",
        )
        for item in found
    ]


def reach_sentence(found: WithinReach) -> str:
    """Return the statement that does not hang on how the evidence is weighed."""
    low, median, high = found.improvement
    least, middle, most = found.demand
    return (
        f"where U is the opening, with the printed Cd and 20 Hz, a proportional valve that does not oscillate, and a "
        f"demand below {REACH:g} of what the supply holds, the proportional valve tracks better in "
        f"{100.0 * found.better:.1f} % of {found.count} completions, by {median:.0f} % ({low:.0f} to {high:.0f} %); "
        f"the printed improvement comes with a demand of {middle:.2f} ({least:.2f} to {most:.2f}) times what the "
        f"supply holds ({found.printed_count} completions)"
    )


def _percent(fraction: float, error: float, digits: int) -> str:
    if math.isnan(fraction):
        return "no completion agrees"
    # No fraction is off by more than all of it.
    reach = f"{100.0 * min(error, 1.0):.{0 if error >= 0.1 else 1 if error >= 0.01 else 2}f}"
    return f"{100.0 * fraction:.{digits}f} ± {reach} %"


def count_sentence(family: Family) -> str:
    """Return how many completions there are and what those that agree are worth."""
    return (
        f"{family.density.size} completions with both valves of {family.drawn} drawn, random seed {family.seed}; "
        f"effective sample size {family.effective:.0f}"
    )


_FRACTIONS = ("share_of_all", "share_by_the_other_evidence")


def _data(family: Family) -> dict[str, Any]:
    """Return everything as data; numbers in the units that are named."""
    return {
        "settings": [_setting(item) for item in implications_of(family)],
        "conclusions": [
            {
                "statement": item.statement,
                "reading": item.reading,
                "share_of_all": item.of_all,
                "share_by_the_other_evidence": plain(item.of_weight),
                "effective": item.effective,
                "error": dict(zip(_FRACTIONS, plain(list(item.error)), strict=True)),
            }
            for item in conclusions(family)
        ],
        "within_reach": plain(asdict(within_reach(family))),
        "readings": weight_of_readings(family),
        "evidence": [
            {
                "id": entry.id,
                "where": entry.where,
                "observable": entry.observable,
                "value": entry.published,
                "at_least": entry.at_least,
                "at_most": entry.at_most,
                "deviation": entry.deviation,
                "unit": entry.unit,
                "why": entry.likelihood,
            }
            for entry in EVIDENCE
        ],
        "drawn": family.drawn,
        "replicates": REPLICATES,
        "errors": "half widths of 95 % intervals, from the spread between the replicates",
        "completions": int(family.density.size),
        "effective": family.effective,
        "seed": family.seed,
    }


def _setting(item: Implication) -> dict[str, Any]:
    setting = item.setting
    described: dict[str, Any] = {
        "name": setting.name,
        "unit": setting.unit,
        "why": setting.why,
        "verdict": item.verdict,
    }
    if setting.choices:
        names = setting.words or tuple(f"{choice:g}" for choice in setting.choices)
        errors = dict(zip(names, plain(list(item.error["shares"])), strict=True))
        return described | {"shares": dict(zip(names, item.fractions, strict=True)), "error": errors}
    return described | {
        "allowed": [setting.low, setting.high],
        "median": item.median,
        "interval_90": [item.low, item.high],
        "error": {name: plain(item.error[name][0]) for name in ("median", "low", "high", "left")},
    }
