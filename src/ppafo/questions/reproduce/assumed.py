"""What the simulations rest on beside the paper: values that are assumed or derived, each with its reason."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ppafo.parameters import ParameterSet, load_parameter_set
from ppafo.parameters import apply_overrides as apply_to_set
from ppafo.parameters.overrides import SOURCE as OVERRIDE
from ppafo.parameters.parameter_set import number_text
from ppafo.parameters.provenance import Entry
from ppafo.simulation.declaration import quantities
from ppafo.simulation.overriding import apply_overrides
from ppafo.simulation.scenario import PrescribedMotion, Scenario

_NOT_OF_THE_PAPER = ("assumed", "derived")
_ONLY_FOR_A_FREE_VANE = frozenset({"actuator.restitution", "foot_plate.gravity_torque"})


@dataclass(frozen=True, slots=True)
class AssumedValue:
    """A value that the paper does not print as it is used: path, meaning, value with unit, reason, and who uses it.

    ``source`` is what the reason goes by, empty where the reason says it all.
    """

    path: str
    meaning: str
    value: str
    origin: str
    reason: str
    source: str
    used_by: tuple[str, ...]

    def sentence(self) -> str:
        """Return the value and its reason on one line."""
        return f"{self.path} = {self.value}: {self.reason}{f' ({self.source})' if self.source else ''}"


def assumed_values(scenarios: Mapping[str, Scenario]) -> tuple[AssumedValue, ...]:
    """Return what the scenarios rest on, by the name that a reader knows them by; the same value is listed once."""
    merged: dict[tuple[str, str, str], AssumedValue] = {}
    for name, scenario in scenarios.items():
        for value in _of_scenario(scenario, name):
            key = (value.path, value.value, value.reason)
            earlier = merged.get(key)
            merged[key] = value if earlier is None else replace(earlier, used_by=(*earlier.used_by, name))
    return tuple(merged.values())


def values_used_by(values: Sequence[AssumedValue], *names: str) -> tuple[AssumedValue, ...]:
    """Return the values that at least one of the named experiments uses."""
    return tuple(value for value in values if set(names) & set(value.used_by))


def _of_scenario(scenario: Scenario, name: str) -> list[AssumedValue]:
    """Return the scenario's own assumptions first; they take the place of the set's for the same value."""
    changed = apply_overrides(scenario.origin.content, scenario.origin.overrides, scenario.name)
    of_file = _set_of_file(scenario)
    in_force = apply_to_set(of_file, changed.device, scenario.origin.valve)
    summaries = {path: quantity.summary for path, quantity in quantities(changed.document).items()}
    summaries |= {path: quantity.summary for path, quantity in in_force.declarations().items()}
    own = [
        AssumedValue(item.path, summaries.get(item.path, ""), item.value, "assumed", item.note, "", (name,))
        for item in scenario.assumptions
    ]
    settled = {item.path for item in own} | _without_effect(scenario, in_force)
    from_set = [
        AssumedValue(path, summaries[path], number_text(entry), entry.origin, *_reason(entry), (name,))
        for path, entry in in_force.numbers.items()
        if path not in settled and entry.origin in _NOT_OF_THE_PAPER and not _is_of_file(of_file, path, entry)
    ]
    return [*own, *from_set]


def _set_of_file(scenario: Scenario) -> ParameterSet:
    """Return the set with what the scenario's file changes in it, which is the experiment's own and no assumption."""
    origin = scenario.origin
    written = origin.content["device"].get("overrides", ())
    return apply_to_set(load_parameter_set(origin.parameter_set), written, origin.valve)


def _is_of_file(of_file: ParameterSet, path: str, entry: Entry) -> bool:
    return entry.source == OVERRIDE and of_file.numbers.get(path) == entry


def _without_effect(scenario: Scenario, parameter_set: ParameterSet) -> set[str]:
    """Return the paths of the set that the run does not use."""
    reported = {path for path in parameter_set.numbers if path.startswith("reported.")}
    valve = f"valves.{scenario.origin.valve}."
    others = {path for path in parameter_set.numbers if path.startswith("valves.") and not path.startswith(valve)}
    return reported | others | (_ONLY_FOR_A_FREE_VANE if isinstance(scenario.motion, PrescribedMotion) else frozenset())


def _reason(entry: Entry) -> tuple[str, str]:
    """Return reason and source; what was set for this run says what it replaces."""
    return (f"set for this run; {entry.note}", "") if entry.source == OVERRIDE else (entry.note, entry.source)
