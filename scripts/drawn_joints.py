"""Drawn joints of four kinds of actuator in the tasks of a bench, to count what a verdict on tracking says of them.

Called by ``own_devices.py --joints N --seed S``, which keeps a record of each run. A run is judged here by a criterion
of its own, written apart from the rule of the package: it looks at the last third of a run, at the mean error, the half
range and how often the valve is thrown over, and whether a joint is thrown off on its way. Runs near its limits are
counted as between, since nobody can say whether they are good. All is synthetic.
"""

import ast
import json
import math
import random
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.counterfactuals import verdict_of
from ppafo.errors import PpafoError
from ppafo.parameters.declaration import OF_SECOND_CHAMBER
from ppafo.parameters.reach import torque_reach
from ppafo.simulation.loading import scenario_from_dict
from ppafo.simulation.simulate import Result, simulate

KINDS = ("vane", "cylinder", "bladder", "muscles")
GOOD, FAILS, BETWEEN = "good", "fails", "between"
_BAND = 1.25
"""Factor about a limit within which a run is neither good nor failing."""
_MEAN, _MEAN_OF_PAIR, _HALF_RANGE, _HALF_RANGE_OF_PAIR, _MOVING = 0.05, 0.15, 0.1, 0.45, 0.3
"""Limits over the wanted change: mean error, half range of the error, RMS error of a moving one of a pair."""
_FARTHEST, _FARTHEST_SHARE, _SWING, _SWING_SHARE = math.radians(2.0), 0.05, math.radians(1.0), 0.03
"""Largest error of an angle, and range of that of one at rest [rad], or shares of the range of the reference."""
_TURNS = 15.0
"""Reversals of the command a second, from more than half open to more than half open, of a loop that fails."""


@dataclass(frozen=True, slots=True)
class DrawnTask:
    """A task of a joint: its name, the scenario as a document, and the file of the set it names."""

    name: str
    document: dict[str, Any]

    @property
    def only_switches(self) -> bool:
        """True for a law that opens the valve fully or not at all."""
        return bool(self.document["controller"]["kind"].startswith("on_off"))


def _number(path: str, value: float, unit: str) -> str:
    return f'[{path}]\nvalue = {value:.6g}\nunit = "{unit}"\norigin = "datasheet"\nsource = "drawn"\n'


