"""Overrides of a scenario, independent of their order: each ``kind``, outer sections first, then numbers.

A value that a newly chosen component cannot use is an error that names both overrides. A document, or the overrides of
a file, is a layer below the caller's overrides: choosing another ``kind`` drops the lower layer's settings of the old.
"""

import copy
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from ppafo.errors import Faults, KindError, ScenarioError, refused_as
from ppafo.model.catalog import EFFECTS, VALVES
from ppafo.model.declaration import Quantity
from ppafo.model.effects.kind import SECTION as EFFECTS_SECTION
from ppafo.parameters.declaration import ORIFICE, RELIEVING_PATH, SECTIONS, SPECIES_PATH
from ppafo.parameters.declaration import quantities as device_quantities
from ppafo.parameters.declared import KIND, Content, quantities_in, value_at
from ppafo.parameters.overrides import Override, check_valve, layered, of_another_valve, other_forms, override_set
from ppafo.simulation.declaration import OF_A_VANE
from ppafo.simulation.document import DocumentReader
from ppafo.units import SI
from ppafo.wording import nearest_name, number_text

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
"""Number without a unit."""
_VALVE = "device.valve"
_SAMPLING = ("rate", "period")
"""Keys of a controller for every value of ``kind``."""


def override_document(request: DocumentReader, content: Content = OF_A_VANE) -> DocumentReader:
    """Return a document with its overrides applied.

    Naming another kind of motion, controller or profile drops the settings of the document that only the old
    kind has; giving a rate drops its period, and vice versa. A gain on the torque, or one of 0, may omit its unit.
    A path that is neither declared nor of the device is among what is ``wrong``. Raises ScenarioError for an override
    that another one makes useless.
    """
    document = request.document
    file = request.file
    override_at = override_set(request.overrides, ScenarioError, content.same)
    if _VALVE in override_at:
        valve = override_at[_VALVE]
        check_valve(override_at.values(), valve.text, f"override '{valve}'", ScenarioError)
    changed = _with_preferred_paths(document, file, content)
    of_device = {
        path: item for path, item in override_at.items() if path not in content.appended and is_of_device(path)
    }
    own = {path: override for path, override in override_at.items() if path not in of_device}
    remaining = _choose_kinds(changed, own, file, content)
    known = content.paths(changed) if own else ()
    wrong = Faults()
    for path in (path for path in own if path not in known):
        # A newly chosen kind may have made it unknown.
        deciding = deciding_kinds(path, filter(_is_kind_path, own))
        after = f" after override '{own[deciding[-1]]}'" if deciding else ""
        wrong.append(unknown_value(own[path], (*known, *content.same), f"{file}{after} has"))
    for path in remaining:
        if path not in known:
            continue
        if path in content.appended:
            section, path_in_section = content.appended[path]
            changed.setdefault(section, {}).setdefault("overrides", []).append(f"{path_in_section}={own[path].text}")
        else:
            with wrong:
                _set(changed, path, own[path].text, file, content)
    # What sections keep although another kind is chosen for them.
    old_kinds = {path: value_at(document, path) for path in filter(_is_kind_path, own)}
    of_old, of_new = (quantities_in(content.declare(each)) if old_kinds else {} for each in (document, changed))
    kept: dict[str, list[str]] = {}
    for path, quantity in of_new.items():
        deciding = deciding_kinds(path, old_kinds)[-1:]
        value = value_at(changed, path)
        if not deciding or value is None or path in own or path.rpartition(".")[2] in _SAMPLING:
            continue
        old = old_kinds[deciding[0]]
        new = own[deciding[0]].text
        if old not in (None, new):
            # The meaning is news where both kinds do not have the same one.
            meaning = "" if path in of_old and of_old[path].summary == quantity.summary else f" ({quantity.summary})"
            kept.setdefault(f"kept from {old} for {new}", []).append(f"{path}={value}{meaning}")
    return replace(
        request,
        document=changed,
        content=document,
        overridden=frozenset(own),
        device=tuple(of_device.values()),
        kept="; ".join(f"{lead}: {', '.join(numbers)}" for lead, numbers in kept.items()),
        wrong=tuple(wrong),
    )


