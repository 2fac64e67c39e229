"""``ppafo chip``: a scenario or a walk with its controller on the simulator of a small processor."""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ppafo.cli.output import (
    EXIT_CHECK_FAILED,
    EXIT_GOOD,
    add_output_arguments,
    add_override_argument,
    check_output,
    deliver,
)
from ppafo.control.fixed.torque_laws import PLANT_TARGETS, TARGETS, WALK_TARGETS
from ppafo.errors import ScenarioError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ppafo.exports.firmware.lock_step import ChipRun, Comparison, Cost
    from ppafo.exports.firmware.plant import BoardsRun
    from ppafo.exports.firmware.walking.lock_step import WalkOnChip
    from ppafo.simulation.scenario import Scenario

_SHOWN = {"rms_error": ("N m", 1.0), "gas_supplied": ("g", 1.0e3)}
MOST_SAMPLES = 10_000_000
WALK_MINUTES = 0.2
"""How long a walk with the chip in charge is, ten strides at the usual pace."""
SAMPLES_OF_TABLE = 1000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument(
        "scenarios", metavar="SCENARIO", nargs="*", help="name of a scenario or a walk, or a .toml file; or scenarios"
    )
    parser.add_argument(
        "--target",
        choices=(*TARGETS, *WALK_TARGETS),
        help=f"the processor (default: {TARGETS[0]}, of a walk {WALK_TARGETS[0]}; with --table all of scenarios)",
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
    parser.add_argument(
        "--plant",
        choices=PLANT_TARGETS,
        help="let a second simulated chip be the plant, and compare both with the lanes",
    )
    parser.add_argument(
        "--table",
        action="store_true",
        help=f"compare every integer controller on every target instead (with {SAMPLES_OF_TABLE} samples each)",
    )
    add_override_argument(parser)
    add_output_arguments(parser)


def run(parsed: argparse.Namespace) -> int:
    """Run a scenario with the chip's simulator in charge of the valve; 1 where any decision differs."""
    if parsed.samples is not None and not 1 <= parsed.samples <= MOST_SAMPLES:
        raise ScenarioError(f"--samples {parsed.samples}: must be 1 to {MOST_SAMPLES}")
    if parsed.table and (parsed.scenarios or parsed.overrides or parsed.plant or parsed.minutes is not None):
        raise ScenarioError("--table: takes no SCENARIO, --set, --plant or --minutes; its scenarios are given")
    if parsed.table and parsed.target in WALK_TARGETS:
        raise ScenarioError(f"--table: its scenarios run on {', '.join(TARGETS)}; {parsed.target} is for walks")
    if parsed.plant and parsed.samples is not None:
        raise ScenarioError("--plant and --samples: give one of them; drawn samples have no plant")
    if not parsed.table and not parsed.scenarios:
        raise ScenarioError("give a SCENARIO, or --table; see 'ppafo chip --help'")
    check_output(parsed)
    told = _table(parsed) if parsed.table else _one(parsed)
    deliver("chip", told.text, told.document, parsed, told.draw)
    return EXIT_GOOD if told.agrees else EXIT_CHECK_FAILED


@dataclass(frozen=True, slots=True)
class _Told:
    """What came of a command: text, document, whether all decisions are the same, and a figure of runs over time."""

    text: str
    document: dict[str, Any]
    agrees: bool
    draw: "Callable[[], Figure] | None" = None


def _one(parsed: argparse.Namespace) -> _Told:
    """Scenarios or one walk on one target."""
    from ppafo.loading import load_scenario
    from ppafo.simulation.scenario import worn_kind

    every = [load_scenario(name, parsed.overrides) for name in parsed.scenarios]
    if len(every) == 1:
        return _scenario(every[0], parsed) if worn_kind(every[0]) is None else _walk(every[0], parsed)
    scenarios = [chosen for chosen in every if worn_kind(chosen) is None]
    if parsed.plant or parsed.samples is not None or len(scenarios) < len(every):
        raise ScenarioError(
            "several SCENARIOs: are run in turn and drawn in one figure; give one for a walk, --samples or --plant"
        )
    return _runs(scenarios, parsed)


def _target_of(scenario: "Scenario", parsed: argparse.Namespace) -> str:
    target: str = parsed.target or TARGETS[0]
    if target not in TARGETS or parsed.minutes is not None:
        raise ScenarioError(f"{scenario.name}: {', '.join(WALK_TARGETS)} and --minutes are for walks")
    return target


def _runs(scenarios: "Sequence[Scenario]", parsed: argparse.Namespace) -> _Told:
    """Scenarios with the chip in charge, one after the other, and their figure."""
    from ppafo.exports.firmware.lock_step import chip_figure, run_on_chip

    found = [run_on_chip(scenario, _target_of(scenario, parsed)) for scenario in scenarios]
    documents = [{"scenario": one.scenario.name, "target": one.cost.target.name, **_run_document(one)} for one in found]
    return _Told(
        "\n\n".join(map(_of_run, found)),
        documents[0] if len(documents) == 1 else {"runs": documents},
        all(one.same_bits and not one.differences for one in found),
        lambda: chip_figure(found),
    )


def _scenario(scenario: "Scenario", parsed: argparse.Namespace) -> _Told:
    """A scenario on the chip."""
    from ppafo.exports.firmware.lock_step import compare_drawn
    from ppafo.exports.firmware.plant import run_on_two_boards

    target = _target_of(scenario, parsed)
    if parsed.plant:
        both = run_on_two_boards(scenario, target, parsed.plant)
        text, document, agrees = _of_boards(both, target), _boards_document(both), not both.differences
    elif parsed.samples is None:
        return _runs((scenario,), parsed)
    else:
        drawn = compare_drawn(scenario, parsed.samples, target=target)
        text, document, agrees = _of_drawn(scenario, drawn), _drawn_document(drawn), not drawn.differences
    return _Told(text, {"scenario": scenario.name, "target": target, **document}, agrees)


def _walk(configuration: "Scenario", parsed: argparse.Namespace) -> _Told:
    """A walk on the chip."""
    from ppafo.exports.firmware.walking.lock_step import compare_drawn_walk, walk_on_chip

    name, target = configuration.name, parsed.target or WALK_TARGETS[0]
    if parsed.plant:
        raise ScenarioError(f"{name}: --plant is for scenarios; the plant of a walk is the lanes")
    if target not in WALK_TARGETS:
        raise ScenarioError(f"{name}: a walk's controller runs on {', '.join(WALK_TARGETS)}, not on '{target}'")
    if parsed.samples is not None:
        if parsed.minutes is not None:
            raise ScenarioError("--minutes: drawn samples take the place of a walk; leave out one of both")
        drawn = compare_drawn_walk(configuration, parsed.samples)
        head = f"{drawn.samples} drawn samples of the controller of {name} on the chip's simulator"
        lines = [head, "", *_cost_lines(drawn.cost, configuration.control.period), _decisions(drawn, "Python")]
        lines += [f"the first: {drawn.first_difference}"] if drawn.differences else []
        text, document, agrees = "\n".join(lines), _drawn_document(drawn), not drawn.differences
    else:
        found = walk_on_chip(configuration, WALK_MINUTES if parsed.minutes is None else parsed.minutes)
        text, document, agrees = _of_walk(found, configuration), _walk_document(found), found.same_bits
    return _Told(text, {"walk": name, "target": target, **document}, agrees)


def _of_walk(found: "WalkOnChip", configuration: "Scenario") -> str:
    """The walk in words."""
    lines = [
        f"{configuration.name} with the controller on the chip's simulator, the lanes as the plant",
        "",
        *_cost_lines(found.cost, configuration.control.period),
        _decisions(found, "the lanes"),
        f"recording   {'the same bits' if found.same_bits else 'NOT the same bits'} as without the chip",
        f"in the end  {('helps', 'lifts the foot only', 'pauses', 'has stopped')[found.level]}",
        f"gas         {found.gas * 1.0e3:.4f} g",
    ]
    return "\n".join(lines)


def _decisions(found: "WalkOnChip | Comparison", place: str) -> str:
    return f"decisions   {found.samples}, {found.differences} other than those of the integer controller in {place}"


def _walk_document(found: "WalkOnChip") -> dict[str, Any]:
    told = {"samples": found.samples, "differences": found.differences, "same_bits": found.same_bits}
    return {**told, **_cost_document(found.cost), "level": found.level, "gas": found.gas}


def _table(parsed: argparse.Namespace) -> _Told:
    """Every controller on every target, as a table."""
    from ppafo.exports.firmware.lock_step import table_rows

    lines = ["| target | controller | flash | data + stack | worst and mean | drawn samples | other decisions |"]
    lines.append("|---|---|---|---|---|---|---|")
    documents = []
    agrees = True
    targets = TARGETS if parsed.target is None else (parsed.target,)
    for row in table_rows(targets, parsed.samples or SAMPLES_OF_TABLE):
        found, own = row.found, {"target": row.target.name, "controller": row.law.replace("`", "")}
        if found is None:
            lines.append(f"| {row.target.name} | {row.law} | not run: {', '.join(row.missing)} is missing | | | | |")
            documents.append({**own, "missing": list(row.missing)})
            continue
        cost = found.cost
        lines.append(
            f"| {row.target.name} | {row.law} | {cost.sizes.flash:,} | {cost.sizes.data} + {cost.stack} "
            f"| {cost.worst:,}, {cost.mean:,.0f} {row.target.counted} | {found.samples:,} | {found.differences} |"
        )
        documents.append({**own, **_drawn_document(found)})
        agrees = agrees and not found.differences
    return _Told("\n".join(lines), {"rows": documents}, agrees)


def _of_run(found: "ChipRun") -> str:
    """The run in words."""
    lines = [
        f"{found.scenario.name} with the controller on the chip's simulator, the lanes as the plant",
        "",
        *_cost_lines(found.cost, found.scenario.control.period),
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
        *_cost_lines(found.cost, scenario.control.period),
        f"decisions   {found.samples}, {found.differences} other than those of the integer controller in Python",
    ]
    return "\n".join([*lines, *([f"the first: {found.first_difference}"] if found.differences else [])])


def _of_boards(found: "BoardsRun", target: str) -> str:
    """The run of two boards in words."""
    plant, name = found.plant, found.scenario.name
    share = found.worst / plant.clock / found.scenario.control.period
    lines = [
        f"{name} with the controller on a simulated {target}, the plant on a simulated {plant.name}",
        "",
        f"plant       {found.sizes.flash} bytes of flash, {found.sizes.data} of data, {found.stack} of stack",
        f"a sample    {found.worst} {plant.counted} at worst, {found.mean:.0f} on average; "
        f"at one cycle each {share:.2%} of a sample at {plant.clock / 1.0e6:g} MHz",
        f"samples     {found.samples}, {found.differences} with other bits than in the lanes",
        f"compared    {', '.join(found.compared)}",
    ]
    return "\n".join([*lines, *([f"the first: {found.first_difference}"] if found.differences else [])])


def _boards_document(found: "BoardsRun") -> dict[str, Any]:
    work = {f"worst_{found.plant.counted}": found.worst, f"mean_{found.plant.counted}": found.mean}
    plant = {"target": found.plant.name, **found.sizes._asdict(), "stack": found.stack, **work}
    compared = {"samples": found.samples, "differences": found.differences, "compared": list(found.compared)}
    return {**compared, "plant": plant}


def _cost_lines(cost: "Cost", period: float) -> list[str]:
    target, worst, mean = cost.target, cost.worst, cost.mean
    share = f"{worst / target.clock / period:.2%} of a sample at {target.clock / 1.0e6:g} MHz"
    interrupt = target.interrupt_stack
    return [
        f"flash       {cost.sizes.flash} of {target.flash.size} bytes, the whole program",
        f"RAM         {cost.sizes.data} bytes of data, {cost.stack} of stack, {interrupt} for the timer's interrupt, "
        f"of {target.ram.size}",
        f"cycles      {worst} at worst, {mean:.0f} on average; {share}"
        if target.counted == "cycles"
        else f"cycles      not known to the simulator; {worst} {target.counted} at worst, {mean:.0f} on average; "
        f"at one cycle each {share}",
    ]


def _cost_document(cost: "Cost") -> dict[str, Any]:
    return {
        "flash": cost.sizes.flash,
        "data": cost.sizes.data,
        "stack": cost.stack,
        f"worst_{cost.target.counted}": cost.worst,
        f"mean_{cost.target.counted}": cost.mean,
    }


def _run_document(found: "ChipRun") -> dict[str, Any]:
    metrics = {name: found.chip.metrics[name].value for name in _SHOWN if name in found.chip.metrics}
    compared = {"samples": found.samples, "differences": found.differences, "same_bits": found.same_bits}
    return {**compared, **_cost_document(found.cost), "metrics": metrics}


def _drawn_document(found: "Comparison") -> dict[str, Any]:
    return {"samples": found.samples, "differences": found.differences, **_cost_document(found.cost)}
