"""The settings that the paper does not print, each with what it may be before anything is compared."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.parameters import load_device, load_parameter_set
from ppafo.parameters.parameter_set import number_in_si
from ppafo.parameters.plant import orifice_conductance
from ppafo.simulation.loading import load_scenario
from ppafo.units import parse_quantity

Floats = NDArray[np.float64]

DEVICE = "ppafo2011"
SOLENOID, PROPORTIONAL = "solenoid", "proportional"
VOLTS = "full scale of U"
DISCHARGE = "reading of Cd"
HOLD = "hold time"
ON_OFF_RATE = "on/off rate"
PID_RATE = "PID rate"
DEAD_VOLUME = "dead volume"


@dataclass(frozen=True, slots=True)
class Setting:
    """One thing unsaid: drawn evenly from ``low`` to ``high`` (or evenly in the logarithm), or from some choices.

    ``unit`` is the one shown; numbers are in that unit. ``words`` name the choices where they are readings.
    """

    name: str
    unit: str
    why: str
    low: float = math.nan
    high: float = math.nan
    is_logarithmic: bool = False
    choices: tuple[float, ...] = ()
    words: tuple[str, ...] = ()

    def values_at(self, fractions: Floats) -> Floats:
        """Values for fractions from 0 to 1, evenly spread."""
        if self.choices:
            places = np.minimum((fractions * len(self.choices)).astype(np.intp), len(self.choices) - 1)
            return np.array(self.choices)[places]
        if self.is_logarithmic:
            return np.asarray(self.low * (self.high / self.low) ** fractions)
        return np.asarray(self.low + fractions * (self.high - self.low))


SETTINGS: tuple[Setting, ...] = (
    Setting("reference level", "N m", "not printed; 5.5 N m is the maximum that 55 psi_g can hold", 3.0, 9.0),
    Setting("ramp time", "s", "not printed", 0.25, 3.0, is_logarithmic=True),
    Setting(
        HOLD, "s", "not printed; with the ramp rounded up to half a second", choices=(0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
    ),
    Setting("angle", "deg", "not printed; within the range of figure 7", 25.0, 125.0),
    Setting(DEAD_VOLUME, "cm^3", "lines are in V_i, no number is printed", 0.5, 30.0, is_logarithmic=True),
    Setting("source pressure", "psi_g", "55 psi_g is printed for the step response, 50 for the flow", 45.0, 60.0),
    Setting(
        DISCHARGE,
        "",
        "0.113 is printed, and an open flow of 1.5 g/s that disagrees with it for both valves",
        choices=(0.0, 1.0),
        words=("0.113 for both valves", "what passes 1.5 g/s"),
    ),
    Setting(
        VOLTS,
        "",
        "the PID gains are printed without units",
        choices=(1.0, 5.0, 10.0),
        words=("U is the opening", "U is in volts of 5", "U is in volts of 10"),
    ),
    Setting(PID_RATE, "Hz", "not printed", choices=(50.0, 100.0, 200.0, 500.0, 1000.0)),
    Setting(ON_OFF_RATE, "Hz", "20 Hz is printed for the component, not for the law", choices=(20.0, 100.0, 1000.0)),
)

Draws = dict[str, Floats]
"""Values of every setting in its shown unit, by name, shape (draws,)."""


CELLS = tuple(len(setting.choices) for setting in SETTINGS)
"""Number of choices of each setting, 0 for a number."""


def spread(count: int, seed: int) -> Floats:
    """``count`` completions as points in the unit cube (count, settings), from a scrambled Sobol sequence."""
    from scipy.stats import qmc

    sequence = qmc.Sobol(len(SETTINGS), scramble=True, rng=np.random.default_rng(seed))
    return np.asarray(sequence.random(1 << max(1, math.ceil(math.log2(count))))[:count])


def values_of(points: Floats) -> Draws:
    """Settings of completions that are points in the unit cube."""
    return {setting.name: setting.values_at(points[:, column]) for column, setting in enumerate(SETTINGS)}


def in_si(values: Floats, unit: str) -> Floats:
    """Values of a shown unit in SI; all units here are straight lines to SI."""
    si_unit = {"deg": "rad", "psi_g": "Pa_a", "cm^3": "m^3"}.get(unit, unit)
    zero, one = (parse_quantity(f"{number} {unit}", si_unit) for number in (0.0, 1.0))
    return np.asarray(zero + (one - zero) * values)


def columns(draws: Draws, valve: str) -> dict[str, Floats]:
    """What varies in the torque task with one of the valves, in SI units by path."""
    ramp = draws["ramp time"]
    pressure = in_si(draws["source pressure"], "psi_g")
    dead_volume = in_si(draws[DEAD_VOLUME], "cm^3")
    shared = {
        "reference.level": draws["reference level"],
        "reference.ramp_time": ramp,
        "motion.angle": in_si(draws["angle"], "deg"),
        "actuator.dead_volume_1": dead_volume,
        "actuator.dead_volume_2": dead_volume,
        "supply.pressure": pressure,
        "supply.dorsiflexion_pressure": pressure,
        "valve.discharge_coefficient": discharge_coefficients(draws[DISCHARGE], valve),
        "run.duration": whole_durations(ramp + draws[HOLD]),
    }
    return shared | (_pid(draws) if valve == PROPORTIONAL else _on_off(draws))


def whole_durations(times: Floats) -> Floats:
    """Durations [s] rounded up to half seconds: every period fits, and many runs share a clock."""
    return np.asarray(np.ceil(times / 0.5) * 0.5)


def discharge_coefficients(reading: Floats, valve: str) -> Floats:
    """Discharge coefficient [-] of a valve by the reading: printed, or from the printed open flow."""
    device, parameters = load_device(DEVICE, valve), load_parameter_set(DEVICE)
    flow, pressure, printed = (
        number_in_si(parameters, path) or math.nan
        for path in (
            f"reported.valves.{valve}.mass_flow",
            f"reported.valves.{valve}.flow_pressure",
            f"valves.{valve}.discharge_coefficient",
        )
    )
    by_printed = orifice_conductance(device.valve.orifice, device.gas) * pressure
    return np.where(reading > 0.5, printed * flow / by_printed, printed)


def _pid(draws: Draws) -> dict[str, Floats]:
    """Gains of the scenario over the full scale of U, and the rate."""
    gains = load_scenario(f"torque-task-{PROPORTIONAL}").control.settings
    names = ("proportional_gain", "integral_gain", "derivative_gain")
    scaled = {f"controller.{name}": gains[name] / draws[VOLTS] for name in names}
    return {"controller.rate": draws[PID_RATE], **scaled}


def _on_off(draws: Draws) -> dict[str, Floats]:
    return {"controller.rate": draws[ON_OFF_RATE]}
