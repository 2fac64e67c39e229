"""Overrides of a scenario, independent of their order: each ``kind``, outer sections first, then numbers.

A value that a newly chosen component cannot use is an error that names both overrides. A document, or the overrides of
a file, is a layer below the caller's overrides: choosing another ``kind`` drops the lower layer's settings of the old.
"""

import copy
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ppafo.errors import ScenarioError
from ppafo.model.catalog import EFFECTS, VALVES
from ppafo.model.declaration import Quantity
from ppafo.model.effects.kind import SECTION as EFFECTS_SECTION
from ppafo.parameters.declaration import ORIFICE, RELIEVING_PATH, SECTIONS, SPECIES_PATH
from ppafo.parameters.declaration import quantities as device_quantities
from ppafo.parameters.overrides import Override, check_valve, layered, of_another_valve, other_forms, override_set
from ppafo.simulation.declaration import OF_A_VANE, DeclaredContent
from ppafo.simulation.document import value_at
from ppafo.units import SI
from ppafo.wording import nearest_name, number_text

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
"""Number without a unit."""
_SEED, _VALVE = "sensors.seed", "device.valve"
_OF_ANY_KIND = {"controller": frozenset({"kind", "rate", "period"})}
"""Keys that a section has for every value of ``kind``."""
_KIND = "kind"
"""Key of a section that names its component, such as a controller, and so decides the section's other keys."""


@dataclass(frozen=True, slots=True)
class OverriddenDocument:
    """Document with its own overrides applied at ``paths``, and the overrides of the device, not yet applied.

    ``kept`` is a sentence on the numbers of the document that a newly chosen ``kind`` keeps, else "".
    """

    document: dict[str, Any]
    paths: frozenset[str]
    device: tuple[Override, ...]
    kept: str


def override_document(
    document: Mapping[str, Any], overrides: Iterable[Override], file: str, declared: DeclaredContent = OF_A_VANE
) -> OverriddenDocument:
    """Return a changed copy of a document; ``file`` is the document's name in messages.

    Naming another kind of motion, controller or profile drops the settings of the document that only the old
    kind has; giving a rate drops its period, and vice versa. A gain on the torque, or one of 0, may omit its unit.
    Raises ScenarioError for a path that is neither ``declared`` nor of the device, and for an override that another one
    makes useless.
    """
    override_at = override_set(overrides, ScenarioError, declared.same)
    if _VALVE in override_at:
        valve = override_at[_VALVE]
        check_valve(override_at.values(), valve.text, f"override '{valve}'", ScenarioError)
    changed = _with_preferred_paths(document, file, declared)
    device_overrides = {
        path: override for path, override in override_at.items() if path not in declared.appended and is_of_device(path)
    }
    scenario_overrides = {path: override for path, override in override_at.items() if path not in device_overrides}
    remaining = _choose_kinds(changed, scenario_overrides, file, declared)
    known = declared.paths(changed) if scenario_overrides else ()
    for path in sorted(scenario_overrides):
        if path in known:
            continue
        # Where a kind is unknown too, that is the mistake.
        declared.find_kinds(changed, file)
        override = scenario_overrides[path]
        deciding = deciding_kinds(path, filter(_is_kind_path, scenario_overrides))
        if not deciding:
            raise unknown_value(override, (*known, *declared.same), f"{file} has")
        section = f"{deciding[-1].rpartition('.')[0]}."
        names = [name for name in (*known, *declared.same) if name.startswith(section)]
        hint = nearest_name(path, names) or f"; available: {', '.join(names)}"
        raise ScenarioError(
            f"override '{override}': {file} has no value '{path}' after override "
            f"'{scenario_overrides[deciding[-1]]}'{hint}"
        )
    for path in remaining:
        if path in declared.appended:
            section, path_in_section = declared.appended[path]
            texts = changed.setdefault(section, {}).setdefault("overrides", [])
            texts.append(f"{path_in_section}={scenario_overrides[path].text}")
        else:
            _set(changed, path, scenario_overrides[path].text, file, declared)
    kept = _kept_text(document, changed, scenario_overrides, declared)
    return OverriddenDocument(changed, frozenset(scenario_overrides), tuple(device_overrides.values()), kept)


