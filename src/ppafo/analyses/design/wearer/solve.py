"""From a wearer to a device: the lightest parts with which a walk on its bottle does what is wanted.

Every pair of valve and actuator walks a few strides; those with the torque whose toes clear the ground walk on bottles,
lightest first, until one lasts. That walk, whole, is the suggestion; where none does, walks say what would have to be
given up.
"""

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ppafo.analyses.design.wearer.electrical import electrical_of
from ppafo.analyses.design.wearer.wish import TOES, WALKS, Device, Offer, Tried, WearerSizing, Wish
from ppafo.analyses.endurance.solve import endurance_of_walk
from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.control.walking.assistance import ASSISTANCE_QUANTITIES
from ppafo.errors import ScenarioError, StudyError
from ppafo.model.catalog import VALVES
from ppafo.model.shut_off import SHUT_OFF
from ppafo.parameters.declaration import ACTUATOR, ORIFICE
from ppafo.parameters.parts import Part, load_catalogue, rated_pressure
from ppafo.parameters.parts.catalogue import DEFAULT
from ppafo.progress import Progress, Report
from ppafo.walking.bottle import WALKED
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import LONGEST_MINUTES, walk_of
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import healthy_metrics, walk
from ppafo.walking.wearer import STATURES, WEARER

_REQUESTS = (1.0, 1.3, 1.7)
"""Torque that a torque controller is told, over the torque that is wanted: it lags behind its reference."""
_ABOVE = 1.1
"""Limit of a pair over the torque that is wanted: it vents the chamber from its limit on."""
_LIMIT = next(quantity.default or 0.0 for quantity in ASSISTANCE_QUANTITIES if quantity.name == "largest_torque")
"""Torque [N m] above which a controller of walking requests no more, unless it is told."""
_SHORTEST = 6.0
"""Time [s] that a walk on a bottle takes at least."""
_FEW = 0.15
"""Minutes of the walks that are compared at a constant supply."""
_DORSIFLEXION = 0.9
"""Gauge pressure of dorsiflexion over plantarflexion's, of the walks with regulators: 45 of 50 psi."""
_SHUT_OFF = {quantity.name: quantity.default or 0.0 for quantity in SHUT_OFF} | {"area": 1.0e-5}
_REGULATORS = ("pipeline-jacpac-regulator", "festo-lrma-qs-4")
_PROCESSOR, _CELL = "msp430g2553", "ncr18650b"
_HIGHEST_TOES = 0.2
"""Clearance [m] above which a wish is a slip of the pen."""
_EARLY_LIFT = ("controller.swing_peak_time=0.73", "controller.swing_rise_time=0.1", "controller.swing_fall_time=0.2")
"""A lift that begins at toe-off, when the toes come down late with the walk's own; with all the torque there is."""
_KEPT = 0.9
"""Torque in the walk on the bottle over the wanted one: that at which a walk on a bottle ends."""
_MORE_PRESSURE = (1.1, 1.25, 1.5, 1.8, 2.2)
"""Times the gauge pressure that are tried where no torque suffices."""
_LESS_PRESSURE = tuple(0.95 - 0.05 * step for step in range(12))
"""Times the gauge pressure that are tried where no bottle lasts."""
_OFFERED = 5
"""Pairs of parts that are tried at less pressure: those with the most torque for their gas."""
_FIRST = 4
"""Pairs and pressures, from the least gas, that are walked on a bottle for an offer."""
_USED = 0.8
"""Share of its gas above which no walk on a bottle is tried for an offer; the walk decides."""
_ALLOWANCE = 1.15
"""Gas that a pair may need over what another got out of a bottle, to be tried on it as well."""


@dataclass(frozen=True, slots=True)
class Shelf:
    """What a device may be built of: parts by group, and the catalogue file they are from where it is one's own."""

    groups: Mapping[str, Mapping[str, Part]]
    own_groups: frozenset[str]
    file: str

    def part(self, group: str, usual: str) -> Part:
        """Return the part of a group that is usual, else the lightest of one's own."""
        parts = self.groups[group]
        return parts[usual] if usual in parts else min(parts.values(), key=lambda part: part.full_mass)

    def bottle_name(self, bottle: Part) -> str:
        """Return what ``--bottle`` takes for a bottle."""
        return f"{self.file}/{bottle.name}" if "bottles" in self.own_groups else bottle.name


