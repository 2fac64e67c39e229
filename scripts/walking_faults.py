"""Which faults of sensors are found, which do no harm, and which are neither: ``python scripts/walking_faults.py``.

Every kind of fault begins at 20 instants of a stride, with four configurations. A run is good where the controller
pauses or stops and no harm is done from half a second later on, or where no harm is done at all. Harm is: toes lower in
mid-swing than without the device, or more than 1 N m against the foot's way (plantarflexion on a loaded heel or in
mid-swing, dorsiflexion on the toes). It prints the table of docs/walking-faults.md.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.constants import PASCALS_PER_PSI, STANDARD_ATMOSPHERE
from ppafo.engine.lanes import Batch, run_batch
from ppafo.engine.rows import leaf_paths, numbers
from ppafo.engine.run import Run, batch_of
from ppafo.loading import reloaded
from ppafo.model import contact as ground
from ppafo.model.plant import chamber_pressures
from ppafo.model.sensors import Fault, GaitSensors
from ppafo.simulation.sampled import state_row_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.walking.events import SAFE_ROW
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import walk_of, with_duration
from ppafo.walking.planning import gait_sensors_of, plan_walk
from ppafo.walking.walk import with_device_off

CONFIGURATIONS = ("solenoid", "proportional", "solenoid-regulators", "proportional-regulators")
PHASES = 20
FIRST, AFTER = 3.0, 6.0
"""Strides before the first fault, and strides that are watched after the latest."""

LANES, RECORD_EVERY = 32, 4
TORQUE, CLEARANCE, SETTLED = 1.0, 0.002, 0.5
"""Torque against the foot's way [N m], room for the toes [m], time [s] in which chambers vent once a fault is found."""

LATER = 0.05
"""Strides by which two that find a fault may differ without a line."""

NEAR = 1.5 * RECORD_EVERY * 1.0e-3
"""Time [s] by which two that find it at about the same sample differ at most in the record."""

PERIOD = 1.0e-3
LATEST = 200.0
"""The longest delay of a sensor, in samples."""

DEGREE, PSI = np.pi / 180.0, PASCALS_PER_PSI
Floats = NDArray[np.float64]
Kind = dict[str, Fault]


def stuck(reading: float, period: float = 0.0) -> Fault:
    """A sensor that shows one reading, in the first half of each period [s] where one is given."""
    return Fault(0.0, 0.0, reading, period=period)


def frozen(period: float = 0.0) -> Fault:
    """A sensor that shows its last reading."""
    return Fault(0.0, 1.0, 0.0, period=period)


def wrong(lag: float = 0.0, **values: float) -> Fault:
    """A distorted sensor: a lag [s], and other fields of ``Fault``; a delay is in samples of 1 ms."""
    return Fault(0.0, 0.0, 0.0, distorts=1.0, memory=np.exp(-PERIOD / lag) if lag else 0.0, **values)


def late(samples: float) -> Fault:
    """A sensor that is late by whole samples of 1 ms."""
    return wrong(late_samples=samples)


def force_kinds(sensor: str) -> Iterator[tuple[str, Kind]]:
    """Faults of a force sensor, by what fails."""
    faults = {
        "dead": stuck(0.0), "dead, shows 20 N": stuck(20.0), "frozen": frozen(), "stuck at 900 N": stuck(900.0),
        "stuck at 5 kN": stuck(5.0e3), "offset 50 N": wrong(offset=50.0), "offset 150 N": wrong(offset=150.0),
        "offset -50 N": wrong(offset=-50.0), "offset -150 N": wrong(offset=-150.0), "gain 0.1": wrong(gain=0.1),
        "gain 0.4": wrong(gain=0.4), "gain 3": wrong(gain=3.0), "drift 50 N/s": wrong(drift=50.0),
        "drift -50 N/s": wrong(drift=-50.0), "lag 50 ms": wrong(lag=0.05), "lag 106 ms (1.5 Hz)": wrong(lag=0.106),
        "lag 300 ms": wrong(lag=0.3), "50 ms late": late(50.0), "100 ms late": late(100.0),
        "200 ms late": late(200.0), "half of the samples lost": wrong(lost_fraction=0.5),
        "99 % of the samples lost": wrong(lost_fraction=0.99), "crosstalk 0.3": wrong(crosstalk=0.3),
        "dead and back every 0.3 s": stuck(0.0, 0.3), "frozen and back every 0.7 s": frozen(0.7),
    }  # fmt: skip
    return ((f"{sensor}: {what}", {sensor: fault}) for what, fault in faults.items())


