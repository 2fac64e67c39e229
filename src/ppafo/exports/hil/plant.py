"""Plant on the link: the compiled module with a single run and an external command."""

from dataclasses import dataclass, replace

from ppafo.engine.lanes import RunnableProgram, load_program
from ppafo.engine.loading import backend_described
from ppafo.engine.run import Run, batch_of
from ppafo.errors import ScenarioError
from ppafo.exports.hil import wire
from ppafo.exports.hil.ports import BITS_PER_BYTE
from ppafo.model.controlled import TORQUE
from ppafo.parameters.plant import venting_valve
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import PYTHON_CONTROLLER, Control, Scenario, with_control
from ppafo.wording import argument_text

CHANNELS_SENT = 5


@dataclass(frozen=True, slots=True)
class CompiledPlant:
    """Scenario without its controller: run, compiled module, compiler, and sample period [s]."""

    scenario: Scenario
    run: Run
    module: RunnableProgram
    compiled_by: str
    period: float


def plant_of(scenario: Scenario, rate: int = wire.RATE) -> CompiledPlant:
    """Return the plant of a scenario at ``rate`` commands per second; a proportional valve gets a vent valve."""
    if not wire.LOWEST_RATE <= rate <= wire.HIGHEST_RATE:
        limits = f"{wire.LOWEST_RATE} to {wire.HIGHEST_RATE} samples per second"
        raise ScenarioError(f"{argument_text('rate')} {rate}: must be {limits}")
    if scenario.motion.motion_kind.reads_forces:
        raise ScenarioError(
            f"'{scenario.name}' is a walk, but the hardware-in-the-loop link transmits no ground reaction forces; "
            "give a scenario without a walk"
        )
    if scenario.controlled != TORQUE:
        raise ScenarioError(
            f"{scenario.name}: reference.of = '{scenario.controlled}', but the link transmits torque "
            "references only; give a scenario with reference.of = 'torque'"
        )
    period = 1.0 / rate
    chosen = replace(
        with_control(scenario, Control(PYTHON_CONTROLLER, {}, period)),
        # No step may be longer than a sample: a command acts from its sample on.
        run=replace(scenario.run, step=min(scenario.run.step, period)),
    )
    run = plan_run(chosen)
    # A controller at the wire may vent both chambers.
    run = replace(run, program=replace(run.program, valve=venting_valve(chosen.device.valve)))
    module = load_program(batch_of(run).program)
    return CompiledPlant(chosen, run, module, backend_described(), period)


def check_baud(baud: int, rate: int) -> None:
    """Raise ScenarioError if a serial line is too slow for the samples."""
    bits = wire.sample_length(CHANNELS_SENT) * BITS_PER_BYTE
    if baud < bits * rate:
        raise ScenarioError(
            f"{argument_text('baud')} {baud}: {rate} samples per second need {bits * rate} baud; increase baud, "
            f"or reduce {argument_text('rate')} to {baud // bits} or less"
        )
