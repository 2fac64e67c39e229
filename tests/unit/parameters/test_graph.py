"""Links between settings: which act, what they come to, and when they end."""

import numpy as np

from ppafo.parameters.graph import (
    Graph,
    Link,
    acting,
    follows,
    gauge_link,
    holding,
    left,
    resolved,
)

FIRST, SECOND, ROOM, START = (
    "supply.pressure",
    "supply.dorsiflexion_pressure",
    "supply.atmospheric_pressure",
    "initial.pressure_1",
)
GRAPH: Graph = {
    FIRST: (follows(ROOM, 3.0),),
    SECOND: (follows(FIRST, when_set=True), follows(ROOM, 3.0)),
    START: (follows(SECOND),),
}
NOW = {ROOM: 1.0, FIRST: 4.0, SECOND: 4.0, START: 4.0}


def test_what_is_given_moves_what_follows_it_and_what_follows_that() -> None:
    assert resolved(GRAPH, {FIRST: 6.0}, NOW) == {FIRST: 6.0, SECOND: 6.0, START: 6.0}
    assert resolved(GRAPH, {ROOM: 2.0}, NOW) == {ROOM: 2.0, FIRST: 5.0, SECOND: 5.0, START: 5.0}


def test_what_is_given_itself_follows_nothing() -> None:
    assert resolved(GRAPH, {FIRST: 6.0, SECOND: 5.0}, NOW) == {FIRST: 6.0, SECOND: 5.0, START: 5.0}


def test_a_number_that_is_merely_equal_follows_only_what_is_given_itself() -> None:
    apart = {**NOW, SECOND: 4.0 + 1e-9}
    assert resolved(GRAPH, {ROOM: 2.0, FIRST: 9.0}, apart)[SECOND] == 9.0
    assert acting(GRAPH, {ROOM})[SECOND] == follows(ROOM, 3.0)


def test_columns_are_resolved_run_by_run() -> None:
    rooms = np.array([1.0, 2.0])
    assert resolved(GRAPH, {ROOM: rooms}, NOW)[START].tolist() == [4.0, 5.0]


def test_links_of_what_was_replaced_end() -> None:
    assert left(GRAPH, {SECOND}) == {FIRST: GRAPH[FIRST], START: GRAPH[START]}
    assert left(GRAPH, {FIRST})[SECOND] == (follows(FIRST, when_set=True),)


def test_a_link_holds_while_it_gives_the_number() -> None:
    assert holding(GRAPH, NOW) == GRAPH
    changed = {**NOW, FIRST: 5.0}
    assert holding(GRAPH, changed) == {SECOND: (follows(ROOM, 3.0),), START: GRAPH[START]}


def test_a_gauge_pressure_of_supply_and_start_counts_from_the_atmosphere_and_no_other_does() -> None:
    assert gauge_link(FIRST, 2.0, "bar_g") == (follows(ROOM, 2.0e5),)
    assert gauge_link(FIRST, 2.0, "bar_a") == gauge_link("controller.filled_pressure", 2.0, "bar_g") == ()


def test_a_default_is_a_product_or_a_function_of_other_numbers_plus_a_gap() -> None:
    numbers = {"a": 2.0, "b": np.array([3.0, 4.0])}
    assert Link(("a", "a", "b"), gap=0.5, factor=10.0).number(numbers.__getitem__).tolist() == [120.5, 160.5]
    assert Link(("a", "b"), lambda a, b: b if a < b else a).number(numbers.__getitem__).tolist() == [3.0, 4.0]
