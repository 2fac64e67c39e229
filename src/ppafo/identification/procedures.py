"""Bench procedures of a problem file: their tables, completed with values from a parameter set, and their runs.

The recommended order matters where one procedure uses results of another: torque and friction come first because they
need no others, the flow of the open valve comes before the valve map, and the leak comes last, because its chambers
must be known to be closed.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from ppafo.documents.models import StrictTable, Text
from ppafo.errors import IdentificationError, PpafoError, noted_in, raise_noted
from ppafo.identification.bench.flow import GasAt, Law
from ppafo.identification.bench.free_decay import ANGLE, free_decay
from ppafo.identification.bench.law import BenchResult
from ppafo.identification.bench.open_valve_flow import CHANNELS as OPEN_VALVE_CHANNELS
from ppafo.identification.bench.open_valve_flow import open_valve_flow
from ppafo.identification.bench.readings import check_channels
from ppafo.identification.bench.static_torque import FORCE, TORQUE, static_torque
from ppafo.identification.bench.valve_map import CHANNELS as VALVE_MAP_CHANNELS
from ppafo.identification.bench.valve_map import valve_map
from ppafo.identification.bench.vane_leak import CHANNELS as CHAMBER_PRESSURES
from ppafo.identification.bench.vane_leak import GAP, vane_leak
from ppafo.identification.estimate import WRONG_UNIT
from ppafo.identification.new_set import stated_half_width
from ppafo.identification.source import RecordingSource
from ppafo.identification.tolerances import DEFAULTS, Columns, Confidence, Tolerances, positive_in, quantity_in
from ppafo.model.gas import SPECIES
from ppafo.parameters.device import VANE
from ppafo.parameters.parameter_set import (
    ParameterSet,
    atmospheric_pressure,
    chosen_valve,
    number_in_si,
    with_followers,
)
from ppafo.signals.recording import Recording
from ppafo.simulation.recorded.usual_errors import deviation_of_limit, misread_units
from ppafo.units import from_si, split_pressure_kind
from ppafo.units.spelling import molar_mass_in
from ppafo.wording import known_names, percentage, said_missing

_NEAR = 1.5
"""Largest ratio [-] of a discharge coefficient in another unit to the value of the set, for the unit to be accused."""
_LARGEST_COEFFICIENT = 1.0
"""Discharge coefficient [-] of a jet as wide as its opening: above it, the area stated or a unit is wrong."""
_LARGE_SCATTER, _SMOOTHER = 0.01, 5.0
"""Scatter of readings from which another unit is tried, and its ratio to the scatter with that unit to report it [-].

