"""Results of a study, read from its folder on demand: rows, statistics, report and figure.

Statistics use the completed runs that have the metric; their number is stated with each. Mean, standard deviation and
quantiles are exact; one column of one configuration is in memory at a time. The quantile of fraction q of n sorted
values is interpolated linearly at position (n - 1) q: definition 7 of Hyndman and Fan (The American Statistician,
1996). The standard deviation divides by n - 1.
"""

from __future__ import annotations

import hashlib
import math
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from operator import methodcaller
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ppafo.analyses import ask, np
from ppafo.arguments import checked
from ppafo.documents.json_text import plain
from ppafo.errors import DataError, StudyError, UnitError, at_fault, refused_as
from ppafo.report.kind import YES_OR_NO, of_stored_metric
from ppafo.report.style import font_size
from ppafo.signals.recording import CHANNELS
from ppafo.simulation.tracking.rule import ON_PURPOSE
from ppafo.storage.parquet import as_numpy, encode_texts, matrix_of, parquet_bytes
from ppafo.study.blocks import MAXIMUM_RUNS_OF_CHUNK, samples_of
from ppafo.study.runs import FOLLOWS, OSCILLATES, TrackingCounts, joined, tracking_counts
from ppafo.study.store import (
    STATUSES,
    StudyFolder,
    chunk_file,
    read_manifest,
    stored_unit,
    study_folder,
    trace_column,
)
from ppafo.units import from_si
from ppafo.units.shown import in_units, quantity_of_unit
from ppafo.wording import check_known

if TYPE_CHECKING:
    import pandas  # type: ignore[import-untyped]
    import pyarrow as pa
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from ppafo.studies.study import Study

SUMMARY = "summary.json"
BANDS = "bands.parquet"
_EXAMPLES = 5
"""Number of failed runs that the summary names."""
COLOURS = (ask.BLUE, ask.VERMILION, ask.GREEN, ask.ORANGE, ask.GREY)
"""Colours of the configurations in a figure, which has no more of them than that."""
_MAXIMUM_POINTS = 3000
"""Largest number of runs in a curve, or in the points of a panel."""
_HISTOGRAM_BINS = 60
"""Largest number of bins in the histogram of a metric."""


