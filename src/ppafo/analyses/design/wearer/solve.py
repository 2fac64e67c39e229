"""From a wearer to a device: the lightest parts with which a walk on its bottle has the torque and lasts the minutes.

Every pair of valve and actuator walks a few strides; those with the torque walk on bottles, lightest first, until one
lasts. That walk, whole, is the suggestion; where none does, walks say what would have to be given up.
"""

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ppafo.analyses.design.wearer.electrical import Electrical, electrical_of, electrical_sentences
from ppafo.analyses.endurance.answer import Endurance
from ppafo.analyses.endurance.solve import endurance_of_walk
from ppafo.analyses.parts.solve import doubts_data, part_titles, parts_to_check, rated_pressure
from ppafo.constants import PASCALS_PER_PSI, STANDARD_ATMOSPHERE
from ppafo.control.walking.assistance import ASSISTANCE_QUANTITIES
from ppafo.errors import ScenarioError, StudyError
from ppafo.model.catalog import VALVES
from ppafo.model.plant_faults import SHUT_OFF
from ppafo.parameters.declaration import ACTUATOR, ORIFICE
from ppafo.parameters.parts import Part, load_catalogue
from ppafo.progress import Progress, Report
from ppafo.report import finding
from ppafo.report.finding import Finding, columns_of, facts
from ppafo.report.kind import Kind
from ppafo.version import __version__
from ppafo.walking.bottle import WALKED, minutes_text
from ppafo.walking.figures.over_time import bottle_figure, peak_torques
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import LONGEST_MINUTES, walk_of
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import walk
from ppafo.walking.wearer import SCALED_MASS, STATURES, WEARER, paper_subject, who_walks

WALKS = {"solenoid": "solenoid-regulators", "proportional": "proportional-regulators"}
"""The walk, with its controller, of each kind of valve."""
_REQUESTS = (1.0, 1.3, 1.7)
"""Torque that a torque controller is told, over the torque that is wanted: it lags behind its reference."""
_LIMIT = next(item.default or 0.0 for item in ASSISTANCE_QUANTITIES if item.name == "largest_torque")
"""Torque [N m] above which a controller of walking requests no more, unless it is told."""
_SHORTEST = 6.0
"""Time [s] that a walk on a bottle takes at least."""
_FEW = 0.15
"""Minutes of the walks that are compared at a constant supply."""
_DORSIFLEXION = 0.9
"""Gauge pressure of dorsiflexion over plantarflexion's, of the walks with regulators: 45 of 50 psi."""
_SHUT_OFF = {item.name: item.default or 0.0 for item in SHUT_OFF} | {"area": 1.0e-5}
_REGULATORS = ("pipeline-jacpac-regulator", "festo-lrma-qs-4")
_PROCESSOR, _CELL = "msp430g2553", "ncr18650b"
_KEPT = 0.9
"""Torque in the walk on the bottle over the wanted one: that at which a walk on a bottle ends."""
_MORE_PRESSURE = (1.1, 1.25, 1.5, 1.8, 2.2)
"""Times the gauge pressure that are tried where no torque suffices."""
_LESS_PRESSURE = tuple(0.95 - 0.05 * place for place in range(12))
"""Times the gauge pressure that are tried where no bottle lasts."""
_OFFERED = 5
"""Pairs of parts that are tried at less pressure: those with the most torque for their gas."""
_USED = 0.8
"""Share of its gas above which no walk on a bottle is tried for an offer; the walk decides."""
_ALLOWANCE = 1.15
"""Gas that a pair may need over what another got out of a bottle, to be tried on it as well."""


@dataclass(frozen=True, slots=True)
class Wish:
    """What is wanted: body mass [kg], stature [m] or None, torque [N m], supply pressure [Pa absolute], time [s]."""

    mass: float
    stature: float | None
    torque: float
    pressure: float
    seconds: float

    @property
    def height(self) -> float:
        """Stature [m], the paper's subject's unless one is given."""
        return paper_subject().stature if self.stature is None else self.stature

    def at_gauge(self, share: float) -> "Wish":
        """Return this wish at a share of its gauge pressure, rounded to a tenth of a psi."""
        gauge = round(share * (self.pressure - STANDARD_ATMOSPHERE) / PASCALS_PER_PSI, 1)
        return replace(self, pressure=STANDARD_ATMOSPHERE + gauge * PASCALS_PER_PSI)


