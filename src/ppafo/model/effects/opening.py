"""Opening of a valve as a table over its command, as of a spool over round holes; laws invert the table."""

from typing import Annotated, Any, NamedTuple

from ppafo.model.declaration import EmptyRow, Number, row_with
from ppafo.model.effects.kind import Effect
from ppafo.model.ports import at_valve, sent_command
from ppafo.model.valves.kind import VENTS_ABOVE

NODES = 12
"""Largest number of nodes between the ends of the table, (0, 0) and (1, 1)."""
SHARPNESS = 0.0078125
"""Opening [-] within which an inverted table passes the range of commands at which the valve stays closed."""


class OpeningPiece(NamedTuple):
    """Straight piece of the table from one node to the next, of no width behind an unused node.

    Attributes:
        start, end: sizes of the command [-]
        rate: change of the opening over that of the command [-]
        closed, opened: openings at both ends [-]
        widening: change of the command over that of the opening [-], 0 where the opening stays
        flat: change of the command [-] where the opening stays below full opening, else 0
    """

    start: float
    end: float
    rate: float
    closed: float
    opened: float
    widening: float
    flat: float


class OpeningTable(NamedTuple):
    """Pieces from (0, 0) to (1, 1), in the order of their commands; the opening nowhere falls.

    ``edge`` is the size of the command [-] up to which the valve stays closed.
    """

    edge: float
    pieces: Annotated[tuple[OpeningPiece, ...], NODES + 1]


# Sums over all pieces, each of which adds what lies within it: a search for the piece would take several times as long.


def opening_of_size(size: float, table: OpeningTable) -> float:
    """Opening [-] for the size of a command from 0 to 1 [-], on the straight line between two nodes."""
    opening = 0.0
    for piece in table.pieces:
        opening = opening + piece.rate * (max(piece.start, min(size, piece.end)) - piece.start)
    return opening


def size_of_opening(opening: float, table: OpeningTable) -> float:
    """Size of the command [-] for an opening from 0 to 1 [-]; where the table is flat, the far end of the flat."""
    size = 0.0
    for piece in table.pieces:
        within = max(piece.closed, min(opening, piece.opened)) - piece.closed
        size = size + (piece.widening * within + (piece.flat if opening >= piece.closed else 0.0))
    return size


def opened(command: float, opening: OpeningTable) -> float:
    """Opening [-] that the table gives for the command at the valve [-], with its sign; ``VENT`` is passed on."""
    asked = at_valve(command)
    size = opening_of_size(min(abs(asked), 1.0), opening)
    found = size if asked >= 0.0 else -size
    return asked if asked > VENTS_ABOVE else found


def inverted(command: float, opening: OpeningTable) -> float:
    """Command [-] at which the table opens the valve as far as a law wants; ``VENT`` is passed on."""
    wanted = sent_command(command)
    size = min(abs(wanted), 1.0)
    # As beyond_dead_band: around 0 the command runs through the flat, and does not jump.
    found = size_of_opening(size, opening) - opening.edge * (1.0 - min(size / SHARPNESS, 1.0))
    signed = found if wanted >= 0.0 else -found
    return wanted if wanted > VENTS_ABOVE else signed


def piece_after(before: OpeningPiece, command: float, opening: float) -> OpeningPiece:
    """Piece up to a node of a command and an opening [-]; without width where the node is not ahead."""
    is_ahead = command > before.end
    end = command if is_ahead else before.end
    opened = opening if is_ahead else before.opened
    width = end - before.end
    rise = opened - before.opened
    return OpeningPiece(
        start=before.end,
        end=end,
        rate=rise / width if is_ahead else 0.0,
        closed=before.opened,
        opened=opened,
        widening=width / rise if rise > 0.0 else 0.0,
        flat=width if rise <= 0.0 and opened < 1.0 else 0.0,
    )


def prepare(settings: Any, _device: Any) -> OpeningTable:
    """Pieces of the table of the settings, and its edge."""
    to_00 = OpeningPiece(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    to_01 = piece_after(to_00, settings.command_01, settings.opening_01)
    to_02 = piece_after(to_01, settings.command_02, settings.opening_02)
    to_03 = piece_after(to_02, settings.command_03, settings.opening_03)
    to_04 = piece_after(to_03, settings.command_04, settings.opening_04)
    to_05 = piece_after(to_04, settings.command_05, settings.opening_05)
    to_06 = piece_after(to_05, settings.command_06, settings.opening_06)
    to_07 = piece_after(to_06, settings.command_07, settings.opening_07)
    to_08 = piece_after(to_07, settings.command_08, settings.opening_08)
    to_09 = piece_after(to_08, settings.command_09, settings.opening_09)
    to_10 = piece_after(to_09, settings.command_10, settings.opening_10)
    to_11 = piece_after(to_10, settings.command_11, settings.opening_11)
    to_12 = piece_after(to_11, settings.command_12, settings.opening_12)
    to_13 = piece_after(to_12, 1.0, 1.0)
    pieces = (to_01, to_02, to_03, to_04, to_05, to_06, to_07, to_08, to_09, to_10, to_11, to_12, to_13)
    edge = 0.0
    for piece in pieces:
        edge = edge + (piece.flat if piece.closed <= 0.0 else 0.0)
    return OpeningTable(edge, pieces)


def _numbers() -> dict[str, Any]:
    """Return the settings by name: command and opening of each node."""
    words = {"command": "command of node {}, above the one before, or 0", "opening": "opening at node {}"}
    return {
        f"{name}_{number:02}": Annotated[float, Number("", text.format(number), 0.0, 0.0, 1.0)]
        for number in range(1, NODES + 1)
        for name, text in words.items()
    }


EFFECT = Effect(
    name="opening",
    summary="Opening of the valve as a table over its command.",
    settings=row_with("OpeningSettings", EmptyRow, **_numbers()),
    parameters=OpeningTable,
    prepare=prepare,
    switch=("command_01",),
    laws={at_valve: opened, sent_command: inverted},
    source="flow over command of the valve's data sheet or of the bench",
    equation="o = o_k + (o_(k+1) - o_k) (u - u_k) / (u_(k+1) - u_k)",
    symbols=(
        ("u_k", "command", "-", "command of a node of the table of openings"),
        ("o_k", "opening", "-", "opening at this command"),
    ),
)
