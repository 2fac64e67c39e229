"""The question what a plant is near one point: its arguments."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.arguments import Overrides, Word, checked, words
from ppafo.plugins import Plugins, name_plugins

if TYPE_CHECKING:
    from ppafo.analyses.linearise.answer import LinearModel
    from ppafo.report.finding import Finding
    from ppafo.simulation.scenario import Scenario

ScenarioLike = Annotated["Scenario | str | Path", Word("SCENARIO", help="name of a scenario, or a .toml file")]


@checked("scenario", "at", "overrides")
def linearise(
    scenario: ScenarioLike, *, at: words.Point = "equilibrium", overrides: Overrides = (), plugins: Plugins = ()
) -> Finding[LinearModel]:
    """Make a linear model of the plant near one point, for control design.

    The equilibrium is the steady state whose torque is the last value of the reference, or, where the controller is a
    constant command, whose command is that one; the ankle stands where the run leaves it. Derivatives are exact.
    ScenarioError for a time outside the run, where there is no equilibrium, and for a valve that is on or off.

    at: a time of the run, such as '1.5 s', or 'equilibrium' (default): the steady state that holds the last value of
        the reference
    plugins: modules of your own, files or names, whose objects files may name

    >>> import ppafo
    >>> model = ppafo.linearise("torque-task-proportional", overrides={"reference.level": 3.0}).found
    >>> [f"{pole.real:.2f} 1/s" for pole in model.poles]
    ['-0.21 1/s', '-0.97 1/s']
    """
    name_plugins(plugins)
    from importlib.util import find_spec
    from numbers import Real

    from ppafo.analyses.linearise.answer import finding_of
    from ppafo.analyses.linearise.solve import (
        EQUILIBRIUM,
        MISSING_CASADI,
        equilibrium,
        model_at,
        point_at,
        valve_equations,
        without_slew_limit,
    )
    from ppafo.engine.rows import leaves
    from ppafo.errors import ScenarioError, UnitError, refused_as
    from ppafo.simulation.loading import scenario_or_load
    from ppafo.simulation.plan import plan_run
    from ppafo.translation.symbolic import both_sides
    from ppafo.units import parse_quantity

    if find_spec("casadi") is None:
        raise ScenarioError(MISSING_CASADI)
    chosen = scenario_or_load(scenario, overrides)
    run = plan_run(chosen)
    if chosen.supply_lines is not None:
        raise ScenarioError(f"{chosen.name}: linear models are for constant supplies; omit [supply_line]")
    chosen.device.check_vane("a linear model")
    # Of a valve that is on or off no small change of the command changes the openings or their movement.
    import casadi

    command = casadi.SX.sym("command")
    start = leaves(run.program.valve.initial())
    openings, moves = valve_equations(without_slew_limit(run), start, command, both_sides)
    slopes = casadi.Function("slopes", [command], [casadi.jacobian(casadi.vertcat(*openings, *moves), command)])
    if not any(abs(slope) > 0.0 for value in (-0.5, 0.5) for slope in slopes(value).nonzeros()):
        raise ScenarioError(
            f"{chosen.name}: valve '{chosen.device.valve_name}' is on or off, or moves at one speed: its flow "
            "has no derivative by the command; set device.valve to one that opens in proportion"
        )
    if at != EQUILIBRIUM and not isinstance(at, Real):
        with refused_as(ScenarioError, f"{chosen.name}: --at '{at}' is neither a time nor '{EQUILIBRIUM}'", UnitError):
            at = parse_quantity(str(at), "s")
    point = equilibrium(chosen) if isinstance(at, str) else point_at(chosen, at)
    return finding_of(model_at(chosen, run, point))
