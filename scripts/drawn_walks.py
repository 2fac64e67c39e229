"""Walks by chance: task sequences, speeds, wearers and devices are drawn, and what must hold of all of them is counted.

    python scripts/drawn_walks.py --task-sequences 1000 --seed 32
    python scripts/drawn_walks.py --faults 60 --seed 32
    python scripts/drawn_walks.py --residuals 12 --seed 32

The first prints for each valve how many walks without a fault stop, pause to their end, press against the wearer, or
have no help back after two strides of steady walking.
The second draws faults of the plant with a shut-off valve fitted, and prints how soon each is found, by which flag, and
what is left on the wearer half a second later. The third prints how far a regulator that creeps shows in the residuals
of the observer, beside walks without a fault. The controller believes in the nominal device, whatever device is drawn.
All of it is simulated.
"""

import argparse
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from ppafo.control.walking import observer
from ppafo.control.walking.nominal_device import NominalDevice, volumes
from ppafo.engine.rows import leaf_paths, rebuilt
from ppafo.errors import ScenarioError
from ppafo.model import contact as ground
from ppafo.model.fault_catalogue import PLANT_FAULTS
from ppafo.model.helping import HELPS, PAUSED, STOPPED
from ppafo.parameters.device import Orifice
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import walk

VALVES = ("solenoid", "proportional")
ON_HEEL, ON_TOES, AT_REST, AFTER = 0.5, 1.0, 0.5, 2.0
"""Most torque [N m]: plantarflexion on a loaded heel, dorsiflexion on the toes, on who stands, and after a fault."""

SETTLED, SHUT_OFF = 0.5, "shut_off.area=10 mm^2"
"""Time after an alarm [s] from which its torque counts, and the valve that is then in the line."""

TWO_STRIDES = 2.0
LASTING = 0.06
"""A torque counts that lasts this long [s]: a foot that comes down needs as long to empty a chamber."""


CARRIES = 30.0
"""Force [N] above which a heel carries: its sensor counts as unloaded below. A foot that comes down on its toes is flat
some 60 ms before its heel carries, and then turns so quickly that the gas of a vented chamber resists."""

STANDS = 0.5
"""Who has stood still for so long [s] is not helped."""

STEADY, MOST_WITHOUT = 0.1, 2
"""A stride is steady where it takes as long as the one before within this part of it, and loads heel and toes on the
ground alone; after so many of them in a row help is back."""

WITHOUT = (
    "| Valve | Walks | Stops | Paused to the end | Pressed down on the heel | ... before the heel carries "
    "| Lifted on the toes | On who stands or sits | No help in more than two steady strides |"
)
WITH = (
    "| Fault | Valve | Within two strides | Last (strides) | Flags | N m until it is found later "
    "| Last above 2 N m (s after it is found) | N m from 0.5 s after | N m where it is not found |"
)


RESIDUALS = (
    "| Walks | Valve | Largest share of what is allowed, in 2 strides | in 3 | in 4 "
    "| Largest growth over strides, in 2 strides | in 3 | in 4 |"
)
CREEPS = (2, 3, 4)
"""Strides since a regulator began to creep in which its residual is looked for."""


@dataclass(frozen=True)
class Outcome:
    """What one walk came to: stops, a pause to its end, peak torques [N m], strides to the first fault flag, its name.

    ``until`` is the peak against the wearer from a fault to its flag, ``after`` that from ``SETTLED`` later on, or
    where no flag comes; ``settles`` [s] is how long after the flag more than ``AFTER`` is left. ``flat`` is the peak in
    plantarflexion where heel or foot are down and the heel does not carry yet, ``unhelped`` the most steady strides in
    a row from strike to strike without all of the help.
    """

    stopped: bool
    paused: bool
    on_heel: float
    flat: float
    on_toes: float
    at_rest: float
    found: float
    flag: str
    after: float
    until: float
    settles: float
    unhelped: int


