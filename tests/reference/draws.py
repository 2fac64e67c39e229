"""Random devices and experiments as scenario documents, by family; the same number gives the same document.

A family is written for one thing that is hard; ``mixed`` draws everything at once. The documents are in the package's
public form, so that the package and the reference are given the same thing.
"""

import math
import random
from collections.abc import Callable, Mapping
from typing import Any

from ppafo.parameters.device import Supply

Document = dict[str, Any]
Chance = random.Random

GAIT = "falisse2019-subject1"
GASES = (("CO2", 44.0, 1.3), ("air", 28.965, 1.4), ("N2", 28.013, 1.401), ("He", 4.0026, 1.667))
SUPPLY_LINES = ("supply.pressure", "supply.dorsiflexion_pressure")
MAY_RELIEVE = "relieving" in Supply.__dataclass_fields__
"""Whether a set can say that its supplies take gas back."""
PERIODS_MS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 1000.0)
"""10 kHz to 1 Hz."""
ODD_RATES_HZ = (997.0, 333.0, 61.0, 7.0)


def logarithmic(chance: Chance, low: float, high: float) -> float:
    """A number whose logarithm is uniform."""
    return math.exp(chance.uniform(math.log(low), math.log(high)))


def gas(chance: Chance) -> list[str]:
    """One of four gases, at the temperature of some room."""
    name, molar_mass, ratio = chance.choice(GASES)
    temperature = chance.uniform(280.0, 310.0)
    return [
        f"gas.species={name}",
        f"gas.molar_mass={molar_mass} g/mol",
        f"gas.heat_capacity_ratio={ratio}",
        f"gas.temperature={temperature} K",
    ]


def actuator(chance: Chance, dead: tuple[float, float] = (1.0, 15.0), restitution: float | None = None) -> list[str]:
    """Half to twice the paper's actuator; dead volumes in cm^3."""
    bounce = chance.choice([0.0, chance.uniform(0.0, 0.6)]) if restitution is None else restitution
    return [
        f"actuator.torque_constant={chance.uniform(1.1e-5, 1.8e-5)} m^3",
        f"actuator.displacement_per_radian={chance.uniform(30.0, 70.0)} cm^3/rad",
        f"actuator.dead_volume_1={logarithmic(chance, *dead)} cm^3",
        f"actuator.dead_volume_2={logarithmic(chance, *dead)} cm^3",
        f"actuator.restitution={bounce}",
        f"foot_plate.inertia={logarithmic(chance, 3e-3, 9e-2)} kg m^2",
        f"foot_plate.gravity_torque={chance.choice([0.0, chance.uniform(0.0, 0.5)])} N m",
        f"flow.linear_ratio={chance.choice([0.995, 0.999])}",
    ]


def friction(chance: Chance) -> list[str]:
    """Static and dynamic friction and damping."""
    static = chance.uniform(0.1, 0.8)
    return [
        f"friction.static_torque={static} N m",
        f"friction.dynamic_torque={min(static, logarithmic(chance, 0.001, 0.1))} N m",
        f"friction.viscous_damping={logarithmic(chance, 0.003, 0.1)} N m s/rad",
    ]


def supplies(chance: Chance, low: float = 30.0, high: float = 80.0) -> list[str]:
    """Pressures of both supplies, in psi_g."""
    return [f"{line}={chance.uniform(low, high)} psi_g" for line in SUPPLY_LINES]


def relief(chance: Chance) -> list[str]:
    """Supplies that take gas back, in half of the draws."""
    is_relieving = chance.random() < 0.5
    return ["supply.relieving=true"] if MAY_RELIEVE and is_relieving else []


def orifice(chance: Chance, where: str, area: float) -> list[str]:
    """An orifice [mm^2] in either form; both pass about the same choked flow."""
    if chance.random() < 0.7:
        return [f"{where}.area={area} mm^2"]
    conductance = area * 1e-6 * 0.113 * 0.0024
    return [
        f"{where}.sonic_conductance={conductance} m^3/(s Pa)",
        f"{where}.critical_ratio={chance.uniform(0.15, 0.5)}",
    ]


