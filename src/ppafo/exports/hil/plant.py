"""A scenario's plant: the lanes of one run, compiled from C where that can be, whose command comes from outside.

Why in this process and not in one of its own: docs/decisions/0023-hardware-in-the-loop.md.
"""

import os
from dataclasses import dataclass, replace
from types import ModuleType

from ppafo.engine.compilers import BACKEND_VARIABLE, Compiler, chosen_compiler
from ppafo.engine.lanes import load_program_by
from ppafo.engine.run import Run, batch_of
from ppafo.errors import ScenarioError, SimulationError
from ppafo.exports.hil.packets import HIGHEST_RATE, LOWEST_RATE, RATE, sample_length
from ppafo.exports.hil.ports import BITS_OF_A_BYTE
from ppafo.model.valves import dump
from ppafo.simulation.plan import plan_run
from ppafo.simulation.sampled import SampledRun
from ppafo.simulation.scenario import PYTHON_CONTROLLER, Control, Scenario
from ppafo.translation.native import compiler

CHANNELS_SENT = 5


@dataclass(frozen=True, slots=True)
class Plant:
    """A scenario without its controller: how it is run, and what compiled it."""

    scenario: Scenario
    run: Run
    module: ModuleType
    compiled_by: str
    period: float

    def begin(self) -> SampledRun:
        """The plant at its start."""
        return SampledRun(batch_of(self.run), self.module)


def plant_of(scenario: Scenario, rate: int = RATE) -> Plant:
    """The plant of a scenario, whose command is given ``rate`` times a second; a proportional valve can be dumped.

    A compiler of C makes it where there is one and ``PPAFO_BACKEND`` asks for no other.
    """
    if not LOWEST_RATE <= rate <= HIGHEST_RATE:
        raise ScenarioError(f"--rate {rate}: must be {LOWEST_RATE} to {HIGHEST_RATE} samples per second")
    period = 1.0 / rate
    chosen = replace(
        scenario,
        time_step=min(scenario.time_step, period),
        control=Control(PYTHON_CONTROLLER, {}, period),
    )
    run = plan_run(chosen)
    valve = chosen.device.valve
    if valve.kind == "proportional":
        run = replace(run, program=replace(run.program, valve=dump.choose(valve.settings)))
    made_by = _compiler()
    module = load_program_by(batch_of(run).program, made_by)
    return Plant(chosen, run, module, "Numba" if made_by is None else made_by.described(), period)


def _compiler() -> Compiler | None:
    chosen = chosen_compiler()
    if chosen is not None or os.environ.get(BACKEND_VARIABLE):
        return chosen
    try:
        return compiler("c")
    except SimulationError:
        return None


def check_baud(baud: int, rate: int) -> None:
    """Refuse a serial line that cannot carry the samples."""
    needed = sample_length(CHANNELS_SENT) * BITS_OF_A_BYTE * rate
    if baud < needed:
        raise ScenarioError(
            f"--baud {baud}: {rate} samples per second need {needed} baud; take a faster line or a lower --rate, "
            f"here at most {baud // (sample_length(CHANNELS_SENT) * BITS_OF_A_BYTE)}"
        )
