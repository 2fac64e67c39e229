"""Thread limit of linear algebra libraries: one thread for the small matrices of fits and studies.

If every processor runs models, several threads per small matrix product would only slow each other down.
"""

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


def on_one_thread(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Decorate a function to run with a single thread in linear algebra libraries (BLAS).

    The limit applies to the whole process and is restored when the function returns or raises. Runs of the engine have
    their own threads, which are not limited.
    """

    @wraps(function)
    def on_one(*arguments: Arguments.args, **options: Arguments.kwargs) -> Result:
        with threadpool_limits(limits=1, user_api="blas"):
            return function(*arguments, **options)

    return on_one