def angle_kinds() -> Iterator[tuple[str, Kind]]:
    """Faults of the angle sensor, by what fails."""
    faults = {
        "stuck at 0 deg": stuck(0.0), "stuck at 90 deg": stuck(90.0 * DEGREE), "frozen": frozen(),
        "stuck at 170 deg": stuck(170.0 * DEGREE), "offset 10 deg": wrong(offset=10.0 * DEGREE),
        "offset -10 deg": wrong(offset=-10.0 * DEGREE),
        "offset 25 deg": wrong(offset=25.0 * DEGREE), "offset -25 deg": wrong(offset=-25.0 * DEGREE),
        "gain 0.7": wrong(gain=0.7), "gain 1.3": wrong(gain=1.3), "drift 5 deg/s": wrong(drift=5.0 * DEGREE),
        "drift -5 deg/s": wrong(drift=-5.0 * DEGREE), "lag 100 ms": wrong(lag=0.1),
        "20 ms late": late(20.0), "100 ms late": late(100.0), "200 ms late": late(200.0),
        "99 % of the samples lost": wrong(lost_fraction=0.99), "frozen and back every 0.3 s": frozen(0.3),
    }  # fmt: skip
    return ((f"angle: {what}", {"angle": fault}) for what, fault in faults.items())


def pressure_kinds(sensor: str) -> Iterator[tuple[str, Kind]]:
    """Faults of a pressure sensor, by what fails."""
    gauge = {f"stuck at {value} psi": stuck(STANDARD_ATMOSPHERE + value * PSI) for value in (0, 15, 50, 300)}
    faults = gauge | {
        "dead": stuck(0.0), "frozen": frozen(), "offset 5 psi": wrong(offset=5.0 * PSI),
        "offset -5 psi": wrong(offset=-5.0 * PSI), "offset 20 psi": wrong(offset=20.0 * PSI),
        "gain 0.5": wrong(gain=0.5), "gain 1.5": wrong(gain=1.5), "drift 2 psi/s": wrong(drift=2.0 * PSI),
        "drift -2 psi/s": wrong(drift=-2.0 * PSI),
        "lag 100 ms": wrong(lag=0.1), "20 ms late": late(20.0), "50 ms late": late(50.0),
        "100 ms late": late(100.0), "99 % of the samples lost": wrong(lost_fraction=0.99),
        "crosstalk 0.3": wrong(crosstalk=0.3), "frozen and back every 0.3 s": frozen(0.3),
    }  # fmt: skip
    return ((f"{sensor.replace('_', ' ')}: {what}", {sensor: fault}) for what, fault in faults.items())


def pairs() -> dict[str, Kind]:
    """Two sensors at once."""
    swap, slow = wrong(crosstalk=1.0), wrong(lag=0.106)
    return {
        "heel and toe 50 ms late": {"heel": late(50.0), "toe": late(50.0)},
        "heel and toe 200 ms late": {"heel": late(200.0), "toe": late(200.0)},
        "heel and toe 100 ms late": {"heel": late(100.0), "toe": late(100.0)},
        "pressures 50 ms late": {"pressure_1": late(50.0), "pressure_2": late(50.0)},
        "heel and toe swapped": {"heel": swap, "toe": swap},
        "heel and toe with 1.5 Hz": {"heel": slow, "toe": slow},
        "heel and toe dead": {"heel": stuck(0.0), "toe": stuck(0.0)},
        "heel and toe frozen": {"heel": frozen(), "toe": frozen()},
        "heel and toe, gain 0.4": {"heel": wrong(gain=0.4), "toe": wrong(gain=0.4)},
        "heel and toe, 99 % lost": {"heel": wrong(lost_fraction=0.99), "toe": wrong(lost_fraction=0.99)},
        "pressures swapped": {"pressure_1": swap, "pressure_2": swap},
        "pressures frozen": {"pressure_1": frozen(), "pressure_2": frozen()},
        "heel dead, angle frozen": {"heel": stuck(0.0), "angle": frozen()},
        "toe dead, pressure 2 frozen": {"toe": stuck(0.0), "pressure_2": frozen()},
    }


