"""The sensitivity of metrics to what has a distribution in a study: the analysis at growing sizes, and the answer.

Policy for runs that fail: where more than a fraction of all runs has no value it is refused, because the indices
would be those of the survivors. Otherwise every block (base point or order) with such a run is left out whole,
since the formulas need whole blocks, and counted; the indices then hold for values with which the model runs.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ppafo.answers import Answer, Cell, Column, Figure, Section, Table
from ppafo.answers.display_units import (
    change_text,
    display_difference,
    metric_quantity,
    metric_words,
)
from ppafo.answers.setting_names import label_of
from ppafo.answers.style import BLUE, COLOURS, ORANGE, Margins, figure_of_free_panels, house_style, mark_kind
from ppafo.errors import StudyError, nearest_name
from ppafo.progress import Report
from ppafo.questions.question import Solved
from ppafo.questions.sensitivity.methods import METHODS, Evaluated, Indices, Method, changes
from ppafo.simulation.scenario import plain
from ppafo.studies.distributions import Floats
from ppafo.studies.draws import (
    Model,
    Outcomes,
    Tally,
    Uncertainty,
    check_confidence,
    check_failures,
    check_fraction,
    choose_configuration,
    scenario_model,
    study_of,
    uncertainty_in,
)
from ppafo.studies.sampling import NOISE
from ppafo.studies.study import Study

if TYPE_CHECKING:
    import matplotlib.figure
    from matplotlib.axes import Axes

_ENDS = (0.05, 0.95)
"""Fractions between which a value goes for the change of a metric."""
_NEGLIGIBLE = 0.01
_FEWEST_WHOLE = 4
_SIZES = 6
"""Sizes at which the indices are shown: all blocks, and halved again and again."""


@dataclass(frozen=True, slots=True)
class Settings:
    """Number of blocks, seed, confidence of the bands, fraction of the runs that may fail."""

    samples: int
    seed: int = 1
    confidence: float = 0.95
    maximum_failed: float = 0.02


@dataclass(frozen=True, slots=True)
class Settling:
    """The indices of one metric from the first ``blocks`` blocks, of which ``used`` had values in all runs."""

    blocks: int
    used: int
    indices: Indices


@dataclass(frozen=True, slots=True)
class OfMetric:
    """The indices of a metric at growing sizes, the last the result. ``mean`` and ``sd`` [SI] are of all runs.

    ``change`` (paths,) [SI] is that of the metric from the 5 to the 95 % quantile of each value, with its sign and the
    half width of its band ``change_band``; nan for the noise.
    """

    metric: str
    settling: tuple[Settling, ...]
    change: Floats
    change_band: Floats
    dropped_runs: int
    mean: float
    sd: float

    @property
    def indices(self) -> Indices:
        """The indices from all blocks."""
        return self.settling[-1].indices

    @property
    def dropped_blocks(self) -> int:
        """Number of blocks that were left out."""
        return self.settling[-1].blocks - self.settling[-1].used


@dataclass(frozen=True, slots=True, repr=False)
class Sensitivity(Solved):
    """Indices of some metrics with regard to some paths; ``runs`` were made, ``failures`` of them failed."""

    method: Method
    settings: Settings
    paths: tuple[str, ...]
    metrics: tuple[OfMetric, ...]
    runs: int
    failures: int
    name: str = ""

    def overlapping_pairs(self, metric: OfMetric) -> list[tuple[str, str]]:
        """Return neighbours in the order of the first index whose bands overlap: which of the two matters more is open.

        Nothing is said of two that both are surely below a hundredth of the largest: neither matters.
        """
        name = self.method.shown[0]
        values, bands = metric.indices.values[name], metric.indices.bands[name]
        order = np.argsort(-values)
        order = order[(values + bands)[order] >= _NEGLIGIBLE * np.max(values)]
        return [
            (self.paths[first], self.paths[second])
            for first, second in pairwise(order)
            if values[first] - bands[first] < values[second] + bands[second]
        ]


def analyse(
    model: Model, uncertainty: Uncertainty, metrics: Sequence[str], method: Method, settings: Settings
) -> Sensitivity:
    """Return the indices of a model's metrics; StudyError for bad settings, dependent values or too many failures."""
    if uncertainty.scores is not None and not method.takes_dependent:
        raise StudyError(
            f"sensitivity: the indices of {method.name} need values that are independent, and the study has "
            "[[correlations]]; use '--method shapley', or treat the values as independent (--independent)"
        )
    if len(uncertainty.drawn) < 2:
        raise StudyError("sensitivity: there is only one uncertain value; vary two or more")
    if not method.fewest <= settings.samples <= method.most:
        raise StudyError(
            f"samples = {settings.samples}: {method.name} needs {method.fewest} to {method.most:,} {method.sizes_label}"
        )
    if settings.seed < 0:
        raise StudyError(f"seed = {settings.seed}: must be 0 or more")
    check_confidence(settings.confidence)
    check_fraction(settings.maximum_failed, "maximum_failed")
    design = method.design(uncertainty, settings.samples, settings.seed)
    columns = uncertainty.columns(design)
    outcomes = model(columns)
    check_failures(outcomes, settings.maximum_failed, "sensitivity")
    ends = np.array([item.distribution.values(np.array(_ENDS)) for item in uncertainty.drawn]).T
    ends[:, [path == NOISE for path in uncertainty.paths]] = np.nan
    inputs = np.stack([columns[path] for path in uncertainty.paths], axis=1)
    rows = design.shape[0] // settings.samples
    blocks = np.repeat(np.arange(settings.samples), rows)
    whole = Evaluated(design, inputs, np.empty(0), blocks, ends, settings.seed)
    found = tuple(_of_metric(name, outcomes, whole, method, settings) for name in metrics)
    return Sensitivity(method, settings, uncertainty.paths, found, outcomes.runs, outcomes.failures)


