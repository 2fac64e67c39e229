"""The plant at the wire: the compiled module with one run, whose command comes from outside."""

from dataclasses import dataclass, replace

from ppafo.engine.lanes import RunnableProgram, load_program
from ppafo.engine.loading import backend_described
from ppafo.engine.run import Run, batch_of
from ppafo.errors import ScenarioError
from ppafo.exports.hil import wire
from ppafo.model.controlled import TORQUE
from ppafo.parameters.plant import venting_valve
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import PYTHON_CONTROLLER, Control, Scenario, with_control

CHANNELS_SENT = 5


@dataclass(frozen=True, slots=True)
class CompiledPlant:
    """A scenario without its controller: how it is run, and what compiled it."""

    scenario: Scenario
    run: Run
    module: RunnableProgram
    compiled_by: str
    period: float


def plant_of(scenario: Scenario, rate: int = wire.RATE) -> CompiledPlant:
    """The plant of a scenario with ``rate`` commands a second; a proportional valve gets a vent valve."""
    if not wire.LOWEST_RATE <= rate <= wire.HIGHEST_RATE:
        raise ScenarioError(f"--rate {rate}: must be {wire.LOWEST_RATE} to {wire.HIGHEST_RATE} samples per second")
    check_forces(scenario)
    if scenario.controlled != TORQUE:
        raise ScenarioError(
            f"{scenario.name}: reference.of = '{scenario.controlled}': the link transmits torque references only; "
            f"give a scenario with reference.of = 'torque'"
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


def check_forces(scenario: Scenario) -> None:
    """Refuse a scenario whose controller reads what the wire does not carry."""
    if scenario.motion.motion_kind.reads_forces:
        raise ScenarioError(
            f"'{scenario.name}' is a walk; the link transmits no ground reaction forces, so give a scenario without "
            f"a walk"
        )


def check_baud(baud: int, rate: int) -> None:
    """Refuse a serial line that cannot carry the samples."""
    needed = wire.sample_length(CHANNELS_SENT) * wire.BITS_OF_A_BYTE * rate
    if baud < needed:
        raise ScenarioError(
            f"--baud {baud}: {rate} samples per second need {needed} baud; use a faster line, or a --rate of at "
            f"most {baud // (wire.sample_length(CHANNELS_SENT) * wire.BITS_OF_A_BYTE)}"
        )
