"""A scenario at the wire, from its settings to what came of it.

The plant runs in this process: why not in one of its own, docs/decisions/0022-processor-and-hardware-in-the-loop.md.
"""

import os
import platform
import random
from collections.abc import Callable

from ppafo.engine.run import batch_of
from ppafo.exports.hil import wire
from ppafo.exports.hil.loop import Bench, LockStep, LoopPacing, RealTime, without_collections
from ppafo.exports.hil.plant import CompiledPlant, check_baud, plant_of
from ppafo.exports.hil.result import HardwareRun, HostComputer, timing_of
from ppafo.simulation.sampled import SampledRun
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import result_of

PATIENCE = 10.0
"""Time [s] for which the controller is called before the run is given up."""
_LARGEST_RUN = 2**16 - 1
"""Largest number of a run: packets carry it in 16 bits."""
_SAME_PERIOD = 1.0e-9
"""Difference of two sample periods, as a fraction of one, that rounding makes."""


def run_plant(
    plant: CompiledPlant,
    port: wire.Port,
    pace: Callable[[float], LoopPacing],
    patience: float = PATIENCE,
    is_stopped: Callable[[], bool] = lambda: False,
    run: int | None = None,
) -> HardwareRun:
    """Run a plant against the controller at a port, until its end or until ``is_stopped`` says so.

    ``pace`` makes the pace of a sample period [s]; ``patience`` [s] is how long the controller is called; ``run`` is
    the number of the run, 0 to 65535, drawn where none is given. ScenarioError where nobody answers.
    """
    # Not from a seed: packets of an earlier run that are still under way must have another number.
    number = random.SystemRandom().randint(0, _LARGEST_RUN) if run is None else run
    load_before = load_now()
    # Built before the clock starts: arrays and programs take milliseconds.
    sampled = SampledRun(batch_of(plant.run), plant.module)
    with without_collections():
        exchange = Bench(sampled, plant.period, port, pace(plant.period), number).run(patience, is_stopped)
    machine = HostComputer(
        system=f"{platform.system()} {platform.machine()}",
        cores=os.cpu_count() or 1,
        python=platform.python_version(),
        load_before=load_before,
        load_after=load_now(),
    )
    result = result_of(plant.scenario, plant.run, sampled.result())
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
    """Open a port and run a scenario's plant there, ``rate`` samples a second, over a line of ``baud`` bits a second.

    ``in_lock_step`` lets the plant wait for each answer, else it runs in real time. ``say`` hears of a rate that does
    not fit the scenario, and of the call; ``patience`` and ``is_stopped`` as ``run_plant`` has them. ScenarioError for
    a port, rate or scenario that does not do, and where nobody answers.
    """
    port = wire.open_port(port_name, baud)
    try:
        # A datagram has no line whose rate could be too low.
        if port.is_stream:
            check_baud(baud, rate)
        plant, decided = plant_of(scenario, rate), scenario.controller.period
        if plant.period > decided * (1.0 + _SAME_PERIOD):
            say(
                f"--rate {rate}: a sample every {plant.period * 1.0e3:.4g} ms, for a controller of the scenario that "
                f"decides every {decided * 1.0e3:.4g} ms; it has the wrong gains unless it was exported for this rate: "
                f"give --set controller.rate={rate}Hz here and to 'ppafo export controller'"
            )
        say(f"calling the controller at {port_name} ...")
        # In lock step the pace waits for each answer, whatever the sample period is.
        pace: Callable[[float], LoopPacing] = (lambda _: LockStep()) if in_lock_step else RealTime
        return run_plant(plant, port, pace, patience, is_stopped)
    finally:
        port.close()


def load_now() -> float | None:
    """Processes that run on this computer, on average over the last minute [-]; None where the system tells it not."""
    try:
        return os.getloadavg()[0]
    except (AttributeError, OSError):
        return None
