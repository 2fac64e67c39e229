"""Results of controllers on the simulator of a processor, in words and as data."""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ppafo.errors import ScenarioError
from ppafo.processor.catalog import target_of
from ppafo.processor.images import missing_tools
from ppafo.processor.lock_step import (
    TRIED,
    Cost,
    DecisionComparison,
    ProcessorRun,
    compare_drawn,
    processor_figure,
    run_on_processor,
)
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Scenario

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SHOWN = {"rms_error": ("N m", 1.0), "gas_supplied": ("g", 1.0e3)}
SAMPLES_OF_TABLE = 1000
"""Samples of each controller in the table, unless another number is given."""


@dataclass(frozen=True, slots=True)
class VerifiedFirmware:
    """Text, document, whether every decision is the integer controller's, and what draws it where it is drawn."""

    text: str
    document: dict[str, Any]
    agrees: bool
    draw: "Callable[[], Figure] | None" = None


def tried(names: Sequence[str], target: str, samples: int | None, overrides: Sequence[str]) -> VerifiedFirmware:
    """Scenarios on one target."""
    scenarios = [load_scenario(name, overrides) for name in names]
    if len(scenarios) > 1 and samples is not None:
        raise ScenarioError("--samples takes one SCENARIO; several are run in turn and drawn in one figure")
    if samples is None:
        return _runs(scenarios, target)
    # Drawn samples on the processor and in Python.
    scenario = scenarios[0]
    comparison = compare_drawn(scenario, samples, target=target)
    lines = [
        f"{comparison.samples} drawn samples of the controller of {scenario.name} on the processor's simulator",
        "",
        *_cost_lines(comparison.cost, scenario.controller.period),
        f"decisions   {comparison.samples}, {comparison.differences} different from the fixed-point controller in "
        "Python",
        *([f"the first: {comparison.first_difference}"] if comparison.differences else []),
    ]
    about = {"scenario": scenario.name, "target": target}
    document = {**about, **_compared(comparison), **_cost_document(comparison.cost)}
    return VerifiedFirmware("\n".join(lines), document, not comparison.differences)


def _runs(scenarios: Sequence[Scenario], target: str) -> VerifiedFirmware:
    """Scenarios with the processor in charge, one after the other, and their figure."""
    runs = [run_on_processor(scenario, target) for scenario in scenarios]
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
        documents.append(
            {
                "scenario": run.scenario.name,
                "target": run.cost.target.name,
                **_compared(run),
                "same_bits": run.same_bits,
                **_cost_document(run.cost),
                "metrics": metrics,
            }
        )
    return VerifiedFirmware(
        "\n\n".join(texts),
        documents[0] if len(documents) == 1 else {"runs": documents},
        all(run.same_bits and not run.differences for run in runs),
        lambda: processor_figure(runs),
    )


def table(targets: Sequence[str], samples: int | None) -> VerifiedFirmware:
    """Every controller on every target, as a table."""
    lines = ["| target | controller | flash | data + stack | worst and mean | drawn samples | other decisions |"]
    lines.append("|---|---|---|---|---|---|---|")
    documents = []
    for target, law in itertools.product(map(target_of, targets), TRIED):
        own: dict[str, Any] = {"target": target.name, "controller": law.said.replace("`", "")}
        missing = missing_tools(target)
        if missing:
            lines.append(f"| {target.name} | {law.said} | not run: {', '.join(missing)} is missing | | | | |")
            documents.append({**own, "missing": list(missing)})
            continue
        scenario = load_scenario(law.scenario, law.overrides)
        comparison = compare_drawn(scenario, samples or SAMPLES_OF_TABLE, target=target.name)
        cost = comparison.cost
        lines.append(
            f"| {target.name} | {law.said} | {cost.sizes.flash:,} | {cost.sizes.data} + {cost.stack} "
            f"| {cost.worst:,}, {cost.mean:,.0f} {target.counted} | {comparison.samples:,} | {comparison.differences} |"
        )
        documents.append({**own, **_compared(comparison), **_cost_document(cost)})
    return VerifiedFirmware(
        "\n".join(lines), {"rows": documents}, not any(document.get("differences") for document in documents)
    )


def _compared(run: ProcessorRun | DecisionComparison) -> dict[str, Any]:
    return {"samples": run.samples, "differences": run.differences}


def _cost_lines(cost: Cost, period: float) -> list[str]:
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


def _cost_document(cost: Cost) -> dict[str, Any]:
    return {
        "flash": cost.sizes.flash,
        "data": cost.sizes.data,
        "stack": cost.stack,
        f"worst_{cost.target.counted}": cost.worst,
        f"mean_{cost.target.counted}": cost.mean,
    }
