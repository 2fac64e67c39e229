"""Loading of a study by name, file or plain data into SI units, with a one-line error for each mistake."""

import copy
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.arguments import Count, Overrides, Seed, checked
from ppafo.documents.toml_text import TomlFile, TomlKind
from ppafo.errors import (
    DataError,
    Faults,
    ParameterError,
    ScenarioError,
    StudyError,
    UnitError,
    refused_as,
)
from ppafo.loading import load_scenario, placed
from ppafo.metrics import METRICS
from ppafo.parameters.graph import ATMOSPHERE_PATH
from ppafo.parameters.overrides import other_forms, override_set, read_overrides
from ppafo.parameters.records import checked_record
from ppafo.plugins import Plugins
from ppafo.simulation.ensemble import lacking
from ppafo.simulation.numbers import changes_in, chosen_path
from ppafo.studies.declaration import NOT_RANDOM, SAME_AS, ConfigurationSection, Correlation, StudyFile
from ppafo.studies.draws import MAXIMUM_SOBOL_DIMENSIONS, Factor, Uncertainty, cholesky_factor, uncertainty_of
from ppafo.studies.study import (
    DEFAULT_SEED,
    NO_SAMPLE,
    Axis,
    Configuration,
    RandomValue,
    SamplingPlan,
    Study,
    configurations_with,
    valid_outputs,
)
from ppafo.studies.varying import (
    VariedPath,
    axis_or_distribution,
    stated_normal,
    texts_of,
    varied_path,
)
from ppafo.units.shown import shown_unit
from ppafo.wording import check_known, first_twice, known_names

_CLOSEST = 1.0 - 1.0e-11
"""Largest coefficient of a correlation matrix that is still positive definite; scores then differ by 5e-6."""
FILE = TomlKind("study", "study", resources.files("ppafo") / "studies" / "library", StudyError)


def list_studies() -> tuple[str, ...]:
    """Return the names of the shipped studies.

    >>> import ppafo
    >>> ppafo.list_studies()
    ('gas-of-a-stride', 'pressure-and-area', 'torque-task-uncertainty', 'wearers')
    """
    return FILE.names()


@checked
def load_study(
    study: str | Path | Mapping[str, Any],
    overrides: Overrides = (),
    *,
    draws: Count | None = None,
    seed: Seed | None = None,
    plugins: Plugins = (),
) -> Study:
    """Load a study.

    Arguments:
        study: name of a study, a .toml file, or data laid out as such a file
        overrides: values to change, as texts or a dictionary; of one configuration: 'NAME:PATH=VALUE'
        draws: number of draws, instead of the number in the file
        seed: random seed, instead of the seed in the file
        plugins: modules of your own, files or names, whose objects files may name

    Returns:
        the Study, checked

    Raises:
        StudyError: a study that cannot be used

    >>> import ppafo
    >>> study = ppafo.load_study("torque-task-uncertainty", draws=64)
    >>> [configuration.name for configuration in study.configurations]
    ['proportional', 'solenoid']
    """
    return _load(read_source(FILE, study), tuple(overrides), draws, seed)


def read_source(kind: TomlKind, named: str | Path | Mapping[str, Any]) -> TomlFile:
    """Read a TOML file of a ``kind``, by name or path, or plain data; the document may be changed."""
    if not isinstance(named, Mapping):
        return kind.load(named)
    kind.check_depth(named, kind.noun)
    return TomlFile(kind.noun, copy.deepcopy(dict(named)), kind.error)


def study_of(
    study: Study | str | Path | Mapping[str, Any],
    overrides: Iterable[str] = (),
    draws: int | None = None,
    seed: int | None = None,
) -> Study:
    """Load a study by name, file or data; return a loaded study unchanged, with StudyError for changes to it."""
    if not isinstance(study, Study):
        return load_study(study, overrides, draws=draws, seed=seed)
    if tuple(overrides) or draws is not None or seed is not None:
        raise StudyError("a loaded Study accepts no overrides, draws or seed; give these to load_study")
    return study


