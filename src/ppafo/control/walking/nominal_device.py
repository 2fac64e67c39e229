"""Nominal device of the chamber observer: valve, supply, supply lines and volumes that a healthy device would have.

Every number is a setting of a walking controller whose default follows the device.
"""

from typing import Annotated, NamedTuple

from ppafo.control.kind import PRESSURE_LAG, nominal_term
from ppafo.model.declaration import Quantity
from ppafo.model.regulator import SupplyLines

_CHAMBERS = {
    "displacement_per_radian": "chamber_growth",
    "dead_volume_1": "chamber_rest_1",
    "dead_volume_2": "chamber_rest_2",
}
"""Settings of both chambers for the observer; a torque law uses one mean chamber only."""


def _nominal(name: str, unit: str, summary: str, maximum: float, lowest: float = 0.0) -> Quantity:
    follows = (PRESSURE_LAG,) if name == "sensor_lag" else (nominal_term(_CHAMBERS.get(name, name)),)
    return Quantity(
        f"nominal_{name}", unit, f"{summary}; the device's unless given", 0.0, lowest, maximum, follows=follows
    )


_FLOW = "valve conductance times R T in the chamber observer; 0 switches the observer off"
_PAIR = "1 for a pair of on/off valves, 0 for a spool with a vent valve"
_INTERVAL = "shortest time between two switchings of a coil"
_JOINING = "time for which the chambers stay joined after chamber 1 was fed"


class NominalDevice(NamedTuple):
    """Nominal device of the observer, SI units; absolute pressures.

    ``nominal_flow`` is R T times the valve's conductance [m^3/s]: gas content per second of a choked flow, divided by
    the upstream pressure. ``nominal_pair`` is 1 for on/off valves that vent while not energised, else 0: a spool with a
    vent valve. Both follow their command after ``nominal_delay``, the spool with ``nominal_lag`` and beyond
    ``nominal_dead_band``. ``nominal_joining_time`` is the time for which both chambers are joined after chamber 1 was
    fed. ``nominal_lines`` count gas by its content p V [J]; a volume of 0 stands for a supply without lines.
    """

    nominal_flow: Annotated[float, _nominal("flow", "m^3/s", _FLOW, 1.0)]
    nominal_critical_ratio: Annotated[
        float, _nominal("critical_ratio", "", "critical pressure ratio of the valve", 0.95)
    ]
    nominal_supply_pressure: Annotated[float, _nominal("supply_pressure", "Pa_a", "pressure to chamber 1", 1.0e8)]
    nominal_dorsiflexion_pressure: Annotated[
        float, _nominal("dorsiflexion_pressure", "Pa_a", "pressure to chamber 2", 1.0e8)
    ]
    nominal_atmospheric_pressure: Annotated[
        float, _nominal("atmospheric_pressure", "Pa_a", "pressure of the atmosphere", 1.0e8)
    ]
    nominal_relieving: Annotated[
        float, _nominal("relieving", "", "1 if the supply regulators are relieving (accept reverse flow), else 0", 1.0)
    ]
    nominal_displacement_per_radian: Annotated[
        float, _nominal("displacement_per_radian", "m^3/rad", "mean volume of chamber 1 per angle", 1.0)
    ]
    nominal_dead_volume_1: Annotated[float, _nominal("dead_volume_1", "m^3", "dead volume of chamber 1", 1.0)]
    nominal_dead_volume_2: Annotated[float, _nominal("dead_volume_2", "m^3", "dead volume of chamber 2", 1.0)]
    nominal_angle_min: Annotated[float, _nominal("angle_min", "rad", "lower stop", 10.0, -10.0)]
    nominal_angle_max: Annotated[float, _nominal("angle_max", "rad", "upper stop", 10.0, -10.0)]
    nominal_pair: Annotated[float, _nominal("pair", "", _PAIR, 1.0)]
    nominal_opening_delay: Annotated[float, _nominal("opening_delay", "s", "time from energising a coil to flow", 1.0)]
    nominal_closing_delay: Annotated[
        float, _nominal("closing_delay", "s", "time from de-energising it to venting", 1.0)
    ]
    nominal_switching_interval: Annotated[float, _nominal("switching_interval", "s", _INTERVAL, 1.0)]
    nominal_delay: Annotated[float, _nominal("delay", "s", "dead time of a spool", 1.0)]
    nominal_lag: Annotated[float, _nominal("lag", "s", "settling time of a spool", 1.0)]
    nominal_dead_band: Annotated[float, _nominal("dead_band", "", "smallest command that opens a spool", 0.99)]
    nominal_joining_time: Annotated[float, _nominal("joining_time", "s", _JOINING, 10.0)]
    nominal_sensor_lag: Annotated[float, _nominal("sensor_lag", "s", "lag of the pressure sensors", 1.0e3)]
    nominal_lines: SupplyLines


LINE_QUANTITIES = (
    *(
        _nominal(f"line_{name}_{line}", unit, f"{summary} of line {line}", maximum)
        for line in (1, 2)
        for name, unit, summary, maximum in (
            ("droop", "Pa s/J", "pressure droop per flow of gas content (p V)", 1.0e10),
            ("largest_flow", "W", "largest flow of gas content (p V)", 1.0e10),
            ("volume", "m^3", "volume (0 for no line)", 1.0),
        )
    ),
    _nominal("line_relieving", "", "1 if the line regulators are relieving (accept reverse flow), else 0", 1.0),
)
"""Settings for the fields of ``nominal_lines``, in order."""


def volumes(nominal: NominalDevice, angle: float) -> tuple[float, float]:
    """Volumes of both chambers [m^3] at a measured angle [rad], not below the dead volumes. Equations (4), (5)."""
    growth = nominal.nominal_displacement_per_radian
    return (
        nominal.nominal_dead_volume_1 + max(growth * (angle - nominal.nominal_angle_min), 0.0),
        nominal.nominal_dead_volume_2 + max(growth * (nominal.nominal_angle_max - angle), 0.0),
    )


def believed_volumes(nominal: NominalDevice, angle: float, pressure_1: float, pressure_2: float) -> tuple[float, float]:
    """Nominal volumes of both chambers [m^3] at a measured angle [rad]; for a vane independent of the pressures [Pa].

    A program with another actuator calls the chamber function of that actuator instead.
    """
    return volumes(nominal, angle)


def mean_volumes(nominal: NominalDevice, pressure_1: float, pressure_2: float) -> tuple[float, float]:
    """Return dC/dp [m^3] of both chambers at mid-range for pressure readings [Pa], with gas content C = p V [J].

    For a vane the derivative is the volume. For another actuator (see ``believed_volumes``) it includes the compliance.
    """
    return volumes(nominal, 0.5 * (nominal.nominal_angle_min + nominal.nominal_angle_max))