def drawn_task_sequence(draws: np.random.Generator) -> str:
    """The text of a task sequence: walking on level ground and slopes, turns, stairs, stumbles, scuffs, stops, rest."""
    parts, walks = ["stand"], False
    for _ in range(int(draws.integers(3, 7))):
        kinds = [
            "walk",
            "walk",
            "slope",
            "turn",
            "stairs",
            "ramp",
            *(["stumble", "scuff", "stop"] if walks else []),
            "rest",
        ]
        parts.append(str(draws.choice(kinds)))
        walks = parts[-1] not in ("stop", "rest")
    parts += ["walk"]
    lines = ["schema_version = 1", 'name = "drawn"']
    for kind in parts:
        lines += ["", "[[segment]]", f'kind = "{"walk" if kind == "slope" else kind}"', *_values(kind, draws)]
    return "\n".join(lines) + "\n"


def _values(kind: str, draws: np.random.Generator) -> Iterator[str]:
    if kind in ("walk", "slope", "turn", "ramp", "stairs"):
        fastest = 1.0 if kind == "stairs" else 1.6
        yield f'speed = "{draws.uniform(0.4, fastest):.3f} m/s"'
        yield f"strides = {int(draws.integers(2, 8))}"
        if kind == "slope":
            yield f'slope = "{draws.uniform(-8.0, 8.0):.2f} deg"'
        elif kind == "turn":
            yield f'radius = "{draws.uniform(0.5, 3.0) * draws.choice((-1.0, 1.0)):.3f} m"'
    elif kind in ("stand", "rest"):
        yield f'duration = "{draws.uniform(1.0, 5.0):.2f} s"'
    elif kind == "stumble":
        yield f"time = {draws.uniform(0.65, 1.5):.3f}"
        yield f"length = {draws.uniform(0.3, 1.3):.3f}"


def drawn_device(base: Scenario, draws: np.random.Generator) -> dict[str, float]:
    """Numbers of a device beside the nominal one, which the controller goes on to believe in."""
    device, orifice, leak = base.device, base.device.valve.orifice, base.device.actuator.leak
    assert isinstance(orifice, Orifice), "both valves of the package have an area"
    assert isinstance(leak, Orifice), "and so has the leak"
    supply = device.supply.atmospheric_pressure + draws.uniform(0.95, 1.05) * (
        device.supply.pressure - device.supply.atmospheric_pressure
    )
    believed = {
        f"controller.{name}": value for name, value in base.controller.settings.items() if name[:8] == "nominal_"
    }
    return believed | {
        "supply.pressure": supply,
        "supply.dorsiflexion_pressure": supply,
        "actuator.displacement_per_radian": draws.uniform(0.8, 1.2) * device.actuator.displacement_per_radian,
        "actuator.dead_volume_1": 2.0 ** draws.uniform(-1.0, 1.0) * device.actuator.dead_volume_1,
        "actuator.dead_volume_2": 2.0 ** draws.uniform(-1.0, 1.0) * device.actuator.dead_volume_2,
        "valve.area": draws.uniform(0.9, 1.1) * orifice.area,
        "actuator.leak.area": 3.0 ** draws.uniform(-1.0, 1.0) * leak.area,
    }


def drawn_walk(valve: str, draws: np.random.Generator, folder: Path, overrides: Iterable[str] = ()) -> Scenario:
    """A walk with a drawn task sequence, wearer and device; drawn again where no such gait can walk that."""
    while True:
        file = folder / "drawn.toml"
        file.write_text(drawn_task_sequence(draws))
        sensors = [
            f"faults.{sensor}.{name}={value}"
            for sensor, offset in (
                ("angle", f"{draws.uniform(-2.0, 2.0):.3f} deg"),
                ("pressure_1", f"{draws.uniform(-0.5, 0.5):.3f} psi_d"),
                ("pressure_2", f"{draws.uniform(-0.5, 0.5):.3f} psi_d"),
            )
            for name, value in (("kind", "distorted"), ("time", "0 s"), ("offset", offset))
        ]
        person = f"wearer.person={int(draws.integers(1, 100_000))}"
        try:
            base = load_walk(valve, [person, *sensors, *overrides], task_sequence=file)
        except ScenarioError:
            continue
        return with_numbers(base, drawn_device(base, draws))


def lasting(torque: np.ndarray, where: np.ndarray, time: np.ndarray) -> np.ndarray:
    """The torque [N m] that is reached in some samples for ``LASTING`` from each sample on; 0 in the others."""
    count = max(1, round(LASTING / float(time[1] - time[0])))
    kept = np.concatenate([np.where(where, torque, 0.0), np.zeros(count - 1)])
    found: np.ndarray = np.lib.stride_tricks.sliding_window_view(kept, count).min(axis=1).clip(min=0.0)
    return found


