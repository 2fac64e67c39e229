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


class OpeningNode(NamedTuple):
    """Node of the table: size of the command [-] and of the opening [-]; a command of 0 for an unused node."""

    command: float
    opening: float


class OpeningTable(NamedTuple):
    """Nodes between (0, 0) and (1, 1), in the order of their commands; the opening nowhere falls."""

    nodes: Annotated[tuple[OpeningNode, ...], NODES]


def opening_of_size(size: float, table: OpeningTable) -> float:
    """Opening [-] for the size of a command from 0 to 1 [-], on the straight line between two nodes."""
    lower, upper = OpeningNode(0.0, 0.0), OpeningNode(1.0, 1.0)
    for node in table.nodes:
        lower = node if node.command <= size and node.command > lower.command else lower
        upper = node if node.command > size and node.command < upper.command else upper
    rate = (upper.opening - lower.opening) / (upper.command - lower.command)
    return lower.opening + rate * (size - lower.command)


def size_of_opening(opening: float, table: OpeningTable) -> float:
    """Size of the command [-] for an opening from 0 to 1 [-]; where the table is flat, the far end of the flat."""
    lower, upper = OpeningNode(0.0, 0.0), OpeningNode(1.0, 1.0)
    for node in table.nodes:
        is_used = node.command > lower.command
        lower = node if is_used and node.opening <= opening and node.opening < 1.0 else lower
        upper = node if node.opening > opening and node.command < upper.command else upper
    rate = (upper.command - lower.command) / max(upper.opening - lower.opening, 1.0e-12)
    return lower.command + rate * (min(opening, 1.0) - lower.opening)


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
    edge = size_of_opening(0.0, opening)
    found = size_of_opening(size, opening) - edge * (1.0 - min(size / SHARPNESS, 1.0))
    signed = found if wanted >= 0.0 else -found
    return wanted if wanted > VENTS_ABOVE else signed


def prepare(settings: Any, _device: Any) -> OpeningTable:
    """Table of the settings, which are numbers of their own."""
    return OpeningTable(
        (
            OpeningNode(settings.command_01, settings.opening_01),
            OpeningNode(settings.command_02, settings.opening_02),
            OpeningNode(settings.command_03, settings.opening_03),
            OpeningNode(settings.command_04, settings.opening_04),
            OpeningNode(settings.command_05, settings.opening_05),
            OpeningNode(settings.command_06, settings.opening_06),
            OpeningNode(settings.command_07, settings.opening_07),
            OpeningNode(settings.command_08, settings.opening_08),
            OpeningNode(settings.command_09, settings.opening_09),
            OpeningNode(settings.command_10, settings.opening_10),
            OpeningNode(settings.command_11, settings.opening_11),
            OpeningNode(settings.command_12, settings.opening_12),
        )
    )


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
