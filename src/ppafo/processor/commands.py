"""``ppafo export firmware``: the controller of a scenario for a small processor."""

import shlex
from typing import TYPE_CHECKING

from ppafo.arguments import Count, Folder, Overrides
from ppafo.arguments import Scenario as ScenarioName
from ppafo.cli import output
from ppafo.cli.output import EXIT_CHECK_FAILED, EXIT_GOOD, CommandOutput
from ppafo.errors import ScenarioError
from ppafo.wording import argument_text

if TYPE_CHECKING:
    pass

MOST_SAMPLES = 50_000
"""Largest number of drawn samples in a comparison."""
COMMAND = "export firmware"


def export_firmware(
    scenario: ScenarioName,
    *,
    try_: bool = False,
    samples: Count | None = None,
    overrides: Overrides = (),
    out: Folder | None = None,
) -> CommandOutput:
    """Write the controller of a scenario as firmware for an MSP430F2013, or try it on a simulator of this processor.

    Exit code 1 where any decision on the simulator differs.

    scenario: name of a scenario, or a .toml file
    try_: compare decisions on the simulator mspdebug with the integer controller, for drawn samples
    samples: with --try: number of samples, with edges, jumps and sensor faults among them; default 1000
    out: the folder to write; with --try text and JSON

    >>> from pathlib import Path
    >>> print(export_firmware("torque-task-solenoid", out=Path("firmware")).text)
    written: firmware (LICENSE, Makefile, README.md, board.h, board_msp430f2013.c, board_simulated.c, controller.c,
    controller.h, host.c, main.c, msp430f2013.ld, parameters.h, start_msp430.c); next: make -C firmware
    """
    from ppafo.processor.firmware import firmware
    from ppafo.simulation.loading import load_scenario

    chosen = load_scenario(scenario, overrides)
    if not (try_ or samples is not None):
        if out is None:
            raise ScenarioError(f"give {argument_text('out')}, or {argument_text('try_', option='--try')}")
        return output.export(out, COMMAND, lambda: firmware(chosen), lambda _: f"make -C {shlex.quote(str(out))}")
    output.check_output(out, COMMAND)
    from ppafo.processor.simulated import CLOCK, FLASH, INTERRUPT_STACK, RAM, try_firmware

    samples = samples or 1000
    if samples > MOST_SAMPLES:
        raise ScenarioError(f"{argument_text('samples', str(samples))}: must be 1 to {MOST_SAMPLES}")
    trial = try_firmware(chosen, samples)
    share = trial.worst_cycles / CLOCK / chosen.controller.period
    lines = [
        f"the controller of {chosen.name} on mspdebug, the simulator of an MSP430",
        "",
        f"flash      {trial.flash} of {FLASH} bytes, the whole program",
        f"RAM        {trial.ram} of {RAM} bytes, data and stack; {INTERRUPT_STACK} more for the timer's interrupt",
        f"cycles     {trial.worst_cycles} at worst, {trial.mean_cycles:.0f} on average; {share:.2%} of a sample at "
        f"{CLOCK / 1.0e6:g} MHz",
        f"decisions  {samples} drawn samples, {trial.differences} different from the fixed-point controller in Python",
        *([f"the first  {trial.first_difference}"] if trial.differences else []),
    ]
    document = {"scenario": chosen.name, **trial._asdict()}
    exit_code = EXIT_CHECK_FAILED if trial.differences else EXIT_GOOD
    answer = CommandOutput("\n".join(lines), document, "processor", exit_code)
    if out is not None:
        output.write_files(out, output.files_of_output(answer), COMMAND)
    return answer
