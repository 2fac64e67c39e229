"""The integer walking controller in the lanes: its whole numbers from settings in SI units, and its declaration.

Settings become counts, samples and fractions of 15 bits. The lanes keep whole numbers in floats.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

from ppafo.control.fixed import walking_law
from ppafo.control.fixed.chamber_observer import OBSERVER_RANGES, OBSERVER_START, OF_OBSERVER, observer_numbers
from ppafo.control.fixed.torque_laws import FixedLaw
from ppafo.control.fixed.whole_numbers import COMMAND_STEPS, FRACTION_BITS, LARGEST_FRACTION, each
from ppafo.control.walking import safety, signs
from ppafo.control.walking.event_on_off import EVENT_ON_OFF as FLOAT_KIND
from ppafo.control.walking.safety import START as SAFETY_START
from ppafo.control.walking.safety import Finding, later_finding
from ppafo.model.declaration import Quantity
from ppafo.model.sensors import GaitMeasurement
from ppafo.model.valves.kind import VENT

SHARE: float = 2.0**FRACTION_BITS
ROUNDING = 1.0e-6
"""Of a sample: a time of whole samples is not taken for one more because of its last bit."""


def _count(name: str, summary: str) -> Quantity:
    return Quantity(name, "", f"{summary}, in counts", None, 0.0, float(walking_law.TOP))


def _samples(name: str, summary: str) -> Quantity:
    return Quantity(name, "", f"{summary}, in samples", None, 0.0, float(walking_law.LONGEST))


def _stride_share(name: str, summary: str) -> Quantity:
    return Quantity(name, "", f"{summary}, in 1/2^14 of the stride time", None, 0.0, float(LARGEST_FRACTION))


def _share(name: str, summary: str) -> Quantity:
    return Quantity(name, "", f"{summary}, in 1/2^15", None, 0.0, float(LARGEST_FRACTION))


def _strides(name: str, summary: str) -> Quantity:
    return Quantity(name, "", summary, None, 0.0, float(walking_law.MOST_STRIDES))


NUMBERS = (
    _count("lifts_above", "angle above which the foot is lifted"),
    _count("lets_go_below", "angle below which it is let go"),
    _stride_share("push_off_end", "end of the push-off"),
    _count("load", "a force sensor counts as loaded above this"),
    _count("unload", "and as unloaded below this"),
    _samples("debounce", "a change of load counts when it has lasted this long"),
    Quantity(
        "first_stride",
        "",
        "stride time until one is measured, in halves of a sample",
        None,
        0.0,
        float(walking_law.HALVES),
    ),
    _share("stride_weight", "weight of a new stride in the moving average"),
    _stride_share("push_off_start", "start of the push-off"),
    _count("lowest_force", "a force below this is no reading"),
    _count("largest_force", "a force above this is no reading"),
    _count("lowest_angle", "an angle below this is no reading"),
    _count("highest_angle", "an angle above this is no reading"),
    _count("lowest_pressure", "a pressure below this is no reading"),
    _count("highest_pressure", "a pressure above this is no reading"),
    _count("thin", "no chamber stays below this pressure"),
    _samples("thin_time", "for longer"),
    _stride_share("longest_phase", "longest stance or swing"),
    _stride_share("flat_from", "from here on heel and toes are both loaded"),
    _stride_share("flat_to", "and until here"),
    _stride_share("shortest_swing", "shortest swing of a steady stride"),
    _share("steady", "by how much a usual stride is longer or shorter"),
    _strides("most_toe_strides", "strides in a row that may be on the toes alone"),
    _strides("resume_strides", "good strides in a row after which a pause ends"),
    _count("lowest_flat_angle", "no ankle has less while the foot stands flat"),
    _count("highest_flat_angle", "no ankle has more while the foot stands flat"),
    _samples("frozen", "a loaded sensor whose reading stays the same for longer is frozen"),
    _stride_share("dwells", "and for more than this part of a stride"),
    _stride_share("turns_back", "an angle for this part"),
    _count("largest_drop", "no force above this is gone within a sample"),
    _count("gone", "a force below this is gone"),
    _samples("vent", "both chambers are vented when the valve has vented them for longer"),
    _count("filled", "a filled chamber has a higher pressure, a vented one a lower"),
    _count("squeezes", "from this angle on the ankle compresses chamber 2 to any pressure"),
    _samples("stands_up", "who stands for longer after sitting is helped again"),
    _count("rests", "an ankle within this of its angle on the ground rests"),
    _share("slow_share", "share of a change that slow readings take at once"),
    _share("fall_share", "share of a change that slow pressures take at once"),
    _stride_share("lands", "who comes down on the heel steps within this"),
    _count("moves", "a force further than this from its slow reading moves"),
    _count("turns", "an angle further than this from its slow reading moves"),
    _count("fades", "what the highest angle of a swing loses at each sample"),
    _count("turned_up", "by how much a foot has turned up at a strike in doubt"),
    _count("turns_down", "a foot that turns down by more lands now"),
    _count("is_flat", "one that turns up by more is flat"),
    _count("toes_late", "toes that leave the ground at a larger angle do so late"),
    _count("toes_in_time", "and at a smaller one in time"),
    *OF_OBSERVER,
)
"""Every number of ``event_on_off.WalkNumbers``, in order."""


def whole_numbers(
    settings: Mapping[str, float], period: float, converter: walking_law.GaitConverter
) -> dict[str, float]:
    """Whole numbers by name, not yet limited, for settings in SI units and a sample period [s]."""
    angle, force, pressure = (
        step / converter.scale for step in (converter.angle_step, converter.force_step, converter.pressure_step)
    )
    steps = {
        "rests": safety.RESTS / angle,
        "moves": signs.MOVES / force,
        "turns": signs.TURNS / angle,
        "fades": signs.FADES * period / angle,
        "turned_up": signs.TURNED_UP / angle,
        "turns_down": signs.TURNS_DOWN / angle,
        "is_flat": signs.IS_FLAT / angle,
    }
    strides = {
        name: settings[name] * walking_law.STRIDE_SHARE
        for name in ("push_off_end", "push_off_start", "longest_phase", "flat_from", "flat_to", "shortest_swing")
    }
    shares = {
        "steady": safety.STEADY * SHARE,
        "dwells": signs.DWELLS * walking_law.STRIDE_SHARE,
        "turns_back": signs.TURNS_BACK * walking_law.STRIDE_SHARE,
        "lands": signs.LANDS * walking_law.STRIDE_SHARE,
        "stride_weight": settings["stride_weight"] * SHARE,
        "slow_share": period / (period + signs.SLOW_TIME) * SHARE,
        "fall_share": period / (period + signs.FALL_TIME) * SHARE,
    }
    counted = {name: min(settings[name], walking_law.MOST_STRIDES) for name in ("most_toe_strides", "resume_strides")}
    found = _levels(settings, period, converter) | steps | strides | shares | counted
    rounded = {name: float(int(value + 0.5)) for name, value in found.items()} | _times(settings, period)
    rounded |= observer_numbers(settings, period, angle, pressure)
    return {item.name: rounded[item.name] for item in NUMBERS}


def _levels(settings: Mapping[str, float], period: float, converter: walking_law.GaitConverter) -> dict[str, float]:
    """Readings in counts that others are compared with; a limit is within what the converter can show."""
    forces = {
        "load": settings["load_threshold"],
        "unload": settings["unload_threshold"],
        "lowest_force": settings["lowest_force"],
        "largest_force": settings["largest_force"],
        "largest_drop": settings["largest_drop"],
        "gone": signs.GONE * settings["largest_drop"],
    }
    angles = {name: settings[name] for name in ("lowest_angle", "highest_angle", "lowest_flat_angle")}
    angles |= {
        "highest_flat_angle": settings["highest_flat_angle"],
        "lifts_above": settings["swing_angle"] + settings["band"],
        "lets_go_below": settings["swing_angle"] - settings["band"],
        "squeezes": signs.SQUEEZING_ANGLE,
        "toes_late": settings["highest_toe_off_angle"],
        "toes_in_time": settings["highest_toe_off_angle"] - signs.IN_TIME,
    }
    pressures = {"filled": settings["filled_pressure"], "thin": signs.THIN}
    pressures |= {name: settings[name] for name in ("lowest_pressure", "highest_pressure")}
    found = {name: (value - converter.force_zero) / converter.force_step for name, value in forces.items()}
    found |= {name: value / converter.angle_step for name, value in angles.items()}
    found |= {name: value / converter.pressure_step for name, value in pressures.items()}
    ends = {"lowest_force", "largest_force", "lowest_angle", "highest_angle", "lowest_pressure", "highest_pressure"}
    for name in ends & set(found):
        found[name] = min(max(found[name], 1.0), converter.top - 1.0)
    # Who samples slowly may miss how a force goes: no reading is above the largest.
    found["largest_drop"] = found["largest_drop"] if period < signs.QUICK_PERIOD else converter.top
    return {name: value * converter.scale for name, value in found.items()}


def _times(settings: Mapping[str, float], period: float) -> dict[str, float]:
    """Times in samples: those that must be passed rounded down, those that must be reached rounded up."""
    passed = {
        "frozen": settings["frozen_time"],
        "thin_time": signs.THIN_TIME,
        "vent": settings["vent_time"],
        "stands_up": safety.STANDS_UP,
    }
    found = {name: float(int(time / period + ROUNDING)) for name, time in passed.items()}
    found["debounce"] = float(-int(-(settings["debounce"] / period - ROUNDING) // 1))
    return found | {"first_stride": float(int(2.0 * settings["first_stride_time"] / period + 0.5))}


class WalkRows(NamedTuple):
    """The converter, and the numbers of the law."""

    converter: walking_law.GaitConverter
    numbers: walking_law.WalkNumbers


class PhaseShown(NamedTuple):
    """The phase, where recordings look for it."""

    phase: float


class SafetyShown(NamedTuple):
    """Level, how often help got less, and the last sign with the readings then: what recordings tell of a walk."""

    level: float
    ventings: float
    finding: Finding


class WalkStateRows(NamedTuple):
    """What recordings look for, and the state of the law."""

    phase: PhaseShown
    safety: SafetyShown
    counts: walking_law.WalkCounts


def update(
    parameters: WalkRows, state: WalkStateRows, reference: float, measurement: GaitMeasurement, period: float
) -> tuple[float, WalkStateRows]:
    """Command [-] that ``sample`` gives for what the converter shows: 1, -1 or ``VENT``."""
    before = each(int, state.counts)
    readings = walking_law.read_gait(parameters.converter, measurement)
    steps, after = walking_law.sample(each(int, parameters.numbers), before, readings)
    command = float(steps) / COMMAND_STEPS if steps != 0 else VENT
    vents = after.safety.level > before.safety.level
    shown = SafetyShown(
        level=float(after.safety.level),
        ventings=state.safety.ventings + (1.0 if vents else 0.0),
        finding=later_finding(vents, float(after.safety.sign), measurement, state.safety.finding),
    )
    return command, WalkStateRows(PhaseShown(float(after.phase.phase)), shown, each(float, after))


_TRACE = walking_law.TraceCounts(last=0, still=0, slow=0)
START_COUNTS = walking_law.WalkCounts(
    phase=walking_law.PhaseCounts(
        phase=0,
        heel=walking_law.SwitchCounts(0, 0),
        toe=walking_law.SwitchCounts(0, 0),
        spell=0,
        since_strike=0,
        stride=0,
        strikes=0,
    ),
    safety=walking_law.SafetyCounts(
        level=0,
        sign=0,
        good_strides=0,
        heel_seen=0,
        toe_seen=0,
        flat_angle=0,
        toe_strides=0,
        steady=0,
        side=0,
        held=0,
        seen=walking_law.SensorCounts(_TRACE, _TRACE, _TRACE),
        landing=walking_law.LandingCounts(lowest=0, mark=0, late=0, late_toes=0),
        observer=OBSERVER_START,
        slow=walking_law.PressureCounts(0, 0),
        thin=0,
    ),
    lifting=0,
)
"""Nothing seen yet."""

_BIT, _TIME, _READING = (0, 1), (0, walking_law.LONGEST), (0, walking_law.TOP)
STATE_RANGES = {
    "phase": (0, walking_law.PUSH_OFF),
    "loaded": _BIT,
    "against": _TIME,
    "spell": _TIME,
    "since_strike": _TIME,
    "stride": (0, walking_law.HALVES),
    "strikes": (0, walking_law.SEVERAL),
    "level": (0, walking_law.STOPPED),
    "sign": (0, walking_law.LATE_FORCES),
    "good_strides": (-1, walking_law.MOST_STRIDES),
    "heel_seen": _BIT,
    "toe_seen": _BIT,
    "flat_angle": _READING,
    "toe_strides": (0, walking_law.MOST_STRIDES),
    "steady": _BIT,
    "side": (-1, 1),
    "held": _TIME,
    "last": _READING,
    "still": _TIME,
    "slow": _READING,
    "lowest": _READING,
    "mark": _READING,
    "late": (0, walking_law.MOST_LATE),
    "late_toes": (0, walking_law.MOST_LATE),
    **OBSERVER_RANGES,
    "first": _READING,
    "second": _READING,
    "thin": _TIME,
    "lifting": _BIT,
}
"""Lowest and highest of every number of ``WalkCounts``, by its own name."""


SIGN_BITS = 8
"""A chip reports its level above these bits of a word, and its sign in them."""


def level_and_sign(state: walking_law.WalkCounts) -> int:
    """Level and last sign in one word."""
    return (state.safety.level << SIGN_BITS) + state.safety.sign


EVENT_ON_OFF = FixedLaw(
    kind=replace(
        FLOAT_KIND,
        quantities=(*walking_law.OF_CONVERTER, *NUMBERS),
        parameters=WalkRows,
        initial=WalkStateRows(PhaseShown(0.0), SafetyShown(0.0, 0.0, SAFETY_START.finding), each(float, START_COUNTS)),
        update=update,
    ),
    sample=walking_law.sample,
    numbers=walking_law.WalkNumbers,
    readings=walking_law.GaitReadings,
    status=level_and_sign,
    begins=START_COUNTS,
    state_ranges=STATE_RANGES,
    number_quantities=NUMBERS,
    prepare=whole_numbers,
)
FIXED_WALKS: dict[str, FixedLaw] = {EVENT_ON_OFF.name: EVENT_ON_OFF}
"""Walking controllers that have an integer form, by name."""
