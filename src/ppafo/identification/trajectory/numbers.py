"""Parameters of a scenario or recording that a trajectory fit can vary, with start, bounds and prior."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ppafo.errors import IdentificationError
from ppafo.identification.residuals import FitVariable
from ppafo.identification.trajectory.experiment import FITTED_CHANNELS, FittedExperiment, refuse_first, scenario_of
from ppafo.model.catalog import VALVES, find_effects
from ppafo.model.declaration import Quantity
from ppafo.parameters.device import Device
from ppafo.parameters.effects import switches_of
from ppafo.simulation import numbers
from ppafo.simulation.declaration import FREE, INITIAL, LEG, shank_settings
from ppafo.simulation.numbers import other_form
from ppafo.simulation.recorded.channels import DORSIFLEXION_SUPPLY, EXTERNAL_TORQUE, SUPPLY
from ppafo.simulation.recorded.inputs import supply_paths
from ppafo.simulation.scenario import Scenario, vane_motion
from ppafo.wording import known_names

TIME_OFFSET = "recording.time_offset"
"""Path of the delay of the samples of a recording with respect to the run; no scenario has this parameter."""

ZERO_OF, GAIN_OF, LAG_OF = "recording.zero_of_", "recording.gain_of_", "recording.lag_of_"
"""Prefixes of the parameter paths of zero, gain and first-order lag of a sensor; the channel name follows."""

RECORDING = (
    Quantity("time_offset", "s", "delay of the samples behind the run, such as a late trigger", 0.0, -1.0, 1.0),
    *(
        Quantity(f"zero_of_{name}", unit, f"zero of the sensor of {name}", 0.0, -size, size)
        for name, unit, size in (
            ("angle", "rad", 1.0),
            *((name, "Pa_d", 1.0e6) for name in ("pressure_1", "pressure_2", SUPPLY, DORSIFLEXION_SUPPLY)),
        )
    ),
    *(
        Quantity(f"gain_of_{name}", "1", f"gain of the sensor of {name} less 1", 0.0, -0.5, 0.5)
        for name in FITTED_CHANNELS
    ),
    *(
        Quantity(f"lag_of_{name}", "s", f"time constant of the sensor of {name} or its filter", 0.0, -1.0, 1.0)
        for name in FITTED_CHANNELS
    ),
)
_OF_RECORDING = frozenset(f"recording.{quantity.name}" for quantity in RECORDING)


def full_path(path: str, scenario: Scenario) -> str:
    """Return the path as in a parameter set: ``valve.area`` becomes ``valves.NAME.area`` with the chosen valve."""
    section, _, name = path.partition(".")
    return f"valves.{scenario.device.valve_name}.{name}" if section == "valve" else path


def declared_numbers(scenario: Scenario) -> dict[str, Quantity]:
    """Return the declarations of all parameters that can be fitted in this scenario, by path."""
    device = scenario.device
    # An orifice has two forms, and the device one of them.
    other = {f"{section}.{name}" for section in ("actuator.leak", "valve") for name in other_form(device, section)}
    declared = {
        full_path(path, scenario): quantity
        for path, quantity in numbers.device_numbers(device).items()
        if path not in other
    }
    leg = vane_motion(scenario).leg
    if vane_motion(scenario).profile is None:
        declared |= {f"motion.{quantity.name}": quantity for quantity in (FREE if leg is None else LEG)}
        shank = () if leg is None else shank_settings(leg.shank.kind)
        declared |= {f"motion.shank.{quantity.name}": quantity for quantity in shank}
    declared |= numbers.of_its_chambers({f"initial.{quantity.name}": quantity for quantity in INITIAL}, device)
    return declared | {f"recording.{quantity.name}": quantity for quantity in RECORDING}


def declaration_of(path: str, scenario: Scenario) -> Quantity:
    """Return the declaration of a parameter. Raises IdentificationError, with the nearest name, for an unknown path."""
    find_effects([path])
    known = declared_numbers(scenario)
    full = full_path(path, scenario)
    if full not in known:
        raise IdentificationError(f"{scenario.name}: '{path}' cannot be fitted{known_names(full, known)}")
    return known[full]


def number_at(scenario: Scenario, path: str) -> float:
    """Return the value of a parameter [SI]; parameters of a recording are 0 before the fit."""
    declaration_of(path, scenario)
    return 0.0 if path in _OF_RECORDING else numbers.number_at(scenario, path)


def with_numbers(scenario: Scenario, changed: Mapping[str, float]) -> Scenario:
    """Return the scenario with changed parameters [SI], by path; parameters of recordings are ignored."""
    # Those of a recording change what is compared, not the run.
    return numbers.with_numbers(
        scenario, {path: number for path, number in changed.items() if path not in _OF_RECORDING}
    )


def broken_rule(device: Device) -> str:
    """Return a sentence on a rule that the parameters of a device violate; empty for a valid device."""
    dynamic, static = device.friction.dynamic_torque, device.friction.static_torque
    if dynamic > static:
        return (
            f"friction.dynamic_torque was fitted to {dynamic:.3g} N m, above friction.static_torque of "
            f"{static:.3g} N m (fitted, or moved within its tolerance); let the section fit both, "
            "friction.static_torque without low, high and prior"
        )
    if device.actuator.angle_min >= device.actuator.angle_max:
        return "actuator.angle_min was fitted above actuator.angle_max"
    return ""


LONGEST_TIME_OFFSET = 0.02
"""Default bound of a fitted time offset [s]: covers the delay of a trigger or a sensor."""

_FURTHEST = 100.0
"""Default bounds of a positive parameter, as the largest ratio to its start value, up and down [-]."""

_SCALE = 100.0
"""Scale of a parameter with a prior, in standard deviations [-]; a finite difference is at most 0.001 scales."""

_STATE = frozenset({"motion", "initial"})
"""Sections with the initial state of a run, which a recording may give more accurately."""

_SUPPLIES = {"supply.pressure": "plant.supply_pressure", "supply.dorsiflexion_pressure": "plant.dorsiflexion_pressure"}


@dataclass(frozen=True, slots=True)
class FreeParameter:
    """Parameter varied by the fit, by path such as ``friction.viscous_damping`` or ``initial.pressure_1``, in SI units.

    ``start`` defaults to the value of the scenario. ``low`` and ``high`` default to the declared bounds, at most a
    factor of 100 from the start. ``deviation`` is the standard deviation of a normal prior about the start, infinite
    for none. ``recordings`` are the labels of the experiments to which the parameter is limited, empty for all.
    ``is_tolerance`` marks a quantity known within a tolerance, which is not an unknown of the device. With
    ``is_logarithm`` the natural logarithm is varied, and ``deviation`` refers to the logarithm.
    """

    path: str
    start: float | None = None
    low: float | None = None
    high: float | None = None
    deviation: float = math.inf
    recordings: tuple[str, ...] = ()
    is_tolerance: bool = False
    is_logarithm: bool = False

    @property
    def name(self) -> str:
        """Path, followed by the labels of the experiments if the parameter is limited to some of them."""
        return f"{self.path} of {', '.join(self.recordings)}" if self.recordings else self.path


@dataclass(frozen=True, slots=True)
class FitNumber:
    """Parameter resolved for a fit: full path, SI unit, and the variable of the estimator."""

    path: str
    unit: str
    free: FitVariable
    recordings: tuple[str, ...]
    is_tolerance: bool
    is_logarithm: bool

    def acts_in(self, label: str) -> bool:
        """Return whether the parameter acts in the experiment with this label."""
        return not self.recordings or label in self.recordings


def number_of(parameter: FreeParameter, experiments: Sequence[FittedExperiment]) -> FitNumber:
    """Return a parameter with start, bounds and scale resolved, given the experiments in which it acts.

    Raises IdentificationError for contradictory settings.
    """
    scenarios = [experiment.scenario for experiment in experiments]
    paths = {full_path(parameter.path, scenario) for scenario in scenarios}
    if len(paths) > 1:
        raise IdentificationError(
            f"{parameter.path} refers to {' and '.join(sorted(paths))} in these experiments and cannot be fitted as "
            "one parameter; give one of these paths, and in recordings the experiments that have it"
        )
    path = paths.pop()
    quantity = [declaration_of(path, scenario) for scenario in scenarios][-1]
    for experiment in experiments:
        # What the run follows as it was recorded no number moves.
        followed = dict.fromkeys(supply_paths(experiment.scenario.device), SUPPLY)
        if DORSIFLEXION_SUPPLY in experiment.inputs:
            followed["plant.dorsiflexion_pressure"] = DORSIFLEXION_SUPPLY
        channel = EXTERNAL_TORQUE if path == "motion.external_torque" else followed.get(_SUPPLIES.get(path, ""))
        if channel in experiment.inputs:
            raise IdentificationError(
                f"{parameter.name}: the run of experiment '{experiment.label}' uses the recorded '{channel}', so this "
                f"parameter has no effect; omit the parameter, or remove '{channel}' from the inputs"
            )
    start = parameter.start
    if start is None:
        # Of how a run begins the recording may say more than the scenario.
        is_state = path.partition(".")[0] in _STATE
        start = number_at(scenario_of(experiments[0]) if is_state else scenarios[0], path)
    low, high = _bounds(parameter, path, start, quantity)
    bounds = f"{low:.6g} and {high:.6g}"
    has_size = math.isfinite(high - low) or math.isfinite(parameter.deviation)
    is_allowed = quantity.minimum <= low and high <= quantity.maximum
    allowed = f"{quantity.minimum:.6g} to {quantity.maximum:.6g} {quantity.unit}".rstrip()
    refuse_first(
        parameter.name,
        (not math.isfinite(start) or math.isnan(low) or math.isnan(high), "start and bounds must be finite numbers"),
        (not low < high, f"low = {low:.6g} must be below high = {high:.6g}"),
        (not low <= start <= high, f"start = {start:.6g} must lie between the bounds {bounds}"),
        (start == 0.0 and not has_size, "start = 0 needs bounds, which define the step size of the search"),
        (not parameter.deviation > 0.0, "the standard deviation of a prior must be above 0"),
        (
            0.0 in (low, start) and not parameter.is_tolerance and _is_off_at_zero(scenarios[0], path, high),
            "0 leaves it out of the model, so it cannot be fitted from there; give start and low, both above 0",
        ),
        (not is_allowed, f"the bounds {bounds} exceed the allowed range, {allowed}"),
    )
    if parameter.is_logarithm:
        start, low, high = math.log(start), math.log(low), math.log(high)
    # Differences are a thousandth of the scale at most, which for a prior is a tenth of its deviation.
    scale = abs(start) or 0.5 * (high - low)
    if math.isfinite(parameter.deviation):
        scale = _SCALE * parameter.deviation
    free = FitVariable(full_path(parameter.name, scenarios[0]), start, low, high, scale, parameter.deviation)
    unit = quantity.unit.removesuffix("_a").removesuffix("_d") or "-"
    return FitNumber(path, unit, free, parameter.recordings, parameter.is_tolerance, parameter.is_logarithm)


def _is_off_at_zero(scenario: Scenario, path: str, value: float) -> bool:
    """Return whether a parameter selects another model at 0 than at ``value`` [SI], such as a delay or an effect."""
    models = []
    for number in (0.0, value):
        device = with_numbers(scenario, {path: number}).device
        kind = VALVES[device.valve.kind]
        settings = kind.settings(**device.valve.settings)
        valve = kind.choose(settings)
        models.append((valve, valve.command_delay(settings) > 0.0, switches_of(device)))
    return models[0] != models[1]


def _bounds(parameter: FreeParameter, path: str, start: float, quantity: Quantity) -> tuple[float, float]:
    """Return the lower and upper bound of the search [SI]: given by the parameter, or default."""
    if path == TIME_OFFSET:
        low, high = -LONGEST_TIME_OFFSET, LONGEST_TIME_OFFSET
    else:
        # A number above 0 is bounded by factors: with 0 as its lower bound a valve or an effect would be another model.
        low = max(quantity.minimum, start / _FURTHEST) if start > 0.0 <= quantity.minimum else quantity.minimum
        high = min(quantity.maximum, start * _FURTHEST) if start > 0.0 else quantity.maximum
    return (low if parameter.low is None else parameter.low), (high if parameter.high is None else parameter.high)


def reach_of(chosen: Sequence[FitNumber]) -> float:
    """Return the largest time offset [s] that the bounds of the parameters allow; 0 if none is fitted."""
    bounds = [bound for number in chosen if number.path == TIME_OFFSET for bound in (number.free.low, number.free.high)]
    return max(map(abs, bounds), default=0.0)
