"""The device for what was given: a wearer, a torque profile, or tasks with what may be chosen for them."""

from pathlib import Path

from ppafo.analyses.design.front import answer as front
from ppafo.analyses.design.front.answer import Design
from ppafo.analyses.design.front.problem import DesignProblem, with_seed
from ppafo.analyses.design.front.solve import find_front
from ppafo.analyses.design.loading import load_design
from ppafo.analyses.design.profile import answer as profile
from ppafo.analyses.design.profile.answer import Sizing, size_for_profile
from ppafo.analyses.design.profile.problem import SizingProblem
from ppafo.analyses.design.wearer import solve as wearer
from ppafo.analyses.design.wearer.solve import WearerSizing, Wish, size_for_wearer
from ppafo.errors import StudyError
from ppafo.linear_algebra import on_one_thread
from ppafo.progress import Report, report_nothing
from ppafo.report.finding import Finding

FOR_A_WEARER = "--mass '72.5 kg' --torque '2.5 N m' --pressure '50 psi_g' --minutes 5"


@on_one_thread
def design(
    problem: DesignProblem | SizingProblem | str | Path | None = None,
    seed: int | None = None,
    threads: int | None = None,
    mass: float | None = None,
    stature: float | None = None,
    torque: float | None = None,
    pressure: float | None = None,
    minutes: float | None = None,
    progress: Report | None = None,
) -> Finding[Design] | Finding[Sizing] | Finding[WearerSizing]:
    """Return the device for a wearer or for a torque profile, or the designs that no other beats.

    A wearer has a body ``mass`` [kg] and may have a ``stature`` [m]; ``torque`` [N m], ``pressure`` [Pa absolute]
    and ``minutes`` of walking [min] are what the device is for. Without a wearer, ``problem`` is a problem, or the name
    or path of a design file; ``seed`` replaces the random seed of one with tasks. StudyError or ParameterError for bad
    input, and where every run with a valve fails.
    """
    wished = {"mass": mass, "torque": torque, "pressure": pressure, "minutes": minutes}
    report = progress or report_nothing
    if problem is None:
        # A stature may be left out, so it is not among them.
        missing = [f"--{name}" for name, value in wished.items() if value is None]
        if len(missing) == len(wished) and stature is None:
            raise StudyError(f"no design was given: name one, give a .toml file, or for a wearer {FOR_A_WEARER}")
        if mass is None or torque is None or pressure is None or minutes is None:
            raise StudyError(f"for a wearer give {', '.join(missing)} too, for example {FOR_A_WEARER}")
        if seed is not None:
            raise StudyError("--seed: nothing is drawn for a wearer; leave it out")
        return wearer.finding_of(size_for_wearer(Wish(mass, stature, torque, pressure, 60.0 * minutes), report))
    given = [f"--{name}" for name, value in {**wished, "stature": stature}.items() if value is not None]
    if given:
        raise StudyError(f"{', '.join(given)}: the design file states what is wanted; give one or the other")
    chosen = load_design(problem, seed) if isinstance(problem, str | Path) else problem
    if isinstance(chosen, SizingProblem):
        return profile.finding_of(size_for_profile(chosen, threads, report))
    # A file has taken the seed as it was loaded.
    if seed is not None and chosen is problem:
        chosen = with_seed(chosen, seed)
    return front.finding_of(find_front(chosen, threads, report))