def _kept_text(
    before: Mapping[str, Any],
    changed: Mapping[str, Any],
    override_at: Mapping[str, Override],
    declared: DeclaredContent,
) -> str:
    """Return a sentence on the numbers that sections keep although another ``kind`` is chosen for them."""
    old_kinds = {path: value_at(before, path) for path in filter(_is_kind_path, override_at)}
    of_old = declared.quantities(before) if old_kinds else {}
    kept: dict[str, list[str]] = {}
    for path, quantity in declared.quantities(changed).items() if old_kinds else ():
        deciding, value = deciding_kinds(path, old_kinds)[-1:], value_at(changed, path)
        if (
            not deciding
            or value is None
            or path in override_at
            or path.rpartition(".")[2] in _OF_ANY_KIND["controller"]
        ):
            continue
        old, new = old_kinds[deciding[0]], override_at[deciding[0]].text
        if old not in (None, new):
            # The meaning is news where both kinds do not have the same one.
            meaning = "" if path in of_old and of_old[path].summary == quantity.summary else f" ({quantity.summary})"
            kept.setdefault(f"kept from {old} for {new}", []).append(f"{path}={value}{meaning}")
    return "; ".join(f"{lead}: {', '.join(numbers)}" for lead, numbers in kept.items())


def over_layer(
    content: Mapping[str, Any],
    earlier: Sequence[Override],
    later: Sequence[Override],
    file: str,
    declared: DeclaredContent,
    valve: str = "",
) -> tuple[Override, ...]:
    """Merge two layers of overrides: a later one replaces earlier ones of the same path, orifice form or ``kind``.

    ``valve`` is the name of the valve in use unless the later overrides choose another.
    """
    for override in later:
        if override.typed == _VALVE:
            valve = override.text
            earlier = [old for old in earlier if not of_another_valve(old.typed, valve)]
    combined = layered(earlier, later, ScenarioError, declared.same, valve)
    later_paths = {path for path, override in combined.items() if override in later}
    kind_paths = set(filter(_is_kind_path, later_paths))
    if not kind_paths:
        return tuple(combined.values())
    before, changed = (_with_preferred_paths(content, file, declared) for _ in range(2))
    _choose_kinds(before, override_set(earlier, ScenarioError, declared.same), file, declared)
    _choose_kinds(changed, combined, file, declared)
    others = _of_other_units(declared.quantities(before), declared.quantities(changed))
    known = later_paths.union(declared.paths(changed)) - (others - later_paths)
    return tuple(
        override for path, override in combined.items() if path in known or not deciding_kinds(path, kind_paths)
    )


def _of_other_units(before: Mapping[str, Quantity], after: Mapping[str, Quantity]) -> set[str]:
    """Return the paths that name quantities of different units before and after a change of a ``kind``."""
    return {path for path in before.keys() & after.keys() if before[path].unit != after[path].unit}


def _is_kind_path(path: str) -> bool:
    section, _, name = path.rpartition(".")
    return bool(section) and name == _KIND


def deciding_kinds(path: str, kind_paths: Iterable[str]) -> list[str]:
    """Return the paths of the ``kind`` values that decide whether a path exists, the innermost last."""
    deciding = [
        kind_path
        for kind_path in kind_paths
        if kind_path != path and path.startswith(f"{kind_path.rpartition('.')[0]}.")
    ]
    return sorted(deciding, key=len)


def _choose_kinds(
    document: dict[str, Any], override_at: Mapping[str, Override], file: str, declared: DeclaredContent
) -> tuple[str, ...]:
    """Set the overridden ``kind`` of each section, outer sections first, and return the remaining paths.

    The ``kind`` of a missing section is among the remaining paths.
    """
    # A kind of an outer section decides which sections there are inside it.
    kind_paths = sorted(filter(_is_kind_path, override_at), key=lambda path: (path.count("."), path))
    done = set()
    for path in kind_paths:
        if path in declared.paths(document):
            if path == "motion.kind":
                declared.check_motion(override_at[path].text, f"override '{override_at[path]}'")
            _set(document, path, override_at[path].text, file, declared)
            done.add(path)
    return tuple(path for path in sorted(override_at) if path not in done)


