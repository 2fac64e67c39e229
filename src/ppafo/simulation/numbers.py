"""Numbers of a scenario by dotted path: their declarations, and their replacement by columns for many runs."""

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from types import UnionType
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from ppafo.arguments.values import shown, taken_number
from ppafo.errors import ScenarioError
from ppafo.model.catalog import VALVES, device_effects
from ppafo.model.controlled import CONTROLLED
from ppafo.model.declaration import Quantity
from ppafo.model.effects.kind import SECTION as EFFECT_SETTINGS
from ppafo.parameters.declaration import (
    AREA_FORM,
    FLAT_SECTIONS,
    OF_SECOND_CHAMBER,
    ORIFICE,
    SONIC_FORM,
    is_within,
    members,
    range_rule,
)
from ppafo.parameters.device import Device, Orifice, SonicOrifice, held_in
from ppafo.parameters.effects import number_under, part_of
from ppafo.parameters.graph import Asked, Graph, left, resolved
from ppafo.parameters.overrides import one_path, read_overrides
from ppafo.simulation.clock import PERIOD_PATH, RATE_PATH
from ppafo.simulation.declaration import LOCKED_ANGLE
from ppafo.simulation.default_gains import default_links
from ppafo.simulation.profiles import disordered_knots, profiles_of
from ppafo.simulation.scenario import Motion, Scenario
from ppafo.units import SI
from ppafo.units.shown import in_units, written_text

_Item = TypeVar("_Item")
_OF_DEVICE = (*FLAT_SECTIONS, "valve", EFFECT_SETTINGS)
ORIFICES = {"valve": ("device", "valve", "orifice"), "actuator.leak": ("device", "actuator", "leak")}

NOISE_SEED = "sensors.seed"
"""Path of the seed of the sensor noise, the only whole number."""


_OF_JOINT = ("actuator.", "friction.", "foot_plate.")
_ACCEPTED: deque[Scenario] = deque(maxlen=16)
"""Scenarios that were checked last; frozen, so that repeated simulation needs no new check."""


def chosen_path(path: str, scenario: Scenario) -> str:
    """Return the path with ``valve.`` in place of ``valves.NAME.`` if NAME is the valve of the scenario."""
    return one_path(path, scenario.device.valve_name)


def check_parts(scenario: Scenario) -> None:
    """Raise ScenarioError for a scenario changed in Python to an impossible one: wrong class, number out of range."""
    if any(scenario is accepted for accepted in _ACCEPTED):
        return

    def refusal(path: str, value: Any, rule: str) -> ScenarioError:
        return ScenarioError(f"{scenario.name}: {path} = {shown(value)}: {rule}")

    # The class of each attribute is that of its annotation, which of some has parts or None beside it.
    for name, hint in get_type_hints(Scenario).items():
        part = getattr(scenario, name)
        kind = hint if isinstance(hint, UnionType) else get_origin(hint) or hint
        if kind is not Motion and not isinstance(part, kind):
            of_class = f"an object of class {(*get_args(kind), kind)[0].__name__}"
            raise refusal(name, part, f"must be {'a text' if kind is str else of_class}")
    if not hasattr(scenario.motion, "motion_kind"):
        raise refusal("motion", scenario.motion, "must be a motion object such as FreeMotion")
    if scenario.controlled not in CONTROLLED:
        raise refusal("controlled", scenario.controlled, f"must be one of {', '.join(CONTROLLED)}")
    absent = _numbers_of_other_form(scenario.device) | {RATE_PATH}
    to_float = taken_number()
    named_effects = scenario.device.effects
    for path, quantity in declared_numbers(scenario).items():
        section, _, name = path.partition(".")
        # An effect that the device does not name has its defaults.
        if path in absent or (section == EFFECT_SETTINGS and name.partition(".")[0] not in named_effects):
            continue
        value = number_under(scenario, _attributes(path, scenario))
        try:
            # An ankle without its device has no actuator, friction or plate, as no file can say.
            is_good = is_within(to_float(value), quantity) or (value == 0.0 and path.startswith(_OF_JOINT))
        except ValueError:
            is_good = False
        if not is_good:
            raise refusal(path, value, range_rule(quantity, quantity.unit))
    for section, choice in profiles_of(scenario).items():
        is_bad, line = disordered_knots(choice, section)
        if is_bad:
            raise ScenarioError(f"{scenario.name}: {line(0)}")
    _ACCEPTED.append(scenario)


