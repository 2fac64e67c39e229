"""Public function ``find``: lowest or highest value that meets a condition on a metric."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.arguments import Count, Overrides, Threads, Word, checked
from ppafo.plugins import Plugins, name_plugins
from ppafo.progress import Report
from ppafo.units.shown import shown_in

if TYPE_CHECKING:
    from ppafo.analyses.find.answer import Threshold
    from ppafo.report.finding import Finding
    from ppafo.simulation.scenario import Scenario

ScenarioLike = Annotated["Scenario | str | Path", Word("SCENARIO", help="name of a scenario, or a .toml file")]
VariedRange = Annotated[str, Word("PATH=LOW..HIGH", option="--vary")]
Condition = Annotated[str, Word("CONDITION", option="--such-that")]
Highest = Annotated[bool, Word(off="--lowest", help="find the lowest value (default)")]


@checked
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

    A grid of values over the range is run in parallel. The bracket between the outermost grid value that meets the
    condition and its outer neighbour is then divided repeatedly, down to 1e-6 of the range. A change of the condition
    between two neighbouring grid values that both meet it, or both miss it, is not detected.

    Arguments:
        scenario: name of a scenario, or a .toml file
        vary: a number of the scenario or its device, and its range, for example 'supply.pressure=20..90 psi_g'
        such_that: a metric, <= or >=, and a limit, for example 'final_error <= 0.3 N m', or 'follows': the
            run follows a reference that the actuator can give
        highest: find the highest value
        grid: number of evenly spaced values to try first; default 64
        overrides: values to change, for example 'valve.area=12.6 mm^2'; may be repeated
        threads: number of threads; default: all cores
        plugins: modules of your own, files or names, whose objects files may name
        progress: called with every count of a long computation

    Returns:
        a Finding whose ``found`` is a Threshold: the value, and the metric there

    Raises:
        StudyError: a range or a condition that cannot be used, and a grid of which every run fails
        ScenarioError: a scenario that cannot be used

    >>> import ppafo
    >>> task, metric = "torque-task-proportional", "rms_error <= 0.5 N m"
    >>> print(ppafo.find(task, vary="supply.pressure=20..90 psi_g", such_that=metric).said[0])
    supply.pressure = 54.7758 psi_g is the lowest value that meets rms_error <= 0.5 N m: rms_error is 0.5 N m there
    (bracketed to 3e-05 psi)
    """
    name_plugins(plugins)
    from dataclasses import replace

    from ppafo.analyses.find.answer import finding_of
    from ppafo.analyses.find.solve import outermost
    from ppafo.loading import scenario_or_load
    from ppafo.parameters.parameter_set import PATHS_THAT_SET_UNITS, units_of_texts
    from ppafo.simulation.numbers import changes_in
    from ppafo.simulation.tracking.pair_step import warn_of_coarse_pairs
    from ppafo.studies.study import with_overrides

    base = with_overrides(scenario_or_load(scenario), overrides)
    warn_of_coarse_pairs([base], [vary.partition("=")[0].strip()])
    # As in 'supply.pressure=2..6 bar_g' and 'final_error <= 30 N cm'.
    ranged = vary.rpartition("..")[2] if vary.strip().startswith(PATHS_THAT_SET_UNITS) else ""
    given = units_of_texts((ranged, such_that.rpartition("=")[2]))
    with shown_in({**base.device.shown, **given}):
        outcome = outermost(base, vary, such_that, highest, grid, threads, progress)
        found = finding_of(outcome, base.origin.overrides)
        return replace(found, overrides=changes_in(base))
