"""What identifies a study: bins, chunks, the controllers in Python, and ``study.json``, which refuses another study.

Counts of two chunks add up to those of both, exactly and in any order, so that bands do not depend on how the runs were
divided. The bins are fixed before the first chunk by trial runs spread over the whole study; what lies outside
them is counted at their ends.

Runs are numbered configuration by configuration, in each grid point by grid point (the last axis fastest), at each
draw by draw. A chunk never holds runs of two configurations.
"""

import copy
import hashlib
import inspect
import json
import math
import numbers
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, FunctionType
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field

from ppafo.control.kind import PythonController
from ppafo.documents.json_text import json_text
from ppafo.documents.models import quote, validate
from ppafo.engine.lanes import write_source
from ppafo.errors import DataError, StudyError
from ppafo.metrics import METRICS
from ppafo.simulation.ensemble.running import reacts
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario, plain, scenario_document
from ppafo.storage.places import Place, read_document
from ppafo.studies.distributions import Floats
from ppafo.studies.sampling import correlate, uniform_numbers
from ppafo.studies.study import Configuration, Study, with_followers
from ppafo.version import __version__

BINS = 1000
_MARGIN = 0.5
"""How far the bins reach beyond the trial runs on each side, as a fraction of their range."""
Counts = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Bins:
    """Equal bins from ``low`` to ``high`` [SI], and one at each end for all that lies beyond."""

    low: float
    high: float

    @property
    def width(self) -> float:
        """Width of a bin, which bounds the error of a quantile [SI]."""
        return (self.high - self.low) / BINS

    def edges(self) -> Floats:
        """Return the BINS + 1 edges [SI]."""
        return np.asarray(self.low + self.width * np.arange(BINS + 1), dtype=np.float64)


def bins_around(traces: Floats) -> Bins:
    """Return bins with room around trial traces (times, runs) [SI]; failed runs are nan."""
    finite = traces[np.isfinite(traces)]
    if finite.size == 0:
        return Bins(-1.0, 1.0)
    low, high = float(finite.min()), float(finite.max())
    room = _MARGIN * (high - low) or max(abs(high), 1.0) * 1.0e-3
    return Bins(low - room, high + room)


def counts_of(traces: Floats, bins: Bins) -> Counts:
    """Return how many runs are in each bin at each time, shape (times, BINS + 2), for traces (times, runs) [SI]."""
    counts = np.empty((traces.shape[0], BINS + 2), dtype=np.int64)
    for number, values in enumerate(traces):
        known = values[np.isfinite(values)]
        place = np.clip(np.floor((known - bins.low) / bins.width), -1, BINS).astype(np.int64) + 1
        counts[number] = np.bincount(place, minlength=BINS + 2)
    return counts


def quantiles_of(counts: Counts, bins: Bins, fractions: Sequence[float]) -> dict[float, Floats]:
    """Return, for each fraction, the value at each time below which that fraction of runs lies [SI]; nan without runs.

    Inside a bin the runs are taken to lie evenly; beyond the bins the value is their end.
    """
    edges = np.concatenate(([bins.low], bins.edges(), [bins.high]))
    cumulated = np.concatenate((np.zeros((counts.shape[0], 1)), np.cumsum(counts, axis=1)), axis=1)
    total = cumulated[:, -1]
    found = {fraction: np.full(counts.shape[0], np.nan) for fraction in fractions}
    for row in np.flatnonzero(total):
        for fraction in fractions:
            found[fraction][row] = _value_at(fraction * total[row], cumulated[row], edges)
    return found


def _value_at(wanted: float, cumulated: Floats, edges: Floats) -> float:
    """Return where the cumulated counts reach a number: the first bin that gets there, and the part of it."""
    place = max(1, int(np.searchsorted(cumulated, wanted, side="left")))
    while cumulated[place] == cumulated[place - 1]:
        place += 1
    inside = (wanted - cumulated[place - 1]) / (cumulated[place] - cumulated[place - 1])
    return float(edges[place - 1] + inside * (edges[place] - edges[place - 1]))