def drawn_in(
    study: Study | str | Path | Mapping[str, Any], overrides: Iterable[str], name: str | None, independent: bool = False
) -> tuple[Study, Configuration, Uncertainty]:
    """Return a study, one of its configurations, and the distributions in this configuration, with sensor noise.

    ``independent`` omits the correlations; overrides change the chosen configuration only. Raises StudyError for a name
    that is missing or unknown, for changes that the configuration refuses, and where nothing has a distribution.
    """
    changes = tuple(overrides)
    chosen = study_of(study, changes if isinstance(study, Study) else ())
    configurations = {configuration.name: configuration for configuration in chosen.configurations}
    if name is None and len(configurations) > 1:
        raise StudyError(f"study '{chosen.name}' has several configurations; choose one: {', '.join(configurations)}")
    name = next(iter(configurations)) if name is None else name
    check_known(name, configurations, StudyError, f"study '{chosen.name}' has no configuration '{name}'")
    base = configurations[name]
    if changes and not isinstance(study, Study):
        # The configuration alone, as the others may refuse the changes; without what it does not have.
        source = read_source(FILE, study)
        document = source.document
        document["configurations"] = [table for table in document["configurations"] if table["name"] == name]
        varied = [table for table in document.get("vary", ()) if name in table.pop("only", [name])]
        paths = {table["path"] for table in varied}
        document["vary"] = [table for table in varied if table.get(SAME_AS, table["path"]) in paths]
        pairs = document.get("correlations", ())
        document["correlations"] = [table for table in pairs if paths.issuperset(table["between"])]
        metrics = [metric for metric in chosen.outputs.metrics if not lacking(base.scenario, METRICS[metric])]
        document["outputs"] = {"metrics": metrics}
        chosen = _load(source, changes)
        base = chosen.configurations[0]
    whole = uncertainty_of(chosen)
    kept = [row for row, drawn in enumerate(whole.drawn) if chosen.varies(drawn.path, name)]
    if not kept:
        raise StudyError(f"study '{chosen.name}': no value has a distribution in configuration '{name}'")
    scores = None if independent else whole.scores
    if scores is not None and len(kept) < len(whole.drawn):
        # Rows of a factor are no factor of the correlation among some paths: that is factored anew.
        lower = np.asarray(scores)
        factor = np.linalg.cholesky((lower @ lower.T)[np.ix_(kept, kept)])
        scores = tuple(map(tuple, factor.tolist()))
    drawn = tuple(whole.drawn[row] for row in kept)
    used = Uncertainty(drawn, scores, chosen.same_in(name), chosen.gauge)
    return chosen, base, used.with_noise_of([base.scenario])


def _load(
    source: TomlFile,
    changes: tuple[str, ...],
    draws: int | None = None,
    seed: int | None = None,
) -> Study:
    """Build a study from a document, into which changes, draws and seed from the command line are written."""
    document = source.document
    tables = document.get("vary")
    for table in tables if isinstance(tables, list | tuple) else ():
        # Files omit the kind of a table with the key `same_as`.
        if isinstance(table, dict) and SAME_AS in table:
            table.setdefault("kind", SAME_AS)
    parsed = checked_record(StudyFile, source)
    sampling = {key: value for key, value in (("runs", draws), ("seed", seed)) if value is not None}
    with refused_as(StudyError, source.label, StudyError):
        if changes:
            unchanged = [_configuration(section, source.folder) for section in parsed.configurations]
            changed = configurations_with(unchanged, changes)
            for table, configuration in zip(document["configurations"], changed, strict=True):
                table["overrides"] = list(configuration.scenario.origin.overrides)
        if sampling and parsed.sample is None:
            is_random = any(entry["kind"] not in NOT_RANDOM for entry in parsed.vary)
            raise StudyError(
                NO_SAMPLE if is_random else "has no [sample], so the runs are not random; omit draws and seed"
            )
        if sampling:
            document["sample"] |= sampling
    parsed = checked_record(StudyFile, source)
    with refused_as(StudyError, source.label, StudyError):
        return _build(parsed, source, changes)


