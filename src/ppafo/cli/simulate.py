"""``ppafo simulate SCENARIO``: runs a scenario and writes a result folder, with a report that simulates."""

import shlex
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ppafo.arguments import Folder, Overrides, Scenario
from ppafo.cli import output
from ppafo.cli.output import EXIT_CHECK_FAILED, EXIT_GOOD, CommandOutput
from ppafo.documents.json_text import json_text, plain
from ppafo.simulation.motion_kind import VANE
from ppafo.units.shown import in_units, shown_in

if TYPE_CHECKING:
    from ppafo.report.finding import Finding
    from ppafo.simulation.check import Check, ErrorEstimate
    from ppafo.simulation.gains import Gains
    from ppafo.simulation.simulate import Result
    from ppafo.simulation.tracking import Tracking

DEFAULT_FOLDER = Path("out")
CHECK_FILE = "check.json"


def simulate(
    scenario: Scenario, *, check: bool = False, overrides: Overrides = (), out: Folder | None = None
) -> CommandOutput:
    """Run a scenario and write its recording, metrics and figure.

    Exit code 1 where it diverged, or a check finds it numerically sensitive, or its reference not followed.

    check: run again with finer steps and from a start moved by 1e-7, and report which metrics can be repeated;
        exit code 1 if one other than a count cannot, or if the reference is not followed
    out: result folder with the report; default out/NAME of the scenario

    >>> print(simulate("step-response", out=Path("step")).text.splitlines()[0])
    step-response: completed
    """
    from ppafo.loading import load_scenario
    from ppafo.storage import check_result_folder

    loaded = load_scenario(scenario, overrides)
    folder = out if out is not None else DEFAULT_FOLDER / loaded.name
    # Before the run, which a folder that is refused must not cost.
    with output.blame_out_option():
        check_result_folder(folder)

    from ppafo.simulation.numbers import changes_in
    from ppafo.simulation.simulate import simulate as run_scenario

    with shown_in(loaded.device.shown):
        report = assessed(run_scenario(loaded), check)
        tracking = report.tracking
        changed = list(changes_in(loaded))
        # A reference that is not followed makes the result useless, and a check fails.
        passes = report.check is None or (report.check.passes and tracking.passes)
        return CommandOutput(
            _text(report),
            {
                "scenario": loaded.name,
                "status": plain(report.result.status),
                "tracking": plain(tracking),
                "gains": plain(report.gains),
                "metrics": {name: plain(metric) for name, metric in report.result.metrics.items()},
                **({"overrides": changed} if changed else {}),
                **({} if report.error is None else {"error": plain(report.error)}),
                **({} if report.check is None else {"check": report.check.document()}),
                "folder": str(folder),
            },
            finish=partial(_write, report, folder),
            exit_code=EXIT_GOOD if report.result.status.is_completed and passes else EXIT_CHECK_FAILED,
            aside="" if report.result.status.is_completed else f"{loaded.name}: {report.result.status.message}",
        )


@dataclass(frozen=True, slots=True)
class _RunReport:
    """Result of a run for its report: repeatability check, estimated error, tracking verdict, sentences, gains."""

    result: "Result"
    check: "Check | None"
    error: "ErrorEstimate | None"
    tracking: "Tracking"
    verdict: list[str]
    gains: "Gains | None"

    @property
    def usage(self) -> list[str]:
        """Command, and file tables, with the remedy that makes the run follow; empty without a remedy."""
        from ppafo.loading import reloaded, usage_text

        mended = self.tracking.mended
        return [usage_text(reloaded(self.result.scenario, mended))] if mended else []


