"""How the gains of the walking controllers were found: with SciPy's differential evolution.

    python -m ppafo.studies.league.walking_tuning event_pid

The defaults of the controllers come from such searches, rounded to two digits; the best price is flat, so that a search
anew may end at other gains of nearly the same price. The shipped wearer walks on an ideal valve, and on a
slow one with noise on the sensors, so that gains which only an ideal device would stand lose. All candidates of a
generation walk in one batch.
"""

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.control.walking import phases
from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.engine.lanes import Floats, run_batch
from ppafo.engine.run import NEVER_FAILED, Run, batches_of
from ppafo.errors import ScenarioError, nearest_name
from ppafo.model.plant import chamber_pressures
from ppafo.simulation.plan import controller_parameters
from ppafo.simulation.sampled import state_row_numbers
from ppafo.walking import Configuration, load_walk
from ppafo.walking.planning import plan_walk
from ppafo.walking.posture import ankle_path
from ppafo.walking.walk import plan_of

GAS_PRICE = 1.0e3
"""N m of RMS error in push-off that a kilogram of gas in a stride is worth: 1 N m per gram."""
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
"""N m: the price of a walk that diverges or ends in the safe state."""

SECONDS = 12.0
STRIDES = 6
"""The last strides of a walk are judged; the ones before are for learning."""
RECORD_INTERVAL = 5.0e-3
SEED = 1
POPULATION = 8
GENERATIONS = 80

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
SEARCHED: dict[str, dict[str, Range]] = {
    "event_on_off": {"swing_angle": (1.4, 1.7), "band": (0.005, 0.2), "push_off_end": (0.45, 0.65)},
    "event_on_off_dead_zone": {"dead_zone": (0.02, 1.0), "release": (0.005, 1.0), "opening": (0.02, 1.0)},
    "event_proportional": {"torque_gain": (0.05, 10.0), "torque_integral_gain": (0.01, 100.0)},
    "event_pid": PID,
    "event_pid_feedforward": PID,
    "event_sliding_mode": {
        "surface_slope": (0.01, 100.0),
        "boundary_layer": (0.05, 20.0),
        "reaching_command": (0.05, 1.0),
    },
    "event_damped_learning": {
        "proportional_gain": (0.01, 10.0),
        "damping": (1.0e-5, 0.1),
        "damping_filter": (1.0e-3, 0.05),
        "learning_gain": (0.01, 3.0),
        "lead": (1.0e-3, 0.05),
    },
    "event_feedback_linearisation": {"convergence_rate": (1.0, 1000.0), "rate_filter": (1.0e-3, 0.05)},
}
"""Lowest and highest value, SI units, of what is searched, on a logarithmic scale; all else keeps its default.

What is wanted in landing and swing is the same for all laws and not searched here. Its defaults, and the gains of
``event_proportional`` with them, come from such a search over ``event_proportional`` and ``event_damped_learning``
together, with a higher price on gas and a price on the ankle's RMS difference to the healthy path, followed by a look
at variants of what it found. Drawn wearers walked in the search too and paid for low toes, landings on the toes and a
safe state: for the shipped wearer alone it finds feet that land nearly flat, which would be a landing on the toes for
others. Those of ``event_on_off`` come from such a search and a grid about it, with 200 drawn wearers.
"""