def draw_joint(draw: random.Random, kind: str, folder: Path, number: int) -> Path:
    """Write the parameter set of a drawn joint with a spool, a pair of on/off valves and regulators; its file."""

    def log(low: float, high: float) -> float:
        return float(low * (high / low) ** draw.random())

    first = float(draw.randrange(5, 60))
    last, gauge = first + draw.randrange(45, 110), draw.uniform(2.0, 8.0)
    growth = log(3.0, 40.0)
    numbers = [
        ("supply.pressure", gauge, "bar_g"),
        ("supply.atmospheric_pressure", 101325.0, "Pa_a"),
        ("supply.dorsiflexion_pressure", gauge * draw.choice((1.0, 1.0, 0.6)), "bar_g"),
        ("flow.linear_ratio", 0.999, ""),
        ("gas.temperature", draw.uniform(12.0, 30.0), "degC"),
        ("gas.heat_capacity_ratio", 1.4, ""),
        ("gas.molar_mass", 28.96, "g/mol"),
        ("actuator.angle_min", first, "deg"),
        ("actuator.angle_max", last, "deg"),
        ("actuator.restitution", 0.0, ""),
        ("actuator.leak.area", draw.choice((0.0, 0.0, 0.003)), "mm^2"),
        ("actuator.leak.discharge_coefficient", 0.6, ""),
    ]
    section = {"vane": "", "cylinder": '[actuator]\nkind = "cylinder"\n'}.get(
        kind, f'[actuator]\nkind = "table"\nfile = "joint{number}.csv"\n'
    )
    if kind == "vane":
        numbers.append(("actuator.torque_constant", growth, "cm^3"))
        dead = (growth * log(0.05, 1.2), growth * log(0.05, 1.2))
    elif kind == "cylinder":
        lever, bore = draw.uniform(30.0, 60.0), draw.uniform(10.0, 25.0)
        growth = math.pi / 4.0 * bore**2 * lever * 1e-3
        numbers += [
            ("actuator.bore", bore, "mm"),
            ("actuator.rod_diameter", 0.4 * bore, "mm"),
            ("actuator.lever_length", lever, "mm"),
            ("actuator.base_distance", draw.uniform(3.0, 4.5) * lever, "mm"),
            ("actuator.lever_offset", 90.0 - 0.5 * (first + last), "deg"),
        ]
        dead = (growth * log(0.03, 0.3), growth * log(0.03, 0.3))
    else:
        stiffness = draw.uniform(0.0, 0.3) if kind == "bladder" else 0.0
        numbers += [("actuator.passive_stiffness", stiffness, "N m/rad"), ("actuator.rest_angle", first, "deg")]
        dead = (growth * log(0.03, 0.3), growth * log(0.03, 0.3))
        (folder / f"joint{number}.csv").write_text(_table(kind, first, last, gauge, growth), encoding="utf-8")
    torque = 0.1 * growth * gauge
    inertia = log(0.0005, 0.01) * max(torque, 0.5)
    static = torque * log(0.005, 0.08)
    numbers += [
        ("actuator.dead_volume_1", dead[0], "cm^3"),
        ("actuator.dead_volume_2", dead[1], "cm^3"),
        ("friction.static_torque", static, "N m"),
        ("friction.dynamic_torque", static * draw.uniform(0.5, 0.9), "N m"),
        ("friction.viscous_damping", 0.05 * math.sqrt(inertia * torque), "N m s/rad"),
        ("foot_plate.inertia", inertia, "kg m^2"),
        ("foot_plate.gravity_torque", torque * draw.choice((0.0, 0.05)), "N m"),
    ]
    if draw.random() < 0.5:
        orifice = [("sonic_conductance", growth * log(0.01, 0.1), "L/(s bar)"), ("critical_ratio", 0.3, "")]
    else:
        orifice = [("area", growth * log(0.05, 0.5), "mm^2"), ("discharge_coefficient", 0.7, "")]
    numbers += [
        (f"valves.{name}.{item}", value, unit) for name in ("prop", "pair", "reg") for item, value, unit in orifice
    ]
    numbers.append(("valves.prop.delay", log(0.2, 6.0), "ms"))
    if draw.random() < 0.4:
        numbers.append(("valves.prop.dead_band", draw.uniform(0.02, 0.1), ""))
    numbers += [
        ("valves.pair.opening_delay", log(2.0, 20.0), "ms"),
        ("valves.pair.closing_delay", log(2.0, 20.0), "ms"),
        ("valves.pair.switching_interval", log(4.0, 50.0), "ms"),
    ]
    numbers += _of_regulators(random.Random(f"regulators of {number} {gauge}"), gauge)
    if kind == "bladder":
        # Its one chamber refuses the numbers of a second one.
        numbers = [item for item in numbers if item[0] not in OF_SECOND_CHAMBER]
    head = (
        f'schema_version = 1\nname = "joint{number}"\ntitle = "Drawn joint {number}: {kind}"\ndefault_valve = "prop"\n'
        f'[valves.prop]\nkind = "proportional"\n[valves.pair]\nkind = "solenoid"\n'
        f'[valves.reg]\nkind = "pressure_regulator"\n{section}'
        '[gas.species]\nvalue = "air"\norigin = "datasheet"\nsource = "drawn"\n'
    )
    file = folder / f"joint{number}.toml"
    file.write_text(head + "".join(_number(*item) for item in numbers), encoding="utf-8")
    return file


def _of_regulators(draw: random.Random, gauge: float) -> list[tuple[str, float, str]]:
    """Range, times and flaws of drawn regulators below a supply [bar gauge]."""
    numbers = [
        ("lowest_pressure", draw.choice((0.0, 0.05)), "bar_g"),
        ("highest_pressure", gauge * draw.uniform(0.6, 1.3), "bar_g"),
        ("response_time", 5.0 * 60.0 ** draw.random(), "ms"),
        ("delay", draw.choice((0.0, draw.uniform(0.5, 10.0))), "ms"),
        ("band", 0.003 * 20.0 ** draw.random(), ""),
        ("hysteresis", draw.uniform(0.0, 0.01), ""),
        ("resolution", draw.uniform(0.0, 0.004), ""),
    ]
    return [(f"valves.reg.{name}", value, unit) for name, value, unit in numbers]


