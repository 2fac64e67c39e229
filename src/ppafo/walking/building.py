"""Building of a walk scenario from a validated document: motion, controller, sensors, supply and duration."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from ppafo.control.walking.catalog import walking_controllers
from ppafo.errors import DataError, ParameterError, ScenarioError, refused_as
from ppafo.gait import NORMATIVE, load_gait
from ppafo.parameters.declared import kind_at, value_at
from ppafo.simulation.assumptions import assumed_lines
from ppafo.simulation.building import origin_of, read_gas_model, read_supply_line, with_settings
from ppafo.simulation.declaration import PERIOD, RATE, SUPPLY_LINE
from ppafo.simulation.document import DocumentReader, ScenarioRequest
from ppafo.simulation.hardware import read_device, read_hardware
from ppafo.simulation.motion_kind import MOTIONS, WALK
from ppafo.simulation.overrides import OverriddenDocument
from ppafo.simulation.scenario import Assumption, Control, Initial, RunSettings, Scenario, Sensors
from ppafo.walking.bottle.supply import BottleSupply, read_bottle
from ppafo.walking.contradictions import check_walk
from ppafo.walking.declaration import (
    DURATION,
    FORCES,
    SEED,
    STEP,
    WALK_SENSORS,
)
from ppafo.walking.motion import WalkMotion, duration_problems, record_interval, walk_of, with_duration
from ppafo.walking.planning import NO_REFERENCE
from ppafo.walking.wearer import links_of_stature, read_wearer, wearer_origin

DEFAULT_PERIOD = 1.0e-3
"""Default sample period of the controller [s]."""
DEFAULT_DURATION, BOTTLE_DURATION = 60.0, 600.0
"""Default duration of a walk [s], and of a walk on a bottle, which may end it earlier."""


def build_walk(request: ScenarioRequest, changed: OverriddenDocument) -> Scenario:
    """Return the walk described by a document whose keys have been validated.

    Raises ScenarioError, ParameterError or DataError for the first value that cannot be used.
    """
    document = changed.document
    reading = DocumentReader(request.file, document, changed.paths, request.text)
    hardware = read_hardware(reading, request, changed.device)
    device = read_device(reading, hardware)
    with refused_as(ParameterError, f"{request.file}: [device]", ParameterError):
        device.check_pressurised("a walk, whose controllers fill the chambers,")
    bottle = read_bottle(reading, device, request.folder)
    if bottle is not None:
        # A bottle always feeds lines, by default those of the declarations.
        document.setdefault(SUPPLY_LINE, {})
    line = read_supply_line(reading, device)
    if line is not None and bottle is not None:
        line = bottle.fed(line)
    sensors = reading.section("sensors", WALK_SENSORS)
    motion = _motion(reading, request, bottle, sensors)
    step = reading.number("run.step", STEP)
    kind = kind_at(document, "controller")
    law = walking_controllers()[kind]
    atmosphere = device.supply.atmospheric_pressure
    scenario = Scenario(
        name=document["name"],
        description=document.get("description", ""),
        device=device,
        run=RunSettings(DEFAULT_DURATION, step, record_interval(DEFAULT_DURATION)),
        motion=motion,
        initial=Initial(atmosphere, atmosphere),
        # A law that is named by its module keeps this name; a law of the catalogue has the name that it has in walking.
        controller=Control(kind if ":" in kind else law.name, {}, _period(reading)),
        reference=NO_REFERENCE,
        sensors=Sensors(
            **{name: number for name, number in sensors.items() if name not in FORCES},
            seed=int(reading.number("sensors.seed", SEED)),
        ),
        assumptions=_assumed(reading, bottle),
        origin=origin_of(request, changed, hardware),
        gas_model=read_gas_model(reading),
        supply_line=line,
    )
    scenario = with_settings(reading, scenario, law.quantities)
    scenario = replace(scenario, links={**scenario.links, **links_of_stature(reading.document)})
    # Numbers that are usable by themselves may contradict each other.
    check_walk(scenario, reading)
    return with_duration(scenario, _duration(reading, scenario))


def _motion(
    reading: DocumentReader,
    request: ScenarioRequest,
    bottle: BottleSupply | None,
    sensors: Mapping[str, float],
) -> WalkMotion:
    """Return the motion of a walk: wearer, gait, tasks, bottle; ``sensors`` are the sensor settings [SI]."""
    name = reading.document.get("gait", NORMATIVE)
    # A relative path starts in the folder of the document.
    with refused_as(DataError, reading.quote("gait"), DataError):
        gait = load_gait(request.folder / name if Path(name).suffix == ".toml" else name)
    is_named = "gait" in reading.document
    return WalkMotion(
        motion_kind=MOTIONS[kind_at(reading.document, "motion") or WALK],
        gait=gait,
        wearer=read_wearer(reading, gait, is_named),
        forces={name: sensors[name] for name in FORCES},
        bottle=bottle,
        wearer_origin=wearer_origin(reading, gait, is_named),
    )


def _period(reading: DocumentReader) -> float:
    """Return the sample period of the controller [s]."""
    if value_at(reading.document, "controller.rate") is not None:
        return 1.0 / reading.number("controller.rate", RATE)
    is_given = value_at(reading.document, "controller.period") is not None
    return reading.number("controller.period", PERIOD) if is_given else DEFAULT_PERIOD


def _assumed(reading: DocumentReader, bottle: BottleSupply | None) -> tuple[Assumption, ...]:
    """Return the assumptions of a walk: from its file, its supply lines and its bottle."""
    notes = reading.document.get("assumed", {}) | ({} if bottle is None else bottle.assumed)
    assumptions = {}
    for path, note in notes.items():
        value = value_at(reading.document, path)
        assumptions[path] = Assumption(path, "" if value is None else str(value), note)
    for line in assumed_lines(reading):
        assumptions[line.path] = replace(line, note=f"{line.value}, {line.note}")
    return tuple(assumptions.values())


def _duration(reading: DocumentReader, scenario: Scenario) -> float:
    """Return the duration of a walk [s] from its file, else 60 s, or 600 s on a bottle."""
    motion = walk_of(scenario)
    if value_at(reading.document, "run.duration") is not None:
        duration = reading.number("run.duration", DURATION)
        for is_bad, line in duration_problems(scenario, duration):
            if is_bad:
                raise ScenarioError(f"{reading.file}: {line(0)}")
        return duration
    return DEFAULT_DURATION if motion.bottle is None else BOTTLE_DURATION
