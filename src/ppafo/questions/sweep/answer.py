"""The results of a study and their answer: counts, metrics of each configuration, what varied, the figure."""

import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import (
    axis_unit,
    display_difference,
    display_value,
    display_values,
    metric_quantity,
    metric_title,
    metric_unit,
    quantity_of_unit,
)
from ppafo.answers.setting_names import label_of
from ppafo.answers.style import BLUE, GREEN, GREY, ORANGE, VERMILION, house_style, mark_kind
from ppafo.answers.writing import files_of
from ppafo.errors import DataError, StudyError, nearest_name
from ppafo.questions.question import Solved
from ppafo.questions.sweep.manifest import RUNS_FOLDER, TRAJECTORIES_FOLDER, chunk_file
from ppafo.signals.recording import CHANNELS
from ppafo.storage.parquet import as_numpy, read_parquet
from ppafo.storage.places import Place
from ppafo.studies.distributions import Floats
from ppafo.studies.sampling import NOISE

if TYPE_CHECKING:
    import matplotlib.figure
    import pyarrow as pa
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.cm import ScalarMappable
    from matplotlib.layout_engine import ConstrainedLayoutEngine

SUMMARY = "summary.json"
BANDS = "bands.parquet"
Columns = dict[str, np.ndarray[Any, Any]]