def lasting_peak(torque: np.ndarray, where: np.ndarray, time: np.ndarray) -> float:
    """The largest torque [N m] that is reached for ``LASTING`` on end in some samples; 0 where never."""
    return float(lasting(torque, where, time).max())


def steady_without_help(result: WalkResult) -> int:
    """Most steady strides in a row in which help was less from strike to strike, or that had no lift."""
    data, time = result.recording, result.recording.time
    in_air = data["contact"] == ground.SWING
    starts = np.flatnonzero(in_air[:-1] & ~in_air[1:]) + 1
    most, row, last = 0, 0, np.inf
    for begins, ends in pairwise(starts.tolist()):
        taken, own = float(time[ends] - time[begins]), slice(begins, ends)
        loads = min(float(data["heel_force"][own].max()), float(data["toe_force"][own].max())) > CARRIES
        scuffs = bool((in_air[own] & (data["toe_force"][own] > CARRIES)).any())
        steady = loads and not scuffs and abs(taken - last) < STEADY * last
        less = bool((data["safe_state"][own] > HELPS).all()) or not (data["command"][own] < 0.0).any()
        row = row + 1 if steady and less else 0
        most, last = max(most, row), taken
    return most


def outcome(result: WalkResult, begins: float = np.inf) -> Outcome:
    """What a walk came to; ``begins`` [s] is when a fault began."""
    data, time = result.recording, result.recording.time
    torque, contact, level, shank = data["torque"], data["contact"], data["safe_state"], data["shank_angle"]
    heel = (contact == ground.HEEL) | (contact == ground.FLAT)
    carries = heel & (data["heel_force"] > CARRIES)
    still = (contact == ground.FLAT) & (np.abs(np.gradient(shank, time)) < 1.0e-3)
    held = np.cumsum(still) - np.maximum.accumulate(np.where(still, 0, np.cumsum(still)))
    still = held * (time[1] - time[0]) > STANDS
    event = next((item for item in result.events if item.fault_flag is not None and item.time >= begins), None)
    stop = next((item for item in result.events if item.fault_flag is not None and item.level >= STOPPED), event)
    named = event or stop
    stride = walk_of(result.scenario).gait.stride_time
    against = np.where(contact == ground.TOE, -torque, torque)
    alarm = min(begins, 1.0e9) if event is None else event.time
    late = time > (alarm if event is None else alarm + SETTLED)
    above = time[lasting(against, time > alarm, time) > AFTER] + LASTING
    return Outcome(
        stopped=bool((level >= STOPPED).any()),
        paused=bool(level[-1] == PAUSED),
        on_heel=lasting_peak(torque, carries, time),
        flat=lasting_peak(torque, heel & ~carries, time),
        on_toes=lasting_peak(-torque, contact == ground.TOE, time),
        at_rest=lasting_peak(np.abs(torque), still, time),
        found=np.inf if event is None else (event.time - begins) / stride,
        flag="-" if named is None or named.fault_flag is None else named.fault_flag.name,
        after=lasting_peak(against, late, time) if np.isfinite(begins) else 0.0,
        until=lasting_peak(against, (time > begins) & (time < alarm), time),
        settles=float(above[-1] - alarm) if above.size and event is not None else 0.0,
        unhelped=steady_without_help(result),
    )


def without_faults(valve: str, count: int, seed: int) -> list[Outcome]:
    """Outcomes of drawn walks without any fault."""
    draws, found = np.random.default_rng([seed, VALVES.index(valve)]), []
    with tempfile.TemporaryDirectory() as folder:
        found += [outcome(walk(drawn_walk(valve, draws, Path(folder)))) for _ in range(count)]
    return found


def with_fault(valve: str, part: str, kind: str, count: int, seed: int) -> list[Outcome]:
    """Outcomes of drawn level walks in which a part fails at a drawn time, with a shut-off valve in the line."""
    draws = np.random.default_rng([seed, VALVES.index(valve), *map(ord, part + kind)])
    return [outcome(*failing_walk(valve, part, kind, draws)) for _ in range(count)]


_OF_LINES = ("droop", "largest_flow", "volume")


