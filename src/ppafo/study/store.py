"""Results of a study in a folder: blocks of runs as Parquet files, each with a note, and documents with their hash.

A block is there when its file and its note are, and the note has the SHA-256 of the file, which unlike the checksums of
Parquet misses no flipped bit. Each file is written under a temporary name, then renamed, the note after the block: a
study that is killed at any moment resumes with what is there.
"""

import contextlib
import copy
import hashlib
import inspect
import json
import math
import numbers
import shutil
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import CodeType, FunctionType
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.control.kind import PythonController
from ppafo.documents.json_text import json_document, json_text, plain
from ppafo.documents.regular_file import read_regular_file
from ppafo.documents.toml_text import quote
from ppafo.engine.lanes import Count, write_source
from ppafo.errors import DataError, StudyError, refused_as
from ppafo.metrics import METRICS
from ppafo.progress import Progress, Report, report_nothing
from ppafo.signals.recording import CHANNELS
from ppafo.simulation.ensemble.planning import absolute
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import scenario_document
from ppafo.simulation.tracking.rule import ON_PURPOSE
from ppafo.storage.files import LEFT_ASIDE, is_address, write_file
from ppafo.storage.owned_folder import HASHES
from ppafo.storage.parquet import encode_texts, encode_truths, parquet_bytes, read_parquet
from ppafo.storage.result_folder import MANIFEST
from ppafo.studies.distributions import Floats
from ppafo.studies.study import Configuration, Study
from ppafo.study.blocks import Chunk, chunks_of, drawn_values, samples_of, varied_columns
from ppafo.study.runs import FAILED, FOLLOWS, OSCILLATES, OVER_TIME, Rows, run_judged
from ppafo.version import __version__
from ppafo.wording import argument_text

if TYPE_CHECKING:
    import pyarrow as pa

STUDY_COPY = "study.toml"
FORMAT = "ppafo study results"
SCHEMA_VERSION = 3
_MAXIMUM_BYTES_OF_DOCUMENT = 100_000_000
"""Largest document that is read [bytes]; documents of studies are far smaller."""
_LONGEST_WRITING = 86400.0
"""Age from which a temporary file counts as abandoned [s]."""
_TRIED_RUNS = 8
"""Number of trial runs of each configuration before a study starts, to detect errors at once."""
STATUSES = ("completed", "diverged", "refused")
_PLAIN = "-"
"""Unit of a dimensionless column."""
ASKED_ABOVE = 10_000_000_000
"""Size [bytes] above which a study only starts with ``--yes``."""
# Bytes of the texts of a row, each stored as an index into a list of texts, per number of a row, per sample of a
# trace (in single precision unless needed for bands), and of a chunk file and its note beside its rows.
_FIXED_BYTES_OF_ROW = 3
_BYTES_OF_NUMBER = 8
_BYTES_OF_SAMPLE = 4
_BYTES_OF_FILE = 12_000
DIGITS = 16
"""Number of hexadecimal digits kept of a SHA-256 hash."""
# Largest nesting depth of settings, and number of elements up to which a list is stored itself and not its hash.
_DEEPEST = 12
_LONGEST = 64


def controller_document(controller: PythonController) -> dict[str, Any]:
    """Return type, source hash and settings of a controller after a reset, as plain data."""
    try:
        fresh = copy.deepcopy(controller)
    except (TypeError, copy.Error, NotImplementedError, RecursionError):  # it holds what has no copy, such as a port
        fresh = controller
    else:
        # The memory of a run is no setting: a study resumes with the same object too.
        fresh.reset()
    return dict(_plain(fresh, ()))


def _source(code: type | FunctionType) -> dict[str, Any]:
    """Return the name of a class or function, and a hash of its source files (of a class and all its base classes).

    For a part without a file, the hash is of its compiled code.
    """
    digest = hashlib.sha256()
    for part in code.__mro__ if isinstance(code, type) else (code,):
        # The standard library is another one with another Python, which is no other controller.
        if part.__module__ != "__main__" and part.__module__.partition(".")[0] in sys.stdlib_module_names:
            continue
        try:
            text = Path(inspect.getfile(part)).read_bytes()
        except (TypeError, OSError):  # from a notebook, or typed in
            functions = [part] if isinstance(part, FunctionType) else vars(part).values()
            codes = [list(_instructions(each.__code__)) for each in functions if isinstance(each, FunctionType)]
            text = repr(codes).encode()
        digest.update(text)
    return {"type": f"{code.__module__}.{code.__qualname__}", "source": digest.hexdigest()[:DIGITS]}


