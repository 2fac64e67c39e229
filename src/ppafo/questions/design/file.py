"""A design file: tasks, parts to choose from, variables, constraints; as written, and as a problem in SI units."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from ppafo.documents.models import NAME, STRICT, Text, Texts, make_schema, read_model
from ppafo.documents.toml_text import TomlKind
from ppafo.errors import StudyError, UnitError, first_twice, nearest_name
from ppafo.loading import load_scenario, placed
from ppafo.metrics.catalog import METRICS
from ppafo.parameters.graph import ATMOSPHERE_PATH
from ppafo.parameters.parts import Catalogue, Part, load_catalogue
from ppafo.parameters.parts.catalogue import DEFAULT
from ppafo.questions.design.search import SearchSettings
from ppafo.questions.design.variables import Variable, VariableTable, read_variables
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import OPEN_LOOP
from ppafo.studies.noise import NOISE
from ppafo.studies.outcomes import common_level
from ppafo.units import parse_quantity

FILE = TomlKind("design", "design", resources.files("ppafo.questions.design") / "library", StudyError)

OBJECTIVES = {"error": "N m", "gas": "kg", "mass": "kg"}
"""What a design is judged by, all to be small, with the SI unit."""
GAS = "gas_supplied"

_OWN_NAMES = {"gas": GAS}
_LARGEST_SEED = 2**32 - 1
_Names = Annotated[tuple[Text, ...], Field(strict=False, min_length=1)]


class TaskTable(BaseModel):
    """A task that the device has to do, as a scenario for each kind of valve that may do it."""

    model_config = STRICT

    name: Annotated[Text, Field(description="label in reports")]
    scenarios: Annotated[
        dict[str, Text],
        Field(min_length=1, description="scenario for each kind of valve: a name, or a path relative to this file"),
    ]
    overrides: Annotated[Texts, Field(description="changes to every scenario of the task")] = ()
    weight: Annotated[float, Field(gt=0.0, description="weight of the task in use, relative to the others")] = 1.0


class PartsTable(BaseModel):
    """Names of parts in the catalogue; every valve is tried with every actuator."""

    model_config = STRICT

    valves: Annotated[_Names, Field(description="valves to choose from")]
    actuators: Annotated[_Names, Field(description="actuators to choose from")]
    regulators: Annotated[Texts, Field(description="regulators that are carried (all of those listed)")] = ()
    bottle: Annotated[str | None, Field(description="bottle that is carried, full")] = None
    other_mass: Annotated[str, Field(description="other mass that is carried: shell, straps, electronics")] = "0 kg"


class ConstraintTable(BaseModel):
    """What a design has to keep, in each task."""

    model_config = STRICT

    least: Annotated[str | None, Field(description="smallest value allowed, with its unit")] = None
    most: Annotated[str | None, Field(description="largest value allowed, with its unit")] = None


class SearchTable(BaseModel):
    """How long to search."""

    model_config = STRICT

    screening: Annotated[
        int, Field(ge=16, le=100_000, description="number of evenly spread designs in the first generation")
    ] = 4096
    population: Annotated[int, Field(ge=16, le=4096, description="number of designs in each later generation")] = 256
    generations: Annotated[int, Field(ge=0, le=10_000, description="maximum number of generations")] = 80
    tolerance: Annotated[
        float,
        Field(ge=0.0, lt=1.0, description="stop when the hypervolume grows by less than this over 10 generations"),
    ] = 1.0e-3
    seed: Annotated[
        int, Field(ge=0, le=_LARGEST_SEED, description="random seed; the same seed gives the same designs")
    ] = 1


class DesignFile(BaseModel):
    """A design file, as it is written."""

    model_config = STRICT

    schema_version: Annotated[Literal[1], Field(description="version of this layout")]
    name: Annotated[str, Field(pattern=NAME, max_length=100)]
    description: str = ""
    catalogue: Annotated[str, Field(description="catalogue of parts: a name, or a path relative to this file")] = (
        DEFAULT
    )
    error: Annotated[str, Field(description="metric used as the error: any metric in N m")] = "rms_error"
    task: Annotated[tuple[TaskTable, ...], Field(strict=False, min_length=1)]
    parts: PartsTable
    variables: Annotated[dict[str, VariableTable], Field(description="numbers to choose, by path")] = {}
    constraints: Annotated[
        dict[str, ConstraintTable], Field(description="limits by metric, or on error, gas or mass")
    ] = {}
    search: SearchTable = SearchTable()


def read_design_file(name_or_path: str | Path) -> tuple[DesignFile, str]:
    """Return a design file by its name in the package or by its path, and what messages call it."""
    return read_model(FILE, DesignFile, name_or_path)


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a design file."""
    return make_schema(DesignFile, "ppafo design")


