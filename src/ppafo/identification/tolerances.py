"""Tolerances of bench and parameter set: table [bench], defaults, and conversion to priors.

Usual errors of sensors and supply are defined in ``usual_errors.py``. A set states the half-width of a 95 % interval,
which is 1.96 standard deviations.
"""

import math
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Literal

from ppafo.identification.estimate import interval_factor
from ppafo.model.declaration import Number, Quantity
from ppafo.parameters.declared import Words
from ppafo.parameters.parameter_set import CONFIDENCE
from ppafo.parameters.records import keyed
from ppafo.simulation.recorded.usual_errors import ANGLE_ERRORS, PRESSURE_ERRORS, SUPPLY_ERROR, deviation_of_limit

Sensed = Literal["zero", "gain"]
# Default limits of the gas temperature error [K] and of the relative departure from the ideal gas law [-].
GAS_TEMPERATURE = 15.0
GAS_LAW = 0.01
LAG_OF_PRESSURE = 0.02
"""Default limit of the time constant of a pressure sensor with its tube and filter [s]."""
HELD = {
    "gas.molar_mass": GAS_LAW,
    "gas.heat_capacity_ratio": 0.02,
    "actuator.torque_constant": 0.02,
    "actuator.displacement_per_radian": 0.02,
    "actuator.dead_volume_1": 0.05,
    "actuator.dead_volume_2": 0.05,
    "actuator.leak.discharge_coefficient": 0.3,
    "actuator.leak.sonic_conductance": 0.3,
    "actuator.restitution": 0.2,
    "friction.static_torque": 0.3,
    "friction.dynamic_torque": 0.5,
    "friction.viscous_damping": 0.3,
    "effects.stribeck.share": 0.3,
    "foot_plate.inertia": 0.05,
    "foot_plate.gravity_torque": 0.1,
    "valve.discharge_coefficient": 0.1,
    "valve.sonic_conductance": 0.1,
}
"""Default relative limits [-] of parameters without a stated uncertainty; ``valve`` is the chosen valve."""
_OTHER_SETTING = 0.1
"""Default relative limit [-] of all other parameters, such as settings of valves and effects."""
_LARGEST_FRACTION = 0.5
"""Largest relative limit [-] that may be stated; beyond it a sensor is broken rather than inaccurate."""
Columns = Annotated[str | None, Words("name of a column map; default: units in the header of the file")]
Confidence = Annotated[
    float,
    Number(
        "",
        "confidence of the intervals; default 0.95",
        minimum=0.5,
        maximum=math.nextafter(1.0, 0.0),
        minimum_allowed=False,
        plain=True,
    ),
]


_limit = partial(Quantity, "", minimum=0.0)
_share = partial(Quantity, "", "1", minimum=0.0, maximum=_LARGEST_FRACTION)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerances:
    """Table [bench] of a problem file: limits (+-) of uncertain quantities, in SI or as fractions; 0 for an exact one.

    None means the default of the channel or parameter. Errors named in ``each_recording`` differ between recordings.
    """

    load: float = keyed(_share("tolerance of the external torque, for each recording; default 2 %"), 0.02)
    supply: float = keyed(
        _limit("Pa_d", "tolerance of each supply pressure, for each recording; default 1 psi_d"), SUPPLY_ERROR
    )
    zero_of_angle: float = keyed(
        _limit("rad", "tolerance of the zero of the angle sensor; default 0.5 deg"), ANGLE_ERRORS.zero
    )
    zero_of_pressure: float = keyed(
        _limit("Pa_d", "tolerance of the zero of each pressure sensor; default 0.3 psi_d"), PRESSURE_ERRORS.zero
    )
    gain: float | None = keyed(
        _share("tolerance of the gain of each sensor; default 0.5 %, 0 % for the angle sensor"), None
    )
    lag: float | None = keyed(
        _limit("s", "tolerance of the time constant of each sensor; default 20 ms, 1 ms for the angle sensor"), None
    )
    start_of_angle: float | None = keyed(
        _limit(
            "rad",
            "tolerance of the initial angle of each recording, unless at a stop; default 0.05 deg if it is read from "
            "the recording, else as zero_of_angle",
        ),
        None,
    )
    start_of_pressure: float | None = keyed(
        _limit("Pa_d", "tolerance of both initial pressures; default: the noise of a sample if they are measured"), None
    )
    each_recording: tuple[Sensed, ...] = keyed(
        "sensor errors that differ between recordings: 'zero', 'gain'; default: none", ()
    )
    gas_temperature: float | None = keyed(
        _limit("K", "tolerance of the gas temperature; default: from the set, else 15 K"), None
    )
    gas_law: float | None = keyed(_share("deviation of the gas from the ideal gas law; default 1 %"), None)
    stribeck_velocity: float = keyed(
        _limit("rad/s", "speed up to which static friction may last, unless an effect gives it; default 0.5 rad/s"), 0.5
    )
    zero_of_flow: float = keyed(
        _share("tolerance of the zero of the flow meter, relative to its largest reading; default 5 %"), 0.05
    )
    friction: float = keyed(
        _share("variation of friction between recordings; default 5 % if a procedure has several"), 0.05
    )
    held: float | None = keyed(
        _share("uncertainty of values of the set that state none; default: 1 to 50 % by kind"), None
    )

    def zero_of(self, channel: str) -> float:
        """Return the limit of the zero error of a channel [rad], [Pa]."""
        return self.zero_of_angle if channel == "angle" else self.zero_of_pressure

    def gain_of(self, channel: str) -> float:
        """Return the limit of the gain error of a channel [-]; default 0 for an angle sensor."""
        # Of an angle alone a gain is one of all its numbers, which no fit tells from it.
        return (0.0 if channel == "angle" else PRESSURE_ERRORS.gain) if self.gain is None else self.gain

    def lag_of(self, channel: str) -> float:
        """Return the limit of the time constant of a sensor and its filter [s]."""
        usual = ANGLE_ERRORS.delay if channel == "angle" else LAG_OF_PRESSURE
        return usual if self.lag is None else self.lag

    def deviation_of(self, path: str, value: float, half_width: float) -> float:
        """Return the standard deviation of a fixed parameter, given its ``value`` [SI].

        In order of precedence: the limit that the bench states for this parameter; the ``half_width`` of the 95 %
        interval stated in the set; the limit ``held``; the default by kind of parameter.
        """
        gas_law = None if self.gas_law is None else abs(value) * self.gas_law
        # A measurement of the day counts before the set's interval for any day.
        of_bench = {"gas.temperature": self.gas_temperature, "gas.molar_mass": gas_law}.get(path)
        if of_bench is not None:
            return deviation_of_limit(of_bench)
        if half_width > 0.0:
            return half_width / interval_factor(CONFIDENCE)
        if path == "gas.temperature":
            return deviation_of_limit(GAS_TEMPERATURE)
        return deviation_of_limit(abs(value) * (HELD.get(path, _OTHER_SETTING) if self.held is None else self.held))


DEFAULTS = Tolerances()
"""Tolerances of a bench without a table [bench]."""