@dataclass(frozen=True, slots=True, eq=False)
class Tried:
    """Valve, actuator and overrides of a walk; peak torque of the mean stride [N m], mean flow of gas [kg/s]."""

    valve: Part
    actuator: Part
    overrides: tuple[str, ...]
    torque: float
    flow: float

    @property
    def mass(self) -> float:
        """Mass of both parts [kg]."""
        return self.valve.full_mass + self.actuator.full_mass


@dataclass(frozen=True, slots=True, eq=False)
class Device:
    """A device that was walked with on its bottle for the time that is wanted, how long it lasts, what it takes."""

    tried: Tried
    bottle: Part
    walked: WalkResult
    life: Endurance
    electrical: Electrical
    masses: Mapping[str, float]

    @property
    def torque(self) -> float:
        """Peak torque of the mean stride on the bottle [N m]."""
        return float(self.walked.averages["torque"].mean.max())

    @property
    def command(self) -> str:
        """The command that walks with it."""
        sets = " ".join(f"--set '{text}'" for text in self.tried.overrides)
        minutes = float(self.walked.recording.time[-1]) / 60.0
        return f"ppafo walk {WALKS[self.tried.valve.kind]} --bottle {self.bottle.name} --minutes {minutes:.4g} {sets}"


@dataclass(frozen=True, slots=True, eq=False)
class WearerSizing:
    """What was wanted and all that was tried; ``device`` is None where none has it, and ``instead`` what would do."""

    wish: Wish
    tried: tuple[Tried, ...]
    device: Device | None
    instead: tuple[str, ...]

    @property
    def parts(self) -> list[Part]:
        """The parts that the device is made of, of those with figures to check."""
        device = self.device
        if device is None:
            return []
        return [device.tried.valve, device.tried.actuator, device.bottle, device.electrical.cell]

    @property
    def doubtful(self) -> list[tuple[Part, str]]:
        """Figures of these parts that are quoted or assumed."""
        return [(part, name) for part in self.parts for name in part.doubtful]

    def json_document(self) -> dict[str, Any]:
        """Return the device and all that was tried as plain data in SI."""
        wish, device = self.wish, self.device
        return {
            "format": "ppafo wearer sizing",
            "schema_version": 1,
            "kind": "simulated",
            "ppafo": __version__,
            "wish": {
                "body_mass": wish.mass,
                "stature": wish.stature,
                "torque": wish.torque,
                "pressure": wish.pressure,
                "time": wish.seconds,
            },
            "device": None
            if device is None
            else {
                "valve": device.tried.valve.name,
                "actuator": device.tried.actuator.name,
                "bottle": device.bottle.name,
                "controller": device.walked.scenario.controller.kind,
                "walk": WALKS[device.tried.valve.kind],
                "overrides": list(device.tried.overrides),
                "lasts": device.life.discharge.walking_time,
                "torque": device.torque,
                "masses": dict(device.masses),
                "electrical_power": dict(device.electrical.powers),
                "battery": {
                    "cell": device.electrical.cell.name,
                    "cells": device.electrical.cells,
                    "mass": device.electrical.mass,
                    "lasts": device.electrical.lasts,
                },
                "command": device.command,
            },
            "instead": list(self.instead),
            "tried": [
                {"valve": one.valve.name, "actuator": one.actuator.name, "torque": one.torque, "flow": one.flow}
                for one in self.tried
            ],
            "check_before_buying": doubts_data(self.doubtful),
        }


