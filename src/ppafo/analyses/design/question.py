"""Public function ``design``: sizing of a device for a wearer or a torque profile."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ppafo.arguments import FileOrName, Length, Mass, Minutes, Pressure, Threads, Torque, Word, checked
from ppafo.plugins import Plugins, name_plugins
from ppafo.progress import Report, report_nothing
from ppafo.units.shown import shown_in, written_text
from ppafo.wording import argument_text

if TYPE_CHECKING:
    from ppafo.analyses.design.profile.answer import Sizing
    from ppafo.analyses.design.profile.problem import SizingProblem
    from ppafo.analyses.design.wearer.requirements import WearerSizing
    from ppafo.report.finding import Finding

FOR_A_WEARER = {"mass": "72.5 kg", "stature": "1.85 m", "torque": "2.5 N m", "pressure": "50 psi_g", "minutes": "5"}
_UNITS = {"mass": "kg", "stature": "m", "torque": "N m", "pressure": "Pa_a", "minutes": "1", "toes": "m"}
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
    from ppafo.analyses.design.wearer.requirements import BODY_MASS_INDEX, DesignRequirements
    from ppafo.analyses.design.wearer.solve import size_for_wearer
    from ppafo.arguments.reading import units_given
    from ppafo.errors import StudyError
    from ppafo.parameters.parts.catalogue import DEFAULT
    from ppafo.walking.wearer import STATURES

    report = progress or report_nothing
    wished: dict[str, Any] = {"mass": mass, "stature": stature, "torque": torque, "pressure": pressure}
    wished |= {"minutes": minutes, "toes": toes, "catalogue": catalogue, "bottle": bottle, "gait": gait}
    given = {name: value for name, value in wished.items() if value is not None}
    if problem is None:
        lightest, heaviest = (BODY_MASS_INDEX * tall * tall for tall in STATURES)
        optional = ["stature"] if mass is None or lightest <= mass <= heaviest else []
        missing = [name for name in FOR_A_WEARER if name not in [*given, *optional]]
        with shown_in(units_given({"Pa_a": pressure, "N m": torque})):
            if mass is None or torque is None or pressure is None or minutes is None or missing:
                texts = FOR_A_WEARER | {"stature": "1.4 m" if mass is not None and mass < lightest else "1.85 m"}
                for name, value in given.items():
                    unit = _UNITS.get(name, "")
                    texts[name] = written_text(value, unit, unit="m" * (name == "stature")) if unit else str(value)
                words = [argument_text(name, text) for name, text in texts.items() if name in [*given, *missing]]
                python, command = f"ppafo.design({', '.join(words)})", f"ppafo design {' '.join(words)}"
                range_text = f" (derived from body mass only for {lightest:.1f} to {heaviest:.0f} kg)"
                needs = [argument_text(name) + range_text * (name == "stature") for name in missing]
                start = f"a design for a wearer also needs {', '.join(needs)}, for example"
                if not given:
                    start = "no design was given; name a design, give a .toml file, or describe the wearer:"
                raise StudyError(f"{start} {command if words[0].startswith('--') else python}")
            requirements = DesignRequirements(
                mass, stature, float(torque), float(pressure), 60.0 * minutes, toes, gait=gait
            )
            return wearer.finding_of(size_for_wearer(requirements, report, catalogue or DEFAULT, bottle))
    if given:
        raise StudyError(
            f"{', '.join(map(argument_text, given))} cannot be combined with a design file, which states the "
            "requirements; omit one of them"
        )
    chosen = load_design(problem) if isinstance(problem, str | Path) else problem
    return profile.finding_of(size_for_profile(chosen, threads, report))
