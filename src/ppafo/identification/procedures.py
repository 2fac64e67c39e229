"""The procedures by name in the recommended order, and how each gets its settings from a problem and a set.

The order matters where one leans on another: torque and friction are measured first because they need nothing else, the
flow of the open valve before its map, and the leak last, since its chambers must be known to hold.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ppafo.errors import IdentificationError, UnitError, nearest_name
from ppafo.identification.bench.flow_laws import GasAt
from ppafo.identification.bench.free_decay import FreeDecaySettings, decay_prospects, free_decay
from ppafo.identification.bench.inputs import data_prospects
from ppafo.identification.bench.leak_samples import VaneLeakSettings
from ppafo.identification.bench.open_valve_flow import OpenValveFlowSettings, flow_prospects, open_valve_flow
from ppafo.identification.bench.result import BenchResult
from ppafo.identification.bench.static_torque import StaticTorqueSettings, static_prospects, static_torque
from ppafo.identification.bench.valve_map import ValveMapSettings, map_prospects, valve_map
from ppafo.identification.bench.vane_leak import leak_prospects, vane_leak
from ppafo.identification.estimate import Prospect, half_width_for
from ppafo.identification.problem import (
    FreeDecayProblem,
    OpenValveFlowProblem,
    ProcedureProblem,
    StaticTorqueProblem,
    ValveMapProblem,
    VaneLeakProblem,
)
from ppafo.identification.source import Source
from ppafo.model.gas import SPECIES
from ppafo.parameters.parameter_set import ParameterSet, chosen_valve, number_in_si
from ppafo.parameters.provenance import CONFIDENCE
from ppafo.units import parse_quantity, to_si

UNKNOWN = "unknown"
_COLDEST, _HOTTEST = 150.0, 600.0


@dataclass(frozen=True, slots=True)
class Setting:
    """What a procedure may lean on: the set as it stands, the chosen valve, and what messages call the place."""

    parameter_set: ParameterSet
    valve: str
    place: str

    def number(self, path: str) -> float:
        """Return the value at a path [SI]; IdentificationError where the set lacks it."""
        value = number_in_si(self.parameter_set, path)
        if value is None:
            raise IdentificationError(f"{self.place}: needs {path}, which {self.parameter_set.file} does not have")
        return value

    def quantity(self, name: str, text: str | None, unit: str) -> float | None:
        """Return a quantity of the problem file [unit], None where it was left out.

        IdentificationError where its text does not fit the unit.
        """
        if text is None:
            return None
        try:
            return parse_quantity(text, unit)
        except UnitError as error:
            raise IdentificationError(f"{self.place}: {name} = {text!r}: {error}") from error

    def gas(self, species: str | None, text: str | None, confidence: float) -> GasAt:
        """Return the gas of the bench; species and temperature are the set's where none is named.

        IdentificationError for an unknown species.
        """
        temperature, half_width = self._temperature(text, confidence)
        if species is None:
            own = self.number("gas.molar_mass"), self.number("gas.heat_capacity_ratio")
            return GasAt(*own, temperature, half_width)
        if species not in SPECIES:
            hint = nearest_name(species, SPECIES)
            known = ", ".join(SPECIES)
            raise IdentificationError(f"{self.place}: gas = {species!r} is unknown{hint}; available: {known}")
        known_gas = SPECIES[species]
        return GasAt(known_gas.molar_mass, known_gas.heat_capacity_ratio, temperature, half_width)

    def _temperature(self, text: str | None, confidence: float) -> tuple[float, float]:
        """Return the gas temperature [K] and half the width of its interval [K], which one that is given has not."""
        given = self.quantity("temperature", text, "K")
        if given is None:
            return self.number("gas.temperature"), self.half_width("gas.temperature", "K", confidence)
        if not _COLDEST <= given <= _HOTTEST:
            raise IdentificationError(
                f"{self.place}: temperature = {text!r} must be from {_COLDEST:g} to {_HOTTEST:g} K"
            )
        return given, 0.0

    def half_width(self, path: str, unit: str, confidence: float) -> float:
        """Return half the interval of a value in the set [unit], for some confidence; 0 where it has none."""
        entry = self.parameter_set.numbers.get(path)
        if entry is None or not entry.uncertainty:
            return 0.0
        stated = to_si(entry.value + entry.uncertainty, entry.unit, unit) - to_si(entry.value, entry.unit, unit)
        return half_width_for(confidence, stated, CONFIDENCE)

    def valve_path(self, name: str | None) -> str:
        """Return the path of a valve in the set, ``valves.main``."""
        return f"valves.{chosen_valve(self.parameter_set, name or self.valve)}"


def run_procedure(sources: tuple[Source, ...], problem: ProcedureProblem, setting: Setting) -> BenchResult:
    """Return what a procedure of a problem makes of its recordings."""
    procedure = _PROCEDURES[problem.kind]
    return procedure.run(sources, procedure.settings(problem, setting))


def window_of(problem: ProcedureProblem, setting: Setting) -> tuple[float, float]:
    """Return first and last time [s] that a procedure uses of its recordings."""
    texts = {name: getattr(problem, name, None) for name in ("start", "end")}
    first, last = (setting.quantity(name, text, "s") for name, text in texts.items())
    return -math.inf if first is None else first, math.inf if last is None else last


def prospects_of(sources: tuple[Source, ...], problem: ProcedureProblem, setting: Setting) -> tuple[Prospect, ...]:
    """Return what a procedure can have of its recordings and what not, before it runs."""
    procedure = _PROCEDURES[problem.kind]
    return (*procedure.prospects(sources, procedure.settings(problem, setting)), *data_prospects(sources))


def _static_torque(problem: StaticTorqueProblem, _setting: Setting) -> StaticTorqueSettings:
    return StaticTorqueSettings(problem.confidence, problem.calibration)


def _free_decay(problem: FreeDecayProblem, setting: Setting) -> FreeDecaySettings:
    start, end = (setting.quantity(name, getattr(problem, name), "s") for name in ("start", "end"))
    inertia, half_width, source = _inertia(problem, setting)
    return FreeDecaySettings(start, end, inertia, half_width, source, problem.confidence, problem.calibration)


def _inertia(problem: FreeDecayProblem, setting: Setting) -> tuple[float | None, float, str]:
    """Return the inertia [kg m^2], half the width of its interval and where it comes from; None where it is unknown."""
    if problem.inertia == UNKNOWN:
        return None, 0.0, ""
    if problem.inertia is not None:
        value = setting.quantity("inertia", problem.inertia, "kg m^2")
        if value is None or value <= 0.0:
            raise IdentificationError(f"{setting.place}: inertia = {problem.inertia!r} must be above zero")
        return value, 0.0, "given in the problem"
    entry = setting.parameter_set.numbers.get("foot_plate.inertia")
    if entry is None:
        return None, 0.0, ""
    value = setting.number("foot_plate.inertia")
    half_width = setting.half_width("foot_plate.inertia", "kg m^2", problem.confidence)
    return value, half_width, f"{entry.origin} in {setting.parameter_set.name}"


def _open_valve_flow(problem: OpenValveFlowProblem, setting: Setting) -> OpenValveFlowSettings:
    path = setting.valve_path(problem.valve)
    area = number_in_si(setting.parameter_set, f"{path}.area")
    gas = setting.gas(problem.gas, problem.temperature, problem.confidence)
    return OpenValveFlowSettings(gas, problem.law, area, path, problem.confidence, problem.calibration)


def _valve_map(problem: ValveMapProblem, setting: Setting) -> ValveMapSettings:
    gas, path = setting.gas(problem.gas, problem.temperature, problem.confidence), setting.valve_path(problem.valve)
    return ValveMapSettings(gas, path, problem.confidence, problem.calibration)


def _vane_leak(problem: VaneLeakProblem, setting: Setting) -> VaneLeakSettings:
    start, end = (setting.quantity(name, getattr(problem, name), "s") for name in ("start", "end"))
    volume_1, volume_2 = _volumes(problem, setting)
    forms = ("discharge_coefficient", "critical_ratio")
    coefficient, ratio = (number_in_si(setting.parameter_set, f"actuator.leak.{name}") for name in forms)
    return VaneLeakSettings(
        gas=setting.gas(problem.gas, problem.temperature, problem.confidence),
        volume_1=volume_1,
        volume_2=volume_2,
        discharge_coefficient=coefficient,
        start=start,
        end=end,
        confidence=problem.confidence,
        calibration=problem.calibration,
        critical_ratio=ratio,
    )


def _volumes(problem: VaneLeakProblem, setting: Setting) -> tuple[float | None, float | None]:
    """Return both volumes [m^3]: as given, else from the angle and the set, equations (4), (5); None where unknown."""
    given = [setting.quantity(name, getattr(problem, name), "m^3") for name in ("volume_1", "volume_2")]
    for name, volume in zip(("volume_1", "volume_2"), given, strict=True):
        if volume is not None and volume <= 0.0:
            raise IdentificationError(f"{setting.place}: {name} = {getattr(problem, name)!r} must be above zero")
    angle = setting.quantity("angle", problem.angle, "rad")
    if angle is None:
        return given[0], given[1]
    names = ("angle_min", "angle_max", "volume_per_angle", "dead_volume_1", "dead_volume_2")
    lower, upper, per_angle, dead_1, dead_2 = (setting.number(f"actuator.{name}") for name in names)
    if not lower <= angle <= upper:
        raise IdentificationError(f"{setting.place}: angle = {problem.angle!r} lies beyond the stops of the set")
    found = (dead_1 + per_angle * (angle - lower), dead_2 + per_angle * (upper - angle))
    return given[0] or found[0], given[1] or found[1]


@dataclass(frozen=True, slots=True)
class _Procedure:
    """How a procedure gets its settings, what it can give before it runs, and how it runs."""

    settings: Callable[..., Any]
    prospects: Callable[..., tuple[Prospect, ...]]
    run: Callable[..., BenchResult]


_PROCEDURES = {
    "static-torque": _Procedure(_static_torque, static_prospects, static_torque),
    "free-decay": _Procedure(_free_decay, decay_prospects, free_decay),
    "open-valve-flow": _Procedure(_open_valve_flow, flow_prospects, open_valve_flow),
    "valve-map": _Procedure(_valve_map, map_prospects, valve_map),
    "vane-leak": _Procedure(_vane_leak, leak_prospects, vane_leak),
}
