"""From the tables ``[[vary]]`` of a study file to axes and distributions in SI units, or one line why not."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ppafo.errors import UnitError
from ppafo.studies.sweep import declaration as declared
from ppafo.studies.sweep.noise import NOISE
from ppafo.studies.sweep.paths import VariedPath
from ppafo.studies.sweep.sampling.distributions import (
    Distribution,
    LogNormalAround,
    LogUniformBetween,
    NormalAround,
    NormalBetween,
    OneOf,
    TriangularBetween,
    UniformBetween,
    WholeNumbersBetween,
)
from ppafo.studies.sweep.study import Axis, Drawn


def axis_or_distribution(item: declared.Varied, place: VariedPath) -> Axis | Drawn:
    """Return what a table asks for; UnitError with the key where a value is not usable or contradicts another."""
    _check_whole(item)
    if isinstance(item, declared.Grid):
        return Axis(item.path, _all_whole(item.path, _grid(item, place)))
    if isinstance(item, declared.Listed):
        levels = tuple(_level("values", value, place) for value in item.values)
        return Axis(item.path, _all_whole(item.path, levels))
    return Drawn(item.path, _DISTRIBUTIONS[item.kind](item, place))


def _check_whole(item: declared.Varied) -> None:
    """Refuse kinds that give a seed no whole numbers, and whole numbers for what is not counted."""
    is_seed, is_whole = item.path == NOISE, item.kind == "whole_numbers"
    if is_whole and not is_seed:
        raise UnitError(f"kind = 'whole_numbers' is for '{NOISE}' alone; use 'choice' or 'uniform'")
    if is_seed and item.kind not in ("grid", "list", "choice", "whole_numbers"):
        raise UnitError(f"kind = '{item.kind}' gives no whole numbers, and a seed is one; use 'whole_numbers'")


def _all_whole(path: str, values: tuple[float, ...]) -> tuple[float, ...]:
    broken = [value for value in values if path == NOISE and value != math.floor(value)]
    if broken:
        raise UnitError(f"{broken[0]:g} must be a whole number")
    return values


def _grid(item: declared.Grid, place: VariedPath) -> tuple[float, ...]:
    first, last = _key(item, "first", place), _key(item, "last", place)
    if first == last:
        raise UnitError(f"first and last are both {item.first!r}; a grid needs two different ends")
    if item.spacing == "linear":
        return tuple(np.linspace(first, last, item.count).tolist())
    if min(first, last) <= 0.0:
        raise UnitError("spacing = 'logarithmic' needs both ends above 0")
    return tuple(np.geomspace(first, last, item.count).tolist())


def _uniform(item: declared.Uniform, place: VariedPath) -> Distribution:
    return UniformBetween(*_bounds(item, place))


def _log_uniform(item: declared.LogUniform, place: VariedPath) -> Distribution:
    minimum, maximum = _bounds(item, place)
    if minimum <= 0.0:
        raise UnitError(f"minimum = {item.minimum!r}: a log-uniform distribution needs both bounds above 0")
    return LogUniformBetween(minimum, maximum)


def _normal(item: declared.Normal, place: VariedPath) -> Distribution:
    return NormalAround(_key(item, "mean", place), _deviation(item, place))


def _truncated_normal(item: declared.TruncatedNormal, place: VariedPath) -> Distribution:
    minimum, maximum = _bounds(item, place)
    return NormalBetween(_key(item, "mean", place), _deviation(item, place), minimum, maximum)


def _log_normal(item: declared.LogNormal, place: VariedPath) -> Distribution:
    median = _key(item, "median", place)
    if median <= 0.0:
        raise UnitError(f"median = {item.median!r} must be above 0")
    return LogNormalAround(median, item.factor)


def _triangular(item: declared.Triangular, place: VariedPath) -> Distribution:
    minimum, maximum = _bounds(item, place)
    mode = _key(item, "mode", place)
    if not minimum <= mode <= maximum:
        raise UnitError(f"mode = {item.mode!r} must lie between minimum {item.minimum!r} and maximum {item.maximum!r}")
    return TriangularBetween(minimum, mode, maximum)


def _choice(item: declared.Choice, place: VariedPath) -> Distribution:
    values = _all_whole(item.path, tuple(_level("values", value, place) for value in item.values))
    weights = item.weights or (1.0,) * len(values)
    if len(weights) != len(values):
        raise UnitError(f"weights has {len(weights)} numbers, values has {len(values)}; there must be as many")
    if min(weights) < 0.0 or math.fsum(weights) <= 0.0:
        raise UnitError(f"weights = {list(weights)} must be at least 0, and not all of them 0")
    shares = np.cumsum(weights) / np.sum(weights)
    return OneOf(values, tuple(shares.tolist()))


def _whole_numbers(item: declared.WholeNumbers, place: VariedPath) -> Distribution:
    return WholeNumbersBetween(*_bounds(item, place))


_DISTRIBUTIONS: dict[str, Callable[[Any, VariedPath], Distribution]] = {
    "uniform": _uniform,
    "log_uniform": _log_uniform,
    "normal": _normal,
    "truncated_normal": _truncated_normal,
    "log_normal": _log_normal,
    "triangular": _triangular,
    "choice": _choice,
    "whole_numbers": _whole_numbers,
}
"""What builds each kind. To add one: a table in ``declaration``, a class in ``sampling.distributions``, a line here."""


def _bounds(item: Any, place: VariedPath) -> tuple[float, float]:
    minimum, maximum = _key(item, "minimum", place), _key(item, "maximum", place)
    if minimum >= maximum:
        raise UnitError(f"minimum = {item.minimum!r} must be less than maximum = {item.maximum!r}")
    return minimum, maximum


def _deviation(item: Any, place: VariedPath) -> float:
    try:
        deviation = place.distance(item.standard_deviation)
    except UnitError as error:
        raise UnitError(f"standard_deviation = {item.standard_deviation!r}: {error}") from error
    if deviation <= 0.0:
        raise UnitError(f"standard_deviation = {item.standard_deviation!r} must be more than 0")
    return deviation


def _key(item: Any, key: str, place: VariedPath) -> float:
    return _level(key, getattr(item, key), place)


def _level(key: str, value: str | float, place: VariedPath) -> float:
    try:
        return place.level(value)
    except UnitError as error:
        raise UnitError(f"{key} = {value!r}: {error}") from error
