"""The question from which value on a condition is met: its arguments."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.arguments import Count, Overrides, Threads, Word, checked
from ppafo.plugins import Plugins, name_plugins
from ppafo.progress import Report

if TYPE_CHECKING:
    from ppafo.analyses.find.solve import Threshold
    from ppafo.report.finding import Finding
    from ppafo.simulation.scenario import Scenario

ScenarioLike = Annotated["Scenario | str | Path", Word("SCENARIO", help="name of a scenario, or a .toml file")]
VariedRange = Annotated[str, Word("PATH=LOW..HIGH", option="--vary")]
Condition = Annotated[str, Word("CONDITION", option="--such-that")]
Highest = Annotated[bool, Word(off="--lowest", help="find the lowest value (default)")]


@checked("scenario", "vary", "such_that", "highest", "grid", "overrides")
def find(
    scenario: ScenarioLike,
    *,
    vary: VariedRange,
    such_that: Condition,
    highest: Highest = False,
    grid: Count = 64,
    overrides: Overrides = (),
    threads: Threads | None = None,
    plugins: Plugins = (),
    progress: Report | None = None,
) -> Finding[Threshold]:
    """Find the lowest or highest value that meets a condition on a metric.

    A grid of values over the range is run side by side; between the last one that does not meet the condition and the
    first one that does, the bracket is divided again and again down to 1e-6 of the range. What happens between two
    values of the grid on one side of the condition is not seen. StudyError or ScenarioError for bad input, and where
    every run fails.

    vary: a number of the scenario or its device, and its range, for example 'supply.pressure=20..90 psi_g'
    such_that: a metric, <= or >=, and a limit, for example 'final_error <= 0.3 N m'
    highest: find the highest value
    grid: number of evenly spaced values to try first; default 64
    plugins: modules of your own, files or names, whose objects files may name
    """
    name_plugins(plugins)
    import numpy as np

    from ppafo.analyses.find.solve import (
        ACCURACY,
        CONDITION,
        FEWEST,
        MOST,
        PARTS,
        SEED,
        STREAMS,
        Search,
        finding_of,
        range_of,
    )
    from ppafo.errors import StudyError, one_line
    from ppafo.loading import scenario_or_load
    from ppafo.studies.draws import Limit, atmosphere_of, check_metrics, level_of, seeds_of_noise
    from ppafo.studies.study import with_overrides
    from ppafo.study.runs import Runs, Tally, with_companions

    base = with_overrides(scenario_or_load(scenario), overrides)
    path, low, high = range_of(vary, base)
    parts = CONDITION.fullmatch(such_that)
    if parts is None:
        raise StudyError(
            f"'{one_line(such_that)}' is not of the form METRIC <= LIMIT or METRIC >= LIMIT, "
            "for example 'final_error <= 0.3 N m'"
        )
    check_metrics([parts[1]], base)
    limit = level_of(parts[3], parts[1], f"'{one_line(such_that)}'", atmosphere_of(base, [path.path]))
    condition = Limit(parts[1], limit, parts[2] == "<=", f"{parts[1]} {parts[2]} {parts[3]}")
    if not FEWEST <= grid <= MOST:
        raise StudyError(f"grid = {grid}: must be at least {FEWEST} and at most {MOST:,}")
    # The same streams for all values, so that neighbours differ by the value alone.
    seeds = seeds_of_noise([base], [path.path], 0, STREAMS, SEED)
    tally = Tally(grid * max(1, seeds.size), progress)
    search = Search(
        base, path.path, condition, Runs(base, with_companions([condition.metric], base), tally, (), threads), seeds
    )
    search.run(np.linspace(low, high, grid))
    if not np.isfinite(search.metrics).any():
        if search.oscillating:
            raise StudyError(
                f"scenario '{base.name}': in every run from {path.quote(low)} to {path.quote(high)} the torque loop "
                "oscillates: leave its gains out, so that they follow the device"
            )
        reason = search.runs.reason
        raise StudyError(
            f"scenario '{base.name}': no run from {path.quote(low)} to {path.quote(high)} has a "
            f"'{condition.metric}'{reason and '; the first: '}{reason}"
        )
    # All parts of a bracket side by side: a bisection would wait for every one of its runs.
    value, beyond = search.ends(highest)
    while value is not None and beyond is not None and abs(value - beyond) > ACCURACY * (high - low):
        search.run(np.linspace(value, beyond, PARTS + 1)[1:-1])
        value, beyond = search.ends(highest)
    return finding_of(base.name, path, search, highest, grid)
