"""Sizing for a wearer: the lightest parts whose walk on a bottle meets the requirements.

Every pair of valve and actuator walks a few strides. Pairs with the required torque and toe clearance then walk on
bottles, lightest first, until one lasts; this complete walk is the suggestion. If none lasts, further walks find
alternatives.
"""

import itertools
from dataclasses import replace
from pathlib import Path

from ppafo.analyses.design.wearer.alternatives import alternatives_to
from ppafo.analyses.design.wearer.available_parts import AvailableParts, shelf_of
from ppafo.analyses.design.wearer.bottle import lightest_on_bottle
from ppafo.analyses.design.wearer.electrical import electrical_of
from ppafo.analyses.design.wearer.requirements import (
    CLEARANCE,
    REACHED,
    TOES,
    TORQUE,
    WALKS,
    DesignRequirements,
    SizedDevice,
    WalkedDevice,
    WearerSizing,
    check_requirements,
    shown_clearance,
)
from ppafo.analyses.design.wearer.strides import few_strides, of_wearer
from ppafo.analyses.endurance.solve import WITHOUT_REST, endurance_of_walk_gas
from ppafo.analyses.endurance.walk_gas import walk_gas
from ppafo.errors import StudyError
from ppafo.parameters.bottles.bottle import bottle_part, load_bottle
from ppafo.parameters.device import Device
from ppafo.parameters.parts import Part
from ppafo.parameters.parts.catalogue import DEFAULT, rated_pressure
from ppafo.progress import Progress, Report
from ppafo.units.shown import shown_text
from ppafo.walking.bottle.supply import SET_PRESSURE, other_pressure
from ppafo.walking.loading import load_walk
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import healthy_metrics
from ppafo.wording import argument_text

_REGULATORS = ("pipeline-jacpac-regulator", "festo-lrma-qs-4")
"""Default regulators of plantarflexion and dorsiflexion, by name in the catalogue of the package."""
_PROCESSOR, _CELL = "msp430g2553", "ncr18650b"
"""Default processor and battery cell, by name in the catalogue of the package."""


def size_for_wearer(
    requirements: DesignRequirements,
    report: Report,
    catalogue: str | Path = DEFAULT,
    bottle: str | Path | None = None,
) -> WearerSizing:
    """Return the lightest device that meets the requirements, or the alternatives.

    ``catalogue`` is a name or a file. ``bottle``, a name or a file, replaces the bottles of the catalogue, and its gas
    feeds the device. ``report`` receives a line for each walk.

    Raises StudyError for impossible requirements, ParameterError for an invalid catalogue or bottle.
    """
    check_requirements(requirements)
    shelf, walking = shelf_of(catalogue), load_walk(next(iter(WALKS.values())), of_wearer(requirements))
    if bottle is not None:
        part, species = bottle_part(bottle)
        _check_regulator(bottle, walking.device, requirements.pressure)
        groups = {**shelf.groups, "bottles": {part.name: part}}
        shelf = replace(shelf, groups=groups, chosen_bottle=str(bottle))
        if species != walking.device.gas.species:
            requirements = replace(requirements, gas=species)
    healthy = healthy_metrics(walking)["lowest_toes"].value
    # What the healthy gait itself does not do is not asked of a device, unless somebody does.
    requirements = replace(requirements, usual_toes=shown_clearance(min(TOES, healthy)))
    # A part without a rated pressure in the catalogue is included.
    every_pair = itertools.product(shelf.groups["valves"].values(), shelf.groups["actuators"].values())
    pairs = [pair for pair in every_pair if rated_pressure(*pair) >= requirements.pressure]
    tried: list[WalkedDevice] = []
    for number, (valve, actuator) in enumerate(pairs):
        report(Progress(f"walking with {valve.name}", number, len(pairs), noun="pairs"))
        tried += few_strides(requirements, valve, actuator)
    lightest = lightest_on_bottle(requirements, tried, shelf, report)
    gas = requirements.gas or walking.device.gas.species
    own = tuple(shelf.groups["valves"].values()) if "valves" in shelf.own_groups else ()
    sized = WearerSizing(requirements, healthy, tuple(tried), None, (), gas, own)
    if lightest is not None:
        return replace(sized, device=_device(*lightest, requirements, shelf, report))
    alternatives = alternatives_to(requirements, tried, shelf, report)
    instead = tuple(alternative.text(requirements) for alternative in alternatives)
    if not instead and not tried:
        instead = ("no pair of valve and actuator is rated for this pressure and assists; change the pressure",)
    elif not instead:
        torque = requirements.torque
        nearest = max(tried, key=lambda pair: (min(pair.torque, REACHED * torque), pair.toes))
        instead = (
            f"none: of the pairs tried {nearest.valve.name} with {nearest.actuator.name} comes nearest, with "
            f"{TORQUE.text(nearest.torque)} and toes {CLEARANCE.text(nearest.toes)} over the ground; copy the parts "
            "with 'ppafo new parts my-parts --from parts', add an actuator of more torque per pressure and give "
            f"{argument_text('catalogue')}",
        )
    return replace(sized, instead=instead)


def _check_regulator(name: str | Path, device: Device, pressure: float) -> None:
    """Raise StudyError if a bottle file sets its regulator to another pressure than the required one [Pa absolute]."""
    bottle = load_bottle(name)
    device = replace(device, supply=replace(device.supply, pressure=pressure))
    if (own := other_pressure(name, bottle, device)) is None:
        return
    room, unit = device.supply.atmospheric_pressure, bottle.entries[SET_PRESSURE].unit
    own_text, wanted = (shown_text(number, "Pa_a", atmosphere=room, unit=unit) for number in (own, pressure))
    given = f"{argument_text('bottle', str(name))}: sets {SET_PRESSURE} to {own_text}"
    raise StudyError(f"{given}, not to {argument_text('pressure')} = {wanted}: write {wanted} in the file")


def _device(
    pair: WalkedDevice,
    bottle: Part,
    walked: WalkResult,
    requirements: DesignRequirements,
    shelf: AvailableParts,
    report: Report,
) -> SizedDevice:
    """Assemble the device of a pair and a bottle, with regulators, processor and battery."""
    until = f"walking until {bottle.name} is exhausted"
    life = endurance_of_walk_gas(
        walk_gas(walked), None, WITHOUT_REST, progress=lambda done, _: report(Progress(f"{until}, {int(done)} min"))
    )
    processor, cell = shelf.part("processors", _PROCESSOR), shelf.part("batteries", _CELL)
    electrical = electrical_of(walked.recording, pair.valve, processor, cell, requirements.seconds)
    # Both regulators may be of one part.
    regulators = [shelf.part("regulators", name) for name in _REGULATORS]
    regulator_masses = {f"regulator {part.name}": part.full_mass for part in regulators}
    if len(regulator_masses) < len(regulators):
        regulator_masses = {f"2 x {name}": 2.0 * mass for name, mass in regulator_masses.items()}
    masses = {
        f"actuator {pair.actuator.name}": pair.actuator.full_mass,
        f"valve {pair.valve.name}": pair.valve.full_mass,
        f"bottle {bottle.name}, full": bottle.full_mass,
        **regulator_masses,
        f"processor {processor.name}": processor.full_mass,
        f"battery, {electrical.cells} x {cell.name}": electrical.mass,
    }
    return SizedDevice(pair, bottle, shelf.bottle_name(bottle), walked, life, electrical, masses)