def _of_metric(name: str, outcomes: Outcomes, design: Evaluated, method: Method, settings: Settings) -> OfMetric:
    values = outcomes.metrics[name]
    known = np.isfinite(values)
    missing = int(np.count_nonzero(~known))
    if missing > settings.maximum_failed * values.size:
        raise StudyError(f"sensitivity: {missing:,} of {values.size:,} runs have no '{name}'; choose another metric")
    if float(np.ptp(values[known])) == 0.0:
        raise StudyError(f"sensitivity: '{name}' is {values[known][0]:g} in every run, so no value influences it")
    rows = values.size // settings.samples
    whole = np.all(known.reshape(-1, rows), axis=1)
    sizes = [size for size in _sizes(whole.size, method.fewest) if _varies(values, whole, size, rows)]
    if whole.size not in sizes:
        raise StudyError(
            f"sensitivity: {int(np.count_nonzero(whole)):,} of {whole.size:,} {method.sizes_label} have '{name}' in "
            "all their runs, which is too few; use more samples, or fix what makes the runs fail"
        )
    parts = [_first_blocks(design, values, whole, size) for size in sizes]
    return OfMetric(
        name,
        tuple(
            Settling(size, part.blocks.size, method.indices(part, settings.confidence))
            for size, part in zip(sizes, parts, strict=True)
        ),
        *changes(parts[-1], settings.confidence),
        missing,
        float(np.mean(values[known])),
        float(np.std(values[known], ddof=1)),
    )


def _sizes(blocks: int, fewest: int) -> list[int]:
    sizes = [blocks >> halvings for halvings in range(_SIZES)]
    return sorted({size for size in sizes if size >= fewest} | {blocks})


def _varies(values: Floats, whole: NDArray[np.bool_], size: int, rows: int) -> bool:
    """Tell whether the first blocks say anything: many may be left out, and a metric that counts may be the same."""
    kept = values.reshape(-1, rows)[:size][whole[:size]]
    return len(kept) >= _FEWEST_WHOLE and float(np.ptp(kept)) > 0.0


def _first_blocks(design: Evaluated, values: Floats, whole: NDArray[np.bool_], size: int) -> Evaluated:
    kept = np.flatnonzero(whole[:size])
    rows = np.flatnonzero(np.isin(design.blocks, kept))
    return Evaluated(design.fractions[rows], design.inputs[rows], values[rows], kept, design.ends, design.seed)


DEFAULT_SAMPLES = {"sobol": 8192, "shapley": 2048}