@dataclass(frozen=True, slots=True)
class Task:
    """A task: a scenario for each kind of valve, and its weight in use [-], all weights together 1."""

    name: str
    scenarios: Mapping[str, Scenario]
    weight: float


@dataclass(frozen=True, slots=True)
class Combination:
    """A valve with an actuator."""

    valve: Part
    actuator: Part


@dataclass(frozen=True, slots=True)
class Constraint:
    """Limits [SI] of a metric in each task, or of an objective."""

    name: str
    unit: str
    least: float | None
    most: float | None


@dataclass(frozen=True, slots=True)
class DesignProblem:
    """What to search; ``carried`` are the parts that every design has, ``other_mass`` [kg] what it has besides."""

    name: str
    description: str
    file: str
    error: str
    tasks: tuple[Task, ...]
    combinations: tuple[Combination, ...]
    carried: tuple[Part, ...]
    other_mass: float
    variables: tuple[Variable, ...]
    constraints: tuple[Constraint, ...]
    search: SearchSettings

    @property
    def parts(self) -> tuple[Part, ...]:
        """All parts that any design may have, each once."""
        chosen = [part for item in self.combinations for part in (item.valve, item.actuator)]
        return _each_once([*chosen, *self.carried])


def load_design(name_or_path: str | Path, seed: int | None = None) -> DesignProblem:
    """Return the problem of a design file, by its name in the package or by its path; paths in it begin in its folder.

    ``seed`` replaces that of the file. StudyError or ParameterError for what is not usable, in one line.
    """
    document, file = read_design_file(name_or_path)
    folder = Path(name_or_path).parent
    catalogue = load_catalogue(_place(document.catalogue, folder))
    combinations = _combinations(document.parts, catalogue)
    tasks = _tasks(document.task, sorted({item.valve.kind for item in combinations}), folder, file)
    if document.error not in _errors():
        hint = nearest_name(document.error, _errors())
        raise StudyError(
            f"{file}: error = '{document.error}' is not an error in N m{hint}; available are {', '.join(_errors())}"
        )
    if NOISE in document.variables:
        raise StudyError(f"{file}: variables.'{NOISE}': every design meets the same noise, so it cannot be searched")
    search = document.search
    by_kind = {kind: [task.scenarios[kind] for task in tasks] for kind in tasks[0].scenarios}
    valves = [item.valve for item in combinations]
    problem = DesignProblem(
        name=document.name,
        description=document.description,
        file=file,
        error=document.error,
        tasks=tasks,
        combinations=combinations,
        carried=_carried_parts(document.parts, catalogue),
        other_mass=_mass(document.parts.other_mass, f"{file}: parts.other_mass"),
        variables=read_variables(document.variables, by_kind, valves, file),
        constraints=_constraints(document, _atmospheres(document, tasks), file),
        search=SearchSettings(
            search.screening,
            search.population,
            search.generations,
            search.tolerance,
            search.seed,
        ),
    )
    return problem if seed is None else with_seed(problem, seed)


def with_seed(problem: DesignProblem, seed: int) -> DesignProblem:
    """Return a problem with another random seed; StudyError for one that no search has."""
    if not 0 <= seed <= _LARGEST_SEED:
        raise StudyError(f"seed = {seed}: must be a whole number from 0 to {_LARGEST_SEED}")
    return replace(problem, search=replace(problem.search, seed=seed))


def _each_once(parts: Sequence[Part]) -> tuple[Part, ...]:
    return tuple({(part.group, part.name): part for part in parts}.values())


def _combinations(parts: PartsTable, catalogue: Catalogue) -> tuple[Combination, ...]:
    valves = [catalogue.part("valves", name) for name in dict.fromkeys(parts.valves)]
    actuators = [catalogue.part("actuators", name) for name in dict.fromkeys(parts.actuators)]
    return tuple(Combination(valve, actuator) for valve, actuator in product(valves, actuators))


