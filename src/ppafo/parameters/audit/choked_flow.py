"""Checks of the reported constants of orifice flow against the data of the gas. Equations (6) and (7)."""

import ast
import math
import operator
from collections.abc import Callable, Iterator

from ppafo.model.gas import choked_flow_constant, critical_pressure_ratio
from ppafo.model.orifice import subsonic_flow_constant
from ppafo.parameters.audit.evidence import GAS_PATHS, AuditFinding, ComparedNumber, Evidence
from ppafo.parameters.device import Gas

_C1 = "reported.choked_flow_constant"
_EXPONENT = "reported.choked_flow_exponent"
_ROUNDING = 1e-3
"""Relative tolerance besides the reported digits [-], for other values of R, M and 273 or 273.15 K."""

_LONGEST, _LARGEST = 80, 1e3
"""Largest number of characters of a formula, and largest magnitude of its value."""
_BINARY: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}


def check_choked_flow(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield a finding for each reported flow constant, a note if it agrees, and for the reported exponent."""
    gas = evidence.gas()
    if gas is None:
        return
    k, constant = gas.heat_capacity_ratio, gas.specific_gas_constant
    # The paper states the critical ratio as upstream over downstream.
    expected = {
        _C1: choked_flow_constant(k, constant, gas.temperature),
        "reported.subsonic_flow_constant": subsonic_flow_constant(k, constant, gas.temperature),
        "reported.critical_pressure_ratio": 1.0 / critical_pressure_ratio(k),
    }
    for path, value in expected.items():
        reported, digits = evidence.number(path), evidence.magnitude(path)
        if reported is None or digits is None:
            continue
        agrees = digits.low * (1.0 - _ROUNDING) <= value <= digits.high * (1.0 + _ROUNDING)
        quantity = evidence.declared[path]
        yield AuditFinding(
            id=path.rpartition(".")[2].replace("_", "-"),
            severity="note" if agrees else "error",
            title=f"{quantity.summary} {'follows' if agrees else 'does not follow'} from the gas data",
            values=evidence.values_of(path, *GAS_PATHS),
            sides=(
                ComparedNumber("reported", reported, quantity.unit),
                ComparedNumber("from the gas data", value, quantity.unit),
            ),
        )
    yield from _exponent(evidence, gas)


def _exponent(evidence: Evidence, gas: Gas) -> Iterator[AuditFinding]:
    """Yield a finding if the reported exponent in C1 differs from (k + 1)/(k - 1)."""
    formula = evidence.text(_EXPONENT)
    k = gas.heat_capacity_ratio
    exponent = None if formula is None else evaluate(formula, k)
    expected = (k + 1.0) / (k - 1.0)
    if formula is None or (exponent is not None and math.isclose(exponent, expected, rel_tol=1e-9)):
        return
    correct = choked_flow_constant(k, gas.specific_gas_constant, gas.temperature)
    values = evidence.values_of(_EXPONENT, _C1, *GAS_PATHS)
    title = "the reported exponent in C1 is not the exponent of choked flow"
    if exponent is None:
        text = f"The formula '{formula}' is not an arithmetic expression in k; the correct exponent is (k + 1)/(k - 1)."
        yield AuditFinding(id="choked-flow-exponent", severity="warning", title=title, values=values, why=text)
        return
    # C1 contains the square root of the power, hence half the difference of the exponents.
    literal = correct * (2.0 / (k + 1.0)) ** (0.5 * (exponent - expected))
    yield AuditFinding(
        id="choked-flow-exponent",
        title=title,
        values=values,
        sides=(
            ComparedNumber(f"reported exponent {formula}", exponent, ""),
            ComparedNumber("C1 with the reported exponent", literal, "s/m"),
            ComparedNumber("C1 with (k+1)/(k-1)", correct, "s/m"),
        ),
    )


def evaluate(formula: str, heat_capacity_ratio: float) -> float | None:
    """Return the value of a formula such as ``(k + 1)/(k - 1)``; None for any other text."""
    # A formula of a file must not slow down the audit, whatever its length and value.
    if len(formula) > _LONGEST:
        return None
    try:
        # Parsed and walked, never evaluated by Python: a set is data.
        value = _value(ast.parse(formula, mode="eval").body, heat_capacity_ratio)
    except (SyntaxError, ValueError, ZeroDivisionError, OverflowError):
        return None
    return value if abs(value) < _LARGEST else None


def _value(node: ast.expr, k: float) -> float:
    """Return the value of a syntax tree of arithmetic in k. Raises ValueError for any other tree."""
    match node:
        case ast.BinOp(left, operation, right) if type(operation) in _BINARY:
            return _BINARY[type(operation)](_value(left, k), _value(right, k))
        case ast.UnaryOp(ast.USub(), operand):
            return -_value(operand, k)
        case ast.Name("k"):
            return k
        case ast.Constant(int() | float() as number) if not isinstance(number, bool):
            return float(number)
    raise ValueError("a formula may contain only numbers, the heat capacity ratio k and arithmetic")
