"""Effects in a composed program: whoever needs a row is handed it, laws act in a row, what cannot act is refused."""

from dataclasses import replace
from typing import Annotated, Any, NamedTuple

import pytest

from ppafo.engine import linking
from ppafo.engine.linking import link_effects, link_program
from ppafo.engine.source_text import Replacements, SourceCollector, composed_lines
from ppafo.errors import ProgramError
from ppafo.model.declaration import Number
from ppafo.model.effects.kind import Effect, effect_problem
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run


def place(amount: float) -> float:
    """What passes."""
    return amount


def between(amount: float) -> float:
    """A function that calls the place."""
    return 2.0 * place(amount)


def around(amount: float) -> float:
    """A function that calls one that does."""
    return between(amount) + 1.0


def apart(amount: float) -> float:
    """A function that does not."""
    return amount - 1.0


class Share(NamedTuple):
    """The setting."""

    share: Annotated[float, Number("", "share", 0.0, 0.0, 1.0)]


class Needed(NamedTuple):
    """A setting without a default."""

    share: Annotated[float, Number("", "share", None, 0.0, 1.0)]


class Half(NamedTuple):
    """A setting that is not off by default."""

    share: Annotated[float, Number("", "share", 0.5, 0.0, 1.0)]


class Row(NamedTuple):
    """One number."""

    share: float


def first_law(amount: float, first: Row) -> float:
    """A share, and more."""
    return first.share * place(amount)


def second_law(amount: float, second: Row) -> float:
    """More, of what the first leaves."""
    return place(amount) + second.share


def undoing_law(amount: float, second: Row) -> float:
    """Does not ask what was there before."""
    return second.share * amount


def prepared(settings: Any, device: Any) -> Row:
    """The row."""
    return Row(settings.share)


def hands_it_over(amount: float) -> float:
    """A function that gives another as a value."""
    return applied(between, amount)


def applied(function: Any, amount: float) -> float:
    """What a function makes of it."""
    return float(function(amount))


def hides_it(amount: float) -> float:
    """A local name of a row."""
    first = amount
    return between(first)


def calls_a_law(amount: float) -> float:
    """A law called past its place."""
    return first_law(amount, Row(0.5))


FIRST = Effect(
    name="first",
    summary="",
    settings=Share,
    parameters=Row,
    prepare=prepared,
    switch=("share",),
    laws={place: first_law},
)
SECOND = replace(FIRST, name="second", laws={place: second_law})


def collected(*effects: Effect) -> SourceCollector:
    """A collector with these effects."""
    collector = SourceCollector("")
    link_effects(effects, collector.replacements)
    return collector


def called(collector: SourceCollector, function: Any, rows: dict[str, Row], amount: float) -> float:
    """What a composed function returns."""
    name = collector.add(function)
    (line,) = composed_lines([f"found = {name}(amount)"], collector.needs)
    names: dict[str, Any] = {"amount": amount, **rows}
    exec("from collections import namedtuple\n" + collector.text() + "\n" + line, names)
    return float(names["found"])


def test_a_row_is_handed_on_by_whoever_needs_it_and_by_nobody_else() -> None:
    assert called(collected(FIRST), around, {"first": Row(0.25)}, 8.0) == 5.0
    plain, acting = SourceCollector(""), collected(FIRST)
    assert plain.add(apart) == acting.add(apart)
    assert plain.text() == acting.text()


def test_two_laws_of_a_place_act_in_the_order_of_their_effects() -> None:
    rows = {"first": Row(0.5), "second": Row(3.0)}
    assert called(collected(FIRST, SECOND), around, rows, 8.0) == 2.0 * (0.5 * 8.0 + 3.0) + 1.0
    assert called(collected(SECOND, FIRST), around, rows, 8.0) == 2.0 * (0.5 * (8.0 + 3.0)) + 1.0


def test_a_law_that_would_undo_another_is_refused() -> None:
    with pytest.raises(ProgramError) as caught:
        collected(FIRST, replace(SECOND, laws={place: undoing_law}))
    assert str(caught.value) == (
        "effects 'first' and 'second' both act on place, but undoing_law of 'second' does not call place, so effect "
        "'first' would be lost; call place in undoing_law, or switch one of the two effects off"
    )


@pytest.mark.parametrize(
    ("function", "said"),
    [
        (hands_it_over, "'between' contains an active effect, so it cannot be passed as a value"),
        (hides_it, "the local name 'first' hides the parameters of the effect 'first'; rename it"),
        (calls_a_law, "'first_law' is the law of an effect and cannot be called; call its port"),
    ],
)
def test_what_would_lose_a_row_is_refused(function: Any, said: str) -> None:
    with pytest.raises(ProgramError) as caught:
        collected(FIRST).add(function)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"name": "two words"}, "not a Python identifier"),
        ({"settings": Needed}, "'share' has no default"),
        ({"settings": Half}, "is on with its defaults"),
        ({"switch": ("other",)}, "switch names 'other', which must be a quantity with minimum 0"),
        ({"switch": ()}, "has no switch"),
        ({"laws": {place: apart, apart: hides_it}, "name": "third"}, ""),
        ({"laws": {place: applied}}, "applied(function, amount) must take the arguments of place: (amount)"),
    ],
)
def test_an_effect_that_cannot_act_says_why(change: dict[str, Any], said: str) -> None:
    problem = effect_problem(replace(FIRST, **change))
    assert said in problem
    assert bool(problem) == bool(said)


def sprung(driving: float, way: float, sliding: float, damping: float, angle: float, rate: float) -> float:
    """Equation (1) with a spring in it."""
    return driving - way * sliding - damping * rate - 2.0 * (angle - 1.0)


def test_a_spring_in_equation_1_is_refused_with_the_place_where_friction_knows_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    program = plan_run(load_scenario("step-response")).program
    monkeypatch.setattr(linking, "net_torque", sprung)
    with pytest.raises(ProgramError, match=r"test_links\.py:\d+: sprung subtracts 1 N m at rest, .*load_torque"):
        link_program(program, Replacements())
