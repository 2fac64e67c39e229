"""Play of a spool behind its command, which makes a hysteresis: it moves only when the command has crossed the play."""

from typing import Annotated, NamedTuple

from ppafo.model.declaration import Number
from ppafo.model.effects.kind import Effect, PlantSnapshot, State
from ppafo.model.ports import at_valve
from ppafo.model.valves.kind import VENTS_ABOVE


class SpoolPlace(NamedTuple):
    """Command [-] that the spool follows, -1 to 1, which starts in its middle."""

    spool_command: float = 0.0


class SpoolPlay(NamedTuple):
    """Setting of the play [-] between command and spool."""

    width: Annotated[float, Number("", "whole width of the play over the full command, 0 for none", 0.0, 0.0, 0.5)]


def spool_position(position: float, command: float, play_width: float) -> float:
    """Position [-1, 1] to which a command [-] draws a spool with play of a whole ``play_width`` [-].

    The inside of the play, ``y``, is drawn along when the command leaves it: ``y = max(c - b/2, min(c + b/2, y))``.
    The spool comes to ``y / (1 - b/2)``, so that it reaches full opening.
    """
    half = 0.5 * play_width
    inner = position * (1.0 - half)
    # The play operator: the inside moves only as far as the command pushes it.
    inner = max(command - half, min(command + half, inner))
    return max(-1.0, min(1.0, inner / (1.0 - half)))


def command_behind_play(command: float, spool_play: SpoolPlay, spool_play_state: SpoolPlace) -> float:
    """Command [-] that a spool follows with play behind its command. A command that vents is no position."""
    given = at_valve(command)
    drawn = spool_position(spool_play_state.spool_command, given, spool_play.width)
    return given if given > VENTS_ABOVE else drawn


def settle(_spool_play: SpoolPlay, spool_play_state: SpoolPlace, command: float) -> SpoolPlace:
    """The spool where the command [-] that it follows has drawn it."""
    return SpoolPlace(spool_play_state.spool_command if command > VENTS_ABOVE else command)


def advance(
    spool_play: SpoolPlay, spool_play_state: SpoolPlace, _before: PlantSnapshot, after: PlantSnapshot, step: float
) -> SpoolPlace:
    """The spool after a step [s], in which its command stays what it is; exact."""
    return settle(spool_play, spool_play_state, after.command)


def slopes(_spool_play: SpoolPlay, _spool_play_state: SpoolPlace, _now: PlantSnapshot) -> SpoolPlace:
    """Rate [1/s] of the spool in its play: none, for it moves with the command alone."""
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
