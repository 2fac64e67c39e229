"""Parts that a device for a wearer may be built of: a catalogue of one's own, filled up with the package's."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ppafo.analyses.design.wearer.requirements import WALKS
from ppafo.errors import StudyError
from ppafo.parameters.parts import Part, load_catalogue
from ppafo.parameters.parts.catalogue import rated_pressure


@dataclass(frozen=True, slots=True)
class AvailableParts:
    """Parts available for a device, by group, the user's catalogue file, if any, and the name of a chosen bottle."""

    groups: Mapping[str, Mapping[str, Part]]
    own_groups: frozenset[str]
    file: str
    chosen_bottle: str = ""

    @property
    def bottles(self) -> list[Part]:
        """The bottles, lightest first."""
        return sorted(self.groups["bottles"].values(), key=lambda bottle: bottle.full_mass)

    def part(self, group: str, usual: str) -> Part:
        """Return the part of a group that is usual, else the lightest of one's own."""
        parts = self.groups[group]
        return parts[usual] if usual in parts else min(parts.values(), key=lambda part: part.full_mass)

    def bottle_name(self, bottle: Part) -> str:
        """Return what ``--bottle`` takes for a bottle."""
        if self.chosen_bottle:
            return self.chosen_bottle
        return f"{self.file}/{bottle.name}" if "bottles" in self.own_groups else bottle.name

    def pairs(self, pressure: float) -> list[tuple[Part, Part]]:
        """Return every valve with every actuator that may have a supply pressure [Pa absolute].

        A part without a largest pressure in the catalogue is not left out.
        """
        return [
            (valve, actuator)
            for valve in self.groups["valves"].values()
            for actuator in self.groups["actuators"].values()
            if rated_pressure(valve, actuator) >= pressure
        ]


def shelf_of(catalogue: str | Path) -> AvailableParts:
    """Return the parts of a catalogue, by name or file; what it has no group of is the package's.

    ParameterError where it cannot be read, StudyError where its valves have no walk.
    """
    own, usual = load_catalogue(catalogue).groups, load_catalogue().groups
    groups = {group: own[group] or parts for group, parts in usual.items()}
    groups["valves"] = {name: part for name, part in groups["valves"].items() if part.kind in WALKS}
    if not groups["valves"]:
        raise StudyError(f"--catalogue {catalogue}: no valve is of a kind that walks: {', '.join(WALKS)}")
    is_own = Path(catalogue).suffix == ".toml"
    return AvailableParts(groups, frozenset(name for name in own if own[name] and is_own), str(catalogue))
