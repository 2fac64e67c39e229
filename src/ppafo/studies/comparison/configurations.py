"""The configurations of a comparison, by name, and their scenarios on each task."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ppafo.errors import StudyError, nearest_name
from ppafo.simulation.loading import load_scenario, scenario_from_dict
from ppafo.simulation.scenario import Scenario
from ppafo.studies.sweep.study import Configuration, Study

Configurations = Mapping[str, Scenario | str | Path] | Sequence[Scenario | str | Path]


@dataclass(frozen=True, slots=True)
class Placed:
    """A configuration on a task: the two names and the scenario."""

    task: str
    configuration: str
    scenario: Scenario


def chosen_configurations(
    configurations: Configurations | None, study: Study | None, overrides: Sequence[str]
) -> tuple[Configuration, ...]:
    """Return what is compared: the given scenarios, else those of the study; at least two, each with its own name."""
    if configurations is None:
        if study is None:
            raise StudyError("nothing to compare: give scenarios, a study, or both")
        found = study.configurations
    else:
        _check_no_restriction(study)
        pairs = configurations.items() if isinstance(configurations, Mapping) else _named(configurations)
        found = tuple(Configuration(name, _scenario(item)) for name, item in pairs)
    if len(found) < 2:
        raise StudyError(f"a comparison needs two configurations or more, there is {len(found)}")
    return tuple(replace(item, scenario=with_overrides(item.scenario, overrides)) for item in found)


def checked_baseline(name: str | None, names: Sequence[str]) -> str:
    """Return the configuration that all others are held against; the first unless given."""
    if name is not None and name not in names:
        raise StudyError(
            f"baseline: no configuration '{name}'{nearest_name(name, names)}; there are {', '.join(names)}"
        )
    return name if name is not None else names[0]


def with_overrides(scenario: Scenario, overrides: Sequence[str]) -> Scenario:
    """Return a scenario with overrides; StudyError where it was changed in Python, which would be lost."""
    if not overrides:
        return scenario
    if _read_again(scenario, ()) != scenario:
        raise StudyError(f"scenario '{scenario.name}' was changed in Python; overrides need it as its file says it")
    return _read_again(scenario, overrides)


def _read_again(scenario: Scenario, more: Sequence[str]) -> Scenario:
    origin = scenario.origin
    every = (*origin.overrides, *more)
    return scenario_from_dict(origin.content, every) if origin.file is None else load_scenario(origin.file, every)


def _named(scenarios: Sequence[Scenario | str | Path]) -> list[tuple[str, Scenario]]:
    """Return scenarios by their own names; StudyError where two are called the same."""
    found = [_scenario(item) for item in scenarios]
    names = [scenario.name for scenario in found]
    repeated = next((name for name in names if names.count(name) > 1), None)
    if repeated is not None:
        raise StudyError(f"two of the scenarios are called '{repeated}'; give them names of their own in a study file")
    return list(zip(names, found, strict=True))


def _scenario(item: Scenario | str | Path) -> Scenario:
    return item if isinstance(item, Scenario) else load_scenario(item)


def _check_no_restriction(study: Study | None) -> None:
    if study is not None and study.only:
        path, names = next(iter(study.only.items()))
        raise StudyError(
            f"study '{study.name}': '{path}' varies only in {', '.join(names)}; compare the study's own configurations"
        )
