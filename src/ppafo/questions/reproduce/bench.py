"""The paper's parameters identified once more, from synthetic bench recordings with the paper's values planted.

Two presets of the rig record each experiment. `ideal-laboratory` has the paper's physics and shows whether a procedure
returns what was planted. `paper-bench` adds effects that the paper's laws do not know, and shows what they do to it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from ppafo.errors import ParameterError
from ppafo.identification.bench import (
    BenchResult,
    FreeDecaySettings,
    OpenValveFlowSettings,
    VaneLeakSettings,
    free_decay,
    open_valve_flow,
    static_torque,
    vane_leak,
)
from ppafo.identification.bench.flow_laws import GasAt
from ppafo.identification.estimate import Estimate
from ppafo.identification.source import Source
from ppafo.parameters import ParameterSet, load_device, load_parameter_set
from ppafo.parameters.parameter_set import number_in_si
from ppafo.rig import record

PLANTED_SET = "ppafo2011"
IDEAL, REALISTIC = "ideal-laboratory", "paper-bench"
SEED = 1
VALVES = ("proportional", "solenoid")


@dataclass(frozen=True, slots=True)
class IdentifiedValue:
    """A parameter of the paper: the planted value [SI] and what the procedure makes of both presets."""

    path: str
    experiment: str
    planted: float
    ideal: Estimate
    realistic: Estimate


@dataclass(frozen=True, slots=True)
class BenchStudy:
    """Every identified value, and both procedures of figure 3 on ``paper-bench``."""

    values: tuple[IdentifiedValue, ...]
    torque: BenchResult
    decay: BenchResult

    def __getitem__(self, path: str) -> IdentifiedValue:
        """Return the value at a path of the parameter set; KeyError where none was identified."""
        for value in self.values:
            if value.path == path:
                return value
        raise KeyError(path)


@cache
def bench_study() -> BenchStudy:
    """Identify the paper's parameters from synthetic recordings; SimulationError without the extra ``reference``."""
    planted = load_parameter_set(PLANTED_SET)
    torque, decay, leak = (_on_both(procedure, planted, "") for procedure in (_torque, _decay, _leak))
    values = [
        _value(planted, "actuator.torque_constant", "static-torque", torque),
        _value(planted, "friction.static_torque", "static-torque", torque),
        _value(planted, "friction.viscous_damping", "free-decay", decay),
        _value(planted, "friction.dynamic_torque", "free-decay", decay),
    ]
    for valve in VALVES:
        flow = _on_both(_flow, planted, valve)
        values.append(_value(planted, f"valves.{valve}.discharge_coefficient", "open-valve-flow", flow))
    values.append(_value(planted, "actuator.leak.area", "vane-leak-steady", leak))
    return BenchStudy(tuple(values), torque[1], decay[1])


def _on_both(
    procedure: Callable[[ParameterSet, str, str], BenchResult], planted: ParameterSet, valve: str
) -> tuple[BenchResult, BenchResult]:
    return procedure(planted, IDEAL, valve), procedure(planted, REALISTIC, valve)


def _record(experiment: str, preset: str, valve: str | None = None) -> tuple[Source, ...]:
    return (Source(record(experiment, preset, SEED, PLANTED_SET, valve=valve).recording),)


def _torque(_planted: ParameterSet, preset: str, _valve: str) -> BenchResult:
    return static_torque(_record("static-torque", preset))


def _decay(planted: ParameterSet, preset: str, _valve: str) -> BenchResult:
    inertia = _planted_value(planted, "foot_plate.inertia")
    settings = FreeDecaySettings(inertia=inertia, inertia_source="as planted")
    return free_decay(_record("free-decay", preset), settings)


def _leak(planted: ParameterSet, preset: str, _valve: str) -> BenchResult:
    coefficient = _planted_value(planted, "actuator.leak.discharge_coefficient")
    settings = VaneLeakSettings(_gas(), discharge_coefficient=coefficient)
    return vane_leak(_record("vane-leak-steady", preset), settings)


def _flow(planted: ParameterSet, preset: str, valve: str) -> BenchResult:
    path = f"valves.{valve}"
    settings = OpenValveFlowSettings(_gas(), area=_planted_value(planted, f"{path}.area"), path=path)
    return open_valve_flow(_record("open-valve-flow", preset, valve), settings)


def _gas() -> GasAt:
    gas = load_device(PLANTED_SET).gas
    return GasAt(gas.molar_mass, gas.heat_capacity_ratio, gas.temperature)


def _planted_value(planted: ParameterSet, path: str) -> float:
    value = number_in_si(planted, path)
    if value is None:
        raise ParameterError(f"{planted.file}: '{path}' is missing; the identification from the rig needs it")
    return value


def _value(
    planted: ParameterSet, path: str, experiment: str, results: tuple[BenchResult, BenchResult]
) -> IdentifiedValue:
    ideal, realistic = (result[path] for result in results)
    return IdentifiedValue(path, experiment, _planted_value(planted, path), ideal, realistic)
