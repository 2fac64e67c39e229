"""The device for what was given: a wearer, a torque profile, or tasks with what may be chosen for them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.arguments import FileOrName, Length, Mass, Minutes, Pressure, Seed, Threads, Torque, Word, checked
from ppafo.plugins import Plugins, name_plugins
from ppafo.progress import Report, report_nothing

if TYPE_CHECKING:
    from ppafo.analyses.design.front.answer import Design
    from ppafo.analyses.design.front.problem import DesignProblem
    from ppafo.analyses.design.profile.answer import Sizing
    from ppafo.analyses.design.profile.problem import SizingProblem
    from ppafo.analyses.design.wearer.wish import WearerSizing
    from ppafo.report.finding import Finding

DesignLike = Annotated["DesignProblem | SizingProblem | str | Path", Word("DESIGN")]


@checked("problem", "seed", "threads")
def design(
    problem: DesignLike | None = None,
    *,
    seed: Seed | None = None,
    threads: Threads | None = None,
    mass: Mass | None = None,
    stature: Length | None = None,
    torque: Torque | None = None,
    pressure: Pressure | None = None,
    minutes: Minutes | None = None,
    toes: Length | None = None,
    catalogue: FileOrName | None = None,
    plugins: Plugins = (),
    progress: Report | None = None,
) -> Finding[Design] | Finding[Sizing] | Finding[WearerSizing]:
    """Find a device: for a wearer, for a torque profile, or Pareto-optimal in error, gas and mass.

    A wearer has a body mass and may have a stature; torque, pressure and minutes of walking are what the device is for,
    and the toes have to clear the ground.
    StudyError or ParameterError for bad input, and where every run with a valve fails.

    problem: name of a design file, or a .toml file
    mass: body mass of the wearer, '72.5 kg'
    stature: height of the wearer, '1.75 m'; default: of a body mass index of 22 kg/m^2
    torque: peak torque of push-off, '2.5 N m'
    pressure: supply pressure, '50 psi_g'
    minutes: minutes of walking on one bottle
    toes: lowest height of the toes in mid-swing; default: '1 cm', or the healthy gait's own where that is less
    catalogue: a .toml file with parts of your own; default: the catalogue of the package
    plugins: modules of your own, files or names, whose objects files may name

    >>> import ppafo
    >>> from dataclasses import replace
    >>> problem = ppafo.load_design("torque-task")
    >>> search = problem.search.model_copy(update={"screening": 256, "population": 16, "generations": 2})
    >>> print(ppafo.design(replace(problem, search=search)).said[0])
    The paper's torque task with parts and settings free: error, gas per task and mass against each other.
    """
    name_plugins(plugins)
    from ppafo.analyses.design.front import answer as front
    from ppafo.analyses.design.front.problem import with_seed
    from ppafo.analyses.design.front.solve import find_front
    from ppafo.analyses.design.loading import load_design
    from ppafo.analyses.design.profile import answer as profile
    from ppafo.analyses.design.profile.problem import SizingProblem
    from ppafo.analyses.design.profile.solve import size_for_profile
    from ppafo.analyses.design.solve import FOR_A_WEARER
    from ppafo.analyses.design.wearer import answer as wearer
    from ppafo.analyses.design.wearer.solve import size_for_wearer
    from ppafo.analyses.design.wearer.wish import Wish
    from ppafo.errors import StudyError
    from ppafo.parameters.parts.catalogue import DEFAULT

    wished = {"mass": mass, "torque": torque, "pressure": pressure, "minutes": minutes}
    report = progress or report_nothing
    if problem is None:
        # Stature, toes and catalogue may be left out, so they are not among them.
        missing = [f"--{name}" for name, value in wished.items() if value is None]
        if len(missing) == len(wished) and stature is None:
            raise StudyError(f"no design was given: name one, give a .toml file, or for a wearer {FOR_A_WEARER}")
        if mass is None or torque is None or pressure is None or minutes is None:
            raise StudyError(f"for a wearer give {', '.join(missing)} too, for example {FOR_A_WEARER}")
        if seed is not None:
            raise StudyError("--seed: nothing is drawn for a wearer; leave it out")
        wish = Wish(mass, stature, torque, pressure, 60.0 * minutes, toes)
        return wearer.finding_of(size_for_wearer(wish, report, DEFAULT if catalogue is None else catalogue))
    of_a_wearer = {**wished, "stature": stature, "toes": toes, "catalogue": catalogue}
    named = [f"--{name}" for name, value in of_a_wearer.items() if value is not None]
    if named:
        raise StudyError(f"{', '.join(named)}: the design file states what is wanted; give one or the other")
    chosen = load_design(problem, seed=seed) if isinstance(problem, str | Path) else problem
    if isinstance(chosen, SizingProblem):
        return profile.finding_of(size_for_profile(chosen, threads, report))
    # A file has taken the seed as it was loaded.
    if seed is not None and chosen is problem:
        chosen = with_seed(chosen, seed)
    return front.finding_of(find_front(chosen, threads, report))
