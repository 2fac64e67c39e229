"""Duration of a gas bottle for the gas use of numbers, of a recording or of a walk, and why it ends."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ppafo.arguments import Duration, Flow, Mass, Overrides, Word, checked
from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.errors import DataError, ParameterError, PpafoError, refused_as
from ppafo.plugins import Plugins, name_plugins
from ppafo.units.shown import in_units, shown_in, shown_text, units_in_force, written_text
from ppafo.wording import argument_text

if TYPE_CHECKING:
    from ppafo.analyses.endurance.discharge import Endurance
    from ppafo.report.finding import Finding
    from ppafo.report.panels import Panel
    from ppafo.signals import Recording
    from ppafo.signals.recording import Floats
    from ppafo.simulation.scenario import Scenario
    from ppafo.walking import WalkResult
    from ppafo.walking.bottle.coupling import Schedule

GasUses = Annotated[
    "str | Path | Recording | WalkResult | Sequence[str | Path | Recording | WalkResult]",
    Word("RECORDING", Path, is_repeated=True),
]
WALK_FILE = "walk.json"
"""Name of the file in a result folder that describes a walk."""
PEAK_WINDOW = 0.1
"""Averaging window [s] for the largest flow of a recording; lines and regulator smooth shorter peaks."""
_BETWEEN_RESTS, _STRIDE_TIME, _SHORTEST = 600.0, 1.1, 1.0
"""Default walking time between two rests, default stride time, shortest walking and simulated time [s]."""
MAXIMUM_INTERVALS, _MOST_GAS = 2000, 1.0e3
"""Largest number of walking and resting intervals, which are integrated one by one, and gas of a stride [kg]."""
_MOST_RETURNED = 0.1
"""Largest fraction of the gas that may flow back; it stays in the line upstream of the valve for the next stride."""


@checked
def bottle(
    recordings: GasUses = (),
    *,
    gas_per_stride: Mass | None = None,
    stride_time: Duration | None = None,
    peak_flow: Flow | None = None,
    bottle: Annotated[str | Path, Word("BOTTLE")] | None = None,
    walk: Duration | None = None,
    rest: Duration | None = None,
    longest: Duration = 24.0 * 3600.0,
    overrides: Overrides = (),
    plugins: Plugins = (),
) -> Finding[Endurance] | Finding[dict[str, Endurance]]:
    """Compute how long a bottle of gas lasts, and why it ends.

    A walk in ``recordings``, as a result or its folder, continues on the bottle until the bottle ends; any other
    recording is repeated. Without recordings, the gas use is ``gas_per_stride`` every ``stride_time``, with at most
    ``peak_flow``.

    Arguments:
        recordings: a .csv or .nc file with supplied_mass, or the result folder of a run or a walk; repeated until the
            bottle ends; several are compared side by side
        gas_per_stride: gas per stride, for example '0.3 g'
        stride_time: time of one stride; default: '1.1 s', the whole recording, or one stride of a walk
        peak_flow: largest flow, for example '4.5 g/s'; default: the mean flow
        bottle: name of a bottle or a .toml file; default: the walk's, or the paper's bottle
        walk: time of walking between two rests, with --rest; default '10 min'
        rest: time of each rest; default '0 s' (no rest)
        longest: maximum simulated time; default '1440 min'
        overrides: values to change, for example 'room.temperature=5 degC'; may be repeated
        plugins: modules of your own, files or names, whose objects files may name

    Returns:
        a Finding whose ``found`` is an Endurance, or the Endurance of each recording by name if there are several

    Raises:
        ParameterError: a bottle, a gas use or a schedule that cannot be used
        DataError: a recording that cannot be used
        SimulationError: a simulation of the bottle that fails

    >>> import ppafo
    >>> found = ppafo.bottle(gas_per_stride="0.3 g").found
    >>> print(f"{found.walking_time / 60.0:.1f} min: {found.ending}")
    14.6 min: too cold
    """
    name_plugins(plugins)
    from ppafo.analyses.endurance.discharge import discharge
    from ppafo.arguments.reading import units_given
    from ppafo.parameters.bottles.bottle import PAPER_BOTTLE, load_bottle
    from ppafo.parameters.overrides import read_overrides
    from ppafo.signals import Recording
    from ppafo.walking import WalkResult

    uses = (recordings,) if isinstance(recordings, str | Path | Recording | WalkResult) else tuple(recordings)
    if bool(uses) == (gas_per_stride is not None):
        example = argument_text("gas_per_stride", "0.3 g")
        raise ParameterError(f"give either a recording or {argument_text('gas_per_stride')}, for example {example}")
    schedule, changes = _schedule(walk, rest, longest), tuple(overrides)
    chosen = PAPER_BOTTLE if bottle is None else bottle
    for override in read_overrides(changes):
        if "gas" in override.typed.split("."):
            raise ParameterError(f"override '{override}': the gas is that of the bottle; choose another bottle")
    if gas_per_stride is not None:
        time, units = _STRIDE_TIME if stride_time is None else stride_time, units_given({"kg/s": peak_flow})
        if time <= 0.0:
            raise ParameterError(f"{argument_text('stride_time')} = {time:g} s: must be above 0 s")
        with shown_in({**units_in_force(), **units}):
            mean = gas_per_stride / time
            if peak_flow is not None and peak_flow < mean:
                least = shown_text(mean, "kg/s", ".4g")
                raise ParameterError(f"{argument_text('peak_flow')}: must be at least the mean flow, {least}")
            full = load_bottle(chosen, changes)
            found = discharge(full, gas_per_stride, time, mean if peak_flow is None else peak_flow, schedule)
        return _finding({"": replace(found, shown={**found.shown, **units})})
    if peak_flow is not None:
        raise ParameterError(f"{argument_text('peak_flow')}: only with {argument_text('gas_per_stride')}")
    results: dict[str, Endurance] = {}
    for number, use in enumerate(uses):
        if any(use is other or (isinstance(use, str | Path) and str(use) == str(other)) for other in uses[:number]):
            raise ParameterError("the same recording is given twice; give each recording only once")
        if isinstance(use, WalkResult) or (not isinstance(use, Recording) and (Path(use) / WALK_FILE).is_file()):
            walked = gas_of_walk(use if isinstance(use, WalkResult) else Path(use))
            name = walked[0].name if isinstance(use, WalkResult) else str(use)
            if stride_time is not None:
                raise ParameterError(f"{argument_text('stride_time')}: {name} repeats one stride of its walk; omit it")
            found = _on_walk(*walked, bottle, schedule, changes)
        else:
            name = use.label if isinstance(use, Recording) else str(use)
            found = _of_recording(use, stride_time, chosen, schedule, changes)
        # Walks of one scenario with other overrides have one name.
        alike = sum(other == name or other.startswith(f"{name} (") for other in results)
        results[f"{name} ({alike + 1})" if alike else name] = found
    return _finding(results)


def _schedule(walk: float | None, rest: float | None, longest: float) -> Schedule:
    """Return times of walking and rest; raises ParameterError for those that cannot be simulated."""
    from ppafo.walking.bottle.coupling import Schedule

    if walk is not None and rest is None:
        raise ParameterError(f"{argument_text('walk')}: also give {argument_text('rest')}, the time of each rest")
    schedule = Schedule(_BETWEEN_RESTS if walk is None else walk, rest or 0.0, longest)
    most = 0.5 * MAXIMUM_INTERVALS * (schedule.walk + schedule.rest) if rest else math.inf
    for name, value, largest in (("walk", schedule.walk, math.inf), ("longest", longest, most)):
        if not _SHORTEST <= value <= largest:
            limits = f"at least {_SHORTEST:g} s" + f", at most {largest:g} s with such rests" * (value > largest)
            raise ParameterError(f"{argument_text(name)} = {value:g} s: must be {limits}")
    return schedule


def gas_of_walk(walk: WalkResult | Path) -> tuple[Scenario, Recording, float]:
    """Return scenario, recording and gas per assisted stride [kg] of a walk or its folder; 0 if it took no gas."""
    from ppafo.report.stored_figure import table_at
    from ppafo.simulation.loading import request_again, scenario_of
    from ppafo.simulation.scenario import Origin
    from ppafo.storage.owned_folder import read_json
    from ppafo.storage.reading import read_recording
    from ppafo.walking.loading import WALKING
    from ppafo.walking.result import WALK_FORMAT

    if not isinstance(walk, Path):
        return walk.scenario, walk.recording, walk.metrics["gas"].value if "gas" in walk.metrics else 0.0
    file = walk / WALK_FILE
    document = read_json(file)
    if not isinstance(document, dict) or document.get("format") != WALK_FORMAT:
        raise DataError(f"{file}: format: must be '{WALK_FORMAT}', as written by 'ppafo walk'")
    if table_at(file, document, "status").get("kind") == "diverged":
        raise DataError(f"{file}: the walk diverged, so its gas use cannot be repeated; give one that ran to its end")
    configuration, gas = table_at(file, document, "configuration"), table_at(file, document, "metrics", "gas")
    amount = gas.get("value", 0.0)
    content, overrides, source = configuration.get("content"), configuration.get("overrides"), configuration.get("file")
    is_stated = isinstance(source, str | None) and isinstance(amount, int | float) and abs(amount) < _MOST_GAS
    if not (is_stated and isinstance(content, dict) and isinstance(overrides, list)):
        raise DataError(f"{file}: does not state the walk and its gas; repeat it with 'ppafo walk'")
    with refused_as(DataError, f"{file}: the walk cannot be repeated", PpafoError):
        scenario = scenario_of(request_again(Origin(source, "", "", tuple(map(str, overrides)), content)), WALKING)
    return scenario, read_recording(walk), float(amount)


def _on_walk(
    scenario: Scenario,
    recording: Recording,
    gas: float,
    bottle: str | Path | None,
    schedule: Schedule,
    overrides: Sequence[str],
) -> Endurance:
    """Return the duration of a bottle for a walk that continues, from its gas per assisted stride [kg].

    Raises DataError if the walk took no gas, ScenarioError if it cannot be combined with the bottle.
    """
    from ppafo.analyses.endurance.discharge import TIME_IS_UP, Endurance, smallest_mass_when_warm
    from ppafo.parameters.bottles.bottle import PAPER_BOTTLE
    from ppafo.report.kind import Kind
    from ppafo.walking.bottle.course import WALKED
    from ppafo.walking.loading import on_bottle
    from ppafo.walking.motion import walk_of
    from ppafo.walking.walk import bottle_life

    if gas <= 0.0:
        raise DataError(f"walk '{scenario.name}': takes no gas, so no bottle would become empty; give one with help")
    if bottle is None and walk_of(scenario).bottle is None:
        bottle = PAPER_BOTTLE
    walking = on_bottle(scenario, bottle, overrides)
    supply = walk_of(walking).bottle
    assert supply is not None, "a walk on a bottle"
    life = bottle_life(walking, schedule)
    course, end = life.course, life.course.ending
    # A bottle may end before the first stride does.
    strides = max(life.strides, 1.0e-9)
    stride_time, mass = life.walked / strides, course.regulated / strides
    # An open valve may let gas back into the supply for moments, so the largest flow is a mean over 0.1 s.
    peak = max(largest_flow(recording), gas / walk_of(scenario).gait.stride_time, mass / stride_time)
    # A walk goes on below the pressure that its regulator needs, as long as the torque suffices: warm as cold.
    lowest = float(course.values["bottle_pressure"][-1])
    return Endurance(
        bottle=supply.bottle,
        schedule=schedule,
        origin=f"walk '{scenario.name}', {recording.kind}, on the bottle: mean over its strides "
        f"({Kind(quantity='gas mass', form='.3g').text(gas)} at constant set pressure)",
        mass_per_stride=mass,
        stride_time=stride_time,
        mean_flow=mass / stride_time,
        peak_flow=peak,
        walking_time=life.walked,
        total_time=life.total,
        strides=life.strides,
        strides_when_warm=(supply.mass - smallest_mass_when_warm(supply.bottle, peak, lowest)) / mass,
        ending=TIME_IS_UP if end.kind == WALKED else end.kind,
        message=end.message,
        mass_left=course.last.mass,
        usable_when_warm=max(0.0, course.last.mass - smallest_mass_when_warm(supply.bottle, peak)),
        balance=course.balance._asdict(),
        shown=scenario.device.shown,
        # Read where it is wanted; a function of its own could not be pickled.
        record=partial(getattr, course, "recording"),
    )


def _of_recording(
    use: str | Path | Recording,
    stride_time: float | None,
    bottle: str | Path,
    schedule: Schedule,
    overrides: Sequence[str],
) -> Endurance:
    """Return the duration of a bottle for a recording, its file or its result folder, which is repeated.

    The regulator of a bottle of the package has the supply pressure that a result folder states, unless an override
    sets it.
    """
    from ppafo.analyses.endurance.discharge import discharge
    from ppafo.parameters.bottles.bottle import load_bottle
    from ppafo.parameters.parameter_set import SOURCE
    from ppafo.report.stored_figure import stated_units, table_at
    from ppafo.signals import Recording
    from ppafo.storage.owned_folder import read_json
    from ppafo.storage.reading import read_recording
    from ppafo.storage.result_folder import RUN_FILE
    from ppafo.walking.bottle.supply import SET_PRESSURE, is_of_bottle

    full, units = load_bottle(bottle, overrides), dict[str, str]()
    recording = use if isinstance(use, Recording) else read_recording(Path(use))
    run = Path() if isinstance(use, Recording) else Path(use) / RUN_FILE
    if run.is_file():
        document = read_json(run)
        units = dict(stated_units(run, document))
        gas, supply = (table_at(run, document, "scenario", "device", name) for name in ("gas", "supply"))
        molar_mass, pressure = gas.get("molar_mass"), supply.get("pressure")
        if isinstance(molar_mass, float) and not is_of_bottle(molar_mass, full):
            raise DataError(
                f"{run}: the device uses gas of {GRAMS_PER_KILOGRAM * molar_mass:.4g} g/mol, but bottle '{full.name}' "
                f"contains {full.fluid.name}; choose another (ppafo bottle --list), or set gas.species of the device"
            )
        is_own = Path(bottle).suffix == ".toml" or full.entries[SET_PRESSURE].source == SOURCE
        if isinstance(pressure, float) and not is_own and not math.isclose(pressure, full.regulator.set_pressure):
            with shown_in(units):
                full = load_bottle(bottle, [*overrides, f"{SET_PRESSURE}={written_text(pressure, 'Pa_a')}"])
    use_of_gas = *gas_of_recording(recording, stride_time), schedule
    found = discharge(full, *use_of_gas, f"recording '{recording.label}', {recording.kind}, repeated")
    counted = "repetition" if stride_time is None else "stride"
    return replace(found, counted=counted, shown={**found.shown, **units})


def gas_of_recording(recording: Recording, stride_time: float | None) -> tuple[float, float, float]:
    """Return gas per stride [kg], its time [s] and the largest flow [kg/s] of a repeated recording.

    Without ``stride_time`` the whole recording is one stride.
    """
    import numpy as np

    where = recording.label
    if "supplied_mass" not in recording:
        raise DataError(f"{where}: there is no channel 'supplied_mass'; available: {', '.join(recording.names)}")
    supplied = _gas_use(recording)
    # Not the last value alone: a recording may begin in the middle of a walk.
    gain = float(supplied[-1] - supplied[0])
    if recording.duration <= 0.0 or gain <= 0.0:
        raise DataError(f"{where}: takes no gas, so no bottle would become empty; give a recording that uses gas")
    returned = -float(np.minimum(np.diff(supplied), 0.0).sum())
    if returned > _MOST_RETURNED * gain:
        raise DataError(
            f"{where}: supplied_mass falls by {returned * GRAMS_PER_KILOGRAM:.3g} g in total and rises by "
            f"{gain * GRAMS_PER_KILOGRAM:.3g} g; it must be the cumulative gas from start to end"
        )
    stride = recording.duration if stride_time is None else stride_time
    if not 0.0 < stride <= recording.duration:
        name, most = argument_text("stride_time"), f"{recording.duration:g} s, the length of the recording"
        raise DataError(f"{where}: {name} = {stride:g} s: must be above 0 s and at most {most}")
    mean = gain / recording.duration
    return mean * stride, stride, max(mean, largest_flow(recording))


def _gas_use(recording: Recording) -> Floats:
    """Return the gas [kg] drawn from the bottle: at the regulator of a simulated supply line, else at the valve."""
    return recording["regulated_mass" if "regulated_mass" in recording else "supplied_mass"]


def largest_flow(recording: Recording) -> float:
    """Return the largest flow [kg/s], as moving average over the window, or over a shorter recording."""
    import numpy as np

    window = min(PEAK_WINDOW, recording.duration)
    starts = recording.time[recording.time <= recording.time[-1] - window]
    # The last window need not begin at a sample.
    starts = np.append(starts, recording.time[-1] - window)
    begins, ends = (np.interp(times, recording.time, _gas_use(recording)) for times in (starts, starts + window))
    return float(np.max(ends - begins) / window)


@in_units(lambda results: next(iter(results.values())).shown)
def _finding(results: dict[str, Endurance]) -> Finding[Any]:
    """Return the report of a bottle for one gas use, with facts, figure and values, or the table of several."""
    from ppafo.report.finding import Finding, Section, columns_of, facts
    from ppafo.report.kind import TIME, Kind, duration_kind
    from ppafo.storage.comma_separated import marked_csv_bytes
    from ppafo.units import format_quantity
    from ppafo.walking.bottle.course import strides_text

    first, several, gas = next(iter(results.values())), len(results) > 1, Kind(quantity="gas mass", form=".3g")
    full, counted = first.bottle, first.counted
    if several:
        are_strides = all(use.counted == "stride" for use in results.values())
        counted, time = ("stride", "walking") if are_strides else ("repetition", "run time")
        longest = duration_kind(max(use.walking_time for use in results.values()))
        titles = ("gas use", (f"gas per {counted}", gas), (time, longest), f"{counted}s", "ended")
        rows = [
            (name, use.mass_per_stride, use.walking_time, strides_text(use.strides), use.ending)
            for name, use in results.items()
        ]
        parts = [Section(columns=columns_of(titles, rows))]
    else:
        values = [
            (path, format_quantity(entry.value, entry.unit), entry.origin, entry.source)
            for path, entry in full.entries.items()
        ]
        parts = [
            Section(columns=facts(_facts(first))),
            Section(
                "The bottle over time",
                panels=partial(_panels, first),
                name="endurance",
                caption="Temperature, pressure and gas in the bottle from full to the end.",
                size=(5.4, 1.8),
                title=f"{full.label}: {gas.text(first.mass_per_stride)} per {counted} of "
                f"{TIME.text(first.stride_time, '.3g')}",
                note=f"End: {first.message}.",
                is_detail=True,
            ),
            Section(
                "Values",
                columns_of(("value", "", "origin", "source"), values),
                remarks=(f"Gas properties: {full.fluid.source}.",),
                left=4,
                is_detail=True,
            ),
        ]
    return Finding(
        name="endurance",
        kicker="Endurance",
        title="How long the bottle lasts",
        said=(full.title,) if several else (full.title, f"gas use: {first.origin}"),
        parts=parts,
        found=results if several else first,
        files={} if several else {"bottle.csv": partial(marked_csv_bytes, first.recording)},
    )


def _facts(endurance: Endurance) -> list[tuple[str, str]]:
    """Return the most important results of a discharge as pairs of name and value."""
    import numpy as np

    from ppafo.model.cold_gas import heat_to_warm
    from ppafo.model.source import bottle_content
    from ppafo.report.kind import Kind
    from ppafo.walking.bottle.course import duration_text, strides_text
    from ppafo.walking.bottle.supply import SET_PRESSURE

    mass, flow, pressure = (Kind(quantity=name, form=".3g").text for name in ("gas mass", "mass flow", "pressure"))
    recording, full, counted = endurance.recording, endurance.bottle, endurance.counted
    # What warms the gas of the full bottle to the room's temperature behind the regulator.
    content = bottle_content(full.fluid.table, full.mass, full.volume, full.room_temperature)
    heat = heat_to_warm(full.fluid.table, content, full.room_temperature, full.regulator.set_pressure)
    of_device = ", the supply pressure of the device" * (full.entries[SET_PRESSURE].origin == "derived")
    walked = f"{duration_text(endurance.walking_time)} of {'use' if counted == 'repetition' else 'walking'}"
    flows = f"{flow(endurance.mean_flow)}, largest {flow(endurance.peak_flow)}"
    when_warm = f"{strides_text(endurance.strides_when_warm)} (a bottle that stays at room temperature)"
    coldest = Kind(quantity="temperature", form=".1f").text(float(np.min(recording["bottle_temperature"])))
    rows = [
        ("run time", f"{walked}, {duration_text(endurance.total_time)} in total"),
        ("strides" if counted == "stride" else "repetitions of the recording", strides_text(endurance.strides)),
        (f"{counted}s without cooling", when_warm),
        ("regulator set to", pressure(full.regulator.set_pressure) + of_device),
        ("ended", endurance.message),
        ("gas", f"{mass(endurance.mass_per_stride)} a {counted}, {flows}"),
        ("heat that it lacks", f"{heat * endurance.mean_flow:.3g} W, {heat / 1000.0:.3g} kJ/kg, at the start"),
        ("lowest temperature of the fluid", coldest),
        ("pressure at the end", pressure(float(recording["bottle_pressure"][-1]))),
    ]
    if "liquid_mass" in recording:
        dry = np.flatnonzero(recording["liquid_mass"] <= 0.0)
        remaining = f"no, {mass(float(recording['liquid_mass'][-1]))} left"
        rows.append(
            ("liquid used up", f"after {duration_text(float(recording.time[dry[0]]))}" if dry.size else remaining)
        )
    return rows


def _panels(endurance: Endurance) -> list[Panel]:
    """Return the panels of temperature, pressure and gas of the bottle over time."""
    from ppafo.report.kind import Kind, duration_kind
    from ppafo.report.panels import Mark, Panel
    from ppafo.report.style import BLUE, GREEN, GREY, ORANGE, VERMILION

    recording, regulator = endurance.recording, endurance.bottle.regulator
    time, needed = recording.time, regulator.set_pressure + regulator.pressure_margin
    dotted, dashed = ({"linestyle": style, "linewidth": 1.2} for style in (":", "--"))
    warmth = Kind("Temperature of the bottle", "K", "temperature")
    pressure, mass = Kind("Pressure in the bottle", "Pa_a", "pressure"), Kind("Left in the bottle", "kg", "gas mass")
    marks = {
        warmth: [Mark("level", (), endurance.bottle.room_temperature, (), "room", GREY, dotted)],
        pressure: [Mark("level", (), needed, (), "needed", VERMILION, dashed)],
        mass: [],
    }
    for kind, name, label, colour in (
        (warmth, "wall_temperature", "wall", ORANGE),
        (warmth, "bottle_temperature", "content", BLUE),
        (pressure, "bottle_pressure", "bottle", BLUE),
        (mass, "bottle_mass", "total gas", BLUE),
        (mass, "liquid_mass", "liquid", GREEN),
    ):
        if name in recording:
            marks[kind].append(Mark("line", time, recording[name], (), label, colour))
    axis = duration_kind(float(time[-1]))
    end = float(axis.values(time[-1]))
    return [
        Panel(axis, kind, lines, then=lambda axes: axes.set_xlim(0.0, end), shares_x=True)
        for kind, lines in marks.items()
    ]
