"""Who plays in a league, on which drawn devices, and what is reported of an entrant and of a valve; any task.

A law with a continuous command says nothing to a solenoid valve but its sign, so only the on/off laws play there. To
add an entrant to the torque task: one line here. A controller that is new in the walking catalogue enters by itself, on
the proportional valve; only another valve takes a line.

Iterative learning repeats a task to learn the feed-forward table of ``damped_proportional``. The law of
Zhang, Cheah and Collins (2015) from one repetition n to the next, for every place i of the table:

    filtered_n = (1 - m) filtered_{n-1} + m e_n
    table_{n+1}(i) = b table_n(i) + k filtered_n(i)

with the table used a little earlier than it was learnt, by the lead. The error e at a knot is the mean over the time
that belongs to the knot, weighted as the table is read: straight to its neighbours.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Generic, Protocol, TypeVar

import numpy as np

from ppafo.control.catalog import CONTROLLERS
from ppafo.control.controllers.feedback import KNOTS
from ppafo.control.walking.catalog import TIMINGS, WALKING_CONTROLLERS
from ppafo.control.walking.timing import TimingKind
from ppafo.engine.lanes import Floats
from ppafo.errors import ScenarioError, SimulationError
from ppafo.parameters.device import Device, Orifice, SonicOrifice, Valve
from ppafo.signals import Recording
from ppafo.simulation.declaration import LARGEST_SEED
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import simulate
from ppafo.studies.distributions import Interval, noise_interval

SEED = 20110301
NOISE_DRAWS = 512
"""Draws that are run once more with other noise, at most."""


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """A value of the device that is uncertain: by what fraction either way, and the device with it times a factor."""

    name: str
    fraction: float
    scaled: Callable[[Device, float], Device]


def _valve(device: Device, factor: float) -> Device:
    return replace(device, valve=replace(device.valve, orifice=_wider(device.valve.orifice, factor)))


def _leak(device: Device, factor: float) -> Device:
    return replace(device, actuator=replace(device.actuator, leak=_wider(device.actuator.leak, factor)))


def _dead_volume_1(device: Device, factor: float) -> Device:
    actuator = device.actuator
    return replace(device, actuator=replace(actuator, dead_volume_1=factor * actuator.dead_volume_1))


def _dead_volume_2(device: Device, factor: float) -> Device:
    actuator = device.actuator
    return replace(device, actuator=replace(actuator, dead_volume_2=factor * actuator.dead_volume_2))


def _supply(device: Device, factor: float) -> Device:
    """The device with both gauge pressures of the supply times a factor."""
    supply = device.supply
    ambient = supply.atmospheric_pressure
    first = ambient + factor * (supply.pressure - ambient)
    second = ambient + factor * (supply.dorsiflexion_pressure - ambient)
    return replace(device, supply=replace(supply, pressure=first, dorsiflexion_pressure=second))


def _friction(device: Device, factor: float) -> Device:
    friction = device.friction
    changed = replace(
        friction,
        static_torque=factor * friction.static_torque,
        dynamic_torque=factor * friction.dynamic_torque,
        viscous_damping=factor * friction.viscous_damping,
    )
    return replace(device, friction=changed)


def _wider(orifice: Orifice | SonicOrifice, factor: float) -> Orifice | SonicOrifice:
    if isinstance(orifice, SonicOrifice):
        return replace(orifice, sonic_conductance=factor * orifice.sonic_conductance)
    return replace(orifice, area=factor * orifice.area)


UNCERTAINTIES = (
    Uncertainty("conductance of the valve", 0.2, _valve),
    Uncertainty("conductance of the leak", 0.2, _leak),
    Uncertainty("dead volume of chamber 1", 0.2, _dead_volume_1),
    Uncertainty("dead volume of chamber 2", 0.2, _dead_volume_2),
    Uncertainty("gauge pressures of the supply", 0.1, _supply),
    Uncertainty("friction", 0.2, _friction),
)
"""What is drawn, each evenly within its fraction: about what identification and a regulator leave open."""


def draw_devices(scenario: Scenario, factors: Floats) -> list[Scenario]:
    """The scenario with each of the devices that the rows of ``factors`` (draws, uncertainties) make of its own."""
    return [replace(scenario, device=scale_device(scenario.device, row.tolist())) for row in factors]


def scale_device(device: Device, factors: Sequence[float]) -> Device:
    """The device with each of its uncertain values times a factor, in the order of ``UNCERTAINTIES``."""
    for uncertainty, factor in zip(UNCERTAINTIES, factors, strict=True):
        device = uncertainty.scaled(device, factor)
    return device


def draw_factors(draws: int, seed: int = SEED) -> Floats:
    """Factors (draws, uncertainties), the same for every controller."""
    fractions = np.array([item.fraction for item in UNCERTAINTIES])
    even = np.random.default_rng(seed).uniform(-1.0, 1.0, (draws, fractions.size))
    return np.asarray(1.0 + fractions * even)


def draw_seeds(draws: int, seed: int = SEED) -> Floats:
    """Seeds of the noise (draws,), the same for every controller."""
    return np.random.default_rng([seed, 1]).integers(0, LARGEST_SEED + 1, draws).astype(np.float64)


def with_noise(scenarios: Sequence[Scenario], seeds: Floats) -> list[Scenario]:
    """Scenarios, each with the noise stream of its seed."""
    pairs = zip(scenarios, seeds.tolist(), strict=True)
    return [replace(item, sensors=replace(item.sensors, seed=int(seed))) for item, seed in pairs]


PROPORTIONAL = ("device.valve=proportional", "controller.rate=1 kHz")
SOLENOID = ("device.valve=solenoid", "controller.rate=20 Hz")
VALVES = {
    "event_on_off": ("solenoid", "proportional"),
    "event_on_off_dead_zone": ("solenoid", "proportional"),
}
"""Valves of the walking laws that a solenoid pair can follow."""
DEFAULTS = "defaults of the catalogue"
TUNED = "scripts/league_gains.py"


@dataclass(frozen=True, slots=True)
class Entrant:
    """A controller on a valve, overrides that make it of any scenario, how its gains were found, and its source.

    ``learns`` says that the task is repeated until its table is learnt, before it counts.
    """

    name: str
    kind: str
    valve: str
    overrides: tuple[str, ...] = ()
    found: str = DEFAULTS
    source: str = ""
    learns: bool = False


def _entrant(
    name: str, kind: str, valve: tuple[str, ...], settings: tuple[str, ...], found: str, learns: bool = False
) -> Entrant:
    given = tuple(f"controller.{setting}" for setting in settings)
    place = "solenoid" if valve == SOLENOID else "proportional"
    return Entrant(
        name, kind, place, (f"controller.kind={kind}", *valve, *given), found, CONTROLLERS[kind].source, learns
    )


def _tuning_source(kind: str) -> str:
    return f"{DEFAULTS}, found with {TUNED} {kind}"


PID_PAPER = (
    "proportional_gain=0.095 1/(N m)",
    "integral_gain=0.25 1/(N m s)",
    "derivative_gain=0.006 s/(N m)",
    "derivative_filter=0 s",
    "anti_windup=0 1/s",
)
PID_TUNED = (
    "proportional_gain=1.2 1/(N m)",
    "integral_gain=23 1/(N m s)",
    "derivative_gain=0.0095 s/(N m)",
    "derivative_filter=3.1 ms",
    "anti_windup=4.8 1/s",
)
PID_FEEDFORWARD_TUNED = (
    "proportional_gain=1.1 1/(N m)",
    "integral_gain=3.3 1/(N m s)",
    "derivative_gain=0.0061 s/(N m)",
    "derivative_filter=2.5 ms",
    "anti_windup=0.33 1/s",
)
DAMPED_TUNED = ("proportional_gain=1.7 1/(N m)",)
"""Written out where PID has the same name, because a scenario's value for the one would stay for the other."""
ENTRANTS = (
    _entrant("on_off", "on_off", SOLENOID, (), "the paper: no parameters"),
    _entrant(
        "on_off_dead_zone-solenoid",
        "on_off_dead_zone",
        SOLENOID,
        ("dead_zone=0.2 N m", "release=0.05 N m", "opening=1"),
        "chosen: narrower than the solenoid pair can maintain within one sample",
    ),
    _entrant("on_off_dead_zone", "on_off_dead_zone", PROPORTIONAL, (), _tuning_source("on_off_dead_zone")),
    _entrant("pid-paper", "pid", PROPORTIONAL, PID_PAPER, "the paper's gains"),
    _entrant("pid-tuned", "pid", PROPORTIONAL, PID_TUNED, f"found with {TUNED} pid"),
    _entrant(
        "pid_feedforward", "pid_feedforward", PROPORTIONAL, PID_FEEDFORWARD_TUNED, _tuning_source("pid_feedforward")
    ),
    _entrant("sliding_mode", "sliding_mode", PROPORTIONAL, (), _tuning_source("sliding_mode")),
    _entrant(
        "damped_proportional", "damped_proportional", PROPORTIONAL, DAMPED_TUNED, _tuning_source("damped_proportional")
    ),
    _entrant(
        "damped_proportional-learnt",
        "damped_proportional",
        PROPORTIONAL,
        DAMPED_TUNED,
        f"{_tuning_source('damped_proportional')}; table learnt on the nominal device",
        learns=True,
    ),
    _entrant(
        "feedback_linearisation", "feedback_linearisation", PROPORTIONAL, (), _tuning_source("feedback_linearisation")
    ),
)
"""On the torque task, in the order of the catalogue; tables sort by error."""
TIMED = (("event_pid_feedforward", "proportional"), ("event_on_off", "solenoid"))
"""Walking laws that enter with every timing of the stride, one for each valve; the others detect it by thresholds."""