def leak(chance: Chance, none: float = 0.0) -> list[str]:
    """A leak, none at all with the chance ``none``."""
    if chance.random() < none:
        return ["actuator.leak.area=0 mm^2"]
    return orifice(chance, "actuator.leak", logarithmic(chance, 0.02, 1.0))


def spool(chance: Chance) -> list[str]:
    """A spool valve with everything that makes it slow."""
    return [
        f"valve.dead_band={chance.uniform(0.001, 0.1)}",
        f"valve.delay={chance.uniform(0.1, 8.0)} ms",
        f"valve.spool_frequency={logarithmic(chance, 20.0, 200.0)} Hz",
        f"valve.spool_damping_ratio={chance.uniform(0.4, 1.2)}",
        f"valve.slew_limit={logarithmic(chance, 5.0, 200.0)} 1/s",
    ]


def coils(chance: Chance) -> list[str]:
    """Delays of a pair of solenoid valves."""
    longest = chance.choice([1.0, 10.0])
    return [
        f"valve.opening_delay={chance.uniform(0.01, longest)} ms",
        f"valve.closing_delay={chance.uniform(0.01, longest)} ms",
        f"valve.switching_interval={chance.choice([50.0, chance.uniform(0.1, 60.0)])} ms",
    ]


def angle(chance: Chance, stops: float = 0.2) -> float:
    """A start between 20 and 130 deg, with the chance ``stops`` on one of them."""
    return chance.choice([20.0, 130.0]) if chance.random() < stops else chance.uniform(25.0, 125.0)


def free(chance: Chance, speed: float = 0.0, torque: float = 0.0, stops: float = 0.2) -> Document:
    """A free vane with at most that initial speed [deg/s] and that outside torque [N m], either way."""
    return {
        "kind": "free",
        "angle": f"{angle(chance, stops)} deg",
        "angular_velocity": f"{chance.uniform(-speed, speed)} deg/s",
        "external_torque": f"{chance.uniform(-torque, torque)} N m",
    }


def leg(chance: Chance, speed: float = 0.0, torque: float = 0.0, stops: float = 0.2) -> Document:
    """As ``free``, with a foot on a shank that rests or swings; the outside torque is that of the ankle."""
    attitude = f"{chance.uniform(-90.0, 90.0)} deg"
    rest = {"kind": "constant", "level": attitude}
    swing = {
        "kind": "sine",
        "level": attitude,
        "amplitude": f"{chance.uniform(5.0, 40.0)} deg",
        "frequency": f"{logarithmic(chance, 0.5, 4.0)} Hz",
        "phase": f"{chance.random()}",
    }
    start = free(chance, speed, 0.0, stops)
    push = chance.uniform(-torque, torque)
    return {
        "kind": "leg",
        "angle": start["angle"],
        "angular_velocity": start["angular_velocity"],
        "foot_mass": f"{logarithmic(chance, 0.3, 3.0)} kg",
        "foot_mass_centre": f"{chance.uniform(0.03, 0.15)} m",
        "foot_inertia": f"{logarithmic(chance, 3e-4, 1e-2)} kg m^2",
        "shank_length": f"{chance.uniform(0.3, 0.6)} m",
        "ankle_torque": f"{chance.choice([0.0, push])} N m",
        "shank": chance.choice([rest, swing]),
    }


def gauge(chance: Chance, high: float = 50.0) -> str:
    """An initial pressure."""
    return chance.choice(["atmosphere", "supply", f"{chance.uniform(0.0, high)} psi_g"])


def ramp(chance: Chance) -> Document:
    """A torque to be followed."""
    return {
        "kind": "ramp_hold",
        "start_level": "0 N m",
        "level": f"{chance.choice([-1, 1]) * chance.uniform(0.5, 5.0)} N m",
        "ramp_time": f"{chance.uniform(0.02, 0.3)} s",
    }