def _instructions(code: CodeType) -> Iterator[object]:
    """Yield name, instructions, names and constants of compiled code, without file name and line numbers."""
    yield from (code.co_name, code.co_code, code.co_names)
    for constant in code.co_consts:
        yield list(_instructions(constant)) if isinstance(constant, CodeType) else constant


def _plain(value: Any, enclosing: tuple[int, ...]) -> Any:
    """Return a setting as JSON data; one that contains itself or is too deep, by ``enclosing``, by its type's name."""
    value = value.tolist() if isinstance(value, np.ndarray | np.generic) else value
    if value is None or isinstance(value, str | int):
        return value
    if isinstance(value, bytes):
        return hashlib.sha256(value).hexdigest()[:DIGITS]
    if isinstance(value, numbers.Number):
        # JSON has no complex numbers, and no infinite ones.
        return value if isinstance(value, float) and math.isfinite(value) else repr(value)
    if isinstance(value, type | FunctionType):
        return _source(value)
    if id(value) in enclosing or len(enclosing) >= _DEEPEST:
        return f"{type(value).__module__}.{type(value).__qualname__}"
    inside = (*enclosing, id(value))
    if isinstance(value, Mapping):
        return {str(key): _plain(inner, inside) for key, inner in value.items()}
    if isinstance(value, set | frozenset | tuple | list):
        items = [
            _plain(each, inside) for each in (sorted(value, key=repr) if isinstance(value, set | frozenset) else value)
        ]
        digest = hashlib.sha256(json.dumps(items).encode()).hexdigest()
        # Weights of a network, a long table of gains: that they are the same matters, not every one of them.
        return items if len(items) <= _LONGEST else {"items": len(items), "sha256": digest}
    try:
        state = object.__getstate__(value)
    except TypeError:  # a class of compiled code
        state = None
    tables = [table for table in (state if isinstance(state, tuple) else (state,)) if isinstance(table, dict)]
    return {
        **_source(type(value)),
        "settings": {str(k): _plain(v, inside) for table in tables for k, v in table.items()},
    }


@dataclass(frozen=True, slots=True)
class StudyFolder:
    """Folder of a study's results; file names are relative to ``path``, with ``/`` between folders.

    ``sound`` are the names of tables that were found as they had been written.
    """

    path: Path
    sound: set[str] = field(default_factory=set, compare=False, repr=False)

    def names(self) -> frozenset[str]:
        """Return the names of all files but temporary ones; DataError if the path is a file."""
        if self.path.exists() and not self.path.is_dir():
            raise DataError(f"{self.path}: is a file; the results need a folder")
        files = (path for path in self.path.rglob("*") if not path.is_dir() and LEFT_ASIDE not in path.name)
        return frozenset(path.relative_to(self.path).as_posix() for path in files)

    def write(self, name: str, content: bytes) -> None:
        """Write a file under a temporary name, then rename it."""
        write_file(self.path / name, content)

    def write_document(self, name: str, document: Mapping[str, Any]) -> None:
        """Write a JSON document with its own hash."""
        self.write(name, f"{json_text({**document, HASHES: hash_of(document)})}\n".encode())

    def document(self, name: str) -> dict[str, Any]:
        """Return a JSON document without its hash; ValueError unless the hash is that of the document."""
        document = json_document(read_regular_file(self.path / name, _MAXIMUM_BYTES_OF_DOCUMENT))
        if not isinstance(document, dict) or document.pop(HASHES, None) != hash_of(document):
            raise ValueError("does not have the content that was written")
        return document

    def write_chunk(self, number: int, failed: int, content: bytes) -> None:
        """Write the file of a chunk, then the note that marks it as finished, with the number of its failed runs."""
        self.write(chunk_file(number), content)
        note = {"failed": failed, "file": hashlib.sha256(content).hexdigest()}
        self.write_document(_note_of(chunk_file(number)), note)

    def finished(self, chunks: Sequence[Chunk]) -> dict[int, int]:
        """Return the number of failed runs of each chunk that is there, by chunk number."""
        found = {}
        for number in (chunk.number for chunk in chunks):
            with contextlib.suppress(OSError, ValueError):
                note = self.document(_note_of(chunk_file(number)))
                self._check(chunk_file(number), note["file"])
                found[number] = note["failed"]
        return found

    def table(self, name: str, columns: Sequence[str] | None = None, digest: str | None = None) -> "pa.Table":
        """Return a table of the study, or some of its columns; DataError if missing or damaged.

        ``digest`` is the SHA-256 of its file, by default that of the note of a chunk.
        """
        try:
            if name not in self.sound:
                self._check(name, digest or self.document(_note_of(name))["file"])
            return read_parquet((self.path / name).open("rb"), name, columns)
        except (DataError, OSError, ValueError) as error:
            said = f"{self.path}/{name}: is missing or damaged; run the study again into this folder to recompute it"
            raise DataError(said) from error

    def _check(self, name: str, digest: str) -> None:
        """Raise OSError or ValueError unless a file is there and has a SHA-256."""
        with (self.path / name).open("rb") as file:
            if hashlib.file_digest(file, HASHES).hexdigest() != digest:
                raise ValueError("does not have the content that was written")
        self.sound.add(name)


