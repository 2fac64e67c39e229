"""``study.json``: whose results a folder holds, complete enough to refuse those of another study by what differs."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from ppafo.documents.json_text import json_text
from ppafo.documents.models import validate
from ppafo.documents.problems import quote
from ppafo.engine.lanes import write_source
from ppafo.errors import DataError, StudyError
from ppafo.metrics import METRICS
from ppafo.questions.sweep.bands import Bins
from ppafo.questions.sweep.chunks import chunk_count, chunk_size
from ppafo.questions.sweep.python_controller import controller_document
from ppafo.simulation.document import plain, scenario_document
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from ppafo.storage.places import Place, read_document
from ppafo.studies.study import Study
from ppafo.version import __version__

MANIFEST = "study.json"
STUDY_COPY = "study.toml"
FORMAT = "ppafo study results"
SCHEMA_VERSION = 1
_NAMED = 4
_COMPARED = ("ppafo", "study", "scenarios", "varied", "drawn", "programs")
_DIGITS = 16
"""Digits of the hash of a program."""

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