def pid(chance: Chance) -> Document:
    """PID with gains around the paper's."""
    return {
        "kind": "pid",
        "proportional_gain": f"{logarithmic(chance, 0.03, 0.6)} 1/(N m)",
        "integral_gain": f"{logarithmic(chance, 0.1, 3.0)} 1/(N m s)",
        "derivative_gain": f"{chance.choice([0.0, logarithmic(chance, 1e-4, 6e-3)])} s/(N m)",
        "derivative_filter": f"{chance.choice([0.0, chance.uniform(1.0, 20.0)])} ms",
        "anti_windup": f"{chance.choice([0.0, chance.uniform(1.0, 20.0)])} 1/s",
    }


def sensors(chance: Chance, coarsest: float = 0.5) -> Document:
    """Late and coarse sensors without noise; the coarsest in psi."""
    return {
        "delay": f"{chance.uniform(0.05, 6.0)} ms",
        "angle_resolution": "0.1 deg",
        "pressure_resolution": f"{logarithmic(chance, 0.01, coarsest)} psi_d",
    }


def open_loop(chance: Chance) -> Document:
    """A command that never changes."""
    return {"kind": "constant", "rate": "1 kHz", "command": chance.choice([1.0, -1.0, 0.0, chance.uniform(-1.0, 1.0)])}


def sampled(chance: Chance, law: Document) -> Document:
    """A law with some sample period; some rates have nothing in common with the times of the record."""
    if chance.random() < 0.1:
        return law | {"rate": f"{chance.choice(ODD_RATES_HZ)} Hz"}
    return law | {"period": f"{chance.choice(PERIODS_MS)} ms"}


def document(lines: list[str], motion: Document, law: Document, valve: str = "proportional", **more: Any) -> Document:
    """The scenario with these parts."""
    return {
        "schema_version": 1,
        "name": "drawn",
        "device": {"set": "ppafo2011", "valve": valve, "overrides": lines},
        "run": {"duration": "0.3 s", "output_interval": "1 ms"},
        "motion": motion,
        "controller": law,
        **more,
    }


def start(chance: Chance, high: float = 50.0) -> Document:
    """Both initial pressures."""
    return {"pressure_1": gauge(chance, high), "pressure_2": gauge(chance, high)}


def gases(chance: Chance) -> Document:
    """Four gases through an ideal valve, orifices in both forms."""
    lines = gas(chance) + actuator(chance) + friction(chance) + supplies(chance) + leak(chance)
    lines += orifice(chance, "valve", logarithmic(chance, 5.0, 40.0))
    return document(lines, free(chance), open_loop(chance), initial=start(chance))


def nothing_lost(chance: Chance) -> Document:
    """Neither leak nor friction, a little of either, or one of both."""
    lines = gas(chance) + actuator(chance) + supplies(chance) + leak(chance, none=0.7)
    lines += orifice(chance, "valve", logarithmic(chance, 5.0, 40.0))
    if chance.random() < 0.7:
        lines += ["friction.static_torque=0 N m", "friction.dynamic_torque=0 N m"]
    if chance.random() < 0.7:
        lines += ["friction.viscous_damping=0 N m s/rad"]
    return document(lines, free(chance, speed=100.0), open_loop(chance), initial=start(chance))


def backflow(chance: Chance) -> Document:
    """Chambers above their supply, by the start or by a torque from outside."""
    lines = gas(chance) + actuator(chance) + friction(chance) + supplies(chance, 5.0, 40.0) + leak(chance)
    lines += orifice(chance, "valve", logarithmic(chance, 2.0, 40.0)) + relief(chance)
    return document(lines, free(chance, 200.0, 10.0), open_loop(chance), initial=start(chance, 90.0))


def on_a_stop(chance: Chance) -> Document:
    """Starts on a stop, resting, thrown off it or thrown at it."""
    lines = gas(chance) + actuator(chance) + friction(chance) + supplies(chance) + leak(chance, none=0.2)
    lines += orifice(chance, "valve", logarithmic(chance, 5.0, 40.0))
    speed = chance.choice([0.0, 200.0])
    return document(lines, free(chance, speed, stops=1.0), open_loop(chance), initial=start(chance))


