"""The league as lines of text and as a document; grams in the text, SI units in the document."""

from collections.abc import Mapping, Sequence
from typing import Any

import ppafo
from ppafo.reporting.monte_carlo_report import shown_share
from ppafo.simulation.document import plain
from ppafo.studies.league import League, Standing
from ppafo.studies.league.draws import SEED, UNCERTAINTIES
from ppafo.studies.league.lower_bound import LowerBound
from ppafo.studies.league.standing import Bounded
from ppafo.studies.uncertainty.intervals import Interval

HEAD = (
    "controller",
    "valve",
    "RMS",
    "ramp",
    "hold",
    "peak",
    "error above least",
    "gas",
    "gas above least",
    "switchings",
    "median",
    "95 %",
)
"""Errors in N m, gas in g; the last two are RMS errors on drawn devices."""
_ERRORS = ("rms_error", "rms_error_ramp", "rms_error_hold", "peak_error")
_GRAMS = 1.0e3
_NONE = "-"


def league_rows(league: League) -> list[tuple[str, ...]]:
    """Return the cells of every standing, in the order of ``HEAD``."""
    return [_cells(league, standing) for standing in league.standings]


def league_table(league: League) -> list[str]:
    """Return the table with what has to be known beside it."""
    rows = [HEAD, *league_rows(league)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(HEAD))]
    return [
        f"{league.scenario}{_changed(league)}: errors in N m, gas in g",
        "",
        *(aligned(row, widths) for row in rows),
        "",
        *league_notes(league),
    ]


def league_notes(league: League) -> list[str]:
    """Return what the numbers rest on: the bound, the draws, who learnt and who is absent."""
    notes = [bound_sentence(valve, bounded) for valve, bounded in league.bounds.items()]
    notes += [f"no lower bound: {league.without_bound}"] if league.without_bound else []
    if league.draws:
        spread = ", ".join(f"{item.name} {100 * item.share:.0f} %" for item in UNCERTAINTIES)
        notes.append(f"median and 95 %: RMS errors on {league.draws} devices drawn, either way, within: {spread}")
    robust = {item.entrant.name: item.robustness for item in league.standings if item.robustness is not None}
    notes += noise_notes({name: item.noise for name, item in robust.items()})
    notes += [_learning_sentence(standing) for standing in league.standings if standing.learning is not None]
    notes += [_failed(standing) for standing in league.standings if standing.robustness and standing.robustness.failed]
    return [*notes, *(f"{name} is absent: {reason}" for name, reason in league.absent.items())]


def noise_notes(shares: Mapping[str, Interval | None]) -> list[str]:
    """Return what share of the spread of each entrant's error over the draws is noise; nothing without noise."""
    known = [f"{name} {shown_share(share)}" for name, share in shares.items() if share is not None]
    if not known:
        return []
    return [f"of the variance of the error over the draws, each with noise of its own, noise makes: {', '.join(known)}"]


def bound_sentence(valve: str, bounded: Bounded) -> str:
    """Return the least error of a valve in one sentence, and how well the engine agrees."""
    bound = bounded.bound
    least, gas = f"{bound.least_error.rms_error:.4g} N m", f"{_GRAMS * bound.least_error.gas:.4g} g"
    finding = (
        f"an RMS error of {least}, which counts as none, takes at least {gas}"
        if bound.is_attainable
        else f"no control has an RMS error below {least}, which takes {gas}"
    )
    text = (
        f"lower bound, {valve}: {finding}; {bound.intervals} intervals, "
        f"moved by {100 * bound.moved:.2g} % in the last refinement"
    )
    if not bounded.played:
        return f"{text}; a valve that switches infinitely fast, so no run can confirm it"
    shares = [f"{100 * share:.2g} %" for share in disagreement(bounded)]
    return f"{text}; played on the engine the error is within {shares[0]}, the gas within {shares[1]}"


def disagreement(bounded: Bounded) -> tuple[float, float]:
    """Return the largest shares by which error and gas of a played optimal command differ from the optimiser's."""
    optima = _optima(bounded.bound)
    pairs = list(zip(optima, bounded.played, strict=True))
    error = max(abs(run.rms_error / optimum.rms_error - 1.0) for optimum, run in pairs)
    return error, max(abs(run.gas / optimum.gas - 1.0) for optimum, run in pairs)