def sensitivity(
    study: Study | str | Path | Mapping[str, Any],
    method: str | None = None,
    metrics: Sequence[str] = (),
    samples: int | None = None,
    configuration: str | None = None,
    overrides: Sequence[str] = (),
    independent: bool = False,
    seed: int | None = None,
    confidence: float = 0.95,
    maximum_failed: float = 0.02,
    threads: int | None = None,
    progress: Report | None = None,
) -> Sensitivity:
    """Return the sensitivity of metrics with regard to everything that has a distribution in a study.

    ``method`` is a name in ``METHODS``; by default Shapley effects where values are correlated, else Sobol indices.
    ``metrics`` are those of the study by default; ``samples`` base points or orders (8192 for Sobol, 2048 for
    Shapley). ``independent`` leaves the correlations of the study out. Noise of the sensors is one of the values.
    StudyError for bad input, and where more than the fraction ``maximum_failed`` of the runs fails; of fewer, whole
    blocks are left out and counted.
    """
    if method is not None and method not in METHODS:
        raise StudyError(
            f"there is no method '{method}'{nearest_name(method, METHODS)}; available: {', '.join(METHODS)}"
        )
    chosen = study_of(study, overrides)
    base = choose_configuration(chosen, configuration)
    known = uncertainty_in(chosen, base)
    used = (replace(known, scores=None) if independent else known).with_noise_of([base.scenario])
    by = METHODS[method or ("sobol" if used.scores is None else "shapley")]
    requested = tuple(metrics) or chosen.outputs.metrics
    if not requested:
        raise StudyError(f"study '{chosen.name}' keeps no metrics; name the metric to analyse")
    count = DEFAULT_SAMPLES[by.name] if samples is None else samples
    settings = Settings(count, chosen.sample.seed if seed is None else seed, confidence, maximum_failed)
    tally = Tally(count * by.block_rows(len(used.drawn)), progress)
    model = scenario_model(base.scenario, requested, threads, tally.add, used.gauge)
    return replace(analyse(model, used, requested, by, settings), name=f"{chosen.name}, {base.name}")


_WIDTH, _RIGHT_PANEL = 9.6, 1.0
_LETTER, _LINE = 0.083, 0.27
_MAXIMUM_LINES = 5
_TITLES = {
    "total": "total",
    "first": "first order",
    "shapley": "Shapley effect",
}


def sensitivity_figure(found: Sensitivity) -> "matplotlib.figure.Figure":
    """Return the figure; the left names are those of the uncertain values."""
    labels = [label_of(path) for path in found.paths]
    names = 0.25 + _LETTER * max(len(label) for label in labels)
    margins = Margins(left=names, right=0.2, top=0.55, bottom=0.55, row_gap=0.95, column_gap=0.75)
    panel = max(2.0, _LINE * len(found.paths))
    rows = len(found.metrics)
    height = margins.top + rows * panel + (rows - 1) * margins.row_gap + margins.bottom
    with house_style():
        figure, grid = figure_of_free_panels((_WIDTH, height), margins, rows, 2)
        for metric, (bars, course) in zip(found.metrics, grid, strict=True):
            shown = found.method.shown
            order = np.argsort(metric.indices.values[shown[0]])
            places = np.arange(order.size)
            for name, colour, shift in zip(shown, (BLUE, ORANGE), (0.14, -0.14), strict=False):
                bars.errorbar(
                    metric.indices.values[name][order],
                    places + shift,
                    xerr=metric.indices.bands[name][order],
                    fmt="o",
                    color=colour,
                    markersize=5,
                    elinewidth=1.4,
                    label=_TITLES[name],
                )
            bars.set_yticks(places, [labels[row] for row in order])
            for label, colour in zip(reversed(bars.get_yticklabels()), COLOURS[:_MAXIMUM_LINES], strict=False):
                label.set_color(colour)
            bars.axvline(0.0, color="#9a9a9a", linewidth=0.8)
            bars.set_xlabel("Fraction of the variance")
            bars.set_title(metric_words(metric.metric))
            # The lower right is free: the smallest indices are there.
            bars.legend(loc="lower right", handlelength=1.0)
            _draw_settling(course, found, metric)
        mark_kind(figure, "simulated")
        return figure


def _draw_settling(axes: "Axes", found: Sensitivity, metric: OfMetric) -> None:
    name = found.method.shown[0]
    order = np.argsort(-metric.indices.values[name])[:_MAXIMUM_LINES]
    sizes = [each.blocks for each in metric.settling]
    for colour, row in zip(COLOURS, order, strict=False):
        values = np.array([each.indices.values[name][row] for each in metric.settling])
        bands = np.array([each.indices.bands[name][row] for each in metric.settling])
        axes.plot(sizes, values, "o-", color=colour, markersize=3.5, linewidth=1.2, label=found.paths[row])
        axes.fill_between(sizes, values - bands, values + bands, color=colour, alpha=0.15, linewidth=0)
    axes.set_xscale("log", base=2)
    axes.set_xlabel(f"{found.method.sizes_label[:1].upper()}{found.method.sizes_label[1:]}")
    axes.set_title(f"{_TITLES[name][:1].upper()}{_TITLES[name][1:]}, {order.size} largest")


_CAPTION = (
    "Left: the indices with their bands. Right: the largest of them, in the colours of their names, from growing "
    "parts of the sample: whether they have converged."
)


