"""Parameters of reusing the exhaust, and what it saves of the gas of a step."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from ppafo.constants import GRAMS_PER_KILOGRAM, STANDARD_ATMOSPHERE
from ppafo.errors import ParameterError, UnitError, nearest_name, one_line
from ppafo.model.chambers import chamber_1_volume, chamber_2_volume
from ppafo.model.declaration import Quantity
from ppafo.model.exhaust_reuse import ReuseBalance, ReuseCycle, reuse_balance
from ppafo.parameters import load_device
from ppafo.parameters.bottles.bottle import Bottle
from ppafo.parameters.declaration import is_within
from ppafo.questions.endurance.draw import FullChambers
from ppafo.units import parse_quantity

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

GIVEN = "given"
_DEFAULT = "the regulator's pressure, and the paper's device at toe-off and in neutral position"


@dataclass(frozen=True, slots=True)
class ReusePlan:
    """A cycle with a reservoir, and where its pressures and volumes come from, by name."""

    cycle: ReuseCycle
    origins: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class Reuse:
    """A cycle with a reservoir, its masses once the reservoir has settled, and where its values come from, by name."""

    cycle: ReuseCycle
    balance: ReuseBalance
    origins: Mapping[str, str]


def reuse(plan: ReusePlan, mass_per_step: float) -> Reuse:
    """Return what a reservoir saves in a cycle: ``balance.returned_mass`` [kg] a step.

    ``mass_per_step`` [kg] is what a step takes without a reservoir. ParameterError where the cycle does not belong to
    it: pressures below the atmosphere, or chambers that hold more than the step takes.
    """
    cycle = plan.cycle
    for name in ("exhaust_pressure", "fill_pressure"):
        if getattr(cycle, name) < cycle.atmospheric_pressure:
            raise ParameterError(f"--reuse {name}: must be at least the atmospheric pressure")
    balance = reuse_balance(cycle)
    filled = balance.exhausted_mass + balance.returned_mass + balance.topped_up_mass
    if filled > mass_per_step:
        raise ParameterError(
            f"--reuse: the chambers take {filled * GRAMS_PER_KILOGRAM:.3g} g per step at these pressures and volumes, "
            f"more than the {mass_per_step * GRAMS_PER_KILOGRAM:.3g} g of the gas use; give the exhaust_pressure, "
            "fill_pressure, exhaust_volume and fill_volume of that gas use"
        )
    return Reuse(cycle, balance, plan.origins)


def parse_reuse(
    texts: Iterable[str],
    bottle: Bottle,
    chambers: FullChambers | None = None,
    atmosphere: float = STANDARD_ATMOSPHERE,
) -> ReusePlan:
    """Return the cycle of texts such as ``reservoir_volume=50 cm^3``; the reservoir must be given.

    What is not given of the chambers is that of ``chambers``, of a walk. Without a walk pressures are the regulator's
    and volumes those of the paper's device at toe-off and in neutral. The device lets gas out into ``atmosphere`` [Pa
    absolute], from which gauge pressures count.
    """
    values = _parse_pairs(texts, atmosphere)
    found, origin = (_defaults(bottle), _DEFAULT) if chambers is None else _chamber_values(chambers)
    cycle = ReuseCycle(
        **(found | values),
        atmospheric_pressure=atmosphere,
        gas_product=bottle.fluid.table.gas_constant * bottle.room_temperature,
    )
    return ReusePlan(cycle, {item.name: GIVEN if item.name in values else origin for item in REUSE})


def _parse_pairs(texts: Iterable[str], atmosphere: float) -> dict[str, float]:
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
    return values


def _value(quantity: Quantity, text: str, atmosphere: float) -> float:
    try:
        value = parse_quantity(text, quantity.unit, atmosphere)
    except UnitError as error:
        raise ParameterError(f"--reuse {quantity.name}={text}: {error}") from error
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