def assessed(result: "Result", check: bool) -> _RunReport:
    """Assess a result for its report; ``check`` runs the scenario again to test its repeatability."""
    from ppafo.counterfactuals import verdict_of
    from ppafo.simulation.gains import gains_of

    scenario = result.scenario
    # A run that diverged has no result to repeat; its exit code says so already.
    repeatability = result.check() if check and result.status.is_completed else None
    error = None if repeatability is None else repeatability.error
    if error is None and result.status.is_completed and scenario.motion.motion_kind.layout == VANE:
        error = result.error()
    verdict = verdict_of(result)
    return _RunReport(result, repeatability, error, verdict, result.sentences(verdict), gains_of(scenario))


def _text(report: _RunReport) -> str:
    """Format status, tracking, metrics, repeatability and gains of a run."""
    from ppafo.report.kind import metrics_lines

    # The result's own text has a verdict whose remedies were not tried.
    head = [f"{report.result.scenario.name}: {report.result.status.kind}", *report.verdict, ""]
    exact = "" if report.error is None else report.error.sentence
    exact = exact if report.check is None else repr(report.check)
    # Gains that are in force are no news: they stand last.
    gains = "" if report.gains is None else report.gains.sentence
    last = [*filter(None, [exact, gains]), *(f"\nCommand with the remedy\n{text}" for text in report.usage)]
    return "\n".join([*head, *metrics_lines(report.result.metrics), *([""] if last else []), *last])


@in_units(lambda report, _folder: report.result.scenario.device.shown)
def _write(report: _RunReport, folder: Path) -> str:
    """Draw figure and page, write the result folder, and return the last lines of text."""
    # Before anything else imports Matplotlib, so that it comes without what it does for others.
    from ppafo.report.style import load_drawing

    load_drawing()
    from ppafo.report.finding import REPORT, page_files
    from ppafo.storage import write_result

    checks = {} if report.check is None else {CHECK_FILE: f"{json_text(report.check.document())}\n".encode()}
    document = {**report.result.to_dict(), "verdict": report.verdict}
    write_result(folder, report.result.recording, document, {**page_files(finding_of(report)), **checks})
    written = ["recording.nc", "recording.csv", "run.json", "figure.png", "figure.svg", REPORT, *checks]
    scenario = report.result.scenario
    lines = ["", f"written: {folder} ({', '.join(written)})"]
    if scenario.motion.motion_kind.layout != VANE:
        command = f"'ppafo walk {shlex.quote(str(scenario.origin.file))}'"
        lines[1:1] = [f"{command} compares it with a walk without device and a healthy ankle"]
    return "\n".join(lines)


def finding_of(report: _RunReport) -> "Finding[None]":
    """Return the content of the report page: metrics and figure."""
    from ppafo.report.finding import Finding, Section, columns_of
    from ppafo.report.kind import metric_text, metric_words

    result = report.result
    check = report.check
    scenario = result.scenario
    status = result.status
    device = f"device '{scenario.device.name}', valve '{scenario.device.valve_name}'"
    rows = [
        (metric_words(name), metric_text(metric.value, metric.unit), metric.summary)
        for name, metric in result.metrics.items()
    ]
    return Finding(
        name="run",
        kicker=f"A run of {scenario.run.duration:g} s",
        title=scenario.name,
        said=(" ".join(scenario.description.split()), device),
        parts=(
            Section(remarks=(*(() if status.is_completed else (f"The run {status.message}",)), *report.verdict)),
            Section("Metrics", columns_of(("Metric", "Value", "The run"), rows), left=3),
            Section(
                "Over time",
                name="figure",
                caption="Channels of the device over time; pressures are gauge pressures.",
                draw=result.plot,
            ),
            Section() if check is None else Section("Repeatability", code=repr(check)),
            Section(remarks=() if report.gains is None else (report.gains.sentence,)),
            *(Section("Command with the remedy", code=text) for text in report.usage),
        ),
        found=None,
    )


def list_descriptions() -> list[dict[str, Any]]:
    """List name and description of each bundled scenario and walk."""
    from ppafo.loading import list_all_scenarios, load_scenario

    return [{"name": name, "description": load_scenario(name).description} for name in list_all_scenarios()]
