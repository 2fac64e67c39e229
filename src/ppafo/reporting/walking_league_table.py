"""The league on a leg that walks, as lines of text and as a document; SI units in the document."""

from ppafo.reporting.league_table import aligned, noise_notes
from ppafo.studies.league.draws import UNCERTAINTIES
from ppafo.studies.league.walking.standing import WalkingBounded, WalkingLeague, WalkingStanding
from ppafo.units import from_si

HEAD = (
    "controller",
    "valve",
    "error",
    "above least",
    "lag",
    "error at lag",
    "toes",
    "slap",
    "work",
    "gas",
    "above least",
    "switchings",
    "error 95 %",
    "clear",
)
UNITS = "errors in N m, lag in ms, toes in cm, slap in deg/s, work in J and gas in g a stride"
_GRAMS, _CENTIMETRES, _MILLISECONDS = 1.0e3, 1.0e2, 1.0e3
_NONE = "-"


def walking_league_rows(league: WalkingLeague) -> list[tuple[str, ...]]:
    """Return the cells of every standing, in the order of ``HEAD``."""
    return [_cells(league, standing) for standing in league.standings]


def walking_league_table(league: WalkingLeague) -> list[str]:
    """Return the table with what has to be known beside it."""
    rows = [HEAD, *walking_league_rows(league)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(HEAD))]
    changed = f" with {', '.join(league.task.overrides)}" if league.task.overrides else ""
    return [
        f"walking, {league.task.file}{changed}: {UNITS}",
        "",
        *(aligned(row, widths) for row in rows),
        "",
        *walking_league_notes(league),
    ]


def walking_league_notes(league: WalkingLeague) -> list[str]:
    """Return what the numbers rest on: the task, the bound, the draws, who vented for good and who is absent."""
    profile = league.task.profile
    notes = [
        f"wanted: in push-off {profile.peak_torque:g} N m at {profile.peak_time:g} of the stride, rise "
        f"{profile.rise_time:g}, fall {profile.fall_time:g}; mid-stance free; in mid-swing toes above the "
        f"ground; the second half of {league.task.seconds:g} s counts"
    ]
    notes += [walking_bound_sentence(valve, bounded) for valve, bounded in league.bounds.items()]
    notes += [f"no lower bound: {league.without_bound}"] if league.without_bound else []
    if league.draws:
        spread = ", ".join(f"{item.name} {100 * item.share:.0f} %" for item in UNCERTAINTIES)
        notes.append(
            f"error 95 %, clear (% of the draws with toes above the ground on every stride): {league.draws} "
            f"drawn wearers, each with a device that differs either way within: {spread}"
        )
    robust = {item.entrant.name: item.robustness for item in league.standings if item.robustness is not None}
    notes += noise_notes({name: item.noise for name, item in robust.items()})
    notes += [note for standing in league.standings for note in _remarks(standing)]
    if league.bounds:
        notes += [_not_compared(standing) for standing in league.standings if standing.measures["toe_strikes"] > 0.0]
    return [*notes, *(f"{name} is absent: {reason}" for name, reason in league.absent.items())]


def walking_bound_sentence(valve: str, bounded: WalkingBounded) -> str:
    """Return the least error of a valve in one sentence, and how well the engine agrees."""
    bound, shares = bounded.bound, disagreement(bounded)
    return (
        f"lower bound, {valve}: with toes above the ground the least error is {bound.least_error.rms_error:.3g} N m, "
        f"with {_GRAMS * bound.least_error.gas:.3g} g; flat at {100 * bound.landing:.2g} % of the stride, "
        f"{bound.intervals} intervals, moved by {100 * bound.moved:.2g} % in the last refinement; played on the engine "
        f"the error is within {1.0e3 * shares[0]:.2g} mN m, the gas within {100 * shares[1]:.2g} %, the toes within "
        f"{1.0e3 * shares[2]:.2g} mm"
    )


def disagreement(bounded: WalkingBounded) -> tuple[float, float, float]:
    """Return by how much played optima fall short at most: error [N m], share of the gas, height of the toes [m]."""
    pairs = list(zip((bounded.bound.least_error, *bounded.bound.curve), bounded.played, strict=True))
    return (
        max(abs(run.rms_error - optimum.rms_error) for optimum, run in pairs),
        max(abs(run.gas / optimum.gas - 1.0) for optimum, run in pairs),
        max(0.0, *(optimum.height - run.height for optimum, run in pairs)),
    )


def _cells(league: WalkingLeague, standing: WalkingStanding) -> tuple[str, ...]:
    found, robust = standing.measures, standing.robustness
    return (
        standing.entrant.name,
        standing.entrant.valve,
        _number(found["torque_error"], 3),
        _number(league.error_above_least(standing), 3),
        _number(_MILLISECONDS * found["torque_lag"], 0),
        _number(found["lagged_error"], 3),
        _number(_CENTIMETRES * found["toe_height"], 1),
        _number(from_si(found["slap_rate"], "deg/s", "rad/s"), 0),
        _number(found["push_off_work"], 2),
        _number(_GRAMS * found["gas"], 3),
        _number(_scaled(league.gas_above_least(standing), _GRAMS), 3),
        _number(found["switchings"], 0),
        _NONE if robust is None else _number(robust.error(0.95), 3),
        _NONE if robust is None else _number(100.0 * robust.clear, 0),
    )


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value


def _number(value: float | None, digits: int) -> str:
    if value is None:
        return _NONE
    text = f"{value:.{digits}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def _not_compared(standing: WalkingStanding) -> str:
    share = 100.0 * standing.measures["toe_strikes"]
    return f"{standing.entrant.name} begins {share:.0f} % of its strides on the toes, which no stride of the bound does"


def _remarks(standing: WalkingStanding) -> list[str]:
    """Return what went wrong: the safe state with good sensors, and walks that diverged."""
    name, robust = standing.entrant.name, standing.robustness
    found = [f"{name} vented for good on the task itself"] if standing.measures["safe_state"] > 0.0 else []
    if robust is not None and robust.safe_states:
        found.append(f"{name} vented for good on {robust.safe_states} of the draws, with sensors that work")
    if robust is not None and robust.failed:
        found.append(f"{name} diverged on {robust.failed} of the draws")
    return found
