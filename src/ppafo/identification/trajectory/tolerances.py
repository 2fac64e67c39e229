"""The table [bench] of a problem file: what a bench does not know exactly, and what it can do.

A tolerance is a limit, as data sheets state it. It makes a number of the fit that nobody asks for: a supply, a load or
a start of one recording, a zero or a gain of a sensor. Of these only the limits are known, so each has a prior of
limit / sqrt(3), the standard deviation of an even distribution between the limits (GUM, JCGM 100:2008, 4.3.7).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.models import StrictTable, Text
from ppafo.errors import IdentificationError, UnitError, refused_as
from ppafo.identification.trajectory.problem import (
    FITTED_CHANNELS,
    GAIN_OF,
    ZERO_OF,
    Experiment,
    FreeParameter,
    Prior,
    full_path,
    number_at,
    scenario_of,
)
from ppafo.simulation.recorded import ANGLE, DORSIFLEXION_SUPPLY, EXTERNAL_TORQUE, SUPPLY
from ppafo.simulation.scenario import FreeMotion
from ppafo.units import parse_quantity

_WIDEST = 12.0
"""Standard deviations of its prior that a tolerance may be off at most in the search."""

Sensed = Literal["zero", "gain"]


class AbilitySection(StrictTable):
    """What the bench can do in its next experiment: the lowest and the highest of each."""

    supply_pressure: Annotated[
        tuple[Text, Text], Field(strict=False, description="of each of the two regulators, ['20 psi_g', '90 psi_g']")
    ]
    load: Annotated[
        tuple[Text, Text],
        Field(strict=False, description="constant torque on the vane, above 0 against plantarflexion"),
    ] = ("0 N m", "0 N m")
    command: Annotated[
        tuple[float, float], Field(strict=False, description="of the valve, from -1 to 1; both signs where it can")
    ] = (-1.0, 1.0)
    torque: Annotated[
        tuple[Text, Text] | None,
        Field(strict=False, description="amplitude of a sine that a torque controller follows; default: it has none"),
    ] = None
    frequency: Annotated[tuple[Text, Text], Field(strict=False, description="of that sine")] = ("0.5 Hz", "5 Hz")
    angle: Annotated[
        tuple[Text, Text] | None, Field(strict=False, description="where the vane starts; default: at a stop")
    ] = None
    duration: Annotated[tuple[Text, Text], Field(strict=False, description="length of a recording")] = (
        "0.3 s",
        "1 s",
    )
    sample_rate: Annotated[Text, Field(description="samples per second of all channels")] = "1 kHz"
    candidates: Annotated[int, Field(ge=4, le=2000, description="experiments that are drawn to choose from")] = 80
    seed: Annotated[int, Field(ge=0, description="random seed of the draws")] = 1


class BenchSection(StrictTable):
    """What the bench does not know exactly: limits on either side; and what it can do."""

    load: Annotated[Text | None, Field(description="of the external torque, of each recording: '2 %'")] = None
    supply: Annotated[Text | None, Field(description="of each supply pressure, of each recording: '1 psi_d'")] = None
    zero_of_angle: Annotated[Text | None, Field(description="of the zero of the angle sensor: '0.3 deg'")] = None
    zero_of_pressure: Annotated[Text | None, Field(description="of each pressure sensor: '0.15 psi_d'")] = None
    gain: Annotated[Text | None, Field(description="of the gain of each sensor: '0.3 %'")] = None
    start_of_angle: Annotated[Text | None, Field(description="of the angle at the start of each recording")] = None
    start_of_pressure: Annotated[Text | None, Field(description="of both pressures at the start of each")] = None
    each_recording: Annotated[
        tuple[Sensed, ...],
        Field(strict=False, description="'zero', 'gain': anew in each recording; default: the same in all of them"),
    ] = ()
    gas_temperature: Annotated[Text | None, Field(description="of a gas temperature that is not stated: '15 K'")] = None
    gas_law: Annotated[Text | None, Field(description="departure of the gas from the ideal gas law: '1 %'")] = None
    zero_of_flow: Annotated[Text | None, Field(description="zero of the flow meter, of its largest reading")] = None
    held: Annotated[Text | None, Field(description="of a number that states no uncertainty of its own: '2 %'")] = None
    can: Annotated[AbilitySection | None, Field(description="what the bench can do, for the next experiment")] = None


@dataclass(frozen=True, slots=True)
class Ability:
    """What a bench can do, lowest and highest of each, in SI units.

    ``angle`` None starts at a stop, ``torque`` None has no torque controller. ``interval`` [s] is the time between
    two samples.
    """

    supply_pressure: tuple[float, float]
    load: tuple[float, float]
    command: tuple[float, float]
    torque: tuple[float, float] | None
    frequency: tuple[float, float]
    angle: tuple[float, float] | None
    duration: tuple[float, float]
    interval: float
    candidates: int = 80
    seed: int = 1


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Limits on either side of what a bench does not know exactly, in SI units; 0 is known. ``load`` is a fraction.

    ``zeros`` are those of a sensor by channel. Those ``each_recording`` names are others in each recording.
    """

    load: float = 0.0
    supply: float = 0.0
    zero_of_angle: float = 0.0
    zero_of_pressure: float = 0.0
    gain: float = 0.0
    start_of_angle: float = 0.0
    start_of_pressure: float = 0.0
    each_recording: tuple[Sensed, ...] = ()

    def zero_of(self, channel: str) -> float:
        """Return the limit of the zero of a channel [rad], [Pa]."""
        return self.zero_of_angle if channel == ANGLE else self.zero_of_pressure


