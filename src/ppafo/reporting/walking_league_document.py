"""The league on a leg that walks as a document, in SI units."""

from typing import Any

import ppafo
from ppafo.simulation.document import plain
from ppafo.studies.league.draws import SEED, UNCERTAINTIES
from ppafo.studies.league.walking.measures import MEASURES
from ppafo.studies.league.walking.solver import StrideOptimum
from ppafo.studies.league.walking.standing import WalkingBounded, WalkingLeague, WalkingStanding


def walking_league_document(league: WalkingLeague) -> dict[str, Any]:
    """Return what ``league.json`` says, in SI units."""
    task = league.task
    return {
        "format": "ppafo walking league",
        "schema_version": 1,
        "walk": task.file,
        "gait": task.gait,
        "overrides": list(task.overrides),
        "profile": task.profile._asdict(),
        "seconds": task.seconds,
        "draws": league.draws,
        "seed": SEED,
        "uncertainties": {item.name: item.share for item in UNCERTAINTIES},
        "measures": {name: {"unit": unit, "summary": summary} for name, (unit, summary) in MEASURES.items()},
        "standings": [_standing_document(league, standing) for standing in league.standings],
        "absent": dict(league.absent),
        "lower_bounds": {valve: _bound_document(bounded) for valve, bounded in league.bounds.items()},
        "without_bound": league.without_bound,
        "versions": {"ppafo": ppafo.__version__},
    }


def _standing_document(league: WalkingLeague, standing: WalkingStanding) -> dict[str, Any]:
    robust, configuration = standing.robustness, standing.configuration
    return {
        "name": standing.entrant.name,
        "controller": standing.entrant.kind,
        "valve": standing.entrant.valve,
        "settings": dict(configuration.settings),
        "period": configuration.period,
        "source": standing.entrant.source,
        "gains_found": standing.entrant.found,
        "command": standing.command,
        "measures": dict(standing.measures),
        "error_above_least": league.error_above_least(standing),
        "least_gas": league.least_gas(standing),
        "gas_above_least": league.gas_above_least(standing),
        "robustness": None
        if robust is None
        else {
            "toes_clear": robust.clear,
            "safe_states": robust.safe_states,
            "failed": robust.failed,
            "share_of_noise": None if robust.noise is None else plain(robust.noise),
            "drawn": [None if item is None else dict(item) for item in robust.drawn],
        },
    }


def _bound_document(bounded: WalkingBounded) -> dict[str, Any]:
    bound = bounded.bound
    return {
        "intervals": bound.intervals,
        "moved": bound.moved,
        "landing": bound.landing,
        "unmeasurable_error": bound.unmeasurable,
        "error_of_no_torque": bound.idle_error,
        "least_error_first": [_point(optimum) for optimum in (bound.least_error, *bound.curve)],
        "played": [{"rms_error": run.rms_error, "gas": run.gas, "toe_height": run.height} for run in bounded.played],
        "own": {name: None if item is None else _point(item) for name, item in bound.own.items()},
    }


def _point(optimum: StrideOptimum) -> dict[str, float]:
    return {"rms_error": optimum.rms_error, "gas": optimum.gas, "toe_height": optimum.height}
