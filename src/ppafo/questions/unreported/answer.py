"""The answer on what the paper left unsaid: what is left of each setting, and how firm the conclusions are."""

import math
from collections.abc import Sequence
from typing import Any

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.questions.unreported.evidence import REPORTED, STATED
from ppafo.questions.unreported.figure import unreported_figure
from ppafo.questions.unreported.implications import (
    Conclusion,
    Implication,
    conclusions,
    implications_of,
    strongest_links,
)
from ppafo.questions.unreported.solve import ENOUGH, REPLICATES, Family
from ppafo.simulation.document import plain

ERRORS = (
    f"each ±: 95 % by the spread between {REPLICATES} independent searches; the effective sample size shows how "
    "unequal the weights are, not how precise a fraction is"
)

_CAPTION = "Grey: prior; blue: posterior. Dots: improvement over saving, with the paper's as a cross."

_SETTINGS = ("setting", "allowed", "posterior: median and 90 % interval", "verdict")
_CONCLUSIONS = ("conclusion", "of all completions", "of those that agree", "by the other results alone")


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
            Section("Conclusions", table=Table(tuple(map(Column, _CONCLUSIONS)), tuple(found), left=len(_CONCLUSIONS))),
        ),
        data=_data(family),
        passed=family.effective > 0.0,
    )


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
    """Return each statement with its shares in percent: of all, of the weight, by the other results alone."""
    return [
        (
            item.statement,
            _percent(item.of_all, item.error[0], 1),
            _percent(item.of_weight, item.error[1], 1),
            f"{_percent(item.by_the_rest, item.error[2], 0)} (effective sample size {item.rest_effective:.0f})",
        )
        for item in found
    ]


def _percent(fraction: float, error: float, digits: int) -> str:
    # No fraction is off by more than all of it.
    reach = f"{100.0 * min(error, 1.0):.{0 if error >= 0.1 else 1 if error >= 0.01 else 2}f}"
    return f"{100.0 * fraction:.{digits}f} ± {reach} %"


def count_sentence(family: Family) -> str:
    """Return how many completions there are and what those that agree are worth."""
    return (
        f"{family.density.size} completions with both valves of {family.drawn} drawn, random seed {family.seed}; "
        f"effective sample size {family.effective:.0f}"
    )


_FRACTIONS = ("share_of_all", "share_of_those_that_agree", "share_by_the_other_results_alone")


def _data(family: Family) -> dict[str, Any]:
    """Return everything as data; numbers in the units that are named."""
    return {
        "settings": [_setting(item) for item in implications_of(family)],
        "conclusions": [
            {
                "statement": item.statement,
                "share_of_all": item.of_all,
                "share_of_those_that_agree": item.of_weight,
                "share_by_the_other_results_alone": item.by_the_rest,
                "effective_of_the_other_results": item.rest_effective,
                "error": dict(zip(_FRACTIONS, plain(list(item.error)), strict=True)),
            }
            for item in conclusions(family)
        ],
        "evidence": [
            {"name": item.name, "value": item.value, "tolerance": item.tolerance, "unit": item.unit, "why": item.why}
            for item in REPORTED
        ],
        "told": [item.name for item in STATED],
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
