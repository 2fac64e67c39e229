"""A design problem in SI units: tasks, combinations of parts, numbers to choose, constraints."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from ppafo.errors import StudyError, UnitError, nearest_name
from ppafo.metrics.catalog import METRICS
from ppafo.parameters.parts import Catalogue, Part, load_catalogue
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import OPEN_LOOP
from ppafo.studies.design.document import DesignFile, PartsTable, TaskTable, read_design_file
from ppafo.studies.design.search import SearchSettings
from ppafo.studies.design.variables import Variable, read_variables
from ppafo.units import parse_quantity

OBJECTIVES = {"error": "N m", "gas": "kg", "mass": "kg"}
"""What a design is judged by, all to be small, with the SI unit."""
GAS = "gas_supplied"

_OWN_NAMES = {"gas": GAS}


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

    ``seed`` stands in for that of the file. StudyError or ParameterError for what is not usable, in one line.
    """
    document, file = read_design_file(name_or_path)
    folder = Path(name_or_path).parent
    catalogue = load_catalogue(_place(document.catalogue, folder))
    combinations = _combinations(document.parts, catalogue)
    tasks = _tasks(document.task, sorted({item.valve.kind for item in combinations}), folder, file)
    if document.error not in _errors():
        hint = nearest_name(document.error, _errors())
        raise StudyError(
            f"{file}: error = '{document.error}' is no error in N m{hint}; there are {', '.join(_errors())}"
        )
    search = document.search
    return DesignProblem(
        name=document.name,
        description=document.description,
        file=file,
        error=document.error,
        tasks=tasks,
        combinations=combinations,
        carried=_carried(document.parts, catalogue),
        other_mass=_mass(document.parts.other_mass, f"{file}: parts.other_mass"),
        variables=read_variables(document.variables, tasks, combinations, file),
        constraints=_constraints(document, file),
        search=SearchSettings(
            search.screening,
            search.population,
            search.generations,
            search.tolerance,
            search.seed if seed is None else seed,
        ),
    )


def _each_once(parts: Sequence[Part]) -> tuple[Part, ...]:
    return tuple({(part.group, part.name): part for part in parts}.values())


def _combinations(parts: PartsTable, catalogue: Catalogue) -> tuple[Combination, ...]:
    valves = [catalogue.part("valves", name) for name in dict.fromkeys(parts.valves)]
    actuators = [catalogue.part("actuators", name) for name in dict.fromkeys(parts.actuators)]
    return tuple(Combination(valve, actuator) for valve, actuator in product(valves, actuators))


def _carried(parts: PartsTable, catalogue: Catalogue) -> tuple[Part, ...]:
    bottles = [] if parts.bottle is None else [catalogue.part("bottles", parts.bottle)]
    return (*(catalogue.part("regulators", name) for name in parts.regulators), *bottles)


def _tasks(tables: Sequence[TaskTable], kinds: Sequence[str], folder: Path, file: str) -> tuple[Task, ...]:
    whole = sum(table.weight for table in tables)
    names = [table.name for table in tables]
    for name in names:
        if names.count(name) > 1:
            raise StudyError(f"{file}: two tasks are called '{name}'; give each its own name")
    return tuple(_task(table, kinds, folder, file, whole) for table in tables)


def _task(table: TaskTable, kinds: Sequence[str], folder: Path, file: str, whole: float) -> Task:
    for kind in kinds:
        if kind not in table.scenarios:
            raise StudyError(
                f"{file}: task '{table.name}' has no scenario for {kind} valves, which parts.valves has; "
                f"add {kind} = '...' to its scenarios"
            )
    scenarios = {kind: load_scenario(_place(table.scenarios[kind], folder), table.overrides) for kind in kinds}
    for kind, scenario in scenarios.items():
        if scenario.control.kind == OPEN_LOOP:
            raise StudyError(
                f"{file}: task '{table.name}': scenario '{scenario.name}' follows no reference (controller "
                f"'{OPEN_LOOP}'), so it has no tracking error"
            )
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


def _constraints(document: DesignFile, file: str) -> tuple[Constraint, ...]:
    units = OBJECTIVES | {name: kind.unit for name, kind in METRICS.items()}
    found = []
    for name, table in document.constraints.items():
        place = f"{file}: constraints.{name}"
        if name not in units:
            hint = nearest_name(name, units)
            raise StudyError(f"{place}: there is no such metric{hint}; there are {', '.join(units)}")
        least, most = (
            None if text is None else _limit(text, units[name], f"{place}.{key}")
            for key, text in (("least", table.least), ("most", table.most))
        )
        if least is None and most is None:
            raise StudyError(f"{place}: asks for nothing; give least, most or both")
        if least is not None and most is not None and least > most:
            raise StudyError(f"{place}: least = '{table.least}' is above most = '{table.most}'; nothing can keep both")
        found.append(Constraint(_OWN_NAMES.get(name, name), units[name], least, most))
    return tuple(found)


def _limit(text: str, unit: str, place: str) -> float:
    wanted = {"Pa": "Pa_a", "-": ""}.get(unit, unit)
    try:
        return parse_quantity(text, wanted)
    except UnitError as error:
        raise StudyError(f"{place} = '{text}': {error}") from error
