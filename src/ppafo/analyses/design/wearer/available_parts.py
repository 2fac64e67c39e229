"""Parts available for a wearer's device: the user's catalogue, completed by the catalogue of the package."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ppafo.analyses.design.wearer.requirements import WALKS
from ppafo.errors import StudyError
from ppafo.parameters.parts import Part, load_catalogue
from ppafo.wording import argument_text


@dataclass(frozen=True, slots=True)
class AvailableParts:
    """Parts available for the device of a wearer.

    ``groups``: parts by group and name
    ``own_groups``: groups that come from the user's catalogue
    ``file``: file of the user's catalogue, empty without one
    ``chosen_bottle``: name of the bottle that the user chose, empty for the bottles of the catalogue
    """

    groups: Mapping[str, Mapping[str, Part]]
    own_groups: frozenset[str]
    file: str
    chosen_bottle: str = ""

    @property
    def bottles(self) -> list[Part]:
        """Available bottles, the lightest first."""
        return sorted(self.groups["bottles"].values(), key=lambda bottle: bottle.full_mass)

    def part(self, group: str, usual: str) -> Part:
        """Return the part named ``usual`` of a group, else the lightest of the user's own parts."""
        parts = self.groups[group]
        return parts[usual] if usual in parts else min(parts.values(), key=lambda part: part.full_mass)

    def bottle_name(self, bottle: Part) -> str:
        """Return the argument of ``--bottle`` for a bottle."""
        if self.chosen_bottle:
            return self.chosen_bottle
        return f"{self.file}/{bottle.name}" if "bottles" in self.own_groups else bottle.name


def shelf_of(catalogue: str | Path) -> AvailableParts:
    """Return the parts of a catalogue, by name or file; missing groups are taken from the package's catalogue.

    Raises ParameterError if the catalogue cannot be read, StudyError if no walk is known for its valves.
    """
    user_groups, package_groups = load_catalogue(catalogue).groups, load_catalogue().groups
    groups = {group: user_groups[group] or parts for group, parts in package_groups.items()}
    groups["valves"] = {name: part for name, part in groups["valves"].items() if part.kind in WALKS}
    if not groups["valves"]:
        raise StudyError(
            f"{argument_text('catalogue', str(catalogue))}: has no valve that can be used in a walk; supported kinds: "
            f"{', '.join(WALKS)}"
        )
    is_own = Path(catalogue).suffix == ".toml"
    return AvailableParts(
        groups, frozenset(name for name in user_groups if user_groups[name] and is_own), str(catalogue)
    )
