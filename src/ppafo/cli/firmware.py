"""``ppafo export firmware``: the controller of a scenario for a small processor, or on the simulator of that one."""

import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ppafo.cli import output
from ppafo.cli.arguments import Count, Folder, Name, Overrides, Scenario
from ppafo.cli.output import Said
from ppafo.errors import ScenarioError, nearest_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ppafo.exports.firmware.lock_step import ChipRun, Comparison, Cost
    from ppafo.simulation.scenario import Scenario as LoadedScenario

_SHOWN = {"rms_error": ("N m", 1.0), "gas_supplied": ("g", 1.0e3)}
MOST_SAMPLES = 10_000_000
SAMPLES_OF_TABLE = 1000


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
) -> Said:
    """Write the controller of a scenario as firmware for a small processor, or run it on the simulator of that one.

    Exit code 1 where any decision on the simulator differs.

    scenarios: name of a scenario, or a .toml file; with --try several
    target: the processor: msp430f2013 (default), cortex-m0 or cortex-m4; with --table all of them
    try_: run the scenario with its controller on the simulator of the processor, and compare every decision
    samples: with --try: compare N drawn samples with the integer controller instead, with edges, jumps and sensor
        faults
    table: with --try: compare every integer controller on every target instead (with 1000 samples each)
    out: the folder to write; with --try text, JSON and figure
    """
    from ppafo.control.fixed.torque_laws import TARGETS

    if target is not None and target not in TARGETS:
        hint = nearest_name(target, TARGETS)
        raise ScenarioError(f"there is no target '{target}'{hint}; available: {', '.join(TARGETS)}")
    if not (try_ or table or samples is not None):
        if len(scenarios) != 1 or out is None:
            raise ScenarioError("give one SCENARIO and --out DIR, or --try; see 'ppafo export firmware --help'")
        return _firmware_of(scenarios[0], target or TARGETS[0], overrides, out)
    if samples is not None and samples > MOST_SAMPLES:
        raise ScenarioError(f"--samples {samples}: must be 1 to {MOST_SAMPLES}")
    if table and (scenarios or overrides):
        raise ScenarioError("--table: takes no SCENARIO or --set; its scenarios are given")
    if not table and not scenarios:
        raise ScenarioError("give a SCENARIO, or --table; see 'ppafo export firmware --help'")
    output.check_output(out, COMMAND)
    if table:
        said = _table(TARGETS if target is None else (target,), samples)
    else:
        said = _tried(scenarios, target or TARGETS[0], samples, overrides)
    if out is not None:
        output.write_files(out, output.said_files(said), COMMAND)
    return said


def _firmware_of(name: str, target: str, overrides: Sequence[str], out: Path) -> Said:
    from ppafo.exports.firmware import firmware
    from ppafo.simulation.loading import load_scenario

    return output.export(
        out,
        COMMAND,
        lambda: firmware(load_scenario(name, overrides), target),
        lambda _: f"make -C {shlex.quote(str(out))}",
        target=target,
    )


def _tried(names: Sequence[str], target: str, samples: int | None, overrides: Sequence[str]) -> Said:
    """Scenarios on one target."""
    from ppafo.simulation.loading import load_scenario

    scenarios = [load_scenario(name, overrides) for name in names]
    if len(scenarios) > 1 and samples is not None:
        raise ScenarioError("several SCENARIOs: are run in turn and drawn in one figure; give one for --samples")
    if samples is None:
        return _runs(scenarios, target)
    from ppafo.exports.firmware.lock_step import compare_drawn

    found = compare_drawn(scenarios[0], samples, target=target)
    about = {"scenario": scenarios[0].name, "target": target}
    return _drawn(found, scenarios[0].name, scenarios[0].control.period, about)


def _said(text: str, document: dict[str, Any], agrees: bool, draw: "Callable[[], Figure] | None" = None) -> Said:
    return Said(text, document, "chip", output.EXIT_GOOD if agrees else output.EXIT_CHECK_FAILED, draw=draw)


def _runs(scenarios: "Sequence[LoadedScenario]", target: str) -> Said:
    """Scenarios with the chip in charge, one after the other, and their figure."""
    from ppafo.exports.firmware.lock_step import chip_figure, run_on_chip

    found = [run_on_chip(scenario, target) for scenario in scenarios]
    texts, documents = [], []
    for one in found:
        metrics = {name: one.chip.metrics[name].value for name in _SHOWN if name in one.chip.metrics}
        lines = [
            f"{one.scenario.name} with the controller on the chip's simulator, the lanes as the plant",
            "",
            *_cost_lines(one.cost, one.scenario.control.period),
            *_compared_lines(one),
            *(f"{name:<12} {value * _SHOWN[name][1]:.4f} {_SHOWN[name][0]}" for name, value in metrics.items()),
        ]
        texts.append("\n".join(lines))
        documents.append(
            {
                "scenario": one.scenario.name,
                "target": one.cost.target.name,
                **_compared(one),
                "same_bits": one.same_bits,
                **_cost_document(one.cost),
                "metrics": metrics,
            }
        )
    return _said(
        "\n\n".join(texts),
        documents[0] if len(documents) == 1 else {"runs": documents},
        all(one.same_bits and not one.differences for one in found),
        lambda: chip_figure(found),
    )


def _drawn(found: "Comparison", name: str, period: float, about: dict[str, Any]) -> Said:
    """Drawn samples on the chip and in Python."""
    lines = [
        f"{found.samples} drawn samples of the controller of {name} on the chip's simulator",
        "",
        *_cost_lines(found.cost, period),
        f"decisions   {found.samples}, {found.differences} other than those of the integer controller in Python",
        *([f"the first: {found.first_difference}"] if found.differences else []),
    ]
    document = {**about, **_compared(found), **_cost_document(found.cost)}
    return _said("\n".join(lines), document, not found.differences)


def _table(targets: Sequence[str], samples: int | None) -> Said:
    """Every controller on every target, as a table."""
    from ppafo.exports.firmware.lock_step import table_rows

    lines = ["| target | controller | flash | data + stack | worst and mean | drawn samples | other decisions |"]
    lines.append("|---|---|---|---|---|---|---|")
    documents = []
    for row in table_rows(targets, samples or SAMPLES_OF_TABLE):
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
        documents.append({**own, **_compared(found), **_cost_document(cost)})
    return _said("\n".join(lines), {"rows": documents}, not any(item.get("differences") for item in documents))


def _compared(found: "ChipRun | Comparison") -> dict[str, Any]:
    return {"samples": found.samples, "differences": found.differences}


def _compared_lines(found: "ChipRun") -> list[str]:
    return [
        f"decisions   {found.samples}, {found.differences} other than those of the integer controller in the lanes",
        f"recording   {'the same bits' if found.same_bits else 'NOT the same bits'} as without the chip",
    ]


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
