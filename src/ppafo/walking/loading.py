"""Loading of a walk scenario by name or file; every mistake is reported in a single line."""

from collections.abc import Iterable
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

from ppafo.arguments import Overrides, checked
from ppafo.control.walking.catalog import walking_controllers
from ppafo.documents.toml_text import TomlKind
from ppafo.errors import DataError, ParameterError, ScenarioError, at_fault, refused_as
from ppafo.gait import NORMATIVE, load_gait
from ppafo.model.catalog import VALVES
from ppafo.parameters import ParameterSet
from ppafo.parameters.declared import kind_at, value_at
from ppafo.parameters.loading import set_or_load
from ppafo.parameters.overrides import read_overrides
from ppafo.plugins import Plugins
from ppafo.simulation.building import (
    assumed_lines,
    read_device,
    read_gas_model,
    read_hardware,
    read_supply_line,
    with_settings,
)
from ppafo.simulation.clock import read_period
from ppafo.simulation.contradictions import check_contradictions
from ppafo.simulation.declaration import SUPPLY_LINE
from ppafo.simulation.document import DocumentReader
from ppafo.simulation.loading import FILE as SCENARIO_FILE
from ppafo.simulation.loading import Layout, list_scenarios, request_again, request_of_file, scenario_of
from ppafo.simulation.motion_kind import WALK
from ppafo.simulation.overrides import over_layer
from ppafo.simulation.scenario import Assumption, Control, Initial, RunSettings, Scenario, Sensors
from ppafo.walking.bottle.supply import BOTTLE, BOTTLE_NAME, read_bottle
from ppafo.walking.declaration import DURATION, FORCES, OF_A_WALK, SEED, STEP, WALK_SENSORS
from ppafo.walking.motion import WalkMotion, duration_problems, record_interval, walk_of, with_duration
from ppafo.walking.planning import NO_REFERENCE
from ppafo.walking.wearer import links_of_stature, read_wearer, wearer_origin
from ppafo.wording import argument_text

FILE = TomlKind("walk", "walk", resources.files("ppafo.walking") / "configurations", ScenarioError)
DEFAULT_PERIOD = 1.0e-3
"""Default sample period of the controller [s]."""
# Default duration of a walk [s], and of a walk on a bottle, which may end it earlier.
DEFAULT_DURATION = 60.0
BOTTLE_DURATION = 600.0


def build_walk(reading: DocumentReader) -> Scenario:
    """Return the walk described by a document whose keys have been validated.

    Raises ScenarioError, ParameterError or DataError for the first value that cannot be used.
    """
    document = reading.document
    origin, links = read_hardware(reading)
    device = read_device(reading, origin, links)
    with refused_as(ParameterError, f"{reading.file}: [device]", ParameterError):
        device.check_pressurised("a walk, whose controllers fill the chambers,")
        if VALVES[device.valve.kind].regulation is not None:
            raise ParameterError(
                f"device.valve = '{device.valve_name}' regulates pressures, whose flow fixed steps of a walk do not "
                "resolve; set it to a proportional valve or a pair of on/off valves"
            )
    bottle = read_bottle(reading, device)
    if bottle is not None:
        # A bottle always feeds lines, by default those of the declarations.
        reading = replace(reading, document={SUPPLY_LINE: {}, **document})
    line = read_supply_line(reading)
    if line is not None and bottle is not None:
        line = bottle.fed(line)
    sensors = reading.section("sensors", WALK_SENSORS)
    name = document.get("gait", NORMATIVE)
    is_named = "gait" in document
    # A relative path starts in the folder of the document.
    with refused_as(DataError, reading.quote("gait"), DataError):
        gait = load_gait(reading.folder / name if Path(name).suffix == ".toml" else name)
    motion = WalkMotion(
        kind=kind_at(document, "motion") or WALK,
        gait=gait,
        wearer=read_wearer(reading, gait, is_named),
        forces={name: sensors[name] for name in FORCES},
        bottle=bottle,
        wearer_origin=wearer_origin(reading, gait, is_named),
    )
    step = reading.number("run.step", STEP)
    kind = kind_at(document, "controller")
    law = walking_controllers()[kind]
    assumptions = {
        path: Assumption(path, "" if value_at(document, path) is None else str(value_at(document, path)), note)
        for path, note in (document.get("assumed", {}) | ({} if bottle is None else bottle.assumed)).items()
    }
    assumptions |= {line.path: replace(line, note=f"{line.value}, {line.note}") for line in assumed_lines(reading)}
    atmosphere = device.supply.atmospheric_pressure
    scenario = Scenario(
        name=document["name"],
        description=document.get("description", ""),
        device=device,
        run=RunSettings(DEFAULT_DURATION, step, record_interval(DEFAULT_DURATION)),
        motion=motion,
        initial=Initial(atmosphere, atmosphere),
        # A law that is named by its module keeps this name; a law of the catalogue has the name that it has in walking.
        controller=Control(kind if ":" in kind else law.name, {}, read_period(reading, DEFAULT_PERIOD)[0]),
        reference=NO_REFERENCE,
        sensors=Sensors(
            **{name: number for name, number in sensors.items() if name not in FORCES},
            seed=int(reading.number("sensors.seed", SEED)),
        ),
        assumptions=tuple(assumptions.values()),
        origin=origin,
        gas_model=read_gas_model(reading),
        supply_line=line,
    )
    scenario = with_settings(reading, scenario, law.quantities)
    scenario = replace(scenario, links={**scenario.links, **links_of_stature(reading.document)})
    # Numbers that are usable by themselves may contradict each other.
    check_contradictions(scenario, reading)
    if value_at(document, "run.duration") is None:
        return with_duration(scenario, DEFAULT_DURATION if bottle is None else BOTTLE_DURATION)
    duration = reading.number("run.duration", DURATION)
    for is_bad, problem in duration_problems(scenario, duration):
        if is_bad:
            raise ScenarioError(f"{reading.file}: {problem(0)}")
    return with_duration(scenario, duration)


