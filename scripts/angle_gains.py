"""Draws joints with spools and regulators and counts runs of their default angle gains that are good, or swing.

    python scripts/angle_gains.py --seed 14
    python scripts/angle_gains.py --seed 14 --rates

Each of 24 joints starts with empty chambers, two of three under a load of 0.1 to 0.4 of the torque, and holds, moves in
0.3 s, holds and jumps half the way back; in a second task it follows a sine of 0.3 to 3 Hz. The law keeps the gains of
the nominal device on five others: inertia 0.7 and 1.5, supply 0.93, friction 0.7 and 1.4. Good is an RMS error of 5 %
in the second half of each rest without swinging by 15 %, or of 45 % on the sine.
``--rates`` prints the torque rate along the runs over R of the rule. All is synthetic.
"""

import argparse
import math
import random
import sys
import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ppafo import simulate
from ppafo.metrics.metric import followed
from ppafo.model.orifice import orifice_flow
from ppafo.parameters.graph import Asked
from ppafo.parameters.plant import plant_parameters
from ppafo.simulation.default_gains import loop_parts
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import scenario_from_dict
from ppafo.simulation.numbers import number_at
from ppafo.simulation.scenario import Scenario

DEVICES = {
    "foot_plate.inertia": (1.0, 0.7, 1.5, 1.0, 1.0, 1.0),
    "supply.pressure": (1.0, 1.0, 1.0, 0.93, 1.0, 1.0),
    "friction.dynamic_torque": (1.0, 1.0, 1.0, 1.0, 0.7, 1.4),
    "friction.static_torque": (1.0, 1.0, 1.0, 1.0, 1.0, 1.4),
}
JOINTS, SPOOLS = 24, 18
RESTS = ((0.0, 0.3), (0.6, 1.3), (1.33, 2.1))
"""Rests of the first task [s]."""


def number(path: str, value: float, unit: str) -> str:
    """A number of a parameter set."""
    return f'[{path}]\nvalue = {value:.6g}\nunit = "{unit}"\norigin = "datasheet"\nsource = "drawn"\n'


def draw_set(draw: random.Random, place: Path, valve: str) -> tuple[float, float, float]:
    """Write the set of a drawn joint; returns its stops [deg] and its torque [N m]."""

    def log(low: float, high: float) -> float:
        return float(low * (high / low) ** draw.random())

    first, gauge, torque = draw.uniform(10.0, 70.0), draw.uniform(2.5, 8.0), log(0.04, 50.0)
    last, growth, inertia, static = (
        first + draw.uniform(50.0, 110.0),
        10.0 * torque / gauge,
        torque * log(3e-4, 2e-2),
        0.0,
    )
    static = torque * log(0.003, 0.08)
    dead_1, dead_2 = growth * log(0.05, 0.8), growth * log(0.05, 0.8)
    volume = 0.5 * growth * math.radians(last - first) + 0.5 * (dead_1 + dead_2)
    numbers = [
        ("supply.pressure", gauge, "bar_g"),
        ("supply.atmospheric_pressure", 101325.0, "Pa_a"),
        ("flow.linear_ratio", 0.999, ""),
        ("gas.temperature", 20.0, "degC"),
        ("gas.heat_capacity_ratio", 1.4, ""),
        ("gas.molar_mass", 28.96, "g/mol"),
        ("actuator.angle_min", first, "deg"),
        ("actuator.angle_max", last, "deg"),
        ("actuator.restitution", 0.0, ""),
        ("actuator.leak.area", 0.0, "mm^2"),
        ("actuator.leak.discharge_coefficient", 0.6, ""),
        ("actuator.torque_constant", growth, "cm^3"),
        ("actuator.displacement_per_radian", growth, "cm^3/rad"),
        ("actuator.dead_volume_1", dead_1, "cm^3"),
        ("actuator.dead_volume_2", dead_2, "cm^3"),
        ("friction.static_torque", static, "N m"),
        ("friction.dynamic_torque", static * draw.uniform(0.5, 0.95), "N m"),
        ("friction.viscous_damping", log(0.01, 0.1) * math.sqrt(inertia * torque), "N m s/rad"),
        ("foot_plate.inertia", inertia, "kg m^2"),
        ("foot_plate.gravity_torque", torque * draw.choice((0.0, 0.0, 0.05, 0.15)), "N m"),
        (f"valves.{valve}.sonic_conductance", volume * 1e-3 * gauge / (gauge + 1.013) / log(0.05, 1.0), "L/(s bar)"),
        (f"valves.{valve}.critical_ratio", draw.uniform(0.2, 0.5), ""),
    ]
    if valve == "proportional":
        numbers += [("valves.proportional.delay", log(0.5, 12.0), "ms")]
        numbers += [("valves.proportional.dead_band", draw.uniform(0.02, 0.12), "")] * (draw.random() < 0.5)
        numbers += [("valves.proportional.spool_frequency", log(15.0, 150.0), "Hz")] * (draw.random() < 0.4)
    else:
        numbers += [
            ("valves.pressure_regulator.lowest_pressure", 0.0, "bar_g"),
            ("valves.pressure_regulator.highest_pressure", gauge * draw.uniform(0.6, 1.0), "bar_g"),
            ("valves.pressure_regulator.response_time", log(10.0, 300.0), "ms"),
            ("valves.pressure_regulator.band", log(0.005, 0.06), ""),
        ]
    head = f'schema_version = 1\nname = "joint"\ntitle = "Drawn"\ndefault_valve = "{valve}"\n[valves.{valve}]\n'
    head += f'kind = "{valve}"\n[gas.species]\nvalue = "air"\norigin = "datasheet"\nsource = "drawn"\n'
    place.write_text(head + "".join(number(*item) for item in numbers), encoding="utf-8")
    return first, last, torque


