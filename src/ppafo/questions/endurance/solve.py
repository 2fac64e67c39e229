"""How long one bottle lasts for a gas use, with and without reuse of the exhaust; for several uses side by side."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ppafo.answers.display_units import quantity_text
from ppafo.constants import GRAMS_PER_KILOGRAM, STANDARD_ATMOSPHERE
from ppafo.errors import DataError, ParameterError, UnitError, nearest_name, one_line, refused_as
from ppafo.model.declaration import Quantity
from ppafo.model.exhaust_reuse import ReuseCycle
from ppafo.model.plant import chamber_1_volume, chamber_2_volume
from ppafo.parameters import load_device
from ppafo.parameters.bottles.bottle import PAPER_BOTTLE, Bottle, load_bottle
from ppafo.parameters.declaration import is_within
from ppafo.questions.endurance.answer import GIVEN, Endurance, Endurances, Reuse
from ppafo.questions.endurance.discharge import check_schedule, discharge, discharge_of_life, smallest_mass_when_warm
from ppafo.questions.endurance.draw import (
    Draw,
    FullChambers,
    WalkGas,
    draw_of_numbers,
    draw_of_recording,
    draw_of_walk,
    full_chambers,
    is_walk_folder,
    read_walk_gas,
    walk_gas,
)
from ppafo.signals import Recording
from ppafo.simulation.scenario import Scenario
from ppafo.storage.result_folder import read_recording
from ppafo.units import parse_quantity
from ppafo.walking import WalkResult
from ppafo.walking.bottle import Schedule
from ppafo.walking.loading import on_bottle
from ppafo.walking.motion import walk_of
from ppafo.walking.walk import bottle_life

REUSE = (
    Quantity("reservoir_volume", "m^3", "volume of the reservoir between the chambers", minimum=0.0, maximum=0.1),
    Quantity("exhaust_pressure", "Pa_a", "pressure of the plantarflexion chamber when it vents", 0.0, 1e4, 5e6),
    Quantity("fill_pressure", "Pa_a", "pressure that dorsiflexion needs", 0.0, 1e4, 5e6),
    Quantity("exhaust_volume", "m^3", "volume of the plantarflexion chamber when it vents", 0.0, 1e-7, 1e-2),
    Quantity("fill_volume", "m^3", "volume of the other chamber when it is filled", 0.0, 1e-7, 1e-2),
)
_BY_NAME = {item.name: item for item in REUSE}
PAPER_DEVICE = "ppafo2011"
TOE_OFF_ANGLE, NEUTRAL_ANGLE = "110 deg", "90 deg"
"""Where the chambers vent and fill unless their volumes are given: 20 deg of plantarflexion at toe-off, and the
neutral angle at which the paper holds the foot in swing."""
_DEFAULT = "the regulator's pressure, and the paper's device at toe-off and in neutral position"


def check_reuse(reused: Reuse, mass_per_stride: float) -> None:
    """Refuse a cycle that does not belong to a gas use of ``mass_per_stride`` [kg] a stride without a reservoir.

    ParameterError for pressures below the atmosphere, and for chambers that hold more than the stride takes.
    """
    for name in ("exhaust_pressure", "fill_pressure"):
        if getattr(reused.cycle, name) < reused.cycle.atmospheric_pressure:
            raise ParameterError(f"--reuse {name}: must be at least the atmospheric pressure")
    balance = reused.balance
    filled = balance.exhausted_mass + balance.returned_mass + balance.topped_up_mass
    if filled > mass_per_stride:
        raise ParameterError(
            f"--reuse: the chambers take {filled * GRAMS_PER_KILOGRAM:.3g} g a stride at these pressures and volumes, "
            f"more than the {mass_per_stride * GRAMS_PER_KILOGRAM:.3g} g of the gas use; give the exhaust_pressure, "
            "fill_pressure, exhaust_volume and fill_volume of that gas use"
        )


def parse_reuse(
    texts: Iterable[str],
    bottle: Bottle,
    chambers: FullChambers | None = None,
    atmosphere: float = STANDARD_ATMOSPHERE,
) -> Reuse:
    """Return the cycle of texts such as ``reservoir_volume=50 cm^3``; the reservoir must be given.

    What is not given of the chambers is that of ``chambers``, of a walk. Without a walk pressures are the regulator's
    and volumes those of the paper's device at toe-off and in neutral. The device lets gas out into ``atmosphere`` [Pa
    absolute], from which gauge pressures count.
    """
    values: dict[str, float] = {}
    for text in texts:
        name, separator, quantity = (part.strip() for part in one_line(text).partition("="))
        if name not in _BY_NAME or not separator:
            known = ", ".join(_BY_NAME)
            raise ParameterError(
                f"--reuse {name}: is not of the form NAME=VALUE{nearest_name(name, _BY_NAME)}; names are {known}"
            )
        if name in values:
            raise ParameterError(f"--reuse {name}: given twice; give it once")
        values[name] = _value(_BY_NAME[name], quantity, atmosphere)
    if "reservoir_volume" not in values:
        raise ParameterError(
            "--reuse: give at least the volume of the reservoir, for example --reuse 'reservoir_volume=50 cm^3'"
        )
    found, origin = (_defaults(bottle), _DEFAULT) if chambers is None else _chamber_values(chambers)
    cycle = ReuseCycle(
        **(found | values),
        atmospheric_pressure=atmosphere,
        gas_product=bottle.fluid.table.gas_constant * bottle.room_temperature,
    )
    return Reuse(cycle, {item.name: GIVEN if item.name in values else origin for item in REUSE})


def _value(quantity: Quantity, text: str, atmosphere: float) -> float:
    with refused_as(ParameterError, f"--reuse {quantity.name}={text}", UnitError):
        value = parse_quantity(text, quantity.unit, atmosphere)
    if not is_within(value, quantity):
        raise ParameterError(
            f"--reuse {quantity.name}={text}: {quantity.summary} must be from {quantity.minimum:g} to "
            f"{quantity.maximum:g} {quantity.unit}"
        )
    return value


def _chamber_values(chambers: FullChambers) -> tuple[dict[str, float], str]:
    """Return pressures and volumes of the chambers at their fullest, and the words for where they come from."""
    names = ("exhaust_pressure", "exhaust_volume", "fill_pressure", "fill_volume")
    return {name: getattr(chambers, name) for name in names}, f"from the walk, mean over {chambers.strides} strides"


def _defaults(bottle: Bottle) -> dict[str, float]:
    actuator = load_device(PAPER_DEVICE).actuator
    toe_off, neutral = (parse_quantity(text, "rad") for text in (TOE_OFF_ANGLE, NEUTRAL_ANGLE))
    return {
        "exhaust_pressure": bottle.regulator.set_pressure,
        "fill_pressure": bottle.regulator.set_pressure,
        "exhaust_volume": chamber_1_volume(
            toe_off, actuator.angle_min, actuator.volume_per_angle, actuator.dead_volume_1
        ),
        "fill_volume": chamber_2_volume(neutral, actuator.angle_max, actuator.volume_per_angle, actuator.dead_volume_2),
    }


GasUse = str | Path | Recording | WalkResult
"""A file, a result folder, the folder of a walk, or what was read or returned of them."""
_BETWEEN_RESTS = 600.0
_STRIDE_TIME = 1.1
_LONGEST = 24.0 * 3600.0
_FEW = 15.0
"""Seconds that are walked to see how full other chambers get."""
WITHOUT_REST = Schedule(_LONGEST, 0.0, _LONGEST)


def endurance(
    recordings: GasUse | Sequence[GasUse] = (),
    gas_per_stride: float | None = None,
    stride_time: float | None = None,
    peak_flow: float | None = None,
    bottle: str | Path | None = None,
    walk: float | None = None,
    rest: float | None = None,
    longest: float = _LONGEST,
    reuse: Iterable[str] = (),
    overrides: Iterable[str] = (),
) -> Endurance | Endurances:
    """Return how long a full bottle lasts for a gas use that continues; ``Endurances`` for several recordings.

    A walk, its result or its folder, walks on the bottle until that ends it; ``bottle`` is its own, or the paper's,
    unless given. Any other gas use is that of ``recordings``, or else ``gas_per_stride`` [kg] every ``stride_time`` [s]
    (default 1.1 s) with at most ``peak_flow`` [kg/s] (the mean flow). ``walk`` [s], 10 min unless given, and ``rest``
    [s] take turns, for at most ``longest`` [s]. ``reuse`` are texts such as ``reservoir_volume=50 cm^3``, and
    ``overrides`` such as ``room.temperature=5 degC``.
    ParameterError or DataError for bad input, SimulationError where the solver fails.
    """
    given = (recordings,) if isinstance(recordings, str | Path | Recording | WalkResult) else tuple(recordings)
    if bool(given) == (gas_per_stride is not None):
        raise ParameterError("give either a recording or --gas-per-stride, for example --gas-per-stride '0.3 g'")
    if walk is not None and rest is None:
        raise ParameterError("--walk: is the time between two rests: give --rest too, or --longest for the whole time")
    schedule, changes = Schedule(_BETWEEN_RESTS if walk is None else walk, rest or 0.0, longest), tuple(reuse)
    chosen = _Bottle(bottle, tuple(overrides))
    if gas_per_stride is not None:
        full = chosen.load()
        draw = draw_of_numbers(gas_per_stride, _STRIDE_TIME if stride_time is None else stride_time, peak_flow)
        return follow_bottle(full, draw, schedule, parse_reuse(changes, full) if changes else None)
    if peak_flow is not None:
        raise ParameterError("--peak-flow belongs to --gas-per-stride; a recording has its own largest flow")
    names = [_name(use) for use in given]
    if len(set(names)) < len(names):
        raise ParameterError("the same recording is given twice")
    found = {
        name: _endurance_of_use(use, stride_time, chosen, schedule, changes)
        for name, use in zip(names, given, strict=True)
    }
    return found[names[0]] if len(found) == 1 else Endurances(found)


def endurance_of_walk(
    result: WalkResult, bottle: str | Path | None = None, reuse: Iterable[str] = ()
) -> Endurance | None:
    """Return how long a bottle lasts when the walk continues without rest; None where the walk took no gas.

    The same device, without faults, walks on the bottle until that ends it, as ``ppafo walk --bottle`` does;
    ``bottle`` is its own, or the paper's, unless given. A stride is one of the leg with the device, or a whole
    course. ``reuse`` are texts such as ``reservoir_volume=50 cm^3``: what they do not say of the chambers is taken from
    the walk.
    """
    gas = walk_gas(result)
    return None if gas.gas_per_stride <= 0.0 else endurance_of_walk_gas(gas, bottle, WITHOUT_REST, reuse)


def endurance_of_walk_gas(
    gas: WalkGas,
    bottle: str | Path | None,
    schedule: Schedule,
    reuse: Iterable[str] = (),
    overrides: Iterable[str] = (),
) -> Endurance:
    """Return how long a bottle lasts when a walk continues; DataError where it took no gas, or is not known."""
    at_set_pressure, changes, zero = draw_of_walk(gas), tuple(reuse), gas.atmospheric_pressure
    if gas.scenario is None:
        raise DataError(f"{gas.name}: its folder does not say what was walked; write the walk again")
    own = walk_of(gas.scenario).bottle
    carried = on_bottle(gas.scenario, PAPER_BOTTLE if bottle is None and own is None else bottle, overrides)
    supply = walk_of(carried).bottle
    assert supply is not None, "it was put on one"
    reused = parse_reuse(changes, supply.bottle, full_chambers(gas), zero) if changes else None
    found = _walked_to_its_end(carried, at_set_pressure, schedule, reused)
    without = None if reused is None else _walked_to_its_end(carried, at_set_pressure, schedule, None).discharge
    return replace(found, is_of_course=bool(gas.course), without_reuse=without)


def _walked_to_its_end(carried: Scenario, at_set_pressure: Draw, schedule: Schedule, reused: Reuse | None) -> Endurance:
    """Return how long the bottle of a walk lasts; ``at_set_pressure`` is the draw of the same walk at room warmth."""
    supply = walk_of(carried).bottle
    assert supply is not None, "a walk on a bottle"
    check_schedule(schedule)
    if reused is not None:
        check_reuse(reused, at_set_pressure.mass_per_stride)
    saved = 0.0 if reused is None else reused.balance.returned_mass / at_set_pressure.mass_per_stride
    life = bottle_life(carried, schedule, saved)
    if walk_of(carried).reacts is not None:  # whose strides no gait sets
        life = replace(life, repeats=life.walked / at_set_pressure.stride_time)
    strides = max(life.repeats, 1.0e-9)
    stride_time = life.walked / strides
    mass = life.course.regulated / strides
    of_walk = quantity_text(at_set_pressure.mass_per_stride, "gas mass")
    origin = f"{at_set_pressure.origin} on the bottle, mean over its strides ({of_walk} before, at the set pressure)"
    taken = Draw(mass, stride_time, max(at_set_pressure.peak_flow, mass / stride_time), origin)
    usable = supply.mass - smallest_mass_when_warm(supply.bottle, taken)
    return Endurance(
        bottle=supply.bottle,
        draw=taken,
        schedule=schedule,
        discharge=discharge_of_life(life, taken),
        reuse=reused,
        without_reuse=None,
        strides_when_warm=usable / taken.mass_per_stride,
    )


@dataclass(frozen=True, slots=True)
class _Bottle:
    """The bottle that was named, if any, and what is set of it."""

    name: str | Path | None
    overrides: tuple[str, ...]

    def load(self) -> Bottle:
        return load_bottle(PAPER_BOTTLE if self.name is None else self.name, self.overrides)


def follow_bottle(bottle: Bottle, draw: Draw, schedule: Schedule, reused: Reuse | None = None) -> Endurance:
    """Return how long a full bottle lasts; ``reused`` takes the gas that a reservoir gives back off every stride."""
    if reused is not None:
        check_reuse(reused, draw.mass_per_stride)
    taken = draw if reused is None else draw.less(reused.balance.returned_mass)
    usable = bottle.mass - smallest_mass_when_warm(bottle, taken)
    return Endurance(
        bottle=bottle,
        draw=taken,
        schedule=schedule,
        discharge=discharge(bottle, taken, schedule),
        reuse=reused,
        without_reuse=None if reused is None else discharge(bottle, draw, schedule),
        strides_when_warm=usable / taken.mass_per_stride,
    )


def _name(use: GasUse) -> str:
    if isinstance(use, Recording):
        return use.label
    return use.scenario.name if isinstance(use, WalkResult) else str(use)


def _endurance_of_use(
    use: GasUse, stride_time: float | None, chosen: _Bottle, schedule: Schedule, reuse: tuple[str, ...]
) -> Endurance:
    gas = walk_gas(use) if isinstance(use, WalkResult) else None
    if isinstance(use, str | Path) and is_walk_folder(Path(use)):
        gas = read_walk_gas(Path(use))
    if gas is not None:
        stride = f"its whole course '{gas.course}'" if gas.course else "one stride of its walk"
        if stride_time is not None:
            raise ParameterError(f"--stride-time: a stride of {_name(use)} is {stride}; omit --stride-time")
        return endurance_of_walk_gas(gas, chosen.name, schedule, reuse, chosen.overrides)
    bottle = chosen.load()
    recording = use if isinstance(use, Recording) else read_recording(Path(str(use)))
    draw = draw_of_recording(recording, stride_time)
    return follow_bottle(bottle, draw, schedule, parse_reuse(reuse, bottle) if reuse else None)