_UNITS = {
    "load": "1",
    "supply": "Pa_d",
    "zero_of_angle": "rad",
    "zero_of_pressure": "Pa_d",
    "gain": "1",
    "start_of_angle": "rad",
    "start_of_pressure": "Pa_d",
}
_LARGEST_FRACTION = 0.5


def tolerances_of(section: BenchSection, file: str) -> Tolerances:
    """Return the tolerances of a table [SI]; IdentificationError for one that is not above 0, or a fraction of 1."""
    limits = {}
    for name, unit in _UNITS.items():
        text = getattr(section, name)
        if text is None:
            continue
        said = f"{file}: bench: {name}"
        limit = limits[name] = _quantity(said, text, unit)
        if not 0.0 < limit < math.inf or (unit == "1" and limit > _LARGEST_FRACTION):
            most = f" and at most {_LARGEST_FRACTION:.0%}" if unit == "1" else ""
            raise IdentificationError(
                f"{said} = '{text}': must be above 0{most}; leave it out where the bench knows it exactly"
            )
    return Tolerances(**limits, each_recording=section.each_recording)


def ability_of(section: AbilitySection, atmosphere: float, file: str) -> Ability:
    """Return what a bench can do [SI]; IdentificationError where the lowest is above the highest."""
    said = f"{file}: bench.can"

    def ends(name: str, unit: str) -> tuple[float, float]:
        low, high = (_quantity(f"{said}: {name}", text, unit, atmosphere) for text in getattr(section, name))
        return _in_order(f"{said}: {name}", low, high)

    rate = _quantity(f"{said}: sample_rate", section.sample_rate, "Hz")
    command = _in_order(f"{said}: command", *section.command)
    frequency, duration = ends("frequency", "Hz"), ends("duration", "s")
    for name, is_possible, rule in (
        ("sample_rate", 10.0 <= rate <= 1.0e5, "10 Hz to 100 kHz"),
        ("command", command[0] >= -1.0 and command[1] <= 1.0, "-1 to 1"),
        ("frequency", frequency[0] > 0.0 and frequency[1] <= 100.0, "above 0 Hz and at most 100 Hz"),
        ("duration", duration[0] > 0.0 and duration[1] <= 100.0, "above 0 s and at most 100 s"),
    ):
        if not is_possible:
            raise IdentificationError(f"{said}: {name} = {getattr(section, name)!r}: must be {rule}")
    return Ability(
        supply_pressure=ends("supply_pressure", "Pa_a"),
        load=ends("load", "N m"),
        command=command,
        torque=None if section.torque is None else ends("torque", "N m"),
        frequency=frequency,
        angle=None if section.angle is None else ends("angle", "rad"),
        duration=duration,
        interval=1.0 / rate,
        candidates=section.candidates,
        seed=section.seed,
    )


