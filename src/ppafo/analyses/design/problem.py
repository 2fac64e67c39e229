"""Design file: a torque profile as a table for a run, and the requirements on a device in SI units."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from fractions import Fraction
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Annotated

import numpy as np

from ppafo.arguments import checked
from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.control.catalog import CONTROLLERS
from ppafo.control.profiles import KNOTS
from ppafo.documents.toml_text import TomlFile, TomlKind, beside
from ppafo.errors import (
    DataError,
    Faults,
    ParameterError,
    PpafoError,
    StudyError,
    UnitError,
    at_fault,
    refused_as,
)
from ppafo.gait import load_gait
from ppafo.gait.gait import BODY_MASSES
from ppafo.loading import reloaded
from ppafo.model.declaration import Number
from ppafo.model.plant import actuator_torque
from ppafo.parameters.bottles.bottle import Bottle, load_bottle
from ppafo.parameters.declared import SHORT_NAME, Many, Words
from ppafo.parameters.records import SchemaVersion, checked_record, keyed, record_schema
from ppafo.plugins import Plugins
from ppafo.signals.recording import Floats
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Scenario
from ppafo.storage.reading import read_recording
from ppafo.units import parse_quantity, split_quantity
from ppafo.walking.bottle.supply import is_of_bottle

FILE = TomlKind("design", "design", resources.files("ppafo.analyses.design") / "library", StudyError)
FROM_GAIT = "gait:falisse2019-subject1,mass=72.6 kg,share=0.05"
"""Example of a profile that is a share of the ankle moment of a wearer with a gait."""
_GAIT = "gait:"
_STRIDE_SAMPLES = 201
_FOR_A_CYLINDER = "; search supply.pressure by 'ppafo find' with controller.kind=damped_proportional"
_TORQUE = "N m"
_ROUNDING = 1.0e-9
"""Fraction of the range of a profile below which a difference counts as rounding."""
_MOMENT = 1.0e-5
"""Duration [s] of the torque step between two repetitions if the end differs from the start."""
_SECONDS_PER_HOUR = 3600.0
_LARGEST_DENOMINATOR = 10**6


@dataclass(frozen=True, slots=True)
class GaitShare:
    """Share of the ankle moment of a wearer with a gait, as given behind the name of the gait."""

    mass: float = keyed(Number("kg", "body mass of the wearer", None, *BODY_MASSES))
    share: float = keyed(Number("", "share of the ankle moment", None, 0.0, 1.0, minimum_allowed=False))


@dataclass(frozen=True, slots=True)
class ProfileSection:
    """Section of a sizing file: torque over one repetition, from a recording or as times and torques."""

    recording: str | None = keyed(
        f"a .csv or .nc file or a result folder, relative to this file; or '{FROM_GAIT}'", None
    )
    channel: str = keyed("channel of the recording, in N m", "torque")
    time: tuple[Annotated[float, Number("s", "time")], ...] = keyed(
        "times with unit, from 0 on; the profile repeats after the last", ()
    )
    torque: tuple[Annotated[float, Number(_TORQUE, "torque")], ...] = keyed("torques with unit, one for each time", ())
    scale: float = keyed("factor on every torque: the fraction that the orthosis provides", 1.0)


@dataclass(frozen=True, slots=True)
class UseTable:
    """Section of a sizing file: use on one bottle, as repetitions or hours, with a reserve."""

    repetitions: int | None = keyed(
        Number("", "number of repetitions of the profile, such as steps", minimum=1, whole=True), None
    )
    hours: float | None = keyed(
        Number("", "hours of continuous use, instead of repetitions", minimum=0.0, minimum_allowed=False, plain=True),
        None,
    )
    reserve: float = keyed(
        Number("", "gas to be left in the bottle, as a fraction of the gas used", None, 0.0, 10.0, plain=True), 0.1
    )


@dataclass(frozen=True, slots=True)
class LimitsTable:
    """Section of a sizing file: limit of the RMS torque error."""

    rms_error: str = keyed("largest RMS torque error: '0.5 N m', or '5 %' of the largest torque")


@dataclass(frozen=True, slots=True)
class PressureTable:
    """Section of a sizing file: range of supply pressures; both regulators have the same pressure."""

    lowest: str = keyed("lowest supply pressure", "10 psi_g")
    highest: str = keyed("highest supply pressure", "120 psi_g")


_FACTORS = Many(
    Number("", "", None, 0.0, 1000.0, plain=True),
    "factors by which each gain of the controller is multiplied",
    least=1,
    most=12,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SizingFile:
    """Sizing file: design of a device that follows a torque profile."""

    schema_version: SchemaVersion
    name: str = keyed(Words(pattern=SHORT_NAME))
    description: str = ""
    scenario: str = keyed("device, motion, controller and sensors: a name, or a path")
    overrides: tuple[str, ...] = keyed("changes to the scenario", ())
    bottles: tuple[str, ...] = keyed("bottles to choose from: names, or paths relative to this file")
    profile: ProfileSection
    use: UseTable
    limits: LimitsTable
    valves: dict[str, dict[str, str]] = keyed(
        "valves to choose from: by name, the values that the scenario's valve lacks"
    )
    pressure: PressureTable = PressureTable()
    gain_factors: tuple[float, ...] = keyed(_FACTORS, (0.0, 0.5, 1.0, 3.0, 8.0))
    simulated: int = keyed(
        Number("", "repetitions to simulate; the first fills the lines", None, 1, 1000, whole=True), 3
    )


@dataclass(frozen=True, slots=True, eq=False)
class RequiredTorque:
    """Torque profile of one repetition: samples as given, and the table of knots that a run follows.

    ``time``, ``torque``: samples as given, times [s] from 0 and torques [N m]
    ``kind``: origin of the samples: ``measured``, ``simulated``, ``synthetic``, ``typed`` or ``gait``
    ``knot_times``, ``knot_values``: knots [s], [N m] of the table that a run follows
    """

    time: Floats
    torque: Floats
    kind: str
    knot_times: Floats
    knot_values: Floats

    @property
    def period(self) -> float:
        """Duration of a repetition of the profile [s]."""
        return float(self.time[-1])

    @property
    def table_error(self) -> float:
        """Largest difference between the table of knots and the given samples [N m]."""
        return float(np.max(np.abs(self.at(self.time[:-1]) - self.torque[:-1])))

    @property
    def largest(self) -> float:
        """Largest absolute torque of the table of knots [N m]."""
        return float(np.max(np.abs(self.knot_values)))

    def at(self, time: Floats) -> Floats:
        """Return the torque of the repeated table of knots [N m] at times [s] from 0 on."""
        return np.asarray(np.interp(time, self.knot_times, self.knot_values, period=self.period))


@dataclass(frozen=True, slots=True)
class SizingProblem:
    """Sizing problem in SI units: torque profile, scenario, valves and bottles to choose from, and limits.

    ``scenario``: scenario that follows the profile for ``simulated`` repetitions
    ``repetitions``: number of repetitions that one bottle must supply
    ``reserve``: fraction of the gas to be left in the bottle [-]
    ``largest_error``: limit of the RMS error [N m]
    ``valves``: numbers of each valve to choose from, by path [SI], such as ``valve.area``
    ``lowest_pressure``, ``highest_pressure``: range of the supply pressure [Pa absolute]
    ``gains``: paths of the controller's gains
    ``gain_factors``: factors on the gains; every combination is tried
    """

    name: str
    description: str
    file: str
    scenario: Scenario
    profile: RequiredTorque
    simulated: int
    repetitions: float
    reserve: float
    largest_error: float
    valves: Mapping[str, Mapping[str, float]]
    bottles: tuple[Bottle, ...]
    lowest_pressure: float
    highest_pressure: float
    gains: tuple[str, ...]
    gain_factors: tuple[float, ...]

    @property
    def atmosphere(self) -> float:
        """Atmospheric pressure [Pa absolute]."""
        return self.scenario.device.supply.atmospheric_pressure

    @property
    def hours(self) -> float:
        """Duration of all repetitions of the profile without a pause [h]."""
        return self.repetitions * self.profile.period / _SECONDS_PER_HOUR

    def ceiling(self, pressure: float) -> float:
        """Return the largest static torque [N m] at a supply pressure [Pa absolute]; equation (2) of the paper."""
        return actuator_torque(pressure, self.atmosphere, self.scenario.device.actuator.torque_constant)


@checked
def load_design(problem: str | Path, *, profile: str | Path | None = None, plugins: Plugins = ()) -> SizingProblem:
    """Load the sizing problem of a design file with a torque profile, by its name in the package or by its path.

    ``profile`` replaces the profile of the file: a recording, or a share of a wearer's ankle moment such as
    ``gait:falisse2019-subject1,mass=72.6 kg,share=0.05``. Paths in a design file are relative to its folder.
    ``plugins`` are modules of your own whose objects files may name, as in ``simulate``.

    Raises StudyError or ParameterError, in one line, for an invalid file.

    >>> import ppafo
    >>> ppafo.load_design("push-off").name
    'push-off'
    """
    with at_fault("problem"):
        source = FILE.load(problem)
    file = source.label
    folder = source.folder
    document = checked_record(SizingFile, source)
    wrong = Faults()
    valves = {}
    bottles = []
    atmosphere = STANDARD_ATMOSPHERE
    largest = 1.0
    pressures = []
    with wrong:
        if profile:
            with at_fault("profile"):
                required = read_profile(ProfileSection(recording=str(profile)), Path(), f"{file}: profile")
        else:
            required = read_profile(document.profile, folder, f"{file}: profile")
        largest = required.largest
    with wrong:
        plain = load_scenario(beside(document.scenario, folder), document.overrides)
        atmosphere = plain.device.supply.atmospheric_pressure
        plain.device.check_torque_constant("the size of a device", _FOR_A_CYLINDER)
        if plain.controller.is_open_loop:
            raise StudyError(
                f"{file}: scenario '{plain.name}' has no reference (controller.kind = "
                f"'{plain.controller.kind}'); choose a scenario with a reference"
            )
        for name, values in document.valves.items():
            with wrong, refused_as(StudyError, f"{file}: valves.{name}", PpafoError):
                valve = reloaded(plain, [f"valve.{key}={value}" for key, value in values.items()]).device.valve
                numbers = {**asdict(valve.orifice), **valve.settings}
                valves[name] = {f"valve.{key}": value for key, value in numbers.items()}
        for name in dict.fromkeys(document.bottles):
            with wrong, refused_as(StudyError, f"{file}: bottles", ParameterError):
                bottle = load_bottle(beside(name, folder))
                if not is_of_bottle(plain.device.gas.molar_mass, bottle):
                    gas = f"contains {bottle.fluid.name}, but the device uses {plain.device.gas.species}"
                    raise ParameterError(f"'{name}' {gas}: choose another, or set gas.species in overrides")
                bottles.append(bottle)
    with wrong:
        for key, text in asdict(document.pressure).items():
            with refused_as(StudyError, f"{file}: pressure.{key} = '{text}'", UnitError):
                pressures.append(parse_quantity(text, "Pa_a", atmosphere))
        if not atmosphere < pressures[0] < pressures[1]:
            raise StudyError(
                f"{file}: pressure.lowest = '{document.pressure.lowest}': must be above atmospheric pressure and below "
                f"pressure.highest = '{document.pressure.highest}'"
            )
    use = document.use
    limit = document.limits.rms_error
    if (use.repetitions is None) == (use.hours is None):
        wrong.append(StudyError(f"{file}: [use]: give either repetitions or hours"))
    with wrong, refused_as(StudyError, f"{file}: limits.rms_error = '{limit}'", UnitError):
        relative = split_quantity(limit)[1] in ("%", "percent")
        largest_error = parse_quantity(limit, "") * largest if relative else parse_quantity(limit, _TORQUE)
        if largest_error <= 0.0:
            raise UnitError("must be above 0; write '0.5 N m' or '5 %'")
    wrong.raise_all()
    # A multiple of both intervals: the run then ends with a sample of the controller and of the output.
    a, b, duration = (
        Fraction(interval).limit_denominator(_LARGEST_DENOMINATOR)
        for interval in (plain.controller.period, plain.run.output_interval, document.simulated * required.period)
    )
    grain = Fraction(math.lcm(a.numerator * b.denominator, b.numerator * a.denominator), a.denominator * b.denominator)
    numbers = {"level": f"0 {_TORQUE}", "period": f"{required.period!r} s"}
    numbers |= {f"time_{row:02d}": f"{time!r} s" for row, time in enumerate(required.knot_times[1:].tolist(), 2)}
    numbers |= {f"value_{row:02d}": f"{each!r} {_TORQUE}" for row, each in enumerate(required.knot_values.tolist(), 1)}
    overrides = ["reference.kind=tabulated", *(f"reference.{name}={text}" for name, text in numbers.items())]
    scenario = reloaded(plain, [*overrides, f"run.duration={float(math.ceil(duration / grain) * grain)!r} s"])
    # The settings that multiply a torque error.
    quantities = CONTROLLERS[scenario.controller.kind].quantities
    gains = tuple(f"controller.{quantity.name}" for quantity in quantities if "(N m" in quantity.unit)
    return SizingProblem(
        name=document.name,
        # The file describes its own profile.
        description="" if profile else document.description,
        file=file,
        scenario=scenario,
        profile=required,
        simulated=document.simulated,
        repetitions=float(use.repetitions or _SECONDS_PER_HOUR * float(use.hours or 0.0) / required.period),
        reserve=use.reserve,
        largest_error=largest_error,
        valves=valves,
        bottles=tuple(sorted(bottles, key=lambda bottle: bottle.mass)),
        lowest_pressure=pressures[0],
        highest_pressure=pressures[1],
        gains=gains,
        gain_factors=tuple(sorted(set(map(float, document.gain_factors)))) if gains else (1.0,),
    )


def read_profile(table: ProfileSection, folder: Path, where: str) -> RequiredTorque:
    """Read a torque profile; recordings and gaits are relative to ``folder``, messages begin with ``where``."""
    source = table.recording
    if bool(table.time or table.torque) == (source is not None):
        raise StudyError(f"{where}: give either a recording, or both time and torque")
    if source is None:
        time = np.array(table.time)
        torque = np.array(table.torque)
        kind = "typed"
        if time.size != torque.size or time.size < 2:
            counts = f"time has {time.size} entries and torque has {torque.size}"
            raise StudyError(f"{where}: {counts}; both need the same number of entries, at least two")
        if time[0] != 0.0 or np.any(np.diff(time) <= 0.0):
            raise StudyError(f"{where}.time: must start at '0 s' and increase strictly")
    elif source.startswith(_GAIT):
        place = f"{where}: '{source}'"
        name, *settings = source.removeprefix(_GAIT).split(",")
        given = {key.strip(): value.strip() for key, _, value in (setting.partition("=") for setting in settings)}
        if len(given) < len(settings):
            raise StudyError(f"{place}: give mass and share once")
        wearer = checked_record(GaitShare, TomlFile(place, given, StudyError))
        with refused_as(StudyError, place, DataError):
            gait = load_gait(beside(name.strip(), folder))
            if gait.ankle_moment is None:
                raise DataError("this gait has no ankle_moment")
        phases = np.linspace(0.0, 1.0, _STRIDE_SAMPLES)
        kind = "gait"
        time = gait.stride_time * phases
        torque = wearer.share * wearer.mass * gait.ankle_moment.values_at(phases)
    else:
        with refused_as(StudyError, f"{where}.recording", DataError):
            recording = read_recording(folder / source)
            time = recording.time - recording.time[0]
            torque = recording[table.channel]
            kind = recording.kind
            if (unit := recording.unit(table.channel)) != _TORQUE:
                raise DataError(f"channel '{table.channel}' has the unit '{unit}'; choose one in {_TORQUE}")
            if len(recording) < 2:
                raise DataError("has only one sample; a torque profile needs two or more")
    torque = table.scale * torque
    if not np.any(torque):
        raise StudyError(f"{where}: the torque is 0 {_TORQUE} throughout; give a profile with a torque other than 0")
    # The last sample is the first of the next repetition. Where the two differ it stays, a moment earlier: the table
    # then jumps as the profile does.
    last = time[-1] - min(_MOMENT, 0.5 * (time[-1] - time[-2]))
    is_open = torque[-1] != torque[0]
    samples = (np.append(time[:-1], last), torque) if is_open else (time[:-1], torque[:-1])
    return RequiredTorque(time, torque, kind, *choose_knots(*samples))


def choose_knots(time: Floats, torque: Floats) -> tuple[Floats, Floats]:
    """Return at most 32 samples, starting with the first, whose linear interpolation approximates all samples.

    The sample with the largest error is added next. No knots are added between the last sample and the next repetition.
    """
    chosen = [0, time.size - 1]
    # Greedy, not best: a profile has few features, and each knot takes away what is worst.
    while len(chosen) < min(KNOTS, time.size):
        between = np.interp(time, time[chosen], torque[chosen])
        worst = int(np.argmax(np.abs(between - torque)))
        if abs(between[worst] - torque[worst]) <= _ROUNDING * np.ptp(torque):
            break
        chosen = sorted([*chosen, worst])
    return time[chosen], torque[chosen]


json_schema = partial(record_schema, SizingFile, "ppafo design")
"""JSON Schema of a design file."""
