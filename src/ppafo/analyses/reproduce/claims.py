"""Claims of publications with our values and verdicts, and files of claims, whose values are computed again."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.json_text import fields_of
from ppafo.errors import ScenarioError, SimulationError, UnitError, refused_as
from ppafo.model.plant import actuator_torque
from ppafo.parameters import load_device
from ppafo.parameters.publications.publication import FILE, PAPER, ClaimEntry, PublicationFile, read_publication
from ppafo.report.writing import quantity
from ppafo.units import from_si, parse_quantity
from ppafo.version import __version__
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import healthy_metrics, walk
from ppafo.wording import known_names, nearest_name

Verdict = Literal[
    "consistent", "inconsistent_as_reported", "met_by_fitted_settings", "plausible", "undetermined", "not_testable"
]
VERDICTS: dict[Verdict, tuple[str, str]] = {
    "consistent": ("✓", "the reported numbers agree with each other"),
    "inconsistent_as_reported": ("✗", "the reported numbers do not agree with each other"),
    "met_by_fitted_settings": ("≈", "simulated with settings chosen to meet this claim, which does not confirm them"),
    "plausible": ("~", "simulated with assumed settings that were not chosen to meet this claim"),
    "undetermined": ("?", "depends on settings that are not reported"),
    "not_testable": ("○", "needs a measurement that is not published"),
}
"""Symbol and meaning of each verdict; only the first two follow from reported numbers alone."""
ALL = "all"
"""Name of all studies together."""
WALK = "solenoid"
"""Name of the walk with direct event control."""


@dataclass(frozen=True, slots=True)
class Claim:
    """Claim of a publication, with the value computed by this package and the verdict.

    ``entry``: the statement, with its number or words and the range in which it holds
    ``value``: our value in the unit of the entry; None if it is no single number, or not computed
    ``note``: reason of the verdict, or the reservation with which a simulation shows a statement
    ``assumptions``: assumptions of our value beyond the publication
    ``found``: text displayed in place of ``value``; empty if not needed
    ``range``: smallest and largest of our values over unknown quantities
    ``publication``: file of the claim; None for the paper
    ``arguments``: arguments of the computation [SI]
    """

    entry: ClaimEntry
    verdict: Verdict = "not_testable"
    value: float | None = None
    note: str = ""
    assumptions: tuple[str, ...] = ()
    found: str = ""
    range: tuple[float, float] | None = None
    publication: PublicationFile | None = None
    arguments: Mapping[str, float] = field(default_factory=dict)

    @property
    def study(self) -> str:
        """Name of the publication."""
        return PAPER if self.publication is None else self.publication.name

    @property
    def source(self) -> str:
        """Publication, unless it is the paper, with page, section or equation."""
        citation = "" if self.publication is None else self.publication.citation
        return ", ".join(filter(None, (self.entry.source or citation, self.entry.where)))

    @property
    def published(self) -> str:
        """Published value as displayed text with its direction; empty for a computation of our own."""
        entry = self.entry
        number = "" if entry.published is None else f"{entry.published:g} {entry.unit.removeprefix('-')}".rstrip()
        return f"up to {number}" if number and entry.direction == "maximum" else entry.words or number

    @property
    def ours(self) -> str:
        """Value computed by this package for the claim, as displayed text."""
        return self.found or quantity(self.value, self.entry.unit or "-", 3)

    @property
    def limits(self) -> tuple[float, float]:
        """Range in which the claim holds, in its unit; a side that the file leaves open is infinite."""
        low = self.entry.at_least
        high = self.entry.at_most
        return -math.inf if low is None else low, math.inf if high is None else high

    @property
    def is_missed(self) -> bool:
        """True if the range of the claim is closed and our value is outside."""
        low, high = self.limits
        return math.isfinite(high - low) and (self.value is None or not low <= self.value <= high)

    def document(self) -> dict[str, Any]:
        """Return the claim as plain data for ``claims.json``."""
        entry = self.entry
        return {
            **fields_of(entry, "id", "statement", "direction", "words", "own", "unit", "computation", "arguments"),
            **fields_of(self, "study", "published", "value", "found", "range", "verdict", "assumptions", "note"),
            "source": self.source,
            "paper": entry.published,
            "agrees_from": entry.at_least,
            "agrees_to": entry.at_most,
        }


def in_words(verdict: str) -> str:
    """Return a verdict in words."""
    return verdict.replace("_", " ")


def verdict_counts(claims: Sequence[Claim]) -> dict[Verdict, int]:
    """Return the number of claims for each verdict, in the order of ``VERDICTS``."""
    return {verdict: sum(claim.verdict == verdict for claim in claims) for verdict in VERDICTS}


def count_sentence(claims: Sequence[Claim]) -> str:
    """Return the numbers of verdicts in words, for example ``16 claims: 2 consistent, 3 inconsistent as reported``."""
    counts = ", ".join(f"{count} {in_words(verdict)}" for verdict, count in verdict_counts(claims).items() if count)
    return f"{len(claims)} claims: {counts}"


@dataclass(frozen=True, slots=True)
class Studies:
    """Claims of a publication other than the paper, or of all publications, with verdicts."""

    study: str
    claims: tuple[Claim, ...]

    def json_document(self) -> dict[str, Any]:
        """Return claims with verdicts, and the number of claims for each verdict, as plain data in SI."""
        return {
            "study": self.study,
            "counts": verdict_counts(self.claims),
            "claims": [claim.document() for claim in self.claims],
            "versions": {"ppafo": __version__},
        }


def study_names() -> tuple[str, ...]:
    """Return the valid arguments of ``--study``."""
    return (PAPER, *(name for name in FILE.names() if name != PAPER), ALL)


def list_studies() -> list[dict[str, Any]]:
    """Return name and title of every study."""
    words = {name: read_publication(name)[0].title for name in FILE.names()} | {ALL: "every study, one table"}
    return [{"name": name, "title": words[name]} for name in study_names()]


def judge(claim: Claim) -> Claim:
    """Compute our value for a claim and judge it; SimulationError if a walk fails."""
    entry = claim.entry
    if not entry.computation:
        return claim
    compute, unit, _ = COMPUTATIONS[entry.computation]
    value = from_si(compute(**claim.arguments), entry.unit, unit)
    low, high = claim.limits
    # A model with assumptions that does not agree is no evidence against what was measured.
    agrees: Verdict = "plausible" if entry.assumed else "consistent"
    disagrees: Verdict = "undetermined" if entry.assumed else "inconsistent_as_reported"
    return replace(claim, value=value, verdict=agrees if low <= value <= high else disagrees)


def load_publication(name_or_path: str | Path) -> tuple[Claim, ...]:
    """Return the claims of a publication, by its name in the package or by its file, not judged yet.

    Raises ScenarioError for an invalid file.
    """
    publication, file = read_publication(name_or_path)
    claims = []
    for entry in publication.claims:
        where = f"{file}: claims.{entry.id}"
        claim = Claim(entry, note=entry.note or entry.not_testable, assumptions=entry.assumed, publication=publication)
        if bool(entry.computation) == bool(entry.not_testable):
            raise ScenarioError(f"{where}: give either computation, or not_testable with the reason")
        if entry.not_testable:
            claims.append(claim)
            continue
        if entry.computation not in COMPUTATIONS:
            known = known_names(entry.computation, COMPUTATIONS)
            raise ScenarioError(f"{where}.computation: '{entry.computation}' is unknown{known}")
        low, high = claim.limits
        stated = entry.published
        if low == -math.inf and high == math.inf:
            raise ScenarioError(f"{where}: give at_least, at_most or both, the range in which the claim holds")
        if low > high:
            raise ScenarioError(f"{where}: at_least = {low:g} must not exceed at_most = {high:g}")
        # A published number lies in its own range: else the range was typed wrongly.
        if stated is not None and not low <= stated <= high:
            limit = f"at_least = {low:g}" if stated < low else f"at_most = {high:g}"
            raise ScenarioError(f"{where}: published = {stated:g} is outside {limit}; widen the range")
        _, unit, takes = COMPUTATIONS[entry.computation]
        with refused_as(ScenarioError, f"{where}.unit", UnitError):
            # Only for what it raises: here the place in the file is known.
            from_si(1.0, entry.unit, unit)
        if entry.arguments.keys() != takes.keys():
            given = ", ".join(entry.arguments) or "none"
            known = ", ".join(takes) or "none"
            hints = "".join(nearest_name(name, takes) for name in entry.arguments if name not in takes)
            raise ScenarioError(f"{where}.arguments: {entry.computation} takes {known}; given: {given}{hints}")
        values = {}
        for name, unit in takes.items():
            key = f"{where}.arguments.{name}"
            text = entry.arguments[name]
            with refused_as(ScenarioError, key, UnitError):
                values[name] = parse_quantity(text, unit)
            # An absolute pressure does not lie below 0.
            if not 0.0 <= values[name] < math.inf:
                raise ScenarioError(f"{key} = '{text}': must be finite and at least 0 {unit}")
        claims.append(replace(claim, arguments=values))
    return tuple(claims)


# Several claims rest on one walk, which takes seconds.
@lru_cache(maxsize=16)
def _walked(*overrides: str) -> WalkResult:
    """Run the shipped walk with overrides; SimulationError if it does not reach its end."""
    # Without noise the strides repeat, so that longer walks give the same result.
    result = walk(load_walk(WALK, overrides), minutes=0.5)
    if not result.status.is_completed:
        raise SimulationError(f"walk '{WALK}' must be complete for a claim: {result.status.message}")
    return result


def held_torque(pressure: float) -> float:
    """Static torque [N m] at a supply pressure [Pa absolute]: torque constant times gauge pressure. Equation (2)."""
    return actuator_torque(pressure, STANDARD_ATMOSPHERE, load_device("ppafo2011").actuator.torque_constant)


def share_of_healthy_moment(pressure: float) -> float:
    """Static torque at a pressure [Pa absolute] divided by the largest ankle moment of the built-in gait [-]."""
    walking = walk_of(load_walk(WALK))
    moment = walking.gait.curve("ankle_moment").values_at(np.linspace(0.0, 1.0, 1001))
    return held_torque(pressure) / (walking.wearer.body_mass * float(moment.max()))


def walking_torque(pressure: float) -> float:
    """Peak torque [N m] of the mean stride of the walk 'solenoid' at a supply pressure [Pa absolute]."""
    # As repr, so that the walk has this very number. Nothing is published of a limit of the torque.
    walked = _walked(f"supply.pressure={pressure!r} SI", "controller.largest_torque=100 N m")
    return float(walked.averages["torque"].mean.max())


def dorsiflexor_share() -> float:
    """Dorsiflexor moment of a nondisabled wearer with the device divided by the moment without [-], stride means."""
    # The muscles of a nondisabled wearer keep the measured ankle angle.
    worn = _walked("wearer.keeps_gait=1")
    name = "dorsiflexor_moment"
    return worn.metrics[name].value / healthy_metrics(worn.scenario)[name].value


_OF_PRESSURE = {"pressure": "Pa_a"}
COMPUTATIONS: dict[str, tuple[Callable[..., float], str, Mapping[str, str]]] = {
    "held_torque": (held_torque, "N m", _OF_PRESSURE),
    "share_of_healthy_moment": (share_of_healthy_moment, "1", _OF_PRESSURE),
    "walking_torque": (walking_torque, "N m", _OF_PRESSURE),
    "dorsiflexor_share": (dorsiflexor_share, "1", {}),
}
"""Computations of files of claims by name: function, SI unit of its value, and SI units of its arguments by name."""