def study_folder(path: str | Path) -> StudyFolder:
    """Return the folder at a path; DataError for a remote address such as a URL."""
    if is_address(path):
        raise DataError(f"{path}: is a URL; give a folder on this computer for the results")
    return StudyFolder(Path(path).absolute())


def chunk_file(number: int) -> str:
    """Return the file name of a chunk, relative to the folder."""
    return f"runs/chunk-{number:07d}.parquet"


def _note_of(chunk: str) -> str:
    return f"finished/{Path(chunk).stem}.json"


def hash_of(document: Mapping[str, Any]) -> str:
    """Return the SHA-256 of a document."""
    return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()


def manifest(study: Study) -> dict[str, Any]:
    """Return the content of ``study.json``: study, base scenarios in SI units, draws, chunks, units of columns.

    Without time and computer: two studies with the same manifest have the same results.
    """
    scenarios = {}
    programs = {}
    for name, scenario in ((each.name, each.scenario) for each in study.configurations):
        document = scenario_document(scenario)
        custom = scenario.controller.custom
        # Without the file it came from, which may lie elsewhere the next time.
        del document["origin"]
        if custom is not None:
            document["controller"]["custom"] = controller_document(custom)
        scenarios[name] = document
        # The text of its program: elsewhere a law or a valve from a module of the user is a name. A comment says where
        # a function stands, which may be elsewhere the next time too.
        lines = write_source(plan_run(scenario).program, 1)[1].splitlines()
        code = "\n".join(line for line in lines if not line.startswith("#"))
        programs[name] = hashlib.sha256(code.encode()).hexdigest()[:DIGITS]
    document = {
        "format": FORMAT,
        "schema_version": SCHEMA_VERSION,
        "ppafo": __version__,
        "study": study.document,
        "scenarios": scenarios,
        # Draws may come from a parameter set, or have been changed in Python, and the file says neither.
        "drawn": plain({key: getattr(study, key) for key in ("axes", "drawn", "same", "scores", "sample", "outputs")}),
        "programs": programs,
        **({"overrides": study.changes} if study.changes else {}),
        "runs": study.runs,
        "chunks": len(chunks_of(study)),
        "shown": study.shown_for(study.configurations[0].scenario),
        "varied": {path: {"unit": study.units[path], "given": study.given.get(path, "")} for path in study.paths},
        "metrics": {
            name: {"unit": METRICS[name].unit, "summary": METRICS[name].summary} for name in study.outputs.metrics
        },
    }
    # As it will be read: tuples become lists.
    return dict(json.loads(json.dumps(document)))


