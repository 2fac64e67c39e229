"""From a name, a file or plain data to a tuning in SI units; every mistake is one clear line."""

import copy
from collections.abc import Callable, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ppafo.documents.problems import first_problem
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import ParameterError, ScenarioError, StudyError, UnitError
from ppafo.simulation.loading import list_scenarios, load_scenario
from ppafo.simulation.scenario import Scenario
from ppafo.studies.sweep.loading import list_studies, load_study
from ppafo.studies.sweep.noise import NOISE
from ppafo.studies.sweep.paths import varied_path
from ppafo.studies.tuning import declaration as declared
from ppafo.studies.tuning.present import present_value
from ppafo.studies.tuning.problem import Constraint, Effort, Goal, Problem, Searched, Spread
from ppafo.studies.uncertainty.draws import Uncertainty, uncertainty_of
from ppafo.studies.uncertainty.metric_values import difference_of, level_of
from ppafo.studies.uncertainty.outcomes import check_metrics

_FILE = TomlKind("tuning", "tuning", resources.files("ppafo") / "studies" / "tuning" / "library", StudyError)

NOISE_DRAWS = 16
"""Noise streams over which every candidate is judged where nothing else is uncertain."""

Refusal = Callable[[object], StudyError]


def list_tunings() -> tuple[str, ...]:
    """Return the names of the tunings that come with the package."""
    return _FILE.names()


def load_tuning(tuning: str | Path | Mapping[str, Any], overrides: Sequence[str] = ()) -> Problem:
    """Return a tuning by its name in the package, by the path of a TOML file, or from data laid out as such a file.

    ``overrides`` change the scenario. StudyError for anything that is not usable.
    """
    if isinstance(tuning, Mapping):
        _FILE.check_depth(tuning, "tuning")
        return _problem(copy.deepcopy(dict(tuning)), "tuning", Path(), overrides)
    file = label(str(tuning))
    return _problem(_FILE.parse(_FILE.read(tuning), file), file, Path(tuning).parent, overrides)


def _problem(document: dict[str, Any], file: str, folder: Path, overrides: Sequence[str]) -> Problem:
    def refusal(text: object) -> StudyError:
        return StudyError(f"{file}: {text}")

    try:
        parsed = declared.TuningFile.model_validate(document)
    except ValidationError as error:
        raise refusal(first_problem(error.errors(include_url=False), declared.TuningFile)) from error
    try:
        scenario = load_scenario(_placed(parsed.scenario, list_scenarios(), folder), (*parsed.overrides, *overrides))
        check_metrics(_once([*parsed.objective, *parsed.constraints]), scenario)
    except (ScenarioError, ParameterError, StudyError) as error:
        raise refusal(error) from error
    searched = _searched(parsed, scenario, refusal)
    return Problem(
        name=parsed.name,
        description=" ".join(parsed.description.split()),
        scenario=scenario,
        overrides=(*parsed.overrides, *overrides),
        searched=searched,
        goals=tuple(_goal(item, refusal) for item in parsed.objective),
        constraints=tuple(_constraint(item, refusal) for item in parsed.constraints),
        spread=_spread(parsed, folder, [item.path for item in searched], scenario, refusal),
        effort=Effort(**parsed.effort.model_dump()),
    )


def _placed(name: str, known: Sequence[str], folder: Path) -> str:
    """Return a name of the package as it is, and a path as it is from here."""
    return name if name in known or (Path(name).suffix != ".toml" and "/" not in name) else str(folder / name)


def _once(items: Sequence[declared.Goal | declared.Constraint]) -> list[str]:
    return list(dict.fromkeys(item.metric for item in items))


def _searched(parsed: declared.TuningFile, scenario: Scenario, refusal: Refusal) -> tuple[Searched, ...]:
    paths = [item.path for item in parsed.search]
    repeated = next((path for path in paths if paths.count(path) > 1), None)
    if repeated is not None:
        raise refusal(f"'{repeated}' is searched twice; give it one [[search]] alone")
    return tuple(_one_searched(item, scenario, refusal) for item in parsed.search)


def _one_searched(item: declared.Searched, scenario: Scenario, refusal: Refusal) -> Searched:
    try:
        place = varied_path(item.path, scenario)
        minimum, maximum = place.level(item.minimum), place.level(item.maximum)
        before = present_value(item.path, scenario)
    except (UnitError, ScenarioError) as error:
        raise refusal(f"search '{item.path}': {error}") from error
    if item.path == NOISE:
        raise refusal(f"search '{item.path}': the noise is drawn for every candidate alike, so it cannot be searched")
    if minimum >= maximum:
        raise refusal(f"search '{item.path}': minimum = {item.minimum!r} must be less than maximum = {item.maximum!r}")
    is_logarithmic = item.spacing == "logarithmic"
    if is_logarithmic and minimum <= 0.0:
        raise refusal(f"search '{item.path}': spacing = 'logarithmic' needs a minimum above 0, not {item.minimum!r}")
    return Searched(item.path, minimum, maximum, is_logarithmic, before, place)


def _goal(item: declared.Goal, refusal: Refusal) -> Goal:
    if item.weight == 0.0:
        raise refusal(f"objective '{item.metric}': weight = 0 asks for nothing; leave it out")
    if item.scale is None:
        return Goal(item.metric, item.weight, None)
    try:
        scale = difference_of(item.scale, item.metric, f"objective '{item.metric}': scale = '{item.scale}'")
    except StudyError as error:
        raise refusal(error) from error
    if scale <= 0.0:
        raise refusal(f"objective '{item.metric}': scale = '{item.scale}' must be more than 0")
    return Goal(item.metric, item.weight, scale)


def _constraint(item: declared.Constraint, refusal: Refusal) -> Constraint:
    given = [text for text in (item.at_most, item.at_least) if text is not None]
    if len(given) != 1:
        raise refusal(
            f"constraint '{item.metric}': needs either at_most or at_least, it has {'both' if given else 'none'}"
        )
    try:
        limit = level_of(given[0], item.metric, f"constraint '{item.metric}' = '{given[0]}'")
    except StudyError as error:
        raise refusal(error) from error
    return Constraint(item.metric, limit, item.at_most is not None, given[0])


def _spread(
    parsed: declared.TuningFile, folder: Path, searched: Sequence[str], scenario: Scenario, refusal: Refusal
) -> Spread | None:
    """Return what the candidates are judged over: draws of a study, of the noise, of both, or nothing."""
    robust = parsed.robust
    if robust is None:
        noise = Uncertainty(()).hearing([scenario])
        return Spread(noise, "", NOISE_DRAWS, parsed.effort.seed, 0.0, None) if noise.drawn else None
    try:
        study = load_study(_placed(robust.study, list_studies(), folder))
        uncertainty = _without_restriction(uncertainty_of(study), study.only).hearing([scenario])
    except StudyError as error:
        raise refusal(f"robust: {error}") from error
    both = next((path for path in uncertainty.paths if path in searched), None)
    if both is not None:
        raise refusal(f"robust: study '{study.name}' draws '{both}', which is searched here; it cannot be both")
    share = robust.share if robust.measure == "quantile" else None
    return Spread(uncertainty, study.name, robust.draws, study.sample.seed, robust.deviations, share)


def _without_restriction(uncertainty: Uncertainty, only: Mapping[str, Sequence[str]]) -> Uncertainty:
    if only:
        path = next(iter(only))
        raise StudyError(f"'{path}' varies only in some configurations of the study; a tuning needs one without 'only'")
    return uncertainty
