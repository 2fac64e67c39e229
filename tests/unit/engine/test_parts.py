"""Functions with parts: what they call is an argument, in Python and in the text that is compiled."""

from collections.abc import Callable
from typing import Any, NamedTuple

import pytest

from ppafo.engine.source_text import SourceCollector
from ppafo.errors import ProgramError
from ppafo.model.binding import made_of

HEADER = "import math\nfrom collections import namedtuple\n\n\n"


class Start(NamedTuple):
    """A row of numbers."""

    first: float
    second: float


class Inner(NamedTuple):
    """Parts of parts."""

    rule: Callable[[float], float]


class Parts(NamedTuple):
    """A function, a class, a row of numbers and further parts."""

    rule: Callable[[float], float]
    row: Callable[..., Any]
    start: Start
    inner: Inner


OFFSET = 1.0


def twice(number: float) -> float:
    return 2.0 * number


def thrice(number: float) -> float:
    return 3.0 * number


def inner_rule(number: float, *, parts: Inner) -> float:
    return parts.rule(number) + OFFSET


def outer(number: float, *, parts: Parts) -> float:
    row = parts.row(parts.rule(number), parts.start.second)
    return float(row.first + row.second + inner_rule(number, parts=parts.inner))


def of_unknown_parts(number: float, given: Any) -> float:
    return inner_rule(number, parts=given)


PARTS = Parts(twice, Start, Start(0.0, 0.5), Inner(thrice))


def compiled(function: Any) -> Callable[..., Any]:
    """The function as the composed text has it, run by Python."""
    collector = SourceCollector("")
    name = collector.add(function)
    names: dict[str, Any] = {}
    exec(HEADER + collector.text(), names)
    return names[name]  # type: ignore[no-any-return]


def test_parts_are_handed_on_to_what_is_called_in_python_and_in_the_compiled_text() -> None:
    law = made_of(outer, "law", PARTS)
    # 2 * 2 + 0.5 of the row, 3 * 2 + 1 of the inner rule.
    assert law(2.0) == compiled(law)(2.0) == 11.5
    other = made_of(outer, "law", PARTS._replace(rule=thrice, inner=Inner(twice)))
    assert other(2.0) == compiled(other)(2.0) == 11.5 + 2.0 - 2.0
    assert other is not law


def test_equal_parts_give_the_same_function() -> None:
    assert made_of(outer, "law", Parts(*PARTS)) is made_of(outer, "law", PARTS)


def test_a_function_with_parts_sees_the_names_of_its_module_as_they_are_now(monkeypatch: pytest.MonkeyPatch) -> None:
    law = made_of(outer, "law", PARTS)
    monkeypatch.setattr(f"{__name__}.OFFSET", 10.0)
    assert law(2.0) == compiled(law)(2.0) == 20.5


def test_parts_that_are_known_only_while_the_function_runs_are_refused_by_their_line() -> None:
    with pytest.raises(ProgramError, match=r"test_parts\.py:\d+: 'parts=given' must be 'parts'"):
        compiled(of_unknown_parts)
