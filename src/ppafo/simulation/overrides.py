"""Overrides of a scenario as a set: kinds first, outer ones before inner ones, then numbers; order is irrelevant.

A value that a newly chosen kind cannot use is an error that names both overrides. A document, or the overrides of a
file, is a layer below the caller's overrides: choosing another kind drops the lower layer's settings of the old kind.
"""

import copy
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ppafo.errors import ScenarioError
from ppafo.model.catalog import EFFECTS, VALVES
from ppafo.model.effects.kind import SECTION as EFFECTS_SECTION
from ppafo.parameters.declaration import ORIFICE, RELIEVING_PATH, SECTIONS, SPECIES_PATH
from ppafo.parameters.declaration import quantities as device_quantities
from ppafo.parameters.overrides import Override, check_valve, layered, of_another_valve, other_forms, override_set
from ppafo.simulation.declaration import OF_A_VANE, DeclaredContent
from ppafo.simulation.document import value_at
from ppafo.units import SI, number_text
from ppafo.wording import nearest_name

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_SEED, _VALVE = "sensors.seed", "device.valve"
_OF_ANY_KIND = {"controller": frozenset({"kind", "rate", "period"})}
_KIND = "kind"
"""Last name of the paths of kinds, which decide the other values of their section."""


@dataclass(frozen=True, slots=True)
class OverriddenDocument:
    """Document with its own overrides applied at ``paths``, and the overrides of the device, not yet applied."""

    document: dict[str, Any]
    paths: frozenset[str]
    device: tuple[Override, ...]


def apply_overrides(
    document: Mapping[str, Any], overrides: Iterable[Override], file: str, declared: DeclaredContent = OF_A_VANE
) -> OverriddenDocument:
    """Return a changed copy of a document; ``file`` is the document's name in messages.

    Naming another kind of motion, controller, timing or profile drops the settings of the document that only the old
    kind has; giving a rate drops its period, and vice versa. A gain on the torque, or one of 0, may omit its unit.
    Raises ScenarioError for a path that is neither ``declared`` nor of the device, and for an override that another one
    makes useless.
    """
    overrides_of = override_set(overrides, ScenarioError, declared.same)
    if _VALVE in overrides_of:
        chosen = overrides_of[_VALVE]
        check_valve(overrides_of.values(), chosen.text, f"override '{chosen}'", ScenarioError)
    changed = _with_one_path_each(document, file, declared)
    of_device = {
        path: override
        for path, override in overrides_of.items()
        if path not in declared.appended and is_of_device(path)
    }
    own = {path: override for path, override in overrides_of.items() if path not in of_device}
    waiting = _choose_kinds(changed, own, file, declared)
    known = declared.paths(changed) if own else ()
    for path in sorted(own):
        if path not in known:
            # Where a kind is unknown too, that is the mistake.
            declared.find_kinds(changed, file)
            raise _unused(path, own, (*known, *declared.same), file)
    for path in waiting:
        if path in declared.appended:
            section, inner = declared.appended[path]
            changed.setdefault(section, {}).setdefault("overrides", []).append(f"{inner}={own[path].text}")
        else:
            _set(changed, path, own[path].text, file, declared)
    return OverriddenDocument(changed, frozenset(own), tuple(of_device.values()))


def over_layer(
    content: Mapping[str, Any],
    earlier: Sequence[Override],
    later: Sequence[Override],
    file: str,
    declared: DeclaredContent,
    valve: str = "",
) -> tuple[Override, ...]:
    """Return two layers of overrides of a document as one set: later ones replace earlier ones by path, form and kind.

    ``valve`` is the name of the valve in use unless the later overrides choose another.
    """
    for override in later:
        if override.typed == _VALVE:
            valve = override.text
            earlier = [old for old in earlier if not of_another_valve(old.typed, valve)]
    every = layered(earlier, later, ScenarioError, declared.same, valve)
    new = {path for path, override in every.items() if override in later}
    choosing = set(filter(_is_choosing, new))
    if not choosing:
        return tuple(every.values())
    changed = _with_one_path_each(content, file, declared)
    _choose_kinds(changed, every, file, declared)
    known = new.union(declared.paths(changed))
    return tuple(override for path, override in every.items() if path in known or not chosen_by(path, choosing))


def _is_choosing(path: str) -> bool:
    section, _, name = path.rpartition(".")
    return bool(section) and name == _KIND


def chosen_by(path: str, choosing: Iterable[str]) -> list[str]:
    """Return the kind paths that decide whether a path exists, the innermost last."""
    found = []
    for chosen in choosing:
        own = f"{chosen.rpartition('.')[0]}."
        found += [chosen] if chosen != path and path.startswith(own) else []
    return sorted(found, key=len)


