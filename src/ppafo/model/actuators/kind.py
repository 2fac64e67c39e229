"""Declaration of an actuator type: chamber volumes, pressures and torque as functions of the angle.

Each chamber has a co-energy Phi(angle, gauge pressure) with the volume V = dPhi/dp and the torque tau = dPhi/dangle, so
that d tau/dp = dV/dangle: the work p dV of the gas is the work on the shaft. A kind is this relation as functions of
floats.
"""

from collections import namedtuple
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple, Protocol, get_type_hints

from ppafo.model.declaration import Number, Quantity, quantities_of
from ppafo.model.plant import PlantParameters


class Range(NamedTuple):
    """Stops of an actuator [rad], and dead volumes of its chambers with their lines [m^3]."""

    angle_min: Annotated[float, Number("rad", "lower stop")]
    angle_max: Annotated[float, Number("rad", "upper stop")]
    dead_volume_1: Annotated[float, Number("m^3", "line and clearance of chamber 1")]
    dead_volume_2: Annotated[float, Number("m^3", "line and clearance of chamber 2")]


class Chambers(NamedTuple):
    """Volumes of both chambers [m^3], and their derivatives with respect to the pressure of the chamber [m^3/Pa]."""

    volume_1: float
    volume_2: float
    compliance_1: float
    compliance_2: float


@dataclass(frozen=True, slots=True)
class ActuatorModel:
    """Functions of an actuator type, of a plant, an angle [rad], and absolute pressures [Pa] or gas masses [kg].

    ``shape`` is the NamedTuple of floats stored as ``plant.shape``, None for the vane, which needs none;
    ``prepare(settings, range)`` makes it from the declared settings. ``table`` is the NamedTuple of a data file named
    in a parameter set, the third argument of ``prepare``; None for a kind without a file. ``chambers(plant, angle,
    pressure_1, pressure_2)`` returns ``Chambers``, ``pressures(plant, angle, mass_1, mass_2)`` the two pressures at
    which p V = m R T, and ``torque(plant, angle, pressure_1, pressure_2)`` the torque [N m], positive in
    plantarflexion. ``gives`` is False for rigid chambers, whose compliances are 0. ``has_torque_constant`` is True if
    the torque is ``plant.torque_constant`` times the pressure difference.
    """

    shape: type | None
    prepare: Callable[..., Any]
    chambers: Callable[..., Chambers]
    pressures: Callable[..., tuple[float, float]]
    torque: Callable[..., float]
    table: type | None = None
    gives: bool = True
    has_torque_constant: bool = False

    @property
    def plant(self) -> type:
        """The NamedTuple of a plant with this actuator."""
        if self.shape is None:
            return PlantParameters
        # One class for each shape, or two equal programs would differ by a type; all have one name in a program's text.
        if self.shape not in _PLANTS:
            make: Any = namedtuple
            struct = make("ShapedPlant", (*PlantParameters._fields, "shape"))
            struct.__annotations__ = get_type_hints(PlantParameters, include_extras=True) | {"shape": self.shape}
            _PLANTS[self.shape] = struct
        return _PLANTS[self.shape]


@dataclass(frozen=True, slots=True)
class ActuatorKind:
    """Actuator in the catalogue: name, summary, settings besides stops and dead volumes, and model.

    ``settings`` is a NamedTuple class that declares the numbers, each an ``Annotated[float, Number(...)]``.

    ``problem(settings, range)`` describes an inconsistency between the settings, empty if there is none; None if the
    declared limits are sufficient. ``flaw(settings, range)`` is the same for exports: place of the setting at fault,
    counted from 1, or 0. ``has_one_chamber(table)`` returns whether chamber 2 is only its dead volume, in an
    actuator with a table (None without one).
    """

    name: str
    summary: str
    settings: type
    model: ActuatorModel
    problem: Callable[[Any, Range], str] | None = None
    flaw: Callable[[Any, Range], float] | None = None
    has_one_chamber: Callable[[Any], bool] = lambda _: False

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Quantities that the settings declare."""
        return quantities_of(self.settings)


class ShapedPlant(Protocol):
    """Plant with an actuator other than a vane: ``PlantParameters`` with the geometry of the actuator.

    ``displacement_per_radian`` of chamber 1 is the mean over the range, and ``torque_constant`` is the same number:
    errors are scaled by both, and control laws designed for a vane use them.
    """

    shape: Any
    """Geometry of the actuator."""
    gas_product: float
    """R T / M [J/kg]."""
    supply_pressure: float
    """Pressure of the supply of chamber 1 [Pa]."""
    dorsiflexion_pressure: float
    """Pressure of the supply of chamber 2 [Pa]."""
    atmospheric_pressure: float
    """Pressure of the atmosphere [Pa]."""
    gravity_torque: float
    """Largest gravity torque [N m]."""
    external_torque: float
    """Torque T_ex [N m]."""


class _UnpressurisedPlant(NamedTuple):
    """Plant parameters that the ``chambers`` function of an actuator reads; pressures relative to the atmosphere."""

    shape: Any
    atmospheric_pressure: float


def mean_growth(shape: Any, stops: Range, gauge: float, chambers: Callable[..., Chambers]) -> float:
    """Mean volume change of chamber 1 between the stops [m^3/rad] at a gauge pressure [Pa]: torque per pressure."""
    still = _UnpressurisedPlant(shape, 0.0)
    first = chambers(still, stops.angle_min, gauge, 0.0).volume_1
    last = chambers(still, stops.angle_max, gauge, 0.0).volume_1
    # 1e-9 rad: stops that coincide must not divide by 0.
    return (last - first) / max(stops.angle_max - stops.angle_min, 1.0e-9)


_PLANTS: dict[type, type] = {}