def declared_numbers(scenario: Scenario) -> dict[str, Quantity]:
    """Return the declarations of all numbers of a scenario and its device, by path; both forms of each orifice."""
    device = scenario.device
    kind = scenario.device.actuator.kind
    declared = [(section, quantity) for section in FLAT_SECTIONS for quantity in members(section, kind)]
    declared += [("actuator.leak", quantity) for quantity in ORIFICE]
    declared += [(effect.section, quantity) for effect in device_effects() for quantity in effect.quantities]
    declared += [("valve", quantity) for quantity in (*ORIFICE, *VALVES[device.valve.kind].quantities)]
    of_device = {f"{section}.{quantity.name}": quantity for section, quantity in declared}
    return of_its_chambers(of_device | scenario.motion.motion_kind.quantities(scenario), device)


@in_units(lambda scenario, *_, **__: scenario.device.shown)
def changes_in(scenario: Scenario, *others: Scenario, overrides: Iterable[str] | None = None) -> tuple[str, ...]:
    """Return overrides of scenarios as texts, by default the first scenario's own; SI numbers in their display unit."""
    declared = {path: item for each in (*others, scenario) for path, item in declared_numbers(each).items()}
    texts = []
    for override in read_overrides(scenario.origin.overrides if overrides is None else overrides):
        number, unit, _ = override.text.partition(f" {SI}")
        # An override of one of several configurations has its name before the path.
        quantity = declared.get(chosen_path(override.typed.rpartition(":")[2], scenario)) if unit else None
        shown_value = override.text if quantity is None else written_text(float(number), quantity.unit)
        texts.append(f"{override.typed}={shown_value}")
    return tuple(texts)


def of_its_chambers(by_path: Mapping[str, _Item], device: Device) -> dict[str, _Item]:
    """Return items by path, without items of chamber 2 for an actuator with one chamber."""
    absent = OF_SECOND_CHAMBER if device.actuator.has_one_chamber else frozenset()
    return {path: item for path, item in by_path.items() if path not in absent}


def with_numbers(scenario: Scenario, numbers: Mapping[str, Any]) -> Scenario:
    """Return the scenario with numbers replaced; keys are paths of ``declared_numbers`` that are not in ``TIMES``.

    Numbers that follow a replaced number change with it. An orifice given in its other form (area or sonic conductance)
    changes to that form; both numbers of the form are then required.
    """
    replaced = {chosen_path(path, scenario): number for path, number in numbers.items()}
    moved, changed, anew = _moved(scenario, replaced)
    # All links that are left are the scenario's own, for what is replaced follows nothing any more.
    if replaced:
        links = left({**scenario.graph, **anew}, replaced)
        changed = replace(changed, device=replace(changed.device, links={}), links=links)
    absent = _numbers_of_other_form(scenario.device)
    for path, number in moved.items():
        if path not in absent:
            changed = _replace_number(changed, _attributes(path, changed), number)
    return changed


def moving_together(scenario: Scenario, replaced: Mapping[str, Any]) -> dict[str, Any]:
    """Return numbers by path, together with all linked numbers that follow from them, except ``TIMES``.

    Numbers changed since the scenario was loaded no longer follow others.
    """
    # Numbers that follow the sample period follow a rate that is given for it.
    period = {PERIOD_PATH: 1.0 / replaced[RATE_PATH]} if RATE_PATH in replaced and PERIOD_PATH not in replaced else {}
    moved, _, _ = _moved(scenario, {**replaced, **period})
    return {path: number for path, number in moved.items() if path not in period}


