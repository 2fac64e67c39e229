"""How the gains of the league's controllers were found: with the search of ``ppafo tune``, over two tasks at once.

    python scripts/league_gains.py sliding_mode event_pid

``ppafo tune`` judges gains on one scenario; these have to stand an ideal device and a bad one, so that gains which only
an ideal or a known device would stand lose. Controllers of the torque task run on the ideal valve, and with a slow
spool, a dead band, delays and noise on devices drawn as in the league (but not the same), each with noise of its own.
Those of walking walk with the shipped wearer on an ideal valve, and on a slow one with noisy sensors; all candidates of
a generation walk in one batch.

The defaults in the catalogue are the result to two digits of earlier searches by differential evolution: those of the
torque task when all devices shared one realisation of the noise. The best price is flat, so that a search anew may end
at other gains of nearly the same price; it prints the price of the defaults beside that of what it found.
"""

import argparse
import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ppafo.control.catalog import CONTROLLERS
from ppafo.control.walking import phases
from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.engine.lanes import Floats, run_batch
from ppafo.engine.run import NEVER_FAILED, Run, batches_of
from ppafo.errors import ScenarioError, nearest_name
from ppafo.model.plant import chamber_pressures
from ppafo.questions.league.standing import draw_devices, draw_factors, draw_seeds, with_noise
from ppafo.questions.tune.problem import Effort
from ppafo.questions.tune.solve import search
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import controller_parameters
from ppafo.simulation.sampled import state_row_numbers
from ppafo.simulation.scenario import Control, Scenario
from ppafo.simulation.simulate import simulate_many
from ppafo.walking import load_walk
from ppafo.walking.events import PHASE_ROW, REQUEST_ROW, VENTINGS_ROW
from ppafo.walking.gait_series import ankle_path
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import law_of, plan_walk

GAS_PRICE = 1.0e3
"""N m of RMS error (in push-off where it walks) that a kilogram of gas (in a stride) is worth: 1 N m per gram."""
TOE_PRICE = 100.0
"""N m per metre that the toes are below ``CLEARANCE`` in mid-swing: 1 N m per centimetre."""
SLAP_PRICE = 0.05
"""N m per rad/s of the foot when it comes down."""
WORK_PRICE = 0.3
"""N m that a joule of work in push-off is worth."""
TOE_LANDING_PRICE = 2.0
"""N m that strides which begin on the toes cost, as a share of all strides."""
CLEARANCE = 0.005
"""Height [m] over the ground that the toes shall have in mid-swing."""
FAILED = 1.0e3
"""N m: the price of a run that diverges, or of a walk whose controller paused or stopped."""

SECONDS = 12.0
STRIDES = 6
"""The last strides of a walk are judged; the ones before are for learning."""
RECORD_INTERVAL = 5.0e-3
DEVICE_SEED = 2
DEVICES = 8
PERIOD = 1.0e-3
EFFORT = Effort(starts=1, generations=16, candidates_per_gain=8, seed=1)
WALKING_EFFORT = EFFORT.model_copy(update={"generations": 80})

SLOW_VALVE = (
    "valve.spool_frequency=20 Hz",
    "valve.spool_damping_ratio=0.7",
    "valve.dead_band=0.05",
    "valve.delay=2 ms",
)
NOISE = ("sensors.angle_noise=0.1 deg", "sensors.pressure_noise=0.05 psi_d", "sensors.force_noise=5 N")
VALVES = {"event_on_off": ("solenoid", ()), "event_on_off_dead_zone": ("proportional", SLOW_VALVE)}
"""Valve of a controller and how it is made slow; the others have a proportional one."""

Range = tuple[float, float]
PID: dict[str, Range] = {
    "proportional_gain": (0.01, 10.0),
    "integral_gain": (0.01, 100.0),
    "derivative_gain": (1.0e-5, 0.1),
    "derivative_filter": (1.0e-3, 0.05),
    "anti_windup": (0.1, 100.0),
}
DEAD_ZONE: dict[str, Range] = {"dead_zone": (0.02, 1.0), "release": (0.005, 1.0), "opening": (0.02, 1.0)}
SLIDING: dict[str, Range] = {
    "surface_slope": (0.01, 100.0),
    "boundary_layer": (0.05, 20.0),
    "reaching_command": (0.05, 1.0),
}
DAMPED: dict[str, Range] = {
    "proportional_gain": (0.01, 10.0),
    "damping": (1.0e-5, 0.1),
    "damping_filter": (1.0e-3, 0.05),
}
LINEARISATION: dict[str, Range] = {"convergence_rate": (1.0, 1000.0), "rate_filter": (1.0e-3, 0.05)}

