"""Common random draws of the device: every controller gets the same devices, none of them the one it believes in."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.parameters.device import Device, Orifice, SonicOrifice
from ppafo.simulation.declaration import LARGEST_SEED
from ppafo.simulation.scenario import Scenario

SEED = 20110301
NOISE_DRAWS = 512
"""Draws that are run once more with other noise, at most."""


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """A value of the device that is uncertain: by what fraction either way, and the device with it times a factor."""

    name: str
    fraction: float
    scaled: Callable[[Device, float], Device]


def _valve(device: Device, factor: float) -> Device:
    return replace(device, valve=replace(device.valve, orifice=_wider(device.valve.orifice, factor)))


def _leak(device: Device, factor: float) -> Device:
    return replace(device, actuator=replace(device.actuator, leak=_wider(device.actuator.leak, factor)))


def _dead_volume_1(device: Device, factor: float) -> Device:
    actuator = device.actuator
    return replace(device, actuator=replace(actuator, dead_volume_1=factor * actuator.dead_volume_1))


def _dead_volume_2(device: Device, factor: float) -> Device:
    actuator = device.actuator
    return replace(device, actuator=replace(actuator, dead_volume_2=factor * actuator.dead_volume_2))


def _supply(device: Device, factor: float) -> Device:
    """The device with both gauge pressures of the supply times a factor."""
    supply = device.supply
    ambient = supply.atmospheric_pressure
    first = ambient + factor * (supply.pressure - ambient)
    second = ambient + factor * (supply.dorsiflexion_pressure - ambient)
    return replace(device, supply=replace(supply, pressure=first, dorsiflexion_pressure=second))


def _friction(device: Device, factor: float) -> Device:
    friction = device.friction
    changed = replace(
        friction,
        static_torque=factor * friction.static_torque,
        dynamic_torque=factor * friction.dynamic_torque,
        viscous_damping=factor * friction.viscous_damping,
    )
    return replace(device, friction=changed)


def _wider(orifice: Orifice | SonicOrifice, factor: float) -> Orifice | SonicOrifice:
    if isinstance(orifice, SonicOrifice):
        return replace(orifice, sonic_conductance=factor * orifice.sonic_conductance)
    return replace(orifice, area=factor * orifice.area)


UNCERTAINTIES = (
    Uncertainty("conductance of the valve", 0.2, _valve),
    Uncertainty("conductance of the leak", 0.2, _leak),
    Uncertainty("dead volume of chamber 1", 0.2, _dead_volume_1),
    Uncertainty("dead volume of chamber 2", 0.2, _dead_volume_2),
    Uncertainty("gauge pressures of the supply", 0.1, _supply),
    Uncertainty("friction", 0.2, _friction),
)
"""What is drawn, each evenly within its fraction: about what identification and a regulator leave open."""


def draw_devices(scenario: Scenario, factors: Floats) -> list[Scenario]:
    """The scenario with each of the devices that the rows of ``factors`` (draws, uncertainties) make of its own."""
    return [replace(scenario, device=scale_device(scenario.device, row.tolist())) for row in factors]


def scale_device(device: Device, factors: Sequence[float]) -> Device:
    """The device with each of its uncertain values times a factor, in the order of ``UNCERTAINTIES``."""
    for uncertainty, factor in zip(UNCERTAINTIES, factors, strict=True):
        device = uncertainty.scaled(device, factor)
    return device


def draw_factors(draws: int, seed: int = SEED) -> Floats:
    """Factors (draws, uncertainties), the same for every controller."""
    fractions = np.array([item.fraction for item in UNCERTAINTIES])
    even = np.random.default_rng(seed).uniform(-1.0, 1.0, (draws, fractions.size))
    return np.asarray(1.0 + fractions * even)


def draw_seeds(draws: int, seed: int = SEED) -> Floats:
    """Seeds of the noise (draws,), the same for every controller."""
    return np.random.default_rng([seed, 1]).integers(0, LARGEST_SEED + 1, draws).astype(np.float64)


def with_noise(scenarios: Sequence[Scenario], seeds: Floats) -> list[Scenario]:
    """Scenarios, each with the noise stream of its seed."""
    pairs = zip(scenarios, seeds.tolist(), strict=True)
    return [replace(item, sensors=replace(item.sensors, seed=int(seed))) for item, seed in pairs]
