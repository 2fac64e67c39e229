"""Functions of floats applied to columns: one value for each run of an ensemble.

Plain arithmetic works on floats and on arrays (runs,) alike, bit for bit. What branches or takes a power or an
exponential does not; here such a function is called as it is, once for each combination of values that occurs.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Number = TypeVar("Number", float, NDArray[np.float64])
"""A float, or an array of them: what a function of plain arithmetic takes and gives back."""
Result = TypeVar("Result")
Problem = tuple[Any, Callable[[int], str]]
"""What may be wrong with a run: a truth value, or an array of them (runs,), and the line about one of the runs."""


def over_runs(function: Callable[..., Result], *arguments: Any) -> Result:
    """Result of a function of floats; where an argument is an array (runs,), every number of it is one too.

    The function returns a float or a tuple, nested ones and NamedTuples among them, of the same shape for all runs.
    """
    varied = [argument for argument in arguments if isinstance(argument, np.ndarray)]
    if not varied:
        return function(*arguments)
    # A function that branches takes no arrays; one call for each distinct combination gives each run the bits that it
    # has alone.
    distinct, places = _distinct(varied)
    results = []
    for values in distinct:
        # Arrays give way to the numbers of one combination, in their order; all else is handed on as it is.
        own = iter(values)
        results.append(function(*(next(own) if isinstance(given, np.ndarray) else given for given in arguments)))
    gathered: Result = _gather(results, places)
    return gathered


def root(number: Number) -> Number:
    """Square root of a number; element by element for a column."""
    return np.sqrt(number) if isinstance(number, np.ndarray) else math.sqrt(number)


def larger(first: Any, second: Any) -> Any:
    """The larger of two numbers; where one is a column, run by run."""
    if isinstance(first, np.ndarray) or isinstance(second, np.ndarray):
        return np.maximum(first, second)
    return max(first, second)


def smaller(first: Any, second: Any) -> Any:
    """The smaller of two numbers; where one is a column, run by run."""
    if isinstance(first, np.ndarray) or isinstance(second, np.ndarray):
        return np.minimum(first, second)
    return min(first, second)


def choose(test: Any, yes: Any, no: Any) -> Any:
    """The first number where a test holds, else the second; where one of the three is a column, run by run."""
    return np.where(test, yes, no) if isinstance(test, np.ndarray) else (yes if test else no)


def truncated(number: Number) -> Number:
    """A number from -2^63 to 2^63 without its fraction, as a float; element by element for a column."""
    return np.trunc(number) if isinstance(number, np.ndarray) else float(int(number))


def rounded_up(number: Number) -> Number:
    """The next whole number from a number on, as a float; element by element for a column."""
    # One expression for floats and columns, where math.ceil would give an int.
    part = truncated(number)
    found: Number = choose(part < number, part + 1.0, part)
    return found


def whole(number: Any) -> Any:
    """A whole number as an int; an array of them as one of integers."""
    return number.astype(np.int64) if isinstance(number, np.ndarray) else int(number)


def at(number: Any, run: int) -> float:
    """The number of one run, in its own unit."""
    return float(number[run]) if isinstance(number, np.ndarray) else float(number)


def first(number: Any) -> float:
    """The number of the first run, in its own unit."""
    return at(number, 0)


def _distinct(columns: Sequence[NDArray[np.float64]]) -> tuple[Iterable[Sequence[float]], NDArray[np.intp]]:
    """The combinations of values that occur, and which of them each run has."""
    if len(columns) == 1:
        # One column is sorted as numbers, several as rows, which takes many times longer.
        values, places = np.unique(columns[0], return_inverse=True)
        return values[:, None].tolist(), places
    # Combinations are sorted only where there is a hope that some occur again.
    if all(np.unique(column).size > column.size // 2 for column in columns):
        return np.stack(columns, axis=1).tolist(), np.arange(columns[0].size)
    rows, places = np.unique(np.stack(columns, axis=1), axis=0, return_inverse=True)
    return rows.tolist(), places.reshape(-1)


def _gather(results: Sequence[Any], places: NDArray[np.intp]) -> Any:
    first = results[0]
    if not isinstance(first, tuple):
        # Back from combinations to runs: each run gets the result of the combination that it has.
        return np.array(results, dtype=np.float64)[places]
    parts = [_gather([result[index] for result in results], places) for index in range(len(first))]
    return type(first)(*parts) if hasattr(first, "_fields") else tuple(parts)
