"""Functions of floats applied to columns: one value for each run of an ensemble.

Plain arithmetic gives the same bits on floats and on arrays (runs,). Functions with branches, powers or exponentials do
not accept arrays; here such a function is called unchanged, once for each distinct combination of values. The functions
of numbers below work elementwise on columns; in a program of one run their branches for columns are left out.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Numeric = TypeVar("Numeric", float, NDArray[np.float64])
"""Float or array (runs,) of floats, as argument and result of a function of plain arithmetic."""
Result = TypeVar("Result")
"""Return type of a function of floats."""
Problem = tuple[Any, Callable[[int], str]]
"""Possible fault of runs: a truth value for all or an array (runs,), and a function for the message about one run.

The function takes the number of a run, from 0, and returns one line.
"""


def over_runs(function: Callable[..., Result], *arguments: Any) -> Result:
    """Apply a function of floats; if an argument is an array (runs,), every number of the result is one too.

    The function returns a float or a tuple, nested ones and NamedTuples among them, of the same shape for all runs.
    """
    results, combination_of_run = over_combinations(function, *arguments)
    gathered: Result = gather(results, combination_of_run)
    return gathered


def over_combinations(function: Callable[..., Result], *arguments: Any) -> tuple[list[Result], NDArray[np.intp] | None]:
    """Apply a function of floats to each distinct combination of arguments; arrays (runs,) hold one value per run.

    Returns the results, and the index of the combination of each run (runs,), None if no argument is an array.
    """
    varied = [argument for argument in arguments if isinstance(argument, np.ndarray)]
    if not varied:
        return [function(*arguments)], None
    # A function that branches takes no arrays; one call for each distinct combination gives each run the bits that it
    # has alone.
    combinations, combination_of_run = _distinct(varied)
    results = []
    for values in combinations:
        # Arrays give way to the numbers of one combination, in their order; all else is handed on as it is.
        rest = iter(values)
        single = [next(rest) if isinstance(argument, np.ndarray) else argument for argument in arguments]
        results.append(function(*single))
    return results, combination_of_run


def gather(results: Sequence[Any], combination_of_run: NDArray[np.intp] | None) -> Any:
    """Result of each run, taken from the results of the combinations: an array (runs,), or a tuple of arrays.

    Without an index of the combination of each run, the single result.
    """
    first_result = results[0]
    if combination_of_run is None:
        return first_result
    if not isinstance(first_result, tuple):
        return np.array(results, dtype=np.float64)[combination_of_run]
    parts = [gather([result[index] for result in results], combination_of_run) for index in range(len(first_result))]
    return type(first_result)(*parts) if hasattr(first_result, "_fields") else tuple(parts)


def root(number: Numeric) -> Numeric:
    """Square root of a number."""
    return np.sqrt(number) if isinstance(number, np.ndarray) else math.sqrt(number)


def larger(first: Any, second: Any) -> Any:
    """Larger of two numbers."""
    if isinstance(first, np.ndarray) or isinstance(second, np.ndarray):
        return np.maximum(first, second)
    return max(first, second)


def smaller(first: Any, second: Any) -> Any:
    """Smaller of two numbers."""
    if isinstance(first, np.ndarray) or isinstance(second, np.ndarray):
        return np.minimum(first, second)
    return min(first, second)


def choose(test: Any, yes: Any, no: Any) -> Any:
    """First number where a test holds, else the second."""
    return np.where(test, yes, no) if isinstance(test, np.ndarray) else (yes if test else no)


def truncated(number: Numeric) -> Numeric:
    """Integer part of a number from -2^63 to 2^63, as a float."""
    return np.trunc(number) if isinstance(number, np.ndarray) else float(int(number))


def rounded_up(number: Numeric) -> Numeric:
    """Smallest integer not below a number, as a float; elementwise for a column."""
    # One expression for floats and columns, where math.ceil would give an int.
    part = truncated(number)
    found: Numeric = choose(part < number, part + 1.0, part)
    return found


def whole(number: Any) -> Any:
    """Convert a float with an integer value to int."""
    return number.astype(np.int64) if isinstance(number, np.ndarray) else int(number)


def at(number: Any, run: int) -> float:
    """Value for one run, in the unit of the number."""
    return float(number[run]) if isinstance(number, np.ndarray) else float(number)


def first(number: Any) -> float:
    """Value for the first run, in the unit of the number."""
    return at(number, 0)


def _distinct(columns: Sequence[NDArray[np.float64]]) -> tuple[Iterable[Sequence[float]], NDArray[np.intp]]:
    """Distinct combinations of values of columns (runs,), and the index of the combination of each run (runs,)."""
    if len(columns) == 1:
        # One column is sorted as numbers, several as rows, which takes many times longer.
        values, value_of_run = np.unique(columns[0], return_inverse=True)
        return values[:, None].tolist(), value_of_run
    # Where most values of each column differ, hardly any combination occurs again: sorting saves nothing.
    if all(np.unique(column).size > column.size // 2 for column in columns):
        return np.stack(columns, axis=1).tolist(), np.arange(columns[0].size)
    rows, row_of_run = np.unique(np.stack(columns, axis=1), axis=0, return_inverse=True)
    return rows.tolist(), row_of_run.reshape(-1)