def _choose_kinds(
    document: dict[str, Any], overrides_of: Mapping[str, Override], file: str, declared: DeclaredContent
) -> tuple[str, ...]:
    """Set the given kinds, outer sections first, and return the remaining paths.

    A kind of a missing section is among the remaining paths.
    """
    # A kind of an outer section decides which sections there are inside it.
    first = sorted(filter(_is_choosing, overrides_of), key=lambda path: (path.count("."), path))
    done = set()
    for path in first:
        if path in declared.paths(document):
            if path == "motion.kind":
                declared.check_motion(overrides_of[path].text, f"override '{overrides_of[path]}'")
            _set(document, path, overrides_of[path].text, file, declared)
            done.add(path)
    return tuple(path for path in sorted(overrides_of) if path not in done)


def _unused(path: str, overrides_of: Mapping[str, Override], known: tuple[str, ...], file: str) -> ScenarioError:
    """Return the error for a useless override: incompatible with a given kind, or of an unknown path."""
    choosing = chosen_by(path, filter(_is_choosing, overrides_of))
    if not choosing:
        return unknown_value(overrides_of[path], known, f"{file} has")
    section = f"{choosing[-1].rpartition('.')[0]}."
    near = [known_path for known_path in known if known_path.startswith(section)]
    hint = nearest_name(path, near) or f"; there it has {', '.join(near)}"
    return ScenarioError(
        f"overrides '{overrides_of[path]}' and '{overrides_of[choosing[-1]]}': with the latter {file} has no value "
        f"'{path}'{hint}"
    )


def _with_one_path_each(document: Mapping[str, Any], file: str, declared: DeclaredContent) -> dict[str, Any]:
    """Return a copy of a document in which each value is at its preferred path."""
    changed = copy.deepcopy(dict(document))
    for path, kept in declared.same.items():
        section, _, name = path.rpartition(".")
        table = value_at(changed, section)
        if not isinstance(table, dict) or name not in table:
            continue
        if kept in changed:
            raise ScenarioError(f"{file}: give either {path} or {kept}, not both")
        changed[kept] = table.pop(name)
    return changed


def device_paths() -> tuple[str, ...]:
    """Return every path of the device that an override can set, with ``valve`` for the selected valve."""
    sections = [path for path in device_quantities({}) if not path.startswith("reported.")]
    valve = [*ORIFICE, *(quantity for kind in VALVES.values() for quantity in kind.quantities)]
    return (*sections, SPECIES_PATH, RELIEVING_PATH, *(f"valve.{quantity.name}" for quantity in valve))


def is_of_device(path: str) -> bool:
    """Tell whether a path starts in the device, which then checks the rest of the path."""
    return path.partition(".")[0] in {*SECTIONS, EFFECTS_SECTION, "valve", "valves"}


def unknown_value(override: Override, known: tuple[str, ...], who_has: str) -> ScenarioError:
    """Return the error for an unknown path; ``who_has`` is the start of its text, such as ``task.toml has``."""
    EFFECTS.load_own()
    allowed = [*known, *device_paths()]
    section = override.typed.partition(".")[0]
    near = [name for name in known if name.startswith(f"{section}.")]
    hint = nearest_name(override.typed, allowed) or f"; for example {', '.join(near[:6] or known[:6])}"
    return ScenarioError(f"override '{override}': {who_has} no value '{override.typed}'{hint}")


def _set(document: dict[str, Any], path: str, text: str, file: str, declared: DeclaredContent) -> None:
    section, _, name = path.rpartition(".")
    table = document
    for part in section.split(".") if section else ():
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            raise ScenarioError(f"override '{path}={text}': {file} has no table [{section}]")
    if name == _KIND and table.get(_KIND) != text:
        # What both kinds have stays as the document gives it.
        before = _setting_names(document, section, declared)
        table[_KIND] = text
        after = _setting_names(document, section, declared)
        for lost in before - after - _OF_ANY_KIND.get(section, frozenset()):
            table.pop(lost, None)
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
    quantity = declared.quantities(document).get(path)
    is_bare = quantity is not None and path.startswith("controller.") and _NUMBER.fullmatch(text)
    if quantity is not None and is_bare and ("(N m" in quantity.unit or ("/" in quantity.unit and float(text) == 0.0)):
        text = f"{text} {quantity.unit}"
    table[name] = text


def _setting_names(document: dict[str, Any], section: str, declared: DeclaredContent) -> frozenset[str]:
    """Return the keys that a section can have in addition to its kind."""
    prefix = f"{section}."
    paths = [path.removeprefix(prefix) for path in declared.paths(document) if path.startswith(prefix)]
    return frozenset(path.partition(".")[0] for path in paths) - {"kind"}