def kinds() -> dict[str, Kind]:
    """Every kind of fault, by what fails."""
    singles = (*force_kinds("heel"), *force_kinds("toe"), *angle_kinds())
    return dict((*singles, *pressure_kinds("pressure_1"), *pressure_kinds("pressure_2"))) | pairs()


@dataclass(frozen=True)
class Runs:
    """Of each run (kinds, PHASES): strides until found (inf if never), and harm of all and once settled after it.

    Harm is torque against the foot's way [N m] and lowest toes against the healthy gait [m].
    """

    found: Floats
    torque: Floats
    toes: Floats
    late_torque: Floats
    late_toes: Floats


def failing(sensors: GaitSensors, faults: Kind) -> GaitSensors:
    """Sensors with these faults."""
    changed: dict[str, Any] = {f"{sensor}_fault": fault for sensor, fault in faults.items()}
    return sensors._replace(**changed)


def run(configuration: Scenario, faults: list[Kind], begins: Floats) -> Runs:
    """Run a configuration with every fault from every instant [s]; ``faults`` may be one that is empty."""
    stride = walk_of(configuration).gait.stride_time
    sound = gait_sensors_of(configuration)
    sensors = [
        failing(sound, {sensor: fault._replace(time=float(time)) for sensor, fault in kind.items()})
        for kind in faults
        for time in begins
    ]
    delay = LATEST * configuration.control.period
    late_heel = ["faults.heel.kind=distorted", "faults.heel.time=1e6 s", f"faults.heel.delay={delay!r} s"]
    plan = plan_walk(with_duration(reloaded(configuration, late_heel), (FIRST + 1.0 + AFTER) * stride))
    single = batch_of(plan)
    paths = [path for group, row in single.program.parameter_rows().items() for path in leaf_paths(row, group)]
    places = [paths.index(path) for path in leaf_paths(GaitSensors, "gait_sensors")]
    parameters = np.repeat(single.parameters, len(sensors), axis=1)
    parameters[places] = np.array([numbers(one) for one in sensors]).T
    states = np.repeat(single.states, len(sensors), axis=1)
    clock, rows = replace(single.clock, record_every=RECORD_EVERY), state_row_numbers(plan)
    start, found = np.tile(begins, len(faults)), []
    for at in range(0, len(sensors), LANES):
        part = slice(at, at + LANES)
        record = run_batch(Batch(single.program, clock, parameters[:, part], states[:, part])).record
        found.append(judged(plan, record, rows, start[part], stride))
    shape = (len(faults), begins.size)
    return Runs(*(np.concatenate(column).reshape(shape) for column in zip(*found, strict=True)))


def judged(plan: Run, record: Floats, rows: dict[str, int], begins: Floats, stride: float) -> list[Floats]:
    """Numbers of each run of a block: those of ``Runs``."""
    of = {path: record[:, row] for path, row in rows.items()}
    time = (np.arange(record.shape[0]) * plan.step * RECORD_EVERY)[:, None]
    pressures = chamber_pressures(plan.plant, of["state.angle"], of["state.mass_1"], of["state.mass_2"])
    torque = plan.plant.torque_constant * np.subtract(*pressures)
    assert plan.walk is not None, "a walk has a leg"
    timing, contact, phase = plan.walk.timing, of["walk.contact"], of["walk.now.phase"]
    swing = (phase >= timing.clearance_from) & (phase <= timing.clearance_to)
    heel = (contact == ground.HEEL) | (contact == ground.FLAT)
    against = np.where(heel | swing, torque, np.where(contact == ground.TOE, -torque, 0.0))
    height = plan.walk.leg.toe_lever * (of["walk.foot.sine"] - of["walk.now.sine_healthy_foot"])
    vented = (of[SAFE_ROW] > 0.0) & (time >= begins) if SAFE_ROW in of else np.zeros(torque.shape, bool)
    found = np.where(vented.any(axis=0), time[np.argmax(vented, axis=0), 0], np.inf)
    harm = []
    for since in (begins, found + SETTLED):
        after = time >= since
        harm += [np.where(after, against, -9.0).max(axis=0), np.where(after & swing, height, 9.0).min(axis=0)]
    return [(found - begins) / stride, *harm]