def _build(parsed: StudyFile, source: TomlFile, changes: tuple[str, ...]) -> Study:
    """Build the study of a parsed study file in SI units; StudyError with all mistakes that stand in the file."""
    wrong = Faults()
    configurations = []
    vary = parsed.vary
    sections = parsed.configurations
    paths = [entry["path"] for entry in parsed.vary]
    for section in sections:
        with wrong:
            configurations.append(_configuration(section, source.folder))
    unique = {
        "two configurations are named '{}'; give every configuration a different name": [
            each.name for each in sections
        ],
        "'{}' is varied twice; omit one [[vary]]": paths,
    }
    wrong += [StudyError(text.format(twice)) for text, names in unique.items() if (twice := first_twice(names))]
    if not paths and len(sections) == 1:
        wrong.append(StudyError("varies nothing: give at least one [[vary]] or a second configuration"))
    # Rows of channels over time are lists of one length, and bands are quantiles at one time.
    if "run.duration" in paths and parsed.outputs.traces:
        said = "'run.duration' cannot vary with trajectories or bands, which need runs of equal length"
        wrong.append(StudyError(said))
    # All else is about the scenarios.
    wrong.raise_all()
    scenarios = [configuration.scenario for configuration in configurations]
    varied = {}
    independent = []
    followed = {entry["path"]: entry[SAME_AS] for entry in vary if entry["kind"] == SAME_AS}
    for entry in vary:
        with wrong:
            varied[entry["path"]], values = _varied(entry, configurations, ATMOSPHERE_PATH in paths)
            independent += [] if values is None else [values]
        for section, configuration in zip(sections, configurations, strict=True):
            with wrong:
                _check_not_set(entry, section, configuration)
    for path, other in followed.items():
        said = f"vary '{path}': same_as = '{other}'"
        leading = [each for each in paths if each not in followed]
        # A path that is refused itself has no unit.
        units = [varied[each].quantity.unit or "-" for each in (path, other) if each in varied]
        if other not in leading:
            hint = known_names(other, leading)
            wrong.append(StudyError(f"{said} must be the path of another [[vary]] without same_as{hint}"))
        elif len(set(units)) > 1:
            both = f"{said} has the unit '{units[1]}', but '{path}' has '{units[0]}'; both need the same unit"
            wrong.append(StudyError(both))
    uncertainty = Uncertainty(tuple(each for each in independent if isinstance(each, RandomValue)))
    random = [entry["path"] for entry in vary if entry["kind"] not in NOT_RANDOM]
    with wrong:
        uncertainty = replace(uncertainty, scores=_scores(parsed.correlations, random))
    outputs = parsed.outputs
    sample = parsed.sample
    with wrong:
        outputs = valid_outputs(outputs, scenarios)
    # A grid alone is run once, with the noise that its scenarios write.
    if uncertainty.drawn and not wrong:
        uncertainty = uncertainty.with_noise_of(scenarios, paths)
    drawn = uncertainty.drawn
    if sample is not None and not random:
        wrong.append(StudyError("[sample] is given, but no value has a distribution; omit [sample]"))
    # The direction numbers of SciPy's sequence end there.
    elif sample is not None and sample.method == "sobol" and len(drawn) > MAXIMUM_SOBOL_DIMENSIONS:
        wrong.append(StudyError(f"sample.method = 'sobol' allows at most {MAXIMUM_SOBOL_DIMENSIONS} distributions"))
    wrong.raise_all()
    # The noise, which has no [[vary]] table, is a plain number.
    units_of = {number.path: "-" for number in drawn} | {
        path: each.quantity.unit or "-" for path, each in varied.items()
    }
    given = {path: each.given for path, each in varied.items() if each.given}
    # A number that follows a gauge pressure counts from the atmosphere of its run as well.
    gauge = {path for path, each in varied.items() if each.is_gauge}
    return Study(
        name=parsed.name,
        description=" ".join(parsed.description.split()),
        configurations=tuple(configurations),
        axes=tuple(axis for axis in independent if isinstance(axis, Axis)),
        drawn=drawn,
        same=followed,
        scores=uncertainty.scores,
        # One run at each point of a grid; a seed is enough where something else draws, such as a sensitivity analysis.
        sample=sample or SamplingPlan(None, 1, DEFAULT_SEED if drawn else 0),
        outputs=outputs,
        runs_of_chunk=parsed.runs_of_chunk,
        units=units_of,
        given={path: unit for path, unit in given.items() if unit != shown_unit(varied[path].quantity.unit, {})},
        gauge=frozenset(gauge | {path for path, other in followed.items() if other in gauge}),
        only={entry["path"]: entry["only"] for entry in vary if entry.get("only")},
        document=source.document,
        text=source.content,
        changes=changes_in(*scenarios, overrides=changes),
    )