@dataclass(frozen=True, slots=True, repr=False)
class StudyResults:
    """Results of a study in a folder, from which rows are read on demand.

    ``folder``: folder of the results
    ``document``, ``summary``: content of ``study.json`` and of ``summary.json``
    ``kept``: temporary folder, which exists as long as its results are in use; None for a folder of the user
    """

    folder: StudyFolder
    document: Mapping[str, Any]
    summary: Mapping[str, Any]
    kept: tempfile.TemporaryDirectory[str] | None = None

    def __repr__(self) -> str:
        """Return name, number of runs, number of completed runs, and metrics."""
        counted = ", ".join(f"{self.summary[key]:,} {key}" for key in STATUSES)
        return (
            f"StudyResults of '{self.name}' in {self.folder.path}\n  {self.document['runs']:,} runs: {counted}\n  "
            f"varied: {', '.join(self.varied) or 'nothing'}\n  metrics: "
            f"{', '.join(self.document['metrics']) or 'none'}"
        )

    @property
    def name(self) -> str:
        """Name of the study."""
        return str(self.document["study"]["name"])

    @property
    def configurations(self) -> tuple[str, ...]:
        """Names of the configurations of the study."""
        return tuple(configuration["name"] for configuration in self.document["study"]["configurations"])

    @property
    def varied(self) -> tuple[str, ...]:
        """Paths of the varied values of the study."""
        return tuple(self.document["varied"])

    @property
    def metrics(self) -> Mapping[str, Mapping[str, Mapping[str, Any]]]:
        """Statistics by configuration and metric: unit, count, mean, standard deviation, extremes and quantiles."""
        metrics: Mapping[str, Mapping[str, Mapping[str, Any]]] = self.summary["configurations"]
        return metrics

    @checked
    def table(self, columns: Sequence[str] | None = None) -> ask.Rows:
        """Return the rows of all runs, or some of their columns, as arrays by name; SI units, nan for missing values.

        Channels over time are not part of the table; ``trajectories`` returns them.
        """
        # All chunks have the columns of the first.
        known = next(self.chunks()).column_names
        traces = {trace_column(name) for name in CHANNELS}
        for name in columns or ():
            check_known(name, known, StudyError, f"the study has no column '{name}'")
        columns = columns or [name for name in known if name not in traces]
        return joined([as_numpy(part) for part in self.chunks(columns)])

    def to_dataframe(self, units: Mapping[str, str] | None = None) -> pandas.DataFrame:
        """Return the rows of all runs, like ``table``, in SI or in ``units``, such as ``{"supply.pressure": "bar_g"}``.

        ``attrs["units"]`` has the unit of each column; answers such as ``follows`` are booleans. Gauge pressures are
        relative to the standard atmosphere.
        """
        from pandas import DataFrame

        frame = DataFrame(self.table())
        schema = next(self.chunks(list(frame))).schema
        shown = {field.name: (field.metadata or {}).get(b"unit", b"").decode() for field in schema}
        for name, unit in (units or {}).items():
            check_known(name, shown, StudyError, f"the table has no column '{name}'")
            with refused_as(UnitError, f"column '{name}' in '{unit}'", UnitError):
                # Units are affine, so that two values decide all.
                zero, one = (from_si(number, unit, shown[name]) for number in (0.0, 1.0))
            frame[name] = zero + (one - zero) * frame[name]
        # A truth that is not known stays empty.
        frame = frame.astype({name: "boolean" for name in (OSCILLATES, FOLLOWS, ON_PURPOSE) if name in frame})
        frame.attrs = {"title": self.name, "units": shown | dict(units or {})}
        return frame

    def by_configuration(self, column: str) -> ask.Rows:
        """Return a column of all runs, by name of the configuration.

        Runs with the same index have the same draw in all configurations.
        """
        values = self.table([column])[column]
        return dict(zip(self.configurations, np.split(values, len(self.configurations)), strict=True))

    def trajectories(self, channel: str) -> np.ndarray[Any, Any]:
        """Return a stored channel of all runs, shape (runs, samples), nan for failed runs and after a fall."""
        outputs = self.document["study"]["outputs"]
        stored = list(dict.fromkeys([*outputs.get("trajectories", ()), *outputs.get("bands", ())]))
        check_known(channel, stored, StudyError, f"the study stores no trajectories of '{channel}'")
        return self._matrix(channel)

    def bands(self) -> ask.Rows:
        """Return quantile bands over time as columns: configuration, channel, time, and a column for each quantile."""
        return as_numpy(self.folder.table(BANDS, digest=self.summary.get(BANDS)))

    def known(self, configuration: str, column: str) -> ask.Floats:
        """Return the finite values of a column of the runs of a configuration."""
        values = np.concatenate([as_numpy(part)[column] for part in self.chunks([column], configuration)])
        return np.asarray(values[np.isfinite(values)])

    def tracking(self, configuration: str, completed: int) -> TrackingCounts:
        """Return how many ``completed`` runs of a configuration follow their reference, do not, or are beyond reach."""
        rows = {column: self.known(configuration, column) for column in (FOLLOWS, ON_PURPOSE)}
        return tracking_counts(rows, completed)

    def chunks(self, columns: Sequence[str] | None = None, configuration: str | None = None) -> Iterator[pa.Table]:
        """Yield some columns chunk by chunk, of one configuration or of all."""
        # No chunk holds runs of two configurations, and each configuration has the same number of them.
        numbers = range(self.document["chunks"])
        if configuration is not None:
            of_each = len(numbers) // len(self.configurations)
            numbers = numbers[of_each * self.configurations.index(configuration) :][:of_each]
        return (self.folder.table(chunk_file(number), columns) for number in numbers)

    def _matrix(self, channel: str, configuration: str | None = None, samples: slice = slice(None)) -> ask.Floats:
        column = trace_column(channel)
        parts = self.chunks([column], configuration)
        return np.concatenate([matrix_of(part.column(column))[:, samples] for part in parts])

    def json_document(self) -> dict[str, Any]:
        """Return the summary, and the path of the folder."""
        return {**self.summary, "folder": str(self.folder.path)}


