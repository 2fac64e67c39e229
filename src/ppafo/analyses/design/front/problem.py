"""A design file with tasks: numbers to choose, parts and constraints, and the problem in SI units that it makes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from ppafo.analyses.design.front.search import LARGEST_SEED, SearchTable
from ppafo.documents.models import NAME, StrictTable, Text, Texts
from ppafo.documents.toml_text import beside
from ppafo.errors import StudyError, UnitError, first_twice, nearest_name, refused_as
from ppafo.loading import load_scenario, placed
from ppafo.metrics import METRICS
from ppafo.model.catalog import find_effects
from ppafo.model.declaration import Quantity
from ppafo.parameters.declaration import AREA_FORM, SONIC_FORM, is_within, limits_text
from ppafo.parameters.graph import ATMOSPHERE_PATH
from ppafo.parameters.parts import Part, load_catalogue
from ppafo.parameters.parts.catalogue import DEFAULT
from ppafo.report.kind import Kind
from ppafo.signals.recording import Floats
from ppafo.simulation.clock import TIMES
from ppafo.simulation.ensemble.running import lacking
from ppafo.simulation.numbers import declared_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.studies.draws import common_level
from ppafo.studies.sampling import NOISE
from ppafo.units import parse_quantity

SIZE = "actuator.size"
DEAD_VOLUME = "actuator.dead_volume"
OWN = {
    SIZE: Quantity(
        "size",
        "",
        "scale of the actuator's torque constant, displacement and mass relative to the part",
        None,
        0.05,
        20.0,
    ),
    DEAD_VOLUME: Quantity("dead_volume", "m^3", "dead volume of each chamber", None, 1.0e-9, 1.0e-1),
}
"""Variables that stand for several numbers of the device."""
_BY_PARTS = {
    "actuator.torque_constant": SIZE,
    "actuator.displacement_per_radian": SIZE,
    "actuator.dead_volume_1": DEAD_VOLUME,
    "actuator.dead_volume_2": DEAD_VOLUME,
}
_AREA = {f"valve.{quantity.name}" for quantity in AREA_FORM}
_SONIC = {f"valve.{quantity.name}" for quantity in SONIC_FORM}


class VariableTable(StrictTable):
    """A number that may be chosen: between two limits, or one of some values."""

    lowest: Annotated[str | None, Field(description="smallest value with its unit")] = None
    highest: Annotated[str | None, Field(description="largest value with its unit")] = None
    values: Annotated[Texts, Field(description="values to choose from, with unit; needed for times and rates")] = ()
    scale: Annotated[Literal["linear", "log"], Field(description="spacing of values between the limits")] = "linear"


@dataclass(frozen=True, slots=True)
class Variable:
    """A number to choose, in SI: its path, its limits or the values that it may have, and how it is spread.

    ``kinds`` names the kinds of valve for which it means something, none for all.
    """

    path: str
    unit: str
    summary: str
    lowest: float
    highest: float
    values: tuple[float, ...]
    is_logarithmic: bool
    kinds: tuple[str, ...] = ()

    def value(self, fraction: Floats) -> Floats:
        """Return the values (candidates,) in SI at places from 0 to 1."""
        if self.values:
            count = len(self.values)
            return np.array(self.values)[np.minimum((fraction * count).astype(np.int64), count - 1)]
        if self.is_logarithmic:
            return np.asarray(np.exp(np.log(self.lowest) + fraction * np.log(self.highest / self.lowest)))
        return self.lowest + fraction * (self.highest - self.lowest)


def read_variables(
    tables: Mapping[str, VariableTable],
    scenarios: Mapping[str, Sequence[Scenario]],
    valves: Sequence[Part],
    file: str,
) -> tuple[Variable, ...]:
    """Return the variables of a file; StudyError for a path that no scenario has, or limits that it refuses.

    ``scenarios`` has all tasks' by kind of valve.
    """
    everything = [scenario for of_kind in scenarios.values() for scenario in of_kind]
    # Effects that are switched on by a path of theirs have to be known before the numbers are listed.
    find_effects(tables)
    known = {path: quantity for scenario in everything for path, quantity in declared_numbers(scenario).items()}
    known = {path: quantity for path, quantity in known.items() if path not in _BY_PARTS} | OWN
    atmosphere = everything[0].device.supply.atmospheric_pressure
    variables = []
    for path, table in tables.items():
        where = f"{file}: variables.'{path}'"
        _check_path(path, known, valves, where)
        # The kinds of valve whose scenarios have a number, none where all of them do.
        having = {
            kind: path in OWN or any(path in declared_numbers(scenario) for scenario in of_kind)
            for kind, of_kind in scenarios.items()
        }
        kinds = () if all(having.values()) else tuple(kind for kind, has in having.items() if has)
        variables.append(replace(_variable(path, table, known[path], atmosphere, where), kinds=kinds))
    return tuple(variables)


def _check_path(path: str, known: Mapping[str, Quantity], valves: Sequence[Part], where: str) -> None:
    if path in _BY_PARTS:
        raise StudyError(f"{where}: is fixed by the chosen actuator; vary '{_BY_PARTS[path]}' instead")
    if path not in known:
        hint = nearest_name(path, known) or f"; for example {', '.join([*OWN, 'supply.pressure', 'controller.rate'])}"
        raise StudyError(f"{where}: no scenario of the tasks has such a value{hint}")
    other = _SONIC if path in _AREA else _AREA if path in _SONIC else frozenset[str]()
    for valve in valves:
        if {f"valve.{name}" for name in valve.values} & other:
            raise StudyError(f"{where}: valve '{valve.name}' gives its orifice in the other form")


def _variable(path: str, table: VariableTable, quantity: Quantity, atmosphere: float, where: str) -> Variable:
    between = [text for text in (table.lowest, table.highest) if text is not None]
    if bool(table.values) == bool(between) or len(between) == 1:
        raise StudyError(f"{where}: give either lowest and highest, or values")
    if path in TIMES and not table.values:
        raise StudyError(
            f"{where}: is a time or rate of the run; list the values to choose from, values = ['500 Hz', '1 kHz']"
        )
    numbers, unit = [], "" if quantity.unit == "1" else quantity.unit
    for text in table.values or between:
        with refused_as(StudyError, f"{where}: '{text}'", UnitError):
            value = parse_quantity(text, unit, atmosphere)
        if not is_within(value, quantity):
            raise StudyError(f"{where}: '{text}': must be {limits_text(quantity)}")
        numbers.append(value)
    lowest, highest = min(numbers), max(numbers)
    if not table.values and numbers[0] >= numbers[1]:
        raise StudyError(f"{where}: lowest = '{table.lowest}' must be below highest = '{table.highest}'")
    if table.scale == "log" and lowest <= 0.0:
        raise StudyError(f"{where}: scale = 'log' needs limits above 0")
    return Variable(
        path,
        quantity.unit,
        quantity.summary,
        lowest,
        highest,
        tuple(numbers) if table.values else (),
        table.scale == "log",
    )


OBJECTIVES = {
    "error": Kind("Error", "N m", "torque", ".3g"),
    "gas": Kind("Gas per task", "kg", "gas mass", ".3g"),
    "mass": Kind("Mass", "kg", "part mass", ".4g"),
}
"""What a design is judged by, all to be small, as a person is shown it."""
GAS = "gas_supplied"
_OWN_NAMES = {"gas": GAS}
_Names = Annotated[tuple[Text, ...], Field(strict=False, min_length=1)]


class TaskTable(StrictTable):
    """A task that the device has to do, as a scenario for each kind of valve that may do it."""

    name: Annotated[Text, Field(description="label in reports")]
    scenarios: Annotated[
        dict[str, Text],
        Field(min_length=1, description="scenario for each kind of valve: a name, or a path relative to this file"),
    ]
    overrides: Annotated[Texts, Field(description="changes to every scenario of the task")] = ()
    weight: Annotated[float, Field(gt=0.0, description="weight of the task in use, relative to the others")] = 1.0


class PartsTable(StrictTable):
    """Names of parts in the catalogue; every valve is tried with every actuator."""

    valves: Annotated[_Names, Field(description="valves to choose from")]
    actuators: Annotated[_Names, Field(description="actuators to choose from")]
    regulators: Annotated[Texts, Field(description="regulators that are carried (all of those listed)")] = ()
    bottle: Annotated[str | None, Field(description="bottle that is carried, full")] = None
    other_mass: Annotated[str, Field(description="other mass that is carried: shell, straps, electronics")] = "0 kg"


class ConstraintTable(StrictTable):
    """Entry of a design file: a limit that a design has to keep in each task."""

    least: Annotated[str | None, Field(description="smallest value allowed, with its unit")] = None
    most: Annotated[str | None, Field(description="largest value allowed, with its unit")] = None


class DesignFile(StrictTable):
    """Layout of a design file."""

    schema_version: Annotated[Literal[1], Field(description="version of this layout")]
    name: Annotated[str, Field(pattern=NAME, max_length=100)]
    description: str = ""
    catalogue: Annotated[str, Field(description="catalogue of parts: a name, or a path relative to this file")] = (
        DEFAULT
    )
    error: Annotated[str, Field(description="metric used as the error: any metric in N m")] = "rms_error"
    task: Annotated[tuple[TaskTable, ...], Field(strict=False, min_length=1)]
    parts: PartsTable
    variables: Annotated[dict[str, VariableTable], Field(description="numbers to choose, by path")] = Field(default={})
    constraints: Annotated[
        dict[str, ConstraintTable], Field(description="limits by metric, or on error, gas or mass")
    ] = Field(default={})
    search: SearchTable = SearchTable()


@dataclass(frozen=True, slots=True)
class Task:
    """A task: a scenario for each kind of valve, and its weight in use [-], all weights together 1."""

    name: str
    scenarios: Mapping[str, Scenario]
    weight: float


@dataclass(frozen=True, slots=True)
class Combination:
    """A choice of parts that a design is made of: a valve and an actuator."""

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
    search: SearchTable

    @property
    def parts(self) -> tuple[Part, ...]:
        """All parts that any design may have, each once."""
        chosen = [part for item in self.combinations for part in (item.valve, item.actuator)]
        parts = [*chosen, *self.carried]
        return tuple({(part.group, part.name): part for part in parts}.values())


def design_problem(document: DesignFile, file: str, folder: Path, seed: int | None = None) -> DesignProblem:
    """Return the problem of a design file, which messages call ``file``; paths in it begin in ``folder``.

    ``seed`` replaces the file's. StudyError or ParameterError for what is not usable, in one line.
    """
    catalogue = load_catalogue(beside(document.catalogue, folder))
    valves = [catalogue.part("valves", name) for name in dict.fromkeys(document.parts.valves)]
    actuators = [catalogue.part("actuators", name) for name in dict.fromkeys(document.parts.actuators)]
    kinds = sorted({valve.kind for valve in valves})
    weights = sum(table.weight for table in document.task)
    names = [table.name for table in document.task]
    repeated = first_twice(names)
    if repeated is not None:
        raise StudyError(f"{file}: two tasks are named '{repeated}'; give each its own name")
    tasks = tuple(_task(table, kinds, folder, file, weights, document.error) for table in document.task)
    errors = [name for name, kind in METRICS.items() if kind.unit == OBJECTIVES["error"].unit]
    if document.error not in errors:
        hint = nearest_name(document.error, errors)
        raise StudyError(
            f"{file}: error = '{document.error}' is not an error in N m{hint}; available are {', '.join(errors)}"
        )
    if NOISE in document.variables:
        raise StudyError(f"{file}: variables.'{NOISE}': every design meets the same noise, so it cannot be searched")
    by_kind = {kind: [task.scenarios[kind] for task in tasks] for kind in tasks[0].scenarios}
    bottles = [] if document.parts.bottle is None else [catalogue.part("bottles", document.parts.bottle)]
    where = f"{file}: parts.other_mass"
    with refused_as(StudyError, f"{where} = '{document.parts.other_mass}'", UnitError):
        other_mass = parse_quantity(document.parts.other_mass, "kg")
    if other_mass < 0.0:
        raise StudyError(f"{where} = '{document.parts.other_mass}': must be at least 0 kg")
    problem = DesignProblem(
        name=document.name,
        description=document.description,
        file=file,
        error=document.error,
        tasks=tasks,
        combinations=tuple(Combination(*pair) for pair in product(valves, actuators)),
        carried=(*(catalogue.part("regulators", name) for name in document.parts.regulators), *bottles),
        other_mass=other_mass,
        variables=read_variables(document.variables, by_kind, valves, file),
        constraints=_constraints(document, tasks, file),
        search=document.search,
    )
    return problem if seed is None else with_seed(problem, seed)


def with_seed(problem: DesignProblem, seed: int) -> DesignProblem:
    """Return a problem with another random seed; StudyError for one that no search has."""
    if not 0 <= seed <= LARGEST_SEED:
        raise StudyError(f"seed = {seed}: must be a whole number from 0 to {LARGEST_SEED}")
    return replace(problem, search=problem.search.model_copy(update={"seed": seed}))


def _task(table: TaskTable, kinds: Sequence[str], folder: Path, file: str, whole: float, error: str) -> Task:
    for kind in kinds:
        if kind not in table.scenarios:
            raise StudyError(
                f"{file}: task '{table.name}' has no scenario for {kind} valves, but parts.valves lists one; add "
                f"{kind} = '...' to its scenarios"
            )
    scenarios = {kind: load_scenario(placed(table.scenarios[kind], folder), table.overrides) for kind in kinds}
    for kind, scenario in scenarios.items():
        if scenario.controller.is_open_loop:
            raise StudyError(
                f"{file}: task '{table.name}': scenario '{scenario.name}' follows no reference (controller "
                f"'{scenario.controller.kind}'), so it has no tracking error"
            )
        reason = lacking(scenario, METRICS[error]) if error in METRICS else ""
        if reason:
            raise StudyError(f"{file}: task '{table.name}': scenario '{scenario.name}' has no '{error}': {reason}")
        scenario.device.check_torque_constant("a design")
        own = scenario.device.valve.kind
        if own != kind:
            raise StudyError(
                f"{file}: task '{table.name}': scenario '{scenario.name}' has a {own} valve, not a {kind} one"
            )
    return Task(table.name, scenarios, table.weight / whole)


def _constraints(document: DesignFile, tasks: Sequence[Task], file: str) -> tuple[Constraint, ...]:
    known = [name for name in document.constraints if name in METRICS]
    units = {name: kind.unit for name, kind in OBJECTIVES.items()}
    units |= {name: METRICS[name].unit for name in dict.fromkeys([*METRICS, *known])}
    # Gauge pressures count from the atmosphere, which may differ from task to task; a searched one is not known: 0.
    searched = [0.0] if ATMOSPHERE_PATH in document.variables else []
    scenarios = [scenario for task in tasks for scenario in task.scenarios.values()]
    atmospheres = frozenset([*searched, *(scenario.device.supply.atmospheric_pressure for scenario in scenarios)])
    constraints = []
    for name, table in document.constraints.items():
        where = f"{file}: constraints.{name}"
        if name not in units:
            hint = nearest_name(name, units)
            raise StudyError(f"{where}: there is no such metric{hint}; available: {', '.join(units)}")
        limits: list[float | None] = []
        for key, text in (("least", table.least), ("most", table.most)):
            what = f"{where}.{key} = '{text}'"
            limits.append(None if text is None else common_level(text, units[name], what, atmospheres))
            if text is not None and limits[-1] is None:
                raise StudyError(f"{what}: the designs have several atmospheres; give an absolute pressure")
        least, most = limits
        if least is None and most is None:
            raise StudyError(f"{where}: has no limit; give least, most or both")
        if least is not None and most is not None and least > most:
            raise StudyError(
                f"{where}: least = '{table.least}' is above most = '{table.most}'; no design can satisfy both"
            )
        constraints.append(Constraint(_OWN_NAMES.get(name, name), units[name], least, most))
    return tuple(constraints)
