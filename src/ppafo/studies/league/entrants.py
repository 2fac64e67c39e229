"""Who plays in the league: every controller of the catalogue that follows a reference, on the valves that suit it.

A law with a continuous command says nothing to a solenoid valve but its sign, so only the on/off laws play there. To
add an entrant: one line here.
"""

from dataclasses import dataclass

from ppafo.control.catalog import CONTROLLERS

PROPORTIONAL = ("device.valve=proportional", "controller.rate=1 kHz")
SOLENOID = ("device.valve=solenoid", "controller.rate=20 Hz")
TUNED = "python -m ppafo.studies.league.tuning"


@dataclass(frozen=True, slots=True)
class Entrant:
    """A controller on a valve: overrides that make it of any scenario, and how its gains were found.

    ``learns`` says that the task is repeated until its table is learnt, before it counts.
    """

    name: str
    kind: str
    overrides: tuple[str, ...]
    found: str
    learns: bool = False

    @property
    def source(self) -> str:
        """Where the law comes from."""
        return CONTROLLERS[self.kind].source

    @property
    def valve(self) -> str:
        """The valve that it is played on."""
        return "solenoid" if SOLENOID[0] in self.overrides else "proportional"


def _entrant(
    name: str, kind: str, valve: tuple[str, ...], settings: tuple[str, ...], found: str, learns: bool = False
) -> Entrant:
    given = tuple(f"controller.{setting}" for setting in settings)
    return Entrant(name, kind, (f"controller.kind={kind}", *valve, *given), found, learns)


def _tuned(kind: str) -> str:
    return f"defaults of the catalogue, found with {TUNED} {kind}"


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
        "chosen: narrower than one sample of the solenoid pair can keep",
    ),
    _entrant("on_off_dead_zone", "on_off_dead_zone", PROPORTIONAL, (), _tuned("on_off_dead_zone")),
    _entrant("pid-paper", "pid", PROPORTIONAL, PID_PAPER, "the paper's gains"),
    _entrant("pid-tuned", "pid", PROPORTIONAL, PID_TUNED, f"found with {TUNED} pid"),
    _entrant("pid_feedforward", "pid_feedforward", PROPORTIONAL, PID_FEEDFORWARD_TUNED, _tuned("pid_feedforward")),
    _entrant("sliding_mode", "sliding_mode", PROPORTIONAL, (), _tuned("sliding_mode")),
    _entrant("damped_proportional", "damped_proportional", PROPORTIONAL, DAMPED_TUNED, _tuned("damped_proportional")),
    _entrant(
        "damped_proportional-learnt",
        "damped_proportional",
        PROPORTIONAL,
        DAMPED_TUNED,
        f"{_tuned('damped_proportional')}; the table learnt on the undisturbed device",
        learns=True,
    ),
    _entrant("feedback_linearisation", "feedback_linearisation", PROPORTIONAL, (), _tuned("feedback_linearisation")),
)
"""In the order of the catalogue; tables sort by error."""