def outside_fraction(counts: Mapping[str, Counts]) -> float:
    """Return the fraction of values beyond the bins, over all channels and times."""
    total = sum(int(item.sum()) for item in counts.values())
    beyond = sum(int(item[:, 0].sum() + item[:, -1].sum()) for item in counts.values())
    return beyond / total if total else 0.0


MAXIMUM_RUNS_OF_CHUNK = 65_536
_FEWEST_RUNS_OF_CHUNK = 512
_SLOW_RUNS_OF_CHUNK = 64
"""Where a Python object controls: some seconds, after which progress is said and nothing of it is lost."""
_REACTING_RUNS_OF_CHUNK = 64
"""Where the wearer reacts: a quarter of a minute of one processor, for walks of a minute."""
_MAXIMUM_BYTES_OF_TRACES = 48_000_000
ASKED_ABOVE = 10_000_000_000
"""Bytes above which a study is only started with ``--yes``."""
_FIXED_BYTES_OF_ROW = 3
_BYTES_OF_NUMBER, _BYTES_OF_SAMPLE, _BYTES_OF_COUNT = 8, 4, 6
_BYTES_OF_FILE = 12_000


@dataclass(frozen=True, slots=True)
class Chunk:
    """Some runs of one configuration: number of the chunk, first run of its configuration, and how many."""

    number: int
    configuration: int
    first: int
    runs: int


def chunk_size(study: Study) -> int:
    """Return the runs of a full chunk: fewer where channels over time are kept, so that memory stays small."""
    if study.runs_of_chunk is not None:
        return study.runs_of_chunk
    if any(item.scenario.control.custom is not None for item in study.configurations):
        return _SLOW_RUNS_OF_CHUNK
    if any(reacts(item.scenario) for item in study.configurations):
        return _REACTING_RUNS_OF_CHUNK
    bytes_of_run = 8 * len(study.outputs.traces) * maximum_samples(study)
    size = MAXIMUM_RUNS_OF_CHUNK
    while size > _FEWEST_RUNS_OF_CHUNK and size * bytes_of_run > _MAXIMUM_BYTES_OF_TRACES:
        size //= 2
    return size


def maximum_samples(study: Study) -> int:
    """Return how many samples a channel over time has, in the longest configuration."""
    longest = max(configuration.scenario.duration for configuration in study.configurations)
    return int(longest / study.outputs.every + 1.0e-9) + 1


