"""Public function ``identify``: identification of a parameter set from bench recordings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.arguments import Word, checked
from ppafo.plugins import Plugins, name_plugins
from ppafo.progress import Report, report_nothing

if TYPE_CHECKING:
    from ppafo.analyses.identify.answer import Identification
    from ppafo.report.finding import Finding

Problem = Annotated[str | Path, Word("PROBLEM", Path)]


@checked
def identify(
    problem: Problem,
    *,
    plugins: Plugins = (),
    progress: Report = report_nothing,
) -> Finding[Identification]:
    """Identify a parameter set, with uncertainty, from bench recordings.

    The procedures of the problem file run in the recommended order; the trajectory fit comes last and starts from the
    estimates of the procedures.

    Arguments:
        problem: a problem file (.toml); see 'ppafo doctor --schema identification'
        plugins: modules of your own, files or names, whose objects files may name
        progress: called with every count of a long computation

    Returns:
        a Finding whose ``found`` is an Identification: estimates in SI units with their uncertainty, and the new
        parameter set

    Raises:
        IdentificationError: a problem that makes no sense
        ParameterError: a parameter set that makes no sense
        DataError: a recording that cannot be read

    >>> import ppafo
    >>> from ppafo.cli.new import new
    >>> written = new("example", "measured-cylinder")
    >>> print(str(ppafo.identify("measured-cylinder/cylinder.toml")).splitlines()[0])
    static-torque: 80 readings, 80 repetitions; area 520.1 mm^2, friction in motion 4.14 N; scatter 0.233 N
    """
    name_plugins(plugins)
    from ppafo.analyses.identify.answer import finding_of
    from ppafo.analyses.identify.solve import solve_problem
    from ppafo.identification.problem import load_problem

    path = Path(problem)
    return finding_of(solve_problem(load_problem(path), path.parent, path.name, progress))
