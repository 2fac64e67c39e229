"""The configurations of a comparison, by name, and their scenarios on each task."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ppafo.errors import StudyError, first_twice, nearest_name
from ppafo.loading import reloaded, scenario_or_load
from ppafo.simulation.scenario import Scenario
from ppafo.studies.study import Configuration, Study

_SETTING = re.compile(r"\s*controller\.(?!rate|period)")

Configurations = Mapping[str, Scenario | str | Path] | Sequence[Scenario | str | Path]


@dataclass(frozen=True, slots=True)
class ConfiguredTask:
    """A configuration on a task: the two names and the scenario."""

    task: str
    configuration: str
    scenario: Scenario


def choose_configurations(
    configurations: Configurations | None, study: Study | None, overrides: Sequence[str]
) -> tuple[Configuration, ...]:
    """Return what is compared: the given scenarios, else those of the study; at least two, each with its own name."""
    if configurations is None:
        if study is None:
            raise StudyError("nothing to compare: give scenarios, a study, or both")
        found = study.configurations
    else:
        _check_no_restriction(study)
        pairs = configurations.items() if isinstance(configurations, Mapping) else _with_names(configurations)
        found = tuple(Configuration(name, scenario_or_load(item)) for name, item in pairs)
    if len(found) < 2:
        raise StudyError(f"a comparison needs at least two configurations, there is {len(found)}")
    return tuple(replace(item, scenario=with_overrides(item.scenario, overrides)) for item in found)


def valid_baseline(name: str | None, names: Sequence[str]) -> str:
    """Return the configuration that all others are compared with; the first by default."""
    if name is not None and name not in names:
        raise StudyError(
            f"baseline: no configuration '{name}'{nearest_name(name, names)}; available: {', '.join(names)}"
        )
    return name if name is not None else names[0]


def with_overrides(scenario: Scenario, overrides: Sequence[str]) -> Scenario:
    """Return a scenario with overrides; StudyError where it was changed in Python, which would be lost.

    A Python object that controls it stays in charge.
    """
    if not overrides:
        return scenario
    of_object = [text for text in overrides if scenario.control.custom is not None and _SETTING.match(text)]
    if of_object:
        raise StudyError(f"override '{of_object[0]}': scenario '{scenario.name}' is controlled by a Python object")
    if reloaded(scenario, ()) != scenario:
        raise StudyError(
            f"scenario '{scenario.name}' was changed in Python; overrides need the scenario as it is in its file"
        )
    return reloaded(scenario, overrides)


def _with_names(scenarios: Sequence[Scenario | str | Path]) -> list[tuple[str, Scenario]]:
    """Return scenarios by their own names; StudyError where two are called the same."""
    found = [scenario_or_load(item) for item in scenarios]
    names = [scenario.name for scenario in found]
    repeated = first_twice(names)
    if repeated is not None:
        raise StudyError(f"two of the scenarios are named '{repeated}'; give them different names in a study file")
    return list(zip(names, found, strict=True))


def _check_no_restriction(study: Study | None) -> None:
    if study is not None and study.only:
        path, names = next(iter(study.only.items()))
        raise StudyError(
            f"study '{study.name}': '{path}' varies only in {', '.join(names)}; compare the study's own configurations"
        )