def draw_tasks(draw: random.Random, folder: Path, valve: str) -> list[tuple[Scenario, bool]]:
    """Return two tasks of a drawn joint, each with whether it rests."""
    first, last, torque = draw_set(draw, folder / "joint.toml", valve)
    start, end = (first + draw.uniform(*part) * (last - first) for part in ((0.25, 0.4), (0.6, 0.75)))
    back, middle = 0.5 * (start + end), 0.5 * (first + last)
    load = draw.choice((0.0, 1.0, 1.0)) * draw.uniform(0.1, 0.4) * torque * draw.choice((-1.0, 1.0))
    late = draw.choice((0.0, 10.0 ** draw.uniform(0.0, 1.0)))
    law = {"kind": "cascade", "rate": f"{draw.choice((500, 1000, 2000))} Hz"}
    moves: dict[str, Any] = {"kind": "tabulated", "period": "10 s", "level": "0 deg", "value_01": f"{start} deg"}
    knots = ((0.3, start), (0.6, end), (1.3, end), (1.33, back), (9.0, back))
    for place, (time, value) in enumerate(knots, start=2):
        moves |= {f"time_{place:02d}": f"{time} s", f"value_{place:02d}": f"{value} deg"}
    wave = {"kind": "sine", "level": f"{middle} deg", "amplitude": f"{draw.uniform(5.0, 12.0)} deg"}
    wave["frequency"] = f"{0.3 * 10.0 ** draw.random()} Hz"
    return [
        (
            scenario_from_dict(
                {
                    "schema_version": 1,
                    "name": "joint",
                    "device": {"set": str(folder / "joint.toml"), "valve": valve},
                    "run": {"duration": f"{duration} s", "output_interval": "2 ms"},
                    "motion": {"kind": "free", "angle": f"{angle} deg", "external_torque": f"{load} N m"},
                    "controller": law,
                    "reference": {"of": "angle", **reference},
                    "sensors": {"delay": f"{late} ms"},
                }
            ),
            rests,
        )
        for duration, angle, reference, rests in ((2.1, start, moves, True), (6.0, middle, wave, False))
    ]


