"""Evaluates the small formulas in k that papers print; arithmetic only, nothing else can be in them."""

import ast
import operator
from collections.abc import Callable

_LONGEST = 80
_LARGEST = 1e3
_BINARY: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}


def evaluate(formula: str, heat_capacity_ratio: float) -> float | None:
    """Return the value of a formula such as ``(k + 1)/(k - 1)``, None where it is no such thing."""
    if len(formula) > _LONGEST:
        return None
    try:
        value = _value(ast.parse(formula, mode="eval").body, heat_capacity_ratio)
    except (SyntaxError, ValueError, ZeroDivisionError, OverflowError):
        return None
    return value if abs(value) < _LARGEST else None


def _value(node: ast.expr, k: float) -> float:
    match node:
        case ast.BinOp(left, operation, right) if type(operation) in _BINARY:
            return _BINARY[type(operation)](_value(left, k), _value(right, k))
        case ast.UnaryOp(ast.USub(), operand):
            return -_value(operand, k)
        case ast.Name("k"):
            return k
        case ast.Constant(int() | float() as number) if not isinstance(number, bool):
            return float(number)
    raise ValueError("not plain arithmetic in k")
