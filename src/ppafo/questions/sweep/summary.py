"""What all runs say together: counts, every metric by configuration, the first failures, and the bands.

Only completed runs that have the metric count, and how many those are is said beside each. Columns are read chunk by
chunk; mean, spread and quantiles are exact and in bounded memory. The quantile of fraction q of n sorted values is the
value at place (n - 1) q, on a line between its neighbours: definition 7 of Hyndman and Fan (The American Statistician,
1996). The standard deviation divides by n - 1.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.metrics import METRICS
from ppafo.questions.sweep.bands import BINS, Bins, Counts, outside_fraction, quantiles_of
from ppafo.questions.sweep.compute import COUNTS_FOLDER, RUNS_FOLDER, STATUSES, completed_rows, stored_unit
from ppafo.questions.sweep.manifest import BinsOf
from ppafo.questions.sweep.results import Columns, StudyResults
from ppafo.signals.channels import CHANNELS
from ppafo.storage.parquet import TableColumn, encode_texts, parquet_bytes, table_of
from ppafo.studies.distributions import Floats
from ppafo.studies.study import Study

_EXAMPLES = 5
QUANTILE_DEFINITION = (
    "value at place (n - 1) q of the n sorted values, on a line between neighbours (Hyndman and Fan 1996, definition 7)"
)
MAXIMUM_IN_MEMORY = 16_000_000
"""Values up to which a column is sorted in memory; beyond, order statistics are looked up digit by digit."""

_DIGIT_BITS, _DIGITS = 16, 4
_SIGN = np.uint64(1 << 63)

Parts = Callable[[], Iterator[Floats]]
"""Gives the finite values of a column anew each time, in parts whose order is always the same."""


def summary_of(study: Study, results: StudyResults) -> dict[str, Any]:
    """Return the content of ``summary.json``."""
    completed = {item.name: _completed_runs(results, item.name) for item in study.configurations}
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


def _completed_runs(results: StudyResults, configuration: str) -> int:
    parts = results.chunks(RUNS_FOLDER, ["status"], configuration)
    return sum(int(np.count_nonzero(completed_rows(part))) for part in parts)


def _metric(study: Study, results: StudyResults, configuration: str, metric: str) -> dict[str, Any]:
    kind = METRICS[metric]
    said = {"unit": kind.unit, "summary": kind.summary}
    return said | describe(lambda: results.parts(configuration, metric), study.outputs.quantiles)


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
    """Return the content of ``bands.parquet``, and the fraction of values that lay beyond the bins."""
    merged = _merged_counts(study, results)
    parts = [
        _band(study, number, channel, bins[item.name][channel], merged[item.name][channel])
        for number, item in enumerate(study.configurations)
        for channel in study.outputs.bands
    ]
    joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    names = [item.name for item in study.configurations]
    columns = {
        "configuration": TableColumn(
            encode_texts(joined.pop("configuration"), names), "-", "name of the base scenario"
        ),
        "channel": TableColumn(encode_texts(joined.pop("channel"), study.outputs.bands), "-", "name of the channel"),
        "time": TableColumn(joined.pop("time"), "s", "time since the start"),
        "runs": TableColumn(joined.pop("runs"), "-", "completed runs"),
        **{name: TableColumn(values, _si_of_channel(study), "quantile over runs") for name, values in joined.items()},
    }
    beyond = max(outside_fraction(counts) for counts in merged.values())
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
        **{f"q{fraction:g}": values for fraction, values in quantiles.items()},
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


def describe(parts: Parts, fractions: Sequence[float]) -> dict[str, Any]:
    """Return count, and unless it is 0 mean, standard deviation (from 2 values on), extremes, quantiles by fraction."""
    sums = [(part.size, float(np.sum(part)), float(part.min()), float(part.max())) for part in parts() if part.size]
    count = sum(item[0] for item in sums)
    if count == 0:
        return {"count": 0}
    mean = math.fsum(item[1] for item in sums) / count
    squares = math.fsum(float(np.sum((part - mean) ** 2)) for part in parts())
    return {
        "count": count,
        "mean": mean,
        **({"sd": math.sqrt(squares / (count - 1))} if count > 1 else {}),
        "minimum": min(item[2] for item in sums),
        "maximum": max(item[3] for item in sums),
        "quantiles": {f"{fraction:g}": value for fraction, value in quantiles(parts, count, fractions).items()},
    }


def quantiles(parts: Parts, count: int, fractions: Sequence[float]) -> dict[float, float]:
    """Return the quantile of each fraction."""
    if count <= MAXIMUM_IN_MEMORY:
        values = np.quantile(np.concatenate(list(parts())), fractions, method="linear", overwrite_input=True)
        return dict(zip(fractions, values.tolist(), strict=True))
    places = {fraction: divmod((count - 1) * fraction, 1.0) for fraction in fractions}
    ranks = sorted({min(int(low) + up, count - 1) for low, _ in places.values() for up in (0, 1)})
    sorted_values = order_statistics(parts, ranks)
    found = {}
    for fraction, (low, inside) in places.items():
        below, above = sorted_values[int(low)], sorted_values[min(int(low) + 1, count - 1)]
        found[fraction] = below + inside * (above - below)
    return found


def order_statistics(parts: Parts, ranks: Sequence[int]) -> dict[int, float]:
    """Return the values at ranks (from 0) of the sorted column, by a radix selection: four passes over the parts."""
    known = dict.fromkeys(ranks, (0, 0))
    for digit in range(_DIGITS):
        counts = _digit_counts(parts, digit, {prefix for prefix, _ in known.values()})
        for rank, (prefix, below) in known.items():
            cumulated = np.cumsum(counts[prefix])
            place = int(np.searchsorted(cumulated, rank - below, side="right"))
            before = int(cumulated[place - 1]) if place else 0
            known[rank] = ((prefix << _DIGIT_BITS) | place, below + before)
    return {rank: _number(key) for rank, (key, _) in known.items()}


def _digit_counts(parts: Parts, digit: int, prefixes: set[int]) -> dict[int, NDArray[np.int64]]:
    """Return how often each value of a digit comes behind each prefix of higher digits."""
    shift = np.uint64(_DIGIT_BITS * (_DIGITS - 1 - digit))
    size = 1 << _DIGIT_BITS
    counts = {prefix: np.zeros(size, dtype=np.int64) for prefix in prefixes}
    for part in parts():
        keys = _keys(part) >> shift
        for prefix in prefixes:
            own = keys if digit == 0 else keys[(keys >> np.uint64(_DIGIT_BITS)) == np.uint64(prefix)]
            counts[prefix] += np.bincount((own & np.uint64(size - 1)).astype(np.int64), minlength=size)
    return counts


def _keys(values: Floats) -> NDArray[np.uint64]:
    """Return whole numbers in the same order as the values."""
    bits = np.ascontiguousarray(values).view(np.uint64)
    return np.where(bits & _SIGN != 0, ~bits, bits | _SIGN)


def _number(key: int) -> float:
    """Return the value that has a key."""
    bits = key ^ (1 << 63) if key >> 63 else key ^ (2**64 - 1)
    return float(np.array(bits, dtype=np.uint64).view(np.float64))
