"""Who walks in the league: every walking controller of the catalogue, each on the valves that suit it.

A controller that is new in the catalogue enters by itself, on the proportional valve; only another valve takes a line.
"""

from dataclasses import dataclass

from ppafo.control.walking.catalog import WALKING_CONTROLLERS

VALVES = {
    "event_on_off": ("solenoid", "proportional"),
    "event_on_off_dead_zone": ("solenoid", "proportional"),
}
"""Valves of the laws that a solenoid pair can follow: it tells nothing of a command but its sign."""
FOUND = "defaults of the catalogue"


@dataclass(frozen=True, slots=True)
class WalkingEntrant:
    """A controller on a valve, with the settings that the catalogue gives it."""

    name: str
    kind: str
    valve: str

    @property
    def found(self) -> str:
        """How its gains were found."""
        return FOUND

    @property
    def source(self) -> str:
        """Where the law comes from."""
        return WALKING_CONTROLLERS[self.kind].source


def _entrants() -> tuple[WalkingEntrant, ...]:
    found = []
    for kind in WALKING_CONTROLLERS:
        for valve in VALVES.get(kind, ("proportional",)):
            name = kind if valve == "proportional" else f"{kind}-{valve}"
            found.append(WalkingEntrant(name, kind, valve))
    return tuple(found)


WALKING_ENTRANTS = _entrants()
"""In the order of the catalogue; tables sort."""