def nominal_device(configuration: Scenario) -> NominalDevice:
    """The device that the controller of a walk believes in."""
    names = (path.rpartition(".")[2] for path in leaf_paths(NominalDevice, ""))
    given = configuration.controller.settings
    lines = {f"{name}_{line}": f"nominal_line_{name}_{line}" for name in _OF_LINES for line in (1, 2)}
    lines["relieving"] = "nominal_line_relieving"
    found: NominalDevice = rebuilt(NominalDevice, [given[lines.get(name, name)] for name in names])
    return found


def residual_peaks(result: WalkResult) -> tuple[np.ndarray, np.ndarray]:
    """Ends of strides [s], and the largest share of what is allowed that the residual of each chamber reaches in them.

    Above 0 is more gas than expected, for as many samples as make an alarm. The readings are the true ones.
    """
    nominal, data, time = nominal_device(result.scenario), result.recording, result.recording.time
    period = result.scenario.controller.period
    every = round(period / float(time[1] - time[0]))
    seen = list(zip(*(data[name][::every].tolist() for name in ("angle", "pressure_1", "pressure_2")), strict=True))
    means = volumes(nominal, 0.5 * (nominal.nominal_angle_min + nominal.nominal_angle_max))
    state, shares = observer.START, []
    feeds = (nominal.nominal_supply_pressure, nominal.nominal_dorsiflexion_pressure)
    for last, now, command in zip(seen, seen[1:], data["command"][::every].tolist(), strict=False):
        fed = (
            observer.is_fed(nominal, state.coil_1, state.spool),
            observer.is_fed(nominal, state.coil_2, -state.spool),
        )
        state = observer.next_observer(
            nominal, state._replace(command=command), last[0], last[1], last[2], now[0], now[1], now[2], period
        )
        row = []
        for number, (chamber, volume) in enumerate(
            zip((state.chamber_1, state.chamber_2), volumes(nominal, now[0]), strict=True)
        ):
            supplying = observer.Supplying(0.0, 0.0, 1.0 if fed[number] else 0.0, feeds[number], feeds[number])
            reading = observer.ChamberReading(
                last[1 + number], now[1 + number], volume, volume, mean_volume=means[number]
            )
            row.append(observer.contradiction(nominal, chamber.passed, supplying, reading, chamber.pressure))
        shares.append(row)
    lasts = np.lib.stride_tricks.sliding_window_view(np.array(shares), int(observer.ALARM_SAMPLES), axis=0).min(axis=2)
    begins = time[::every][1 : len(lasts) + 1]
    in_air = data["contact"] == ground.SWING
    strikes = time[np.flatnonzero(in_air[:-1] & ~in_air[1:]) + 1]
    return strikes[1:], np.array([lasts[(begins >= a) & (begins < b)].max(axis=0) for a, b in pairwise(strikes)])


def growth(peaks: np.ndarray) -> np.ndarray:
    """By how much each stride's peaks are above the mean of up to three strides that ended a stride before."""
    none = np.zeros((min(2, len(peaks)), 2))
    later = [peaks[k] - peaks[max(0, k - 4) : k - 1].mean(axis=0) for k in range(2, len(peaks))]
    return np.concatenate([none, np.array(later).reshape(-1, 2)])


def rows_of_residuals(valve: str, count: int, seed: int) -> Iterator[str]:
    """Rows of the table of residuals: the largest of all walks without a fault, the smallest of those that creep."""
    draws = np.random.default_rng([seed, VALVES.index(valve), 1])
    with tempfile.TemporaryDirectory() as folder:
        found = [residual_peaks(walk(drawn_walk(valve, draws, Path(folder))))[1] for _ in range(count)]
    sound = [max(float(peaks.max()) for peaks in found), max(float(growth(peaks).max()) for peaks in found)]
    yield f"| without a fault, at most | {valve} | {sound[0]:.2f} | | | {sound[1]:.2f} | | |"
    for chamber, part in enumerate(("regulator_1", "regulator_2")):
        rows = []
        for _ in range(count):
            result, begins = failing_walk(valve, part, "creeping", draws)
            ends, peaks = residual_peaks(result)
            stride = walk_of(result.scenario).gait.stride_time
            within = [(ends > begins) & (ends < begins + strides * stride) for strides in CREEPS]
            rows.append([each[own, chamber].max(initial=0.0) for each in (peaks, growth(peaks)) for own in within])
        least = " | ".join(f"{value:.2f}" for value in np.min(rows, axis=0))
        yield f"| {part} creeps, at least | {valve} | {least} |"