@checked
def load_study_results(folder: str | Path) -> ask.Finding[StudyResults]:
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
        summary = stored.document(SUMMARY)
    except (OSError, ValueError) as error:
        raise DataError(
            f"{stored.path}: the study is not finished (there is no complete {SUMMARY}); run it again to resume"
        ) from error
    return finding_of(StudyResults(stored, document, summary))


def studies_of_the_package() -> list[dict[str, Any]]:
    """Return name, number of runs and description of each study of the package."""
    studies = [ask.load_study(name) for name in ask.list_studies()]
    return [{"name": study.name, "runs": study.runs, "description": study.description} for study in studies]


def summarise(study: Study, results: StudyResults) -> StudyResults:
    """Return the results with their summary, after it and the quantile bands were written into the folder.

    The summary has numbers of runs, first failed runs, and statistics of each metric.
    """
    names = results.configurations
    failures = list[dict[str, Any]]()
    completed = dict.fromkeys(names, 0)
    known = results.known
    for name in names:
        for part in results.chunks(["run", "configuration", "status", "reason"], name):
            rows = np.asarray(part.column("status").to_numpy() == STATUSES[0])
            completed[name] += int(np.count_nonzero(rows))
            if len(failures) < _EXAMPLES and not rows.all():
                failures += part.filter(~rows).slice(0, _EXAMPLES - len(failures)).to_pylist()
    # A run that diverged has a time at which it did; one that was refused never began.
    failed = study.runs - sum(completed.values())
    diverged = sum(known(name, "failure_time").size for name in names)
    tracking = {name: results.tracking(name, completed[name]) for name in names}
    summary: dict[str, Any] = {
        "study": study.name,
        **({"overrides": list(study.changes)} if study.changes else {}),
        "runs": study.runs,
        "completed": study.runs - failed,
        "diverged": diverged,
        "refused": failed - diverged,
        "completed_by_configuration": completed,
        "oscillating": {name: int(np.count_nonzero(known(name, OSCILLATES))) for name in names},
        "tracking": {
            each.name: plain(tracking[each.name])
            for each in study.configurations
            if each.scenario.follows_reference or tracking[each.name].without_verdict < completed[each.name]
        },
        "remarks": [*ask.left_out(study)],
        "failures": failures,
        "configurations": {
            name: {
                metric: {"unit": ask.METRICS[metric].unit, "summary": ask.METRICS[metric].summary}
                | describe(known(name, metric), study.outputs.quantiles)
                for metric in study.outputs.metrics
            }
            for name in names
        },
    }
    if study.outputs.bands:
        bands = _bands_file(study, results)
        results.folder.write(BANDS, bands)
        summary[BANDS] = hashlib.sha256(bands).hexdigest()
    # Last, because a study counts as finished once its summary is there.
    results.folder.write_document(SUMMARY, summary)
    return replace(results, summary=summary)


def describe(values: ask.Floats, fractions: Sequence[float]) -> dict[str, Any]:
    """Return count, mean, standard deviation, extremes, and quantiles by fraction.

    Without values there is only the count; the standard deviation needs two values.
    """
    count = values.size
    if count == 0:
        return {"count": 0}
    # Squares about the mean, in a second pass: about 0 they would cancel where the spread is small.
    blocks = np.split(values, range(MAXIMUM_RUNS_OF_CHUNK, count, MAXIMUM_RUNS_OF_CHUNK))
    mean = math.fsum(float(np.sum(block)) for block in blocks) / count
    squares = math.fsum(float(np.sum((block - mean) ** 2)) for block in blocks)
    levels = np.quantile(values, fractions, method="linear").tolist()
    return {
        "count": count,
        "mean": mean,
        **({"sd": math.sqrt(squares / (count - 1))} if count > 1 else {}),
        "minimum": float(values.min()),
        "maximum": float(values.max()),
        "quantiles": dict(zip((f"{fraction:g}" for fraction in fractions), levels, strict=True)),
    }


