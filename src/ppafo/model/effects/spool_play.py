"""Backlash between command and spool, a hysteresis: the spool moves only after the command crosses the backlash."""

from typing import Annotated, NamedTuple

from ppafo.model.declaration import Number
from ppafo.model.effects.kind import Effect, PlantSnapshot, State
from ppafo.model.ports import at_valve
from ppafo.model.valves.kind import VENTS_ABOVE


class SpoolPlace(NamedTuple):
    """Command [-] that the spool follows after the backlash, -1 to 1; 0 at the start."""

    spool_command: float = 0.0


class SpoolPlay(NamedTuple):
    """Backlash [-] between command and spool."""

    width: Annotated[float, Number("", "full width of the play relative to full command, 0 for none", 0.0, 0.0, 0.5)]


def spool_position(position: float, command: float, play_width: float) -> float:
    """Spool position [-1, 1] for a command [-], with a backlash of the total width ``play_width`` [-].

    The inner side of the backlash, ``y``, moves with the command at its limits: ``y = max(c - b/2, min(c + b/2, y))``.
    The spool position is ``y / (1 - b/2)``, so that the spool reaches full opening.
    """
    half = 0.5 * play_width
    inner = position * (1.0 - half)
    # The play operator: the inside moves only as far as the command pushes it.
    inner = max(command - half, min(command + half, inner))
    return max(-1.0, min(1.0, inner / (1.0 - half)))


def command_behind_play(command: float, spool_play: SpoolPlay, spool_play_state: SpoolPlace) -> float:
    """Spool command [-] after backlash between command and spool. A venting command passes unchanged."""
    given = at_valve(command)
    drawn = spool_position(spool_play_state.spool_command, given, spool_play.width)
    return given if given > VENTS_ABOVE else drawn


def settle(_spool_play: SpoolPlay, spool_play_state: SpoolPlace, command: float) -> SpoolPlace:
    """Spool position after a change of the command [-]."""
    return SpoolPlace(spool_play_state.spool_command if command > VENTS_ABOVE else command)


def advance(
    spool_play: SpoolPlay, spool_play_state: SpoolPlace, _before: PlantSnapshot, after: PlantSnapshot, step: float
) -> SpoolPlace:
    """Spool position after a step [s] with a constant command; exact."""
    return settle(spool_play, spool_play_state, after.command)


def slopes(_spool_play: SpoolPlay, _spool_play_state: SpoolPlace, _now: PlantSnapshot) -> SpoolPlace:
    """Rate of the spool command [1/s], which is 0: the spool moves only when the command changes."""
    return SpoolPlace(0.0)


EFFECT = Effect(
    name="spool_play",
    summary="Play between command and spool of the valve.",
    settings=SpoolPlay,
    parameters=SpoolPlay,
    prepare=None,
    switch=("width",),
    laws={at_valve: command_behind_play},
    source="the play operator of hysteresis; the simulated test bench has it too",
    equation="y = max(c - b/2, min(c + b/2, y)), c' = y / (1 - b/2)",
    symbols=(
        ("b", "width", "-", "whole width of the play between command and spool"),
        ("c'", "spool_command", "-", "command that a spool with play follows"),
    ),
    state=State(row=SpoolPlace, start=None, advance=advance, slopes=slopes, settle=settle),
)