@dataclass(frozen=True, slots=True)
class Judged:
    """What came of walks, each an array (walks,); gas [kg], work [J] and slap rate [rad/s] as means over the strides.

    ``error`` is the RMS torque error in push-off [N m], ``toe_height`` the lowest over the ground in mid-swing [m],
    ``toe_landing`` the share of strides that begin on the toes, ``is_good`` False where a walk failed.
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


@dataclass(frozen=True, slots=True)
class Tuned:
    """Settings in SI units, and the price [N m] that they have on the tasks."""

    settings: Mapping[str, float]
    price: float


def tuning_walks(kind: str) -> tuple[Configuration, ...]:
    """The shipped wearer with a controller: an ideal valve, and a slow one with noise on the sensors."""
    valve, slow = VALVES.get(kind, ("proportional", SLOW_VALVE))
    chosen = f"controller.kind={kind}"
    return load_walk(valve, [chosen]), load_walk(valve, [chosen, *slow, *NOISE])


def judged(configuration: Configuration, settings: Mapping[str, float | Floats], walks: int) -> Judged:
    """Walks of a configuration with other settings of its controller, SI units, each a number or an array (walks,)."""
    run = plan_walk(replace(plan_of(configuration, SECONDS), record_interval=RECORD_INTERVAL))
    controller = controller_parameters(configuration.controller, settings)
    ((_, batch),) = batches_of(replace(run, controller=controller), walks)
    outcome = run_batch(batch)
    rows = state_row_numbers(run)
    states = {name: outcome.states[row] for name, row in rows.items()}
    samples = round(STRIDES * configuration.gait.stride_time / RECORD_INTERVAL)
    late = outcome.record[-samples - 1 :]
    good = (states["result.failure_time"] >= NEVER_FAILED) & np.isfinite(outcome.states).all(axis=0)
    vented = states.get("controller_state.safety.vented", np.zeros(walks)) > 0.5
    return Judged(
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
    """RMS of torque wanted less torque [N m] in push-off; 0 for a law that wants none."""
    wish = rows.get("controller_state.wish.torque")
    if wish is None:
        return np.zeros(record.shape[2])
    gas = (record[:, rows[f"state.{name}"]] for name in ("angle", "mass_1", "mass_2"))
    pressure_1, pressure_2 = chamber_pressures(run.plant, *gas)  # type: ignore[arg-type]
    error = record[:, wish] - run.plant.torque_constant * np.subtract(pressure_1, pressure_2)
    pushes = record[:, rows["controller_state.phase.phase"]] == phases.PUSH_OFF
    return np.asarray(np.sqrt((error**2 * pushes).sum(axis=0) / np.maximum(pushes.sum(axis=0), 1)))


def _lowest_toes(configuration: Configuration, run: Run, rows: Mapping[str, int], record: Floats) -> Floats:
    """Lowest toes over the ground [m] in mid-swing."""
    assert run.walk is not None, "a walk has a leg"
    timing = run.walk.timing
    phase = record[:, rows["walk.now.phase"]]
    path = ankle_path(configuration.gait, timing, configuration.wearer)
    height = path.toe_height(phase, record[:, rows["walk.now.shank"]], record[:, rows["state.angle"]])
    return np.asarray(
        np.where((phase >= timing.clearance_from) & (phase <= timing.clearance_to), height, 1.0).min(axis=0)
    )


def defaults(kind: str) -> dict[str, float]:
    """Settings of a controller as the catalogue has them."""
    return {item.name: float(item.default or 0.0) for item in WALKING_CONTROLLERS[kind].quantities}


def tune(kind: str, generations: int = GENERATIONS) -> Tuned:
    """Return the best settings found for a controller; ScenarioError for one that has nothing to search."""
    from scipy.optimize import differential_evolution

    if kind not in SEARCHED:
        raise ScenarioError(
            f"nothing to tune for '{kind}'{nearest_name(kind, SEARCHED)}; known are {', '.join(SEARCHED)}"
        )
    tasks, fixed = tuning_walks(kind), defaults(kind)
    names = list(SEARCHED[kind])
    limits = [tuple(math.log(limit) for limit in SEARCHED[kind][name]) for name in names]

    def cost(logarithms: Floats) -> Floats:
        candidates = logarithms if logarithms.ndim == 2 else logarithms[:, None]
        found = dict(zip(names, np.exp(candidates), strict=True))
        prices = [judged(task, fixed | found, candidates.shape[1]).price for task in tasks]
        return np.asarray(np.mean(prices, axis=0))

    best = differential_evolution(
        cost,
        limits,
        maxiter=generations,
        popsize=POPULATION,
        seed=SEED,
        tol=1.0e-4,
        polish=False,
        vectorized=True,
        updating="deferred",
    )
    found = {name: math.exp(value) for name, value in zip(names, best.x, strict=True)}
    return Tuned(fixed | found, float(best.fun))


def lines(kind: str, tuned: Tuned) -> Sequence[str]:
    """What was found and what it gives, to print."""
    shown = ", ".join(f"{name} {tuned.settings[name]:.3g}" for name in SEARCHED[kind])
    found = [f"{kind}: {shown}; price {tuned.price:.4f} N m"]
    for task, named in zip(tuning_walks(kind), ("ideal", "slow, noisy"), strict=True):
        for settings, whose in ((defaults(kind), "default"), (tuned.settings, "found")):
            walk = judged(task, settings, 1)
            found.append(
                f"  {named}, {whose}: error {walk.error[0]:.3f} N m, gas {1e3 * walk.gas[0]:.3f} g, "
                f"work {walk.push_off_work[0]:.2f} J, toes {100.0 * walk.toe_height[0]:.2f} cm, "
                f"slap {walk.slap_rate[0]:.2f} rad/s, price {walk.price[0]:.3f} N m"
            )
    return found


if __name__ == "__main__":
    for chosen in sys.argv[1:]:
        sys.stdout.write("\n".join(lines(chosen, tune(chosen))) + "\n")
        sys.stdout.flush()
