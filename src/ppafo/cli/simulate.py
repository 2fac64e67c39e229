"""``ppafo simulate SCENARIO``: runs a scenario and writes a result folder, with a report that simulates."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from ppafo.cli import output
from ppafo.documents.json_text import json_text
from ppafo.errors import ScenarioError

if TYPE_CHECKING:
    from ppafo.answers import Answer
    from ppafo.simulation.accuracy import ErrorEstimate
    from ppafo.simulation.check import Check
    from ppafo.simulation.simulate import Result

DEFAULT_FOLDER = Path("out")
CHECK_FILE = "check.json"
FIGURE = "figure"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument(
        "scenario", metavar="SCENARIO", nargs="?", help="name of a scenario or of a walk, or a .toml file"
    )
    output.add_override_argument(parser)
    parser.add_argument("--list", action="store_true", help="list the scenarios and walks that come with the package")
    parser.add_argument(
        "--check",
        action="store_true",
        help="run again with finer steps and from a start moved by 1e-7, and report which metrics can be repeated",
    )
    output.add_json_argument(parser)
    parser.add_argument(
        "--out", metavar="DIR", type=Path, help="result folder with the report; default out/NAME of the scenario"
    )


def run(parsed: argparse.Namespace) -> int:
    """Run a scenario and say what came of it; 1 where the run diverged, or a check finds it numerically sensitive."""
    if parsed.list:
        return _list(parsed)
    if parsed.scenario is None:
        raise ScenarioError("no scenario was given: name one or give a .toml file; 'ppafo simulate --list' shows them")
    from ppafo.loading import load_scenario
    from ppafo.storage import check_result_folder

    scenario = load_scenario(parsed.scenario, parsed.overrides)
    folder = parsed.out if parsed.out is not None else DEFAULT_FOLDER / scenario.name
    with output.blame_out_option():
        check_result_folder(folder)
    from ppafo.simulation.simulate import simulate

    result = simulate(scenario)
    check = result.check() if parsed.check and result.status.is_completed else None
    error = _error(result) if check is None else check.error
    output.load_drawing()
    from ppafo.answers.recording_figure import figure_files
    from ppafo.answers.writing import REPORT, page_of

    figures = figure_files(result.plot())
    report = page_of(_answer(result, check), {FIGURE: figures[f"{FIGURE}.svg"]})
    checked = {} if check is None else {CHECK_FILE: f"{json_text(check.document())}\n".encode()}
    result.save(folder, {**figures, REPORT: report, **checked})
    from ppafo.simulation.scenario import plain

    metrics = {name: plain(metric) for name, metric in result.metrics.items()}
    document = {
        "scenario": result.scenario.name,
        "status": plain(result.status),
        "metrics": metrics,
        **({} if error is None else {"error": plain(error)}),
        **({} if check is None else {"check": check.document()}),
        "folder": str(folder),
    }
    output.print_result(_text(result, error, check, folder), document, parsed.json)
    if result.status.is_completed:
        return output.EXIT_GOOD if check is None or check.is_determined else output.EXIT_CHECK_FAILED
    print(f"ppafo: {scenario.name}: {result.status.message}", file=sys.stderr)
    return output.EXIT_CHECK_FAILED


def _error(result: "Result") -> "ErrorEstimate | None":
    """Return the estimated error of a vane alone, which runs again in milliseconds; that of a walk is in its check."""
    from ppafo.simulation.scenario import worn_kind

    return result.error() if result.status.is_completed and worn_kind(result.scenario) is None else None


def _answer(result: "Result", check: "Check | None") -> "Answer":
    """Return what the page of a result says: the metrics, the figure, and the run again, to be dragged."""
    from ppafo.answers import Answer, Figure, Section
    from ppafo.live.workbench import live_part

    scenario, status = result.scenario, result.status
    device = f"device '{scenario.device.name}', valve '{scenario.device.valve_name}'"
    changed = f"; values changed for this run: {', '.join(scenario.origin.overrides)}"
    figure = Figure(FIGURE, "What the device does over time. Pressures count from the atmosphere.", result.plot)
    from ppafo.answers import Column, Table
    from ppafo.answers.display_units import metric_level, metric_words

    zero = result.scenario.device.supply.atmospheric_pressure
    shown = {name: metric_level(metric.value, metric.unit, zero) for name, metric in result.metrics.items()}
    rows = [
        (metric_words(name), f"{value:.4g} {unit}".strip(), result.metrics[name].summary)
        for name, (value, unit) in shown.items()
    ]
    return Answer(
        name="run",
        kicker=f"A run of {scenario.duration:g} s",
        title=scenario.name,
        lead=(" ".join(scenario.description.split()), f"{device}{changed if scenario.origin.overrides else ''}"),
        sections=(
            Section(remarks=() if status.is_completed else (f"The run {status.message}",)),
            Section(
                "Metrics", table=Table((Column("Metric"), Column("Value"), Column("What it is")), tuple(rows), left=3)
            ),
            Section("Over time", figure=figure),
            Section() if check is None else Section("What can be repeated", code=repr(check)),
        ),
        data={},
        live=lambda: live_part([scenario]),
    )


def _list(parsed: argparse.Namespace) -> int:
    from ppafo.loading import list_all_scenarios, load_scenario

    summaries = {name: load_scenario(name).description for name in list_all_scenarios()}
    width = max(len(name) for name in summaries)
    text = "\n".join(f"{name:<{width}}  {' '.join(summary.split())}" for name, summary in summaries.items())
    document = {"scenarios": [{"name": name, "description": summary} for name, summary in summaries.items()]}
    output.print_result(text, document, parsed.json)
    return output.EXIT_GOOD


def _text(result: "Result", error: "ErrorEstimate | None", check: "Check | None", folder: Path) -> str:
    from ppafo.simulation.scenario import worn_kind

    checked = [repr(check), ""] if check is not None else [] if error is None else [error.sentence, ""]
    files = ["recording.nc", "recording.csv", "run.json", "figure.png", "figure.svg", "report.html"]
    written = ", ".join(files if check is None else [*files, CHECK_FILE])
    walked = f"'ppafo walk {result.scenario.origin.file}' compares it with no device and with a healthy ankle"
    beside = [] if worn_kind(result.scenario) is None else [walked]
    return "\n".join([str(result), "", *checked, *beside, f"written: {folder} ({written})"])