def _table(kind: str, first: float, last: float, gauge: float, growth: float) -> str:
    """Table of volumes [mL] of a bladder, or of two braided muscles against each other, that grow so [mL/rad]."""
    angles, pressures = np.linspace(first, last, 8), np.linspace(0.0, 100.0 * gauge, 3)
    travel = math.radians(last - first)
    lines = ["angle [deg],pressure [kPa_g],volume_1 [mL]" + (",volume_2 [mL]" if kind == "muscles" else "")]
    for angle in angles:
        share = math.radians(angle - first) / travel
        for pressure in pressures:
            if kind == "bladder":
                volume = growth * travel * (0.2 + share - 0.15 * share**2) * (1.0 + 2.0e-4 * pressure)
                lines.append(f"{angle:.3f},{pressure:.3f},{volume:.5f}")
                continue
            # A muscle gives less the more it has shortened: its volume is a parabola over the angle.
            shortened = (share, 1.0 - share)
            volumes = [growth * travel * (0.8 + 1.4 * each - 0.5 * each**2) for each in shortened]
            lines.append(f"{angle:.3f},{pressure:.3f},{volumes[0]:.5f},{volumes[1]:.5f}")
    return "\n".join(lines) + "\n"


def draw_tasks(draw: random.Random, file: Path, main: str) -> Iterator[DrawnTask]:
    """Give the tasks of a joint with its valve ``main``; references lie within reach unless the name denies it."""
    probe = _document(file, main, _middle(file), {"kind": "pid"}, {"kind": "constant", "level": "0 N m"}, 1.0, 1000)
    device = scenario_from_dict(probe).device
    low, high = float(device.actuator.angle_min), float(device.actuator.angle_max)
    middle = 0.5 * (low + high)
    rate = draw.choice((500, 1000, 2000))

    def locked(angle: float) -> dict[str, Any]:
        return {"kind": "locked", "angle": f"{angle:.6f} rad"}

    def task(
        name: str,
        motion: dict[str, Any],
        law: dict[str, Any],
        reference: dict[str, Any],
        valve: str = main,
        small: Sequence[str] = (),
    ) -> DrawnTask:
        duration = 4.0 if name.startswith("angle") else 2.5
        document = _document(file, valve, motion, law, reference, duration, rate)
        document["device"]["overrides"] = list(small)
        if name.endswith("noise"):
            document["sensors"] = {"angle_noise": "0.05 deg", "pressure_noise": "0.5 kPa_d", "seed": 1}
        return DrawnTask(name, document)

    def hold(level: float) -> dict[str, Any]:
        return {"kind": "ramp_hold", "level": f"{level:.6g} N m", "ramp_time": "0.3 s"}

    at_rest, reach = torque_reach(device, middle)
    base, travel = max(at_rest, 0.0), reach - max(at_rest, 0.0)
    pid, level = {"kind": "pid"}, base + travel * draw.uniform(0.3, 0.7)
    yield task("torque", locked(middle), pid, hold(level))
    stop = low + 0.03 * (high - low)
    yield task("torque near a stop", locked(stop), pid, hold(torque_reach(device, stop)[1] * draw.uniform(0.3, 0.7)))
    yield task("torque beyond reach", locked(middle), pid, hold(reach * draw.uniform(1.1, 2.5)))
    sine = {"kind": "sine", "level": f"{level:.6g} N m", "amplitude": f"{0.2 * travel:.6g} N m"}
    yield task("torque sine", locked(middle), pid, {**sine, "frequency": f"{draw.uniform(0.3, 6.0):.3g} Hz"})
    ramp = {"kind": "ramp_hold", "level": f"{level:.6g} N m", "ramp_time": "5 s"}
    yield task("torque ramp", locked(middle), pid, ramp)
    yield task("solenoid pair", locked(middle), {"kind": "on_off"}, hold(level), "pair")
    yield task("dead zone", locked(middle), {"kind": "on_off_dead_zone"}, hold(level))
    gain = {"kind": "pid", "proportional_gain": f"{draw.choice((0.003, 0.3, 30.0)):.3g} 1/(N m)"}
    yield task("gains of another", locked(middle), gain, hold(level))
    yield from _pulses(draw, partial(task, motion=locked(middle)), device, (base, level, travel), sine)
    gauge = float(device.highest_pressures[0]) - float(device.supply.atmospheric_pressure)
    for name, share in (("pressure", draw.uniform(0.3, 0.8)), ("pressure above supply", 1.3)):
        pressure = {"of": "pressure_1", "kind": "ramp_hold", "ramp_time": "0.3 s", "start_level": "0 Pa_g"}
        yield task(name, locked(middle), pid, {**pressure, "level": f"{share * gauge:.6g} Pa_g"})
    start, end = low + 0.3 * (high - low), low + draw.uniform(0.5, 0.7) * (high - low)
    # A bladder pushes one way only: something has to pull it back.
    back = 0.2 * torque_reach(device, end)[1] if abs(torque_reach(device, end)[0]) < 0.05 * reach else 0.0
    free = {"kind": "free", "angle": f"{start:.6f} rad", "external_torque": f"{back:.6g} N m"}
    angle = {"of": "angle", "kind": "ramp_hold", "start_level": free["angle"], "level": f"{end:.6f} rad"}
    cascade, slow = {"kind": "cascade"}, {**angle, "ramp_time": "0.5 s"}
    yield task("angle", free, cascade, slow)
    there = torque_reach(device, end)[1]
    for name, share in (("angle, load", draw.uniform(0.3, 0.6)), ("angle, load beyond reach", 1.2)):
        yield task(name, {**free, "external_torque": f"{share * there:.6g} N m"}, cascade, slow)
    friction = float(device.friction.static_torque)
    for share in (0.5, 2.0):
        believed = {**cascade, "static_torque": f"{share * friction:.6g} N m"}
        yield task(f"angle, friction x {share:g}", free, believed, slow)
    yield task("angle, noise", free, cascade, slow)
    there_and_back = _table_of((0.5, end), (1.5, end), (2.0, start), first=start, unit="rad")
    there_and_back = {"of": "angle", "level": "0 rad", **there_and_back}
    yield task("angle, there and back", free, cascade, there_and_back)
    stuck = {**cascade, "static_torque": "0 N m", "friction_torque": "0 N m"}
    yield task("angle, stuck", free, stuck, there_and_back, small=[f"friction.static_torque={2.0 * there:.6g} N m"])
    if back:
        yield task("angle, nothing pulls back", {**free, "external_torque": "0 N m"}, cascade, slow)
    swing = {"of": "angle", "kind": "sine", "level": f"{middle:.6f} rad", "amplitude": f"{0.15 * (high - low):.6f} rad"}
    yield task(
        "angle sine",
        {**free, "angle": f"{middle:.6f} rad"},
        cascade,
        {**swing, "frequency": f"{draw.uniform(0.2, 1.5):.3g} Hz"},
    )


