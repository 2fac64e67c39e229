"""``ppafo chip``: a scenario or a walk with its controller on the simulator of a small processor."""

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
from ppafo.control.fixed.kind import TARGETS, WALK_TARGETS
from ppafo.errors import ScenarioError

if TYPE_CHECKING:
    from ppafo.exports.firmware.lock_step import ChipRun, Comparison, Cost
    from ppafo.exports.firmware.walking.lock_step import WalkOnChip
    from ppafo.simulation.scenario import Scenario
    from ppafo.walking.configuration import Configuration

_SHOWN = {"rms_error": ("N m", 1.0), "gas_supplied": ("g", 1.0e3)}
MOST_SAMPLES = 10_000_000
WALK_MINUTES = 0.2
"""How long a walk with the chip in charge is, ten strides at the usual pace."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("scenario", metavar="SCENARIO", help="name of a scenario or a walk, or a .toml file")
    parser.add_argument(
        "--target",
        choices=(*TARGETS, *WALK_TARGETS),
        help=f"the processor (default: {TARGETS[0]}, of a walk {WALK_TARGETS[0]})",
    )
    parser.add_argument(
        "--minutes", metavar="MINUTES", type=float, help=f"length of a walk (default: {WALK_MINUTES:g}, ten strides)"
    )
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
    from ppafo.exports.loading import load_exportable
    from ppafo.simulation.scenario import Scenario

    chosen = load_exportable(parsed.scenario, parsed.overrides)
    text, document, agrees = _scenario(chosen, parsed) if isinstance(chosen, Scenario) else _walk(chosen, parsed)
    deliver("chip", text, document, parsed)
    return EXIT_GOOD if agrees else EXIT_CHECK_FAILED


def _scenario(scenario: "Scenario", parsed: argparse.Namespace) -> tuple[str, dict[str, Any], bool]:
    """A scenario on the chip: text, document, and whether all decisions are the same."""
    from ppafo.exports.firmware.lock_step import compare_drawn, run_on_chip

    target = parsed.target or TARGETS[0]
    if target not in TARGETS or parsed.minutes is not None:
        raise ScenarioError(f"{scenario.name}: {', '.join(WALK_TARGETS)} and --minutes are for walks")
    if parsed.samples is None:
        found = run_on_chip(scenario)
        text, document, agrees = _of_run(found), _run_document(found), found.same_bits and not found.differences
    else:
        drawn = compare_drawn(scenario, parsed.samples)
        text, document, agrees = _of_drawn(scenario, drawn), _drawn_document(drawn), not drawn.differences
    return text, {"scenario": scenario.name, "target": target, **document}, agrees


def _walk(configuration: "Configuration", parsed: argparse.Namespace) -> tuple[str, dict[str, Any], bool]:
    """A walk on the chip: text, document, and whether all decisions are the same."""
    from ppafo.exports.firmware.walking.lock_step import compare_drawn_walk, walk_on_chip

    name, target = configuration.name, parsed.target or WALK_TARGETS[0]
    if target not in WALK_TARGETS:
        raise ScenarioError(f"{name}: a walk's controller runs on {', '.join(WALK_TARGETS)}, not on '{target}'")
    if parsed.samples is not None:
        if parsed.minutes is not None:
            raise ScenarioError("--minutes: drawn samples take the place of a walk; leave out one of both")
        drawn = compare_drawn_walk(configuration, parsed.samples)
        head = f"{drawn.samples} drawn samples of the controller of {name} on the chip's simulator"
        lines = [head, "", *_walk_cost(drawn.cost, configuration), _decisions(drawn, "Python")]
        lines += [f"the first: {drawn.first_difference}"] if drawn.differences else []
        text, document, agrees = "\n".join(lines), _drawn_document(drawn), not drawn.differences
    else:
        found = walk_on_chip(configuration, WALK_MINUTES if parsed.minutes is None else parsed.minutes)
        text, document, agrees = _of_walk(found, configuration), _walk_document(found), found.same_bits
    return text, {"walk": name, "target": target, **document}, agrees


def _of_walk(found: "WalkOnChip", configuration: "Configuration") -> str:
    """The walk in words."""
    lines = [
        f"{configuration.name} with the controller on the chip's simulator, the lanes as the plant",
        "",
        *_walk_cost(found.cost, configuration),
        _decisions(found, "the lanes"),
        f"recording   {'the same bits' if found.same_bits else 'NOT the same bits'} as without the chip",
        f"in the end  {('helps', 'lifts the foot only', 'pauses', 'has stopped')[found.level]}",
        f"gas         {found.gas * 1.0e3:.4f} g",
    ]
    return "\n".join(lines)


def _decisions(found: "WalkOnChip | Comparison", place: str) -> str:
    return f"decisions   {found.samples}, {found.differences} other than those of the integer controller in {place}"


def _walk_cost(cost: "Cost", configuration: "Configuration") -> list[str]:
    from ppafo.exports.firmware.simulator import CLOCK
    from ppafo.exports.firmware.walking import FLASH, RAM

    worst, mean = cost.worst_cycles, cost.mean_cycles
    share = worst / CLOCK / configuration.period
    return [
        f"flash       {cost.sizes.flash} of {FLASH} bytes, the whole program",
        f"RAM         {cost.sizes.data} bytes of data, {cost.stack} of stack, 4 for the timer's interrupt, of {RAM}",
        f"cycles      {worst} at worst, {mean:.0f} on average; {share:.2%} of a sample at 16 MHz",
    ]


def _walk_document(found: "WalkOnChip") -> dict[str, Any]:
    told = {"samples": found.samples, "differences": found.differences, "same_bits": found.same_bits}
    return {**told, **_cost_document(found.cost), "level": found.level, "gas": found.gas}


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