def size_for_wearer(wish: Wish, report: Report) -> WearerSizing:
    """Return the lightest device for a wish, or what to give up; StudyError for a wish that is none."""
    _check(wish)
    catalogue = load_catalogue()
    pairs = [
        (valve, actuator)
        for valve in catalogue.groups["valves"].values()
        for actuator in catalogue.groups["actuators"].values()
        # A part without a largest pressure in the catalogue is not left out.
        if rated_pressure(valve, actuator) >= wish.pressure
    ]
    tried: list[Tried] = []
    for place, (valve, actuator) in enumerate(pairs):
        report(Progress(f"walking with {valve.name}", place, len(pairs), noun="pairs"))
        tried += _few_strides(wish, valve, actuator)
    bottles = sorted(catalogue.groups["bottles"].values(), key=lambda bottle: bottle.full_mass)
    found = _lightest(wish, tried, bottles, report)
    if found is None:
        return WearerSizing(wish, tuple(tried), None, tuple(_instead(wish, tried, bottles, report)))
    one, bottle, walked = found
    life = endurance_of_walk(walked)
    assert life is not None, "a walk on a bottle that has a torque took gas"
    processor, cell = catalogue.part("processors", _PROCESSOR), catalogue.part("batteries", _CELL)
    electrical = electrical_of(walked.recording, one.valve, _SHUT_OFF["power"], processor, cell, wish.seconds)
    regulators = [catalogue.part("regulators", name) for name in _REGULATORS]
    masses = {
        f"actuator {one.actuator.name}": one.actuator.full_mass,
        f"valve {one.valve.name}": one.valve.full_mass,
        f"bottle {bottle.name}, full": bottle.full_mass,
        **{f"regulator {part.name}": part.full_mass for part in regulators},
        "shut-off valve": _SHUT_OFF["mass"],
        f"processor {processor.name}": processor.full_mass,
        f"battery, {electrical.cells} x {cell.name}": electrical.mass,
    }
    return WearerSizing(wish, tuple(tried), Device(one, bottle, walked, life, electrical, masses), ())


def _check(wish: Wish) -> None:
    low, high = STATURES
    mass = next(item for item in WEARER if item.name == "body_mass")
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
    if wish.stature is not None and not low <= wish.stature <= high:
        raise StudyError(
            f"--stature: {wish.stature:g} m: segments are known of adults of {low:g} to {high:g} m; take a gait and "
            "a wearer of your own in a walk file"
        )


def _few_strides(wish: Wish, valve: Part, actuator: Part) -> list[Tried]:
    """Return a few strides with a pair of parts; with a torque controller the lowest request that gives the torque."""
    gauge = wish.pressure - STANDARD_ATMOSPHERE
    units = {item.name: item.unit for item in (*ORIFICE, *VALVES[valve.kind].quantities, *ACTUATOR)}
    numbers = {**valve.model_numbers, **{f"actuator.{name}": actuator.values[name] for name in _OF_ACTUATOR}}
    overrides = [
        f"wearer.body_mass={wish.mass:.6g} kg",
        f"wearer.stature={wish.height:.6g} m",
        f"supply.pressure={wish.pressure:.7g} Pa_a",
        f"supply.dorsiflexion_pressure={STANDARD_ATMOSPHERE + _DORSIFLEXION * gauge:.7g} Pa_a",
        *(f"{path}={number:.6g} {units[path.partition('.')[2]]}".strip() for path, number in numbers.items()),
        f"shut_off.area={_SHUT_OFF['area']:g} m^2",
    ]
    held = actuator.values["torque_constant"] * gauge
    # No request above what the supply pressure can hold with this actuator.
    requests = [min(factor * wish.torque, held) for factor in _REQUESTS] if valve.kind == "proportional" else [None]
    best = None
    # Requests that the limit made equal are walked with once.
    for request in dict.fromkeys(requests):
        chosen = tuple(overrides)
        if request is not None:
            chosen += (f"controller.peak_torque={request:.4g} N m",)
        # A controller requests no more than its limit, which therefore has to follow.
        if request is not None and request > _LIMIT:
            chosen += (f"controller.largest_torque={request:.4g} N m",)
        result = walk(load_walk(WALKS[valve.kind], chosen), minutes=_FEW)
        if not result.status.is_completed or not result.is_helped or not result.averages:
            continue
        stride = walk_of(result.scenario).gait.stride_time
        flow, torque = result.metrics["gas"].value / stride, float(result.averages["torque"].mean.max())
        best = Tried(valve, actuator, chosen, torque, flow) if best is None or torque > best.torque else best
        if torque >= wish.torque:
            break
    return [] if best is None else [best]