def _walking_entrant(kind: str, valve: str, timing: TimingKind | None = None) -> Entrant:
    name = kind if valve == "proportional" else f"{kind}-{valve}"
    source = WALKING_CONTROLLERS[kind].source
    if timing is None:
        return Entrant(name, kind, valve, source=source)
    return Entrant(
        f"{name}-{timing.name}", kind, valve, (f"timing.kind={timing.name}",), source=f"{source}; {timing.source}"
    )


WALKING_ENTRANTS = (
    *(_walking_entrant(kind, valve) for kind in WALKING_CONTROLLERS for valve in VALVES.get(kind, ("proportional",))),
    *(_walking_entrant(*law, timing) for law in TIMED for timing in list(TIMINGS.values())[1:]),
)
"""On a leg that walks."""
LEARNER = "damped_proportional"
WITHOUT_PROGRESS = 5
"""Repetitions without a better one after which learning stops."""


@dataclass(frozen=True, slots=True)
class LearningLaw:
    """Gain k [1/(N m)], what is remembered b [-], fraction of the new error in the filter m [-], lead [s].

    At most ``repetitions`` are made; one that is less than the fraction ``progress`` better than the best so far is
    none.
    """

    gain: float = 0.8
    memory: float = 0.999
    filter_share: float = 0.7
    lead: float = 0.02
    repetitions: int = 60
    progress: float = 0.01