def _moved(scenario: Scenario, replaced: Mapping[str, Any]) -> tuple[dict[str, Any], Scenario, Graph]:
    """Return numbers with all that follow them, the scenario with orifices given in their other form, and its links."""
    changed = scenario
    anew = {}
    for section, place in ORIFICES.items():
        form = other_form(scenario.device, section)
        paths = [f"{section}.{name}" for name in form]
        missing = [path for path in paths if path not in replaced]
        if len(missing) == len(form):
            continue
        if missing:
            raise ScenarioError(
                f"{scenario.name}: {' and '.join(paths)} change together: also give {' and '.join(missing)}"
            )
        kind = SonicOrifice if "sonic_conductance" in form else Orifice
        orifice = kind(**{name: replaced[f"{section}.{name}"] for name in form})
        changed = _replace_number(changed, place, orifice)
    if changed is not scenario:
        declared = scenario.motion.motion_kind.quantities(scenario)
        anew = default_links(changed, [declared[path] for path in scenario.links if path in declared])
        for (link,) in anew.values():
            # This finds the sources in the other form.
            link.number(_present(changed).__getitem__)
    return resolved(scenario.graph, replaced, _present(scenario), anew), changed, anew


def _present(scenario: Scenario) -> Asked:
    """Return the numbers of a scenario by path, read on demand; floats or arrays (runs,)."""
    return Asked(lambda path: number_under(scenario, _attributes(path, scenario)))


def present_numbers(scenario: Scenario) -> dict[str, float]:
    """Return the numbers of a single run [SI] by path, without those of an orifice's other form or an absent effect."""
    named = scenario.device.effects
    absent = _numbers_of_other_form(scenario.device)
    numbers = {}
    for path in declared_numbers(scenario):
        section, _, name = path.partition(".")
        if path not in absent and path != RATE_PATH and (section != EFFECT_SETTINGS or name.partition(".")[0] in named):
            numbers[path] = number_at(scenario, path)
    return {**numbers, RATE_PATH: 1.0 / numbers[PERIOD_PATH]}


def number_at(scenario: Scenario, path: str) -> float:
    """Return the number at a path of ``declared_numbers`` that is not in ``TIMES``, in SI units."""
    return float(numbers_at(scenario, path))


def numbers_at(scenario: Scenario, path: str) -> Any:
    """Return the number at a path as ``number_at``, or the array (runs,) in an ensemble."""
    return number_under(scenario, _attributes(chosen_path(path, scenario), scenario))


def other_form(device: Device, section: str) -> tuple[str, ...]:
    """Return the number names of the orifice form (area or sonic conductance) that is not in use in a section."""
    orifice = device.valve.orifice if section == "valve" else device.actuator.leak
    return tuple(quantity.name for quantity in (SONIC_FORM if isinstance(orifice, Orifice) else AREA_FORM))


def _numbers_of_other_form(device: Device) -> set[str]:
    """Return the paths of orifice numbers in the form (area or sonic conductance) that is not in use."""
    return {f"{section}.{name}" for section in ORIFICES for name in other_form(device, section)}


def path_of_locked_angle(scenario: Scenario) -> str | None:
    """Return the path of the angle of a locked vane; None if the vane moves."""
    if scenario.motion.locked_angle is None:
        return None
    return LOCKED_ANGLE if LOCKED_ANGLE in scenario.motion.motion_kind.places else "motion.profile.level"


def _attributes(path: str, scenario: Scenario) -> tuple[str, ...]:
    """Return the attribute names that lead from the scenario to a number: its path, unless the motion has others."""
    of_motion = scenario.motion.motion_kind.places
    if path in of_motion:
        return of_motion[path]
    names = tuple(path.split("."))
    return ("device", *names) if names[0] in _OF_DEVICE else names


def _replace_number(node: Any, attributes: tuple[str, ...], number: Any) -> Any:
    name = attributes[0]
    inside = attributes[1:]
    inner = _replace_number(part_of(node, name), inside, number) if inside else number
    if isinstance(node, Mapping):
        return {**node, name: inner}
    if any(field.name == name for field in fields(node)):
        return replace(node, **{name: inner})
    holder = held_in(node, name)
    assert holder is not None, f"a declared number '{name}' is in a {type(node).__name__}"
    return replace(node, **{holder: _replace_number(getattr(node, holder), attributes, number)})
