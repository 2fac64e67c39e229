"""Metrics of gas consumption, work and energy."""

import math
from functools import partial
from typing import NamedTuple

import numpy as np

from ppafo.metrics.metric import Floats, MetricKind, ReadAt, metered
from ppafo.metrics.motion import MOTION
from ppafo.model.columns import Numeric, choose
from ppafo.model.declaration import PlainFunction
from ppafo.signals import Recording
from ppafo.signals.meter import NO_ENERGY, NO_GAS, EnergySample, GasSample, MeterKind, ReferenceSummary, Sample

_BALANCE = ("supplied_mass", "vented_mass", "mass_1", "mass_2")
ENERGIES = ("supplied_enthalpy", "vented_enthalpy", "wall_heat", "gas_work", "gas_energy")
_EFFORT = ("torque", "angle", "supplied_mass")


def gained(recording: Recording, channels: tuple[str, ...], function: PlainFunction | None = None) -> float:
    """Increase of a cumulative channel over a recording, or a function of several increases [SI]."""
    # A total counts from the start of the run, and a recording may be a part of one.
    gains = [float(recording[channel][-1] - recording[channel][0]) for channel in channels]
    return gains[0] if function is None else float(function(*gains))


def gas_imbalance(supplied: Numeric, vented: Numeric, mass_1: Numeric, mass_2: Numeric) -> Numeric:
    """Mass error of a simulation [kg]: supplied minus vented minus stored gas, near 0."""
    # Leaking gas goes from one chamber to the other: it leaves neither sum.
    return supplied - vented - (mass_1 + mass_2)


def gas_taken(supplied: Numeric) -> Numeric:
    """Gas mass exchanged with a supply [kg], unsigned: taken from a regulator, or drawn in by a vacuum."""
    return abs(supplied)


def energy_imbalance(supplied: Numeric, vented: Numeric, heat: Numeric, work: Numeric, stored: Numeric) -> Numeric:
    """Energy error of a simulation [J]: enthalpy supplied minus vented, plus heat, minus work and stored energy."""
    return supplied - vented + heat - work - stored


def largest_pressure(recording: Recording) -> float:
    """Largest chamber pressure [Pa absolute]."""
    return float(max(np.max(recording[name]) for name in ("pressure_1", "pressure_2") if name in recording))


def lowest_temperature(recording: Recording) -> float:
    """Lowest gas temperature in any chamber [K]."""
    return float(min(np.min(recording[name]) for name in ("temperature_1", "temperature_2") if name in recording))


def mechanical_work(recording: Recording) -> float:
    """Work of the actuator on the joint [J]: integral of the torque over the angle.

    An integral over the angle needs no velocity and has no error at an impact.
    """
    return float(np.trapezoid(recording["torque"], recording["angle"]))


def work_per_gas(recording: Recording) -> float | None:
    """Mechanical work divided by the gas taken from the supply [J/kg]; None if no gas was taken."""
    gas = gained(recording, ("supplied_mass",), gas_taken)
    return mechanical_work(recording) / gas if gas > 0.0 else None


def gas_per_work(recording: Recording) -> float | None:
    """Gas taken from the supply divided by the mechanical work [kg/J]; None if the actuator did no positive work."""
    # A task that takes work from the leg would have a ratio below 0, which would rank as the best.
    work = mechanical_work(recording)
    return gained(recording, ("supplied_mass",), gas_taken) / work if work > 0.0 else None


class _GasGains(NamedTuple):
    """State of the gas meter: gas at the first sample [kg], and increases since then [kg]."""

    first: GasSample
    gained: GasSample


def start_gas(course: ReferenceSummary, sample: Sample) -> _GasGains:
    """Start the gas meter at the first sample."""
    return _GasGains(sample.gas, NO_GAS)


def update_gas(state: _GasGains, course: ReferenceSummary, sample: Sample) -> _GasGains:
    """Update the gas meter with a sample."""
    # A run may go on after its last sample, to the end of a step: what passes there is in no recording.
    gained = GasSample(
        supplied_mass=sample.gas.supplied_mass - state.first.supplied_mass,
        vented_mass=sample.gas.vented_mass - state.first.vented_mass,
        leaked_mass=sample.gas.leaked_mass - state.first.leaked_mass,
        mass_1=sample.gas.mass_1 - state.first.mass_1,
        mass_2=sample.gas.mass_2 - state.first.mass_2,
    )
    return _GasGains(state.first, gained)


GAS = MeterKind("gas", _GasGains, start_gas, update_gas)


class _EnergyGains(NamedTuple):
    """State of the energy meter: energies at the first sample [J], and increases since then [J]."""

    first: EnergySample
    gained: EnergySample


def start_energy(course: ReferenceSummary, sample: Sample) -> _EnergyGains:
    """Start the energy meter at the first sample."""
    return _EnergyGains(sample.energy, NO_ENERGY)