WALKING = Layout(FILE, OF_A_WALK, build_walk)
"""Layout of scenarios whose motion is a walk."""


def list_walks() -> tuple[str, ...]:
    """Return the names of the walk configurations included in the package.

    >>> import ppafo
    >>> ppafo.list_walks()[:3]
    ('off', 'proportional', 'proportional-regulators')
    """
    return FILE.names()


def check_duration_once(overrides: Iterable[str], minutes: float | None) -> None:
    """Raise ScenarioError if an override sets the duration in addition to the argument ``minutes``."""
    if minutes is not None and any(
        override.typed == "run.duration" for override in read_overrides(overrides, ScenarioError)
    ):
        argument = argument_text("overrides", option="--set")
        raise ScenarioError(
            f"{argument} run.duration and {argument_text('minutes')} both set the duration; omit one of them"
        )


@checked
def load_walk(
    scenario: str | Path,
    overrides: Overrides = (),
    *,
    gait: str | Path | None = None,
    bottle: str | Path | None = None,
    parameter_set: ParameterSet | str | Path | None = None,
    plugins: Plugins = (),
) -> Scenario:
    """Load a walk as a scenario in SI units.

    The default wearer is the subject of the gait named in the file or by ``gait``.

    Arguments:
        scenario: name of a walk, or a .toml file
        overrides: texts such as ``controller.peak_torque=6 N m``, or a dictionary
        gait: name or file of a gait, instead of the file's
        bottle: name or file of a bottle, instead of the file's
        parameter_set: parameter set of the device, instead of the file's
        plugins: modules of your own, files or names, whose objects files may name

    Returns:
        the Scenario, whose motion is a walk

    Raises:
        ScenarioError: a walk that cannot be used
        ParameterError: a parameter set, or a value of it, that cannot be used
        DataError: a gait that cannot be read

    >>> import ppafo
    >>> ppafo.load_walk("solenoid").name
    'solenoid'
    """
    chosen = {"gait": gait, BOTTLE_NAME: bottle}
    named = [f"{path}={from_here(value)}" for path, value in chosen.items() if value is not None]
    changes = read_overrides((*overrides, *named), ScenarioError)
    replacing = set_or_load(parameter_set)
    with at_fault("scenario"):
        request = request_of_file(
            scenario, changes, replacing, SCENARIO_FILE if str(scenario) in list_scenarios() else FILE
        )
    return scenario_of(request, WALKING)


def from_here(name: str | Path) -> str:
    """Return the path of a file from the working folder as an absolute one, which holds in any folder."""
    text = str(name)
    return str(Path(text).absolute()) if "/" in text or Path(text).suffix == ".toml" else text


def on_bottle(scenario: Scenario, bottle: str | Path | None, overrides: Iterable[str] = ()) -> Scenario:
    """Return the walk on another bottle, given by name or file; None keeps the walk's own bottle.

    ``overrides`` are values of the bottle, such as ``room.temperature=5 degC``. Raises ScenarioError or ParameterError
    if the walk cannot be combined with the bottle, and ScenarioError if the walk no longer matches its file and
    overrides.
    """
    request = replace(request_again(scenario.origin), file=scenario.name)
    if _without_bottle(scenario_of(request, WALKING)) != _without_bottle(scenario):
        raise ScenarioError(
            f"{scenario.name}: this walk differs from its file (the walk, the file or the package was changed after "
            f"loading): give {argument_text('bottle')} when loading the walk"
        )
    content = request.document
    before = request.overrides
    if bottle is not None:
        # Another bottle replaces the whole section, including its overrides.
        content = {name: section for name, section in content.items() if name != BOTTLE}
        before = tuple(override for override in before if not override.typed.startswith(f"{BOTTLE}."))
    prefix = f"{BOTTLE}."
    texts = [text if text.startswith(prefix) else f"{prefix}{text}" for text in overrides]
    texts += [] if bottle is None else [f"{BOTTLE_NAME}={from_here(bottle)}"]
    combined = over_layer(content, before, read_overrides(texts, ScenarioError), scenario.name, WALKING.content)
    return scenario_of(replace(request, document=content, overrides=combined), WALKING)


def _without_bottle(scenario: Scenario) -> tuple[Any, ...]:
    """Return all attributes of a walk scenario that do not depend on its bottle, without the duration."""
    hardware = scenario.device, scenario.supply_lines, scenario.gas_model, scenario.sensors, scenario.controller
    return *hardware, scenario.run.step, replace(walk_of(scenario), bottle=None)