def _configuration(section: ConfigurationSection, folder: Path) -> Configuration:
    """Load the scenario of a configuration section, with its overrides."""
    with refused_as(StudyError, f"configuration '{section.name}'", ScenarioError, ParameterError, DataError):
        return Configuration(section.name, load_scenario(placed(section.scenario, folder), section.overrides))


def _varied(
    entry: Mapping[str, Any], configurations: Sequence[Configuration], atmosphere_varies: bool
) -> tuple[VariedPath, Axis | RandomValue | None]:
    """Return a varied path, and its values or distribution in SI; None for one that takes those of another path."""
    names = [each.name for each in configurations]
    path = entry["path"]
    only = entry.get("only")
    with refused_as(StudyError, f"vary '{path}'", ScenarioError, UnitError):
        for name in only or ():
            check_known(name, names, UnitError, f"only: there is no configuration '{name}'")
        scenarios = [each.scenario for each in configurations if not only or each.name in only]
        texts = texts_of(entry)
        varied, *others = (varied_path(path, scenario, texts, atmosphere_varies) for scenario in scenarios)
        if any(other != varied for other in others):
            raise UnitError("differs in unit, limits or atmosphere between configurations; use 'only'")
        if entry["kind"] == SAME_AS:
            return varied, None
        if entry["kind"] != "stated":
            return varied, axis_or_distribution(entry, varied)
        (distribution, unit), *more = (stated_normal(varied, each) for each in scenarios)
        # One draw is run in every configuration, so all of them must mean the same distribution.
        if any(other != distribution for other, _ in more):
            raise UnitError("the parameter sets of the configurations state different values; use 'only'")
        is_gauge = varied_path(path, scenarios[0], [f"0 {unit}"], atmosphere_varies).is_gauge
        zero = varied.atmosphere if is_gauge else 0.0
        return replace(varied, is_gauge=is_gauge), RandomValue(path, replace(distribution, zero=zero))


def _check_not_set(entry: Mapping[str, Any], section: ConfigurationSection, configuration: Configuration) -> None:
    """Raise StudyError for a path that is both set and varied in a configuration, in any form (area, conductance)."""
    overrides = read_overrides(section.overrides, StudyError)
    path = chosen_path(entry["path"], configuration.scenario)
    only = entry.get("only")
    set_values = override_set(overrides, StudyError, valve=configuration.scenario.device.valve_name)
    # The varied column replaces the value in every run, whichever form of it is set.
    ignored = next((form for form in (path, *other_forms(path)) if form in set_values), None)
    # A stated uncertainty is about the value that is set.
    is_meant = entry["kind"] == "stated" and ignored == path
    if ignored is not None and not is_meant and (not only or configuration.name in only):
        raise StudyError(
            f"configuration '{configuration.name}': '{set_values[ignored]}' is set and '{entry['path']}' is varied: "
            "omit one of them, or restrict the [[vary]] to other configurations with 'only'"
        )


def _scores(correlations: Sequence[Correlation], paths: Sequence[str]) -> Factor | None:
    """Return the lower Cholesky factor of the correlation of the normal scores; None without correlations."""
    if not correlations:
        return None
    coefficients: dict[tuple[str, str], float] = {}
    for pair in correlations:
        first, other = pair.between
        for path in pair.between:
            check_known(path, paths, StudyError, f"correlations: '{path}' has no distribution")
        if first == other or (first, other) in coefficients or (other, first) in coefficients:
            raise StudyError(
                f"correlations: between = ['{first}', '{other}'] must name two different paths, and each pair only once"
            )
        coefficients[first, other] = min(max(pair.coefficient, -_CLOSEST), _CLOSEST)
    matrix = np.eye(len(paths))
    for (first, other), coefficient in coefficients.items():
        row = paths.index(first)
        column = paths.index(other)
        matrix[row, column] = matrix[column, row] = coefficient
    factor = cholesky_factor(matrix)
    if factor is None:
        shown = ", ".join(f"{first} with {other}: {value:g}" for (first, other), value in coefficients.items())
        raise StudyError(
            f"correlations: the correlation matrix is not positive definite ({shown}); reduce the coefficients"
        )
    return factor
