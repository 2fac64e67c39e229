"""Public function ``linearise``: linear model of a plant near an operating point."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.arguments import Overrides, Point, Word, checked
from ppafo.plugins import Plugins

if TYPE_CHECKING:
    from ppafo.analyses.linearise.model import LinearModel
    from ppafo.report.finding import Finding
    from ppafo.simulation.scenario import Scenario

ScenarioLike = Annotated["Scenario | str | Path", Word("SCENARIO", help="name of a scenario, or a .toml file")]


@checked
def linearise(
    scenario: ScenarioLike, *, at: Point = "equilibrium", overrides: Overrides = (), plugins: Plugins = ()
) -> Finding[LinearModel]:
    """Make a linear model of the plant near one point, for control design.

    The equilibrium is the steady state with the torque of the last reference value or, for a controller with constant
    command, with this command; the ankle stays at its angle at the end of the run. Derivatives are finite differences
    of the equations of the plant, accurate to 1e-6 of the largest in their row.

    Arguments:
        scenario: name of a scenario, or a .toml file
        at: a time of the run, such as '1.5 s', or 'equilibrium' (default): the steady state that holds the last value
            of the reference
        overrides: values to change, for example 'valve.area=12.6 mm^2'; may be repeated
        plugins: modules of your own, files or names, whose objects files may name

    Returns:
        a Finding whose ``found`` is a LinearModel: matrices and signals in SI units, poles [1/s], and margins, of which
        ``phase_margin`` is in rad (in the report in degrees), crossovers and bandwidth in Hz

    Raises:
        ScenarioError: a time outside the run, a scenario without equilibrium, and a valve that is on or off

    >>> import ppafo
    >>> model = ppafo.linearise("torque-task-proportional", overrides={"reference.level": 3.0}).found
    >>> [f"{pole.real:.2f} 1/s" for pole in model.poles]
    ['-0.21 1/s', '-0.97 1/s']
    """
    from ppafo.analyses.linearise.model import finding_of, linear_model
    from ppafo.simulation.loading import scenario_or_load

    return finding_of(linear_model(scenario_or_load(scenario, overrides), at))