def verdicts(kind_names: list[str], runs: dict[str, Runs], lowest: dict[str, float]) -> list[tuple[str, str, str, str]]:
    """Each kind: what it is, verdict, longest time until found, and worst harm of the runs that are not good."""
    table = []
    for row, what in enumerate(kind_names):
        found = np.concatenate([one.found[row] for one in runs.values()])
        floor = np.concatenate([np.full(PHASES, lowest[name] - CLEARANCE) for name in runs])
        torque, toes, late_torque, late_toes = (
            np.concatenate([getattr(one, name)[row] for one in runs.values()])
            for name in ("torque", "toes", "late_torque", "late_toes")
        )
        harmless = (torque <= TORQUE) & (toes >= floor)
        seen = np.isfinite(found)
        settled = seen & (late_torque <= TORQUE) & (late_toes >= floor)
        good = harmless | settled
        late = f"{found[seen].max():.2f}" if seen.any() else "-"
        word = "found" if settled.all() else ("harmless" if harmless.all() else "found or harmless")
        word = word if good.all() else f"neither in {(~good).sum()} of {good.size} runs"
        worst = ~good if not good.all() else ~settled
        harm = f"{torque[worst].max():.1f} N m, {100.0 * toes[worst].min():.1f} cm" if worst.any() else "-"
        table.append((what, word, late, harm))
    return table


def toes_of_bare(configuration: Scenario) -> float:
    """Lowest toes in mid-swing against the healthy ones [m], with the device off."""
    stride = walk_of(configuration).gait.stride_time
    bare = plan_walk(with_duration(with_device_off(configuration), (FIRST + 1.0 + AFTER) * stride))
    batch = batch_of(bare)
    record = run_batch(replace(batch, clock=replace(batch.clock, record_every=RECORD_EVERY))).record
    return float(judged(bare, record, state_row_numbers(bare), np.array([FIRST * stride]), stride)[2][0])


def main() -> None:
    """Run all and print the table."""
    stride = walk_of(load_walk("solenoid")).gait.stride_time
    begins = (FIRST + np.arange(PHASES) / PHASES) * stride
    every = kinds()
    runs, lowest = {}, {}
    for name in CONFIGURATIONS:
        lowest[name] = toes_of_bare(load_walk(name))
        sound = run(load_walk(name), [{}], begins[:1])
        toes = f"toes {100.0 * sound.toes.min():.1f} cm against the healthy ones"
        bare_toes = f"without the device {100.0 * lowest[name]:.1f} cm"
        words = f"{name}: good sensors {sound.torque.max():.2f} N m against the foot's way, {toes}, {bare_toes}"
        print(words, file=sys.stderr)
        runs[name] = run(load_walk(name), list(every.values()), begins)
    table = verdicts(list(every), runs, lowest)
    head = ("What fails", "Verdict", "Found within (strides)", "Worst of the others")
    print(f"| {' | '.join(head)} |\n|{'---|' * len(head)}")
    print("\n".join(f"| {' | '.join(cells)} |" for cells in table))
    bad = sum(cells[1].startswith("neither") for cells in table)
    counts = [f"{len(table)} kinds", f"{sum(cells[1] == 'found' for cells in table)} found"]
    counts += [f"{sum('harmless' in cells[1] for cells in table)} harmless, or found where not", f"{bad} neither"]
    print("\n" + ", ".join(counts))


if __name__ == "__main__":
    main()
