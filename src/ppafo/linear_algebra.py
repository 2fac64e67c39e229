"""One thread for the linear algebra of small matrices, whose threads would wait for each other at full load."""

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


def on_one_thread(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Return the function with one thread for each library of linear algebra that is loaded, while it runs.

    Libraries and their number of threads are the process's: they are as before once it returns. Runs of the engine
    have threads of their own, which stay.
    """

    @wraps(function)
    def limited(*given: Arguments.args, **named: Arguments.kwargs) -> Result:
        with threadpool_limits(limits=1, user_api="blas"):
            return function(*given, **named)

    return limited
