"""Gas and work: what a task costs, and what it gives."""

import numpy as np

from ppafo.metrics.metric import MetricKind
from ppafo.signals import Recording


def _gain(recording: Recording, name: str) -> float:
    values = recording[name]
    return float(values[-1] - values[0])


def gas_supplied(recording: Recording) -> float:
    """Gas taken from the supply [kg]."""
    return _gain(recording, "supplied_mass")


def gas_vented(recording: Recording) -> float:
    """Gas let out to the atmosphere [kg]."""
    return _gain(recording, "vented_mass")


def gas_leaked(recording: Recording) -> float:
    """Gas leaked past the vane [kg], either way."""
    return _gain(recording, "leaked_mass")


def gas_imbalance(recording: Recording) -> float:
    """Supplied less vented less stored gas [kg]; what a simulation loses or invents, near 0 for a sound one."""
    stored = _gain(recording, "mass_1") + _gain(recording, "mass_2")
    return gas_supplied(recording) - gas_vented(recording) - stored


def largest_pressure(recording: Recording) -> float:
    """Largest pressure in either chamber [Pa absolute]."""
    return float(max(np.max(recording["pressure_1"]), np.max(recording["pressure_2"])))


def mechanical_work(recording: Recording) -> float:
    """Work of the actuator on the vane [J]: integral of torque over angle, which is torque times speed over time.

    Over the angle it needs no speed, and an impact at a stop costs no accuracy.
    """
    return float(np.trapezoid(recording["torque"], recording["angle"]))


def work_per_gas(recording: Recording) -> float | None:
    """Mechanical work per gas taken from the supply [J/kg]; None where none was taken."""
    gas = gas_supplied(recording)
    return mechanical_work(recording) / gas if gas > 0.0 else None


_BALANCE = ("supplied_mass", "vented_mass", "mass_1", "mass_2")

METRICS = (
    MetricKind("gas_supplied", "kg", "gas taken from the supply", ("supplied_mass",), gas_supplied),
    MetricKind("gas_vented", "kg", "gas let out to the atmosphere", ("vented_mass",), gas_vented),
    MetricKind("gas_leaked", "kg", "gas leaked past the vane, either way", ("leaked_mass",), gas_leaked),
    MetricKind("gas_imbalance", "kg", "supplied less vented less stored gas", _BALANCE, gas_imbalance),
    MetricKind("largest_pressure", "Pa", "largest absolute pressure", ("pressure_1", "pressure_2"), largest_pressure),
    MetricKind("mechanical_work", "J", "work of the actuator on the vane", ("torque", "angle"), mechanical_work),
    MetricKind("work_per_gas", "J/kg", "work per supplied gas", ("torque", "angle", "supplied_mass"), work_per_gas),
)
