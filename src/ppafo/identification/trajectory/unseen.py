"""What a fit cannot see, in words: each effect that its recordings leave open, and what that would do to a number."""

from collections.abc import Sequence

import numpy as np

from ppafo.identification.trajectory.directions.catalogue import EFFECT_DIRECTIONS
from ppafo.identification.trajectory.directions.changes import can_have
from ppafo.identification.trajectory.doubt import Doubt, Finding, title_of
from ppafo.identification.trajectory.problem import Range, is_nuisance
from ppafo.identification.trajectory.residuals import Floats
from ppafo.simulation.scenario import Scenario

VISIBLE = 2.0
"""Standard errors that the largest believable size of an effect has at least where it would be seen."""
_NOTABLE = 0.5
"""Share of half an interval below which a shift is not worth a line."""


def unseen_in_words(
    doubt: Doubt, ranges: Sequence[Range], point: Floats, half_widths: Floats, scenarios: Sequence[Scenario]
) -> tuple[str, ...]:
    """Return a sentence for each effect that the recordings leave open, the invisible ones first.

    ``point`` and ``half_widths`` of the intervals are in coordinates. An effect that shows is not among them.
    """
    shown = {one.finding.column.name for one in doubt.shown}
    found = {one.column.name for one in doubt.findings}
    invisible = [
        one.name
        for one in EFFECT_DIRECTIONS
        if one.name not in found and any(can_have(scenario, one) for scenario in scenarios)
    ]
    open_ones = []
    for one in doubt.findings:
        if one.column.name in shown:
            continue
        if max(abs(one.column.low), one.column.high) < VISIBLE * one.error:
            invisible.append(one.column.name)
            continue
        sentence = _shift_in_words(one, ranges, point, half_widths)
        open_ones += [sentence] if sentence else []
    return (*(f"{title_of(name)}: invisible in these recordings" for name in invisible), *open_ones)


def _shift_in_words(one: Finding, ranges: Sequence[Range], point: Floats, half_widths: Floats) -> str:
    """Return the largest size that is open and what it does to the number that it moves most; empty for little."""
    size = max(abs(one.low), abs(one.high))
    kept = [index for index, item in enumerate(ranges) if not is_nuisance(item)]
    if not kept or size == 0.0:
        return ""
    shares = [abs(float(one.shifts[index])) * size / max(float(half_widths[index]), 1.0e-300) for index in kept]
    most = kept[int(np.argmax(shares))]
    if max(shares) < _NOTABLE:
        return ""
    item = ranges[most]
    shift = abs(float(one.shifts[most]) * item.slope(float(point[most]))) * size
    unit = f" {item.unit}" if item.unit not in ("", "-", "1") else ""
    return (
        f"{title_of(one.column.name)}: up to {one.column.size_in_words(size)} would shift {item.name} by "
        f"{shift:.2g}{unit}, {max(shares):.2g} times half its interval"
    )