_OF_ACTUATOR = ("torque_constant", "displacement_per_radian")


def _lightest(
    wish: Wish, tried: list[Tried], bottles: list[Part], report: Report
) -> tuple[Tried, Part, WalkResult] | None:
    """Return the lightest pair and bottle that walk for the time with the torque, with that walk; None if none does.

    No pair whose gas might do is left out, so that what is offered is found when it is asked for.
    """
    # Heaviest first: of pairs with the same overrides the lightest replaces the others.
    strong = {one.overrides: one for one in sorted(tried, key=lambda one: -one.mass) if one.torque >= wish.torque}
    pairs = [(one, bottle) for one in strong.values() for bottle in bottles]
    too_thirsty: dict[str, float] = {}
    for one, bottle in sorted(pairs, key=lambda pair: pair[0].mass + pair[1].full_mass):
        largest_flow = min(bottle.values["content"] / wish.seconds, too_thirsty.get(bottle.name, np.inf))
        if one.flow > largest_flow:
            continue
        report(Progress(f"walking on {bottle.name}", 0, 0, noun="bottles"))
        walked = _walked(one, bottle, wish.seconds)
        if _time(walked) < wish.seconds:
            too_thirsty[bottle.name] = _lasting_flow(one, _time(walked), wish.seconds)
        elif _keeps(walked, wish.torque):
            assert walked is not None, "it lasts"
            return one, bottle, walked
    return None


def _walked(one: Tried, bottle: Part, seconds: float) -> WalkResult | None:
    """Walk for a time [s], or until the bottle ends it; None where it cannot feed the device at all."""
    try:
        return walk(load_walk(WALKS[one.valve.kind], one.overrides, bottle=bottle.name), minutes=seconds / 60.0)
    except ScenarioError:
        return None


def _time(walked: WalkResult | None) -> float:
    """Return how long a walk on a bottle lasts [s], infinite where its bottle did not end it."""
    if walked is None or walked.supply is None or not walked.status.is_completed:
        return 0.0
    return math.inf if walked.supply.ending.kind == WALKED else float(walked.recording.time[-1])


def _lasting_flow(one: Tried, lasted: float, seconds: float) -> float:
    """Return the flow [kg/s] above which no pair lasts on a bottle, from one that does not, with some allowance."""
    return one.flow * min(0.99, max(0.5, _ALLOWANCE * lasted / seconds))


def _keeps(walked: WalkResult | None, torque: float) -> bool:
    """True where the mean stride of a walk on a bottle has most of a torque [N m]."""
    return walked is not None and bool(walked.averages) and walked.averages["torque"].mean.max() >= _KEPT * torque


def _instead(wish: Wish, tried: list[Tried], bottles: list[Part], report: Report) -> Iterator[str]:
    """Yield what would do instead, each as it walked on the largest bottle: who asks for exactly that gets it."""
    largest = max(bottles, key=lambda bottle: bottle.values["content"])
    if not tried:
        yield "no pair of valve and actuator may have this pressure, or none helps: take another pressure"
        return
    lower = [(wish, one) for one in tried]
    # At less pressure the pairs that have the most torque for their gas.
    thrifty = sorted((one for one in tried if one.flow > 0.0), key=lambda one: -one.torque / one.flow)
    # Actuators of the same numbers walk alike: one of them is enough.
    pairs = list({(one.valve.name, one.torque, one.flow): one for one in thrifty}.values())[:_OFFERED]
    for place, share in enumerate(_LESS_PRESSURE):
        report(Progress("walking at less pressure", place, len(_LESS_PRESSURE), noun="pressures"))
        asked = wish.at_gauge(share)
        if STANDARD_ATMOSPHERE < asked.pressure < wish.pressure:
            lower += [(asked, again) for one in pairs for again in _few_strides(asked, one.valve, one.actuator)]
    strong = sorted((item for item in lower if item[1].torque >= wish.torque), key=lambda item: item[1].flow)
    weak = sorted((item for item in lower if item[1].torque < wish.torque), key=lambda item: -item[1].torque)
    report(Progress(f"walking on {largest.name}", 0, 0, noun="bottles"))
    first = _offered(*(strong or weak)[0], largest)
    if first is not None:
        yield _offer_text(wish, *first, largest)
    if not strong:
        more = (_offered(*item, largest) for item in _at_more_pressure(wish, tried))
        yield from itertools.islice((_offer_text(wish, *found, largest) for found in more if found is not None), 1)
    # A walk that ends early is no full answer: less torque for the whole time is offered beside it.
    if first is None or first[0].seconds < wish.seconds:
        found = _lasting(wish, weak, largest)
        if found is not None:
            yield _offer_text(wish, *found, largest)


