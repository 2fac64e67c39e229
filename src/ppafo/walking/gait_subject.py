"""Who walks where a walk file does not say it: the subject of the gait, or the paper's where no gait is named.

The paper's subject is scaled to the body mass and the stature of the gait's: masses with body mass, lengths with
stature, inertias with mass times length squared (``walking/anthropometry.py``). Tissue stays as it is.
"""

from dataclasses import replace

import numpy as np

from ppafo.errors import ScenarioError
from ppafo.gait import Gait
from ppafo.gait.plausible import gait_file_remarks
from ppafo.simulation.declaration import value_at
from ppafo.simulation.reading import Reading
from ppafo.simulation.scenario import Scenario
from ppafo.walking.anthropometry import Build, segment_values
from ppafo.walking.motion import walk_of
from ppafo.walking.wearer import WEARER, Wearer, paper_subject

SHANK_SHARE = 0.246
"""Knee to ankle as a share of the stature: figure 4.1 of Winter, Biomechanics and Motor Control of Human Movement, 4th
ed. 2009. The paper prints a shank of 0.46 m and no stature, which makes 1.87 m."""

_SAME = 1.0e-3
"""Share of the body mass that is rounding."""


def gait_subject(gait: Gait) -> Wearer:
    """Return the wearer with body mass, and lengths where the stature is known, of the subject of a gait."""
    paper = paper_subject()
    stature = 1.0 if gait.stature is None else SHANK_SHARE * gait.stature / paper.shank_length
    build = Build(np.array([gait.body_mass / paper.body_mass]), np.array([stature]))
    segments = {name: float(values[0]) for name, values in segment_values(paper, build).items()}
    return replace(paper, **segments)


def read_wearer(reading: Reading, gait: Gait, is_named: bool) -> Wearer:
    """Return the wearer of a walk file; what it leaves out is of the gait's subject, or of the paper's by default."""
    if not is_named:
        return Wearer(**reading.section("wearer", WEARER))
    subject = gait_subject(gait)
    quantities = tuple(replace(item, default=getattr(subject, item.name)) for item in WEARER)
    for item in quantities:
        value = getattr(subject, item.name)
        if not item.minimum <= value <= item.maximum and value_at(reading.document, f"wearer.{item.name}") is None:
            raise ScenarioError(
                f"{reading.file}: gait '{gait.name}' is of a subject of {gait.body_mass:g} kg, which makes "
                f"wearer.{item.name} {value:.3g} {item.unit}; a wearer has {item.minimum:g} to {item.maximum:g} "
                f"{item.unit}: give wearer.{item.name}"
            )
    return Wearer(**reading.section("wearer", quantities))


def wearer_origin(reading: Reading, gait: Gait, is_named: bool) -> str:
    """Return where the body mass of the wearer comes from, in words."""
    if value_at(reading.document, "wearer.body_mass") is not None:
        return "as wearer.body_mass states"
    return f"the subject of gait '{gait.name}'" if is_named else "the paper's subject"


def who_walks(wearer: Wearer, gait: Gait, origin: str) -> str:
    """Return one line on the person who walks, and on the gait's own subject where that is another."""
    line = f"wearer: {wearer.body_mass:.4g} kg, {origin}"
    if origin.startswith("the subject of"):
        return line if gait.stature is None else f"{line}, {gait.stature:.4g} m"
    if abs(wearer.body_mass - gait.body_mass) <= _SAME * gait.body_mass:
        return line
    return (
        f"{line}; the subject of gait '{gait.name}' has {gait.body_mass:.4g} kg: moment and force of the gait are "
        "scaled by body mass"
    )


def person_remarks(configuration: Scenario) -> list[str]:
    """Return who walks, and what is odd about the zero of the gait's ankle."""
    gait = walk_of(configuration).gait
    remarks = [f"remark: {text}" for text in gait_file_remarks(gait)]
    return [who_walks(walk_of(configuration).wearer, gait, walk_of(configuration).wearer_origin), *remarks]