def judged(time: np.ndarray, reference: np.ndarray, angle: np.ndarray, rests: bool) -> tuple[bool, bool]:
    """Return whether a run is good, and whether it swings."""
    error, wanted = angle - reference, float(np.ptp(reference))
    if not np.isfinite(error).all():
        return False, True
    if not rests:
        late = error[time >= 0.5 * time[-1]]
        return float(np.sqrt(np.mean(late**2))) <= 0.45 * wanted / math.sqrt(8.0), False
    good, swings = True, False
    for begin, end in RESTS:
        rest = error[(time >= 0.5 * (begin + end)) & (time <= end)]
        allowed = max(0.15 * wanted, math.radians(1.0))
        root = float(np.sqrt(np.mean(rest**2)))
        good &= root <= max(0.05 * wanted, math.radians(0.5 if begin else 1.0)) and np.ptp(rest) <= allowed
        turns = np.count_nonzero(np.diff(np.sign(rest - rest.mean())))
        swings |= bool(np.ptp(rest) > allowed and turns >= 3)
    return bool(good), swings


def counted(scenario: Scenario, rests: bool) -> tuple[int, int]:
    """Return how many of the six devices are good, and how many swing."""
    known = {path: number_at(scenario, path) for path in scenario.links if path.startswith("controller.")}
    columns = {path: np.full(6, value) for path, value in known.items()}
    columns |= {path: number_at(scenario, path) * np.array(sizes) for path, sizes in DEVICES.items()}
    recording = simulate(scenario).recording
    reference = np.asarray(followed(recording)[0])
    angles = run_ensemble(scenario, columns, (), ["angle"]).traces["angle"][: reference.size]
    results = [judged(np.asarray(recording.time), reference, angles[:, run], rests) for run in range(6)]
    return sum(good for good, _ in results), sum(swings for _, swings in results)


def rates(scenario: Scenario) -> float:
    """Return the median torque rate at full opening along a run, of both directions, over R of the rule [-]."""
    assert scenario.law is not None
    parts, plant, groups = loop_parts(scenario, scenario.law), plant_parameters(scenario.device), dict[str, Any]()
    group = partial(parts.group, settings=Asked(partial(number_at, scenario)), kept=groups)
    loop, actuator, stops, around = (group(name) for name in ("torque_loop", "actuator", "stops", "around"))
    recording, ratios = simulate(scenario).recording, list[float]()
    per_flow = number_at(scenario, "gas.temperature") * 8.314462618 / number_at(scenario, "gas.molar_mass")
    flow = partial(orifice_flow, conductance=plant.valve_conductance, is_relieving=1.0, curve=plant.valve_curve)
    for row in range(0, recording.time.size, 20):
        first, second = float(recording["pressure_1"][row]), float(recording["pressure_2"][row])
        mean = parts.chambers_at(actuator, stops, around, float(recording["angle"][row]))
        by_1, by_2 = (
            per_flow * torque / volume
            for torque, volume in (
                (mean.torque_per_pressure_1, mean.volume_1),
                (mean.torque_per_pressure_2, mean.volume_2),
            )
        )
        room = plant.atmospheric_pressure
        up = by_1 * flow(plant.supply_pressure, first)[0] + by_2 * flow(second, room)[0]
        down = by_2 * flow(plant.dorsiflexion_pressure, second)[0] + by_1 * flow(first, room)[0]
        ratios += [up / loop.rate, down / loop.rate]
    return float(np.median(ratios))


def main(words: Sequence[str] | None = None) -> int:
    """Print the counts."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seed", type=int, default=14)
    parser.add_argument("--rates", action="store_true", help="torque rates along the runs of the spools")
    given = parser.parse_args(words)
    draw, total, along = random.Random(given.seed), np.zeros(2, dtype=int), list[float]()
    with tempfile.TemporaryDirectory() as folder:
        for joint in range(JOINTS):
            valve = "proportional" if joint < SPOOLS else "pressure_regulator"
            for scenario, rests in draw_tasks(draw, Path(folder), valve):
                if given.rates:
                    along += [rates(scenario)] if rests and joint < SPOOLS else []
                else:
                    total += counted(scenario, rests)
    if given.rates:
        low, median, high = np.percentile(along, (25, 50, 75))
        print(f"torque rate over R: median {median:.2f}, quartiles {low:.2f} and {high:.2f}")
    else:
        print(f"good {total[0]} of {12 * JOINTS}, swings {total[1]}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
