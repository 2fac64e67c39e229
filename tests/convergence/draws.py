"""Random devices and experiments within plausible ranges, the same for the same seed."""

import dataclasses
import math
import random
from functools import lru_cache

from ppafo.model.catalog import VALVES
from ppafo.parameters.device import (
    Actuator,
    Device,
    Flow,
    FootPlate,
    Friction,
    Gas,
    Orifice,
    SonicOrifice,
    Supply,
    Valve,
)
from ppafo.simulation.loading import load_scenario as load_from_file
from ppafo.simulation.scenario import FreeMotion, PrescribedMotion, ProfileChoice, Scenario, Sensors

PSI = 6894.757293168361
ATMOSPHERE = 101325.0
GASES = (("CO2", 0.044, 1.3), ("air", 0.028965, 1.4), ("N2", 0.028013, 1.401))
load_scenario = lru_cache(load_from_file)
PERIODS = {"proportional": (0.001, 0.002, 0.005), "solenoid": (0.05, 0.05, 0.02, 0.001)}
EXPERIMENTS = ("step", "step with solenoids", "proportional", "solenoid")


def logarithmic(chance: random.Random, low: float, high: float) -> float:
    """A number whose logarithm is uniform."""
    return math.exp(chance.uniform(math.log(low), math.log(high)))


def random_orifice(chance: random.Random, area: float) -> Orifice | SonicOrifice:
    """An orifice in either form; both pass about the same choked flow."""
    if chance.random() < 0.7:
        return Orifice(area, 0.113)
    return SonicOrifice(area * 0.113 * 0.0024, chance.uniform(0.15, 0.5))


def random_valve(chance: random.Random, kind: str) -> Valve:
    """A valve with and without dynamics."""
    settings = {quantity.name: quantity.default or 0.0 for quantity in VALVES[kind].quantities}
    if kind == "solenoid":
        longest = chance.choice([0.001, 0.01])
        settings = {name: chance.uniform(0.0, longest) for name in settings}
        settings["switching_interval"] = chance.choice([0.05, chance.uniform(0.0, 0.06)])
    elif chance.random() < 0.5:
        settings |= {
            "dead_band": chance.uniform(0.0, 0.1),
            "delay": chance.choice([0.0, chance.uniform(0.0, 0.01)]),
            "spool_frequency": chance.choice([0.0, chance.uniform(20.0, 200.0)]),
            "spool_damping_ratio": chance.uniform(0.4, 1.2),
            "slew_limit": chance.choice([0.0, chance.uniform(5.0, 100.0)]),
        }
    return Valve(kind, random_orifice(chance, logarithmic(chance, 5e-6, 40e-6)), settings)


def random_device(chance: random.Random, kind: str) -> Device:
    """A device within plausible ranges: half to twice the paper's, smaller dead volumes and leaks too."""
    name, molar_mass, heat_capacity_ratio = chance.choice(GASES)
    actuator = Actuator(
        torque_constant=chance.uniform(1.1e-5, 1.8e-5),
        displacement_per_radian=chance.uniform(30e-6, 70e-6),
        angle_min=math.radians(20.0),
        angle_max=math.radians(130.0),
        dead_volume_1=logarithmic(chance, 1e-6, 15e-6),
        dead_volume_2=logarithmic(chance, 1e-6, 15e-6),
        restitution=chance.choice([0.0, chance.uniform(0.0, 0.6)]),
        leak=Orifice(logarithmic(chance, 0.02e-6, 1e-6), 0.113),
    )
    static_torque = chance.uniform(0.1, 0.8)
    pressures = [ATMOSPHERE + chance.uniform(30.0, 80.0) * PSI for _ in range(2)]
    return Device(
        name="random",
        gas=Gas(name, molar_mass, heat_capacity_ratio, chance.uniform(280.0, 310.0)),
        actuator=actuator,
        friction=Friction(static_torque, logarithmic(chance, 0.001, 0.1), logarithmic(chance, 0.003, 0.1)),
        foot_plate=FootPlate(logarithmic(chance, 3e-3, 9e-2), chance.uniform(0.0, 0.3)),
        supply=Supply(*pressures, ATMOSPHERE),
        valve=random_valve(chance, kind),
        flow=Flow(chance.choice([0.995, 0.999])),
        valve_name=kind,
    )


def random_scenario(seed: int) -> Scenario:
    """A step response or a torque task with either valve."""
    chance = random.Random(seed)
    experiment = chance.choice(EXPERIMENTS)
    if experiment.startswith("step"):
        device = random_device(chance, "solenoid" if "solenoids" in experiment else "proportional")
        loaded = load_scenario("step-response")
        return dataclasses.replace(
            loaded,
            device=device,
            run=dataclasses.replace(loaded.run, duration=0.6),
            motion=FreeMotion(device.actuator.angle_min, 0.0, 0.0),
            initial=dataclasses.replace(loaded.initial, pressure_2=device.supply.dorsiflexion_pressure),
        )
    device = random_device(chance, experiment)
    base = load_scenario(f"torque-task-{experiment}")
    level = chance.uniform(3.0, 7.0)
    ramp_time = chance.uniform(0.3, 1.0)
    angle = math.radians(chance.choice([50.0, 75.0, 100.0]))
    return dataclasses.replace(
        base,
        device=device,
        run=dataclasses.replace(base.run, duration=1.0),
        motion=PrescribedMotion(ProfileChoice("constant", {"level": angle})),
        reference=ProfileChoice(
            "ramp_hold", {"start_level": 0.0, "level": level, "ramp_start": 0.0, "ramp_time": ramp_time}
        ),
        sensors=dataclasses.replace(Sensors(), delay=chance.choice([0.0, 0.0, chance.uniform(0.0, 0.005)])),
        controller=dataclasses.replace(base.controller, period=chance.choice(PERIODS[experiment])),
    )