def _bands_file(study: Study, results: StudyResults) -> bytes:
    """Return the content of ``bands.parquet``: exact quantiles over the runs at each time."""
    outputs = study.outputs
    parts = []
    # Samples are read in blocks of at most so many of all runs, which fit into the memory.
    at_once = max(1, 16_000_000 // study.runs_of_configuration)
    for number, configuration in enumerate(study.configurations):
        samples = samples_of(study, configuration)
        for row, channel in enumerate(outputs.bands):
            for start in range(0, samples, at_once):
                values = results._matrix(channel, configuration.name, slice(start, start + at_once))
                counts = np.count_nonzero(np.isfinite(values), axis=0)
                levels = sorted_quantiles(np.sort(values, axis=0), counts, outputs.quantiles)
                places = {"configuration": np.full(counts.size, number), "channel": np.full(counts.size, row)}
                times = {"time": outputs.every * np.arange(start, start + counts.size), "runs": counts}
                parts.append(
                    {**places, **times, **dict(zip(map("q{:g}".format, outputs.quantiles), levels, strict=True))}
                )
    rows = joined(parts)
    units = {stored_unit(CHANNELS[name].unit) for name in outputs.bands}
    unit = units.pop() if len(units) == 1 else "SI unit of the channel"
    rows["configuration"] = encode_texts(rows["configuration"], results.configurations)
    rows["channel"] = encode_texts(rows["channel"], outputs.bands)
    said = {
        "configuration": ("-", "name of the base scenario"),
        "channel": ("-", "name of the channel"),
        "time": ("s", "time since the start"),
        "runs": ("-", "completed runs, without a fall so far"),
    }
    columns = {name: (values, *said.get(name, (unit, "quantile over runs"))) for name, values in rows.items()}
    return parquet_bytes(columns, {"study": study.name})


def sorted_quantiles(ordered: ask.Floats, counts: NDArray[np.int64], fractions: Sequence[float]) -> ask.Floats:
    """Return quantiles (fractions, columns) of the first ``counts`` values of sorted columns; nan for empty ones."""
    places = np.maximum(counts - 1, 0) * np.asarray(fractions)[:, None]
    low = places.astype(np.int64)
    columns = np.arange(counts.size)
    below = ordered[low, columns]
    above = ordered[np.minimum(low + 1, np.maximum(counts - 1, 0)), columns]
    return np.asarray(below + (places - low) * (above - below), dtype=np.float64)


@in_units(lambda results: results.document["shown"])
def finding_of(results: StudyResults) -> ask.Finding[StudyResults]:
    """Return the results of a study as a finding; passed if enough runs of each configuration completed."""
    document = results.document
    summary = results.summary
    study = results.document["study"]
    runs = document["runs"] // len(results.configurations)
    completed = summary["completed_by_configuration"]
    ended = ", ".join(f"{summary[key]:,} {key}" for key in STATUSES if summary[key])
    said = [f"{results.name}: {document['runs']:,} runs: {ended}"]
    failures = [f"run {each['run']} ({each['configuration']}): {each['reason']}" for each in summary["failures"]]
    for first in summary["failures"][:1]:
        failed = f"{document['runs'] - summary['completed']:,} of {document['runs']:,} runs failed and have no metrics"
        said.append(f"{failed}; the first is run {first['run']}: {first['reason']}")
    for name, count in summary["oscillating"].items():
        share = 100.0 * count / max(completed[name], 1)
        oscillating = f"{name}: in {count:,} of {completed[name]:,} runs ({share:.3g} %) the loop oscillates"
        said += [oscillating] if count else []
    said += [*_tracking_texts(results), *summary.get("remarks", ())]
    # With fewer than half of the runs, the median would be that of the failed ones.
    useless = [name for name, count in completed.items() if 2 * count < runs]
    said += [f"{name}: most runs failed: the statistics of the others do not describe the study" for name in useless]
    rows = []
    for number in study.get("vary", ()):
        keys = (f"{key.replace('_', ' ')} {value}" for key, value in number.items() if key not in ("path", "kind"))
        rows.append((number["path"], number["kind"], ", ".join(keys)))
    varied = ask.columns_of(("path", "kind", ""), rows)
    sampling = [
        f"Correlation of {pair['between'][0]} with {pair['between'][1]}: {pair['coefficient']}, of their normal scores."
        for pair in study.get("correlations", ())
    ]
    if sample := study.get("sample"):
        method = sample["method"].replace("_", " ")
        seed = sample.get("seed", ask.DEFAULT_SEED)
        sampling.append(f"Sampled by {method}: {sample['runs']} draws, seed {seed}.")
    assumed: dict[tuple[str, str, str], list[str]] = {}
    for name, scenario in document["scenarios"].items():
        for number in scenario["assumptions"]:
            assumed.setdefault((number["path"], number["value"], number["note"]), []).append(name)
    assumptions = ask.columns_of(
        ("value", "", "why", "in"), ((*each, ", ".join(names)) for each, names in assumed.items())
    )
    return ask.Finding(
        name="sweep",
        kicker="Study",
        title=results.name,
        said=said,
        parts=(
            replace(_figure(results), remarks=failures),
            *(_metrics(results, name) for name in results.configurations),
            ask.Section("What varied" if rows else "", varied, remarks=sampling, left=3, is_detail=True),
            ask.Section("What the base scenarios assume" if assumed else "", assumptions, left=4, is_detail=True),
        ),
        found=results,
        passed=not useless,
        overrides=document.get("overrides", ()),
    )


def _tracking_texts(results: StudyResults) -> list[str]:
    """Return how many runs of each configuration with a reference follow it, do not, or are beyond reach on purpose."""
    summary = results.summary
    completed = results.summary["completed_by_configuration"]
    # Folders of earlier versions name these configurations elsewhere.
    judged = summary["tracking"] if "tracking" in summary else summary["without_verdict"]
    return [f"{name}: {results.tracking(name, completed[name]).sentence}" for name in judged]


def _metrics(results: StudyResults, name: str) -> ask.Section:
    """Return the table of a configuration's metrics: number of runs, mean, standard deviation and quantiles."""
    described = [each for own in results.metrics.values() for each in own.values() if each["count"]]
    fractions = list(described[0]["quantiles"]) if described else []
    head = ("metric", "unit", "runs", "mean", "sd", *(f"{100 * float(fraction):g} %" for fraction in fractions))
    kinds = _kinds(results)
    rows = []
    for metric, own in results.metrics[name].items():
        kind = kinds[metric]
        cells = [""] * (len(head) - 3)
        if own["count"]:
            deviation = kind.change_number(own["sd"]) if "sd" in own else ""
            cells = [kind.number(own["mean"]), deviation, *map(kind.number, own["quantiles"].values())]
        rows.append([metric, kind.shown_unit, f"{own['count']:,}", *cells])
    completed = f"{name}: {results.summary['completed_by_configuration'][name]:,} runs completed"
    return ask.Section(columns=ask.columns_of(head, rows), said=[completed], left=2)


def _kinds(results: StudyResults) -> dict[str, ask.Kind]:
    """Return the kinds of varied paths and metrics from their stored units, also of a metric that no longer exists."""
    varied = results.document["varied"].items()
    metrics = results.document["metrics"].items()
    return {
        # A column of every study, not a requested metric.
        FOLLOWS: ask.Kind(f"Follows its reference{YES_OR_NO}"),
        **{path: ask.of_path(path, each["unit"].removeprefix("-"), given=each["given"]) for path, each in varied},
        **{name: of_stored_metric(name, each["unit"]) for name, each in metrics},
    }


def _figure(results: StudyResults) -> ask.Section:
    """Return the figure of a study: panels of the metrics, and bands over time.

    A grid of two axes is drawn as maps, two drawn values as coloured points, all else as one panel for each metric.
    """
    study = results.document["study"]
    names = results.configurations[: len(COLOURS)]
    kinds = _kinds(results)
    described = {
        metric: [own[metric] for own in results.metrics.values() if own[metric]["count"]]
        for metric in results.document["metrics"]
    }
    # A metric that no run has would be a hole in the figure, unless no metric has a value.
    with_values = [metric for metric, rows in described.items() if rows]
    chosen: dict[str, str] = {}
    for metric in with_values:
        # A metric with the same displayed digits in all runs, or equal to another, shows no difference.
        if len({kinds[metric].text(row[end]) for row in described[metric] for end in ("minimum", "maximum")}) > 1:
            chosen.setdefault(str(described[metric]), metric)
    differing = list(chosen.values()) or with_values[:1] or list(described)
    # The value of a seed has no meaning.
    varied = [path for path in results.varied if path != ask.NOISE_SEED]
    grid = [number["path"] for number in study.get("vary", ()) if number["kind"] in ("grid", "list")]
    # Over two paths each configuration has a panel of each metric, a map or points; else all share one panel.
    is_mapped = 2 in (len(grid), len(varied))
    is_compared = is_mapped and len(names) > 1
    # More panels would be too low to read.
    most = 2 if is_compared else 4
    # Metrics of a part of the run, such as rms_error_ramp, come after those of the whole run.
    of_part = {metric for metric in differing for whole in differing if metric.startswith(f"{whole}_")}
    metrics = sorted(differing, key=of_part.__contains__)[:most]
    left_out = ", ".join(metric for metric in differing if metric not in metrics)
    constant = ", ".join(metric for metric in with_values if metric not in differing)
    # A map of the verdict, if some runs follow their reference and others do not.
    if is_mapped:
        metrics += [FOLLOWS] if {0.0, 1.0} <= set(results.table([FOLLOWS])[FOLLOWS].tolist()) else []
    title = f"{results.name}, {results.summary['completed']:,} runs"
    title += f" over {len(varied)} values" if not is_mapped and len(varied) > 1 else ""
    count = len(metrics) + len(study["outputs"].get("bands", ()))
    return ask.Section(
        said=[" ".join(study["description"].split())] if study.get("description") else [],
        panels=partial(_panels, results, metrics, names, varied, grid),
        name="figure",
        caption=(f"Not drawn, because without a difference in the runs: {constant}. " if constant else "")
        + (f"Not drawn, unless outputs.metrics names at most {most}: {left_out}. " if left_out else "")
        + (f"{'; '.join(_tracking_texts(results))}." if FOLLOWS in metrics else ""),
        across=len(names) if is_compared else min(2, max(1, count)),
        size=(2.7, 2.3) if is_compared else (2.9, 2.4),
        title=title,
        is_detail=True,
    )


def _panels(
    results: StudyResults, metrics: Sequence[str], names: Sequence[str], varied: Sequence[str], grid: Sequence[str]
) -> list[ask.Panel]:
    """Return a panel for each metric and each band; over two paths, a panel of a metric for each configuration."""
    kinds = _kinds(results)
    panels = []
    for metric in metrics:
        kind = kinds[metric]
        values = results.by_configuration(metric)
        if len(grid) == 2:
            panels += [_map(results, grid, values[name], name, kinds, kind) for name in names]
        elif len(varied) == 2:
            for name in names:
                # An odd step: an even one would see one half of a grid whose last axis has two values.
                step = -(-values[name].size // _MAXIMUM_POINTS) | 1
                x, y = (results.by_configuration(path)[name][::step] for path in varied)
                dots = ask.Mark("points", x, y, kind.values(values[name][::step]))
                panels.append(ask.Panel(kinds[varied[0]], kinds[varied[1]], [dots], scale=kind))
        elif len(varied) == 1:
            across = results.by_configuration(varied[0])
            marks = []
            for name, colour in zip(results.configurations, COLOURS, strict=False):
                # Draws come in any order, a line goes from left to right.
                order = np.argsort(across[name], kind="stable")
                order = order[:: max(1, order.size // _MAXIMUM_POINTS)]
                x = across[name][order]
                y = values[name][order]
                marks.append(ask.Mark("line", x, y, label=name, colour=colour, style={"marker": "."}))
            panels.append(ask.Panel(kinds[varied[0]], kind, marks))
        else:
            panels.append(_histogram(values, kind))
    if 2 in (len(grid), len(varied)) and len(names) > 1:
        panels = [replace(panel, title=names[number % len(names)]) for number, panel in enumerate(panels)]
    panels += [_band(results, channel) for channel in results.document["study"]["outputs"].get("bands", ())]
    # The first panel with curves names the configurations for all.
    with_names = next((panel for panel in panels if len(names) > 1 and any(mark.label for mark in panel.marks)), None)
    return [replace(panel, legend="inside" if panel is with_names else "") for panel in panels]


def _histogram(by_name: ask.Rows, kind: ask.Kind) -> ask.Panel:
    """Return a panel with the histogram of a metric for every configuration."""
    known = {name: values[np.isfinite(values)] for name, values in by_name.items()}
    values = np.concatenate(list(known.values()))
    if not values.size:
        return ask.Panel(kind, ask.Kind(), (), then=methodcaller("set", yticks=[]))
    low = float(values.min())
    high = float(values.max())
    ticks = {}
    if high == low:
        # One bar about the only value.
        edges = low + (abs(low) or 1.0) * np.array([-0.05, 0.05])
        ticks = {"xticks": kind.values(np.array([low]))}
    elif high - low < _HISTOGRAM_BINS and bool(np.all(values == np.round(values))):
        # A bin for each whole number where values are counts of few kinds: others would be empty now and then.
        edges = np.arange(low - 0.5, high + 1.0)
    else:
        edges = np.linspace(low, high, 1 + min(_HISTOGRAM_BINS, max(8, round(values.size**0.5))))
    marks = [
        ask.Mark("bars", edges, np.histogram(own, edges)[0], label=name, colour=colour)
        for (name, own), colour in zip(known.items(), COLOURS, strict=False)
    ]

    def set_ticks(axes: Axes) -> None:
        # Few enough for labels of many digits, such as 0.00025.
        axes.locator_params(axis="x", nbins=5)
        axes.set(yticks=[], **ticks)

    return ask.Panel(kind, ask.Kind(), marks, then=set_ticks)


def _map(
    results: StudyResults,
    grid: Sequence[str],
    values: ask.Floats,
    name: str,
    kinds: dict[str, ask.Kind],
    kind: ask.Kind,
) -> ask.Panel:
    """Return a map of the mean of a metric over two paths for one configuration; white if no run completed."""
    (columns, column), (rows, row) = (
        np.unique(results.by_configuration(path)[name], return_inverse=True) for path in grid
    )
    # A point of the grid may have several draws, some of which failed: the mean of the others.
    cell = row * columns.size + column
    known = np.isfinite(values)
    cells = rows.size * columns.size
    count, total = (np.bincount(cell[known], weights, minlength=cells) for weights in (None, values[known]))
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan).reshape(rows.size, columns.size)
    declared = {number["path"]: number for number in results.document["study"]["vary"]}
    axis_kinds = []
    places = []
    settings = dict[str, Any]()
    for side, path, levels in zip("xy", grid, (columns, rows), strict=True):
        axis_kinds.append(kinds[path])
        places.append(levels)
        if declared[path]["kind"] == "list":
            # Drawn side by side, in cells of equal size, with their values at the ticks.
            axis_kinds[-1] = ask.Kind(kinds[path].axis)
            places[-1] = np.arange(float(levels.size))
            labels = [f"{value:g}" for value in kinds[path].values(levels)]
            settings |= {f"{side}ticks": places[-1], f"{side}ticklabels": labels}
        elif declared[path].get("spacing") == "logarithmic":
            settings[f"{side}scale"] = "log"

    def mark_axes(axes: Axes) -> None:
        axes.grid(visible=False)
        axes.set(**settings)

    marks = [ask.Mark("map", places[0], places[1], kind.values(mean))]
    return ask.Panel(axis_kinds[0], axis_kinds[1], marks, scale=kind, then=mark_axes)


def _band(results: StudyResults, channel: str) -> ask.Panel:
    """Return a panel with the quantile bands of a channel, the outermost pair of quantiles light, the next darker."""
    table = results.bands()
    # The quantiles that the study asked for are the columns of its file.
    fractions = sorted(float(name[1:]) for name in table if name.startswith("q"))
    pairs = [(low, high) for low, high in zip(fractions, reversed(fractions), strict=True) if low < high]
    marks = []
    for name, colour in zip(results.configurations, COLOURS, strict=False):
        rows = (table["configuration"] == name) & (table["channel"] == channel)
        for pair, opacity in zip(pairs, (0.18, 0.32, 0.45), strict=False):
            ends = np.stack([table[f"q{fraction:g}"][rows] for fraction in pair])
            marks.append(ask.Mark("band", table["time"][rows], ends, colour=colour, style={"alpha": opacity}))
        if 0.5 in fractions:
            marks.append(ask.Mark("line", table["time"][rows], table["q0.5"][rows], label=name, colour=colour))
    unit = CHANNELS[channel].unit
    kind = ask.Kind(channel.replace("_", " ").capitalize(), unit, quantity_of_unit(unit))
    title = f"{', '.join(f'{100.0 * fraction:g}' for fraction in fractions)} % of runs below"
    return ask.Panel(ask.TIME, kind, marks, then=lambda axes: axes.set_title(title, fontsize=font_size(9.0)))
