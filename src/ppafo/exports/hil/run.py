"""A scenario at the wire, from its settings to what came of it.

The plant runs in this process: why not in one of its own, docs/decisions/0022-processor-and-hardware-in-the-loop.md.
"""

import os
import platform
import random
from collections.abc import Callable

from ppafo.engine.run import batch_of
from ppafo.exports.hil import wire
from ppafo.exports.hil.loop import Bench, LockStep, Pace, RealTime, without_collections
from ppafo.exports.hil.plant import Plant, check_baud, plant_of
from ppafo.exports.hil.result import HardwareRun, Machine, timing_of
from ppafo.simulation.sampled import SampledRun
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import result_of

_LARGEST_RUN = 2**16 - 1
_SAME = 1.0e-9
"""Two sample periods that differ by less, as a fraction, are one."""


def run_plant(
    plant: Plant,
    port: wire.Port,
    pace: Callable[[float], Pace],
    patience: float = 10.0,
    is_stopped: Callable[[], bool] = lambda: False,
    run: int | None = None,
) -> HardwareRun:
    """Run a plant against the controller at a port; ``pace`` makes the pace for a period [s].

    ``patience`` [s] is how long the controller is called; ``run`` its number, drawn where none is given.
    ScenarioError where nobody answers.
    """
    # Not from a seed: packets of an earlier run that are still under way must have another number.
    number = random.SystemRandom().randint(0, _LARGEST_RUN) if run is None else run
    before = load_now()
    # Built before the clock starts: arrays and programs take milliseconds.
    begun = SampledRun(batch_of(plant.run), plant.module)
    with without_collections():
        exchange = Bench(begun, plant.period, port, pace(plant.period), number).run(patience, is_stopped)
    machine = Machine(
        f"{platform.system()} {platform.machine()}", os.cpu_count() or 1, platform.python_version(), before, load_now()
    )
    result = result_of(plant.scenario, plant.run, begun.result())
    return HardwareRun(plant, result, exchange, timing_of(exchange.rows), machine)


def run_at(
    port_name: str,
    scenario: Scenario,
    rate: int,
    baud: int,
    in_lock_step: bool,
    patience: float,
    is_stopped: Callable[[], bool],
    say: Callable[[str], None],
) -> HardwareRun:
    """Open a port and run a scenario's plant there; ``say`` hears of a rate that does not fit, and of the call."""
    port = wire.open_port(port_name, baud)
    try:
        # A datagram has no line whose rate could be too low.
        if port.is_stream:
            check_baud(baud, rate)
        plant, period = plant_of(scenario, rate), scenario.controller.period
        if plant.period > period * (1.0 + _SAME):
            apart, wanted = plant.period * 1.0e3, period * 1.0e3
            say(
                f"--rate {rate}: a sample every {apart:.4g} ms, for a controller of the scenario that decides every "
                f"{wanted:.4g} ms; it has the wrong gains unless it was exported for this rate: give "
                f"--set controller.rate={rate}Hz here and to 'ppafo export controller'"
            )
        say(f"calling the controller at {port_name} ...")
        pace = (lambda _apart: LockStep()) if in_lock_step else RealTime
        return run_plant(plant, port, pace, patience, is_stopped)
    finally:
        port.close()


def load_now() -> float | None:
    """Processes that run on this computer, on average over the last minute [-]."""
    try:
        return os.getloadavg()[0]
    except (AttributeError, OSError):
        return None