def _in_order(said: str, low: float, high: float) -> tuple[float, float]:
    if not low <= high:
        raise IdentificationError(f"{said}: the first must not be above the second")
    return low, high


def _quantity(said: str, text: str, unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
    with refused_as(IdentificationError, f"{said} = '{text}'", UnitError):
        return parse_quantity(text, unit, atmosphere)


def tolerance_parameters(
    tolerances: Tolerances, experiments: Sequence[Experiment], fitted: Sequence[FreeParameter]
) -> tuple[FreeParameter, ...]:
    """Return what the tolerances add to a fit. What is ``fitted`` anyway, or followed by a run, is left as it is."""
    found = []
    for experiment in experiments:
        free = {
            full_path(item.path, experiment.scenario)
            for item in fitted
            if not item.recordings or experiment.label in item.recordings
        }
        for path, limit in _of_run(tolerances, experiment).items():
            if path not in free:
                mean = number_at(scenario_of(experiment), path)
                found.append(_parameter(path, mean, limit, (experiment.label,)))
    for channel in FITTED_CHANNELS:
        labels = tuple(item.label for item in experiments if channel in item.channels)
        for kind, prefix, limit in (("zero", ZERO_OF, tolerances.zero_of(channel)), ("gain", GAIN_OF, tolerances.gain)):
            if limit > 0.0 and labels:
                groups = [(label,) for label in labels] if kind in tolerances.each_recording else [()]
                found += [_parameter(f"{prefix}{channel}", 0.0, limit, group) for group in groups]
    return tuple(found)


def _of_run(tolerances: Tolerances, experiment: Experiment) -> dict[str, float]:
    """Return the limits of what one run is done with, by path [SI]."""
    scenario, inputs = experiment.scenario, experiment.inputs
    free = scenario.motion if isinstance(scenario.motion, FreeMotion) and scenario.motion.leg is None else None
    limits = {}
    if free is not None and EXTERNAL_TORQUE not in inputs:
        limits["motion.external_torque"] = tolerances.load * abs(free.external_torque)
    if SUPPLY not in inputs:
        # Two regulators are set one by one, to one pressure too.
        limits["supply.pressure"] = tolerances.supply
        if DORSIFLEXION_SUPPLY not in inputs:
            limits["supply.dorsiflexion_pressure"] = tolerances.supply
    stops = scenario.device.actuator.angle_min, scenario.device.actuator.angle_max
    # Where the vane lies at a stop, the stop says where it starts.
    if free is not None and ANGLE not in inputs and not any(math.isclose(free.angle, stop) for stop in stops):
        limits["motion.angle"] = tolerances.start_of_angle
    limits |= dict.fromkeys(("initial.pressure_1", "initial.pressure_2"), tolerances.start_of_pressure)
    return {path: limit for path, limit in limits.items() if limit > 0.0}


def _parameter(path: str, mean: float, limit: float, recordings: tuple[str, ...]) -> FreeParameter:
    deviation = limit / math.sqrt(3.0)
    low, high = (mean - _WIDEST * deviation, mean + _WIDEST * deviation)
    return FreeParameter(
        path=path,
        low=low,
        high=high,
        scale="linear",
        prior=Prior(mean, deviation),
        recordings=recordings,
        is_tolerance=True,
    )