SEARCHED: dict[str, dict[str, Range]] = {
    "on_off_dead_zone": DEAD_ZONE,
    "pid": PID,
    "pid_feedforward": PID,
    "sliding_mode": SLIDING,
    "damped_proportional": DAMPED,
    "feedback_linearisation": LINEARISATION,
    "event_on_off": {"swing_angle": (1.4, 1.7), "band": (0.005, 0.2), "push_off_end": (0.45, 0.65)},
    "event_on_off_dead_zone": DEAD_ZONE,
    "event_proportional": {"torque_gain": (0.05, 10.0), "torque_integral_gain": (0.01, 100.0)},
    "event_pid": PID,
    "event_pid_feedforward": PID,
    "event_sliding_mode": SLIDING,
    "event_damped_learning": {**DAMPED, "learning_gain": (0.01, 3.0), "lead": (1.0e-3, 0.05)},
    "event_feedback_linearisation": LINEARISATION,
}
"""Lowest and highest value, SI units, of what is searched, on a logarithmic scale; all else keeps its default.

What is wanted in landing and swing is the same for all walking laws and not searched here. Its defaults, and the gains
of ``event_proportional`` with them, come from such a search over ``event_proportional`` and ``event_damped_learning``
together, with a higher price on gas and a price on the ankle's RMS difference to the healthy path, followed by a look
at variants of what it found. Drawn wearers walked in the search too and paid for low toes, landings on the toes and a
safe state: for the shipped wearer alone it finds feet that land nearly flat, which would be a landing on the toes for
others. Those of ``event_on_off`` come from such a search and a grid about it, with 200 drawn wearers.
"""


@dataclass(frozen=True, slots=True)
class WalkJudgement:
    """What came of walks, each an array (walks,); gas [kg], work [J] and slap rate [rad/s] as means over the strides.

    ``error`` is the RMS torque error in push-off [N m], ``toe_height`` the lowest over the ground in mid-swing [m],
    ``toe_landing`` the fraction of strides that begin on the toes, ``is_good`` False where a walk failed.
    """

    error: Floats
    gas: Floats
    push_off_work: Floats
    toe_height: Floats
    slap_rate: Floats
    toe_landing: Floats
    is_good: Floats

    @property
    def price(self) -> Floats:
        """What these walks cost [N m]."""
        low = np.maximum(CLEARANCE - self.toe_height, 0.0)
        bought = GAS_PRICE * self.gas + TOE_PRICE * low + SLAP_PRICE * np.abs(self.slap_rate)
        bought += TOE_LANDING_PRICE * self.toe_landing - WORK_PRICE * self.push_off_work
        return np.asarray(np.where(self.is_good, self.error + bought, FAILED))


def walks_to_judge(kind: str) -> tuple[Scenario, ...]:
    """The shipped wearer with a controller: an ideal valve, and a slow one with noise on the sensors."""
    valve, slow = VALVES.get(kind, ("proportional", SLOW_VALVE))
    chosen = f"controller.kind={kind}"
    return load_walk(valve, [chosen]), load_walk(valve, [chosen, *slow, *NOISE])


def judge_walks(configuration: Scenario, settings: Mapping[str, float | Floats], walks: int) -> WalkJudgement:
    """Walks of a configuration with other settings of its controller, SI units, each a number or an array (walks,)."""
    run = plan_walk(replace(configuration, duration=SECONDS, output_interval=RECORD_INTERVAL))
    controller = controller_parameters(law_of(configuration), settings)
    ((_, batch),) = batches_of(replace(run, controller=controller), walks)
    outcome = run_batch(batch)
    rows = state_row_numbers(run)
    states = {name: outcome.states[row] for name, row in rows.items()}
    samples = round(STRIDES * walk_of(configuration).gait.stride_time / RECORD_INTERVAL)
    late = outcome.record[-samples - 1 :]
    good = (states["result.failure_time"] >= NEVER_FAILED) & np.isfinite(outcome.states).all(axis=0)
    vented = states.get(VENTINGS_ROW, np.zeros(walks)) > 0.0
    return WalkJudgement(
        error=_push_off_error(run, rows, late),
        gas=_gain(late, rows, "state.supplied_mass") / STRIDES,
        push_off_work=_gain(late, rows, "walk.push_off_work") / STRIDES,
        toe_height=_lowest_toes(configuration, run, rows, late),
        slap_rate=_gain(late, rows, "walk.slap_rates") / np.maximum(_gain(late, rows, "walk.landings"), 1.0),
        toe_landing=_gain(late, rows, "walk.toe_landings") / STRIDES,
        is_good=np.asarray(good & ~vented),
    )


def _gain(record: Floats, rows: Mapping[str, int], total: str) -> Floats:
    return np.asarray(record[-1, rows[total]] - record[0, rows[total]])


