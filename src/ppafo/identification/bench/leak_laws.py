"""Comparison of two flow laws of a leak: ISO 6358 with C and b sought, and an orifice beside a laminar gap.

Either law bends the curve of an orifice by one unknown more, so that readings of one may look like the other. Both are
fitted to the same readings, and their log-likelihoods (noise of each fit, priors of the bench) are compared.
"""

import math
from dataclasses import replace
from typing import NamedTuple

from ppafo.identification.bench.flow import CRITICAL_RATIOS, NEXT_LAW, Law, Opening
from ppafo.identification.bench.result import BenchResult, ReportedNumber
from ppafo.identification.fit import Fit
from ppafo.identification.wording import in_shown_unit, interval_texts
from ppafo.signals.recording import Floats

RIVALS: dict[Law, Law] = {"both": "iso6358", "iso6358": "both"}
"""Law that a fitted law is compared with, by law."""
_CLEAR = math.log(100.0)
"""Difference of log-likelihoods [-] from which one law explains readings clearly better.

Both laws have equally many unknowns, so that no penalty differs. With the right law fitted, another law is 100 times as
likely in at most 1 of 100 recordings (Markov's inequality), as a conflict is at the level of its tests.
"""
_AT_BOUND = 1.0e-3
"""Distance of a critical ratio from its bounds [-] up to which it is at its bound."""
_SYMBOLS = {"sonic_conductance": "C", "critical_ratio": "b", "coefficient": "c"}
"""Symbols of the quantities that a sentence states, by last part of the path."""


class LawFit(NamedTuple):
    """Fit of a flow law to the readings of a leak.

    ``opening`` is the law, ``reported`` are its quantities, ``fitted`` is the fit and ``model`` the fitted readings
    [unit of the readings]. ``has_both_regimes`` is True for readings with choked and subsonic flow.
    """

    opening: Opening
    reported: list[ReportedNumber]
    fitted: Fit
    model: Floats
    has_both_regimes: bool

    @property
    def is_sound(self) -> bool:
        """True if no readings contradict the law and they determine the critical ratio, if it is sought."""
        if not self.opening.has_sought_ratio:
            return self.fitted.conflict is None
        ratio, (_, low, high) = self.fitted.by_name[self.reported[-1].path], CRITICAL_RATIOS
        return self.fitted.conflict is None and self.has_both_regimes and low + _AT_BOUND < ratio < high - _AT_BOUND

    @property
    def has_gap(self) -> bool:
        """True for a laminar gap whose interval does not begin at zero."""
        row = [number.name for number in self.fitted.numbers].index(self.reported[-1].path)
        return self.opening.law == "both" and float(self.fitted.low[row]) > 0.0

    @property
    def text(self) -> str:
        """Law with its quantities, ``law = 'iso6358' (C = 4.0e-03 L/(s bar), b = 0.40)``."""
        names, quantities = [number.name for number in self.fitted.numbers], list[str]()
        for number in self.reported:
            name = number.path.rpartition(".")[2]
            symbol = _SYMBOLS.get(name.removesuffix("_over_volume"))
            if symbol is not None:
                row = names.index(number.path)
                ends = (float(values[row]) for values in (self.fitted.values, self.fitted.low, self.fitted.high))
                (value, unit), (low, _), (high, _) = (in_shown_unit(each, number.unit) for each in ends)
                symbol = f"{symbol}/V" if name.endswith("_over_volume") else symbol
                text = "0" if symbol[0] == "c" and not self.has_gap else interval_texts(value, low, high)[0]
                quantities.append(f"{symbol} = {text} {unit}".rstrip(" -"))
        return f"law = '{self.opening.law}' ({', '.join(quantities)})"


def next_law(chosen: LawFit, rival: LawFit | None) -> str:
    """Return the remedy for readings that the chosen law does not fit; None for a law without a rival."""
    if rival is None:
        # An orifice in the form of the set, with its critical ratio.
        return NEXT_LAW["orifice" if chosen.opening.law == "iso6358" else chosen.opening.law]
    if rival.is_sound and rival.fitted.log_likelihood > chosen.fitted.log_likelihood - _CLEAR:
        return f"try law = '{rival.opening.law}'"
    return "neither ISO 6358 nor an orifice beside a laminar gap explains the readings"


def with_rival(result: BenchResult, chosen: LawFit, rival: LawFit, remedy: str) -> BenchResult:
    """Return the result of the chosen law, with the verdicts that its rival allows.

    If the rival explains the readings clearly better, that is a conflict. If neither does, a remark says so, and values
    that depend on whether there is a gap hold for this model only. ``remedy`` is the advice where no law fits.
    """
    advantage = rival.fitted.log_likelihood - chosen.fitted.log_likelihood
    with_gap = rival if chosen.opening.has_sought_ratio else chosen
    has_leak = any(estimate.is_usable and estimate.value > 0.0 for estimate in result.estimates)
    if advantage >= _CLEAR:
        better = (
            f"{rival.text} explains the readings better than law = '{chosen.opening.law}' (log-likelihood higher by "
            f"{advantage:.1f})"
        )
        advice = f"{better}; give law = '{rival.opening.law}'"
        unexplained = result.conflict or f"{better}, but not all of them; {remedy}"
        result = replace(result, conflict=advice if rival.is_sound else unexplained)
    elif (
        advantage <= -_CLEAR
        or not has_leak
        or result.conflict
        or rival.fitted.conflict is not None
        # Without a gap, an orifice with the set's b is ISO 6358 with another b.
        or (with_gap.opening.critical_ratio is not None and not with_gap.has_gap)
    ):
        return result
    else:
        remark = (
            f"the readings do not tell law = '{chosen.opening.law}' from {rival.text}: the log-likelihoods differ by "
            f"{abs(advantage):.1f}, less than {_CLEAR:.1f}; less noise, or more pressures, may tell them apart"
        )
        result = replace(result, remarks=(*result.remarks, remark))
        # Without a gap, both laws are an orifice.
        if not with_gap.has_gap:
            return result
    estimates = [
        replace(item, verdict="holds for this model only") if item.is_identified else item for item in result.estimates
    ]
    return replace(result, estimates=tuple(estimates))