def over_layer(
    document: Mapping[str, Any],
    earlier: Sequence[Override],
    later: Sequence[Override],
    file: str,
    content: Content,
    valve: str = "",
) -> tuple[Override, ...]:
    """Merge two layers of overrides: a later one replaces earlier ones of the same path, orifice form or ``kind``.

    ``valve`` is the name of the valve in use unless the later overrides choose another.
    """
    for override in later:
        if override.typed == _VALVE:
            valve = override.text
            earlier = [old for old in earlier if not of_another_valve(old.typed, valve)]
    combined = layered(earlier, later, ScenarioError, content.same, valve)
    later_paths = {path for path, override in combined.items() if override in later}
    kind_paths = set(filter(_is_kind_path, later_paths))
    if not kind_paths:
        return tuple(combined.values())
    before, changed = (_with_preferred_paths(document, file, content) for _ in range(2))
    _choose_kinds(before, override_set(earlier, ScenarioError, content.same), file, content)
    _choose_kinds(changed, combined, file, content)
    others = _of_other_units(*(quantities_in(content.declare(each)) for each in (before, changed)))
    known = later_paths.union(content.paths(changed)) - (others - later_paths)
    return tuple(
        override for path, override in combined.items() if path in known or not deciding_kinds(path, kind_paths)
    )


def _of_other_units(before: Mapping[str, Quantity], after: Mapping[str, Quantity]) -> set[str]:
    """Return the paths that name quantities of different units before and after a change of a ``kind``."""
    return {path for path in before.keys() & after.keys() if before[path].unit != after[path].unit}


def _is_kind_path(path: str) -> bool:
    section, _, name = path.rpartition(".")
    return bool(section) and name == KIND


def deciding_kinds(path: str, kind_paths: Iterable[str]) -> list[str]:
    """Return the paths of the ``kind`` values that decide whether a path exists, the innermost last."""
    deciding = [
        kind_path
        for kind_path in kind_paths
        if kind_path != path and path.startswith(f"{kind_path.rpartition('.')[0]}.")
    ]
    return sorted(deciding, key=len)


def _choose_kinds(
    document: dict[str, Any], override_at: Mapping[str, Override], file: str, content: Content
) -> tuple[str, ...]:
    """Set the overridden ``kind`` of each section, outer sections first, and return the remaining paths.

    What both kinds have in one unit stays as the document gives it. The ``kind`` of a missing section remains.
    """
    done = set()
    # A kind of an outer section decides which sections there are inside it.
    for path in sorted(filter(_is_kind_path, override_at), key=lambda path: (path.count("."), path)):
        if path in content.paths(document):
            before = content.declare(document)
            with refused_as(ScenarioError, f"override '{override_at[path]}'", KindError):
                _set(document, path, override_at[path].text, file, content)
                after = content.declare(document)
            others = _of_other_units(quantities_in(before), quantities_in(after))
            for gone in (before.keys() - after.keys()) | others:
                section, _, name = gone.rpartition(".")
                (value_at(document, section) or {}).pop(name, None)
            done.add(path)
    return tuple(path for path in sorted(override_at) if path not in done)


def _with_preferred_paths(document: Mapping[str, Any], file: str, content: Content) -> dict[str, Any]:
    """Return a copy of a document in which each value is at its preferred path."""
    changed = copy.deepcopy(dict(document))
    for path, preferred in content.same.items():
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
    section = override.typed.rpartition(".")[0]
    inside = [name for name in known if name.startswith(f"{section}.")]
    hint = nearest_name(override.typed, inside) or nearest_name(override.typed, allowed)
    # All paths of a scenario are too many to be read.
    hint = hint or f"; available: {', '.join(inside or dict.fromkeys(name.partition('.')[0] for name in known))}"
    return ScenarioError(f"override '{override}': {owner} no value '{override.typed}'{hint}")


def _set(document: dict[str, Any], path: str, text: str, file: str, content: Content) -> None:
    *sections, name = path.split(".")
    table = document
    for part in sections:
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            raise ScenarioError(f"override '{path}={text}': {file} has no table [{'.'.join(sections)}]")
    # Area and conductance, rate and period: given in another form as well, a value would be there twice.
    for other in other_forms(path):
        table.pop(other.rpartition(".")[2], None)
    table[name] = text
    quantity = content.declare(document).get(path) if _NUMBER.match(text) else None
    if not isinstance(quantity, Quantity):
        return
    if quantity.whole:
        try:
            table[name] = int(number_text(text.removesuffix(SI).strip()))
        except ValueError as error:
            raise ScenarioError(f"override '{path}={text}': must be a whole number") from error
    # Papers print gains on the torque without units, so one without gets its SI unit; 0 is the same in any unit.
    is_gain = path.startswith("controller.") and _NUMBER.fullmatch(text)
    if is_gain and ("(N m" in quantity.unit or ("/" in quantity.unit and float(text) == 0.0)):
        table[name] = f"{text} {quantity.unit}"
