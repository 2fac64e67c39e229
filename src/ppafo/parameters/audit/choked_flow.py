"""Do the printed constants of orifice flow follow from the gas data? Equations (6) and (7)."""

import math
from collections.abc import Iterator

from ppafo.model.gas import choked_flow_constant, critical_pressure_ratio, subsonic_flow_constant
from ppafo.parameters.audit.evidence import GAS_PATHS, Evidence
from ppafo.parameters.audit.finding import Finding, Side
from ppafo.parameters.audit.formula import evaluate
from ppafo.parameters.device import Gas

_C1 = "reported.choked_flow_constant"
_EXPONENT = "reported.choked_flow_exponent"
_ROUNDING = 1e-3
"""Relative room beside the printed digits: other values of R, M and 273 or 273.15."""


def check(evidence: Evidence) -> Iterator[Finding]:
    """Yield a finding for each printed constant, a note where it holds, and one for the printed exponent."""
    gas = evidence.gas()
    if gas is None:
        return
    k, constant = gas.heat_capacity_ratio, gas.specific_gas_constant
    expected = {
        _C1: choked_flow_constant(k, constant, gas.temperature),
        "reported.subsonic_flow_constant": subsonic_flow_constant(k, constant, gas.temperature),
        "reported.critical_pressure_ratio": 1.0 / critical_pressure_ratio(k),
    }
    for path, value in expected.items():
        yield from _constant(evidence, path, value)
    yield from _exponent(evidence, gas)


def _constant(evidence: Evidence, path: str, expected: float) -> Iterator[Finding]:
    printed, digits = evidence.number(path), evidence.magnitude(path)
    if printed is None or digits is None:
        return
    holds = digits.low * (1.0 - _ROUNDING) <= expected <= digits.high * (1.0 + _ROUNDING)
    quantity = evidence.declared[path]
    verdict = "agree to the printed digits" if holds else f"differ by {100.0 * (printed / expected - 1.0):+.2g} %"
    remedy = "" if holds else f" Reconciled by {expected:.5g}, or by other gas data."
    yield Finding(
        id=path.rpartition(".")[2].replace("_", "-"),
        severity="note" if holds else "error",
        title=f"{quantity.summary} {'follows' if holds else 'does not follow'} from the gas data",
        values=evidence.values_of(path, *GAS_PATHS),
        sides=(Side("printed", printed, quantity.unit), Side("from the gas data", expected, quantity.unit)),
        paragraph=(
            f"Printed is {evidence.in_set_unit(path, printed)}; the gas data give {expected:.5g} "
            f"{quantity.unit}".rstrip()
            + f". The two {verdict}.{remedy}"
        ),
    )


def _exponent(evidence: Evidence, gas: Gas) -> Iterator[Finding]:
    """Compare C1 with the printed exponent to C1 with (k + 1)/(k - 1)."""
    formula = evidence.text(_EXPONENT)
    k = gas.heat_capacity_ratio
    exponent = None if formula is None else evaluate(formula, k)
    right = (k + 1.0) / (k - 1.0)
    if formula is None or (exponent is not None and math.isclose(exponent, right, rel_tol=1e-9)):
        return
    correct = choked_flow_constant(k, gas.specific_gas_constant, gas.temperature)
    values = evidence.values_of(_EXPONENT, _C1, *GAS_PATHS)
    title = "the printed exponent inside C1 is not the one of choked flow"
    if exponent is None:
        text = f"The formula '{formula}' cannot be read as arithmetic in k; the right exponent is (k + 1)/(k - 1)."
        yield Finding("choked-flow-exponent", "warning", title, values, (), text)
        return
    literal = correct * (2.0 / (k + 1.0)) ** (0.5 * (exponent - right))
    yield Finding(
        id="choked-flow-exponent",
        severity="error",
        title=title,
        values=values,
        sides=(Side("C1 with the printed exponent", literal, "s/m"), Side("C1 with (k+1)/(k-1)", correct, "s/m")),
        paragraph=(
            f"The printed exponent {formula} is {exponent:.4g} and gives C1 = {literal:.4g} s/m; the exponent "
            f"(k + 1)/(k - 1) = {right:.4g} gives {correct:.4g} s/m{_agreement(evidence, literal, correct)}. "
            f"Reconciled by the exponent (k + 1)/(k - 1)."
        ),
    )


def _agreement(evidence: Evidence, literal: float, correct: float) -> str:
    printed = evidence.number(_C1)
    if printed is None:
        return ""
    nearer = "second" if abs(printed - correct) < abs(printed - literal) else "first"
    return f", and the printed C1 of {printed:.4g} s/m is the {nearer} of the two"