def slow_valves(chance: Chance) -> Document:
    """A valve of 0.1 to 2 mm^2 at 5 to 60 psi_g, and a torque from outside that throws the vane about."""
    lines = gas(chance) + actuator(chance, (1.0, 10.0)) + friction(chance) + supplies(chance, 5.0, 60.0) + leak(chance)
    lines += orifice(chance, "valve", logarithmic(chance, 0.1, 2.0))
    motion = free(chance, speed=300.0)
    motion["external_torque"] = f"{chance.choice([-1, 1]) * chance.uniform(1.0, 30.0)} N m"
    return document(lines, motion, open_loop(chance), initial=start(chance))


def rebounds(chance: Chance) -> Document:
    """Gas with an energy balance, a fast vane and stops that throw it back."""
    lines = gas(chance) + actuator(chance, (1.0, 15.0), chance.choice([0.0, 0.5, 0.8, 1.0, chance.random()]))
    lines += friction(chance) + supplies(chance) + leak(chance, none=0.5)
    lines += orifice(chance, "valve", logarithmic(chance, 0.1, 30.0))
    motion = free(chance, speed=3000.0)
    walls = {"kind": "thermal", "wall_area_per_volume": f"{chance.uniform(100.0, 400.0)} 1/m"}
    walls["heat_transfer_coefficient"] = f"{chance.choice([0.0, logarithmic(chance, 10.0, 3000.0)])} W/(m^2 K)"
    return document(lines, motion, open_loop(chance), initial=start(chance), gas_model=walls)


def loop(chance: Chance, dead: tuple[float, float], valve: str) -> Document:
    """A free vane in a closed loop with late and coarse sensors."""
    lines = gas(chance) + actuator(chance, dead) + friction(chance) + supplies(chance) + leak(chance)
    lines += orifice(chance, "valve", logarithmic(chance, 2.0, 40.0))
    lines += spool(chance) if valve == "proportional" else coils(chance)
    law = sampled(chance, pid(chance) if valve == "proportional" else {"kind": "on_off"})
    rest = {"initial": start(chance), "reference": ramp(chance), "sensors": sensors(chance)}
    return document(lines, free(chance, torque=3.0), law, valve, **rest)


def late_coarse_sensors(chance: Chance) -> Document:
    """A spool valve with all its delays under PID from 1 Hz to 10 kHz, late and coarse sensors."""
    return loop(chance, (1.0, 15.0), "proportional")


def legs(chance: Chance) -> Document:
    """A foot on a shank that rests or swings, moved open loop or by PID."""
    lines = gas(chance) + actuator(chance) + friction(chance) + supplies(chance) + leak(chance)
    lines += orifice(chance, "valve", logarithmic(chance, 2.0, 40.0))
    law = chance.choice([open_loop(chance), sampled(chance, pid(chance))])
    return document(lines, leg(chance, 100.0, 3.0), law, initial=start(chance), reference=ramp(chance))


def legs_in_a_gait(chance: Chance) -> Document:
    """The same with the shank of the built-in gait, without its ground, from anywhere in the stride."""
    drawn = legs(chance)
    drawn["motion"]["shank"] = {"kind": "gait", "gait": GAIT, "start": f"{chance.random()}"}
    return drawn


def solenoid_loops(chance: Chance) -> Document:
    """A pair of solenoid valves with all their delays, switched from 1 Hz to 10 kHz by late and coarse sensors."""
    return loop(chance, (1.0, 15.0), "solenoid")


def dead_volumes(chance: Chance) -> Document:
    """The loop with a spool valve and dead volumes of 0.05 to 30 cm^3."""
    return loop(chance, (0.05, 30.0), "proportional")


def loops_without_friction(chance: Chance) -> Document:
    """A quick valve, high gains, very coarse sensors, and a vane that nothing slows down."""
    lines = gas(chance) + actuator(chance, (0.05, 30.0)) + supplies(chance) + leak(chance, none=0.3)
    lines += orifice(chance, "valve", logarithmic(chance, 1.0, 40.0))
    lines += ["friction.static_torque=0 N m", "friction.dynamic_torque=0 N m"]
    lines += [f"friction.viscous_damping={chance.choice([0.0, logarithmic(chance, 0.001, 0.05)])} N m s/rad"]
    law = sampled(chance, pid(chance)) | {"proportional_gain": f"{logarithmic(chance, 0.1, 3.0)} 1/(N m)"}
    rest = {"initial": start(chance), "reference": ramp(chance), "sensors": sensors(chance, 3.0)}
    return document(lines, free(chance, speed=100.0, torque=1.0), law, **rest)


