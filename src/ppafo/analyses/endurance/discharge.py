"""Discharge of a full bottle by numbers, a recording or a walk until it no longer maintains the supply pressure."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.documents.json_text import fields_of
from ppafo.errors import DataError, ParameterError, PpafoError, refused_as
from ppafo.model.cold_gas import heat_to_warm, isobar, open_share
from ppafo.model.source import (
    BottleContent,
    bottle_content,
    densest_gas,
    has_liquid,
    pressure_reserve,
    regulator_flow_limit,
)
from ppafo.parameters.bottles.bottle import PAPER_BOTTLE, Bottle, load_bottle
from ppafo.parameters.parameter_set import SOURCE
from ppafo.report.finding import Finding, Section, columns_of, facts
from ppafo.report.kind import TIME, Kind, duration_kind
from ppafo.report.panels import Mark, Panel
from ppafo.report.recording_figure import stated_units, table_at
from ppafo.report.style import BLUE, GREEN, GREY, ORANGE, VERMILION
from ppafo.signals import Recording
from ppafo.signals.recording import Floats
from ppafo.simulation.clock import MAXIMUM_STEPS
from ppafo.simulation.loading import request_again, scenario_of
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Origin, Scenario
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.storage.owned_folder import read_json
from ppafo.storage.reading import read_recording
from ppafo.storage.result_folder import RUN_FILE
from ppafo.units import format_quantity
from ppafo.units.shown import in_units, shown_in, shown_text, units_beside, written_text
from ppafo.version import __version__
from ppafo.walking import WalkResult
from ppafo.walking.bottle.coupling import (
    ABOVE_FREEZING,
    LEAST_FLOW,
    OPEN,
    RESTING,
    WALKED,
    Meeting,
    Schedule,
    SupplyCourse,
    duration_text,
    met_again,
    strides_text,
    walk_on_bottle,
)
from ppafo.walking.bottle.supply import SET_PRESSURE, BottleSupply, is_of_bottle
from ppafo.walking.loading import WALKING, on_bottle
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import fed_device
from ppafo.walking.result import WALK_FORMAT
from ppafo.walking.walk import silent
from ppafo.wording import argument_text

WALK_FILE = "walk.json"
"""Name of the file in a result folder that describes a walk."""
PEAK_WINDOW = 0.1
"""Averaging window [s] for the largest flow of a recording; lines and regulator smooth shorter peaks."""
_MOST_GAS = 1.0e3
"""Largest gas of a stride [kg]."""
_MOST_RETURNED = 0.1
"""Largest fraction of the gas that may flow back; it stays in the line upstream of the valve for the next stride."""
TIME_IS_UP = "time is up"
_NEXT_TO_NOTHING = 0.01
"""Usable gas at room temperature, as a fraction of a full bottle, below which a bottle counts as empty [-]."""
_SHORTEST = 1.0e-3
"""Time [s] to which the end of a bottle is found."""
_LARGEST_DRAW = 0.01
"""Largest fraction of the gas drawn in one step [-]: an insulated bottle ends within 0.01 K of its isentrope."""
_FASTEST = 20.0
"""Largest thermal rate [1/s] of a bottle that is drawn for hours."""


@dataclass(frozen=True)
class Endurance:
    """Duration of a full bottle for a gas use: inputs and result, in SI.

    - ``bottle``, ``schedule``: the bottle; times of walking and rest [s]
    - ``origin``: origin of the gas use; ``counted``: "stride", or "repetition" if a whole recording is repeated
    - ``mass_per_stride``, ``stride_time``: gas use [kg], [s]; ``mean_flow``, ``peak_flow``: while walking [kg/s]
    - ``walking_time``, ``total_time``, ``strides``: duration [s], [s] and number of strides
    - ``strides_when_warm``: strides from a bottle at constant room temperature, to show the effect of cooling
    - ``ending``, ``message``: reason of the end, and its explanation
    - ``mass_left``, ``usable_when_warm``: gas left in the bottle, and the part of it usable at room temperature [kg]
    - ``balance``: mass [kg] and energy [J] across the boundary, and their changes inside
    - ``shown``: display units by SI unit, of the device if it is known, otherwise of the bottle file
    """

    bottle: Bottle
    schedule: Schedule
    origin: str
    mass_per_stride: float
    stride_time: float
    mean_flow: float
    peak_flow: float
    walking_time: float
    total_time: float
    strides: float
    strides_when_warm: float
    ending: str
    message: str
    mass_left: float
    usable_when_warm: float
    balance: Mapping[str, float]
    shown: Mapping[str, str] = field(compare=False)
    record: Callable[[], Recording] = field(repr=False, compare=False)
    counted: str = "stride"

    @cached_property
    def recording(self) -> Recording:
        """State of the bottle over time, computed at the first access, which takes as long as the simulation."""
        return self.record()

    def json_document(self) -> dict[str, Any]:
        """Return the duration, its end and the bottle as plain data in SI units."""
        bottle = self.bottle
        recording = self.recording
        return {
            "format": "ppafo bottle",
            "schema_version": 2,
            "kind": "simulated",
            "ppafo": __version__,
            **{each.name: getattr(self, each.name) for each in fields(self) if each.compare},
            "coldest_temperature": float(np.min(recording["bottle_temperature"])),
            "at_end": {name: float(recording[name][-1]) for name in recording.names},
            "schedule": self.schedule._asdict(),
            "bottle": {
                **fields_of(bottle, "name", "title", "volume"),
                "fluid": bottle.fluid.name,
                "properties": bottle.fluid.source,
                "gas_mass": bottle.mass,
                "values": {path: asdict(entry) for path, entry in bottle.entries.items()},
            },
        }


def discharge(
    bottle: Bottle,
    mass_per_stride: float,
    stride_time: float,
    peak_flow: float,
    schedule: Schedule,
    origin: str = "numbers given",
) -> Endurance:
    """Return the duration of a full bottle for a gas use [kg], [s], [kg/s]; while walking, the draw is the mean flow.

    The mean replaces the pulses because strides take about a second and bottles cool in minutes. The regulator is
    checked against the largest flow. Bottle, regulator and hose are those of a walk on the bottle. Raises
    ParameterError for a largest flow that the full bottle does not give, and for parts that follow too fast.
    """
    mean_flow = mass_per_stride / stride_time
    content = bottle_content(bottle.fluid.table, bottle.mass, bottle.volume, bottle.room_temperature)
    if min(reserves(bottle, peak_flow, content)) <= 0.0:
        most = flow_limit(bottle, content)
        raise ParameterError(
            f"the largest flow is {shown_text(peak_flow, 'kg/s', '.3g')}, but the regulator of the full bottle "
            f"passes at most {shown_text(most, 'kg/s', '.3g')}; increase regulator.area"
        )
    line = isobar(bottle.fluid.table, bottle.regulator.set_pressure)
    supply = BottleSupply(bottle, line, bottle.mass, bottle.room_temperature, least_torque=1.0, coupling=RESTING)
    if unresolved := supply.unresolved(peak_flow, _FASTEST):
        raise ParameterError(f"{bottle.name}: {unresolved}")
    course = SupplyCourse(supply, [Meeting(0.0, supply.start(), supply.offers_first())])
    reason = _drain(course, mean_flow, peak_flow, schedule)
    last = course.met[-1]
    mass = last.state.mass
    needed = smallest_mass_when_warm(bottle, peak_flow)
    usable = max(0.0, mass - needed)
    remaining = f"{mass * GRAMS_PER_KILOGRAM:.3g} g are left"
    warm = f"{usable * GRAMS_PER_KILOGRAM:.3g} g of this would be usable at room temperature"
    seat_open = open_share(bottle.supply, last.state.ice)
    pressure_margin, flow_margin = reserves(bottle, peak_flow, last.offered.content, seat_open)
    # Both are fractions, so that the smaller one says what went short first.
    is_pressure = pressure_margin <= flow_margin
    short = "maintain the supply pressure" if is_pressure else "drive the largest flow through the regulator"
    why = f"its pressure is too low to {short}"
    if reason == "time":
        ending = TIME_IS_UP
        message = f"the supply pressure was maintained for the whole requested time; {remaining}"
    elif reason == "frozen":
        cold = "the liquid begins to freeze (dry ice)" if has_liquid(bottle.fluid.table) else "the gas is too cold"
        ending = "frozen"
        message = f"{cold}, and the property table ends here; {remaining}, {warm}"
    elif flow_margin < pressure_margin and seat_open < OPEN:
        ending = "iced"
        message = f"the regulator is iced: dry ice leaves {100.0 * seat_open:.0f} % of the seat open; {remaining}"
    # The gas of a warm bottle decides between the two: cold is mended by waiting, empty is not.
    elif usable > _NEXT_TO_NOTHING * bottle.mass:
        ending = "too cold"
        message = f"the bottle is too cold: {why}; {remaining}, {warm}"
    else:
        ending = "empty"
        message = f"the bottle is empty: {why}, even at room temperature; {remaining}"
    return Endurance(
        bottle=bottle,
        schedule=schedule,
        origin=origin,
        mass_per_stride=mass_per_stride,
        stride_time=stride_time,
        mean_flow=mean_flow,
        peak_flow=peak_flow,
        walking_time=course.walked,
        total_time=last.time,
        strides=course.walked / stride_time,
        strides_when_warm=(bottle.mass - needed) / mass_per_stride,
        ending=ending,
        message=message,
        mass_left=mass,
        usable_when_warm=usable,
        balance=course.balance,
        shown=units_beside("Pa_a", bottle.entries[SET_PRESSURE].unit),
        record=partial(getattr, course, "recording"),
    )


def _drain(course: SupplyCourse, mean_flow: float, peak_flow: float, schedule: Schedule) -> str:
    """Continue a course by walking and rest in turn until it ends; return why: "frozen", "short" or "time".

    While walking the mean flow [kg/s] is drawn. The end is found to ``_SHORTEST``.
    """
    bottle = course.supply.bottle
    freezing = bottle.fluid.table.temperatures[0] + ABOVE_FREEZING
    is_walking = True
    while course.met[-1].time < schedule.longest:
        interval = schedule.walk if is_walking else schedule.rest
        start = course.met[-1]
        # Without a rest there is one interval.
        end = min(start.time + interval, schedule.longest) if schedule.rest > 0.0 else schedule.longest
        # An interval may begin without a reserve.
        if is_walking and _reserve(course, start, peak_flow) <= 0.0:
            return "short"
        flow = mean_flow if is_walking else 0.0
        length = RESTING
        while (now := course.met[-1]).time < end:
            rest = end - now.time
            largest = _LARGEST_DRAW * now.state.mass / max(flow, LEAST_FLOW)
            length = min(length, rest, largest)
            time = end if length == rest else now.time + length
            later = met_again(course.supply, now, flow * length, length, time)
            is_frozen = later.offered.content.temperature <= freezing
            is_short = is_walking and _reserve(course, later, peak_flow) <= 0.0
            if (is_frozen or is_short) and length > _SHORTEST:
                length *= 0.5
                continue
            course.met.append(later)
            course.regulated += flow * length
            course.walked += length if is_walking else 0.0
            course.rested += 0.0 if is_walking else length
            if is_frozen or is_short:
                return "frozen" if is_frozen else "short"
        is_walking = not is_walking
    return "time"


def _reserve(course: SupplyCourse, meeting: Meeting, peak_flow: float) -> float:
    """Return the smaller margin of pressure and flow [-] at a meeting, with the ice in the seat."""
    bottle = course.supply.bottle
    return min(reserves(bottle, peak_flow, meeting.offered.content, open_share(bottle.supply, meeting.state.ice)))


def reserves(bottle: Bottle, peak_flow: float, content: BottleContent, seat_open: float = 1.0) -> tuple[float, float]:
    """Return the relative margins of pressure and flow [-] at the largest flow; below 0 the supply pressure is lost.

    The pressure margin is the excess over the regulator's need divided by the set pressure; the flow margin is the flow
    limit of the regulator divided by the largest flow, minus 1. Ice leaves a fraction ``seat_open`` of its seat open.
    """
    to_spare = pressure_reserve(bottle.regulator, content.pressure, peak_flow) / bottle.regulator.set_pressure
    return to_spare, seat_open * flow_limit(bottle, content) / peak_flow - 1.0


def flow_limit(bottle: Bottle, content: BottleContent) -> float:
    """Return the largest flow [kg/s] of the regulator for the content of the bottle."""
    ratio = bottle.heat_capacity_ratio
    gas_constant = bottle.fluid.table.gas_constant
    return regulator_flow_limit(bottle.regulator, content.pressure, content.temperature, ratio, gas_constant)


def smallest_mass_when_warm(bottle: Bottle, peak_flow: float, enough: float = math.inf) -> float:
    """Return the smallest mass of gas [kg] with which the bottle maintains the supply pressure at room temperature.

    ``enough`` is a pressure in the bottle [Pa absolute] that was seen to suffice.
    """
    table = bottle.fluid.table
    room = bottle.room_temperature
    low = 0.0
    high = min(bottle.mass, bottle.volume * densest_gas(table, room))
    # Halved until nothing is left to halve: the reserve grows with the mass, though not smoothly where liquid begins.
    for _ in range(60):
        middle = 0.5 * (low + high)
        content = bottle_content(table, middle, bottle.volume, room)
        if min(reserves(bottle, peak_flow, content)) < 0.0 and content.pressure < enough:
            low = middle
        else:
            high = middle
    return high


# Gas use of a walk and of a recording, and the report.


def gas_of_walk(walk: WalkResult | Path) -> tuple[Scenario, Recording, float]:
    """Return scenario, recording and gas per assisted stride [kg] of a walk or its folder; 0 if it took no gas."""
    if not isinstance(walk, Path):
        return walk.scenario, walk.recording, walk.metrics["gas"].value if "gas" in walk.metrics else 0.0
    file = walk / WALK_FILE
    document = read_json(file)
    if not isinstance(document, dict) or document.get("format") != WALK_FORMAT:
        raise DataError(f"{file}: format: must be '{WALK_FORMAT}', as written by 'ppafo walk'")
    if table_at(file, document, "status").get("kind") == "diverged":
        raise DataError(f"{file}: the walk diverged, so its gas use cannot be repeated; give one that ran to its end")
    configuration = table_at(file, document, "configuration")
    gas = table_at(file, document, "metrics", "gas")
    amount = gas.get("value", 0.0)
    content = configuration.get("content")
    overrides = configuration.get("overrides")
    source = configuration.get("file")
    is_stated = isinstance(source, str | None) and isinstance(amount, int | float) and abs(amount) < _MOST_GAS
    if not (is_stated and isinstance(content, dict) and isinstance(overrides, list)):
        raise DataError(f"{file}: does not state the walk and its gas; repeat it with 'ppafo walk'")
    with refused_as(DataError, f"{file}: the walk cannot be repeated", PpafoError):
        scenario = scenario_of(request_again(Origin(source, "", "", tuple(map(str, overrides)), content)), WALKING)
    return scenario, read_recording(walk), float(amount)


def on_walk(
    walk: WalkResult | Path, bottle: str | Path | None, schedule: Schedule, overrides: Sequence[str]
) -> Endurance:
    """Return the duration of a bottle for a walk, or its folder, that continues.

    Raises DataError if the walk took no gas, ScenarioError if it cannot be combined with the bottle.
    """
    scenario, recording, gas = gas_of_walk(walk)
    if gas <= 0.0:
        raise DataError(f"walk '{scenario.name}': takes no gas, so no bottle would become empty; give one with help")
    if bottle is None and walk_of(scenario).bottle is None:
        bottle = PAPER_BOTTLE
    walking = on_bottle(scenario, bottle, overrides)
    supply = walk_of(walking).bottle
    assert supply is not None, "a walk on a bottle"
    # Recorded once a minute, for up to the longest duration: whole minutes, as many as the steps of one run allow.
    stride = walk_of(walking).gait.stride_time
    minute = replace(walking, run=replace(walking.run, duration=60.0, output_interval=60.0))
    seconds_of_run = 60.0 * (MAXIMUM_STEPS * plan_run(minute).step // 60.0)
    seconds = min(math.ceil(schedule.longest / stride) * stride, seconds_of_run)
    repeated = replace(minute, run=replace(minute.run, duration=60.0 * max(1, round(seconds / 60.0))))
    _, course = walk_on_bottle(plan_run(repeated), fed_device(repeated), supply, stride, silent, schedule)
    end = course.ending
    walked = course.walked / stride
    # A bottle may end before the first stride does.
    strides = max(walked, 1.0e-9)
    stride_time = course.walked / strides
    mass = course.regulated / strides
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
        walking_time=course.walked,
        total_time=course.walked + course.rested,
        strides=walked,
        strides_when_warm=(supply.mass - smallest_mass_when_warm(supply.bottle, peak, lowest)) / mass,
        ending=TIME_IS_UP if end.kind == WALKED else end.kind,
        message=end.message,
        mass_left=course.met[-1].state.mass,
        usable_when_warm=max(0.0, course.met[-1].state.mass - smallest_mass_when_warm(supply.bottle, peak)),
        balance=course.balance,
        shown=scenario.device.shown,
        # Read where it is wanted; a function of its own could not be pickled.
        record=partial(getattr, course, "recording"),
    )


def of_recording(
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
    full = load_bottle(bottle, overrides)
    units = {}
    recording = use if isinstance(use, Recording) else read_recording(Path(use))
    run = Path() if isinstance(use, Recording) else Path(use) / RUN_FILE
    if run.is_file():
        document = read_json(run)
        units = dict(stated_units(run, document))
        gas, supply = (table_at(run, document, "scenario", "device", name) for name in ("gas", "supply"))
        molar_mass = gas.get("molar_mass")
        pressure = supply.get("pressure")
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
        name = argument_text("stride_time")
        most = f"{recording.duration:g} s, the length of the recording"
        raise DataError(f"{where}: {name} = {stride:g} s: must be above 0 s and at most {most}")
    mean = gain / recording.duration
    return mean * stride, stride, max(mean, largest_flow(recording))


def _gas_use(recording: Recording) -> Floats:
    """Return the gas [kg] drawn from the bottle: at the regulator of a simulated supply line, else at the valve."""
    return recording["regulated_mass" if "regulated_mass" in recording else "supplied_mass"]


def largest_flow(recording: Recording) -> float:
    """Return the largest flow [kg/s], as moving average over the window, or over a shorter recording."""
    window = min(PEAK_WINDOW, recording.duration)
    starts = recording.time[recording.time <= recording.time[-1] - window]
    # The last window need not begin at a sample.
    starts = np.append(starts, recording.time[-1] - window)
    begins, ends = (np.interp(times, recording.time, _gas_use(recording)) for times in (starts, starts + window))
    return float(np.max(ends - begins) / window)


@in_units(lambda results: next(iter(results.values())).shown)
def finding_of(results: dict[str, Endurance]) -> Finding[Any]:
    """Return the report of a bottle for one gas use, with facts, figure and values, or the table of several."""
    first = next(iter(results.values()))
    several = len(results) > 1
    gas = Kind(quantity="gas mass", form=".3g")
    full = first.bottle
    counted = first.counted
    if several:
        are_strides = all(use.counted == "stride" for use in results.values())
        counted, time = ("stride", "walking") if are_strides else ("repetition", "run time")
        longest = duration_kind(max(use.walking_time for use in results.values()))
        titles = ("gas use", (f"gas per {counted}", gas), (time, longest), f"{counted}s", "ended")
        cells = [
            (name, use.mass_per_stride, use.walking_time, strides_text(use.strides), use.ending)
            for name, use in results.items()
        ]
        parts = [Section(columns=columns_of(titles, cells))]
    else:
        flow, pressure = (Kind(quantity=name, form=".3g").text for name in ("mass flow", "pressure"))
        # Heat that warms the gas of the full bottle to the room's temperature behind the regulator.
        content = bottle_content(full.fluid.table, full.mass, full.volume, full.room_temperature)
        heat = heat_to_warm(full.fluid.table, content, full.room_temperature, full.regulator.set_pressure)
        of_device = ", the supply pressure of the device" if full.entries[SET_PRESSURE].origin == "derived" else ""
        walked = f"{duration_text(first.walking_time)} of {'use' if counted == 'repetition' else 'walking'}"
        flows = f"{flow(first.mean_flow)}, largest {flow(first.peak_flow)}"
        when_warm = f"{strides_text(first.strides_when_warm)} (a bottle that stays at room temperature)"
        recording = first.recording
        coldest = Kind(quantity="temperature", form=".1f").text(float(np.min(recording["bottle_temperature"])))
        rows = [
            ("run time", f"{walked}, {duration_text(first.total_time)} in total"),
            ("strides" if counted == "stride" else "repetitions of the recording", strides_text(first.strides)),
            (f"{counted}s without cooling", when_warm),
            ("regulator set to", pressure(full.regulator.set_pressure) + of_device),
            ("ended", first.message),
            ("gas", f"{gas.text(first.mass_per_stride)} a {counted}, {flows}"),
            ("heat that it lacks", f"{heat * first.mean_flow:.3g} W, {heat / 1000.0:.3g} kJ/kg, at the start"),
            ("lowest temperature of the fluid", coldest),
            ("pressure at the end", pressure(float(recording["bottle_pressure"][-1]))),
        ]
        if "liquid_mass" in recording:
            dry = np.flatnonzero(recording["liquid_mass"] <= 0.0)
            remaining = f"no, {gas.text(float(recording['liquid_mass'][-1]))} left"
            used_up = f"after {duration_text(float(recording.time[dry[0]]))}" if dry.size else remaining
            rows.append(("liquid used up", used_up))
        values = [
            (path, format_quantity(entry.value, entry.unit), entry.origin, entry.source)
            for path, entry in full.entries.items()
        ]
        parts = [
            Section(columns=facts(rows)),
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


def _panels(endurance: Endurance) -> list[Panel]:
    """Return the panels of temperature, pressure and gas of the bottle over time."""
    recording = endurance.recording
    regulator = endurance.bottle.regulator
    time = recording.time
    needed = regulator.set_pressure + regulator.pressure_margin
    dotted, dashed = ({"linestyle": style, "linewidth": 1.2} for style in (":", "--"))
    warmth = Kind("Temperature of the bottle", "K", "temperature")
    pressure = Kind("Pressure in the bottle", "Pa_a", "pressure")
    mass = Kind("Left in the bottle", "kg", "gas mass")
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