def _pulses(
    draw: random.Random,
    task: Callable[..., DrawnTask],
    device: Any,
    torques: tuple[float, float, float],
    sine: Mapping[str, Any],
) -> Iterator[DrawnTask]:
    """Give tasks with pulses, tables and ripples, from torque at rest, level and travel of the torque [N m]."""
    (base, level, travel), pid = torques, {"kind": "pid"}
    # Up, held, and down again, as in push-off; and what never rests.
    for name, top, low_end in (
        ("pulse", level, base),
        ("trapezoid", level, base + 0.2 * (level - base)),
        ("pulse beyond", base + 1.5 * travel, base),
    ):
        knots = [(0.3, top), (0.3 + draw.uniform(0.3, 0.8), top), (1.4, low_end)]
        yield task(f"torque {name}", law=pid, reference=_table_of(*knots, first=base))
    small = _smaller_valve(device, 1.0e-3)
    yield task(
        "torque pulse, tiny valve",
        law=pid,
        reference=_table_of((0.3, level), (0.7, level), (1.0, base), first=base),
        small=small,
    )
    knots = [(0.4 * number, base + travel * draw.uniform(0.1, 0.7)) for number in range(1, 6)]
    yield task("torque table", law=pid, reference=_table_of(*knots, first=base))
    ripple = {**sine, "amplitude": f"{draw.choice((0.001, 0.02, 0.05)) * travel:.6g} N m", "frequency": "2 Hz"}
    yield task("torque ripple", law=pid, reference=ripple)
    if device.valve.kind != "proportional":
        return
    weak = {"kind": "pid", "proportional_gain": f"{1.0 / travel:.4g} 1/(N m)", "integral_gain": "0 1/(N m s)"}
    yield task("torque ripple, dead band", law=weak, reference=ripple, small=["valve.dead_band=0.3"])