@dataclass(frozen=True, slots=True)
class Learning:
    """What was learnt: the scenario with the best table in it, and the RMS error [N m] of every repetition."""

    scenario: Scenario
    errors: tuple[float, ...]
    best: int
    is_converged: bool


def learn(scenario: Scenario, law: LearningLaw | None = None) -> Learning:
    """Repeat a task, learn, and stop where it becomes no better; the table starts as the scenario has it.

    ScenarioError for another controller than ``damped_proportional``, or a task longer than its table;
    SimulationError where a repetition diverges.
    """
    chosen = law or LearningLaw()
    _check(scenario, chosen)
    table = np.array(list(table_of(scenario).values()))
    filtered = np.zeros(KNOTS)
    errors: list[float] = []
    best, last_progress = scenario, 0
    while len(errors) < chosen.repetitions and len(errors) - last_progress <= WITHOUT_PROGRESS:
        trial = with_table(scenario, table)
        result = simulate(trial)
        if not result.status.is_completed:
            raise SimulationError(f"{trial.name}: a repetition of the task failed: {result.status.message}")
        recording, error = result.recording, result.metrics["rms_error"].value
        before = min(errors, default=math.inf)
        best = trial if error < before else best
        last_progress = len(errors) if error < (1.0 - chosen.progress) * before else last_progress
        errors.append(error)
        met = knot_errors(recording, scenario.control.settings["knot_spacing"], chosen.lead)
        filtered = (1.0 - chosen.filter_share) * filtered + chosen.filter_share * met
        table = np.clip(chosen.memory * table + chosen.gain * filtered, -1.0, 1.0)
    return Learning(best, tuple(errors), int(np.argmin(errors)), len(errors) - last_progress > WITHOUT_PROGRESS)


def knot_errors(recording: Recording, spacing: float, lead: float) -> Floats:
    """Mean torque error [N m] around each knot, a lead [s] after it; knots that the recording does not reach have 0."""
    error = recording["reference"] - recording["torque"]
    position = (recording.time - lead) / spacing
    weights = np.maximum(0.0, 1.0 - np.abs(position[None, :] - np.arange(KNOTS)[:, None]))
    total = weights.sum(axis=1)
    means: Floats = weights @ error / np.where(total > 0.0, total, 1.0)
    return means


def table_of(scenario: Scenario) -> dict[str, float]:
    """The learnt commands [-] of a scenario by the names of their knots."""
    names = [f"knot_{number}" for number in range(KNOTS)]
    return {name: scenario.control.settings[name] for name in names}


