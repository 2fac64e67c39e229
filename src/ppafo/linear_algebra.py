"""Threads of the libraries of linear algebra: one for the small matrices of a fit, a search or a study.

Where every processor runs models, several threads of a small product would only wait for each other.
"""

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


def on_one_thread(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Return a function that does the same while each library of linear algebra (BLAS) that is loaded has one thread.

    The limit is the whole process's, and is as before once the function returns or raises. Runs of the engine have
    threads of their own, which stay.
    """

    @wraps(function)
    def on_one(*arguments: Arguments.args, **options: Arguments.kwargs) -> Result:
        with threadpool_limits(limits=1, user_api="blas"):
            return function(*arguments, **options)

    return on_one