def chunk_count(study: Study) -> int:
    """Return the number of all chunks."""
    return len(study.configurations) * -(-study.runs_of_configuration // chunk_size(study))


def chunk(study: Study, number: int) -> Chunk:
    """Return a chunk by its number."""
    size = chunk_size(study)
    configuration, place = divmod(number, -(-study.runs_of_configuration // size))
    first = place * size
    return Chunk(number, configuration, first, min(size, study.runs_of_configuration - first))


def drawn_values(study: Study, runs: NDArray[np.int64]) -> dict[str, Floats]:
    """Return the values [SI] of all varied paths for ascending runs of one configuration; the same in each of them."""
    point, draw = np.divmod(runs, study.sample.runs)
    columns: dict[str, Floats] = {}
    for axis in reversed(study.axes):
        point, place = np.divmod(point, len(axis.values))
        columns[axis.path] = np.asarray(axis.values)[place]
    if study.drawn:
        columns |= _random_values(study, draw)
    return {path: columns[path] for path in study.paths}


def varied_columns(study: Study, configuration: Configuration, values: dict[str, Floats]) -> dict[str, Floats]:
    """Return the values that the runs of a configuration get."""
    own = {path: column for path, column in values.items() if study.varies(path, configuration.name)}
    return with_followers(own, study.same_in(configuration.name))


def _random_values(study: Study, draws: NDArray[np.int64]) -> dict[str, Floats]:
    """Return the values of the distributions."""
    uniform = _uniform_numbers(study, draws)
    if study.scores is not None:
        uniform = correlate(uniform, study.scores)
    columns = np.ascontiguousarray(uniform.T)
    return {item.path: item.distribution.values(columns[row]) for row, item in enumerate(study.drawn)}


def _uniform_numbers(study: Study, draws: NDArray[np.int64]) -> Floats:
    """Return the uniform numbers of some draws: of a small sample all and from these, of a large one in stretches."""
    dimensions = len(study.drawn)
    if study.sample.runs <= MAXIMUM_RUNS_OF_CHUNK:
        return uniform_numbers(study.sample, dimensions, 0, study.sample.runs)[draws]
    starts = np.flatnonzero(np.diff(draws, prepend=draws[0] - 2) != 1)
    stretches = np.split(draws, starts[1:])
    return np.concatenate([uniform_numbers(study.sample, dimensions, int(part[0]), part.size) for part in stretches])


def estimate_bytes(study: Study) -> int:
    """Return an upper estimate of the bytes on disk: as if nothing could be compressed."""
    outputs, samples = study.outputs, maximum_samples(study)
    numbers = 2 + len(study.paths) + len(outputs.metrics) * (2 if outputs.errors else 1)
    row = _FIXED_BYTES_OF_ROW + _BYTES_OF_NUMBER * numbers + _BYTES_OF_SAMPLE * samples * len(outputs.trajectories)
    counts = _BYTES_OF_COUNT * samples * len(outputs.bands) * BINS // 2
    return study.runs * row + chunk_count(study) * (counts + _BYTES_OF_FILE)


def check_room(study: Study, place: Place, agreed: bool) -> None:
    """Refuse a study that does not fit onto the disk, or that takes much of it and was not agreed to with ``--yes``."""
    needed, free = estimate_bytes(study), place.free_bytes()
    size = f"{study.runs:,} runs of '{study.name}' need about {_bytes_text(needed)}"
    if free is not None and needed > free:
        raise StudyError(
            f"{place.address}: {size}, but only {_bytes_text(free)} are free: use fewer runs, metrics or trajectories"
        )
    if needed > ASKED_ABOVE and not agreed:
        raise StudyError(f"{place.address}: {size}; give --yes to start it anyway")


def _bytes_text(size: int) -> str:
    for unit, scale in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if size >= scale:
            return f"{size / scale:.3g} {unit}"
    return f"{size / 1e3:.3g} kB"


_DIGITS = 16
"""Digits of the hashes of a program and of a controller in Python."""
_DEEPEST, _LONGEST = 12, 64
"""Levels of settings that are looked into, items of a list that is kept and not hashed, and digits of a hash."""
Inside = tuple[int, ...]
"""Identities of what a value is inside of, so that what holds itself comes to an end."""


def controller_document(controller: PythonController) -> dict[str, Any]:
    """Return type, hash of the source text and settings of a controller as it is after a reset, as plain data."""
    try:
        fresh = copy.deepcopy(controller)
    except (TypeError, copy.Error, NotImplementedError, RecursionError):  # it holds what has no copy, such as a port
        return _object(controller, ())
    # What a run left behind is no setting: a study resumes with the same object too.
    fresh.reset()
    return _object(fresh, ())


def _object(value: object, inside: Inside) -> dict[str, Any]:
    try:
        found = object.__getstate__(value)
    except TypeError:  # made outside of Python
        found = None
    tables = [table for table in (found if isinstance(found, tuple) else (found,)) if isinstance(table, dict)]
    settings = {str(name): item for table in tables for name, item in table.items()}
    kind = type(value)
    return {"type": _name(kind), "source": _hash_of(kind.__mro__), "settings": _plain_setting(settings, inside)}


def _name(made: type | FunctionType) -> str:
    return f"{made.__module__}.{made.__qualname__}"


def _hash_of(made: tuple[type | FunctionType, ...]) -> str:
    """Return a hash of the files in which classes or functions are written; of their code where there is no file."""
    digest = hashlib.sha256()
    for one in made:
        # The standard library is another one with another Python, which is no other controller.
        if one.__module__ == "__main__" or one.__module__.partition(".")[0] not in sys.stdlib_module_names:
            digest.update(_text_of(one))
    return digest.hexdigest()[:_DIGITS]


def _text_of(made: type | FunctionType) -> bytes:
    try:
        return Path(inspect.getfile(made)).read_bytes()
    except (TypeError, OSError):  # from a notebook, or typed in
        functions = [made] if isinstance(made, FunctionType) else vars(made).values()
        return repr([list(_code(one.__code__)) for one in functions if isinstance(one, FunctionType)]).encode()


def _code(code: CodeType) -> Iterator[object]:
    yield from (code.co_name, code.co_code, code.co_names)
    for constant in code.co_consts:
        yield list(_code(constant)) if isinstance(constant, CodeType) else constant


def _plain_setting(value: object, inside: Inside) -> Any:
    """Return a setting as data that JSON can hold; one that holds itself, or lies too deep, is its type's name."""
    if value is None or isinstance(value, str | bool | numbers.Number | np.generic):
        return _number_or_text(value)
    if isinstance(value, bytes):
        return hashlib.sha256(value).hexdigest()[:_DIGITS]
    if isinstance(value, type | FunctionType):
        return {"type": _name(value), "source": _hash_of((value,))}
    if id(value) in inside or len(inside) >= _DEEPEST:
        return _name(type(value))
    deeper = (*inside, id(value))
    if isinstance(value, Mapping):
        return {str(key): _plain_setting(item, deeper) for key, item in value.items()}
    items = _items(value)
    return _object(value, deeper) if items is None else _shortened([_plain_setting(item, deeper) for item in items])


def _number_or_text(value: object) -> Any:
    bare = value.item() if isinstance(value, np.generic) else value
    if bare is None or isinstance(bare, str | bool | int):
        return bare
    return bare if isinstance(bare, float) and math.isfinite(bare) else repr(bare)


def _items(value: object) -> list[Any] | None:
    """Return what a collection has in it, None of what is none."""
    if isinstance(value, np.ndarray):
        return list(value.tolist()) if value.ndim else [value.item()]
    if isinstance(value, set | frozenset):
        return sorted(value, key=repr)
    return list(value) if isinstance(value, tuple | list) else None


def _shortened(items: list[Any]) -> Any:
    if len(items) <= _LONGEST:
        return items
    return {"items": len(items), "sha256": hashlib.sha256(json.dumps(items).encode()).hexdigest()}


MANIFEST = "study.json"
STUDY_COPY = "study.toml"
FORMAT = "ppafo study results"
SCHEMA_VERSION = 1
_NAMED = 4
_COMPARED = ("ppafo", "study", "scenarios", "varied", "drawn", "programs")
BinsOf = Mapping[str, Mapping[str, Bins]]
"""Bins by configuration and channel."""


def manifest(study: Study, bins: BinsOf) -> dict[str, Any]:
    """Return the document: study, base scenarios in SI units, runs, columns with units; no time and no machine."""
    scenarios = {item.name: _without_origin(item.scenario) for item in study.configurations}
    # What is drawn may come from a parameter set, or have been changed in Python, and the file says neither.
    parts = {name: getattr(study, name) for name in ("axes", "drawn", "same", "scores", "sample", "outputs")}
    drawn = _plain(plain(parts))
    requested = {
        "ppafo": __version__,
        "study": _plain(study.document),
        "scenarios": scenarios,
        "drawn": drawn,
        "programs": {item.name: _program_hash(item.scenario) for item in study.configurations},
    }
    return {
        "format": FORMAT,
        "schema_version": SCHEMA_VERSION,
        **requested,
        "sha256": hashlib.sha256(json.dumps(requested, sort_keys=True).encode()).hexdigest(),
        "runs": study.runs,
        "runs_of_configuration": study.runs_of_configuration,
        "chunks": chunk_count(study),
        "runs_of_chunk": chunk_size(study),
        "varied": {path: {"unit": study.units[path]} for path in study.paths},
        "metrics": {
            name: {"unit": METRICS[name].unit, "summary": METRICS[name].summary} for name in study.outputs.metrics
        },
        "bins": {
            name: {channel: {"low": item.low, "high": item.high} for channel, item in channels.items()}
            for name, channels in bins.items()
        },
    }


def read_manifest(place: Place) -> dict[str, Any]:
    """Return the document of a folder of results; DataError where it is none."""
    try:
        document = read_document(place, MANIFEST)
    except (OSError, ValueError) as error:
        raise DataError(f"{place.address}: contains no study results ({MANIFEST} cannot be read)") from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise DataError(f"{place.address}: {MANIFEST} is not a manifest of study results")
    if document.get("schema_version") != SCHEMA_VERSION:
        raise DataError(
            f"{place.address}: has schema_version {quote(document.get('schema_version'))}, "
            f"this version of ppafo reads {SCHEMA_VERSION}"
        )
    validate(_Stored, document, f"{place.address}: {MANIFEST}", DataError)
    return document


class _Named(BaseModel):
    name: str


class _StoredStudy(_Named):
    configurations: Annotated[list[_Named], Field(min_length=1)]
    outputs: dict[str, Any]


class _Stored(BaseModel):
    """What everybody may rely on in the document; how it differs from that of a study is said elsewhere."""

    study: _StoredStudy
    runs: Annotated[int, Field(ge=1)]
    chunks: Annotated[int, Field(ge=1)]
    varied: dict[str, Any]
    metrics: dict[str, dict[str, Any]]
    bins: dict[str, dict[str, dict[Literal["low", "high"], float]]]


def stored_bins(document: Mapping[str, Any]) -> BinsOf:
    """Return the bins that a manifest has."""
    return {
        name: {channel: Bins(item["low"], item["high"]) for channel, item in channels.items()}
        for name, channels in document["bins"].items()
    }


def check_same_study(place: Place, stored: Mapping[str, Any], requested: Mapping[str, Any]) -> None:
    """Refuse to go on with the results of another study, or of this one before it was changed."""
    before, now = stored.get("study", {}), requested["study"]
    if before.get("name") != now["name"]:
        raise StudyError(
            f"{place.address}: contains the results of the study '{before.get('name')}', not of '{now['name']}'; "
            "choose another folder"
        )
    changed = [line for key in _COMPARED for line in _differences(key, stored.get(key), requested[key])]
    if changed:
        named = "; ".join(changed[:_NAMED]) + (f"; and {len(changed) - _NAMED} more" if len(changed) > _NAMED else "")
        raise StudyError(
            f"{place.address}: contains results of an earlier version of '{now['name']}': {named}; undo the change "
            "or choose another folder"
        )


def manifest_bytes(document: Mapping[str, Any]) -> bytes:
    """Return the content of the file."""
    return f"{json_text(document)}\n".encode()


def _without_origin(scenario: Scenario) -> dict[str, Any]:
    """Return a base scenario in SI units without the file it came from, which may lie elsewhere the next time."""
    document: dict[str, Any] = _plain(scenario_document(scenario))
    del document["origin"]
    custom = scenario.control.custom
    if custom is not None:
        document["control"]["custom"] = controller_document(custom)
    return document


def _program_hash(scenario: Scenario) -> str:
    """Return a hash of what a scenario computes: a law or a valve from a module of the user is a name elsewhere."""
    lines = write_source(plan_run(scenario).program, 1)[1].splitlines()
    # A line of comment says where a function stands, which may be elsewhere the next time.
    code = "\n".join(line for line in lines if not line.startswith("#"))
    return hashlib.sha256(code.encode()).hexdigest()[:_DIGITS]


def _plain(document: Any) -> Any:
    return json.loads(json.dumps(document))


def _differences(path: str, before: Any, now: Any) -> Iterator[str]:
    """Give a line for every key at which two documents differ."""
    if isinstance(before, dict) and isinstance(now, dict):
        for key in dict.fromkeys((*before, *now)):
            yield from _differences(f"{path}.{key}", before.get(key), now.get(key))
    elif isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
        for number, (old, new) in enumerate(zip(before, now, strict=True), start=1):
            label = new.get("path", new.get("name", number)) if isinstance(new, dict) else number
            yield from _differences(f"{path}[{label}]", old, new)
    elif before != now:
        yield f"{path.removeprefix('study.')} was {quote(before)} and is now {quote(now)}"


RUNS_FOLDER, TRAJECTORIES_FOLDER, COUNTS_FOLDER, NOTES_FOLDER = "runs", "trajectories", "band-counts", "finished"


def chunk_file(folder: str, number: int) -> str:
    """Return the name of a file of a chunk."""
    return f"{folder}/chunk-{number:07d}.parquet"
