"""``ppafo export firmware``: the controller of a scenario for a small processor."""

import shlex
from collections.abc import Sequence

from ppafo.arguments import Count, Folder, Name, Overrides, Scenario
from ppafo.cli import output
from ppafo.cli.output import CommandOutput
from ppafo.errors import ScenarioError
from ppafo.wording import argument_text

MOST_SAMPLES = 10_000_000
"""Largest number of random samples in a comparison."""


COMMAND = "export firmware"


def export_firmware(
    scenarios: Sequence[Scenario] = (),
    *,
    target: Name | None = None,
    try_: bool = False,
    samples: Count | None = None,
    table: bool = False,
    overrides: Overrides = (),
    out: Folder | None = None,
) -> CommandOutput:
    """Write the controller of a scenario as firmware for a small processor, or run it on the simulator of that one.

    Exit code 1 where any decision on the simulator differs.

    scenarios: name of a scenario, or a .toml file; with --try several
    target: the processor: msp430f2013 (default), cortex-m0 or cortex-m4; with --table all of them
    try_: run the scenario with its controller on the simulator of the processor, and compare every decision
    samples: with --try: compare N drawn samples with the integer controller instead, with edges, jumps and sensor
        faults
    table: with --try: compare every integer controller on every target instead (with 1000 samples each)
    out: the folder to write; with --try text, JSON and figure

    >>> from pathlib import Path
    >>> print(export_firmware(["torque-task-solenoid"], out=Path("firmware")).text)
    written: firmware (LICENSE, Makefile, README.md, board.h, board_msp430f2013.c, board_simulated.c, controller.c,
    controller.h, host.c, main.c, msp430.h, msp430f2013.ld, parameters.h, start_msp430.c); next: make -C firmware
    """
    from ppafo.processor.catalog import TARGETS, target_of

    chosen = target_of(target or TARGETS[0]).name
    trial = argument_text("try_", option="--try")
    if not (try_ or table or samples is not None):
        if len(scenarios) != 1 or out is None:
            raise ScenarioError(f"give one scenario and {argument_text('out')}, or {trial}")
        from ppafo.processor.firmware import firmware
        from ppafo.simulation.loading import load_scenario

        return output.export(
            out,
            COMMAND,
            lambda: firmware(load_scenario(scenarios[0], overrides), chosen),
            lambda _: f"make -C {shlex.quote(str(out))}",
            target=chosen,
        )
    if not (scenarios or table):
        raise ScenarioError(f"{trial} needs a scenario, or {argument_text('table')}")
    if table and (scenarios or overrides):
        sets = argument_text("overrides", option="--set")
        raise ScenarioError(f"{argument_text('table')} runs a fixed list of scenarios; omit the scenario and {sets}")
    if samples is not None and samples > MOST_SAMPLES:
        raise ScenarioError(f"{argument_text('samples', str(samples))}: must be 1 to {MOST_SAMPLES}")
    if samples is not None and len(scenarios) > 1:
        raise ScenarioError(
            f"{argument_text('samples')} needs exactly one scenario; omit it to plot several scenarios together"
        )
    output.check_output(out, COMMAND)
    from ppafo.processor import words

    if table:
        answer = words.verify_table(TARGETS if target is None else (chosen,), samples)
    elif samples is not None:
        answer = words.verify_samples(scenarios[0], chosen, samples, tuple(overrides))
    else:
        answer = words.verify_runs(scenarios, chosen, tuple(overrides))
    if out is not None:
        output.write_files(out, output.files_of_output(answer), COMMAND)
    return answer