@dataclass(frozen=True, slots=True, repr=False)
class StudyResults(Solved):
    """The results of a study: ``document`` is its ``study.json``, ``summary`` its ``summary.json``.

    ``kept`` holds a temporary folder as long as its results are used; None for a folder of one's own.
    """

    place: Place
    document: Mapping[str, Any]
    summary: Mapping[str, Any]
    kept: tempfile.TemporaryDirectory[str] | None = None

    def __repr__(self) -> str:
        """Return name, runs, how many completed, and the metrics."""
        counted = ", ".join(f"{self.summary[key]:,} {key}" for key in ("completed", "diverged", "refused"))
        return (
            f"StudyResults of '{self.name}' in {self.place.address}\n  {self.document['runs']:,} runs: {counted}\n  "
            f"varied: {', '.join(self.varied) or 'nothing'}\n  metrics: "
            f"{', '.join(self.document['metrics']) or 'none'}"
        )

    @property
    def name(self) -> str:
        """Name of the study."""
        return str(self.document["study"]["name"])

    @property
    def configurations(self) -> tuple[str, ...]:
        """Names of the configurations."""
        return tuple(item["name"] for item in self.document["study"]["configurations"])

    @property
    def varied(self) -> tuple[str, ...]:
        """The varied paths."""
        return tuple(self.document["varied"])

    @property
    def metrics(self) -> Mapping[str, Mapping[str, Mapping[str, Any]]]:
        """For each configuration and metric: unit, count, mean, standard deviation, extremes and quantiles."""
        found: Mapping[str, Mapping[str, Mapping[str, Any]]] = self.summary["configurations"]
        return found

    def table(self, columns: Sequence[str] | None = None) -> Columns:
        """Return the rows of all runs, or some columns of them, as arrays by name; SI units, nan where none."""
        parts = [as_numpy(part) for part in self.chunks(RUNS_FOLDER, columns)]
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    def by_configuration(self, column: str) -> dict[str, np.ndarray[Any, Any]]:
        """Return a column of all runs, by name of the configuration; runs of the same place got the same draw."""
        values = self.table([column])[column]
        return dict(zip(self.configurations, np.split(values, len(self.configurations)), strict=True))

    def trajectories(self, channel: str) -> np.ndarray[Any, Any]:
        """Return a kept channel of all runs, shape (runs, samples), nan where a run failed and after a fall."""
        kept = self.document["study"]["outputs"].get("trajectories", ())
        if channel not in kept:
            raise StudyError(
                f"no trajectories of '{channel}' were kept{nearest_name(channel, kept)}; available: {kept}"
            )
        rows = [row for part in self.chunks(TRAJECTORIES_FOLDER, [channel]) for row in part.column(channel).to_numpy()]
        return np.stack(rows)

    def bands(self) -> Columns:
        """Return the bands: configuration, channel, time and a column for each quantile."""
        return as_numpy(read_parquet(self.place.open(BANDS), BANDS))

    def thin(self, column: str, maximum: int) -> dict[str, np.ndarray[Any, Any]]:
        """Return a column by name of the configuration, of about ``maximum`` runs in all: every so many of them."""
        step = -(-int(self.document["runs"]) // maximum) | 1
        return {name: self._every(name, column, step) for name in self.configurations}

    def _every(self, configuration: str, column: str, step: int) -> np.ndarray[Any, Any]:
        parts, first = [], 0
        for table in self.chunks(RUNS_FOLDER, [column], configuration):
            parts.append(table.column(column).to_numpy()[first::step])
            first = (first - table.num_rows) % step
        return np.concatenate(parts)

    def parts(self, configuration: str, column: str) -> Iterator[np.ndarray[Any, Any]]:
        """Give the finite values of a column of a configuration, chunk by chunk."""
        for table in self.chunks(RUNS_FOLDER, [column], configuration):
            values = table.column(column).to_numpy()
            yield values[np.isfinite(values)]

    def chunks(
        self, folder: str, columns: Sequence[str] | None = None, configuration: str | None = None
    ) -> "Iterator[pa.Table]":
        """Give the tables of the chunks one after the other, of all configurations or of one."""
        numbers = range(self.document["chunks"])
        if configuration is not None:
            own = len(numbers) // len(self.configurations)
            start = own * self.configurations.index(configuration)
            numbers = numbers[start : start + own]
        for number in numbers:
            name = chunk_file(folder, number)
            try:
                yield read_parquet(self.place.open(name), name, columns)
            except (DataError, OSError) as error:
                raise DataError(
                    f"{self.place.address}/{name}: is missing or damaged; run the study again into this folder to "
                    "recompute this chunk"
                ) from error


COLOURS = (BLUE, VERMILION, GREEN, ORANGE, GREY)
MOST_METRICS, MOST_CONFIGURATIONS = 9, len(COLOURS)
_COLUMNS, _PANEL, _COMPARED = 3, (3.5, 2.7), (2.6, 2.3)
_HISTOGRAM_BINS = 60
_MAXIMUM_POINTS = 3000
_MEDIAN = 0.5
_OPACITIES = (0.18, 0.32, 0.45)
MAXIMUM_DRAWN = 4_000_000
"""Runs from which a figure is drawn, spread evenly over all; the numbers beside it are from all of them."""
_GRIDDED = ("grid", "list")
_NAMED = 3
"""Varied values that a title names."""


def study_figure(results: StudyResults) -> "matplotlib.figure.Figure":
    """Return maps for a grid of two axes, otherwise a panel a metric; and a panel for each band."""
    import matplotlib.figure

    metrics = list(results.document["metrics"])[:MOST_METRICS]
    bands = list(results.document["study"]["outputs"].get("bands", ()))
    names = results.configurations[:MOST_CONFIGURATIONS]
    device = [path for path in results.varied if path != NOISE]
    is_grid = len(_grid_paths(results)) == 2
    # Two values that vary are the axes of every panel: as a map where they are a grid, else as points.
    is_mapped = is_grid or len(device) == 2
    panels = len(metrics) * (len(names) if is_mapped else 1)
    count = max(1, panels + len(bands))
    # Maps of several configurations: a row for each metric.
    is_compared = is_mapped and len(names) > 1
    columns = len(names) if is_compared else 2 if count == 4 else min(_COLUMNS, count)
    rows = -(-count // columns)
    width, height = _COMPARED if is_compared else _PANEL
    with house_style():
        figure = matplotlib.figure.Figure(figsize=(width * columns + 0.3, height * rows + 0.7), layout=_layout())
        grid = figure.subplots(rows, columns, squeeze=False)
        places = list(grid.flat)
        if is_mapped:
            _draw_mapped(places, results, metrics, names, _draw_map if is_grid else _draw_points)
        else:
            for axes, metric in zip(places, metrics, strict=False):
                if len(device) == 1:
                    _draw_over(axes, results, device[0], metric)
                else:
                    _draw_histogram(axes, results, metric)
        for axes, channel in zip(places[panels:], bands, strict=False):
            _draw_bands(axes, results, channel, dict(zip(names, COLOURS, strict=False)))
        for axes in places[panels + len(bands) :]:
            axes.set_axis_off()
        from matplotlib.lines import Line2D

        title = f"{results.name}, {results.summary['completed']:,} runs"
        if not is_mapped and len(device) > 1:
            title += (
                f" over {len(device)} values: {', '.join(_in_a_sentence(label_of(path)) for path in device[:_NAMED])}"
            )
            title += f" and {len(device) - _NAMED} more" if len(device) > _NAMED else ""
        figure.suptitle(title, x=0.01, ha="left", fontsize=11, wrap=True)
        if not is_mapped and len(names) > 1:
            handles = [Line2D([], [], color=colour) for colour in COLOURS[: len(names)]]
            figure.legend(handles, names, loc="outside lower center", ncols=len(names))
        mark_kind(figure, "simulated")
        return figure


def _in_a_sentence(label: str) -> str:
    """Return a label without its capital, but for a name in capitals."""
    return label if label[:2].isupper() else label[:1].lower() + label[1:]


def _layout() -> "ConstrainedLayoutEngine":
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    return ConstrainedLayoutEngine(w_pad=0.12, h_pad=0.08)


def _draw_histogram(axes: "Axes", results: StudyResults, metric: str) -> None:
    """Draw how often each value came, for every configuration."""
    parts = {name: _metric_values(metric, values) for name, values in results.thin(metric, MAXIMUM_DRAWN).items()}
    parts = {name: values[np.isfinite(values)] for name, values in parts.items()}
    axes.set_xlabel(metric_title(metric))
    axes.set_yticks([])
    filled = [values for values in parts.values() if values.size]
    if not filled:
        return
    edges = _edges(filled)
    for (name, own), colour in zip(parts.items(), COLOURS, strict=False):
        counts, _ = np.histogram(own, edges)
        axes.stairs(counts, edges, fill=True, color=colour, alpha=0.35)
        axes.stairs(counts, edges, color=colour, linewidth=1.2, label=name)


def _edges(parts: list[Floats]) -> Floats:
    """Return the edges of the bins: one for each whole number where values are counts of few kinds."""
    low, high = min(float(part.min()) for part in parts), max(float(part.max()) for part in parts)
    if high - low < _HISTOGRAM_BINS and all(bool(np.all(part == np.round(part))) for part in parts):
        return np.arange(low - 0.5, high + 1.0)
    size = sum(part.size for part in parts)
    return np.linspace(low, high or low + 1.0, 1 + min(_HISTOGRAM_BINS, max(8, round(size**0.5))))


def _draw_over(axes: "Axes", results: StudyResults, path: str, metric: str) -> None:
    """Draw a metric over the one path that varies."""
    across, values = results.thin(path, MAXIMUM_DRAWN), results.thin(metric, MAXIMUM_DRAWN)
    for name, colour in zip(results.configurations, COLOURS, strict=False):
        order = np.argsort(across[name], kind="stable")
        order = order[:: max(1, order.size // _MAXIMUM_POINTS)]
        shown = _path_for_display(results, path, across[name][order])[1]
        axes.plot(shown, _metric_values(metric, values[name])[order], ".-", color=colour, label=name)
    axes.set_xlabel(_path_for_display(results, path, np.zeros(1))[0])
    axes.set_ylabel(metric_title(metric))


def _draw_mapped(
    places: "Sequence[Axes]",
    results: StudyResults,
    metrics: Sequence[str],
    names: Sequence[str],
    draw: "Callable[[Axes, StudyResults, str, str], ScalarMappable]",
) -> None:
    """Draw a panel for each metric and configuration; those of a metric have one scale of colours."""
    for row, metric in enumerate(metrics):
        panels = places[row * len(names) : (row + 1) * len(names)]
        mapped = [draw(axes, results, name, metric) for axes, name in zip(panels, names, strict=True)]
        limits = np.array([panel.get_clim() for panel in mapped], dtype=np.float64)
        limits = limits[np.isfinite(limits).all(axis=1)]
        for panel in mapped if limits.size else ():
            panel.set_clim(float(limits[:, 0].min()), float(limits[:, 1].max()))
        bar = panels[0].figure.colorbar(mapped[0], ax=panels, pad=0.02)
        if len(names) == 1:
            panels[0].set_title(metric_title(metric))
            continue
        bar.set_label(metric_title(metric))
        for axes, name in zip(panels, names, strict=True):
            axes.set_title(name)
        for axes in panels[1:]:
            axes.set_ylabel("")


def _draw_map(axes: "Axes", results: StudyResults, name: str, metric: str) -> "ScalarMappable":
    """Draw the mean of a metric over the two paths, for one configuration; white where no run completed."""
    across, upward = _grid_paths(results)
    columns, column = np.unique(results.thin(across, MAXIMUM_DRAWN)[name], return_inverse=True)
    rows, row = np.unique(results.thin(upward, MAXIMUM_DRAWN)[name], return_inverse=True)
    values = _metric_values(metric, results.thin(metric, MAXIMUM_DRAWN)[name])
    place = row * columns.size + column
    places = rows.size * columns.size
    known = np.isfinite(values)
    count = np.bincount(place[known], minlength=places)
    total = np.bincount(place[known], weights=values[known], minlength=places)
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan).reshape(rows.size, columns.size)
    shown = (_path_for_display(results, across, columns), _path_for_display(results, upward, rows))
    places_of = []
    for path, (label, values), axis in zip((across, upward), shown, (axes.xaxis, axes.yaxis), strict=True):
        axis.set_label_text(label)
        # Values of a list are side by side, in cells of the same size.
        places_of.append(np.arange(values.size) if _is_listed(results, path) else values)
    mesh = axes.pcolormesh(*places_of, mean, shading="nearest", rasterized=True, cmap="cividis")
    axes.grid(visible=False)
    for path, (_, values), axis in zip((across, upward), shown, (axes.xaxis, axes.yaxis), strict=True):
        if _is_listed(results, path):
            axis.set_ticks(np.arange(values.size), [f"{value:g}" for value in values])
        elif _is_logarithmic(results, path):
            (axes.set_xscale if axis is axes.xaxis else axes.set_yscale)("log")
            _mark_plainly(axis)
    return mesh


def _draw_points(axes: "Axes", results: StudyResults, name: str, metric: str) -> "ScalarMappable":
    """Draw a metric as the colour of points over the two values that were drawn, for one configuration."""
    across, upward = (path for path in results.varied if path != NOISE)
    columns = [
        results.thin(path, _MAXIMUM_POINTS * len(results.configurations))[name] for path in (across, upward, metric)
    ]
    (x_label, x), (y_label, y) = (
        _path_for_display(results, path, column) for path, column in zip((across, upward), columns, strict=False)
    )
    points = axes.scatter(
        x, y, c=_metric_values(metric, columns[2]), s=9, linewidths=0, cmap="cividis", rasterized=True
    )
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    return points


def _grid_paths(results: StudyResults) -> list[str]:
    return [item["path"] for item in results.document["study"].get("vary", ()) if item["kind"] in _GRIDDED]


def _is_logarithmic(results: StudyResults, path: str) -> bool:
    items = {item["path"]: item for item in results.document["study"]["vary"]}
    return bool(items[path].get("spacing") == "logarithmic")


def _is_listed(results: StudyResults, path: str) -> bool:
    items = {item["path"]: item for item in results.document["study"]["vary"]}
    return bool(items[path]["kind"] == "list")


def _mark_plainly(axis: "Axis") -> None:
    """Put plain numbers at 1, 2 and 5 of every decade."""
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())


def _draw_bands(axes: "Axes", results: StudyResults, channel: str, colours: Mapping[str, str]) -> None:
    """Draw the bands of a channel for every configuration: the outermost pair of quantiles light, the next darker."""
    table, unit = results.bands(), CHANNELS[channel].unit
    quantity = quantity_of_unit(unit)
    levels = {name: display_values(values, quantity) for name, values in table.items() if name.startswith("q")}
    fractions = sorted(float(name[1:]) for name in levels)
    pairs = [(low, high) for low, high in zip(fractions, reversed(fractions), strict=True) if low < high]
    for name, colour in colours.items():
        own = (table["configuration"] == name) & (table["channel"] == channel)
        time = table["time"][own]
        for (low, high), opacity in zip(pairs, _OPACITIES, strict=False):
            axes.fill_between(
                time, levels[f"q{low:g}"][own], levels[f"q{high:g}"][own], color=colour, alpha=opacity, linewidth=0
            )
        if _MEDIAN in fractions:
            axes.plot(time, levels["q0.5"][own], color=colour, label=name)
    axes.set_xlabel("Time (s)")
    label = channel.replace("_", " ").capitalize()
    axes.set_ylabel(_axis_label(label, quantity, unit))
    percentages = ", ".join(f"{100.0 * fraction:g}" for fraction in fractions)
    axes.set_title(f"{label}: {percentages} % of runs below", fontsize=9)


def _metric_values(name: str, values: Floats) -> Floats:
    return display_values(values, metric_quantity(name))


def _path_for_display(results: StudyResults, path: str, values: Floats) -> tuple[str, Floats]:
    """Return label and values of a varied path [SI] in the units of the field."""
    unit = results.document["varied"][path]["unit"]
    quantity = quantity_of_unit(unit)
    return _axis_label(label_of(path), quantity, unit), display_values(values, quantity)


def _axis_label(name: str, quantity: str, unit: str) -> str:
    """Return a name with the unit in which it is drawn: that of its quantity, else its own."""
    drawn = axis_unit(quantity) if quantity else unit.removeprefix("-")
    return f"{name} ({drawn})" if drawn not in {"", "1"} else name


FIGURE = "figure"
_HEAD = ("metric", "unit", "runs", "mean", "sd")


def answer_of(results: StudyResults) -> Answer:
    """Return the answer of a sweep; it has passed where any run completed."""
    described = " ".join(results.document["study"].get("description", "").split())
    failed = [f"run {item['run']} ({item['configuration']}): {item['reason']}" for item in results.summary["failures"]]
    caption = (
        "Distributions of the metrics, their dependence on the varied values, and quantiles over time where requested."
    )
    rows = tuple(_varied_row(item) for item in results.document["study"].get("vary", ()))
    study = results.document["study"]
    said = [
        f"Correlation of {item['between'][0]} with {item['between'][1]}: {item['coefficient']}, of their normal scores."
        for item in study.get("correlations", ())
    ]
    sample = study.get("sample")
    if sample:
        method, seed = sample["method"].replace("_", " "), sample.get("seed", 1)
        said.append(f"Sampled by {method}: {sample['runs']} draws, seed {seed}.")
    facts = (
        ("rows of all runs", "runs/*.parquet"),
        ("summary", SUMMARY),
        ("study", f"study.json, sha256 {results.document['sha256'][:16]}"),
    )
    return Answer(
        name="sweep",
        kicker="Study",
        title=results.name,
        lead=(f"{results.name}: {count_sentence(results)}", *_failure_remarks(results)),
        sections=(
            (
                Section(
                    paragraphs=(described,) if described else (),
                    remarks=tuple(failed),
                    figure=Figure(FIGURE, caption, lambda: study_figure(results)),
                    is_detail=True,
                )
            ),
            *(_metrics(results, name, metrics) for name, metrics in results.metrics.items()),
            Section(
                "How to read it",
                (
                    f"Quantile: {results.summary['quantile_definition']}. Only completed runs that have the metric "
                    "are counted.",
                ),
                is_detail=True,
            ),
            _detail("What varied", ("path", "kind", ""), rows),
            Section(paragraphs=tuple(said), is_detail=True),
            _assumptions_section(results),
            Section("Files", table=Table((), facts), is_detail=True),
        ),
        data={**results.summary, "folder": results.place.address},
        passed=results.summary["completed"] > 0,
    )


def write_report(results: StudyResults) -> None:
    """Write figure, page and summary beside the results, in a folder that resumes and is known by its ``study.json``.

    No file names the place: the same study makes the same bytes anywhere.
    """
    answer = replace(answer_of(results), name=Path(SUMMARY).stem, data=results.summary)
    for name, content in files_of(answer).items():
        results.place.write(name, content)


def count_sentence(results: StudyResults) -> str:
    """Return how many runs there are and how they ended."""
    parts = [f"{results.summary[key]:,} {key}" for key in ("completed", "diverged", "refused") if results.summary[key]]
    return f"{results.document['runs']:,} runs: {', '.join(parts)}"


def metric_cells(name: str, item: Mapping[str, Any], columns: int) -> tuple[str, ...]:
    """Return the cells of a metric in shown units; empty where no run has it."""
    quantity = metric_quantity(name)
    first = (name, metric_unit(name), f"{item['count']:,}")
    if item["count"] == 0:
        return (*first, *[""] * (columns - len(first)))
    deviation = f"{display_difference(item['sd'], quantity):.3g}" if "sd" in item else ""
    quantiles = (f"{display_value(value, quantity):.4g}" for value in item["quantiles"].values())
    return (*first, f"{display_value(item['mean'], quantity):.4g}", deviation, *quantiles)


def _failure_remarks(results: StudyResults) -> list[str]:
    runs, completed = results.document["runs"], results.summary["completed"]
    if completed == runs:
        return []
    first = results.summary["failures"][0]
    return [
        f"{runs - completed:,} of {runs:,} runs failed and have no metrics; the first is run {first['run']}: "
        f"{first['reason']}"
    ]


def _metrics(results: StudyResults, name: str, metrics: Mapping[str, Mapping[str, Any]]) -> Section:
    described = [item for own in results.metrics.values() for item in own.values() if item["count"]]
    fractions = list(described[0]["quantiles"]) if described else []
    head = (*_HEAD, *(f"{100 * float(fraction):g} %" for fraction in fractions))
    rows = tuple(metric_cells(metric, item, len(head)) for metric, item in metrics.items())
    completed = f"{name}: {results.summary['completed_by_configuration'][name]:,} runs completed"
    return Section(table=Table(tuple(map(Column, head)), rows, left=2), paragraphs=(completed,))


def _varied_row(item: Mapping[str, Any]) -> tuple[str, str, str]:
    others = [f"{key.replace('_', ' ')} {value}" for key, value in item.items() if key not in ("path", "kind")]
    return item["path"], item["kind"], ", ".join(others)


def _assumptions_section(results: StudyResults) -> Section:
    """Return what the base scenarios assume, once where several assume the same."""
    names: dict[tuple[str, str, str], list[str]] = {}
    for name, scenario in results.document["scenarios"].items():
        for item in scenario["assumptions"]:
            names.setdefault((item["path"], item["value"], item["note"]), []).append(name)
    rows = tuple((*assumption, ", ".join(own)) for assumption, own in names.items())
    return _detail("What the base scenarios assume", ("value", "", "why", "in"), rows)


def _detail(heading: str, head: Sequence[str], rows: tuple[tuple[str, ...], ...]) -> Section:
    if not rows:
        return Section()
    return Section(heading, table=Table(tuple(map(Column, head)), rows, left=len(head)), is_detail=True)
