"""What a program has beside valve and laws: its gas, the lines that feed it, and the leg that it is on.

A component says its rows and writes its own lines of a step; ``lane_step`` has their order. Formulas and lines of one
stand in one file of ``scheme``, which a run without it never loads. ``rows`` are the ``LaneRows`` of a program,
``gas`` is what the first stage of the chambers is called.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple


@dataclass(frozen=True, slots=True)
class RarePhase:
    """Lines of a phase that few lanes need at a time: those whose ``cell`` is above 0. It changes no other lane."""

    lines: list[str]
    cell: str


Phases = list[list[str] | RarePhase]


class Second(NamedTuple):
    """Expressions of the second stage of the gas, and of what a step changes, once ``second`` is known.

    Then of its error, and of the error of a valve that moves by ``shift``, over what is allowed [-].
    """

    stage: str
    change: str
    error: str
    shifted: str


@dataclass(frozen=True, slots=True, eq=False)
class GasScheme:
    """How the gas in both chambers goes through a step of two stages.

    ``loads`` are the groups that a step asks for from its begin on, ``stored`` has for groups of ``states`` what they
    are called at its end; ``start(plant, initial)`` makes the only group of states, None where there is none.
    ``begun(program)`` is the struct of the first stage, which the line ``begin(rows)`` makes as ``gas``; ``first`` are
    its rates, and the flows of the second stage belong to the pressures ``ends``. ``add`` makes ``fed``, the state with
    the gas of the step; ``move(rows, state, from, to)`` follows a vane that ends elsewhere than assumed, ``work``
    counts what the gas did on it.
    """

    parameters: Mapping[str, type]
    states: Mapping[str, type]
    start: Callable[..., Any] | None
    loads: tuple[str, ...]
    stored: Mapping[str, str]
    begun: Callable[[Any], type]
    change: type
    begin: Callable[[Any], str]
    ends: Callable[[Any, str], str]
    first: Callable[[Any, str], str]
    second: Callable[[Any, str], Second]
    add: Callable[[Any], str]
    move: Callable[[Any, str, str, str], list[str]]
    work: Callable[[Any], list[str]]


@dataclass(frozen=True, slots=True, eq=False)
class Feed:
    """What stands between constant pressures and the valve, with a state that the stages solve together with the gas.

    ``source(rows, state)`` is the plant at the pressures of a state. ``begin`` makes the first stage, in which
    ``chambers`` are the chambers of the gas and ``after_first`` is the state after it; ``end(rows)`` brings the state
    to the end of the step, ``error`` is what that misses. ``loads`` and ``stored`` are as in ``GasScheme``.
    """

    parameters: Mapping[str, type]
    states: Mapping[str, type]
    loads: tuple[str, ...]
    stored: Mapping[str, str]
    chambers: str
    after_first: str
    begun: Callable[[Any], type]
    source: Callable[[Any, str], str]
    begin: Callable[[Any], str]
    end: Callable[[Any], str]
    error: Callable[[Any], str]


@dataclass(frozen=True, slots=True, eq=False)
class LegScheme:
    """A leg that walks with the device, in a step.

    ``loads`` and ``stored`` are as in ``GasScheme``. ``led``, ``handed`` and ``ended`` are rows that phases hand on:
    before the gas, from the step before, at the end. ``find`` makes what a step is handed by the one before, ``lead``
    are phases before the gas, ``assume`` where the gas takes the vane to be, ``reach`` phases that find where the
    step ends, ``end`` the state after it. One that ``fails`` has faults of the plant, and a shut-off valve.
    """

    takes_task_sequence: bool
    parameters: Mapping[str, type]
    states: Mapping[str, type]
    loads: tuple[str, ...]
    stored: Mapping[str, str]
    begun: type
    led: Mapping[str, type]
    handed: Mapping[str, type]
    ended: Mapping[str, type]
    find: Callable[[Any], list[str]]
    lead: Callable[[Any], Phases]
    assume: Callable[[Any], list[str]]
    reach: Callable[[Any, str], Phases]
    end: Callable[[Any], list[str]]
    fails: bool = False
