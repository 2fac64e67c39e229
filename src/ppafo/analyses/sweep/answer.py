"""Report of a study: number of runs, metrics of each configuration, varied values, panels of the metrics."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, Field, model_validator

from ppafo.analyses.sweep.figure import figure_of
from ppafo.analyses.sweep.results import SUMMARY, StudyResults, metric_kind
from ppafo.arguments import checked
from ppafo.documents.models import validate
from ppafo.errors import DataError, at_fault
from ppafo.report.finding import Finding, Section, columns_of, facts, files_of
from ppafo.storage.result_folder import MANIFEST
from ppafo.studies.declaration import DEFAULT_SEED
from ppafo.study.folder import study_folder
from ppafo.study.manifest import read_manifest
from ppafo.units.shown import in_units

# The summary of a study that is read again: what everybody may rely on in it, beside additional keys.

_Count = Annotated[int, Field(ge=0)]


def _fraction(text: str) -> str:
    """Return a text unchanged if it is a fraction from 0 to 1; ValueError otherwise."""
    if not 0.0 <= float(text) <= 1.0:
        raise ValueError("must be from 0 to 1")
    return text


class _Described(BaseModel, strict=True):
    """Statistics of a metric over the runs of a configuration; ``count`` is the number of runs with a value."""

    count: _Count
    mean: float = 0.0
    sd: float = 0.0
    quantiles: dict[Annotated[str, AfterValidator(_fraction)], float] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        if self.count and not {"mean", "quantiles"} <= self.model_fields_set:
            raise ValueError("has a count, but no mean or no quantiles; run the study again")
        return self


class _Failure(BaseModel, strict=True):
    """Failed run of a study in its summary, with the reason of the failure."""

    run: _Count
    configuration: str
    reason: str


class _Summary(BaseModel, strict=True):
    """Study summary as read from a folder: required fields."""

    completed: _Count
    diverged: _Count
    refused: _Count
    completed_by_configuration: dict[str, _Count]
    oscillating: dict[str, _Count] = Field(default_factory=dict)
    not_following: dict[str, _Count] = Field(default_factory=dict)
    without_verdict: dict[str, _Count] = Field(default_factory=dict)
    failures: list[_Failure]
    quantile_definition: str
    configurations: dict[str, dict[str, _Described]]


@in_units(lambda results: results.document.get("shown", {}))
def finding_of(results: StudyResults) -> Finding[StudyResults]:
    """Return the results of a study as a finding; passed if at least one run completed."""
    document, summary = results.document, results.summary
    ended = ", ".join(f"{summary[key]:,} {key}" for key in ("completed", "diverged", "refused") if summary[key])
    described = " ".join(document["study"].get("description", "").split())
    failures = [
        f"run {failure['run']} ({failure['configuration']}): {failure['reason']}" for failure in summary["failures"]
    ]
    quantile = f"Quantile: {summary['quantile_definition']}. Only completed runs that have the metric are counted."
    files = (
        ("rows of all runs", "runs/*.parquet"),
        ("summary", SUMMARY),
        ("study", f"study.json, sha256 {document['sha256'][:16]}"),
    )
    rows = []
    for number in document["study"].get("vary", ()):
        keys = [f"{key.replace('_', ' ')} {value}" for key, value in number.items() if key not in ("path", "kind")]
        rows.append((number["path"], number["kind"], ", ".join(keys)))
    sampling = [
        f"Correlation of {pair['between'][0]} with {pair['between'][1]}: {pair['coefficient']}, of their normal scores."
        for pair in document["study"].get("correlations", ())
    ]
    sample = document["study"].get("sample")
    if sample:
        method, seed = sample["method"].replace("_", " "), sample.get("seed", DEFAULT_SEED)
        sampling.append(f"Sampled by {method}: {sample['runs']} draws, seed {seed}.")
    return Finding(
        name="sweep",
        kicker="Study",
        title=results.name,
        said=(f"{results.name}: {document['runs']:,} runs: {ended}", *_useless_runs(results)),
        parts=(
            figure_of(results, [described] if described else [], failures),
            *(_metrics(results, name, metrics) for name, metrics in results.metrics.items()),
            Section("How to read it", said=[quantile], is_detail=True),
            Section("What varied" if rows else "", columns_of(("path", "kind", ""), rows), left=3, is_detail=True),
            Section(said=sampling, is_detail=True),
            _assumed(document["scenarios"]),
            Section("Files", facts(files), is_detail=True),
        ),
        found=results,
        passed=summary["completed"] > 0,
        overrides=document.get("overrides", ()),
    )


def _useless_runs(results: StudyResults) -> list[str]:
    """Return sentences on failed runs, and by configuration on runs that oscillate or do not follow the reference."""
    summary, runs, study = results.summary, results.document["runs"], results.document["study"]
    # Two drawn numbers of which one limits the other.
    reasons, fixed = [failure["reason"] for failure in summary["failures"][:1]], (None, "same_as", "grid", "list")
    rows = [table["path"] for table in study.get("vary", ()) if table.get("kind") not in fixed]
    both = [path for path in rows if any(f"{path} = " in reason for reason in reasons)]
    tie = f"; to vary both by one factor, give proportional ranges, and [[correlations]] of {both} with coefficient = 1"
    sentences = [
        f"{runs - summary['completed']:,} of {runs:,} runs failed and have no metrics; the first is run "
        f"{failure['run']}: {failure['reason']}{tie * (len(both) == 2 and not study.get('correlations'))}"
        for failure in summary["failures"][:1]
    ]
    flags = (
        ("oscillating", "the loop oscillates (column 'oscillates')"),
        ("not_following", "the reference is not followed (column 'follows')"),
        ("without_verdict", "it is not known whether the reference is followed (column 'follows' is empty)"),
    )
    without = summary.get("without_verdict", {})
    return sentences + [
        f"{name}: in {count:,} of {completed:,} runs ({100.0 * count / max(completed, 1):.3g} %) {words}"
        for key, words in flags
        for name, completed in summary["completed_by_configuration"].items()
        # Where some runs have a verdict, 0 is news too.
        if (count := summary.get(key, {}).get(name, 0))
        or (key == "not_following" and without.get(name, completed) < completed)
    ]


def _assumed(scenarios: Mapping[str, Any]) -> Section:
    """Return a table of the assumptions of the base scenarios, without duplicates."""
    names: dict[tuple[str, str, str], list[str]] = {}
    for name, scenario in scenarios.items():
        for number in scenario["assumptions"]:
            names.setdefault((number["path"], number["value"], number["note"]), []).append(name)
    return Section(
        "What the base scenarios assume" if names else "",
        columns_of(
            ("value", "", "why", "in"), [(*assumption, ", ".join(having)) for assumption, having in names.items()]
        ),
        left=4,
        is_detail=True,
    )


def _metrics(results: StudyResults, name: str, metrics: Mapping[str, Mapping[str, Any]]) -> Section:
    """Return the table of a configuration's metrics: number of runs, mean, standard deviation and quantiles."""
    described = [
        description for own in results.metrics.values() for description in own.values() if description["count"]
    ]
    fractions = list(described[0]["quantiles"]) if described else []
    head = ("metric", "unit", "runs", "mean", "sd", *(f"{100 * float(fraction):g} %" for fraction in fractions))
    rows = []
    for metric, description in metrics.items():
        kind = metric_kind(results, metric)
        cells = [metric, kind.shown_unit, f"{description['count']:,}"]
        if description["count"]:
            deviation = kind.change_number(description["sd"]) if "sd" in description else ""
            cells += [kind.number(description["mean"]), deviation, *map(kind.number, description["quantiles"].values())]
        rows.append([*cells, *[""] * (len(head) - len(cells))])
    completed = f"{name}: {results.summary['completed_by_configuration'][name]:,} runs completed"
    return Section(columns=columns_of(head, rows), said=[completed], left=2)


