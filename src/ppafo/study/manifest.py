"""Manifest of study results (``study.json``): definition of the study, its runs and chunks, units of its columns."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from ppafo.documents.json_text import plain
from ppafo.documents.models import validate
from ppafo.documents.toml_text import quote
from ppafo.engine.lanes import write_source
from ppafo.errors import DataError, StudyError, UnitError
from ppafo.metrics import METRICS
from ppafo.parameters.declaration import fits
from ppafo.signals.recording import CHANNELS
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import scenario_document
from ppafo.storage.result_folder import MANIFEST, RUN_FILE
from ppafo.studies.declaration import DEFAULT_SEED
from ppafo.studies.study import Study
from ppafo.study.blocks import chunk_count, chunk_size
from ppafo.study.controller_document import DIGITS, controller_document
from ppafo.study.folder import StudyFolder
from ppafo.units import to_si
from ppafo.units.shown import GAUGE_ZERO
from ppafo.version import __version__
from ppafo.wording import one_line

STUDY_COPY = "study.toml"
FORMAT = "ppafo study results"
SCHEMA_VERSION = 2
_NAMED = 4
"""Largest number of differences between studies named in an error message."""
_COMPARED = ("ppafo", "study", "scenarios", "varied", "drawn", "programs")
"""Keys of the manifest that must be equal for a study to continue with earlier results."""


def manifest(study: Study) -> dict[str, Any]:
    """Return the manifest: study, base scenarios in SI units, runs, units of columns; without time and computer."""
    scenarios: dict[str, Any] = {}
    programs: dict[str, str] = {}
    for configuration in study.configurations:
        document = _plain(scenario_document(configuration.scenario))
        custom = configuration.scenario.controller.custom
        # Without the file it came from, which may lie elsewhere the next time.
        del document["origin"]
        if custom is not None:
            document["controller"]["custom"] = controller_document(custom)
        scenarios[configuration.name] = document
        # What it computes: a law or a valve from a module of the user is a name elsewhere. A line of comment says where
        # a function stands, which may be elsewhere the next time too.
        lines = write_source(plan_run(configuration.scenario).program, 1)[1].splitlines()
        code = "\n".join(line for line in lines if not line.startswith("#"))
        programs[configuration.name] = hashlib.sha256(code.encode()).hexdigest()[:DIGITS]
    # What is drawn may come from a parameter set, or have been changed in Python, and the file says neither.
    parts = {name: getattr(study, name) for name in ("axes", "drawn", "same", "scores", "sample", "outputs")}
    drawn = _plain(plain(parts))
    requested = {
        "ppafo": __version__,
        "study": _plain(study.document),
        "scenarios": scenarios,
        "drawn": drawn,
        "programs": programs,
    }
    return {
        "format": FORMAT,
        "schema_version": SCHEMA_VERSION,
        **requested,
        **({"overrides": list(study.changes)} if study.changes else {}),
        "sha256": hashlib.sha256(json.dumps(requested, sort_keys=True).encode()).hexdigest(),
        "runs": study.runs,
        "runs_of_configuration": study.runs_of_configuration,
        "chunks": chunk_count(study),
        "runs_of_chunk": chunk_size(study),
        "shown": study.shown_for(study.configurations[0].scenario),
        "varied": {path: {"unit": study.units[path], "given": study.given.get(path, "")} for path in study.paths},
        "metrics": {
            name: {"unit": METRICS[name].unit, "summary": METRICS[name].summary} for name in study.outputs.metrics
        },
    }


def read_manifest(folder: StudyFolder) -> dict[str, Any]:
    """Return the manifest of a folder of results; DataError if there is none."""
    try:
        document = folder.read_document(MANIFEST)
    except (OSError, ValueError) as error:
        remedy = "; read the result of a run by read_result" * (folder.path / RUN_FILE).is_file()
        raise DataError(f"{folder.path}: contains no study results ({MANIFEST} cannot be read){remedy}") from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise DataError(f"{folder.path}: {MANIFEST} does not describe a study; choose the folder of a study")
    if document.get("schema_version") != SCHEMA_VERSION:
        raise DataError(
            f"{folder.path}: has schema_version {quote(document.get('schema_version'))}, this version of ppafo reads "
            f"{SCHEMA_VERSION}; run the study again"
        )
    validate(_Stored, document, f"{folder.path}: {MANIFEST}", DataError)
    return document


def _channel(name: str) -> str:
    """Validate the name of a channel; ValueError for an unknown name."""
    if name not in CHANNELS:
        raise ValueError(f"there is no channel '{one_line(name)}'")
    return name


_Channel = Annotated[str, AfterValidator(_channel)]


class _Part(BaseModel):
    """Base class of tables of the manifest; unknown keys, written by later versions, are ignored."""

    model_config = ConfigDict(strict=True)


class _Named(_Part):
    name: str


class _StoredSample(_Part):
    method: str
    runs: int
    seed: int = DEFAULT_SEED


class _StoredVaried(_Part):
    path: str
    kind: str
    spacing: str = ""


class _StoredCorrelation(_Part):
    between: Annotated[list[str], Field(min_length=2, max_length=2)]
    coefficient: float


class _StoredOutputs(_Part):
    bands: list[_Channel] = Field(default_factory=list)
    trajectories: list[_Channel] = Field(default_factory=list)


class _StoredStudy(_Named):
    description: str = ""
    configurations: Annotated[list[_Named], Field(min_length=1)]
    sample: _StoredSample | None = None
    correlations: list[_StoredCorrelation] = Field(default_factory=list)
    vary: list[_StoredVaried] = Field(default_factory=list)
    outputs: _StoredOutputs


class _StoredUnit(_Part):
    unit: str
    given: str = ""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        """Raise ValueError for a display unit of another dimension."""
        if self.given and not fits(self.given, self.unit):
            raise ValueError(
                f"given: the unit '{one_line(self.given)}' cannot express a value in '{one_line(self.unit)}'"
            )
        return self


class _StoredAssumption(_Part):
    path: str
    value: str
    note: str


class _StoredScenario(_Part):
    assumptions: list[_StoredAssumption]


class _Stored(_Part):
    """Manifest as read from a folder: required fields, checked for consistency."""

    study: _StoredStudy
    scenarios: dict[str, _StoredScenario]
    sha256: str
    runs: Annotated[int, Field(ge=1)]
    chunks: Annotated[int, Field(ge=1)]
    varied: dict[str, _StoredUnit]
    metrics: dict[str, _StoredUnit]
    shown: dict[str, str] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        """Raise ValueError for chunks that do not fit the configurations, missing units, or invalid display units."""
        names = [configuration.name for configuration in self.study.configurations]
        if len(set(names)) < len(names) or self.chunks % len(names) or self.chunks > self.runs:
            raise ValueError(
                f"{self.chunks} chunks of {self.runs} runs do not match {len(names)} configurations; run the study "
                "again"
            )
        if lost := [number.path for number in self.study.vary if number.path not in self.varied]:
            raise ValueError(f"'{one_line(lost[0])}' varies, but has no unit in 'varied'")
        for si_unit, unit in self.shown.items():
            try:
                to_si(1.0, "Pa_a" if si_unit == GAUGE_ZERO else unit, "Pa_a" if si_unit == GAUGE_ZERO else si_unit)
            except UnitError as error:
                raise ValueError(f"shown: {one_line(error)}") from error
        return self


def check_same_study(folder: StudyFolder, stored: Mapping[str, Any], requested: Mapping[str, Any]) -> None:
    """Raise StudyError for results of another study, or of an earlier version of this study."""
    before, now = stored.get("study", {}), requested["study"]
    if before.get("name") != now["name"]:
        raise StudyError(
            f"{folder.path}: contains the results of the study '{before.get('name')}', not of '{now['name']}'; "
            "choose another folder"
        )
    changed = [line for key in _COMPARED for line in _differences(key, stored.get(key), requested[key])]
    if changed:
        named = "; ".join(changed[:_NAMED]) + (f"; and {len(changed) - _NAMED} more" if len(changed) > _NAMED else "")
        raise StudyError(
            f"{folder.path}: contains results of an earlier version of '{now['name']}': {named}; undo the change "
            "or choose another folder"
        )


def _plain(document: Any) -> Any:
    """Return a document after a round trip through JSON: tuples become lists."""
    return json.loads(json.dumps(document))


def _differences(path: str, before: Any, now: Any) -> Iterator[str]:
    """Yield a line for every key at which two documents differ."""
    if isinstance(before, dict) and isinstance(now, dict):
        for key in dict.fromkeys((*before, *now)):
            yield from _differences(f"{path}.{key}", before.get(key), now.get(key))
    elif isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
        for number, (old, new) in enumerate(zip(before, now, strict=True), start=1):
            label = new.get("path", new.get("name", number)) if isinstance(new, dict) else number
            yield from _differences(f"{path}[{label}]", old, new)
    elif before != now:
        yield f"{path.removeprefix('study.')} was {quote(before)} and is now {quote(now)}"
