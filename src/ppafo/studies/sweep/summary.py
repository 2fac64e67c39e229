"""What all runs say together: counts, every metric by configuration, the first failures, and the bands.

Only completed runs that have the metric count, and how many those are is said beside each.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ppafo.metrics import METRICS
from ppafo.signals.channels import CHANNELS
from ppafo.storage.parquet import TableColumn, coded_texts, parquet_bytes, table_of
from ppafo.studies.sweep.bands import BINS, Bins, Counts, outside_share, quantiles_of
from ppafo.studies.sweep.compute import COUNTS_FOLDER, RUNS_FOLDER, completed_rows
from ppafo.studies.sweep.manifest import BinsOf
from ppafo.studies.sweep.results import Columns, StudyResults
from ppafo.studies.sweep.statistics import QUANTILE_DEFINITION, described
from ppafo.studies.sweep.study import Study
from ppafo.studies.sweep.tables import STATUSES, stored_unit

_EXAMPLES = 5


def summarised(study: Study, results: StudyResults) -> dict[str, Any]:
    """Return the content of ``summary.json``."""
    completed = {item.name: _completed(results, item.name) for item in study.configurations}
    failed = study.runs - sum(completed.values())
    diverged = sum(part.size for item in study.configurations for part in results.parts(item.name, "failure_time"))
    return {
        "study": study.name,
        "runs": study.runs,
        "completed": study.runs - failed,
        "diverged": diverged,
        "refused": failed - diverged,
        "completed_by_configuration": completed,
        "failures": _failures(results) if failed else [],
        "quantile_definition": QUANTILE_DEFINITION,
        "configurations": {
            item.name: {metric: _metric(study, results, item.name, metric) for metric in study.outputs.metrics}
            for item in study.configurations
        },
    }


def _completed(results: StudyResults, configuration: str) -> int:
    parts = results.chunks(RUNS_FOLDER, ["status"], configuration)
    return sum(int(np.count_nonzero(completed_rows(part))) for part in parts)


def _metric(study: Study, results: StudyResults, configuration: str, metric: str) -> dict[str, Any]:
    kind = METRICS[metric]
    said = {"unit": kind.unit, "summary": kind.summary}
    return said | described(lambda: results.parts(configuration, metric), study.outputs.quantiles)


def _failures(results: StudyResults) -> list[dict[str, Any]]:
    """Return the first few runs that failed, with their reasons."""
    found: list[dict[str, Any]] = []
    for part in results.chunks(RUNS_FOLDER, ["run", "configuration", "status", "reason"]):
        rows = [row for row in part.to_pylist() if row["status"] != STATUSES[0]]
        found += rows[: _EXAMPLES - len(found)]
        if len(found) == _EXAMPLES:
            break
    return found


def bands_file(study: Study, results: StudyResults, bins: BinsOf) -> tuple[bytes, float]:
    """Return the content of ``bands.parquet``, and the share of values that lay beyond the bins."""
    merged = _merged_counts(study, results)
    parts = [
        _band(study, number, channel, bins[item.name][channel], merged[item.name][channel])
        for number, item in enumerate(study.configurations)
        for channel in study.outputs.bands
    ]
    joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    names = [item.name for item in study.configurations]
    columns = {
        "configuration": TableColumn(coded_texts(joined.pop("configuration"), names), "-", "name of the base scenario"),
        "channel": TableColumn(coded_texts(joined.pop("channel"), study.outputs.bands), "-", "name of the channel"),
        "time": TableColumn(joined.pop("time"), "s", "time since the start"),
        "runs": TableColumn(joined.pop("runs"), "-", "completed runs"),
        **{name: TableColumn(values, _si_of_channel(study), "quantile over runs") for name, values in joined.items()},
    }
    beyond = max(outside_share(counts) for counts in merged.values())
    return parquet_bytes(table_of(columns, {"study": study.name, "bins": str(BINS)})), beyond


def _si_of_channel(study: Study) -> str:
    units = {stored_unit(CHANNELS[name].unit) for name in study.outputs.bands}
    return units.pop() if len(units) == 1 else "SI unit of the channel"


def _band(study: Study, configuration: int, channel: str, bins: Bins, counts: Counts) -> Columns:
    rows = counts.shape[0]
    quantiles = quantiles_of(counts, bins, study.outputs.quantiles)
    return {
        "configuration": np.full(rows, configuration),
        "channel": np.full(rows, study.outputs.bands.index(channel)),
        "time": study.outputs.every * np.arange(rows),
        "runs": counts.sum(axis=1),
        **{f"q{share:g}": values for share, values in quantiles.items()},
    }


def _merged_counts(study: Study, results: StudyResults) -> Mapping[str, Mapping[str, Counts]]:
    """Return the counts over all chunks by configuration and channel, shape (times, BINS + 2)."""
    merged: dict[str, dict[str, Counts]] = {}
    for item in study.configurations:
        samples = int(item.scenario.duration / study.outputs.every + 1.0e-9) + 1
        merged[item.name] = {name: np.zeros((samples, BINS + 2), dtype=np.int64) for name in study.outputs.bands}
        for part in results.chunks(COUNTS_FOLDER, configuration=item.name):
            channels = part.column("channel").cast("string").to_numpy()
            sample, place, count = (part.column(key).to_numpy() for key in ("sample", "bin", "count"))
            for channel, total in merged[item.name].items():
                own = channels == channel
                total[sample[own], place[own]] += count[own]
    return merged
