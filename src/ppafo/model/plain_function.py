"""Functions whose text is read: what a program is composed of."""

from collections.abc import Mapping
from types import CodeType
from typing import Any, Protocol


class PlainFunction(Protocol):
    """A function as ``def`` makes it, of whatever parameters: its source, its code and the names that it sees are read.

    A partial function, a method or an object that can be called is none.
    """

    __name__: str
    __qualname__: str
    __module__: str
    __code__: CodeType

    @property
    def __globals__(self) -> Mapping[str, Any]:
        """Names of its module."""

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call it as Python does."""

    def __hash__(self) -> int:
        """Every function is itself alone: what was made of it is kept by it."""