def _push_off_error(run: Run, rows: Mapping[str, int], record: Floats) -> Floats:
    """RMS of requested torque less torque [N m] in push-off; 0 for a law that requests none."""
    requested = rows.get(REQUEST_ROW)
    if requested is None:
        return np.zeros(record.shape[2])
    gas = (record[:, rows[f"state.{name}"]] for name in ("angle", "mass_1", "mass_2"))
    pressure_1, pressure_2 = chamber_pressures(run.plant, *gas)
    error = record[:, requested] - run.plant.torque_constant * np.subtract(pressure_1, pressure_2)
    pushes = record[:, rows[PHASE_ROW]] == phases.PUSH_OFF
    return np.asarray(np.sqrt((error**2 * pushes).sum(axis=0) / np.maximum(pushes.sum(axis=0), 1)))


def _lowest_toes(configuration: Scenario, run: Run, rows: Mapping[str, int], record: Floats) -> Floats:
    """Lowest toes over the ground [m] in mid-swing."""
    assert run.walk is not None, "a walk has a leg"
    timing = run.walk.timing
    phase = record[:, rows["walk.now.phase"]]
    path = ankle_path(walk_of(configuration).gait, timing, walk_of(configuration).wearer)
    height = path.toe_height(phase, record[:, rows["walk.now.shank"]], record[:, rows["state.angle"]])
    return np.asarray(
        np.where((phase >= timing.clearance_from) & (phase <= timing.clearance_to), height, 1.0).min(axis=0)
    )


def defaults(kind: str) -> dict[str, float]:
    """Return the settings of a controller as the catalogue has them."""
    quantities = (WALKING_CONTROLLERS if kind in WALKING_CONTROLLERS else CONTROLLERS)[kind].quantities
    return {item.name: float(item.default or 0.0) for item in quantities}


def tasks_to_judge() -> tuple[Scenario, ...]:
    """Return the torque task within reach of the supply: with an ideal valve, and with a slow one on drawn devices."""
    slow = load_scenario("torque-task-slow-valve", ["controller.rate=1 kHz"])
    ideal = load_scenario("torque-task-proportional", ["reference.level=4 N m"])
    drawn = draw_devices(slow, draw_factors(DEVICES, DEVICE_SEED))
    return (ideal, *with_noise(drawn, draw_seeds(DEVICES, DEVICE_SEED)))


def prices(kind: str, settings: Mapping[str, Floats]) -> Floats:
    """Return the price of candidates (candidates,), a mean over the tasks [N m], for arrays of some settings [SI]."""
    count = len(next(iter(settings.values())))
    if kind in WALKING_CONTROLLERS:
        walks = [judge_walks(task, {**defaults(kind), **settings}, count).price for task in walks_to_judge(kind)]
        return np.asarray(np.mean(walks, axis=0))
    tasks = tasks_to_judge()
    controls = [
        Control(kind, defaults(kind) | {name: float(values[place]) for name, values in settings.items()}, PERIOD)
        for place in range(count)
    ]
    results = simulate_many([replace(task, control=control) for control in controls for task in tasks])
    each = [
        result.metrics["rms_error"].value + GAS_PRICE * result.metrics["gas_supplied"].value
        if result.status.is_completed
        else FAILED
        for result in results
    ]
    return np.asarray(np.mean(np.reshape(each, (count, len(tasks))), axis=1))


def find(kind: str, effort: Effort | None = None) -> tuple[dict[str, float], float]:
    """Return the best settings found for a controller [SI] and their price [N m]; ScenarioError for an unknown one."""
    if kind not in SEARCHED:
        raise ScenarioError(
            f"nothing to search for '{kind}'{nearest_name(kind, SEARCHED)}; known are {', '.join(SEARCHED)}"
        )
    ranges = SEARCHED[kind]
    low, high = (np.log([limits[end] for limits in ranges.values()]) for end in (0, 1))

    def costs(fractions: Floats) -> Floats:
        return prices(kind, dict(zip(ranges, np.exp(low + fractions * (high - low)).T, strict=True)))

    now = [defaults(kind)[name] for name in ranges]
    before = [
        (math.log(value) - first) / (last - first) if value > 0.0 else -math.inf
        for value, first, last in zip(now, low, high, strict=True)
    ]
    best = search(costs, before, effort or (WALKING_EFFORT if kind in WALKING_CONTROLLERS else EFFORT))[0]
    values = np.exp(low + np.array(best.fractions) * (high - low)).tolist()
    return dict(zip(ranges, values, strict=True)), best.cost


def main() -> None:
    """Search for each controller that is named, and print what was found beside the defaults."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kinds", metavar="NAME", nargs="+", choices=tuple(SEARCHED), help="controllers")
    for kind in parser.parse_args().kinds:
        found, price = find(kind)
        now = {name: np.array([defaults(kind)[name]]) for name in found}
        shown = ", ".join(f"{name} {value:.3g} ({now[name][0]:.3g})" for name, value in found.items())
        sys.stdout.write(f"{kind}: {shown}; price {price:.4f} N m ({prices(kind, now)[0]:.4f} N m)\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
