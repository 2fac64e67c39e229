"""``ppafo simulate SCENARIO``: runs a scenario and writes a result folder, with a report that simulates."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ppafo.arguments import Folder, Overrides, Scenario
from ppafo.cli import output
from ppafo.cli.output import EXIT_CHECK_FAILED, EXIT_GOOD, CommandOutput
from ppafo.documents.json_text import json_text
from ppafo.units.shown import in_units

if TYPE_CHECKING:
    from ppafo.report.finding import Finding
    from ppafo.simulation.check import Check, ErrorEstimate
    from ppafo.simulation.scenario import Scenario as Configured
    from ppafo.simulation.simulate import Result

DEFAULT_FOLDER = Path("out")
CHECK_FILE = "check.json"
FIGURE = "figure"


def simulate(
    scenario: Scenario, *, check: bool = False, overrides: Overrides = (), out: Folder | None = None
) -> CommandOutput:
    """Run a scenario and write its recording, metrics and figure.

    Exit code 1 where it diverged, or a check finds it numerically sensitive, or its reference not followed.

    check: run again with finer steps and from a start moved by 1e-7, and report which metrics can be repeated
    out: result folder with the report; default out/NAME of the scenario

    >>> print(simulate("step-response", out=Path("step")).text.splitlines()[0])
    step-response: completed
    """
    from ppafo.loading import load_scenario
    from ppafo.storage import check_result_folder

    chosen = load_scenario(scenario, overrides)
    folder = out if out is not None else DEFAULT_FOLDER / chosen.name
    # Before the run, which a folder that is refused must not cost.
    with output.blame_out_option():
        check_result_folder(folder)
    return _run(chosen, folder, check)


@in_units(lambda scenario, *_: scenario.device.shown)
def _run(chosen: "Configured", folder: Path, check: bool) -> CommandOutput:
    from ppafo.running import gains, tried
    from ppafo.simulation.simulate import simulate
    from ppafo.simulation.tracking.pair_step import warn_of_coarse_pairs

    warn_of_coarse_pairs([chosen])
    result = simulate(chosen)
    in_force, verdict = gains(chosen), tried(chosen, result.tracking)
    # A run that diverged has no result to repeat; its exit code says so already.
    checked = result.check() if check and result.status.is_completed else None
    error = None if checked is None else checked.error
    if checked is None and result.status.is_completed and chosen.motion.motion_kind.is_repeated_for_its_error:
        error = result.error()
    follows = list(filter(None, [result.following if verdict is None else verdict.sentence]))
    # Gains that are in force are no news: they stand last.
    tuned = [] if in_force is None else [in_force.sentence]
    from ppafo.documents.json_text import plain

    metrics = {name: plain(metric) for name, metric in result.metrics.items()}
    document = {
        "scenario": result.scenario.name,
        "status": plain(result.status),
        "tracking": None if verdict is None else {**plain(verdict), "sentence": verdict.sentence},
        "gains": plain(in_force),
        "metrics": metrics,
        **({} if error is None else {"error": plain(error)}),
        **({} if checked is None else {"check": checked.document()}),
        "folder": str(folder),
    }
    # A reference that is not followed makes the result useless, and a check fails.
    is_useful = verdict is None or not verdict.is_useless
    is_good = result.status.is_completed and (checked is None or (checked.is_determined and is_useful))
    return CommandOutput(
        _text(result, error, checked, follows, tuned),
        document,
        finish=partial(_write, result, checked, follows, tuned, folder),
        exit_code=EXIT_GOOD if is_good else EXIT_CHECK_FAILED,
        aside="" if result.status.is_completed else f"{chosen.name}: {result.status.message}",
    )


def _finding(result: "Result", check: "Check | None", follows: Sequence[str], tuned: Sequence[str]) -> "Finding[None]":
    """Return the content of a result page: metrics, figure, and the interactive run."""
    from ppafo.report.display_units import metric_text, metric_words
    from ppafo.report.finding import Finding, Section, columns_of
    from ppafo.report.live_parts import live_part

    scenario, status = result.scenario, result.status
    device = f"device '{scenario.device.name}', valve '{scenario.device.valve_name}'"
    changed = f"; values changed for this run: {', '.join(scenario.origin.overrides)}"
    caption = "What the device does over time. Pressures count from the atmosphere."
    rows = [
        (metric_words(name), metric_text(metric.value, metric.unit), metric.summary)
        for name, metric in result.metrics.items()
    ]
    return Finding(
        name="run",
        kicker=f"A run of {scenario.run.duration:g} s",
        title=scenario.name,
        said=(" ".join(scenario.description.split()), f"{device}{changed if scenario.origin.overrides else ''}"),
        parts=(
            Section(remarks=(*(() if status.is_completed else (f"The run {status.message}",)), *follows)),
            Section("Metrics", columns_of(("Metric", "Value", "What it is"), rows), left=3),
            Section("Over time", name=FIGURE, caption=caption, draw=result.plot),
            Section() if check is None else Section("What can be repeated", code=repr(check)),
            Section(remarks=tuned),
        ),
        found=None,
        live=lambda: live_part([scenario]),
    )


def list_descriptions() -> list[dict[str, Any]]:
    """Return name and description of each bundled scenario and walk."""
    from ppafo.loading import list_all_scenarios, load_scenario

    return [{"name": name, "description": load_scenario(name).description} for name in list_all_scenarios()]


@in_units(lambda result, *_: result.scenario.device.shown)
def _write(result: "Result", check: "Check | None", follows: Sequence[str], tuned: Sequence[str], folder: Path) -> str:
    """Draw the figure and the page, write the result folder, and return the last lines of text."""
    # Before anything else imports Matplotlib, so that it comes without what it does for others.
    from ppafo.report.drawing import load_drawing

    load_drawing()
    from ppafo.report.finding import REPORT, page_of
    from ppafo.report.recording_figure import figure_files

    figures = figure_files(result.plot())
    report = page_of(_finding(result, check, follows, tuned), {FIGURE: figures[f"{FIGURE}.svg"]})
    checks = {} if check is None else {CHECK_FILE: f"{json_text(check.document())}\n".encode()}
    result.save(folder, {**figures, REPORT: report, **checks})
    files = ["recording.nc", "recording.csv", "run.json", "figure.png", "figure.svg", REPORT]
    written = ", ".join(files if check is None else [*files, CHECK_FILE])
    further = result.scenario.motion.motion_kind.further_command(str(result.scenario.origin.file))
    return "\n".join(["", *([further] if further else []), f"written: {folder} ({written})"])


@in_units(lambda result, *_: result.scenario.device.shown)
def _text(
    result: "Result",
    error: "ErrorEstimate | None",
    check: "Check | None",
    follows: Sequence[str],
    tuned: Sequence[str],
) -> str:
    """Return status, tracking error, metrics, their repeatability, and gains of a run as text."""
    from ppafo.report.display_units import metrics_lines

    exact = [repr(check)] if check is not None else [] if error is None else [error.sentence]
    last = ["", *exact, *tuned] if exact or tuned else []
    # The result's own text has a verdict whose remedies were not tried.
    head = [f"{result.scenario.name}: {result.status.kind}", *follows, ""]
    return "\n".join([*head, *metrics_lines(result.metrics), *last])
