"""Who plays in a league: every controller of the catalogues, on the valves that suit it.

A law with a continuous command says nothing to a solenoid valve but its sign, so only the on/off laws play there. To
add an entrant to the torque task: one line here. A controller that is new in the walking catalogue enters by itself, on
the proportional valve; only another valve takes a line.
"""

from dataclasses import dataclass

from ppafo.control.catalog import CONTROLLERS
from ppafo.control.walking.catalog import TIMINGS, WALKING_CONTROLLERS
from ppafo.control.walking.timing import TimingKind

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