def _with_preferred_paths(document: Mapping[str, Any], file: str, declared: DeclaredContent) -> dict[str, Any]:
    """Return a copy of a document in which each value is at its preferred path."""
    changed = copy.deepcopy(dict(document))
    for path, preferred in declared.same.items():
        section, _, name = path.rpartition(".")
        table = value_at(changed, section)
        if not isinstance(table, dict) or name not in table:
            continue
        if preferred in changed:
            raise ScenarioError(f"{file}: give either {path} or {preferred}, not both")
        changed[preferred] = table.pop(name)
    return changed


def device_paths() -> tuple[str, ...]:
    """Return every path of the device that an override can set, with ``valve`` for the selected valve."""
    sections = [path for path in device_quantities({}) if not path.startswith("reported.")]
    valve = [*ORIFICE, *(quantity for kind in VALVES.values() for quantity in kind.quantities)]
    return (*sections, SPECIES_PATH, RELIEVING_PATH, *(f"valve.{quantity.name}" for quantity in valve))


def is_of_device(path: str) -> bool:
    """Tell whether the first name of a path is a section of the device; the rest of the path is not checked."""
    return path.partition(".")[0] in {*SECTIONS, EFFECTS_SECTION, "valve", "valves"}


def unknown_value(override: Override, known: tuple[str, ...], owner: str) -> ScenarioError:
    """Return the error for an override of an unknown path; ``owner`` starts the message, such as ``task.toml has``."""
    EFFECTS.load_own()
    allowed = [*known, *device_paths()]
    section = override.typed.partition(".")[0]
    examples = [name for name in known if name.startswith(f"{section}.")] or known
    hint = nearest_name(override.typed, allowed) or f"; for example {', '.join(examples[:6])}"
    # No file has a torque sensor.
    source = "; the torque is computed from the measured pressures" * override.typed.startswith("sensors.torque")
    return ScenarioError(f"override '{override}': {owner} no value '{override.typed}'{hint}{source}")


def _set(document: dict[str, Any], path: str, text: str, file: str, declared: DeclaredContent) -> None:
    section, _, name = path.rpartition(".")
    table = document
    for part in section.split(".") if section else ():
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            raise ScenarioError(f"override '{path}={text}': {file} has no table [{section}]")
    if name == _KIND and table.get(_KIND) != text:
        # What both kinds have stays as the document gives it, unless it is another quantity by the same name.
        old_names, of_old = _setting_names(document, section, declared), declared.quantities(document)
        table[_KIND] = text
        new_names, of_new = _setting_names(document, section, declared), declared.quantities(document)
        others = _of_other_units(of_old, of_new)
        for name_of_old_kind in old_names - _OF_ANY_KIND.get(section, frozenset()):
            if name_of_old_kind not in new_names or f"{section}.{name_of_old_kind}" in others:
                table.pop(name_of_old_kind, None)
    # Area and conductance, rate and period: given in another form as well, a value would be there twice.
    for other in other_forms(path):
        table.pop(other.rpartition(".")[2], None)
    if path == _SEED:
        try:
            table[name] = int(number_text(text.removesuffix(SI).strip()))
        except ValueError as error:
            raise ScenarioError(f"override '{path}={text}': must be a whole number") from error
        return
    # Papers print gains on the torque without units, so one without gets its SI unit; 0 is the same in any unit.
    if path.startswith("controller.") and _NUMBER.fullmatch(text):
        quantity = declared.quantities(document).get(path)
        if quantity is not None and ("(N m" in quantity.unit or ("/" in quantity.unit and float(text) == 0.0)):
            text = f"{text} {quantity.unit}"
    table[name] = text


def _setting_names(document: dict[str, Any], section: str, declared: DeclaredContent) -> frozenset[str]:
    """Return the keys that a section can have in addition to ``kind``."""
    prefix = f"{section}."
    paths = [path.removeprefix(prefix) for path in declared.paths(document) if path.startswith(prefix)]
    return frozenset(path.partition(".")[0] for path in paths) - {"kind"}