def shelf_of(catalogue: str | Path) -> Shelf:
    """Return the parts of a catalogue, by name or file; what it has no group of is the package's.

    ParameterError where it cannot be read, StudyError where its valves have no walk.
    """
    own, usual = load_catalogue(catalogue).groups, load_catalogue().groups
    groups = {group: own[group] or parts for group, parts in usual.items()}
    groups["valves"] = {name: part for name, part in groups["valves"].items() if part.kind in WALKS}
    if not groups["valves"]:
        raise StudyError(f"--catalogue {catalogue}: no valve is of a kind that walks: {', '.join(WALKS)}")
    is_own = Path(catalogue).suffix == ".toml"
    return Shelf(groups, frozenset(name for name in own if own[name] and is_own), str(catalogue))


def size_for_wearer(wish: Wish, report: Report, catalogue: str | Path = DEFAULT) -> WearerSizing:
    """Return the lightest device for a wish, or what to give up; StudyError for a wish that is none."""
    _check(wish)
    shelf = shelf_of(catalogue)
    healthy = healthy_metrics(load_walk(next(iter(WALKS.values())), _of_wearer(wish)))["lowest_toes"].value
    # What the healthy gait itself does not do is not asked of a device, unless somebody does.
    wish = replace(wish, usual_toes=_rounded_down(min(TOES, healthy)))
    pairs = [
        (valve, actuator)
        for valve in shelf.groups["valves"].values()
        for actuator in shelf.groups["actuators"].values()
        # A part without a largest pressure in the catalogue is not left out.
        if rated_pressure(valve, actuator) >= wish.pressure
    ]
    tried: list[Tried] = []
    for number, (valve, actuator) in enumerate(pairs):
        report(Progress(f"walking with {valve.name}", number, len(pairs), noun="pairs"))
        tried += _few_strides(wish, valve, actuator)
    bottles = sorted(shelf.groups["bottles"].values(), key=lambda bottle: bottle.full_mass)
    lightest = _lightest(wish, tried, bottles, shelf, report)
    if lightest is None:
        instead = tuple(offer.text(wish) for offer in _instead(wish, tried, bottles, shelf, report))
        if not tried:
            instead = ("no pair of valve and actuator may have this pressure, or none helps: take another pressure",)
        return WearerSizing(wish, healthy, tuple(tried), None, instead)
    one, bottle, walked = lightest
    life = endurance_of_walk(walked)
    assert life is not None, "a walk on a bottle that has a torque took gas"
    processor, cell = shelf.part("processors", _PROCESSOR), shelf.part("batteries", _CELL)
    electrical = electrical_of(walked.recording, one.valve, _SHUT_OFF["power"], processor, cell, wish.seconds)
    masses = {
        f"actuator {one.actuator.name}": one.actuator.full_mass,
        f"valve {one.valve.name}": one.valve.full_mass,
        f"bottle {bottle.name}, full": bottle.full_mass,
        **_masses_of_regulators([shelf.part("regulators", name) for name in _REGULATORS]),
        "shut-off valve": _SHUT_OFF["mass"],
        f"processor {processor.name}": processor.full_mass,
        f"battery, {electrical.cells} x {cell.name}": electrical.mass,
    }
    device = Device(one, bottle, shelf.bottle_name(bottle), walked, life, electrical, masses)
    return WearerSizing(wish, healthy, tuple(tried), device, ())


def _masses_of_regulators(regulators: list[Part]) -> dict[str, float]:
    """Return the masses of both regulators, which may be two of one part."""
    first, second = regulators
    if first.name == second.name:
        return {f"2 x regulator {first.name}": 2.0 * first.full_mass}
    return {f"regulator {part.name}": part.full_mass for part in regulators}


def _rounded_down(toes: float) -> float:
    """Return a clearance [m] rounded down to the tenth of a millimetre that is shown, which a few strides then have."""
    return math.floor(1.0e4 * toes) / 1.0e4


def _of_wearer(wish: Wish) -> tuple[str, ...]:
    return f"wearer.body_mass={wish.mass:.6g} kg", f"wearer.stature={wish.height:.6g} m"