def read_manifest(folder: StudyFolder) -> dict[str, Any]:
    """Return the manifest of a folder of results; DataError if there is none, or it is not as it was written."""
    try:
        document = folder.document(MANIFEST)
        if document["schema_version"] != SCHEMA_VERSION:
            raise ValueError("has another layout")
        return document
    except OSError as error:
        raise DataError(f"{folder.path}: contains no study results ({MANIFEST} cannot be read)") from error
    except ValueError as error:
        raise DataError(
            f"{folder.path}: {MANIFEST} is damaged, or of another version of ppafo; run the study into another folder"
        ) from error


def claim(
    study: Study, folder: StudyFolder, agreed: bool, threads: int | None, report: Report
) -> tuple[list[Chunk], dict[int, int]]:
    """Use a folder for a study; returns its chunks, and the failed runs of each that is there.

    Raises StudyError for results of another study or version, and for too little disk space.
    """
    for name in ("finished", "runs"):
        if (folder.path / name).is_symlink():
            raise StudyError(f"{folder.path / name}: is a link, but results stay in one folder; choose another folder")
    names = folder.names()
    asked = manifest(study)
    chunks = chunks_of(study)
    if MANIFEST in names:
        before = _leaves("", read_manifest(folder))
        now = _leaves("", asked)
        if changed := [name for name in {**now, **before} if before.get(name) != now.get(name)]:
            said = f"{changed[0]} was {quote(before.get(changed[0]))} and is now {quote(now.get(changed[0]))}"
            other = f"{folder.path}: contains the results of another study"
            raise StudyError(f"{other}: {said}; undo the change or choose another folder")
    elif names:
        raise StudyError(
            f"{folder.path}: is not empty and contains no study results (it has no {MANIFEST}); choose another folder"
        )
    else:
        needed = estimate_bytes(study)
        free = free_bytes(folder.path)
        size = f"{folder.path}: {study.runs:,} runs of '{study.name}' need about {needed / 1e6:,.3g} MB"
        if needed > free:
            raise StudyError(f"{size}, but only {free / 1e6:,.3g} MB are free: use fewer runs, metrics or trajectories")
        if needed > ASKED_ABOVE and not agreed:
            raise StudyError(f"{size}; give {argument_text('agreed', option='--yes')} to start the study")
        report(Progress("preparing", 0, study.runs))
        # A few runs of each configuration, spread evenly: a path that cannot vary is refused at once.
        total = study.runs_of_configuration
        runs = np.unique(np.linspace(0, total - 1, min(total, _TRIED_RUNS)).astype(np.int64))
        for configuration in study.configurations:
            _rows(study, configuration, drawn_values(study, runs), threads)
        folder.write_document(MANIFEST, asked)
    # Abandoned by age and not by process: the folder may be shared by machines that cannot see each other's processes.
    for path in folder.path.rglob(f"*{LEFT_ASIDE}*"):
        with contextlib.suppress(OSError):
            if path.lstat().st_mtime < time.time() - _LONGEST_WRITING:
                path.unlink()
    # After study.json, by which the folder is known to be ours.
    if study.text and STUDY_COPY not in names:
        folder.write(STUDY_COPY, study.text)
    return chunks, folder.finished(chunks)


def _leaves(path: str, value: Any) -> dict[str, Any]:
    """Return the values of a document by their dotted paths; a table of an array has its path or name there."""
    if isinstance(value, list) and any(isinstance(each, dict) for each in value):
        value = {each.get("path", each.get("name", str(number))): each for number, each in enumerate(value, start=1)}
    if not isinstance(value, dict):
        return {path: value}
    parts = (_leaves(f"{path}.{key}" if path else key, each) for key, each in value.items())
    return {name: leaf for part in parts for name, leaf in part.items()}


def estimate_bytes(study: Study) -> int:
    """Return an upper estimate of the disk space [bytes], without compression."""
    outputs = study.outputs
    samples = max(samples_of(study, configuration) for configuration in study.configurations)
    numbers = 2 + len(study.paths) + len(outputs.metrics) * (2 if outputs.errors else 1)
    traces = sum(_BYTES_OF_NUMBER if name in outputs.bands else _BYTES_OF_SAMPLE for name in outputs.traces)
    row = _FIXED_BYTES_OF_ROW + _BYTES_OF_NUMBER * numbers + samples * traces
    return study.runs * row + len(chunks_of(study)) * _BYTES_OF_FILE


