"""Effects of a device: their settings in SI, which are on, and the rows that programs have of them."""

from collections import namedtuple
from collections.abc import Mapping
from functools import cache
from typing import Any

from ppafo.model.catalog import device_effects, ordered_effects
from ppafo.model.columns import first, over_runs
from ppafo.model.effects.kind import Effect
from ppafo.parameters.declaration import members
from ppafo.parameters.device import Device

SEEN_BY_EFFECTS = ("gas", "actuator", "friction", "foot_plate", "supply")
"""What ``prepare`` of an effect sees of a device; an exported library has these sections in C."""


Sections = Mapping[str, Any]
"""Objects whose attributes are settings of effects beside those of the device, by section of files."""
_NO_SECTIONS: Sections = {}


def settings_of(device: Device, effect: Effect, others: Sections = _NO_SECTIONS) -> dict[str, Any]:
    """Return the settings [SI] of an effect, arrays (runs,) where they vary; its defaults where nothing is said."""
    if effect.section in others:
        return {item.name: getattr(others[effect.section], item.name) for item in effect.quantities}
    return {**effect.defaults(), **device.effects.get(effect.name, {})}


def all_settings(device: Device) -> dict[str, dict[str, Any]]:
    """Return the settings [SI] of all effects of devices that are loaded, by name."""
    return {effect.name: settings_of(device, effect) for effect in device_effects()}


def effects_of(device: Device, others: Sections = _NO_SECTIONS) -> tuple[Effect, ...]:
    """Return the effects that are on, in the order in which they act; of columns those of the first run."""
    return tuple(
        effect
        for effect in ordered_effects()
        if effect.is_on({name: first(value) for name, value in settings_of(device, effect, others).items()})
    )


def switches_of(device: Device) -> dict[Effect, Any]:
    """Return for each effect of a device whether it is on; an array (runs,) where settings that switch it vary."""
    return {effect: effect.is_on(settings_of(device, effect)) for effect in device_effects()}


def effect_rows(device: Device, others: Sections = _NO_SECTIONS) -> tuple[Any, ...]:
    """Return the rows of the effects that are on; numbers are arrays (runs,) where settings or the device vary."""
    return tuple(_row(effect, device, others) for effect in effects_of(device, others))


def _row(effect: Effect, device: Device, others: Sections) -> Any:
    settings, names = settings_of(device, effect, others), _names(device.actuator.kind)
    given = [_number(device, section, name) for section, inner in names.items() for name in inner]

    def prepared(*numbers: float) -> Any:
        own, rest = numbers[: len(settings)], iter(numbers[len(settings) :])
        parts = [_part(section, inner)(*[next(rest) for _ in inner]) for section, inner in names.items()]
        return effect.prepare(dict(zip(settings, own, strict=True)), _part("device", tuple(names))(*parts))

    return over_runs(prepared, *settings.values(), *given)


def _number(device: Device, section: str, name: str) -> Any:
    own = device.actuator.settings if section == "actuator" else {}
    return own[name] if name in own else getattr(getattr(device, section), name)


@cache
def _names(actuator_kind: str) -> dict[str, tuple[str, ...]]:
    """Return the numbers of a device that effects see, by section."""
    found = {section: tuple(item.name for item in members(section, actuator_kind)) for section in SEEN_BY_EFFECTS}
    return found | {"gas": (*found["gas"], "specific_gas_constant")}


@cache
def _part(section: str, names: tuple[str, ...]) -> Any:
    return namedtuple(section, names)