def answer_of(found: Sensitivity) -> Answer:
    """Return the answer of a sensitivity analysis; changes of a metric are in its SI unit in the data."""
    figure = Figure("sensitivity", _CAPTION, lambda: sensitivity_figure(found))
    return Answer(
        name="sensitivity",
        kicker="Sensitivity",
        title=f"What matters in {found.name}",
        lead=tuple(lead(found)),
        sections=(
            *(_metric_section(found, metric) for metric in found.metrics),
            Section("Indices and their convergence", figure=figure, is_detail=True),
        ),
        data={
            "study": found.name,
            "method": found.method.name,
            "settings": plain(found.settings),
            "paths": list(found.paths),
            "runs": found.runs,
            "failed": found.failures,
            "policy": "above the maximum fraction refused; below, every block with a failed run is left out",
            "metrics": [
                {
                    "metric": metric.metric,
                    "mean": metric.mean,
                    "standard_deviation": metric.sd,
                    "runs_without_value": metric.dropped_runs,
                    "change_from_5_to_95_percent": plain(metric.change.tolist()),
                    "band_of_change": plain(metric.change_band.tolist()),
                    "settling": [
                        {
                            "blocks": each.blocks,
                            "used": each.used,
                            "indices": {name: plain(values.tolist()) for name, values in each.indices.values.items()},
                            "bands": {name: plain(values.tolist()) for name, values in each.indices.bands.items()},
                        }
                        for each in metric.settling
                    ],
                }
                for metric in found.metrics
            ],
        },
    )


def _metric_section(found: Sensitivity, metric: OfMetric) -> Section:
    # The head of the table of a metric.
    quantity = metric_quantity(metric.metric)
    names = []
    for name in metric.indices.values:
        names += [_TITLES[name], "band"]
    changed = Column("change, 5 to 95 %", quantity, "+.3g", is_change=True)
    head = (*map(Column, ["value", *names]), changed, Column("band"))
    rows = tuple(map(tuple, table_rows(found, metric)))
    return Section(heading(found, metric), table=Table(head, rows), remarks=tuple(remarks(found, metric)))


def lead(found: Sensitivity) -> list[str]:
    """Return what was done, and what became of runs that failed."""
    settings, method = found.settings, found.method
    return [
        f"{found.name}: {method.name}, {settings.samples:,} {method.sizes_label}, {found.runs:,} runs of "
        f"{len(found.paths)} uncertain values; bands with {100.0 * settings.confidence:g} % confidence",
        f"{found.failures:,} runs failed; up to {100.0 * settings.maximum_failed:g} % are allowed, and every "
        f"{method.block_label} with a failed run is left out",
    ]


def heading(found: Sensitivity, metric: OfMetric) -> str:
    """Return the name of a metric with its mean and standard deviation."""
    spread = f"sd {change_text(metric.sd, metric_quantity(metric.metric))}"
    dropped = f"; {metric.dropped_blocks:,} of {found.settings.samples:,} {found.method.sizes_label} left out"
    return f"{metric.metric}: {spread}{dropped if metric.dropped_blocks else ''}"


def table_rows(found: Sensitivity, metric: OfMetric) -> list[list[Cell]]:
    """Return a row for each uncertain value, the most important one first."""
    order = np.argsort(-metric.indices.values[found.method.shown[0]])
    return [[found.paths[row], *_cells(metric, int(row))] for row in order]


def remarks(found: Sensitivity, metric: OfMetric) -> list[str]:
    """Return what these numbers leave open."""
    said = []
    unsettled = found.overlapping_pairs(metric)
    if unsettled:
        pairs = ", ".join(f"{first} and {second}" for first, second in unsettled)
        said.append(f"not converged at this size, their bands overlap: {pairs}")
    if "first" in metric.indices.values:
        said.append(_interactions(metric.indices))
    return said


def _interactions(indices: Indices) -> str:
    """Return what is left for interactions; a rest within the error of the sum may be none."""
    alone = float(np.sum(indices.values["first"]))
    error = float(np.linalg.norm(indices.bands["first"]))
    if alone + error < 1.0:
        return f"first-order indices sum to {alone:.3f} ± {error:.2g}; the rest comes from interactions"
    return f"first-order indices sum to {alone:.3f} ± {error:.2g}: interactions, if any, are within this error"


def _cells(metric: OfMetric, row: int) -> list[Cell]:
    cells: list[Cell] = []
    for name, values in metric.indices.values.items():
        cells += [f"{round(values[row], 3) + 0.0:.3f}", f"± {metric.indices.bands[name][row]:.3f}"]
    change, band = float(metric.change[row]), float(metric.change_band[row])
    if math.isnan(change):
        return [*cells, None, None]
    return [*cells, change, f"± {display_difference(band, metric_quantity(metric.metric)):.2g}"]