def _table_of(*knots: tuple[float, float], first: float = 0.0, unit: str = "N m") -> dict[str, Any]:
    """Reference that goes once from knot to knot, times [s] and values, and stays at the last one."""
    found = {"kind": "tabulated", "period": "100 s", "value_01": f"{first:.6g} {unit}"}
    for number, (time, value) in enumerate((*knots, (99.0, knots[-1][1])), 2):
        found |= {f"time_{number:02}": f"{time:.4g} s", f"value_{number:02}": f"{value:.6g} {unit}"}
    return found


def _smaller_valve(device: Any, share: float) -> list[str]:
    """Overrides that reduce the orifice of a valve to a share [-]."""
    orifice = device.valve.orifice
    if hasattr(orifice, "sonic_conductance"):
        return [f"valve.sonic_conductance={share * orifice.sonic_conductance!r} m^3/(s Pa)"]
    return [f"valve.area={share * orifice.area!r} m^2"]


def _middle(file: Path) -> dict[str, Any]:
    ends = [
        float(re.search(rf"\[actuator.angle_{end}\]\nvalue = (\S+)", file.read_text(encoding="utf-8"))[1])  # type: ignore[index]
        for end in ("min", "max")
    ]
    return {"kind": "locked", "angle": f"{0.5 * sum(ends):.6g} deg"}


def _document(
    file: Path,
    valve: str,
    motion: Mapping[str, Any],
    law: Mapping[str, Any],
    reference: Mapping[str, Any],
    duration: float,
    rate: int,
) -> dict[str, Any]:
    return {
        "schema_version": 1,
        "name": "drawn",
        "device": {"set": str(file), "valve": valve},
        "run": {"duration": f"{duration} s", "output_interval": "2 ms"},
        "motion": dict(motion),
        "controller": {**law, "rate": f"{rate} Hz"},
        "reference": dict(reference),
    }