def _check(wish: Wish) -> None:
    low, high = STATURES
    mass = next(quantity for quantity in WEARER if quantity.name == "body_mass")
    if not mass.minimum <= wish.mass <= mass.maximum:
        raise StudyError(
            f"--mass: {wish.mass:g} kg: must be at least {mass.minimum:g} kg and at most {mass.maximum:g} kg"
        )
    if not wish.pressure > STANDARD_ATMOSPHERE:
        raise StudyError("--pressure: must be above the atmosphere, for example '50 psi_g'")
    if not 0.0 < wish.torque < 100.0:
        raise StudyError(f"--torque: {wish.torque:g} N m: must be above 0 and below 100 N m")
    if not _SHORTEST <= wish.seconds <= 60.0 * LONGEST_MINUTES:
        raise StudyError(
            f"--minutes: {wish.seconds / 60.0:g} min: a walk on a bottle is followed for 0.1 to {LONGEST_MINUTES:g} min"
        )
    if wish.toes is not None and not 0.0 <= wish.toes <= _HIGHEST_TOES:
        raise StudyError(
            f"--toes: {1000.0 * wish.toes:g} mm: must be at least 0 mm and at most {1000.0 * _HIGHEST_TOES:g} mm"
        )
    if wish.stature is not None and not low <= wish.stature <= high:
        raise StudyError(
            f"--stature: {wish.stature:g} m: segments are known of adults of {low:g} to {high:g} m; take a gait and "
            "a wearer of your own in a walk file"
        )


def _few_strides(wish: Wish, valve: Part, actuator: Part) -> list[Tried]:
    """Return a few strides with a pair of parts that have the torque and the clearance, else those that come nearest.

    A torque controller walks with the lowest request that gives the torque, and lifts the foot earlier and harder where
    the toes would not clear the ground. Nearest are the most torque, and the highest toes with enough of it.
    """
    gauge = wish.pressure - STANDARD_ATMOSPHERE
    units = {quantity.name: quantity.unit for quantity in (*ORIFICE, *VALVES[valve.kind].quantities, *ACTUATOR)}
    numbers = {**valve.model_numbers, **{f"actuator.{name}": actuator.values[name] for name in _OF_ACTUATOR}}
    overrides = (
        *_of_wearer(wish),
        f"supply.pressure={wish.pressure:.7g} Pa_a",
        f"supply.dorsiflexion_pressure={STANDARD_ATMOSPHERE + _DORSIFLEXION * gauge:.7g} Pa_a",
        *(f"{path}={number:.6g} {units[path.partition('.')[2]]}".strip() for path, number in numbers.items()),
        f"shut_off.area={_SHUT_OFF['area']:g} m^2",
    )
    strides: list[Tried] = []
    for request in _requests(wish, valve, actuator):
        for lift in _lifts(request, valve, actuator, gauge):
            tried = _strides_of(valve, actuator, (*overrides, *request, *lift))
            strides += [] if tried is None else [tried]
            if tried is not None and tried.has(wish):
                return [tried]
            # Another lift gives no more torque.
            if tried is None or tried.torque < wish.torque:
                break
    if not strides:
        return []
    strongest = max(strides, key=lambda tried: tried.torque)
    highest = max(strides, key=lambda tried: (min(tried.torque, wish.torque), tried.toes))
    return [strongest] if highest is strongest else [strongest, highest]


def _requests(wish: Wish, valve: Part, actuator: Part) -> list[tuple[str, ...]]:
    """Return the settings of the torque that is requested, from the lowest; a pair of valves has a limit alone."""
    if valve.kind != "proportional":
        return [_limit(_ABOVE * wish.torque)]
    # No request above what the supply pressure can hold with this actuator; those that are equal then are one.
    held = actuator.values["torque_constant"] * (wish.pressure - STANDARD_ATMOSPHERE)
    requests = dict.fromkeys(min(factor * wish.torque, held) for factor in _REQUESTS)
    return [(f"controller.peak_torque={request:.4g} N m", *_limit(request)) for request in requests]


def _limit(request: float) -> tuple[str, ...]:
    """Return the limit that has to follow a request [N m]: a controller requests no more than its limit."""
    return (f"controller.largest_torque={request:.4g} N m",) if request > _LIMIT else ()


def _lifts(request: tuple[str, ...], valve: Part, actuator: Part, gauge: float) -> list[tuple[str, ...]]:
    """Return settings of the lift in the swing: the walk's own, then one that begins at toe-off, with all torque."""
    if valve.kind != "proportional":
        return [()]
    limit = next((text.partition("=")[2] for text in request if "largest_torque" in text), f"{_LIMIT:g} N m")
    held = actuator.values["torque_constant"] * _DORSIFLEXION * gauge
    torque = min(held, float(limit.partition(" ")[0]))
    return [(), (f"controller.swing_peak_torque={torque:.4g} N m", *_EARLY_LIFT)]