def prescribed(chance: Chance) -> Document:
    """A vane on a prescribed sine, ideal valve and sensors, PID."""
    lines = gas(chance) + actuator(chance, (0.05, 30.0)) + supplies(chance) + leak(chance, none=0.2)
    lines += orifice(chance, "valve", logarithmic(chance, 1.0, 40.0))
    wave = {
        "kind": "sine",
        "level": f"{chance.uniform(60.0, 90.0)} deg",
        "amplitude": f"{chance.choice([0.0, chance.uniform(5.0, 35.0)])} deg",
        "frequency": f"{chance.uniform(0.5, 6.0)} Hz",
        "phase": f"{chance.random()}",
    }
    rest = {"initial": start(chance), "reference": ramp(chance)}
    return document(lines, {"kind": "prescribed", "profile": wave}, sampled(chance, pid(chance)), **rest)


def mixed(chance: Chance) -> Document:
    """Anything: valve, law, sensors, gas model, motion and dead volumes each drawn by itself."""
    valve = chance.choice(["proportional", "solenoid"])
    lines = gas(chance) + actuator(chance, (0.05, 30.0), chance.choice([0.0, chance.random()])) + friction(chance)
    lines += supplies(chance, 5.0, 80.0) + leak(chance, none=0.2)
    lines += orifice(chance, "valve", logarithmic(chance, 0.1, 40.0)) + relief(chance)
    if chance.random() < 0.5:
        lines += spool(chance) if valve == "proportional" else coils(chance)
    law = chance.choice([open_loop(chance), {"kind": "on_off"}, pid(chance)])
    law = law if law["kind"] == "constant" else sampled(chance, law)
    motion: Document = free(chance, chance.choice([0.0, 300.0]), chance.choice([0.0, 30.0]))
    if chance.random() < 0.3:
        level = f"{chance.uniform(40.0, 110.0)} deg"
        low = f"{chance.uniform(40.0, 110.0)} deg"
        path = {"kind": "ramp_hold", "start_level": low, "level": level, "ramp_start": "0.05 s", "ramp_time": "0.1 s"}
        motion = chance.choice([{"kind": "locked", "angle": level}, {"kind": "prescribed", "profile": path}])
    elif chance.random() < 0.3:
        motion = leg(chance, 300.0, 30.0)
    more: Document = {"initial": start(chance, 90.0), "reference": ramp(chance)}
    if chance.random() < 0.5:
        more["sensors"] = sensors(chance)
    if chance.random() < 0.3:
        more["gas_model"] = {
            "kind": "thermal",
            "heat_transfer_coefficient": f"{chance.choice([0.0, logarithmic(chance, 10.0, 3000.0)])} W/(m^2 K)",
            "wall_area_per_volume": f"{chance.uniform(100.0, 400.0)} 1/m",
        }
    return document(lines, motion, law, valve, **more)


FAMILIES: Mapping[str, Callable[[Chance], Document]] = {
    "gases": gases,
    "nothing lost": nothing_lost,
    "backflow": backflow,
    "on a stop": on_a_stop,
    "slow valves": slow_valves,
    "thermal rebounds": rebounds,
    "late coarse sensors": late_coarse_sensors,
    "solenoid loops": solenoid_loops,
    "dead volumes": dead_volumes,
    "loops without friction": loops_without_friction,
    "prescribed": prescribed,
    "legs": legs,
    "legs in a gait": legs_in_a_gait,
    "mixed": mixed,
}


def draw(family: str, seed: int, number: int) -> Document:
    """Document of one draw of a family."""
    return FAMILIES[family](random.Random(f"{family} {seed} {number}"))