The zero of a gauge pressure and the choked flow make a law of the absolute pressure fit one unit only.
"""
_ROUNDING = 1.0e-6
"""Difference of scatter [-] of readings that are computed, in two units, for flow that is choked throughout."""
_NEEDED = {
    "static-torque": (TORQUE, "pressure_difference", "direction"),
    "free-decay": (ANGLE,),
    "open-valve-flow": OPEN_VALVE_CHANNELS,
    "valve-map": VALVE_MAP_CHANNELS,
    "vane-leak": CHAMBER_PRESSURES,
}
"""Channels that every recording of a procedure needs, by procedure in the recommended order."""
PROCEDURES = tuple(_NEEDED)
_Valve = Annotated[Text | None, Field(description="name of a valve of the set; default: the chosen one")]
_UNKNOWN = "unknown"
_COLDEST, _HOTTEST = 150.0, 600.0
"""Lowest and highest gas temperature [K] of a bench."""
_SAME_GAS = 0.01
"""Relative difference of two molar masses up to which they are of one gas [-]."""
_THERMOMETER = 1.0
"""Error limit [K] of a gas temperature stated in the problem file."""
_STEPS_OF_DECAY = 5.0e-6, 0.2
"""Times between samples of a free decay [s], which lasts seconds at most; others mean a wrong unit of time."""
_MOST_OF_STOPS = 10.0
"""Largest plausible ratio of swing in a free decay to angle between the stops [-]; more means a wrong unit."""


def with_tried_units(
    result: BenchResult,
    sources: tuple[RecordingSource, ...],
    parameter_set: ParameterSet,
    atmosphere: float,
    run: Callable[[tuple[RecordingSource, ...]], BenchResult],
) -> BenchResult:
    """Return the result, with the verdict of a wrong unit where a repetition in another unit of pressure does better.

    A unit is accused if the readings give a discharge coefficient that no orifice has and, in the other unit, one near
    that of the set with no more scatter. Far less scatter in another unit is a remark, since another law may scatter
    less as well, and so is a value far from the set, which may be of another device. ``atmosphere`` [Pa absolute] is
    the zero of gauge pressures; ``run`` repeats the procedure with other recordings.
    """
    impossible = [
        estimate.path
        for estimate in result.estimates
        if estimate.path.endswith(".discharge_coefficient") and estimate.value > _LARGEST_COEFFICIENT
    ]
    if not (impossible or result.scatter > _LARGE_SCATTER):
        return result
    channels = {name: channel for source in sources for name, channel in source.recording.channels.items()}
    pressures = tuple(name for name, channel in channels.items() if channel.unit == "Pa")
    # All absolute pressures together, then each one.
    groups = dict.fromkeys((pressures, *((name,) for name in pressures)))
    stated = {group: [channels[name].stated for name in group] for group in groups}
    # Accusations first, then the least scatter.
    first, found = (True, math.inf), result
    for names, (mistake, factor) in ((group, each) for group in groups for each in misread_units("Pa", stated[group])):
        again = [replace(source, recording=_in_unit(source.recording, names, factor, atmosphere)) for source in sources]
        try:
            tried = run(tuple(again))
        except IdentificationError:
            continue
        expected = [(tried[path].value, number_in_si(parameter_set, path) or math.inf) for path in impossible]
        is_near = bool(impossible) and all(1.0 / _NEAR < value / number < _NEAR for value, number in expected)
        is_accused = is_near and tried.scatter <= result.scatter + _ROUNDING
        is_smoother = result.scatter > _LARGE_SCATTER and _SMOOTHER * tried.scatter < result.scatter
        rank = not is_accused, tried.scatter
        if not (is_accused or is_smoother) or rank >= first:
            continue
        first = rank
        text = (
            f"with {' and '.join(names)} as {mistake}, a factor of {max(factor, 1.0 / factor):.4g}, the scatter is "
            f"{percentage(tried.scatter, 2)} of the largest reading instead of {percentage(result.scatter, 2)}"
        )
        if is_accused:
            text = f"{text}; correct the unit in the header or the column map"
            doubted = (replace(estimate, verdict=WRONG_UNIT, explanation=text) for estimate in result.estimates)
            found = replace(result, estimates=tuple(doubted))
        else:
            found = replace(result, remarks=(*result.remarks, f"{text}; check the unit, and the law"))
    return found


def _in_unit(recording: Recording, names: Iterable[str], factor: float, atmosphere: float) -> Recording:
    """Return a recording with some absolute pressures divided by a factor, from the zero of their stated unit."""
    for name in names:
        channel = recording.channels[name]
        zero = atmosphere if split_pressure_kind(channel.stated)[1] == "g" else 0.0
        recording = recording.with_channel(name, zero + (channel.values - zero) / factor, channel.unit)
    return recording


@dataclass(frozen=True, slots=True)
class ProcedureContext:
    """Context of a procedure: parameter set, chosen valve, ``label`` of the section in messages, bench tolerances."""

    parameter_set: ParameterSet
    valve: str
    label: str
    tolerances: Tolerances = DEFAULTS

    def numbers(self, *paths: str) -> list[float]:
        """Return the values of parameters [SI]. Raises IdentificationError with every one that the set lacks."""
        found = {path: number_in_si(with_followers(self.parameter_set), path) for path in paths}
        if missing := [path for path, value in found.items() if value is None]:
            raise IdentificationError(f"{self.label}: {said_missing(missing)} in {self.parameter_set.file}")
        return [value for value in found.values() if value is not None]

    def gas(self, problem: "FlowProcedure", sources: tuple[RecordingSource, ...]) -> GasAt:
        """Return the gas of the bench; species and temperature default to the values of the set.

        Raises IdentificationError for an unknown species, and for a flow recorded as one of another gas.
        """
        temperature = quantity_in(problem, "temperature", "K", self.label, _COLDEST, _HOTTEST)
        if temperature is None:
            (temperature,) = self.numbers("gas.temperature")
            deviation = self.deviation("gas.temperature", temperature, "K")
        else:
            limit = self.tolerances.gas_temperature
            deviation = deviation_of_limit(_THERMOMETER if limit is None else limit)
        if problem.gas is None:
            kind = self.numbers("gas.molar_mass", "gas.heat_capacity_ratio")
        elif (species := SPECIES.get(problem.gas)) is None:
            raise IdentificationError(
                f"{self.label}: gas = {problem.gas!r} is unknown{known_names(problem.gas, SPECIES)}"
            )
        else:
            kind = [species.molar_mass, species.heat_capacity_ratio]
        gas = GasAt(kind[0], kind[1], temperature, deviation)
        for source in sources:
            channel = source.recording.channels.get("mass_flow")
            stated = "" if channel is None else channel.stated
            metered = molar_mass_in(stated)
            if metered is None or abs(metered / gas.molar_mass - 1.0) < _SAME_GAS:
                continue
            used = f"the set's, {gas.molar_mass:.4g} kg/mol" if problem.gas is None else problem.gas
            name = _species_of(metered)
            remedy = f"; give gas = '{name}' in the procedure, or correct the unit of the flow" if name else ""
            raise IdentificationError(
                f"{source.name}: mass_flow in '{stated}' is a flow of {name or 'another gas'}, "
                f"{metered:.4g} kg/mol, but the gas of {self.label} is {used}{remedy}"
            )
        return gas

    def deviation(self, path: str, value: float, unit: str) -> float:
        """Return the standard deviation [unit] of a parameter of given ``value``: from bench, set, or defaults."""
        entry = with_followers(self.parameter_set).numbers.get(path)
        return self.tolerances.deviation_of(path, value, 0.0 if entry is None else stated_half_width(entry, unit))

    def valve_path(self, name: str | None) -> str:
        """Return the path of a valve in the set, such as ``valves.main``; None means the chosen valve."""
        return f"valves.{chosen_valve(self.parameter_set, name or self.valve)}"


def _species_of(molar_mass: float) -> str:
    """Return the name of the species of a molar mass [kg/mol], empty if it is of none."""
    return next((name for name, gas in SPECIES.items() if abs(gas.molar_mass / molar_mass - 1.0) < _SAME_GAS), "")


class Procedure(StrictTable):
    """Keys that every procedure has."""

    recordings: tuple[Text, ...] = Field(strict=False, min_length=1, description="files, relative to this one")
    columns: Columns = None
    confidence: Confidence = 0.95


class TimedProcedure(Procedure):
    """Keys of a procedure over time."""

    start: Text | None = Field(None, description="first time to use, such as '2 s'")
    end: Text | None = Field(None, description="last time to use, such as '8 s'")

    def times(self, label: str) -> tuple[float | None, float | None]:
        """Return first and last time [s] used, None for an end of the recording; ``label`` is of messages."""
        return quantity_in(self, "start", "s", label), quantity_in(self, "end", "s", label)


class FlowProcedure(Procedure):
    """Keys of a procedure in which gas flows."""

    gas: Text | None = Field(None, description="species of the gas on the bench; default: the set's")
    temperature: Text | None = Field(None, description="of the gas on the bench, '17 degC'; default: the set's")


class StaticTorqueProblem(Procedure):
    """Table of procedure static-torque: torque constant and static friction from rising and falling pressure."""

    kind: Literal["static-torque"]

    def run(self, sources: tuple[RecordingSource, ...], context: ProcedureContext) -> BenchResult:
        """Identify torque constant and static friction from recordings."""
        return static_torque(sources, self.confidence, context.tolerances)


class FreeDecayProblem(TimedProcedure):
    """Table of procedure free-decay: viscous damping and Coulomb friction from the decay after an impulse."""

    kind: Literal["free-decay"]
    inertia: Text | None = Field(None, description="such as '8.4 g m^2', or 'unknown'; default: the set's")

    def inertia_of(self, context: ProcedureContext) -> tuple[float | None, float]:
        """Return the inertia and its standard deviation [kg m^2], by default from the set; None if unknown."""
        if self.inertia == _UNKNOWN:
            return None, 0.0
        path, inertia = "foot_plate.inertia", positive_in(self, "inertia", "kg m^2", context.label)
        if inertia is not None:
            return inertia, context.tolerances.deviation_of(path, inertia, 0.0)
        inertia = number_in_si(context.parameter_set, path)
        return inertia, 0.0 if inertia is None else context.deviation(path, inertia, "kg m^2")

    def run(self, sources: tuple[RecordingSource, ...], context: ProcedureContext) -> BenchResult:
        """Identify damping and friction from recordings.

        Raises IdentificationError for an implausible angle or an implausible time between samples.
        """
        low, high = (number_in_si(context.parameter_set, f"actuator.angle_{end}") for end in ("min", "max"))
        for source in sources:
            step = float(np.median(np.diff(source.recording.time))) if len(source.recording) > 1 else 0.0
            if step and not _STEPS_OF_DECAY[0] < step < _STEPS_OF_DECAY[1]:
                raise IdentificationError(
                    f"{source.name}: free-decay: the times of the samples are {step:.3g} s apart; is the unit of time "
                    f"{'ms' if step > 1.0e-3 else 's'}?"
                )
            angles = source.recording["angle"] if "angle" in source.recording else source.recording.time[:1]
            turned = float(angles.max() - angles.min())
            if low is not None and high is not None and turned > _MOST_OF_STOPS * (high - low) > 0.0:
                raise IdentificationError(
                    f"{source.name}: free-decay: 'angle' covers {turned:.4g} rad ({turned / math.tau:.3g} turns), but "
                    f"the stops are {math.degrees(high - low):.4g} deg apart; in degrees, give it the unit deg"
                )
        paths = "friction.static_torque", "friction.dynamic_torque"
        static, dynamic = (number_in_si(context.parameter_set, path) for path in paths)
        # Near standstill, the friction of a seal is at most the static friction.
        rise = max(static / dynamic - 1.0, 0.0) if static and dynamic else 1.0
        start, end = self.times(context.label)
        return free_decay(sources, start, end, *self.inertia_of(context), rise, self.confidence, context.tolerances)


class OpenValveFlowProblem(FlowProcedure):
    """Table of procedure open-valve-flow: Cd, or C and b of ISO 6358, of the fully open valve."""

    kind: Literal["open-valve-flow"]
    valve: _Valve = None
    law: Annotated[Law, Field(description="flow law, also the form in which the set gives it")] = "orifice"

    def run(self, sources: tuple[RecordingSource, ...], context: ProcedureContext) -> BenchResult:
        """Identify the flow parameters of the open valve from recordings."""
        path = context.valve_path(self.valve)
        return open_valve_flow(
            sources,
            context.gas(self, sources),
            self.law,
            area=number_in_si(context.parameter_set, f"{path}.area"),
            path=path,
            critical_ratio=number_in_si(context.parameter_set, f"{path}.critical_ratio"),
            confidence=self.confidence,
            tolerances=context.tolerances,
        )


class VaneLeakProblem(FlowProcedure, TimedProcedure):
    """Table of procedure vane-leak: area, conductance or laminar coefficient from decaying pressure or steady flow."""

    kind: Literal["vane-leak"]
    angle: Text | None = Field(None, description="vane angle, from which the set's volumes follow")
    law: Literal["orifice", "iso6358", "laminar", "both"] = Field(
        "orifice",
        description="flow law; an orifice in the form of the set; 'iso6358': C and b; 'both': orifice and laminar gap",
    )
    volume_1: Text | None = Field(
        None, description="volume of chamber 1 with its line, '40 cm^3'; known to 5 %, or to bench.held"
    )
    volume_2: Text | None = Field(None, description="volume of chamber 2 with its line")

    def volumes_of(self, context: ProcedureContext) -> tuple[float | None, float | None, float]:
        """Return both chamber volumes [m^3], stated or from the angle, and their relative standard deviation [-].

        Equations (4), (5): V1 = V_dead1 + v (theta - theta_min) and V2 = V_dead2 + v (theta_max - theta), with v the
        displacement per radian [m^3/rad].
        """
        first, second = (positive_in(self, name, "m^3", context.label) for name in ("volume_1", "volume_2"))
        angle = quantity_in(self, "angle", "rad", context.label)
        deviation = context.tolerances.deviation_of("actuator.dead_volume_1", 1.0, 0.0)
        if angle is not None:
            if context.parameter_set.actuator_kind != VANE:
                raise IdentificationError(
                    f"{context.label}: angle = {self.angle!r} is for a vane; give volume_1 and volume_2"
                )
            names = ("angle_min", "angle_max", "displacement_per_radian", "dead_volume_1", "dead_volume_2")
            lower, upper, per_angle, dead_1, dead_2 = context.numbers(*(f"actuator.{name}" for name in names))
            if not lower <= angle <= upper:
                raise IdentificationError(
                    f"{context.label}: angle = {self.angle!r} lies beyond the stops, {lower:.4g} to {upper:.4g} rad"
                )
            # A volume that is given counts before one from the angle: its line may be another one.
            first = first or dead_1 + per_angle * (angle - lower)
            second = second or dead_2 + per_angle * (upper - angle)
            of_volume = context.deviation("actuator.dead_volume_1", dead_1, "m^3")
            of_angle = (angle - lower) * context.deviation("actuator.displacement_per_radian", per_angle, "m^3/rad")
            deviation = math.hypot(of_volume, of_angle) / (dead_1 + per_angle * (angle - lower))
        return first, second, deviation

    def run(self, sources: tuple[RecordingSource, ...], context: ProcedureContext) -> BenchResult:
        """Identify the leak between the chambers from recordings."""
        first, second, deviation = self.volumes_of(context)
        start, end = self.times(context.label)
        gas = context.gas(self, sources)
        result = vane_leak(
            sources,
            gas,
            first,
            second,
            discharge_coefficient=number_in_si(context.parameter_set, "actuator.leak.discharge_coefficient"),
            start=start,
            end=end,
            confidence=self.confidence,
            critical_ratio=number_in_si(context.parameter_set, "actuator.leak.critical_ratio"),
            law=self.law,
            tolerances=context.tolerances,
            volume_deviation=deviation,
        )
        own = number_in_si(with_followers(context.parameter_set), "gas.molar_mass")
        gap = next((each for each in result.estimates if each.path == GAP and each.is_usable and each.value), None)
        if gap is None or own is None or abs(own / gas.molar_mass - 1.0) < _SAME_GAS:
            return result
        # The flow of a laminar gap goes with 1 / (R T viscosity), that of an orifice needs no viscosity.
        remark = (
            f"{GAP} is not written to the set, whose gas is not that of the bench: give it in device.overrides, "
            f"times {own / gas.molar_mass:.3g} (molar masses) and the viscosity of the gas of the bench over the set's"
        )
        of_bench = replace(gap, path="vane_leak.laminar_coefficient")
        estimates = tuple(of_bench if item is gap else item for item in result.estimates)
        return replace(result, estimates=estimates, remarks=(*result.remarks, remark))


class ValveMapProblem(FlowProcedure):
    """Table of procedure valve-map: dead band, gain, saturation and hysteresis from flow over command."""

    kind: Literal["valve-map"]
    valve: _Valve = None
    nodes: tuple[float, ...] = Field(
        (),
        strict=False,
        description="commands of a table of openings; default: straight beyond a dead band",
    )

    def run(self, sources: tuple[RecordingSource, ...], context: ProcedureContext) -> BenchResult:
        """Identify the flow of the valve over command from recordings."""
        gas = context.gas(self, sources)
        path = context.valve_path(self.valve)
        result = valve_map(sources, gas, path, self.confidence, context.tolerances, self.nodes)
        coefficient = number_in_si(context.parameter_set, f"{path}.discharge_coefficient")
        if not (self.nodes and coefficient and result.estimates[0].is_usable):
            return result
        # The set has area and coefficient, of which the map knows the product alone.
        area, own = 1e6 * result.estimates[0].value / coefficient, number_in_si(context.parameter_set, f"{path}.area")
        text = f"the opening is a share of the full area: with the Cd of the set {path}.area = {area:.4g} mm^2"
        remark = (
            f"{text}, and the set has {1e6 * (own or 0.0):.4g} mm^2, which stays unless it is given in device.overrides"
        )
        return replace(result, remarks=(*result.remarks, remark))


ProcedureProblem = StaticTorqueProblem | FreeDecayProblem | OpenValveFlowProblem | VaneLeakProblem | ValveMapProblem


def check_needed_channels(where: str, problem: ProcedureProblem, read: Sequence[str]) -> None:
    """Raise IdentificationError for channels that a procedure needs beside those ``read``; a force is a torque."""
    needed = [
        FORCE if name == TORQUE and FORCE in read and TORQUE not in read else name for name in _NEEDED[problem.kind]
    ]
    check_channels(where, problem.kind, needed, read)


def run_procedure(
    sources: tuple[RecordingSource, ...], problem: ProcedureProblem, context: ProcedureContext
) -> BenchResult:
    """Run a bench procedure on its recordings.

    Raises IdentificationError, with the name of the recording or the label of the procedure first.
    """
    wrong: list[PpafoError] = []
    for source in sources:
        with noted_in(wrong):
            check_needed_channels(source.name, problem, source.recording.names)
    gas_used = ""
    if isinstance(problem, FlowProcedure):
        with noted_in(wrong):
            gas = context.gas(problem, sources)
            name = _species_of(gas.molar_mass) or f"{gas.molar_mass:.4g} kg/mol"
            origin = " of the set" if problem.gas is None else ""
            gas_used = f"; gas: {name}{origin}, {from_si(gas.temperature, 'degC', 'K'):.4g} degC"
    raise_noted(wrong)
    try:
        result = problem.run(sources, context)
    except IdentificationError as error:
        # An error of a file names the file; an error of a procedure names the label of the procedure in the problem.
        if str(error).startswith((context.label, *(source.name for source in sources))):
            raise
        raise IdentificationError(f"{context.label}: {error}") from error
    atmosphere = atmospheric_pressure(context.parameter_set)
    result = with_tried_units(
        result, sources, context.parameter_set, atmosphere, lambda again: problem.run(again, context)
    )
    result = replace(result, summary=f"{result.summary}{gas_used}")
    acting = ("zero",) if problem.kind == "static-torque" else ()
    idle = [f"'{name}'" for name in context.tolerances.each_recording if name not in acting]
    if not idle or len(sources) == 1:
        return result
    remark = f"bench.each_recording: {' and '.join(idle)} has no effect in {problem.kind}: one value for all"
    return replace(result, remarks=(*result.remarks, remark))