def _strides_of(valve: Part, actuator: Part, overrides: tuple[str, ...]) -> Tried | None:
    """Return a few strides with some settings; None where they lack help, or the torque loop oscillates."""
    result = walk(load_walk(WALKS[valve.kind], overrides), minutes=_FEW)
    if not result.status.is_completed or not result.is_helped or not result.averages or result.oscillation:
        return None
    flow = result.metrics["gas"].value / walk_of(result.scenario).gait.stride_time
    torque = float(result.averages["torque"].mean.max())
    return Tried(valve, actuator, overrides, torque, flow, result.metrics["lowest_toes"].value)


_OF_ACTUATOR = ("torque_constant", "displacement_per_radian")


def _lightest(
    wish: Wish, tried: list[Tried], bottles: list[Part], shelf: Shelf, report: Report
) -> tuple[Tried, Part, WalkResult] | None:
    """Return the lightest pair and bottle whose walk does what is wanted, with that walk; None if none does.

    No pair whose gas might do is left out, so that what is offered is found when it is asked for.
    """
    # Heaviest first: of pairs with the same overrides the lightest replaces the others.
    able = {device.overrides: device for device in sorted(tried, key=lambda device: -device.mass) if device.has(wish)}
    pairs = [(device, bottle) for device in able.values() for bottle in bottles]
    too_thirsty: dict[str, float] = {}
    for device, bottle in sorted(pairs, key=lambda pair: pair[0].mass + pair[1].full_mass):
        largest_flow = min(bottle.values["content"] / wish.seconds, too_thirsty.get(bottle.name, np.inf))
        if device.flow > largest_flow:
            continue
        report(Progress(f"walking on {bottle.name}", 0, 0, noun="bottles"))
        walked = _walked(device, shelf.bottle_name(bottle), wish.seconds)
        if _time(walked) < wish.seconds:
            too_thirsty[bottle.name] = _lasting_flow(device, _time(walked), wish.seconds)
        elif _keeps(walked, wish):
            assert walked is not None, "it lasts"
            return device, bottle, walked
    return None


def _walked(device: Tried, bottle: str, seconds: float) -> WalkResult | None:
    """Walk for a time [s], or until the bottle ends it; None where it cannot feed the device at all."""
    try:
        return walk(load_walk(WALKS[device.valve.kind], device.overrides, bottle=bottle), minutes=seconds / 60.0)
    except ScenarioError:
        return None


def _time(walked: WalkResult | None) -> float:
    """Return how long a walk on a bottle lasts [s], infinite where its bottle did not end it."""
    if walked is None or walked.supply is None or not walked.status.is_completed:
        return 0.0
    return math.inf if walked.supply.ending.kind == WALKED else float(walked.recording.time[-1])


def _lasting_flow(device: Tried, lasted: float, seconds: float) -> float:
    """Return the flow [kg/s] above which no pair lasts on a bottle, from one that does not, with some allowance."""
    return device.flow * min(0.99, max(0.5, _ALLOWANCE * lasted / seconds))


def _keeps(walked: WalkResult | None, wish: Wish) -> bool:
    """Tell whether the mean stride of a walk on a bottle has most of the torque, and the clearance."""
    if walked is None or not walked.averages or walked.oscillation:
        return False
    torque = walked.averages["torque"].mean.max()
    return bool(torque >= _KEPT * wish.torque and walked.metrics["lowest_toes"].value >= wish.clearance)


def _instead(wish: Wish, tried: list[Tried], bottles: list[Part], shelf: Shelf, report: Report) -> Iterator[Offer]:
    """Yield what would do instead, each as it walked on the largest bottle: who asks for exactly that gets it."""
    largest = max(bottles, key=lambda bottle: bottle.values["content"])
    lower = [(wish, device) for device in tried]
    # At less pressure the pairs that have the most torque for their gas.
    thrifty = sorted((device for device in tried if device.flow > 0.0), key=lambda device: -device.torque / device.flow)
    # Actuators of the same numbers walk alike: one of them is enough.
    pairs = list({(device.valve.name, device.torque, device.flow): device for device in thrifty}.values())[:_OFFERED]
    for number, share in enumerate(_LESS_PRESSURE):
        report(Progress("walking at less pressure", number, len(_LESS_PRESSURE), noun="pressures"))
        asked = wish.at_gauge(share)
        if STANDARD_ATMOSPHERE < asked.pressure < wish.pressure:
            lower += [
                (asked, again) for device in pairs for again in _few_strides(asked, device.valve, device.actuator)
            ]
    able = sorted((offer for offer in lower if offer[1].has(wish)), key=lambda offer: offer[1].flow)
    # A device whose toes drag is no offer.
    clear = [offer for offer in lower if offer[1].toes >= wish.clearance and offer[1].torque < wish.torque]
    strong = [offer for offer in lower if offer[1].torque >= wish.torque and 0.0 <= offer[1].toes < wish.clearance]
    weak = sorted(clear, key=lambda offer: -offer[1].torque)
    low = sorted(strong, key=lambda offer: -offer[1].toes)
    report(Progress(f"walking on {largest.name}", 0, 0, noun="bottles"))
    nearest = [] if able else [_offered(*items[0], largest, shelf) for items in (weak, low) if items]
    made = [offer for offer in (_thriftiest(able, largest, shelf), *nearest) if offer is not None]
    yield from made
    if not able:
        more = (_offered(*offer, largest, shelf) for offer in _at_more_pressure(wish, tried))
        yield from itertools.islice((offer for offer in more if offer is not None), 1)
    # A walk that ends early is no full answer: less torque for the whole time is offered beside it.
    if all(offer.wish.seconds < wish.seconds for offer in made):
        lasting = _lasting(wish, weak, largest, shelf)
        yield from [] if lasting is None else [lasting]


