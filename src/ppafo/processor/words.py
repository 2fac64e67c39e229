"""Output of comparisons on a simulated processor: text, data and figure."""

import itertools
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from ppafo.cli.output import EXIT_CHECK_FAILED, EXIT_GOOD, CommandOutput
from ppafo.processor.catalog import target_of
from ppafo.processor.images import missing_tools
from ppafo.processor.lock_step import (
    Cost,
    DecisionComparison,
    ProcessorRun,
    compare_drawn,
    processor_figure,
    run_on_processor,
)
from ppafo.simulation.loading import load_scenario

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SHOWN = {"rms_error": ("N m", 1.0), "gas_supplied": ("g", 1.0e3)}
SAMPLES_OF_TABLE = 1000
"""Default number of samples per controller in the table."""

TABLE = (
    ("pid", "torque-task-proportional", ()),
    ("pid, with filter and anti-windup", "torque-task-anti-windup", ()),
    ("on_off", "torque-task-solenoid", ()),
    ("on_off_dead_zone", "torque-task-proportional", ("controller.kind=on_off_dead_zone",)),
)
"""Controllers of the comparison table, with scenario and overrides."""


def verify_samples(name: str, target: str, samples: int, overrides: Sequence[str]) -> CommandOutput:
    """Compare decisions for random samples on the simulated processor and in Python."""
    scenario = load_scenario(name, overrides)
    comparison = compare_drawn(scenario, samples, target=target)
    lines = [
        f"{comparison.samples} drawn samples of the controller of {scenario.name} on the processor's simulator",
        "",
        *_cost_lines(comparison.cost, scenario.controller.period),
        f"decisions   {comparison.samples}, {comparison.differences} different from the fixed-point controller in "
        "Python",
        *([f"the first: {comparison.first_difference}"] if comparison.differences else []),
    ]
    document = {"scenario": scenario.name, "target": target, **_document(comparison)}
    return _output("\n".join(lines), document, not comparison.differences)


def verify_runs(names: Sequence[str], target: str, overrides: Sequence[str]) -> CommandOutput:
    """Run scenarios with the controller on the simulated processor, and draw them in a figure."""
    runs = [run_on_processor(load_scenario(name, overrides), target) for name in names]
    texts, documents = [], []
    for run in runs:
        metrics = {name: run.processor.metrics[name].value for name in _SHOWN if name in run.processor.metrics}
        lines = [
            f"{run.scenario.name} with the controller on the processor's simulator, ppafo as the plant",
            "",
            *_cost_lines(run.cost, run.scenario.controller.period),
            f"decisions   {run.samples}, {run.differences} different from the fixed-point controller in the simulation",
            f"recording   {'the same bits' if run.same_bits else 'NOT the same bits'} as without the processor",
            *(f"{name:<12} {value * _SHOWN[name][1]:.4f} {_SHOWN[name][0]}" for name, value in metrics.items()),
        ]
        texts.append("\n".join(lines))
        case = {"scenario": run.scenario.name, "target": run.cost.target.name}
        documents.append({**case, **_document(run), "same_bits": run.same_bits, "metrics": metrics})
    return _output(
        "\n\n".join(texts),
        documents[0] if len(documents) == 1 else {"runs": documents},
        all(run.same_bits and not run.differences for run in runs),
        lambda: processor_figure(runs),
    )


def verify_table(targets: Sequence[str], samples: int | None) -> CommandOutput:
    """Compare every controller on every target, as a table."""
    lines = ["| target | controller | flash | data + stack | worst and mean | drawn samples | other decisions |"]
    lines.append("|---|---|---|---|---|---|---|")
    documents: list[dict[str, Any]] = []
    for target, (controller, name, overrides) in itertools.product(map(target_of, targets), TABLE):
        kind, comma, options = controller.partition(",")
        row = f"| {target.name} | `{kind}`{comma}{options} |"
        case = {"target": target.name, "controller": controller}
        missing = missing_tools(target)
        if missing:
            lines.append(f"{row} not run: {', '.join(missing)} is missing | | | | |")
            documents.append({**case, "missing": list(missing)})
            continue
        comparison = compare_drawn(load_scenario(name, overrides), samples or SAMPLES_OF_TABLE, target=target.name)
        cost = comparison.cost
        lines.append(
            f"{row} {cost.sizes.flash:,} | {cost.sizes.data} + {cost.stack} "
            f"| {cost.worst:,}, {cost.mean:,.0f} {target.counted} | {comparison.samples:,} | {comparison.differences} |"
        )
        documents.append({**case, **_document(comparison)})
    return _output("\n".join(lines), {"rows": documents}, not any(item.get("differences") for item in documents))


def _output(
    text: str, document: dict[str, Any], agrees: bool, draw: "Callable[[], Figure] | None" = None
) -> CommandOutput:
    return CommandOutput(text, document, "processor", EXIT_GOOD if agrees else EXIT_CHECK_FAILED, draw=draw)


def _cost_lines(cost: Cost, period: float) -> list[str]:
    target, worst, mean = cost.target, cost.worst, cost.mean
    share = f"{worst / target.clock / period:.2%} of a sample at {target.clock / 1.0e6:g} MHz"
    interrupt = target.interrupt_stack
    return [
        f"flash       {cost.sizes.flash} of {len(target.flash)} bytes, the whole program",
        f"RAM         {cost.sizes.data} bytes of data, {cost.stack} of stack, {interrupt} for the timer's interrupt, "
        f"of {len(target.ram)}",
        f"cycles      {worst} at worst, {mean:.0f} on average; {share}"
        if target.counted == "cycles"
        else f"cycles      not known to the simulator; {worst} {target.counted} at worst, {mean:.0f} on average; "
        f"at one cycle each {share}",
    ]


def _document(run: ProcessorRun | DecisionComparison) -> dict[str, Any]:
    cost = run.cost
    return {
        "samples": run.samples,
        "differences": run.differences,
        "flash": cost.sizes.flash,
        "data": cost.sizes.data,
        "stack": cost.stack,
        f"worst_{cost.target.counted}": cost.worst,
        f"mean_{cost.target.counted}": cost.mean,
    }
