"""The settings that the paper does not print, and what it reports that they have to agree with.

Completions are points in the unit cube, evenly spread before anything is compared.
"""

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.constants import GRAMS_PER_KILOGRAM, PASCALS_PER_PSI
from ppafo.parameters import load_device, load_parameter_set
from ppafo.parameters.parameter_set import number_in_si
from ppafo.parameters.plant import orifice_conductance
from ppafo.parameters.publications.publication import ClaimEntry, paper_entries
from ppafo.simulation.loading import load_scenario
from ppafo.units import parse_quantity

Floats = NDArray[np.float64]
DEVICE = "ppafo2011"
SOLENOID, PROPORTIONAL, STEP = "solenoid", "proportional", "step"
VOLTS = "full scale of U"
DISCHARGE = "reading of Cd"
HOLD = "hold time"
ON_OFF_RATE = "on/off rate"
PID_RATE = "PID rate"
DEAD_VOLUME = "dead volume"
VOLUME = "volume per angle"
LEVEL, SUPPLY, DORSIFLEXION = "reference level", "source pressure", "dorsiflexion pressure"
START, DELAY = "start level", "coil delay"
ATTITUDE, MASS_CENTRE = "shank attitude", "foot mass centre"


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
    Setting(LEVEL, "N m", "not printed; 5.5 N m is the maximum that 55 psi_g can hold", 3.0, 9.0),
    Setting("ramp time", "s", "not printed", 0.25, 3.0, is_logarithmic=True),
    Setting(
        HOLD, "s", "not printed; with the ramp rounded up to half a second", choices=(0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
    ),
    Setting("angle", "deg", "not printed; within the range of figure 7", 25.0, 125.0),
    Setting(
        VOLUME,
        "cm^3/rad",
        "51 is printed from a data sheet, 14.5 follows from the torque constant by virtual work",
        14.5,
        51.0,
        is_logarithmic=True,
    ),
    Setting(DEAD_VOLUME, "cm^3", "lines are in V_i, no number is printed", 0.5, 40.0, is_logarithmic=True),
    Setting(SUPPLY, "psi_g", "55 psi_g is printed for the step response, 50 for the flow", 45.0, 60.0),
    Setting(DORSIFLEXION, "psi_g", "a second regulator is named, its setting is not", 20.0, 60.0),
    Setting(START, "N m", "not printed; both chambers at atmosphere give 0", 0.0, 2.0),
    Setting(DELAY, "ms", "not printed; data sheets of such valves have 2 to 20 ms", 0.0, 20.0),
    Setting(
        ATTITUDE,
        "deg",
        "not printed; the shank of the fixture of figure 7 rests, 0 is upright and 90 has the ankle in front",
        -90.0,
        90.0,
    ),
    Setting(
        MASS_CENTRE,
        "cm",
        "the foot's length is printed, 18 cm, not where its mass is; its inertia about the ankle is then 3 to 19 g m^2",
        4.5,
        13.5,
    ),
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


_SI_UNITS = {"deg": "rad", "psi_g": "Pa_a", "cm^3": "m^3", "cm^3/rad": "m^3/rad", "cm": "m", "ms": "s"}


def in_si(values: Floats, unit: str) -> Floats:
    """Values of a shown unit in SI; all units here are straight lines to SI."""
    si_unit = {"deg": "rad", "psi_g": "Pa_a", "cm^3": "m^3", "cm^3/rad": "m^3/rad", "cm": "m", "ms": "s"}.get(
        unit, unit
    )
    zero, one = (parse_quantity(f"{number} {unit}", si_unit) for number in (0.0, 1.0))
    return np.asarray(zero + (one - zero) * values)


def columns(draws: Draws, valve: str) -> dict[str, Floats]:
    """What varies in the torque task with one of the valves, in SI units by path."""
    ramp = draws["ramp time"]
    shared = {
        "reference.level": draws[LEVEL],
        "reference.start_level": draws[START],
        "reference.ramp_time": ramp,
        "motion.angle": in_si(draws["angle"], "deg"),
        "supply.pressure": in_si(draws[SUPPLY], "psi_g"),
        "supply.dorsiflexion_pressure": in_si(draws[DORSIFLEXION], "psi_g"),
        "run.duration": whole_durations(ramp + draws[HOLD]),
        **_of_device(draws, valve),
    }
    if valve == PROPORTIONAL:
        return shared | _pid(draws)
    delay = in_si(draws[DELAY], "ms")
    return shared | {
        "controller.rate": draws[ON_OFF_RATE],
        "valve.opening_delay": delay,
        "valve.closing_delay": delay,
    }


def _of_device(draws: Draws, valve: str) -> dict[str, Floats]:
    """What varies of the device in every experiment, in SI units by path."""
    dead_volume = in_si(draws[DEAD_VOLUME], "cm^3")
    return {
        "actuator.volume_per_angle": in_si(draws[VOLUME], "cm^3/rad"),
        "actuator.dead_volume_1": dead_volume,
        "actuator.dead_volume_2": dead_volume,
        "valve.discharge_coefficient": discharge_coefficients(draws[DISCHARGE], valve),
    }


STEP_RUN = ("run.duration=0.4 s",)
"""The step response that is looked at, with the leg of its fixture: until the vane is at its stop in nearly every
completion."""
PLATEAU, FALL, RISE = (
    "time at the supply pressure before breakaway",
    "fall of pressure 1 in motion",
    "rise of pressure 2 in motion",
)


def step_columns(draws: Draws) -> dict[str, Floats]:
    """What varies in the step response, in SI units by path: the device, and the leg of the fixture."""
    return _of_device(draws, PROPORTIONAL) | {
        "motion.shank.level": in_si(draws[ATTITUDE], "deg"),
        "motion.foot_mass_centre": in_si(draws[MASS_CENTRE], "cm"),
    }


def step_observables(
    times: Floats, traces: Mapping[str, Floats], supply: float, atmosphere: float
) -> dict[str, Floats]:
    """What the text of figure 7 speaks of [ms], [psi], by name (runs,), from traces (times, runs) in SI.

    nan where the vane does not move; breakaway is the last sample at which the vane is where it started.
    """
    angle, first, second = (traces[name] for name in ("angle", "pressure_1", "pressure_2"))
    moved = np.abs(angle - angle[0]) > STEP_RESOLUTION
    breakaway = np.maximum(np.argmax(moved, axis=0) - 1, 0)
    at_end = np.abs(angle - angle[-1]) > STEP_RESOLUTION
    stop = times.size - np.argmax(at_end[::-1], axis=0)
    place = np.arange(times.size)[:, None]
    moving = (place >= breakaway) & (place <= stop)
    full = first > supply - SAME_PRESSURE * (supply - atmosphere)
    before = full & (place <= breakaway)
    since = np.where(before.any(axis=0), times[np.argmax(before, axis=0)], times[breakaway])
    column = np.arange(breakaway.size)
    lowest = np.min(np.where(moving, first, np.inf), axis=0)
    falling = np.minimum.accumulate(np.where(moving, second, np.inf), axis=0)
    rise = np.max(np.where(moving, second - falling, 0.0), axis=0)
    found = {
        PLATEAU: 1.0e3 * (times[breakaway] - since),
        FALL: (first[breakaway, column] - lowest) / PASCALS_PER_PSI,
        RISE: rise / PASCALS_PER_PSI,
    }
    return {name: np.where(moved.any(axis=0), values, np.nan) for name, values in found.items()}


STEP_RESOLUTION = 1.0e-5
"""Smallest angle [rad] that counts as motion."""
SAME_PRESSURE = 0.01
"""Fraction of the pressure range within which a pressure is that of the supply."""


def demand_over_ceiling(draws: Draws) -> Floats:
    """The largest torque that is wanted over what the supply holds at rest [-]. Equation (2)."""
    constant = load_device(DEVICE).actuator.torque_constant
    return np.asarray(draws[LEVEL] / (constant * draws[SUPPLY] * PASCALS_PER_PSI))


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


Metrics = Mapping[str, Mapping[str, Floats]]
"""Metrics by valve and name, each (draws,)."""
METRICS = ("rms_error", "gas_supplied", "oscillations_ramp", "oscillations_hold")


def improvement(metrics: Metrics) -> Floats:
    """By how much the proportional valve's RMS error is smaller [%]."""
    return np.asarray(100.0 * (1.0 - metrics[PROPORTIONAL]["rms_error"] / metrics[SOLENOID]["rms_error"]))


def saving(metrics: Metrics) -> Floats:
    """By how much the proportional valve's gas is less [%]; nan where the solenoids take none."""
    used = metrics[SOLENOID]["gas_supplied"]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(used > 0.0, 100.0 * (1.0 - metrics[PROPORTIONAL]["gas_supplied"] / used), np.nan)


def grams(valve: str) -> Callable[[Metrics], Floats]:
    """Gas of one valve [g]."""
    return lambda metrics: GRAMS_PER_KILOGRAM * metrics[valve]["gas_supplied"]


def _reversals(valve: str, part: str) -> Callable[[Metrics], Floats]:
    return lambda metrics: metrics[valve][f"oscillations_{part}"]


def _of_step(name: str) -> Callable[[Metrics], Floats]:
    return lambda metrics: metrics[STEP][name]


OBSERVABLES: Mapping[str, Callable[[Metrics], Floats]] = {
    "improvement": improvement,
    "saving": saving,
    "gas, solenoid": grams(SOLENOID),
    "gas, proportional": grams(PROPORTIONAL),
    "reversals on the ramp, solenoid": _reversals(SOLENOID, "ramp"),
    "reversals on the hold, solenoid": _reversals(SOLENOID, "hold"),
    "reversals on the ramp, proportional": _reversals(PROPORTIONAL, "ramp"),
    PLATEAU: _of_step(PLATEAU),
    FALL: _of_step(FALL),
    RISE: _of_step(RISE),
}
"""What a completion gives of the observables that entries of the paper speak of, in the units of the entries."""
EVIDENCE = tuple(
    entry for entry in paper_entries().values() if entry.observable in OBSERVABLES and entry.deviation is not None
)
"""What the paper reports that completions have to agree with."""
IMPROVEMENT = "torque_rms_improvement"
QUIET = ("proportional_does_not_oscillate",)
GAS = ("co2_solenoid", "co2_proportional", "co2_saving")
TEXT_OF_STEP = tuple(entry.id for entry in EVIDENCE if entry.observable in (PLATEAU, FALL, RISE))
TEXT_OF_SOLENOID = ("solenoid_oscillates_on_ramp", "solenoid_quiet_on_hold")
"""What the text says of the step response, and of the torque task with the solenoid pair; never left out."""


def agreement(metrics: Metrics, left_out: Collection[str] = ()) -> Floats:
    """How well each completion (draws,) agrees with what is reported, 0 to 1; ``left_out`` entries do not count."""
    return agreement_with([entry.id for entry in EVIDENCE if entry.id not in left_out], metrics)


def agreement_with(identifiers: Collection[str], metrics: Metrics) -> Floats:
    """How well each completion (draws,) agrees with some entries, 0 to 1."""
    return np.exp(log_agreement(identifiers, metrics))


def log_agreement(identifiers: Collection[str], metrics: Metrics) -> Floats:
    """The logarithm of that (draws,); -inf where a completion contradicts a strict limit, or did not run."""
    chosen = [entry for entry in EVIDENCE if entry.id in identifiers]
    logarithm = -sum((_misfit(entry, OBSERVABLES[entry.observable](metrics)) for entry in chosen), np.zeros(1))
    return np.where(np.isfinite(logarithm), logarithm, -np.inf)


def _misfit(entry: ClaimEntry, found: Floats) -> Floats:
    """Half the square of how far an observable is from a number, or beyond limits, in deviations."""
    if entry.published is not None:
        away = np.abs(found - entry.published)
    else:
        low = -np.inf if entry.at_least is None else entry.at_least
        high = np.inf if entry.at_most is None else entry.at_most
        away = np.maximum(0.0, np.maximum(low - found, found - high))
    if not entry.deviation:
        return np.where(away <= 0.0, 0.0, np.inf)
    return np.asarray(0.5 * (away / entry.deviation) ** 2)


def effective(weights: Floats) -> float:
    """Number of points [-] that equal weights would need to say as much."""
    squares = float((weights**2).sum())
    return float(weights.sum()) ** 2 / squares if squares > 0.0 else 0.0
