"""Random tasks in which the error of the steps is put to the test, by family; the same number gives the same task.

What they have beside the draws of ``tests/reference``: shanks along cubic curves, chambers that nearly close with and
without an energy balance, lines behind regulators, and a cylinder with a lever.
"""

import random
from collections.abc import Callable, Mapping

from tests.reference import draws
from tests.reference.draws import Chance, Document, logarithmic


def _device(chance: Chance, dead: tuple[float, float], leaky: float = 0.2) -> list[str]:
    lines = draws.gas(chance) + draws.actuator(chance, dead) + draws.friction(chance) + draws.supplies(chance)
    lines += draws.leak(chance, none=leaky)
    return lines + draws.orifice(chance, "valve", logarithmic(chance, 2.0, 40.0))


def _walls(chance: Chance) -> Document:
    exchange = chance.choice([0.0, logarithmic(chance, 10.0, 3000.0)])
    return {
        "kind": "thermal",
        "heat_transfer_coefficient": f"{exchange} W/(m^2 K)",
        "wall_area_per_volume": f"{chance.uniform(100.0, 400.0)} 1/m",
    }


def smooth_shanks(chance: Chance) -> Document:
    """A foot on a shank along cubic curves through three to eight knots, whose acceleration jumps at each."""
    period = chance.uniform(0.2, 1.2)
    knots = chance.randint(3, 8)
    reach = chance.uniform(5.0, 40.0)
    shank = {"kind": "smooth", "period": f"{period} s", "value_01": f"{chance.uniform(-reach, reach)} deg"}
    for number in range(2, knots + 1):
        place = (number - 1 + chance.uniform(-0.3, 0.3)) / knots
        shank[f"time_{number:02}"] = f"{period * place} s"
        shank[f"value_{number:02}"] = f"{chance.uniform(-reach, reach)} deg"
    motion = draws.leg(chance, 100.0, 3.0) | {"shank": shank}
    return draws.document(_device(chance, (1.0, 15.0)), motion, draws.open_loop(chance), initial=draws.start(chance))


def small_chambers(chance: Chance) -> Document:
    """A free vane whose chambers nearly close at the stops."""
    motion = draws.free(chance, speed=300.0, torque=10.0)
    return draws.document(_device(chance, (0.05, 1.0)), motion, draws.open_loop(chance), initial=draws.start(chance))


def small_warm_chambers(chance: Chance) -> Document:
    """The same with an energy balance."""
    return small_chambers(chance) | {"gas_model": _walls(chance)}


def warm_chambers(chance: Chance) -> Document:
    """A free vane with ordinary chambers and an energy balance."""
    motion = draws.free(chance, speed=300.0, torque=5.0)
    document = draws.document(
        _device(chance, (1.0, 15.0)), motion, draws.open_loop(chance), initial=draws.start(chance)
    )
    return document | {"gas_model": _walls(chance)}


def fed_chambers(chance: Chance) -> Document:
    """A free vane behind a regulator with a line."""
    feed = {
        "droop": f"{logarithmic(chance, 1e6, 3e7)} Pa s/kg",
        "largest_flow": f"{logarithmic(chance, 0.3, 5.0)} g/s",
        "volume": f"{logarithmic(chance, 2.0, 100.0)} cm^3",
    }
    lines = [line for line in _device(chance, (1.0, 15.0)) if not line.startswith("supply.dorsiflexion")]
    lines.append(f"supply.dorsiflexion_pressure={chance.uniform(20.0, 30.0)} psi_g")
    motion = draws.free(chance, 100.0, 3.0)
    document = draws.document(lines, motion, draws.open_loop(chance), initial=draws.start(chance))
    return document | {"supply_line": {"plantarflexion": feed}}


def cylinders(chance: Chance) -> Document:
    """A cylinder with a lever from anywhere, with a torque from outside."""
    lines = draws.gas(chance) + draws.supplies(chance)
    # The set has a valve in the form of ISO 6358, which a form with an area would need more than an area for.
    conductance = logarithmic(chance, 5e-10, 1e-8)
    lines += [f"valve.sonic_conductance={conductance} m^3/(s Pa)", f"valve.critical_ratio={chance.uniform(0.15, 0.5)}"]
    lines += [*draws.friction(chance), f"foot_plate.inertia={logarithmic(chance, 0.003, 0.09)} kg m^2"]
    motion = draws.free(chance, 200.0, 5.0)
    drawn = draws.document(lines, motion, draws.open_loop(chance), initial=draws.start(chance))
    drawn["device"] = {"set": "cylinder-lever", "overrides": lines}
    return drawn


def slow_spools(chance: Chance) -> Document:
    """A proportional valve with everything that makes it slow, opened once."""
    lines = _device(chance, (0.3, 15.0)) + draws.spool(chance)
    return draws.document(lines, draws.free(chance, 100.0, 3.0), draws.open_loop(chance), initial=draws.start(chance))


OPEN_LOOP = ("gases", "nothing lost", "backflow", "on a stop", "slow valves", "thermal rebounds", "legs in a gait")
"""Families of the reference in which no decision of a controller can hang by a hair, or few."""
TASKS: Mapping[str, Callable[[Chance], Document]] = {
    "smooth shanks": smooth_shanks,
    "small chambers": small_chambers,
    "small warm chambers": small_warm_chambers,
    "warm chambers": warm_chambers,
    "fed chambers": fed_chambers,
    "cylinders": cylinders,
    "slow spools": slow_spools,
    **{name: draws.FAMILIES[name] for name in OPEN_LOOP},
}


def task(family: str, seed: int, number: int) -> Document:
    """The document of one task of a family."""
    return TASKS[family](random.Random(f"{family} {seed} {number}"))
