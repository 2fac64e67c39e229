"""Functions of floats applied to columns: one value for each run of an ensemble.

Plain arithmetic works on floats and on arrays (runs,) alike, bit for bit. What branches or takes a power or an
exponential does not; here such a function is called as it is, once for each combination of values that occurs.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Numeric = TypeVar("Numeric", float, NDArray[np.float64])
"""A float, or an array (runs,) of them: what a function of plain arithmetic takes and gives back."""
Result = TypeVar("Result")
"""Return type of a function of floats."""
Problem = tuple[Any, Callable[[int], str]]
"""Possible fault of runs: a truth value for all or an array (runs,), and the message about one of them.

The message is made of the number of a run, from 0; it is one line, as an error shows it.
"""


def over_runs(function: Callable[..., Result], *arguments: Any) -> Result:
    """Result of a function of floats; where an argument is an array (runs,), every number of it is one too.

    The function returns a float or a tuple, nested ones and NamedTuples among them, of the same shape for all runs.
    """
    varied = [argument for argument in arguments if isinstance(argument, np.ndarray)]
    if not varied:
        return function(*arguments)
    # A function that branches takes no arrays; one call for each distinct combination gives each run the bits that it
    # has alone.
    combinations, combination_of_run = _distinct(varied)
    results = []
    for values in combinations:
        # Arrays give way to the numbers of one combination, in their order; all else is handed on as it is.
        rest = iter(values)
        single = [next(rest) if isinstance(argument, np.ndarray) else argument for argument in arguments]
        results.append(function(*single))
    gathered: Result = _gather(results, combination_of_run)
    return gathered


def root(number: Numeric) -> Numeric:
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


def truncated(number: Numeric) -> Numeric:
    """A number from -2^63 to 2^63 without its fraction, as a float; element by element for a column."""
    return np.trunc(number) if isinstance(number, np.ndarray) else float(int(number))


def rounded_up(number: Numeric) -> Numeric:
    """The next whole number from a number on, as a float; element by element for a column."""
    # One expression for floats and columns, where math.ceil would give an int.
    part = truncated(number)
    found: Numeric = choose(part < number, part + 1.0, part)
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
    """The combinations of values of columns (runs,) that occur, and the number of the one that each run has (runs,)."""
    if len(columns) == 1:
        # One column is sorted as numbers, several as rows, which takes many times longer.
        values, value_of_run = np.unique(columns[0], return_inverse=True)
        return values[:, None].tolist(), value_of_run
    # Where most values of each column differ, hardly any combination occurs again: sorting saves nothing.
    if all(np.unique(column).size > column.size // 2 for column in columns):
        return np.stack(columns, axis=1).tolist(), np.arange(columns[0].size)
    rows, row_of_run = np.unique(np.stack(columns, axis=1), axis=0, return_inverse=True)
    return rows.tolist(), row_of_run.reshape(-1)


def _gather(results: Sequence[Any], combination_of_run: NDArray[np.intp]) -> Any:
    """The result of each run from those of the combinations: an array (runs,), or a tuple of them."""
    first_result = results[0]
    if not isinstance(first_result, tuple):
        return np.array(results, dtype=np.float64)[combination_of_run]
    parts = [_gather([result[index] for result in results], combination_of_run) for index in range(len(first_result))]
    return type(first_result)(*parts) if hasattr(first_result, "_fields") else tuple(parts)
