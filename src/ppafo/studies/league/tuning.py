"""How the gains of the league were found: once, with SciPy's differential evolution.

    python -m ppafo.studies.league.tuning sliding_mode

The defaults of the controllers in the catalogue are what this gave, to two digits. The torque task is run on the ideal
device, and with a slow spool, a dead band, delays and noise on several devices drawn as in the league (but not the
same), so that gains which only an ideal or a known device would stand lose.
"""

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ppafo.control.catalog import CONTROLLERS
from ppafo.errors import ScenarioError, nearest_name
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Control, Scenario
from ppafo.simulation.simulate import simulate_many
from ppafo.studies.league.draws import drawn_devices, drawn_factors

GAS_PRICE = 1.0e3
"""N m of RMS error that a kilogram of gas is worth: 1 N m per gram."""
FAILED = 1.0e3
"""N m: the price of a run that diverges."""
SEED = 1
DEVICE_SEED = 2
DEVICES = 8
POPULATION = 8
GENERATIONS = 16
PERIOD = 1.0e-3

SEARCHED: dict[str, dict[str, tuple[float, float]]] = {
    "on_off_dead_zone": {"dead_zone": (0.02, 1.0), "release": (0.005, 1.0), "opening": (0.02, 1.0)},
    "pid": {
        "proportional_gain": (0.01, 10.0),
        "integral_gain": (0.01, 100.0),
        "derivative_gain": (1.0e-5, 0.1),
        "derivative_filter": (1.0e-3, 0.05),
        "anti_windup": (0.1, 100.0),
    },
    "pid_feedforward": {
        "proportional_gain": (0.01, 10.0),
        "integral_gain": (0.01, 100.0),
        "derivative_gain": (1.0e-5, 0.1),
        "derivative_filter": (1.0e-3, 0.05),
        "anti_windup": (0.1, 100.0),
    },
    "sliding_mode": {"surface_slope": (0.01, 100.0), "boundary_layer": (0.05, 20.0), "reaching_command": (0.05, 1.0)},
    "damped_proportional": {
        "proportional_gain": (0.01, 10.0),
        "damping": (1.0e-5, 0.1),
        "damping_filter": (1.0e-3, 0.05),
    },
    "feedback_linearisation": {"convergence_rate": (1.0, 1000.0), "rate_filter": (1.0e-3, 0.05)},
}
"""Lowest and highest value, SI units, of what is searched, on a logarithmic scale; all else keeps its default."""


@dataclass(frozen=True, slots=True)
class Tuned:
    """Settings in SI units, and the price [N m] that they have on the tasks."""

    settings: Mapping[str, float]
    price: float


def tuning_tasks() -> tuple[Scenario, ...]:
    """The torque task within reach of the supply: with an ideal valve, and with a slow one on drawn devices."""
    slow = load_scenario("torque-task-slow-valve", ["controller.rate=1 kHz"])
    ideal = load_scenario("torque-task-proportional", ["reference.level=4 N m"])
    return (ideal, *drawn_devices(slow, drawn_factors(DEVICES, DEVICE_SEED)))


def price(kind: str, settings: Mapping[str, float], tasks: Sequence[Scenario]) -> float:
    """Mean over the tasks of RMS error plus gas at ``GAS_PRICE`` [N m]."""
    control = Control(kind, dict(settings), PERIOD)
    total = 0.0
    for result in simulate_many([replace(task, control=control) for task in tasks]):
        metrics = result.metrics
        good = result.status.is_completed
        total += metrics["rms_error"].value + GAS_PRICE * metrics["gas_supplied"].value if good else FAILED
    return total / len(tasks)


def tune(kind: str, generations: int = GENERATIONS) -> Tuned:
    """Return the best settings found for a controller; ScenarioError for one that has nothing to search."""
    from scipy.optimize import differential_evolution

    if kind not in SEARCHED:
        raise ScenarioError(
            f"nothing to tune for '{kind}'{nearest_name(kind, SEARCHED)}; known are {', '.join(SEARCHED)}"
        )
    tasks = tuning_tasks()
    defaults = {item.name: float(item.default or 0.0) for item in CONTROLLERS[kind].quantities}
    names = list(SEARCHED[kind])
    limits = [tuple(math.log(limit) for limit in SEARCHED[kind][name]) for name in names]

    def cost(logarithms: Sequence[float]) -> float:
        found = {name: math.exp(value) for name, value in zip(names, logarithms, strict=True)}
        return price(kind, defaults | found, tasks)

    best = differential_evolution(
        cost, limits, maxiter=generations, popsize=POPULATION, seed=SEED, tol=1.0e-4, polish=False
    )
    found = {name: math.exp(value) for name, value in zip(names, best.x, strict=True)}
    return Tuned(defaults | found, float(best.fun))


if __name__ == "__main__":
    for chosen in sys.argv[1:]:
        result = tune(chosen)
        shown = ", ".join(f"{name} {result.settings[name]:.3g}" for name in SEARCHED[chosen])
        sys.stdout.write(f"{chosen}: {shown}; price {result.price:.4f} N m\n")
