"""What the paper left unsaid, in words and as a document."""

import math
from collections.abc import Sequence
from typing import Any

from ppafo.simulation.document import plain
from ppafo.studies.unreported_settings.evidence import REPORTED, TOLD
from ppafo.studies.unreported_settings.implications import (
    Conclusion,
    Implied,
    conclusions,
    implied,
    strongest_links,
)
from ppafo.studies.unreported_settings.study import ENOUGH, REPLICATES, Family

ERRORS = (
    f"each ±: 95 % by the spread between {REPLICATES} searches that know nothing of each other; 'of equal weight' "
    "says how unequal the weights are, not how sure a share is"
)


def setting_rows(family: Family) -> list[tuple[str, str, str, str]]:
    """Return name, what was allowed, what is left, and the verdict of each setting."""
    return [(item.setting.name, allowed(item), left(item), item.verdict) for item in implied(family)]


def allowed(item: Implied) -> str:
    """Return what a setting could be before anything was compared."""
    setting = item.setting
    if setting.choices:
        return ", ".join(setting.words or [f"{choice:g}" for choice in setting.choices]) + f" {setting.unit}".rstrip()
    return f"{setting.low:g} to {setting.high:g} {setting.unit}"


def left(item: Implied) -> str:
    """Return what the results leave of a setting, with the error between the replicates."""
    setting = item.setting
    if setting.choices:
        names = setting.words or [f"{choice:g} {setting.unit}" for choice in setting.choices]
        rows = sorted(zip(item.shares, item.error["shares"], names, strict=True), reverse=True)
        return ", ".join(f"{name} {_percent(share, error, 0)}" for share, error, name in rows if share > 0.005)
    if not math.isfinite(item.median):
        return "nothing agrees"
    median, low, high = (f"{getattr(item, name):.3g} ± {item.error[name][0]:.2g}" for name in ("median", "low", "high"))
    return f"{median} ({low} to {high}) {setting.unit}".rstrip()


def conclusion_rows(found: Sequence[Conclusion]) -> list[tuple[str, str, str, str]]:
    """Return each statement with its shares in percent: of all, of the weight, by the other results alone."""
    return [
        (
            item.statement,
            _percent(item.of_all, item.error[0], 1),
            _percent(item.of_weight, item.error[1], 1),
            f"{_percent(item.by_the_rest, item.error[2], 0)} ({item.rest_effective:.0f} of equal weight)",
        )
        for item in found
    ]


def _percent(share: float, error: float, digits: int) -> str:
    reach = f"{100.0 * error:.2g}" if error >= 0.01 else f"{100.0 * error:.2f}"
    return f"{100.0 * share:.{digits}f} ± {reach} %"


def unreported_table(family: Family) -> list[str]:
    """Return the lines that the command prints."""
    rows = [("setting", "allowed", "left: median and 90 % interval", "verdict"), *setting_rows(family)]
    lines = [*_columns(rows), ""]
    head = ("conclusion", "of all completions", "of those that agree", "by the other results alone")
    lines += [*_columns([head, *conclusion_rows(conclusions(family))]), ""]
    lines += [_count(family), ERRORS]
    if not family.is_enough:
        return [*lines, f"fewer than {ENOUGH:g} of equal weight are too few for a verdict: give more --draws"]
    links = "; ".join(f"{one} with {other} {value:+.2f}" for one, other, value in strongest_links(family))
    return [*lines, f"tied together (correlation of ranks): {links}"]


def _count(family: Family) -> str:
    return (
        f"{family.density.size} completions with both valves of {family.drawn} drawn, seed {family.seed}; "
        f"those that agree say as much as {family.effective:.0f} of equal weight"
    )


def _columns(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


_SHARES = ("share_of_all", "share_of_those_that_agree", "share_by_the_other_results_alone")


def unreported_document(family: Family) -> dict[str, Any]:
    """Return everything as data for JSON; numbers in the units that are named."""
    return {
        "settings": [_setting(item) for item in implied(family)],
        "conclusions": [
            {
                "statement": item.statement,
                "share_of_all": item.of_all,
                "share_of_those_that_agree": item.of_weight,
                "share_by_the_other_results_alone": item.by_the_rest,
                "effective_of_the_other_results": item.rest_effective,
                "error": dict(zip(_SHARES, plain(list(item.error)), strict=True)),
            }
            for item in conclusions(family)
        ],
        "evidence": [
            {"name": item.name, "value": item.value, "tolerance": item.tolerance, "unit": item.unit, "why": item.why}
            for item in REPORTED
        ],
        "told": [item.name for item in TOLD],
        "drawn": family.drawn,
        "replicates": REPLICATES,
        "errors": "half widths of 95 % intervals, by the spread between the replicates",
        "completions": int(family.density.size),
        "effective": family.effective,
        "seed": family.seed,
    }


def _setting(item: Implied) -> dict[str, Any]:
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
        return described | {"shares": dict(zip(names, item.shares, strict=True)), "error": errors}
    return described | {
        "allowed": [setting.low, setting.high],
        "median": item.median,
        "interval_90": [item.low, item.high],
        "error": {name: plain(item.error[name][0]) for name in ("median", "low", "high", "left")},
    }