def with_table(scenario: Scenario, table: Floats) -> Scenario:
    """The scenario with other learnt commands [-] at the knots."""
    knots = {f"knot_{number}": float(value) for number, value in enumerate(table)}
    control = replace(scenario.control, settings={**scenario.control.settings, **knots})
    return replace(scenario, control=control)


def _check(scenario: Scenario, law: LearningLaw) -> None:
    control = scenario.control
    if control.kind != LEARNER:
        raise ScenarioError(
            f"{scenario.name}: only the controller '{LEARNER}' has a table to learn, not {control.kind}"
        )
    reach = (KNOTS - 1) * control.settings["knot_spacing"]
    if reach < scenario.duration * (1.0 - 1.0e-9):
        raise ScenarioError(
            f"{scenario.name}: the table of {KNOTS} knots reaches to {reach:g} s, the task lasts "
            f"{scenario.duration:g} s: make controller.knot_spacing at least {scenario.duration / (KNOTS - 1):.4g} s"
        )
    if law.repetitions < 1 or not 0.0 < law.filter_share <= 1.0 or not 0.0 <= law.memory <= 1.0 or law.gain <= 0.0:
        raise ScenarioError("learning needs at least one repetition, a gain above 0, and fractions from 0 to 1")


Measures = Mapping[str, float]
"""Values [SI] by name."""


@dataclass(frozen=True, slots=True)
class Robustness:
    """Measures on each draw; None where the run diverged.

    ``renoised`` are those of the first draws again, each with other noise; empty where the controller receives none.
    """

    drawn: tuple[Measures | None, ...]
    renoised: tuple[Measures | None, ...] = ()

    def values(self, measure: str, missing: float) -> list[float]:
        """Return a measure [SI] of every draw, ``missing`` where the run diverged."""
        return [missing if item is None else item[measure] for item in self.drawn]

    def not_exceeded(self, measure: str, fraction: float) -> float:
        """Return the value [SI] that this fraction of the draws does not exceed; inf where a run diverged."""
        return float(np.quantile(self.values(measure, float("inf")), fraction, method="higher"))

    def noise(self, measure: str) -> Interval | None:
        """Return the fraction of the variance over the draws that is due to noise, with its 95 % interval."""
        if not self.renoised:
            return None
        again = Robustness(self.renoised).values(measure, np.nan)
        return noise_interval(np.array(self.values(measure, np.nan)[: len(again)]), np.array(again), 0.95)

    @property
    def failed(self) -> int:
        """Number of draws on which the run diverged."""
        return self.drawn.count(None)


@dataclass(frozen=True, slots=True)
class Standing:
    """One entrant: the settings of its controller [SI], its period [s], the measures of its run, and the command.

    ``robustness`` is None without draws, ``learning`` for an entrant that does not learn.
    """

    entrant: Entrant
    settings: Measures
    period: float
    measures: Measures
    robustness: Robustness | None
    command: str
    status: str = "completed"
    learning: Learning | None = None


class Point(Protocol):
    """A control: its RMS error [N m] and its gas [kg]."""

    @property
    def rms_error(self) -> float:
        """RMS error [N m]."""

    @property
    def gas(self) -> float:
        """Gas taken from the supply [kg]."""


class Bound(Protocol):
    """What no control of a valve can pass: the minimum error, and the minimum gas at growing errors."""

    @property
    def least_error(self) -> Point:
        """The control with the minimum error."""

    @property
    def curve(self) -> Sequence[Point]:
        """The controls with the minimum gas, in order of their error."""

    @property
    def is_attainable(self) -> bool:
        """True where the minimum error counts as none."""


FORESEEN = "foresight"
"""What every bound relaxes: its control knows task and state beforehand."""


def relaxed_by(valve: Valve) -> tuple[str, ...]:
    """Return what a bound relaxes whose valve follows its command at once."""
    slow = [name for name, value in valve.settings.items() if value and not name.endswith("_ratio")]
    return (FORESEEN, *(name.replace("_", " ") for name in slow))


B_co = TypeVar("B_co", bound=Bound, covariant=True)


@dataclass(frozen=True, slots=True)
class Bounded(Generic[B_co]):
    """The lower bound of a valve, and what the engine makes of its controls; none where no valve can play them.

    ``least_error`` [N m] is what no control of the valve is below, ``least_gas`` by entrant the minimum gas [kg] with
    which what it reached is possible; None and empty where the bound makes use of what it ``relaxes``, so that the
    distance to it says nothing about a controller.
    """

    bound: B_co
    played: tuple[Point, ...]
    least_gas: Measures
    least_error: float | None
    relaxes: tuple[str, ...] = ()

    @property
    def points(self) -> tuple[Point, ...]:
        """The minimum error, and the curve after it."""
        return (self.bound.least_error, *self.bound.curve)
