"""The results of a study as a finding: counts, metrics of each configuration, what varied, and a panel a metric."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from ppafo.analyses.sweep.results import SUMMARY, StudyResults
from ppafo.arguments import checked
from ppafo.documents.models import validate
from ppafo.errors import DataError
from ppafo.report.finding import Finding, Part, columns_of, facts, files_of
from ppafo.report.kind import TIME, Kind, of_channel, of_path, of_stored_metric
from ppafo.report.panels import Mark, Panel
from ppafo.report.setting_names import label_of
from ppafo.report.style import BLUE, GREEN, GREY, ORANGE, VERMILION
from ppafo.signals.recording import CHANNELS
from ppafo.storage.places import place_at, read_document
from ppafo.studies.sampling import NOISE
from ppafo.study.manifest import MANIFEST, read_manifest
from ppafo.units.shown import in_units

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FIGURE = "figure"
COLOURS = (BLUE, VERMILION, GREEN, ORANGE, GREY)
MOST_METRICS, MOST_CONFIGURATIONS = 9, len(COLOURS)
MAXIMUM_DRAWN = 4_000_000
"""Runs from which a figure is drawn, spread evenly over all; the numbers beside it are from all of them."""
_COLUMNS, _PANEL, _COMPARED = 3, (3.5, 2.7), (2.6, 2.3)
_HISTOGRAM_BINS = 60
_MAXIMUM_POINTS = 3000
_MEDIAN = 0.5
_OPACITIES = (0.18, 0.32, 0.45)
_GRIDDED = ("grid", "list")
_NAMED = 3
"""Varied values that a title names."""
_CAPTION = (
    "Distributions of the metrics, their dependence on the varied values, and quantiles over time where requested."
)


@in_units(lambda results: results.document.get("shown", {}))
def finding_of(results: StudyResults) -> Finding[StudyResults]:
    """Return the results in words, tables and panels; they have passed where any run completed."""
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
    return Finding(
        name="sweep",
        kicker="Study",
        title=results.name,
        said=(f"{results.name}: {document['runs']:,} runs: {ended}", *_failed_and_oscillating(results)),
        parts=(
            _figure(results, [described] if described else [], failures),
            *(_metrics(results, name, metrics) for name, metrics in results.metrics.items()),
            Part("How to read it", said=[quantile], is_detail=True),
            _varied(document["study"]),
            Part(said=_sampling(document["study"]), is_detail=True),
            _assumed(document["scenarios"]),
            Part("Files", facts(files), is_detail=True),
        ),
        found=results,
        passed=summary["completed"] > 0,
    )


def _failed_and_oscillating(results: StudyResults) -> list[str]:
    """Return how many runs failed, with the first of them, and how many oscillate, by configuration."""
    summary, runs = results.summary, results.document["runs"]
    sentences = [
        f"{runs - summary['completed']:,} of {runs:,} runs failed and have no metrics; the first is run "
        f"{failure['run']}: {failure['reason']}"
        for failure in summary["failures"][:1]
    ]
    return sentences + [
        f"{name}: in {count:,} runs the loop oscillates (column 'oscillates')"
        for name, count in summary.get("oscillating", {}).items()
        if count
    ]


def _varied(study: Mapping[str, Any]) -> Part:
    """Return a row for each number that a study varies: its path, how, and the keys of that."""
    rows = []
    for number in study.get("vary", ()):
        keys = [f"{key.replace('_', ' ')} {value}" for key, value in number.items() if key not in ("path", "kind")]
        rows.append((number["path"], number["kind"], ", ".join(keys)))
    return Part("What varied" if rows else "", columns_of(("path", "kind", ""), rows), left=3, is_detail=True)


def _sampling(study: Mapping[str, Any]) -> list[str]:
    """Return the correlations of what a study draws, and how it draws them."""
    sentences = [
        f"Correlation of {pair['between'][0]} with {pair['between'][1]}: {pair['coefficient']}, of their normal scores."
        for pair in study.get("correlations", ())
    ]
    sample = study.get("sample")
    if sample:
        method, seed = sample["method"].replace("_", " "), sample.get("seed", 1)
        sentences.append(f"Sampled by {method}: {sample['runs']} draws, seed {seed}.")
    return sentences


def _assumed(scenarios: Mapping[str, Any]) -> Part:
    """Return what the base scenarios assume, once where several assume the same."""
    names: dict[tuple[str, str, str], list[str]] = {}
    for name, scenario in scenarios.items():
        for number in scenario["assumptions"]:
            names.setdefault((number["path"], number["value"], number["note"]), []).append(name)
    return Part(
        "What the base scenarios assume" if names else "",
        columns_of(
            ("value", "", "why", "in"), [(*assumption, ", ".join(having)) for assumption, having in names.items()]
        ),
        left=4,
        is_detail=True,
    )


def write_report(results: StudyResults) -> None:
    """Write figure, page and summary beside the results, in a folder that resumes and is known by its ``study.json``.

    No file names the place: the same study makes the same bytes anywhere.
    """
    finding: Finding[Any] = finding_of(results)
    finding = replace(finding, name=Path(SUMMARY).stem, found=results.summary)
    for name, content in files_of(finding).items():
        results.place.write(name, content)


@checked()
def load_study_results(folder: str | Path) -> Finding[StudyResults]:
    """Return the finished results of a study in a folder or at an address; DataError where there are none.

    >>> import ppafo
    >>> written = ppafo.sweep("torque-task-uncertainty", draws=4, out="four")
    >>> ppafo.load_study_results("four").said[0]
    'torque-task-uncertainty: 8 runs: 8 completed'
    """
    location = place_at(folder)
    document = read_manifest(location)
    try:
        summary = read_document(location, SUMMARY)
    except (OSError, ValueError) as error:
        raise DataError(
            f"{location.address}: the study is not finished (no complete {SUMMARY}); run it again to resume"
        ) from error
    whose = f"{location.address}: {SUMMARY} is damaged; run the study again into this folder"
    described = validate(_Summary, summary, whose, DataError)
    names = {configuration["name"] for configuration in document["study"]["configurations"]}
    metrics = [set(own) for own in described.configurations.values()]
    # A configuration or a metric in one of the two documents alone would be looked up in vain.
    is_same = names == described.configurations.keys() == described.completed_by_configuration.keys()
    if not is_same or any(own != document["metrics"].keys() for own in metrics):
        raise DataError(f"{whose}: its configurations and metrics differ from {MANIFEST}")
    return finding_of(StudyResults(location, document, summary))


_Count = Annotated[int, Field(ge=0)]


def _fraction(text: str) -> str:
    if not 0.0 <= float(text) <= 1.0:
        raise ValueError("must be a fraction from 0 to 1")
    return text


class _Part(BaseModel):
    model_config = ConfigDict(strict=True)


class _Described(_Part):
    count: _Count
    mean: float = 0.0
    sd: float = 0.0
    quantiles: dict[Annotated[str, AfterValidator(_fraction)], float] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        if self.count and not {"mean", "quantiles"} <= self.model_fields_set:
            raise ValueError("has values, and no mean or no quantiles")
        return self


class _Failure(_Part):
    run: _Count
    configuration: str
    reason: str


class _Summary(_Part):
    """What everybody may rely on in a summary."""

    completed: _Count
    diverged: _Count
    refused: _Count
    completed_by_configuration: dict[str, _Count]
    oscillating: dict[str, _Count] = Field(default_factory=dict)
    failures: list[_Failure]
    quantile_definition: str
    configurations: dict[str, dict[str, _Described]]


def _metrics(results: StudyResults, name: str, metrics: Mapping[str, Mapping[str, Any]]) -> Part:
    described = [
        description for own in results.metrics.values() for description in own.values() if description["count"]
    ]
    fractions = list(described[0]["quantiles"]) if described else []
    head = ("metric", "unit", "runs", "mean", "sd", *(f"{100 * float(fraction):g} %" for fraction in fractions))
    rows = []
    for metric, description in metrics.items():
        kind = _metric_kind(results, metric)
        cells = [metric, kind.shown_unit, f"{description['count']:,}"]
        if description["count"]:
            deviation = kind.change_number(description["sd"]) if "sd" in description else ""
            cells += [kind.number(description["mean"]), deviation, *map(kind.number, description["quantiles"].values())]
        rows.append([*cells, *[""] * (len(head) - len(cells))])
    completed = f"{name}: {results.summary['completed_by_configuration'][name]:,} runs completed"
    return Part(columns=columns_of(head, rows), said=[completed], left=2)


def _figure(results: StudyResults, said: Sequence[str], remarks: Sequence[str]) -> Part:
    """Return maps for a grid of two axes, points for two values that are drawn, else a panel a metric; and bands."""
    # A metric that no run has would be a hole in the figure, unless no metric has a value.
    wanted = list(results.document["metrics"])
    metrics = ([metric for metric in wanted if _has_values(results, metric)] or wanted)[:MOST_METRICS]
    bands = list(results.document["study"]["outputs"].get("bands", ()))
    # As many configurations as colours that can be told apart; a seed is no axis, since its size says nothing.
    names = results.configurations[:MOST_CONFIGURATIONS]
    device = [path for path in results.varied if path != NOISE]
    is_mapped = len(_grid(results)) == 2 or len(device) == 2
    count = max(1, len(metrics) * (len(names) if is_mapped else 1) + len(bands))
    # Maps of several configurations: a row for each metric.
    is_compared = is_mapped and len(names) > 1
    title = f"{results.name}, {results.summary['completed']:,} runs"
    if not is_mapped and len(device) > 1:
        # Within a sentence: without a capital, unless the label begins with a name in capitals.
        labels = [label_of(path) for path in device[:_NAMED]]
        labels = [label if label[:2].isupper() else label[:1].lower() + label[1:] for label in labels]
        more = f" and {len(device) - _NAMED} more" if len(device) > _NAMED else ""
        title += f" over {len(device)} values: {', '.join(labels)}{more}"

    return Part(
        said=said,
        remarks=remarks,
        panels=partial(_panels, results),
        name=FIGURE,
        caption=_CAPTION,
        across=len(names) if is_compared else 2 if count == 4 else min(_COLUMNS, count),
        size=_COMPARED if is_compared else _PANEL,
        title=title,
        is_detail=True,
    )


def _grid(results: StudyResults) -> list[str]:
    """Return the paths that vary over a grid."""
    return [number["path"] for number in results.document["study"].get("vary", ()) if number["kind"] in _GRIDDED]


def _panels(results: StudyResults) -> list[Panel]:
    """Return a panel for each metric, of each configuration where it is a map, and one for each band."""
    # A metric that no run has would be a hole in the figure, unless no metric has a value.
    wanted = list(results.document["metrics"])
    metrics = ([metric for metric in wanted if _has_values(results, metric)] or wanted)[:MOST_METRICS]
    bands = list(results.document["study"]["outputs"].get("bands", ()))
    names = results.configurations[:MOST_CONFIGURATIONS]
    device, grid = [path for path in results.varied if path != NOISE], _grid(results)
    is_mapped = len(grid) == 2 or len(device) == 2
    is_compared = is_mapped and len(names) > 1
    if is_mapped:
        draw = partial(_map, results, grid) if len(grid) == 2 else partial(_points, results, device)
        drawn = [draw(metric, name, is_compared) for metric in metrics for name in names]
    elif len(device) == 1:
        drawn = [_over(results, device[0], metric, names) for metric in metrics]
    else:
        drawn = [_histogram(results, metric) for metric in metrics]
    drawn += [_band(results, channel, names) for channel in bands]
    # The first panel with curves names the configurations for all.
    named = next((panel for panel in drawn if len(names) > 1 and any(mark.label for mark in panel.marks)), None)
    return [replace(panel, legend="inside" if panel is named else "") for panel in drawn]


def _has_values(results: StudyResults, metric: str) -> bool:
    return any(own[metric]["count"] for own in results.metrics.values())


def _kind(results: StudyResults, path: str) -> Kind:
    return of_path(path, results.document["varied"][path]["unit"].removeprefix("-"))


def _metric_kind(results: StudyResults, metric: str) -> Kind:
    return of_stored_metric(metric, results.document["metrics"][metric]["unit"])


def _histogram(results: StudyResults, metric: str) -> Panel:
    """Return how often each value came, for every configuration."""
    parts = {name: values[np.isfinite(values)] for name, values in results.thin(metric, MAXIMUM_DRAWN).items()}
    filled = [values for values in parts.values() if values.size]
    edges = np.zeros(2)
    if filled:
        low, high = min(float(part.min()) for part in filled), max(float(part.max()) for part in filled)
        is_counted = high - low < _HISTOGRAM_BINS and all(bool(np.all(part == np.round(part))) for part in filled)
        bins = min(_HISTOGRAM_BINS, max(8, round(sum(part.size for part in filled) ** 0.5)))
        # A bin for each whole number where values are counts of few kinds: others would be empty now and then.
        edges = np.arange(low - 0.5, high + 1.0) if is_counted else np.linspace(low, high or low + 1.0, 1 + bins)
    marks = [
        Mark("bars", edges, np.histogram(own, edges)[0], label=name, colour=colour)
        for (name, own), colour in zip(parts.items(), COLOURS, strict=False)
        if filled
    ]
    return Panel(_metric_kind(results, metric), Kind(), marks, then=lambda axes: axes.set_yticks([]))


def _over(results: StudyResults, path: str, metric: str, names: Sequence[str]) -> Panel:
    """Return a metric over the one path that varies."""
    across, values = results.thin(path, MAXIMUM_DRAWN), results.thin(metric, MAXIMUM_DRAWN)
    marks = []
    for name, colour in zip(names, COLOURS, strict=False):
        # Draws come in any order, a line goes from left to right.
        order = np.argsort(across[name], kind="stable")
        order = order[:: max(1, order.size // _MAXIMUM_POINTS)]
        marks.append(
            Mark("line", across[name][order], values[name][order], label=name, colour=colour, style={"marker": "."})
        )
    return Panel(_kind(results, path), _metric_kind(results, metric), marks)


def _map(results: StudyResults, grid: Sequence[str], metric: str, name: str, is_compared: bool) -> Panel:
    """Return the mean of a metric over the two paths, for one configuration; white where no run completed."""
    (columns, column), (rows, row) = (
        np.unique(results.thin(path, MAXIMUM_DRAWN)[name], return_inverse=True) for path in grid
    )
    # A point of the grid may have several draws, some of which failed: the mean of the others.
    values = results.thin(metric, MAXIMUM_DRAWN)[name]
    cell, known = row * columns.size + column, np.isfinite(values)
    count = np.bincount(cell[known], minlength=rows.size * columns.size)
    total = np.bincount(cell[known], weights=values[known], minlength=rows.size * columns.size)
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan).reshape(rows.size, columns.size)
    kind, items = (
        _metric_kind(results, metric),
        {number["path"]: number for number in results.document["study"]["vary"]},
    )
    kinds, places = [], []
    for path, levels in zip(grid, (columns, rows), strict=True):
        of_axis, is_listed = _kind(results, path), items[path]["kind"] == "list"
        # Values of a list are side by side, in cells of the same size.
        kinds.append(Kind(of_axis.axis) if is_listed else of_axis)
        places.append(np.arange(levels.size) if is_listed else levels)

    def mark_axes(axes: "Axes") -> None:
        from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

        axes.grid(visible=False)
        for path, levels, axis in zip(grid, (columns, rows), (axes.xaxis, axes.yaxis), strict=True):
            if items[path]["kind"] == "list":
                shown = _kind(results, path).values(levels)
                axis.set_ticks(np.arange(levels.size), [f"{value:g}" for value in shown])
            elif items[path].get("spacing") == "logarithmic":
                (axes.set_xscale if axis is axes.xaxis else axes.set_yscale)("log")
                # Plain numbers at 1, 2 and 5 of every decade.
                axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
                axis.set_major_formatter(StrMethodFormatter("{x:g}"))
                axis.set_minor_formatter(NullFormatter())

    marks = (Mark("map", places[0], places[1], kind.values(mean)),)
    return Panel(kinds[0], kinds[1], marks, name if is_compared else "", scale=kind, then=mark_axes)


def _points(results: StudyResults, device: Sequence[str], metric: str, name: str, is_compared: bool) -> Panel:
    """Return a metric as the colour of points over the two values that were drawn, for one configuration."""
    most, kind = _MAXIMUM_POINTS * len(results.configurations), _metric_kind(results, metric)
    x, y, values = (results.thin(path, most)[name] for path in (*device, metric))
    marks = (Mark("points", x, y, kind.values(values)),)
    across, upward = (_kind(results, path) for path in device)
    return Panel(across, upward, marks, name if is_compared else "", scale=kind)


def _band(results: StudyResults, channel: str, names: Sequence[str]) -> Panel:
    """Return the bands of a channel for every configuration: the outermost pair of quantiles light, the next darker."""
    table = results.bands()
    # The quantiles that the study asked for are the columns of its file.
    fractions = sorted(float(name[1:]) for name in table if name.startswith("q"))
    pairs = [(low, high) for low, high in zip(fractions, reversed(fractions), strict=True) if low < high]
    marks = []
    for name, colour in zip(names, COLOURS, strict=False):
        own = (table["configuration"] == name) & (table["channel"] == channel)
        for pair, opacity in zip(pairs, _OPACITIES, strict=False):
            ends = np.stack([table[f"q{fraction:g}"][own] for fraction in pair])
            marks.append(Mark("band", table["time"][own], ends, colour=colour, style={"alpha": opacity}))
        if _MEDIAN in fractions:
            marks.append(Mark("line", table["time"][own], table["q0.5"][own], label=name, colour=colour))
    kind = of_channel(channel, CHANNELS[channel].unit)
    percentages = ", ".join(f"{100.0 * fraction:g}" for fraction in fractions)
    title = f"{kind.words}: {percentages} % of runs below"
    return Panel(TIME, kind, marks, then=lambda axes: axes.set_title(title, fontsize=9))
