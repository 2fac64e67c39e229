"""Run of a compiled plant against the controller at a port.

The plant runs in this process; docs/decisions/0022-processor-and-hardware-in-the-loop.md explains the reasons.
"""

import gc
import os
import platform
import random
from collections.abc import Callable

from ppafo.engine.run import batch_of
from ppafo.exports.hil.loop import Bench
from ppafo.exports.hil.pacing import LoopPacing
from ppafo.exports.hil.plant import CompiledPlant
from ppafo.exports.hil.ports import Port
from ppafo.exports.hil.result import HardwareRun, HostComputer
from ppafo.simulation.sampled import SampledRun
from ppafo.simulation.simulate import result_of

PATIENCE = 10.0
"""Time [s] for which the controller is called before the run is abandoned."""
_LARGEST_RUN = 2**16 - 1
"""Largest run number, as packets contain it in 16 bits."""


def run_plant(
    plant: CompiledPlant,
    port: Port,
    pace: Callable[[float], LoopPacing],
    patience: float = PATIENCE,
    is_stopped: Callable[[], bool] = lambda: False,
    run: int | None = None,
) -> HardwareRun:
    """Run a plant against the controller at a port, until its end or until ``is_stopped`` returns True.

    ``pace`` creates the time stepping for a sample period [s]. ``patience`` [s] limits the call of the controller.
    ``run`` is the number of the run, 0 to 65535, by default random. Raises ScenarioError if no controller answers.
    """
    # Not from a seed: packets of an earlier run that are still under way must have another number.
    number = random.SystemRandom().randint(0, _LARGEST_RUN) if run is None else run
    load_before = _load_now()
    # Built before the clock starts: arrays and programs take milliseconds.
    sampled = SampledRun(batch_of(plant.run), plant.module)
    collects_garbage = gc.isenabled()
    # Garbage collection takes milliseconds: now, so that nothing is left to collect for long, and not during the run.
    gc.collect()
    gc.disable()
    try:
        exchange = Bench(sampled, plant.period, port, pace(plant.period), number).run(patience, is_stopped)
    finally:
        if collects_garbage:
            gc.enable()
    machine = HostComputer(
        system=f"{platform.system()} {platform.machine()}",
        cores=os.cpu_count() or 1,
        python=platform.python_version(),
        load_before=load_before,
        load_after=_load_now(),
    )
    result = result_of(plant.scenario, plant.run, sampled.result())
    return HardwareRun(plant, result, exchange, machine)


def _load_now() -> float | None:
    """Mean number of running processes over the last minute [-]; None if the system does not provide it."""
    try:
        return os.getloadavg()[0]
    except (AttributeError, OSError):
        return None