def write_sweep_report(results: StudyResults) -> None:
    """Write figure, page and summary into the folder of the results.

    No file contains the path of the folder, so the same study gives the same bytes anywhere.
    """
    finding: Finding[Any] = finding_of(results)
    finding = replace(finding, name=Path(SUMMARY).stem, found=results.summary)
    for name, content in files_of(finding).items():
        results.folder.write(name, content)


@checked
def load_study_results(folder: str | Path) -> Finding[StudyResults]:
    """Return the finished results of a study in a folder; DataError if the folder contains none.

    >>> import ppafo
    >>> written = ppafo.sweep("torque-task-uncertainty", draws=4, out="four")
    >>> ppafo.load_study_results("four").said[0]
    'torque-task-uncertainty: 8 runs: 8 completed'
    """
    stored = study_folder(folder)
    with at_fault("folder"):
        document = read_manifest(stored)
    try:
        summary: dict[str, Any] = stored.read_document(SUMMARY)
    except (OSError, ValueError) as error:
        raise DataError(
            f"{stored.path}: the study is not finished (there is no complete {SUMMARY}); run it again to resume"
        ) from error
    whose = f"{stored.path}: {SUMMARY} is damaged; run the study again into this folder"
    described = validate(_Summary, summary, whose, DataError)
    names = {configuration["name"] for configuration in document["study"]["configurations"]}
    # A configuration or a metric in one of the two documents alone would be looked up in vain.
    has_same_names = names == described.configurations.keys() == described.completed_by_configuration.keys()
    metrics = document["metrics"].keys()
    if not has_same_names or any(table.keys() != metrics for table in described.configurations.values()):
        raise DataError(
            f"{whose}: the configurations and metrics are not the same as in {MANIFEST}; run the study again"
        )
    return finding_of(StudyResults(stored, document, summary))
