"""Effects of a device: active effects, their settings, and their parameter rows in a program."""

from collections.abc import Iterable, Mapping
from functools import cache
from types import SimpleNamespace
from typing import Any

from ppafo.model.catalog import find_effects, ordered_effects
from ppafo.model.columns import first, over_runs
from ppafo.model.effects.kind import SECTION, Effect
from ppafo.parameters.declaration import members
from ppafo.parameters.device import Device

SEEN_BY_EFFECTS = ("gas", "actuator", "friction", "foot_plate", "supply")
"""Device sections that ``prepare`` of an effect may read; exported libraries contain these sections in C."""


Sections = Mapping[str, Any]
"""Settings by file section of effects with settings outside the device, such as the sensors."""
_NO_SECTIONS: Sections = {}


def settings_of(device: Device, effect: Effect, others: Sections = _NO_SECTIONS) -> dict[str, Any]:
    """Return the settings of an effect [SI], with defaults for missing ones; arrays (runs,) if varied."""
    if effect.section in others or effect.always:
        section = others[effect.section] if effect.section in others else getattr(device, effect.section)
        return {quantity.name: getattr(section, quantity.name) for quantity in effect.quantities}
    return {**effect.defaults(), **device.effects.get(effect.name, {})}


def all_settings(device: Device) -> dict[str, dict[str, Any]]:
    """Return the settings [SI] of all loaded device effects, by name."""
    return {effect.name: settings_of(device, effect) for effect in _effects(device) if effect.is_of_device}


def number_under(node: Any, attributes: Iterable[str]) -> Any:
    """Return the number at a chain of attributes of a device or its owner; an array (runs,) if varied."""
    for name in attributes:
        node = part_of(node, name)
    return node


def part_of(node: Any, name: str) -> Any:
    """Return a named attribute of an object, or a named entry of a mapping."""
    # A device has settings of the effects that its set names; those of all others are their defaults.
    if name == SECTION and isinstance(node, Device):
        return all_settings(node)
    return node[name] if isinstance(node, Mapping) else getattr(node, name)


def effects_of(device: Device, others: Sections = _NO_SECTIONS) -> tuple[Effect, ...]:
    """Return the active effects in the order in which they act; in an ensemble the first run decides."""
    return tuple(
        effect
        for effect in _effects(device)
        if effect.is_on({name: first(value) for name, value in settings_of(device, effect, others).items()})
    )


def switches_of(device: Device) -> dict[Effect, Any]:
    """Return for each device effect True if active; an array (runs,) if the deciding settings vary."""
    settings = all_settings(device)
    return {effect: effect.is_on(settings[effect.name]) for effect in ordered_effects() if effect.is_of_device}


def _effects(device: Device) -> tuple[Effect, ...]:
    """Return all loaded effects in order, including those named by the device."""
    find_effects(f"{SECTION}.{name}" for name in device.effects)
    return ordered_effects()


def effect_rows(device: Device, others: Sections = _NO_SECTIONS) -> tuple[Any, ...]:
    """Return the parameter rows of the active effects; numbers are arrays (runs,) if varied."""
    return tuple(effect_row(effect, device, others) for effect in effects_of(device, others))


def effect_row(effect: Effect, device: Device, others: Sections = _NO_SECTIONS) -> Any:
    """Return the parameter row of an effect, active or not; numbers are arrays (runs,) if varied."""
    settings = settings_of(device, effect, others)
    prepare = effect.prepare
    # Most effects compute with their settings as they are.
    if prepare is None:
        return effect.parameters(*settings.values())
    names = _names(device.actuator.kind)
    seen = [(section, name) for section, names_of_section in names.items() for name in names_of_section]

    def prepared(*numbers: float) -> Any:
        own = numbers[: len(settings)]
        of_device = numbers[len(settings) :]
        sections: dict[str, dict[str, float]] = {section: {} for section in names}
        for (section, name), number in zip(seen, of_device, strict=True):
            sections[section][name] = number
        view = SimpleNamespace(**{section: SimpleNamespace(**inner) for section, inner in sections.items()})
        return prepare(effect.settings(*own), view)

    return over_runs(prepared, *settings.values(), *(_number(device, section, name) for section, name in seen))


def _number(device: Device, section: str, name: str) -> Any:
    """Return a number of a device; an actuator setting has precedence over a field of the same name."""
    if section == "actuator" and name in device.actuator.settings:
        return device.actuator.settings[name]
    return getattr(getattr(device, section), name)


@cache
def _names(actuator_kind: str) -> dict[str, tuple[str, ...]]:
    """Return the names of the device numbers that effects may read, by section."""
    names = {
        section: tuple(quantity.name for quantity in members(section, actuator_kind)) for section in SEEN_BY_EFFECTS
    }
    return names | {"gas": (*names["gas"], "specific_gas_constant")}
