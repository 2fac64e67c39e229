"""Public function ``design``: sizing of a device for a wearer or a torque profile."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.arguments import FileOrName, Length, Mass, Minutes, Pressure, Threads, Torque, Word, checked
from ppafo.plugins import Plugins, name_plugins
from ppafo.progress import Report, report_nothing
from ppafo.units.shown import shown_in
from ppafo.wording import argument_text

if TYPE_CHECKING:
    from ppafo.analyses.design.profile.answer import Sizing
    from ppafo.analyses.design.profile.problem import SizingProblem
    from ppafo.analyses.design.wearer.requirements import WearerSizing
    from ppafo.report.finding import Finding

FOR_A_WEARER = {"mass": "72.5 kg", "torque": "2.5 N m", "pressure": "50 psi_g", "minutes": "5"}
DesignLike = Annotated["SizingProblem | str | Path", Word("DESIGN")]


@checked
def design(
    problem: DesignLike | None = None,
    *,
    threads: Threads | None = None,
    mass: Mass | None = None,
    stature: Length | None = None,
    torque: Torque | None = None,
    pressure: Pressure | None = None,
    minutes: Minutes | None = None,
    toes: Length | None = None,
    catalogue: FileOrName | None = None,
    bottle: FileOrName | None = None,
    gait: FileOrName | None = None,
    plugins: Plugins = (),
    progress: Report | None = None,
) -> Finding[Sizing] | Finding[WearerSizing]:
    """Find a device: for a wearer or for a torque profile.

    A wearer is described by body mass and, optionally, stature. The device must provide the torque at the pressure for
    the minutes of walking, and the toes must clear the ground. Numbers in Python are in SI units, minutes in minutes;
    texts have their unit.

    Arguments:
        problem: name of a design file, or a .toml file
        threads: number of threads; default: all cores
        mass: body mass of the wearer, '72.5 kg'
        stature: height of the wearer, '1.75 m'; default: of a body mass index of 22 kg/m^2, for 46.3 to 88 kg;
            children need it
        torque: peak torque of push-off, '2.5 N m'
        pressure: supply pressure, '50 psi_g'
        minutes: minutes of walking on one bottle
        toes: lowest height of the toes in mid-swing; default: '1 cm', or the healthy gait's own where that is less
        catalogue: a .toml file with parts of your own; default: the catalogue of the package
        bottle: name or file of the bottle, as of 'walk', whose gas feeds the device; default: the lightest of the
            catalogue
        gait: name or file of the wearer's gait, as of 'walk'; default: the built-in gait of an adult
        plugins: modules of your own, files or names, whose objects files may name
        progress: called with every count of a long computation

    Returns:
        a Finding whose ``found`` is the sizing: every part that was tried, and the one suggested

    Raises:
        StudyError: a problem that cannot be used, and a valve with which every run fails
        ParameterError: a catalogue or a parameter set that cannot be used

    >>> from dataclasses import replace
    >>> import ppafo
    >>> problem = ppafo.load_design("push-off")
    >>> ppafo.design(replace(problem, gain_factors=(1.0,), largest_error=1.0)).found.choice.bottle.name
    'pipeline-jacpac-9oz'
    """
    name_plugins(plugins)
    from ppafo.analyses.design.loading import load_design
    from ppafo.analyses.design.profile import answer as profile
    from ppafo.analyses.design.profile.solve import size_for_profile
    from ppafo.analyses.design.wearer import answer as wearer
    from ppafo.analyses.design.wearer.requirements import DesignRequirements
    from ppafo.analyses.design.wearer.solve import size_for_wearer
    from ppafo.arguments.reading import units_given
    from ppafo.errors import StudyError
    from ppafo.parameters.parts.catalogue import DEFAULT
    from ppafo.simulation.tracking.pair_step import warn_of_coarse_pairs

    wished = {"mass": mass, "torque": torque, "pressure": pressure, "minutes": minutes}
    report = progress or report_nothing
    example = " ".join(argument_text(*pair) for pair in FOR_A_WEARER.items())
    if problem is None:
        # Stature, toes and catalogue may be left out, so they are not among them.
        missing = [argument_text(name) for name, value in wished.items() if value is None]
        if len(missing) == len(wished) and stature is None:
            raise StudyError(
                f"no design was given; name a design, give a .toml file, or describe the wearer: {example}"
            )
        if mass is None or torque is None or pressure is None or minutes is None:
            raise StudyError(f"a design for a wearer also needs {', '.join(missing)}, for example {example}")
        seconds = 60.0 * minutes
        requirements = DesignRequirements(mass, stature, float(torque), float(pressure), seconds, toes, gait=gait)
        with shown_in(units_given({"Pa_a": pressure, "N m": torque})):
            parts = DEFAULT if catalogue is None else catalogue
            return wearer.finding_of(size_for_wearer(requirements, report, parts, bottle))
    of_a_wearer = {**wished, "stature": stature, "toes": toes, "catalogue": catalogue}
    of_a_wearer |= {"bottle": bottle, "gait": gait}
    named = [argument_text(name) for name, value in of_a_wearer.items() if value is not None]
    if named:
        raise StudyError(
            f"{', '.join(named)} cannot be combined with a design file, which states the requirements; omit one of them"
        )
    chosen = load_design(problem) if isinstance(problem, str | Path) else problem
    warn_of_coarse_pairs([chosen.scenario])
    return profile.finding_of(size_for_profile(chosen, threads, report))
