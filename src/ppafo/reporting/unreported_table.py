"""What the paper left unsaid, in words and as a document."""

import math
from collections.abc import Sequence
from typing import Any

from ppafo.studies.unreported_settings.evidence import REPORTED, TOLD
from ppafo.studies.unreported_settings.study import (
    ENOUGH,
    Conclusion,
    Family,
    Implied,
    conclusions,
    implied,
    strongest_links,
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
    """Return what the results leave of a setting."""
    setting = item.setting
    if setting.choices:
        names = setting.words or [f"{choice:g} {setting.unit}" for choice in setting.choices]
        pairs = sorted(zip(item.shares, names, strict=True), reverse=True)
        return ", ".join(f"{name} {100.0 * share:.0f} %" for share, name in pairs if share > 0.005)
    if not math.isfinite(item.median):
        return "nothing agrees"
    return f"{item.median:.3g} ({item.low:.3g} to {item.high:.3g}) {setting.unit}"


def conclusion_rows(found: Sequence[Conclusion]) -> list[tuple[str, str, str, str]]:
    """Return each statement with its shares in percent: of all, of the weight, by the other results alone."""
    return [
        (
            item.statement,
            f"{100.0 * item.of_all:.1f} %",
            f"{100.0 * item.of_weight:.1f} %",
            f"{100.0 * item.by_the_rest:.0f} % ({item.rest_effective:.0f} of equal weight)",
        )
        for item in found
    ]


def unreported_table(family: Family) -> list[str]:
    """Return the lines that the command prints."""
    rows = [("setting", "allowed", "left: median and 90 % interval", "verdict"), *setting_rows(family)]
    lines = [*_columns(rows), ""]
    head = ("conclusion", "of all completions", "of those that agree", "by the other results alone")
    lines += [*_columns([head, *conclusion_rows(conclusions(family))]), ""]
    lines += [_count(family)]
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
            }
            for item in conclusions(family)
        ],
        "evidence": [
            {"name": item.name, "value": item.value, "tolerance": item.tolerance, "unit": item.unit, "why": item.why}
            for item in REPORTED
        ],
        "told": [item.name for item in TOLD],
        "drawn": family.drawn,
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
        return described | {"shares": dict(zip(names, item.shares, strict=True))}
    return described | {
        "allowed": [setting.low, setting.high],
        "median": item.median,
        "interval_90": [item.low, item.high],
    }
