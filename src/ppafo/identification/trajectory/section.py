"""The section [trajectory] of a problem file: its layout, the problem that it makes, and the outcome of that.

Texts have units, scenarios and recordings go by name; the problem is in SI units. Everything that can be refused is
refused before the search begins.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from ppafo.documents.models import NAME, StrictTable, Text, Texts
from ppafo.errors import DataError, IdentificationError, ScenarioError, nearest_name
from ppafo.identification.estimate import Estimate, interval_factor
from ppafo.identification.keys import Columns, Confidence, positive_in, quantity_in
from ppafo.identification.source import Source, Use, double_use, told_of_readings
from ppafo.identification.tolerances import Tolerances, deviation_of_limit, quantity_of
from ppafo.identification.trajectory.expected import Candidate, Expected, expected_information
from ppafo.identification.trajectory.experiment import (
    ALL_INPUTS,
    FITTED_CHANNELS,
    INPUTS,
    Experiment,
    refuse_first,
    use_of,
)
from ppafo.identification.trajectory.fitting import TrajectoryFit, fit
from ppafo.identification.trajectory.numbers import TIME_OFFSET, FreeParameter, declaration_of, full_path
from ppafo.identification.trajectory.problem import TrajectoryProblem
from ppafo.identification.trajectory.tolerances import stated_by, tolerance_parameters
from ppafo.identification.wording import in_shown_unit
from ppafo.parameters import apply_overrides, build_device
from ppafo.parameters.overrides import over
from ppafo.parameters.parameter_set import ParameterSet
from ppafo.progress import Report
from ppafo.signals import Recording
from ppafo.simulation.loading import list_scenarios, load_scenario
from ppafo.simulation.recorded.channels import ANGLE, COMMAND
from ppafo.simulation.recorded.clock import LONGEST_STEP
from ppafo.simulation.recorded.replay import locked_vane, replay_scenario, with_fixed_volume
from ppafo.simulation.recorded.rest import start_of
from ppafo.simulation.scenario import Scenario

_Label = Annotated[str, Field(pattern=NAME, max_length=60, description="its name, also in the names of files")]
_Noise = dict[str, Text]


class PriorSection(StrictTable):
    """What is known beforehand: a normal distribution."""

    mean: Annotated[Text, Field(description="most likely value, with its unit")]
    relative: Annotated[float, Field(gt=0.0, description="standard deviation over the mean")]


class ParameterSection(StrictTable):
    """Entry of a problem file for a number that is to be fitted."""

    path: Text = Field(description="dotted path, such as friction.viscous_damping or initial.pressure_1")
    start: Text | None = Field(
        None, description="start of the search; default: from the bench procedures, else the set"
    )
    low: Text | None = Field(None, description="lower bound")
    high: Text | None = Field(None, description="upper bound")
    prior: PriorSection | Literal["bench"] | None = Field(
        None, description="what is known beforehand; 'bench': the interval of a bench procedure of this file"
    )
    recordings: Texts = Field((), description="experiments in which it acts, by label; default: all")


class ExperimentSection(StrictTable):
    """A recording and the scenario that is to explain it.

    A scenario has the device of the problem. Without one the run follows what the recording has of command, supply and
    external torque, and begins as the recording does.
    """

    label: _Label
    recording: Text = Field(description="file, relative to this one")
    columns: Columns = None
    scenario: Text | None = Field(None, description="name or relative file of a scenario; default: the recorded inputs")
    overrides: Texts = Field((), description="changes to the scenario, or to the device without one")
    start: Text | None = Field(
        None, description="time of the recording at which the run begins; 0 s, or the first sample"
    )
    step: Text | None = Field(None, description="longest step of time in the run, such as '0.1 ms'")
    channels: Texts | None = Field(
        None, description="compared; default: angle and pressures, unless locked or followed"
    )
    noise: _Noise = Field({}, description="least standard deviation by channel, '0.1 deg', '500 Pa_d'; default: none")
    inputs: Texts | None = Field(None, description=f"recorded channels that the run follows: {', '.join(ALL_INPUTS)}")
    locked: Text | None = Field(
        None, description="angle at which the vane is locked, such as '75 deg'; without a scenario"
    )
    volume: Text | None = Field(None, description="fixed volume in place of the vane, '60 cm^3'; without a scenario")
    initial_state: Literal["scenario", "recording", "fitted"] | None = Field(
        None,
        description="state at the start; 'recording' and 'fitted' are one; default: the scenario, else the recording",
    )
    time_offset: Text | None = Field(None, description="limit of a fitted delay of the samples behind the run, '20 ms'")


class CandidateSection(StrictTable):
    """Entry of a problem file for an experiment that could be done next."""

    label: _Label
    scenario: Text = Field(description="name of a scenario, or a file relative to this one")
    overrides: Texts = Field((), description="changes to the scenario")
    noise: _Noise = Field({}, description="by channel; default: what the fit finds")
    interval: Text = Field("1 ms", description="time between two samples")


class TrajectorySection(StrictTable):
    """Section of a problem file for a fit of trajectories."""

    parameters: tuple[ParameterSection, ...] = Field(strict=False, min_length=1, description="free parameters")
    experiments: tuple[ExperimentSection, ...] = Field(strict=False, min_length=1, description="recordings to explain")
    confidence: Confidence = 0.95
    candidates: tuple[CandidateSection, ...] = Field(
        (), strict=False, description="experiments to rank by the information that they would bring"
    )


_REMOVED = {
    "loss": "the first pass is robust by itself; omit it",
    "other_starts": "other starts are tried where the first does not explain the recordings; omit it",
    "seed": "nothing is drawn; omit it",
    "directions": "recordings that want other numbers are found by themselves; omit it",
    "profiles": "intervals are the table's; omit it",
    "scale": "the search scales numbers by itself; omit it",
    "held": "is now locked; write locked = '75 deg'",
}


def refuse_removed(document: Mapping[str, Any], file: str) -> None:
    """Refuse keys that earlier versions had, with what to write instead; IdentificationError."""
    section, bench = document.get("trajectory"), document.get("bench")
    if isinstance(bench, dict) and "can" in bench:
        raise IdentificationError(
            f"{file}: bench.can: experiments are not proposed; write [[trajectory.candidates]], which are ranked"
        )
    lists = [section.get(name) for name in ("parameters", "experiments")] if isinstance(section, dict) else []
    tables = [section, *(table for tables in lists if isinstance(tables, list) for table in tables)]
    for key, instead in _REMOVED.items():
        if any(isinstance(table, dict) and key in table for table in tables):
            raise IdentificationError(f"{file}: trajectory: {key}: {instead}")


_NOISE_UNITS = {"angle": "rad", "pressure_1": "Pa_d", "pressure_2": "Pa_d"}


@dataclass(frozen=True, slots=True)
class Setting:
    """What a section leans on.

    ``read`` gives the recording of an experiment, ``folder`` is where paths of scenarios begin, ``file`` what messages
    call the section. ``parameter_set`` takes the place of the sets that scenarios name, ``valve`` of their valves.
    ``bench`` are estimates that came before, by path; ``used`` are the recordings from which they came. ``tolerances``
    are those of the bench.
    """

    read: Callable[[ExperimentSection], Source]
    folder: Path
    file: str
    parameter_set: ParameterSet | None = None
    valve: str | None = None
    bench: Mapping[str, Estimate] = field(default_factory=dict)
    used: tuple[Use, ...] = ()
    tolerances: Tolerances = field(default_factory=Tolerances)


def noise_of_channels(given: Mapping[str, str], said: str) -> dict[str, float]:
    """Return the standard deviations [rad], [Pa] that are given by channel.

    IdentificationError for a channel that has none here.
    """
    found = {}
    for name, text in given.items():
        if name not in _NOISE_UNITS:
            hint = nearest_name(name, _NOISE_UNITS)
            raise IdentificationError(f"{said}: noise of '{name}'{hint}: only {', '.join(_NOISE_UNITS)} have one here")
        found[name] = quantity_of(f"{said}: noise.{name}", text, _NOISE_UNITS[name])
    return found


SHORTEST_STEP = 1.0e-6
"""Seconds; a shorter step would only cost time."""


def trajectory_problem(section: TrajectorySection, setting: Setting) -> TrajectoryProblem:
    """Return the problem of a section. IdentificationError where it repeats what the bench settles."""
    experiments = tuple(_experiment(item, setting) for item in section.experiments)
    scenarios = {item.label: item.scenario for item in experiments}
    # Samples that a bench procedure used are in its interval, which is a prior here.
    twice = double_use(setting.used, map(use_of, experiments))
    if twice:
        raise IdentificationError(f"{setting.file}: {twice}; bench values are where the fit starts and what it holds")
    parameters = [_parameter(item, scenarios, setting) for item in section.parameters]
    for item in section.experiments:
        said = f"{setting.file}: experiment '{item.label}'"
        longest = positive_in(item, "time_offset", "s", said)
        if longest is not None:
            # The delay of the samples of one recording is known within a limit, as a tolerance is.
            parameters.append(
                FreeParameter(
                    TIME_OFFSET, 0.0, -longest, longest, deviation_of_limit(longest), (item.label,), is_tolerance=True
                )
            )
    chosen = setting.parameter_set
    stated = {} if chosen is None else stated_by(chosen, experiments[0].scenario)
    held = tolerance_parameters(setting.tolerances, experiments, parameters, stated)
    return TrajectoryProblem((*parameters, *held), experiments, section.confidence)


def candidates_of(section: TrajectorySection, setting: Setting) -> tuple[Candidate, ...]:
    """Return the experiments that could be done next."""
    found = []
    for item in section.candidates:
        said = f"{setting.file}: candidate '{item.label}'"
        scenario = _scenario(item.scenario, item.overrides, setting)
        interval = quantity_in(item, "interval", "s", said, SHORTEST_STEP, scenario.run.duration)
        assert interval is not None, "it has a default"
        found.append(Candidate(item.label, scenario, noise_of_channels(item.noise, said), interval))
    return tuple(found)


def _experiment(item: ExperimentSection, setting: Setting) -> Experiment:
    said = f"{setting.file}: experiment '{item.label}'"
    source = setting.read(item)
    if item.scenario is None:
        scenario, start, inputs = _replay(item, source.recording, setting, said)
    else:
        for name in ("locked", "volume"):
            if getattr(item, name) is not None:
                raise IdentificationError(
                    f"{said}: {name} and a scenario: the scenario prescribes how the vane moves; omit one of them"
                )
        scenario = _scenario(item.scenario, item.overrides, setting)
        start, inputs = quantity_in(item, "start", "s", said) or 0.0, item.inputs or ()
    step = quantity_in(item, "step", "s", said, SHORTEST_STEP, LONGEST_STEP)
    scenario = scenario if step is None else replace(scenario, run=replace(scenario.run, step=step))
    # The scenario of a replay has the state of the samples already.
    is_read = item.scenario is not None and item.initial_state in ("recording", "fitted")
    return Experiment(
        label=item.label,
        scenario=scenario,
        recording=source.recording,
        start=start,
        channels=_compared_channels(item),
        noise=noise_of_channels(item.noise, said),
        inputs=inputs,
        initial_state="recording" if is_read else "scenario",
        source=source.trace,
    )


def _scenario(name: str, overrides: tuple[str, ...], setting: Setting) -> Scenario:
    found = name if name in list_scenarios() else str(setting.folder / name)
    # The valve of the problem goes before what the experiment changes of it.
    chosen = () if setting.valve is None else (f"device.valve={setting.valve}",)
    return load_scenario(found, over(chosen, overrides, ScenarioError), setting.parameter_set)


def _parameter(item: ParameterSection, scenarios: Mapping[str, Scenario], setting: Setting) -> FreeParameter:
    scenario = next((scenarios[label] for label in item.recordings if label in scenarios), None)
    acting = scenario or next(iter(scenarios.values()))
    quantity = declaration_of(item.path, acting)
    atmosphere = acting.device.supply.atmospheric_pressure
    said = f"{setting.file}: parameter '{item.path}'"
    start, low, high = (
        quantity_in(item, key, quantity.unit, said, atmosphere=atmosphere) for key in ("start", "low", "high")
    )
    deviation = math.inf
    if item.prior == "bench":
        estimate = setting.bench.get(full_path(item.path, acting))
        if estimate is None or not estimate.is_usable:
            have = ", ".join(path for path, one in setting.bench.items() if one.is_usable) or "none"
            raise IdentificationError(
                f"{said}: prior = 'bench': no procedure of this problem identified it; identified: {have}"
            )
        start, deviation = estimate.value, estimate.wider_half_width / interval_factor(estimate.confidence)
    elif item.prior is not None:
        start = quantity_of(f"{said}: prior.mean", item.prior.mean, quantity.unit, atmosphere)
        deviation = abs(start) * item.prior.relative
    return FreeParameter(item.path, start, low, high, deviation, item.recordings)


def _replay(
    item: ExperimentSection, recording: Recording, setting: Setting, said: str
) -> tuple[Scenario, float, tuple[str, ...]]:
    """Return the run of a recording on the device of the set, its start [s] and inputs; by default the first sample.

    IdentificationError where a scenario is needed.
    """
    if setting.parameter_set is None:
        raise IdentificationError(f"{said}: needs a scenario, because no device was given")
    inputs = tuple(name for name in INPUTS if name in recording) if item.inputs is None else item.inputs
    is_locked, is_fixed = item.locked is not None, item.volume is not None
    refuse_first(
        said,
        (item.initial_state == "scenario", "initial_state = 'scenario', but it has no scenario; omit it"),
        (
            (is_locked or is_fixed) and ANGLE in inputs,
            f"the vane is locked or absent, but inputs has '{ANGLE}': omit one of them",
        ),
        (is_locked and is_fixed, "locked and volume: with a fixed volume there is no vane; omit one of them"),
        (
            COMMAND not in recording,
            f"has no scenario, so its recording needs a channel '{COMMAND}'; it has {', '.join(recording.names)}",
        ),
        (COMMAND not in inputs, f"has no scenario, so inputs must have '{COMMAND}'"),
    )
    first = quantity_in(item, "start", "s", said)
    first = float(recording.time[0]) if first is None else first
    used = recording.between(first, float(recording.time[-1]))
    device = build_device(apply_overrides(setting.parameter_set, item.overrides, valve=setting.valve), setting.valve)
    angle, volume = quantity_in(item, "locked", "rad", said), positive_in(item, "volume", "m^3", said)
    known = {} if angle is None else {ANGLE: angle}
    if volume is not None:
        device, known = with_fixed_volume(device, volume)
    remedies = dict.fromkeys(FITTED_CHANNELS, "give a scenario, which prescribes the initial state")
    start = start_of(used, device, known, said, remedies)
    motion = locked_vane(start.angle) if known else None
    return replay_scenario(recording, device, start, used.duration, said, motion), first, inputs


def _compared_channels(item: ExperimentSection) -> tuple[str, ...]:
    """Return what an experiment is compared in: as given, else all that is neither locked nor followed."""
    if item.channels is not None:
        return item.channels
    if item.volume is not None:
        return ("pressure_1",)
    is_prescribed = item.locked is not None or ANGLE in (item.inputs or ())
    return FITTED_CHANNELS[1:] if is_prescribed else FITTED_CHANNELS


@dataclass(frozen=True, slots=True)
class TrajectoryOutcome:
    """The fit, candidates by what they would bring, the best first, and remarks on recordings and on the fit."""

    fit: TrajectoryFit
    expected: tuple[Expected, ...]
    remarks: tuple[str, ...]

    @property
    def is_good(self) -> bool:
        """Whether the search converged on a device that keeps its rules, and no recording wants other numbers."""
        return not self.fit.conflict and not self.fit.remarks


def solve_section(section: TrajectorySection, setting: Setting, report: Report) -> TrajectoryOutcome:
    """Return the outcome of a section; everything that can be refused is refused before the search begins."""
    try:
        problem = trajectory_problem(section, setting)
        candidates = candidates_of(section, setting)
        found = fit(problem, report)
        expected = expected_information(found, candidates)
    except (IdentificationError, DataError) as error:
        if str(error).startswith(setting.file):
            raise
        raise type(error)(f"{setting.file}: {error}") from error
    sources = tuple(Source(item.recording, item.source) for item in problem.experiments)
    remarks = [*told_of_readings(sources), *found.outliers, *found.remarks]
    for fitted in found.estimates:
        other = setting.bench.get(fitted.path)
        if other is None or not (other.is_usable and fitted.is_usable):
            continue
        if fitted.low > other.high or fitted.high < other.low:
            ends = [in_shown_unit(end, fitted.unit) for end in (fitted.low, fitted.high, other.low, other.high)]
            low, high, lowest, highest = (f"{end:.4g}" for end, _ in ends)
            remarks.append(
                f"{fitted.path}: fitted {low} to {high} {ends[0][1]}, from the bench {lowest} to {highest}: one of the "
                "two models is incomplete"
            )
    return TrajectoryOutcome(found, expected, tuple(remarks))