def free_bytes(path: Path) -> int:
    """Return the free disk space [bytes] for a folder that may not exist yet."""
    return shutil.disk_usage(next(each for each in (path, *path.parents) if each.exists())).free


def compute_chunk(
    study: Study, part: Chunk, threads: int | None = None, count: Count = report_nothing
) -> tuple[int, bytes]:
    """Compute a chunk; returns the number of its failed runs and its file: a row per run in SI, nan for missing."""
    configuration = study.configurations[part.configuration]
    outputs = study.outputs
    values = drawn_values(study, np.arange(part.first, part.first + part.runs))
    rows, varied = _rows(study, configuration, values, threads, count)
    first = part.configuration * study.runs_of_configuration + part.first
    names = [each.name for each in study.configurations]
    own = np.full(part.runs, part.configuration)
    columns = {
        "run": (np.arange(first, first + part.runs, dtype=np.int64), _PLAIN, "number of the run in the study"),
        "configuration": (encode_texts(own, names), _PLAIN, "name of the base scenario"),
    }
    # Gauge pressures as absolute ones, each from the atmosphere of its run.
    in_effect = absolute(configuration.scenario, varied, study.gauge)
    for path, drawn in values.items():
        is_varied = study.varies(path, configuration.name)
        shown = in_effect.get(path, drawn) if is_varied else np.full(part.runs, np.nan)
        columns[path] = (shown, study.units[path], "varied value")
    truths = {
        OSCILLATES: "true where the loop oscillates, empty where that is not known",
        FOLLOWS: "true where the run follows its reference, empty where that is not known",
        ON_PURPOSE: "true where it does not, because the reference is beyond reach on purpose",
    }
    columns |= {
        "status": (encode_texts(rows["status"], STATUSES), _PLAIN, "how the run ended"),
        "failure_time": (rows["failure_time"], "s", "time at which the run diverged"),
        "reason": (rows["reason"], _PLAIN, "why the run has no metrics"),
        **{name: (encode_truths(rows[name]), _PLAIN, summary) for name, summary in truths.items()},
    }
    for name in outputs.metrics:
        unit = METRICS[name].unit
        error = f"{name}_error"
        columns[name] = (rows[name], stored_unit(unit), METRICS[name].summary)
        if outputs.errors:
            columns[error] = (rows[error], "Pa_d" if unit == "Pa" else unit, f"estimated error of {name}")
    for channel in outputs.traces:
        trace = rows[trace_column(channel)]
        trace = trace if trace.size else np.full((part.runs, samples_of(study, configuration)), np.nan)
        # Channels with bands are kept as they were computed, all others in single precision.
        trace = trace.astype(np.float64 if channel in outputs.bands else np.float32)
        summary = f"{CHANNELS[channel].summary}, every {outputs.every:g} s"
        columns[trace_column(channel)] = (trace, stored_unit(CHANNELS[channel].unit), summary)
    facts = {"study": study.name, "chunk": str(part.number), "rows": str(part.runs), "every": f"{outputs.every!r} s"}
    return int(np.count_nonzero(rows[FAILED])), parquet_bytes(columns, facts)


def _rows(
    study: Study,
    configuration: Configuration,
    values: dict[str, Floats],
    threads: int | None,
    count: Count = report_nothing,
) -> tuple[Rows, dict[str, Floats]]:
    """Return rows of a configuration with varied ``values`` [SI], and its columns; StudyError for a fixed path."""
    outputs = study.outputs
    columns = varied_columns(study, configuration, values)
    kept = {"bands": outputs.traces, "every": outputs.every * bool(outputs.traces), "errors": outputs.errors}
    with refused_as(StudyError, f"configuration '{configuration.name}'", StudyError):
        base = configuration.scenario
        return run_judged(base, outputs.metrics, study.gauge, threads, columns, count=count, **kept), columns


def trace_column(channel: str) -> str:
    """Return the name of the column with the trace of a channel."""
    return f"{channel}{OVER_TIME}"


def stored_unit(unit: str) -> str:
    """Return the unit for tables: pressures are absolute (``Pa_a``) or differences (``Pa_d``), never plain Pa.

    Pa as the unit of a metric or channel is absolute.
    """
    return "Pa_a" if unit == "Pa" else unit