def update_energy(state: _EnergyGains, course: ReferenceSummary, sample: Sample) -> _EnergyGains:
    """Update the energy meter with a sample."""
    gained = EnergySample(
        gas_energy=sample.energy.gas_energy - state.first.gas_energy,
        supplied_enthalpy=sample.energy.supplied_enthalpy - state.first.supplied_enthalpy,
        vented_enthalpy=sample.energy.vented_enthalpy - state.first.vented_enthalpy,
        wall_heat=sample.energy.wall_heat - state.first.wall_heat,
        gas_work=sample.energy.gas_work - state.first.gas_work,
    )
    return _EnergyGains(state.first, gained)


ENERGY = MeterKind("energy", _EnergyGains, start_energy, update_energy)


class Peaks(NamedTuple):
    """State of the peak meter: absolute torque [N m], pressure [Pa absolute], lowest temperature [K]."""

    torque: float
    pressure: float
    temperature: float


def start_peaks(_course: ReferenceSummary, sample: Sample) -> Peaks:
    """Start the peak meter at the first sample."""
    return Peaks(
        torque=abs(sample.torque),
        pressure=max(sample.pressure_1, sample.pressure_2),
        temperature=min(sample.temperature_1, sample.temperature_2),
    )


def update_peaks(state: Peaks, _course: ReferenceSummary, sample: Sample) -> Peaks:
    """Update the peak meter with a sample."""
    return Peaks(
        torque=max(state.torque, abs(sample.torque)),
        pressure=max(state.pressure, sample.pressure_1, sample.pressure_2),
        temperature=min(state.temperature, sample.temperature_1, sample.temperature_2),
    )


PEAKS = MeterKind("peaks", Peaks, start_peaks, update_peaks)


def ratio(above: Floats, below: Floats) -> Floats:
    """Quotient of two arrays; nan unless the divisor is positive."""
    # nan where a recording has None: a column has no other word for it.
    found: Floats = above / choose(below > 0.0, below, math.nan)
    return found


def per_gas(work: Floats, supplied: Floats) -> Floats:
    """Work [J] divided by the absolute gas mass [kg]; nan without gas."""
    return ratio(work, gas_taken(supplied))


def of_gas(supplied: Floats, work: Floats) -> Floats:
    """Absolute gas mass [kg] divided by the work [J]; nan unless the work is positive."""
    return ratio(gas_taken(supplied), work)


_WORK = (MOTION, "work")
_SUPPLIED = (GAS, "gained.supplied_mass")
_COLDEST = "lowest temperature of the gas in a chamber, of a gas with an energy balance"
WITH_ENERGY_BALANCE = frozenset({"temperature_1", "temperature_2", *ENERGIES})
"""Channels present only with an energy balance of the gas."""


def _of_gains(
    name: str,
    unit: str,
    summary: str,
    channels: tuple[str, ...],
    function: PlainFunction | None = None,
    meter: MeterKind = GAS,
    better: int | None = None,
) -> MetricKind:
    """Declare a metric of the increase of a total, or of a function of several increases."""
    compute = partial(gained, channels=channels, function=function)
    places = tuple(f"meters.{meter.name}.gained.{channel}" for channel in channels)
    return MetricKind(name, unit, summary, channels, compute, ReadAt(places, function), (meter,), better=better)


METRICS = (
    _of_gains(
        "gas_supplied", "kg", "gas taken from the supply, or by a vacuum", ("supplied_mass",), gas_taken, better=-1
    ),
    _of_gains("gas_vented", "kg", "gas let out to the atmosphere, below 0 let in", ("vented_mass",)),
    _of_gains("gas_leaked", "kg", "gas leaked from chamber to chamber, in either direction", ("leaked_mass",)),
    _of_gains("gas_imbalance", "kg", "supplied less vented less stored gas", _BALANCE, gas_imbalance),
    _of_gains(
        "energy_imbalance",
        "J",
        "enthalpy supplied less vented, and heat, less work and stored energy of the gas",
        ENERGIES,
        energy_imbalance,
        ENERGY,
    ),
    metered(largest_pressure, "Pa", "largest chamber pressure", ("pressure_1",), (PEAKS, "pressure")),
    metered(lowest_temperature, "K", _COLDEST, ("temperature_1",), (PEAKS, "temperature")),
    metered(mechanical_work, "J", "work of the actuator on the joint", ("torque", "angle"), _WORK, better=0),
    metered(work_per_gas, "J/kg", "work per supplied gas", _EFFORT, _WORK, _SUPPLIED, function=per_gas),
    metered(gas_per_work, "kg/J", "supplied gas per work", _EFFORT, _SUPPLIED, _WORK, function=of_gas, better=-1),
)
