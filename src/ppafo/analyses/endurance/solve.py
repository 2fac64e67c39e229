"""Duration of a bottle for a gas demand from given numbers, from a recording, or from a walk."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from ppafo.analyses.endurance.answer import Endurance
from ppafo.analyses.endurance.discharge import check_schedule, discharge, discharge_of_life, smallest_mass_when_warm
from ppafo.analyses.endurance.gas_demand import GasDemand, demand_of_recording
from ppafo.analyses.endurance.walk_gas import WALK_FILE, WalkGas, demand_of_walk, read_walk_gas, walk_gas
from ppafo.arguments import checked
from ppafo.errors import DataError, ParameterError, PpafoError, refused_as
from ppafo.loading import reloaded, usage_text
from ppafo.model.gas import SPECIES
from ppafo.parameters.bottles.bottle import PAPER_BOTTLE, Bottle, load_bottle
from ppafo.parameters.declaration import SPECIES_PATH
from ppafo.parameters.overrides import read_overrides
from ppafo.parameters.parameter_set import SOURCE
from ppafo.report.kind import Kind
from ppafo.report.stored_figure import stated_units, table_at
from ppafo.signals import Recording
from ppafo.simulation.scenario import Scenario
from ppafo.storage.owned_folder import read_json
from ppafo.storage.reading import read_recording
from ppafo.storage.result_folder import RUN_FILE
from ppafo.units.shown import shown_in, shown_text, written_text
from ppafo.walking import WalkResult
from ppafo.walking.bottle.coupling import Schedule
from ppafo.walking.bottle.supply import BOTTLE_NAME, SET_PRESSURE, is_of_bottle, other_pressure
from ppafo.walking.loading import on_bottle
from ppafo.walking.motion import walk_of
from ppafo.walking.walk import bottle_life
from ppafo.wording import argument_text, override_text

BETWEEN_RESTS = 600.0
"""Default walking time between two rests [s]."""
STRIDE_TIME = 1.1
"""Default stride time [s]."""
LONGEST = 24.0 * 3600.0
"""Default of the longest simulated time [s]: one day."""
_SAME_TIME = 1.0e-3
"""Relative difference up to which two durations of a walk count as equal."""
WITHOUT_REST = Schedule(LONGEST, 0.0, LONGEST)
GasUse = str | Path | Recording | WalkResult
"""Gas use of a device: a walk or its result folder, or a recording, its file or its folder."""


def named_gas_uses(uses: Sequence[GasUse]) -> dict[str, GasUse]:
    """Return gas uses by name; ParameterError for a gas use that is given twice."""
    named: dict[str, GasUse] = {}
    for use in uses:
        if any(use is other or (isinstance(use, str | Path) and str(use) == str(other)) for other in named.values()):
            raise ParameterError("the same recording is given twice; give each recording only once")
        walked = use.scenario.name if isinstance(use, WalkResult) else str(use)
        label = use.label if isinstance(use, Recording) else walked
        # Walks of one scenario with other overrides have one name.
        alike = sum(name == label or name.startswith(f"{label} (") for name in named)
        named[f"{label} ({alike + 1})" if alike else label] = use
    return named


def endurance_of_gas_use(
    name: str,
    use: GasUse,
    stride_time: float | None,
    bottle: str | Path | None,
    schedule: Schedule,
    overrides: Iterable[str],
) -> Endurance:
    """Return the duration of a bottle for a walk that continues, or for a recording that is repeated.

    ``stride_time`` is the time of a stride in a recording [s]; by default the whole recording is repeated. For a walk,
    it raises ParameterError, in which the walk is called ``name``.
    """
    _check_no_gas_override(name, overrides)
    if isinstance(use, WalkResult):
        gas = walk_gas(use)
    elif isinstance(use, str | Path) and (Path(use) / WALK_FILE).is_file():
        gas = read_walk_gas(Path(use))
    else:
        return _endurance_of_recording(
            use, stride_time, PAPER_BOTTLE if bottle is None else bottle, schedule, tuple(overrides)
        )
    if stride_time is not None:
        argument = argument_text("stride_time")
        raise ParameterError(
            f"{argument} applies to recordings only: {name} repeats one stride of its walk; omit {argument}"
        )
    return endurance_of_walk_gas(gas, bottle, schedule, overrides)


def _check_no_gas_override(name: str, overrides: Iterable[str]) -> None:
    """Raise ParameterError for an override of the gas, which no bottle has as a parameter.

    The message explains how to repeat the run of the walk or recording ``name`` with another gas.
    """
    for override in read_overrides(overrides):
        if "gas" in override.typed.split("."):
            species = override.text if override.text in SPECIES else "NAME"
            again = override_text([f"{SPECIES_PATH}={species}"])
            raise ParameterError(
                f"override '{override}': a bottle has no parameter '{override.typed}'; the gas of a bottle is set in "
                f"the bottle file, the gas of the device in the scenario: to change it, repeat the run of {name} with "
                f"{again} and give the new result folder"
            )


def _endurance_of_recording(
    use: str | Path | Recording,
    stride_time: float | None,
    bottle: str | Path,
    schedule: Schedule,
    overrides: tuple[str, ...],
) -> Endurance:
    """Return the duration of a full bottle for a recording, its file or its result folder, which is repeated.

    ``stride_time`` is the time of a stride [s]; by default the whole recording is repeated. The regulator of a bottle
    of the package has the supply pressure that a result folder states, unless an override sets it. Raises DataError
    for the result folder of a device with another gas than the bottle contains.
    """
    full = load_bottle(bottle, overrides)
    if isinstance(use, Recording):
        recording, units = use, {}
    else:
        recording, run = read_recording(Path(use)), Path(use) / RUN_FILE
        document = read_json(run) if run.is_file() else {}
        units = dict(stated_units(run, document)) if document else {}
        of_device = partial(table_at, run, document, "scenario", "device")
        molar_mass, pressure = of_device("gas").get("molar_mass"), of_device("supply").get("pressure")
        if isinstance(molar_mass, float) and not is_of_bottle(molar_mass, full):
            raise DataError(
                f"{run}: the device uses gas of {1000.0 * molar_mass:.4g} g/mol, but bottle '{full.name}' contains "
                f"{full.fluid.name}; choose a bottle with the gas of the device (ppafo bottle --list), or simulate the "
                f"device with gas.species={full.fluid.name}"
            )
        is_own = Path(bottle).suffix == ".toml" or full.entries[SET_PRESSURE].source == SOURCE
        if isinstance(pressure, float) and not is_own and not math.isclose(pressure, full.regulator.set_pressure):
            with shown_in(units):
                full = load_bottle(bottle, [*overrides, f"{SET_PRESSURE}={written_text(pressure, 'Pa_a')}"])
    endurance = follow_bottle(full, demand_of_recording(recording, stride_time), schedule)
    return replace(endurance, is_of_recording=stride_time is None, device_units=units)


@checked
def endurance_of_walk(result: WalkResult, *, bottle: str | Path | None = None) -> Endurance | None:
    """Return the duration of a bottle when the walk continues without rest, or None if the walk took no gas.

    The same device walks on the bottle until the bottle is exhausted, as with ``ppafo walk --bottle``.
    The default of ``bottle`` is the bottle of the walk, else the paper's bottle. A repetition is a stride of the leg
    with the device.

    >>> import ppafo
    >>> endurance = ppafo.endurance_of_walk(ppafo.walk("solenoid", minutes=0.1), bottle="co2-25g")
    >>> print(f"{endurance.discharge.walking_time / 60.0:.1f} min: {endurance.discharge.ending.kind}")
    0.4 min: frozen
    """
    gas = walk_gas(result)
    # A walk that takes no gas lasts for ever on any bottle.
    return None if gas.gas_per_stride <= 0.0 else endurance_of_walk_gas(gas, bottle, WITHOUT_REST)


def endurance_of_walk_gas(
    gas: WalkGas,
    bottle: str | Path | None,
    schedule: Schedule,
    overrides: Iterable[str] = (),
) -> Endurance:
    """Return the duration of a bottle for a walk that continues, from the gas demand of the walk.

    Raises DataError if the walk took no gas or its scenario is unknown.
    """
    at_set_pressure = demand_of_walk(gas)
    if gas.scenario is None:
        raise DataError(
            f"{gas.name}: the folder does not state the scenario of the walk; repeat the walk with 'ppafo walk'"
        )
    if bottle is None and walk_of(gas.scenario).bottle is None:
        bottle = PAPER_BOTTLE
    if bottle is not None:
        _check_gas_of_walk(gas.name, gas.scenario, float(gas.recording.time[-1]), bottle)
    walking = on_bottle(gas.scenario, bottle, overrides)
    supply = walk_of(walking).bottle
    assert supply is not None, "a walk on a bottle"
    check_schedule(schedule)
    life = bottle_life(walking, schedule)
    # A bottle may end before the first stride does.
    strides = max(life.strides, 1.0e-9)
    stride_time, mass = life.walked / strides, life.course.regulated / strides
    before = Kind("", "kg", "gas mass", ".3g").text(at_set_pressure.mass_per_stride)
    origin = (
        f"{at_set_pressure.origin}, the device walks on the bottle: mean over its strides ({before} at constant set "
        "pressure; on the bottle the pressure at the valve falls with each draw, and the gas is colder and denser)"
    )
    demand = GasDemand(mass, stride_time, max(at_set_pressure.peak_flow, mass / stride_time), origin)
    ended = discharge_of_life(life, demand)
    # A walk goes on below the pressure that its regulator needs, as long as the torque suffices: warm as cold.
    lowest = float(ended.recording["bottle_pressure"][-1])
    usable = supply.mass - smallest_mass_when_warm(supply.bottle, demand, lowest)
    return Endurance(
        bottle=supply.bottle,
        draw=demand,
        schedule=schedule,
        discharge=ended,
        strides_when_warm=usable / demand.mass_per_stride,
        device_units=gas.scenario.device.shown,
    )


def _check_gas_of_walk(name: str, scenario: Scenario, duration: float, bottle: str | Path) -> None:
    """Raise DataError if a walk uses another gas than the bottle contains; the message has a command to repeat it.

    ``name`` is the walk in the message, ``duration`` its duration [s]. The command changes the gas of the device, its
    bottle and a supply pressure that does not suit the bottle.
    """
    full, device = load_bottle(bottle), scenario.device
    if is_of_bottle(device.gas.molar_mass, full):
        return
    species, changes = device.gas.species, [f"{SPECIES_PATH}={full.fluid.name}"]
    if walk_of(scenario).bottle is not None:
        changes.append(f"{BOTTLE_NAME}={bottle}")
    if (pressure := other_pressure(str(bottle), full, device)) is not None:
        room, unit = device.supply.atmospheric_pressure, full.entries[SET_PRESSURE].unit
        changes.append(f"supply.pressure={shown_text(pressure, 'Pa_a', atmosphere=room, unit=unit)}")
    problem = f"walk '{name}' uses {species}, and cannot be repeated on bottle '{full.name}' of {full.fluid.name}"
    with refused_as(DataError, problem, PpafoError):
        again = reloaded(scenario, changes)
    command = usage_text(again).partition("\n")[0]
    if abs(duration - again.run.duration) > _SAME_TIME * duration:
        command += f" --minutes {duration / 60.0:.6g}"
    raise DataError(
        f"walk '{name}': the device uses {species}, but bottle '{full.name}' contains {full.fluid.name}; "
        f"repeat the walk with '{command} --out FOLDER' and give FOLDER, or choose a bottle of {species}"
    )


def follow_bottle(bottle: Bottle, draw: GasDemand, schedule: Schedule) -> Endurance:
    """Return the duration of a full bottle for a gas demand, with a schedule of walking and rest."""
    usable = bottle.mass - smallest_mass_when_warm(bottle, draw)
    return Endurance(
        bottle=bottle,
        draw=draw,
        schedule=schedule,
        discharge=discharge(bottle, draw, schedule),
        strides_when_warm=usable / draw.mass_per_stride,
    )