def _carried_parts(parts: PartsTable, catalogue: Catalogue) -> tuple[Part, ...]:
    bottles = [] if parts.bottle is None else [catalogue.part("bottles", parts.bottle)]
    return (*(catalogue.part("regulators", name) for name in parts.regulators), *bottles)


def _tasks(tables: Sequence[TaskTable], kinds: Sequence[str], folder: Path, file: str) -> tuple[Task, ...]:
    whole = sum(table.weight for table in tables)
    names = [table.name for table in tables]
    repeated = first_twice(names)
    if repeated is not None:
        raise StudyError(f"{file}: two tasks are named '{repeated}'; give each its own name")
    return tuple(_task(table, kinds, folder, file, whole) for table in tables)


def _task(table: TaskTable, kinds: Sequence[str], folder: Path, file: str, whole: float) -> Task:
    for kind in kinds:
        if kind not in table.scenarios:
            raise StudyError(
                f"{file}: task '{table.name}' has no scenario for {kind} valves, but parts.valves lists one; add "
                f"{kind} = '...' to its scenarios"
            )
    scenarios = {kind: load_scenario(placed(table.scenarios[kind], folder), table.overrides) for kind in kinds}
    for kind, scenario in scenarios.items():
        if scenario.control.kind == OPEN_LOOP:
            raise StudyError(
                f"{file}: task '{table.name}': scenario '{scenario.name}' follows no reference (controller "
                f"'{OPEN_LOOP}'), so it has no tracking error"
            )
        scenario.device.check_vane("a design")
        own = scenario.device.valve.kind
        if own != kind:
            raise StudyError(
                f"{file}: task '{table.name}': scenario '{scenario.name}' has a {own} valve, not a {kind} one"
            )
    return Task(table.name, scenarios, table.weight / whole)


def _place(name: str, folder: Path) -> str:
    """Return a name of the package as it is, and a path relative to the file that names it."""
    is_path = Path(name).suffix == ".toml" or "/" in name
    return str(folder / name) if is_path else name


def _errors() -> list[str]:
    return [name for name, kind in METRICS.items() if kind.unit == OBJECTIVES["error"]]


def _mass(text: str, place: str) -> float:
    try:
        value = parse_quantity(text, "kg")
    except UnitError as error:
        raise StudyError(f"{place} = '{text}': {error}") from error
    if value < 0.0:
        raise StudyError(f"{place} = '{text}': must be at least 0 kg")
    return value


def _atmospheres(document: DesignFile, tasks: Sequence[Task]) -> frozenset[float]:
    """Return the pressures [Pa absolute] from which gauge pressures of designs count; 0 too where it is searched."""
    scenarios = [scenario for task in tasks for scenario in task.scenarios.values()]
    searched = [0.0] if ATMOSPHERE_PATH in document.variables else []
    return frozenset([*searched, *(scenario.device.supply.atmospheric_pressure for scenario in scenarios)])


def _constraints(document: DesignFile, atmospheres: frozenset[float], file: str) -> tuple[Constraint, ...]:
    known = [name for name in document.constraints if name in METRICS]
    units = OBJECTIVES | {name: METRICS[name].unit for name in dict.fromkeys([*METRICS, *known])}
    found = []
    for name, table in document.constraints.items():
        place = f"{file}: constraints.{name}"
        if name not in units:
            hint = nearest_name(name, units)
            raise StudyError(f"{place}: there is no such metric{hint}; available: {', '.join(units)}")
        least, most = (
            None if text is None else _limit(text, units[name], f"{place}.{key}", atmospheres)
            for key, text in (("least", table.least), ("most", table.most))
        )
        if least is None and most is None:
            raise StudyError(f"{place}: has no limit; give least, most or both")
        if least is not None and most is not None and least > most:
            raise StudyError(
                f"{place}: least = '{table.least}' is above most = '{table.most}'; no design can satisfy both"
            )
        found.append(Constraint(_OWN_NAMES.get(name, name), units[name], least, most))
    return tuple(found)


def _limit(text: str, unit: str, place: str, atmospheres: frozenset[float]) -> float:
    what = f"{place} = '{text}'"
    found = common_level(text, unit, what, atmospheres)
    if found is None:
        raise StudyError(f"{what}: the designs have several atmospheres; give an absolute pressure")
    return found