def league_document(league: League) -> dict[str, Any]:
    """Return what ``league.json`` says, in SI units."""
    return {
        "format": "ppafo league",
        "schema_version": 1,
        "scenario": league.scenario,
        "overrides": list(league.overrides),
        "draws": league.draws,
        "seed": SEED,
        "uncertainties": {item.name: item.share for item in UNCERTAINTIES},
        "standings": [_standing_document(league, standing) for standing in league.standings],
        "absent": dict(league.absent),
        "lower_bounds": {valve: _bound_document(bounded) for valve, bounded in league.bounds.items()},
        "without_bound": league.without_bound,
        "versions": {"ppafo": ppafo.__version__},
    }


def _cells(league: League, standing: Standing) -> tuple[str, ...]:
    robust, gas = standing.robustness, standing.value("gas_supplied")
    gas_above = league.gas_above_least(standing)
    return (
        standing.entrant.name,
        standing.entrant.valve,
        *(_number(standing.value(name)) for name in _ERRORS),
        _number(league.error_above_least(standing)),
        _NONE if gas is None else f"{_GRAMS * gas:.3f}",
        _NONE if gas_above is None else f"{_GRAMS * gas_above:.3f}",
        f"{standing.value('switchings'):.0f}",
        _NONE if robust is None else _number(robust.error(0.5)),
        _NONE if robust is None else _number(robust.error(0.95)),
    )


def _number(value: float | None) -> str:
    return _NONE if value is None else f"{value:.4f}"


def _changed(league: League) -> str:
    return f" with {', '.join(league.overrides)}" if league.overrides else ""


def _learning_sentence(standing: Standing) -> str:
    learning = standing.learning
    if learning is None:
        return ""
    ended = "became no better" if learning.is_converged else "was still getting better"
    return (
        f"{standing.entrant.name}: RMS error {learning.errors[0]:.4f} N m in the first repetition, "
        f"{learning.errors[learning.best]:.4f} N m in repetition {learning.best + 1}; "
        f"after {len(learning.errors)} it {ended}"
    )


def _failed(standing: Standing) -> str:
    failed = 0 if standing.robustness is None else standing.robustness.failed
    return f"{standing.entrant.name} diverged on {failed} of the drawn devices"


def aligned(row: Sequence[str], widths: Sequence[int]) -> str:
    """Return one line of a league: two names to the left, numbers to the right."""
    names = [f"{cell:<{width}}" for cell, width in zip(row[:2], widths[:2], strict=True)]
    numbers = [f"{cell:>{width}}" for cell, width in zip(row[2:], widths[2:], strict=True)]
    return "  ".join([*names, *numbers]).rstrip()


def _standing_document(league: League, standing: Standing) -> dict[str, Any]:
    robust, learning, control = standing.robustness, standing.learning, standing.result.scenario.control
    return {
        "name": standing.entrant.name,
        "controller": control.kind,
        "valve": standing.entrant.valve,
        "settings": dict(control.settings),
        "period": control.period,
        "source": standing.entrant.source,
        "gains_found": standing.entrant.found,
        "command": standing.command,
        "status": standing.result.status.kind,
        "metrics": {name: {"value": item.value, "unit": item.unit} for name, item in standing.result.metrics.items()},
        "error_above_least": league.error_above_least(standing),
        "gas_above_least": league.gas_above_least(standing),
        "robustness": None
        if robust is None
        else {
            "median": _finite(robust.error(0.5)),
            "quantile_95": _finite(robust.error(0.95)),
            "failed": robust.failed,
            "errors": [_finite(value) for value in robust.errors.tolist()],
            "share_of_noise": None if robust.noise is None else plain(robust.noise),
        },
        "learning": None
        if learning is None
        else {"errors": list(learning.errors), "best": learning.best, "is_converged": learning.is_converged},
    }


def _bound_document(bounded: Bounded) -> dict[str, Any]:
    bound = bounded.bound
    points = [
        {"rms_error": optimum.rms_error, "gas": optimum.gas, "overlap": optimum.overlap} for optimum in _optima(bound)
    ]
    played = [{"rms_error": run.rms_error, "gas": run.gas} for run in bounded.played]
    return {
        "intervals": bound.intervals,
        "moved": bound.moved,
        "unmeasurable_error": bound.unmeasurable,
        "least_error_first": points,
        "played": played,
    }


def _optima(bound: LowerBound) -> list[Any]:
    return [bound.least_error, *bound.curve]


def _finite(value: float) -> float | None:
    return value if value < float("inf") else None