def _lasting(wish: Wish, weak: list[tuple[Wish, Tried]], bottle: Part) -> tuple[Wish, Tried] | None:
    """Return what walks on a bottle for all of the time, of pairs with the most torque first; None if none does."""
    largest_flow = _USED * bottle.values["content"] / wish.seconds
    for asked, one in weak:
        if one.flow > largest_flow:
            continue
        found = _offered(asked, one, bottle)
        if found is not None and found[0].seconds == wish.seconds:
            return found
        largest_flow = _lasting_flow(one, 0.0 if found is None else found[0].seconds, wish.seconds)
    return None


def _offered(asked: Wish, one: Tried, bottle: Part) -> tuple[Wish, Tried] | None:
    """Return what a pair has of a wish, rounded down, as it walked on a bottle; None where that is nothing."""
    if one.torque < asked.torque:
        asked = replace(asked, torque=math.floor(100.0 * one.torque) / 100.0)
    for again in _few_strides(asked, one.valve, one.actuator):
        walked = _walked(again, bottle, asked.seconds)
        # Rounded down to what a command line can say, so that a run from that line still meets the offer.
        hundredths = math.floor(min(_time(walked), asked.seconds) / 0.6)  # of a minute
        lasts = asked.seconds if _time(walked) >= asked.seconds else 0.6 * hundredths
        if again.torque >= asked.torque > 0.0 and lasts >= _SHORTEST and _keeps(walked, asked.torque):
            return replace(asked, seconds=lasts), again
    return None


def _offer_text(wish: Wish, asked: Wish, one: Tried, bottle: Part) -> str:
    """Return a wish that is offered for another, whole, with what it changes in front and the parts that walked."""
    changes = [
        *(["less torque"] if asked.torque < wish.torque else []),
        *(["less pressure"] if asked.pressure < wish.pressure else []),
        *(["more pressure"] if asked.pressure > wish.pressure else []),
        *(["fewer minutes"] if asked.seconds < wish.seconds else []),
    ]
    return f"{', '.join(changes)}: {_wished(asked)} with {one.valve.name} and {one.actuator.name} on {bottle.name}"


def _wished(wish: Wish) -> str:
    pressure = Kind("", "Pa_a", "pressure").text(wish.pressure)
    return f"{_TORQUE.text(wish.torque)} at {pressure} for {wish.seconds / 60.0:.4g} min"


def _at_more_pressure(wish: Wish, tried: list[Tried]) -> Iterator[tuple[Wish, Tried]]:
    """Yield what has the torque at more pressure, of the strongest pair of each kind of valve, the lowest first."""
    strongest = [
        max((one for one in tried if one.valve.kind == kind), key=lambda one: one.torque)
        for kind in dict.fromkeys(one.valve.kind for one in tried)
    ]
    for more in _MORE_PRESSURE:
        asked = wish.at_gauge(more)
        for one in strongest:
            if rated_pressure(one.valve, one.actuator) < asked.pressure:
                continue
            for again in _few_strides(asked, one.valve, one.actuator):
                if again.torque >= wish.torque:
                    yield asked, again