def judge_table(result: Result) -> str:
    """Judge a run whose reference goes from knot to knot: each rest of 0.2 s or more by its last third, all by RMS."""
    recording, of = result.recording, result.scenario.controlled
    reference = recording["reference" if of == "torque" else f"reference_{of}"]
    start = 0.0 if of == "torque" else float(recording[of][0])
    change = float(np.max(np.abs(reference - start)))
    error = (recording[of] - reference) / change
    moves = np.flatnonzero(np.abs(np.diff(reference)) > 1.0e-9 * change)
    ends = [-1, *moves.tolist(), reference.size - 1]
    measures = [float(np.sqrt(np.mean(error**2))) / 0.2]
    for first, last in pairwise(ends):
        if last - first > 100:
            part = error[first + 1 + 2 * (last - first) // 3 : last]
            measures.append(max(float(np.mean(np.abs(part))) / _MEAN, 0.5 * float(np.ptp(part)) / _HALF_RANGE))
    measure = max(measures)
    return GOOD if measure < 1.0 / _BAND else FAILS if measure > _BAND else BETWEEN


def judge(result: Result, only_switches: bool) -> str:
    """Judge a run by its last third, an angle's swing by half of the hold: good, failing, or between."""
    if result.scenario.reference.kind == "tabulated":
        return judge_table(result)
    recording, of = result.recording, result.scenario.controlled
    reference = recording["reference" if of == "torque" else f"reference_{of}"]
    value = recording[of]
    start = 0.0 if of == "torque" else float(value[0])
    change = float(np.max(np.abs(reference - start)))
    last = slice(2 * value.size // 3, None)
    error = (value - reference)[last] / change
    if np.ptp(reference[last]) > 0.02 * change:
        measure = float(np.sqrt(np.mean(error**2))) / (0.2 if not only_switches else _MOVING)
    else:
        mean, half = float(np.mean(np.abs(error))), 0.5 * float(np.ptp(error))
        if only_switches:
            # It swings by design: its mean counts, and its half range.
            measure = max(abs(float(np.mean(error))) / _MEAN_OF_PAIR, half / _HALF_RANGE_OF_PAIR)
        else:
            measure = max(mean / _MEAN, half / _HALF_RANGE)
    if of == "angle":
        way = max(change, float(np.ptp(reference)))
        farthest = change * float(np.max(np.abs(error))) / max(_FARTHEST, _FARTHEST_SHARE * way)
        # Noise kicks a joint now and then, so that its range grows with the time that is looked at: as long as a
        # verdict says, the second half of the hold.
        hold = int(np.flatnonzero(np.abs(np.append(np.inf, reference - reference[-1])) > 1.0e-9 * change)[-1])
        swing = float(np.ptp((value - reference)[(hold + value.size) // 2 :])) / max(_SWING, _SWING_SHARE * way)
        # A joint that is thrown off by more than it should move fails, however it ends; a wave has a start-up.
        waves = result.scenario.reference.kind == "sine"
        thrown_off = 0.0 if waves else float(np.max(np.abs(value - reference))) / way
        is_moving = np.ptp(reference[last]) > 0.02 * change
        measure = max(measure, farthest, thrown_off, 0.0 if is_moving else swing)
    command = recording["command"][last]
    open_ways = np.sign(command[np.abs(command) > 0.5])
    turns = np.count_nonzero(np.diff(open_ways)) / float(np.ptp(recording.time[last][[0, -1]]))
    # A valve that is opened one way and the other all the time is worn out, however small the error is.
    measure = measure if only_switches else max(measure, turns / _TURNS)
    return GOOD if measure < 1.0 / _BAND else FAILS if measure > _BAND else BETWEEN


def printed_remedy(sentence: str) -> list[str]:
    """Overrides of the remedy that a sentence prints as tried; none where it prints none."""
    found = re.search(r"with overrides=(.*) it follows, as a further run shows", sentence)
    return [] if found is None else list(ast.literal_eval(found[1]))


def run_joints(
    seed: int, joints: int, log: Path, kinds: Sequence[str] = KINDS, valve: str = "prop"
) -> list[dict[str, Any]]:
    """Run every task of the joints of some kinds that a log (a JSON object a line for each run) has not; all records.

    Each joint is drawn by itself, so that a count that was stopped goes on where it ended.
    """
    done = _records(log)
    known = {record["joint"] for record in done if record["seed"] == seed}
    with tempfile.TemporaryDirectory() as folder, log.open("a", encoding="utf-8") as lines:
        for number in sorted(set(range(joints)) - known):
            draw, kind = random.Random(f"{seed}, joint {number}"), KINDS[number % len(KINDS)]
            if kind not in kinds:
                continue
            file = draw_joint(draw, kind, Path(folder), number)
            records = [
                {"seed": seed, "joint": number, "kind": kind, "task": task.name, **_outcome(task)}
                for task in draw_tasks(draw, file, valve)
            ]
            # A joint is written whole or not at all.
            lines.write("".join(f"{json.dumps(record)}\n" for record in records))
            lines.flush()
            done += records
            print(f"joint {number + 1} of {joints}", file=sys.stderr, flush=True)
    return [record for record in done if record["seed"] == seed and record["joint"] < joints]


def _records(log: Path) -> list[dict[str, Any]]:
    if not log.exists():
        return []
    return [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]


def _outcome(task: DrawnTask) -> dict[str, Any]:
    try:
        scenario = scenario_from_dict(task.document)
    except PpafoError as refusal:
        return {"judged": "refused", "sentence": str(refusal)}
    result = simulate(scenario)
    if not result.status.is_completed:
        return {"judged": "diverged", "sentence": result.status.message}
    verdict = verdict_of(result)
    found: dict[str, Any] = {"judged": judge(result, task.only_switches), **_angle_errors(result)}
    if not verdict.fails:
        return found
    remedy = printed_remedy(verdict.sentence)
    found |= {"said": True, "sentence": verdict.sentence, "printed": bool(remedy)}
    return found | {"works": _mended(task, remedy)} if remedy else found


def _angle_errors(result: Result) -> dict[str, float]:
    """Largest error [deg] of the second half of the hold of an angle, its range [deg], and the way [deg]."""
    if result.scenario.controlled != "angle":
        return {}
    reference, angle = result.recording["reference_angle"], result.recording["angle"]
    error = np.degrees(angle - reference)[reference.size // 2 :]
    way = math.degrees(float(np.ptp(reference)))
    return {"error": float(np.max(np.abs(error))), "swing": float(np.ptp(error)), "way": way}


def _mended(task: DrawnTask, overrides: list[str]) -> bool:
    """True where the printed values, given as overrides, make a run that is not failing."""
    try:
        again = simulate(scenario_from_dict(task.document, overrides))
    except PpafoError:
        return False
    return again.status.is_completed and judge(again, task.only_switches) != FAILS


def counts_of(records: Iterable[Mapping[str, Any]]) -> dict[tuple[str, str], Counter[str]]:
    """Counts of records by kind and task."""
    counts: dict[tuple[str, str], Counter[str]] = {}
    for record in records:
        row = counts.setdefault((record["kind"], record["task"]), Counter())
        judged = record["judged"]
        row.update([judged, f"{judged} {'said' if record.get('said') else 'silent'}"])
        row.update([key for key in ("printed", "works") if record.get(key)])
    return counts


def table_text(counts: Mapping[tuple[str, str], Counter[str]]) -> str:
    """Table of the counts, a line for each kind and task, and the sums."""
    titles = ("good", "alarms", "fails", "said", "silent", "between", "refused", "diverged", "remedies", "work")
    keys = ("good", "good said", "fails", "fails said", "fails silent", *titles[5:8], "printed", "works")
    total: Counter[str] = Counter()
    lines = [f"{'kind':10}{'task':27}" + "".join(f"{title:>9}" for title in titles)]
    for (kind, task), row in sorted(counts.items()):
        lines.append(f"{kind:10}{task:27}" + "".join(f"{row[key]:9}" for key in keys))
        total += row
    return "\n".join([*lines, f"{'all':37}" + "".join(f"{total[key]:9}" for key in keys)])


def angle_text(records: Iterable[Mapping[str, Any]]) -> str:
    """Table of the angle loops by default gains: errors of the second half of a run, and swings.

    Within: at most 2 deg or 5 % of the way. Swinging: a range above 1 deg and 3 % of the way, of a reference at rest.
    """
    tasks: dict[str, list[Mapping[str, Any]]] = {}
    for record in records:
        if "error" in record and not {"beyond", "nothing"}.intersection(record["task"].split()):
            tasks.setdefault(record["task"], []).append(record)
    lines = [f"{'angle loops':27}{'runs':>7}{'within':>8}{'swing':>7}{'neither':>9}{'unsaid':>8}   median, worst deg"]
    for task, runs in tasks.items():
        is_within = [run["error"] <= max(2.0, 0.05 * run["way"]) for run in runs]
        swings = ["sine" not in task and run["swing"] > max(1.0, 0.03 * run["way"]) for run in runs]
        good = [near and not swinging for near, swinging in zip(is_within, swings, strict=True)]
        unsaid = sum(not fine and not run.get("said") for fine, run in zip(good, runs, strict=True))
        errors = [run["error"] for run in runs]
        lines.append(
            f"{task:27}{len(runs):7}{sum(is_within):8}{sum(swings):7}{sum(good):9}{unsaid:8}   "
            f"{np.median(errors):.2f}, {max(errors):.2f}"
        )
    return "\n".join(lines)