def _thriftiest(able: list[tuple[Wish, Tried]], bottle: Part, shelf: Shelf) -> Offer | None:
    """Return what walks on a bottle with the least gas, of the first few the one whose toes stay as high as wanted."""
    offers = []
    for asked, device in able[:_FIRST]:
        offer = _offered(asked, device, bottle, shelf)
        if offer is not None and offer.wish.clearance >= asked.clearance:
            return offer
        offers += [] if offer is None else [offer]
    return next(iter(offers), None)


def _lasting(wish: Wish, weak: list[tuple[Wish, Tried]], bottle: Part, shelf: Shelf) -> Offer | None:
    """Return what walks on a bottle for all of the time, of pairs with the most torque first; None if none does."""
    largest_flow = _USED * bottle.values["content"] / wish.seconds
    for asked, device in weak:
        if device.flow > largest_flow:
            continue
        offer = _offered(asked, device, bottle, shelf)
        if offer is not None and offer.wish.seconds == wish.seconds:
            return offer
        largest_flow = _lasting_flow(device, 0.0 if offer is None else offer.wish.seconds, wish.seconds)
    return None


def _offered(asked: Wish, device: Tried, bottle: Part, shelf: Shelf) -> Offer | None:
    """Return what a pair has of a wish, rounded down, as it walked on a bottle; None where that is nothing."""
    if device.torque < asked.torque:
        asked = replace(asked, torque=math.floor(100.0 * device.torque) / 100.0)
    if device.toes < asked.clearance:
        asked = replace(asked, toes=_rounded_down(device.toes))
    again = next((tried for tried in _few_strides(asked, device.valve, device.actuator) if tried.has(asked)), None)
    walked = None if again is None else _walked(again, shelf.bottle_name(bottle), asked.seconds)
    if again is None or walked is None or not walked.averages:
        return None
    toes = walked.metrics["lowest_toes"].value
    if toes < asked.clearance:
        # The toes come down a little as the pressure falls: what is offered is what they then have.
        asked = replace(asked, toes=_rounded_down(toes))
        if [tried.overrides for tried in _few_strides(asked, device.valve, device.actuator)] != [again.overrides]:
            return None
    # Rounded down to what a command line can say, so that a run from that line still meets the offer.
    hundredths = math.floor(min(_time(walked), asked.seconds) / 0.6)  # of a minute
    lasts = asked.seconds if _time(walked) >= asked.seconds else 0.6 * hundredths
    is_one = asked.torque > 0.0 and asked.clearance >= 0.0 and lasts >= _SHORTEST and _keeps(walked, asked)
    return Offer(replace(asked, seconds=lasts), again, bottle) if is_one else None


def _at_more_pressure(wish: Wish, tried: list[Tried]) -> Iterator[tuple[Wish, Tried]]:
    """Yield what does it at more pressure, the lowest first: of each kind of valve the strongest and the highest."""
    strongest: list[Tried] = []
    for kind in dict.fromkeys(device.valve.kind for device in tried):
        of_kind = [device for device in tried if device.valve.kind == kind]
        both = (max(of_kind, key=lambda device: device.torque), max(of_kind, key=lambda device: device.toes))
        strongest += {(device.valve.name, device.actuator.name): device for device in both}.values()
    for more in _MORE_PRESSURE:
        asked = wish.at_gauge(more)
        for device in strongest:
            if rated_pressure(device.valve, device.actuator) < asked.pressure:
                continue
            for again in _few_strides(asked, device.valve, device.actuator):
                if again.has(wish):
                    yield asked, again