_TORQUE, _MASS = Kind("", "N m", "torque", ".3g"), Kind("", "kg", "part mass")
_HEAD = (
    "valve",
    "actuator",
    ("peak torque", _TORQUE),
    ("gas", Kind("", "kg/s", "mass flow", ".3g")),
    ("mass of both", _MASS),
)
_CAPTION = "The walk of the suggestion on its bottle for the requested {wished}; the bottle lasts {lasts}."
_READING = (
    "Every pair of valve and actuator of the catalogue walks a few strides at the pressure. Those whose mean stride "
    "reaches the torque walk on bottles, lightest first, until one lasts; that walk is shown. Dead volumes, friction "
    "and sensors are the walk's; dorsiflexion has nine tenths of the gauge pressure.",
    "Power of the valve is what its coils, or its spool in proportion to the stroke, take over the walk; drivers lose "
    "nothing. A shut-off valve is open as long as the device helps. Shell, straps and lines are not in the mass.",
)


def finding_of(sizing: WearerSizing) -> Finding[WearerSizing]:
    """Return the device with its walk, or what to give up; it has not passed without a device."""
    wish, device = sizing.wish, sizing.device
    rows = [
        (one.valve.name, one.actuator.name, one.torque, one.flow, one.mass)
        for one in sorted(sizing.tried, key=lambda one: -one.torque)
    ]
    tried = finding.Part("What was walked with", columns_of(_HEAD, rows), left=2, is_detail=device is not None)
    stature = f"{wish.height:.4g} m{' (assumed: give --stature)' if wish.stature is None else ''}"
    sections = (
        (finding.Part(remarks=("no device of the catalogue has this; give up one of:", *sizing.instead)), tried)
        if device is None
        else (*_sections(wish, device), tried, *parts_to_check(sizing.doubtful), part_titles(sizing.parts))
    )
    return Finding(
        name="design",
        kicker="From a wearer to a device",
        title="The device",
        said=(f"a wearer of {wish.mass:.4g} kg and {stature}; {_wished(wish)}",),
        parts=(*sections, finding.Part("How to read it", said=_READING, is_detail=True)),
        found=sizing,
        passed=device is not None,
    )


def _sections(wish: Wish, device: Device) -> tuple[finding.Part, ...]:
    walked = device.walked
    share = device.torque / wish.torque
    # A walk on a bottle may end at nine tenths of the request, so how far it fell short is said.
    short = f" ({100.0 * share:.0f} % of the request: pressure falls with the bottle)" if share < 1.0 else ""
    low, high = (share * walk_of(walked.scenario).gait.body_mass for share in SCALED_MASS)
    wanted, lasts = f"{wish.seconds / 60.0:.4g} min", minutes_text(device.life.discharge.walking_time)
    last = _TORQUE.text(float(peak_torques(walked)[-1]))
    rows = (
        ("controller", f"{walked.scenario.controller.kind}, walk '{WALKS[device.tried.valve.kind]}'"),
        ("lasts", f"{lasts}, of {wanted}"),
        ("then", device.life.discharge.ending.message),
        ("peak torque", f"{_TORQUE.text(device.torque)} in the mean stride{short}, {last} in the last"),
        ("gas", f"{Kind('', 'kg', 'gas mass', '.3g').text(walked.metrics['gas'].value)} a stride"),
        ("mass", _MASS.text(sum(device.masses.values()), ".0f")),
    )
    remarks = [
        *electrical_sentences(device.electrical),
        who_walks(walk_of(walked.scenario).wearer, walk_of(walked.scenario).gait, "as requested"),
    ]
    if not low <= wish.mass <= high:
        remarks.append(f"the gait is known of {low:.0f} to {high:.0f} kg: beyond, torque and gas are a guess")
    caption, draw = _CAPTION.format(wished=wanted, lasts=lasts), partial(bottle_figure, walked)
    masses = ((name, _MASS.text(mass, ".0f")) for name, mass in device.masses.items())
    return (
        finding.Part("The walk on its bottle", facts(rows), remarks=remarks, code=device.command),
        finding.Part("What it weighs", facts(masses)),
        finding.Part("The bottle over the walk", name="bottle", caption=caption, draw=draw, is_detail=True),
    )
