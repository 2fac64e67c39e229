"""Sizing of a device for a torque profile: valve, supply pressure, gains and bottle."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.arguments import Threads, Word, checked
from ppafo.errors import StudyError
from ppafo.plugins import Plugins
from ppafo.progress import Report, report_nothing

if TYPE_CHECKING:
    from ppafo.analyses.design.problem import SizingProblem
    from ppafo.analyses.design.search import Sizing
    from ppafo.report.finding import Finding


@checked
def design(
    problem: Annotated[SizingProblem | str | Path, Word("DESIGN")],
    *,
    profile: Annotated[str | Path, Word("PROFILE")] | None = None,
    threads: Threads | None = None,
    plugins: Plugins = (),
    progress: Report | None = None,
) -> Finding[Sizing]:
    """Find valve, supply pressure, gains and bottle for a torque profile.

    Arguments:
        problem: name of a design file, or a .toml file
        profile: torque profile in place of the file's: a recording, or a share of the ankle moment of a wearer, such
            as 'gait:falisse2019-subject1,mass=72.6 kg,share=0.05'
        threads: number of threads; default: all cores
        plugins: modules of your own, files or names, whose objects files may name
        progress: called with every count of a long computation

    Returns:
        a Finding whose ``found`` is the sizing: every valve that was tried, and the one suggested

    Raises:
        StudyError: a problem or profile that cannot be used, and a valve with which every run fails
        ParameterError: a parameter set or a bottle that cannot be used

    >>> from dataclasses import replace
    >>> import ppafo
    >>> problem = ppafo.load_design("push-off")
    >>> ppafo.design(replace(problem, gain_factors=(1.0,), largest_error=1.0)).found.choice.bottle.name
    'paper-co2-9oz'
    """
    from ppafo.analyses.design.problem import load_design
    from ppafo.analyses.design.search import finding_of, size_for_profile

    if isinstance(problem, str | Path):
        problem = load_design(problem, profile=profile)
    elif profile is not None:
        raise StudyError("a loaded design takes no profile; give it to load_design")
    return finding_of(size_for_profile(problem, threads, progress or report_nothing))