def failing_walk(valve: str, part: str, kind: str, draws: np.random.Generator) -> tuple[WalkResult, float]:
    """A drawn level walk in which a part fails, with a shut-off valve in the line, and when it does [s]."""
    begins = float(draws.uniform(3.0, 4.1))
    given = [f"faults.{part}.kind={kind}", f"faults.{part}.time={begins!r} s", SHUT_OFF]
    base = load_walk(valve, [f"wearer.person={int(draws.integers(1, 100_000))}", *given])
    return walk(with_numbers(base, drawn_device(base, draws)), minutes=0.17), begins


def row_without(valve: str, found: list[Outcome]) -> str:
    """One row of the table of walks without a fault."""
    above = [
        sum(item.on_heel > ON_HEEL for item in found),
        sum(item.on_toes > ON_TOES for item in found),
        sum(item.at_rest > AT_REST for item in found),
    ]
    above.insert(1, sum(item.flat > ON_HEEL for item in found))
    peaks = [max(getattr(item, name) for item in found) for name in ("on_heel", "flat", "on_toes", "at_rest")]
    cells = [f"{many} (at most {peak:.2f} N m)" for many, peak in zip(above, peaks, strict=True)]
    stops = [f"`{item.flag}` in walk {number}" for number, item in enumerate(found, start=1) if item.stopped]
    words = f" ({', '.join(stops)})" if stops else ""
    stopped, paused = f"{sum(item.stopped for item in found)}{words}", str(sum(item.paused for item in found))
    late = f"{sum(item.unhelped > MOST_WITHOUT for item in found)} (at most {max(item.unhelped for item in found)})"
    return f"| {' | '.join((valve, str(len(found)), stopped, paused, *cells, late))} |"


def row_with(valve: str, part: str, kind: str, found: list[Outcome]) -> str:
    """One row of the table of faults."""
    times = [item.found for item in found if np.isfinite(item.found)]
    quick = sum(time <= TWO_STRIDES for time in times)
    names = ", ".join(f"`{name}` {many}" for name, many in Counter(item.flag for item in found).most_common())
    worst = max((item.after for item in found if np.isfinite(item.found)), default=0.0)
    missed = max((item.after for item in found if not np.isfinite(item.found)), default=0.0)
    last = f"{max(times):.2f}" if times else "-"
    slow = [item.until for item in found if TWO_STRIDES < item.found < np.inf]
    until = f"{max(slow):.1f}" if slow else "-"
    settles = f"{max(item.settles for item in found):.2f}"
    shown = f"{missed:.1f}" if len(times) < len(found) else "-"
    cells = (f"{part}: {kind}", valve, f"{quick} of {len(found)}", last, names, until, settles, f"{worst:.1f}", shown)
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Print what is asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--task-sequences", type=int, default=0, help="drawn walks without a fault, of each valve")
    parser.add_argument("--faults", type=int, default=0, help="drawn walks of each fault and valve")
    parser.add_argument("--residuals", type=int, default=0, help="drawn walks of each row of the table of residuals")
    parser.add_argument("--seed", type=int, default=32)
    given = parser.parse_args()
    if given.task_sequences:
        print(f"{WITHOUT}\n|{'---|' * (WITHOUT.count('|') - 1)}")
        for valve in VALVES:
            print(row_without(valve, without_faults(valve, given.task_sequences, given.seed)), flush=True)
    if given.faults:
        print(f"{WITH}\n|{'---|' * (WITH.count('|') - 1)}")
        for part, kinds in PLANT_FAULTS.items():
            for kind in kinds:
                for valve in VALVES:
                    print(
                        row_with(valve, part, kind, with_fault(valve, part, kind, given.faults, given.seed)), flush=True
                    )
    if given.residuals:
        print(f"{RESIDUALS}\n|{'---|' * (RESIDUALS.count('|') - 1)}")
        for valve in VALVES:
            for row in rows_of_residuals(valve, given.residuals, given.seed):
                print(row, flush=True)


if __name__ == "__main__":
    main()
