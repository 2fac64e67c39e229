"""A scenario's plant: the lanes of one run, whose command comes from outside.

Why in this process and not in one of its own: docs/decisions/0023-hardware-in-the-loop.md.
"""

from dataclasses import dataclass, replace
from types import ModuleType

from ppafo.engine.lanes import load_program
from ppafo.engine.loading import chosen_compiler
from ppafo.engine.run import Run, batch_of
from ppafo.errors import ScenarioError
from ppafo.exports.hil.packets import HIGHEST_RATE, LOWEST_RATE, RATE, sample_length
from ppafo.exports.hil.ports import BITS_OF_A_BYTE
from ppafo.model.valves import dump
from ppafo.simulation.plan import plan_run
from ppafo.simulation.sampled import SampledRun
from ppafo.simulation.scenario import PYTHON_CONTROLLER, Control, Scenario

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
    """The plant of a scenario, whose command is given ``rate`` times a second; a proportional valve can be dumped."""
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
    module = load_program(batch_of(run).program)
    return Plant(chosen, run, module, chosen_compiler().described(), period)


def check_baud(baud: int, rate: int) -> None:
    """Refuse a serial line that cannot carry the samples."""
    needed = sample_length(CHANNELS_SENT) * BITS_OF_A_BYTE * rate
    if baud < needed:
        raise ScenarioError(
            f"--baud {baud}: {rate} samples per second need {needed} baud; take a faster line or a lower --rate, "
            f"here at most {baud // (sample_length(CHANNELS_SENT) * BITS_OF_A_BYTE)}"
        )
