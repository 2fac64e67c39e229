"""``ppafo chip``: a scenario with its controller on the simulator of a small processor."""

import argparse
from typing import TYPE_CHECKING, Any

from ppafo.cli.output import (
    EXIT_CHECK_FAILED,
    EXIT_GOOD,
    add_output_arguments,
    add_override_argument,
    check_output,
    deliver,
)
from ppafo.cli.quick_imports import load_compiler
from ppafo.control.fixed.kind import TARGETS
from ppafo.errors import ScenarioError

if TYPE_CHECKING:
    from ppafo.exports.firmware.lock_step import ChipRun, Comparison, Cost
    from ppafo.simulation.scenario import Scenario

_SHOWN = {"rms_error": ("N m", 1.0), "gas_supplied": ("g", 1.0e3)}
MOST_SAMPLES = 10_000_000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("scenario", metavar="SCENARIO", help="name of a scenario, or a .toml file")
    parser.add_argument("--target", choices=TARGETS, default=TARGETS[0], help=f"the processor (default: {TARGETS[0]})")
    parser.add_argument(
        "--samples",
        metavar="N",
        type=int,
        help="compare N drawn samples with the integer controller instead, with edges, jumps and sensor faults",
    )
    add_override_argument(parser)
    add_output_arguments(parser)


def run(parsed: argparse.Namespace) -> int:
    """Run a scenario with the chip's simulator in charge of the valve; 1 where any decision differs."""
    if parsed.samples is not None and not 1 <= parsed.samples <= MOST_SAMPLES:
        raise ScenarioError(f"--samples {parsed.samples}: must be 1 to {MOST_SAMPLES}")
    check_output(parsed)
    load_compiler()
    from ppafo.exports.firmware.lock_step import compare_drawn, run_on_chip
    from ppafo.simulation.loading import load_scenario

    scenario = load_scenario(parsed.scenario, parsed.overrides)
    if parsed.samples is None:
        found = run_on_chip(scenario)
        text, document, agrees = _of_run(found), _run_document(found), found.same_bits and not found.differences
    else:
        drawn = compare_drawn(scenario, parsed.samples)
        text, document, agrees = _of_drawn(scenario, drawn), _drawn_document(drawn), not drawn.differences
    deliver("chip", text, {"scenario": scenario.name, "target": parsed.target, **document}, parsed)
    return EXIT_GOOD if agrees else EXIT_CHECK_FAILED


def _of_run(found: "ChipRun") -> str:
    """The run in words."""
    lines = [
        f"{found.scenario.name} with the controller on the chip's simulator, the lanes as the plant",
        "",
        *_cost_lines(found.cost, found.scenario),
        f"decisions   {found.samples}, {found.differences} other than those of the integer controller in the lanes",
        f"recording   {'the same bits' if found.same_bits else 'NOT the same bits'} as without the chip",
        *(
            f"{name:<12} {found.chip.metrics[name].value * factor:.4f} {unit}"
            for name, (unit, factor) in _SHOWN.items()
            if name in found.chip.metrics
        ),
    ]
    return "\n".join(lines)


def _of_drawn(scenario: "Scenario", found: "Comparison") -> str:
    """The comparison in words."""
    lines = [
        f"{found.samples} drawn samples of the controller of {scenario.name} on the chip's simulator",
        "",
        *_cost_lines(found.cost, scenario),
        f"decisions   {found.samples}, {found.differences} other than those of the integer controller in Python",
    ]
    return "\n".join([*lines, *([f"the first: {found.first_difference}"] if found.differences else [])])


def _cost_lines(cost: "Cost", scenario: "Scenario") -> list[str]:
    from ppafo.exports.firmware.simulator import CLOCK, FLASH, RAM

    worst, mean = cost.worst_cycles, cost.mean_cycles
    share = worst / CLOCK / scenario.control.period
    return [
        f"flash       {cost.sizes.flash} of {FLASH} bytes, the whole program",
        f"RAM         {cost.sizes.data} bytes of data, {cost.stack} of stack, 4 for the timer's interrupt, of {RAM}",
        f"cycles      {worst} at worst, {mean:.0f} on average; {share:.2%} of a sample at 16 MHz",
    ]


def _cost_document(cost: "Cost") -> dict[str, Any]:
    return {
        "flash": cost.sizes.flash,
        "data": cost.sizes.data,
        "stack": cost.stack,
        "worst_cycles": cost.worst_cycles,
        "mean_cycles": cost.mean_cycles,
    }


def _run_document(found: "ChipRun") -> dict[str, Any]:
    metrics = {name: found.chip.metrics[name].value for name in _SHOWN if name in found.chip.metrics}
    told = {"samples": found.samples, "differences": found.differences, "same_bits": found.same_bits}
    return {**told, **_cost_document(found.cost), "metrics": metrics}


def _drawn_document(found: "Comparison") -> dict[str, Any]:
    return {"samples": found.samples, "differences": found.differences, **_cost_document(found.cost)}
